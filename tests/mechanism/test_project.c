/* Penetration and drift, removed from the positions and from nothing else. */
#include "tabled.h"

/* Two unlike masses on a line overlap: they part in inverse proportion to their masses. */
static void test_shares(void **state)
{
    tabled r;

    (void)state;
    tabled_make(&r, 2, 1, 1);
    r.M[3] = 3.0;
    r.H[0] = -1.0;
    r.H[1] = 1.0;
    r.gap[0] = -1.0;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.5), PERP_OUTCOME_SOLVED);
    tabled_near(r.q[0], -0.75, 1e-15, "q[0]");
    tabled_near(r.q[1], 0.25, 1e-15, "q[1]");
    tabled_zero(r.v[0], "v[0]");
    tabled_zero(r.v[1], "v[1]");
    tabled_zero(r.velocity[0], "u");
    assert_true(r.step.penetration <= 1e-15);
    tabled_close(&r);
}

/* c = q0 + 2 q1 - 1: by the shortest displacement in the metric of M, M^-1 G' (G M^-1 G')^-1. */
static void test_drift(void **state)
{
    tabled r;

    (void)state;
    tabled_make(&r, 2, 0, 1);
    r.M[3] = 4.0;
    r.model.bilateral = 1;
    r.G[0] = 1.0;
    r.G[1] = 2.0;
    r.c[0] = -1.0;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.5), PERP_OUTCOME_SOLVED);
    tabled_near(r.q[0], 0.5, 1e-15, "q[0]");
    tabled_near(r.q[1], 0.25, 1e-15, "q[1]");
    tabled_zero(r.v[0], "v[0]");
    tabled_zero(r.v[1], "v[1]");
    assert_true(r.step.drift <= 1e-15);
    tabled_close(&r);
    r.settings.project = 0;
    memset(r.q, 0, sizeof r.q);
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.5), PERP_OUTCOME_SOLVED);
    tabled_zero(r.q[0], "q[0]");
    tabled_near(r.step.drift, 1.0, 0.0, "drift");
    tabled_close(&r);
}

/* What opens one contact may close others, one after the other: a row of masses, pushed by the one
 * that overlaps a wall. */
static void test_pushed_on(void **state)
{
    int32_t k;
    tabled r;

    (void)state;
    tabled_make(&r, 6, 6, 1);
    r.H[0] = 1.0;
    r.gap[0] = -1.0;
    for (k = 0; k < 5; k++) {
        r.H[(k + 1) * 6 + k] = -1.0;
        r.H[(k + 1) * 6 + k + 1] = 1.0;
        r.gap[k + 1] = 0.125;
    }
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.5), PERP_OUTCOME_SOLVED);
    for (k = 0; k < 6; k++) /* a few roundings */
        tabled_near(r.q[k], 1.0 - 0.125 * k, 2e-15, "q");
    assert_true(r.step.penetration <= 1e-15);
    tabled_close(&r);
}

/* The constraint q0 + q1 = 2 alone leads to (1, 1): that opens q0 >= 1/2 by itself, and leaves q0
 * >= 2 to be closed. */
static void test_opened_by_a_constraint(void **state)
{
    int32_t closes;

    (void)state;
    for (closes = 0; closes < 2; closes++) {
        tabled r;

        tabled_make(&r, 2, 1, 1);
        r.model.bilateral = 1;
        r.G[0] = r.G[1] = 1.0;
        r.c[0] = -2.0;
        r.H[0] = 1.0;
        r.gap[0] = closes ? -2.0 : -0.5;
        tabled_open(&r);
        assert_int_equal(tabled_advance(&r, 0.5), PERP_OUTCOME_SOLVED);
        tabled_near(r.q[0], 1.0 + closes, 2e-15, "q[0]"); /* a few roundings */
        tabled_near(r.q[1], 1.0 - closes, 2e-15, "q[1]");
        assert_true(r.step.penetration <= 1e-15 && r.step.drift <= 1e-15);
        tabled_close(&r);
    }
}

/* Velocities and impulses are the same bits with and without. */
static void test_velocities_are_left_alone(void **state)
{
    int32_t project;
    tabled r[2];

    (void)state;
    for (project = 0; project < 2; project++) {
        tabled *const one = &r[project];

        tabled_make_everything(one);
        one->settings.project = project;
        one->q[2] = -0.25;
        one->q[3] = 0.125;
        one->v[2] = -1.0;
        tabled_open(one);
        assert_int_equal(tabled_advance(one, 0.125), PERP_OUTCOME_SOLVED);
        tabled_close(one);
    }
    assert_memory_equal(r[0].v, r[1].v, sizeof r[0].v);
    assert_memory_equal(r[0].impulse, r[1].impulse, sizeof r[0].impulse);
    tabled_near(r[0].step.penetration, 0.25, 0.0, "penetration");
    tabled_near(r[0].step.drift, 0.125, 0.0, "drift");
    assert_true(r[1].step.penetration <= 1e-15); /* roundings of numbers of size 1 */
    assert_true(r[1].step.drift <= 1e-15);
}

