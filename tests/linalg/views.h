/* One matrix in the three storages, the dense ones with gaps that hold NaN. */
#ifndef PERP_TESTS_LINALG_VIEWS_H
#define PERP_TESTS_LINALG_VIEWS_H

#include <math.h>
#include <stdlib.h>

#include "suite.h"

#include "check.h"
#include "gen.h"
#include "linalg/matrix.h"

enum { VIEW_BY_COLUMNS, VIEW_BY_ROWS, VIEW_CSC, VIEWS, VIEW_GAP = 3 };

typedef struct views {
    double *by_columns, *by_rows, *values;
    int32_t *column_starts, *row_indices;
    perp_matrix caller[VIEWS];
    perp__matrix view[VIEWS];
} views;

static inline void views_release(views *v)
{
    free(v->by_columns);
    free(v->by_rows);
    free(v->values);
    free(v->column_starts);
    free(v->row_indices);
}

/* entries: rows * columns numbers, column by column. CSC leaves the zeros out. */
static inline void views_make(views *v, int32_t rows, int32_t columns, const double *entries)
{
    const size_t m = (size_t)rows, n = (size_t)columns;
    int32_t i, j, count = 0;
    size_t k;

    v->by_columns = check_allocate((m + VIEW_GAP) * n + 1, sizeof(double));
    v->by_rows = check_allocate(m * (n + VIEW_GAP) + 1, sizeof(double));
    v->values = check_allocate(m * n + 1, sizeof(double));
    v->row_indices = check_allocate(m * n + 1, sizeof(int32_t));
    v->column_starts = check_allocate(n + 1, sizeof(int32_t));
    for (k = 0; k < (m + VIEW_GAP) * n; k++)
        v->by_columns[k] = NAN;
    for (k = 0; k < m * (n + VIEW_GAP); k++)
        v->by_rows[k] = NAN;
    for (j = 0; j < columns; j++) {
        for (i = 0; i < rows; i++) {
            const double entry = entries[(size_t)i + m * (size_t)j];

            v->by_columns[(size_t)i + (m + VIEW_GAP) * (size_t)j] = entry;
            v->by_rows[(size_t)i * (n + VIEW_GAP) + (size_t)j] = entry;
            if (entry == 0.0)
                continue;
            v->values[count] = entry;
            v->row_indices[count++] = i;
        }
        v->column_starts[j + 1] = count;
    }
    for (k = 0; k < VIEWS; k++)
        assert_int_equal(perp_struct_init(&v->caller[k], sizeof v->caller[k]), PERP_OK);
    perp_matrix_dense(&v->caller[VIEW_BY_COLUMNS], PERP_STORAGE_COLUMN_MAJOR, rows, columns,
                      v->by_columns, rows + VIEW_GAP);
    perp_matrix_dense(&v->caller[VIEW_BY_ROWS], PERP_STORAGE_ROW_MAJOR, rows, columns, v->by_rows,
                      columns + VIEW_GAP);
    perp_matrix_csc(&v->caller[VIEW_CSC], rows, columns, v->column_starts, v->row_indices,
                    v->values);
    for (k = 0; k < VIEWS; k++)
        assert_int_equal(perp__matrix_read(NULL, "M", &v->view[k], &v->caller[k]), PERP_OK);
}

#endif
