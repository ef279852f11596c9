/* Planar bodies q = (x, y, angle) on the floor y = 0: rods, blocks, things that roll. They touch it
 * with one or two of their points, each with a cap of a radius. */
#include "machines.h"

#include <math.h>

static int32_t body_mass(double *M, const double *q, void *user)
{
    const machine_body *body = &((const machine *)user)->data.body;

    (void)q;
    M[0] = M[4] = body->mass;
    M[8] = body->inertia;
    return 0;
}

static int32_t body_force(double *k, double t, const double *q, const double *v, void *user)
{
    const machine_body *body = &((const machine *)user)->data.body;

    (void)t;
    (void)v;
    k[0] = body->mass * body->gravity[0] + body->push;
    k[1] = body->mass * body->gravity[1];
    k[2] = -(body->height - q[1]) * body->push;
    return 0;
}

static double body_energy(const machine *m, const double *q, const double *v)
{
    const machine_body *body = &m->data.body;

    return body->mass * ((v[0] * v[0] + v[1] * v[1]) / 2 - body->gravity[0] * q[0] -
                         body->gravity[1] * q[1]) +
           body->inertia * v[2] * v[2] / 2;
}

/* From the mass centre to the centre of the cap. */
static void arm(double *offset, const machine_body *body, int32_t point, double angle)
{
    const double c = cos(angle), s = sin(angle);

    offset[0] = body->along[point] * c - body->across[point] * s;
    offset[1] = body->along[point] * s + body->across[point] * c;
}

static int32_t body_rows(double *gap, double *H, double *drift, double *mu, double t,
                         const double *q, void *user)
{
    static const double up[2] = {0, 1}, ahead[2] = {1, 0};
    const machine *m = user;
    const machine_body *body = &m->data.body;
    double offset[2];
    int32_t k;

    (void)drift;
    (void)mu;
    (void)t;
    for (k = 0; k < m->model.contacts; k++) {
        arm(offset, body, k, q[2]);
        offset[1] -= body->radius;
        gap[k] = q[1] + offset[1];
        machine_row(&H[6 * k], up, offset);
        machine_row(&H[6 * k + 3], ahead, offset);
    }
    return 0;
}

static int32_t body_curvature(double *bias, double t, const double *q, const double *v, void *user)
{
    const machine *m = user;
    double offset[2];
    int32_t k;

    (void)t;
    for (k = 0; k < m->model.contacts; k++) {
        arm(offset, &m->data.body, k, q[2]);
        bias[2 * k] = -offset[1] * v[2] * v[2];
        bias[2 * k + 1] = -offset[0] * v[2] * v[2];
    }
    return 0;
}

static void make_body(machine *m, int32_t points, double mass, double inertia, double mu)
{
    int32_t k;

    m->model.velocities = 3;
    m->model.contacts = points;
    m->model.mass = body_mass;
    m->model.force = body_force;
    m->model.contact_rows = body_rows;
    m->model.curvature = body_curvature;
    m->energy = body_energy;
    m->data.body.mass = mass;
    m->data.body.inertia = inertia;
    m->data.body.gravity[1] = -MACHINE_GRAVITY;
    for (k = 0; k < points; k++)
        m->mu[k] = mu;
}

/* Half-length 1; the tip slips to -x, and the friction that this asks for presses it in. */
void machine_make_rod(machine *m, double parameter)
{
    const char *source = "impulses until the tip sticks (Darboux, Keller)";
    const double c = 1 / sqrt(5.0), s = 2 / sqrt(5.0);

    (void)parameter;
    make_body(m, 1, 1, 1.0 / 3, 2);
    m->data.body.along[0] = -1;
    m->q[2] = atan(2.0);
    m->q[0] = c;
    m->q[1] = sin(m->q[2]);
    m->v[0] = -1;
    m->end = 1e-3;
    machine_refer(m, MACHINE_OTHER, 0, -0.6, "vx", source);
    machine_refer(m, MACHINE_OTHER, 0, 0.3, "vy", source);
    machine_refer(m, MACHINE_OTHER, 0, 0.67082039324993691, "spin", source);
    machine_refer(m, MACHINE_OTHER, 0, 0.17647058823529412, "vn, Poisson 0.5", source);
    machine_refer(m, MACHINE_OTHER, 0, 2 * sqrt(1 + 3.0) / 3, "critical mu",
                  "2 sqrt(1 + a) / a, a = m l^2 / I, at tan angle = sqrt(1 + a)");
    machine_refer(m, MACHINE_OTHER, 0, sqrt(MACHINE_GRAVITY / s), "critical spin",
                  "sqrt(g / (l sin angle)): below it none, above two accelerations");
}

