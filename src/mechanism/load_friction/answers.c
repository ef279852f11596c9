/* Answers: kept as they are found, each once, then sorted. A family is a polyhedron, found by its
 * vertices and rays. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "mechanism/load_friction/load_friction.h"

/* Points of a family are the double description method's, which works to 1e-9 or so. */
static const double same = 1e-8;

/* What friction may miss beside the terms of its row and of its load. */
#define HELD 1e-9

static size_t at(const perp_load_friction *f, int32_t i, int32_t j)
{
    return (size_t)i + (size_t)f->n * (size_t)j;
}

/* ---- memory -------------------------------------------------------------------------------- */

static perp__friction_answer *take_spare(perp_load_friction *f)
{
    perp__friction_answer *a = f->spare;

    f->spare = a->next;
    a->next = NULL;
    a->residual = 0.0;
    return a;
}

perp__friction_answer *perp__friction_answer_create(perp_load_friction *f, int32_t points)
{
    const size_t n = (size_t)f->n;
    const size_t doubles = 8 * n + (size_t)points * n;
    perp__friction_answer *a;
    double *block;

    if (points == 1 && f->spare)
        return take_spare(f);
    a = perp__allocate(f->context, 1, sizeof *a + doubles * sizeof(double) + n * 4 + n * 2);
    if (!a)
        return NULL;
    memset(a, 0, sizeof *a);
    block = (double *)(void *)(a + 1);
    a->room = points;
    a->x = block;
    a->normal = block + n;
    a->friction = block + 2 * n;
    a->width = block + 3 * n;
    a->eigenvalues = block + 4 * n;
    a->points = block + 8 * n;
    a->modes = (int32_t *)(void *)(block + doubles);
    a->pattern.mode = (int8_t *)(a->modes + n);
    a->pattern.side = a->pattern.mode + n;
    return a;
}

/* Points are kept for the next ones; families are rare and of any size. */
void perp__friction_answer_release(perp_load_friction *f, perp__friction_answer *answer)
{
    if (answer->room == 1) {
        answer->next = f->spare;
        f->spare = answer;
    } else {
        perp__release(f->context, answer);
    }
}

void perp__friction_release_spare(perp_load_friction *f)
{
    while (f->spare) {
        perp__friction_answer *next = f->spare->next;

        perp__release(f->context, f->spare);
        f->spare = next;
    }
}

void perp__friction_release_answers(perp_load_friction *f)
{
    while (f->answers) {
        perp__friction_answer *next = f->answers->next;

        perp__friction_answer_release(f, f->answers);
        f->answers = next;
    }
    f->count = 0;
}

/* ---- points -------------------------------------------------------------------------------- */

/* Whether x (constant = 1) keeps the rows and signs of a pattern, or a direction does (0). */
static int32_t keeps(const perp_load_friction *f, const perp__friction_answer *a, const double *x,
                     int32_t constant)
{
    int32_t i, j;

    for (i = 0; i < f->n; i++) {
        const int32_t sticks = a->pattern.mode[i] == PERP_LOAD_STICK;
        const double sign = a->pattern.mode[i] == PERP_LOAD_FORWARD    ? 1.0
                            : a->pattern.mode[i] == PERP_LOAD_BACKWARD ? -1.0
                            : sticks                                   ? 0.0
                                                                       : f->question.sign[i];
        const double t = f->mu[i] * sign * a->pattern.side[i];
        double row = constant ? f->b[i] - f->question.tau[i] : 0.0;
        double size = constant ? fabs(f->b[i]) + fabs(f->question.tau[i]) : 0.0;
        double normal = constant ? f->d[i] : 0.0, normal_size = fabs(normal);

        for (j = 0; j < f->n; j++) {
            row += f->A[at(f, i, j)] * x[j];
            size += fabs(f->A[at(f, i, j)] * x[j]);
            normal += f->C[at(f, i, j)] * x[j];
            normal_size += fabs(f->C[at(f, i, j)] * x[j]);
        }
        if (!(a->pattern.side[i] * normal >= -same * normal_size))
            return 0;
        if (sticks) {
            if (!(fabs(x[i] - constant * f->question.stop[i]) <=
                  same * fabs(f->question.stop[i])) ||
                !(fabs(row) <= f->question.mu_stick[i] * fabs(normal) + same * size))
                return 0;
        } else if (!(fabs(row + t * normal) <= same * (size + fabs(t) * normal_size)) ||
                   (f->question.sign[i] == 0 &&
                    !(sign * (x[i] - constant * f->question.stop[i]) >=
                      -same * (fabs(x[i]) + fabs(f->question.stop[i]))))) {
            return 0;
        }
    }
    return 1;
}

