/* Linear systems with the active block M_AA of a dense matrix, for sets A that change from one to
 * the next.
 *
 * The block of some set A0 is factored: by Cholesky where M is symmetric and the block positive
 * definite, else by LU. While A differs from A0 by few indices, what entered (E) and what left (L)
 * borders the old block,
 *   [ M_00  M_0E  -I_0L ] [x_0]   [r_0]
 *   [ M_E0  M_EE    0   ] [x_E] = [r_E],
 *   [-I_L0   0      0   ] [w_L]   [ 0 ]
 * and costs solves with the old factors and one with the Schur complement of M_00. */
#ifndef PERP_LCP_ACTIVE_BLOCK_H
#define PERP_LCP_ACTIVE_BLOCK_H

#include "lcp/method.h"

/* What a choice of A led to. */
enum perp__block_state {
    PERP__BLOCK_READY = 0,
    PERP__BLOCK_INDEFINITE = 1, /* only where definite blocks alone were asked for */
    PERP__BLOCK_SINGULAR = 2
};

typedef struct perp__active_block {
    perp__matrix M;        /* dense; not scaled, unless factors is NULL */
    const double *factors; /* D */
    perp__lcp_control *control;
    int32_t symmetric;     /* up to rounding */
    int32_t definite;      /* accept blocks only that M positive definite could have */
    int32_t by_cholesky;   /* how the block is factored */
    int32_t transposed;    /* the block is that of M', which lies in memory as it comes */
    int32_t count;         /* of A0; 0: nothing is factored */
    int32_t *order;        /* n: A0 */
    int32_t *position;     /* n: place in the order, or -1 */
    double *block;         /* n by n: the factors */
    int32_t *pivots;       /* n */
    int32_t capacity;      /* most changes that are kept */
    int32_t kept;          /* changes with a column below */
    int32_t *changed;      /* index of a kept change */
    int32_t *column_of;    /* n: the kept change of an index, or -1 */
    double *border;        /* n by capacity: rows of the lower left block, as columns */
    double *solved;        /* n by capacity: old block^-1 times columns of the upper right block */
    double *corner;        /* capacity^2: lower right block - border' solved */
    int32_t changes;       /* of the kept ones, those that tell A from A0 */
    int32_t *used;         /* which they are */
    double *schur;         /* capacity^2: their corner, factored */
    int32_t *schur_pivots; /* capacity */
    double *x, *y;         /* n and capacity */
} perp__active_block;

/* Takes the arrays; `block` too unless the caller lends n by n doubles by setting it afterwards. */
void perp__active_block_layout(perp__arena *arena, perp__active_block *b, int32_t n, int32_t lent);

/* Forgets all factors and points to the problem's matrix (dense). */
void perp__active_block_begin(perp__active_block *b, const perp__lcp_problem *problem,
                              int32_t symmetric);

/* Makes ready for A = {i: places_i is PERP__BETWEEN}. */
enum perp__block_state perp__active_block_choose(perp__active_block *b, const int8_t *places);

/* M_AA r_A := r_A; the other entries of r are not touched. `places` as chosen. */
void perp__active_block_solve(perp__active_block *b, const int8_t *places, double *r);

/* Whether M is symmetric up to rounding of its rows' norms. */
int32_t perp__is_symmetric(const perp__lcp_problem *problem);

#endif
