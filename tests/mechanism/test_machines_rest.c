/* Machines at rest, and where rest ends: a wedge, tables with more legs than it takes, a block that
 * tips or slides, a peg that jams. */
#include "rig.h"

/* Pushed in it stops, to the last bit; pulled it comes out, or jams where mu > tan(slope): both
 * solve the step's problem there. */
static void push_wedge(int32_t scheme)
{
    static const double mus[] = {0, 0.1, 0.17, 0.18, 0.3, 1};
    const double slope = MACHINE_PI / 18, h = 1e-3;
    int k, pulled;

    for (k = 0; k < 6; k++)
        for (pulled = 0; pulled < 2; pulled++) {
            const int holds = mus[k] > tan(slope);
            rig r;

            rig_open(&r, MACHINE_WEDGE);
            r.settings.scheme = scheme;
            r.machine.mu[0] = r.machine.mu[1] = mus[k];
            r.machine.v[1] = pulled ? 1 : -1;
            rig_start(&r);
            rig_step(&r, h);
            if (!pulled || (holds && r.v[1] == 0.0))
                assert_true(rig_rests(&r));
            else {
                assert_true(r.impulse[0] == 0.0 && r.impulse[2] == 0.0);
                near(r.v[0], 0, 1e-15, "straight");
                near(r.v[1], 1, 1e-15, "comes out");
            }
            /* whichever it is: momentum and cones, to tol */
            near(r.v[1] - (pulled ? 1 : -1),
                 sin(slope) * (r.impulse[0] + r.impulse[2]) +
                     cos(slope) * (r.impulse[1] + r.impulse[3]),
                 1e-10, "momentum");
            assert_true(fabs(r.impulse[1]) <= mus[k] * r.impulse[0] + 1e-10 &&
                        fabs(r.impulse[3]) <= mus[k] * r.impulse[2] + 1e-10);
            rig_close(&r);
        }
}

static void test_wedge(void **state)
{
    int32_t scheme;

    (void)state;
    for (scheme = PERP_MECHANISM_FROZEN; scheme <= PERP_MECHANISM_THETA; scheme++)
        push_wedge(scheme);
}

/* Under a load of 1 it rests with at least the force on each face that sliding in would have. */
static void test_wedge_loaded(void **state)
{
    const double h = 1e-3;
    int step;
    rig r;

    (void)state;
    rig_open(&r, MACHINE_WEDGE);
    r.machine.v[1] = 0;
    r.machine.data.mass.load[1] = -1;
    rig_start(&r);
    for (step = 0; step < 100; step++) {
        rig_step(&r, h);
        assert_true(rig_rests(&r));
        assert_true((r.impulse[0] + r.impulse[2]) / (2 * h) >=
                    machine_value(&r.machine, "least normal force") * (1 - 1e-12));
    }
    assert_true(r.q[0] == 0.0 && r.q[1] == 0.0);
    rig_close(&r);
}

/* Four legs or a thousand: at rest to the last bit, with the load's wrench. Dropped at 1, too, and
 * then with the momentum in the first step. */
static void test_table(void **state)
{
    const double h = 1e-2;
    int32_t name, k;
    int dropped, step;

    (void)state;
    for (name = MACHINE_TABLE; name <= MACHINE_TABLE_MANY; name++)
        for (dropped = 0; dropped < 2; dropped++) {
            rig r;

            rig_open(&r, name);
            r.machine.v[0] = dropped ? -1 : 0;
            rig_start(&r);
            for (step = 0; step < 5; step++) {
                const double fall = dropped && step == 0 ? r.machine.data.mass.mass[0] / h : 0;
                double force = 0, x = 0, y = 0;

                rig_step(&r, h);
                assert_true(rig_rests(&r));
                for (k = 0; k < r.machine.model.contacts; k++) {
                    const double angle = 2 * MACHINE_PI * k / r.machine.model.contacts,
                                 f = r.impulse[k] / h;
                    const int few = name == MACHINE_TABLE;

                    assert_true(f >= 0);
                    force += f;
                    x += f * (few ? r.machine.data.mass.places[0][k] : cos(angle));
                    y += f * (few ? r.machine.data.mass.places[1][k] : sin(angle));
                }
                /* tol: 1e-10 of a step's largest velocity without legs, h 10 or 1, times 10 of
                   mass over h */
                near(force, machine_value(&r.machine, "force") + fall, dropped ? 1e-6 : 1e-8, "F");
                near(x, machine_value(&r.machine, "sum f x"), dropped ? 1e-6 : 1e-8, "sum f x");
                near(y, machine_value(&r.machine, "sum f y"), dropped ? 1e-6 : 1e-8, "sum f y");
            }
            rig_close(&r);
        }
}

/* On a slope: rests, slides evenly, or tips about its lower corner. */
static void test_slope(void **state)
{
    static const double slopes[] = {5, 18.4, 18.5, 30, 60},
                        mus[] = {0.05, 0.3, 0.3333, 0.3334, 1, 3};
    const double h = 1e-3, ratio = 1.0 / 3;
    int a, b;

    (void)state;
    for (a = 0; a < 5; a++)
        for (b = 0; b < 6; b++) {
            const double slope = slopes[a] * MACHINE_PI / 180, mu = mus[b];
            rig r;

            rig_open(&r, MACHINE_BLOCK_SLOPE);
            r.machine.data.body.gravity[0] = MACHINE_GRAVITY * sin(slope);
            r.machine.data.body.gravity[1] = -MACHINE_GRAVITY * cos(slope);
            r.machine.mu[0] = r.machine.mu[1] = mu;
            rig_start(&r);
            rig_step(&r, h);
            if (tan(slope) < mu && tan(slope) < ratio)
                assert_true(rig_rests(&r));
            else if (mu < ratio) {
                near(r.v[0], h * MACHINE_GRAVITY * (sin(slope) - mu * cos(slope)),
                     1e-10 * h * MACHINE_GRAVITY, "slides"); /* tol times what gravity adds */
                near(r.v[2], 0, 1e-9 * h * MACHINE_GRAVITY, "upright"); /* over an arm of 0.1 */
                assert_true(r.v[0] > 0 && r.v[1] == 0.0);
            } else {
                assert_true(r.v[2] < 0);
                assert_int_equal(r.modes[0], PERP_MECHANISM_SEPARATE);
                assert_int_not_equal(r.modes[1], PERP_MECHANISM_SEPARATE);
            }
            rig_close(&r);
        }
}

