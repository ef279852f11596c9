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

/* Brings the largest entry of what is left to (k,k); returns its size. */
static double bring_pivot(perp__pivoting *p, int32_t k)
{
    const int32_t n = p->n;
    double *K = p->K, largest = -1.0;
    int32_t row = k, column = k;

    for (int32_t i = k; i < n; i++)
        for (int32_t j = k; j < n; j++)
            if (fabs(K[i * n + j]) > largest) {
                largest = fabs(K[i * n + j]);
                row = i;
                column = j;
            }
    if (row != k) {
        swap_rows(K + row * n, K + k * n, n);
        exchange(p->rows, row, k);
    }
    for (int32_t i = 0; i < n && column != k; i++) {
        const double kept = K[i * n + column];

        K[i * n + column] = K[i * n + k];
        K[i * n + k] = kept;
    }
    exchange(p->columns, column, k);
    if ((row != k) != (column != k))
        p->sign = -p->sign;
    return largest;
}

/* Column k is a column of E from here on. */
static void eliminate(perp__pivoting *p, int32_t k)
{
    const int32_t n = p->n;
    double *pivot_row = p->K + k * n;
    const double pivot = pivot_row[k];

    if (pivot < 0.0)
        p->sign = -p->sign;
    p->product *= fabs(pivot);
    p->least = fmin(p->least, fabs(pivot));
    pivot_row[k] = 1.0;
    for (int32_t j = 0; j < n; j++)
        pivot_row[j] /= pivot;
    for (int32_t i = 0; i < n; i++) {
        double *row = p->K + i * n;
        const double factor = row[k];

        if (i == k || factor == 0.0)
            continue;
        row[k] = 0.0;
        for (int32_t j = 0; j < n; j++)
            row[j] -= factor * pivot_row[j];
    }
}

void perp__pivoting_eliminate(perp__pivoting *p, double singular, int32_t most)
{
    for (int32_t i = 0; i < p->n; i++)
        p->columns[i] = p->rows[i] = i;
    p->sign = 1;
    p->product = 1.0;
    p->least = INFINITY;
    for (p->rank = 0; p->rank < p->n; p->rank++) {
        if (p->rank == most || !(bring_pivot(p, p->rank) > singular)) {
            p->sign = 0;
            return;
        }
        eliminate(p, p->rank);
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

int32_t perp__pivoting_is_consistent(const perp__pivoting *p, const double *b, const double *load,
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

/* Rows below k of (U | X) lose their entry of column k. */
static int32_t eliminate_column(double (*U)[6], int32_t n, double *X, int32_t columns, int32_t k)
{
    int32_t pivot = k;

    for (int32_t i = k + 1; i < n; i++)
        if (fabs(U[i][k]) > fabs(U[pivot][k]))
            pivot = i;
    if (!(fabs(U[pivot][k]) > 0.0))
        return 0;
    if (pivot != k) {
        swap_rows(U[k], U[pivot], n);
        swap_rows(X + k * columns, X + pivot * columns, columns);
    }
    for (int32_t i = k + 1; i < n; i++) {
        const double factor = U[i][k] / U[k][k];

        if (factor == 0.0)
            continue;
        for (int32_t j = k + 1; j < n; j++)
            U[i][j] -= factor * U[k][j];
        for (int32_t j = 0; j < columns; j++)
            X[i * columns + j] -= factor * X[k * columns + j];
    }
    return 1;
}

int32_t perp__solve_small(const double *A, int32_t n, int32_t stride, double *X, int32_t columns)
{
    double U[6][6];

    for (int32_t i = 0; i < n; i++)
        memcpy(U[i], A + stride * i, (size_t)n * sizeof **U);
    for (int32_t k = 0; k < n; k++)
        if (!eliminate_column(U, n, X, columns, k)) {
            memset(X, 0, (size_t)n * (size_t)columns * sizeof *X);
            return 0;
        }
    for (int32_t i = n; i-- > 0;)
        for (int32_t c = 0; c < columns; c++) {
            double sum = X[i * columns + c];

            for (int32_t j = i + 1; j < n; j++)
                sum -= U[i][j] * X[j * columns + c];
            X[i * columns + c] = sum / U[i][i];
        }
    return 1;
}
