/* The last digits: the natural map at z shows which variables are at a bound; those are set to it,
 * and the others solve F_A(z) = 0 by Newton's method, as long as the residual falls. */
#include <math.h>
#include <string.h>

#include "ncp/newton.h"

#define STEPS 20

/* z + d, bounds exactly where the active set says so. PERP_OK with trial_w, or a failure. */
static perp_status attempt(perp__newton_run *f)
{
    const perp__ncp_model *m = f->model;

    for (int32_t i = 0; i < m->n; i++) {
        double z = f->z[i] + f->d[i];

        if (f->slope_z[i] != 0.0) /* at the nearer bound, or fixed */
            z = f->z[i] - m->low[i] <= m->high[i] - f->z[i] ? m->low[i] : m->high[i];
        f->trial_z[i] = perp__ncp_clamp(z, m->low[i], m->high[i]);
    }
    return perp__ncp_evaluate(f->model, f->trial_z, f->trial_w);
}

/* Where the block is singular, rho I keeps the step short; the solution still attracts. */
static const double proximal[] = {0.0, 1e-14, 1e-11, 1e-8};

/* 1 if the residual did not rise, 0 if it did, or a negative status. */
static perp_status step(perp__newton_run *f)
{
    perp__ncp_slopes(f, PERP__NCP_NATURAL);
    for (size_t k = 0; k < sizeof proximal / sizeof proximal[0]; k++) {
        perp_status status = perp__ncp_newton_direction(f, proximal[k]);

        if (status == PERP_OK)
            status = attempt(f);
        if (status < 0)
            return status;
        if (status == PERP_OK &&
            perp__ncp_residual(f->model, f->trial_z, f->trial_w) <= f->residual) {
            memcpy(f->z, f->trial_z, (size_t)f->model->n * sizeof(double));
            status = perp__ncp_set_point(f);
            return status < 0 ? status : status == PERP_OK;
        }
        if (f->relative <= PERP__NCP_ROUNDING)
            break; /* nothing to gain */
    }
    return 0;
}

perp_status perp__ncp_polish(perp__newton_run *f)
{
    for (int32_t k = 0; k < STEPS && f->model->n > 0; k++) {
        const double last = f->residual;
        perp_outcome ended;
        perp_status moved, status = perp__ncp_tick(f->model, &ended, f->iterations, last);

        if (status != PERP_OK || ended >= 0)
            return status;
        status = perp__ncp_update_jacobian(f);
        moved = status == PERP_OK ? step(f) : status < 0 ? status : 0;
        if (moved < 0)
            return moved;
        if (moved && f->residual <= 0.5 * last && f->residual > 0.0)
            continue;
        if (f->relative <= PERP__NCP_ROUNDING || !perp__ncp_sharpen(f->model))
            break; /* else the step was no better than the Jacobian: once more */
    }
    return PERP_OK;
}
