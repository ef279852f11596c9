/* Two machines that move on contacts that hold both ways: a drawer between two guides, and a
 * pendulum on a pin. */
#ifndef PERP_TESTS_MECHANISM_MOVING_H
#define PERP_TESTS_MECHANISM_MOVING_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

#define MOVING_PI 3.14159265358979323846

/* q: the mass centre's place, and the angle. */
typedef struct moving {
    perp_context *context;
    perp_mechanism *mechanism;
    perp_mechanism_model model;
    perp_mechanism_settings settings;
    perp_mechanism_step step;
    double mass, inertia, offset, arm, mu[2];
    double force, load, omega; /* of the drawer: force sin(omega t), load cos(omega t) across */
    double t, q[3], v[3], impulse[4], velocity[4];
    int32_t modes[2], two_sided[2];
} moving;

static inline int32_t moving_mass(double *M, const double *q, void *user)
{
    const moving *s = user;

    (void)q;
    M[0] = M[4] = s->mass;
    M[8] = s->inertia;
    return 0;
}

/* The mass centre is `offset` beside the line of the pull and of two pins in guides, 2 `arm` apart:
 * the front one's normal force is -m offset x'' / (2 arm), the other's is the opposite. */
static inline int32_t drawer_force(double *k, double t, const double *q, const double *v,
                                   void *user)
{
    const moving *s = user;

    (void)q;
    (void)v;
    k[0] = s->force * (s->omega > 0 ? sin(s->omega * t) : 1);
    k[1] = s->load * cos(s->omega * t);
    k[2] = k[0] * s->offset;
    return 0;
}

static inline int32_t drawer_contacts(double *gap, double *H, double *drift, double *mu, double t,
                                      const double *q, void *user)
{
    const moving *s = user;
    const double rows[12] = {0, 1, s->arm, 1, 0, s->offset, 0, 1, -s->arm, 1, 0, s->offset};

    (void)drift;
    (void)mu;
    (void)t;
    gap[0] = q[1] + s->arm * q[2];
    gap[1] = q[1] - s->arm * q[2];
    memcpy(H, rows, sizeof rows);
    return 0;
}

/* The mass centre is `arm` below a pin of the radius `offset`. */
static inline int32_t pendulum_force(double *k, double t, const double *q, const double *v,
                                     void *user)
{
    (void)t;
    (void)q;
    (void)v;
    k[1] = -9.81 * ((const moving *)user)->mass;
    return 0;
}

static inline int32_t pendulum_contacts(double *gap, double *H, double *drift, double *mu, double t,
                                        const double *q, void *user)
{
    const moving *s = user;
    const double x = s->arm * sin(q[2]), y = -s->arm * cos(q[2]);

    (void)drift;
    (void)mu;
    (void)t;
    gap[0] = q[0] - x;
    gap[1] = q[1] - y;
    H[0] = H[4] = 1;
    H[2] = y;
    H[5] = -x;
    H[8] = s->offset;
    return 0;
}

static inline void moving_describe(moving *s, int32_t contacts, int32_t normals)
{
    memset(s, 0, sizeof *s);
    assert_int_equal(perp_mechanism_model_init(&s->model, sizeof s->model), PERP_OK);
    assert_int_equal(perp_mechanism_settings_init(&s->settings, sizeof s->settings), PERP_OK);
    assert_int_equal(perp_struct_init(&s->step, sizeof s->step), PERP_OK);
    s->model.velocities = 3;
    s->model.contacts = contacts;
    s->model.dim = normals + 1;
    s->two_sided[0] = s->two_sided[1] = normals;
    s->model.two_sided = s->two_sided;
    s->model.mu = s->mu;
    s->model.mass = moving_mass;
    s->model.user = s;
}

/* z = 2 mu h / L says what friction takes: m (1 +- z) x'' = F. */
static inline void moving_drawer(moving *s, double mass, double offset, double guide, double mu)
{
    moving_describe(s, 2, 1);
    s->model.force = drawer_force;
    s->model.contact_rows = drawer_contacts;
    s->mass = mass;
    s->inertia = 0.7; /* it does not turn */
    s->offset = offset;
    s->arm = guide / 2;
    s->mu[0] = s->mu[1] = mu;
}

static inline void moving_pendulum(moving *s, double mu, double angle)
{
    moving_describe(s, 1, 2);
    s->model.force = pendulum_force;
    s->model.contact_rows = pendulum_contacts;
    s->mass = 2;
    s->inertia = 0.1;
    s->arm = 0.5;
    s->offset = 0.1;
    s->mu[0] = mu;
    s->q[0] = s->arm * sin(angle);
    s->q[1] = -s->arm * cos(angle);
    s->q[2] = angle;
}

static inline void moving_open(moving *s, const perp_context_settings *settings)
{
    assert_int_equal(perp_context_create(&s->context, settings), PERP_OK);
    if (perp_mechanism_create(s->context, &s->mechanism, &s->settings, &s->model) != PERP_OK)
        fail_msg("%s", perp_context_message(s->context));
}

static inline void moving_close(moving *s)
{
    perp_mechanism_destroy(s->mechanism);
    perp_context_destroy(s->context);
}

/* A step that has to be solved; its contacts hold. */
static inline void moving_step(moving *s, double h)
{
    int32_t j, i;

    if (perp_mechanism_advance(s->mechanism, s->q, s->v, s->impulse, s->velocity, s->modes, NULL,
                               &s->step, START(s->t, h, s->q, s->v)) != PERP_OK)
        fail_msg("%s", perp_context_message(s->context));
    if (s->step.outcome != PERP_OUTCOME_SOLVED)
        fail_msg("at %g: %s", s->t, perp_outcome_text(s->step.outcome));
    s->t += h;
    for (j = 0; j < s->model.contacts; j++)
        for (i = 0; i < s->two_sided[j]; i++)
            assert_true(s->velocity[j * s->model.dim + i] == 0.0 ||
                        s->settings.scheme == PERP_MECHANISM_IMPLICIT); /* that of its end */
}

/* In equal steps or, with settings.error, in those of its choice: the sum of their estimates. */
static inline double moving_run(moving *s, double end, double h)
{
    perp_mechanism_run_result result;

    assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
    if (perp_mechanism_run(s->mechanism, s->q, s->v, &result, START(s->t, h, s->q, s->v), end, NULL,
                           NULL) != PERP_OK)
        fail_msg("%s", perp_context_message(s->context));
    if (result.outcome != PERP_OUTCOME_SOLVED && result.outcome != PERP_OUTCOME_ROUNDING_LIMIT)
        fail_msg("at %g: %s", result.t, perp_outcome_text(result.outcome));
    s->t = result.t;
    return result.error;
}

/* Beside numbers of size 1 or the expected one. */
static inline void moving_near(double value, double expected, double tolerance, const char *what)
{
    if (!(fabs(value - expected) <= tolerance * fmax(1.0, fabs(expected))))
        fail_msg("%s is %.17g, expected %.17g within %.2g", what, value, expected, tolerance);
}

#endif
