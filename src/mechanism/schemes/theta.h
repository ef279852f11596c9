/* What the steps of the theta scheme keep. */
#ifndef PERP_MECHANISM_THETA_H
#define PERP_MECHANISM_THETA_H

#include "mechanism/mechanism.h"

struct perp__theta {
    PERP__WORK;
    double *A, *factor; /* n by n: iteration matrix and its L, columns */
    double *force;      /* n: k at the end, of the iterate */
    double *p, *last;   /* n: M v0 + h (theta k+ + (1 - theta) k), and that of the last iterate */
    double *v, *last_v; /* n: iterates */
    double *middle;     /* n: theta v+ + (1 - theta) v0 */
    double *x, *y;      /* n: scratch */
    double *q, *at, *probe; /* coordinates: of the iterate; where N is taken; of differences */
    perp__terms terms;      /* m->begin with A for M where that is needed */
    int32_t has_matrix;     /* A is not M */
    int32_t tried_matrix;
    int32_t corrected; /* speeds are measured with the rows of the end */
};

/* m->theta, made where there is none; NULL without memory. */
perp__theta *perp__theta_work(perp_mechanism *m);

/* w->q := q0 moved by h N (theta v + (1 - theta) v0), and w->force := k there. */
perp_status perp__theta_force(perp_mechanism *m, perp__theta *w, double t, double h,
                              const double *q0, const double *v0, const double *v);

/* w->A := M - h theta sym(dk/dv + h theta dk/dq N), by differences about the iterate, and w->terms
 * with it; stays M where that is not positive definite. */
perp_status perp__theta_matrix(perp_mechanism *m, perp__theta *w, double t, double h,
                               const double *q0, const double *v0);

#endif
