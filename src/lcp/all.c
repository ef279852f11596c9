/* perp_lcp_all: every solution of a small problem, by enumeration of the index sets. Isolated
 * solutions with an index set of their own are reported as they are found; degenerate ones and
 * families, which several index sets show, at the end. */
#include "lcp/all.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"
#include "lcp/settings.h"
#include "linalg/lines.h"

#define PERP__ENUMERATION_FIRST PERP__SIZE_THROUGH(perp_lcp_enumeration, seconds)

perp_status perp_lcp_enumeration_init(perp_lcp_enumeration *result, size_t size)
{
    return perp__struct_init(result, size, PERP__ENUMERATION_FIRST);
}

/* ---- reports ------------------------------------------------------------------------------- */

/* A point inside: the mean of the vertices, plus the rays. */
static void find_middle(perp__all *all, const perp__face *face)
{
    int32_t i, k;

    for (i = 0; i < all->n; i++) {
        double sum = 0.0;

        for (k = 0; k < face->vertices; k++)
            sum += face->points[(size_t)k * (size_t)all->n + (size_t)i];
        all->z[i] = sum / face->vertices;
        for (; k < face->vertices + face->rays; k++)
            all->z[i] += face->points[(size_t)k * (size_t)all->n + (size_t)i];
    }
}

/* Vertices in the caller's units, rays with largest entry 1 there. */
static void to_caller(const perp__all *all, const perp__face *face, double *points)
{
    int32_t i, k;

    for (k = 0; k < face->vertices + face->rays; k++) {
        double *x = points + (size_t)k * (size_t)all->n, largest = 0.0;

        for (i = 0; i < all->n; i++) {
            const double scaled = face->points[(size_t)k * (size_t)all->n + (size_t)i];

            x[i] = k < face->vertices ? perp__z_exact(all->solver, i, scaled)
                                      : perp__z_caller(all->solver, i, scaled);
            if (k < face->vertices)
                x[i] = perp__clamp(x[i], all->solver->lower[i], all->solver->upper[i]);
            largest = fmax(largest, fabs(x[i]));
        }
        for (i = 0; k >= face->vertices && i < all->n; i++)
            x[i] /= largest;
    }
}

static perp_status visit(perp__all *all, const perp__face *face, const double *points)
{
    perp_lcp_found found;
    const size_t entries = (size_t)(face->vertices + face->rays) * (size_t)all->n;
    perp__evaluation worth;
    double largest = 0.0;
    int32_t answer, i;

    if (all->silent)
        return PERP_OK;
    memcpy(all->places, face->places, (size_t)all->n);
    find_middle(all, face);
    for (i = 0; i < all->n; i++)
        largest = fmax(largest, fabs(all->z[i]));
    worth = perp__all_evaluate(all, all->z);
    if (face->dimension > 0 && !perp__all_is_solution(all, &worth, 0.0)) {
        /* the mean of vertices far apart loses what one vertex holds */
        memcpy(all->z, face->points, (size_t)all->n * sizeof *all->z);
        worth = perp__all_evaluate(all, all->z);
    }
    if (!perp__all_is_solution(all, &worth, largest) || !perp__all_finite(points, entries)) {
        all->incomplete = 1;
        return PERP_OK;
    }
    for (i = 0; i < all->n; i++)
        all->codes[i] = face->places[i];
    memset(&found, 0, sizeof found);
    found.struct_size = sizeof found;
    found.dimension = face->dimension;
    found.vertex_count = face->vertices;
    found.ray_count = face->rays;
    found.residual = fmax(worth.tested, face->residual);
    found.z = all->solver->z;
    found.w = all->solver->w_high;
    found.places = all->codes;
    found.vertices = points;
    found.rays = points + (size_t)face->vertices * (size_t)all->n;
    if (face->dimension > 0)
        all->result.families++;
    else
        all->result.isolated++;
    answer = all->visit ? all->visit(&found, all->user) : 0;
    if (answer != 0) {
        all->silent = all->ended = 1;
        all->aborted = answer < 0;
        all->result.outcome = PERP_OUTCOME_STOPPED;
    }
    return PERP_OK;
}

perp_status perp__all_report(perp__all *all, const perp__face *face)
{
    const size_t count = (size_t)face->vertices + (size_t)face->rays;
    double *points = perp__allocate(all->context, count * (size_t)all->n, sizeof *points);
    perp_status status;

    if (!points)
        return perp__fail_memory(all->context, "a solution");
    to_caller(all, face, points);
    status = visit(all, face, points);
    perp__release(all->context, points);
    return status;
}

perp_status perp__all_report_faces(perp__all *all)
{
    const perp__face *face;
    perp_status status = PERP_OK;

    for (face = all->faces; face && status == PERP_OK; face = face->next)
        status = perp__all_report(all, face);
    return status;
}

/* ---- the call ------------------------------------------------------------------------------ */

static void layout(perp__arena *arena, void *object)
{
    perp__all *all = object;
    const size_t n = (size_t)all->n;
    size_t d;

    all->levels = perp__arena_take(arena, n + 1, sizeof *all->levels);
    for (d = 0; d <= n; d++) {
        perp__tree_level level;

        level.T = perp__arena_take(arena, n * (n + 1), sizeof(double));
        level.kind = perp__arena_take(arena, n, sizeof(int8_t));
        level.basic = perp__arena_take(arena, n, sizeof(int8_t));
        level.columns = perp__arena_take(arena, n, sizeof(int8_t));
        level.pending = 0;
        if (all->levels)
            all->levels[d] = level;
    }
    all->S = perp__arena_take(arena, n * n, sizeof(double));
    all->row_sizes = perp__arena_take(arena, n, sizeof(double));
    all->places = perp__arena_take(arena, n, sizeof(int8_t));
    all->z = perp__arena_take(arena, n, sizeof(double));
    all->origin = perp__arena_take(arena, n, sizeof(double));
    all->directions = perp__arena_take(arena, n * n, sizeof(double));
    all->work = perp__arena_take(arena, (n + 1) * (n + 1), sizeof(double));
    all->codes = perp__arena_take(arena, n, sizeof(int32_t));
}

