/* The polish where the method that found the point holds the inverse of its active block: one step
 * of refinement with it, instead of a factorisation, if that is all it takes. */
#include <math.h>
#include <string.h>

#include "lcp/solver.h"

/* A step of relative size s leaves an error of about s^2, as the inverse is about as inaccurate as
 * the point that came with it. */
#define PERP__LAST_STEP 1e-8

/* The residual on the rows between the bounds, in scaled units. 0 where z is not at the bound that
 * its place says: w is not that of the index set then. */
static int32_t take_residual(const perp_lcp_solver *solver, double *residual)
{
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        const double z = solver->z[i];

        residual[i] = 0.0;
        if (solver->places[i] == PERP__BETWEEN)
            residual[i] = perp__w_scaled(solver, i, solver->w_high[i]);
        else if (z != (solver->places[i] == PERP__AT_UPPER ? solver->upper[i] : solver->lower[i]))
            return 0;
    }
    return 1;
}

/* z := z - step; true if the step is small beside z. */
static int32_t take_step(perp_lcp_solver *solver, const double *step)
{
    double largest = 0.0, z_largest = 0.0;
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        const double z = perp__z_scaled(solver, i, solver->z[i]) - step[i];

        if (!(fabs(step[i]) <= largest))
            largest = fabs(step[i]);
        if (fabs(z) > z_largest)
            z_largest = fabs(z);
        if (solver->places[i] == PERP__BETWEEN)
            solver->z[i] = perp__z_caller(solver, i, z);
    }
    return largest <= PERP__LAST_STEP * z_largest;
}

int32_t perp__polish_correct(perp_lcp_solver *solver, perp__evaluation *worth)
{
    const size_t bytes = (size_t)solver->n * sizeof(double);
    perp__polish *p = &solver->polish;
    perp__evaluation found;

    if (!solver->correct || !take_residual(solver, p->z) ||
        !solver->correct(solver->correct_work, p->z, p->step))
        return 0;
    memcpy(p->z, solver->z, bytes);
    memcpy(p->w_high, solver->w_high, bytes);
    memcpy(p->w_low, solver->w_low, bytes);
    if (take_step(solver, p->step)) {
        found = perp__evaluate(solver);
        if (perp__is_exact(solver, &found)) {
            *worth = found;
            return 1;
        }
    }
    memcpy(solver->z, p->z, bytes);
    memcpy(solver->w_high, p->w_high, bytes);
    memcpy(solver->w_low, p->w_low, bytes);
    return 0;
}
