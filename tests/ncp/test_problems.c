/* The zoo itself, without any solver: its patterns, its Jacobians, its stated solutions. */
#include "problems.h"

#include "suite.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

/* A row of the Jacobian by central differences: their error is about eps^(2/3) of F and of its
 * third derivative; 1e-6 of the largest number around leaves both some room. */
static void compare_column(const zoo_problem *problem, double *z, int32_t j, const double *column)
{
    double *high = zoo_memory((size_t)problem->n, sizeof *high), kept = z[j];
    double *low = zoo_memory((size_t)problem->n, sizeof *low), h = 1e-5 * fmax(1e-2, fabs(kept));
    z[j] = kept + h;
    int32_t bad = problem->equations(problem, z, high, NULL);
    double up = z[j];
    z[j] = kept - h;
    bad |= problem->equations(problem, z, low, NULL);
    double width = up - z[j], largest = 0, noise = 0;
    z[j] = kept;
    for (int32_t i = 0; i < problem->n; i++) {
        largest = fmax(largest, fabs(column[i]));
        noise = fmax(noise, fabs(high[i]));
    }
    for (int32_t i = 0; i < problem->n && !bad; i++) {
        double difference = (high[i] - low[i]) / width;
        double allowed = 1e-6 * (1 + largest) + 100 * DBL_EPSILON * noise / width;
        if (!(fabs(difference - column[i]) <= allowed))
            fail_msg("%s: dF[%d]/dz[%d] is %.12g, by differences %.12g", problem->name, (int)i,
                     (int)j, column[i], difference);
    }
    free(low);
    free(high);
}

/* At every start, moved a little off the corners, in every column (of many, some hundred). */
static void check_jacobian(zoo_problem *problem, const double *start)
{
    const int32_t n = problem->n, step = n / 100 + 1;
    double *values = zoo_memory((size_t)problem->nonzeros, sizeof *values);
    double *z = zoo_memory((size_t)n, sizeof *z), *column = zoo_memory((size_t)n, sizeof *column);
    uint64_t seed = 7;
    for (int32_t i = 0; i < n; i++)
        z[i] = start[i] + 1e-2 * (1 + fabs(start[i])) * zoo_random(&seed);
    if (zoo_jacobian_values(values, z, problem) == 0) {
        for (int32_t j = 0; j < n; j += step) {
            memset(column, 0, (size_t)n * sizeof *column);
            if (problem->sparse)
                for (int32_t k = problem->column_starts[j]; k < problem->column_starts[j + 1]; k++)
                    column[problem->row_indices[k]] = values[k];
            else
                memcpy(column, values + (ptrdiff_t)n * j, (size_t)n * sizeof *column);
            compare_column(problem, z, j, column);
        }
    }
    free(column);
    free(z);
    free(values);
}

static void check_pattern(const zoo_problem *problem)
{
    if (!problem->sparse)
        return;
    assert_int_equal(problem->column_starts[0], 0);
    assert_int_equal(problem->column_starts[problem->n], problem->nonzeros);
    for (int32_t j = 0; j < problem->n; j++)
        for (int32_t k = problem->column_starts[j] + 1; k < problem->column_starts[j + 1]; k++)
            assert_true(problem->row_indices[k] > problem->row_indices[k - 1]);
}

/* Literals have 13 to 16 digits, so a stated solution's residual is 1e-12 of F's scale. */
static void check_solutions(const zoo_problem *problem)
{
    double *F = zoo_memory((size_t)problem->n, sizeof *F);
    for (int32_t k = 0; k < problem->solution_count; k++) {
        const double *z = problem->solutions + (ptrdiff_t)problem->n * k;
        assert_int_equal(problem->equations(problem, z, F, NULL), 0);
        double residual = zoo_residual(problem, z, F);
        if (!(residual <= 1e-12 * problem->scale))
            fail_msg("%s: stated solution %d has natural residual %.3g", problem->name, (int)k,
                     residual);
    }
    free(F);
}

static void jacobians_are_those_of_the_functions(void **state)
{
    int32_t count;
    const zoo_entry *table = zoo_table(&count);
    (void)state;
    for (int32_t e = 0; e < count; e++) {
        zoo_problem *problem = zoo_create(&table[e], table[e].size);
        check_pattern(problem);
        for (int32_t k = 0; k < problem->start_count; k++)
            check_jacobian(problem, problem->starts + (ptrdiff_t)problem->n * k);
        zoo_destroy(problem);
    }
}

static void stated_solutions_are_solutions(void **state)
{
    int32_t count;
    const zoo_entry *table = zoo_table(&count);
    (void)state;
    assert_true(count >= 40);
    for (int32_t e = 0; e < count; e++) {
        zoo_problem *problem = zoo_create(&table[e], table[e].size);
        assert_true(problem->start_count > 0);
        if (table[e].knowledge != ZOO_UNKNOWN && table[e].knowledge != ZOO_UNIQUE)
            assert_true(problem->solution_count > 0);
        check_solutions(problem);
        zoo_destroy(problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(jacobians_are_those_of_the_functions),
        cmocka_unit_test(stated_solutions_are_solutions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
