/* Three-vectors and placements, for the shape pairs. Sums of three run in index order. */
#ifndef PERP_WORLD_COLLIDE_VECTOR_H
#define PERP_WORLD_COLLIDE_VECTOR_H

#include <math.h>

#include "world/collide/collide.h"

static inline double perp__vector_dot(const double *x, const double *y)
{
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}

static inline void perp__vector_subtract(double *z, const double *x, const double *y)
{
    for (int k = 0; k < 3; k++)
        z[k] = x[k] - y[k];
}

/* z = x + s y */
static inline void perp__vector_add(double *z, const double *x, double s, const double *y)
{
    for (int k = 0; k < 3; k++)
        z[k] = x[k] + s * y[k];
}

static inline double perp__vector_largest(const double *x)
{
    return fmax(fmax(fabs(x[0]), fabs(x[1])), fabs(x[2]));
}

/* Scales x to length 1 and returns its length; a zero vector is left alone. The power of two taken
 * out first keeps the squares in range whatever the units. */
static inline double perp__vector_normalise(double *x)
{
    double largest = perp__vector_largest(x);
    if (!(largest > 0.0))
        return 0.0;
    int exponent;
    frexp(largest, &exponent);
    double scaled[3];
    for (int k = 0; k < 3; k++)
        scaled[k] = ldexp(x[k], -exponent);
    double length = sqrt(perp__vector_dot(scaled, scaled));
    for (int k = 0; k < 3; k++)
        x[k] = scaled[k] / length;
    return ldexp(length, exponent);
}

/* z = R x, R row by row */
static inline void perp__vector_rotate(double *z, const double *R, const double *x)
{
    for (int k = 0; k < 3; k++)
        z[k] = perp__vector_dot(R + 3 * k, x);
}

/* z = R' x */
static inline void perp__vector_rotate_back(double *z, const double *R, const double *x)
{
    for (int k = 0; k < 3; k++)
        z[k] = R[k] * x[0] + R[3 + k] * x[1] + R[6 + k] * x[2];
}

/* Axis j of a placed shape, in the world. */
static inline void perp__vector_axis(double *z, const double *R, int j)
{
    for (int k = 0; k < 3; k++)
        z[k] = R[3 * k + j];
}

#endif
