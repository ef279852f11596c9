/* Steps over load-dependent friction: the sets of answers of the theory's 'implicit stepping of B',
 * jams where no acceleration exists, and the choice where several do. */
#include "friction_run.h"

static const double A = 1, b = 0, C = 3, d = 2, mu = 0.5; /* inertias 5/2 and -1/2 */

static perp_load_step step_result(void)
{
    perp_load_step step;

    assert_int_equal(perp_load_step_init(&step, sizeof step), PERP_OK);
    return step;
}

static void test_answers(void **state)
{
    const double tau[] = {-1, -2.0 / 3, 0, 3}, h = 1e-3, v = 1;
    const double expected[][3] = {{0}, {0, 1499.0 / 1500}, {0, 0.998, 0.9996}, {0, 0.992, 1.0008}};
    const int counts[] = {1, 2, 3, 3};
    perp_load_step step = step_result();
    double next, normal;
    asked a;
    int k, i;

    (void)state;
    describe(&a, 1, &A, &b, &C, &d, &mu);
    start(&a, NULL);
    for (k = 0; k < 4; k++) {
        assert_int_equal(
            perp_load_friction_step(a.friction, &next, &normal, &step, &tau[k], &v, NULL, h),
            PERP_OK);
        assert_int_equal(step.answers, counts[k]);
        assert_int_equal(step.exhaustive, 1);
        for (i = 0; i < counts[k]; i++)
            assert_close(v + h * answer(&a, i).acceleration[0], expected[k][i], 2);
        assert_int_equal(answer(&a, 0).modes[0], PERP_LOAD_STOPPED);
        /* no acceleration, or an unstable one alone: the jam; else on the stable branch */
        assert_int_equal(step.jam, k < 2);
        assert_int_equal(step.stopped, k < 2);
        assert_int_equal(step.stable, 1);
        if (k < 2)
            assert_true(next == 0.0); /* by the active set */
        else
            assert_close(next, expected[k][2], 2);
    }
    assert_int_equal(step.accelerations, 2);
    finish(&a);
}

/* tau = 0: slides with N = 4/5, or jams; the answer with N = -4 divides them. */
static void test_continuity(void **state)
{
    const double previous[] = {0.5, -0.1, -3.9, -4.1, -100, NAN}, tau = 0, v = 1;
    const int jams[] = {0, 0, 0, 1, 1, 0};
    perp_load_step step = step_result();
    double next, normal;
    asked a;
    int k;

    (void)state;
    describe(&a, 1, &A, &b, &C, &d, &mu);
    start(&a, NULL);
    for (k = 0; k < 6; k++) {
        assert_int_equal(perp_load_friction_step(a.friction, &next, &normal, &step, &tau, &v,
                                                 &previous[k], 1e-3),
                         PERP_OK);
        assert_int_equal(step.jam, jams[k]);
        assert_true((normal < 0) == jams[k]);
    }
    finish(&a);
}

/* A regular stop: weak friction, deceleration 0.4 / 0.7 from v = 1e-4 within h = 1e-3. */
static void test_regular_stop(void **state)
{
    const double weak = 0.1, tau = 0, v = 1e-4, h = 1e-3;
    perp_load_step step = step_result();
    double next;
    int k;
    asked a;

    (void)state;
    describe(&a, 1, &A, &b, &C, &d, &weak);
    start(&a, NULL);
    assert_int_equal(perp_load_friction_step(a.friction, &next, NULL, &step, &tau, &v, NULL, h),
                     PERP_OK);
    assert_int_equal(step.answers, 1);
    assert_true(next == 0.0);
    assert_int_equal(step.stopped, 1);
    assert_int_equal(step.jam, 0);
    for (k = 0; k < 10; k++) { /* and stays */
        assert_int_equal(
            perp_load_friction_step(a.friction, &next, NULL, &step, &tau, &next, NULL, h), PERP_OK);
        assert_true(next == 0.0);
        assert_int_equal(answer(&a, step.chosen).modes[0], PERP_LOAD_STICK);
        assert_int_equal(step.stopped, 0);
    }
    finish(&a);
}

/* Static friction holds what kinetic friction would not, and in a stick-slip belt (theory (q)),
 * whose load is constant (C = 0), the spring's pull at break-away is that of mu_static. */
