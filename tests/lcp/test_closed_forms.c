/* Problems whose solution or pivot count is known in closed form: exponential families, quadratic
 * programs of Hock & Schittkowski (1981), a block on a ramp, an obstacle.
 *
 * Families: Murty, "Linear Complementarity, Linear and Nonlinear Programming" (1988), chapter 6;
 * Fathi, Math. Programming 17 (1979). */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

/* ---- exponential families ------------------------------------------------------------------ */

static void make_family(gen_lcp *problem, int32_t n, int family)
{
    enum { MOST = 20 };
    int M[MOST * MOST], q[MOST] = {0}, L[MOST * MOST], i, j, k;

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            L[i * n + j] = i == j ? 1 : j < i ? 2 : 0;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            int gram = 0;

            for (k = 0; k < n; k++)
                gram += L[i * n + k] * L[j * n + k];
            M[i * n + j] = family / 2 == 0 ? L[i * n + j] : family / 2 == 1 ? L[j * n + i] : gram;
        }
    for (i = 0; i < n; i++) {
        q[i] = family % 2 == 0 ? -1 : 0;
        for (j = i + 1; j <= n && family % 2 == 1; j++)
            q[i] -= 1 << j;
    }
    gen_from_integers(problem, n, M, q);
}

/* Murty's triangle and Fathi's matrix with q = -e or q2_i = -(2^i + ... + 2^n): Lemke's method
 * visits 2^n almost complementary bases, or 2, as exact arithmetic does for n = 2 .. 8. The
 * triangle's principal minors are 1, so that every number is an integer below 2^53 and rounding
 * plays no part. Fathi's tableaus hold fractions, and all right-hand sides but one are 0 on most of
 * the path: from n = 6 on rounding breaks some of those ties, in whatever way, and the path may
 * become shorter. */
static void test_exponential_families(void **state)
{
    static const char *const names[] = {"lower, -e", "lower, q2", "upper, -e",
                                        "upper, q2", "Fathi, -e", "Fathi, q2"};
    static const int exponential[] = {1, 0, 0, 1, 1, 0};
    int32_t n, family, i;

    (void)state;
    for (n = 2; n <= 8; n++)
        for (family = 0; family < 6; family++) {
            perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
            int64_t expected = exponential[family] ? INT64_C(1) << n : 2;
            gen_lcp problem;
            run r;

            settings.pivot_rule = PERP_PIVOT_LEXICOGRAPHIC;
            settings.scaling = 0;
            settings.max_iterations = 1000;
            make_family(&problem, n, family);
            run_lcp(&r, context, &problem, &settings, NULL, names[family]);
            assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
            if (family == 4 && n > 5)
                assert_true(r.result.iterations <= expected);
            else if (r.result.iterations != expected)
                fail_msg("%s, n = %d: %d pivots, exact arithmetic takes %d", names[family], (int)n,
                         (int)r.result.iterations, (int)expected);
            if (family == 0 || family == 4 || family == 1) /* e_1, and (2^(n+1) - 2) e_1 */
                for (i = 0; i < n; i++)
                    assert_true(r.z[i] == (i > 0 ? 0 : family == 1 ? (2 << n) - 2 : 1));
            run_release(&r);
            gen_destroy(&problem);
        }
}

/* A path of 2^20 pivots for e is given up after 200 + 8 n; the next, for a random vector, ends by
 * itself, and no third follows. */
static void test_a_long_path_is_left(void **state)
{
    enum { LENGTH = 20 };
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
    gen_lcp problem;
    run r;

    (void)state;
    settings.crash = 0;
    make_family(&problem, LENGTH, 3);
    run_lcp(&r, context, &problem, &settings, NULL, "upper, q2");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(r.result.iterations > 200 + 8 * LENGTH);
    assert_true(r.result.iterations < 2 * (200 + 8 * LENGTH));
    run_release(&r);
    gen_destroy(&problem);
}

/* ---- problems with rational or closed-form solutions ----------------------------------------- */

static void require_solution(const gen_lcp *problem, int32_t method, const double *z, double error,
                             const char *where)
{
    perp_lcp_settings settings = run_settings(method);
    run r;

    run_lcp(&r, context, problem, &settings, NULL, where);
    if (!run_ok(&r))
        fail_msg("%s, %s: %s", where, perp_lcp_method_text(method),
                 perp_outcome_text(r.result.outcome));
    if (!(run_distance(r.z, z, problem->n) <= error))
        fail_msg("%s, %s: off by %g", where, perp_lcp_method_text(method),
                 run_distance(r.z, z, problem->n));
    run_release(&r);
}

