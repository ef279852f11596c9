/* The BLAS and LAPACK routines that the kernels use, under one roof: blas.c calls the system's,
 * blas_internal.c (make BLAS=internal) has fixed-order loops of our own that give the same bits
 * whatever BLAS is installed. All matrices column-major. */
#ifndef PERP_LINALG_BLAS_H
#define PERP_LINALG_BLAS_H

#include <stdint.h>

/* C := C - A B; A is m by k, B is k by n. */
void perp__gemm_subtract(int32_t m, int32_t n, int32_t k, const double *A, int32_t lda,
                         const double *B, int32_t ldb, double *C, int32_t ldc);
/* y := y - A x, and y := y - A' x; A is m by n. */
void perp__gemv_subtract(int32_t m, int32_t n, const double *A, int32_t lda, const double *x,
                         double *y);
void perp__gemv_transposed_subtract(int32_t m, int32_t n, const double *A, int32_t lda,
                                    const double *x, double *y);
/* LU with partial pivoting in place; returns 0, or the 1-based index of a zero pivot. */
int32_t perp__lu_factor(int32_t n, double *A, int32_t lda, int32_t *pivots);
/* B := A^-1 B, or A^-T B; B has `columns` columns. */
void perp__lu_solve_columns(int32_t n, int32_t columns, const double *A, int32_t lda,
                            const int32_t *pivots, double *B, int32_t ldb, int32_t transposed);
static inline void perp__lu_solve(int32_t n, const double *A, int32_t lda, const int32_t *pivots,
                                  double *x, int32_t transposed)
{
    perp__lu_solve_columns(n, 1, A, lda, pivots, x, n, transposed);
}
/* A = L L' by the lower triangle of A, which L replaces; the rest of A is neither read nor written.
 * Returns 0, or the 1-based index of the first pivot that is not positive. */
int32_t perp__cholesky_factor(int32_t n, double *A, int32_t lda);
/* The same of the square on top of `rows` by n, and what is below it, B, becomes B L^-T. */
int32_t perp__cholesky_panel(int32_t rows, int32_t n, double *A, int32_t lda);
/* x := L^-1 x, or L^-T x. */
void perp__cholesky_half_solve(int32_t n, const double *L, int32_t lda, double *x,
                               int32_t transposed);
/* B := A^-1 B with that L; B has `columns` columns. */
void perp__cholesky_solve(int32_t n, int32_t columns, const double *L, int32_t lda, double *B,
                          int32_t ldb);

#endif
