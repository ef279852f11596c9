/* The edge of floating point: sizes at which squares, quotients and products leave the range of a
 * double, conditions at which residuals say nothing about z, and flush-to-zero. Nothing here may
 * return a NaN, an infinity or a claim that the recomputed numbers do not bear out. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include "suite.h"

#include "run.h"

#include "context.h"

static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_PGS, PERP_LCP_FISCHER};

static void make_diagonal(gen_lcp *problem, int32_t n, const double *diagonal, const double *q)
{
    const int zeros[64] = {0};
    int32_t i;

    gen_from_integers(problem, n, zeros, zeros);
    for (i = 0; i < n; i++) {
        problem->M[i * n + i] = diagonal[i];
        problem->q[i] = q[i];
    }
}

/* z = -q / M in one division, where that is a double. */
static void test_one_variable_of_any_size(void **state)
{
    static const double sizes[] = {DBL_MIN, 1e-300, 1e-160, 1e-100, 1e-10,  1.0,
                                   1e10,    1e100,  1e160,  1e300,  DBL_MAX};
    size_t a, b, m;

    (void)state;
    for (a = 0; a < 11; a++)
        for (b = 0; b < 11; b++)
            for (m = 0; m < 4; m++) {
                double M = sizes[a], q = -sizes[b], z = -q / M;
                perp_lcp_settings settings = run_settings(methods[m]);
                char where[96];
                gen_lcp problem;
                run r;

                snprintf(where, sizeof where, "M = %g, q = %g, %s", M, q,
                         perp_lcp_method_text(methods[m]));
                make_diagonal(&problem, 1, &M, &q);
                run_lcp(&r, context, &problem, &settings, NULL, where);
                if (isfinite(z) && z >= DBL_MIN) {
                    if (r.result.outcome != PERP_OUTCOME_SOLVED)
                        fail_msg("%s: %s", where, perp_outcome_text(r.result.outcome));
                    if (!(fabs(r.z[0] - z) <= 1e-10 * z)) /* tol, relative to q */
                        fail_msg("%s: z = %g, expected %g", where, r.z[0], z);
                } else if (!isfinite(z)) {
                    assert_false(run_ok(&r)); /* the solution is no double */
                }
                run_release(&r);
                gen_destroy(&problem);
            }
}

/* Diagonal entries from 1e-300 to 1e300 in one matrix, coupled by the geometric mean: equilibrated
 * it is a plain [2 1; 1 2] chain. */
static void test_graded_matrices(void **state)
{
    static const int powers[] = {-450, -100, 0, 33, 400}; /* rows times 2^p: M from 2^-900 */
    const int zeros[25] = {0};
    gen_lcp problem;
    size_t m;
    int32_t i, j;

    (void)state;
    gen_from_integers(&problem, 5, zeros, zeros);
    for (i = 0; i < 5; i++) {
        problem.q[i] = ldexp(i % 2 ? 3.0 : -4.0, powers[i]);
        for (j = 0; j < 5; j++)
            problem.M[5 * i + j] = ldexp(i == j            ? 2.0
                                         : abs(i - j) == 1 ? 1.0
                                                           : 0.0,
                                         powers[i] + powers[j]);
    }
    /* by hand: z = (2, 0, 2, 0, 2) before scaling: w_1 = w_3 = 4 + 3 */
    for (m = 0; m < 4; m++) {
        perp_lcp_settings settings = run_settings(methods[m]);
        run r;

        run_lcp(&r, context, &problem, &settings, NULL, perp_lcp_method_text(methods[m]));
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        for (i = 0; i < 5; i++) /* the active set is diagonal: exact */
            assert_true(r.z[i] == (i % 2 ? 0.0 : ldexp(2.0, -powers[i])));
        run_release(&r);
    }
    gen_destroy(&problem);
}

static double random_size(gen_random *random, double span)
{
    double fraction = gen_uniform(random, -1, 1);

    return ldexp(fraction, (int)gen_uniform(random, -span, span));
}

