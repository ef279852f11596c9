/* Handles: NULL, destroyed, without a problem; structs of other releases; outputs not asked for. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

/* Memory that was released stays readable, so that what a destroyed handle does is defined. */
enum { KEPT = 1000 };

static void *kept[KEPT];
static int kept_count;

static void *keep_allocate(size_t size, void *user)
{
    (void)user;
    return malloc(size);
}

static void keep_release(void *pointer, void *user)
{
    (void)user;
    assert_true(kept_count < KEPT);
    kept[kept_count++] = pointer;
}

static perp_context *context;

static int make(void **state)
{
    perp_context_settings settings = fresh_context_settings();

    (void)state;
    settings.allocate = keep_allocate;
    settings.release = keep_release;
    return perp_context_create(&context, &settings);
}

static int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    while (kept_count > 0)
        free(kept[--kept_count]);
    return 0;
}

static const double values[4] = {2, 1, 1, 2}, q[2] = {-3, -3}; /* z = (1, 1) */

static perp_matrix matrix(void)
{
    perp_matrix M = matrix_rows(values, 2, 2);

    return M;
}

static void refuse_all(perp_lcp_solver *solver)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    perp_matrix M = matrix();
    perp_lcp_result result = fresh_lcp_result();
    double z[2] = {5, 5};

    assert_int_equal(perp_lcp_solver_set(solver, &settings), PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_solver_setup(solver, &M, NULL, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, q, NULL),
                     PERP_ERROR_HANDLE);
    assert_true(z[0] == 5 && z[1] == 5);
    perp_lcp_solver_destroy(solver);
}

static void test_null_and_destroyed_solvers(void **state)
{
    double memory[4096 / sizeof(double)] = {0};
    perp_lcp_solver *solver;

    (void)state;
    refuse_all(NULL);
    refuse_all((perp_lcp_solver *)(void *)memory);
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    perp_lcp_solver_destroy(solver);
    refuse_all(solver);
}

static void test_null_and_destroyed_contexts(void **state)
{
    perp_context_settings settings = fresh_context_settings();
    perp_context *short_lived;
    perp_matrix M = matrix();
    perp_lcp_result result = fresh_lcp_result();
    double z[2];

    (void)state;
    assert_int_equal(perp_lcp_solve(NULL, z, NULL, NULL, &result, NULL, LCP(&M, q), NULL),
                     PERP_ERROR_HANDLE);
    settings.allocate = keep_allocate;
    settings.release = keep_release;
    assert_int_equal(perp_context_create(&short_lived, &settings), PERP_OK);
    perp_context_destroy(short_lived);
    assert_int_equal(perp_lcp_solve(short_lived, z, NULL, NULL, &result, NULL, LCP(&M, q), NULL),
                     PERP_ERROR_HANDLE);
    assert_string_equal(perp_context_message(short_lived), "");
    perp_context_destroy(short_lived);
}

/* base.h: solvers stay usable after their context is destroyed. */
static void test_a_solver_outlives_its_context(void **state)
{
    perp_context_settings settings = fresh_context_settings();
    perp_context *short_lived;
    perp_lcp_solver *solver;
    perp_matrix M = matrix();
    perp_lcp_result result = fresh_lcp_result();
    double z[2];

    (void)state;
    settings.allocate = keep_allocate;
    settings.release = keep_release;
    assert_int_equal(perp_context_create(&short_lived, &settings), PERP_OK);
    assert_int_equal(perp_lcp_solver_create(short_lived, &solver, NULL), PERP_OK);
    perp_context_destroy(short_lived);
    assert_int_equal(perp_lcp_solver_setup(solver, &M, NULL, NULL), PERP_OK);
    assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, q, NULL), PERP_OK);
    assert_true(z[0] == 1 && z[1] == 1);
    perp_lcp_solver_destroy(solver);
}

