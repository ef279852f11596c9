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
 * Units are not unique: a diagonal that is tiny beside the couplings of its row and its column, as
 * in [[1e-13, 4], [-4, 0]], can be what the units of its row are found from, or noise, and nobody
 * knows. Then units are found with and without such diagonals, and the worse ones count.
 */
#include "linalg/witness.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/groups.h"
#include "base/outcome.h"
#include "linalg/scale.h"

/* What a row may miss beside the largest t, in units of tol: below it the far tail of a solution
 * that fades out would fail at loose tolerances. */
#define FLOOR 1e-5
/* Beside the largest t that much is always granted: rounding. */
#define ROUNDING (16.0 * DBL_EPSILON)

/* Couplings below this are what stands in the place of zeros (linalg/scale.c). */
#define NOISE 0x1p-40
#define NOISE_DIAGONAL 0x1p-38

/* Sizes below this have lost digits, or all, to underflow. */
#define LEAST_SIZE 0x1p-960

/* Exponents from which on a unit may be that of the end of doubles (linalg/scale.c), and products
 * in units leave them. */
#define FARTHEST_UNIT 500
#define FARTHEST 1400

/* The point and the units that it is looked at in. */
typedef struct view {
    const perp__witness_point *point;
    const int32_t *units, *cut;
    int32_t n;
    double least; /* couplings from this on are significant */
} view;

static double floor_of(double tol)
{
    return fmax(FLOOR, ROUNDING / tol);
}

static double violation_of_row(const perp__witness_point *p, int32_t i)
{
    return perp__row_violation(p->z[i], p->lower[i], p->upper[i], p->w[i]);
}

/* sum_j |M_ij z_j| + |q_i| of a row of a dense M. */
static double terms_of_row(const perp__witness_point *p, int32_t i)
{
    const double *row = p->M->values + (size_t)i * p->M->row_stride;
    double sum = fabs(p->q[i]);

    for (int32_t j = 0; j < p->M->rows; j++)
        sum += fabs(row[(size_t)j * p->M->column_stride] * p->z[j]);
    return sum;
}

/* terms := the same of all rows of a sparse M. */
static void find_terms_of_rows(const perp__witness_point *p, double *terms)
{
    perp__cursor c = perp__first(p->M);

    for (int32_t i = 0; i < p->M->rows; i++)
        terms[i] = fabs(p->q[i]);
    while (perp__advance(&c))
        terms[c.i] += fabs(c.value * p->z[c.j]);
}

/* Whether every violation is small beside q_i alone, or the terms of its row. What overflows proves
 * nothing. */
static int32_t is_surely_small(const perp__witness *t, const perp__witness_point *p)
{
    int32_t known = 0, i;

    for (i = 0; i < p->M->rows; i++) {
        const double v = violation_of_row(p, i);
        double terms;

        if (v <= p->tol * fabs(p->q[i]))
            continue;
        if (p->M->column_starts && !known++)
            find_terms_of_rows(p, t->terms);
        terms = p->M->column_starts ? t->terms[i] : terms_of_row(p, i);
        if (!(v <= p->tol * terms) || !isfinite(terms))
            return 0;
    }
    return 1;
}

/* |M_ij| in these units, which are clamped so that the power is a normal number. */
static double entry(const int32_t *units, const perp__cursor *c)
{
    return fabs(c->value) * perp__power_of_two(units[c->i] + units[c->j]);
}

/* Joins the line's parts by its couplings of at least `least`; no further than `enough` parts in
 * all. Returns how many parts there are then. */
static int32_t join_line(const perp__matrix *M, perp__witness_units *u, double least, int32_t at,
                         int32_t parts, int32_t enough)
{
    const perp__line l = perp__line_of(M, at);
    const int32_t by_rows = perp__lines_are_rows(M);
    int32_t root = perp__root_of(u->cut, by_rows ? at : M->rows + at);

    for (int32_t k = 0; k < l.count && parts > enough; k++) {
        const int32_t other = l.indices ? l.indices[k] : k,
                      node = by_rows ? M->rows + other : other;
        const double power = perp__power_of_two(u->exponents[at] + u->exponents[other]);

        if (u->cut[node] != root && l.values[k] != 0.0 && fabs(l.values[k]) * power >= least) {
            const int32_t found = perp__root_of(u->cut, node);

            parts -= found != root;
            root = perp__link(u->cut, root, found);
        }
    }
    return parts;
}

/* The parts that are left when couplings below `least` are cut; rows with `tied` hang together with
 * their columns. Where all are one but for lines that come later, a line has no more to join. */
static void join_couplings(const perp__matrix *M, perp__witness_units *u, double least,
                           const int32_t *tied)
{
    const int32_t n = M->rows;
    int32_t parts = 2 * n, alone = 0; /* alone: lines ahead that nothing holds yet */

    for (int32_t i = 0; i < 2 * n; i++)
        u->cut[i] = i;
    for (int32_t i = 0; i < n; i++) {
        alone += !tied[i];
        parts -= tied[i] && perp__join(u->cut, i, n + i);
    }
    for (int32_t at = 0; at < n && parts > 1; at++) {
        alone -= !tied[at];
        parts = join_line(M, u, least, at, parts, 1 + alone);
    }
    perp__number_parts(u->cut, 2 * n);
}

