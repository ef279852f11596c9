/* The point at which a method stands, and the systems of its Newton steps. */
#include "ncp/newton.h"

#include <math.h>

#include "base/outcome.h"
#include "lcp/lcp.h"
#include "linalg/blas.h"

void perp__ncp_newton_layout(perp__arena *arena, perp__newton_run *f)
{
    const perp__ncp_model *m = f->model;
    const size_t n = (size_t)m->n;
    const size_t entries = m->sparse ? (size_t)m->problem.column_starts[n] + n : n * n;

    PERP__DOUBLES(arena, n, &f->z, &f->w, &f->phi, &f->trial_z, &f->trial_w, &f->trial_phi,
                  &f->equation, &f->slope_z, &f->slope_w, &f->d, &f->gradient, &f->part, &f->image,
                  &f->best);
    f->H = perp__arena_take(arena, entries, sizeof(double));
    f->pivots = perp__arena_take(arena, m->sparse ? 0 : n, sizeof(int32_t));
    f->signs = perp__arena_take(arena, n, sizeof(int8_t));
}

/* The rows at z and w, as the function takes them. */
static perp__fischer_point point_of(const perp__newton_run *f, const double *z, const double *w)
{
    const perp__ncp_model *m = f->model;
    const perp__fischer_point point = {m->n, z, w, m->low, m->high, f->penalty, f->smoothing};

    return point;
}

/* residual, relative and the best point yet, for z and w. */
static void note(perp__newton_run *f)
{
    f->residual = perp__ncp_residual(f->model, f->z, f->w);
    f->relative = f->scaled ? perp__ncp_tested(f->model, f->z, f->w) : f->residual;
    if (!f->any || f->residual < f->best_residual) {
        f->any = 1;
        f->best_residual = f->residual;
        perp__copy(f->best, f->z, f->model->n);
    }
}

/* What z, w are worth. */
static void appraise(perp__newton_run *f)
{
    const perp__fischer_point point = point_of(f, f->z, f->w);

    f->psi = perp__fischer_merit(&point, f->phi);
    note(f);
}

void perp__ncp_smooth(perp__newton_run *f, double mu)
{
    f->smoothing = mu;
    f->steps = 0;
    appraise(f);
}

perp_status perp__ncp_set_point(perp__newton_run *f)
{
    perp_status status = perp__ncp_evaluate(f->model, f->z, f->w);

    if (status == PERP_OK)
        appraise(f);
    return status;
}

/* omega, or that of the other side where all is 0; D unit and unit/D stay normal numbers. */
static double unit_of(double omega, double other)
{
    omega = omega > 0.0 ? omega : other > 0.0 ? other : 1.0;
    return fmin(fmax(omega, 0x1p-511), 0x1p511);
}

perp_status perp__ncp_update_jacobian(perp__newton_run *f)
{
    perp__ncp_model *m = f->model;
    const perp__matrix S = perp__ncp_view(m);
    const int32_t first = !f->scaled;
    perp_status status = perp__ncp_linearise(m, f->z, f->w);

    if (status != PERP_OK)
        return status;
    /* The same point in the units of the run's scaling, if this is its first Jacobian. Psi is
     * another function then: a run has one scaling, or Psi could grow without end from one to the
     * next. */
    if (first) {
        for (int32_t i = 0; i < m->n; i++) {
            f->z[i] *= m->z_unit[i];
            f->w[i] *= m->w_unit[i];
        }
        perp__ncp_model_equilibrate(m);
        for (int32_t i = 0; i < m->n; i++) {
            f->z[i] /= m->D[i];
            f->w[i] *= m->D[i];
        }
        perp__ncp_find_omega(m, f->z, f->w);
        for (int32_t i = 0; i < m->n; i++) {
            const double row = m->omega[i], column = m->omega[m->n + i];

            m->unit[i] = unit_of(row, column);
            m->unit[m->n + i] = unit_of(column, row);
        }
        perp__ncp_model_set_units(m);
        perp__ncp_scale_matrix(m);
        for (int32_t i = 0; i < m->n; i++) {
            f->z[i] = perp__clamp(f->z[i] / m->unit[m->n + i], m->low[i], m->high[i]);
            f->w[i] /= m->unit[i];
        }
        perp__lcp_orient(&S, m->low, m->high, f->signs);
        f->steps = 0;
        f->any = 0;
        if (!perp__all_finite(m->S, m->entries))
            return PERP__NCP_OUTSIDE;
    }
    perp__ncp_find_omega(m, f->z, f->w);
    perp__ncp_mark_start(m, f->z, f->w);
    f->scaled = 1;
    if (first)
        appraise(f);
    else
        f->relative = perp__ncp_tested(m, f->z, f->w);
    return PERP_OK;
}

