/* The semismooth Newton method on small problems, inside and through the front door: every kind of
 * bound, zero diagonals, degenerate and singular problems, the classes of the zoo. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "lcp/method.h"
#include "run.h"

#include "context.h"

static void layout(perp__arena *arena, void *work)
{
    perp__lcp_fischer.layout(arena, work);
}

/* The method by its inner interface: unscaled, from z = 0 and without its own start. attempt 0: by
 * active sets where they serve; 2: every step is one of Newton's (or of its fall-backs, which would
 * need more than `limit`). */
static void newton(const perp__matrix *M, const gen_lcp *problem, const double *lower,
                   const double *upper, int attempt, int limit, const char *where)
{
    enum { MOST = 8 };
    double norms[MOST], l[MOST], u[MOST], z[MOST], w[MOST], values[MOST * MOST];
    const perp__matrix by_columns = {problem->n, problem->n, 1,   (size_t)problem->n,
                                     values,     NULL,       NULL};
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-12);
    perp__lcp_control control;
    perp__lcp_problem p;
    perp__lcp_iterate iterate;
    perp__arena arena;
    perp__sparse_block block;
    perp__lcp_work *work = check_allocate(1, perp__lcp_fischer.work_size);
    double residual = 0.0;

    memset(&control, 0, sizeof control);
    memset(&p, 0, sizeof p);
    memset(&iterate, 0, sizeof iterate);
    assert_in_range(problem->n, 1, MOST);
    for (int32_t i = 0; i < problem->n; i++) {
        norms[i] = NAN; /* for the start only */
        l[i] = lower ? lower[i] : 0.0;
        u[i] = upper ? upper[i] : INFINITY;
        z[i] = fmin(fmax(0.0, l[i]), u[i]);
        for (int32_t j = 0; j < problem->n; j++)
            values[i + j * problem->n] = problem->M[i * problem->n + j];
    }
    p.context = context;
    p.n = problem->n;
    p.M = M->column_starts ? M : &by_columns;
    p.row_norms = norms;
    p.q = problem->q;
    p.lower = l;
    p.upper = u;
    p.settings = &settings;
    p.tol = settings.tol;
    p.iteration_limit = limit;
    p.control = &control;
    iterate.z = z;
    iterate.warm = attempt == 0;
    iterate.attempt = attempt;
    memset(&block, 0, sizeof block);
    block.context = context;
    p.block = &block;
    assert_int_equal(perp__sparse_block_read(&block, p.M, norms), PERP_OK);
    work->problem = &p;
    memset(&arena, 0, sizeof arena);
    assert_int_equal(perp__arena_fit(&arena, context, layout, work), PERP_OK);
    assert_int_equal(perp__lcp_fischer.solve(work, &iterate), PERP_OK);
    if (iterate.outcome != PERP_OUTCOME_SOLVED)
        fail_msg("%s, inside: %s after %d", where, perp_outcome_text(iterate.outcome),
                 (int)iterate.iterations);
    check_multiply(&problem->view, 0, z, problem->q, NULL, w);
    for (int32_t i = 0; i < problem->n; i++) {
        assert_true(l[i] <= z[i] && z[i] <= u[i]);
        check_raise(&residual, fabs(fmax(fmin(z[i] - l[i], w[i]), z[i] - u[i])));
    }
    assert_true(residual <= 1e-12 + 1e-13); /* w is rounded: n |M| |z| eps = 8 * 21 * 92 eps */
    perp__arena_release(&arena);
    perp__sparse_block_release(&block);
    free(work);
}

/* Solves dense and sparse, inside and through the front door; z must be `expected` unless that is
 * NULL. */
static void solve_both(const int *entries, const int *load, int32_t n, const double *lower,
                       const double *upper, const double *expected, const char *where)
{
    perp_lcp_settings settings = run_alone(PERP_LCP_FISCHER, 1e-12);
    gen_lcp problem, sparse;

    gen_from_integers(&problem, n, entries, load);
    gen_to_csc(&sparse, &problem);
    for (int csc = 0; csc < 2; csc++) {
        perp__matrix M;
        run r;

        assert_int_equal(perp__matrix_read(context, "M", &M, csc ? &sparse.view : &problem.view),
                         PERP_OK);
        newton(&M, &problem, lower, upper, 0, 12, where);
        newton(&M, &problem, lower, upper, 2, 12, where);
        run_view(&r, context, csc ? &sparse.view : &problem.view, problem.q, lower, upper,
                 &settings, NULL, where);
        if (r.result.outcome != PERP_OUTCOME_SOLVED)
            fail_msg("%s: %s, %g", where, perp_outcome_text(r.result.outcome), r.result.residual);
        /* these matrices and their inverses are below 200 in the maximum norm, omega below 128 */
        if (expected && !(run_distance(r.z, expected, n) <= 1e-12 * 200.0 * 128.0))
            fail_msg("%s: off by %g", where, run_distance(r.z, expected, n));
        run_release(&r);
    }
    gen_destroy(&sparse);
    gen_destroy(&problem);
}

