/* Workspace of the polish: the active block and its factors. Those of a large sparse block are the
 * solver's. */
#ifndef PERP_LCP_POLISH_H
#define PERP_LCP_POLISH_H

#include "base/arena.h"

typedef struct perp__polish {
    perp__arena arena;
    int64_t fitted;
    int32_t *active;            /* n */
    int8_t *places;             /* n, of the best point */
    double *z, *w_high, *w_low; /* n, the best point */
    double *step;               /* n */
    double *block;              /* dense: n^2 */
    int32_t *pivots;
} perp__polish;

void perp__polish_release(perp__polish *polish);

#endif
