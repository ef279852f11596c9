/* Answers: kept as they are found, each once, then sorted. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations/accelerations.h"

/* Directions of a slip that starts in 3 dimensions are found to this. */
#define SAME_FORCE 1e-10

/* ---- memory -------------------------------------------------------------------------------- */

static perp__found_answer *take_spare(perp__acceleration *a)
{
    perp__found_answer *answer = a->spare;

    a->spare = answer->next;
    return answer;
}

perp__found_answer *perp__found_create(perp__acceleration *a, int32_t points)
{
    const perp_mechanism *m = a->m;
    const size_t n = (size_t)m->n, rows = (size_t)m->rows, units = (size_t)(m->contacts + m->dry);
    const size_t doubles = n + 7 * rows + (size_t)points * rows + 2 * units;
    perp__found_answer *answer;
    double *block;

    if (points == 1 && a->spare)
        return take_spare(a);
    answer =
        perp__allocate(m->context, 1, sizeof *answer + doubles * sizeof *block + units * (4 + 1));
    if (!answer)
        return NULL;
    memset(answer, 0, sizeof *answer);
    block = (double *)(void *)(answer + 1);
    answer->room = points;
    answer->acceleration = block;
    answer->force = block + n;
    answer->row_acceleration = answer->force + rows;
    answer->eigenvalues = answer->row_acceleration + rows;
    answer->width = answer->eigenvalues + 4 * rows;
    answer->pattern.way = answer->width + rows;
    answer->points = answer->pattern.way + 2 * units;
    answer->modes = (int32_t *)(void *)(block + doubles);
    answer->pattern.mode = (int8_t *)(answer->modes + units);
    return answer;
}

void perp__found_release_answer(perp__acceleration *a, perp__found_answer *answer)
{
    if (answer->room == 1) { /* kept for the next one */
        answer->next = a->spare;
        a->spare = answer;
    } else {
        perp__release(a->m->context, answer);
    }
}

void perp__found_release_answers(perp__acceleration *a)
{
    while (a->answers) {
        perp__found_answer *next = a->answers->next;

        perp__found_release_answer(a, a->answers);
        a->answers = next;
    }
    a->answer_count = 0;
}

/* ---- what a pattern says ------------------------------------------------------------------- */

static int32_t is_met(double value, double width, int32_t *at_vertex)
{
    if (!(value >= -width))
        return 0;
    if (value <= width)
        *at_vertex = 1;
    return 1;
}

/* A slip that starts: along its way, and nowhere else. u: its tangents. */
static int32_t goes_its_way(const perp__unit *unit, const double *way, const double *u,
                            const double *width, int32_t strict)
{
    double along = way[0] * u[0], across = 0.0, along_width = fabs(way[0]) * width[0];

    if (unit->tangents == 2) {
        along += way[1] * u[1];
        along_width += fabs(way[1]) * width[1];
        across = way[0] * u[1] - way[1] * u[0];
        if (!(fabs(across) <= SAME_FORCE * fabs(along) + width[0] + width[1]))
            return 0;
    }
    return strict ? along > along_width : along >= -along_width;
}

/* The force along the tangents. size: what the friction of the unit is multiplied with. */
static int32_t drags(const perp__unit *unit, int32_t mode, const double *way, const double *f,
                     const double *width, double size, double size_width, int32_t *at_vertex)
{
    const double factor = unit->dry                      ? 1.0
                          : mode == PERP_MECHANISM_STICK ? unit->mu_stick
                                                         : unit->mu;
    double length = 0.0, length_width = 0.0;
    int32_t i;

    for (i = 0; i < unit->tangents; i++) {
        length = hypot(length, f[i]);
        length_width += width[i];
        if (mode == PERP_MECHANISM_SLIP &&
            !(fabs(f[i] + factor * size * way[i]) <= width[i] + factor * size_width))
            return 0;
    }
    if (mode == PERP_MECHANISM_SLIP)
        return 1;
    return is_met(factor * size - length, length_width + factor * size_width, at_vertex);
}

