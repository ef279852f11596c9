/* blas.h without a BLAS (make BLAS=internal): the plain loops, blocked for the caches. Sums run in
 * the order of the unblocked loops, so that the bits depend on nothing but the numbers. */
#include "linalg/blas.h"

#include "linalg/lanes/loops.h"

/* A block of A, ROWS by DEPTH, stays in the second-level cache; a panel of LU is PANEL wide. */
enum { ROWS = 192, DEPTH = 64, PANEL = 32 };

static int32_t smaller(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static size_t at(int32_t i, int32_t j, int32_t ld)
{
    return (size_t)i + (size_t)ld * (size_t)j;
}

void perp__gemm_subtract(int32_t m, int32_t n, int32_t k, const double *A, int32_t lda,
                         const double *B, int32_t ldb, double *C, int32_t ldc)
{
    for (int32_t p = 0; p < k; p += DEPTH)
        for (int32_t i = 0; i < m; i += ROWS)
            perp__loops_gemm_subtract(smaller(ROWS, m - i), n, smaller(DEPTH, k - p),
                                      A + at(i, p, lda), lda, B + p, ldb, C + i, ldc);
}

void perp__gemv_subtract(int32_t m, int32_t n, const double *A, int32_t lda, const double *x,
                         double *y)
{
    perp__loops_gemv_subtract(m, n, A, lda, x, 1, y);
}

void perp__gemv_transposed_subtract(int32_t m, int32_t n, const double *A, int32_t lda,
                                    const double *x, double *y)
{
    perp__loops_gemv_transposed_subtract(m, n, A, lda, x, y);
}

/* Row exchanges `from` to `to` - 1 on the columns `begin` to `end` - 1. */
static void exchange(double *A, int32_t lda, int32_t begin, int32_t end, const int32_t *pivots,
                     int32_t from, int32_t to)
{
    for (int32_t j = begin; j < end; j++) {
        double *a = A + at(0, j, lda);

        for (int32_t k = from; k < to; k++) {
            const double kept = a[k];

            a[k] = a[pivots[k] - 1];
            a[pivots[k] - 1] = kept;
        }
    }
}

/* Right-looking: factor a panel, bring the block of rows right of it up to date, then the rest. */
int32_t perp__lu_factor(int32_t n, double *A, int32_t lda, int32_t *pivots)
{
    int32_t zero_pivot = 0, k, i;

    for (k = 0; k < n; k += PANEL) {
        const int32_t width = smaller(PANEL, n - k), next = k + width;
        double *panel = A + at(k, k, lda), *right;
        const int32_t found = perp__loops_lu_panel(n - k, width, panel, lda, pivots + k);

        if (found != 0 && zero_pivot == 0)
            zero_pivot = k + found;
        for (i = k; i < next; i++)
            pivots[i] += k;
        exchange(A, lda, 0, k, pivots, k, next);
        exchange(A, lda, next, n, pivots, k, next);
        if (next == n)
            break;
        right = A + at(k, next, lda);
        perp__loops_solve_unit_lower(width, n - next, panel, lda, right, lda);
        perp__gemm_subtract(n - next, n - next, width, panel + width, lda, right, lda,
                            right + width, lda);
    }
    return zero_pivot;
}

void perp__lu_solve_columns(int32_t n, int32_t columns, const double *A, int32_t lda,
                            const int32_t *pivots, double *B, int32_t ldb, int32_t transposed)
{
    perp__loops_lu_solve(n, columns, A, lda, pivots, B, ldb, transposed);
}

/* Left-looking: bring a panel up to date, factor its square, divide the rows below by that. The
 * panel's strict upper triangle is put aside meanwhile. */
int32_t perp__cholesky_panel(int32_t rows, int32_t n, double *A, int32_t lda)
{
    double above[PANEL * PANEL], slice[DEPTH * PANEL];

    for (int32_t k = 0; k < n; k += PANEL) {
        const int32_t width = smaller(PANEL, n - k);
        double *square = A + at(k, k, lda), *below = square + width;
        int32_t found;

        for (int32_t j = 0; j < width; j++)
            for (int32_t i = 0; i < j; i++)
                above[at(i, j, PANEL)] = square[at(i, j, lda)];
        /* A(k:, k:next) -= L(k:, :k) L(k:next, :k)', the second factor copied in slices */
        for (int32_t p = 0; p < k; p += DEPTH) {
            const int32_t depth = smaller(DEPTH, k - p);

            for (int32_t i = 0; i < depth; i++)
                for (int32_t j = 0; j < width; j++)
                    slice[at(i, j, DEPTH)] = A[at(k + j, p + i, lda)];
            perp__gemm_subtract(rows - k, width, depth, A + at(k, p, lda), lda, slice, DEPTH,
                                square, lda);
        }
        for (int32_t j = 0; j < width; j++)
            for (int32_t i = 0; i < j; i++)
                square[at(i, j, lda)] = above[at(i, j, PANEL)];
        found = perp__loops_cholesky(width, square, lda);
        if (found != 0)
            return k + found;
        for (int32_t j = 0; j < width; j++) {
            double *column = below + at(0, j, lda);

            perp__loops_gemv_subtract(rows - k - width, j, below, lda, square + j, lda, column);
            for (int32_t p = 0; p < rows - k - width; p++)
                column[p] /= square[at(j, j, lda)];
        }
    }
    return 0;
}

int32_t perp__cholesky_factor(int32_t n, double *A, int32_t lda)
{
    return perp__cholesky_panel(n, n, A, lda);
}

void perp__cholesky_half_solve(int32_t n, const double *L, int32_t lda, double *x,
                               int32_t transposed)
{
    perp__loops_cholesky_half_solve(n, L, lda, x, transposed);
}

void perp__cholesky_solve(int32_t n, int32_t columns, const double *L, int32_t lda, double *B,
                          int32_t ldb)
{
    perp__loops_cholesky_solve(n, columns, L, lda, B, ldb);
}
