/* Products and norms in working precision, in a fixed order of summation. */
#include <math.h>
#include <string.h>

#include "base/groups.h"
#include "base/outcome.h"
#include "base/sort.h"
#include "linalg/matrix.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/scale.h"

enum { LANES = 8 };

PERP__MULTIVERSION(add_4_columns,
                   (size_t rows, const double *const *a, const double *x, double *restrict y),
                   (rows, a, x, y))
{
    const double *a0 = a[0], *a1 = a[1], *a2 = a[2], *a3 = a[3];
    const double x0 = x[0], x1 = x[1], x2 = x[2], x3 = x[3];

    for (size_t i = 0; i < rows; i++)
        y[i] = (((y[i] + a0[i] * x0) + a1[i] * x1) + a2[i] * x2) + a3[i] * x3;
}

PERP__MULTIVERSION(by_rows, (const perp__matrix *M, const double *x, double *y), (M, x, y))
{
    const size_t columns = (size_t)M->columns;
    const size_t whole = columns - columns % LANES;

    for (int32_t i = 0; i < M->rows; i++) {
        const double *a = M->values + (size_t)i * M->row_stride;
        double sums[LANES] = {0.0};

        for (size_t j = 0; j < whole; j += LANES)
            for (size_t lane = 0; lane < LANES; lane++)
                sums[lane] += a[j + lane] * x[j + lane];
        for (size_t j = whole; j < columns; j++)
            sums[j - whole] += a[j] * x[j];
        y[i] = ((sums[0] + sums[1]) + (sums[2] + sums[3])) +
               ((sums[4] + sums[5]) + (sums[6] + sums[7]));
    }
}

void perp__multiply_add(const perp__matrix *M, const double *x, double *y)
{
    const size_t rows = (size_t)M->rows;
    const double *columns[4];
    double factors[4];
    size_t pending = 0;

    for (int32_t j = 0; j < M->columns; j++) {
        if (x[j] == 0.0)
            continue;
        if (M->column_starts) {
            for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
                y[M->row_indices[k]] += M->values[k] * x[j];
            continue;
        }
        columns[pending] = M->values + (size_t)j * M->column_stride;
        factors[pending] = x[j];
        if (++pending == 4) {
            add_4_columns(rows, columns, factors, y);
            pending = 0;
        }
    }
    for (size_t k = 0; k < pending; k++)
        for (size_t i = 0; i < rows; i++)
            y[i] += columns[k][i] * factors[k];
}

void perp__multiply(const perp__matrix *M, const double *x, double *y)
{
    if (!M->column_starts && M->row_stride != 1) {
        by_rows(M, x, y);
        return;
    }
    for (int32_t i = 0; i < M->rows; i++)
        y[i] = 0.0;
    perp__multiply_add(M, x, y);
}

double perp__entry(const perp__matrix *M, int32_t i, int32_t j)
{
    int32_t first, count, k;

    if (!M->column_starts)
        return M->values[(size_t)i * M->row_stride + (size_t)j * M->column_stride];
    first = M->column_starts[j];
    count = M->column_starts[j + 1] - first;
    k = count > 0 ? perp__lower_bound(M->row_indices + first, count, i) : 0;
    return k < count && M->row_indices[first + k] == i ? M->values[first + k] : 0.0;
}

void perp__transpose_csc(const perp__matrix *M, int32_t *starts, int32_t *columns, double *values)
{
    memset(starts, 0, ((size_t)M->rows + 1) * sizeof *starts);
    for (int32_t k = 0; k < M->column_starts[M->columns]; k++)
        starts[M->row_indices[k] + 1]++;
    for (int32_t i = 0; i < M->rows; i++)
        starts[i + 1] += starts[i];
    for (int32_t j = 0; j < M->columns; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t at = starts[M->row_indices[k]]++;

            columns[at] = j;
            if (values)
                values[at] = M->values[k];
        }
    /* every start has moved to where the next row begins */
    memmove(starts + 1, starts, (size_t)M->rows * sizeof *starts);
    starts[0] = 0;
}

double perp__largest_or_nan(const double *x, int32_t n)
{
    double largest = 0.0;

    for (int32_t i = 0; i < n; i++)
        perp__raise_to(&largest, fabs(x[i]));
    return largest;
}

double perp__length(const double *x, int32_t n)
{
    double length = 0.0;

    for (int32_t i = 0; i < n; i++)
        if (x[i] != 0.0)
            length = length == 0.0 ? fabs(x[i]) : hypot(length, x[i]);
    return length;
}

