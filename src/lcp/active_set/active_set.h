/* Active sets, and what finds the first one on large sparse matrices. */
#ifndef PERP_LCP_ACTIVE_SET_H
#define PERP_LCP_ACTIVE_SET_H

#include "lcp/method.h"
#include "linalg/multigrid/multigrid.h"
#include "linalg/tridiagonal.h"

/* Exchanges of whole blocks without progress before single ones. */
#define PERP__PATIENCE 10

/* Active sets of many small problems end after so many rounds; these, and a look for a basis near
 * the solution's, go on otherwise after so many in a row that did not help. */
#define PERP__CRASH_ROUNDS 24
#define PERP__CRASH_PATIENCE 3

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
bool perp__nested_run(perp__nested *nested, const perp__lcp_problem *problem, bool warm, double *z,
                      int8_t *places, int64_t *iterations, perp_outcome *request);

void perp__nested_release(perp__nested *nested);

/* ---- active_set.c ---- */

/* Primal-dual active sets, for whoever wants the last one. */

typedef struct perp__active_set {
    perp__lcp_work common;
    perp__tridiagonal_lcp tridiagonal;
    perp__nested nested;
    double *w;       /* n */
    double *step;    /* n */
    double *weights; /* n, of a penalty */
    double residual; /* of the last equations */
    double rho;      /* proximal term of their block */
    int32_t wrong;   /* signs of their solution; 0: it solves the problem */
    int32_t count;
    int32_t *active; /* n: the variables between their bounds, `count` of them */
    int8_t *next;    /* n: places after a full exchange */
} perp__active_set;

/* The arrays for common.problem. */
void perp__active_set_layout(perp__arena *arena, void *work);

typedef struct perp__active_set_limits {
    int64_t iterations;
    int32_t patience; /* full exchanges in vain, where M need not be an M-matrix */
    int32_t singles;  /* then single ones; 0: the end as `stalled` */
    int32_t few;      /* so many wrong signs or less are the end as `stalled` */
    double rho;       /* the proximal term from the first singular block on; 0: that is the end */
} perp__active_set_limits;

/* From iterate->z; ends with the last index set in iterate->places. PERP_OK or _MEMORY. */
perp_status perp__active_set_run(perp__active_set *work, perp__lcp_iterate *iterate,
                                 const perp__active_set_limits *limits);

/* The side on which z - w lies: the active sets of the natural map. */
void perp__active_set_places(perp__active_set *work, const double *z, int8_t *places);

/* What is not in the arena. */
void perp__active_set_release(void *work);

/* perp__lcp_iterate's, with the factors of the last equations. */
int32_t perp__active_set_correct(void *work, const double *residual, double *step);

#endif
