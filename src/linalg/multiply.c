/* Products and norms in working precision, in a fixed order of summation. */
#include <math.h>
#include <string.h>

#include "linalg/matrix.h"
#include "linalg/multiversion.h"
#include "linalg/scale.h"

enum { LANES = 8 };

PERP__KERNEL static void add_4_columns_loops(size_t rows, const double *a, size_t stride,
                                             const double *x, double *restrict y)
{
    const double *a0 = a, *a1 = a + stride, *a2 = a + 2 * stride, *a3 = a + 3 * stride;
    const double x0 = x[0], x1 = x[1], x2 = x[2], x3 = x[3];
    size_t i;

    for (i = 0; i < rows; i++)
        y[i] = (((y[i] + a0[i] * x0) + a1[i] * x1) + a2[i] * x2) + a3[i] * x3;
}
PERP__MULTIVERSION(add_4_columns,
                   (size_t rows, const double *a, size_t stride, const double *x, double *y),
                   (rows, a, stride, x, y))

PERP__KERNEL static void by_rows_loops(const perp__matrix *M, const double *x, double *y)
{
    const size_t columns = (size_t)M->columns;
    const size_t whole = columns - columns % LANES;
    int32_t i;
    size_t j, lane;

    for (i = 0; i < M->rows; i++) {
        const double *a = M->values + (size_t)i * M->row_stride;
        double sums[LANES] = {0.0};

        for (j = 0; j < whole; j += LANES)
            for (lane = 0; lane < LANES; lane++)
                sums[lane] += a[j + lane] * x[j + lane];
        for (j = whole; j < columns; j++)
            sums[j - whole] += a[j] * x[j];
        y[i] = ((sums[0] + sums[1]) + (sums[2] + sums[3])) +
               ((sums[4] + sums[5]) + (sums[6] + sums[7]));
    }
}
PERP__MULTIVERSION(by_rows, (const perp__matrix *M, const double *x, double *y), (M, x, y))

static void by_columns(const perp__matrix *M, const double *x, double *y)
{
    const size_t rows = (size_t)M->rows, stride = M->column_stride;
    const int32_t whole = M->columns - M->columns % 4;
    int32_t j;
    size_t i;

    for (j = 0; j < whole; j += 4)
        if (x[j] != 0.0 || x[j + 1] != 0.0 || x[j + 2] != 0.0 || x[j + 3] != 0.0)
            add_4_columns(rows, M->values + (size_t)j * stride, stride, x + j, y);
    for (j = whole; j < M->columns; j++)
        for (i = 0; i < rows; i++)
            y[i] += M->values[i + (size_t)j * stride] * x[j];
}

static void by_sparse_columns(const perp__matrix *M, const double *x, double *y)
{
    int32_t j, k;

    for (j = 0; j < M->columns; j++) {
        if (x[j] == 0.0)
            continue;
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            y[M->row_indices[k]] += M->values[k] * x[j];
    }
}

void perp__multiply(const perp__matrix *M, const double *x, double *y)
{
    int32_t i;

    if (!M->column_starts && M->row_stride != 1) {
        by_rows(M, x, y);
        return;
    }
    for (i = 0; i < M->rows; i++)
        y[i] = 0.0;
    if (M->column_starts)
        by_sparse_columns(M, x, y);
    else
        by_columns(M, x, y);
}

/* |value| 2^(a + b) */
static double scaled(double value, int32_t a, int32_t b)
{
    return fabs(value) * perp__power_of_two(a + b);
}

void perp__scaled_row_norms(const perp__matrix *M, const int32_t *exponents, double *row_sums)
{
    const int32_t *e = exponents;
    int32_t i, j, k;

    for (i = 0; i < M->rows; i++)
        row_sums[i] = 0.0;
    if (M->column_starts)
        for (j = 0; j < M->columns; j++)
            for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
                i = M->row_indices[k];
                row_sums[i] += scaled(M->values[k], e[i], e[j]);
            }
    else if (M->row_stride == 1)
        for (j = 0; j < M->columns; j++) {
            const double *a = M->values + (size_t)j * M->column_stride;

            for (i = 0; i < M->rows; i++)
                row_sums[i] += scaled(a[i], e[i], e[j]);
        }
    else
        for (i = 0; i < M->rows; i++) {
            const double *a = M->values + (size_t)i * M->row_stride;

            for (j = 0; j < M->columns; j++)
                row_sums[i] += scaled(a[j], e[i], e[j]);
        }
}
