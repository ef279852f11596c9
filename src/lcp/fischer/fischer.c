/* Semismooth Newton on the Fischer-Burmeister function: De Luca, Facchinei & Kanzow, "A semismooth
 * equation approach to the solution of nonlinear complementarity problems", Math. Programming 75
 * (1996) 407, with the bounds of Billups' thesis (1995) and the penalty of Chen, Chen & Kanzow, "A
 * penalized Fischer-Burmeister NCP-function", Math. Programming 88 (2000) 211.
 *
 * What differs: phi has the opposite sign; the line search is nonmonotone (Grippo, Lampariello &
 * Lucidi 1986); an active set's step is tried before Newton's, see steps.c; the first
 * point comes from a few cheap steps, or from the path of the smoothed equations as mu falls to 0
 * (Kanzow 1996): where S is monotone and solutions are many, as in linear programs, H is singular
 * at each, and the path alone leads there. A descent method on Psi may end in a local minimum that
 * solves nothing (Billups): that is outcome 'stalled'. */
#include "lcp/fischer/fischer.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/outcome.h"

#define AIM 0.1   /* goes on to tol * AIM while it can: the next step is cheap or the last */
#define LAST 1e-5 /* mu below which the path takes Phi = 0; where that fails, a share of it */

/* Before attempt 0, 1, ... from a cold start and from a warm one: different starts end in different
 * local minima of Psi. */
typedef struct start {
    int32_t sweeps, jacobi;
    int32_t active; /* tries active-set steps */
    int32_t path;   /* follows the smoothed equation first */
} start;

static const start starts[2][PERP__FISCHER_STARTS] = {
    {{10, 0, 1, 0}, {0, 0, 1, 1}, {0, 20, 1, 0}, {0, 0, 0, 0}, {0, 60, 0, 0}},
    {{0, 0, 1, 0}, {0, 0, 1, 1}, {10, 0, 1, 0}, {0, 20, 1, 0}, {0, 60, 0, 0}},
};

static void layout(perp__arena *arena, void *object)
{
    perp__fischer_state *f = object;
    size_t n = (size_t)f->common.problem->n;

    f->active = perp__arena_take(arena, n, sizeof(int32_t));
    PERP__DOUBLES(arena, n, &f->w, &f->phi, &f->slope_z, &f->slope_w, &f->weights, &f->d, &f->image,
                  &f->correction, &f->part, &f->work, &f->trial_z, &f->trial_w, &f->trial_phi,
                  &f->best, &f->kept_z);
    f->places = perp__arena_take(arena, n, sizeof(int8_t));
    f->next_places = perp__arena_take(arena, n, sizeof(int8_t));
}

/* w = F(z) */
static void multiply(const perp__fischer_state *f, const double *z, double *w)
{
    perp__copy(w, f->common.problem->q, f->common.problem->n);
    perp__multiply_add(f->S, z, w);
}

double perp__fischer_evaluate(const perp__fischer_state *f, const double *z, const double *w,
                              double *phi)
{
    const perp__lcp_problem *p = f->common.problem;
    const perp__fischer_point point = {p->n, z, w, p->lower, p->upper, f->penalty, f->smoothing};

    return perp__fischer_merit(&point, phi);
}

/* Keeps z, projected onto the bounds, if its natural residual is the smallest so far. Uses trial_z,
 * trial_w, part. */
static void keep_best(perp__fischer_state *f)
{
    const perp__lcp_problem *p = f->common.problem;
    double residual = 0.0;

    for (int32_t i = 0; i < p->n; i++) {
        f->trial_z[i] = perp__clamp(f->z[i], p->lower[i], p->upper[i]);
        f->part[i] = f->trial_z[i] - f->z[i];
        f->trial_w[i] = f->w[i];
    }
    perp__multiply_add(f->S, f->part, f->trial_w);
    for (int32_t i = 0; i < p->n; i++)
        perp__raise_to(&residual,
                       fabs(perp__mid(f->trial_z[i], p->lower[i], p->upper[i], f->trial_w[i])));
    if (residual < f->best_residual) {
        f->best_residual = residual;
        memcpy(f->best, f->trial_z, (size_t)p->n * sizeof(double));
    }
}

void perp__fischer_set_point(perp__fischer_state *f)
{
    multiply(f, f->z, f->w);
    f->psi = perp__fischer_evaluate(f, f->z, f->w, f->phi);
    keep_best(f);
}

void perp__fischer_take_trial(perp__fischer_state *f)
{
    memcpy(f->z, f->trial_z, (size_t)f->common.problem->n * sizeof(double));
    perp__fischer_set_point(f);
}

void perp__fischer_solve_rows(perp__fischer_state *f, double *x, double *image)
{
    const int32_t n = f->common.problem->n;

    for (int32_t i = 0; i < n; i++) {
        image[i] = 0.0;
        f->part[i] = isfinite(f->weights[i]) ? 0.0 : x[i];
    }
    perp__multiply_add(f->S, f->part, image);
    for (int32_t i = 0; i < n; i++)
        if (isfinite(f->weights[i]))
            x[i] -= image[i];
    perp__sparse_block_solve(f->common.problem->block, x, 0);
    for (int32_t i = 0; i < n; i++)
        f->part[i] = isfinite(f->weights[i]) ? x[i] : 0.0;
    perp__multiply_add(f->S, f->part, image);
}

/* y += x S_j */
static void add_column(const perp__matrix *S, int32_t j, double x, double *y)
{
    perp__matrix column = *S;

    column.columns = 1;
    if (S->column_starts)
        column.column_starts += j;
    else
        column.values += (size_t)j * S->column_stride;
    perp__multiply_add(&column, &x, y);
}

