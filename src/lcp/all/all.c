/* perp_lcp_all: every solution of a small problem, by enumeration of the index sets. Isolated
 * solutions with an index set of their own are reported as they are found; degenerate ones and
 * families, which several index sets show, at the end. */
#include "lcp/all/all.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"

/* Most variables: a bit of two words for each constraint of a family. */
#define PERP__LARGEST_ALL 60

/* ---- reports ------------------------------------------------------------------------------- */

/* Vertices in the caller's units, rays with largest entry 1 there. A vertex whose pattern has z_i
 * at a bound has that bound, for two bounds beyond the range of scaled doubles look alike. */
static void to_caller(const perp_lcp_solver *solver, perp__answer *answer)
{
    const double *lower = solver->lower, *upper = solver->upper;

    for (int32_t k = 0; k < answer->vertices + answer->rays; k++) {
        double *x = answer->points + (size_t)k * (size_t)solver->n, largest = 0.0;

        for (int32_t i = 0; i < solver->n; i++) {
            const int8_t place = answer->pattern[i];

            if (k >= answer->vertices)
                x[i] = perp__z_caller(solver, i, x[i]);
            else if (place == PERP__BETWEEN)
                x[i] = perp__clamp(perp__z_exact(solver, i, x[i]), lower[i], upper[i]);
            else
                x[i] = place == PERP__AT_UPPER ? upper[i] : lower[i];
            largest = fmax(largest, fabs(x[i]));
        }
        for (int32_t i = 0; k >= answer->vertices && i < solver->n; i++)
            x[i] /= largest;
    }
}

void perp__lcp_all_report(perp__lcp_all *all, perp__answer *answer)
{
    const size_t n = (size_t)all->n, entries = (size_t)(answer->vertices + answer->rays) * n;
    perp_lcp_found found = {.struct_size = sizeof found,
                            .dimension = answer->dimension,
                            .vertex_count = answer->vertices,
                            .ray_count = answer->rays,
                            .z = all->solver->z,
                            .w = all->solver->w_high,
                            .places = answer->modes,
                            .vertices = answer->points,
                            .rays = answer->points + (size_t)answer->vertices * n};
    perp__evaluation residuals;
    double largest;
    int32_t said;

    if (all->silent)
        return;
    /* 1. The middle; of vertices far apart it loses what one of them holds, so that this one is
     * taken. */
    perp__answer_find_middle(&all->answers, answer);
    largest = perp__largest(answer->middle, all->n);
    residuals = perp__lcp_all_evaluate(all, answer->pattern, answer->middle);
    if (answer->dimension > 0 && !perp__lcp_all_is_solution(all, &residuals, 0.0)) {
        memcpy(answer->middle, answer->points, n * sizeof *answer->middle);
        residuals = perp__lcp_all_evaluate(all, answer->pattern, answer->middle);
    }
    to_caller(all->solver, answer);
    for (int32_t i = 0; i < all->n; i++)
        answer->modes[i] = answer->pattern[i];
    if (!perp__lcp_all_is_solution(all, &residuals, largest) ||
        !perp__all_finite(answer->points, entries)) {
        all->answers.incomplete = 1;
        return;
    }
    /* 2. What the caller says of it. */
    *(answer->dimension > 0 ? &all->result.families : &all->result.isolated) += 1;
    found.residual = fmax(residuals.tested, answer->residual);
    said = all->visit ? all->visit(&found, all->user) : 0;
    if (said != 0) {
        all->silent = all->tree.ended = 1;
        all->aborted = said < 0;
        all->result.outcome = PERP_OUTCOME_STOPPED;
    }
}

/* ---- the call ------------------------------------------------------------------------------ */

static void layout(perp__arena *arena, void *object)
{
    perp__lcp_all *all = object;
    const size_t n = (size_t)all->n;

    all->levels = perp__arena_take(arena, n + 1, sizeof *all->levels);
    for (size_t d = 0; d <= n; d++) {
        perp__tableau level;

        level.T = perp__arena_take(arena, n * (n + 1), sizeof(double));
        level.kind = perp__arena_take(arena, n, sizeof(int8_t));
        level.basic = perp__arena_take(arena, n, sizeof(int8_t));
        level.columns = perp__arena_take(arena, n, sizeof(int8_t));
        level.pending = 0;
        if (all->levels)
            all->levels[d] = level;
    }
    PERP__DOUBLES(arena, n, &all->row_sizes, &all->z, &all->origin);
    all->places = perp__arena_take(arena, n, sizeof(int8_t));
    all->directions = perp__arena_take(arena, n * n, sizeof(double));
    all->work = perp__arena_take(arena, (n + 1) * (n + 1), sizeof(double));
    all->tree.next = perp__arena_take(arena, n, sizeof(int32_t));
}

