#include "linalg/pivoting.h"

#include <math.h>
#include <string.h>

static void exchange(double *a, double *b)
{
    const double kept = *a;

    *a = *b;
    *b = kept;
}

/* Brings the largest entry of what is left to (k,k); returns its size. */
static double bring_pivot(perp__pivoting *p, int32_t k)
{
    const size_t n = (size_t)p->n;
    size_t row = (size_t)k, column = (size_t)k, i, j;
    double largest = -1.0;

    for (i = (size_t)k; i < n; i++)
        for (j = (size_t)k; j < n; j++)
            if (fabs(p->K[i * n + j]) > largest) {
                largest = fabs(p->K[i * n + j]);
                row = i;
                column = j;
            }
    for (j = 0; j < n && row != (size_t)k; j++) {
        exchange(p->K + row * n + j, p->K + (size_t)k * n + j);
        exchange(p->E + row * n + j, p->E + (size_t)k * n + j);
    }
    if (column != (size_t)k) {
        const int32_t name = p->columns[column];

        for (i = 0; i < n; i++)
            exchange(p->K + i * n + column, p->K + i * n + (size_t)k);
        p->columns[column] = p->columns[k];
        p->columns[k] = name;
    }
    if ((row != (size_t)k) != (column != (size_t)k))
        p->sign = -p->sign;
    return largest;
}

static void eliminate(perp__pivoting *p, int32_t k)
{
    const size_t n = (size_t)p->n;
    double *pivot_row = p->K + (size_t)k * n, *unit_row = p->E + (size_t)k * n;
    const double pivot = pivot_row[k];

    if (pivot < 0.0)
        p->sign = -p->sign;
    p->product *= fabs(pivot);
    p->least = fmin(p->least, fabs(pivot));
    for (size_t j = 0; j < n; j++) {
        pivot_row[j] /= pivot;
        unit_row[j] /= pivot;
    }
    for (size_t i = 0; i < n; i++) {
        double *row = p->K + i * n, *unit = p->E + i * n;
        const double factor = row[k];

        if (i == (size_t)k || factor == 0.0)
            continue;
        for (size_t j = (size_t)k + 1; j < n; j++)
            row[j] -= factor * pivot_row[j];
        row[k] = 0.0;
        for (size_t j = 0; j < n; j++)
            unit[j] -= factor * unit_row[j];
    }
}

void perp__pivoting_eliminate(perp__pivoting *p, double singular, int32_t most)
{
    const size_t n = (size_t)p->n;

    memset(p->E, 0, n * n * sizeof *p->E);
    for (size_t i = 0; i < n; i++) {
        p->E[i * (n + 1)] = 1.0;
        p->columns[i] = (int32_t)i;
    }
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
    const size_t n = (size_t)p->n;

    for (size_t k = 0; k < n; k++) {
        double sum = 0.0;

        for (size_t r = 0; r < n && k < (size_t)p->rank; r++)
            sum += p->E[k * n + r] * b[r];
        x[p->columns[k]] = sum;
    }
}

void perp__pivoting_null(const perp__pivoting *p, double *direction, int32_t k)
{
    const size_t n = (size_t)p->n, column = (size_t)(p->rank + k);

    memset(direction, 0, n * sizeof *direction);
    direction[p->columns[column]] = 1.0;
    for (size_t l = 0; l < (size_t)p->rank; l++)
        direction[p->columns[l]] = -p->K[l * n + column];
}

void perp__pivoting_widths(const perp__pivoting *p, double *width, const double *load)
{
    const size_t n = (size_t)p->n;

    for (size_t k = 0; k < n; k++) {
        double sum = 0.0;

        for (size_t r = 0; r < n && k < (size_t)p->rank; r++)
            sum += fabs(p->E[k * n + r]) * load[r];
        width[p->columns[k]] = sum;
    }
}

int32_t perp__pivoting_is_consistent(const perp__pivoting *p, const double *b, const double *load,
                                     double tolerance)
{
    const size_t n = (size_t)p->n;

    for (size_t k = (size_t)p->rank; k < n; k++) {
        double sum = 0.0, size = 0.0;

        for (size_t r = 0; r < n; r++) {
            sum += p->E[k * n + r] * b[r];
            size += fabs(p->E[k * n + r]) * load[r];
        }
        if (!(fabs(sum) <= tolerance * size))
            return 0;
    }
    return 1;
}

static void swap_rows(double *a, double *b, int32_t n)
{
    for (int32_t j = 0; j < n; j++) {
        const double kept = a[j];

        a[j] = b[j];
        b[j] = kept;
    }
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
