/* A brick on a ramp with a known normal force, m v' in m g sin th + F(t) - mu m g cos th Sgn v.
 * The step is v+ = soft(v + h k/m, h c/m), with k at the step's start and x+ = x + h v+ (frozen), k
 * at its end and the same (implicit), or the means of k and of v (theta = 1/2): that is what a step
 * must give up to rounding, and v is 0.0 where it sticks. */
#include "rig.h"

static double drive(const machine_ramp *ramp, double t)
{
    return ramp->mass * MACHINE_GRAVITY * sin(ramp->slope) + ramp->force + ramp->rate * t +
           ramp->amplitude * sin(ramp->frequency * t);
}

static double cap(const machine_ramp *ramp)
{
    return ramp->mu * ramp->mass * MACHINE_GRAVITY * cos(ramp->slope);
}

/* One row, every step beside the formula. */
static void follow(int32_t name, int32_t scheme)
{
    const double h = name == MACHINE_RAMP_R7 ? 1e-2 : 1e-3;
    const machine_ramp *ramp;
    int32_t step;
    rig r;

    rig_open(&r, name);
    r.settings.scheme = scheme;
    rig_start(&r);
    ramp = &r.machine.data.ramp;
    for (step = 0; step < 2000; step++) {
        const double theta = scheme == PERP_MECHANISM_IMPLICIT ? 1
                             : scheme == PERP_MECHANISM_THETA  ? 0.5
                                                               : 0,
                     k0 = drive(ramp, r.t), k1 = drive(ramp, r.t + h),
                     free = r.v[0] + h * ((1 - theta) * k0 + theta * k1) / ramp->mass,
                     left = fabs(free) - h * cap(ramp) / ramp->mass,
                     impulse = left > 0 ? -h * copysign(cap(ramp), free) : -ramp->mass * free,
                     v = left > 0 ? copysign(left, free) : 0.0,
                     mean = scheme == PERP_MECHANISM_THETA ? (v + r.v[0]) / 2 : v,
                     x = r.q[0] + h * mean;

        rig_step(&r, h);
        /* a few roundings of numbers below 8 */
        near(r.v[0], v, 16 * RIG_EPS, r.machine.name);
        near(r.q[0], x, 16 * RIG_EPS, r.machine.name);
        near(r.impulse[0], impulse, 16 * RIG_EPS, r.machine.name);
        /* apart from the very edge the mode is that of the formula */
        if (fabs(left) > 1e-12) {
            assert_int_equal(r.modes[0], left > 0 ? PERP_MECHANISM_SLIP : PERP_MECHANISM_STICK);
            assert_true(left > 0 || (r.v[0] == 0.0 && r.velocity[0] == 0.0));
        }
    }
    rig_close(&r);
}

static void test_formula(void **state)
{
    int32_t name, scheme;

    (void)state;
    for (name = MACHINE_RAMP_R1; name <= MACHINE_RAMP_R7; name++)
        for (scheme = PERP_MECHANISM_FROZEN; scheme <= PERP_MECHANISM_THETA; scheme++)
            follow(name, scheme);
}

/* R1: where and when exact arithmetic stops, and rest to the last bit from there on. */
static void test_stop(void **state)
{
    static const struct {
        double h, x;
        int first;
    } rows[] = {{0.1, 1.5750711918848154, 17},
                {0.01, 1.6639337264529552, 168},
                {0.001, 1.6729195331378669, 1674}};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof rows / sizeof *rows; k++) {
        int step;
        double x = 0;
        rig r;

        rig_open(&r, MACHINE_RAMP_R1);
        rig_start(&r);
        for (step = 1; step <= 3 * rows[k].first; step++) {
            rig_step(&r, rows[k].h);
            assert_int_equal(r.v[0] == 0.0, step >= rows[k].first);
            if (step == rows[k].first)
                x = r.q[0];
            if (step > rows[k].first) {
                assert_true(r.q[0] == x);
                near(r.impulse[0] / rows[k].h, -1.7034886229125867, 4 * RIG_EPS, "force at rest");
                assert_int_equal(r.modes[0], PERP_MECHANISM_STICK);
            }
        }
        /* one rounding of numbers below 2 a step */
        near(x, rows[k].x, rows[k].first * 4 * RIG_EPS, "place of the stop");
        rig_close(&r);
    }
}

