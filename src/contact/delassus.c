#include "contact/delassus.h"

#include <math.h>
#include <string.h>

#include "base/context.h"

static double *entry_place(const perp__matrix *W, double *values, size_t i, size_t j)
{
    return values + i * W->row_stride + j * W->column_stride;
}

void perp__delassus_diagonal(const perp__matrix *W, double *diagonal)
{
    for (int32_t j = 0; j < W->columns; j++) {
        diagonal[j] = 0.0;
        if (!W->column_starts) {
            diagonal[j] = W->values[(size_t)j * (W->row_stride + W->column_stride)];
            continue;
        }
        for (int32_t k = W->column_starts[j]; k < W->column_starts[j + 1]; k++)
            if (W->row_indices[k] == j)
                diagonal[j] = W->values[k];
    }
}

static void lay_out(perp__arena *arena, void *object)
{
    perp__delassus *own = object;
    const perp__matrix *W = &own->given;
    const size_t n = (size_t)W->rows;

    if (!W->column_starts) {
        own->values = perp__arena_take(arena, n, n * sizeof(double));
        return;
    }
    own->values =
        perp__arena_take(arena, (size_t)W->column_starts[n] + (size_t)own->missing, sizeof(double));
    own->rows = perp__arena_take(arena, (size_t)W->column_starts[n] + (size_t)own->missing,
                                 sizeof(int32_t));
    own->starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
}

static void copy_dense(perp__delassus *own, const double *compliance)
{
    const perp__matrix *W = &own->given;
    const size_t n = (size_t)W->rows;
    perp__matrix copy = *W;

    copy.row_stride = W->row_stride == 1 ? 1 : n;
    copy.column_stride = W->row_stride == 1 ? n : 1;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            *entry_place(&copy, own->values, i, j) =
                W->values[i * W->row_stride + j * W->column_stride] +
                (i == j ? compliance[i] : 0.0);
}

static void copy_sparse(perp__delassus *own, const double *compliance)
{
    const perp__matrix *W = &own->given;
    int32_t j, k, to = 0;

    for (j = 0; j < W->columns; j++) {
        int32_t placed = 0;

        own->starts[j] = to;
        for (k = W->column_starts[j]; k < W->column_starts[j + 1]; k++) {
            if (!placed && W->row_indices[k] >= j) {
                const int32_t present = W->row_indices[k] == j;

                placed = 1;
                own->rows[to] = j;
                own->values[to++] = (present ? W->values[k] : 0.0) + compliance[j];
                if (present)
                    continue;
            }
            own->rows[to] = W->row_indices[k];
            own->values[to++] = W->values[k];
        }
        if (!placed) {
            own->rows[to] = j;
            own->values[to++] = compliance[j];
        }
    }
    own->starts[W->columns] = to;
}

static int32_t count_missing(const perp__matrix *W)
{
    int32_t j, k, missing = 0;

    for (j = 0; W->column_starts && j < W->columns; j++) {
        for (k = W->column_starts[j]; k < W->column_starts[j + 1] && W->row_indices[k] != j; k++)
            ;
        missing += k == W->column_starts[j + 1];
    }
    return missing;
}

perp_status perp__delassus_add(perp__delassus *own, perp_context *context, perp__matrix *W,
                               const double *compliance)
{
    perp_status status;

    own->given = *W;
    own->missing = count_missing(W);
    if (W->column_starts && W->column_starts[W->columns] > INT32_MAX - own->missing)
        return perp__fail_memory(context, "W with compliance");
    own->arena.context = context;
    status = perp__arena_fit(&own->arena, lay_out, own);
    if (status != PERP_OK)
        return status;
    W->values = own->values;
    if (W->column_starts) {
        copy_sparse(own, compliance);
        W->column_starts = own->starts;
        W->row_indices = own->rows;
    } else {
        copy_dense(own, compliance);
        W->row_stride = W->row_stride == 1 ? 1 : (size_t)W->rows;
        W->column_stride = W->row_stride == 1 ? (size_t)W->rows : 1;
    }
    return PERP_OK;
}

void perp__absolute_product(const perp__matrix *W, const double *x, const double *add, double *out)
{
    for (int32_t i = 0; i < W->rows; i++)
        out[i] = fabs(add[i]);
    if (!W->column_starts && W->row_stride != 1) {
        for (int32_t i = 0; i < W->rows; i++)
            for (int32_t j = 0; j < W->columns; j++)
                out[i] += fabs(W->values[(size_t)i * W->row_stride + (size_t)j] * x[j]);
        return;
    }
    for (int32_t j = 0; j < W->columns; j++) {
        const double *column = W->values + (size_t)j * W->column_stride;

        if (x[j] == 0.0)
            continue;
        if (W->column_starts)
            for (int32_t k = W->column_starts[j]; k < W->column_starts[j + 1]; k++)
                out[W->row_indices[k]] += fabs(W->values[k] * x[j]);
        else
            for (int32_t i = 0; i < W->rows; i++)
                out[i] += fabs(column[i] * x[j]);
    }
}

/* Column by column: the sum of products of each, with its errors beside it (linalg/doubled.c). */
static void sparse_transposed(const perp__matrix *A, const double *x, const double *add,
                              double *high, double *low)
{
    for (int32_t j = 0; j < A->columns; j++) {
        double sum = add ? add[j] : 0.0, error = 0.0, total;

        for (int32_t k = A->column_starts[j]; k < A->column_starts[j + 1]; k++) {
            const double factor = x[A->row_indices[k]];
            const double product = A->values[k] * factor;
            const double next = sum + product, part = next - sum;

            error +=
                fma(A->values[k], factor, -product) + ((sum - (next - part)) + (product - part));
            sum = next;
        }
        total = sum + error;
        high[j] = total;
        low[j] = isfinite(total) ? error - (total - sum) : 0.0;
    }
}

void perp__transposed_doubled(const perp__matrix *A, const double *x, const double *add,
                              double *high, double *low)
{
    perp__matrix transposed = *A;

    if (A->column_starts) {
        sparse_transposed(A, x, add, high, low);
        return;
    }
    transposed.rows = A->columns;
    transposed.columns = A->rows;
    transposed.row_stride = A->column_stride;
    transposed.column_stride = A->row_stride;
    perp__multiply_doubled(&transposed, x, add, high, low);
}

static void lay_out_bodies(perp__arena *arena, void *object)
{
    perp__delassus *own = object;

    own->values = perp__arena_take(arena, (size_t)own->entries, sizeof(double));
    own->rows = perp__arena_take(arena, (size_t)own->entries, sizeof(int32_t));
    own->starts = perp__arena_take(arena, (size_t)own->given.rows + 1, sizeof(int32_t));
}

perp_status perp__delassus_of_bodies(perp__delassus *own, perp_context *context,
                                     const perp__bodies *bodies, perp__matrix *W, int32_t *made)
{
    perp_status status;

    own->entries = perp__bodies_delassus_entries(bodies);
    *made = own->entries >= 0;
    if (!*made)
        return PERP_OK;
    memset(&own->given, 0, sizeof own->given);
    own->given.rows = own->given.columns = bodies->size;
    own->given.row_stride = own->given.column_stride = 1;
    own->arena.context = context;
    status = perp__arena_fit(&own->arena, lay_out_bodies, own);
    if (status != PERP_OK)
        return status;
    perp__bodies_delassus(bodies, own->starts, own->rows, own->values);
    *W = own->given;
    W->values = own->values;
    W->column_starts = own->starts;
    W->row_indices = own->rows;
    return PERP_OK;
}
