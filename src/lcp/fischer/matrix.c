#include "lcp/fischer/matrix.h"

#include <math.h>
#include <string.h>

#include "linalg/blas.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/sparse_block.h"

static int32_t is_sparse(const perp__fischer_matrix *matrix)
{
    return matrix->column_starts != NULL;
}

void perp__fischer_matrix_layout(perp__arena *arena, perp__fischer_matrix *matrix,
                                 const perp__lcp_problem *problem)
{
    const perp__matrix *M = problem->M;
    const size_t n = (size_t)problem->n;
    const int32_t sparse = M->column_starts != NULL;
    const size_t entries = sparse ? (size_t)M->column_starts[n] + n : n * n;

    matrix->is_read = 0;
    PERP__DOUBLES(arena, entries, &matrix->S_values, &matrix->block);
    PERP__DOUBLES(arena, n, &matrix->factors, &matrix->packed);
    PERP__INTEGERS(arena, n, &matrix->active, &matrix->pivots);
    matrix->column_starts = NULL;
    matrix->row_indices = matrix->diagonal = NULL;
    if (sparse) {
        matrix->column_starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
        matrix->row_indices = perp__arena_take(arena, entries, sizeof(int32_t));
        matrix->diagonal = perp__arena_take(arena, n, sizeof(int32_t));
    }
}

static int32_t append(perp__fischer_matrix *matrix, int32_t at, int32_t row, double value)
{
    matrix->row_indices[at] = row;
    matrix->S_values[at] = value;
    return at + 1;
}

static void read_sparse(perp__fischer_matrix *matrix, const perp__lcp_problem *problem)
{
    const perp__matrix *M = problem->M;
    const double *d = problem->factors;
    int32_t at = 0;

    for (int32_t j = 0; j < problem->n; j++) {
        int32_t k = M->column_starts[j];

        matrix->column_starts[j] = at;
        for (; k < M->column_starts[j + 1] && M->row_indices[k] < j; k++)
            at =
                append(matrix, at, M->row_indices[k], M->values[k] * (d[M->row_indices[k]] * d[j]));
        matrix->diagonal[j] = at;
        if (k == M->column_starts[j + 1] || M->row_indices[k] != j)
            at = append(matrix, at, j, 0.0);
        for (; k < M->column_starts[j + 1]; k++)
            at =
                append(matrix, at, M->row_indices[k], M->values[k] * (d[M->row_indices[k]] * d[j]));
    }
    matrix->column_starts[problem->n] = at;
}

/* By tiles, so that the columns of one and the rows of the other stay in the cache. */
static int32_t is_symmetric_dense(const double *values, int32_t n)
{
    enum { TILE = 32 };

    for (int32_t j = 0; j < n; j += TILE)
        for (int32_t i = j; i < n; i += TILE)
            for (int32_t c = j; c < n && c < j + TILE; c++)
                for (int32_t r = i > c ? i : c + 1; r < n && r < i + TILE; r++)
                    if (values[(size_t)c * (size_t)n + (size_t)r] !=
                        values[(size_t)r * (size_t)n + (size_t)c])
                        return 0;
    return 1;
}

void perp__fischer_matrix_read(perp__fischer_matrix *matrix, const perp__lcp_problem *problem)
{
    perp__matrix *S = &matrix->S;
    const size_t bytes = (size_t)problem->n * sizeof(double);

    matrix->problem = problem;
    matrix->factored = 0; /* the first pivots of a solve owe nothing to the solve before */
    matrix->count = 0;
    if (problem->n == 0 || (matrix->is_read && !memcmp(matrix->factors, problem->factors, bytes)))
        return;
    memcpy(matrix->factors, problem->factors, bytes);
    S->rows = S->columns = problem->n;
    S->row_stride = 1;
    S->column_stride = (size_t)problem->n;
    S->values = matrix->S_values;
    S->column_starts = matrix->column_starts;
    S->row_indices = matrix->row_indices;
    matrix->is_read = 1;
    if (is_sparse(matrix)) {
        read_sparse(matrix, problem);
        matrix->symmetric = perp__has_symmetric_entries(S, matrix->active, 0.0);
    } else {
        perp__lcp_dense(problem, matrix->S_values, (size_t)problem->n);
        matrix->symmetric = is_symmetric_dense(matrix->S_values, problem->n);
    }
}

double perp__fischer_matrix_diagonal(const perp__fischer_matrix *matrix, int32_t j)
{
    if (is_sparse(matrix))
        return matrix->S_values[matrix->diagonal[j]];
    return matrix->S_values[(size_t)j * (matrix->S.column_stride + 1)];
}

PERP__KERNEL static void add_one_loops(size_t n, const double *a, double x, double *restrict y)
{
    for (size_t i = 0; i < n; i++)
        y[i] += a[i] * x;
}
PERP__MULTIVERSION(add_one, (size_t n, const double *a, double x, double *y), (n, a, x, y))

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
    const perp__square H = {S->rows, matrix->block, S->column_starts, S->row_indices};
    perp_status status =
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
