/* What the two halves of Lemke's method share: the bounded problem in standard form. */
#ifndef PERP_LCP_LEMKE_H
#define PERP_LCP_LEMKE_H

#include "lcp/method.h"
#include "lcp/tableau.h"

/* Pairs k = 0 .. pairs-1 of (x_k, v_k): z_i = base_i + sign_k x_k with i = index_k,
 * v_k = sign_k (M z + q)_i + d_k t, x_k in [0, range_k], v_k >= 0 at x_k = 0, v_k <= 0 at
 * x_k = range_k. Variables are named x_k = k, v_k = pairs + k, t = 2 pairs. */
typedef struct perp__lemke {
    perp__lcp_work head;
    perp__tableau tableau;
    int32_t capacity; /* most pairs: n and one more for every free variable */
    int32_t pairs;
    int32_t singular; /* free variables that could not be made basic: they have twin pairs */
    int32_t *index;   /* caller's variable of a pair */
    int8_t *sign;
    int8_t *at_upper; /* x_k nonbasic rests (or last rested) at range_k */
    double *range;
    double *cover;      /* d_k */
    int32_t *twin;      /* pair of -x_k where a free x_k is split, else -1 */
    int32_t *basic;     /* variable of a row */
    int32_t *nonbasic;  /* variable of a column */
    int32_t *row_of;    /* row of a variable, or -1 */
    int32_t *column_of; /* column of a variable, or -1 */
    double *base;       /* n: z where all x are 0 */
    double *b;          /* values of the basic variables */
    double *column, *row;
    double tolerance; /* of the absolute Harris test, relative to max |b| at the start */
    double direction; /* +1 or -1: how the entering variable moves */
} perp__lemke;

/* Writes the problem in standard form, makes free variables basic, splits those that cannot be. */
void perp__lemke_start(perp__lemke *l);

#endif
