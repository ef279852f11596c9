#include "lcp/pgs_rows.h"

#include <string.h>

void perp__rows_layout(perp__arena *arena, perp__rows *rows, const perp__lcp_problem *problem)
{
    const perp__matrix *M = problem->M;
    size_t n = (size_t)problem->n;
    size_t entries = M->column_starts ? (size_t)M->column_starts[n] : n * n;

    rows->n = problem->n;
    rows->diagonal = perp__arena_take(arena, n, sizeof(double));
    rows->before = perp__arena_take(arena, n, sizeof(double));
    rows->values = perp__arena_take(arena, entries, sizeof(double));
    rows->columns = NULL;
    rows->starts = NULL;
    if (M->column_starts) {
        rows->columns = perp__arena_take(arena, entries, sizeof(int32_t));
        rows->starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
    }
}

static void read_dense(perp__rows *rows, const perp__matrix *M, const double *d)
{
    for (int32_t i = 0; i < rows->n; i++) {
        const double *source = M->values + (size_t)i * M->row_stride;
        double *row = rows->values + (size_t)i * (size_t)rows->n;

        for (int32_t j = 0; j < rows->n; j++)
            row[j] = source[(size_t)j * M->column_stride] * (d[i] * d[j]);
        rows->diagonal[i] = row[i];
        rows->before[i] = 0.0;
    }
}

static int32_t kept_apart(int32_t i, int32_t j)
{
    return j == i || j == i - 1;
}

/* starts[i] := the place of row i's first entry. */
static void count_rows(perp__rows *rows, const perp__matrix *M)
{
    memset(rows->starts, 0, ((size_t)rows->n + 1) * sizeof(int32_t));
    for (int32_t j = 0; j < rows->n; j++)
        for (int32_t p = M->column_starts[j]; p < M->column_starts[j + 1]; p++)
            if (!kept_apart(M->row_indices[p], j))
                rows->starts[M->row_indices[p] + 1]++;
    for (int32_t i = 0; i < rows->n; i++)
        rows->starts[i + 1] += rows->starts[i];
}

static void read_sparse(perp__rows *rows, const perp__matrix *M, const double *d)
{
    count_rows(rows, M);
    memset(rows->diagonal, 0, (size_t)rows->n * sizeof(double));
    memset(rows->before, 0, (size_t)rows->n * sizeof(double));
    for (int32_t j = 0; j < rows->n; j++) {
        for (int32_t p = M->column_starts[j]; p < M->column_starts[j + 1]; p++) {
            int32_t i = M->row_indices[p];
            double value = M->values[p] * (d[i] * d[j]);

            if (i == j)
                rows->diagonal[i] = value;
            else if (kept_apart(i, j))
                rows->before[i] = value;
            else {
                int32_t place = rows->starts[i]++;

                rows->columns[place] = j;
                rows->values[place] = value;
            }
        }
    }
    /* every start has moved to where the next row starts: shift them back */
    memmove(rows->starts + 1, rows->starts, (size_t)rows->n * sizeof(int32_t));
    rows->starts[0] = 0;
}

void perp__rows_read(perp__rows *rows, const perp__lcp_problem *problem)
{
    if (rows->columns)
        read_sparse(rows, problem->M, problem->factors);
    else
        read_dense(rows, problem->M, problem->factors);
}
