/* What a sparse matrix is like, as far as one pass tells. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/sparse_traits.h"

/* Entries that mirror each other may differ by this much, relative: matrices are often assembled in
 * an order that rounds the two triangles differently. The solver refines with M itself. */
#define PERP__ASYMMETRY (8.0 * DBL_EPSILON)
/* Largest sum of a row's positive entries beside the diagonal, relative to it. */
#define PERP__POSITIVE_SHARE 0.25

int32_t perp__has_positive_diagonal(const perp__matrix *M)
{
    int32_t k;

    for (int32_t j = 0; j < M->columns; j++) {
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            if (M->row_indices[k] >= j)
                break;
        if (k == M->column_starts[j + 1] || M->row_indices[k] != j || !(M->values[k] > 0.0))
            return 0;
    }
    return 1;
}

int32_t perp__has_z_signs(const perp__matrix *M)
{
    for (int32_t j = 0; j < M->columns; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            if (M->values[k] > 0.0 && M->row_indices[k] != j)
                return 0;
    return 1;
}

/* Whether positive entries beside the diagonal are small, in every column. */
int32_t perp__is_nearly_z(const perp__matrix *M, const double *scale)
{
    for (int32_t j = 0; j < M->columns; j++) {
        double positive = 0.0, diagonal = 0.0;

        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            if (i == j)
                diagonal = M->values[k] * scale[j];
            else if (M->values[k] > 0.0)
                positive += M->values[k] * scale[i];
        }
        if (positive > PERP__POSITIVE_SHARE * diagonal)
            return 0;
    }
    return 1;
}

/* Columns from left to right meet the mirror images of their entries in the order in which these
 * are stored: one cursor a column. */
int32_t perp__has_symmetric_entries(const perp__matrix *M, int32_t *cursor)
{
    const int32_t n = M->columns;

    memcpy(cursor, M->column_starts, (size_t)n * sizeof *cursor);
    for (int32_t j = 0; j < n; j++) {
        for (int32_t k = cursor[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];
            const double a = M->values[k];
            double b;

            if (i == j)
                continue;
            if (i < j || cursor[i] == M->column_starts[i + 1] || M->row_indices[cursor[i]] != j)
                return 0; /* no mirror image */
            b = M->values[cursor[i]++];
            if (!(fabs(a - b) <= PERP__ASYMMETRY * fabs(a)))
                return 0;
        }
    }
    return 1;
}
