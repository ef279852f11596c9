/* What a step may spend: time_limit and max_iterations hold for all problems of a step together.
 * Without a time limit nothing here reads the clock. */
#include "world/world.h"

#include <math.h>

#include "base/clock.h"

/* The part of a step's time that its velocities may take; the rest moves and projects. */
#define VELOCITIES 0.7

/* Passes over a dense matrix before a method first looks at the clock, by row and column: to
 * assemble, equilibrate and evaluate. Only ever compared with a time limit. */
#define SECONDS_PER_ENTRY 1.2e-8

/* Orthogonal bases of the rows that hold, by row and two columns. */
#define SECONDS_TO_HOLD 1e-9

void perp__open_budget(perp_world *world)
{
    const perp_world_settings *settings = &world->settings;
    perp__budget *budget = &world->budget;

    budget->limited = settings->time_limit > 0.0;
    budget->iterations = settings->max_iterations > 0 ? settings->max_iterations : INT64_MAX;
    budget->deadline = budget->until = 0.0;
    if (!budget->limited)
        return;
    budget->until = perp__now() + VELOCITIES * settings->time_limit;
    budget->deadline = budget->until + (1.0 - VELOCITIES) * settings->time_limit;
}

double perp__seconds_left(const perp_world *world)
{
    return world->budget.limited ? world->budget.until - perp__now() : INFINITY;
}

void perp__spend(perp_world *world, int64_t iterations)
{
    perp__budget *budget = &world->budget;

    budget->spent += iterations;
    if (budget->iterations < INT64_MAX)
        budget->iterations -= iterations < budget->iterations ? iterations : budget->iterations;
}

perp_outcome perp__may_pivot(const perp_world *world, int32_t rows)
{
    if (world->budget.iterations == 0)
        return PERP_OUTCOME_ITERATION_LIMIT;
    if (perp__seconds_left(world) < SECONDS_PER_ENTRY * rows * rows)
        return PERP_OUTCOME_TIME_LIMIT;
    return PERP_OUTCOME_SOLVED;
}

int32_t perp__may_hold(const perp_world *world, const perp__island *island)
{
    const double columns = (double)world->dof * island->bodies;

    return perp__seconds_left(world) >=
           SECONDS_TO_HOLD * 3.0 * island->contacts * columns * columns;
}
