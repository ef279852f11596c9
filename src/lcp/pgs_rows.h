/* The scaled matrix S, S = D M D, by rows: what a Gauss-Seidel sweep walks along,
 * whatever the caller's storage. */
#ifndef PERP_LCP_PGS_ROWS_H
#define PERP_LCP_PGS_ROWS_H

#include "base/arena.h"
#include "lcp/method.h"

/* before[i] = S_(i,i-1) is kept apart when sparse, and 0 when dense: see the sweep. */
typedef struct perp__rows {
    int32_t n;
    double *diagonal; /* n */
    double *before;   /* n */
    double *values;
    int32_t *columns; /* NULL: dense, all of row i at values + i n */
    int32_t *starts;  /* n + 1; sparse: the entries that are not in diagonal or before */
} perp__rows;

/* Takes room for the matrix of `problem`. */
void perp__rows_layout(perp__arena *arena, perp__rows *rows, const perp__lcp_problem *problem);

/* Copies and scales the matrix: two passes over its entries. */
void perp__rows_read(perp__rows *rows, const perp__lcp_problem *problem);

/* Four partial sums, so that additions overlap; always the same four. */
static inline double perp__dense_row_times(const double *row, int32_t n, const double *z)
{
    double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0;
    int32_t j = 0;

    for (; j + 3 < n; j += 4) {
        s0 += row[j] * z[j];
        s1 += row[j + 1] * z[j + 1];
        s2 += row[j + 2] * z[j + 2];
        s3 += row[j + 3] * z[j + 3];
    }
    for (; j < n; j++)
        s0 += row[j] * z[j];
    return (s0 + s1) + (s2 + s3);
}

/* add + (S z)_i - before[i] z_(i-1). */
static inline double perp__row_times(const perp__rows *rows, int32_t i, const double *z, double add)
{
    double sum;

    if (!rows->columns)
        return add + perp__dense_row_times(rows->values + (size_t)i * (size_t)rows->n, rows->n, z);
    sum = add + rows->diagonal[i] * z[i];
    for (int32_t p = rows->starts[i]; p < rows->starts[i + 1]; p++)
        sum += rows->values[p] * z[rows->columns[p]];
    return sum;
}

#endif
