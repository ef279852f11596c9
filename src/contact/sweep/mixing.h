/* Anderson mixing (J. ACM 12 (1965) 547) of sweeps: with f = sweep(r) - r of the last few sweeps,
 * the next start is the affine combination of their results for which the combined f is least.
 * Within one active set, where sweeps are linear, that is GMRES (Walker & Ni, SIAM J. Numer. Anal.
 * 49 (2011) 1715). Sweeps over other active sets mislead it: it forgets all once |f| grows. */
#ifndef PERP_CONTACT_SWEEP_MIXING_H
#define PERP_CONTACT_SWEEP_MIXING_H

#include "base/arena.h"

enum { PERP__MIXING_DEPTH = 5 };

/* A state is r and y, which is linear in r. */
typedef struct perp__mixing {
    int32_t size, y_size;
    int32_t count, next; /* differences held; where the next one goes */
    int32_t has_last;
    double norm;       /* of the last f */
    double *before;    /* r when the sweep began */
    double *f, *r, *y; /* of the last sweep; f weighted */
    double *F, *R, *Y; /* differences, PERP__MIXING_DEPTH of each */
    double gram[PERP__MIXING_DEPTH][PERP__MIXING_DEPTH]; /* F'F */
} perp__mixing;

void perp__mixing_layout(perp__arena *arena, perp__mixing *mixing, size_t size, size_t y_size);
/* The first sweep begins at r. */
void perp__mixing_forget(perp__mixing *mixing, const double *r);

/* After a sweep: r and y, its result, become the next start. weights: size. */
void perp__mixing_after(perp__mixing *mixing, const double *weights, double *r, double *y);

#endif
