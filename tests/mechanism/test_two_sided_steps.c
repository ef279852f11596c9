/* Steps and runs of contacts that hold both ways: Dupont's drawer, which jams, a drawer that turns
 * back, loads that change sides, and a pendulum on a pin. */
#include "memory.h"
#include "moving.h"

static const double drawers[2][5] = {{2, 0.5, 0.3, 0.4, 1}, {2.3, 0.6, 0.25, 0.35, 3}};

static const int32_t schemes[3] = {PERP_MECHANISM_FROZEN, PERP_MECHANISM_IMPLICIT,
                                   PERP_MECHANISM_THETA};

/* z = 2 mu h / L of one of the drawers; its acceleration along the motion is F / (m (1 + z)). */
static double pose(moving *s, int which, int32_t scheme, double pull, double way)
{
    const double *d = drawers[which];

    moving_drawer(s, d[0], d[1], d[2], d[3]);
    s->force = pull * d[4];
    s->v[0] = way;
    s->settings.scheme = scheme;
    return 2 * d[3] * d[1] / d[2];
}

/* Pulled along its motion it goes on with the acceleration that compliant guides settle on,
 * 0.214286 and 0.486697, in every step of every scheme: nothing here depends on time. */
static void test_pulled_on(void **state)
{
    int which, scheme, way, i;

    (void)state;
    for (which = 0; which < 2; which++)
        for (scheme = 0; scheme < 3; scheme++)
            for (way = -1; way <= 1; way += 2) {
                moving s;
                const double z = pose(&s, which, schemes[scheme], way, way);
                const double a = s.force / (s.mass * (1 + z));
                const double N = s.mass * s.offset * a / (2 * s.arm);

                moving_open(&s, NULL);
                for (i = 1; i <= 100; i++) { /* sums of 100 numbers of size 1 */
                    moving_step(&s, 0.01);
                    moving_near(s.v[0], way + 0.01 * i * a, 1e-13, "speed");
                    moving_near(s.impulse[0], -0.01 * N, 1e-13, "front");
                    moving_near(s.impulse[2], 0.01 * N, 1e-13, "behind");
                    moving_near(s.impulse[1], -way * 0.01 * s.mu[0] * fabs(N), 1e-13, "friction");
                    assert_true(s.v[1] == 0.0 && s.v[2] == 0.0);
                    assert_true(s.modes[0] == PERP_MECHANISM_SLIP);
                    assert_true(s.modes[1] == PERP_MECHANISM_SLIP);
                }
                moving_close(&s);
            }
}

/* Pulled against its motion there is no acceleration: it stops at once, with velocity 0.0, by an
 * impulse, and then goes back from rest. */
static void test_pulled_back(void **state)
{
    int which, scheme, way;

    (void)state;
    for (which = 0; which < 2; which++)
        for (scheme = 0; scheme < 3; scheme++)
            for (way = -1; way <= 1; way += 2) {
                moving s;
                const double z = pose(&s, which, schemes[scheme], -way, way);
                const double a = s.force / (s.mass * (1 + z));

                moving_open(&s, NULL);
                moving_step(&s, 1e-3);
                assert_true(s.v[0] == 0.0 && s.v[1] == 0.0 && s.v[2] == 0.0);
                assert_int_equal(s.modes[0], PERP_MECHANISM_STICK);
                assert_int_equal(s.step.sticking, 2);
                /* m dv = h F + f: friction takes the whole momentum */
                moving_near(s.impulse[1] + s.impulse[3], -way * s.mass - 1e-3 * s.force, 1e-13,
                            "friction");
                moving_step(&s, 1e-3);
                moving_near(s.v[0], 1e-3 * a, 1e-15, "speed");
                moving_close(&s);
            }
}

/* A step of the drawer that is pulled along has its two accelerations, and a third answer: the jam,
 * with friction shared in any way between the guides. select takes the acceleration that is
 * stable, whose change of velocity and whose impulses are the least. */
