/* Which methods `auto` tries, in which order: from size, storage, diagonal, structure, tolerance
 * and time limit. The numbers follow the tables in bench/results. */
#include <math.h>

#include "lcp/solver.h"

/* Largest n for which `auto` goes on to Lemke's method on a sparse matrix: n pivots from a cold
 * start take half a minute there. */
#define PERP__LARGEST_PATH 16384
/* Above this `auto` tries Newton's method first on sparse problems: where the obstacle problem of
 * bench/lcp_obstacle.c takes the same time by both. */
#define PERP__SMALL_SPARSE 64
/* From this size on it pays to ask whether sweeps alone will do. */
#define PERP__LARGE_SPARSE 1000

/* Below this size a direct solve costs less than the sweeps would. */
#define PERP__ROUGH_SIZE 100
/* Sweeps that cost about as much as half a direct solve: n / 16 passes over a dense matrix; a
 * sparse factorisation has no such law, and on obstacle problems 64 sweeps are a fifth of it. */
#define PERP__ROUGH_SWEEPS_SPARSE 64

/* What an attempt of Newton's method on a dense matrix may take where pivoting has failed: that
 * many n^3, some seconds, and some more steps. */
#define PERP__NEWTON_WORK 1e11
#define PERP__NEWTON_STEPS 30

/* A direct solve's seconds on a slow machine, compared with a time limit and with sweeps. */
#define PERP__SECONDS_DENSE 3e-10      /* times n^3 */
#define PERP__SECONDS_SPARSE 3e-7      /* times n^1.5: nested dissection on a plane grid */
#define PERP__SECONDS_BAND 1e-9        /* times n and the bandwidth squared */
#define PERP__STEPS_GENERAL 10.0       /* times the last, without symmetry */
#define PERP__SECONDS_GRID 1e-5        /* times n: nested iteration with multigrid */
#define PERP__SECONDS_TRIDIAGONAL 1e-7 /* times n */
#define PERP__SECONDS_SWEEP 4e-9       /* of a sweep, times the entries */
#define PERP__MOST_SWEEPS 500
/* What sweeps may take of a direct solve, and what of it before their rate counts: where q is
 * carried along with a flow, it shows late. */
#define PERP__SHARE_SWEEPS 0.3
#define PERP__SHARE_PATIENCE 0.1
/* Else the rate of sweeps counts after so many. */
#define PERP__FIRST_LOOK 4

static int32_t add(perp__plan_step *steps, int32_t count, int32_t method)
{
    steps[count].method = method;
    steps[count].iteration_limit = 0;
    steps[count].share = 1.0;
    steps[count].leads = steps[count].rough = 0;
    return count + 1;
}

static double bandwidth(const perp__matrix *M)
{
    int32_t widest = 0;

    for (int32_t j = 0; j < M->columns; j++) {
        const int32_t first = M->column_starts[j], end = M->column_starts[j + 1];

        if (first < end && j - M->row_indices[first] > widest)
            widest = j - M->row_indices[first];
        if (first < end && M->row_indices[end - 1] - j > widest)
            widest = M->row_indices[end - 1] - j;
    }
    return widest;
}

/* What a direct solve takes, by the structure of the matrix. */
static double direct_seconds(const perp_lcp_solver *solver)
{
    const double n = solver->n;
    double band;

    if (!solver->M.column_starts)
        return PERP__SECONDS_DENSE * n * n * n;
    if (solver->block.kind == PERP__SPARSE_TRIDIAGONAL)
        return PERP__SECONDS_TRIDIAGONAL * n;
    if (solver->block.suits_grid)
        return PERP__SECONDS_GRID * n;
    band = bandwidth(&solver->M);
    band = PERP__SECONDS_BAND * n * (1.0 + band * band);
    if (solver->block.kind == PERP__SPARSE_GENERAL)
        band *= PERP__STEPS_GENERAL;
    return fmin(PERP__SECONDS_SPARSE * n * sqrt(n), band);
}

/* Sweeps after which the residual of a diagonally dominant problem is below tol: each takes the
 * largest error to its rows' off-diagonal share at most, and in the mean to the square of that.
 * INFINITY where nothing is promised. */
static double sweeps_needed(const perp_lcp_solver *solver)
{
    double share = 0.0;

    for (int32_t i = 0; i < solver->n; i++) {
        const double diagonal =
            perp__diagonal_entry(&solver->M, i) * solver->factors[i] * solver->factors[i];

        share = fmax(share, solver->row_norms[i] / diagonal - 1.0);
    }
    return share < 1.0 ? log(0.1 * solver->settings.tol) / (2.0 * log(fmax(share, 0.1))) : INFINITY;
}

