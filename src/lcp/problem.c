/* What methods share: the scaled matrix, projection, the stop requests. */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "lcp/method.h"

double perp__clamp(double z, double lower, double upper)
{
    return z < lower ? lower : z > upper ? upper : z;
}

double perp__mid(double z, double lower, double upper, double w)
{
    double above = z - lower; /* >= 0 >= below for z within its bounds */
    double below = z - upper;
    double least = above < w ? above : w;

    return below > least ? below : least;
}

perp_outcome perp__lcp_tick(perp__lcp_control *control, int64_t iterations, double residual)
{
    perp_lcp_progress progress;
    int32_t answer;

    if (control->monitor) {
        memset(&progress, 0, sizeof progress);
        progress.struct_size = sizeof progress;
        progress.method = control->method;
        progress.iterations = iterations;
        progress.residual = residual;
        answer = control->monitor(&progress, control->monitor_user);
        if (answer < 0)
            control->aborted = 1;
        if (answer != 0)
            return PERP_OUTCOME_STOPPED;
    }
    if (control->deadline > 0.0 && perp__now() > control->deadline)
        return PERP_OUTCOME_TIME_LIMIT;
    return -1;
}

static void dense_from_csc(const perp__lcp_problem *problem, double *dense, size_t ld)
{
    const perp__matrix *M = problem->M;
    const double *d = problem->factors;
    int32_t j, k;

    for (j = 0; j < problem->n; j++) {
        double *column = dense + (size_t)j * ld;

        memset(column, 0, (size_t)problem->n * sizeof *column);
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            column[M->row_indices[k]] = M->values[k] * (d[M->row_indices[k]] * d[j]);
    }
}

void perp__lcp_dense(const perp__lcp_problem *problem, double *dense, size_t leading_dimension)
{
    const perp__matrix *M = problem->M;
    const double *d = problem->factors;
    int32_t i, j;

    if (M->column_starts) {
        dense_from_csc(problem, dense, leading_dimension);
        return;
    }
    for (j = 0; j < problem->n; j++) {
        double *column = dense + (size_t)j * leading_dimension;
        const double *from = M->values + (size_t)j * M->column_stride;

        for (i = 0; i < problem->n; i++)
            column[i] = from[(size_t)i * M->row_stride] * (d[i] * d[j]);
    }
}
