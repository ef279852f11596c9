#include "lcp/fischer/function.h"

#include <math.h>

/* For a + b > 0 the sum and the root cancel:
 *   a + b - r = 2ab / (a + b + r) = min * (2 max / (a + b + r)),   r = hypot(a, b),
 * where the factor lies in [0.585, 1.415]: nothing can overflow or underflow on the way. It is
 * computed as 2 / (1 + b/a + r/a) so that it serves up to the largest numbers too. */
static double plain(double a, double b)
{
    double most = a > b ? a : b;
    double least = a > b ? b : a;
    double ratio;

    if (!(a + b > 0.0))
        return (a + b) - hypot(a, b);
    ratio = least / most;
    return least * (2.0 / (1.0 + ratio + hypot(1.0, ratio)));
}

/* The smoothed root is longer by mu^2 / (both roots). */
static double fischer(double a, double b, double mu)
{
    const double r = hypot(a, b);

    if (isinf(a) || isinf(b))
        return a > b ? b : a;
    return plain(a, b) - (mu > 0.0 ? mu * (mu / (r + hypot(r, mu))) : 0.0);
}

/* 1 - x/r with r = hypot(x, y): y^2 / (r (r + x)) for x > 0, where the two cancel. */
static double one_minus_cosine(double x, double y, double r)
{
    return x > 0.0 ? (y / r) * (y / (r + x)) : 1.0 - x / r;
}

/* The derivatives of phi, in the names of a perp__slopes z for a and w for b. At the kink a = b = 0
 * they are the limits along the direction (a', b'), which makes them an element of the
 * B-subdifferential (De Luca, Facchinei & Kanzow 1996, procedure in section 7). */
static perp__slopes fischer_slopes(double a, double b, double along_a, double along_b, double mu)
{
    perp__slopes slopes;
    double scale, r;

    if (isinf(a) || isinf(b))
        return (perp__slopes){isinf(a) ? 0.0 : 1.0, isinf(a) ? 1.0 : 0.0};
    if (a == 0.0 && b == 0.0 && mu == 0.0) {
        a = along_a;
        b = along_b;
    }
    scale = fmax(fmax(fabs(a), fabs(b)), mu);
    if (!(scale > 0.0) || isinf(scale)) { /* no direction: the symmetric element */
        a = b = scale = 1.0;
    }
    a /= scale;
    b /= scale;
    mu /= scale;
    r = hypot(hypot(a, b), mu);
    slopes.z = one_minus_cosine(a, hypot(b, mu), r);
    slopes.w = one_minus_cosine(b, hypot(a, mu), r);
    return slopes;
}

/* The product's part counts. A bound that is infinite for the arithmetic has none. */
static int is_inside(double a, double b)
{
    return a > 0.0 && b > 0.0 && !isinf(a) && !isinf(b);
}

static double penalised(double a, double b, double penalty, double mu)
{
    return (1.0 - penalty) * fischer(a, b, mu) + (is_inside(a, b) ? penalty * a * b : 0.0);
}

static perp__slopes penalised_slopes(double a, double b, double along_a, double along_b,
                                     double penalty, double mu)
{
    perp__slopes slopes = fischer_slopes(a, b, along_a, along_b, mu);

    slopes.z *= 1.0 - penalty;
    slopes.w *= 1.0 - penalty;
    /* the product has kinks of its own where a or b is 0 */
    if (is_inside(a == 0.0 ? along_a : a, b == 0.0 ? along_b : b)) {
        slopes.z += penalty * b;
        slopes.w += penalty * a;
    }
    return slopes;
}

double perp__fischer_bounded(double z, double lower, double upper, double w, double penalty,
                             double mu)
{
    double v;

    if (!(lower < upper))
        return 0.0;
    if (isinf(lower) && isinf(upper))
        return w;
    v = isinf(upper) ? w : -penalised(upper - z, -w, penalty, mu);
    return isinf(lower) ? v : penalised(z - lower, v, penalty, mu);
}

perp__slopes perp__fischer_bounded_slopes(double z, double lower, double upper, double w,
                                          double along_z, double along_w, double penalty, double mu)
{
    perp__slopes fixed = {1.0, 0.0}, inner = {0.0, 1.0}, outer;
    double v = w;

    if (!(lower < upper))
        return fixed;
    if (!isinf(upper)) { /* v = -phi(u - z, -w): v_z = phi_a, v_w = phi_b */
        v = -penalised(upper - z, -w, penalty, mu);
        inner = penalised_slopes(upper - z, -w, -along_z, -along_w, penalty, mu);
    }
    if (isinf(lower))
        return inner;
    outer =
        penalised_slopes(z - lower, v, along_z, inner.z * along_z + inner.w * along_w, penalty, mu);
    outer.z += outer.w * inner.z;
    outer.w *= inner.w;
    return outer;
}

int perp__fischer_at_kink(double z, double lower, double upper, double w)
{
    return w == 0.0 && lower < upper && (z == lower || z == upper);
}
