/* Primal-dual active sets on a sparse matrix: Hintermueller, Ito & Kunisch, "The primal-dual active
 * set strategy as a semismooth Newton method", SIAM J. Optim. 13 (2002) 865. Given an index set,
 * the equations of the variables between their bounds are solved, then every variable outside of
 * its bounds moves to the nearer one, and every variable at a bound whose w has the wrong sign is
 * freed.
 *
 * For an M-matrix with bounds on one side the sets shrink from the second step on: the method ends.
 * For other P-matrices it can cycle; block principal pivoting (Judice & Pires, "A block principal
 * pivoting algorithm for large-scale strictly monotone linear complementarity problems", Computers
 * Oper. Res. 21 (1994) 587) then exchanges one index at a time until fewer signs are wrong.
 *
 * The start is the solution's index set where the matrix is a tridiagonal M-matrix. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/active_set/sparse.h"
#include "linalg/sparse_block.h"

#define SMALLEST 64    /* up to this size a dense factorisation is faster */
#define ITERATIONS 500 /* default limit */
#define ROUNDS 3       /* of a rough solve */
#define PROXIMAL_ROUNDS 30
#define COARSE_STEPS 30
#define PATIENCE 10 /* full exchanges without progress before single ones */

/* What an exchange would do. */
typedef struct exchange {
    int32_t count;    /* wrong signs */
    int32_t last;     /* the largest index that has one */
    double violation; /* the largest, in the units of the tested residual */
} exchange;

static int32_t suits(const perp__lcp_problem *problem)
{
    return problem->M->column_starts && problem->n > SMALLEST;
}

void perp__sparse_active_set_layout(perp__arena *arena, void *object)
{
    perp__sparse_active_set *work = object;
    const perp__lcp_problem *problem = work->common.problem;
    const size_t n = (size_t)problem->n;
    const int32_t tridiagonal = problem->block->kind == PERP__SPARSE_TRIDIAGONAL;

    perp__tridiagonal_lcp_layout(arena, &work->tridiagonal, tridiagonal ? n : 0);
    PERP__DOUBLES(arena, n, &work->w, &work->product, &work->step);
    work->active = perp__arena_take(arena, n, sizeof(int32_t));
    work->next = perp__arena_take(arena, n, sizeof(int8_t));
    work->coarse.levels = 0; /* those of another matrix */
}

static void multiply(perp__sparse_active_set *work, const double *z)
{
    perp__lcp_affine(work->common.problem, z, work->product, work->w);
}

void perp__sparse_active_set_places(perp__sparse_active_set *work, const double *z, int8_t *places)
{
    const perp__lcp_problem *p = work->common.problem;

    multiply(work, z);
    for (int32_t i = 0; i < p->n; i++) {
        if (p->lower[i] == p->upper[i])
            places[i] = PERP__FIXED;
        else if (z[i] - p->lower[i] <= work->w[i])
            places[i] = PERP__AT_LOWER;
        else if (z[i] - p->upper[i] >= work->w[i])
            places[i] = PERP__AT_UPPER;
        else
            places[i] = PERP__BETWEEN;
    }
}

/* The largest |w| of the variables between their bounds. */
static double equation_residual(const perp__sparse_active_set *work, int32_t count)
{
    double largest = 0.0;

    for (int32_t k = 0; k < count; k++)
        if (!(fabs(work->w[work->active[k]]) <= largest))
            largest = fabs(work->w[work->active[k]]);
    return largest;
}

