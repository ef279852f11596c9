/* Primal-dual active sets for dense problems: against known solutions, on problems made to cycle,
 * and honest where they fail. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

static perp_lcp_settings active_set(int32_t polish)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_ACTIVE_SET);

    settings.polish = polish;
    return settings;
}

/* ---- random problems with known solutions --------------------------------------------------- */

/* Condition numbers are below 1e6 (triangles: 1e8), |z| below 12. Without polish that is what the
 * error may be in units of 1e-16; wrong active sets are off by 1/16 as a rule. */
static void require_solution(const gen_lcp *problem, const run *r, const char *where)
{
    if (!run_ok(r))
        fail_msg("%s: %s, residual %g", where, perp_outcome_text(r->result.outcome),
                 r->result.residual);
    assert_int_equal(r->result.method, PERP_LCP_ACTIVE_SET);
    if (!(run_distance(r->z, problem->z, problem->n) <= 1e-6))
        fail_msg("%s: off by %g", where, run_distance(r->z, problem->z, problem->n));
}

static const int classes[] = {GEN_PD_SYMMETRIC, GEN_PD_UNSYMMETRIC, GEN_M, GEN_P};

/* Row-major, column-major (an unsymmetric M is told from its transpose), and small sparse. */
static void solve_in_every_storage(const gen_lcp *problem, const perp_lcp_settings *settings,
                                   const char *where)
{
    const size_t n = (size_t)problem->n;
    double *turned = check_allocate(n * n + 1, sizeof *turned);
    perp_matrix view = fresh_matrix();
    gen_lcp sparse;
    size_t i, j;
    run r;

    run_lcp(&r, context, problem, settings, NULL, where);
    require_solution(problem, &r, where);
    run_release(&r);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            turned[i + j * n] = problem->M[i * n + j];
    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, problem->n, problem->n,
                                       turned, problem->n),
                     PERP_OK);
    run_view(&r, context, &view, problem->q, problem->lower, problem->upper, settings, NULL, where);
    require_solution(problem, &r, where);
    run_release(&r);
    free(turned);
    if (problem->n > 64)
        return;
    gen_to_csc(&sparse, problem);
    run_view(&r, context, &sparse.view, problem->q, problem->lower, problem->upper, settings, NULL,
             where);
    require_solution(problem, &r, where);
    run_release(&r);
    gen_destroy(&sparse);
}

static void test_known_solutions(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 61);
    for (round = 0; round < 1200; round++) {
        const int class = classes[round % 4], bounds = round / 4 % GEN_BOUNDS;
        const int32_t n = 1 + gen_integer(&random, class == GEN_P ? 12 : 40);
        perp_lcp_settings settings = active_set(round / 12 % 2);
        char where[96];
        gen_lcp problem;

        snprintf(where, sizeof where, "round %d, class %d, bounds %d, n %d", round, class, bounds,
                 (int)n);
        gen_problem(&problem, &random, n, class, bounds);
        solve_in_every_storage(&problem, &settings, where);
        gen_destroy(&problem);
    }
}

