/* The residuals of docs/lcp.md, recomputed from the caller's own data for every method alike. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/outcome.h"
#include "lcp/solver.h"
#include "linalg/doubled.h"
#include "linalg/scale.h"
#include "linalg/lanes/vectors.h"

/* Scaled z beyond which doubled precision may have lost q. */
#define PERP__DOUBTFUL 0x1p30

/* Larger than any exponent that comes up, and far from the end of int32_t. */
#define LARGE (1 << 20)
#define ROW_KEPT INT32_MIN

/* A finite bound stays finite, however far the scaling pushes it. */
static double scale_bound(const perp_lcp_solver *solver, int32_t i, double bound)
{
    double scaled;

    if (bound == 0.0 || isinf(bound)) /* most bounds */
        return bound;
    scaled = perp__z_scaled(solver, i, bound);
    if (isfinite(bound) && !isfinite(scaled))
        return bound < 0.0 ? -DBL_MAX : DBL_MAX;
    return scaled;
}

/* Powers of two for the exponents and omegas as they are, and the bounds with them. */
static void find_powers(perp_lcp_solver *solver)
{
    solver->powers_known = 1;
    solver->powers_normal = 1;
    for (int32_t i = 0; i < solver->n; i++) {
        const int32_t z = solver->exponents[i] + solver->omega[solver->n + i];
        const int32_t w = solver->exponents[i] - solver->omega[i];

        if (abs(z) > 1022 || abs(w) > 1022) {
            solver->powers_normal = 0;
            break;
        }
        solver->z_down[i] = perp__power_of_two(-z);
        solver->z_up[i] = perp__power_of_two(z);
        solver->w_down[i] = perp__power_of_two(w);
    }
    for (int32_t i = 0; i < solver->n; i++) {
        solver->lower_scaled[i] = scale_bound(solver, i, solver->lower[i]);
        solver->upper_scaled[i] = scale_bound(solver, i, solver->upper[i]);
    }
}

static double relative_violation(const perp_lcp_solver *solver, int32_t i, double violation)
{
    double size = solver->row_norms[i] * perp__reach_of(solver, i) + fabs(solver->q_scaled[i]);

    if (violation == 0.0)
        return 0.0;
    violation /= size; /* +inf where the row has nothing to change */
    return violation >= 0.0 ? violation : INFINITY;
}

void perp__find_reach(perp_lcp_solver *solver)
{
    memset(solver->reach, 0, (size_t)solver->parts * sizeof *solver->reach);
    for (int32_t i = 0; i < solver->n; i++)
        perp__raise_to(&solver->reach[solver->part[solver->n + i]],
                       fabs(perp__z_scaled(solver, i, solver->z[i])));
}

/* Each number for itself: any n, any scaling, any parts, NaN included. */
static void project(perp_lcp_solver *solver)
{
    double largest = 0.0;

    for (int32_t i = 0; i < solver->n; i++) {
        solver->z[i] = perp__clamp(solver->z[i], solver->lower[i], solver->upper[i]);
        perp__raise_to(&largest, fabs(perp__z_scaled(solver, i, solver->z[i])));
    }
    if (solver->parts == 1)
        solver->reach[0] = largest;
    else
        perp__find_reach(solver);
}

/* The scaled residual of row i, at the end of w's interval where it is larger. Doubled precision
 * may leave that much wrong in w: where z is as large as 1e24, far along a null vector of M, it has
 * lost q, and a w of 0 says nothing. */
static double doubted_residual(const perp_lcp_solver *solver, int32_t i, double above, double below,
                               double w)
{
    const double unit = 0.5 * DBL_EPSILON * solver->n;
    const double margin = unit * unit * solver->witness.terms[i];
    double residual;

    if (!(margin < INFINITY) && isfinite(w)) /* it may be anything */
        return fmax(fabs(above), fabs(below));
    if (!(margin < INFINITY))
        return fabs(perp__middle(above, below, w));
    residual = fabs(perp__middle(above, below, w - margin));
    perp__raise_to(&residual, fabs(perp__middle(above, below, w + margin)));
    return residual;
}

