/* One step, phase by phase; see world.h. Nothing that a caller can see changes before commit(). */
#include "world/joints/joints.h"

#include "base/clock.h"
#include "base/context.h"

/* Where no more bodies than these are awake, one step of as many is timed for all of them: looking
 * at the clock is a tenth of what a step of one box takes. */
#define FEW_AWAKE 16

/* Parts of a step in which joints turn far, at most; and of one that has no answer, which shorter
 * ones mostly lack as well. */
#define MOST_PARTS 64
#define FEW_PARTS 8

static void lay_out(perp__arena *arena, void *object)
{
    perp_world *world = object;
    const size_t count = (size_t)world->bodies.capacity, shapes = (size_t)world->shapes.capacity;

    world->step.motions = perp__arena_take(arena, count, sizeof *world->step.motions);
    world->step.roles = perp__arena_take(arena, count, sizeof *world->step.roles);
    world->step.next = perp__arena_take(arena, count, sizeof *world->step.next);
    PERP__INTEGERS(arena, count, &world->step.moving, &world->islands.parent, &world->step.moved,
                   &world->islands.body_order);
    world->islands.all = perp__arena_take(arena, count, sizeof *world->islands.all);
    world->step.placed = perp__arena_take(arena, shapes, sizeof *world->step.placed);
    PERP__INTEGERS(arena, shapes, &world->sleep.awake_shapes);
}

/* Memory for all, and bodies in place, with the velocities that forces alone would give them. */
static perp_status prepare(perp_world *world, double h)
{
    perp_status status;

    /* what lay in the memory before is lost if it grows */
    if (world->step.fitted_bodies != world->bodies.capacity ||
        world->step.fitted_shapes != world->shapes.capacity) {
        perp__rouse_all(world);
        world->step.fitted_bodies = 0;
        status = perp__arena_fit(&world->step.arena, world->context, lay_out, world);
        if (status != PERP_OK)
            return status;
        memset(world->step.motions, 0,
               (size_t)world->bodies.capacity * sizeof *world->step.motions);
        memset(world->step.roles, 0, (size_t)world->bodies.capacity * sizeof *world->step.roles);
        memset(world->step.moved, 0, (size_t)world->bodies.capacity * sizeof *world->step.moved);
        world->step.coasting = 1;
        world->step.fitted_bodies = world->bodies.capacity;
        world->step.fitted_shapes = world->shapes.capacity;
    }
    status = world->bodies.weighed ? PERP_OK : perp__check_centres(world);
    if (status != PERP_OK)
        return status;
    if (h != world->step.length)
        perp__rouse_all(world);
    world->step.length = h;
    if (world->sleep.awake_changed)
        perp__list_awake(world);
    return PERP_OK;
}

/* Looks at the clock, unless the step is not timed: then it shows 0. */
static void add_time(const perp_world *world, double *clock, double *seconds)
{
    const double now = *clock > 0.0 ? perp__now() : 0.0;

    *seconds += world->step.untimed * (now - *clock);
    *clock = now;
}

bool perp__takes_parts(const perp_world *world, const perp__solve_summary *summary)
{
    return summary->rough && world->step.divides > 0 &&
           world->step.divides < (perp__is_good(summary->outcome) ? MOST_PARTS : FEW_PARTS);
}

/* Contacts and the velocities that meet them. */
static perp_status solve_velocities(perp_world *world, double h, perp__solve_summary *summary,
                                    perp_world_stats *stats, double *clock)
{
    perp_status status = perp__find_contacts(world, h);

    add_time(world, clock, &stats->seconds_collide);
    if (status == PERP_OK && !world->sleep.awake_changed)
        status = perp__solve_islands(world, h, summary);
    add_time(world, clock, &stats->seconds_solve);
    world->step.budget.until = world->step.budget.deadline;
    return status;
}

