/* The second witness for `solved`: each row's violation beside what the row and its neighbours
 * carry.
 *
 * The tested residual is taken beside the largest number of a part of M, so a row of small numbers
 * can hide behind a row of large ones; and a near-singular basis with huge z fools it. A row beside
 * its own terms alone would be too strict: in a right answer some rows consist of rounding. In
 * units in which the largest entry of every row and column of M is near 1 (Ruiz),
 *
 *     t_i   = sum_j |M_ij z_j| + |q_i|
 *     s_j   = max(|z_j|, max of t_k / |M_kj| over rows k with a significant |M_kj|)
 *     own_i = v_i / (t_i + sum_j |M_ij| s_j + floor max t)
 *
 * where v_i is the violation of w_i's sign or equation, s_j how far z_j's own rows would let it
 * move, and the largest t that of the rows that hang together by significant couplings. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "lcp/solver.h"
#include "linalg/lines.h"
#include "linalg/scale.h"

/* What a row may miss beside the largest t, in units of tol: below it the far tail of a solution
 * that fades out would fail at loose tolerances. */
#define FLOOR 1e-5
/* Beside the largest t that much is always granted: rounding. */
#define ROUNDING (16.0 * DBL_EPSILON)

/* How far the scaled rows may differ in size from Ruiz' without a closer look. */
#define RANGE 1024.0

static double floor_of(double tol)
{
    return fmax(FLOOR, ROUNDING / tol);
}

/* Whether no row is far from others in its units, and none hangs on them by a coupling that may be
 * cut, which a look at the first row and column shows: then all rows are beside one largest t. */
static int32_t is_close_knit(const perp_lcp_solver *solver)
{
    const perp__matrix *M = &solver->M;
    const double least = RANGE * sqrt(solver->settings.tol);
    int32_t i;

    if (M->column_starts)
        return 0;
    for (i = 0; i < solver->n; i++) {
        const double above = M->values[(size_t)i * M->column_stride];
        const double below = M->values[(size_t)i * M->row_stride];
        const double size =
            fmax(fabs(above), fabs(below)) * solver->factors[0] * solver->factors[i];

        if (!(size >= least && solver->row_norms[i] >= 0.5 && solver->row_norms[i] <= RANGE))
            return 0;
    }
    return 1;
}

/* Whether the violations are so small that no look at the neighbours is needed: 0, a quarter of
 * what is granted anyway (max |q| is at least 1 in every part), or small beside the row's own q. */
static int32_t is_surely_small(perp_lcp_solver *solver, const perp__evaluation *worth)
{
    const double tol = solver->settings.tol;
    int32_t i;

    if (worth->violation == 0.0)
        return 1;
    if (worth->violation <= 0.25 * ROUNDING) {
        if (solver->close_knit < 0 || solver->witness_tol != tol) {
            solver->close_knit = is_close_knit(solver);
            solver->witness_known = 0;
            solver->witness_tol = tol;
        }
        if (solver->close_knit)
            return 1;
    }
    for (i = 0; i < solver->n; i++)
        if (!(perp__row_violation(solver->z[i], solver->lower[i], solver->upper[i],
                                  solver->w_high[i]) <= tol * fabs(solver->q[i])))
            return 0;
    return 1;
}

/* The entries of M other than 0, one after the other. */
typedef struct cursor {
    const perp__matrix *M;
    perp__line line;
    int32_t at, next; /* the line, and the next of its entries */
    int32_t i, j;     /* row and column of `value` */
    double value;
} cursor;

static cursor first(const perp__matrix *M)
{
    cursor c = {M, {0, NULL, NULL}, -1, 0, 0, 0, 0.0};

    return c;
}

static int32_t advance(cursor *c)
{
    do {
        while (c->next == c->line.count) {
            if (++c->at == c->M->columns)
                return 0;
            c->line = perp__line_of(c->M, c->at);
            c->next = 0;
        }
        c->value = c->line.values[c->next];
        c->i = c->line.indices ? c->line.indices[c->next] : c->next;
        c->next++;
    } while (c->value == 0.0);
    c->j = c->at;
    if (perp__lines_are_rows(c->M)) {
        c->j = c->i;
        c->i = c->at;
    }
    return 1;
}

/* |M_ij| in these units */
static double entry(const int32_t *units, const cursor *c)
{
    return perp__shift(fabs(c->value), units[c->i] + units[c->j]);
}