/* The motions themselves, which implicit Euler meets to first order: over one step it is wrong by
 * at most h (|v| + h |a|) in x and, with k at the step's start, h |k'| in v, beside a step's worth
 * of the wrong sign of friction where the motion turns. */
static void test_motions(void **state)
{
    const double h = 1e-3;
    int32_t name, k;

    (void)state;
    for (name = MACHINE_RAMP_R1; name <= MACHINE_RAMP_R7; name++) {
        machine_record record;
        machine m;

        machine_make(&m, name);
        rig_run(&record, name, NULL, h);
        for (k = 0; k < m.references; k++) {
            const machine_reference *reference = &m.reference[k];
            const int cycles = name == MACHINE_RAMP_R7 ? 10 : 1;

            if (reference->kind != MACHINE_OTHER)
                near(machine_measure(&record, reference), reference->value, 4 * h * cycles, m.name);
        }
    }
}

/* R6 breaks away in the step after the one at whose start the force reaches the bound. */
static void test_breaking_away(void **state)
{
    const double h = 1e-3, expected = 1.1948005942023416;
    rig r;

    (void)state;
    rig_open(&r, MACHINE_RAMP_R6);
    rig_start(&r);
    do {
        rig_step(&r, h);
        assert_true(r.t < 2);
    } while (r.v[0] == 0.0);
    near(r.t - h, expected, h * (1 + 1e-9), "start of the step that slips");
    assert_true(r.t - h >= expected - 1e-9);
    rig_close(&r);
}

typedef struct cycle {
    double creep, starts, ends, peak;
} cycle;

/* The second of two cycles of R7, in steps of pi / count. */
static cycle shake(int count)
{
    const double h = MACHINE_PI / count;
    cycle c = {0, 0, 0, 0};
    double before = 0;
    int k;
    rig r;

    rig_open(&r, MACHINE_RAMP_R7);
    rig_start(&r);
    for (k = 0; k < 2 * count; k++) {
        const int slid = r.v[0] != 0.0;

        if (k == count)
            before = r.q[0];
        rig_step(&r, h);
        assert_true(r.v[0] >= 0.0); /* never uphill */
        if (k < count)
            continue;
        if (!slid && r.v[0] != 0.0)
            c.starts = r.t - MACHINE_PI;
        if (slid && r.v[0] == 0.0)
            c.ends = r.t - MACHINE_PI;
        c.peak = fmax(c.peak, r.v[0]);
    }
    c.creep = r.q[0] - before;
    rig_close(&r);
    return c;
}

/* A cycle slips once, for a while, and creeps the same each time; first order in h. Events are met
 * to two steps: k is that at the step's start, and a step's velocity is that of its end. */
static void test_creep(void **state)
{
    machine m;
    int count;

    (void)state;
    machine_make(&m, MACHINE_RAMP_R7);
    for (count = 500; count <= 8000; count *= 4) {
        const double h = MACHINE_PI / count;
        const cycle c = shake(count);

        near(c.starts, machine_value(&m, "slip starts"), 2 * h, "slip starts");
        near(c.ends, machine_value(&m, "slip ends"), 2 * h, "slip ends");
        /* v' is below 2 in size, so that peaks are met to 2 h, and creep, over 1.45 of slipping,
         * to 2 h too */
        near(c.peak, machine_value(&m, "peak"), 2 * h, "peak");
        near(c.creep, machine_value(&m, "creep"), 2 * h, "creep");
    }
}

/* Just above and just below the bound: 1e-9 decides, and rest is rest at any gravity. */
static void test_threshold(void **state)
{
    const double beside[] = {-1e-9, 1e-9};
    int k, i;

    (void)state;
    for (k = 0; k < 2; k++) {
        rig r;

        rig_open(&r, MACHINE_RAMP_R1);
        r.machine.v[0] = 0;
        r.machine.data.ramp.mu = tan(r.machine.data.ramp.slope) * (1 - beside[k]);
        rig_start(&r);
        for (i = 0; i < 100; i++) {
            rig_step(&r, 1e-3);
            assert_int_equal(r.v[0] != 0.0, beside[k] > 0);
        }
        rig_close(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_formula), cmocka_unit_test(test_stop),
        cmocka_unit_test(test_motions), cmocka_unit_test(test_breaking_away),
        cmocka_unit_test(test_creep),   cmocka_unit_test(test_threshold),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
