/* Sweeps in the space of bodies: u_k = P_k y + q_k, y += P_k' dr. */
#include <math.h>

#include "contact/sweep/sweep.h"

static double visit(perp__sweep_work *work, const perp__bodies *b, int32_t k)
{
    const int32_t first = work->rows[k], rows = work->rows[k + 1] - first, width = b->width;
    const int64_t stride = work->stride;
    double u[PERP__ROWS_MOST], dr[PERP__ROWS_MOST], sum = 0.0;
    int32_t mode;

    for (int32_t i = 0; i < rows; i++)
        u[i] = work->common.problem->q[first + i] + b->compliance[first + i] * work->r[first + i];
    for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
        const double *p = b->values + b->piece_values[piece];
        const double *y = work->y + b->piece_blocks[piece] * stride;

        for (int32_t i = 0; i < rows; i++, p += width)
            for (int32_t j = 0; j < width; j++)
                u[i] += p[j] * y[j];
    }
    mode = perp__sweep_constraint(work, k, u, dr);
    if (k < b->contacts)
        work->modes[k] = (int8_t)mode;
    for (int32_t i = 0; i < rows; i++)
        sum += dr[i] * dr[i];
    if (sum == 0.0)
        return 0.0;
    for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
        const double *p = b->values + b->piece_values[piece];
        double *y = work->y + b->piece_blocks[piece] * stride;

        for (int32_t i = 0; i < rows; i++, p += width)
            for (int32_t j = 0; j < width; j++)
                y[j] += p[j] * dr[i];
    }
    return work->weights[k] * work->weights[k] * sum;
}

double perp__sweep_bodies(perp__sweep_work *work, int32_t backward)
{
    const perp__bodies *bodies = work->common.problem->bodies;
    const int32_t step = backward ? -1 : 1, stop = backward ? -1 : work->constraints;
    int32_t k = backward ? work->constraints - 1 : 0;
    double most = 0.0;

    while (k != stop) {
        int32_t end = k;
        double change;

        while (end != stop && end < bodies->contacts && work->packs[end])
            end += step;
        if (end != k) {
            perp__sweep_packed(work, k, end, &most);
            k = end;
            continue;
        }
        change = visit(work, bodies, k);
        if (!(change <= most) && !isnan(most))
            most = change;
        k += step;
    }
    return sqrt(most);
}
