/* Projected Gauss-Seidel with over-relaxation (Cryer, SIAM J. Control 9 (1971) 385; for bounds and
 * unsymmetric M: Cottle, Pang & Stone (1992), section 5.2): row by row,
 *
 *   w_i = (S z)_i + q_i,    z_i := mid(l_i, u_i, z_i - omega w_i / S_ii),
 *
 * with the newest z throughout. Converges for symmetric positive definite S and omega in (0, 2),
 * and for diagonally dominant S and omega <= 1, linearly; otherwise it may stall or diverge, and
 * says so. The residual |mid(z_i - l_i, z_i - u_i, w_i)| of a sweep is read in passing, at the
 * moment each row is updated; a sweep that claims convergence is confirmed by a product with its z.
 *
 * A row without a diagonal entry has no such step. If all of it is zero, w_i = q_i says where z_i
 * belongs, and there it is held. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "lcp/pgs/sweep.h"

/* Stagnation is of 2 n sweeps at least: news travels against the sweep's direction by one row a
 * sweep, and a residual may be flat until it has arrived. */

#define SWEEPS_BETWEEN_LOOKS 10 /* at the residual, and at the active set */

/* Conjugate gradients start again when the residual has grown by this much, so many times. */
#define GROWTH 10.0
#define RESTARTS_MOST 3

/* Several sweeps go through the matrix together where it does not fit into 256 kB of cache. */
#define ENTRIES_IN_CACHE 32768

/* The polish is asked to finish when the active set has stayed the same for a third of all sweeps,
 * and at least so many; again when there are four times as many. */
#define SWEEPS_UNCHANGED 30

/* Nonsmooth nonlinear conjugate gradients over sweeps (Silcowitz, Niebe & Erleben, The Visual
 * Computer 26 (2010) 893). */
typedef struct conjugate {
    double *before;    /* z when the sweep began */
    double *direction; /* n */
    double norm;       /* |step of the last sweep|^2; 0: no direction yet */
} conjugate;

/* What makes pgs give up: growth, or no progress from one window of sweeps to the next. */
typedef struct pgs_progress {
    double best;
    double best_before; /* at the end of the last window */
    int64_t window;
    double looked; /* the best when the rate was looked at */
    int64_t next_look;
} pgs_progress;

typedef struct pgs_work {
    perp__lcp_work common;
    perp__sweeper sweeper;
    conjugate gradient;
    int32_t restarts;          /* of the gradient; RESTARTS_MOST: it is not used */
    double *step;              /* omega / S_ii; 0 in rows that do not move */
    double *best;              /* the z of the smallest residual seen, up to a factor 2 */
    double remembered;         /* its residual */
    double residual;           /* of the last sweep */
    double *high, *low;        /* for the tested residual */
    int64_t sweeps, next_test; /* done; the one from when on z is tested again */
    pgs_progress progress;
    int8_t *places;     /* the active set when it was looked at */
    int64_t changed;    /* the last sweep at which it was another */
    int64_t next_pause; /* the sweep from when on the polish is asked */
    double relaxation;  /* the rows were read with these settings; 0: not yet */
    int32_t scaling, sweep;
} pgs_work;

static void layout(perp__arena *arena, void *object)
{
    pgs_work *work = object;
    const perp__lcp_problem *problem = work->common.problem;
    size_t n = (size_t)problem->n;

    perp__sweeper_layout(arena, &work->sweeper, problem);
    PERP__DOUBLES(arena, n, &work->gradient.before, &work->gradient.direction, &work->step,
                  &work->best, &work->high, &work->low);
    work->places = perp__arena_take(arena, n, sizeof(int8_t));
    work->relaxation = 0.0;
}

/* Every row has a positive diagonal entry, or is zero and its q_i tells where z_i belongs, or z_i
 * is fixed. PERP_OK or PERP_ERROR_ARGUMENT. */
