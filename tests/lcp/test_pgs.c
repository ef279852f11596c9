/* Projected Gauss-Seidel: closed forms for every kind of bound, the convergence rates that theory
 * gives, what is refused, and what happens where the method does not converge. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

#define N 31

/* pgs by itself: what it reaches, not what the polish makes of it. */
static perp_lcp_settings alone(double tol, int32_t max_iterations)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_PGS);

    settings.polish = 0;
    settings.tol = tol;
    settings.max_iterations = max_iterations;
    return settings;
}

/* ---- one variable: z = mid(l, u, -q / M) ----------------------------------------------------- */

static void test_one_variable(void **state)
{
    static const double bounds[][2] = {
        {0.0, INFINITY}, {-1.0, INFINITY}, {-INFINITY, 1.0}, {-2.0, 3.0}, {-INFINITY, INFINITY}};
    static const double loads[] = {-64.0, -2.0, 0.0, 2.0, 64.0};
    const double four = 4.0;
    perp_matrix M = run_dense(&four, 1);
    perp_lcp_settings settings = alone(1e-10, 0);

    (void)state;
    for (size_t b = 0; b < sizeof bounds / sizeof bounds[0]; b++) {
        for (size_t k = 0; k < sizeof loads / sizeof loads[0]; k++) {
            double expected = fmin(fmax(-loads[k] / four, bounds[b][0]), bounds[b][1]);
            run r;

            run_view(&r, context, &M, &loads[k], &bounds[b][0], &bounds[b][1], &settings, NULL,
                     "one variable");
            assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
            /* powers of two throughout: exact; one sweep to get there, one to see it */
            assert_true(r.z[0] == expected);
            assert_in_range(r.result.iterations, 1, 2);
            run_release(&r);
        }
    }
}

/* A fixed variable may have any diagonal, and acts on the others through its column. */
static void test_fixed_variables(void **state)
{
    static const double values[] = {0.0, 1.0, 7.0, 2.0};
    static const double q[] = {5.0, -8.0}, lower[] = {3.0, 0.0}, upper[] = {3.0, INFINITY};
    static const double q_2[] = {5.0, -22.0};
    perp_matrix M = run_dense(values, 2);
    perp_lcp_settings settings = alone(1e-10, 0);
    run r;

    (void)state;
    run_view(&r, context, &M, q, lower, upper, &settings, NULL, "pushed off");
    assert_true(r.z[0] == 3.0 && r.z[1] == 0.0); /* 7 * 3 - 8 > 0 */
    run_release(&r);
    run_view(&r, context, &M, q_2, lower, upper, &settings, NULL, "pulled in");
    assert_true(r.z[0] == 3.0 && r.z[1] == 0.5); /* 7 * 3 + 2 z = 22 */
    run_release(&r);
}

/* ---- refusals -------------------------------------------------------------------------------- */

static perp_status solve_3(double diagonal, int csc, double *z)
{
    static const double q[] = {-1.0, -1.0, -1.0};
    static const int32_t starts[] = {0, 2, 3, 4}, rows[] = {0, 2, 1, 2};
    static const int32_t starts_without[] = {0, 2, 3, 3};
    double values[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0, 0.0};
    double sparse[4] = {1.0, 0.25, 1.0, 0.0};
    perp_matrix M = run_dense(values, 3);
    perp_lcp_settings settings = alone(1e-10, 0);
    perp_lcp_result result = fresh_lcp_result();

    values[8] = sparse[3] = diagonal;
    if (csc) {
        assert_int_equal(perp_struct_init(&M, sizeof M), PERP_OK);
        assert_int_equal(
            perp_matrix_csc(&M, 3, 3, diagonal == 0.0 ? starts_without : starts, rows, sparse),
            PERP_OK);
    }
    return perp_lcp_solve(context, z, NULL, NULL, &result, &settings, LCP(&M, q), NULL);
}

static void test_refuses_a_diagonal_that_is_not_positive(void **state)
{
    (void)state;
    for (int csc = 0; csc < 2; csc++) {
        double z[3] = {17.0, 17.0, 17.0};

        assert_int_equal(solve_3(0.0, csc, z), PERP_ERROR_ARGUMENT);
        assert_string_equal(perp_context_message(context),
                            "M(2,2) = 0: pgs needs a positive diagonal");
        assert_int_equal(solve_3(-2.5, csc, z), PERP_ERROR_ARGUMENT);
        assert_string_equal(perp_context_message(context),
                            "M(2,2) = -2.5: pgs needs a positive diagonal");
        assert_true(z[0] == 17.0 && z[1] == 17.0 && z[2] == 17.0);
        assert_int_equal(solve_3(0.5, csc, z), PERP_OK);
    }
}

/* ---- rates ----------------------------------------------------------------------------------- */

/* Two bodies on top of each other, mass ratio R, the heavy one above: W = [[1, -1], [-1, 1 + 1/R]],
 * q = (-1, 0), impulses (1 + R, R). Gauss-Seidel contracts by exactly R / (1 + R) a sweep, and the
 * residual after k sweeps is (R / (1 + R))^k up to a factor 1 + 1/R. */
