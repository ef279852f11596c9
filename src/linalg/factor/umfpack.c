/* Sparse LU by the unsymmetric multifrontal method (GPL=1): Davis, "Algorithm 832: UMFPACK", ACM
 * TOMS 30 (2004). The ordering is kept, pivots are chosen anew. */
#include <float.h>
#include <string.h>
#include <umfpack.h>

#include "base/context.h"
#include "linalg/condition.h"
#include "linalg/factor/factor.h"

struct perp__factor {
    perp_context *context;
    int32_t n;
    void *symbolic; /* NULL if n = 0 */
    void *numeric;  /* NULL if there are no factors */
    double control[UMFPACK_CONTROL];
    double info[UMFPACK_INFO];
    double *work;   /* 4 n: right-hand side, UMFPACK's workspace, the condition's */
    int32_t *iwork; /* n */
};

static void destroy(perp__factor *factor)
{
    if (!factor)
        return;
    umfpack_di_free_numeric(&factor->numeric);
    umfpack_di_free_symbolic(&factor->symbolic);
    perp__release(factor->context, factor->work);
    perp__release(factor->context, factor->iwork);
    perp__release(factor->context, factor);
}

static perp_status reanalyse(perp__factor *factor, const perp__square *A)
{
    umfpack_di_free_numeric(&factor->numeric);
    umfpack_di_free_symbolic(&factor->symbolic);
    factor->n = A->n;
    if (A->n > 0)
        umfpack_di_symbolic(A->n, A->n, A->column_starts, A->row_indices, NULL, &factor->symbolic,
                            factor->control, factor->info);
    if (A->n == 0 || factor->symbolic)
        return PERP_OK;
    factor->n = 0;
    return perp__fail_memory(factor->context, "a sparse factorisation");
}

static perp_status analyse(perp_context *context, perp__factor **factor, const perp__square *A)
{
    const size_t n = (size_t)A->n;
    perp__factor *made = perp__allocate(context, 1, sizeof *made);

    if (!made)
        return perp__fail_memory(context, "a sparse factorisation");
    memset(made, 0, sizeof *made);
    made->context = context;
    umfpack_di_defaults(made->control);
    made->control[UMFPACK_IRSTEP] = 0; /* the caller refines, in doubled precision */
    made->work = perp__allocate(context, 4 * n, sizeof *made->work);
    made->iwork = perp__allocate(context, n, sizeof *made->iwork);
    if (!made->work || !made->iwork || reanalyse(made, A) != PERP_OK) {
        destroy(made);
        return perp__fail_memory(context, "a sparse factorisation");
    }
    *factor = made;
    return PERP_OK;
}

/* The smallest pivot and the largest; NaN if one is. */
static int has_bad_pivot(const double *info)
{
    return !(info[UMFPACK_UMIN] > 0.0 && info[UMFPACK_UMAX] <= DBL_MAX);
}

static perp_status factor_values(perp__factor *factor, const perp__square *A, int32_t keep_pivots)
{
    int status;

    (void)keep_pivots; /* a full factorisation every time */
    if (factor->n == 0)
        return PERP_OK;
    umfpack_di_free_numeric(&factor->numeric);
    status = umfpack_di_numeric(A->column_starts, A->row_indices, A->values, factor->symbolic,
                                &factor->numeric, factor->control, factor->info);
    if (status < 0)
        return perp__fail_memory(factor->context, "a sparse factorisation");
    if (status != UMFPACK_OK || has_bad_pivot(factor->info)) {
        umfpack_di_free_numeric(&factor->numeric);
        return PERP__FACTOR_SINGULAR;
    }
    return PERP_OK;
}

static void solve(perp__factor *factor, double *x, int32_t transposed)
{
    const size_t n = (size_t)factor->n;

    if (!factor->numeric)
        return;
    memcpy(factor->work, x, n * sizeof *x);
    /* without refinement the matrix itself is not looked at */
    umfpack_di_wsolve(transposed ? UMFPACK_At : UMFPACK_A, NULL, NULL, NULL, x, factor->work,
                      factor->numeric, factor->control, factor->info, factor->iwork,
                      factor->work + n);
}

static void solve_for_condition(void *user, double *x, int32_t transposed)
{
    solve(user, x, transposed);
}

static double condition(perp__factor *factor, const perp__square *A)
{
    if (factor->n > 0 && !factor->numeric)
        return 0.0;
    return perp__reciprocal_condition(factor->n, perp__norm_1(A),
                                      factor->work + 2 * (size_t)factor->n, solve_for_condition,
                                      factor);
}

const perp__factor_type perp__factor_umfpack = {
    "umfpack", 1, 0, analyse, reanalyse, factor_values, solve, condition, destroy,
};
