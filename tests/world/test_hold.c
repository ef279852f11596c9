/* What the rows that hold leave of a velocity is exact: beside motion, on two carriers, and where
 * something leaves. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

static perp_body add_box(scene *s, const double *half, double mass, const double *place, double yaw,
                         double vx)
{
    perp_body_settings settings = scene_settings();
    perp_body box;
    int i;

    settings.mass = mass;
    for (i = 0; i < 3; i++) {
        settings.inertia[4 * i] =
            mass * (half[(i + 1) % 3] * half[(i + 1) % 3] + half[(i + 2) % 3] * half[(i + 2) % 3]) /
            3.0;
        settings.position[i] = place[i];
    }
    settings.orientation[0] = cos(0.5 * yaw);
    settings.orientation[3] = sin(0.5 * yaw);
    settings.velocity[0] = vx;
    box = scene_add(s, &settings);
    scene_box(s, box, half[0], half[1], half[2], 0.25, 0.0);
    return box;
}

/* A box that slides at an angle to its sides neither lifts nor tips: its normals hold these three
 * velocities at 0.0, and leave it the others. */
static void test_sliding_askew(void **state)
{
    static const double half[3] = {0.3, 0.5, 0.1}, place[3] = {0.0, 0.0, 0.1};
    int k, angle;

    (void)state;
    for (angle = 1; angle < 10; angle++) {
        perp_body_state now;
        perp_body box;
        scene s;

        scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0);
        box = add_box(&s, half, 0.7, place, 0.17 * angle, 2.0);
        for (k = 0; k < 20; k++) {
            scene_step(&s, 0.01);
            now = scene_state(&s, box);
            assert_true(now.velocity[0] > 1.0);
            assert_true(now.velocity[2] == 0.0 && now.angular_velocity[0] == 0.0 &&
                        now.angular_velocity[1] == 0.0);
        }
        scene_close(&s);
    }
}

/* A ball leaves a box with 3 m/s, and a second one lies on it: box and second ball are at rest, to
 * the last bit, the first one has but its gravity. */
static void test_beside_what_leaves(void **state)
{
    static const double half[3] = {0.3, 0.5, 0.1}, place[3] = {0.1, 0.2, 0.1};
    const double h = 0.01;
    perp_body_settings settings = scene_settings();
    perp_body box, ball[2];
    scene s;
    int i;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0);
    box = add_box(&s, half, 0.7, place, 0.3, 0.0);
    for (i = 0; i < 2; i++) {
        settings.mass = 0.3;
        settings.position[0] = 0.1 + 0.15 * i;
        settings.position[1] = 0.1;
        settings.position[2] = 0.2 + 0.05;
        settings.velocity[2] = i == 0 ? 3.0 : 0.0;
        ball[i] = scene_add(&s, &settings);
        scene_sphere(&s, ball[i], 0.05, 0.25, 0.0);
    }
    scene_step(&s, h);
    assert_true(scene_rests(&s, box));
    assert_true(scene_rests(&s, ball[1]));
    scene_near(scene_state(&s, ball[0]).velocity[2], 3.0 - GRAVITY * h, 4.0 * EPSILON, "leaves");
    scene_close(&s);
}

/* A box over two lifts that rise with different speeds turns: its lower edges keep to them, exactly
 * as the contacts report it. In the plane; the lifts are 1 m apart. */
static void test_two_lifts(void **state)
{
    static const double speeds[2] = {0.125, 0.5};
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_body box;
    scene s;
    int i, count;

    (void)state;
    scene_open(&s, 1, 0.0, -GRAVITY, 0.0);
    for (i = 0; i < 2; i++) {
        perp_body lift;

        settings = scene_settings();
        settings.kind = PERP_BODY_KINEMATIC;
        settings.position[0] = i - 0.5;
        settings.position[1] = -0.25;
        settings.velocity[1] = speeds[i];
        lift = scene_add(&s, &settings);
        scene_sphere(&s, lift, 0.25, 1.0, 0.0);
    }
    settings = scene_settings();
    settings.mass = 3.0;
    settings.position[1] = 0.3;
    box = scene_add(&s, &settings);
    scene_box(&s, box, 0.7, 0.3, 1.0, 1.0, 0.0);
    scene_step(&s, 0.01);
    now = scene_state(&s, box);
    scene_near(now.angular_velocity[2], 0.375, 1e-9, "turns"); /* (0.5 - 0.125) / 1 m */
    scene_near(now.velocity[1], 0.3125, 1e-9, "rises");
    count = perp_world_contact_count(s.world);
    assert_int_equal(count, 2);
    for (i = 0; i < count; i++) {
        const perp_world_contact contact = scene_contact(&s, i);

        assert_true(contact.impulse[0] > 0.0);
        assert_true(contact.velocity[0] == 0.0);
    }
    scene_close(&s);
}

/* Balls of restitution 0.8 that fall on each other: what is told of a ball's velocity beside the
 * ground is that of the ball, 0.0 only where it holds. Impacts within the step change which
 * contacts are solved for. */
static void test_velocities_told(void **state)
{
    enum { BALLS = 3 };
    int touching = 0;

    (void)state;
    for (int run = 0; run < 60; run++) {
        perp_body balls[BALLS];
        scene s;

        scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.3, 0.0);
        for (int i = 0; i < BALLS; i++) {
            perp_body_settings settings = scene_settings();

            settings.mass = exp(sin(7.0 * i + run));
            settings.position[0] = 0.3 * sin(3.0 * i + 2.0 * run);
            settings.position[2] = 0.6 + 0.95 * i + 0.1 * sin(5.0 * run + i);
            settings.velocity[2] = -1.0 + sin(11.0 * i + run);
            balls[i] = scene_add(&s, &settings);
            scene_sphere(&s, balls[i], 0.4, 0.3, 0.8);
        }
        for (int k = 0; k < 100; k++) {
            scene_step(&s, 0.02);
            for (int32_t c = 0; c < perp_world_contact_count(s.world); c++) {
                const perp_world_contact contact = scene_contact(&s, c);
                const int plane = contact.body_a == s.ground   ? 1
                                  : contact.body_b == s.ground ? -1
                                                               : 0;
                double v;

                if (plane == 0)
                    continue;
                v = plane *
                    scene_state(&s, plane > 0 ? contact.body_b : contact.body_a).velocity[2];
                v *= contact.normal[2];
                touching++;
                /* a normal of an island that is solved to tol, 1e-10 */
                if (!(fabs(contact.velocity[0] - v) <= 1e-9 * (1.0 + fabs(v))))
                    fail_msg("run %d step %d: %g, not %g", run, k, contact.velocity[0], v);
            }
        }
        scene_close(&s);
    }
    assert_true(touching > 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sliding_askew),
        cmocka_unit_test(test_velocities_told),
        cmocka_unit_test(test_beside_what_leaves),
        cmocka_unit_test(test_two_lifts),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
