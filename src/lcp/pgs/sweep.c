#include "lcp/pgs/sweep.h"

#include <math.h>
#include <string.h>

#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

void perp__sweeper_layout(perp__arena *arena, perp__sweeper *sweeper,
                          const perp__lcp_problem *problem)
{
    perp__rows_layout(arena, &sweeper->rows, problem);
    sweeper->room = perp__arena_take(
        arena, (size_t)sweeper->rows.count * PERP__SLICE + 2 * PERP__GUARD, sizeof(double));
    sweeper->passages = perp__arena_take(arena, PERP__SWEEPS_AT_ONCE, sizeof *sweeper->passages);
}

void perp__sweeper_start(perp__sweeper *sweeper, const double *z)
{
    const perp__rows *rows = &sweeper->rows;
    const size_t padded = (size_t)rows->count * PERP__SLICE;

    memset(sweeper->room, 0, (padded + 2 * PERP__GUARD) * sizeof *sweeper->room);
    sweeper->z = sweeper->room + PERP__GUARD;
    if (rows->n > 0)
        memcpy(sweeper->z, z, (size_t)rows->n * sizeof *z);
    for (int32_t b = 0; b * PERP__BLOCK < rows->count; b++)
        rows->blocks[b].what = 0;
    for (int32_t s = 0; s < rows->count; s++) {
        perp__slice *slice = &rows->slices[s];

        slice->what &= ~(PERP__HAS_LOWER | PERP__HAS_UPPER);
        for (int32_t i = s * PERP__SLICE; i < (s + 1) * PERP__SLICE; i++) {
            if (i >= rows->n)
                rows->upper[i] = 0.0;
            else if (rows->upper[i] < INFINITY)
                slice->what |= PERP__HAS_UPPER;
            if (slice->lower[i % PERP__SLICE] > -INFINITY)
                slice->what |= PERP__HAS_LOWER;
        }
        rows->blocks[s / PERP__BLOCK].what |= slice->what;
    }
}

/* sum := sum - the gathered entries and those of one row. */
PERP__KERNEL static void add_scattered(const perp__slice *slice, const double *values,
                                       const int32_t *columns, const double *z, double *sum)
{
    perp__lanes low = PERP__CONST_LANES_AT(sum), high = PERP__CONST_LANES_AT(sum + 4);

    for (int32_t k = 0; k < slice->gathered; k++, values += PERP__SLICE, columns += PERP__SLICE) {
        perp__lanes first = {z[columns[0]], z[columns[1]], z[columns[2]], z[columns[3]]};
        perp__lanes second = {z[columns[4]], z[columns[5]], z[columns[6]], z[columns[7]]};

        low -= PERP__CONST_LANES_AT(values) * first;
        high -= PERP__CONST_LANES_AT(values + 4) * second;
    }
    PERP__LANES_AT(sum) = low;
    PERP__LANES_AT(sum + 4) = high;
    for (int32_t k = 0; k < slice->rows; k++, values += PERP__SLICE, columns += PERP__SLICE + 1) {
        double part[4] = {0.0, 0.0, 0.0, 0.0};

        for (int32_t j = 0; j < PERP__SLICE; j++)
            part[j % 4] += values[j] * z[columns[1 + j]];
        sum[columns[0]] -= (part[0] + part[1]) + (part[2] + part[3]);
    }
}

/* sum := sum - all columns of a dense matrix, the even and the odd ones apart. */
PERP__KERNEL static void add_columns(const double *values, int32_t n, const double *z, double *sum)
{
    perp__lanes low = PERP__CONST_LANES_AT(sum), high = PERP__CONST_LANES_AT(sum + 4);
    perp__lanes low_odd = PERP__SAME_LANES(0.0), high_odd = PERP__SAME_LANES(0.0);
    int32_t j = 0;

    for (; j + 1 < n; j += 2, values += 2 * PERP__SLICE) {
        const perp__lanes even = PERP__SAME_LANES(z[j]), odd = PERP__SAME_LANES(z[j + 1]);

        low -= PERP__CONST_LANES_AT(values) * even;
        high -= PERP__CONST_LANES_AT(values + 4) * even;
        low_odd -= PERP__CONST_LANES_AT(values + 8) * odd;
        high_odd -= PERP__CONST_LANES_AT(values + 12) * odd;
    }
    if (j < n) {
        const perp__lanes even = PERP__SAME_LANES(z[j]);

        low -= PERP__CONST_LANES_AT(values) * even;
        high -= PERP__CONST_LANES_AT(values + 4) * even;
    }
    PERP__LANES_AT(sum) = low + low_odd;
    PERP__LANES_AT(sum + 4) = high + high_odd;
}

