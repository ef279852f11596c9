/* The order in which the front door tries methods, and what each may spend. */
#ifndef PERP_LCP_PLAN_H
#define PERP_LCP_PLAN_H

#include "lcp/solver.h"

#define PERP__PLAN_MOST (PERP__METHODS + 2)

typedef struct perp__plan_step {
    int32_t method;          /* PERP_LCP_... */
    int64_t iteration_limit; /* <= 0: the method's own */
    double share;            /* of the time limit; 1: all that is left */
    int32_t rough;           /* its point is taken as it is, without the polish */
} perp__plan_step;

/* Fills `steps` (room for PERP__PLAN_MOST) and returns how many there are. */
int32_t perp__lcp_plan(const perp_lcp_solver *solver, perp__plan_step *steps);

#endif
