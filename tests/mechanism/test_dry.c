/* Dry friction with a given bound (Tresca): one row or two, no bound, belts, beside contacts. */
#include "tabled.h"

#define GRAVITY 9.81
#define DEGREE (3.14159265358979323846 / 180.0)

/* The ramp of theory.md (a), whose normal force is known: the same zeros as with a contact. */
static void test_ramp(void **state)
{
    static const double h[] = {0.1, 0.01, 0.001};
    static const int32_t zero[] = {17, 168, 1674};
    int32_t i, k;

    (void)state;
    for (i = 0; i < 3; i++) {
        tabled r;

        tabled_make(&r, 1, 0, 1);
        r.model.dry = 1;
        r.B[0] = 1.0;
        r.bound[0] = 0.3 * GRAVITY * cos(10.0 * DEGREE);
        r.k[0] = GRAVITY * sin(10.0 * DEGREE);
        r.v[0] = 2.0;
        tabled_open(&r);
        for (k = 1; k <= zero[i] + 20; k++) {
            assert_int_equal(tabled_advance(&r, h[i]), PERP_OUTCOME_SOLVED);
            assert_int_equal(r.modes[0], k < zero[i] ? PERP_MECHANISM_SLIP : PERP_MECHANISM_STICK);
            if (k < zero[i]) {
                assert_true(r.v[0] > 0.0);
                tabled_near(r.impulse[0] / h[i], -r.bound[0], 1e-14, "sliding force");
            } else {
                tabled_zero(r.v[0], "v");
                if (k > zero[i]) /* the first of these steps has a stop in it */
                    tabled_near(r.impulse[0] / h[i], -1.7034886229125867, 1e-14, "force at rest");
            }
        }
        tabled_close(&r);
    }
}

/* The soft threshold v+ = sign(vf) max(0, |vf| - h c / m), for all signs, masses and bounds. */
static void test_soft_threshold(void **state)
{
    static const double speeds[] = {-3.0, -0.4, 0.0, 0.4, 3.0}, bounds[] = {0.0, 1e-9, 1.0, 50.0};
    static const double masses[] = {1e-6, 1.0, 1e6};
    int32_t i, j, k;

    (void)state;
    for (i = 0; i < 5; i++)
        for (j = 0; j < 4; j++)
            for (k = 0; k < 3; k++) {
                const double h = 0.25, shrink = h * bounds[j]; /* bound times mass */
                const double expected = copysign(fmax(fabs(speeds[i]) - shrink, 0.0), speeds[i]);
                tabled r;

                tabled_make(&r, 1, 0, 1);
                r.M[0] = masses[k];
                r.model.dry = 1;
                r.B[0] = -2.0; /* the row's scale is the caller's affair: force 2 y */
                r.bound[0] = bounds[j] * masses[k] / 2.0;
                r.v[0] = speeds[i];
                tabled_open(&r);
                assert_int_equal(tabled_advance(&r, h), PERP_OUTCOME_SOLVED);
                if (expected == 0.0)
                    tabled_zero(r.v[0], "v");
                else /* settings.tol: what is smaller beside the momentum may be left out */
                    tabled_near(r.v[0], expected, bounds[j] < 1e-8 ? 1e-10 : 1e-14, "v");
                assert_int_equal(r.modes[0], expected == 0.0 && bounds[j] > 0.0
                                                 ? PERP_MECHANISM_STICK
                                                 : PERP_MECHANISM_SLIP);
                tabled_close(&r);
            }
}

/* One row or two of any size: what the bound can stop is stopped. */
static void test_units(void **state)
{
    static const struct {
        double row, mass, v;
    } cases[] = {{1e-200, 4e-308, 1e100}, {1e-180, 1e-300, 1e100}, {1e180, 1e300, 1e-130}};
    int32_t k, dim;

    (void)state;
    for (k = 0; k < 3; k++)
        for (dim = 1; dim <= 2; dim++) {
            tabled r;

            tabled_make(&r, 1, 0, 1);
            r.model.dry = 1;
            r.model.dry_dim = dim;
            r.M[0] = cases[k].mass;
            r.B[0] = cases[k].row;
            r.v[0] = cases[k].v;
            r.bound[0] = 2.0; /* stops 2 h row / mass: 1e107, 1e119, 1e-121 and more */
            tabled_open(&r);
            assert_int_equal(tabled_advance(&r, 0.5), PERP_OUTCOME_SOLVED);
            tabled_zero(r.v[0], "v");
            tabled_close(&r);
        }
}

