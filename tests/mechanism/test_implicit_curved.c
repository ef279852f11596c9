/* Implicit steps where things turn or change within the step: a bead that slides in a bowl, walls
 * and bounds of the step's end, a stiff spring. */
#include "asked.h"

#define GRAVITY 9.81

/* ---- a bead in the bowl z = (x^2 + y^2) / 2 ------------------------------------------------- */

static int32_t bead_force(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)q;
    (void)v;
    (void)user;
    k[2] = -GRAVITY;
    return 0;
}

static int32_t bead_contact(double *gap, double *H, double *drift, double *mu, double t,
                            const double *q, void *user)
{
    const double x = q[0], y = q[1], s = sqrt(1 + x * x + y * y), l = sqrt(1 + x * x);

    (void)drift;
    (void)mu;
    (void)t;
    (void)user;
    gap[0] = (q[2] - (x * x + y * y) / 2) / s; /* not 0 off the bowl only to first order */
    H[0] = -x / s;
    H[1] = -y / s;
    H[2] = 1 / s;
    H[3] = 1 / l; /* along x in the bowl */
    H[5] = x / l;
    H[6] = H[1] * H[5]; /* normal x tangent */
    H[7] = H[2] * H[3] - H[0] * H[5];
    H[8] = -H[1] * H[3];
    return 0;
}

/* The motion in the plane's coordinates while it slides: with f = z - (x^2 + y^2) / 2 = 0,
 * grad f q'' = vx^2 + vy^2, so that N = (vx^2 + vy^2 + g) / s. */
static void bead_rate(double *rate, const double *state, double mu)
{
    const double x = state[0], y = state[1], *v = state + 3, s = sqrt(1 + x * x + y * y);
    const double N = (v[0] * v[0] + v[1] * v[1] + GRAVITY) / s;
    const double speed = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);

    rate[0] = v[0];
    rate[1] = v[1];
    rate[2] = v[2];
    rate[3] = -N * x / s - mu * N * v[0] / speed;
    rate[4] = -N * y / s - mu * N * v[1] / speed;
    rate[5] = N / s - GRAVITY - mu * N * v[2] / speed;
}

/* Runge-Kutta of order 4. */
static void bead_reference(double *state, double mu, double time, int steps)
{
    const double h = time / steps, weights[] = {0, 0.5, 0.5, 1};
    int i, j, k;

    for (i = 0; i < steps; i++) {
        double rates[4][6], at[6];

        for (k = 0; k < 4; k++) {
            for (j = 0; j < 6; j++)
                at[j] = state[j] + (k > 0 ? h * weights[k] * rates[k - 1][j] : 0);
            bead_rate(rates[k], at, mu);
        }
        for (j = 0; j < 6; j++)
            state[j] += h / 6 * (rates[0][j] + 2 * rates[1][j] + 2 * rates[2][j] + rates[3][j]);
    }
}

static const double bead_q[3] = {1, 0, 0.5}, bead_v[3] = {0, 2, 0};

/* Error of q and v at 0.5 s. */
static double bead_error(int32_t scheme, double mu, int32_t cone, int32_t project, int steps,
                         double *leaves)
{
    const double h = 0.5 / steps;
    double state[6], q[3], v[3], impulse[3], error = 0;
    int32_t modes[1];
    asked a;
    int i;

    asked_begin(&a, 3, scheme);
    a.settings.cone = cone;
    a.settings.project = project;
    a.model.contacts = 1;
    a.model.dim = 3;
    a.model.mu = &mu;
    a.model.force = bead_force;
    a.model.contact_rows = bead_contact;
    asked_make(&a);
    memcpy(q, bead_q, sizeof q);
    memcpy(v, bead_v, sizeof v);
    memcpy(state, bead_q, sizeof q);
    memcpy(state + 3, bead_v, sizeof v);
    *leaves = 0;
    for (i = 0; i < steps; i++) {
        asked_step(&a, q, v, impulse, modes, i * h, h);
        *leaves = fmax(*leaves, fabs(q[2] - (q[0] * q[0] + q[1] * q[1]) / 2));
    }
    bead_reference(state, mu, 0.5, 2000); /* error 1e-13: h^4 */
    for (i = 0; i < 3; i++)
        error = fmax(error, fmax(fabs(q[i] - state[i]), fabs(v[i] - state[3 + i])));
    asked_end(&a);
    return error;
}

