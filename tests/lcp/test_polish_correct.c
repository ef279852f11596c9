/* What methods lend to the polish: M_AA step = residual_A for the index set of their last basis. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "check.h"
#include "gen.h"
#include "lcp/solver.h"

#include "context.h"

/* The step for a random residual, put into the scaled equations. Problems are small and well
 * conditioned: 1e-8 is far above rounding and far below any mistake. Returns what `correct` does.
 */
static int require_inverse(perp_lcp_solver *solver, gen_random *random)
{
    const size_t n = (size_t)solver->n;
    double *M = check_allocate(n * n, sizeof *M), *residual = check_allocate(n, sizeof *M);
    double *step = check_allocate(n, sizeof *M);
    size_t i, j;
    int can;

    memset(M, 0, n * n * sizeof *M);
    perp__matrix_spread(solver->problem.M, M, n);
    for (i = 0; i < n; i++)
        residual[i] = solver->places[i] == PERP__BETWEEN ? gen_uniform(random, -1.0, 1.0) : 0.0;
    can = solver->correct(solver->correct_work, residual, step);
    for (i = 0; i < n && can; i++) {
        double sum = 0.0;

        for (j = 0; j < n; j++)
            sum += M[i + j * n] * step[j];
        if (solver->places[i] == PERP__BETWEEN)
            assert_true(fabs(sum - residual[i]) < 1e-8);
        else
            assert_true(step[i] == 0.0);
    }
    free(M);
    free(residual);
    free(step);
    return can;
}

static int is_free(const gen_lcp *problem)
{
    int32_t i;

    for (i = 0; i < problem->n; i++)
        if (problem->lower && problem->lower[i] == -INFINITY && problem->upper[i] == INFINITY)
            return 1;
    return 0;
}

/* Solves and tries what the method lent; true if it lent anything. */
static int try_method(const gen_lcp *problem, gen_random *random, int32_t method, int32_t crash)
{
    perp_lcp_settings settings = fresh_lcp_settings();
    perp_lcp_result result = fresh_lcp_result();
    perp_lcp_solver *solver = NULL;
    double *z = check_allocate((size_t)problem->n, sizeof *z);
    int lent;

    settings.method = method;
    settings.crash = crash;
    assert_int_equal(perp_lcp_solver_create(context, &solver, &settings), PERP_OK);
    assert_int_equal(perp_lcp_solver_setup(solver, &problem->view, problem->lower, problem->upper),
                     PERP_OK);
    assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, problem->q, NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    lent = solver->correct && require_inverse(solver, random);
    perp_lcp_solver_destroy(solver);
    free(z);
    return lent;
}

static void test_inverse_of_the_last_basis(void **state)
{
    static const int32_t sizes[] = {1, 5, 16, 33, 70, 150};
    gen_random random;
    size_t s;
    int class, bounds;

    (void)state;
    gen_seed(&random, 11);
    for (s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (class = 0; class < GEN_CLASSES; class ++)
            for (bounds = 0; bounds < GEN_BOUNDS; bounds++) {
                gen_lcp problem;

                if (class == GEN_PSD_LOW_RANK || class == GEN_P)
                    continue; /* blocks may be singular, or nearly so */
                gen_problem(&problem, &random, sizes[s], class, bounds);
                if (!is_free(&problem)) /* whose equations are dropped */
                    assert_true(try_method(&problem, &random, PERP_LCP_LEMKE, 0));
                try_method(&problem, &random, PERP_LCP_LEMKE, 1);
                try_method(&problem, &random, PERP_LCP_ACTIVE_SET, 1);
                gen_destroy(&problem);
            }
}

static void test_methods_that_hold_no_inverse(void **state)
{
    static const int32_t methods[] = {PERP_LCP_PGS, PERP_LCP_FISCHER};
    gen_random random;
    gen_lcp problem;
    size_t k;

    (void)state;
    gen_seed(&random, 12);
    gen_problem(&problem, &random, 20, GEN_PD_SYMMETRIC, GEN_PLAIN);
    for (k = 0; k < sizeof methods / sizeof *methods; k++)
        assert_false(try_method(&problem, &random, methods[k], 0));
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_inverse_of_the_last_basis),
        cmocka_unit_test(test_methods_that_hold_no_inverse),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
