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
 * And each row must hold to sqrt(tol) of what it carries itself at an ordinary size of z, in these
 * units and in those of its rows: docs/lcp.md has this rule. Rows without a right side hold at z =
 * 0: where setting what they consist of to 0 leaves all other rows as good as they must be, their
 * terms were rounding alone. Contradictions need a right side (Farkas).
 *
 * Units are not unique. Those of the equilibration come from diagonals and from couplings to them:
 * where one may be noise, as in [[1e-13, 4], [-4, 0]], the caller's units are balanced instead. */
#include "linalg/witness.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/outcome.h"
#include "linalg/scale.h"

/* Couplings below this are what stands in the place of zeros (linalg/scale.c). */
#define NOISE perp__power_of_two(-PERP__NOISE)

/* Exponents of units of the size that a caller may have chosen. */
#define CHOSEN_UNIT 100

/* Exponents from which on a unit may be that of the end of doubles (linalg/scale.c), and products
 * in units leave them. */
#define FARTHEST_UNIT 500
#define FARTHEST 1400

static double violation_of_row(const perp__witness_point *p, int32_t i)
{
    return perp__row_violation(p->z[i], p->lower[i], p->upper[i], p->w[i]);
}

/* |M_ij| in these units, which are clamped so that the power is a normal number. */
static double entry(const perp__witness *t, const perp__cursor *c)
{
    return fabs(c->value) * perp__power_of_two(t->exponents[c->i] + t->exponents[c->j]);
}

/* cut := the parts of M by couplings of at least `least`, and by the rows and columns that are
 * tied; is_free := which rows hang together with their columns then. Returns whether all do. */
static int32_t cut_and_tie(perp__witness *t, const perp__matrix *M, double least,
                           const int32_t *tied)
{
    int32_t all = 1;

    for (int32_t i = 0; i < M->rows; i++)
        t->scales[i] = perp__power_of_two(-t->exponents[i]);
    perp__cut_parts(M, t->scales, t->scales, least, tied, t->cut);
    for (int32_t i = 0; i < M->rows; i++) {
        t->is_free[i] = t->cut[i] == t->cut[M->rows + i];
        all &= t->is_free[i];
    }
    return all;
}

/* Whether a diagonal that a row's unit is found from is noise beside a coupling, in the caller's
 * units and in any: then it is small beside both diagonals, which units far apart do not make it.
 * Or whether a coupling is that no unit explains, since that which gave a row its unit was noise.
 * The caller's units tell what is noise, but nobody chose any that are very far apart. */
static int32_t has_noise(perp__witness *t, const perp__witness_point *p)
{
    int32_t *e = t->exponents, found = 0, is_far = 0;
    double *diagonal = t->carried;

    for (int32_t i = 0; i < p->M->rows; i++) {
        diagonal[i] = fabs(perp__entry(p->M, i, i));
        is_far |= abs(p->exponents[i]) > CHOSEN_UNIT;
    }
    if (is_far)
        return 0;
    perp__find_exponents(p->M, e, t->omegas);
    for (perp__cursor c = perp__first(p->M); !found && perp__advance(&c);) {
        const double size = fabs(c.value), noise = 4.0 * NOISE * size;
        const double a = diagonal[c.i], b = diagonal[c.j];

        if (c.i == c.j)
            continue;
        found = ((a != 0.0 && a <= noise) || (b != 0.0 && b <= noise)) && a * b <= noise * size;
        found |= perp__exponent_of(size) + e[c.i] + e[c.j] >= PERP__NOISE / 2;
    }
    return found;
}

/* Units, and the parts that are left when couplings below sqrt(tol) are cut. z_i and w_i hang
 * together unless M, but for noise, falls into parts between them: then there is no common size. */
static void find_units(perp__witness *t, const perp__witness_point *p)
{
    const size_t bytes = (size_t)p->M->rows * sizeof *t->exponents;

    if (!t->known) {
        if (has_noise(t, p))
            memset(t->exponents, 0, bytes);
        else
            memcpy(t->exponents, p->exponents, bytes);
        perp__balance(p->M, t->exponents, t->omegas);
        t->known = 1;
        t->tol = 0.0;
    }
    if (t->tol == p->tol)
        return;
    t->tol = p->tol;
    if (cut_and_tie(t, p->M, sqrt(p->tol), NULL)) /* so much the more by smaller couplings */
        return;
    cut_and_tie(t, p->M, NOISE, NULL);
    cut_and_tie(t, p->M, sqrt(p->tol), t->is_free);
}

