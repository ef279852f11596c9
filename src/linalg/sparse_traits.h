/* Structure of sparse square matrices, found in one pass. */
#ifndef PERP_LINALG_SPARSE_TRAITS_H
#define PERP_LINALG_SPARSE_TRAITS_H

#include "linalg/matrix.h"

/* M is CSC with sorted columns. */
int32_t perp__has_positive_diagonal(const perp__matrix *M);

/* No positive entry beside the diagonal. */
int32_t perp__has_z_signs(const perp__matrix *M);

/* In diag(scale) M diag(scale) the positive entries beside the diagonal of each column add up to a
 * quarter of its diagonal entry or less. */
int32_t perp__is_nearly_z(const perp__matrix *M, const double *scale);

/* Equal to its transpose up to a few units of rounding. cursor: n entries. */
int32_t perp__has_symmetric_entries(const perp__matrix *M, int32_t *cursor);

#endif