/* Two rows: a disc. The velocity shrinks along itself, with no bias to any direction. */
static void test_disc(void **state)
{
    int32_t k;

    (void)state;
    for (k = 0; k < 24; k++) {
        const double angle = 0.3 + k * 15.0 * DEGREE, h = 0.125;
        tabled r;

        tabled_make(&r, 2, 0, 1);
        r.model.dry = 1;
        r.model.dry_dim = 2;
        r.B[0] = r.B[3] = 1.0;
        r.bound[0] = 4.905; /* theory.md (b) */
        r.v[0] = 3.0 * cos(angle);
        r.v[1] = 3.0 * sin(angle);
        tabled_open(&r);
        assert_int_equal(tabled_advance(&r, h), PERP_OUTCOME_SOLVED);
        /* settings.tol of the impulse, which is 0.6 */
        tabled_near(r.v[0], (3.0 - h * 4.905) * cos(angle), 1e-10, "v[0]");
        tabled_near(r.v[1], (3.0 - h * 4.905) * sin(angle), 1e-10, "v[1]");
        assert_int_equal(r.modes[0], PERP_MECHANISM_SLIP);
        while (r.modes[0] == PERP_MECHANISM_SLIP)
            assert_int_equal(tabled_advance(&r, h), PERP_OUTCOME_SOLVED);
        tabled_zero(r.v[0], "v[0]");
        tabled_zero(r.v[1], "v[1]");
        tabled_near(r.q[1] * cos(angle), r.q[0] * sin(angle), 1e-10, "straight");
        tabled_close(&r);
    }
}

/* On a belt: sticking is the belt's velocity, exactly; in two dimensions too. */
static void test_belts(void **state)
{
    static const double belt[] = {0.7, -0.1};
    int32_t dim, i, k;

    (void)state;
    for (dim = 1; dim <= 2; dim++) {
        tabled r;

        tabled_make(&r, dim, 0, 1);
        r.model.dry = 1;
        r.model.dry_dim = dim;
        for (i = 0; i < dim; i++) {
            r.B[i * (dim + 1)] = 1.0;
            r.b_drift[i] = -belt[i];
        }
        r.bound[0] = 1.0;
        r.k[0] = 0.3;
        tabled_open(&r);
        for (k = 0; k < 40; k++)
            assert_int_equal(tabled_advance(&r, 0.1), PERP_OUTCOME_SOLVED);
        for (i = 0; i < dim; i++) {
            assert_true(r.v[i] == belt[i]);
            tabled_zero(r.velocity[i], "u");
            tabled_near(r.impulse[i], i == 0 ? -0.03 : 0.0, 1e-10, "impulse");
        }
        tabled_close(&r);
    }
}

/* Beside a contact and a bilateral row, groups apart. Rows of H, of G, of B in this order. */
static void test_beside_others(void **state)
{
    tabled r;

    (void)state;
    tabled_make_everything(&r);
    r.v[4] = 1.0;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
    /* the group: mass 5, driven by 3, held by 1 */
    tabled_near(r.v[4], 1.0 + 0.125 * (3.0 - 1.0) / 5.0, 1e-15, "v[4]");
    tabled_near(r.impulse[6], -0.125, 1e-15, "impulse of the group");
    assert_int_equal(r.modes[2], PERP_MECHANISM_SLIP);
    tabled_near(r.velocity[6], r.v[4], 1e-15, "u of the group");
    /* the contact: presses with its weight */
    tabled_near(r.impulse[0], 0.125 * 9.81, 1e-10, "normal impulse");
    assert_int_equal(r.modes[0], PERP_MECHANISM_SLIP);
    assert_int_equal(r.modes[1], PERP_MECHANISM_SEPARATE);
    tabled_zero(r.velocity[5], "u of the bilateral row");
    r.v[4] = 0.0;
    r.k[4] = 0.5; /* below the bound */
    assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
    tabled_zero(r.v[4], "v[4]");
    assert_int_equal(r.modes[2], PERP_MECHANISM_STICK);
    tabled_near(r.impulse[6], -0.0625, 1e-15, "impulse at rest");
    tabled_close(&r);
}

/* Rows that move nothing are no friction: zero rows, and a bound of 0. */
static void test_nothing(void **state)
{
    tabled r;

    (void)state;
    tabled_make(&r, 2, 0, 1);
    r.model.dry = 2;
    r.B[3] = 1.0; /* the first group's row is 0 */
    r.bound[0] = 1.0;
    r.bound[1] = 0.0;
    r.v[0] = r.v[1] = 1.0;
    tabled_open(&r);
    assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
    tabled_near(r.v[0], 1.0, 0.0, "v[0]");
    tabled_near(r.v[1], 1.0, 0.0, "v[1]");
    tabled_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ramp),    cmocka_unit_test(test_soft_threshold),
        cmocka_unit_test(test_units),   cmocka_unit_test(test_disc),
        cmocka_unit_test(test_belts),   cmocka_unit_test(test_beside_others),
        cmocka_unit_test(test_nothing),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
