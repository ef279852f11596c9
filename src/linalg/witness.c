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
 * Units are not unique: a diagonal that is tiny beside the couplings of its row or of its column,
 * as in [[1e-13, 4], [-4, 0]], can be what the units of its row are found from, or noise, and
 * nobody knows; nor where a coupling that the units of a row were found from leaves others of
 * 2^20, or 2^-30 of couplings that are as large as any, as in [[0, 1, e], [1, 0, 1], [e, 1, 0]].
 * Then the caller's units are balanced too, and the worse ones count. */
#include "linalg/witness.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/outcome.h"
#include "linalg/scale.h"

/* Couplings below this are what stands in the place of zeros (linalg/scale.c). */
#define NOISE 0x1p-40

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

static double violation_of_row(const perp__witness_point *p, int32_t i)
{
    return perp__row_violation(p->z[i], p->lower[i], p->upper[i], p->w[i]);
}

/* |M_ij| in these units, which are clamped so that the power is a normal number. */
static double entry(const int32_t *units, const perp__cursor *c)
{
    return fabs(c->value) * perp__power_of_two(units[c->i] + units[c->j]);
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

static void find_cut(perp__witness *t, const perp__witness_point *p, perp__witness_units *u,
                     double least, const int32_t *tied)
{
    perp__find_significant_parts(p->M, u->exponents, least, tied, u->cut, t->sizes);
}

/* z_i and w_i hang together unless M, but for noise, falls into parts between them: then there is
 * no common size. */
static void tie(perp__witness *t, const perp__witness_point *p)
{
    const int32_t n = p->M->rows;

    for (int32_t k = 0; k < t->count && !t->tied; k++) {
        perp__witness_units *u = &t->units[k];

        if (find_tied(u, n, t->is_free)) /* so much the more by smaller couplings */
            continue;
        find_cut(t, p, u, NOISE, NULL);
        find_tied(u, n, t->is_free);
        find_cut(t, p, u, sqrt(p->tol), t->is_free);
    }
    t->tied = 1;
}

/* Units and the parts that are left when couplings below sqrt(tol) are cut; nothing is tied. */
static void look_at_matrix(perp__witness *t, const perp__witness_point *p)
{
    if (!t->known)
        perp__witness_find_starts(t, p);
    for (int32_t k = 0; k < t->count && !t->balanced; k++)
        perp__balance(p->M, t->units[k].exponents, t->omegas, t->sizes);
    t->balanced = 1;
    if (t->tol == p->tol)
        return;
    for (int32_t k = 0; k < t->count; k++)
        find_cut(t, p, &t->units[k], sqrt(p->tol), NULL);
    t->tol = p->tol;
    t->tied = 0;
}

/* ---- a look at few rows of a dense matrix of numbers that no unit brings out of the range of
 * doubles ---- */

#define MODERATE_NORM 0x1p40
#define MODERATE_Q 0x1p150
#define MODERATE_Z 0x1p100
#define MODERATE_ROW 0x1p-60
#define MODERATE_TERMS 0x1p-500

static int32_t is_moderate(const perp__witness_point *p)
{
    int32_t good = p->row_norms && !p->M->column_starts;

    for (int32_t i = 0; i < p->M->rows && good; i++) {
        const double q = fabs(p->q[i]);

        good =
            abs(p->exponents[i]) <= PERP__MODERATE_UNIT / 2 && p->row_norms[i] <= MODERATE_NORM &&
            (q == 0.0 || (q >= 1.0 / MODERATE_Q && q <= MODERATE_Q)) && fabs(p->z[i]) <= MODERATE_Z;
    }
    return good;
}

/* Whether violation <= tol (|q_i| + sum_j |M_ij z_j|), which it mostly is after a few terms. */
static int32_t is_small_in_row(const perp__witness_point *p, int32_t i, double violation)
{
    const double *row = p->M->values + (size_t)i * p->M->row_stride;
    double sum = fabs(p->q[i]);

    for (int32_t j = 0; j < p->M->rows && !(violation <= p->tol * sum); j++)
        sum += fabs(row[(size_t)j * p->M->column_stride] * p->z[j]);
    return violation <= p->tol * sum;
}

/* What t_k is at least, from two of its terms; 0 if the row does not surely cancel. */
static double cancelling_terms(const perp__witness_point *p, const int32_t *units, int32_t k)
{
    const double terms = fabs(p->q[k]) + fabs(perp__diagonal_entry(p->M, k) * p->z[k]);
    const double scaled = perp__shift(terms, units[k]);

    return fabs(p->w[k]) <= sqrt(p->tol) * terms && scaled >= MODERATE_TERMS ? scaled : 0.0;
}

/* ---- the same without units, if they are balanced from those of the caller alone ----
 *
 * Balancing starts from S = D M D of perp__equilibrate, and bounds on S bound what it does. Let 2^b
 * be more than half of the largest entry of S, and 2^L_i the same of row i. The first round takes
 * at most b / 2 off an exponent, and then no entry is 4 or more: later rounds only add, and never
 * so much that one is,
 *
 *     e_i - b / 2 <= u_i <= e_i + 2 + b / 2 - L_i.
 *
 * So entries of S of 2^b sqrt(tol) are significant in units u; and a row k that cancels and has a
 * significant entry in one column with row i excuses row i where, in units e, t_k is at least
 * 2^(2 + b - L_i) v_i / (tol floor). */
typedef struct glance {
    const perp__witness_point *point;
    double *anchors; /* 2^e_k t_k at least, of rows k that cancel; 0 of others */
    int32_t b;
    double significant; /* entries of S; 0: not looked at anything yet */
} glance;

/* |S_ij| */
static double scaled_entry(const perp__witness_point *p, int32_t i, int32_t j)
{
    return fabs(p->M->values[(size_t)i * p->M->row_stride + (size_t)j * p->M->column_stride]) *
           perp__power_of_two(p->exponents[i] + p->exponents[j]);
}

static void look_around(glance *g)
{
    const perp__witness_point *p = g->point;
    double largest = 1.0;

    for (int32_t k = 0; k < p->M->rows; k++) {
        g->anchors[k] = cancelling_terms(p, p->exponents, k);
        largest = p->row_norms[k] > largest ? p->row_norms[k] : largest;
    }
    g->b = perp__exponent_of(largest);
    g->significant = perp__power_of_two(g->b) * sqrt(p->tol);
}

/* Whether a row of `size` or more excuses those with a significant entry in column j. */
static int32_t is_excused_in_column(const glance *g, int32_t j, double size)
{
    for (int32_t k = 0; k < g->point->M->rows; k++)
        if (g->anchors[k] >= size && scaled_entry(g->point, k, j) >= g->significant)
            return 1;
    return 0;
}

static int32_t is_excused(const glance *g, int32_t i, double violation)
{
    const perp__witness_point *p = g->point;
    double largest = MODERATE_ROW, size;

    for (int32_t j = 0; j < p->M->rows; j++) {
        const double found = scaled_entry(p, i, j);

        largest = found > largest ? found : largest;
    }
    size = perp__shift(violation / (p->tol * perp__floor_of(p->tol)),
                       p->exponents[i] + 2 + g->b - perp__exponent_of(largest));
    if (size < MODERATE_TERMS) /* the anchors of rows that do not cancel are 0 */
        size = MODERATE_TERMS;
    for (int32_t j = 0; j < p->M->rows && largest >= g->significant; j++)
        if (scaled_entry(p, i, j) >= g->significant && is_excused_in_column(g, j, size))
            return 1;
    return 0;
}

/* most := for each part what the largest t of a row that cancels is at least. Returns whether all
 * units are moderate. */
static int32_t find_least_most(const perp__witness_point *p, const perp__witness_units *u,
                               double *most)
{
    int32_t good = 1;

    memset(most, 0, 2 * (size_t)p->M->rows * sizeof *most);
    for (int32_t k = 0; k < p->M->rows; k++) {
        good &= abs(u->exponents[k]) <= PERP__MODERATE_UNIT;
        perp__raise_to(&most[u->cut[k]], cancelling_terms(p, u->exponents, k));
    }
    return good;
}

/* Whether every violation is small beside the terms of its row, or in all units beside the floor
 * of its part: sure where it is, and mostly so in a right answer. */
static int32_t is_surely_small(perp__witness *t, const perp__witness_point *p)
{
    double *const most[2] = {t->most, t->sizes};
    int32_t looked = 0, good = 1, i, k;
    glance g = {p, t->terms, 0, 0.0};

    for (i = 0; i < p->M->rows && good; i++) {
        const double v = violation_of_row(p, i);

        if (v <= p->tol * fabs(p->q[i]) || is_small_in_row(p, i, v))
            continue;
        if (!t->known)
            perp__witness_find_starts(t, p);
        if (g.significant == 0.0 && t->count == 1)
            look_around(&g);
        if (t->count == 1 && is_excused(&g, i, v))
            continue;
        if (!looked++) {
            look_at_matrix(t, p);
            for (k = 0; k < t->count; k++)
                good &= find_least_most(p, &t->units[k], most[k]);
        }
        for (k = 0; k < t->count;
             k++) { /* where nothing cancels, not even what underflows is small */
            const double floor = perp__floor_of(p->tol) * most[k][t->units[k].cut[i]];

            good &= floor > 0.0 && perp__shift(v, t->units[k].exponents[i]) <= p->tol * floor;
        }
    }
    return good;
}

/* Whether every violation is small beside q_i alone, or the terms of its row, of any matrix. What
 * overflows proves nothing. */
static int32_t is_small_in_rows(perp__witness *t, const perp__witness_point *p)
{
    int32_t known = 0, i;

    for (i = 0; i < p->M->rows; i++) {
        const double v = violation_of_row(p, i);

        if (v <= p->tol * fabs(p->q[i]))
            continue;
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
    perp__cursor c = perp__first(M);

    for (int32_t i = 0; i < M->rows; i++)
        terms[i] = units ? perp__shift(fabs(q[i]), units[i] - omegas[i]) : fabs(q[i]);
    while (perp__advance(&c)) {
        const double term = fabs(c.value * z[c.j]);

        terms[c.i] += units ? perp__shift(term, units[c.i] - omegas[c.i]) : term;
    }
}

/* A distance that underflows in these units may be any. */
static int32_t is_near(double distance, int32_t shift, double near)
{
    const double scaled = perp__shift(distance, shift);

    return distance == 0.0 || (scaled >= DBL_MIN && scaled <= near);
}

/* v_i; z that is next to a bound, beside what it may carry, counts as on it, and is not free. */
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
    perp__find_terms(p->M, p->q, p->z, NULL, NULL, t->terms);
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
    const perp__parts parts = {v.n, p->parts, p->part};
    int32_t extremes = 0;
    double own = 0.0;

    perp__find_omegas(&parts, p->q, u->exponents, t->omega_of_part, t->omegas, 0);
    perp__find_terms(p->M, p->q, p->z, u->exponents, t->omegas, t->terms);
    find_violations(t, &v);
    find_neighbours(t, &v);
    for (int32_t i = 0; i < v.n; i++) {
        const double size = t->around[i] + perp__floor_of(p->tol) * t->most[u->cut[i]];

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

    if (is_moderate(point) ? is_surely_small(witness, point) : is_small_in_rows(witness, point))
        return 0.0;
    look_at_matrix(witness, point);
    if (!witness->tied) {
        tie(witness, point);
        if (is_moderate(point) && is_surely_small(witness, point))
            return 0.0;
    }
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
    witness->sizes = perp__arena_take(arena, 3 * n, sizeof(double));
    witness->most = perp__arena_take(arena, 2 * n, sizeof(double));
}
