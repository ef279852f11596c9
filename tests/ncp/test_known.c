/* Problems of the literature whose solutions are known in closed form, from many starts; solutions
 * and data as in the papers named. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"
#include <perp/perp.h>

#include "context.h"

enum { MOST = 10 };

/* Kojima & Shindo (1986), user = {c, r}: Josephy (1979) has 3 x3 for 10 x3, and another row 3. */
static int32_t kojima_shindo(double *F, const double *z, void *user)
{
    const double a = z[0], b = z[1], c = z[2], d = z[3];
    const double *form = user;

    F[0] = 3 * a * a + 2 * a * b + 2 * b * b + c + 3 * d - 6;
    F[1] = 2 * a * a + a + b * b + form[0] * c + 2 * d - 2;
    F[2] = 3 * a * a + a * b + 2 * b * b + 2 * c + form[1] * d - form[2];
    F[3] = a * a + 3 * b * b + 2 * c + 3 * d - 3;
    return 0;
}

static int32_t kojima_shindo_jacobian(double *J, const double *z, void *user)
{
    const double a = z[0], b = z[1];
    const double *form = user;
    const double rows[4][4] = {{6 * a + 2 * b, 2 * a + 4 * b, 1, 3},
                               {4 * a + 1, 2 * b, form[0], 2},
                               {6 * a + b, a + 4 * b, 2, form[1]},
                               {2 * a, 6 * b, 2, 3}};

    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            J[i + 4 * j] = rows[i][j];
    return 0;
}

/* Billups (1995), section 2.4: the merit function has a minimum near -0.005 that is no solution. */
static int32_t billups(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = (z[0] - 1) * (z[0] - 1) - 1.01;
    return 0;
}

static int32_t billups_jacobian(double *J, const double *z, void *user)
{
    (void)user;
    J[0] = 2 * (z[0] - 1);
    return 0;
}

/* Watson (1979), problem 4; degenerate in z_2. */
static int32_t watson(double *F, const double *z, void *user)
{
    double sum = 0;

    (void)user;
    for (int j = 0; j < 5; j++)
        sum += (z[j] - j + 1) * (z[j] - j + 1);
    for (int j = 0; j < 5; j++)
        F[j] = 2 * (z[j] - j + 1) * exp(sum);
    return 0;
}

static int32_t watson_jacobian(double *J, const double *z, void *user)
{
    double sum = 0;

    (void)user;
    for (int j = 0; j < 5; j++)
        sum += (z[j] - j + 1) * (z[j] - j + 1);
    for (int i = 0; i < 5; i++)
        for (int j = 0; j < 5; j++)
            J[i + 5 * j] = exp(sum) * ((i == j ? 2 : 0) + 4 * (z[i] - i + 1) * (z[j] - j + 1));
    return 0;
}

/* Mathiesen (1987) in the form of Pang & Gabriel: the solutions are (t, 0, 0, 0), 0 <= t <= 3. */
static int32_t mathiesen(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = -z[1] + z[2] + z[3];
    F[1] = z[0] - (4.5 * z[2] + 2.7 * z[3]) / (z[1] + 1);
    F[2] = 5 - z[0] - (0.5 * z[2] + 0.3 * z[3]) / (z[2] + 1);
    F[3] = 3 - z[0];
    return 0;
}

/* Murphy, Sherali & Soyster (1982): Nash-Cournot equilibrium of five firms; not defined at Q = 0.
 */
static int32_t nash(double *F, const double *z, void *user)
{
    static const double c[] = {10, 8, 6, 4, 2}, beta[] = {1.2, 1.1, 1, .9, .8};
    double total = 0;

    (void)user;
    for (int i = 0; i < 5; i++)
        total += z[i];
    for (int i = 0; i < 5; i++)
        F[i] = c[i] + pow(z[i] / 5, 1 / beta[i]) -
               pow(5000 / total, 1 / 1.1) * (1 - z[i] / (1.1 * total));
    return 0;
}

static double ks_form[] = {10, 9, 9}, josephy_form[] = {3, 3, 1};

typedef struct known {
    const char *name;
    int32_t n;
    perp_ncp_function function;
    perp_ncp_jacobian jacobian;
    void *user;
    double solutions[2][MOST]; /* the second may be missing: all 0 */
    double starts[6][MOST];
    int start_count;
} known;

