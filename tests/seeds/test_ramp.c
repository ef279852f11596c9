/* A brick on a slope (the standard example of Stewart & Trinkle): m = 1, theta = 10 degrees,
 * mu = 0.3, v0 = 2,
 *
 *   m v' in m g sin theta + F - mu m g cos theta Sgn v.
 *
 * Reference values are closed forms: arcs of parabolas that end when v = 0. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

#define THETA (PI / 18.0)
#define MU 0.3

static const double half[3] = {0.1, 0.1, 0.1};

typedef struct slope {
    scene scene;
    perp_body brick;
    int32_t planar;
    double down[3];
    double start[3];
} slope;

static void open_slope(slope *s, int32_t planar, double theta, double mu, double gravity,
                       double speed)
{
    perp_body_state state;
    int i;

    scene_open(&s->scene, planar, 0.0, planar ? -gravity : 0.0, planar ? 0.0 : -gravity);
    s->brick = scene_box_on_slope(&s->scene, planar, theta, 1.0, half, mu, speed);
    s->planar = planar;
    s->down[0] = cos(theta);
    s->down[1] = planar ? -sin(theta) : 0.0;
    s->down[2] = planar ? 0.0 : -sin(theta);
    state = scene_state(&s->scene, s->brick);
    for (i = 0; i < 3; i++)
        s->start[i] = state.position[i];
}

static double speed_of(slope *s)
{
    perp_body_state state = scene_state(&s->scene, s->brick);

    return scene_dot(state.velocity, s->down);
}

static double path_of(slope *s)
{
    perp_body_state state = scene_state(&s->scene, s->brick);
    double moved[3];
    int i;

    for (i = 0; i < 3; i++)
        moved[i] = state.position[i] - s->start[i];
    return scene_dot(moved, s->down);
}

static void push(slope *s, double force)
{
    scene_push(&s->scene, s->brick, force * s->down[0], force * s->down[1], force * s->down[2]);
}

/* R1. The implicit step is v+ = max(0, v - h a), so the step of the stop is known; from there on
 * the velocity is 0.0, to the last bit. Positions move with the mean of both velocities, h v0 / 2
 * more in all than the sum of h v+, x_implicit. */
static void stops_where_exact_arithmetic_does(int32_t planar, double h, double x_implicit,
                                              int first_zero, int steps)
{
    slope s;
    int k;

    open_slope(&s, planar, THETA, MU, GRAVITY, 2.0);
    for (k = 1; k <= steps; k++) {
        scene_step(&s.scene, h);
        if (scene_rests(&s.scene, s.brick) != (k >= first_zero))
            fail_msg("step %d of h = %g: speed %g", k, h, speed_of(&s));
    }
    /* each of k steps rounds x and v by a few units of 1: 4 k eps */
    scene_near(path_of(&s), x_implicit + 0.5 * h * 2.0, 4.0 * first_zero * EPSILON * 2.0, "x_stop");
    scene_close(&s.scene);
}

static void test_stops_in_the_plane(void **state)
{
    (void)state;
    stops_where_exact_arithmetic_does(1, 0.1, 1.5750711918848154, 17, 200);
    stops_where_exact_arithmetic_does(1, 0.01, 1.6639337264529552, 168, 2000);
    stops_where_exact_arithmetic_does(1, 0.001, 1.6729195331378669, 1674, 4000);
}

static void test_stops_in_space(void **state)
{
    (void)state;
    stops_where_exact_arithmetic_does(0, 0.1, 1.5750711918848154, 17, 200);
    stops_where_exact_arithmetic_does(0, 0.01, 1.6639337264529552, 168, 1000);
    stops_where_exact_arithmetic_does(0, 0.001, 1.6729195331378669, 1674, 2500);
}

/* Runs with a constant force until the brick rests; returns the time of the first zero velocity. */
static double run_to_rest(slope *s, double force, double h, int most)
{
    int k;

    push(s, force);
    for (k = 1; k <= most; k++) {
        scene_step(&s->scene, h);
        if (scene_rests(&s->scene, s->brick))
            return k * h;
    }
    fail_msg("still moving at %g", speed_of(s));
    return 0.0;
}

/* R2 and R4. With deceleration a the step stops at ceil(v0 / (h a)), and x_h - x = O(h) is at most
 * the area between the line v(t) and its steps, h v0 / 2. */
