/* The residuals of DESIGN.md, recomputed from the caller's own data for every method alike. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/solver.h"
#include "linalg/scale.h"

double perp__shift(double x, int32_t e)
{
    return e >= -1022 && e <= 1022 ? x * perp__power_of_two(e) : ldexp(x, e);
}

double perp__z_scaled(const perp_lcp_solver *solver, int32_t i, double z)
{
    return perp__shift(z, -solver->exponents[i] - solver->omega);
}

double perp__z_caller(const perp_lcp_solver *solver, int32_t i, double z)
{
    return perp__shift(z, solver->exponents[i] + solver->omega);
}

/* A finite bound stays finite, however far the scaling pushes it. */
static double scale_bound(const perp_lcp_solver *solver, int32_t i, double bound)
{
    double scaled = perp__z_scaled(solver, i, bound);

    if (isfinite(bound) && !isfinite(scaled))
        return bound < 0.0 ? -DBL_MAX : DBL_MAX;
    return scaled;
}

/* omega is the power of two with max |D q| in [omega, 2 omega); 1 where q = 0 */
static int32_t find_omega(const perp_lcp_solver *solver, const double *q)
{
    int32_t largest = 1, found = 0, i;

    for (i = 0; i < solver->n; i++) {
        int exponent;

        if (q[i] == 0.0)
            continue;
        frexp(q[i], &exponent);
        exponent += solver->exponents[i];
        if (!found || exponent > largest)
            largest = exponent;
        found = 1;
    }
    return largest - 1;
}

void perp__scale_problem(perp_lcp_solver *solver, const double *q)
{
    int32_t i;

    solver->q = q;
    solver->omega = find_omega(solver, q);
    if (solver->n > 0)
        solver->multiplied[0] = NAN; /* another q, and M's values may have changed */
    for (i = 0; i < solver->n; i++) {
        solver->q_scaled[i] = perp__shift(q[i], solver->exponents[i] - solver->omega);
        solver->lower_scaled[i] = scale_bound(solver, i, solver->lower[i]);
        solver->upper_scaled[i] = scale_bound(solver, i, solver->upper[i]);
    }
}

void perp__multiply_point(perp_lcp_solver *solver)
{
    const size_t bytes = (size_t)solver->n * sizeof(double);

    if (solver->n == 0 ||
        (!isnan(solver->multiplied[0]) && memcmp(solver->multiplied, solver->z, bytes) == 0))
        return;
    perp__multiply_doubled(&solver->M, solver->z, solver->q, solver->w_high, solver->w_low);
    memcpy(solver->multiplied, solver->z, bytes);
}

/* By how much row i fails to be the row of an exact solution with z's own index set. */
static double row_violation(double z, double lower, double upper, double w)
{
    if (lower == upper)
        return 0.0;
    if (z == lower)
        return w < 0.0 ? -w : 0.0;
    if (z == upper)
        return w > 0.0 ? w : 0.0;
    return fabs(w);
}

/* Once NaN, always NaN. */
static void raise_to(double *largest, double value)
{
    if (!isnan(*largest) && !(value <= *largest))
        *largest = value;
}

static double relative_violation(const perp_lcp_solver *solver, int32_t i, double z_largest)
{
    double violation =
        row_violation(solver->z[i], solver->lower[i], solver->upper[i], solver->w_high[i]);
    double size = solver->row_norms[i] * z_largest + fabs(solver->q_scaled[i]);

    violation = perp__shift(violation, solver->exponents[i] - solver->omega);
    if (violation == 0.0)
        return 0.0;
    violation /= size; /* +inf where the row has nothing to change */
    return violation >= 0.0 ? violation : INFINITY;
}

perp__evaluation perp__evaluate(perp_lcp_solver *solver)
{
    perp__evaluation worth = {0.0, 0.0, 0.0};
    double z_largest = 0.0;
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        double size;

        solver->z[i] = perp__clamp(solver->z[i], solver->lower[i], solver->upper[i]);
        size = fabs(perp__z_scaled(solver, i, solver->z[i]));
        if (!(size <= z_largest))
            z_largest = size;
    }
    perp__multiply_point(solver);
    for (i = 0; i < solver->n; i++) {
        double above = solver->z[i] - solver->lower[i];
        double below = solver->z[i] - solver->upper[i];
        const double natural = fabs(perp__mid(0.0, -above, -below, solver->w_high[i]));
        double tested = fabs(
            perp__mid(0.0, -perp__z_scaled(solver, i, above), -perp__z_scaled(solver, i, below),
                      perp__shift(solver->w_high[i], solver->exponents[i] - solver->omega)));
        double backward = relative_violation(solver, i, z_largest);

        raise_to(&worth.natural, natural);
        raise_to(&worth.tested, tested);
        raise_to(&worth.backward, backward);
    }
    return worth;
}

void perp__read_places(perp_lcp_solver *solver, int8_t *places)
{
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        double w = perp__shift(solver->w_high[i], solver->exponents[i] - solver->omega);
        double above = perp__z_scaled(solver, i, solver->z[i] - solver->lower[i]);
        double below = perp__z_scaled(solver, i, solver->z[i] - solver->upper[i]);

        if (solver->lower[i] == solver->upper[i])
            places[i] = PERP__FIXED;
        else if (above <= w)
            places[i] = PERP__AT_LOWER;
        else if (below >= w)
            places[i] = PERP__AT_UPPER;
        else
            places[i] = PERP__BETWEEN;
    }
}