static int32_t contains(const perp_load_friction *f, const perp__friction_answer *outer,
                        const perp__friction_answer *inner)
{
    int32_t k;

    for (k = 0; k < inner->vertices + inner->rays; k++)
        if (!keeps(f, outer, inner->points + (size_t)k * (size_t)f->n, k < inner->vertices))
            return 0;
    return 1;
}

/* Two patterns that meet in a vertex find it both. */
static int32_t is_same(const perp_load_friction *f, const perp__friction_answer *a,
                       const perp__friction_answer *b)
{
    int32_t i;

    if (memcmp(a->pattern.mode, b->pattern.mode, 2 * (size_t)f->n) == 0)
        return 1; /* a search comes by more than once */
    if (!a->at_vertex || !b->at_vertex)
        return 0;
    for (i = 0; i < f->n; i++)
        if (!(fabs(a->x[i] - b->x[i]) <= 2.0 * (a->width[i] + b->width[i])))
            return 0;
    return 1;
}

/* The new answer joins the list, or goes where another one has it already. */
static void keep(perp_load_friction *f, perp__friction_answer *a)
{
    perp__friction_answer **link = &f->answers;

    while (*link) {
        perp__friction_answer *old = *link;

        if (old->dimension == 0 && a->dimension == 0 ? is_same(f, old, a)
                                                     : old->dimension > 0 && contains(f, old, a)) {
            const int32_t unstable = old->dimension == 0 && old->stable && !a->stable;

            if (unstable) { /* of two branches that meet, one is not: so is the vertex */
                old->stable = 0;
                old->flutter = a->flutter;
                memcpy(old->eigenvalues, a->eigenvalues, 4 * (size_t)f->n * sizeof(double));
            }
            perp__friction_answer_release(f, a);
            return;
        }
        if (a->dimension > 0 && contains(f, a, old)) {
            *link = old->next;
            perp__friction_answer_release(f, old);
            f->count--;
            continue;
        }
        link = &old->next;
    }
    a->next = NULL;
    *link = a;
    f->count++;
}

/* What a step does to a coordinate that moved before: it goes on, or stops, or turns round. */
static int32_t name_mode(int32_t mode, int32_t way)
{
    if (way != 0 && mode == PERP_LOAD_STICK)
        return PERP_LOAD_STOPPED;
    if ((way > 0 && mode == PERP_LOAD_FORWARD) || (way < 0 && mode == PERP_LOAD_BACKWARD))
        return PERP_LOAD_SLIDE;
    return mode;
}

/* a->x is f->x, and evaluated. */
static void describe(perp_load_friction *f, perp__friction_answer *a)
{
    const size_t n = (size_t)f->n;
    int32_t sticks = 0, i, j;

    memcpy(a->pattern.mode, f->pattern.mode, n);
    memcpy(a->pattern.side, f->pattern.side, n);
    for (i = 0; i < f->n; i++) {
        const int32_t mode = f->pattern.mode[i];
        double row = f->b[i] - f->question.tau[i];

        for (j = 0; j < f->n; j++)
            row += f->A[at(f, i, j)] * a->x[j];
        a->normal[i] = f->normal[i];
        a->friction[i] = mode == PERP_LOAD_STICK ? -row : f->slope[i] * a->normal[i];
        perp__raise_to(&a->residual, mode == PERP_LOAD_STICK || f->load[i] == 0.0
                                         ? 0.0
                                         : fabs(f->rhs[i]) / f->load[i]);
        a->modes[i] = name_mode(mode, f->question.way[i]);
        sticks += mode == PERP_LOAD_STICK;
    }
    a->kind = a->dimension > 0 ? PERP_LOAD_FAMILY
              : sticks == 0    ? PERP_LOAD_DYNAMIC
              : sticks == f->n ? PERP_LOAD_STATIC
                               : PERP_LOAD_MIXED;
    perp__friction_label(f, &f->pattern, &a->stable, &a->flutter, a->eigenvalues);
    if (a->dimension > 0) /* one direction is free: nothing brings it back */
        a->stable = 0;
}

/* Whether all that would be told of an answer is finite. (Eigenvalues may be unknown, then it is
 * not stable.) */