/* Sweeps of projected Gauss-Seidel by columns, which keep w up to date. */
static void sweeps(perp__fischer_state *f, int32_t count)
{
    const perp__lcp_problem *p = f->common.problem;
    double last = f->best_residual;

    for (int32_t k = 0; k < count && !perp__is_past(p->control->deadline); k++) {
        for (int32_t j = 0; j < p->n; j++) {
            const double z = f->z[j];
            double diagonal = perp__entry(f->S, j, j);

            if (!(diagonal > 0.0))
                diagonal = p->row_norms[j] > 0.0 ? p->row_norms[j] : 1.0;
            f->z[j] = perp__clamp(z - f->w[j] / diagonal, p->lower[j], p->upper[j]);
            if (f->z[j] != z)
                add_column(f->S, j, f->z[j] - z, f->w);
        }
        keep_best(f);
        if (!(f->best_residual <= PERP__PROGRESS * last))
            break;
        last = f->best_residual;
    }
}

/* The equation is Phi_mu = 0 from here on, and what the line search looks back on is its Psi. */
static void smooth(perp__fischer_state *f, double mu)
{
    f->smoothing = mu;
    perp__fischer_set_point(f);
    for (int32_t k = 0; k < PERP__MEMORY; k++)
        f->recent[k] = f->psi;
}

/* One step of either kind. On the path mu falls first, as far as the point is near its equation. */
static perp_status step(perp__fischer_state *f, int32_t active)
{
    perp_status moved = 0;

    while (f->smoothing > 0.0 &&
           perp__largest(f->phi, f->common.problem->n) <= PERP__FISCHER_NEAR * f->smoothing)
        smooth(f, f->smoothing > f->last ? PERP__FISCHER_SHARE * f->smoothing : 0.0);
    f->recent[f->steps++ % PERP__MEMORY] = f->psi;
    if (active && f->smoothing == 0.0) {
        moved = perp__fischer_active_step(f);
        if (moved == 0 && f->last > DBL_EPSILON)
            smooth(f, f->last *= PERP__FISCHER_SHARE);
    }
    return moved != 0 ? moved : perp__fischer_newton_step(f);
}

static perp_status run(perp__fischer_state *f, int32_t active, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *problem = f->common.problem;
    const int64_t limit =
        problem->iteration_limit > 0 ? problem->iteration_limit : PERP__ITERATIONS;
    /* what the active sets of an unsymmetric S miss at first is left to the path */
    const int32_t brief = iterate->attempt == 0 && !f->common.problem->block->is_symmetric;
    perp__fischer_progress last = {INFINITY, INFINITY, 0};

    iterate->outcome = -1;
    while (iterate->outcome < 0 && f->steps < limit && f->best_residual > AIM * problem->tol) {
        const perp_status moved = step(f, active);

        if (moved < 0)
            return moved;
        iterate->iterations = f->steps;
        iterate->outcome =
            perp__fischer_creeps(&last,
                                 (perp__fischer_progress){f->best_residual, f->psi, f->steps}) ||
                    !moved || (brief && f->failures > 0)
                ? PERP_OUTCOME_STALLED
                : perp__lcp_tick(problem->control, f->steps, f->best_residual);
    }
    if (iterate->outcome < 0)
        iterate->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    if (f->best_residual <= problem->tol)
        iterate->outcome = PERP_OUTCOME_SOLVED;
    return PERP_OK;
}

static perp_status solve(void *object, perp__lcp_iterate *iterate)
{
    perp__fischer_state *f = object;
    const perp__lcp_problem *problem = f->common.problem;
    const size_t bytes = (size_t)problem->n * sizeof(double);
    const start *first = &starts[iterate->warm ? 1 : 0][iterate->attempt];
    perp_status status;

    f->S = problem->M;
    f->penalty = problem->settings->penalty;
    f->smoothing = 0.0;
    f->z = iterate->z;
    f->steps = 0;
    f->best_residual = INFINITY;
    memcpy(f->best, iterate->z, bytes);
    f->has_places = f->watched = f->failures = 0;
    f->rho = 0.0;
    /* 1. Where Newton's method begins: a guess at which bounds are active, safe for any S since
     * only the best point met is kept. */
    perp__fischer_set_point(f);
    sweeps(f, first->sweeps);
    for (int32_t k = 0; k < first->jacobi && !perp__is_past(problem->control->deadline);
         k++) { /* z := mid(l, u, z - w_i / |S_i|_1) */
        for (int32_t i = 0; i < problem->n; i++) {
            const double s = problem->row_norms[i] > 0.0 ? problem->row_norms[i] : 1.0;

            f->z[i] = perp__clamp(f->z[i] - f->w[i] / s, problem->lower[i], problem->upper[i]);
        }
        multiply(f, f->z, f->w);
        keep_best(f);
    }
    memcpy(f->z, f->best, bytes);
    perp__fischer_set_point(f);
    f->last = first->path ? LAST : 0.0;
    if (first->path && isfinite(f->psi)) /* else mu could not fall */
        smooth(f, perp__largest(f->phi, problem->n));
    /* 2. Its steps. */
    status = run(f, first->active, iterate);
    memcpy(iterate->z, f->best, bytes);
    iterate->has_places = 0;
    return status;
}

const perp__lcp_method perp__lcp_fischer = {
    PERP_LCP_FISCHER,
    sizeof(perp__fischer_state),
    PERP__FISCHER_STARTS,
    0,
    NULL,
    NULL,
    layout,
    solve,
    NULL,
};
