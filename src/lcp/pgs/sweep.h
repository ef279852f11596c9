/* The matrix of a Gauss-Seidel sweep, by slices of eight rows (sliced ELLPACK: Monakov, Lokhmotov &
 * Avetisyan, HiPEAC 2010). A sweep adds up a slice's entries in vectors, as far as their z are
 * known when the slice begins, and is left with a short recursion from row to row.
 *
 * With omega the relaxation, S = D M D and R_ij = omega S_ij / S_ii, the new z_i is
 *   mid(l_i, u_i, (1 - omega) z_i - omega q_i / S_ii - sum_(j != i) R_ij z_j).
 * The rows of R are kept as
 *   before, after  R_(i,i-1) and R_(i,i+1): the recursion of a sweep, and of one backwards
 *   core           entries within the slice whose z are not settled when it begins
 *   slots          all others, in steps of one entry a row:
 *     contiguous     row b + k has its entry in column c + k: eight neighbours of z
 *     gathered       eight columns
 *     of one row     eight entries of the same row: the tail of a row longer than the others
 *     dense          the whole column j, one for each j: a dense matrix has nothing else
 * Missing entries are zeros; sparse storage at most doubles by them, but for a few a slice. */
#ifndef PERP_LCP_PGS_SWEEP_H
#define PERP_LCP_PGS_SWEEP_H

#include "base/arena.h"
#include "lcp/method.h"

enum {
    PERP__SLICE = 8, /* rows */
    PERP__BLOCK = 8, /* slices: what a sweep does in one go */
    PERP__CORE = PERP__SLICE * PERP__SLICE,
    PERP__GUARD = PERP__SLICE /* entries around z that contiguous slots may touch */
};

/* What there is in a slice beside contiguous slots and the recursion. */
enum { PERP__HAS_LOWER = 1, PERP__HAS_UPPER = 2, PERP__HAS_CORE = 4, PERP__HAS_OTHERS = 8 };

/* Eight rows; one stream of memory for a sweep. The last may have rows beyond n: all zeros. */
typedef struct perp__slice {
    double before[PERP__SLICE], after[PERP__SLICE];
    double load[PERP__SLICE]; /* omega q_i / S_ii */
    double lower[PERP__SLICE];
    double weight[PERP__SLICE];   /* S_ii / omega */
    size_t values, columns, core; /* where its slots start, and its core */
    int32_t contiguous, gathered; /* slots */
    int32_t rows;                 /* slots of one row; their columns come after the row's number */
    int32_t what;                 /* PERP__HAS_... */
    int32_t unused[6];
} perp__slice;

typedef struct perp__block {
    int32_t reach; /* the last block that has to do with the rows of this one */
    int32_t what;  /* all that its slices have */
} perp__block;

typedef struct perp__rows {
    int32_t n;
    int32_t count; /* slices */
    int32_t dense;
    int32_t symmetric; /* sweeps backwards are possible */
    perp__slice *slices;
    double *upper; /* all rows: often there is none to look at */
    double *values;
    int32_t *columns;
    perp__block *blocks;
    size_t entries; /* values in use, zeros included */
    /* sparse, while reading: R by rows */
    int32_t *row_starts, *row_columns;
    double *row_values;
} perp__rows;

/* Takes room for the matrix of `problem`. */
void perp__rows_layout(perp__arena *arena, perp__rows *rows, const perp__lcp_problem *problem);

/* Copies and scales the matrix. step[i] is omega / S_ii, or 0 where z_i is not to move: such a row
 * has entries of 0 and weight 0. load, lower and upper are the caller's to fill. */
void perp__rows_read(perp__rows *rows, const perp__lcp_problem *problem, const double *step,
                     bool symmetric);

/* Gauss-Seidel sweeps over it, with the residual met on the way. */

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
