/* Torque-free rotation of a body with principal moments (1, 2, 3). Reference: Jacobi's elliptic
 * functions for the angular velocity in the body frame, a Runge-Kutta solution of order 8 for the
 * orientation. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

static const double inertia[3] = {1.0, 2.0, 3.0};

static perp_body add_top(scene *s, double wx, double wy, double wz)
{
    perp_body_settings settings = scene_settings();
    int i;

    for (i = 0; i < 3; i++)
        settings.inertia[4 * i] = inertia[i];
    settings.angular_velocity[0] = wx;
    settings.angular_velocity[1] = wy;
    settings.angular_velocity[2] = wz;
    return scene_add(s, &settings);
}

/* x turned back by the body's orientation. */
static void to_body(const perp_body_state *state, const double *x, double *y)
{
    const double *q = state->orientation;
    double t[3];
    int i;

    /* R'x = x + 2 q_v x (q_v x x) - 2 w (q_v x x) */
    t[0] = 2.0 * (q[2] * x[2] - q[3] * x[1]);
    t[1] = 2.0 * (q[3] * x[0] - q[1] * x[2]);
    t[2] = 2.0 * (q[1] * x[1] - q[2] * x[0]);
    for (i = 0; i < 3; i++)
        y[i] = x[i] - q[0] * t[i];
    y[0] += q[2] * t[2] - q[3] * t[1];
    y[1] += q[3] * t[0] - q[1] * t[2];
    y[2] += q[1] * t[1] - q[2] * t[0];
}

/* Errors at t = 10 of the angular velocity and the orientation. */
static void errors_at_ten(int steps, double *w_error, double *q_error)
{
    static const double w_exact[3] = {-0.60347042309251813, -1.2789931385478724,
                                      0.88772678821573304};
    static const double q_exact[4] = {0.462545440555, -0.314335145145, 0.0494296312793,
                                      0.827527548484};
    perp_body_state state;
    perp_body top;
    scene s;
    double w[3], same = 0.0, opposite = 0.0;
    int i;

    scene_open(&s, 0, 0.0, 0.0, 0.0);
    top = add_top(&s, 1.0, 1.0, 1.0);
    scene_steps(&s, steps, 10.0 / steps);
    state = scene_state(&s, top);
    to_body(&state, state.angular_velocity, w);
    *w_error = 0.0;
    for (i = 0; i < 3; i++)
        *w_error = fmax(*w_error, fabs(w[i] - w_exact[i]));
    for (i = 0; i < 4; i++) {
        same = fmax(same, fabs(state.orientation[i] - q_exact[i]));
        opposite = fmax(opposite, fabs(state.orientation[i] + q_exact[i]));
    }
    *q_error = fmin(same, opposite); /* q and -q are one rotation */
    scene_close(&s);
}

/* Second order: halving the step divides the error by 4, to a tenth. */
static void test_second_order(void **state)
{
    double w[3], q[3];
    int i;

    (void)state;
    for (i = 0; i < 3; i++)
        errors_at_ten(500 << i, &w[i], &q[i]);
    for (i = 0; i < 2; i++) {
        scene_near(w[i] / w[i + 1], 4.0, 0.4, "error ratio of the angular velocity");
        scene_near(q[i] / q[i + 1], 4.0, 0.4, "error ratio of the orientation");
    }
    /* ten times the local constant h^2/12 max |w'''| < 10 h^2 over a time of 10 */
    scene_near(w[2], 0.0, 10.0 * 10.0 / 2000.0 / 2000.0 * 10.0, "omega(10)");
    scene_near(q[2], 0.0, 10.0 * 10.0 / 2000.0 / 2000.0 * 10.0, "orientation at 10");
}

/* The midpoint rule conserves quadratic invariants, and the orientation is aligned with the angular
 * momentum: what is left is rounding, which may add up over the steps. */
