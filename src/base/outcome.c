#include "base/outcome.h"

#include <float.h>

/* A backward error that no double betters by more than a constant: each product and sum of a row
 * rounds once, and refinement with doubled residuals ends within a few units of that. */
#define ROUNDING (16.0 * DBL_EPSILON)

/* Written so that a NaN fails. */
static int32_t holds(const perp__evidence *evidence, double tol)
{
    return evidence->sound && evidence->tested <= tol && evidence->own <= tol;
}

perp_outcome perp__gate(const perp__evidence *evidence, double tol, perp_outcome said)
{
    if (holds(evidence, tol))
        return PERP_OUTCOME_SOLVED;
    if (evidence->backward <= ROUNDING && holds(evidence, sqrt(tol)))
        return PERP_OUTCOME_ROUNDING_LIMIT;
    return said < 0 || perp__is_good(said) ? PERP_OUTCOME_STALLED : said;
}

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