static void test_hock_schittkowski_76(void **state)
{
    /* x and the multipliers of three rows; w is doubled to make all data integers */
    static const int M[7][7] = {{4, 0, -2, 0, 2, 6, 0},    {0, 2, 0, 0, 4, 2, -2},
                                {-2, 0, 4, 2, 2, 4, -8},   {0, 0, 2, 2, 2, -2, 0},
                                {-2, -4, -2, -2, 0, 0, 0}, {-6, -2, -4, 2, 0, 0, 0},
                                {0, 2, 8, 0, 0, 0, 0}};
    static const int q[] = {-2, -6, 2, -2, 10, 8, -3};
    static const double z[] = {3.0 / 11, 23.0 / 11, 0, 6.0 / 11, 5.0 / 11, 0, 0};
    gen_lcp problem;

    (void)state;
    gen_from_integers(&problem, 7, &M[0][0], q);
    require_solution(&problem, PERP_LCP_LEMKE, z, 1e-13, "Hock & Schittkowski 76");
    require_solution(&problem, PERP_LCP_AUTO, z, 1e-13, "Hock & Schittkowski 76");
    gen_destroy(&problem);
}

/* A block on a ramp, one implicit step: z = (h b+, h b-, lambda), v+ soft-thresholded. In stick
 * only b+ - b- is unique. */
static void test_ramp(void **state)
{
    static const double speeds[] = {2.0, -2.0, 0.5, 0.0, -0.25, 1.0, -1.0}; /* vf */
    const double m = 2.0, cap = 2.0;                                        /* h c */
    size_t k;

    (void)state;
    for (k = 0; k < sizeof speeds / sizeof *speeds; k++) {
        const int zeros[9] = {0};
        double M[9] = {1 / m, -1 / m, 1, -1 / m, 1 / m, 1, -1, -1, 0};
        double vf = speeds[k], v = fabs(vf) > cap / m ? vf - copysign(cap / m, vf) : 0.0;
        gen_lcp problem;
        perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
        run r;

        gen_from_integers(&problem, 3, zeros, zeros);
        memcpy(problem.M, M, sizeof M);
        problem.q[0] = vf;
        problem.q[1] = -vf;
        problem.q[2] = cap;
        run_lcp(&r, context, &problem, &settings, NULL, "ramp");
        assert_true(run_ok(&r));
        /* all data are powers of two and their sums: the active set gives the exact answer */
        assert_true(vf + (r.z[0] - r.z[1]) / m == v);
        assert_true(r.z[2] == fabs(v));
        run_release(&r);
        gen_destroy(&problem);
    }
}

/* Exact at the nodes. Condition of the Laplacian on one side of the contact: about k^2. */
static void test_obstacle(void **state)
{
    static const int32_t methods[] = {PERP_LCP_LEMKE, PERP_LCP_AUTO, PERP_LCP_FISCHER};
    int32_t k;
    size_t m;

    (void)state;
    for (k = 1; k <= 16; k *= 2)
        for (m = 0; m < 3; m++) {
            gen_lcp problem;

            gen_obstacle(&problem, k);
            require_solution(&problem, methods[m], problem.z, 4e-16 * k * k, "obstacle");
            gen_destroy(&problem);
        }
}

/* h = 1/8: Lemke takes 7 pivots in exact arithmetic. */
static void test_obstacle_pivots(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
    gen_lcp problem;
    run r;

    (void)state;
    settings.pivot_rule = PERP_PIVOT_LEXICOGRAPHIC;
    settings.scaling = 0;
    gen_obstacle(&problem, 4);
    run_lcp(&r, context, &problem, &settings, NULL, "obstacle");
    assert_int_equal(r.result.iterations, 7);
    run_release(&r);
    gen_destroy(&problem);
}

/* w_2 reaches 0 together with z0 and faster: z0 has to leave, or a path that is over goes on, on
 * degenerate problems into false rays. */
static void test_z0_leaves_first(void **state)
{
    static const int M[] = {2, 0, -1, 2}, q[] = {-2, 1};
    gen_lcp problem;
    int32_t rule;

    (void)state;
    gen_from_integers(&problem, 2, M, q);
    for (rule = PERP_PIVOT_HARRIS; rule <= PERP_PIVOT_LEXICOGRAPHIC; rule++) {
        perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
        run r;

        settings.pivot_rule = rule;
        settings.scaling = 0;
        run_lcp(&r, context, &problem, &settings, NULL, "tie");
        assert_int_equal(r.result.iterations, 2);
        assert_true(r.z[0] == 1 && r.z[1] == 0);
        run_release(&r);
    }
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exponential_families),
        cmocka_unit_test(test_a_long_path_is_left),
        cmocka_unit_test(test_hock_schittkowski_76),
        cmocka_unit_test(test_ramp),
        cmocka_unit_test(test_obstacle),
        cmocka_unit_test(test_obstacle_pivots),
        cmocka_unit_test(test_z0_leaves_first),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
