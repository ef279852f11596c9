/* Answers of a few patterns, which other methods name.
 *
 * Accelerations of contacts that do not slide are velocities of a contact problem: M v' = k + J'f,
 * u' = J v' + bias, 0 <= f_n perp u_n' >= 0 and friction opposite to u_t'. Its solver gives one.
 *
 * Some of the accelerations where there are too many patterns: with friction along k directions d
 * the answers are the solutions of an LCP (Stewart & Trinkle's, in accelerations):
 *
 *   0 <= f_n   perp  u_n' >= 0,                         of a contact that slides f_t = -mu f_n s,
 *   0 <= beta  perp  d.u_t' + lambda >= 0,              f_t = sum d beta,
 *   0 <= lambda  perp  mu f_n - sum beta >= 0,          of dry friction bound - sum beta,
 *   u' = 0 with free forces of the bilateral rows.
 *
 * Lemke's method solves it again and again with rows and columns in other units: that is another
 * covering vector. Each solution names a pattern, which is then solved as all others are. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations/accelerations.h"

/* Of the LCP's answers, relative to their terms. */
#define WIDE 1e-9

/* ---- of the contact problem ------------------------------------------------------------------ */

static void fill_seed(perp__acceleration *a, perp__velocity_problem *problem)
{
    const perp_mechanism *m = a->m;

    memcpy(a->seed.momentum, m->begin.k, (size_t)m->n * sizeof *a->seed.momentum);
    memset(a->seed.included, 0, (size_t)m->contacts);
    memset(a->seed.friction, 0, (size_t)m->contacts * sizeof *a->seed.friction);
    memset(a->seed.dry, 0, (size_t)m->dry * sizeof *a->seed.dry);
    for (int32_t i = 0; i < a->elements; i++) {
        const perp__element *element = a->element + i;

        if (!element->dry) {
            a->seed.included[element->source] = 1;
            a->seed.friction[element->source] = element->friction ? element->mu : 0.0;
        } else if (!element->moves) {
            a->seed.dry[element->source - m->contacts] = element->bound;
        } else {
            for (int32_t j = 0; j < element->tangents; j++)
                perp__add_row(m, &m->begin, a->row_of[element->row + j],
                              -element->bound * element->direction[j], a->seed.momentum);
        }
    }
    problem->momentum = a->seed.momentum;
    problem->shift = a->zeros;
    problem->friction = a->seed.friction;
    problem->included = a->seed.included;
    problem->dry = a->seed.dry;
}

/* The direction of an element's slip: its own where it slides already, else that of sign x. */
static void direct(perp__acceleration *a, int32_t index, double sign, const double *x)
{
    const perp__element *element = a->element + index;
    double *direction = a->pattern.direction + 2 * (size_t)index, length = 0.0;

    direction[0] = direction[1] = 0.0;
    if (a->pattern.mode[index] != PERP_MECHANISM_SLIP || !element->friction)
        return;
    for (int32_t i = 0; i < element->tangents; i++)
        length = hypot(length, x[i]);
    for (int32_t i = 0; i < element->tangents; i++)
        direction[i] = element->moves ? element->direction[i]
                       : length > 0.0 ? sign * x[i] / length
                                      : i == 0; /* without a size it doesn't matter */
}

perp_status perp__acceleration_seed(perp__acceleration *a)
{
    perp_mechanism *m = a->m;
    perp__terms terms = m->begin;
    perp__velocity_problem problem = {.terms = &terms};
    const perp__motion *answer = &m->second;
    int32_t planes = 0, slides = 0;
    perp_status status;

    /* 1. with a slip that starts in a plane, and nothing that slides with friction */
    for (int32_t i = 0; i < a->elements; i++) {
        slides |= a->element[i].moves && a->element[i].friction && !a->element[i].dry;
        planes += a->element[i].tangents == 2 && a->element[i].friction && !a->element[i].moves;
    }
    if (slides || planes == 0)
        return PERP_OK;
    /* 2. the contact problem */
    terms.drift = a->bias;
    fill_seed(a, &problem);
    m->second.iterations = 0;
    status = perp__solve_velocities(m, &m->second, &problem);
    m->answer.iterations += answer->iterations; /* of the step that asks, if one does */
    if (status != PERP_OK || !perp__is_good(answer->outcome))
        return status;
    /* 3. its pattern */
    for (int32_t i = 0; i < a->elements; i++) {
        const perp__element *element = a->element + i;
        const int32_t mode = answer->modes[element->source];

        a->pattern.mode[i] =
            (int8_t)(mode != PERP_MECHANISM_SEPARATE && !element->friction ? PERP_MECHANISM_SLIP
                                                                           : mode);
        direct(a, i, 1.0, answer->u + a->row_of[element->row] + !element->dry);
    }
    return perp__slip_count(a) > 0 ? perp__acceleration_try(a, PERP__ROUGH_DIRECTIONS) : PERP_OK;
}

/* ---- by Lemke's method ----------------------------------------------------------------------- */

