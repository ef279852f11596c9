/* Islands that are swept side by side: one alone fills few of the lanes. Each is posed in a
 * workspace of its own, and has the bits that it has alone. */
#ifndef PERP_WORLD_BATCH_H
#define PERP_WORLD_BATCH_H

#include "world/islands/standing.h"

/* Islands at most, and contacts of each: what is larger fills lanes itself. */
enum { PERP__BATCH_ISLANDS = 16, PERP__BATCH_CONTACTS = 127 };

/* An island between its rows and what the sweeps make of it. */
typedef struct perp__sweeping {
    int32_t carried;
    perp__carrying carrying;
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

/* batch.c: whether the island is swept beside others; its begin, where it does not stand it waits;
 * and the sweeps of all that wait, which each goes on from by perp__conclude_one. They are over
 * once PERP__BATCH_ISLANDS wait, or when perp__sweep_batch is called. */
int32_t perp__joins_batch(const perp_world *world, const perp__island *island);
perp_status perp__wait_for_sweep(perp_world *world, int32_t number, double h,
                                 const perp__verdict *before, perp__verdict *verdict);
perp_status perp__sweep_batch(perp_world *world, double h, int32_t *last);
perp_status perp__fit_batch(perp_world *world);
void perp__release_batch(perp_world *world);

#endif
