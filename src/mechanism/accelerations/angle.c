/* One slip that starts in a plane, in direction (cos, sin): the forces are K^-1 times something,
 * and one column of K is linear in cos and sin. So det K times way x u_t' is
 *
 *   a_0 + a_1 cos + b_1 sin + a_2 cos 2 + b_2 sin 2
 *
 * exactly, known from five of its values; with tau = tan(angle / 2) its zeros are those of a
 * polynomial of degree four: eigenvalues of a companion matrix. */
#include <math.h>

#include "linalg/eigenvalues.h"
#include "mechanism/accelerations/accelerations.h"

#define PI 3.14159265358979323846
#define SAMPLES 5
/* Double zeros come as pairs with an imaginary part of the square root of rounding. */
#define REAL 1e-5

/* det K way x u_t' at an angle; returns 0 where K is singular. */
static int32_t sample(perp__acceleration *a, int32_t index, double angle, double *value)
{
    const perp__unit *unit = a->unit + index;
    const int32_t t = unit->row + !unit->dry;
    double *way = a->pattern.way + 2 * (size_t)index;

    way[0] = cos(angle);
    way[1] = sin(angle);
    perp__found_solve_roughly(a, PERP__FOUND_SINGULAR, a->active);
    *value = a->system.sign * a->system.product * (way[0] * a->u[t + 1] - way[1] * a->u[t]);
    return a->system.sign != 0;
}

/* Zeros of the polynomial in the basis of cos and sin above; the value at the angle PI is not 0. */
static int32_t solve(double a_0, double a_1, double b_1, double a_2, double b_2, double *angles)
{
    const double top = a_0 - a_1 + a_2;
    const double c[4] = {a_0 + a_1 + a_2, 2.0 * b_1 + 4.0 * b_2, 2.0 * a_0 - 6.0 * a_2,
                         2.0 * b_1 - 4.0 * b_2};
    double companion[16] = {0}, real[4], imaginary[4];
    int32_t count = 0, k;

    for (k = 0; k < 4; k++) {
        companion[k + 12] = -c[k] / top;
        if (k > 0)
            companion[k + 4 * (k - 1)] = 1.0;
    }
    if (perp__eigenvalues(4, companion, real, imaginary) != 0)
        return -1;
    for (k = 0; k < 4; k++)
        if (fabs(imaginary[k]) <= REAL * (1.0 + fabs(real[k])))
            angles[count++] = 2.0 * atan(real[k]);
    return count;
}

int32_t perp__found_angles(perp__acceleration *a, double *angles)
{
    double value[SAMPLES], a_0 = 0.0, a_1 = 0.0, b_1 = 0.0, a_2 = 0.0, b_2 = 0.0, origin;
    int32_t index = 0, largest = 0, count, k;

    while (!perp__found_turns(a, index))
        index++;
    for (k = 0; k < SAMPLES; k++) {
        if (!sample(a, index, 2.0 * PI * k / SAMPLES, value + k))
            return -1;
        if (fabs(value[k]) > fabs(value[largest]))
            largest = k;
    }
    if (value[largest] == 0.0)
        return -1;
    origin = 2.0 * PI * largest / SAMPLES - PI; /* the largest value is at PI from it */
    for (k = 0; k < SAMPLES; k++) {
        const double angle = 2.0 * PI * k / SAMPLES - origin;

        a_0 += value[k] / SAMPLES;
        a_1 += 2.0 * value[k] * cos(angle) / SAMPLES;
        b_1 += 2.0 * value[k] * sin(angle) / SAMPLES;
        a_2 += 2.0 * value[k] * cos(2.0 * angle) / SAMPLES;
        b_2 += 2.0 * value[k] * sin(2.0 * angle) / SAMPLES;
    }
    count = solve(a_0, a_1, b_1, a_2, b_2, angles);
    for (k = 0; k < count; k++)
        angles[k] += origin;
    return count;
}
