/* The Fischer-Burmeister function where naive formulas fail, its derivatives against differences,
 * and what Newton's method needs at its kinks. */
#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "suite.h"

#include "gen.h"
#include "lcp/fischer/function.h"

/* Rounding of the five operations in phi: quotient, hypot (1 ulp), two sums, quotient, product. */
#define ROUNDING (6.0 * DBL_EPSILON)

/* phi itself: of z >= 0, w >= 0. */
static double penalised(double a, double b, double penalty)
{
    return perp__fischer_bounded(a, 0.0, INFINITY, b, penalty, 0.0);
}

static double fischer(double a, double b)
{
    return penalised(a, b, 0.0);
}

static perp__slopes fischer_slopes(double a, double b)
{
    return perp__fischer_bounded_slopes(a, 0.0, INFINITY, b, 0.0, 0.0, 0.0, 0.0);
}

static void require_close(double got, double expected, double relative)
{
    if (!(fabs(got - expected) <= relative * fabs(expected)))
        fail_msg("%.17g, expected %.17g", got, expected);
}

/* phi(a, b) to more digits than a double has: for small ratios b/a by its series
 * b (1 - b/(2a) + b^3/(8 a^3) - ...), else as printed. */
static void test_extremes(void **state)
{
    static const double cases[][3] = {
        {1e8, 1e-9, 1e-9}, /* 1e-9 (1 - 5e-18) */
        {1.0, 1e-17, 1e-17},
        {1e300, 1e-300, 1e-300},
        {1e-170, 1e-170, 5.857864376269049512e-171}, /* 2 - sqrt 2 */
        {1e-200, 3e-200, 8.377223398316206680e-201}, /* 4 - sqrt 10 */
        {1e308, 1e308, 5.857864376269049512e307},
        {3.0, 4.0, 2.0},
        {-3.0, 4.0, -4.0},
        {-3.0, -4.0, -12.0},
        {-3e-170, 4e-170, -4e-170},
        {-3e300, -4e300, -12e300},
        {1.0, -1e-17, -1e-17}, /* -1e-17 (1 + 5e-18) */
    };

    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        require_close(fischer(cases[k][0], cases[k][1]), cases[k][2], ROUNDING);
        require_close(fischer(cases[k][1], cases[k][0]), cases[k][2], ROUNDING);
    }
    assert_true(fischer(INFINITY, 2.5) == 2.5 && fischer(-2.5, INFINITY) == -2.5);
    assert_true(fischer(INFINITY, INFINITY) == INFINITY);
    assert_true(fischer(0.0, 0.0) == 0.0);
    assert_true(fischer(0.0, 7.0) == 0.0 && fischer(7.0, 0.0) == 0.0);
}

/* The sign of min(a, b), and between the bounds (2 - sqrt 2) |min| <= |phi| <= (2 + sqrt 2) |min|
 * (Tseng 1996), at random points of every size. */
static void test_equivalent_to_the_minimum(void **state)
{
    const double root = sqrt(2.0);
    gen_random random;

    (void)state;
    gen_seed(&random, 1);
    for (int k = 0; k < 20000; k++) {
        double a = ldexp(gen_uniform(&random, -1, 1), gen_integer(&random, 400) - 200);
        double b = ldexp(gen_uniform(&random, -1, 1), gen_integer(&random, 400) - 200);
        double phi = fischer(a, b), least = fmin(a, b);

        assert_true((phi > 0.0) == (least > 0.0) && (phi < 0.0) == (least < 0.0));
        assert_true(fabs(phi) >= (2.0 - root) * fabs(least) * (1.0 - ROUNDING));
        assert_true(fabs(phi) <= (2.0 + root) * fabs(least) * (1.0 + ROUNDING));
        assert_true(phi == fischer(b, a));
        /* homogeneous of degree one, and powers of two change no bit */
        assert_true(fischer(ldexp(a, 90), ldexp(b, 90)) == ldexp(phi, 90));
    }
}

/* Central differences with step h: error h^2 |phi'''| / 6 + eps |phi| / h. At a distance >= 1/4
 * from the kinks third derivatives stay below 200, |phi| below 20: 4e-9 + 1e-10 with h = 1e-5. */
