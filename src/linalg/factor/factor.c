#include "linalg/factor/factor.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "base/context.h"
#include "linalg/blas.h"
#include "linalg/matrix.h"

/* ---- the condition number's estimate that all factorisations share ---- */

enum { MAX_ITERATIONS = 5 };

static double sign_of(double x)
{
    return x >= 0.0 ? 1.0 : -1.0;
}

/* A lower bound of ||A^-1||_1, within a factor of 3 nearly always, from at most 11 solves; +inf or
 * NaN where a solve overflows. Higham, "FORTRAN codes for estimating the one-norm of a real or
 * complex matrix, with applications to condition estimation", ACM TOMS 14 (1988), algorithm 4.1.
 * work: 2 n doubles. */
static double inverse_norm_1(int32_t n, double *work, perp__solve_function solve, void *user)
{
    double *x = work, *signs = work + n;
    double estimate = 0.0, other;
    int32_t i, k, unit = -1;

    if (n == 0)
        return 0.0;
    for (i = 0; i < n; i++) {
        x[i] = 1.0 / (double)n;
        signs[i] = 0.0;
    }
    /* maximise the convex ||A^-1 x||_1 over the unit ball: go to the vertex e_unit where its
     * subgradient, A^-T sign(A^-1 x), is steepest */
    for (k = 0; k < MAX_ITERATIONS; k++) {
        int32_t changed = 0, next;
        double found;

        solve(user, x, 0);
        found = perp__sum_of_sizes(x, n);
        if (!(found > estimate)) {
            if (!(found <= estimate))
                return found; /* NaN */
            break;
        }
        estimate = found;
        for (i = 0; i < n; i++) {
            changed |= sign_of(x[i]) != signs[i];
            signs[i] = sign_of(x[i]);
            x[i] = signs[i];
        }
        if (!changed)
            break;
        solve(user, x, 1);
        next = 0;
        for (i = 1; i < n; i++)
            if (fabs(x[i]) > fabs(x[next]))
                next = i;
        if (unit >= 0 && fabs(x[next]) <= fabs(x[unit]))
            break;
        unit = next;
        for (i = 0; i < n; i++)
            x[i] = 0.0;
        x[unit] = 1.0;
    }
    /* a vector of alternating signs and growing size catches what the ascent misses */
    for (i = 0; i < n; i++) {
        const double size = 1.0 + (n > 1 ? (double)i / (double)(n - 1) : 0.0);

        x[i] = i % 2 == 0 ? size : -size;
    }
    solve(user, x, 0);
    other = 2.0 * perp__sum_of_sizes(x, n) / (3.0 * (double)n);
    return other > estimate || isnan(other) ? other : estimate;
}

double perp__norm_1(const perp__square *A)
{
    double norm = 0.0;

    for (int32_t j = 0; j < A->n; j++) {
        double sum;

        if (A->column_starts)
            sum = perp__sum_of_sizes(A->values + A->column_starts[j],
                                     A->column_starts[j + 1] - A->column_starts[j]);
        else
            sum = perp__sum_of_sizes(A->values + (size_t)A->n * (size_t)j, A->n);
        if (sum > norm || isnan(sum))
            norm = sum;
    }
    return norm;
}

double perp__reciprocal_condition(int32_t n, double norm, double *work, perp__solve_function solve,
                                  void *user)
{
    const double inverse_norm = inverse_norm_1(n, work, solve, user);
    double reciprocal;

    if (n == 0)
        return 1.0;
    reciprocal = 1.0 / inverse_norm / norm;
    if (!(reciprocal > 0.0))
        return 0.0;
    return reciprocal < 1.0 ? reciprocal : 1.0;
}

perp_status perp__lu_factor_finite(int32_t n, double *A, int32_t *pivots)
{
    bool regular = perp__lu_factor(n, A, n, pivots) == 0;

    for (int32_t i = 0; i < n; i++)
        regular = regular && isfinite(A[(size_t)i * ((size_t)n + 1)]);
    return regular ? PERP_OK : PERP__FACTOR_SINGULAR;
}

perp_status perp__klu_with_room(perp_context *context, perp__factor **factor, int32_t n,
                                int32_t *starts, int32_t *rows)
{
    const perp__square diagonal = {n, NULL, starts, rows};

    for (int32_t k = 0; k < n; k++)
        starts[k] = rows[k] = k;
    starts[n] = n;
    return perp__klu_analyse(context, factor, &diagonal);
}

/* ---- factorisations kept from set-up to set-up ---- */

perp_status perp__cached_factor_analyse(perp__cached_factor *cached, perp_context *context,
                                        const perp__square *A)
{
    const size_t starts = (size_t)A->n + 1, entries = (size_t)A->column_starts[A->n];
    perp_status status;

    if (cached->factor && cached->n == A->n &&
        !memcmp(cached->pattern, A->column_starts, starts * sizeof(int32_t)) &&
        !memcmp(cached->pattern + starts, A->row_indices, entries * sizeof(int32_t)))
        return PERP_OK;
    perp__cached_factor_release(cached);
    cached->context = context;
    cached->n = A->n;
    status = perp__klu_analyse(context, &cached->factor, A);
    if (status == PERP_OK) {
        cached->pattern = perp__allocate(context, starts + entries, sizeof(int32_t));
        if (cached->pattern) {
            memcpy(cached->pattern, A->column_starts, starts * sizeof(int32_t));
            memcpy(cached->pattern + starts, A->row_indices, entries * sizeof(int32_t));
        } else {
            status = perp__fail_memory(context, "a sparse pattern");
        }
    }
    if (status != PERP_OK)
        perp__cached_factor_release(cached);
    return status;
}

void perp__cached_factor_release(perp__cached_factor *cached)
{
    perp__klu_destroy(cached->factor);
    cached->factor = NULL;
    if (cached->pattern)
        perp__release(cached->context, cached->pattern);
    cached->pattern = NULL;
}
