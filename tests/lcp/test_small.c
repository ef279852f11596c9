/* The shortest way for small dense problems (small.c): where it is taken, that its answers are
 * those of Lemke's method, and that it leaves the rest alone. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "lcp/solver.h"
#include "memory.h"
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

/* Whether the way alone solves it. */
static int32_t is_taken(const gen_lcp *problem, const perp_lcp_settings *settings, const double *z)
{
    perp_lcp_solver *solver = set_up(problem, settings);
    perp__evaluation residuals;
    int32_t taken;

    perp__scale_problem(solver, problem->q);
    taken = perp__small_solve(solver, NULL, &residuals);
    if (taken)
        assert_memory_equal(solver->z, z, (size_t)problem->n * sizeof *z);
    perp_lcp_solver_destroy(solver);
    return taken;
}

static void solve(run *r, const gen_lcp *problem, const perp_lcp_settings *settings)
{
    run_view(r, context, &problem->view, problem->q, problem->lower, problem->upper, settings, NULL,
             "small");
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
            gen_lcp problem;
            int32_t is_small;
            run own, other;

            gen_problem(&problem, &random, n, classes[k % 4], GEN_PLAIN);
            solve(&own, &problem, &automatic);
            solve(&other, &problem, &lemke);
            is_small = is_taken(&problem, &automatic, own.z);
            assert_int_equal(own.result.outcome, PERP_OUTCOME_SOLVED);
            assert_int_equal(other.result.outcome, PERP_OUTCOME_SOLVED);
            for (int32_t i = 0; i < n; i++) {
                assert_true(fabs(own.z[i] - other.z[i]) <= 1e-11);
                if (problem.z[i] + problem.w[i] > 0.0) /* else either is right */
                    assert_true((own.z[i] == 0.0) == (other.z[i] == 0.0));
            }
            assert_true(!is_small || n <= PERP__SMALL_LENGTH);
            taken += is_small;
            count += n <= PERP__SMALL_LENGTH;
            run_release(&own);
            run_release(&other);
            gen_destroy(&problem);
        }
    assert_true(taken > count * 9 / 10); /* those that fall into parts are not */
}

/* Hilbert's matrices in integers, of condition 1e7 and 5e11, z = 1: refined, z is right to a
 * rounding or two, whatever the condition. The first is taken, after one step of refinement; what
 * that leaves of the second is for the polish. */
static void test_ill_conditioned(void **state)
{
    static const double multiples[] = {27720.0, 12252240.0}; /* of 1 .. 11 and 1 .. 17 */
    const perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);

    (void)state;
    for (int32_t k = 0; k < 2; k++) {
        const int32_t n = k == 0 ? 6 : 9;
        gen_lcp problem;
        run r;

        gen_begin_dense(&problem, n);
        for (int32_t i = 0; i < n; i++)
            for (int32_t j = 0; j < n; j++) {
                problem.M[n * i + j] = multiples[k] / (1 + i + j);
                problem.q[i] -= problem.M[n * i + j];
            }
        solve(&r, &problem, &settings);
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        for (int32_t i = 0; i < n; i++)
            assert_true(fabs(r.z[i] - 1.0) <= 0x1p-51);
        assert_int_equal(is_taken(&problem, &settings, r.z), k == 0);
        run_release(&r);
        gen_destroy(&problem);
    }
}

/* A bound, another rule, a budget that is too small, no polish: each alone is for the methods. */
static void test_what_it_leaves_alone(void **state)
{
    gen_random random;
    gen_lcp problem;
    double upper[8];

    (void)state;
    gen_seed(&random, 32);
    gen_problem(&problem, &random, 8, GEN_PD_SYMMETRIC, GEN_PLAIN);
    for (int32_t k = 0; k < 6; k++) {
        perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
        run r;

        settings.max_iterations = k == 1 ? 2 : 0;
        settings.polish = k != 2;
        settings.pivot_rule = k == 3 ? PERP_PIVOT_LEXICOGRAPHIC : PERP_PIVOT_HARRIS;
        settings.time_limit = k == 5 ? 1000.0 : 0.0;
        for (int32_t i = 0; i < 8; i++)
            upper[i] = i == 3 ? 1e6 : INFINITY;
        problem.upper = k == 4 ? upper : NULL;
        solve(&r, &problem, &settings);
        assert_int_equal(is_taken(&problem, &settings, r.z), k == 0 || k == 5);
        assert_true(k == 1 || r.result.outcome == PERP_OUTCOME_SOLVED);
        run_release(&r);
    }
    problem.upper = NULL;
    gen_destroy(&problem);
}

