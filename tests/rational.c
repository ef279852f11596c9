#include "rational.h"

/* Products of two minors. */
__extension__ typedef __int128 wide;

static void exchange_rows(int64_t *a, int64_t *b, int count)
{
    int k;

    for (k = 0; k < count; k++) {
        int64_t kept = a[k];

        a[k] = b[k];
        b[k] = kept;
    }
}

/* Bareiss, "Sylvester's identity and multistep integer-preserving Gaussian elimination", Math.
 * Comp. 22 (1968), on all rows (Jordan): after step k every entry is a minor of order k, so the
 * divisions leave no remainder. */
static int64_t eliminate(int n, int64_t T[][RATIONAL_LARGEST + 1])
{
    int64_t last = 1;
    int i, j, k;

    for (k = 0; k < n; k++) {
        for (i = k; i < n && T[i][k] == 0; i++)
            ;
        if (i == n)
            return 0;
        exchange_rows(T[i], T[k], n + 1);
        for (i = 0; i < n; i++) {
            if (i == k)
                continue;
            for (j = 0; j <= n; j++)
                if (j != k)
                    T[i][j] = (int64_t)(((wide)T[k][k] * T[i][j] - (wide)T[i][k] * T[k][j]) / last);
            T[i][k] = 0;
        }
        last = T[k][k];
    }
    return last;
}

int64_t rational_solve(int n, const int64_t *A, const int64_t *b, int64_t *numerators)
{
    int64_t T[RATIONAL_LARGEST][RATIONAL_LARGEST + 1], determinant;
    int i, j;

    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++)
            T[i][j] = A[i * n + j];
        T[i][n] = b[i];
    }
    determinant = eliminate(n, T);
    for (i = 0; i < n; i++)
        numerators[i] = determinant < 0 ? -T[i][n] : T[i][n];
    return determinant < 0 ? -determinant : determinant;
}

int rational_basic_solution(int n, const int *M, const int *q, unsigned set, int64_t *numerators,
                            int64_t *denominator)
{
    int64_t A[RATIONAL_LARGEST * RATIONAL_LARGEST] = {0}, b[RATIONAL_LARGEST] = {0};
    int64_t x[RATIONAL_LARGEST];
    int active[RATIONAL_LARGEST], count = 0, i, j;

    for (i = 0; i < n; i++)
        if (set >> i & 1u)
            active[count++] = i;
    for (i = 0; i < count; i++) {
        for (j = 0; j < count; j++)
            A[i * count + j] = M[active[i] * n + active[j]];
        b[i] = -q[active[i]];
    }
    *denominator = rational_solve(count, A, b, x);
    if (*denominator == 0)
        return 0;
    for (i = 0; i < n; i++)
        numerators[i] = 0;
    for (i = 0; i < count; i++) {
        if (x[i] < 0)
            return 0;
        numerators[active[i]] = x[i];
    }
    for (i = 0; i < n; i++) {
        int64_t w = q[i] * *denominator;

        for (j = 0; j < n; j++)
            w += M[i * n + j] * numerators[j];
        if (w < 0)
            return 0;
    }
    return 1;
}
