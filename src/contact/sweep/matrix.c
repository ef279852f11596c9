/* Sweeps over the rows of W, which is used as given. */
#include <math.h>

#include "contact/sweep/sweep.h"

double perp__sweep_row(const perp__sweep_work *work, int32_t i, const double *r)
{
    const double *W = work->entries;
    const int64_t start = work->entry_starts[i], end = work->entry_starts[i + 1];
    double sum[4] = {work->common.problem->q[i], 0.0, 0.0, 0.0};

    if (work->columns)
        for (int64_t k = start; k < end; k++)
            sum[k % 4] += W[k] * r[work->columns[k]];
    else
        for (int64_t k = start; k < end; k++)
            sum[(k - start) % 4] += W[k] * r[k - start];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

double perp__sweep_matrix(perp__sweep_work *work, int32_t backward)
{
    double most = 0.0;

    for (int32_t step = 0; step < work->constraints; step++) {
        const int32_t k = backward ? work->constraints - 1 - step : step;
        const int32_t first = work->rows[k], rows = work->rows[k + 1] - first;
        double u[PERP__ROWS_MOST], dr[PERP__ROWS_MOST], sum = 0.0;
        int32_t mode;

        for (int32_t i = 0; i < rows; i++)
            u[i] = perp__sweep_row(work, first + i, work->r);
        mode = perp__sweep_constraint(work, k, u, dr);
        if (k < work->common.problem->contacts)
            work->modes[k] = (int8_t)mode;
        for (int32_t i = 0; i < rows; i++)
            sum += dr[i] * dr[i];
        sum = work->weights[k] * sqrt(sum);
        if (!(sum <= most) && !isnan(most))
            most = sum;
    }
    return most;
}
