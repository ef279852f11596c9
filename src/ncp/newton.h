/* A run of Newton's method on a nonlinear problem: what it has of its own beside the run of a
 * linear one (lcp/fischer/newton.h), its scaling and the systems of its steps. */
#ifndef PERP_NCP_NEWTON_H
#define PERP_NCP_NEWTON_H

#include <perp/lcp.h>

#include "lcp/fischer/newton.h"
#include "linalg/factor/factor.h"
#include "ncp/model.h"

typedef struct perp__ncp_run {
    perp__newton newton;
    perp__ncp_model *model;
    int32_t finish;     /* goes on beyond the target while that brings digits */
    int64_t fruitless;  /* so many iterations have to gain a digit; 0: none */
    double relative;    /* the residual over omega of the last linearisation */
    double first, last; /* residuals at the start, and before the last step */
    int8_t *signs;      /* n: -1 where an equation is the other way round than its rho */
    double *H;          /* or its LU factors, if dense, with these: */
    int32_t *pivots;
    perp__cached_factor factor; /* of a sparse H */
    int32_t scaled;             /* the run has its scaling */
    int32_t crashing;           /* fischer: has moved by active sets alone */
} perp__ncp_run;

void perp__ncp_run_layout(perp__arena *arena, perp__ncp_run *run);

/* A run from newton.z, in units of D and `unit`. PERP_OK, PERP__NCP_OUTSIDE or _CALLBACK. */
perp_status perp__ncp_start_run(perp__ncp_run *run);

/* S at z, the run's scaling with its first, omega. Statuses as above. */
perp_status perp__ncp_update_jacobian(perp__ncp_run *run);

/* H := D_z + D_w (S + rho I), with -rho where signs says so: [H A'; A -rho I] is as regular as its
 * monotone twin [H A'; -A rho I], [H A'; A rho I] may be singular. */
void perp__ncp_fill(perp__ncp_run *run, double rho);

/* ---- the methods: each runs from where it stands to newton.outcome; what it thinks of its point
 * is no verdict. PERP_OK, or PERP_ERROR_MEMORY / _CALLBACK. Checks, timing, acceptance and restarts
 * live in the front door ---- */

perp_status perp__ncp_fischer(perp__ncp_run *run);

/* The linear problems of Josephy-Newton, and the point its watchdog may return to. */
typedef struct perp__ncp_linear {
    perp__ncp_run *run;
    perp_lcp_solver *lcp; /* made when it first runs */
    double *q, *z;
    double *kept_z, *kept_d; /* of the watchdog */
    double kept_psi;
    int32_t since; /* full steps since then */
} perp__ncp_linear;

perp_status perp__ncp_josephy(perp__ncp_run *run, perp__ncp_linear *linear);

#endif