static perp_status check(const perp__lcp_problem *problem)
{
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < problem->n && status == PERP_OK; i++) {
        const double lower = problem->lower[i], upper = problem->upper[i], q = problem->q[i];
        const double diagonal = perp__entry(problem->caller, i, i);

        if (!(lower < upper) || diagonal > 0.0)
            continue;
        if (problem->row_norms[i] > 0.0)
            status = perp__refuse(problem->context, "M(%d,%d) = %g: pgs needs a positive diagonal",
                                  (int)i, (int)i, diagonal);
        else if ((q > 0.0 && lower == -INFINITY) || (q < 0.0 && upper == INFINITY))
            status = perp__refuse(problem->context,
                                  "row %d of M is 0 and q[%d] is not: w[%d] = q[%d] for every z",
                                  (int)i, (int)i, (int)i, (int)i);
    }
    return status;
}

static bool moves(const perp__lcp_problem *problem, int32_t i)
{
    return problem->lower[i] < problem->upper[i] && problem->row_norms[i] > 0.0;
}

/* The matrix, which is kept from solve to solve until its set-up or a setting changes; q and the
 * bounds; a row of zeros is held where its w = q wants it. */
static void read_problem(pgs_work *work, const double *z)
{
    const perp__lcp_problem *problem = work->common.problem;
    const perp_lcp_settings *settings = problem->settings;
    perp__sweeper *sweeper = &work->sweeper;
    bool is_read = work->relaxation == settings->relaxation && work->scaling == settings->scaling &&
                   work->sweep == settings->sweep;

    for (int32_t i = 0; i < problem->n && is_read; i++)
        is_read = moves(problem, i) == (work->step[i] != 0.0);
    if (!is_read) {
        work->relaxation = settings->relaxation;
        work->scaling = settings->scaling;
        work->sweep = settings->sweep;
        for (int32_t i = 0; i < problem->n; i++)
            work->step[i] =
                moves(problem, i) ? work->relaxation / perp__entry(problem->M, i, i) : 0.0;
        perp__rows_read(&sweeper->rows, problem, work->step, work->sweep == PERP_SWEEP_SYMMETRIC);
    }
    sweeper->keep = 1.0 - work->relaxation;
    for (int32_t i = 0; i < problem->n; i++) {
        perp__slice *slice = &sweeper->rows.slices[i / PERP__SLICE];
        const int32_t row = i % PERP__SLICE;
        const double q = problem->q[i];

        slice->load[row] = q * work->step[i];
        slice->lower[row] = problem->lower[i];
        sweeper->rows.upper[i] = problem->upper[i];
        if (work->step[i] == 0.0)
            slice->lower[row] = sweeper->rows.upper[i] = q > 0.0   ? problem->lower[i]
                                                         : q < 0.0 ? problem->upper[i]
                                                                   : z[i];
    }
    perp__sweeper_start(sweeper, z);
}

/* The last sweep's residual is small enough: is the tested one of its last z, as precise as the
 * front door's? Costs as much as ten sweeps, so after a no some sweeps
 * pass before the question is asked again. */
static bool is_solved(pgs_work *work)
{
    const perp__lcp_problem *problem = work->common.problem;
    const double *z = work->sweeper.z;
    double residual = 0.0;

    if (!(work->residual <= problem->tol) || work->sweeps < work->next_test)
        return 0;
    work->next_test = work->sweeps + SWEEPS_BETWEEN_LOOKS;
    perp__multiply_doubled(problem->M, z, problem->q, work->high, work->low);
    for (int32_t i = 0; i < problem->n; i++)
        perp__raise_to(&residual, fabs(perp__mid(z[i], problem->lower[i], problem->upper[i],
                                                 work->high[i] + work->low[i])));
    return residual <= problem->tol;
}

/* Whether what is left is more than the limit leaves room for, at the rate since there were half as
 * many sweeps. It falls as sweeps go on: who is too slow now will not be in time. */
static bool is_too_slow(pgs_progress *progress, double tol, int64_t sweeps, int64_t limit)
{
    const double before = progress->looked;
    double needed;

    if (sweeps < progress->next_look)
        return 0;
    progress->next_look = 2 * sweeps;
    progress->looked = progress->best;
    if (!(before < INFINITY) || progress->best <= tol)
        return 0;
    needed = 0.5 * (double)sweeps * log(tol / progress->best) / log(progress->best / before);
    return !(needed >= 0.0 && needed <= (double)(limit - sweeps));
}

