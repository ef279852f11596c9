/* Eigenvalues of a small general matrix, in an order of operations of our own: the same bits
 * whatever BLAS is installed. And what they say of compliant contacts. */
#ifndef PERP_MECHANISM_EIGENVALUES_H
#define PERP_MECHANISM_EIGENVALUES_H

#include <stdint.h>

/* Eigenvalues of A, n by n column-major with leading dimension n, which is overwritten. Complex
 * ones come in pairs, the positive imaginary part first. Returns 0, or 1 where the iteration does
 * not converge, or A or an eigenvalue is not finite; then all are nan. */
int32_t perp__eigenvalues(int32_t n, double *A, double *real, double *imaginary);

/* Compliant contacts, delta'' + Gamma (k delta + c delta') = const near a solution. Gamma, p by p
 * column-major, is overwritten. roots: 2 p pairs (real, imaginary); gamma: p pairs of work, holding
 * the eigenvalues of Gamma afterwards as p real, p imaginary parts. stable: all 2 p roots have
 * negative real parts; flutter: not so, although Re gamma > 0 for all. */
void perp__stability_of(int32_t p, double *Gamma, double stiffness, double damping, double *gamma,
                        double *roots, int32_t *stable, int32_t *flutter);

#endif
