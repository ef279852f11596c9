/* Factors of the active blocks of a Newton step's matrix. */
#include <math.h>
#include <string.h>

#include "lcp/fischer/matrix.h"
#include "linalg/blas.h"

static void fill_dense(perp__fischer_matrix *matrix, const double *weights, double rho)
{
    const int32_t *active = matrix->active;
    const size_t count = (size_t)matrix->count;
    const int32_t whole = matrix->by == PERP__FISCHER_LU;

    for (size_t c = 0; c < count; c++) {
        const double *from = matrix->S_values + (size_t)active[c] * matrix->S.column_stride;
        double *column = matrix->block + c * count;

        for (size_t r = whole ? 0 : c; r < count; r++)
            column[r] = from[active[r]];
        column[c] += weights ? weights[active[c]] : rho;
    }
}

/* Factors that overflowed are of no more use than a zero pivot. */
static int32_t is_finite(const perp__fischer_matrix *matrix)
{
    const size_t count = (size_t)matrix->count;

    for (size_t k = 0; k < count; k++)
        if (!isfinite(matrix->block[k * count + k]))
            return 0;
    return 1;
}

static perp_status factor_dense(perp__fischer_matrix *matrix, const double *weights, double rho)
{
    const int32_t count = matrix->count, stride = count > 0 ? count : 1;
    int32_t regular = 0;

    if (matrix->symmetric) {
        matrix->by = PERP__FISCHER_CHOLESKY;
        fill_dense(matrix, weights, rho);
        regular = perp__cholesky_factor(count, matrix->block, stride) == 0;
    }
    if (!regular) {
        matrix->by = PERP__FISCHER_LU;
        fill_dense(matrix, weights, rho);
        regular = perp__lu_factor(count, matrix->block, stride, matrix->pivots) == 0;
    }
    return regular && is_finite(matrix) ? PERP_OK : PERP__FACTOR_SINGULAR;
}

static perp_status factor_padded(perp__fischer_matrix *matrix, const double *weights)
{
    const perp__matrix *S = &matrix->S;
    perp__square H;
    perp_status status;

    H.n = S->rows;
    H.values = matrix->block;
    H.column_starts = S->column_starts;
    H.row_indices = S->row_indices;
    status =
        perp__kept_factor_analyse(&matrix->kept, matrix->problem->context, &perp__factor_klu, &H);
    if (status != PERP_OK)
        return status;
    for (int32_t j = 0; j < S->columns; j++)
        for (int32_t k = S->column_starts[j]; k < S->column_starts[j + 1]; k++) {
            const int32_t i = S->row_indices[k];

            if (!isfinite(weights[j]))
                matrix->block[k] = i == j ? 1.0 : 0.0;
            else if (i == j)
                matrix->block[k] = S->values[k] + weights[j];
            else
                matrix->block[k] = isfinite(weights[i]) ? S->values[k] : 0.0;
        }
    matrix->by = PERP__FISCHER_PADDED;
    return matrix->kept.type->factor(matrix->kept.factor, &H, matrix->factored++ > 0);
}

perp_status perp__fischer_matrix_factor(perp__fischer_matrix *matrix, const double *weights)
{
    matrix->count = 0;
    for (int32_t i = 0; i < matrix->problem->n; i++)
        if (isfinite(weights[i]))
            matrix->active[matrix->count++] = i;
    return matrix->column_starts ? factor_padded(matrix, weights)
                                 : factor_dense(matrix, weights, 0.0);
}

perp_status perp__fischer_matrix_factor_block(perp__fischer_matrix *matrix, const int8_t *places,
                                              double rho)
{
    matrix->count = 0;
    for (int32_t i = 0; i < matrix->problem->n; i++)
        if (places[i] == PERP__BETWEEN)
            matrix->active[matrix->count++] = i;
    if (!matrix->column_starts)
        return factor_dense(matrix, NULL, rho);
    matrix->by = PERP__FISCHER_SHARED;
    return perp__sparse_block_factor(matrix->problem->block, matrix->active, matrix->count, rho);
}

void perp__fischer_matrix_solve(perp__fischer_matrix *matrix, double *x)
{
    const int32_t count = matrix->count, stride = count > 0 ? count : 1;
    const int32_t *active = matrix->active;
    double *packed = matrix->packed;

    if (matrix->by == PERP__FISCHER_SHARED) {
        perp__sparse_block_solve(matrix->problem->block, x);
        return;
    }
    if (matrix->by == PERP__FISCHER_PADDED) {
        memset(packed, 0, (size_t)matrix->problem->n * sizeof *packed);
        for (int32_t k = 0; k < count; k++)
            packed[active[k]] = x[active[k]];
        matrix->kept.type->solve(matrix->kept.factor, packed, 0);
        for (int32_t k = 0; k < count; k++)
            x[active[k]] = packed[active[k]];
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

void perp__fischer_matrix_release(perp__fischer_matrix *matrix)
{
    perp__kept_factor_release(&matrix->kept);
}
