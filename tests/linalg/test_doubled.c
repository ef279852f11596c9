/* The doubled product against exact sums (exact.h), and exactly where double-double has room. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include "exact.h"
#include "linalg/views.h"

#define UNIT 0x1p-53

/* |high + low - exact| <= (n u)^2 |M||x| times a small factor: Ogita, Rump & Oishi bound the error
 * of n products and sums by gamma_n^2 |M||x|; with `add`, the lanes' sums and the last rounding to
 * a pair there are at most n + 2 + 2 * 8 operations, hence the 2 n + 20. Products
 * whose error underflows add half a subnormal each. */
static void check_row(const double *row, size_t stride, size_t n, const double *x, double add,
                      double high, double low)
{
    const double operations = 2.0 * (double)n + 20.0;
    double size = fabs(add), error;
    check_sum sum;
    size_t j;

    check_sum_clear(&sum);
    check_sum_add(&sum, add, 1.0);
    for (j = 0; j < n; j++) {
        check_sum_add(&sum, row[j * stride], x[j]);
        size += fabs(row[j * stride] * x[j]);
    }
    check_sum_add(&sum, high, -1.0);
    check_sum_add(&sum, low, -1.0);
    error = fabs(check_sum_value(&sum, 0));
    if (!(error <= operations * operations * UNIT * UNIT * size + (double)n * 0x1p-1074))
        fail_msg("error %g, sum of sizes %g, n = %zu", error, size, n);
    /* one pair for one value */
    assert_true(high + low == high);
}

static void check_all(int32_t rows, int32_t columns, const double *entries, const double *x,
                      const double *add)
{
    double *high = check_allocate((size_t)rows + 1, sizeof(double));
    double *low = check_allocate((size_t)rows + 1, sizeof(double));
    views v;
    int32_t i;
    int k;

    views_make(&v, rows, columns, entries);
    for (k = 0; k < VIEWS; k++) {
        high[rows] = low[rows] = 77.0;
        perp__multiply_doubled(&v.view[k], x, add, high, low);
        for (i = 0; i < rows; i++)
            check_row(entries + i, (size_t)rows, (size_t)columns, x, add ? add[i] : 0.0, high[i],
                      low[i]);
        assert_true(high[rows] == 77.0 && low[rows] == 77.0);
    }
    views_release(&v);
    free(high);
    free(low);
}

/* Numbers whose sizes differ by up to 2^(2 spread), about one in `zeros` being zero. */
static void fill(gen_random *random, double *x, size_t count, int32_t spread, int32_t zeros)
{
    size_t k;

    for (k = 0; k < count; k++)
        x[k] = zeros > 0 && gen_integer(random, zeros) == 0
                   ? 0.0
                   : ldexp(gen_uniform(random, -1.0, 1.0),
                           gen_integer(random, 2 * spread + 1) - spread);
}

static void test_random(void **state)
{
    static const int32_t sizes[] = {0, 1, 2, 3, 4, 5, 7, 8, 9, 31, 32, 33, 64, 70};
    const size_t count = sizeof sizes / sizeof sizes[0];
    gen_random random;
    double entries[70 * 70], x[70], add[70];
    size_t r, c;

    (void)state;
    gen_seed(&random, 1);
    for (r = 0; r < count; r++)
        for (c = 0; c < count; c++) {
            const size_t size = (size_t)sizes[r] * (size_t)sizes[c];
            const int32_t spread = gen_integer(&random, 30);

            fill(&random, entries, size, spread, (int32_t)(c % 4));
            fill(&random, x, (size_t)sizes[c], spread, (int32_t)(r % 5));
            fill(&random, add, (size_t)sizes[r], spread, 3);
            check_all(sizes[r], sizes[c], entries, x, r % 2 == 0 ? add : NULL);
        }
}

/* More than one strip of columns, with and without zeros in x. */
static void test_wide(void **state)
{
    enum { ROWS = 3, COLUMNS = 1200 };
    static double entries[ROWS * COLUMNS], x[COLUMNS];
    gen_random random;
    int32_t zeros;

    (void)state;
    gen_seed(&random, 2);
    for (zeros = 0; zeros < 4; zeros++) {
        fill(&random, entries, ROWS * COLUMNS, 10, 0);
        fill(&random, x, COLUMNS, 10, zeros);
        check_all(ROWS, COLUMNS, entries, x, NULL);
        memset(x + 300, 0, 600 * sizeof *x);
        check_all(ROWS, COLUMNS, entries, x, NULL);
    }
}

/* Rows that cancel to nothing: their add is minus the product rounded, what remains is below one
 * unit in the last place of it and still right to 2^-53 of it or so. */
static void test_cancellation(void **state)
{
    enum { N = 60 };
    static double entries[N * N], x[N], add[N];
    gen_random random;
    int32_t i, j;

    (void)state;
    gen_seed(&random, 3);
    fill(&random, entries, N * N, 20, 5);
    fill(&random, x, N, 20, 0);
    for (i = 0; i < N; i++) {
        add[i] = 0.0;
        for (j = 0; j < N; j++)
            add[i] -= entries[i + N * j] * x[j];
    }
    check_all(N, N, entries, x, add);
}

static double binomial(int32_t n, int32_t k)
{
    double b = 1.0;
    int32_t i;

    for (i = 0; i < k; i++)
        b = b * (n - i) / (i + 1); /* exact: every partial product is a binomial times i + 1 */
    return b;
}

/* The Hilbert matrix of order 8, times the common denominator 360360, times a column of its integer
 * inverse: 360360 e_j. Terms reach 1e15, all of them and their partial sums are integers below
 * 2^106, so the pair holds the result exactly: (360360 or 0, 0). */
