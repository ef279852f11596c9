/* Finite differences: how many calls they take, how good they are, and the check of a Jacobian
 * callback that is built on them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"
#include <perp/perp.h>

#include "context.h"
#include "gen.h"

enum { N = 200 };

/* -u'' = lambda exp(u) on (0, 1), u(0) = u(1) = 0, by central differences (Bratu). */
typedef struct bratu {
    double lambda;
    int calls, jacobians;
    int wrong_entry; /* the entry of the pattern that the Jacobian gets wrong; -1: none */
} bratu;

static int32_t bratu_function(double *F, const double *z, void *user)
{
    bratu *b = user;
    const double h = 1.0 / (N + 1);

    b->calls++;
    for (int i = 0; i < N; i++)
        F[i] = (2 * z[i] - (i > 0 ? z[i - 1] : 0) - (i + 1 < N ? z[i + 1] : 0)) / (h * h) -
               b->lambda * exp(z[i]);
    return 0;
}

static int32_t bratu_jacobian(double *values, const double *z, void *user)
{
    bratu *b = user;
    const double h = 1.0 / (N + 1);
    int k = 0;

    b->jacobians++;
    for (int j = 0; j < N; j++) {
        if (j > 0)
            values[k++] = -1 / (h * h);
        values[k++] = 2 / (h * h) - b->lambda * exp(z[j]);
        if (j + 1 < N)
            values[k++] = -1 / (h * h);
    }
    if (b->wrong_entry >= 0)
        values[b->wrong_entry] *= 1.001;
    return 0;
}

static perp_ncp_problem bratu_problem(bratu *b, int32_t *starts, int32_t *rows)
{
    perp_ncp_problem problem = fresh_ncp_problem();
    int32_t k = 0;

    for (int32_t j = 0; j < N; j++) {
        starts[j] = k;
        for (int32_t i = j > 0 ? j - 1 : 0; i <= j + 1 && i < N; i++)
            rows[k++] = i;
    }
    starts[N] = k;
    problem.n = N;
    problem.storage = PERP_STORAGE_CSC;
    problem.column_starts = starts;
    problem.row_indices = rows;
    problem.function = bratu_function;
    problem.user = b;
    return problem;
}

/* A tridiagonal pattern has three colours. The middle of the solution is known in closed form;
 * central differences are off by h^2 u''''/12 (times the inverse, 1/8): below 1e-4 here. */
static void test_colours(void **state)
{
    static const double middle[] = {0.1405392144004718, 0.32895242134111357, 0.64014669604146405};
    int32_t starts[N + 1], rows[3 * N];
    double free_low[N], z[N], z_jacobian[N];

    (void)state;
    for (int i = 0; i < N; i++)
        free_low[i] = -INFINITY;
    for (int k = 0; k < 3; k++) {
        bratu b = {k + 1.0, 0, 0, -1};
        perp_ncp_problem problem = bratu_problem(&b, starts, rows);
        perp_ncp_result result = fresh_ncp_result();
        double apart = 0;

        problem.lower = free_low;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, NULL, &problem, NULL), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(fabs(0.5 * (z[N / 2 - 1] + z[N / 2]) - middle[k]) < 1e-4);
        assert_int_equal(result.function_evaluations, b.calls);
        /* three a Jacobian, six where both sides are asked, and one or two a step */
        assert_true(b.calls <= 8 * result.jacobian_evaluations + 8);
        problem.jacobian = bratu_jacobian;
        assert_int_equal(perp_ncp_solve(context, z_jacobian, NULL, &result, NULL, &problem, NULL),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(result.jacobian_evaluations, b.jacobians);
        for (int i = 0; i < N; i++)
            apart = fmax(apart, fabs(z[i] - z_jacobian[i]));
        /* entries of 4/h^2 = 160000: F is rounded to 1e-11, the inverse is below 1 */
        assert_true(apart <= 1e-10);
    }
}

static perp_ncp_check check_of(const perp_ncp_problem *problem, const double *z)
{
    perp_ncp_check check = fresh_ncp_check();

    assert_int_equal(perp_ncp_check_jacobian(context, &check, problem, z), PERP_OK);
    return check;
}

