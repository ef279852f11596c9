/* Newton's method on the equations of one active set; what the front door tries on every point that
 * comes near a solution. */
#ifndef PERP_CONTACT_POLISH_H
#define PERP_CONTACT_POLISH_H

#include "contact/method.h"

/* What a friction part of a contact that presses does. */
enum perp__part_state { PERP__PART_NONE, PERP__PART_STICKS, PERP__PART_SLIPS };

typedef struct perp__contact_polish {
    perp__arena arena;
    int32_t room;    /* rows that K has room for */
    double enough;   /* > 0: in plain doubles, and to no more than this tested residual */
    int64_t last;    /* of the steps in plain doubles */
    int32_t is_soft; /* the last step was a proximal one: no equations hold */
    int32_t n;       /* rows of the active set */
    int32_t *place;  /* of a row in the system, -1: r is known there */
    int32_t *rows;   /* the other way round */
    int8_t *presses; /* contacts */
    int8_t *parts;   /* 3 contacts, behind those: enum perp__part_state */
    int8_t *seen;    /* these of the sets that were */
    int32_t *pivots;
    double *K, *factors;                          /* n by n; factors of K + a regularisation */
    double *rhs, *step, *error, *units, *weights; /* n */
} perp__contact_polish;

/* Most rows of a problem that is polished: the factors are dense. */
enum { PERP__POLISH_MOST = 600 };

/* Most rows of one that is followed from its start, before anything else. */
enum { PERP__POLISH_START_MOST = 96 };

/* And of one whose sets are searched. */
enum { PERP__POLISH_SEARCH_MOST = 24 };

struct perp_contact_solver;

/* Reads the active set off solver->r and u and follows it to where it ends; the best point met is
 * left in the front door as any method's. PERP_OK or a negative status. */
perp_status perp__contact_polish_run(struct perp_contact_solver *solver);
/* Of a small problem whose W is there, before anything else: whether it is one; whether r, clipped,
 * is an answer as far as plain doubles tell, with u; and the same as above from r, at a small share
 * of the cost, considered only if within a few steps it ends with a set that stays; knows_u: u is
 * that of r. */
int32_t perp__contact_polish_suits(const struct perp_contact_solver *solver);
int32_t perp__contact_is_near(struct perp_contact_solver *solver);
perp_status perp__contact_polish_start(struct perp_contact_solver *solver, int32_t knows_u);
/* The same, from a few thousand sets of a fixed random sequence, each with a try of its own, until
 * one is an answer: milliseconds. */
perp_status perp__contact_polish_search(struct perp_contact_solver *solver);

#endif
