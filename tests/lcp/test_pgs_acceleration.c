/* Projected Gauss-Seidel with help: conjugate gradients, and the polish that takes over once the
 * active set has settled. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

/* ---- conjugate gradients --------------------------------------------------------------------- */

static int64_t sweeps_of(const gen_lcp *problem, const perp_lcp_settings *settings)
{
    int64_t sweeps;
    run r;

    run_lcp(&r, context, problem, settings, NULL, "acceleration");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    sweeps = r.result.iterations;
    run_release(&r);
    return sweeps;
}

/* -u'' over an obstacle that holds all but two stretches of 32 nodes: plain sweeps shrink errors by
 * cos^2(pi h) = 1 - O(h^2), h = 1/33, conjugate gradients by 1 - O(h) a step (Axelsson 1972 for
 * symmetric sweeps): a factor of the order 33, of which a fifth has to show. Over-relaxed forward
 * sweeps are no gradient of anything: the safeguard has to bring them home. */
static void test_acceleration(void **state)
{
    perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-10);
    gen_lcp problem;
    int64_t plain, forward, symmetric;

    (void)state;
    gen_obstacle(&problem, 32);
    settings.max_iterations = 100000;
    plain = sweeps_of(&problem, &settings);
    settings.acceleration = PERP_ACCELERATION_CONJUGATE_GRADIENT;
    forward = sweeps_of(&problem, &settings);
    settings.sweep = PERP_SWEEP_SYMMETRIC;
    symmetric = sweeps_of(&problem, &settings);
    assert_true(forward < plain / 2);
    assert_true(symmetric < plain * 5 / 33);
    settings.sweep = PERP_SWEEP_FORWARD;
    settings.relaxation = 1.95;
    assert_true(sweeps_of(&problem, &settings) < plain);
    gen_destroy(&problem);
}

/* On problems of every kind that plain sweeps solve, within the same limit. */
static void test_acceleration_solves_what_sweeps_solve(void **state)
{
    (void)state;
    for (int k = 0; k < 60; k++) {
        perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-10);
        gen_random random;
        gen_lcp problem;
        run plain, fast;

        gen_seed(&random, 500 + (uint64_t)k);
        gen_problem(&problem, &random, 1 + k / 2, k % GEN_CLASSES, k / GEN_CLASSES % GEN_BOUNDS);
        settings.max_iterations = 2000;
        settings.relaxation = k % 7 == 0 ? 1.5 : 1.0;
        settings.sweep = k % 2 ? PERP_SWEEP_SYMMETRIC : PERP_SWEEP_FORWARD;
        run_lcp(&plain, context, &problem, &settings, NULL, "plain");
        settings.acceleration = PERP_ACCELERATION_CONJUGATE_GRADIENT;
        run_lcp(&fast, context, &problem, &settings, NULL, "accelerated");
        if (plain.result.outcome == PERP_OUTCOME_SOLVED)
            assert_int_equal(fast.result.outcome, PERP_OUTCOME_SOLVED);
        run_release(&fast);
        settings.polish = 1;
        run_lcp(&fast, context, &problem, &settings, NULL, "accelerated and polished");
        if (plain.result.outcome == PERP_OUTCOME_SOLVED)
            assert_int_equal(fast.result.outcome, PERP_OUTCOME_SOLVED);
        run_release(&plain);
        run_release(&fast);
        gen_destroy(&problem);
    }
}

/* Singular, without a solution, or running away: it ends, and says so. */
static void test_acceleration_ends(void **state)
{
    static const double values[3][4] = {
        {1.0, -1.0, -1.0, 1.0}, {1.0, 2.0, 2.0, 1.0}, {1.0, -3.0, 3.0, 1.0}};
    static const double q[] = {-1.0, -0.5}, lower[] = {-INFINITY, -INFINITY};
    static const double upper[] = {INFINITY, INFINITY};

    (void)state;
    for (int k = 0; k < 6; k++) {
        perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-10);
        perp_matrix M = run_dense(values[k % 3], 2);
        run r;

        settings.acceleration = PERP_ACCELERATION_CONJUGATE_GRADIENT;
        settings.sweep = k < 3 ? PERP_SWEEP_FORWARD : PERP_SWEEP_SYMMETRIC;
        run_view(&r, context, &M, q, k % 3 == 0 ? NULL : lower, upper, &settings, NULL, "no end");
        assert_true(r.result.outcome == PERP_OUTCOME_STALLED ||
                    r.result.outcome == PERP_OUTCOME_SOLVED);
        assert_true(r.result.residual <= 1.0); /* no worse than the start */
        run_release(&r);
    }
}

/* ---- the polish takes over ------------------------------------------------------------------- */

/* A stack under a mass a hundred times its own (test_pgs.c): 2314 sweeps for 1e-10, but the active
 * set is right from the second sweep on, and the polish asked at the first look after 30. */
static void test_the_polish_takes_over(void **state)
{
    static const double values[4] = {1.0, -1.0, -1.0, 1.01}, q[] = {-1.0, 0.0};
    perp_matrix M = run_dense(values, 2);
    perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-10);
    run r;

    (void)state;
    settings.polish = 1;
    run_view(&r, context, &M, q, NULL, NULL, &settings, NULL, "stack");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_in_range(r.result.iterations, 30, 50);
    assert_true(r.result.backward_error <= 4.0 * 2.3e-16);
    run_release(&r);
}

/* Where the polish can't help, the sweeps go on, to the same end and count as without it. No z has
 * M z + q >= 0 here: z runs away, and nothing of the active set changes. */
static void test_sweeps_go_on_after_a_pause(void **state)
{
    static const double values[] = {1.0, -1.0, -1.0, 1.0}, q[] = {-1.0, 0.5};
    perp_matrix M = run_dense(values, 2);
    int64_t sweeps[2];

    (void)state;
    for (int polish = 0; polish < 2; polish++) {
        perp_lcp_settings settings = run_alone(PERP_LCP_PGS, 1e-10);
        run r;

        settings.polish = polish;
        run_view(&r, context, &M, q, NULL, NULL, &settings, NULL, "no solution");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_STALLED);
        sweeps[polish] = r.result.iterations;
        run_release(&r);
        settings.max_iterations = 333;
        run_view(&r, context, &M, q, NULL, NULL, &settings, NULL, "a limit");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
        assert_int_equal(r.result.iterations, 333);
        run_release(&r);
    }
    assert_int_equal(sweeps[0], sweeps[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_acceleration),
        cmocka_unit_test(test_acceleration_solves_what_sweeps_solve),
        cmocka_unit_test(test_acceleration_ends),
        cmocka_unit_test(test_the_polish_takes_over),
        cmocka_unit_test(test_sweeps_go_on_after_a_pause),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
