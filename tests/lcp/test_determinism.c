/* The same bits: twice, in another context, after other problems; and the same bits but for an
 * exact factor when the problem is scaled by powers of two. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_PGS, PERP_LCP_FISCHER};

/* n = 0: of any size. */
static void make_problem(gen_lcp *problem, gen_random *random, int round, int32_t n)
{
    static const int32_t classes[] = {GEN_PD_SYMMETRIC, GEN_M, GEN_PSD_LOW_RANK,
                                      GEN_PD_UNSYMMETRIC};
    const gen_contact_options contact = {3, 4, 4, 100, 1.0, 1, 1};

    if (n == 0 && round % 4 == 3)
        gen_contact(problem, random, &contact);
    else
        gen_problem(problem, random, n > 0 ? n : 3 + gen_integer(random, 12), classes[round % 4],
                    round % GEN_BOUNDS);
}

static int pgs_can(const gen_lcp *problem)
{
    int32_t i;

    for (i = 0; i < problem->n; i++)
        if (!(problem->M[(size_t)i * (size_t)(problem->n + 1)] > 0))
            return 0;
    return 1;
}

static void require_same_bits(const run *a, const run *b, int32_t n, const char *where)
{
    if (memcmp(a->z, b->z, (size_t)n * sizeof(double)) != 0 ||
        memcmp(a->w, b->w, (size_t)n * sizeof(double)) != 0)
        fail_msg("%s: z differs by %g", where, run_distance(a->z, b->z, n));
    if (a->result.outcome != b->result.outcome || a->result.method != b->result.method ||
        a->result.iterations != b->result.iterations || a->result.residual != b->result.residual ||
        a->result.natural_residual != b->result.natural_residual ||
        a->result.backward_error != b->result.backward_error)
        fail_msg("%s: another result: %ld and %ld iterations, residuals %g and %g", where,
                 (long)a->result.iterations, (long)b->result.iterations, a->result.residual,
                 b->result.residual);
}

static void test_again_and_elsewhere(void **state)
{
    gen_random random;
    perp_context *other;
    int round;
    size_t m;

    (void)state;
    gen_seed(&random, 41);
    assert_int_equal(perp_context_create(&other, NULL), PERP_OK);
    for (round = 0; round < 60; round++) {
        gen_lcp problem;

        make_problem(&problem, &random, round, 0);
        for (m = 0; m < 4; m++) {
            perp_lcp_settings settings = run_settings(methods[m]);
            run first, again, elsewhere;

            if (methods[m] == PERP_LCP_PGS && !pgs_can(&problem))
                continue;
            run_lcp(&first, context, &problem, &settings, NULL, "first");
            run_lcp(&again, context, &problem, &settings, NULL, "again");
            run_lcp(&elsewhere, other, &problem, &settings, NULL, "elsewhere");
            require_same_bits(&first, &again, problem.n, "again");
            require_same_bits(&first, &elsewhere, problem.n, "elsewhere");
            run_release(&first);
            run_release(&again);
            run_release(&elsewhere);
        }
        gen_destroy(&problem);
    }
    perp_context_destroy(other);
}

static void compare_with_fresh(perp_lcp_solver *solver, const gen_lcp *problem,
                               const perp_lcp_settings *settings)
{
    run fresh, used;

    run_lcp(&fresh, context, problem, settings, NULL, "fresh");
    run_lcp(&used, context, problem, settings, NULL, "room for the results");
    assert_int_equal(perp_lcp_solver_setup(solver, &problem->view, problem->lower, problem->upper),
                     PERP_OK);
    /* another q first */
    assert_int_equal(perp_lcp_solver_solve(solver, used.z, used.w, NULL, &used.result,
                                           problem->w ? problem->w : problem->q, NULL),
                     PERP_OK);
    assert_int_equal(
        perp_lcp_solver_solve(solver, used.z, used.w, NULL, &used.result, problem->q, NULL),
        PERP_OK);
    require_same_bits(&fresh, &used, problem->n, perp_lcp_method_text(settings->method));
    run_release(&fresh);
    run_release(&used);
}

/* A solver that has seen other problems and other q forgets them: of any size, and of one size,
 * where memory stays as it is laid out unless the storage or the number of free variables is
 * another one. */