void perp__ncp_slopes(perp__newton_run *f, enum perp__ncp_equation equation)
{
    const perp__ncp_model *m = f->model;
    const perp__fischer_point point = point_of(f, f->z, f->w);
    const perp__matrix S = perp__ncp_view(m);

    if (equation == PERP__NCP_FISCHER_BURMEISTER) {
        perp__fischer_slopes(&point, &S, f->part, f->image, f->slope_z, f->slope_w);
        perp__copy(f->equation, f->phi, m->n);
        return;
    }
    for (int32_t i = 0; i < m->n; i++) {
        const double above = f->z[i] - m->low[i], below = f->z[i] - m->high[i];
        const int32_t between = m->low[i] < m->high[i] && above > f->w[i] && below < f->w[i];

        f->slope_z[i] = between ? 0.0 : 1.0;
        f->slope_w[i] = between ? 1.0 : 0.0;
        f->equation[i] = perp__mid(f->z[i], m->low[i], m->high[i], f->w[i]);
    }
}

void perp__ncp_fill(perp__newton_run *f, double rho)
{
    const perp__ncp_model *m = f->model;
    const int32_t n = m->n;

    for (int32_t j = 0; j < n; j++) {
        if (m->sparse) {
            for (int32_t k = m->starts[j]; k < m->starts[j + 1]; k++)
                f->H[k] = f->slope_w[m->rows[k]] * m->S[k];
            f->H[m->diagonal[j]] += f->slope_w[j] * f->signs[j] * rho + f->slope_z[j];
        } else {
            double *column = f->H + (size_t)j * (size_t)n;
            const double *from = m->S + (size_t)j * (size_t)n;

            for (int32_t i = 0; i < n; i++)
                column[i] = f->slope_w[i] * from[i];
            column[j] += f->slope_w[j] * f->signs[j] * rho + f->slope_z[j];
        }
    }
}

perp_status perp__ncp_newton_direction(perp__newton_run *f, double rho)
{
    const perp__ncp_model *m = f->model;
    const perp__square H = {m->n, f->H, m->starts, m->rows};
    double largest = 0.0;
    perp_status status = PERP_OK;

    if (m->sparse)
        status = perp__kept_factor_analyse(&f->factor, m->context, &H);
    if (status == PERP_OK) {
        perp__ncp_fill(f, rho);
        status = m->sparse ? perp__klu_factor(f->factor.factor, &H)
                           : perp__lu_factor_finite(m->n, f->H, f->pivots);
    }
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < m->n; i++)
        f->d[i] = -f->equation[i];
    if (m->sparse)
        perp__klu_solve(f->factor.factor, f->d, 0);
    else
        perp__lu_solve(m->n, f->H, m->n, f->pivots, f->d, 0);
    /* A step far beyond the problem's own size is one along a null vector of a matrix that rounding
     * alone keeps regular. */
    for (int32_t i = 0; i < 2 * m->n; i++)
        largest = fmax(largest, m->omega[i]);
    for (int32_t i = 0; i < m->n; i++)
        if (!(sqrt(DBL_EPSILON) * fabs(f->d[i]) <= largest))
            return PERP__FACTOR_SINGULAR;
    return PERP_OK;
}

void perp__ncp_gradient(perp__newton_run *f)
{
    const perp__matrix S = perp__ncp_view(f->model);

    for (int32_t i = 0; i < S.rows; i++)
        f->part[i] = f->slope_w[i] * f->phi[i];
    for (int32_t j = 0; j < S.columns; j++)
        f->gradient[j] = perp__column_times(&S, j, f->part) + f->slope_z[j] * f->phi[j];
}

