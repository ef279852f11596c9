#include "linalg/verified.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/blas.h"

/* Up to this size a product R A that working precision can't tell from I is formed again in doubled
 * precision: n^3 of its multiplications cost what ten times as many of the others do. */
#define PERP__LARGEST_DOUBLED 256

double perp__raise(double x, double operations)
{
    /* x / (1 - gamma) and the rounding of this very product */
    return x * (1.0 + PERP__GAMMA(operations + 4.0));
}

double perp__larger(double a, double b)
{
    return b > a || isnan(b) ? b : a;
}

bool perp__is_same(double a, double b)
{
    uint64_t bits_a, bits_b;

    memcpy(&bits_a, &a, sizeof a);
    memcpy(&bits_b, &b, sizeof b);
    return bits_a == bits_b || (bits_a << 1 == 0 && bits_b << 1 == 0);
}

double perp__doubled_error(int32_t columns)
{
    /* The parts that are summed beside the running sum are at most gamma_n |M||x| together, and
     * that sum has a relative error of gamma_2n (Ogita, Rump & Oishi, proposition 5.5); the lanes
     * of the row-wise product add less than 100 operations. */
    const double gamma = PERP__GAMMA(2.0 * columns + 100.0);

    return gamma * gamma;
}

void perp__multiply_absolute(const perp__matrix *M, const double *x, double *y)
{
    for (int32_t i = 0; i < M->rows; i++)
        y[i] = 0.0;
    for (int32_t j = 0; j < M->columns; j++) {
        const double size = fabs(x[j]);
        const double *column = M->values + (size_t)j * M->column_stride;

        if (size == 0.0)
            continue;
        if (M->column_starts)
            for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
                y[M->row_indices[k]] += fabs(M->values[k]) * size;
        else
            for (int32_t i = 0; i < M->rows; i++)
                y[i] += fabs(column[(size_t)i * M->row_stride]) * size;
    }
}

void perp__verified_layout(perp__arena *arena, perp__verified *v, int32_t n)
{
    const size_t count = (size_t)n;
    const size_t square = count == 0 || count <= SIZE_MAX / count ? count * count : SIZE_MAX;

    v->n = n;
    PERP__DOUBLES(arena, square, &v->transposed, &v->inverse, &v->defect);
    PERP__DOUBLES(arena, count, &v->row_sums, &v->alpha);
    v->work = perp__arena_take(arena, 4 * count, sizeof(double));
    v->pivots = perp__arena_take(arena, count, sizeof(int32_t));
}

static void find_alphas(perp__verified *v)
{
    const size_t n = (size_t)v->n;
    const perp__matrix A = {v->n, v->n, 1, n, v->transposed, NULL, NULL};
    double *unit = v->work, *high = unit + n, *low = high + n;
    const double m = v->n;

    v->contraction = 0.0;
    for (int32_t i = 0; i < v->n; i++) {
        const double *row = v->inverse + (size_t)i * n;
        const double sizes = perp__sum_of_sizes(row, v->n) + perp__sum_of_sizes(v->row_sums, v->n);
        const double underflow = /* what it can have done to a row of R A */
            perp__raise(DBL_MIN * (8.0 * m * (m + 1.0) + m * sizes), 4.0 * m);
        double sum = 0.0, weighted, alpha;

        /* 1. sum_l |R_il| (row sum l of |A|): what the rounding of row i of R A is measured by. */
        for (int32_t l = 0; l < v->n; l++)
            sum += fabs(row[l]) * v->row_sums[l];
        weighted = perp__raise(sum, 2.0 * v->n);
        /* 2. Row i of I - R A in working precision. */
        sum = perp__sum_of_sizes(v->defect + (size_t)i * n, v->n);
        alpha =
            perp__raise(sum + PERP__GAMMA(v->n + 2.0) * (weighted + 1.0) + underflow, 2.0 * v->n);
        /* 3. And in doubled precision. */
        if (!(alpha < 0.125) && v->n <= PERP__LARGEST_DOUBLED) {
            memset(unit, 0, n * sizeof *unit);
            unit[i] = -1.0;
            perp__multiply_doubled(&A, row, unit, high, low);
            sum = perp__sum_of_sizes(high, v->n) + perp__sum_of_sizes(low, v->n);
            alpha = perp__raise(sum + perp__doubled_error(v->n) * (weighted + 1.0) + underflow,
                                2.0 * v->n);
        }
        v->alpha[i] = alpha;
        v->contraction = perp__larger(v->contraction, alpha);
    }
}

static void set_identity(double *X, size_t n)
{
    memset(X, 0, n * n * sizeof *X);
    for (size_t k = 0; k < n; k++)
        X[k * (n + 1)] = 1.0;
}

bool perp__verified_factor(perp__verified *v)
{
    const size_t n = (size_t)v->n;

    v->contraction = n == 0 ? 0.0 : INFINITY;
    if (n == 0)
        return 1;
    memcpy(v->defect, v->transposed, n * n * sizeof *v->defect);
    if (perp__lu_factor(v->n, v->defect, v->n, v->pivots) != 0)
        return 0;
    set_identity(v->inverse, n);
    perp__lu_solve_columns(v->n, v->n, v->defect, v->n, v->pivots, v->inverse, v->n, 0);
    for (int32_t i = 0; i < v->n; i++)
        v->row_sums[i] =
            perp__raise(perp__sum_of_sizes(v->transposed + (size_t)i * n, v->n), (double)v->n);
    set_identity(v->defect, n);
    perp__gemm_subtract(v->n, v->n, v->n, v->transposed, v->n, v->inverse, v->n, v->defect, v->n);
    find_alphas(v);
    return v->contraction < 1.0;
}

