/* Row by row, each row of L as a sparse triangular solve along the elimination tree: Davis,
 * "Algorithm 849: a concise sparse Cholesky factorization package", ACM TOMS 31 (2005); the notions
 * in his "Direct Methods for Sparse Linear Systems" (2006), chapter 4. Order: Amestoy, Davis &
 * Duff, "Algorithm 837: AMD", ACM TOMS 30 (2004). */
#include "linalg/sparse_cholesky.h"

#include <amd.h>
#include <math.h>
#include <string.h>

#include "base/context.h"

static void layout(perp__arena *arena, void *object)
{
    perp__sparse_cholesky *c = object;
    const size_t n = (size_t)c->M->columns;

    c->pattern_starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
    c->pattern_rows = perp__arena_take(arena, (size_t)c->M->column_starts[n], sizeof(int32_t));
    PERP__INTEGERS(arena, n, &c->order, &c->node, &c->local, &c->parent, &c->mark, &c->stack,
                   &c->column_counts);
    c->starts = perp__arena_take(arena, n + 1, sizeof(size_t));
    PERP__DOUBLES(arena, n, &c->pivots, &c->work, &c->permuted);
}

static void layout_factor(perp__arena *arena, void *object)
{
    perp__sparse_cholesky *c = object;

    c->rows = perp__arena_take(arena, c->entries, sizeof(int32_t));
    c->values = perp__arena_take(arena, c->entries, sizeof(double));
}

/* Numbers the block in order of elimination. local holds 0 for its rows on entry, else -1. */
static void number_block(perp__sparse_cholesky *c)
{
    const int32_t n = c->M->columns;
    int32_t r, count = 0;

    for (r = 0; r < n; r++) {
        const int32_t i = c->order[r];

        if (c->local[i] >= 0) {
            c->local[i] = count;
            c->node[count++] = i;
        }
    }
    c->count = count;
}

/* The elimination tree, the columns' counts and starts. */
static void count_columns(perp__sparse_cholesky *c)
{
    const perp__matrix *M = c->M;

    for (int32_t k = 0; k < c->count; k++) {
        const int32_t j = c->node[k];

        c->parent[k] = -1;
        c->mark[k] = k;
        c->column_counts[k] = 0;
        for (int32_t p = M->column_starts[j]; p < M->column_starts[j + 1]; p++) {
            int32_t i = c->local[M->row_indices[p]];

            if (i < 0 || i >= k)
                continue;
            for (; c->mark[i] != k; i = c->parent[i]) {
                if (c->parent[i] < 0)
                    c->parent[i] = k;
                c->column_counts[i]++;
                c->mark[i] = k;
            }
        }
    }
    c->starts[0] = 0;
    for (int32_t k = 0; k < c->count; k++)
        c->starts[k + 1] = c->starts[k] + (size_t)c->column_counts[k];
}

perp_status perp__sparse_cholesky_analyse(perp__sparse_cholesky *cholesky, perp_context *context,
                                          const perp__matrix *M, const double *scale)
{
    const size_t starts = ((size_t)M->columns + 1) * sizeof(int32_t);
    const size_t rows = (size_t)M->column_starts[M->columns] * sizeof(int32_t);
    perp_status status;

    cholesky->M = M;
    cholesky->scale = scale;
    if (cholesky->pattern_size == M->columns &&
        !memcmp(cholesky->pattern_starts, M->column_starts, starts) &&
        !memcmp(cholesky->pattern_rows, M->row_indices, rows))
        return PERP_OK;
    cholesky->pattern_size = 0;
    status = perp__arena_fit(&cholesky->arena, context, layout, cholesky);
    if (status != PERP_OK)
        return status;
    /* AMD reads the pattern only, but does not say so in its types */
    if (amd_order(M->columns, (int *)M->column_starts, (int *)M->row_indices, cholesky->order, NULL,
                  NULL) < AMD_OK)
        return perp__fail_memory(context, "an ordering");
    memset(cholesky->local, 0, (size_t)M->columns * sizeof *cholesky->local);
    number_block(cholesky);
    count_columns(cholesky);
    cholesky->entries = cholesky->starts[M->columns];
    status = perp__arena_fit(&cholesky->factor_arena, context, layout_factor, cholesky);
    if (status == PERP_OK) {
        memcpy(cholesky->pattern_starts, M->column_starts, starts);
        memcpy(cholesky->pattern_rows, M->row_indices, rows);
        cholesky->pattern_size = M->columns;
    }
    return status;
}

