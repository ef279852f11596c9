/* The methods: each runs a walk from where it stands. Checks, timing, acceptance, polish and
 * restarts live in the front door. */
#ifndef PERP_NCP_METHOD_H
#define PERP_NCP_METHOD_H

#include "ncp/walk.h"

/* From walk->z, where F is defined, to walk->outcome; what it thinks of its point is no verdict.
 * PERP_OK, or PERP_ERROR_MEMORY / _CALLBACK. */
perp_status perp__ncp_fischer(perp__ncp_walk *walk);

/* Newton's method on the active set that the natural map shows, as long as that takes off at least
 * half of the residual. */
perp_status perp__ncp_polish(perp__ncp_walk *walk);

#endif
