/* Implicit steps of a body with a quaternion, kinematics and a contact: a ball whose mass centre is
 * off its centre spins and slides. */
#include "asked.h"

#define GRAVITY 9.81

typedef struct ball {
    double mass, inertia[3], radius, offset; /* offset: of the ball's centre, along its axis 3 */
} ball;

/* R: body to world, of the quaternion q[3..6] = (w, x, y, z). */
static void rotation(const double *q, double R[3][3])
{
    const double w = q[3], x = q[4], y = q[5], z = q[6];
    const double rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                               {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                               {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};

    memcpy(R, rows, sizeof rows);
}

/* v: of the mass centre, and the spin in the world's axes. */
static int32_t ball_mass(double *M, const double *q, void *user)
{
    const ball *b = user;
    double R[3][3];
    int i, j, k;

    rotation(q, R);
    for (i = 0; i < 3; i++) {
        M[7 * i] = b->mass;
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++)
                M[6 * (3 + i) + 3 + j] += R[i][k] * b->inertia[k] * R[j][k];
    }
    return 0;
}

static int32_t ball_force(double *k, double t, const double *q, const double *v, void *user)
{
    const ball *b = user;
    double M[36] = {0}, L[3];
    int i;

    (void)t;
    ball_mass(M, q, user);
    for (i = 0; i < 3; i++)
        L[i] = M[6 * (3 + i) + 3] * v[3] + M[6 * (3 + i) + 4] * v[4] + M[6 * (3 + i) + 5] * v[5];
    k[2] = -b->mass * GRAVITY;
    k[3] = L[1] * v[5] - L[2] * v[4]; /* L x spin */
    k[4] = L[2] * v[3] - L[0] * v[5];
    k[5] = L[0] * v[4] - L[1] * v[3];
    return 0;
}

/* From the mass centre to the point that touches the floor z = 0. */
static void ball_arm(const ball *b, const double *q, double arm[3])
{
    double R[3][3];
    int i;

    rotation(q, R);
    for (i = 0; i < 3; i++)
        arm[i] = b->offset * R[i][2];
    arm[2] -= b->radius;
}

static int32_t ball_contact(double *gap, double *H, double *drift, double *mu, double t,
                            const double *q, void *user)
{
    static const int axes[3] = {2, 0, 1}; /* normal, tangents */
    double arm[3];
    int i;

    (void)drift;
    (void)mu;
    (void)t;
    ball_arm(user, q, arm);
    gap[0] = q[2] + arm[2];
    for (i = 0; i < 3; i++) { /* velocity of the point: v + spin x arm */
        const int k = axes[i], next = (k + 1) % 3, last = (k + 2) % 3;

        H[6 * i + k] = 1;
        H[6 * i + 3 + next] = arm[last];
        H[6 * i + 3 + last] = -arm[next];
    }
    return 0;
}

static int32_t ball_rate(double *rate, const double *q, const double *v, void *user)
{
    const double *p = q + 3, *s = v + 3;

    (void)user;
    memcpy(rate, v, 3 * sizeof *v);
    rate[3] = 0.5 * (-s[0] * p[1] - s[1] * p[2] - s[2] * p[3]);
    rate[4] = 0.5 * (s[0] * p[0] + s[1] * p[3] - s[2] * p[2]);
    rate[5] = 0.5 * (-s[0] * p[3] + s[1] * p[0] + s[2] * p[1]);
    rate[6] = 0.5 * (s[0] * p[2] - s[1] * p[1] + s[2] * p[0]);
    return 0;
}

static int32_t ball_normalise(double *q, void *user)
{
    const double length = sqrt(q[3] * q[3] + q[4] * q[4] + q[5] * q[5] + q[6] * q[6]);
    int i;

    (void)user;
    for (i = 3; i < 7; i++)
        q[i] /= length;
    return 0;
}

/* L . arm, which no force at the contact changes (Jellett). */
static double jellett(ball *b, const double *q, const double *v)
{
    double M[36] = {0}, arm[3], sum = 0;
    int i, k;

    ball_mass(M, q, b);
    ball_arm(b, q, arm);
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++)
            sum += arm[i] * M[6 * (3 + i) + 3 + k] * v[3 + k];
    return sum;
}

static double jellett_change(int32_t scheme, int steps)
{
    const double mu = 0.3, tilt = 0.3, h = 0.4 / steps;
    ball b = {1, {0.4, 0.4, 0.35}, 1, 0.2};
    double q[7] = {0}, v[6] = {0}, impulse[3], arm[3], before;
    int32_t modes[1];
    asked a;
    int i;

    asked_begin(&a, 6, scheme);
    a.model.coordinates = 7;
    a.model.contacts = 1;
    a.model.dim = 3;
    a.model.mu = &mu;
    a.model.mass = ball_mass;
    a.model.force = ball_force;
    a.model.contact_rows = ball_contact;
    a.model.kinematics = ball_rate;
    a.model.normalise = ball_normalise;
    a.model.user = &b;
    asked_make(&a);
    q[3] = cos(tilt / 2);
    q[4] = sin(tilt / 2);
    ball_arm(&b, q, arm);
    q[2] = -arm[2];
    v[5] = 15;
    v[0] = arm[1] * v[5]; /* the ball's centre is at rest */
    v[1] = -arm[0] * v[5];
    before = jellett(&b, q, v);
    for (i = 0; i < steps; i++) {
        asked_step(&a, q, v, impulse, modes, i * h, h);
        assert_true(a.step.penetration <= 1e-14); /* places of 1: some eps */
        assert_true(hypot(impulse[1], impulse[2]) <= mu * impulse[0] * (1 + 1e-9));
    }
    assert_int_equal(modes[0], PERP_MECHANISM_SLIP);
    asked_end(&a);
    return fabs(jellett(&b, q, v) / before - 1);
}

/* Through a quaternion, with friction that turns: conserved to first order. */
static void test_jellett(void **state)
{
    double changes[3];
    int k;

    (void)state;
    for (k = 0; k < 3; k++)
        changes[k] = jellett_change(PERP_MECHANISM_IMPLICIT, 200 << k);
    near(log2(changes[0] / changes[1]), 1, 0.2, "order");
    near(log2(changes[1] / changes[2]), 1, 0.1, "order");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_jellett)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