static void test_time_and_length_of_stops(void **state)
{
    const double h = 1e-3;
    slope s;

    (void)state;
    open_slope(&s, 1, THETA, MU, GRAVITY, 2.0);
    scene_near(run_to_rest(&s, 1.0, h, 12000), 10.266909134386814, h, "R2 time");
    scene_near(path_of(&s), 10.266909134386814, h, "R2 path");
    scene_close(&s.scene);

    open_slope(&s, 1, THETA, MU, GRAVITY, -2.0);
    scene_near(run_to_rest(&s, 0.0, h, 1000), 0.43461463580520036, h, "R4 time");
    scene_near(path_of(&s), -0.43461463580520036, h, "R4 path");
    scene_step(&s.scene, h); /* and sticks: the slope alone does not move it */
    assert_true(scene_rests(&s.scene, s.brick));
    scene_close(&s.scene);
}

/* R3: constant acceleration, which implicit Euler has exactly; rounding of 1000 steps.
 * R5: friction reverses within one step, in which the acceleration is off by at most 2 mu g cos. */
static void test_never_stops_or_reverses(void **state)
{
    const double h = 1e-3;
    slope s;

    (void)state;
    open_slope(&s, 1, THETA, MU, GRAVITY, 2.0);
    push(&s, 3.0);
    scene_steps(&s.scene, 1000, h);
    scene_near(speed_of(&s), 3.8051994057976584, 1000.0 * 4.0 * EPSILON * 4.0, "R3 v(1)");
    scene_close(&s.scene);

    open_slope(&s, 1, THETA, 0.1, GRAVITY, -2.0);
    scene_steps(&s.scene, 1000, h);
    scene_near(speed_of(&s), 0.18495263629681481, h * 2.0 * 0.1 * GRAVITY, "R5 v(1)");
    scene_close(&s.scene);
}

/* R6, F = t from rest. F is taken at the end of each step, so the sum for v exceeds the integral by
 * at most h/2 (F(3) - F(breakaway)) and one step of breakaway; x besides by h v / 2. */
static void test_ramped_force_breaks_away(void **state)
{
    const double h = 1e-3, away = 1.1948005942023416;
    slope s;
    int k;

    (void)state;
    open_slope(&s, 1, THETA, MU, GRAVITY, 0.0);
    for (k = 1; k <= 3000; k++) {
        push(&s, k * h);
        scene_step(&s.scene, h);
        if (scene_rests(&s.scene, s.brick) != (k * h <= away))
            fail_msg("F = %g: speed %g", k * h, speed_of(&s));
    }
    scene_near(speed_of(&s), 1.6293724473461095, 0.5 * h * (3.0 - away) + h * h, "R6 v(3)");
    scene_near(path_of(&s), 0.98044739125742443, 0.5 * h * (3.0 - away) * (3.0 - away) + h * 1.63,
               "R6 x(3)");
    scene_close(&s.scene);
}

/* R7, F = 2 sin 2t: creeps in every cycle of pi. Returns the path after ten cycles of n steps. */
static double creep(int n, int watch)
{
    const double h = PI / n;
    double peak = 0.0;
    int was_at_rest = 1;
    slope s;
    int k;

    open_slope(&s, 1, THETA, MU, GRAVITY, 0.0);
    for (k = 1; k <= 10 * n; k++) {
        double phase = (k - 1) % n * h;
        int rests;

        push(&s, 2.0 * sin(2.0 * k * h));
        scene_step(&s.scene, h);
        rests = scene_rests(&s.scene, s.brick);
        if (watch && was_at_rest && !rests) /* within the step before, whose force is its end's */
            scene_near(phase + h, 0.3201277124458444, h, "R7 slip starts");
        if (watch && !was_at_rest && rests)
            scene_near(phase + h, 1.7655745784222461, 2.0 * h, "R7 slip ends");
        was_at_rest = rests;
        peak = fmax(peak, speed_of(&s));
    }
    if (watch) /* h/2 times the change of force while v grows, and the first step */
        scene_near(peak, 0.49207556375628177, 2.0 * h, "R7 peak velocity");
    peak = path_of(&s);
    scene_close(&s.scene);
    return peak;
}

/* The step's closed form (its problem is a soft threshold): v+ = sgn(v_f) max(0, |v_f| - h mu g
 * cos theta). */
static double creep_by_threshold(int n)
{
    const double h = PI / n, cap = h * MU * GRAVITY * cos(THETA);
    double v = 0.0, x = 0.0;
    int k;

    for (k = 1; k <= 10 * n; k++) {
        v += h * (GRAVITY * sin(THETA) + 2.0 * sin(2.0 * k * h));
        v = copysign(fmax(0.0, fabs(v) - cap), v);
        x += h * v;
    }
    return x;
}

