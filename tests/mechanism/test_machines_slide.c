/* Sliding: on a plane (dry friction of a disc, and a contact in three dimensions), on a belt, a
 * pushed finger, and bodies that slide until they roll. */
#include "rig.h"

/* Steps of constant deceleration a from v: v+ = max(0, v - h a). The step of the stop, and where:
 * places move with v+, those of the theta scheme with the mean of v and v+. */
static int stop_of(double *distance, int32_t scheme, double v, double a, double h)
{
    int n = (int)floor(v / (h * a));

    *distance = h * (n * v - a * h * n * (n + 1) / 2);
    if (scheme == PERP_MECHANISM_THETA)
        *distance += h * v / 2;
    return n + 1;
}

/* Straight, however the heading lies to the axes, and at rest to the last bit. */
static void slide_on_plane(int32_t scheme)
{
    static const double headings[] = {0, 10, 53.13, 90, 200, 315};
    const double h = 1e-3;
    int32_t name;
    size_t k;

    for (name = MACHINE_PLANE; name <= MACHINE_FLOOR; name++)
        for (k = 0; k < sizeof headings / sizeof *headings; k++) {
            const double angle = headings[k] * MACHINE_PI / 180;
            double length;
            const int stop = stop_of(&length, scheme, 3, 0.5 * MACHINE_GRAVITY, h);
            int step;
            rig r;

            rig_open(&r, name);
            r.settings.scheme = scheme;
            r.machine.v[0] = 3 * cos(angle);
            r.machine.v[1] = 3 * sin(angle);
            rig_start(&r);
            for (step = 1; step <= stop + 100; step++) {
                rig_step(&r, h);
                assert_int_equal(rig_rests(&r), step >= stop);
                assert_int_equal(r.modes[0],
                                 step < stop ? PERP_MECHANISM_SLIP : PERP_MECHANISM_STICK);
            }
            /* a few roundings of the velocity a step, over 0.6 of time; the direction loses more
               where little velocity is left: relative to v, roundings of 3 */
            near(r.q[0], length * cos(angle), 1e-12, "x");
            near(r.q[1], length * sin(angle), 1e-12, "y");
            if (name == MACHINE_FLOOR)
                assert_true(r.q[2] == 0.0);
            rig_close(&r);
        }
}

static void test_plane(void **state)
{
    (void)state;
    slide_on_plane(PERP_MECHANISM_FROZEN);
    slide_on_plane(PERP_MECHANISM_IMPLICIT);
    slide_on_plane(PERP_MECHANISM_THETA);
}

/* A polyhedron of 8 edges instead of the cone, at 10 degrees from one: too far, and off the
 * straight, by as much as theory says, to first order in h. */
static void test_plane_polyhedral(void **state)
{
    const double h = 1e-3, angle = MACHINE_PI / 18;
    double stop = 0;
    rig r;

    (void)state;
    rig_open(&r, MACHINE_FLOOR);
    r.settings.cone = 8;
    r.machine.v[0] = 3 * cos(angle);
    r.machine.v[1] = 3 * sin(angle);
    rig_start(&r);
    while (r.t < 0.8) {
        rig_step(&r, h);
        if (!rig_rests(&r))
            stop = r.t;
    }
    /* x loses h v / 2 over a stop; the step's end comes up to h after the stop */
    near(stop, 0.64632121301726202, h, "stop");
    near(hypot(r.q[0], r.q[1]), 0.95314084450215552, 1.5 * h, "distance");
    near(atan2(r.q[1], r.q[0]) - angle, 0.1000633162131944, 2 * h, "heading");
    rig_close(&r);
}

/* At the middle of a sector, the worst heading, distance and time are 1 / cos(pi / n) times those
 * of the cone. */
static void test_plane_worst(void **state)
{
    static const int32_t edges[] = {4, 8, 16, 32};
    const double h = 1e-3, longest = 9 / MACHINE_GRAVITY;
    int k;

    (void)state;
    for (k = 0; k < 4; k++) {
        const double angle = MACHINE_PI / edges[k], ratio = 1 / cos(angle);
        double stop = 0;
        rig r;

        rig_open(&r, MACHINE_FLOOR);
        r.settings.cone = edges[k];
        r.machine.v[0] = 3 * cos(angle);
        r.machine.v[1] = 3 * sin(angle);
        rig_start(&r);
        while (r.t < 1) {
            rig_step(&r, h);
            if (!rig_rests(&r))
                stop = r.t;
        }
        near(stop, 6 / MACHINE_GRAVITY * ratio, h, "stop");
        /* implicit Euler's place is short of the stop by h v / 2 */
        near(hypot(r.q[0], r.q[1]), longest * ratio - 1.5 * h, 0.2 * h, "distance");
        near(atan2(r.q[1], r.q[0]), angle, 1e-6, "straight"); /* edges tie: rounding decides */
        rig_close(&r);
    }
}

