/* The semismooth Newton method on families of problems with known solutions, over changes of values
 * and patterns, from warm starts, in bad units, and where there is nothing to find. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

/* Random problems from their solutions, all bounds. The tested residual of the answer is within
 * tol; z itself is compared where the eigenvalues are bounded below (by 1/2, gen.h). Triangular P
 * matrices are left to sizes where their inverse, 10^n or so, is still a number. */
static void test_random(void **state)
{
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-11);

    (void)state;
    for (int class = 0; class < GEN_CLASSES; class ++) {
        for (int k = 0; k < 45; k++) {
            int32_t n = class == GEN_P ? 1 + k % 5 : 1 + k;
            gen_random random;
            gen_lcp problem, sparse;
            run r;

            gen_seed(&random, 300 + (uint64_t)k);
            gen_problem(&problem, &random, n, class, k % GEN_BOUNDS);
            gen_to_csc(&sparse, &problem);
            for (int csc = 0; csc < 2; csc++) {
                run_view(&r, context, csc ? &sparse.view : &problem.view, problem.q, problem.lower,
                         problem.upper, &settings, NULL, "random");
                if (r.result.outcome != PERP_OUTCOME_SOLVED)
                    fail_msg("class %d, %d: %s", class, k, perp_outcome_text(r.result.outcome));
                if (class != GEN_PSD_LOW_RANK && class != GEN_P)
                    assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-6);
                run_release(&r);
            }
            gen_destroy(&sparse);
            gen_destroy(&problem);
        }
    }
}

/* Newton steps move a free boundary by about a node an iteration on a string; in the plane a dozen
 * iterations do. Sparse: 64 x 64 inner points. */
static void test_obstacles(void **state)
{
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-12);
    gen_lcp problem, sparse;
    run r;

    (void)state;
    gen_obstacle(&problem, 32);
    gen_to_csc(&sparse, &problem);
    run_view(&r, context, &sparse.view, problem.q, NULL, NULL, &settings, NULL, "string");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(r.result.iterations <= problem.n / 2);
    /* u = max(|x| - 1/2, 0)^2 at the nodes; |M^-1| = (n + 1)^2 / 8 before, 4 for omega, scaling */
    assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-12 * 4.0 * 128.0 * 128.0 / 8.0);
    run_release(&r);
    gen_destroy(&sparse);
    gen_destroy(&problem);

    gen_obstacle_2d(&problem, 64);
    run_lcp(&r, context, &problem, &settings, NULL, "membrane");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(r.result.iterations <= 30);
    /* the torsion function of the square is below side^2 / 13 (0.0737) */
    assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-12 * 4.0 * 65.0 * 65.0 / 13.0);
    run_release(&r);
    gen_destroy(&problem);
}

/* Frictional contact with mass ratios to 1e8: copositive, degenerate, rank deficient. There is no
 * theorem; 19 in 20 is what the method must keep up, and whatever it says is checked. */
static void test_contact(void **state)
{
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-10);
    int solved = 0, all = 0;

    (void)state;
    for (int k = 0; k < 60; k++) {
        const gen_contact_options options = {
            2 + k % 6,  3 + k % 9, 4 + 2 * (k % 3), pow(10.0, k % 9), k % 5 == 0 ? 10.0 : 1.0,
            k % 4 == 3, k % 2};
        gen_random random;
        gen_lcp problem;
        run r;

        gen_seed(&random, 500 + (uint64_t)k);
        gen_contact(&problem, &random, &options);
        run_lcp(&r, context, &problem, &settings, NULL, "contact");
        solved += r.result.outcome == PERP_OUTCOME_SOLVED;
        all++;
        run_release(&r);
        gen_destroy(&problem);
    }
    /* without a polish the method's own last digits decide whether rows at rest hold beside their
     * own terms: one in ten does not */
    if (!(10 * solved >= 9 * all))
        fail_msg("%d of %d", solved, all);
}

