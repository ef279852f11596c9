/* Sticking, slipping and separating: zeros that are true, bodies that are carried, stacks. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"
#include "world/step.h"

#define MOST 16

static perp_body_settings box_settings(double mass, const double *half)
{
    perp_body_settings settings = scene_settings();

    settings.mass = mass;
    settings.inertia[0] = mass * (half[1] * half[1] + half[2] * half[2]) / 3.0;
    settings.inertia[4] = mass * (half[0] * half[0] + half[2] * half[2]) / 3.0;
    settings.inertia[8] = mass * (half[0] * half[0] + half[1] * half[1]) / 3.0;
    return settings;
}

/* Boxes on top of each other, the first at the bottom. */
static void stack(scene *s, int32_t planar, int n, const double *masses, const double *half,
                  perp_body *boxes)
{
    int up = planar ? 1 : 2;
    int i;

    scene_open(s, planar, 0.0, planar ? -GRAVITY : 0.0, planar ? 0.0 : -GRAVITY);
    scene_plane(s, s->ground, 0.0, planar ? 1.0 : 0.0, planar ? 0.0 : 1.0, 0.0, 0.5, 0.0);
    for (i = 0; i < n; i++) {
        perp_body_settings settings = box_settings(masses[i], half);

        settings.position[up] = (2 * i + 1) * half[up];
        boxes[i] = scene_add(s, &settings);
        scene_box(s, boxes[i], half[0], half[1], half[2], 0.5, 0.0);
    }
}

/* Sum of the normal impulses on the ground. */
static double ground_impulse(scene *s)
{
    double sum = 0.0;
    int32_t i;

    for (i = 0; i < perp_world_contact_count(s->world); i++) {
        perp_world_contact contact = scene_contact(s, i);

        if (contact.body_a == s->ground || contact.body_b == s->ground)
            sum += contact.impulse[0];
    }
    return sum;
}

/* Every velocity is 0.0, every contact reports what holds, and the ground carries the weight. The
 * impulse on a light body under a heavy one is a small difference of large ones: the ratio of their
 * masses is the condition number of the impulses. */
static void stack_rests(int32_t planar, int n, const double *masses, double condition, int steps)
{
    static const double half[3] = {0.5, 0.25, 0.25};
    const double h = 0.01;
    perp_body boxes[MOST];
    double weight = 0.0;
    scene s;
    int i, k;

    stack(&s, planar, n, masses, half, boxes);
    for (i = 0; i < n; i++)
        weight += masses[i] * GRAVITY;
    for (k = 0; k < steps; k++) {
        scene_step(&s, h);
        for (i = 0; i < n; i++)
            if (!scene_rests(&s, boxes[i]))
                fail_msg("step %d: box %d of %d moves", k, i, n);
        /* impulses solve their equations to a few units of rounding of these equations' terms */
        scene_near(ground_impulse(&s) / (weight * h), 1.0, 64.0 * n * EPSILON * condition,
                   "weight");
    }
    for (i = 0; i < perp_world_contact_count(s.world); i++) {
        perp_world_contact contact = scene_contact(&s, i);

        assert_int_equal(contact.mode, PERP_CONTACT_STICK);
        assert_true(contact.velocity[0] == 0.0 && contact.velocity[1] == 0.0 &&
                    contact.velocity[2] == 0.0);
        assert_true(hypot(contact.impulse[1], contact.impulse[2]) <=
                    contact.friction * contact.impulse[0] + 64.0 * EPSILON * weight * h);
    }
    scene_close(&s);
}

static void test_stack_of_ten(void **state)
{
    double masses[10];
    int i;

    (void)state;
    for (i = 0; i < 10; i++)
        masses[i] = 1.0;
    stack_rests(1, 10, masses, 1.0, 20);
    stack_rests(0, 10, masses, 1.0, 5);
}

