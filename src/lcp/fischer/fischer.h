/* The semismooth Newton method on linear problems: F(z) = S z + q. What they have of their own is
 * that a step by an active set needs one block of S. */
#ifndef PERP_LCP_FISCHER_H
#define PERP_LCP_FISCHER_H

#include "lcp/fischer/newton.h"
#include "lcp/method.h"

typedef struct perp__fischer_state {
    perp__lcp_work common;
    perp__newton newton;
    int32_t by_sets;              /* tries active-set steps */
    int32_t quick;                /* and ends where they fail */
    int32_t *active;              /* the rows of the last system, finite weights */
    double *weights;              /* n, of that system */
    int8_t *places, *next_places; /* the index set to solve for, and the one after it */
    int32_t has_places;           /* 0: to be read off z and w */
    double rho;
    double *kept_z; /* the watchdog's point */
    double kept_psi;
    int32_t watched, failures;
} perp__fischer_state;

/* A perp__newton_problem's. */
perp_status perp__fischer_direction(perp__newton *run, double rho);

/* One step by a regularised active set. Returns 1 if z moved, 0 if it did not and Newton's step is
 * to be made, or PERP_ERROR_MEMORY. */
perp_status perp__fischer_active_step(perp__fischer_state *f);

#endif
