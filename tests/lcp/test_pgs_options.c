/* Projected Gauss-Seidel beyond plain sweeps: sweeps to and fro, rows without entries, and one
 * solver for many right-hand sides and settings. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

/* ---- to and fro ------------------------------------------------------------------------------ */

/* Equations with the lower triangle of ones: forward sweeps solve it in one, and see it in the
 * second; the upper triangle takes a sweep backwards, which is the second. */
static void test_the_second_sweep_goes_backwards(void **state)
{
    enum { SIZE = 21 };
    double values[SIZE * SIZE] = {0.0}, q[SIZE], lower[SIZE], upper[SIZE];
    perp_matrix M = run_dense(values, SIZE);
    perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-12);
    int64_t sweeps[2];

    (void)state;
    for (int i = 0; i < SIZE; i++) {
        for (int j = i; j < SIZE; j++)
            values[i * SIZE + j] = 1.0;
        q[i] = i - SIZE; /* z = 1 everywhere */
        lower[i] = -INFINITY;
        upper[i] = INFINITY;
    }
    for (int symmetric = 0; symmetric < 2; symmetric++) {
        run r;

        settings.sweep = symmetric ? PERP_SWEEP_SYMMETRIC : PERP_SWEEP_FORWARD;
        run_view(&r, context, &M, q, lower, upper, &settings, NULL, "triangle");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        sweeps[symmetric] = r.result.iterations;
        run_release(&r);
    }
    /* news travels one row a sweep against the order; the third sweep sees that all is done */
    assert_in_range(sweeps[0], SIZE - 1, SIZE + 1);
    assert_int_equal(sweeps[1], 3);
}

static void test_symmetric_sweeps_solve(void **state)
{
    (void)state;
    for (int k = 0; k < 24; k++) {
        perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-11);
        gen_random random;
        gen_lcp problem, sparse;
        run r;

        gen_seed(&random, 300 + (uint64_t)k);
        gen_problem(&problem, &random, 1 + 2 * k, k % 2 ? GEN_M : GEN_PD_SYMMETRIC, k % GEN_BOUNDS);
        gen_to_csc(&sparse, &problem);
        settings.sweep = PERP_SWEEP_SYMMETRIC;
        settings.relaxation = k % 4 == 0 ? 1.25 : 1.0;
        run_lcp(&r, context, &problem, &settings, NULL, "dense");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        /* as in test_pgs.c: the lowest eigenvalue is 1/2 at least */
        assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-6);
        run_release(&r);
        run_view(&r, context, &sparse.view, problem.q, problem.lower, problem.upper, &settings,
                 NULL, "csc");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-6);
        run_release(&r);
        gen_destroy(&sparse);
        gen_destroy(&problem);
    }
}

/* ---- rows of zeros --------------------------------------------------------------------------- */

/* Row 1 is zero: w_1 = q_1 puts z_1 to a bound, from where it acts on row 0. */
static void test_rows_of_zeros(void **state)
{
    static const double values[] = {2.0, 1.0, 0.0, 0.0};
    static const double loads[] = {3.0, -3.0, 0.0};
    static const double at[] = {-1.0, 5.0, 4.0};
    double lower[] = {-100.0, -1.0}, upper[] = {100.0, 5.0}, start[] = {0.0, 4.0};
    perp_matrix M = run_dense(values, 2);
    perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-12);

    (void)state;
    for (int k = 0; k < 3; k++) {
        double q[] = {6.0, loads[k]};
        run r;

        run_view(&r, context, &M, q, lower, upper, &settings, start, "row of zeros");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(r.z[1] == at[k] && r.z[0] == -(6.0 + at[k]) / 2.0);
        run_release(&r);
    }
}

static void test_rows_of_zeros_without_a_place(void **state)
{
    static const double values[] = {2.0, 1.0, 0.0, 0.0}, lower[] = {0.0, -INFINITY};
    perp_matrix M = run_dense(values, 2);
    perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-12);

    (void)state;
    for (int k = 0; k < 3; k++) {
        double q[] = {-2.0, k - 1.0}, z[] = {17.0, 17.0};
        perp_status status;
        perp_lcp_result result = fresh_lcp_result();

        status = perp_lcp_solve(context, z, NULL, NULL, &result, &settings,
                                LCP(&M, q, k == 2 ? lower : NULL), NULL);
        if (k == 1) { /* q_1 = 0: any z_1 will do */
            assert_int_equal(status, PERP_OK);
            assert_true(z[0] == 1.0 && z[1] == 0.0);
            continue;
        }
        assert_int_equal(status, PERP_ERROR_ARGUMENT);
        assert_string_equal(perp_context_message(context),
                            "row 1 of M is 0 and q[1] is not: w[1] = q[1] for every z");
        assert_true(z[0] == 17.0 && z[1] == 17.0);
    }
}

