/* The front door: small cases by hand, bounds of every kind, every method against known solutions,
 * starts, and a solver's life. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_PGS, PERP_LCP_FISCHER};

/* ---- small cases ---------------------------------------------------------------------------- */

static void test_no_variables(void **state)
{
    const int none[1] = {0};
    gen_lcp problem;
    size_t m;

    (void)state;
    gen_from_integers(&problem, 0, none, none);
    for (m = 0; m < 4; m++) {
        perp_lcp_settings settings = run_settings(methods[m]);
        perp_lcp_result result;
        run r;

        run_lcp(&r, context, &problem, &settings, NULL, "n = 0");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(r.result.iterations <= (m < 2 ? 0 : 1)); /* a sweep over nothing */
        assert_true(r.result.residual == 0 && r.result.backward_error == 0);
        run_release(&r);
        assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
        assert_int_equal(
            perp_lcp_solve(context, NULL, NULL, NULL, &result, &settings, LCP(&problem.view), NULL),
            PERP_OK); /* arrays of no entries need not exist */
    }
    gen_destroy(&problem);
}

/* a z + q = 0 projected onto [l, u]: all numbers are powers of two or fixed by a bound. */
static void test_one_variable(void **state)
{
    static const double bounds[][2] = {{0, INFINITY}, {-INFINITY, 0},        {-1, 1},
                                       {2, 2},        {-INFINITY, INFINITY}, {-3, -2},
                                       {1, INFINITY}, {-INFINITY, -1},       {-0.0, 0.0}};
    const int zero[1] = {0};
    gen_lcp problem;
    size_t m, b;
    int a, q;

    (void)state;
    gen_from_integers(&problem, 1, zero, zero);
    for (m = 0; m < 4; m++)
        for (b = 0; b < sizeof bounds / sizeof *bounds; b++)
            for (a = -3; a <= 3; a++)
                for (q = -4; q <= 4; q++) {
                    perp_lcp_settings settings = run_settings(methods[m]);
                    double z;
                    run r;

                    problem.M[0] = ldexp(1.0, a);
                    problem.q[0] = q;
                    z = -problem.q[0] / problem.M[0];
                    z = z < bounds[b][0] ? bounds[b][0] : z > bounds[b][1] ? bounds[b][1] : z;
                    run_view(&r, context, &problem.view, problem.q, &bounds[b][0], &bounds[b][1],
                             &settings, NULL, "n = 1");
                    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
                    assert_true(r.z[0] == z);
                    assert_true(r.w[0] == problem.M[0] * z + q);
                    run_release(&r);
                }
    gen_destroy(&problem);
}

/* z = 0 is at once the answer, whatever M is. */
static void test_nothing_to_do(void **state)
{
    static const int32_t exact[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE};
    gen_random random;
    int round;
    size_t m;

    (void)state;
    gen_seed(&random, 11);
    for (round = 0; round < 100; round++) {
        int M[36], q[6], k;
        int32_t n = 1 + gen_integer(&random, 6), i;
        gen_lcp problem;

        for (k = 0; k < n * n; k++)
            M[k] = gen_integer(&random, 11) - 5;
        for (k = 0; k < n; k++)
            q[k] = gen_integer(&random, 3);
        gen_from_integers(&problem, n, M, q);
        for (m = 0; m < 2; m++) {
            perp_lcp_settings settings = run_settings(exact[m]);
            run r;

            run_lcp(&r, context, &problem, &settings, NULL, "q >= 0");
            assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
            assert_int_equal(r.result.iterations, 0);
            for (i = 0; i < n; i++)
                assert_true(r.z[i] == 0 && r.w[i] == q[i]);
            run_release(&r);
        }
        gen_destroy(&problem);
    }
}

/* min 1/2 |x|^2 - x_1 - x_2 - 2 x_3 with x_1 + x_2 = 1: the multiplier is free and its own block is
 * zero. Solution by hand: x = (1/2, 1/2, 2), multiplier 1/2. */
static void test_equality_constrained_program(void **state)
{
    static const int M[] = {1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 0, -1, -1, 0, 0};
    static const int q[] = {-1, -1, -2, 1};
    static const double z[] = {0.5, 0.5, 2, 0.5};
    static const double lower[] = {-INFINITY, 0, -INFINITY, -INFINITY};
    static const double upper[] = {INFINITY, INFINITY, 4, INFINITY};
    static const int32_t exact[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_FISCHER};
    gen_lcp problem;
    size_t m;

    (void)state;
    gen_from_integers(&problem, 4, M, q);
    for (m = 0; m < 3; m++) {
        perp_lcp_settings settings = run_settings(exact[m]);
        run r;

        run_view(&r, context, &problem.view, problem.q, lower, upper, &settings, NULL, "equality");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(run_distance(r.z, z, 4) <= 4e-16); /* a 2 x 2 system of ones */
        run_release(&r);
    }
    gen_destroy(&problem);
}

