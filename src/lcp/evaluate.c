/* The residuals of DESIGN.md, recomputed from the caller's own data for every method alike. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "lcp/solver.h"
#include "linalg/scale.h"
#include "linalg/vectors.h"

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

/* Powers of two for the exponents and omega as they are, and the bounds with them. */
static void find_powers(perp_lcp_solver *solver)
{
    int32_t i;

    solver->powers_known = 1;
    solver->powers_normal = 1;
    for (i = 0; i < solver->n; i++) {
        const int32_t z = solver->exponents[i] + solver->omega;
        const int32_t w = solver->exponents[i] - solver->omega;

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

/* omega is the power of two with max |D q| in [omega, 2 omega); 1 where q = 0 */
static int32_t find_omega(const perp_lcp_solver *solver, const double *q)
{
    int32_t largest = 0, found = 0, i;

    for (i = 0; i < solver->n; i++) {
        int32_t exponent;

        if (q[i] == 0.0)
            continue;
        exponent = exponent_of(q[i]) + solver->exponents[i];
        if (!found || exponent > largest)
            largest = exponent;
        found = 1;
    }
    return largest;
}

void perp__scale_problem(perp_lcp_solver *solver, const double *q)
{
    const int32_t omega = find_omega(solver, q);
    int32_t i;

    solver->q = q;
    if (!solver->powers_known || omega != solver->omega) {
        solver->omega = omega;
        find_powers(solver);
    }
    for (i = 0; i < solver->n; i++)
        solver->q_scaled[i] = perp__w_scaled(solver, i, q[i]);
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

/* perp__mid with the differences from the bounds in hand */
static double middle(double above, double below, double w)
{
    const double least = above < w ? above : w;

    return below > least ? below : least;
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

    violation = perp__w_scaled(solver, i, violation);
    if (violation == 0.0)
        return 0.0;
    violation /= size; /* +inf where the row has nothing to change */
    return violation >= 0.0 ? violation : INFINITY;
}

/* Each number for itself: any n, any scaling, NaN included. */
static double project(perp_lcp_solver *solver)
{
    double z_largest = 0.0;
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        double size;

        solver->z[i] = perp__clamp(solver->z[i], solver->lower[i], solver->upper[i]);
        size = fabs(perp__z_scaled(solver, i, solver->z[i]));
        if (!(size <= z_largest))
            z_largest = size;
    }
    return z_largest;
}

static perp__evaluation measure(const perp_lcp_solver *solver, double z_largest)
{
    perp__evaluation worth = {0.0, 0.0, 0.0};
    int32_t i;

    for (i = 0; i < solver->n; i++) {
        double above = solver->z[i] - solver->lower[i];
        double below = solver->z[i] - solver->upper[i];
        double w = solver->w_high[i];

        raise_to(&worth.natural, fabs(middle(above, below, w)));
        raise_to(&worth.tested,
                 fabs(middle(perp__z_scaled(solver, i, above), perp__z_scaled(solver, i, below),
                             perp__w_scaled(solver, i, w))));
        raise_to(&worth.backward, relative_violation(solver, i, z_largest));
    }
    return worth;
}

#if PERP__X86
#define NAME(x) x##_avx512
#include "linalg/vector_avx512.h"
#include "lcp/evaluate_vector.h"
#include "linalg/vector_end.h"

#define NAME(x) x##_avx2
#include "linalg/vector_avx2.h"
#include "lcp/evaluate_vector.h"
#include "linalg/vector_end.h"
#endif

/* In vectors where they serve and no number is beyond the range of doubles. */
static double project_all(perp_lcp_solver *solver)
{
#if PERP__X86
    const enum perp__vector_set set = perp__widest_vectors();
    double z_largest;

    if (solver->powers_normal &&
        ((set == PERP__VECTOR_AVX512 && solver->n >= 8 && project_avx512(solver, &z_largest)) ||
         (set >= PERP__VECTOR_AVX2 && solver->n >= 4 && project_avx2(solver, &z_largest))))
        return z_largest;
#endif
    return project(solver);
}

static perp__evaluation measure_all(const perp_lcp_solver *solver, double z_largest)
{
#if PERP__X86
    const enum perp__vector_set set = perp__widest_vectors();
    perp__evaluation worth;

    if (solver->powers_normal &&
        ((set == PERP__VECTOR_AVX512 && solver->n >= 8 &&
          measure_avx512(solver, z_largest, &worth)) ||
         (set >= PERP__VECTOR_AVX2 && solver->n >= 4 && measure_avx2(solver, z_largest, &worth))))
        return worth;
#endif
    return measure(solver, z_largest);
}

/* What doubled precision may leave wrong in w: where z is as large as 1e24, far along a null vector
 * of M, it has lost q, and a w of 0 says nothing. */
static double doubt(const perp_lcp_solver *solver, double z_largest)
{
    const double unit = 0.5 * DBL_EPSILON * solver->n;
    double largest = 0.0;
    int32_t i;

    if (z_largest <= 0x1p30)
        return 0.0;
    for (i = 0; i < solver->n; i++)
        largest = fmax(largest, solver->row_norms[i]);
    return unit * unit * largest * z_largest;
}

perp__evaluation perp__evaluate(perp_lcp_solver *solver)
{
    const double z_largest = project_all(solver);
    perp__evaluation worth;
    double least;

    perp__multiply_doubled(&solver->M, solver->z, solver->q, solver->w_high, solver->w_low);
    worth = measure_all(solver, z_largest);
    least = doubt(solver, z_largest);
    if (worth.tested < least)
        worth.tested = least;
    return worth;
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