static perp_status check(perp_context *context, const perp_lcp_solver *solver,
                         const perp_lcp_enumeration *result, const double *q)
{
    perp_status status =
        perp__struct_check(context, "result", result, sizeof *result, PERP__ENUMERATION_FIRST);

    if (status == PERP_OK && solver->n > PERP__LARGEST_ALL)
        status = perp__fail(context, PERP_ERROR_ARGUMENT,
                            "M has %d rows: all solutions are searched for up to %d",
                            (int)solver->n, PERP__LARGEST_ALL);
    if (status == PERP_OK && solver->n > 0)
        status = perp__check_pointer(context, "q", q);
    if (status == PERP_OK)
        status = perp__check_finite(context, "q", q, (size_t)solver->n);
    return status;
}

static void limit(perp__all *all, double started)
{
    perp_lcp_solver *solver = all->solver;

    memset(&solver->control, 0, sizeof solver->control);
    solver->control.monitor = solver->settings.monitor;
    solver->control.monitor_user = solver->settings.monitor_user;
    if (solver->settings.time_limit > 0.0)
        solver->control.deadline = started + solver->settings.time_limit;
    all->limit = solver->settings.max_iterations;
}

perp_status perp__all_prepare(perp__all *all)
{
    perp_lcp_solver *solver = all->solver;
    perp__lcp_problem problem;
    perp_status status;

    all->n = solver->n;
    status = perp__polish_fit(solver);
    if (status == PERP_OK)
        status = perp__arena_fit(&all->arena, layout, all);
    if (status == PERP_OK)
        status = perp__cone_fit(&all->cone, 2 * all->n + 1, all->n + 1);
    if (status != PERP_OK)
        return status;
    memset(&problem, 0, sizeof problem);
    problem.n = all->n;
    problem.M = &solver->M;
    problem.factors = solver->factors;
    perp__lcp_dense(&problem, all->S, (size_t)all->n);
    return PERP_OK;
}

/* False where entries of the equilibrated matrix are beyond the range of doubles; those that have
 * become 0 there hide index sets. */
static int32_t is_finite(perp__all *all)
{
    const perp__matrix *M = &all->solver->M;
    int32_t line, k;

    for (line = 0; line < all->n; line++) {
        const perp__line l = perp__line_of(M, line);

        for (k = 0; k < l.count; k++) {
            const int32_t at = l.indices ? l.indices[k] : k;
            const double entry =
                perp__lines_are_rows(M) ? all->S[line + all->n * at] : all->S[at + all->n * line];

            if (!isfinite(entry))
                return 0;
            all->incomplete |= entry == 0.0 && l.values[k] != 0.0;
        }
    }
    return 1;
}

static perp_status run(perp__all *all, const double *q)
{
    const double started = perp__now();
    perp_status status;

    limit(all, started);
    perp__scale_problem(all->solver, q);
    status = perp__all_prepare(all);
    all->result.outcome = PERP_OUTCOME_SOLVED;
    if (status == PERP_OK && !is_finite(all))
        all->result.outcome = PERP_OUTCOME_EVALUATION_FAILED;
    else if (status == PERP_OK)
        status = perp__all_search(all);
    if (status == PERP_OK && !all->aborted)
        status = perp__all_report_faces(all);
    if (status == PERP_OK && all->aborted)
        status = perp__fail(all->context, PERP_ERROR_CALLBACK, "the callback asked to abort");
    if (all->incomplete && all->result.outcome == PERP_OUTCOME_SOLVED)
        all->result.outcome = PERP_OUTCOME_STALLED;
    all->result.seconds = perp__now() - started;
    return status;
}

static perp_status find_all(perp_context *context, perp_lcp_enumeration *result,
                            const perp_lcp_settings *settings, const perp_matrix *M,
                            const double *q, const double *lower, const double *upper,
                            perp_lcp_visit visitor, void *user)
{
    perp__all all;
    perp_status status;

    memset(&all, 0, sizeof all);
    all.context = context;
    all.cone.context = context;
    all.visit = visitor;
    all.user = user;
    perp__arena_init(&all.arena, context);
    status = perp__lcp_create(context, &all.solver, settings);
    if (status != PERP_OK)
        return status;
    status = perp__lcp_setup(all.solver, M, lower, upper);
    if (status == PERP_OK)
        status = check(context, all.solver, result, q);
    if (status == PERP_OK)
        status = run(&all, q);
    if (status == PERP_OK)
        perp__struct_write(result, &all.result, sizeof all.result);
    perp__all_release_faces(&all);
    perp__cone_release(&all.cone);
    perp__arena_release(&all.arena);
    perp__lcp_destroy(all.solver);
    return status;
}

perp_status perp_lcp_all(perp_context *context, perp_lcp_enumeration *result,
                         const perp_lcp_settings *settings, const perp_matrix *M, const double *q,
                         const double *lower, const double *upper, perp_lcp_visit visitor,
                         void *user)
{
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    return perp__leave(context,
                       find_all(context, result, settings, M, q, lower, upper, visitor, user));
}
