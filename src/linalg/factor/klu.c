/* Sparse LU of matrices that come in blocks: Davis & Palamadai Natarajan, "Algorithm 907: KLU",
 * ACM TOMS 37 (2010). The ordering is kept from one matrix to the next of its pattern. */
#include <klu.h>
#include <math.h>

#include "base/context.h"
#include "linalg/factor/factor.h"

struct perp__factor {
    perp_context *context;
    int32_t n;
    klu_common common;
    klu_symbolic *symbolic; /* NULL if n = 0 */
    klu_numeric *numeric;   /* NULL if there are no factors */
};

void perp__klu_destroy(perp__factor *factor)
{
    if (!factor)
        return;
    klu_free_numeric(&factor->numeric, &factor->common);
    klu_free_symbolic(&factor->symbolic, &factor->common);
    perp__release(factor->context, factor);
}

perp_status perp__klu_reanalyse(perp__factor *factor, const perp__square *A)
{
    klu_free_numeric(&factor->numeric, &factor->common);
    klu_free_symbolic(&factor->symbolic, &factor->common);
    factor->n = A->n;
    if (A->n == 0)
        return PERP_OK;
    /* KLU reads the pattern only, but does not say so in its types */
    factor->symbolic =
        klu_analyze(A->n, (int *)A->column_starts, (int *)A->row_indices, &factor->common);
    if (factor->symbolic)
        return PERP_OK;
    factor->n = 0;
    return perp__fail_memory(factor->context, "a sparse factorisation");
}

perp_status perp__klu_analyse(perp_context *context, perp__factor **factor, const perp__square *A)
{
    perp__factor *made = perp__allocate_zeros(context, 1, sizeof *made, "a sparse factorisation");

    if (!made)
        return PERP_ERROR_MEMORY;
    made->context = context;
    klu_defaults(&made->common);
    if (perp__klu_reanalyse(made, A) != PERP_OK) {
        perp__klu_destroy(made);
        return perp__fail_memory(context, "a sparse factorisation");
    }
    *factor = made;
    return PERP_OK;
}

double perp__klu_products(const perp__factor *factor)
{
    return factor->symbolic ? factor->symbolic->est_flops : 0.0;
}

perp_status perp__klu_factor(perp__factor *factor, const perp__square *A)
{
    int *starts = (int *)A->column_starts, *rows = (int *)A->row_indices;
    double *values = (double *)A->values;

    if (factor->n == 0)
        return PERP_OK;
    klu_free_numeric(&factor->numeric, &factor->common);
    factor->numeric = klu_factor(starts, rows, values, factor->symbolic, &factor->common);
    if (!factor->numeric && factor->common.status < 0)
        return perp__fail_memory(factor->context, "a sparse factorisation");
    for (int32_t k = 0; k < factor->n && factor->numeric; k++) {
        const double pivot = ((const double *)factor->numeric->Udiag)[k];

        if (pivot == 0.0 || !isfinite(pivot))
            klu_free_numeric(&factor->numeric, &factor->common);
    }
    return factor->numeric ? PERP_OK : PERP__FACTOR_SINGULAR;
}

void perp__klu_solve(perp__factor *factor, double *x, int32_t transposed)
{
    if (!factor->numeric)
        return;
    if (transposed)
        klu_tsolve(factor->symbolic, factor->numeric, factor->n, 1, x, &factor->common);
    else
        klu_solve(factor->symbolic, factor->numeric, factor->n, 1, x, &factor->common);
}
