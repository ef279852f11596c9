/* The verdict: bounds and signs against the enclosure. */
#include <math.h>

#include "lcp/claims/verify.h"

/* What is known of the sign of a number within `width` of x: nothing where either overflowed. */
static int32_t sign_of(double x, double width)
{
    if (!isfinite(width))
        return 0;
    return x >= width ? 1 : x < -width ? -1 : 0;
}

/* Where z_i - bound stands, in the direction that leads inside: proved to be above 0 (1), below 0
 * (-1), or neither (0). */
static int32_t side_of(const perp__verify *v, int32_t i, double bound, double direction)
{
    const double distance = direction * (v->high[i] - bound);
    const double low = direction * v->low[i];
    const double width = perp__raise(
        v->delta[i] + PERP__GAMMA(4.0) * (fabs(distance) + fabs(low)) + 4.0 * DBL_MIN, 4.0);

    if (distance + low > width)
        return 1;
    return distance + low < -width ? -1 : 0;
}

static int32_t judge_row(const perp__verify *v, int32_t i)
{
    const double width = perp__raise(v->width[i] + v->spread[i], 4.0);
    int32_t above, below;

    if (v->places[i] == PERP__FIXED)
        return 1;
    if (v->places[i] == PERP__AT_LOWER)
        return sign_of(v->w[i], width);
    if (v->places[i] == PERP__AT_UPPER)
        return sign_of(-v->w[i], width);
    above = v->lower[i] > -INFINITY ? side_of(v, i, v->lower[i], 1.0) : 1;
    below = v->upper[i] < INFINITY ? side_of(v, i, v->upper[i], -1.0) : 1;
    return above < below ? above : below;
}

int32_t perp__verify_judge(const perp__verify *v, int32_t *index)
{
    int32_t verdict = PERP_VERDICT_REGULAR, i;

    *index = -1;
    for (i = 0; i < v->n; i++) {
        const int32_t row = judge_row(v, i);

        if (row < 0) {
            *index = i;
            return PERP_VERDICT_NOT_A_SOLUTION;
        }
        if (row == 0 && verdict == PERP_VERDICT_REGULAR) {
            *index = i;
            verdict = PERP_VERDICT_DEGENERATE;
        }
    }
    return verdict;
}

double perp__verify_radius(const perp__verify *v, int32_t i)
{
    const double z = v->z_caller[i];
    double bound, radius;

    if (v->places[i] != PERP__BETWEEN) {
        bound = v->places[i] == PERP__AT_UPPER ? v->upper_caller[i]
                : v->lower_caller              ? v->lower_caller[i]
                                               : 0.0;
        if (perp__is_same(z, bound))
            return 0.0;
        return perp__raise(fabs(z - bound) + DBL_MIN, 2.0);
    }
    radius = perp__raise(fabs(v->z[i] - v->high[i]) + fabs(v->low[i]) + v->delta[i] + 4.0 * DBL_MIN,
                         4.0);
    return perp__raise(ldexp(radius, v->exponents[i] + v->omega) + DBL_MIN, 2.0);
}
