/* Slips that start in 3 dimensions: friction is opposite to the acceleration along the tangents,
 * whose direction s is an unknown.
 *
 * Of many slips: Newton's method on the angles, from the directions of the pattern,
 *
 *   g_j = s_j x u_j' = 0,   K x = -(beta + W f_0) of the rows that hold,
 *   dx = -K^-1 E W c_k with c_k = -mu f_n s_k^perp, what a turn of s_k does to the forces.
 *
 * Where contacts share a load K is singular at the solution and nearly so around it: then the rank
 * of the start is kept.
 *
 * Of one slip, in direction (cos, sin): the forces are K^-1 times something, and one column of K is
 * linear in cos and sin. So det K times s x u_t' is
 *
 *   a_0 + a_1 cos + b_1 sin + a_2 cos 2 + b_2 sin 2
 *
 * exactly, known from five of its values; with tau = tan(angle / 2) its zeros are those of a
 * polynomial of degree four: eigenvalues of a companion matrix. */
#include <math.h>
#include <string.h>

#include "mechanism/eigenvalues.h"
#include "mechanism/accelerations/accelerations.h"

#define LONGEST_TURN 0.5
/* Turns larger than this after so many rounds lead nowhere. */
#define NEAR 0.1
#define PATIENCE 7
enum { SAMPLES = 5 /* as many as coefficients */ };

/* ---- all of them -------------------------------------------------------------------------- */

bool perp__slip_starts(const perp__acceleration *a, int32_t index)
{
    return a->element[index].tangents == 2 &&
           perp__element_starts(a->element + index, a->pattern.mode[index]);
}

int32_t perp__slip_count(const perp__acceleration *a)
{
    int32_t count = 0, i;

    for (i = 0; i < a->elements; i++)
        count += perp__slip_starts(a, i);
    return count;
}

static double cross(const double *direction, const double *u)
{
    return direction[0] * u[1] - direction[1] * u[0];
}

/* The Newton step; returns the largest turn, or -1 where there is none. */
static double turn(perp__acceleration *a)
{
    perp__pivoting *p = &a->turning;
    const size_t active = (size_t)a->active;
    double *g = a->turn_work, *step = g + active, *change = step + active, largest = 0.0, top = 0.0;
    int32_t row = 0, column = 0, i, j;

    p->n = perp__slip_count(a);
    for (j = 0; j < a->elements; j++) {
        const perp__element *element = a->element + j;
        const double *slip = a->pattern.direction + 2 * (size_t)j;
        double size, load = 0.0, *force = a->work;

        if (!perp__slip_starts(a, j))
            continue;
        /* what turning slip j by an angle of 1 does to u' */
        for (i = 0; i < element->normals; i++) /* |N|, as the pattern has it */
            load += a->pattern.load[PERP__MOST_NORMALS * j + i] * a->linear.x[element->row + i];
        size = element->dry ? element->bound : element->mu * load;
        memset(force, 0, active * sizeof *force);
        force[element->tangent] = size * slip[1];
        force[element->tangent + 1] = -size * slip[0];
        perp__pattern_respond(a, force, change);
        for (i = 0, row = 0; i < a->elements; i++) {
            const double *direction = a->pattern.direction + 2 * (size_t)i;
            const int32_t t = a->element[i].tangent;
            double entry;

            if (!perp__slip_starts(a, i))
                continue;
            entry = cross(direction, change + t);
            if (i == j)
                entry -= direction[0] * a->linear.u[t] + direction[1] * a->linear.u[t + 1];
            top = fmax(top, fabs(entry));
            p->K[(size_t)row * (size_t)p->n + (size_t)column] = entry;
            g[row++] = -cross(direction, a->linear.u + t);
        }
        column++;
    }
    perp__pivoting_eliminate(p, PERP__NOTHING * top, p->n);
    if (p->rank < p->n)
        return -1.0;
    perp__pivoting_solve(p, step, g);
    for (i = 0, row = 0; i < a->elements; i++) {
        double *direction = a->pattern.direction + 2 * (size_t)i, kept = direction[0], angle;

        if (!perp__slip_starts(a, i))
            continue;
        angle = fmax(-LONGEST_TURN, fmin(LONGEST_TURN, step[row++]));
        largest = fmax(largest, fabs(angle));
        direction[0] = cos(angle) * kept - sin(angle) * direction[1];
        direction[1] = sin(angle) * kept + cos(angle) * direction[1];
        kept = hypot(direction[0], direction[1]);
        direction[0] /= kept;
        direction[1] /= kept;
    }
    return isfinite(largest) ? largest : -1.0;
}

