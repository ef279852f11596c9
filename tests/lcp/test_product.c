/* perp_lcp_solve: problems with exact solutions whose M the solver sees by products alone;
 * what it says of itself, recomputed; and every refusal. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "memory.h"
#include "run.h"

#include "context.h"

enum { MOST = 60 };

/* A problem, and how its product misbehaves. */
typedef struct seen {
    const gen_lcp *problem;
    const double *units; /* M is taken as U M U, or NULL */
    int calls, fails_at, answer;
    double skew; /* times what makes M unsymmetric */
} seen;

static int32_t multiply(double *y, const double *x, void *user)
{
    seen *s = user;
    const int32_t n = s->problem->n;

    if (++s->calls == s->fails_at && s->answer)
        return s->answer;
    for (int32_t i = 0; i < n; i++) {
        double sum = i + 1 < n ? s->skew * x[i + 1] : 0.0;

        for (int32_t j = 0; j < n; j++)
            sum += s->problem->M[(size_t)i * (size_t)n + (size_t)j] * x[j] *
                   (s->units ? s->units[j] : 1.0);
        y[i] = s->units ? s->units[i] * sum : sum;
    }
    if (s->calls == s->fails_at)
        y[0] = NAN;
    return 0;
}

static perp_status solve(seen *s, double *z, double *w, perp_lcp_result *result,
                         const perp_lcp_settings *settings, const double *diagonal,
                         const double *z0)
{
    const gen_lcp *p = s->problem;

    assert_int_equal(perp_struct_init(result, sizeof *result), PERP_OK);
    return perp_lcp_solve(context, z, w, NULL, result, settings,
                          LCP_PRODUCT(p->n, multiply, s, diagonal, p->q, p->lower, p->upper), z0);
}

/* Exact solutions of every kind of bounds are found; z is within them, w is what the exact product
 * gives, and both numbers that the result tells are those of docs/lcp.md. */
static void test_exact_solutions(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 5);
    for (int round = 0; round < 240; round++) {
        const int class = round % 4 == 3 ? GEN_PSD_LOW_RANK : GEN_PD_SYMMETRIC;
        gen_lcp p;
        perp_lcp_result result;
        double z[MOST], w[MOST], largest = 0.0;
        check_measures measures;

        gen_problem(&p, &random, 1 + gen_integer(&random, MOST), class, round / 4 % GEN_BOUNDS);
        assert_int_equal(solve(&(seen){.problem = &p}, z, w, &result, NULL, NULL, NULL), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(result.method, PERP_LCP_MPRGP);
        check_measure(&measures, &(check_lcp){&p.view, p.q, p.lower, p.upper, 0}, z, w);
        assert_true(measures.violation == 0.0);
        for (int32_t i = 0; i < p.n; i++)
            check_raise(&largest, fabs(p.q[i]));
        /* omega is at most max |q|; sums of 60 products round to 1e-13 of that */
        assert_true(measures.natural_residual <= (1e-10 + 1e-12) * fmax(largest, 1.0));
        assert_true(fabs(measures.natural_residual - result.natural_residual) <= 1e-12 * largest);
        if (class == GEN_PD_SYMMETRIC) /* the least eigenvalue of these is 1/16 and more */
            assert_true(run_distance(z, p.z, p.n) <= 1e-6);
        gen_destroy(&p);
    }
}

/* Units of powers of two, told by the diagonal, change no bit but for theirs. */
static void test_units(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 6);
    for (int round = 0; round < 30; round++) {
        gen_lcp p, scaled;
        perp_lcp_result results[2];
        double z[2][MOST], units[MOST], diagonal[2][MOST];
        const int32_t n = 2 + gen_integer(&random, 30);

        gen_problem(&p, &random, n, GEN_PD_SYMMETRIC, GEN_PLAIN);
        scaled = p;
        scaled.q = gen_allocate((size_t)n, sizeof(double));
        for (int32_t i = 0; i < n; i++) {
            units[i] = ldexp(1.0, gen_integer(&random, 60) - 30);
            diagonal[0][i] = p.M[(n + 1) * i];
            diagonal[1][i] = diagonal[0][i] * units[i] * units[i];
            scaled.q[i] = units[i] * p.q[i];
        }
        assert_int_equal(
            solve(&(seen){.problem = &p}, z[0], NULL, &results[0], NULL, diagonal[0], NULL),
            PERP_OK);
        assert_int_equal(solve(&(seen){.problem = &scaled, .units = units}, z[1], NULL, &results[1],
                               NULL, diagonal[1], NULL),
                         PERP_OK);
        assert_int_equal(results[0].outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(results[1].iterations, results[0].iterations);
        assert_true(results[1].residual == results[0].residual);
        for (int32_t i = 0; i < n; i++)
            assert_true(z[1][i] * units[i] == z[0][i]);
        free(scaled.q);
        gen_destroy(&p);
    }
}