static void test_after_other_problems(void **state)
{
    gen_random random;
    int round;

    (void)state;
    for (size_t m = 0; m < 8; m++) {
        perp_lcp_settings settings = run_settings(methods[m % 4]);
        perp_lcp_solver *solver;

        gen_seed(&random, 42);
        assert_int_equal(perp_lcp_solver_create(context, &solver, &settings), PERP_OK);
        for (round = 0; round < 60; round++) {
            gen_lcp problem, sparse;

            make_problem(&problem, &random, round, m < 4 ? 0 : 16);
            if (methods[m % 4] != PERP_LCP_PGS || pgs_can(&problem))
                compare_with_fresh(solver, &problem, &settings);
            if (m >= 4 && round % 5 == 4) {
                const perp_matrix dense = problem.view;

                gen_to_csc(&sparse, &problem);
                problem.view = sparse.view;
                compare_with_fresh(solver, &problem, &settings);
                problem.view = dense;
                gen_destroy(&sparse);
            }
            gen_destroy(&problem);
        }
        perp_lcp_solver_destroy(solver);
    }
}

/* Free variables that depend on each other are two pairs each: the same matrix needs twice the room
 * where its variables are free. */
static void test_after_other_bounds(void **state)
{
    enum { N = 16 };
    static const int32_t kinds[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE};
    int M[N * N], q[N], k;

    (void)state;
    for (k = 0; k < N * N; k++)
        M[k] = 1;
    for (k = 0; k < N; k++)
        q[k] = -3;
    for (k = 0; k < 2; k++) {
        const perp_lcp_settings settings = run_settings(kinds[k]);
        gen_lcp bounded, unbounded;
        perp_lcp_solver *solver;

        gen_from_integers(&bounded, N, M, q);
        gen_from_integers(&unbounded, N, M, q);
        unbounded.lower = check_allocate(N, sizeof(double));
        unbounded.upper = check_allocate(N, sizeof(double));
        for (int32_t i = 0; i < N; i++)
            unbounded.upper[i] = -(unbounded.lower[i] = -INFINITY);
        assert_int_equal(perp_lcp_solver_create(context, &solver, &settings), PERP_OK);
        compare_with_fresh(solver, &bounded, &settings);
        compare_with_fresh(solver, &unbounded, &settings);
        compare_with_fresh(solver, &bounded, &settings);
        perp_lcp_solver_destroy(solver);
        gen_destroy(&bounded);
        gen_destroy(&unbounded);
    }
}

/* ---- scaling --------------------------------------------------------------------------------- */

/* A sparse solver keeps its analysis from solve to solve; what it solved before must not show. */
static void test_sparse_solver_after_other_right_hand_sides(void **state)
{
    enum { N = 120 };
    static const int32_t kinds[] = {PERP_LCP_FISCHER, PERP_LCP_LEMKE};
    gen_random random;
    gen_lcp dense, sparse;
    int32_t i, j, k;

    (void)state;
    gen_seed(&random, 31);
    gen_problem(&dense, &random, N, GEN_PD_UNSYMMETRIC, GEN_PLAIN);
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++)
            if (i != j)
                dense.M[i * N + j] = gen_integer(&random, 12) == 0 ? gen_dyadic(&random, 4) : 0.0;
            else
                dense.M[i * N + j] = ldexp(1.0, -14);
    gen_to_csc(&sparse, &dense);
    for (k = 0; k < 2; k++) {
        perp_lcp_settings settings = run_settings(kinds[k]);
        double other[N], z[2][N], w[2][N];
        perp_lcp_result results[2];
        perp_lcp_solver *solver;
        int used;

        settings.max_iterations = 40;
        for (i = 0; i < N; i++)
            other[i] = gen_dyadic(&random, 8);
        for (used = 0; used < 2; used++) {
            assert_int_equal(perp_lcp_solver_create(context, &solver, &settings), PERP_OK);
            assert_int_equal(perp_lcp_solver_setup(solver, &sparse.view, NULL, NULL), PERP_OK);
            assert_int_equal(perp_struct_init(&results[used], sizeof results[used]), PERP_OK);
            if (used)
                assert_int_equal(
                    perp_lcp_solver_solve(solver, z[1], w[1], NULL, &results[1], other, NULL),
                    PERP_OK);
            assert_int_equal(perp_lcp_solver_solve(solver, z[used], w[used], NULL, &results[used],
                                                   dense.q, NULL),
                             PERP_OK);
            perp_lcp_solver_destroy(solver);
        }
        assert_memory_equal(z[0], z[1], sizeof z[0]);
        assert_memory_equal(w[0], w[1], sizeof w[0]);
        assert_true(results[0].residual == results[1].residual);
    }
    gen_destroy(&dense);
    gen_destroy(&sparse);
}