static const known problems[] = {
    {"kojima-shindo",
     4,
     kojima_shindo,
     kojima_shindo_jacobian,
     ks_form,
     {{1.2247448713915890491, 0, 0, 0.5}, {1, 0, 3, 0}},
     {{0}, {1, 1, 1, 1}, {0, 1, 1, 0}, {1, 0, 0, 0}, {10, 10, 10, 10}, {100, 100, 100, 100}},
     6},
    {"kojima-shindo by differences",
     4,
     kojima_shindo,
     NULL,
     ks_form,
     {{1.2247448713915890491, 0, 0, 0.5}, {1, 0, 3, 0}},
     {{0}, {1, 1, 1, 1}, {0, 1, 1, 0}, {1, 0, 0, 0}, {10, 10, 10, 10}, {100, 100, 100, 100}},
     6},
    {"josephy",
     4,
     kojima_shindo,
     kojima_shindo_jacobian,
     josephy_form,
     {{1.2247448713915890491, 0, 0, 0.5}, {0}},
     {{0}, {1, 1, 1, 1}, {0, 1, 1, 0}, {1, 0, 0, 0}, {10, 10, 10, 10}, {100, 100, 100, 100}},
     6},
    {"billups",
     1,
     billups,
     billups_jacobian,
     NULL,
     {{2.0049875621120890270}, {0}},
     {{0}, {0.5}, {1}, {1.5}, {3}, {1000}},
     6},
    {"watson",
     5,
     watson,
     watson_jacobian,
     NULL,
     {{0, 0, 1, 2, 3}, {0}},
     {{0}, {1, 1, 1, 1, 1}, {0, 0, 1, 2, 3}, {2, 2, 2, 2, 2}, {3, 1, 0, 1, 3}, {1, 2, 3, 4, 5}},
     6},
    {"nash",
     5,
     nash,
     NULL,
     NULL,
     {{36.9325108157, 41.8181416604, 43.7065785223, 42.6592397433, 39.1789525166}, {0}},
     {{10, 10, 10, 10, 10},
      {1, 1, 1, 1, 1},
      {100, 100, 100, 100, 100},
      {0},
      {1, 0, 0, 0, 0},
      {1000, 1, 1000, 1, 1000}},
     6},
};

static double distance(const double *a, const double *b, int32_t n)
{
    double most = 0;

    for (int32_t i = 0; i < n; i++)
        most = fmax(most, fabs(a[i] - b[i]));
    return most;
}

/* max |mid(z, z - inf, w)| from a w of our own */
static double natural(const known *k, const double *z)
{
    double F[MOST], most = 0;

    assert_int_equal(k->function(F, z, k->user), 0);
    for (int32_t i = 0; i < k->n; i++)
        most = fmax(most, fabs(fmin(z[i], F[i])));
    return most;
}

static perp_ncp_problem problem_of(const known *k)
{
    perp_ncp_problem problem = fresh_ncp_problem();

    problem.n = k->n;
    problem.function = k->function;
    problem.jacobian = k->jacobian;
    problem.user = k->user;
    return problem;
}

/* Solutions are regular but for one degenerate index each: |z - z*| is of the size of the residual,
 * 1e-12, times a condition below 1e3; those of nash are known to 1e-10. */
static void test_known(void **state)
{
    (void)state;
    for (size_t p = 0; p < sizeof problems / sizeof *problems; p++)
        for (int s = 0; s < problems[p].start_count; s++) {
            const known *k = &problems[p];
            perp_ncp_problem problem = problem_of(k);
            perp_ncp_result result = fresh_ncp_result();
            double z[MOST], w[MOST], apart;

            assert_int_equal(perp_ncp_solve(context, z, w, &result, NULL, &problem, k->starts[s]),
                             PERP_OK);
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            assert_true(natural(k, z) <= 1e-12);
            assert_true(result.natural_residual <= 1e-12);
            apart = distance(z, k->solutions[0], k->n);
            if (k->solutions[1][0] > 0)
                apart = fmin(apart, distance(z, k->solutions[1], k->n));
            assert_true(apart <= 1e-9);
        }
}

static void test_line(void **state)
{
    const known line = {.name = "mathiesen", .n = 4, .function = mathiesen};
    const double starts[][4] = {{0}, {1, 1, 1, 1}, {10, 0, 0, 0}, {0.5, 2, 3, 4}};

    (void)state;
    for (size_t s = 0; s < sizeof starts / sizeof *starts; s++) {
        perp_ncp_problem problem = problem_of(&line);
        perp_ncp_result result = fresh_ncp_result();
        double z[4];

        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, NULL, &problem, starts[s]),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(natural(&line, z) <= 1e-12);
        assert_true(z[0] >= 0 && z[0] <= 3);
        assert_true(z[1] <= 1e-12 && z[2] <= 1e-12 && z[3] <= 1e-12);
    }
}

/* Far out F is e^330: no start may be so far off that its scales make a residual of 1e30 small. */
static void test_far_start(void **state)
{
    const known *k = &problems[4];
    const double starts[][5] = {{9, 9, 9, 9, 9}, {3, 14, 2, 6, 1}, {0, 0, 0, 0, 20}};

    (void)state;
    for (size_t s = 0; s < sizeof starts / sizeof *starts; s++)
        for (int method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++) {
            perp_ncp_problem problem = problem_of(k);
            perp_ncp_settings settings = fresh_ncp_settings();
            perp_ncp_result result = fresh_ncp_result();
            double z[5];

            settings.method = method;
            assert_int_equal(
                perp_ncp_solve(context, z, NULL, &result, &settings, &problem, starts[s]), PERP_OK);
            assert_true(natural(k, z) <= 1e-12 || result.outcome != PERP_OUTCOME_SOLVED);
        }
}

