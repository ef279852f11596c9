/* Whichever of blas.c and blas_internal.c was built, against the definitions. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "check.h"
#include "exact.h"
#include "gen.h"
#include "lu_condition.h"
#include "linalg/blas.h"

#define UNIT 0x1p-53

/* Around the sizes where loops, unrolled loops, panels, blocks and BLAS take turns. */
static const int32_t sizes[] = {0, 1, 2, 3, 4, 5, 8, 11, 20, 31, 32, 33, 47, 48, 49, 67, 100};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

static double *random_array(gen_random *random, size_t count)
{
    double *x = check_allocate(count + 1, sizeof *x);
    size_t k;

    for (k = 0; k < count; k++)
        x[k] = gen_normal(random);
    return x;
}

/* after = before - sum a_p b_p, within k + 1 roundings of every term (Higham, "Accuracy and
 * Stability of Numerical Algorithms", 3.1), and some more: the order is the BLAS's own. */
static void check_dot(double after, double before, int32_t k, const double *a, size_t a_step,
                      const double *b, size_t b_step)
{
    double size = fabs(before);
    check_sum sum;
    int32_t p;

    check_sum_clear(&sum);
    check_sum_add(&sum, before, 1.0);
    check_sum_add(&sum, after, -1.0);
    for (p = 0; p < k; p++) {
        const double ap = a[(size_t)p * a_step], bp = b[(size_t)p * b_step];

        check_sum_add(&sum, ap, -bp);
        size += fabs(ap * bp);
    }
    assert_true(fabs(check_sum_value(&sum, 0)) <= 2.0 * (k + 1.0) * UNIT * size);
}

static void check_gemm(gen_random *random, int32_t m, int32_t n, int32_t k)
{
    const size_t lda = (size_t)m + 3, ldb = (size_t)k + 2, ldc = (size_t)m + 1;
    const size_t count = ldc * (size_t)n;
    double *A = random_array(random, lda * (size_t)k), *B = random_array(random, ldb * (size_t)n);
    double *C = random_array(random, count), *before = check_allocate(count + 1, sizeof *C);
    size_t i, j;

    memcpy(before, C, count * sizeof *C);
    perp__gemm_subtract(m, n, k, A, (int32_t)lda, B, (int32_t)ldb, C, (int32_t)ldc);
    for (j = 0; j < (size_t)n; j++) {
        for (i = 0; i < (size_t)m; i++)
            check_dot(C[i + ldc * j], before[i + ldc * j], k, A + i, lda, B + ldb * j, 1);
        assert_true(C[(size_t)m + ldc * j] == before[(size_t)m + ldc * j]);
    }
    free(A);
    free(B);
    free(C);
    free(before);
}

static void test_gemm(void **state)
{
    gen_random random;
    int r, c;

    (void)state;
    gen_seed(&random, 1);
    for (r = 0; r < SIZES; r++)
        for (c = 0; c < SIZES; c++)
            check_gemm(&random, sizes[r], sizes[c], sizes[(3 * r + 5 * c) % SIZES]);
    check_gemm(&random, 400, 3, 150);
}

static void check_gemv(gen_random *random, int32_t m, int32_t n, int transposed)
{
    const size_t lda = (size_t)m + 3;
    const int32_t length = transposed ? m : n, rows = transposed ? n : m;
    double *A = random_array(random, lda * (size_t)n);
    double *x = random_array(random, (size_t)length);
    double *y = random_array(random, (size_t)rows + 1),
           *before = check_allocate((size_t)rows + 1, 8);
    size_t i;

    memcpy(before, y, ((size_t)rows + 1) * sizeof *y);
    if (transposed)
        perp__gemv_transposed_subtract(m, n, A, (int32_t)lda, x, y);
    else
        perp__gemv_subtract(m, n, A, (int32_t)lda, x, y);
    for (i = 0; i < (size_t)rows; i++)
        check_dot(y[i], before[i], length, transposed ? A + lda * i : A + i, transposed ? 1 : lda,
                  x, 1);
    assert_true(y[rows] == before[rows]);
    free(A);
    free(x);
    free(y);
    free(before);
}

static void test_gemv(void **state)
{
    gen_random random;
    int r, c;

    (void)state;
    gen_seed(&random, 2);
    for (r = 0; r < SIZES; r++)
        for (c = 0; c < SIZES; c++) {
            check_gemv(&random, sizes[r], sizes[c], 0);
            check_gemv(&random, sizes[r], sizes[c], 1);
        }
}

/* P A - L U entry by entry: at most n u |L||U| (Higham, theorem 9.3), |L| <= 1. Rows of the panel
 * below n are none of the factorisation's business. */
