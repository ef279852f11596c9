/* Round bodies that roll on a plane: an Euler disk, and a rattleback whose spin turns round. Beside
 * them, the equations of rolling without slip, reduced to attitude and spin (E. J. Routh, Advanced
 * Rigid Dynamics, 1905, ch. V), by Runge and Kutta's method. A disk is the ellipsoid with semi-axes
 * (R, R, 0).
 *
 * q: centre, unit quaternion; v: velocity in space, spin in the body. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

#define G 9.81
#define PI 3.14159265358979323846

typedef struct body {
    double axes[3]; /* squared semi-axes */
    double I[3][3]; /* mass 1 */
    double q[7], v[6];
    int32_t steps, separated;
} body;

static void cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void turn(const double p[4], double R[3][3])
{
    const double w = p[0], x = p[1], y = p[2], z = p[3];
    const double rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                               {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                               {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};

    memcpy(R, rows, sizeof rows);
}

static void quaternion_rate(const double p[4], const double w[3], double rate[4])
{
    rate[0] = -0.5 * (p[1] * w[0] + p[2] * w[1] + p[3] * w[2]);
    rate[1] = 0.5 * (p[0] * w[0] + p[2] * w[2] - p[3] * w[1]);
    rate[2] = 0.5 * (p[0] * w[1] - p[1] * w[2] + p[3] * w[0]);
    rate[3] = 0.5 * (p[0] * w[2] + p[1] * w[1] - p[2] * w[0]);
}

/* The lowest point, where `up` points up in the body; its depth below the centre. */
static double lowest(const body *b, const double up[3], double s[3])
{
    double depth = 0;
    int i;

    for (i = 0; i < 3; i++)
        depth += b->axes[i] * up[i] * up[i];
    depth = sqrt(depth);
    for (i = 0; i < 3; i++)
        s[i] = -b->axes[i] * up[i] / depth;
    return depth;
}

/* ---- as a mechanism ------------------------------------------------------------------------ */

static int32_t mass(double *M, const double *q, void *user)
{
    const body *b = user;
    int i, j;

    (void)q;
    for (i = 0; i < 3; i++) {
        M[7 * i] = 1;
        for (j = 0; j < 3; j++)
            M[6 * (3 + i) + 3 + j] = b->I[i][j];
    }
    return 0;
}

/* torque := -w x I w. */
static void gyroscopic(const body *b, const double w[3], double torque[3])
{
    const double spin[3] = {dot(b->I[0], w), dot(b->I[1], w), dot(b->I[2], w)};

    cross(spin, w, torque);
}

static int32_t force(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t, (void)q;
    k[2] = -G;
    gyroscopic(user, v + 3, k + 3);
    return 0;
}

static int32_t contact(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                       void *user)
{
    static const int row_of[3] = {2, 0, 1}; /* the normal comes first */
    double R[3][3], s[3];
    int i;

    (void)drift, (void)mu, (void)t;
    turn(q + 3, R);
    gap[0] = q[2] - lowest(user, R[2], s);
    for (i = 0; i < 3; i++) {
        H[6 * i + row_of[i]] = 1;
        cross(s, R[row_of[i]], H + 6 * i + 3);
    }
    return 0;
}

static int32_t kinematics(double *rate, const double *q, const double *v, void *user)
{
    (void)user;
    memcpy(rate, v, 3 * sizeof *rate);
    quaternion_rate(q + 3, v + 3, rate + 3);
    return 0;
}

static int32_t normalise(double *q, void *user)
{
    const double size = sqrt(q[3] * q[3] + dot(q + 4, q + 4));
    int i;

    (void)user;
    for (i = 3; i < 7; i++)
        q[i] /= size;
    return 0;
}

static int32_t watch(const perp_mechanism_view *view, void *user)
{
    body *b = user;

    b->separated += view->h > 0 && view->modes[0] != PERP_MECHANISM_STICK;
    return 0;
}

/* Runs b for `seconds`: b->q and b->v are the end's. */
static perp_mechanism_run_result roll(body *b, double seconds, double error)
{
    const double mu = 10; /* rolls, whatever the load */
    perp_mechanism_model model = fresh_mechanism_model();
    perp_mechanism_settings settings = fresh_mechanism_settings();
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    perp_mechanism *mechanism;
    perp_context *context;

    model.velocities = 6;
    model.coordinates = 7;
    model.contacts = 1;
    model.dim = 3;
    model.mu = &mu;
    model.mass = mass;
    model.force = force;
    model.contact_rows = contact;
    model.kinematics = kinematics;
    model.normalise = normalise;
    model.user = b;
    settings.scheme = PERP_MECHANISM_THETA;
    settings.error = error;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_mechanism_create(context, &mechanism, &settings, &model), PERP_OK);
    assert_int_equal(perp_mechanism_run(mechanism, b->q, b->v, &result, START(0, 1e-4, b->q, b->v),
                                        seconds, watch, b),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    perp_mechanism_destroy(mechanism);
    perp_context_destroy(context);
    return result;
}

/* ---- the equations of rolling -------------------------------------------------------------- */

/* x := A^-1 b, by Cramer's rule. */
static void solve3(double A[3][3], const double b[3], double x[3])
{
    double columns[3][3], minor[3];
    int i, j;

    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            columns[j][i] = A[i][j];
    for (i = 0; i < 3; i++) {
        cross(columns[(i + 1) % 3], columns[(i + 2) % 3], minor);
        x[i] = dot(minor, b) / dot(minor, columns[i]);
    }
}

/* y: centre, quaternion, spin in the body. The centre has the velocity -w x s, so that the point
 * that touches has none; I w' + w x I w = s x (that velocity's rate + g up). */
static void rolling(const body *b, const double *y, double *rate)
{
    const double *w = y + 7;
    double R[3][3], s[3], s_rate[3], up_rate[3], v[3], a[3], load[3], torque[3], A[3][3], depth,
        slope;
    int i, j;

    turn(y + 3, R);
    depth = lowest(b, R[2], s);
    cross(R[2], w, up_rate);
    slope = -dot(s, up_rate); /* of the depth */
    for (i = 0; i < 3; i++)
        s_rate[i] = -b->axes[i] * up_rate[i] / depth - s[i] * slope / depth;
    cross(s, w, v);
    cross(s_rate, w, a);
    cross(w, v, load);
    for (i = 0; i < 3; i++)
        load[i] += a[i] + G * R[2][i];
    cross(s, load, torque);
    gyroscopic(b, w, load);
    for (i = 0; i < 3; i++) {
        load[i] += torque[i];
        rate[i] = dot(R[i], v);
        for (j = 0; j < 3; j++) /* of w' in s x (s x w') */
            A[i][j] = b->I[i][j] + (i == j ? dot(s, s) : 0) - s[i] * s[j];
    }
    quaternion_rate(y + 3, w, rate + 3);
    solve3(A, load, rate + 7);
}

static void runge_kutta(const body *b, double *y, double seconds, int steps)
{
    static const double shares[] = {0.5, 0.5, 1}, weights[] = {1, 2, 2, 1};
    const double h = seconds / steps;
    double rate[10], at[10], sum[10];
    int n, k, i;

    for (n = 0; n < steps; n++) {
        memcpy(at, y, sizeof at);
        memset(sum, 0, sizeof sum);
        for (k = 0; k < 4; k++) {
            rolling(b, at, rate);
            for (i = 0; i < 10; i++) {
                sum[i] += weights[k] * rate[i];
                at[i] = k < 3 ? y[i] + shares[k] * h * rate[i] : 0;
            }
        }
        for (i = 0; i < 10; i++)
            y[i] += h / 6 * sum[i];
    }
}

/* Sets the body down, with this attitude and spin; y: the same for the equations of rolling. */
static void set_down(body *b, const double p[4], const double w[3], double y[10])
{
    double R[3][3], s[3], v[3];
    int i;

    memset(b->q, 0, sizeof b->q);
    memcpy(b->q + 3, p, 4 * sizeof *p);
    normalise(b->q, NULL);
    turn(b->q + 3, R);
    b->q[2] = lowest(b, R[2], s);
    cross(s, w, v);
    for (i = 0; i < 3; i++)
        b->v[i] = dot(R[i], v);
    memcpy(b->v + 3, w, 3 * sizeof *w);
    memcpy(y, b->q, sizeof b->q);
    memcpy(y + 7, w, 3 * sizeof *w);
    b->separated = 0;
}

static double distance(const double *a, const double *b, int n)
{
    double largest = 0;
    int i;

    for (i = 0; i < n; i++)
        largest = fmax(largest, fabs(a[i] - b[i]));
    return largest;
}

/* ---- tests --------------------------------------------------------------------------------- */

static const double radius = 0.0375;

static body disk(void)
{
    const double square = radius * radius;
    const body b = {{square, square, 0},
                    {{square / 4, 0, 0}, {0, square / 4, 0}, {0, 0, square / 2}},
                    {0},
                    {0},
                    0,
                    0};

    return b;
}

/* Inclined by `angle`, rolling on its edge so that the line of contact turns with `precession`,
 * with the centre above the same place. */
static void set_down_disk(body *b, double angle, double precession, double y[10])
{
    const double p[4] = {cos(angle / 2), 0, sin(angle / 2), 0};
    const double w[3] = {-precession * sin(angle), 0, 0};

    set_down(b, p, w, y);
}

/* The precession of that motion: (R sin a) W^2 = 4 g, of a thin disk whose centre rests. */
static double steady(double angle)
{
    return sqrt(4 * G / (radius * sin(angle)));
}

/* Errors of thousands of steps, which largely cancel: 2 to 43 times that of one is what adds up. */
#define ADDED 100

/* A step is refused where the motion changes, not because the contact chatters: there were more
 * refused steps than steps when what was left of gaps had to fall shut. */
static void require_few_refused(const perp_mechanism_run_result *result)
{
    assert_true(10 * result->rejected <= result->steps);
}

/* The axis stays inclined, and turns with that precession; the centre stays. */
static void test_steady_disk(void **state)
{
    static const double angles[] = {0.1, 0.3, 1};
    int k;

    (void)state;
    for (k = 0; k < 3; k++) {
        const double precession = steady(angles[k]);
        perp_mechanism_run_result result;
        double y[10], R[3][3], turned;
        body b = disk();

        set_down_disk(&b, angles[k], precession, y);
        result = roll(&b, 1, 1e-6);
        turn(b.q + 3, R);
        turned = remainder(atan2(R[1][2], R[0][2]) - precession, 2 * PI);
        require_few_refused(&result);
        /* a step may err by 1e-6 beside numbers of 1, and in the tilt hundreds of steps add up to
         * little more; the phase of a small circle errs by more */
        assert_true(fabs(R[2][2] - cos(angles[k])) <= 2e-6);
        assert_true(hypot(b.q[0], b.q[1]) <= 1e-6);
        assert_true(fabs(turned) <= ADDED * 1e-6 / sin(angles[k]));
    }
}

/* Both ways from the same start. */
static void compare(body *b, double *y, double seconds, double error)
{
    const body start = *b;
    perp_mechanism_run_result result = roll(b, seconds, error);
    double off;

    runge_kutta(&start, y, seconds, 20000); /* halved steps change y by less than 1e-10 */
    off = distance(b->q, y, 7);
    if (!(off <= ADDED * error))
        fail_msg("off by %g in %d steps of %g", off, (int)result.steps, error);
    require_few_refused(&result);
    assert_int_equal(b->separated, 0);
}

static void test_disk(void **state)
{
    static const double shares[] = {0.9, 1.1, 1.3};
    int k;

    (void)state;
    for (k = 0; k < 6; k++) {
        double y[10];
        body b = disk();

        set_down_disk(&b, 0.2, shares[k / 2] * steady(0.2), y);
        compare(&b, y, 1, k % 2 ? 1e-6 : 1e-4);
    }
}

static body rattleback(void)
{
    const double a = 0.1, b = 0.02, c = 0.015, angle = 0.1, x = (b * b + c * c) / 5,
                 y = (a * a + c * c) / 5, s = sin(angle), d = cos(angle);
    const body stone = {{a * a, b * b, c * c},
                        {{d * d * x + s * s * y, s * d * (x - y), 0},
                         {s * d * (x - y), s * s * x + d * d * y, 0},
                         {0, 0, (a * a + b * b) / 5}},
                        {0},
                        {0},
                        0,
                        0};

    return stone;
}

static void test_rattleback(void **state)
{
    static const double p[4] = {1, 0.01, 0.01, 0}, errors[] = {1e-4, 1e-6, 1e-8};
    int k;

    (void)state;
    for (k = 0; k < 6; k++) {
        const double w[3] = {0, 0, k / 3 ? -3 : 3};
        double y[10];
        body b = rattleback();

        set_down(&b, p, w, y);
        compare(&b, y, 1, errors[k % 3]); /* the last to 1e-6 */
        assert_true(b.v[5] > 2.5); /* -3 at the start turns round, as it does by the equations */
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_steady_disk),
                                       cmocka_unit_test(test_disk),
                                       cmocka_unit_test(test_rattleback)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
