/* From sliding to rolling: a body of revolution thrown with v0 and kappa = I / (m r^2) rolls at
 * v0 / (1 + kappa) after t = kappa v0 / ((1 + kappa) mu g). */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

#define MU 0.2
#define SPEED 7.0

typedef struct round_body {
    const char *name;
    double kappa, ratio, time, path;
} round_body;

static const round_body bodies[] = {
    {"ball", 2.0 / 5.0, 0.71428571428571429, 1.0193679918450561, 6.1162079510703364},
    {"disc", 1.0 / 2.0, 0.66666666666666667, 1.1892626571525654, 6.9373655000566316},
    {"hoop", 1.0, 0.5, 1.7838939857288481, 9.3654434250764526},
    {"shell", 2.0 / 3.0, 0.6, 1.4271151885830785, 7.9918450560652396},
};

/* A round body of radius 1/2 and mass 2 on flat ground, thrown along +x; spin about the axis that
 * rolls it forward counts as positive. */
static perp_body throw_body(scene *s, int32_t planar, double kappa, double v, double spin)
{
    const double mass = 2.0, radius = 0.5;
    perp_body_settings settings = scene_settings();
    perp_body body;
    int up = planar ? 1 : 2;

    scene_open(s, planar, 0.0, planar ? -GRAVITY : 0.0, planar ? 0.0 : -GRAVITY);
    settings.mass = mass;
    settings.inertia[0] = settings.inertia[4] = settings.inertia[8] =
        kappa * mass * radius * radius;
    settings.position[up] = radius;
    settings.velocity[0] = v;
    settings.angular_velocity[planar ? 2 : 1] = planar ? -spin : spin;
    body = scene_add(s, &settings);
    scene_sphere(s, body, radius, MU, 0.0);
    scene_plane(s, s->ground, 0.0, planar ? 1.0 : 0.0, planar ? 0.0 : 1.0, 0.0, MU, 0.0);
    return body;
}

/* Steps until the contact sticks; returns the time. */
static double run_until_rolling(scene *s, double h)
{
    int k;

    for (k = 1; k < 10000; k++) {
        perp_world_contact contact;

        scene_step(s, h);
        assert_int_equal(perp_world_contact_count(s->world), 1);
        contact = scene_contact(s, 0);
        if (contact.mode == PERP_CONTACT_STICK) {
            assert_true(contact.velocity[1] == 0.0 && contact.velocity[2] == 0.0);
            return k * h;
        }
    }
    fail_msg("never rolls");
    return 0.0;
}

/* Velocities are exact whatever h, since friction is constant and the last step ends at rolling;
 * rounding of some 1000 steps. The path is first order: h/2 times the change of velocity. */
static void test_rolls_off(void **state)
{
    const double h = 1e-3, rounding = 2000.0 * EPSILON * SPEED;
    size_t i;

    (void)state;
    for (i = 0; i < 2 * sizeof bodies / sizeof *bodies; i++) {
        const round_body *expected = &bodies[i / 2];
        int32_t planar = i % 2;
        perp_body_state now;
        perp_body body;
        scene s;
        double time;

        body = throw_body(&s, planar, expected->kappa, SPEED, 0.0);
        time = run_until_rolling(&s, h);
        now = scene_state(&s, body);
        scene_near(time, expected->time, h, "time");
        scene_near(now.velocity[0], expected->ratio * SPEED, rounding, expected->name);
        scene_near(fabs(now.angular_velocity[planar ? 2 : 1]) * 0.5, expected->ratio * SPEED,
                   rounding, "spin");
        scene_near(now.position[0], expected->path, h * SPEED, "path");
        scene_step(&s, h);
        now = scene_state(&s, body);
        scene_near(now.velocity[0], expected->ratio * SPEED, rounding, "goes on rolling");
        scene_close(&s);
    }
}

/* Backspin r w0 = -20 sends the ball back: v = -5/7. */
static void test_backspin(void **state)
{
    perp_body body;
    scene s;

    (void)state;
    body = throw_body(&s, 0, 0.4, SPEED, -40.0);
    run_until_rolling(&s, 1e-3);
    scene_near(scene_state(&s, body).velocity[0], -5.0 / 7.0, 1e-11, "backspin");
    scene_close(&s);
}

/* On a slope of 30 degrees a ball rolls without slip iff mu >= 0.1649572197684645, with
 * a = 3.5035714285714286; implicit Euler has v = a t exactly. */
static void on_a_slope(double mu, int32_t mode, double acceleration)
{
    const double theta = PI / 6.0, h = 0.01;
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_body ball;
    scene s;
    int k;

    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    settings.inertia[0] = settings.inertia[4] = settings.inertia[8] = 0.4;
    settings.position[0] = sin(theta);
    settings.position[2] = cos(theta);
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, 1.0, mu, 0.0);
    scene_plane(&s, s.ground, sin(theta), 0.0, cos(theta), 0.0, mu, 0.0);
    for (k = 0; k < 100; k++) {
        scene_step(&s, h);
        assert_int_equal(scene_contact(&s, 0).mode, mode);
    }
    now = scene_state(&s, ball);
    scene_near(sqrt(scene_dot(now.velocity, now.velocity)), acceleration, 100.0 * EPSILON * 16.0,
               "v(1)");
    scene_close(&s);
}

static void test_rolls_down_a_slope(void **state)
{
    const double least = 0.1649572197684645;
    const double slipping = least * (1.0 - 1e-9);

    (void)state;
    on_a_slope(0.5, PERP_CONTACT_STICK, 3.5035714285714286);
    on_a_slope(least * (1.0 + 1e-9), PERP_CONTACT_STICK, 3.5035714285714286);
    on_a_slope(slipping, PERP_CONTACT_SLIP, GRAVITY * (sin(PI / 6.0) - slipping * cos(PI / 6.0)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rolls_off),
        cmocka_unit_test(test_backspin),
        cmocka_unit_test(test_rolls_down_a_slope),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
