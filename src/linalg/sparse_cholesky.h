/* Sparse Cholesky factors L D L' of principal blocks of one symmetric matrix. The whole matrix is
 * ordered once, by minimum degree, and its blocks keep that order: leaving rows out cannot create
 * fill, so the factors of the whole matrix bound the memory of all blocks. */
#ifndef PERP_LINALG_SPARSE_CHOLESKY_H
#define PERP_LINALG_SPARSE_CHOLESKY_H

#include "base/arena.h"
#include "linalg/matrix.h"

typedef struct perp__sparse_cholesky {
    const perp__matrix *M; /* CSC, symmetric, analysed; its values may change */
    const double *scale;   /* the matrix is diag(scale) M diag(scale) */
    perp__arena arena, factor_arena;
    size_t entries;       /* room for entries of L */
    int32_t pattern_size; /* rows of the matrix whose order this is; 0: none */
    int32_t *pattern_starts, *pattern_rows;
    int32_t count;         /* size of the block that was factored */
    int32_t *order;        /* n: rows of M in order of elimination */
    int32_t *node, *local; /* n: block to matrix, in order of elimination; and back, or -1 */
    int32_t *parent, *mark, *stack; /* n */
    int32_t *column_counts;         /* n */
    size_t *starts;                 /* n + 1: columns of L */
    int32_t *rows;
    double *values, *pivots; /* entries; n */
    double *work, *permuted; /* n */
} perp__sparse_cholesky;

/* Orders M and makes room, unless it did so for M's pattern already. All zero at first. PERP_OK or
 * _MEMORY. */
perp_status perp__sparse_cholesky_analyse(perp__sparse_cholesky *cholesky, perp_context *context,
                                          const perp__matrix *M, const double *scale);

/* Factors the block of the rows and columns active[0], active[1], ..., plus rho I. Returns 0 if a
 * pivot is not positive and finite. */
int32_t perp__sparse_cholesky_factor(perp__sparse_cholesky *cholesky, const int32_t *active,
                                     int32_t count, double rho);

/* x := block^-1 x; x is indexed by the rows of M, entries outside of it are not looked at. */
void perp__sparse_cholesky_solve(perp__sparse_cholesky *cholesky, double *x);

void perp__sparse_cholesky_release(perp__sparse_cholesky *cholesky);

#endif
