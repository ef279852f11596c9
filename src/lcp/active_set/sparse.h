/* Primal-dual active sets on a sparse matrix, for whoever wants its last index set. */
#ifndef PERP_LCP_ACTIVE_SET_SPARSE_H
#define PERP_LCP_ACTIVE_SET_SPARSE_H

#include "lcp/active_set/nested.h"
#include "lcp/active_set/tridiagonal.h"
#include "lcp/method.h"

typedef struct perp__sparse_active_set {
    perp__lcp_work common;
    perp__tridiagonal_lcp tridiagonal;
    perp__nested nested;
    double *w;       /* n */
    double *product; /* n */
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
