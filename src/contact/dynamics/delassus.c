/* The matrix W as the methods see it: the caller's, or one of our own. */
#include "contact/dynamics/dynamics.h"

#include <math.h>

#include "base/context.h"
#include "linalg/doubled.h"

void perp__delassus_diagonal(const perp__matrix *W, double *diagonal)
{
    for (int32_t j = 0; j < W->columns; j++)
        diagonal[j] = perp__entry(W, j, j);
}

static void lay_out(perp__arena *arena, void *object)
{
    perp__delassus *view = object;

    view->values = perp__arena_take(arena, (size_t)view->entries, sizeof(double));
    view->rows = view->starts = NULL;
    if (!view->sparse)
        return;
    view->rows = perp__arena_take(arena, (size_t)view->entries, sizeof(int32_t));
    view->starts = perp__arena_take(arena, (size_t)view->size + 1, sizeof(int32_t));
}

/* Room for a matrix of so many entries; and its view, which is to be filled. */
static perp_status fit(perp__delassus *view, perp_context *context, perp__matrix *W, int32_t size,
                       int64_t entries)
{
    perp_status status;

    view->size = size;
    view->entries = entries;
    status = perp__arena_fit(&view->arena, context, lay_out, view);
    if (status == PERP_OK)
        *W = (perp__matrix){size,         size,         1,         view->sparse ? 1 : (size_t)size,
                            view->values, view->starts, view->rows};
    return status;
}

perp_status perp__delassus_add(perp__delassus *view, perp_context *context, perp__matrix *W,
                               const double *compliance)
{
    const perp__matrix given = *W;
    const int64_t n = given.rows;
    int32_t to = 0;
    perp_status status;

    view->sparse = given.column_starts != NULL;
    if (view->sparse && given.column_starts[n] > INT32_MAX - n)
        return perp__fail_memory(context, "W with compliance");
    status = fit(view, context, W, given.rows, view->sparse ? given.column_starts[n] + n : n * n);
    if (status != PERP_OK)
        return status;
    if (!view->sparse) {
        perp__matrix_spread(&given, view->values, (size_t)n);
        for (int64_t i = 0; i < n; i++)
            view->values[i * (n + 1)] += compliance[i];
        return PERP_OK;
    }
    for (int32_t j = 0; j < given.columns; j++) { /* with all of the diagonal */
        const perp__line column = perp__line_of(&given, j);
        int32_t k = 0;

        view->starts[j] = to;
        for (; k < column.count && column.indices[k] < j; k++) {
            view->rows[to] = column.indices[k];
            view->values[to++] = column.values[k];
        }
        view->rows[to] = j;
        view->values[to] = compliance[j];
        if (k < column.count && column.indices[k] == j)
            view->values[to] += column.values[k++];
        for (to++; k < column.count; k++) {
            view->rows[to] = column.indices[k];
            view->values[to++] = column.values[k];
        }
    }
    view->starts[n] = to;
    return PERP_OK;
}

void perp__absolute_product(const perp__matrix *W, const double *x, const double *add, double *out)
{
    const bool by_rows = perp__lines_are_rows(W);

    for (int32_t i = 0; i < W->rows; i++)
        out[i] = add ? fabs(add[i]) : 0.0;
    for (int32_t j = 0; W->rows > 0 && j < (by_rows ? W->rows : W->columns); j++) {
        const perp__line line = perp__line_of(W, j);

        if (by_rows)
            for (int32_t k = 0; k < line.count; k++)
                out[j] += fabs(line.values[k] * x[k]);
        else if (line.indices)
            for (int32_t k = 0; k < line.count; k++)
                out[line.indices[k]] += fabs(line.values[k] * x[j]);
        else if (x[j] != 0.0)
            for (int32_t k = 0; k < line.count; k++)
                out[k] += fabs(line.values[k] * x[j]);
    }
}

void perp__absolute_transposed(const perp__matrix *A, const double *x, double *out)
{
    perp__cursor c = perp__first(A);

    while (A->rows > 0 && perp__advance(&c))
        out[c.j] += fabs(c.value * x[c.i]);
}

void perp__transposed_doubled(const perp__matrix *A, const double *x, const double *add,
                              double *high, double *low)
{
    if (!A->column_starts) {
        const perp__matrix transposed = {
            A->columns, A->rows, A->column_stride, A->row_stride, A->values, NULL, NULL};

        perp__multiply_doubled(&transposed, x, add, high, low);
        return;
    }
    for (int32_t j = 0; j < A->columns; j++) { /* the sum of products, its errors beside it */
        high[j] = add ? add[j] : 0.0;
        low[j] = 0.0;
        for (int32_t k = A->column_starts[j]; k < A->column_starts[j + 1]; k++)
            perp__accumulate(&high[j], &low[j], A->values[k], x[A->row_indices[k]]);
        perp__round_sum(&high[j], &low[j]);
    }
}

perp_status perp__delassus_of_bodies(perp__delassus *view, perp_context *context,
                                     const perp__bodies *bodies, perp__matrix *W, int32_t *made)
{
    const int64_t entries = perp__bodies_delassus_entries(bodies);
    perp_status status;

    *made = entries >= 0;
    if (!*made)
        return PERP_OK;
    view->sparse = 1;
    status = fit(view, context, W, bodies->size, entries);
    if (status == PERP_OK)
        perp__bodies_delassus(bodies, view->starts, view->rows, view->values);
    return status;
}
