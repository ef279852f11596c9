/* Rays and what they prove. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "lcp/solver.h"
#include "run.h"
#include "scene.h"

#include "posed.h"

static const int32_t methods[] = {PERP_LCP_LEMKE, PERP_LCP_AUTO};

/* M = sum b b' over integer vectors b with b'y = 0, y a vector of small integers > 0: positive
 * semidefinite and singular along y, exactly. q'y < 0 leaves nothing: y'(M z + q) = q'y. */
static void make_singular(gen_lcp *problem, gen_random *random, int32_t n, double *y)
{
    double b[8];
    int32_t k, i, j;

    gen_begin_dense(problem, n);
    for (i = 0; i < n; i++)
        y[i] = 1 + gen_integer(random, 9);
    for (k = 0; k < n + 2; k++) {
        const int32_t p = gen_integer(random, n), r = (p + 1 + gen_integer(random, n - 1)) % n;

        memset(b, 0, sizeof b);
        b[p] = y[r];
        b[r] = -y[p];
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                problem->M[i * n + j] += b[i] * b[j];
    }
    for (i = 0; i < n; i++)
        problem->q[i] = gen_integer(random, 11) - 5;
}

static double product(const double *a, const double *b, int32_t n)
{
    double sum = 0.0;
    int32_t i;

    for (i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Every infeasible one is certified, though the ray's largest entry is made 1 and thirds and
 * sevenths are no doubles. */
static void test_whole_null_vectors(void **state)
{
    gen_random random;
    int round, infeasible = 0;
    size_t m;

    (void)state;
    gen_seed(&random, 61);
    for (round = 0; round < 400; round++) {
        const int32_t n = 2 + gen_integer(&random, 5);
        double y[8];
        gen_lcp problem;

        make_singular(&problem, &random, n, y);
        for (m = 0; m < 2; m++) {
            perp_lcp_settings settings = run_settings(methods[m]);
            run r;

            run_lcp(&r, context, &problem, &settings, NULL, "singular");
            if (product(problem.q, y, n) < 0.0) {
                assert_int_equal(r.result.outcome, PERP_OUTCOME_RAY);
                assert_int_equal(r.result.certificate, PERP_CERTIFICATE_INFEASIBLE);
                infeasible++;
            }
            run_release(&r);
        }
        gen_destroy(&problem);
    }
    assert_true(infeasible > 200);
}

/* Scaling rows and columns by powers of two keeps every certificate. */
static void test_scaled_null_vectors(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 62);
    for (round = 0; round < 100; round++) {
        perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
        double y[8];
        gen_lcp problem;
        int32_t i, j;
        run r;

        make_singular(&problem, &random, 4, y);
        problem.q[0] -= 1000;
        for (i = 0; i < 4; i++) {
            const double factor = ldexp(1.0, gen_integer(&random, 41) - 20);

            problem.q[i] *= factor;
            for (j = 0; j < 4; j++) {
                problem.M[4 * i + j] *= factor;
                problem.M[4 * j + i] *= factor;
            }
        }
        run_lcp(&r, context, &problem, &settings, NULL, "scaled");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_RAY);
        assert_int_equal(r.result.certificate, PERP_CERTIFICATE_INFEASIBLE);
        run_release(&r);
        gen_destroy(&problem);
    }
}

/* Two walls that close in on a body between them, with friction: gaps < 0 and a cone that is not
 * pointed. The multiplier (1, 1) of the normals proves that nothing gives way. */
static void test_closing_walls(void **state)
{
    /* normals at +1 and -1, two directions of friction each, mu = 1 */
    static const int M[] = {1, -1, 0,  0,  0, 0,  0, 0, -1, 1, 0,  0, 0,  0,  0, 0,
                            0, 0,  1,  -1, 1, -1, 1, 0, 0,  0, -1, 1, -1, 1,  1, 0,
                            0, 0,  1,  -1, 1, -1, 0, 1, 0,  0, -1, 1, -1, 1,  0, 1,
                            1, 0,  -1, -1, 0, 0,  0, 0, 0,  1, 0,  0, -1, -1, 0, 0};
    static const int q[] = {-1, -1, 0, 0, 0, 0, 0, 0};
    gen_lcp problem;
    size_t m;

    (void)state;
    gen_from_integers(&problem, 8, M, q);
    for (m = 0; m < 2; m++) {
        perp_lcp_settings settings = run_settings(methods[m]);
        run r;

        run_lcp(&r, context, &problem, &settings, NULL, "closing walls");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_RAY);
        assert_true(r.result.has_ray);
        run_release(&r);
    }
    gen_destroy(&problem);
}

/* A ray is told only after a second covering vector has led to one too: the first path is one pivot
 * long, and there are two. */
static int32_t count_starts(const perp_lcp_progress *progress, void *user)
{
    *(int *)user += progress->method == PERP_LCP_LEMKE && progress->iterations == 1;
    return 0;
}