static void test_solving_before_a_problem(void **state)
{
    perp_lcp_solver *solver;
    perp_lcp_result result = fresh_lcp_result();
    double z[2] = {5, 5};

    (void)state;
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(perp_lcp_solver_solve(solver, z, NULL, NULL, &result, q, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "setup"));
    assert_true(z[0] == 5 && z[1] == 5);
    perp_lcp_solver_destroy(solver);
}

/* A caller of a later release: larger structs, zero where this library knows nothing. */
static void test_structs_of_a_later_release(void **state)
{
    union {
        perp_lcp_settings s;
        unsigned char bytes[sizeof(perp_lcp_settings) + 40];
    } settings;
    union {
        perp_lcp_result r;
        unsigned char bytes[sizeof(perp_lcp_result) + 40];
    } result;
    union {
        perp_matrix m;
        unsigned char bytes[sizeof(perp_matrix) + 40];
    } M;
    double z[2];
    size_t i;

    (void)state;
    assert_int_equal(perp_lcp_settings_init(&settings.s, sizeof settings), PERP_OK);
    assert_int_equal(perp_struct_init(&result.r, sizeof result), PERP_OK);
    assert_int_equal(perp_struct_init(&M.m, sizeof M), PERP_OK);
    assert_int_equal(perp_matrix_dense(&M.m, PERP_STORAGE_ROW_MAJOR, 2, 2, values, 2), PERP_OK);
    assert_int_equal(
        perp_lcp_solve(context, z, NULL, NULL, &result.r, &settings.s, LCP(&M.m, q), NULL),
        PERP_OK);
    assert_true(z[0] == 1 && z[1] == 1);
    assert_int_equal(result.r.struct_size, sizeof result);
    assert_int_equal(result.r.outcome, PERP_OUTCOME_SOLVED);
    for (i = sizeof(perp_lcp_result); i < sizeof result; i++)
        assert_int_equal(result.bytes[i], 0);
}

/* w and ray may be NULL; what else is returned does not change. */
static void test_outputs_not_asked_for(void **state)
{
    static const double walls[4] = {1, -1, -1, 1}, pushed[2] = {-1, -1};
    perp_matrix M = matrix();
    perp_lcp_result result = fresh_lcp_result();
    double z[2], w[2], ray[2] = {7, 7};

    (void)state;
    assert_int_equal(perp_lcp_solve(context, z, w, ray, &result, NULL, LCP(&M, q), NULL), PERP_OK);
    assert_true(w[0] == 0 && w[1] == 0);
    assert_true(ray[0] == 7 && ray[1] == 7); /* written only with has_ray */
    assert_int_equal(result.has_ray, 0);
    M.values = walls;
    assert_int_equal(perp_lcp_solve(context, z, NULL, NULL, &result, NULL, LCP(&M, pushed), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_RAY);
    assert_int_equal(result.has_ray, 1);
    assert_int_equal(result.certificate, PERP_CERTIFICATE_INFEASIBLE);
    assert_int_equal(perp_lcp_solve(context, z, NULL, ray, &result, NULL, LCP(&M, pushed), NULL),
                     PERP_OK);
    assert_true(ray[0] == 1 && ray[1] == 1);
}

static void test_default_settings(void **state)
{
    perp_lcp_settings s = run_settings(PERP_LCP_AUTO);

    (void)state;
    assert_int_equal(s.method, 0);
    assert_int_equal(s.max_iterations, 0);
    assert_true(s.tol == 1e-10 && s.time_limit == 0 && s.relaxation == 1);
    assert_int_equal(s.pivot_rule, PERP_PIVOT_HARRIS);
    assert_int_equal(s.scaling, 1);
    assert_int_equal(s.polish, 1);
    assert_null(s.monitor);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_null_and_destroyed_solvers),
        cmocka_unit_test(test_null_and_destroyed_contexts),
        cmocka_unit_test(test_a_solver_outlives_its_context),
        cmocka_unit_test(test_solving_before_a_problem),
        cmocka_unit_test(test_structs_of_a_later_release),
        cmocka_unit_test(test_outputs_not_asked_for),
        cmocka_unit_test(test_default_settings),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
