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
/* Below this size a crash that fails costs more than the path from the slacks, so only matrices
 * that look like P-matrices get one. */
#define WORTH_IT 400
/* Violations that pivots remove for less than another step of the crash costs. */
#define FEW 16
/* A guess is one if beyond those few at most one pair in so many is violated. */
#define CLOSE 32
/* Reciprocal condition below which free variables count as dependent. */
#define DEPENDENT 1e-13
/* rho, beside rows near 1. */
#define PROXIMAL 1e-7
#define PROXIMAL_ROUNDS 30

/* The side of z - w on which a variable lies, for the z on entry. */
static void read_places(perp__lemke *l, const double *z)
{
    const perp__lcp_problem *p = l->head.problem;
    int32_t k;

    perp__factored_affine(p, z, l->work);
    for (k = 0; k < l->pairs; k++) {
        const int32_t i = l->index[k];
        const double u = z[i] - l->work[i];

        l->places[k] = PERP__BETWEEN;
        if (u <= p->lower[i])
            l->places[k] = l->sign[k] < 0 ? PERP__AT_UPPER : PERP__AT_LOWER;
        else if (u >= p->upper[i])
            l->places[k] = l->sign[k] < 0 ? PERP__AT_LOWER : PERP__AT_UPPER;
    }
}

static void place_slacks(perp__lemke *l)
{
    int32_t k;

    for (k = 0; k < l->pairs; k++)
        l->places[k] = perp__lemke_is_free(l, k) ? PERP__BETWEEN : PERP__AT_LOWER;
}

/* Of pairs, from those of the caller's variables. */
static void take_places(perp__lemke *l, const int8_t *places)
{
    int32_t k;

    for (k = 0; k < l->pairs; k++) {
        const int8_t place = places[l->index[k]];

        l->places[k] = place == PERP__BETWEEN                          ? PERP__BETWEEN
                       : (place == PERP__AT_UPPER) != (l->sign[k] < 0) ? PERP__AT_UPPER
                                                                       : PERP__AT_LOWER;
    }
}

/* Places by nested iteration, where the matrix suits. Returns 0 where it does not, or status < 0.
 */
static perp_status nest(perp__lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;
    const size_t bytes = (size_t)p->n * sizeof(double);
    perp__multigrid *grid = NULL;
    perp_status status = perp__sparse_block_grid(p->block, &grid);

    if (status == PERP_OK && grid)
        status = perp__nested_fit(&l->factored.nested, grid);
    if (status != PERP_OK || !grid)
        return status;
    memcpy(l->far, iterate->z, bytes);
    if (perp__nested_run(&l->factored.nested, p, iterate->warm, iterate->z, iterate->places,
                         &iterate->iterations, &iterate->outcome)) {
        take_places(l, iterate->places);
        return 1;
    }
    memcpy(iterate->z, l->far, bytes);
    return 0;
}

/* Where the crash begins: at the solution of a tridiagonal M-matrix, on which active sets would
 * creep along one index a step; at what nested iteration finds on a grid, where they would creep
 * too; near the caller's z0; at the slacks. */
static perp_status choose_places(perp__lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;
    perp_status found = 0;

    if (p->settings->crash && p->block->kind == PERP__SPARSE_TRIDIAGONAL) {
        found = perp__tridiagonal_lcp_places(&l->factored.tridiagonal, &p->block->T, p,
                                             iterate->places);
        if (found)
            take_places(l, iterate->places);
    } else if (p->settings->crash) {
        found = nest(l, iterate);
    }
    if (found == 0 && iterate->warm)
        read_places(l, iterate->z);
    else if (found == 0)
        place_slacks(l);
    return found < 0 ? found : PERP_OK;
}

/* Rounding of b in the row of pair k. */
static double noise(const perp__lemke *l, int32_t k, double x_largest)
{
    const perp__lcp_problem *p = l->head.problem;
    const int32_t i = l->index[k];

    if (l->basic[k] < l->pairs)
        return 16.0 * DBL_EPSILON * x_largest;
    return 16.0 * DBL_EPSILON * (p->row_norms[i] * x_largest + fabs(p->q[i]));
}

/* Writes to `next` where the pairs belong whose basic member is beyond a limit: one step of the
 * primal-dual active set method (Hintermueller, Ito & Kunisch 2003; block principal pivoting of
 * Kostreva 1978). Returns how many there are. */
static int32_t move_violated(perp__lemke *l)
{
    double x_largest = 0.0;
    int32_t count = 0, k;

    for (k = 0; k < l->pairs; k++)
        if (l->basic[k] < l->pairs)
            x_largest = fmax(x_largest, fabs(l->b[k]));
    for (k = 0; k < l->pairs; k++) {
        const double margin = noise(l, k, x_largest);
        const int32_t below = l->b[k] < l->low[k] - margin;

        l->factored.next[k] = l->places[k];
        if (!below && !(l->b[k] > l->high[k] + margin))
            continue;
        count++;
        if (l->basic[k] < l->pairs)
            l->factored.next[k] = below ? PERP__AT_LOWER : PERP__AT_UPPER;
        else
            l->factored.next[k] = PERP__BETWEEN;
    }
    return count;
}

/* The basis of `places`, from the first singular one on that of M + rho I: the active sets of the
 * proximal point method's first step (Rockafellar 1976), where M need not be P. */
