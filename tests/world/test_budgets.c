/* time_limit and max_iterations hold for a whole step, and what they leave is usable: nothing falls
 * through what carries it. No test looks at a clock: limits that are over before they begin do. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

enum { COLUMNS = 8, ROWS = 5, BOXES = COLUMNS * ROWS };

static const double half[3] = {0.5, 0.25, 0.25}, h = 0.01;

/* A wall of bricks, each row half a brick along, `gap` above the one below. */
static void build_wall(scene *s, const perp_world_settings *settings, perp_body *boxes, double gap)
{
    const int up = settings->planar ? 1 : 2;
    int i;

    scene_create(s, settings);
    scene_plane(s, s->ground, 0.0, settings->planar, !settings->planar, 0.0, 0.5, 0.0);
    for (i = 0; i < BOXES; i++) {
        const int row = i / COLUMNS;
        perp_body_settings box = scene_settings();

        box.inertia[0] = (half[1] * half[1] + half[2] * half[2]) / 3.0;
        box.inertia[4] = box.inertia[8] = (half[0] * half[0] + half[1] * half[1]) / 3.0;
        box.position[0] = i % COLUMNS + 0.5 * (row % 2);
        box.position[up] = half[up] * (2 * row + 1) + gap * (row + 1);
        boxes[i] = scene_add(s, &box);
        scene_box(s, boxes[i], half[0], half[1], half[2], 0.5, 0.0);
    }
}

static perp_world_settings settings_for(int32_t planar)
{
    perp_world_settings settings;

    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, planar), PERP_OK);
    settings.accuracy = PERP_ACCURACY_EXACT;
    return settings;
}

static double lowest(scene *s, int32_t planar, const perp_body *boxes)
{
    double low = INFINITY;
    int i;

    for (i = 0; i < BOXES; i++)
        low = fmin(low, scene_state(s, boxes[i]).position[planar ? 1 : 2]);
    return low;
}

/* Kinetic energy stays below what falling from the start could give. */
static void require_tame(scene *s, double height)
{
    double kinetic;

    SCENE_OK(s, perp_world_energy(s->world, &kinetic, NULL));
    assert_true(kinetic <= BOXES * GRAVITY * height);
}

/* A limit that is over at once: the least number of sweeps a step keep the wall above the floor, to
 * a hundredth of a box, at rest as after a fall. Without them it falls freely, 0.44 m in 30 steps.
 */
static void stands(int32_t planar, double gap)
{
    perp_world_settings settings = settings_for(planar);
    perp_body boxes[BOXES];
    scene s;
    int step;

    settings.time_limit = 1e-9;
    build_wall(&s, &settings, boxes, gap);
    for (step = 0; step < 60; step++) {
        perp_step_result result = fresh_step_result();

        SCENE_OK(&s, perp_world_step(s.world, &result, h));
        assert_int_equal(result.advanced, 1);
        if (result.islands > 0 && result.outcome != PERP_OUTCOME_TIME_LIMIT)
            assert_true(result.outcome == PERP_OUTCOME_SOLVED && result.residual <= 1e-10);
        assert_true(result.residual < INFINITY);
        if (!(lowest(&s, planar, boxes) > 0.99 * half[1]))
            fail_msg("step %d: a box sank to %g", step, lowest(&s, planar, boxes));
        require_tame(&s, (ROWS + 1) * gap + half[1]);
    }
    scene_close(&s);
}

static void test_walls_stand_without_time(void **state)
{
    (void)state;
    stands(1, 0.0);
    stands(0, 0.0);
    stands(1, 0.05);
    stands(0, 0.05);
}

/* max_iterations are those of a step, all problems and methods together, but for the few sweeps of
 * each problem that it leaves open: eight, and no more than twenty problems come up here. */
static void test_iterations_are_those_of_the_step(void **state)
{
    perp_world_settings settings = settings_for(1);
    perp_body boxes[BOXES];
    perp_world_stats stats;
    scene s;
    int step;

    (void)state;
    settings.max_iterations = 3;
    build_wall(&s, &settings, boxes, 0.0);
    for (step = 0; step < 12; step++) {
        perp_step_result result = fresh_step_result();

        SCENE_OK(&s, perp_world_step(s.world, &result, h));
        assert_int_equal(perp_struct_init(&stats, sizeof stats), PERP_OK);
        SCENE_OK(&s, perp_world_get_stats(s.world, &stats));
        assert_int_equal(stats.iterations, result.iterations);
        assert_true(result.iterations <= 3 + 8 * 20);
        if (result.islands == 0)
            assert_int_equal(result.iterations, 0);
        assert_true(lowest(&s, 1, boxes) > 0.99 * half[1]);
    }
    scene_close(&s);
}

/* Limits that nothing reaches change no bit. */
static void test_limits_not_reached(void **state)
{
    perp_world_settings settings = settings_for(1), limited = settings;
    perp_body boxes[BOXES], same[BOXES];
    scene s, t;
    int step, i;

    (void)state;
    limited.time_limit = 1e6;
    limited.max_iterations = 1000000;
    build_wall(&s, &settings, boxes, 0.0);
    build_wall(&t, &limited, same, 0.0);
    for (step = 0; step < 2; step++) {
        scene_step(&s, h);
        scene_step(&t, h);
        for (i = 0; i < BOXES; i++) {
            perp_body_state a = scene_state(&s, boxes[i]), b = scene_state(&t, same[i]);

            assert_memory_equal(&a, &b, sizeof a);
        }
    }
    scene_close(&s);
    scene_close(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_walls_stand_without_time),
        cmocka_unit_test(test_iterations_are_those_of_the_step),
        cmocka_unit_test(test_limits_not_reached),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
