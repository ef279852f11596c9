/* Tridiagonal matrices: LU factors with partial pivoting, as LAPACK's xGTTRF computes them. */
#ifndef PERP_LINALG_TRIDIAGONAL_H
#define PERP_LINALG_TRIDIAGONAL_H

#include "base/arena.h"
#include "linalg/matrix.h"

typedef struct perp__tridiagonal {
    int32_t n;
    double *below;    /* n: entry (i+1, i), the last one unused */
    double *diagonal; /* n */
    double *above;    /* n: entry (i, i+1), the last one unused */
} perp__tridiagonal;

/* Row i of U: pivots (stored as reciprocals), above, second; L by multipliers and exchanges. */
typedef struct perp__tridiagonal_factor {
    int32_t n;
    double *multipliers, *pivots, *above, *second;
    int8_t *exchanged;
} perp__tridiagonal_factor;

/* True if M is CSC and has no entry beyond the diagonals next to the main one. Cost: O(n). */
bool perp__is_tridiagonal(const perp__matrix *M);

void perp__tridiagonal_layout(perp__arena *arena, perp__tridiagonal *T, size_t n);

/* T = M, which is tridiagonal. */
void perp__tridiagonal_read(perp__tridiagonal *T, const perp__matrix *M);

void perp__tridiagonal_factor_layout(perp__arena *arena, perp__tridiagonal_factor *factor,
                                     size_t n);

/* Factors the block of T with the rows and columns active[0] < active[1] < ..., plus rho I. Returns
 * 0 if a pivot is zero or not finite. */
int32_t perp__tridiagonal_factorise(perp__tridiagonal_factor *factor, const perp__tridiagonal *T,
                                    const int32_t *active, int32_t count, double rho);

/* x := block^-1 x, `count` entries. */
void perp__tridiagonal_solve(const perp__tridiagonal_factor *factor, double *x);

/* x := block^-T x */
void perp__tridiagonal_solve_transposed(const perp__tridiagonal_factor *factor, double *x);

#endif
