/* Impacts: the laws on chains, blocks and walls, impacts without collision, and what energy does.
 */
#include "tabled.h"

static const int32_t laws[] = {PERP_MECHANISM_MOREAU, PERP_MECHANISM_NEWTON, PERP_MECHANISM_POISSON,
                               PERP_MECHANISM_STRONGE};

/* One impulsive step: no forces, positions are left alone. */
static int32_t hit(tabled *r, int32_t law)
{
    int32_t outcome;

    r->settings.law = law;
    r->settings.project = 0;
    tabled_open(r);
    outcome = tabled_advance(r, 1e-3);
    tabled_close(r);
    return outcome;
}

/* ---- closed forms --------------------------------------------------------------------------- */

/* theory.md (f): equal balls that touch, one comes in; all laws agree. */
static void test_chains(void **state)
{
    static const double e[] = {0.0, 0.5, 1.0};
    int32_t law, i, n, k;

    (void)state;
    for (law = 0; law < 4; law++)
        for (n = 2; n <= 6; n++)
            for (i = 0; i < 3; i++) {
                tabled r;

                tabled_make(&r, n, n - 1, 1);
                for (k = 0; k + 1 < n; k++) {
                    r.H[k * n + k] = -1.0;
                    r.H[k * n + k + 1] = 1.0;
                    r.restitution[k] = e[i];
                }
                r.v[0] = 1.0;
                assert_int_equal(hit(&r, laws[law]), PERP_OUTCOME_SOLVED);
                assert_int_equal(r.step.impacts, e[i] > 0.0);
                for (k = 0; k < n; k++) /* roundings; what expands is as good as tol = 1e-10 */
                    tabled_near(r.v[k], (1.0 + e[i]) / n - (k == 0 ? e[i] : 0.0),
                                laws[law] >= PERP_MECHANISM_POISSON ? 1e-10 : 4e-15, "v");
            }
}

static void test_unlike_balls(void **state)
{
    int32_t law;

    (void)state;
    for (law = 0; law < 4; law++) {
        tabled r;

        tabled_make(&r, 2, 1, 1);
        r.M[3] = 3.0;
        r.H[0] = -1.0;
        r.H[1] = 1.0;
        r.restitution[0] = 0.5;
        r.v[0] = 1.0;
        assert_int_equal(hit(&r, laws[law]), PERP_OUTCOME_SOLVED);
        tabled_near(r.v[0], -0.125, 1e-15, "v[0]");
        tabled_near(r.v[1], 0.375, 1e-15, "v[1]");
        assert_int_equal(r.modes[0], PERP_MECHANISM_STICK); /* it pressed; nothing can slide */
        tabled_near(r.impulse[0], 1.125, 1e-15, "impulse");
    }
}

/* theory.md (g): a block that turns about its left corner lands on its right one. */
static void test_rocking_block(void **state)
{
    static const double ratio[] = {0.2, 0.5, 1.0}, factor[] = {0.94230769230769231, 0.7, 0.25};
    int32_t i, law;

    (void)state;
    for (law = 0; law < 4; law++)
        for (i = 0; i < 4; i++) {
            const double b = i < 3 ? ratio[i] : 1.5, h = 1.0, inertia = (b * b + h * h) / 3.0;
            const double sine = b / hypot(b, h), cosine = h / hypot(b, h);
            const double needed = 3.0 * sine * cosine / (1.0 + 3.0 * cosine * cosine);
            /* left corner (-b, -h), right (b, -h): normals up, tangents along the floor */
            const double H[] = {0, 1, -b, 1, 0, h, 0, 1, b, 1, 0, h};
            tabled r;

            tabled_make(&r, 3, 2, 2);
            memcpy(r.H, H, sizeof H);
            r.M[8] = inertia;
            r.mu[0] = r.mu[1] = needed * (1.0 + 1e-9);
            r.v[2] = -1.0; /* the left corner rests */
            r.v[0] = h;
            r.v[1] = -b;
            assert_int_equal(hit(&r, laws[law]), PERP_OUTCOME_SOLVED);
            if (i < 3) { /* a few roundings; the right corner sticks */
                tabled_near(r.v[2], -factor[i], 1e-14, "omega");
                tabled_near(r.velocity[0], 2.0 * b * factor[i], 1e-14, "left corner");
                tabled_zero(r.velocity[2], "right corner");
                tabled_zero(r.velocity[3], "right corner, along");
            } else /* wide: stops dead */
                tabled_zero(r.v[2], "omega");
        }
}

/* ---- opposed walls --------------------------------------------------------------------------- */

/* A mass that moves to the right between walls that both touch. */
static int32_t between_walls(tabled *r, double left, double right, int32_t law)
{
    tabled_make(r, 1, 2, 1);
    r->H[0] = 1.0;
    r->H[1] = -1.0;
    r->restitution[0] = left;
    r->restitution[1] = right;
    r->v[0] = 1.0;
    return hit(r, law);
}

