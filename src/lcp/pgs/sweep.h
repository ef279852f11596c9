/* Gauss-Seidel sweeps over a sliced matrix, with the residual met on the way. */
#ifndef PERP_LCP_PGS_SWEEP_H
#define PERP_LCP_PGS_SWEEP_H

#include "lcp/pgs/rows.h"

enum { PERP__SWEEPS_AT_ONCE = 4, PERP__BLOCK_ROWS = PERP__BLOCK * PERP__SLICE };

/* Where one sweep is, and what it has seen. The residual of a block is added up one block later:
 * vectors read what was just written one by one only with a delay. */
typedef struct perp__passage {
    double old[2][PERP__BLOCK_ROWS];   /* z before the update */
    double moved[2][PERP__BLOCK_ROWS]; /* and after, not yet within its bounds */
    double worst[8], zero[4];          /* zero: NaN where a number overflowed */
    int32_t done;                      /* blocks */
    int32_t pending;                   /* the block whose residual is outstanding, or -1 */
} perp__passage;

typedef struct perp__sweeper {
    perp__rows rows;
    double keep;  /* 1 - omega */
    double *room; /* PERP__GUARD zeros, then z to the end of the last slice, then as many again */
    double *z;
    perp__passage *passages;
} perp__sweeper;

void perp__sweeper_layout(perp__arena *arena, perp__sweeper *sweeper,
                          const perp__lcp_problem *problem);

/* Starts at z; keep and each slice's load, lower and upper are in place. */
void perp__sweeper_start(perp__sweeper *sweeper, const double *z);

/* `count` <= PERP__SWEEPS_AT_ONCE sweeps in the order of the rows. residuals[k] is the largest
 * |mid(z_i - l_i, z_i - u_i, w_i)| of sweep k, each read when row i is updated; +inf if a number
 * overflowed. The sweeps follow each other at the distance that the matrix demands, so that each
 * row's z are the same bits as one sweep after the other, and M passes through the cache once. */
void perp__sweep(perp__sweeper *sweeper, int32_t count, double *residuals);

/* One sweep in the opposite order; the rows were read with symmetric = 1. */
void perp__sweep_backward(perp__sweeper *sweeper, double *residual);

#endif