/* Whether every violation is small beside q_i alone, or the terms of its row, of any matrix;
 * *hidden: one is so large beside q_i that terms which cancel may hide it. Overflow is no proof. */
static bool is_small_in_rows(perp__witness *t, const perp__witness_point *p, int32_t *hidden)
{
    int32_t known = 0, i;

    *hidden = 0;
    for (i = 0; i < p->M->rows; i++) {
        const double v = violation_of_row(p, i);

        if (v <= p->tol * fabs(p->q[i]))
            continue;
        *hidden |= p->q[i] != 0.0 && !(v <= sqrt(p->tol) * fabs(p->q[i]));
        if (!known++)
            perp__find_terms(p->M, p->q, p->z, NULL, NULL, t->terms);
        if (!(v <= p->tol * t->terms[i]) || !isfinite(t->terms[i]))
            return 0;
    }
    return 1;
}

void perp__find_terms(const perp__matrix *M, const double *q, const double *z, const int32_t *units,
                      const int32_t *omegas, double *terms)
{
    for (int32_t i = 0; i < M->rows; i++)
        terms[i] = units ? perp__shift(fabs(q[i]), units[i] - omegas[i]) : fabs(q[i]);
    for (perp__cursor c = perp__first(M); perp__advance(&c);) {
        const double term = fabs(c.value * z[c.j]);

        terms[c.i] += units ? perp__shift(term, units[c.i] - omegas[c.i]) : term;
    }
}

/* A distance that underflows in these units may be any. */
static bool is_near(double distance, int32_t shift, double near)
{
    const double scaled = perp__shift(distance, shift);

    return distance == 0.0 || (scaled >= DBL_MIN && scaled <= near);
}

/* carried := the size of z_j itself. */
static void start_sizes(perp__witness *t, const perp__witness_point *p)
{
    const int32_t n = p->M->rows;

    for (int32_t j = 0; j < n; j++)
        t->carried[j] = perp__shift(p->least ? fmax(fabs(p->z[j]), p->least[j]) : fabs(p->z[j]),
                                    -t->exponents[j] - t->omegas[n + j]);
}

/* wrong := v, where z that is next to a bound counts as on it, and is not free; carried := |z_j|,
 * for free z_j what its rows give comes next. A bound is near beside all that z_j's rows, whether
 * they cancel or not, would let it be. */
static void find_violations(perp__witness *t, const perp__witness_point *p, double least)
{
    const int32_t n = p->M->rows;

    start_sizes(t, p);
    for (perp__cursor c = perp__first(p->M); perp__advance(&c);) {
        const double size = entry(t, &c);

        if (size >= least && !(t->terms[c.i] <= size * t->carried[c.j]))
            t->carried[c.j] = t->terms[c.i] / size;
    }
    for (int32_t i = 0; i < n; i++) {
        const int32_t shift = t->exponents[i] - t->omegas[i];
        const double size = t->carried[i];
        const double near = size < INFINITY ? p->tol * size : 0.0; /* not next to everything */
        const int32_t unit = -t->exponents[i] - t->omegas[n + i];
        const bool at_lower = is_near(p->z[i] - p->lower[i], unit, near);
        const bool at_upper = is_near(p->upper[i] - p->z[i], unit, near);
        const double z = at_lower ? p->lower[i] : at_upper ? p->upper[i] : p->z[i];
        const double v = perp__row_violation(z, p->lower[i], p->upper[i], p->w[i]);

        t->is_free[i] = !at_lower && !at_upper;
        t->wrong[i] = at_lower && at_upper ? 0.0 : perp__shift(v, shift);
        t->rounding[i] =
            perp__shift(fabs(p->w[i]), shift) <= least * t->terms[i] ? t->terms[i] : 0.0;
    }
    start_sizes(t, p);
}

/* A rounding of the right sides of a part is none itself, if it is as little in the caller's units:
 * contact laws have such in place of zeros. */
