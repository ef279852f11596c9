/* A run of Newton's method on a nonsmooth equation Phi(z) = 0 whose zeros are the solutions: the
 * point, its merit Psi = |Phi|^2 / 2, the directions and the steps. All in scaled coordinates, and
 * always within the bounds: steps are projected (Kanzow, Munson & Ferris 1999). */
#ifndef PERP_NCP_NEWTON_H
#define PERP_NCP_NEWTON_H

#include <float.h>

#include <perp/lcp.h>

#include "lcp/fischer/function.h"
#include "linalg/factor/factor.h"
#include "ncp/model.h"

/* Which equation the slopes are of. */
enum perp__ncp_equation {
    PERP__NCP_FISCHER_BURMEISTER,
    PERP__NCP_NATURAL /* mid(z - l, z - u, w): its Newton step is that of an active set */
};

/* Halvings of a step, each of which calls F. */
#define PERP__NCP_HALVINGS 12

typedef struct perp__newton_run {
    perp__ncp_model *model;
    double penalty, smoothing; /* mu of the path, or 0 */
    int32_t path;              /* fischer: follows the smoothed equations */
    double target;             /* natural residual over omega at which a method may stop */
    int32_t finish;            /* and goes on while that brings digits */
    int64_t limit, fruitless;  /* so many iterations have to gain a digit; 0: none */
    double *z, *w, *phi;
    double psi, residual;
    double relative; /* the residual over omega of the last linearisation */
    double *trial_z, *trial_w, *trial_phi;
    double trial_psi;
    double *equation; /* the right-hand side that slope_z, slope_w belong to */
    double *slope_z, *slope_w;
    int8_t *signs; /* n: -1 where an equation is the other way round than its rho */
    double *d, *gradient, *part, *image;
    double *H; /* or its LU factors, if dense, with these: */
    int32_t *pivots;
    perp__kept_factor factor; /* of a sparse H */
    double recent[PERP__MEMORY];
    int64_t steps;
    double *best;
    double best_residual;
    int32_t any;    /* best is a point */
    int32_t scaled; /* the run has its scaling */
    int64_t iterations;
    perp_outcome outcome;
} perp__newton_run;

void perp__ncp_newton_layout(perp__arena *arena, perp__newton_run *run);

/* The run is at z, which is within the bounds: w, Phi, Psi. PERP_OK, PERP__NCP_OUTSIDE or
 * _CALLBACK. */
perp_status perp__ncp_set_point(perp__newton_run *run);

/* The equation is Phi_mu = 0 from here on, and what the line search looks back on is its Psi. */
void perp__ncp_smooth(perp__newton_run *run, double mu);

/* S at z, the run's scaling with its first, omega. Statuses as above. */
perp_status perp__ncp_update_jacobian(perp__newton_run *run);

/* Slopes D_z, D_w and right-hand side of an equation at z. */
void perp__ncp_slopes(perp__newton_run *run, enum perp__ncp_equation equation);

/* H := D_z + D_w (S + rho I), with -rho where signs says so: [H A'; A -rho I] is as regular as its
 * monotone twin [H A'; -A rho I], [H A'; A rho I] may be singular. */
void perp__ncp_fill(perp__newton_run *run, double rho);

/* d := -(D_z + D_w (S + rho I))^-1 times the right-hand side. PERP_OK, PERP__FACTOR_SINGULAR or
 * _MEMORY. */
perp_status perp__ncp_newton_direction(perp__newton_run *run, double rho);

/* gradient := H' Phi, the gradient of Psi for the slopes of Fischer-Burmeister. */
void perp__ncp_gradient(perp__newton_run *run);

/* Moves to P(z + t d), t = 1, 1/2, ..., the first with Psi <= reference + beta t slope; with a
 * gradient slope is what it promises there, and < 0. Returns 1, 0 if there is none, or
 * PERP_ERROR_CALLBACK. */
perp_status perp__ncp_line_search(perp__newton_run *run, double reference, double slope,
                                  const double *gradient, int32_t halvings);

/* Steepest descent for the slopes there, where all else fails: as the search, but Psi has to fall
 * by beta of what its gradient promises. */
perp_status perp__ncp_descend(perp__newton_run *run);

/* The largest of the last values of Psi. */
double perp__ncp_reference(const perp__newton_run *run);

/* Steps from where the run stands to run->outcome. A step returns 1 if it moved, 0 if not, or a
 * negative status. PERP_OK, or a negative status. */
typedef perp_status (*perp__ncp_step)(perp__newton_run *run, void *own);
perp_status perp__ncp_iterate(perp__newton_run *run, perp__ncp_step step, void *own);

/* ---- the methods: each runs from where it stands. Checks, timing, acceptance and
 * restarts live in the front door ---- */

/* From run->z, where F is defined, to run->outcome; what it thinks of its point is no verdict.
 * PERP_OK, or PERP_ERROR_MEMORY / _CALLBACK. */
perp_status perp__ncp_fischer(perp__newton_run *run);

/* The linear problems of Josephy-Newton, and the point its watchdog may return to. */
typedef struct perp__ncp_linear {
    perp_lcp_solver *lcp; /* made when it first runs */
    double *q, *z;
    double *kept_z, *kept_d; /* of the watchdog */
    double kept_psi;
    int32_t since; /* full steps since then */
} perp__ncp_linear;

perp_status perp__ncp_josephy(perp__newton_run *run, perp__ncp_linear *linear);

#endif
