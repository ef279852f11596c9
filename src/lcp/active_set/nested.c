/* Obstacle-like problems from coarse to fine. With z = r + P y, r a bound where there is one, the
 * problem of the next coarser level is
 *
 *   y in [0 or -inf, ...], P' S P y + P' (S r + q)   complementary,
 *
 * which keeps z within its bounds, as P >= 0 for M-matrices. Its solution, brought back to the
 * finer level, has an index set that a few rows beside the true boundary differ from. The truncated
 * nonsmooth Newton method of Graeser & Kornhuber ("Multigrid methods for obstacle problems", J.
 * Comput. Math. 27 (2009) 1) moves them: a projected Gauss-Seidel sweep, whose clamped rows are the
 * index set, then a rough solve with the rest, one or two multigrid cycles. Conjugate gradients
 * take the place of their line search.
 *
 * Where M is not symmetric, sweeps in both directions do alone: one of them follows a flow. On
 * upwind differences with cell Peclet numbers from 0.1 to 10 the index set that they leave takes 3
 * to 10 factorisations on 1e4 to 1e5 rows, instead of 25 and more.
 *
 * Left out, because they did not pay on grids of 1e4 to 1e5 nodes: more sweeps a step, and many
 * sweeps along the boundary of the index set alone (half the steps on jumping coefficients, the
 * same time). */
#include "lcp/active_set/active_set.h"

#include <math.h>
#include <string.h>

#include "base/outcome.h"

#define STEPS 20  /* on each level */
#define ROUGH 0.2 /* relative residual of a step's equations */
#define FEW_CYCLES 4

static void layout(perp__arena *arena, void *object)
{
    perp__nested *nested = object;
    const perp__multigrid *grid = nested->grid;

    nested->correction = perp__arena_take(arena, (size_t)grid->level[0].n, sizeof(double));
    nested->active = perp__arena_take(arena, (size_t)grid->level[0].n, sizeof(int32_t));
    nested->level = perp__arena_take(arena, (size_t)grid->levels, sizeof *nested->level);
    for (int32_t k = 0; k < grid->levels; k++) {
        perp__nested_level measured, *level = nested->level ? &nested->level[k] : &measured;
        const size_t n = (size_t)grid->level[k].n;

        PERP__DOUBLES(arena, k > 0 ? n : 0, &level->own_q, &level->own_lower, &level->own_upper,
                      &level->z);
        level->places = perp__arena_take(arena, k > 0 ? n : 0, sizeof(int8_t));
        level->residual = perp__arena_take(arena, n, sizeof(double));
    }
}

perp_status perp__nested_fit(perp__nested *nested, perp__multigrid *grid)
{
    nested->grid = grid;
    return perp__arena_fit(&nested->arena, grid->context, layout, nested);
}

void perp__nested_release(perp__nested *nested)
{
    if (nested->grid)
        perp__arena_release(&nested->arena);
}

/* The problem of level k + 1 from that of level k. */
static void coarsen(perp__nested *nested, int32_t k)
{
    const perp__level *grid = &nested->grid->level[k];
    const perp__nested_level *fine = &nested->level[k];
    perp__nested_level *coarse = &nested->level[k + 1];

    /* 1. The bounds of an aggregate are the tightest of its rows, in the aggregate's share of t. */
    for (int32_t i = 0; i < grid->coarse; i++) {
        coarse->own_lower[i] = -INFINITY;
        coarse->own_upper[i] = INFINITY;
    }
    for (int32_t i = 0; i < grid->n; i++) {
        const int32_t a = grid->aggregate[i];
        const double r = perp__finite_bound(fine->lower[i], fine->upper[i]);

        if (a >= 0) {
            const double share = grid[1].near_null[a] / grid->near_null[i];

            coarse->own_lower[a] = fmax(coarse->own_lower[a], (fine->lower[i] - r) * share);
            coarse->own_upper[a] = fmin(coarse->own_upper[a], (fine->upper[i] - r) * share);
        }
        nested->correction[i] = r;
    }
    /* 2. q of the next level: P' (S r + q) */
    memset(coarse->own_q, 0, (size_t)grid->coarse * sizeof(double));
    for (int32_t i = 0; i < grid->n; i++) {
        const double load =
            perp__level_times(grid, grid->values, i, nested->correction) + fine->q[i];

        for (int32_t p = grid->p_starts[i]; p < grid->p_starts[i + 1]; p++)
            coarse->own_q[grid->p_columns[p]] += grid->p_values[p] * load;
    }
    coarse->q = coarse->own_q;
    coarse->lower = coarse->own_lower;
    coarse->upper = coarse->own_upper;
}

