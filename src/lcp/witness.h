/* Memory of the second witness (witness.c). */
#ifndef PERP_LCP_WITNESS_H
#define PERP_LCP_WITNESS_H

#include "base/arena.h"

/* Units of M: log2 of scales that bring the largest entry of every row and column near 1, and the
 * parts of M that hang together by couplings that are significant in them. */
typedef struct perp__witness_units {
    int32_t *exponents, *cut;
} perp__witness_units;

typedef struct perp__witness {
    int32_t known; /* units are those of this matrix and this tolerance */
    double tol;
    perp__witness_units units[2];
    int32_t count; /* of units: 1, or 2 */
    int32_t *omegas, *is_free;
    double *terms, *carried, *rounding, *wrong, *around, *most; /* n each, see witness.c */
} perp__witness;

void perp__witness_layout(perp__arena *arena, perp__witness *witness, size_t n);

#endif
