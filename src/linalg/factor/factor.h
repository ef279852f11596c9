/* Factorisations of square matrices: sparse ones by KLU, dense ones by linalg/blas.h. */
#ifndef PERP_LINALG_FACTOR_H
#define PERP_LINALG_FACTOR_H

#include <perp/base.h>

/* A square matrix handed to a factorisation: CSC, with sorted columns. Where column_starts is NULL
 * it is dense, column-major with leading dimension n: perp__norm_1 takes it, KLU does not. */
typedef struct perp__square {
    int32_t n;
    const double *values;
    const int32_t *column_starts, *row_indices;
} perp__square;

typedef struct perp__factor perp__factor;

/* What a numerical factorisation found, beside the negative statuses. */
enum { PERP__FACTOR_SINGULAR = 1 };

/* Allocates for matrices of this size and pattern (values are ignored). PERP_OK or _MEMORY. */
perp_status perp__klu_analyse(perp_context *context, perp__factor **factor, const perp__square *A);

/* Takes A's pattern instead, of an order no larger than the one analysed first; the factors are
 * gone. Asks the context for no memory. PERP_OK, or PERP_ERROR_MEMORY of a third party: the factor
 * then holds a matrix of order 0 and may be tried again. */
perp_status perp__klu_reanalyse(perp__factor *factor, const perp__square *A);

/* Factors values with the analysed pattern; A is not kept. The same bits whatever was factored
 * before. PERP_OK, PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
perp_status perp__klu_factor(perp__factor *factor, const perp__square *A);

/* x := A^-1 x (transposed: A^-T x) with the last factors. */
void perp__klu_solve(perp__factor *factor, double *x, int32_t transposed);

/* NULL is allowed. */
void perp__klu_destroy(perp__factor *factor);

/* Multiplications and additions of a factorisation by KLU of what was analysed, if all pivots are
 * on the diagonal. */
double perp__klu_products(const perp__factor *factor);

/* A factorisation by KLU with room for all patterns of up to n rows: it is shown a diagonal first.
 * starts: n + 1 entries, rows: n; both of work. PERP_OK or _MEMORY. */
perp_status perp__klu_with_room(perp_context *context, perp__factor **factor, int32_t n,
                                int32_t *starts, int32_t *rows);

/* LU factors of a dense A in its place, for perp__lu_solve. PERP_OK, or PERP__FACTOR_SINGULAR also
 * where they overflow, which is of no more use than a zero pivot. */
perp_status perp__lu_factor_finite(int32_t n, double *A, int32_t *pivots);

/* ---- the condition number's estimate that all share ---- */

/* x := A^-1 x, or A^-T x. */
typedef void (*perp__solve_function)(void *user, double *x, int32_t transposed);

/* The largest sum of absolute values in a column. */
double perp__norm_1(const perp__square *A);

/* 1 / (norm ||A^-1||_1), 0 where that is not a number between 0 and 1. work: 2 n doubles. */
double perp__reciprocal_condition(int32_t n, double norm, double *work, perp__solve_function solve,
                                  void *user);

/* ---- a factorisation by KLU kept from set-up to set-up: analysed again only for another size or
 * pattern ---- */

/* All zero at first. */
typedef struct perp__cached_factor {
    perp_context *context;
    perp__factor *factor; /* NULL: nothing analysed */
    int32_t n;
    int32_t *pattern; /* column starts and row indices that were analysed */
} perp__cached_factor;

/* Analyses A's pattern unless it is the one analysed already. PERP_OK or PERP_ERROR_MEMORY, and
 * then nothing is kept. */
perp_status perp__cached_factor_analyse(perp__cached_factor *cached, perp_context *context,
                                        const perp__square *A);

void perp__cached_factor_release(perp__cached_factor *cached);

#endif
