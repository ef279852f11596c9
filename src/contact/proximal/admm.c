/* Alternating directions (Boyd et al., Foundations and Trends in ML 3 (2011) 1) on
 *
 *   v = J'r,  y = J v + q,  r = P(r - rho y)
 *
 * with the law of each contact as it stands in the place of a projection: r = P(-z), y = (z + r) /
 * rho, v = (I + rho J'J)^-1 J'(r - rho (q - y)), z = rho (J v + q) - r, the speeds over-relaxed.
 * One factorisation for all sweeps; the method for a middle accuracy, and to begin with. */
#include <string.h>

#include "contact/proximal/proximal.h"

/* Sweeps after which the residual is looked at. */
enum { LOOK = 10 };

static void set_stiffness(perp__proximal *s, const perp__proximal_part *part, double rho)
{
    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const int32_t side = s->side;
        double *K = perp__proximal_slope(s, k);

        memset(K, 0, (size_t)(side * side) * sizeof *K);
        for (int32_t i = 0; i < side; i++)
            K[side * i + i] = rho;
    }
}

perp_status perp__proximal_split_run(perp__proximal *s, const perp__proximal_part *part, double rho,
                                     int32_t sweeps)
{
    const size_t rows = (size_t)(part->last_row - part->row);
    perp_status status = PERP_OK;

    s->outcome = perp__proximal_tick(s, &status);
    if (s->outcome >= 0)
        return status;
    set_stiffness(s, part, rho);
    s->factorisations++;
    if (!perp__proximal_factor(s, part)) {
        s->outcome = PERP_OUTCOME_STALLED;
        return PERP_OK;
    }
    perp__proximal_push(s, part, s->x, s->v);
    for (int32_t k = 0; k < sweeps && s->outcome < 0; k++) {
        perp__proximal_split(s, part, rho, k == 0);
        memcpy(s->v + (size_t)part->block * (size_t)s->width,
               s->rhs + (size_t)part->block * (size_t)s->width,
               (size_t)(part->last_block - part->block) * (size_t)s->width * sizeof *s->v);
        perp__fronts_solve(&s->fronts, part->block, part->last_block, s->v);
        s->sweeps++;
        if ((k + 1) % LOOK == 0 || k + 1 == sweeps) {
            memcpy(s->start + part->row, s->x + part->row, rows * sizeof *s->x);
            s->residual = perp__proximal_judge(s, part, s->start, s->speed);
            if (s->residual <= s->tol)
                break;
            s->outcome = perp__proximal_tick(s, &status);
        }
    }
    perp__proximal_project(s, part, s->x);
    return status;
}
