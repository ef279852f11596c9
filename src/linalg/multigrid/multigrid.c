/* Coarse matrices of blocks, the cycle, and conjugate gradients with it. */
#include "linalg/multigrid/multigrid.h"

#include <math.h>
#include <string.h>

bool perp__coarse_values(const perp__multigrid *grid, const perp__level *fine,
                         const double *fine_values, const int8_t *inside, const perp__level *coarse,
                         double *values, double *inverse_diagonal)
{
    double *sums = grid->sums;

    for (int32_t a = 0; a < coarse->n; a++) {
        if (perp__multigrid_is_late(grid, a))
            return 0;
        for (int32_t r = fine->r_starts[a]; r < fine->r_starts[a + 1]; r++) {
            const int32_t i = fine->r_rows[r];

            if (inside && !inside[i])
                continue;
            for (int32_t k = fine->starts[i]; k < fine->starts[i + 1]; k++) {
                const int32_t j = fine->rows[k];
                const double product = fine->r_values[r] * fine_values[k];

                if (inside && !inside[j])
                    continue;
                for (int32_t p = fine->p_starts[j]; p < fine->p_starts[j + 1]; p++)
                    sums[fine->p_columns[p]] += product * fine->p_values[p];
            }
        }
        for (int32_t k = coarse->starts[a]; k < coarse->starts[a + 1]; k++) {
            double value = sums[coarse->rows[k]];

            sums[coarse->rows[k]] = 0.0;
            if (coarse->rows[k] == a) {
                if (!(value > 0.0)) /* an aggregate outside of the block: an equation x = 0 */
                    value = 1.0;
                inverse_diagonal[a] = 1.0 / value;
            }
            values[k] = value;
        }
    }
    return 1;
}

void perp__multigrid_change_block(perp__multigrid *grid, int32_t top, const int32_t *active,
                                  int32_t count)
{
    perp__level *level = &grid->level[top];

    memset(level->inside, 0, (size_t)level->n * sizeof *level->inside);
    for (int32_t k = 0; k < count; k++) {
        level->active[k] = active[k];
        level->inside[active[k]] = 1;
    }
    level->active_count = count;
}

int32_t perp__multigrid_factor_bottom(perp__multigrid *grid, const double *values,
                                      const int32_t *active, int32_t count, double rho)
{
    const perp__level *last = &grid->level[grid->levels - 1];

    perp__fronts_take(&grid->bottom, active, count);
    for (int32_t j = 0; j < last->n; j++)
        for (int32_t k = last->starts[j]; k < last->starts[j + 1]; k++)
            grid->bottom.values[k] = values[k] + (last->rows[k] == j ? rho : 0.0);
    return perp__fronts_factor(&grid->bottom, 0, count);
}

bool perp__multigrid_take_block(perp__multigrid *grid, int32_t top, const int32_t *active,
                                int32_t count)
{
    const perp__level *bottom = &grid->level[grid->levels - 1];

    grid->top = top;
    perp__multigrid_change_block(grid, top, active, count);
    for (int32_t k = top; k + 1 < grid->levels; k++) {
        const perp__level *fine = &grid->level[k];

        if (!perp__coarse_values(grid, fine, k == top ? fine->values : fine->block_values,
                                 k == top ? fine->inside : NULL, fine + 1, fine[1].block_values,
                                 fine[1].block_inverse_diagonal))
            return 0;
    }
    /* aggregates that are all but outside of the block can lose their pivots to rounding */
    return perp__multigrid_factor_bottom(grid, bottom->block_values, bottom->active, bottom->n,
                                         0.0) ||
           perp__multigrid_factor_bottom(grid, bottom->block_values, bottom->active, bottom->n,
                                         1e-10);
}

/* The rows of a level that take part. */
typedef struct rows {
    const perp__level *level;
    const double *values, *inverse_diagonal;
    const int32_t *list; /* NULL: all */
    int32_t count;
} rows;

static rows rows_of(const perp__multigrid *grid, int32_t k)
{
    const perp__level *l = &grid->level[k];
    const rows block = {l, l->values, l->inverse_diagonal, l->active, l->active_count};
    const rows all = {l, l->block_values, l->block_inverse_diagonal, NULL, l->n};

    return k == grid->top ? block : all;
}

/* A Gauss-Seidel sweep; x is 0 outside of the block. */
static void sweep(const rows *r, const double *b, double *x, bool forward)
{
    for (int32_t step = 0; step < r->count; step++) {
        const int32_t k = forward ? step : r->count - 1 - step;
        const int32_t i = r->list ? r->list[k] : k;

        x[i] += (b[i] - perp__level_times(r->level, r->values, i, x)) * r->inverse_diagonal[i];
    }
}