static perp__evaluation measure(const perp_lcp_solver *solver)
{
    const double tol = solver->settings.tol;
    perp__evaluation worth = {0.0, 0.0, 0.0, 1, 1};
    double nothing = 0.0; /* NaN once a NaN or an infinity is met */

    for (int32_t i = 0; i < solver->n; i++) {
        const double lower = solver->lower[i], upper = solver->upper[i], z = solver->z[i];
        const double w = solver->w_high[i], violation = perp__row_violation(z, lower, upper, w);
        const double above = perp__z_scaled(solver, i, z - lower);
        const double below = perp__z_scaled(solver, i, z - upper);
        const double scaled = perp__w_scaled(solver, i, w);

        perp__raise_to(&worth.natural, fabs(perp__middle(z - lower, z - upper, w)));
        perp__raise_to(&worth.tested, solver->doubtful
                                          ? doubted_residual(solver, i, above, below, scaled)
                                          : fabs(perp__middle(above, below, scaled)));
        perp__raise_to(&worth.backward,
                       relative_violation(solver, i, perp__w_scaled(solver, i, violation)));
        worth.small &= violation <= tol * fabs(solver->q[i]);
        nothing += 0.0 * z + 0.0 * w;
    }
    worth.finite = nothing == 0.0;
    return worth;
}

/* In vectors, for M of one part and numbers within the range of doubles; false where they turn out
 * not to be. */
typedef struct kernels {
    int32_t least; /* n */
    int32_t (*scale)(perp_lcp_solver *solver);
    int32_t (*project)(perp_lcp_solver *solver, double *z_largest);
    int32_t (*measure)(const perp_lcp_solver *solver, double z_largest, perp__evaluation *worth);
} kernels;

#define TEMPLATE "lcp/evaluate_vector.h"
#include "linalg/lanes/each_set.h"

/* The widest vectors that n fills; NULL where they don't serve. */
static const kernels *kernels_for(const perp_lcp_solver *solver)
{
    static const kernels *const sets[] = {PERP__OF_EACH_SET(&kernels)};
    int32_t k = (int32_t)perp__widest_vectors();

    if (!solver->powers_normal || solver->parts != 1)
        return NULL;
    while (solver->length < sets[k]->least && k > 0)
        k--;
    return sets[k];
}

void perp__scale_problem(perp_lcp_solver *solver, const double *q)
{
    const perp__parts parts = {solver->n, solver->parts, solver->part};
    const kernels *fast = solver->powers_known ? kernels_for(solver) : NULL;

    solver->q = q;
    if (solver->length > solver->n) {
        memcpy(solver->q_own, q, (size_t)solver->n * sizeof *q);
        solver->q = solver->q_own;
    }
    if (fast && fast->scale(solver))
        return; /* in the units of the last q */
    if (perp__find_omegas(&parts, q, solver->exponents, solver->part_omega, solver->omega,
                          solver->powers_known))
        find_powers(solver);
    for (int32_t i = 0; i < solver->n; i++)
        solver->q_scaled[i] = perp__w_scaled(solver, i, q[i]);
}

/* Whether products or partial sums of row i went beyond the range of doubles. */
static int32_t overflowed(const perp_lcp_solver *solver, int32_t i)
{
    return !isfinite(solver->w_high[i]) || !isfinite(solver->w_low[i]);
}

/* row_size[i] := log2 of a power of two near the largest term of row i, where it overflowed; else
 * ROW_KEPT. */
static void find_row_sizes(perp_lcp_solver *solver)
{
    perp__cursor c = perp__first(&solver->M);

    for (int32_t i = 0; i < solver->n; i++) {
        solver->row_size[i] = ROW_KEPT;
        if (overflowed(solver, i))
            solver->row_size[i] = solver->q[i] != 0.0 ? perp__exponent_of(solver->q[i]) : -LARGE;
    }
    while (perp__advance(&c))
        if (solver->row_size[c.i] != ROW_KEPT && solver->z[c.j] != 0.0) {
            const int32_t size = perp__exponent_of(c.value) + perp__exponent_of(solver->z[c.j]);

            if (size > solver->row_size[c.i])
                solver->row_size[c.i] = size;
        }
}

/* Rows that overflowed once more in units where their largest term is near 1, and back. What is
 * infinite then is beyond the range of doubles. */
