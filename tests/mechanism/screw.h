/* The lead screw of docs/friction.md with compliant contact. */
#ifndef PERP_TESTS_SCREW_H
#define PERP_TESTS_SCREW_H

#include "friction_run.h"

static const double pi = 3.14159265358979323846;

/* J th'' = T - r N sin - r F cos, m x'' = N cos - F sin - W, delta = r th sin - x cos. */
typedef struct screw {
    perp_context *context;
    perp_compliant *compliant;
    perp_compliant_system system;
    perp_matrix mass, normal, tangent;
    double values[4], rows[4], force[2], mu;
} screw;

static const double J = 2e-5, m = 50, r = 0.01, W = 100, mu = 0.2;

static inline void describe_screw(screw *s, double T, double stiffness, double damping)
{
    const double lead = pi / 36;

    s->mu = mu;
    s->values[0] = J;
    s->values[1] = s->values[2] = 0;
    s->values[3] = m;
    s->rows[0] = r * sin(lead);
    s->rows[1] = -cos(lead);
    s->rows[2] = r * cos(lead);
    s->rows[3] = sin(lead);
    s->force[0] = T;
    s->force[1] = -W;
    s->mass = matrix_rows(s->values, 2, 2);
    s->normal = matrix_rows(s->rows, 1, 2);
    s->tangent = matrix_rows(s->rows + 2, 1, 2);
    assert_int_equal(perp_struct_init(&s->system, sizeof s->system), PERP_OK);
    s->system.n = 2;
    s->system.contacts = 1;
    s->system.mass = &s->mass;
    s->system.normal = &s->normal;
    s->system.tangent = &s->tangent;
    s->system.force = s->force;
    s->system.mu = &s->mu;
    s->system.stiffness = stiffness;
    s->system.damping = damping;
}

static inline void start_screw(screw *s, double T, double stiffness, double damping)
{
    describe_screw(s, T, stiffness, damping);
    assert_int_equal(perp_context_create(&s->context, NULL), PERP_OK);
    assert_int_equal(perp_compliant_create(s->context, &s->compliant, &s->system), PERP_OK);
}

static inline void finish_screw(screw *s)
{
    perp_compliant_destroy(s->compliant);
    perp_context_destroy(s->context);
}

static inline void assert_near(double value, double expected, double relative)
{
    if (!(fabs(value - expected) <= relative * fabs(expected)))
        fail_msg("%.17g, expected %.17g", value, expected);
}

#endif
