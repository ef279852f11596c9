/* Block Gauss-Seidel: the workspace, shared by its files. A unit is a contact or a bilateral row.
 */
#ifndef PERP_CONTACT_SWEEP_H
#define PERP_CONTACT_SWEEP_H

#include "contact/bodies.h"
#include "contact/local.h"
#include "contact/method.h"

enum { PERP__CONTACT_ROWS_MOST = 6 }; /* normal, 2 tangents, 2 of rolling, 1 of spinning */

/* The parts of a contact that rolls or spins; its local problem is solved by turns. */
typedef struct perp__sweep_discs {
    perp__local rolling, spinning;
    double W[PERP__CONTACT_ROWS_MOST * PERP__CONTACT_ROWS_MOST];
} perp__sweep_discs;

typedef struct perp__sweep_work {
    perp__contact_work common;
    int32_t units, size;
    int32_t *rows;               /* units + 1 */
    perp__local *local;          /* units */
    perp__sweep_discs *discs;    /* contacts, if some roll or spin */
    double *weights;             /* units: sqrt(trace) / omega */
    double *r, *u;               /* size */
    int8_t *modes;               /* contacts */
    double *best;                /* size: the r of the smallest residual */
    double *y;                   /* bodies: P'r */
    int64_t sweeps, next_test;   /* done; the one from when on the residual is computed again */
    double least, least_before;  /* change; and at the end of the last window */
    double remembered, residual; /* the change that led to `best`; the residual of r in the end */
    double share;                /* of tol: the change that makes the residual worth its cost */
    /* W by rows; columns NULL: dense */
    int64_t *entry_starts; /* size + 1 */
    int32_t *columns;
    double *entries;
} perp__sweep_work;

/* One pass over all units, the last first if `backward`. Returns the largest weighted change of r,
 * max sqrt(t_k) |dr_k| / omega; NaN or infinity where a number overflowed. */
double perp__sweep_bodies(perp__sweep_work *work, int32_t backward);
double perp__sweep_matrix(perp__sweep_work *work, int32_t backward);

/* u_k given, with the current r: the unit's next r, and dr. Returns the mode. */
int32_t perp__sweep_unit(perp__sweep_work *work, int32_t unit, double *u, double *dr);

/* W by rows from problem->W; the local problems from either. */
void perp__sweep_read(perp__sweep_work *work);
void perp__sweep_layout(perp__arena *arena, void *work);

/* (W r + q)_i by the rows of W. */
double perp__sweep_row(const perp__sweep_work *work, int32_t i, const double *r);

/* The tested residual of r, with u := W r + q. */
double perp__sweep_residual(perp__sweep_work *work, const double *r, double *u);

#endif
