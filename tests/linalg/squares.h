/* Square matrices, dense and compressed, and what the tests of factorisations share. */
#ifndef PERP_TESTS_LINALG_SQUARES_H
#define PERP_TESTS_LINALG_SQUARES_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "check.h"
#include "exact.h"
#include "gen.h"
#include "linalg/factor/factor.h"
#include "linalg/matrix.h"

#include "context.h"

#define UNIT 0x1p-53

/* A matrix both ways. The CSC pattern is that of the entries that are not zero when it is made. */
typedef struct matrix {
    int32_t n;
    double *dense, *values;
    int32_t *starts, *indices;
} matrix;

static inline void matrix_release(matrix *A)
{
    free(A->dense);
    free(A->values);
    free(A->starts);
    free(A->indices);
}

static inline matrix matrix_zero(int32_t n)
{
    matrix A;

    memset(&A, 0, sizeof A);
    A.n = n;
    A.dense = check_allocate((size_t)n * (size_t)n + 1, sizeof(double));
    return A;
}

static inline void matrix_compress(matrix *A)
{
    const size_t count = (size_t)A->n * (size_t)A->n + 1;
    int32_t i, j, k = 0;

    if (!A->starts) {
        A->values = check_allocate(count, sizeof(double));
        A->indices = check_allocate(count, sizeof(int32_t));
        A->starts = check_allocate((size_t)A->n + 1, sizeof(int32_t));
        for (j = 0; j < A->n; j++) {
            for (i = 0; i < A->n; i++)
                if (A->dense[i + A->n * j] != 0.0)
                    A->indices[k++] = i;
            A->starts[j + 1] = k;
        }
    }
    for (j = 0; j < A->n; j++)
        for (k = A->starts[j]; k < A->starts[j + 1]; k++)
            A->values[k] = A->dense[A->indices[k] + A->n * j];
}

static inline perp__square view_of(const matrix *A)
{
    perp__square view;

    memset(&view, 0, sizeof view);
    view.n = A->n;
    view.values = A->values;
    view.column_starts = A->starts;
    view.row_indices = A->indices;
    return view;
}

static inline void solve_factored(void *factor, double *x, int32_t transposed)
{
    perp__klu_solve(factor, x, transposed);
}

/* Estimate of 1 / cond_1 of the matrix that was factored. */
static inline double reciprocal_of(perp__factor *factor, const perp__square *A)
{
    double work[2 * 256];

    assert_in_range(A->n, 0, 256);
    return perp__reciprocal_condition(A->n, perp__norm_1(A), work, solve_factored, factor);
}

static inline perp__matrix sparse_view(const matrix *A)
{
    perp__matrix M;

    memset(&M, 0, sizeof M);
    M.rows = M.columns = A->n;
    M.values = A->values;
    M.column_starts = A->starts;
    M.row_indices = A->indices;
    return M;
}

/* Sparse, well conditioned, symmetric positive definite if asked for: random with a diagonal that
 * dominates; otherwise the rows are then shuffled, so that the diagonal is mostly zero. */
static inline matrix matrix_random(gen_random *random, int32_t n, int positive_definite)
{
    matrix A = matrix_zero(n);
    int32_t i, j, k;

    for (k = 0; k < 3 * n; k++) {
        i = gen_integer(random, n);
        j = gen_integer(random, n);
        A.dense[i + n * j] = gen_uniform(random, -1.0, 1.0);
        if (positive_definite)
            A.dense[j + n * i] = A.dense[i + n * j];
    }
    for (i = 0; i < n; i++) {
        double sum = 1.0;

        for (j = 0; j < n; j++)
            sum += fabs(A.dense[i + n * j]);
        A.dense[i + n * i] = sum;
    }
    for (i = 0; i < n && !positive_definite; i++) {
        k = gen_integer(random, n);
        for (j = 0; j < n; j++) {
            const double kept = A.dense[i + n * j];

            A.dense[i + n * j] = A.dense[k + n * j];
            A.dense[k + n * j] = kept;
        }
    }
    matrix_compress(&A);
    return A;
}

/* max |b - A x|_i / (max |A| |x|_1): the normwise backward error. */
static inline double backward_error(const matrix *A, int32_t transposed, const double *x,
                                    const double *b)
{
    double norm = 0.0, largest = 0.0, worst = 0.0;
    int32_t i, j;

    for (i = 0; i < A->n; i++) {
        check_sum sum;

        check_raise(&norm, 0.0);
        check_sum_clear(&sum);
        check_sum_add(&sum, b[i], 1.0);
        for (j = 0; j < A->n; j++) {
            const double entry = A->dense[transposed ? j + A->n * i : i + A->n * j];

            check_sum_add(&sum, entry, -x[j]);
            check_raise(&largest, fabs(entry));
        }
        check_raise(&worst, fabs(check_sum_value(&sum, 0)));
        norm += fabs(x[i]);
    }
    return A->n == 0 || worst == 0.0 ? 0.0 : worst / (largest * norm);
}

/* Solves with random right-hand sides, A and its transpose. */
static inline void check_solves(gen_random *random, perp__factor *factor, const matrix *A,
                                double tolerance)
{
    double *b = check_allocate((size_t)A->n + 1, sizeof *b);
    double *x = check_allocate((size_t)A->n + 1, sizeof *x);
    int32_t transposed, i;

    for (transposed = 0; transposed < 2; transposed++) {
        double error;

        for (i = 0; i < A->n; i++)
            x[i] = b[i] = gen_normal(random);
        x[A->n] = 77.0;
        perp__klu_solve(factor, x, transposed);
        assert_true(x[A->n] == 77.0);
        error = backward_error(A, transposed, x, b);
        if (!(error <= tolerance))
            fail_msg("n = %d, transposed %d: backward error %g", (int)A->n, (int)transposed, error);
    }
    free(b);
    free(x);
}

static inline perp__factor *analysed(const matrix *A)
{
    perp__factor *factor = NULL;
    perp__square view = view_of(A);

    view.values = NULL; /* not looked at */
    assert_int_equal(perp__klu_analyse(context, &factor, &view), PERP_OK);
    assert_non_null(factor);
    return factor;
}

static inline perp_status factored(perp__factor *factor, const matrix *A)
{
    const perp__square view = view_of(A);

    return perp__klu_factor(factor, &view);
}

/* The error of elimination is n u times the factors' growth, which pivoting keeps to a factor of
 * 1000 at worst in KLU (its threshold for leaving the diagonal), to little elsewhere. Most stay
 * below 10 u; 1000 n u still tells a wrong solve from a right one by ten digits. */
static inline double tolerance_of(int32_t n)
{
    return 1000.0 * (n + 1) * UNIT;
}

#endif
