/* Many small problems in one call: groups of them side by side in vectors, shared out among
 * threads; what the kernel cannot take or does not solve goes to a solver of its own. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/handle.h"
#include "base/outcome.h"
#include "base/tasks.h"
#include "lcp/batch/group.h"
#include "lcp/lcp.h"
#include "linalg/matrix.h"

/* The answers, kept apart until every problem has one: a call that fails writes nothing. */
typedef struct batch_answers {
    double *z, *w; /* count x n; w may be NULL */
    int32_t *outcomes;
    double *residuals;
} batch_answers;

typedef struct batch {
    perp_context *context;
    perp__batch_data data;
    const perp_lcp_settings *settings;
    const perp__batch_kernel *kernel; /* NULL: too large for it */
    batch_answers answers;
    int32_t wants_w;
    double deadline; /* 0: none */
    perp__tasks *tasks;
} batch;

/* A thread's own workspace and solver. */
typedef struct batch_worker {
    batch *batch;
    int64_t first, end; /* of problems */
    perp_context context;
    perp__arena arena;
    perp__batch_group group;
    perp_lcp_solver *solver;
    perp_status status;
} batch_worker;

/* z nearest to 0, with nothing known about it. */
static void leave_unsolved(const batch *b, int64_t problem)
{
    const size_t n = (size_t)b->data.stack.n, at = (size_t)problem * n;

    for (size_t i = 0; i < n; i++) {
        const double low = b->data.stack.lower ? b->data.stack.lower[at + i] : 0.0;
        const double up = b->data.stack.upper ? b->data.stack.upper[at + i] : INFINITY;

        b->answers.z[at + i] = low > 0.0 ? low : up < 0.0 ? up : 0.0;
        if (b->answers.w)
            b->answers.w[at + i] = NAN;
    }
    b->answers.outcomes[problem] = PERP_OUTCOME_TIME_LIMIT;
    b->answers.residuals[problem] = INFINITY;
}

/* One problem by a solver of its own, with what is left of the call's time. */
static perp_status solve_alone(batch_worker *worker, int64_t problem)
{
    const batch *b = worker->batch;
    const perp__batch_data *data = &b->data;
    const size_t n = (size_t)data->stack.n, at = (size_t)problem * n;
    const perp_matrix M =
        perp__view(PERP_STORAGE_ROW_MAJOR, data->stack.n, data->stack.n, data->stack.M + at * n);
    perp_lcp_settings settings = *b->settings;
    perp_lcp_result result;
    perp_status status = PERP_OK;

    if (perp__is_past(b->deadline)) {
        leave_unsolved(b, problem);
        return PERP_OK;
    }
    if (b->deadline > 0.0) /* never 0, which is no limit */
        settings.time_limit = fmax(b->deadline - perp__now(), DBL_MIN);
    if (!worker->solver)
        status = perp__lcp_create(&worker->context, &worker->solver, &settings);
    else if (b->deadline > 0.0)
        status = perp__lcp_set(worker->solver, &settings);
    PERP__THEN(status, perp_struct_init(&result, sizeof result));
    PERP__THEN(status, perp__lcp_setup(worker->solver, &M,
                                       data->stack.lower ? data->stack.lower + at : NULL,
                                       data->stack.upper ? data->stack.upper + at : NULL));
    PERP__THEN(status, perp__lcp_solve(worker->solver, b->answers.z + at,
                                       b->answers.w ? b->answers.w + at : NULL, NULL, &result,
                                       data->stack.q + at, NULL));
    if (status == PERP_OK) {
        b->answers.outcomes[problem] = result.outcome;
        b->answers.residuals[problem] = result.residual;
    }
    return status;
}