/* Arms and turns near the largest numbers can leave their range. */
static perp_status check_contacts(const perp_world *world)
{
    int32_t number = world->sleep.asleep.contacts;

    for (int32_t i = 0; i < world->contacts.now.count; i++) {
        if (!world->contacts.now.flags[i].included)
            continue;
        if (!perp__is_finite_contact(&world->contacts.now, i))
            return perp__fail(world->context, PERP_ERROR_NOT_FINITE,
                              "the step takes contact %d beyond the range of numbers", (int)number);
        number++;
    }
    return PERP_OK;
}

/* Returns how many bodies end the step as they began it. */
static int32_t commit(perp_world *world, int32_t included)
{
    const perp__contact_set last = world->contacts.last;
    int32_t i, repeat = 0;

    world->sleep.settled = 0;
    for (i = 0; i < world->step.moving_count; i++) {
        const int32_t body = world->step.moving[i];

        perp__role *role = &world->step.roles[body];

        role->repeats =
            (int8_t)(world->bodies.all[body].kind == PERP_BODY_STATIC || perp__stays(world, body));
        if (!role->repeats)
            world->bodies.states[body] = world->step.next[body];
        repeat += role->repeats;
        world->sleep.settled += role->repeats && role->dynamic;
    }
    i = world->sleep.some_put ? world->sleep.awake_count : 0;
    for (world->sleep.some_put = 0; i-- > 0;) {
        world->bodies.states[world->sleep.awake[i]].put =
            world->step.roles[world->sleep.awake[i]].put;
        world->sleep.some_put |= world->step.roles[world->sleep.awake[i]].put != 0;
    }
    world->step.coasting++; /* they stay where they are */
    if (world->sleep.orphan_count > 0)
        perp__drop_sleeping(world, &world->sleep.first_orphan);
    world->sleep.orphan_count = 0;
    perp__remember(world);
    if (world->joints.count > 0)
        perp__keep_joints(world);
    world->contacts.last = world->contacts.now;
    world->contacts.last_included = included;
    world->contacts.now = last;
    world->results.recorded = 0;
    world->results.stats.steps++;
    return repeat;
}

/* What a result says of the last step. */
static void report(perp_world *world, const perp__solve_summary *summary, perp_world_stats *stats,
                   perp_step_result *result)
{
    if (world->sleep.residual_changed)
        perp__find_asleep_residual(world);
    result->outcome = world->sleep.asleep.rounded > 0
                          ? perp__worse_outcome(summary->outcome, PERP_OUTCOME_ROUNDING_LIMIT)
                          : summary->outcome;
    stats->residual = fmax(summary->residual, world->sleep.asleep.residual);
    result->residual = stats->residual;
    result->contacts = stats->contacts;
    result->islands = world->sleep.asleep.solved + summary->solved;
    result->advanced = result->outcome != PERP_OUTCOME_RAY &&
                       (!world->settings.strict || perp__is_good(result->outcome));
    stats->impacts = summary->impacts;
}

perp_status perp__find_step_contacts(perp_world *world, double h, perp__solve_summary *summary)
{
    perp_world_stats stats = world->results.stats;
    double clock = 0.0;
    perp_status status;

    memset(summary, 0, sizeof *summary);
    world->step.rough = 0;
    perp__open_velocities(world);
    status = prepare(world, h);
    PERP__THEN(status, solve_velocities(world, h, summary, &stats, &clock));
    perp__stop_all_coasting(world);
    return status;
}

