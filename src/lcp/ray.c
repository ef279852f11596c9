/* A ray is believed only after it has been checked against the caller's matrix. */
#include <float.h>
#include <math.h>

#include "lcp/solver.h"
#include "linalg/doubled.h"
#include "linalg/scale.h"

/* Rounding that a ray computed by pivoting may carry, relative to |M||ray| of the row. */
#define PERP__RAY_TOLERANCE 1e-9

/* A ray over its least entry may have to be taken so many times to have entries of few bits. */
#define PERP__LARGEST_MULTIPLE 63

/* Along a secondary ray z + s dz, w + s (M dz + covering) the pairs stay complementary: where dz
 * moves the row does not, and where it rests the row moves into its own half-line (Cottle, Pang &
 * Stone 1992, section 4.4). */
static bool row_holds(double lower, double upper, double dz, double dw, double slack)
{
    if (lower == upper)
        return 1;
    if (dz != 0.0)
        return fabs(dw) <= slack;
    if (upper == INFINITY)
        return dw >= -slack;
    if (lower == -INFINITY)
        return dw <= slack;
    return 1; /* both bounds finite: w may go either way */
}

bool perp__ray_verify(perp_lcp_solver *solver)
{
    double largest = 0.0;

    /* 1. z_i can go that way for ever, and t does not fall along the path's end: it would reach 0.
     * The cover is positive where z starts at its lower bound, negative at its upper one. */
    for (int32_t i = 0; i < solver->n; i++) {
        const double ray = solver->ray[i], covering = solver->covering[i];
        const bool no_lower = solver->lower[i] == -INFINITY;
        const bool no_upper = solver->upper[i] == INFINITY;

        if (!isfinite(ray) || !isfinite(covering) || (ray > 0.0 && !no_upper) ||
            (ray < 0.0 && !no_lower) || (covering < 0.0 && !no_lower) ||
            (covering > 0.0 && no_lower && !no_upper))
            return 0;
        largest = fmax(largest, fabs(ray));
    }
    if (largest == 0.0)
        return 0;
    for (int32_t i = 0; i < solver->n; i++) {
        solver->ray[i] /= largest;
        solver->covering[i] /= largest;
        /* omega plays no part in a direction: only D does */
        solver->z[i] = perp__shift(solver->ray[i], solver->exponents[i]);
    }
    /* 2. The rows. */
    perp__multiply_doubled(&solver->M, solver->z, NULL, solver->w_high, solver->w_low);
    for (int32_t i = 0; i < solver->n; i++) {
        const double covering = solver->covering[i];
        const double slack = PERP__RAY_TOLERANCE * (solver->row_norms[i] + fabs(covering));
        const double Mdz = perp__shift(solver->w_high[i], solver->exponents[i]);

        if (solver->lower[i] == -INFINITY && solver->upper[i] == INFINITY) {
            if (fabs(Mdz) > fabs(covering) + slack)
                return 0;
        } else if (!row_holds(solver->lower[i], solver->upper[i], solver->ray[i], Mdz + covering,
                              slack)) {
            return 0;
        }
    }
    return 1;
}

/* Farkas: y >= 0 with M'y <= 0 and y'(q + M l) < 0 leaves no z >= l with M z + q >= 0, whatever the
 * class of M; of a free z_j, whose row is an equation, y_j has any sign and (M'y)_j = 0. y is in
 * solver->z; all in the scaled problem's units, with one omega for all parts. Sizes count what is
 * lost to rounding, `lost` what is lost below the least normal number. */
static bool proves_infeasible(perp_lcp_solver *solver)
{
    const double rounding = 2.0 * (double)solver->n * DBL_EPSILON;
    const perp__matrix *M = &solver->M;
    double *y = solver->witness.around, total = 0.0, size = 0.0, lost = 0.0;
    int32_t omega = INT32_MIN, i, j;

    for (i = 0; i < solver->n; i++) {
        y[i] = perp__shift(solver->z[i], -solver->exponents[i]);
        omega = solver->omega[i] > omega ? solver->omega[i] : omega;
    }
    for (i = 0; i < solver->n; i++) {
        const double q = perp__shift(solver->q[i], solver->exponents[i] - omega);

        total += q * y[i];
        size += fabs(q * y[i]);
        lost += DBL_MIN * (1.0 + fabs(y[i]));
    }
    for (j = 0; j < solver->n; j++) {
        const bool is_free = solver->lower[j] == -INFINITY;
        const double lower =
            is_free ? 0.0 : perp__shift(solver->lower[j], -solver->exponents[j] - omega);
        const int32_t count =
            M->column_starts ? M->column_starts[j + 1] - M->column_starts[j] : M->rows;
        double high = 0.0, low = 0.0, terms = 0.0, sum;

        /* sum := sum_i y_i S_ij, terms := that of their sizes; NaN where one is beyond the range
         * of doubles */
        for (int32_t k = 0; k < count; k++) {
            const int32_t at = M->column_starts ? M->column_starts[j] + k : 0;
            double value, entry, share;

            i = M->column_starts ? M->row_indices[at] : k;
            if (y[i] == 0.0)
                continue;
            value = M->column_starts ? M->values[at] : perp__entry(M, k, j);
            entry = perp__shift(value, solver->exponents[i] + solver->exponents[j]);
            share = fabs(entry * y[i]);
            perp__accumulate(&high, &low, entry, y[i]);
            if (value != 0.0 && !(share >= PERP__LEAST_PRODUCT))
                share = low = NAN;
            terms += share;
        }
        sum = high + low;
        /* doubled precision leaves (n eps)^2 of the terms; anything above that is a true sign */
        if (!((is_free ? fabs(sum) : sum) <= (double)solver->n * DBL_EPSILON * DBL_EPSILON * terms))
            return 0;
        total += sum * lower;
        size += (fabs(sum) + rounding * terms) * fabs(lower);
        lost += DBL_MIN * (1.0 + terms);
    }
    return total < -(rounding * size + lost);
}

bool perp__ray_certificate(perp_lcp_solver *solver)
{
    double least = INFINITY;

    for (int32_t i = 0; i < solver->n; i++)
        if (solver->upper[i] != INFINITY)
            return 0;
    /* y in the caller's units is D ray, which perp__ray_verify left in z */
    if (proves_infeasible(solver))
        return 1;
    for (int32_t i = 0; i < solver->n; i++)
        if (fabs(solver->ray[i]) > PERP__RAY_TOLERANCE)
            least = fmin(least, fabs(solver->z[i]));
    for (int32_t times = 1; times <= PERP__LARGEST_MULTIPLE; times += 2) {
        bool is_short = 1;

        /* `times` y over its least entry, if these are numbers of 24 bits but for rounding; entries
         * that are rounding themselves become 0 */
        for (int32_t i = 0; i < solver->n && is_short; i++) {
            const double y = perp__shift(solver->ray[i], solver->exponents[i]);
            const double wanted =
                fabs(solver->ray[i]) <= PERP__RAY_TOLERANCE ? 0.0 : times * (y / least);
            int exponent;
            const double mantissa = frexp(wanted, &exponent);

            solver->z[i] = ldexp(floor(ldexp(mantissa, 24) + 0.5), exponent - 24);
            is_short = fabs(wanted - solver->z[i]) <= PERP__RAY_TOLERANCE * fabs(wanted);
        }
        if (is_short && proves_infeasible(solver))
            return 1;
    }
    for (int32_t i = 0; i < solver->n; i++)
        solver->z[i] = perp__shift(solver->ray[i], solver->exponents[i]);
    return 0;
}
