/* Islands, pairs and bodies side by side. An island has all it writes to for itself but for the
 * workspace and the budget, which are its lane's; what it leaves does not depend on what was there
 * before. So the bits are those of one thread, whichever lane an island goes to. One that dwarfs
 * the others is the caller's thread's, whose sweeps all take part in (contact/coloured). */
#include "world/islands/lanes.h"

/* Contacts and bodies below which islands, and pairs or bodies below which ranges of them, are not
 * worth waking a thread for. */
#define FEW 128

/* Points of eight contacts from which on all threads may sweep one island: of our own; and a
 * caller's, whose `run` is called for each colour in each pass, for some twenty microseconds of
 * work. And the share of an island's cost that they share: worth it where others cost less. */
#define WORTH_PIECES 768
#define WORTH_CALLS 2048
#define SHARED 0.25

typedef struct job {
    perp_world *world;
    double h;
    perp__range work;
} job;

/* ---- life ---- */

perp_status perp__create_lanes(perp_world *world)
{
    const perp_world_settings *settings = &world->settings;
    const int32_t count = settings->threads;
    perp_status status;

    if (count <= 1)
        return PERP_OK;
    status = perp__tasks_create(world->context, &world->tasks, count, settings->run_tasks,
                                settings->tasks_user);
    if (status != PERP_OK)
        return status;
    world->solve.coloured.tasks = world->tasks;
    world->solve.coloured.shared_from = settings->run_tasks ? WORTH_CALLS : WORTH_PIECES;
    world->lanes =
        perp__allocate_zeros(world->context, (size_t)count, sizeof *world->lanes, "the threads");
    if (!world->lanes)
        return PERP_ERROR_MEMORY;
    for (; world->lane_count < count && status == PERP_OK; world->lane_count++) {
        perp__lane *lane = &world->lanes[world->lane_count];

        perp__tasks_context(world->tasks, &lane->context);
        lane->share.context = lane->world.context = &lane->context;
        perp__coloured_init(&lane->world.solve.coloured, &lane->context);
        lane->world.solve.standing = &lane->standing;
        status = perp__contact_create(&lane->context, &lane->world.solve.solver, NULL);
    }
    return status == PERP_OK ? status : perp__fail_memory(world->context, "the threads");
}

void perp__release_lanes(perp_world *world)
{
    for (int32_t k = 0; k < world->lane_count; k++) {
        perp__lane *lane = &world->lanes[k];

        perp__handle_end(lane->world.solve.solver);
        perp__standing_release(&lane->standing);
        perp__coloured_release(&lane->world.solve.coloured);
        perp__arena_release(&lane->world.solve.arena);
        perp__release_batch(&lane->world);
        perp__release(&lane->context, lane->share.points);
    }
    perp__release(world->context, world->lanes);
    perp__tasks_destroy(world->tasks);
}

/* ---- islands ---- */

bool perp__shares_islands(const perp_world *world)
{
    const perp__island *last = world->islands.all + world->islands.count - 1;

    return world->islands.count > 1 && last->first_body + last->first_contact >= FEW &&
           !world->step.budget.limited && world->step.budget.iterations == INT64_MAX;
}

/* Whether it is not a lane's: all threads take part, one island after the others, as it dwarfs
 * them; or something moves it as it is told. What does is numbered within the island at hand, and
 * may be next to others. */
static bool stays(const perp_world *world, const perp__island *island)
{
    const perp__island *last_one = world->islands.all + world->islands.count - 1;
    const double self = (double)island->bodies + island->contacts;
    const double others = (double)last_one->first_body + last_one->bodies +
                          last_one->first_contact + last_one->contacts - self;

    if (island->contacts >= PERP__GROUP * world->solve.coloured.shared_from &&
        others < SHARED * (world->lane_count - 1) * self)
        return 1;
    for (int32_t k = 0; k < perp__count_ties(island); k++)
        if (world->bodies.all[perp__tie(world, island, k)].kind == PERP_BODY_KINEMATIC)
            return 1;
    return 0;
}

static void solve_lane(int32_t k, void *data)
{
    const job *at = data;
    perp__lane *lane = &at->world->lanes[k];
    const perp_world self = lane->world;

    /* the world as it is, with the lane's own things */
    lane->world = *at->world;
    lane->world.context = &lane->context;
    lane->world.solve = self.solve;
    lane->last = -1;
    lane->status = perp__fit_island_work(&lane->world);
    if (lane->world.solve.batch)
        PERP__THEN(lane->status, perp__fit_batch(&lane->world));
    if (lane->status != PERP_OK)
        lane->last = 0;
    for (int32_t i = k; i < at->world->islands.count && lane->last < 0; i += at->world->lane_count)
        if (!stays(at->world, &at->world->islands.all[i]))
            lane->status = perp__solve_one(&lane->world, i, at->h, &lane->last);
    lane->status = perp__end_solving(&lane->world, at->h, lane->status, &lane->last);
}

perp_status perp__solve_in_lanes(perp_world *world, double h, int32_t *last)
{
    job at = {world, h, NULL};
    const int64_t before = world->step.budget.spent;
    perp_status status = PERP_OK;

    *last = -1;
    perp__tasks_run(world->tasks, solve_lane, &at);
    for (int32_t k = 0; k < world->lane_count; k++) {
        const perp__lane *lane = &world->lanes[k];

        if (lane->last < 0 || (*last >= 0 && lane->last > *last))
            continue;
        *last = lane->last;
        status = lane->status == PERP_OK
                     ? PERP_OK
                     : perp__fail(world->context, lane->status, "%s", lane->context.message);
    }
    /* those that lanes left, on the caller's thread */
    for (int32_t i = 0; i < (*last < 0 ? world->islands.count : *last); i++) {
        int32_t ended = -1;
        const perp_status self =
            stays(world, &world->islands.all[i]) ? perp__solve_one(world, i, h, &ended) : PERP_OK;

        if (ended < 0)
            continue;
        status = self;
        *last = ended;
    }
    status = perp__end_solving(world, h, status, last);
    world->step.budget.spent = before;
    for (int32_t i = 0; i <= (*last < 0 ? world->islands.count - 1 : *last); i++)
        perp__spend(world, world->islands.all[i].spent);
    return status;
}

/* ---- ranges ---- */

static void work_on_share(int32_t k, void *data)
{
    const job *at = data;

    at->work(at->world, &at->world->lanes[k].share, at->h);
}

int32_t perp__share_out(perp_world *world, int32_t count, perp__range work, double h,
                        perp__share *all)
{
    job at = {world, h, work};

    if (world->lane_count == 0 || count < FEW) {
        if (all) {
            all->end = count;
            work(world, all, h);
        }
        return 0;
    }
    for (int32_t k = 0; k < world->lane_count; k++) {
        perp__share *share = &world->lanes[k].share;

        share->first = (int32_t)((int64_t)count * k / world->lane_count);
        share->end = (int32_t)((int64_t)count * (k + 1) / world->lane_count);
        share->status = PERP_OK;
    }
    perp__tasks_run(world->tasks, work_on_share, &at);
    return world->lane_count;
}
