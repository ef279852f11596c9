/* Projected Gauss-Seidel with over-relaxation (Cryer, SIAM J. Control 9 (1971) 385; for bounds and
 * unsymmetric M: Cottle, Pang & Stone (1992), section 5.2): row by row,
 *
 *   w_i = (S z)_i + q_i,    z_i := mid(l_i, u_i, z_i - omega w_i / S_ii),
 *
 * with the newest z throughout. Converges for symmetric positive definite S and omega in (0, 2),
 * and for diagonally dominant S and omega <= 1, linearly; otherwise it may stall or diverge, and
 * says so. The residual |mid(z_i - l_i, z_i - u_i, w_i)| of a sweep is read in passing, at the
 * moment each row is updated; a sweep that claims convergence is confirmed by a pass over fixed z.
 */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "lcp/method.h"
#include "lcp/pgs_rows.h"

/* A residual this much above the best one seen is divergence. Where S is symmetric and positive
 * definite the residual can grow by the square root of its condition number at most, 1e6 for 1e12;
 * such a problem would stagnate all the same. */
#define DIVERGENCE 1e6

/* Stagnation: the best residual fell by less than 1 % over max(1000, 2 n) sweeps. The next digit
 * would cost more than 2e5 sweeps. 2 n, because news travels against the sweep's direction by one
 * row a sweep, and a residual may be flat until it has arrived. */
#define STAGNATION_SWEEPS 1000
#define STAGNATION_FACTOR 0.99

/* Default limit: 10000 sweeps, less where they would touch more than 1e10 entries, at least 200. */
#define SWEEPS_MOST 10000
#define SWEEPS_LEAST 200
#define ENTRIES_MOST 1e10

typedef struct pgs_work {
    perp__lcp_work common;
    perp__rows S;
    double *step; /* omega / S_ii; 0 in fixed rows */
    double *best; /* the z of the smallest residual seen */
} pgs_work;

static double diagonal_entry(const perp__matrix *M, int32_t i)
{
    if (!M->column_starts)
        return M->values[(size_t)i * (M->row_stride + M->column_stride)];
    for (int32_t p = M->column_starts[i]; p < M->column_starts[i + 1]; p++)
        if (M->row_indices[p] == i)
            return M->values[p];
    return 0.0;
}

static perp_status check(const perp__lcp_problem *problem)
{
    for (int32_t i = 0; i < problem->n; i++) {
        double diagonal = diagonal_entry(problem->M, i);

        if (problem->lower[i] < problem->upper[i] && !(diagonal > 0.0))
            return perp__fail(problem->context, PERP_ERROR_ARGUMENT,
                              "M(%d,%d) = %g: pgs needs a positive diagonal", (int)i, (int)i,
                              diagonal);
    }
    return PERP_OK;
}

static void layout(perp__arena *arena, void *object)
{
    pgs_work *work = object;
    const perp__lcp_problem *problem = work->common.problem;
    size_t n = (size_t)problem->n;

    perp__rows_layout(arena, &work->S, problem);
    work->step = perp__arena_take(arena, n, sizeof(double));
    work->best = perp__arena_take(arena, n, sizeof(double));
}

static void read_problem(pgs_work *work)
{
    const perp__lcp_problem *problem = work->common.problem;

    perp__rows_read(&work->S, problem);
    for (int32_t i = 0; i < problem->n; i++) {
        int32_t fixed = !(problem->lower[i] < problem->upper[i]);

        work->step[i] = fixed ? 0.0 : problem->settings->relaxation / work->S.diagonal[i];
    }
}

/* One sweep; returns the residual met on the way, +inf if a number overflowed.
 *
 * Row i waits for z_(i-1): that chain, not the arithmetic, is what a sweep costs. So z_(i-1) stays
 * in a register and enters last, in z_i - omega w_i / S_ii as well as in w_i, and the projection is
 * a branch, which is predicted, and not a minimum and a maximum, which are waited for. */
