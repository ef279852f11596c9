/* What the outcome of velocities and impulses rests on beside the laws, which the solvers judge:
 * v is made of other things than r (hold.c), and the two have to belong together. */
#include <math.h>

#include "base/context.h"
#include "mechanism/mechanism.h"

/* What bodies and levers make of a residual: up to 6 was seen in random problems. */
#define LEVERS 16.0

double perp__momentum_residual(perp_mechanism *m, const perp__terms *terms, const double *momentum,
                               const double *v, const double *r)
{
    const size_t n = (size_t)m->n;
    double *sum = m->work, *size = sum + n, worst = 0.0, largest = 0.0;

    for (size_t i = 0; i < n; i++) {
        sum[i] = -momentum[i];
        size[i] = fabs(sum[i]);
        for (size_t k = 0; k < n; k++) {
            const double term = terms->M[i * n + k] * v[k];

            sum[i] += term;
            size[i] += fabs(term);
        }
    }
    for (size_t i = 0; i < (size_t)m->rows; i++)
        for (size_t k = 0; k < n && r[i] != 0.0; k++) {
            const double term = terms->J[i * n + k] * r[i];

            sum[k] -= term;
            size[k] += fabs(term);
        }
    for (size_t i = 0; i < n; i++) { /* in units of one energy */
        const double unit = sqrt(terms->M[i * (n + 1)]);

        perp__raise_to(&worst, fabs(sum[i]) / unit);
        perp__raise_to(&largest, size[i] / unit);
    }
    return worst > 0.0 ? worst / largest : worst;
}

void perp__judge_motion(perp_mechanism *m, perp__motion *answer,
                        const perp__velocity_problem *problem)
{
    /* impulses are known as well as the laws are met, up to levers */
    const double tol = fmax(PERP__AGREEMENT, LEVERS * fmax(m->settings.tol, answer->residual));
    perp__evidence evidence = {0.0, 0.0, INFINITY, 1};

    evidence.tested = evidence.own =
        perp__momentum_residual(m, problem->terms, problem->momentum, answer->v, answer->r);
    answer->outcome = perp__worse_outcome(answer->outcome, perp__gate(&evidence, tol, -1));
}

perp_status perp__check_entries(perp_mechanism *m, const char *name, const double *x, int32_t count)
{
    for (int32_t i = 0; i < count; i++)
        if (!isfinite(x[i]))
            return perp__fail(m->context, PERP_ERROR_NOT_FINITE, "%s: entry %d is %g", name, (int)i,
                              x[i]);
    return PERP_OK;
}

perp_status perp__mechanism_check_end(perp_mechanism *m, const perp__motion *state)
{
    perp_status status =
        perp__check_entries(m, "q at the end of the step", state->q, m->coordinates);

    PERP__THEN(status, perp__check_entries(m, "v at the end of the step", state->v, m->n));
    PERP__THEN(status, perp__check_entries(m, "impulse at the end of the step", state->r, m->rows));
    PERP__THEN(status,
               perp__check_entries(m, "velocity at the end of the step", state->u, m->rows));
    return status;
}