/* ---- random problems with known solutions --------------------------------------------------- */

static int solves_every(int32_t method, int class)
{
    if (method == PERP_LCP_PGS) /* converges for symmetric positive definite M and M-matrices */
        return class == GEN_PD_SYMMETRIC || class == GEN_M;
    if (method == PERP_LCP_FISCHER) /* a descent method: others may end in a local minimum */
        return class == GEN_PD_SYMMETRIC || class == GEN_PD_UNSYMMETRIC || class == GEN_M;
    return 1;
}

/* The classes' condition numbers stay below 1e6 (n <= 10; triangles below 1e8), |z| below 12, and
 * the polish solves the active set to a few eps of backward error: 1e-8 is a wide margin, and
 * wrong active sets are off by 1/16 as a rule. For singular M only w is unique. */
static void compare(const gen_lcp *problem, const run *r, int class, const char *where)
{
    double off = class == GEN_PSD_LOW_RANK ? run_distance(r->w, problem->w, problem->n)
                                           : run_distance(r->z, problem->z, problem->n);

    if (!(off <= 1e-8))
        fail_msg("%s: off by %g", where, off);
}

static void test_methods_agree_with_known_solutions(void **state)
{
    gen_random random;
    int round, failed[4] = {0};
    size_t m;

    (void)state;
    gen_seed(&random, 12);
    for (round = 0; round < 6000; round++) {
        int class = round % GEN_CLASSES, bounds = round / GEN_CLASSES % GEN_BOUNDS;
        int32_t n = 1 + gen_integer(&random, 10);
        gen_lcp problem;

        gen_problem(&problem, &random, n, class, bounds);
        for (m = 0; m < 4; m++) {
            perp_lcp_settings settings = run_settings(methods[m]);
            char where[128];
            run r;

            if (methods[m] == PERP_LCP_PGS && class == GEN_PSD_LOW_RANK)
                continue; /* zero rows occur */
            snprintf(where, sizeof where, "round %d, class %d, bounds %d, n %d, %s", round, class,
                     bounds, (int)n, perp_lcp_method_text(methods[m]));
            run_lcp(&r, context, &problem, &settings, NULL, where);
            if (run_ok(&r))
                compare(&problem, &r, class, where);
            else if (solves_every(methods[m], class))
                fail_msg("%s: %s, residual %g", where, perp_outcome_text(r.result.outcome),
                         r.result.residual);
            else
                failed[m]++;
            run_release(&r);
        }
        gen_destroy(&problem);
    }
    /* where a method may fail it still is no use if it mostly does */
    assert_true(failed[2] < 800 && failed[3] < 400);
}

static void test_without_polish_and_scaling(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 13);
    for (round = 0; round < 1000; round++) {
        int class = round % GEN_CLASSES, bounds = round / GEN_CLASSES % GEN_BOUNDS, bits;
        gen_lcp problem;

        gen_problem(&problem, &random, 1 + gen_integer(&random, 8), class, bounds);
        for (bits = 0; bits < 8; bits++) {
            perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
            char where[64];
            run r;

            settings.polish = bits & 1;
            settings.scaling = bits >> 1 & 1;
            settings.pivot_rule = bits >> 2;
            snprintf(where, sizeof where, "round %d, settings %d", round, bits);
            run_lcp(&r, context, &problem, &settings, NULL, where);
            if (!run_ok(&r))
                fail_msg("%s: %s", where, perp_outcome_text(r.result.outcome));
            compare(&problem, &r, class, where);
            run_release(&r);
        }
        gen_destroy(&problem);
    }
}

/* ---- starts --------------------------------------------------------------------------------- */

static void test_the_solution_as_a_start(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 14);
    for (round = 0; round < 100; round++) {
        perp_lcp_settings settings = run_settings(round & 1 ? PERP_LCP_AUTO : PERP_LCP_LEMKE);
        gen_lcp problem;
        run r;

        gen_problem(&problem, &random, 8, GEN_PD_UNSYMMETRIC, round % GEN_BOUNDS);
        run_lcp(&r, context, &problem, &settings, problem.z, "warm");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(r.result.method, PERP_LCP_POLISH);
        assert_int_equal(r.result.iterations, 0);
        compare(&problem, &r, GEN_PD_UNSYMMETRIC, "warm");
        run_release(&r);
        gen_destroy(&problem);
    }
}

