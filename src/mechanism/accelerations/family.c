/* A pattern whose forces are not unique: f = f_0 + sum of null directions, cut by the inequalities
 * of the pattern. The polyhedron is given by its vertices and rays.
 *
 * In 3 dimensions a disc of friction is replaced by a regular polygon: at first around it (where
 * nothing is left there is no answer), turned so that it cuts off what is outside of the disc,
 * until the middle of what is left is inside; then within the disc, with corners in the directions
 * of that middle. So no family is missed, and all of its points are answers, but not all answers
 * are there.
 */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations/accelerations.h"

/* Entries of an inequality below this, beside its terms, are rounding. */
#define ROUNDING 1e-11
#define PI 3.14159265358979323846
/* Turns of the polygons until the middle is in the discs. */
#define MOST_CUTS 24
/* Polyhedra of more have too many vertices. */
#define LARGEST_DIMENSION 10

/* An inequality constant + row . f >= 0 on the active forces. size: of what is summed up. strict:
 * where it is 0 in the whole family, another pattern has that family (one in which the contact
 * presses, or sticks). */
typedef struct inequality {
    double constant, size;
    const double *row;
    int32_t strict;
} inequality;

static void put(perp__acceleration *a, int32_t dimension, const inequality *g)
{
    const size_t active = (size_t)a->active;
    double *to = a->cone.A + (size_t)a->cone.rows * (size_t)(dimension + 1);
    double largest = 0.0, moving = 0.0;
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
        moving = k > 0 ? fmax(moving, fabs(to[k])) : 0.0;
    }
    if (moving == 0.0 && (to[0] < 0.0 || (g->strict && to[0] == 0.0)))
        a->impossible = 1;
    if (largest > 0.0)
        a->cone.rows++;
}

/* way_0 u_row' + way_1 u_row+1' >= 0, the second only of `two`. */
static void put_acceleration(perp__acceleration *a, int32_t dimension, int32_t row, double way_0,
                             double way_1, int32_t two, int32_t strict)
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
    g.strict = strict;
    put(a, dimension, &g);
}

/* A slip that starts: u_t' along its way, and nothing across. */
static void put_start(perp__acceleration *a, int32_t dimension, const perp__unit *unit,
                      const double *way)
{
    const int32_t row = unit->row + !unit->dry, two = unit->tangents == 2;

    put_acceleration(a, dimension, row, way[0], way[1], two, 1);
    if (two) {
        put_acceleration(a, dimension, row, -way[1], way[0], 1, 0);
        put_acceleration(a, dimension, row, way[1], -way[0], 1, 0);
    }
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
    g.strict = 0;
    if (!unit->dry)
        row[unit->row] = factor;
    if (unit->tangents > 0)
        row[tangent] = -way_0;
    if (unit->tangents > 1)
        row[tangent + 1] = -way_1;
    put(a, dimension, &g);
}

/* Discs of friction that the family has to stay in. */
static int32_t count_discs(const perp__acceleration *a)
{
    int32_t discs = 0, i;

    for (i = 0; i < a->units; i++)
        discs += a->pattern.mode[i] == PERP_MECHANISM_STICK && a->unit[i].tangents == 2;
    return discs;
}

/* Edges of their polygons: fewer where there are many corners, and as many as there is room for. */
static int32_t edges_of(const perp__acceleration *a, int32_t dimension, int32_t discs)
{
    int32_t edges = dimension <= 2 ? a->m->settings.directions : dimension <= 4 ? 6 : 4;

    while (edges > 3 && 1 + 4 * a->units + edges * discs > PERP__CONE_ROWS)
        edges--;
    return edges;
}