/* ---- one solver, many solves ----------------------------------------------------------------- */

static void solve_with(perp_lcp_solver *solver, const perp_lcp_settings *settings, const double *q,
                       double *z, perp_lcp_result *result)
{
    assert_int_equal(perp_struct_init(result, sizeof *result), PERP_OK);
    assert_int_equal(perp_lcp_solver_set(solver, settings), PERP_OK);
    assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, result, q, NULL), PERP_OK);
}

/* The rows that are kept from solve to solve are those of the settings in force: the same bits as
 * a solver that has seen nothing else. */
static void test_settings_change_between_solves(void **state)
{
    enum { SIZE = 40 };
    perp_lcp_solver *solver = NULL;
    gen_random random;
    gen_lcp problem;

    (void)state;
    gen_seed(&random, 77);
    gen_problem(&problem, &random, SIZE, GEN_PD_SYMMETRIC, GEN_BOXED);
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(perp_lcp_solver_setup(solver, &problem.view, problem.lower, problem.upper),
                     PERP_OK);
    for (int k = 0; k < 16; k++) {
        perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-9);
        double z[SIZE], fresh[SIZE];
        perp_lcp_result result;
        perp_lcp_solver *other = NULL;

        settings.relaxation = k & 1 ? 1.25 : 1.0;
        settings.sweep = k & 2 ? PERP_SWEEP_SYMMETRIC : PERP_SWEEP_FORWARD;
        settings.scaling = k & 4 ? 0 : 1;
        problem.q[k] += 1.0;
        solve_with(solver, &settings, problem.q, z, &result);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(perp_lcp_solver_create(context, &other, &settings), PERP_OK);
        assert_int_equal(perp_lcp_solver_setup(other, &problem.view, problem.lower, problem.upper),
                         PERP_OK);
        solve_with(other, &settings, problem.q, fresh, &result);
        assert_memory_equal(z, fresh, sizeof z);
        perp_lcp_solver_destroy(other);
    }
    /* new values of M, after a new set-up */
    problem.M[0] += 1.0;
    assert_int_equal(perp_lcp_solver_setup(solver, &problem.view, problem.lower, problem.upper),
                     PERP_OK);
    {
        perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-9);
        double z[SIZE];
        perp_lcp_result result;

        solve_with(solver, &settings, problem.q, z, &result);
        check_require(check_lcp_result(&problem.view, problem.q, problem.lower, problem.upper, z,
                                       NULL, NULL, &result, &settings),
                      "after a new set-up");
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    }
    perp_lcp_solver_destroy(solver);
    gen_destroy(&problem);
}

/* Four sweeps at once or one by one end at the same bits where a limit says when. */
static void test_limits_of_large_problems(void **state)
{
    gen_lcp problem;
    double *before = NULL;

    (void)state;
    gen_obstacle_2d(&problem, 150); /* beyond the cache: swept four at a time */
    for (int32_t limit = 1; limit <= 9; limit++) {
        perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-14);
        run r;

        settings.max_iterations = limit;
        run_lcp(&r, context, &problem, &settings, NULL, "limit");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
        assert_int_equal(r.result.iterations, limit);
        if (before) { /* one sweep more from where the last run ended */
            run next;

            settings.max_iterations = 1;
            run_lcp(&next, context, &problem, &settings, before, "one more");
            assert_memory_equal(next.z, r.z, (size_t)problem.n * sizeof(double));
            run_release(&next);
        }
        free(before);
        before = r.z;
        r.z = NULL;
        run_release(&r);
    }
    free(before);
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_second_sweep_goes_backwards),
        cmocka_unit_test(test_symmetric_sweeps_solve),
        cmocka_unit_test(test_rows_of_zeros),
        cmocka_unit_test(test_rows_of_zeros_without_a_place),
        cmocka_unit_test(test_settings_change_between_solves),
        cmocka_unit_test(test_limits_of_large_problems),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
