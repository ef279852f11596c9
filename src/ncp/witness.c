/* The second witness for `solved`: what row i is wrong by, beside what it and its neighbours carry.
 *
 * The tested residual is relative to the largest numbers of a part, behind which a row may hide;
 * this one is relative to the row's own. In coordinates in which every row's and column's largest
 * entry is about 1, whatever the diagonal is. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/lines.h"
#include "ncp/solver.h"

#define FLOOR 1e-5 /* of the largest terms of the part: rows that are rounding alone */

/* The arrays, by what the walk calls them; all n. */
typedef struct witness {
    perp__matrix S;
    double strong;         /* couplings from this on, of their row's or column's largest */
    double *row, *column;  /* largest entries */
    double *terms, *reach; /* |S||z| + |q|; how large z_j might be for all that the rows can tell */
    double *carried;       /* |S| reach */
    int32_t *part;         /* by strong couplings */
} witness;

static witness witness_of(perp_ncp_solver *solver)
{
    perp__ncp_walk *f = &solver->walk;
    const double tol = solver->settings.tol;
    witness t;

    t.S = perp__ncp_view(&solver->model);
    t.strong = tol < 1.0 ? sqrt(tol) : 1.0;
    t.row = f->slope_z;
    t.column = f->slope_w;
    t.terms = f->part;
    t.reach = f->image;
    t.carried = f->gradient;
    t.part = solver->model.exponents_work;
    return t;
}

/* row, column, terms, and |z| or what is left of it at the start as reach. */
static void find_terms(const witness *t, const perp_ncp_solver *solver)
{
    const perp__ncp_model *m = &solver->model;

    for (int32_t i = 0; i < m->n; i++) {
        t->row[i] = t->column[i] = t->carried[i] = 0.0;
        t->terms[i] = fabs(m->offset[i]);
        t->reach[i] = perp__ncp_size_left(m, i, solver->walk.z[i]);
    }
    for (int32_t j = 0; j < m->n; j++) {
        const perp__line l = perp__line_of(&t->S, j);

        for (int32_t k = 0; k < l.count; k++) {
            const int32_t i = l.indices ? l.indices[k] : k;
            const double size = fabs(l.values[k]);

            t->row[i] = fmax(t->row[i], size);
            t->column[j] = fmax(t->column[j], size);
            t->terms[i] += size * fabs(solver->walk.z[j]);
        }
    }
}

/* reach and carried. */
static void find_reach(const witness *t)
{
    for (int32_t j = 0; j < t->S.rows; j++) {
        const perp__line l = perp__line_of(&t->S, j);

        for (int32_t k = 0; k < l.count; k++) {
            const int32_t i = l.indices ? l.indices[k] : k;
            const double size = fabs(l.values[k]);

            if (size > 0.0 && size >= t->strong * fmax(t->row[i], t->column[j]))
                t->reach[j] = fmax(t->reach[j], t->terms[i] / size);
        }
        for (int32_t k = 0; k < l.count; k++)
            t->carried[l.indices ? l.indices[k] : k] += fabs(l.values[k]) * t->reach[j];
    }
}

/* By how much row i fails to be that of a solution with the index set read from z. */
static double wrong(const perp__ncp_model *m, int32_t i, double z, double w, double close)
{
    if (m->lower[i] == m->upper[i])
        return 0.0;
    if (z - m->low[i] <= close && z - m->low[i] <= m->high[i] - z)
        return w < 0.0 ? -w : 0.0;
    if (m->high[i] - z <= close)
        return w > 0.0 ? w : 0.0;
    return fabs(w);
}

double perp__ncp_own_residual(perp_ncp_solver *solver)
{
    perp__ncp_model *m = &solver->model;
    perp__ncp_walk *f = &solver->walk;
    const double tol = solver->settings.tol, least = fmax(FLOOR, 16.0 * DBL_EPSILON / tol);
    witness t;
    double own = 0.0;

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
    find_terms(&t, solver);
    find_reach(&t);
    perp__ncp_find_parts(m, t.part, t.row, t.column, t.strong);
    memset(m->most, 0, 2 * (size_t)m->n * sizeof(double));
    for (int32_t i = 0; i < m->n; i++)
        m->most[t.part[i]] = fmax(m->most[t.part[i]], t.terms[i]);
    for (int32_t i = 0; i < m->n; i++) {
        const double off = wrong(m, i, f->z[i], f->w[i], tol * t.reach[i]);

        if (off != 0.0)
            perp__raise_to(&own, off / (t.terms[i] + t.carried[i] + least * m->most[t.part[i]]));
    }
    return own;
}
