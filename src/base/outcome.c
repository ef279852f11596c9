#include "base/outcome.h"

perp_outcome perp__worse_outcome(perp_outcome first, perp_outcome second)
{
    if (!perp__is_good(first))
        return first;
    return second == PERP_OUTCOME_SOLVED ? first : second;
}

int32_t perp__all_finite(const double *x, size_t count)
{
    /* NaN once a NaN or an infinity is met: no branch in the loop, and sums side by side */
    double a = 0.0, b = 0.0, c = 0.0, d = 0.0;

    for (; count >= 4; count -= 4, x += 4) {
        a += 0.0 * x[0];
        b += 0.0 * x[1];
        c += 0.0 * x[2];
        d += 0.0 * x[3];
    }
    for (; count > 0; count--, x++)
        a += 0.0 * *x;
    return a + b + c + d == 0.0;
}
