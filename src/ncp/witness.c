/* The second witness for `solved`, as lcp/witness.c has it, for the linear problem (J, q) at z:
 * each row's violation beside what the row and its neighbours carry. In coordinates in which the
 * largest entry of every row and column of S is about 1 (Ruiz), whatever the diagonal is,
 *
 *     t_i   = sum_j |S_ij z_j| + |q_i|
 *     s_j   = |z_j|, and where z_j is free the largest t_k / |S_kj| of rows k that cancel
 *     own_i = v_i / (t_i + sum_j |S_ij| s_j + floor max t)
 *
 * with v_i the violation of w_i's sign or equation, over significant couplings; the largest t is
 * that of the rows that cancel among those that hang together by such couplings. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/lines.h"
#include "linalg/scale.h"
#include "ncp/solver.h"

#define FLOOR 1e-5 /* beside the largest t: the far tail of a solution that fades out */

/* The arrays, by what the walk calls them; all n. */
typedef struct witness {
    const perp__ncp_model *m;
    perp__matrix S;
    const double *z, *w;
    double tol, strong;       /* couplings from `strong` on are significant */
    double *terms, *rounding; /* t; of rows that cancel */
    double *size, *around;    /* s; t + |S| s */
    double *wrong, *is_free;
} witness;

static witness witness_of(perp_ncp_solver *solver)
{
    perp__ncp_walk *f = &solver->walk;
    witness t;

    t.m = &solver->model;
    t.S = perp__ncp_view(t.m);
    t.z = f->z;
    t.w = f->w;
    t.tol = solver->settings.tol;
    t.strong = sqrt(t.tol);
    t.terms = f->part;
    t.rounding = f->slope_w;
    t.size = f->image;
    t.around = f->gradient;
    t.wrong = f->slope_z;
    t.is_free = f->d;
    return t;
}

/* One pass over S: sums_i += |S_ij| x_j, or most_j = max(most_j, x_i / |S_ij|) over significant
 * entries of the columns that are free, or of all. */
static void add_products(const witness *t, const double *x, double *sums)
{
    for (int32_t j = 0; j < t->m->n; j++) {
        const perp__line l = perp__line_of(&t->S, j);

        for (int32_t k = 0; k < l.count; k++)
            sums[l.indices ? l.indices[k] : k] += fabs(l.values[k] * x[j]);
    }
}

static void raise_quotients(const witness *t, const double *x, double *most, int32_t all)
{
    for (int32_t j = 0; j < t->m->n; j++) {
        const perp__line l = perp__line_of(&t->S, j);

        for (int32_t k = 0; k < l.count && (all || t->is_free[j] != 0.0); k++) {
            const double value = fabs(l.values[k]);

            if (value > 0.0 && value >= t->strong)
                most[j] = fmax(most[j], x[l.indices ? l.indices[k] : k] / value);
        }
    }
}

/* By how much row i fails to be that of a solution with the index set read from z; z that is next
 * to a bound, beside what its rows would let it be, counts as on it. */
static void find_violation(const witness *t, int32_t i, double near)
{
    const perp__ncp_model *m = t->m;
    const int32_t at_lower = t->z[i] - m->low[i] <= near, at_upper = m->high[i] - t->z[i] <= near;

    t->is_free[i] = !at_lower && !at_upper;
    if (m->lower[i] == m->upper[i] || (at_lower && at_upper))
        t->wrong[i] = 0.0;
    else if (at_lower)
        t->wrong[i] = t->w[i] < 0.0 ? -t->w[i] : 0.0;
    else if (at_upper)
        t->wrong[i] = t->w[i] > 0.0 ? t->w[i] : 0.0;
    else
        t->wrong[i] = fabs(t->w[i]);
}

static void find_sizes(const witness *t)
{
    const int32_t n = t->m->n;

    for (int32_t i = 0; i < n; i++) {
        t->terms[i] = fabs(t->m->offset[i]);
        t->size[i] = perp__ncp_size_left(t->m, i, t->z[i]);
    }
    add_products(t, t->z, t->terms);
    raise_quotients(t, t->terms, t->size, 1);
    for (int32_t i = 0; i < n; i++) {
        find_violation(t, i, t->tol * t->size[i]);
        t->size[i] = perp__ncp_size_left(t->m, i, t->z[i]);
        t->rounding[i] = fabs(t->w[i]) <= t->strong * t->terms[i] ? t->terms[i] : 0.0;
    }
    raise_quotients(t, t->rounding, t->size, 0);
    memcpy(t->around, t->terms, (size_t)n * sizeof(double));
    add_products(t, t->size, t->around);
}

/* In the units of the exponents as they are, balanced. */
static double own_residual(perp_ncp_solver *solver)
{
    perp__ncp_model *m = &solver->model;
    perp__ncp_walk *f = &solver->walk;
    int32_t *part = m->exponents_work;
    double own = 0.0, least;
    witness t;

    for (int32_t i = 0; i < m->n; i++) {
        f->z[i] *= m->z_unit[i];
        f->w[i] *= m->w_unit[i];
    }
    perp__ncp_model_balance(m);
    for (int32_t i = 0; i < m->n; i++) {
        f->z[i] /= m->z_unit[i];
        f->w[i] /= m->w_unit[i];
    }
    perp__ncp_find_omega(m, f->z, f->w);
    t = witness_of(solver);
    least = fmax(FLOOR, 16.0 * DBL_EPSILON / t.tol);
    find_sizes(&t);
    perp__ncp_find_parts(m, part, t.strong);
    memset(m->most, 0, 2 * (size_t)m->n * sizeof(double));
    for (int32_t i = 0; i < m->n; i++)
        m->most[part[i]] = fmax(m->most[part[i]], t.rounding[i]);
    for (int32_t i = 0; i < m->n; i++)
        if (t.wrong[i] != 0.0)
            perp__raise_to(&own, t.wrong[i] / (t.around[i] + least * m->most[part[i]]));
    return own;
}

double perp__ncp_own_residual(perp_ncp_solver *solver)
{
    perp__ncp_model *m = &solver->model;
    const perp__matrix J = perp__ncp_given(m);
    double own = own_residual(solver);

    /* of two diagonals of different sign either may be noise beside their coupling */
    if (m->scaling && perp__equilibrate_negative(&J, m->exponents, m->exponents_work))
        perp__raise_to(&own, own_residual(solver));
    return own;
}
