/* Every pattern of modes, one after the other, and what their determinants say. */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

/* ---- why there are as many ------------------------------------------------------------------
 *
 * Each pattern's system has a determinant, a principal minor of the contact matrix; in the plane
 * all of them are positive if and only if there is exactly one answer whatever the loads are (the
 * map of the patterns is piecewise linear, with no more than four pieces around an edge: S.
 * Scholtes, "Introduction to Piecewise Differentiable Equations" (2012), section 2.3). */

/* Remembers the sign of the determinant of the pattern that was solved last, and the first contact
 * that does not separate in it. */
static void note_sign(perp__acceleration *a)
{
    int32_t first = 0, contact;

    for (int32_t i = 0; i < a->elements; i++)
        a->bent |= perp__load_slips(a, i);
    if (a->bent)
        return;
    while (first < a->closed && a->pattern.mode[first] == PERP_MECHANISM_SEPARATE)
        first++;
    contact = first < a->closed ? a->element[first].source : -1;
    if (a->linear.system.sign == 0 && !a->has_singular) {
        a->has_singular = 1;
        a->singular_contact = contact;
    }
    if (a->linear.system.sign < 0 && !a->has_negative) {
        a->has_negative = 1;
        a->negative_contact = contact;
    }
}

/* n'M^-1 (n - mu d) beside n'M^-1 n, in the worst direction; with several normals, or of any sign,
 * 1 - mu max |W_NN^-1 W_Nt d|: what friction that grows with |N| leaves of the normals' share. +inf
 * where there is no such thing. */
static double inertia_of(const perp__acceleration *a, const perp__element *element)
{
    const size_t active = (size_t)a->active, r = (size_t)element->row;
    const double *row = a->held + r * active, *d = element->direction;
    const int32_t k = element->normals, tangents = element->moves ? 1 : element->tangents;
    double coupling[2 * PERP__MOST_NORMALS] = {0.0}, square[4] = {0.0}, root, along;

    if (!element->friction || !(row[r] > PERP__NOTHING * a->W[r * (active + 1)]))
        return INFINITY;
    if (!element->two_sided) {
        if (element->moves)
            along = d[0] * row[r + 1] + (element->tangents > 1 ? d[1] * row[r + 2] : 0.0);
        else
            along = element->tangents == 1 ? fabs(row[r + 1]) : hypot(row[r + 1], row[r + 2]);
        return (row[r] - element->mu * along) / row[r];
    }
    for (int32_t i = 0; i < k; i++)
        for (int32_t j = 0; j < element->tangents; j++)
            coupling[i * tangents + (element->moves ? 0 : j)] +=
                a->held[(r + (size_t)i) * active + r + (size_t)(k + j)] *
                (element->moves ? d[j] : 1.0);
    if (!perp__solve_small(a->held + r * (active + 1), k, a->active, coupling, tangents))
        return INFINITY;
    for (int32_t i = 0; i < k; i++)
        for (int32_t j = 0; j < tangents; j++)
            for (int32_t l = 0; l < tangents; l++)
                square[2 * j + l] += coupling[i * tangents + j] * coupling[i * tangents + l];
    root = hypot(0.5 * (square[0] - square[3]), square[1]); /* the larger of two eigenvalues */
    return 1.0 - element->mu * sqrt(0.5 * (square[0] + square[3]) + root);
}

/* Of contacts that hold both ways, with pieces on both sides of N = 0, six are around each at rest:
 * then the map may go around twice, but not where all minors are positive and there is one answer
 * now, as it has one then for any loads. */
