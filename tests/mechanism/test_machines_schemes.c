/* Each scheme on machines whose motion is known: the error at the end falls as its order says. */
#include "rig.h"

/* error <= constant * h^order over all steps of three halvings; where the motion is smooth, or
 * bends only where friction stops or starts it, the observed order is the expected one, too. The
 * constants are bounds of a motion's second (order 1) or third derivatives times its duration, not
 * sharp: what counts is that one holds for all steps. */
typedef struct expectation {
    int32_t name, scheme, order, smooth, steps;
    double constant;
} expectation;

static double error_of(const machine *m, const machine_record *record)
{
    double worst = 0;
    int32_t k;

    for (k = 0; k < m->references; k++) {
        const machine_reference *reference = &m->reference[k];

        if (reference->kind == MACHINE_COORDINATE || reference->kind == MACHINE_VELOCITY)
            worst = fmax(worst, fabs(machine_measure(record, reference) - reference->value));
    }
    return worst;
}

static void check(const expectation *e)
{
    perp_mechanism_settings settings = fresh_mechanism_settings();
    double errors[4];
    machine m;
    int k;

    machine_make(&m, e->name);
    settings.scheme = e->scheme;
    for (k = 0; k < 4; k++) {
        const double h = m.end / (e->steps << k), bound = e->constant * pow(h, e->order);
        machine_record record;

        rig_run(&record, e->name, &settings, h);
        errors[k] = error_of(&m, &record);
        if (!(errors[k] <= bound + 1e-11))
            fail_msg("%s, %s, h = %g: error %g, expected %g at most", m.name,
                     perp_mechanism_scheme_text(e->scheme), h, errors[k], bound);
        assert_int_equal(record.result.fallbacks, 0);
    }
    if (e->smooth) {
        const double order = log2(errors[0] / errors[3]) / 3;

        if (fabs(order - e->order) > 0.2)
            fail_msg("%s, %s: order %g, expected %d", m.name, perp_mechanism_scheme_text(e->scheme),
                     order, e->order);
    }
}

static void test_first_order(void **state)
{
    static const expectation rows[] = {
        {MACHINE_RAMP_R1, 0, 1, 1, 100, 1.5}, {MACHINE_RAMP_R3, 0, 1, 1, 100, 1.5},
        {MACHINE_RAMP_R5, 0, 1, 1, 100, 3},   {MACHINE_RAMP_R6, 0, 1, 1, 100, 2},
        {MACHINE_RAMP_R7, 0, 1, 0, 1000, 1},  {MACHINE_PLANE, 0, 1, 1, 100, 3},
        {MACHINE_FLOOR, 0, 1, 1, 100, 3},     {MACHINE_ROLL_BALL, 0, 1, 1, 100, 8},
        {MACHINE_ROLL_BACK, 0, 1, 1, 100, 8}, {MACHINE_BELT, 0, 1, 0, 200, 2},
        {MACHINE_FINGER, 0, 1, 1, 100, 2},    {MACHINE_BALL, 0, 1, 0, 200, 60},
        {MACHINE_BLOCK, 0, 1, 0, 100, 12},    {MACHINE_ROD_FALL, 0, 1, 0, 400, 3},
        {MACHINE_PENDULUM, 0, 1, 1, 100, 20}, {MACHINE_SPIN, 0, 1, 1, 1000, 10},
    };
    expectation other;
    size_t k;

    (void)state;
    for (k = 0; k < sizeof rows / sizeof *rows; k++) {
        other = rows[k];
        check(&other);
        other.scheme = PERP_MECHANISM_IMPLICIT;
        other.constant *= 2; /* damps where frozen drives, with constants of the same size */
        check(&other);
    }
}

/* The theta scheme has order 2 where the motion is smooth, where friction stops it or lets it roll
 * (an event is met to a step, but leads to where it would have led anyway), or lets it go (forces
 * are continuous there). A constant force is met exactly. */
