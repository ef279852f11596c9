/* Simultaneous impacts: chains of touching balls, and a block that rocks from one corner to the
 * other. With Moreau's law a chain of n equal balls (1, 0, .., 0) leaves with
 * v_1 = (1 + e)/n - e and (1 + e)/n for the others. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

#define MOST 10

/* Balls of radius 1/2 in a row, touching, the first with speed 1; one step, to rounding whatever
 * the number of balls. */
static void hit_chain(int n, const double *masses, double e, double mu, double *v)
{
    perp_world_settings world;
    perp_body bodies[MOST];
    scene s;
    int i;

    assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
    world.gravity[2] = 0.0;
    world.accuracy = PERP_ACCURACY_EXACT;
    scene_create(&s, &world);
    for (i = 0; i < n; i++) {
        perp_body_settings settings = scene_settings();

        settings.mass = masses ? masses[i] : 1.0;
        settings.position[0] = i;
        settings.velocity[0] = i == 0 ? 1.0 : 0.0;
        bodies[i] = scene_add(&s, &settings);
        scene_sphere(&s, bodies[i], 0.5, mu, e);
    }
    scene_step(&s, 0.01);
    for (i = 0; i < n; i++) {
        perp_body_state now = scene_state(&s, bodies[i]);

        v[i] = now.velocity[0];
        assert_true(now.velocity[1] == 0.0 && now.velocity[2] == 0.0);
    }
    scene_close(&s);
}

/* Units of rounding of a number near 1 through a chain of n. */
static double rounding(int n)
{
    return 8.0 * n * EPSILON;
}

static void test_chains(void **state)
{
    static const int lengths[] = {2, 3, 5, 10};
    static const double restitutions[] = {0.0, 0.25, 0.5, 1.0};
    size_t i, j;

    (void)state;
    for (i = 0; i < sizeof lengths / sizeof *lengths; i++)
        for (j = 0; j < sizeof restitutions / sizeof *restitutions; j++) {
            int n = lengths[i], k;
            double e = restitutions[j], v[MOST];

            hit_chain(n, NULL, e, j % 2 ? 0.3 : 0.0, v);
            scene_near(v[0], (1.0 + e) / n - e, rounding(n), "first ball");
            for (k = 1; k < n; k++)
                scene_near(v[k], (1.0 + e) / n, rounding(n), "other balls");
        }
}

/* Masses 1 and 3, e = 1/2: (-1/8, 3/8). */
static void test_unequal_masses(void **state)
{
    const double masses[2] = {1.0, 3.0};
    double v[2];

    (void)state;
    hit_chain(2, masses, 0.5, 0.0, v);
    scene_near(v[0], -0.125, rounding(2), "light ball");
    scene_near(v[1], 0.375, rounding(2), "heavy ball");
}

/* Momentum stays, and energy does not grow, in chains of masses from 1 to 1e8. */
static void test_momentum_and_energy(void **state)
{
    const double masses[5] = {1.0, 1e4, 1e-4, 1e4, 1.0};
    double v[5], momentum = 0.0, energy = 0.0;
    int i;

    (void)state;
    hit_chain(5, masses, 0.7, 0.0, v);
    for (i = 0; i < 5; i++) {
        momentum += masses[i] * v[i];
        energy += 0.5 * masses[i] * v[i] * v[i];
        if (i > 0) /* no ball runs into the next */
            assert_true(v[i] - v[i - 1] >= -64.0 * EPSILON);
    }
    /* impulses of size 1 through links of mass ratio 1e8: rounding of velocities near 1e-4 times
     * masses of 1e4 */
    scene_near(momentum, 1.0, 64.0 * EPSILON * 1e2, "momentum");
    assert_true(energy <= 0.5 * (1.0 + 64.0 * EPSILON));
}

/* Once separated the balls fly on as they are, to the last bit. */
static void test_after_the_impact(void **state)
{
    perp_body a, b;
    perp_body_settings settings = scene_settings();
    perp_step_result result;
    double va = 0.0, vb = 0.0;
    scene s;
    int k;

    (void)state;
    scene_open(&s, 1, 0.0, 0.0, 0.0);
    settings.velocity[0] = 1.0;
    a = scene_add(&s, &settings);
    settings.position[0] = 1.0;
    settings.velocity[0] = 0.0;
    b = scene_add(&s, &settings);
    scene_sphere(&s, a, 0.5, 0.0, 1.0);
    scene_sphere(&s, b, 0.5, 0.0, 1.0);
    for (k = 0; k < 10; k++) {
        result = scene_step(&s, 0.125);
        assert_int_equal(result.islands, k == 0);
        if (k == 0) {
            va = scene_state(&s, a).velocity[0];
            vb = scene_state(&s, b).velocity[0];
        }
        assert_true(scene_state(&s, a).velocity[0] == va);
        assert_true(scene_state(&s, b).velocity[0] == vb);
    }
    scene_near(va, 0.0, rounding(2), "ball that hit");
    scene_near(vb, 1.0, rounding(2), "ball that was hit");
    scene_close(&s);
}

