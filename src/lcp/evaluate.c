/* The residuals of docs/lcp.md, recomputed from the caller's own data for every method alike. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/outcome.h"
#include "lcp/solver.h"
#include "linalg/lines.h"
#include "linalg/scale.h"
#include "linalg/lanes/vectors.h"

/* Scaled z beyond which doubled precision may have lost q. */
#define PERP__DOUBTFUL 0x1p30

/* Larger than any exponent that comes up, and far from the end of int32_t. */
#define LARGE (1 << 20)
#define ROW_KEPT INT32_MIN

double perp__shift(double x, int32_t e)
{
    return e >= -1022 && e <= 1022 ? x * perp__power_of_two(e) : ldexp(x, e);
}

/* A finite bound stays finite, however far the scaling pushes it. */
static double scale_bound(const perp_lcp_solver *solver, int32_t i, double bound)
{
    double scaled = perp__z_scaled(solver, i, bound);

    if (isfinite(bound) && !isfinite(scaled))
        return bound < 0.0 ? -DBL_MAX : DBL_MAX;
    return scaled;
}

/* Powers of two for the exponents and omegas as they are, and the bounds with them. */
static void find_powers(perp_lcp_solver *solver)
{
    int32_t i;

    solver->powers_known = 1;
    solver->powers_normal = 1;
    for (i = 0; i < solver->n; i++) {
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
    for (i = 0; i < solver->n; i++) {
        solver->lower_scaled[i] = scale_bound(solver, i, solver->lower[i]);
        solver->upper_scaled[i] = scale_bound(solver, i, solver->upper[i]);
    }
}

/* floor(log2 |x|) for x other than 0 */
static int32_t exponent_of(double x)
{
    uint64_t bits;

    memcpy(&bits, &x, sizeof bits);
    bits = bits >> 52 & 0x7ff;
    return bits != 0 ? (int32_t)bits - 1023 : ilogb(x);
}

static int32_t find_omega(const perp_lcp_solver *solver, const int32_t *exponents)
{
    int32_t largest = INT32_MIN, i;

    for (i = 0; i < solver->n; i++) {
        int32_t exponent;

        if (solver->q[i] == 0.0)
            continue;
        exponent = exponent_of(solver->q[i]) + exponents[i];
        if (exponent > largest)
            largest = exponent;
    }
    return largest == INT32_MIN ? 0 : largest;
}

int32_t perp__find_omegas(perp_lcp_solver *solver, const int32_t *exponents, int32_t *omegas,
                          int32_t known)
{
    const double *q = solver->q;
    int32_t *largest = solver->part_omega;
    int32_t changed = !known, i;

    if (solver->parts == 1) {
        const int32_t omega = find_omega(solver, exponents);

        changed = !known || omegas[0] != omega;
        for (i = 0; i < 2 * solver->n && changed; i++)
            omegas[i] = omega;
        return changed;
    }
    for (i = 0; i < solver->parts; i++)
        largest[i] = INT32_MIN;
    for (i = 0; i < solver->n; i++) {
        const int32_t exponent = q[i] == 0.0 ? INT32_MIN : exponent_of(q[i]) + exponents[i];

        if (exponent > largest[solver->part[i]])
            largest[solver->part[i]] = exponent;
    }
    for (i = 0; i < 2 * solver->n; i++) {
        const int32_t found = largest[solver->part[i]], omega = found == INT32_MIN ? 0 : found;

        changed |= omegas[i] != omega;
        omegas[i] = omega;
    }
    return changed;
}

void perp__scale_problem(perp_lcp_solver *solver, const double *q)
{
    int32_t i;

    solver->q = q;
    if (perp__find_omegas(solver, solver->exponents, solver->omega, solver->powers_known))
        find_powers(solver);
    for (i = 0; i < solver->n; i++)
        solver->q_scaled[i] = perp__w_scaled(solver, i, q[i]);
}

/* perp__mid with the differences from the bounds in hand */
static double middle(double above, double below, double w)
{
    const double least = above < w ? above : w;

    return below > least ? below : least;
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
    int32_t i;

    memset(solver->reach, 0, (size_t)solver->parts * sizeof *solver->reach);
    for (i = 0; i < solver->n; i++)
        perp__raise_to(&solver->reach[solver->part[solver->n + i]],
                       fabs(perp__z_scaled(solver, i, solver->z[i])));
}

/* Each number for itself: any n, any scaling, any parts, NaN included. */
static void project(perp_lcp_solver *solver)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        solver->z[i] = perp__clamp(solver->z[i], solver->lower[i], solver->upper[i]);
        perp__raise_to(&largest, fabs(perp__z_scaled(solver, i, solver->z[i])));
    }
    if (solver->parts == 1)
        solver->reach[0] = largest;
    else
        perp__find_reach(solver);
}

/* What doubled precision may leave wrong in w: where z is as large as 1e24, far along a null vector
 * of M, it has lost q, and a w of 0 says nothing. */
static double doubt(const perp_lcp_solver *solver, int32_t i)
{
    const double unit = 0.5 * DBL_EPSILON * solver->n;

    return solver->doubtful ? unit * unit * solver->witness.terms[i] : 0.0;
}

/* The scaled residual of row i, at the end of w's interval where it is larger. */
static double tested_residual(const perp_lcp_solver *solver, int32_t i, double above, double below)
{
    const double w = perp__w_scaled(solver, i, solver->w_high[i]), margin = doubt(solver, i);
    double residual;

    above = perp__z_scaled(solver, i, above);
    below = perp__z_scaled(solver, i, below);
    if (!(margin < INFINITY) && isfinite(w)) /* it may be anything */
        return fmax(fabs(above), fabs(below));
    if (!(margin < INFINITY))
        return fabs(middle(above, below, w));
    residual = fabs(middle(above, below, w - margin));
    if (margin != 0.0)
        perp__raise_to(&residual, fabs(middle(above, below, w + margin)));
    return residual;
}

