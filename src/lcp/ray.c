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

/* Directions in which z_i can go for ever. */
static int32_t recedes(double lower, double upper, double direction)
{
    if (direction > 0.0)
        return upper == INFINITY;
    if (direction < 0.0)
        return lower == -INFINITY;
    return 1;
}

/* t must not fall along the path's end: it would reach 0. d is positive where z starts at its lower
 * bound, negative where it starts at its upper one. */
static int32_t covering_rises(double lower, double upper, double covering)
{
    if (lower == -INFINITY && upper == INFINITY)
        return 1;
    return lower == -INFINITY ? covering <= 0.0 : covering >= 0.0;
}

/* Along a secondary ray z + s dz, w + s (M dz + covering) the pairs stay complementary: where dz
 * moves the row does not, and where it rests the row moves into its own half-line (Cottle, Pang &
 * Stone 1992, section 4.4). */
static int32_t row_holds(double lower, double upper, double dz, double dw, double slack)
{
    if (lower == upper)
        return 1;
    if (lower == -INFINITY && upper == INFINITY)
        return 1; /* checked by the caller of this function: |dw| <= covering */
    if (dz != 0.0)
        return fabs(dw) <= slack;
    if (upper == INFINITY)
        return dw >= -slack;
    if (lower == -INFINITY)
        return dw <= slack;
    return 1; /* both bounds finite: w may go either way */
}

int32_t perp__ray_verify(perp_lcp_solver *solver)
{
    double largest = 0.0;

    for (int32_t i = 0; i < solver->n; i++) {
        if (!isfinite(solver->ray[i]) || !isfinite(solver->covering[i]) ||
            !recedes(solver->lower[i], solver->upper[i], solver->ray[i]) ||
            !covering_rises(solver->lower[i], solver->upper[i], solver->covering[i]))
            return 0;
        largest = fmax(largest, fabs(solver->ray[i]));
    }
    if (largest == 0.0)
        return 0;
    for (int32_t i = 0; i < solver->n; i++) {
        solver->ray[i] /= largest;
        solver->covering[i] /= largest;
        /* omega plays no part in a direction: only D does */
        solver->z[i] = perp__shift(solver->ray[i], solver->exponents[i]);
    }
    perp__multiply_doubled(&solver->M, solver->z, NULL, solver->w_high, solver->w_low);
    for (int32_t i = 0; i < solver->n; i++) {
        double slack = PERP__RAY_TOLERANCE * (solver->row_norms[i] + fabs(solver->covering[i]));
        double Mdz = perp__shift(solver->w_high[i], solver->exponents[i]);
        double dw = Mdz + solver->covering[i];

        if (!row_holds(solver->lower[i], solver->upper[i], solver->ray[i], dw, slack))
            return 0;
        if (solver->lower[i] == -INFINITY && solver->upper[i] == INFINITY &&
            fabs(Mdz) > fabs(solver->covering[i]) + slack)
            return 0;
    }
    return 1;
}

/* Products below this have lost digits to underflow: nothing is proved by them. */
#define PERP__LEAST_PRODUCT 0x1p-960

/* sum_i y_i S_ij and the sum of the terms' sizes, for one column of the scaled M; NaN where a term
 * is beyond the range of doubles. */
static void column_product(const perp_lcp_solver *solver, const double *y, int32_t j, double *sum,
                           double *size)
{
    const perp__matrix *M = &solver->M;
    double high = 0.0, low = 0.0, total = 0.0;
    int32_t count = M->column_starts ? M->column_starts[j + 1] - M->column_starts[j] : M->rows;

    for (int32_t k = 0; k < count; k++) {
        int32_t at = M->column_starts ? M->column_starts[j] + k : 0;
        int32_t i = M->column_starts ? M->row_indices[at] : k;
        double value = M->column_starts
                           ? M->values[at]
                           : M->values[(size_t)i * M->row_stride + (size_t)j * M->column_stride];
        double entry = perp__shift(value, solver->exponents[i] + solver->exponents[j]);
        double share = fabs(entry * y[i]);

        perp__accumulate(&high, &low, entry, y[i]);
        if (value != 0.0 && y[i] != 0.0 && !(share >= PERP__LEAST_PRODUCT))
            share = low = NAN;
        total += share;
    }
    *sum = high + low;
    *size = total;
}

