/* Coarser and coarser problems of a sparse matrix that need not be symmetric, for index sets to
 * start from. */
#ifndef PERP_LCP_AGGREGATED_H
#define PERP_LCP_AGGREGATED_H

#include "lcp/method.h"

/* The problem on one level, in the caller's units on the finest. */
typedef struct perp__aggregated_level {
    int32_t n;
    perp__matrix M;
    int32_t *aggregate; /* n: the variable of the next level */
    double *q, *lower, *upper, *z, *w;
    int32_t *own_starts, *own_rows; /* M's memory, but for the finest level */
    double *own_values, *diagonal;
    size_t entries;
    perp__arena arena;
} perp__aggregated_level;

typedef struct perp__aggregated {
    perp_context *context;
    int32_t levels;                /* 0: not built */
    perp__aggregated_level *level; /* PERP__LEVELS of them, from the first building on */
    int32_t *position, *members;   /* n; 2n */
    double *ones, *norms;          /* n */
    int32_t *zeros;                /* n */
    perp__arena arena;
} perp__aggregated;

/* Whether coarser levels are worth their making: large unsymmetric matrices with the signs of an
 * M-matrix or nearly so. */
int32_t perp__aggregated_suits(const perp__lcp_problem *problem);

/* The levels of the problem's matrix, where they are not built yet; none if the deadline is over.
 * PERP_OK or _MEMORY. */
perp_status perp__aggregated_build(perp__aggregated *coarse, const perp__lcp_problem *problem);

/* q and bounds of all levels, and z on the last. */
void perp__aggregated_load(perp__aggregated *coarse, const perp__lcp_problem *problem);

/* z of level k from that of level k + 1. */
void perp__aggregated_prolong(perp__aggregated *coarse, int32_t k);

/* Projected Gauss-Seidel, there and back, on z of level k. */
void perp__aggregated_smooth(perp__aggregated *coarse, int32_t k);

/* Level k > 0 as a problem of its own, which borrows the settings of `problem` and `block`. */
void perp__aggregated_pose(perp__aggregated *coarse, int32_t k, const perp__lcp_problem *problem,
                           perp__sparse_block *block, perp__lcp_problem *own);

void perp__aggregated_release(perp__aggregated *coarse);

#endif