static void test_static_friction(void **state)
{
    const double m = 1, none = 0, load = 1, kinetic = 3, static_friction = 5, rest = 0;
    const double below = 4.99, above = 5.01;
    perp_load_step step = step_result();
    double next;
    asked a;

    (void)state;
    describe(&a, 1, &m, &none, &none, &load, &kinetic)->mu_static = &static_friction;
    start(&a, NULL);
    assert_int_equal(
        perp_load_friction_step(a.friction, &next, NULL, &step, &below, &rest, NULL, 1e-3),
        PERP_OK);
    assert_int_equal(step.answers, 2); /* rest and break-away both solve the inclusion */
    assert_true(next == 0.0);
    assert_int_equal(
        perp_load_friction_step(a.friction, &next, NULL, &step, &above, &rest, NULL, 1e-3),
        PERP_OK);
    assert_int_equal(step.answers, 1);
    assert_close(next, 2.01e-3, 4);
    finish(&a);
}

/* Two coordinates without acceleration for (-2, -2): a step has five answers. Both normal forces
 * negative before: both stop. Both positive: one stops, and its impulse drives the other one on. */
static void test_two_coordinates(void **state)
{
    const double A2[] = {2, 1, 1, 2}, C2[] = {3, 1, 1, 3}, one[] = {1, 1}, zero[] = {0, 0};
    const double tau[] = {-2, -2}, previous[] = {-1, -1};
    perp_load_step step = step_result();
    double v[2] = {1, 1}, normal[2] = {1, 1};
    asked a;

    (void)state;
    describe(&a, 2, A2, zero, C2, one, one);
    start(&a, NULL);
    assert_int_equal(perp_load_friction_step(a.friction, v, NULL, &step, tau, v, previous, 1e-3),
                     PERP_OK);
    assert_int_equal(step.accelerations, 0);
    assert_int_equal(step.answers, 5);
    assert_int_equal(step.jam, 1);
    assert_int_equal(step.stopped, 2);
    assert_true(v[0] == 0.0 && v[1] == 0.0);
    v[0] = v[1] = 1;
    assert_int_equal(perp_load_friction_step(a.friction, v, normal, &step, tau, v, normal, 1e-3),
                     PERP_OK);
    assert_int_equal(step.stable, 1);
    assert_int_equal(step.jam, 1);
    assert_int_equal(step.stopped, 1);
    assert_true(v[0] * v[1] == 0.0);
    assert_close(v[0] + v[1], 1.3994, 8); /* x = 399.4 solves its row with x_other = -1000 */
    /* energy v'A v / 2: 3 before */
    assert_true(v[0] * v[0] + v[1] * v[1] < 3);
    finish(&a);
}

static void test_refusals(void **state)
{
    const double tau = 0, bad = NAN, infinite = INFINITY, v = 1;
    perp_load_step step = step_result();
    double next = 7;
    asked a;

    (void)state;
    describe(&a, 1, &A, &b, &C, &d, &mu);
    start(&a, NULL);
    assert_int_equal(perp_load_friction_step(a.friction, &next, NULL, &step, &tau, &v, NULL, 0),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_load_friction_step(a.friction, &next, NULL, &step, &bad, &v, NULL, 1e-3),
                     PERP_ERROR_NOT_FINITE);
    assert_int_equal(
        perp_load_friction_step(a.friction, &next, NULL, &step, &tau, &bad, NULL, 1e-3),
        PERP_ERROR_NOT_FINITE);
    assert_int_equal(
        perp_load_friction_step(a.friction, &next, NULL, &step, &tau, &v, &infinite, 1e-3),
        PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_load_friction_step(a.friction, NULL, NULL, &step, &tau, &v, NULL, 1e-3),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_load_friction_step(NULL, &next, NULL, &step, &tau, &v, NULL, 1e-3),
                     PERP_ERROR_HANDLE);
    assert_true(next == 7);
    finish(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_answers),         cmocka_unit_test(test_continuity),
        cmocka_unit_test(test_regular_stop),    cmocka_unit_test(test_static_friction),
        cmocka_unit_test(test_two_coordinates), cmocka_unit_test(test_refusals),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