static void test_second_opinion(void **state)
{
    static const int M[] = {0, 1, 0, 0};
    static const int q[] = {-1, 1};
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
    int starts = 0;
    gen_lcp problem;
    run r;

    (void)state;
    gen_from_integers(&problem, 2, M, q);
    settings.monitor = count_starts;
    settings.monitor_user = &starts;
    run_lcp(&r, context, &problem, &settings, NULL, "feasible, not solvable");
    assert_int_equal(r.result.outcome, PERP_OUTCOME_RAY);
    assert_int_equal(r.result.certificate, PERP_CERTIFICATE_NONE); /* z = (0, 1) has w >= 0 */
    assert_int_equal(starts, 2);
    run_release(&r);
    gen_destroy(&problem);
}

/* Along a ray a row that moves has dw = 0, one that rests dw >= 0; slack is for rounding. The sums
 * here are exact: by hand, dw = M dz + d is 0 or off by 1e-6 of its terms, which is no rounding. */
static void test_what_a_ray_is(void **state)
{
    static const double inf = INFINITY;
    static const struct {
        double M[4], ray[2], cover[2];
        int is_ray;
        double lower[2], upper[2];
    } cases[] = {
        {{-1, 0, 0, 1}, {1, 0}, {1, 1}, 1, {0, 0}, {inf, inf}},             /* dw = (0, 1) */
        {{-1, 0, 0, 1}, {1, 0}, {1 + 1e-6, 1}, 0, {0, 0}, {inf, inf}},      /* dw_0 = 1e-6, moves */
        {{-1, 0, 0, 1}, {1, 0}, {1 - 1e-6, 1}, 0, {0, 0}, {inf, inf}},      /* dw_0 = -1e-6 */
        {{0, 0, 0, 1}, {1, 0}, {0, 0}, 1, {0, 0}, {inf, inf}},              /* dw = 0 */
        {{0, 0, -1, 1}, {1, 0}, {0, 1}, 1, {0, 0}, {inf, inf}},             /* dw_1 = 0, rests */
        {{0, 0, -1, 1}, {1, 0}, {0, 1 - 1e-6}, 0, {0, 0}, {inf, inf}},      /* dw_1 = -1e-6 */
        {{0, 0, -1, 1}, {1, 0}, {0, 1 + 1e-6}, 1, {0, 0}, {inf, inf}},      /* dw_1 = 1e-6 */
        {{1, -1, -1, 1}, {0.5, 0.5}, {0, 0}, 1, {0, 0}, {inf, inf}},        /* dw = 0 */
        {{1, -1, -1 - 1e-6, 1}, {0.5, 0.5}, {0, 0}, 0, {0, 0}, {inf, inf}}, /* dw_1 = -5e-7 */
        {{1, -1, -1, 1}, {0, 0}, {1, 1}, 0, {0, 0}, {inf, inf}},            /* not a direction */
        {{-1, 0, 0, 1}, {-1, 0}, {1, 1}, 0, {0, 0}, {inf, inf}},            /* leaves z >= 0 */
        {{1, 0, 0, 1}, {1, 0}, {-1, 1}, 0, {0, 0}, {inf, inf}},             /* the cover falls */
        {{1, 0, 0, 1}, {-1, 0}, {1, 1}, 0, {0, 0}, {inf, inf}},             /* z_0 falls */
        {{1, 0, 0, 1}, {0, 0}, {1, 1}, 0, {-inf, -inf}, {inf, inf}},        /* nothing moves */
        /* from an upper bound: down for ever, w and cover the other way round */
        {{-1, 0, 0, 1}, {-1, 0}, {-1, 1}, 1, {-inf, 0}, {0, inf}},
        {{-1, 0, 0, 1}, {1, 0}, {-1, 1}, 0, {-inf, 0}, {0, inf}},
        {{0, 0, -1, 1}, {1, 0}, {0, -1}, 1, {0, -inf}, {inf, 0}},       /* dw_1 = -2 may fall */
        {{0, 0, 1, 1}, {1, 0}, {0, -1}, 1, {0, -inf}, {inf, 0}},        /* dw_1 = 0 */
        {{0, 0, 1, 1}, {1, 0}, {0, -1 + 1e-6}, 0, {0, -inf}, {inf, 0}}, /* may not rise */
        {{0, 0, 1, 1}, {1, 0}, {0, 1}, 0, {0, -inf}, {inf, 0}},         /* nor may the cover */
        /* between two bounds nothing goes on for ever, but w may go either way */
        {{-1, 0, 0, 1}, {1, 0}, {1, 1}, 0, {0, 0}, {1, inf}},
        {{0, 0, -1, 1}, {1, 0}, {0, 0}, 1, {0, 0}, {inf, 1}},
        {{0, 0, 1, 1}, {1, 0}, {0, 0}, 1, {0, 0}, {inf, 1}},
        /* free: |M dz| is no more than what covers it, whatever the sign */
        {{1, 0, 0, 1}, {1, 0}, {1, 0}, 1, {-inf, 0}, {inf, inf}},
        {{1, 0, 0, 1}, {-1, 0}, {1, 0}, 1, {-inf, 0}, {inf, inf}},
        {{1, 0, 0, 1}, {1, 0}, {1 - 1e-6, 0}, 0, {-inf, 0}, {inf, inf}},
    };
    static const double q[2] = {-1, -1};
    size_t k, i;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        perp_lcp_solver *solver = posed(2, cases[k].M, cases[k].lower, cases[k].upper, q);

        for (i = 0; i < 2; i++) { /* all scales are 1: diagonals are 0 or +-1 */
            assert_int_equal(solver->exponents[i], 0);
            solver->ray[i] = cases[k].ray[i];
            solver->covering[i] = cases[k].cover[i];
        }
        if (perp__ray_verify(solver) != cases[k].is_ray)
            fail_msg("case %d", (int)k);
        perp_lcp_solver_destroy(solver);
    }
}

