/* Frozen steps: zeros that are exact, steps where no acceleration exists, contacts out of reach,
 * problems without a solution. */
#include "tabled.h"

#include "mechanism/mechanism.h"

#define GRAVITY 9.81
#define DEGREE (3.14159265358979323846 / 180.0)

/* ---- zeros ---------------------------------------------------------------------------------- */

/* A unit brick on a slope of 10 degrees, q = (along, off the slope). */
static void make_ramp(tabled *r, double mu, double gravity)
{
    tabled_make(r, 2, 1, 2);
    r->H[1] = 1.0;
    r->H[2] = 1.0;
    r->mu[0] = mu;
    r->k[0] = gravity * sin(10.0 * DEGREE);
    r->k[1] = -gravity * cos(10.0 * DEGREE);
}

/* theory.md (a), R1: the step in which v becomes 0, and how far the brick went until then. */
static void test_ramp(void **state)
{
    static const struct {
        double h, distance;
        int32_t zero;
    } cases[] = {{0.1, 1.5750711918848154, 17},
                 {0.01, 1.6639337264529552, 168},
                 {0.001, 1.6729195331378669, 1674}};
    int32_t i, k;

    (void)state;
    for (i = 0; i < 3; i++) {
        tabled r;

        make_ramp(&r, 0.3, GRAVITY);
        r.v[0] = 2.0;
        tabled_open(&r);
        for (k = 1; k <= cases[i].zero + 50; k++) {
            assert_int_equal(tabled_advance(&r, cases[i].h), PERP_OUTCOME_SOLVED);
            tabled_zero(r.v[1], "v off the slope");
            assert_int_equal(r.step.closed, 1);
            assert_int_equal(r.step.sticking, k >= cases[i].zero);
            assert_int_equal(r.modes[0],
                             k < cases[i].zero ? PERP_MECHANISM_SLIP : PERP_MECHANISM_STICK);
            if (k < cases[i].zero)
                assert_true(r.v[0] > 0.0);
            else
                tabled_zero(r.v[0], "v");
        }
        /* rest: the force of theory.md, inside the cone; the sums carry a rounding each step */
        tabled_near(r.impulse[1] / cases[i].h, -1.7034886229125867, 1e-14, "force");
        tabled_near(r.impulse[0] / cases[i].h, 2.8982892171149283 / 0.3, 1e-14, "normal force");
        tabled_near(r.q[0], cases[i].distance, 1e-12, "x");
        tabled_zero(r.q[1], "y");
        tabled_zero(r.velocity[0], "u_n");
        tabled_zero(r.velocity[1], "u_t");
        tabled_close(&r);
    }
}

/* Of a threshold of 1.7...: 1e-9 above it moves, 1e-9 below it doesn't, whatever gravity is. */
static void test_threshold(void **state)
{
    static const double gravities[] = {1e-12, GRAVITY, 1e12};
    const double mu = tan(10.0 * DEGREE);
    int32_t i, side;

    (void)state;
    for (i = 0; i < 3; i++)
        for (side = -1; side <= 1; side += 2) {
            const double excess = 1e-9 * gravities[i];
            tabled r;

            make_ramp(&r, mu, gravities[i]);
            r.k[0] += side * excess;
            tabled_open(&r);
            assert_int_equal(tabled_advance(&r, 0.01), PERP_OUTCOME_SOLVED);
            if (side < 0)
                tabled_zero(r.v[0], "v");
            else /* 1e-9 is known to 1e-16 / 1e-9 */
                tabled_near(r.v[0] / (0.01 * excess), 1.0, 1e-6, "v");
            tabled_zero(r.v[1], "v off the slope");
            tabled_close(&r);
        }
}

