/* blas.h by the system's BLAS and LAPACK, by plain loops where a call costs more than these. */
#include "linalg/blas.h"

#include "linalg/factor/factor.h"
#include "linalg/lanes/loops.h"

/* Fortran's own symbols. Compilers pass the lengths of character arguments after all others. */
void dgemm_(const char *transa, const char *transb, const int *m, const int *n, const int *k,
            const double *alpha, const double *A, const int *lda, const double *B, const int *ldb,
            const double *beta, double *C, const int *ldc, size_t transa_length,
            size_t transb_length);
void dgemv_(const char *trans, const int *m, const int *n, const double *alpha, const double *A,
            const int *lda, const double *x, const int *incx, const double *beta, double *y,
            const int *incy, size_t trans_length);
void dgetrf_(const int *m, const int *n, double *A, const int *lda, int *pivots, int *info);
void dgetrs_(const char *trans, const int *n, const int *columns, const double *A, const int *lda,
             const int *pivots, double *B, const int *ldb, int *info, size_t trans_length);
void dpotrf_(const char *uplo, const int *n, double *A, const int *lda, int *info,
             size_t uplo_length);
void dpotrs_(const char *uplo, const int *n, const int *columns, const double *A, const int *lda,
             double *B, const int *ldb, int *info, size_t uplo_length);
void dtrsm_(const char *side, const char *uplo, const char *trans, const char *diag, const int *m,
            const int *n, const double *alpha, const double *A, const int *lda, double *B,
            const int *ldb, size_t side_length, size_t uplo_length, size_t trans_length,
            size_t diag_length);
void dtrsv_(const char *uplo, const char *trans, const char *diag, const int *n, const double *A,
            const int *lda, double *x, const int *incx, size_t uplo_length, size_t trans_length,
            size_t diag_length);

/* Multiplications below which the loops win, and the sizes for LU, Cholesky's solves and panels,
 * and its factors alone (measured against OpenBLAS). */
enum { SMALL_GEMM = 1000, SMALL_GEMV = 400, SMALL_LU = 48, SMALL_CHOLESKY = 56, SMALL_FACTOR = 96 };

static const int one = 1;
static const double minus_one = -1.0, plus_one = 1.0;

static int is_small(int32_t m, int32_t n, int32_t k, double limit)
{
    return (double)m * (double)n * (double)k < limit;
}

void perp__gemm_subtract(int32_t m, int32_t n, int32_t k, const double *A, int32_t lda,
                         const double *B, int32_t ldb, double *C, int32_t ldc)
{
    if (is_small(m, n, k, SMALL_GEMM))
        perp__loops_gemm_subtract(m, n, k, A, lda, B, ldb, C, ldc);
    else
        dgemm_("N", "N", &m, &n, &k, &minus_one, A, &lda, B, &ldb, &plus_one, C, &ldc, 1, 1);
}

void perp__gemv_subtract(int32_t m, int32_t n, const double *A, int32_t lda, const double *x,
                         double *y)
{
    if (is_small(m, n, 1, SMALL_GEMV))
        perp__loops_gemv_subtract(m, n, A, lda, x, 1, y);
    else
        dgemv_("N", &m, &n, &minus_one, A, &lda, x, &one, &plus_one, y, &one, 1);
}

void perp__gemv_transposed_subtract(int32_t m, int32_t n, const double *A, int32_t lda,
                                    const double *x, double *y)
{
    if (is_small(m, n, 1, SMALL_GEMV))
        perp__loops_gemv_transposed_subtract(m, n, A, lda, x, y);
    else
        dgemv_("T", &m, &n, &minus_one, A, &lda, x, &one, &plus_one, y, &one, 1);
}

int32_t perp__lu_factor(int32_t n, double *A, int32_t lda, int32_t *pivots)
{
    int info = 0;

    if (n <= SMALL_LU)
        return perp__loops_lu_panel(n, n, A, lda, pivots);
    dgetrf_(&n, &n, A, &lda, pivots, &info);
    return info;
}

void perp__lu_solve_columns(int32_t n, int32_t columns, const double *A, int32_t lda,
                            const int32_t *pivots, double *B, int32_t ldb, int32_t transposed)
{
    int info = 0;

    if (n <= SMALL_LU)
        perp__loops_lu_solve(n, columns, A, lda, pivots, B, ldb, transposed);
    else
        dgetrs_(transposed ? "T" : "N", &n, &columns, A, &lda, pivots, B, &ldb, &info, 1);
}

int32_t perp__cholesky_factor(int32_t n, double *A, int32_t lda)
{
    int info = 0;

    if (n <= SMALL_FACTOR)
        return perp__loops_cholesky(n, A, lda);
    dpotrf_("L", &n, A, &lda, &info, 1);
    return info;
}

int32_t perp__cholesky_panel(int32_t rows, int32_t n, double *A, int32_t lda)
{
    const int below = rows - n;
    int info = 0;

    if (n <= SMALL_CHOLESKY)
        return perp__loops_cholesky_panel(rows, n, A, lda);
    dpotrf_("L", &n, A, &lda, &info, 1);
    if (info == 0 && below > 0)
        dtrsm_("R", "L", "T", "N", &below, &n, &plus_one, A, &lda, A + n, &lda, 1, 1, 1, 1);
    return info;
}

void perp__cholesky_half_solve(int32_t n, const double *L, int32_t lda, double *x,
                               int32_t transposed)
{
    if (n <= SMALL_CHOLESKY)
        perp__loops_cholesky_half_solve(n, L, lda, x, transposed);
    else
        dtrsv_("L", transposed ? "T" : "N", "N", &n, L, &lda, x, &one, 1, 1, 1);
}

void perp__cholesky_solve(int32_t n, int32_t columns, const double *L, int32_t lda, double *B,
                          int32_t ldb)
{
    int info = 0;

    if (n <= SMALL_CHOLESKY) {
        perp__loops_cholesky_solve(n, columns, L, lda, B, ldb);
    } else if (columns == 1) { /* dpotrs would copy L for the sake of one column */
        perp__cholesky_half_solve(n, L, lda, B, 0);
        perp__cholesky_half_solve(n, L, lda, B, 1);
    } else {
        dpotrs_("L", &n, &columns, L, &lda, B, &ldb, &info, 1);
    }
}

/* int32_t is passed where Fortran's default INTEGER, C's int, is expected. */
typedef char int_is_32_bits[sizeof(int) == sizeof(int32_t) ? 1 : -1];
