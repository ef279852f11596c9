/* A finger that is pushed over a surface, tip ahead: hinged on a carriage that runs along a rail
 * `height` above the surface, pressed down by a torque.
 *
 *   M x'' = F + f,   I a'' = torque - l (N cos a + f sin a),
 *
 * with a the angle between finger and surface, f = -mu N while it slides ahead. The tip stays down:
 *
 *   N = torque / (l (cos a - mu sin a)),
 *
 * which grows without bound as mu -> cot a. For mu < cot a the carriage decelerates evenly, to a
 * stop. For mu >= cot a no sliding force exists at all (Dupont's sliding fingers): the finger jams;
 * the impact without collision leaves no velocity, since its two rows pin both coordinates. */
#include "machines.h"

#include <math.h>

static int32_t finger_mass(double *M, const double *q, void *user)
{
    const machine_finger *finger = &((const machine *)user)->data.finger;

    (void)q;
    M[0] = finger->carriage;
    M[3] = finger->inertia;
    return 0;
}

static int32_t finger_force(double *k, double t, const double *q, const double *v, void *user)
{
    const machine_finger *finger = &((const machine *)user)->data.finger;

    (void)t;
    (void)q;
    (void)v;
    k[0] = finger->force;
    k[1] = finger->torque;
    return 0;
}

static int32_t finger_rows(double *gap, double *H, double *drift, double *mu, double t,
                           const double *q, void *user)
{
    const machine_finger *finger = &((const machine *)user)->data.finger;

    (void)drift;
    (void)mu;
    (void)t;
    gap[0] = finger->height - finger->length * sin(q[1]);
    H[1] = -finger->length * cos(q[1]);
    H[2] = 1;
    H[3] = -finger->length * sin(q[1]);
    return 0;
}

static int32_t finger_curvature(double *bias, double t, const double *q, const double *v,
                                void *user)
{
    const machine_finger *finger = &((const machine *)user)->data.finger;

    (void)t;
    bias[0] = finger->length * sin(q[1]) * v[1] * v[1];
    bias[1] = -finger->length * cos(q[1]) * v[1] * v[1];
    return 0;
}

/* parameter: the angle in degrees. */
void machine_make_finger(machine *m, double parameter)
{
    machine_finger *finger = &m->data.finger;
    const double angle = parameter * MACHINE_PI / 180, mu = 0.5, speed = 1, c = cos(angle),
                 s = sin(angle);

    m->model.velocities = 2;
    m->model.contacts = 1;
    m->model.mass = finger_mass;
    m->model.force = finger_force;
    m->model.contact_rows = finger_rows;
    m->model.curvature = finger_curvature;
    finger->carriage = 1;
    finger->inertia = 0.02;
    finger->length = 0.5;
    finger->height = finger->length * s;
    finger->torque = 1;
    finger->force = 1;
    m->mu[0] = mu;
    m->q[1] = angle;
    m->v[0] = speed;
    m->end = 1;
    if (mu * s < c) {
        const double normal = finger->torque / (finger->length * (c - mu * s)),
                     a = (mu * normal - finger->force) / finger->carriage;
        const char *source = "N = torque / (l (cos a - mu sin a))";

        machine_refer(m, MACHINE_COORDINATE, 0, speed * speed / (2 * a), "x", source);
        machine_refer(m, MACHINE_STOP, 0, speed / a, "stop", source);
        machine_refer(m, MACHINE_OTHER, 0, normal, "normal force", source);
    } else {
        machine_refer(m, MACHINE_COORDINATE, 0, 0, "x", "jams at once");
        machine_refer(m, MACHINE_OTHER, 0, c / s, "friction over normal impulse, without forces",
                      "the impulse that stops the carriage passes through the hinge");
    }
}
