#include "lcp/lemke/lemke.h"

#include <string.h>

#include "linalg/matrix.h"

/* Exchanges are applied to a column a group at a time. */
enum { GROUP = PERP__GROUP };

/* Exchanges kept: twice as many as rows where U then has no more than so many entries, which caches
 * hold. Most paths are no longer than that, and T is never updated; on larger tableaus a delay
 * means longer sums for each column and fewer passes over T (bench/lcp_dense). */
enum { MOST_ENTRIES = 1 << 18, DELAY = 64 };

/* Small tableaus are brought up to date by plain arithmetic, too, a column after the other: that
 * keeps ties and zeros of exact data. From this size on the fused kernels' speed counts. */
enum { FUSED_FROM = 96 };

static size_t panels_of(int32_t rows)
{
    return ((size_t)rows + PERP__PANEL - 1) / PERP__PANEL;
}

size_t perp__tableau_length(int32_t rows)
{
    return panels_of(rows) * PERP__PANEL;
}

/* From one panel of U to the next. */
static size_t stride_of(const perp__tableau *t)
{
    return (size_t)t->delay * PERP__PANEL;
}

/* U(r,0); the next entry is PERP__PANEL further. */
static double *row_of(const perp__tableau *t, int32_t r)
{
    return t->U + (size_t)r / PERP__PANEL * stride_of(t) + (size_t)r % PERP__PANEL;
}

void perp__tableau_layout(perp__arena *arena, perp__tableau *t, int32_t rows, int32_t columns)
{
    const size_t length = perp__tableau_length(rows);
    /* an odd number of panels, so that the columns of a tile don't meet in the same cache lines */
    const size_t ld = (panels_of(rows) | 1) * PERP__PANEL;
    const size_t width = ((size_t)columns + PERP__TILE - 1) / PERP__TILE * PERP__TILE;
    const size_t delay = 2 * length * length <= MOST_ENTRIES ? 2 * length : DELAY;

    t->kernels = perp__panel_kernels_number(0);
    t->leading_dimension = (int32_t)ld;
    t->delay = (int32_t)delay;
    t->T = perp__arena_take(arena, ld * width, sizeof(double));
    t->U = perp__arena_take(arena, length * delay, sizeof(double));
    t->L = perp__arena_take(arena, delay * delay, sizeof(double));
    PERP__DOUBLES(arena, delay * PERP__STRIP, &t->V, &t->rewritten);
    t->pivots = perp__arena_take(arena, delay, sizeof(double));
    PERP__INTEGERS(arena, delay, &t->exchanged, &t->entered, &t->again);
    t->last = perp__arena_take(arena, (size_t)rows, sizeof(int32_t));
    t->started = perp__arena_take(arena, width, sizeof(int32_t));
}

static void forget(perp__tableau *t)
{
    t->pending = 0;
    for (int32_t i = 0; i < t->rows; i++)
        t->last[i] = -1;
    for (int32_t i = 0; i < t->columns; i++)
        t->started[i] = 0;
}

void perp__tableau_reset(perp__tableau *t, int32_t rows, int32_t columns)
{
    t->rows = rows;
    t->columns = columns;
    forget(t);
}

void perp__tableau_column(perp__tableau *t, int32_t c, double *column)
{
    const size_t pending = (size_t)t->pending, panels = panels_of(t->rows);
    const perp__exchanges e = {t->exchanged, t->pivots, t->L, (size_t)t->delay};
    const double *from = t->T + (size_t)c * (size_t)t->leading_dimension;
    double v[GROUP];
    size_t last;

    if (column != from)
        memcpy(column, from, (size_t)t->rows * sizeof *column);
    for (last = (size_t)t->rows; last < panels * PERP__PANEL; last++)
        column[last] = 0.0;
    for (size_t first = (size_t)t->started[c]; first < pending; first = last) {
        last = first - first % GROUP + GROUP;
        if (last > pending)
            last = pending;
        t->kernels->eliminate(&e, first, last, v, column);
        t->kernels->subtract_vector(panels, last - first, t->U + first * PERP__PANEL, stride_of(t),
                                    v, column);
    }
}

/* y := y + T x for `count` columns from the first on */
static void add_columns(const perp__tableau *t, int32_t first, int32_t count, const double *x,
                        double *y)
{
    const size_t ld = (size_t)t->leading_dimension;
    const perp__matrix view = {(int32_t)perp__tableau_length(t->rows),
                               count,
                               1,
                               ld,
                               t->T + (size_t)first * ld,
                               NULL,
                               NULL};

    perp__multiply_add(&view, x, y);
}

/* As perp__tableau_column for the sum of all columns, each of which joins it after the exchange
 * that wrote it. */
void perp__tableau_multiply(perp__tableau *t, double *x, double *y)
{
    const size_t panels = panels_of(t->rows), pending = (size_t)t->pending;
    double *later = t->V, v[GROUP];
    size_t last;

    for (size_t k = 0; k < pending; k++) {
        later[k] = (size_t)t->started[t->entered[k]] == k + 1 ? x[t->entered[k]] : 0.0;
        x[t->entered[k]] = later[k] == 0.0 ? x[t->entered[k]] : 0.0;
    }
    memset(y, 0, panels * PERP__PANEL * sizeof *y);
    add_columns(t, 0, t->columns, x, y);
    for (size_t first = 0; first < pending; first = last) {
        last = first + GROUP < pending ? first + GROUP : pending;
        for (size_t k = first; k < last; k++) {
            const double *owed = t->L + k * (size_t)t->delay;
            const int32_t r = t->exchanged[k];

            v[k - first] = y[r];
            for (size_t l = first; l < k; l++)
                v[k - first] -= owed[l] * v[l - first];
            y[r] = v[k - first] / t->pivots[k];
            if (later[k] != 0.0)
                add_columns(t, t->entered[k], 1, &later[k], y);
        }
        t->kernels->subtract_vector(panels, last - first, t->U + first * PERP__PANEL, stride_of(t),
                                    v, y);
    }
}

