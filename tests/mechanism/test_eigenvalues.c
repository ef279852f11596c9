/* Eigenvalues of general matrices: companion matrices of known roots, similar and nearly defective
 * matrices, invariants of random ones. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include "mechanism/eigenvalues.h"

enum { LARGEST = 24 };

/* Whether each expected number is found, once, within tolerance. */
static void assert_set(int32_t n, const double *re, const double *im, const double *expected_re,
                       const double *expected_im, double tolerance)
{
    int used[LARGEST] = {0};
    int32_t i, j;

    for (i = 0; i < n; i++) {
        int32_t best = -1;
        double least = INFINITY;

        for (j = 0; j < n; j++) {
            const double distance = hypot(re[j] - expected_re[i], im[j] - expected_im[i]);

            if (!used[j] && distance < least) {
                least = distance;
                best = j;
            }
        }
        assert_true(best >= 0);
        used[best] = 1;
        if (!(least <= tolerance))
            fail_msg("%g%+gi is missed by %g", expected_re[i], expected_im[i], least);
    }
}

/* (x - 1)(x - 2)...(x - 6): 1764 -1624 ... by Vieta; its condition is about 1e5. */
static void test_companion(void **state)
{
    const double c[] = {720, -1764, 1624, -735, 175, -21};
    const double roots[] = {1, 2, 3, 4, 5, 6}, zero[6] = {0};
    double A[36] = {0}, re[6], im[6];
    int32_t i;

    (void)state;
    for (i = 0; i < 6; i++) {
        A[i + 6 * 5] = -c[i];
        if (i < 5)
            A[i + 1 + 6 * i] = 1;
    }
    assert_int_equal(perp__eigenvalues(6, A, re, im), 0);
    assert_set(6, re, im, roots, zero, 1e-9);
}

/* A permutation of n: the n-th roots of 1, and rounds of shifts that would go in circles. */
static void test_circulant(void **state)
{
    double A[LARGEST * LARGEST], re[LARGEST], im[LARGEST], x[LARGEST], y[LARGEST];
    int32_t n, i;

    (void)state;
    for (n = 1; n <= LARGEST; n++) {
        memset(A, 0, sizeof A);
        for (i = 0; i < n; i++) {
            A[(i + 1) % n + n * i] = 1;
            x[i] = cos(2 * acos(-1.0) * i / n);
            y[i] = sin(2 * acos(-1.0) * i / n);
        }
        assert_int_equal(perp__eigenvalues(n, A, re, im), 0);
        assert_set(n, re, im, x, y, 1e-13);
        for (i = 0; i < n; i++) /* pairs are exact, the positive part first */
            if (im[i] > 0) {
                assert_true(re[i] == re[i + 1] && im[i] == -im[i + 1]);
                i++;
            }
    }
}

/* Scales of 12 decades: balancing brings them together. Eigenvalues of D B D^-1 are those of B. */
static void test_badly_scaled(void **state)
{
    const double B[] = {4, 1, 0, -2, 4, 1, 1, 0, 9}, d[] = {1, 1e6, 1e-6};
    double A[9], C[9], re[3], im[3], x[3], y[3];
    int32_t i, j;

    (void)state;
    for (j = 0; j < 3; j++)
        for (i = 0; i < 3; i++) {
            A[i + 3 * j] = B[i + 3 * j] * d[i] / d[j];
            C[i + 3 * j] = B[i + 3 * j];
        }
    assert_int_equal(perp__eigenvalues(3, C, x, y), 0);
    assert_int_equal(perp__eigenvalues(3, A, re, im), 0);
    assert_set(3, re, im, x, y, 1e-13);
    assert_true(fabs(x[0] + x[1] + x[2] - 17) < 1e-13);
}