static int32_t is_finite(const perp_load_friction *f, const perp__friction_answer *a)
{
    const size_t n = (size_t)f->n, points = (size_t)(a->vertices + a->rays);

    return perp__all_finite(a->points, points * n) && perp__all_finite(a->x, n) &&
           perp__all_finite(a->normal, n) && perp__all_finite(a->friction, n) &&
           perp__all_finite(&a->residual, 1);
}

/* Whether what sticks is held by its friction: beside the terms of its own rows, not the largest of
 * the system. */
static int32_t is_held(const perp_load_friction *f, const perp__friction_answer *a)
{
    int32_t i, j;

    for (i = 0; i < f->n; i++) {
        double terms = fabs(f->d[i]), size = fabs(f->b[i]) + fabs(f->question.tau[i]);

        if (a->pattern.mode[i] != PERP_LOAD_STICK)
            continue;
        for (j = 0; j < f->n; j++) {
            terms += fabs(f->C[at(f, i, j)] * a->x[j]);
            size += fabs(f->A[at(f, i, j)] * a->x[j]);
        }
        if (!(fabs(a->friction[i]) <=
              f->question.mu_stick[i] * (fabs(a->normal[i]) + HELD * terms) + HELD * size))
            return 0;
    }
    return 1;
}

/* Keeps it if it is one. */
static void keep_true(perp_load_friction *f, perp__friction_answer *a, int32_t holds)
{
    if (holds && is_finite(f, a) && is_held(f, a)) {
        keep(f, a);
    } else {
        f->unsettled = 1;
        perp__friction_answer_release(f, a);
    }
}

perp_status perp__friction_keep_point(perp_load_friction *f, int32_t at_vertex)
{
    const size_t size = (size_t)f->n * sizeof(double);
    perp__friction_answer *a = perp__friction_answer_create(f, 1);

    if (!a)
        return perp__fail_memory(f->context, "an acceleration");
    a->vertices = 1;
    a->dimension = a->rays = 0;
    a->at_vertex = at_vertex;
    memcpy(a->x, f->x, size);
    memcpy(a->width, f->width, size);
    memcpy(a->points, f->x, size);
    describe(f, a);
    keep_true(f, a, 1);
    return PERP_OK;
}

/* ---- families ------------------------------------------------------------------------------ */

/* One inequality on (s, factors): row(x) >= 0, with row_0 what it is at the particular point. */
static void put_row(perp_load_friction *f, int32_t dimension, double constant, const double *row)
{
    double *to = f->cone.A + (size_t)f->cone.rows * (size_t)(dimension + 1);
    int32_t i, k;

    to[0] = constant;
    for (i = 0; i < f->n; i++)
        to[0] += row[i] * f->x[i];
    for (k = 0; k < dimension; k++) {
        const double *direction = f->null + (size_t)k * (size_t)f->n;

        to[k + 1] = 0.0;
        for (i = 0; i < f->n; i++)
            to[k + 1] += row[i] * direction[i];
    }
    f->cone.rows++;
}

/* The inequalities of the pattern; sticking coordinates with the sides of bits in `sides`. */
static void put_rows(perp_load_friction *f, int32_t dimension, uint32_t sides)
{
    double *row = f->product;
    int32_t i, j, bit = 0;

    memset(f->cone.A, 0, (size_t)(dimension + 1) * sizeof(double));
    f->cone.A[0] = 1.0;
    f->cone.rows = 1;
    for (i = 0; i < f->n; i++) {
        const int32_t mode = f->pattern.mode[i];
        double side = f->pattern.side[i], limit = f->question.mu_stick[i], way;

        if (mode == PERP_LOAD_STICK && limit > 0.0)
            side = (sides >> bit++) & 1u ? -1.0 : 1.0;
        for (j = 0; j < f->n; j++)
            row[j] = side * f->C[at(f, i, j)];
        if (side != 0.0)
            put_row(f, dimension, side * f->d[i], row);
        for (way = -1.0; mode == PERP_LOAD_STICK && way < 2.0; way += 2.0) {
            for (j = 0; j < f->n; j++)
                row[j] = limit * side * f->C[at(f, i, j)] + way * f->A[at(f, i, j)];
            put_row(f, dimension, limit * side * f->d[i] + way * (f->b[i] - f->question.tau[i]),
                    row);
        }
        if (mode == PERP_LOAD_FORWARD || mode == PERP_LOAD_BACKWARD) {
            const double sign = mode == PERP_LOAD_FORWARD ? 1.0 : -1.0;

            memset(row, 0, (size_t)f->n * sizeof *row);
            row[i] = sign;
            put_row(f, dimension, -sign * f->question.stop[i], row);
        }
    }
}

