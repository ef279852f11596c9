/* The scaling of a run, the systems of its Newton steps, and when it ends. */
#include "ncp/newton.h"

#include <math.h>

#include "base/outcome.h"
#include "lcp/lcp.h"
#include "linalg/blas.h"

void perp__ncp_run_layout(perp__arena *arena, perp__ncp_run *r)
{
    const perp__ncp_model *m = r->model;
    const size_t n = (size_t)m->n;
    const size_t entries = m->sparse ? (size_t)m->problem.column_starts[n] + n : n * n;

    perp__newton_layout(arena, &r->newton, n);
    r->newton.z = perp__arena_take(arena, n, sizeof(double));
    r->H = perp__arena_take(arena, entries, sizeof(double));
    r->pivots = perp__arena_take(arena, m->sparse ? 0 : n, sizeof(int32_t));
    r->signs = perp__arena_take(arena, n, sizeof(int8_t));
}

/* omega, or that of the other side where all is 0; D unit and unit/D stay normal numbers. */
static double unit_of(double omega, double other)
{
    omega = omega > 0.0 ? omega : other > 0.0 ? other : 1.0;
    return fmin(fmax(omega, 0x1p-511), 0x1p511);
}

/* The same point in the units of the run's scaling, at its first Jacobian. Psi is another function
 * then: a run has one scaling, or Psi could grow without end from one to the next. */
static perp_status scale(perp__ncp_run *r)
{
    perp__ncp_model *m = r->model;
    double *z = r->newton.z, *w = r->newton.w;

    for (int32_t i = 0; i < m->n; i++) {
        z[i] *= m->z_unit[i];
        w[i] *= m->w_unit[i];
    }
    perp__ncp_model_equilibrate(m);
    for (int32_t i = 0; i < m->n; i++) {
        z[i] /= m->D[i];
        w[i] *= m->D[i];
    }
    perp__ncp_find_omega(m, z, w);
    for (int32_t i = 0; i < m->n; i++) {
        const double row = m->omega[i], column = m->omega[m->n + i];

        m->unit[i] = unit_of(row, column);
        m->unit[m->n + i] = unit_of(column, row);
    }
    perp__ncp_model_set_units(m);
    perp__ncp_scale_matrix(m);
    for (int32_t i = 0; i < m->n; i++) {
        z[i] = perp__clamp(z[i] / m->unit[m->n + i], m->low[i], m->high[i]);
        w[i] /= m->unit[i];
    }
    perp__lcp_orient(&r->newton.S, m->low, m->high, r->signs);
    r->scaled = 1;
    perp__newton_start(&r->newton);
    return perp__all_finite(m->S, m->entries) ? PERP_OK : PERP__NCP_OUTSIDE;
}

perp_status perp__ncp_update_jacobian(perp__ncp_run *r)
{
    perp__ncp_model *m = r->model;
    const bool first = !r->scaled;
    perp_status status = perp__ncp_linearise(m, r->newton.z, r->newton.w);

    if (status == PERP_OK && first)
        status = scale(r);
    if (status != PERP_OK)
        return status;
    perp__ncp_find_omega(m, r->newton.z, r->newton.w);
    perp__ncp_mark_start(m, r->newton.z, r->newton.w);
    if (first)
        perp__newton_appraise(&r->newton);
    r->relative = perp__ncp_tested(m, r->newton.z, r->newton.w);
    return PERP_OK;
}

void perp__ncp_fill(perp__ncp_run *r, double rho)
{
    const perp__ncp_model *m = r->model;
    const double *slope_z = r->newton.slope_z, *slope_w = r->newton.slope_w;
    const int32_t n = m->n;

    for (int32_t j = 0; j < n; j++) {
        if (m->sparse) {
            for (int32_t k = m->starts[j]; k < m->starts[j + 1]; k++)
                r->H[k] = slope_w[m->rows[k]] * m->S[k];
            r->H[m->diagonal[j]] += slope_w[j] * r->signs[j] * rho + slope_z[j];
        } else {
            double *column = r->H + (size_t)j * (size_t)n;
            const double *from = m->S + (size_t)j * (size_t)n;

            for (int32_t i = 0; i < n; i++)
                column[i] = slope_w[i] * from[i];
            column[j] += slope_w[j] * r->signs[j] * rho + slope_z[j];
        }
    }
}

/* ---- a perp__newton_problem ---- */

static perp_status evaluate(perp__newton *f, const double *z, double *w)
{
    const perp__ncp_run *r = f->owner;

    return perp__ncp_evaluate(r->model, z, w);
}