/* Takes the lane's answer if it is surely one: own is +inf where it or w may not be finite. */
static bool take_answer(batch_worker *worker, int64_t problem, int32_t lane)
{
    const batch *b = worker->batch;
    const perp__batch_group *g = &worker->group;
    const size_t n = (size_t)g->n, width = (size_t)g->width, at = (size_t)problem * n;
    const perp__evidence evidence = {g->tested[lane], g->own_residual[lane], INFINITY, 1};
    const perp_outcome outcome = perp__gate(&evidence, b->settings->tol, -1);

    if (!perp__is_good(outcome))
        return 0;
    for (size_t i = 0; i < n; i++)
        b->answers.z[at + i] = g->z[i * width + (size_t)lane];
    for (size_t i = 0; b->answers.w && i < n; i++)
        b->answers.w[at + i] = g->high[i * width + (size_t)lane];
    b->answers.outcomes[problem] = outcome;
    b->answers.residuals[problem] = g->tested[lane];
    return 1;
}

static void work(int32_t which, void *workers)
{
    batch_worker *worker = (batch_worker *)workers + which;
    perp__batch_group *g = &worker->group;
    batch *b = worker->batch;
    const int64_t stride = b->kernel ? b->kernel->width : 1;

    if (b->kernel) {
        g->n = b->data.stack.n;
        g->width = b->kernel->width;
        worker->status =
            perp__arena_fit(&worker->arena, &worker->context, perp__batch_group_layout, g);
    }
    for (int64_t at = worker->first; at < worker->end && worker->status == PERP_OK; at += stride) {
        const bool late = perp__is_past(b->deadline);
        int32_t takes[8] = {0};

        if (b->kernel && !late) {
            perp__batch_group_read(g, &b->data, at, takes);
            b->kernel->solve(g);
        }
        for (int32_t lane = 0;
             lane < stride && at + lane < worker->end && worker->status == PERP_OK; lane++)
            if (late)
                leave_unsolved(b, at + lane);
            else if (!takes[lane] || !take_answer(worker, at + lane, lane))
                worker->status = solve_alone(worker, at + lane);
    }
}

static perp_status check(perp_context *context, const batch *b, const double *z, int32_t threads)
{
    const perp__batch_data *data = &b->data;
    perp_status status = PERP_OK;

    if (data->stack.reserved != 0)
        return perp__refuse(context, "problems.reserved is %d, expected 0",
                            (int)data->stack.reserved);
    if (data->stack.count < 0)
        return perp__refuse(context, "count is %lld, expected 0 or more",
                            (long long)data->stack.count);
    if (data->stack.n < 0)
        return perp__refuse(context, "n is %d, expected 0 or more", (int)data->stack.n);
    if (threads < 1 || threads > PERP__MOST_THREADS)
        return perp__refuse(context, "threads is %d, expected 1 to %d", (int)threads,
                            PERP__MOST_THREADS);
    if (data->stack.count > 0 && data->stack.n > 0) {
        if ((uint64_t)data->stack.count >
            SIZE_MAX / sizeof(double) / (size_t)data->stack.n / (size_t)data->stack.n)
            return perp__refuse(context, "count is %lld, too many problems of n = %d",
                                (long long)data->stack.count, (int)data->stack.n);
        status = perp__check_pointer(context, "z", z);
        PERP__THEN(status, perp__check_pointer(context, "M", data->stack.M));
        PERP__THEN(status, perp__check_pointer(context, "q", data->stack.q));
        PERP__THEN(status, perp__check_bounds(context, data->stack.lower, data->stack.upper,
                                              (size_t)data->stack.count * (size_t)data->stack.n));
    }
    return status;
}

static void layout(perp__arena *arena, void *object)
{
    batch *b = object;
    const size_t count = (size_t)b->data.stack.count, all = count * (size_t)b->data.stack.n;
    b->answers.z = perp__arena_take(arena, all, sizeof(double));
    b->answers.outcomes = perp__arena_take(arena, count, sizeof(int32_t));
    b->answers.residuals = perp__arena_take(arena, count, sizeof(double));
    if (b->wants_w)
        b->answers.w = perp__arena_take(arena, all, sizeof(double));
}

