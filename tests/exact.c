#include "exact.h"

#include <math.h>
#include <string.h>

/* Limb k holds multiples of 2^(32 k - OFFSET); between normalisations a limb may leave [0,
 * 2^32). */
#define OFFSET 2304
#define LIMB INT64_C(0x100000000)

void check_sum_clear(check_sum *sum)
{
    memset(sum, 0, sizeof *sum);
}

/* limbs += sign * part * 2^position, part < 2^32 */
static void add_part(check_sum *sum, uint64_t part, int position, int64_t sign)
{
    uint64_t shifted = part << (position % 32);
    int k = position / 32;

    sum->limb[k] += sign * (int64_t)(shifted & 0xffffffffu);
    sum->limb[k + 1] += sign * (int64_t)(shifted >> 32);
}

/* |x| = mantissa * 2^exponent, mantissa < 2^53 */
static uint64_t split(double x, int *exponent)
{
    double fraction = frexp(fabs(x), exponent);

    *exponent -= 53;
    return (uint64_t)ldexp(fraction, 53);
}

void check_sum_add(check_sum *sum, double a, double b)
{
    int ea, eb, position;
    uint64_t ma = split(a, &ea), mb = split(b, &eb);
    int64_t sign = (a < 0) != (b < 0) ? -1 : 1;

    if (ma == 0 || mb == 0)
        return;
    position = ea + eb + OFFSET;
    add_part(sum, (ma & 0xffffffffu) * (mb & 0xffffffffu) & 0xffffffffu, position, sign);
    add_part(sum, (ma & 0xffffffffu) * (mb & 0xffffffffu) >> 32, position + 32, sign);
    add_part(sum, (ma >> 32) * (mb & 0xffffffffu) & 0xffffffffu, position + 32, sign);
    add_part(sum, (ma >> 32) * (mb & 0xffffffffu) >> 32, position + 64, sign);
    add_part(sum, (ma & 0xffffffffu) * (mb >> 32) & 0xffffffffu, position + 32, sign);
    add_part(sum, (ma & 0xffffffffu) * (mb >> 32) >> 32, position + 64, sign);
    add_part(sum, (ma >> 32) * (mb >> 32) & 0xffffffffu, position + 64, sign);
    add_part(sum, (ma >> 32) * (mb >> 32) >> 32, position + 96, sign);
}

/* Carries, so that all limbs but the last lie in [0, 2^32). */
static void normalise(check_sum *sum)
{
    int64_t carry = 0;
    int k;

    for (k = 0; k < CHECK_LIMBS; k++) {
        int64_t value = sum->limb[k] + carry;

        carry = 0;
        if (k < CHECK_LIMBS - 1) {
            int64_t rest = value & (LIMB - 1);

            carry = (value - rest) / LIMB;
            value = rest;
        }
        sum->limb[k] = value;
    }
}

double check_sum_value(check_sum *sum, int exponent)
{
    check_sum magnitude;
    double sign = 1.0, value;
    int k;

    normalise(sum);
    magnitude = *sum;
    if (sum->limb[CHECK_LIMBS - 1] < 0) {
        sign = -1.0;
        for (k = 0; k < CHECK_LIMBS; k++)
            magnitude.limb[k] = -magnitude.limb[k];
        normalise(&magnitude);
    }
    for (k = CHECK_LIMBS - 1; k >= 2 && magnitude.limb[k] == 0; k--)
        ;
    value = (double)magnitude.limb[k];
    value = value * 0x1p32 + (double)magnitude.limb[k - 1];
    if (k >= 2) /* always: the two lowest limbs are below any product of doubles */
        value = value * 0x1p32 + (double)magnitude.limb[k - 2];
    return sign * ldexp(value, 32 * (k - 2) - OFFSET + exponent);
}
