/* Which points count: all that can close within the step, by what others may do to a body too. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

/* A ball of mass 1 comes with 10 m/s upon one of mass 1.5 at rest, which has a wall 0.02 m behind
 * it. Nothing of the latter two moves when the step of 0.01 s begins; without the wall both balls
 * would go on with 10 / 2.5 = 4 m/s, momentum kept, 0.04 m in the step. So the wall must count: it
 * lets them close by their 0.02 m, with 2 m/s, and no further. */
static void test_pushed_by_what_is_fast(void **state)
{
    const double gap = 0.02, h = 0.01;
    perp_body_settings settings = scene_settings();
    perp_body fast, pushed;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    settings.mass = 1.0;
    settings.velocity[0] = 10.0;
    fast = scene_add(&s, &settings);
    settings.mass = 1.5;
    settings.velocity[0] = 0.0;
    settings.position[0] = 2.0;
    pushed = scene_add(&s, &settings);
    scene_sphere(&s, fast, 1.0, 0.0, 0.0);
    scene_sphere(&s, pushed, 1.0, 0.0, 0.0);
    scene_plane(&s, s.ground, -1.0, 0.0, 0.0, -3.0 - gap, 0.0, 0.0);
    scene_step(&s, h);
    /* the gap is a difference of coordinates up to 3, divided by h: 8 units of that */
    scene_near(scene_state(&s, pushed).velocity[0], gap / h, 8.0 * 3.0 * EPSILON / h, "speed");
    scene_near(scene_state(&s, pushed).position[0], 2.0 + gap, 8.0 * 3.0 * EPSILON, "place");
    scene_close(&s);
}

/* Equal balls that come with 10 m/s each, 0.15 m apart: within 0.01 s they would overlap by 0.05 m,
 * though neither is faster than the gap over the step. They close it, and share what is left. */
static void test_both_are_fast(void **state)
{
    const double gap = 0.15, h = 0.01;
    perp_body_settings settings = scene_settings();
    perp_body balls[2];
    scene s;
    int i;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    for (i = 0; i < 2; i++) {
        settings.position[0] = i * (2.0 + gap);
        settings.velocity[0] = i == 0 ? 10.0 : -10.0;
        balls[i] = scene_add(&s, &settings);
        scene_sphere(&s, balls[i], 1.0, 0.0, 0.0);
    }
    scene_step(&s, h);
    for (i = 0; i < 2; i++) /* as above */
        scene_near(scene_state(&s, balls[i]).velocity[0], (i == 0 ? 0.5 : -0.5) * gap / h,
                   8.0 * 3.0 * EPSILON / h, "speed");
    scene_close(&s);
}

/* A ball of mass 3 hits one of mass 1 without restitution: both go on with 3/4 of 10 m/s, but for
 * the millimetre that is left to close. Alone its
 * arm would reach a block of restitution 1 within the step, so that the block takes part, but now
 * it does not: that is no impact. */
static void test_not_reached(void **state)
{
    const double gap = 0.0875, between = 0.001, h = 0.01;
    perp_body_settings settings = scene_settings();
    perp_world_stats stats = fresh_world_stats();
    perp_body balls[2];
    scene s;
    int i;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    for (i = 0; i < 2; i++) {
        settings.mass = i == 0 ? 3.0 : 1.0;
        settings.position[0] = (2.0 + between) * i;
        settings.velocity[0] = i == 0 ? 10.0 : 0.0;
        balls[i] = scene_add(&s, &settings);
        scene_sphere(&s, balls[i], 1.0, 0.0, 0.0);
    }
    scene_point(&s, balls[0], 0.0, 5.0, 0.0, 0.0, 1.0);
    scene_plane(&s, s.ground, -sqrt(0.5), -sqrt(0.5), 0.0, -sqrt(0.5) * (5.0 + gap), 0.0, 1.0);
    scene_step(&s, h);
    assert_int_equal(perp_world_contact_count(s.world), 2);
    SCENE_OK(&s, perp_world_get_stats(s.world, &stats));
    assert_int_equal(stats.impacts, 0);
    /* a difference of coordinates up to 3, divided by h, as above */
    for (i = 0; i < 2; i++)
        scene_near(scene_state(&s, balls[i]).velocity[0],
                   7.5 + (i == 0 ? 0.25 : -0.75) * between / h, 8.0 * 3.0 * EPSILON / h, "speed");
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pushed_by_what_is_fast),
        cmocka_unit_test(test_both_are_fast),
        cmocka_unit_test(test_not_reached),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
