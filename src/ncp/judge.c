/* The residuals of DESIGN.md, of the linear problem (J(z), F(z) - J(z) z). */
#include <float.h>
#include <math.h>
#include <string.h>

#include "ncp/solver.h"

/* A cosine below which a column of H is orthogonal to Phi: well above rounding, far below what a
 * descent method would call progress. */
#define ORTHOGONAL 1e-4

/* Once NaN, always NaN. */
static void raise_to(double *largest, double value)
{
    if (!isnan(*largest) && !(value <= *largest))
        *largest = value;
}

/* By how much row i fails to be the row of an exact solution with z's own index set. */
static double violation(double z, double lower, double upper, double w)
{
    if (lower == upper)
        return 0.0;
    if (z == lower)
        return w < 0.0 ? -w : 0.0;
    if (z == upper)
        return w > 0.0 ? w : 0.0;
    return fabs(w);
}

/* part := row sums of |S|, image := D q; returns omega. */
static double find_scales(perp__ncp_walk *f)
{
    const perp__ncp_model *m = f->model;
    const double omega = perp__ncp_omega(m, f->z, f->w, f->part, f->image);

    memset(f->part, 0, (size_t)m->n * sizeof(double));
    for (int32_t j = 0; j < m->n; j++)
        if (m->sparse)
            for (int32_t k = m->starts[j]; k < m->starts[j + 1]; k++)
                f->part[m->rows[k]] += fabs(m->S[k]);
        else
            for (int32_t i = 0; i < m->n; i++)
                f->part[i] += fabs(m->S[(size_t)j * (size_t)m->n + (size_t)i]);
    return omega;
}

static void measure(perp_ncp_solver *solver, perp__ncp_worth *worth, double omega)
{
    const perp__ncp_model *m = &solver->model;
    const perp__ncp_walk *f = &solver->walk;
    double z_largest = 0.0;

    for (int32_t i = 0; i < m->n; i++)
        z_largest = fmax(z_largest, fabs(f->z[i]));
    for (int32_t i = 0; i < m->n; i++) {
        const double z = solver->candidate[i], size = f->part[i] * z_largest + fabs(f->image[i]);
        const double wrong = violation(z, m->lower[i], m->upper[i], m->w_caller[i]) / m->w_unit[i];

        raise_to(&worth->natural, fabs(perp__ncp_mid(z, m->lower[i], m->upper[i], m->w_caller[i])));
        raise_to(&worth->tested,
                 fabs(perp__ncp_mid(f->z[i], m->low[i], m->high[i], f->w[i])) / omega);
        if (wrong > 0.0)
            raise_to(&worth->backward, wrong / size >= 0.0 ? wrong / size : INFINITY);
    }
}

perp_status perp__ncp_judge(perp_ncp_solver *solver, perp__ncp_worth *worth)
{
    perp__ncp_model *m = &solver->model;
    perp__ncp_walk *f = &solver->walk;
    const size_t bytes = (size_t)m->n * sizeof(double);
    const double tol = solver->settings.tol;
    perp_status status;
    double omega = 1.0;
    int32_t sane;

    memset(worth, 0, sizeof *worth);
    perp__ncp_model_unscale(m);
    if (m->n > 0)
        memcpy(f->z, solver->candidate, bytes);
    status = perp__ncp_evaluate(m, f->z, f->w);
    if (status != PERP_OK)
        return status;
    status = perp__ncp_linearise(m, f->z, f->w);
    if (status < 0)
        return status;
    if (status == PERP_OK && m->n > 0) {
        perp__ncp_model_equilibrate(m);
        for (int32_t i = 0; i < m->n; i++) {
            f->z[i] /= m->z_unit[i];
            f->w[i] /= m->w_unit[i];
        }
        omega = find_scales(f);
    } else if (m->n > 0) {
        memset(f->part, 0, bytes); /* no Jacobian: no scales, and no backward error */
        memset(f->image, 0, bytes);
    }
    measure(solver, worth, omega);
    worth->outcome = -1;
    worth->at_start = perp__ncp_residual_at_start(m, solver->candidate, m->w_caller);
    sane = worth->at_start <= sqrt(tol);
    if (worth->tested <= tol && sane)
        worth->outcome = PERP_OUTCOME_SOLVED;
    else if (worth->backward <= 16.0 * DBL_EPSILON && worth->tested <= sqrt(tol) && sane)
        worth->outcome = PERP_OUTCOME_ROUNDING_LIMIT;
    return PERP_OK;
}

/* The columns of H = D_z + D_w S, one by one against Phi. */
static int32_t is_stationary(const perp__ncp_walk *f)
{
    const perp__ncp_model *m = f->model;
    const int32_t n = m->n;
    double phi = 0.0;

    for (int32_t i = 0; i < n; i++)
        phi += f->phi[i] * f->phi[i];
    for (int32_t j = 0; j < n; j++) {
        const double g = f->gradient[j];
        double square = 0.0;

        if ((f->z[j] <= m->low[j] && g >= 0.0) || (f->z[j] >= m->high[j] && g <= 0.0))
            continue;
        if (m->sparse)
            for (int32_t k = m->starts[j]; k < m->starts[j + 1]; k++) {
                const int32_t i = m->rows[k];
                const double h = f->slope_w[i] * m->S[k] + (i == j ? f->slope_z[j] : 0.0);

                square += h * h;
            }
        else
            for (int32_t i = 0; i < n; i++) {
                const double h = f->slope_w[i] * m->S[(size_t)j * (size_t)n + (size_t)i] +
                                 (i == j ? f->slope_z[j] : 0.0);

                square += h * h;
            }
        if (!(fabs(g) <= ORTHOGONAL * sqrt(square) * sqrt(phi)))
            return 0;
    }
    return 1;
}

perp_status perp__ncp_look_for_trap(perp_ncp_solver *solver, int32_t *trapped)
{
    perp__ncp_model *m = &solver->model;
    perp__ncp_walk *f = &solver->walk;
    perp_status status;

    *trapped = 0;
    perp__ncp_model_unscale(m);
    memcpy(f->z, solver->best_z, (size_t)m->n * sizeof(double));
    f->scaled = 0;
    f->best_residual = INFINITY;
    status = perp__ncp_stand(f);
    if (status == PERP_OK)
        status = perp__ncp_look(f);
    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    perp__ncp_slopes(f, PERP__NCP_FISCHER_BURMEISTER);
    perp__ncp_gradient(f);
    *trapped = is_stationary(f);
    return PERP_OK;
}
