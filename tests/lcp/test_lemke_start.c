/* Where Lemke's method starts: crashes by block pivoting, and the basis that a caller's start
 * names. Both may only change how many steps it takes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "run.h"

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

static perp_lcp_settings lemke(int32_t crash, int32_t polish)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);

    settings.crash = crash;
    settings.polish = polish;
    return settings;
}

/* ---- crash ---------------------------------------------------------------------------------- */

/* Condition numbers are below 1e6 (triangles: 1e8), |z| below 12, and the basis is solved to a few
 * of these roundings; for singular M only w is unique. */
static void compare(const gen_lcp *problem, const run *r, int class, const char *where)
{
    double off = class == GEN_PSD_LOW_RANK ? run_distance(r->w, problem->w, problem->n)
                                           : run_distance(r->z, problem->z, problem->n);

    if (!run_ok(r))
        fail_msg("%s: %s, residual %g", where, perp_outcome_text(r->result.outcome),
                 r->result.residual);
    if (!(off <= 1e-6))
        fail_msg("%s: off by %g", where, off);
}

static void test_crash_and_cold_agree(void **state)
{
    int64_t steps[2][GEN_CLASSES] = {{0}};
    gen_random random;
    int round;
    int32_t crash;

    (void)state;
    gen_seed(&random, 71);
    for (round = 0; round < 900; round++) {
        const int class = round % GEN_CLASSES, bounds = round / GEN_CLASSES % GEN_BOUNDS;
        const int32_t n = 8 + gen_integer(&random, class == GEN_P ? 5 : 40);
        char where[96];
        gen_lcp problem;

        gen_problem(&problem, &random, n, class, bounds);
        for (crash = 0; crash < 2; crash++) {
            perp_lcp_settings settings = lemke(crash, round / 15 % 2);
            run r;

            snprintf(where, sizeof where, "round %d, class %d, bounds %d, n %d, crash %d", round,
                     class, bounds, (int)n, (int)crash);
            run_lcp(&r, context, &problem, &settings, NULL, where);
            compare(&problem, &r, class, where);
            assert_int_equal(r.result.method, PERP_LCP_LEMKE);
            steps[crash][class] += r.result.iterations;
            run_release(&r);
        }
        gen_destroy(&problem);
    }
    assert_true(4 * steps[1][GEN_PD_SYMMETRIC] < steps[0][GEN_PD_SYMMETRIC]);
    assert_true(4 * steps[1][GEN_PD_UNSYMMETRIC] < steps[0][GEN_PD_UNSYMMETRIC]);
    assert_true(4 * steps[1][GEN_M] < steps[0][GEN_M]);
}

/* Block pivoting goes round on the first four indices (a circulant P-matrix that a fourth variable
 * pushes; by enumeration z = (7, 4, 19, 9) / 9 is the solution), and solves the rest, z = -q, at
 * once. So the crash ends near the solution, and Lemke's method does the rest from there. */
static void test_a_crash_that_cycles(void **state)
{
    enum { LARGE = 40 };
    static const int corner[] = {1, 0, 2, -3, 2, 1, 0, -3, 0, 2, 1, -2, 0, 0, 0, 1};
    static const int pushed[] = {-2, 1, -1, -1}, ninths[] = {7, 4, 19, 9};
    static int M[LARGE * LARGE], q[LARGE];
    int32_t crash, i;
    int64_t steps[2];
    gen_lcp problem;

    (void)state;
    for (i = 0; i < LARGE; i++) {
        M[i * LARGE + i] = 1;
        q[i] = i % 2 ? 1 + i : -1 - i;
    }
    for (i = 0; i < 16; i++)
        M[i / 4 * LARGE + i % 4] = corner[i];
    memcpy(q, pushed, sizeof pushed);
    gen_from_integers(&problem, LARGE, M, q);
    for (crash = 0; crash < 2; crash++) {
        perp_lcp_settings settings = lemke(crash, 0);
        run r;

        run_lcp(&r, context, &problem, &settings, NULL, "circulant");
        assert_true(run_ok(&r));
        for (i = 0; i < LARGE; i++) /* exact but for ninths, and t, which starts at 39 */
            assert_true(fabs(r.z[i] - (i < 4 ? ninths[i] / 9.0 : q[i] < 0 ? -q[i] : 0)) <= 1e-13);
        steps[crash] = r.result.iterations;
        run_release(&r);
    }
    assert_true(steps[0] > 20);
    assert_true(steps[1] > 4 && steps[1] <= 16); /* four rounds, patience, a few pivots */
    gen_destroy(&problem);
}

