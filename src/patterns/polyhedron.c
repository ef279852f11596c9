/* Families of answers: an affine set cut by inequalities, listed by its vertices and rays. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/active_rows.h"
#include "linalg/matrix.h"
#include "patterns/patterns.h"

/* ---- inequalities -------------------------------------------------------------------------- */

perp_status perp__polyhedron_begin(perp__polyhedron *p, int32_t rows, int32_t dimension)
{
    const perp_status status = perp__cone_fit(&p->cone, rows + 1, dimension + 1);

    if (status != PERP_OK)
        return status;
    p->dimension = dimension;
    p->empty = 0;
    p->cone.dimension = dimension + 1;
    memset(p->cone.A, 0, ((size_t)dimension + 1) * sizeof *p->cone.A);
    p->cone.A[0] = 1.0; /* s >= 0 */
    p->cone.rows = 1;
    return PERP_OK;
}

void perp__polyhedron_cut(perp__polyhedron *p, const perp__inequality *g)
{
    double *to = p->cone.A + (size_t)p->cone.rows * (size_t)p->cone.dimension;
    int32_t varies = 0, i, k;

    for (k = 0; k <= p->dimension; k++) {
        const double *x = k == 0 ? p->origin : p->directions + (size_t)(k - 1) * (size_t)p->length;
        double sum = k == 0 ? g->constant : 0.0, size = k == 0 ? fabs(sum) + g->size : 0.0;

        for (i = 0; i < p->length; i++) {
            sum += g->row[i] * x[i];
            size += fabs(g->row[i] * x[i]);
        }
        to[k] = fabs(sum) <= p->row_rounding * size ? 0.0 : sum;
        varies |= k > 0 && to[k] != 0.0;
    }
    if (!varies && (to[0] < 0.0 || (g->strict && to[0] == 0.0)))
        p->empty = 1;
    p->cone.rows += varies || to[0] != 0.0;
}

/* ---- points -------------------------------------------------------------------------------- */

perp_status perp__polyhedron_enumerate(perp__polyhedron *p, perp__answers *answers)
{
    const perp_status status = p->empty ? PERP_OK : perp__cone_enumerate(&p->cone);

    if (status == PERP__CONE_TOO_LARGE)
        answers->incomplete = 1;
    if (p->empty || status == PERP__CONE_TOO_LARGE)
        p->cone.rays = p->cone.lines = 0;
    return status == PERP__CONE_TOO_LARGE ? PERP_OK : status;
}

static double *generator(const perp__polyhedron *p, int32_t k)
{
    return p->cone.x + (size_t)k * (size_t)p->cone.dimension;
}

bool perp__polyhedron_is_vertex(const perp__polyhedron *p, int32_t k)
{
    return k < p->cone.rays && generator(p, k)[0] > p->least;
}

void perp__polyhedron_point(const perp__polyhedron *p, int32_t k, double sign, double *to)
{
    const double *y = generator(p, k), s = perp__polyhedron_is_vertex(p, k) ? y[0] : 0.0;

    for (int32_t i = 0; i < p->length; i++) {
        double sum = s * p->origin[i], size = fabs(sum);

        for (int32_t c = 0; c < p->dimension; c++) {
            const double term = y[c + 1] * p->directions[(size_t)c * (size_t)p->length + (size_t)i];

            sum += term;
            size += fabs(term);
        }
        if (fabs(sum) <= p->rounding * size)
            sum = 0.0;
        to[p->entries ? p->entries[i] : i] = s > 0.0 ? sum / s : sign * sum;
    }
}

perp_status perp__polyhedron_list(perp__polyhedron *p, perp__answers *answers, perp__answer **made)
{
    const int32_t total = p->cone.rays + p->cone.lines, points = total + p->cone.lines;
    const size_t length = (size_t)answers->length;
    int32_t vertices = 0, k;
    double *next;

    *made = NULL;
    for (k = 0; k < p->cone.rays; k++)
        vertices += perp__polyhedron_is_vertex(p, k);
    if (vertices == 0)
        return PERP_OK;
    *made = perp__answer_create(answers, points);
    if (!*made)
        return perp__fail_memory(answers->context, "a family of answers");
    (*made)->vertices = vertices;
    (*made)->rays = points - vertices;
    next = (*made)->points;
    memset(next, 0, (size_t)points * length * sizeof *next);
    for (k = 0; k < p->cone.rays; k++)
        if (perp__polyhedron_is_vertex(p, k)) {
            perp__polyhedron_point(p, k, 1.0, next);
            next += length;
        }
    for (k = 0; k < total; k++) {
        if (perp__polyhedron_is_vertex(p, k))
            continue;
        perp__polyhedron_point(p, k, 1.0, next);
        next += length;
        if (k >= p->cone.rays) { /* a line */
            perp__polyhedron_point(p, k, -1.0, next);
            next += length;
        }
    }
    perp__answer_find_middle(answers, *made);
    return PERP_OK;
}

int32_t perp__rank_add(double *basis, int32_t rank, int32_t n, double least)
{
    double *direction = basis + (size_t)rank * (size_t)n, length;

    perp__project_out(basis, rank, n, direction);
    length = perp__length(direction, n);
    if (!(length > least))
        return rank;
    for (int32_t i = 0; i < n; i++)
        direction[i] /= length;
    return rank + 1;
}
