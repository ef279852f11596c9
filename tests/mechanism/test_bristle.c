/* Stribeck's and LuGre's friction: closed forms, other methods of integration, energy, refusals.
 * The belt of these laws is in test_bristle_belt.c. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

/* numbers without a common scale */
static perp_bristle sample(void)
{
    perp_bristle law = fresh_bristle();

    law.kinetic = 3;
    law.breakaway = 5;
    law.speed = 0.25;
    law.viscosity = 0.5;
    law.stiffness = 800;
    law.damping = 0.75;
    return law;
}

static void close_to(double value, double expected, double error)
{
    if (!(fabs(value - expected) <= error))
        fail_msg("%.17g, expected %.17g up to %g", value, expected, error);
}

static double steady(const perp_bristle *law, double v, double *slope)
{
    double force = NAN;

    assert_int_equal(perp_stribeck_force(NULL, &force, slope, law, v), PERP_OK);
    return force;
}

static double stepped(const perp_bristle *law, double *z, double v, double h, double *slope)
{
    double force = NAN;

    assert_int_equal(perp_lugre_step(NULL, z, &force, slope, law, *z, v, h), PERP_OK);
    return force;
}

static void test_stribeck(void **state)
{
    const perp_bristle law = sample();
    double slope, v, difference;
    int k;

    (void)state;
    /* the exponential of -1, of 0, of -inf */
    close_to(steady(&law, 0.25, &slope), 3 + 2 * exp(-1) + 0.5 * 0.25, 4 * DBL_EPSILON * 4);
    close_to(slope, -2 * 2 * exp(-1) / 0.25 + 0.5, 4 * DBL_EPSILON * 6);
    assert_true(steady(&law, 0.0, &slope) == 0.0);
    assert_true(slope == 0.5);
    assert_true(steady(&law, 1e-200, NULL) == 5.0);
    assert_true(steady(&law, 1e200, &slope) == 0.5e200 && slope == 0.5);
    for (k = 0; k < 60; k++) {
        v = ldexp(1.3, k - 40);
        assert_true(steady(&law, -v, NULL) == -steady(&law, v, NULL));
        steady(&law, v, &slope);
        difference = steady(&law, v * (1 + 1e-5), NULL) - steady(&law, v * (1 - 1e-5), NULL);
        /* third derivatives are below 2 (2/speed)^3, of which 1e-10 v^2 / 6 counts; roundings of
         * forces of 5 and of viscosity v beside steps of 2e-5 v */
        close_to(difference / (2e-5 * v), slope,
                 1e-10 * v * v * 171 + DBL_EPSILON * (5 + v) / (1e-5 * v));
    }
}

static void test_steady_slip(void **state)
{
    const perp_bristle law = sample();
    const double speeds[] = {1e-3, 0.1, 0.25, 2, 1e6};
    double z, force, rate, expected;
    int k, sense;

    (void)state;
    for (k = 0; k < 5; k++)
        for (sense = -1; sense <= 1; sense += 2) {
            const double v = sense * speeds[k];

            z = 0;
            expected = steady(&law, v, NULL);
            /* 40 lengths breakaway / stiffness: exp(-40) < 1e-17 is left */
            stepped(&law, &z, v, 40 * 5 / 800.0 / fabs(v), NULL);
            force = stepped(&law, &z, v, 1e-3, NULL);
            close_to(force, expected, 8 * DBL_EPSILON * fabs(expected));
            assert_int_equal(perp_lugre_force(NULL, &force, &rate, &law, z, v), PERP_OK);
            /* rate is a difference of numbers of size v, and counts with damping 0.75 */
            close_to(rate, 0, 8 * DBL_EPSILON * fabs(v));
            close_to(force, expected, 8 * DBL_EPSILON * fabs(expected) + fabs(rate));
        }
}

/* Classical Runge-Kutta on z' = v - stiffness |v| z / g, and the mean of F by Simpson's rule. */
static void by_runge_kutta(const perp_bristle *law, double *z, double *mean, double v, double h,
                           int steps)
{
    const double dt = h / steps, start = *z;
    double sum = 0, rate[4], force, place;
    int k, stage;

    for (k = 0; k < steps; k++) {
        for (stage = 0; stage < 4; stage++) {
            place = stage == 0 ? *z : *z + (stage == 3 ? dt : dt / 2) * rate[stage - 1];
            assert_int_equal(perp_lugre_force(NULL, &force, &rate[stage], law, place, v), PERP_OK);
            sum += place * (stage == 0 || stage == 3 ? 1 : 2);
        }
        *z += dt / 6 * (rate[0] + 2 * rate[1] + 2 * rate[2] + rate[3]);
    }
    *mean =
        law->stiffness * sum / (6 * steps) + law->damping * (*z - start) / h + law->viscosity * v;
}

