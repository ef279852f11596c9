#define _POSIX_C_SOURCE 199309L /* clock_gettime */
/* Limits hold on every way: in differences, line searches, restarts and the linear
 * problems. Counted in calls, for no test may fail for time: a callback waits until the time is
 * over, and nothing but the look at the best point may follow. */
#include <math.h>
#include <string.h>
#include <time.h>

#include "suite.h"
#include <perp/perp.h>

#include "context.h"

enum { N = 12 };

#define LIMIT 2e-3 /* seconds */

/* The clock on the wall, as limits are: processor time runs ahead of it where threads of BLAS spin,
 * and a wait in it could end before the limit does. */
static double now(void)
{
    struct timespec time;

    assert_int_equal(clock_gettime(CLOCK_MONOTONIC, &time), 0);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

typedef struct watched {
    int calls, wait_at, stop_at, looks;
} watched;

static void wait(watched *u)
{
    if (++u->calls == u->wait_at) {
        const double until = now() + 2 * LIMIT;

        while (now() < until)
            continue;
    }
}

/* A chain with Billups' false minimum at its end: 0 is a trap, and only another start solves it. */
static int32_t chain(double *F, const double *z, void *user)
{
    watched *u = user;

    wait(u);
    for (int i = 0; i < N; i++)
        F[i] = z[i] * z[i] * z[i] + 4 * z[i] - (i > 0 ? z[i - 1] : 0) - (i + 1);
    F[N - 1] = (z[N - 1] - 1) * (z[N - 1] - 1) - 1.01 + 1e-3 * z[0];
    return 0;
}

static int32_t watch(const perp_ncp_progress *progress, void *user)
{
    watched *u = user;

    (void)progress;
    return ++u->looks == u->stop_at;
}

static perp_ncp_result solve(watched *u, const perp_ncp_settings *settings, double *z)
{
    perp_ncp_problem problem = fresh_ncp_problem();
    perp_ncp_result result = fresh_ncp_result();

    problem.n = N;
    problem.function = chain;
    problem.user = u;
    assert_int_equal(perp_ncp_solve(context, z, NULL, &result, settings, &problem, NULL), PERP_OK);
    assert_true(isfinite(result.residual) && isfinite(result.natural_residual));
    for (int i = 0; i < N; i++)
        assert_true(z[i] >= 0 && isfinite(z[i]));
    return result;
}

static perp_ncp_settings defaults(int32_t method)
{
    perp_ncp_settings settings = fresh_ncp_settings();

    settings.method = method;
    return settings;
}

static int is_good(const perp_ncp_result *result)
{
    return result->outcome == PERP_OUTCOME_SOLVED || result->outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

/* Wherever the time ends, one more call of F, at the point returned, is all. */
static void test_time(void **state)
{
    (void)state;
    for (int32_t method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++)
        for (int at = 1; at < 300; at += at < 40 ? 1 : 13) {
            perp_ncp_settings settings = defaults(method);
            watched u = {0};
            perp_ncp_result result;
            double z[N];

            u.wait_at = at;
            settings.time_limit = LIMIT;
            result = solve(&u, &settings, z);
            if (u.calls < at)
                continue; /* over before; for a good reason or for want of time */
            assert_true(u.calls <= at + 1);
            if (!is_good(&result))
                assert_int_equal(result.outcome, PERP_OUTCOME_TIME_LIMIT);
            assert_int_equal(result.trapped, 0);
        }
}

/* -3 whatever z is: no solution, and nothing that gives z a unit. */
static int32_t falls(double *F, const double *z, void *user)
{
    (void)z;
    wait(user);
    F[0] = -3;
    return 0;
}

static void test_time_without_units(void **state)
{
    (void)state;
    for (int32_t method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++)
        for (int at = 1; at < 40; at++) {
            perp_ncp_settings settings = defaults(method);
            watched u = {0};
            perp_ncp_problem problem = fresh_ncp_problem();
            perp_ncp_result result = fresh_ncp_result();
            const double start = -2;
            double z;

            u.wait_at = at;
            settings.time_limit = LIMIT;
            settings.scaling = settings.polish = 0;
            problem.n = 1;
            problem.function = falls;
            problem.user = &u;
            assert_int_equal(
                perp_ncp_solve(context, &z, NULL, &result, &settings, &problem, &start), PERP_OK);
            assert_false(is_good(&result));
            assert_true(result.residual > 0.0);
        }
}

/* The monitor is never asked again once it has said stop. */
static void test_stop(void **state)
{
    (void)state;
    for (int32_t method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++)
        for (int at = 1, stopped = 1; stopped; at += 1 + at / 8) {
            perp_ncp_settings settings = defaults(method);
            watched u = {0};
            perp_ncp_result result;
            double z[N];

            u.stop_at = at;
            settings.monitor = watch;
            settings.monitor_user = &u;
            result = solve(&u, &settings, z);
            stopped = u.looks >= at;
            assert_true(u.looks <= at);
            if (stopped && !is_good(&result))
                assert_int_equal(result.outcome, PERP_OUTCOME_STOPPED);
        }
}

/* Of all methods and starts together; and the more is granted, the better the point. */
static void test_iterations(void **state)
{
    (void)state;
    for (int32_t method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++) {
        double last = INFINITY;

        for (int32_t most = 1; most <= 40; most++) {
            perp_ncp_settings settings = defaults(method);
            watched u = {0};
            perp_ncp_result result;
            double z[N];

            settings.max_iterations = most;
            settings.polish = 0;
            result = solve(&u, &settings, z);
            assert_true(result.iterations <= most);
            if (result.iterations == most && !is_good(&result))
                assert_int_equal(result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
            assert_true(most > 1 || !is_good(&result)); /* or this test would test nothing */
            /* a point is compared by its own scales, which may differ by some powers of two */
            assert_true(result.natural_residual <= 4 * last);
            last = fmin(last, result.natural_residual);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_time),
        cmocka_unit_test(test_time_without_units),
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_iterations),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