/* No solution: 0 z >= 1; and [[1, -1], [-1, 1]] z >= (1, 0). */
static void test_failure_is_said(void **state)
{
    static const double zero[] = {0.0}, one[] = {-1.0};
    static const double values[] = {1.0, -1.0, -1.0, 1.0}, q[] = {-1.0, 0.0};
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-10);
    perp_matrix nothing = run_dense(zero, 1), wall = run_dense(values, 2);
    run r;

    (void)state;
    run_view(&r, context, &nothing, one, NULL, NULL, &settings, NULL, "0 z >= 1");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_STALLED);
    run_release(&r);
    run_view(&r, context, &wall, q, NULL, NULL, &settings, NULL, "walls");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_STALLED); /* and not the limit of 500 */
    run_release(&r);
}

/* A start at the solution needs no iteration, one close by fewer than none at all. */
static void test_warm_starts(void **state)
{
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-10);
    gen_random random;
    gen_lcp problem;
    double z0[60];
    int64_t cold;
    run r;

    (void)state;
    gen_seed(&random, 11);
    gen_problem(&problem, &random, 60, GEN_PD_SYMMETRIC, GEN_MIXED);
    run_lcp(&r, context, &problem, &settings, NULL, "cold");
    cold = r.result.iterations;
    run_release(&r);
    run_lcp(&r, context, &problem, &settings, problem.z, "at the solution");
    assert_int_equal(r.result.iterations, 0);
    run_release(&r);
    for (int i = 0; i < 60; i++)
        z0[i] = problem.z[i] + 1e-3 * gen_uniform(&random, -1, 1);
    run_lcp(&r, context, &problem, &settings, z0, "close by");
    assert_true(r.result.iterations < cold);
    run_release(&r);
    gen_destroy(&problem);
}

/* One solver, one size, one number of entries: new values, then a new pattern, then dense. */
static void test_pattern_changes(void **state)
{
    static const int32_t starts[] = {0, 1, 3, 4}, rows_1[] = {0, 1, 2, 2}, rows_2[] = {0, 0, 1, 2};
    double values[] = {2.0, 2.0, -1.0, 2.0};
    static const double q[] = {-2.0, -2.0, -2.0};
    /* 2 z_2 = 2 + z_1; half of it; 2 z_0 + 2 z_1 - 2 > 0 */
    static const double full[] = {1, 0, 0, 0, 2, 0, 0, 0, 4};
    static const double expected[4][3] = {{1, 1, 1.5}, {0.5, 0.5, 0.75}, {0, 2, 1}, {2, 1, 0.5}};
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-12);
    perp_lcp_solver *solver;
    perp_lcp_result result;
    perp_matrix M;
    double z[3];

    (void)state;
    settings.max_iterations = 12;
    assert_int_equal(perp_lcp_solver_create(context, &solver, &settings), PERP_OK);
    for (int k = 0; k < 4; k++) {
        if (k == 1)
            for (int p = 0; p < 4; p++)
                values[p] *= 2.0;
        if (k == 2) { /* [[2, 2, 0], [0, 1, 0], [0, 0, 2]] */
            values[0] = values[1] = values[3] = 2.0;
            values[2] = 1.0;
        }
        M = matrix_csc(3, 3, starts, k < 2 ? rows_1 : rows_2, values);
        if (k == 3)
            M = run_dense(full, 3);
        assert_int_equal(perp_lcp_solver_setup(solver, &M, NULL, NULL), PERP_OK);
        for (int again = 0; again < 2; again++) {
            assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
            assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, q, NULL),
                             PERP_OK);
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            /* |M^-1| <= 3 */
            assert_true(run_distance(z, expected[k], 3) <= 1e-11);
        }
    }
    perp_lcp_solver_destroy(solver);
}