static void test_against_runge_kutta(void **state)
{
    const perp_bristle law = sample();
    const double speeds[] = {-0.7, -0.01, 0.02, 0.3};
    double z, other, mean = NAN, force;
    int k;

    (void)state;
    for (k = 0; k < 4; k++) {
        z = other = -0.003;
        force = stepped(&law, &z, speeds[k], 0.02, NULL);
        by_runge_kutta(&law, &other, &mean, speeds[k], 0.02, 4000);
        /* x <= 3.7 in 4000 steps: local errors (x/4000)^5 / 120 of each, 1e-17; stages enter the
         * mean to order 4 at least, (x/4000)^4 */
        close_to(z, other, 1e-12 * 0.00625);
        close_to(force, mean, 1e-11 * 5);
    }
}

/* Two steps are one of twice the length, whatever x is. */
static void test_steps_compose(void **state)
{
    const perp_bristle law = sample();
    double once, twice, force, first, second, h;
    int k;

    (void)state;
    for (k = -30; k < 40; k++) {
        h = ldexp(1.0, k);
        once = twice = 0.004;
        force = stepped(&law, &once, -0.01, 2 * h, NULL);
        first = stepped(&law, &twice, -0.01, h, NULL);
        second = stepped(&law, &twice, -0.01, h, NULL);
        close_to(twice, once, 16 * DBL_EPSILON * 0.00625);
        /* the rate is known to roundings of |v| */
        close_to(0.5 * (first + second), force, 32 * DBL_EPSILON * 5);
        assert_true(fabs(once) <= 5.0 / 800);
    }
    once = 0.001;
    stepped(&law, &once, 1e-300, 1e-300, NULL);
    assert_true(once == 0.001);
    stepped(&law, &once, 0.0, 1e300, NULL);
    assert_true(once == 0.001); /* exactly: bristles at rest keep their bend */
    force = stepped(&law, &once, 1e200, 1e200, &first);
    assert_true(once == 3.0 / 800 && force == 0.5e200 && first == 0.5);
}

static void test_slopes(void **state)
{
    const perp_bristle law = sample();
    double z, slope, up, down, v;
    int k, sense;

    (void)state;
    for (k = -24; k < 12; k++)
        for (sense = -1; sense <= 1; sense += 2) {
            v = sense * ldexp(1.0, k);
            z = 0.002;
            stepped(&law, &z, v, 0.01, &slope);
            z = 0.002;
            up = stepped(&law, &z, v * (1 + 1e-5), 0.01, NULL);
            z = 0.002;
            down = stepped(&law, &z, v * (1 - 1e-5), 0.01, NULL);
            /* relative curvature below 100 (second order, 1e-10 of it), roundings of 5 + |v| */
            close_to((up - down) / (2e-5 * v), slope,
                     1e-8 * (fabs(slope) + 1) + DBL_EPSILON * (5 + fabs(v)) / (1e-5 * fabs(v)));
        }
    z = 0.002;
    stepped(&law, &z, 0.0, 0.01, &slope);
    close_to(slope, 800 * 0.01 / 2 + 0.75 + 0.5, 8 * DBL_EPSILON * 5);
}

/* Before slip: with breakaway = kinetic and no damping LuGre's is Dahl's law, whose force depends
 * on the way u alone, F = Fc (1 - exp(-stiffness u / Fc)), and after a turn back at u1
 * F = -Fc + (F1 + Fc) exp(-stiffness u / Fc). */
static void test_presliding(void **state)
{
    perp_bristle law = sample();
    double z = 0, force, top;
    int k;

    (void)state;
    law.breakaway = law.damping = law.viscosity = 0;
    for (k = 1; k <= 100; k++) { /* speeds change all the time */
        const double v = 0.01 * (1 + k % 7), way = 4e-5;

        stepped(&law, &z, v, way / v, NULL);
        assert_int_equal(perp_lugre_force(NULL, &force, NULL, &law, z, 0.0), PERP_OK);
        close_to(force, 3 * -expm1(-800 * way * k / 3), 100 * DBL_EPSILON * 3);
        if (k == 1) /* a spring: second order in 800 way / 3 = 0.0107 */
            close_to(force / (800 * way), 1, 0.0107 / 2);
    }
    top = force;
    for (k = 1; k <= 200; k++)
        stepped(&law, &z, -0.02, 4e-5 / 0.02, NULL);
    assert_int_equal(perp_lugre_force(NULL, &force, NULL, &law, z, 0.0), PERP_OK);
    close_to(force, -3 + (top + 3) * exp(-800 * 4e-5 * 200 / 3), 300 * DBL_EPSILON * 3);
    /* there and back costs work: the loop has an area */
    assert_true(force < 0);
}

static double random_in(uint64_t *seed, double low, double high)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (high - low) * (double)(*seed >> 11) / 9007199254740992.0;
}

static int32_t is_passive(const perp_bristle *law)
{
    int32_t passive = -1;

    assert_int_equal(perp_lugre_passive(NULL, &passive, law), PERP_OK);
    return passive;
}