static void solve_stack(run *r, double R, int32_t sweeps, int32_t polish, const char *where)
{
    static const double q[] = {-1.0, 0.0};
    double values[4] = {1.0, -1.0, -1.0, 1.0};
    perp_matrix M = run_dense(values, 2);
    perp_lcp_settings settings = alone(1e-10, sweeps);

    values[3] += 1.0 / R;
    settings.polish = polish;
    run_view(r, context, &M, q, NULL, NULL, &settings, NULL, where);
}

static void test_rate_of_a_stack(void **state)
{
    static const double ratios[] = {1e2, 1e4};
    /* log(1e-10) / log(R / (1 + R)) */
    static const double expected[] = {2314.1, 230270.0};

    (void)state;
    for (int k = 0; k < 2; k++) {
        double R = ratios[k];
        run r;

        solve_stack(&r, R, 400000, 0, "stack");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        /* 1 %: a few sweeps for the start and the confirmation, ln(1 + 1/R) for the factor */
        assert_true(fabs((double)r.result.iterations - expected[k]) <= 0.01 * expected[k] + 3.0);
        /* a residual of 1e-10 and |W^-1| <= 2 (1 + R) leave at most this */
        assert_true(fabs(r.z[0] - (1.0 + R)) <= 2e-10 * (1.0 + R));
        assert_true(fabs(r.z[1] - R) <= 2e-10 * (1.0 + R));
        run_release(&r);
    }
}

/* R = 1e8 would take 2.3e9 sweeps. pgs gives up after two windows of 1000 sweeps, each of which
 * brings 1e-5 where 1 % is asked for; the active set is right at once and the polish solves it. */
static void test_stagnation_is_said(void **state)
{
    run r;

    (void)state;
    solve_stack(&r, 1e8, 1000000, 0, "stagnation");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_STALLED);
    assert_in_range(r.result.iterations, 1000, 2000);
    run_release(&r);
    solve_stack(&r, 1e8, 1000000, 1, "stagnation, polished");
    assert_true(run_ok(&r));
    /* W is known to 1 eps of 1 + 1/R, its determinant 1/R: 1e8 eps relative */
    assert_true(fabs(r.z[0] - (1.0 + 1e8)) <= 1e8 * 1e8 * 2.3e-16);
    run_release(&r);
}

/* -u'' = f as equations on n inner points, h = 1 / (n + 1): per sweep cos^2(pi h) for omega = 1,
 * and omega - 1 for the best omega = 2 / (1 + sin(pi h)) (Young 1954), where a Jordan block makes
 * the error k (omega - 1)^k: some 5 further sweeps a factor 3 at n = 31. */
static int64_t sweeps_on_a_string(double omega)
{
    double values[N * N] = {0.0}, q[N], lower[N], upper[N];
    perp_matrix M = run_dense(values, N);
    perp_lcp_settings settings = alone(1e-10, 0);
    int64_t sweeps;
    run r;

    for (int i = 0; i < N; i++) {
        values[i * N + i] = 2.0;
        if (i > 0)
            values[i * N + i - 1] = values[(i - 1) * N + i] = -1.0;
        q[i] = -1.0;
        lower[i] = -INFINITY;
        upper[i] = INFINITY;
    }
    settings.relaxation = omega;
    run_view(&r, context, &M, q, lower, upper, &settings, NULL, "string");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    for (int i = 0; i < N; i++) /* u = (i + 1) (n - i) / 2; |M^-1| = (n + 1)^2 / 8 */
        assert_true(fabs(r.z[i] - 0.5 * (i + 1) * (N - i)) <= 1e-10 * 4.0 * 128.0);
    sweeps = r.result.iterations;
    run_release(&r);
    return sweeps;
}

static void test_over_relaxation(void **state)
{
    const double h = acos(-1.0) / (N + 1);
    const double best = 2.0 / (1.0 + sin(h));
    double plain = log(1e-10) / log(cos(h) * cos(h));
    double relaxed = log(1e-10) / log(best - 1.0);
    double counted;

    (void)state;
    counted = (double)sweeps_on_a_string(1.0);
    /* the part of the first error in the slowest mode is 1 up to a factor 3: ln(3) / 23 = 5 % */
    assert_true(counted >= 0.95 * plain && counted <= 1.05 * plain);
    counted = (double)sweeps_on_a_string(best);
    /* k (omega - 1)^k: ln(118 n) / 0.2 = 42 sweeps more at most, of 117 */
    assert_true(counted >= 0.8 * relaxed && counted <= 1.4 * relaxed);
}

/* ---- no convergence -------------------------------------------------------------------------- */

/* Equations with [[1, 2], [2, 1]]: the iteration matrix has the eigenvalue 4. */
static void test_divergence_is_said(void **state)
{
    static const double values[] = {1.0, 2.0, 2.0, 1.0}, q[] = {-1.0, -1.0};
    static const double lower[] = {-INFINITY, -INFINITY}, upper[] = {INFINITY, INFINITY};
    perp_matrix M = run_dense(values, 2);
    perp_lcp_settings settings = alone(1e-10, 0);
    run r;

    (void)state;
    run_view(&r, context, &M, q, lower, upper, &settings, NULL, "divergence");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_STALLED);
    assert_in_range(r.result.iterations, 8, 14); /* 4^10 > 1e6, and the first sweeps start it */
    assert_true(r.result.residual <= 4.0);       /* the best iterate, not the last: 1 at z = 0 */
    run_release(&r);
}

