/* The solver's own memory, shared by the files of the front door only. */
#ifndef PERP_CONTACT_SOLVER_H
#define PERP_CONTACT_SOLVER_H

#include <perp/contact.h>
#include <string.h>

#include "base/arena.h"
#include "base/handle.h"
#include "base/outcome.h"
#include "contact/bodies/bodies.h"
#include "contact/bounded.h"
#include "contact/dynamics/dynamics.h"
#include "contact/hold/hold.h"
#include "contact/method.h"
#include "lcp/lcp.h"

enum { PERP__CONTACT_METHODS = 4 };

enum perp__contact_entrance {
    PERP__NO_PROBLEM = 0,
    PERP__ENTRANCE_DELASSUS = 1,
    PERP__ENTRANCE_DYNAMICS = 2,
    PERP__ENTRANCE_RIGID = 3 /* contact.h */
};

/* What a point is worth: the numbers of perp_contact_result, all from the caller's data. */
typedef struct perp__contact_residuals {
    double tested, own_residual, natural, backward, signorini_velocity, signorini_impulse, cone;
    double dissipation_velocity, dissipation_impulse, bilateral;
    int32_t sound; /* everything that would be returned is finite */
} perp__contact_residuals;

/* A method and its workspace, made when it first runs. */
typedef struct perp__contact_slot {
    const perp__contact_method *method;
    perp__workspace space;
    int64_t spent; /* iterations of this call */
} perp__contact_slot;

typedef struct perp__contact_candidate {
    double *r, *u;
    int8_t *modes;
    perp__contact_residuals residuals;
    perp__evidence *evidence; /* parts */
    perp_outcome outcome;
    int32_t method; /* -1: none yet */
} perp__contact_candidate;

/* Impulses of the normals and the bilateral rows alone: an LCP that tells whether there are any
 * velocities that keep the contacts apart. */
typedef struct perp__contact_ray {
    perp_lcp_solver *lcp;
    perp__arena arena;
    int64_t fitted;
    int32_t n, *rows; /* n: of W */
    double *M, *q, *lower, *z, *direction;
    double *impulse, *velocity; /* n: the units of z and of the rows */
    int32_t count;              /* rows of the block below */
    int32_t *active, *pivots;   /* n */
    double *K, *step;           /* n by n; n */
} perp__contact_ray;

/* Newton's method on the equations of one active set, which is tried on every point that comes near
 * a solution: polish.c. */
typedef struct perp__contact_polish {
    perp__arena arena;
    int32_t room;    /* rows that K has room for */
    double enough;   /* > 0: in plain doubles, and to no more than this tested residual */
    int64_t last;    /* of the steps in plain doubles */
    int32_t is_soft; /* the last step was a proximal one: no equations hold */
    int32_t n;       /* rows of the active set */
    int32_t *place;  /* of a row in the system, -1: r is known there */
    int32_t *rows;   /* the other way round */
    int8_t *presses; /* contacts */
    int8_t *parts;   /* 3 contacts, behind those: enum perp__part_state */
    int8_t *seen;    /* these of the sets that were */
    int32_t *pivots;
    double *K, *factors;                          /* n by n; factors of K + a regularisation */
    double *rhs, *step, *error, *units, *weights; /* n */
} perp__contact_polish;

/* Most rows of a problem that is polished: the factors are dense. */
enum { PERP__POLISH_MOST = 600 };

/* Most rows of one that is followed from its start, before anything else. */
enum { PERP__POLISH_START_MOST = 96 };

/* And of one whose sets are searched. */
enum { PERP__POLISH_SEARCH_MOST = 24 };

/* What takes overlaps away: open.c. */
typedef struct perp__contact_opening {
    perp_contact_solver *solver; /* NULL until it is first needed */
    perp__arena arena;
    int32_t size, whole, n; /* rows with gaps and equations; of the solver; velocities */
    int32_t patience;       /* steps in which overlaps are taken to contradict each other */
    int32_t *rows;          /* own, of the solver; */
    int32_t *position;      /* and back, or -1 */
    int32_t *dims;
    int32_t *part;                    /* n: of each velocity, those that are shortened together */
    int32_t *first;                   /* of each row of M, H or G: a velocity */
    double *W, *q, *r, *start, *sign; /* size by size; size */
    double *push, *share;             /* whole; n */
    double *opened; /* p of the last step, by its rows, where those have no source */
} perp__contact_opening;

