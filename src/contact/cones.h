/* Second-order cones K = {z_0 >= |(z_1, z_2)|} and the steps of interior point methods in them, for
 * statics and for proximal's start. Half-lines are cones whose tangents are 0. */
#ifndef PERP_CONTACT_CONES_H
#define PERP_CONTACT_CONES_H

#include <stdint.h>

/* A second-order cone of 1, 2 or 3 coordinates, of one unit: z = B x + h - s e in K, with its dual
 * u. B takes the unit's normal times `sign` and the tangents from `first` on times `scale`. */
typedef struct perp__cone {
    int32_t unit, first, dim;
    double sign, scale, h, e, z[3], u[3], dz[3], du[3];
    double V[9], inverse[9]; /* Nesterov and Todd's scaling: V z = V^-1 u = lambda; G = V V */
    double lambda[3], rc[3];
} perp__cone;

/* The share of the way to the boundary that a step goes. */
#define PERP__CONE_REACH 0.99

void perp__cone_scale(perp__cone *cone);
/* z_0 - |z_t|: how far inside; and z_0^2 - |z_t|^2, without cancellation. */
double perp__cone_room(const double *z);
double perp__cone_det(const double *z);
/* The largest step with z + step dz in K; INFINITY where all are. */
double perp__cone_longest(const double *z, const double *dz);
/* rc := what complementarity asks for, of du + V V dz = rc: lambda o lambda -> target, with
 * `corrects` times the second-order part of the step that z and u were going to make. */
void perp__cone_aim(perp__cone *cone, double target, double corrects);

#endif