static void test_walls(void **state)
{
    tabled r;

    (void)state;
    /* the same e: v = -e is the only velocity that Moreau's law leaves */
    assert_int_equal(between_walls(&r, 0.5, 0.5, PERP_MECHANISM_MOREAU), PERP_OUTCOME_SOLVED);
    assert_true(r.v[0] == -0.5);
    assert_int_equal(between_walls(&r, 1.0, 1.0, PERP_MECHANISM_MOREAU), PERP_OUTCOME_SOLVED);
    assert_true(r.v[0] == -1.0);
    /* v >= -e_left and -v >= e_right; without the first one's e, v >= 0 */
    assert_int_equal(between_walls(&r, 0.75, 0.5, PERP_MECHANISM_MOREAU), PERP_OUTCOME_SOLVED);
    assert_true(r.v[0] == -0.5);
    assert_int_equal(between_walls(&r, 0.25, 0.5, PERP_MECHANISM_MOREAU), PERP_OUTCOME_RAY);
    assert_int_equal(r.step.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
    assert_true(r.v[0] == 1.0 && r.q[0] == 0.0);
    tabled_zero(r.impulse[1], "impulse");
    assert_int_equal(between_walls(&r, 0.5, 0.5, PERP_MECHANISM_NEWTON), PERP_OUTCOME_RAY);
    assert_int_equal(r.step.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
    assert_true(r.v[0] == 1.0 && r.q[0] == 0.0);
    /* nobody is hit where the wall ahead gives nothing back */
    assert_int_equal(between_walls(&r, 0.5, 0.0, PERP_MECHANISM_MOREAU), PERP_OUTCOME_SOLVED);
    tabled_zero(r.v[0], "v");
    /* Poisson: the other wall takes what expansion gives */
    assert_int_equal(between_walls(&r, 0.25, 0.5, PERP_MECHANISM_POISSON), PERP_OUTCOME_SOLVED);
    tabled_zero(r.v[0], "v");
    tabled_near(r.impulse[1], 1.5, 1e-15, "ahead");
    tabled_near(r.impulse[0], 0.5, 1e-15, "behind");
}

/* A ball of mass 3 hits one of mass 1, e = 1, before a wall that it would reach if it was alone.
 * The plastic stage, with 3/4 of the speed, leaves 1/8 h to the wall: the ball may go there within
 * the next step, 1/8 fast, no further, and the other one is faster by 1. Without a wall it would go
 * on with 1/2. */
static void test_a_wall_not_touched_yet(void **state)
{
    const double h = 1.0 / 1024;
    int32_t law;

    (void)state;
    for (law = 0; law < 2; law++) { /* Poisson's expansion knows impulses, not gaps */
        tabled r;

        tabled_make(&r, 2, 2, 1);
        r.M[0] = 3.0;
        r.H[0] = -1.0;
        r.H[1] = 1.0;
        r.H[2] = -1.0;
        r.gap[1] = 0.875 * h;
        r.restitution[0] = r.restitution[1] = 1.0;
        r.v[0] = 1.0;
        r.settings.law = laws[law];
        tabled_open(&r);
        assert_int_equal(tabled_advance(&r, h), PERP_OUTCOME_SOLVED);
        assert_int_equal(r.step.impacts, 1);
        tabled_near(r.v[0], 0.125, 4e-15, "v[0]");
        tabled_near(r.v[1], 1.125, 4e-15, "v[1]");
        tabled_near(r.q[1], 0.75 * h, 4e-15 * h, "q[1]");
        tabled_close(&r);
    }
}

/* ---- impacts without collision --------------------------------------------------------------- */

/* theory.md (e), in the plane or with a second tangent that is turned by `angle`. */
static void make_rod(tabled *r, int32_t dim, double angle, double mu, double e)
{
    const double s = 2.0 / sqrt(5.0), c = 1.0 / sqrt(5.0);
    const double along[] = {1.0, 0.0, s, 0.0}, across[] = {0.0, 0.0, 0.0, 1.0};
    int32_t i;

    tabled_make(r, 4, 1, dim); /* x, y, angle, and z out of the plane */
    r->H[1] = 1.0;
    r->H[2] = -c;
    for (i = 0; i < 4; i++) {
        r->H[4 + i] = cos(angle) * along[i] - sin(angle) * across[i];
        r->H[8 + i] = sin(angle) * along[i] + cos(angle) * across[i];
    }
    r->M[10] = 1.0 / 3.0;
    r->k[1] = -9.81;
    r->mu[0] = mu;
    r->restitution[0] = e;
    r->v[0] = -1.0;
}

static void test_rod(void **state)
{
    static const double steps[] = {1e-2, 1e-4, 1e-6};
    int32_t i, dim, law;

    (void)state;
    for (law = 0; law < 3; law++)
        for (dim = 2; dim <= 3; dim++)
            for (i = 0; i < 3; i++) {
                const int32_t poisson = laws[law] == PERP_MECHANISM_POISSON;
                tabled r;

                make_rod(&r, dim, dim == 2 ? 0.0 : 0.7, 2.0, 0.5);
                r.settings.law = laws[law];
                r.settings.project = 0;
                tabled_open(&r);
                assert_int_equal(tabled_advance(&r, steps[i]), PERP_OUTCOME_SOLVED);
                assert_int_equal(r.step.impacts, poisson);
                /* linear in h, with a factor below 20 */
                tabled_near(r.velocity[0], poisson ? 0.17647058823529412 : 0.0, 20.0 * steps[i],
                            "u_n");
                tabled_zero(r.velocity[1], "u_t");
                tabled_near(r.impulse[0], poisson ? 0.45 : 0.3, 20.0 * steps[i], "N");
                assert_int_equal(r.modes[0], PERP_MECHANISM_STICK);
                tabled_close(&r);
            }
}

/* With less friction sliding goes on: forces, no impact, and no bounce of order g h. */
static void test_sliding_is_no_impact(void **state)
{
    static const double mus[] = {0.0, 0.5, 1.3};
    int32_t i, k;

    (void)state;
    for (i = 0; i < 3; i++) {
        tabled r;

        make_rod(&r, 2, 0.0, mus[i], 0.5);
        r.settings.law = PERP_MECHANISM_POISSON;
        tabled_open(&r);
        for (k = 0; k < 5; k++) {
            assert_int_equal(tabled_advance(&r, 1e-4), PERP_OUTCOME_SOLVED);
            assert_int_equal(r.step.impacts, 0);
            assert_int_equal(r.step.closed, 1);
            assert_true(fabs(r.velocity[0]) < 1e-15); /* rounding of the gap, over h */
            assert_int_equal(r.modes[0], PERP_MECHANISM_SLIP);
        }
        tabled_close(&r);
    }
}

/* On a rail, y = 0 is a bilateral constraint: p = l^2 c (c - mu s) / I < 0 for mu tan theta > 1.
 * Stick gives N = 2, F = 1; expansion adds 1 and u_n = 0.6 - 1.2^2 / 3.4. */
static void test_rod_on_a_rail(void **state)
{
    static const double mus[] = {0.45, 1.0};
    int32_t i;

    (void)state;
    for (i = 0; i < 2; i++) {
        tabled r;

        make_rod(&r, 2, 0.0, mus[i], 0.5);
        r.settings.law = PERP_MECHANISM_POISSON;
        r.settings.project = 0;
        r.k[1] = 0.0;
        r.k[2] = 1.0; /* presses the tip down */
        r.model.bilateral = 1;
        r.G[1] = 1.0;
        tabled_open(&r);
        assert_int_equal(tabled_advance(&r, 1e-6), PERP_OUTCOME_SOLVED);
        assert_int_equal(r.step.impacts, i);
        tabled_zero(r.v[1], "y'");
        if (i == 1) {
            tabled_near(r.impulse[0], 3.0, 1e-4, "N"); /* h -> 0 */
            tabled_near(r.velocity[0], 0.6 - 1.44 / 3.4, 1e-4, "u_n");
        } else
            tabled_zero(r.velocity[0], "u_n");
        tabled_close(&r);
    }
}

/* ---- rest ------------------------------------------------------------------------------------ */

/* A ball dropped from 1 ends at rest, not in bounces of g h: theory.md (c). */
static void test_ball_comes_to_rest(void **state)
{
    int32_t law, k;

    (void)state;
    for (law = 0; law < 4; law++) {
        tabled r;

        tabled_make(&r, 1, 1, 1);
        r.H[0] = 1.0;
        r.k[0] = -9.81;
        r.q[0] = 1.0;
        r.restitution[0] = 0.8;
        r.settings.law = laws[law];
        tabled_open(&r);
        for (k = 0; k < 500; k++) /* Zeno's time is 4.06 */
            assert_int_equal(tabled_advance(&r, 0.01), PERP_OUTCOME_SOLVED);
        tabled_zero(r.v[0], "v");
        assert_true(r.q[0] >= 0.0 && r.q[0] < 1e-12);
        tabled_close(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chains),
        cmocka_unit_test(test_unlike_balls),
        cmocka_unit_test(test_rocking_block),
        cmocka_unit_test(test_walls),
        cmocka_unit_test(test_a_wall_not_touched_yet),
        cmocka_unit_test(test_rod),
        cmocka_unit_test(test_sliding_is_no_impact),
        cmocka_unit_test(test_rod_on_a_rail),
        cmocka_unit_test(test_ball_comes_to_rest),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
