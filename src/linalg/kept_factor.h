/* A factorisation kept from set-up to set-up: analysed again only for another size or pattern, and
 * with new memory only, if dense, for a larger one than ever. */
#ifndef PERP_LINALG_KEPT_FACTOR_H
#define PERP_LINALG_KEPT_FACTOR_H

#include "linalg/factor/factor.h"

/* All zero at first. */
typedef struct perp__kept_factor {
    perp_context *context;
    const perp__factor_type *type;
    perp__factor *factor; /* NULL: nothing analysed */
    int32_t n, most;      /* of the matrix at hand; of the largest that there is memory for */
    int32_t *pattern;     /* column starts and row indices that were analysed; NULL if dense */
} perp__kept_factor;

/* Analyses A's pattern unless it is the one analysed already. PERP_OK or PERP_ERROR_MEMORY, and
 * then nothing is kept. */
perp_status perp__kept_factor_analyse(perp__kept_factor *kept, perp_context *context,
                                      const perp__factor_type *type, const perp__square *A);

void perp__kept_factor_release(perp__kept_factor *kept);

#endif
