/* Variables that share nothing with others, where the methods have failed at the whole: a path ends
 * where that of one part does, and index sets are searched where variables are few. So parts of few
 * variables are solved one by one. What proves that one has no solution proves it of the whole. */
#include <string.h>

#include "base/clock.h"
#include "base/groups.h"
#include "lcp/solver.h"

#define LARGEST PERP__SMALL_SPARSE /* variables of a part */

typedef struct part {
    int32_t count, index[LARGEST + 1];
    double M[LARGEST * LARGEST], q[LARGEST], lower[LARGEST], upper[LARGEST], z[LARGEST],
        ray[LARGEST];
} part;

/* head[k] := the first variable of part k, next[i] := the one after i; or -1. Returns how many
 * parts there are. of: n; head: 2 n. */
static int32_t find_apart(const perp_lcp_solver *solver, int32_t *of, int32_t *head, int32_t *next)
{
    const int32_t n = solver->n;
    int32_t count;

    for (int32_t i = 0; i < n; i++)
        of[i] = i;
    for (int32_t i = 2 * n - 1; i >= 0; i--) /* a part of rows and columns has a last one */
        head[solver->part[i]] = i % n;
    for (int32_t i = 0; i < 2 * n; i++)
        perp__join(of, i % n, head[solver->part[i]]);
    count = perp__number_parts(of, n);
    memset(head, -1, 2 * (size_t)n * sizeof *head);
    for (int32_t i = n - 1; i >= 0; i--) {
        next[i] = head[of[i]];
        head[of[i]] = i;
    }
    return count;
}

/* Solves the part; its answer goes into solver->z, a proof becomes that of the whole. */
static perp_status solve(perp_lcp_solver *solver, perp_lcp_solver *inner, part *p)
{
    const perp_matrix view = perp__view(PERP_STORAGE_COLUMN_MAJOR, p->count, p->count, p->M);
    perp_lcp_result result;
    perp_status status;

    for (int32_t c = 0; c < p->count; c++) {
        for (int32_t r = 0; r < p->count; r++)
            p->M[r + c * p->count] = perp__entry(&solver->M, p->index[r], p->index[c]);
        p->q[c] = solver->q[p->index[c]];
        p->lower[c] = solver->lower[p->index[c]];
        p->upper[c] = solver->upper[p->index[c]];
    }
    perp_struct_init(&result, sizeof result);
    if (solver->deadline > 0.0)
        inner->settings.time_limit = perp__time_left(solver->deadline);
    if (solver->settings.max_iterations > 0)
        inner->settings.max_iterations = (int32_t)(solver->settings.max_iterations - solver->spent);
    status = perp__lcp_setup(inner, &view, p->lower, p->upper);
    PERP__THEN(status, perp__lcp_solve(inner, p->z, NULL, p->ray, &result, p->q, NULL));
    if (status != PERP_OK)
        return status;
    solver->spent += result.iterations;
    if (result.outcome == PERP_OUTCOME_STOPPED || result.outcome == PERP_OUTCOME_TIME_LIMIT)
        solver->ended = result.outcome;
    for (int32_t c = 0; c < p->count && perp__is_good(result.outcome); c++)
        solver->z[p->index[c]] = p->z[c];
    if (result.certificate != PERP_CERTIFICATE_NONE) {
        solver->best.outcome = PERP_OUTCOME_RAY;
        solver->best_certificate = result.certificate;
        memset(solver->best_ray, 0, (size_t)solver->n * sizeof *solver->best_ray);
        for (int32_t c = 0; c < p->count; c++)
            solver->best_ray[p->index[c]] = p->ray[c];
    }
    return PERP_OK;
}

perp_status perp__solve_apart(perp_lcp_solver *solver)
{
    const perp_lcp_settings *settings = &solver->settings;
    const int32_t n = solver->n;
    int32_t *head = solver->apart, *next = head + 3 * n;
    const int32_t count = find_apart(solver, head + 2 * n, head, next);
    perp_status status = PERP_OK;
    part p;

    if (count < 2)
        return PERP_OK;
    if (!solver->inner)
        status = perp__lcp_create(solver->context, &solver->inner, settings);
    if (status != PERP_OK)
        return status;
    solver->inner->settings = *settings;
    solver->inner->as_given = 1;
    solver->inner->insists = solver->insists;
    memcpy(solver->z, solver->best.z, (size_t)n * sizeof *solver->z);
    for (int32_t k = 0; k < count && solver->ended < 0 && status == PERP_OK &&
                        solver->best_certificate == PERP_CERTIFICATE_NONE;
         k++) {
        p.count = 0;
        for (int32_t i = head[k]; i >= 0 && p.count <= LARGEST; i = next[i])
            p.index[p.count++] = i; /* one more than fit tells that it is large */
        if (settings->max_iterations > 0 && solver->spent >= settings->max_iterations)
            solver->ended = PERP_OUTCOME_ITERATION_LIMIT;
        else if (p.count <= LARGEST)
            status = solve(solver, solver->inner, &p);
    }
    if (status == PERP_OK && solver->best_certificate == PERP_CERTIFICATE_NONE)
        perp__consider_point(solver, solver->best.method, PERP_OUTCOME_STALLED);
    return status;
}