/* What sticks to a moving belt moves as the belt does; what a wall pushes moves as the wall. */
static void test_belt(void **state)
{
    static const double speeds[] = {0.1, -0.7, 1e-30, 3e20};
    int32_t i, k;

    (void)state;
    for (i = 0; i < 4; i++) {
        tabled r;

        make_ramp(&r, 0.3, GRAVITY);
        r.drift[1] = -speeds[i]; /* u_t = v - speed */
        r.v[0] = speeds[i];
        r.q[0] = 1.0;
        tabled_open(&r);
        for (k = 0; k < 20; k++) {
            assert_int_equal(tabled_advance(&r, 0.01), PERP_OUTCOME_SOLVED);
            assert_true(r.v[0] == speeds[i]);
            tabled_zero(r.velocity[1], "u_t");
        }
        tabled_close(&r);
        tabled_make(&r, 1, 1, 1);
        r.H[0] = 1.0;
        r.drift[0] = -speeds[i]; /* gap = q - speed t, at t = 0 */
        r.v[0] = speeds[i] - 1.0;
        r.k[0] = -fabs(speeds[i]);
        tabled_open(&r);
        assert_int_equal(tabled_advance(&r, 0.5), PERP_OUTCOME_SOLVED);
        assert_true(r.v[0] == speeds[i]);
        tabled_zero(r.velocity[0], "u_n");
        tabled_close(&r);
    }
}

/* Rows that lie along no axis, positions that are rounded: at rest is at rest all the same, in
 * every step, and beside a body that moves and one that closes a gap. */
static void test_rest_beside_motion(void **state)
{
    const double s = sin(0.3), c = cos(0.3);
    int32_t k, i;
    tabled r;

    (void)state;
    tabled_make(&r, 5, 3, 2); /* a brick on a slope (x, y), another one above it, a ball */
    r.H[0] = -s;
    r.H[1] = c;
    r.H[5] = c;
    r.H[6] = s;
    r.H[12] = -s;
    r.H[13] = c;
    r.H[17] = c;
    r.H[18] = s;
    r.H[24] = 1.0;
    r.mu[0] = r.mu[1] = 0.5;
    r.k[1] = r.k[3] = r.k[4] = -9.81;
    r.q[0] = 0.1 * c; /* on the slope up to rounding */
    r.q[1] = 0.1 * s;
    for (k = 0; k < 7; k++)
        r.q[1] = nextafter(r.q[1], 1.0);
    r.q[2] = -0.2 * s; /* 0.2 above it */
    r.q[3] = 0.2 * c;
    r.q[4] = 1.0;
    tabled_open(&r);
    for (k = 0; k < 300; k++) {
        assert_int_equal(tabled_advance(&r, 0.01), PERP_OUTCOME_SOLVED);
        for (i = 0; i < 2; i++)
            tabled_zero(r.v[i], "v");
    }
    for (i = 0; i < 5; i++) /* by then all have landed */
        tabled_zero(r.v[i], "v");
    tabled_close(&r);
}

/* A speed too small for a double is 0.0, not -0.0: beside a body that rests. */
static void test_too_slow_for_a_double(void **state)
{
    tabled r;

    (void)state;
    tabled_make(&r, 2, 1, 1);
    r.M[0] = 1e300;
    r.k[0] = -1e-50; /* v = -1e-352 */
    r.k[1] = -9.81;
    r.H[1] = 1.0;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.01), PERP_OUTCOME_SOLVED);
    tabled_zero(r.v[0], "v[0]");
    tabled_zero(r.v[1], "v[1]");
    tabled_close(&r);
}

/* ---- where no acceleration exists ------------------------------------------------------------ */

/* theory.md (e): a rod that slips on its tip, tan theta = 2; n and t at its start. */
static void make_rod(tabled *r, double mu)
{
    const double s = 2.0 / sqrt(5.0), c = 1.0 / sqrt(5.0);
    const double H[] = {0.0, 1.0, -c, 1.0, 0.0, s};

    tabled_make(r, 3, 1, 2);
    memcpy(r->H, H, sizeof H);
    r->M[8] = 1.0 / 3.0;
    r->k[1] = -GRAVITY;
    r->mu[0] = mu;
    r->v[0] = -1.0;
}

