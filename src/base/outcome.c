#include "base/outcome.h"

perp_outcome perp__worse_outcome(perp_outcome first, perp_outcome second)
{
    if (!perp__is_good(first))
        return first;
    return second == PERP_OUTCOME_SOLVED ? first : second;
}

int32_t perp__all_finite(const double *x, size_t count)
{
    double nothing = 0.0; /* NaN once a NaN or an infinity is met: no branch in the loop */
    size_t i;

    for (i = 0; i < count; i++)
        nothing += 0.0 * x[i];
    return nothing == 0.0;
}