/* Row k of L and pivot k. */
static void eliminate_row(perp__sparse_cholesky *c, int32_t k, double rho)
{
    const perp__matrix *M = c->M;
    const int32_t j = c->node[k];
    int32_t top = c->count;
    double pivot;

    /* 1. Row k of the block's matrix goes into work, and the pattern of row k of L onto the stack,
     * from stack[top] to the end, in topological order. */
    c->mark[k] = k;
    c->column_counts[k] = 0;
    for (int32_t p = M->column_starts[j]; p < M->column_starts[j + 1]; p++) {
        const int32_t row = M->row_indices[p];
        int32_t i = c->local[row], length = 0;

        if (i < 0 || i > k)
            continue;
        c->work[i] = M->values[p] * (c->scale[row] * c->scale[j]);
        for (; c->mark[i] != k; i = c->parent[i]) {
            c->stack[length++] = i;
            c->mark[i] = k;
        }
        while (length > 0)
            c->stack[--top] = c->stack[--length];
    }
    /* 2. The triangular solve. */
    pivot = c->work[k] + rho;
    c->work[k] = 0.0;
    for (; top < c->count; top++) {
        const int32_t i = c->stack[top];
        const double y = c->work[i];
        const double l = y / c->pivots[i];
        const size_t start = c->starts[i], end = start + (size_t)c->column_counts[i];
        const int32_t *rows = c->rows;
        const double *values = c->values;

        c->work[i] = 0.0;
        for (size_t p = start; p < end; p++)
            c->work[rows[p]] -= values[p] * y;
        pivot -= l * y;
        c->rows[end] = k;
        c->values[end] = l;
        c->column_counts[i]++;
    }
    c->pivots[k] = pivot;
}

int32_t perp__sparse_cholesky_factor(perp__sparse_cholesky *cholesky, const int32_t *active,
                                     int32_t count, double rho)
{
    for (int32_t i = 0; i < cholesky->M->columns; i++)
        cholesky->local[i] = -1;
    for (int32_t k = 0; k < count; k++)
        cholesky->local[active[k]] = 0;
    number_block(cholesky);
    count_columns(cholesky);
    for (int32_t k = 0; k < count; k++) {
        cholesky->work[k] = 0.0;
        cholesky->mark[k] = -1;
    }
    for (int32_t k = 0; k < count; k++) {
        eliminate_row(cholesky, k, rho);
        if (!(cholesky->pivots[k] > 0.0) || !isfinite(cholesky->pivots[k]))
            return 0;
    }
    return 1;
}

void perp__sparse_cholesky_solve(perp__sparse_cholesky *cholesky, double *x)
{
    const int32_t count = cholesky->count;
    const size_t *starts = cholesky->starts;
    double *y = cholesky->permuted;

    for (int32_t k = 0; k < count; k++)
        y[k] = x[cholesky->node[k]];
    for (int32_t k = 0; k < count; k++)
        for (size_t p = starts[k]; p < starts[k + 1]; p++)
            y[cholesky->rows[p]] -= cholesky->values[p] * y[k];
    for (int32_t k = count - 1; k >= 0; k--) {
        double sum = y[k] / cholesky->pivots[k], odd = 0.0; /* two, as each waits for its last */
        size_t p = starts[k];

        for (; p + 1 < starts[k + 1]; p += 2) {
            sum -= cholesky->values[p] * y[cholesky->rows[p]];
            odd += cholesky->values[p + 1] * y[cholesky->rows[p + 1]];
        }
        if (p < starts[k + 1])
            sum -= cholesky->values[p] * y[cholesky->rows[p]];
        y[k] = sum - odd;
    }
    for (int32_t k = 0; k < count; k++)
        x[cholesky->node[k]] = y[k];
}

void perp__sparse_cholesky_release(perp__sparse_cholesky *cholesky)
{
    perp__arena_release(&cholesky->arena);
    perp__arena_release(&cholesky->factor_arena);
}