/* Row and column i of M times 2^e_i, q_i times 2^(e_i + o); then z_i is to become 2^(o - e_i) z_i
 * and so are the bounds. */
static void scale(gen_lcp *scaled, const gen_lcp *problem, const int *e, int o)
{
    int32_t n = problem->n, i, j;
    const int zeros[32 * 32] = {0};

    gen_from_integers(scaled, n, zeros, zeros);
    if (problem->lower) {
        scaled->lower = check_allocate((size_t)n, sizeof(double));
        scaled->upper = check_allocate((size_t)n, sizeof(double));
    }
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++)
            scaled->M[i * n + j] = ldexp(problem->M[i * n + j], e[i] + e[j]);
        scaled->q[i] = ldexp(problem->q[i], e[i] + o);
        if (problem->lower) {
            scaled->lower[i] = ldexp(problem->lower[i], o - e[i]);
            scaled->upper[i] = ldexp(problem->upper[i], o - e[i]);
        }
    }
}

/* docs/lcp.md: scaling q, or a row and its column, by powers of two changes no bit of the tested
 * residual; nor of the backward error, the path taken, and z but for its own factor. */
static void require_scaled(const run *a, const run *b, int32_t n, const int *e, int o,
                           const char *where)
{
    int32_t i;

    if (a->result.outcome != b->result.outcome || a->result.iterations != b->result.iterations ||
        a->result.method != b->result.method)
        fail_msg("%s: another path: %ld and %ld iterations", where, (long)a->result.iterations,
                 (long)b->result.iterations);
    if (a->result.residual != b->result.residual ||
        a->result.backward_error != b->result.backward_error)
        fail_msg("%s: residuals %.17g and %.17g, backward errors %.17g and %.17g", where,
                 a->result.residual, b->result.residual, a->result.backward_error,
                 b->result.backward_error);
    for (i = 0; i < n; i++)
        if (b->z[i] != ldexp(a->z[i], o - e[i]))
            fail_msg("%s: z[%d] = %.17g, expected %.17g", where, (int)i, b->z[i],
                     ldexp(a->z[i], o - e[i]));
}

static void test_powers_of_two(void **state)
{
    gen_random random;
    int round;
    size_t m;

    (void)state;
    gen_seed(&random, 43);
    for (round = 0; round < 120; round++) {
        int e[32] = {0}, o = 0;
        gen_lcp problem, scaled;
        int32_t i;

        make_problem(&problem, &random, round, 0);
        for (i = 0; i < problem.n && round % 3 != 0; i++)
            e[i] = gen_integer(&random, 501) - 250;
        if (round % 3 != 1)
            o = gen_integer(&random, 501) - 250;
        scale(&scaled, &problem, e, o);
        for (m = 0; m < 4; m++) {
            perp_lcp_settings settings = run_settings(methods[m]);
            char where[96];
            run a, b;

            if (methods[m] == PERP_LCP_PGS && !pgs_can(&problem))
                continue;
            snprintf(where, sizeof where, "round %d, %s", round, perp_lcp_method_text(methods[m]));
            run_lcp(&a, context, &problem, &settings, NULL, where);
            run_lcp(&b, context, &scaled, &settings, NULL, where);
            require_scaled(&a, &b, problem.n, e, o, where);
            run_release(&a);
            run_release(&b);
        }
        gen_destroy(&problem);
        gen_destroy(&scaled);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_again_and_elsewhere),
        cmocka_unit_test(test_after_other_problems),
        cmocka_unit_test(test_after_other_bounds),
        cmocka_unit_test(test_sparse_solver_after_other_right_hand_sides),
        cmocka_unit_test(test_powers_of_two),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
