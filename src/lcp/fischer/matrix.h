/* The scaled matrix S of a problem, dense or sparse as the problem is, and the factors of its
 * active blocks S_AA + W_A, W diagonal, which are all that a Newton step needs. */
#ifndef PERP_LCP_FISCHER_MATRIX_H
#define PERP_LCP_FISCHER_MATRIX_H

#include "base/arena.h"
#include "lcp/method.h"

/* Who holds the last factors. */
enum perp__fischer_factors {
    PERP__FISCHER_CHOLESKY, /* `block` */
    PERP__FISCHER_LU,       /* `block` and `pivots` */
    PERP__FISCHER_SHARED    /* the problem's sparse block */
};

typedef struct perp__fischer_matrix {
    const perp__lcp_problem *problem;
    perp__matrix S;    /* column-major, or CSC in M's own pattern */
    double *S_values;  /* what S points to, writable */
    double *factors;   /* the D that S was scaled by */
    int32_t is_read;   /* S holds the problem of this set-up */
    int32_t symmetric; /* S is */
    double *block;     /* dense only: factors */
    int32_t *active, count;
    int32_t *pivots;
    double *packed; /* n: a right-hand side on the active rows */
    enum perp__fischer_factors by;
} perp__fischer_matrix;

/* Takes room for the matrices of `problem`. */
void perp__fischer_matrix_layout(perp__arena *arena, perp__fischer_matrix *matrix,
                                 const perp__lcp_problem *problem);

/* Copies and scales M, unless that is done already since the layout. Begins a solve. */
void perp__fischer_matrix_read(perp__fischer_matrix *matrix, const perp__lcp_problem *problem);

/* y += x S_j, S_j being column j. */
void perp__fischer_matrix_add_column(const perp__fischer_matrix *matrix, int32_t j, double x,
                                     double *y);

/* Factors S_AA + W_A, A the rows whose weight is finite; `uniform`: all of these are the same. By
 * Cholesky where S is symmetric and the block positive definite, else by LU. PERP_OK,
 * PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
perp_status perp__fischer_matrix_factor(perp__fischer_matrix *matrix, const double *weights,
                                        int32_t uniform);

/* Solves with the last factors on the active rows of x; leaves the others alone. */
void perp__fischer_matrix_solve(perp__fischer_matrix *matrix, double *x);

#endif
