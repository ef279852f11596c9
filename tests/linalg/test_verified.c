/* Bounds of |A^-1 r| against exact solutions. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "base/context.h"
#include "check.h"
#include "gen.h"
#include "linalg/verified.h"
#include "rational.h"

#include "context.h"

static void layout(perp__arena *arena, void *object)
{
    perp__verified *v = object;

    perp__verified_layout(arena, v, v->n);
}

/* |x| <= delta for x = numerator / denominator; both integers are doubles, too. */
static int is_within(int64_t numerator, int64_t denominator, double delta)
{
    return fabs((double)numerator) <= delta * (double)denominator * (1.0 + DBL_EPSILON);
}

/* A and r are integers; `middle` misses r by up to `width`. */
static void random_system(gen_random *random, int n, int largest, int64_t *A, int64_t *r,
                          double *middle, double *width)
{
    int i;

    for (i = 0; i < n * n; i++)
        A[i] = gen_integer(random, 2 * largest + 1) - largest;
    for (i = 0; i < n; i++) {
        r[i] = gen_integer(random, 2 * largest + 1) - largest;
        width[i] = gen_integer(random, 3);
        middle[i] = (double)r[i] + width[i] * (gen_integer(random, 3) - 1);
    }
}

/* Entries up to 1000 of matrices that are nearly singular now and then. */
static void test_dense(void **state)
{
    enum { LARGEST = 5 };
    gen_random random;
    int round, regular = 0, n;

    (void)state;
    gen_seed(&random, 1);
    for (round = 0; round < 2000; round++) {
        int64_t A[LARGEST * LARGEST], r[LARGEST], x[LARGEST], determinant;
        double middle[LARGEST], width[LARGEST], delta[LARGEST];
        perp__arena arena;
        perp__verified v;
        int i, j;

        n = 1 + gen_integer(&random, LARGEST);
        random_system(&random, n, round % 2 ? 1000 : 3, A, r, middle, width);
        memset(&arena, 0, sizeof arena);
        v.n = n;
        assert_int_equal(perp__arena_fit(&arena, context, layout, &v), PERP_OK);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                v.transposed[j + n * i] = (double)A[i * n + j];
        determinant = rational_solve(n, A, r, x);
        if (perp__verified_factor(&v)) {
            regular++;
            assert_true(determinant != 0);
            perp__verified_bound(&v, middle, width, delta);
            for (i = 0; i < n; i++)
                assert_true(is_within(x[i], determinant, delta[i]));
        }
        perp__arena_release(&arena);
    }
    assert_true(regular > 1500);
}

/* Hilbert's matrix of 12 rows, an approximate inverse of which is off by half: R r alone is no
 * bound. Integers once more (lcm(1..23) = 5354228880), r = A e. */
static void test_contraction_counts(void **state)
{
    enum { N = 12 };
    double middle[N] = {0}, width[N] = {0}, delta[N], step[N];
    perp__arena arena;
    perp__verified v;
    int i, j;

    (void)state;
    memset(&arena, 0, sizeof arena);
    v.n = N;
    assert_int_equal(perp__arena_fit(&arena, context, layout, &v), PERP_OK);
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++) {
            v.transposed[j + N * i] = 5354228880.0 / (i + j + 1);
            middle[i] += v.transposed[j + N * i];
        }
    if (perp__verified_factor(&v)) {
        assert_true(v.contraction > 1e-3); /* or the test shows nothing */
        perp__verified_bound(&v, middle, width, delta);
        perp__verified_apply(&v, middle, step);
        for (i = 0; i < N; i++) {
            assert_true(delta[i] >= 1.0);
            assert_true(delta[i] >= fabs(step[i]));
        }
    }
    perp__arena_release(&arena);
}

/* R = A^-1 / 2 for A = diag(2, 4): |I - R A| = 1/2, R r is half of the solution. */
static void test_poor_inverse(void **state)
{
    static const double middle[2] = {2.0, 4.0}, width[2] = {0.0, 0.0};
    double transposed[4] = {2, 0, 0, 4}, inverse[4] = {0.25, 0, 0, 0.125}, alpha[2] = {0.5, 0.5};
    double delta[2], work[8];
    perp__verified v;

    (void)state;
    memset(&v, 0, sizeof v);
    v.n = 2;
    v.transposed = transposed;
    v.inverse = inverse;
    v.alpha = alpha;
    v.work = work;
    v.contraction = 0.5;
    perp__verified_bound(&v, middle, width, delta);
    assert_true(delta[0] >= 1.0 && delta[1] >= 1.0);
    assert_true(delta[0] <= 1.0 + 1e-13 && delta[1] <= 1.0 + 1e-13); /* and a sharp one */
}

