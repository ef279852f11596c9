#include "base/outcome.h"

#include <string.h>

perp_outcome perp__worse_outcome(perp_outcome first, perp_outcome second)
{
    if (!perp__is_good(first))
        return first;
    return second == PERP_OUTCOME_SOLVED ? first : second;
}

/* Adding one to a biased exponent carries into the sign bit where it is all ones: infinities and
 * NaN. Branch-free, because nearly every array passes. */
int32_t perp__all_finite(const double *x, size_t count)
{
    const uint64_t exponent_mask = UINT64_C(0x7ff0000000000000);
    const uint64_t exponent_one = UINT64_C(0x0010000000000000);
    uint64_t carries = 0;

    for (size_t k = 0; k < count; k++) {
        uint64_t bits;

        memcpy(&bits, &x[k], sizeof bits);
        carries |= (bits & exponent_mask) + exponent_one;
    }
    return carries >> 63 == 0;
}
