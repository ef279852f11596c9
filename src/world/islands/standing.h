/* What can rest, rests (perp/statics.h): an island whose bodies have the motion of what carries
 * them keeps it where impulses within all cones make the forces do just that. */
#ifndef PERP_WORLD_STANDING_H
#define PERP_WORLD_STANDING_H

#include "contact/statics/statics.h"
#include "world/world.h"

/* Factors of the islands that stood last: one costs a factorisation to make anew, and its key is
 * made of all that goes into it, so that which of them are here changes no bit. */
enum { PERP__STANDING_KEPT = 8, PERP__STANDING_WORDS = 4 };

typedef struct perp__standing {
    perp__statics *statics[PERP__STANDING_KEPT];
    uint64_t key[PERP__STANDING_KEPT][PERP__STANDING_WORDS]; /* 0: none */
    uint64_t used[PERP__STANDING_KEPT], clock;
    int32_t last; /* the one that was asked for last */
} perp__standing;

void perp__standing_release(perp__standing *standing);

/* A motion that an island may keep. */
enum {
    PERP__CARRIED_AT_REST, /* beside static bodies, or nothing */
    PERP__CARRIED_ALONG,   /* as one with `body`, which is kinematic */
    PERP__CARRIED_ON       /* as it began the step */
};

typedef struct perp__carrying {
    int32_t motion;
    int32_t body;
    int32_t parts; /* it has to part from what moves otherwise */
} perp__carrying;

/* The common motion of all static and kinematic bodies that an island touches or is joined with;
 * carrying->body is -1 where there is none. Returns 0 where they move differently; `moving`: where
 * all are at rest, and others than the first that is not may move as they like. */
int32_t perp__find_carrying(const perp_world *world, const perp__island *island, int32_t moving,
                            perp__carrying *carrying);
int32_t perp__moves_with(const perp_world *world, const perp__carrying *carrying, int32_t body);
/* Its velocity: as who moves with it sees it, what carries does no work. Returns 0 where it turns
 * or there is none. */
int32_t perp__find_frame(const perp_world *world, const perp__island *island, double *frame);
/* The twist that a body of the island has at a time t of the step if it keeps that motion; before
 * it, t < 0, if it had it in the last one. */
void perp__carried_twist(const perp_world *world, const perp__carrying *carrying, int32_t body,
                         double t, double *twist);
/* Bodies of an island that stands go in a step of length h where a carrier that turns takes them.
 */
void perp__ride(perp_world *world, const perp__island *island, double h);
/* Whether there is a motion that the island may keep: that of what carries it, where all bodies
 * begin with it, or with the one that this had in the last step, `slowly` nearly so; or the one
 * that it has, where contacts with friction do not slide and none opens or closes. */
int32_t perp__begins_standing(const perp_world *world, const perp__island *island, int32_t slowly,
                              perp__carrying *carrying);

/* The same impulses as in the last step, or what other forces make of those that were decided:
 * whether they leave an island at rest to rounding beside the terms of each body. Then
 * verdict->stands is 1, and that is its motion. swept: not what is deep, which sweeps take out.
 * Without joints; work is that of another problem then. PERP_OK or _MEMORY. */
perp_status perp__lie_still(perp_world *world, const perp__island *island, int32_t swept,
                            perp__verdict *verdict);
/* The second of these: contacts' `next` and *unbalance are written where it stands. */
perp_status perp__stand_as_decided(perp_world *world, const perp__island *island,
                                   const perp__carrying *carrying, int32_t swept,
                                   double *unbalance);

/* What takes a body in a time t from the twist `now`, where it would have `free` alone, to the
 * carried one, as force[6]: an impulse, and an angular one over the body's length. */
void perp__find_force(const perp_world *world, const perp__carrying *carrying, int32_t body,
                      double t, const double *now, const double *free, double *force);
/* A length of a body, of its inertia: what turns are taken times. */
double perp__body_length(const perp_world *world, int32_t body);
/* work.stand_rows: the rows of work as statics has them, without those of what bodies part from
 * that move by work.still with `carrying`, which may be NULL. Returns 0 where one makes its bodies
 * move otherwise, whatever the forces; speeds of motors are not looked at where `ignores` is 1. */
int32_t perp__gather_standing(perp_world *world, const perp__island *island,
                              const perp__carrying *carrying, int32_t ignores);

/* Whether the rows of work, over an interval whose velocities would be work.free without impulses,
 * can stand with the bodies in that motion, NULL: the one that they begin with, if there is one:
 * verdict->stands. Then work has the answer. */
perp_status perp__stand(perp_world *world, const perp__island *island,
                        const perp__carrying *carrying, perp__verdict *verdict);

#endif
