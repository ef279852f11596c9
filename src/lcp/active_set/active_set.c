/* Primal-dual active sets: Hintermueller, Ito & Kunisch, "The primal-dual active
 * set strategy as a semismooth Newton method", SIAM J. Optim. 13 (2002) 865. Given an index set,
 * the equations of the variables between their bounds are solved, then every variable outside of
 * its bounds moves to the nearer one, and every variable at a bound whose w has the wrong sign is
 * freed.
 *
 * For an M-matrix with bounds on one side the sets shrink from the second step on: the method ends.
 * For other P-matrices it can cycle; block principal pivoting (Judice & Pires, "A block principal
 * pivoting algorithm for large-scale strictly monotone linear complementarity problems", Computers
 * Oper. Res. 21 (1994) 587) then exchanges one index at a time until fewer signs are wrong. Where M
 * is symmetric, the index set of a penalty method comes before that: the sets of bending plates,
 * which meet an obstacle in forces along the edge of the contact, never settle by exchanges alone.
 *
 * The start is the solution's index set where the matrix is a tridiagonal M-matrix. */
#include <math.h>
#include <string.h>

#include "base/rounding.h"
#include "lcp/active_set/active_set.h"
#include "linalg/sparse_block.h"

#define ROUNDS 3 /* of a rough solve */
#define SMALL_PENALTY 0x1p-26
#define STEPS 30 /* for one proximal point */

/* What an exchange would do. */
typedef struct exchange {
    int32_t count;    /* wrong signs */
    int32_t last;     /* the largest index that has one */
    double violation; /* the largest, in the units of the tested residual */
} exchange;

void perp__active_set_layout(perp__arena *arena, void *object)
{
    perp__active_set *work = object;
    const perp__lcp_problem *problem = work->common.problem;
    const size_t n = (size_t)problem->n;
    const bool tridiagonal = problem->block->kind == PERP__SPARSE_TRIDIAGONAL;

    perp__tridiagonal_lcp_layout(arena, &work->tridiagonal, tridiagonal ? n : 0);
    PERP__DOUBLES(arena, n, &work->w, &work->step, &work->weights);
    work->active = perp__arena_take(arena, n, sizeof(int32_t));
    work->next = perp__arena_take(arena, n, sizeof(int8_t));
}

static void multiply(perp__active_set *work, const double *z)
{
    const perp__lcp_problem *p = work->common.problem;

    if (perp__largest_or_nan(z, p->n) == 0.0)
        memcpy(work->w, p->q, (size_t)p->n * sizeof *work->w);
    else
        perp__lcp_affine(p, z, work->w);
}

void perp__places_of(const perp__lcp_problem *problem, const double *z, int8_t *places)
{
    const double *lower = problem->lower, *upper = problem->upper;

    for (int32_t i = 0; i < problem->n; i++)
        places[i] = perp__place(lower[i] == upper[i], z[i] - lower[i], z[i] - upper[i], 0.0);
}

void perp__active_set_places(perp__active_set *work, const double *z, int8_t *places)
{
    const perp__lcp_problem *p = work->common.problem;

    multiply(work, z);
    for (int32_t i = 0; i < p->n; i++)
        places[i] = perp__place(p->lower[i] == p->upper[i], z[i] - p->lower[i], z[i] - p->upper[i],
                                work->w[i]);
}

/* Solves for the variables between their bounds, starting from z, with the others at theirs, in
 * `rounds` at most; w follows. PERP_OK, PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
static perp_status approach(perp__active_set *work, const int8_t *places, double *z, int32_t rounds,
                            double goal)
{
    const perp__lcp_problem *p = work->common.problem;
    const bool is_dense = p->block->kind == PERP__DENSE; /* factors need no start */
    perp_status status;
    int32_t count = 0, round, i, k;

    for (i = 0; i < p->n; i++) {
        if (places[i] == PERP__BETWEEN)
            work->active[count++] = i;
        if (places[i] == PERP__BETWEEN && is_dense && work->rho == 0.0)
            z[i] = 0.0;
        else if (places[i] != PERP__BETWEEN)
            z[i] = places[i] == PERP__AT_UPPER ? p->upper[i] : p->lower[i];
    }
    work->count = count;
    work->residual = 0.0;
    multiply(work, z);
    status = work->rho > 0.0 ? perp__sparse_block_factor(p->block, work->active, count, work->rho)
                             : perp__sparse_block_approach(p->block, work->active, count);
    for (round = 0; round < rounds && count > 0 && status == PERP_OK; round++) {
        const double before = work->residual;

        for (k = 0; k < count; k++)
            work->step[work->active[k]] = work->w[work->active[k]];
        status = perp__sparse_block_solve_roughly(p->block, work->step);
        for (k = 0; k < count && status == PERP_OK; k++)
            z[work->active[k]] -= work->step[work->active[k]];
        multiply(work, z);
        work->residual = 0.0;
        for (k = 0; k < count; k++)
            if (!(fabs(work->w[work->active[k]]) <= work->residual))
                work->residual = fabs(work->w[work->active[k]]);
        if (work->residual <= goal || (round > 0 && !(work->residual < 0.5 * before)))
            break;
    }
    return status == PERP_OK && !isfinite(work->residual) ? PERP__FACTOR_SINGULAR : status;
}

