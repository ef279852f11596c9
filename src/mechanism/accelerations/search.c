/* Some of the accelerations where there are too many patterns. With friction along k directions d
 * the answers are the solutions of an LCP (Stewart & Trinkle's, in accelerations):
 *
 *   0 <= f_n   perp  u_n' >= 0,                         of a contact that slides f_t = -mu f_n way,
 *   0 <= beta  perp  d.u_t' + lambda >= 0,              f_t = sum d beta,
 *   0 <= lambda  perp  mu f_n - sum beta >= 0,          of dry friction bound - sum beta,
 *   u' = 0 with free forces of the bilateral rows.
 *
 * Lemke's method solves it again and again with rows and columns in other units: that is another
 * covering vector. Each solution names a pattern, which is then solved as all others are. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "lcp/lcp.h"
#include "mechanism/accelerations/accelerations.h"

#define ROUGH 1e-6
/* Of the LCP's answers, relative to their terms. */
#define WIDE 1e-9
#define PI 3.14159265358979323846

typedef struct search {
    int32_t size;    /* unknowns of the LCP */
    int32_t *first;  /* units: first unknown */
    double *columns; /* size by active: forces of an unknown, row by row */
    double *tests;   /* size by active: what its row asks of u' */
    double *M, *q, *lower, *z, *unit, *force;
    uint64_t seed;
} search;

static int32_t ways_of(const perp__acceleration *a, const perp__unit *unit)
{
    if (!unit->friction || unit->moves)
        return 0;
    return unit->tangents == 2 ? a->m->settings.directions : 2;
}

static void direction(const perp__acceleration *a, const perp__unit *unit, int32_t k, double d[2])
{
    const double angle = 2.0 * PI * k / a->m->settings.directions;

    d[0] = unit->tangents == 2 ? cos(angle) : k == 0 ? 1.0 : -1.0;
    d[1] = unit->tangents == 2 ? sin(angle) : 0.0;
}

static int32_t count_unknowns(const perp__acceleration *a, int32_t *first)
{
    int32_t size = a->m->bilateral, i;

    for (i = 0; i < a->units; i++) {
        const int32_t ways = ways_of(a, a->unit + i);

        if (first)
            first[i] = size;
        size += !a->unit[i].dry + ways + (ways > 0);
    }
    return size;
}

/* Forces of the unknowns and tests of their rows; M := tests W columns' and the couplings. */
static void fill_unit(perp__acceleration *a, search *s, int32_t index)
{
    const perp__unit *unit = a->unit + index;
    const size_t active = (size_t)a->active, size = (size_t)s->size;
    const int32_t ways = ways_of(a, unit), tangent = unit->row + !unit->dry;
    int32_t next = s->first[index], normal = next, last, i, k;

    if (!unit->dry) {
        double *column = s->columns + (size_t)next * active;

        column[unit->row] = s->tests[(size_t)next * active + (size_t)unit->row] = 1.0;
        for (i = 0; i < unit->tangents && unit->moves; i++)
            column[tangent + i] = -unit->mu * unit->way[i];
        next++;
    } else if (unit->moves) {
        for (i = 0; i < unit->tangents; i++)
            a->known[tangent + i] = -unit->bound * unit->way[i];
    }
    last = next + ways;
    for (k = 0; k < ways; k++, next++) {
        double d[2];

        direction(a, unit, k, d);
        for (i = 0; i < unit->tangents; i++) {
            s->columns[(size_t)next * active + (size_t)(tangent + i)] = d[i];
            s->tests[(size_t)next * active + (size_t)(tangent + i)] = d[i];
        }
        s->M[(size_t)next * size + (size_t)last] = 1.0;
        s->M[(size_t)last * size + (size_t)next] = -1.0;
    }
    if (ways > 0 && unit->dry)
        s->q[last] = unit->bound;
    else if (ways > 0)
        s->M[(size_t)last * size + (size_t)normal] = unit->mu;
}

