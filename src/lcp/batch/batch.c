/* Many small problems in one call: groups of them side by side in vectors, shared out among
 * threads; what the kernel cannot take or does not solve goes to a solver of its own. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
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

static void begin_worker(batch_worker *worker, batch *b, int64_t first, int64_t end)
{
    memset(worker, 0, sizeof *worker);
    worker->batch = b;
    worker->first = first;
    worker->end = end;
    perp__tasks_context(b->tasks, &worker->context);
}

static void end_worker(batch_worker *worker)
{
    perp__lcp_destroy(worker->solver);
    perp__arena_release(&worker->arena);
}

/* z nearest to 0, with nothing known about it. */
static void leave_unsolved(const batch *b, int64_t problem)
{
    const size_t n = (size_t)b->data.n, at = (size_t)problem * n;

    for (size_t i = 0; i < n; i++) {
        const double low = b->data.lower ? b->data.lower[at + i] : 0.0;
        const double up = b->data.upper ? b->data.upper[at + i] : INFINITY;

        b->answers.z[at + i] = low > 0.0 ? low : up < 0.0 ? up : 0.0;
        if (b->answers.w)
            b->answers.w[at + i] = NAN;
    }
    b->answers.outcomes[problem] = PERP_OUTCOME_TIME_LIMIT;
    b->answers.residuals[problem] = INFINITY;
}

static int32_t is_late(const batch *b)
{
    return b->deadline > 0.0 && perp__now() > b->deadline;
}

/* A solver with what is left of the call's time. */
static perp_status fit_solver(batch_worker *worker)
{
    const batch *b = worker->batch;
    perp_lcp_settings settings = *b->settings;

    if (b->deadline > 0.0) /* never 0, which is no limit */
        settings.time_limit = fmax(b->deadline - perp__now(), DBL_MIN);
    else if (worker->solver)
        return PERP_OK;
    return worker->solver ? perp__lcp_set(worker->solver, &settings)
                          : perp__lcp_create(&worker->context, &worker->solver, &settings);
}

/* One problem by a solver of its own. */
static perp_status solve_alone(batch_worker *worker, int64_t problem)
{
    const batch *b = worker->batch;
    const perp__batch_data *data = &b->data;
    const size_t n = (size_t)data->n, at = (size_t)problem * n;
    perp_lcp_result result;
    const perp_matrix M = perp__view(PERP_STORAGE_ROW_MAJOR, data->n, data->n, data->M + at * n);
    perp_status status;

    if (is_late(b)) {
        leave_unsolved(b, problem);
        return PERP_OK;
    }
    status = fit_solver(worker);
    PERP__THEN(status, perp_lcp_result_init(&result, sizeof result));
    PERP__THEN(status, perp__lcp_setup(worker->solver, &M, data->lower ? data->lower + at : NULL,
                                       data->upper ? data->upper + at : NULL));
    PERP__THEN(status, perp__lcp_solve(worker->solver, b->answers.z + at,
                                       b->answers.w ? b->answers.w + at : NULL, NULL, &result,
                                       data->q + at, NULL));
    if (status == PERP_OK) {
        b->answers.outcomes[problem] = result.outcome;
        b->answers.residuals[problem] = result.residual;
    }
    return status;
}