/* Entries so far apart that no scaling brings them together. */
static void test_hopeless_ranges_are_honest(void **state)
{
    gen_random random;
    int round;
    size_t m;

    (void)state;
    gen_seed(&random, 61);
    for (round = 0; round < 400; round++) {
        const int zeros[36] = {0};
        int32_t n = 1 + gen_integer(&random, 6), k;
        double span = round % 3 == 0 ? 20 : round % 3 == 1 ? 300 : 1000;
        gen_lcp problem;

        gen_from_integers(&problem, n, zeros, zeros);
        for (k = 0; k < n * n; k++)
            problem.M[k] = random_size(&random, span);
        for (k = 0; k < n; k++) {
            problem.q[k] = random_size(&random, span);
            problem.M[k * n + k] = fabs(problem.M[k * n + k]) + DBL_MIN;
        }
        for (m = 0; m < 4; m++) {
            perp_lcp_settings settings = run_settings(methods[m]);
            char where[64];
            run r;

            settings.max_iterations = methods[m] == PERP_LCP_PGS ? 500 : 0;
            settings.scaling = round % 2;
            snprintf(where, sizeof where, "round %d, %s", round, perp_lcp_method_text(methods[m]));
            run_lcp(&r, context, &problem, &settings, NULL, where);
            run_release(&r);
        }
        gen_destroy(&problem);
    }
}

/* The equilibrated problem is the same for every power of ten: solved at all of them. */
static void test_units(void **state)
{
    static const double units[] = {1e-140, 1e-70, 1e-12, 1e12, 1e70, 1e140};
    gen_random random;
    int round;
    size_t u, m;

    (void)state;
    gen_seed(&random, 62);
    for (round = 0; round < 40; round++)
        for (u = 0; u < 6; u++) {
            gen_lcp problem;
            int32_t i;

            gen_problem(&problem, &random, 8, GEN_PD_UNSYMMETRIC, GEN_PLAIN);
            for (i = 0; i < 64; i++)
                problem.M[i] *= units[u];
            for (i = 0; i < 8; i++)
                problem.q[i] *= units[(u + (size_t)round) % 6];
            for (m = 0; m < 4; m++) {
                perp_lcp_settings settings = run_settings(methods[m]);
                char where[64];
                run r;

                if (methods[m] == PERP_LCP_PGS) /* may not converge on these */
                    continue;
                snprintf(where, sizeof where, "unit %g, %s", units[u],
                         perp_lcp_method_text(methods[m]));
                run_lcp(&r, context, &problem, &settings, NULL, where);
                if (!run_ok(&r))
                    fail_msg("%s: %s", where, perp_outcome_text(r.result.outcome));
                run_release(&r);
            }
            gen_destroy(&problem);
        }
}

/* Residuals near eps while z is off in the first digit (n = 12: exact arithmetic needs 41 pivots
 * and gives e; no double does). The outcome stands on residuals, and may. */
static void test_hilbert(void **state)
{
    static const int32_t exact[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_FISCHER};
    int32_t n;
    size_t m;

    (void)state;
    for (n = 2; n <= 16; n++)
        for (m = 0; m < 3; m++) {
            perp_lcp_settings settings = run_settings(exact[m]);
            gen_lcp problem;
            char where[64];
            run r;

            gen_hilbert(&problem, n);
            snprintf(where, sizeof where, "Hilbert %d, %s", (int)n, perp_lcp_method_text(exact[m]));
            run_lcp(&r, context, &problem, &settings, NULL, where);
            if (!run_ok(&r))
                fail_msg("%s: %s, residual %g", where, perp_outcome_text(r.result.outcome),
                         r.result.residual);
            /* condition 1.6e7 at n = 6 times the rounding of q, 1e-16 */
            if (n <= 6)
                assert_true(run_distance(r.z, problem.z, n) <= 1e-8);
            run_release(&r);
            gen_destroy(&problem);
        }
}

/* Heavy over light, and light over heavy: condition 4 R, which no scaling lowers. */
static void test_two_body_stacks(void **state)
{
    static const int32_t exact[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_FISCHER};
    double ratio;
    size_t m;

    (void)state;
    for (ratio = 1e-12; ratio <= 1e12; ratio *= 10)
        for (m = 0; m < 3; m++) {
            /* lower body 1 on the ground, upper body `ratio` on it; both fall with speed 1 */
            perp_lcp_settings settings = run_settings(exact[m]);
            const int zeros[4] = {0};
            double z[2];
            char where[64];
            gen_lcp problem;
            run r;

            gen_from_integers(&problem, 2, zeros, zeros);
            problem.M[0] = 1;
            problem.M[1] = problem.M[2] = -1;
            problem.M[3] = 1 + 1 / ratio;
            problem.q[0] = -1;
            problem.q[1] = 0;
            z[1] = ratio; /* impulses that stop both: 1 + ratio on the ground, ratio between */
            z[0] = 1 + ratio;
            snprintf(where, sizeof where, "stack %g, %s", ratio, perp_lcp_method_text(exact[m]));
            run_lcp(&r, context, &problem, &settings, NULL, where);
            assert_int_equal(r.result.certificate, PERP_CERTIFICATE_NONE);
            /* from 1e11 on the second pivot is below 1e-11 of its column, which Lemke's method
             * takes for zero; what `auto` tries next does not */
            if (!run_ok(&r) && (exact[m] != PERP_LCP_LEMKE || ratio < 1e10))
                fail_msg("%s: %s", where, perp_outcome_text(r.result.outcome));
            /* M is rounded: relative eps in M_22 moves z by ratio eps */
            if (ratio <= 1e6)
                assert_true(fabs(r.z[0] - z[0]) <= 4 * DBL_EPSILON * (1 + ratio) * z[0]);
            run_release(&r);
            gen_destroy(&problem);
        }
}

