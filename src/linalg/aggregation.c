/* Which rows form a coarse variable: rows that are strongly coupled (Vanek, Mandel & Brezina 1996,
 * section 5). */
#include <math.h>

#include "linalg/multigrid.h"

#define PERP__FEW_SWEEPS 2
#define PERP__MANY_SWEEPS 10

int32_t perp__is_coupled(const perp__level *level, double threshold, int32_t i, int32_t k)
{
    const int32_t j = level->rows[k];
    const double value = level->values[k];

    return value < 0.0 && j != i &&
           value * value * level->inverse_diagonal[i] * level->inverse_diagonal[j] >
               threshold * threshold;
}

/* One symmetric Gauss-Seidel sweep on S t = 0, keeping t positive. Returns how many rows changed by
 * more than a twentieth. */
static int32_t sweep(const perp__level *level)
{
    const int32_t n = level->n;
    double *t = level->near_null;
    int32_t changes = 0, step, k;

    for (step = 0; step < 2 * n; step++) {
        const int32_t i = step < n ? step : 2 * n - 1 - step;
        double sum = 0.0, before = t[i];

        for (k = level->starts[i]; k < level->starts[i + 1]; k++)
            sum += level->values[k] * t[level->rows[k]];
        t[i] = fmax(before - sum * level->inverse_diagonal[i], 0x1p-10 * before);
        changes += step < n && fabs(t[i] - before) > 0.05 * before;
    }
    return changes;
}

/* From t = 1. Where neighbouring rows differ in scale, as across a jump of a coefficient, many rows
 * change and it takes more sweeps. */
void perp__find_near_null(const perp__level *level)
{
    int32_t sweeps, limit = PERP__FEW_SWEEPS, i;

    for (i = 0; i < level->n; i++)
        level->near_null[i] = 1.0;
    for (sweeps = 0; sweeps < limit; sweeps++)
        if (sweep(level) > level->n / 10)
            limit = PERP__MANY_SWEEPS;
}

/* A row whose strong neighbours are all unclaimed starts an aggregate with them. Rows without
 * strong neighbours belong to none: sweeps alone solve for them. */
static void start_aggregates(perp__level *level, double threshold)
{
    int32_t *aggregate = level->aggregate;

    for (int32_t i = 0; i < level->n; i++)
        aggregate[i] = -1;
    for (int32_t i = 0; i < level->n; i++) {
        int32_t strong = 0, claimed = aggregate[i] >= 0;

        for (int32_t k = level->starts[i]; k < level->starts[i + 1] && !claimed; k++)
            if (perp__is_coupled(level, threshold, i, k)) {
                strong++;
                claimed = aggregate[level->rows[k]] >= 0;
            }
        if (claimed || strong == 0)
            continue;
        for (int32_t k = level->starts[i]; k < level->starts[i + 1]; k++)
            if (perp__is_coupled(level, threshold, i, k))
                aggregate[level->rows[k]] = level->coarse;
        aggregate[i] = level->coarse++;
    }
}

/* The aggregate of the strongest neighbour that has one, or -1. */
static int32_t strongest(const perp__level *level, double threshold, int32_t i)
{
    double largest = 0.0;
    int32_t found = -1, k;

    for (k = level->starts[i]; k < level->starts[i + 1]; k++) {
        const int32_t j = level->rows[k];

        if (level->aggregate[j] >= 0 && -level->values[k] > largest &&
            perp__is_coupled(level, threshold, i, k)) {
            largest = -level->values[k];
            found = level->aggregate[j];
        }
    }
    return found;
}

/* What is left next to an aggregate joins it; -2 - a until all have chosen. */
static void join_aggregates(perp__level *level, double threshold)
{
    int32_t *aggregate = level->aggregate;

    for (int32_t i = 0; i < level->n; i++)
        if (aggregate[i] == -1) {
            const int32_t a = strongest(level, threshold, i);

            aggregate[i] = a < 0 ? -1 : -2 - a;
        }
    for (int32_t i = 0; i < level->n; i++)
        if (aggregate[i] < -1)
            aggregate[i] = -2 - aggregate[i];
}

void perp__aggregate(perp__level *level, double threshold)
{
    level->coarse = 0;
    start_aggregates(level, threshold);
    join_aggregates(level, threshold);
}
