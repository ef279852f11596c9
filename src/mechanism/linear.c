/* Equations and conditions of a pattern. */
#include "mechanism/linear.h"

#include <math.h>
#include <string.h>

#include "linalg/spatial.h"

/* Column j of B, of its first or second block. */
static const double *column_of(const perp__linear *p, int32_t block, int32_t j)
{
    return p->block[block] + (size_t)j * (size_t)p->length;
}

void perp__linear_layout(perp__linear *p, perp__arena *arena)
{
    const size_t n = (size_t)p->length, rows = (size_t)p->rows;

    PERP__DOUBLES(arena, n, &p->slope, &p->known, &p->y, &p->x, &p->x_width, &p->residual,
                  &p->load);
    PERP__DOUBLES(arena, rows, &p->u, &p->u_size, &p->u_width);
    PERP__DOUBLES(arena, n * n, &p->system.K, &p->null);
    PERP__INTEGERS(arena, n, &p->first, &p->count, &p->system.columns, &p->system.rows);
    p->coefficient = perp__arena_take(arena, PERP__MOST_TERMS * n, sizeof(double));
    p->work = perp__arena_take(arena, 8 * n, sizeof(double));
}

/* ---- equations ------------------------------------------------------------------------------ */

void perp__linear_begin(perp__linear *p)
{
    p->system.n = 0;
    memset(p->known, 0, (size_t)p->length * sizeof *p->known);
}

void perp__linear_column(perp__linear *p, int32_t first, int32_t count, const double coefficient[])
{
    const int32_t c = p->system.n++;

    p->first[c] = first;
    p->count[c] = count;
    memcpy(p->coefficient + PERP__MOST_TERMS * (size_t)c, coefficient,
           (size_t)count * sizeof *coefficient);
}

double perp__linear_load(perp__linear *p)
{
    const int32_t n = p->system.n, two = p->rows > p->length;
    double top = 0.0;

    for (int32_t c = 0; c < n; c++) { /* column c of the matrix, in its units */
        const int32_t from = p->first[c];
        const double *factor = p->coefficient + PERP__MOST_TERMS * (size_t)c;
        double *K = p->system.K + c;

        for (int32_t r = 0; r < n; r++, K += n) {
            const int32_t row = p->first[r];
            const double *first = column_of(p, 0, from) + row;
            const double *second = two ? column_of(p, 1, from) + row : first;
            const double slope = two ? p->slope[row] : 0.0, unit = p->scale[row] * p->scale[from];
            double sum = 0.0, size = 0.0;

            for (int32_t i = 0; i < p->count[c]; i++, first += p->length, second += p->length) {
                const double more = slope * *second;

                sum += factor[i] * (*first + more);
                size += fabs(factor[i]) * (fabs(*first) + fabs(more));
            }
            *K = sum * unit;
            if (!(size * unit <= top)) /* NaN, too */
                top = size * unit;
        }
    }
    memset(p->y, 0, (size_t)n * sizeof *p->y);
    memcpy(p->x, p->known, (size_t)p->length * sizeof *p->x);
    return top;
}

void perp__linear_rows(const perp__linear *p, double *u, double *size, const double *x,
                       int32_t homogeneous)
{
    const int32_t n = p->length;

    for (int32_t r = 0; r < p->rows; r++) {
        u[r] = homogeneous ? 0.0 : p->c[r];
        if (size)
            size[r] = homogeneous ? 0.0 : p->c_size[r];
    }
    for (int32_t block = 0; block * n < p->rows; block++, u += n, size = size ? size + n : NULL)
        for (int32_t j = 0; j < n; j++) {
            const double *b = column_of(p, block, j);

            for (int32_t r = 0; r < n && x[j] != 0.0; r++) {
                const double term = b[r] * x[j];

                u[r] += term;
                if (size)
                    size[r] += fabs(term);
            }
        }
}