/* 'solved' is what tol says, wherever a run ends; without a limit it goes on to rounding. */
static void test_tolerance(void **state)
{
    const known *k = &problems[0];
    perp_ncp_problem problem = problem_of(k);
    int missed = 0;

    (void)state;
    for (int steps = 1; steps <= 8; steps++)
        for (int digits = 1; digits <= 13; digits++) {
            perp_ncp_settings settings = fresh_ncp_settings();
            perp_ncp_result result = fresh_ncp_result();
            double z[4];

            settings.method = PERP_NCP_FISCHER;
            settings.max_iterations = steps;
            settings.tol = pow(10, -digits);
            settings.polish = 0;
            assert_int_equal(
                perp_ncp_solve(context, z, NULL, &result, &settings, &problem, k->starts[1]),
                PERP_OK);
            assert_int_equal(result.outcome == PERP_OUTCOME_SOLVED,
                             result.residual <= settings.tol);
            if (result.outcome == PERP_OUTCOME_SOLVED)
                continue;
            missed++;
            assert_int_equal(result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
            settings.max_iterations = 0;
            settings.polish = 1;
            assert_int_equal(
                perp_ncp_solve(context, z, NULL, &result, &settings, &problem, k->starts[1]),
                PERP_OK);
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            assert_true(natural(k, z) <= 1e-12);
        }
    assert_true(missed > 20); /* or this test would test nothing */
}

/* One method alone, from where the merit function leads to its false minimum. */
static void test_trap(void **state)
{
    const known *k = &problems[3];
    perp_ncp_problem problem = problem_of(k);
    perp_ncp_settings settings = fresh_ncp_settings();
    perp_ncp_result result = fresh_ncp_result();
    double z[1];

    (void)state;
    settings.method = PERP_NCP_JOSEPHY;
    assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, NULL), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
    assert_int_equal(result.trapped, 1);
    assert_int_equal(result.restarts, 0);
    assert_true(result.residual > 1e-3);
}

/* z_0^2 + 1 = 0 and z_0 = 0: steps about z_0 = 0 go on to the limit, but at the best point every
 * direction is orthogonal to what is left. */
static int32_t hopeless(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = z[0] * z[0] + 1;
    F[1] = z[0];
    return 0;
}

static int32_t hopeless_jacobian(double *J, const double *z, void *user)
{
    (void)user;
    J[0] = 2 * z[0];
    J[1] = 1;
    J[2] = J[3] = 0;
    return 0;
}

/* A limit of iterations is no reason to go on where only another start can help; a solver that has
 * been in a trap does not say so of its next answer. */
static void test_trap_at_the_limit(void **state)
{
    static const double free_below[] = {-INFINITY, -INFINITY};
    const double start[] = {1, 1};
    const known hole = {.name = "hopeless", .n = 2, .function = hopeless};
    perp_ncp_problem problem = problem_of(&hole), solvable = problem_of(&problems[3]);
    perp_ncp_settings settings = fresh_ncp_settings();
    perp_ncp_solver *solver = NULL;
    perp_ncp_result result = fresh_ncp_result();
    double z[2];

    (void)state;
    problem.jacobian = hopeless_jacobian;
    problem.lower = free_below;
    settings.restarts = settings.scaling = 0; /* in units in which the columns stay different */
    settings.polish = 0;
    assert_int_equal(perp_ncp_solver_create(context, &solver, &settings), PERP_OK);
    assert_int_equal(perp_ncp_solver_setup(solver, &problem), PERP_OK);
    assert_int_equal(perp_ncp_solver_solve(solver, z, NULL, &result, start), PERP_OK);
    assert_int_equal(result.method, PERP_NCP_FISCHER);
    assert_true(result.iterations > 30); /* it ended where it gained nothing */
    assert_int_equal(result.trapped, 1);
    assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
    settings.max_iterations = 5; /* a budget that is spent asks no further questions */
    assert_int_equal(perp_ncp_solver_set(solver, &settings), PERP_OK);
    assert_int_equal(perp_ncp_solver_solve(solver, z, NULL, &result, start), PERP_OK);
    assert_int_equal(result.iterations, 5);
    assert_int_equal(result.trapped, 0);
    assert_int_equal(result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
    settings.max_iterations = 0;
    settings.restarts = 20;
    assert_int_equal(perp_ncp_solver_set(solver, &settings), PERP_OK);
    assert_int_equal(perp_ncp_solver_setup(solver, &solvable), PERP_OK);
    assert_int_equal(perp_ncp_solver_solve(solver, z, NULL, &result, NULL), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(result.trapped, 0);
    perp_ncp_solver_destroy(solver);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known),     cmocka_unit_test(test_line),
        cmocka_unit_test(test_far_start), cmocka_unit_test(test_tolerance),
        cmocka_unit_test(test_trap),      cmocka_unit_test(test_trap_at_the_limit)};

    return cmocka_run_group_tests(tests, make, destroy);
}