/* Marks the rows that hang together with their columns. Returns whether all do. */
static int32_t find_tied(const perp__witness_units *u, int32_t n, int32_t *tied)
{
    int32_t all = 1;

    for (int32_t i = 0; i < n; i++) {
        tied[i] = u->cut[i] == u->cut[n + i];
        all &= tied[i];
    }
    return all;
}

/* The parts that are left when couplings below `least` are cut. z_i and w_i hang together unless M,
 * but for noise, falls into parts between them: then there is no common size. tied: n, work. */
static void find_cut(const perp__witness_point *p, perp__witness_units *u, double least,
                     int32_t *tied)
{
    const size_t bytes = (size_t)p->M->rows * sizeof *tied;

    memset(tied, 0, bytes);
    join_couplings(p->M, u, least, tied);
    if (find_tied(u, p->M->rows, tied)) /* so much the more by smaller couplings */
        return;
    memset(tied, 0, bytes);
    join_couplings(p->M, u, NOISE, tied);
    find_tied(u, p->M->rows, tied);
    join_couplings(p->M, u, least, tied);
}

/* noise[i] := whether M_ii is noise beside the largest couplings of its row and of its column, in
 * the caller's units. Returns whether one is. */
static int32_t find_noise(perp__witness *t, const perp__matrix *M, int32_t *noise)
{
    double *in_row = t->around, *in_column = t->carried;
    perp__cursor c = perp__first(M);
    int32_t any = 0, i;

    for (i = 0; i < M->rows; i++) {
        in_row[i] = in_column[i] = 0.0;
        noise[i] = 0;
    }
    while (perp__advance(&c))
        if (c.i != c.j) {
            perp__raise_to(&in_row[c.i], fabs(c.value));
            perp__raise_to(&in_column[c.j], fabs(c.value));
        }
    for (c = perp__first(M); perp__advance(&c);)
        if (c.i == c.j && fabs(c.value) <= NOISE_DIAGONAL * fmin(in_row[c.i], in_column[c.i]))
            any = noise[c.i] = 1;
    return any;
}

static void look_at_matrix(perp__witness *t, const perp__witness_point *p)
{
    int32_t *work = t->omegas, k;

    memcpy(t->units[0].exponents, p->exponents, (size_t)p->M->rows * sizeof *p->exponents);
    t->count = p->scaling && find_noise(t, p->M, t->is_free) ? 2 : 1;
    if (t->count == 2)
        perp__equilibrate_but(p->M, t->is_free, t->units[1].exponents, work);
    for (k = 0; k < t->count; k++) {
        perp__balance(p->M, t->units[k].exponents, work);
        find_cut(p, &t->units[k], sqrt(p->tol), work);
    }
    t->tol = p->tol;
    t->known = 1;
}

void perp__find_terms(const perp__matrix *M, const double *q, const double *z, const int32_t *units,
                      const int32_t *omegas, double *terms)
{
    perp__cursor c = perp__first(M);

    for (int32_t i = 0; i < M->rows; i++)
        terms[i] = perp__shift(fabs(q[i]), units[i] - omegas[i]);
    while (perp__advance(&c))
        terms[c.i] += perp__shift(fabs(c.value * z[c.j]), units[c.i] - omegas[c.i]);
}

/* A distance that underflows in these units may be any. */
static int32_t is_near(double distance, int32_t shift, double near)
{
    const double scaled = perp__shift(distance, shift);

    return distance == 0.0 || (scaled >= DBL_MIN && scaled <= near);
}

/* v_i; z that is next to a bound, beside what it may carry, counts as on it. Then it is not free.
 */
static double violation_near(const perp__witness_point *p, int32_t i, int32_t shift, double near,
                             int32_t *is_free)
{
    const double lower = p->lower[i], upper = p->upper[i], z = p->z[i];
    const int32_t at_lower = is_near(z - lower, shift, near);
    const int32_t at_upper = is_near(upper - z, shift, near);

    *is_free = !at_lower && !at_upper;
    if (at_lower && at_upper)
        return 0.0;
    return perp__row_violation(at_lower ? lower : at_upper ? upper : z, lower, upper, p->w[i]);
}

/* carried := the size of z_j itself. */
static void start_sizes(perp__witness *t, const view *v)
{
    const perp__witness_point *p = v->point;

    for (int32_t j = 0; j < v->n; j++)
        t->carried[j] = perp__shift(p->least ? fmax(fabs(p->z[j]), p->least[j]) : fabs(p->z[j]),
                                    -v->units[j] - t->omegas[v->n + j]);
}

/* wrong := v; carried := |z_j|, for free z_j what its rows give comes next. A bound is near beside
 * all that z_j's rows, whether they cancel or not, would let it be. */
