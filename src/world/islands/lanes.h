/* The work of a step, shared out among threads. */
#ifndef PERP_WORLD_LANES_H
#define PERP_WORLD_LANES_H

#include "base/tasks.h"
#include "world/islands/standing.h"
#include "world/step.h"

/* A range of pairs or bodies, and what comes of it. */
typedef struct perp__share {
    perp_context *context;
    int32_t first, end;
    perp_status status;
    int32_t found; /* a number that is looked for */
    double largest;
    perp__point *points; /* of the pairs, one after the other */
    int32_t count, capacity;
    int32_t contact; /* where they go in the set */
} perp__share;

/* What a thread has for itself: a world that is the world but for its context, its budget and the
 * workspace of islands. Which islands and pairs are a lane's depends on their numbers alone: memory
 * does not grow once it is warm. */
typedef struct perp__lane {
    perp_context context;
    perp_world world;
    perp__standing standing;
    perp__share share;
    perp_status status;
    int32_t last; /* the island that ended its work, a failure or a ray; -1: none */
} perp__lane;

perp_status perp__create_lanes(perp_world *world);
void perp__release_lanes(perp_world *world);

/* Whether the islands at hand are shared out: there are threads, it is worth it, and there is no
 * budget that all islands share. */
int32_t perp__shares_islands(const perp_world *world);

/* perp__solve_one for all islands. Where one fails or is a ray it is as if those after it had not
 * been begun: *last is that one, or -1. */
perp_status perp__solve_in_lanes(perp_world *world, double h, int32_t *last);

/* Calls `work` for the ranges that 0 .. count - 1 is cut into, one a lane, in order; returns how
 * many, or 0 without having done anything where it is not worth it. The shares stay. */
typedef void (*perp__range)(perp_world *world, perp__share *share, double h);
int32_t perp__share_out(perp_world *world, int32_t count, perp__range work, double h);
perp__share *perp__share_of(const perp_world *world, int32_t lane);

#endif