int32_t perp__slip_turn(perp__acceleration *a, double singular)
{
    double before = INFINITY;
    int32_t rank;

    perp__pattern_solve_roughly(a, singular, a->active);
    rank = a->linear.system.rank;
    for (int32_t round = 0; round < PERP__MOST_ITERATES; round++) {
        const double bent = perp__load_turn(a), turned = turn(a), largest = fmax(bent, turned);

        if (turned < 0.0 || (round >= PATIENCE && largest > NEAR))
            return -1;
        /* a small turn that is not halved any more is the rounding of an ill-conditioned W */
        if (largest <= PERP__SUM_ROUNDING ||
            (largest <= PERP__ROUGH_DIRECTIONS && largest > 0.5 * before))
            return perp__pattern_solve(a);
        before = largest;
        /* with the rank of the start, what is left without a pivot becomes consistent at the end */
        perp__pattern_solve_roughly(a, 0.0, rank);
    }
    a->answers.incomplete |= before <= NEAR; /* it was getting somewhere */
    return -1;
}

int32_t perp__slip_angles(perp__acceleration *a, double angles[4])
{
    double value[SAMPLES], a_0 = 0.0, a_1 = 0.0, b_1 = 0.0, a_2 = 0.0, b_2 = 0.0, origin;
    double companion[16] = {[1] = 1.0, [6] = 1.0, [11] = 1.0}, real[4], imaginary[4];
    const perp__pivoting *system = &a->linear.system;
    int32_t index = 0, largest = 0, count = 0, k;
    double *direction;

    while (!perp__slip_starts(a, index))
        index++;
    direction = a->pattern.direction + 2 * (size_t)index;
    /* 1. det K s x u_t' in the basis of cos and sin above; the largest value is at the angle pi */
    for (k = 0; k < SAMPLES; k++) {
        direction[0] = cos(2.0 * PERP__PI * k / SAMPLES);
        direction[1] = sin(2.0 * PERP__PI * k / SAMPLES);
        perp__pattern_solve_roughly(a, PERP__ACCELERATION_SINGULAR, a->active);
        if (system->sign == 0)
            return -1;
        value[k] = system->sign * system->product *
                   cross(direction, a->linear.u + a->element[index].tangent);
        if (fabs(value[k]) > fabs(value[largest]))
            largest = k;
    }
    if (value[largest] == 0.0)
        return -1;
    origin = 2.0 * PERP__PI * largest / SAMPLES - PERP__PI;
    for (k = 0; k < SAMPLES; k++) {
        const double angle = 2.0 * PERP__PI * k / SAMPLES - origin;

        a_0 += value[k] / SAMPLES;
        a_1 += 2.0 * value[k] * cos(angle) / SAMPLES;
        b_1 += 2.0 * value[k] * sin(angle) / SAMPLES;
        a_2 += 2.0 * value[k] * cos(2.0 * angle) / SAMPLES;
        b_2 += 2.0 * value[k] * sin(2.0 * angle) / SAMPLES;
    }
    /* 2. its zeros: double ones come as pairs with an imaginary part of the root of rounding */
    companion[12] = -(a_0 + a_1 + a_2) / (a_0 - a_1 + a_2);
    companion[13] = -(2.0 * b_1 + 4.0 * b_2) / (a_0 - a_1 + a_2);
    companion[14] = -(2.0 * a_0 - 6.0 * a_2) / (a_0 - a_1 + a_2);
    companion[15] = -(2.0 * b_1 - 4.0 * b_2) / (a_0 - a_1 + a_2);
    if (perp__eigenvalues(4, companion, real, imaginary) != 0)
        return -1;
    for (k = 0; k < 4; k++)
        if (fabs(imaginary[k]) <= PERP__ROUGH_DIRECTIONS * (1.0 + fabs(real[k])))
            angles[count++] = 2.0 * atan(real[k]) + origin;
    return count;
}
