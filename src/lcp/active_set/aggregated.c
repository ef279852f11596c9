/* With z = r + P y, r a bound where there is one and P joining pairs of strongly coupled variables,
 * the problem of the next coarser level is
 *
 *   y in its bounds,  P' M P y + P' (M r + q)   complementary,
 *
 * as in nested.c, but in no need of symmetry: nothing is asked of these problems but an index set
 * that differs from the finer one's in few rows. Each level has about half of the rows: Notay, "An
 * aggregation-based algebraic multigrid method", ETNA 37 (2010) 123. Sweeps in both directions
 * follow a flow in one of them; on upwind differences with cell Peclet numbers from 0.1 to 10 the
 * finest index set then takes 3 to 9 factorisations on 1e4 rows, instead of 30. */
#include "lcp/active_set/aggregated.h"

#include <math.h>

#include "base/clock.h"
#include "base/context.h"

#define SMALLEST 1000 /* below, a few more factorisations cost less than the levels */
#define COARSEST 400
#define STRONG 0.25 /* of a column's largest coupling */
#define DENSER 0.9  /* share of the entries: where so many are left, coarsening does not pay */

int32_t perp__aggregated_suits(const perp__lcp_problem *problem)
{
    const perp__sparse_block *block = problem->block;

    return problem->n >= SMALLEST && block->kind == PERP__SPARSE_GENERAL && block->is_nearly_z;
}

/* ---- levels ---- */

static void layout_level(perp__arena *arena, void *object)
{
    perp__aggregated_level *level = object;
    const size_t n = (size_t)level->n;
    const int32_t own = level->entries > 0;

    level->aggregate = perp__arena_take(arena, n, sizeof(int32_t));
    PERP__DOUBLES(arena, n, &level->q, &level->lower, &level->upper, &level->z, &level->w,
                  &level->diagonal);
    level->own_starts = perp__arena_take(arena, own ? n + 1 : 0, sizeof(int32_t));
    level->own_rows = perp__arena_take(arena, level->entries, sizeof(int32_t));
    level->own_values = perp__arena_take(arena, level->entries, sizeof(double));
}

static void layout_shared(perp__arena *arena, void *object)
{
    perp__aggregated *coarse = object;
    const size_t n = (size_t)coarse->level[0].n;

    PERP__INTEGERS(arena, n, &coarse->position, &coarse->zeros);
    coarse->members = perp__arena_take(arena, 2 * n, sizeof(int32_t));
    PERP__DOUBLES(arena, n, &coarse->ones, &coarse->norms);
}

/* Pairs, and what is left alone; members of pair a in members[2 a], [2 a + 1] or -1. Returns how
 * many. */
static int32_t pair(perp__aggregated *coarse, perp__aggregated_level *level)
{
    const perp__matrix *M = &level->M;
    int32_t count = 0;

    for (int32_t i = 0; i < level->n; i++)
        level->aggregate[i] = -1;
    for (int32_t j = 0; j < level->n; j++) {
        double largest = 0.0, best = 0.0;
        int32_t other = -1; /* coupled most to j among those that no pair has, and strongly */

        if (level->aggregate[j] >= 0)
            continue;
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];
            const double coupling = i == j ? 0.0 : -(M->values[k] + perp__entry(M, j, i));

            largest = fmax(largest, coupling);
            if (level->aggregate[i] < 0 && coupling > best) {
                best = coupling;
                other = i;
            }
        }
        if (!(best >= STRONG * largest))
            other = -1;
        level->aggregate[j] = count;
        if (other >= 0)
            level->aggregate[other] = count;
        coarse->members[2 * count] = j;
        coarse->members[2 * count++ + 1] = other;
    }
    return count;
}