/* Scaling that a user does by mistake: rows and columns by powers of ten from 1e-40 to 1e40. */
static void test_bad_units(void **state)
{
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-10);

    (void)state;
    for (int k = 0; k < 20; k++) {
        gen_random random;
        gen_lcp problem;
        double d[16];
        run r;

        gen_seed(&random, 700 + (uint64_t)k);
        gen_problem(&problem, &random, 16, GEN_PD_UNSYMMETRIC, GEN_PLAIN);
        for (int i = 0; i < 16; i++)
            d[i] = pow(10.0, gen_uniform(&random, -40, 40));
        for (int i = 0; i < 16; i++) {
            problem.q[i] *= d[i];
            for (int j = 0; j < 16; j++)
                problem.M[i * 16 + j] *= d[i] * d[j];
        }
        run_lcp(&r, context, &problem, &settings, NULL, "bad units");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        for (int i = 0; i < 16; i++) /* as in test_random, in units of each variable */
            assert_true(fabs(r.z[i] * d[i] - problem.z[i]) <= 1e-6);
        run_release(&r);
        gen_destroy(&problem);
    }
}

/* Linear programs by their optimality conditions, M skew: planted strictly complementary pairs with
 * faces of solutions, at each of which Newton's matrix is singular. Theorem: the path of a feasible
 * monotone problem with an interior leads to one, so all have to be solved. The witness is the
 * program's own optimal value. */
static void test_programs(void **state)
{
    enum { ROWS = 40, COLUMNS = 60, DRAWS = 60 };
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-10);

    (void)state;
    for (uint64_t seed = 0; seed < DRAWS; seed++) {
        gen_random random;
        gen_lcp p;
        run r;

        gen_seed(&random, seed);
        gen_linear_program(&p, &random, ROWS, COLUMNS, seed % 2);
        run_lcp(&r, context, &p, &settings, NULL, "linear program");
        if (r.result.outcome != PERP_OUTCOME_SOLVED)
            fail_msg("%d: %s", (int)seed, perp_outcome_text(r.result.outcome));
        /* residual times the sums of x and y, below 1000 with their scale */
        assert_true(fabs(gen_program_error(&p, COLUMNS, r.z)) <= 1e-10 * 1e3);
        run_release(&r);
        gen_destroy(&p);
    }
}

static void test_empty(void **state)
{
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-10);
    const double none = 0.0;
    perp_matrix M = run_dense(&none, 0);
    perp_lcp_result result = fresh_lcp_result();

    (void)state;
    assert_int_equal(perp_lcp_solve(context, NULL, NULL, NULL, &result, &settings, LCP(&M), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
}

/* Planted solutions of M >= 0 whose diagonal is not large: Psi has local minima that solve nothing
 * (Billups), and a start may end in one. Of five starts that differ one in ten problems is left
 * (181 of 200 are solved). */
static void test_many_minima(void **state)
{
    enum { DRAWS = 200 };
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-10);
    int solved = 0;

    (void)state;
    for (uint64_t seed = 0; seed < DRAWS; seed++) {
        gen_random random;
        gen_lcp p;
        run r;

        gen_seed(&random, seed);
        gen_begin_dense(&p, 3 + gen_integer(&random, 27));
        for (int32_t i = 0; i < p.n; i++) {
            for (int32_t j = 0; j < p.n; j++)
                p.M[i * p.n + j] = fabs(gen_normal(&random));
            if (gen_integer(&random, 2))
                p.M[i * p.n + i] += gen_uniform(&random, 0, 1);
            *(gen_integer(&random, 2) ? &p.z[i] : &p.w[i]) = gen_uniform(&random, 0, 2);
        }
        for (int32_t i = 0; i < p.n; i++) {
            p.q[i] = p.w[i];
            for (int32_t j = 0; j < p.n; j++)
                p.q[i] -= p.M[i * p.n + j] * p.z[j];
        }
        run_lcp(&r, context, &p, &settings, NULL, "many minima");
        solved += run_ok(&r);
        run_release(&r);
        gen_destroy(&p);
    }
    if (solved < 17 * DRAWS / 20)
        fail_msg("%d of %d", solved, DRAWS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),      cmocka_unit_test(test_obstacles),
        cmocka_unit_test(test_contact),     cmocka_unit_test(test_failure_is_said),
        cmocka_unit_test(test_warm_starts), cmocka_unit_test(test_pattern_changes),
        cmocka_unit_test(test_bad_units),   cmocka_unit_test(test_programs),
        cmocka_unit_test(test_empty),       cmocka_unit_test(test_many_minima),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