static void test_check_names_the_entry(void **state)
{
    int32_t starts[N + 1], rows[3 * N];
    bratu b = {2.0, 0, 0, -1};
    perp_ncp_problem problem = bratu_problem(&b, starts, rows);
    perp_ncp_check check;
    double z[N];

    (void)state;
    problem.jacobian = bratu_jacobian;
    for (int i = 0; i < N; i++)
        z[i] = 0.3 + 0.001 * i;
    check = check_of(&problem, z);
    assert_int_equal(check.wrong, 0);
    assert_int_equal(check.missing, 0);
    assert_int_equal(check.unchecked, 0);
    assert_int_equal(check.missing_row, -1);
    for (int32_t j = 1; j < N - 1; j += 37) {
        b.wrong_entry = starts[j] + j % 3;
        check = check_of(&problem, z);
        assert_int_equal(check.wrong, 1);
        assert_int_equal(check.column, j);
        assert_int_equal(check.row, j - 1 + j % 3);
        /* 1.001 times what it should be, and the difference is good to 1e-9 */
        assert_true(fabs(check.given / check.difference - 1.001) < 1e-8);
        assert_true(check.uncertainty < 1e-6 * fabs(check.given));
    }
}

static void test_check_finds_what_the_pattern_lacks(void **state)
{
    int32_t starts[N + 1], rows[3 * N];
    bratu b = {2.0, 0, 0, -1};
    perp_ncp_problem problem = bratu_problem(&b, starts, rows);
    perp_ncp_check check;
    double z[N];

    (void)state;
    problem.jacobian = bratu_jacobian;
    for (int i = 0; i < N; i++)
        z[i] = 0.3;
    rows[starts[7] + 2] = 100; /* was (8, 7) */
    check = check_of(&problem, z);
    assert_int_equal(check.missing, 1);
    assert_int_equal(check.missing_row, 8);
    assert_int_equal(check.missing_column, 7);
    assert_true(fabs(check.missing_difference + (N + 1.0) * (N + 1.0)) < 1e-3);
    assert_int_equal(check.wrong, 1); /* (100, 7) is given, and should be 0 */
    assert_int_equal(check.row, 100);
    assert_int_equal(check.column, 7);
}

/* log and root at the edge of their domain, and a fixed variable. */
static int32_t edge_function(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = log(z[0]) + z[2];
    F[1] = sqrt(z[1] - 1) + z[0];
    F[2] = z[0] * z[2];
    return 0;
}

static int32_t edge_jacobian(double *J, const double *z, void *user)
{
    const double rows[9] = {1 / z[0], 0, 1, 1, 0.5 / sqrt(z[1] - 1), 0, z[2], 0, z[0]};

    (void)user;
    memcpy(J, rows, sizeof rows);
    return 0;
}

static void test_check_at_the_edge(void **state)
{
    const double lower[] = {0, 0, 2}, upper[] = {10, 10, 2}, z[] = {1e-9, 1 + 1e-7, 2};
    const double outside[] = {-1, 2, 2}, undefined[] = {1, 0.5, 2};
    perp_ncp_problem problem = fresh_ncp_problem();
    perp_ncp_check check, before;

    (void)state;
    problem.n = 3;
    problem.storage = PERP_STORAGE_ROW_MAJOR;
    problem.function = edge_function;
    problem.jacobian = edge_jacobian;
    problem.lower = lower;
    problem.upper = upper;
    check = check_of(&problem, z);
    assert_int_equal(check.wrong, 0);
    assert_int_equal(check.unchecked, 1);
    memset(&check, 0x5a, sizeof check);
    check.struct_size = sizeof check;
    before = check;
    assert_int_equal(perp_ncp_check_jacobian(context, &check, &problem, outside),
                     PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "z[0]"));
    assert_int_equal(perp_ncp_check_jacobian(context, &check, &problem, undefined),
                     PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "function"));
    assert_int_equal(perp_ncp_check_jacobian(context, &check, &problem, NULL), PERP_ERROR_ARGUMENT);
    problem.jacobian = NULL;
    assert_int_equal(perp_ncp_check_jacobian(context, &check, &problem, z), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "jacobian"));
    assert_memory_equal(&check, &before, sizeof check);
    assert_int_equal(perp_ncp_check_jacobian(context, NULL, &problem, z), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_ncp_check_jacobian(NULL, &check, &problem, z), PERP_ERROR_HANDLE);
}

/* G(x) = A x + d arctan x + q in units of its own for each variable and row: F(z) = D G(z / E). */
enum { UNITS_MOST = 12 };

typedef struct units {
    int32_t n;
    double A[UNITS_MOST][UNITS_MOST], q[UNITS_MOST], d[UNITS_MOST], D[UNITS_MOST], E[UNITS_MOST];
} units;

