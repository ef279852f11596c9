/* One step, phase by phase; see world.h. Nothing that a caller can see changes before commit(). */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"

static void lay_out_bodies(perp__arena *arena, void *object)
{
    perp_world *world = object;
    size_t count = (size_t)world->body_capacity;

    world->next = perp__arena_take(arena, count, sizeof *world->next);
    world->motions = perp__arena_take(arena, count, sizeof *world->motions);
    world->parent = perp__arena_take(arena, count, sizeof *world->parent);
    world->body_order = perp__arena_take(arena, count, sizeof *world->body_order);
    world->islands = perp__arena_take(arena, count, sizeof *world->islands);
}

static void lay_out_shapes(perp__arena *arena, void *object)
{
    perp_world *world = object;
    size_t count = (size_t)world->shape_capacity;

    world->placed = perp__arena_take(arena, count, sizeof *world->placed);
    world->shape_counts = perp__arena_take(arena, count, sizeof *world->shape_counts);
}

static perp_status fail_range(const perp_world *world, int32_t body)
{
    return perp__fail(world->context, PERP_ERROR_NOT_FINITE,
                      "the step takes body %d beyond the range of numbers", (int)body);
}

/* Forces and times near the largest numbers can leave the range of doubles. */
static perp_status check_next(const perp_world *world)
{
    int32_t i;

    for (i = 0; i < world->body_slots; i++) {
        const perp__state *state = &world->next[i];

        if (world->bodies[i].alive &&
            (!perp__all_finite(state->position, 3) || !perp__all_finite(state->orientation, 4) ||
             !perp__all_finite(&state->angle, 1) || !perp__all_finite(state->velocity, 3) ||
             !perp__all_finite(state->angular_velocity, 3)))
            return fail_range(world, i);
    }
    return PERP_OK;
}

/* Bodies in place, with the velocities that forces alone would give them. */
static perp_status prepare(perp_world *world, double h)
{
    perp_status status = perp__arena_fit(&world->body_arena, lay_out_bodies, world);
    int32_t i;

    if (status == PERP_OK)
        status = perp__arena_fit(&world->shape_arena, lay_out_shapes, world);
    if (status == PERP_OK)
        status = perp__check_centres(world);
    if (status != PERP_OK)
        return status;
    perp__place(world, world->states);
    perp__free_velocities(world, h);
    for (i = 0; i < world->body_slots; i++)
        if (world->bodies[i].alive && !perp__all_finite(world->motions[i].free, 6))
            return fail_range(world, i);
    return PERP_OK;
}

static void lap(double *clock, double *seconds)
{
    double now = perp__now();

    *seconds += now - *clock;
    *clock = now;
}

/* Contacts and the velocities that meet them. */
static perp_status meet(perp_world *world, double h, perp__solve_summary *summary,
                        perp_world_stats *stats, double *clock)
{
    perp_status status = perp__find_contacts(world, h);

    lap(clock, &stats->seconds_collide);
    if (status == PERP_OK)
        status = perp__solve_islands(world, h, summary);
    lap(clock, &stats->seconds_solve);
    world->budget.until = world->budget.deadline;
    return status;
}

static void count_rows(perp_world *world, perp_world_stats *stats)
{
    int32_t i;

    stats->islands = world->island_count;
    stats->rows_normal = stats->rows_friction = 0;
    for (i = 0; i < world->contacts.count; i++) {
        const perp__world_contact *contact = &world->contacts.contacts[i];

        if (!contact->included)
            continue;
        stats->rows_normal++;
        stats->rows_friction += contact->friction > 0.0 ? (world->settings.planar ? 1 : 2) : 0;
    }
    stats->contacts = stats->rows_normal;
}

static int32_t may_advance(const perp_world *world, perp_outcome outcome)
{
    if (outcome == PERP_OUTCOME_RAY)
        return 0;
    return !world->settings.strict || perp__is_good(outcome);
}

static void commit(perp_world *world)
{
    perp_world_contact *records = world->records;

    memcpy(world->states, world->next, (size_t)world->body_slots * sizeof *world->states);
    world->records = world->next_records;
    world->next_records = records;
    world->record_count = world->next_record_count;
    perp__remember(world);
    perp__keep_joints(world);
    world->stats.steps++;
}

/* Next positions, without overlap. Statistics and records are taken before the projection, which
 * uses the same memory. */
static perp_status advance(perp_world *world, double h, perp_world_stats *stats, double *clock)
{
    perp_status status = perp__write_records(world);

    perp__integrate(world, h);
    if (status == PERP_OK)
        status = check_next(world);
    lap(clock, &stats->seconds_integrate);
    if (status == PERP_OK)
        status = perp__project_overlaps(world);
    if (status == PERP_OK)
        status = check_next(world);
    lap(clock, &stats->seconds_project);
    return status;
}

perp_status perp__step(perp_world *world, perp_step_result *result, double h)
{
    perp_world_stats stats = world->stats;
    perp__solve_summary summary;
    double clock = perp__now();
    perp_status status;

    world->budget.spent = 0;
    perp__open_budget(world);
    status = prepare(world, h);
    if (status == PERP_OK)
        status = meet(world, h, &summary, &stats, &clock);
    if (status != PERP_OK)
        return status;
    count_rows(world, &stats);
    result->outcome = summary.outcome;
    result->residual = stats.residual = summary.residual;
    result->contacts = stats.contacts;
    result->islands = summary.solved;
    result->advanced = may_advance(world, summary.outcome);
    stats.impacts = summary.impacts;
    if (result->advanced)
        status = advance(world, h, &stats, &clock);
    if (status != PERP_OK)
        return status;
    result->iterations = stats.iterations = world->budget.spent;
    world->stats = stats;
    if (result->advanced)
        commit(world);
    return PERP_OK;
}
