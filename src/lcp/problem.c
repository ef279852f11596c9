/* What methods share: the scaled matrix. */
#include <string.h>

#include "lcp/method.h"

int32_t perp__diagonal_is_positive(const perp__matrix *M)
{
    for (int32_t i = 0; i < M->rows; i++)
        if (!(M->values[(size_t)i * (M->row_stride + M->column_stride)] > 0.0))
            return 0;
    return 1;
}

/* column[i] := row[i stride] (d_i d_j), i < count. */
static inline void scale_strip(const double *row, size_t stride, const double *d, double d_j,
                               double *column, size_t count)
{
    for (size_t i = 0; i < count; i++)
        column[i] = row[i * stride] * (d[i] * d_j);
}

/* A strip of rows at a time, so that what is read and what is written stay in the cache until their
 * lines are complete. */
static void dense_from(const perp__lcp_problem *problem, double sign, double *dense, size_t ld)
{
    enum { ROWS = 16 };
    const size_t n = (size_t)problem->n, stride = problem->M->row_stride;
    const size_t next = problem->M->column_stride;
    const double *d = problem->factors;

    for (size_t begin = 0; begin < n; begin += ROWS)
        for (size_t j = 0; j < n; j++) {
            const double *from = problem->M->values + begin * stride + j * next;
            double *column = dense + j * ld + begin;

            if (begin + ROWS <= n) /* the compiler knows its length */
                scale_strip(from, stride, d + begin, sign * d[j], column, ROWS);
            else
                scale_strip(from, stride, d + begin, sign * d[j], column, n - begin);
        }
}

void perp__lcp_dense(const perp__lcp_problem *problem, double sign, double *dense,
                     size_t leading_dimension)
{
    const perp__matrix *M = problem->M;
    const double *d = problem->factors;

    if (!M->column_starts)
        dense_from(problem, sign, dense, leading_dimension);
    for (int32_t j = 0; M->column_starts && j < problem->n; j++) {
        double *column = dense + (size_t)j * leading_dimension;
        const double d_j = sign * d[j];

        memset(column, 0, (size_t)problem->n * sizeof *column);
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            column[M->row_indices[k]] = M->values[k] * (d[M->row_indices[k]] * d_j);
    }
}

void perp__lcp_affine(const perp__lcp_problem *problem, const double *z, double *product, double *w)
{
    const double *d = problem->factors;

    for (int32_t i = 0; i < problem->n; i++)
        product[i] = d[i] * z[i];
    perp__multiply(problem->M, product, w);
    for (int32_t i = 0; i < problem->n; i++)
        w[i] = d[i] * w[i] + problem->q[i];
}
