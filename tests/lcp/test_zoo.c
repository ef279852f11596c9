/* A zoo of matrix classes with their solution sets, found by exact enumeration of complementary
 * bases, and the pivots that exact lexicographic Lemke takes (covering vector of ones, M unscaled).
 *
 * Sources: Cottle, Pang & Stone, "The Linear Complementarity Problem" (1992), chapters 3 and 4;
 * Murty, "Linear Complementarity, Linear and Nonlinear Programming" (1988), chapters 2 and 6; Hock
 * & Schittkowski (1981), problem 35. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

enum { MOST = 7, SOLUTIONS = 3 };

/* What covering vector e and the lexicographic rule lead to. */
enum { SOLUTION, RAY };

typedef struct animal {
    const char *name;
    int32_t n;
    int M[MOST * MOST];
    int q[MOST];
    int infeasible; /* no z >= 0 has w >= 0 */
    int count;      /* solutions; 0: none */
    double solutions[SOLUTIONS][MOST];
    int ends, pivots; /* of the lexicographic rule, z0's entry counted; -1: not known */
} animal;

static const animal zoo[] = {
    {"P, not PD", 2, {1, 3, 0, 1}, {-1, -1}, 0, 1, {{0, 1}}, SOLUTION, 2},
    {"PSD, singular, a segment of solutions",
     2,
     {1, 1, 1, 1},
     {-1, -1},
     0,
     2,
     {{0, 1}, {1, 0}},
     SOLUTION,
     2},
    {"P0, unsolvable", 2, {0, 1, 0, 0}, {1, -1}, 1, 0, {{0}}, RAY, 1},
    {"copositive-plus, infeasible", 2, {0, -1, 1, 0}, {-1, -1}, 1, 0, {{0}}, RAY, 3},
    {"copositive-plus, feasible", 2, {0, -1, 1, 0}, {1, -1}, 0, 1, {{1, 1}}, SOLUTION, 3},
    {"copositive, feasible but unsolvable", 2, {0, 1, 0, 0}, {-1, 1}, 0, 0, {{0}}, RAY, 1},
    {"strictly copositive, not P",
     2,
     {1, 2, 2, 1},
     {-1, -1},
     0,
     3,
     {{0, 1}, {1.0 / 3, 1.0 / 3}, {1, 0}},
     SOLUTION,
     2},
    {"Z, infeasible", 2, {1, -2, -2, 1}, {-1, -1}, 1, 0, {{0}}, RAY, 2},
    {"Z, feasible", 2, {1, -2, -2, 1}, {1, 1}, 0, 2, {{0, 0}, {1, 1}}, SOLUTION, 0},
    {"N, one solution, on no path from e", 2, {-1, 2, 2, -1}, {-1, -1}, 0, 1, {{1, 1}}, RAY, 1},
    {"N, three solutions", 2, {-1, 2, 2, -1}, {1, 1}, 0, 3, {{0, 0}, {0, 1}, {1, 0}}, SOLUTION, 0},
    {"skew", 2, {0, 1, -1, 0}, {-1, 2}, 0, 1, {{2, 1}}, SOLUTION, 3},
    {"PSD and Z, singular", 2, {1, -1, -1, 1}, {1, -1}, 0, 1, {{0, 1}}, SOLUTION, 2},
    {"degenerate q", 2, {1, 0, 0, 1}, {0, -1}, 0, 1, {{0, 1}}, SOLUTION, 2},
    {"zero matrix", 2, {0, 0, 0, 0}, {0, 1}, 0, 1, {{0, 0}}, SOLUTION, 0},
    {"bimatrix game: every covering vector leads to a ray",
     4,
     {0, 0, 10, 30, 0, 0, 20, 15, 10, 30, 0, 0, 20, 15, 0, 0},
     {-1, -1, -1, -1},
     0,
     3,
     {{0, 1.0 / 15, 0, 1.0 / 15}, {1.0 / 30, 1.0 / 45, 1.0 / 30, 1.0 / 45}, {0.1, 0, 0.1, 0}},
     RAY,
     1},
    {"Cottle, Pang & Stone, example 4.4.7",
     3,
     {0, -1, 2, 2, 0, -2, -1, 1, 0},
     {-3, 6, -1},
     0,
     1,
     {{0, 1, 3}},
     SOLUTION,
     5},
    {"the same transposed",
     3,
     {0, 2, -1, -1, 0, 1, 2, -2, 0},
     {-3, 6, -1},
     0,
     1,
     {{6, 1.5, 0}},
     SOLUTION,
     3},
    {"conditions of a quadratic program",
     4,
     {11, 0, 10, -1, 0, 11, 10, -1, 10, 10, 21, -1, 1, 1, 1, 0},
     {50, 50, 10, -6},
     0,
     1,
     {{2, 2, 2, 92}},
     SOLUTION,
     5},
    {"the same with a wrong sign",
     4,
     {11, 0, 10, 1, 0, 11, 10, 1, 10, 10, 21, 1, -1, -1, -1, 0},
     {50, 50, 10, -6},
     1,
     0,
     {{0}},
     RAY,
     1},
    {"circulant on which principal pivoting can cycle (Murty)",
     3,
     {1, 2, 0, 0, 1, 2, 2, 0, 1},
     {-1, -1, -1},
     0,
     1,
     {{1.0 / 3, 1.0 / 3, 1.0 / 3}},
     SOLUTION,
     4},
    {"its transpose",
     3,
     {1, 0, 2, 2, 1, 0, 0, 2, 1},
     {-1, -1, -1},
     0,
     1,
     {{1.0 / 3, 1.0 / 3, 1.0 / 3}},
     SOLUTION,
     6},
    {"two walls that push against each other", 2, {1, -1, -1, 1}, {-1, -1}, 1, 0, {{0}}, RAY, -1},
    {"Hock & Schittkowski 35",
     4,
     {4, 2, 2, 1, 2, 4, 0, 1, 2, 0, 2, 2, -1, -1, -2, 0},
     {-8, -6, -4, 3},
     0,
     1,
     {{4.0 / 3, 7.0 / 9, 4.0 / 9, 2.0 / 9}},
     SOLUTION,
     -1},
};

