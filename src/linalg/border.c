#include <math.h>
#include <string.h>

#include "base/rounding.h"
#include "linalg/blas.h"
#include "linalg/sparse_block.h"

/* Changes are kept up to this part of the block's order (bench/lcp_dense). */
#define PERP__CHANGED_PART 8

static size_t at(int32_t i, int32_t j, int32_t ld)
{
    return (size_t)i + (size_t)j * (size_t)ld;
}

void perp__border_layout(perp__arena *arena, perp__border *border, size_t n)
{
    const size_t capacity = n / PERP__CHANGED_PART;

    border->capacity = (int32_t)capacity;
    PERP__INTEGERS(arena, n, &border->position, &border->column_of);
    PERP__INTEGERS(arena, capacity, &border->changed, &border->differ, &border->pivots);
    PERP__DOUBLES(arena, n * capacity, &border->rows, &border->solved);
    PERP__DOUBLES(arena, capacity * capacity, &border->corner, &border->schur);
    border->y = perp__arena_take(arena, capacity, sizeof(double));
}

void perp__border_begin(perp__sparse_block *b)
{
    perp__border *border = &b->border;

    for (int32_t i = 0; i < b->M->rows; i++)
        border->position[i] = border->column_of[i] = -1;
    for (int32_t k = 0; k < b->count; k++)
        border->position[b->active[k]] = k;
    border->kept = border->changes = 0;
}

/* M(active, j), or M(j, active) if `row`. */
static void gather(const perp__sparse_block *b, int32_t j, bool row, double *into)
{
    const size_t n = (size_t)b->M->rows, stride = row ? n : 1;
    const double *from = b->M->values + (size_t)j * (row ? 1 : n);

    for (int32_t k = 0; k < b->count; k++)
        into[k] = from[(size_t)b->active[k] * stride];
}

/* The borders of kept changes from `first` on, and their rows and columns of the corner. */
static void add_changes(perp__sparse_block *b, int32_t first)
{
    perp__border *border = &b->border;
    const size_t bytes = (size_t)b->count * sizeof(double);
    const int32_t n = b->M->rows;

    /* 1. The columns of the upper right block and the rows of the lower left one. */
    for (int32_t k = first; k < border->kept; k++) {
        const int32_t i = border->changed[k];
        double *row = border->rows + at(0, k, n), *solved = border->solved + at(0, k, n);

        if (border->position[i] >= 0) { /* it left */
            memset(row, 0, bytes);
            row[border->position[i]] = -1.0;
            memcpy(solved, row, bytes);
        } else {
            gather(b, i, 0, solved);
            if (b->is_symmetric)
                memcpy(row, solved, bytes);
            else
                gather(b, i, 1, row);
        }
    }
    perp__dense_block_solve(b, border->kept - first, border->solved + at(0, first, n), 0);
    /* 2. corner = M_EE - rows' solved */
    for (int32_t k = first; k < border->kept; k++) {
        double *column = border->corner + at(0, k, border->capacity);
        const int32_t i = border->changed[k], entered = border->position[i] < 0;

        for (int32_t p = 0; p <= k; p++) {
            const int32_t j = border->changed[p], both = entered && border->position[j] < 0;

            column[p] = both ? perp__entry(b->M, j, i) : 0.0;
            border->y[p] = both ? perp__entry(b->M, i, j) : 0.0;
        }
        perp__gemv_transposed_subtract(b->count, k + 1, border->rows, n,
                                       border->solved + at(0, k, n), column);
        if (b->is_symmetric)
            memcpy(border->y, column, (size_t)k * sizeof *column);
        else
            perp__gemv_transposed_subtract(b->count, k, border->solved, n,
                                           border->rows + at(0, k, n), border->y);
        for (int32_t p = 0; p < k; p++)
            border->corner[at(k, p, border->capacity)] = border->y[p];
    }
}

/* Which indices tell this set from the factored one. Returns how many, or -1: too many. */
static int32_t compare(perp__sparse_block *b, const int32_t *active, int32_t count)
{
    const int32_t part = b->count / PERP__CHANGED_PART;
    const int32_t most = part < b->border.capacity ? part : b->border.capacity;
    int32_t differ = 0, k = 0, a = 0;

    while (k < b->count || a < count) {
        const int32_t old = k < b->count ? b->active[k] : INT32_MAX;
        const int32_t now = a < count ? active[a] : INT32_MAX;

        k += old <= now;
        a += now <= old;
        if (old == now)
            continue;
        if (differ == most)
            return -1;
        b->border.differ[differ++] = old < now ? old : now;
    }
    return differ;
}

/* The Schur complement of the changes in `differ`, factored. Returns 0 for a pivot that rounding
 * could have made. */
static bool factor_corner(perp__border *border)
{
    const int32_t changes = border->changes;
    double least = INFINITY, largest = 0.0;

    for (int32_t q = 0; q < changes; q++)
        for (int32_t p = 0; p < changes; p++)
            border->schur[at(p, q, changes)] =
                border->corner[at(border->column_of[border->differ[p]],
                                  border->column_of[border->differ[q]], border->capacity)];
    if (changes > 0 && perp__lu_factor(changes, border->schur, changes, border->pivots) != 0)
        return 0;
    for (int32_t k = 0; k < changes; k++) {
        const double pivot = fabs(border->schur[at(k, k, changes)]);

        if (!isfinite(pivot))
            return 0;
        least = fmin(least, pivot);
        largest = fmax(largest, pivot);
    }
    return least >= PERP__SUM_ROUNDING * largest;
}

bool perp__border_choose(perp__sparse_block *b, const int32_t *active, int32_t count)
{
    perp__border *border = &b->border;
    const int32_t first = border->kept;
    int32_t fresh = 0;

    border->changes = compare(b, active, count);
    for (int32_t k = 0; k < border->changes; k++)
        fresh += border->column_of[border->differ[k]] < 0;
    if (border->changes < 0 || border->kept + fresh > border->capacity ||
        perp__block_is_late(b, (double)fresh * b->count * b->count)) {
        border->changes = 0;
        return 0;
    }
    for (int32_t k = 0; k < border->changes; k++) {
        const int32_t i = border->differ[k];

        if (border->column_of[i] >= 0)
            continue;
        border->column_of[i] = border->kept;
        border->changed[border->kept++] = i;
    }
    if (fresh > 0)
        add_changes(b, first);
    return factor_corner(border);
}

void perp__border_solve(perp__sparse_block *b, double *x)
{
    perp__border *border = &b->border;
    const int32_t n = b->M->rows;

    for (int32_t k = 0; k < border->changes; k++) {
        const int32_t i = border->differ[k];

        border->y[k] = border->position[i] < 0 ? x[i] : 0.0;
        perp__gemv_transposed_subtract(b->count, 1, border->rows + at(0, border->column_of[i], n),
                                       n, b->x, border->y + k);
    }
    perp__lu_solve(border->changes, border->schur, border->changes, border->pivots, border->y, 0);
    for (int32_t k = 0; k < border->changes; k++)
        perp__gemv_subtract(b->count, 1,
                            border->solved + at(0, border->column_of[border->differ[k]], n), n,
                            border->y + k, b->x);
    for (int32_t k = 0; k < border->changes; k++) {
        const int32_t i = border->differ[k];

        if (border->position[i] >= 0)
            b->x[border->position[i]] = 0.0;
        else
            x[i] = border->y[k];
    }
}
