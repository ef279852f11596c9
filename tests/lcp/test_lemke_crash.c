/* Crashes by active sets: they may only change how many steps Lemke's method takes. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

static perp_lcp_settings lemke(int32_t crash, int32_t polish)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);

    settings.crash = crash;
    settings.polish = polish;
    return settings;
}

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
}

/* From n = 256 on rounds by LU pay too. */
static void test_large_unsymmetric(void **state)
{
    gen_random random;
    int32_t bounds, crash;

    (void)state;
    gen_seed(&random, 76);
    for (bounds = 0; bounds < GEN_BOUNDS; bounds++) {
        int64_t steps[2];
        gen_lcp problem;

        gen_problem(&problem, &random, 256, GEN_PD_UNSYMMETRIC, bounds);
        for (crash = 0; crash < 2; crash++) {
            perp_lcp_settings settings = lemke(crash, 1);
            run r;

            run_lcp(&r, context, &problem, &settings, NULL, "large");
            compare(&problem, &r, GEN_PD_UNSYMMETRIC, "large");
            steps[crash] = r.result.iterations;
            run_release(&r);
        }
        assert_true(4 * steps[1] < steps[0]);
        gen_destroy(&problem);
    }
}

/* Murty's triangle is solved by the second of the sweeps that come first: one is not exceeded. */
static void test_sweeps_before_a_crash_are_limited(void **state)
{
    enum { N = 100 };
    static double q[N];
    double *M = check_allocate(N * N, sizeof *M);
    perp_matrix view = fresh_matrix();

    (void)state;
    for (int32_t i = 0; i < N; i++) {
        q[i] = -1.0;
        for (int32_t j = i; j < N; j++)
            M[N * i + j] = i == j ? 1.0 : 2.0;
    }
    perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, N, N, M, N);
    for (int32_t limit = 0; limit <= 1; limit++) {
        perp_lcp_settings settings = lemke(1, 1);
        run r;

        settings.max_iterations = limit;
        run_view(&r, context, &view, q, NULL, NULL, &settings, NULL, "limit");
        assert_int_equal(r.result.iterations, limit > 0 ? 1 : 2);
        assert_int_equal(r.result.outcome,
                         limit > 0 ? PERP_OUTCOME_ITERATION_LIMIT : PERP_OUTCOME_SOLVED);
        run_release(&r);
    }
    free(M);
}

static int32_t count_up(const perp_lcp_progress *progress, void *user)
{
    int64_t *last = user;

    assert_true(progress->iterations >= *last);
    *last = progress->iterations;
    return 0;
}

/* Block pivoting goes round on the first four indices (a circulant P-matrix that a fourth variable
 * pushes; by enumeration z = (7, 4, 19, 9) / 9 is the solution), and solves the rest, z = -q, at
 * once. So the crash ends near the solution, and Lemke's method does the rest from there. */
static void test_a_crash_that_cycles(void **state)
{
    enum { LARGE = 256 };
    static const int corner[] = {1, 0, 2, -3, 2, 1, 0, -3, 0, 2, 1, -2, 0, 0, 0, 1};
    static const int pushed[] = {-2, 1, -1, -1}, ninths[] = {7, 4, 19, 9};
    static int M[LARGE * LARGE], q[LARGE];
    int32_t crash, i;
    int64_t steps[2];
    gen_lcp problem;

    (void)state;
    for (i = 0; i < LARGE; i++) {
        M[i * LARGE + i] = 1;
        q[i] = i % 2 ? 1 + i % 40 : -1 - i % 40;
    }
    for (i = 0; i < 16; i++)
        M[i / 4 * LARGE + i % 4] = corner[i];
    memcpy(q, pushed, sizeof pushed);
    gen_from_integers(&problem, LARGE, M, q);
    for (crash = 0; crash < 2; crash++) {
        perp_lcp_settings settings = lemke(crash, 0);
        int64_t last = 0;
        run r;

        settings.monitor = count_up;
        settings.monitor_user = &last;
        run_lcp(&r, context, &problem, &settings, NULL, "circulant");
        assert_true(last > 0 && last <= r.result.iterations);
        assert_true(run_ok(&r));
        for (i = 0; i < LARGE; i++) /* exact but for ninths, and t, which starts at 40 */
            assert_true(fabs(r.z[i] - (i < 4 ? ninths[i] / 9.0 : q[i] < 0 ? -q[i] : 0)) <= 1e-13);
        steps[crash] = r.result.iterations;
        run_release(&r);
    }
    assert_true(steps[0] > LARGE / 4);
    assert_true(steps[1] > 4 && steps[1] <= 16); /* four rounds, patience, a few pivots */
    gen_destroy(&problem);
}

/* Entries in (0, 1) and no larger ones on the diagonal: no positive definite M has so many, and a
 * crash would take longer than the path, of a few pivots. Its rounds would be counted with these.
 */
static void test_large_couplings_are_not_crashed(void **state)
{
    enum { LARGE = 256 };
    perp_lcp_settings with = lemke(1, 1), without = lemke(0, 1);
    gen_random random;
    gen_lcp problem;
    run a, b;

    (void)state;
    gen_seed(&random, 73);
    gen_begin_dense(&problem, LARGE);
    for (int32_t i = 0; i < LARGE; i++) {
        problem.q[i] = gen_uniform(&random, -1.0, 1.0);
        for (int32_t j = 0; j < LARGE; j++)
            problem.M[LARGE * i + j] = gen_uniform(&random, 0.0, 1.0) + (i == j ? 0.1 : 0.0);
    }
    run_lcp(&a, context, &problem, &with, NULL, "with");
    run_lcp(&b, context, &problem, &without, NULL, "without");
    assert_true(run_ok(&a));
    assert_int_equal(a.result.iterations, b.result.iterations);
    assert_memory_equal(a.z, b.z, LARGE * sizeof(double));
    run_release(&a);
    run_release(&b);
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
    gen_problem(&problem, &random, 60, GEN_PD_SYMMETRIC, GEN_BOXED);
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
        assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
        assert_int_equal(perp_lcp_solve(context, z, NULL, NULL, &result, &settings,
                                        LCP(&problem.view, problem.q, problem.lower, problem.upper),
                                        NULL),
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
        cmocka_unit_test(test_large_unsymmetric),
        cmocka_unit_test(test_sweeps_before_a_crash_are_limited),
        cmocka_unit_test(test_a_crash_that_cycles),
        cmocka_unit_test(test_large_couplings_are_not_crashed),
        cmocka_unit_test(test_contact_problems_are_not_crashed),
        cmocka_unit_test(test_limits_and_stops),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