void perp__linear_evaluate(perp__linear *p)
{
    perp__linear_rows(p, p->u, p->u_size, p->x, 0);
    for (int32_t i = 0; i < p->length; i++) {
        p->residual[i] = -p->u[i];
        p->load[i] = p->u_size[i];
        if (p->rows > p->length) {
            p->residual[i] -= p->slope[i] * p->u[p->length + i];
            p->load[i] += fabs(p->slope[i]) * p->u_size[p->length + i];
        }
    }
}

/* The equations' entries, in their units. */
static double *gather(const perp__linear *p, double *to, const double *from)
{
    for (int32_t c = 0; c < p->system.n; c++)
        to[c] = from[p->first[c]] * p->scale[p->first[c]];
    return to;
}

void perp__linear_add(const perp__linear *p, double *x, const double *y, bool absolute)
{
    for (int32_t c = 0; c < p->system.n; c++)
        for (int32_t i = 0; i < p->count[c]; i++) {
            const double term = p->coefficient[PERP__MOST_TERMS * (size_t)c + (size_t)i] * y[c] *
                                p->scale[p->first[c]];

            x[p->first[c] + i] += absolute ? fabs(term) : term;
        }
}

void perp__linear_correct(perp__linear *p)
{
    double *change = p->work + p->length;

    perp__pivoting_solve(&p->system, change, gather(p, p->work, p->residual));
    for (int32_t c = 0; c < p->system.n; c++)
        p->y[c] += change[c];
    memcpy(p->x, p->known, (size_t)p->length * sizeof *p->x);
    perp__linear_add(p, p->x, p->y, 0);
}

void perp__linear_find_widths(perp__linear *p)
{
    double *width = p->work + p->length;

    perp__pivoting_widths(&p->system, width, gather(p, p->work, p->load));
    for (int32_t j = 0; j < p->system.n; j++)
        width[j] *= p->tolerance;
    memset(p->x_width, 0, (size_t)p->length * sizeof *p->x_width);
    perp__linear_add(p, p->x_width, width, 1);
    for (int32_t r = 0; r < p->rows; r++) {
        p->u_width[r] = p->tolerance * p->u_size[r];
        for (int32_t j = 0; j < p->length; j++)
            p->u_width[r] += fabs(column_of(p, r >= p->length, j)[r % p->length]) * p->x_width[j];
    }
}

int32_t perp__linear_find_null(perp__linear *p)
{
    double *rhs = gather(p, p->work, p->residual), *load = gather(p, rhs + p->length, p->load);
    const int32_t dimension = p->system.n - p->system.rank;

    if (!perp__pivoting_is_consistent(&p->system, rhs, load, PERP__SINGULAR * p->tolerance))
        return -1;
    memset(p->null, 0, (size_t)dimension * (size_t)p->length * sizeof *p->null);
    for (int32_t k = 0; k < dimension; k++) {
        perp__pivoting_null(&p->system, p->work, k);
        perp__linear_add(p, p->null + (size_t)k * (size_t)p->length, p->work, 0);
    }
    return dimension;
}

/* ---- conditions ----------------------------------------------------------------------------- */

/* before: the value of the condition before. */
static bool satisfies(const perp__condition *g, const perp__linear_point *point, double *before,
                      int32_t *at_vertex)
{
    const double slack = PERP__SAME_DIRECTION * fabs(*before);
    double width = 0.0, value = point->homogeneous ? 0.0 : g->constant;

    /* The sum over the terms, of a disc without its two entries, and what counts as 0 in it. */
    for (int32_t k = g->kind == PERP__CONDITION_DISC ? 2 : 0; k < g->count; k++) {
        const int32_t i = g->index[k], entry = i < 0;

        value += g->factor[k] * (entry ? point->x[~i] : point->u[i]);
        width += fabs(g->factor[k]) * (entry ? point->x_width[~i] : point->u_width[i]);
    }
    *before = value;
    switch (g->kind) {
    case PERP__CONDITION_EQUATION:
        return point->solved || fabs(value) <= width;
    case PERP__CONDITION_PARALLEL:
        return fabs(value) <= slack + width;
    case PERP__CONDITION_POSITIVE:
        return point->closed ? value >= -width : value > width;
    case PERP__CONDITION_DISC:
        value -= hypot(point->x[~g->index[0]], point->x[~g->index[1]]);
        width += point->x_width[~g->index[0]] + point->x_width[~g->index[1]];
        break;
    default:
        break;
    }
    if (value >= -width && value <= width) /* no more than the width, or less, makes it so */
        *at_vertex = 1;
    return value >= -width;
}