/* Units, and the parts that are left when couplings below `least` are cut. */
static void look_at_matrix(perp_lcp_solver *solver, double least)
{
    cursor c = first(&solver->M);
    int32_t i;

    memcpy(solver->units, solver->exponents, (size_t)solver->n * sizeof *solver->units);
    perp__balance(&solver->M, solver->units, solver->work);
    for (i = 0; i < solver->n; i++)
        solver->cut[i] = i;
    while (advance(&c))
        if (entry(solver->units, &c) >= least)
            perp__join(solver->cut, c.i, c.j);
    perp__number_parts(solver->cut, solver->n);
    if (solver->witness_tol != solver->settings.tol)
        solver->close_knit = -1;
    solver->witness_tol = solver->settings.tol;
    solver->witness_known = 1;
}

/* v_i; z that is next to a bound, beside what it may carry, counts as on it. */
static double violation_of(const perp_lcp_solver *solver, int32_t i, int32_t omega)
{
    const double near = solver->settings.tol * solver->carried[i];
    const double lower = solver->lower[i], upper = solver->upper[i], z = solver->z[i];
    const int32_t shift = -solver->units[i] - omega;
    const int32_t at_lower = perp__shift(z - lower, shift) <= near;
    const int32_t at_upper = perp__shift(upper - z, shift) <= near;

    if (at_lower && at_upper)
        return 0.0;
    return perp__row_violation(at_lower   ? lower
                               : at_upper ? upper
                                          : z,
                               lower, upper, solver->w_high[i]);
}

void perp__find_terms(perp_lcp_solver *solver, const int32_t *units, const int32_t *omegas)
{
    cursor c = first(&solver->M);
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        solver->carried[i] = perp__shift(fabs(solver->z[i]), -units[i] - omegas[i]);
        solver->terms[i] = perp__shift(fabs(solver->q[i]), units[i] - omegas[i]);
    }
    while (advance(&c))
        solver->terms[c.i] += perp__shift(fabs(c.value * solver->z[c.j]), units[c.i] - omegas[c.i]);
}

/* carried := s, neighbours := t + |M| s, most := the largest t of a cut part. */
static void find_neighbours(perp_lcp_solver *solver, double least)
{
    cursor c = first(&solver->M);
    int32_t i;

    while (advance(&c)) {
        const double size = entry(solver->units, &c);

        if (size >= least && !(solver->terms[c.i] / size <= solver->carried[c.j]))
            solver->carried[c.j] = solver->terms[c.i] / size;
    }
    for (i = 0; i < solver->n; i++) {
        solver->neighbours[i] = solver->terms[i];
        solver->most[i] = 0.0;
    }
    for (c = first(&solver->M); advance(&c);)
        solver->neighbours[c.i] += entry(solver->units, &c) * solver->carried[c.j];
    for (i = 0; i < solver->n; i++)
        perp__raise_to(&solver->most[solver->cut[i]], solver->terms[i]);
}

double perp__lcp_own_residual(perp_lcp_solver *solver, const perp__evaluation *worth)
{
    const double tol = solver->settings.tol, least = sqrt(tol);
    int32_t *omegas = solver->work;
    double own = 0.0;
    int32_t i;

    if (is_surely_small(solver, worth))
        return 0.0;
    if (!solver->witness_known || solver->witness_tol != tol)
        look_at_matrix(solver, least);
    perp__find_omegas(solver, solver->units, omegas, 0);
    perp__find_terms(solver, solver->units, omegas);
    find_neighbours(solver, least);
    for (i = 0; i < solver->n; i++) {
        const double v = violation_of(solver, i, omegas[i]);
        const double size = solver->neighbours[i] + floor_of(tol) * solver->most[solver->cut[i]];

        if (v != 0.0)
            perp__raise_to(&own, perp__shift(v, solver->units[i] - omegas[i]) / size);
    }
    return own;
}

perp__evidence perp__lcp_evidence(perp_lcp_solver *solver, const perp__evaluation *worth,
                                  double unit)
{
    perp__evidence evidence = {worth->tested / unit, INFINITY, worth->backward, 0};

    if (evidence.tested <=
        sqrt(solver->settings.tol)) /* reach: that of z, so z is finite with it */
        evidence.sound = perp__all_finite(solver->reach, (size_t)solver->parts) &&
                         perp__all_finite(solver->w_high, (size_t)solver->n);
    if (evidence.sound)
        evidence.own = perp__lcp_own_residual(solver, worth) / unit;
    return evidence;
}

perp_outcome perp__lcp_judge(perp_lcp_solver *solver, const perp__evaluation *worth,
                             perp_outcome said)
{
    const perp__evidence evidence = perp__lcp_evidence(solver, worth, 1.0);

    return perp__gate(&evidence, solver->settings.tol, said);
}