static void open_cage(gen_lcp *problem, const animal *a)
{
    gen_from_integers(problem, a->n, a->M, a->q);
}

/* Is z one of the solutions, or, on the segment of the singular PSD problem, between two? Entries
 * are below 100 and the condition numbers of the active blocks below 1e4: 1e-11 covers it. */
static int is_solution(const animal *a, const double *z)
{
    int k;

    for (k = 0; k < a->count; k++)
        if (run_distance(z, a->solutions[k], a->n) <= 1e-11)
            return 1;
    return strstr(a->name, "segment") && z[0] >= 0 && z[1] >= 0 && fabs(z[0] + z[1] - 1) <= 1e-11;
}

static int diagonal_is_positive(const animal *a)
{
    int32_t i;

    for (i = 0; i < a->n; i++)
        if (a->M[i * a->n + i] <= 0)
            return 0;
    return 1;
}

static const size_t animals = sizeof zoo / sizeof *zoo;

/* No outcome may contradict what is known, whichever the method and the settings. */
static void hold_to_the_truth(const animal *a, const run *r, const char *where)
{
    if (run_ok(r) && !is_solution(a, r->z))
        fail_msg("%s: solved, but z = (%g, %g, ...)", where, r->z[0], r->z[1]);
    if (r->result.certificate == PERP_CERTIFICATE_INFEASIBLE && !a->infeasible)
        fail_msg("%s: certified infeasible", where);
}

