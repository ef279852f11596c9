/* The gate: the one place where recomputed residuals become an outcome, for every problem class. */
#ifndef PERP_BASE_OUTCOME_H
#define PERP_BASE_OUTCOME_H

#include <math.h>
#include <string.h>

#include <perp/base.h>

#include "base/rounding.h"

/* What the residuals recomputed from the caller's own data say of a point (docs/lcp.md).
 * Two witnesses, because each alone is fooled: the tested residual by a row that hides behind a
 * larger one, the own residual by rows that consist of rounding alone. */
typedef struct perp__evidence {
    double tested;       /* ||r'||_inf */
    double own_residual; /* the largest residual of a row or contact beside its own terms */
    double backward;     /* row-wise backward error; INFINITY where the class has none */
    int32_t sound; /* all that would be returned is finite, and nothing else speaks against it */
} perp__evidence;

/* What a row may always miss of the largest terms around it, in units of tol: below 1e-5 the far
 * tail of a solution that fades out would fail at loose tolerances, below the other all would that
 * consists of rounding. */
static inline double perp__floor_of(double tol)
{
    return fmax(1e-5, PERP__ROUNDING_LIMIT / tol);
}

/* Whether the outcome counts as an answer: solved or rounding_limit. */
static inline bool perp__is_good(perp_outcome outcome)
{
    return outcome == PERP_OUTCOME_SOLVED || outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

/* Written so that a NaN fails. */
static inline bool perp__evidence_holds(const perp__evidence *evidence, double tol)
{
    return evidence->sound && evidence->tested <= tol && evidence->own_residual <= tol;
}

/* The outcome of a point: solved, rounding_limit, or what the method `said` where the numbers do
 * not speak for the point (stalled, where it said something good or, with -1, nothing). Nobody
 * writes an outcome after the gate but to make it worse. NaN never passes. */
static inline perp_outcome perp__gate(const perp__evidence *evidence, double tol, perp_outcome said)
{
    if (perp__evidence_holds(evidence, tol))
        return PERP_OUTCOME_SOLVED;
    if (evidence->backward <= PERP__ROUNDING_LIMIT && perp__evidence_holds(evidence, sqrt(tol)))
        return PERP_OUTCOME_ROUNDING_LIMIT;
    return said < 0 || perp__is_good(said) ? PERP_OUTCOME_STALLED : said;
}

/* The worse of two outcomes: what a whole is called after its parts. Any that is no answer is worse
 * than any that is, rounding_limit worse than solved; of two failures the first stays. */
static inline perp_outcome perp__worse_outcome(perp_outcome first, perp_outcome second)
{
    if (!perp__is_good(first))
        return first;
    return second == PERP_OUTCOME_SOLVED ? first : second;
}

/* Raises a maximum. Once NaN, always NaN. */
static inline void perp__raise_to(double *largest, double value)
{
    if (!isnan(*largest) && !(value <= *largest))
        *largest = value;
}

/* A residual as it is told: what overflowed on the way is as large as can be. */
static inline double perp__told(double residual)
{
    return isnan(residual) ? INFINITY : residual;
}

/* Whether all entries are finite; x may be NULL where count is 0. Adding one to a biased exponent
 * carries into the sign bit where it is all ones: infinities and NaN. Branch-free, because nearly
 * every array passes. */
static inline bool perp__all_finite(const double *x, size_t count)
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

#endif