/* Sweeps before anything is factored: where the diagonal promises that few suffice; where the
 * tolerance is loose, because they may suffice; where time is short, because a direct solve may end
 * with nothing to show. */
static int32_t add_sweeps_first(const perp_lcp_solver *solver, perp__plan_step *steps)
{
    const int32_t is_sparse = solver->M.column_starts != NULL;
    const double direct = direct_seconds(solver);
    const int32_t is_short =
        solver->settings.time_limit > 0.0 && solver->settings.time_limit < direct;
    const int32_t is_loose = solver->settings.tol >= PERP__ROUGH_TOLERANCE;
    const int32_t is_rough = is_loose && solver->n >= PERP__ROUGH_SIZE &&
                             !(is_sparse && solver->block.kind == PERP__SPARSE_TRIDIAGONAL);
    /* the LU of a matrix without symmetry costs so much that sweeps may always be tried */
    const int32_t is_dear =
        is_sparse && solver->block.kind == PERP__SPARSE_GENERAL && solver->n > PERP__SMALL_SPARSE;
    const double n = solver->n;
    const double worth = /* sweeps that cost as much */
        direct /
        (PERP__SECONDS_SWEEP * (is_sparse ? solver->M.column_starts[solver->n] + 1.0 : n * n));

    add(steps, 0, PERP_LCP_PGS);
    if (is_sparse && solver->n >= PERP__LARGE_SPARSE) {
        const double sweeps = sweeps_needed(solver);

        if (sweeps <= PERP__MOST_SWEEPS && sweeps < PERP__SHARE_SWEEPS * worth) {
            steps[0].iteration_limit = (int64_t)sweeps + 1;
            return 1;
        }
    }
    steps[0].rough = is_loose || is_short;
    steps[0].leads = PERP__FIRST_LOOK;
    steps[0].iteration_limit = is_dear || is_short ? (int64_t)(PERP__SHARE_SWEEPS * worth) + 1
                               : is_sparse         ? PERP__ROUGH_SWEEPS_SPARSE
                                                   : solver->n / 16;
    if (is_dear)
        steps[0].leads += (int32_t)(PERP__SHARE_PATIENCE * worth);
    if (is_short) { /* whatever their rate */
        steps[0].share = 0.5;
        steps[0].leads = 0;
    }
    return is_rough || is_short || is_dear;
}

/* Active sets first where the signs promise that they settle. Pivoting before Newton's method on
 * sparse matrices without a positive diagonal, as friction makes them: there Newton's equations
 * are near singular, and fill in. Else Newton's method first where a dense tableau would be large
 * beside the sparse matrix. */
static int32_t plan_sparse(const perp_lcp_solver *solver, perp__plan_step *steps, int32_t count)
{
    const int32_t path = solver->n <= PERP__LARGEST_PATH;
    const int32_t path_first = path && !solver->block.has_positive_diagonal;

    if (solver->block.kind != PERP__SPARSE_GENERAL || solver->block.is_nearly_z ||
        solver->block.has_z_signs)
        count = add(steps, count, PERP_LCP_ACTIVE_SET);
    if (path_first)
        count = add(steps, count, PERP_LCP_LEMKE);
    count = add(steps, count, PERP_LCP_FISCHER);
    return path && !path_first ? add(steps, count, PERP_LCP_LEMKE) : count;
}

/* Lemke is exact and processes any M. */
static int32_t plan_auto(const perp_lcp_solver *solver, perp__plan_step *steps)
{
    const int32_t sparse = solver->M.column_starts != NULL && solver->n > PERP__SMALL_SPARSE;
    const int32_t sweeps = (solver->M.column_starts ? solver->block.has_positive_diagonal
                                                    : perp__diagonal_is_positive(&solver->M));
    int32_t count = sweeps ? add_sweeps_first(solver, steps) : 0;

    if (sparse) {
        count = plan_sparse(solver, steps, count);
    } else {
        const double n = solver->n;

        count = add(steps, count, PERP_LCP_LEMKE);
        count = add(steps, count, PERP_LCP_FISCHER);
        steps[count - 1].iteration_limit =
            (int64_t)(PERP__NEWTON_WORK / (n * n * n + 1.0)) + PERP__NEWTON_STEPS;
    }
    return sweeps ? add(steps, count, PERP_LCP_PGS) : count;
}

int32_t perp__make_plan(const perp_lcp_solver *solver, perp__plan_step *steps)
{
    return solver->settings.method == PERP_LCP_AUTO ? plan_auto(solver, steps)
                                                    : add(steps, 0, solver->settings.method);
}
