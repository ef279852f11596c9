/* The kernels on panels against one multiply-subtract after the other, bit for bit. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "check.h"
#include "gen.h"
#include "linalg/lanes/panels.h"

static double *numbers(gen_random *random, size_t count)
{
    double *x = check_allocate(count, sizeof *x);
    size_t k;

    for (k = 0; k < count; k++)
        x[k] = gen_uniform(random, -1.0, 1.0);
    return x;
}

static double entry(const double *U, size_t stride, size_t i, size_t k)
{
    return U[i / PERP__PANEL * stride + k * PERP__PANEL + i % PERP__PANEL];
}

static void compare_vector(const perp__panel_kernels *kernels, size_t panels, size_t depth)
{
    const size_t rows = panels * PERP__PANEL, stride = (depth + 3) * PERP__PANEL;
    gen_random random;
    double *U, *v, *y, *expected;
    size_t i, k;

    gen_seed(&random, panels);
    U = numbers(&random, panels * stride);
    v = numbers(&random, depth);
    y = numbers(&random, rows);
    expected = check_allocate(rows, sizeof *expected);
    for (i = 0; i < rows; i++)
        for (expected[i] = y[i], k = 0; k < depth; k++)
            expected[i] -= entry(U, stride, i, k) * v[k];
    kernels->subtract_vector(panels, depth, U, stride, v, y);
    assert_memory_equal(y, expected, rows * sizeof *y);
    free(U);
    free(v);
    free(y);
    free(expected);
}

static void compare_tile(const perp__panel_kernels *kernels, size_t panels, size_t depth)
{
    const size_t rows = panels * PERP__PANEL, stride = (depth + 3) * PERP__PANEL, ldc = rows + 5;
    gen_random random;
    double *U, *V, *C, *expected;
    size_t i, j, k;

    gen_seed(&random, panels + depth);
    U = numbers(&random, panels * stride);
    V = numbers(&random, depth * PERP__STRIP);
    C = numbers(&random, ldc * PERP__TILE);
    expected = check_allocate(ldc * PERP__TILE, sizeof *expected);
    memcpy(expected, C, ldc * PERP__TILE * sizeof *C);
    for (j = 0; j < PERP__TILE; j++)
        for (i = 0; i < rows; i++)
            for (k = 0; k < depth; k++)
                expected[i + j * ldc] =
                    fma(-entry(U, stride, i, k), V[k * PERP__STRIP + j], expected[i + j * ldc]);
    kernels->subtract_tile(panels, depth, U, stride, V, C, ldc);
    assert_memory_equal(C, expected, ldc * PERP__TILE * sizeof *C);
    free(U);
    free(V);
    free(C);
    free(expected);
}

static void compare_rows(const perp__panel_kernels *kernels, size_t depth)
{
    gen_random random;
    double *f, *V, *x, expected[PERP__STRIP], quotients[PERP__STRIP];
    size_t j, k;

    gen_seed(&random, depth);
    f = numbers(&random, depth);
    V = numbers(&random, depth * PERP__STRIP);
    x = numbers(&random, PERP__STRIP);
    for (j = 0; j < PERP__STRIP; j++)
        for (expected[j] = x[j], k = 0; k < depth; k++)
            expected[j] = fma(-f[k], V[k * PERP__STRIP + j], expected[j]);
    kernels->subtract_rows(depth, f, V, 0.3, x, quotients);
    assert_memory_equal(x, expected, sizeof expected);
    for (j = 0; j < PERP__STRIP; j++)
        assert_true(quotients[j] == x[j] / 0.3);
    free(f);
    free(V);
    free(x);
}

static void compare_keeping(const perp__panel_kernels *kernels, size_t panels)
{
    const size_t rows = panels * PERP__PANEL, stride = 3 * PERP__PANEL;
    gen_random random;
    double *column, *into, *U;
    size_t i;

    gen_seed(&random, panels);
    column = numbers(&random, rows);
    into = numbers(&random, rows);
    U = numbers(&random, panels * stride);
    kernels->keep(panels, 0.7, column, into, U + PERP__PANEL, stride);
    for (i = 0; i < rows; i++) {
        const double scaled = column[i] / 0.7;

        assert_true(entry(U, stride, i, 1) == scaled);
        assert_true(into[i] == -scaled);
    }
    free(column);
    free(into);
    free(U);
}

/* Row 5 comes again and again: what an exchange made of it is what the next one starts from. */
static void compare_elimination(const perp__panel_kernels *kernels)
{
    enum { DEPTH = 10, FIRST = 2, ROWS = 9 };
    static const int32_t rows[DEPTH] = {0, 1, 5, 3, 8, 5, 2, 7, 5, 0};
    gen_random random;
    double *L, *pivots, *y, v[DEPTH - FIRST], expected_v[DEPTH], expected[ROWS];
    perp__exchanges e;
    size_t k, l;

    gen_seed(&random, 5);
    L = numbers(&random, DEPTH * DEPTH);
    pivots = numbers(&random, DEPTH);
    y = numbers(&random, ROWS);
    memcpy(expected, y, sizeof expected);
    for (k = FIRST; k < DEPTH; k++) {
        for (expected_v[k] = expected[rows[k]], l = FIRST; l < k; l++)
            expected_v[k] -= L[k * DEPTH + l] * expected_v[l];
        expected[rows[k]] = expected_v[k] / pivots[k];
    }
    e.rows = rows;
    e.pivots = pivots;
    e.L = L;
    e.stride = DEPTH;
    kernels->eliminate(&e, FIRST, DEPTH, v, y);
    assert_memory_equal(v, expected_v + FIRST, sizeof v);
    assert_memory_equal(y, expected, sizeof expected);
    free(L);
    free(pivots);
    free(y);
}

static void test_kernels(void **state)
{
    const perp__panel_kernels *kernels;
    size_t panels;

    (void)state;
    assert_non_null(perp__panel_kernels_number(0));
    assert_null(perp__panel_kernels_number(-1));
    for (int32_t number = 0; (kernels = perp__panel_kernels_number(number)); number++) {
        for (panels = 1; panels < 12; panels++) {
            compare_vector(kernels, panels, 1);
            compare_vector(kernels, panels, 2 * panels + 3);
            compare_tile(kernels, panels, 1);
            compare_tile(kernels, panels, 3 * panels);
            compare_keeping(kernels, panels);
        }
        compare_rows(kernels, 1);
        compare_rows(kernels, 17);
        compare_elimination(kernels);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kernels),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
