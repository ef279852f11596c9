/* Vectors of three, rotations and unit quaternions (w,x,y,z). Matrices are 3 by 3, row by row. Sums
 * of three run in index order. */
#ifndef PERP_LINALG_SPATIAL_H
#define PERP_LINALG_SPATIAL_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#define PERP__PI 3.14159265358979323846

/* Of a polygon in the place of a disc. */
enum { PERP__MOST_EDGES = 1024 };

/* Of two numbers; b where one is none. In line, which fmin and fmax are not. */
static inline double perp__lesser(double a, double b)
{
    return a < b ? a : b;
}

static inline double perp__greater(double a, double b)
{
    return a > b ? a : b;
}

static inline double perp__dot3(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Neither overflows nor loses small numbers where a sum of squares would. */
static inline double perp__length2(double a, double b)
{
    const double square = a * a + b * b;

    return (square > 1e-280 && square < 1e280) || (a == 0.0 && b == 0.0) ? sqrt(square)
                                                                         : hypot(a, b);
}

static inline double perp__length3(const double *a)
{
    const double square = perp__dot3(a, a);

    if (square > 1e-280 && square < 1e280)
        return sqrt(square);
    if (a[0] == 0.0 && a[1] == 0.0 && a[2] == 0.0)
        return 0.0;
    return hypot(hypot(a[0], a[1]), a[2]);
}

static inline void perp__copy3(double *to, const double *from)
{
    to[0] = from[0];
    to[1] = from[1];
    to[2] = from[2];
}

static inline double perp__largest3(const double *a)
{
    return perp__greater(fabs(a[2]), perp__greater(fabs(a[1]), perp__greater(fabs(a[0]), 0.0)));
}

/* Scales x to length 1 and returns its length; a zero vector is left alone. The power of two taken
 * out first keeps the squares in range whatever the units. */
static inline double perp__normalise3(double *x)
{
    const double largest = perp__largest3(x), square = perp__dot3(x, x);
    double scaled[3], length;
    int exponent;

    if (square > 1e-280 && square < 1e280) { /* the bits of the scaled ones */
        length = sqrt(square);
        for (int32_t k = 0; k < 3; k++)
            x[k] /= length;
        return length;
    }
    if (!(largest > 0.0))
        return 0.0;
    frexp(largest, &exponent);
    for (int32_t k = 0; k < 3; k++)
        scaled[k] = ldexp(x[k], -exponent);
    length = sqrt(perp__dot3(scaled, scaled));
    for (int32_t k = 0; k < 3; k++)
        x[k] = scaled[k] / length;
    return ldexp(length, exponent);
}

/* z = x - y */
static inline void perp__subtract3(double *z, const double *x, const double *y)
{
    z[0] = x[0] - y[0];
    z[1] = x[1] - y[1];
    z[2] = x[2] - y[2];
}

/* z = x + s y */
static inline void perp__along3(double *z, const double *x, double s, const double *y)
{
    z[0] = x[0] + s * y[0];
    z[1] = x[1] + s * y[1];
    z[2] = x[2] + s * y[2];
}

/* y += s x */
static inline void perp__add3(double *y, double s, const double *x)
{
    y[0] += s * x[0];
    y[1] += s * x[1];
    y[2] += s * x[2];
}

static inline bool perp__is_zero3(const double *a)
{
    return a[0] == 0.0 && a[1] == 0.0 && a[2] == 0.0;
}

static inline bool perp__is_finite3(const double *a)
{
    return 0.0 * a[0] + 0.0 * a[1] + 0.0 * a[2] == 0.0;
}

/* c = a x b; c may not overlap a or b. */
static inline void perp__cross(double *c, const double *a, const double *b)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* y = A x; y may not overlap x. */
static inline void perp__apply3(double *y, const double *A, const double *x)
{
    y[0] = perp__dot3(A, x);
    y[1] = perp__dot3(A + 3, x);
    y[2] = perp__dot3(A + 6, x);
}

/* y = A' x; y may not overlap x. */
static inline void perp__apply_transposed3(double *y, const double *A, const double *x)
{
    y[0] = A[0] * x[0] + A[3] * x[1] + A[6] * x[2];
    y[1] = A[1] * x[0] + A[4] * x[1] + A[7] * x[2];
    y[2] = A[2] * x[0] + A[5] * x[1] + A[8] * x[2];
}

/* C = A B; C may not overlap A or B. */
static inline void perp__multiply3(double *C, const double *A, const double *B)
{
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++)
            C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

/* C = A B'; C may not overlap A or B. */
static inline void perp__multiply_transposed3(double *C, const double *A, const double *B)
{
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++)
            C[3 * i + j] = perp__dot3(A + 3 * i, B + 3 * j);
}

