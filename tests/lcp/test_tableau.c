/* The tableau with delayed exchanges against plain exchanges in extended precision. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "base/context.h"
#include "check.h"
#include "gen.h"
#include "lcp/lemke/lemke.h"

typedef struct sized {
    perp__tableau tableau;
    int32_t rows, columns;
} sized;

static void layout(perp__arena *arena, void *object)
{
    sized *s = object;

    perp__tableau_layout(arena, &s->tableau, s->rows, s->columns);
}

static size_t at(int32_t rows, int32_t i, int32_t j)
{
    return (size_t)i + (size_t)j * (size_t)rows;
}

/* One exchange of row r and column c, entry by entry. */
static void exchange(long double *T, int32_t rows, int32_t columns, int32_t r, int32_t c)
{
    const long double pivot = T[at(rows, r, c)];
    int32_t i, j;

    for (j = 0; j < columns; j++)
        for (i = 0; i < rows; i++)
            if (i != r && j != c)
                T[at(rows, i, j)] -= T[at(rows, i, c)] * T[at(rows, r, j)] / pivot;
    for (j = 0; j < columns; j++)
        T[at(rows, r, j)] /= pivot;
    for (i = 0; i < rows; i++)
        T[at(rows, i, c)] /= -pivot;
    T[at(rows, r, c)] = 1 / pivot;
}

/* The product with x = (1, 0, -1/2, 1/3, 0, ...) against the columns' sum. */
static void multiply(perp__tableau *t, const long double *T, double *y)
{
    const int32_t rows = t->rows, columns = t->columns;
    double *x = check_allocate((size_t)columns, sizeof *x);
    int32_t i, j;

    for (j = 0; j < columns; j++)
        x[j] = j % 3 == 1 ? 0.0 : (j % 2 ? 1.0 : -1.0) / (j + 1);
    perp__tableau_multiply(t, x, y);
    for (i = 0; i < rows; i++) {
        long double sum = 0;

        for (j = 0; j < columns; j++)
            sum += T[at(rows, i, j)] * (j % 3 == 1 ? 0.0 : (j % 2 ? 1.0 : -1.0) / (j + 1));
        assert_true(fabsl(y[i] - sum) < 1e-12L);
    }
    free(x);
}

/* Dominant entries next to the diagonal, and pivots there: every tableau on the way stays well
 * conditioned (entries below 3), so that `exchanges` rounding errors of 1e-16 add up to less than
 * 1e-12. */
static void compare(int32_t rows, int32_t columns, int32_t exchanges)
{
    sized s;
    perp_context *context;
    perp__arena arena;
    gen_random random;
    size_t entries = (size_t)rows * (size_t)columns;
    long double *T = check_allocate(entries, sizeof *T);
    double *column = check_allocate(perp__tableau_length(rows), sizeof *column);
    int32_t k, i, j;

    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    memset(&arena, 0, sizeof arena);
    memset(&s, 0, sizeof s);
    s.rows = rows;
    s.columns = columns;
    assert_int_equal(perp__arena_fit(&arena, context, layout, &s), PERP_OK);
    gen_seed(&random, 77);
    for (j = 0; j < columns; j++)
        for (i = 0; i < rows; i++) {
            double value = gen_uniform(&random, -0.5, 0.5) / rows + (i + 1 == j);

            s.tableau.T[at(s.tableau.leading_dimension, i, j)] = value;
            T[(size_t)i + (size_t)j * (size_t)rows] = value;
        }
    perp__tableau_reset(&s.tableau, rows, columns);
    for (k = 0; k < exchanges; k++) {
        int32_t r = gen_integer(&random, rows);

        perp__tableau_column(&s.tableau, r + 1, column);
        for (i = 0; i < rows; i++)
            assert_true(fabsl(column[i] - T[at(rows, i, r + 1)]) < 1e-12L);
        perp__tableau_exchange(&s.tableau, r, r + 1, column);
        exchange(T, rows, columns, r, r + 1);
    }
    multiply(&s.tableau, T, column);
    perp__tableau_flush(&s.tableau);
    multiply(&s.tableau, T, column);
    for (j = 0; j < columns; j++)
        for (i = 0; i < rows; i++) {
            double entry = s.tableau.T[at(s.tableau.leading_dimension, i, j)];

            assert_true(fabsl(entry - T[at(rows, i, j)]) < 1e-12L);
        }
    perp__arena_release(&arena);
    perp_context_destroy(context);
    free(T);
    free(column);
}

static void test_few_exchanges(void **state)
{
    (void)state;
    compare(1, 2, 3);
    compare(16, 17, 5);
    compare(17, 18, 60); /* every row again and again */
}

static void test_exchanges_applied_together(void **state)
{
    (void)state;
    compare(20, 21, 1000);
    compare(100, 101, 300);
    compare(130, 140, 260);
    compare(260, 261, 150);
}

/* Rows that are large beside their pivots keep every digit: taken as a difference of the old row
 * and a multiple of it, 1e-12 of the row would be lost to 1e12. Powers of two: the results are
 * exact. */
static void test_large_pivots_lose_nothing(void **state)
{
    const double large = ldexp(1.0, 40);
    double column[PERP__PANEL];
    double *first, *second;
    perp_context *context;
    perp__arena arena;
    sized s;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    memset(&arena, 0, sizeof arena);
    memset(&s, 0, sizeof s);
    s.rows = s.columns = 2;
    assert_int_equal(perp__arena_fit(&arena, context, layout, &s), PERP_OK);
    first = s.tableau.T;
    second = first + s.tableau.leading_dimension;
    first[0] = large;
    first[1] = 1.0;
    second[0] = 3.0;
    second[1] = 5.0;
    perp__tableau_reset(&s.tableau, 2, 2);
    perp__tableau_column(&s.tableau, 0, column);
    perp__tableau_exchange(&s.tableau, 0, 0, column);
    perp__tableau_column(&s.tableau, 1, column);
    assert_true(column[0] == 3.0 / large);
    assert_true(column[1] == 5.0 - 3.0 / large);
    perp__tableau_flush(&s.tableau);
    assert_true(first[0] == 1.0 / large);
    assert_true(first[1] == -1.0 / large);
    assert_true(second[0] == 3.0 / large);
    assert_true(second[1] == 5.0 - 3.0 / large);
    perp__arena_release(&arena);
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_few_exchanges),
        cmocka_unit_test(test_exchanges_applied_together),
        cmocka_unit_test(test_large_pivots_lose_nothing),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