static double sweep(const pgs_work *work, double *z)
{
    const perp__lcp_problem *problem = work->common.problem;
    const double *q = problem->q, *lower = problem->lower, *upper = problem->upper;
    double residual = 0.0, previous = 0.0;
    int32_t finite = 1;

    for (int32_t i = 0; i < problem->n; i++) {
        double step = work->step[i], before = work->S.before[i];
        double w, below, above, r, moved;

        if (step != 0.0) {
            w = perp__row_times(&work->S, i, z, q[i]);
            moved = (z[i] - step * w) - step * before * previous;
            finite &= fabs(moved) <= DBL_MAX;
            w += before * previous;
            below = z[i] - lower[i];
            above = z[i] - upper[i];
            r = w > above ? w : above;
            r = fabs(r < below ? r : below);
            residual = r > residual ? r : residual;
            if (moved < lower[i])
                moved = lower[i];
            else if (moved > upper[i])
                moved = upper[i];
            z[i] = moved;
        }
        previous = z[i];
    }
    return finite ? residual : INFINITY;
}

static double true_residual(const pgs_work *work, const double *z)
{
    const perp__lcp_problem *problem = work->common.problem;
    double residual = 0.0, previous = 0.0;

    for (int32_t i = 0; i < problem->n; i++) {
        double w = perp__row_times(&work->S, i, z, problem->q[i]) + work->S.before[i] * previous;
        double r = fabs(perp__mid(z[i], problem->lower[i], problem->upper[i], w));

        if (!(r <= residual) && !isnan(residual)) /* NaN stays */
            residual = r;
        previous = z[i];
    }
    return residual;
}

static int64_t sweep_limit(const pgs_work *work)
{
    const perp__lcp_problem *problem = work->common.problem;
    double n = problem->n;
    double entries = work->S.columns ? 2.0 * n + work->S.starts[problem->n] : n * n;
    double sweeps = ENTRIES_MOST / (entries + 1.0);

    if (problem->iteration_limit > 0)
        return problem->iteration_limit;
    return sweeps > SWEEPS_MOST    ? SWEEPS_MOST
           : sweeps < SWEEPS_LEAST ? SWEEPS_LEAST
                                   : (int64_t)sweeps;
}

/* What makes pgs give up: growth, or no progress from one window of sweeps to the next. */
typedef struct pgs_progress {
    double best;
    double best_before; /* at the end of the last window */
    int64_t window;
} pgs_progress;

static int32_t hopeless(pgs_progress *progress, double residual, int64_t sweeps)
{
    if (!(residual <= DBL_MAX) || residual > DIVERGENCE * progress->best)
        return 1;
    if (sweeps % progress->window != 0)
        return 0;
    if (progress->best > STAGNATION_FACTOR * progress->best_before)
        return 1;
    progress->best_before = progress->best;
    return 0;
}

static perp_status solve(void *object, perp__lcp_iterate *iterate)
{
    pgs_work *work = object;
    const perp__lcp_problem *problem = work->common.problem;
    size_t size = (size_t)problem->n * sizeof(double);
    int64_t limit;
    pgs_progress progress = {INFINITY, INFINITY, STAGNATION_SWEEPS};

    read_problem(work);
    limit = sweep_limit(work);
    if (2 * (int64_t)problem->n > progress.window)
        progress.window = 2 * (int64_t)problem->n;
    memcpy(work->best, iterate->z, size);
    iterate->has_places = 0;
    iterate->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    for (int64_t sweeps = 1; sweeps <= limit; sweeps++) {
        double residual = sweep(work, iterate->z);
        perp_outcome request;

        iterate->iterations = sweeps;
        if (residual <= problem->settings->tol &&
            true_residual(work, iterate->z) <= problem->settings->tol) {
            iterate->outcome = PERP_OUTCOME_SOLVED;
            return PERP_OK;
        }
        if (residual < progress.best) {
            progress.best = residual;
            memcpy(work->best, iterate->z, size);
        }
        if (hopeless(&progress, residual, sweeps)) {
            iterate->outcome = PERP_OUTCOME_STALLED;
            break;
        }
        request = perp__lcp_tick(problem->control, sweeps, residual);
        if (request >= 0) {
            iterate->outcome = request;
            break;
        }
    }
    memcpy(iterate->z, work->best, size);
    return PERP_OK;
}

const perp__lcp_method perp__lcp_pgs = {PERP_LCP_PGS, sizeof(pgs_work), 1,     NULL,
                                        check,        layout,           solve, NULL};
