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

/* Turns of the polygons until the middle is in the discs. */
#define MOST_CUTS 24
/* Polyhedra of more have too many vertices. */
#define LARGEST_DIMENSION 10

/* Discs of friction that the family has to stay in. */
static int32_t count_discs(const perp__acceleration *a)
{
    int32_t discs = 0, i;

    for (i = 0; i < a->elements; i++)
        discs += a->pattern.mode[i] == PERP_MECHANISM_STICK && a->element[i].tangents == 2;
    return discs;
}

/* Edges of their polygons: fewer where there are many corners, and as many as there is room for. */
static int32_t edges_of(const perp__acceleration *a, int32_t dimension, int32_t discs)
{
    int32_t edges = dimension <= 2 ? a->m->settings.directions : dimension <= 4 ? 6 : 4;

    while (edges > 3 && 1 + 4 * a->elements + edges * discs > PERP__CONE_ROWS)
        edges--;
    return edges;
}

/* Forces in units of the loads, so that points have entries near 1. */
static void scale_directions(perp__acceleration *a, int32_t dimension)
{
    const size_t active = (size_t)a->active;
    double size = 0.0;
    size_t i;

    for (i = 0; i < active; i++)
        size = fmax(size, fmax(fabs(a->linear.x[i]) / a->scale[i], a->load[i] * a->scale[i]));
    for (i = 0; i < (size_t)dimension * active && size > 0.0; i++)
        a->linear.null[i] *= size;
}

/* ---- the family ----------------------------------------------------------------------------- */

/* The polyhedron in `null` directions as an answer without a description; NULL where it is empty.
 */
static perp_status enumerate(perp__acceleration *a, int32_t dimension, int32_t discs,
                             int32_t inside, perp__answer **made)
{
    perp_status status;
    int32_t i;

    *made = NULL;
    a->linear.inside = inside;
    a->linear.edges = discs > 0 ? edges_of(a, dimension, discs) : 0;
    status = perp__polyhedron_begin(&a->polyhedron, 4 * a->elements + a->linear.edges * discs,
                                    dimension);
    if (status != PERP_OK)
        return status;
    perp__linear_cut(&a->linear, &a->pattern, &a->polyhedron);
    if (a->polyhedron.empty)
        return PERP_OK;
    if (dimension > LARGEST_DIMENSION) {
        a->answers.incomplete = 1;
        return PERP_OK;
    }
    status = perp__polyhedron_enumerate(&a->polyhedron, &a->answers);
    if (status == PERP_OK)
        status = perp__polyhedron_list(&a->polyhedron, &a->answers, made);
    if (!*made)
        return status;
    perp__acceleration_set_pattern(a, *made);
    for (i = 0; i < a->m->rows; i++)
        (*made)->width[i] = PERP__FAMILY_TOLERANCE * fabs((*made)->middle[i]);
    return PERP_OK;
}

/* Whether the middle does what the pattern says; *at_vertex: at a limit, and so is the family. */
static int32_t holds_middle(perp__acceleration *a, const perp__answer *answer, int32_t *at_vertex)
{
    return perp__acceleration_has_point(a, answer, answer->middle, 0, 0.0, at_vertex);
}

/* Turns the polygons to where the middle is. */
static void aim(perp__acceleration *a, const perp__answer *answer)
{
    int32_t i;

    for (i = 0; i < a->elements; i++) {
        const perp__element *element = a->element + i;
        const double *f = answer->middle + a->row_of[element->row] + !element->dry;

        if (element->tangents == 2)
            a->linear.angle[i] = atan2(f[1], f[0]);
    }
}

/* The rank of the points' differences, as forces or as accelerations, in the units of the rows. */
static int32_t rank_of(perp__acceleration *a, const perp__answer *answer, int32_t accelerations)
{
    const size_t active = (size_t)a->active, rows = (size_t)a->m->rows;
    double *difference = a->work + active * active, largest = 0.0;
    const int32_t points = answer->vertices + answer->rays;
    int32_t rank = 0, k;
    size_t i;

    for (k = 1; k < points; k++)
        for (i = 0; i < active; i++)
            largest = fmax(largest, fabs(answer->points[(size_t)k * rows + (size_t)a->row_of[i]]) /
                                        a->scale[i]);
    for (k = 1; k < points && rank < a->active; k++) {
        double *d = a->work + (size_t)rank * active;

        for (i = 0; i < active; i++)
            difference[i] = answer->points[(size_t)k * rows + (size_t)a->row_of[i]] -
                            (k < answer->vertices ? answer->points[a->row_of[i]] : 0.0);
        if (accelerations)
            perp__linear_rows(&a->linear, d, NULL, difference, 1);
        for (i = 0; i < active; i++)
            d[i] = accelerations ? d[i] * a->scale[i] : difference[i] / a->scale[i];
        rank = perp__rank_add(a->work, rank, a->active, PERP__FAMILY_TOLERANCE * largest);
    }
    return rank;
}

perp_status perp__acceleration_keep_family(perp__acceleration *a, int32_t dimension)
{
    const int32_t discs = count_discs(a);
    perp__answer *answer = NULL;
    int32_t at_vertex = 0, holds = 0, round;
    perp_status status;

    scale_directions(a, dimension);
    memset(a->linear.angle, 0, (size_t)a->elements * sizeof *a->linear.angle);
    for (round = 0; round < MOST_CUTS && !holds; round++) {
        if (answer)
            perp__answer_release(&a->answers, answer);
        status = enumerate(a, dimension, discs, 0, &answer);
        if (!answer)
            return status;
        holds = discs == 0 || holds_middle(a, answer, &at_vertex);
        aim(a, answer);
    }
    if (discs > 0) {
        perp__answer_release(&a->answers, answer);
        answer = NULL;
        status = holds ? enumerate(a, dimension, discs, 1, &answer) : PERP_OK;
        a->answers.incomplete |= !answer;
        if (!answer)
            return status;
    }
    holds_middle(a, answer, &at_vertex);
    answer->dimension = answer->vertices + answer->rays == 1 ? 0 : rank_of(a, answer, 0);
    answer->free = answer->dimension == 0 ? 0 : rank_of(a, answer, 1);
    answer->at_vertex = at_vertex;
    if (answer->dimension == 0)
        answer->vertices = 1;
    perp__acceleration_keep(a, answer);
    return PERP_OK;
}
