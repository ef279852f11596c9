#include "lcp/pgs/gradient.h"

#include <string.h>

void perp__gradient_layout(perp__arena *arena, perp__gradient *gradient, size_t n)
{
    gradient->before = perp__arena_take(arena, n, sizeof(double));
    gradient->direction = perp__arena_take(arena, n, sizeof(double));
}

void perp__gradient_restart(perp__gradient *gradient)
{
    gradient->norm = 0.0;
}

void perp__gradient_before(perp__gradient *gradient, const perp__sweeper *sweeper)
{
    memcpy(gradient->before, sweeper->z, (size_t)sweeper->rows.n * sizeof *gradient->before);
}

/* |z - before|^2, by four sums */
static double squared_step(const double *z, const double *before, int32_t n)
{
    double sum[4] = {0.0, 0.0, 0.0, 0.0};

    for (int32_t i = 0; i < n; i++) {
        double step = z[i] - before[i];

        sum[i % 4] += step * step;
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

void perp__gradient_after(perp__gradient *gradient, perp__sweeper *sweeper)
{
    const perp__rows *rows = &sweeper->rows;
    const double last = gradient->norm;
    double *z = sweeper->z, *direction = gradient->direction;
    double beta;

    gradient->norm = squared_step(z, gradient->before, rows->n);
    beta = gradient->norm <= last ? gradient->norm / last : 0.0;
    if (!(beta > 0.0)) { /* the first step, or one that is longer than the last */
        for (int32_t i = 0; i < rows->n; i++)
            direction[i] = last > 0.0 ? 0.0 : z[i] - gradient->before[i];
        return;
    }
    for (int32_t i = 0; i < rows->n; i++) {
        const double lower = rows->slices[i / PERP__SLICE].lower[i % PERP__SLICE];
        const double add = beta * direction[i];

        direction[i] = add + (z[i] - gradient->before[i]);
        z[i] = perp__clamp(z[i] + add, lower, rows->upper[i]);
    }
}