/* Beside PERP__HAS_...: the last row comes first. */
enum { BACKWARD = 16 };

/* The slice's rows one after the other. Row i waits for the z next to it, `near`: that chain is
 * what a sweep costs, so it is no longer than a fused multiply-add and a maximum, and the upper
 * bound, met more rarely, is a branch. Returns the last z. */
PERP__KERNEL static double recur(const perp__rows *rows, const perp__slice *slice,
                                 const double *sum, double *moved, double *z, double near,
                                 int32_t what)
{
    const double *core = rows->values + slice->core;
    const double *upper = rows->upper + (slice - rows->slices) * PERP__SLICE;
    const double *chain = what & BACKWARD ? slice->after : slice->before;

    for (int32_t step = 0; step < PERP__SLICE; step++) {
        const int32_t k = what & BACKWARD ? PERP__SLICE - 1 - step : step;
        double x = sum[k];

        if (what & PERP__HAS_CORE) { /* what is nearest comes last */
            for (int32_t j = PERP__SLICE - 1; j > k + 1; j--)
                x -= core[k * PERP__SLICE + j] * z[j];
            for (int32_t j = 0; j < k - 1; j++)
                x -= core[k * PERP__SLICE + j] * z[j];
        }
        x = fma(-chain[k], near, x);
        moved[k] = x;
        if (what & PERP__HAS_LOWER)
            x = x < slice->lower[k] ? slice->lower[k] : x;
        if ((what & PERP__HAS_UPPER) && x > upper[k]) {
            x = upper[k];
            PERP__KEEP_BRANCH();
        }
        z[k] = near = x;
    }
    return near;
}

/* sum := (1 - omega) z - load - the neighbours and contiguous slots. `own` is z at the slice. */
PERP__KERNEL static void add_contiguous(const perp__sweeper *sweeper, const perp__slice *slice,
                                        const double *limits, double *old, double *sum,
                                        bool backward)
{
    const double *restrict values = sweeper->rows.values + slice->values;
    const int32_t *restrict columns = sweeper->rows.columns + slice->columns;
    const double *settled = backward ? slice->before : slice->after;
    const double *aside = backward ? limits - 1 : limits + 1;
    const perp__lanes kept = PERP__SAME_LANES(sweeper->keep);
    const perp__lanes z_low = PERP__CONST_LANES_AT(limits),
                      z_high = PERP__CONST_LANES_AT(limits + 4);
    perp__lanes low = kept * z_low - PERP__CONST_LANES_AT(slice->load) -
                      PERP__CONST_LANES_AT(settled) * PERP__CONST_LANES_AT(aside);
    perp__lanes high = kept * z_high - PERP__CONST_LANES_AT(slice->load + 4) -
                       PERP__CONST_LANES_AT(settled + 4) * PERP__CONST_LANES_AT(aside + 4);

    for (int32_t k = 0; k < slice->contiguous; k++, values += PERP__SLICE) {
        const double *y = sweeper->z + columns[k];

        low -= PERP__CONST_LANES_AT(values) * PERP__CONST_LANES_AT(y);
        high -= PERP__CONST_LANES_AT(values + 4) * PERP__CONST_LANES_AT(y + 4);
    }
    PERP__LANES_AT(old) = z_low;
    PERP__LANES_AT(old + 4) = z_high;
    PERP__LANES_AT(sum) = low;
    PERP__LANES_AT(sum + 4) = high;
}

