/* One body and its contacts with the world at rest, for single.c and single_hold.c. */
#ifndef PERP_CONTACT_RIGID_SINGLE_H
#define PERP_CONTACT_RIGID_SINGLE_H

#include "contact/contact.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

/* Four contacts side by side, a contact a lane; vectors of the body's coordinates are filled up
 * with zeros. */
enum { LANES = 4, GROUPS = 2, MOST = LANES * GROUPS, AXES = 3, WIDTH = 6, ROOM = 2 * LANES };

typedef double lane_numbers[GROUPS][AXES][LANES];
typedef double lane_rows[GROUPS][AXES][WIDTH][LANES];

typedef struct perp__single {
    const perp__rigid_problem *problem;
    int32_t groups, rank;
    int32_t axes; /* of any contact that hold, at most */
    int32_t dims[MOST], modes[MOST];
    double held[MOST]; /* rows */
    double mu[MOST], trace[MOST], root[MOST], omega;
    double driven[MOST];               /* |q| / root */
    double scales[MOST], errors[MOST]; /* lengths of these */
    double tested[MOST], own[MOST];    /* residuals */
    double pressed[MOST];              /* 0: no, 1: it slips, 2: it sticks */
    lane_numbers bias, r, u;
    lane_numbers scale;   /* |P| |P'| |r| + |q| */
    lane_numbers error;   /* at least what rounding made of u */
    lane_rows J, P, A;    /* P = J C, A = |J| |C| */
    lane_numbers squares; /* of P's rows */
    lane_numbers drift;   /* q */
    lane_numbers terms;   /* of it */
    lane_numbers after;   /* u of v */
    double y[ROOM];       /* P'r */
    double v[ROOM];
    double change;               /* of the velocities by what holds, beside their terms */
    double columns[WIDTH][ROOM]; /* of C */
    double basis[WIDTH][ROOM];   /* of the rows that hold */
} perp__single;

/* In the plane contacts have one tangent. */
#define PERP__AXES_OF(n) ((n) == WIDTH ? AXES : AXES - 1)

/* A number of contact k. */
#define PERP__OF(numbers, k, a) ((numbers)[(k) / LANES][a][(k) % LANES])

PERP__KERNEL static double perp__sum_lanes(const double *x)
{
    return (x[0] + x[2]) + (x[1] + x[3]);
}

/* y = P'r of the impulses in lanes; NULL or the sums of terms |P'| |r| and |A'| |r|. */
PERP__KERNEL static void perp__single_push(const perp__single *s, const double (*r)[AXES][LANES],
                                           double *y, double *terms, double *most, int32_t n)
{
    for (int32_t i = 0; i < n; i++) {
        perp__lanes sum = {0.0}, size = {0.0}, bound = {0.0};

        for (int32_t g = 0; g < s->groups; g++)
            for (int32_t a = 0; a < PERP__AXES_OF(n); a++) {
                const perp__lanes x = PERP__CONST_LANES_AT(r[g][a]);
                const perp__lanes term = x * PERP__CONST_LANES_AT(s->P[g][a][i]);

                sum += term;
                if (!terms)
                    continue;
                size += PERP__ABSOLUTE_LANES(term);
                bound += PERP__ABSOLUTE_LANES(x) * PERP__CONST_LANES_AT(s->A[g][a][i]);
            }
        y[i] = perp__sum_lanes((const double *)&sum);
        if (!terms)
            continue;
        terms[i] = perp__sum_lanes((const double *)&size);
        most[i] = perp__sum_lanes((const double *)&bound);
    }
}

/* v, after and change, for the rows `held` of each contact. */
void perp__single_hold(perp__single *s);

#endif
