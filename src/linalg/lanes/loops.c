#include "linalg/lanes/loops.h"

#include <math.h>

#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

PERP__MULTIVERSION_SHARED(perp__loops_dot,
                          (int32_t n, const double *a, const double *b, double *result),
                          (n, a, b, result))
{
    *result = perp__lanes_dot(a, b, n);
}

enum { LANES = 8, FEW = 12, MOST = 48 };

static const double *column(const double *A, int32_t lda, int32_t j)
{
    return A + (size_t)lda * (size_t)j;
}

/* y := y - x0 a0 - x1 a1 - x2 a2 - x3 a3, from left to right. */
PERP__KERNEL static void subtract_4_loops(size_t m, const double *a, size_t lda, const double *x,
                                          size_t incx, double *restrict y)
{
    const double *a0 = a, *a1 = a + lda, *a2 = a + 2 * lda, *a3 = a + 3 * lda;
    const double x0 = x[0], x1 = x[incx], x2 = x[2 * incx], x3 = x[3 * incx];

    for (size_t i = 0; i < m; i++)
        y[i] = (((y[i] - a0[i] * x0) - a1[i] * x1) - a2[i] * x2) - a3[i] * x3;
}

PERP__MULTIVERSION(subtract_1, (size_t m, const double *a, double x, double *restrict y),
                   (m, a, x, y))
{
    for (size_t i = 0; i < m; i++)
        y[i] -= a[i] * x;
}

PERP__MULTIVERSION(subtract_product,
                   (size_t m, size_t n, const double *A, size_t lda, const double *x, size_t incx,
                    double *y),
                   (m, n, A, lda, x, incx, y))
{
    size_t j;

    for (j = 0; j + 4 <= n; j += 4)
        subtract_4_loops(m, A + j * lda, lda, x + j * incx, incx, y);
    for (; j < n; j++)
        subtract_1_loops(m, A + j * lda, x[j * incx], y);
}

void perp__loops_gemv_subtract(int32_t m, int32_t n, const double *A, int32_t lda, const double *x,
                               int32_t incx, double *y)
{
    subtract_product((size_t)m, (size_t)n, A, (size_t)lda, x, (size_t)incx, y);
}

/* Two columns of C minus four of A times a 4 by 2 block of B; each entry's order of summation is
 * that of subtract_4. */
PERP__MULTIVERSION(subtract_4_by_2,
                   (size_t m, const double *a, size_t lda, const double *b, size_t ldb,
                    double *restrict c, double *restrict d),
                   (m, a, lda, b, ldb, c, d))
{
    const double *a0 = a, *a1 = a + lda, *a2 = a + 2 * lda, *a3 = a + 3 * lda;
    const double b0 = b[0], b1 = b[1], b2 = b[2], b3 = b[3];
    const double d0 = b[ldb], d1 = b[ldb + 1], d2 = b[ldb + 2], d3 = b[ldb + 3];

    for (size_t i = 0; i < m; i++) {
        c[i] = (((c[i] - a0[i] * b0) - a1[i] * b1) - a2[i] * b2) - a3[i] * b3;
        d[i] = (((d[i] - a0[i] * d0) - a1[i] * d1) - a2[i] * d2) - a3[i] * d3;
    }
}

void perp__loops_gemm_subtract(int32_t m, int32_t n, int32_t k, const double *A, int32_t lda,
                               const double *B, int32_t ldb, double *C, int32_t ldc)
{
    int32_t j, p;

    for (j = 0; j + 2 <= n; j += 2) {
        const double *b = column(B, ldb, j);
        double *c = C + (size_t)ldc * (size_t)j, *d = c + ldc;

        for (p = 0; p + 4 <= k; p += 4)
            subtract_4_by_2((size_t)m, column(A, lda, p), (size_t)lda, b + p, (size_t)ldb, c, d);
        for (; p < k; p++) {
            subtract_1((size_t)m, column(A, lda, p), b[p], c);
            subtract_1((size_t)m, column(A, lda, p), b[(size_t)ldb + (size_t)p], d);
        }
    }
    if (j < n)
        perp__loops_gemv_subtract(m, k, A, lda, column(B, ldb, j), 1, C + (size_t)ldc * (size_t)j);
}

/* a' x, x contiguous */
PERP__KERNEL static double sum_of_lanes(size_t m, const double *a, const double *x)
{
    const size_t whole = m - m % LANES;
    double s[LANES] = {0.0};

    for (size_t i = 0; i < whole; i += LANES)
        for (size_t lane = 0; lane < LANES; lane++)
            s[lane] += a[i + lane] * x[i + lane];
    for (size_t i = whole; i < m; i++)
        s[i - whole] += a[i] * x[i];
    return ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
}

PERP__MULTIVERSION(subtract_dots,
                   (size_t m, size_t n, const double *A, size_t lda, const double *x, double *y),
                   (m, n, A, lda, x, y))
{
    for (size_t j = 0; j < n; j++)
        y[j] -= sum_of_lanes(m, A + j * lda, x);
}