static void test_hilbert(void **state)
{
    enum { N = 8 };
    double entries[N * N], x[N], high[N], low[N];
    views v;
    int32_t i, j;
    int k;

    (void)state;
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++)
            entries[i + N * j] = 360360.0 / (i + j + 1);
    views_make(&v, N, N, entries);
    for (j = 0; j < N; j++) {
        for (i = 0; i < N; i++) /* Choi, "Tricks or treats with the Hilbert matrix" (1983) */
            x[i] = ((i + j) % 2 == 0 ? 1.0 : -1.0) * (i + j + 1) * binomial(N + i, N - j - 1) *
                   binomial(N + j, N - i - 1) * binomial(i + j, i) * binomial(i + j, i);
        for (k = 0; k < VIEWS; k++) {
            perp__multiply_doubled(&v.view[k], x, NULL, high, low);
            for (i = 0; i < N; i++) {
                assert_true(high[i] == (i == j ? 360360.0 : 0.0));
                assert_true(low[i] == 0.0);
            }
        }
    }
    views_release(&v);
}

static void test_pairs(void **state)
{
    /* column by column; the exact results stand beside */
    static const double entries[5 * 3] = {
        0x1p53,  0x1p500, 1.0 + UNIT * 2, 0x1p-500, 0x1p600, 1.0, 1.0, 0.0,
        0x1p500, 1.0,     -1.0,           0.0,      -1.0,    0.0, -1.0};
    static const double x[3] = {1.0, 1.0, 1.0};
    static const double high[5] = {0x1p53, 0x1p500, UNIT * 2, 0x1p500, 0x1p600};
    static const double low[5] = {0.0, 1.0, 0.0, 0x1p-500, 0.0};
    double h[5], l[5];
    views v;
    int32_t i;
    int k;

    (void)state;
    views_make(&v, 5, 3, entries);
    for (k = 0; k < VIEWS; k++) {
        perp__multiply_doubled(&v.view[k], x, NULL, h, l);
        for (i = 0; i < 5; i++)
            assert_true(h[i] == high[i] && l[i] == low[i]);
    }
    views_release(&v);
}

/* Products from the ends of the range are exact; what overflows is infinite or NaN and leaves the
 * other rows alone. */
static void test_extremes(void **state)
{
    static const double entries[4 * 2] = {0x1p500,  0x1p-500, 0x1.8p1000, 0x1p-1074,
                                          -0x1p500, 0x1p-400, 0x1p1000,   0.0};
    static const double x[2] = {0x1p-500, 0x1p500};
    static const double add[4] = {0x1p1000, 0.0, 1.0, -0x1p-1074};
    double h[4], l[4];
    views v;
    int k;

    (void)state;
    views_make(&v, 4, 2, entries);
    for (k = 0; k < VIEWS; k++) {
        perp__multiply_doubled(&v.view[k], x, add, h, l);
        assert_true(h[0] == 1.0 && l[0] == 0.0); /* 2^1000 - 2^1000 + 1 */
        assert_true(h[1] == 0x1p100 && l[1] == 0x1p-1000);
        assert_true(!isfinite(h[2]) && l[2] == 0.0);
        assert_true(h[3] == -0x1p-1074 && l[3] == 0.0); /* 2^-1574 underflows */
    }
    views_release(&v);
}

/* DBL_MAX - 1.5 ulp is a double, but its error passes through DBL_MAX + ulp / 2: a sum whose error
 * is lost is not told as exact. */
static void test_lost_error(void **state)
{
    static const double entries[2] = {DBL_MAX, 1.0}, x[1] = {1.0}, add[2] = {-0x1.8p971, 2.0};
    double h[2], l[2];
    views v;
    int k;

    (void)state;
    views_make(&v, 2, 1, entries);
    for (k = 0; k < VIEWS; k++) {
        perp__multiply_doubled(&v.view[k], x, add, h, l);
        assert_true(!isfinite(h[0]) || (h[0] - DBL_MAX) + l[0] == -0x1.8p971);
        assert_true(h[1] == 3.0 && l[1] == 0.0);
    }
    views_release(&v);
}

/* Dense by columns and CSC add the same products in the same order: the same bits, though one is
 * vectorised and the other is not; and a zero in x skips whole columns. */
static void test_same_bits(void **state)
{
    enum { ROWS = 61, COLUMNS = 83 };
    static double entries[ROWS * COLUMNS], x[COLUMNS], add[ROWS];
    double h[2][ROWS], l[2][ROWS];
    gen_random random;
    views v;
    int32_t round;

    (void)state;
    gen_seed(&random, 4);
    for (round = 0; round < 20; round++) {
        fill(&random, entries, ROWS * COLUMNS, 25, 4);
        fill(&random, x, COLUMNS, 25, round % 4);
        fill(&random, add, ROWS, 25, 0);
        views_make(&v, ROWS, COLUMNS, entries);
        perp__multiply_doubled(&v.view[VIEW_BY_COLUMNS], x, add, h[0], l[0]);
        perp__multiply_doubled(&v.view[VIEW_CSC], x, add, h[1], l[1]);
        assert_memory_equal(h[0], h[1], sizeof h[0]);
        assert_memory_equal(l[0], l[1], sizeof l[0]);
        views_release(&v);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),       cmocka_unit_test(test_wide),
        cmocka_unit_test(test_cancellation), cmocka_unit_test(test_hilbert),
        cmocka_unit_test(test_pairs),        cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_same_bits),    cmocka_unit_test(test_lost_error),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
