#include "linalg/signs.h"

#include <math.h>
#include <string.h>

#include "base/rounding.h"

/* Largest sum of a row's positive entries beside the diagonal, relative to it. */
#define POSITIVE_SHARE 0.25

bool perp__has_positive_diagonal(const perp__matrix *M)
{
    for (int32_t j = 0; j < M->columns; j++)
        if (!(perp__entry(M, j, j) > 0.0))
            return 0;
    return 1;
}

/* In tiles, for the caches. */
bool perp__is_dense_symmetric(const perp__matrix *M, const double *row_norms)
{
    enum { TILE = 16 };
    const size_t n = (size_t)M->rows;

    for (size_t J = 0; J < n; J += TILE)
        for (size_t I = J; I < n; I += TILE)
            for (size_t j = J; j < n && j < J + TILE; j++)
                for (size_t i = I > j ? I : j + 1; i < n && i < I + TILE; i++) {
                    const double a = M->values[i + j * n], b = M->values[j + i * n];

                    if (a != b && !(row_norms && fabs(a - b) <= PERP__SUM_ROUNDING * row_norms[i]))
                        return 0;
                }
    return 1;
}

bool perp__has_z_signs(const perp__matrix *M)
{
    for (int32_t j = 0; j < M->columns; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            if (M->values[k] > 0.0 && M->row_indices[k] != j)
                return 0;
    return 1;
}

bool perp__is_nearly_z(const perp__matrix *M)
{
    for (int32_t j = 0; j < M->columns; j++) {
        double positive = 0.0, diagonal = 0.0;

        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            if (M->row_indices[k] == j)
                diagonal = M->values[k];
            else if (M->values[k] > 0.0)
                positive += M->values[k];
        }
        if (positive > POSITIVE_SHARE * diagonal)
            return 0;
    }
    return 1;
}

/* Columns from left to right meet the mirror images of their entries in the order in which these
 * are stored: one cursor a column. */
bool perp__has_symmetric_entries(const perp__matrix *M, int32_t *cursor, double tolerance)
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
            if (!(fabs(a - b) <= tolerance * fabs(a)))
                return 0;
        }
    }
    return 1;
}
