#include "lcp/pgs/rows.h"

#include <string.h>

/* Sparse slots, zeros included: contiguous and gathered ones are at least half full, and those of
 * one row, seven a slice at most, start with less than eight wasted. */
static size_t slot_limit(size_t entries, size_t slices)
{
    return 2 * entries + PERP__CORE * slices;
}

void perp__rows_layout(perp__arena *arena, perp__rows *rows, const perp__lcp_problem *problem)
{
    const perp__matrix *M = problem->M;
    size_t n = (size_t)problem->n;
    size_t slices = (n + PERP__SLICE - 1) / PERP__SLICE;
    size_t padded = slices * PERP__SLICE;
    size_t entries = M->column_starts ? (size_t)M->column_starts[n] : 0;
    size_t slots = M->column_starts ? slot_limit(entries, slices) : padded * n;

    rows->n = problem->n;
    rows->count = (int32_t)slices;
    rows->slices = perp__arena_take(arena, slices, sizeof(perp__slice));
    rows->values = perp__arena_take(arena, slots + PERP__CORE * slices, sizeof(double));
    rows->upper = perp__arena_take(arena, slices * PERP__SLICE, sizeof(double));
    rows->blocks = perp__arena_take(arena, slices / PERP__BLOCK + 1, sizeof *rows->blocks);
    rows->dense = M->column_starts == NULL;
    rows->columns =
        perp__arena_take(arena, rows->dense ? 1 : slots + slots / PERP__SLICE, sizeof(int32_t));
    rows->row_starts = perp__arena_take(arena, rows->dense ? 0 : n + 1, sizeof(int32_t));
    rows->row_columns = perp__arena_take(arena, entries, sizeof(int32_t));
    rows->row_values = perp__arena_take(arena, entries, sizeof(double));
}

/* R_ij is rounded once from S_ij. */
static double entry_of(const perp__lcp_problem *problem, const double *step, int32_t i, int32_t j,
                       double value)
{
    return step[i] == 0.0 ? 0.0 : value * (problem->factors[i] * problem->factors[j]) * step[i];
}

/* What is left of an entry's row, within a dense slice that starts at row `first`, when before,
 * after and core are taken out. */
static double file_entry(const perp__rows *rows, perp__slice *slice, double *core, int32_t row,
                         int32_t column, double value)
{
    if (column == row)
        return 0.0;
    if (column == row - 1)
        slice->before[row] = value;
    else if (column == row + 1)
        slice->after[row] = value;
    else if (column >= 0 && column < PERP__SLICE && perp__in_core(rows, row, column))
        core[row * PERP__SLICE + column] = value;
    else
        return value;
    return 0.0;
}

static void read_dense(perp__rows *rows, const perp__lcp_problem *problem, const double *step)
{
    const perp__matrix *M = problem->M;
    double *values = rows->values;

    for (int32_t s = 0; s < rows->count; s++) {
        const int32_t first = s * PERP__SLICE;
        perp__slice *slice = &rows->slices[s];
        double *core = values + (size_t)rows->n * PERP__SLICE;

        slice->values = (size_t)(values - rows->values);
        slice->core = (size_t)(core - rows->values);
        slice->what = PERP__HAS_CORE | PERP__HAS_OTHERS;
        memset(core, 0, PERP__CORE * sizeof *core);
        for (int32_t j = 0; j < rows->n; j++, values += PERP__SLICE)
            for (int32_t k = 0; k < PERP__SLICE; k++) {
                size_t i = (size_t)(first + k);
                double value = 0.0;

                if (first + k < rows->n)
                    value = entry_of(problem, step, first + k, j,
                                     M->values[i * M->row_stride + (size_t)j * M->column_stride]);
                values[k] = file_entry(rows, slice, core, k, j - first, value);
            }
        values += PERP__CORE;
    }
    for (int32_t b = 0; b * PERP__BLOCK < rows->count; b++)
        rows->blocks[b].reach = (rows->count - 1) / PERP__BLOCK;
    rows->entries = (size_t)(values - rows->values);
}

/* The transpose of the compressed columns, without what does not count. */
static void read_sparse(perp__rows *rows, const perp__lcp_problem *problem, const double *step)
{
    const perp__matrix *M = problem->M;
    int32_t *starts = rows->row_starts;

    memset(starts, 0, ((size_t)rows->n + 1) * sizeof *starts);
    for (int32_t p = 0; p < M->column_starts[rows->n]; p++)
        starts[M->row_indices[p] + 1] += step[M->row_indices[p]] != 0.0;
    for (int32_t i = 0; i < rows->n; i++)
        starts[i + 1] += starts[i];
    for (int32_t j = 0; j < rows->n; j++)
        for (int32_t p = M->column_starts[j]; p < M->column_starts[j + 1]; p++) {
            int32_t i = M->row_indices[p];

            if (step[i] != 0.0) {
                rows->row_columns[starts[i]] = j;
                rows->row_values[starts[i]++] = entry_of(problem, step, i, j, M->values[p]);
            }
        }
    /* every start has moved to where the next row starts: shift them back */
    memmove(starts + 1, starts, (size_t)rows->n * sizeof *starts);
    starts[0] = 0;
}

void perp__rows_read(perp__rows *rows, const perp__lcp_problem *problem, const double *step,
                     int32_t symmetric)
{
    rows->symmetric = symmetric;
    memset(rows->slices, 0, (size_t)rows->count * sizeof *rows->slices);
    for (int32_t i = 0; i < rows->n; i++)
        if (step[i] != 0.0)
            rows->slices[i / PERP__SLICE].weight[i % PERP__SLICE] = 1.0 / step[i];
    if (rows->dense) {
        read_dense(rows, problem, step);
    } else {
        read_sparse(rows, problem, step);
        perp__rows_slice(rows);
    }
}
