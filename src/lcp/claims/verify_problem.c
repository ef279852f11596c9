/* The scaled problem of a proof. Scaling by powers of two is exact but for underflow, which the
 * bounds count, and overflow, which makes them infinite. */
#include <math.h>
#include <string.h>

#include "lcp/claims/verify.h"
#include "linalg/scale.h"

void perp__verify_layout(perp__arena *arena, void *object)
{
    perp__verify *v = object;
    const size_t n = (size_t)v->n;
    const size_t entries = v->M.column_starts                 ? (size_t)v->M.column_starts[n]
                           : n == 0 || n <= SIZE_MAX / 16 / n ? n * n
                                                              : SIZE_MAX;

    v->values = perp__arena_take(arena, entries, sizeof(double));
    v->exponents = perp__arena_take(arena, n, sizeof(int32_t));
    v->work = perp__arena_take(arena, 2 * n, sizeof(int32_t));
    PERP__DOUBLES(arena, n, &v->z, &v->q, &v->lower, &v->upper);
    v->places = perp__arena_take(arena, n, sizeof(int8_t));
    PERP__INTEGERS(arena, n, &v->active, &v->position);
    PERP__DOUBLES(arena, n, &v->high, &v->low, &v->w_high, &v->w_low, &v->w, &v->width, &v->delta,
                  &v->spread, &v->middle, &v->margin, &v->step, &v->enclosure);
    if (v->M.column_starts) {
        v->starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
        v->rows = perp__arena_take(arena, entries, sizeof(int32_t));
        v->block = perp__arena_take(arena, entries, sizeof(double));
        perp__dominance_layout(arena, &v->dominance, v->n, (int32_t)entries);
    }
}

/* values := D M D, columns one after the other */
static void scale_matrix(perp__verify *v, const perp__matrix *M)
{
    const int32_t *e = v->exponents;

    for (int32_t j = 0; j < v->n; j++) {
        double *column = v->values + (size_t)j * (size_t)v->n;
        const double *from = M->values + (size_t)j * M->column_stride;

        if (M->column_starts)
            for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
                v->values[k] = M->values[k] * perp__power_of_two(e[M->row_indices[k]] + e[j]);
        else
            for (int32_t i = 0; i < v->n; i++)
                column[i] = from[(size_t)i * M->row_stride] * perp__power_of_two(e[i] + e[j]);
    }
    v->M = *M;
    v->M.values = v->values;
    if (!M->column_starts) {
        v->M.row_stride = 1;
        v->M.column_stride = (size_t)v->n;
    }
}

/* The power of two near max |D q|; only the size of the numbers depends on it. */
static int32_t find_omega(const perp__verify *v, const double *q)
{
    int32_t largest = 0, found = 0, i;

    for (i = 0; i < v->n; i++) {
        int exponent;

        if (q[i] == 0.0)
            continue;
        frexp(q[i], &exponent);
        exponent += v->exponents[i];
        if (!found || exponent > largest)
            largest = exponent;
        found = 1;
    }
    return largest;
}

/* The natural map's reading: the side of z - w on which z lies, in scaled units. */
static int8_t read_place(const perp__verify *v, int32_t i)
{
    const double l = v->lower_caller ? v->lower_caller[i] : 0.0;
    const double u = v->upper_caller ? v->upper_caller[i] : INFINITY;

    if (perp__is_same(l, u))
        return PERP__FIXED;
    if (isfinite(l) && v->z[i] - v->lower[i] <= v->w_high[i])
        return PERP__AT_LOWER;
    if (isfinite(u) && v->z[i] - v->upper[i] >= v->w_high[i])
        return PERP__AT_UPPER;
    return PERP__BETWEEN;
}

static void read_places(perp__verify *v)
{
    perp__multiply_doubled(&v->M, v->z, v->q, v->w_high, v->w_low);
    v->count = 0;
    for (int32_t i = 0; i < v->n; i++) {
        v->places[i] = read_place(v, i);
        v->position[i] = -1;
        v->high[i] = v->places[i] == PERP__AT_UPPER  ? v->upper[i]
                     : v->places[i] == PERP__BETWEEN ? v->z[i]
                                                     : v->lower[i];
        v->low[i] = 0.0;
        if (v->places[i] == PERP__BETWEEN) {
            v->position[i] = v->count;
            v->active[v->count++] = i;
        }
    }
}

void perp__verify_scale(perp__verify *v, const perp__matrix *M, const double *q)
{
    perp__equilibrate(M, 1, v->exponents, v->width, v->work);
    v->omega = find_omega(v, q);
    scale_matrix(v, M);
    for (int32_t i = 0; i < v->n; i++) {
        const int32_t e = v->exponents[i];

        v->q[i] = ldexp(q[i], e - v->omega);
        v->z[i] = ldexp(v->z_caller[i], -e - v->omega);
        v->lower[i] = ldexp(v->lower_caller ? v->lower_caller[i] : 0.0, -e - v->omega);
        v->upper[i] = ldexp(v->upper_caller ? v->upper_caller[i] : INFINITY, -e - v->omega);
    }
    read_places(v);
}
