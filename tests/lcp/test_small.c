/* The shortest way for small dense problems (small.c): where it is taken, that its answers are
 * those of Lemke's method, and that it leaves the rest alone. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "lcp/solver.h"
#include "run.h"

#include "context.h"

static perp_lcp_solver *set_up(const gen_lcp *problem, const perp_lcp_settings *settings)
{
    perp_lcp_solver *solver = NULL;

    assert_int_equal(perp_lcp_solver_create(context, &solver, settings), PERP_OK);
    assert_int_equal(perp_lcp_solver_setup(solver, &problem->view, problem->lower, problem->upper),
                     PERP_OK);
    return solver;
}

/* Whether the way alone solves it, and what `auto` says. */
static int32_t is_taken(const gen_lcp *problem, const perp_lcp_settings *settings, double *z,
                        perp_lcp_result *result)
{
    perp_lcp_solver *solver = set_up(problem, settings);
    perp__evaluation worth;
    int32_t taken;

    assert_int_equal(perp_lcp_result_init(result, sizeof *result), PERP_OK);
    assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, result, problem->q, NULL),
                     PERP_OK);
    perp__scale_problem(solver, problem->q);
    taken = perp__small_solve(solver, NULL, &worth);
    if (taken)
        assert_memory_equal(solver->z, z, (size_t)problem->n * sizeof *z);
    perp_lcp_solver_destroy(solver);
    return taken;
}

/* Unique solutions, condition numbers below 1e4 and refined: equal to 1e-11 of numbers up to 12. */
static void test_answers_of_lemke(void **state)
{
    static const int classes[] = {GEN_PD_SYMMETRIC, GEN_PD_UNSYMMETRIC, GEN_P, GEN_M};
    const perp_lcp_settings automatic = run_settings(PERP_LCP_AUTO);
    const perp_lcp_settings lemke = run_settings(PERP_LCP_LEMKE);
    int32_t taken = 0, count = 0;
    gen_random random;

    (void)state;
    gen_seed(&random, 31);
    for (int32_t n = 1; n <= PERP__SMALL_LENGTH + 1; n++)
        for (int32_t k = 0; k < 40; k++) {
            double z[PERP__SMALL_LENGTH + 1], expected[PERP__SMALL_LENGTH + 1];
            perp_lcp_result result, other;
            gen_lcp problem;
            int32_t is_small;

            gen_problem(&problem, &random, n, classes[k % 4], GEN_PLAIN);
            is_small = is_taken(&problem, &automatic, z, &result);
            assert_false(is_taken(&problem, &lemke, expected, &other));
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            assert_int_equal(other.outcome, PERP_OUTCOME_SOLVED);
            for (int32_t i = 0; i < n; i++) {
                assert_true(fabs(z[i] - expected[i]) <= 1e-11);
                if (problem.z[i] + problem.w[i] > 0.0) /* else either is right */
                    assert_true((z[i] == 0.0) == (expected[i] == 0.0));
            }
            assert_true(!is_small || n <= PERP__SMALL_LENGTH);
            taken += is_small;
            count += n <= PERP__SMALL_LENGTH;
            gen_destroy(&problem);
        }
    /* matrices that fall into parts are not taken, and a step of refinement may be too few for one
     * in a hundred */
    assert_true(taken > count / 2);
}

/* Bounds, limits, a monitor, another rule: each alone keeps it from being taken. */
static int32_t never(const perp_lcp_progress *progress, void *user)
{
    (void)progress;
    (void)user;
    return 0;
}

