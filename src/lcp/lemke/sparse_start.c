/* Where the path of the sparse Lemke method begins. A principal pivotal transform of an LCP is an
 * LCP with the same solutions (Cottle, Pang & Stone 1992, section 2.3), so that any complementary
 * basis will serve; near the solution the path is short. P-matrices stay so under the transform,
 * copositive ones need not: what fails from a guess is tried again from the slacks. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/lemke/lemke.h"

/* Steps of the crash, and how many of them in a row may bring nothing where the sets need not be
 * monotone. */
#define STEPS 200
#define PATIENCE 3
/* Of a singular block, beside rows near 1. */
#define PROXIMAL 1e-7
/* Below this size a crash that fails costs more than the path from the slacks, so only matrices
 * that look like P-matrices get one. */
#define WORTH_IT 400
/* Violations that pivots remove for less than another step of the crash costs; a guess is one if
 * beyond those few at most one pair in so many is violated. */
#define FEW 16
#define CLOSE 32
/* Reciprocal condition below which free variables count as dependent. */
#define DEPENDENT 1e-13

static void find_largest_b(perp__lemke *l)
{
    int32_t r;

    l->largest_b = 0.0;
    for (r = 0; r < l->pairs; r++)
        if (isfinite(l->low[r]) || isfinite(l->high[r]))
            l->largest_b = fmax(l->largest_b, fabs(l->b[r]));
}

/* Basic variables that are beyond a limit by more than rounding. */
static int32_t count_violated(const perp__lemke *l)
{
    const perp__lcp_problem *p = l->head.problem;
    double x_largest = 0.0;
    int32_t count = 0, k;

    for (k = 0; k < l->pairs; k++)
        if (l->basic[k] < l->pairs)
            x_largest = fmax(x_largest, fabs(l->b[k]));
    for (k = 0; k < l->pairs; k++) {
        const int32_t i = l->index[k];
        const double size =
            l->basic[k] < l->pairs ? x_largest : p->row_norms[i] * x_largest + fabs(p->q[i]);

        count += perp__lemke_violation(l, k) > 16.0 * DBL_EPSILON * size;
    }
    return count;
}

/* Takes l->places for a guess if they are near the solution's. */
static perp_status take_guess(perp__lemke *l, enum perp__lemke_guess *guess)
{
    perp_status status = perp__factored_take_places(l, 0);

    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    if (count_violated(l) <= FEW + l->pairs / CLOSE)
        *guess = PERP__GUESS_BASIS;
    find_largest_b(l);
    return PERP_OK;
}

/* Whether all variables with a bound have positive diagonal entries. */
static int32_t could_be_P(const perp__lcp_problem *p)
{
    const perp__matrix *M = p->M;
    int32_t j, k;

    for (j = 0; j < p->n; j++) {
        double diagonal = 0.0;

        if (p->lower[j] == p->upper[j] || (p->lower[j] == -INFINITY && p->upper[j] == INFINITY))
            continue;
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            if (M->row_indices[k] == j)
                diagonal = M->values[k];
        if (!(diagonal > 0.0))
            return 0;
    }
    return 1;
}

static int32_t correct(void *work, const double *residual, double *step)
{
    perp__lemke *l = work;

    return perp__sparse_active_set_correct(&l->factored.crash, residual, step);
}

/* Active sets, until they have solved the problem or come near. */
static perp_status crash(perp__lemke *l, perp__lcp_iterate *iterate, enum perp__lemke_guess *guess)
{
    const perp__lcp_problem *p = l->head.problem;
    perp__active_set_limits limits = {STEPS, PATIENCE, 0, FEW, PROXIMAL};
    perp_status status;

    if (p->iteration_limit > 0 && p->iteration_limit < limits.iterations)
        limits.iterations = p->iteration_limit;
    l->factored.crash.common.problem = p;
    status = perp__sparse_active_set_run(&l->factored.crash, iterate, &limits);
    l->spent = iterate->iterations;
    if (status != PERP_OK)
        return status;
    if (iterate->outcome == PERP_OUTCOME_SINGULAR)
        return PERP_OK;
    memcpy(l->places, iterate->places, (size_t)p->n);
    if (iterate->outcome == PERP_OUTCOME_STALLED ||
        (iterate->outcome == PERP_OUTCOME_ITERATION_LIMIT && limits.iterations == STEPS))
        return take_guess(l, guess);
    *guess = PERP__GUESS_END;
    iterate->has_places = 1;
    iterate->correct = iterate->outcome == PERP_OUTCOME_SOLVED ? correct : NULL;
    return PERP_OK;
}

/* From the caller's z0, by active sets, or both, as the settings allow. */
perp_status perp__factored_start_near(perp__lemke *l, perp__lcp_iterate *iterate,
                                      enum perp__lemke_guess *guess)
{
    const perp__lcp_problem *p = l->head.problem;
    perp_status status = PERP_OK;

    if (p->settings->pivot_rule == PERP_PIVOT_LEXICOGRAPHIC)
        return PERP_OK;
    if (iterate->warm) {
        l->factored.crash.common.problem = p;
        perp__sparse_active_set_places(&l->factored.crash, iterate->z, l->places);
        status = take_guess(l, guess);
    }
    if (status == PERP_OK && *guess == PERP__GUESS_NONE && p->settings->crash &&
        (iterate->warm || p->n >= WORTH_IT || could_be_P(p)))
        status = crash(l, iterate, guess);
    return status;
}

/* The basis of the slacks and the free variables, or, where those depend on each other, of the
 * slacks alone. */
perp_status perp__factored_start(perp__lemke *l, const perp__lcp_iterate *iterate)
{
    int32_t any_free = 0, k;
    perp_status status;

    (void)iterate;
    perp__block_pivoting_start(l->head.problem, l->places);
    status = perp__factored_take_places(l, 0);
    for (k = 0; k < l->pairs; k++)
        any_free |= perp__lemke_is_free(l, k);
    if (any_free &&
        (status == PERP__FACTOR_SINGULAR ||
         (status == PERP_OK && !(perp__basis_condition(&l->factored.basis) > DEPENDENT))))
        status = perp__factored_take_places(l, 1);
    if (status == PERP_OK)
        find_largest_b(l);
    return status;
}
