/* The numbers that several files of the world share. */
#ifndef PERP_WORLD_TUNING_H
#define PERP_WORLD_TUNING_H

/* Overlap and joint errors, in sizes and radians, that are left as they are. */
#define PERP__IN_PLACE 1e-12

/* Prefetch distance in loops: bodies, pairs or contacts ahead. */
#define PERP__FETCHED_AHEAD 12

/* Islands of up to so many contacts are solved exactly at once; larger ones only if it is quick. */
#define PERP__FEW_CONTACTS 8

/* Passes between two checks of the residual. */
#define PERP__PASSES 16

#endif
