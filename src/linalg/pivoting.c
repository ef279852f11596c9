#include "linalg/pivoting.h"

#include <math.h>
#include <string.h>

static void exchange(int32_t *x, int32_t i, int32_t j)
{
    const int32_t kept = x[i];

    x[i] = x[j];
    x[j] = kept;
}

static void swap_rows(double *a, double *b, int32_t n)
{
    for (int32_t j = 0; j < n; j++) {
        const double kept = a[j];

        a[j] = b[j];
        b[j] = kept;
    }
}

void perp__pivoting_eliminate(perp__pivoting *p, double singular, int32_t most)
{
    const int32_t n = p->n;
    double *K = p->K;

    for (int32_t i = 0; i < n; i++)
        p->columns[i] = p->rows[i] = i;
    p->sign = 1;
    p->product = 1.0;
    for (p->rank = 0; p->rank < n; p->rank++) {
        const int32_t k = p->rank;
        double *pivot_row = K + k * n, largest = -1.0, pivot;
        int32_t row = k, column = k;

        /* 1. The largest entry of what is left goes to (k,k). */
        for (int32_t i = k; i < n && k != most; i++)
            for (int32_t j = k; j < n; j++)
                if (fabs(K[i * n + j]) > largest) {
                    largest = fabs(K[i * n + j]);
                    row = i;
                    column = j;
                }
        if (row != k) {
            swap_rows(K + row * n, pivot_row, n);
            exchange(p->rows, row, k);
        }
        for (int32_t i = 0; i < n && column != k; i++) {
            const double moved = K[i * n + column];

            K[i * n + column] = K[i * n + k];
            K[i * n + k] = moved;
        }
        exchange(p->columns, column, k);
        if (!(largest > singular)) {
            p->sign = 0;
            break;
        }
        /* 2. The sign and the size of the determinant. */
        pivot = pivot_row[k];
        if (((row != k) != (column != k)) != (pivot < 0.0))
            p->sign = -p->sign;
        p->product *= fabs(pivot);
        /* 3. Column k is a column of E from here on. */
        pivot_row[k] = 1.0;
        for (int32_t j = 0; j < n; j++)
            pivot_row[j] /= pivot;
        for (int32_t i = 0; i < n; i++) {
            double *other = K + i * n;
            const double factor = other[k];

            if (i == k || factor == 0.0)
                continue;
            other[k] = 0.0;
            for (int32_t j = 0; j < n; j++)
                other[j] -= factor * pivot_row[j];
        }
    }
}

void perp__pivoting_solve(const perp__pivoting *p, double *x, const double *b)
{
    for (int32_t k = 0; k < p->n; k++) {
        double sum = 0.0;

        for (int32_t l = 0; l < p->rank && k < p->rank; l++)
            sum += p->K[k * p->n + l] * b[p->rows[l]];
        x[p->columns[k]] = sum;
    }
}

void perp__pivoting_null(const perp__pivoting *p, double *direction, int32_t k)
{
    const int32_t n = p->n, column = p->rank + k;

    memset(direction, 0, (size_t)n * sizeof *direction);
    direction[p->columns[column]] = 1.0;
    for (int32_t l = 0; l < p->rank; l++)
        direction[p->columns[l]] = -p->K[l * n + column];
}

void perp__pivoting_widths(const perp__pivoting *p, double *width, const double *load)
{
    for (int32_t k = 0; k < p->n; k++) {
        double sum = 0.0;

        for (int32_t l = 0; l < p->rank && k < p->rank; l++)
            sum += fabs(p->K[k * p->n + l]) * load[p->rows[l]];
        width[p->columns[k]] = sum;
    }
}

bool perp__pivoting_is_consistent(const perp__pivoting *p, const double *b, const double *load,
                                  double tolerance)
{
    for (int32_t k = p->rank; k < p->n; k++) {
        double sum = b[p->rows[k]], size = load[p->rows[k]];

        for (int32_t l = 0; l < p->rank; l++) {
            sum += p->K[k * p->n + l] * b[p->rows[l]];
            size += fabs(p->K[k * p->n + l]) * load[p->rows[l]];
        }
        if (!(fabs(sum) <= tolerance * size))
            return 0;
    }
    return 1;
}

bool perp__solve_small(const double *A, int32_t n, int32_t stride, double *X, int32_t columns)
{
    double U[6][6];
    bool regular = 1;

    for (int32_t i = 0; i < n; i++)
        memcpy(U[i], A + stride * i, (size_t)n * sizeof **U);
    /* 1. Rows below k of (U | X) lose their entry of column k. */
    for (int32_t k = 0; k < n && regular; k++) {
        int32_t pivot = k;

        for (int32_t i = k + 1; i < n; i++)
            if (fabs(U[i][k]) > fabs(U[pivot][k]))
                pivot = i;
        regular = fabs(U[pivot][k]) > 0.0;
        if (pivot != k) {
            swap_rows(U[k], U[pivot], n);
            swap_rows(X + k * columns, X + pivot * columns, columns);
        }
        for (int32_t i = k + 1; i < n && regular; i++) {
            const double factor = U[i][k] / U[k][k];

            if (factor == 0.0)
                continue;
            for (int32_t j = k + 1; j < n; j++)
                U[i][j] -= factor * U[k][j];
            for (int32_t j = 0; j < columns; j++)
                X[i * columns + j] -= factor * X[k * columns + j];
        }
    }
    if (!regular)
        memset(X, 0, (size_t)n * (size_t)columns * sizeof *X);
    /* 2. Backward substitution. */
    for (int32_t i = n; i-- > 0 && regular;)
        for (int32_t c = 0; c < columns; c++) {
            double sum = X[i * columns + c];

            for (int32_t j = i + 1; j < n; j++)
                sum -= U[i][j] * X[j * columns + c];
            X[i * columns + c] = sum / U[i][i];
        }
    return regular;
}
