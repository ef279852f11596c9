/* The state that the parts of method `newton` share: interior point, semismooth polish.
 *
 * x = (mu r_n, r_t) sqrt(t) / a and z = a ((u_n + mu |u_t|) / mu, u_t) / sqrt(t), t = trace(W_kk),
 * lie in the Lorentz cone and are perpendicular; z = A x + b + |z_t| e1 (De Saxce & Feng 1998).
 * a = sqrt(max(mu, 1) min(10 mu, 1)) shares a large or small mu between the two. All is divided by
 * a unit, the largest |b_i| of the part. Bilateral rows have z = 0 and any x. */
#ifndef PERP_CONTACT_NEWTON_H
#define PERP_CONTACT_NEWTON_H

#include "contact/newton/cone.h"
#include "contact/newton/matrix.h"

/* A tested residual after which nothing more is tried. */
#define PERP__NEWTON_ENOUGH 1e-12

/* How an attempt goes. */
typedef struct perp__newton_plan {
    double step;              /* the part of the way to the boundary that a step may go */
    double tau_far, tau_near; /* weight of |z_t|'s derivative, far from the solution and near */
    int32_t path;             /* first along the path of path.c, to ever smaller t */
    double compliance;        /* there: t times this is added to A */
    uint64_t cover;           /* there: seed of the covering vector, 0: ones */
} perp__newton_plan;

typedef struct perp__newton {
    perp__contact_work common;
    perp__newton_blocks blocks;
    perp__newton_matrix matrix;
    const perp__newton_plan *plan;
    int64_t limit;
    perp__cone_scaling *scalings; /* blocks */
    double *L, *R;                /* nine a block */
    double *units;                /* of each unknown */
    double *b, *x, *z, *y;        /* y = A x + b */
    double *gap;                  /* y + s e1 - z, s = sqrt(|z_t|^2 + eps^2) */
    double *slope;                /* z_t / s, and 0 for the normals */
    double *dx, *dz, *change, *rhs;
    double *trial, *best; /* the polish: x, and the best x */
    double best_residual; /* tested residual of best */
    double residual;      /* natural residual of x, in the units of A x + b */
    double *cover;        /* the path's covering vector */
    double *v, *tangent, *ahead, *along, *error;
} perp__newton;

/* The tested residual, as the front door defines it, of impulses x with y = A x + b. */
double perp__natural_tested(const perp__newton *newton, const double *x, const double *y);

/* |x - P(x - z)| with z = y + |y_t| e1, over the contacts, and |y| over the bilateral rows; writes
 * the map to phi and the argument v = x - z to v unless they are NULL. phi may be v. */
double perp__natural_map(const perp__newton_blocks *blocks, const double *x, const double *y,
                         double *v, double *phi);

/* Semismooth Newton (Qi & Sun 1993) on the natural map from newton->trial:
 * (V (J A + delta I) + I - V) dx = -phi, at most `steps` of them. Keeps the best point. PERP_OK or
 * PERP_ERROR_MEMORY. With no steps it only looks at the point. */
perp_status perp__natural_polish(perp__newton *newton, int32_t steps);

/* Interior point from (x, z), both inside of the cones. It calls the polish at `exit`, and at ever
 * smaller residuals while that fails. PERP_OK with *outcome, or PERP_ERROR_MEMORY, _CALLBACK. */
perp_status perp__interior_run(perp__newton *newton, perp_outcome *outcome);

/* The path of solutions that path.c follows, and interior points from places on it. As
 * perp__interior_run. */
perp_status perp__path_run(perp__newton *newton, perp_outcome *outcome);

/* trial := P(x - z). */
void perp__natural_start(perp__newton *newton);

/* -1 to go on, or the outcome to stop with; *status tells of an abort. */
perp_outcome perp__newton_tick(const perp__newton *newton, perp_status *status);

/* Whether limit or clock allow no factorisation more: asked before each. */
int32_t perp__newton_is_spent(const perp__newton *newton);

#endif