typedef struct search {
    int32_t size;    /* unknowns of the LCP */
    int32_t *first;  /* elements: first unknown */
    double *columns; /* size by active: forces of an unknown, row by row */
    double *tests;   /* size by active: what its row asks of u' */
    double *M, *q, *lower, *z, *scale, *force, *known;
} search;

/* Unknowns of a slip that may start. */
static int32_t directions_of(const perp__acceleration *a, const perp__element *element)
{
    return element->friction && !element->moves ? perp__element_directions(a, element) : 0;
}

/* Forces of the unknowns and tests of their rows; M := tests W columns' and the couplings. */
static void fill(perp__acceleration *a, search *s)
{
    const size_t active = (size_t)a->active, size = (size_t)s->size;
    double *u = a->work;

    for (size_t i = 0; i < (size_t)a->m->bilateral; i++) {
        const size_t row = (size_t)a->bilateral_row + i;

        s->columns[i * active + row] = s->tests[i * active + row] = 1.0;
        s->lower[i] = -INFINITY;
    }
    for (int32_t index = 0; index < a->elements; index++) {
        const perp__element *element = a->element + index;
        const int32_t count = directions_of(a, element), tangents = element->tangents;
        const size_t normal = (size_t)s->first[index], t = (size_t)element->tangent;
        const size_t last = normal + !element->dry + (size_t)count; /* lambda */
        double *column = s->columns + normal * active;

        if (!element->dry)
            column[element->row] = s->tests[normal * active + (size_t)element->row] = 1.0;
        for (int32_t i = 0; i < tangents && element->moves && !element->dry; i++)
            column[t + (size_t)i] = -element->mu * element->direction[i];
        for (int32_t i = 0; i < tangents && element->moves && element->dry; i++)
            s->known[t + (size_t)i] = -element->bound * element->direction[i];
        for (int32_t k = 0; k < count; k++) {
            const size_t next = last - (size_t)(count - k);
            double d[2];

            perp__element_direction(a, element, k, d);
            for (size_t i = 0; i < (size_t)tangents; i++)
                s->columns[next * active + t + i] = s->tests[next * active + t + i] = d[i];
            s->M[next * size + last] = 1.0;
            s->M[last * size + next] = -1.0;
        }
        if (count > 0 && element->dry)
            s->q[last] = element->bound;
        else if (count > 0)
            s->M[last * size + normal] = element->mu;
    }
    for (size_t j = 0; j < size; j++) {
        perp__linear_rows(&a->linear, u, NULL, s->columns + j * active, 1);
        for (size_t i = 0; i < size; i++)
            for (size_t k = 0; k < active; k++)
                s->M[i * size + j] += s->tests[i * active + k] * u[k];
    }
    perp__linear_rows(&a->linear, u, NULL, s->known, 0);
    for (size_t i = 0; i < size; i++)
        for (size_t k = 0; k < active; k++)
            s->q[i] += s->tests[i * active + k] * u[k];
}

/* Rows and columns in new units; the second call takes the first one's back. */
static void rescale(search *s, const double *scale, int32_t back)
{
    const size_t size = (size_t)s->size;

    for (size_t i = 0; i < size; i++) {
        const double row = back ? 1.0 / scale[i] : scale[i];

        s->q[i] *= row;
        for (size_t j = 0; j < size; j++)
            s->M[i * size + j] *= row * (back ? 1.0 / scale[j] : scale[j]);
    }
}

/* The pattern that the solution names, and its forces in s->force. Contacts that neither press nor
 * separate belong to those that press, and slips without an acceleration to what sticks: so that
 * one pattern has the whole family. */
static void take_pattern(perp__acceleration *a, search *s)
{
    const size_t active = (size_t)a->active;
    double *u = a->linear.u, *size = a->linear.u_width, largest = 0.0;

    memcpy(s->force, s->known, active * sizeof *s->force);
    for (size_t c = 0; c < (size_t)s->size; c++)
        for (size_t k = 0; k < active; k++)
            s->force[k] += s->columns[c * active + k] * s->z[c];
    for (size_t k = 0; k < active; k++)
        largest = fmax(largest, fabs(s->force[k]) / a->scale[k]);
    perp__linear_rows(&a->linear, u, size, s->force, 0);
    for (int32_t index = 0; index < a->elements; index++) {
        const perp__element *element = a->element + index;
        const int32_t count = directions_of(a, element), first = s->first[index] + !element->dry;
        const int32_t row = element->row, t = element->tangent;
        const double *f = s->force + row;
        const int32_t presses = element->dry || f[0] > 1e-9 * largest * a->scale[row];
        const int32_t starts = count == 0 || s->z[first + count] > 0.0; /* lambda, its speed */
        int8_t *mode = a->pattern.mode + index;

        *mode = !presses ? PERP_MECHANISM_SEPARATE
                : starts ? PERP_MECHANISM_SLIP
                         : PERP_MECHANISM_STICK;
        direct(a, index, -1.0, f + !element->dry);
        if (!presses && fabs(u[row]) <= WIDE * size[row]) {
            *mode = PERP_MECHANISM_SLIP;
            direct(a, index, 1.0, u + t);
        }
        if (perp__element_starts(element, *mode) &&
            perp__length(u + t, element->tangents) <=
                WIDE * perp__length(size + t, element->tangents)) {
            *mode = PERP_MECHANISM_STICK;
            direct(a, index, 0.0, u + t);
        }
    }
}

