/* What statics holds stands at 0.0, and what it does not hold moves: heavy on light whatever the
 * ratio of the masses, two unit boxes on the ground, the lower one of 1 kg; and piles at every
 * level, whose impulses balance. */
#include <stdio.h>

#include "suite.h"

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
        perp_step_result result = fresh_step_result();

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

enum { BASE = 8, BOXES = BASE * (BASE + 1) / 2 };

/* A pyramid of unit boxes of 1 kg, of which gravity leans by a slope along y. */
static void make_pile(scene *s, perp_body *boxes, int32_t accuracy, int32_t substeps, double slope)
{
    perp_world_settings settings;
    int count = 0;

    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
    settings.gravity[1] = GRAVITY * slope / sqrt(1.0 + slope * slope);
    settings.gravity[2] = -GRAVITY / sqrt(1.0 + slope * slope);
    settings.accuracy = accuracy;
    settings.substeps = substeps;
    settings.wakeful = 1;
    scene_create(s, &settings);
    scene_plane(s, s->ground, 0.0, 0.0, 1.0, 0.0, MU, 0.0);
    for (int i = 0; i < BASE; i++)
        for (int k = 0; k < BASE - i; k++) {
            perp_body_settings box = scene_defaults();

            box.mass = 1.0;
            box.position[0] = 1.02 * (k + 0.5 * i);
            box.position[2] = 0.5 + i;
            boxes[count] = scene_add(s, &box);
            scene_box(s, boxes[count++], 0.5, 0.5, 0.5, MU, 0.0);
        }
}

/* What forces, gravity and all contacts make of a body's momentum, and of its angular momentum: the
 * largest entry. */
static double unbalance(scene *s, perp_body box, double h, const double *gravity)
{
    const perp_body_state state = scene_state(s, box);
    double sum[6], most = 0.0;

    for (int k = 0; k < 3; k++) {
        sum[k] = h * (gravity[k] + state.force[k]);
        sum[3 + k] = h * state.torque[k];
    }
    for (int32_t i = 0; i < perp_world_contact_count(s->world); i++) {
        const perp_world_contact c = scene_contact(s, i);
        const double side = c.body_b == box ? 1.0 : c.body_a == box ? -1.0 : 0.0;
        double force[3], arm[3];

        for (int k = 0; k < 3; k++) {
            force[k] = side * (c.impulse[0] * c.normal[k] + c.impulse[1] * c.tangent_1[k] +
                               c.impulse[2] * c.tangent_2[k]);
            arm[k] = c.position[k] - state.position[k];
        }
        for (int k = 0; k < 3; k++) {
            sum[k] += force[k];
            sum[3 + k] +=
                arm[(k + 1) % 3] * force[(k + 2) % 3] - arm[(k + 2) % 3] * force[(k + 1) % 3];
        }
        assert_true(hypot(c.impulse[1], c.impulse[2]) <= MU * c.impulse[0] * (1.0 + 1e-15));
    }
    for (int k = 0; k < 6; k++)
        most = fmax(most, fabs(sum[k]));
    return most;
}

/* A pile that has come to rest has impulses that balance to rounding, and needs no iteration more.
 */
static void check_pile(int32_t accuracy, int32_t substeps, double slope)
{
    const double length = sqrt(1.0 + slope * slope);
    const double gravity[] = {0.0, GRAVITY * slope / length, -GRAVITY / length};
    perp_step_result result;
    perp_body boxes[BOXES];
    scene s;

    make_pile(&s, boxes, accuracy, substeps, slope);
    for (int k = 0; k < 20; k++) {
        assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
        SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
    }
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(result.iterations, 0);
    assert_true(result.residual <= 1e-12);
    for (int i = 0; i < BOXES; i++) {
        assert_true(scene_rests(&s, boxes[i]));
        assert_true(unbalance(&s, boxes[i], 0.01, gravity) < 1e-12);
    }
    scene_close(&s);
}

/* At every level, and however near its budget comes to the answer. */
static void test_pile(void **state)
{
    static const int32_t substeps[] = {0, 24, 64};

    (void)state;
    for (size_t level = 0; level < 4; level++)
        for (size_t i = 0; i < sizeof substeps / sizeof *substeps; i++)
            for (int leans = 0; leans < (level < 2 ? 2 : 1); leans++)
                check_pile(levels[level], substeps[i], leans ? 0.5 * MU : 0.0);
}

/* The same impulses, to the last bit, in a pile of which that box is pushed first. */
static void check_same_afresh(scene *s, int32_t accuracy, int box, const perp_body_state *pushed)
{
    perp_body boxes[BOXES];
    scene other;

    make_pile(&other, boxes, accuracy, 0, 0.0);
    scene_step(&other, 0.01);
    SCENE_OK(&other, perp_world_set_body(other.world, pushed, boxes[box]));
    scene_step(&other, 0.01);
    assert_int_equal(perp_world_contact_count(other.world), perp_world_contact_count(s->world));
    for (int32_t i = 0; i < perp_world_contact_count(s->world); i++) {
        const perp_world_contact a = scene_contact(s, i), b = scene_contact(&other, i);

        assert_memory_equal(a.impulse, b.impulse, sizeof a.impulse);
    }
    scene_close(&other);
}

/* A force and a moment on another box in each step: all of them stand, and impulses balance what
 * pushes now, to rounding beside the weight of the pile and to the same bits as where no factor was
 * kept; also once a box has another inertia, which its contacts do not tell. */
