/* Where Lemke's method starts if not at the caller's problem as it is: block principal pivoting
 * solves most problems whose matrix is positive definite, and a start that the caller gives names a
 * basis. Only the cold start keeps what makes Lemke's method process copositive matrices, so every
 * other one is a first try, after which the cold one follows. */
#include <string.h>

#include "lcp/lemke.h"

/* From this size on a crash costs less than the pivots that it saves. */
#define PERP__CRASH_FROM 8
/* A crash ends after so many rounds, and after so many in a row that did not help. */
#define PERP__CRASH_ROUNDS 12
#define PERP__CRASH_PATIENCE 3
/* The basis it ends with is taken if at most this part of the indices is infeasible. */
#define PERP__CRASH_PART 8

/* Positive definite matrices have a positive diagonal; contact problems with friction do not. */
static int32_t diagonal_is_positive(const perp__matrix *M)
{
    int32_t i;

    for (i = 0; i < M->rows; i++)
        if (!(M->values[(size_t)i * (M->row_stride + M->column_stride)] > 0.0))
            return 0;
    return 1;
}

static int32_t is_promising(const perp__lcp_problem *p)
{
    return p->settings->crash && !p->M->column_starts && p->n >= PERP__CRASH_FROM &&
           diagonal_is_positive(p->M);
}

static enum perp__lemke_guess crash(perp__lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;
    const size_t n = (size_t)p->n;
    perp__block_pivoting *b = &l->crash;
    perp_outcome outcome;

    if (!l->examined)
        l->symmetric = perp__is_symmetric(p);
    l->examined = 1;
    b->active.block = l->tableau.T;
    perp__active_block_begin(&b->active, p, l->symmetric);
    b->active.definite = 1;
    b->problem = p;
    b->patience = PERP__CRASH_PATIENCE;
    b->single_patience = 0;
    b->round_limit = PERP__CRASH_ROUNDS;
    if (p->iteration_limit > 0 && p->iteration_limit < b->round_limit)
        b->round_limit = p->iteration_limit;
    memcpy(b->places, l->places, n);
    outcome = perp__block_pivoting_run(b);
    l->spent = b->rounds;
    if (outcome == PERP_OUTCOME_SOLVED || outcome == PERP_OUTCOME_STOPPED ||
        outcome == PERP_OUTCOME_TIME_LIMIT ||
        (outcome == PERP_OUTCOME_ITERATION_LIMIT && b->round_limit == p->iteration_limit)) {
        iterate->outcome = outcome;
        memcpy(iterate->z, b->z, n * sizeof *b->z);
        memcpy(iterate->places, b->places, n);
        iterate->has_places = 1;
        iterate->iterations = b->rounds;
        if (outcome == PERP_OUTCOME_SOLVED)
            iterate->correct = perp__lemke_correct_crash;
        return PERP__GUESS_END;
    }
    if (b->infeasible > p->n / PERP__CRASH_PART)
        return PERP__GUESS_NONE;
    memcpy(l->places, b->places, n);
    return PERP__GUESS_BASIS;
}

enum perp__lemke_guess perp__lemke_guess_basis(perp__lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;
    enum perp__lemke_guess guess = PERP__GUESS_NONE;

    if (p->settings->pivot_rule != PERP_PIVOT_HARRIS)
        return guess;
    if (iterate->warm)
        perp__places_of(p, iterate->z, l->places);
    else
        perp__block_pivoting_start(p, l->places);
    if (is_promising(p))
        guess = crash(l, iterate);
    return guess == PERP__GUESS_NONE && iterate->warm ? PERP__GUESS_BASIS : guess;
}
