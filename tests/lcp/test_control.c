/* Monitors, limits, and calls from inside a call. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include "base/clock.h"
#include "run.h"

#include "context.h"

static const int32_t methods[] = {PERP_LCP_LEMKE, PERP_LCP_PGS, PERP_LCP_FISCHER};

/* lemke: Murty's triangle, 128 pivots of the lexicographic rule. Others: a chain that is pushed on
 * one half and pulled on the other, which takes many sweeps and some Newton steps. */
static void make_long(gen_lcp *problem, perp_lcp_settings *settings, int32_t method)
{
    int M[49], q[7], i, j;

    for (i = 0; i < 7; i++) {
        q[i] = i < 4 || method == PERP_LCP_LEMKE ? -1 : 1;
        for (j = 0; j < 7; j++)
            if (method == PERP_LCP_LEMKE)
                M[7 * i + j] = i == j ? 1 : j < i ? 2 : 0;
            else
                M[7 * i + j] = i == j ? 2 : j == i - 1 || j == i + 1 ? -1 : 0;
    }
    gen_from_integers(problem, 7, M, q);
    *settings = run_settings(method);
    settings->pivot_rule = PERP_PIVOT_LEXICOGRAPHIC;
    settings->scaling = 0;
    settings->polish = 0;
}

typedef struct observer {
    int calls;
    int64_t last;
    int32_t method, answer, answer_at; /* the call to answer at, from 1; 0: never */
} observer;

static int32_t observe(const perp_lcp_progress *progress, void *user)
{
    observer *o = user;

    o->calls++;
    assert_true(progress->struct_size >= sizeof *progress);
    assert_int_equal(progress->method, o->method);
    assert_true(progress->iterations >= o->last);
    assert_true(progress->residual >= 0); /* not NaN */
    if (progress->method == PERP_LCP_LEMKE)
        assert_true(progress->residual == INFINITY);
    o->last = progress->iterations;
    return o->calls == o->answer_at ? o->answer : 0;
}

static void test_the_monitor_sees_every_method(void **state)
{
    size_t m;

    (void)state;
    for (m = 0; m < 3; m++) {
        observer o = {0, 0, 0, 0, 0};
        perp_lcp_settings settings;
        gen_lcp problem;
        run watched, alone;
        int32_t i;

        make_long(&problem, &settings, methods[m]);
        run_lcp(&alone, context, &problem, &settings, NULL, "alone");
        o.method = methods[m];
        settings.monitor = observe;
        settings.monitor_user = &o;
        run_lcp(&watched, context, &problem, &settings, NULL, "watched");
        if (methods[m] == PERP_LCP_LEMKE) /* every 16 of 128 pivots */
            assert_true(o.calls >= 7 && o.calls <= 9);
        else
            assert_true(o.calls >= 1);
        for (i = 0; i < 7; i++) /* watching changes nothing */
            assert_true(watched.z[i] == alone.z[i]);
        assert_int_equal(watched.result.iterations, alone.result.iterations);
        run_release(&alone);
        run_release(&watched);
        gen_destroy(&problem);
    }
}

/* A polite stop: the outcome, or a true solution if the best iterate happens to be one. */
static void test_the_monitor_can_stop(void **state)
{
    size_t m;
    int32_t at;

    (void)state;
    for (m = 0; m < 3; m++)
        for (at = 1; at <= 2; at++) {
            observer o = {0, 0, 0, 7, 0};
            perp_lcp_settings settings;
            gen_lcp problem;
            run r;

            make_long(&problem, &settings, methods[m]);
            o.method = methods[m];
            o.answer_at = at;
            settings.monitor = observe;
            settings.monitor_user = &o;
            run_lcp(&r, context, &problem, &settings, NULL, "stop");
            if (o.calls >= at) {
                assert_int_equal(o.calls, at); /* not asked again */
                assert_true(r.result.outcome == PERP_OUTCOME_STOPPED || run_ok(&r));
            }
            if (methods[m] == PERP_LCP_LEMKE)
                assert_int_equal(r.result.outcome, PERP_OUTCOME_STOPPED);
            run_release(&r);
            gen_destroy(&problem);
        }
}

