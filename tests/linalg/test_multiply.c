/* Products and row norms in working precision. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include "exact.h"
#include "linalg/views.h"

#define UNIT 0x1p-53

/* n products and n sums round: n u |M||x| to first order (Higham, "Accuracy and Stability", 3.5);
 * twice that covers the rest. */
static void check_product(const views *v, const double *entries, const double *x, double *y)
{
    const int32_t rows = v->view[0].rows, columns = v->view[0].columns;
    int32_t i, j;
    int k;

    for (k = 0; k < VIEWS; k++) {
        y[rows] = 77.0;
        perp__multiply(&v->view[k], x, y);
        for (i = 0; i < rows; i++) {
            double size = 0.0;
            check_sum sum;

            check_sum_clear(&sum);
            check_sum_add(&sum, y[i], -1.0);
            for (j = 0; j < columns; j++) {
                const double entry = entries[i + rows * j];

                check_sum_add(&sum, entry, x[j]);
                size += fabs(entry * x[j]);
            }
            assert_true(fabs(check_sum_value(&sum, 0)) <= 2.0 * columns * UNIT * size);
        }
        assert_true(y[rows] == 77.0);
    }
}

/* Sums of positive numbers: n u of the sum. */
static void check_norms(const views *v, const double *entries, const int32_t *exponents, double *y)
{
    const int32_t n = v->view[0].rows;
    int32_t i, j;
    int k;

    for (k = 0; k < VIEWS; k++) {
        y[n] = 77.0;
        perp__scaled_row_norms(&v->view[k], exponents, y);
        for (i = 0; i < n; i++) {
            check_sum sum;
            double exact;

            check_sum_clear(&sum);
            for (j = 0; j < n; j++)
                check_sum_add(&sum, fabs(entries[i + n * j]), ldexp(1.0, exponents[j]));
            exact = check_sum_value(&sum, exponents[i]);
            assert_true(fabs(y[i] - exact) <= (n + 2.0) * UNIT * exact);
        }
        assert_true(y[n] == 77.0);
    }
}

static void test_random(void **state)
{
    enum { LARGEST = 45 };
    static double entries[LARGEST * LARGEST], x[LARGEST], y[LARGEST + 1];
    int32_t exponents[LARGEST], rows, columns, k;
    gen_random random;
    views v;

    (void)state;
    gen_seed(&random, 1);
    for (rows = 0; rows <= LARGEST; rows += rows < 10 ? 1 : 7)
        for (columns = 0; columns <= LARGEST; columns += columns < 10 ? 1 : 7) {
            for (k = 0; k < rows * columns; k++)
                entries[k] = gen_integer(&random, 4) == 0 ? 0.0 : gen_normal(&random);
            for (k = 0; k < columns; k++) {
                x[k] = gen_integer(&random, 3) == 0 ? 0.0 : gen_normal(&random);
                exponents[k] = gen_integer(&random, 801) - 400;
            }
            views_make(&v, rows, columns, entries);
            check_product(&v, entries, x, y);
            if (rows == columns)
                check_norms(&v, entries, exponents, y);
            views_release(&v);
        }
}

/* The largest exponents: 2^(511 + 511) and 2^-(511 + 511) are normal, their sum overflows nothing
 * that the matrix does not. */
static void test_norm_extremes(void **state)
{
    static const double entries[4] = {0x1p-1022, 0.0, -3.0, 0x1p1022};
    static const int32_t exponents[2] = {511, -511};
    double y[3];
    views v;
    int k;

    (void)state;
    views_make(&v, 2, 2, entries);
    for (k = 0; k < VIEWS; k++) {
        perp__scaled_row_norms(&v.view[k], exponents, y);
        assert_true(y[0] == 4.0 && y[1] == 1.0);
    }
    views_release(&v);
}

/* Spreads the lowest number of rows and columns that hang together until nothing changes. */
static void spread_numbers(int32_t n, const double *entries, const int32_t *e, double least,
                           const int32_t *tied, int32_t *number)
{
    int32_t changed = 1;

    for (int32_t i = 0; i < 2 * n; i++)
        number[i] = i;
    while (changed) {
        changed = 0;
        for (int32_t j = 0; j < n; j++)
            for (int32_t i = 0; i < n; i++) {
                const double size = fabs(ldexp(entries[i + n * j], e[i] + e[j]));
                const int32_t a = number[i], b = number[n + j];

                if (a != b && ((size > 0.0 && size >= least) || (i == j && tied[i]))) {
                    number[i] = number[n + j] = a < b ? a : b;
                    changed = 1;
                }
            }
    }
}

/* Sizes around the bound, few enough of them that chains are long; sizes of blocks, and one off. */
static void compare_parts(gen_random *random, int32_t n, int32_t empty, double least)
{
    double *entries = check_allocate((size_t)(n * n), sizeof *entries);
    double *work = check_allocate((size_t)n, sizeof *work);
    int32_t *part = check_allocate((size_t)(2 * n), sizeof *part);
    int32_t *number = check_allocate((size_t)(2 * n), sizeof *number);
    int32_t *e = check_allocate((size_t)n, sizeof *e), *tied = check_allocate((size_t)n, sizeof *e);
    views v;

    for (int32_t i = 0; i < n; i++) {
        e[i] = least > 0.0 ? gen_integer(random, 301) - 150 : 0;
        tied[i] = gen_integer(random, 8) == 0;
    }
    for (int32_t j = 0; j < n; j++)
        for (int32_t i = 0; i < n; i++) {
            const double size = ldexp(gen_integer(random, 2) ? least : 0.99 * least, -e[i] - e[j]);

            entries[i + n * j] = gen_integer(random, empty) ? 0.0 : least > 0.0 ? -size : 0x1p-1074;
        }
    spread_numbers(n, entries, e, least, tied, number);
    views_make(&v, n, n, entries);
    for (int k = 0; k < VIEWS; k++) {
        int32_t count = 0;

        for (int32_t i = 0; i < n; i++)
            work[i] = least > 0.0 ? ldexp(1.0, -e[i]) : 1.0;
        assert_true(perp__cut_parts(&v.view[k], work, work, least, tied, part) >= 1);
        for (int32_t i = 0; i < 2 * n; i++) {
            count += number[i] == i;
            assert_int_equal(part[i], number[i] == i ? count - 1 : part[number[i]]);
        }
    }
    views_release(&v);
    free(entries);
    free(work);
    free(part);
    free(number);
    free(e);
    free(tied);
}

static void test_parts(void **state)
{
    static const int32_t sizes[] = {1, 2, 3, 4, 7, 8, 9, 31, 63, 64, 65, 71, 128, 130};
    gen_random random;

    (void)state;
    gen_seed(&random, 2);
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++)
        for (int32_t empty = 1; empty <= 2 * sizes[k]; empty += 1 + empty / 2) {
            compare_parts(&random, sizes[k], empty, 0.0);
            compare_parts(&random, sizes[k], empty, 1e-3);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),
        cmocka_unit_test(test_norm_extremes),
        cmocka_unit_test(test_parts),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
