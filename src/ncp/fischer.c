/* Semismooth Newton on Phi(z) = 0, Phi the Fischer-Burmeister function for boxes: De Luca,
 * Facchinei & Kanzow, "A semismooth equation approach to the solution of nonlinear complementarity
 * problems", Math. Prog. 75 (1996), with Billups' composition for bounds and steps projected onto
 * them. It begins with the Newton steps of active sets, as long as those help (a crash), or follows
 * the smoothed equations as mu falls to 0 (Kanzow 1996, see lcp/fischer). Where H is singular or
 * its step does not help: S + rho I, then down the gradient. */
#include "ncp/newton.h"

#include <math.h>

/* rho, one after the other until a direction serves. */
static const double proximal[] = {0.0, 1e-10, 1e-6, 1e-3, 1e-1};

/* Along Newton's direction for an equation; a crash tries rho = 0 alone, and Psi has to fall at
 * once. 1 if it moved, 0 if not, or a negative status. */
static perp_status newton_step(perp__newton_run *f, enum perp__ncp_equation equation)
{
    const int32_t crash = equation == PERP__NCP_NATURAL;

    perp__ncp_slopes(f, equation);
    for (size_t k = 0; k < (crash ? 1 : sizeof proximal / sizeof proximal[0]); k++) {
        perp_status status = perp__ncp_newton_direction(f, proximal[k]);

        if (status == PERP_OK)
            status = perp__ncp_line_search(
                f, crash ? f->psi + (PERP__PROGRESS - 1.0) * f->psi : perp__ncp_reference(f),
                crash ? 0.0 : -2.0 * f->psi, NULL, crash ? 3 : PERP__NCP_HALVINGS);
        else if (status > 0)
            continue;
        if (status != 0)
            return status;
    }
    return 0;
}

static perp_status step(perp__newton_run *f, void *own)
{
    int32_t *crashing = own;
    perp_status moved = 0;

    /* On the path mu falls as far as the point is near its equation. */
    if (f->path && f->iterations == 0 && isfinite(f->psi)) /* else mu could not fall */
        perp__ncp_smooth(f, perp__largest(f->phi, f->model->n));
    while (f->smoothing > 0.0 &&
           perp__largest(f->phi, f->model->n) <= PERP__FISCHER_NEAR * f->smoothing)
        perp__ncp_smooth(f, f->smoothing > DBL_EPSILON ? PERP__FISCHER_SHARE * f->smoothing : 0.0);
    if (*crashing)
        moved = newton_step(f, PERP__NCP_NATURAL);
    *crashing = moved == 1;
    while (moved == 0) {
        moved = newton_step(f, PERP__NCP_FISCHER_BURMEISTER);
        if (moved != 0 || !perp__ncp_sharpen(f->model))
            break;
        moved = perp__ncp_update_jacobian(f);
        if (moved != PERP_OK)
            return moved < 0 ? moved : 0;
    }
    return moved != 0 ? moved : perp__ncp_descend(f);
}

perp_status perp__ncp_fischer(perp__newton_run *f)
{
    int32_t crashing = !f->path;

    return perp__ncp_iterate(f, step, &crashing);
}
