/* The numbers that several files of the world share. */
#ifndef PERP_WORLD_TUNING_H
#define PERP_WORLD_TUNING_H

/* Overlap and errors of joints, in sizes and radians, that are not worth removing. */
#define PERP__IN_PLACE 1e-12

/* Bodies, pairs or contacts between one that is asked of memory and that at hand. */
#define PERP__FETCHED_AHEAD 12

/* Contacts that are solved exactly at once; of more, only what that brings to an answer quickly. */
#define PERP__FEW_CONTACTS 8

/* Passes after which it is asked whether they have come to an answer. */
#define PERP__PASSES 16

#endif
