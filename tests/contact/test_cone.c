/* The Lorentz cone's algebra against its own axioms: nothing here is recomputed the library's way.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "contact/newton/cone.h"
#include "gen.h"

#define TRIALS 2000

/* A handful of operations on numbers near 1, each with a relative error of 1e-16 or two. */
#define NEAR 2e-14

static double length(int32_t d, const double *x)
{
    double sum = 0.0;

    for (int32_t i = 1; i < d; i++)
        sum += x[i] * x[i];
    return sqrt(sum);
}

/* Inside of the cone, `inside` times its tail's length from the boundary. */
static void random_inside(gen_random *random, int32_t d, double inside, double *x)
{
    for (int32_t i = 1; i < d; i++)
        x[i] = gen_normal(random);
    x[0] = d == 1 ? gen_uniform(random, 0.1, 2.0) : length(d, x) * (1.0 + inside) + 1e-3 * inside;
}

static void assert_near(const double *a, const double *b, int32_t d, double tolerance)
{
    for (int32_t i = 0; i < d; i++)
        assert_true(fabs(a[i] - b[i]) <= tolerance);
}

static void test_division_undoes_the_product(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 1);
    for (int k = 0; k < TRIALS; k++) {
        int32_t d = 1 + k % 3;
        double a[3], b[3], c[3], back[3];

        random_inside(&random, d, 0.5, a);
        for (int32_t i = 0; i < d; i++)
            b[i] = gen_normal(&random);
        perp__cone_divide(d, a, b, c);
        perp__cone_product(d, a, c, back);
        assert_near(back, b, d, NEAR * (1.0 + fabs(a[0])) * (1.0 + fabs(c[0]) + length(d, c)));
    }
}

/* T x = T^-1 z, T^-1 undoes T, G x = z, G = T T; close to the boundary too. */
static void test_scaling_meets_in_the_middle(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 2);
    for (int k = 0; k < TRIALS; k++) {
        int32_t d = 1 + k % 3;
        double inside = k % 2 ? 1e-6 : 0.7;
        /* the points' own rounding moves a determinant near 0 by eps / inside of itself */
        double tolerance = NEAR / inside;
        double x[3], z[3], one[3], two[3], G[9], image[3] = {0.0, 0.0, 0.0};
        perp__cone_scaling T;

        random_inside(&random, d, inside, x);
        random_inside(&random, d, 0.3, z);
        assert_int_equal(perp__cone_scale(d, x, z, &T), 1);
        perp__cone_apply(d, &T, x, one);
        perp__cone_apply_inverse(d, &T, z, two);
        assert_near(one, two, d, tolerance * (1.0 + z[0] + x[0]) * (1.0 + T.eta));
        perp__cone_apply(d, &T, one, two);
        assert_near(two, z, d, tolerance * (1.0 + z[0]) * (1.0 + T.eta));
        perp__cone_apply_inverse(d, &T, two, one);
        perp__cone_apply(d, &T, x, two);
        assert_near(one, two, d, tolerance * (1.0 + z[0] + x[0]) * (1.0 + T.eta));
        perp__cone_metric(d, &T, G);
        for (int32_t i = 0; i < d; i++)
            for (int32_t j = 0; j < d; j++)
                image[i] += G[3 * j + i] * x[j];
        assert_near(image, z, d, tolerance * (1.0 + z[0]) * (1.0 + G[0] * x[0]));
    }
}

static void test_scaling_refuses_the_boundary(void **state)
{
    const double on[3] = {5.0, 3.0, 4.0}, in[3] = {1.0, 0.0, 0.0}, out[3] = {-1.0, 0.0, 0.0};
    perp__cone_scaling T;

    (void)state;
    assert_int_equal(perp__cone_scale(3, on, in, &T), 0);
    assert_int_equal(perp__cone_scale(3, in, on, &T), 0);
    assert_int_equal(perp__cone_scale(1, out, in, &T), 0);
}