/* Pushed at a height: the same with W b / z. */
static void test_push(void **state)
{
    static const double pushes[] = {0.1, 0.199, 0.201, 0.5}, mus[] = {0.05, 0.15, 0.199, 0.201, 1};
    const double h = 1e-3;
    int a, b;

    (void)state;
    for (a = 0; a < 4; a++)
        for (b = 0; b < 5; b++) {
            rig r;

            rig_open(&r, MACHINE_BLOCK_PUSH);
            r.machine.data.body.push = pushes[a];
            r.machine.mu[0] = r.machine.mu[1] = mus[b];
            rig_start(&r);
            rig_step(&r, h);
            if (pushes[a] < fmin(mus[b], machine_value(&r.machine, "tips at")))
                assert_true(rig_rests(&r));
            else if (mus[b] < machine_value(&r.machine, "slides first below mu") &&
                     pushes[a] < 0.201) { /* while it slides, its inertia acts at mid-height */
                near(r.v[0], h * (pushes[a] - mus[b]), 1e-10 * h, "slides");
                near(r.v[2], 0, 1e-9 * h, "upright");
            } else if (mus[b] > 0.2)
                assert_true(r.v[2] < 0);
            rig_close(&r);
        }
}

/* Whether the peg, at rest and touching at any pair of points, stays there to the last bit. */
static int jams(double depth, double across, double moment)
{
    static const int32_t pairs[4][2] = {{0, 3}, {1, 2}, {0, 2}, {1, 3}};
    int k, jammed = 0;

    for (k = 0; k < 4; k++) {
        rig r;

        rig_open(&r, MACHINE_PEG);
        machine_touch_peg(&r.machine, pairs[k][0], pairs[k][1]);
        r.machine.q[1] = -depth;
        r.machine.data.peg.load[0] = across;
        r.machine.data.peg.load[1] = -1;
        r.machine.data.peg.load[2] = moment * r.machine.data.peg.radius;
        rig_start(&r);
        rig_step(&r, 1e-3);
        jammed = jammed || rig_rests(&r);
        rig_close(&r);
    }
    return jammed;
}

/* Whitney's parallelogram over a grid of loads: inside of it no pair of points holds the peg,
 * outside of it one does. */
static void test_peg_diagram(void **state)
{
    const double mu = 0.2, depth = 0.012, lambda = depth / (2 * 0.01 * mu);
    int a, b, inside = 0;

    (void)state;
    for (a = -8; a <= 8; a++)
        for (b = -15; b <= 15; b++) {
            const double across = 0.93 * a, moment = 0.97 * b + 0.01;
            const int slides =
                fabs(moment + mu * (1 + lambda) * across) < lambda && fabs(across) < 1 / mu;

            if (jams(depth, across, moment) == slides)
                fail_msg("load (%g, %g): should %s", across, moment, slides ? "slide" : "jam");
            inside += slides;
        }
    assert_true(inside > 50);
}

/* Along each edge of it, 1e-7 decides. */
static void test_peg_edges(void **state)
{
    static const double corners[4][2] = {{5, -1}, {-5, 7}, {-5, 1}, {5, -7}};
    int k, i;

    (void)state;
    for (k = 0; k < 4; k++)
        for (i = 1; i < 8; i++) {
            const double *from = corners[k], *to = corners[(k + 1) % 4], s = i / 8.0;
            const double x = from[0] + s * (to[0] - from[0]), y = from[1] + s * (to[1] - from[1]);

            assert_false(jams(0.012, x * (1 - 1e-7), y * (1 - 1e-7)));
            assert_true(jams(0.012, x * (1 + 1e-7), y * (1 + 1e-7)));
        }
}

/* With its clearance, four points and a start in the middle of the hole: the peg tilts, touches
 * where the load makes it, and slides in or comes to rest. */
static void test_peg_run(void **state)
{
    static const double loads[][3] = {{0, 0, 0}, {0, 2, 0},  {0, -2, 0}, {2, 0, 0}, {-2, 3, 0},
                                      {0, 5, 1}, {0, -5, 1}, {4, 4, 1},  {7, 0, 1}, {-4, -4, 1}};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof loads / sizeof *loads; k++) {
        rig r;

        rig_open(&r, MACHINE_PEG);
        r.machine.data.peg.load[0] = loads[k][0];
        r.machine.data.peg.load[2] = loads[k][1] * r.machine.data.peg.radius;
        rig_start(&r);
        while (r.t < 0.05)
            rig_step(&r, 1e-5);
        if (loads[k][2] != 0)
            assert_true(rig_rests(&r));
        else
            assert_true(r.v[1] < -1e-4);
        rig_close(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wedge),     cmocka_unit_test(test_wedge_loaded),
        cmocka_unit_test(test_table),     cmocka_unit_test(test_slope),
        cmocka_unit_test(test_push),      cmocka_unit_test(test_peg_diagram),
        cmocka_unit_test(test_peg_edges), cmocka_unit_test(test_peg_run),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
