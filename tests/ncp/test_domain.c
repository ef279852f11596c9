/* Functions that are not defined everywhere, and callbacks that stop or abort a solve. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"
#include <perp/perp.h>

#include "context.h"

/* How a callback behaves: the value it returns at which call. */
typedef struct behaviour {
    int calls, at, value;
    int says_nan; /* outside of the domain: NaN and 0, not 1 */
    perp_context *inside;
    perp_ncp_solver *solver;
} behaviour;

/* 1 + log(z_0) + z_1/2 = 0 and z_1 + z_0 >= 1, z_1 >= 0: defined for z_0 > 0 only.
 * With z_1 = 1 - z_0: 3/2 + log(z_0) = z_0/2. */
static int32_t logarithm(double *F, const double *z, void *user)
{
    behaviour *b = user;

    if (++b->calls == b->at && b->value < 0)
        return b->value;
    if (!(z[0] > 0) && !b->says_nan)
        return 1;
    F[0] = 1 + log(z[0]) + z[1] / 2;
    F[1] = z[1] + z[0] - 1;
    return 0;
}

static int32_t logarithm_jacobian(double *J, const double *z, void *user)
{
    (void)user;
    J[0] = 1 / z[0];
    J[1] = 1;
    J[2] = 0.5;
    J[3] = 1;
    return 0;
}

static perp_ncp_problem problem_of(behaviour *b)
{
    static const double lower[] = {-INFINITY, 0};
    perp_ncp_problem problem = fresh_ncp_problem();

    problem.n = 2;
    problem.function = logarithm;
    problem.jacobian = logarithm_jacobian;
    problem.lower = lower;
    problem.user = b;
    return problem;
}

/* Newton's full step leads outside from each of these; and two of them are outside. */
static void test_logarithm(void **state)
{
    static const double starts[][2] = {{1, 0},    {50, 3}, {1e-3, 0}, {1e3, 1e3},
                                       {0.3, 10}, {0, 0},  {-5, 1}};

    (void)state;
    for (int method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++)
        for (size_t s = 0; s < 2 * sizeof starts / sizeof *starts; s++) {
            behaviour b = {0};
            perp_ncp_problem problem = problem_of(&b);
            perp_ncp_settings settings = fresh_ncp_settings();
            perp_ncp_result result = fresh_ncp_result();
            double z[2];

            b.says_nan = s % 2 == 1;
            if (method == PERP_NCP_AUTO)
                problem.jacobian = NULL;
            settings.method = method;
            assert_int_equal(
                perp_ncp_solve(context, z, NULL, &result, &settings, &problem, starts[s / 2]),
                PERP_OK);
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            assert_true(fabs(z[1] - (1 - z[0])) <= 1e-12);
            assert_true(fabs(1.5 + log(z[0]) - z[0] / 2) <= 1e-12);
        }
}

static int32_t nowhere(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = z[0];
    return 1;
}

static int32_t not_a_number(double *F, const double *z, void *user)
{
    (void)user;
    (void)z;
    F[0] = 1; /* and F[1] is left out */
    return 0;
}

static void test_nowhere(void **state)
{
    perp_ncp_function functions[] = {nowhere, not_a_number};
    const double z0[] = {-3, 4};

    (void)state;
    for (int k = 0; k < 2; k++) {
        behaviour b = {0};
        perp_ncp_problem problem = problem_of(&b);
        perp_ncp_result result = fresh_ncp_result();
        double z[2], w[2];

        problem.lower = NULL;
        problem.function = functions[k];
        assert_int_equal(perp_ncp_solve(context, z, w, &result, NULL, &problem, z0), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_EVALUATION_FAILED);
        assert_true(z[0] == 0 && z[1] == 4); /* z0, projected */
        assert_true(isnan(w[0]) && isnan(w[1]));
        assert_true(isinf(result.residual) && isinf(result.natural_residual));
        assert_int_equal(result.trapped, 0);
    }
}

/* A Jacobian that is not defined: differences take its place. */
static int32_t no_jacobian(double *J, const double *z, void *user)
{
    (void)z;
    (void)user;
    J[0] = 1;
    return 0;
}

