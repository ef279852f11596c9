/* Symmetric equilibration by powers of two. */
#ifndef PERP_LINALG_SCALE_H
#define PERP_LINALG_SCALE_H

#include "linalg/matrix.h"

/* Finds e with S = D M D, D = diag(2^e_i):
 * - a row with M_ii > 0: S_ii in [1/2, 2) (e_i depends on M_ii alone, so that scaling row and
 * column i of M by 2^k changes e_i by exactly -k);
 * - a row without: its largest coupling |S_ij| or |S_ji| (j != i) to rows that already have their
 *   e_j is brought into [1, 2) or as near as a power of two allows; rows are reached breadth first
 *   from the rows with M_ii > 0, and a component that has none starts at its lowest index with e =
 * 0 (or from M_ii < 0: |M_ii| to a unit);
 * - a row and column of zeros: e_i = 0.
 * |e_i| <= 511, so that every 2^(e_i+e_j) is a normal number. enabled = 0: all e_i = 0.
 * exponents: n entries; work: 2 n entries of int32. */
void perp__equilibrate(const perp__matrix *M, int32_t enabled, int32_t *exponents, int32_t *work);

/* 2^e, |e| <= 1022, without a call to the maths library. */
double perp__power_of_two(int32_t e);

#endif
