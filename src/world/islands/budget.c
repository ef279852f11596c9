/* What a step may spend: the numbers of each level of accuracy; time_limit and max_iterations hold
 * for all problems of a step together. Without a time limit nothing here reads the clock. */
#include "world/step.h"

#include "base/clock.h"

/* The part of a step's time that its velocities may take; the rest moves and projects. */
#define VELOCITIES 0.7

/* Residuals are from the measured curve, bench/results/world.txt; docs/world.md has the table. */
const perp__level perp__levels[] = {
    {.looks = 2, .deep = 1e-2, .tol = 1e-2, .sweeps_few = 1, .few = 8, .rounds = 2},
    {.looks = 3, .deep = 5e-3, .tol = 1e-3, .few = 40, .rounds = 2},
    {.looks = 4, .deep = 1e-3, .tol = 1e-6, .few = 64, .rounds = 5},
    {.looks = 24, .deep = 0.0, .tol = 0.0, .few = 64, .rounds = 24},
};

const perp__level *perp__level_of(const perp_world *world)
{
    return &perp__levels[perp__is_sketch(world) ? PERP_ACCURACY_ACCURATE
                                                : world->settings.accuracy];
}

void perp__open_budget(perp_world *world)
{
    const perp_world_settings *settings = &world->settings;
    perp__budget *budget = &world->step.budget;

    budget->limited = settings->time_limit > 0.0;
    budget->iterations = settings->max_iterations > 0 ? settings->max_iterations : INT64_MAX;
    budget->spent = 0;
    budget->deadline = budget->until = 0.0;
    if (budget->limited)
        budget->deadline = perp__now() + settings->time_limit;
}

void perp__open_velocities(perp_world *world)
{
    perp__budget *budget = &world->step.budget;

    if (budget->limited)
        budget->until = budget->deadline - (1.0 - VELOCITIES) * (budget->deadline - perp__now());
}

bool perp__is_time_over(const perp_world *world)
{
    return world->step.budget.limited && perp__now() >= world->step.budget.deadline;
}

bool perp__is_budget_spent(const perp_world *world)
{
    return world->step.budget.iterations == 0 || perp__is_time_over(world);
}

double perp__island_deadline(const perp_world *world, const perp__island *island)
{
    const perp__budget *budget = &world->step.budget;
    const int32_t left =
        world->islands.count > 0 ? world->step.budget.contacts : island->contacts + island->joints;
    double now;

    if (!budget->limited)
        return 0.0;
    now = perp__now();
    return now + fmax(budget->until - now, 0.0) * (island->contacts + island->joints) /
                     (left > 0 ? left : 1);
}

void perp__spend(perp_world *world, int64_t iterations)
{
    perp__budget *budget = &world->step.budget;

    budget->spent += iterations;
    if (budget->iterations < INT64_MAX)
        budget->iterations -= iterations < budget->iterations ? iterations : budget->iterations;
}

int32_t perp__iterations_left(const perp_world *world)
{
    const int64_t left = world->step.budget.iterations;

    return left == INT64_MAX ? 0 : left < 1 ? 1 : left > INT32_MAX ? INT32_MAX : (int32_t)left;
}