/* Ray k of the cone, times `sign`, as a point or a direction of x. */
static void map_ray(const perp_load_friction *f, int32_t dimension, int32_t k, double sign,
                    double *to)
{
    const double *y = f->cone.x + (size_t)k * (size_t)(dimension + 1);
    const double s = y[0] > same ? y[0] : 0.0;
    int32_t i, c;

    for (i = 0; i < f->n; i++) {
        double sum = s * f->x[i];

        for (c = 0; c < dimension; c++)
            sum += y[c + 1] * f->null[(size_t)c * (size_t)f->n + (size_t)i];
        to[i] = s > 0.0 ? sum / s : sign * sum;
    }
}

static perp_status keep_polyhedron(perp_load_friction *f, int32_t dimension, uint32_t sides)
{
    const int32_t total = f->cone.rays + 2 * f->cone.lines;
    const size_t n = (size_t)f->n;
    perp__friction_answer *a;
    int32_t k, i, next = 0, vertices = 0;

    for (k = 0; k < f->cone.rays; k++)
        vertices += f->cone.x[(size_t)k * (size_t)(dimension + 1)] > same;
    if (vertices == 0)
        return PERP_OK;
    a = perp__friction_answer_create(f, total);
    if (!a)
        return perp__fail_memory(f->context, "a family of accelerations");
    for (k = 0; k < f->cone.rays; k++)
        if (f->cone.x[(size_t)k * (size_t)(dimension + 1)] > same)
            map_ray(f, dimension, k, 1.0, a->points + (size_t)next++ * n);
    for (k = 0; k < f->cone.rays + f->cone.lines; k++) {
        if (k < f->cone.rays && f->cone.x[(size_t)k * (size_t)(dimension + 1)] > same)
            continue;
        map_ray(f, dimension, k, 1.0, a->points + (size_t)next++ * n);
        if (k >= f->cone.rays)
            map_ray(f, dimension, k, -1.0, a->points + (size_t)next++ * n);
    }
    a->vertices = vertices;
    a->rays = total - vertices;
    for (i = 0; i < f->n; i++) {
        for (k = 0; k < vertices; k++)
            a->x[i] = (k == 0 ? 0.0 : a->x[i]) + a->points[(size_t)k * n + (size_t)i] / vertices;
        for (; k < total; k++)
            a->x[i] += a->points[(size_t)k * n + (size_t)i];
        a->width[i] = same * fabs(a->x[i]);
    }
    a->dimension = total == 1 ? 0 : dimension;
    a->at_vertex = 1;
    memcpy(f->x_low, f->x, n * sizeof *f->x); /* the other sides start from it, too */
    memcpy(f->x, a->x, n * sizeof *f->x);
    perp__friction_evaluate(f);
    describe(f, a);
    memcpy(f->x, f->x_low, n * sizeof *f->x);
    for (i = k = 0; i < f->n; i++) /* what sticks belongs to the family on this side alone */
        if (f->pattern.mode[i] == PERP_LOAD_STICK && f->question.mu_stick[i] > 0.0)
            a->pattern.side[i] = (sides >> k++) & 1u ? -1 : 1;
    keep_true(f, a, contains(f, a, a)); /* each row beside its own terms */
    return PERP_OK;
}

perp_status perp__friction_keep_family(perp_load_friction *f, int32_t dimension)
{
    uint32_t sides, most = 1;
    perp_status status = PERP_OK;
    int32_t i;

    for (i = 0; i < f->n; i++)
        if (f->pattern.mode[i] == PERP_LOAD_STICK && f->question.mu_stick[i] > 0.0) {
            f->unsettled |= most == 4096;
            most = most < 4096 ? 2 * most : most;
        }
    for (sides = 0; sides < most && status == PERP_OK; sides++) {
        status = perp__cone_fit(&f->cone, 4 * f->n + 1, dimension + 1);
        f->cone.dimension = dimension + 1;
        if (status != PERP_OK)
            return status;
        put_rows(f, dimension, sides);
        status = perp__cone_enumerate(&f->cone);
        if (status == PERP__CONE_TOO_LARGE) {
            f->unsettled = 1;
            return PERP_OK;
        }
        if (status == PERP_OK)
            status = keep_polyhedron(f, dimension, sides);
    }
    return status;
}
