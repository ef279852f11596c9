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
#include "mechanism/mechanism.h"

#include <string.h>

/* What the row's velocity J_i v is where it holds. */
static double target_of(const perp_mechanism *m, const perp__velocity_problem *problem, int32_t row)
{
    const double target = 0.0 - problem->terms->drift[row];

    return m->normal_of[row] < 0 ? target : target - problem->shift[m->normal_of[row]];
}

void perp__hold_row(perp_mechanism *m, const perp__terms *terms, int32_t row, double target)
{
    double *next = perp__held_rows_next(&m->held);

    memcpy(next, terms->J + (size_t)row * (size_t)m->n, (size_t)m->n * sizeof *next);
    perp__solve_lower(m, terms, next);
    perp__held_rows_take(&m->held, target);
}

void perp__hold_constraints(perp_mechanism *m)
{
    perp__held_rows_begin(&m->held, m->n);
    for (int32_t i = 0; i < m->constraints; i++)
        perp__hold_row(m, &m->begin, m->constraint_row[i], 0.0);
    perp__held_rows_solve(&m->held);
}

/* Whether the rows determine coordinate i, and with rows alone whose targets are 0. */
static int32_t is_at_rest(perp_mechanism *m, const perp__terms *terms, int32_t i)
{
    double *unit = m->held.unit, length;

    memset(unit, 0, (size_t)m->n * sizeof *unit);
    unit[i] = 1.0;
    perp__solve_lower(m, terms, unit); /* 0 before i */
    length = perp__length(unit, m->n);
    for (int32_t k = i; k < m->n; k++)
        unit[k] /= length;
    return perp__held_rows_fix(&m->held, i, m->n - i);
}

/* The only entry of a row that is not 0, or -1. */
static int32_t single_entry(const double *row, int32_t n)
{
    int32_t only = -1, k;

    for (k = 0; k < n; k++)
        if (row[k] != 0.0) {
            if (only >= 0)
                return -1;
            only = k;
        }
    return only;
}

/* A coordinate that the rows determine, or that one row alone does, without rounding. */
static void fix_coordinates(perp_mechanism *m, const perp__motion *answer,
                            const perp__velocity_problem *problem, double *v)
{
    for (int32_t i = 0; i < m->n && m->held.rank > 0; i++)
        if (v[i] == 0.0 || is_at_rest(m, problem->terms, i)) /* never -0.0 */
            v[i] = 0.0;
    for (int32_t row = 0; row < m->rows; row++) {
        const double *J = problem->terms->J + (size_t)row * (size_t)m->n;
        const int32_t only = answer->holds[row] ? single_entry(J, m->n) : -1;

        if (only >= 0)
            v[only] = target_of(m, problem, row) / J[only] + 0.0; /* never -0.0 */
    }
}

/* v in m->work, or 0 where that does not agree with the solution. */
static int32_t hold(perp_mechanism *m, const perp__motion *answer,
                    const perp__velocity_problem *problem)
{
    double *v = m->work, *difference = v + m->n, size;

    perp__held_rows_solve(&m->held);
    memcpy(v, problem->momentum, (size_t)m->n * sizeof *v);
    for (int32_t i = 0; i < m->rows; i++)
        if (!answer->holds[i])
            perp__add_row(m, problem->terms, i, answer->r[i], v);
    perp__solve_lower(m, problem->terms, v);
    size = perp__length(v, m->n) + perp__length(m->held.particular, m->n);
    if (m->held.rank == m->n)
        memset(v, 0, (size_t)m->n * sizeof *v);
    perp__held_rows_free(&m->held, v);
    perp__solve_upper(m, problem->terms, v);
    fix_coordinates(m, answer, problem, v);
    for (int32_t i = 0; i < m->n; i++)
        difference[i] = v[i] - answer->v[i];
    return perp__energy_norm(m, problem->terms, difference, difference) <= PERP__AGREEMENT * size;
}

void perp__hold_velocities(perp_mechanism *m, perp__motion *answer,
                           const perp__velocity_problem *problem)
{
    int32_t agrees;

    perp__held_rows_begin(&m->held, m->n);
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
