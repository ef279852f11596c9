/* The rod that slips on its tip (tan(angle) = 2, mu = 2, where load and friction pull the tip in),
 * turning with w. Without a force its tip accelerates by b = w^2 sin(angle) - g: below
 * w* = sqrt(g / sin(angle)) there is no acceleration, above there are two, and lifting off is the
 * stable one. A step whose rows are those of its start does not know of w^2 sin(angle): its problem
 * is that of b = -g, which has one solution, the jam. docs/mechanism.md tells users. */
#include "rig.h"

/* Slips with -1 and turns with w; u_n = 0. */
static void step_turning(rig *r, int32_t scheme, double w, double h)
{
    rig_open(r, MACHINE_ROD);
    r->settings.scheme = scheme;
    r->machine.v[0] = -1 - w * sin(r->machine.q[2]);
    r->machine.v[1] = w * cos(r->machine.q[2]);
    r->machine.v[2] = w;
    rig_start(r);
    rig_step(r, h);
}

/* Free flight: the velocities change by gravity alone. */
static void test_theta(void **state)
{
    static const double shares[] = {0.5, 0.9, 1.01, 1.5, 6};
    static const double steps[] = {1e-3, 1e-4, 1e-5};
    int k, i;

    (void)state;
    for (k = 0; k < 5; k++)
        for (i = 0; i < 3; i++) {
            const double w = shares[k] * sqrt(MACHINE_GRAVITY / sin(atan(2.0))), h = steps[i];
            rig r;

            step_turning(&r, PERP_MECHANISM_THETA, w, h);
            if (shares[k] < 1)
                assert_int_equal(r.modes[0], PERP_MECHANISM_STICK);
            else {
                assert_int_equal(r.modes[0], PERP_MECHANISM_SEPARATE);
                near(r.v[2], w, 1e-14 * w, "spin"); /* roundings */
                near(r.v[1], r.machine.v[1] - MACHINE_GRAVITY * h, 1e-14 * w, "vy");
            }
            rig_close(&r);
        }
}

static void test_frozen(void **state)
{
    static const double speeds[] = {0, 3, 4, 100};
    int k;

    (void)state;
    for (k = 0; k < 4; k++) {
        rig r;

        step_turning(&r, PERP_MECHANISM_FROZEN, speeds[k], 1e-5);
        assert_int_equal(r.modes[0], PERP_MECHANISM_STICK);
        /* the jam's impulses, whatever the spin; gravity adds up to 9 h of normal impulse */
        near(r.impulse[0], 0.3, 10e-5, "normal impulse");
        near(r.impulse[1], 0.4, 10e-5, "friction");
        rig_close(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_theta), cmocka_unit_test(test_frozen)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
