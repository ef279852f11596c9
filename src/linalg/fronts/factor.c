/* Factors and solutions. A front [A B; C D], A of its own nodes, leaves D - C (A^-1 B) to its
 * parent; A is factored with rows exchanged, A^-1 B and C are kept. */
#include <math.h>
#include <string.h>

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
    size_t height, own, rest; /* all, own and other unknowns */
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
    *apart = row < front->count ? v->own : v->rest;
    return row < front->count ? front->across + (j - v->own) * v->own + i
                              : v->left + (j - v->own) * v->rest + i - v->own;
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

PERP__KERNEL static void add_child(int32_t width, const perp__front *child, const double *from,
                                   const front_view *v)
{
    const size_t rest = (size_t)child->rest * (size_t)width;

    for (int32_t j = 0; j < child->rest; j++)
        for (int32_t i = 0; i < child->rest; i++) {
            size_t apart;
            double *to = block_at(v, width, child->in_parent[i], child->in_parent[j], &apart);

            add_block(width, from + (size_t)j * (size_t)width * rest + (size_t)(i * width), rest,
                      to, apart);
        }
}

PERP__MULTIVERSION(sum_up,
                   (const perp__fronts *f, const front_view *v, const perp__front *child,
                    const double *from),
                   (f, v, child, from))
{
    if (child && f->width == 6)
        add_child(6, child, from, v);
    else if (child)
        add_child(f->width, child, from, v);
    else if (f->width == 6)
        add_entries(6, f, v);
    else
        add_entries(f->width, f, v);
}

/* Adds the entries of the matrix, or what a child leaves. */

static void clear(double *x, size_t count)
{
    if (count > 0)
        memset(x, 0, count * sizeof *x);
}

/* Whether the determinant of A is negative: signs of pivots, and exchanges of rows. */
static int32_t is_negative(const front_view *v)
{
    int32_t negative = 0;

    for (int32_t i = 0; i < (int32_t)v->own; i++)
        negative ^=
            (v->front->panel[(size_t)i * (v->height + 1)] < 0.0) ^ (v->front->pivots[i] != i + 1);
    return negative;
}

static int32_t eliminate(const front_view *v)
{
    const perp__front *front = v->front;
    const int32_t own = (int32_t)v->own, rest = (int32_t)v->rest, height = (int32_t)v->height;

    if (perp__lu_factor(own, front->panel, height, front->pivots))
        return 0;
    for (int32_t i = 0; i < own; i++)
        if (!isfinite(front->panel[(size_t)i * (v->height + 1)]))
            return 0;
    if (rest == 0)
        return 1;
    perp__lu_solve_columns(own, rest, front->panel, height, front->pivots, front->across, own, 0);
    perp__gemm_subtract(rest, rest, own, front->panel + own, height, front->across, own, v->left,
                        rest);
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

        v.height = v.own + v.rest;
        clear(front->panel, v.height * v.own);
        clear(front->across, v.own * v.rest);
        clear(v.left, v.rest * v.rest);
        sum_up(f, &v, NULL, NULL);
        while (depth > 0 && f->fronts[f->work[depth - 1]].parent == t) {
            const perp__front *child = &f->fronts[f->work[--depth]];

            top -= (size_t)child->rest * (size_t)child->rest * width * width;
            sum_up(f, &v, child, top);
        }
        fine = eliminate(&v);
        f->is_negative ^= is_negative(&v);
        if (v.rest > 0) {
            memmove(top, v.left, v.rest * v.rest * sizeof *top);
            top += v.rest * v.rest;
            f->work[depth++] = t;
        }
    }
    return fine;
}

static void forward(perp__fronts *f, int32_t begin, int32_t end)
{
    const int32_t width = f->width;

    for (int32_t t = begin; t < end; t++) {
        const perp__front *front = &f->fronts[t];
        const int32_t own = front->count * width, rest = front->rest * width;
        double *x = f->right + (size_t)front->first * (size_t)width;

        perp__lu_solve(own, front->panel, own + rest, front->pivots, x, 0);
        if (rest == 0)
            continue;
        clear(f->gathered, (size_t)rest);
        perp__gemv_subtract(rest, own, front->panel + own, own + rest, x, 1, f->gathered);
        for (int32_t i = 0; i < front->rest; i++)
            for (int32_t c = 0; c < width; c++)
                f->right[front->others[i] * width + c] += f->gathered[i * width + c];
    }
}

static void backward(perp__fronts *f, int32_t begin, int32_t end)
{
    const size_t width = (size_t)f->width;

    for (int32_t t = end - 1; t >= begin; t--) {
        const perp__front *front = &f->fronts[t];
        const int32_t own = front->count * f->width, rest = front->rest * f->width;

        for (int32_t i = 0; i < front->rest; i++)
            memcpy(f->gathered + (size_t)i * width, f->right + (size_t)front->others[i] * width,
                   width * sizeof(double));
        if (rest > 0)
            perp__gemv_subtract(own, rest, front->across, own, f->gathered, 1,
                                f->right + (size_t)front->first * width);
    }
}

void perp__fronts_solve(perp__fronts *f, int32_t first, int32_t end, double *x)
{
    const size_t width = (size_t)f->width;

    if (end <= first)
        return;
    for (int32_t i = first; i < end; i++)
        memcpy(f->right + (size_t)i * width, x + (size_t)f->order[i] * width,
               width * sizeof(double));
    forward(f, f->front_of[first], f->front_of[end - 1] + 1);
    backward(f, f->front_of[first], f->front_of[end - 1] + 1);
    for (int32_t i = first; i < end; i++)
        memcpy(x + (size_t)f->order[i] * width, f->right + (size_t)i * width,
               width * sizeof(double));
}
