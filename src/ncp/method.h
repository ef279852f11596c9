/* The methods: each runs a walk from where it stands. Checks, timing, acceptance, polish and
 * restarts live in the front door. */
#ifndef PERP_NCP_METHOD_H
#define PERP_NCP_METHOD_H

#include <perp/lcp.h>

#include "ncp/walk.h"

/* From walk->z, where F is defined, to walk->outcome; what it thinks of its point is no verdict.
 * PERP_OK, or PERP_ERROR_MEMORY / _CALLBACK. */
perp_status perp__ncp_fischer(perp__ncp_walk *walk);

/* The linear problems of Josephy-Newton, and the point its watchdog may return to. Zero at first;
 * in memory of its own, made when it first runs. */
typedef struct perp__ncp_linear {
    perp__arena arena;
    perp_lcp_solver *lcp;
    int32_t n, fitted; /* arrays laid out, for n */
    double *q, *z;
    double *kept_z, *kept_d; /* of the watchdog */
    double kept_psi;
    int32_t since; /* leaps since then */
} perp__ncp_linear;

perp_status perp__ncp_josephy(perp__ncp_walk *walk, perp__ncp_linear *linear);
void perp__ncp_linear_release(perp__ncp_linear *linear);

/* Newton's method on the active set that the natural map shows, as long as that takes off at least
 * half of the residual. */
perp_status perp__ncp_polish(perp__ncp_walk *walk);

#endif