static perp_status direction(perp__newton *f, double rho)
{
    perp__ncp_run *r = f->owner;
    const perp__ncp_model *m = r->model;
    const perp__square H = {m->n, r->H, m->starts, m->rows};
    double largest = 0.0;
    perp_status status = PERP_OK;

    if (m->sparse)
        status = perp__cached_factor_analyse(&r->factor, m->context, &H);
    if (status == PERP_OK) {
        perp__ncp_fill(r, rho);
        status = m->sparse ? perp__klu_factor(r->factor.factor, &H)
                           : perp__lu_factor_finite(m->n, r->H, r->pivots);
    }
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < m->n; i++)
        f->d[i] = -f->phi[i];
    if (m->sparse)
        perp__klu_solve(r->factor.factor, f->d, 0);
    else
        perp__lu_solve(m->n, r->H, m->n, r->pivots, f->d, 0);
    /* A step far beyond the problem's own size is one along a null vector of a matrix that rounding
     * alone keeps regular. */
    for (int32_t i = 0; i < 2 * m->n; i++)
        largest = fmax(largest, m->omega[i]);
    for (int32_t i = 0; i < m->n; i++)
        if (!(sqrt(DBL_EPSILON) * fabs(f->d[i]) <= largest))
            return PERP__FACTOR_SINGULAR;
    return PERP_OK;
}

static perp_status begin(perp__newton *f)
{
    perp__ncp_run *r = f->owner;
    perp_status status = perp__ncp_tick(r->model, &f->outcome, f->iterations, f->residual);

    if (status != PERP_OK || f->outcome >= 0)
        return status;
    status = perp__ncp_update_jacobian(r);
    if (status != PERP_OK) {
        f->outcome = PERP_OUTCOME_SINGULAR;
        return status < 0 ? status : PERP_OK;
    }
    if (f->iterations == 0) {
        r->first = f->residual;
        r->last = INFINITY;
    }
    /* A start that leaves no more than rounding is there. Later points must show it by a step that
     * does not help: omega may have run away by then, and is no measure. */
    if (f->residual == 0.0 ||
        (r->relative <= f->target && (!r->finish || f->residual > 0.5 * r->last ||
                                      (isinf(r->last) && r->relative <= PERP__ROUNDING_LIMIT))))
        f->outcome = PERP_OUTCOME_SOLVED;
    else if (f->iterations >= f->limit || (f->iterations == r->fruitless && r->fruitless > 0 &&
                                           f->best_residual > 0.1 * r->first))
        f->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    r->last = f->residual;
    return PERP_OK;
}

perp_status perp__ncp_start_run(perp__ncp_run *r)
{
    static const perp__newton_problem nonlinear = {evaluate, direction, begin};
    perp__newton *f = &r->newton;

    f->problem = &nonlinear;
    f->owner = r;
    f->n = r->model->n;
    f->projects = 1;
    f->lower = r->model->low;
    f->upper = r->model->high;
    f->S = perp__ncp_view(r->model);
    f->least = DBL_EPSILON;
    f->iterations = 0;
    r->scaled = 0;
    perp__newton_start(f);
    return perp__newton_set_point(f);
}

/* ---- the method that goes by Newton's steps alone: first those of active sets, as long as each
 * helps (a crash), where no path is followed ---- */

/* Newton's step for mid(z - l, z - u, w) = 0, an active set's own. Psi has to fall at once. */
static perp_status crash(perp__newton *f)
{
    perp_status status;

    for (int32_t i = 0; i < f->n; i++) {
        f->phi[i] = perp__mid(f->z[i], f->lower[i], f->upper[i], f->w[i]);
        f->slope_w[i] = f->lower[i] < f->upper[i] && f->phi[i] == f->w[i] ? 1.0 : 0.0;
        f->slope_z[i] = 1.0 - f->slope_w[i];
    }
    status = direction(f, 0.0);
    perp__newton_appraise(f);
    if (status != PERP_OK)
        return status < 0 ? status : 0;
    return perp__newton_search(f, PERP__PROGRESS * f->psi, 0.0, NULL, PERP__HALVINGS);
}

static perp_status step(perp__newton *f, void *user)
{
    perp__ncp_run *r = user;
    perp_status moved = r->crashing ? crash(f) : 0;

    r->crashing = moved == 1;
    if (moved != 0)
        return moved;
    perp__newton_follow_path(f);
    moved = perp__newton_by_direction(f);
    while (moved == 0 && perp__ncp_sharpen(r->model)) {
        moved = perp__ncp_update_jacobian(r);
        if (moved != PERP_OK)
            return moved < 0 ? moved : 0; /* F is not defined around */
        moved = perp__newton_by_direction(f);
    }
    return moved != 0 ? moved : perp__newton_descend(f);
}

perp_status perp__ncp_fischer(perp__ncp_run *r)
{
    r->crashing = !r->newton.path;
    return perp__newton_iterate(&r->newton, step, r);
}
