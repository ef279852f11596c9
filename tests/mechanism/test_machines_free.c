/* A pendulum on its constraint, and a free body with a quaternion. */
#include "rig.h"

/* First order in place and velocity, and the constraint itself up to rounding. A step's energy
 * changes by h^2 / 2 times
 *
 *   -(v^2 / l)^2     the part of v along the rod, by which the tangent has turned
 *   -g_t^2           place moves with the new velocity
 *   +g_r v^2 / l     the place left the circle along the tangent, and is put back
 *
 * with g_t along the motion and g_r along the rod. */
static void test_pendulum(void **state)
{
    double h;

    (void)state;
    for (h = 4e-3; h > 1e-4; h /= 4) {
        double lost = 0, energy;
        int32_t k;
        rig r;

        rig_open(&r, MACHINE_PENDULUM);
        rig_start(&r);
        energy = r.machine.energy(&r.machine, r.q, r.v);
        while (r.t < r.machine.end - h / 2) {
            const double v2 = r.v[0] * r.v[0] + r.v[1] * r.v[1], along = MACHINE_GRAVITY * r.q[0],
                         down = -MACHINE_GRAVITY * r.q[1];

            lost += h * h / 2 * (v2 * v2 + along * along - down * v2);
            rig_step(&r, h);
            assert_true(r.step.drift <= 1e-14);
            near(hypot(r.q[0], r.q[1]), 1, 1e-14, "length");
        }
        for (k = 0; k < 2; k++) {
            /* the phase is late by a step or so, and the speed, of 4 to 5, by h times g */
            near(r.q[k], r.machine.reference[k].value, 6 * h, r.machine.reference[k].what);
            near(r.v[k], r.machine.reference[k + 2].value, 20 * h, r.machine.reference[k + 2].what);
        }
        energy -= r.machine.energy(&r.machine, r.q, r.v);
        near(energy, lost, 30 * h * lost, "energy lost");
        rig_close(&r);
    }
}

/* Returns to its start, where it turns, after 4 sqrt(l / g) K: the height is back to first order,
 * and the velocity, g h there, changes its sign. */
static void test_period(void **state)
{
    const double h = 2.5e-4;
    double turns[2], before;
    int count = 0;
    rig r;

    (void)state;
    rig_open(&r, MACHINE_PENDULUM);
    rig_start(&r);
    rig_step(&r, h);
    while (count < 2) {
        before = r.v[0];
        rig_step(&r, h);
        if (r.v[0] * before < 0 && r.q[1] > -0.5)
            turns[count++] = r.t;
        assert_true(r.t < 4);
    }
    /* each swing ends a little lower: half a percent of the energy, so of the half period */
    near(turns[0], machine_value(&r.machine, "period") / 2, 20 * h, "half");
    near(turns[1], machine_value(&r.machine, "period"), 60 * h, "period");
    rig_close(&r);
}

/* q' = N(q) v keeps the quaternion's length; w and q at 10 to first order. */
static void test_spin(void **state)
{
    machine_record record[2];
    machine m;
    int32_t k, i;
    const double h = 2e-3;

    (void)state;
    machine_make(&m, MACHINE_SPIN);
    for (k = 0; k < 2; k++) {
        double length = 0;

        rig_run(&record[k], MACHINE_SPIN, NULL, h / (1 << k));
        for (i = 0; i < 4; i++)
            length += record[k].q[i] * record[k].q[i];
        near(length, 1, 4 * RIG_EPS, "length of the quaternion");
        assert_true(record[k].result.steps == 5000 << k);
    }
    for (i = 0; i < m.references; i++) {
        const machine_reference *reference = &m.reference[i];
        double error, half;

        if (reference->kind == MACHINE_OTHER)
            continue;
        error = machine_measure(&record[0], reference) - reference->value;
        half = machine_measure(&record[1], reference) - reference->value;
        near(error, 0, 10 * h, reference->what); /* over a time of 10, with w' up to 1 */
        near(error / half, 2, 0.1, reference->what);
    }
}

/* About its largest axis alone it turns evenly: the exponential of a constant spin, to second
 * order in what a step turns, as normalising q + h q' makes it: 2 atan(h w / 2) a step. */
static void test_turning(void **state)
{
    const double h = 1e-2, angle = 500 * atan(h * 2 / 2);
    int step;
    rig r;

    (void)state;
    rig_open(&r, MACHINE_SPIN);
    r.machine.v[0] = r.machine.v[1] = 0;
    r.machine.v[2] = 2;
    rig_start(&r);
    for (step = 0; step < 500; step++)
        rig_step(&r, h);
    near(r.q[0], cos(angle), 1e-13, "qw");
    near(r.q[3], sin(angle), 1e-13, "qz");
    near(r.v[2], 2, 1e-13, "spin"); /* a rounding a step */
    assert_true(r.q[1] == 0.0 && r.q[2] == 0.0);
    rig_close(&r);
}

/* The trapezoidal rule's energy: of the free body it errs by h^2 and no more with time; of the
 * pendulum, too, which the constraint itself, met to rounding, must not spoil. */
static void keep_energy(int32_t name, double end, double constant)
{
    double h;

    for (h = 2e-2; h > 1e-3; h /= 2) {
        perp_mechanism_settings settings = fresh_mechanism_settings();
        machine_record record;
        machine m;
        perp_context *context;

        machine_make(&m, name);
        settings.scheme = PERP_MECHANISM_THETA;
        assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
        assert_int_equal(machine_run(&record, context, &m, &settings, h, end), PERP_OK);
        assert_int_equal(record.result.outcome, PERP_OUTCOME_SOLVED);
        near(record.energy_change, 0, constant * h * h, m.name);
        perp_context_destroy(context);
    }
}

static void test_energy(void **state)
{
    (void)state;
    keep_energy(MACHINE_SPIN, 20, 1);
    keep_energy(MACHINE_PENDULUM, 2, 100);
}

/* Nearly about its middle axis it turns over again and again: w of the middle axis changes its
 * sign twice in a period, whose length a tiny start decides. */
static void test_turning_over(void **state)
{
    const double h = 1e-2, period = 57.462848874962667;
    double changes[3], before;
    int count = 0;
    rig r;

    (void)state;
    rig_open(&r, MACHINE_SPIN);
    r.settings.scheme = PERP_MECHANISM_THETA;
    r.machine.v[0] = 1e-3;
    r.machine.v[1] = 1;
    r.machine.v[2] = 0;
    rig_start(&r);
    while (count < 3) {
        before = r.v[1];
        rig_step(&r, h);
        if (before * r.v[1] < 0) /* where between the two */
            changes[count++] = r.t - h * r.v[1] / (r.v[1] - before);
        assert_true(r.t < 100);
    }
    /* second order: relative to the rate of turning over, h^2 / 12 and what the start adds to it */
    near(changes[0], period / 4, 10 * h * h, "first");
    near(changes[2] - changes[0], period, 40 * h * h, "period");
    rig_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pendulum), cmocka_unit_test(test_period),
        cmocka_unit_test(test_spin),     cmocka_unit_test(test_turning),
        cmocka_unit_test(test_energy),   cmocka_unit_test(test_turning_over),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
