/* Cholesky's factorisation and solves with several columns, whichever BLAS was built. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "check.h"
#include "exact.h"
#include "gen.h"
#include "linalg/blas.h"

#define UNIT 0x1p-53

/* Around the sizes where loops, panels, slices and LAPACK take turns. */
static const int32_t orders[] = {0, 1, 2, 3, 7, 31, 32, 33, 48, 49, 64, 65, 97, 130};
enum { ORDERS = sizeof orders / sizeof orders[0], COLUMNS = 3 };

static size_t at(int32_t i, int32_t j, int32_t ld)
{
    return (size_t)i + (size_t)j * (size_t)ld;
}

/* G G' + I with dyadic G, exact; NaN above the diagonal and in the padding. */
static double *positive_definite(gen_random *random, int32_t n, int32_t lda)
{
    double *G = check_allocate((size_t)n * (size_t)n + 1, sizeof *G);
    double *A = check_allocate((size_t)lda * (size_t)n + 1, sizeof *A);
    int32_t i, j, k;

    for (i = 0; i < n * n; i++)
        G[i] = gen_dyadic(random, 1);
    for (j = 0; j < n; j++)
        for (i = 0; i < lda; i++) {
            A[at(i, j, lda)] = i < j || i >= n ? NAN : i == j ? 1.0 : 0.0;
            for (k = 0; i >= j && i < n && k < n; k++)
                A[at(i, j, lda)] += G[at(i, k, n)] * G[at(j, k, n)];
        }
    free(G);
    return A;
}

/* |A - L L'| <= gamma_(n+1) |L||L'| (Higham 2002, theorem 10.3), and |L||L'|_ij is at most the root
 * of A_ii A_jj. */
static void check_factor(int32_t n, int32_t lda, const double *A, const double *L)
{
    int32_t i, j, k;

    for (j = 0; j < n; j++)
        for (i = 0; i < lda; i++) {
            check_sum sum;

            if (i < j || i >= n) {
                assert_true(isnan(L[at(i, j, lda)]));
                continue;
            }
            check_sum_clear(&sum);
            check_sum_add(&sum, A[at(i, j, lda)], -1.0);
            for (k = 0; k <= j; k++)
                check_sum_add(&sum, L[at(i, k, lda)], L[at(j, k, lda)]);
            assert_true(fabs(check_sum_value(&sum, 0)) <=
                        2.0 * (n + 2) * UNIT * sqrt(A[at(i, i, lda)] * A[at(j, j, lda)]));
        }
}

/* |A x - b| <= 8 n (3 n + 1) u |A|_2 |x|_2 (Higham 2002, equation 10.7), row by row with the trace
 * for the norm. A is given by its lower triangle. */
static void check_solution(int32_t n, int32_t lda, const double *A, const double *x,
                           const double *b)
{
    double trace = 0.0, length = 0.0;
    int32_t i, j;

    for (i = 0; i < n; i++) {
        trace += A[at(i, i, lda)];
        length += x[i] * x[i];
    }
    for (i = 0; i < n; i++) {
        check_sum sum;

        check_sum_clear(&sum);
        check_sum_add(&sum, b[i], -1.0);
        for (j = 0; j < n; j++)
            check_sum_add(&sum, i >= j ? A[at(i, j, lda)] : A[at(j, i, lda)], x[j]);
        assert_true(fabs(check_sum_value(&sum, 0)) <=
                    8.0 * n * (3.0 * n + 1.0) * UNIT * trace * sqrt(length));
    }
}

static double *right_hand_sides(gen_random *random, int32_t ldb)
{
    double *B = check_allocate((size_t)ldb * COLUMNS, sizeof *B);
    int32_t k;

    for (k = 0; k < ldb * COLUMNS; k++)
        B[k] = gen_normal(random);
    return B;
}

