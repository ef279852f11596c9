/* Factors and solutions. A front [A B; C D], A of its own nodes, leaves D - C (A^-1 B) to its
 * parent; A is factored with rows exchanged, A^-1 B and C are kept. Of a symmetric one [A C'; C D]
 * the lower triangles are summed up, A = L L' and C L^-T are kept. */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "linalg/blas.h"
#include "linalg/fronts/fronts.h"
#include "linalg/lanes/multiversion.h"

/* to += from, `width` square, columns so far apart. */
PERP__KERNEL static void add_block(int32_t width, const double *from, size_t from_apart, double *to,
                                   size_t to_apart)
{
    for (int32_t j = 0; j < width; j++, from += from_apart, to += to_apart)
        for (int32_t i = 0; i < width; i++)
            to[i] += from[i];
}

/* A front as it is summed up, with the block that it leaves. */
typedef struct front_view {
    const perp__front *front;
    double *left;
    size_t height, pivots, rest; /* all, own and other unknowns */
} front_view;

/* Where a block of the front is; *apart: its columns. */
static double *block_at(const front_view *v, int32_t width, int32_t row, int32_t column,
                        size_t *apart)
{
    const perp__front *front = v->front;
    const size_t i = (size_t)row * (size_t)width, j = (size_t)column * (size_t)width;

    if (column < front->count) {
        *apart = v->height;
        return front->panel + j * v->height + i;
    }
    *apart = row < front->count ? v->pivots : v->rest;
    return row < front->count ? front->across + (j - v->pivots) * v->pivots + i
                              : v->left + (j - v->pivots) * v->rest + i - v->pivots;
}

PERP__KERNEL static void add_entries(int32_t width, const perp__fronts *f, const front_view *v)
{
    const size_t square = (size_t)width * (size_t)width;

    for (int32_t e = v->front->entry; e < v->front->last_entry; e++) {
        const perp__front_entry *entry = &f->entries[e];
        size_t apart;
        double *to = block_at(v, width, entry->row, entry->column, &apart);

        add_block(width, f->values + (size_t)entry->edge * square, (size_t)width, to, apart);
    }
}

PERP__KERNEL static void add_child(int32_t width, bool symmetric, const perp__front *child,
                                   const double *from, const front_view *v)
{
    const size_t rest = (size_t)child->rest * (size_t)width;

    for (int32_t j = 0; j < child->rest; j++, from += (size_t)width * rest) {
        const int32_t column = child->in_parent[j];
        size_t apart;
        /* below the diagonal a column lies in one piece */
        double *diagonal = block_at(v, width, column, column, &apart);

        for (int32_t i = symmetric ? j : 0; i < child->rest; i++) {
            const int32_t row = child->in_parent[i];
            double *to = symmetric ? diagonal + (row - column) * width
                                   : block_at(v, width, row, column, &apart);

            add_block(width, from + (size_t)(i * width), rest, to, apart);
        }
    }
}

/* Adds the entries of the matrix, or what a child leaves. */
PERP__MULTIVERSION(sum_up,
                   (const perp__fronts *f, const front_view *v, const perp__front *child,
                    const double *from),
                   (f, v, child, from))
{
    if (child && f->width == 1 && f->is_symmetric)
        add_child(1, 1, child, from, v);
    else if (child && f->width == 6)
        add_child(6, f->is_symmetric, child, from, v);
    else if (child)
        add_child(f->width, f->is_symmetric, child, from, v);
    else if (f->width == 6)
        add_entries(6, f, v);
    else
        add_entries(f->width, f, v);
}

static void clear(double *x, size_t count)
{
    if (count > 0)
        memset(x, 0, count * sizeof *x);
}

/* Whether the determinant of A is negative: signs of pivots, and exchanges of rows. */
static bool is_negative(const front_view *v)
{
    bool negative = 0;

    for (int32_t i = 0; i < (int32_t)v->pivots; i++)
        negative ^=
            (v->front->panel[(size_t)i * (v->height + 1)] < 0.0) ^ (v->front->pivots[i] != i + 1);
    return negative;
}

static bool eliminate_symmetric(const front_view *v, double deadline)
{
    const perp__front *front = v->front;
    const int32_t pivots = (int32_t)v->pivots, rest = (int32_t)v->rest, height = (int32_t)v->height;
    bool fine = 1;

    /* 1. L of the own columns; what follows a panel is brought up to date, with the panel's rows
     * as columns in `across`. */
    for (int32_t c = 0; c < pivots && fine; c += PERP__FRONT_PANEL) {
        const int32_t width = pivots - c < PERP__FRONT_PANEL ? pivots - c : PERP__FRONT_PANEL,
                      end = c + width;
        double *panel = front->panel + (size_t)c * (v->height + 1);

        fine = !perp__cholesky_panel(height - c, width, panel, height);
        for (int32_t j = end; j < pivots && fine; j += PERP__FRONT_STRIP) {
            const int32_t few = pivots - j < PERP__FRONT_STRIP ? pivots - j : PERP__FRONT_STRIP;

            for (int32_t i = 0; i < few; i++)
                for (int32_t k = 0; k < width; k++)
                    front->across[k + i * width] =
                        panel[(size_t)(j + i - c) + (size_t)k * v->height];
            perp__gemm_subtract(height - j, few, width, panel + (j - c), height, front->across,
                                width, front->panel + (size_t)j * (v->height + 1), height);
            fine = !perp__is_past(deadline);
        }
    }
    /* 2. What is left to the others. */
    for (size_t j = 0; j < v->rest && fine; j++)
        for (size_t k = 0; k < v->pivots; k++)
            front->across[k + j * v->pivots] = front->panel[v->pivots + j + k * v->height];
    for (int32_t j = 0; j < rest && pivots > 0 && fine; j += PERP__FRONT_STRIP) {
        perp__gemm_subtract(rest - j, rest - j < PERP__FRONT_STRIP ? rest - j : PERP__FRONT_STRIP,
                            pivots, front->panel + pivots + j, height,
                            front->across + (size_t)j * v->pivots, pivots,
                            v->left + (size_t)j * (v->rest + 1), rest);
        fine = !perp__is_past(deadline);
    }
    return fine;
}

