/* Steps chosen by their estimated error: every step is taken whole and in two halves. The halves
 * count, and what the two differ in, in places and in h v, is the estimate. Where motion is smooth
 * or a contact lasts it falls with the third power of the step. Where a body lands, stops or lets
 * go within the step it falls with the first: there steps get short until nothing moves by more
 * than `error` in one, which locates the event. Nothing is remembered from call to call. */
#include "world/step.h"

#include "base/context.h"
#include "step/length.h"

#define SHORTEST 0x1p-30 /* of dt */

typedef struct attempt {
    double error;
    int32_t advances; /* the step as a whole and its halves do */
    perp_step_result result;
} attempt;

static perp_status fit(perp_world *world, perp__saved_state *saved, size_t size)
{
    void *bytes;

    if (size <= saved->room)
        return PERP_OK;
    bytes = perp__allocate(world->context, 2, size);
    if (!bytes)
        return perp__fail_memory(world->context, "the state before a step");
    perp__release(world->context, saved->bytes);
    saved->bytes = bytes;
    saved->room = 2 * size;
    return PERP_OK;
}

static perp_status keep(perp_world *world, perp__saved_state *saved)
{
    perp_status status = fit(world, saved, perp__snapshot_bytes(world));

    if (status == PERP_OK)
        perp__snapshot_write(world, saved->bytes);
    return status;
}

/* The worst of those so far, and what the last one had. */
static void follow_result(perp_step_result *sum, const perp_step_result *one)
{
    sum->outcome = perp__worse_outcome(sum->outcome, one->outcome);
    sum->residual = fmax(sum->residual, one->residual);
    sum->contacts = one->contacts;
    sum->islands = one->islands;
}

/* One step more. */
static perp_status take(perp_world *world, attempt *trial, double h)
{
    perp_step_result one = {0};
    perp_status status = perp__step(world, &one, h);

    if (status != PERP_OK)
        return status;
    trial->advances &= one.advanced;
    follow_result(&trial->result, &one);
    return PERP_OK;
}

static void begin(attempt *trial)
{
    memset(trial, 0, sizeof *trial);
    trial->advances = 1;
}

/* The step as a whole, then its halves, where the world is then. */
static perp_status try_halves(perp_world *world, attempt *trial, double h)
{
    const size_t size = (size_t)world->bodies.slots * sizeof *world->bodies.states;
    const perp__state *whole;
    perp_status status = keep(world, &world->tried);

    PERP__THEN(status, fit(world, &world->whole, size));
    begin(trial);
    PERP__THEN(status, take(world, trial, h));
    trial->error = INFINITY;
    if (status != PERP_OK || !trial->advances)
        return status;
    memcpy(world->whole.bytes, world->bodies.states, size);
    whole = (const perp__state *)world->whole.bytes;
    status = perp__snapshot_read(world, world->tried.bytes);
    begin(trial);
    for (int32_t half = 0; half < 2 && status == PERP_OK && trial->advances; half++)
        status = take(world, trial, 0.5 * h);
    trial->error = trial->advances ? 0.0 : INFINITY;
    /* how far apart points of a body are in both, at most, in place and in h v */
    for (int32_t i = 0; i < world->bodies.slots && trial->advances; i++) {
        const perp__state *a = &whole[i], *b = &world->bodies.states[i];
        const double reach = world->bodies.all[i].radius;
        double apart[3], speed[3], spin[3], turn[4];

        if (!world->bodies.all[i].alive || !perp__is_dynamic(world, i))
            continue;
        perp__subtract3(apart, a->position, b->position);
        perp__subtract3(speed, a->velocity, b->velocity);
        perp__subtract3(spin, a->angular_velocity, b->angular_velocity);
        for (int32_t k = 0; k < 4; k++)
            turn[k] = 2.0 * (a->orientation[k] - b->orientation[k]);
        trial->error =
            fmax(trial->error, perp__length3(apart) + reach * perp__quaternion_norm(turn) +
                                   h * (perp__length3(speed) + reach * perp__length3(spin)));
    }
    return status;
}

