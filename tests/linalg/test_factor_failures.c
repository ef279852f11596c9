/* Factorisations of what can't be factored, and without memory. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "linalg/squares.h"
#include "memory.h"

/* Singular without a doubt: a zero row, a zero column, rows that are equal, NaN and infinities. A
 * matrix that is not comes next and is factored by the same object. */
static void test_singular(void **state)
{
    enum { N = 6, KINDS = 6 };
    static const double poison[] = {NAN, INFINITY, -INFINITY};
    gen_random random;
    int kind;

    (void)state;
    gen_seed(&random, 3);
    for (kind = 0; kind < KINDS; kind++) {
        matrix A = matrix_zero(N);
        perp__factor *factor;
        perp__square view;
        perp_status found;
        double condition;
        int32_t i, j;

        for (i = 0; i < N * N; i++)
            A.dense[i] = i % (N + 1) == 0 ? 8.0 : 1.0;
        matrix_compress(&A);
        factor = analysed(&A);
        view = view_of(&A);
        for (i = 0; i < N && kind < 3; i++) {
            A.dense[2 + N * i] = kind == 2 ? A.dense[4 + N * i] : 0.0;
            if (kind == 1)
                for (j = 0; j < N; j++)
                    A.dense[j + N * 2] = 0.0;
        }
        if (kind == 2) /* and symmetric again: rows and columns 2 and 4 equal */
            for (i = 0; i < N; i++)
                A.dense[i + N * 2] = A.dense[i + N * 4] = A.dense[2 + N * i] = A.dense[4 + N * i] =
                    i == 2 || i == 4 ? 8.0 : 1.0;
        if (kind >= 3)
            A.dense[N + 1] = poison[kind - 3];
        matrix_compress(&A);
        found = factored(factor, &A);
        condition = found == PERP_OK ? reciprocal_of(factor, &view) : 0.0;
        /* where equal rows are added up in different orders, rounding leaves a pivot */
        if (found != PERP__FACTOR_SINGULAR ? kind != 2 || condition > N * UNIT : condition != 0.0)
            fail_msg("kind %d: %d, condition %g", kind, (int)found, condition);
        for (i = 0; i < N * N; i++)
            A.dense[i] = i % (N + 1) == 0 ? 8.0 : -1.0;
        matrix_compress(&A);
        assert_int_equal(factored(factor, &A), PERP_OK);
        check_solves(&random, factor, &A, tolerance_of(N));
        perp__klu_destroy(factor);
        matrix_release(&A);
    }
}

/* A pattern that no values make regular. */
static void test_structurally_singular(void **state)
{
    (void)state;
    matrix A = matrix_zero(4);
    perp__factor *factor;
    int32_t i;

    for (i = 0; i < 4; i++)
        A.dense[i] = A.dense[4 * i] = 1.0; /* an arrow without a shaft */
    matrix_compress(&A);
    factor = analysed(&A);
    assert_int_equal(factored(factor, &A), PERP__FACTOR_SINGULAR);
    perp__klu_destroy(factor);
    matrix_release(&A);
}

static void test_allocation_failures(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 5);
    matrix A = matrix_random(&random, 10, 1);
    const perp__square view = view_of(&A);
    perp_status status = PERP_ERROR_MEMORY;
    int32_t k;

    for (k = 1; status != PERP_OK; k++) {
        memory f = {0, 0, 0};
        perp_context *own;
        perp_context_settings settings;
        perp__factor *factor = NULL;

        settings = memory_settings(&f);
        assert_int_equal(perp_context_create(&own, &settings), PERP_OK);
        f.fails_at = f.calls + k;
        status = perp__klu_analyse(own, &factor, &view);
        if (status == PERP_OK) {
            /* what follows allocates nothing of ours */
            f.fails_at = f.calls + 1;
            assert_int_equal(perp__klu_factor(factor, &view), PERP_OK);
            assert_int_equal(perp__klu_factor(factor, &view), PERP_OK);
            check_solves(&random, factor, &A, tolerance_of(10));
            assert_true(reciprocal_of(factor, &view) > 0.0);
            perp__klu_destroy(factor);
        } else {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_null(factor);
            assert_non_null(strstr(perp_context_message(own), "out of memory"));
        }
        assert_int_equal(f.live, 1); /* the context */
        perp_context_destroy(own);
        assert_int_equal(f.live, 0);
    }
    assert_true(k > 2);
    matrix_release(&A);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_singular),
        cmocka_unit_test(test_structurally_singular),
        cmocka_unit_test(test_allocation_failures),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
