/* Short ways to put load-dependent friction to the test. */
#ifndef PERP_TESTS_FRICTION_RUN_H
#define PERP_TESTS_FRICTION_RUN_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

/* A system with row-major matrices, and everything at hand to ask it. */
typedef struct asked {
    perp_context *context;
    perp_load_friction *friction;
    perp_load_summary summary;
    perp_matrix A, C;
    perp_load_system system;
} asked;

static inline perp_load_system *describe(asked *a, int32_t n, const double *A, const double *b,
                                         const double *C, const double *d, const double *mu)
{
    a->A = matrix_rows(A, n, n);
    a->C = matrix_rows(C, n, n);
    assert_int_equal(perp_load_system_init(&a->system, sizeof a->system), PERP_OK);
    assert_int_equal(perp_struct_init(&a->summary, sizeof a->summary), PERP_OK);
    a->system.n = n;
    a->system.A = &a->A;
    a->system.C = &a->C;
    a->system.b = b;
    a->system.d = d;
    a->system.mu = mu;
    return &a->system;
}

static inline void start(asked *a, const perp_load_settings *settings)
{
    assert_int_equal(perp_context_create(&a->context, NULL), PERP_OK);
    assert_int_equal(perp_load_friction_create(a->context, &a->friction, settings, &a->system),
                     PERP_OK);
}

static inline void finish(asked *a)
{
    perp_load_friction_destroy(a->friction);
    perp_context_destroy(a->context);
}

static inline perp_load_found answer(asked *a, int32_t index)
{
    perp_load_found found;

    assert_int_equal(perp_struct_init(&found, sizeof found), PERP_OK);
    assert_int_equal(perp_load_friction_get(a->friction, &found, index), PERP_OK);
    return found;
}

static inline int32_t ask(asked *a, const double *tau, const double *velocity)
{
    assert_int_equal(perp_load_friction_solve(a->friction, &a->summary, tau, velocity), PERP_OK);
    return a->summary.count;
}

/* Closeness up to `count` roundings of numbers of size 1 or of the expected one. */
static inline void assert_close(double value, double expected, double count)
{
    if (!(fabs(value - expected) <= count * 2.3e-16 * fmax(1.0, fabs(expected))))
        fail_msg("%.17g, expected %.17g", value, expected);
}

#endif