double perp__sum_of_sizes(const double *x, int32_t n)
{
    double sum = 0.0;

    for (int32_t i = 0; i < n; i++)
        sum += fabs(x[i]);
    return sum;
}

double perp__column_times(const perp__matrix *M, int32_t j, const double *x)
{
    const double *column = M->values + (size_t)j * M->column_stride;
    double sum = 0.0;

    if (M->column_starts)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            sum += M->values[k] * x[M->row_indices[k]];
    else
        for (int32_t i = 0; i < M->rows; i++)
            sum += column[(size_t)i * M->row_stride] * x[i];
    return sum;
}

/* |value| 2^(a + b) */
PERP__KERNEL static double scaled(double value, int32_t a, int32_t b)
{
    const uint64_t bits = (uint64_t)(int64_t)(a + b + 1023) << 52;
    double power;

    memcpy(&power, &bits, sizeof power);
    return fabs(value) * power;
}

PERP__MULTIVERSION(add_norms, (const perp__matrix *M, const int32_t *e, double *restrict sums),
                   (M, e, sums))
{
    for (int32_t j = 0; j < M->columns; j++) {
        const double *a = M->values + (size_t)j * M->column_stride;

        for (int32_t i = 0; i < M->rows; i++)
            sums[i] += scaled(a[i], e[i], e[j]);
    }
}

PERP__MULTIVERSION(row_norms, (const perp__matrix *M, const int32_t *e, double *sums), (M, e, sums))
{
    int32_t j;

    for (int32_t i = 0; i < M->rows; i++) {
        const double *a = M->values + (size_t)i * M->row_stride;
        double s[LANES] = {0.0};

        for (j = 0; j + LANES <= M->columns; j += LANES)
            for (int32_t lane = 0; lane < LANES; lane++)
                s[lane] += scaled(a[j + lane], e[i], e[j + lane]);
        for (int32_t lane = 0; j < M->columns; j++, lane++)
            s[lane] += scaled(a[j], e[i], e[j]);
        sums[i] = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    }
}

void perp__scaled_row_norms(const perp__matrix *M, const int32_t *exponents, double *row_sums)
{
    for (int32_t i = 0; i < M->rows; i++)
        row_sums[i] = 0.0;
    for (int32_t j = 0; j < M->columns && M->column_starts; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            row_sums[i] += scaled(M->values[k], exponents[i], exponents[j]);
        }
    if (!M->column_starts && M->row_stride == 1)
        add_norms(M, exponents, row_sums);
    else if (!M->column_starts)
        row_norms(M, exponents, row_sums);
}

/* ---- parts ---- */

int32_t perp__cut_parts(const perp__matrix *M, const double *rows, const double *columns,
                        double least, const int32_t *tied, int32_t *part)
{
    const int32_t n = M->rows;

    for (int32_t i = 0; i < 2 * n; i++)
        part[i] = i;
    for (int32_t i = 0; i < n && tied; i++)
        if (tied[i])
            perp__join(part, i, n + i);
    for (perp__cursor c = perp__first(M); perp__advance(&c);)
        if (part[c.i] != part[n + c.j] && fabs(c.value) >= least * (rows[c.i] * columns[c.j]))
            perp__join(part, c.i, n + c.j);
    return perp__number_parts(part, 2 * n);
}

int32_t perp__find_parts(const perp__matrix *M, int32_t *part, double *work)
{
    enum { LOOKED_AT = 4 };
    const int32_t n = M->rows;
    bool is_one = 0;

    /* most dense matrices: one of the first rows and columns has no zero. The column joins all rows
     * to one another, the row all columns to them */
    for (int32_t k = 0; k < n && k < LOOKED_AT && !M->column_starts && !is_one; k++) {
        const double *row = M->values + (size_t)k * M->row_stride;
        const double *column = M->values + (size_t)k * M->column_stride;
        int32_t i = 0;

        while (i < n && row[(size_t)i * M->column_stride] != 0.0 &&
               column[(size_t)i * M->row_stride] != 0.0)
            i++;
        is_one = i == n;
    }
    for (int32_t i = 0; i < n; i++)
        work[i] = 1.0;
    if (!is_one)
        return perp__cut_parts(M, work, work, 0.0, NULL, part);
    memset(part, 0, 2 * (size_t)n * sizeof *part);
    return 1;
}
