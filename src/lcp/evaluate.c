/* The residuals of docs/lcp.md, recomputed from the caller's own data for every method alike. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/outcome.h"
#include "lcp/solver.h"
#include "linalg/doubled.h"
#include "linalg/scale.h"

void perp__find_reach(perp_lcp_solver *solver)
{
    memset(solver->reach, 0, (size_t)solver->parts * sizeof *solver->reach);
    for (int32_t i = 0; i < solver->n; i++)
        perp__raise_to(&solver->reach[solver->part[solver->n + i]],
                       fabs(perp__z_scaled(solver, i, solver->z[i])));
}

/* A finite bound stays finite, however far the scaling pushes it. */
static double scale_bound(const perp_lcp_solver *solver, int32_t i, double bound)
{
    double scaled;

    if (bound == 0.0 || isinf(bound)) /* most bounds */
        return bound;
    scaled = perp__z_scaled(solver, i, bound);
    return isfinite(scaled) ? scaled : bound < 0.0 ? -DBL_MAX : DBL_MAX;
}

static perp__evaluation measure(const perp_lcp_solver *solver)
{
    const double tol = solver->settings.tol, unit = 0.5 * DBL_EPSILON * solver->n;
    perp__evaluation residuals = {0.0, 0.0, 0.0, 1, 1};
    double nothing = 0.0; /* NaN once a NaN or an infinity is met */

    for (int32_t i = 0; i < solver->n; i++) {
        const double lower = solver->lower[i], upper = solver->upper[i], z = solver->z[i];
        const double w = solver->w_high[i], scaled = perp__w_scaled(solver, i, w);
        const double above = perp__z_scaled(solver, i, z - lower);
        const double below = perp__z_scaled(solver, i, z - upper);
        const double size =
            solver->row_norms[i] * solver->reach[solver->part[i]] + fabs(solver->q_scaled[i]);
        double violation = perp__row_violation(z, lower, upper, w);
        double residual = fabs(perp__middle(above, below, scaled));

        perp__raise_to(&residuals.natural, fabs(perp__middle(z - lower, z - upper, w)));
        if (solver->doubtful) {
            /* At the end of w's interval where it is larger. Doubled precision may leave that much
             * wrong in w: where z is as large as 1e24, far along a null vector of M, it has lost q,
             * and a w of 0 says nothing. */
            const double margin = unit * unit * solver->witness.terms[i];

            if (margin < INFINITY) {
                residual = fabs(perp__middle(above, below, scaled - margin));
                perp__raise_to(&residual, fabs(perp__middle(above, below, scaled + margin)));
            } else if (isfinite(scaled)) { /* it may be anything */
                residual = fmax(fabs(above), fabs(below));
            }
        }
        perp__raise_to(&residuals.tested, residual);
        residuals.small &= violation <= tol * fabs(solver->q[i]);
        violation = perp__w_scaled(solver, i, violation);
        if (violation != 0.0) {
            violation /= size; /* +inf where the row has nothing to change */
            perp__raise_to(&residuals.backward, violation >= 0.0 ? violation : INFINITY);
        }
        nothing += 0.0 * z + 0.0 * w;
    }
    residuals.finite = nothing == 0.0;
    return residuals;
}

void perp__scale_problem(perp_lcp_solver *solver, const double *q)
{
    const perp__parts parts = {solver->n, solver->parts, solver->part};

    solver->q = q;
    if (solver->length > solver->n) {
        memcpy(solver->q_own, q, (size_t)solver->n * sizeof *q);
        solver->q = solver->q_own;
    }
    for (int32_t i = 0; i < solver->n && solver->is_turned; i++)
        solver->q_own[i] = solver->signs[i] * q[i];
    if (solver->is_turned)
        solver->q = solver->q_own;
    if (perp__find_omegas(&parts, solver->q, solver->exponents, solver->part_omega, solver->omega,
                          solver->powers_known)) {
        /* powers of two for the exponents and omegas as they are, and the bounds with them */
        solver->powers_known = solver->powers_normal = 1;
        for (int32_t i = 0; i < solver->n && solver->powers_normal; i++) {
            const int32_t z = solver->exponents[i] + solver->omega[solver->n + i];
            const int32_t w = solver->exponents[i] - solver->omega[i];

            solver->powers_normal = abs(z) <= 1022 && abs(w) <= 1022;
            if (solver->powers_normal) {
                solver->z_down[i] = perp__power_of_two(-z);
                solver->z_up[i] = perp__power_of_two(z);
                solver->w_down[i] = perp__power_of_two(w);
            }
        }
        for (int32_t i = 0; i < solver->n; i++) {
            solver->lower_scaled[i] = scale_bound(solver, i, solver->lower[i]);
            solver->upper_scaled[i] = scale_bound(solver, i, solver->upper[i]);
        }
    }
    for (int32_t i = 0; i < solver->n; i++)
        solver->q_scaled[i] = perp__w_scaled(solver, i, solver->q[i]);
}

void perp__find_product(perp_lcp_solver *solver)
{
    for (int32_t i = 0; i < solver->n; i++)
        solver->z[i] = perp__clamp(solver->z[i], solver->lower[i], solver->upper[i]);
    perp__multiply_doubled(&solver->wide, solver->z, solver->q, solver->w_high, solver->w_low);
}

