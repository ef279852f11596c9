/* The residuals of docs/lcp.md, of the linear problem (J(z), F(z) - J(z) z). */
#include <math.h>
#include <string.h>

#include "ncp/solver.h"

/* A cosine below which a column of H is orthogonal to Phi: well above rounding, far below what a
 * descent method would call progress. */
#define ORTHOGONAL 1e-4

/* The second witness on the linear problem, in the caller's units. */
static double own_residual(perp_ncp_solver *solver)
{
    const perp__ncp_model *m = &solver->model;
    const perp__matrix J = perp__ncp_given(m);
    double *q = solver->run.newton.slope_w, *least = solver->run.newton.slope_z;
    perp__witness_point point;

    for (int32_t i = 0; i < m->n; i++) {
        q[i] = m->offset[i] * m->w_unit[i];
        least[i] = perp__ncp_size_left(m, i, 0.0) * m->z_unit[i];
    }
    point.M = &J;
    point.exponents = m->exponents;
    point.part = m->part;
    point.parts = 2 * m->n;
    point.q = q;
    point.lower = m->lower;
    point.upper = m->upper;
    point.z = solver->candidate;
    point.w = m->w_caller;
    point.least = least;
    point.tol = solver->settings.tol;
    solver->witness.known = 0;
    return perp__witness_own_residual(&solver->witness, &point);
}

/* The candidate, in the coordinates of the equilibrated Jacobian there. */
static void measure(perp_ncp_solver *solver, perp__evidence *evidence)
{
    perp__ncp_model *m = &solver->model;
    perp__newton *f = &solver->run.newton;
    const int32_t *row_part = m->part, *column_part = m->part + m->n;
    const perp__matrix S = perp__ncp_view(m);

    perp__ncp_model_equilibrate(m);
    for (int32_t i = 0; i < m->n; i++) {
        f->z[i] /= m->z_unit[i];
        f->w[i] /= m->w_unit[i];
        f->part[i] = 0.0;
    }
    perp__ncp_find_omega(m, f->z, f->w);
    /* part := row sums of |S|, image := the largest |z_j| that row i hangs together with */
    memset(m->most, 0, 2 * (size_t)m->n * sizeof(double));
    for (int32_t j = 0; j < m->n; j++) {
        const perp__line l = perp__line_of(&S, j);

        for (int32_t k = 0; k < l.count; k++)
            f->part[l.indices ? l.indices[k] : k] += fabs(l.values[k]);
        m->most[column_part[j]] = fmax(m->most[column_part[j]], fabs(f->z[j]));
    }
    evidence->tested = perp__ncp_tested(m, f->z, f->w);
    evidence->backward = 0.0;
    for (int32_t i = 0; i < m->n; i++) {
        const double wrong =
            perp__row_violation(solver->candidate[i], m->lower[i], m->upper[i], m->w_caller[i]);
        double eta;

        f->image[i] = m->most[row_part[i]];
        eta = wrong / m->w_unit[i] / (f->part[i] * f->image[i] + fabs(m->offset[i]));
        if (wrong > 0.0)
            perp__raise_to(&evidence->backward, eta >= 0.0 ? eta : INFINITY);
    }
    evidence->own_residual = evidence->tested;
    if (evidence->tested <= sqrt(solver->settings.tol))
        evidence->own_residual = own_residual(solver);
}

perp_status perp__ncp_outcome_of(perp_ncp_solver *solver, perp__ncp_residuals *residuals)
{
    perp__ncp_model *m = &solver->model;
    perp__newton *f = &solver->run.newton;
    perp__evidence *evidence = &residuals->evidence;
    const double *z = solver->candidate, deadline = m->control.deadline;
    const bool late = perp__ncp_is_late(m);
    perp_status status;

    /* 1. F, once more, come what may; and J where it can be had: differences take many calls of F,
     * for which there may be no time left, and the last J that is known has to do then. */
    perp__ncp_model_unscale(m);
    perp__copy(f->z, z, m->n);
    m->control.deadline = 0.0;
    status = perp__ncp_evaluate(m, f->z, f->w);
    m->control.deadline = deadline;
    m->apart = 1;
    if (status == PERP_OK && m->n > 0 && (!late || m->problem.jacobian))
        status = perp__ncp_linearise(m, f->z, f->w);
    if (status != PERP_OK && (status != PERP__NCP_OUTSIDE || m->known))
        return status;
    /* 2. The numbers. */
    residuals->natural = 0.0;
    for (int32_t i = 0; i < m->n; i++)
        perp__raise_to(&residuals->natural,
                       fabs(perp__mid(z[i], m->lower[i], m->upper[i], m->w_caller[i])));
    residuals->at_start = perp__ncp_residual_at_start(m, solver->candidate, m->w_caller);
    if (m->known && m->n > 0) {
        measure(solver, evidence);
    } else { /* no scales but those of the start */
        const bool tells = perp__ncp_start_tells(m, solver->candidate, m->w_caller);

        evidence->tested = tells && m->start_known ? residuals->at_start : residuals->natural;
        evidence->own_residual = tells ? evidence->tested : INFINITY;
        evidence->backward = INFINITY;
    }
    evidence->sound = residuals->at_start <= sqrt(solver->settings.tol) &&
                      perp__all_finite(solver->candidate, (size_t)m->n) &&
                      perp__all_finite(m->w_caller, (size_t)m->n);
    return PERP_OK;
}

/* The columns of H = D_z + D_w S, one by one against Phi. */
static int32_t is_stationary(const perp__newton *f)
{
    const double phi = perp__dot(f->phi, f->phi, f->n);

    for (int32_t j = 0; j < f->n; j++) {
        const perp__line l = perp__line_of(&f->S, j);
        const double g = f->gradient[j];
        double square = 0.0;

        if ((f->z[j] <= f->lower[j] && g >= 0.0) || (f->z[j] >= f->upper[j] && g <= 0.0))
            continue;
        for (int32_t k = 0; k < l.count; k++) {
            const int32_t i = l.indices ? l.indices[k] : k;
            const double h = f->slope_w[i] * l.values[k] + (i == j ? f->slope_z[j] : 0.0);

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
    perp__newton *f = &solver->run.newton;
    perp_status status;

    *trapped = 0;
    perp__ncp_model_unscale(m);
    perp__copy(f->z, solver->best_z, m->n);
    status = perp__ncp_start_run(&solver->run);
    PERP__THEN(status, perp__ncp_update_jacobian(&solver->run));
    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    perp__newton_find_gradient(f);
    *trapped = is_stationary(f);
    return PERP_OK;
}