static void factor_and_solve(gen_random *random, int32_t columns)
{
    int32_t o, j;

    for (o = 0; o < ORDERS; o++) {
        const int32_t n = orders[o], lda = n + 1 + o % 3, ldb = n + 2;
        const size_t bytes = (size_t)lda * (size_t)n * sizeof(double);
        double *A = positive_definite(random, n, lda), *B = right_hand_sides(random, ldb);
        double *L = check_allocate(bytes + 1, 1), *X = right_hand_sides(random, ldb);

        memcpy(L, A, bytes);
        memcpy(X, B, (size_t)ldb * COLUMNS * sizeof *X);
        assert_int_equal(perp__cholesky_factor(n, L, lda), 0);
        check_factor(n, lda, A, L);
        perp__cholesky_solve(n, columns, L, lda, X, ldb);
        for (j = 0; j < columns; j++) {
            check_solution(n, lda, A, X + at(0, j, ldb), B + at(0, j, ldb));
            assert_true(X[at(n, j, ldb)] == B[at(n, j, ldb)]); /* the padding stays */
        }
        free(A);
        free(B);
        free(L);
        free(X);
    }
}

static void test_factor_and_solve(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 11);
    factor_and_solve(&random, COLUMNS);
    factor_and_solve(&random, 1);
}

/* Integers throughout: the pivots are exact, and the first that is not positive is known. */
static void test_not_positive_definite(void **state)
{
    int32_t o, i, kind;

    (void)state;
    for (o = 2; o < ORDERS; o++)
        for (kind = 0; kind < 3; kind++) {
            const int32_t n = orders[o], bad = kind == 0 ? 0 : kind == 1 ? n / 2 : n - 1;
            double *A = check_allocate((size_t)n * (size_t)n, sizeof *A);

            for (i = 0; i < n; i++)
                A[at(i, i, n)] = i == bad ? -1.0 : 1.0;
            assert_int_equal(perp__cholesky_factor(n, A, n), bad + 1);
            for (i = 0; i < n * n; i++) /* rank 1: the second pivot is 0 */
                A[i] = 1.0;
            assert_int_equal(perp__cholesky_factor(n, A, n), 2);
            free(A);
        }
}

/* Column by column the same as one solve after the other, up to the order of sums. */
static void test_lu_columns(void **state)
{
    gen_random random;
    int32_t o, j, transposed;

    (void)state;
    gen_seed(&random, 12);
    for (o = 1; o < ORDERS; o++)
        for (transposed = 0; transposed < 2; transposed++) {
            const int32_t n = orders[o], ldb = n + 1;
            double *A = check_allocate((size_t)n * (size_t)n, sizeof *A);
            double *B = right_hand_sides(&random, ldb);
            double *X = check_allocate((size_t)ldb * COLUMNS, sizeof *X);
            int32_t *pivots = check_allocate((size_t)n, sizeof *pivots);

            for (j = 0; j < n * n; j++) /* |A^-1| <= 1/n: diagonally dominant */
                A[j] = gen_uniform(&random, -1.0, 1.0) + (j % (n + 1) == 0 ? 2.0 * n : 0.0);
            assert_int_equal(perp__lu_factor(n, A, n, pivots), 0);
            memcpy(X, B, (size_t)ldb * COLUMNS * sizeof *X);
            perp__lu_solve_columns(n, COLUMNS, A, n, pivots, X, ldb, transposed);
            for (j = 0; j < COLUMNS; j++) {
                double *b = B + at(0, j, ldb);
                int32_t i;

                perp__lu_solve(n, A, n, pivots, b, transposed);
                for (i = 0; i <= n; i++) /* entries are below 5 / n, conditions below 3 */
                    assert_true(fabs(b[i] - X[at(i, j, ldb)]) <= 1e-13);
            }
            free(A);
            free(B);
            free(X);
            free(pivots);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_factor_and_solve),
        cmocka_unit_test(test_not_positive_definite),
        cmocka_unit_test(test_lu_columns),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
