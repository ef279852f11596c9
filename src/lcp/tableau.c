#include "lcp/tableau.h"

#include <string.h>

#include "linalg/blas.h"

/* From this size on delayed exchanges beat immediate ones (bench/lcp_dense). */
#define PERP__DELAY_FROM 96
#define PERP__DELAY 32

void perp__tableau_layout(perp__arena *arena, perp__tableau *t, int32_t rows, int32_t columns)
{
    size_t ld = (size_t)rows, width = (size_t)columns;

    t->leading_dimension = rows > 0 ? rows : 1;
    t->delay = rows >= PERP__DELAY_FROM ? PERP__DELAY : 0;
    t->T = perp__arena_take(arena, ld * width, sizeof(double));
    t->U = perp__arena_take(arena, ld * (size_t)t->delay, sizeof(double));
    t->V = perp__arena_take(arena, width * (size_t)t->delay, sizeof(double));
}

void perp__tableau_reset(perp__tableau *t, int32_t rows, int32_t columns)
{
    t->rows = rows;
    t->columns = columns;
    t->pending = 0;
}

void perp__tableau_column(const perp__tableau *t, int32_t c, double *column)
{
    const double *from = t->T + (size_t)c * (size_t)t->leading_dimension;

    memcpy(column, from, (size_t)t->rows * sizeof *column);
    if (t->pending > 0)
        perp__gemv_subtract(t->rows, t->pending, t->U, t->leading_dimension,
                            t->V + (size_t)c * (size_t)t->delay, 1, column);
}

void perp__tableau_row(const perp__tableau *t, int32_t r, double *row)
{
    const size_t ld = (size_t)t->leading_dimension;
    int32_t j;

    for (j = 0; j < t->columns; j++)
        row[j] = t->T[(size_t)r + (size_t)j * ld];
    if (t->pending > 0)
        perp__gemv_transposed_subtract(t->pending, t->columns, t->V, t->delay, t->U + r,
                                       t->leading_dimension, row);
}

/* T(i,j) - T(i,c) T(r,j) / p for i != r, j != c */
static void apply_now(perp__tableau *t, int32_t r, int32_t c, const double *column,
                      const double *row)
{
    const size_t ld = (size_t)t->leading_dimension;
    int32_t i, j;

    (void)r; /* column[r] is 0 here: row r keeps what exchange() wrote */
    for (j = 0; j < t->columns; j++) {
        double *into = t->T + (size_t)j * ld;
        double factor = row[j];

        if (j == c || factor == 0.0)
            continue;
        for (i = 0; i < t->rows; i++)
            into[i] -= column[i] * factor;
    }
}

void perp__tableau_flush(perp__tableau *t)
{
    if (t->pending > 0)
        perp__gemm_subtract(t->rows, t->columns, t->pending, t->U, t->leading_dimension, t->V,
                            t->delay, t->T, t->leading_dimension);
    t->pending = 0;
}

void perp__tableau_drop(perp__tableau *t, int32_t c)
{
    const size_t ld = (size_t)t->leading_dimension, delay = (size_t)t->delay;
    const size_t last = (size_t)--t->columns;

    if ((size_t)c == last)
        return;
    memcpy(t->T + (size_t)c * ld, t->T + last * ld, (size_t)t->rows * sizeof *t->T);
    memcpy(t->V + (size_t)c * delay, t->V + last * delay, (size_t)t->pending * sizeof *t->V);
}

void perp__tableau_exchange(perp__tableau *t, int32_t r, int32_t c, double *column, double *row)
{
    const size_t ld = (size_t)t->leading_dimension;
    const double pivot = column[r];
    double *into = t->T + (size_t)c * ld;
    int32_t i, j, k;

    /* row r and column c are written afresh, and the kept exchanges forget them: taking them as a
     * difference of large numbers would lose them */
    for (j = 0; j < t->columns; j++)
        t->T[(size_t)r + (size_t)j * ld] = row[j] / pivot;
    for (i = 0; i < t->rows; i++) {
        column[i] /= pivot;
        into[i] = -column[i];
    }
    into[r] = 1.0 / pivot;
    for (k = 0; k < t->pending; k++) {
        t->U[(size_t)r + (size_t)k * ld] = 0.0;
        t->V[(size_t)k + (size_t)c * (size_t)t->delay] = 0.0;
    }
    column[r] = 0.0;
    row[c] = 0.0;
    if (t->delay == 0) {
        apply_now(t, r, c, column, row);
        return;
    }
    memcpy(t->U + (size_t)t->pending * ld, column, (size_t)t->rows * sizeof *column);
    for (j = 0; j < t->columns; j++)
        t->V[(size_t)t->pending + (size_t)j * (size_t)t->delay] = row[j];
    if (++t->pending == t->delay)
        perp__tableau_flush(t);
}
