/* What a method for frictional contact sees of a problem, and what it hands back, in the caller's
 * units. Checks, residuals, acceptance, exact zeros, timing and fall-backs live in the front door.
 *
 *   u = W r + q,   W = H M^-1 H' + compliance,   q = H M^-1 f + w
 *
 * The rows of contact k are starts[k] .. starts[k+1]-1: the normal, then dims[k] - 1 tangents,
 * then, where rolling[k] > 0, as many rows of rolling (2 in 3-D, 1 in 2-D), then, where spinning[k]
 * > 0, one of spinning (3-D). Tangential, rolling and spinning impulses lie in discs of radius mu
 * r_n, rolling r_n and spinning r_n, and each opposes its own part of u (maximal dissipation); the
 * normal ones obey 0 <= r_n perp u_n >= 0. With s = mu |u_t| + rolling |u_r| + spinning |u_s| this
 * is r in K, u + s e_n in K*, perpendicular (De Saxce & Feng 1998). Bilateral rows, u_i = 0 with
 * r_i of any sign, come last, as constraints of one row each: rows .. size-1. A two-sided contact
 * begins with two_sided[k] normals, u_N = 0 and r_N of any sign, has dims[k] rows in all, and |r_N|
 * in the place of r_n. */
#ifndef PERP_CONTACT_METHOD_H
#define PERP_CONTACT_METHOD_H

#include "base/arena.h"
#include "base/clock.h"
#include "contact/tuning.h"
#include "linalg/matrix.h"

struct perp__bodies; /* contact/bodies/bodies.h */

typedef struct perp__contact_control {
    double deadline; /* on perp__now()'s clock; 0: none */
    int32_t (*tick)(void *tick_user, int64_t iterations, double residual); /* nonzero: stop */
    void *tick_user;
} perp__contact_control;

/* -1 to go on, or the outcome to stop with. */
static inline int32_t perp__contact_asks_to_stop(const perp__contact_control *control,
                                                 int64_t iterations, double residual)
{
    if (control && control->tick && control->tick(control->tick_user, iterations, residual) != 0)
        return PERP_OUTCOME_STOPPED;
    if (control && control->deadline > 0.0 && perp__now() > control->deadline)
        return PERP_OUTCOME_TIME_LIMIT;
    return -1;
}

typedef struct perp__contact_problem {
    perp_context *context;
    int32_t contacts;
    int32_t rows;                 /* of the contacts */
    int32_t size;                 /* rows and bilateral rows */
    int32_t has_discs;            /* some contact rolls or spins: its cone is no Lorentz cone */
    const int32_t *starts;        /* contacts and bilateral rows + 1 */
    const int32_t *constraint_of; /* size: the contact, or contacts + the bilateral row */
    const int32_t *dims;          /* contacts: 1, 2 or 3; of two-sided ones all rows */
    const int32_t *two_sided; /* contacts: normals that hold both ways, 0 of others; NULL: none */
    const double *mu;         /* contacts, >= 0; not read where dims is 1 */
    const double *rolling;    /* contacts, >= 0; NULL: none */
    const double *spinning;   /* contacts, >= 0; NULL: none */
    const double *bound; /* contacts: r_n of those whose normal is no more than the bound of their
                            one tangent (bounded.h), 0 of others; NULL: none */
    const double *trace; /* contacts: t_k = trace(W_kk) > 0, but for a normal that is a bound; then
                            W_ii of the bilateral rows */
    const double *diagonal; /* size: W_ii */
    const double *q;        /* size */
    const double *omega;    /* contacts and bilateral rows: unit of the tested residual */
    const int32_t *part;    /* of each: its connected component, noise aside (parts.c); NULL: one */
    int32_t parts;
    int32_t leaks;         /* noise couples two parts */
    const perp__matrix *W; /* size by size, dense or CSC, maybe slightly unsymmetric; NULL where
                              only the bodies are known: perp__contact_delassus makes it */
    const struct perp__bodies *bodies; /* block-diagonal M with H; NULL where W was given */
    const double *half;                /* Y of W = Y'Y, `half_rows` by size, row-major with */
    int32_t half_rows;                 /* half_stride; NULL: not known */
    size_t half_stride;
    double tol;
    double enough; /* below this residual a method goes on for a few steps only; 0: no such limit */
    int64_t iteration_limit; /* <= 0: the method's own */
    int32_t yields;          /* another method follows at that limit: stop early where the rate
                               shows that it will not do */
    int32_t chosen;          /* by the caller, by name: not a step of `auto` */
    const perp__contact_control *control;
    int32_t cone; /* 0: exact, and so for every method but lemke; else edges of a polyhedron */
} perp__contact_problem;

typedef struct perp__contact_iterate {
    double *r;     /* size; on entry the start, projected onto the cones */
    double *u;     /* size; W r + q as the method last knew it */
    int8_t *modes; /* contacts, PERP_CONTACT_...: the final active set, if has_modes */
    int32_t has_modes;
    int32_t warm;    /* on entry: r is a start, */
    int32_t given;   /* and one that the caller gave */
    int32_t attempt; /* on entry: 0, then 1, 2, ... for methods that can start afresh differently */
    int32_t folds;   /* on return: the path to an answer ended near its start */
    double residual; /* the method's own estimate of the tested residual */
    perp_outcome outcome;
    int64_t iterations;
    double *ray; /* size: a direction in which impulses may grow for ever; with outcome ray */
} perp__contact_iterate;

typedef struct perp__contact_method {
    int32_t id;       /* PERP_CONTACT_METHOD_... */
    size_t work_size; /* bytes of the method's own workspace struct */
    int32_t attempts; /* how often it may start anew before it has failed */
    int32_t needs_delassus;
    /* PERP_OK, or PERP_ERROR_ARGUMENT with a message, where the method can't take the problem; NULL
     * where it takes all */
    perp_status (*check)(const perp__contact_problem *problem);
    /* Takes the workspace arrays; `work` is the method's struct, problem its first member. */
    void (*layout)(perp__arena *arena, void *work);
    /* PERP_OK with iterate->outcome, or PERP_ERROR_MEMORY. */
    perp_status (*solve)(void *work, perp__contact_iterate *iterate);
    /* Releases what is not in the arena (factorisations); may be NULL. */
    void (*release)(void *work);
    /* Asks for the memory that solve() would beyond the arrays; NULL: it asks for none. PERP_OK or
     * PERP_ERROR_MEMORY. */
    perp_status (*reserve)(void *work);
} perp__contact_method;

/* First member of every method's workspace struct. */
typedef struct perp__contact_work {
    const perp__contact_problem *problem;
} perp__contact_work;

extern const perp__contact_method perp__contact_sweep;
extern const perp__contact_method perp__contact_lemke;
extern const perp__contact_method perp__contact_admm;
extern const perp__contact_method perp__contact_proximal;

#endif