static void test_answers(void **state)
{
    static const int32_t selects[2] = {PERP_MECHANISM_NEAREST, PERP_MECHANISM_FREEST};
    const double h = 1e-3;
    int which, way, i;

    (void)state;
    for (which = 0; which < 2; which++)
        for (way = -1; way <= 1; way += 2) {
            perp_mechanism_summary summary = fresh_mechanism_summary();
            perp_mechanism_found found = fresh_mechanism_found();
            int seen[3] = {0};
            moving s;
            const double z = pose(&s, which, PERP_MECHANISM_FROZEN, way, way);
            const double x[3] = {s.force / (s.mass * (1 + z)), s.force / (s.mass * (1 - z)),
                                 -way / h};

            moving_open(&s, NULL);
            assert_int_equal(perp_mechanism_answers(s.mechanism, &summary, 0, h, s.q, s.v),
                             PERP_OK);
            assert_int_equal(summary.count, 3);
            assert_int_equal(summary.exhaustive, 1);
            assert_int_equal(summary.families, 1);
            for (i = 0; i < 3; i++) {
                int k;

                assert_int_equal(perp_mechanism_get_acceleration(s.mechanism, &found, i), PERP_OK);
                for (k = 0; k < 3; k++) /* rounding of v = 1 over h */
                    if (fabs(found.acceleration[0] - x[k]) <= 1e-12 * fabs(x[2])) {
                        seen[k] = 1;
                        assert_int_equal(found.stable, k != 1);
                        assert_int_equal(found.dimension, k == 2);
                    }
            }
            assert_true(seen[0] && seen[1] && seen[2]);
            for (i = 0; i < 2; i++) {
                s.settings.select = selects[i];
                assert_int_equal(perp_mechanism_set(s.mechanism, &s.settings), PERP_OK);
                s.v[0] = way;
                moving_step(&s, h);
                moving_near(s.v[0], way + h * x[0], 1e-14, "speed");
                assert_int_equal(s.step.answers, 3);
                assert_int_equal(s.step.exhaustive, 1);
            }
            moving_close(&s);
        }
}

/* ---- a pull that changes sides -------------------------------------------------------------- */

/* F sin(2 pi t) from t = 1/4 on, A = F / (2 pi m) = 1, and what rest at t = 0 came to by then. */
static void pose_pull(moving *s, double guide, double mu, int32_t scheme, double error)
{
    const double z = 2 * mu * 0.5 / guide;

    moving_drawer(s, 2, 0.5, guide, mu);
    s->force = 4 * MOVING_PI;
    s->omega = 2 * MOVING_PI;
    s->settings.scheme = scheme;
    s->settings.error = error;
    s->t = 0.25;
    s->v[0] = 1 / (1 + z);
    moving_open(s, NULL);
}

/* z = 1/3: forwards with the inertia m (1 + z) until 1/2, slower with m (1 - z) until 3/4, where
 * 1 + cos = 2 (1 - z) / (1 + z), and back with m (1 + z): v(1) = -3/4, x(1) = 3/16 + 3 / (4 pi). */
static double reversal(int32_t scheme, double error, double h)
{
    moving s;

    pose_pull(&s, 0.9, 0.3, scheme, error);
    moving_run(&s, 1.0, h);
    moving_close(&s);
    assert_true(s.v[1] == 0.0 && s.v[2] == 0.0);
    return fmax(fabs(s.v[0] + 0.75), fabs(s.q[0] - (3.0 / 16 + 0.75 / MOVING_PI)));
}

/* z = 4/3: the pull's change of sides jams the drawer at 1/2, and takes it back from rest:
 * v(1) = -2 / (1 + z), x(1) = (1 / (2 pi) - 1/4) / (1 + z). */
static double jam(int32_t scheme, double error, double h)
{
    moving s;

    pose_pull(&s, 0.3, 0.4, scheme, error);
    moving_run(&s, 1.0, h);
    moving_close(&s);
    assert_true(s.v[1] == 0.0 && s.v[2] == 0.0);
    return fmax(fabs(s.v[0] + 6.0 / 7), fabs(s.q[0] - 3.0 / 7 * (0.5 / MOVING_PI - 0.25)));
}

/* Events fall anywhere in a step, which is wrong by h times the acceleration there: 3 pi where the
 * smaller inertia ends, and less elsewhere. Steps that are chosen by their error of 1e-5, some
 * hundred of them, add up to 1e-3 at most. */
static void test_pull_that_changes_sides(void **state)
{
    int k, i;

    (void)state;
    for (k = 0; k < 3; k++) {
        for (i = 0; i < 4; i++) {
            const double h = 0.75 / (300 + 77 * i);

            assert_true(reversal(schemes[k], 0, h) <= 3 * MOVING_PI * h);
            assert_true(jam(schemes[k], 0, h) <= 3 * MOVING_PI * h);
        }
        assert_true(reversal(schemes[k], 1e-5, 0.01) <= 1e-3);
        assert_true(jam(schemes[k], 1e-5, 0.01) <= 1e-3);
    }
}

/* Without an offset, and with a load P cos(2 pi t) across: nothing is ever released, and what
 * slides loses mu P / m times the integral of |cos|, 2 / pi in a period. */
