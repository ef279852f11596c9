/* Contact LCPs of Stewart and Trinkle: copositive, degenerate, never P, and with gaps >= 0 always
 * solvable, whatever friction and mass ratio (Anitescu & Potra 1997). A ray on one is an error of
 * rounding; a plain float64 pivoting code reports one on 19 of 300. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"
#include "scene.h"

#include "context.h"

static void solve_by(const gen_lcp *problem, int32_t method, int32_t rule, int32_t scaling,
                     const char *name, int round, double *z)
{
    perp_lcp_settings settings = run_settings(method);
    char where[128];
    run r;

    settings.pivot_rule = rule;
    settings.scaling = scaling;
    snprintf(where, sizeof where, "%s, round %d, n = %d, %s", name, round, (int)problem->n,
             perp_lcp_method_text(method));
    run_lcp(&r, context, problem, &settings, NULL, where);
    if (!run_ok(&r))
        fail_msg("%s: %s, residual %g, backward error %g", where,
                 perp_outcome_text(r.result.outcome), r.result.residual, r.result.backward_error);
    memcpy(z, r.z, (size_t)problem->n * sizeof *z);
    run_release(&r);
}

static void solve(const gen_lcp *problem, int32_t method, const char *name, int round, double *z)
{
    solve_by(problem, method, PERP_PIVOT_HARRIS, 1, name, round, z);
}

/* z'M z = |m^-1/2 B x|^2 + sum mu lambda c for the order (normals, frictions, lambdas): the
 * generator makes what the theory is about. */
static void test_the_generator(void **state)
{
    static const gen_contact_options plain = {2, 3, 6, 10, 2.0, 0, 0};
    gen_random random;
    gen_lcp problem;
    int32_t n, i, j, round;

    (void)state;
    gen_seed(&random, 51);
    for (round = 0; round < 20; round++) {
        double quadratic = 0.0, friction = 0.0, delassus = 0.0, z[24];

        gen_contact(&problem, &random, &plain);
        n = problem.n;
        assert_int_equal(n, 24);
        for (i = 0; i < n; i++)
            z[i] = gen_uniform(&random, 0, 1);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                double term = z[i] * problem.M[i * n + j] * z[j];

                quadratic += term;
                if (i < 21 && j < 21) {
                    delassus += term;
                    assert_true(problem.M[i * n + j] == problem.M[j * n + i]);
                }
                if (i >= 21 && j < 3) /* mu in row lambda of its contact, column of the normal */
                    friction += term;
            }
        assert_true(delassus >= 0);
        /* 576 terms of size below 100: roundings far below 1e-10 */
        assert_true(fabs(quadratic - delassus - friction) <= 1e-10);
        for (i = 3; i < 6; i++) /* direction k + 3 is minus direction k, bit for bit */
            for (j = 0; j < 21; j++)
                assert_true(problem.M[i * n + j] == -problem.M[(i + 3) * n + j]);
        gen_destroy(&problem);
    }
}

/* Theory: 300 of 300. Systems of 1 to 3 contacts, 4 directions, friction up to 3. */
static void test_three_hundred(void **state)
{
    static const int32_t methods[] = {PERP_LCP_LEMKE, PERP_LCP_AUTO};
    gen_random random;
    int round;
    size_t m;

    (void)state;
    gen_seed(&random, 52);
    for (round = 0; round < 300; round++) {
        gen_contact_options options = {0, 0, 4, 1.0, 3.0, 0, 0};
        int32_t scaling;
        double z[32];
        gen_lcp problem;

        options.bodies = 1 + gen_integer(&random, 2);
        options.contacts = 1 + gen_integer(&random, 3);
        gen_contact(&problem, &random, &options);
        for (m = 0; m < 2; m++)
            solve(&problem, methods[m], "three hundred", round, z);
        /* one path, no restarts: z0 must leave wherever it ties */
        for (scaling = 0; scaling < 2; scaling++)
            solve_by(&problem, PERP_LCP_LEMKE, PERP_PIVOT_LEXICOGRAPHIC, scaling, "lexicographic",
                     round, z);
        gen_destroy(&problem);
    }
}

