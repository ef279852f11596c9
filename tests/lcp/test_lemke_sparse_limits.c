/* The sparse Lemke method under limits, from given starts, and within the memory of its factors. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

/* From a point whose active set is off in a few places: a few pivots instead of one for every node.
 * Without the crash the start's own basis is where the path begins. */
static void test_warm_start(void **state)
{
    gen_lcp problem;
    int crash;

    (void)state;
    gen_obstacle_2d(&problem, 24);
    for (crash = 0; crash < 2; crash++) {
        perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
        double *z0 = check_allocate((size_t)problem.n, sizeof *z0);
        int32_t i;
        run r;

        settings.crash = crash;
        settings.polish = 0; /* it would find the solution before any method runs */
        for (i = 0; i < problem.n; i++)
            z0[i] = problem.z[i] + (i % 97 == 5 ? 64.0 : 0.0);
        run_lcp(&r, context, &problem, &settings, z0, "warm");
        assert_true(run_ok(&r));
        assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-9);
        assert_in_range(r.result.iterations, 1, 100);
        run_release(&r);
        run_lcp(&r, context, &problem, &settings, problem.z, "solution");
        assert_true(run_ok(&r));
        assert_int_equal(r.result.iterations, 0);
        run_release(&r);
        free(z0);
    }
    gen_destroy(&problem);
}

/* Iterations are steps of the crash and pivots: the limit holds for their sum, wherever it falls.
 */
static void test_iteration_limit(void **state)
{
    gen_lcp problem;
    int crash, limit;

    (void)state;
    gen_obstacle_2d(&problem, 24);
    for (crash = 0; crash < 2; crash++)
        for (limit = 1; limit < 40; limit += 1 + limit / 3) {
            perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
            run r;

            settings.crash = crash;
            settings.polish = 0;
            settings.max_iterations = limit;
            run_lcp(&r, context, &problem, &settings, NULL, "limit");
            assert_true(r.result.iterations <= limit);
            if (!run_ok(&r)) {
                assert_int_equal(r.result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
                assert_int_equal(r.result.iterations, limit);
            }
            assert_true(crash || !run_ok(&r));
            run_release(&r);
        }
    gen_destroy(&problem);
}

/* Says stop or abort at a given call. */
typedef struct listener {
    int32_t calls, at, answer;
    int64_t last;
} listener;

static int32_t listen(const perp_lcp_progress *progress, void *user)
{
    listener *l = user;

    assert_int_equal(progress->method, PERP_LCP_LEMKE);
    assert_true(progress->iterations > l->last || l->calls == 0);
    l->last = progress->iterations;
    return ++l->calls == l->at ? l->answer : 0;
}

static void test_monitor(void **state)
{
    gen_lcp problem;
    int32_t at, crash;

    (void)state;
    gen_obstacle_2d(&problem, 24);
    for (crash = 0; crash < 2; crash++)
        for (at = 1; at <= 5; at++) {
            perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
            listener l = {0, at, 1, 0};
            perp_lcp_result result;
            double *z = check_allocate((size_t)problem.n, sizeof *z);
            run r;

            settings.crash = crash;
            settings.polish = 0;
            settings.monitor = listen;
            settings.monitor_user = &l;
            run_lcp(&r, context, &problem, &settings, NULL, "stopped");
            assert_int_equal(r.result.outcome, PERP_OUTCOME_STOPPED);
            assert_int_equal(l.calls, at);
            run_release(&r);
            memset(&l, 0, sizeof l);
            l.at = at;
            l.answer = -1;
            assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
            assert_int_equal(perp_lcp_solve(context, z, NULL, NULL, &result, &settings,
                                            LCP(&problem.view, problem.q), NULL),
                             PERP_ERROR_CALLBACK);
            assert_int_equal(l.calls, at);
            free(z);
        }
    gen_destroy(&problem);
}

/* The same bits from a new solver and from one that solved other problems before. */
static void test_determinism(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
    perp_lcp_solver *solver;
    perp_lcp_result result = fresh_lcp_result();
    gen_lcp problem, other;
    double *z = check_allocate(400, sizeof *z);
    int32_t i;
    run r;

    (void)state;
    settings.polish = 0;
    gen_obstacle_2d(&problem, 17);
    gen_obstacle_2d(&other, 20);
    run_lcp(&r, context, &problem, &settings, NULL, "new");
    assert_int_equal(perp_lcp_solver_create(context, &solver, &settings), PERP_OK);
    assert_int_equal(perp_lcp_solver_setup(solver, &other.view, NULL, NULL), PERP_OK);
    assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, other.q, NULL), PERP_OK);
    assert_int_equal(perp_lcp_solver_setup(solver, &problem.view, NULL, NULL), PERP_OK);
    for (i = 0; i < problem.n; i++)
        other.q[i] = i % 2 ? -1.0 : 0.5;
    assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, other.q, NULL), PERP_OK);
    assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, problem.q, NULL),
                     PERP_OK);
    assert_memory_equal(z, r.z, (size_t)problem.n * sizeof *z);
    perp_lcp_solver_destroy(solver);
    run_release(&r);
    gen_destroy(&problem);
    gen_destroy(&other);
    free(z);
}

/* Bytes that perp asks for (what a third party takes is beside the point). */
typedef struct ledger {
    size_t bytes;
} ledger;

static void *count_bytes(size_t size, void *user)
{
    ((ledger *)user)->bytes += size;
    return malloc(size);
}

static void give_back(void *pointer, void *user)
{
    (void)user;
    free(pointer);
}

/* Twice the unknowns, twice the memory: no array is n by n. */
static void test_memory_is_linear(void **state)
{
    static const int sides[] = {40, 80};
    size_t bytes[2];
    int k;

    (void)state;
    for (k = 0; k < 2; k++) {
        perp_context_settings settings = fresh_context_settings();
        ledger l = {0};
        perp_context *counted;
        gen_lcp problem;
        perp_lcp_settings lcp = run_settings(PERP_LCP_LEMKE);
        run r;

        settings.allocate = count_bytes;
        settings.release = give_back;
        settings.allocator_user = &l;
        assert_int_equal(perp_context_create(&counted, &settings), PERP_OK);
        gen_obstacle_2d(&problem, sides[k]);
        run_lcp(&r, counted, &problem, &lcp, NULL, "memory");
        assert_true(run_ok(&r));
        bytes[k] = l.bytes;
        run_release(&r);
        gen_destroy(&problem);
        perp_context_destroy(counted);
    }
    /* four times the unknowns; the factors' own growth adds a part */
    assert_true(bytes[1] < 6 * bytes[0]);
}

/* An option's tridiagonal matrix: active sets would creep, the exact start needs no pivot. */
static void test_tridiagonal(void **state)
{
    gen_lcp dense, problem;
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
    run r;

    (void)state;
    gen_obstacle(&dense, 256);
    gen_to_csc(&problem, &dense);
    problem.q = dense.q;
    run_lcp(&r, context, &problem, &settings, NULL, "tridiagonal");
    assert_true(run_ok(&r));
    assert_true(run_distance(r.z, dense.z, dense.n) <= 1e-9);
    assert_in_range(r.result.iterations, 0, 10);
    run_release(&r);
    problem.q = NULL;
    gen_destroy(&problem);
    gen_destroy(&dense);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_warm_start),       cmocka_unit_test(test_iteration_limit),
        cmocka_unit_test(test_monitor),          cmocka_unit_test(test_determinism),
        cmocka_unit_test(test_memory_is_linear), cmocka_unit_test(test_tridiagonal),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
