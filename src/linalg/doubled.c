/* Matrix times vector in doubled precision.
 *
 * Every product is split without error into p + e by fma() (two_product), every addition to the
 * running sum into s + t (two_sum), and the errors e + t are summed beside it: the dot product of
 * Ogita, Rump & Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005), algorithm
 * 5.3. The pair is what remains of the exact sum but for a relative (n eps)^2 of |M||x|.
 *
 * Where a sum overflows its high part is infinite or NaN. */
#include "linalg/doubled.h"

#include <string.h>

#include "linalg/lanes/multiversion.h"
#include "linalg/matrix.h"

/* Rows of a matrix by rows that are added side by side. */
enum { TOGETHER = 8 };

/* One pair for one value: |low| <= ulp(high) / 2. An error that overflowed, where its sum did not,
 * shows in high. */
PERP__KERNEL static void join_one(double *high, double *low)
{
    const double sum = *high + *low;
    const double part = sum - *high;
    const double rest = (*high - (sum - part)) + (*low - part);

    *high = *high - *high == 0.0 ? sum : *high;
    *low = sum - sum == 0.0 ? rest : 0.0;
}

/* high + low += that many columns, each times its factor, one after the other in each row. */
PERP__KERNEL static void add_columns(const double *const *column, const double *factors,
                                     size_t count, size_t rows, double *restrict high,
                                     double *restrict low)
{
    for (size_t i = 0; i < rows; i++) {
        double h = high[i], l = low[i];

        for (size_t k = 0; k < count; k++)
            perp__accumulate(&h, &l, column[k][i], factors[k]);
        high[i] = h;
        low[i] = l;
    }
}

/* Four columns at a time stay in registers; those that x leaves out are. */
PERP__MULTIVERSION(by_columns, (const perp__matrix *M, const double *x, double *high, double *low),
                   (M, x, high, low))
{
    const double *column[4];
    double factors[4];
    size_t count = 0;

    for (int32_t j = 0; j < M->columns; j++) {
        column[count] = M->values + (size_t)j * M->column_stride;
        factors[count] = x[j];
        count += x[j] != 0.0; /* no branch, which nobody foresees */
        if (count == 4) {
            add_columns(column, factors, 4, (size_t)M->rows, high, low);
            count = 0;
        }
    }
    for (size_t k = 0; k < count; k++)
        add_columns(column + k, factors + k, 1, (size_t)M->rows, high, low);
}

/* Eight rows side by side: each adds its products one by one. */
PERP__MULTIVERSION(by_rows, (const perp__matrix *M, const double *x, double *high, double *low),
                   (M, x, high, low))
{
    for (int32_t i = 0; i < M->rows; i += TOGETHER) {
        const int32_t count = M->rows - i < TOGETHER ? M->rows - i : TOGETHER;
        const double *a = M->values + (size_t)i * M->row_stride;
        double h[TOGETHER] = {0.0}, l[TOGETHER] = {0.0};

        memcpy(h, high + i, (size_t)count * sizeof *h);
        for (int32_t j = 0; j < M->columns; j++, a++) {
            double entries[TOGETHER];

            if (x[j] == 0.0)
                continue;
            for (int32_t r = 0; r < TOGETHER; r++)
                entries[r] = a[(size_t)(r < count ? r : 0) * M->row_stride];
            for (int32_t r = 0; r < TOGETHER; r++)
                perp__accumulate(h + r, l + r, entries[r], x[j]);
        }
        memcpy(high + i, h, (size_t)count * sizeof *h);
        memcpy(low + i, l, (size_t)count * sizeof *l);
    }
}

PERP__MULTIVERSION(by_sparse_columns,
                   (const perp__matrix *M, const double *x, double *high, double *low),
                   (M, x, high, low))
{
    for (int32_t j = 0; j < M->columns; j++) {
        const double factor = x[j];

        if (factor == 0.0)
            continue;
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            perp__accumulate(high + i, low + i, M->values[k], factor);
        }
    }
}

PERP__MULTIVERSION(join, (size_t rows, double *restrict high, double *restrict low),
                   (rows, high, low))
{
    for (size_t i = 0; i < rows; i++)
        join_one(high + i, low + i);
}

void perp__multiply_doubled(const perp__matrix *M, const double *x, const double *add, double *high,
                            double *low)
{
    const size_t rows = (size_t)M->rows;

    for (size_t i = 0; i < rows; i++) {
        high[i] = add ? add[i] : 0.0;
        low[i] = 0.0;
    }
    if (M->column_starts)
        by_sparse_columns(M, x, high, low);
    else if (M->row_stride == 1)
        by_columns(M, x, high, low);
    else
        by_rows(M, x, high, low);
    join(rows, high, low);
}