#define NOISE_OF_SIDES DBL_EPSILON

/* ordinary := |z_j|, but no larger than the right sides that z_j hangs together with by couplings
 * of `least`, in units in which the largest entry of every row, then of every column, is 1; nor
 * than those of its part, of which omega is at least half; unless the caller says that right sides
 * are of no account. most := those of parts, in the caller's units. Returns whether at least so
 * much of every |z_j| is ordinary: then least^2 of a row's terms is least of its ordinary ones. */
static int32_t find_ordinary(perp__witness *t, const perp__witness_point *p, double least)
{
    const int32_t n = p->M->rows;
    double *row = t->around, *column = t->scales, *side = t->most, *ordinary = t->ordinary;
    int32_t *part = t->omega_of_part, all = 1;

    for (int32_t i = 0; i < n; i++)
        row[i] = column[i] = side[i] = side[n + i] = 0.0;
    for (perp__cursor c = perp__first(p->M); perp__advance(&c);)
        perp__raise_to(&row[c.i], fabs(c.value));
    for (perp__cursor c = perp__first(p->M); perp__advance(&c);)
        if (c.value != 0.0)
            perp__raise_to(&column[c.j], fabs(c.value) / row[c.i]);
    perp__cut_parts(p->M, row, column, least, NULL, part);
    for (int32_t i = 0; i < n; i++)
        if (p->q[i] != 0.0)
            perp__raise_to(&side[part[i]], fabs(p->q[i]) / row[i]);
    for (int32_t j = 0; j < n; j++)
        ordinary[j] =
            perp__shift(side[part[n + j]] / column[j], -t->exponents[j] - t->omegas[n + j]);
    start_sizes(t, p);
    memset(side, 0, 2 * (size_t)n * sizeof *side);
    for (int32_t i = 0; i < n; i++) {
        ordinary[i] = p->least ? t->carried[i] : fmin(t->carried[i], fmin(ordinary[i], 2.0));
        all &= least * t->carried[i] <= ordinary[i];
        perp__raise_to(&side[p->part[i]], fabs(p->q[i]));
    }
    return all;
}

/* allowed := by how much a row may be off, at an ordinary size of z; a row without a right side
 * says nothing of that. */
static void find_allowed(perp__witness *t, const perp__witness_point *p, double least)
{
    const int32_t n = p->M->rows;

    for (int32_t i = 0; i < n; i++)
        t->allowed[i] = perp__shift(fabs(p->q[i]), t->exponents[i] - t->omegas[i]);
    for (perp__cursor c = perp__first(p->M); perp__advance(&c);)
        t->allowed[c.i] += entry(t, &c) * (p->q[c.i] != 0.0 ? t->ordinary[c.j] : t->carried[c.j]);
    for (int32_t i = 0; i < n; i++) {
        const int32_t shift = t->exponents[i] - t->omegas[i];
        const double noise = NOISE_OF_SIDES * fmin(1.0, perp__shift(t->most[p->part[i]], shift));
        const double d = perp__shift(perp__entry(p->M, i, i), 2 * t->exponents[i]);
        const double size = fabs(d) >= least ? fmax(t->allowed[i], 1.0) : t->allowed[i];

        t->allowed[i] = fmax(least * size, noise);
    }
}

/* The rows without a right side, met[i] != 0, that hold where variables are 0 which no other row
 * misses: the largest set of such rows. */
static const double *find_homogeneous(perp__witness *t, const perp__witness_point *p)
{
    const int32_t n = p->M->rows;
    double *met = t->most, *missed = t->most + n;

    for (int32_t i = 0; i < n; i++) {
        met[i] = p->q[i] == 0.0;
        missed[i] = !(p->lower[i] <= 0.0 && p->upper[i] >= 0.0);
    }
    for (bool changed = 1; changed;) {
        changed = 0;
        for (perp__cursor c = perp__first(p->M); perp__advance(&c);)
            if (met[c.i] == 0.0 && missed[c.j] == 0.0 &&
                !(entry(t, &c) * t->carried[c.j] <= t->allowed[c.i]))
                missed[c.j] = 1.0;
        for (perp__cursor c = perp__first(p->M); perp__advance(&c);)
            if (met[c.i] != 0.0 && missed[c.j] != 0.0 && c.value != 0.0) {
                met[c.i] = 0.0;
                changed = 1;
            }
    }
    return met;
}