static void test_rod(void **state)
{
    static const struct {
        double h, v[3];
    } expected[] = {{1e-2, {-0.57057, 0.285285, 0.637916652961}},
                    {1e-4, {-0.5997057, 0.29985285, 0.670491355847}},
                    {1e-6, {-0.599997057, 0.2999985285, 0.670817102876}}};
    int32_t i, k;

    (void)state;
    for (i = 0; i < 3; i++) {
        tabled r;

        make_rod(&r, 2.0);
        tabled_open(&r);
        assert_int_equal(tabled_advance(&r, expected[i].h), PERP_OUTCOME_SOLVED);
        for (k = 0; k < 3; k++) /* the last digit that the reference prints */
            tabled_near(r.v[k], expected[i].v[k], 1e-11, "v");
        assert_int_equal(r.modes[0], PERP_MECHANISM_STICK);
        tabled_zero(r.velocity[0], "u_n");
        tabled_zero(r.velocity[1], "u_t");
        /* as h -> 0: 0.3 and 0.4, the impact without collision; linear in h */
        tabled_near(r.impulse[0], 0.3, 10.0 * expected[i].h, "N");
        tabled_near(r.impulse[1], 0.4, 10.0 * expected[i].h, "F");
        tabled_close(&r);
    }
}

/* ---- which contacts take part ---------------------------------------------------------------- */

/* Two unit masses in a row towards a wall: gaps between them and to the wall. */
static void make_row(tabled *r, double between, double wall)
{
    tabled_make(r, 2, 2, 1);
    r->H[0] = -1.0;
    r->H[1] = 1.0;
    r->H[3] = -1.0;
    r->gap[0] = between;
    r->gap[1] = wall;
}

static void test_reach(void **state)
{
    tabled r;

    (void)state;
    make_row(&r, 0.5, 10.0); /* both out of reach: free motion, no contact problem */
    r.v[0] = 1.0;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.25), PERP_OUTCOME_SOLVED);
    assert_int_equal(r.mechanism->included[0], 0);
    assert_int_equal(r.mechanism->included[1], 0);
    tabled_near(r.v[0], 1.0, 0.0, "v");
    tabled_near(r.q[0], 0.25, 0.0, "q");
    tabled_close(&r);
    make_row(&r, 0.0, 10.0); /* the wall is not reached even by the mass that is hit */
    r.v[0] = 1.0;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.25), PERP_OUTCOME_SOLVED);
    assert_int_equal(r.mechanism->included[0], 1);
    assert_int_equal(r.mechanism->included[1], 0);
    tabled_near(r.v[0], 0.5, 1e-15, "v[0]"); /* a rounding of the solver */
    tabled_near(r.v[1], 0.5, 1e-15, "v[1]");
    tabled_close(&r);
    make_row(&r, 0.0, 0.0625); /* reached only because the other one is hit: never passed */
    r.v[0] = 1.0;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.25), PERP_OUTCOME_SOLVED);
    assert_int_equal(r.mechanism->included[1], 1);
    assert_true(r.v[0] == 0.25 && r.v[1] == 0.25); /* gap / h, written by the rows that hold */
    assert_true(r.q[1] == 0.0625);
    tabled_zero(r.step.penetration, "penetration");
    assert_int_equal(r.step.closed, 2);
    assert_int_equal(tabled_advance(&r, 0.25), PERP_OUTCOME_SOLVED);
    tabled_zero(r.v[0], "v[0]");
    tabled_zero(r.v[1], "v[1]");
    tabled_close(&r);
}

