/* The LCP with a tridiagonal M-matrix, in time proportional to n. */
#ifndef PERP_LCP_TRIDIAGONAL_H
#define PERP_LCP_TRIDIAGONAL_H

#include "lcp/method.h"
#include "linalg/tridiagonal.h"

enum {
    PERP__TRIDIAGONAL_NO = 0,   /* no M-matrix even without its positive couplings */
    PERP__TRIDIAGONAL_FAR = 1,  /* places where many signs are wrong */
    PERP__TRIDIAGONAL_NEAR = 2, /* where few are */
    PERP__TRIDIAGONAL_SOLVED = 3
};

typedef struct perp__tridiagonal_lcp {
    struct perp__run *runs; /* n */
    double *q;              /* n, of the problem with its bounds shifted to 0 */
    double *x;              /* n */
    int32_t *active;        /* n */
    perp__tridiagonal Z;    /* the matrix without its positive couplings */
    int32_t examined;       /* what follows is that of the problem */
    int32_t suits;          /* Z is an M-matrix */
    double sign;            /* 1, or -1: the upper bounds count */
} perp__tridiagonal_lcp;

void perp__tridiagonal_lcp_layout(perp__arena *arena, perp__tridiagonal_lcp *work, size_t n);

/* Finds the index set of the solution, and z. problem->block must be tridiagonal. *found says what
 * came of it; z is meant to be used with PERP__TRIDIAGONAL_SOLVED only. PERP_OK or _MEMORY. */
perp_status perp__tridiagonal_lcp_solve(perp__tridiagonal_lcp *work,
                                        const perp__lcp_problem *problem, int8_t *places, double *z,
                                        int32_t *found);

#endif