/* The pattern's own point or family; of one that is too large, the solution that was found. */
static perp_status try_pattern(perp__acceleration *a, search *s)
{
    const int32_t dimension = perp__pattern_solve(a);
    perp__linear *p = &a->linear;
    const perp__linear_point point = {p->x, p->u, p->x_width, p->u_width, 0, 1, 0};
    const size_t active = (size_t)a->active;
    int32_t at_vertex;

    if (dimension <= 0 || perp__slip_count(a) > 0)
        return perp__acceleration_try(a, PERP__ROUGH_DIRECTIONS);
    memset(p->y, 0, (size_t)p->system.n * sizeof *p->y);
    memcpy(p->known, s->force, active * sizeof *p->known);
    memcpy(p->x, s->force, active * sizeof *p->x);
    perp__linear_evaluate(p);
    perp__linear_correct(p);
    perp__linear_evaluate(p);
    for (size_t i = 0; i < active; i++) {
        p->u_width[i] = PERP__FAMILY_TOLERANCE * p->u_size[i];
        p->x_width[i] = p->u_width[i] * a->scale[i] * a->scale[i];
    }
    if (!perp__linear_holds(p, &a->pattern, &point, &at_vertex))
        return PERP_OK;
    return perp__acceleration_keep_point(a, 0, dimension);
}

/* Each solution names a pattern. */
static perp_status run(perp__acceleration *a, search *s, perp_lcp_solver *solver,
                       perp_mechanism_summary *summary)
{
    const perp_matrix view = perp__view(PERP_STORAGE_ROW_MAJOR, s->size, s->size, s->M);
    perp_lcp_settings settings;
    uint64_t seed = 1;
    perp_status status = perp_lcp_settings_init(&settings, sizeof settings);

    settings.method = PERP_LCP_LEMKE;
    for (int32_t start = 0;
         start < a->m->settings.starts && status == PERP_OK && !perp__mechanism_is_late(a->m);
         start++) {
        perp_lcp_result result;

        for (int32_t i = 0; i < s->size; i++) { /* the first time all 1 */
            const uint64_t number = perp__next_random(&seed) >> 33;

            s->scale[i] = start == 0 ? 1.0 : exp(1e-9 * (double)number);
        }
        perp_lcp_result_init(&result, sizeof result);
        rescale(s, s->scale, 0);
        settings.time_limit = perp__mechanism_time_left(a->m);
        PERP__ASK(status, a->m->context, perp_lcp_solver_set(solver, &settings));
        PERP__ASK(status, a->m->context, perp_lcp_solver_setup(solver, &view, s->lower, NULL));
        PERP__ASK(status, a->m->context,
                  perp_lcp_solver_solve(solver, s->z, NULL, NULL, &result, s->q, NULL));
        rescale(s, s->scale, 1);
        for (int32_t i = 0; i < s->size && status == PERP_OK; i++)
            s->z[i] *= s->scale[i];
        summary->patterns++;
        if (status == PERP_OK && perp__is_good(result.outcome)) {
            take_pattern(a, s);
            status = try_pattern(a, s);
        }
    }
    return status;
}

perp_status perp__acceleration_search(perp__acceleration *a, perp_mechanism_summary *summary)
{
    perp_context *context = a->m->context;
    const size_t active = (size_t)a->active;
    perp_lcp_solver *solver = NULL;
    search s = {.size = a->m->bilateral, .first = a->tree.next};
    size_t size, doubles;
    perp_status status;

    for (int32_t i = 0; i < a->elements; i++) {
        const int32_t count = directions_of(a, a->element + i);

        s.first[i] = s.size;
        s.size += !a->element[i].dry + count + (count > 0);
    }
    size = (size_t)s.size;
    if (s.size == 0)
        return PERP_OK;
    doubles = 2 * size * active + size * size + 4 * size + 2 * active;
    s.columns =
        perp__allocate_zeros(context, doubles, sizeof *s.columns, "the LCP of accelerations");
    status = s.columns ? PERP_OK : PERP_ERROR_MEMORY;
    PERP__ASK(status, context, perp_lcp_solver_create(context, &solver, NULL));
    if (status == PERP_OK) {
        s.tests = s.columns + size * active;
        s.M = s.tests + size * active;
        s.q = s.M + size * size;
        s.lower = s.q + size;
        s.z = s.lower + size;
        s.scale = s.z + size;
        s.force = s.scale + size;
        s.known = s.force + active;
        fill(a, &s);
        status = run(a, &s, solver, summary);
        PERP__TELL(context, perp_lcp_solver_destroy(solver));
    }
    perp__release(context, s.columns);
    return status;
}
