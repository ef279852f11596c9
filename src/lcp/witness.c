/* The second witness for `solved`: each row's violation beside what the row and its neighbours
 * carry.
 *
 * The tested residual is taken beside the largest number of a part of M, so a row of small numbers
 * can hide behind a row of large ones; and a near-singular basis with huge z fools it. A row beside
 * its own terms alone would be too strict: in a right answer some rows consist of rounding. In
 * units in which the largest entry of every row and column of M is near 1 (Ruiz),
 *
 *     t_i   = sum_j |M_ij z_j| + |q_i|
 *     s_j   = |z_j|, and where z_j is free the largest t_k / |M_kj| of rows k that cancel,
 *             |w_k| <= sqrt(tol) t_k, with a significant |M_kj| >= sqrt(tol)
 *     own_i = v_i / (t_i + sum_j |M_ij| s_j + floor max t)
 *
 * where v_i is the violation of w_i's sign or equation, and s_j the size of which z_j carries
 * roundings. Roundings arise where terms cancel and travel through free variables; rows and
 * variables at rest pass none on. The largest t is that of the rows that cancel, among those that
 * hang together by significant couplings.
 *
 * Units are not unique: of two diagonals of different sign one can be noise beside their coupling,
 * and nobody knows which. Then the search for units starts from either, and the worse one counts.
 */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "lcp/solver.h"
#include "lcp/witness.h"
#include "linalg/lines.h"
#include "linalg/scale.h"

/* What a row may miss beside the largest t, in units of tol: below it the far tail of a solution
 * that fades out would fail at loose tolerances. */
#define FLOOR 1e-5
/* Beside the largest t that much is always granted: rounding. */
#define ROUNDING (16.0 * DBL_EPSILON)

/* Couplings below this are what stands in the place of zeros (linalg/scale.c). */
#define NOISE 0x1p-40

/* Sizes below this have lost digits, or all, to underflow. */
#define LEAST_SIZE 0x1p-960

static double floor_of(double tol)
{
    return fmax(FLOOR, ROUNDING / tol);
}

/* sum_j |M_ij z_j| + |q_i| of a row of a dense M. */
static double terms_of_row(const perp_lcp_solver *solver, int32_t i)
{
    const double *row = solver->M.values + (size_t)i * solver->M.row_stride;
    double sum = fabs(solver->q[i]);
    int32_t j;

    for (j = 0; j < solver->n; j++)
        sum += fabs(row[(size_t)j * solver->M.column_stride] * solver->z[j]);
    return isfinite(sum) ? sum : 0.0; /* what overflows proves nothing */
}

/* Whether every violation is small beside q_i alone, or the terms of its row. */
static int32_t is_surely_small(const perp_lcp_solver *solver)
{
    const double tol = solver->settings.tol;
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        const double v = perp__row_violation(solver->z[i], solver->lower[i], solver->upper[i],
                                             solver->w_high[i]);

        if (!(v <= tol * fabs(solver->q[i])) &&
            (solver->M.column_starts || !(v <= tol * terms_of_row(solver, i))))
            return 0;
    }
    return 1;
}

/* |M_ij| in these units */
static double entry(const int32_t *units, const perp__cursor *c)
{
    return perp__shift(fabs(c->value), units[c->i] + units[c->j]);
}

static void join_couplings(const perp_lcp_solver *solver, perp__witness_units *u, double least)
{
    perp__cursor c = perp__first(&solver->M);

    while (perp__advance(&c))
        if (entry(u->exponents, &c) >= least)
            perp__join(u->cut, c.i, solver->n + c.j);
}

static void start_apart(const perp_lcp_solver *solver, perp__witness_units *u)
{
    int32_t i;

    for (i = 0; i < 2 * solver->n; i++)
        u->cut[i] = i;
}

/* The parts that are left when couplings below `least` are cut. z_i and w_i hang together unless M,
 * but for noise, falls into parts between them: then there is no common size. */
static void find_cut(perp_lcp_solver *solver, perp__witness_units *u, double least)
{
    const int32_t n = solver->n;
    int32_t *tied = solver->work;
    int32_t i;

    start_apart(solver, u);
    join_couplings(solver, u, NOISE);
    perp__number_parts(u->cut, 2 * n);
    for (i = 0; i < n; i++)
        tied[i] = u->cut[i] == u->cut[n + i];
    start_apart(solver, u);
    for (i = 0; i < n; i++)
        if (tied[i])
            perp__join(u->cut, i, n + i);
    join_couplings(solver, u, least);
    perp__number_parts(u->cut, 2 * n);
}