static perp_status take_near(perp__lemke *l)
{
    perp_status status = perp__factored_take_places(l, l->places);

    if (status == PERP__FACTOR_SINGULAR && l->factored.rho == 0.0) {
        l->factored.rho = PROXIMAL;
        status = perp__factored_take_places(l, l->places);
    }
    return status;
}

/* Active-set steps from `places` until few violations are left, or nothing is gained any more. Ends
 * with the best basis met as the current one, *violated counts its violations. Singular if the
 * first was; iterate->outcome >= 0 if asked to stop. */
static perp_status crash(perp__lemke *l, perp__lcp_iterate *iterate, int32_t steps,
                         int32_t *violated)
{
    const size_t bytes = (size_t)l->pairs;
    perp_status status = take_near(l);
    const int32_t patience = l->head.problem->block->has_z_signs ? STEPS : PATIENCE;
    int32_t waited = 0, step;

    for (step = 0; status == PERP_OK; step++) {
        int32_t count = move_violated(l);

        waited++;
        if (count < *violated) {
            *violated = count;
            memcpy(l->factored.best, l->places, bytes);
            waited = 0;
        }
        if (count <= (l->factored.rho > 0.0 ? 0 : FEW) || step == steps || waited == patience)
            break;
        iterate->outcome =
            perp__lcp_tick(l->head.problem->control, ++iterate->iterations, INFINITY);
        if (iterate->outcome >= 0)
            return PERP_OK;
        memcpy(l->places, l->factored.next, bytes);
        status = take_near(l);
    }
    if (*violated == INT32_MAX || status == PERP_ERROR_MEMORY)
        return status;
    if (l->factored.rho == 0.0 && !memcmp(l->factored.best, l->places, bytes))
        return PERP_OK;
    l->factored.rho = 0.0;
    status = perp__factored_take_places(l, l->factored.best);
    if (status == PERP__FACTOR_SINGULAR && *violated == 0) {
        l->factored.rho = PROXIMAL;
        status = perp__factored_take_places(l, l->factored.best);
        perp__factored_values(l, PROXIMAL_ROUNDS);
    }
    return status;
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

/* Factors a basis near the solution and counts what is infeasible there. */
static perp_status find_near(perp__lemke *l, perp__lcp_iterate *iterate, int32_t *violated)
{
    const perp__lcp_problem *p = l->head.problem;
    int32_t steps = p->settings->crash ? STEPS : 0;
    perp_status status;

    l->factored.rho = 0.0;
    perp__factored_write_pairs(l, 0);
    status = choose_places(l, iterate);
    if (p->iteration_limit > 0 && p->iteration_limit - iterate->iterations < steps)
        steps = (int32_t)(p->iteration_limit - iterate->iterations);
    if (status == PERP_OK && iterate->outcome < 0)
        status = crash(l, iterate, steps, violated);
    l->factored.rho = 0.0;
    l->spent = iterate->iterations;
    return status;
}

static double largest_value(const perp__lemke *l)
{
    double largest = 0.0;
    int32_t r;

    for (r = 0; r < l->pairs; r++)
        if (isfinite(l->low[r]) || isfinite(l->high[r]))
            largest = fmax(largest, fabs(l->b[r]));
    return largest;
}

/* From the caller's z0, by active sets, or both, as the settings allow. */
perp_status perp__factored_start_near(perp__lemke *l, perp__lcp_iterate *iterate,
                                      enum perp__lemke_guess *guess)
{
    const perp__lcp_problem *p = l->head.problem;
    int32_t violated = INT32_MAX;
    perp_status status;

    iterate->outcome = -1;
    if (p->settings->pivot_rule == PERP_PIVOT_LEXICOGRAPHIC ||
        (!iterate->warm && (!p->settings->crash || (p->n < WORTH_IT && !could_be_P(p)))))
        return PERP_OK;
    status = find_near(l, iterate, &violated);
    if (status == PERP_OK && violated == 0)
        iterate->outcome = PERP_OUTCOME_SOLVED;
    if (status == PERP_OK && iterate->outcome >= 0) {
        *guess = PERP__GUESS_END;
        if (violated < INT32_MAX) /* else there is no basis yet, but a point */
            perp__lemke_write_point(l, iterate);
    } else if (status == PERP_OK && violated <= FEW + l->pairs / CLOSE) {
        *guess = PERP__GUESS_BASIS;
        l->largest_b = largest_value(l);
    }
    return status;
}

/* The basis of the slacks and the free variables, or, where those depend on each other, of the
 * slacks alone. */
perp_status perp__factored_start(perp__lemke *l, const perp__lcp_iterate *iterate)
{
    int32_t any_free = 0, k;
    perp_status status;

    (void)iterate;
    perp__factored_write_pairs(l, 0);
    place_slacks(l);
    for (k = 0; k < l->pairs; k++)
        any_free |= perp__lemke_is_free(l, k);
    status = perp__factored_take_places(l, l->places);
    if (any_free &&
        (status == PERP__FACTOR_SINGULAR ||
         (status == PERP_OK && !(perp__basis_condition(&l->factored.basis) > DEPENDENT)))) {
        perp__factored_write_pairs(l, 1);
        place_slacks(l);
        status = perp__factored_take_places(l, l->places);
    }
    l->largest_b = largest_value(l);
    return status;
}