static void test_lexicographic_lemke(void **state)
{
    size_t k;

    (void)state;
    for (k = 0; k < animals; k++) {
        const animal *a = &zoo[k];
        perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
        gen_lcp problem;
        run r;

        settings.pivot_rule = PERP_PIVOT_LEXICOGRAPHIC;
        settings.scaling = 0;
        settings.crash = 0;
        open_cage(&problem, a);
        run_lcp(&r, context, &problem, &settings, NULL, a->name);
        hold_to_the_truth(a, &r, a->name);
        if ((r.result.outcome == PERP_OUTCOME_RAY) != (a->ends == RAY))
            fail_msg("%s: %s", a->name, perp_outcome_text(r.result.outcome));
        if (a->ends == SOLUTION && !run_ok(&r))
            fail_msg("%s: %s", a->name, perp_outcome_text(r.result.outcome));
        if (a->pivots >= 0 && r.result.iterations != a->pivots)
            fail_msg("%s: %d pivots, exact arithmetic takes %d", a->name, (int)r.result.iterations,
                     a->pivots);
        run_release(&r);
        gen_destroy(&problem);
    }
}

/* Ray or solution as the class promises; a ray on a feasible problem is "not processed", so the
 * default rule with its other covering vectors may find what e does not. */
static void check_default(const animal *a, int32_t method, int32_t scaling, int32_t polish)
{
    perp_lcp_settings settings = run_settings(method);
    char where[128];
    gen_lcp problem;
    run r;

    settings.scaling = scaling;
    settings.polish = polish;
    snprintf(where, sizeof where, "%s (%s, scaling %d, polish %d)", a->name,
             perp_lcp_method_text(method), (int)scaling, (int)polish);
    open_cage(&problem, a);
    run_lcp(&r, context, &problem, &settings, NULL, where);
    hold_to_the_truth(a, &r, where);
    if (a->ends == SOLUTION && !run_ok(&r))
        fail_msg("%s: %s", where, perp_outcome_text(r.result.outcome));
    if (a->count == 0 && r.result.outcome != PERP_OUTCOME_RAY)
        fail_msg("%s: %s", where, perp_outcome_text(r.result.outcome));
    if (a->infeasible && r.result.certificate != PERP_CERTIFICATE_INFEASIBLE)
        fail_msg("%s: infeasible, but no certificate", where);
    run_release(&r);
    gen_destroy(&problem);
}

static void test_default_lemke_and_auto(void **state)
{
    size_t k;
    int32_t setting;

    (void)state;
    for (k = 0; k < animals; k++)
        for (setting = 0; setting < 4; setting++) {
            check_default(&zoo[k], PERP_LCP_LEMKE, setting & 1, setting >> 1);
            check_default(&zoo[k], PERP_LCP_AUTO, setting & 1, setting >> 1);
        }
}

/* The iterative methods may fail, but must say so. */
static void test_iterative_methods_are_honest(void **state)
{
    static const int32_t methods[] = {PERP_LCP_PGS, PERP_LCP_FISCHER};
    size_t k, m;

    (void)state;
    for (k = 0; k < animals; k++)
        for (m = 0; m < 2; m++) {
            const animal *a = &zoo[k];
            perp_lcp_settings settings = run_settings(methods[m]);
            gen_lcp problem;
            run r;

            if (methods[m] == PERP_LCP_PGS && !diagonal_is_positive(a))
                continue;
            settings.max_iterations = 2000;
            open_cage(&problem, a);
            run_lcp(&r, context, &problem, &settings, NULL, a->name);
            hold_to_the_truth(a, &r, a->name);
            if (a->count == 0)
                assert_false(run_ok(&r));
            run_release(&r);
            gen_destroy(&problem);
        }
}

/* w = z1 - z2 - 1 and its opposite minus 2: no z >= 0 makes both non-negative, yet residuals
 * relative to |z| become as small as one likes along (1, 1). */