/* Solves for the variables between their bounds, starting from z, with the others at theirs, in
 * `rounds` at most; w follows. PERP_OK, PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
static perp_status approach(perp__sparse_active_set *work, const int8_t *places, double *z,
                            int32_t rounds, double goal)
{
    const perp__lcp_problem *p = work->common.problem;
    perp_status status;
    int32_t count = 0, round, i, k;

    for (i = 0; i < p->n; i++) {
        if (places[i] == PERP__BETWEEN)
            work->active[count++] = i;
        else
            z[i] = places[i] == PERP__AT_UPPER ? p->upper[i] : p->lower[i];
    }
    multiply(work, z);
    status = work->rho > 0.0 ? perp__sparse_block_factor(p->block, work->active, count, work->rho)
                             : perp__sparse_block_approach(p->block, work->active, count);
    for (round = 0; round < rounds && status == PERP_OK; round++) {
        const double before = work->residual;

        for (k = 0; k < count; k++)
            work->step[work->active[k]] = work->w[work->active[k]];
        status = perp__sparse_block_solve_roughly(p->block, work->step);
        for (k = 0; k < count && status == PERP_OK; k++)
            z[work->active[k]] -= work->step[work->active[k]];
        multiply(work, z);
        work->residual = equation_residual(work, count);
        if (work->residual <= goal || (round > 0 && !(work->residual < 0.5 * before)))
            break;
    }
    return status;
}

/* Without factors a solve is rough: where no polish follows, it is repeated. With a proximal term
 * one shows the signs of its own problem (the proximal point method's first step, Rockafellar
 * 1976). */
static perp_status solve_equations(perp__sparse_active_set *work, const int8_t *places, double *z)
{
    const perp__lcp_problem *p = work->common.problem;
    perp_status status;

    if (work->rho == 0.0)
        return approach(work, places, z, ROUNDS, p->settings->polish ? INFINITY : 0.1 * p->tol);
    status = approach(work, places, z, 1, 0.0);
    work->residual = 0.0;
    return status;
}

/* Fills work->next. Wrong signs of w count beyond rounding only: a degenerate variable stays at its
 * bound once it is there. */
static exchange find_exchange(perp__sparse_active_set *work, const int8_t *places, const double *z)
{
    const perp__lcp_problem *p = work->common.problem;
    const double z_largest = perp__largest_or_nan(z, p->n);
    exchange e = {0, -1, 0.0};

    for (int32_t i = 0; i < p->n; i++) {
        const double noise = 16.0 * DBL_EPSILON * (p->row_norms[i] * z_largest + fabs(p->q[i])) +
                             4.0 * work->residual;
        double violation = 0.0;
        int8_t next = places[i];

        if (places[i] == PERP__BETWEEN && z[i] < p->lower[i]) {
            next = PERP__AT_LOWER;
            violation = p->lower[i] - z[i];
        } else if (places[i] == PERP__BETWEEN && z[i] > p->upper[i]) {
            next = PERP__AT_UPPER;
            violation = z[i] - p->upper[i];
        } else if ((places[i] == PERP__AT_LOWER && work->w[i] < -noise) ||
                   (places[i] == PERP__AT_UPPER && work->w[i] > noise)) {
            next = PERP__BETWEEN;
            violation = fabs(work->w[i]);
        }
        work->next[i] = next;
        if (next != places[i]) {
            e.count++;
            e.last = i;
            e.violation = fmax(e.violation, violation);
        }
    }
    return e;
}

/* How often a full exchange may fail to lower the number of wrong signs: for ever where the sets
 * are monotone. */
typedef struct safeguard {
    int32_t fewest, patience;
} safeguard;

/* Returns 0 where patience is at its end and single exchanges are not wanted. */
static int32_t apply_exchange(perp__sparse_active_set *work, safeguard *guard, const exchange *e,
                              const perp__active_set_limits *limits, int8_t *places)
{
    const perp__lcp_problem *p = work->common.problem;

    if (e->count < guard->fewest) {
        guard->fewest = e->count;
        guard->patience = limits->patience;
    } else if (!p->block->has_z_signs && guard->patience-- <= 0) {
        places[e->last] = work->next[e->last];
        return limits->singles;
    }
    memcpy(places, work->next, (size_t)p->n * sizeof *places);
    return 1;
}

