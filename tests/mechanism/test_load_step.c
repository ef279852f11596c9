/* Steps over load-dependent friction: the sets of answers of B6 in docs/theory.md,
 * jams where no acceleration exists, and the choice where several do. */
#include "friction_run.h"

static const double A = 1, b = 0, C = 3, d = 2, mu = 0.5; /* inertias 5/2 and -1/2 */

static void test_answers(void **state)
{
    const double tau[] = {-1, -2.0 / 3, 0, 3}, h = 1e-3, v = 1;
    const double expected[][3] = {{0}, {0, 1499.0 / 1500}, {0, 0.998, 0.9996}, {0, 0.992, 1.0008}};
    const int counts[] = {1, 2, 3, 3};
    perp_load_step step = fresh_load_step();
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
    perp_load_step step = fresh_load_step();
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
    perp_load_step step = fresh_load_step();
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

/* Static friction holds what kinetic friction would not, and in a stick-slip belt
 * (docs/machines.md), whose load is constant (C = 0), the spring's pull at break-away is that of
 * mu_static. */
static void test_static_friction(void **state)
{
    const double m = 1, none = 0, load = 1, kinetic = 3, static_friction = 5, rest = 0;
    const double below = 4.99, above = 5.01;
    perp_load_step step = fresh_load_step();
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
    perp_load_step step = fresh_load_step();
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

/* Steps have an answer whatever the system, because friction never drives: the map is coercive. And
 * with tau = b none adds energy. */
static void test_existence(void **state)
{
    uint64_t seed = 21;
    int round, none = 0;

    (void)state;
    for (round = 0; round < 600; round++) {
        const double h = pow(10, -(round % 4)), zero[3] = {0, 0, 0};
        const int n = 1 + round % 3;
        double numbers[27], A3[9], next[3];
        perp_load_step step = fresh_load_step();
        asked a;
        int i, j, k;

        for (i = 0; i < 27; i++) {
            seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            numbers[i] = (double)(int64_t)(seed >> 33) / 1073741824.0 - 1.0;
        }
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                for (A3[n * i + j] = 0.1 * (i == j), k = 0; k < n; k++)
                    A3[n * i + j] += numbers[n * i + k] * numbers[n * j + k];
        for (i = 0; i < n; i++)
            numbers[18 + i] = 3 * fabs(numbers[18 + i]); /* mu */
        describe(&a, n, A3, zero, numbers + 9, numbers + 21, numbers + 18);
        start(&a, NULL);
        assert_int_equal(
            perp_load_friction_step(a.friction, next, NULL, &step, zero, numbers + 24, NULL, h),
            PERP_OK);
        assert_int_equal(step.exhaustive, 1);
        assert_true(step.answers > 0 && step.chosen >= 0);
        none += step.accelerations == 0;
        for (k = 0; k < step.answers; k++) {
            double before = 0, after = 0;

            for (i = 0; i < n; i++)
                for (j = 0; j < n; j++) {
                    const double *x = answer(&a, k).acceleration, *v = numbers + 24;

                    before += v[i] * A3[n * i + j] * v[j];
                    after += (v[i] + h * x[i]) * A3[n * i + j] * (v[j] + h * x[j]);
                }
            assert_true(after <= before * (1 + 1e-12));
        }
        finish(&a);
    }
    assert_true(none > 25);
}

/* The belt (q): mass 1 on a spring of 100, belt speed 0.2, friction 5 at rest and 3 in motion.
 * Sticks for 0.2, slips for (2 / w)(pi - atan((Fs - Fk) w / (k V))) = 0.4712...; steps of h shift
 * each of the two transitions by at most h, the motion by O(h). */
static void test_belt(void **state)
{
    const double m = 1, none = 0, load = 1, kinetic = 3, static_friction = 5, h = 2e-4, belt = 0.2;
    const double period = 0.67123889803846899;
    double x = 0, u = 0, first = 0, last = 0, lowest = 1, highest = 0;
    perp_load_step step = fresh_load_step();
    int k, slips = 0;
    asked a;

    (void)state;
    describe(&a, 1, &m, &none, &none, &load, &kinetic)->mu_static = &static_friction;
    start(&a, NULL);
    for (k = 0; k < 20000; k++) {
        const double pull = -100 * x, before = u; /* u: relative to the belt */

        assert_int_equal(perp_load_friction_step(a.friction, &u, NULL, &step, &pull, &u, NULL, h),
                         PERP_OK);
        x += h * (belt + u);
        if (before == 0.0 && u != 0.0) {
            first = slips == 0 ? k * h : first;
            last = k * h;
            slips++;
        }
        lowest = slips > 1 ? fmin(lowest, x) : lowest;
        highest = fmax(highest, x);
    }
    assert_true(slips == 6);
    assert_true(fabs((last - first) / (slips - 1) - period) < 3 * h);
    assert_true(fabs(highest - 0.058284271247461901) < 2 * h);
    assert_true(fabs(lowest - 0.001715728752538099) < 2 * h);
    finish(&a);
}

static void test_refusals(void **state)
{
    const double tau = 0, bad = NAN, infinite = INFINITY, v = 1;
    perp_load_step step = fresh_load_step();
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

/* Weak friction: A - (mu |C| + |C|'mu) / 2 has 3 - 0.4 or more on the diagonal and 0.4 or less
 * beside it: it is definite, and a step is found without enumeration. With a coordinate more, that
 * rests apart from the others on mu_static > mu, all patterns are looked at, and the answer is the
 * same, up to the rounding of both (tol 1e-13, of numbers up to 1 / h). */
static void test_monotone(void **state)
{
    double A3[9] = {0}, C3[9], A4[16] = {0}, C4[16] = {0}, b4[4], d4[4], mu4[4], mu_static[4];
    uint64_t random = 3;
    int k, i, j, stops = 0;

    (void)state;
    for (k = 0; k < 300; k++) {
        perp_load_step one = fresh_load_step(), all = fresh_load_step();
        double v[4] = {0}, w[4], tau[4] = {0}, normal[4], other[4];
        asked direct, whole;

        for (i = 0; i < 3; i++) {
            for (j = 0; j < 3; j++) {
                random = random * UINT64_C(6364136223846793005) + 1442695040888963407u;
                C4[4 * i + j] = C3[3 * i + j] = (double)(random >> 11) / 0x1p52 - 1;
                A4[4 * i + j] = A3[3 * i + j] = i == j ? 3 : 0;
            }
            b4[i] = C3[3 * i] / 2;
            d4[i] = 2 * C3[3 * i + 1];
            tau[i] = 2 * C3[3 * i + 2];
            mu4[i] = mu_static[i] = 0.4;
            v[i] = (k + i) % 3 == 0 ? 0 : 1e-3 * C3[3 * i];
        }
        A4[15] = d4[3] = mu4[3] = 1;
        b4[3] = 0;
        mu_static[3] = 2;
        describe(&direct, 3, A3, b4, C3, d4, mu4);
        start(&direct, NULL);
        describe(&whole, 4, A4, b4, C4, d4, mu4)->mu_static = mu_static;
        start(&whole, NULL);
        assert_int_equal(
            perp_load_friction_step(direct.friction, w, normal, &one, tau, v, NULL, 1e-3), PERP_OK);
        assert_int_equal(
            perp_load_friction_step(whole.friction, v, other, &all, tau, v, NULL, 1e-3), PERP_OK);
        assert_int_equal(one.answers, 1);
        assert_int_equal(one.exhaustive, 1);
        assert_int_equal(all.answers, 1);
        assert_int_equal(all.exhaustive, 1);
        assert_int_equal(all.stopped, one.stopped);
        assert_int_equal(all.accelerations, one.accelerations);
        for (i = 0; i < 3; i++) {
            assert_true(fabs(w[i] - v[i]) <= 1e-13);
            assert_int_equal(w[i] == 0.0, v[i] == 0.0);
            assert_true(fabs(normal[i] - other[i]) <= 1e-10);
        }
        stops += one.stopped > 0;
        finish(&direct);
        finish(&whole);
    }
    assert_true(stops > 20 && stops < 280);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_answers),
        cmocka_unit_test(test_continuity),
        cmocka_unit_test(test_regular_stop),
        cmocka_unit_test(test_static_friction),
        cmocka_unit_test(test_two_coordinates),
        cmocka_unit_test(test_existence),
        cmocka_unit_test(test_belt),
        cmocka_unit_test(test_monotone),
        cmocka_unit_test(test_refusals),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
