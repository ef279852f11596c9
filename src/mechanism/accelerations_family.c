/* A pattern whose forces are not unique: f = f_0 + sum of null directions, cut by the inequalities
 * of the pattern. The polyhedron is given by its vertices and rays. In 3 dimensions a disc of
 * friction is replaced by a regular polygon within it. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations.h"

/* Entries of an inequality below this, beside its terms, are rounding. */
#define ROUNDING 1e-11
#define PI 3.14159265358979323846

/* An inequality constant + row . f >= 0 on the active forces. size: of what is summed up. */
typedef struct inequality {
    double constant, size;
    const double *row;
} inequality;

static void put(perp__acceleration *a, int32_t dimension, const inequality *g)
{
    const size_t active = (size_t)a->active;
    double *to = a->cone.A + (size_t)a->cone.rows * (size_t)(dimension + 1);
    double largest = 0.0;
    int32_t k;
    size_t i;

    for (k = 0; k <= dimension; k++) {
        const double *direction = k == 0 ? a->f : a->null + (size_t)(k - 1) * active;
        double size = k == 0 ? fabs(g->constant) + g->size : 0.0;

        to[k] = k == 0 ? g->constant : 0.0;
        for (i = 0; i < active; i++) {
            to[k] += g->row[i] * direction[i];
            size += fabs(g->row[i] * direction[i]);
        }
        if (fabs(to[k]) <= ROUNDING * size)
            to[k] = 0.0;
        largest = fmax(largest, fabs(to[k]));
    }
    if (largest > 0.0)
        a->cone.rows++;
}

static void put_acceleration(perp__acceleration *a, int32_t dimension, int32_t row, double way_0,
                             double way_1, int32_t two)
{
    const size_t active = (size_t)a->active;
    double *sum = a->work;
    inequality g;
    size_t i;

    g.constant = way_0 * a->beta[row] + (two ? way_1 * a->beta[row + 1] : 0.0);
    g.size = fabs(way_0) * a->load[row] + (two ? fabs(way_1) * a->load[row + 1] : 0.0);
    for (i = 0; i < active; i++)
        sum[i] = way_0 * a->W[(size_t)row * active + i] +
                 (two ? way_1 * a->W[(size_t)(row + 1) * active + i] : 0.0);
    g.row = sum;
    put(a, dimension, &g);
}

/* bound + factor f_normal - way . f_tangent >= 0; normal < 0: none. */
static void put_friction(perp__acceleration *a, int32_t dimension, const perp__unit *unit,
                         double factor, double way_0, double way_1)
{
    const int32_t tangent = unit->dry ? unit->row : unit->row + 1;
    double *row = a->work;
    inequality g;

    memset(row, 0, (size_t)a->active * sizeof *row);
    g.constant = unit->dry ? factor * unit->bound : 0.0;
    g.size = 0.0;
    g.row = row;
    if (!unit->dry)
        row[unit->row] = factor;
    if (unit->tangents > 0)
        row[tangent] = -way_0;
    if (unit->tangents > 1)
        row[tangent + 1] = -way_1;
    put(a, dimension, &g);
}

/* Edges of the polygon of a disc: as many as there is room for. */
static int32_t edges_of(const perp__acceleration *a)
{
    int32_t discs = 0, others = 1, i, edges;

    for (i = 0; i < a->units; i++) {
        const int32_t sticks = a->pattern.mode[i] == PERP_MECHANISM_STICK;

        discs += sticks && a->unit[i].tangents == 2;
        others += 3;
    }
    if (discs == 0)
        return 2;
    edges = (PERP__CONE_ROWS - others) / discs;
    if (edges > a->m->settings.directions)
        edges = a->m->settings.directions;
    return edges;
}

static void put_unit(perp__acceleration *a, int32_t dimension, int32_t index, int32_t edges)
{
    const perp__unit *unit = a->unit + index;
    const int32_t mode = a->pattern.mode[index];
    const double *way = a->pattern.way + 2 * (size_t)index;
    const double limit = unit->dry ? 1.0 : unit->mu_stick;
    int32_t k;

    if (!unit->dry && mode == PERP_MECHANISM_SEPARATE)
        put_acceleration(a, dimension, unit->row, 1.0, 0.0, 0);
    else if (!unit->dry)
        put_friction(a, dimension, unit, 1.0, 0.0, 0.0);
    if (perp__found_starts(unit, mode))
        put_acceleration(a, dimension, unit->dry ? unit->row : unit->row + 1, way[0], way[1],
                         unit->tangents == 2);
    if (mode != PERP_MECHANISM_STICK)
        return;
    if (unit->tangents == 1) {
        put_friction(a, dimension, unit, limit, 1.0, 0.0);
        put_friction(a, dimension, unit, limit, -1.0, 0.0);
    }
    for (k = 0; unit->tangents == 2 && k < edges; k++)
        put_friction(a, dimension, unit, limit * cos(PI / edges), cos(2.0 * PI * (k + 0.5) / edges),
                     sin(2.0 * PI * (k + 0.5) / edges));
}

