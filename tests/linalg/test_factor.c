/* Sparse factorisations by KLU; dense ones are in test_blas.c. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "linalg/squares.h"

static void test_random(void **state)
{
    static const int32_t orders[] = {0, 1, 2, 3, 10, 48, 49, 120};
    gen_random random;
    size_t k;
    int round;

    (void)state;
    gen_seed(&random, 1);
    for (k = 0; k < sizeof orders / sizeof orders[0]; k++) {
        matrix A = matrix_random(&random, orders[k], 0);
        perp__factor *factor = analysed(&A);
        int32_t i;

        for (round = 0; round < 3; round++) {
            assert_int_equal(factored(factor, &A), PERP_OK);
            check_solves(&random, factor, &A, tolerance_of(A.n));
            for (i = 0; i < A.n * A.n; i++) /* new values, the same pattern */
                A.dense[i] *= gen_uniform(&random, 0.5, 1.0);
            matrix_compress(&A);
        }
        perp__klu_destroy(factor);
        matrix_release(&A);
    }
    perp__klu_destroy(NULL);
}

/* Smaller patterns and back again in one object: the solves are right and the bits those of a new
 * one. */
static void test_other_patterns(void **state)
{
    static const int32_t orders[] = {60, 60, 17, 0, 1, 59, 60};
    gen_random random;
    size_t k;

    (void)state;
    gen_seed(&random, 7);
    perp__factor *factor = NULL;

    for (k = 0; k < sizeof orders / sizeof orders[0]; k++) {
        matrix A = matrix_random(&random, orders[k], 0);
        perp__square view = view_of(&A);
        perp__factor *fresh = analysed(&A);
        double x[60], y[60];
        int32_t i;

        if (!factor)
            factor = analysed(&A);
        else
            assert_int_equal(perp__klu_reanalyse(factor, &view), PERP_OK);
        assert_int_equal(factored(factor, &A), PERP_OK);
        assert_int_equal(factored(fresh, &A), PERP_OK);
        check_solves(&random, factor, &A, tolerance_of(A.n));
        for (i = 0; i < A.n; i++)
            x[i] = y[i] = gen_normal(&random);
        perp__klu_solve(factor, x, 0);
        perp__klu_solve(fresh, y, 0);
        assert_memory_equal(x, y, (size_t)A.n * sizeof *x);
        perp__klu_destroy(fresh);
        matrix_release(&A);
    }
    perp__klu_destroy(factor);
}

/* Pivots that turn into zeros, or into next to nothing, from one matrix to the next. */
static void test_other_pivots(void **state)
{
    static const double corners[] = {2.0, 0.0, 1e-20, 1e-9, 3.0, 1e300, 0x1p-1074, 1.0};
    gen_random random;
    size_t k;

    (void)state;
    gen_seed(&random, 2);
    matrix A = matrix_zero(3);
    perp__factor *factor;
    int32_t i;

    for (i = 0; i < 9; i++)
        A.dense[i] = (double)((7 * i) % 5 + 1);
    matrix_compress(&A);
    factor = analysed(&A);
    for (k = 0; k < sizeof corners / sizeof corners[0]; k++) {
        for (i = 0; i < 9; i++)
            A.dense[i] = i % 4 == 0 ? corners[k] : (double)((7 * i) % 5 + 1);
        matrix_compress(&A);
        assert_int_equal(factored(factor, &A), PERP_OK);
        check_solves(&random, factor, &A, tolerance_of(3));
    }
    perp__klu_destroy(factor);
    matrix_release(&A);
}

/* A factorisation owes nothing to those before it: same bits as a new one. Small corners on the
 * first matrix make KLU leave the diagonal. */
static void test_same_bits(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 41);
    enum { N = 8 };
    matrix A = matrix_zero(N);
    perp__factor *used, *fresh;
    double x[N], y[N];
    perp__square view;
    int32_t i;

    for (i = 0; i < N * N; i++)
        A.dense[i] = gen_uniform(&random, 0.5, 1.0) * (i % (N + 1) == 0 ? 1e-9 : 1.0);
    matrix_compress(&A);
    used = analysed(&A);
    fresh = analysed(&A);
    assert_int_equal(factored(used, &A), PERP_OK);
    for (i = 0; i < N * N; i++)
        A.dense[i] = gen_uniform(&random, 0.5, 1.0) * (i % (N + 1) == 0 ? 4.0 : 1.0);
    matrix_compress(&A);
    view = view_of(&A);
    assert_int_equal(perp__klu_factor(used, &view), PERP_OK);
    assert_int_equal(perp__klu_factor(fresh, &view), PERP_OK);
    for (i = 0; i < N; i++)
        x[i] = y[i] = gen_uniform(&random, -1.0, 1.0);
    perp__klu_solve(used, x, 0);
    perp__klu_solve(fresh, y, 0);
    assert_memory_equal(x, y, sizeof x);
    perp__klu_destroy(used);
    perp__klu_destroy(fresh);
    matrix_release(&A);
}

/* Rows and columns of sizes from 2^-450 to 2^450 neither overflow nor look singular. */
static void test_ill_scaled(void **state)
{
    enum { N = 20 };
    gen_random random;

    (void)state;
    gen_seed(&random, 4);
    matrix A = matrix_random(&random, N, 1);
    double x[N];
    int32_t e[N], i, j;
    perp__factor *factor;

    for (i = 0; i < N; i++)
        e[i] = gen_integer(&random, 901) - 450;
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++)
            A.dense[i + N * j] = ldexp(A.dense[i + N * j], e[i] + e[j]);
    matrix_compress(&A);
    factor = analysed(&A);
    if (factored(factor, &A) != PERP_OK)
        fail_msg("it is found singular");
    for (i = 0; i < N; i++)
        x[i] = ldexp(gen_normal(&random), e[i]);
    perp__klu_solve(factor, x, 0);
    for (i = 0; i < N; i++)
        assert_true(isfinite(x[i]));
    perp__klu_destroy(factor);
    matrix_release(&A);
}

/* tridiag(-1, 2, -1) of order n: its inverse is min(i, j) (n + 1 - max(i, j)) / (n + 1), whose
 * largest column sum is that of the middle column m = (n + 1) / 2: m (n + 1 - m) / 2, so cond_1 =
 * 4 m (n + 1 - m) / 2. The estimator finds it, as for every matrix with an inverse >= 0. */
static void test_condition(void **state)
{
    static const int32_t orders[] = {3, 10, 77, 200};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof orders / sizeof orders[0]; k++) {
        const int32_t n = orders[k], m = (n + 1) / 2;
        matrix A = matrix_zero(n);
        perp__factor *factor;
        perp__square view;
        double condition;
        int32_t i;

        for (i = 0; i < n; i++) {
            A.dense[i + n * i] = 2.0;
            if (i > 0)
                A.dense[i - 1 + n * i] = A.dense[i + n * (i - 1)] = -1.0;
        }
        matrix_compress(&A);
        factor = analysed(&A);
        assert_int_equal(factored(factor, &A), PERP_OK);
        view = view_of(&A);
        condition = 1.0 / reciprocal_of(factor, &view);
        /* the solves are right to about cond u < 1e-11 */
        assert_true(fabs(condition - 2.0 * m * (n + 1 - m)) <= 1e-10 * condition);
        perp__klu_destroy(factor);
        matrix_release(&A);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),       cmocka_unit_test(test_other_patterns),
        cmocka_unit_test(test_other_pivots), cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_ill_scaled),   cmocka_unit_test(test_condition),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