static perp__evaluation measure(const perp_lcp_solver *solver)
{
    perp__evaluation worth = {0.0, 0.0, 0.0};
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        double above = solver->z[i] - solver->lower[i];
        double below = solver->z[i] - solver->upper[i];
        double w = solver->w_high[i], violation;

        perp__raise_to(&worth.natural, fabs(middle(above, below, w)));
        perp__raise_to(&worth.tested, tested_residual(solver, i, above, below));
        violation = perp__w_scaled(
            solver, i, perp__row_violation(solver->z[i], solver->lower[i], solver->upper[i], w));
        perp__raise_to(&worth.backward, relative_violation(solver, i, violation));
    }
    return worth;
}

#if PERP__X86
#define NAME(x) x##_avx512
#include "linalg/lanes/vector_avx512.h"
#include "lcp/evaluate_vector.h"
#include "linalg/lanes/vector_end.h"

#define NAME(x) x##_avx2
#include "linalg/lanes/vector_avx2.h"
#include "lcp/evaluate_vector.h"
#include "linalg/lanes/vector_end.h"
#endif

/* In vectors where they serve: M is one part and no number is beyond the range of doubles. */
static void project_all(perp_lcp_solver *solver)
{
#if PERP__X86
    const enum perp__vector_set set = perp__widest_vectors();

    if (solver->powers_normal && solver->parts == 1 &&
        ((set == PERP__VECTOR_AVX512 && solver->n >= 8 && project_avx512(solver, solver->reach)) ||
         (set >= PERP__VECTOR_AVX2 && solver->n >= 4 && project_avx2(solver, solver->reach))))
        return;
#endif
    project(solver);
}

static perp__evaluation measure_all(const perp_lcp_solver *solver)
{
#if PERP__X86
    const enum perp__vector_set set = perp__widest_vectors();
    perp__evaluation worth;

    if (solver->powers_normal && solver->parts == 1 && !solver->doubtful &&
        ((set == PERP__VECTOR_AVX512 && solver->n >= 8 &&
          measure_avx512(solver, solver->reach[0], &worth)) ||
         (set >= PERP__VECTOR_AVX2 && solver->n >= 4 &&
          measure_avx2(solver, solver->reach[0], &worth))))
        return worth;
#endif
    return measure(solver);
}

/* high + low += a b */
static void accumulate(double a, double b, double *high, double *low)
{
    const double product = a * b, sum = *high + product, back = sum - *high;

    *low += fma(a, b, -product) + ((*high - (sum - back)) + (product - back));
    *high = sum;
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
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        solver->row_size[i] = ROW_KEPT;
        if (overflowed(solver, i))
            solver->row_size[i] = solver->q[i] != 0.0 ? exponent_of(solver->q[i]) : -LARGE;
    }
    while (perp__advance(&c))
        if (solver->row_size[c.i] != ROW_KEPT && solver->z[c.j] != 0.0) {
            const int32_t size = exponent_of(c.value) + exponent_of(solver->z[c.j]);

            if (size > solver->row_size[c.i])
                solver->row_size[c.i] = size;
        }
}

/* Rows that overflowed once more in units where their largest term is near 1, and back. What is
 * infinite then is beyond the range of doubles. */
static void recompute(perp_lcp_solver *solver)
{
    perp__cursor c = perp__first(&solver->M);
    int32_t i;

    find_row_sizes(solver);
    for (i = 0; i < solver->n; i++)
        if (solver->row_size[i] != ROW_KEPT) {
            solver->w_high[i] = perp__shift(solver->q[i], -solver->row_size[i]);
            solver->w_low[i] = 0.0;
        }
    while (perp__advance(&c))
        if (solver->row_size[c.i] != ROW_KEPT && solver->z[c.j] != 0.0) {
            const int32_t power = exponent_of(c.value);

            accumulate(perp__shift(c.value, -power),
                       perp__shift(solver->z[c.j], power - solver->row_size[c.i]),
                       &solver->w_high[c.i], &solver->w_low[c.i]);
        }
    for (i = 0; i < solver->n; i++)
        if (solver->row_size[i] != ROW_KEPT) {
            const double sum = solver->w_high[i] + solver->w_low[i];
            const double rest = (solver->w_high[i] - sum) + solver->w_low[i];

            solver->w_high[i] = perp__shift(sum, solver->row_size[i]);
            solver->w_low[i] =
                isfinite(solver->w_high[i]) ? perp__shift(rest, solver->row_size[i]) : 0.0;
        }
}

perp__evaluation perp__evaluate(perp_lcp_solver *solver)
{
    int32_t k;

    project_all(solver);
    perp__multiply_doubled(&solver->M, solver->z, solver->q, solver->w_high, solver->w_low);
    if (!perp__all_finite(solver->w_high, (size_t)solver->n))
        recompute(solver);
    solver->doubtful = 0;
    for (k = 0; k < solver->parts; k++)
        solver->doubtful |= !(solver->reach[k] <= PERP__DOUBTFUL);
    if (solver->doubtful)
        perp__find_terms(solver, solver->exponents, solver->omega);
    return measure_all(solver);
}

int32_t perp__is_exact(const perp_lcp_solver *solver, const perp__evaluation *worth)
{
    return worth->backward <= 4.0 * DBL_EPSILON && worth->tested <= solver->settings.tol;
}

void perp__read_places(perp_lcp_solver *solver, int8_t *places)
{
    int32_t i;

    for (i = 0; i < solver->n; i++) {
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