void perp__verified_apply(const perp__verified *v, const double *r, double *x)
{
    for (int32_t i = 0; i < v->n; i++)
        x[i] = 0.0;
    perp__gemv_transposed_subtract(v->n, v->n, v->inverse, v->n > 0 ? v->n : 1, r, x);
    for (int32_t i = 0; i < v->n; i++)
        x[i] = -x[i];
}

void perp__verified_bound(const perp__verified *v, const double *middle, const double *width,
                          double *delta)
{
    /* d = A^-1 r obeys d = R r + (I - R A) d, so ||d|| <= ||R r|| / (1 - ||I - R A||) */
    const double gamma = PERP__GAMMA(v->n + 2.0);
    double norm = 0.0;

    for (int32_t i = 0; i < v->n; i++) { /* a bound of |R r|_i over all r in the interval */
        const double *row = v->inverse + (size_t)i * (size_t)v->n;
        double sum = 0.0, sizes = 0.0, spread = 0.0;

        for (int32_t l = 0; l < v->n; l++) {
            const double size = fabs(row[l]);

            sum += row[l] * middle[l];
            spread += size * (width[l] + gamma * fabs(middle[l]) + 2.0 * DBL_MIN);
            sizes += size + fabs(middle[l]) + width[l];
        }
        delta[i] = perp__raise(fabs(sum) + spread + DBL_MIN * (8.0 * v->n + sizes), 6.0 * v->n);
        norm = perp__larger(norm, delta[i]);
    }
    norm = perp__raise(norm / (1.0 - v->contraction), 4.0);
    for (int32_t i = 0; i < v->n; i++)
        delta[i] = perp__raise(delta[i] + v->alpha[i] * norm + DBL_MIN, 4.0);
}

/* ---- H-matrices ---- */

void perp__dominance_layout(perp__arena *arena, perp__dominance *d, int32_t n, int32_t entries)
{
    d->n = n;
    d->comparison = perp__arena_take(arena, (size_t)entries, sizeof(double));
    PERP__DOUBLES(arena, (size_t)n, &d->v, &d->positive);
}

perp_status perp__dominance_factor(perp__dominance *d, perp_context *context)
{
    perp__square C = d->A;
    perp_status status;

    d->is_z_matrix = 1;
    for (int32_t j = 0; j < C.n; j++)
        for (int32_t k = C.column_starts[j]; k < C.column_starts[j + 1]; k++) {
            const double size = fabs(C.values[k]);

            d->comparison[k] = C.row_indices[k] == j ? size : -size;
            d->is_z_matrix &= d->comparison[k] == C.values[k];
        }
    C.values = d->comparison;
    status = perp__cached_factor_analyse(&d->kept, context, &d->A);
    PERP__THEN(status, perp__klu_factor(d->kept.factor, &d->A));
    if (status == PERP_OK && !d->is_z_matrix) {
        status = perp__cached_factor_analyse(&d->kept_comparison, context, &C);
        PERP__THEN(status, perp__klu_factor(d->kept_comparison.factor, &C));
    }
    return status;
}

bool perp__dominance_bound(perp__dominance *d, const double *middle, const double *width,
                           double *delta)
{
    const perp__square *A = &d->A;
    const double rounding = PERP__GAMMA(d->n + 4.0), underflow = DBL_MIN * (8.0 * d->n + 8.0);
    double largest = 0.0, factor = 0.0;
    bool is_positive = 1;

    /* 1. v near C^-1 |r| makes the bound sharp in every component; the floor keeps it positive. */
    for (int32_t i = 0; i < d->n; i++) {
        delta[i] = perp__raise(fabs(middle[i]) + width[i] + DBL_MIN, 2.0);
        largest = perp__larger(largest, delta[i]);
    }
    for (int32_t i = 0; i < d->n; i++)
        d->v[i] = fmax(delta[i], 1e-3 * largest);
    perp__klu_solve(d->is_z_matrix ? d->kept.factor : d->kept_comparison.factor, d->v, 0);
    /* 2. positive := a lower bound of C v, all rounding and underflow counted. */
    memset(d->positive, 0, (size_t)d->n * sizeof *d->positive);
    for (int32_t j = 0; j < d->n && is_positive; j++) {
        is_positive = d->v[j] >= DBL_MIN;
        for (int32_t k = A->column_starts[j]; k < A->column_starts[j + 1] && is_positive; k++) {
            const double product = d->comparison[k] * d->v[j];

            /* its part of the sum's error, and of this subtraction's */
            d->positive[A->row_indices[k]] +=
                product - (4.0 * rounding * fabs(product) + DBL_MIN * (d->v[j] + 1.0));
        }
    }
    for (int32_t i = 0; i < d->n && is_positive; i++) {
        d->positive[i] -= underflow;
        is_positive = d->positive[i] > 0.0;
    }
    if (!is_positive)
        return 0;
    /* 3. |r| <= factor C v. */
    for (int32_t i = 0; i < d->n; i++)
        factor = perp__larger(factor, delta[i] / d->positive[i]);
    factor = perp__raise(factor + DBL_MIN, 4.0);
    for (int32_t i = 0; i < d->n; i++)
        delta[i] = perp__raise(factor * d->v[i] + DBL_MIN, 4.0);
    return 1;
}

void perp__dominance_release(perp__dominance *d)
{
    perp__cached_factor_release(&d->kept);
    perp__cached_factor_release(&d->kept_comparison);
}