static void all_init(perp__lcp_all *all, perp_lcp_solver *solver)
{
    perp_context *context = solver->context;

    memset(all, 0, sizeof *all);
    all->context = all->answers.context = all->polyhedron.cone.context = context;
    all->solver = solver;
    all->answers.holds = perp__lcp_all_holds;
    all->answers.user = all;
    all->polyhedron.least = all->polyhedron.row_rounding = PERP__ALL_NOISE;
}

/* Lays out the memory and the equilibrated matrix of the solver's problem, which is scaled
 * (perp__scale_problem). */
static perp_status all_prepare(perp__lcp_all *all)
{
    perp_lcp_solver *solver = all->solver;
    const int32_t n = all->n = solver->n;
    perp_status status = perp__read_block(solver);

    PERP__THEN(status, perp__polish_fit(solver));
    PERP__THEN(status, perp__arena_fit(&all->arena, all->context, layout, all));
    PERP__THEN(status, perp__cone_fit(&all->polyhedron.cone, 2 * n + 1, n + 1));
    if (status != PERP_OK)
        return status;
    all->answers.length = all->answers.positions = all->polyhedron.length = n;
    all->answers.incomplete = 0;
    all->polyhedron.origin = all->origin;
    all->polyhedron.directions = all->directions;
    for (int32_t i = 0; i < n; i++) {
        double *T = all->levels[0].T + (size_t)i * (size_t)(n + 1);

        all->row_sizes[i] = 0.0;
        for (int32_t j = 0; j < n; j++) {
            T[j] = solver->S_values[j * n + i];
            all->row_sizes[i] = fmax(all->row_sizes[i], fabs(T[j]));
        }
        T[n] = solver->q_scaled[i];
        all->levels[0].kind[i] = PERP__ROW_W_FREE;
        all->levels[0].basic[i] = 0;
    }
    all->levels[0].pending = 0;
    return PERP_OK;
}

static void all_release(perp__lcp_all *all)
{
    perp__answers_release(&all->answers);
    perp__cone_release(&all->polyhedron.cone);
    perp__arena_release(&all->arena);
}

static perp_status run(perp__lcp_all *all, const double *q)
{
    const double started = perp__now();
    perp_lcp_solver *solver = all->solver;
    const perp__matrix *M = &solver->M;
    bool finite = 1;
    perp_status status;

    perp__open_control(solver, started);
    all->limit = solver->settings.max_iterations;
    perp__scale_problem(solver, q);
    status = all_prepare(all);
    if (status != PERP_OK)
        return status;
    /* 1. Entries of the equilibrated matrix may be beyond the range of doubles; those that have
     * become 0 there hide index sets. */
    for (int32_t line = 0; line < all->n; line++) {
        const perp__line l = perp__line_of(M, line);
        const bool rows = perp__lines_are_rows(M);

        for (int32_t k = 0; k < l.count; k++) {
            const int32_t at = l.indices ? l.indices[k] : k;
            const double entry =
                all->levels[0].T[(rows ? line : at) * (all->n + 1) + (rows ? at : line)];

            finite &= isfinite(entry) != 0;
            all->answers.incomplete |= entry == 0.0 && l.values[k] != 0.0;
        }
    }
    /* 2. The search, which reports what is its own index set's, and what it has kept. */
    all->result.outcome = finite ? PERP_OUTCOME_SOLVED : PERP_OUTCOME_EVALUATION_FAILED;
    if (finite)
        status = perp__lcp_all_search(all);
    for (perp__answer *answer = all->answers.first; status == PERP_OK && !all->aborted && answer;
         answer = answer->next)
        perp__lcp_all_report(all, answer);
    if (status == PERP_OK && all->aborted)
        status = perp__fail(all->context, PERP_ERROR_CALLBACK, "the callback asked to abort");
    if (all->answers.incomplete && all->result.outcome == PERP_OUTCOME_SOLVED)
        all->result.outcome = PERP_OUTCOME_STALLED;
    all->result.seconds = perp__now() - started;
    return status;
}