/* A block (half width b, half height h) lands flat on its second corner while turning about the
 * first: Housner's ratio omega+/omega- = 1 - 3/2 sin^2 alpha, tan alpha = b/h, is the solution of
 * the impact problem; from b/h = sqrt 2 on the block stops dead. */
static double rock(double b, double h, double mu)
{
    const double omega = 1.0;
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_body block;
    scene s;

    scene_open(&s, 1, 0.0, 0.0, 0.0);
    settings.inertia[8] = (b * b + h * h) / 3.0;
    settings.position[1] = h;
    settings.velocity[0] = omega * h; /* turns about (-b, 0), downwards on the right */
    settings.velocity[1] = -omega * b;
    settings.angular_velocity[2] = -omega;
    block = scene_add(&s, &settings);
    scene_box(&s, block, b, h, 0.0, mu, 0.0);
    scene_plane(&s, s.ground, 0.0, 1.0, 0.0, 0.0, mu, 0.0);
    scene_step(&s, 1e-3);
    now = scene_state(&s, block);
    if (now.angular_velocity[2] != 0.0) {
        /* turns about (b, 0) now, which stays where it is */
        scene_near(now.velocity[0], -now.angular_velocity[2] * h, 8.0 * EPSILON, "corner, x");
        scene_near(now.velocity[1], -now.angular_velocity[2] * b, 8.0 * EPSILON, "corner, y");
    } else {
        assert_true(scene_rests(&s, block));
    }
    scene_close(&s);
    return now.angular_velocity[2] / -omega;
}

static void test_rocking_block(void **state)
{
    (void)state;
    scene_near(rock(0.2, 1.0, 0.2), 0.94230769230769231, 32.0 * EPSILON, "b/h = 0.2");
    scene_near(rock(0.5, 1.0, 0.4), 0.7, 32.0 * EPSILON, "b/h = 0.5");
    scene_near(rock(1.0, 1.0, 0.7), 0.25, 32.0 * EPSILON, "b/h = 1");
    assert_true(rock(1.5, 1.0, 1.5) == 0.0);
    assert_true(rock(1.42, 1.0, 1.5) == 0.0);
}

/* Free rocking from alpha/2, b = 0.1, h = 0.5: the first impact comes at 0.347..., omega drops from
 * 0.648... to 0.610.... The step is first order in h: bounds h times a few of the rates g and 1. */
static void test_rocking_from_a_tilt(void **state)
{
    const double b = 0.1, h = 0.5, dt = 1e-4, tilt = 0.5 * atan(b / h);
    perp_body_settings settings = scene_settings();
    double before = 0.0, after = 0.0, time = 0.0;
    perp_body block;
    scene s;
    int k;

    (void)state;
    scene_open(&s, 1, 0.0, -GRAVITY, 0.0);
    settings.inertia[8] = (b * b + h * h) / 3.0;
    settings.angle = -tilt; /* stands on its right corner, at the origin */
    settings.position[0] = -b * cos(tilt) + h * sin(tilt);
    settings.position[1] = b * sin(tilt) + h * cos(tilt);
    block = scene_add(&s, &settings);
    scene_box(&s, block, b, h, 0.0, 0.5, 0.0);
    scene_plane(&s, s.ground, 0.0, 1.0, 0.0, 0.0, 0.5, 0.0);
    for (k = 1; k < 5000 && time == 0.0; k++) {
        double w;

        scene_step(&s, dt);
        w = scene_state(&s, block).angular_velocity[2];
        if (w < before) {
            time = k * dt;
            scene_step(&s,
                       dt); /* the gap closes in one step, the other corner leaves in the next */
            after = scene_state(&s, block).angular_velocity[2];
        } else {
            before = w;
        }
    }
    /* omega changes at 2.8 a second: by that times dt in the step of the impact, and its
     * first-order error is of that size; the impact takes two steps more */
    scene_near(time, 0.34709358678888131, 3.0 * dt, "time of the first impact");
    scene_near(before, 0.64804901226753231, 3.0 * dt, "omega before");
    scene_near(after, 0.61066156925209775, 3.0 * 3.0 * dt, "omega after");
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chains),
        cmocka_unit_test(test_unequal_masses),
        cmocka_unit_test(test_momentum_and_energy),
        cmocka_unit_test(test_after_the_impact),
        cmocka_unit_test(test_rocking_block),
        cmocka_unit_test(test_rocking_from_a_tilt),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
