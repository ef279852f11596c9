/* Block principal pivoting, also known as the primal-dual active set method, for dense LCPs with
 * bounds. */
#ifndef PERP_LCP_BLOCK_PIVOTING_H
#define PERP_LCP_BLOCK_PIVOTING_H

#include "lcp/active_set/active_block.h"

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
    double *trial_z, *w, *x; /* n */
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

#endif
