/* One contact by itself, exactly: r in K and u = W_kk r + b obey Signorini's and Coulomb's laws.
 *
 * With the normal impulse eliminated, r_n = z - a'r_t, z = -b_n / W_nn, a = W_tn / W_nn, and the
 * tangents turned so that the Schur complement W_tt - W_tn W_nt / W_nn is diag(s):
 *   b_n >= 0:             r = 0 (take-off);
 *   r_t = -c / s          in its disc |r_t| <= mu r_n (stick), c = b_t - a b_n;
 *   r_t = -c / (s + l),   |r_t| = mu r_n, l > 0 (slip: u_t = -l r_t, u_n = 0).
 * The last equation is a quartic in the slip multiplier l. It is solved by Newton's method on
 * mu r_n / |r_t| - 1, nearly linear in l, inside of a bracket that always exists: the function is
 * negative at l = 0, where sticking failed, and positive for large l. Where friction and coupling
 * are so large that there are several solutions, r = 0 is taken before any other, sticking before
 * slipping, and of several slips one at which the function rises. (Quartic: Bonnefon & Daviet,
 * INRIA 2011; secular equations: Conn, Gould & Toint, Trust-Region Methods, 2000, chapter 7.) */
#ifndef PERP_CONTACT_LOCAL_H
#define PERP_CONTACT_LOCAL_H

#include <perp/base.h>

/* Everything in the turned frame: t = (c t1 + s t2, -s t1 + c t2) of the caller's. */
typedef struct perp__local {
    double inverse_normal; /* 1 / W_nn */
    double a[2];
    double s[2], inverse_s[2];
    double mu;
    double slip; /* the last multiplier: where the next search begins */
    double turn[2];
    int32_t dim;
} perp__local;

/* Reads the symmetric part of W_kk, dim by dim (1, 2 or 3), row-major with that stride. A diagonal
 * that is zero or negative, which no symmetric positive definite W has, is lifted to 1e-14 of the
 * trace. */
void perp__local_make(perp__local *local, int32_t dim, const double *W, int32_t stride, double mu);

/* A disc |r| <= radius of 1 or 2 rows, opposed to u: reads W the same way. */
void perp__local_make_disc(perp__local *local, int32_t dim, const double *W, int32_t stride);

/* r := the solution for b = u - W_kk r, with the r given. Returns PERP_CONTACT_SEPARATE (0), STICK
 * (1) or SLIP (2). Caller's frame. */
int32_t perp__local_step(perp__local *local, const double *u, double *r);

/* The same for a disc; returns STICK or SLIP. */
int32_t perp__local_step_disc(perp__local *local, double radius, const double *u, double *r);

#endif
