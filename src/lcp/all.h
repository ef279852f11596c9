/* The enumeration of all solutions, in parts: the tree of index sets, the faces found at its
 * leaves, the reports. Everything is in scaled coordinates but for the reports. */
#ifndef PERP_LCP_ALL_H
#define PERP_LCP_ALL_H

#include "lcp/solver.h"
#include "linalg/cone.h"

/* Most variables: a bit of two words for each constraint of a face. */
#define PERP__LARGEST_ALL 60

/* What a row of the tableau stands for. */
enum perp__row_kind {
    PERP__ROW_W_FREE = 0,   /* w_i, not restricted (yet) */
    PERP__ROW_W_LOWER = 1,  /* w_i >= 0 */
    PERP__ROW_W_UPPER = 2,  /* w_i <= 0 */
    PERP__ROW_EQUATION = 3, /* w_i = 0, not used as a pivot row yet */
    PERP__ROW_Z = 4         /* z of the variable `basic` */
};

/* The state after the first `depth` variables got their places: row i's quantity is
 * T[i][n] + sum_j T[i][j] z_j over the free columns j: those not decided, and `columns`. */
typedef struct perp__tree_level {
    double *T;       /* n by n + 1, row-major */
    int8_t *kind;    /* n */
    int8_t *basic;   /* n */
    int8_t *columns; /* n: variables between their bounds without a pivot */
    int32_t pending; /* as many columns as rows of kind equation */
} perp__tree_level;

/* All solutions of one complementary index set: hull of the vertices + cone of the rays. */
typedef struct perp__face {
    struct perp__face *next;
    int8_t *places;
    double *points; /* vertices, then rays: n each, scaled */
    int32_t vertices, rays;
    int32_t dimension;
    double residual; /* the largest tested residual of a vertex */
} perp__face;

typedef struct perp__all {
    perp_context *context;
    perp_lcp_solver *solver; /* the problem, its scaling, evaluation and polish */
    perp__arena arena;
    perp__cone cone;
    int32_t n;
    double *S;                /* D M D, row-major */
    double *row_sizes;        /* largest entries of its rows */
    perp__tree_level *levels; /* n + 1 */
    int8_t *places;
    double *z;                   /* n */
    double *origin, *directions; /* n, n by n: a singular leaf's z as a function of t */
    double *work;                /* (n + 1)^2 */
    int32_t *codes;              /* n */
    perp__face *faces;           /* degenerate points and families, none within another */
    perp_lcp_visit visit;
    void *user;
    perp_lcp_enumeration result;
    int32_t ended;      /* an outcome has been set: unwind */
    int32_t aborted;    /* by a negative answer of the visitor or the monitor */
    int32_t incomplete; /* a family was too large */
    int32_t silent;     /* the caller wants to hear no more */
    int64_t limit;      /* on nodes; 0: none */
    int32_t first;      /* end at the first solution that the gate takes, */
    int32_t found;      /* which is left in solver->z, with w_high */
} perp__all;

/* Lays out the memory and the equilibrated matrix of the solver's problem, which is scaled
 * (perp__scale_problem). PERP_OK or _MEMORY. */
perp_status perp__all_prepare(perp__all *all);

/* Visits all index sets that are not ruled out on the way. A negative status ends it, `ended` too.
 */
perp_status perp__all_search(perp__all *all);

/* The leaf whose level is all->levels[n]. */
perp_status perp__all_leaf(perp__all *all);

/* A regular leaf, all signs right within some slack; all->z holds its point. */
perp_status perp__all_point(perp__all *all);

/* A singular leaf whose equations agree. */
perp_status perp__all_family(perp__all *all, const perp__tree_level *level);

/* Puts the scaled z into the solver, variables at a bound of all->places exactly there, and
 * evaluates it. */
perp__evaluation perp__all_evaluate(perp__all *all, const double *z);

/* In the search for the first solution: takes the point just evaluated if the gate does. */
void perp__all_offer(perp__all *all, const perp__evaluation *worth);

/* The front door's test. Points of a family are not refined: `size` allows for their rounding. */
int32_t perp__all_is_solution(const perp__all *all, const perp__evaluation *worth, double size);

/* Keeps a face unless another one holds it, drops those that it holds; takes `points` over (also
 * on failure). */
perp_status perp__all_keep(perp__all *all, const int8_t *places, double *points, int32_t vertices,
                           int32_t rays, double residual);

/* Whether z = origin + sum t_k directions_k, for all t, keeps the equations of a face kept. */
int32_t perp__all_is_covered(const perp__all *all, const double *origin, const double *directions,
                             int32_t count);

void perp__all_release_faces(perp__all *all);

/* Reports what was kept. */
perp_status perp__all_report_faces(perp__all *all);

/* Tells the visitor of one solution or family. */
perp_status perp__all_report(perp__all *all, const perp__face *face);

#endif