/* One V-cycle from x = 0, symmetric: sweeps forwards on the way down, backwards on the way up.
 * Returns 0 if the deadline ends it. */
static bool cycle(perp__multigrid *grid, const double *b, double *x)
{
    const int32_t last = grid->levels - 1;

    for (int32_t k = grid->top; k < last; k++) {
        const rows r = rows_of(grid, k);
        const perp__level *level = r.level, *coarse = level + 1;
        const double *b_k = k == grid->top ? b : level->b;
        double *x_k = k == grid->top ? x : level->x;

        if (perp__multigrid_is_late(grid, 0))
            return 0;
        memset(x_k, 0, (size_t)level->n * sizeof *x_k);
        sweep(&r, b_k, x_k, 1);
        /* b_coarse = P' (b - S x) */
        memset(coarse->b, 0, (size_t)coarse->n * sizeof(double));
        for (int32_t step = 0; step < r.count; step++) {
            const int32_t i = r.list ? r.list[step] : step;
            const double residual = b_k[i] - perp__level_times(level, r.values, i, x_k);

            for (int32_t p = level->p_starts[i]; p < level->p_starts[i + 1]; p++)
                coarse->b[level->p_columns[p]] += level->p_values[p] * residual;
        }
    }
    memcpy(grid->level[last].x, grid->level[last].b, (size_t)grid->level[last].n * sizeof(double));
    perp__fronts_solve(&grid->bottom, 0, grid->level[last].n, grid->level[last].x);
    for (int32_t k = last - 1; k >= grid->top; k--) {
        const rows r = rows_of(grid, k);
        const perp__level *level = r.level;
        double *x_k = k == grid->top ? x : level->x;

        if (perp__multigrid_is_late(grid, 0))
            return 0;
        /* x += P x_coarse */
        for (int32_t step = 0; step < r.count; step++) {
            const int32_t i = r.list ? r.list[step] : step;
            double sum = 0.0;

            for (int32_t p = level->p_starts[i]; p < level->p_starts[i + 1]; p++)
                sum += level->p_values[p] * level[1].x[level->p_columns[p]];
            x_k[i] += sum;
        }
        sweep(&r, k == grid->top ? b : level->b, x_k, 0);
    }
    return 1;
}

static double dot(const rows *r, const double *x, const double *y)
{
    double sum = 0.0;

    for (int32_t k = 0; k < r->count; k++)
        sum += x[r->list[k]] * y[r->list[k]];
    return sum;
}

/* Saad, "Iterative Methods for Sparse Linear Systems" (2003), algorithm 9.1. With large jumps of a
 * coefficient the residual falls late; its norm in the preconditioner, rho, tells more. */
int32_t perp__multigrid_solve(perp__multigrid *grid, double *b, double *x, double tolerance,
                              int32_t limit)
{
    const rows r = rows_of(grid, grid->top);
    const size_t bytes = (size_t)r.level->n * sizeof(double);
    const double square = tolerance * tolerance, goal = square * dot(&r, b, b);
    double first = 0.0, rho = 0.0;
    int32_t steps;

    if (!isfinite(goal))
        return -1;
    memset(x, 0, bytes);
    memset(grid->direction, 0, bytes);
    for (steps = 0; !(dot(&r, b, b) <= goal); steps++) {
        const double before = rho;
        double curvature = 0.0, beta, length;

        if (!cycle(grid, b, grid->preconditioned))
            return -1;
        rho = dot(&r, b, grid->preconditioned);
        first = steps == 0 ? rho : first;
        if (steps > 0 && rho >= 0.0 && rho <= square * first)
            break;
        if (steps == limit)
            return -1;
        beta = steps > 0 ? rho / before : 0.0;
        for (int32_t k = 0; k < r.count; k++) {
            const int32_t i = r.list[k];

            grid->direction[i] = grid->preconditioned[i] + beta * grid->direction[i];
        }
        for (int32_t k = 0; k < r.count; k++) {
            const int32_t i = r.list[k];

            grid->product[i] = perp__level_times(r.level, r.values, i, grid->direction);
            curvature += grid->product[i] * grid->direction[i];
        }
        if (!(rho > 0.0) || !(curvature > 0.0))
            return -1;
        length = rho / curvature;
        for (int32_t k = 0; k < r.count; k++) {
            const int32_t i = r.list[k];

            x[i] += length * grid->direction[i];
            b[i] -= length * grid->product[i];
        }
    }
    return steps;
}
