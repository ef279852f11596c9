/* What a method sees of a problem, and what it hands back. Everything is in scaled coordinates:
 * M = D M_caller D, q = D q_caller / omega, z = D^-1 z_caller / omega, with powers of two, so that
 * the natural residual of this problem is the tested residual of docs/lcp.md. Checks,
 * timing, acceptance, polish and fall-backs live in the front door. */
#ifndef PERP_LCP_METHOD_H
#define PERP_LCP_METHOD_H

#include <float.h>
#include <math.h>

#include <perp/lcp.h>

#include "base/arena.h"
#include "base/sweeps.h"
#include "linalg/matrix.h"
#include "linalg/sparse_block.h"

/* Dense problems up to this size are kept by columns, each of this length. */
#define PERP__SMALL_LENGTH 32

/* The default limit of iterations that take factors. */
#define PERP__ITERATIONS 500

/* Pivots below this part of their column's largest entry make no good basis to start from. */
#define PERP__POOR_PIVOT sqrt(DBL_EPSILON)

/* Where z_i stands relative to its bounds. */
enum perp__place {
    PERP__AT_LOWER = PERP_PLACE_LOWER,
    PERP__AT_UPPER = PERP_PLACE_UPPER,
    PERP__BETWEEN = PERP_PLACE_BETWEEN,
    PERP__FIXED = PERP_PLACE_FIXED
};

/* The place of a row by the natural map, above = z - l, below = z - u: the side of z - w on which z
 * lies. */
static inline int8_t perp__place(bool is_fixed, double above, double below, double w)
{
    return is_fixed     ? PERP__FIXED
           : above <= w ? PERP__AT_LOWER
           : below >= w ? PERP__AT_UPPER
                        : PERP__BETWEEN;
}

/* Stop requests, told apart by the front door. Filled by perp__lcp_tick. */
typedef struct perp__lcp_control {
    perp_lcp_monitor monitor;
    void *monitor_user;
    double deadline; /* on perp__now()'s clock; 0: none */
    double residual; /* with a deadline: seconds that M z + q takes */
    int32_t method;
    int32_t aborted; /* the monitor returned a negative number */
    int32_t late;    /* the next operation would have ended after the deadline */
} perp__lcp_control;

typedef struct perp__lcp_problem {
    perp_context *context;
    int32_t n;
    int64_t setup;         /* number of the set-up: it changes with the matrix */
    const perp__matrix *M; /* dense by columns, or CSC where that pays */
    const double *row_norms;
    const perp__matrix *caller;      /* M as it came, not scaled */
    const double *q, *lower, *upper; /* scaled; infinite bounds stay infinite */
    perp__sparse_block *block;       /* blocks of M, factored */
    const perp_lcp_settings *settings;
    double tol;              /* where a method may stop: settings->tol, or less */
    int64_t iteration_limit; /* <= 0: the method's own */
    int32_t yields;          /* > 0: another method follows: after so many iterations stop if the
                               rate shows that the limit will not do */
    perp__lcp_control *control;
} perp__lcp_problem;

typedef struct perp__lcp_iterate {
    double *z;      /* n, scaled; on entry the start, projected onto the bounds */
    int8_t *places; /* n, enum perp__place: the final index set. A method that has none of its own
                       leaves it to the front door by returning has_places = 0 */
    double *ray;    /* n, scaled direction of z; only with outcome ray */
    double
        *covering; /* n, what the artificial variable adds to w along the ray; with that outcome */
    int32_t has_places;
    /* May be set by the method, with places: step := M_AA^-1 residual_A, A the places between the
     * bounds, by what the method holds of its last basis and as accurate as that is. Both have n
     * scaled entries and are 0 outside of A. Returns 0 if it cannot. */
    int32_t (*correct)(void *work, const double *residual, double *step);
    int32_t warm;    /* on entry: z holds a start the caller gave */
    int32_t missing; /* on entry: the one i with z_i > 0 and w_i > 0 at a feasible z; else -1 */
    int32_t attempt; /* on entry: 0, then 1, 2, ... for methods that can start afresh differently */
    int32_t rays;    /* on entry: verified rays that attempts of this solve ended in */
    int32_t far_off; /* set where another attempt is better than a polish of this point */
    int32_t improvable; /* set where another attempt may bring digits that the polish can't */
    perp_outcome outcome;
    int64_t iterations;
    int32_t paused; /* on return: the method is not at its end, but the polish may finish. If it
                       does not, the next attempt goes on and does not read z */
} perp__lcp_iterate;

typedef struct perp__lcp_method {
    int32_t id;       /* PERP_LCP_... */
    size_t work_size; /* bytes of the method's own workspace struct */
    int32_t attempts; /* how often it may start afresh (iterate->attempt) before it has failed */
    /* 1: the layout depends on sizes, storage and the number of free variables alone: it runs
     * where these change, not at every set-up. */
    int32_t by_shape;
    /* Checks that the method can take the problem: PERP_OK, or PERP_ERROR_ARGUMENT with a message.
     * NULL: it takes any M, any bounds. */
    perp_status (*check)(const perp__lcp_problem *problem);
    /* Takes the workspace arrays; `work` is the method's struct, problem in its first member. */
    void (*layout)(perp__arena *arena, void *work);
    /* Runs. PERP_OK with iterate->outcome, or PERP_ERROR_MEMORY / _CALLBACK. */
    perp_status (*solve)(void *work, perp__lcp_iterate *iterate);
    /* Releases what is not in the arena (factorisations); may be NULL. */
    void (*release)(void *work);
} perp__lcp_method;

/* First member of every method's workspace struct. */
typedef struct perp__lcp_work {
    const perp__lcp_problem *problem;
} perp__lcp_work;

extern const perp__lcp_method perp__lcp_lemke;
extern const perp__lcp_method perp__lcp_pgs;
extern const perp__lcp_method perp__lcp_fischer;
extern const perp__lcp_method perp__lcp_active_set;

/* Calls the monitor and looks at the deadline. Returns -1 to go on, or the outcome to stop with
 * (stopped, time_limit); control->aborted tells an abort. Reads the clock only with a deadline. */
perp_outcome perp__lcp_tick(perp__lcp_control *control, int64_t iterations, double residual);

/* Whether there is time for what takes as long as so many residuals: what would end too late is not
 * begun. */
bool perp__lcp_has_time(perp__lcp_control *control, double residuals);

/* Checks M, which has to be square, and the bounds; fills *copy. */
perp_status perp__lcp_problem_read(perp_context *context, perp__matrix *copy, const perp_matrix *M,
                                   const double *lower, const double *upper);

/* w = M z + q */
static inline void perp__lcp_affine(const perp__lcp_problem *problem, const double *z, double *w)
{
    perp__multiply(problem->M, z, w);
    for (int32_t i = 0; i < problem->n; i++)
        w[i] += problem->q[i];
}

/* A sweep of projected Gauss-Seidel by columns, which keeps w = M z + q up to date. */
void perp__lcp_sweep(const perp__lcp_problem *problem, double *z, double *w);

/* A bound that is finite, the lower one first, or 0. */
static inline double perp__finite_bound(double lower, double upper)
{
    return isfinite(lower) ? lower : isfinite(upper) ? upper : 0.0;
}

#endif
