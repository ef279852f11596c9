/* Steps chosen by their estimated error, beside closed forms: what stops, lands, rolls, bounces and
 * lets go within a step is where it should be, to what the estimates say. */
#include "suite.h"

#include "world/scene.h"

/* Estimates are of one step; events that it holds may lie anywhere in it, and what one step leaves
 * the next ones carry on: so far do errors go beyond their sum. */
#define TRUST 4.0

static void open_scene(scene *s, double error)
{
    perp_world_settings settings;

    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
    settings.error = error;
    settings.accuracy = PERP_ACCURACY_EXACT;
    scene_create(s, &settings);
}

/* Steps of dt up to t; returns the estimates' sum. */
static double run(scene *s, double t, double dt, int32_t *steps)
{
    double error = 0.0;
    int i, count = (int)lround(t / dt);

    *steps = 0;
    for (i = 0; i < count; i++) {
        const perp_step_result result = scene_step(s, dt);

        assert_true(result.error >= 0.0 && result.steps >= 2);
        error += result.error;
        *steps += result.steps;
    }
    return error;
}

/* A block that slides to its stop, at v0^2 / (2 mu g), in the middle of a step. */
static void test_stop(void **state)
{
    const double half[3] = {0.2, 0.2, 0.1}, mu = 0.4, v0 = 2.0;
    double tolerance;

    (void)state;
    for (tolerance = 1e-2; tolerance > 1e-11; tolerance *= 1e-3) {
        perp_body_settings settings = scene_settings();
        perp_body block;
        double error;
        int32_t steps;
        scene s;

        open_scene(&s, tolerance);
        scene_plane(&s, s.ground, 0, 0, 1, 0, mu, 0.0);
        settings.position[2] = half[2];
        settings.velocity[0] = v0;
        block = scene_add(&s, &settings);
        scene_box(&s, block, half[0], half[1], half[2], mu, 0.0);
        error = run(&s, 1.0, 0.1, &steps);
        scene_near(scene_state(&s, block).position[0], v0 * v0 / (2.0 * mu * GRAVITY),
                   TRUST * error + 1e-12, "where it stops"); /* 1e-12: rounding of 1e4 sums */
        assert_true(error <= 40.0 * tolerance && steps < 400);
        assert_true(scene_rests(&s, block));
        scene_close(&s);
    }
}

/* A ball thrown onto the floor: it lands, slides, and rolls with 5/7 of its first speed, whatever
 * mu is. */
static void test_landing_ball_rolls(void **state)
{
    const double r = 0.1, mu = 0.3, v0 = 3.0, height = 0.2, end = 1.5;
    const double fall = sqrt(2.0 * height / GRAVITY), v1 = v0 - mu * GRAVITY * fall;
    const double spin = 2.5 * mu * GRAVITY * fall; /* omega r */
    const double slide = (v1 - spin) / (3.5 * mu * GRAVITY), rolling = 5.0 / 7.0 * v0;
    const double expected = v0 * fall + v1 * slide - 0.5 * mu * GRAVITY * slide * slide +
                            rolling * (end - fall - slide);
    double tolerance;

    (void)state;
    assert_true(slide > 0.0 && fall + slide < end);
    for (tolerance = 1e-3; tolerance > 1e-10; tolerance *= 1e-3) {
        perp_body_settings settings = scene_defaults();
        perp_body ball;
        double error;
        int32_t steps;
        scene s;

        open_scene(&s, tolerance);
        scene_plane(&s, s.ground, 0, 0, 1, 0, mu, 0.0);
        settings.position[2] = r + height;
        settings.velocity[0] = v0;
        ball = scene_add(&s, &settings);
        scene_sphere(&s, ball, r, mu, 0.0);
        error = run(&s, end, 0.1, &steps);
        scene_near(scene_state(&s, ball).velocity[0], rolling, TRUST * error / 0.1 + 1e-12,
                   "speed");
        scene_near(scene_state(&s, ball).position[0], expected, 15.0 * TRUST * error + 1e-12,
                   "place");
        scene_close(&s);
    }
}

/* theta'' = (g/R) sin theta from theta_0 at rest until cos theta = 2/3 cos theta_0, then a
 * parabola; fourth order, independent of everything here. Returns x and z at `end`. */
static void leave_ball(double R, double theta, double end, double *x, double *z)
{
    const double last = 2.0 / 3.0 * cos(theta), h = 1e-5;
    double rate = 0.0, t = 0.0, v[2], left;

    while (cos(theta) > last) {
        const double k1 = GRAVITY / R * sin(theta);
        const double k2 = GRAVITY / R * sin(theta + 0.5 * h * rate);
        const double k3 = GRAVITY / R * sin(theta + 0.5 * h * (rate + 0.5 * h * k1));
        const double k4 = GRAVITY / R * sin(theta + h * (rate + 0.5 * h * k2));

        theta += h * (rate + h / 6.0 * (k1 + k2 + k3));
        rate += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        t += h;
    }
    left = end - t;
    v[0] = R * rate * cos(theta);
    v[1] = -R * rate * sin(theta);
    *x = R * sin(theta) + left * v[0];
    *z = R * cos(theta) + left * v[1] - 0.5 * GRAVITY * left * left;
}

