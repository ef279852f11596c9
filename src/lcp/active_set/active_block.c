#include "base/rounding.h"
#include "lcp/active_set/active_set.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/blas.h"

/* Changes are kept up to this part of the block's order (bench/lcp_dense). */
#define PERP__CHANGED_PART 8

static size_t at(int32_t i, int32_t j, int32_t ld)
{
    return (size_t)i + (size_t)j * (size_t)ld;
}

void perp__active_block_layout(perp__arena *arena, perp__active_block *b, int32_t n, int32_t lent)
{
    const size_t size = (size_t)n;
    const size_t capacity = size / PERP__CHANGED_PART;

    b->capacity = (int32_t)capacity;
    PERP__INTEGERS(arena, size, &b->order, &b->position, &b->pivots, &b->column_of);
    PERP__INTEGERS(arena, capacity, &b->changed, &b->used, &b->schur_pivots);
    PERP__DOUBLES(arena, size * capacity, &b->border, &b->solved);
    PERP__DOUBLES(arena, capacity * capacity, &b->corner, &b->schur);
    b->x = perp__arena_take(arena, size, sizeof(double));
    b->y = perp__arena_take(arena, capacity, sizeof(double));
    if (!lent)
        b->block = perp__arena_take(arena, size * size, sizeof(double));
}

void perp__active_block_begin(perp__active_block *b, const perp__lcp_problem *problem,
                              int32_t symmetric)
{
    b->M = problem->M;
    b->control = problem->control;
    b->symmetric = symmetric;
    b->count = b->kept = b->changes = 0;
}

/* M(order, j) from row number `first` on, or M(j, order) if `row`. */
static void gather(const perp__active_block *b, int32_t j, int32_t row, int32_t first, double *into)
{
    const size_t n = (size_t)b->M->rows, stride = row ? n : 1;
    const double *from = b->M->values + (size_t)j * (row ? 1 : n);

    for (int32_t r = first; r < b->count; r++)
        into[r] = from[(size_t)b->order[r] * stride];
}

/* No pivot that rounding could have made; for `definite` none that is poor, and a determinant > 0.
 * Without `pivots` the diagonal holds the roots of Cholesky. */
static enum perp__block_state judge(const double *factored, int32_t n, const int32_t *pivots,
                                    int32_t definite)
{
    double least = INFINITY, largest = 0.0;
    int32_t negative = 0, k;

    for (k = 0; k < n; k++) {
        double pivot = factored[at(k, k, n)];

        if (!isfinite(pivot))
            return PERP__BLOCK_SINGULAR;
        negative ^= pivot < 0.0;
        if (pivots)
            negative ^= pivots[k] != k + 1;
        else
            pivot *= pivot;
        pivot = fabs(pivot);
        least = pivot < least ? pivot : least;
        largest = pivot > largest ? pivot : largest;
    }
    if (least < PERP__SUM_ROUNDING * largest)
        return PERP__BLOCK_SINGULAR;
    if (definite && (negative || least < PERP__POOR_PIVOT * largest))
        return PERP__BLOCK_INDEFINITE;
    return PERP__BLOCK_READY;
}

/* Factors the block of A anew. */
static enum perp__block_state factor(perp__active_block *b, const int8_t *places)
{
    enum perp__block_state state = PERP__BLOCK_INDEFINITE;
    int32_t count = 0;

    /* 1. A0 := A */
    for (int32_t i = 0; i < b->M->rows; i++) {
        const int32_t is_between = places[i] == PERP__BETWEEN;

        b->position[i] = is_between ? count : -1;
        b->column_of[i] = -1;
        if (is_between)
            b->order[count++] = i;
    }
    b->count = count;
    b->kept = b->changes = 0;
    if (count == 0)
        return PERP__BLOCK_READY;
    if (!perp__lcp_may_factor(b->control, count, b->symmetric, b->M->rows))
        return PERP__BLOCK_SINGULAR;
    /* 2. Cholesky's factors of the lower triangle, where M is symmetric. */
    b->by_cholesky = b->symmetric;
    if (b->by_cholesky) {
        for (int32_t c = 0; c < count; c++)
            gather(b, b->order[c], 0, c, b->block + at(0, c, count));
        if (perp__cholesky_factor(count, b->block, count) == 0)
            state = judge(b->block, count, NULL, b->definite);
    }
    /* 3. Else those of LU. */
    if (state == PERP__BLOCK_INDEFINITE && !(b->symmetric && b->definite)) {
        b->by_cholesky = 0;
        for (int32_t c = 0; c < count; c++)
            gather(b, b->order[c], 0, 0, b->block + at(0, c, count));
        state = perp__lu_factor(count, b->block, count, b->pivots) == 0
                    ? judge(b->block, count, b->pivots, b->definite)
                    : PERP__BLOCK_SINGULAR;
    }
    if (state != PERP__BLOCK_READY)
        b->count = 0;
    return state;
}

static void solve_old(const perp__active_block *b, int32_t columns, double *X)
{
    if (b->count == 0)
        return;
    if (b->by_cholesky)
        perp__cholesky_solve(b->count, columns, b->block, b->count, X, b->M->rows);
    else
        perp__lu_solve_columns(b->count, columns, b->block, b->count, b->pivots, X, b->M->rows, 0);
}