/* Mass ratios to 1e8, friction to 1e3, 4 to 16 directions, repeated contacts, any order. */
static void test_harsh(void **state)
{
    static const double ratios[] = {1, 1e2, 1e4, 1e8}, frictions[] = {0.5, 1, 30, 1e3};
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 53);
    for (round = 0; round < 300; round++) {
        gen_contact_options options;
        double z[256];
        gen_lcp problem;

        options.bodies = 1 + gen_integer(&random, 5);
        options.contacts = 1 + gen_integer(&random, 8);
        options.directions = 4 + 2 * gen_integer(&random, 7);
        options.mass_ratio = ratios[round % 4];
        options.mu_max = frictions[round / 4 % 4];
        options.duplicates = gen_integer(&random, options.contacts);
        options.permuted = round / 16 % 2;
        gen_contact(&problem, &random, &options);
        solve(&problem, round & 1 ? PERP_LCP_AUTO : PERP_LCP_LEMKE, "harsh", round, z);
        gen_destroy(&problem);
    }
}

/* A few of the size of a pile: the blocked updates and the refactored restarts. */
static void test_piles(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 54);
    for (round = 0; round < 6; round++) {
        gen_contact_options options = {12, 24, 8, 1e3, 1.0, 4, 1};
        double z[240];
        gen_lcp problem;

        gen_contact(&problem, &random, &options);
        solve(&problem, PERP_LCP_LEMKE, "pile", round, z);
        gen_destroy(&problem);
    }
}

/* Scenes of every class and mass ratio, with jitter, duplicates, motions and scalings: solved to
 * the last digits, and no false ray. */
static void test_scenes(void **state)
{
    uint64_t seed;
    int noisy = 0;

    (void)state;
    for (seed = 2001; seed <= 2120; seed++) {
        scene_options o = scene_draw(seed);
        perp_lcp_settings settings = run_settings(seed % 2 ? PERP_LCP_AUTO : PERP_LCP_LEMKE);
        char where[64];
        gen_lcp problem;
        run r;

        if (o.contacts > 24)
            o.contacts = 8 + o.contacts % 17;
        scene_lcp(&problem, &o);
        snprintf(where, sizeof where, "seed %d, %s", (int)seed, scene_class_text(o.class));
        run_lcp(&r, context, &problem, &settings, NULL, where);
        /* What no double near it betters (docs/lcp.md): a few roundings a row. A part
         * of M that carries next to nothing has hardly a rounding to be judged beside: there q
         * itself may be noise, of 1e-11 of its largest at most, as pivots go (Harris' ratio test),
         * and the second witness may refuse it. */
        noisy += r.result.backward_error > 4 * 0x1p-52;
        if ((!run_ok(&r) && r.result.residual > 1e-11) || noisy > 3 ||
            !(r.result.backward_error <= 4 * 0x1p-52 || r.result.residual <= 1e-11))
            fail_msg("%s: %s, residual %g, backward error %g", where,
                     perp_outcome_text(r.result.outcome), r.result.residual,
                     r.result.backward_error);
        run_release(&r);
        gen_destroy(&problem);
    }
}

/* The next step's problem differs a little; the last solution as a start must not hurt. */
/* Rows at rest whose data are twenty digits below the largest z: once hidden by what a rounding of
 * that z may change, so that the path ended with them violated by all that they are. */
static void test_rows_at_rest(void **state)
{
    scene_options o = scene_draw(1000245);
    gen_lcp problem;
    double *z;

    (void)state;
    scene_lcp(&problem, &o);
    z = malloc((size_t)problem.n * sizeof *z);
    assert_non_null(z);
    solve(&problem, PERP_LCP_LEMKE, "rows at rest", 0, z);
    free(z);
    gen_destroy(&problem);
}

static void test_warm_starts(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 55);
    for (round = 0; round < 60; round++) {
        gen_contact_options options = {3, 5, 4, 10, 1.0, 1, 0};
        double z[64];
        gen_lcp problem;
        int32_t i, step;

        gen_contact(&problem, &random, &options);
        solve(&problem, PERP_LCP_AUTO, "first step", round, z);
        for (step = 0; step < 4; step++) {
            perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
            run r;

            for (i = 0; i < 5 * 5; i++)
                problem.q[i] += i < 5 ? 1e-3 * gen_uniform(&random, 0, 1) : 0.0; /* gaps grow */
            run_lcp(&r, context, &problem, &settings, z, "warm");
            if (!run_ok(&r))
                fail_msg("warm start %d: %s", round, perp_outcome_text(r.result.outcome));
            memcpy(z, r.z, (size_t)problem.n * sizeof *z);
            run_release(&r);
        }
        gen_destroy(&problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_generator), cmocka_unit_test(test_three_hundred),
        cmocka_unit_test(test_harsh),         cmocka_unit_test(test_piles),
        cmocka_unit_test(test_scenes),        cmocka_unit_test(test_rows_at_rest),
        cmocka_unit_test(test_warm_starts),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