perp_status perp__ncp_iterate(perp__newton_run *f, perp__ncp_step step, void *own)
{
    double first = INFINITY, last = INFINITY;
    perp__fischer_progress progress = {INFINITY, INFINITY, 0};

    for (f->iterations = 0;; f->iterations++) {
        perp_status status = perp__ncp_tick(f->model, &f->outcome, f->iterations, f->residual);

        if (status != PERP_OK || f->outcome >= 0)
            return status;
        status = perp__ncp_update_jacobian(f);
        f->outcome = PERP_OUTCOME_SINGULAR;
        if (status != PERP_OK)
            return status < 0 ? status : PERP_OK;
        /* 1. A start that leaves no more than rounding is there. Later points must show it by a
         * step that does not help: omega may have run away by then, and is no measure. */
        f->outcome = PERP_OUTCOME_SOLVED;
        if (f->residual == 0.0 ||
            (f->relative <= f->target && (!f->finish || f->residual > 0.5 * last ||
                                          (isinf(last) && f->relative <= PERP__ROUNDING_LIMIT))))
            return PERP_OK;
        /* 2. The limits. */
        f->outcome = PERP_OUTCOME_ITERATION_LIMIT;
        if (f->iterations == 0)
            first = f->residual;
        if (f->iterations >= f->limit ||
            (f->iterations == f->fruitless && f->fruitless > 0 && f->best_residual > 0.1 * first))
            return PERP_OK;
        /* 3. The step. */
        last = f->residual;
        status = step(f, own);
        f->outcome = PERP_OUTCOME_STALLED;
        if (status != 1 ||
            perp__fischer_creeps(&progress,
                                 (perp__fischer_progress){f->best_residual, f->psi, f->iterations}))
            return status < 0 ? status : PERP_OK;
    }
}

/* ---- steps along the projected arc P(z + t d). Where F is not defined the step is shortened like
 * one that did not help. Nonmonotone: Grippo, Lampariello & Lucidi, SIAM J. Numer. Anal. 23 (1986)
 * ---- */

double perp__ncp_reference(const perp__newton_run *f)
{
    double most = f->psi;

    for (int64_t k = 0; k < PERP__MEMORY && k < f->steps; k++)
        most = f->recent[k] > most ? f->recent[k] : most;
    return most;
}

/* The trial point for t, and its Psi. */
static perp_status attempt(perp__newton_run *f, double t)
{
    const perp__ncp_model *m = f->model;
    const perp__fischer_point point = point_of(f, f->trial_z, f->trial_w);
    perp_status status;

    for (int32_t i = 0; i < m->n; i++)
        f->trial_z[i] = perp__clamp(f->z[i] + t * f->d[i], m->low[i], m->high[i]);
    status = perp__ncp_evaluate(f->model, f->trial_z, f->trial_w);
    if (status == PERP_OK)
        f->trial_psi = perp__fischer_merit(&point, f->trial_phi);
    return status;
}

static void move(perp__newton_run *f)
{
    f->recent[f->steps++ % PERP__MEMORY] = f->psi;
    perp__copy(f->z, f->trial_z, f->model->n);
    perp__copy(f->w, f->trial_w, f->model->n);
    perp__copy(f->phi, f->trial_phi, f->model->n);
    f->psi = f->trial_psi;
    note(f);
}

perp_status perp__ncp_line_search(perp__newton_run *f, double reference, double slope,
                                  const double *gradient, int32_t halvings)
{
    double t = 1.0;

    for (int32_t k = 0; k <= halvings; k++, t *= 0.5) {
        perp_status status = attempt(f, t);
        double promised = t * slope;

        if (status < 0)
            return status;
        for (int32_t i = 0; gradient && i < f->model->n; i++)
            promised += gradient[i] * (f->trial_z[i] - f->z[i]);
        if (status == PERP_OK && (promised < 0.0 || !gradient) &&
            f->trial_psi <= reference + PERP__ARMIJO * promised) {
            move(f);
            return 1;
        }
    }
    return 0;
}

perp_status perp__ncp_descend(perp__newton_run *f)
{
    const perp__ncp_model *m = f->model;
    const perp__matrix S = perp__ncp_view(m);

    perp__ncp_slopes(f, PERP__NCP_FISCHER_BURMEISTER);
    perp__ncp_gradient(f);
    for (int32_t i = 0; i < m->n; i++)
        f->d[i] = m->low[i] < m->high[i] ? f->gradient[i] : 0.0;
    perp__fischer_descent(&S, f->slope_z, f->slope_w, f->d, f->image);
    return perp__ncp_line_search(f, f->psi, 0.0, f->gradient, PERP__HALVINGS);
}