/* Zeros on the diagonal: not even a look. */
static void test_contact_problems_are_not_crashed(void **state)
{
    const gen_contact_options options = {4, 6, 4, 100, 1.0, 1, 0};
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 72);
    for (round = 0; round < 20; round++) {
        perp_lcp_settings with = lemke(1, 1), without = lemke(0, 1);
        gen_lcp problem;
        run a, b;

        gen_contact(&problem, &random, &options);
        run_lcp(&a, context, &problem, &with, NULL, "with");
        run_lcp(&b, context, &problem, &without, NULL, "without");
        assert_int_equal(a.result.iterations, b.result.iterations);
        assert_memory_equal(a.z, b.z, (size_t)problem.n * sizeof(double));
        run_release(&a);
        run_release(&b);
        gen_destroy(&problem);
    }
}

/* ---- warm ----------------------------------------------------------------------------------- */

/* M = I with 0 <= z <= u: z_i = mid(0, -q_i, u_i), each index by itself. From cold Lemke's method
 * takes a pivot for t and at least one step for every z_i > 0. */
enum { N = 24 };

/* z_i at 0, between 0 and infinity, at its upper bound 2, between 0 and 2. */
static const double q_of_kind[] = {1.0, -1.0, -3.0, -1.25};

static void diagonal_problem(gen_lcp *problem, double *lower, double *upper)
{
    static int M[N * N], zero[N];
    int32_t i;

    for (i = 0; i < N; i++)
        M[i * N + i] = 1;
    gen_from_integers(problem, N, M, zero);
    for (i = 0; i < N; i++) {
        problem->q[i] = q_of_kind[i % 4] - 0.01 * i;
        lower[i] = 0.0;
        upper[i] = i % 4 == 1 ? INFINITY : 2.0;
    }
    problem->lower = lower;
    problem->upper = upper;
}

/* Solves from `start` and returns the number of pivots. */
static int64_t pivots_from(const double *start, const gen_lcp *problem, double *z)
{
    perp_lcp_settings settings = lemke(0, 0);
    int64_t pivots;
    int32_t i;
    run r;

    run_lcp(&r, context, problem, &settings, start, "diagonal");
    for (i = 0; i < N; i++) /* t comes and goes in roundings of numbers below 40 */
        if (!(fabs(r.z[i] - fmin(fmax(-problem->q[i], 0.0), problem->upper[i])) <= 1e-13))
            fail_msg("z[%d] = %g where q = %g", (int)i, r.z[i], problem->q[i]);
    pivots = r.result.iterations;
    if (z)
        memcpy(z, r.z, N * sizeof *z);
    run_release(&r);
    return pivots;
}

/* One index that changes its place costs t's way in and out, and one more step where it crosses a
 * box from bound to bound. Several at once share t. */
static void test_warm_starts_follow_small_changes(void **state)
{
    double lower[N], upper[N], start[N];
    int32_t a, b, i;
    gen_lcp problem;

    (void)state;
    diagonal_problem(&problem, lower, upper);
    assert_true(pivots_from(NULL, &problem, start) >= 1 + N / 4 * 3);
    assert_int_equal(pivots_from(start, &problem, NULL), 0);
    for (a = 0; a < 4; a++)
        for (b = 0; b < 4; b++) {
            const double before = problem.q[a];
            const int same = a == b || (a % 2 && b % 2) || (a == 1 && b == 2);
            int64_t pivots;

            problem.q[a] = q_of_kind[b] + 0.125;
            pivots = pivots_from(start, &problem, NULL);
            assert_true(same ? pivots == 0 : pivots == 2 || (a + b == 2 && pivots == 3));
            problem.q[a] = before;
        }
    for (i = 0; i < 8; i++)
        problem.q[i] = q_of_kind[(i + 1 + i / 4) % 4] + 0.125 * i;
    problem.q[5] = 30.0; /* far below 0: t must not push z_7, also below, past its upper bound */
    problem.q[7] = 0.5;
    i = (int32_t)pivots_from(start, &problem, NULL);
    assert_true(i >= 2 && i <= 12);
    problem.lower = problem.upper = NULL;
    gen_destroy(&problem);
}

/* A small change of q: fewer pivots than from cold, and the right answer. */
static void test_warm_starts_take_fewer_pivots(void **state)
{
    static const int classes[] = {GEN_PD_SYMMETRIC, GEN_PD_UNSYMMETRIC, GEN_M};
    gen_random random;
    int64_t warm_pivots = 0, cold_pivots = 0;
    int round;

    (void)state;
    gen_seed(&random, 73);
    for (round = 0; round < 90; round++) {
        perp_lcp_settings settings = lemke(0, 0);
        const int bounds = round / 3 % GEN_BOUNDS;
        gen_lcp problem;
        run before, cold, warm;
        int32_t i;

        gen_problem(&problem, &random, 20 + gen_integer(&random, 100), classes[round % 3], bounds);
        run_lcp(&before, context, &problem, &settings, NULL, "before");
        for (i = 0; i < problem.n; i++)
            problem.q[i] += gen_uniform(&random, -0.05, 0.05);
        run_lcp(&cold, context, &problem, &settings, NULL, "cold");
        run_lcp(&warm, context, &problem, &settings, before.z, "warm");
        assert_true(run_ok(&cold) && run_ok(&warm));
        assert_true(run_distance(cold.z, warm.z, problem.n) <= 1e-8); /* conditions below 1e6 */
        warm_pivots += warm.result.iterations;
        cold_pivots += cold.result.iterations;
        run_release(&before);
        run_release(&cold);
        run_release(&warm);
        gen_destroy(&problem);
    }
    assert_true(2 * warm_pivots < cold_pivots);
}