perp_status perp_lcp_all(perp_context *context, perp_lcp_enumeration *result,
                         const perp_lcp_settings *settings, const perp_lcp_problem *problem,
                         perp_lcp_visit visitor, void *user)
{
    perp_lcp_solver *solver;
    perp_lcp_problem p = {0};
    perp__lcp_all all;
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    status = perp__lcp_create(context, &solver, settings);
    if (status != PERP_OK)
        return perp__leave(context, status);
    solver->as_given = 1;
    status = perp__lcp_caller_read(context, &p, problem, 0);
    PERP__THEN(status, perp__lcp_setup(solver, p.M, p.lower, p.upper));
    PERP__THEN(status, PERP__CHECK(perp_lcp_enumeration, context, result));
    if (status == PERP_OK && solver->n > PERP__LARGEST_ALL)
        status = perp__refuse(context, "M has %d rows: all solutions are searched for up to %d",
                              (int)solver->n, PERP__LARGEST_ALL);
    PERP__THEN(status, perp__check_vector(context, "q", p.q, (size_t)solver->n));
    if (status == PERP_OK) {
        all_init(&all, solver);
        all.visit = visitor;
        all.user = user;
        status = run(&all, p.q);
        if (status == PERP_OK)
            perp__struct_write(result, &all.result, sizeof all.result);
        all_release(&all);
    }
    perp__handle_end(solver);
    return perp__leave(context, status);
}

/* ---- the last word -------------------------------------------------------------------------- */

/* The last word on small problems: where pivoting, sweeps and Newton's method have found no
 * solution, the tree of index sets (patterns/patterns.h) is searched for the first that the gate
 * takes. At most 3^12 index sets, and few of them are reached. */

/* Largest n: there a search that finds nothing takes milliseconds; and where no variable
 * has more than two places. */
enum { LARGEST_LAST_WORD = 12, LARGEST_INSISTENT = 20 };

bool perp__has_last_word(const perp_lcp_solver *solver)
{
    return solver->settings.method == PERP_LCP_AUTO &&
           solver->n <= (solver->insists ? LARGEST_INSISTENT : LARGEST_LAST_WORD);
}

void perp__lcp_insist(perp_lcp_solver *solver, bool insists)
{
    solver->insists = insists;
}

perp_status perp__last_word(perp_lcp_solver *solver)
{
    const int64_t budget = solver->settings.max_iterations;
    perp__lcp_all *tree = solver->tree;
    perp_status status;

    if (budget > 0 && solver->spent >= budget) {
        solver->ended = PERP_OUTCOME_ITERATION_LIMIT;
        return PERP_OK;
    }
    if (!tree) {
        tree = solver->tree = perp__allocate(solver->context, 1, sizeof *tree);
        if (!tree)
            return perp__fail_memory(solver->context, "the tree of index sets");
        all_init(tree, solver);
        tree->first = 1;
    }
    tree->aborted = tree->found = 0;
    memset(&tree->result, 0, sizeof tree->result);
    tree->limit = budget > 0 ? budget - solver->spent : 0;
    solver->control.method = PERP_LCP_PATTERNS;
    solver->control.deadline = solver->deadline;
    solver->correct = NULL;
    status = all_prepare(tree);
    PERP__THEN(status, perp__lcp_all_search(tree));
    if (status == PERP_OK && tree->aborted)
        status = perp__fail(solver->context, PERP_ERROR_CALLBACK, "the monitor asked to abort");
    if (status != PERP_OK)
        return status;
    solver->spent += tree->result.nodes;
    if (tree->found)
        perp__consider_point(solver, PERP_LCP_PATTERNS, PERP_OUTCOME_STALLED);
    else if (tree->tree.ended)
        solver->ended = tree->result.outcome;
    return PERP_OK;
}

void perp__last_word_release(perp_lcp_solver *solver)
{
    all_release(solver->tree);
    perp__release(solver->context, solver->tree);
}
