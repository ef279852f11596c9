/* Velocities in what the rows that hold leave free.
 *
 * Let A v = t be the rows that hold: closed normals, sticking tangents, bilateral ones. In
 * mass-weighted coordinates y = L'v (M = L L') the solution of the problem is
 *
 *   y = y_0 + (E - Q Q') L^-1 (momentum + J_free' r_free),    A L^-T y_0 = t,
 *
 * with Q an orthonormal basis of the rows of A L^-T: the impulses of rows that hold drop out, and
 * no cancellation of large impulses touches the result. Where t = 0 and A has full rank, v is 0.0;
 * the same holds for a single coordinate that the rows determine. */
#include <math.h>
#include <string.h>

#include "mechanism/mechanism.h"

/* What the row's velocity J_i v is where it holds. */
static double target_of(const perp_mechanism *m, const perp__velocity_problem *problem, int32_t row)
{
    const double target = 0.0 - problem->terms->drift[row];

    return m->normal_of[row] < 0 ? target : target - problem->shift[m->normal_of[row]];
}

void perp__hold_row(perp_mechanism *m, const perp__terms *terms, int32_t row, double target)
{
    double *next = perp__active_rows_next(&m->held);

    memcpy(next, terms->J + (size_t)row * (size_t)m->n, (size_t)m->n * sizeof *next);
    perp__solve_lower(m, terms, next);
    perp__active_rows_add(&m->held, target);
}

void perp__hold_constraints(perp_mechanism *m, const perp__terms *terms)
{
    perp__active_rows_begin(&m->held, m->n);
    for (int32_t i = 0; i < m->constraints; i++)
        perp__hold_row(m, terms, m->constraint_row[i], 0.0);
    perp__active_rows_solve(&m->held);
}

/* v in m->work, or 0 where that does not agree with the solution. */
static bool hold(perp_mechanism *m, const perp__motion *answer,
                 const perp__velocity_problem *problem)
{
    double *v = m->work, *difference = v + m->n, size;

    perp__active_rows_solve(&m->held);
    memcpy(v, problem->momentum, (size_t)m->n * sizeof *v);
    for (int32_t i = 0; i < m->rows; i++)
        if (!answer->holds[i])
            perp__add_row(m, problem->terms, i, answer->r[i], v);
    perp__solve_lower(m, problem->terms, v);
    size = perp__length(v, m->n) + perp__length(m->held.particular, m->n);
    if (m->held.rank == m->n)
        memset(v, 0, (size_t)m->n * sizeof *v);
    perp__active_rows_free(&m->held, v);
    perp__solve_upper(m, problem->terms, v);
    /* a coordinate that the rows determine, or that one row alone does, has no rounding */
    for (int32_t i = 0; i < m->n && m->held.rank > 0; i++) {
        double *unit = m->held.unit, length;
        bool rests = v[i] == 0.0; /* never -0.0 */

        if (!rests) {
            memset(unit, 0, (size_t)m->n * sizeof *unit);
            unit[i] = 1.0;
            perp__solve_lower(m, problem->terms, unit); /* 0 before i */
            length = perp__length(unit, m->n);
            for (int32_t k = i; k < m->n; k++)
                unit[k] /= length;
            rests = perp__active_rows_fix(&m->held, i, m->n - i);
        }
        if (rests)
            v[i] = 0.0;
    }
    for (int32_t row = 0; row < m->rows; row++) {
        const double *J = problem->terms->J + (size_t)row * (size_t)m->n;
        int32_t only = 0, entries = 0;

        for (int32_t k = 0; k < m->n && answer->holds[row]; k++)
            if (J[k] != 0.0) {
                only = k;
                entries++;
            }
        if (entries == 1)
            v[only] = target_of(m, problem, row) / J[only] + 0.0; /* never -0.0 */
    }
    for (int32_t i = 0; i < m->n; i++)
        difference[i] = v[i] - answer->v[i];
    return perp__energy_norm(m, problem->terms, difference, difference) <= PERP__AGREEMENT * size;
}

void perp__hold_velocities(perp_mechanism *m, perp__motion *answer,
                           const perp__velocity_problem *problem)
{
    bool agrees;

    perp__active_rows_begin(&m->held, m->n);
    for (int32_t i = 0; i < m->rows; i++)
        if (answer->holds[i])
            perp__hold_row(m, problem->terms, i, target_of(m, problem, i));
    agrees = m->held.count == 0 || hold(m, answer, problem);
    if (agrees && m->held.count > 0) /* else the solution's are as good */
        memcpy(answer->v, m->work, (size_t)m->n * sizeof *answer->v);
    perp__row_velocities(m, problem->terms, answer->u, answer->v);
    for (int32_t i = 0; i < m->rows && agrees; i++)
        if (answer->holds[i])
            answer->u[i] = m->normal_of[i] < 0 ? 0.0 : 0.0 - problem->shift[m->normal_of[i]];
}

/* ---- the outcome ----------------------------------------------------------------------------
 *
 * It rests on the laws, which the solvers judge, and on velocities and impulses that belong
 * together: v is made of other things than r. */

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

void perp__check_iterate(perp_mechanism *m, double beside)
{
    const perp__evidence evidence = {beside, beside, beside, 1};

    perp__raise_to(&m->answer.residual, beside);
    m->answer.outcome =
        perp__worse_outcome(m->answer.outcome, perp__gate(&evidence, m->settings.tol, -1));
}

void perp__check_motion(perp_mechanism *m, perp__motion *answer,
                        const perp__velocity_problem *problem)
{
    /* impulses are known as well as the laws are met, up to levers */
    const double tol =
        fmax(PERP__AGREEMENT, PERP__LEVERS * fmax(m->settings.tol, answer->residual));
    perp__evidence evidence = {0.0, 0.0, INFINITY, 1};

    evidence.tested = evidence.own_residual =
        perp__momentum_residual(m, problem->terms, problem->momentum, answer->v, answer->r);
    answer->outcome = perp__worse_outcome(answer->outcome, perp__gate(&evidence, tol, -1));
}

perp_status perp__mechanism_check_end(perp_mechanism *m, const perp__motion *state)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows;
    perp_status status =
        perp__check_finite(m->context, "end of the step: q", state->q, (size_t)m->coordinates);

    PERP__THEN(status, perp__check_finite(m->context, "end of the step: v", state->v, n));
    PERP__THEN(status, perp__check_finite(m->context, "end of the step: impulse", state->r, rows));
    PERP__THEN(status, perp__check_finite(m->context, "end of the step: velocity", state->u, rows));
    return status;
}