static void find_reason(const perp__acceleration *a, perp_mechanism_summary *summary)
{
    int32_t worst = -1, loose = -1, decide = a->bent ? a->closed == 1 : 1;

    summary->inertia = INFINITY;
    for (int32_t i = 0; i < a->closed; i++) {
        const perp__element *element = a->element + i;
        const double inertia = inertia_of(a, element);

        if (inertia < summary->inertia) {
            summary->inertia = inertia;
            worst = element->source;
        }
        if (!element->friction || element->moves)
            continue;
        if (loose < 0 && element->mu_stick > element->mu)
            loose = element->source; /* at rest it has more friction than it slips with */
        if (element->two_sided && !a->bent)
            decide = a->answers.count == 1 && a->answers.first->dimension == 0;
    }
    summary->reason =
        summary->inertia < -PERP__ACCELERATION_SINGULAR   ? PERP_MECHANISM_NEGATIVE_INERTIA
        : !a->complete                                    ? PERP_MECHANISM_UNDECIDED
        : a->has_negative                                 ? PERP_MECHANISM_COUPLED
        : summary->inertia <= PERP__ACCELERATION_SINGULAR ? PERP_MECHANISM_ZERO_INERTIA
        : a->has_singular                                 ? PERP_MECHANISM_REDUNDANT
        : loose >= 0                                      ? PERP_MECHANISM_STATIC_FRICTION
        : !decide                                         ? PERP_MECHANISM_UNDECIDED
                                                          : PERP_MECHANISM_ALWAYS_ONE;
    summary->contact = summary->reason == PERP_MECHANISM_NEGATIVE_INERTIA ||
                               summary->reason == PERP_MECHANISM_ZERO_INERTIA
                           ? worst
                       : summary->reason == PERP_MECHANISM_COUPLED         ? a->negative_contact
                       : summary->reason == PERP_MECHANISM_REDUNDANT       ? a->singular_contact
                       : summary->reason == PERP_MECHANISM_STATIC_FRICTION ? loose
                                                                           : -1;
}

/* ---- one pattern ----------------------------------------------------------------------------- */

static perp_status keep(perp__acceleration *a, int32_t dimension)
{
    const perp__linear *p = &a->linear;
    const perp__linear_point point = {p->x, p->u, p->x_width, p->u_width, 0, 0, 0};
    int32_t at_vertex;

    if (dimension > 0)
        return perp__acceleration_keep_family(a, dimension);
    if (dimension < 0 || !perp__linear_holds(p, &a->pattern, &point, &at_vertex))
        return PERP_OK;
    return perp__acceleration_keep_point(a, at_vertex);
}

/* With many slips that start in a plane at once their directions are many: every second, then every
 * fourth of each are where Newton's method starts. */
static bool is_start(const perp__acceleration *a, int32_t turning)
{
    const int32_t stride = turning <= 2 ? 1 : turning <= 4 ? 2 : 4;
    const int32_t directions = a->m->settings.directions;

    for (int32_t i = 0; i < a->elements && stride > 1 && directions >= 2 * stride; i++) {
        const double *direction = a->pattern.direction + 2 * (size_t)i;
        int32_t k;

        if (!perp__slip_starts(a, i))
            continue;
        k = (int32_t)lround(atan2(direction[1], direction[0]) / (2.0 * PERP__PI) * directions);
        if ((k + directions) % directions % stride != 0)
            return 0;
    }
    return 1;
}

perp_status perp__acceleration_try(perp__acceleration *a, double singular)
{
    return keep(a,
                perp__slip_count(a) == 0 ? perp__pattern_solve(a) : perp__slip_turn(a, singular));
}

/* From loads that are nearly right: Newton's method, as |N| is linear in the end. */
static perp_status try_loads(perp__acceleration *a)
{
    const size_t size = 2 * (size_t)a->elements * sizeof *a->chosen;
    perp_status status = PERP_OK;
    int32_t dimension = 0;

    if (perp__slip_count(a) > 0) {
        status = keep(a, perp__slip_turn(a, PERP__NOTHING));
        memcpy(a->pattern.direction, a->chosen, size);
        return status;
    }
    for (int32_t round = 0; round < PERP__MOST_ITERATES; round++) {
        dimension = perp__pattern_solve(a);
        if (perp__load_turn(a) <= PERP__SUM_ROUNDING)
            return keep(a, dimension);
    }
    a->answers.incomplete = 1;
    return status;
}

/* A slip that starts in the first of the directions: all of its directions are found at once. In
 * the others there is nothing left to do. */
