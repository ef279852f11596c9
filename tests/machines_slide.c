/* Machines that slide: a brick on a ramp and on a plane, a mass on a belt, a finger. */
#include "machines.h"

#include <math.h>

/* Dry friction of a known bound: m v' in m g sin(slope) + F(t) - mu m g cos(slope) Sgn v, in as
 * many directions as there are velocities, the slope along the first. */

static int32_t ramp_mass(double *M, const double *q, void *user)
{
    const machine *m = user;
    const int32_t n = m->model.velocities;
    int32_t i;

    (void)q;
    for (i = 0; i < n; i++)
        M[i * n + i] = m->data.ramp.mass;
    return 0;
}

static int32_t ramp_force(double *k, double t, const double *q, const double *v, void *user)
{
    const machine_ramp *ramp = &((const machine *)user)->data.ramp;

    (void)q;
    (void)v;
    k[0] = ramp->mass * MACHINE_GRAVITY * sin(ramp->slope) + ramp->force + ramp->rate * t +
           ramp->amplitude * sin(ramp->frequency * t);
    return 0;
}

static int32_t ramp_dry(double *bound, double *B, double *drift, double t, const double *q,
                        const double *v, void *user)
{
    const machine *m = user;
    const machine_ramp *ramp = &m->data.ramp;
    const int32_t n = m->model.velocities;
    int32_t i;

    (void)drift;
    (void)t;
    (void)q;
    (void)v;
    bound[0] = ramp->mu * ramp->mass * MACHINE_GRAVITY * cos(ramp->slope);
    for (i = 0; i < n; i++)
        B[i * n + i] = 1;
    return 0;
}

/* Constant forces: parabolas that end or turn where v = 0. */
static void refer_constant(machine *m)
{
    const machine_ramp *ramp = &m->data.ramp;
    const double drive = MACHINE_GRAVITY * sin(ramp->slope) + ramp->force / ramp->mass,
                 cap = ramp->mu * MACHINE_GRAVITY * cos(ramp->slope), v = m->v[0],
                 a = drive - copysign(cap, v), stop = -v / a;
    const char *source = "parabolas that end or turn where v = 0";

    if (stop > 0 && stop < m->end && fabs(drive) <= cap) {
        machine_refer(m, MACHINE_COORDINATE, 0, -v * v / (2 * a), "x", source);
        machine_refer(m, MACHINE_STOP, 0, stop, "stop", source);
    } else if (stop > 0 && stop < m->end) {
        const double back = drive + copysign(cap, v), rest = m->end - stop;

        machine_refer(m, MACHINE_COORDINATE, 0, -v * v / (2 * a) + back * rest * rest / 2, "x",
                      source);
        machine_refer(m, MACHINE_VELOCITY, 0, back * rest, "v", source);
        machine_refer(m, MACHINE_OTHER, 0, stop, "turn", source);
    } else {
        machine_refer(m, MACHINE_COORDINATE, 0, v * m->end + a * m->end * m->end / 2, "x", source);
        machine_refer(m, MACHINE_VELOCITY, 0, v + a * m->end, "v", source);
    }
}

static void refer_forced(machine *m, int row)
{
    const char *grows = "v = (t - b)^2 / 2 after breaking away at b",
               *shaken = "mpmath: roots and quadrature of v = int 2 sin 2t - 1.1948 dt";

    if (row == 6) {
        m->end = 3;
        machine_refer(m, MACHINE_COORDINATE, 0, 0.98044739125742443, "x", grows);
        machine_refer(m, MACHINE_VELOCITY, 0, 1.6293724473461095, "v", grows);
        machine_refer(m, MACHINE_OTHER, 0, 1.1948005942023416, "breaks away", grows);
        return;
    }
    m->end = 10 * MACHINE_PI;
    machine_refer(m, MACHINE_COORDINATE, 0, 3.9959713267556855, "x", shaken);
    machine_refer(m, MACHINE_OTHER, 0, 0.39959713267556855, "creep", shaken);
    machine_refer(m, MACHINE_OTHER, 0, 0.3201277124458444, "slip starts", shaken);
    machine_refer(m, MACHINE_OTHER, 0, 1.7655745784222461, "slip ends", shaken);
    machine_refer(m, MACHINE_OTHER, 0, 0.49207556375628177, "peak", shaken);
}

static void make_ramp(machine *m)
{
    m->model.velocities = 1;
    m->model.dry = 1;
    m->model.mass = ramp_mass;
    m->model.force = ramp_force;
    m->model.dry_rows = ramp_dry;
    m->data.ramp.mass = 1;
}

/* parameter: the row R1 to R7. */
void machine_make_ramp(machine *m, double parameter)
{
    const int row = (int)parameter;
    machine_ramp *ramp = &m->data.ramp;

    make_ramp(m);
    ramp->slope = MACHINE_PI / 18;
    ramp->mu = row == 5 ? 0.1 : 0.3;
    ramp->force = row == 2 ? 1 : row == 3 ? 3 : 0;
    m->v[0] = row <= 3 ? 2 : row <= 5 ? -2 : 0;
    m->end = row == 2 ? 12 : row == 1 ? 2 : 1;
    ramp->rate = row == 6;
    ramp->amplitude = ramp->frequency = row == 7 ? 2 : 0;
    if (row <= 5)
        refer_constant(m);
    else
        refer_forced(m, row);
}

