/* What `auto` tries first, and what is left of a solve that a limit ended. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "grids.h"
#include "run.h"
#include "scene.h"

#include "context.h"

static void solve(run *r, const gen_lcp *problem, double tol, double time_limit)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);

    settings.tol = tol;
    settings.time_limit = time_limit;
    run_lcp(r, context, problem, &settings, NULL, "auto");
}

/* gen_problem's classes are exactly solvable: the distance to the known z tells whether the answer
 * is as rough as was asked for, or exact. The bound 1e-9 is far above rounding (cond < 1e4) and far
 * below what a few sweeps reach. */
static void test_a_loose_tolerance_is_met_by_sweeps(void **state)
{
    gen_random random;
    gen_lcp problem;
    run rough, fine;

    (void)state;
    gen_seed(&random, 3);
    gen_problem(&problem, &random, 300, GEN_M, GEN_PLAIN);
    solve(&rough, &problem, 1e-2, 0);
    solve(&fine, &problem, 1e-10, 0);
    assert_int_equal(rough.result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(rough.result.method, PERP_LCP_PGS);
    assert_true(rough.result.residual <= 1e-2);
    assert_true(run_distance(rough.z, problem.z, problem.n) > 1e-9);
    assert_int_equal(fine.result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(run_distance(fine.z, problem.z, problem.n) < 1e-9);
    run_release(&rough);
    run_release(&fine);
    gen_destroy(&problem);
}

/* Contact problems have zeros on the diagonal: no sweeps, whatever the tolerance. */
static void test_sweeps_need_a_diagonal(void **state)
{
    static const gen_contact_options options = {4, 14, 8, 10, 0.5, 0, 0};
    gen_random random;
    gen_lcp problem;
    run r;

    (void)state;
    gen_seed(&random, 4);
    gen_contact(&problem, &random, &options);
    assert_true(problem.n >= 100);
    solve(&r, &problem, 1e-2, 0);
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_not_equal(r.result.method, PERP_LCP_PGS);
    run_release(&r);
    gen_destroy(&problem);
}

/* The cap of n / 16 = 15 sweeps ends far before the tolerance, and the direct methods take over: an
 * unmet loose tolerance never is the answer. That they are too slow shows after eight. */
static void test_slow_sweeps_are_given_up(void **state)
{
    gen_lcp problem;
    run r, direct;

    (void)state;
    gen_obstacle(&problem, 64); /* -u'' on 255 nodes: condition 2.6e4 */
    solve(&direct, &problem, 1e-10, 0);
    solve(&r, &problem, 1e-4, 0);
    assert_in_range(r.result.iterations, direct.result.iterations + 1,
                    direct.result.iterations + 8);
    run_release(&direct);
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_not_equal(r.result.method, PERP_LCP_PGS);
    assert_true(run_distance(r.z, problem.z, problem.n) < 1e-9);
    run_release(&r);
    gen_destroy(&problem);
}

/* The grid's matrix with a heavier diagonal, and q for the z drawn: half the rows are at 0. */
static void plant(gen_lcp *problem, gen_random *random, double diagonal)
{
    const grid_options options = {{45, 45, 1}, {0}, 0, 0, 1, NULL};

    grid_problem(problem, random, &options);
    problem->z = gen_allocate((size_t)problem->n, sizeof(double));
    for (int32_t j = 0; j < problem->n; j++)
        for (int32_t k = problem->column_starts[j]; k < problem->column_starts[j + 1]; k++)
            problem->values[k] *= problem->row_indices[k] == j ? diagonal : 1.0;
    for (int32_t j = 0; j < problem->n; j++) {
        const double x = gen_uniform(random, -1, 1);

        problem->z[j] = fmax(x, 0.0);
        problem->q[j] += fmax(-x, 0.0);
        for (int32_t k = problem->column_starts[j]; k < problem->column_starts[j + 1]; k++)
            problem->q[problem->row_indices[k]] -= problem->values[k] * problem->z[j];
    }
}

/* Rows whose diagonal is twice the rest: each sweep halves the error at least, so that some twenty
 * sweeps reach any tolerance, and nothing is factored. Where the diagonal exceeds the rest by a
 * tenth they promise it in 130, more than a factorisation is worth; by nothing, nothing. The
 * distance to the solution is at most the natural residual (X. Chen & S. Xiang, Math. Programming
 * 106 (2006) 513, with rows that exceed by more than 1), and what rounding leaves of numbers
 * below 10. */
static void test_a_heavy_diagonal_is_swept(void **state)
{
    gen_random random;
    gen_lcp heavy, middle, light;
    run r;

    (void)state;
    gen_seed(&random, 8);
    plant(&heavy, &random, 2.0);
    plant(&light, &random, 1.0);
    plant(&middle, &random, 1.1);
    solve(&r, &heavy, 1e-10, 0);
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(r.result.method, PERP_LCP_PGS);
    assert_true(r.result.iterations <= 20);
    assert_true(run_distance(r.z, heavy.z, heavy.n) <= r.result.natural_residual + 1e-13);
    run_release(&r);
    solve(&r, &middle, 1e-10, 0);
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_not_equal(r.result.method, PERP_LCP_PGS);
    run_release(&r);
    solve(&r, &light, 1e-10, 0);
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_not_equal(r.result.method, PERP_LCP_PGS);
    run_release(&r);
    gen_destroy(&heavy);
    gen_destroy(&middle);
    gen_destroy(&light);
}

/* Upwind convection: where a sweep goes along the flow, a few of them carry q through a small grid
 * and cost less than one LU; the many that a large one takes, where the flow is weak, are not
 * waited for, and active sets, which the signs promise to settle, follow. Any tolerance, the answer
 * is that of Newton's method: M-matrices have one solution. */
static void test_sweeps_take_a_small_flow(void **state)
{
    const perp_lcp_settings exact = run_settings(PERP_LCP_FISCHER);

    (void)state;
    for (int32_t side = 20; side <= 80; side += 60) {
        const grid_options options = {{side, side, 1}, {0}, 0, side == 20 ? 30 : 1, 0, NULL};
        gen_random random;
        gen_lcp problem;
        run r, other;

        gen_seed(&random, 9);
        grid_problem(&problem, &random, &options);
        for (int32_t i = 0; i < problem.n; i++)
            problem.q[i] = gen_uniform(&random, -1, 1);
        run_lcp(&other, context, &problem, &exact, NULL, "Newton");
        for (int32_t digits = 6; digits <= 12; digits += 3) {
            solve(&r, &problem, pow(10.0, -digits), 0);
            assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
            if (side == 20 || digits == 12)
                assert_int_equal(r.result.method, side == 20 ? PERP_LCP_PGS : PERP_LCP_ACTIVE_SET);
            assert_true(run_distance(r.z, other.z, problem.n) < 1e-10); /* condition below 1e5 */
            run_release(&r);
        }
        run_release(&other);
        gen_destroy(&problem);
    }
}

/* Row (i, j) of an option's equation, for the neighbour (i + x, j + y): asset i + 1, variance j,
 * central differences, mean reversion upwind (Heston, Review of Financial Studies 6 (1993) 327,
 * with a correlation of -0.9); a step of `length` backward in time. */
enum { ASSETS = 60, VARIANCES = 31 };

static double option_entry(int32_t i, int32_t j, int32_t x, int32_t y, double length)
{
    const double s = i + 1, step = 1.0 / (VARIANCES - 1), v = j * step;
    const double pull = 1.5 * (0.04 - v) / step;
    const int32_t in_x = i + 1 < ASSETS, in_y = j > 0 && j + 1 < VARIANCES;
    const double across = in_x ? 0.5 * s * s * v : 0.0, drift = in_x ? 0.5 * 0.025 * s : 0.0;
    const double along = in_y ? 0.5 * 0.09 * v / (step * step) : 0.0;
    const double mixed = in_x && in_y ? -0.9 * 0.3 * s * v / (4.0 * step) : 0.0;
    double value = 0.0;

    if (x != 0 && y != 0)
        value = -x * y * mixed;
    else if (x != 0)
        value = -across - x * drift;
    else if (y != 0)
        value = -along - fmax(y * pull, 0.0);
    else
        value = 0.025 + 2.0 * across + 2.0 * along + fabs(pull);
    return (x == 0 && y == 0) + length * value;
}

static void option_problem(gen_lcp *option, double length)
{
    const int32_t n = ASSETS * VARIANCES;
    int32_t count = 0;

    gen_begin(option, n);
    option->column_starts = gen_allocate((size_t)n + 1, sizeof(int32_t));
    option->row_indices = gen_allocate(9 * (size_t)n, sizeof(int32_t));
    option->values = gen_allocate(9 * (size_t)n, sizeof(double));
    for (int32_t column = 0; column < n; column++) {
        const int32_t asset = column % ASSETS;
        const double pay = fmax(100.0 - (asset + 1) * 300.0 / ASSETS, 0.0);

        option->q[column] -= pay; /* M pay - pay: z is what the option is worth beyond that */
        for (int32_t k = 0; k < 9; k++) {
            const int32_t i = asset + k % 3 - 1, j = column / ASSETS + k / 3 - 1;

            if (i < 0 || i >= ASSETS || j < 0 || j >= VARIANCES)
                continue;
            option->row_indices[count] = j * ASSETS + i;
            option->values[count] = option_entry(i, j, 1 - k % 3, 1 - k / 3, length);
            option->q[j * ASSETS + i] += option->values[count++] * pay;
        }
        option->column_starts[column + 1] = count;
    }
    assert_int_equal(perp_struct_init(&option->view, sizeof option->view), PERP_OK);
    assert_int_equal(perp_matrix_csc(&option->view, n, n, option->column_starts,
                                     option->row_indices, option->values),
                     PERP_OK);
}

/* Options with a correlated volatility: M is not symmetric and has positive couplings. The residual
 * of the sweeps promises no end, but their index set settles within the time of one LU: nothing
 * else is factored but for the polish. The answer is Newton's: prices of 100
 * to their rounding (1e-14) times the condition of M, about 1e5. */
static void test_options_are_swept(void **state)
{
    const perp_lcp_settings newton = run_settings(PERP_LCP_FISCHER);
    static const double lengths[] = {2.0, 5.0, 10.0};

    (void)state;
    for (int32_t k = 0; k < 3; k++) {
        gen_lcp option;
        run r, other;

        option_problem(&option, lengths[k]);
        run_lcp(&other, context, &option, &newton, NULL, "Newton");
        solve(&r, &option, 1e-10, 0);
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(r.result.method, PERP_LCP_PGS);
        assert_true(run_distance(r.z, other.z, option.n) < 1e-9);
        run_release(&r);
        run_release(&other);
        gen_destroy(&option);
    }
}

/* Asking for less costs no more: what is good at a loose tolerance is not polished, whoever found
 * it, and a point as rough as that is no exact one (1e-9: see above). */
static void test_nothing_good_is_polished_for_a_loose_tolerance(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_PGS);
    gen_random random;
    gen_lcp problem;
    run r;

    (void)state;
    gen_seed(&random, 3);
    gen_problem(&problem, &random, 300, GEN_M, GEN_PLAIN);
    for (int32_t k = 0; k < 2; k++) {
        settings.tol = k ? 1e-6 : 1e-2;
        run_lcp(&r, context, &problem, &settings, NULL, "sweeps");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(k == (run_distance(r.z, problem.z, problem.n) < 1e-9));
        run_release(&r);
    }
    gen_destroy(&problem);
}

/* A tridiagonal solve takes milliseconds: no limit above that changes what is done. */
static void test_a_limit_that_is_no_limit(void **state)
{
    const grid_options options = {{40000, 1, 1}, {0}, 0, 0, 0, NULL};
    gen_random random;
    gen_lcp problem;
    run free_run, limited;
    int32_t i;

    (void)state;
    gen_seed(&random, 7);
    grid_problem(&problem, &random, &options);
    for (i = 0; i < problem.n; i++)
        problem.q[i] = gen_uniform(&random, -1, 2);
    solve(&free_run, &problem, 1e-10, 0);
    solve(&limited, &problem, 1e-10, 1.0);
    assert_int_equal(limited.result.iterations, free_run.result.iterations);
    assert_int_equal(limited.result.method, free_run.result.method);
    assert_memory_equal(limited.z, free_run.z, (size_t)problem.n * sizeof(double));
    run_release(&free_run);
    run_release(&limited);
    gen_destroy(&problem);
}

/* Contacts with friction have no diagonal to lean on: pivoting comes before Newton's method. */
static void test_pivoting_comes_first_without_a_diagonal(void **state)
{
    const scene_options o = scene_draw(33);
    gen_lcp dense, sparse, problem;
    run r;

    (void)state;
    scene_lcp(&dense, &o);
    gen_to_csc(&sparse, &dense);
    problem = dense;
    problem.view = sparse.view;
    solve(&r, &problem, 1e-10, 0);
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(r.result.method, PERP_LCP_LEMKE);
    run_release(&r);
    gen_destroy(&sparse);
    gen_destroy(&dense);
}

/* q < 0 somewhere, so z = 0 has the residual max(-q): nothing worse may come back, and a limit that
 * passed before anything was done returns z = 0 itself. */
static void test_a_limit_returns_nothing_worse_than_the_start(void **state)
{
    static const int classes[] = {GEN_PD_SYMMETRIC, GEN_PD_UNSYMMETRIC, GEN_P, GEN_M};
    static const double limits[] = {1e-9, 1e-4, 1e-3, 1e-2};
    gen_random random;
    size_t c, k;

    (void)state;
    gen_seed(&random, 5);
    for (c = 0; c < sizeof classes / sizeof *classes; c++) {
        gen_lcp problem;
        perp_lcp_settings still = run_settings(PERP_LCP_LEMKE);
        run start;

        gen_problem(&problem, &random, 300, classes[c], GEN_PLAIN);
        still.max_iterations = 1;
        still.polish = 0;
        still.crash = 0;
        run_lcp(&start, context, &problem, &still, NULL, "one pivot");
        for (k = 0; k < sizeof limits / sizeof *limits; k++) {
            run r;

            solve(&r, &problem, 1e-10, limits[k]);
            assert_true(r.result.outcome == PERP_OUTCOME_SOLVED ||
                        r.result.outcome == PERP_OUTCOME_TIME_LIMIT);
            assert_true(r.result.residual <= start.result.residual);
            run_release(&r);
        }
        run_release(&start);
        gen_destroy(&problem);
    }
}

/* A method that cannot improve on the caller's start returns the start: the solution itself, given
 * as z0 with one pivot and no polish allowed. */
static void test_a_failed_solve_returns_a_better_start(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
    gen_random random;
    gen_lcp problem;
    run r;
    int32_t i;

    (void)state;
    gen_seed(&random, 6);
    gen_problem(&problem, &random, 40, GEN_PD_SYMMETRIC, GEN_PLAIN);
    settings.max_iterations = 1;
    settings.polish = 0;
    settings.pivot_rule = PERP_PIVOT_LEXICOGRAPHIC; /* which starts cold */
    for (i = 0; i < problem.n; i++) /* near enough to be good, too far to be solved */
        problem.z[i] += problem.z[i] > 0 ? 1e-6 : 0;
    run_lcp(&r, context, &problem, &settings, problem.z, "a better start");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
    assert_true(run_distance(r.z, problem.z, problem.n) == 0.0);
    run_release(&r);
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_loose_tolerance_is_met_by_sweeps),
        cmocka_unit_test(test_sweeps_need_a_diagonal),
        cmocka_unit_test(test_slow_sweeps_are_given_up),
        cmocka_unit_test(test_a_heavy_diagonal_is_swept),
        cmocka_unit_test(test_sweeps_take_a_small_flow),
        cmocka_unit_test(test_options_are_swept),
        cmocka_unit_test(test_nothing_good_is_polished_for_a_loose_tolerance),
        cmocka_unit_test(test_a_limit_that_is_no_limit),
        cmocka_unit_test(test_pivoting_comes_first_without_a_diagonal),
        cmocka_unit_test(test_a_limit_returns_nothing_worse_than_the_start),
        cmocka_unit_test(test_a_failed_solve_returns_a_better_start),
    };
    return cmocka_run_group_tests(tests, make, destroy);
}