static void test_mass_ratios(void **state)
{
    static const double ratios[] = {1e4, 1e-4, 1e8, 1e-8};
    size_t i;

    (void)state;
    for (i = 0; i < sizeof ratios / sizeof *ratios; i++) {
        double masses[3] = {1.0, ratios[i], 1.0};
        double condition = fmax(ratios[i], 1.0 / ratios[i]);

        stack_rests(1, 2, masses, condition, 10);
        stack_rests(1, 3, masses, condition, 10);
        stack_rests(0, 2, masses, condition, 5);
        stack_rests(0, 3, masses, condition, 5);
    }
}

/* A box on a belt, started at rest, is dragged along and then has the belt's velocity, to the last
 * bit; and one that lands on the one below it comes along. */
static void on_a_belt(int32_t planar)
{
    static const double half[3] = {0.125, 0.125, 0.125};
    const double vx = 0.3, vy = planar ? 0.0 : 0.1, h = 0.01;
    int up = planar ? 1 : 2;
    perp_body_settings settings = scene_settings();
    perp_body belt, box[2];
    scene s;
    int i, k, stuck = 0;

    scene_open(&s, planar, 0.0, planar ? -GRAVITY : 0.0, planar ? 0.0 : -GRAVITY);
    settings.kind = PERP_BODY_KINEMATIC;
    settings.velocity[0] = vx;
    settings.velocity[1] = vy;
    belt = scene_add(&s, &settings);
    scene_plane(&s, belt, 0.0, planar ? 1.0 : 0.0, planar ? 0.0 : 1.0, 0.0, 0.5, 0.0);
    for (i = 0; i < 2; i++) {
        settings = box_settings(2.0, half);
        settings.position[up] = (2 * i + 1) * half[up];
        box[i] = scene_add(&s, &settings);
        scene_box(&s, box[i], half[0], half[1], half[2], 0.5, 0.0);
    }
    for (k = 0; k < 60; k++) {
        int same = 1;

        scene_step(&s, h);
        for (i = 0; i < 2; i++) {
            perp_body_state now = scene_state(&s, box[i]);

            same = same && now.velocity[0] == vx && now.velocity[1] == vy &&
                   now.velocity[2] == 0.0 && now.angular_velocity[0] == 0.0 &&
                   now.angular_velocity[1] == 0.0 && now.angular_velocity[2] == 0.0;
        }
        if (k == 0)
            assert_false(same);
        assert_false(stuck && !same);
        stuck = same;
    }
    assert_true(stuck);
    for (i = 0; i < perp_world_contact_count(s.world); i++) {
        perp_world_contact contact = scene_contact(&s, i);

        assert_int_equal(contact.mode, PERP_CONTACT_STICK);
        assert_true(contact.velocity[0] == 0.0 && contact.velocity[1] == 0.0 &&
                    contact.velocity[2] == 0.0);
    }
    scene_close(&s);
}

static void test_belt(void **state)
{
    (void)state;
    on_a_belt(1);
    on_a_belt(0);
}

