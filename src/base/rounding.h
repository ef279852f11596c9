/* What rounding leaves: the two shares that all layers mean by it. */
#ifndef PERP_BASE_ROUNDING_H
#define PERP_BASE_ROUNDING_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* A backward error that no double betters by more than a constant: each product and sum of a row
 * rounds once, and refinement with doubled residuals ends within a few units of that. So much of
 * the largest of a few terms may stand where their sum is 0. */
#define PERP__ROUNDING_LIMIT (16.0 * DBL_EPSILON)

/* The same of the terms of a sum that is made of such sums: velocities of points of turned bodies,
 * differences of coordinates, energies. */
#define PERP__SUM_ROUNDING (64.0 * DBL_EPSILON)

/* The step of differences whose error is of the order `power` - 1 in it, beside the argument: a
 * power of two near eps^(1/power), where truncation and rounding balance. */
static inline double perp__difference_step(int32_t power)
{
    return ldexp(1.0, -(DBL_MANT_DIG - 1) / power);
}

/* Times the error that differences tell of themselves: what a derivative is judged by. Estimates
 * are off by less in tests/ncp/test_check and tests/mechanism/test_check. */
#define PERP__CERTAIN 8.0

#endif
