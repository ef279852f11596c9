/* Semismooth Newton on Phi(z) = 0, Phi the Fischer-Burmeister function: De Luca, Facchinei &
 * Kanzow, "A semismooth equation approach to the solution of nonlinear complementarity problems",
 * Math. Programming 75 (1996) 407, with the bounds of Billups' thesis (1995) and the penalty of
 * Chen, Chen & Kanzow, "A penalized Fischer-Burmeister NCP-function", Math. Programming 88 (2000)
 * 211. In their notation: F has the derivative S, Phi_i = phi of row i, Psi = 1/2 |Phi|^2, H = D_z
 * + D_w S in the B-subdifferential of Phi.
 *
 * What differs: phi has the opposite sign; steps of nonlinear problems are projected onto the
 * bounds (Kanzow, Munson & Ferris 1999); the line search is nonmonotone (Grippo, Lampariello &
 * Lucidi, SIAM J. Numer. Anal. 23 (1986)); a run may follow the zeros of the smoothed equations as
 * mu falls to 0 (Kanzow 1996): where S is monotone and solutions are many, as in linear programs, H
 * is singular at each, and the path alone leads there. A descent method on Psi may end in a local
 * minimum that solves nothing (Billups): that is outcome 'stalled'.
 *
 * Linear and nonlinear problems have this in common; what is theirs are the functions of a
 * perp__newton_problem. All is in scaled coordinates. */
#ifndef PERP_LCP_FISCHER_NEWTON_H
#define PERP_LCP_FISCHER_NEWTON_H

#include "base/arena.h"
#include "base/outcome.h"
#include "lcp/fischer/function.h"
#include "linalg/matrix.h"

/* Of searches along a line: Armijo's share of what the slope promises, the values of Psi that a
 * nonmonotone one looks back on, halvings, each of which calls F, also down the gradient where
 * nothing else is left, and what counts as progress: a tenth less. */
#define PERP__ARMIJO 1e-4
#define PERP__MEMORY 8
#define PERP__HALVINGS 12
#define PERP__GRADIENT_HALVINGS 40
#define PERP__PROGRESS 0.9

/* Full steps that a watch allows to let Psi grow, and by how much, before it goes back. */
#define PERP__WATCH 5
#define PERP__WATCH_GROWTH 1e4

/* The first rho that is not 0, of a unit diagonal, and from one rho or mu to the next. On the path
 * mu falls where |Phi| <= PERP__FISCHER_NEAR mu. Starts of one problem, the second of them the
 * path. */
#define PERP__FISCHER_SHARE 0.1
#define PERP__FISCHER_NEAR 3.0
#define PERP__FISCHER_STARTS 5

typedef struct perp__newton perp__newton;

/* A status > 0 says: not there. */
typedef struct perp__newton_problem {
    /* w := F(z), > 0 where that is not defined. */
    perp_status (*evaluate)(perp__newton *run, const double *z, double *w);
    /* d := -(D_z + D_w (S + rho I))^-1 Phi, > 0 where that is singular. */
    perp_status (*direction)(perp__newton *run, double rho);
    /* Before each iteration: S there; run->outcome, where the run is to end. PERP_OK or error. */
    perp_status (*begin)(perp__newton *run);
} perp__newton_problem;

struct perp__newton {
    const perp__newton_problem *problem;
    void *owner; /* whose functions these are */
    int32_t n;
    const double *lower, *upper;
    perp__matrix S;
    double penalty, smoothing; /* mu of the path, or 0, */
    double least;              /* and from which on the path takes Phi = 0 */
    int32_t path;              /* begins with the path */
    int32_t projects;          /* steps onto the bounds, beyond which F may not be called */
    double *z, *w, *phi, psi;  /* the point, F and Phi there */
    double residual;           /* the natural one */
    double *trial_z, *trial_w, *trial_phi, trial_psi; /* where a step may lead */
    double *slope_z, *slope_w, *gradient;             /* D_z, D_w; H' Phi */
    double *d, *part, *image;                         /* a direction; for one function's own use */
    double recent[PERP__MEMORY];                      /* Psi of the last points, in a ring */
    int64_t steps;
    double *best, best_residual; /* the point of the smallest residual */
    int64_t iterations, limit;
    double target; /* residual at which the run may end */
    perp_outcome outcome;
};

/* All arrays but z. */
void perp__newton_layout(perp__arena *arena, perp__newton *run, size_t n);

/* A run begins at z: nothing is known of other points. */
void perp__newton_start(perp__newton *run);

/* residual and the best point yet, for z and w; Phi and Psi with them; and w before that. PERP_OK,
 * > 0 where F is not defined, or an error. */
void perp__newton_note(perp__newton *run);
void perp__newton_appraise(perp__newton *run);
perp_status perp__newton_set_point(perp__newton *run);

/* trial_psi := Psi of the trial point, whose w is there; goes there. */
void perp__newton_check_trial(perp__newton *run);
void perp__newton_take_trial(perp__newton *run);

/* The equation is Phi_mu = 0 from here on, and what the line search looks back on is its Psi. */
void perp__newton_smooth(perp__newton *run, double mu);

/* On the path mu falls as far as the point is near its equation. */
void perp__newton_follow_path(perp__newton *run);

/* D_z, D_w, and the gradient of Psi. */
void perp__newton_find_gradient(perp__newton *run);

/* The largest of the last values of Psi. */
double perp__newton_reference(const perp__newton *run);

/* Moves to z + t d, or its projection, t = 1, 1/2, ..., the first with Psi <= reference + beta t
 * slope; with a gradient slope is what it promises there, and < 0. `halvings` are those after the
 * first t for which F is defined, unless they are 0. Returns 1, 0 if there is none, or an error. */
perp_status perp__newton_search(perp__newton *run, double reference, double slope,
                                const double *gradient, int32_t halvings);

/* A step returns 1 if it moved, 0 if not, or an error: by Newton's direction; down the gradient,
 * where all else fails. */
typedef perp_status (*perp__newton_step)(perp__newton *run, void *user);
perp_status perp__newton_by_direction(perp__newton *run);
perp_status perp__newton_descend(perp__newton *run);

/* Steps from where the run stands to run->outcome. PERP_OK, or an error. */
perp_status perp__newton_iterate(perp__newton *run, perp__newton_step step, void *user);

#endif