static void fill(perp__acceleration *a, search *s)
{
    const size_t active = (size_t)a->active, size = (size_t)s->size;
    double *u = a->work;
    size_t i, j, k;
    int32_t index;

    memset(a->known, 0, active * sizeof *a->known);
    for (i = 0; i < (size_t)a->m->bilateral; i++) {
        const size_t row = (size_t)a->bilateral_row + i;

        s->columns[i * active + row] = s->tests[i * active + row] = 1.0;
        s->lower[i] = -INFINITY;
    }
    for (index = 0; index < a->units; index++)
        fill_unit(a, s, index);
    for (j = 0; j < size; j++) {
        perp__found_row_accelerations(a, u, NULL, s->columns + j * active, 1);
        for (i = 0; i < size; i++)
            for (k = 0; k < active; k++)
                s->M[i * size + j] += s->tests[i * active + k] * u[k];
    }
    perp__found_row_accelerations(a, u, NULL, a->known, 0);
    for (i = 0; i < size; i++)
        for (k = 0; k < active; k++)
            s->q[i] += s->tests[i * active + k] * u[k];
}

/* Rows and columns in new units; the second call takes the first one's back. */
static void rescale(search *s, const double *unit, int32_t back)
{
    const size_t size = (size_t)s->size;
    size_t i, j;

    for (i = 0; i < size; i++) {
        const double row = back ? 1.0 / unit[i] : unit[i];

        s->q[i] *= row;
        for (j = 0; j < size; j++)
            s->M[i * size + j] *= row * (back ? 1.0 / unit[j] : unit[j]);
    }
}

/* The pattern that the solution names, and its forces in s->force. */
static void take_pattern(perp__acceleration *a, search *s)
{
    const size_t active = (size_t)a->active;
    double largest = 0.0;
    int32_t index, i;
    size_t c, k;

    memcpy(s->force, a->known, active * sizeof *s->force);
    for (c = 0; c < (size_t)s->size; c++)
        for (k = 0; k < active; k++)
            s->force[k] += s->columns[c * active + k] * s->z[c];
    for (k = 0; k < active; k++)
        largest = fmax(largest, fabs(s->force[k]) / a->scale[k]);
    for (index = 0; index < a->units; index++) {
        const perp__unit *unit = a->unit + index;
        const int32_t ways = ways_of(a, unit), first = s->first[index] + !unit->dry;
        const double *f = s->force + unit->row;
        double *way = a->pattern.way + 2 * (size_t)index, length = 0.0;
        int8_t *mode = a->pattern.mode + index;

        way[0] = way[1] = 0.0;
        *mode = PERP_MECHANISM_SLIP;
        if (!unit->dry && !(f[0] > 1e-9 * largest * a->scale[unit->row])) {
            *mode = PERP_MECHANISM_SEPARATE;
            continue;
        }
        for (i = 0; i < unit->tangents && unit->moves && unit->friction; i++)
            way[i] = unit->way[i];
        if (ways == 0)
            continue;
        if (!(s->z[first + ways] > 0.0)) { /* lambda, the speed that it starts with */
            *mode = PERP_MECHANISM_STICK;
            continue;
        }
        for (i = 0; i < unit->tangents; i++)
            length = hypot(length, f[i + !unit->dry]);
        for (i = 0; i < unit->tangents && length > 0.0; i++)
            way[i] = -f[i + !unit->dry] / length;
        if (!(length > 0.0)) /* without a force along the tangents it doesn't matter */
            way[0] = 1.0;
    }
}

static double length_of(const double *x, int32_t count)
{
    return count == 0 ? 0.0 : count == 1 ? fabs(x[0]) : hypot(x[0], x[1]);
}

/* Contacts that neither press nor separate belong to those that press, and slips without an
 * acceleration to what sticks: so that one pattern has the whole family. */
static void widen_pattern(perp__acceleration *a, search *s)
{
    double *u = a->u, *size = a->u_width;
    int32_t index, i;

    perp__found_row_accelerations(a, u, size, s->force, 0);
    for (index = 0; index < a->units; index++) {
        const perp__unit *unit = a->unit + index;
        const int32_t t = unit->row + !unit->dry;
        const double speed = length_of(u + t, unit->tangents);
        double *way = a->pattern.way + 2 * (size_t)index;
        int8_t *mode = a->pattern.mode + index;

        if (*mode == PERP_MECHANISM_SEPARATE) {
            if (!(fabs(u[unit->row]) <= WIDE * size[unit->row]))
                continue;
            *mode = PERP_MECHANISM_SLIP;
            for (i = 0; i < unit->tangents && unit->friction; i++)
                way[i] = unit->moves ? unit->way[i] : speed > 0.0 ? u[t + i] / speed : i == 0;
        }
        if (perp__found_starts(unit, *mode) &&
            speed <= WIDE * length_of(size + t, unit->tangents)) {
            *mode = PERP_MECHANISM_STICK;
            way[0] = way[1] = 0.0;
        }
    }
}