/* Boxes a few units in the last place wide, bounds at the end of the range. */
static void test_bounds_at_the_edge(void **state)
{
    static const double bounds[][2] = {
        {1, 1 + DBL_EPSILON},   {-1e300, 1e300}, {-DBL_MAX, DBL_MAX}, {0, 5e-324},
        {DBL_MAX / 2, DBL_MAX}, {-5e-324, 0},    {1e-300, 2e-300}};
    size_t b, c, m;

    (void)state;
    for (b = 0; b < 7; b++)
        for (c = 0; c < 7; c++)
            for (m = 0; m < 4; m++) {
                static const int M[] = {2, 1, 1, 2}, q[] = {-3, 1};
                double lower[2] = {bounds[b][0], bounds[c][0]};
                double upper[2] = {bounds[b][1], bounds[c][1]};
                perp_lcp_settings settings = run_settings(methods[m]);
                char where[96];
                gen_lcp problem;
                run r;

                gen_from_integers(&problem, 2, M, q);
                snprintf(where, sizeof where, "bounds %d and %d, %s", (int)b, (int)c,
                         perp_lcp_method_text(methods[m]));
                run_view(&r, context, &problem.view, problem.q, lower, upper, &settings, NULL,
                         where);
                run_release(&r);
                gen_destroy(&problem);
            }
}

/* A caller that runs with denormals flushed gets the same answers. */
static void test_flush_to_zero(void **state)
{
#if defined(__SSE2__)
    gen_random random;
    int round;
    size_t m;

    (void)state;
    gen_seed(&random, 63);
    for (round = 0; round < 60; round++) {
        gen_lcp problem;

        if (round % 2) {
            const gen_contact_options contact = {3, 4, 4, 1e4, 1.0, 1, 1};

            gen_contact(&problem, &random, &contact);
        } else {
            gen_problem(&problem, &random, 8, GEN_PD_SYMMETRIC, round % GEN_BOUNDS);
        }
        for (m = 0; m < 2; m++) {
            perp_lcp_settings settings = run_settings(methods[m]);
            unsigned int control = _mm_getcsr();
            run plain, flushed;

            run_lcp(&plain, context, &problem, &settings, NULL, "plain");
            _mm_setcsr(control | 0x8040);            /* flush to zero, denormals are zero */
            if ((_mm_getcsr() & 0x8040) != 0x8040) { /* valgrind has no such mode */
                run_release(&plain);
                gen_destroy(&problem);
                skip();
            }
            run_lcp(&flushed, context, &problem, &settings, NULL, "flushed");
            assert_int_equal(_mm_getcsr() & 0x8040, 0x8040); /* the library leaves it alone */
            _mm_setcsr(control);
            assert_int_equal(flushed.result.outcome, plain.result.outcome);
            /* numbers near 1 never meet a denormal but in low parts below 1e-290 */
            assert_memory_equal(flushed.z, plain.z, (size_t)problem.n * sizeof(double));
            run_release(&plain);
            run_release(&flushed);
        }
        gen_destroy(&problem);
    }
#else
    (void)state;
    skip();
#endif
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_variable_of_any_size),
        cmocka_unit_test(test_graded_matrices),
        cmocka_unit_test(test_hopeless_ranges_are_honest),
        cmocka_unit_test(test_units),
        cmocka_unit_test(test_hilbert),
        cmocka_unit_test(test_two_body_stacks),
        cmocka_unit_test(test_bounds_at_the_edge),
        cmocka_unit_test(test_flush_to_zero),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