static void test_load_that_changes_sides(void **state)
{
    int k, i;

    (void)state;
    for (k = 0; k < 3; k++) {
        moving s;

        moving_drawer(&s, 2, 0, 0.3, 0.4);
        s.load = 5;
        s.omega = 2 * MOVING_PI;
        s.v[0] = 2;
        s.settings.scheme = schemes[k];
        moving_open(&s, NULL);
        for (i = 0; i < 400; i++) {
            moving_step(&s, 1.0 / 400);
            assert_int_equal(s.modes[0], PERP_MECHANISM_SLIP);
            assert_int_equal(s.modes[1], PERP_MECHANISM_SLIP);
            assert_true(s.q[1] == 0.0 && s.q[2] == 0.0);
            assert_true(s.step.drift == 0.0);
        }
        /* the sum of |cos| at 400 points is off by (pi / 400)^2 / 3 of it at most */
        moving_near(s.v[0], 2 - s.mu[0] * s.load / s.mass * 2 / MOVING_PI, 1.3e-5, "speed");
        moving_close(&s);
    }
}

/* ---- projection ---------------------------------------------------------------------------- */

/* A body beside its guides, on either side of them, is put back where they are, and not without
 * settings.project; what is left then is told. */
static void test_projection(void **state)
{
    int k, project, sides;

    (void)state;
    for (k = 0; k < 3; k++)
        for (project = 0; project < 2; project++)
            for (sides = 0; sides < 4; sides++) {
                moving s;

                pose(&s, 0, schemes[k], 1, 1);
                s.q[1] = sides & 1 ? 1e-4 : -1e-4;
                s.q[2] = sides & 2 ? 3e-4 : -3e-4;
                s.settings.project = project;
                moving_open(&s, NULL);
                moving_step(&s, 1e-3);
                if (project) {
                    assert_true(fabs(s.q[1]) <= 1e-18 && fabs(s.q[2]) <= 1e-18);
                    assert_true(s.step.drift <= 1e-18); /* a rounding of 1e-4 is 1e-20 */
                } else
                    moving_near(s.step.drift, 1e-4 + s.arm * 3e-4, 1e-18, "what is left");
                moving_close(&s);
            }
}

/* ---- the pendulum -------------------------------------------------------------------------- */

/* (I + m l^2) a' + m g l sin + mu r |R| sgn w = 0, |R|^2 = m^2 ((l a')^2 + 2 l g sin a' + l^2 w^4 +
 * 2 l g w^2 cos + g^2): a quadratic with one root on either side of -m g l sin / (I + m l^2). Out:
 * w, a', and the power that is lost. */
static void pendulum_rate(const moving *s, const double *x, double way, double *rate)
{
    const double m = s->mass, l = s->arm, g = 9.81, e = s->mu[0] * s->offset * m, w = x[1];
    const double B = s->inertia + m * l * l, pull = m * g * l * sin(x[0]);
    const double a = B * B - e * e * l * l, b = B * pull - e * e * l * g * sin(x[0]);
    const double c =
        pull * pull - e * e * (l * l * w * w * w * w + 2 * l * g * w * w * cos(x[0]) + g * g);
    const double turning = (-b - way * sqrt(b * b - a * c)) / a;

    rate[0] = w;
    rate[1] = turning;
    rate[2] = fabs((B * turning + pull) * w);
}

/* The classical method of order 4: x = (angle, speed, energy lost). */
static void pendulum_ahead(const moving *s, double *to, const double *x, double way, double h)
{
    double k[4][3], at[3];
    int i, j;

    for (j = 0; j < 4; j++) {
        for (i = 0; i < 3; i++)
            at[i] = x[i] + (j == 0 ? 0 : (j == 3 ? h : h / 2) * k[j - 1][i]);
        pendulum_rate(s, at, way, k[j]);
    }
    for (i = 0; i < 3; i++)
        to[i] = x[i] + h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
}

/* Until `end`; where it turns back the step ends with speed 0. */
static void pendulum_exact(const moving *s, double *x, double end, double h)
{
    double t = 0, way = -1; /* it starts to fall */

    while (t < end) {
        double to[3], part = fmin(h, end - t);

        pendulum_ahead(s, to, x, way, part);
        if (way * to[1] < 0) {
            double low = 0, high = part;
            int i;

            for (i = 0; i < 60; i++) {
                part = 0.5 * (low + high);
                pendulum_ahead(s, to, x, way, part);
                *(way * to[1] < 0 ? &high : &low) = part;
            }
            way = -way;
            to[1] = 0;
        }
        memcpy(x, to, sizeof to);
        t += part;
    }
}

static double pendulum_energy(const moving *s)
{
    return 0.5 * s->mass * (s->v[0] * s->v[0] + s->v[1] * s->v[1]) +
           0.5 * s->inertia * s->v[2] * s->v[2] + s->mass * 9.81 * s->q[1];
}

/* The largest error after `end` of angle, speed and energy; of chosen steps, over their estimates'
 * sum. */
