/* Which methods `auto` tries, from size, storage, diagonal, tolerance and time limit. The numbers
 * follow the tables in bench/results. */
#include "lcp/plan.h"

#include <math.h>

/* Largest n for which `auto` goes on to Lemke's method on a sparse matrix: n pivots from a cold
 * start take ten seconds there. */
#define PERP__LARGEST_PATH 8192
/* Above this `auto` tries Newton's method first on sparse problems: where the obstacle problem of
 * bench/lcp_obstacle.c takes the same time by both. */
#define PERP__SMALL_SPARSE 64

/* From this tolerance on a few sweeps are tried before anything is factored. */
#define PERP__ROUGH_TOLERANCE 1e-4
/* Below this size a direct solve costs less than the sweeps would. */
#define PERP__ROUGH_SIZE 100
/* Sweeps that cost about as much as half a direct solve: n / 16 passes over a dense matrix; a
 * sparse factorisation has no such law, and on the obstacle problems 64 sweeps are a fifth of it.
 */
#define PERP__ROUGH_SWEEPS_SPARSE 64

/* A direct solve's seconds on a slow machine; only ever compared with a time limit. */
#define PERP__SECONDS_DENSE 3e-10 /* times n^3 */
#define PERP__SECONDS_SPARSE 3e-7 /* times n^1.5: nested dissection on a plane grid */

static int32_t diagonal_is_positive(const perp_lcp_solver *solver)
{
    const perp__matrix *M = &solver->M;

    if (M->column_starts)
        return solver->block.has_positive_diagonal;
    for (int32_t j = 0; j < solver->n; j++)
        if (!(M->values[(size_t)j * (M->row_stride + M->column_stride)] > 0.0))
            return 0;
    return 1;
}

static int32_t add(perp__plan_step *steps, int32_t count, int32_t method)
{
    steps[count].method = method;
    steps[count].iteration_limit = 0;
    steps[count].share = 1.0;
    steps[count].rough = 0;
    return count + 1;
}

static int32_t time_is_short(const perp_lcp_solver *solver)
{
    const double n = solver->n;
    const double seconds = solver->M.column_starts ? PERP__SECONDS_SPARSE * n * sqrt(n)
                                                   : PERP__SECONDS_DENSE * n * n * n;

    return solver->settings.time_limit > 0.0 && solver->settings.time_limit < seconds;
}

/* Sweeps before anything is factored: where the tolerance is loose, because they may suffice; where
 * time is short, because a direct solve may end with nothing to show. */
static int32_t add_sweeps_first(const perp_lcp_solver *solver, perp__plan_step *steps)
{
    const int32_t is_rough =
        solver->settings.tol >= PERP__ROUGH_TOLERANCE && solver->n >= PERP__ROUGH_SIZE;

    if (!is_rough && !time_is_short(solver))
        return 0;
    add(steps, 0, PERP_LCP_PGS);
    steps[0].rough = 1;
    if (time_is_short(solver))
        steps[0].share = 0.5;
    else
        steps[0].iteration_limit =
            solver->M.column_starts ? PERP__ROUGH_SWEEPS_SPARSE : solver->n / 16;
    return 1;
}

/* Lemke is exact and processes any M; Newton's method comes first where a dense tableau would be
 * large beside the sparse matrix. */
static int32_t plan_auto(const perp_lcp_solver *solver, perp__plan_step *steps)
{
    const int32_t sparse = solver->M.column_starts != NULL && solver->n > PERP__SMALL_SPARSE;
    const int32_t sweeps = diagonal_is_positive(solver);
    int32_t count = sweeps ? add_sweeps_first(solver, steps) : 0;

    if (sparse && solver->block.kind != PERP__SPARSE_GENERAL)
        count = add(steps, count, PERP_LCP_ACTIVE_SET);
    if (sparse)
        count = add(steps, count, PERP_LCP_FISCHER);
    if (!sparse || solver->n <= PERP__LARGEST_PATH)
        count = add(steps, count, PERP_LCP_LEMKE);
    if (!sparse)
        count = add(steps, count, PERP_LCP_FISCHER);
    if (sweeps)
        count = add(steps, count, PERP_LCP_PGS);
    return count;
}

int32_t perp__lcp_plan(const perp_lcp_solver *solver, perp__plan_step *steps)
{
    return solver->settings.method == PERP_LCP_AUTO ? plan_auto(solver, steps)
                                                    : add(steps, 0, solver->settings.method);
}