/* A box stuck to a turntable turns with it, on its circle. */
static void test_turntable(void **state)
{
    static const double half[3] = {0.125, 0.125, 0.125};
    const double w = 0.25;
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_body table, box;
    scene s;
    int k;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    settings.kind = PERP_BODY_KINEMATIC;
    settings.angular_velocity[2] = w;
    table = scene_add(&s, &settings);
    scene_plane(&s, table, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    settings = box_settings(1.0, half);
    settings.position[0] = 1.0;
    settings.position[2] = half[2];
    settings.velocity[1] = w;
    settings.angular_velocity[2] = w;
    box = scene_add(&s, &settings);
    scene_box(&s, box, half[0], half[1], half[2], 0.5, 0.0);
    for (k = 0; k < 50; k++) {
        scene_step(&s, 0.01);
        now = scene_state(&s, box);
        assert_true(now.angular_velocity[0] == 0.0 && now.angular_velocity[1] == 0.0 &&
                    now.angular_velocity[2] == w);
        /* each step rounds both coordinates a few times */
        scene_near(now.velocity[0], -w * now.position[1], 1e-15, "velocity in x");
        scene_near(now.velocity[1], w * now.position[0], 1e-15, "velocity in y");
        assert_true(now.velocity[2] == 0.0);
        scene_near(hypot(now.position[0], now.position[1]), 1.0, (k + 1) * 1e-15, "radius");
    }
    scene_close(&s);
}

/* A box that slides on one that sticks: the lower one has velocity 0.0 all the same, the upper one
 * v0 - mu g t. */
static void test_stuck_under_a_sliding_box(void **state)
{
    static const double half[3] = {0.5, 0.25, 0.25};
    static const double masses[2] = {10.0, 1.0};
    const double h = 0.01;
    perp_body boxes[2];
    perp_body_state now;
    scene s;
    int k;

    (void)state;
    stack(&s, 0, 2, masses, half, boxes);
    now = scene_state(&s, boxes[1]);
    now.velocity[0] = 1.0;
    SCENE_OK(&s, perp_world_set_body(s.world, &now, boxes[1]));
    for (k = 1; k <= 10; k++) {
        scene_step(&s, h);
        assert_true(scene_rests(&s, boxes[0]));
        now = scene_state(&s, boxes[1]);
        scene_near(now.velocity[0], 1.0 - k * h * 0.5 * GRAVITY, 64.0 * k * EPSILON, "upper box");
    }
    scene_close(&s);
}

/* Two boards lean against each other, held by friction at their feet and nothing else: each needs
 * the other, so that the group as a whole must be found to rest. */
static void test_leaning_boards(void **state)
{
    const double length = 1.0, tilt = 0.35, thin = 0.01;
    perp_body boards[2];
    scene s;
    int i, k;

    (void)state;
    scene_open(&s, 1, 0.0, -GRAVITY, 0.0);
    scene_plane(&s, s.ground, 0.0, 1.0, 0.0, 0.0, 0.8, 0.0);
    for (i = 0; i < 2; i++) {
        double side = i == 0 ? -1.0 : 1.0;
        perp_body_settings settings = scene_settings();

        settings.inertia[8] = length * length / 3.0;
        settings.position[0] = side * (length * sin(tilt) + thin);
        settings.position[1] = length * cos(tilt) + thin;
        boards[i] = scene_add(&s, &settings);
        /* a foot and a head, both discs */
        {
            perp_shape_settings material = scene_material(0.8, 0.0);
            int end;

            for (end = -1; end <= 1; end += 2) {
                material.offset[0] = -side * end * length * sin(tilt);
                material.offset[1] = end * length * cos(tilt);
                SCENE_OK(&s, perp_world_add_sphere(s.world, NULL, boards[i], thin, &material));
            }
        }
    }
    for (k = 0; k < 20; k++) {
        scene_step(&s, 0.01);
        assert_true(scene_rests(&s, boards[0]));
        assert_true(scene_rests(&s, boards[1]));
    }
    scene_close(&s);
}

/* A lifted box and one that is not: what separates has impulse 0.0. */
static void test_separates(void **state)
{
    static const double half[3] = {0.125, 0.125, 0.125};
    perp_body_settings settings = box_settings(1.0, half);
    perp_body box;
    scene s;
    int32_t i;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    settings.position[2] = half[2];
    box = scene_add(&s, &settings);
    scene_box(&s, box, half[0], half[1], half[2], 0.5, 0.0);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    scene_push(&s, box, 0.0, 0.0, GRAVITY * (1.0 + 1e-9));
    scene_step(&s, 0.01);
    assert_true(scene_state(&s, box).velocity[2] > 0.0);
    assert_true(perp_world_contact_count(s.world) >= 4);
    for (i = 0; i < perp_world_contact_count(s.world); i++) {
        perp_world_contact contact = scene_contact(&s, i);

        assert_int_equal(contact.mode, PERP_CONTACT_SEPARATE);
        assert_true(contact.impulse[0] == 0.0 && contact.impulse[1] == 0.0 &&
                    contact.impulse[2] == 0.0);
    }
    scene_push(&s, box, 0.0, 0.0, GRAVITY * (1.0 - 1e-9));
    scene_steps(&s, 3, 0.01);
    scene_push(&s, box, 0.0, 0.0, 0.0);
    scene_steps(&s, 3, 0.01);
    assert_true(scene_rests(&s, box));
    scene_close(&s);
}

/* A gap that closes within the step closes at exactly gap/h, and the box then rests. */
static void test_closes_a_gap(void **state)
{
    static const double half[3] = {0.125, 0.125, 0.125};
    const double h = 0.01, gap = 0.0007;
    perp_body_settings settings = box_settings(1.0, half);
    perp_body box;
    scene s;
    int32_t i;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    settings.position[2] = half[2] + gap;
    settings.velocity[2] = -1.0;
    box = scene_add(&s, &settings);
    scene_box(&s, box, half[0], half[1], half[2], 0.5, 0.0);
    scene_step(&s, h);
    assert_int_equal(perp_world_contact_count(s.world), 4);
    for (i = 0; i < 4; i++) {
        perp_world_contact contact = scene_contact(&s, i);

        scene_near(contact.gap, gap, EPSILON, "gap");
        assert_true(contact.velocity[0] == -contact.gap / h);
        assert_true(contact.velocity[1] == 0.0 && contact.velocity[2] == 0.0);
    }
    scene_near(scene_state(&s, box).position[2], half[2], EPSILON, "height");
    scene_step(&s, h);
    assert_true(scene_rests(&s, box));
    scene_close(&s);
}

/* Tipping: a box on a slope tips at atan(b/h) = 18.43... degrees if friction holds it; a thousandth
 * of a degree below it rests, above it turns. */
static void test_tipping(void **state)
{
    static const double half[3] = {0.1, 0.3, 0.1};
    const double edge = 18.434948822922011;
    int planar, above;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (above = 0; above < 2; above++) {
            const double spatial[3] = {0.1, 0.1, 0.3};
            double theta = (edge + (above ? 1e-3 : -1e-3)) * PI / 180.0;
            perp_body box;
            scene s;
            int k;

            scene_open(&s, planar, 0.0, planar ? -GRAVITY : 0.0, planar ? 0.0 : -GRAVITY);
            box = scene_box_on_slope(&s, planar, theta, 1.0, planar ? half : spatial, 2.0, 0.0);
            for (k = 0; k < 10; k++) {
                scene_step(&s, 0.01);
                assert_int_equal(scene_rests(&s, box), !above);
            }
            scene_close(&s);
        }
}

/* Frames: right-handed, with the stated axes on the ground. */
static void test_contact_frames(void **state)
{
    static const double normals[][3] = {{0.0, 0.0, 1.0},   {0.0, 0.0, -1.0}, {1.0, 0.0, 0.0},
                                        {-1.0, 0.0, 0.0},  {0.0, 1.0, 0.0},  {0.6, 0.0, 0.8},
                                        {0.48, 0.6, 0.64}, {0.95, 0.2, 0.1}};
    size_t i;

    (void)state;
    for (i = 0; i < sizeof normals / sizeof *normals; i++) {
        perp_body_settings settings = scene_settings();
        perp_world_contact c;
        perp_body ball;
        scene s;
        double length = sqrt(scene_dot(normals[i], normals[i]));
        int k;

        scene_open(&s, 0, 0.0, 0.0, 0.0);
        scene_plane(&s, s.ground, normals[i][0], normals[i][1], normals[i][2], 0.0, 0.5, 0.0);
        for (k = 0; k < 3; k++)
            settings.position[k] = normals[i][k] / length;
        ball = scene_add(&s, &settings);
        scene_sphere(&s, ball, 1.0, 0.5, 0.0);
        scene_step(&s, 0.01);
        c = scene_contact(&s, 0);
        assert_true(c.body_a == s.ground && c.body_b == ball);
        for (k = 0; k < 3; k++) {
            double cross = c.normal[(k + 1) % 3] * c.tangent_1[(k + 2) % 3] -
                           c.normal[(k + 2) % 3] * c.tangent_1[(k + 1) % 3];

            scene_near(c.normal[k], normals[i][k] / length, 2.0 * EPSILON, "normal");
            scene_near(c.tangent_2[k], cross, 4.0 * EPSILON, "tangent 2");
        }
        scene_near(scene_dot(c.tangent_1, c.tangent_1), 1.0, 4.0 * EPSILON, "unit tangent");
        scene_near(scene_dot(c.tangent_1, c.normal), 0.0, 4.0 * EPSILON, "right angle");
        if (i == 0) {
            assert_true(c.tangent_1[0] == 1.0 && c.tangent_1[1] == 0.0 && c.tangent_1[2] == 0.0);
            assert_true(c.tangent_2[0] == 0.0 && c.tangent_2[1] == 1.0 && c.tangent_2[2] == 0.0);
        }
        scene_close(&s);
    }
}

/* What is told to stick stands still, along the normal too: a speed of a few roundings there, as
 * sweeps leave it, is none of a contact that sticks. What bounced leaves at its own speed. */
static void test_what_sticks_stands_still(void **state)
{
    static const struct {
        double velocity[3], impulse, restitution;
        int32_t mode;
    } cases[] = {
        {{0.0, 0.0, 0.0}, 1.0, 0.0, PERP_CONTACT_STICK},
        {{-4e-16, 0.0, 0.0}, 1.0, 0.0, PERP_CONTACT_SLIP},
        {{4e-16, 0.0, 0.0}, 1.0, 0.0, PERP_CONTACT_SLIP},
        {{0.0, 0.0, 1e-300}, 1.0, 0.0, PERP_CONTACT_SLIP},
        {{2.0, 0.0, 0.0}, 1.0, 0.5, PERP_CONTACT_STICK},
        {{2.0, 0.0, 0.0}, 0.0, 0.5, PERP_CONTACT_SEPARATE},
    };

    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        perp__world_contact contact = {.restitution = cases[k].restitution};
        perp__response response = {.mode = PERP_CONTACT_SEPARATE};
        const perp__contact_set set = {.contacts = &contact, .responses = &response};
        perp_world_contact record;

        memcpy(response.velocity, cases[k].velocity, sizeof response.velocity);
        response.impulse[0] = cases[k].impulse;
        perp__write_record(&set, 0, &record);
        assert_int_equal(record.mode, cases[k].mode);
    }
}

