#include "mechanism/copy.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "linalg/blas.h"
#include "linalg/matrix.h"

perp_status perp__copy_matrix(perp_context *context, const char *name, int32_t rows,
                              int32_t columns, double *to, const perp_matrix *from)
{
    const size_t height = (size_t)rows, width = (size_t)columns;
    perp__matrix own;
    perp_status status;

    memset(to, 0, height * width * sizeof *to);
    if (!from)
        return perp__check_pointer(context, name, from);
    status = perp__matrix_read(context, name, &own, from);
    if (status != PERP_OK)
        return status;
    if (own.rows != rows || own.columns != columns)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "%s is %d by %d, expected %d by %d", name,
                          (int)own.rows, (int)own.columns, (int)rows, (int)columns);
    for (size_t j = 0; j < width; j++) {
        if (own.column_starts)
            for (int32_t k = own.column_starts[j]; k < own.column_starts[j + 1]; k++)
                to[(size_t)own.row_indices[k] + height * j] = own.values[k];
        else
            for (size_t i = 0; i < height; i++)
                to[i + height * j] = own.values[i * own.row_stride + j * own.column_stride];
    }
    return PERP_OK;
}

perp_status perp__check_inertia(perp_context *context, const char *name, int32_t n, const double *A,
                                double *factor)
{
    const size_t size = (size_t)n;
    int32_t failed;

    for (size_t j = 0; j < size; j++)
        for (size_t i = 0; i < j; i++)
            if (!(fabs(A[i + size * j] - A[j + size * i]) <=
                  1e-12 * (fabs(A[i + size * j]) + fabs(A[j + size * i])) +
                      1e-15 * sqrt(fabs(A[i + size * i] * A[j + size * j]))))
                return perp__fail(context, PERP_ERROR_ARGUMENT,
                                  "%s is not symmetric: entry (%zu, %zu) is %g, its mirror %g",
                                  name, i, j, A[i + size * j], A[j + size * i]);
    if (factor != A)
        memcpy(factor, A, size * size * sizeof *factor);
    failed = perp__cholesky_factor(n, factor, n);
    if (failed != 0)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "%s is not positive definite (leading block of %d rows)", name,
                          (int)failed);
    return PERP_OK;
}

perp_status perp__copy_vector(perp_context *context, const char *name, int32_t n, double *to,
                              const double *from)
{
    perp_status status = PERP_OK;

    if (from)
        status = perp__check_finite(context, name, from, (size_t)n);
    if (status == PERP_OK && from)
        memcpy(to, from, (size_t)n * sizeof *to);
    if (status == PERP_OK && !from)
        memset(to, 0, (size_t)n * sizeof *to);
    return status;
}

perp_status perp__check_compliance(perp_context *context, double stiffness, double damping)
{
    if (!(stiffness > 0.0 && isfinite(stiffness)))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "stiffness is %g, expected a positive number", stiffness);
    if (!(damping >= 0.0 && isfinite(damping)))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "damping is %g, expected a number >= 0",
                          damping);
    return PERP_OK;
}
