#include "linalg/held_rows.h"

#include <math.h>

#include "linalg/orthogonal.h"

/* A direction is determined if no more than this of it is outside of the rows' span. */
#define SPAN 1e-10

static double dot(const double *a, const double *b, int32_t n)
{
    double sum = 0.0;

    for (int32_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

void perp__held_rows_layout(perp__held_rows *held, perp__arena *arena, size_t entries, size_t most,
                            size_t n)
{
    held->rows = perp__arena_take(arena, entries, sizeof(double));
    PERP__DOUBLES(arena, most, &held->targets, &held->norms);
    held->taken = perp__arena_take(arena, most, sizeof(int32_t));
    held->basis = perp__arena_take(arena, n, n * sizeof(double));
    PERP__DOUBLES(arena, n, &held->particular, &held->components, &held->unit);
}

void perp__held_rows_begin(perp__held_rows *held, int32_t n)
{
    held->n = n;
    held->count = held->rank = 0;
}

double *perp__held_rows_next(const perp__held_rows *held)
{
    return held->rows + (size_t)held->count * (size_t)held->n;
}

void perp__held_rows_take(perp__held_rows *held, double target)
{
    double *row = perp__held_rows_next(held), largest = 0.0, length;

    for (int32_t i = 0; i < held->n; i++)
        largest = fmax(largest, fabs(row[i]));
    if (largest == 0.0)
        return;
    for (int32_t i = 0; i < held->n; i++) /* squares must not leave the range of doubles */
        row[i] /= largest;
    length = sqrt(dot(row, row, held->n));
    for (int32_t i = 0; i < held->n; i++)
        row[i] /= length;
    held->targets[held->count++] = target / largest / length;
}

void perp__held_rows_solve(perp__held_rows *held)
{
    held->rank = perp__orthogonal_rows(held->rows, held->targets, held->taken, held->norms,
                                       held->basis, held->particular, held->count, held->n);
}

void perp__held_rows_free(perp__held_rows *held, double *y)
{
    perp__project_out(held->basis, held->rank, held->n, y);
    for (int32_t k = 0; k < held->n; k++)
        y[k] += held->particular[k];
    for (int32_t k = 0; k < held->rank;
         k++) /* exactly 0 where other bodies' rows alone have targets */
        held->components[k] =
            dot(held->basis + (size_t)k * (size_t)held->n, held->particular, held->n);
}

int32_t perp__held_rows_fix(perp__held_rows *held, int32_t first, int32_t count)
{
    double *unit = held->unit, share = 0.0;

    for (int32_t k = 0; k < held->rank; k++) {
        const double *q = held->basis + (size_t)k * (size_t)held->n;
        const double along = dot(q + first, unit + first, count);

        if (along != 0.0 && held->components[k] != 0.0)
            return 0;
        share += along * along;
    }
    if (!(share > 0.5)) /* far off, as most are: not worth the exact test */
        return 0;
    perp__project_out(held->basis, held->rank, held->n, unit);
    return sqrt(dot(unit, unit, held->n)) <= SPAN;
}