/* The step, unless it rouses something: then it is to be done again. */
static perp_status try_step(perp_world *world, perp_step_result *result, perp_world_stats *stats,
                            double h, double *clock)
{
    perp__solve_summary summary = {0};
    int32_t changed = 0, infinite;
    perp_status status = prepare(world, h);

    /* 1. Velocities. */
    PERP__THEN(status, solve_velocities(world, h, &summary, stats, clock));
    if (status != PERP_OK || world->sleep.awake_changed)
        return status;
    world->step.rough = perp__takes_parts(world, &summary);
    result->advanced = 0;
    if (!world->step.rough && (summary.endless || summary.outcome == PERP_OUTCOME_RAY))
        status = check_contacts(world);
    if (status != PERP_OK || world->step.rough)
        return status;
    /* 2. Islands and rows, those asleep too: before the projection, which uses the same memory. */
    stats->islands = world->sleep.asleep.islands + world->islands.count;
    stats->contacts = world->sleep.asleep.contacts + world->contacts.now.included;
    stats->rows_friction = world->sleep.asleep.tangents +
                           (world->settings.planar ? 1 : 2) * world->contacts.now.rubbing;
    for (int32_t i = 0; i < world->islands.count; i++)
        perp__island_motion(world, &world->islands.all[i], 0)->verdict.is_first = 1;
    stats->rows_normal = stats->contacts;
    stats->joints = world->joints.count;
    stats->rows_joint = world->joints.count > 0 ? perp__count_joint_rows(world) : 0;
    report(world, &summary, stats, result);
    if (!result->advanced)
        return PERP_OK;
    /* 3. Next positions, without overlap. */
    infinite = perp__integrate(world, h);
    add_time(world, clock, &stats->seconds_integrate);
    if (infinite < 0)
        status = perp__project_overlaps(world, &changed);
    if (status == PERP_OK && changed)
        infinite = perp__find_infinite(world);
    if (infinite >= 0)
        status = perp__fail_range(world, infinite);
    if (status == PERP_OK && world->joints.count > 0)
        status = perp__check_joints(world);
    add_time(world, clock, &stats->seconds_project);
    /* 4. What is left of the laws where impulses were taken back. */
    perp__raise_to(&summary.residual, world->step.scaled);
    if (world->step.scaled > perp__swept_tol(world))
        summary.outcome = perp__worse_outcome(summary.outcome, PERP_OUTCOME_ITERATION_LIMIT);
    if (status == PERP_OK && world->step.scaled > 0.0)
        report(world, &summary, stats, result);
    return status;
}

perp_status perp__step(perp_world *world, perp_step_result *result, double h)
{
    perp_world_stats stats = world->results.stats;
    double clock;
    perp_status status;

    world->step.rough = 0;
    /* 1. While all sleeps, all that a step would do is to say so. */
    if (world->sleep.awake_count == 0 && !world->sleep.awake_changed && h == world->step.length &&
        world->bodies.weighed && !world->pairs.planes_changed) {
        const perp__solve_summary summary = {0};

        world->results.stats.islands = world->sleep.asleep.islands;
        world->results.stats.contacts = world->results.stats.rows_normal =
            world->sleep.asleep.contacts;
        world->results.stats.rows_friction = world->sleep.asleep.tangents;
        world->results.stats.iterations = 0;
        world->results.stats.steps++;
        report(world, &summary, &world->results.stats, result);
        return PERP_OK;
    }
    /* 2. The step of what is awake, again where it roused something. */
    world->step.untimed++;
    clock =
        world->sleep.awake_count > FEW_AWAKE || stats.steps % FEW_AWAKE == 0 ? perp__now() : 0.0;
    perp__open_velocities(world);
    do {
        status = try_step(world, result, &stats, h, &clock);
        if (status != PERP_OK || world->sleep.awake_changed || !result->advanced)
            perp__stop_all_coasting(world);
    } while (status == PERP_OK && world->sleep.awake_changed);
    world->step.untimed = clock > 0.0 ? 0 : world->step.untimed;
    if (status != PERP_OK || world->step.rough)
        return status;
    /* 3. It counts. */
    result->iterations = stats.iterations = world->step.budget.spent;
    world->results.stats = stats;
    if (result->advanced && commit(world, stats.contacts - world->sleep.asleep.contacts) > 0)
        perp__fall_asleep(world);
    return PERP_OK;
}