static perp_status exchange_all(perp__sparse_active_set *work, perp__lcp_iterate *iterate,
                                const perp__active_set_limits *limits)
{
    const perp__lcp_problem *problem = work->common.problem;
    safeguard guard = {problem->n + 1, limits->patience};

    iterate->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    while (iterate->iterations < limits->iterations) {
        perp_status status = solve_equations(work, iterate->places, iterate->z);
        perp_outcome request;
        exchange e;

        if (status == PERP__FACTOR_SINGULAR && work->rho < limits->rho) {
            work->rho = limits->rho;
            continue;
        }
        if (status == PERP__FACTOR_SINGULAR)
            iterate->outcome = PERP_OUTCOME_SINGULAR;
        if (status != PERP_OK)
            return status == PERP__FACTOR_SINGULAR ? PERP_OK : status;
        iterate->iterations++;
        e = find_exchange(work, iterate->places, iterate->z);
        if (e.count == 0) {
            iterate->outcome = PERP_OUTCOME_SOLVED;
            return work->rho > 0.0
                       ? approach(work, iterate->places, iterate->z, PROXIMAL_ROUNDS, 0.0)
                       : PERP_OK;
        }
        request = perp__lcp_tick(problem->control, iterate->iterations, e.violation);
        if (request >= 0) {
            iterate->outcome = request;
            return PERP_OK;
        }
        if ((e.count <= limits->few && work->rho == 0.0) ||
            !apply_exchange(work, &guard, &e, limits, iterate->places)) {
            iterate->outcome = PERP_OUTCOME_STALLED;
            return PERP_OK;
        }
    }
    return PERP_OK;
}

/* z of a level's problem and the sides on which its rows lie; the equations of these are solved and
 * the sets exchanged, as far as that gets in few steps. */
static perp_status solve_level(perp__sparse_active_set *work, const perp__lcp_problem *problem,
                               int32_t k, int8_t *places)
{
    const perp__active_set_limits limits = {COARSE_STEPS, PATIENCE, 0, 0, 0.0};
    perp__lcp_control control = *problem->control;
    perp__lcp_iterate iterate = {.z = work->coarse.level[k].z, .places = places};
    perp__lcp_problem own;
    perp_status status;

    work->coarse_block.context = problem->context;
    perp__aggregated_pose(&work->coarse, k, problem, &work->coarse_block, &own);
    status = perp__sparse_block_read(&work->coarse_block, own.M, own.factors);
    if (status != PERP_OK)
        return status;
    control.monitor = NULL; /* it hears of the caller's own problem */
    own.control = &control;
    work->common.problem = &own;
    work->rho = 0.0;
    perp__sparse_active_set_places(work, iterate.z, places);
    status = exchange_all(work, &iterate, &limits);
    work->common.problem = problem;
    for (int32_t i = 0; i < own.n; i++)
        iterate.z[i] = isfinite(iterate.z[i])
                           ? perp__clamp(iterate.z[i], own.lower[i], own.upper[i])
                           : perp__clamp(0.0, own.lower[i], own.upper[i]);
    return status;
}

/* From the coarsest problem to the caller's: returns 1 with the first index set, 0 where there are
 * no coarser ones, or PERP_ERROR_MEMORY. */
static perp_status descend(perp__sparse_active_set *work, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *problem = work->common.problem;
    perp__aggregated *coarse = &work->coarse;
    perp_status status = perp__aggregated_build(coarse, problem);

    if (status != PERP_OK || coarse->levels == 1)
        return status;
    perp__aggregated_load(coarse, problem);
    for (int32_t k = coarse->levels - 1; k >= 0 && status == PERP_OK; k--) {
        if (k < coarse->levels - 1)
            perp__aggregated_prolong(coarse, k);
        perp__aggregated_smooth(coarse, k);
        if (k > 0)
            status = solve_level(work, problem, k, iterate->places);
    }
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < problem->n; i++)
        iterate->z[i] = perp__clamp(coarse->level[0].z[i] / problem->factors[i], problem->lower[i],
                                    problem->upper[i]);
    perp__sparse_active_set_places(work, iterate->z, iterate->places);
    return 1;
}

/* Nested iteration, where the matrix suits. Returns 1, 0 where it does not or got nowhere, or
 * PERP_ERROR_MEMORY. */
