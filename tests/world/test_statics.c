/* Heavy on light: what statics holds stands at 0.0 whatever the ratio of the masses, and what it
 * does not hold moves. Two unit boxes on the ground, the lower one of 1 kg. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "world/scene.h"

#define MU 0.2 /* below 1/3, the slope at which the two would tip */

static const double ratios[] = {1e4, 1e7, 1e9, 1e12};
static const int32_t levels[] = {PERP_ACCURACY_FAST, PERP_ACCURACY_STANDARD, PERP_ACCURACY_ACCURATE,
                                 PERP_ACCURACY_EXACT};

/* Whether both end each of ten steps as they began; the upper one stands `aside`, gravity leans by
 * a slope along y. */
static int stands(double ratio, int32_t accuracy, double aside, double slope)
{
    perp_world_settings settings;
    perp_body boxes[2];
    scene s;
    int k, i, still = 1;

    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
    settings.gravity[1] = GRAVITY * slope / sqrt(1.0 + slope * slope);
    settings.gravity[2] = -GRAVITY / sqrt(1.0 + slope * slope);
    settings.accuracy = accuracy;
    settings.wakeful = 1;
    scene_create(&s, &settings);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, MU, 0.0);
    for (k = 0; k < 2; k++) {
        perp_body_settings body = scene_defaults();

        body.mass = k ? ratio : 1.0;
        body.position[0] = k * aside;
        body.position[2] = 0.5 + k;
        boxes[k] = scene_add(&s, &body);
        scene_box(&s, boxes[k], 0.5, 0.5, 0.5, MU, 0.0);
    }
    for (k = 0; k < 10 && still; k++) {
        perp_step_result result;

        assert_int_equal(perp_step_result_init(&result, sizeof result), PERP_OK);
        SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));

        for (i = 0; i < 2; i++)
            still = still && scene_rests(&s, boxes[i]) &&
                    scene_state(&s, boxes[i]).position[2] == 0.5 + i;
        if (still)
            assert_true(result.outcome == PERP_OUTCOME_SOLVED ||
                        result.outcome == PERP_OUTCOME_ROUNDING_LIMIT);
    }
    scene_close(&s);
    return still;
}

/* The load's centre within the lower box's edge by 2 %, and beyond it. */
static void test_overhang(void **state)
{
    size_t i, level;

    (void)state;
    for (i = 0; i < sizeof ratios / sizeof *ratios; i++)
        for (level = 0; level < 4; level++) {
            assert_true(stands(ratios[i], levels[level], 0.0, 0.0));
            assert_true(stands(ratios[i], levels[level], 0.49, 0.0));
            assert_false(stands(ratios[i], levels[level], 0.51, 0.0));
        }
}

/* The friction that a slope asks for: 2 % less than there is, and 2 % more. */
static void test_slope(void **state)
{
    size_t i, level;

    (void)state;
    for (i = 0; i < sizeof ratios / sizeof *ratios; i++)
        for (level = 0; level < 4; level++) {
            assert_true(stands(ratios[i], levels[level], 0.0, 0.98 * MU));
            assert_false(stands(ratios[i], levels[level], 0.0, 1.02 * MU));
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_overhang),
        cmocka_unit_test(test_slope),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