static void test_jacobian_outside(void **state)
{
    const double z0[] = {0.5, 0.5};
    behaviour b = {0};
    perp_ncp_problem problem = problem_of(&b);
    perp_ncp_result result = fresh_ncp_result();
    double z[2];

    (void)state;
    problem.jacobian = no_jacobian;
    assert_int_equal(perp_ncp_solve(context, z, NULL, &result, NULL, &problem, z0), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
}

static int32_t abort_jacobian(double *J, const double *z, void *user)
{
    behaviour *b = user;

    return b->calls >= b->at ? b->value : logarithm_jacobian(J, z, user);
}

/* Aborted at any call: the status, a message, and nothing written. */
static void test_abort(void **state)
{
    const double z0[] = {50, 3};
    int aborted = 1;

    (void)state;
    for (int which = 0; which < 3; which++)
        for (int at = 1; aborted || at == 1; at++) {
            behaviour b = {0};
            perp_ncp_problem problem = problem_of(&b);
            perp_ncp_result result, before;
            double z[2] = {7, 8}, w[2] = {9, 10};

            b.at = at;
            b.value = -3;
            if (which == 1)
                problem.jacobian = abort_jacobian;
            else if (which == 2)
                problem.jacobian = NULL;
            memset(&result, 0x5a, sizeof result);
            result.struct_size = sizeof result;
            before = result;
            aborted = perp_ncp_solve(context, z, w, &result, NULL, &problem, z0) != PERP_OK;
            if (!aborted)
                continue;
            assert_memory_equal(&result, &before, sizeof result);
            assert_true(z[0] == 7 && z[1] == 8 && w[0] == 9 && w[1] == 10);
            assert_non_null(strstr(perp_context_message(context), "-3"));
            assert_int_equal(perp_ncp_solve(context, z, w, &result, NULL, &problem, z0),
                             which == 1 ? PERP_ERROR_CALLBACK : PERP_OK);
        }
}

/* ---- monitors and limits --------------------------------------------------------------------- */

static int32_t watch(const perp_ncp_progress *progress, void *user)
{
    behaviour *b = user;

    assert_int_equal(progress->struct_size, sizeof *progress);
    assert_true(progress->residual >= 0);
    assert_true(progress->evaluations > 0);
    return ++b->calls == b->at ? b->value : 0;
}

static void test_monitor(void **state)
{
    const double z0[] = {50, 3};

    (void)state;
    for (int method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++) {
        behaviour b = {0}, m = {0};
        perp_ncp_problem problem = problem_of(&b);
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_result result = fresh_ncp_result();
        double z[2] = {0, 0};

        settings.method = method;
        settings.monitor = watch;
        settings.monitor_user = &m;
        m.at = 2;
        m.value = 1;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_STOPPED);
        assert_int_equal(result.iterations, 1);
        assert_int_equal(m.calls, 2); /* and no other run after that */
        assert_true(z[0] > 0);
        m.calls = 0;
        m.value = -1;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_ERROR_CALLBACK);
        settings.monitor = NULL;
        settings.max_iterations = 1;
        settings.restarts = 0;
        settings.polish = 0;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
        assert_int_equal(result.iterations, 1); /* of all methods together */
        settings.max_iterations = 0;
        settings.time_limit = 1e-9;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_TIME_LIMIT);
    }
}

/* No solution: z_1 has to grow for ever, and with it the other row, beside which the rest becomes
 * nothing. */
static int32_t runaway(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = exp(z[1]) * (1 + z[0]);
    F[1] = -1 / (1 + z[1]);
    return 0;
}

/* No method calls a point of a problem without a solution good. */
static void check_unsolved(perp_ncp_function function, perp_ncp_jacobian jacobian, const double *z0)
{
    for (int method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++) {
        behaviour b = {0};
        perp_ncp_problem problem = problem_of(&b);
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_result result = fresh_ncp_result();
        double z[2];

        problem.lower = NULL;
        problem.function = function;
        problem.jacobian = jacobian;
        settings.method = method;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_OK);
        assert_true(result.outcome != PERP_OUTCOME_SOLVED &&
                    result.outcome != PERP_OUTCOME_ROUNDING_LIMIT);
    }
}

static void test_scales_that_run_away(void **state)
{
    (void)state;
    check_unsolved(runaway, NULL, NULL);
}

/* z_0 >= 1/2, defined up to 1, and -1 - z_1 >= 0 with z_1 >= 0, which has no solution. */
static int32_t walled(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = z[0] - 0.5;
    F[1] = -1 - z[1];
    return z[0] > 1;
}

static int32_t walled_jacobian(double *J, const double *z, void *user)
{
    (void)user;
    (void)z;
    J[0] = 1;
    J[1] = J[2] = 0;
    J[3] = -1;
    return 0;
}

/* From far outside the start is sought 1e17 away in all coordinates: that is no size of z_1, beside
 * which a row that is violated by all that it has would be nothing. */
static void test_sizes_of_the_start(void **state)
{
    const double z0[] = {1e17, 0};

    (void)state;
    check_unsolved(walled, walled_jacobian, z0);
}

/* A callback that calls back. */
static int32_t intrude(double *F, const double *z, void *user)
{
    behaviour *b = user;
    perp_ncp_result result = fresh_ncp_result();
    double other[2];

    assert_int_equal(perp_ncp_solver_solve(b->solver, other, NULL, &result, NULL), PERP_ERROR_BUSY);
    perp_ncp_solver_destroy(b->solver); /* ignored */
    return logarithm(F, z, user);
}