/* The borders of kept changes from `first` on, and their rows and columns of the corner. */
static void add_changes(perp__active_block *b, int32_t first)
{
    const size_t bytes = (size_t)b->count * sizeof(double);
    const int32_t n = b->M->rows;

    /* 1. The columns of the upper right block and the rows of the lower left one. */
    for (int32_t k = first; k < b->kept; k++) {
        const int32_t i = b->changed[k];
        double *border = b->border + at(0, k, n), *solved = b->solved + at(0, k, n);

        if (b->position[i] >= 0) { /* it left */
            memset(border, 0, bytes);
            border[b->position[i]] = -1.0;
            memcpy(solved, border, bytes);
        } else {
            gather(b, i, 0, 0, solved);
            if (b->symmetric)
                memcpy(border, solved, bytes);
            else
                gather(b, i, 1, 0, border);
        }
    }
    solve_old(b, b->kept - first, b->solved + at(0, first, n));
    /* 2. corner = M_EE - border' solved */
    for (int32_t k = first; k < b->kept; k++) {
        double *column = b->corner + at(0, k, b->capacity);
        const int32_t i = b->changed[k], entered = b->position[i] < 0;

        for (int32_t p = 0; p <= k; p++) {
            const int32_t j = b->changed[p], both = entered && b->position[j] < 0;

            column[p] = both ? perp__entry(b->M, j, i) : 0.0;
            b->y[p] = both ? perp__entry(b->M, i, j) : 0.0;
        }
        perp__gemv_transposed_subtract(b->count, k + 1, b->border, n, b->solved + at(0, k, n),
                                       column);
        if (b->symmetric)
            memcpy(b->y, column, (size_t)k * sizeof *column);
        else
            perp__gemv_transposed_subtract(b->count, k, b->solved, n, b->border + at(0, k, n),
                                           b->y);
        for (int32_t p = 0; p < k; p++)
            b->corner[at(k, p, b->capacity)] = b->y[p];
    }
}

/* The old factors with a border, if that is cheaper. */
static int32_t update(perp__active_block *b, const int8_t *places)
{
    const int32_t first = b->kept, most = b->count / PERP__CHANGED_PART;
    int32_t fresh = 0, i, q;

    /* 1. Which indices tell A from A0, and how many of them have no column yet. */
    b->changes = 0;
    for (i = 0; i < b->M->rows; i++) {
        if ((places[i] == PERP__BETWEEN) == (b->position[i] >= 0))
            continue;
        fresh += b->column_of[i] < 0;
        b->changes++;
        if (b->changes > most || b->kept + fresh > b->capacity)
            return 0;
    }
    if (!perp__lcp_may_multiply(b->control, (double)fresh * b->count * b->count, b->M->rows))
        return 0;
    for (i = 0, q = 0; i < b->M->rows; i++) {
        if ((places[i] == PERP__BETWEEN) == (b->position[i] >= 0))
            continue;
        if (b->column_of[i] < 0) {
            b->column_of[i] = b->kept;
            b->changed[b->kept++] = i;
        }
        b->used[q++] = b->column_of[i];
    }
    if (fresh > 0)
        add_changes(b, first);
    /* 2. Their Schur complement. */
    for (q = 0; q < b->changes; q++)
        for (int32_t p = 0; p < b->changes; p++)
            b->schur[at(p, q, b->changes)] = b->corner[at(b->used[p], b->used[q], b->capacity)];
    return b->changes == 0 ||
           (perp__lu_factor(b->changes, b->schur, b->changes, b->schur_pivots) == 0 &&
            judge(b->schur, b->changes, b->schur_pivots, 0) == PERP__BLOCK_READY);
}

enum perp__block_state perp__active_block_choose(perp__active_block *b, const int8_t *places)
{
    if (b->count > 0 && update(b, places))
        return PERP__BLOCK_READY;
    return factor(b, places);
}

void perp__active_block_solve(perp__active_block *b, const int8_t *places, double *r)
{
    const int32_t n = b->M->rows;

    for (int32_t k = 0; k < b->count; k++)
        b->x[k] = r[b->order[k]];
    solve_old(b, 1, b->x);
    for (int32_t k = 0; k < b->changes; k++) {
        const int32_t i = b->changed[b->used[k]];

        b->y[k] = b->position[i] < 0 ? r[i] : 0.0;
        perp__gemv_transposed_subtract(b->count, 1, b->border + at(0, b->used[k], n), n, b->x,
                                       b->y + k);
    }
    if (b->changes > 0)
        perp__lu_solve(b->changes, b->schur, b->changes, b->schur_pivots, b->y, 0);
    for (int32_t k = 0; k < b->changes; k++)
        perp__gemv_subtract(b->count, 1, b->solved + at(0, b->used[k], n), n, b->y + k, b->x);
    for (int32_t k = 0; k < b->count; k++)
        if (places[b->order[k]] == PERP__BETWEEN)
            r[b->order[k]] = b->x[k];
    for (int32_t k = 0; k < b->changes; k++)
        if (b->position[b->changed[b->used[k]]] < 0)
            r[b->changed[b->used[k]]] = b->y[k];
}
