/* Matrix times vector in doubled precision.
 *
 * Every product is split without error into p + e by fma() (two_product), every addition to the
 * running sum into s + t (two_sum), and the errors e + t are summed beside it: the dot product of
 * Ogita, Rump & Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005), algorithm
 * 5.3. The pair is what remains of the exact sum but for a relative (n eps)^2 of |M||x|.
 *
 * Where a sum overflows its high part is infinite or NaN. */
#include <math.h>
#include <string.h>

#include "linalg/matrix.h"
#include "linalg/multiversion.h"

/* high + low + a * x */
#define PERP__ACCUMULATE(high, low, a, x)                                    \
    do {                                                                     \
        const double product = (a) * (x);                                    \
        const double product_error = fma((a), (x), -product);                \
        const double sum = (high) + product;                                 \
        const double part = sum - (high);                                    \
        const double sum_error = ((high) - (sum - part)) + (product - part); \
        (high) = sum;                                                        \
        (low) += sum_error + product_error;                                  \
    } while (0)

/* Four columns in one pass save three quarters of the traffic on high and low; each row still adds
 * its products one after the other, as one column at a time would. */
PERP__KERNEL static void add_4_columns_loops(size_t rows, const double *const *a, const double *x,
                                             double *restrict high, double *restrict low)
{
    const double *a0 = a[0], *a1 = a[1], *a2 = a[2], *a3 = a[3];
    const double x0 = x[0], x1 = x[1], x2 = x[2], x3 = x[3];
    size_t i;

    for (i = 0; i < rows; i++) {
        double h = high[i], l = low[i];

        PERP__ACCUMULATE(h, l, a0[i], x0);
        PERP__ACCUMULATE(h, l, a1[i], x1);
        PERP__ACCUMULATE(h, l, a2[i], x2);
        PERP__ACCUMULATE(h, l, a3[i], x3);
        high[i] = h;
        low[i] = l;
    }
}
PERP__MULTIVERSION(add_4_columns,
                   (size_t rows, const double *const *a, const double *x, double *high,
                    double *low),
                   (rows, a, x, high, low))

PERP__KERNEL static void add_column_loops(size_t rows, const double *a, double x,
                                          double *restrict high, double *restrict low)
{
    size_t i;

    for (i = 0; i < rows; i++)
        PERP__ACCUMULATE(high[i], low[i], a[i], x);
}
PERP__MULTIVERSION(add_column, (size_t rows, const double *a, double x, double *high, double *low),
                   (rows, a, x, high, low))

static void by_columns(const perp__matrix *M, const double *x, double *high, double *low)
{
    const size_t rows = (size_t)M->rows;
    const double *columns[4];
    double factors[4];
    int32_t j;
    size_t pending = 0, k;

    for (j = 0; j < M->columns; j++) {
        if (x[j] == 0.0)
            continue;
        columns[pending] = M->values + (size_t)j * M->column_stride;
        factors[pending] = x[j];
        if (++pending == 4) {
            add_4_columns(rows, columns, factors, high, low);
            pending = 0;
        }
    }
    for (k = 0; k < pending; k++)
        add_column(rows, columns[k], factors[k], high, low);
}

PERP__KERNEL static void by_sparse_columns_loops(const perp__matrix *M, const double *x,
                                                 double *high, double *low)
{
    int32_t j, k;

    for (j = 0; j < M->columns; j++) {
        const double factor = x[j];

        if (factor == 0.0)
            continue;
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            PERP__ACCUMULATE(high[i], low[i], M->values[k], factor);
        }
    }
}
PERP__MULTIVERSION(by_sparse_columns,
                   (const perp__matrix *M, const double *x, double *high, double *low),
                   (M, x, high, low))

/* Rows are summed in strips of columns, each strip in LANES sums that do not wait for each other;
 * so many lanes that compilers keep the loop over them and vectorise it. */
enum { LANES = 32, STRIP = 512 };

/* The strip's columns where x is not zero. */
typedef struct strip {
    size_t count;
    int32_t full; /* 1: offsets are 0, 1, 2, ... */
    int32_t offsets[STRIP];
    double x[STRIP];
} strip;

/* Adds the products a_k x_k, k < whole, to the lanes k % LANES. */
PERP__KERNEL static void add_to_lanes(size_t whole, const double *a, const strip *s, double *h,
                                      double *l)
{
    size_t k, lane;

    if (s->full)
        for (k = 0; k < whole; k += LANES)
            for (lane = 0; lane < LANES; lane++)
                PERP__ACCUMULATE(h[lane], l[lane], a[k + lane], s->x[k + lane]);
    else
        for (k = 0; k < whole; k += LANES)
            for (lane = 0; lane < LANES; lane++)
                PERP__ACCUMULATE(h[lane], l[lane], a[s->offsets[k + lane]], s->x[k + lane]);
}

PERP__KERNEL static void add_rows_loops(const perp__matrix *M, const double *first, const strip *s,
                                        double *high, double *low)
{
    const size_t whole = s->count - s->count % LANES;
    int32_t i;
    size_t k, lane;

    for (i = 0; i < M->rows; i++) {
        const double *a = first + (size_t)i * M->row_stride;
        double h[LANES], l[LANES];

        if (whole > 0) {
            for (lane = 0; lane < LANES; lane++)
                h[lane] = l[lane] = 0.0;
            add_to_lanes(whole, a, s, h, l);
            for (lane = 0; lane < LANES; lane++) {
                PERP__ACCUMULATE(high[i], low[i], h[lane], 1.0);
                low[i] += l[lane];
            }
        }
        for (k = whole; k < s->count; k++)
            PERP__ACCUMULATE(high[i], low[i], a[s->offsets[k]], s->x[k]);
    }
}
PERP__MULTIVERSION(add_rows,
                   (const perp__matrix *M, const double *first, const strip *s, double *high,
                    double *low),
                   (M, first, s, high, low))

static void by_rows(const perp__matrix *M, const double *x, double *high, double *low)
{
    int32_t begin, j;
    strip s;

    for (begin = 0; begin < M->columns; begin += STRIP) {
        const int32_t width = M->columns - begin < STRIP ? M->columns - begin : STRIP;

        s.count = 0;
        for (j = 0; j < width; j++) {
            if (x[begin + j] == 0.0)
                continue;
            s.offsets[s.count] = j;
            s.x[s.count] = x[begin + j];
            s.count++;
        }
        s.full = s.count == (size_t)width;
        if (s.count > 0)
            add_rows(M, M->values + begin, &s, high, low);
    }
}

void perp__multiply_doubled(const perp__matrix *M, const double *x, const double *add, double *high,
                            double *low)
{
    const size_t rows = (size_t)M->rows;
    size_t i;

    for (i = 0; i < rows; i++) {
        high[i] = add ? add[i] : 0.0;
        low[i] = 0.0;
    }
    if (M->column_starts)
        by_sparse_columns(M, x, high, low);
    else if (M->row_stride == 1)
        by_columns(M, x, high, low);
    else
        by_rows(M, x, high, low);
    for (i = 0; i < rows; i++) {
        /* one pair for one value: |low| <= ulp(high) / 2 */
        const double sum = high[i] + low[i];
        const double part = sum - high[i];
        const double rest = (high[i] - (sum - part)) + (low[i] - part);

        if (isfinite(sum)) {
            high[i] = sum;
            low[i] = rest;
        } else {
            low[i] = 0.0;
        }
    }
}