/* A long row: the last of 5 contacts is reached only after all others are. Chains of inclusions. */
static void test_reach_in_turns(void **state)
{
    int32_t k;
    tabled r;

    (void)state;
    tabled_make(&r, 6, 6, 1);
    for (k = 0; k < 5; k++) {
        r.H[k * 6 + k] = -1.0;
        r.H[k * 6 + k + 1] = 1.0;
        r.gap[k] = ldexp(1.0, -5 - k);
    }
    r.H[5 * 6 + 5] = -1.0;
    r.gap[5] = ldexp(1.0, -10);
    r.v[0] = 64.0;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 1.0), PERP_OUTCOME_SOLVED);
    assert_int_equal(r.step.closed, 6);
    for (k = 0; k < 6; k++) /* every mass moves by the sum of the gaps ahead; a few roundings */
        tabled_near(r.q[k], ldexp(1.0, -4 - k) - ldexp(1.0, -10), 1e-15, "q");
    assert_true(r.step.penetration <= 1e-16);
    tabled_close(&r);
}

/* ---- where there is no step ------------------------------------------------------------------ */

/* One mass between two walls that close: v >= 1 and -v >= 1. */
static void test_closing_walls(void **state)
{
    int32_t k;
    double q, v;
    tabled r;

    (void)state;
    tabled_make(&r, 1, 2, 1);
    r.H[0] = 1.0;
    r.H[1] = -1.0;
    r.drift[0] = r.drift[1] = -1.0;
    r.q[0] = q = 0.0;
    r.v[0] = v = 0.3;
    tabled_open(&r);
    memset(r.ray, 7, sizeof r.ray);
    assert_int_equal(tabled_advance(&r, 0.1), PERP_OUTCOME_RAY);
    assert_int_equal(r.step.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
    assert_int_equal(r.step.has_ray, 1);
    assert_memory_equal(&q, r.q, sizeof q);
    assert_memory_equal(&v, r.v, sizeof v);
    /* y >= 0, H'y = 0, y'(drift) < 0 */
    assert_true(r.ray[0] > 0.0 && r.ray[0] == r.ray[1]);
    for (k = 0; k < 2; k++) {
        tabled_zero(r.impulse[k], "impulse");
        tabled_zero(r.velocity[k], "velocity");
        assert_int_equal(r.modes[k], PERP_MECHANISM_SEPARATE);
    }
    assert_int_equal(r.step.closed, 0);
    assert_int_equal(r.step.sticking, 0);
    assert_int_equal(r.step.impacts, 0);
    r.drift[0] = r.drift[1] = 0.0; /* the handle goes on */
    assert_int_equal(tabled_advance(&r, 0.1), PERP_OUTCOME_SOLVED);
    tabled_zero(r.v[0], "v");
    tabled_close(&r);
}

/* Walls that overlap, at rest: a step exists, and the overlap has no way out. */
static void test_overlapped_walls(void **state)
{
    tabled r;

    (void)state;
    tabled_make(&r, 1, 2, 1);
    r.H[0] = 1.0;
    r.H[1] = -1.0;
    r.gap[0] = r.gap[1] = -1.0;
    r.v[0] = 0.3;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.1), PERP_OUTCOME_SOLVED);
    tabled_zero(r.v[0], "v");
    tabled_zero(r.q[0], "q");
    tabled_near(r.step.penetration, 1.0, 0.0, "penetration");
    r.gap[1] = 2.0; /* now there is one, of 1 */
    assert_int_equal(tabled_advance(&r, 0.1), PERP_OUTCOME_SOLVED);
    assert_true(r.q[0] == 1.0);
    tabled_zero(r.step.penetration, "penetration");
    tabled_zero(r.v[0], "v"); /* nothing of it in the velocities */
    tabled_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ramp),
        cmocka_unit_test(test_threshold),
        cmocka_unit_test(test_belt),
        cmocka_unit_test(test_rest_beside_motion),
        cmocka_unit_test(test_too_slow_for_a_double),
        cmocka_unit_test(test_rod),
        cmocka_unit_test(test_reach),
        cmocka_unit_test(test_reach_in_turns),
        cmocka_unit_test(test_closing_walls),
        cmocka_unit_test(test_overlapped_walls),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