/* Rows as perp_contact_solver_arrange has arranged them: rows.c. */
typedef struct perp__contact_rows {
    perp__arena arena;
    int32_t counts[5], n;
    double h;
    int32_t contacts, rows, bilateral, bounded, gaps, is_scaled;
    int32_t *dims, *first, *H_rows, *G_rows, *gap_rows, *gap_sources, *modes;
    double *mu, *rolling, *spinning, *lower, *upper, *scale;
    double *zeros, *start; /* w, b, H, G, r and u; start, and behind it that of openings */
    int32_t *names; /* 3 of each contact, then row with bounds: the same as long as it lasts */
    int32_t *kept, *record; /* contacts: the shape (rows.c), and which it is of the simulator's */
    int32_t *places;        /* of the simulator's contacts: geoms, row, dimension; */
    double *frictions;      /* coefficients */
    int32_t *ids;           /* of rows with bounds, */
    double *bounds;         /* and of dry friction */
    int32_t *moves;       /* equations: whether a row is not 0; the simulator's contacts: shapes */
    perp_matrix views[2]; /* H, G */
} perp__contact_rows;

struct perp_contact_solver {
    PERP__HANDLE;
    perp_contact_settings settings;
    perp__arena arena;
    size_t fitted[4];   /* rigid bodies: what arena was laid out for, */
    size_t reserved[4]; /* and what methods that starts lead to have room for */
    const struct perp__rigid_problem *rigid; /* with its entrance, during a call */
    int32_t proves;                          /* proofs of infeasibility are looked for */
    int32_t quick;                           /* as perp__rigid_problem's */
    int32_t steps;                           /* 1: a step asks: of many rows no last sweeps */
    double enough;                           /* residuals that need none either; 0: none */
    int32_t n;                               /* velocities; 0 where W was given */
    int32_t entrance;                        /* PERP__NO_PROBLEM or how the problem came */
    int64_t setups;
    int32_t contacts, rows, size, has_discs, *starts, *dims;
    int32_t *two_sided; /* contacts: normals that hold both ways */
    int32_t holds_both; /* some have such */
    double *mu;
    double *rolling, *spinning, *compliance; /* room for them; none: NULL in laws */
    double *bound;                           /* contacts: law.h */
    perp__contact_bounded bounded;           /* what the caller's rows with bounds became */
    int32_t is_far;                          /* some of the bounds, and those were drawn in */
    int32_t rolls, spins, complies, has_bounds;
    double *diagonal, *trace;
    /* constraints: the contacts, then the bilateral rows */
    int32_t constraints, parts;
    int32_t leaks;          /* some of the parts are coupled, by noise */
    int32_t *constraint_of; /* size */
    int32_t *part, *number; /* constraints: the part it is in; work */
    int32_t *near;          /* constraints: among which terms excuse; of near_tol, or not yet */
    double near_tol;
    double *root;                     /* constraints: sqrt(trace) */
    double *omega;                    /* constraints: of its part */
    double *drive;                    /* parts: omega, 0 where q is */
    int32_t is_idle;                  /* some part is not driven at all */
    perp__evidence *evidence;         /* parts: what the point under evaluation is worth */
    double *terms, *lack, *wide;      /* constraints: of u; what that lacks of the law; work */
    double *most_speed, *most_energy; /* parts: work */
    perp__matrix W;                   /* with compliance; made when first needed where has_bodies */
    perp__delassus delassus;
    perp__dynamics dynamics;
    perp__bodies bodies;
    int32_t has_bodies; /* M falls into blocks */
    /* of a solve */
    double *q, *scale, *high, *low;
    double *load; /* |q|, or what rounding may have made of it in units of tol, if that is more */
    double *r, *u, *start;      /* the point under evaluation */
    double *warm;               /* rigid bodies: impulses to start from */
    double *push, *push_low;    /* n: work */
    double *v, *v_low;          /* of the last evaluation; before one, without contacts: is_free */
    double *best_v, free_speed; /* free_speed: the largest |v| without impulses */
    int32_t is_free;
    int8_t *modes, *rest_modes;
    double *ray; /* best one, largest entry 1 */
    int32_t has_ray, certificate;
    const perp__contact_call *call;
    perp__contact_candidate best;
    perp_outcome said;  /* by the last method */
    int64_t iterations; /* of all that ran, */
    int64_t polished;   /* and of the polish */
    perp_outcome ended; /* stopped or time_limit, once that has happened; else -1 */
    int32_t folds;      /* a path to an answer has ended next to its beginning */
    int32_t aborted;    /* the monitor returned a negative number */
    int32_t running;    /* the method that does */
    double deadline;
    perp__contact_problem problem;
    perp__contact_control control;
    perp__contact_slot slots[PERP__CONTACT_METHODS];
    perp__contact_ray feasibility;
    perp__contact_opening opening;
    perp__contact_rows arranged[2];
    int32_t arranged_now;
    perp__contact_polish polish;
    perp__hold hold;
    struct perp__statics_front *front; /* NULL until it is first needed */
    int32_t asked_rest, rests;         /* in this call: statics was asked; and it stands */
};

