/* The steps of local.c for inlining into sweeps: turned frame throughout. */
#ifndef PERP_CONTACT_LOCAL_STEP_H
#define PERP_CONTACT_LOCAL_STEP_H

#include <float.h>
#include <math.h>

#include <perp/contact.h>

#include "contact/sweep/sweep.h"
#include "linalg/lanes/multiversion.h"

/* Newton's method, near: the next step squares this error. */
#define PERP__SLIP_NEAR 1e-4
#define PERP__SLIP_NEAR_STEPS 4

/* r_t = -c / (s + l) with |r_t| = mu r_n, r_n = z - a'r_t, given that l = 0 asks for more friction
 * than there is, mu > 0 and z > 0. Returns r_n; r: r_t. The last l is the start. */
PERP__KERNEL static double perp__slip(perp__local *local, double z, const double *c, double *r)
{
    const double mu = local->mu, *a = local->a, *s = local->s;
    const double size = sqrt(c[0] * c[0] + c[1] * c[1]);
    const double coupling = mu * (fabs(a[0]) + fabs(a[1]));
    const double ratio = size / (mu * z);
    double low = ratio * (1.0 - coupling) - fmax(s[0], s[1]);
    double high = ratio * (1.0 + coupling) - fmin(s[0], s[1]);
    double x = local->slip, normal, length, scale;

    low = low > 0.0 ? low : 0.0;
    high = high > low ? high : low + ratio;
    if (!(x >= low && x <= high))
        x = 0.5 * (low + high);
    for (int32_t step = 0;; step++) {
        const double i0 = 1.0 / (s[0] + x), i1 = 1.0 / (s[1] + x);
        double slope, excess, next;

        r[0] = -c[0] * i0;
        r[1] = -c[1] * i1;
        length = sqrt(r[0] * r[0] + r[1] * r[1]);
        normal = z - (a[0] * r[0] + a[1] * r[1]);
        excess = mu * normal - length;
        if (fabs(excess) <= 2.0 * DBL_EPSILON * (length + mu * z) || step == 2 * DBL_MANT_DIG)
            break;
        if (excess < 0.0)
            low = x;
        else
            high = x;
        slope = mu * (a[0] * r[0] * i0 + a[1] * r[1] * i1 +
                      normal * (r[0] * r[0] * i0 + r[1] * r[1] * i1) / (length * length));
        next = x - excess / slope;
        if (!(next > low && next < high))
            next = 0.5 * (low + high);
        if (next == x || fabs(next - x) <= 2e-16 * x)
            break;
        x = next;
    }
    local->slip = x;
    if (!(normal > 0.0))
        normal = 0.0;
    scale = length > 0.0 ? mu * normal / length : 0.0; /* onto the cone to rounding */
    r[0] *= scale;
    r[1] *= scale;
    if (!(fabs(r[0]) + fabs(r[1]) < INFINITY)) /* numbers near the limits */
        r[0] = r[1] = 0.0;
    return normal < INFINITY ? normal : 0.0;
}

/* The same from a multiplier near the root, with Newton's method alone. Returns 0, and r of no
 * account, where a few steps don't end at a root at which the function rises. */
PERP__KERNEL static bool perp__slip_near(perp__local *local, double z, const double *c, double *r)
{
    const double mu = local->mu, *a = local->a, *s = local->s;
    double x = local->slip;

    for (int32_t step = 0; step < PERP__SLIP_NEAR_STEPS && x > 0.0; step++) {
        const double p = s[0] + x, q = s[1] + x, inverse = 1.0 / (p * q);
        const double i0 = q * inverse, i1 = p * inverse;
        const double r0 = -c[0] * i0, r1 = -c[1] * i1;
        const double square = r0 * r0 + r1 * r1, length = sqrt(square);
        const double n = z - (a[0] * r0 + a[1] * r1), excess = mu * n - length;
        const double slope =
            mu * ((a[0] * r0 * i0 + a[1] * r1 * i1) * square + n * (r0 * r0 * i0 + r1 * r1 * i1));
        const double move = excess * square / slope;

        if (!(slope > 0.0))
            return 0;
        x -= move;
        if (fabs(excess) <= PERP__SLIP_NEAR * length) { /* r follows to second order */
            r[1] = r0 + r0 * (i0 * move);
            r[2] = r1 + r1 * (i1 * move);
            r[0] = z - (a[0] * r[1] + a[1] * r[2]);
            local->slip = x;
            return r[0] > 0.0 && x > 0.0;
        }
    }
    return 0;
}

PERP__KERNEL static int32_t perp__step_3(perp__local *local, const double *u, double *r)
{
    const double *a = local->a, *s = local->s;
    const double z = r[0] + (a[0] * r[1] + a[1] * r[2]) - u[0] * local->inverse_normal;
    const double c0 = u[1] - a[0] * u[0], c1 = u[2] - a[1] * u[0];
    double t0, t1, normal, c[2];

    if (!(z > 0.0)) {
        r[0] = r[1] = r[2] = 0.0;
        return PERP_CONTACT_SEPARATE;
    }
    t0 = r[1] - c0 * local->inverse_s[0];
    t1 = r[2] - c1 * local->inverse_s[1];
    normal = z - (a[0] * t0 + a[1] * t1);
    if (normal >= 0.0 && t0 * t0 + t1 * t1 <= (local->mu * normal) * (local->mu * normal)) {
        r[0] = normal;
        r[1] = t0;
        r[2] = t1;
        return PERP_CONTACT_STICK;
    }
    if (!(local->mu > 0.0)) {
        r[0] = z;
        r[1] = r[2] = 0.0;
        return PERP_CONTACT_SLIP;
    }
    c[0] = c0 - s[0] * r[1];
    c[1] = c1 - s[1] * r[2];
    if (perp__slip_near(local, z, c, r))
        return PERP_CONTACT_SLIP;
    r[0] = perp__slip(local, z, c, r + 1);
    return PERP_CONTACT_SLIP;
}

/* In the plane the slip is linear: |r_t| = mu (z - a r_t). */
PERP__KERNEL static int32_t perp__step_2(const perp__local *local, const double *u, double *r)
{
    const double a = local->a[0], mu = local->mu;
    const double z = r[0] + a * r[1] - u[0] * local->inverse_normal;
    double t, normal;

    if (!(z > 0.0)) {
        r[0] = r[1] = 0.0;
        return PERP_CONTACT_SEPARATE;
    }
    t = r[1] - (u[1] - a * u[0]) * local->inverse_s[0];
    normal = z - a * t;
    if (normal >= 0.0 && fabs(t) <= mu * normal) {
        r[0] = normal;
        r[1] = t;
        return PERP_CONTACT_STICK;
    }
    /* sticking asks for |t| (1 + mu a sign t) > mu z > 0, so the factor is positive */
    r[1] = t > 0.0 ? mu * z / (1.0 + mu * a) : -mu * z / (1.0 - mu * a);
    r[0] = mu > 0.0 ? fabs(r[1]) / mu : z;
    return PERP_CONTACT_SLIP;
}

#endif