/* A start at the solution costs one product, and those that look at |M|. */
static void test_start(void **state)
{
    gen_random random;
    gen_lcp p;
    perp_lcp_result result;
    double z[MOST], w[MOST];

    (void)state;
    gen_seed(&random, 7);
    gen_problem(&p, &random, 40, GEN_PD_SYMMETRIC, GEN_MIXED);
    assert_int_equal(solve(&(seen){.problem = &p}, z, w, &result, NULL, NULL, p.z), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(result.iterations <= 9);
    for (int32_t i = 0; i < p.n; i++)
        assert_true(z[i] == p.z[i] && w[i] == p.w[i]); /* all dyadic: no rounding */
    gen_destroy(&p);
}

/* What has no solution, or no least energy, is not said to have one. */
static void test_no_solution(void **state)
{
    static const int falls[] = {1, -1, -1, 1}, saddle[] = {1, 2, 2, 1}, none[] = {0, 0, 0, 0};
    static const int *const matrices[] = {falls, saddle, none};
    static const int q[] = {-1, -1};

    (void)state;
    for (int k = 0; k < 3; k++) {
        gen_lcp p;
        perp_lcp_result result;
        double z[2];

        gen_from_integers(&p, 2, matrices[k], q);
        assert_int_equal(solve(&(seen){.problem = &p}, z, NULL, &result, NULL, NULL, NULL),
                         PERP_OK);
        if (k == 1) /* z = (1, 0) solves it, but so may a path that ends there */
            assert_true(result.outcome == PERP_OUTCOME_SOLVED ||
                        result.outcome == PERP_OUTCOME_STALLED);
        else
            assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
        assert_true(result.residual > 0.1 || result.outcome == PERP_OUTCOME_SOLVED);
        gen_destroy(&p);
    }
}

/* Equations of low rank that contradict each other: the energy falls along a direction whose
 * curvature is rounding, and that is no step. */
static void test_rounding_is_no_curvature(void **state)
{
    enum { N = 20, RANK = 4 };
    gen_random random;

    (void)state;
    gen_seed(&random, 9);
    for (int round = 0; round < 20; round++) {
        double low[N], high[N], A[N][RANK], z[N];
        gen_lcp p;
        perp_lcp_result result = fresh_lcp_result();

        gen_begin_dense(&p, N);
        for (int i = 0; i < N; i++) {
            for (int k = 0; k < RANK; k++)
                A[i][k] = gen_normal(&random);
            p.q[i] = gen_normal(&random);
            low[i] = -INFINITY;
            high[i] = INFINITY;
        }
        for (int i = 0; i < N * N; i++)
            for (int k = 0; k < RANK; k++)
                p.M[i] += A[i / N][k] * A[i % N][k];
        assert_int_equal(
            perp_lcp_solve(context, z, NULL, NULL, &result, NULL,
                           LCP_PRODUCT(N, multiply, &(seen){.problem = &p}, NULL, p.q, low, high),
                           NULL),
            PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
        /* ten for |M| and gradients; a direction a dimension, and the one that falls for ever */
        assert_true(result.iterations <= 10 + RANK + 2);
        gen_destroy(&p);
    }
}

/* Units at the ends of doubles: what they can hold is solved, what they cannot is not said to be.
 */
static void test_ends_of_doubles(void **state)
{
    static const struct {
        double M, q;
        int ok;
    } cases[] = {{1e-150, -1e140, 1}, {1e150, -1e-140, 1}, {1.0, -1e300, 1},
                 {1.0, -1e-310, 1},   {1e-150, -1e200, 0}, {1e150, -1e-200, 0}};

    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        perp_lcp_result result;
        double M = cases[k].M, q = cases[k].q, z;
        gen_lcp p = {.n = 1, .M = &M, .q = &q};

        assert_int_equal(solve(&(seen){.problem = &p}, &z, NULL, &result, NULL, NULL, NULL),
                         PERP_OK);
        assert_true(isfinite(z));
        assert_int_equal(result.outcome == PERP_OUTCOME_SOLVED, cases[k].ok);
        if (cases[k].ok)
            assert_true(fabs(z / (-q / M) - 1.0) <= 1e-9);
    }
}

/* From a start 1e12 away sums of images err by 1e-4: what is told is a product's residual. */
static void test_drift(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 10);
    for (int round = 0; round < 20; round++) {
        gen_lcp p;
        perp_lcp_result result;
        check_measures measures;
        double z[MOST], w[MOST], far[MOST];

        gen_problem(&p, &random, 30, GEN_PD_SYMMETRIC, GEN_BOXED);
        for (int i = 0; i < p.n;
             i++) { /* equations alone: no bound is met, which takes a product */
            p.lower[i] = -INFINITY;
            p.upper[i] = INFINITY;
            far[i] = gen_uniform(&random, 0.0, 1e12);
        }
        assert_int_equal(solve(&(seen){.problem = &p}, z, w, &result, NULL, NULL, far), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        check_measure(&measures, &(check_lcp){&p.view, p.q, p.lower, p.upper, 0}, z, w);
        assert_true(measures.residual <= 1e-10 + 1e-12);
        gen_destroy(&p);
    }
}

static int32_t stop(const perp_lcp_progress *progress, void *user)
{
    assert_int_equal(progress->method, PERP_LCP_MPRGP);
    return *(int32_t *)user;
}

/* Limits, the monitor, and products that fail or are not symmetric. */
static void test_ends(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    gen_random random;
    gen_lcp p;
    perp_lcp_result result;
    int32_t answer = 1;
    double z[MOST], w[MOST];

    (void)state;
    gen_seed(&random, 8);
    gen_problem(&p, &random, 50, GEN_PD_SYMMETRIC, GEN_BOXED);
    settings.max_iterations = 12;
    assert_int_equal(solve(&(seen){.problem = &p}, z, w, &result, &settings, NULL, NULL), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
    assert_true(result.residual > settings.tol && result.iterations <= 15);
    settings.max_iterations = 0;
    settings.monitor = stop;
    settings.monitor_user = &answer;
    assert_int_equal(solve(&(seen){.problem = &p}, z, w, &result, &settings, NULL, NULL), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_STOPPED);
    z[0] = w[0] = 123.25;
    answer = -1;
    assert_int_equal(solve(&(seen){.problem = &p}, z, w, &result, &settings, NULL, NULL),
                     PERP_ERROR_CALLBACK);
    settings.monitor = NULL;
    assert_int_equal(solve(&(seen){.problem = &p, .fails_at = 11, .answer = -3}, z, w, &result,
                           NULL, NULL, NULL),
                     PERP_ERROR_CALLBACK);
    assert_non_null(strstr(perp_context_message(context), "-3"));
    assert_int_equal(solve(&(seen){.problem = &p, .skew = 0.25}, z, w, &result, NULL, NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "not symmetric"));
    assert_true(z[0] == 123.25 && w[0] == 123.25);
    for (int at = 1; at < 15; at++)
        for (int kind = 0; kind < 2; kind++) {
            assert_int_equal(solve(&(seen){.problem = &p, .fails_at = at, .answer = kind}, z, w,
                                   &result, NULL, NULL, NULL),
                             PERP_OK);
            assert_int_equal(result.outcome, PERP_OUTCOME_EVALUATION_FAILED);
        }
    gen_destroy(&p);
}

static void refused(perp_status status, perp_status expected, const char *words)
{
    assert_int_equal(status, expected);
    assert_non_null(strstr(perp_context_message(context), words));
}

static void test_refusals(void **state)
{
    static const int values[] = {2, 1, 1, 2}, offsets[] = {-1, -1};
    gen_lcp p;
    perp_lcp_result result = fresh_lcp_result();
    double z[2] = {123.25, 123.25}, low[] = {0, 2}, high[] = {1, 1}, bad[] = {1, NAN};
    const double flat[] = {1, 0};
    perp_lcp_sensitivity *sensitivity = NULL;
    perp_lcp_sensitivity_info info;
    perp_lcp_proof proof;
    perp_lcp_enumeration all;
    seen s = {.problem = &p};

    (void)state;
    assert_int_equal(perp_struct_init(&info, sizeof info), PERP_OK);
    assert_int_equal(perp_struct_init(&proof, sizeof proof), PERP_OK);
    assert_int_equal(perp_struct_init(&all, sizeof all), PERP_OK);
    gen_from_integers(&p, 2, values, offsets);
#define CALL(z, result, n, product, diagonal, q, low, high, z0) \
    perp_lcp_solve(context, z, NULL, NULL, result, NULL,        \
                   LCP_PRODUCT(n, product, &s, diagonal, q, low, high), z0)
    refused(CALL(z, &result, -1, multiply, NULL, p.q, NULL, NULL, NULL), PERP_ERROR_ARGUMENT,
            "n is -1");
    refused(CALL(z, &result, 2, NULL, NULL, p.q, NULL, NULL, NULL), PERP_ERROR_ARGUMENT,
            "M is NULL");
    refused(perp_lcp_solve(context, z, NULL, NULL, &result, NULL,
                           LCP(&p.view, p.q, .n = 2, .product = multiply), NULL),
            PERP_ERROR_ARGUMENT, "M and a product");
    refused(perp_lcp_solve(context, z, NULL, NULL, &result, NULL, LCP(&p.view, p.q, .reserved = 1),
                           NULL),
            PERP_ERROR_ARGUMENT, "problem.reserved is 1");
    refused(perp_lcp_solve(context, z, NULL, NULL, &result, NULL, NULL, NULL), PERP_ERROR_ARGUMENT,
            "M is NULL");
    refused(perp_lcp_verify(context, NULL, &proof, LCP(&p.view, p.q, .product = multiply), z),
            PERP_ERROR_ARGUMENT, "perp_lcp_solve alone");
    refused(perp_lcp_all(context, &all, NULL, LCP(&p.view, p.q, .product = multiply), NULL, NULL),
            PERP_ERROR_ARGUMENT, "perp_lcp_solve alone");
    refused(perp_lcp_sensitivity_create(context, &sensitivity, &info, NULL,
                                        LCP(&p.view, p.q, .product = multiply), z),
            PERP_ERROR_ARGUMENT, "perp_lcp_solve alone");
    refused(perp_lcp_batch(context, z, NULL, NULL, NULL, NULL, 1,
                           LCP_STACK(1, 2, flat, flat, .reserved = 1)),
            PERP_ERROR_ARGUMENT, "problems.reserved is 1");
    refused(CALL(NULL, &result, 2, multiply, NULL, p.q, NULL, NULL, NULL), PERP_ERROR_ARGUMENT,
            "z");
    refused(CALL(z, NULL, 2, multiply, NULL, p.q, NULL, NULL, NULL), PERP_ERROR_ARGUMENT, "result");
    refused(CALL(z, &result, 2, multiply, NULL, NULL, NULL, NULL, NULL), PERP_ERROR_ARGUMENT, "q");
    refused(CALL(z, &result, 2, multiply, NULL, bad, NULL, NULL, NULL), PERP_ERROR_NOT_FINITE,
            "q[1]");
    refused(CALL(z, &result, 2, multiply, NULL, p.q, low, high, NULL), PERP_ERROR_ARGUMENT,
            "lower[1]");
    refused(CALL(z, &result, 2, multiply, NULL, p.q, NULL, NULL, bad), PERP_ERROR_NOT_FINITE,
            "z0[1]");
    refused(CALL(z, &result, 2, multiply, flat, p.q, NULL, NULL, NULL), PERP_ERROR_ARGUMENT,
            "diagonal[1]");
    assert_true(z[0] == 123.25 && z[1] == 123.25);
    assert_int_equal(s.calls, 0);
    assert_int_equal(CALL(z, &result, 0, multiply, NULL, p.q, NULL, NULL, NULL), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(CALL(z, &result, 2, multiply, NULL, p.q, NULL, NULL, NULL), PERP_OK);
    assert_true(fabs(z[0] - 1.0 / 3.0) < 1e-9 && fabs(z[1] - 1.0 / 3.0) < 1e-9);
#undef CALL
    gen_destroy(&p);
}

static perp_status one_solve(const perp_context_settings *settings)
{
    static const int values[] = {2, 1, 1, 2}, offsets[] = {-1, -1};
    perp_context *own = NULL;
    perp_lcp_result result = fresh_lcp_result();
    gen_lcp p;
    double z[2];
    seen s = {.problem = &p};
    perp_status status = perp_context_create(&own, settings);

    if (status != PERP_OK)
        return status;
    gen_from_integers(&p, 2, values, offsets);
    status = perp_lcp_solve(own, z, NULL, NULL, &result, NULL,
                            LCP_PRODUCT(2, multiply, &s, NULL, p.q, NULL, NULL), NULL);
    gen_destroy(&p);
    perp_context_destroy(own);
    return status;
}

static void test_memory(void **state)
{
    (void)state;
    memory_fails_anywhere(one_solve, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exact_solutions),
        cmocka_unit_test(test_units),
        cmocka_unit_test(test_start),
        cmocka_unit_test(test_no_solution),
        cmocka_unit_test(test_rounding_is_no_curvature),
        cmocka_unit_test(test_drift),
        cmocka_unit_test(test_ends_of_doubles),
        cmocka_unit_test(test_ends),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