/* Small integers of any class, the start at random: what the cold start solves stays solved, what
 * is infeasible stays so, and no ray is reported that only the warm path met. */
static void test_no_start_does_harm(void **state)
{
    gen_random random;
    int round, rays = 0;

    (void)state;
    gen_seed(&random, 74);
    for (round = 0; round < 3000; round++) {
        const int32_t n = 1 + gen_integer(&random, 10);
        int M[100], q[10];
        perp_lcp_settings settings = lemke(round & 1, round >> 1 & 1);
        double start[10];
        gen_lcp problem;
        run cold, warm;
        int32_t i;

        for (i = 0; i < n * n; i++)
            M[i] = gen_integer(&random, 5) - (round % 3 ? 1 : 2);
        for (i = 0; i < n; i++) {
            q[i] = gen_integer(&random, 9) - 5;
            start[i] = gen_integer(&random, 2) ? gen_integer(&random, 3) : 0;
        }
        gen_from_integers(&problem, n, M, q);
        run_lcp(&cold, context, &problem, &settings, NULL, "cold");
        run_lcp(&warm, context, &problem, &settings, start, "warm");
        if (run_ok(&cold) && !run_ok(&warm))
            fail_msg("round %d: solved from cold, but warm: %s", round,
                     perp_outcome_text(warm.result.outcome));
        if (cold.result.certificate != warm.result.certificate)
            fail_msg("round %d: another certificate", round);
        if (warm.result.outcome == PERP_OUTCOME_RAY) {
            assert_int_equal(cold.result.outcome, PERP_OUTCOME_RAY);
            rays++;
        }
        run_release(&cold);
        run_release(&warm);
        gen_destroy(&problem);
    }
    assert_true(rays > 100);
}

/* ---- limits and stops ----------------------------------------------------------------------- */

static int32_t stop_at_once(const perp_lcp_progress *progress, void *user)
{
    assert_int_equal(progress->method, PERP_LCP_LEMKE);
    return *(const int32_t *)user;
}

static void test_limits_and_stops(void **state)
{
    int32_t answer = 1, limit;
    gen_random random;
    gen_lcp problem;
    run r;

    (void)state;
    gen_seed(&random, 75);
    gen_problem(&problem, &random, 60, GEN_PD_UNSYMMETRIC, GEN_BOXED);
    for (limit = 1; limit < 30; limit++) {
        perp_lcp_settings settings = lemke(1, 0);

        settings.max_iterations = limit;
        run_lcp(&r, context, &problem, &settings, NULL, "limited");
        assert_true(r.result.iterations <= limit);
        assert_true(run_ok(&r) || r.result.outcome == PERP_OUTCOME_ITERATION_LIMIT);
        assert_true(limit < 20 || run_ok(&r));
        run_release(&r);
        settings.crash = 0;
        run_lcp(&r, context, &problem, &settings, problem.z, "limited, warm");
        assert_true(r.result.iterations <= limit);
        run_release(&r);
    }
    {
        perp_lcp_settings settings = lemke(1, 0);
        perp_lcp_result result;
        double z[60];

        settings.monitor = stop_at_once;
        settings.monitor_user = &answer;
        run_lcp(&r, context, &problem, &settings, NULL, "stopped");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_STOPPED);
        run_release(&r);
        answer = -1;
        assert_int_equal(perp_lcp_result_init(&result, sizeof result), PERP_OK);
        assert_int_equal(perp_lcp_solve(context, z, NULL, NULL, &result, &settings, &problem.view,
                                        problem.q, problem.lower, problem.upper, NULL),
                         PERP_ERROR_CALLBACK);
        settings.monitor = NULL;
        settings.time_limit = 1e-300;
        run_lcp(&r, context, &problem, &settings, NULL, "late");
        assert_true(run_ok(&r) || r.result.outcome == PERP_OUTCOME_TIME_LIMIT);
        run_release(&r);
    }
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_crash_and_cold_agree),
        cmocka_unit_test(test_a_crash_that_cycles),
        cmocka_unit_test(test_contact_problems_are_not_crashed),
        cmocka_unit_test(test_warm_starts_follow_small_changes),
        cmocka_unit_test(test_warm_starts_take_fewer_pivots),
        cmocka_unit_test(test_no_start_does_harm),
        cmocka_unit_test(test_limits_and_stops),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
