/* Active sets: block pivoting on a dense matrix, primal-dual sets on a sparse one, and what these
 * work with. */
#ifndef PERP_LCP_ACTIVE_SET_H
#define PERP_LCP_ACTIVE_SET_H

#include "lcp/method.h"
#include "linalg/multigrid/multigrid.h"
#include "linalg/tridiagonal.h"

/* Exchanges of whole blocks without progress before single ones. */
#define PERP__PATIENCE 10

/* A look for a basis near the solution's, and active sets of many small problems, end after so many
 * rounds, and go on otherwise after so many in a row that did not help. */
#define PERP__CRASH_ROUNDS 24
#define PERP__CRASH_PATIENCE 3

/* ---- active_block.c ---- */

/* Linear systems with the active block M_AA of a dense matrix, for sets A that change from one to
 * the next.
 *
 * The block of some set A0 is factored: by Cholesky where M is symmetric and the block positive
 * definite, else by LU. While A differs from A0 by few indices, what entered (E) and what left (L)
 * borders the old block,
 *   [ M_00  M_0E  -I_0L ] [x_0]   [r_0]
 *   [ M_E0  M_EE    0   ] [x_E] = [r_E],
 *   [-I_L0   0      0   ] [w_L]   [ 0 ]
 * and costs solves with the old factors and one with the Schur complement of M_00. */

/* What a choice of A led to. */
enum perp__block_state {
    PERP__BLOCK_READY = 0,
    PERP__BLOCK_INDEFINITE = 1, /* only where definite blocks alone were asked for */
    PERP__BLOCK_SINGULAR = 2
};

typedef struct perp__active_block {
    const perp__matrix *M; /* dense, by columns */
    perp__lcp_control *control;
    int32_t symmetric;     /* up to rounding */
    int32_t definite;      /* accept blocks only that M positive definite could have */
    int32_t by_cholesky;   /* how the block is factored */
    int32_t count;         /* of A0; 0: nothing is factored */
    int32_t *order;        /* n: A0 */
    int32_t *position;     /* n: place in the order, or -1 */
    double *block;         /* n by n: the factors */
    int32_t *pivots;       /* n */
    int32_t capacity;      /* most changes that are kept */
    int32_t kept;          /* changes with a column below */
    int32_t *changed;      /* index of a kept change */
    int32_t *column_of;    /* n: the kept change of an index, or -1 */
    double *border;        /* n by capacity: rows of the lower left block, as columns */
    double *solved;        /* n by capacity: old block^-1 times columns of the upper right block */
    double *corner;        /* capacity^2: lower right block - border' solved */
    int32_t changes;       /* of the kept ones, those that tell A from A0 */
    int32_t *used;         /* which they are */
    double *schur;         /* capacity^2: their corner, factored */
    int32_t *schur_pivots; /* capacity */
    double *x, *y;         /* n and capacity */
} perp__active_block;

/* Takes the arrays; `block` too unless the caller lends n by n doubles by setting it afterwards. */
void perp__active_block_layout(perp__arena *arena, perp__active_block *b, int32_t n, int32_t lent);

/* Forgets all factors and points to the problem's matrix (dense). */
void perp__active_block_begin(perp__active_block *b, const perp__lcp_problem *problem,
                              int32_t symmetric);

/* Makes ready for A = {i: places_i is PERP__BETWEEN}. */
enum perp__block_state perp__active_block_choose(perp__active_block *b, const int8_t *places);

/* M_AA r_A := r_A; the other entries of r are not touched. `places` as chosen. */
void perp__active_block_solve(perp__active_block *b, const int8_t *places, double *r);

/* ---- block_pivoting.c ---- */

/* Block principal pivoting, also known as the primal-dual active set method, for dense LCPs with
 * bounds. */

typedef struct perp__block_pivoting {
    perp__active_block active;
    const perp__lcp_problem *problem;
    int64_t round_limit;
    int32_t patience; /* rounds of whole blocks without fewer infeasibilities */
    int32_t few;      /* infeasibilities from which on it is the next one */
    int32_t patience_of_few;
    int32_t single_patience; /* and of one index at a time, after those */
    int8_t *places;          /* n, enum perp__place: the start; at the end the best index set met */
    double *z;               /* n, scaled: its point */
    int8_t *trial_places;    /* n */
    int8_t *next;            /* n: where the trial's indices belong */
    double *trial_z, *w;     /* n */
    int64_t rounds;          /* exchanges made */
    int32_t infeasible;      /* indices of the best set; 0: it solves the problem */
} perp__block_pivoting;

void perp__block_pivoting_layout(perp__arena *arena, perp__block_pivoting *b, int32_t n,
                                 int32_t lent);

/* Pivots from `places` on (a cold start: perp__block_pivoting_start). Returns the outcome: solved,
 * stalled, singular, iteration limit, or what perp__lcp_tick asked for. */
perp_outcome perp__block_pivoting_run(perp__block_pivoting *b);