static void test_one_variable(void **state)
{
    static const double bounds[][2] = {{0.0, INFINITY}, {-1.0, INFINITY},      {-INFINITY, 1.0},
                                       {-2.0, 3.0},     {-INFINITY, INFINITY}, {1.5, 1.5}};
    static const int loads[] = {-64, -2, 0, 2, 64};
    const int four = 4;

    (void)state;
    for (size_t b = 0; b < sizeof bounds / sizeof bounds[0]; b++)
        for (size_t k = 0; k < sizeof loads / sizeof loads[0]; k++) {
            double expected = fmin(fmax(-loads[k] / 4.0, bounds[b][0]), bounds[b][1]);

            solve_both(&four, &loads[k], 1, &bounds[b][0], &bounds[b][1], &expected,
                       "one variable");
        }
}

/* Zero diagonals: a saddle point with a free multiplier, a quadratic program's KKT system with the
 * solution (2, 2, 2, 92), Cottle, Pang & Stone's example 4.4.7 with (0, 1, 3). */
static void test_zero_diagonals(void **state)
{
    static const int saddle[] = {2, 0, 1, 0, 2, 1, -1, -1, 0}, saddle_q[] = {-2, -6, 1};
    static const double saddle_l[] = {0, 0, -INFINITY}, saddle_u[] = {INFINITY, INFINITY, INFINITY};
    static const double saddle_z[] = {0, 1, 4}; /* min x^2 + y^2 - 2x - 6y, x + y = 1, x, y >= 0 */
    static const int qp[] = {11, 0, 10, -1, 0, 11, 10, -1, 10, 10, 21, -1, 1, 1, 1, 0};
    static const int qp_q[] = {50, 50, 10, -6};
    static const double qp_z[] = {2, 2, 2, 92};
    static const int cps[] = {0, -1, 2, 2, 0, -2, -1, 1, 0}, cps_q[] = {-3, 6, -1};
    static const double cps_z[] = {0, 1, 3};

    (void)state;
    solve_both(saddle, saddle_q, 3, saddle_l, saddle_u, saddle_z, "saddle");
    solve_both(qp, qp_q, 4, NULL, NULL, qp_z, "quadratic program");
    solve_both(cps, cps_q, 3, NULL, NULL, cps_z, "example 4.4.7");
}

/* z = 0 solves these, with w = 0 too in some rows or in all: the kink itself. M = 0 makes H
 * singular wherever phi_z = 0. */
static void test_degenerate(void **state)
{
    static const int identity[] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, ones[] = {1, 1, 1, 1, 1, 1, 1, 1, 1};
    static const int zeros[9] = {0}, nothing[3] = {0}, some[] = {0, 1, 2}, two[] = {-2, -2, -2};
    static const double origin[3] = {0.0};

    (void)state;
    solve_both(identity, nothing, 3, NULL, NULL, origin, "identity, q = 0");
    solve_both(zeros, nothing, 3, NULL, NULL, NULL, "M = 0, q = 0");
    solve_both(zeros, some, 3, NULL, NULL, NULL, "M = 0, q >= 0");
    solve_both(ones, some, 3, NULL, NULL, NULL, "ones");
    solve_both(ones, two, 3, NULL, NULL, NULL, "a plane of solutions");
}

/* P, strictly copositive, Z and cyclic matrices of the zoo; all solutions of the second by hand. */
static void test_small_classes(void **state)
{
    static const int p[] = {1, 3, 0, 1}, copositive[] = {1, 2, 2, 1};
    static const int z_matrix[] = {2, -1, -1, 2};
    static const int circulant[] = {1, 2, 0, 0, 1, 2, 2, 0, 1},
                     transposed[] = {1, 0, 2, 2, 1, 0, 0, 2, 1};
    static const int minus[] = {-1, -1, -1};
    static const double p_z[] = {0, 1}, one[] = {1, 1};
    static const double third[] = {1 / 3.0, 1 / 3.0, 1 / 3.0};

    (void)state;
    solve_both(p, minus, 2, NULL, NULL, p_z, "P");
    solve_both(copositive, minus, 2, NULL, NULL, NULL, "copositive");
    solve_both(z_matrix, minus, 2, NULL, NULL, one, "M-matrix");
    solve_both(circulant, minus, 3, NULL, NULL, third, "circulant");
    solve_both(transposed, minus, 3, NULL, NULL, third, "transposed circulant");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_variable),
        cmocka_unit_test(test_zero_diagonals),
        cmocka_unit_test(test_degenerate),
        cmocka_unit_test(test_small_classes),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