/* Opens a public call: solver.c. */
perp_status perp__contact_enter(perp_contact_solver *solver);
#define PERP__CONTACT_CALL(solver, works) \
    PERP__CALL(perp__contact_enter(solver), (solver)->context, works)

/* The rest of a set-up, after the laws and matrices are in place. PERP_OK, or _ARGUMENT where a
 * constraint moves nothing. And the arrays, for an arena: problem.c. */
perp_status perp__contact_finish_setup(perp_contact_solver *solver);
void perp__contact_lay_out(perp__arena *arena, void *solver);

/* The methods' view of the monitor and the clock; user: the solver. Nonzero: stop. solver.c. */
int32_t perp__contact_tick(void *user, int64_t iterations, double residual);

/* Checks of a call before, and its outputs after: solver.c. */
perp_status perp__contact_check_call(const perp_contact_solver *solver,
                                     const perp__contact_call *call);
void perp__contact_write_out(perp_contact_solver *solver, const perp__contact_call *call,
                             double started);

/* What is left of a solve without checks, outputs and the time limit, the best point in
 * solver->best: contact.c. */
perp_status perp__contact_find(perp_contact_solver *solver, const perp__contact_call *call,
                               double deadline);

/* Finds the parts of the problem that was set up, and `near`; the latter uses `wide`: parts.c. */
void perp__contact_find_parts(perp_contact_solver *solver);
void perp__contact_find_near(perp_contact_solver *solver);

/* q, and with it omega, for this call: evaluation.c. PERP_OK, _CALLBACK or _NOT_FINITE. */
perp_status perp__contact_load(perp_contact_solver *solver);

/* Evaluates solver->r, with the modes of the method's active set or NULL, and keeps it if it is the
 * best so far: evaluation.c. */
perp_status perp__contact_consider(perp_contact_solver *solver, int32_t method, const int8_t *modes,
                                   perp__contact_residuals *residuals);

/* The point under evaluation becomes the best. */
void perp__contact_keep(perp_contact_solver *solver, const perp__contact_candidate *point);

/* Projects solver->r onto its cones, writes the zeros of the contacts that separate, recomputes u
 * and judges: evaluation.c. Status as above. modes: those of the method's active set, or NULL. */
perp_status perp__contact_evaluate(perp_contact_solver *solver, const int8_t *modes,
                                   perp__contact_residuals *residuals);

/* What the modes as they are now make of the residuals; and the outcome of a point, the worst of
 * its parts': evaluation.c. */
void perp__contact_weigh(perp_contact_solver *solver, perp__contact_residuals *residuals);
perp_outcome perp__contact_verdict(const perp_contact_solver *solver,
                                   const perp__contact_candidate *point, perp_outcome said);

/* What step.source shows, and whether that was arranged: rows.c. PERP_OK, _ARGUMENT, _ABI. */
perp_status perp__contact_check_source(perp_context *context, const perp_contact_step *s);
bool perp__contact_rows_last(const perp_contact_solver *solver, const perp_contact_step *s);