static void units_make(units *u, uint64_t seed)
{
    double B[UNITS_MOST][UNITS_MOST];
    gen_random random;

    gen_seed(&random, seed);
    u->n = 1 + (int32_t)(seed % UNITS_MOST);
    for (int32_t i = 0; i < u->n; i++) {
        u->q[i] = gen_uniform(&random, -5.0, 5.0);
        u->d[i] = gen_uniform(&random, 0.0, 10.0);
        u->D[i] = exp2(floor(gen_uniform(&random, -27.0, 28.0))); /* 1e-8 to 1e8 */
        u->E[i] = exp2(floor(gen_uniform(&random, -27.0, 28.0)));
        for (int32_t j = 0; j < u->n; j++)
            B[i][j] = gen_uniform(&random, -1.7, 1.7);
    }
    for (int32_t i = 0; i < u->n; i++) /* B B'/n + 0.1 I: one solution */
        for (int32_t j = 0; j < u->n; j++) {
            u->A[i][j] = i == j ? 0.1 : 0.0;
            for (int32_t k = 0; k < u->n; k++)
                u->A[i][j] += B[i][k] * B[j][k] / u->n;
        }
}

static int32_t units_function(double *F, const double *z, void *user)
{
    const units *u = user;

    for (int32_t i = 0; i < u->n; i++) {
        F[i] = u->d[i] * atan(z[i] / u->E[i]) + u->q[i];
        for (int32_t j = 0; j < u->n; j++)
            F[i] += u->A[i][j] * (z[j] / u->E[j]);
        F[i] *= u->D[i];
    }
    return 0;
}

/* From z = 0 nothing but F tells how large variables are: steps of 2^-26 move it by less than its
 * rounding where they are large, and columns of zeros lead nowhere. */
static void test_unknown_sizes(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 60; seed++) {
        perp_ncp_problem problem = fresh_ncp_problem();
        perp_ncp_result result = fresh_ncp_result();
        double z[UNITS_MOST], F[UNITS_MOST];
        units u;

        units_make(&u, seed);
        problem.n = u.n;
        problem.function = units_function;
        problem.user = &u;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, NULL, &problem, NULL), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        units_function(F, z, &u);
        for (int32_t i = 0; i < u.n; i++) /* tol of 1e-10 or so of numbers up to 100 */
            assert_true(fabs(fmin(z[i] / u.E[i], F[i] / u.D[i])) <= 1e-8);
    }
}

/* z + z^3 = 10: the points of Newton's method. */
typedef struct cubic {
    double at[20];
    int32_t count;
} cubic;

static int32_t cubic_function(double *F, const double *z, void *user)
{
    (void)user;
    F[0] = z[0] + z[0] * z[0] * z[0] - 10.0;
    return 0;
}

static int32_t cubic_jacobian(double *values, const double *z, void *user)
{
    cubic *c = user;

    assert_in_range(c->count, 0, 19);
    c->at[c->count++] = z[0];
    values[0] = 1.0 + 3.0 * z[0] * z[0];
    return 0;
}

/* A free variable comes down a convex F by Newton's whole steps, each with the slope of its own
 * point: its active set does not change. */
static void test_free_variables_take_newtons_steps(void **state)
{
    static const double lower[] = {-INFINITY}, start[] = {20.0};
    perp_ncp_problem problem = fresh_ncp_problem();
    perp_ncp_settings settings = fresh_ncp_settings();
    perp_ncp_result result = fresh_ncp_result();
    double z[1], expected = start[0];
    cubic c = {{0}, 0};

    (void)state;
    problem.n = 1;
    problem.function = cubic_function;
    problem.jacobian = cubic_jacobian;
    problem.lower = lower;
    problem.user = &c;
    settings.method = PERP_NCP_FISCHER;
    settings.polish = 0;
    assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, start),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(c.count > 6);
    for (int32_t k = 0; k < c.count; k++) { /* units and sums round by some 1e-16 a step */
        assert_true(fabs(c.at[k] - expected) <= 1e-13 * expected);
        expected -=
            (expected + expected * expected * expected - 10.0) / (1.0 + 3.0 * expected * expected);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_variables_take_newtons_steps),
        cmocka_unit_test(test_colours),
        cmocka_unit_test(test_unknown_sizes),
        cmocka_unit_test(test_check_names_the_entry),
        cmocka_unit_test(test_check_finds_what_the_pattern_lacks),
        cmocka_unit_test(test_check_at_the_edge),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
