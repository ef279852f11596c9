/* The work of a step side by side: among threads, and islands in the lanes of vectors. */
#ifndef PERP_WORLD_LANES_H
#define PERP_WORLD_LANES_H

#include "base/tasks.h"
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

/* Whether the islands at hand are shared out to the lanes, of which there are some: it is worth it,
 * and there is no budget that all islands share. */
bool perp__shares_islands(const perp_world *world);

/* perp__solve_one for all islands. Where one fails or is a ray it is as if those after it had not
 * been begun: *last is that one, or -1. */
perp_status perp__solve_in_lanes(perp_world *world, double h, int32_t *last);

/* Calls `work` for the ranges that 0 .. count - 1 is cut into, one a lane, in order, whose shares
 * stay; returns how many. Where it is not worth it 0, after a call for `all`, if not NULL. */
typedef void (*perp__range)(perp_world *world, perp__share *share, double h);
int32_t perp__share_out(perp_world *world, int32_t count, perp__range work, double h,
                        perp__share *all);

/* Islands that are swept side by side: one alone fills few of the lanes. Each is posed in a
 * workspace of its own, and has the bits that it has alone. */

/* Islands at most, and contacts of each: what is larger fills lanes itself. */
enum { PERP__BATCH_ISLANDS = 16, PERP__BATCH_CONTACTS = 127 };

/* An island between its rows and what the sweeps make of it. */
typedef struct perp__sweeping {
    int32_t carried; /* it begins with what carries it, or nearly so */
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp__passes step;
} perp__sweeping;

typedef struct perp__waiting {
    int32_t island;                /* its number */
    perp__verdict before, verdict; /* and those before it was posed, and after */
    perp__sweeping sweeping;
    perp__island_work work;
    perp__arena arena;
} perp__waiting;

typedef struct perp__batch {
    int32_t count;
    perp__waiting waiting[PERP__BATCH_ISLANDS];
} perp__batch;

/* sweep.c: the parts of perp__sweep_island. What begins at rest may stand; else its rows are posed,
 * swept, and work.v and .solved are the velocities and those that move; then what follows. */
perp_status perp__begin_sweep(perp_world *world, const perp__island *island, double h,
                              perp__verdict *verdict, perp__sweeping *sweeping);
void perp__pose_sweep(perp_world *world, const perp__island *island, double h,
                      perp__sweeping *sweeping);
void perp__take_sweep(perp_world *world, const perp__island *island,
                      const perp__sweeping *sweeping);
perp_status perp__end_sweep(perp_world *world, const perp__island *island, double h,
                            perp__verdict *verdict, perp__sweeping *sweeping);

/* batch.c: whether the island is swept beside others; room for those that may be; an island's
 * begin, where it does not stand it waits; and the sweeps of all that wait, which each goes on from
 * by perp__conclude_one. They are over once PERP__BATCH_ISLANDS wait, or when perp__sweep_batch is
 * called, of a world that has a batch. */
bool perp__joins_batch(const perp_world *world, const perp__island *island);
perp_status perp__fit_batch(perp_world *world);
perp_status perp__wait_for_sweep(perp_world *world, int32_t number, double h,
                                 const perp__verdict *before, perp__verdict *verdict);
perp_status perp__sweep_batch(perp_world *world, double h, int32_t *last);
void perp__release_batch(perp_world *world);

#endif