static void test_bead(void **state)
{
    double errors[3], leaves;
    int k, project;

    (void)state;
    for (project = 0; project < 2; project++) {
        for (k = 0; k < 3; k++) {
            errors[k] = bead_error(PERP_MECHANISM_IMPLICIT, 0.2, 0, project, 50 << k, &leaves);
            near(leaves, 0, 1e-14, "distance from the bowl"); /* of places of 1: some eps */
        }
        near(log2(errors[0] / errors[1]), 1, 0.15, "order");
        near(log2(errors[1] / errors[2]), 1, 0.1, "order");
    }
    bead_error(PERP_MECHANISM_FROZEN, 0.2, 0, 0, 50, &leaves);
    assert_true(leaves > 1e-4); /* h^2 v^2 / 2 and more */
}

/* theta has order 2 here, with friction too, whose slip turns: it acts against the mean slip. */
static void test_bead_theta(void **state)
{
    double errors[2][2], leaves;
    int k, rough;

    (void)state;
    for (rough = 0; rough < 2; rough++) {
        for (k = 0; k < 2; k++)
            errors[rough][k] =
                bead_error(PERP_MECHANISM_THETA, 0.2 * rough, 0, 1, 50 << k, &leaves);
        near(log2(errors[rough][0] / errors[rough][1]), 2, 0.1, "order of theta");
    }
    /* beside implicit steps, whose geometry is that of the end, too */
    assert_true(errors[1][0] < 0.5 * bead_error(PERP_MECHANISM_IMPLICIT, 0.2, 0, 1, 50, &leaves));
}

/* A polygon of k edges turns the force by up to pi / k and weakens it by cos(pi / k). */
static void test_bead_polygon(void **state)
{
    double leaves, exact = bead_error(PERP_MECHANISM_IMPLICIT, 0.2, 0, 1, 400, &leaves), error;
    int k;

    (void)state;
    for (k = 8; k <= 64; k *= 2) {
        error = bead_error(PERP_MECHANISM_IMPLICIT, 0.2, k, 1, 400, &leaves);
        /* mu g t pi / k of sideways speed, and what the step makes */
        near(error, 0, exact + 0.2 * GRAVITY * 0.5 * 3.2 / k, "error with a polygon");
    }
}

/* Steep friction: the bead comes to rest on the slope, to the last bit, and stays. */
static void test_bead_rest(void **state)
{
    const double mu = 0.9; /* > tan of the slope: r < 0.9 */
    double q[3] = {0.5, 0, 0.125}, v[3] = {0, 1, 0}, impulse[3], kept[3] = {0};
    int32_t modes[1];
    asked a;
    int i, rests = 0;

    (void)state;
    asked_begin(&a, 3, PERP_MECHANISM_IMPLICIT);
    a.model.contacts = 1;
    a.model.dim = 3;
    a.model.mu = &mu;
    a.model.force = bead_force;
    a.model.contact_rows = bead_contact;
    asked_make(&a);
    for (i = 0; i < 200; i++) {
        asked_step(&a, q, v, impulse, modes, i * 0.01, 0.01);
        if (rests) {
            assert_true(v[0] == 0.0 && v[1] == 0.0 && v[2] == 0.0);
            assert_memory_equal(q, kept, sizeof q);
            assert_int_equal(modes[0], PERP_MECHANISM_STICK);
            assert_true(hypot(impulse[1], impulse[2]) < mu * impulse[0]);
        } else if (v[0] == 0.0 && v[1] == 0.0 && v[2] == 0.0) {
            rests = i;
            memcpy(kept, q, sizeof q);
        }
    }
    assert_in_range(rests, 5, 50); /* v / (g (mu cos - sin)) < 0.5 s */
    asked_end(&a);
}

/* ---- what only the step's end shows ---------------------------------------------------------- */

/* No force at first, 100 after: the frozen step reaches nothing. */
static int32_t late_force(double *k, double t, const double *q, const double *v, void *user)
{
    (void)q;
    (void)v;
    (void)user;
    k[0] = t > 0.05 ? 100 : 0;
    return 0;
}