/* The pattern's own point or family; of one that is too large, the solution that was found. */
static perp_status try_pattern(perp__acceleration *a, search *s)
{
    const int32_t dimension = perp__found_solve(a);
    const size_t active = (size_t)a->active;
    int32_t at_vertex;
    size_t i;

    if (dimension <= 0 || perp__found_turning(a) > 0)
        return perp__found_try(a, ROUGH);
    memcpy(a->f, s->force, active * sizeof *a->f);
    perp__found_correct(a);
    perp__found_row_accelerations(a, a->u, a->u_width, a->f, 0);
    for (i = 0; i < active; i++) {
        a->u_width[i] *= PERP__FAMILY_TOLERANCE;
        a->f_width[i] = a->u_width[i] * a->scale[i] * a->scale[i];
    }
    if (!perp__found_keeps(a, &a->pattern, a->f, a->u, a->f_width, a->u_width, 0, 0, &at_vertex))
        return PERP_OK;
    return perp__found_keep_point(a, 0, dimension);
}

static void search_settings(perp_lcp_settings *settings)
{
    perp_lcp_settings_init(settings, sizeof *settings);
    settings->method = PERP_LCP_LEMKE;
}

static perp_status run(perp__acceleration *a, search *s, perp_lcp_solver *solver,
                       perp_mechanism_summary *summary)
{
    perp_lcp_settings settings;
    perp_matrix view;
    perp_status status = PERP_OK;
    int32_t start, i;

    search_settings(&settings);
    perp_matrix_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, s->size, s->size, s->M, s->size);
    for (start = 0; start < a->m->settings.starts && status == PERP_OK; start++) {
        perp_lcp_result result;

        if (perp__mechanism_is_late(a->m))
            break;
        for (i = 0; i < s->size; i++) { /* Knuth's MMIX generator; the first time all 1 */
            s->seed = s->seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            s->unit[i] = start == 0 ? 1.0 : exp(1e-9 * (double)(s->seed >> 33));
        }
        perp_lcp_result_init(&result, sizeof result);
        rescale(s, s->unit, 0);
        settings.time_limit = perp__mechanism_time_left(a->m);
        status = perp__lcp_set(solver, &settings);
        if (status == PERP_OK)
            status = perp__lcp_setup(solver, &view, s->lower, NULL);
        if (status == PERP_OK)
            status = perp__lcp_solve(solver, s->z, NULL, NULL, &result, s->q, NULL);
        rescale(s, s->unit, 1);
        for (i = 0; i < s->size && status == PERP_OK; i++)
            s->z[i] *= s->unit[i];
        summary->patterns++;
        if (status == PERP_OK && perp__is_good(result.outcome)) {
            take_pattern(a, s);
            widen_pattern(a, s);
            status = try_pattern(a, s);
        }
    }
    return status;
}

perp_status perp__found_search(perp__acceleration *a, perp_mechanism_summary *summary)
{
    perp_context *context = a->m->context;
    const size_t active = (size_t)a->active;
    perp_lcp_settings settings;
    perp_lcp_solver *solver = NULL;
    search s = {0};
    size_t size, doubles;
    perp_status status;

    s.size = count_unknowns(a, NULL);
    size = (size_t)s.size;
    if (s.size == 0)
        return PERP_OK;
    doubles = 2 * size * active + size * size + 4 * size + active;
    s.columns = perp__allocate(context, doubles, sizeof *s.columns);
    s.first = perp__allocate(context, (size_t)a->units + 1, sizeof *s.first);
    search_settings(&settings);
    status = s.columns && s.first ? perp__lcp_create(context, &solver, &settings)
                                  : perp__fail_memory(context, "the LCP of accelerations");
    if (status == PERP_OK) {
        memset(s.columns, 0, doubles * sizeof *s.columns);
        s.tests = s.columns + size * active;
        s.M = s.tests + size * active;
        s.q = s.M + size * size;
        s.lower = s.q + size;
        s.z = s.lower + size;
        s.unit = s.z + size;
        s.force = s.unit + size;
        s.seed = 1;
        count_unknowns(a, s.first);
        fill(a, &s);
        status = run(a, &s, solver, summary);
        perp__lcp_destroy(solver);
    }
    perp__release(context, s.columns);
    perp__release(context, s.first);
    return status;
}
