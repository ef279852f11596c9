/* Exact sums of products: a fixed-point accumulator as wide as the products of two doubles can be,
 * rounded once when it is read. Integer arithmetic throughout, so that neither valgrind's long
 * double nor flush-to-zero can change a bit. */
#ifndef PERP_TESTS_EXACT_H
#define PERP_TESTS_EXACT_H

#include <stdint.h>

/* Bits of weight 2^-2304 to 2^2175. */
#define CHECK_LIMBS 140

typedef struct check_sum {
    int64_t limb[CHECK_LIMBS];
} check_sum;

void check_sum_clear(check_sum *sum);

/* sum += a * b, exactly. a and b finite. */
void check_sum_add(check_sum *sum, double a, double b);

/* sum * 2^exponent, within two units in the last place; the sum stays. */
double check_sum_value(check_sum *sum, int exponent);

#endif
