#include "lcp/fischer_matrix.h"

void perp__fischer_matrix_layout(perp__arena *arena, perp__fischer_matrix *matrix,
                                 const perp__lcp_problem *problem)
{
    const perp__matrix *M = problem->M;
    size_t n = (size_t)problem->n;
    size_t entries = M->column_starts ? (size_t)M->column_starts[n] + n : n * n;

    matrix->S_values = perp__arena_take(arena, entries, sizeof(double));
    matrix->H_values = perp__arena_take(arena, entries, sizeof(double));
    matrix->column_starts = NULL;
    matrix->row_indices = NULL;
    if (M->column_starts) {
        matrix->column_starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
        matrix->row_indices = perp__arena_take(arena, entries, sizeof(int32_t));
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
        int32_t diagonal_is_in = 0;

        matrix->column_starts[j] = at;
        for (int32_t p = M->column_starts[j]; p < M->column_starts[j + 1]; p++) {
            int32_t i = M->row_indices[p];

            if (i > j && !diagonal_is_in)
                at = append(matrix, at, j, 0.0);
            diagonal_is_in |= i >= j;
            at = append(matrix, at, i, M->values[p] * (d[i] * d[j]));
        }
        if (!diagonal_is_in)
            at = append(matrix, at, j, 0.0);
    }
    matrix->column_starts[problem->n] = at;
}

static perp__square square(const perp__fischer_matrix *matrix)
{
    perp__square H;

    H.n = matrix->S.rows;
    H.values = matrix->H_values;
    H.column_starts = matrix->S.column_starts;
    H.row_indices = matrix->S.row_indices;
    return H;
}

perp_status perp__fischer_matrix_read(perp__fischer_matrix *matrix,
                                      const perp__lcp_problem *problem)
{
    perp__matrix *S = &matrix->S;
    perp__square H;

    S->rows = S->columns = problem->n;
    S->row_stride = 1;
    S->column_stride = (size_t)problem->n;
    S->values = matrix->S_values;
    S->column_starts = matrix->column_starts;
    S->row_indices = matrix->row_indices;
    if (matrix->column_starts)
        read_sparse(matrix, problem);
    else
        perp__lcp_dense(problem, matrix->S_values, (size_t)problem->n);
    H = square(matrix);
    matrix->factored = 0; /* the first pivots of a solve owe nothing to the solve before */
    return perp__kept_factor_analyse(
        &matrix->kept, problem->context,
        matrix->column_starts ? &perp__factor_klu : &perp__factor_lapack, &H);
}

void perp__fischer_matrix_transposed(const perp__fischer_matrix *matrix, const double *x, double *y)
{
    const perp__matrix *S = &matrix->S;

    for (int32_t j = 0; j < S->columns; j++) {
        double sum = 0.0;

        if (S->column_starts)
            for (int32_t p = S->column_starts[j]; p < S->column_starts[j + 1]; p++)
                sum += S->values[p] * x[S->row_indices[p]];
        else
            for (int32_t i = 0; i < S->rows; i++)
                sum += S->values[(size_t)j * S->column_stride + (size_t)i] * x[i];
        y[j] = sum;
    }
}

perp_status perp__fischer_matrix_factor(perp__fischer_matrix *matrix, const double *slope_z,
                                        const double *slope_w, double rho)
{
    const perp__matrix *S = &matrix->S;
    perp__square H = square(matrix);

    for (int32_t j = 0; j < S->columns; j++) {
        if (S->column_starts) {
            for (int32_t p = S->column_starts[j]; p < S->column_starts[j + 1]; p++) {
                int32_t i = S->row_indices[p];

                matrix->H_values[p] = slope_w[i] * S->values[p];
                if (i == j)
                    matrix->H_values[p] += slope_z[i] + slope_w[i] * rho;
            }
        } else {
            size_t column = (size_t)j * S->column_stride;

            for (int32_t i = 0; i < S->rows; i++)
                matrix->H_values[column + (size_t)i] = slope_w[i] * S->values[column + (size_t)i];
            matrix->H_values[column + (size_t)j] += slope_z[j] + slope_w[j] * rho;
        }
    }
    return matrix->kept.type->factor(matrix->kept.factor, &H, matrix->factored++ > 0);
}

void perp__fischer_matrix_solve(perp__fischer_matrix *matrix, double *x)
{
    matrix->kept.type->solve(matrix->kept.factor, x, 0);
}

void perp__fischer_matrix_release(perp__fischer_matrix *matrix)
{
    perp__kept_factor_release(&matrix->kept);
}