static void test_creep_under_a_swinging_force(void **state)
{
    const int n = 1000;
    double path = creep(n, 1);

    (void)state;
    /* 10 n steps round numbers below 4 a few times each */
    scene_near(path, creep_by_threshold(n), 10.0 * n * 8.0 * EPSILON, "R7 path by the threshold");
    /* a cycle's slip lasts 1.45 with v <= 0.5: h (0.5 + 1.45 * 2) a cycle at most */
    scene_near(path, 3.9959713267556855, 10.0 * (PI / n) * 3.4, "R7 path after ten cycles");
}

/* Rest is rest at any scale of gravity; it is decided by ratios. */
static void test_rests_in_tiny_gravity(void **state)
{
    static const double gravities[] = {1e-12, 1e-100, 1e12};
    size_t i;
    int k;

    (void)state;
    for (i = 0; i < sizeof gravities / sizeof *gravities; i++) {
        slope s;

        open_slope(&s, 0, THETA, MU, gravities[i], 0.0);
        for (k = 0; k < 20; k++) {
            scene_step(&s.scene, 0.01);
            assert_true(scene_rests(&s.scene, s.brick));
        }
        assert_true(path_of(&s) == 0.0);
        scene_close(&s.scene);
    }
}

/* tan theta = mu (1 +- 1e-9): above it v = n h g (sin theta - mu cos theta), 1e-9 of what gravity
 * alone would give; below it rests. theta itself has a rounding error of 1e-16. */
static void at_the_threshold(int32_t planar, double gravity)
{
    const double h = 0.01, offset = 1e-9;
    double theta = atan(MU * (1.0 + offset));
    double expected = 10.0 * h * gravity * (sin(theta) - MU * cos(theta));
    slope s;
    int k;

    open_slope(&s, planar, theta, MU, gravity, 0.0);
    for (k = 0; k < 10; k++) {
        scene_step(&s.scene, h);
        assert_false(scene_rests(&s.scene, s.brick));
    }
    /* the difference of two terms cancels 9 digits: rounding of g h over 10 steps is 1e-6 of it */
    scene_near(speed_of(&s) / expected, 1.0, 1e-5, "speed above the threshold");
    scene_close(&s.scene);

    open_slope(&s, planar, atan(MU * (1.0 - offset)), MU, gravity, 0.0);
    for (k = 0; k < 10; k++) {
        scene_step(&s.scene, h);
        assert_true(scene_rests(&s.scene, s.brick));
    }
    scene_close(&s.scene);
}

static void test_threshold_of_sliding(void **state)
{
    (void)state;
    at_the_threshold(1, GRAVITY);
    at_the_threshold(0, GRAVITY);
    at_the_threshold(0, 1e-12);
}

/* The force at rest lies inside the cone: the slope carries m g, R1's friction -1.7034886229125867
 * along it. */
static void test_static_force(void **state)
{
    const double h = 0.01;
    double along = 0.0, across = 0.0;
    slope s;
    int32_t i;

    (void)state;
    open_slope(&s, 0, THETA, MU, GRAVITY, 0.0);
    scene_step(&s.scene, h);
    for (i = 0; i < perp_world_contact_count(s.scene.world); i++) {
        perp_world_contact contact = scene_contact(&s.scene, i);

        double sign = contact.body_b == s.brick ? 1.0 : -1.0;

        assert_int_equal(contact.mode, PERP_CONTACT_STICK);
        assert_true(contact.velocity[0] == 0.0 && contact.velocity[1] == 0.0 &&
                    contact.velocity[2] == 0.0);
        along += sign * (contact.impulse[1] * scene_dot(contact.tangent_1, s.down) +
                         contact.impulse[2] * scene_dot(contact.tangent_2, s.down));
        across += contact.impulse[0];
    }
    scene_near(along / h, -1.7034886229125867, 1e-12, "friction force");
    scene_near(across / h, GRAVITY * cos(THETA), 1e-12, "normal force");
    scene_close(&s.scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stops_in_the_plane),
        cmocka_unit_test(test_stops_in_space),
        cmocka_unit_test(test_time_and_length_of_stops),
        cmocka_unit_test(test_never_stops_or_reverses),
        cmocka_unit_test(test_ramped_force_breaks_away),
        cmocka_unit_test(test_creep_under_a_swinging_force),
        cmocka_unit_test(test_rests_in_tiny_gravity),
        cmocka_unit_test(test_threshold_of_sliding),
        cmocka_unit_test(test_static_force),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