static void test_what_it_leaves_alone(void **state)
{
    gen_random random;
    perp_lcp_result result;
    gen_lcp problem;
    double z[8], upper[8];

    (void)state;
    gen_seed(&random, 32);
    gen_problem(&problem, &random, 8, GEN_PD_SYMMETRIC, GEN_PLAIN);
    for (int32_t k = 0; k < 7; k++) {
        perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);

        settings.max_iterations = k == 1 ? 1000 : 0;
        settings.time_limit = k == 2 ? 1000.0 : 0.0;
        settings.polish = k != 3;
        settings.pivot_rule = k == 4 ? PERP_PIVOT_LEXICOGRAPHIC : PERP_PIVOT_HARRIS;
        settings.monitor = k == 5 ? never : NULL;
        for (int32_t i = 0; i < 8; i++)
            upper[i] = i == 3 ? 1e6 : INFINITY;
        problem.upper = k == 6 ? upper : NULL;
        assert_int_equal(is_taken(&problem, &settings, z, &result), k == 0);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    }
    problem.upper = NULL;
    gen_destroy(&problem);
}

/* w = (z_1 + 2 z_2 - 1, 2 z_1 + z_2 - 1) has three solutions: the start names one. */
static void test_start_decides(void **state)
{
    static const double M[] = {1.0, 2.0, 2.0, 1.0}, q[] = {-1.0, -1.0};
    static const double starts[][2] = {{1.0, 0.0}, {0.0, 1.0}, {1.0 / 3, 1.0 / 3}};
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    perp_lcp_result result;
    perp_matrix view;
    double z[2];

    (void)state;
    perp_matrix_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, 2, 2, M, 2);
    assert_int_equal(perp_lcp_result_init(&result, sizeof result), PERP_OK);
    for (int k = 0; k < 3; k++) {
        assert_int_equal(perp_lcp_solve(context, z, NULL, NULL, &result, &settings, &view, q, NULL,
                                        NULL, starts[k]),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(result.method, PERP_LCP_POLISH);
        assert_int_equal(result.iterations, 0);
        for (int i = 0; i < 2; i++) /* a rounding of 1/3 */
            assert_true(fabs(z[i] - starts[k][i]) <= 1e-16);
    }
}

/* Starts of every kind, far off and at the solution, lead to the solution where it is unique. */
static void test_any_start_leads_to_it(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    int32_t at_once = 0;
    gen_random random;

    (void)state;
    gen_seed(&random, 33);
    for (int32_t k = 0; k < 200; k++) {
        const int32_t n = 2 + k % 12;
        double start[16];
        perp_lcp_result result;
        gen_lcp problem;
        run r;

        gen_problem(&problem, &random, n, k % 2 ? GEN_PD_SYMMETRIC : GEN_PD_UNSYMMETRIC, GEN_PLAIN);
        for (int32_t i = 0; i < n; i++)
            start[i] = k % 3 == 0 ? problem.z[i] : gen_uniform(&random, -2.0, 2.0);
        run_view(&r, context, &problem.view, problem.q, NULL, NULL, &settings, start, "start");
        result = r.result;
        assert_true(run_ok(&r));
        assert_true(run_distance(r.z, problem.z, n) <= 1e-11);
        at_once += k % 3 == 0 && result.method == PERP_LCP_POLISH && result.iterations == 0;
        run_release(&r);
        gen_destroy(&problem);
    }
    assert_int_equal(at_once, 67);
}

/* w = -z - 1 < 0 whatever z is: the way ends in a ray, which it does not judge. */
static void test_rays_are_left_to_lemke(void **state)
{
    static const double M[] = {-1.0, -1.0, -1.0, -2.0}, q[] = {-1.0, -1.0};
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    perp_lcp_result result;
    perp_matrix view;
    double z[2], ray[2];

    (void)state;
    perp_matrix_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, 2, 2, M, 2);
    assert_int_equal(perp_lcp_result_init(&result, sizeof result), PERP_OK);
    assert_int_equal(
        perp_lcp_solve(context, z, NULL, ray, &result, &settings, &view, q, NULL, NULL, NULL),
        PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_RAY);
    assert_int_equal(result.certificate, PERP_CERTIFICATE_INFEASIBLE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_answers_of_lemke),       cmocka_unit_test(test_what_it_leaves_alone),
        cmocka_unit_test(test_start_decides),          cmocka_unit_test(test_any_start_leads_to_it),
        cmocka_unit_test(test_rays_are_left_to_lemke),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
