/* What decides about a contact, each with a motion that goes wrong without it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "scene.h"

/* An approach that is slower than what the step's own forces make of rest is no impact: a ball of
 * restitution 1 that gravity presses on the floor would bounce at speeds of g h for ever. A faster
 * one bounces. */
static void test_slow_approach_rests(void **state)
{
    const double h = 0.01;
    int k;

    (void)state;
    for (k = 1; k < 16; k++) {
        const double speed = k / 4.0 * GRAVITY * h; /* 4 quarters: forced */
        perp_body_settings settings = scene_settings();
        perp_body ball;
        scene s;

        if (k == 4)
            continue;
        scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0);
        settings.position[2] = 1.0;
        settings.velocity[2] = -speed;
        ball = scene_add(&s, &settings);
        scene_sphere(&s, ball, 1.0, 0.0, 1.0);
        scene_step(&s, h);
        if (k < 4)
            assert_true(scene_rests(&s, ball));
        else
            assert_true(scene_state(&s, ball).velocity[2] > 0.5 * speed);
        scene_close(&s);
    }
}

/* Wherever a solve is stopped, what it returns obeys Newton: each body's momentum changes by its
 * weight and by the impulses of its contacts, which are those reported. Velocities of contacts that
 * would hold if the solution were one are not these. */
static void test_momentum_of_a_stopped_solve(void **state)
{
    enum { boxes = 5 };
    const double h = 0.1;
    int32_t limit, stopped = 0;

    (void)state;
    for (limit = 1; limit < 24; limit++) {
        perp_world_settings world;
        perp_step_result result;
        perp_body box[boxes];
        double change[boxes][3], v0[boxes][3];
        scene s;
        int32_t i, k, c;

        assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
        world.method = PERP_LCP_LEMKE;
        world.max_iterations = limit;
        scene_create(&s, &world);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
        for (i = 0; i < boxes; i++) {
            perp_body_settings settings = scene_settings();

            settings.position[2] = 0.5 + i;
            settings.velocity[0] = cos(2.0 * i);
            settings.velocity[1] = sin(2.0 * i);
            memcpy(v0[i], settings.velocity, sizeof v0[i]);
            box[i] = scene_add(&s, &settings);
            scene_box(&s, box[i], 0.5, 0.5, 0.5, 0.5, 0.0);
            for (k = 0; k < 3; k++)
                change[i][k] = k == 2 ? -GRAVITY * h : 0.0;
        }
        assert_int_equal(perp_step_result_init(&result, sizeof result), PERP_OK);
        SCENE_OK(&s, perp_world_step(s.world, &result, h));
        stopped += result.outcome == PERP_OUTCOME_ITERATION_LIMIT;
        for (c = 0; c < perp_world_contact_count(s.world); c++) {
            const perp_world_contact at = scene_contact(&s, c);

            for (i = 0; i < boxes; i++)
                for (k = 0; k < 3; k++)
                    change[i][k] +=
                        ((at.body_b == box[i]) - (at.body_a == box[i])) *
                        (at.impulse[0] * at.normal[k] + at.impulse[1] * at.tangent_1[k] +
                         at.impulse[2] * at.tangent_2[k]);
        }
        for (i = 0; i < boxes; i++)
            for (k = 0; k < 3; k++) /* exact velocities may be off by 1e-8 of those of the island */
                scene_near(scene_state(&s, box[i]).velocity[k] - v0[i][k], change[i][k], 1e-7,
                           "change of momentum");
        scene_close(&s);
    }
    assert_true(stopped > 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slow_approach_rests),
        cmocka_unit_test(test_momentum_of_a_stopped_solve),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
