/* Running sums with their errors beside them (doubled.c says what they are worth). */
#ifndef PERP_LINALG_DOUBLED_H
#define PERP_LINALG_DOUBLED_H

#include <math.h>

#include "linalg/lanes/multiversion.h"

/* high + low += a x */
PERP__KERNEL static void perp__accumulate(double *high, double *low, double a, double x)
{
    const double product = a * x;
    const double product_error = fma(a, x, -product);
    const double sum = *high + product;
    const double part = sum - *high;
    const double sum_error = (*high - (sum - part)) + (product - part);

    *high = sum;
    *low += sum_error + product_error;
}

/* high := high + low, rounded; low := what that lost. */
PERP__KERNEL static void perp__round_sum(double *high, double *low)
{
    const double sum = *high, total = sum + *low;

    *high = total;
    *low = isfinite(total) ? *low - (total - sum) : 0.0;
}

#endif
