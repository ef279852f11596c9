/* The scaled matrix S of a problem and the Newton matrices H = D_z + D_w S made from it, dense or
 * sparse as the problem is, with the factorisation that outlives a solve. */
#ifndef PERP_LCP_FISCHER_MATRIX_H
#define PERP_LCP_FISCHER_MATRIX_H

#include "base/arena.h"
#include "lcp/method.h"
#include "linalg/kept_factor.h"

typedef struct perp__fischer_matrix {
    perp__matrix S;         /* column-major, or CSC with all of the diagonal in its pattern */
    double *S_values;       /* what S points to, writable */
    double *H_values;       /* in S's pattern */
    int32_t *column_starts; /* sparse only */
    int32_t *row_indices;
    int32_t factored;       /* how often, since the matrix was read */
    perp__kept_factor kept; /* in memory of its own, from solve to solve */
} perp__fischer_matrix;

/* Takes room for the matrices of `problem`. */
void perp__fischer_matrix_layout(perp__arena *arena, perp__fischer_matrix *matrix,
                                 const perp__lcp_problem *problem);

/* Copies and scales M, and analyses its pattern unless that is the one analysed already.
 * PERP_OK or PERP_ERROR_MEMORY. */
perp_status perp__fischer_matrix_read(perp__fischer_matrix *matrix,
                                      const perp__lcp_problem *problem);

/* y = S' x */
void perp__fischer_matrix_transposed(const perp__fischer_matrix *matrix, const double *x,
                                     double *y);

/* Factors H = diag(slope_z) + diag(slope_w) (S + rho I). PERP_OK, PERP__FACTOR_SINGULAR or
 * PERP_ERROR_MEMORY. */
perp_status perp__fischer_matrix_factor(perp__fischer_matrix *matrix, const double *slope_z,
                                        const double *slope_w, double rho);

/* x := H^-1 x with the last factors. */
void perp__fischer_matrix_solve(perp__fischer_matrix *matrix, double *x);

/* Releases what is not in the arena. */
void perp__fischer_matrix_release(perp__fischer_matrix *matrix);

#endif