static void look_at_matrix(perp_lcp_solver *solver, double least)
{
    perp__witness *witness = &solver->witness;
    int32_t k;

    memcpy(witness->units[0].exponents, solver->exponents,
           (size_t)solver->n * sizeof *solver->exponents);
    witness->count = 1;
    if (solver->settings.scaling)
        witness->count +=
            perp__equilibrate_negative(&solver->M, witness->units[1].exponents, solver->work);
    for (k = 0; k < witness->count; k++) {
        perp__balance(&solver->M, witness->units[k].exponents, solver->work);
        find_cut(solver, &witness->units[k], least);
    }
    witness->tol = solver->settings.tol;
    witness->known = 1;
}

void perp__find_terms(perp_lcp_solver *solver, const int32_t *units, const int32_t *omegas)
{
    perp__witness *witness = &solver->witness;
    perp__cursor c = perp__first(&solver->M);
    int32_t i;

    for (i = 0; i < solver->n; i++)
        witness->terms[i] = perp__shift(fabs(solver->q[i]), units[i] - omegas[i]);
    while (perp__advance(&c))
        witness->terms[c.i] +=
            perp__shift(fabs(c.value * solver->z[c.j]), units[c.i] - omegas[c.i]);
}

/* v_i; z that is next to a bound, beside what it may carry, counts as on it. Then it is not free.
 */
static double violation_of(const perp_lcp_solver *solver, const perp__witness_units *u, int32_t i,
                           double near, int32_t *is_free)
{
    const double lower = solver->lower[i], upper = solver->upper[i], z = solver->z[i];
    const int32_t shift = -u->exponents[i] - solver->witness.omegas[solver->n + i];
    const int32_t at_lower = perp__shift(z - lower, shift) <= near;
    const int32_t at_upper = perp__shift(upper - z, shift) <= near;

    *is_free = !at_lower && !at_upper;
    if (at_lower && at_upper)
        return 0.0;
    return perp__row_violation(at_lower   ? lower
                               : at_upper ? upper
                                          : z,
                               lower, upper, solver->w_high[i]);
}

/* wrong := v; carried := |z_j|, or INFINITY where z_j is free: what its rows give comes next. A
 * bound is near beside all that z_j's rows, whether they cancel or not, would let it be. */
static void find_violations(perp_lcp_solver *solver, const perp__witness_units *u, double least)
{
    perp__witness *witness = &solver->witness;
    perp__cursor c = perp__first(&solver->M);
    int32_t i;

    for (i = 0; i < solver->n; i++)
        witness->carried[i] =
            perp__shift(fabs(solver->z[i]), -u->exponents[i] - witness->omegas[solver->n + i]);
    while (perp__advance(&c)) {
        const double size = entry(u->exponents, &c);

        if (size >= least && !(witness->terms[c.i] <= size * witness->carried[c.j]))
            witness->carried[c.j] = witness->terms[c.i] / size;
    }
    for (i = 0; i < solver->n; i++) {
        const int32_t shift = u->exponents[i] - witness->omegas[i];
        const double near = solver->settings.tol * witness->carried[i];

        witness->wrong[i] =
            perp__shift(violation_of(solver, u, i, near, &witness->is_free[i]), shift);
        witness->carried[i] =
            perp__shift(fabs(solver->z[i]), -u->exponents[i] - witness->omegas[solver->n + i]);
        if (!(perp__shift(fabs(solver->w_high[i]), shift) <= least * witness->terms[i]))
            witness->rounding[i] = 0.0;
        else
            witness->rounding[i] = witness->terms[i];
    }
}

/* around := t + |M| s, most := the largest t of a row of a cut part that cancels. */
static void find_neighbours(perp_lcp_solver *solver, const perp__witness_units *u, double least)
{
    perp__witness *witness = &solver->witness;
    perp__cursor c = perp__first(&solver->M);
    int32_t i;

    while (perp__advance(&c)) {
        const double size = entry(u->exponents, &c);

        if (witness->is_free[c.j] && size >= least &&
            !(witness->rounding[c.i] <= size * witness->carried[c.j]))
            witness->carried[c.j] = witness->rounding[c.i] / size;
    }
    for (i = 0; i < solver->n; i++) {
        witness->around[i] = witness->terms[i];
        witness->most[i] = witness->most[solver->n + i] = 0.0;
    }
    for (c = perp__first(&solver->M); perp__advance(&c);)
        witness->around[c.i] += entry(u->exponents, &c) * witness->carried[c.j];
    for (i = 0; i < solver->n; i++)
        perp__raise_to(&witness->most[u->cut[i]], witness->rounding[i]);
}