void perp__loops_gemv_transposed_subtract(int32_t m, int32_t n, const double *A, int32_t lda,
                                          const double *x, double *y)
{
    subtract_dots((size_t)m, (size_t)n, A, (size_t)lda, x, y);
}

static void swap_entries(double *x, int32_t i, int32_t k)
{
    const double kept = x[i];

    x[i] = x[k];
    x[k] = kept;
}

PERP__MULTIVERSION(lu_panel,
                   (int32_t m, int32_t n, double *A, int32_t lda, int32_t *pivots,
                    int32_t *zero_pivot),
                   (m, n, A, lda, pivots, zero_pivot))
{
    for (int32_t k = 0; k < n; k++) {
        double *a = A + (size_t)lda * (size_t)k;
        int32_t p = k;
        double pivot;

        for (int32_t i = k + 1; i < m; i++) /* the first of several that are as large */
            if (fabs(a[i]) > fabs(a[p]))
                p = i;
        pivot = a[p];
        pivots[k] = p + 1;
        for (int32_t j = 0; j < n && p != k; j++)
            swap_entries(A + (size_t)lda * (size_t)j, p, k);
        if (pivot == 0.0) {
            if (*zero_pivot == 0)
                *zero_pivot = k + 1;
            continue;
        }
        for (int32_t i = k + 1; i < m; i++)
            a[i] /= pivot;
        for (int32_t j = k + 1; j < n; j++) {
            double *b = A + (size_t)lda * (size_t)j;

            if (b[k] != 0.0)
                subtract_1_loops((size_t)(m - k - 1), a + k + 1, b[k], b + k + 1);
        }
    }
}

int32_t perp__loops_lu_panel(int32_t m, int32_t n, double *A, int32_t lda, int32_t *pivots)
{
    int32_t zero_pivot = 0;

    lu_panel(m, n, A, lda, pivots, &zero_pivot);
    return zero_pivot;
}

PERP__MULTIVERSION_SHARED(perp__loops_solve_unit_lower,
                          (int32_t n, int32_t columns, const double *A, int32_t lda, double *B,
                           int32_t ldb),
                          (n, columns, A, lda, B, ldb))
{
    for (int32_t j = 0; j < columns; j++) {
        double *b = B + (size_t)ldb * (size_t)j;

        for (int32_t k = 0; k < n; k++)
            if (b[k] != 0.0)
                subtract_1_loops((size_t)(n - k - 1), column(A, lda, k) + k + 1, b[k], b + k + 1);
    }
}

/* P A = L U: x := U^-1 L^-1 P x */
PERP__MULTIVERSION(solve,
                   (int32_t n, const double *A, int32_t lda, const int32_t *pivots, double *x),
                   (n, A, lda, pivots, x))
{
    for (int32_t k = 0; k < n; k++)
        swap_entries(x, k, pivots[k] - 1);
    perp__loops_solve_unit_lower_loops(n, 1, A, lda, x, n);
    for (int32_t k = n - 1; k >= 0; k--) {
        x[k] /= column(A, lda, k)[k];
        if (x[k] != 0.0)
            subtract_1_loops((size_t)k, column(A, lda, k), x[k], x);
    }
}

/* The same of some columns side by side: with the bits of each alone. */
PERP__MULTIVERSION(solve_together,
                   (int32_t n, int32_t columns, const double *A, int32_t lda, const int32_t *pivots,
                    double *B, int32_t ldb),
                   (n, columns, A, lda, pivots, B, ldb))
{
    double x[MOST * MOST];

    for (int32_t j = 0; j < columns; j++)
        for (int32_t i = 0; i < n; i++)
            x[i * columns + j] = column(B, ldb, j)[i];
    for (int32_t k = 0; k < n; k++)
        for (int32_t j = 0; j < columns && pivots[k] - 1 != k; j++)
            swap_entries(x, k * columns + j, (pivots[k] - 1) * columns + j);
    for (int32_t k = 0; k < n; k++)
        for (int32_t i = k + 1; i < n; i++)
            subtract_1_loops((size_t)columns, x + k * columns, column(A, lda, k)[i],
                             x + i * columns);
    for (int32_t k = n - 1; k >= 0; k--) {
        for (int32_t j = 0; j < columns; j++)
            x[k * columns + j] /= column(A, lda, k)[k];
        for (int32_t i = 0; i < k; i++)
            subtract_1_loops((size_t)columns, x + k * columns, column(A, lda, k)[i],
                             x + i * columns);
    }
    for (int32_t j = 0; j < columns; j++)
        for (int32_t i = 0; i < n; i++)
            B[(size_t)ldb * (size_t)j + (size_t)i] = x[i * columns + j];
}

