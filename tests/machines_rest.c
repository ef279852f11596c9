/* Machines of a line or two: a bouncing ball, chains of balls, a wedge, tables, a pendulum on its
 * constraint, a free body. */
#include "machines.h"

#include <math.h>

static int32_t diagonal_mass(double *M, const double *q, void *user)
{
    const machine *m = user;
    const int32_t n = m->model.velocities;
    int32_t i;

    (void)q;
    for (i = 0; i < n; i++)
        M[i * n + i] = m->data.mass.mass[i];
    return 0;
}

static int32_t constant_force(double *k, double t, const double *q, const double *v, void *user)
{
    const machine *m = user;
    int32_t i;

    (void)t;
    (void)q;
    (void)v;
    for (i = 0; i < m->model.velocities; i++)
        k[i] = m->data.mass.load[i];
    return 0;
}

static double constant_energy(const machine *m, const double *q, const double *v)
{
    double energy = 0;
    int32_t i;

    for (i = 0; i < m->model.velocities; i++)
        energy += m->data.mass.mass[i] * v[i] * v[i] / 2 - m->data.mass.load[i] * q[i];
    return energy;
}

static void make_masses(machine *m, int32_t n, int32_t contacts, int32_t dim,
                        perp_mechanism_contacts rows)
{
    int32_t i;

    m->model.velocities = n;
    m->model.contacts = contacts;
    m->model.dim = dim;
    m->model.mass = diagonal_mass;
    m->model.force = constant_force;
    m->model.contact_rows = rows;
    m->energy = constant_energy;
    for (i = 0; i < n; i++)
        m->data.mass.mass[i] = 1;
}

static int32_t ball_rows(double *gap, double *H, double *drift, double *mu, double t,
                         const double *q, void *user)
{
    (void)drift;
    (void)mu;
    (void)t;
    (void)user;
    gap[0] = q[0];
    H[0] = 1;
    return 0;
}

/* Dropped from 1. parameter: what it gives back; with 1/2 it hits at t0, 2 t0, 2.5 t0, ... 3 t0. */
void machine_make_ball(machine *m, double parameter)
{
    const double e = parameter, t0 = sqrt(2 / MACHINE_GRAVITY), speed = MACHINE_GRAVITY * t0;
    const char *source = "parabolas between impacts at t0 = sqrt(2 h / g), t0 (1 + 2 e), ...";
    double since;

    make_masses(m, 1, 1, 1, ball_rows);
    m->data.mass.load[0] = -MACHINE_GRAVITY;
    m->restitution[0] = e;
    m->q[0] = 1;
    m->end = 1;
    since = m->end - t0 * (1 + 2 * e);
    machine_refer(m, MACHINE_COORDINATE, 0,
                  e * e * speed * since - MACHINE_GRAVITY * since * since / 2, "y", source);
    machine_refer(m, MACHINE_VELOCITY, 0, e * e * speed - MACHINE_GRAVITY * since, "v", source);
    machine_refer(m, MACHINE_HIT, 0, t0, "first impact", source);
    machine_refer(m, MACHINE_OTHER, 0, t0 * (1 + e) / (1 - e), "rest", source);
    machine_refer(m, MACHINE_OTHER, 0, (1 + e * e) / (1 - e * e), "path", source);
}

/* Coordinates are shifted by the diameters: a gap is a difference. */
static int32_t chain_rows(double *gap, double *H, double *drift, double *mu, double t,
                          const double *q, void *user)
{
    const int32_t n = ((const machine *)user)->model.velocities;
    int32_t k;

    (void)drift;
    (void)mu;
    (void)t;
    for (k = 0; k + 1 < n; k++) {
        gap[k] = q[k + 1] - q[k];
        H[k * n + k] = -1;
        H[k * n + k + 1] = 1;
    }
    return 0;
}

static void make_chain(machine *m, int32_t balls, double e)
{
    int32_t k;

    make_masses(m, balls, balls - 1, 1, chain_rows);
    for (k = 0; k + 1 < balls; k++)
        m->restitution[k] = e;
    m->v[0] = 1;
    m->end = 1e-3;
}

/* parameter: how many. */
void machine_make_chain(machine *m, double parameter)
{
    const int32_t balls = (int32_t)parameter;
    const double e = 0.5;

    make_chain(m, balls, e);
    machine_refer(m, MACHINE_VELOCITY, 0, (1 + e) / balls - e, "first",
                  "all laws at once: (1 + e) / n - e");
    machine_refer(m, MACHINE_VELOCITY, balls - 1, (1 + e) / balls, "last",
                  "all laws at once: (1 + e) / n");
}