static double pendulum_error(int32_t scheme, double error, double h, double end)
{
    moving s;
    double x[3] = {1.2, 0, 0}, energy, estimate;

    moving_pendulum(&s, 0.5, x[0]);
    s.settings.scheme = scheme;
    s.settings.error = error;
    pendulum_exact(&s, x, end, 1e-3);
    moving_open(&s, NULL);
    energy = pendulum_energy(&s);
    estimate = moving_run(&s, end, h);
    moving_close(&s);
    return fmax(fmax(fabs(s.q[2] - x[0]), fabs(s.v[2] - x[1])),
                fabs(energy - pendulum_energy(&s) - x[2])) /
           (error > 0 ? estimate : 1);
}

/* Over half a second without turning back frozen and implicit steps are of order 1, theta's of 2.
 * Over three, with four turns, chosen steps are as good as they say, whatever the first of them:
 * what turns the friction round is the inertia of what the pin leaves free, not the body's. */
static void test_pendulum(void **state)
{
    static const double order[3] = {2, 2, 4};
    int k, i;

    (void)state;
    for (k = 0; k < 3; k++) {
        const double coarse = pendulum_error(schemes[k], 0, 1.0 / 512, 0.5);
        const double fine = pendulum_error(schemes[k], 0, 1.0 / 1024, 0.5);

        moving_near(coarse / fine, order[k], 0.05, "order"); /* of 2 or 4, the next order */
        assert_true(fine <= 60 * pow(order[k], -10));        /* l w^3 and its like, up to 40 */
        for (i = 0; i < 3; i++)
            assert_true(pendulum_error(schemes[k], k < 2 ? 1e-4 : 1e-6, 1e-3 + 1.5e-5 * i, 3) <= 1);
    }
}

/* It comes to rest, with velocities 0.0, where the pin holds it: m g l |sin| <= mu r m g. */
static void test_pendulum_rests(void **state)
{
    int k, i;

    (void)state;
    for (k = 0; k < 3; k++) {
        moving s;

        moving_pendulum(&s, 0.9, 1.0);
        s.settings.scheme = schemes[k];
        moving_open(&s, NULL);
        for (i = 0; i < 10 && s.t < 10; i = s.v[2] == 0.0 ? i + 1 : 0)
            moving_step(&s, 5e-3);
        assert_int_equal(i, 10);
        assert_int_equal(s.modes[0], PERP_MECHANISM_STICK);
        assert_true(s.v[0] == 0.0 && s.v[1] == 0.0);
        assert_true(fabs(sin(s.q[2])) <= s.mu[0] * s.offset / s.arm);
        moving_close(&s);
    }
}

/* ---- memory -------------------------------------------------------------------------------- */

/* Every allocation fails once, of steps and of answers: the call says so, or another method
 * answers; nothing is lost, and the next try is right. */
static void test_allocation(void **state)
{
    int pin, k, fails_at, done;

    (void)state;
    for (pin = 0; pin < 2; pin++)
        for (k = 0; k < 3; k++)
            for (done = 0, fails_at = 1; !done; fails_at++) {
                memory m = {0};
                perp_context_settings settings = memory_settings(&m);
                perp_mechanism_summary summary = fresh_mechanism_summary();
                double v[3] = {7, 7, 7};
                perp_status status;
                moving s;

                if (pin) {
                    moving_pendulum(&s, 0.5, 1.2);
                    s.settings.scheme = schemes[k];
                } else
                    pose(&s, 0, schemes[k], 1, 1);
                assert_int_equal(perp_context_create(&s.context, &settings), PERP_OK);
                m.fails_at = m.calls + fails_at;
                status = perp_mechanism_create(s.context, &s.mechanism, &s.settings, &s.model);
                if (status == PERP_OK) {
                    status = perp_mechanism_advance(s.mechanism, s.q, v, NULL, NULL, NULL, NULL,
                                                    &s.step, START(0, 0.01, s.q, s.v));
                    assert_true(status == PERP_OK || v[0] == 7);
                    if (status == PERP_OK)
                        status = perp_mechanism_answers(s.mechanism, &summary, 0, 0.01, s.q, s.v);
                    done = m.calls < m.fails_at;
                    m.fails_at = 0;
                    moving_step(&s, 0.01);
                    perp_mechanism_destroy(s.mechanism);
                }
                assert_true(status == PERP_OK || status == PERP_ERROR_MEMORY);
                perp_context_destroy(s.context);
                assert_int_equal(m.live, 0);
                assert_true(fails_at < 300);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pulled_on),
        cmocka_unit_test(test_pulled_back),
        cmocka_unit_test(test_answers),
        cmocka_unit_test(test_pull_that_changes_sides),
        cmocka_unit_test(test_load_that_changes_sides),
        cmocka_unit_test(test_projection),
        cmocka_unit_test(test_pendulum),
        cmocka_unit_test(test_pendulum_rests),
        cmocka_unit_test(test_allocation),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