/* Trace and trace of the square of random matrices. */
static void test_traces(void **state)
{
    double A[LARGEST * LARGEST], re[LARGEST], im[LARGEST];
    uint64_t seed = 7;
    int32_t round, n, i, j;

    (void)state;
    for (round = 0; round < 400; round++) {
        double trace = 0, square = 0;

        n = 1 + round % LARGEST;
        for (i = 0; i < n * n; i++) {
            seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            A[i] = (double)(int64_t)(seed >> 33) / 1073741824.0 - 1.0;
        }
        for (i = 0; i < n; i++) {
            trace += A[i + n * i];
            for (j = 0; j < n; j++)
                square += A[i + n * j] * A[j + n * i];
        }
        assert_int_equal(perp__eigenvalues(n, A, re, im), 0);
        for (i = 0; i < n; i++) {
            trace -= re[i];
            square -= re[i] * re[i] - im[i] * im[i];
        }
        /* sums of n and of n^2 numbers of size 1 */
        assert_true(fabs(trace) < 1e-13 * n && fabs(square) < 1e-13 * n * n);
    }
}

static void test_special(void **state)
{
    double zero[9] = {0}, bad[4] = {1, NAN, 0, 1}, jordan[4] = {2, 0, 1, 2}, re[3], im[3];

    (void)state;
    assert_int_equal(perp__eigenvalues(3, zero, re, im), 0);
    assert_true(re[0] == 0 && re[1] == 0 && re[2] == 0 && im[0] == 0);
    assert_int_equal(perp__eigenvalues(2, jordan, re, im), 0);
    assert_true(re[0] == 2 && re[1] == 2 && im[0] == 0);
    assert_int_equal(perp__eigenvalues(2, bad, re, im), 1);
    assert_true(isnan(re[0]) && isnan(im[1]));
}

/* 2^k A has the eigenvalues of A times 2^k: the very bits, as long as no number of either is
 * subnormal. */
static void test_powers_of_two(void **state)
{
    static const double A[16] = {4, -1, 2, 0.5, 3, 1, -2, 7, 0.25, 5, -6, 1, 2, 8, 3, -1};
    double scaled[16], re[4], im[4], scaled_re[4], scaled_im[4];
    int k, i;

    (void)state;
    memcpy(scaled, A, sizeof A);
    assert_int_equal(perp__eigenvalues(4, scaled, re, im), 0);
    for (k = -960; k <= 1019; k += 1) {
        for (i = 0; i < 16; i++)
            scaled[i] = ldexp(A[i], k);
        assert_int_equal(perp__eigenvalues(4, scaled, scaled_re, scaled_im), 0);
        for (i = 0; i < 4; i++)
            assert_true(scaled_re[i] == ldexp(re[i], k) && scaled_im[i] == ldexp(im[i], k));
    }
}

/* Entries from the smallest to the largest double: it ends, with numbers or with nans. */
static void test_all_sizes(void **state)
{
    static const double sizes[] = {0.0,
                                   4.9e-324,
                                   1e-308,
                                   1e-160,
                                   1e-100,
                                   1e-8,
                                   1.0,
                                   3.0,
                                   1e12,
                                   1e100,
                                   1e154,
                                   1e300,
                                   1.7976931348623157e308};
    uint64_t seed = 1;
    int round, i;

    (void)state;
    for (round = 0; round < 20000; round++) {
        const int32_t n = 1 + round % 6;
        double A[36], re[6], im[6];
        int32_t failed;

        for (i = 0; i < n * n; i++) {
            seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            A[i] = sizes[(seed >> 33) % 13] * ((seed >> 60) & 1 ? 1.0 : -1.0);
        }
        failed = perp__eigenvalues(n, A, re, im);
        for (i = 0; i < n; i++)
            assert_true(failed ? isnan(re[i]) && isnan(im[i]) : isfinite(re[i]) && isfinite(im[i]));
    }
}

/* x^2 - 3 x + 2 - a b, a b = 6: 4 and -1, however the coupling is shared out. */
static void test_balance(void **state)
{
    static const double expected[] = {4, -1}, zero[2] = {0, 0};
    int k;

    (void)state;
    for (k = -1020; k <= 1020; k++) {
        double A[4] = {1, ldexp(3, -k), ldexp(2, k), 2}, re[2], im[2];

        assert_int_equal(perp__eigenvalues(2, A, re, im), 0);
        assert_set(2, re, im, expected, zero, 1e-14); /* a few roundings */
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_companion),    cmocka_unit_test(test_circulant),
        cmocka_unit_test(test_badly_scaled), cmocka_unit_test(test_traces),
        cmocka_unit_test(test_special),      cmocka_unit_test(test_powers_of_two),
        cmocka_unit_test(test_all_sizes),    cmocka_unit_test(test_balance),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
