/* The basis that a caller's start names: it may only change how many pivots Lemke's method takes.
 */
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

/* Traffic from every node of a grid to one corner: x on the roads, to and fro, and times t,
 *   0 <= x perp cost + slope x + t_head - t_tail >= 0,   0 <= t perp out - in - demand >= 0. */
enum { SIDE = 20, NODES = SIDE * SIDE, ROADS = 4 * SIDE * (SIDE - 1), ALL = ROADS + NODES };

static void traffic_problem(gen_lcp *dense, gen_lcp *sparse, gen_random *random)
{
    int *M = gen_allocate((size_t)ALL * ALL, sizeof *M), *zero = gen_allocate(ALL, sizeof *zero);
    int32_t road = 0;

    for (int32_t a = 0; a < NODES; a++)
        for (int32_t way = 0; way < 4; way++) {
            const int32_t x = a % SIDE + (way == 0) - (way == 1);
            const int32_t y = a / SIDE + (way == 2) - (way == 3), b = SIDE * y + x;

            if (x < 0 || x >= SIDE || y < 0 || y >= SIDE)
                continue;
            M[road * ALL + road] = 1;
            M[road * ALL + ROADS + a] = -1;
            M[(ROADS + a) * ALL + road] = a > 0;
            M[road * ALL + ROADS + b] = b > 0;
            M[(ROADS + b) * ALL + road] = b > 0 ? -1 : 0;
            road++;
        }
    for (int32_t i = 0; i < ALL; i++)
        M[ROADS * ALL + i] = i == ROADS; /* the corner: t = 0 */
    assert_int_equal(road, ROADS);
    gen_from_integers(dense, ALL, M, zero);
    for (int32_t i = 0; i < ALL; i++)
        dense->q[i] = i < ROADS ? gen_uniform(random, 1, 2) : i == ROADS ? 0.0 : -0.01;
    gen_to_csc(sparse, dense);
    free(M);
    free(zero);
}

/* A solution of the problem before leaves equations unsolved where costs have changed, so that w
 * does not say what is at a bound: z does. Pivots from there are far fewer than from cold. */
static void test_a_start_names_its_set_by_z_alone(void **state)
{
    perp_lcp_settings settings = lemke(1, 1);
    gen_random random;
    gen_lcp dense, sparse, problem;
    run before, cold, warm;

    (void)state;
    gen_seed(&random, 12);
    traffic_problem(&dense, &sparse, &random);
    problem = dense;
    problem.view = sparse.view;
    run_lcp(&before, context, &problem, &settings, NULL, "traffic");
    for (int32_t i = 0; i < ROADS; i++)
        problem.q[i] *= gen_uniform(&random, 1.0, 1.01);
    run_lcp(&cold, context, &problem, &settings, NULL, "traffic, cold");
    run_lcp(&warm, context, &problem, &settings, before.z, "traffic, warm");
    assert_int_equal(cold.result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(warm.result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(cold.result.iterations > NODES);
    assert_true(10 * warm.result.iterations < cold.result.iterations);
    run_release(&before);
    run_release(&cold);
    run_release(&warm);
    gen_destroy(&sparse);
    gen_destroy(&dense);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_warm_starts_follow_small_changes),
        cmocka_unit_test(test_warm_starts_take_fewer_pivots),
        cmocka_unit_test(test_no_start_does_harm),
        cmocka_unit_test(test_a_start_names_its_set_by_z_alone),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