/* Farkas: y >= 0, M'y <= 0 and y'(q + M l) < 0, exactly; and no upper bounds. A y that is not one
 * by a hair proves nothing, and most of these problems have a solution. */
static void test_what_a_proof_is(void **state)
{
    static const double inf = INFINITY;
    static const struct {
        int32_t n;
        double M[16], q[4], y[4];
        int proves;
        double lower, upper; /* of all */
    } cases[] = {
        {2, {1, -1, -1, 1}, {-1, -1}, {1, 1}, 1, 0, inf},
        {2, {1, -1, -1, 1}, {-3, 1}, {1, 1}, 1, 0, inf},
        {2, {1, -1, -1, 1}, {1, -1}, {1, 1}, 0, 0, inf},     /* z = (0, 1) */
        {2, {1, -1, -1, 1}, {1, 1}, {1, 1}, 0, 0, inf},      /* z = 0 */
        {2, {0, 1, 0, 0}, {-1, 0}, {1, 0}, 0, 0, inf},       /* M'y = (0, 1); z = (0, 1) */
        {2, {0, 0x1p-90, 0, 0}, {-1, 0}, {1, 0}, 0, 0, inf}, /* z = (0, 2^90) */
        {2, {0, -1, 0, 0}, {-1, 0}, {1, 0}, 1, 0, inf},
        {1, {-1}, {-1}, {1}, 1, 0, inf},
        {1, {-1}, {-1}, {1}, 0, -2, inf},    /* z = -2, w = 1 */
        {1, {-1}, {0.25}, {1}, 1, 0.5, inf}, /* w = 1/4 - z <= -1/4 */
        {1, {-1}, {-1}, {1}, 0, 0, 1},       /* z = 1, w = -2 */
        {1, {-1}, {-1}, {1}, 0, -inf, inf},  /* z = -1 */
        /* 2^53 + 1 - 2^53 - 1/2 > 0, but not if it is summed up in doubles */
        {4,
         {1, -1, 0, 0, -1, 1, 0, 0, 0, 0, 1, -1, 0, 0, -1, 1},
         {0x1p53, 1, -0x1p53, -0.5},
         {1, 1, 1, 1},
         0,
         0,
         inf},
        /* M'y = (2^-1100, -2^-600): feasible with z_0 = 2^500 */
        {2, {1, 0, 0x1p-500, -1}, {1, -1}, {0, 0x1p-600}, 0, 0, inf},
        /* y'q = 8 - 2^-51, the first of which underflows in units of 2^1023 */
        {2, {0, 0, 0, 0}, {0x1p-57, -0x1p1023}, {0x1p60, 0x1p-1074}, 0, 0, inf},
    };
    size_t k;
    int32_t i;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        double lower[4], upper[4];
        perp_lcp_solver *solver;

        for (i = 0; i < 4; i++) {
            lower[i] = cases[k].lower;
            upper[i] = cases[k].upper;
        }
        solver = posed(cases[k].n, cases[k].M, lower, upper, cases[k].q);
        for (i = 0; i < cases[k].n; i++) { /* as perp__ray_verify leaves them */
            solver->z[i] = cases[k].y[i];
            solver->ray[i] = ldexp(cases[k].y[i], -solver->exponents[i]);
        }
        if (perp__ray_certificate(solver) != cases[k].proves)
            fail_msg("case %d", (int)k);
        perp_lcp_solver_destroy(solver);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_whole_null_vectors), cmocka_unit_test(test_scaled_null_vectors),
        cmocka_unit_test(test_closing_walls),      cmocka_unit_test(test_second_opinion),
        cmocka_unit_test(test_what_a_ray_is),      cmocka_unit_test(test_what_a_proof_is),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