/* Rotation matrix of a unit quaternion. */
static inline void perp__quaternion_matrix(double *R, const double *q)
{
    double w = q[0], x = q[1], y = q[2], z = q[3];

    R[0] = 1.0 - 2.0 * (y * y + z * z);
    R[1] = 2.0 * (x * y - w * z);
    R[2] = 2.0 * (x * z + w * y);
    R[3] = 2.0 * (x * y + w * z);
    R[4] = 1.0 - 2.0 * (x * x + z * z);
    R[5] = 2.0 * (y * z - w * x);
    R[6] = 2.0 * (x * z - w * y);
    R[7] = 2.0 * (y * z + w * x);
    R[8] = 1.0 - 2.0 * (x * x + y * y);
}

/* p = a b; p may not overlap a or b. */
static inline void perp__quaternion_product(double *p, const double *a, const double *b)
{
    p[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    p[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    p[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    p[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

static inline double perp__quaternion_norm(const double *q)
{
    return perp__length2(perp__length2(q[0], q[1]), perp__length2(q[2], q[3]));
}

static inline void perp__quaternion_normalise(double *q)
{
    double norm = perp__quaternion_norm(q);

    for (int32_t i = 0; i < 4; i++)
        q[i] /= norm;
}

/* Quaternion of the rotation by the vector `turn` (axis times angle): the exponential map. */
static inline void perp__quaternion_exponential(double *q, const double *turn)
{
    const double angle = perp__length3(turn);
    const bool small = angle < 0x1p-27; /* cos x = 1 and sin x = x then, rounded */
    const double ratio = small ? 0.5 : sin(0.5 * angle) / angle; /* sin(angle/2) / angle */

    q[0] = small ? 1.0 : cos(0.5 * angle);
    q[1] = ratio * turn[0];
    q[2] = ratio * turn[1];
    q[3] = ratio * turn[2];
}

/* The rotation by the vector `turn`. */
static inline void perp__turn_matrix(double *R, const double *turn)
{
    double q[4];

    perp__quaternion_exponential(q, turn);
    perp__quaternion_matrix(R, q);
}

/* turn := that of the rotation by `turn` and then by `next`; of its angles, 2 pi apart, the one
 * nearest to that of their sum. */
static inline void perp__add_turn(double *turn, const double *next)
{
    const double sum[3] = {turn[0] + next[0], turn[1] + next[1], turn[2] + next[2]};
    const double round = 6.283185307179586;
    double first[4], then[4], q[4], size, angle;

    if (perp__is_zero3(next))
        return;
    perp__quaternion_exponential(first, turn);
    perp__quaternion_exponential(then, next);
    perp__quaternion_product(q, then, first);
    size = perp__length3(q + 1);
    if (perp__is_zero3(turn) || size == 0.0) {
        perp__copy3(turn, sum);
        return;
    }
    angle = 2.0 * atan2(size, q[0]);
    angle += round * nearbyint((perp__dot3(sum, q + 1) / size - angle) / round);
    for (int32_t i = 0; i < 3; i++)
        turn[i] = angle / size * q[1 + i];
}

#endif