/* Sizes at which factors are kept from round to round. */
static void test_large(void **state)
{
    static const int32_t sizes[] = {63, 64, 65, 120, 200};
    gen_random random;
    size_t s;
    int kind;

    (void)state;
    gen_seed(&random, 62);
    for (s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (kind = 0; kind < 9; kind++) {
            perp_lcp_settings settings = active_set(kind % 2);
            gen_lcp problem;

            gen_problem(&problem, &random, sizes[s], classes[kind % 3], kind / 3);
            solve_in_every_storage(&problem, &settings, "large");
            gen_destroy(&problem);
        }
}

/* ---- made to cycle -------------------------------------------------------------------------- */

/* Circulants I + 2 P of odd order are P-matrices. With q = -e, z = e / 3; with q = e, z = 0. */
static void test_circulants(void **state)
{
    int32_t n, i, kind;

    (void)state;
    for (n = 3; n <= 9; n += 2)
        for (kind = 0; kind < 4; kind++) {
            const int turned = kind & 1, sign = kind >> 1 ? 1 : -1;
            perp_lcp_settings settings = active_set(0);
            int M[81] = {0}, q[9];
            double start[9] = {1.0};
            gen_lcp problem;
            run r;

            for (i = 0; i < n; i++) {
                const int32_t next = (i + 1) % n;

                q[i] = sign;
                M[i * n + i] = 1;
                M[turned ? next * n + i : i * n + next] = 2;
            }
            gen_from_integers(&problem, n, M, q);
            run_lcp(&r, context, &problem, &settings, start, "circulant");
            assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
            for (i = 0; i < n; i++) /* condition numbers below 3, and of the borders */
                assert_true(fabs(r.z[i] - (sign < 0 ? 1.0 / 3.0 : 0.0)) <= 1e-14);
            run_release(&r);
            gen_destroy(&problem);
        }
}

/* A circulant that a fourth variable pushes: full exchanges go round for ever, the one index that
 * is wrong hands over to its neighbour (Ben Gharbia & Gilbert, "Nonconvergence of the plain
 * Newton-min algorithm for linear complementarity problems with a P-matrix", Math. Programming 134,
 * 2012). With one index at a time the method is finite. By enumeration z = (7, 4, 19, 9) / 9. */
static void test_exchanges_that_go_round(void **state)
{
    static const int M[] = {1, 0, 2, -3, 2, 1, 0, -3, 0, 2, 1, -2, 0, 0, 0, 1};
    static const int q[] = {-2, 1, -1, -1}, ninths[] = {7, 4, 19, 9};
    const perp_lcp_settings settings = active_set(0);
    gen_lcp problem;
    run r;

    (void)state;
    gen_from_integers(&problem, 4, M, q);
    run_lcp(&r, context, &problem, &settings, NULL, "pushed");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(r.result.iterations > 10);
    for (int32_t i = 0; i < 4; i++) /* the condition number is below 30 */
        assert_true(fabs(r.z[i] - ninths[i] / 9.0) <= 1e-13);
    run_release(&r);
    gen_destroy(&problem);
}

/* Lemke's method takes 2^n pivots on Murty's triangle; z = (0, ..., 0, 1). */
static void test_murty_triangle(void **state)
{
    enum { N = 12 };
    int M[N * N], q[N], i, j;
    perp_lcp_settings settings = active_set(0);
    gen_lcp problem;
    run r;

    (void)state;
    for (i = 0; i < N; i++) {
        q[i] = -1;
        for (j = 0; j < N; j++)
            M[N * i + j] = i == j ? 1 : j > i ? 2 : 0;
    }
    gen_from_integers(&problem, N, M, q);
    run_lcp(&r, context, &problem, &settings, NULL, "triangle");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    for (i = 0; i < N; i++)
        assert_true(r.z[i] == (i == N - 1 ? 1.0 : 0.0));
    run_release(&r);
    gen_destroy(&problem);
}

/* ---- failures ------------------------------------------------------------------------------- */

static perp_outcome outcome_of(int32_t n, const int *M, const int *q, int32_t polish)
{
    perp_lcp_settings settings = active_set(polish);
    perp_outcome outcome;
    gen_lcp problem;
    run r;

    gen_from_integers(&problem, n, M, q);
    run_lcp(&r, context, &problem, &settings, NULL, "failure"); /* its numbers are checked */
    outcome = r.result.outcome;
    run_release(&r);
    gen_destroy(&problem);
    return outcome;
}

static void test_failures_are_told(void **state)
{
    const int walls[] = {1, -1, -1, 1}, down[] = {-1, -1};
    const int none[] = {0, 1, 0, 0}, apart[] = {-1, 1};
    const int n_matrix[] = {-1, 2, 2, -1}, up[] = {-1, 2};
    int32_t polish;

    (void)state;
    for (polish = 0; polish < 2; polish++) {
        assert_int_equal(outcome_of(2, walls, down, polish), PERP_OUTCOME_SINGULAR);
        assert_int_equal(outcome_of(2, none, apart, polish), PERP_OUTCOME_SINGULAR);
        /* {} -> {1} -> {} and so on: no P-matrix, no end, told after a count of rounds */
        assert_int_equal(outcome_of(2, n_matrix, up, polish), PERP_OUTCOME_ITERATION_LIMIT);
    }
}

/* 64 unknowns of a sparse problem are expanded. */
static void test_storages_it_takes(void **state)
{
    gen_random random;
    int32_t n;

    (void)state;
    gen_seed(&random, 63);
    for (n = 63; n <= 64; n++) {
        perp_lcp_settings settings = active_set(1);
        gen_lcp problem, sparse;
        run r;

        gen_problem(&problem, &random, n, GEN_M, GEN_PLAIN);
        gen_to_csc(&sparse, &problem);
        run_view(&r, context, &sparse.view, problem.q, NULL, NULL, &settings, NULL, "sparse");
        require_solution(&problem, &r, "sparse");
        run_release(&r);
        gen_destroy(&sparse);
        gen_destroy(&problem);
    }
}

/* ---- starts, limits, stops ------------------------------------------------------------------ */

/* The solution's own index set needs one round, and another where w at a bound is rounding. */
static void test_starts(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 64);
    for (round = 0; round < 50; round++) {
        perp_lcp_settings settings = active_set(0);
        gen_lcp problem;
        run cold, warm, near;

        gen_problem(&problem, &random, 30, GEN_PD_SYMMETRIC, round % GEN_BOUNDS);
        run_lcp(&cold, context, &problem, &settings, NULL, "cold");
        run_lcp(&warm, context, &problem, &settings, cold.z, "warm");
        assert_true(cold.result.iterations > 0);
        assert_true(warm.result.iterations <= 2);
        assert_true(run_distance(cold.z, warm.z, 30) <= 1e-9);
        cold.z[round % 30] += 0.5;
        run_lcp(&near, context, &problem, &settings, cold.z, "near");
        require_solution(&problem, &near, "near");
        run_release(&cold);
        run_release(&warm);
        run_release(&near);
        gen_destroy(&problem);
    }
}

