/* Factored bases under replaced columns, against the columns themselves. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "linalg/bases.h"

/* Column k of the pool comes in where its spike is largest among positions that may leave. */
static void bring_in(bench *b, int32_t column)
{
    const int32_t n = b->columns.n;
    double *spike = check_allocate((size_t)n, sizeof *spike);
    int32_t r = 0, i;

    perp__basis_solve(&b->basis, b->columns.dense + (size_t)column * (size_t)n, spike);
    for (i = 1; i < n; i++)
        if (fabs(spike[i]) > fabs(spike[r]))
            r = i;
    b->chosen[r] = column;
    if (spike[r] != 0.0)
        perp__basis_replace(&b->basis, r, spike);
    free(spike);
}

/* Products of up to 12 elementary matrices with pivots that are the largest of their spikes: errors
 * grow by a modest factor each; 1e-10 leaves it room and is far from what a wrong entry gives. */
static void test_replacements(void **state)
{
    static const int32_t orders[] = {1, 2, 5, 40, 90};
    gen_random random;
    size_t k;

    (void)state;
    gen_seed(&random, 51);
    for (k = 0; k < sizeof orders / sizeof orders[0]; k++) {
        const int32_t n = orders[k];
        bench b;
        int32_t step, loads = 0;

        open_bench(&b, context, make_pool(&random, n, 3 * n), 12, 8 * (size_t)n);
        assert_int_equal(load(&b), PERP_OK);
        require_solves(&b, &random, tolerance_of(n));
        for (step = 0; step < 60; step++) {
            if (!perp__basis_has_room(&b.basis)) {
                assert_int_equal(load(&b), PERP_OK);
                require_solves(&b, &random, tolerance_of(n));
                loads++;
            }
            bring_in(&b, gen_integer(&random, 4 * n));
            require_solves(&b, &random, 1e-10);
        }
        assert_true(loads > 0);
        close_bench(&b);
    }
}

/* Loaded from other columns than the slacks; the same columns give the same bits, whatever was
 * loaded or replaced before. */
static void test_loads(void **state)
{
    enum { N = 60 };
    gen_random random;
    double a[N], x[N], y[N];
    int32_t kept[N];
    bench b;
    int32_t round, i;

    (void)state;
    gen_seed(&random, 52);
    open_bench(&b, context, make_pool(&random, N, 2 * N), 5, 5 * N);
    for (round = 0; round < 20; round++) {
        for (i = 0; i < N; i++)
            b.chosen[i] = gen_integer(&random, round + 1) ? N + i + N * (i % 2) : i;
        assert_int_equal(load(&b), PERP_OK);
        require_solves(&b, &random, tolerance_of(N));
        memcpy(kept, b.chosen, sizeof kept);
        for (i = 0; i < N; i++)
            a[i] = gen_normal(&random);
        perp__basis_solve(&b.basis, a, x);
        bring_in(&b, N + gen_integer(&random, N));
        require_solves(&b, &random, 1e-10);
        for (i = 0; i < N; i++)
            b.chosen[i] = i;
        assert_int_equal(load(&b), PERP_OK);
        perp__basis_solve(&b.basis, a, y);
        assert_memory_equal(a, y, sizeof a); /* the unit matrix */
        assert_true(perp__basis_condition(&b.basis) == 1.0);
        memcpy(b.chosen, kept, sizeof kept);
        assert_int_equal(load(&b), PERP_OK);
        perp__basis_solve(&b.basis, a, y);
        assert_memory_equal(x, y, sizeof x);
    }
    close_bench(&b);
}

/* Symmetric, general, or tridiagonal. */
static matrix make_parent(gen_random *random, int32_t n, int kind)
{
    matrix random_one = matrix_random(random, n, 1), S = matrix_zero(n);
    int32_t i, j;

    for (j = 0; j < n; j++)
        for (i = 0; i < n; i++)
            if (kind < 2 || abs(i - j) < 2)
                S.dense[i + n * j] = random_one.dense[i + n * j] * (kind > 0 && i > j ? 0.5 : 1.0);
    matrix_compress(&S);
    matrix_release(&random_one);
    return S;
}

/* Columns [I, -Sigma S Sigma] of a principal part of a larger S: with the matrix's own factors and
 * by KLU, the same solutions. */
static void test_principal(void **state)
{
    enum { ORDER = 80, N = 70 };
    gen_random random;
    int32_t index[N], round, i, j;
    int8_t sign[N];
    int kind;

    (void)state;
    gen_seed(&random, 56);
    for (kind = 0; kind < 3; kind++) {
        matrix S = make_parent(&random, ORDER, kind);
        perp__matrix view = sparse_view(&S);
        perp__sparse_block block;
        bench b;

        memset(&block, 0, sizeof block);
        block.context = context;
        assert_int_equal(perp__sparse_block_read(&block, &view, NULL), PERP_OK);
        open_bench(&b, context, make_pool(&random, N, N), 8, 8 * N);
        for (i = 0; i < N; i++) {
            index[i] = i + i / 8;
            sign[i] = gen_integer(&random, 2) ? 1 : -1;
        }
        for (j = 0; j < N; j++)
            for (i = 0; i < N; i++)
                b.columns.dense[i + N * (N + j)] =
                    -sign[i] * sign[j] * S.dense[index[i] + ORDER * index[j]];
        b.principal.block = &block;
        b.principal.index = index;
        b.principal.sign = sign;
        for (round = 0; round < 30; round++) {
            const int32_t astray = gen_integer(&random, N);

            for (i = 0; i < N; i++)
                b.chosen[i] = gen_integer(&random, 4) ? N + i : i;
            if (round % 3 == 2) { /* not principal: a slack out of its place */
                b.chosen[astray] = N + astray;
                b.chosen[(astray + 1) % N] = astray;
            }
            if (load(&b) == PERP__FACTOR_SINGULAR)
                continue;
            assert_int_equal(b.basis.principal.block != NULL, round % 3 != 2);
            require_solves(&b, &random, 1e-10);
            assert_true(perp__basis_condition(&b.basis) > 1e-6);
            bring_in(&b, N + astray);
            require_solves(&b, &random, 1e-9);
        }
        close_bench(&b);
        perp__sparse_block_release(&block);
        matrix_release(&S);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_replacements),
        cmocka_unit_test(test_loads),
        cmocka_unit_test(test_principal),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
