/* Where Lemke's method starts if not at the caller's problem as it is: block principal pivoting
 * solves most problems whose matrix is positive definite, and a start that the caller gives names a
 * basis. Only the cold start keeps what makes Lemke's method process copositive matrices, so every
 * other one is a first try, after which the cold one follows. */
#include <math.h>
#include <string.h>

#include "lcp/lemke/lemke.h"

/* From these sizes on a crash costs less than the pivots that it saves: one round is a Cholesky
 * factorisation of the active block where M is symmetric, else LU. */
#define CRASH_FROM 8
#define CRASH_LU_FROM 256
/* The more of M is skew, the more rounds it takes: from this part on too many for LU. */
#define CRASH_SKEW 1.5
/* A crash ends after so many rounds, and after so many in a row that did not help. */
#define CRASH_ROUNDS 12
#define CRASH_PATIENCE 3
/* The basis it ends with is taken if at most this part of the indices is infeasible. */
#define CRASH_PART 8

/* Positive definite matrices have a positive diagonal; contact problems with friction do not. */
static int32_t diagonal_is_positive(const perp__matrix *M)
{
    int32_t i;

    for (i = 0; i < M->rows; i++)
        if (!(M->values[(size_t)i * (M->row_stride + M->column_stride)] > 0.0))
            return 0;
    return 1;
}

/* |M - M'| / |M + M'| in the Frobenius norm, scaled; in tiles, for the caches. */
static double skewness(const perp__lcp_problem *p)
{
    enum { TILE = 16 };
    const perp__matrix *M = p->M;
    const double *d = p->factors;
    double skew = 0.0, even = 0.0;
    int32_t i, j, I, J;

    for (J = 0; J < p->n; J += TILE)
        for (I = 0; I < p->n; I += TILE)
            for (j = J; j < J + TILE && j < p->n; j++)
                for (i = I; i < I + TILE && i < j; i++) {
                    const double a =
                        M->values[(size_t)i * M->row_stride + (size_t)j * M->column_stride];
                    const double b =
                        M->values[(size_t)j * M->row_stride + (size_t)i * M->column_stride];
                    const double less = a * (d[i] * d[j]) - b * (d[i] * d[j]);
                    const double more = a * (d[i] * d[j]) + b * (d[i] * d[j]);

                    skew += less * less;
                    even += more * more;
                }
    for (i = 0; i < p->n; i++) {
        const double a = M->values[(size_t)i * (M->row_stride + M->column_stride)];

        even += 2.0 * (a * (d[i] * d[i])) * (a * (d[i] * d[i]));
    }
    return sqrt(skew / even);
}

/* What M says, once a set-up. */
static void examine(perp__lemke *l)
{
    const perp__lcp_problem *p = l->head.problem;

    if (l->examined)
        return;
    l->examined = 1;
    l->crashes = l->symmetric = 0;
    l->positive = p->n >= CRASH_FROM && diagonal_is_positive(p->M);
    if (!l->positive)
        return;
    l->symmetric = perp__is_symmetric(p);
    l->crashes = l->symmetric || (p->n >= CRASH_LU_FROM && skewness(p) <= CRASH_SKEW);
}

/* From a good start a round or two are enough, whatever M's symmetry; but the polish, where it is
 * on, has tried these already. */
static int32_t may_crash(perp__lemke *l, int32_t warm)
{
    const perp__lcp_problem *p = l->head.problem;

    if (!p->settings->crash || p->M->column_starts)
        return 0;
    examine(l);
    return l->crashes || (warm && l->positive && !p->settings->polish);
}

/* perp__lcp_iterate's, by the block of the crash. */
static int32_t correct(void *work, const double *residual, double *step)
{
    perp__lemke *l = work;

    memcpy(step, residual, (size_t)l->head.problem->n * sizeof *step);
    perp__active_block_solve(&l->crash.active, l->crash.places, step);
    return 1;
}

static enum perp__lemke_guess crash(perp__lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;
    const size_t n = (size_t)p->n;
    perp__block_pivoting *b = &l->crash;
    perp_outcome outcome;

    b->active.block = l->tableau.T;
    perp__active_block_begin(&b->active, p, l->symmetric);
    b->active.definite = 1;
    b->problem = p;
    b->patience = CRASH_PATIENCE;
    b->single_patience = 0;
    b->round_limit = CRASH_ROUNDS;
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
            iterate->correct = correct;
        return PERP__GUESS_END;
    }
    if (b->infeasible > p->n / CRASH_PART)
        return PERP__GUESS_NONE;
    memcpy(l->places, b->places, n);
    return PERP__GUESS_BASIS;
}

enum perp__lemke_guess perp__lemke_guess_places(perp__lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;
    enum perp__lemke_guess guess = PERP__GUESS_NONE;

    if (p->settings->pivot_rule != PERP_PIVOT_HARRIS)
        return guess;
    if (iterate->warm)
        perp__places_of(p, iterate->z, l->places);
    else
        perp__block_pivoting_start(p, l->places);
    if (may_crash(l, iterate->warm))
        guess = crash(l, iterate);
    return guess == PERP__GUESS_NONE && iterate->warm ? PERP__GUESS_BASIS : guess;
}