/* Whether every diagonal entry is there and positive; these are noted. */
static int32_t read_diagonal(perp__aggregated_level *level)
{
    int32_t j;

    for (j = 0; j < level->n; j++) {
        level->diagonal[j] = perp__diagonal_entry(&level->M, j);
        if (!(level->diagonal[j] > 0.0 && isfinite(level->diagonal[j])))
            break;
    }
    return j == level->n;
}

/* Level k + 1 from level k, M := P' M P. *useful: there is one, and it is smaller. */
static perp_status coarsen(perp__aggregated *coarse, int32_t k, int32_t *useful)
{
    perp__aggregated_level *fine = &coarse->level[k], *level = fine + 1;
    const int32_t *starts = fine->M.column_starts;
    perp_status status;
    int32_t at = 0;

    level->n = pair(coarse, fine);
    level->entries = (size_t)starts[fine->n];
    status = perp__arena_fit(&level->arena, coarse->context, layout_level, level);
    if (status != PERP_OK)
        return status;
    for (int32_t a = 0; a < level->n; a++)
        coarse->position[a] = -1;
    for (int32_t a = 0; a < level->n; a++) {
        const int32_t first = at;

        level->own_starts[a] = at;
        for (int32_t m = 0; m < 2 && coarse->members[2 * a + m] >= 0; m++) {
            const int32_t j = coarse->members[2 * a + m];

            for (int32_t e = starts[j]; e < starts[j + 1]; e++) {
                const int32_t row = fine->aggregate[fine->M.row_indices[e]];
                int32_t place = coarse->position[row];

                if (place < first) { /* not in this column yet: moved to its place among the rows */
                    for (place = at++; place > first && level->own_rows[place - 1] > row; place--) {
                        level->own_rows[place] = level->own_rows[place - 1];
                        level->own_values[place] = level->own_values[place - 1];
                        coarse->position[level->own_rows[place]] = place;
                    }
                    level->own_rows[place] = row;
                    level->own_values[place] = 0.0;
                    coarse->position[row] = place;
                }
                level->own_values[place] += fine->M.values[e];
            }
        }
    }
    level->own_starts[level->n] = at;
    level->M = (perp__matrix){level->n,          level->n,       0, 0, level->own_values,
                              level->own_starts, level->own_rows};
    *useful = read_diagonal(level) && at <= DENSER * (double)level->entries;
    return PERP_OK;
}

perp_status perp__aggregated_build(perp__aggregated *coarse, const perp__lcp_problem *problem)
{
    perp__aggregated_level *finest;
    perp_status status;
    int32_t useful = 1, is_late = 0, k;

    if (coarse->levels > 0)
        return PERP_OK;
    coarse->context = problem->context;
    if (!coarse->level)
        coarse->level = perp__allocate_zeros(coarse->context, PERP__LEVELS, sizeof *coarse->level,
                                             "coarser problems");
    finest = coarse->level;
    if (!finest)
        return PERP_ERROR_MEMORY;
    finest->n = problem->n;
    finest->M = *problem->M;
    finest->entries = 0;
    status = perp__arena_fit(&coarse->arena, coarse->context, layout_shared, coarse);
    PERP__THEN(status, perp__arena_fit(&finest->arena, coarse->context, layout_level, finest));
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < problem->n; i++) {
        coarse->ones[i] = 1.0;
        coarse->zeros[i] = 0;
    }
    useful = read_diagonal(finest);
    for (k = 0; status == PERP_OK && useful && k + 1 < PERP__LEVELS; k++)
        if ((is_late = perp__is_past(problem->block->deadline)) || coarse->level[k].n <= COARSEST)
            break;
        else
            status = coarsen(coarse, k, &useful);
    coarse->levels = status == PERP_OK && !is_late ? k + (useful ? 1 : 0) : 0;
    if (status == PERP_OK && !is_late && coarse->levels == 0)
        coarse->levels = 1;
    return status;
}

