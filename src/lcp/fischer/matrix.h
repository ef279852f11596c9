/* The scaled matrix S of a problem, dense or sparse as the problem is, and the factors of its
 * active blocks S_AA + W_A, W diagonal, which are all that a Newton step needs. */
#ifndef PERP_LCP_FISCHER_MATRIX_H
#define PERP_LCP_FISCHER_MATRIX_H

#include "base/arena.h"
#include "lcp/method.h"
#include "linalg/factor/factor.h"

/* Who holds the last factors. */
enum perp__fischer_factors {
    PERP__FISCHER_CHOLESKY, /* `block` */
    PERP__FISCHER_LU,       /* `block` and `pivots` */
    PERP__FISCHER_SHARED,   /* the problem's sparse block */
    PERP__FISCHER_PADDED    /* `kept` */
};

typedef struct perp__fischer_matrix {
    const perp__lcp_problem *problem;
    perp__matrix S;         /* column-major, or CSC with all of the diagonal in its pattern */
    double *S_values;       /* what S points to, writable */
    int32_t *column_starts; /* sparse only */
    int32_t *row_indices;
    int32_t *diagonal; /* sparse only: where S_jj is */
    double *factors;   /* the D that S was scaled by */
    int32_t is_read;   /* S holds the problem of this set-up */
    int32_t symmetric; /* S is, to the last bit */
    double *block;     /* dense: factors; sparse: values in S's pattern */
    int32_t *active, count;
    int32_t *pivots;
    double *packed; /* n: a right-hand side on the active rows */
    enum perp__fischer_factors by;
    /* sparse, W not a multiple of I: the block in S's pattern, the identity elsewhere, so that one
     * analysis serves all blocks; in memory of its own, made when it is first needed */
    perp__kept_factor kept;
    int32_t factored; /* how often, since the solve began */
} perp__fischer_matrix;

/* Takes room for the matrices of `problem`. */
void perp__fischer_matrix_layout(perp__arena *arena, perp__fischer_matrix *matrix,
                                 const perp__lcp_problem *problem);

/* Copies and scales M, unless that is done already since the layout. Begins a solve. */
void perp__fischer_matrix_read(perp__fischer_matrix *matrix, const perp__lcp_problem *problem);

double perp__fischer_matrix_diagonal(const perp__fischer_matrix *matrix, int32_t j);

/* y += x S_j, S_j being column j. */
void perp__fischer_matrix_add_column(const perp__fischer_matrix *matrix, int32_t j, double x,
                                     double *y);

/* Factors S_AA + W_A where A has the rows whose weight is finite, or S_AA + rho I where A has those
 * between their bounds. By Cholesky where S is symmetric and the block positive definite, else by
 * LU. PERP_OK, PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
perp_status perp__fischer_matrix_factor(perp__fischer_matrix *matrix, const double *weights);
perp_status perp__fischer_matrix_factor_block(perp__fischer_matrix *matrix, const int8_t *places,
                                              double rho);

/* Solves with the last factors on the active rows of x; leaves the others alone. */
void perp__fischer_matrix_solve(perp__fischer_matrix *matrix, double *x);

/* Releases what is not in the arena. */
void perp__fischer_matrix_release(perp__fischer_matrix *matrix);

#endif