static bool eliminate(const front_view *v)
{
    const perp__front *front = v->front;
    const int32_t pivots = (int32_t)v->pivots, rest = (int32_t)v->rest, height = (int32_t)v->height;

    if (perp__lu_factor(pivots, front->panel, height, front->pivots))
        return 0;
    for (int32_t i = 0; i < pivots; i++)
        if (!isfinite(front->panel[(size_t)i * (v->height + 1)]))
            return 0;
    if (rest == 0)
        return 1;
    perp__lu_solve_columns(pivots, rest, front->panel, height, front->pivots, front->across, pivots,
                           0);
    perp__gemm_subtract(rest, rest, pivots, front->panel + pivots, height, front->across, pivots,
                        v->left, rest);
    return 1;
}

int32_t perp__fronts_factor(perp__fronts *f, int32_t first, int32_t end)
{
    const size_t width = (size_t)f->width;
    const int32_t last = end > first ? f->front_of[end - 1] : -1;
    double *top = f->stack;
    int32_t depth = 0, fine = 1;

    f->is_negative = 0;
    for (int32_t t = end > first ? f->front_of[first] : 0; t <= last && fine; t++) {
        const perp__front *front = &f->fronts[t];
        front_view v = {front, top, 0, (size_t)front->count * width, (size_t)front->rest * width};

        v.height = v.pivots + v.rest;
        clear(front->panel, v.height * v.pivots);
        clear(front->across, f->is_symmetric ? 0 : v.pivots * v.rest);
        clear(v.left, v.rest * v.rest);
        sum_up(f, &v, NULL, NULL);
        while (depth > 0 && f->fronts[f->work[depth - 1]].parent == t) {
            const perp__front *child = &f->fronts[f->work[--depth]];

            top -= (size_t)child->rest * (size_t)child->rest * width * width;
            sum_up(f, &v, child, top);
        }
        fine = !perp__is_past(f->deadline) &&
               (f->is_symmetric ? eliminate_symmetric(&v, f->deadline) : eliminate(&v));
        f->is_negative ^= !f->is_symmetric && is_negative(&v);
        if (v.rest > 0) {
            if (top != v.left)
                memmove(top, v.left, v.rest * v.rest * sizeof *top);
            top += v.rest * v.rest;
            f->work[depth++] = t;
        }
    }
    return fine;
}

void perp__fronts_solve(perp__fronts *f, int32_t first, int32_t end, double *x)
{
    const int32_t width = f->width;
    const int32_t begin = end > first ? f->front_of[first] : 0;
    const int32_t last = end > first ? f->front_of[end - 1] : -1;

    for (int32_t i = first; i < end; i++)
        for (int32_t c = 0; c < width; c++)
            f->right[i * width + c] = x[f->order[i] * width + c];
    /* 1. Forward: what a front owes to others goes on to them. */
    for (int32_t t = begin; t <= last; t++) {
        const perp__front *front = &f->fronts[t];
        const int32_t pivots = front->count * width, rest = front->rest * width;
        double *y = f->right + front->first * width;

        if (pivots == 0)
            continue;
        if (f->is_symmetric)
            perp__cholesky_half_solve(pivots, front->panel, pivots + rest, y, 0);
        else
            perp__lu_solve(pivots, front->panel, pivots + rest, front->pivots, y, 0);
        if (rest == 0)
            continue;
        clear(f->gathered, (size_t)rest);
        perp__gemv_subtract(rest, pivots, front->panel + pivots, pivots + rest, y, f->gathered);
        for (int32_t i = 0; i < front->rest; i++)
            for (int32_t c = 0; c < width; c++)
                f->right[front->others[i] * width + c] += f->gathered[i * width + c];
    }
    /* 2. Backward: with what others came to. */
    for (int32_t t = last; t >= begin; t--) {
        const perp__front *front = &f->fronts[t];
        const int32_t pivots = front->count * width, rest = front->rest * width;
        double *y = f->right + front->first * width;

        for (int32_t i = 0; i < front->rest && pivots > 0; i++)
            for (int32_t c = 0; c < width; c++)
                f->gathered[i * width + c] = f->right[front->others[i] * width + c];
        if (pivots > 0 && rest > 0 && f->is_symmetric)
            perp__gemv_transposed_subtract(rest, pivots, front->panel + pivots, pivots + rest,
                                           f->gathered, y);
        else if (pivots > 0 && rest > 0)
            perp__gemv_subtract(pivots, rest, front->across, pivots, f->gathered, y);
        if (pivots > 0 && f->is_symmetric)
            perp__cholesky_half_solve(pivots, front->panel, pivots + rest, y, 1);
    }
    for (int32_t i = first; i < end; i++)
        for (int32_t c = 0; c < width; c++)
            x[f->order[i] * width + c] = f->right[i * width + c];
}
