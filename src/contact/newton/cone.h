/* The Lorentz cone K = {x : x_1 >= |(x_2 .. x_d)|} of d = 1, 2 or 3 dimensions and the Jordan
 * algebra whose squares it holds (Faraut & Koranyi, "Analysis on Symmetric Cones", 1994):
 *   x o y = (x'y, x_1 y_t + y_1 x_t),  e = (1, 0, 0),
 * spectral values x_1 -+ |x_t|. For d = 1 it is the half line. A 3 by 3 block is nine doubles,
 * column by column with leading dimension 3. */
#ifndef PERP_CONTACT_CONE_H
#define PERP_CONTACT_CONE_H

#include <stdint.h>

/* The scaling of Nesterov & Todd (SIAM J. Optim. 8 (1998) 324): the symmetric T = eta P(w)^(1/2)
 * with T x = T^-1 z, w of determinant 1. */
typedef struct perp__cone_scaling {
    double w[3];
    double eta;
} perp__cone_scaling;

/* The smaller and the larger spectral value; equal for d = 1. */
void perp__cone_values(int32_t d, const double *x, double *low, double *high);

/* c = a o b. c may not overlap. */
void perp__cone_product(int32_t d, const double *a, const double *b, double *c);

/* c with a o c = b, a inside of K. c may not overlap. */
void perp__cone_divide(int32_t d, const double *a, const double *b, double *c);

/* Returns 0, and leaves T alone, unless x and z lie inside of K. */
int32_t perp__cone_scale(int32_t d, const double *x, const double *z, perp__cone_scaling *T);

/* y = T x and y = T^-1 x. y may be x. */
void perp__cone_apply(int32_t d, const perp__cone_scaling *T, const double *x, double *y);
void perp__cone_apply_inverse(int32_t d, const perp__cone_scaling *T, const double *x, double *y);

/* G = T^2 = eta^2 (2 w w' - diag(1, -1, -1)), so that G x = z. */
void perp__cone_metric(int32_t d, const perp__cone_scaling *T, double *G);

/* The largest a with x + a step in K, x inside of K; may be infinite. */
double perp__cone_step(int32_t d, const double *x, const double *step);

/* p = P(v), the nearest point of K. p may be v. */
void perp__cone_project(int32_t d, const double *v, double *p);

/* The Chen-Harker-Kanzow-Smale smoothing of the projection, spectral values (a + sqrt(a^2 + 4
 * s))/2: p(v) o p(-v) = s e and p(v) - p(-v) = v. */
void perp__cone_smooth(int32_t d, const double *v, double s, double *p);

/* V: an element of the generalised Jacobian of P at v, symmetric with 0 <= V <= I. */
void perp__cone_derivative(int32_t d, const double *v, double *V);

#endif