static void check_lu(int32_t n, int32_t lda, const double *A, const double *LU,
                     const int32_t *pivots)
{
    const size_t ld = (size_t)lda;
    double *PA = check_allocate(ld * (size_t)n + 1, sizeof *PA);
    int32_t i, j, k;

    memcpy(PA, A, ld * (size_t)n * sizeof *PA);
    for (k = 0; k < n; k++) {
        assert_true(pivots[k] >= k + 1 && pivots[k] <= n);
        for (j = 0; j < n; j++) {
            double *a = PA + ld * (size_t)j, kept = a[k];

            a[k] = a[pivots[k] - 1];
            a[pivots[k] - 1] = kept;
        }
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            double size = 0.0;
            check_sum sum;

            check_sum_clear(&sum);
            check_sum_add(&sum, PA[(size_t)i + ld * (size_t)j], -1.0);
            for (k = 0; k <= i && k <= j; k++) {
                const double l = k == i ? 1.0 : LU[(size_t)i + ld * (size_t)k];
                const double u = LU[(size_t)k + ld * (size_t)j];

                assert_true(fabs(l) <= 1.0);
                check_sum_add(&sum, l, u);
                size += fabs(l * u);
            }
            assert_true(fabs(check_sum_value(&sum, 0)) <= 2.0 * n * UNIT * size);
        }
    for (j = 0; j < n; j++)
        for (i = n; i < lda; i++)
            assert_true(LU[(size_t)i + ld * (size_t)j] == A[(size_t)i + ld * (size_t)j]);
    free(PA);
}

/* |A x - b| <= 3 n u |L||U||x| (Higham, theorem 9.4). The sizes |L||U| stand in for themselves by
 * n max|U|, for |L| <= 1. */
static void check_solve(gen_random *random, int32_t n, int32_t lda, const double *A,
                        const double *LU, const int32_t *pivots, int32_t transposed)
{
    const size_t ld = (size_t)lda;
    double *b = random_array(random, (size_t)n), *x = check_allocate((size_t)n + 1, sizeof *x);
    double largest = 0.0, norm = 0.0;
    int32_t i, j;

    memcpy(x, b, (size_t)n * sizeof *x);
    x[n] = 77.0;
    perp__lu_solve(n, LU, lda, pivots, x, transposed);
    assert_true(x[n] == 77.0);
    for (j = 0; j < n; j++) {
        norm += fabs(x[j]);
        for (i = 0; i <= j; i++)
            check_raise(&largest, fabs(LU[(size_t)i + ld * (size_t)j]));
    }
    for (i = 0; i < n; i++) {
        check_sum sum;

        check_sum_clear(&sum);
        check_sum_add(&sum, b[i], -1.0);
        for (j = 0; j < n; j++)
            check_sum_add(
                &sum, transposed ? A[(size_t)j + ld * (size_t)i] : A[(size_t)i + ld * (size_t)j],
                x[j]);
        assert_true(fabs(check_sum_value(&sum, 0)) <= 3.0 * n * UNIT * n * largest * norm);
    }
    free(b);
    free(x);
}

static void test_lu(void **state)
{
    static const int32_t orders[] = {0, 1, 2, 3, 7, 16, 31, 32, 33, 47, 48, 49, 64, 65, 96, 130};
    gen_random random;
    size_t k;

    (void)state;
    gen_seed(&random, 3);
    for (k = 0; k < sizeof orders / sizeof orders[0]; k++) {
        const int32_t n = orders[k], lda = n + 1 + (int32_t)(k % 3);
        const size_t count = (size_t)lda * (size_t)n;
        double *A = random_array(&random, count), *LU = check_allocate(count + 1, sizeof *LU);
        int32_t *pivots = check_allocate((size_t)n + 1, sizeof *pivots);

        memcpy(LU, A, count * sizeof *LU);
        pivots[n] = 77;
        assert_int_equal(perp__lu_factor(n, LU, lda, pivots), 0);
        assert_int_equal(pivots[n], 77);
        check_lu(n, lda, A, LU, pivots);
        check_solve(&random, n, lda, A, LU, pivots, 0);
        check_solve(&random, n, lda, A, LU, pivots, 1);
        free(A);
        free(LU);
        free(pivots);
    }
}

