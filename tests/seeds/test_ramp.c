/* A brick on a slope (the standard example of Stewart & Trinkle): m = 1, theta = 10 degrees,
 * mu = 0.3, v0 = 2,
 *
 *   m v' in m g sin theta + F - mu m g cos theta Sgn v.
 *
 * Reference values are closed forms: arcs of parabolas that end when v = 0. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "world/scene.h"

#define THETA (PI / 18.0)
#define MU 0.3

static const double half[3] = {0.1, 0.1, 0.1};

typedef struct slope {
    scene scene;
    perp_body brick;
    int32_t planar;
    double down[3];
    double start[3];
} slope;

static void open_slope(slope *s, int32_t planar, double theta, double mu, double gravity,
                       double speed)
{
    perp_body_state state;
    int i;

    scene_open(&s->scene, planar, 0.0, planar ? -gravity : 0.0, planar ? 0.0 : -gravity);
    s->brick = scene_box_on_slope(&s->scene, planar, theta, 1.0, half, mu, speed);
    s->planar = planar;
    s->down[0] = cos(theta);
    s->down[1] = planar ? -sin(theta) : 0.0;
    s->down[2] = planar ? 0.0 : -sin(theta);
    state = scene_state(&s->scene, s->brick);
    for (i = 0; i < 3; i++)
        s->start[i] = state.position[i];
}

static double speed_of(slope *s)
{
    perp_body_state state = scene_state(&s->scene, s->brick);

    return scene_dot(state.velocity, s->down);
}

static double path_of(slope *s)
{
    perp_body_state state = scene_state(&s->scene, s->brick);
    double moved[3];
    int i;

    for (i = 0; i < 3; i++)
        moved[i] = state.position[i] - s->start[i];
    return scene_dot(moved, s->down);
}

static void push(slope *s, double force)
{
    scene_push(&s->scene, s->brick, force * s->down[0], force * s->down[1], force * s->down[2]);
}

/* R1. The implicit step is v+ = max(0, v - h a), x+ = x + h v+ in exact arithmetic, so position and
 * step of the stop are known; from there on the velocity is 0.0, to the last bit. */
static void stops_where_exact_arithmetic_does(int32_t planar, double h, double x_stop,
                                              int first_zero, int steps)
{
    slope s;
    int k;

    open_slope(&s, planar, THETA, MU, GRAVITY, 2.0);
    for (k = 1; k <= steps; k++) {
        scene_step(&s.scene, h);
        if (scene_rests(&s.scene, s.brick) != (k >= first_zero))
            fail_msg("step %d of h = %g: speed %g", k, h, speed_of(&s));
    }
    /* each of k steps rounds x and v by a few units of 1: 4 k eps */
    scene_near(path_of(&s), x_stop, 4.0 * first_zero * EPSILON * 2.0, "x_stop");
    scene_close(&s.scene);
}

static void test_stops_in_the_plane(void **state)
{
    (void)state;
    stops_where_exact_arithmetic_does(1, 0.1, 1.5750711918848154, 17, 200);
    stops_where_exact_arithmetic_does(1, 0.01, 1.6639337264529552, 168, 2000);
    stops_where_exact_arithmetic_does(1, 0.001, 1.6729195331378669, 1674, 4000);
}

static void test_stops_in_space(void **state)
{
    (void)state;
    stops_where_exact_arithmetic_does(0, 0.1, 1.5750711918848154, 17, 200);
    stops_where_exact_arithmetic_does(0, 0.01, 1.6639337264529552, 168, 1000);
    stops_where_exact_arithmetic_does(0, 0.001, 1.6729195331378669, 1674, 2500);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stops_in_the_plane),
        cmocka_unit_test(test_stops_in_space),
    };

    (void)push;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
