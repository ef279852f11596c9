/* Block Gauss-Seidel: the workspace, shared by its files. Its blocks are the constraints: contacts
 * and bilateral rows. */
#ifndef PERP_CONTACT_SWEEP_H
#define PERP_CONTACT_SWEEP_H

#include "contact/bodies/bodies.h"
#include "contact/sweep/local.h"
#include "contact/method.h"
#include "contact/sweep/mixing.h"

/* The parts of a contact that rolls or spins; its local problem is solved by turns. */
typedef struct perp__sweep_discs {
    perp__local rolling, spinning;
    double W[PERP__ROWS_MOST * PERP__ROWS_MOST];
} perp__sweep_discs;

typedef struct perp__sweep_work {
    perp__contact_work common;
    int32_t constraints, size;
    int32_t *rows;              /* constraints + 1 */
    perp__local *local;         /* constraints */
    perp__sweep_discs *discs;   /* contacts, if some roll or spin */
    perp__two_sided *two_sided; /* contacts, if some hold both ways; `local` is no more then */
    double *weights;            /* constraints: sqrt(trace) / omega */
    double *row_weights;        /* size: the same for each row */
    double *r;                  /* size */
    double *x, *u;              /* size: r within its cones, and W x + q */
    int8_t *modes;              /* contacts */
    double *best;               /* size: the r of the smallest change, up to a factor 2 */
    double *y;                  /* bodies: P'r in blocks */
    perp__mixing mixing;
    int64_t sweeps, next_test;  /* done; the one from when on the residual is computed again */
    double least, least_before; /* change; and at the end of the last window */
    double looked[2];           /* and when its rate was looked at, the last time and before */
    int64_t patience, next_look;
    perp_status status;
    double remembered, residual; /* the change that led to `best`; the residual of r in the end */
    double share;                /* of tol: the change that makes the residual worth its cost */
    /* W by rows; columns NULL: dense */
    int64_t *entry_starts; /* size + 1 */
    int32_t *columns;
    double *entries;
} perp__sweep_work;

/* One pass over all constraints. Returns the largest weighted change of r, max sqrt(t_k) |dr_k| /
 * omega; NaN or infinity where a number overflowed. */
double perp__sweep_pass(perp__sweep_work *work);

/* W by rows from problem->W; the local problems from either. */
void perp__sweep_read(perp__sweep_work *work);
void perp__sweep_layout(perp__arena *arena, void *work);

/* The tested residual of x, with u := W x + q. */
double perp__sweep_residual(perp__sweep_work *work, const double *x, double *u);

#endif
