/* What decides about a contact, each with a motion that goes wrong without it. */
#include "suite.h"

#include "scene.h"

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
        perp_step_result result = fresh_step_result();
        perp_body box[boxes];
        double change[boxes][3], v0[boxes][3];
        scene s;
        int32_t i, k, c;

        assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
        world.accuracy = PERP_ACCURACY_EXACT;
        world.method = PERP_CONTACT_METHOD_SWEEP;
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
            for (k = 0; k < 3; k++) /* where that is all that doubles give, to sqrt(tol) of 1 m/s */
                scene_near(scene_state(&s, box[i]).velocity[k] - v0[i][k], change[i][k], 4e-6,
                           "change of momentum");
        scene_close(&s);
    }
    assert_true(stopped >= 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_momentum_of_a_stopped_solve),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