static void test_bad_starts_do_no_harm(void **state)
{
    gen_random random;
    int round;
    size_t m;

    (void)state;
    gen_seed(&random, 15);
    for (round = 0; round < 200; round++) {
        double z0[8];
        gen_lcp problem;
        int32_t i;

        for (i = 0; i < 8; i++)
            z0[i] = gen_normal(&random) * (round % 4 == 3 ? 1e12 : 1.0);
        gen_problem(&problem, &random, 8, GEN_PD_SYMMETRIC, round % GEN_BOUNDS);
        for (m = 0; m < 4; m++) {
            perp_lcp_settings settings = run_settings(methods[m]);
            char where[64];
            run r;

            snprintf(where, sizeof where, "start %d, %s", round, perp_lcp_method_text(methods[m]));
            run_lcp(&r, context, &problem, &settings, z0, where);
            if (!run_ok(&r))
                fail_msg("%s: %s", where, perp_outcome_text(r.result.outcome));
            compare(&problem, &r, GEN_PD_SYMMETRIC, where);
            run_release(&r);
        }
        gen_destroy(&problem);
    }
}

/* ---- a solver's life ------------------------------------------------------------------------ */

static void solve_with(perp_lcp_solver *solver, const gen_lcp *problem, const char *where)
{
    double z[32], w[32];
    perp_lcp_result result = fresh_lcp_result();

    assert_int_equal(perp_lcp_solver_solve(solver, z, w, NULL, &result, problem->q, NULL), PERP_OK);
    check_require(check_lcp_result(&problem->view, problem->q, problem->lower, problem->upper, z, w,
                                   NULL, &result, NULL),
                  where);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(run_distance(z, problem->z, problem->n) <= 1e-8);
}

/* Sizes up and down, bounds that come and go, other methods in between: nothing of an earlier
 * problem is left behind. */
static void test_one_solver_many_problems(void **state)
{
    perp_lcp_solver *solver;
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 16);
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    for (round = 0; round < 300; round++) {
        static const int32_t order[] = {PERP_LCP_AUTO, PERP_LCP_PGS, PERP_LCP_LEMKE};
        perp_lcp_settings settings = run_settings(order[round / 5 % 3]);
        gen_lcp problem, csc;
        int sparse = gen_integer(&random, 2), bounds = gen_integer(&random, GEN_BOUNDS);

        gen_problem(&problem, &random, 1 + gen_integer(&random, 20),
                    round % 2 ? GEN_PD_SYMMETRIC : GEN_M, bounds);
        gen_to_csc(&csc, &problem);
        assert_int_equal(perp_lcp_solver_set(solver, &settings), PERP_OK);
        assert_int_equal(perp_lcp_solver_setup(solver, sparse ? &csc.view : &problem.view,
                                               problem.lower, problem.upper),
                         PERP_OK);
        solve_with(solver, &problem, "first");
        solve_with(solver, &problem, "again");
        gen_destroy(&csc);
        gen_destroy(&problem);
    }
    perp_lcp_solver_destroy(solver);
}

/* The values of M may change in place between set-ups: 4 M goes with q = w - 4 M z. */
static void test_setup_again_with_new_values(void **state)
{
    perp_lcp_solver *solver;
    gen_lcp problem;
    gen_random random;
    int32_t i;

    (void)state;
    gen_seed(&random, 17);
    gen_problem(&problem, &random, 10, GEN_PD_SYMMETRIC, GEN_BOXED);
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(perp_lcp_solver_setup(solver, &problem.view, problem.lower, problem.upper),
                     PERP_OK);
    solve_with(solver, &problem, "before");
    for (i = 0; i < 10; i++)
        problem.q[i] = problem.w[i] + 4.0 * (problem.q[i] - problem.w[i]);
    for (i = 0; i < 100; i++)
        problem.M[i] *= 4.0;
    assert_int_equal(perp_lcp_solver_setup(solver, &problem.view, problem.lower, problem.upper),
                     PERP_OK);
    solve_with(solver, &problem, "after");
    perp_lcp_solver_destroy(solver);
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_variables),
        cmocka_unit_test(test_one_variable),
        cmocka_unit_test(test_nothing_to_do),
        cmocka_unit_test(test_equality_constrained_program),
        cmocka_unit_test(test_methods_agree_with_known_solutions),
        cmocka_unit_test(test_without_polish_and_scaling),
        cmocka_unit_test(test_the_solution_as_a_start),
        cmocka_unit_test(test_bad_starts_do_no_harm),
        cmocka_unit_test(test_one_solver_many_problems),
        cmocka_unit_test(test_setup_again_with_new_values),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
