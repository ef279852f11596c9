/* The numbers that several files of the world share. */
#ifndef PERP_WORLD_TUNING_H
#define PERP_WORLD_TUNING_H

/* Overlap and joint errors, in sizes and radians, that are left as they are. */
#define PERP__IN_PLACE 1e-12

/* Prefetch distance in loops: bodies, pairs or contacts ahead. */
#define PERP__FETCHED_AHEAD 12

/* Contacts that are solved exactly at once; of more, only what that brings to an answer quickly. */
#define PERP__FEW_CONTACTS 8

/* Passes between two checks of the residual. */
#define PERP__PASSES 16

#endif