/* A rod of length 1/2 between the centres of its caps. */
void machine_make_rod_fall(machine *m, double parameter)
{
    const char
        *impact = "free fall; then the plastic impact of one contact with friction, by hand",
        *limit = "integration from event to event, bindings/python/tests/test_mechanism_events.py";

    (void)parameter;
    make_body(m, 2, 1, 0.002, 0.6);
    m->data.body.radius = 0.05;
    m->data.body.along[0] = -0.25;
    m->data.body.along[1] = 0.25;
    m->q[1] = 1;
    m->q[2] = MACHINE_PI / 6;
    m->v[2] = 4;
    m->end = 1;
    machine_refer(m, MACHINE_COORDINATE, 0, -0.2273599827, "x", limit);
    machine_refer(m, MACHINE_COORDINATE, 1, 0.05, "y", "lies on both caps");
    machine_refer(m, MACHINE_COORDINATE, 2, MACHINE_PI, "angle", "lies on both caps");
    machine_refer(m, MACHINE_HIT, 0, 0.38581775171314873, "first impact", impact);
    machine_refer(m, MACHINE_OTHER, 0, 118.42291533755883, "angle there, degrees", impact);
    machine_refer(m, MACHINE_OTHER, 0, -1.390096117816968, "vx after", impact);
    machine_refer(m, MACHINE_OTHER, 1, -0.61294853391102516, "vy after", impact);
    machine_refer(m, MACHINE_OTHER, 2, 5.1510878994049984, "spin after", impact);
}

/* Its corners at (-half width, -half height) and (half width, -half height). */
static void make_block(machine *m, double width, double height, double mu)
{
    make_body(m, 2, 1, (width * width + height * height) / 3, mu);
    m->data.body.along[0] = -width;
    m->data.body.along[1] = width;
    m->data.body.across[0] = m->data.body.across[1] = -height;
    m->q[1] = height;
}

/* Half sides 0.1 and 0.5, released at half the angle at which it would fall over, on its left
 * corner. Housner's rocking: each impact leaves 1 - 3/2 sin^2 a of the spin, tan a = 0.2. */
void machine_make_block(machine *m, double parameter)
{
    const double width = 0.1, height = 0.5, start = atan(width / height) / 2;
    const char *rocking = "a'' = -3 g / (4 R) sin(atan(b / h) - |a|), Taylor series, 30 digits";

    (void)parameter;
    make_block(m, width, height, 0.5);
    m->q[0] = -width + width * cos(start) - height * sin(start);
    m->q[1] = width * sin(start) + height * cos(start);
    m->q[2] = start;
    m->end = 0.5;
    machine_refer(m, MACHINE_COORDINATE, 2, -0.0646198342482737558, "angle", rocking);
    machine_refer(m, MACHINE_VELOCITY, 2, -0.257876959266637689, "spin", rocking);
    machine_refer(m, MACHINE_HIT, 1, 0.34709358678888131, "first impact", rocking);
    machine_refer(m, MACHINE_OTHER, 0, 0.64804901226753231, "spin before", rocking);
    machine_refer(m, MACHINE_OTHER, 0, 0.61066156925209775, "spin after", rocking);
    machine_refer(m, MACHINE_OTHER, 0, 0.0275328293629887746, "angle at 0.3", rocking);
}

