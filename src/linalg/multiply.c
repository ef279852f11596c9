/* Products and norms in working precision, in a fixed order of summation. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/groups.h"
#include "base/outcome.h"
#include "base/sort.h"
#include "linalg/matrix.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/lanes/vectors.h"
#include "linalg/scale.h"

enum { LANES = 8 };

/* Bits of a word. */
enum { BLOCK = 64 };

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

/* Columns of zeros in x cost nothing. */
static void by_columns(const perp__matrix *M, const double *x, double *y)
{
    const size_t rows = (size_t)M->rows;
    const double *columns[4];
    double factors[4];
    size_t pending = 0, i, k;

    for (int32_t j = 0; j < M->columns; j++) {
        if (x[j] == 0.0)
            continue;
        columns[pending] = M->values + (size_t)j * M->column_stride;
        factors[pending] = x[j];
        if (++pending == 4) {
            add_4_columns(rows, columns, factors, y);
            pending = 0;
        }
    }
    for (k = 0; k < pending; k++)
        for (i = 0; i < rows; i++)
            y[i] += columns[k][i] * factors[k];
}

static void by_sparse_columns(const perp__matrix *M, const double *x, double *y)
{
    for (int32_t j = 0; j < M->columns; j++) {
        if (x[j] == 0.0)
            continue;
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            y[M->row_indices[k]] += M->values[k] * x[j];
    }
}