/* Every variable at a finite bound, free ones between. */
void perp__block_pivoting_start(const perp__lcp_problem *problem, int8_t *places);

/* The index set of a point: between strictly means between its bounds. */
void perp__places_of(const perp__lcp_problem *problem, const double *z, int8_t *places);

/* ---- tridiagonal.c ---- */

/* The LCP with a tridiagonal M-matrix, in time proportional to n. */

enum {
    PERP__TRIDIAGONAL_NO = 0,   /* no M-matrix even without its positive couplings */
    PERP__TRIDIAGONAL_FAR = 1,  /* places where many signs are wrong */
    PERP__TRIDIAGONAL_NEAR = 2, /* where few are */
    PERP__TRIDIAGONAL_SOLVED = 3
};

typedef struct perp__tridiagonal_lcp {
    struct perp__run *runs; /* n */
    double *q;              /* n, of the problem with its bounds shifted to 0 */
    double *x;              /* n */
    int32_t *active;        /* n */
    perp__tridiagonal Z;    /* the matrix without its positive couplings */
    int32_t examined;       /* what follows is that of the problem */
    int32_t suits;          /* Z is an M-matrix */
    double sign;            /* 1, or -1: the upper bounds count */
} perp__tridiagonal_lcp;

void perp__tridiagonal_lcp_layout(perp__arena *arena, perp__tridiagonal_lcp *work, size_t n);

/* Finds the index set of the solution, and z. problem->block must be tridiagonal. *found says what
 * came of it; z is meant to be used with PERP__TRIDIAGONAL_SOLVED only. PERP_OK or _MEMORY. */
perp_status perp__tridiagonal_lcp_solve(perp__tridiagonal_lcp *work,
                                        const perp__lcp_problem *problem, int8_t *places, double *z,
                                        int32_t *found);

/* ---- nested.c ---- */

/* Nested iteration: the index set of a large problem from those of ever coarser ones. */

/* The problem on one level. */
typedef struct perp__nested_level {
    const double *q, *lower, *upper;
    double *own_q, *own_lower, *own_upper; /* memory of the above, but for the finest level */
    double *z, *residual;                  /* n */
    int8_t *places;                        /* n, enum perp__place */
} perp__nested_level;

typedef struct perp__nested {
    perp__multigrid *grid;
    perp__nested_level *level; /* grid->levels of them */
    double *correction;        /* n of the finest level */
    int32_t *active;           /* n of the finest level: rows between their bounds */
    perp__arena arena;
} perp__nested;

/* Makes room for the levels of `grid`, which stays the caller's. PERP_OK or _MEMORY. */
perp_status perp__nested_fit(perp__nested *nested, perp__multigrid *grid);

/* Finds z and places near the solution's. With `warm`, from z on the finest level alone. Returns 0
 * if z overflowed. Adds its steps on the finest level to *iterations; *request is what stopped it,
 * or -1. */
int32_t perp__nested_run(perp__nested *nested, const perp__lcp_problem *problem, int32_t warm,
                         double *z, int8_t *places, int64_t *iterations, perp_outcome *request);

void perp__nested_release(perp__nested *nested);

/* ---- sparse.c ---- */

/* Primal-dual active sets on a sparse matrix, for whoever wants its last index set. */

typedef struct perp__sparse_active_set {
    perp__lcp_work common;
    perp__tridiagonal_lcp tridiagonal;
    perp__nested nested;
    double *w;       /* n */
    double *step;    /* n */
    double *weights; /* n, of a penalty */
    double residual; /* of the last equations */
    double rho;      /* proximal term of their block */
    int32_t *active; /* n: the variables between their bounds */
    int8_t *next;    /* n: places after a full exchange */
} perp__sparse_active_set;

/* The arrays for common.problem. */
void perp__sparse_active_set_layout(perp__arena *arena, void *work);

typedef struct perp__active_set_limits {
    int64_t iterations;
    int32_t patience; /* full exchanges in vain, where M need not be an M-matrix */
    int32_t singles;  /* then single ones; 0: the end as `stalled` */
    int32_t few;      /* so many wrong signs or less are the end as `stalled` */
    double rho;       /* the proximal term from the first singular block on; 0: that is the end */
} perp__active_set_limits;

/* From iterate->z; ends with the last index set in iterate->places. PERP_OK or _MEMORY. */
perp_status perp__sparse_active_set_run(perp__sparse_active_set *work, perp__lcp_iterate *iterate,
                                        const perp__active_set_limits *limits);

/* The side on which z - w lies: the active sets of the natural map. */
void perp__sparse_active_set_places(perp__sparse_active_set *work, const double *z, int8_t *places);

/* What is not in the arena. */
void perp__sparse_active_set_release(void *work);

/* perp__lcp_iterate's, with the factors of the last equations. */
int32_t perp__sparse_active_set_correct(void *work, const double *residual, double *step);

#endif