static void test_opposed_walls_are_never_solved(void **state)
{
    static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_PGS,
                                      PERP_LCP_FISCHER};
    static const double far[] = {1e15, 1e15};
    const int M[] = {1, -1, -1, 1}, q[] = {-1, -1};
    gen_lcp problem;
    int32_t m, bits;

    (void)state;
    gen_from_integers(&problem, 2, M, q);
    for (m = 0; m < 4; m++)
        for (bits = 0; bits < 32; bits++) {
            perp_lcp_settings settings = run_settings(methods[m]);
            run r;

            settings.scaling = bits & 1;
            settings.polish = bits >> 1 & 1;
            settings.pivot_rule = bits >> 2 & 1;
            settings.tol = bits >> 3 & 1 ? 1e-3 : 1e-12;
            run_lcp(&r, context, &problem, &settings, bits >> 4 ? far : NULL, "opposed walls");
            assert_false(run_ok(&r));
            if (m < 2) {
                assert_int_equal(r.result.outcome, PERP_OUTCOME_RAY);
                assert_int_equal(r.result.certificate, PERP_CERTIFICATE_INFEASIBLE);
                assert_true(r.ray[0] == 1.0 && r.ray[1] == 1.0);
            }
            run_release(&r);
        }
    gen_destroy(&problem);
}

/* det = e > 0: a P-matrix, so that there is a solution, far away: (2, 2 - e) / e. A ray
 * may be reported, a proof that there is none may not. */
static void test_nearly_opposed_walls_are_not_certified(void **state)
{
    static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE};
    int32_t m, bits, rule;

    (void)state;
    for (bits = 20; bits <= 50; bits++)
        for (m = 0; m < 2; m++)
            for (rule = 0; rule < 2; rule++) {
                const int M[] = {1, -1, -1, 1}, q[] = {-1, -1};
                perp_lcp_settings settings = run_settings(methods[m]);
                gen_lcp problem;
                run r;

                gen_from_integers(&problem, 2, M, q);
                problem.M[2] += ldexp(1.0, -bits);
                settings.pivot_rule = rule;
                run_lcp(&r, context, &problem, &settings, NULL, "nearly opposed walls");
                assert_int_equal(r.result.certificate, PERP_CERTIFICATE_NONE);
                run_release(&r);
                gen_destroy(&problem);
            }
}

/* Nash: a game of two players with finitely many strategies has an equilibrium. Costs from 1 to 8,
 * so that half of the games are degenerate; odd n: one player has a strategy more. */
static void test_games_are_solved(void **state)
{
    static const int32_t sizes[] = {4, 13, 20, 41, 100};
    static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE};
    static int M[100 * 100], q[100];
    gen_random random;
    int s, m, k;

    (void)state;
    gen_seed(&random, 51);
    for (s = 0; s < 5; s++)
        for (k = 0; k < 20; k++) {
            const int32_t n = sizes[s], first = n / 2;
            int64_t iterations[2];
            gen_lcp problem;

            for (int32_t i = 0; i < n; i++) {
                q[i] = -1;
                for (int32_t j = 0; j < n; j++)
                    M[i * n + j] = (i < first) == (j < first) ? 0 : 1 + gen_integer(&random, 8);
            }
            gen_from_integers(&problem, n, M, q);
            for (m = 0; m < 2; m++) {
                const perp_lcp_settings settings = run_settings(methods[m]);
                run r;

                run_lcp(&r, context, &problem, &settings, NULL, "a game");
                if (!run_ok(&r))
                    fail_msg("game %d of %d: %s by %s", k, (int)n,
                             perp_outcome_text(r.result.outcome), perp_lcp_method_text(methods[m]));
                iterations[m] = r.result.iterations;
                run_release(&r);
            }
            assert_true(iterations[0] <= iterations[1]); /* auto tries nothing before the starts */
            gen_destroy(&problem);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lexicographic_lemke),
        cmocka_unit_test(test_default_lemke_and_auto),
        cmocka_unit_test(test_iterative_methods_are_honest),
        cmocka_unit_test(test_opposed_walls_are_never_solved),
        cmocka_unit_test(test_games_are_solved),
        cmocka_unit_test(test_nearly_opposed_walls_are_not_certified),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
