/* Tridiagonal problems: the exact method for M-matrices, and what happens where it does not apply.
 * Every result is checked from the caller's data by run_lcp. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

/* An empty problem with a full tridiagonal pattern; values in the order above, diagonal, below. */
static void allocate(gen_lcp *problem, int32_t n)
{
    size_t size = (size_t)n;
    int32_t count = 0, j;

    memset(problem, 0, sizeof *problem);
    problem->n = n;
    problem->column_starts = check_allocate(size + 1, sizeof(int32_t));
    problem->row_indices = check_allocate(3 * size, sizeof(int32_t));
    problem->values = check_allocate(3 * size, sizeof(double));
    problem->q = check_allocate(size, sizeof(double));
    problem->lower = check_allocate(size, sizeof(double));
    problem->upper = check_allocate(size, sizeof(double));
    for (j = 0; j < n; j++) {
        if (j > 0)
            problem->row_indices[count++] = j - 1;
        problem->row_indices[count++] = j;
        if (j + 1 < n)
            problem->row_indices[count++] = j + 1;
        problem->column_starts[j + 1] = count;
        problem->upper[j] = INFINITY;
    }
    problem->view = matrix_csc(n, n, problem->column_starts, problem->row_indices, problem->values);
}

static double *entry(gen_lcp *problem, int32_t i, int32_t j)
{
    return &problem->values[problem->column_starts[j] + (i - j) + (j > 0)];
}

/* M = diag(2^a) Z diag(2^b) with a row dominant Z: an M-matrix however a and b are chosen. */
static void random_matrix(gen_lcp *problem, gen_random *random, int32_t spread)
{
    const int32_t n = problem->n;
    int32_t i, j;

    for (i = 0; i < n; i++) {
        double sum = 0.0;

        for (j = i - 1; j <= i + 1; j += 2)
            if (j >= 0 && j < n) {
                *entry(problem, i, j) =
                    gen_integer(random, 20) ? -gen_integer(random, 2048) * 0x1p-10 : 0.0;
                sum -= *entry(problem, i, j);
            }
        *entry(problem, i, i) = sum + ldexp(1.0, -gen_integer(random, 40)); /* no rounding */
    }
    for (i = 0; i < n; i++) {
        const int row = gen_integer(random, 2 * spread + 1) - spread;
        const int column = gen_integer(random, 2 * spread + 1) - spread;

        for (j = i - 1; j <= i + 1; j++)
            if (j >= 0 && j < n) {
                *entry(problem, i, j) = ldexp(*entry(problem, i, j), row);
                *entry(problem, j, i) = ldexp(*entry(problem, j, i), column);
            }
    }
}

/* Loads in patches; bounds on one side, some variables free, some fixed. */
static void random_data(gen_lcp *problem, gen_random *random, int32_t spread, int side)
{
    double sign = 1.0;
    int32_t i;

    for (i = 0; i < problem->n; i++) {
        const int32_t kind = gen_integer(random, 12);
        const double bound = gen_uniform(random, -1, 1);

        if (gen_integer(random, 10) == 0)
            sign = -sign;
        problem->q[i] =
            ldexp(sign * gen_uniform(random, 0, 1), gen_integer(random, 2 * spread + 1) - spread);
        problem->lower[i] = side > 0 ? bound : -INFINITY;
        problem->upper[i] = side > 0 ? INFINITY : bound;
        if (kind == 0) {
            problem->lower[i] = -INFINITY;
            problem->upper[i] = INFINITY;
        } else if (kind == 1) {
            problem->lower[i] = problem->upper[i] = bound;
        }
    }
}

/* As a rule the equations are solved once: the index set was right from the start. Where rounding
 * decides a sign, at cond(M) eps, one or two more solutions follow. With numbers spread over 2^96
 * the residual may be large where no double near the point has a smaller one. */
static void test_random(void **state)
{
    static const int32_t spreads[] = {0, 5, 10, 24};
    perp_lcp_settings settings = run_settings(PERP_LCP_ACTIVE_SET);
    gen_random random;
    int32_t round, at_once = 0, solved = 0;

    (void)state;
    gen_seed(&random, 101);
    for (round = 0; round < 600; round++) {
        const int32_t spread = spreads[round % 4];
        gen_lcp problem;
        char where[32];
        run r;

        allocate(&problem, 65 + gen_integer(&random, 60));
        random_matrix(&problem, &random, spread);
        random_data(&problem, &random, spread, round % 2 ? 1 : -1);
        snprintf(where, sizeof where, "case %d", (int)round);
        run_lcp(&r, context, &problem, &settings, NULL, where);
        if (r.result.method != PERP_LCP_ACTIVE_SET || (spread == 0 && !run_ok(&r)))
            fail_msg("%s: %s, residual %g", where, perp_outcome_text(r.result.outcome),
                     r.result.residual);
        if (run_ok(&r) && !(r.result.backward_error <= 4 * 0x1p-52))
            fail_msg("%s: backward error %g", where, r.result.backward_error);
        solved += run_ok(&r);
        at_once += r.result.iterations == 1;
        run_release(&r);
        gen_destroy(&problem);
    }
    if (solved < 580)
        fail_msg("only %d of 600 problems were solved", (int)solved);
    if (at_once < 590)
        fail_msg("only %d of 600 index sets were right at once", (int)at_once);
}