/* A projected Gauss-Seidel sweep. Notes where each row ended; returns how many notes changed. */
static int32_t sweep(const perp__nested *nested, int32_t k, int32_t forward)
{
    const perp__level *grid = &nested->grid->level[k];
    const perp__nested_level *level = &nested->level[k];
    int32_t changes = 0, step;

    for (step = 0; step < grid->n; step++) {
        const int32_t i = forward ? step : grid->n - 1 - step;
        const double w = perp__level_times(grid, grid->values, i, level->z) + level->q[i];
        const double z = level->z[i] - w * grid->inverse_diagonal[i];
        const int8_t place = level->lower[i] == level->upper[i] ? PERP__FIXED
                             : z <= level->lower[i]             ? PERP__AT_LOWER
                             : z >= level->upper[i]             ? PERP__AT_UPPER
                                                                : PERP__BETWEEN;

        level->z[i] = perp__clamp(z, level->lower[i], level->upper[i]);
        changes += place != level->places[i];
        level->places[i] = place;
    }
    return changes;
}

/* Newton's step for the rows between their bounds: exact on the last level, else by multigrid, and
 * rough. Coarse matrices of an index set that has changed since serve while the cycles that a solve
 * takes stay few: making them costs as much as three or four. Returns 0 if that fails. */
static int32_t correct(perp__nested *nested, int32_t k, int32_t *cycles)
{
    perp__multigrid *grid = nested->grid;
    const perp__level *rows = &grid->level[k];
    const perp__nested_level *level = &nested->level[k];
    const int32_t *active = nested->active;
    int32_t count = 0, done = 1;

    for (int32_t i = 0; i < rows->n; i++)
        if (level->places[i] == PERP__BETWEEN)
            nested->active[count++] = i;
    for (int32_t r = 0; r < count; r++)
        level->residual[active[r]] =
            -(perp__level_times(rows, rows->values, active[r], level->z) + level->q[active[r]]);
    if (k == grid->levels - 1) {
        done = perp__multigrid_factor_bottom(grid, rows->values, active, count, 0.0);
        if (done) {
            perp__fronts_solve(&grid->bottom, 0, count, level->residual);
            memcpy(nested->correction, level->residual, (size_t)rows->n * sizeof(double));
        }
    } else {
        if (*cycles <= FEW_CYCLES)
            perp__multigrid_change_block(grid, k, active, count);
        else
            done = perp__multigrid_take_block(grid, k, active, count);
        if (done)
            *cycles = perp__multigrid_solve(grid, level->residual, nested->correction, ROUGH,
                                            PERP__STEPS);
        done = done && *cycles >= 0;
    }
    for (int32_t r = 0; r < count && done; r++) {
        const int32_t i = active[r];

        level->z[i] =
            perp__clamp(level->z[i] + nested->correction[i], level->lower[i], level->upper[i]);
    }
    return done;
}

/* Sweeps and corrections until the index set settles, or as far as they get. The finest level may
 * stop on request. */
static void settle(perp__nested *nested, const perp__lcp_problem *problem, int32_t k,
                   int64_t *iterations, perp_outcome *request)
{
    const int32_t n = nested->grid->level[k].n;
    const bool only_sweeps = nested->grid->unsymmetric;
    int32_t changes, cycles = FEW_CYCLES + 1; /* there are no coarse matrices yet */

    *request = perp__is_past(nested->grid->deadline) ? PERP_OUTCOME_TIME_LIMIT : *request;
    memset(nested->level[k].places, PERP__FIXED, (size_t)n); /* none of what a sweep notes */
    sweep(nested, k, 1);
    for (int32_t step = 0; step < STEPS && *request < 0; step++) {
        changes = sweep(nested, k, step % 2);
        if (!only_sweeps && ((step > 0 && changes == 0) || !correct(nested, k, &cycles)))
            return;
        if (k > 0 || only_sweeps) {
            *request = perp__is_past(nested->grid->deadline) ? PERP_OUTCOME_TIME_LIMIT : -1;
            continue;
        }
        *request = perp__lcp_tick(problem->control, ++*iterations, INFINITY);
        if (*request < 0 && problem->iteration_limit > 0 && *iterations >= problem->iteration_limit)
            *request = PERP_OUTCOME_ITERATION_LIMIT;
    }
}

bool perp__nested_run(perp__nested *nested, const perp__lcp_problem *problem, bool warm, double *z,
                      int8_t *places, int64_t *iterations, perp_outcome *request)
{
    const int32_t last = nested->grid->levels - 1;
    perp__nested_level *finest = &nested->level[0];

    *request = -1;
    finest->q = problem->q;
    finest->lower = problem->lower;
    finest->upper = problem->upper;
    finest->z = z;
    finest->places = places;
    for (int32_t k = 0; !warm && k < last; k++)
        coarsen(nested, k);
    for (int32_t k = warm ? 0 : last; k >= 0; k--) {
        const perp__level *grid = &nested->grid->level[k];
        const perp__nested_level *level = &nested->level[k];

        for (int32_t i = 0; !warm && i < grid->n; i++) {
            double start = 0.0; /* on the coarsest level; else r + P y */

            if (k < last) {
                start = perp__finite_bound(level->lower[i], level->upper[i]);
                for (int32_t p = grid->p_starts[i]; p < grid->p_starts[i + 1]; p++)
                    start += grid->p_values[p] * level[1].z[grid->p_columns[p]];
            }
            level->z[i] = perp__clamp(start, level->lower[i], level->upper[i]);
        }
        settle(nested, problem, k, iterations, request);
    }
    return perp__all_finite(z, (size_t)problem->n);
}