/* After the sweeps that make one step: adds the direction to z, within the bounds. */
static void gradient_after(conjugate *gradient, perp__sweeper *sweeper)
{
    const perp__rows *rows = &sweeper->rows;
    const double last = gradient->norm;
    double *z = sweeper->z, *direction = gradient->direction;
    double sum[4] = {0.0, 0.0, 0.0, 0.0}, beta;

    for (int32_t i = 0; i < rows->n; i++) { /* |z - before|^2, by four sums */
        const double step = z[i] - gradient->before[i];

        sum[i % 4] += step * step;
    }
    gradient->norm = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    beta = gradient->norm <= last ? gradient->norm / last : 0.0;
    if (!(beta > 0.0)) { /* the first step, or one that is longer than the last */
        for (int32_t i = 0; i < rows->n; i++)
            direction[i] = last > 0.0 ? 0.0 : z[i] - gradient->before[i];
        return;
    }
    for (int32_t i = 0; i < rows->n; i++) {
        const double lower = rows->slices[i / PERP__SLICE].lower[i % PERP__SLICE];
        const double add = beta * direction[i];

        direction[i] = add + (z[i] - gradient->before[i]);
        z[i] = perp__clamp(z[i] + add, lower, rows->upper[i]);
    }
}

/* One sweep or a few; returns how many. */
static int32_t advance(pgs_work *work, int64_t limit, double *residuals)
{
    const perp__lcp_problem *problem = work->common.problem;
    const bool pair = work->sweep == PERP_SWEEP_SYMMETRIC, is_odd = work->sweeps % 2 == 1;
    const size_t bytes = (size_t)problem->n * sizeof(double);
    const bool at_once =
        work->sweeper.rows.entries > ENTRIES_IN_CACHE && !pair && work->restarts == RESTARTS_MOST;
    const int64_t most = at_once ? PERP__SWEEPS_AT_ONCE : 1, left = limit - work->sweeps;
    const int32_t count = (int32_t)(most < left ? most : left);

    if (work->restarts < RESTARTS_MOST && !(pair && is_odd))
        memcpy(work->gradient.before, work->sweeper.z, bytes);
    if (pair && is_odd)
        perp__sweep_backward(&work->sweeper, residuals);
    else
        perp__sweep(&work->sweeper, count, residuals);
    /* The step of the conjugate gradients is one sweep, or one to and one fro. Where the residual
     * grows, they start again from the best z; where that happens often, they are left. */
    if (work->restarts < RESTARTS_MOST) {
        if (*residuals <= problem->tol)
            work->gradient.norm = 0.0; /* z may be the solution: do not move it */
        else if (!pair || is_odd)
            gradient_after(&work->gradient, &work->sweeper);
        if (!(*residuals <= GROWTH * work->remembered) && work->remembered < INFINITY) {
            memcpy(work->sweeper.z, work->best, bytes);
            memcpy(work->gradient.before, work->best, bytes);
            *residuals = work->remembered;
            work->gradient.norm = 0.0;
            work->restarts++;
        }
    }
    work->residual = residuals[count - 1];
    return count;
}

/* Whether the active set has been the same for long enough to ask the polish. */
static bool is_settled(pgs_work *work)
{
    const perp__rows *rows = &work->sweeper.rows;
    const double *z = work->sweeper.z;
    int32_t changes = 0;

    for (int32_t i = 0; i < rows->n; i++) {
        int8_t place = z[i] <= rows->slices[i / PERP__SLICE].lower[i % PERP__SLICE] ? PERP__AT_LOWER
                       : z[i] >= rows->upper[i]                                     ? PERP__AT_UPPER
                                                                                    : PERP__BETWEEN;

        changes += place != work->places[i];
        work->places[i] = place;
    }
    if (changes)
        work->changed = work->sweeps;
    return work->sweeps >= work->next_pause && work->sweeps - work->changed >= SWEEPS_UNCHANGED &&
           work->sweeps - work->changed >= work->sweeps / 3;
}

