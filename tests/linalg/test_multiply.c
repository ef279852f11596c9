/* Products and row norms in working precision. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),
        cmocka_unit_test(test_norm_extremes),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