static void test_touched_pile(void **state)
{
    static const double gravity[] = {0.0, 0.0, -GRAVITY};

    (void)state;
    for (size_t level = 0; level < 4; level++) {
        perp_body boxes[BOXES];
        scene s;

        make_pile(&s, boxes, levels[level], 0, 0.0);
        scene_step(&s, 0.01);
        for (int k = 0; k < 24; k++) {
            const int number = k < 12 ? 7 * k % BOXES : 10;
            const perp_body box = boxes[number];
            perp_body_state pushed = scene_state(&s, box), alone;

            if (k == 12) { /* a shape inside it */
                SCENE_OK(&s, perp_world_add_sphere(s.world, NULL, box, 0.4, NULL));
                scene_step(&s, 0.01);
            }
            alone = pushed;
            pushed.force[0] = 0.3 * sin(k);
            pushed.torque[0] = 0.2 * cos(k);
            pushed.torque[1] = 0.1;
            SCENE_OK(&s, perp_world_set_body(s.world, &pushed, box));
            scene_step(&s, 0.01);
            for (int i = 0; i < BOXES; i++) {
                assert_true(scene_rests(&s, boxes[i]));
                assert_true(unbalance(&s, boxes[i], 0.01, gravity) < 1e-12);
            }
            if (k < 12)
                check_same_afresh(&s, levels[level], number, &pushed);
            SCENE_OK(&s, perp_world_set_body(s.world, &alone, box));
        }
        scene_close(&s);
    }
}

/* More than friction holds. */
static void test_pile_slides(void **state)
{
    (void)state;
    for (size_t level = 0; level < 4; level++) {
        perp_body boxes[BOXES];
        scene s;

        make_pile(&s, boxes, levels[level], 0, 1.01 * MU);
        for (int k = 0; k < 10; k++) {
            perp_step_result result = fresh_step_result();

            SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
        }
        for (int i = 0; i < BOXES; i++)
            assert_true(scene_state(&s, boxes[i]).velocity[1] > 0.0);
        scene_close(&s);
    }
}

/* Fifteen bricks that overhang by a share more than 1/2, 1/4, 1/6 .. of their length (the harmonic
 * tower), turned about a vertical axis. All turn about the lowest edge, by no more than that share
 * of a fall: known to the share itself, for bricks above it are at their limit, too. */
static void test_falls_slowly(void **state)
{
    static const double shares[] = {2e-9, 1e-6, 1e-4};
    const int count = 15;

    (void)state;
    for (int run = 0; run < 12; run++) {
        const double share = shares[run % 3], angle = 0.3 + run, c = cos(angle), s1 = sin(angle);
        perp_body_settings brick = scene_defaults();
        perp_world_settings settings;
        double x = 0.0, fastest = 0.0;
        perp_body bricks[15];
        scene s;

        assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
        settings.accuracy = levels[run / 3];
        settings.wakeful = 1;
        scene_create(&s, &settings);
        brick.kind = PERP_BODY_STATIC;
        for (int k = 0; k <= count; k++) {
            perp_body body;

            brick.position[0] = c * x;
            brick.position[1] = s1 * x;
            brick.position[2] = 0.2 * k;
            brick.orientation[0] = cos(0.5 * angle);
            brick.orientation[3] = sin(0.5 * angle);
            body = scene_add(&s, &brick);
            scene_box(&s, body, 0.5, 0.25, 0.1, 0.5, 0.0);
            if (k > 0)
                bricks[k - 1] = body;
            brick.kind = PERP_BODY_DYNAMIC;
            brick.mass = 1.0;
            x += 0.5 / (count - k) * (1.0 + share);
        }
        scene_steps(&s, 5, 0.01);
        for (int k = 0; k < count; k++) {
            const perp_body_state now = scene_state(&s, bricks[k]);

            fastest = fmax(fastest, sqrt(scene_dot(now.velocity, now.velocity)));
        }
        assert_true(fastest > 0.0);
        assert_true(fastest <= 2.0 * share * GRAVITY * 0.05);
        scene_close(&s);
    }
}

/* A box on a carrier that begins to move, by a share of what friction can take it along with in one
 * step: it goes as far as the carrier. */
static void test_rides_along(void **state)
{
    (void)state;
    for (double share = 0.05; share < 1.0; share += 0.06)
        for (size_t level = 0; level < 4; level++) {
            const double h = 0.01, speed = share * 0.6 * GRAVITY * h;
            perp_world_settings settings;
            perp_body_settings body = scene_defaults();
            perp_body_state now;
            perp_body carrier, box;
            scene s;

            assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
            settings.accuracy = levels[level];
            scene_create(&s, &settings);
            body.position[2] = 0.15;
            box = scene_add(&s, &body);
            scene_box(&s, box, 1.0, 1.0, 0.15, 0.6, 0.0);
            body.kind = PERP_BODY_KINEMATIC;
            body.position[2] = -0.5;
            carrier = scene_add(&s, &body);
            scene_box(&s, carrier, 8.0, 5.0, 0.5, 0.6, 0.0);
            scene_steps(&s, 3, h);
            now = scene_state(&s, carrier);
            now.velocity[0] = speed;
            SCENE_OK(&s, perp_world_set_body(s.world, &now, carrier));
            scene_step(&s, h);
            scene_near(scene_state(&s, box).position[0], h * speed, 1e-17, "as far as the carrier");
            scene_close(&s);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_overhang),    cmocka_unit_test(test_slope),
        cmocka_unit_test(test_pile),        cmocka_unit_test(test_touched_pile),
        cmocka_unit_test(test_pile_slides), cmocka_unit_test(test_falls_slowly),
        cmocka_unit_test(test_rides_along),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