/* Takes the lane's answer if it is surely one: own is +inf where it or w may not be finite. */
static int32_t take_answer(batch_worker *worker, int64_t problem, int32_t lane)
{
    const batch *b = worker->batch;
    const perp__batch_group *g = &worker->group;
    const size_t n = (size_t)g->n, width = (size_t)g->width, at = (size_t)problem * n;
    const perp__evidence evidence = {g->tested[lane], g->own[lane], INFINITY, 1};
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

static perp_status solve_group(batch_worker *worker, int64_t first)
{
    perp__batch_group *g = &worker->group;
    perp_status status = PERP_OK;
    int32_t takes[8], lane;

    perp__batch_group_read(g, &worker->batch->data, first, takes);
    worker->batch->kernel->solve(g);
    for (lane = 0; lane < g->width && first + lane < worker->end && status == PERP_OK; lane++)
        if (!takes[lane] || !take_answer(worker, first + lane, lane))
            status = solve_alone(worker, first + lane);
    return status;
}

static void work(int32_t which, void *workers)
{
    batch_worker *worker = (batch_worker *)workers + which;
    batch *b = worker->batch;
    const int64_t stride = b->kernel ? b->kernel->width : 1;

    if (b->kernel) {
        worker->group.n = b->data.n;
        worker->group.width = b->kernel->width;
        worker->status = perp__arena_fit(&worker->arena, &worker->context, perp__batch_group_layout,
                                         &worker->group);
    }
    for (int64_t at = worker->first; at < worker->end && worker->status == PERP_OK; at += stride) {
        if (is_late(b))
            for (int64_t k = at; k < at + stride && k < worker->end; k++)
                leave_unsolved(b, k);
        else
            worker->status = b->kernel ? solve_group(worker, at) : solve_alone(worker, at);
    }
}

/* The worker's failure, for the caller. What is not finite is named as an entry of the caller's
 * arrays; to look for it before it is met would cost a pass over all the data. */
static perp_status fail_as(const batch *b, const batch_worker *worker)
{
    const size_t n = (size_t)b->data.n, all = (size_t)b->data.count * n;
    perp_status status = PERP_OK;

    if (worker->status == PERP_ERROR_NOT_FINITE)
        status = perp__check_finite(b->context, "M", b->data.M, all * n);
    if (worker->status == PERP_ERROR_NOT_FINITE && status == PERP_OK)
        status = perp__check_finite(b->context, "q", b->data.q, all);
    PERP__THEN(status, perp__fail(b->context, worker->status, "%s", worker->context.message));
    return status;
}

/* Every thread gets a run of whole groups. */
static perp_status run(batch *b, batch_worker *workers, int32_t threads)
{
    const int64_t stride = b->kernel ? b->kernel->width : 1;
    const int64_t groups = (b->data.count + stride - 1) / stride;
    perp_status status = PERP_OK;

    for (int32_t k = 0; k < threads; k++) {
        const int64_t first = stride * (groups * k / threads);
        const int64_t end = stride * (groups * (k + 1) / threads);

        begin_worker(&workers[k], b, first, end < b->data.count ? end : b->data.count);
    }
    perp__tasks_run(b->tasks, work, workers);
    for (int32_t k = 0; k < threads; k++) {
        if (workers[k].status != PERP_OK && status == PERP_OK)
            status = fail_as(b, &workers[k]);
        end_worker(&workers[k]);
    }
    return status;
}

static perp_status check(perp_context *context, const batch *b, const double *z, int32_t threads)
{
    const perp__batch_data *data = &b->data;
    perp_status status = PERP_OK;

    if (data->count < 0)
        return perp__refuse(context, "count is %lld, expected 0 or more", (long long)data->count);
    if (data->n < 0)
        return perp__refuse(context, "n is %d, expected 0 or more", (int)data->n);
    if (threads < 1 || threads > PERP__MOST_THREADS)
        return perp__refuse(context, "threads is %d, expected 1 to %d", (int)threads,
                            PERP__MOST_THREADS);
    if (data->count > 0 && data->n > 0) {
        if ((uint64_t)data->count > SIZE_MAX / sizeof(double) / (size_t)data->n / (size_t)data->n)
            return perp__refuse(context, "count is %lld, too many problems of n = %d",
                                (long long)data->count, (int)data->n);
        status = perp__check_pointer(context, "z", z);
        PERP__THEN(status, perp__check_pointer(context, "M", data->M));
        PERP__THEN(status, perp__check_pointer(context, "q", data->q));
        PERP__THEN(status, perp__check_bounds(context, data->lower, data->upper,
                                              (size_t)data->count * (size_t)data->n));
    }
    return status;
}

static void layout(perp__arena *arena, void *object)
{
    batch *b = object;
    const size_t count = (size_t)b->data.count, all = count * (size_t)b->data.n;
    b->answers.z = perp__arena_take(arena, all, sizeof(double));
    b->answers.outcomes = perp__arena_take(arena, count, sizeof(int32_t));
    b->answers.residuals = perp__arena_take(arena, count, sizeof(double));
    if (b->wants_w)
        b->answers.w = perp__arena_take(arena, all, sizeof(double));
}

/* All answers into the arena's arrays; with n = 0 or count = 0 there is nothing but outcomes. */
static perp_status solve_all(batch *b, perp__arena *arena, int32_t threads)
{
    batch_worker *workers;
    perp_status status;

    status = perp__arena_fit(arena, b->context, layout, b);
    if (status != PERP_OK)
        return status;
    workers = perp__allocate(b->context, (size_t)threads, sizeof *workers);
    if (!workers)
        return perp__fail_memory(b->context, "the threads");
    status = perp__tasks_create(b->context, &b->tasks, threads, NULL, NULL);
    PERP__THEN(status, run(b, workers, threads));
    perp__tasks_destroy(b->tasks);
    perp__release(b->context, workers);
    return status;
}

static void write_out(const batch *b, double *z, double *w, int32_t *outcomes, double *residuals)
{
    const size_t count = (size_t)b->data.count, bytes = count * (size_t)b->data.n * sizeof(double);

    if (bytes > 0) {
        memcpy(z, b->answers.z, bytes);
        if (w)
            memcpy(w, b->answers.w, bytes);
    }
    if (outcomes && count > 0)
        memcpy(outcomes, b->answers.outcomes, count * sizeof *outcomes);
    if (residuals && count > 0)
        memcpy(residuals, b->answers.residuals, count * sizeof *residuals);
}

perp_status perp_lcp_batch(perp_context *context, double *z, double *w, int32_t *outcomes,
                           double *residuals, const perp_lcp_settings *settings, int32_t threads,
                           int64_t count, int32_t n, const double *M, const double *q,
                           const double *lower, const double *upper)
{
    perp_lcp_settings own;
    perp__arena arena = {0};
    batch b = {0};
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    b.context = context;
    b.data.count = count;
    b.data.n = n;
    b.data.M = M;
    b.data.q = q;
    b.data.lower = lower;
    b.data.upper = upper;
    b.wants_w = w != NULL;
    status = perp__lcp_settings_read(context, &own, settings);
    PERP__THEN(status, check(context, &b, z, threads));
    if (status == PERP_OK) {
        if (own.time_limit > 0.0)
            b.deadline = perp__now() + own.time_limit;
        own.time_limit = 0.0;
        own.monitor = NULL;
        b.settings = &own;
        b.data.scaling = own.scaling;
        b.data.max_iterations = own.max_iterations;
        if (own.method == PERP_LCP_AUTO && n > 0 && n <= PERP__BATCH_LARGEST)
            b.kernel = perp__batch_kernel_number(0);
        status = solve_all(&b, &arena, threads);
    }
    if (status == PERP_OK)
        write_out(&b, z, w, outcomes, residuals);
    perp__arena_release(&arena);
    return perp__leave(context, status);
}