/* exp(z_i) - exp(a_i), which overflows at 710, or 1 / (1 - z_i) - 1 / (1 - a_i), defined for z_i <
 * 1: one answer, z = a. Newton's step from z = 1/2 is up to 1e16 times too long. */
typedef struct edges {
    int32_t n, is_pole;
    double a[3];
} edges;

static int32_t edge_function(double *F, const double *z, void *user)
{
    const edges *e = user;

    for (int32_t i = 0; i < e->n; i++) {
        if (e->is_pole && z[i] >= 1)
            return 1;
        F[i] = e->is_pole ? 1 / (1 - z[i]) - 1 / (1 - e->a[i]) : exp(z[i]) - exp(e->a[i]);
    }
    return 0;
}

static int32_t edge_jacobian(double *J, const double *z, void *user)
{
    const edges *e = user;

    memset(J, 0, (size_t)(e->n * e->n) * sizeof *J);
    for (int32_t i = 0; i < e->n; i++)
        J[i + e->n * i] = e->is_pole ? 1 / (1 - z[i]) / (1 - z[i]) : exp(z[i]);
    return 0;
}

/* By every method. A tested residual of 1e-10 leaves 1e-9 of F, and with poles a billionth of the
 * largest 1 / (1 - a) squared, which is beside how far the smallest may be off: 1e-10 * 1e8. */
static void test_steps_far_outside(void **state)
{
    int solved = 0;

    (void)state;
    for (int repeat = 0; repeat < 300; repeat++) {
        perp_ncp_problem problem = fresh_ncp_problem();
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_result result = fresh_ncp_result();
        const double z0[] = {0.5, 0.5, 0.5};
        double z[3];
        edges e = {.n = 1 + repeat % 3, .is_pole = repeat / 3 % 2};

        for (int32_t i = 0; i < e.n; i++) {
            const double share = (double)((7 * repeat + 31 * i) % 100) / 100;

            e.a[i] = e.is_pole ? 1 - pow(10, -1 - 3 * share) : 1 + 39 * share;
        }
        problem.n = e.n;
        problem.function = edge_function;
        problem.jacobian = edge_jacobian;
        problem.user = &e;
        settings.method = repeat / 6 % 3;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_OK);
        /* josephy's full steps from an edge at 700 are -1: it may take more than its 500 */
        if (settings.method == PERP_NCP_JOSEPHY && result.outcome == PERP_OUTCOME_ITERATION_LIMIT)
            continue;
        if (result.outcome != PERP_OUTCOME_SOLVED)
            fail_msg("%d, method %d: %s", repeat, settings.method,
                     perp_outcome_text(result.outcome));
        solved++;
        for (int32_t i = 0; i < e.n; i++)
            assert_true(fabs(z[i] - e.a[i]) <= 1e-2 * (e.is_pole ? 1 - e.a[i] : 1));
    }
    assert_true(solved >= 295);
}

/* z = 1, defined up to 0 only, where it starts. No step leads on: none is taken, and each of those
 * that end outside is halved down to a rounding, 52 times or a few more for its length, where the
 * least double is 1074 halvings from 1. */
static int32_t cut_off(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = z[0] - 1;
    return z[0] > 0;
}

static void test_start_at_the_edge(void **state)
{
    const double z0[] = {0}, lower[] = {-INFINITY};

    (void)state;
    for (int32_t method = PERP_NCP_FISCHER; method <= PERP_NCP_JOSEPHY; method++) {
        perp_ncp_problem problem = fresh_ncp_problem();
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_result result = fresh_ncp_result();
        double z[1];

        problem.n = 1;
        problem.lower = lower;
        problem.function = cut_off;
        settings.method = method;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
        assert_true(z[0] == 0 && result.iterations == 0);
        if (method == PERP_NCP_JOSEPHY) /* one search */
            assert_true(result.function_evaluations < 200);
    }
}

static void test_busy(void **state)
{
    const double z0[] = {1, 0};
    behaviour b = {0};
    perp_ncp_problem problem = problem_of(&b);
    perp_ncp_result result = fresh_ncp_result();
    double z[2];

    (void)state;
    problem.function = intrude;
    assert_int_equal(perp_ncp_solver_create(context, &b.solver, NULL), PERP_OK);
    assert_int_equal(perp_ncp_solver_setup(b.solver, &problem), PERP_OK);
    assert_int_equal(perp_ncp_solver_solve(b.solver, z, NULL, &result, z0), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    perp_ncp_solver_destroy(b.solver);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_logarithm),
        cmocka_unit_test(test_nowhere),
        cmocka_unit_test(test_jacobian_outside),
        cmocka_unit_test(test_abort),
        cmocka_unit_test(test_monitor),
        cmocka_unit_test(test_scales_that_run_away),
        cmocka_unit_test(test_sizes_of_the_start),
        cmocka_unit_test(test_steps_far_outside),
        cmocka_unit_test(test_start_at_the_edge),
        cmocka_unit_test(test_busy),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
