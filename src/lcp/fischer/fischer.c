/* Semismooth Newton on the Fischer-Burmeister function: De Luca, Facchinei & Kanzow, "A semismooth
 * equation approach to the solution of nonlinear complementarity problems", Math. Programming 75
 * (1996) 407, with the bounds of Billups' thesis (1995) and the penalty of Chen, Chen & Kanzow, "A
 * penalized Fischer-Burmeister NCP-function", Math. Programming 88 (2000) 211.
 *
 * What differs: phi has the opposite sign; the line search is nonmonotone (Grippo, Lampariello &
 * Lucidi 1986); an active set's step is tried before Newton's, see fischer_active.c; the first
 * point comes from a few cheap steps. A descent method on Psi may end in a local minimum that
 * solves nothing (Billups): that is outcome 'stalled'. */
#include "lcp/fischer/fischer.h"

#include <math.h>
#include <string.h>

#define ITERATIONS 500 /* default limit */
#define AIM 0.1        /* goes on to tol * AIM while it can: the next step is cheap or the last */
#define PATIENCE 30    /* iterations without progress, see is_stuck */

/* Before attempt 0, 1, ... from a cold start and from a warm one: different starts end in different
 * local minima of Psi. */
typedef struct start {
    int32_t steps, jacobi;
    int32_t active; /* tries active-set steps */
} start;

#define ATTEMPTS 4
static const start starts[2][ATTEMPTS] = {
    {{10, 0, 1}, {0, 20, 0}, {0, 0, 0}, {0, 60, 0}},
    {{0, 0, 1}, {10, 0, 1}, {0, 20, 0}, {0, 60, 0}},
};

static perp_status check(const perp__lcp_problem *problem)
{
    (void)problem;
    return PERP_OK;
}

static void layout(perp__arena *arena, void *object)
{
    perp__fischer_state *f = object;
    size_t n = (size_t)f->common.problem->n;
    double **const vectors[] = {&f->w,       &f->phi,     &f->slope_z,    &f->slope_w, &f->weights,
                                &f->d,       &f->image,   &f->correction, &f->part,    &f->work,
                                &f->trial_z, &f->trial_w, &f->trial_phi,  &f->best,    &f->kept_z};

    perp__fischer_matrix_layout(arena, &f->S, f->common.problem);
    for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; k++)
        *vectors[k] = perp__arena_take(arena, n, sizeof(double));
    f->places = perp__arena_take(arena, n, sizeof(int8_t));
    f->next_places = perp__arena_take(arena, n, sizeof(int8_t));
}

/* Returns 1 if z moved, 0 if nothing more can be done, or PERP_ERROR_MEMORY. */
static perp_status iteration(perp__fischer_state *f, int32_t active)
{
    perp_status moved = 0;

    f->recent[f->steps++ % PERP__FISCHER_MEMORY] = f->psi;
    if (active)
        moved = perp__fischer_active_step(f);
    return moved != 0 ? moved : perp__fischer_newton_step(f);
}

/* Neither the residual nor Psi has fallen by a quarter for PATIENCE iterations. */
typedef struct milestone {
    double residual, psi;
    int64_t iteration;
} milestone;

static int32_t is_stuck(milestone *last, const perp__fischer_state *f)
{
    if (f->best_residual < 0.75 * last->residual || f->psi < 0.75 * last->psi) {
        last->residual = f->best_residual;
        last->psi = f->psi;
        last->iteration = f->steps;
    }
    return f->steps - last->iteration > PATIENCE;
}

static perp_status run(perp__fischer_state *f, int32_t active, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *problem = f->common.problem;
    int64_t limit = problem->iteration_limit > 0 ? problem->iteration_limit : ITERATIONS;
    double goal = AIM * problem->tol;
    milestone last = {INFINITY, INFINITY, 0};

    iterate->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    while (f->steps < limit && f->best_residual > goal) {
        perp_status moved = iteration(f, active);
        perp_outcome request;

        if (moved < 0)
            return moved;
        iterate->iterations = f->steps;
        if (!moved || is_stuck(&last, f)) {
            iterate->outcome = PERP_OUTCOME_STALLED;
            break;
        }
        request = perp__lcp_tick(problem->control, f->steps, f->best_residual);
        if (request >= 0) {
            iterate->outcome = request;
            break;
        }
    }
    if (f->best_residual <= problem->tol)
        iterate->outcome = PERP_OUTCOME_SOLVED;
    return PERP_OK;
}

static void begin(perp__fischer_state *f, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *problem = f->common.problem;

    f->penalty = problem->settings->penalty;
    f->z = iterate->z;
    f->steps = 0;
    f->best_residual = INFINITY;
    memcpy(f->best, iterate->z, (size_t)problem->n * sizeof(double));
    f->has_places = f->watched = f->failures = 0;
    f->rho = 0.0;
}

static perp_status solve(void *object, perp__lcp_iterate *iterate)
{
    perp__fischer_state *f = object;
    const perp__lcp_problem *problem = f->common.problem;
    const start *first = &starts[iterate->warm ? 1 : 0][iterate->attempt];
    perp_status status;

    perp__fischer_matrix_read(&f->S, problem);
    begin(f, iterate);
    perp__fischer_start(f, first->steps, first->jacobi);
    status = run(f, first->active, iterate);
    memcpy(iterate->z, f->best, (size_t)problem->n * sizeof(double));
    iterate->has_places = 0;
    return status;
}

static void release(void *object)
{
    perp__fischer_state *f = object;

    perp__fischer_matrix_release(&f->S);
}

const perp__lcp_method perp__lcp_fischer = {
    PERP_LCP_FISCHER, sizeof(perp__fischer_state), ATTEMPTS, NULL, check, layout, solve, release,
};
