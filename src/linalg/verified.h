/* Bounds of |A^-1 r| in which every rounding is counted, so that they hold without exception.
 *
 * The rounding mode is left alone, and is to nearest: errors are bounded beforehand (Higham,
 * "Accuracy and Stability of Numerical Algorithms", section 3.1). Each operation is taken to obey
 *   fl(a o b) = (a o b)(1 + d) + e,  |d| <= 2^-53,  |e| <= DBL_MIN;
 * e covers gradual underflow, and numbers that a caller's flush-to-zero mode takes for 0. */
#ifndef PERP_LINALG_VERIFIED_H
#define PERP_LINALG_VERIFIED_H

#include <float.h>

#include "base/arena.h"
#include "linalg/factor/factor.h"
#include "linalg/matrix.h"

/* At least gamma_k = k u / (1 - k u), u = 2^-53, and its own rounding. */
#define PERP__GAMMA(k) ((double)(k)*DBL_EPSILON)

/* An upper bound of the number whose computation with at most `operations` sums and products of
 * nonnegative numbers gave x (underflow apart). */
double perp__raise(double x, double operations);

/* The larger of the two; NaN once either is. */
double perp__larger(double a, double b);

/* a = b, in a mode that takes subnormal numbers for 0, too. */
bool perp__is_same(double a, double b);

/* y = |M| |x| in working precision. */
void perp__multiply_absolute(const perp__matrix *M, const double *x, double *y);

/* A bound of |high + low - (M x + add)| in row i for perp__multiply_doubled, without underflow, is
 * this times (|M| |x| + |add|)_i. `columns` of M. */
double perp__doubled_error(int32_t columns);

/* By an approximate inverse R with ||I - R A|| < 1: any A (Rump, "Verification methods: rigorous
 * results using floating-point arithmetic", Acta Numerica 19 (2010), section 10.1). */
typedef struct perp__verified {
    int32_t n;
    double *transposed; /* n by n: A', column by column; filled by the caller */
    double *inverse;    /* n by n: column i is row i of R */
    double *defect;     /* n by n: (I - R A)' */
    double *row_sums;   /* of |A| */
    double *alpha;      /* bounds of the row sums of |I - R A| */
    double *work;       /* 4 n */
    int32_t *pivots;
    double contraction; /* the largest alpha: below 1 A is proved regular */
} perp__verified;

void perp__verified_layout(perp__arena *arena, perp__verified *v, int32_t n);

/* Finds R and the alphas. True if A is proved regular. `transposed` stays. About 5 n^3 flops. */
bool perp__verified_factor(perp__verified *v);

/* x := R r */
void perp__verified_apply(const perp__verified *v, const double *r, double *x);

/* delta >= |A^-1 r| for every r with |r - middle| <= width; A was proved regular. */
void perp__verified_bound(const perp__verified *v, const double *middle, const double *width,
                          double *delta);

/* By a vector v > 0 with C v > 0, C the comparison matrix of A (|a_ii| on the diagonal, -|a_ij|
 * beside it): H-matrices, so M-matrices, too. |A^-1| <= C^-1 (Ostrowski 1937), and where
 * |r| <= c C v it follows that |A^-1 r| <= c v. Sparse factorisations only. */
typedef struct perp__dominance {
    int32_t n;
    perp__square A;       /* CSC; pattern and values filled by the caller */
    double *comparison;   /* values of C in A's pattern */
    double *v, *positive; /* n; lower bounds of C v */
    int32_t is_z_matrix;  /* A = C: one factorisation serves both */
    perp__cached_factor kept, kept_comparison;
} perp__dominance;

void perp__dominance_layout(perp__arena *arena, perp__dominance *d, int32_t n, int32_t entries);

/* Factors A and C. PERP_OK; PERP__FACTOR_SINGULAR where it can't be done; PERP_ERROR_MEMORY. */
perp_status perp__dominance_factor(perp__dominance *d, perp_context *context);

/* As perp__verified_bound. False if nothing is proved, regularity neither. */
bool perp__dominance_bound(perp__dominance *d, const double *middle, const double *width,
                           double *delta);

void perp__dominance_release(perp__dominance *d);

#endif
