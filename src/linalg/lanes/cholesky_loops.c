/* Cholesky's factorisation by the loops of loops.h, column by column. */
#include "linalg/lanes/loops.h"

#include <math.h>

/* Left-looking: column k less L(k:, :k) L(k, :k)', then divided by the root of its first entry. */
int32_t perp__loops_cholesky(int32_t n, double *A, int32_t lda)
{
    for (int32_t k = 0; k < n; k++) {
        double *column = A + (size_t)k + (size_t)k * (size_t)lda;

        perp__loops_gemv_subtract(n - k, k, A + k, lda, A + k, lda, column);
        if (!(column[0] > 0.0) || !isfinite(column[0]))
            return k + 1;
        column[0] = sqrt(column[0]);
        for (int32_t i = 1; i < n - k; i++)
            column[i] /= column[0];
    }
    return 0;
}

void perp__loops_cholesky_solve(int32_t n, int32_t columns, const double *L, int32_t lda, double *B,
                                int32_t ldb)
{
    for (int32_t j = 0; j < columns; j++) {
        double *b = B + (size_t)j * (size_t)ldb;

        for (int32_t k = 0; k < n; k++) {
            const double *column = L + (size_t)k + (size_t)k * (size_t)lda;

            b[k] /= column[0];
            perp__loops_gemv_subtract(n - k - 1, 1, column + 1, lda, b + k, 1, b + k + 1);
        }
        for (int32_t k = n - 1; k >= 0; k--) {
            const double *column = L + (size_t)k + (size_t)k * (size_t)lda;

            perp__loops_gemv_transposed_subtract(n - k - 1, 1, column + 1, lda, b + k + 1, 1,
                                                 b + k);
            b[k] /= column[0];
        }
    }
}