static void layout_dominance(perp__arena *arena, void *object)
{
    perp__dominance *d = object;

    perp__dominance_layout(arena, d, d->n, d->n * d->n);
}

/* Random signs and sizes: where a bound is given it holds, and it is given for dominant rows. */
static void test_dominance(void **state)
{
    enum { LARGEST = 6 };
    gen_random random;
    int round, given = 0, denied = 0;

    (void)state;
    gen_seed(&random, 2);
    for (round = 0; round < 2000; round++) {
        int64_t A[LARGEST * LARGEST], r[LARGEST], x[LARGEST], determinant;
        double middle[LARGEST], width[LARGEST], delta[LARGEST], values[LARGEST * LARGEST];
        int32_t starts[LARGEST + 1], rows[LARGEST * LARGEST], count = 0;
        int n = 2 + gen_integer(&random, LARGEST - 1), dominant = 1, i, j;
        perp__arena arena;
        perp__dominance d;

        memset(&d, 0, sizeof d);
        random_system(&random, n, 5, A, r, middle, width);
        for (i = 0; i < n; i++) {
            int64_t others = 0;

            for (j = 0; j < n; j++) {
                if (i != j && gen_integer(&random, 2))
                    A[i * n + j] = 0;
                others += i == j ? 0 : llabs(A[i * n + j]);
            }
            A[i * n + i] = (round % 3 ? others : 2) + gen_integer(&random, 4);
            dominant &= A[i * n + i] > others;
        }
        for (j = 0; j < n; j++) {
            starts[j] = count;
            for (i = 0; i < n; i++)
                if (A[i * n + j] != 0) {
                    rows[count] = i;
                    values[count++] = (double)A[i * n + j];
                }
        }
        starts[n] = count;
        d.n = d.A.n = n;
        d.A.values = values;
        d.A.column_starts = starts;
        d.A.row_indices = rows;
        memset(&arena, 0, sizeof arena);
        assert_int_equal(perp__arena_fit(&arena, context, layout_dominance, &d), PERP_OK);
        determinant = rational_solve(n, A, r, x);
        if (perp__dominance_factor(&d, context) == PERP_OK &&
            perp__dominance_bound(&d, middle, width, delta)) {
            given++;
            assert_true(determinant != 0);
            for (i = 0; i < n; i++)
                assert_true(is_within(x[i], determinant, delta[i]));
        } else {
            denied++;
            assert_false(dominant);
        }
        perp__dominance_release(&d);
        perp__arena_release(&arena);
    }
    assert_true(given > 300 && denied > 300);
}

/* An M-matrix of determinant 2^-52: C v can't be told from 0, so there is no bound. */
static void test_dominance_rounding(void **state)
{
    static const double values[] = {1.0, -1.0, -1.0, 1.0 + DBL_EPSILON};
    static const int32_t starts[] = {0, 2, 4}, rows[] = {0, 1, 0, 1};
    static const double middle[] = {1.0, 1.0}, width[] = {0.0, 0.0};
    double delta[2];
    perp__arena arena;
    perp__dominance d;

    (void)state;
    memset(&d, 0, sizeof d);
    d.n = d.A.n = 2;
    d.A.values = values;
    d.A.column_starts = starts;
    d.A.row_indices = rows;
    memset(&arena, 0, sizeof arena);
    assert_int_equal(perp__arena_fit(&arena, context, layout_dominance, &d), PERP_OK);
    assert_int_equal(perp__dominance_factor(&d, context), PERP_OK);
    assert_false(perp__dominance_bound(&d, middle, width, delta));
    perp__dominance_release(&d);
    perp__arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dense),
        cmocka_unit_test(test_contraction_counts),
        cmocka_unit_test(test_poor_inverse),
        cmocka_unit_test(test_dominance),
        cmocka_unit_test(test_dominance_rounding),

    };

    return cmocka_run_group_tests(tests, make, destroy);
}