/* A row so much smaller than others of its part that their common unit underflows, or whose terms
 * overflow: its violation beside its own terms, in the caller's units. */
static double alone(const perp_lcp_solver *solver, int32_t i)
{
    const double v =
        perp__row_violation(solver->z[i], solver->lower[i], solver->upper[i], solver->w_high[i]);
    double terms = fabs(solver->q[i]);
    perp__cursor c = perp__first(&solver->M);

    while (v != 0.0 && perp__advance(&c))
        if (c.i == i)
            terms += fabs(c.value * solver->z[c.j]);
    return v != 0.0 ? (terms < INFINITY ? v / terms : INFINITY) : 0.0;
}

static double own_residual(perp_lcp_solver *solver, const perp__witness_units *u)
{
    const double tol = solver->settings.tol, least = sqrt(tol);
    perp__witness *witness = &solver->witness;
    double own = 0.0;
    int32_t i;

    perp__find_omegas(solver, u->exponents, witness->omegas, 0);
    perp__find_terms(solver, u->exponents, witness->omegas);
    find_violations(solver, u, least);
    find_neighbours(solver, u, least);
    for (i = 0; i < solver->n; i++) {
        const double size = witness->around[i] + floor_of(tol) * witness->most[u->cut[i]];

        if (!(size >= LEAST_SIZE && size < INFINITY))
            perp__raise_to(&own, alone(solver, i));
        else if (witness->wrong[i] != 0.0)
            perp__raise_to(&own, witness->wrong[i] / size);
    }
    return own;
}

double perp__lcp_own_residual(perp_lcp_solver *solver)
{
    perp__witness *witness = &solver->witness;
    double own = 0.0;
    int32_t k;

    if (is_surely_small(solver))
        return 0.0;
    if (!witness->known || witness->tol != solver->settings.tol)
        look_at_matrix(solver, sqrt(solver->settings.tol));
    for (k = 0; k < witness->count; k++)
        perp__raise_to(&own, own_residual(solver, &witness->units[k]));
    return own;
}

void perp__witness_layout(perp__arena *arena, perp__witness *witness, size_t n)
{
    int32_t k;

    for (k = 0; k < 2; k++) {
        witness->units[k].exponents = perp__arena_take(arena, n, sizeof(int32_t));
        witness->units[k].cut = perp__arena_take(arena, 2 * n, sizeof(int32_t));
    }
    witness->omegas = perp__arena_take(arena, 2 * n, sizeof(int32_t));
    witness->is_free = perp__arena_take(arena, n, sizeof(int32_t));
    witness->terms = perp__arena_take(arena, n, sizeof(double));
    witness->carried = perp__arena_take(arena, n, sizeof(double));
    witness->rounding = perp__arena_take(arena, n, sizeof(double));
    witness->wrong = perp__arena_take(arena, n, sizeof(double));
    witness->around = perp__arena_take(arena, n, sizeof(double));
    witness->most = perp__arena_take(arena, 2 * n, sizeof(double));
}

perp__evidence perp__lcp_evidence(perp_lcp_solver *solver, const perp__evaluation *worth,
                                  double unit)
{
    perp__evidence evidence = {worth->tested / unit, INFINITY, worth->backward, 0};

    if (evidence.tested <= sqrt(solver->settings.tol))
        evidence.sound = perp__all_finite(solver->z, (size_t)solver->n) &&
                         perp__all_finite(solver->w_high, (size_t)solver->n);
    if (evidence.sound) /* beside its own terms a row has no large numbers of others to excuse it */
        evidence.own = perp__lcp_own_residual(solver);
    return evidence;
}

perp_outcome perp__lcp_judge(perp_lcp_solver *solver, const perp__evaluation *worth,
                             perp_outcome said)
{
    const perp__evidence evidence = perp__lcp_evidence(solver, worth, 1.0);

    return perp__gate(&evidence, solver->settings.tol, said);
}