/* All answers into the arena's arrays; with n = 0 or count = 0 there is nothing but outcomes. */
static perp_status solve_all(batch *b, perp__arena *arena, int32_t threads)
{
    const int64_t stride = b->kernel ? b->kernel->width : 1;
    const int64_t count = b->data.stack.count, groups = (count + stride - 1) / stride;
    const size_t n = (size_t)b->data.stack.n, all = (size_t)count * n;
    batch_worker *workers;
    perp_status status = perp__arena_fit(arena, b->context, layout, b);

    if (status != PERP_OK)
        return status;
    workers = perp__allocate(b->context, (size_t)threads, sizeof *workers);
    if (!workers)
        return perp__fail_memory(b->context, "the threads");
    status = perp__tasks_create(b->context, &b->tasks, threads, NULL, NULL);
    /* 1. Every thread gets a run of whole groups. */
    memset(workers, 0, (size_t)threads * sizeof *workers);
    for (int32_t k = 0; k < threads && status == PERP_OK; k++) {
        const int64_t end = stride * (groups * (k + 1) / threads);

        workers[k].batch = b;
        workers[k].first = stride * (groups * k / threads);
        workers[k].end = end < count ? end : count;
        perp__tasks_context(b->tasks, &workers[k].context);
    }
    if (status == PERP_OK)
        perp__tasks_run(b->tasks, work, workers);
    /* 2. The first failure, for the caller. What is not finite is named as an entry of the caller's
     * arrays; to look for it before it is met would cost a pass over all the data. */
    for (int32_t k = 0; k < threads && status == PERP_OK; k++) {
        const perp_status failed = workers[k].status;

        if (failed == PERP_ERROR_NOT_FINITE)
            status = perp__check_finite(b->context, "M", b->data.stack.M, all * n);
        if (failed == PERP_ERROR_NOT_FINITE && status == PERP_OK)
            status = perp__check_finite(b->context, "q", b->data.stack.q, all);
        if (failed != PERP_OK && status == PERP_OK)
            status = perp__fail(b->context, failed, "%s", workers[k].context.message);
    }
    for (int32_t k = 0; k < threads; k++) {
        perp__handle_end(workers[k].solver);
        perp__arena_release(&workers[k].arena);
    }
    perp__tasks_destroy(b->tasks);
    perp__release(b->context, workers);
    return status;
}

perp_status perp_lcp_batch(perp_context *context, double *z, double *w, int32_t *outcomes,
                           double *residuals, const perp_lcp_settings *settings, int32_t threads,
                           const perp_lcp_stack *problems)
{
    perp_lcp_settings copy;
    perp__arena arena = {0};
    batch b = {.context = context, .settings = &copy, .wants_w = w != NULL};
    perp_status status = perp__enter(context);
    size_t count, bytes;

    if (status != PERP_OK)
        return status;
    status = perp__lcp_settings_read(context, &copy, settings);
    PERP__THEN(status, PERP__READ(perp_lcp_stack, context, &b.data.stack, problems));
    PERP__THEN(status, check(context, &b, z, threads));
    if (status == PERP_OK) {
        if (copy.time_limit > 0.0)
            b.deadline = perp__now() + copy.time_limit;
        copy.time_limit = 0.0;
        copy.monitor = NULL;
        b.data.scaling = copy.scaling;
        b.data.max_iterations = copy.max_iterations;
        if (copy.method == PERP_LCP_AUTO && b.data.stack.n > 0 &&
            b.data.stack.n <= PERP__SMALL_LENGTH)
            b.kernel = perp__batch_kernel_number(0);
        status = solve_all(&b, &arena, threads);
    }
    if (status == PERP_OK && b.data.stack.count > 0) {
        count = (size_t)b.data.stack.count;
        bytes = count * (size_t)b.data.stack.n * sizeof(double);
        if (bytes > 0)
            memcpy(z, b.answers.z, bytes);
        if (w && bytes > 0)
            memcpy(w, b.answers.w, bytes);
        if (outcomes)
            memcpy(outcomes, b.answers.outcomes, count * sizeof *outcomes);
        if (residuals)
            memcpy(residuals, b.answers.residuals, count * sizeof *residuals);
    }
    perp__arena_release(&arena);
    return perp__leave(context, status);
}