static void require_slopes(double z, double lower, double upper, double w, double p)
{
    const double h = 1e-5;
    perp__slopes slopes = perp__fischer_bounded_slopes(z, lower, upper, w, 0.0, 0.0, p, 0.0);
    double by_z = (perp__fischer_bounded(z + h, lower, upper, w, p, 0.0) -
                   perp__fischer_bounded(z - h, lower, upper, w, p, 0.0)) /
                  (2.0 * h);
    double by_w = (perp__fischer_bounded(z, lower, upper, w + h, p, 0.0) -
                   perp__fischer_bounded(z, lower, upper, w - h, p, 0.0)) /
                  (2.0 * h);

    if (!(fabs(slopes.z - by_z) <= 1e-8 && fabs(slopes.w - by_w) <= 1e-8))
        fail_msg("z %g in [%g, %g], w %g, penalty %g: (%.12g, %.12g), differences (%.12g, %.12g)",
                 z, lower, upper, w, p, slopes.z, slopes.w, by_z, by_w);
}

static void test_slopes_are_derivatives(void **state)
{
    static const double bounds[][2] = {
        {1.0, INFINITY}, {-INFINITY, 2.0}, {-1.0, 2.0}, {-INFINITY, INFINITY}};
    gen_random random;

    (void)state;
    gen_seed(&random, 2);
    for (int k = 0; k < 4000; k++) {
        const double *b = bounds[k % 4];
        double z = gen_uniform(&random, -4, 4), w = gen_uniform(&random, -4, 4);

        if (!(hypot(z - b[0], w) > 0.25 && hypot(z - b[1], w) > 0.25))
            continue;
        require_slopes(z, b[0], b[1], w, 0.0);
        /* the penalty has kinks along the axes */
        if (fabs(z - b[0]) > 2e-5 && fabs(z - b[1]) > 2e-5 && fabs(w) > 2e-5)
            require_slopes(z, b[0], b[1], w, 0.25 * (k % 3 + 1));
    }
}

/* 1 - a/r where a is all but r: b^2 / (2 a^2) to full relative accuracy, not 0. */
static void test_slopes_at_the_extremes(void **state)
{
    perp__slopes slopes = fischer_slopes(1.0, 1e-20);

    (void)state;
    require_close(slopes.z, 0.5e-40, ROUNDING);
    require_close(slopes.w, 1.0, ROUNDING);
    slopes = fischer_slopes(3e-200, 4e-200);
    require_close(slopes.z, 0.4, ROUNDING);
    require_close(slopes.w, 0.2, ROUNDING);
    slopes = fischer_slopes(-3e307, 4e307);
    require_close(slopes.z, 1.6, ROUNDING);
    require_close(slopes.w, 0.2, ROUNDING);
    slopes = fischer_slopes(DBL_MAX, DBL_MAX);
    require_close(slopes.z, 1.0 - sqrt(0.5), ROUNDING);
    slopes = fischer_slopes(INFINITY, -3.0);
    assert_true(slopes.z == 0.0 && slopes.w == 1.0);
    /* no direction at the kink: still an element of the generalised Jacobian, (1-c, 1-s) */
    slopes = fischer_slopes(0.0, 0.0);
    require_close(hypot(1.0 - slopes.z, 1.0 - slopes.w), 1.0, ROUNDING);
}

/* At a kink the slopes are those of points that come in along the direction. */
static void test_kinks(void **state)
{
    static const double bounds[][2] = {{1.0, INFINITY}, {-INFINITY, 2.0}, {-1.0, 2.0}, {-2.0, 1.0}};
    gen_random random;

    (void)state;
    gen_seed(&random, 3);
    for (int k = 0; k < 400; k++) {
        const double *b = bounds[k % 4];
        double corner = isinf(b[0]) || k % 4 == 3 ? b[1] : b[0];
        double along_z = gen_integer(&random, 2) ? 1.0 : -1.0, along_w = gen_dyadic(&random, 8);
        double t = ldexp(1.0, -26); /* exact sums; inner terms of a box change by O(t) = 1.5e-8 */
        perp__slopes at = perp__fischer_bounded_slopes(corner, b[0], b[1], 0.0, along_z, along_w,
                                                       0.25 * (k % 3), 0.0);
        perp__slopes near = perp__fischer_bounded_slopes(
            corner + t * along_z, b[0], b[1], t * along_w, 0.0, 0.0, 0.25 * (k % 3), 0.0);

        assert_true(perp__fischer_at_kink(corner, b[0], b[1], 0.0));
        assert_false(perp__fischer_at_kink(corner + t * along_z, b[0], b[1], 0.0));
        assert_true(fabs(at.z - near.z) <= 1e-6 && fabs(at.w - near.w) <= 1e-6);
    }
}

