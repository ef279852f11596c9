/* A ball dropped from height 1 that bounces with restitution e: infinitely many impacts until
 * sqrt(2/g) (1+e)/(1-e), over a path of (1+e^2)/(1-e^2). A step of fixed size must bring it to
 * rest, not let it bounce at g h for ever. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "world/scene.h"

#define RADIUS 0.25

typedef struct bounce {
    double rest_time; /* of the first velocity 0.0, which must last */
    double path;      /* sum of |dz| */
    double first_impact;
    double rest_height; /* above the ground */
    int impacts;
} bounce;

static bounce drop(double e, double h)
{
    perp_body_settings settings = scene_settings();
    double z = 1.0 + RADIUS, v = 0.0;
    bounce b = {0.0, 0.0, 0.0, 0.0, 0};
    perp_body ball;
    scene s;
    int k, steps = (int)(12.0 / h);

    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    settings.position[2] = z;
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, RADIUS, 0.0, e);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    for (k = 1; k <= steps; k++) {
        perp_body_state now;

        scene_step(&s, h);
        now = scene_state(&s, ball);
        b.path += fabs(now.position[2] - z);
        if (v < 0.0 && now.velocity[2] > 0.0) {
            b.impacts++;
            if (b.first_impact == 0.0)
                b.first_impact = k * h;
        }
        z = now.position[2];
        v = now.velocity[2];
        if (b.rest_time > 0.0)
            assert_true(scene_rests(&s, ball));
        else if (scene_rests(&s, ball))
            b.rest_time = k * h;
    }
    b.rest_height = z - RADIUS;
    scene_close(&s);
    return b;
}

typedef struct reference {
    double e, zeno_time, path;
} reference;

static const reference references[] = {
    {0.5, 1.3545709229571927, 1.6666666666666667},
    {0.8, 4.0637127688715781, 4.5555555555555556},
    {0.9, 8.5789491787288872, 9.5263157894736842},
};

/* Within the step of an impact neither its time nor gravity's share of the velocity is resolved: an
 * error of h and g h (1 + e) an impact, which the flights after it repeat e, e^2, .. times, a
 * flight lasting 2 v / g: in all h (3 + 2 e) / (1 - e) an impact, and in the path that times the
 * largest speed, sqrt(2 g). */
static void check_errors(const reference *expected, double h, double *time_error,
                         double *path_error)
{
    bounce b = drop(expected->e, h);
    double bound = b.impacts * h * (3.0 + 2.0 * expected->e) / (1.0 - expected->e);

    *time_error = fabs(b.rest_time - expected->zeno_time);
    *path_error = fabs(b.path - expected->path);
    assert_true(b.rest_time > 0.0);
    scene_near(b.rest_time, expected->zeno_time, bound, "time of rest");
    scene_near(b.path, expected->path, bound * sqrt(2.0 * GRAVITY), "path");
    scene_near(b.first_impact, 0.4515236409857309, h, "first impact");
    /* z = 0.25 + a rounding error at most */
    scene_near(b.rest_height, 0.0, EPSILON, "height at rest");
}

/* The number of impacts grows with log(1/h), so errors fall like h log(1/h): order 0.84 between
 * these two steps if the constant is one, and first order as h goes to 0. */
static void test_comes_to_rest(void **state)
{
    const double h[2] = {8e-3, 2.5e-4};
    size_t i;

    (void)state;
    for (i = 0; i < sizeof references / sizeof *references; i++) {
        double time[2], path[2];
        int k;

        for (k = 0; k < 2; k++)
            check_errors(&references[i], h[k], &time[k], &path[k]);
        assert_true(log(time[0] / time[1]) / log(h[0] / h[1]) > 0.75);
        assert_true(log(path[0] / path[1]) / log(h[0] / h[1]) > 0.75);
    }
}

/* One impact: the ball ends its step on the ground, with -e times the velocity it came with. */
static void test_one_impact(void **state)
{
    const double h = 0.01;
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_world_contact contact;
    perp_body ball;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    settings.position[2] = RADIUS + 0.0078125;
    settings.velocity[2] = -2.0;
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, RADIUS, 0.0, 0.5);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    scene_step(&s, h);
    now = scene_state(&s, ball);
    assert_true(now.velocity[2] == 1.0);
    scene_near(now.position[2], RADIUS, EPSILON, "position");
    contact = scene_contact(&s, 0);
    assert_true(contact.velocity[0] == 1.0);
    scene_near(contact.impulse[0], 3.0 + GRAVITY * h, 4.0 * EPSILON * 3.0, "impulse");
    scene_close(&s);
}

/* An approach that gravity explains within a step, u_n- > -g h, is resting contact; a faster one
 * bounces. */
static void test_slow_approach_is_rest(void **state)
{
    const double h = 0.01;
    int fast;

    (void)state;
    for (fast = 0; fast < 2; fast++) {
        perp_body_settings settings = scene_settings();
        perp_body ball;
        scene s;

        scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
        settings.position[2] = RADIUS;
        settings.velocity[2] = (fast ? -1.5 : -0.5) * GRAVITY * h;
        ball = scene_add(&s, &settings);
        scene_sphere(&s, ball, RADIUS, 0.0, 0.5);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
        scene_step(&s, h);
        if (fast)
            assert_true(scene_state(&s, ball).velocity[2] == -0.5 * settings.velocity[2]);
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
        cmocka_unit_test(test_comes_to_rest),
        cmocka_unit_test(test_one_impact),
        cmocka_unit_test(test_slow_approach_is_rest),
        cmocka_unit_test(test_elastic_between_walls),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
