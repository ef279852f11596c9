/* The LCP with a tridiagonal M-matrix, in time proportional to n. */
#ifndef PERP_LCP_TRIDIAGONAL_H
#define PERP_LCP_TRIDIAGONAL_H

#include "lcp/method.h"
#include "linalg/tridiagonal.h"

typedef struct perp__tridiagonal_lcp {
    struct perp__run *runs; /* n */
    double *q;              /* n, of the problem with its bounds shifted to 0 */
} perp__tridiagonal_lcp;

void perp__tridiagonal_lcp_layout(perp__arena *arena, perp__tridiagonal_lcp *work, size_t n);

/* Finds the index set of the solution. Returns 0 if this is not a problem for this method: T is not
 * an M-matrix, or there are finite bounds on both sides. */
int32_t perp__tridiagonal_lcp_places(perp__tridiagonal_lcp *work, const perp__tridiagonal *T,
                                     const perp__lcp_problem *problem, int8_t *places);

#endif
