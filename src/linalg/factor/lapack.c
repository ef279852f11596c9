/* Dense LU with partial pivoting. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/blas.h"
#include "linalg/factor/factor.h"

struct perp__factor {
    perp_context *context;
    int32_t n;
    int32_t singular;
    double *LU;   /* n by n */
    double *work; /* 4 n */
    int32_t *pivots;
    int32_t *iwork;
};

static void destroy(perp__factor *factor)
{
    if (!factor)
        return;
    perp__release(factor->context, factor->LU);
    perp__release(factor->context, factor->work);
    perp__release(factor->context, factor->pivots);
    perp__release(factor->context, factor->iwork);
    perp__release(factor->context, factor);
}

static perp_status analyse(perp_context *context, perp__factor **factor, const perp__square *A)
{
    const size_t n = (size_t)A->n;
    perp__factor *made = perp__allocate_zeros(context, 1, sizeof *made, "a dense factorisation");

    if (!made)
        return PERP_ERROR_MEMORY;
    made->context = context;
    made->n = A->n;
    made->singular = 1; /* until factored */
    if (n == 0 || n <= SIZE_MAX / sizeof(double) / n)
        made->LU = perp__allocate(context, n * n, sizeof *made->LU);
    made->work = perp__allocate(context, 4 * n, sizeof *made->work);
    made->pivots = perp__allocate(context, n, sizeof *made->pivots);
    made->iwork = perp__allocate(context, n, sizeof *made->iwork);
    if (!made->LU || !made->work || !made->pivots || !made->iwork) {
        destroy(made);
        return perp__fail_memory(context, "a dense factorisation");
    }
    *factor = made;
    return PERP_OK;
}

static perp_status reanalyse(perp__factor *factor, const perp__square *A)
{
    factor->n = A->n;
    factor->singular = 1; /* until factored */
    return PERP_OK;
}

static perp_status factor_values(perp__factor *factor, const perp__square *A, int32_t keep_pivots)
{
    const size_t n = (size_t)factor->n;

    (void)keep_pivots; /* a full factorisation every time */
    if (n > 0)
        memcpy(factor->LU, A->values, n * n * sizeof *factor->LU);
    factor->singular = perp__lu_factor(factor->n, factor->LU, factor->n, factor->pivots) != 0;
    /* factors that overflowed are of no more use than a zero pivot */
    for (size_t i = 0; i < n; i++)
        factor->singular |= !isfinite(factor->LU[i * (n + 1)]);
    return factor->singular ? PERP__FACTOR_SINGULAR : PERP_OK;
}

static void solve(perp__factor *factor, double *x, int32_t transposed)
{
    perp__lu_solve(factor->n, factor->LU, factor->n, factor->pivots, x, transposed);
}

static double condition(perp__factor *factor, const perp__square *A)
{
    if (factor->singular)
        return factor->n == 0 ? 1.0 : 0.0;
    return perp__lu_condition(factor->n, factor->LU, factor->n, perp__norm_1(A), factor->work,
                              factor->iwork);
}

const perp__factor_type perp__factor_lapack = {
    "lapack", 0, analyse, reanalyse, factor_values, solve, condition, destroy,
};
