/* Plain loops for what blas.h promises: below a certain size cheaper than a call to a BLAS, and the
 * building blocks of blas_internal.c. The order of every sum is fixed. Pivots count from 1. */
#ifndef PERP_LINALG_LOOPS_H
#define PERP_LINALG_LOOPS_H

#include <stddef.h>
#include <stdint.h>

/* *result := a'b */
void perp__loops_dot(int32_t n, const double *a, const double *b, double *result);
/* C := C - A B; A is m by k, B is k by n. */
void perp__loops_gemm_subtract(int32_t m, int32_t n, int32_t k, const double *A, int32_t lda,
                               const double *B, int32_t ldb, double *C, int32_t ldc);
/* y := y - A x, where x is read with stride incx, and y := y - A' x; A is m by n. */
void perp__loops_gemv_subtract(int32_t m, int32_t n, const double *A, int32_t lda, const double *x,
                               int32_t incx, double *y);
void perp__loops_gemv_transposed_subtract(int32_t m, int32_t n, const double *A, int32_t lda,
                                          const double *x, double *y);
/* LU with partial pivoting of an m by n panel, n <= m; returns 0, or the 1-based index of the first
 * zero pivot (the factorisation is completed nevertheless). */
int32_t perp__loops_lu_panel(int32_t m, int32_t n, double *A, int32_t lda, int32_t *pivots);
/* B := L^-1 B with the unit lower triangle L of A, n by n; B has `columns` columns. */
void perp__loops_solve_unit_lower(int32_t n, int32_t columns, const double *A, int32_t lda,
                                  double *B, int32_t ldb);
/* B := A^-1 B, or A^-T B; B has `columns` columns. */
void perp__loops_lu_solve(int32_t n, int32_t columns, const double *A, int32_t lda,
                          const int32_t *pivots, double *B, int32_t ldb, int32_t transposed);
/* A = L L', B := A^-1 B and their parts as in blas.h. */
int32_t perp__loops_cholesky_panel(int32_t rows, int32_t n, double *A, int32_t lda);
void perp__loops_cholesky_half_solve(int32_t n, const double *L, int32_t lda, double *x,
                                     int32_t transposed);
int32_t perp__loops_cholesky(int32_t n, double *A, int32_t lda);
void perp__loops_cholesky_solve(int32_t n, int32_t columns, const double *L, int32_t lda, double *B,
                                int32_t ldb);

#endif
