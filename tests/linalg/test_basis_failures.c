/* Bases that are singular, empty, or without memory. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "linalg/bases.h"
#include "memory.h"

/* Two slacks in one row, a column of zeros, two columns that are the same: said to be singular, and
 * what is loaded next is right. Of the two that are the same elimination may leave a rounding error
 * instead of a zero (it does in a build with clang): then the condition says it. */
static void test_singular(void **state)
{
    enum { N = 20 };
    gen_random random;
    bench b;
    perp_status status;
    int kind;

    (void)state;
    gen_seed(&random, 53);
    open_bench(&b, context, make_pool(&random, N, N), 4, 4 * N);
    memset(b.columns.dense + (size_t)(2 * N - 1) * N, 0, N * sizeof(double));
    for (kind = 0; kind < 4; kind++) {
        int32_t i;

        for (i = 0; i < N; i++)
            b.chosen[i] = kind < 2 ? i : N + i;
        b.chosen[N - 1] = kind == 0 ? 3 : kind == 1 ? 2 * N - 1 : kind == 2 ? N + 4 : 2 * N - 1;
        status = load(&b);
        if (kind == 2 && status == PERP_OK)
            assert_true(perp__basis_condition(&b.basis) < 1e-14); /* eps and a factor for growth */
        else
            assert_int_equal(status, PERP__FACTOR_SINGULAR);
        b.chosen[N - 1] = N - 1;
        assert_int_equal(load(&b), PERP_OK);
        require_solves(&b, &random, tolerance_of(N));
    }
    close_bench(&b);
}

static void test_order_zero(void **state)
{
    gen_random random;
    bench b;

    (void)state;
    gen_seed(&random, 54);
    open_bench(&b, context, make_pool(&random, 0, 0), 1, 1);
    assert_int_equal(load(&b), PERP_OK);
    perp__basis_solve(&b.basis, NULL, NULL);
    perp__basis_solve_transposed(&b.basis, NULL, NULL);
    assert_true(perp__basis_condition(&b.basis) == 1.0);
    close_bench(&b);
}

/* The first load allocates and may fail, later ones ask for nothing, whatever their kernels. */
static void test_memory(void **state)
{
    enum { N = 30 };
    perp_context_settings settings;
    memory f = {0, 0, 0};
    perp_context *failing_context;
    perp_status status = PERP_ERROR_MEMORY;
    gen_random random;
    bench b;
    int32_t k, i;

    (void)state;
    gen_seed(&random, 55);
    settings = memory_settings(&f);
    assert_int_equal(perp_context_create(&failing_context, &settings), PERP_OK);
    open_bench(&b, failing_context, make_pool(&random, N, N), 4, 4 * N);
    for (k = 1; status != PERP_OK; k++) {
        const int32_t alive = f.live;

        f.calls = 0;
        f.fails_at = k;
        status = load(&b);
        if (status != PERP_OK) {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_int_equal(f.live, alive);
        }
    }
    assert_true(k > 2);
    f.calls = f.fails_at = 0;
    for (k = 0; k < 10; k++) {
        for (i = 0; i < N; i++)
            b.chosen[i] = gen_integer(&random, 10) < k ? N + i : i;
        assert_int_equal(load(&b), PERP_OK);
        require_solves(&b, &random, tolerance_of(N));
    }
    assert_int_equal(f.calls, 0);
    close_bench(&b);
    perp_context_destroy(failing_context);
    assert_int_equal(f.live, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_singular),
        cmocka_unit_test(test_order_zero),
        cmocka_unit_test(test_memory),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