/* A brick that slides for ever on a plane without friction is told to slide, at its velocity, by
 * every step of it. */
static void test_slides_for_ever(void **state)
{
    perp_body_settings settings = scene_defaults();
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    settings.position[2] = 0.5;
    settings.velocity[0] = 2.0;
    body = scene_add(&s, &settings);
    scene_box(&s, body, 0.5, 0.5, 0.5, 0.0, 0.0);
    for (int32_t k = 0; k < 20; k++) {
        scene_step(&s, 0.01);
        for (int32_t i = 0; i < 4; i++) {
            const perp_world_contact told = scene_contact(&s, i);

            assert_int_equal(told.mode, PERP_CONTACT_SLIP);
            scene_near(hypot(told.velocity[1], told.velocity[2]), 2.0, 4 * EPSILON, "slip");
        }
    }
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stack_of_ten),
        cmocka_unit_test(test_mass_ratios),
        cmocka_unit_test(test_belt),
        cmocka_unit_test(test_turntable),
        cmocka_unit_test(test_stuck_under_a_sliding_box),
        cmocka_unit_test(test_leaning_boards),
        cmocka_unit_test(test_separates),
        cmocka_unit_test(test_closes_a_gap),
        cmocka_unit_test(test_tipping),
        cmocka_unit_test(test_contact_frames),
        cmocka_unit_test(test_slides_for_ever),
        cmocka_unit_test(test_what_sticks_stands_still),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
