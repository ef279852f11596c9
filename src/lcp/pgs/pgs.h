/* Projected Gauss-Seidel's own memory, shared by its files. */
#ifndef PERP_LCP_PGS_H
#define PERP_LCP_PGS_H

#include "lcp/pgs/gradient.h"
#include "lcp/pgs/sweep.h"

/* What makes pgs give up: growth, or no progress from one window of sweeps to the next. */
typedef struct perp__pgs_progress {
    double best;
    double best_before; /* at the end of the last window */
    int64_t window;
} perp__pgs_progress;

typedef struct perp__pgs_work {
    perp__lcp_work common;
    perp__sweeper sweeper;
    perp__gradient gradient;
    int32_t restarts;           /* of the gradient; RESTARTS_MOST: it is not used */
    double *step;               /* omega / S_ii; 0 in rows that do not move */
    double *best;               /* the z of the smallest residual seen, up to a factor 2 */
    double remembered;          /* its residual */
    double residual;            /* of the last sweep */
    double *x, *y, *high, *low; /* for the tested residual */
    int64_t sweeps, next_test;  /* done; the one from when on z is tested again */
    perp__pgs_progress progress;
    int8_t *places;     /* the active set when it was looked at */
    int64_t changed;    /* the last sweep at which it was another */
    int64_t next_pause; /* the sweep from when on the polish is asked */
    double relaxation;  /* the rows were read with these settings; 0: not yet */
    int32_t scaling, sweep;
} perp__pgs_work;

/* Every row has a positive diagonal entry, or is zero and its q_i tells where z_i belongs, or z_i
 * is fixed. PERP_OK or PERP_ERROR_ARGUMENT. */
perp_status perp__pgs_check(const perp__lcp_problem *problem);

/* Fills the sweeper: the matrix where it is not the one of the last solve, q, the bounds and z. */
void perp__pgs_read(perp__pgs_work *work, const double *z);

#endif