static int32_t slices_of(const perp__rows *rows, int32_t block)
{
    const int32_t left = rows->count - block * PERP__BLOCK;

    return left < PERP__BLOCK ? left : PERP__BLOCK;
}

/* The residual of the pending block: with x what z_i moved to before it was projected, w_i is
 * (S_ii / omega) (z_i - x). `zero` collects w - w: 0, or NaN after an overflow. */
PERP__KERNEL static void add_residual(const perp__rows *rows, perp__passage *passage,
                                      bool has_upper)
{
    const int32_t block = passage->pending, count = slices_of(rows, block);
    const perp__slice *slice = rows->slices + block * PERP__BLOCK;
    const double *upper = rows->upper + (size_t)block * PERP__BLOCK_ROWS;
    const double *old = passage->old[block % 2], *moved = passage->moved[block % 2];
    perp__lanes worst_low = PERP__CONST_LANES_AT(passage->worst);
    perp__lanes worst_high = PERP__CONST_LANES_AT(passage->worst + 4);
    perp__lanes zero = PERP__CONST_LANES_AT(passage->zero);

    for (int32_t s = 0; s < count; s++, slice++, old += PERP__SLICE, moved += PERP__SLICE) {
        const perp__lanes z_low = PERP__CONST_LANES_AT(old), z_high = PERP__CONST_LANES_AT(old + 4);
        perp__lanes low =
            (z_low - PERP__CONST_LANES_AT(moved)) * PERP__CONST_LANES_AT(slice->weight);
        perp__lanes high =
            (z_high - PERP__CONST_LANES_AT(moved + 4)) * PERP__CONST_LANES_AT(slice->weight + 4);
        perp__lanes distance;

        zero += (low - low) + (high - high);
        if (has_upper) {
            distance = z_low - PERP__CONST_LANES_AT(upper + s * PERP__SLICE);
            low = PERP__SELECT_LANES(low > distance, low, distance);
            distance = z_high - PERP__CONST_LANES_AT(upper + s * PERP__SLICE + 4);
            high = PERP__SELECT_LANES(high > distance, high, distance);
        }
        distance = z_low - PERP__CONST_LANES_AT(slice->lower);
        low = PERP__SELECT_LANES(low < distance, low, distance);
        distance = z_high - PERP__CONST_LANES_AT(slice->lower + 4);
        high = PERP__SELECT_LANES(high < distance, high, distance);
        low = PERP__ABSOLUTE_LANES(low);
        high = PERP__ABSOLUTE_LANES(high);
        worst_low = PERP__SELECT_LANES(low > worst_low, low, worst_low);
        worst_high = PERP__SELECT_LANES(high > worst_high, high, worst_high);
    }
    PERP__LANES_AT(passage->worst) = worst_low;
    PERP__LANES_AT(passage->worst + 4) = worst_high;
    PERP__LANES_AT(passage->zero) = zero;
}

/* One block of a sweep whose slices have at most `what`. */
PERP__KERNEL static void pass(const perp__sweeper *sweeper, perp__passage *passage, int32_t block,
                              int32_t what, bool backward)
{
    const perp__rows *rows = &sweeper->rows;
    const int32_t first = block * PERP__BLOCK, count = slices_of(rows, block);
    double *z = sweeper->z + (ptrdiff_t)first * PERP__SLICE;
    const int32_t order = backward ? BACKWARD : 0;
    double near = backward ? z[count * PERP__SLICE] : z[-1];

    for (int32_t step = 0; step < count; step++) {
        const int32_t s = backward ? count - 1 - step : step, i = s * PERP__SLICE;
        const perp__slice *restrict slice = &rows->slices[first + s];
        const double *restrict values = rows->values + slice->values;
        const int32_t *restrict columns = rows->columns + slice->columns;
        double *restrict moved = passage->moved[block % 2] + i;
        double sum[PERP__SLICE];

        add_contiguous(sweeper, slice, z + i, passage->old[block % 2] + i, sum, backward);
        if (what & slice->what & PERP__HAS_OTHERS) {
            values += (size_t)slice->contiguous * PERP__SLICE;
            if (rows->dense)
                add_columns(values, rows->n, sweeper->z, sum);
            else
                add_scattered(slice, values, columns + slice->contiguous, sweeper->z, sum);
        }
        /* a bound that is not there is not compared with */
        if (what & slice->what & PERP__HAS_CORE)
            near = recur(rows, slice, sum, moved, z + i, near, what | order);
        else if (what & slice->what & PERP__HAS_UPPER)
            near = recur(rows, slice, sum, moved, z + i, near,
                         PERP__HAS_UPPER | PERP__HAS_LOWER | order);
        else if (slice->what & PERP__HAS_LOWER)
            near = recur(rows, slice, sum, moved, z + i, near, PERP__HAS_LOWER | order);
        else
            near = recur(rows, slice, sum, moved, z + i, near, order);
    }
}

