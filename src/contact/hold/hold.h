/* Velocities in what the rows that hold leave free: exact zeros, from the active set alone.
 *
 * Let A v = t be the rows that hold: normals of contacts that press, all rows of those that stick,
 * and joints. In the bodies' own coordinates y, v = C y, the solution of the problem is
 *
 *   y = y_0 + (E - Q Q') (C^-1 v_free + C'J_l'r_l),     A C y_0 = t,
 *
 * with Q an orthonormal basis of the rows of A C and (J_l, r_l) what does not hold: impulses of
 * rows that hold drop out. Where A has full rank, t alone determines v: 0.0 if t is 0, the rigid
 * motion of what carries the body if that is one. Nothing small is set to 0.
 *
 * No system of all bodies is ever solved. A body is held as soon as its rows to what is held
 * already have full rank: rows are taken up one by one, at most 36 products each, until 6 are
 * independent, and bodies follow one another as in a breadth-first search from the ground. What is
 * left falls into clusters of bodies that rows still join. Small ones are solved densely; larger
 * ones keep the velocities they have. */
#ifndef PERP_CONTACT_HOLD_H
#define PERP_CONTACT_HOLD_H

#include "contact/bodies/bodies.h"
#include "contact/contact.h"
#include "linalg/active_rows.h"

/* Of `source`: no row yet; rows that lead to different motions. */
enum { PERP__HOLD_UNSET = -3, PERP__HOLD_SEVERAL = -4 };

/* Columns of a cluster, and rows times columns squared, up to which it is solved. */
enum { PERP__HOLD_COLUMNS = 96 };
#define PERP__HOLD_PRODUCTS 4e6

typedef struct perp__hold {
    perp__arena arena;
    size_t fitted[6];
    const perp__bodies *bodies;
    const perp__rigid_problem *rigid; /* for carriers; NULL: there are none */
    /* in, per constraint but where said otherwise */
    int8_t *holds;      /* as many of its rows, from the first on */
    int32_t *beside;    /* what its only body touches, where it has one: at rest, or a carrier */
    const double *bias; /* size: u of what stands still; beside a carrier with its motion */
    int8_t *pushed;     /* the carrier's motion aside, the bias of what holds is not 0 */
    const double *r;    /* size */
    /* out: blocks */
    double *v;        /* by width; in: as the solution has it */
    int32_t *root;    /* PERP__RIGID_AT_REST, a carrier, a block that is held by several, or FREE */
    int64_t taken_up; /* rows: what the cost is proportional to */
    /* work */
    double *y;        /* blocks by width, of those held */
    double *basis;    /* blocks by width by width: of the rows to what is held */
    int8_t *rank;     /* blocks */
    int8_t *is_held;  /* blocks */
    int32_t *source;  /* blocks: what those rows lead to, so far */
    int32_t *queue;   /* blocks */
    int32_t *cluster; /* blocks: root of its tree; then its first column */
    int32_t *members; /* blocks, by cluster */
    size_t room_rows, room_columns, room_entries;
    perp__active_rows dense; /* of a cluster */
    double *loose;
} perp__hold;

/* active.c: u of what stands still, with that of the carriers, as the caller gave it: what impulses
 * are to take away beside what the load does. */
void perp__contact_find_bias(perp_contact_solver *solver, double *bias);

/* Room for these bodies; then the caller fills what is in. PERP_OK or PERP_ERROR_MEMORY. */
perp_status perp__hold_fit(perp__hold *hold, const perp__bodies *bodies);

/* v and root. The bodies' free velocities are those of the last load. */
void perp__hold_run(perp__hold *hold);

#endif
