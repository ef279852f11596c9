/* Sparse Cholesky of symmetric positive definite matrices (GPL=1): Chen, Davis, Hager &
 * Rajamanickam, "Algorithm 887: CHOLMOD", ACM TOMS 35 (2008). Analysed once; simplicial or
 * supernodal, whichever it finds cheaper. Of A only the upper triangle is read. */
#include <cholmod.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/condition.h"
#include "linalg/factor/factor.h"

struct perp__factor {
    perp_context *context;
    int32_t n;
    int32_t ready; /* there are factors */
    cholmod_common common;
    cholmod_factor *L;        /* NULL if n = 0 */
    cholmod_dense *X, *Y, *E; /* solution and workspace, kept from one solve to the next */
    double *work;             /* 2 n */
};

static void destroy(perp__factor *factor)
{
    if (!factor)
        return;
    cholmod_free_dense(&factor->X, &factor->common);
    cholmod_free_dense(&factor->Y, &factor->common);
    cholmod_free_dense(&factor->E, &factor->common);
    cholmod_free_factor(&factor->L, &factor->common);
    cholmod_finish(&factor->common);
    perp__release(factor->context, factor->work);
    perp__release(factor->context, factor);
}

/* CHOLMOD reads the matrix only, but does not say so in its types. */
static cholmod_sparse view_of(const perp__square *A)
{
    cholmod_sparse view;

    memset(&view, 0, sizeof view);
    view.nrow = view.ncol = (size_t)A->n;
    view.nzmax = (size_t)A->column_starts[A->n];
    view.p = (void *)A->column_starts;
    view.i = (void *)A->row_indices;
    view.x = (void *)A->values;
    view.stype = 1;
    view.itype = CHOLMOD_INT;
    view.xtype = A->values ? CHOLMOD_REAL : CHOLMOD_PATTERN;
    view.dtype = CHOLMOD_DOUBLE;
    view.sorted = 1;
    view.packed = 1;
    return view;
}

static perp_status reanalyse(perp__factor *factor, const perp__square *A)
{
    cholmod_free_factor(&factor->L, &factor->common);
    factor->ready = 0;
    factor->n = A->n;
    if (A->n > 0) {
        cholmod_sparse view = view_of(A);

        factor->L = cholmod_analyze(&view, &factor->common);
    }
    if (A->n == 0 || factor->L)
        return PERP_OK;
    factor->n = 0;
    return perp__fail_memory(factor->context, "a sparse factorisation");
}

static perp_status analyse(perp_context *context, perp__factor **factor, const perp__square *A)
{
    perp__factor *made = perp__allocate(context, 1, sizeof *made);

    if (!made)
        return perp__fail_memory(context, "a sparse factorisation");
    memset(made, 0, sizeof *made);
    made->context = context;
    cholmod_start(&made->common);
    made->common.print = 0;
    made->common.final_ll = 1; /* LL', which ends at a pivot that is not positive; LDL' does not */
    made->work = perp__allocate(context, 2 * (size_t)A->n, sizeof *made->work);
    if (!made->work || reanalyse(made, A) != PERP_OK) {
        destroy(made);
        return perp__fail_memory(context, "a sparse factorisation");
    }
    *factor = made;
    return PERP_OK;
}

/* factor->X := A^-1 b */
static int solve_for(perp__factor *factor, double *b)
{
    cholmod_dense view;

    memset(&view, 0, sizeof view);
    view.nrow = view.nzmax = view.d = (size_t)factor->n;
    view.ncol = 1;
    view.x = b;
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    return cholmod_solve2(CHOLMOD_A, factor->L, &view, NULL, &factor->X, NULL, &factor->Y,
                          &factor->E, &factor->common);
}

static int is_finite(const perp__square *A)
{
    int32_t k;

    for (k = 0; k < A->column_starts[A->n]; k++)
        if (!isfinite(A->values[k]))
            return 0;
    return 1;
}

static perp_status factor_values(perp__factor *factor, const perp__square *A, int32_t keep_pivots)
{
    cholmod_sparse view;

    (void)keep_pivots; /* a full factorisation every time */
    factor->ready = 0;
    if (factor->n == 0)
        return PERP_OK;
    /* L_ij^2 <= A_ii: finite values have finite factors, or a pivot that is not positive */
    if (!is_finite(A))
        return PERP__FACTOR_SINGULAR;
    view = view_of(A);
    cholmod_factorize(&view, factor->L, &factor->common);
    if (factor->common.status < CHOLMOD_OK)
        return perp__fail_memory(factor->context, "a sparse factorisation");
    if (factor->common.status != CHOLMOD_OK || factor->L->minor < (size_t)factor->n)
        return PERP__FACTOR_SINGULAR;
    /* the first solve allocates: here, where that may fail */
    memset(factor->work, 0, (size_t)factor->n * sizeof *factor->work);
    if (!solve_for(factor, factor->work))
        return perp__fail_memory(factor->context, "a sparse factorisation");
    factor->ready = 1;
    return PERP_OK;
}

static void solve(perp__factor *factor, double *x, int32_t transposed)
{
    (void)transposed; /* A is symmetric */
    if (factor->ready && solve_for(factor, x))
        memcpy(x, factor->X->x, (size_t)factor->n * sizeof *x);
}

static void solve_for_condition(void *user, double *x, int32_t transposed)
{
    solve(user, x, transposed);
}

static double condition(perp__factor *factor, const perp__square *A)
{
    if (factor->n > 0 && !factor->ready)
        return 0.0;
    return perp__reciprocal_condition(factor->n, perp__norm_1(A), factor->work, solve_for_condition,
                                      factor);
}

const perp__factor_type perp__factor_cholmod = {
    "cholmod", 1, 1, analyse, reanalyse, factor_values, solve, condition, destroy,
};
