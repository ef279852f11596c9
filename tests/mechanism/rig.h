/* A machine with everything at hand to step it. */
#ifndef PERP_TESTS_MECHANISM_RIG_H
#define PERP_TESTS_MECHANISM_RIG_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "machines.h"

#define RIG_EPS 2.220446049250313e-16

typedef struct rig {
    machine machine;
    perp_context *context;
    perp_mechanism *mechanism;
    perp_mechanism_settings settings;
    perp_mechanism_step step;
    double t, q[MACHINE_ROOM], v[MACHINE_ROOM];
    double impulse[2 * MACHINE_LEGS], velocity[2 * MACHINE_LEGS];
    int32_t modes[MACHINE_LEGS];
} rig;

/* The machine, which may be changed before rig_start, and default settings, too. */
static inline void rig_open(rig *r, int32_t name)
{
    memset(r, 0, sizeof *r);
    machine_make(&r->machine, name);
    assert_int_equal(perp_mechanism_settings_init(&r->settings, sizeof r->settings), PERP_OK);
    assert_int_equal(perp_struct_init(&r->step, sizeof r->step), PERP_OK);
    assert_int_equal(perp_context_create(&r->context, NULL), PERP_OK);
}

static inline void rig_start(rig *r)
{
    assert_int_equal(
        perp_mechanism_create(r->context, &r->mechanism, &r->settings, &r->machine.model), PERP_OK);
    memcpy(r->q, r->machine.q, sizeof r->q);
    memcpy(r->v, r->machine.v, sizeof r->v);
}

/* Requires that the step's problem was solved. */
static inline void rig_step(rig *r, double h)
{
    perp_status status =
        perp_mechanism_advance(r->mechanism, r->q, r->v, r->impulse, r->velocity, r->modes, NULL,
                               &r->step, START(r->t, h, r->q, r->v));

    if (status != PERP_OK)
        fail_msg("%s: %s", r->machine.name, perp_context_message(r->context));
    if (r->step.outcome != PERP_OUTCOME_SOLVED && r->step.outcome != PERP_OUTCOME_ROUNDING_LIMIT)
        fail_msg("%s at %g: %s", r->machine.name, r->t, perp_outcome_text(r->step.outcome));
    r->t += h;
}

static inline void rig_close(rig *r)
{
    perp_mechanism_destroy(r->mechanism);
    perp_context_destroy(r->context);
}

/* Every velocity is 0.0, to the last bit. */
static inline int rig_rests(const rig *r)
{
    int32_t i;

    for (i = 0; i < r->machine.model.velocities; i++)
        if (r->v[i] != 0.0)
            return 0;
    return 1;
}

static inline void near(double value, double expected, double tolerance, const char *what)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s: %.17g, expected %.17g within %.2g", what, value, expected, tolerance);
}

/* A whole run of steps of h to the machine's end. */
static inline void rig_run(machine_record *record, int32_t name,
                           const perp_mechanism_settings *settings, double h)
{
    machine m;
    perp_context *context;

    machine_make(&m, name);
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    if (machine_run(record, context, &m, settings, h, 0) != PERP_OK)
        fail_msg("%s: %s", m.name, perp_context_message(context));
    if (record->result.outcome != PERP_OUTCOME_SOLVED)
        fail_msg("%s: %s", m.name, perp_outcome_text(record->result.outcome));
    perp_context_destroy(context);
}

#endif