/* Rows whose products or partial sums left the range of doubles once more, DOWN powers of two
 * smaller. What leaves it then is lost to cancellation in doubled precision, or is infinite. */
static void sum_overflowed(perp_lcp_solver *solver)
{
    enum { DOWN = 200 }; /* 1024 + 2 * 53 + log2 n < 1024 + DOWN */
    const int32_t n = solver->n;
    int32_t *overflowed = solver->work;
    perp__cursor c = perp__first(&solver->M);

    for (int32_t i = 0; i < n; i++) {
        overflowed[i] = !isfinite(solver->w_high[i]) || !isfinite(solver->w_low[i]);
        if (overflowed[i]) {
            solver->w_high[i] = perp__shift(solver->q[i], -DOWN);
            solver->w_low[i] = 0.0;
        }
    }
    while (perp__advance(&c))
        if (overflowed[c.i] && solver->z[c.j] != 0.0) {
            const int32_t power = perp__exponent_of(c.value);

            perp__accumulate(&solver->w_high[c.i], &solver->w_low[c.i],
                             perp__shift(c.value, -power),
                             perp__shift(solver->z[c.j], power - DOWN));
        }
    for (int32_t i = 0; i < n; i++)
        if (overflowed[i]) {
            const double sum = solver->w_high[i] + solver->w_low[i];

            solver->w_low[i] = perp__shift((solver->w_high[i] - sum) + solver->w_low[i], DOWN);
            solver->w_high[i] = perp__shift(sum, DOWN);
            if (!isfinite(solver->w_high[i]))
                solver->w_low[i] = 0.0;
        }
}

perp__evaluation perp__evaluate_product(perp_lcp_solver *solver)
{
    perp__evaluation residuals;

    perp__find_reach(solver);
    solver->doubtful = 0; /* scaled z that is large, but by far not as large as where q is lost */
    for (int32_t k = 0; k < solver->parts; k++)
        solver->doubtful |= !(solver->reach[k] <= 1.0 / sqrt(DBL_EPSILON));
    if (solver->doubtful)
        perp__find_terms(&solver->M, solver->q, solver->z, solver->exponents, solver->omega,
                         solver->witness.terms);
    residuals = measure(solver);
    if (!residuals.finite) {
        sum_overflowed(solver);
        residuals = measure(solver);
    }
    return residuals;
}

perp__evaluation perp__evaluate(perp_lcp_solver *solver)
{
    perp__find_product(solver);
    return perp__evaluate_product(solver);
}

bool perp__is_exact(const perp_lcp_solver *solver, const perp__evaluation *residuals)
{
    return residuals->backward <= PERP__EXACT && residuals->tested <= solver->settings.tol;
}

void perp__read_places(perp_lcp_solver *solver, int8_t *places)
{
    for (int32_t i = 0; i < solver->n; i++)
        places[i] = perp__place(solver->lower[i] == solver->upper[i],
                                perp__z_scaled(solver, i, solver->z[i] - solver->lower[i]),
                                perp__z_scaled(solver, i, solver->z[i] - solver->upper[i]),
                                perp__w_scaled(solver, i, solver->w_high[i]));
}

double perp__margin_of(const perp_lcp_solver *solver, int32_t i)
{
    const double w = perp__w_scaled(solver, i, solver->w_high[i]);
    const double above = perp__z_scaled(solver, i, solver->z[i] - solver->lower[i]);
    const double below = perp__z_scaled(solver, i, solver->upper[i] - solver->z[i]);

    switch (solver->places[i]) {
    case PERP__AT_LOWER:
        return w;
    case PERP__AT_UPPER:
        return -w;
    case PERP__FIXED:
        return INFINITY;
    default:
        return above < below ? above : below;
    }
}

/* ---- what a point is called ---- */

perp__evidence perp__lcp_evidence(perp_lcp_solver *solver, const perp__evaluation *residuals,
                                  double unit)
{
    perp__evidence evidence = {residuals->tested / unit, 0.0, residuals->backward, 0};

    evidence.sound = residuals->finite;
    if (!perp__is_good(perp__gate(&evidence, solver->settings.tol, -1))) {
        evidence.own_residual = INFINITY; /* it does not pass whatever its rows say */
    } else if (!residuals->small) {
        /* beside its own terms a row has no large numbers of others to excuse it */
        const perp__witness_point point = {.M = &solver->M,
                                           .exponents = solver->exponents,
                                           .part = solver->part,
                                           .parts = solver->parts,
                                           .q = solver->q,
                                           .lower = solver->lower,
                                           .upper = solver->upper,
                                           .z = solver->z,
                                           .w = solver->w_high,
                                           .tol = solver->settings.tol};

        evidence.own_residual = perp__witness_own_residual(&solver->witness, &point);
    }
    return evidence;
}

perp_outcome perp__lcp_outcome_of(perp_lcp_solver *solver, const perp__evaluation *residuals,
                                  perp_outcome said)
{
    const perp__evidence evidence = perp__lcp_evidence(solver, residuals, 1.0);

    return perp__gate(&evidence, solver->settings.tol, said);
}
