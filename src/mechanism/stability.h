/* Compliant contacts: delta'' + Gamma (k delta + c delta') = const near a solution. */
#ifndef PERP_MECHANISM_STABILITY_H
#define PERP_MECHANISM_STABILITY_H

#include <stdint.h>

/* Gamma, p by p column-major, is overwritten. roots: 2 p pairs (real, imaginary); gamma: p pairs of
 * work, holding the eigenvalues of Gamma afterwards as p real, p imaginary parts. stable: all 2 p
 * roots have negative real parts; flutter: not so, although Re gamma > 0 for all. */
void perp__stability_of(int32_t p, double *Gamma, double stiffness, double damping, double *gamma,
                        double *roots, int32_t *stable, int32_t *flutter);

#endif