static void test_second_order(void **state)
{
    static const expectation rows[] = {
        {MACHINE_RAMP_R1, 2, 2, 0, 100, 0.5}, {MACHINE_RAMP_R2, 2, 2, 0, 100, 0.5},
        {MACHINE_RAMP_R3, 2, 2, 0, 100, 0},   {MACHINE_RAMP_R4, 2, 2, 0, 100, 1},
        {MACHINE_RAMP_R6, 2, 2, 0, 100, 1},   {MACHINE_RAMP_R7, 2, 2, 0, 1000, 20},
        {MACHINE_PLANE, 2, 2, 0, 100, 2},     {MACHINE_FLOOR, 2, 2, 0, 100, 2},
        {MACHINE_ROLL_BALL, 2, 2, 0, 100, 2}, {MACHINE_ROLL_HOOP, 2, 2, 0, 100, 2},
        {MACHINE_ROLL_BACK, 2, 2, 0, 100, 2}, {MACHINE_ROLL_SLOPE, 2, 2, 0, 100, 0},
        {MACHINE_FINGER, 2, 2, 0, 100, 1},    {MACHINE_PENDULUM, 2, 2, 1, 100, 40},
        {MACHINE_SPIN, 2, 2, 1, 100, 2},
    };
    size_t k;

    (void)state;
    for (k = 0; k < sizeof rows / sizeof *rows; k++)
        check(&rows[k]);
}

/* It has order 1 where an event leaves its lateness behind: impacts, a turn against friction (what
 * is left of its step is lost), a friction that jumps, a jam (whose step still moves by h v / 2).
 */
static void test_theta_with_events(void **state)
{
    static const expectation rows[] = {
        {MACHINE_RAMP_R5, 2, 1, 0, 100, 1.5}, {MACHINE_BELT, 2, 1, 0, 200, 2},
        {MACHINE_BALL, 2, 1, 0, 200, 30},     {MACHINE_BLOCK, 2, 1, 0, 100, 12},
        {MACHINE_ROD_FALL, 2, 1, 0, 400, 3},  {MACHINE_FINGER_JAM, 2, 1, 1, 100, 0.51},
    };
    size_t k;

    (void)state;
    for (k = 0; k < sizeof rows / sizeof *rows; k++)
        check(&rows[k]);
}

/* The impact without collision is the limit of the other schemes' steps, too, to first order: what
 * is left of one step is gravity and the turning of the rows within it. */
static void stop_tip(int32_t scheme)
{
    double h;

    for (h = 1e-3; h > 1e-7; h /= 10) {
        rig r;

        rig_open(&r, MACHINE_ROD);
        r.settings.scheme = scheme;
        rig_start(&r);
        rig_step(&r, h);
        near(r.v[0], machine_value(&r.machine, "vx"), 10 * h, "vx");
        near(r.v[1], machine_value(&r.machine, "vy"), 10 * h, "vy");
        near(r.v[2], machine_value(&r.machine, "spin"), 10 * h, "spin");
        assert_int_equal(r.modes[0], PERP_MECHANISM_STICK);
        assert_int_equal(r.step.scheme, scheme);
        rig_close(&r);
    }
}

static void test_without_collision(void **state)
{
    (void)state;
    stop_tip(PERP_MECHANISM_IMPLICIT);
    stop_tip(PERP_MECHANISM_THETA);
}

/* Rest is rest in every scheme: the rod lies, the ball too, to the last bit. */
static void test_rest(void **state)
{
    static const int32_t names[] = {MACHINE_ROD_FALL, MACHINE_RAMP_R1, MACHINE_FLOOR,
                                    MACHINE_FINGER, MACHINE_FINGER_JAM};
    size_t k;
    int32_t scheme, i;

    (void)state;
    for (k = 0; k < sizeof names / sizeof *names; k++)
        for (scheme = 0; scheme <= PERP_MECHANISM_THETA; scheme++) {
            perp_mechanism_settings settings = fresh_mechanism_settings();
            machine_record record;
            machine m;

            machine_make(&m, names[k]);
            settings.scheme = scheme;
            rig_run(&record, names[k], &settings, 1e-3);
            for (i = 0; i < m.model.velocities; i++)
                assert_true(record.v[i] == 0.0 && record.stop[i] < 0.95 * m.end);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_first_order),
        cmocka_unit_test(test_second_order),
        cmocka_unit_test(test_theta_with_events),
        cmocka_unit_test(test_without_collision),
        cmocka_unit_test(test_rest),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