static void fill(double *z, double *w, double *ray, perp_lcp_result *result, size_t n)
{
    size_t i;

    assert_int_equal(perp_struct_init(result, sizeof *result), PERP_OK);
    memset((char *)result + sizeof(size_t), 0x5a, sizeof *result - sizeof(size_t));
    for (i = 0; i < n; i++)
        z[i] = w[i] = ray[i] = 123.25;
}

static void assert_untouched(const double *z, const double *w, const double *ray,
                             const perp_lcp_result *result, size_t n)
{
    const unsigned char *bytes = (const unsigned char *)result;
    size_t i;

    for (i = 0; i < n; i++)
        assert_true(z[i] == 123.25 && w[i] == 123.25 && ray[i] == 123.25);
    assert_int_equal(result->struct_size, sizeof *result);
    for (i = sizeof(size_t); i < sizeof *result; i++)
        assert_int_equal(bytes[i], 0x5a);
}

static void test_the_monitor_can_abort(void **state)
{
    size_t m;

    (void)state;
    for (m = 0; m < 3; m++) {
        observer o = {0, 0, 0, -1, 1};
        perp_lcp_settings settings;
        double z[7], w[7], ray[7];
        perp_lcp_result result;
        perp_lcp_solver *solver;
        gen_lcp problem;

        make_long(&problem, &settings, methods[m]);
        o.method = methods[m];
        settings.monitor = observe;
        settings.monitor_user = &o;
        fill(z, w, ray, &result, 7);
        assert_int_equal(perp_lcp_solve(context, z, w, ray, &result, &settings,
                                        LCP(&problem.view, problem.q), NULL),
                         PERP_ERROR_CALLBACK);
        assert_string_not_equal(perp_context_message(context), "");
        assert_untouched(z, w, ray, &result, 7);

        /* a solver lives on, and the next solve is a whole one */
        assert_int_equal(perp_lcp_solver_create(context, &solver, &settings), PERP_OK);
        assert_int_equal(perp_lcp_solver_setup(solver, &problem.view, NULL, NULL), PERP_OK);
        o.calls = 0;
        o.last = 0;
        assert_int_equal(perp_lcp_solver_solve(solver, z, w, ray, &result, problem.q, NULL),
                         PERP_ERROR_CALLBACK);
        assert_untouched(z, w, ray, &result, 7);
        o.answer = 0;
        o.last = 0;
        assert_int_equal(perp_lcp_solver_solve(solver, z, w, ray, &result, problem.q, NULL),
                         PERP_OK);
        check_require(
            check_lcp_result(&problem.view, problem.q, NULL, NULL, z, w, ray, &result, &settings),
            "after an abort");
        perp_lcp_solver_destroy(solver);
        gen_destroy(&problem);
    }
}

/* ---- from inside a call --------------------------------------------------------------------- */

typedef struct intruder {
    perp_lcp_solver *solver;
    const gen_lcp *problem;
    int calls;
} intruder;

static int32_t intrude(const perp_lcp_progress *progress, void *user)
{
    intruder *in = user;
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
    perp_lcp_solver *another = NULL;
    perp_lcp_result result = fresh_lcp_result();
    double z[7];

    (void)progress;
    in->calls++;
    assert_int_equal(perp_lcp_solver_create(context, &another, NULL), PERP_ERROR_BUSY);
    assert_null(another);
    assert_int_equal(perp_lcp_solver_set(in->solver, &settings), PERP_ERROR_BUSY);
    assert_int_equal(perp_lcp_solver_setup(in->solver, &in->problem->view, NULL, NULL),
                     PERP_ERROR_BUSY);
    assert_int_equal(
        perp_lcp_solver_solve(in->solver, z, NULL, NULL, &result, in->problem->q, NULL),
        PERP_ERROR_BUSY);
    assert_int_equal(perp_lcp_solve(context, z, NULL, NULL, &result, NULL,
                                    LCP(&in->problem->view, in->problem->q), NULL),
                     PERP_ERROR_BUSY);
    return 0;
}