static void conserved(double wx, double wy, double wz, double h, int steps)
{
    double kinetic, potential, before, L[3], L0[3], bound = steps * 16.0 * EPSILON;
    scene s;
    int i;

    scene_open(&s, 0, 0.0, 0.0, 0.0);
    add_top(&s, wx, wy, wz);
    SCENE_OK(&s, perp_world_energy(s.world, &before, NULL));
    SCENE_OK(&s, perp_world_momentum(s.world, NULL, L0));
    scene_steps(&s, steps, h);
    SCENE_OK(&s, perp_world_energy(s.world, &kinetic, &potential));
    SCENE_OK(&s, perp_world_momentum(s.world, NULL, L));
    scene_near(kinetic / before, 1.0, bound, "energy");
    for (i = 0; i < 3; i++)
        scene_near(L[i], L0[i], bound * sqrt(scene_dot(L0, L0)), "angular momentum");
    scene_close(&s);
}

static void test_conserves_energy_and_momentum(void **state)
{
    (void)state;
    conserved(1.0, 1.0, 1.0, 0.01, 10000);
    conserved(1e-3, 1.0, 0.0, 0.01, 6000); /* tumbles about the middle axis */
    conserved(1.0, 1.0, 1.0, 0.5, 1000);   /* coarse steps */
    conserved(1e-9, 2e-9, 1e-9, 1e6, 1000);
    conserved(100.0, 20.0, -30.0, 1e-3, 1000);
}

/* From (1e-3, 1, 0), |L|^2 < 2 T I_2: w_1 keeps its sign, and after half the period of 57.46... w_2
 * is reversed. */
static void test_tumbling_period(void **state)
{
    const double half_period = 0.5 * 57.462848874962667;
    const int steps = 20000;
    perp_body_state now;
    perp_body top;
    scene s;
    double w[3];

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    top = add_top(&s, 1e-3, 1.0, 0.0);
    scene_steps(&s, steps, half_period / steps);
    now = scene_state(&s, top);
    to_body(&now, now.angular_velocity, w);
    /* the phase is off by (h^2/12) times the time, the slope at the turn is 1e-3 */
    scene_near(w[1], -1.0, 1e-5, "reversed spin");
    scene_near(w[0], 1e-3, 1e-5, "small component");
    scene_close(&s);
}

/* A constant force moves what nothing touches exactly: x = v t + g t^2 / 2, up to rounding. */
static void test_free_fall_is_exact(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    settings.velocity[0] = 3.0;
    settings.velocity[2] = 20.0;
    body = scene_add(&s, &settings);
    scene_push(&s, body, 0.0, 2.0, 0.0);
    scene_steps(&s, 100, 0.01);
    now = scene_state(&s, body);
    scene_near(now.position[0], 3.0, 100.0 * EPSILON * 3.0, "x(1)");
    scene_near(now.position[1], 1.0, 100.0 * EPSILON * 2.0, "y(1)");
    scene_near(now.position[2], 20.0 - 0.5 * GRAVITY, 100.0 * EPSILON * 20.0, "z(1)");
    scene_close(&s);
}

/* A torque about a principal axis: the angle is torque t^2 / (2 I), which the mean velocity has
 * exactly, spherical inertia or not; and in the plane. */
static void test_constant_torque(void **state)
{
    int variant;

    (void)state;
    for (variant = 0; variant < 3; variant++) {
        perp_body_settings settings = scene_settings();
        perp_body_state now;
        perp_body body;
        scene s;

        scene_open(&s, variant == 2, 0.0, 0.0, 0.0);
        settings.inertia[8] = variant == 1 ? 1.5 : 1.0;
        body = scene_add(&s, &settings);
        now = scene_state(&s, body);
        now.torque[2] = 0.5;
        SCENE_OK(&s, perp_world_set_body(s.world, &now, body));
        scene_steps(&s, 100, 0.01);
        now = scene_state(&s, body);
        scene_near(now.angular_velocity[2], 0.5 / settings.inertia[8], 1e-14, "spin");
        scene_near(2.0 * atan2(now.orientation[3], now.orientation[0]), 0.25 / settings.inertia[8],
                   1e-14, "angle");
        scene_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_second_order),
        cmocka_unit_test(test_conserves_energy_and_momentum),
        cmocka_unit_test(test_tumbling_period),
        cmocka_unit_test(test_free_fall_is_exact),
        cmocka_unit_test(test_constant_torque),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
