/* An orthonormal basis of the span of some rows, and what is left of a vector outside that span. */
#ifndef PERP_LINALG_ORTHOGONAL_H
#define PERP_LINALG_ORTHOGONAL_H

#include <stddef.h>
#include <stdint.h>

/* rows: m by n, row by row, each of length 1; destroyed. targets: m; destroyed. Finds the rank, an
 * orthonormal basis of the rows (rank by n) and the shortest `particular` that meets the targets of
 * the rows taken; the others are met as far as they are consistent. taken: m, norms: m. */
int32_t perp__orthogonal_rows(double *rows, double *targets, int32_t *taken, double *norms,
                              double *basis, double *particular, int32_t m, int32_t n);

/* y := what is left of y outside the span of the basis. */
void perp__project_out(const double *basis, int32_t rank, int32_t n, double *y);

/* |x|, without overflow. */
double perp__length(const double *x, int32_t n);

#endif