/* What the last sweeps mean: an outcome, or -1 to go on. */
static perp_outcome look_at(pgs_work *work, const double *residuals, int32_t count)
{
    const perp__lcp_problem *problem = work->common.problem;
    const double growth = work->restarts < RESTARTS_MOST ? INFINITY : PERP__DIVERGENCE;
    pgs_progress *progress = &work->progress;
    const int64_t before = work->sweeps;

    work->sweeps += count;
    if (is_solved(work))
        return PERP_OUTCOME_SOLVED;
    for (int32_t k = 0; k < count; k++) {
        const int64_t sweeps = before + k + 1;
        perp_outcome request;

        /* 1. Growth, or no progress from one window to the next. */
        if (residuals[k] < progress->best)
            progress->best = residuals[k];
        if (!(residuals[k] <= DBL_MAX) || residuals[k] > growth * progress->best)
            return PERP_OUTCOME_STALLED;
        if (sweeps % progress->window == 0) {
            if (progress->best > PERP__STAGNATION_FACTOR * progress->best_before)
                return PERP_OUTCOME_STALLED;
            progress->best_before = progress->best;
        }
        request = perp__lcp_tick(problem->control, sweeps, residuals[k]);
        if (request >= 0)
            return request;
    }
    /* 2. z is kept where the residual has halved: copies are few, and none comes back much too
     * late. */
    if (work->residual < 0.5 * work->remembered) {
        work->remembered = work->residual;
        memcpy(work->best, work->sweeper.z, (size_t)problem->n * sizeof(double));
    }
    return -1;
}

static perp_status solve(void *object, perp__lcp_iterate *iterate)
{
    pgs_work *work = object;
    const perp__lcp_problem *problem = work->common.problem;
    const int64_t limit =
        problem->iteration_limit > 0 ? problem->iteration_limit : PERP__SWEEPS_MOST;
    const size_t bytes = (size_t)problem->n * sizeof(double);
    pgs_progress *progress = &work->progress;
    perp_outcome outcome = -1;

    if (iterate->attempt == 0) { /* later ones go on after a pause */
        progress->best = progress->best_before = progress->looked = INFINITY;
        progress->next_look = problem->yields;
        progress->window =
            2 * (int64_t)problem->n > PERP__STAGNATION ? 2 * (int64_t)problem->n : PERP__STAGNATION;
        memcpy(work->best, iterate->z, bytes);
        memset(work->places, PERP__FIXED, (size_t)problem->n);
        work->remembered = work->residual = INFINITY;
        work->sweeps = work->next_test = work->next_pause = work->changed = 0;
        work->restarts = problem->settings->acceleration == PERP_ACCELERATION_CONJUGATE_GRADIENT
                             ? 0
                             : RESTARTS_MOST;
        work->gradient.norm = 0.0;
        read_problem(work, iterate->z);
    }
    iterate->has_places = 0;
    while (outcome < 0 && !iterate->paused && work->sweeps < limit) {
        double residuals[PERP__SWEEPS_AT_ONCE];
        int64_t look = work->sweeps / SWEEPS_BETWEEN_LOOKS;
        int32_t count = advance(work, limit, residuals);

        outcome = look_at(work, residuals, count);
        if (outcome < 0 && problem->yields &&
            is_too_slow(progress, problem->tol, work->sweeps, limit))
            break;
        if (problem->settings->polish && work->sweeps / SWEEPS_BETWEEN_LOOKS != look)
            iterate->paused = outcome < 0 && is_settled(work);
    }
    if (iterate->paused)
        work->next_pause = 4 * work->sweeps;
    iterate->outcome = outcome < 0 ? PERP_OUTCOME_ITERATION_LIMIT : outcome;
    iterate->far_off =
        problem->yields && !iterate->paused && iterate->outcome != PERP_OUTCOME_SOLVED;
    iterate->iterations = work->sweeps;
    memcpy(iterate->z,
           work->residual <= fmin(work->remembered, DBL_MAX) ? work->sweeper.z : work->best, bytes);
    return PERP_OK;
}

const perp__lcp_method perp__lcp_pgs = {PERP_LCP_PGS, sizeof(pgs_work), 1,     0,
                                        check,        layout,           solve, NULL};