/* Fills work->next. Wrong signs of w count beyond rounding only: a degenerate variable stays at its
 * bound once it is there. */
static exchange find_exchange(perp__active_set *work, const int8_t *places, const double *z)
{
    const perp__lcp_problem *p = work->common.problem;
    const double z_largest = perp__largest_or_nan(z, p->n);
    exchange e = {0, -1, 0.0};

    for (int32_t i = 0; i < p->n; i++) {
        const double noise = PERP__ROUNDING_LIMIT * (p->row_norms[i] * z_largest + fabs(p->q[i])) +
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

/* The index set for large penalties, from that of small ones, by one step of Newton's method for
 * each: Hintermueller & Kunisch, "Path-following methods for a class of constrained minimization
 * problems in function space", SIAM J. Optim. 17 (2006) 159. The scaled matrix is about 1, where
 * the set is the mesh's own; a plate gives way at the edge of a contact over a length of
 * penalty^(-1/4): four times the penalty takes a third of that, which one step follows. */
static perp_status follow_penalty(perp__active_set *work, perp__lcp_iterate *iterate, int64_t limit)
{
    const perp__lcp_problem *p = work->common.problem;
    double *z = iterate->z;
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < p->n; i++) {
        work->active[i] = i;
        z[i] = perp__clamp(isfinite(z[i]) ? z[i] : 0.0, p->lower[i], p->upper[i]);
    }
    for (double penalty = SMALL_PENALTY; penalty <= 1.0 && iterate->outcome < 0; penalty *= 4.0) {
        multiply(work, z);
        perp__places_of(p, z, iterate->places);
        for (int32_t i = 0; i < p->n; i++) { /* what is outside of its bounds is pushed back */
            work->weights[i] = iterate->places[i] == PERP__BETWEEN ? 0.0 : penalty;
            work->step[i] = work->w[i] +
                            work->weights[i] * (z[i] - perp__clamp(z[i], p->lower[i], p->upper[i]));
        }
        status = perp__sparse_block_factor_with(p->block, work->active, p->n, work->weights);
        if (status != PERP_OK)
            return status;
        perp__sparse_block_solve(p->block, work->step, 0);
        for (int32_t i = 0; i < p->n; i++)
            z[i] -= work->step[i];
        iterate->outcome = ++iterate->iterations >= limit
                               ? PERP_OUTCOME_ITERATION_LIMIT
                               : perp__lcp_tick(p->control, iterate->iterations, INFINITY);
    }
    perp__places_of(p, z, iterate->places);
    return PERP_OK;
}

static perp_status exchange_all(perp__active_set *work, perp__lcp_iterate *iterate,
                                const perp__active_set_limits *limits)
{
    const perp__lcp_problem *p = work->common.problem;
    const double goal = p->settings->polish ? INFINITY : 0.1 * p->tol;
    int32_t fewest = p->n + 1, patience = limits->patience, half = p->n, creeps = 0;
    int8_t *places = iterate->places;
    perp_status status = PERP_OK;
    bool may_follow =
        p->block->kind == PERP__SPARSE_SYMMETRIC && limits->singles && !p->block->has_z_signs;

    iterate->outcome = -1;
    while (iterate->outcome < 0 && iterate->iterations < limits->iterations) {
        exchange e;

        /* 1. The equations. Without factors a solve is rough: where no polish follows, it is
         * repeated. With a proximal term one shows the signs of its own problem (the proximal point
         * method's first step, Rockafellar 1976). */
        if (work->rho == 0.0) {
            status = approach(work, places, iterate->z, ROUNDS, goal);
        } else {
            status = approach(work, places, iterate->z, 1, 0.0);
            work->residual = 0.0;
        }
        if (status == PERP__FACTOR_SINGULAR && work->rho < limits->rho) {
            work->rho = limits->rho;
            continue;
        }
        if (status == PERP__FACTOR_SINGULAR)
            iterate->outcome = p->block->late ? PERP_OUTCOME_TIME_LIMIT : PERP_OUTCOME_SINGULAR;
        if (status != PERP_OK)
            return status < 0 ? status : PERP_OK;
        iterate->iterations += work->count > 0; /* else there was nothing to solve */
        /* 2. The signs. */
        e = find_exchange(work, places, iterate->z);
        work->wrong = e.count;
        if (e.count == 0) {
            iterate->outcome = PERP_OUTCOME_SOLVED;
            return work->rho > 0.0 ? approach(work, places, iterate->z, STEPS, 0.0) : PERP_OK;
        }
        iterate->outcome = perp__lcp_tick(p->control, iterate->iterations, e.violation);
        if (iterate->outcome >= 0)
            break;
        creeps = e.count <= half ? 0 : creeps + 1;
        half = e.count <= half ? e.count / 2 : half;
        if (e.count <= limits->few && work->rho == 0.0) {
            iterate->outcome = PERP_OUTCOME_STALLED;
        } else if (may_follow && creeps > limits->patience && p->block->steps <= 0) {
            /* 3. Full exchanges have not halved their number for long, which may go on for as many
             * as a mesh has rows: the way of the penalty, once, where M can be factored. */
            may_follow = 0;
            status = follow_penalty(work, iterate, limits->iterations);
            fewest = p->n + 1;
            patience = limits->patience;
            if (status < 0)
                return status;
        } else if (e.count >= fewest && !p->block->has_z_signs && patience-- <= 0) {
            /* 4. They have failed to lower it too often: a single one. */
            places[e.last] = work->next[e.last];
            if (!limits->singles)
                iterate->outcome = PERP_OUTCOME_STALLED;
        } else {
            if (e.count < fewest) {
                fewest = e.count;
                patience = limits->patience;
            }
            memcpy(places, work->next, (size_t)p->n * sizeof *places);
        }
    }
    if (iterate->outcome < 0)
        iterate->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    return PERP_OK;
}

/* The first index set, or with *solved the last one and z. */
static perp_status start(perp__active_set *work, perp__lcp_iterate *iterate, int32_t *solved)
{
    const perp__lcp_problem *problem = work->common.problem;
    const size_t bytes = (size_t)problem->n * sizeof *work->step;
    int32_t found = PERP__TRIDIAGONAL_NO;
    perp__multigrid *grid;
    perp_status status = PERP_OK;

    /* 1. The solution's, where the matrix is a tridiagonal M-matrix. */
    memcpy(work->step, iterate->z, bytes);
    if (problem->block->kind == PERP__SPARSE_TRIDIAGONAL)
        status = perp__tridiagonal_lcp_solve(&work->tridiagonal, problem, iterate->places,
                                             iterate->z, &found);
    *solved = found == PERP__TRIDIAGONAL_SOLVED;
    if (status != PERP_OK || found >= PERP__TRIDIAGONAL_NEAR)
        return status;
    if (found == PERP__TRIDIAGONAL_FAR)
        memcpy(iterate->z, work->step, bytes);
    /* 2. Nested iteration, where the matrix suits: status 1 if it got anywhere. */
    status = perp__sparse_block_grid(problem->block, &grid);
    if (status == PERP_OK && grid && grid->unsymmetric && iterate->warm)
        grid = NULL; /* sweeps alone bring nothing to what is near */
    if (status == PERP_OK && grid)
        status = perp__nested_fit(&work->nested, grid);
    if (status == PERP_OK && grid)
        status = perp__nested_run(&work->nested, problem, iterate->warm, iterate->z,
                                  iterate->places, &iterate->iterations, &iterate->outcome);
    /* 3. Else that of the start. */
    if (status == 0) {
        memcpy(iterate->z, work->step, bytes);
        perp__active_set_places(work, iterate->z, iterate->places);
    }
    return status < 0 ? status : PERP_OK;
}

int32_t perp__active_set_correct(void *object, const double *residual, double *step)
{
    const perp__active_set *work = object;
    const perp__lcp_problem *problem = work->common.problem;

    if (!problem->block->factored) /* a rough solve would not do */
        return 0;
    memcpy(step, residual, (size_t)problem->n * sizeof *step);
    perp__sparse_block_solve(problem->block, step, 0);
    return 1;
}

perp_status perp__active_set_run(perp__active_set *work, perp__lcp_iterate *iterate,
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
    perp__active_set *work = object;
    const perp__lcp_problem *problem = work->common.problem;
    const perp__active_set_limits limits = {problem->iteration_limit > 0 ? problem->iteration_limit
                                                                         : PERP__ITERATIONS,
                                            PERP__PATIENCE, 1, 0, 0.0};
    const perp_status status = perp__active_set_run(work, iterate, &limits);

    for (int32_t i = 0; i < problem->n; i++)
        iterate->z[i] = perp__clamp(iterate->z[i], problem->lower[i], problem->upper[i]);
    iterate->has_places = iterate->outcome == PERP_OUTCOME_SOLVED;
    iterate->correct = perp__active_set_correct;
    return status;
}

void perp__active_set_release(void *object)
{
    perp__active_set *work = object;

    perp__nested_release(&work->nested);
}

const perp__lcp_method perp__lcp_active_set = {
    PERP_LCP_ACTIVE_SET,      sizeof(perp__active_set), 1, 0, NULL, perp__active_set_layout, solve,
    perp__active_set_release,
};
