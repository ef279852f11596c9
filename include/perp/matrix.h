/* perp/matrix.h: matrices as views on the caller's memory; nothing is copied. */
#ifndef PERP_MATRIX_H
#define PERP_MATRIX_H

#include <perp/base.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Values never change. */
enum perp_storage_value {
    PERP_STORAGE_COLUMN_MAJOR = 0, /* entry (i,j) at values[i + j * leading_dimension] */
    PERP_STORAGE_ROW_MAJOR = 1,    /* entry (i,j) at values[i * leading_dimension + j] */
    PERP_STORAGE_CSC = 2           /* compressed sparse column, as in SuiteSparse and SciPy */
};

/* A view of a rows-by-columns matrix.
 *
 * Dense: `leading_dimension` is at least max(1, rows) column-major, max(1, columns) row-major; the
 * index arrays are NULL.
 * CSC: column j holds entries column_starts[j] .. column_starts[j+1]-1; column_starts has columns+1
 * entries and starts at 0; row_indices within a column increase strictly (sorted, no duplicates).
 * Explicit zeros are allowed. leading_dimension is ignored.
 * All values must be finite. */
typedef struct perp_matrix {
    size_t struct_size;
    int32_t storage; /* PERP_STORAGE_... */
    int32_t rows;
    int32_t columns;
    int32_t reserved; /* 0 */
    int64_t leading_dimension;
    const double *values;
    const int32_t *column_starts;
    const int32_t *row_indices;
} perp_matrix;

/* Fills an initialised view of a dense matrix. Row-major with leading_dimension = columns is a C
 * array `double M[rows][columns]`. Returns PERP_OK or PERP_ERROR_ABI; the numbers themselves are
 * checked where the view is used. */
PERP_API perp_status perp_matrix_dense(perp_matrix *matrix, int32_t storage, int32_t rows,
                                       int32_t columns, const double *values,
                                       int64_t leading_dimension);

/* Fills an initialised view of a CSC matrix. Returns PERP_OK or PERP_ERROR_ABI. */
PERP_API perp_status perp_matrix_csc(perp_matrix *matrix, int32_t rows, int32_t columns,
                                     const int32_t *column_starts, const int32_t *row_indices,
                                     const double *values);

#ifdef __cplusplus
}
#endif

#endif
