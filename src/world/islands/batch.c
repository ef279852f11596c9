/* Islands that wait, each in its workspace, to be swept side by side (contact/coloured). */
#include "world/islands/lanes.h"

#include "base/context.h"
#include "world/islands/islands.h"

/* ---- life ---- */

/* The workspace of one that waits becomes the world's, and the other way round. */
static void exchange(perp_world *world, perp__waiting *waiting)
{
    const perp__island_work work = world->solve.work;
    const perp__arena arena = world->solve.arena;

    world->solve.work = waiting->work;
    world->solve.arena = waiting->arena;
    waiting->work = work;
    waiting->arena = arena;
}

bool perp__joins_batch(const perp_world *world, const perp__island *island)
{
    return island->joints == 0 && island->contacts <= PERP__BATCH_CONTACTS &&
           !world->step.budget.limited && world->step.budget.iterations == INT64_MAX;
}

/* The workspaces of all islands that may wait have the same room, whichever of them comes first. */
perp_status perp__fit_batch(perp_world *world)
{
    int32_t islands = 0, contacts = 0, bodies = 0;
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < world->islands.count; i++) {
        const perp__island *island = &world->islands.all[i];

        if (!perp__joins_batch(world, island))
            continue;
        islands++;
        perp__raise_room(&contacts, island->contacts);
        perp__raise_room(&bodies, island->bodies + island->contacts);
    }
    for (int32_t k = 0; k < islands && k < PERP__BATCH_ISLANDS && status == PERP_OK; k++) {
        exchange(world, &world->solve.batch->waiting[k]);
        status = perp__fit_work(world, contacts, bodies, 0);
        exchange(world, &world->solve.batch->waiting[k]);
    }
    return status;
}

void perp__release_batch(perp_world *world)
{
    for (int32_t k = 0; k < PERP__BATCH_ISLANDS && world->solve.batch; k++)
        perp__arena_release(&world->solve.batch->waiting[k].arena);
    perp__release(world->context, world->solve.batch);
}

/* ---- the sweeps ---- */

perp_status perp__wait_for_sweep(perp_world *world, int32_t number, double h,
                                 const perp__verdict *before, perp__verdict *verdict)
{
    const perp__island *island = &world->islands.all[number];
    perp__waiting *waiting;
    perp_status status = PERP_OK;

    if (!world->solve.batch) {
        world->solve.batch =
            perp__allocate_zeros(world->context, 1, sizeof *world->solve.batch, "the islands");
        status = world->solve.batch ? perp__fit_batch(world) : PERP_ERROR_MEMORY;
    }
    if (status != PERP_OK)
        return status;
    waiting = &world->solve.batch->waiting[world->solve.batch->count];
    waiting->island = number;
    waiting->before = *before;
    exchange(world, waiting);
    status = perp__begin_sweep(world, island, h, verdict, &waiting->sweeping);
    if (status == PERP_OK && verdict->stands)
        status = perp__end_sweep(world, island, h, verdict, &waiting->sweeping);
    else if (status == PERP_OK)
        perp__pose_sweep(world, island, h, &waiting->sweeping);
    exchange(world, waiting);
    waiting->verdict = *verdict;
    world->solve.batch->count += status == PERP_OK && !verdict->stands;
    return status;
}

perp_status perp__sweep_batch(perp_world *world, double h, int32_t *last)
{
    perp__coloured_part parts[PERP__BATCH_ISLANDS];
    const int32_t count = world->solve.batch->count;
    perp_status status = PERP_OK;

    for (int32_t k = 0; k < count; k++) {
        perp__waiting *waiting = &world->solve.batch->waiting[k];

        parts[k].answer = &waiting->sweeping.answer;
        parts[k].moving = waiting->work.solved;
        parts[k].problem = &waiting->sweeping.problem;
        parts[k].step = &waiting->sweeping.step;
    }
    if (count > 0) {
        world->solve.batch->count = 0;
        status = perp__coloured_parts(&world->solve.coloured, parts, count);
        if (status != PERP_OK)
            *last = world->solve.batch->waiting[0].island;
    }
    for (int32_t k = 0; k < count && status == PERP_OK && *last < 0; k++) {
        perp__waiting *waiting = &world->solve.batch->waiting[k];
        const perp__island *island = &world->islands.all[waiting->island];
        const int64_t spent = world->step.budget.spent;

        exchange(world, waiting);
        perp__take_sweep(world, island, &waiting->sweeping);
        status = perp__end_sweep(world, island, h, &waiting->verdict, &waiting->sweeping);
        exchange(world, waiting);
        PERP__THEN(status, perp__keep_sweep(world, island, h, &waiting->before, &waiting->verdict));
        perp__conclude_one(world, waiting->island, h, &waiting->verdict, status, last);
        world->islands.all[waiting->island].spent += world->step.budget.spent - spent;
    }
    return status;
}