static int32_t unit_keeps(const perp__unit *unit, int32_t mode, const double *way, const double *f,
                          const double *u, const double *f_width, const double *u_width,
                          int32_t homogeneous, int32_t strict, int32_t *at_vertex)
{
    const int32_t r = unit->row, t = unit->dry ? r : r + 1;
    double size = homogeneous ? 0.0 : unit->bound, size_width = 0.0;
    int32_t i;

    if (!unit->dry) {
        size = f[r];
        size_width = f_width[r];
        if (mode == PERP_MECHANISM_SEPARATE) {
            for (i = 0; i <= unit->tangents; i++)
                if (!(fabs(f[r + i]) <= f_width[r + i]))
                    return 0;
            return is_met(u[r], u_width[r], at_vertex);
        }
        if (!(fabs(u[r]) <= u_width[r]) || !is_met(size, size_width, at_vertex))
            return 0;
    }
    for (i = 0; i < unit->tangents && mode == PERP_MECHANISM_STICK; i++)
        if (!(fabs(u[t + i]) <= u_width[t + i]))
            return 0;
    if (!drags(unit, mode, way, f + t, f_width + t, size, size_width, at_vertex))
        return 0;
    return !perp__found_starts(unit, mode) || goes_its_way(unit, way, u + t, u_width + t, strict);
}

int32_t perp__found_keeps(const perp__acceleration *a, const perp__found_pattern *pattern,
                          const double *f, const double *u, const double *f_width,
                          const double *u_width, int32_t homogeneous, int32_t strict,
                          int32_t *at_vertex)
{
    int32_t i;

    *at_vertex = 0;
    for (i = 0; i < a->m->bilateral; i++)
        if (!(fabs(u[a->bilateral_row + i]) <= u_width[a->bilateral_row + i]))
            return 0;
    for (i = 0; i < a->units; i++)
        if (!unit_keeps(a->unit + i, pattern->mode[i], pattern->way + 2 * (size_t)i, f, u, f_width,
                        u_width, homogeneous, strict, at_vertex))
            return 0;
    return 1;
}

/* ---- one answer in another ----------------------------------------------------------------- */

/* Whether point k of `inner` is one of `outer`'s. */
static int32_t has_point(perp__acceleration *a, const perp__found_answer *outer,
                         const perp__found_answer *inner, int32_t k)
{
    const size_t active = (size_t)a->active;
    const double *point = inner->points + (size_t)k * (size_t)a->m->rows;
    double *f = a->work, *u = f + active, *f_width = u + active, *u_width = f_width + active;
    const int32_t homogeneous = k >= inner->vertices;
    double largest = 0.0;
    int32_t at_vertex;
    size_t i;

    for (i = 0; i < active; i++) {
        f[i] = point[a->row_of[i]];
        largest = fmax(largest, fabs(f[i]) / a->scale[i]);
    }
    perp__found_row_accelerations(a, u, u_width, f, homogeneous);
    for (i = 0; i < active; i++) {
        u_width[i] *= PERP__FAMILY_TOLERANCE;
        f_width[i] = PERP__FAMILY_TOLERANCE * largest * a->scale[i];
    }
    return perp__found_keeps(a, &outer->pattern, f, u, f_width, u_width, homogeneous, 0,
                             &at_vertex);
}

static int32_t contains(perp__acceleration *a, const perp__found_answer *outer,
                        const perp__found_answer *inner)
{
    int32_t k;

    for (k = 0; k < inner->vertices + inner->rays; k++)
        if (!has_point(a, outer, inner, k))
            return 0;
    return 1;
}

static int32_t is_turned(const perp__acceleration *a, const perp__found_answer *answer)
{
    int32_t i;

    for (i = 0; i < a->units; i++)
        if (a->unit[i].tangents == 2 && perp__found_starts(a->unit + i, answer->pattern.mode[i]))
            return 1;
    return 0;
}

static int32_t is_same(const perp__acceleration *a, const perp__found_answer *one,
                       const perp__found_answer *other)
{
    const double same = is_turned(a, one) || is_turned(a, other) ? SAME_FORCE : 1e-14;
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < a->active; i++)
        largest = fmax(largest, fabs(one->points[a->row_of[i]]) / a->scale[i]);
    for (i = 0; i < a->active; i++) {
        const int32_t row = a->row_of[i];
        const double width = one->width[row] + other->width[row];

        if (!(fabs(one->points[row] - other->points[row]) <=
              4.0 * width + same * largest * a->scale[i]))
            return 0;
    }
    return 1;
}

/* Of two branches that meet, one is not stable: so is the point where they do. */
static void take_label(perp__found_answer *old, const perp__found_answer *new_one)
{
    if (!old->stable || new_one->stable)
        return;
    old->stable = 0;
    old->flutter = new_one->flutter;
    old->eigenvalue_count = new_one->eigenvalue_count;
    memcpy(old->eigenvalues, new_one->eigenvalues,
           2 * (size_t)old->eigenvalue_count * sizeof *old->eigenvalues);
}