/* Work taken minus energy stored, over motions of random speeds of all sizes; starts with bent
 * bristles. Returns the smallest of any step beside the work's size. */
static double least_dissipation(const perp_bristle *law)
{
    uint64_t seed = 7;
    double least = 0, z = 0, v, h, before, force, loss, size;
    int k;

    for (k = 0; k < 20000; k++) {
        v = random_in(&seed, -1, 1) * exp(random_in(&seed, -8, 4));
        h = 0.01 * exp(random_in(&seed, -8, 0)) / fabs(v);
        if (k % 10 == 0)
            z = random_in(&seed, -1, 1) * law->breakaway / law->stiffness;
        before = z;
        force = stepped(law, &z, v, h, NULL);
        loss = h * force * v - law->stiffness * (z - before) * (z + before) / 2;
        size = h * fabs(v) * (fabs(force) + law->breakaway + law->damping * fabs(v));
        least = fmin(least, loss / size);
    }
    return least;
}

static void test_energy(void **state)
{
    perp_bristle law = sample();

    (void)state;
    law.viscosity = law.damping * (5 - 3) / 3.0; /* the least that is enough: 0.5 */
    assert_int_equal(is_passive(&law), 1);
    assert_true(least_dissipation(&law) >= -8 * DBL_EPSILON);
    law.viscosity *= 0.99;
    assert_int_equal(is_passive(&law), 0);
    law.viscosity = 0;
    assert_true(least_dissipation(&law) < -0.01);
    law.damping = 0;
    assert_int_equal(is_passive(&law), 1);
    assert_true(least_dissipation(&law) >= -8 * DBL_EPSILON);
}

#define REFUSED(change, expected, text)                                                         \
    do {                                                                                        \
        perp_bristle law = sample();                                                            \
        double kept[] = {7, 7, 7};                                                              \
        change;                                                                                 \
        assert_int_equal(perp_lugre_step(context, &kept[0], &kept[1], &kept[2], &law, z, v, h), \
                         expected);                                                             \
        assert_non_null(strstr(perp_context_message(context), text));                           \
        assert_int_equal(perp_lugre_step(NULL, &kept[0], &kept[1], &kept[2], &law, z, v, h),    \
                         expected);                                                             \
        assert_true(kept[0] == 7 && kept[1] == 7 && kept[2] == 7);                              \
    } while (0)

static void test_refusals(void **state)
{
    const double z = 0.001, v = 0.1, h = 0.01;
    perp_context *context;
    perp_bristle good = sample();
    double force = 7, next = 7;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    REFUSED(law.kinetic = 0, PERP_ERROR_ARGUMENT, "law.kinetic is 0, expected a number above 0");
    REFUSED(law.kinetic = NAN, PERP_ERROR_NOT_FINITE, "law.kinetic");
    REFUSED(law.breakaway = 2.5, PERP_ERROR_ARGUMENT, "law.breakaway is 2.5, below law.kinetic");
    REFUSED(law.breakaway = -1, PERP_ERROR_ARGUMENT, "law.breakaway");
    REFUSED(law.speed = 0, PERP_ERROR_ARGUMENT, "law.speed");
    REFUSED(law.viscosity = -1, PERP_ERROR_ARGUMENT, "law.viscosity");
    REFUSED(law.stiffness = 0, PERP_ERROR_ARGUMENT, "law.stiffness");
    REFUSED(law.damping = -1, PERP_ERROR_ARGUMENT, "law.damping is -1, expected at least 0");
    REFUSED(law.damping = INFINITY, PERP_ERROR_ARGUMENT, "law.damping");
    REFUSED(law.struct_size = 8, PERP_ERROR_ABI, "law.struct_size");
    assert_int_equal(perp_lugre_step(context, &next, &force, NULL, &good, NAN, v, h),
                     PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_lugre_step(context, &next, &force, NULL, &good, z, INFINITY, h),
                     PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_lugre_step(context, &next, &force, NULL, &good, z, v, 0),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lugre_step(context, &next, NULL, NULL, &good, z, v, h),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_stribeck_force(context, &force, NULL, NULL, v), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_stribeck_force(context, &force, NULL, &good, NAN), PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_lugre_force(context, &force, NULL, &good, z, NAN), PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_lugre_passive(context, NULL, &good), PERP_ERROR_ARGUMENT);
    assert_true(next == 7 && force == 7);
    good.stiffness = 0; /* Stribeck's has no bristles */
    assert_int_equal(perp_stribeck_force(context, &force, NULL, &good, v), PERP_OK);
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stribeck),      cmocka_unit_test(test_steady_slip),
        cmocka_unit_test(test_presliding),    cmocka_unit_test(test_against_runge_kutta),
        cmocka_unit_test(test_steps_compose), cmocka_unit_test(test_slopes),
        cmocka_unit_test(test_energy),        cmocka_unit_test(test_refusals),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
