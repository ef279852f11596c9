/* Checked copies of what callers hand over, and a check of inertia. */
#ifndef PERP_MECHANISM_COPY_H
#define PERP_MECHANISM_COPY_H

#include <perp/matrix.h>

/* A caller's view to `to`, column-major without gaps. */
perp_status perp__copy_matrix(perp_context *context, const char *name, int32_t rows,
                              int32_t columns, double *to, const perp_matrix *from);

/* n finite numbers, and none of them negative; NULL: 0. */
perp_status perp__copy_vector(perp_context *context, const char *name, int32_t n, double *to,
                              const double *from);
perp_status perp__copy_sizes(perp_context *context, const char *name, int32_t n, double *to,
                             const double *from);

/* Refuses what is not symmetric up to rounding and positive definite; `factor`, which may be A,
 * receives the Cholesky factor. */
perp_status perp__check_inertia(perp_context *context, const char *name, int32_t n, const double *A,
                                double *factor);

/* mu >= 0, and mu_static >= mu, which NULL stands for. */
perp_status perp__copy_coefficients(perp_context *context, int32_t n, double *mu, double *mu_static,
                                    const double *from, const double *from_static);

#endif
