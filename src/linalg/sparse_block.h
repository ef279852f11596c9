/* Principal blocks of one matrix, factored in the cheapest way its structure allows: dense ones by
 * Cholesky or LU, sparse ones by tridiagonal elimination, Cholesky, LU, or not at all: large blocks
 * of matrices like Laplace's are solved by conjugate gradients with multigrid, those whose factors
 * would fill in by conjugate gradients alone. Factors are kept until the next block comes. */
#ifndef PERP_LINALG_SPARSE_BLOCK_H
#define PERP_LINALG_SPARSE_BLOCK_H

#include "linalg/factor/factor.h"
#include "linalg/fronts/fronts.h"
#include "linalg/multigrid/multigrid.h"
#include "linalg/tridiagonal.h"

/* Sparse matrices and blocks of up to so many rows are expanded: dense factors cost less
 * (bench/lcp_sparse.c). */
#define PERP__SMALL_SPARSE 64

/* Matrices of so many rows are large: they get a hierarchy, and a look before the method. */
#define PERP__LARGE_MATRIX 1000

/* What a solve without factors leaves of a residual. */
#define PERP__ROUGH 1e-6

enum perp__sparse_kind {
    PERP__SPARSE_TRIDIAGONAL = 1,
    PERP__SPARSE_SYMMETRIC, /* with a positive diagonal: Cholesky, or LU where that breaks down */
    PERP__SPARSE_GENERAL,
    PERP__DENSE /* by columns; Cholesky, or LU, as the symmetric ones */
};

/* Dense blocks of sets A that differ by few indices from the set A0 of the factors: what entered
 * (E) and what left (L) borders the old block,
 *
 *   [ M_00  M_0E  -I_0L ] [x_0]   [r_0]
 *   [ M_E0  M_EE    0   ] [x_E] = [r_E],
 *   [-I_L0   0      0   ] [w_L]   [ 0 ]
 *
 * and costs solves with the old factors and one with the Schur complement of M_00. */
typedef struct perp__border {
    int32_t is_open;    /* the factors may be bordered */
    int32_t capacity;   /* most changes that are kept */
    int32_t kept;       /* changes with a column below */
    int32_t changes;    /* those that tell A from A0 */
    int32_t *position;  /* n: place in A0, or -1 */
    int32_t *column_of; /* n: the kept change of an index, or -1 */
    int32_t *changed;   /* index of a kept change */
    int32_t *differ;    /* indices that tell A from A0 */
    double *rows;       /* n by capacity: rows of the lower left block, as columns */
    double *solved;     /* n by capacity: old block^-1 times columns of the upper right block */
    double *corner;     /* capacity^2: lower right block - rows' solved */
    double *schur;      /* capacity^2: the corner of these changes, factored */
    int32_t *pivots;    /* capacity */
    double *y;          /* capacity */
} perp__border;

/* At first all 0 but for the context. */
typedef struct perp__sparse_block {
    perp_context *context;
    const perp__matrix *M;
    int32_t kind; /* enum perp__sparse_kind */
    int32_t has_positive_diagonal;
    int32_t is_symmetric; /* up to rounding; if it is sparse, with a positive diagonal */
    int32_t has_z_signs;  /* M_ii > 0 and M_ij <= 0 for i != j */
    int32_t is_nearly_z;  /* positive entries beside a positive diagonal are small */
    int32_t suits_grid;   /* M is large and nearly Z: multigrid may serve */
    int32_t grid_built;   /* 1; -1: it does not serve, found out when built or in a solve */
    double deadline; /* on perp__now()'s clock; 0: none. What cannot be factored by then is not: */
    int32_t late;    /* 1, and so is nothing else until perp__sparse_block_restart */
    double pace;     /* seconds that reading the matrix took for each of its entries */
    /* the last factorisation */
    int32_t factored; /* 1: holds factors */
    int32_t by_lu;    /* of a symmetric matrix whose block is not positive definite */
    int32_t on_grid;  /* instead of factors there are the coarse matrices */
    int32_t
        by_steps; /* conjugate gradients instead, so many at most, 0: no; -1: they have failed */
    double rho;
    const double *weights; /* in place of rho, while factors are made */
    int32_t count;
    int32_t *active; /* n */
    perp__arena arena;
    perp__tridiagonal T;
    perp__tridiagonal_factor tridiagonal;
    perp__fronts fronts; /* of Cholesky's factors */
    int32_t ordered;     /* they are of this matrix' pattern */
    int32_t steps;       /* of conjugate gradients, as cheap as these; 0: few; -1: not known yet */
    perp__arena general_arena;
    int32_t *local, *starts, *rows; /* n; n + 1; entries + n */
    double *values;
    double *room;  /* for factors of a dense block, lent by who holds the matrix; NULL: its own */
    double *dense; /* these factors, and the pivots of LU */
    int32_t *pivots;
    perp__border border;
    double *x, *residual;                   /* n */
    double *direction, *product, *diagonal; /* n, of conjugate gradients */
    perp__multigrid grid;
    perp__factor *lu;
    int32_t lu_capacity;
} perp__sparse_block;