/* Whether a row is off by more than it may be at an ordinary size of z. */
static bool is_unmet(perp__witness *t, const perp__witness_point *p, double least)
{
    const double *met = NULL;

    find_allowed(t, p, least);
    for (int32_t i = 0; i < p->M->rows; i++) {
        if (!(t->wrong[i] > t->allowed[i]))
            continue;
        met = met ? met : find_homogeneous(t, p);
        if (met[i] == 0.0)
            return 1;
    }
    return 0;
}

/* around := t + |M| s, most := the largest t of a row of a cut part that cancels. */
static void find_neighbours(perp__witness *t, const perp__matrix *M, double least)
{
    for (perp__cursor c = perp__first(M); perp__advance(&c);) {
        const double size = entry(t, &c);

        if (t->is_free[c.j] && size >= least && !(t->rounding[c.i] <= size * t->carried[c.j]))
            t->carried[c.j] = t->rounding[c.i] / size;
    }
    for (int32_t i = 0; i < M->rows; i++) {
        t->around[i] = t->terms[i];
        t->most[i] = t->most[M->rows + i] = 0.0;
    }
    for (perp__cursor c = perp__first(M); perp__advance(&c);)
        t->around[c.i] += entry(t, &c) * t->carried[c.j];
    for (int32_t i = 0; i < M->rows; i++)
        perp__raise_to(&t->most[t->cut[i]], t->rounding[i]);
}

double perp__witness_own_residual(perp__witness *t, const perp__witness_point *point)
{
    const perp__witness_point *p = point;
    const perp__parts parts = {p->M->rows, p->parts, p->part};
    const double least = sqrt(p->tol); /* couplings from this on are significant */
    int32_t extremes = 0, hidden;
    const bool is_small = is_small_in_rows(t, p, &hidden);
    double largest = 0.0;

    if (is_small && !hidden)
        return 0.0;
    /* 1. Violations and what rows carry, in units. */
    find_units(t, p);
    perp__find_omegas(&parts, p->q, t->exponents, t->omega_of_part, t->omegas, 0);
    if (find_ordinary(t, p, least) && is_small)
        return 0.0;
    perp__find_terms(p->M, p->q, p->z, t->exponents, t->omegas, t->terms);
    find_violations(t, p, least);
    if (is_unmet(t, p, least))
        return INFINITY;
    find_neighbours(t, p->M, least);
    /* 2. Rows whose numbers are or may have been beyond the range of doubles have no common unit
     * with their neighbours: each violation beside its own terms, in the caller's units. Terms that
     * overflow excuse nothing. */
    for (int32_t i = 0; i < p->M->rows; i++) {
        const double size = t->around[i] + perp__floor_of(p->tol) * t->most[t->cut[i]];
        const int32_t unit = abs(t->exponents[i]);
        const bool is_extreme = !(size >= PERP__LEAST_PRODUCT && size < INFINITY) ||
                                unit >= FARTHEST_UNIT || unit + abs(t->omegas[i]) >= FARTHEST;
        const double v = is_extreme ? violation_of_row(p, i) : t->wrong[i];

        if (is_extreme && !extremes++)
            perp__find_terms(p->M, p->q, p->z, NULL, NULL, t->terms);
        if (v != 0.0 && is_extreme)
            perp__raise_to(&largest, t->terms[i] < INFINITY ? v / t->terms[i] : INFINITY);
        else if (v != 0.0)
            perp__raise_to(&largest, v / size);
    }
    return largest;
}

void perp__witness_layout(perp__arena *arena, perp__witness *witness, size_t n)
{
    PERP__INTEGERS(arena, n, &witness->exponents, &witness->is_free);
    PERP__INTEGERS(arena, 2 * n, &witness->cut, &witness->omegas, &witness->omega_of_part);
    PERP__DOUBLES(arena, n, &witness->terms, &witness->carried, &witness->rounding, &witness->wrong,
                  &witness->around, &witness->ordinary, &witness->allowed, &witness->scales);
    witness->most = perp__arena_take(arena, 2 * n, sizeof(double));
}
