#include "lcp/pgs/sweep.h"

#include <string.h>

void perp__rows_layout(perp__arena *arena, perp__rows *rows, const perp__lcp_problem *problem)
{
    const perp__matrix *M = problem->M;
    size_t n = (size_t)problem->n;
    size_t slices = (n + PERP__SLICE - 1) / PERP__SLICE;
    size_t padded = slices * PERP__SLICE;
    size_t entries = M->column_starts ? (size_t)M->column_starts[n] : 0;
    /* sparse ones, zeros included: contiguous and gathered ones are at least half full, and those
     * of one row, seven a slice at most, start with less than eight wasted */
    size_t slots = M->column_starts ? 2 * entries + PERP__CORE * slices : padded * n;

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

/* Entries of z on either side of a core: row and column within the slice. A sweep forward settles
 * all columns but those of the rows before; a sweep in both directions settles none. */
static bool in_core(const perp__rows *rows, int32_t row, int32_t column)
{
    return column < row - 1 || (rows->symmetric && column > row + 1);
}

/* R_ij is rounded once from S_ij. */
static double entry_of(double step, double value)
{
    return step == 0.0 ? 0.0 : value * step;
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
                const int32_t column = j - first; /* within the slice, if it is */
                double value = 0.0;

                if (first + k < rows->n)
                    value = entry_of(step[first + k], perp__entry(M, first + k, j));
                /* the slot has what is left when before, after and core are taken out */
                values[k] = 0.0;
                if (column == k - 1)
                    slice->before[k] = value;
                else if (column == k + 1)
                    slice->after[k] = value;
                else if (column >= 0 && column < PERP__SLICE && in_core(rows, k, column))
                    core[k * PERP__SLICE + column] = value;
                else if (column != k)
                    values[k] = value;
            }
        values += PERP__CORE;
    }
    for (int32_t b = 0; b * PERP__BLOCK < rows->count; b++)
        rows->blocks[b].reach = (rows->count - 1) / PERP__BLOCK;
    rows->entries = (size_t)(values - rows->values);
}

/* Sparse rows into slices: the entries of a slice's eight rows are met diagonal by diagonal, and
 * each diagonal becomes a contiguous slot if at least four of them have it. The others are packed
 * into gathered slots of at least four entries, and the rest into slots of one row. */

/* One slice while its entries are sorted. */
typedef struct sorting {
    perp__rows *rows;
    perp__slice *slice;
    int32_t first, count;                          /* its rows */
    int32_t at[PERP__SLICE], end[PERP__SLICE];     /* what is unread of each row */
    int32_t kept[PERP__SLICE], begin[PERP__SLICE]; /* what is put off, moved to the row's front */
    double core[PERP__CORE];
    size_t values, columns; /* written so far, of the whole matrix */
} sorting;

static double *new_slot(sorting *sort)
{
    double *slot = sort->rows->values + sort->values;

    sort->values += PERP__SLICE;
    memset(slot, 0, PERP__SLICE * sizeof *slot);
    return slot;
}

/* Takes diagonal d from the front of the rows: into before, after and core, a contiguous slot, or
 * put off. */
static void take_diagonal(sorting *sort, int32_t d)
{
    perp__rows *rows = sort->rows;
    perp__slice *slice = sort->slice;
    double values[PERP__SLICE] = {0.0};
    int32_t has[PERP__SLICE] = {0}, found = 0;

    for (int32_t k = 0; k < sort->count; k++) {
        const int32_t p = sort->at[k], column = k + d; /* within the slice, if it is */

        if (p >= sort->end[k] || rows->row_columns[p] != sort->first + k + d)
            continue;
        values[k] = rows->row_values[p];
        sort->at[k]++;
        if (d == -1) {
            slice->before[k] = values[k];
        } else if (d == 1) {
            slice->after[k] = values[k];
        } else if (d != 0 && column >= 0 && column < sort->count && in_core(rows, k, column)) {
            sort->core[k * PERP__SLICE + column] = values[k];
            slice->what |= PERP__HAS_CORE;
        } else {
            has[k] = d != 0;
            found += has[k];
        }
    }
    if (2 * found >= PERP__SLICE) {
        double *slot = new_slot(sort);

        for (int32_t k = 0; k < sort->count; k++)
            slot[k] = has[k] ? values[k] : 0.0;
        rows->columns[sort->columns++] = sort->first + d;
        slice->contiguous++;
        return;
    }
    for (int32_t k = 0; k < sort->count; k++)
        if (has[k]) {
            rows->row_columns[sort->kept[k]] = sort->first + k + d;
            rows->row_values[sort->kept[k]++] = values[k];
        }
}