/* Sliding keeps the moment about the floor, so that the speed of rolling is right at any h; from
 * there on the point of contact rests to the last bit. */
static void roll(int32_t scheme)
{
    int32_t name, k;

    for (name = MACHINE_ROLL_BALL; name <= MACHINE_ROLL_BACK; name++)
        for (k = 0; k < 2; k++) {
            const double h = 0.01 / (1 << 2 * k);
            double when, where = 0, rolls_from = -1;
            rig r;

            rig_open(&r, name);
            r.settings.scheme = scheme;
            rig_start(&r);
            when = machine_value(&r.machine, "rolls from");
            while (r.t < r.machine.end - 1e-9) {
                rig_step(&r, h);
                if (rolls_from < 0 && r.modes[0] == PERP_MECHANISM_STICK) {
                    rolls_from = r.t;
                    where = r.q[0];
                }
                assert_int_equal(r.modes[0] == PERP_MECHANISM_STICK, rolls_from >= 0);
                if (rolls_from >= 0)
                    assert_true(r.velocity[1] == 0.0);
                assert_true(r.v[1] == 0.0);
            }
            near(rolls_from, when, h * (1 + 1e-9), "rolls from");
            near(where, machine_value(&r.machine, "rolls at"), 8 * h, "rolls at");
            /* a rounding of 200 (the spin times its radius' inverse) a step, up to 2000 steps */
            near(r.v[0], machine_value(&r.machine, "v"), 1e-11, r.machine.name);
            rig_close(&r);
        }
}

static void test_roll(void **state)
{
    (void)state;
    roll(PERP_MECHANISM_FROZEN);
    roll(PERP_MECHANISM_IMPLICIT);
    roll(PERP_MECHANISM_THETA);
}

/* Down a slope it rolls from rest where mu is large enough, else it slides and turns. */
static void test_roll_slope(void **state)
{
    static const double factors[] = {0.5, 0.99, 1.01, 3};
    const double h = 1e-3, slope = MACHINE_PI / 6, kappa = 2.0 / 5;
    int k, i;

    (void)state;
    for (k = 0; k < 4; k++) {
        double mu, expected;
        rig r;

        rig_open(&r, MACHINE_ROLL_SLOPE);
        mu = factors[k] * machine_value(&r.machine, "rolls from mu");
        r.machine.mu[0] = mu;
        expected = factors[k] > 1 ? MACHINE_GRAVITY * sin(slope) / (1 + kappa)
                                  : MACHINE_GRAVITY * (sin(slope) - mu * cos(slope));
        rig_start(&r);
        for (i = 0; i < 1000; i++) {
            rig_step(&r, h);
            assert_int_equal(r.modes[0],
                             factors[k] > 1 ? PERP_MECHANISM_STICK : PERP_MECHANISM_SLIP);
        }
        near(r.v[0], expected, 1e-11, "speed after 1"); /* roundings alone: constant forces */
        rig_close(&r);
    }
}

typedef struct belt {
    double stick, slip, largest, smallest;
} belt;

/* The second cycle; events at the ends of the steps that show them. */
static belt run_belt(double h)
{
    belt b = {0, 0, 0, 1};
    double since = 0;
    int changes = 0;
    rig r;

    rig_open(&r, MACHINE_BELT);
    rig_start(&r);
    while (changes < 5) {
        const int32_t before = changes == 0 ? PERP_MECHANISM_STICK : r.modes[0];

        rig_step(&r, h);
        assert_true(r.t < 4);
        if (r.modes[0] == PERP_MECHANISM_STICK) /* the belt's velocity, to the last bit */
            assert_true(r.v[0] == 0.2 && r.velocity[1] == 0.0);
        b.largest = fmax(b.largest, r.q[0]);
        b.smallest = fmin(b.smallest, r.q[0]);
        if (r.modes[0] == before)
            continue;
        changes++;
        if (r.modes[0] == PERP_MECHANISM_SLIP)
            b.stick = r.t - since;
        else
            b.slip = r.t - since;
        since = r.t;
    }
    rig_close(&r);
    return b;
}

/* Sticks and slips at the period that mu_static > mu makes. A step's phase is off by h / 2 or so,
 * and an event by a step: 3 h and, of places that are passed at up to 0.28, one h of that. */
