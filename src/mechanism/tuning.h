/* The numbers that several files of mechanisms share. */
#ifndef PERP_MECHANISM_TUNING_H
#define PERP_MECHANISM_TUNING_H

#include "base/rounding.h"

/* What is no more than this beside the terms that it is a sum of is nothing: rounding of what the
 * caller's functions tell. Of gaps, velocities, accelerations, forces and determinants. */
#define PERP__NOTHING 1e-12

/* A pivot of so many times what the system is known to is none: an inertia may be 0. */
#define PERP__SINGULAR 4.0

/* Directions of slips, the forces by them, and factors of expansions are found to this. */
#define PERP__SAME_DIRECTION 1e-10

/* What is found in two ways is the same where it differs by no more: the velocities of an answer
 * and its impulses, beside the terms of their balance (impulses are known up to tol times what
 * bodies and levers make of that); velocities that hold.c finds and the solution's, which stand
 * where a problem was stopped early; the points of a family, which the double description method
 * gives to 1e-9 or so; a friction force and its bound. */
#define PERP__AGREEMENT sqrt(DBL_EPSILON)

/* Of implicit steps: iterations that gain less than this factor are given a matrix of their own. */
#define PERP__SLOW 0.1

/* Newton's method, secants and cuts of polygons end by themselves, or lead nowhere. */
enum { PERP__MOST_ITERATES = 60 };

/* A share that does not show: what is smaller than this beside the largest counts as if it had it;
 * iterations leave this of a run's error; a run may leave as much of its gaps. */
#define PERP__LITTLE 1e-3

/* Halves, or steps that gain as much, after which doubles have no more digits. */
enum { PERP__MOST_HALVES = 60 };

#endif