static int32_t answer(const perp_lcp_progress *progress, void *user)
{
    assert_int_equal(progress->method, PERP_LCP_LEMKE);
    return *(int32_t *)user;
}

/* It is asked before the first pivot, as by lemke. */
static void test_monitor_is_obeyed(void **state)
{
    static const double M[] = {2.0, 1.0, 1.0, 2.0}, q[] = {-1.0, -1.0};
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    perp_lcp_result result = fresh_lcp_result();
    perp_matrix view;
    double z[2] = {7.0, 7.0};

    (void)state;
    view = matrix_rows(M, 2, 2);
    settings.monitor = answer;
    for (int32_t say = -1; say <= 1; say++) {
        const perp_status expected = say < 0 ? PERP_ERROR_CALLBACK : PERP_OK;

        settings.monitor_user = &say;
        assert_int_equal(
            perp_lcp_solve(context, z, NULL, NULL, &result, &settings, LCP(&view, q), NULL),
            expected);
        if (say < 0)
            assert_true(z[0] == 7.0);
        else
            assert_true(result.outcome == PERP_OUTCOME_SOLVED || /* the polish may mend it */
                        (say > 0 && result.outcome == PERP_OUTCOME_STOPPED));
    }
}

/* perp_lcp_solve takes no memory for such problems, and some for the next size. */
static void test_one_call_takes_no_memory(void **state)
{
    memory m = {0};
    const perp_context_settings own = memory_settings(&m);
    const perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    perp_context *counting = NULL;
    gen_random random;

    (void)state;
    assert_int_equal(perp_context_create(&counting, &own), PERP_OK);
    gen_seed(&random, 34);
    for (int32_t n = 1; n <= PERP__SMALL_LENGTH + 1; n++) {
        double z[PERP__SMALL_LENGTH + 1];
        perp_lcp_result result = fresh_lcp_result();
        gen_lcp problem;

        gen_problem(&problem, &random, n, GEN_PD_SYMMETRIC, GEN_PLAIN);
        m.calls = 0;
        assert_int_equal(perp_lcp_solve(counting, z, NULL, NULL, &result, &settings,
                                        LCP(&problem.view, problem.q), NULL),
                         PERP_OK);
        assert_true(is_taken(&problem, &settings, z) == (m.calls == 0));
        gen_destroy(&problem);
    }
    perp_context_destroy(counting);
}

/* w = (z_1 + 2 z_2 - 1, 2 z_1 + z_2 - 1) has three solutions: the start names one. */
static void test_start_decides(void **state)
{
    static const double M[] = {1.0, 2.0, 2.0, 1.0}, q[] = {-1.0, -1.0};
    static const double starts[][2] = {{1.0, 0.0}, {0.0, 1.0}, {1.0 / 3, 1.0 / 3}};
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    perp_lcp_result result = fresh_lcp_result();
    perp_matrix view = matrix_rows(M, 2, 2);
    double z[2];

    (void)state;
    for (int k = 0; k < 3; k++) {
        assert_int_equal(
            perp_lcp_solve(context, z, NULL, NULL, &result, &settings, LCP(&view, q), starts[k]),
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
        const int32_t n = 2 + k % 31; /* up to 32, the largest */
        double start[32];
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
    perp_lcp_result result = fresh_lcp_result();
    perp_matrix view = matrix_rows(M, 2, 2);
    double z[2], ray[2];

    (void)state;
    assert_int_equal(perp_lcp_solve(context, z, NULL, ray, &result, &settings, LCP(&view, q), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_RAY);
    assert_int_equal(result.certificate, PERP_CERTIFICATE_INFEASIBLE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_answers_of_lemke),
        cmocka_unit_test(test_ill_conditioned),
        cmocka_unit_test(test_what_it_leaves_alone),
        cmocka_unit_test(test_monitor_is_obeyed),
        cmocka_unit_test(test_start_decides),
        cmocka_unit_test(test_any_start_leads_to_it),
        cmocka_unit_test(test_one_call_takes_no_memory),
        cmocka_unit_test(test_rays_are_left_to_lemke),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
