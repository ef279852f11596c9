/* A packed contact's two products, for inlining: its velocity, and what its impulse does to its
 * blocks. */
#ifndef PERP_CONTACT_SWEEP_PACKED_H
#define PERP_CONTACT_SWEEP_PACKED_H

#include "contact/sweep/sweep.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

#define PERP__SUM_LANES(v) ((((v)[0] + (v)[2]) + ((v)[1] + (v)[3])))

/* u := P (first, second) + q + compliance x */
PERP__KERNEL static void perp__packed_velocity(const perp__packed_contact *c, const double *first,
                                               const double *second, const double *x, double *u)
{
    const perp__lanes a = PERP__CONST_LANES_AT(first), b = PERP__CONST_LANES_AT(second);
    const perp__lanes ends = {first[4], first[5], second[4], second[5]};
    const double *P = c->P;

    for (int32_t i = 0; i < 3; i++, P += PERP__PACKED_ROW) {
        const perp__lanes sum = PERP__CONST_LANES_AT(P) * a + PERP__CONST_LANES_AT(P + 4) * b +
                                PERP__CONST_LANES_AT(P + 8) * ends;

        u[i] = PERP__SUM_LANES(sum) + (c->q[i] + c->compliance[i > 0] * x[i]);
    }
}

/* (first, second) += P'd */
PERP__KERNEL static void perp__packed_push(const perp__packed_contact *c, const double *d,
                                           double *first, double *second)
{
    perp__lanes a = PERP__LANES_AT(first), b = PERP__LANES_AT(second);
    perp__lanes ends = {first[4], first[5], second[4], second[5]};

    for (int32_t i = 2; i >= 0; i--) { /* the normal last: its step is known last */
        const perp__lanes step = PERP__SAME_LANES(d[i]);
        const double *P = c->P + i * PERP__PACKED_ROW;

        a += PERP__CONST_LANES_AT(P) * step;
        b += PERP__CONST_LANES_AT(P + 4) * step;
        ends += PERP__CONST_LANES_AT(P + 8) * step;
    }
    PERP__LANES_AT(first) = a;
    PERP__LANES_AT(second) = b;
    first[4] = ends[0];
    first[5] = ends[1];
    second[4] = ends[2];
    second[5] = ends[3];
}

#endif