static perp_status nest(perp__sparse_active_set *work, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *problem = work->common.problem;
    perp__multigrid *grid;
    perp_status status;

    if (perp__aggregated_suits(problem))
        return iterate->warm ? PERP_OK : descend(work, iterate);
    status = perp__sparse_block_grid(problem->block, &grid);
    if (status == PERP_OK && grid)
        status = perp__nested_fit(&work->nested, grid);
    if (status != PERP_OK || !grid)
        return status;
    return perp__nested_run(&work->nested, problem, iterate->warm, iterate->z, iterate->places,
                            &iterate->iterations, &iterate->outcome);
}

/* The first index set, or with *solved the last one and z. */
static perp_status start(perp__sparse_active_set *work, perp__lcp_iterate *iterate, int32_t *solved)
{
    const perp__lcp_problem *problem = work->common.problem;
    const size_t bytes = (size_t)problem->n * sizeof *work->step;
    int32_t found = PERP__TRIDIAGONAL_NO;
    perp_status status = PERP_OK;

    memcpy(work->step, iterate->z, bytes);
    if (problem->block->kind == PERP__SPARSE_TRIDIAGONAL)
        status = perp__tridiagonal_lcp_solve(&work->tridiagonal, problem, iterate->places,
                                             iterate->z, &found);
    *solved = found == PERP__TRIDIAGONAL_SOLVED;
    if (status != PERP_OK || found >= PERP__TRIDIAGONAL_NEAR)
        return status;
    if (found == PERP__TRIDIAGONAL_FAR)
        memcpy(iterate->z, work->step, bytes);
    status = nest(work, iterate);
    if (status == 0) {
        memcpy(iterate->z, work->step, bytes);
        perp__sparse_active_set_places(work, iterate->z, iterate->places);
    }
    return status < 0 ? status : PERP_OK;
}

int32_t perp__sparse_active_set_correct(void *object, const double *residual, double *step)
{
    const perp__sparse_active_set *work = object;
    const perp__lcp_problem *problem = work->common.problem;

    if (!problem->block->factored) /* a rough solve would not do */
        return 0;
    memcpy(step, residual, (size_t)problem->n * sizeof *step);
    perp__sparse_block_solve(problem->block, step, 0);
    return 1;
}

perp_status perp__sparse_active_set_run(perp__sparse_active_set *work, perp__lcp_iterate *iterate,
                                        const perp__active_set_limits *limits)
{
    perp_status status;
    int32_t solved;

    iterate->outcome = -1;
    work->rho = 0.0;
    status = start(work, iterate, &solved);
    if (solved) {
        iterate->outcome = PERP_OUTCOME_SOLVED;
        iterate->iterations = 1;
    } else if (status == PERP_OK && iterate->outcome < 0) {
        status = exchange_all(work, iterate, limits);
    }
    return status;
}

static perp_status solve(void *object, perp__lcp_iterate *iterate)
{
    perp__sparse_active_set *work = object;
    const perp__lcp_problem *problem = work->common.problem;
    const perp__active_set_limits limits = {
        problem->iteration_limit > 0 ? problem->iteration_limit : ITERATIONS, PATIENCE, 1, 0, 0.0};
    const perp_status status = perp__sparse_active_set_run(work, iterate, &limits);

    for (int32_t i = 0; i < problem->n; i++)
        iterate->z[i] = perp__clamp(iterate->z[i], problem->lower[i], problem->upper[i]);
    iterate->has_places = iterate->outcome == PERP_OUTCOME_SOLVED;
    iterate->correct = perp__sparse_active_set_correct;
    return status;
}

void perp__sparse_active_set_release(void *object)
{
    perp__sparse_active_set *work = object;

    perp__nested_release(&work->nested);
    perp__aggregated_release(&work->coarse);
    if (work->coarse_block.context)
        perp__sparse_block_release(&work->coarse_block);
}

const perp__lcp_method perp__lcp_active_set_sparse = {
    PERP_LCP_ACTIVE_SET,
    sizeof(perp__sparse_active_set),
    1,
    0,
    suits,
    NULL,
    perp__sparse_active_set_layout,
    solve,
    perp__sparse_active_set_release,
};
