/* A mechanism of a test's own callbacks, with everything at hand to step it. */
#ifndef PERP_TESTS_MECHANISM_ASKED_H
#define PERP_TESTS_MECHANISM_ASKED_H

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

static inline void near(double value, double expected, double tolerance, const char *what)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s: %.17g, expected %.17g within %.2g", what, value, expected, tolerance);
}

typedef struct asked {
    perp_context *context;
    perp_mechanism *mechanism;
    perp_mechanism_model model;
    perp_mechanism_settings settings;
    perp_mechanism_step step;
} asked;

static inline void asked_begin(asked *a, int32_t velocities, int32_t scheme)
{
    memset(a, 0, sizeof *a);
    assert_int_equal(perp_mechanism_model_init(&a->model, sizeof a->model), PERP_OK);
    assert_int_equal(perp_mechanism_settings_init(&a->settings, sizeof a->settings), PERP_OK);
    assert_int_equal(perp_struct_init(&a->step, sizeof a->step), PERP_OK);
    assert_int_equal(perp_context_create(&a->context, NULL), PERP_OK);
    a->model.velocities = velocities;
    a->settings.scheme = scheme;
}

static inline void asked_make(asked *a)
{
    assert_int_equal(perp_mechanism_create(a->context, &a->mechanism, &a->settings, &a->model),
                     PERP_OK);
}

static inline void asked_end(asked *a)
{
    perp_mechanism_destroy(a->mechanism);
    perp_context_destroy(a->context);
}

/* One step in place, of the scheme that was asked for. */
static inline void asked_step(asked *a, double *q, double *v, double *impulse, int32_t *modes,
                              double t, double h)
{
    if (perp_mechanism_advance(a->mechanism, q, v, impulse, NULL, modes, NULL, &a->step,
                               START(t, h, q, v)) != PERP_OK)
        fail_msg("%s", perp_context_message(a->context));
    assert_int_equal(a->step.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(a->step.scheme, a->settings.scheme);
}

#endif