/* Few variants for the blocks that are many. */
PERP__KERNEL static void pass_any(const perp__sweeper *sweeper, perp__passage *passage,
                                  int32_t block, bool backward)
{
    enum {
        BOTH = PERP__HAS_LOWER | PERP__HAS_UPPER,
        ALL = BOTH | PERP__HAS_CORE | PERP__HAS_OTHERS
    };
    const perp__block *blocks = sweeper->rows.blocks;

    if (blocks[block].what & ~BOTH)
        pass(sweeper, passage, block, ALL, backward);
    else if (blocks[block].what & PERP__HAS_UPPER)
        pass(sweeper, passage, block, BOTH, backward);
    else
        pass(sweeper, passage, block, PERP__HAS_LOWER, backward);
    if (passage->pending >= 0) {
        if (blocks[passage->pending].what & PERP__HAS_UPPER)
            add_residual(&sweeper->rows, passage, 1);
        else
            add_residual(&sweeper->rows, passage, 0);
    }
    passage->pending = block;
    passage->done++;
}

PERP__MULTIVERSION(forward, (const perp__sweeper *sweeper, perp__passage *passage),
                   (sweeper, passage))
{
    pass_any(sweeper, passage, passage->done, 0);
}

PERP__MULTIVERSION(backward, (const perp__sweeper *sweeper, perp__passage *passage),
                   (sweeper, passage))
{
    pass_any(sweeper, passage, (sweeper->rows.count - 1) / PERP__BLOCK - passage->done, 1);
}

static void begin(perp__passage *passage)
{
    memset(passage->worst, 0, sizeof passage->worst);
    memset(passage->zero, 0, sizeof passage->zero);
    passage->done = 0;
    passage->pending = -1;
}

static double finish(const perp__sweeper *sweeper, perp__passage *passage)
{
    double worst = 0.0;

    if (passage->pending >= 0)
        add_residual(&sweeper->rows, passage, 1);
    for (int32_t k = 0; k < 4; k++) {
        if (!(passage->zero[k] == 0.0))
            return INFINITY;
        worst = fmax(worst, fmax(passage->worst[k], passage->worst[k + 4]));
    }
    return worst;
}

void perp__sweep(perp__sweeper *sweeper, int32_t count, double *residuals)
{
    perp__passage *passages = sweeper->passages;
    const int32_t blocks = (sweeper->rows.count + PERP__BLOCK - 1) / PERP__BLOCK;

    for (int32_t k = 0; k < count; k++)
        begin(&passages[k]);
    while (passages[count - 1].done < blocks)
        for (int32_t k = 0; k < count; k++) {
            int32_t block = passages[k].done;

            if (block < blocks &&
                (k == 0 || passages[k - 1].done > sweeper->rows.blocks[block].reach))
                forward(sweeper, &passages[k]);
        }
    for (int32_t k = 0; k < count; k++)
        residuals[k] = finish(sweeper, &passages[k]);
}

void perp__sweep_backward(perp__sweeper *sweeper, double *residual)
{
    perp__passage *passage = sweeper->passages;
    const int32_t blocks = (sweeper->rows.count + PERP__BLOCK - 1) / PERP__BLOCK;

    begin(passage);
    while (passage->done < blocks)
        backward(sweeper, passage);
    *residual = finish(sweeper, passage);
}
