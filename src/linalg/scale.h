/* Symmetric equilibration by powers of two. */
#ifndef PERP_LINALG_SCALE_H
#define PERP_LINALG_SCALE_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/matrix.h"

/* log2 of an entry of the scaled matrix from which on something else in its row and column, the
 * diagonal or the coupling that gave the row its scale, is noise beside it. */
#define PERP__NOISE 40

/* Products below this, over half of an epsilon the least normal number, may have lost digits to
 * underflow, or all: what they round to is no number there. Nothing is proved by them. */
#define PERP__LEAST_PRODUCT (DBL_MIN / (DBL_EPSILON / 2.0))

/* Finds e with S = D M D, D = diag(2^e_i):
 * - a row with M_ii > 0: S_ii in [1/2, 2) (e_i depends on M_ii alone, so that scaling row and
 *   column i of M by 2^k changes e_i by exactly -k);
 * - a row with M_ii < 0: the largest of |M_ii| and its couplings to rows of the first kind to a
 *   unit;
 * - a row with M_ii = 0: its largest coupling |S_ij| or |S_ji| to rows that already have their e_j
 *   is brought into [1, 2) or as near as a power of two allows; rows are reached breadth first from
 *   those with a diagonal, and a component that has none starts at its lowest index with e = 0;
 * - a row and column of zeros: e_i = 0.
 * Where this leaves entries of 2^40 and more, a row's scale came from noise (a diagonal or a
 * coupling 2^-40 of another entry): such rows, and those without a positive diagonal, are balanced
 * towards a largest entry of 1 in row and column. All on exponents alone, so that powers of two in
 * M change nothing but e. |e_i| <= 511, so that every
 * 2^(e_i+e_j) is a normal number. enabled = 0: all e_i = 0. exponents: n entries; row_norms: n, the
 * 1-norms of the rows of S; work: 2 n entries of int32. */
void perp__equilibrate(const perp__matrix *M, int32_t enabled, int32_t *exponents,
                       double *row_norms, int32_t *work);

/* The same search alone: neither row norms nor a look at noise. */
void perp__find_exponents(const perp__matrix *M, int32_t *exponents, int32_t *work);

/* The end of perp__equilibrate, where the row norms that its search leaves reach 2^40: balances the
 * rows that have entries of that size. work: 2 n. */
void perp__balance_noise(const perp__matrix *M, int32_t *exponents, int32_t *work);

/* Goes on from `exponents` to the largest entry of every row and column near 1 (Ruiz,
 * RAL-TR-2001-034, for max(|M|, |M'|)), whatever the diagonal is.
 * work: 2 n entries. */
void perp__balance(const perp__matrix *M, int32_t *exponents, int32_t *work);

/* Rows 0 .. n - 1 and columns n .. 2 n - 1 by what hangs together: perp__find_parts. */
typedef struct perp__parts {
    int32_t n, count;
    const int32_t *of; /* 2 n */
} perp__parts;

/* omegas[i], omegas[n + j] := log2 of the power of two near max 2^exponents |q| over the part of
 * row i, of column j; 0 where that is 0. Returns whether one of them has changed; what they hold on
 * entry counts if it is `known`. of_part: work, an entry a part. */
int32_t perp__find_omegas(const perp__parts *parts, const double *q, const int32_t *exponents,
                          int32_t *of_part, int32_t *omegas, bool known);

/* 2^e, |e| <= 1022, without a call to the maths library. */
static inline double perp__power_of_two(int32_t e)
{
    const uint64_t bits = (uint64_t)(e + 1023) << 52;
    double power;

    memcpy(&power, &bits, sizeof power);
    return power;
}

/* x 2^e for any e that can come up, exact but for under- and overflow. */
static inline double perp__shift(double x, int32_t e)
{
    return e >= -1022 && e <= 1022 ? x * perp__power_of_two(e) : ldexp(x, e);
}

/* floor(log2 |x|), x finite and not zero. */
static inline int32_t perp__exponent_of(double x)
{
    uint64_t bits;

    memcpy(&bits, &x, sizeof bits);
    bits = bits >> 52 & 0x7ff;
    return bits != 0 ? (int32_t)bits - 1023 : ilogb(x);
}

#endif