/* ---- rows that bend -------------------------------------------------------------------------- */

/* A point that is kept on a circle of this radius. */
static int32_t on_a_circle(double *c, double *G, double *drift, double t, const double *q,
                           void *user)
{
    const double radius = *(const double *)user;

    (void)drift;
    (void)t;
    c[0] = (q[0] * q[0] + q[1] * q[1] - radius * radius) / 2.0;
    G[0] = q[0];
    G[1] = q[1];
    return 0;
}

static void test_circle(void **state)
{
    static const double radii[] = {1.0, 1e-8, 1e8};
    int32_t i, k;

    (void)state;
    for (i = 0; i < 3; i++) {
        double radius = radii[i];
        tabled r;

        tabled_make(&r, 2, 0, 1);
        r.model.mass = NULL;
        r.model.force = NULL;
        r.model.bilateral = 1;
        r.model.bilateral_rows = on_a_circle;
        r.model.user = &radius;
        r.q[0] = radius;
        r.v[1] = radius;
        tabled_open(&r);
        for (k = 0; k < 100; k++) { /* along the tangent, and back towards the centre */
            const double x = r.q[0], y = r.q[1];
            double angle;

            assert_int_equal(tabled_advance(&r, 0.1), PERP_OUTCOME_SOLVED);
            angle = atan(0.1 * hypot(r.v[0], r.v[1]) / radius);
            /* roundings of a dozen operations */
            tabled_near((r.q[0] * x + r.q[1] * y) / radius / radius, cos(angle), 1e-14, "turn");
            assert_true(r.step.drift <= 1e-14 * radius * radius);
        }
        tabled_close(&r);
    }
}

/* An angle kept as (cosine, sine), one velocity; the sine is not to fall below 0. */
static int32_t above(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                     void *user)
{
    (void)drift;
    (void)mu;
    (void)t;
    (void)user;
    gap[0] = q[1];
    H[0] = q[0];
    return 0;
}

static int32_t turn(double *rate, const double *q, const double *v, void *user)
{
    (void)user;
    rate[0] = -q[1] * v[0];
    rate[1] = q[0] * v[0];
    return 0;
}

static int32_t to_unit(double *q, void *user)
{
    const double length = hypot(q[0], q[1]);

    (void)user;
    q[0] /= length;
    q[1] /= length;
    return 0;
}

static void test_kinematics(void **state)
{
    tabled r;

    (void)state;
    tabled_make(&r, 1, 1, 1);
    r.model.coordinates = 2;
    r.model.mass = NULL;
    r.model.force = NULL;
    r.model.contact_rows = above;
    r.model.kinematics = turn;
    r.model.normalise = to_unit;
    r.model.user = NULL;
    r.q[0] = cos(-0.5);
    r.q[1] = sin(-0.5);
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.1), PERP_OUTCOME_SOLVED);
    tabled_near(r.q[0], 1.0, 1e-15, "cosine");
    assert_true(fabs(r.q[1]) <= 1e-15);
    tabled_zero(r.v[0], "v");
    tabled_close(&r);
}

/* ---- what cannot be removed ------------------------------------------------------------------ */

/* A gap that no displacement changes, whatever its gradient says: q stays where it is. */
static int32_t stubborn(double *gap, double *H, double *drift, double *mu, double t,
                        const double *q, void *user)
{
    (void)drift;
    (void)mu;
    (void)t;
    (void)q;
    (void)user;
    gap[0] = -0.5;
    H[0] = 1.0;
    return 0;
}

static void test_stubborn(void **state)
{
    tabled r;

    (void)state;
    tabled_make(&r, 1, 1, 1);
    r.model.contact_rows = stubborn;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.1), PERP_OUTCOME_SOLVED);
    tabled_zero(r.q[0], "q");
    tabled_near(r.step.penetration, 0.5, 0.0, "penetration");
    tabled_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shares),
        cmocka_unit_test(test_drift),
        cmocka_unit_test(test_pushed_on),
        cmocka_unit_test(test_opened_by_a_constraint),
        cmocka_unit_test(test_velocities_are_left_alone),
        cmocka_unit_test(test_circle),
        cmocka_unit_test(test_kinematics),
        cmocka_unit_test(test_stubborn),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