/* What becomes of columns begin .. begin + width - 1, a strip. */
static void flush_strip(perp__tableau *t, size_t begin, size_t width)
{
    const size_t ld = (size_t)t->leading_dimension, pending = (size_t)t->pending;
    const int32_t *started = t->started + begin;
    double *T = t->T + begin * ld;
    int32_t newest = 0;

    /* 1. V := the rows that were exchanged. */
    for (size_t j = 0; j < PERP__STRIP; j++)
        for (size_t k = 0; k < pending; k++)
            t->V[k * PERP__STRIP + j] = j < width ? T[j * ld + (size_t)t->exchanged[k]] : 0.0;
    /* 2. V and what becomes of these rows. Columns that were written afresh after exchange k have
     * nothing to do with it. */
    for (size_t j = 0; j < width; j++)
        newest = started[j] > newest ? started[j] : newest;
    for (size_t k = 0; k < pending; k++) {
        double *v = t->V + k * PERP__STRIP, *rewritten = t->rewritten + k * PERP__STRIP;
        double *again = t->V + (size_t)t->again[k] * PERP__STRIP;

        t->kernels->subtract_rows(k, t->L + k * (size_t)t->delay, t->V, t->pivots[k], v, rewritten);
        for (size_t j = 0; j < width && k < (size_t)newest; j++)
            if ((size_t)started[j] > k)
                v[j] = 0.0;
        for (size_t j = 0; j < width && t->again[k] > 0; j++)
            if ((size_t)started[j] <= k)
                again[j] = rewritten[j];
    }
    for (size_t j = 0; j < width; j++)
        for (size_t k = (size_t)started[j]; k < pending; k++)
            T[j * ld + (size_t)t->exchanged[k]] = t->rewritten[k * PERP__STRIP + j];
    /* 3. All the others. */
    for (size_t j = 0; j < width; j += PERP__TILE)
        t->kernels->subtract_tile(panels_of(t->rows), pending, t->U, stride_of(t), t->V + j,
                                  T + j * ld, ld);
}

void perp__tableau_flush(perp__tableau *t)
{
    const size_t columns = (size_t)t->columns, ld = (size_t)t->leading_dimension;
    const size_t pending = (size_t)t->pending;
    const bool is_small = t->rows < FUSED_FROM;

    for (int32_t c = 0; c < t->columns && is_small; c++)
        perp__tableau_column(t, c, t->T + (size_t)c * ld);
    for (size_t k = 0; k < pending && !is_small; k++) /* all groups are one now */
        for (size_t j = 0; j < k; j++)
            row_of(t, t->exchanged[k])[j * PERP__PANEL] = 0.0;
    for (size_t begin = 0; begin < columns && pending > 0 && !is_small; begin += PERP__STRIP)
        flush_strip(t, begin, columns - begin < PERP__STRIP ? columns - begin : PERP__STRIP);
    forget(t);
}

void perp__tableau_drop(perp__tableau *t, int32_t c)
{
    const size_t ld = (size_t)t->leading_dimension;
    const int32_t last = --t->columns;

    if (c == last)
        return;
    memcpy(t->T + (size_t)c * ld, t->T + (size_t)last * ld, (size_t)t->rows * sizeof *t->T);
    t->started[c] = t->started[last];
    if (t->started[c] > 0)
        t->entered[t->started[c] - 1] = c;
}

void perp__tableau_exchange(perp__tableau *t, int32_t r, int32_t c, const double *column)
{
    double *into = t->T + (size_t)c * (size_t)t->leading_dimension, *row = row_of(t, r), *owed;
    int32_t k, l;

    if (t->pending == t->delay)
        perp__tableau_flush(t);
    k = t->pending;
    /* 1. Row r owes nothing to exchanges before this one any more. Those of earlier groups have
     * been applied when its turn comes, so what they did to row r will be overwritten. */
    owed = t->L + (size_t)k * (size_t)t->delay;
    for (l = 0; l <= t->last[r]; l++)
        owed[l] = 0.0;
    for (; l < k; l++)
        owed[l] = row[(size_t)l * PERP__PANEL];
    for (l = k - k % GROUP; l < k; l++)
        row[(size_t)l * PERP__PANEL] = 0.0;
    t->exchanged[k] = r;
    t->again[k] = 0;
    if (t->last[r] >= 0)
        t->again[t->last[r]] = k;
    t->last[r] = k;
    /* 2. The column, which starts afresh. */
    t->kernels->keep(panels_of(t->rows), column[r], column, into, t->U + (size_t)k * PERP__PANEL,
                     stride_of(t));
    into[r] = 1.0 / column[r];
    row[(size_t)k * PERP__PANEL] = 0.0;
    t->pivots[k] = column[r];
    t->entered[k] = c;
    t->started[c] = ++t->pending;
}