static void recompute(perp_lcp_solver *solver)
{
    perp__cursor c = perp__first(&solver->M);

    find_row_sizes(solver);
    for (int32_t i = 0; i < solver->n; i++)
        if (solver->row_size[i] != ROW_KEPT) {
            solver->w_high[i] = perp__shift(solver->q[i], -solver->row_size[i]);
            solver->w_low[i] = 0.0;
        }
    while (perp__advance(&c))
        if (solver->row_size[c.i] != ROW_KEPT && solver->z[c.j] != 0.0) {
            const int32_t power = perp__exponent_of(c.value);

            perp__accumulate(&solver->w_high[c.i], &solver->w_low[c.i],
                             perp__shift(c.value, -power),
                             perp__shift(solver->z[c.j], power - solver->row_size[c.i]));
        }
    for (int32_t i = 0; i < solver->n; i++)
        if (solver->row_size[i] != ROW_KEPT) {
            const double sum = solver->w_high[i] + solver->w_low[i];
            const double rest = (solver->w_high[i] - sum) + solver->w_low[i];

            solver->w_high[i] = perp__shift(sum, solver->row_size[i]);
            solver->w_low[i] =
                isfinite(solver->w_high[i]) ? perp__shift(rest, solver->row_size[i]) : 0.0;
        }
}

static void project_any(perp_lcp_solver *solver)
{
    const kernels *fast = kernels_for(solver);

    if (!fast || !fast->project(solver, solver->reach))
        project(solver);
}

void perp__find_product(perp_lcp_solver *solver)
{
    project_any(solver);
    perp__multiply_doubled(&solver->wide, solver->z, solver->q, solver->w_high, solver->w_low);
}

static perp__evaluation measure_point(perp_lcp_solver *solver)
{
    const kernels *fast = kernels_for(solver);
    perp__evaluation worth;

    solver->doubtful = 0;
    for (int32_t k = 0; k < solver->parts; k++)
        solver->doubtful |= !(solver->reach[k] <= PERP__DOUBTFUL);
    if (solver->doubtful)
        perp__find_terms(&solver->M, solver->q, solver->z, solver->exponents, solver->omega,
                         solver->witness.terms);
    if (!fast || solver->doubtful || !fast->measure(solver, solver->reach[0], &worth))
        worth = measure(solver); /* a number needs more care */
    if (!worth.finite) {
        recompute(solver);
        worth = measure(solver);
    }
    return worth;
}

perp__evaluation perp__evaluate(perp_lcp_solver *solver)
{
    perp__find_product(solver);
    return measure_point(solver);
}

perp__evaluation perp__evaluate_product(perp_lcp_solver *solver)
{
    project_any(solver);
    return measure_point(solver);
}

int32_t perp__is_exact(const perp_lcp_solver *solver, const perp__evaluation *worth)
{
    return worth->backward <= 4.0 * DBL_EPSILON && worth->tested <= solver->settings.tol;
}

void perp__read_places(perp_lcp_solver *solver, int8_t *places)
{
    for (int32_t i = 0; i < solver->n; i++) {
        double w = perp__w_scaled(solver, i, solver->w_high[i]);
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

static double own_residual(perp_lcp_solver *solver)
{
    const perp__witness_point point = {.M = &solver->M,
                                       .exponents = solver->exponents,
                                       .balanced = solver->balanced,
                                       .row_norms = solver->row_norms,
                                       .part = solver->part,
                                       .parts = solver->parts,
                                       .scaling = solver->settings.scaling,
                                       .q = solver->q,
                                       .lower = solver->lower,
                                       .upper = solver->upper,
                                       .z = solver->z,
                                       .w = solver->w_high,
                                       .tol = solver->settings.tol};

    return perp__witness_own_residual(&solver->witness, &point);
}

perp__evidence perp__lcp_evidence(perp_lcp_solver *solver, const perp__evaluation *worth,
                                  double unit)
{
    perp__evidence evidence = {worth->tested / unit, INFINITY, worth->backward, 0};

    evidence.sound = worth->finite;
    /* beside its own terms a row has no large numbers of others to excuse it */
    if (perp__may_pass(&evidence, solver->settings.tol))
        evidence.own = worth->small ? 0.0 : own_residual(solver);
    return evidence;
}

perp_outcome perp__lcp_judge(perp_lcp_solver *solver, const perp__evaluation *worth,
                             perp_outcome said)
{
    const perp__evidence evidence = perp__lcp_evidence(solver, worth, 1.0);

    return perp__gate(&evidence, solver->settings.tol, said);
}
