/* The numbers that several files of mechanisms share. */
#ifndef PERP_MECHANISM_TUNING_H
#define PERP_MECHANISM_TUNING_H

#define PERP__PI 3.14159265358979323846

/* What is no more than this beside the terms that it is a sum of is nothing: rounding of what the
 * caller's functions tell. Of gaps, velocities, accelerations, forces and determinants. */
#define PERP__NOTHING 1e-12

/* A pivot of so many times what the system is known to is none: an inertia may be 0. */
#define PERP__SINGULAR 4.0

/* A change that is no more than this beside what changes is the last. */
#define PERP__LAST_DIGITS 1e-14

/* Directions of slips are found to this, and the forces that follow from them. */
#define PERP__SAME_DIRECTION 1e-10

/* Points of a family, which the double description method gives to 1e-9 or so, are the same where
 * they differ by less. */
#define PERP__FAMILY_TOLERANCE 1e-8

/* Of implicit steps: iterations that gain less than this factor are given a matrix of their own,
 * by differences over this share of a velocity, the root of rounding; an answer is near, or there
 * is none. */
#define PERP__SLOW 0.1
#define PERP__DIFFERENCE 0x1p-26
enum { PERP__MOST_ITERATES = 60 };

/* What is smaller than this share of the largest counts as if it had it. */
#define PERP__FLOOR 1e-3

/* Halves, or steps that gain as much, after which doubles have no more digits. */
enum { PERP__MOST_HALVES = 60 };

/* Looks between two readings of the clock. */
enum { PERP__A_READING = 256 };

#endif