static int32_t walls(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                     void *user)
{
    const double speed = *(const double *)user;

    (void)mu;
    gap[0] = 0.1 - speed * t - q[0];
    H[0] = -1;
    drift[0] = -speed;
    gap[1] = q[0] + 5;
    H[1] = 1;
    return 0;
}

static void test_reach(void **state)
{
    double q[1] = {0}, v[1] = {0}, impulse[2], speed = 0;
    int32_t modes[2];
    asked a;

    (void)state;
    asked_begin(&a, 1, PERP_MECHANISM_IMPLICIT);
    a.model.contacts = 2;
    a.model.dim = 1;
    a.model.force = late_force;
    a.model.contact_rows = walls;
    a.model.user = &speed;
    asked_make(&a);
    asked_step(&a, q, v, impulse, modes, 0, 0.1);
    near(q[0], 0.1, 1e-16, "at the wall"); /* 1 without it */
    near(v[0], 1, 1e-14, "speed of approach");
    near(impulse[0], 9, 1e-13, "of the wall");
    assert_true(impulse[1] == 0.0 && modes[1] == PERP_MECHANISM_SEPARATE);
    asked_step(&a, q, v, impulse, modes, 0.1, 0.1);
    assert_true(v[0] == 0.0 && modes[0] == PERP_MECHANISM_STICK);
    near(impulse[0], 11, 1e-13, "of the wall"); /* 10 of the force, 1 of the speed left */
    /* now it comes on, and pushes the body back */
    speed = 0.1;
    q[0] = 0.1 - speed * 0.2;
    asked_step(&a, q, v, impulse, modes, 0.2, 0.1);
    near(v[0], -speed, 1e-15, "with the wall");
    asked_end(&a);
}

/* A bound that grows with speed is that at the end: v+ = v - h b v+ / m. */
static int32_t speed_bound(double *bound, double *B, double *drift, double t, const double *q,
                           const double *v, void *user)
{
    (void)drift;
    (void)t;
    (void)q;
    (void)user;
    bound[0] = 3 * fabs(v[0]) + 0.5;
    B[0] = 1;
    return 0;
}

static void test_bound(void **state)
{
    double q[1] = {0}, v[1] = {2}, y;
    int32_t modes[1];
    asked a;
    int i;

    (void)state;
    asked_begin(&a, 1, PERP_MECHANISM_IMPLICIT);
    a.model.dry = 1;
    a.model.dry_rows = speed_bound;
    asked_make(&a);
    for (i = 0; i < 20; i++) { /* v+ = (v - h / 2) / (1 + 3 h) until that is below 0 */
        const double expected = fmax((v[0] - 0.1 * 0.5) / (1 + 3 * 0.1), 0);

        asked_step(&a, q, v, &y, modes, 0, 0.1);
        near(v[0], expected, 1e-10 * 2, "speed"); /* tol, of speeds up to 2 */
        assert_int_equal(modes[0], expected > 0 ? PERP_MECHANISM_SLIP : PERP_MECHANISM_STICK);
    }
    assert_true(v[0] == 0.0 && y == 0.0);
    asked_end(&a);
}

/* Stiff: implicit steps take a spring of k h^2 / m = 100 and come to rest in it; frozen ones, with
 * forces of the start, do not. */
static int32_t spring(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)v;
    (void)user;
    k[0] = -1e6 * q[0];
    return 0;
}

static void test_stiff(void **state)
{
    double q[1] = {1}, v[1] = {0};
    asked a;
    int i;

    (void)state;
    asked_begin(&a, 1, PERP_MECHANISM_IMPLICIT);
    a.model.force = spring;
    asked_make(&a);
    for (i = 0; i < 3; i++) { /* v+ (1 + k h^2) = v - h k q */
        const double q0 = q[0], v0 = v[0], expected = (v0 - 1e4 * q0) / (1 + 100);

        asked_step(&a, q, v, NULL, NULL, 0, 0.01);
        near(v[0], expected, 1e-11 * fabs(expected), "speed"); /* eps k h q0, beside v */
    }
    assert_true(fabs(q[0]) < 2e-3);
    asked_end(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bead),         cmocka_unit_test(test_bead_theta),
        cmocka_unit_test(test_bead_polygon), cmocka_unit_test(test_bead_rest),
        cmocka_unit_test(test_reach),        cmocka_unit_test(test_bound),
        cmocka_unit_test(test_stiff),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
