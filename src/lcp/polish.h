/* Workspace of the polish: the active block and its factors. */
#ifndef PERP_LCP_POLISH_H
#define PERP_LCP_POLISH_H

#include "base/arena.h"
#include "linalg/kept_factor.h"

typedef struct perp__polish {
    perp__arena arena;
    int64_t fitted;
    int32_t *active;            /* n */
    int8_t *places;             /* n, of the best point */
    double *z, *w_high, *w_low; /* n, the best point */
    double *step;               /* n */
    double *block;              /* dense: n^2; CSC: values of the pattern */
    int32_t *pivots;
    /* CSC: M's pattern with a full diagonal; inactive rows and columns hold the identity, so that
     * one symbolic analysis serves every index set. */
    int32_t *starts, *rows;
    perp__kept_factor kept;
    int32_t factored; /* how often, in this run */
} perp__polish;

void perp__polish_release(perp__polish *polish);

#endif