/* P A = L U: x := P' L^-T U^-T x */
static void solve_transposed(int32_t n, const double *A, int32_t lda, const int32_t *pivots,
                             double *x)
{
    for (int32_t k = 0; k < n; k++) {
        const double *a = column(A, lda, k);

        subtract_dots((size_t)k, 1, a, (size_t)lda, x, x + k);
        x[k] /= a[k];
    }
    for (int32_t k = n - 1; k >= 0; k--) {
        const double *a = column(A, lda, k);

        subtract_dots((size_t)(n - k - 1), 1, a + k + 1, (size_t)lda, x + k + 1, x + k);
    }
    for (int32_t k = n - 1; k >= 0; k--)
        swap_entries(x, k, pivots[k] - 1);
}

void perp__loops_lu_solve(int32_t n, int32_t columns, const double *A, int32_t lda,
                          const int32_t *pivots, double *B, int32_t ldb, int32_t transposed)
{
    const int32_t together = transposed || n > MOST ? 1 : MOST;

    for (int32_t j = 0; j < columns; j += together, B += (size_t)ldb * (size_t)together) {
        const int32_t count = columns - j < together ? columns - j : together;

        if (transposed)
            solve_transposed(n, A, lda, pivots, B);
        else if (count == 1)
            solve(n, A, lda, pivots, B);
        else
            solve_together(n, count, A, lda, pivots, B, ldb);
    }
}

/* ---- Cholesky's factorisation, column by column ---- */

/* Left-looking: column k less L(k:, :k) L(k, :k)', then divided by the root of its first entry.
 * *wrong: the column whose pivot is not positive, from 1 on; or 0. */
PERP__MULTIVERSION(cholesky, (size_t rows, size_t n, double *A, size_t lda, int32_t *wrong),
                   (rows, n, A, lda, wrong))
{
    *wrong = 0;
    for (size_t k = 0; k < n; k++) {
        double *column = A + k + k * lda, root;

        subtract_product_loops(rows - k, k, A + k, lda, A + k, lda, column);
        if (!(column[0] > 0.0) || !isfinite(column[0])) {
            *wrong = (int32_t)k + 1;
            return;
        }
        root = column[0] = sqrt(column[0]);
        for (size_t i = 1; i < rows - k; i++)
            column[i] /= root;
    }
}

int32_t perp__loops_cholesky(int32_t n, double *A, int32_t lda)
{
    if (n > FEW)
        return perp__loops_cholesky_panel(n, n, A, lda);
    /* entry by entry, where vectors would not be filled: the same sums in the same order */
    for (size_t k = 0; k < (size_t)n; k++)
        for (size_t i = k; i < (size_t)n; i++) {
            double x = A[i + k * (size_t)lda];

            for (size_t j = 0; j < k; j++)
                x -= A[i + j * (size_t)lda] * A[k + j * (size_t)lda];
            if (i == k && (!(x > 0.0) || !isfinite(x)))
                return (int32_t)k + 1;
            A[i + k * (size_t)lda] = i == k ? sqrt(x) : x / A[k + k * (size_t)lda];
        }
    return 0;
}

int32_t perp__loops_cholesky_panel(int32_t rows, int32_t n, double *A, int32_t lda)
{
    int32_t wrong;

    cholesky((size_t)rows, (size_t)n, A, (size_t)lda, &wrong);
    return wrong;
}

PERP__MULTIVERSION(cholesky_half_solve,
                   (size_t n, const double *L, size_t lda, double *b, int32_t transposed),
                   (n, L, lda, b, transposed))
{
    for (size_t k = 0; k < n && !transposed; k++) {
        const double *column = L + k + k * lda;

        b[k] /= column[0];
        subtract_1_loops(n - k - 1, column + 1, b[k], b + k + 1);
    }
    for (size_t k = n; k-- > 0 && transposed;) {
        const double *column = L + k + k * lda;

        b[k] = (b[k] - sum_of_lanes(n - k - 1, column + 1, b + k + 1)) / column[0];
    }
}

void perp__loops_cholesky_half_solve(int32_t n, const double *L, int32_t lda, double *x,
                                     int32_t transposed)
{
    cholesky_half_solve((size_t)n, L, (size_t)lda, x, transposed);
}

void perp__loops_cholesky_solve(int32_t n, int32_t columns, const double *L, int32_t lda, double *B,
                                int32_t ldb)
{
    const size_t few = n <= FEW ? (size_t)n : 0, apart = (size_t)lda;

    for (int32_t j = 0; j < columns; j++) {
        double *b = B + (size_t)j * (size_t)ldb;

        for (size_t k = 0; k < few; k++) {
            double x = b[k];

            for (size_t i = 0; i < k; i++)
                x -= L[k + i * apart] * b[i];
            b[k] = x / L[k + k * apart];
        }
        for (size_t k = few; k-- > 0;) {
            double x = b[k];

            for (size_t i = k + 1; i < few; i++)
                x -= L[i + k * apart] * b[i];
            b[k] = x / L[k + k * apart];
        }
        for (int32_t half = 0; half < 2 && n > FEW; half++)
            cholesky_half_solve((size_t)n, L, apart, b, half);
    }
}
