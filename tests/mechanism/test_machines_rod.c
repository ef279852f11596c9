/* Rods that meet the floor in configurations of Painleve: no acceleration exists, and a step
 * answers with an impact without collision; a rod falls onto its rounded ends, tumbles and rests.
 */
#include "rig.h"

/* One step of the rod that slips on its tip, tan(angle) = 2, mu = 2. The impulses are those of the
 * two rows at rest, so that velocities are linear in h: that gives more digits than are known from
 * elsewhere (12). */
static void test_without_collision(void **state)
{
    static const double rows[][4] = {{1e-2, -0.57057, 0.285285, 0.637916652961},
                                     {1e-4, -0.5997057, 0.29985285, 0.670491355847},
                                     {1e-6, -0.599997057, 0.2999985285, 0.670817102876}};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof rows / sizeof *rows; k++) {
        const double h = rows[k][0];
        rig r;

        rig_open(&r, MACHINE_ROD);
        rig_start(&r);
        rig_step(&r, h);
        near(r.v[0], rows[k][1], 1e-12, "vx");
        near(r.v[1], rows[k][2], 1e-12, "vy");
        near(r.v[2], rows[k][3], 1e-12, "spin");
        /* the limit, met to first order: (0.3, 0.15, 0.33) g h away */
        near(r.v[0], machine_value(&r.machine, "vx"), 0.3 * MACHINE_GRAVITY * h + 1e-14, "vx");
        near(r.v[1], machine_value(&r.machine, "vy"), 0.15 * MACHINE_GRAVITY * h + 1e-14, "vy");
        near(r.v[2], machine_value(&r.machine, "spin"), 0.34 * MACHINE_GRAVITY * h + 1e-14, "spin");
        assert_int_equal(r.modes[0], PERP_MECHANISM_STICK);
        assert_true(r.velocity[0] == 0.0 && r.velocity[1] == 0.0);
        /* N = 0.3, F = 0.4 and what gravity adds in a step */
        near(r.impulse[0], 0.3, 10 * h, "normal impulse");
        near(r.impulse[1], 0.4, 10 * h, "impulse of friction");
        rig_close(&r);
    }
}

/* Poisson's law gives back half of the 0.3 that the impact without collision compresses, whether
 * the tip approaches a little or not at all. */
static void give_back(double h, double approach)
{
    rig r;

    rig_open(&r, MACHINE_ROD);
    r.settings.law = PERP_MECHANISM_POISSON;
    r.machine.restitution[0] = 0.5;
    r.machine.v[1] = -approach;
    rig_start(&r);
    rig_step(&r, h);
    /* approach and gravity add 30 h to the tip's free velocity; half of it is given back */
    near(r.velocity[0], machine_value(&r.machine, "vn, Poisson 0.5"), 16 * h, "u_n after");
    near(r.velocity[1], 0, 1e-14, "u_t after");
    near(r.impulse[0], 0.45, 45 * h, "normal impulse");
    rig_close(&r);
}

static void test_poisson(void **state)
{
    double h;

    (void)state;
    for (h = 1e-3; h > 1e-8; h /= 10) {
        give_back(h, 0);
        give_back(h, 20 * h);
    }
}

/* p = 1 + a c^2 - mu a s c, a = m l^2 / I = 3, decides: below critical mu, or turning faster than
 * the critical spin, the rod slips on or lifts off; else the tip stops within a step. */
static void test_region(void **state)
{
    static const double tangents[] = {0.7, 0.8, 2, 5.2, 5.3}, mus[] = {1.33, 1.34, 2},
                        spins[] = {0, 3.3, 3.33, 4};
    const double h = 1e-6;
    int a, b, k;

    (void)state;
    for (a = 0; a < 5; a++)
        for (b = 0; b < 3; b++)
            for (k = 0; k < 4; k++) {
                const double angle = atan(tangents[a]), c = cos(angle), s = sin(angle),
                             spin = spins[k];
                const double p = 1 + 3 * c * c - 3 * mus[b] * s * c,
                             press = spin * spin * s - MACHINE_GRAVITY;
                rig r;

                rig_open(&r, MACHINE_ROD);
                r.machine.q[1] = s;
                r.machine.q[2] = angle;
                r.machine.mu[0] = mus[b];
                r.machine.v[0] = -1 - s * spin; /* the tip slips with -1 and keeps its height */
                r.machine.v[1] = c * spin;
                r.machine.v[2] = spin;
                rig_start(&r);
                rig_step(&r, h);
                if (p < 0 && press < 0) {
                    assert_int_equal(r.modes[0], PERP_MECHANISM_STICK);
                    assert_true(r.velocity[1] == 0.0);
                } else if (p > 0 && press < 0) {
                    assert_int_equal(r.modes[0], PERP_MECHANISM_SLIP);
                    near(r.velocity[1], -1, 100 * h / p, "slips on"); /* N = g / p */
                } else if (p > 0) { /* rows frozen at the start don't see the turning yet */
                    rig_step(&r, h);
                    assert_int_equal(r.modes[0], PERP_MECHANISM_SEPARATE);
                    assert_true(r.impulse[0] == 0.0);
                }
                /* p < 0, press > 0: slipping on, lifting off and the jam are all answers */
                rig_close(&r);
            }
}