bool perp__linear_holds(const perp__linear *p, const void *pattern, const perp__linear_point *point,
                        int32_t *at_vertex)
{
    perp__condition list[PERP__MOST_CONDITIONS];

    *at_vertex = 0;
    for (int32_t i = 0; i < p->positions; i++) {
        const int32_t count = p->conditions(p->user, pattern, i, list);
        double before = 0.0;

        for (int32_t k = 0; k < count; k++)
            if (!satisfies(list + k, point, &before, at_vertex))
                return 0;
    }
    return 1;
}

bool perp__linear_holds_at(const perp__linear *p, const void *pattern, const double *x,
                           int32_t homogeneous, double spread, int32_t *at_vertex)
{
    double *u = p->work, *u_width = u + 2 * p->length, *x_width = u_width + 2 * p->length;
    perp__linear_point point = {x, u, x_width, u_width, homogeneous, 1, 0};
    double largest = 0.0;

    perp__linear_rows(p, u, u_width, x, homogeneous);
    for (int32_t i = 0; i < p->rows; i++)
        u_width[i] *= PERP__AGREEMENT;
    for (int32_t i = 0; i < p->length; i++)
        largest = fmax(largest, spread * fabs(x[i]) / p->scale[i]);
    for (int32_t i = 0; i < p->length; i++)
        x_width[i] = PERP__AGREEMENT * fmax(fabs(x[i]), largest * p->scale[i]);
    return perp__linear_holds(p, pattern, &point, at_vertex);
}

static void cut(const perp__linear *p, perp__polyhedron *polyhedron, const perp__condition *g,
                double sign)
{
    perp__inequality to = {sign * g->constant, 0.0, p->work, g->strict};

    memset(p->work, 0, (size_t)p->length * sizeof *p->work);
    for (int32_t k = 0; k < g->count; k++) {
        const int32_t i = g->index[k];
        const double factor = sign * g->factor[k];

        if (i < 0) {
            p->work[~i] += factor;
            continue;
        }
        to.constant += factor * p->c[i];
        to.size += fabs(factor) * p->c_size[i];
        for (int32_t j = 0; j < p->length; j++)
            p->work[j] += factor * column_of(p, i >= p->length, j)[i % p->length];
    }
    perp__polyhedron_cut(polyhedron, &to);
}

void perp__linear_cut(const perp__linear *p, const void *pattern, perp__polyhedron *polyhedron)
{
    perp__condition list[PERP__MOST_CONDITIONS];

    for (int32_t i = 0; i < p->positions && !polyhedron->empty; i++) {
        const int32_t count = p->conditions(p->user, pattern, i, list);

        for (perp__condition *g = list; g < list + count; g++) {
            if (g->kind != PERP__CONDITION_EQUATION && g->kind != PERP__CONDITION_DISC)
                cut(p, polyhedron, g, 1.0);
            if (g->kind == PERP__CONDITION_PARALLEL)
                cut(p, polyhedron, g, -1.0);
            if (g->kind != PERP__CONDITION_DISC)
                continue;
            if (p->inside) { /* a regular polygon in place of a disc */
                g->constant *= cos(PERP__PI / p->edges);
                g->factor[2] *= cos(PERP__PI / p->edges);
            }
            for (int32_t k = 0; k < p->edges; k++) {
                const double turned =
                    p->angle[i] + 2.0 * PERP__PI * (k + (p->inside ? 0.5 : 0.0)) / p->edges;

                g->factor[0] = -cos(turned);
                g->factor[1] = -sin(turned);
                cut(p, polyhedron, g, 1.0);
            }
        }
    }
}