/* Whether what would be handed out is an answer: numbers overflow, and a pattern's tests are those
 * of its equations. */
static int32_t is_sound(const perp__acceleration *a, const perp__found_answer *answer)
{
    const size_t rows = (size_t)a->m->rows;
    const perp__evidence evidence = {
        answer->residual, answer->residual, INFINITY,
        perp__all_finite(answer->acceleration, (size_t)a->m->n) &&
            perp__all_finite(answer->force, rows) &&
            perp__all_finite(answer->row_acceleration, rows) &&
            perp__all_finite(answer->points, (size_t)(answer->vertices + answer->rays) * rows)};

    return perp__is_good(perp__gate(&evidence, PERP__FAMILY_TOLERANCE, -1));
}

void perp__found_keep(perp__acceleration *a, perp__found_answer *answer)
{
    perp__found_answer **link = &a->answers;

    perp__found_describe(a, answer);
    if (!is_sound(a, answer)) {
        perp__found_release_answer(a, answer);
        a->incomplete = 1;
        return;
    }
    while (*link) {
        perp__found_answer *old = *link;

        if (old->dimension == 0 && answer->dimension == 0
                ? is_same(a, old, answer)
                : old->dimension > 0 && contains(a, old, answer)) {
            if (old->dimension == 0) {
                old->at_vertex = 1;
                take_label(old, answer);
            }
            perp__found_release_answer(a, answer);
            return;
        }
        if (answer->dimension > 0 && contains(a, answer, old)) {
            *link = old->next;
            perp__found_release_answer(a, old);
            a->answer_count--;
            continue;
        }
        link = &old->next;
    }
    answer->next = NULL;
    *link = answer;
    a->answer_count++;
}

perp_status perp__found_keep_point(perp__acceleration *a, int32_t at_vertex, int32_t dimension)
{
    const size_t units = (size_t)a->units, rows = (size_t)a->m->rows;
    perp__found_answer *answer = perp__found_create(a, 1);
    int32_t i;

    if (!answer)
        return perp__fail_memory(a->m->context, "an acceleration");
    answer->vertices = 1;
    answer->rays = answer->free = 0;
    answer->dimension = dimension;
    answer->at_vertex = at_vertex;
    memcpy(answer->pattern.mode, a->pattern.mode, units);
    memcpy(answer->pattern.way, a->pattern.way, 2 * units * sizeof *answer->pattern.way);
    memset(answer->force, 0, rows * sizeof *answer->force);
    memset(answer->width, 0, rows * sizeof *answer->width);
    for (i = 0; i < a->active; i++) {
        answer->force[a->row_of[i]] = a->f[i];
        answer->width[a->row_of[i]] = a->f_width[i];
    }
    memcpy(answer->points, answer->force, rows * sizeof *answer->points);
    perp__found_keep(a, answer);
    return PERP_OK;
}

/* ---- order --------------------------------------------------------------------------------- */

static int32_t comes_before(const perp__acceleration *a, const perp__found_answer *one,
                            const perp__found_answer *other)
{
    int32_t i;

    if (one->pressing != other->pressing)
        return one->pressing < other->pressing;
    for (i = 0; i < a->m->n; i++)
        if (one->acceleration[i] != other->acceleration[i])
            return one->acceleration[i] < other->acceleration[i];
    return 1;
}

static perp__found_answer *merge(const perp__acceleration *a, perp__found_answer *one,
                                 perp__found_answer *other)
{
    perp__found_answer *first = NULL, **link = &first;

    while (one && other) {
        perp__found_answer **from = comes_before(a, one, other) ? &one : &other;

        *link = *from;
        link = &(*from)->next;
        *from = *link;
    }
    *link = one ? one : other;
    return first;
}

static perp__found_answer *sort(const perp__acceleration *a, perp__found_answer *list,
                                int32_t count)
{
    perp__found_answer *last = list, *second;
    int32_t k;

    if (count < 2)
        return list;
    for (k = 1; k < count / 2; k++)
        last = last->next;
    second = last->next;
    last->next = NULL;
    return merge(a, sort(a, list, count / 2), sort(a, second, count - count / 2));
}

void perp__found_sort(perp__acceleration *a)
{
    a->answers = sort(a, a->answers, a->answer_count);
}