/* The first impact of the falling rod: what was before and after the step that shows it. */
static void test_first_impact(void **state)
{
    const double h = 1e-5; /* times accelerations (g, and 2000 within the impact's geometry) */
    double before[3];
    rig r;

    (void)state;
    rig_open(&r, MACHINE_ROD_FALL);
    r.machine.q[1] = 1; /* free fall, h / 2 late in y: */
    r.machine.v[1] = MACHINE_GRAVITY * h / 2;
    rig_start(&r);
    do {
        memcpy(before, r.v, sizeof before);
        rig_step(&r, h);
        assert_true(r.t < 0.5);
    } while (r.impulse[0] == 0);
    near(r.t, machine_value(&r.machine, "first impact"), h, "first impact");
    near(r.q[2] * 180 / MACHINE_PI, machine_value(&r.machine, "angle there, degrees"), 1000 * h,
         "angle");
    rig_step(&r, h); /* the first left gap / h of approach */
    near(before[1], -3.30889615951891 - 4 * -0.25 * cos(118.42291533755883 * MACHINE_PI / 180),
         20 * h, "vy before");
    near(r.v[0], machine_value(&r.machine, "vx after"), 50 * h, "vx after");
    near(r.v[1], machine_value(&r.machine, "vy after"), 50 * h, "vy after");
    near(r.v[2], machine_value(&r.machine, "spin after"), 50 * h, "spin after");
    assert_int_equal(r.modes[0], PERP_MECHANISM_STICK);
    rig_close(&r);
}

/* It ends on both caps, at rest to the last bit; where, converges to -0.22735 to first order. The
 * constant is that of the other program's steps (1.2) with room for another rounding of impacts to
 * steps. */
static void test_fall(void **state)
{
    double h;

    (void)state;
    for (h = 2.5e-3; h > 3e-5; h /= 4) {
        machine_record record;
        int32_t i;

        rig_run(&record, MACHINE_ROD_FALL, NULL, h);
        near(record.q[0], -0.22735, 3 * h + 1e-5, "x");
        near(record.q[1], 0.05, 1e-15, "y");
        near(record.q[2], MACHINE_PI, 1e-14, "angle");
        for (i = 0; i < 3; i++)
            assert_true(record.v[i] == 0.0 && record.stop[i] < 0.9);
        assert_true(record.result.penetration < 1e-15);
    }
}

/* A rod that lies has caps with gaps of rounding, above 0 or below, that no step can close: q does
 * not hold them. They are no reason to move. */
static void test_lies(void **state)
{
    int turns, ulps, k;
    int32_t scheme;

    (void)state;
    for (turns = 0; turns < 4; turns++)
        for (ulps = -2; ulps <= 2; ulps++)
            for (scheme = PERP_MECHANISM_FROZEN; scheme <= PERP_MECHANISM_THETA; scheme++) {
                rig r;

                rig_open(&r, MACHINE_ROD_FALL);
                r.settings.scheme = scheme;
                r.machine.q[1] = 0.05 * (1 + ulps * RIG_EPS);
                r.machine.q[2] = turns * MACHINE_PI;
                r.machine.v[2] = 0;
                rig_start(&r);
                for (k = 0; k < 50; k++) {
                    rig_step(&r, 1e-3);
                    assert_true(rig_rests(&r));
                }
                rig_close(&r);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_without_collision),
        cmocka_unit_test(test_poisson),
        cmocka_unit_test(test_region),
        cmocka_unit_test(test_first_impact),
        cmocka_unit_test(test_fall),
        cmocka_unit_test(test_lies),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
