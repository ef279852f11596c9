/* A checked matrix view, and the products that need more than working precision. */
#ifndef PERP_LINALG_MATRIX_H
#define PERP_LINALG_MATRIX_H

#include <perp/matrix.h>

/* Dense entry (i,j) is values[i * row_stride + j * column_stride], one of the strides being 1; CSC
 * if column_starts is not NULL. */
typedef struct perp__matrix {
    int32_t rows;
    int32_t columns;
    size_t row_stride;
    size_t column_stride;
    const double *values;
    const int32_t *column_starts;
    const int32_t *row_indices;
} perp__matrix;

/* Checks a caller's view completely (struct, storage, sizes, leading dimension, index arrays,
 * finite values) and fills `own`. The message names the argument `name` and the index. */
perp_status perp__matrix_read(perp_context *context, const char *name, perp__matrix *own,
                              const perp_matrix *caller);

/* high + low = M x + add in double-double: two_product by fma(), two_sum; the rounding error of the
 * result is of order (n eps)^2 |M||x|. `add` may be NULL. Entries x_j = 0 cost nothing. The order
 * of summation is fixed. high and low: `rows` entries each, may not overlap x or add. */
void perp__multiply_doubled(const perp__matrix *M, const double *x, const double *add, double *high,
                            double *low);

/* y = M x in working precision, fixed order. */
void perp__multiply(const perp__matrix *M, const double *x, double *y);

/* y += M x; M column-major or CSC, and columns with x_j = 0 cost nothing. */
void perp__multiply_add(const perp__matrix *M, const double *x, double *y);

/* row_sums[i] = sum_j |M_ij| 2^(e_i + e_j) with e = exponents (square M). */
void perp__scaled_row_norms(const perp__matrix *M, const int32_t *exponents, double *row_sums);

#endif
