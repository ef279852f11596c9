/* Semismooth Newton on Phi(z) = 0, Phi the Fischer-Burmeister function for boxes: De Luca,
 * Facchinei & Kanzow, "A semismooth equation approach to the solution of nonlinear complementarity
 * problems", Math. Prog. 75 (1996), with Billups' composition for bounds and steps projected onto
 * them. It begins with the Newton steps of active sets, as long as those help (a crash). Where H is
 * singular or its step does not help: S + rho I, then down the gradient. */
#include "ncp/newton.h"

/* rho, one after the other until a direction serves. */
static const double proximal[] = {0.0, 1e-10, 1e-6, 1e-3, 1e-1};

/* All return 1 if they moved, 0 if not, or a negative status. */
static perp_status newton_step(perp__newton_run *f)
{
    for (size_t k = 0; k < sizeof proximal / sizeof proximal[0]; k++) {
        perp_status status = perp__ncp_newton_direction(f, proximal[k]);

        if (status < 0)
            return status;
        if (status != PERP_OK)
            continue;
        status =
            perp__ncp_line_search(f, perp__ncp_reference(f), -2.0 * f->psi, PERP__NCP_HALVINGS);
        if (status != 0)
            return status;
    }
    return 0;
}

static perp_status step(perp__newton_run *f, void *own)
{
    int32_t *crashing = own;
    perp_status moved = 0;

    if (*crashing) {
        perp__ncp_slopes(f, PERP__NCP_NATURAL);
        moved = perp__ncp_newton_direction(f, 0.0);
        if (moved == PERP_OK)
            moved = perp__ncp_line_search(f, f->psi + (PERP__PROGRESS - 1.0) * f->psi, 0.0, 3);
        else if (moved > 0)
            moved = 0;
        *crashing = moved == 1;
    }
    if (moved != 0)
        return moved;
    perp__ncp_slopes(f, PERP__NCP_FISCHER_BURMEISTER);
    moved = newton_step(f);
    if (moved == 0 && perp__ncp_sharpen(f->model)) {
        moved = perp__ncp_update_jacobian(f);
        if (moved != PERP_OK)
            return moved < 0 ? moved : 0;
        perp__ncp_slopes(f, PERP__NCP_FISCHER_BURMEISTER);
        moved = newton_step(f);
    }
    return moved != 0 ? moved : perp__ncp_descend(f);
}

perp_status perp__ncp_fischer(perp__newton_run *f)
{
    int32_t crashing = 1;

    return perp__ncp_iterate(f, step, &crashing);
}