void perp__multiply_add(const perp__matrix *M, const double *x, double *y)
{
    if (M->column_starts)
        by_sparse_columns(M, x, y);
    else
        by_columns(M, x, y);
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

static void sparse_row_norms(const perp__matrix *M, const int32_t *e, double *sums)
{
    for (int32_t j = 0; j < M->columns; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            sums[i] += scaled(M->values[k], e[i], e[j]);
        }
}

void perp__scaled_row_norms(const perp__matrix *M, const int32_t *exponents, double *row_sums)
{
    for (int32_t i = 0; i < M->rows; i++)
        row_sums[i] = 0.0;
    if (M->column_starts)
        sparse_row_norms(M, exponents, row_sums);
    else if (M->row_stride == 1)
        add_norms(M, exponents, row_sums);
    else
        row_norms(M, exponents, row_sums);
}

/* ---- the largest entries of lines ---- */

typedef struct kernels {
    int32_t least; /* n */
    double (*raise)(size_t n, const double *line, const double *D, double own, double *across);
    void (*mark)(size_t n, const double *first, size_t stride, const double *D,
                 const double *bounds, uint64_t *bits);
} kernels;

#define TEMPLATE "linalg/lines_vector.h"
#include "linalg/lanes/each_set.h"

static const kernels *kernels_for(int32_t n)
{
    static const kernels *const sets[] = {PERP__OF_EACH_SET(&kernels)};
    int32_t k = (int32_t)perp__widest_vectors();

    while (n < sets[k]->least && k > 0)
        k--;
    return sets[k];
}

void perp__largest_entries(const perp__matrix *M, const double *D, double *in_rows,
                           double *in_columns)
{
    double *across = perp__lines_are_rows(M) ? in_columns : in_rows;
    double *along = perp__lines_are_rows(M) ? in_rows : in_columns;
    const kernels *fast = kernels_for(M->rows);

    memset(across, 0, (size_t)M->rows * sizeof *across);
    for (int32_t j = 0; j < M->rows; j++)
        along[j] = fast->raise((size_t)M->rows, perp__line_of(M, j).values, D, D[j], across);
}

/* ---- parts ---- */

/* Exponents within which no product of a number and one power of two is on the wrong side of a
 * bound of a product of two. */
#define MODERATE 200

/* Entry by entry. */
static void join_entries(const perp__matrix *M, const int32_t *exponents, double least,
                         int32_t *part)
{
    for (perp__cursor c = perp__first(M); perp__advance(&c);) {
        const int32_t e = exponents ? exponents[c.i] + exponents[c.j] : 0;

        if (part[c.i] != part[M->rows + c.j] && fabs(c.value) * perp__power_of_two(e) >= least)
            perp__join(part, c.i, M->rows + c.j);
    }
}

/* Joins lines and others that hang together within a block: line k with those of bits[k]. */
static void join_block(uint64_t *bits, int32_t count, int32_t *part, int32_t line, int32_t other)
{
    for (int32_t k = 0; k < count; k++) {
        uint64_t held = bits[k], before = 0;

        while (held != before) {
            before = held;
            for (int32_t l = k + 1; l < count; l++) {
                if ((bits[l] & held) == 0)
                    continue;
                held |= bits[l];
                bits[l] = 0;
                perp__join(part, line + k, line + l);
            }
        }
        for (int32_t b = 0; b < BLOCK && held >> b != 0; b++)
            if ((held >> b & 1) != 0)
                perp__join(part, line + k, other + b);
    }
}

static int32_t is_one_part(int32_t *part, int32_t first, int32_t count, int32_t root)
{
    int32_t k = 0;

    while (k < count && perp__root_of(part, first + k) == root)
        k++;
    return k == count;
}

/* The same of a dense matrix, a block after the other; the last ones may overlap those before. D: n
 * entries. */
static void join_lines(const perp__matrix *M, const int32_t *exponents, double least, int32_t *part,
                       double *D)
{
    const int32_t n = M->rows, lines = perp__lines_are_rows(M) ? 0 : n, others = n - lines;
    const int32_t blocks = (n + BLOCK - 1) / BLOCK;
    const int32_t width = blocks > 0 ? (n + blocks - 1) / blocks : 0;
    const size_t stride = lines == 0 ? M->row_stride : M->column_stride;
    const kernels *fast = kernels_for(n);
    double bounds[BLOCK];
    uint64_t bits[BLOCK];

    for (int32_t k = 0; k < n; k++)
        D[k] = exponents ? perp__power_of_two(exponents[k]) : 1.0;
    for (int32_t j = 0; j < n; j += width) {
        const int32_t first = j + width < n ? j : n - width;

        for (int32_t k = 0; k < width; k++)
            bounds[k] = least / D[first + k];
        for (int32_t i = 0; i < n; i += width) {
            const int32_t other = i + width < n ? i : n - width;
            const int32_t root = perp__root_of(part, lines + first);

            if (is_one_part(part, lines + first, width, root) &&
                is_one_part(part, others + other, width, root))
                continue;
            fast->mark((size_t)width, M->values + (size_t)first * stride + other, stride, D + other,
                       bounds, bits);
            join_block(bits, width, part, lines + first, others + other);
        }
    }
}

int32_t perp__find_significant_parts(const perp__matrix *M, const int32_t *exponents, double least,
                                     const int32_t *tied, int32_t *part, double *work)
{
    const int32_t n = M->rows;
    int32_t moderate = 1;

    for (int32_t i = 0; i < 2 * n; i++)
        part[i] = i;
    for (int32_t i = 0; i < n; i++) {
        moderate &= !exponents || abs(exponents[i]) <= MODERATE;
        if (tied && tied[i])
            perp__join(part, i, n + i);
    }
    if (M->column_starts || !moderate)
        join_entries(M, exponents, least, part);
    else
        join_lines(M, exponents, least, part, work);
    return perp__number_parts(part, 2 * n);
}

/* Whether one of the first rows and columns of a dense M has no zero: the column joins all rows to
 * one another, the row all columns to them. */
static int32_t is_in_one_piece(const perp__matrix *M)
{
    enum { LOOKED_AT = 4 };
    const int32_t n = M->rows;

    for (int32_t k = 0; k < n && k < LOOKED_AT && !M->column_starts; k++) {
        const double *row = M->values + (size_t)k * M->row_stride;
        const double *column = M->values + (size_t)k * M->column_stride;
        int32_t i = 0;

        while (i < n && row[(size_t)i * M->column_stride] != 0.0 &&
               column[(size_t)i * M->row_stride] != 0.0)
            i++;
        if (i == n)
            return 1;
    }
    return 0;
}

int32_t perp__find_parts(const perp__matrix *M, int32_t *part, double *work)
{
    if (is_in_one_piece(M)) {
        memset(part, 0, 2 * (size_t)M->rows * sizeof *part);
        return 1;
    }
    return perp__find_significant_parts(M, NULL, 0.0, NULL, part, work);
}
