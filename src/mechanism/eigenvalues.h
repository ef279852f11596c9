/* Eigenvalues of a small general matrix, in an order of operations of our own: the same bits
 * whatever BLAS is installed. */
#ifndef PERP_MECHANISM_EIGENVALUES_H
#define PERP_MECHANISM_EIGENVALUES_H

#include <stdint.h>

/* Eigenvalues of A, n by n column-major with leading dimension n, which is overwritten. Complex
 * ones come in pairs, the positive imaginary part first. Returns 0, or 1 where the iteration does
 * not converge, or A or an eigenvalue is not finite; then all are nan. */
int32_t perp__eigenvalues(int32_t n, double *A, double *real, double *imaginary);

#endif
