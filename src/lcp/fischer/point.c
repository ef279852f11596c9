/* The point at which the semismooth Newton method stands. */
#include <math.h>
#include <string.h>

#include "lcp/fischer/fischer.h"

void perp__fischer_multiply(const perp__fischer_state *f, const double *z, double *w)
{
    const perp__lcp_problem *problem = f->common.problem;

    if (problem->n > 0)
        memcpy(w, problem->q, (size_t)problem->n * sizeof *w);
    perp__fischer_matrix_add(&f->S, z, w);
}

double perp__fischer_evaluate(const perp__fischer_state *f, const double *z, const double *w,
                              double *phi)
{
    const perp__lcp_problem *p = f->common.problem;
    double sum = 0.0;

    for (int32_t i = 0; i < p->n; i++) {
        phi[i] = perp__fischer_bounded(z[i], p->lower[i], p->upper[i], w[i], f->penalty);
        sum += phi[i] * phi[i];
    }
    return 0.5 * sum;
}

void perp__fischer_judge(perp__fischer_state *f)
{
    const perp__lcp_problem *p = f->common.problem;
    double residual = 0.0;

    for (int32_t i = 0; i < p->n; i++) {
        f->trial_z[i] = perp__clamp(f->z[i], p->lower[i], p->upper[i]);
        f->part[i] = f->trial_z[i] - f->z[i];
        f->trial_w[i] = f->w[i];
    }
    perp__fischer_matrix_add(&f->S, f->part, f->trial_w);
    for (int32_t i = 0; i < p->n; i++) {
        double r = fabs(perp__mid(f->trial_z[i], p->lower[i], p->upper[i], f->trial_w[i]));

        if (!(r <= residual) && !isnan(residual)) /* NaN stays */
            residual = r;
    }
    if (residual < f->best_residual) {
        f->best_residual = residual;
        memcpy(f->best, f->trial_z, (size_t)p->n * sizeof(double));
    }
}

void perp__fischer_stand(perp__fischer_state *f)
{
    perp__fischer_multiply(f, f->z, f->w);
    f->psi = perp__fischer_evaluate(f, f->z, f->w, f->phi);
    perp__fischer_judge(f);
}

void perp__fischer_move(perp__fischer_state *f)
{
    memcpy(f->z, f->trial_z, (size_t)f->common.problem->n * sizeof(double));
    perp__fischer_stand(f);
}

void perp__fischer_solve_rows(perp__fischer_state *f, double *x, double *image)
{
    const int32_t n = f->common.problem->n;

    for (int32_t i = 0; i < n; i++) {
        image[i] = 0.0;
        f->part[i] = isfinite(f->weights[i]) ? 0.0 : x[i];
    }
    perp__fischer_matrix_add(&f->S, f->part, image);
    for (int32_t i = 0; i < n; i++)
        if (isfinite(f->weights[i]))
            x[i] -= image[i];
    perp__fischer_matrix_solve(&f->S, x);
    for (int32_t i = 0; i < n; i++)
        f->part[i] = isfinite(f->weights[i]) ? x[i] : 0.0;
    perp__fischer_matrix_add(&f->S, f->part, image);
}
