/* Rows that hold: rows that are no numbers take no part, and leave the others as they are. */
#include <math.h>

#include "suite.h"

#include "linalg/active_rows.h"

/* (1, 0, 0) . x = 2 and (0.6, 0.8, 0) . x = 2 have the point (2, 1, 0) of least norm. */
static void test_rows_that_are_no_numbers(void **state)
{
    static const double strange[] = {NAN, INFINITY, 1e300};
    size_t k;
    int place;

    (void)state;
    for (k = 0; k < 3; k++)
        for (place = 0; place < 3; place++) {
            double rows[9] = {0}, targets[3], norms[3], basis[9], x[3];
            int32_t taken[3], at = 0, i;
            perp__active_rows held = {.n = 3,
                                      .count = 3,
                                      .rows = rows,
                                      .targets = targets,
                                      .norms = norms,
                                      .taken = taken,
                                      .basis = basis,
                                      .particular = x};

            for (i = 0; i < 3; i++) {
                double *row = rows + 3 * i;

                targets[i] = 2.0;
                if (i == place) {
                    row[1] = row[2] = strange[k];
                } else {
                    row[0] = at == 0 ? 1.0 : 0.6;
                    row[1] = at++ == 0 ? 0.0 : 0.8;
                }
            }
            perp__active_rows_solve(&held);
            assert_int_equal(held.rank, 2);
            assert_int_equal(taken[place], 0);
            assert_true(fabs(x[0] - 2.0) <= 1e-15 && fabs(x[1] - 1.0) <= 1e-15 && x[2] == 0.0);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_rows_that_are_no_numbers)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
