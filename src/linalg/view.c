/* Views of matrices, as callers make them. */
#include <perp/matrix.h>

#include "base/check.h"

/* Fills a view that has been initialised. */
static perp_status fill(perp_matrix *matrix, perp_matrix copy)
{
    if (PERP__CHECK(perp_matrix, NULL, matrix) != PERP_OK)
        return PERP_ERROR_ABI;
    copy.reserved = matrix->reserved;
    perp__struct_write(matrix, &copy, sizeof copy);
    return PERP_OK;
}

perp_status perp_matrix_dense(perp_matrix *matrix, int32_t storage, int32_t rows, int32_t columns,
                              const double *values, int64_t leading_dimension)
{
    return fill(matrix, (perp_matrix){.storage = storage,
                                      .rows = rows,
                                      .columns = columns,
                                      .leading_dimension = leading_dimension,
                                      .values = values});
}

perp_status perp_matrix_csc(perp_matrix *matrix, int32_t rows, int32_t columns,
                            const int32_t *column_starts, const int32_t *row_indices,
                            const double *values)
{
    return fill(matrix, (perp_matrix){.storage = PERP_STORAGE_CSC,
                                      .rows = rows,
                                      .columns = columns,
                                      .values = values,
                                      .column_starts = column_starts,
                                      .row_indices = row_indices});
}
