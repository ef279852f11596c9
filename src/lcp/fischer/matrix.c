#include "lcp/fischer/fischer.h"

#include <math.h>

#include "lcp/active_set/active_set.h"
#include "linalg/blas.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/sparse_block.h"

static int32_t is_sparse(const perp__fischer_matrix *matrix)
{
    return matrix->S.column_starts != NULL;
}

void perp__fischer_matrix_layout(perp__arena *arena, perp__fischer_matrix *matrix,
                                 const perp__lcp_problem *problem)
{
    const size_t n = (size_t)problem->n;

    matrix->is_read = 0;
    matrix->block = perp__arena_take(arena, problem->M->column_starts ? 0 : n * n, sizeof(double));
    matrix->packed = perp__arena_take(arena, n, sizeof(double));
    PERP__INTEGERS(arena, n, &matrix->active, &matrix->pivots);
}

void perp__fischer_matrix_read(perp__fischer_matrix *matrix, const perp__lcp_problem *problem)
{
    matrix->problem = problem;
    matrix->S = *problem->M;
    matrix->count = 0;
    if (!matrix->is_read)
        matrix->symmetric = is_sparse(matrix)
                                ? perp__has_symmetric_entries(&matrix->S, matrix->active, 0.0)
                                : perp__is_symmetric(problem);
    matrix->is_read = 1;
}

PERP__MULTIVERSION(add_one, (size_t n, const double *a, double x, double *restrict y), (n, a, x, y))
{
    for (size_t i = 0; i < n; i++)
        y[i] += a[i] * x;
}

void perp__fischer_matrix_add_column(const perp__fischer_matrix *matrix, int32_t j, double x,
                                     double *y)
{
    const perp__matrix *S = &matrix->S;

    if (!is_sparse(matrix)) {
        add_one((size_t)S->rows, S->values + (size_t)j * S->column_stride, x, y);
        return;
    }
    for (int32_t k = S->column_starts[j]; k < S->column_starts[j + 1]; k++)
        y[S->row_indices[k]] += S->values[k] * x;
}

static void fill_dense(perp__fischer_matrix *matrix, const double *weights)
{
    const int32_t *active = matrix->active;
    const size_t count = (size_t)matrix->count;
    const int32_t whole = matrix->by == PERP__FISCHER_LU;

    for (size_t c = 0; c < count; c++) {
        const double *from = matrix->S.values + (size_t)active[c] * matrix->S.column_stride;
        double *column = matrix->block + c * count;

        for (size_t r = whole ? 0 : c; r < count; r++)
            column[r] = from[active[r]];
        column[c] += weights[active[c]];
    }
}

perp_status perp__fischer_matrix_factor(perp__fischer_matrix *matrix, const double *weights,
                                        int32_t uniform)
{
    perp__sparse_block *block = matrix->problem->block;
    const int32_t *active = matrix->active;
    int32_t count = 0, stride, regular = 0;

    for (int32_t i = 0; i < matrix->problem->n; i++)
        if (isfinite(weights[i]))
            matrix->active[count++] = i;
    matrix->count = count;
    stride = count > 0 ? count : 1;
    if (is_sparse(matrix)) {
        matrix->by = PERP__FISCHER_SHARED;
        return uniform ? perp__sparse_block_factor(block, active, count,
                                                   count > 0 ? weights[active[0]] : 0.0)
                       : perp__sparse_block_factor_with(block, active, count, weights);
    }
    if (!perp__lcp_may_factor(matrix->problem->control, count, matrix->symmetric, matrix->S.rows))
        return PERP__FACTOR_SINGULAR;
    if (matrix->symmetric) {
        matrix->by = PERP__FISCHER_CHOLESKY;
        fill_dense(matrix, weights);
        regular = perp__cholesky_factor(count, matrix->block, stride) == 0;
    }
    if (!regular) {
        matrix->by = PERP__FISCHER_LU;
        fill_dense(matrix, weights);
        regular = perp__lu_factor(count, matrix->block, stride, matrix->pivots) == 0;
    }
    for (size_t k = 0; k < (size_t)count; k++) /* overflow is of no more use than a zero pivot */
        regular = regular && isfinite(matrix->block[k * (size_t)count + k]);
    return regular ? PERP_OK : PERP__FACTOR_SINGULAR;
}

void perp__fischer_matrix_solve(perp__fischer_matrix *matrix, double *x)
{
    const int32_t count = matrix->count, stride = count > 0 ? count : 1;
    const int32_t *active = matrix->active;
    double *packed = matrix->packed;

    if (matrix->by == PERP__FISCHER_SHARED) {
        perp__sparse_block_solve(matrix->problem->block, x, 0);
        return;
    }
    for (int32_t k = 0; k < count; k++)
        packed[k] = x[active[k]];
    if (matrix->by == PERP__FISCHER_CHOLESKY)
        perp__cholesky_solve(count, 1, matrix->block, stride, packed, stride);
    else
        perp__lu_solve(count, matrix->block, stride, matrix->pivots, packed, 0);
    for (int32_t k = 0; k < count; k++)
        x[active[k]] = packed[k];
}