typedef struct watcher {
    int calls;
    int32_t answer;
} watcher;

static int32_t watch(const perp_lcp_progress *progress, void *user)
{
    watcher *w = user;

    assert_int_equal(progress->method, PERP_LCP_ACTIVE_SET);
    w->calls++;
    assert_int_equal(progress->iterations, w->calls);
    assert_true(progress->residual > 0.0);
    return w->calls == 2 ? w->answer : 0;
}

static void test_limits_and_stops(void **state)
{
    gen_random random;
    perp_lcp_settings settings = active_set(0);
    watcher w = {0, 0};
    gen_lcp problem;
    run r;

    (void)state;
    gen_seed(&random, 65);
    gen_problem(&problem, &random, 60, GEN_PD_UNSYMMETRIC, GEN_BOXED);
    run_lcp(&r, context, &problem, &settings, NULL, "free");
    assert_true(r.result.iterations > 2);
    run_release(&r);
    settings.max_iterations = 2;
    run_lcp(&r, context, &problem, &settings, NULL, "limited");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
    assert_int_equal(r.result.iterations, 2);
    run_release(&r);
    settings.max_iterations = 0;
    settings.monitor = watch;
    settings.monitor_user = &w;
    run_lcp(&r, context, &problem, &settings, NULL, "watched");
    assert_int_equal(w.calls + 1, (int)r.result.iterations); /* the last one solves it */
    require_solution(&problem, &r, "watched");
    run_release(&r);
    w.calls = 0;
    w.answer = 1;
    run_lcp(&r, context, &problem, &settings, NULL, "stopped");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_STOPPED);
    run_release(&r);
    settings.monitor = NULL;
    settings.time_limit = 1e-300;
    run_lcp(&r, context, &problem, &settings, NULL, "late");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_TIME_LIMIT);
    run_release(&r);
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_solutions),   cmocka_unit_test(test_large),
        cmocka_unit_test(test_circulants),        cmocka_unit_test(test_exchanges_that_go_round),
        cmocka_unit_test(test_murty_triangle),    cmocka_unit_test(test_failures_are_told),
        cmocka_unit_test(test_storages_it_takes), cmocka_unit_test(test_starts),
        cmocka_unit_test(test_limits_and_stops),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