static void find_violations(perp__witness *t, const view *v)
{
    const perp__witness_point *p = v->point;
    perp__cursor c = perp__first(p->M);

    start_sizes(t, v);
    while (perp__advance(&c)) {
        const double size = entry(v->units, &c);

        if (size >= v->least && !(t->terms[c.i] <= size * t->carried[c.j]))
            t->carried[c.j] = t->terms[c.i] / size;
    }
    for (int32_t i = 0; i < v->n; i++) {
        const int32_t shift = v->units[i] - t->omegas[i];
        const double size = t->carried[i];
        const double near = size < INFINITY ? p->tol * size : 0.0; /* not next to everything */

        t->wrong[i] = perp__shift(
            violation_near(p, i, -v->units[i] - t->omegas[v->n + i], near, &t->is_free[i]), shift);
        if (!(perp__shift(fabs(p->w[i]), shift) <= v->least * t->terms[i]))
            t->rounding[i] = 0.0;
        else
            t->rounding[i] = t->terms[i];
    }
    start_sizes(t, v);
}

/* around := t + |M| s, most := the largest t of a row of a cut part that cancels. */
static void find_neighbours(perp__witness *t, const view *v)
{
    perp__cursor c = perp__first(v->point->M);

    while (perp__advance(&c)) {
        const double size = entry(v->units, &c);

        if (t->is_free[c.j] && size >= v->least && !(t->rounding[c.i] <= size * t->carried[c.j]))
            t->carried[c.j] = t->rounding[c.i] / size;
    }
    for (int32_t i = 0; i < v->n; i++) {
        t->around[i] = t->terms[i];
        t->most[i] = t->most[v->n + i] = 0.0;
    }
    for (c = perp__first(v->point->M); perp__advance(&c);)
        t->around[c.i] += entry(v->units, &c) * t->carried[c.j];
    for (int32_t i = 0; i < v->n; i++)
        perp__raise_to(&t->most[v->cut[i]], t->rounding[i]);
}

/* Whether numbers of row i, in these units, are or may have been beyond the range of doubles. */
static int32_t is_extreme(const perp__witness *t, const view *v, int32_t i, double size)
{
    const int32_t reach = abs(v->units[i]) + abs(t->omegas[i]);

    return !(size >= LEAST_SIZE && size < INFINITY) || abs(v->units[i]) >= FARTHEST_UNIT ||
           reach >= FARTHEST;
}

/* Such rows have no common unit with their neighbours: each violation beside its own terms, in the
 * caller's units. Terms that overflow excuse nothing. */
static void look_at_extremes(perp__witness *t, const perp__witness_point *p, double *own)
{
    find_terms_of_rows(p, t->terms);
    for (int32_t i = 0; i < p->M->rows; i++) {
        const double v = violation_of_row(p, i);

        if (t->is_free[i] && v != 0.0)
            perp__raise_to(own, t->terms[i] < INFINITY ? v / t->terms[i] : INFINITY);
    }
}

static double own_residual(perp__witness *t, const perp__witness_point *p,
                           const perp__witness_units *u)
{
    const view v = {p, u->exponents, u->cut, p->M->rows, sqrt(p->tol)};
    int32_t extremes = 0;
    double own = 0.0;

    perp__find_omegas(v.n, p->part, p->parts, p->q, u->exponents, t->omega_of_part, t->omegas, 0);
    perp__find_terms(p->M, p->q, p->z, u->exponents, t->omegas, t->terms);
    find_violations(t, &v);
    find_neighbours(t, &v);
    for (int32_t i = 0; i < v.n; i++) {
        const double size = t->around[i] + floor_of(p->tol) * t->most[u->cut[i]];

        t->is_free[i] = is_extreme(t, &v, i, size);
        extremes |= t->is_free[i];
        if (!t->is_free[i] && t->wrong[i] != 0.0)
            perp__raise_to(&own, t->wrong[i] / size);
    }
    if (extremes)
        look_at_extremes(t, p, &own);
    return own;
}

double perp__witness_own_residual(perp__witness *witness, const perp__witness_point *point)
{
    double own = 0.0;

    if (is_surely_small(witness, point))
        return 0.0;
    if (!witness->known || witness->tol != point->tol)
        look_at_matrix(witness, point);
    for (int32_t k = 0; k < witness->count; k++)
        perp__raise_to(&own, own_residual(witness, point, &witness->units[k]));
    return own;
}

void perp__witness_layout(perp__arena *arena, perp__witness *witness, size_t n)
{
    for (int32_t k = 0; k < 2; k++) {
        witness->units[k].exponents = perp__arena_take(arena, n, sizeof(int32_t));
        witness->units[k].cut = perp__arena_take(arena, 2 * n, sizeof(int32_t));
    }
    PERP__INTEGERS(arena, 2 * n, &witness->omegas, &witness->omega_of_part);
    witness->is_free = perp__arena_take(arena, n, sizeof(int32_t));
    PERP__DOUBLES(arena, n, &witness->terms, &witness->carried, &witness->rounding, &witness->wrong,
                  &witness->around);
    witness->most = perp__arena_take(arena, 2 * n, sizeof(double));
}
