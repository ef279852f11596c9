/* What Lemke's method lends to the polish: the inverse of the active block that its last tableau or
 * its crash holds. */
#include <string.h>

#include "lcp/lemke/lemke.h"

/* With x_A basic and v_A nonbasic, x_A = ... - T_AA v_A: where M z + q leaves v_A at a residual,
 * x_A is off by -T_AA times it. */
int32_t perp__lemke_correct(void *work, const double *residual, double *step)
{
    perp__lemke *l = work;
    double *v = l->far, *x = l->column;
    int32_t k, c;

    for (c = 0; c < l->tableau.columns; c++)
        v[c] = 0.0;
    for (k = 0; k < l->pairs; k++) {
        if (l->twin[k] >= 0)
            return 0; /* x_k is half of a variable */
        if (l->row_of[k] < 0)
            continue;
        c = l->column_of[l->pairs + k];
        if (c < 0)
            return 0; /* a free variable's equation has been dropped, or t is in the way */
        v[c] = -l->sign[k] * l->row_unit[k] * residual[l->index[k]];
    }
    perp__tableau_multiply(&l->tableau, v, x);
    memset(step, 0, (size_t)l->head.problem->n * sizeof *step);
    for (k = 0; k < l->pairs; k++)
        if (l->row_of[k] >= 0)
            step[l->index[k]] = l->sign[k] * l->column_unit[k] * x[l->row_of[k]];
    return 1;
}

int32_t perp__lemke_correct_crash(void *work, const double *residual, double *step)
{
    perp__lemke *l = work;

    memcpy(step, residual, (size_t)l->head.problem->n * sizeof *step);
    perp__active_block_solve(&l->crash.active, l->crash.places, step);
    return 1;
}