/* A zero column makes its pivot zero, exactly, whatever rounds elsewhere. */
static void test_zero_pivot(void **state)
{
    static const int32_t orders[] = {1, 2, 20, 60, 100};
    gen_random random;
    size_t k;

    (void)state;
    gen_seed(&random, 4);
    for (k = 0; k < sizeof orders / sizeof orders[0]; k++) {
        const int32_t n = orders[k], zero = n / 2;
        double *A = random_array(&random, (size_t)n * (size_t)n);
        int32_t *pivots = check_allocate((size_t)n, sizeof *pivots);

        memset(A + (size_t)n * (size_t)zero, 0, (size_t)n * sizeof *A);
        assert_int_equal(perp__lu_factor(n, A, n, pivots), zero + 1);
        memset(A, 0, (size_t)n * (size_t)n * sizeof *A);
        assert_int_equal(perp__lu_factor(n, A, n, pivots), 1);
        free(A);
        free(pivots);
    }
}

static double binomial(int32_t n, int32_t k)
{
    double b = 1.0;
    int32_t i;

    for (i = 0; i < k; i++)
        b = b * (n - i) / (i + 1);
    return b;
}

/* cond_1 of the Hilbert matrix, from its integer inverse (Choi 1983). */
static double hilbert_condition(int32_t n)
{
    double norm = 0.0, inverse_norm = 0.0;
    int32_t i, j;

    for (i = 0; i < n; i++)
        norm += 1.0 / (i + 1);
    for (j = 0; j < n; j++) {
        double sum = 0.0;

        for (i = 0; i < n; i++)
            sum += (i + j + 1) * binomial(n + i, n - j - 1) * binomial(n + j, n - i - 1) *
                   binomial(i + j, i) * binomial(i + j, i);
        check_raise(&inverse_norm, sum);
    }
    return norm * inverse_norm;
}

/* The estimate is a lower bound of the condition number, for these matrices the number itself; the
 * computed inverse is right to cond u, and to no digit from n = 12 on. */
static void test_condition(void **state)
{
    double A[10 * 10], work[40], norm, exact, estimate;
    int32_t n, i, j, pivots[10];

    (void)state;
    for (n = 1; n <= 10; n++) {
        norm = 0.0;
        for (i = 0; i < n; i++)
            norm += 1.0 / (i + 1);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                A[i + n * j] = 1.0 / (i + j + 1);
        assert_int_equal(perp__lu_factor(n, A, n, pivots), 0);
        exact = hilbert_condition(n);
        estimate = 1.0 / lu_condition(n, A, n, norm, work, pivots);
        assert_true(fabs(estimate - exact) <= exact * (n * UNIT * exact + 1e-14));
    }
    assert_true(lu_condition(0, A, 1, 0.0, work, pivots) == 1.0);
}

/* A^-1 = diag(2, I + t u u'), u = (1, -1, 1, -1), here with 1 + 4 t = 1024: the ascent goes from
 * e / 5, which u is orthogonal to, to the first column and ends there with the estimate 2 (Higham
 * 1988, section 4). The alternating vector x = (1, -5/4, 3/2, -7/4, 2), all of it along u but the
 * first entry, has |A^-1 x| = 2 + 13/2 (1 + 4 t), and 2 / (3 * 5) of that is the estimate. */
static void test_condition_alternating(void **state)
{
    const double c = 0.25 - 0x1p-12, norm = 1.0 + 2.0 * c, expected = 2.0 * (2.0 + 6656.0) / 15.0;
    double A[25] = {0.5}, work[20], estimate;
    int32_t i, j, pivots[5];

    (void)state;
    for (i = 1; i < 5; i++)
        for (j = 1; j < 5; j++)
            A[i + 5 * j] = (i == j ? 1.0 : 0.0) - ((i + j) % 2 == 0 ? c : -c);
    assert_int_equal(perp__lu_factor(5, A, 5, pivots), 0);
    estimate = 1.0 / norm / lu_condition(5, A, 5, norm, work, pivots);
    assert_true(fabs(estimate - expected) <= 1e-9 * expected); /* solves: cond u = 3e-13 */
}

/* Diagonal matrices of every size: exact, to the limits of the range. */
static void test_condition_diagonal(void **state)
{
    double A[3 * 3] = {0x1p-500, 0, 0, 0, 1, 0, 0, 0, 0x1p400}, work[12];
    int32_t pivots[3];

    (void)state;
    assert_int_equal(perp__lu_factor(3, A, 3, pivots), 0);
    assert_true(lu_condition(3, A, 3, 0x1p400, work, pivots) == 0x1p-900);
    A[0] = 0x1p-1074; /* its inverse overflows: as good as singular */
    assert_true(lu_condition(3, A, 3, 0x1p400, work, pivots) == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gemm),
        cmocka_unit_test(test_gemv),
        cmocka_unit_test(test_lu),
        cmocka_unit_test(test_zero_pivot),
        cmocka_unit_test(test_condition),
        cmocka_unit_test(test_condition_alternating),
        cmocka_unit_test(test_condition_diagonal),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