/* What is left when the budget is spent, at once. */
static perp_status take_rest(perp_world *world, attempt *trial, double h)
{
    begin(trial);
    trial->error = NAN;
    return take(world, trial, h);
}

static void add(perp_step_result *result, const attempt *trial)
{
    follow_result(result, &trial->result);
    result->advanced = trial->advances;
    result->error += trial->error;
    result->steps += isnan(trial->error) ? 1 : 2;
}

/* How long the next step may be, where one of length h has this error. */
static double next_length(const perp_world *world, double h, double error)
{
    const double factor = PERP__STEP_SAFETY * cbrt(world->settings.error / error);

    return h * fmin(fmax(factor, PERP__STEP_SHRINKING), PERP__STEP_GROWTH);
}

static perp_status follow(perp_world *world, perp_step_result *result, double dt)
{
    const double shortest = SHORTEST * dt;
    double left = dt, h = dt;
    perp_status status = PERP_OK;
    attempt trial;

    while (status == PERP_OK && left > 0.0 && result->advanced) {
        const bool spent = perp__is_budget_spent(world);

        if (spent || h >= left)
            h = left;
        else if (2.0 * h > left)
            h = 0.5 * left; /* no short one at the end */
        status = spent ? take_rest(world, &trial, h) : try_halves(world, &trial, h);
        if (status == PERP_OK && trial.error > world->settings.error && h > shortest &&
            !perp__is_budget_spent(world)) {
            status = perp__snapshot_read(world, world->tried.bytes);
            h = fmax(fmin(next_length(world, h, trial.error), 0.5 * h), shortest);
        } else if (status == PERP_OK) {
            add(result, &trial);
            left -= h;
            h = next_length(world, h, trial.error);
        }
    }
    return status;
}

/* In equal parts, twice as many from where joints turn too far in one: that one changed nothing. */
static perp_status follow_parts(perp_world *world, perp_step_result *result, double dt)
{
    int32_t done = 0, parts = 2;
    perp_status status = PERP_OK;
    attempt trial;

    while (status == PERP_OK && done < parts && result->advanced) {
        const int32_t spent = perp__is_budget_spent(world), more = spent ? parts - done : 1;

        world->step.divides = spent ? 0 : parts;
        status = take_rest(world, &trial, dt * more / parts);
        if (status == PERP_OK && world->step.rough) {
            parts *= 2;
            done *= 2;
        } else if (status == PERP_OK) {
            add(result, &trial);
            done += more;
        }
    }
    return status;
}

perp_status perp__advance_world(perp_world *world, perp_step_result *result, double dt)
{
    const perp_world_stats stats = world->results.stats;
    perp_status status = PERP_OK, restored = PERP_OK;

    /* 1. In one, where that will do. */
    perp__open_budget(world);
    world->step.divides = world->settings.error == 0.0;
    if (world->step.divides)
        status = perp__step(world, result, dt);
    if (status != PERP_OK || (world->step.divides && !world->step.rough)) {
        result->steps = 1;
        result->error = NAN;
        return status;
    }
    /* 2. Else in several: all of them, or none. */
    status = keep(world, &world->begun);
    result->advanced = 1;
    if (status != PERP_OK)
        return status;
    status =
        world->settings.error > 0.0 ? follow(world, result, dt) : follow_parts(world, result, dt);
    result->iterations = world->step.budget.spent;
    if (status != PERP_OK || !result->advanced) {
        restored = perp__snapshot_read(world, world->begun.bytes);
        world->results.stats = stats;
    }
    world->results.stats.iterations = result->iterations;
    world->results.stats.steps = stats.steps + (result->advanced && status == PERP_OK);
    return status == PERP_OK ? restored : status;
}