static void test_belt(void **state)
{
    machine m;
    double h;

    (void)state;
    machine_make(&m, MACHINE_BELT);
    for (h = 2e-3; h > 1e-4; h /= 4) {
        const belt b = run_belt(h);

        near(b.stick, machine_value(&m, "stick"), 3 * h, "stick");
        near(b.slip, machine_value(&m, "slip"), 3 * h, "slip");
        near(b.stick + b.slip, machine_value(&m, "period"), 3 * h, "period");
        near(b.largest, machine_value(&m, "largest x"), h, "largest x");
        near(b.smallest, machine_value(&m, "smallest x"), h, "smallest x");
    }
}

/* With one coefficient there is no such cycle: it comes to rest on the moving belt, where the
 * spring holds it against sliding friction. */
static void test_belt_of_one_coefficient(void **state)
{
    rig r;

    (void)state;
    rig_open(&r, MACHINE_BELT);
    r.machine.model.mu_static = NULL;
    r.machine.q[0] = 0.03;
    r.machine.v[0] = 0;
    rig_start(&r);
    while (r.t < 1) {
        rig_step(&r, 1e-3);
        assert_int_equal(r.modes[0], PERP_MECHANISM_SLIP);
        near(r.q[0], 0.03, 1e-14, "balance"); /* roundings of 3 over 100 */
    }
    rig_close(&r);
}

/* The finger slides to a stop, with the normal force of the theory in each step. */
static void push_finger(int32_t scheme)
{
    const double h = 1e-3;
    double length, normal, a;
    int stop, step;
    rig r;

    rig_open(&r, MACHINE_FINGER);
    r.settings.scheme = scheme;
    rig_start(&r);
    normal = machine_value(&r.machine, "normal force");
    a = 0.5 * normal - 1;
    stop = stop_of(&length, scheme, 1, a, h);
    for (step = 1; step <= stop + 200; step++) {
        rig_step(&r, h);
        assert_int_equal(rig_rests(&r), step >= stop);
        if (step < stop)
            near(r.impulse[0] / h, normal, 1e-11, "normal force"); /* roundings over h */
        if (step > stop)
            near(r.impulse[1] / h, -1, 1e-11, "friction at rest");
    }
    near(r.q[0], length, 1e-12, "place of the stop");
    rig_close(&r);
}

static void test_finger(void **state)
{
    (void)state;
    push_finger(PERP_MECHANISM_FROZEN);
    push_finger(PERP_MECHANISM_IMPLICIT);
    push_finger(PERP_MECHANISM_THETA);
}

/* mu = 0.5 jams where cot(angle) < 0.5, however fast it comes and however short the step, as long
 * as what presses the tip in within a step, h l cos(angle) torque / I, counts beside tol = 1e-10
 * times the speed: with less, sliding on is an answer to within tol. */
static void test_finger_jams(void **state)
{
    static const double angles[] = {20, 45, 63, 64, 70, 85};
    static const double speeds[] = {1e-3, 0.1, 10};
    size_t k, i;
    double h;

    (void)state;
    for (k = 0; k < sizeof angles / sizeof *angles; k++)
        for (i = 0; i < 3; i++)
            for (h = 1e-2; h > 1e-7; h /= 100) {
                const double angle = angles[k] * MACHINE_PI / 180;
                const int jams = 0.5 * tan(angle) > 1;
                machine_finger *finger;
                rig r;

                rig_open(&r, MACHINE_FINGER);
                finger = &r.machine.data.finger;
                r.machine.q[1] = angle;
                r.machine.v[0] = speeds[i];
                finger->height = finger->length * sin(angle);
                finger->torque = finger->force = 1e-3; /* else they stop the slow one, too */
                rig_start(&r);
                rig_step(&r, h);
                if (speeds[i] > 2 * h)
                    assert_int_equal(rig_rests(&r), jams);
                if (jams && speeds[i] / h > 1e7) /* forces: below 1e-7 of the impact */
                    near(-r.impulse[1] / r.impulse[0], 1 / tan(angle), 1e-6, "ratio of impulses");
                rig_step(&r, h);
                if (jams)
                    assert_true(rig_rests(&r));
                rig_close(&r);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plane),
        cmocka_unit_test(test_plane_polyhedral),
        cmocka_unit_test(test_plane_worst),
        cmocka_unit_test(test_roll),
        cmocka_unit_test(test_roll_slope),
        cmocka_unit_test(test_belt),
        cmocka_unit_test(test_belt_of_one_coefficient),
        cmocka_unit_test(test_finger),
        cmocka_unit_test(test_finger_jams),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
