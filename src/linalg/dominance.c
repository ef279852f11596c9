/* Verified bounds for sparse H-matrices, see verified.h. */
#include <math.h>
#include <string.h>

#include "linalg/verified.h"

void perp__dominance_layout(perp__arena *arena, perp__dominance *d, int32_t n, int32_t entries)
{
    d->n = n;
    d->comparison = perp__arena_take(arena, (size_t)entries, sizeof(double));
    PERP__DOUBLES(arena, (size_t)n, &d->v, &d->positive);
}

static void compare(perp__dominance *d)
{
    const perp__square *A = &d->A;

    d->is_z_matrix = 1;
    for (int32_t j = 0; j < A->n; j++)
        for (int32_t k = A->column_starts[j]; k < A->column_starts[j + 1]; k++) {
            const double size = fabs(A->values[k]);

            d->comparison[k] = A->row_indices[k] == j ? size : -size;
            d->is_z_matrix &= d->comparison[k] == A->values[k];
        }
}

perp_status perp__dominance_factor(perp__dominance *d, perp_context *context)
{
    perp__square C = d->A;
    perp_status status;

    compare(d);
    C.values = d->comparison;
    status = perp__kept_factor_analyse(&d->kept, context, &perp__factor_klu, &d->A);
    if (status == PERP_OK)
        status = perp__factor_klu.factor(d->kept.factor, &d->A, 0);
    if (status == PERP_OK && !d->is_z_matrix) {
        status = perp__kept_factor_analyse(&d->kept_comparison, context, &perp__factor_klu, &C);
        if (status == PERP_OK)
            status = perp__factor_klu.factor(d->kept_comparison.factor, &C, 0);
    }
    return status;
}

void perp__dominance_apply(perp__dominance *d, double *x)
{
    perp__factor_klu.solve(d->kept.factor, x, 0);
}

/* positive := a lower bound of C v, all rounding and underflow counted. True if it is positive, and
 * v too. */
static int32_t is_positive(perp__dominance *d)
{
    const perp__square *A = &d->A;
    const double rounding = PERP__GAMMA(d->n + 4.0), underflow = DBL_MIN * (8.0 * d->n + 8.0);

    memset(d->positive, 0, (size_t)d->n * sizeof *d->positive);
    for (int32_t j = 0; j < d->n; j++) {
        if (!(d->v[j] >= DBL_MIN))
            return 0;
        for (int32_t k = A->column_starts[j]; k < A->column_starts[j + 1]; k++) {
            const double product = d->comparison[k] * d->v[j];

            /* its part of the sum's error, and of this subtraction's */
            d->positive[A->row_indices[k]] +=
                product - (4.0 * rounding * fabs(product) + DBL_MIN * (d->v[j] + 1.0));
        }
    }
    for (int32_t i = 0; i < d->n; i++) {
        d->positive[i] -= underflow;
        if (!(d->positive[i] > 0.0))
            return 0;
    }
    return 1;
}

int32_t perp__dominance_bound(perp__dominance *d, const double *middle, const double *width,
                              double *delta)
{
    double largest = 0.0, factor = 0.0;

    for (int32_t i = 0; i < d->n; i++) {
        delta[i] = perp__raise(fabs(middle[i]) + width[i] + DBL_MIN, 2.0);
        largest = perp__larger(largest, delta[i]);
    }
    /* v near C^-1 |r| makes the bound sharp in every component; the floor keeps it positive */
    for (int32_t i = 0; i < d->n; i++)
        d->v[i] = fmax(delta[i], 1e-3 * largest);
    perp__factor_klu.solve(d->is_z_matrix ? d->kept.factor : d->kept_comparison.factor, d->v, 0);
    if (!is_positive(d))
        return 0;
    for (int32_t i = 0; i < d->n; i++)
        factor = perp__larger(factor, delta[i] / d->positive[i]);
    factor = perp__raise(factor + DBL_MIN, 4.0);
    for (int32_t i = 0; i < d->n; i++)
        delta[i] = perp__raise(factor * d->v[i] + DBL_MIN, 4.0);
    return 1;
}

void perp__dominance_release(perp__dominance *d)
{
    perp__kept_factor_release(&d->kept);
    perp__kept_factor_release(&d->kept_comparison);
}
