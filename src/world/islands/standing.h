/* What can rest, rests (perp/statics.h): an island whose bodies have the motion of what carries them
 * keeps it where impulses within all cones make the forces do just that. */
#ifndef PERP_WORLD_STANDING_H
#define PERP_WORLD_STANDING_H

#include "contact/statics/statics.h"
#include "world/world.h"

/* Factors of the islands that stood last: one costs a factorisation to make anew, and its key is
 * made of all that goes into it, so that which of them are here changes no bit. */
enum { PERP__STANDING_KEPT = 8 };

typedef struct perp__standing {
    perp__statics *statics[PERP__STANDING_KEPT];
    uint64_t key[PERP__STANDING_KEPT][2]; /* 0, 0: none */
    uint64_t used[PERP__STANDING_KEPT], clock;
} perp__standing;

void perp__standing_release(perp__standing *standing);

/* The common motion of all static and kinematic bodies that an island touches or is joined with. */
typedef struct perp__carrying {
    int32_t moves; /* 0: they are at rest, or there are none */
    int32_t body;  /* one of them, which moves */
} perp__carrying;

/* Returns 0 where they move differently. */
int32_t perp__find_carrying(const perp_world *world, const perp__island *island,
                            perp__carrying *carrying);
/* The twist that a body of the island has if it moves as one with them. */
void perp__carried_twist(const perp_world *world, const perp__carrying *carrying, int32_t body,
                         double *twist);
/* Whether all bodies of the island begin the step with that motion; or, where what carries them does
 * not keep its velocity, stood in the last step. */
int32_t perp__begins_standing(const perp_world *world, const perp__island *island,
                              const perp__carrying *carrying);

/* The same impulses as in the last step: whether they leave an island at rest to rounding beside
 * the terms of each body. Then that is its motion. */
int32_t perp__lies_still(perp_world *world, const perp__island *island, perp__verdict *verdict);

/* Whether the rows of work, over an interval whose velocities would be work.free without impulses,
 * can stand with the bodies in that motion. Then *stands is 1 and work has the answer. */
perp_status perp__stand(perp_world *world, const perp__island *island,
                        const perp__carrying *carrying, perp__verdict *verdict, int32_t *stands);

#endif