static void test_ball_leaves_ball(void **state)
{
    const double R = 1.0, r = 0.2, start = 0.3, end = 1.2;
    double tolerance, x, z;

    (void)state;
    leave_ball(R + r, start, end, &x, &z);
    for (tolerance = 1e-4; tolerance > 1e-9; tolerance *= 1e-2) {
        perp_body_settings settings = scene_defaults();
        perp_body ball;
        double error;
        int32_t steps;
        scene s;

        open_scene(&s, tolerance);
        scene_sphere(&s, s.ground, R, 0.0, 0.0);
        settings.position[0] = (R + r) * sin(start);
        settings.position[2] = (R + r) * cos(start);
        ball = scene_add(&s, &settings);
        scene_sphere(&s, ball, r, 0.0, 0.0);
        error = run(&s, end, 0.1, &steps);
        scene_near(scene_state(&s, ball).position[0], x, 12.0 * TRUST * error, "x");
        scene_near(scene_state(&s, ball).position[2], z, 12.0 * TRUST * error, "z");
        scene_close(&s);
    }
}

/* An impact with restitution lies inside of its step as it is: no short steps for it. */
static void test_bounces(void **state)
{
    const double e = 0.8, height = 1.0, end = 1.5;
    double t = sqrt(2.0 * height / GRAVITY), v = GRAVITY * t, error, left;
    perp_body_settings settings = scene_defaults();
    perp_body ball;
    int32_t steps;
    scene s;

    (void)state;
    open_scene(&s, 1e-9);
    scene_plane(&s, s.ground, 0, 0, 1, 0, 0.0, e);
    settings.position[2] = 0.1 + height;
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, 0.1, 0.0, e);
    error = run(&s, end, 0.1, &steps);
    for (v *= e; t + 2.0 * v / GRAVITY < end; v *= e)
        t += 2.0 * v / GRAVITY;
    left = end - t;
    scene_near(scene_state(&s, ball).position[2], 0.1 + left * v - 0.5 * GRAVITY * left * left,
               15.0 * TRUST * error + 1e-9, "height");
    assert_true(steps <= 4 * 15); /* whole, halves; a few more where one holds two bounces */
    scene_close(&s);
}

static perp_step_result step(scene *s, double h)
{
    perp_step_result result = fresh_step_result();

    SCENE_OK(s, perp_world_step(s->world, &result, h));
    return result;
}

/* What is spent ends the choice, not the step. */
static void test_budget(void **state)
{
    perp_world_settings world;
    perp_body_settings settings = scene_settings();
    perp_step_result result;
    perp_body block;
    scene s;

    (void)state;
    assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
    world.error = 1e-12;
    world.max_iterations = 3;
    scene_create(&s, &world);
    scene_plane(&s, s.ground, 0, 0, 1, 0, 0.5, 0.0);
    settings.position[2] = 0.1;
    settings.velocity[0] = 1.0;
    settings.angular_velocity[2] = 1.0;
    block = scene_add(&s, &settings);
    scene_box(&s, block, 0.2, 0.2, 0.1, 0.5, 0.0);
    result = step(&s, 0.5);
    assert_int_equal(result.advanced, 1);
    assert_true(result.steps < 8);
    assert_false(result.error <= world.error); /* which it says */
    scene_close(&s);
}

/* Where no step exists, not even a short one, nothing has moved. */
static void test_no_step(void **state)
{
    perp_body_settings settings = scene_defaults();
    perp_body walls[2], ball;
    perp_body_state before, after;
    perp_step_result result;
    scene s;
    int i;

    (void)state;
    open_scene(&s, 1e-3);
    for (i = 0; i < 2; i++) { /* two walls that close on a ball between them */
        settings.kind = PERP_BODY_KINEMATIC;
        settings.position[0] = i ? 0.7 : -0.7;
        settings.velocity[0] = i ? -1.0 : 1.0;
        walls[i] = scene_add(&s, &settings);
        scene_box(&s, walls[i], 0.2, 1.0, 1.0, 0.0, 0.0);
    }
    settings = scene_defaults();
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, 0.4, 0.0, 0.0);
    before = scene_state(&s, ball);
    result = step(&s, 0.5);
    after = scene_state(&s, ball);
    assert_int_equal(result.outcome, PERP_OUTCOME_RAY);
    assert_int_equal(result.advanced, 0);
    assert_memory_equal(&before, &after, sizeof before);
    after = scene_state(&s, walls[0]);
    assert_true(after.position[0] == -0.7);
    scene_close(&s);
}

static void test_refusals(void **state)
{
    const double wrong[] = {-1.0, NAN, INFINITY};
    perp_world_settings settings;
    perp_context *context;
    perp_world *world = NULL;
    size_t i;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
        settings.error = wrong[i];
        assert_true(perp_world_create(context, &world, &settings) < 0);
        assert_non_null(strstr(perp_context_message(context), "settings.error"));
        assert_null(world);
    }
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_landing_ball_rolls),
        cmocka_unit_test(test_ball_leaves_ball),
        cmocka_unit_test(test_bounces),
        cmocka_unit_test(test_budget),
        cmocka_unit_test(test_no_step),
        cmocka_unit_test(test_refusals),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
