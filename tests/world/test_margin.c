/* Which points count: all that can close within the step, by what others may do to a body too. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "world/scene.h"

/* A ball of mass 1 comes with 10 m/s upon one of mass 1.5 at rest, which has a wall 0.02 m behind it.
 * Nothing of the latter two moves when the step of 0.01 s begins; without the wall both balls would
 * go on with 10 / 2.5 = 4 m/s, momentum kept, 0.04 m in the step. So the wall must count: it lets
 * them close by their 0.02 m, with 2 m/s, and no further. */
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pushed_by_what_is_fast),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
