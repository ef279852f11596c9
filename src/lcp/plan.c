/* Which methods `auto` tries, in which order: from size, storage, diagonal, structure, tolerance
 * and time limit. The numbers follow the tables in bench/results. */
#include <math.h>

#include "lcp/solver.h"

/* The largest n for which Lemke's method is tried on a sparse matrix: a path of n pivots takes half
 * a minute there. */
#define PERP__LARGEST_PATH 16384

/* So many sweeps cost a fifth of a factorisation on obstacle problems, and so many less than active
 * sets by LU, of 100 rows or 1e5. On a dense matrix n / 16 sweeps cost half of a factorisation. */
#define PERP__ROUGH_SWEEPS_SPARSE 64
#define PERP__SWEEPS_OF_LU 512
/* After so many sweeps the rate at which the residual falls tells whether the rest will do; where a
 * flow carries q along, it shows after as many as rough sweeps take. */
#define PERP__FIRST_LOOK 4

static int32_t add(perp__plan_step *steps, int32_t count, int32_t method)
{
    steps[count] = (perp__plan_step){.method = method, .share = 1.0};
    return count + 1;
}

/* Sweeps before anything is factored: where the diagonal promises that few suffice, or, where M
 * would be factored by LU, the first sweeps do; where the tolerance is loose, because they may
 * suffice; where time is short, because a direct solve may end with nothing to show. */
static bool add_sweeps_first(const perp_lcp_solver *solver, perp__plan_step *steps)
{
    const bool is_sparse = solver->S.column_starts != NULL;
    const bool is_tridiagonal = is_sparse && solver->block.kind == PERP__SPARSE_TRIDIAGONAL;
    const bool is_limited = solver->settings.time_limit > 0.0;
    const bool may_promise = is_sparse && solver->n >= PERP__LARGE_MATRIX;
    const bool is_dear = is_sparse && solver->block.kind == PERP__SPARSE_GENERAL;
    double share = 0.0;

    add(steps, 0, PERP_LCP_PGS);
    steps[0].share = is_limited ? 0.5 : 1.0;
    /* A sweep over a diagonally dominant problem leaves the rows' off-diagonal share at most, in
     * the mean its square. */
    for (int32_t i = 0; i < solver->n && may_promise; i++)
        share = fmax(share, solver->row_norms[i] / perp__entry(&solver->S, i, i) - 1.0);
    if (is_dear || (may_promise && share < 1.0 &&
                    log(0.1 * solver->settings.tol) / (2.0 * log(fmax(share, 0.1))) <
                        PERP__ROUGH_SWEEPS_SPARSE)) {
        steps[0].yields = is_dear ? PERP__ROUGH_SWEEPS_SPARSE : 0;
        steps[0].iteration_limit = is_dear ? PERP__SWEEPS_OF_LU : PERP__ROUGH_SWEEPS_SPARSE;
        return 1;
    }
    if (solver->n < PERP__COARSEST || is_tridiagonal ||
        (solver->settings.tol < PERP__ROUGH_TOLERANCE && !is_limited))
        return 0;
    steps[0].rough = 1;
    steps[0].yields = PERP__FIRST_LOOK;
    steps[0].iteration_limit = is_sparse ? PERP__ROUGH_SWEEPS_SPARSE : solver->n / 16;
    return 1;
}

int32_t perp__make_plan(const perp_lcp_solver *solver, perp__plan_step *steps)
{
    const perp__sparse_block *block = &solver->block;
    const bool is_sparse = solver->S.column_starts != NULL;
    const bool sweeps = block->has_positive_diagonal;
    const bool path = !is_sparse || solver->n <= PERP__LARGEST_PATH;
    int32_t count;

    if (solver->settings.method != PERP_LCP_AUTO)
        return add(steps, 0, solver->settings.method);
    count = sweeps ? add_sweeps_first(solver, steps) : 0;
    /* 1. Active sets first where the signs promise that they settle. Else the index set of sweeps
     * may settle long before their residual tells: as long as one of the factorisations takes that
     * come next. */
    if (is_sparse &&
        (block->kind != PERP__SPARSE_GENERAL || block->is_nearly_z || block->has_z_signs))
        count = add(steps, count, PERP_LCP_ACTIVE_SET);
    else if (is_sparse && sweeps)
        steps[count++] = (perp__plan_step){.method = PERP_LCP_PGS, .share = 0.5, .as_lu = 1};
    /* 2. Lemke is exact and processes any M. Newton's method comes before it where a dense tableau
     * would be large beside the sparse matrix; but without a positive diagonal, as friction makes
     * matrices, Newton's equations are near singular, and fill in. */
    if (path && !(is_sparse && sweeps))
        count = add(steps, count, PERP_LCP_LEMKE);
    count = add(steps, count, PERP_LCP_FISCHER);
    if (path && is_sparse && sweeps)
        count = add(steps, count, PERP_LCP_LEMKE);
    return sweeps ? add(steps, count, PERP_LCP_PGS) : count;
}