/* parameter: the mass of the second. */
void machine_make_chain_unlike(machine *m, double parameter)
{
    const char *source = "momentum, and Newton's law";

    make_chain(m, 2, 0.5);
    m->data.mass.mass[1] = parameter;
    machine_refer(m, MACHINE_VELOCITY, 0, -1.0 / 8, "first", source);
    machine_refer(m, MACHINE_VELOCITY, 1, 3.0 / 8, "last", source);
}

static int32_t wedge_rows(double *gap, double *H, double *drift, double *mu, double t,
                          const double *q, void *user)
{
    const double slope = ((const machine *)user)->data.mass.slope, c = cos(slope), s = sin(slope);

    (void)drift;
    (void)mu;
    (void)t;
    gap[0] = c * q[0] + s * q[1];
    gap[1] = -c * q[0] + s * q[1];
    H[0] = c, H[1] = s;
    H[2] = -s, H[3] = c;
    H[4] = -c, H[5] = s;
    H[6] = s, H[7] = c;
    return 0;
}

/* parameter: half its angle in degrees. With 10, mu = 0.3 > tan 10: holds itself. Pushed in it
 * stops; pulled out it may jam, or come out. */
void machine_make_wedge(machine *m, double parameter)
{
    make_masses(m, 2, 2, 2, wedge_rows);
    m->data.mass.slope = parameter * MACHINE_PI / 180;
    m->mu[0] = m->mu[1] = 0.3;
    m->v[1] = -1;
    m->end = 1e-3;
    machine_refer(m, MACHINE_OTHER, 0, tan(m->data.mass.slope), "holds itself above mu",
                  "tan slope");
    machine_refer(m, MACHINE_OTHER, 0, 1.0658923943122539, "least normal force",
                  "W / (2 (sin slope + mu cos slope)), W = 1");
}

/* q = (height, tilt about x, tilt about y), small. */
static int32_t table_rows(double *gap, double *H, double *drift, double *mu, double t,
                          const double *q, void *user)
{
    const machine *m = user;
    int32_t k;

    (void)drift;
    (void)mu;
    (void)t;
    for (k = 0; k < m->model.contacts; k++) {
        const double angle = 2 * MACHINE_PI * k / m->model.contacts;
        const int few = m->model.contacts == 4;
        const double x = few ? m->data.mass.places[0][k] : cos(angle),
                     y = few ? m->data.mass.places[1][k] : sin(angle);

        gap[k] = q[0] + y * q[1] - x * q[2];
        H[3 * k] = 1;
        H[3 * k + 1] = y;
        H[3 * k + 2] = -x;
    }
    return 0;
}

/* parameter: legs; 4 of them at (+-1, +-1/2), others around the unit circle. */
void machine_make_table(machine *m, double parameter)
{
    static const double x[4] = {1, -1, -1, 1}, y[4] = {0.5, 0.5, -0.5, -0.5};
    const double weight = 100, load[2] = {0.3, 0.1};
    const char *source = "the load's wrench; forces of the legs are not unique";
    int32_t k;

    make_masses(m, 3, (int32_t)parameter, 1, table_rows);
    for (k = 0; k < 4; k++) {
        m->data.mass.places[0][k] = x[k];
        m->data.mass.places[1][k] = y[k];
    }
    m->data.mass.mass[0] = 10;
    m->data.mass.mass[1] = 2;
    m->data.mass.mass[2] = 3;
    m->data.mass.load[0] = -weight;
    m->data.mass.load[1] = -weight * load[1];
    m->data.mass.load[2] = weight * load[0];
    m->end = 0.1;
    machine_refer(m, MACHINE_OTHER, 0, weight, "force", source);
    machine_refer(m, MACHINE_OTHER, 0, weight * load[1], "sum f y", source);
    machine_refer(m, MACHINE_OTHER, 0, weight * load[0], "sum f x", source);
}

/* q = (x, y) on x^2 + y^2 = length^2. The row has length 1 on the circle. */
static int32_t pendulum_rows(double *c, double *G, double *drift, double t, const double *q,
                             void *user)
{
    const double length = ((const machine *)user)->data.mass.length;

    (void)drift;
    (void)t;
    c[0] = (q[0] * q[0] + q[1] * q[1] - length * length) / (2 * length);
    G[0] = q[0] / length;
    G[1] = q[1] / length;
    return 0;
}

