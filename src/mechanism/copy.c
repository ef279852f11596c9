#include "mechanism/copy.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "linalg/blas.h"
#include "linalg/matrix.h"
#include "mechanism/tuning.h"

perp_status perp__copy_matrix(perp_context *context, const char *name, int32_t rows,
                              int32_t columns, double *to, const perp_matrix *from)
{
    const size_t height = (size_t)rows, width = (size_t)columns;
    perp__matrix copy;
    const perp_status status = perp__matrix_read_sized(context, name, &copy, from, rows, columns);

    memset(to, 0, height * width * sizeof *to);
    if (status == PERP_OK)
        perp__matrix_spread(&copy, to, height);
    return status;
}

perp_status perp__check_inertia(perp_context *context, const char *name, int32_t n, const double *A,
                                double *factor)
{
    const size_t size = (size_t)n;
    int32_t failed;

    for (size_t j = 0; j < size; j++)
        for (size_t i = 0; i < j; i++)
            if (!(fabs(A[i + size * j] - A[j + size * i]) <=
                  PERP__NOTHING * (fabs(A[i + size * j]) + fabs(A[j + size * i])) +
                      1e-15 * sqrt(fabs(A[i + size * i] * A[j + size * j]))))
                return perp__refuse(context,
                                    "%s is not symmetric: entry (%zu, %zu) is %g, its mirror %g",
                                    name, i, j, A[i + size * j], A[j + size * i]);
    if (factor != A)
        memcpy(factor, A, size * size * sizeof *factor);
    failed = perp__cholesky_factor(n, factor, n);
    if (failed != 0)
        return perp__refuse(context, "%s is not positive definite (leading block of %d rows)", name,
                            (int)failed);
    return PERP_OK;
}

perp_status perp__copy_vector(perp_context *context, const char *name, int32_t n, double *to,
                              const double *from)
{
    const perp_status status = from ? perp__check_finite(context, name, from, (size_t)n) : PERP_OK;

    if (status == PERP_OK && from)
        memcpy(to, from, (size_t)n * sizeof *to);
    else if (status == PERP_OK)
        memset(to, 0, (size_t)n * sizeof *to);
    return status;
}

perp_status perp__copy_sizes(perp_context *context, const char *name, int32_t n, double *to,
                             const double *from)
{
    perp_status status = perp__copy_vector(context, name, n, to, from);

    for (int32_t i = 0; i < n && status == PERP_OK; i++)
        if (to[i] < 0.0)
            status = perp__refuse(context, "%s[%d] is %g, negative", name, (int)i, to[i]);
    return status;
}

perp_status perp__copy_coefficients(perp_context *context, int32_t n, double *mu, double *mu_static,
                                    const double *from, const double *from_static)
{
    perp_status status = perp__check_pointer(context, "mu", from);

    PERP__THEN(status, perp__copy_sizes(context, "mu", n, mu, from));
    PERP__THEN(status, perp__copy_vector(context, "mu_static", n, mu_static,
                                         from_static ? from_static : from));
    for (int32_t i = 0; i < n && status == PERP_OK; i++) {
        if (mu_static[i] < mu[i])
            return perp__refuse(context, "mu_static[%d] = %g < mu[%d] = %g", (int)i, mu_static[i],
                                (int)i, mu[i]);
    }
    return status;
}