/* v = 3 in a direction that no axis has, mu = 0.5. */
enum { HEADING_X = 3, HEADING_Y = 4 }; /* over 5 */

static void refer_plane(machine *m)
{
    const double mu = 0.5, speed = 3, length = speed * speed / (2 * mu * MACHINE_GRAVITY);
    const char *source = "straight, over v^2 / (2 mu g)";

    m->v[0] = speed * HEADING_X / 5;
    m->v[1] = speed * HEADING_Y / 5;
    m->end = 0.8;
    machine_refer(m, MACHINE_COORDINATE, 0, length * HEADING_X / 5, "x", source);
    machine_refer(m, MACHINE_COORDINATE, 1, length * HEADING_Y / 5, "y", source);
    machine_refer(m, MACHINE_STOP, 0, speed / (mu * MACHINE_GRAVITY), "stop", source);
}

static int32_t floor_force(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)q;
    (void)v;
    k[2] = -((const machine *)user)->data.ramp.mass * MACHINE_GRAVITY;
    return 0;
}

static int32_t floor_rows(double *gap, double *H, double *drift, double *mu, double t,
                          const double *q, void *user)
{
    (void)drift;
    (void)mu;
    (void)t;
    (void)user;
    gap[0] = q[2];
    H[2] = H[3] = H[7] = 1; /* normal z, tangents x and y */
    return 0;
}

/* parameter: 2, dry friction of a given bound; or 3, with a contact that carries the weight. */
void machine_make_plane(machine *m, double parameter)
{
    make_ramp(m);
    m->model.velocities = parameter > 2 ? 3 : 2;
    if (parameter > 2) {
        m->model.dry = 0;
        m->model.contacts = 1;
        m->model.dim = 3;
        m->model.force = floor_force;
        m->model.contact_rows = floor_rows;
        m->mu[0] = 0.5;
    } else {
        m->model.dry_dim = 2;
        m->data.ramp.mu = 0.5;
    }
    refer_plane(m);
}

/* q = (x, y): a mass on a spring lies on a belt. With mu_static > mu it sticks while the spring
 * pulls with less than mu_static m g, then slips until it has the belt's velocity again. */

static int32_t belt_mass(double *M, const double *q, void *user)
{
    (void)q;
    M[0] = M[3] = ((const machine *)user)->data.belt.mass;
    return 0;
}

static int32_t belt_force(double *k, double t, const double *q, const double *v, void *user)
{
    const machine_belt *belt = &((const machine *)user)->data.belt;

    (void)t;
    (void)v;
    k[0] = -belt->stiffness * q[0];
    k[1] = -belt->mass * belt->gravity;
    return 0;
}

static int32_t belt_rows(double *gap, double *H, double *drift, double *mu, double t,
                         const double *q, void *user)
{
    (void)mu;
    (void)t;
    gap[0] = q[1];
    H[1] = H[2] = 1;
    drift[1] = -((const machine *)user)->data.belt.speed;
    return 0;
}

/* Where it is `t` after it began to stick at x = 0.01: 0.2 of sticking, then an arc of sine about
 * mu m g / k = 0.03. */
static double belt_place(double t)
{
    const double w = 10, stick = 0.2, period = 0.67123889803846899;
    const double phase = fmod(t, period);

    if (phase < stick)
        return 0.01 + 0.2 * phase;
    return 0.03 + 0.02 * cos(w * (phase - stick)) + 0.2 / w * sin(w * (phase - stick));
}

void machine_make_belt(machine *m, double parameter)
{
    machine_belt *belt = &m->data.belt;
    const char *source = "stick 2 (Fs - Fk) / (k V), slip (2 / w) (pi - atan((Fs - Fk) w / (k V)))";

    (void)parameter;
    m->model.velocities = 2;
    m->model.contacts = 1;
    m->model.mass = belt_mass;
    m->model.force = belt_force;
    m->model.contact_rows = belt_rows;
    m->model.mu_static = m->mu_static;
    m->mu[0] = 0.3;
    m->mu_static[0] = 0.5;
    belt->mass = 1;
    belt->stiffness = 100;
    belt->speed = 0.2;
    belt->gravity = 10;
    m->q[0] = 0.01;
    m->v[0] = belt->speed;
    m->end = 2;
    machine_refer(m, MACHINE_COORDINATE, 0, belt_place(m->end), "x", source);
    machine_refer(m, MACHINE_OTHER, 0, 0.2, "stick", source);
    machine_refer(m, MACHINE_OTHER, 0, 0.47123889803846899, "slip", source);
    machine_refer(m, MACHINE_OTHER, 0, 0.67123889803846899, "period", source);
    machine_refer(m, MACHINE_OTHER, 0, 0.058284271247461901, "largest x", source);
    machine_refer(m, MACHINE_OTHER, 0, 0.001715728752538099, "smallest x", source);
}
