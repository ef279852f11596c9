#include "linalg/matrix.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "base/outcome.h"

perp_matrix perp__view(int32_t storage, int32_t rows, int32_t columns, const double *values)
{
    const int32_t line = storage == PERP_STORAGE_ROW_MAJOR ? columns : rows;

    return (perp_matrix){.struct_size = sizeof(perp_matrix),
                         .storage = storage,
                         .rows = rows,
                         .columns = columns,
                         .leading_dimension = line > 0 ? line : 1,
                         .values = values};
}

static const char *text_of(double value)
{
    return isnan(value) ? "nan" : value > 0.0 ? "inf" : "-inf";
}

static perp_status read_dense(perp_context *context, const char *name, perp__matrix *read,
                              const perp_matrix *M)
{
    const int by_rows = M->storage == PERP_STORAGE_ROW_MAJOR;
    const int32_t lines = by_rows ? M->rows : M->columns;
    const int32_t length = by_rows ? M->columns : M->rows;
    size_t stride, k;

    if (M->column_starts || M->row_indices)
        return perp__refuse(context, "%s is dense but %s.%s is not NULL", name, name,
                            M->column_starts ? "column_starts" : "row_indices");
    if (M->leading_dimension < (length > 1 ? length : 1))
        return perp__refuse(context, "%s.leading_dimension is %lld, at least %d expected", name,
                            (long long)M->leading_dimension, (int)(length > 1 ? length : 1));
    /* the array must fit the address space, or products of indices would wrap round */
    if (lines > 0 && (uint64_t)M->leading_dimension > SIZE_MAX / 2 / sizeof(double) / (size_t)lines)
        return perp__refuse(context, "%s.leading_dimension is %lld, too large", name,
                            (long long)M->leading_dimension);
    if (lines > 0 && length > 0 && !M->values)
        return perp__refuse(context, "%s.values is NULL", name);
    stride = (size_t)M->leading_dimension;
    read->row_stride = by_rows ? stride : 1;
    read->column_stride = by_rows ? 1 : stride;
    if (stride == (size_t)length && perp__all_finite(M->values, (size_t)lines * stride))
        return PERP_OK;
    for (size_t line = 0; line < (size_t)lines && length > 0; line++) {
        const double *values = M->values + line * stride;

        if (perp__all_finite(values, (size_t)length))
            continue;
        for (k = 0; isfinite(values[k]); k++)
            ;
        return perp__fail(context, PERP_ERROR_NOT_FINITE, "%s(%zu,%zu) is %s", name,
                          by_rows ? line : k, by_rows ? k : line, text_of(values[k]));
    }
    return PERP_OK;
}

perp_status perp__matrix_check_csc(perp_context *context, const char *name, const perp__matrix *M)
{
    const int32_t *starts = M->column_starts, *rows = M->row_indices;

    if (starts[0] != 0)
        return perp__refuse(context, "%s.column_starts[0] is %d, 0 expected", name, (int)starts[0]);
    for (int32_t j = 0; j < M->columns; j++)
        if (starts[j + 1] < starts[j])
            return perp__refuse(context,
                                "%s.column_starts[%d] = %d is below %s.column_starts[%d] = %d",
                                name, (int)j + 1, (int)starts[j + 1], name, (int)j, (int)starts[j]);
    if (starts[M->columns] > 0 && !rows)
        return perp__refuse(context, "%s.row_indices is NULL", name);
    for (int32_t j = 0; j < M->columns; j++)
        for (int32_t k = starts[j]; k < starts[j + 1]; k++) {
            if (rows[k] < 0 || rows[k] >= M->rows)
                return perp__refuse(context,
                                    "%s.row_indices[%d] = %d in column %d is outside 0 .. %d", name,
                                    (int)k, (int)rows[k], (int)j, (int)M->rows - 1);
            if (k > starts[j] && rows[k] <= rows[k - 1])
                return perp__refuse(
                    context,
                    "%s.row_indices[%d] = %d is not above %s.row_indices[%d] = %d in column %d",
                    name, (int)k, (int)rows[k], name, (int)k - 1, (int)rows[k - 1], (int)j);
            if (M->values && !isfinite(M->values[k]))
                return perp__fail(context, PERP_ERROR_NOT_FINITE, "%s(%d,%d) = %s.values[%d] is %s",
                                  name, (int)rows[k], (int)j, name, (int)k, text_of(M->values[k]));
        }
    return PERP_OK;
}

