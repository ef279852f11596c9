#include "linalg/principal.h"

#include <string.h>

void perp__principal_dense(const perp__matrix *M, const perp__principal *block, double *to,
                           size_t row_step, size_t column_step)
{
    const size_t count = (size_t)block->count;

    if (M->column_starts && count > 0)
        memset(to, 0, count * count * sizeof *to);
    for (size_t c = 0; c < count; c++) {
        const int32_t j = block->active[c];
        const double *from = M->column_starts ? NULL : M->values + (size_t)j * M->column_stride;

        if (from) {
            for (size_t r = 0; r < count; r++)
                to[r * row_step + c * column_step] = from[(size_t)block->active[r] * M->row_stride];
            continue;
        }
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            if (block->position[M->row_indices[k]] >= 0)
                to[(size_t)block->position[M->row_indices[k]] * row_step + c * column_step] =
                    M->values[k];
    }
}

void perp__principal_csc(const perp__matrix *M, const perp__principal *block, int32_t *starts,
                         int32_t *rows, double *values)
{
    int32_t at = 0, c, k;

    for (c = 0; c < block->count; c++) {
        const int32_t j = block->active[c];

        starts[c] = at;
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t r = block->position[M->row_indices[k]];

            if (r < 0)
                continue;
            rows[at] = r;
            values[at++] = M->values[k];
        }
    }
    starts[block->count] = at;
}