/* Zero exactly where mid(z - l, z - u, w) is, with its sign elsewhere. */
static void test_bounded(void **state)
{
    static const double bounds[][2] = {
        {1.0, INFINITY}, {-INFINITY, 2.0}, {-1.0, 2.0}, {-INFINITY, INFINITY}, {1.0, 1.0}};
    perp__slopes fixed = perp__fischer_bounded_slopes(1.0, 1.0, 1.0, -3.0, 1.0, 1.0, 0.0, 0.0);

    (void)state;
    for (size_t k = 0; k < sizeof bounds / sizeof bounds[0]; k++) {
        double l = bounds[k][0], u = bounds[k][1];

        for (double z = -4.0; z <= 4.0; z += 0.5) {
            for (double w = -2.0; w <= 2.0; w += 0.5) {
                double mid = fmax(fmin(z - l, w), z - u);

                for (int p = 0; p < 3; p++) {
                    double phi = perp__fischer_bounded(z, l, u, w, 0.375 * p, 0.0);

                    if (l == u)
                        assert_true(phi == 0.0);
                    else
                        assert_true((phi > 0.0) == (mid > 0.0) && (phi < 0.0) == (mid < 0.0));
                }
            }
        }
    }
    assert_true(fixed.z == 1.0 && fixed.w == 0.0);
    assert_false(perp__fischer_at_kink(1.0, 1.0, 1.0, 0.0));
}

/* Smoothed by mu: zero on z w = mu^2 / 2, there within rounding of |z| + |w|, and its slopes are
 * those of differences, also at the kink of the plain function. */
static void test_smoothed(void **state)
{
    (void)state;
    for (int k = -8; k <= 8; k++) {
        const double mu = ldexp(1.0, k), h = 1e-6 * mu;

        for (int j = -6; j <= 6; j++) {
            const double z = ldexp(mu, j), w = 0.5 * mu * (mu / z);

            assert_true(fabs(perp__fischer_bounded(z, 0.0, INFINITY, w, 0.0, mu)) <=
                        ROUNDING * (z + w));
        }
        for (int j = 0; j < 9; j++) {
            const double z = mu * (j % 3 - 1), w = mu * (j / 3 - 1);
            const perp__slopes at =
                perp__fischer_bounded_slopes(z, 0.0, INFINITY, w, 0.0, 0.0, 0.0, mu);
            const double by_z = perp__fischer_bounded(z + h, 0.0, INFINITY, w, 0.0, mu) -
                                perp__fischer_bounded(z - h, 0.0, INFINITY, w, 0.0, mu);
            const double by_w = perp__fischer_bounded(z, 0.0, INFINITY, w + h, 0.0, mu) -
                                perp__fischer_bounded(z, 0.0, INFINITY, w - h, 0.0, mu);

            /* central differences: h^2 of the third derivative, eps / h of rounding */
            assert_true(fabs(by_z / (2.0 * h) - at.z) <= 1e-9);
            assert_true(fabs(by_w / (2.0 * h) - at.w) <= 1e-9);
        }
    }
}

/* Chen, Chen & Kanzow's function by its definition, with a 3-4-5 triangle. */
static void test_penalty(void **state)
{
    (void)state;
    assert_true(penalised(3.0, 4.0, 0.25) == 0.75 * 2.0 + 0.25 * 12.0);
    assert_true(penalised(-3.0, 4.0, 0.25) == 0.75 * -4.0);
    assert_true(penalised(-3.0, -4.0, 0.25) == 0.75 * -12.0);
    assert_true(penalised(0.0, 4.0, 0.25) == 0.0);
    assert_true(penalised(INFINITY, 4.0, 0.25) == 3.0);
    assert_true(penalised(1e-200, 4e200, 0.0) == fischer(1e-200, 4e200));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_equivalent_to_the_minimum),
        cmocka_unit_test(test_slopes_are_derivatives),
        cmocka_unit_test(test_slopes_at_the_extremes),
        cmocka_unit_test(test_kinks),
        cmocka_unit_test(test_bounded),
        cmocka_unit_test(test_smoothed),
        cmocka_unit_test(test_penalty),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
