/* One contact that holds both ways by itself, exactly: u_N = 0, and r_t against |r_N|.
 *
 * With the normals eliminated, r_N = n - A r_t and u_t = S r_t + c,
 *   r_t = -S^-1 c         in its disc |r_t| <= mu |r_N| (stick);
 *   r_t = -(S + l)^-1 c,  |r_t| = mu |n - A r_t|, l > 0 (slip: u_t = -l r_t).
 * Where sticking fails the last has a root: it asks for more friction than there is at l = 0, and
 * for less as l grows. With one tangent it is a quadratic in r_t. Where friction and coupling are
 * so large that there are several answers, sticking comes first, then the slip that a growing
 * friction comes to first. */
#ifndef PERP_CONTACT_SWEEP_TWO_SIDED_H
#define PERP_CONTACT_SWEEP_TWO_SIDED_H

#include <perp/base.h>

enum { PERP__NORMALS_MOST = 3, PERP__TANGENTS_MOST = 2 };

typedef struct perp__two_sided {
    int32_t normals, tangents;
    double mu;
    double inverse[PERP__NORMALS_MOST][PERP__NORMALS_MOST]; /* W_NN^-1 */
    double A[PERP__NORMALS_MOST][PERP__TANGENTS_MOST];      /* W_NN^-1 W_Nt */
    double S[PERP__TANGENTS_MOST][PERP__TANGENTS_MOST];     /* W_tt - W_tN A */
} perp__two_sided;

/* Reads the symmetric part of W_kk, row-major. Pivots that are no more than rounding are lifted. */
void perp__two_sided_make(perp__two_sided *p, int32_t normals, int32_t tangents, const double *W,
                          double mu);

/* r := the solution for b = u - W_kk r, with the r given. Returns PERP_CONTACT_STICK or _SLIP. */
int32_t perp__two_sided_step(const perp__two_sided *p, const double *u, double *r);

#endif