/* inside: polygons within the discs; else around them. */
static void put_unit(perp__acceleration *a, int32_t dimension, int32_t index, int32_t edges,
                     int32_t inside)
{
    const perp__unit *unit = a->unit + index;
    const int32_t mode = a->pattern.mode[index];
    const double *way = a->pattern.way + 2 * (size_t)index;
    const double limit = unit->dry ? 1.0 : unit->mu_stick;
    int32_t k;

    if (!unit->dry && mode == PERP_MECHANISM_SEPARATE)
        put_acceleration(a, dimension, unit->row, 1.0, 0.0, 0, 1);
    else if (!unit->dry)
        put_friction(a, dimension, unit, 1.0, 0.0, 0.0);
    if (perp__found_starts(unit, mode))
        put_start(a, dimension, unit, way);
    if (mode != PERP_MECHANISM_STICK)
        return;
    if (unit->tangents == 1) {
        put_friction(a, dimension, unit, limit, 1.0, 0.0);
        put_friction(a, dimension, unit, limit, -1.0, 0.0);
    }
    for (k = 0; unit->tangents == 2 && k < edges; k++) {
        const double angle = a->angle[index] + 2.0 * PI * (k + (inside ? 0.5 : 0.0)) / edges;

        put_friction(a, dimension, unit, inside ? limit * cos(PI / edges) : limit, cos(angle),
                     sin(angle));
    }
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

/* ---- the family ----------------------------------------------------------------------------- */

static perp_status enumerate(perp__acceleration *a, int32_t dimension, int32_t discs,
                             int32_t inside, perp__found_answer **made)
{
    const int32_t edges = discs > 0 ? edges_of(a, dimension, discs) : 0;
    perp_status status = perp__cone_fit(&a->cone, 1 + 4 * a->units + edges * discs, dimension + 1);
    int32_t i;

    *made = NULL;
    if (status != PERP_OK)
        return status;
    a->cone.dimension = dimension + 1;
    memset(a->cone.A, 0, (size_t)(dimension + 1) * sizeof *a->cone.A);
    a->cone.A[0] = 1.0;
    a->cone.rows = 1;
    a->impossible = 0;
    for (i = 0; i < a->units && !a->impossible; i++)
        put_unit(a, dimension, i, edges, inside);
    if (a->impossible)
        return PERP_OK;
    status = dimension > LARGEST_DIMENSION ? PERP__CONE_TOO_LARGE : perp__cone_enumerate(&a->cone);
    if (status == PERP__CONE_TOO_LARGE) {
        a->incomplete = 1;
        return PERP_OK;
    }
    return status == PERP_OK ? perp__found_polyhedron(a, dimension, made) : status;
}

/* Turns the polygons to where the middle is. */
static void aim(perp__acceleration *a, const perp__found_answer *answer)
{
    int32_t i;

    for (i = 0; i < a->units; i++) {
        const perp__unit *unit = a->unit + i;
        const double *f = answer->force + a->row_of[unit->row] + !unit->dry;

        if (unit->tangents == 2)
            a->angle[i] = atan2(f[1], f[0]);
    }
}

static void keep_polyhedron(perp__acceleration *a, perp__found_answer *answer, int32_t at_vertex)
{
    answer->dimension = answer->vertices + answer->rays == 1 ? 0 : perp__found_rank(a, answer, 0);
    answer->free = answer->dimension == 0 ? 0 : perp__found_rank(a, answer, 1);
    answer->at_vertex = at_vertex;
    if (answer->dimension == 0)
        answer->vertices = 1;
    perp__found_keep(a, answer);
}

perp_status perp__found_keep_family(perp__acceleration *a, int32_t dimension)
{
    const int32_t discs = count_discs(a);
    perp__found_answer *answer = NULL, *inner = NULL;
    int32_t at_vertex = 0, holds = 0, round;
    perp_status status = PERP_OK;

    scale_directions(a, dimension);
    memset(a->angle, 0, (size_t)a->units * sizeof *a->angle);
    for (round = 0; round < MOST_CUTS && status == PERP_OK && !holds; round++) {
        if (answer)
            perp__found_release_answer(a, answer);
        status = enumerate(a, dimension, discs, 0, &answer);
        if (status != PERP_OK || !answer)
            return status;
        holds = discs == 0 || perp__found_is_kept(a, answer, &at_vertex);
        aim(a, answer);
    }
    if (discs > 0) {
        perp__found_release_answer(a, answer);
        if (holds)
            status = enumerate(a, dimension, discs, 1, &inner);
        answer = inner;
        a->incomplete = a->incomplete || !inner;
    }
    if (status != PERP_OK || !answer)
        return status;
    perp__found_is_kept(a, answer, &at_vertex);
    keep_polyhedron(a, answer, at_vertex);
    return PERP_OK;
}