/* Takes another matrix, CSC or dense by columns, or the same with other values, and finds out its
 * kind. row_norms: n, of a dense one. PERP_OK or _MEMORY. Cost: one pass over M. */
perp_status perp__sparse_block_read(perp__sparse_block *block, const perp__matrix *M,
                                    const double *row_norms);

/* Factors M_AA + rho I for A = active[0] < active[1] < ...; nothing to do if these are the factors
 * it holds. The factors do not depend on what was factored before. PERP_OK, PERP__FACTOR_SINGULAR,
 * also where that would be late, or PERP_ERROR_MEMORY. */
perp_status perp__sparse_block_factor(perp__sparse_block *block, const int32_t *active,
                                      int32_t count, double rho);

/* Factors M_AA + W_AA, W = diag(weights). */
perp_status perp__sparse_block_factor_with(perp__sparse_block *block, const int32_t *active,
                                           int32_t count, const double *weights);

/* x_A := (M_AA + rho I)^-1 x_A, or with the transposed block, in the n-vector x, whose other
 * entries are not looked at. */
void perp__sparse_block_solve(perp__sparse_block *block, double *x, int32_t transposed);

/* As perp__sparse_block_factor with rho = 0, by what costs least: large blocks that multigrid
 * serves are not factored, nor those whose factors cost more than many products with them, and then
 * solves are rough; dense ones may border the last factors. */
perp_status perp__sparse_block_approach(perp__sparse_block *block, const int32_t *active,
                                        int32_t count);

/* x_A := M_AA^-1 x_A after either; without factors the residual falls to PERP__ROUGH of what it
 * was; other entries may become 0. Where that fails, the block is factored after all: PERP_OK,
 * PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
perp_status perp__sparse_block_solve_roughly(perp__sparse_block *block, double *x);

/* The hierarchy of the whole matrix, built when it is first asked for; NULL if it does not serve.
 * An unsymmetric matrix has its levels there, and no solves.
 * What the caller does with it makes the block forget its factors. PERP_OK or _MEMORY. */
perp_status perp__sparse_block_grid(perp__sparse_block *block, perp__multigrid **grid);

/* Forgets that multigrid failed: the same bits whatever was solved before. There is a deadline from
 * now on, or none. */
void perp__sparse_block_restart(perp__sparse_block *block, double deadline);

void perp__sparse_block_release(perp__sparse_block *block);

/* Whether there is no time left for something that takes as long as so many products. */
bool perp__block_is_late(perp__sparse_block *block, double products);

/* How many products with a sparse M are as many multiplications as a factorisation of it by LU; 1
 * if that would be late. The block forgets its factors. PERP_OK or _MEMORY. */
perp_status perp__sparse_block_lu_cost(perp__sparse_block *block, int64_t *products);

/* X := block^-1 X, or its transpose's, by the factors of a dense block; columns n apart. */
void perp__dense_block_solve(const perp__sparse_block *block, int32_t columns, double *X,
                             int32_t transposed);

/* border.c: its memory; none kept for the factors as they are; the border that leads to another
 * set, if that is cheaper than factors (1); and what it changes in x and block->x, which holds
 * x_A0 solved for with the old factors. */
void perp__border_layout(perp__arena *arena, perp__border *border, size_t n);
void perp__border_begin(perp__sparse_block *block);
bool perp__border_choose(perp__sparse_block *block, const int32_t *active, int32_t count);
void perp__border_solve(perp__sparse_block *block, double *x);

#endif
