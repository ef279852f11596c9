/* The state that the parts of method `newton` share: interior point, semismooth polish.
 *
 * x = (mu r_n, r_t) sqrt(t) and z = ((u_n + mu |u_t|) / mu, u_t) / sqrt(t), t = trace(W_kk), lie in
 * the Lorentz cone and are perpendicular; z = A x + b + |z_t| e1 (De Saxce & Feng 1998). All is
 * divided by `unit`, the largest |b_i|. Bilateral rows have z = 0 and any x. */
#ifndef PERP_CONTACT_NEWTON_H
#define PERP_CONTACT_NEWTON_H

#include "contact/cone.h"
#include "contact/newton_matrix.h"

/* How an attempt goes: the part of a step that may be taken to the boundary, and the weight tau of
 * the derivative of |z_t| in the system's matrix, `far` from the solution and near it. */
typedef struct perp__newton_plan {
    double step, tau_far, tau_near;
} perp__newton_plan;

typedef struct perp__newton {
    perp__contact_work common;
    perp__newton_blocks blocks;
    perp__newton_matrix matrix;
    const perp__newton_plan *plan;
    int64_t limit;
    double unit;
    perp__cone_scaling *scalings; /* blocks */
    double *L, *R;                /* nine a block */
    double *b, *x, *z, *y;        /* y = A x + b */
    double *gap;                  /* y + s e1 - z, s = sqrt(|z_t|^2 + eps^2) */
    double *slope;                /* z_t / s, and 0 for the normals */
    double *dx, *dz, *change, *rhs;
    double *trial, *best; /* the polish: x, and the best x */
    double best_residual; /* natural residual of best, in the units of A x + b */
    double residual;      /* the same of x */
    double *r;            /* size, for the tested residual */
} perp__newton;

/* |x - P(x - z)| with z = y + |y_t| e1, over the contacts, and |y| over the bilateral rows; writes
 * the map to phi and the argument v = x - z to v unless they are NULL. phi may be v. */
double perp__natural_map(const perp__newton_blocks *blocks, const double *x, const double *y,
                         double *v, double *phi);

/* Semismooth Newton (Qi & Sun 1993) on the natural map from newton->trial:
 * (V (J A + delta I) + I - V) dx = -phi, at most `steps` of them. Keeps the best point. PERP_OK or
 * PERP_ERROR_MEMORY. */
perp_status perp__natural_polish(perp__newton *newton, int32_t steps);

/* Interior point from (x, z), both inside of the cones. It calls the polish at `exit`, and at ever
 * smaller residuals while that fails. PERP_OK with *outcome, or PERP_ERROR_MEMORY, _CALLBACK. */
perp_status perp__interior_run(perp__newton *newton, perp_outcome *outcome);

/* The tested residual of unit * x, with r left in newton->r. */
double perp__newton_tested(perp__newton *newton, const double *x);

/* -1 to go on, or the outcome to stop with; *status tells of an abort. */
perp_outcome perp__newton_tick(const perp__newton *newton, perp_status *status);

#endif