/* parameter: the slope in degrees; x down it. Tips where the slope is above atan(b / h), slides
 * first iff mu < b / h. */
void machine_make_block_slope(machine *m, double parameter)
{
    const double slope = parameter * MACHINE_PI / 180;

    make_block(m, 0.1, 0.3, 0.5);
    m->data.body.gravity[0] = MACHINE_GRAVITY * sin(slope);
    m->data.body.gravity[1] = -MACHINE_GRAVITY * cos(slope);
    m->end = 1;
    machine_refer(m, MACHINE_OTHER, 0, 18.434948822922011, "tips at, degrees", "atan(b / h)");
    machine_refer(m, MACHINE_OTHER, 0, 1.0 / 3, "slides first below mu", "b / h");
}

/* Weight 1. parameter: the push. */
void machine_make_block_push(machine *m, double parameter)
{
    make_block(m, 0.1, 0.3, 0.3);
    m->data.body.gravity[1] = -1;
    m->data.body.height = 0.5;
    m->data.body.push = parameter;
    m->end = 1;
    machine_refer(m, MACHINE_OTHER, 0, 0.2, "tips at", "W b / z");
    machine_refer(m, MACHINE_OTHER, 0, 0.2, "slides first below mu", "b / z");
}

static void make_roll(machine *m, double kappa, double mu)
{
    const double radius = 0.1;

    make_body(m, 1, 1, kappa * radius * radius, mu);
    m->data.body.radius = radius;
    m->q[1] = radius;
}

/* Starts with 7 and a backspin (counterclockwise) of `spin` over its radius; mu = 0.2. Sliding
 * keeps v - kappa radius spin, the moment about the floor. */
static void roll_from(machine *m, double kappa, double spin)
{
    const double mu = 0.2, speed = 7;
    const double rolls = (speed - kappa * spin) / (1 + kappa),
                 when = (speed - rolls) / (mu * MACHINE_GRAVITY),
                 where = (speed * speed - rolls * rolls) / (2 * mu * MACHINE_GRAVITY);
    const char *source = "rolls with (v - kappa r w) / (1 + kappa), decelerated by mu g until then";

    make_roll(m, kappa, mu);
    m->v[0] = speed;
    m->v[2] = spin / m->data.body.radius;
    m->end = when + 1;
    machine_refer(m, MACHINE_COORDINATE, 0, where + rolls, "x", source);
    machine_refer(m, MACHINE_VELOCITY, 0, rolls, "v", source);
    machine_refer(m, MACHINE_OTHER, 0, when, "rolls from", source);
    machine_refer(m, MACHINE_OTHER, 0, where, "rolls at", source);
}

/* parameter: kappa = I / (m r^2). */
void machine_make_roll(machine *m, double parameter)
{
    roll_from(m, parameter, 0);
}

/* parameter: backspin times radius. So much that it returns. */
void machine_make_roll_back(machine *m, double parameter)
{
    roll_from(m, 2.0 / 5, parameter);
}

/* A ball. parameter: the slope in degrees. */
void machine_make_roll_slope(machine *m, double parameter)
{
    const double kappa = 2.0 / 5, slope = parameter * MACHINE_PI / 180,
                 a = MACHINE_GRAVITY * sin(slope) / (1 + kappa);
    const char *source = "rolls with g sin(slope) / (1 + kappa)";

    make_roll(m, kappa, 0.2);
    m->data.body.gravity[0] = MACHINE_GRAVITY * sin(slope);
    m->data.body.gravity[1] = -MACHINE_GRAVITY * cos(slope);
    m->end = 1;
    machine_refer(m, MACHINE_COORDINATE, 0, a / 2, "x", source);
    machine_refer(m, MACHINE_VELOCITY, 0, a, "v", source);
    machine_refer(m, MACHINE_OTHER, 0, 0.1649572197684645, "rolls from mu",
                  "kappa / (1 + kappa) tan(slope)");
}
