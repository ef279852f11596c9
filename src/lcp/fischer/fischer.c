/* Semismooth Newton on the Fischer-Burmeister function: De Luca, Facchinei & Kanzow, "A semismooth
 * equation approach to the solution of nonlinear complementarity problems", Math. Programming 75
 * (1996) 407, with the bounds of Billups' thesis (1995) and the penalty of Chen, Chen & Kanzow, "A
 * penalized Fischer-Burmeister NCP-function", Math. Programming 88 (2000) 211.
 *
 * What differs: phi has the opposite sign; the line search is nonmonotone (Grippo, Lampariello &
 * Lucidi 1986); an active set's step is tried before Newton's, see steps.c; the first
 * point comes from a few cheap steps. A descent method on Psi may end in a local minimum that
 * solves nothing (Billups): that is outcome 'stalled'. */
#include "lcp/fischer/fischer.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/outcome.h"

#define AIM 0.1     /* goes on to tol * AIM while it can: the next step is cheap or the last */
#define PATIENCE 30 /* iterations without progress */
#define SLACK 0.95  /* of the start: Khobotov's bound on t |F(y) - F(z)| / |y - z| */

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
    const perp__lcp_problem *problem = f->common.problem;

    if (problem->n > 0)
        memcpy(w, problem->q, (size_t)problem->n * sizeof *w);
    perp__multiply_add(f->S, z, w);
}

double perp__fischer_evaluate(const perp__fischer_state *f, const double *z, const double *w,
                              double *phi)
{
    const perp__lcp_problem *p = f->common.problem;
    const perp__fischer_point point = {p->n, z, w, p->lower, p->upper, f->penalty};

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

/* y := P(z - t w), F(y) -> wy; returns t |F(y) - F(z)| / |y - z|, 0 where y = z. */
static double look_ahead(perp__fischer_state *f, double t, double *y, double *wy)
{
    const perp__lcp_problem *p = f->common.problem;
    double moved = 0.0, changed = 0.0;

    for (int32_t i = 0; i < p->n; i++)
        y[i] = perp__clamp(f->z[i] - t * f->w[i], p->lower[i], p->upper[i]);
    multiply(f, y, wy);
    for (int32_t i = 0; i < p->n; i++) {
        moved += (y[i] - f->z[i]) * (y[i] - f->z[i]);
        changed += (wy[i] - f->w[i]) * (wy[i] - f->w[i]);
    }
    return moved > 0.0 ? t * sqrt(changed / moved) : 0.0;
}

/* z := P(z - t F(P(z - t F(z)))): Korpelevich 1976, for monotone F; t as in Khobotov 1987. */
static void extragradient(perp__fischer_state *f, int32_t steps)
{
    const perp__lcp_problem *p = f->common.problem;
    double *y = f->correction, *wy = f->work;
    double t = 1.0;

    for (int32_t k = 0; k < steps && !perp__is_past(p->control->deadline); k++) {
        double ratio = look_ahead(f, t, y, wy);

        for (int32_t shrink = 0; shrink < PERP__HALVINGS && !(ratio <= SLACK); shrink++) {
            t *= ratio < 1.0 ? 0.7 : ratio < 9.0 ? 0.9 / ratio : 0.1;
            ratio = look_ahead(f, t, y, wy);
        }
        for (int32_t i = 0; i < p->n; i++)
            f->z[i] = perp__clamp(f->z[i] - t * wy[i], p->lower[i], p->upper[i]);
        multiply(f, f->z, f->w);
        keep_best(f);
    }
}

static perp_status run(perp__fischer_state *f, int32_t active, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *problem = f->common.problem;
    const int64_t limit =
        problem->iteration_limit > 0 ? problem->iteration_limit : PERP__ITERATIONS;
    double residual = INFINITY, psi = INFINITY; /* when they had last fallen by a quarter, */
    int64_t progress = 0;                       /* and when that was */

    iterate->outcome = -1;
    while (iterate->outcome < 0 && f->steps < limit && f->best_residual > AIM * problem->tol) {
        perp_status moved = 0;

        f->recent[f->steps++ % PERP__MEMORY] = f->psi;
        if (active)
            moved = perp__fischer_active_step(f);
        if (moved == 0)
            moved = perp__fischer_newton_step(f);
        if (moved < 0)
            return moved;
        iterate->iterations = f->steps;
        if (f->best_residual < 0.75 * residual || f->psi < 0.75 * psi) {
            residual = f->best_residual;
            psi = f->psi;
            progress = f->steps;
        }
        iterate->outcome = !moved || f->steps - progress > PATIENCE
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
    f->z = iterate->z;
    f->steps = 0;
    f->best_residual = INFINITY;
    memcpy(f->best, iterate->z, bytes);
    f->has_places = f->watched = f->failures = 0;
    f->rho = 0.0;
    /* 1. Where Newton's method begins: a guess at which bounds are active, safe for any S since
     * only the best point met is kept. */
    perp__fischer_set_point(f);
    if (problem->block->is_symmetric)
        sweeps(f, first->steps);
    else
        extragradient(f, first->steps);
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
    /* 2. Its steps. */
    status = run(f, first->active, iterate);
    memcpy(iterate->z, f->best, bytes);
    iterate->has_places = 0;
    return status;
}

const perp__lcp_method perp__lcp_fischer = {
    PERP_LCP_FISCHER, sizeof(perp__fischer_state), ATTEMPTS, 0, NULL, NULL, layout, solve, NULL,
};
