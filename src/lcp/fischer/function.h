/* The Fischer-Burmeister function, safe at the extremes, and its composition for variables with
 * bounds. */
#ifndef PERP_LCP_FISCHER_FUNCTION_H
#define PERP_LCP_FISCHER_FUNCTION_H

#include <stdint.h>

/* Partial derivatives; both in [0, 2] for phi, >= 0 for the composition. */
typedef struct perp__slopes {
    double z, w;
} perp__slopes;

/* phi(a, b) = a + b - sqrt(a^2 + b^2): zero exactly where a >= 0, b >= 0, ab = 0, and with the sign
 * of min(a, b). (Most papers have -phi.) Full relative accuracy unless the result is subnormal;
 * a or b may be +inf. Chen, Chen & Kanzow (2000) add a penalty p in [0, 1) where both are positive:
 * phi_p(a, b) = (1 - p) phi(a, b) + p max(a, 0) max(b, 0). Smoothed by mu > 0 (Kanzow, "Some
 * noninterior continuation methods for linear complementarity problems", SIAM J. Matrix Anal. 17
 * (1996) 851) the root is that of a^2 + b^2 + mu^2: without the penalty zero where a > 0, b > 0, ab
 * = mu^2 / 2.
 *
 * Billups (1995) for l <= z <= u: phi(z - l, w), -phi(u - z, -w), phi(z - l, -phi(u - z, -w)) or w,
 * whichever the finite bounds ask for, phi being phi_p; 0 where l = u. Zero exactly where
 * mid(z - l, z - u, w) is. */
double perp__fischer_bounded(double z, double lower, double upper, double w, double penalty,
                             double mu);

/* Its derivatives by z and w; at kinks the limits along (along_z, along_w). Where l = u they are
 * (1, 0): the row of the Newton system then says that z stays. */
perp__slopes perp__fischer_bounded_slopes(double z, double lower, double upper, double w,
                                          double along_z, double along_w, double penalty,
                                          double mu);

/* True if (z, w) is at a kink. */
int perp__fischer_at_kink(double z, double lower, double upper, double w);

#endif
