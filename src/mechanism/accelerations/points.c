/* The points of a family's polyhedron: rays of its cone, as forces in all rows. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations/accelerations.h"

/* Entries below this, beside their terms, are rounding. */
#define ROUNDING 1e-11

static int32_t is_vertex(const perp__acceleration *a, int32_t dimension, int32_t k)
{
    return k < a->cone.rays &&
           a->cone.x[(size_t)k * (size_t)(dimension + 1)] > PERP__FAMILY_TOLERANCE;
}

/* Generator k of the cone, times `sign`, as a point or a direction in all rows. */
static void map_point(const perp__acceleration *a, int32_t dimension, int32_t k, double sign,
                      double *to)
{
    const double *y = a->cone.x + (size_t)k * (size_t)(dimension + 1);
    const double s = is_vertex(a, dimension, k) ? y[0] : 0.0;
    int32_t i, c;

    memset(to, 0, (size_t)a->m->rows * sizeof *to);
    for (i = 0; i < a->active; i++) {
        double sum = s * a->f[i], size = fabs(sum);

        for (c = 0; c < dimension; c++) {
            const double term = y[c + 1] * a->null[(size_t)c * (size_t)a->active + (size_t)i];

            sum += term;
            size += fabs(term);
        }
        if (fabs(sum) <= ROUNDING * size)
            sum = 0.0;
        to[a->row_of[i]] = s > 0.0 ? sum / s : sign * sum;
    }
}

static void map_points(perp__acceleration *a, int32_t dimension, perp__found_answer *answer)
{
    const size_t rows = (size_t)a->m->rows;
    int32_t next = 0, k;

    for (k = 0; k < a->cone.rays; k++)
        if (is_vertex(a, dimension, k))
            map_point(a, dimension, k, 1.0, answer->points + (size_t)next++ * rows);
    answer->vertices = next;
    for (k = 0; k < a->cone.rays + a->cone.lines; k++) {
        if (is_vertex(a, dimension, k))
            continue;
        map_point(a, dimension, k, 1.0, answer->points + (size_t)next++ * rows);
        if (k >= a->cone.rays)
            map_point(a, dimension, k, -1.0, answer->points + (size_t)next++ * rows);
    }
    answer->rays = next - answer->vertices;
}

int32_t perp__found_rank(perp__acceleration *a, const perp__found_answer *answer,
                         int32_t accelerations)
{
    const size_t active = (size_t)a->active, rows = (size_t)a->m->rows;
    double *basis = a->work, *d = basis + active * active, *u = d + active, largest = 0.0;
    const int32_t points = answer->vertices + answer->rays;
    int32_t rank = 0, k, pass, c;
    size_t i;

    for (pass = 0; pass < 2; pass++) /* sizes first */
        for (k = 1; k < points && rank < a->active; k++) {
            const double *point = answer->points + (size_t)k * rows;
            double length = 0.0;

            for (i = 0; i < active; i++)
                d[i] = (point[a->row_of[i]] -
                        (k < answer->vertices ? answer->points[a->row_of[i]] : 0.0)) /
                       a->scale[i];
            if (accelerations) {
                for (i = 0; i < active; i++)
                    d[i] *= a->scale[i];
                perp__found_row_accelerations(a, u, NULL, d, 1);
                for (i = 0; i < active; i++)
                    d[i] = u[i] * a->scale[i];
            }
            for (c = 0; c < rank; c++) {
                double dot = 0.0;

                for (i = 0; i < active; i++)
                    dot += d[i] * basis[(size_t)c * active + i];
                for (i = 0; i < active; i++)
                    d[i] -= dot * basis[(size_t)c * active + i];
            }
            for (i = 0; i < active; i++)
                length = hypot(length, d[i]);
            if (pass == 0) {
                for (i = 0; i < active; i++)
                    largest = fmax(largest, fabs(point[a->row_of[i]]) / a->scale[i]);
            } else if (length > PERP__FAMILY_TOLERANCE * largest) {
                for (i = 0; i < active; i++)
                    basis[(size_t)rank * active + i] = d[i] / length;
                rank++;
            }
        }
    return rank;
}

/* The middle of the vertices, and a unit of every ray. */
static void find_middle(const perp__acceleration *a, perp__found_answer *answer)
{
    const size_t rows = (size_t)a->m->rows;
    int32_t k;
    size_t i;

    for (i = 0; i < rows; i++) {
        double sum = 0.0, extra = 0.0;

        for (k = 0; k < answer->vertices; k++)
            sum += answer->points[(size_t)k * rows + i];
        for (; k < answer->vertices + answer->rays; k++)
            extra += answer->points[(size_t)k * rows + i];
        answer->force[i] = sum / answer->vertices + extra;
        answer->width[i] = PERP__FAMILY_TOLERANCE * fabs(answer->force[i]);
    }
}

int32_t perp__found_is_kept(perp__acceleration *a, const perp__found_answer *answer,
                            int32_t *at_vertex)
{
    const size_t active = (size_t)a->active;
    double *f = a->work, *u = f + active, *f_width = u + active, *u_width = f_width + active;
    size_t i;

    for (i = 0; i < active; i++) {
        f[i] = answer->force[a->row_of[i]];
        f_width[i] = answer->width[a->row_of[i]];
    }
    perp__found_row_accelerations(a, u, u_width, f, 0);
    for (i = 0; i < active; i++)
        u_width[i] *= PERP__FAMILY_TOLERANCE;
    return perp__found_keeps(a, &answer->pattern, f, u, f_width, u_width, 0, 0, at_vertex);
}

perp_status perp__found_polyhedron(perp__acceleration *a, int32_t dimension,
                                   perp__found_answer **made)
{
    const int32_t total = a->cone.rays + 2 * a->cone.lines;
    const size_t units = (size_t)a->units;
    perp__found_answer *answer;
    int32_t k, vertices = 0;

    *made = NULL;
    for (k = 0; k < a->cone.rays; k++)
        vertices += is_vertex(a, dimension, k);
    if (vertices == 0)
        return PERP_OK;
    answer = perp__found_create(a, total);
    if (!answer)
        return perp__fail_memory(a->m->context, "a family of accelerations");
    map_points(a, dimension, answer);
    memcpy(answer->pattern.mode, a->pattern.mode, units);
    memcpy(answer->pattern.way, a->pattern.way, 2 * units * sizeof *answer->pattern.way);
    find_middle(a, answer);
    *made = answer;
    return PERP_OK;
}
