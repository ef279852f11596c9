/* Penetration and the drift of bilateral constraints are removed from the positions alone:
 *
 *   min 1/2 d'M d   subject to   gap + n'd >= 0,   c + G d = 0,   q := q + N d,
 *
 * a frictionless contact problem, solved with the rows at q and then again, until what is left is
 * rounding (Newton's method) or until that stops to help. Where overlaps have no way out (opposed
 * walls) q stays. Only contacts that d closes are part of the problem.
 *
 * A contact that pressed until the end of a theta step has the equation gap + n'd = 0 instead. What
 * the step's own error, or an extrapolation, leaves of its gap (of order h^3) would otherwise have
 * to fall shut in the next step, whose velocity then is wrong by g h: a disk that rolls has every
 * second of its steps refused for that. */
#include "mechanism/mechanism.h"

#include <float.h>
#include <math.h>
#include <string.h>

double perp__gap_size(const perp_mechanism *m, const perp__terms *terms, int32_t row,
                      const double *q)
{
    const double *J = terms->J + (size_t)row * (size_t)m->n;
    double size = 0.0, largest = 0.0;

    for (int32_t i = 0; i < m->coordinates && m->coordinates != m->n; i++)
        largest = fmax(largest, fabs(q[i]));
    for (int32_t i = 0; i < m->n; i++)
        size += fabs(J[i]) * (m->coordinates == m->n ? fabs(q[i]) : largest);
    return size;
}

double perp__gap_rounding(const perp_mechanism *m, const perp__terms *terms, int32_t row,
                          const double *q)
{
    /* products below DBL_MIN lose their digits, and not as a share of their size */
    return PERP__ROUNDING_LIMIT * perp__gap_size(m, terms, row, q) + DBL_MIN;
}

/* Whether contact j pressed until the end of a theta step, and was at rest on the ground before, up
 * to what the forces of a step make of its speed, so that its gap is to be 0. */
static bool presses(const perp_mechanism *m, const perp__motion *to, int32_t j)
{
    const int32_t row = m->starts[j];
    const double before = m->start_velocity[row];

    return m->settings.scheme == PERP_MECHANISM_THETA && m->two_sided[j] == 0 && to->r[row] > 0.0 &&
           fabs(before) <= fabs(m->free_velocity[row] - before);
}

/* The largest gap of those. */
static double lifted(const perp_mechanism *m, const perp__motion *to)
{
    double largest = 0.0;

    for (int32_t j = 0; j < m->contacts; j++)
        if (presses(m, to, j) &&
            m->end.gap[j] > perp__gap_rounding(m, &m->end, m->starts[j], to->q))
            largest = fmax(largest, m->end.gap[j]);
    return largest;
}

int32_t perp__measure_overlap(const perp_mechanism *m, perp_mechanism_step *step, const double *q)
{
    int32_t more = 0, j;

    step->penetration = step->drift = 0.0;
    for (j = 0; j < m->contacts; j++) {
        const double rounding = perp__gap_rounding(m, &m->end, m->starts[j], q);

        step->penetration = fmax(step->penetration, -m->end.gap[j]);
        more = more || (!m->apart[j] && -m->end.gap[j] > rounding);
    }
    for (j = 0; j < m->constraints; j++) {
        step->drift = fmax(step->drift, fabs(m->end.c[j]));
        more = more || fabs(m->end.c[j]) > perp__gap_rounding(m, &m->end, m->constraint_row[j], q);
    }
    return more;
}

/* Of the displacement's problem; how many rows hold both ways. to: NULL: pressing contacts, too,
 * have gaps that may grow. */
static int32_t assemble(perp_mechanism *m, perp__assembly *a, const perp__motion *to)
{
    const size_t n = (size_t)m->n;
    int32_t held = m->constraints;

    a->columns = m->n;
    a->contacts = a->rows = 0;
    memcpy(a->M, m->end.M, n * n * sizeof *a->M);
    memset(a->f, 0, n * sizeof *a->f);
    for (int32_t j = 0; j < m->constraints; j++) {
        memcpy(a->G + (size_t)j * n, m->end.J + (size_t)m->constraint_row[j] * n, n * sizeof *a->G);
        a->b[j] = m->end.c[j];
    }
    for (int32_t j = 0; j < m->contacts; j++) {
        const bool both = to && presses(m, to, j);

        if (!m->included[j] && !both)
            continue;
        memcpy(both ? a->G + (size_t)held * n : a->H + (size_t)a->rows * n,
               m->end.J + (size_t)m->starts[j] * n, n * sizeof *a->H);
        if (both) {
            a->b[held++] = m->end.gap[j];
            continue;
        }
        a->w[a->rows++] = m->end.gap[j];
        a->mu[a->contacts] = 0.0;
        a->two_sided[a->contacts] = 0;
        a->dims[a->contacts++] = 1;
    }
    return held;
}

