/* All solutions of a small problem, by the tree over index sets: which variables are at their lower
 * bound, at their upper one, or between. All is in scaled coordinates but for the reports. */
#ifndef PERP_LCP_ALL_ALL_H
#define PERP_LCP_ALL_ALL_H

#include "lcp/solver.h"
#include "patterns/patterns.h"

/* Entries this small beside their row are rounding. */
#define PERP__ALL_NOISE 1e-10

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
typedef struct perp__tableau {
    double *T;       /* n by n + 1, row-major */
    int8_t *kind;    /* n */
    int8_t *basic;   /* n */
    int8_t *columns; /* n: variables between their bounds without a pivot */
    int32_t pending; /* as many columns as rows of kind equation */
} perp__tableau;

typedef struct perp__lcp_all {
    perp_context *context;
    perp_lcp_solver *solver; /* the problem, its scaling, evaluation and polish */
    perp__arena arena;
    perp__pattern_tree tree;
    perp__answers answers; /* degenerate points and families */
    perp__polyhedron polyhedron;
    int32_t n;
    perp__tableau *levels;       /* n + 1; the first has D M D and D q */
    double *row_sizes;           /* largest entries of the rows of D M D */
    int8_t *places;              /* n: the pattern */
    double *z;                   /* n */
    double *origin, *directions; /* n, n by n: a singular leaf's z as a function of t */
    double *work;                /* (n + 1)^2 */
    perp_lcp_visit visit;
    void *user;
    perp_lcp_enumeration result;
    int32_t aborted; /* by a negative answer of the visitor or the monitor */
    int32_t silent;  /* the caller wants to hear no more */
    int64_t limit;   /* on nodes; 0: none */
    int32_t first;   /* end at the first solution that the gate takes, */
    int32_t found;   /* which is left in solver->z, with w_high */
} perp__lcp_all;

static inline double *perp__row_of(const perp__lcp_all *all, const perp__tableau *level, int32_t i)
{
    return level->T + (size_t)i * (size_t)(all->n + 1);
}

/* Visits all index sets that are not ruled out on the way. */
perp_status perp__lcp_all_search(perp__lcp_all *all);

/* A regular leaf, all signs right within some slack; all->z holds its point. */
perp_status perp__lcp_all_point(perp__lcp_all *all);

/* A singular leaf whose equations agree. */
perp_status perp__lcp_all_family(perp__lcp_all *all, const perp__tableau *level);

/* Puts the scaled z into the solver, variables at a bound exactly there, and evaluates it. */
perp__evaluation perp__lcp_all_evaluate(perp__lcp_all *all, const int8_t *places, const double *z);

/* The front door's test, but for rows that others hide: of such a point nobody knows. Points of a
 * family are not refined: `size` allows for their rounding. */
bool perp__lcp_all_is_solution(perp__lcp_all *all, const perp__evaluation *residuals, double size);

/* Whether a family has an answer: of perp__answers. */
int32_t perp__lcp_all_holds(void *user, perp__answer *outer, const perp__answer *inner);

/* Tells the visitor; the answer's points are in the caller's units afterwards. */
void perp__lcp_all_report(perp__lcp_all *all, perp__answer *answer);

/* ---- the last word of `auto` on small problems ----------------------------------------------- */

/* Whether the solver's problem is small enough and its method `auto`. */
bool perp__has_last_word(const perp_lcp_solver *solver);

/* Searches the index sets and keeps the first solution that the gate takes as the best candidate.
 * PERP_OK, _MEMORY, or _CALLBACK if the monitor aborts. */
perp_status perp__last_word(perp_lcp_solver *solver);

void perp__last_word_release(perp_lcp_solver *solver);

#endif
