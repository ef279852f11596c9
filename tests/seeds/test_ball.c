/* A ball dropped from height 1 that bounces with restitution e: infinitely many impacts until
 * sqrt(2/g) (1+e)/(1-e), over a path of (1+e^2)/(1-e^2). A step of fixed size must bring it to
 * rest, not let it bounce at g h for ever. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

#define RADIUS 0.25

/* Below this share of g h an approach is rest (docs/world.md): half of one over the most impacts a
 * step. */
#define SLOW (1.0 / 64.0)

static perp_body drop(scene *s, double e, double height, double speed)
{
    perp_body_settings settings = scene_settings();
    perp_body ball;

    scene_open(s, 0, 0.0, 0.0, -GRAVITY);
    settings.position[2] = height + RADIUS;
    settings.velocity[2] = speed;
    ball = scene_add(s, &settings);
    scene_sphere(s, ball, RADIUS, 0.0, e);
    scene_plane(s, s->ground, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    return ball;
}

/* The ball of height 1 at time t: height and velocity, and the speed of the last impact. */
static double exact(double e, double t, double *v, double *speed)
{
    double flight = sqrt(2.0 / GRAVITY);

    *speed = sqrt(2.0 * GRAVITY);
    if (t < flight) {
        *v = -GRAVITY * t;
        return 1.0 - 0.5 * GRAVITY * t * t;
    }
    for (t -= flight; *speed > 1e-12; t -= flight) {
        flight = 2.0 * e * *speed / GRAVITY;
        if (t < flight)
            break;
        *speed *= e;
    }
    *v = e * *speed - GRAVITY * t;
    return t * (e * *speed - 0.5 * GRAVITY * t);
}

/* Impacts are where they are, so that the ball goes along its parabolas, bounce for bounce, until
 * bounces are too slow to tell from rest; and then it rests, exactly. Rounding of an impact's time
 * is amplified by no bounce. */
static void test_along_the_parabolas(void **state)
{
    static const double es[] = {0.5, 0.8, 0.9},
                        zeno[] = {1.3545709229571927, 4.0637127688715781, 8.5789491787288872};
    static const double hs[] = {0.01, 8e-3, 1e-3};
    size_t i, j;
    int k;

    (void)state;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++) {
            const double e = es[i], h = hs[j];
            double rest = 0.0;
            scene s;
            const perp_body ball = drop(&s, e, 1.0, 0.0);

            for (k = 1; k * h < zeno[i] + 0.5; k++) {
                perp_body_state now;
                double v, speed, z = exact(e, k * h, &v, &speed);

                scene_step(&s, h);
                now = scene_state(&s, ball);
                if (e * speed > 4.0 * SLOW * GRAVITY * h) {
                    scene_near(now.position[2] - RADIUS, z, 1e-10, "height");
                    /* within rounding of an impact either side is right */
                    if (fabs(fabs(v) - fabs(now.velocity[2])) > 1e-9 || z > 1e-9)
                        scene_near(now.velocity[2], v, 1e-9, "velocity");
                }
                if (rest > 0.0)
                    assert_true(scene_rests(&s, ball));
                else if (scene_rests(&s, ball))
                    rest = k * h;
            }
            /* what is left of Zeno's time from the slowest bounce, and the end of the step */
            scene_near(rest, zeno[i], h * (1.0 + 2.0 * SLOW / (1.0 - e)), "time of rest");
            scene_near(scene_state(&s, ball).position[2], RADIUS, EPSILON, "height at rest");
            scene_close(&s);
        }
}

/* e = 1 keeps its energy: 30 s of bounces. Rounding of an impact, some units of the energy of 1 m,
 * adds up over 33 of them. */
static void test_elastic(void **state)
{
    double kinetic, potential;
    scene s;

    (void)state;
    drop(&s, 1.0, 1.0, 0.0);
    scene_steps(&s, 3000, 0.01);
    SCENE_OK(&s, perp_world_energy(s.world, &kinetic, &potential));
    scene_near(kinetic + potential, GRAVITY * (1.0 + RADIUS), 1e-11, "energy");
    scene_close(&s);
}

/* One impact inside of a step: down with g, up with e times the speed, and g again. */
static void test_one_impact(void **state)
{
    const double h = 0.01, gap = 0.0078125, speed = 2.0, e = 0.5;
    const double down = sqrt(speed * speed + 2.0 * GRAVITY * gap), t = 2.0 * gap / (speed + down);
    perp_body_state now;
    scene s;
    const perp_body ball = drop(&s, e, gap, -speed);

    (void)state;
    scene_step(&s, h);
    now = scene_state(&s, ball);
    scene_near(now.velocity[2], e * down - GRAVITY * (h - t), 8.0 * EPSILON, "velocity");
    scene_near(now.position[2] - RADIUS, (h - t) * (e * down - 0.5 * GRAVITY * (h - t)),
               8.0 * EPSILON, "position");
    scene_near(scene_contact(&s, 0).impulse[0], (1.0 + e) * down, 16.0 * EPSILON, "impulse");
    scene_close(&s);
}

/* An approach slower than SLOW g h is resting contact; a faster one bounces. */
static void test_slow_approach_is_rest(void **state)
{
    const double h = 0.01, e = 0.5;
    int fast;

    (void)state;
    for (fast = 0; fast < 2; fast++) {
        const double speed = fast ? 3.0 * GRAVITY * h : 0.5 * SLOW * GRAVITY * h;
        scene s;
        const perp_body ball = drop(&s, e, 0.0, -speed);

        scene_step(&s, h);
        if (fast)
            scene_near(scene_state(&s, ball).velocity[2], e * speed - GRAVITY * h, 8.0 * EPSILON,
                       "bounce");
        else
            assert_true(scene_rests(&s, ball));
        scene_close(&s);
    }
}

/* e = 1 without gravity: a ball between two walls keeps its speed to the last bit. */
static void test_elastic_between_walls(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body ball;
    scene s;
    int k, turns = 0;
    double v = 1.0;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    settings.velocity[0] = 1.0;
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, RADIUS, 0.0, 1.0);
    scene_plane(&s, s.ground, 1.0, 0.0, 0.0, -1.0, 0.0, 1.0);
    scene_plane(&s, s.ground, -1.0, 0.0, 0.0, -1.0, 0.0, 1.0);
    for (k = 0; k < 1000; k++) {
        perp_body_state now;

        scene_step(&s, 0.01);
        now = scene_state(&s, ball);
        assert_true(fabs(now.velocity[0]) == 1.0);
        turns += now.velocity[0] != v;
        v = now.velocity[0];
    }
    assert_in_range(turns, 6, 7); /* 1.5 a crossing: first after 0.75 */
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_along_the_parabolas),
        cmocka_unit_test(test_elastic),
        cmocka_unit_test(test_one_impact),
        cmocka_unit_test(test_slow_approach_is_rest),
        cmocka_unit_test(test_elastic_between_walls),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