/* Unscaled and well conditioned, so that the unique solution is known to 1e-9 by pivoting. */
static void test_against_lemke(void **state)
{
    gen_random random;
    int32_t round;

    (void)state;
    gen_seed(&random, 102);
    for (round = 0; round < 40; round++) {
        perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
        gen_lcp problem;
        run lemke, own;
        int32_t i;

        allocate(&problem, 65 + gen_integer(&random, 40));
        random_matrix(&problem, &random, 0);
        for (i = 0; i < problem.n; i++)
            *entry(&problem, i, i) += 0.25;
        random_data(&problem, &random, 0, round % 2 ? 1 : -1);
        run_lcp(&lemke, context, &problem, &settings, NULL, "lemke");
        settings.method = PERP_LCP_AUTO;
        run_lcp(&own, context, &problem, &settings, NULL, "auto");
        assert_true(run_ok(&lemke) && run_ok(&own));
        assert_int_equal(own.result.method, PERP_LCP_ACTIVE_SET);
        assert_int_equal(own.result.iterations, 1);
        assert_true(run_distance(lemke.z, own.z, problem.n) <= 1e-9);
        run_release(&lemke);
        run_release(&own);
        gen_destroy(&problem);
    }
}

/* -u'' + 2 >= 0, u >= 0 on [-1, 1], u(+-1) = 1/4: u = max(|x| - 1/2, 0)^2 at the nodes, exactly.
 * Half of the nodes are at the bound, and active sets alone give up one a step. The problem's
 * condition is (2/h)^2/10 = 3e9 at h = 2^-15: 1e-6 is a few hundred times that in eps. */
static void test_obstacle(void **state)
{
    const int32_t k = 1 << 14, n = 4 * k - 1;
    const double h = 0.5 / k;
    gen_lcp problem;
    run r;
    int32_t i, j, contact = 0;

    (void)state;
    allocate(&problem, n);
    for (i = 0; i < n; i++) {
        for (j = i - 1; j <= i + 1; j++)
            if (j >= 0 && j < n)
                *entry(&problem, i, j) = i == j ? 2.0 : -1.0;
        problem.q[i] = 2.0 * h * h - (i == 0 || i == n - 1 ? 0.25 : 0.0);
    }
    run_lcp(&r, context, &problem, NULL, NULL, "obstacle");
    assert_true(run_ok(&r));
    assert_int_equal(r.result.method, PERP_LCP_ACTIVE_SET);
    assert_true(r.result.iterations <= 3);
    for (i = 0; i < n; i++) {
        const double x = (i + 1) * h - 1.0, outside = fmax(fabs(x) - 0.5, 0.0);

        assert_true(fabs(r.z[i] - outside * outside) <= 1e-6);
        contact += r.z[i] == 0.0;
    }
    assert_int_equal(contact, 2 * k + 1);
    run_release(&r);
    gen_destroy(&problem);
}

/* Bounds on both sides, positive entries beside the diagonal, M not definite: not for the exact
 * method. What is solvable gets solved, by whichever method; P-matrices by this one. */
static void test_others(void **state)
{
    gen_random random;
    int32_t round;

    (void)state;
    gen_seed(&random, 103);
    for (round = 0; round < 300; round++) {
        perp_lcp_settings settings = run_settings(PERP_LCP_ACTIVE_SET);
        gen_lcp problem;
        char where[32];
        run r;
        int32_t i;

        allocate(&problem, 65 + gen_integer(&random, 60));
        random_matrix(&problem, &random, 0);
        random_data(&problem, &random, 0, 1);
        for (i = 0; i < problem.n; i++) {
            if (round % 2 && gen_integer(&random, 2) && problem.lower[i] > -INFINITY)
                problem.upper[i] = problem.lower[i] + gen_uniform(&random, 0, 2);
            if (round % 3) { /* signs at random keep a dominant matrix a P-matrix */
                *entry(&problem, i, i) += 0.125;
                if (i > 0 && gen_integer(&random, 2))
                    *entry(&problem, i, i - 1) *= -1.0;
            }
        }
        snprintf(where, sizeof where, "case %d", (int)round);
        run_lcp(&r, context, &problem, &settings, NULL, where);
        if (!run_ok(&r))
            fail_msg("%s: %s, residual %g", where, perp_outcome_text(r.result.outcome),
                     r.result.residual);
        run_release(&r);
        gen_destroy(&problem);
    }
}

/* A Z-matrix that is not an M-matrix: no solution for q < 0. Nobody may claim one. */
static void test_unsolvable(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_ACTIVE_SET);
    gen_lcp problem;
    run r;
    int32_t i, j;

    (void)state;
    allocate(&problem, 80);
    for (i = 0; i < problem.n; i++) {
        for (j = i - 1; j <= i + 1; j++)
            if (j >= 0 && j < problem.n)
                *entry(&problem, i, j) = i == j ? 1.0 : -1.0;
        problem.q[i] = -1.0;
    }
    run_lcp(&r, context, &problem, &settings, NULL, "unsolvable");
    assert_false(run_ok(&r));
    run_release(&r);
    settings.method = PERP_LCP_AUTO;
    run_lcp(&r, context, &problem, &settings, NULL, "unsolvable, auto");
    assert_false(run_ok(&r));
    run_release(&r);
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),     cmocka_unit_test(test_against_lemke),
        cmocka_unit_test(test_obstacle),   cmocka_unit_test(test_others),
        cmocka_unit_test(test_unsolvable),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