static perp_status try_directions(perp__acceleration *a)
{
    const int32_t directions = a->m->settings.directions;
    double angles[4], *direction;
    perp_status status = PERP_OK;
    int32_t index = 0, count, k;

    while (!perp__slip_starts(a, index))
        index++;
    direction = a->pattern.direction + 2 * (size_t)index;
    if (direction[0] != 1.0)
        return PERP_OK;
    count = perp__slip_angles(a, angles);
    for (k = 0; k < (count < 0 ? directions : count) && status == PERP_OK; k++) {
        const double angle = count < 0 ? 2.0 * PERP__PI * k / directions : angles[k];

        direction[0] = cos(angle);
        direction[1] = sin(angle);
        status = keep(a, perp__slip_turn(a, PERP__NOTHING));
    }
    return status;
}

static perp_status try_pattern(perp__acceleration *a)
{
    const int32_t turning = perp__slip_count(a);
    perp_status status = PERP_OK;
    int32_t dimension, i = 0;

    while (i < a->elements && !perp__load_slips(a, i))
        i++;
    if (i < a->elements) {
        note_sign(a);
        if (turning == 0 || is_start(a, turning))
            status = perp__load_all(a, try_loads);
    } else if (turning == 0) {
        dimension = perp__pattern_solve(a);
        note_sign(a);
        perp__load_turn(a); /* of what sticks */
        status = keep(a, dimension);
    } else {
        perp__pattern_solve_roughly(a, PERP__ACCELERATION_SINGULAR, a->active);
        note_sign(a);
        if (turning == 1)
            status = try_directions(a);
        else if (is_start(a, turning))
            status = perp__acceleration_try(a, PERP__NOTHING);
    }
    return status;
}

static perp_status leaf(void *user)
{
    perp__acceleration *a = user;
    const size_t size = 2 * (size_t)a->elements * sizeof *a->chosen;
    perp_status status;

    if (a->leaves % PERP__A_READING == 0 && perp__mechanism_is_late(a->m)) {
        a->complete = 0;
        a->tree.ended = 1;
        return PERP_OK;
    }
    a->leaves++;
    memcpy(a->chosen, a->pattern.direction, size);
    status = try_pattern(a);
    memcpy(a->pattern.direction, a->chosen, size); /* slips have been turned */
    return status;
}

/* Fewer contacts that press first. */
static int32_t is_before(const void *user, const perp__answer *one, const perp__answer *other)
{
    const perp__acceleration *a = user;
    const double *x = one->extra, *y = other->extra;

    if (one->kind != other->kind)
        return one->kind < other->kind;
    for (int32_t i = 0; i < a->m->n; i++)
        if (x[i] != y[i])
            return x[i] < y[i];
    return 1;
}

perp_status perp__acceleration_look(perp__acceleration *a, perp_mechanism_summary *summary,
                                    int32_t impact)
{
    const int64_t most = a->m->settings.most_patterns;
    perp_status status = PERP_OK;

    summary->closed = a->closed;
    summary->exhaustive = 1;
    summary->contact = impact;
    summary->impact = impact >= 0;
    summary->inertia = INFINITY;
    summary->reason = PERP_MECHANISM_UNDECIDED;
    if (impact >= 0)
        return PERP_OK;
    /* 1. all patterns, where they are not too many */
    a->tree = (perp__pattern_tree){a->elements,           a->tree.next,         0,   1, a,
                                   perp__element_choices, perp__element_choose, leaf};
    a->leaves = 0;
    a->complete =
        a->closed <= PERP__MOST_CONTACTS && perp__pattern_tree_count(&a->tree, most) <= most;
    if (a->complete)
        status = perp__pattern_tree_search(&a->tree);
    summary->patterns = a->leaves;
    /* 2. else, and where a family is too large, what searches find */
    PERP__THEN(status, perp__acceleration_seed(a));
    summary->exhaustive = a->complete && !a->answers.incomplete;
    if (!summary->exhaustive)
        PERP__THEN(status, perp__acceleration_search(a, summary));
    if (status != PERP_OK) {
        perp__answers_clear(&a->answers);
        return status;
    }
    /* 3. what there is to say of them */
    find_reason(a, summary);
    perp__answers_sort(&a->answers, is_before);
    summary->count = a->answers.count;
    for (const perp__answer *answer = a->answers.first; answer; answer = answer->next) {
        summary->families += answer->dimension > 0;
        summary->stable += answer->stable;
    }
    return PERP_OK;
}