void perp__aggregated_release(perp__aggregated *coarse)
{
    for (int32_t k = 0; k < PERP__LEVELS && coarse->level; k++)
        perp__arena_release(&coarse->level[k].arena);
    perp__arena_release(&coarse->arena);
    perp__release(coarse->context, coarse->level);
    coarse->level = NULL;
    coarse->levels = 0;
}

/* ---- problems ---- */

void perp__aggregated_load(perp__aggregated *coarse, const perp__lcp_problem *problem)
{
    perp__aggregated_level *finest = &coarse->level[0];
    const perp__aggregated_level *last = &coarse->level[coarse->levels - 1];

    for (int32_t i = 0; i < problem->n; i++) {
        finest->q[i] = problem->q[i] / problem->factors[i];
        finest->lower[i] = problem->lower[i] * problem->factors[i];
        finest->upper[i] = problem->upper[i] * problem->factors[i];
    }
    for (int32_t k = 0; k + 1 < coarse->levels; k++) {
        perp__aggregated_level *fine = &coarse->level[k], *next = fine + 1;

        for (int32_t a = 0; a < next->n; a++) {
            next->q[a] = 0.0;
            next->lower[a] = -INFINITY;
            next->upper[a] = INFINITY;
        }
        for (int32_t i = 0; i < fine->n; i++)
            fine->z[i] = perp__finite_bound(fine->lower[i], fine->upper[i]);
        perp__multiply(&fine->M, fine->z, fine->w);
        for (int32_t i = 0; i < fine->n; i++) {
            const int32_t a = fine->aggregate[i];

            next->q[a] += fine->w[i] + fine->q[i];
            next->lower[a] = fmax(next->lower[a], fine->lower[i] - fine->z[i]);
            next->upper[a] = fmin(next->upper[a], fine->upper[i] - fine->z[i]);
        }
    }
    for (int32_t i = 0; i < last->n; i++)
        last->z[i] = perp__clamp(0.0, last->lower[i], last->upper[i]);
}

void perp__aggregated_prolong(perp__aggregated *coarse, int32_t k)
{
    perp__aggregated_level *level = &coarse->level[k];

    for (int32_t i = 0; i < level->n; i++)
        level->z[i] = perp__clamp(perp__finite_bound(level->lower[i], level->upper[i]) +
                                      level[1].z[level->aggregate[i]],
                                  level->lower[i], level->upper[i]);
}

/* Column by column: w follows z. */
static void sweep(perp__aggregated_level *level, int32_t forward)
{
    const perp__matrix *M = &level->M;

    for (int32_t step = 0; step < level->n; step++) {
        const int32_t j = forward ? step : level->n - 1 - step;
        const double z = perp__clamp(level->z[j] - level->w[j] / level->diagonal[j],
                                     level->lower[j], level->upper[j]);
        const double change = z - level->z[j];

        for (int32_t k = M->column_starts[j]; change != 0.0 && k < M->column_starts[j + 1]; k++)
            level->w[M->row_indices[k]] += M->values[k] * change;
        level->z[j] = z;
    }
}

void perp__aggregated_smooth(perp__aggregated *coarse, int32_t k)
{
    perp__aggregated_level *level = &coarse->level[k];

    perp__multiply(&level->M, level->z, level->w);
    for (int32_t i = 0; i < level->n; i++)
        level->w[i] += level->q[i];
    sweep(level, 1);
    sweep(level, 0);
}

void perp__aggregated_pose(perp__aggregated *coarse, int32_t k, const perp__lcp_problem *problem,
                           perp__sparse_block *block, perp__lcp_problem *own)
{
    const perp__aggregated_level *level = &coarse->level[k];

    perp__scaled_row_norms(&level->M, coarse->zeros, coarse->norms);
    *own = *problem;
    own->n = level->n;
    own->M = &level->M;
    own->factors = coarse->ones;
    own->row_norms = coarse->norms;
    own->q = level->q;
    own->lower = level->lower;
    own->upper = level->upper;
    own->block = block;
}
