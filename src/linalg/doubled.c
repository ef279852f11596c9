/* Matrix times vector in doubled precision.
 *
 * Every product is split without error into p + e by fma() (two_product), every addition to the
 * running sum into s + t (two_sum), and the errors e + t are summed beside it: the dot product of
 * Ogita, Rump & Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005), algorithm
 * 5.3. The pair is what remains of the exact sum but for a relative (n eps)^2 of |M||x|.
 *
 * Where a sum overflows its high part is infinite or NaN. */
#include "linalg/doubled.h"

#include "linalg/matrix.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/lanes/vectors.h"

/* In rows shorter than this the sum of eight sums costs more than it saves; and in rows shorter
 * than that the copy of eight rows, side by side, saves more than it costs. */
enum { FEW_COLUMNS = 24, SHORT_ROW = 96 };

/* Columns in one pass: they may all lie in the same few lines of the cache. */
enum { TOGETHER = 8 };

/* Some columns times their factors to high + low, or, in the first pass, to `from`. Each row adds
 * its products one after the other, as one column at a time would. The last pass makes of the pair
 * one value, as join does. */
typedef struct doubled_pass {
    const double *columns[TOGETHER];
    double factors[TOGETHER];
    size_t count;
    const double *from; /* NULL: not the first */
    int32_t last;
    double *high, *low;
} doubled_pass;

typedef struct doubled_kernels {
    size_t least; /* rows that fill a vector */
    void (*add_columns)(const doubled_pass *pass, size_t rows);
    void (*add_row)(size_t columns, const double *a, const double *x, double *high, double *low);
    void (*add_8_rows)(size_t columns, const double *a, const double *x, double *high, double *low);
} doubled_kernels;

/* high + low + the sum of 8 pairs, in an order that does not depend on the vectors. */
PERP__KERNEL static void add_lanes(const double *h, const double *l, double *high, double *low)
{
    double error = 0.0;

    for (size_t k = 0; k < 8; k++) {
        perp__accumulate(high, low, h[k], 1.0);
        error += l[k];
    }
    *low += error;
}

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

/* A pass over few rows. */
PERP__KERNEL static void pass_any(const doubled_pass *p, size_t rows)
{
    for (size_t i = 0; i < rows; i++) {
        double h = p->from ? p->from[i] : p->high[i], l = p->from ? 0.0 : p->low[i];

        for (size_t k = 0; k < p->count; k++)
            perp__accumulate(&h, &l, p->columns[k][i], p->factors[k]);
        if (p->last)
            join_one(&h, &l);
        p->high[i] = h;
        p->low[i] = l;
    }
}

#define TEMPLATE "linalg/doubled_vector.h"
#include "linalg/lanes/each_set.h"

/* In the order of perp__vector_set. */
static const doubled_kernels *const kernels[] = {PERP__OF_EACH_SET(&kernels)};

static void by_columns(const perp__matrix *M, const double *x, const double *from, double *high,
                       double *low)
{
    const size_t rows = (size_t)M->rows;
    size_t set = perp__widest_vectors(), count = 0;
    doubled_pass pass;

    pass.from = from;
    pass.last = 0;
    pass.high = high;
    pass.low = low;
    if (rows < kernels[set]->least && set > PERP__VECTOR_AVX2)
        set--; /* rows that fill no vector at all are added one by one */
    for (int32_t j = 0; j < M->columns; j++) {
        if (count == TOGETHER) {
            pass.count = count;
            kernels[set]->add_columns(&pass, rows);
            pass.from = NULL;
            count = 0;
        }
        pass.columns[count] = M->values + (size_t)j * M->column_stride;
        pass.factors[count] = x[j];
        count += x[j] != 0.0; /* no branch, which nobody foresees */
    }
    pass.count = count;
    pass.last = 1;
    kernels[set]->add_columns(&pass, rows);
}

/* In rows of a sum of eight, columns where x is 0 cost less than leaving them out: they add 0. */
static void by_rows(const perp__matrix *M, const double *x, double *high, double *low)
{
    const doubled_kernels *k = kernels[perp__widest_vectors()];
    const int32_t together = M->columns <= SHORT_ROW ? M->rows - M->rows % 8 : 0;
    double a[8 * SHORT_ROW], factors[SHORT_ROW];
    size_t from[SHORT_ROW], count = 0;

    for (int32_t j = 0; j < M->columns && together > 0; j++)
        if (x[j] != 0.0) {
            from[count] = (size_t)j;
            factors[count++] = x[j];
        }
    for (int32_t i = 0; i < together; i += 8) {
        const double *row = M->values + (size_t)i * M->row_stride;

        for (size_t j = 0; j < count; j++)
            for (size_t r = 0; r < 8; r++)
                a[8 * j + r] = row[r * M->row_stride + from[j]];
        k->add_8_rows(count, a, factors, high + i, low + i);
    }
    for (int32_t i = together; i < M->rows; i++)
        k->add_row((size_t)M->columns, M->values + (size_t)i * M->row_stride, x, high + i, low + i);
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

    if (!M->column_starts && M->row_stride == 1 && add) {
        by_columns(M, x, add, high, low);
        return;
    }
    for (size_t i = 0; i < rows; i++) {
        high[i] = add ? add[i] : 0.0;
        low[i] = 0.0;
    }
    if (M->column_starts)
        by_sparse_columns(M, x, high, low);
    else if (M->row_stride == 1)
        by_columns(M, x, NULL, high, low);
    else
        by_rows(M, x, high, low);
    if (M->column_starts || M->row_stride != 1)
        join(rows, high, low);
}
