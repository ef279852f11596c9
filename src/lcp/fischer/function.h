/* The Fischer-Burmeister function, safe at the extremes, and its composition for variables with
 * bounds. */
#ifndef PERP_LCP_FISCHER_FUNCTION_H
#define PERP_LCP_FISCHER_FUNCTION_H

#include "linalg/matrix.h"

/* Of searches along a line: Armijo's share of what the slope promises, the values of Psi that a
 * nonmonotone one looks back on, halvings, and what counts as progress: a tenth less. */
#define PERP__ARMIJO 1e-4
#define PERP__MEMORY 8
#define PERP__HALVINGS 40
#define PERP__PROGRESS 0.9

/* Full steps that a watch allows to let Psi grow, and by how much, before it goes back. */
#define PERP__WATCH 5
#define PERP__WATCH_GROWTH 1e4

/* The first rho that is not 0, of a unit diagonal, and from one rho or mu to the next. On the path
 * mu falls where |Phi| <= PERP__FISCHER_NEAR mu. Starts of one problem, the second of them the
 * path. */
#define PERP__FISCHER_SHARE 0.1
#define PERP__FISCHER_NEAR 3.0
#define PERP__FISCHER_STARTS 5

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

/* ---- the rows of a problem, in the notation of De Luca, Facchinei & Kanzow (1996): F has the
 * derivative S, Phi_i = phi of row i, Psi = 1/2 |Phi|^2, H = D_z + D_w S ---- */

typedef struct perp__fischer_point {
    int32_t n;
    const double *z, *w, *lower, *upper;
    double penalty, smoothing;
} perp__fischer_point;

/* phi := Phi; returns Psi. */
double perp__fischer_merit(const perp__fischer_point *point, double *phi);

/* D_z and D_w, in the B-subdifferential. kink_z, kink_w: n of work each. */
void perp__fischer_slopes(const perp__fischer_point *point, const perp__matrix *S, double *kink_z,
                          double *kink_w, double *slope_z, double *slope_w);

/* d, the gradient of Psi or as much of it as may be used, becomes -t d with the t that minimises
 * |Phi + H d|, and image S d. Returns d' grad Psi, 0 where there is no such t. */
double perp__fischer_descent(const perp__matrix *S, const double *slope_z, const double *slope_w,
                             double *d, double *image);

/* What a run had come to when its residual or Psi had last fallen by a quarter; begins with
 * {INFINITY, INFINITY, 0}. Returns 1 if that is too many steps ago. */
typedef struct perp__fischer_progress {
    double residual, psi;
    int64_t steps;
} perp__fischer_progress;
int perp__fischer_creeps(perp__fischer_progress *last, perp__fischer_progress now);

#endif