/* w of contacts whose surfaces move; returns whether that changes: rows.c. */
bool perp__contact_rows_move(const perp_contact_solver *solver, const perp_contact_step *s);

/* s->shift, of the problem that is set up: open.c. PERP_OK or a negative status. */
perp_status perp__contact_open(perp_contact_solver *solver, perp_contact_step *s);

/* v := what the rows that hold leave free, given the impulses and modes of an answer, its u, and v
 * as it has it, with bodies: active.c. PERP_OK or _MEMORY. */
perp_status perp__contact_hold(perp_contact_solver *solver, const double *r, const double *u,
                               const int8_t *modes, double *v);

/* Whether M falls into blocks, which then are found: problem.c. */
perp_status perp__contact_find_bodies(perp_contact_solver *solver, int32_t *found);

/* The exact zeros of a good answer: v and u where bodies are known, else u alone. PERP_OK or
 * _MEMORY: active.c. */
perp_status perp__contact_hold_best(perp_contact_solver *solver);

/* Whether velocities of 0 may be an answer: all that is told moves nothing, and statics was not
 * asked yet; and if so, and the best point is slow, the question: then r, v and u say that it
 * rests. PERP_OK or negative: statics/rest.c. */
bool perp__contact_may_rest(const perp_contact_solver *solver);
perp_status perp__contact_rest(perp_contact_solver *solver);

/* Whether that changes *place. */
static inline bool perp__put(double *place, double value)
{
    const bool changes = memcmp(place, &value, sizeof value) != 0;

    *place = value;
    return changes;
}

/* Writes the zeros of the velocities that the modes know: evaluation.c. */
void perp__contact_write_zeros(perp_contact_solver *solver, const int8_t *modes, double *u);

/* Makes W where only the bodies are known: problem.c. *made is 0 if it has more entries than 32-bit
 * indices number. PERP_OK or _MEMORY. */
perp_status perp__contact_delassus(perp_contact_solver *solver, int32_t *made);

/* Asks whether velocities exist that keep every u_n >= 0; if not, the proof is in solver->ray, and
 * has_ray and certificate are set: ray.c. PERP_OK, _MEMORY, _CALLBACK or _NOT_FINITE. */
perp_status perp__contact_find_ray(perp_contact_solver *solver);

/* Checks the direction in solver->ray and scales it; sets has_ray and certificate: ray.c. */
void perp__contact_keep_ray(perp_contact_solver *solver, const double *direction);

/* Reads the active set off solver->r and u and follows it to where it ends; the best point met is
 * left in the front door as any method's. PERP_OK or a negative status. */
perp_status perp__contact_polish_run(perp_contact_solver *solver);
/* Of a small problem whose W is there, before anything else: whether it is one; whether r, clipped,
 * is an answer as far as plain doubles tell, with u; and the same as above from r, at a small share
 * of the cost, considered only if within a few steps it ends with a set that stays; knows_u: u is
 * that of r. */
bool perp__contact_polish_suits(const perp_contact_solver *solver);
bool perp__contact_is_near(perp_contact_solver *solver);
perp_status perp__contact_polish_start(perp_contact_solver *solver, bool knows_u);
/* The same, from a few thousand sets of a fixed random sequence, each with a try of its own, until
 * one is an answer: milliseconds. */
perp_status perp__contact_polish_search(perp_contact_solver *solver);

/* ---- rigid bodies in the place of the dynamics, solver->rigid the caller's: rigid/ ---- */

/* v and q of the free velocities, and in `load` the sizes of the terms of q. */
void perp__rigid_load(perp_contact_solver *solver);

/* v and u of solver->r. */
void perp__rigid_velocities(perp_contact_solver *solver);

/* u := that of bodies that stand still, where impulses can move them. */
void perp__rigid_bias(const perp_contact_solver *solver, double *u);

/* For active.c: what constraints with one body are beside, and which of those that hold are pushed
 * by more than a carrier. */
void perp__rigid_beside(const perp_contact_solver *solver, const int8_t *holds, int32_t *beside,
                        int8_t *pushed);

#endif