/* Numbers that overflow do not come back, as infinities or as NaN: unscaled, from a start near the
 * largest double; the first row is inf in one case, inf - inf in the other. */
static void test_overflow_is_survived(void **state)
{
    static const double values[] = {1.0, 8.0, -8.0, 8.0, 1.0, 0.0, 8.0, 0.0, 1.0};
    static const double q[] = {-1.0, -1.0, -1.0};
    static const double lower[] = {-1.2e308, -1.2e308, -1.2e308};
    static const double upper[] = {1.2e308, 1.2e308, 1.2e308};
    static const double starts[2][3] = {{0.0, 1e308, 0.0}, {0.0, 1e308, 1e308}};
    perp_matrix M = run_dense(values, 3);
    perp_lcp_settings settings = alone(1e-10, 0);

    (void)state;
    settings.scaling = 0;
    for (int k = 0; k < 2; k++) {
        double z[3] = {NAN, NAN, NAN};
        perp_lcp_result result = fresh_lcp_result();

        assert_int_equal(perp_lcp_solve(context, z, NULL, NULL, &result, &settings,
                                        LCP(&M, q, lower, upper), starts[k]),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
        assert_int_equal(result.iterations, 1);
        for (int i = 0; i < 3; i++)
            assert_true(isfinite(z[i]));
        assert_true(isfinite(result.residual) && isfinite(result.natural_residual));
    }
}

/* [[1, -1], [-1, 1]] z >= (1, 0) has no solution: z runs away, the residual stays. */
static void test_infeasible(void **state)
{
    static const double values[] = {1.0, -1.0, -1.0, 1.0}, q[] = {-1.0, 0.0};
    perp_matrix M = run_dense(values, 2);
    perp_lcp_settings settings = alone(1e-10, 0);
    run r;

    (void)state;
    run_view(&r, context, &M, q, NULL, NULL, &settings, NULL, "infeasible");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_STALLED);
    assert_true(r.result.iterations <= 2000); /* two windows */
    run_release(&r);
}

/* ---- known solutions ------------------------------------------------------------------------- */

/* The obstacle's string, exact at the nodes: u = max(|x| - 1/2, 0)^2. */
static void test_obstacle(void **state)
{
    perp_lcp_settings settings = alone(1e-12, 0);
    gen_lcp problem;
    run r;

    (void)state;
    gen_obstacle(&problem, 8);
    run_lcp(&r, context, &problem, &settings, NULL, "obstacle");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    /* the inverse of the scaled matrix is below (n + 1)^2 / 8 = 128 in the maximum norm; omega and
     * the scaling can add 4 */
    assert_true(run_distance(r.z, problem.z, problem.n) <= 4.0 * 128.0 * 1e-12);
    run_release(&r);
    gen_destroy(&problem);
}

/* Symmetric positive definite and diagonally dominant: pgs converges. The lowest eigenvalue is 1/2
 * at least (gen.h adds it), so errors are within sqrt(n) 2 w_error, w_error = tol omega / D. */
static void test_random(void **state)
{
    perp_lcp_settings settings = alone(1e-11, 0);

    (void)state;
    for (int class = 0; class < GEN_CLASSES; class ++) {
        if (class != GEN_PD_SYMMETRIC && class != GEN_M)
            continue;
        for (int k = 0; k < 24; k++) {
            gen_random random;
            gen_lcp problem, sparse;
            run r;

            gen_seed(&random, 100 + (uint64_t)k);
            gen_problem(&problem, &random, 1 + k, class, k % GEN_BOUNDS);
            gen_to_csc(&sparse, &problem);
            settings.relaxation = k % 4 == 3 && class == GEN_PD_SYMMETRIC ? 1.25 : 1.0;
            run_lcp(&r, context, &problem, &settings, NULL, "dense");
            assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
            assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-6);
            run_release(&r);
            run_view(&r, context, &sparse.view, problem.q, problem.lower, problem.upper, &settings,
                     NULL, "csc");
            assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
            assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-6);
            run_release(&r);
            gen_destroy(&sparse);
            gen_destroy(&problem);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_variable),
        cmocka_unit_test(test_fixed_variables),
        cmocka_unit_test(test_refuses_a_diagonal_that_is_not_positive),
        cmocka_unit_test(test_rate_of_a_stack),
        cmocka_unit_test(test_stagnation_is_said),
        cmocka_unit_test(test_over_relaxation),
        cmocka_unit_test(test_divergence_is_said),
        cmocka_unit_test(test_overflow_is_survived),
        cmocka_unit_test(test_infeasible),
        cmocka_unit_test(test_obstacle),
        cmocka_unit_test(test_random),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