/* At the end of the longest step the smaller spectral value is 0. */
static void test_longest_step_ends_on_the_boundary(void **state)
{
    gen_random random;
    int ended = 0;

    (void)state;
    gen_seed(&random, 3);
    for (int k = 0; k < TRIALS; k++) {
        int32_t d = 1 + k % 3;
        double x[3], step[3], low, high, a;

        random_inside(&random, d, 0.3, x);
        for (int32_t i = 0; i < d; i++)
            step[i] = gen_normal(&random);
        a = perp__cone_step(d, x, step);
        assert_true(a > 0.0);
        if (isinf(a)) {
            perp__cone_values(d, step, &low, &high);
            assert_true(low >= -NEAR);
            continue;
        }
        ended++;
        for (int32_t i = 0; i < d; i++)
            x[i] += a * step[i];
        perp__cone_values(d, x, &low, &high);
        assert_true(fabs(low) <= 1e2 * NEAR * (1.0 + a) * (1.0 + high));
    }
    assert_in_range(ended, TRIALS / 2, TRIALS);
}

/* Moreau: v = P(v) - P(-v), both in K and perpendicular: only the projection has that. */
static void test_projection_splits(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 4);
    for (int k = 0; k < TRIALS; k++) {
        int32_t d = 1 + k % 3;
        double v[3], negative[3], p[3], m[3], low, high, along = 0.0;

        for (int32_t i = 0; i < d; i++) {
            v[i] = gen_normal(&random);
            negative[i] = -v[i];
        }
        perp__cone_project(d, v, p);
        perp__cone_project(d, negative, m);
        for (int32_t i = 0; i < d; i++) {
            along += p[i] * m[i];
            assert_true(fabs(p[i] - m[i] - v[i]) <= NEAR);
        }
        assert_true(fabs(along) <= NEAR);
        perp__cone_values(d, p, &low, &high);
        assert_true(low >= -NEAR);
        perp__cone_values(d, m, &low, &high);
        assert_true(low >= -NEAR);
        perp__cone_project(d, v, v); /* in place */
        assert_memory_equal(v, p, (size_t)d * sizeof *p);
    }
}

/* Central differences have an error of h^2 and a rounding of eps / h. */
static void test_derivative_is_the_slope(void **state)
{
    const double h = 1e-5;
    gen_random random;

    (void)state;
    gen_seed(&random, 5);
    for (int k = 0; k < TRIALS; k++) {
        int32_t d = 1 + k % 3;
        double v[3], V[9], ahead[3], behind[3], low, high;

        for (int32_t i = 0; i < d; i++)
            v[i] = gen_normal(&random);
        perp__cone_values(d, v, &low, &high);
        if (fabs(low) < 1e-2 || fabs(high) < 1e-2 || (d > 1 && length(d, v) < 0.1))
            continue; /* too near to a kink */
        perp__cone_derivative(d, v, V);
        for (int32_t j = 0; j < d; j++) {
            double kept = v[j];

            v[j] = kept + h;
            perp__cone_project(d, v, ahead);
            v[j] = kept - h;
            perp__cone_project(d, v, behind);
            v[j] = kept;
            for (int32_t i = 0; i < d; i++)
                assert_true(fabs((ahead[i] - behind[i]) / (2.0 * h) - V[3 * j + i]) <= 1e-6);
        }
    }
}

/* p(v) o p(-v) = s e and p(v) - p(-v) = v. */
static void test_smoothing_is_central(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 6);
    for (int k = 0; k < TRIALS; k++) {
        int32_t d = 1 + k % 3;
        double s = k % 2 ? 1e-6 : 0.5;
        double v[3], negative[3], p[3], m[3], product[3];

        for (int32_t i = 0; i < d; i++) {
            v[i] = gen_normal(&random);
            negative[i] = -v[i];
        }
        perp__cone_smooth(d, v, s, p);
        perp__cone_smooth(d, negative, s, m);
        perp__cone_product(d, p, m, product);
        for (int32_t i = 0; i < d; i++) {
            assert_true(fabs(p[i] - m[i] - v[i]) <= NEAR);
            assert_true(fabs(product[i] - (i == 0 ? s : 0.0)) <= 10.0 * NEAR);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_division_undoes_the_product),
        cmocka_unit_test(test_scaling_meets_in_the_middle),
        cmocka_unit_test(test_scaling_refuses_the_boundary),
        cmocka_unit_test(test_longest_step_ends_on_the_boundary),
        cmocka_unit_test(test_projection_splits),
        cmocka_unit_test(test_derivative_is_the_slope),
        cmocka_unit_test(test_smoothing_is_central),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