/* m->projection.v := the displacement; found: whether there is one. Up to one gap that may open it
 * is that of equations; the contact solver tells which of several do. */
static perp_status solve(perp_mechanism *m, perp_mechanism_step *step, const perp__motion *to,
                         int32_t *found)
{
    perp__motion answer = {0};
    perp_status status = PERP_OK;
    int32_t only = -1, several = 0; /* the gap that may open */
    double *d = m->projection.v;
    int8_t more;

    memset(m->included, 0, (size_t)m->contacts * sizeof *m->included);
    do {
        /* 1. equations, and `only`, which these alone would leave overlapping, so that it presses;
         * as long as they are independent, and d is finite */
        *found = !several;
        if (!several) {
            perp__active_rows_begin(&m->held, m->n);
            for (int32_t j = 0; j < m->constraints; j++)
                perp__hold_row(m, &m->end, m->constraint_row[j], -m->end.c[j]);
            for (int32_t j = 0; j < m->contacts; j++)
                if (j == only || (to && presses(m, to, j)))
                    perp__hold_row(m, &m->end, m->starts[j], -m->end.gap[j]);
            perp__active_rows_solve(&m->held);
            memcpy(d, m->held.particular, (size_t)m->n * sizeof *d);
            perp__solve_upper(m, &m->end, d);
            *found = m->held.rank == m->held.count && perp__all_finite(d, (size_t)m->n);
        }
        answer.iterations = *found;
        /* 2. else a contact problem */
        if (!*found) {
            status =
                perp__assembly_solve(m, &m->projection, assemble(m, &m->projection, to), &answer);
            *found = status == PERP_OK && perp__outcome_moves(answer.outcome);
        }
        step->iterations += answer.iterations;
        /* 3. with the contacts that the displacement would close */
        more = 0;
        for (int32_t j = 0; j < m->contacts && *found; j++) {
            const double gap = perp__row_times(m, &m->end, m->starts[j], m->end.gap[j], d);

            if (m->included[j] || m->apart[j] || m->two_sided[j] > 0 || (to && presses(m, to, j)) ||
                !(gap < 0.0))
                continue;
            m->included[j] = more = 1;
            several = only >= 0;
            only = j;
        }
    } while (more);
    return status;
}

perp_status perp__project(perp_mechanism *m, perp_mechanism_step *step, perp__motion *to, double t)
{
    double *q = to->q, *v = to->v;
    perp_status status;
    int32_t helps = m->settings.project;

    step->penetration = step->drift = 0.0;
    if (m->contacts + m->bilateral == 0)
        return PERP_OK;
    status = perp__evaluate_rows(m, &m->end, t, q, v);
    for (int32_t pass = 0;
         status == PERP_OK && (perp__measure_overlap(m, step, q) || lifted(m, to) > 0.0) && helps &&
         pass < PERP__MOST_ITERATES && !(pass > 0 && perp__mechanism_is_late(m));
         pass++) {
        const double penetration = step->penetration, drift = step->drift, gap = lifted(m, to);
        int32_t found = 0;

        /* 1. a displacement of q */
        status = perp__evaluate_mass(m, &m->end, q);
        PERP__THEN(status, solve(m, step, to, &found));
        if (status == PERP_OK && !found)
            status = solve(m, step, NULL, &found);
        helps = found;
        if (status != PERP_OK || !found)
            continue;
        /* 2. it is kept if it helps; m->end follows */
        status = perp__evaluate_move(m, m->moved, q, q, 1.0, m->projection.v);
        PERP__THEN(status, perp__evaluate_rows(m, &m->end, t, m->moved, v));
        if (status != PERP_OK)
            continue;
        perp__measure_overlap(m, step, m->moved);
        helps = step->penetration < penetration || step->drift < drift || lifted(m, to) < gap;
        if (helps)
            memcpy(q, m->moved, (size_t)m->coordinates * sizeof *q);
        else
            status = perp__evaluate_rows(m, &m->end, t, q, v);
    }
    if (status == PERP_OK)
        perp__keep_rows(m, t, q, v);
    return status;
}