static void test_the_context_is_busy_inside_a_call(void **state)
{
    size_t m;

    (void)state;
    for (m = 0; m < 3; m++) {
        intruder in = {NULL, NULL, 0};
        perp_lcp_settings settings;
        perp_lcp_result result = fresh_lcp_result();
        gen_lcp problem;
        double z[7], w[7];
        run alone;

        make_long(&problem, &settings, methods[m]);
        run_lcp(&alone, context, &problem, &settings, NULL, "alone");
        settings.monitor = intrude;
        settings.monitor_user = &in;
        assert_int_equal(perp_lcp_solver_create(context, &in.solver, &settings), PERP_OK);
        assert_int_equal(perp_lcp_solver_setup(in.solver, &problem.view, NULL, NULL), PERP_OK);
        in.problem = &problem;
        assert_int_equal(perp_lcp_solver_solve(in.solver, z, w, NULL, &result, problem.q, NULL),
                         PERP_OK);
        assert_true(in.calls > 0);
        assert_memory_equal(z, alone.z, sizeof z);
        perp_lcp_solver_destroy(in.solver);
        run_release(&alone);
        gen_destroy(&problem);
    }
}

/* ---- limits --------------------------------------------------------------------------------- */

static void test_iteration_limits(void **state)
{
    size_t m;
    int32_t limit;

    (void)state;
    for (m = 0; m < 3; m++)
        for (limit = 1; limit <= 3; limit++) {
            perp_lcp_settings settings;
            gen_lcp problem;
            run r;

            make_long(&problem, &settings, methods[m]);
            settings.max_iterations = limit;
            run_lcp(&r, context, &problem, &settings, NULL, "limited");
            assert_true(r.result.iterations <= limit);
            if (methods[m] == PERP_LCP_LEMKE)
                assert_int_equal(r.result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
            assert_true(r.result.outcome == PERP_OUTCOME_ITERATION_LIMIT || run_ok(&r));
            run_release(&r);
            gen_destroy(&problem);
        }
}

/* No clock has a say in whether this passes: the outcome is time_limit, or the solve was over
 * before the clock was read; the numbers are true either way. */
static void test_time_limits(void **state)
{
    static const double limits[] = {1e-300, 1e-9, 1e-5, 1e9};
    static const int32_t all[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_PGS, PERP_LCP_FISCHER};
    size_t m, k;

    (void)state;
    for (m = 0; m < 4; m++)
        for (k = 0; k < 4; k++) {
            perp_lcp_settings settings;
            gen_lcp problem;
            run r;

            make_long(&problem, &settings, all[m]);
            settings.time_limit = limits[k];
            run_lcp(&r, context, &problem, &settings, NULL, "time");
            assert_true(r.result.outcome == PERP_OUTCOME_TIME_LIMIT || run_ok(&r));
            run_release(&r);
            gen_destroy(&problem);
        }
}

/* Waits until the clock has moved past the limit. */
static int32_t wait_for_the_clock(const perp_lcp_progress *progress, void *user)
{
    const double *end = user;

    (void)progress;
    while (perp__now() <= *end)
        ;
    return 0;
}

static void test_a_limit_that_has_passed(void **state)
{
    size_t m;

    (void)state;
    for (m = 0; m < 3; m++) {
        perp_lcp_settings settings;
        double end;
        gen_lcp problem;
        run r;

        make_long(&problem, &settings, methods[m]);
        settings.time_limit = 1e-4;
        settings.monitor = wait_for_the_clock;
        settings.monitor_user = &end;
        end = perp__now() + 2e-3; /* the solve starts long before: its limit is over by then */
        run_lcp(&r, context, &problem, &settings, NULL, "too late");
        if (methods[m] == PERP_LCP_LEMKE)
            assert_int_equal(r.result.outcome, PERP_OUTCOME_TIME_LIMIT);
        assert_true(r.result.outcome == PERP_OUTCOME_TIME_LIMIT || run_ok(&r));
        run_release(&r);
        gen_destroy(&problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_monitor_sees_every_method),
        cmocka_unit_test(test_the_monitor_can_stop),
        cmocka_unit_test(test_the_monitor_can_abort),
        cmocka_unit_test(test_the_context_is_busy_inside_a_call),
        cmocka_unit_test(test_iteration_limits),
        cmocka_unit_test(test_time_limits),
        cmocka_unit_test(test_a_limit_that_has_passed),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