perp_status perp__matrix_read(perp_context *context, const char *name, perp__matrix *copy,
                              const perp_matrix *caller)
{
    perp_matrix M = {0};
    perp__matrix read = {0};
    perp_status status = perp__check_pointer(context, name, caller);

    PERP__THEN(status,
               perp__struct_read(context, name, &M, sizeof M, caller, PERP__FIRST(perp_matrix)));
    if (status != PERP_OK)
        return status;
    if (M.storage < PERP_STORAGE_COLUMN_MAJOR || M.storage > PERP_STORAGE_CSC)
        return perp__refuse(context, "%s.storage is %d, not a storage", name, (int)M.storage);
    if (M.rows < 0 || M.columns < 0)
        return perp__refuse(context, "%s.%s is %d", name, M.rows < 0 ? "rows" : "columns",
                            (int)(M.rows < 0 ? M.rows : M.columns));
    if (M.reserved != 0)
        return perp__refuse(context, "%s.reserved is %d, 0 expected", name, (int)M.reserved);
    read.rows = M.rows;
    read.columns = M.columns;
    read.values = M.values;
    read.row_stride = read.column_stride = 1;
    if (M.storage != PERP_STORAGE_CSC) {
        status = read_dense(context, name, &read, &M);
    } else if (M.column_starts) {
        read.column_starts = M.column_starts;
        read.row_indices = M.row_indices;
        if (M.column_starts[M.columns] > 0 && M.row_indices && !M.values)
            return perp__refuse(context, "%s.values is NULL", name);
        status = perp__matrix_check_csc(context, name, &read);
    } else if (M.columns > 0) { /* no columns: as good as a dense matrix of no entries */
        return perp__refuse(context, "%s.column_starts is NULL", name);
    }
    if (status == PERP_OK)
        *copy = read;
    return status;
}

perp_status perp__matrix_read_sized(perp_context *context, const char *name, perp__matrix *copy,
                                    const perp_matrix *caller, int32_t rows, int32_t columns)
{
    const perp_status status = perp__matrix_read(context, name, copy, caller);

    if (status != PERP_OK || (copy->rows == rows && copy->columns == columns))
        return status;
    return perp__refuse(context, "%s is %d by %d, expected %d by %d", name, (int)copy->rows,
                        (int)copy->columns, (int)rows, (int)columns);
}

void perp__matrix_spread(const perp__matrix *M, double *A, size_t stride)
{
    const bool by_rows = perp__lines_are_rows(M);
    const size_t step = by_rows ? stride : 1;

    for (int32_t j = 0; M->rows > 0 && j < (by_rows ? M->rows : M->columns); j++) {
        const perp__line l = perp__line_of(M, j);
        const int32_t count = by_rows ? M->columns : l.count;
        double *line = A + (size_t)j * (by_rows ? 1 : stride);

        for (int32_t k = 0; k < count; k++)
            line[(size_t)(l.indices ? l.indices[k] : k) * step] = l.values[k];
    }
}

/* ---- principal blocks ---- */

void perp__principal_dense(const perp__matrix *M, const perp__index_set *set, double *to,
                           size_t row_step, size_t column_step)
{
    const size_t count = (size_t)set->count;

    if (M->column_starts && count > 0)
        memset(to, 0, count * count * sizeof *to);
    for (size_t c = 0; c < count; c++) {
        const int32_t j = set->active[c];
        const double *from = M->column_starts ? NULL : M->values + (size_t)j * M->column_stride;

        if (from) {
            for (size_t r = 0; r < count; r++)
                to[r * row_step + c * column_step] = from[(size_t)set->active[r] * M->row_stride];
            continue;
        }
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            if (set->position[M->row_indices[k]] >= 0)
                to[(size_t)set->position[M->row_indices[k]] * row_step + c * column_step] =
                    M->values[k];
    }
}

void perp__principal_csc(const perp__matrix *M, const perp__index_set *set, double rho,
                         const double *weights, int32_t *starts, int32_t *rows, double *values)
{
    int32_t at = 0;

    for (int32_t c = 0; c < set->count; c++) {
        const int32_t j = set->active[c];
        const double shift = weights ? weights[j] : rho;
        bool placed = shift == 0.0; /* the diagonal's entry, needed for a shift */

        starts[c] = at;
        for (int32_t k = M->column_starts[j]; k <= M->column_starts[j + 1]; k++) {
            const bool is_end = k == M->column_starts[j + 1];
            const int32_t i = is_end ? M->rows : M->row_indices[k];

            if (!placed && i > j) {
                rows[at] = c;
                values[at++] = shift;
            }
            placed |= i >= j;
            if (is_end || set->position[i] < 0)
                continue;
            rows[at] = set->position[i];
            values[at++] = M->values[k] + (i == j ? shift : 0.0);
        }
    }
    starts[set->count] = at;
}
