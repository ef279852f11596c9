/* The parts of the semismooth Newton method: its point, its two kinds of step. In the notation of
 * De Luca, Facchinei & Kanzow (1996): F(z) = S z + q, Phi_i = phi of row i, Psi = 1/2 |Phi|^2, H =
 * D_z + D_w S in the B-subdifferential of Phi. */
#ifndef PERP_LCP_FISCHER_H
#define PERP_LCP_FISCHER_H

#include "base/arena.h"
#include "lcp/fischer/function.h"
#include "lcp/method.h"

typedef struct perp__fischer_state {
    perp__lcp_work common;
    const perp__matrix *S;
    int32_t *active; /* the rows of the last system, finite weights */
    double penalty;
    double smoothing, last; /* mu of the path, or 0; the least there, 0 without a path */
    double *z, *w, *phi;    /* the point, F and Phi there; z belongs to the caller */
    double psi;
    double recent[PERP__MEMORY]; /* Psi of the last points, in a ring */
    int64_t steps;
    double *slope_z, *slope_w;             /* D_z and D_w */
    double *weights, *d, *image;           /* a direction's system, the direction, S d */
    double *trial_z, *trial_w, *trial_phi; /* where it may lead */
    double *correction, *part, *work;      /* for one function's own use */
    double *best;                          /* within the bounds, the smallest natural residual */
    double best_residual;
    /* active-set steps, see steps.c */
    int8_t *places, *next_places; /* the index set to solve for, and the one after it */
    int32_t has_places;           /* 0: to be read off z and w */
    double rho;
    double *kept_z; /* the watchdog's point */
    double kept_psi;
    int32_t watched, failures;
} perp__fischer_state;

/* phi = Phi(z) with w = F(z) given; returns Psi(z). */
double perp__fischer_evaluate(const perp__fischer_state *f, const double *z, const double *w,
                              double *phi);

/* Finds w, Phi and Psi at f->z, and keeps the point if it is the best so far. */
void perp__fischer_set_point(perp__fischer_state *f);

/* Goes to trial_z. */
void perp__fischer_take_trial(perp__fischer_state *f);

/* x is given on the rows of infinite weight W; on the others it is the right side b of
 * (W + S) x = b. Solves with the factors there are; image := S x. Uses part. */
void perp__fischer_solve_rows(perp__fischer_state *f, double *x, double *image);

/* One step by a regularised active set. Returns 1 if z moved, 0 if it did not and Newton's step is
 * to be made, or PERP_ERROR_MEMORY. */
perp_status perp__fischer_active_step(perp__fischer_state *f);

/* One step by Newton's direction for Phi, or else by the gradient of Psi, with a line search.
 * Returns 1 if z moved, 0 if nothing more can be done, or PERP_ERROR_MEMORY. */
perp_status perp__fischer_newton_step(perp__fischer_state *f);

#endif
