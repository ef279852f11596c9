#include "lcp/pgs/pgs.h"

#include <math.h>

#include "base/context.h"

static double diagonal_entry(const perp__matrix *M, int32_t i)
{
    if (!M->column_starts)
        return M->values[(size_t)i * (M->row_stride + M->column_stride)];
    for (int32_t p = M->column_starts[i]; p < M->column_starts[i + 1]; p++)
        if (M->row_indices[p] == i)
            return M->values[p];
    return 0.0;
}

static perp_status check_row(const perp__lcp_problem *problem, int32_t i)
{
    double diagonal, q = problem->q[i];

    if (!(problem->lower[i] < problem->upper[i]))
        return PERP_OK;
    diagonal = diagonal_entry(problem->M, i);
    if (diagonal > 0.0)
        return PERP_OK;
    if (problem->row_norms[i] > 0.0)
        return perp__fail(problem->context, PERP_ERROR_ARGUMENT,
                          "M(%d,%d) = %g: pgs needs a positive diagonal", (int)i, (int)i, diagonal);
    if ((q > 0.0 && problem->lower[i] == -INFINITY) || (q < 0.0 && problem->upper[i] == INFINITY))
        return perp__fail(problem->context, PERP_ERROR_ARGUMENT,
                          "row %d of M is 0 and q[%d] is not: w[%d] = q[%d] for every z", (int)i,
                          (int)i, (int)i, (int)i);
    return PERP_OK;
}

perp_status perp__pgs_check(const perp__lcp_problem *problem)
{
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < problem->n && status == PERP_OK; i++)
        status = check_row(problem, i);
    return status;
}

static int32_t moves(const perp__lcp_problem *problem, int32_t i)
{
    return problem->lower[i] < problem->upper[i] && problem->row_norms[i] > 0.0;
}

/* The matrix is kept from solve to solve, until its set-up or a setting changes. */
static int32_t is_read(const perp__pgs_work *work)
{
    const perp__lcp_problem *problem = work->common.problem;

    if (work->relaxation != problem->settings->relaxation ||
        work->scaling != problem->settings->scaling || work->sweep != problem->settings->sweep)
        return 0;
    for (int32_t i = 0; i < problem->n; i++)
        if (moves(problem, i) != (work->step[i] != 0.0))
            return 0;
    return 1;
}

static void read_matrix(perp__pgs_work *work)
{
    const perp__lcp_problem *problem = work->common.problem;

    work->relaxation = problem->settings->relaxation;
    work->scaling = problem->settings->scaling;
    work->sweep = problem->settings->sweep;
    for (int32_t i = 0; i < problem->n; i++) {
        double factor = problem->factors[i];

        work->step[i] = moves(problem, i)
                            ? work->relaxation / (diagonal_entry(problem->M, i) * (factor * factor))
                            : 0.0;
    }
    perp__rows_read(&work->sweeper.rows, problem, work->step, work->sweep == PERP_SWEEP_SYMMETRIC);
}

/* q and the bounds; a row of zeros is held where its w = q wants it. */
void perp__pgs_read(perp__pgs_work *work, const double *z)
{
    const perp__lcp_problem *problem = work->common.problem;
    perp__sweeper *sweeper = &work->sweeper;

    if (!is_read(work))
        read_matrix(work);
    sweeper->keep = 1.0 - work->relaxation;
    for (int32_t i = 0; i < problem->n; i++) {
        perp__slice *slice = &sweeper->rows.slices[i / PERP__SLICE];
        const int32_t row = i % PERP__SLICE;
        double q = problem->q[i];

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
