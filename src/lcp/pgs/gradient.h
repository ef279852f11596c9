/* Nonsmooth nonlinear conjugate gradients over sweeps (Silcowitz, Niebe & Erleben, The Visual
 * Computer 26 (2010) 893). */
#ifndef PERP_LCP_PGS_GRADIENT_H
#define PERP_LCP_PGS_GRADIENT_H

#include "lcp/pgs/sweep.h"

typedef struct perp__gradient {
    double *before;    /* z when the sweep began */
    double *direction; /* n */
    double norm;       /* |step of the last sweep|^2; 0: no direction yet */
} perp__gradient;

void perp__gradient_layout(perp__arena *arena, perp__gradient *gradient, size_t n);

/* Forgets the direction. */
void perp__gradient_restart(perp__gradient *gradient);

/* Before and after the sweeps that make one step; the second adds the direction to z, within the
 * bounds. */
void perp__gradient_before(perp__gradient *gradient, const perp__sweeper *sweeper);
void perp__gradient_after(perp__gradient *gradient, perp__sweeper *sweeper);

#endif