/* Farkas: y >= 0 with M'y <= 0 and y'(q + M l) < 0 leaves no z >= l with M z + q >= 0, whatever the
 * class of M. y is in solver->z; all in the scaled problem's units, with one omega for all parts.
 * Sizes count what is lost to rounding, `lost` what is lost below the least normal number. */
static int32_t proves_infeasible(perp_lcp_solver *solver)
{
    const double rounding = 2.0 * (double)solver->n * DBL_EPSILON;
    double *y = solver->witness.around, total = 0.0, size = 0.0, lost = 0.0;
    int32_t omega = INT32_MIN, i;

    for (i = 0; i < solver->n; i++) {
        y[i] = perp__shift(solver->z[i], -solver->exponents[i]);
        omega = solver->omega[i] > omega ? solver->omega[i] : omega;
    }
    for (i = 0; i < solver->n; i++) {
        const double q = perp__shift(solver->q[i], solver->exponents[i] - omega);

        total += q * y[i];
        size += fabs(q * y[i]);
        lost += DBL_MIN * (1.0 + y[i]);
    }
    for (i = 0; i < solver->n; i++) {
        const double lower = perp__shift(solver->lower[i], -solver->exponents[i] - omega);
        double sum, terms;

        column_product(solver, y, i, &sum, &terms);
        /* doubled precision leaves (n eps)^2 of the terms; anything above that is a true sign */
        if (!(sum <= (double)solver->n * DBL_EPSILON * DBL_EPSILON * terms))
            return 0;
        total += sum * lower;
        size += (fabs(sum) + rounding * terms) * fabs(lower);
        lost += DBL_MIN * (1.0 + terms);
    }
    return total < -(rounding * size + lost);
}

/* x rounded to 24 bits. */
static double shortened(double x)
{
    int exponent;
    const double mantissa = frexp(x, &exponent);

    return ldexp(floor(ldexp(mantissa, 24) + 0.5), exponent - 24);
}

/* solver->z := `times` the ray over its least entry, if these are numbers of few bits but for
 * rounding; entries that are rounding themselves become 0. */
static int32_t make_short(perp_lcp_solver *solver, int32_t times, double least)
{
    for (int32_t i = 0; i < solver->n; i++) {
        const double y = perp__shift(solver->ray[i], solver->exponents[i]);
        const double wanted = solver->ray[i] <= PERP__RAY_TOLERANCE ? 0.0 : times * (y / least);

        solver->z[i] = shortened(wanted);
        if (!(fabs(wanted - solver->z[i]) <= PERP__RAY_TOLERANCE * wanted))
            return 0;
    }
    return 1;
}

/* For copositive-plus M every secondary ray is such a y in exact arithmetic (CPS 1992, theorem
 * 4.4.11). Where M is positive semidefinite y must even be a null vector of M + M' exactly, and the
 * least rounding of y spoils the proof. Data of whole numbers, and powers of two times these, have
 * null vectors of that kind: odd multiples of the ray are tried. What rounding of general data
 * leaves of a null vector is none: the problem as it stands may have a solution, however large, and
 * no proof is possible. */
int32_t perp__ray_certificate(perp_lcp_solver *solver)
{
    double least = INFINITY;

    for (int32_t i = 0; i < solver->n; i++) {
        if (solver->lower[i] == -INFINITY || solver->upper[i] != INFINITY)
            return 0;
    }
    /* y in the caller's units is D ray, which perp__ray_verify left in z */
    if (proves_infeasible(solver))
        return 1;
    for (int32_t i = 0; i < solver->n; i++)
        if (solver->ray[i] > PERP__RAY_TOLERANCE)
            least = fmin(least, solver->z[i]);
    for (int32_t times = 1; times <= PERP__LARGEST_MULTIPLE; times += 2)
        if (make_short(solver, times, least) && proves_infeasible(solver))
            return 1;
    for (int32_t i = 0; i < solver->n; i++)
        solver->z[i] = perp__shift(solver->ray[i], solver->exponents[i]);
    return 0;
}
