/* Running sums with their errors beside them (doubled.c says what they are worth). */
#ifndef PERP_LINALG_DOUBLED_H
#define PERP_LINALG_DOUBLED_H

#include <float.h>
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

/* The same for vectors, in a template (linalg/lanes/vectors.h): h + l + a x, where the product's
 * error is -(ax - a x); and one pair for one value. An error that overflowed, where its sum did
 * not, shows in h. */
#define PERP__ACCUMULATE(h, l, a, x)                                                    \
    do {                                                                                \
        const lanes ax = multiply((a), (x)), to = add((h), ax), by = subtract(to, (h)); \
        const lanes lost = add(subtract((h), subtract(to, by)), subtract(ax, by));      \
        (h) = to;                                                                       \
        (l) = add((l), subtract(lost, minus_fused(ax, (a), (x))));                      \
    } while (0)
#define PERP__JOIN(h, l)                                                                    \
    do {                                                                                    \
        const lanes sum = add((h), (l)), part = subtract(sum, (h)), most = spread(DBL_MAX); \
        const lanes rest = add(subtract((h), subtract(sum, part)), subtract((l), part));    \
        (h) = pick(at_most(absolute(h), most), sum, (h));                                   \
        (l) = pick(at_most(absolute(sum), most), rest, spread(0.0));                        \
    } while (0)

#endif
