/* The workspace of one island, and its problem within what the step may still spend. */
#include "world/world.h"

#include <float.h>
#include <math.h>

#include "base/context.h"
#include "lcp/lcp.h"

static void lay_out_rows(perp__arena *arena, perp__island_work *work)
{
    size_t rows = (size_t)work->max_rows;

    /* rows squared: two factors, so that the arena sees an overflow */
    work->matrix = perp__arena_take(arena, rows, rows * sizeof *work->matrix);
    work->q = perp__arena_take(arena, rows, sizeof *work->q);
    work->z = perp__arena_take(arena, rows, sizeof *work->z);
}

static void lay_out(perp__arena *arena, void *object)
{
    perp_world *world = object;
    perp__island_work *work = &world->work;
    size_t held = (size_t)work->max_held_rows;
    size_t columns = (size_t)work->max_columns;

    lay_out_rows(arena, work);
    work->held_rows = perp__arena_take(arena, held, columns * sizeof *work->held_rows);
    work->targets = perp__arena_take(arena, held, sizeof *work->targets);
    work->norms = perp__arena_take(arena, held, sizeof *work->norms);
    work->taken = perp__arena_take(arena, held, sizeof *work->taken);
    work->basis = perp__arena_take(arena, columns, columns * sizeof *work->basis);
    work->particular = perp__arena_take(arena, columns, sizeof *work->particular);
    work->loose = perp__arena_take(arena, columns, sizeof *work->loose);
    work->unit = perp__arena_take(arena, columns, sizeof *work->unit);
    work->group_bodies = perp__arena_take(arena, columns, sizeof *work->group_bodies);
}

perp_status perp__fit_island_work(perp_world *world, int32_t velocities)
{
    perp__island_work *work = &world->work;
    int32_t axes = world->settings.planar ? 2 : 3;
    int32_t i;

    work->max_rows = work->max_held_rows = work->max_columns = 0;
    for (i = 0; i < world->island_count; i++) {
        const perp__island *island = &world->islands[i];

        if (island->rows > work->max_rows)
            work->max_rows = island->rows;
        if (velocities && axes * island->contacts > work->max_held_rows)
            work->max_held_rows = axes * island->contacts;
        if (velocities && world->dof * island->bodies > work->max_columns)
            work->max_columns = world->dof * island->bodies;
    }
    return perp__arena_fit(&world->island_arena, lay_out, world);
}

/* What the step may still spend limits the solver, but for a part of the time that is kept for
 * sweeps. */
static perp_status limit_solver(perp_world *world)
{
    perp_lcp_settings settings = world->solver_settings;

    if (settings.time_limit > 0.0)
        settings.time_limit = fmax(0.75 * perp__seconds_left(world), DBL_MIN);
    if (settings.max_iterations > world->budget.iterations)
        settings.max_iterations = (int32_t)world->budget.iterations;
    return perp__lcp_set(world->solver, &settings);
}

static perp_status set_up_rows(perp_world *world, int32_t n)
{
    perp_matrix W;
    perp_status status = perp_matrix_init(&W, sizeof W);

    if (status == PERP_OK)
        status = perp_matrix_dense(&W, PERP_STORAGE_COLUMN_MAJOR, n, n, world->work.matrix, n);
    if (status == PERP_OK)
        status = perp__lcp_setup(world->solver, &W, NULL, NULL);
    world->work.set_up = status == PERP_OK;
    return status;
}

perp_status perp__solve_rows(perp_world *world, int32_t n)
{
    perp__island_work *work = &world->work;
    perp_status status = limit_solver(world);

    if (status == PERP_OK && !work->set_up)
        status = set_up_rows(world, n);
    if (status == PERP_OK)
        status = perp__lcp_solve(world->solver, work->z, NULL, NULL, &work->result, work->q, NULL);
    if (status == PERP_OK)
        perp__spend(world, work->result.iterations);
    if (status == PERP_ERROR_ARGUMENT && world->settings.method == PERP_LCP_PGS)
        status = perp__fail(world->context, status,
                            "the world's method is pgs, which can't solve contacts with friction "
                            "(rows without a diagonal): take auto, lemke or fischer");
    if (status == PERP_ERROR_NOT_FINITE)
        status = perp__fail(world->context, status,
                            "the step takes the contacts beyond the range of numbers");
    return status;
}
