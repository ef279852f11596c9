/* The scaled matrix by rows: the same numbers from every storage. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "gen.h"
#include "lcp/pgs_rows.h"

static perp_context *context;

static int make(void **state)
{
    (void)state;
    return perp_context_create(&context, NULL);
}

static int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    return 0;
}

static perp__matrix view(const gen_lcp *problem)
{
    perp__matrix M;

    memset(&M, 0, sizeof M);
    M.rows = M.columns = problem->n;
    if (problem->column_starts) {
        M.values = problem->values;
        M.column_starts = problem->column_starts;
        M.row_indices = problem->row_indices;
    } else {
        M.values = problem->M;
        M.row_stride = (size_t)problem->n;
        M.column_stride = 1;
    }
    return M;
}

static void layout(perp__arena *arena, void *object)
{
    void **both = object;

    perp__rows_layout(arena, both[0], both[1]);
}

/* Small integers: every product is exact, whatever the order of summation. */
static void test_rows_hold_the_scaled_matrix(void **state)
{
    enum { SIZE = 9 };
    static const int32_t e[SIZE] = {0, 3, -2, 1, 0, 0, -1, 2, 5};
    int M[SIZE * SIZE], q[SIZE] = {0};
    gen_lcp problems[2];
    gen_random random;

    (void)state;
    gen_seed(&random, 8);
    for (int k = 0; k < SIZE * SIZE; k++)
        M[k] = gen_integer(&random, 2) ? (int)gen_integer(&random, 41) - 20 : 0;
    gen_from_integers(&problems[0], SIZE, M, q);
    gen_to_csc(&problems[1], &problems[0]);
    for (int csc = 0; csc < 2; csc++) {
        perp__matrix own = view(&problems[csc]);
        perp__lcp_problem problem;
        perp__rows rows;
        perp__arena arena;
        void *both[2] = {&rows, &problem};
        double z[SIZE], d[SIZE];

        memset(&problem, 0, sizeof problem);
        problem.context = context;
        problem.n = SIZE;
        problem.M = &own;
        problem.factors = d;
        for (int i = 0; i < SIZE; i++)
            d[i] = ldexp(1.0, e[i]);
        perp__arena_init(&arena, context);
        assert_int_equal(perp__arena_fit(&arena, layout, both), PERP_OK);
        perp__rows_read(&rows, &problem);
        for (int i = 0; i < SIZE; i++)
            z[i] = i * i - 10.0;
        for (int i = 0; i < SIZE; i++) {
            double expected = 7.0, got = perp__row_times(&rows, i, z, 7.0);

            for (int j = 0; j < SIZE; j++)
                expected += ldexp(M[i * SIZE + j], e[i] + e[j]) * z[j];
            if (i > 0)
                got += rows.before[i] * z[i - 1];
            assert_true(got == expected);
            assert_true(rows.diagonal[i] == ldexp(M[i * SIZE + i], 2 * e[i]));
        }
        perp__arena_release(&arena);
        gen_destroy(&problems[csc]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows_hold_the_scaled_matrix),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