/* Forces in units of the loads, so that points have entries near 1. */
static void scale_directions(perp__acceleration *a, int32_t dimension)
{
    const size_t active = (size_t)a->active;
    double size = 0.0;
    size_t i;

    for (i = 0; i < active; i++)
        size = fmax(size, fmax(fabs(a->f[i]) / a->scale[i], a->load[i] * a->scale[i]));
    for (i = 0; i < (size_t)dimension * active && size > 0.0; i++)
        a->null[i] *= size;
}

/* ---- the points ---------------------------------------------------------------------------- */

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

/* The rank of the points' differences, as forces or as accelerations. */
static int32_t rank_of(perp__acceleration *a, const perp__found_answer *answer,
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

/* Whether the middle is at a limit: then the whole family is. */
static int32_t is_at_vertex(perp__acceleration *a, const perp__found_answer *answer)
{
    const size_t active = (size_t)a->active;
    double *f = a->work, *u = f + active, *f_width = u + active, *u_width = f_width + active;
    int32_t at_vertex = 0;
    size_t i;

    for (i = 0; i < active; i++) {
        f[i] = answer->force[a->row_of[i]];
        f_width[i] = answer->width[a->row_of[i]];
    }
    perp__found_row_accelerations(a, u, u_width, f, 0);
    for (i = 0; i < active; i++)
        u_width[i] *= PERP__FAMILY_TOLERANCE;
    perp__found_keeps(a, &answer->pattern, f, u, f_width, u_width, 0, 0, &at_vertex);
    return at_vertex;
}

static perp_status keep_polyhedron(perp__acceleration *a, int32_t dimension)
{
    const int32_t total = a->cone.rays + 2 * a->cone.lines;
    const size_t units = (size_t)a->units;
    perp__found_answer *answer;
    int32_t k, vertices = 0;

    for (k = 0; k < a->cone.rays; k++)
        vertices += is_vertex(a, dimension, k);
    if (vertices == 0)
        return PERP_OK;
    answer = perp__found_create(a, total);
    if (!answer)
        return perp__fail_memory(a->m->context, "a family of accelerations");
    map_points(a, dimension, answer);
    answer->dimension = total == 1 ? 0 : rank_of(a, answer, 0);
    answer->free = answer->dimension == 0 ? 0 : rank_of(a, answer, 1);
    memcpy(answer->pattern.mode, a->pattern.mode, units);
    memcpy(answer->pattern.way, a->pattern.way, 2 * units * sizeof *answer->pattern.way);
    find_middle(a, answer);
    answer->at_vertex = is_at_vertex(a, answer);
    if (answer->dimension == 0)
        answer->vertices = 1;
    perp__found_describe(a, answer);
    perp__found_keep(a, answer);
    return PERP_OK;
}

perp_status perp__found_keep_family(perp__acceleration *a, int32_t dimension)
{
    const int32_t edges = edges_of(a);
    int32_t i;
    perp_status status =
        perp__cone_fit(&a->cone, 1 + a->units * (edges > 2 ? edges + 2 : 4), dimension + 1);

    if (status != PERP_OK)
        return perp__fail_memory(a->m->context, "a family of accelerations");
    a->cone.dimension = dimension + 1;
    scale_directions(a, dimension);
    memset(a->cone.A, 0, (size_t)(dimension + 1) * sizeof *a->cone.A);
    a->cone.A[0] = 1.0;
    a->cone.rows = 1;
    for (i = 0; i < a->units; i++)
        put_unit(a, dimension, i, edges);
    status = perp__cone_enumerate(&a->cone);
    if (status == PERP__CONE_TOO_LARGE)
        return PERP_OK;
    return status == PERP_OK ? keep_polyhedron(a, dimension) : status;
}
