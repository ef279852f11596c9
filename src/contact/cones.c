/* Second-order cones K = {z_0 >= |(z_1, z_2)|} with the algebra that belongs to them: Nesterov and
 * Todd's scaling (SIAM J. Optim. 8 (1998) 324), in the form of Andersen, Roos & Terlaky (Math.
 * Program. 95 (2003) 249). Half-lines are cones whose tangents are 0. */
#include "contact/cones.h"

#include <math.h>

#include "linalg/spatial.h"

double perp__cone_room(const double *z)
{
    return z[0] - perp__length2(z[1], z[2]);
}

double perp__cone_det(const double *z)
{
    const double t = perp__length2(z[1], z[2]);

    return fmax(z[0] - t, 0.0) * (z[0] + t);
}

/* H(w) = [w_0 w_t'; w_t I + w_t w_t' / (1 + w_0)], times `factor`. */
static void write_turn(const double *w, double sign, double factor, double *H)
{
    const double t[2] = {sign * w[1], sign * w[2]}, c = 1.0 / (1.0 + w[0]);

    H[0] = factor * w[0];
    H[1] = H[3] = factor * t[0];
    H[2] = H[6] = factor * t[1];
    H[4] = factor * (1.0 + c * t[0] * t[0]);
    H[5] = H[7] = factor * c * t[0] * t[1];
    H[8] = factor * (1.0 + c * t[1] * t[1]);
}

void perp__cone_scale(perp__cone *cone)
{
    const double rz = sqrt(perp__cone_det(cone->z)), ru = sqrt(perp__cone_det(cone->u)),
                 eta = sqrt(ru / rz);
    double z[3], u[3], w[3], gamma = 0.0;

    for (int32_t i = 0; i < 3; i++) {
        z[i] = cone->z[i] / rz;
        u[i] = cone->u[i] / ru;
        gamma += z[i] * u[i];
    }
    gamma = sqrt(0.5 * (1.0 + gamma));
    w[0] = (u[0] + z[0]) / (2.0 * gamma);
    w[1] = (u[1] - z[1]) / (2.0 * gamma);
    w[2] = (u[2] - z[2]) / (2.0 * gamma);
    write_turn(w, 1.0, eta, cone->V);
    write_turn(w, -1.0, 1.0 / eta, cone->inverse);
    perp__apply3(cone->lambda, cone->V, cone->z);
}

double perp__cone_longest(const double *z, const double *dz)
{
    const double a = dz[0] * dz[0] - dz[1] * dz[1] - dz[2] * dz[2];
    const double b = z[0] * dz[0] - z[1] * dz[1] - z[2] * dz[2];
    const double c = perp__cone_det(z), q = b * b - a * c;
    double most = dz[0] < 0.0 ? -z[0] / dz[0] : INFINITY, root;

    /* the roots of a t^2 + 2 b t + c, c > 0 */
    if (q >= 0.0) {
        root = -(b + copysign(sqrt(q), b));
        if (a != 0.0 && root / a > 0.0)
            most = fmin(most, root / a);
        if (root != 0.0 && c / root > 0.0)
            most = fmin(most, c / root);
    }
    return most;
}

/* rc = V lambda^-1 o (target e - lambda o lambda - corrects (V^-1 du) o (V dz)) */
void perp__cone_aim(perp__cone *cone, double target, double corrects)
{
    const double *l = cone->lambda;
    double right[3] = {target, 0.0, 0.0}, a[3], b[3], det = perp__cone_det(l), out[3];

    right[0] -= l[0] * l[0] + l[1] * l[1] + l[2] * l[2];
    right[1] -= 2.0 * l[0] * l[1];
    right[2] -= 2.0 * l[0] * l[2];
    if (corrects > 0.0) {
        perp__apply3(a, cone->inverse, cone->du);
        perp__apply3(b, cone->V, cone->dz);
        right[0] -= corrects * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
        right[1] -= corrects * (a[0] * b[1] + b[0] * a[1]);
        right[2] -= corrects * (a[0] * b[2] + b[0] * a[2]);
    }
    out[0] = (l[0] * right[0] - l[1] * right[1] - l[2] * right[2]) / det;
    out[1] = (right[1] - out[0] * l[1]) / l[0];
    out[2] = (right[2] - out[0] * l[2]) / l[0];
    perp__apply3(cone->rc, cone->V, out);
}