/* Length 1, released at 90 degrees: horizontal. */
void machine_make_pendulum(machine *m, double parameter)
{
    const char *source = "angle 2 asin(k sn(K - w t, k)), k = sin 45, w = sqrt(g), 30 digits";

    (void)parameter;
    make_masses(m, 2, 0, 2, NULL);
    m->model.bilateral = 1;
    m->model.bilateral_rows = pendulum_rows;
    m->data.mass.length = 1;
    m->data.mass.load[1] = -MACHINE_GRAVITY;
    m->q[0] = 1;
    m->end = 1;
    machine_refer(m, MACHINE_COORDINATE, 0, -0.986291751131875319, "x", source);
    machine_refer(m, MACHINE_COORDINATE, 1, -0.165010853125541169, "y", source);
    machine_refer(m, MACHINE_VELOCITY, 0, -0.296905515916315822, "vx", source);
    machine_refer(m, MACHINE_VELOCITY, 1, 1.77464364111265563, "vy", source);
    machine_refer(m, MACHINE_OTHER, 0, 2.36784194757623745, "period",
                  "4 sqrt(l / g) K(sin(90 / 2)), 30 digits");
}

/* q: quaternion (w, x, y, z), body to world. v: spin in the body's axes. */
static int32_t spin_force(double *k, double t, const double *q, const double *v, void *user)
{
    const double *inertia = ((const machine *)user)->data.free.inertia;
    int32_t i;

    (void)t;
    (void)q;
    for (i = 0; i < 3; i++) {
        const int32_t a = (i + 1) % 3, b = (i + 2) % 3;

        k[i] = (inertia[a] - inertia[b]) * v[a] * v[b];
    }
    return 0;
}

static int32_t spin_mass(double *M, const double *q, void *user)
{
    int32_t i;

    (void)q;
    for (i = 0; i < 3; i++)
        M[4 * i] = ((const machine *)user)->data.free.inertia[i];
    return 0;
}

static int32_t spin_rate(double *rate, const double *q, const double *v, void *user)
{
    (void)user;
    rate[0] = (-q[1] * v[0] - q[2] * v[1] - q[3] * v[2]) / 2;
    rate[1] = (q[0] * v[0] + q[2] * v[2] - q[3] * v[1]) / 2;
    rate[2] = (q[0] * v[1] + q[3] * v[0] - q[1] * v[2]) / 2;
    rate[3] = (q[0] * v[2] + q[1] * v[1] - q[2] * v[0]) / 2;
    return 0;
}

static int32_t spin_normalise(double *q, void *user)
{
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    int32_t i;

    (void)user;
    for (i = 0; i < 4; i++)
        q[i] /= length;
    return 0;
}

static double spin_energy(const machine *m, const double *q, const double *v)
{
    const double *inertia = m->data.free.inertia;

    (void)q;
    return (inertia[0] * v[0] * v[0] + inertia[1] * v[1] * v[1] + inertia[2] * v[2] * v[2]) / 2;
}

void machine_make_spin(machine *m, double parameter)
{
    static const double spin[3] = {-0.60347042309251813, -1.2789931385478724, 0.88772678821573304},
                        turned[4] = {0.462545440555, -0.314335145145, 0.0494296312793,
                                     0.827527548484};
    const char *elliptic = "w = (sqrt 2 cn, sqrt 2 sn, sqrt(4/3) dn)(F(45, 1/2) + t sqrt(4/3))",
               *integrated = "DOP853 to 1e-13; 12 digits";
    int32_t i;

    (void)parameter;
    m->model.velocities = 3;
    m->model.coordinates = 4;
    m->model.mass = spin_mass;
    m->model.force = spin_force;
    m->model.kinematics = spin_rate;
    m->model.normalise = spin_normalise;
    m->energy = spin_energy;
    for (i = 0; i < 3; i++) {
        m->data.free.inertia[i] = i + 1;
        m->v[i] = 1;
    }
    m->q[0] = 1;
    m->end = 10;
    for (i = 0; i < 3; i++)
        machine_refer(m, MACHINE_VELOCITY, i, spin[i],
                      i == 0   ? "wx"
                      : i == 1 ? "wy"
                               : "wz",
                      elliptic);
    for (i = 0; i < 4; i++)
        machine_refer(m, MACHINE_COORDINATE, i, turned[i],
                      i == 0   ? "qw"
                      : i == 1 ? "qx"
                      : i == 2 ? "qy"
                               : "qz",
                      integrated);
    machine_refer(m, MACHINE_OTHER, 0, 6.4227030842256936, "period", elliptic);
}
