/* What signs and symmetry tell of a matrix in one pass. */
#ifndef PERP_LINALG_SIGNS_H
#define PERP_LINALG_SIGNS_H

#include "linalg/matrix.h"

bool perp__has_positive_diagonal(const perp__matrix *M);

/* Of a dense M without gaps, up to rounding of its rows' norms; NULL: to the bit. */
bool perp__is_dense_symmetric(const perp__matrix *M, const double *row_norms);

/* The following ones are of CSC with sorted columns. No positive entry beside the diagonal; and
 * positive ones that are small, in every column. */
bool perp__has_z_signs(const perp__matrix *M);
bool perp__is_nearly_z(const perp__matrix *M);

/* Whether M is equal to its transpose, each entry up to `tolerance` of it. cursor: n entries. */
bool perp__has_symmetric_entries(const perp__matrix *M, int32_t *cursor, double tolerance);

#endif