/* Entry j of a slot: the next one put off of row k; a zero, of any column, if there is none. */
static void put(sorting *sort, int32_t k, double *slot, int32_t j)
{
    perp__rows *rows = sort->rows;
    int32_t column = sort->first;

    if (k < sort->count && sort->begin[k] < sort->kept[k]) {
        column = rows->row_columns[sort->begin[k]];
        slot[j] = rows->row_values[sort->begin[k]++];
    }
    rows->columns[sort->columns++] = column;
}

/* Packs what was put off: together while at least half of the rows have some, then row by row. */
static void gather(sorting *sort)
{
    for (;;) {
        int32_t found = 0;
        double *slot;

        for (int32_t k = 0; k < sort->count; k++)
            found += sort->begin[k] < sort->kept[k];
        if (2 * found < PERP__SLICE)
            break;
        slot = new_slot(sort);
        for (int32_t k = 0; k < PERP__SLICE; k++)
            put(sort, k, slot, k);
        sort->slice->gathered++;
    }
    for (int32_t k = 0; k < sort->count; k++)
        while (sort->begin[k] < sort->kept[k]) {
            double *slot = new_slot(sort);

            sort->rows->columns[sort->columns++] = k;
            for (int32_t j = 0; j < PERP__SLICE; j++)
                put(sort, k, slot, j);
            sort->slice->rows++;
        }
}

static void sort_slice(sorting *sort, int32_t s)
{
    perp__rows *rows = sort->rows;
    perp__slice *slice = &rows->slices[s];
    int32_t diagonal;

    sort->slice = slice;
    sort->first = s * PERP__SLICE;
    sort->count = rows->n - sort->first < PERP__SLICE ? rows->n - sort->first : PERP__SLICE;
    memset(sort->core, 0, sizeof sort->core);
    slice->values = sort->values;
    slice->columns = sort->columns;
    for (int32_t k = 0; k < sort->count; k++) {
        sort->at[k] = sort->kept[k] = sort->begin[k] = rows->row_starts[sort->first + k];
        sort->end[k] = rows->row_starts[sort->first + k + 1];
    }
    do { /* the next diagonal, column - row */
        diagonal = INT32_MAX;
        for (int32_t k = 0; k < sort->count; k++)
            if (sort->at[k] < sort->end[k]) {
                const int32_t d = rows->row_columns[sort->at[k]] - (sort->first + k);

                diagonal = d < diagonal ? d : diagonal;
            }
        if (diagonal < INT32_MAX)
            take_diagonal(sort, diagonal);
    } while (diagonal < INT32_MAX);
    gather(sort);
    if (slice->gathered > 0 || slice->rows > 0)
        slice->what |= PERP__HAS_OTHERS;
    if (slice->what & PERP__HAS_CORE) {
        slice->core = sort->values;
        memcpy(rows->values + sort->values, sort->core, sizeof sort->core);
        sort->values += PERP__CORE;
    }
}

void perp__rows_read(perp__rows *rows, const perp__lcp_problem *problem, const double *step,
                     bool symmetric)
{
    sorting sort = {.rows = rows};

    rows->symmetric = symmetric;
    memset(rows->slices, 0, (size_t)rows->count * sizeof *rows->slices);
    for (int32_t i = 0; i < rows->n; i++)
        if (step[i] != 0.0)
            rows->slices[i / PERP__SLICE].weight[i % PERP__SLICE] = 1.0 / step[i];
    if (rows->dense) {
        read_dense(rows, problem, step);
        return;
    }
    perp__transpose_csc(problem->M, rows->row_starts, rows->row_columns, rows->row_values);
    for (int32_t i = 0; i < rows->n; i++)
        for (int32_t p = rows->row_starts[i]; p < rows->row_starts[i + 1]; p++)
            rows->row_values[p] = entry_of(step[i], rows->row_values[p]);
    /* Block by block, the farthest rows whose z it needs or which need its own. */
    for (int32_t b = 0; b * PERP__BLOCK < rows->count; b++)
        rows->blocks[b].reach = b;
    for (int32_t i = 0; i < rows->n; i++)
        for (int32_t p = rows->row_starts[i]; p < rows->row_starts[i + 1]; p++) {
            const int32_t here = i / PERP__BLOCK_ROWS,
                          other = rows->row_columns[p] / PERP__BLOCK_ROWS;
            const int32_t least = here < other ? here : other, most = here < other ? other : here;

            if (rows->blocks[least].reach < most)
                rows->blocks[least].reach = most;
        }
    for (int32_t s = 0; s < rows->count; s++)
        sort_slice(&sort, s);
    rows->entries = sort.values;
}
