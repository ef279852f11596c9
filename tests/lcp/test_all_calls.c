/* perp_lcp_all: bounds, limits, callbacks, refusals, memory. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "memory.h"
#include "run.h"

#include "context.h"

static perp_lcp_enumeration fresh(void)
{
    perp_lcp_enumeration result = fresh_lcp_enumeration();

    result.nodes = 77;
    return result;
}

/* M = -I, q = e, n = 8: 256 isolated solutions. */
static void make_signs(gen_lcp *problem)
{
    int M[64], q[8], i;

    for (i = 0; i < 64; i++)
        M[i] = i % 9 == 0 ? -1 : 0;
    for (i = 0; i < 8; i++)
        q[i] = 1;
    gen_from_integers(problem, 8, M, q);
}

typedef struct visits {
    int32_t count, families;
    int32_t answer_at, answer; /* what to return at which visit */
    int32_t rays, vertices;
} visits;

static int32_t visit(const perp_lcp_found *found, void *user)
{
    visits *v = user;

    v->count++;
    v->families += found->dimension > 0;
    v->rays += found->ray_count;
    v->vertices += found->vertex_count;
    return v->count == v->answer_at ? v->answer : 0;
}

static perp_status enumerate(const gen_lcp *problem, perp_lcp_enumeration *result,
                             const perp_lcp_settings *settings, visits *v)
{
    return perp_lcp_all(context, result, settings,
                        LCP(&problem->view, problem->q, problem->lower, problem->upper),
                        v ? visit : NULL, v);
}

/* ---- bounds -------------------------------------------------------------------------------- */

/* w = -z between -1 and 1: both ends, and the middle. */
static void test_box(void **state)
{
    static const int M[] = {-1}, q[] = {0};
    double lower = -1.0, upper = 1.0;
    perp_lcp_enumeration result = fresh();
    gen_lcp problem;
    visits v = {0};

    (void)state;
    gen_from_integers(&problem, 1, M, q);
    assert_int_equal(perp_lcp_all(context, &result, NULL,
                                  LCP(&problem.view, problem.q, &lower, &upper), visit, &v),
                     PERP_OK);
    assert_int_equal(result.isolated, 3);
    lower = upper = 0.5; /* fixed: w is free */
    assert_int_equal(perp_lcp_all(context, &result, NULL,
                                  LCP(&problem.view, problem.q, &lower, &upper), visit, &v),
                     PERP_OK);
    assert_int_equal(result.isolated, 1);
    gen_destroy(&problem);
}

/* w = 0 whatever z is: a box, a strip, the plane. */
static void test_families(void **state)
{
    static const int M[] = {0, 0, 0, 0}, q[] = {0, 0};
    static const struct {
        double lower[2], upper[2];
        int vertices, rays;
    } cases[] = {
        {{0, 0}, {1, 2}, 4, 0},
        {{0, -INFINITY}, {1, INFINITY}, 2, 2},
        {{-INFINITY, -INFINITY}, {INFINITY, INFINITY}, 1, 4},
        {{-INFINITY, 0}, {0, INFINITY}, 1, 2},
    };
    size_t k;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        perp_lcp_enumeration result = fresh();
        gen_lcp problem;
        visits v = {0};

        gen_from_integers(&problem, 2, M, q);
        assert_int_equal(perp_lcp_all(context, &result, NULL,
                                      LCP(&problem.view, problem.q, cases[k].lower, cases[k].upper),
                                      visit, &v),
                         PERP_OK);
        assert_int_equal(v.count, 1);
        assert_int_equal(v.families, 1);
        assert_int_equal(v.vertices, cases[k].vertices);
        assert_int_equal(v.rays, cases[k].rays);
        gen_destroy(&problem);
    }
}

/* w1 = 0 and w2 = z1 - 1/2 on the unit square: three edges, z2 = 1 up to z1 = 1/2, down along z1 =
 * 1/2, and z2 = 0 from there. */
static void test_staircase(void **state)
{
    static const int M[] = {0, 0, 1, 0}, q[] = {0, 0};
    static const double lower[2] = {0, 0}, upper[2] = {1, 1};
    perp_lcp_enumeration result = fresh();
    gen_lcp problem;
    visits v = {0};

    (void)state;
    gen_from_integers(&problem, 2, M, q);
    problem.q[1] = -0.5;
    assert_int_equal(perp_lcp_all(context, &result, NULL,
                                  LCP(&problem.view, problem.q, lower, upper), visit, &v),
                     PERP_OK);
    assert_int_equal(result.isolated, 0);
    assert_int_equal(result.families, 3);
    assert_int_equal(v.vertices, 6);
    gen_destroy(&problem);
}

/* Scaling rows and columns by powers of two scales the solutions and nothing else. */
static int32_t sum_z(const perp_lcp_found *found, void *user)
{
    double *sums = user;

    sums[0] += found->z[0];
    sums[1] += found->z[1];
    return 0;
}

static void test_scaling(void **state)
{
    double M[] = {1, 2, 2, 1}, q[] = {-1, -1}, plain[2] = {0, 0}, scaled[2] = {0, 0};
    perp_lcp_enumeration result = fresh();
    perp_matrix view = fresh_matrix();

    (void)state;
    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, 2, 2, M, 2), PERP_OK);
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, q), sum_z, plain), PERP_OK);
    M[0] = 0x1p400;
    M[1] = M[2] = 0x1p51;
    M[3] = 0x1p-300;
    q[0] = -0x1p200;
    q[1] = -0x1p-150;
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, q), sum_z, scaled), PERP_OK);
    assert_int_equal(result.isolated, 3);
    assert_true(scaled[0] == plain[0] * 0x1p-200 && scaled[1] == plain[1] * 0x1p150);
}

static void test_overflow(void **state)
{
    const double M[] = {1e-300, 1e300, 1e300, 1e-300}, q[] = {-1, -1};
    perp_lcp_enumeration result = fresh();
    double sum[2] = {0.0, 0.0};
    perp_matrix view = fresh_matrix();

    (void)state;
    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, 2, 2, M, 2), PERP_OK);
    /* (1e-300, 1e-300) solves it; so do (1e300, 0) and (0, 1e300), but w = 1e600 is no double: the
     * list is not all there is, and says so */
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, q), sum_z, sum), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
    assert_int_equal(result.isolated, 1);
    assert_int_equal(result.families, 0);
}

/* ---- limits and callbacks ------------------------------------------------------------------ */

static int32_t answer_monitor(const perp_lcp_progress *progress, void *user)
{
    assert_true(progress->iterations >= 1);
    return *(const int32_t *)user;
}

static void test_limits(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    perp_lcp_enumeration result = fresh();
    gen_lcp problem;
    visits v = {0};
    int32_t answer = 1;

    (void)state;
    make_signs(&problem);
    assert_int_equal(enumerate(&problem, &result, NULL, &v), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(v.count, 256);
    assert_int_equal(enumerate(&problem, &result, NULL, NULL), PERP_OK); /* counts alone */
    assert_int_equal(result.isolated, 256);
    settings.max_iterations = 100;
    v.count = 0;
    assert_int_equal(enumerate(&problem, &result, &settings, &v), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
    assert_int_equal(result.nodes, 100);
    assert_true(v.count > 0 && v.count < 100);
    settings.max_iterations = 0;
    settings.time_limit = 1e-9;
    assert_int_equal(enumerate(&problem, &result, &settings, &v), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_TIME_LIMIT);
    settings.time_limit = 0.0;
    settings.monitor = answer_monitor;
    settings.monitor_user = &answer;
    assert_int_equal(enumerate(&problem, &result, &settings, &v), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_STOPPED);
    answer = -1;
    result.nodes = 77;
    assert_int_equal(enumerate(&problem, &result, &settings, &v), PERP_ERROR_CALLBACK);
    assert_int_equal(result.nodes, 77);
    gen_destroy(&problem);
}

static void test_visitor(void **state)
{
    static const int ones[] = {1, 1, 1, 1}, minus[] = {-1, -1};
    perp_lcp_enumeration result = fresh();
    gen_lcp problem;
    visits v = {0};

    (void)state;
    make_signs(&problem);
    v.answer_at = 10;
    v.answer = 1;
    assert_int_equal(enumerate(&problem, &result, NULL, &v), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_STOPPED);
    assert_int_equal(v.count, 10); /* and no more */
    v.count = 0;
    v.answer = -1;
    result.nodes = 77;
    assert_int_equal(enumerate(&problem, &result, NULL, &v), PERP_ERROR_CALLBACK);
    assert_int_equal(v.count, 10);
    assert_int_equal(result.nodes, 77);
    gen_destroy(&problem);
    gen_from_integers(&problem, 2, ones, minus); /* a family, reported at the end */
    v.count = 0;
    v.answer_at = 1;
    assert_int_equal(enumerate(&problem, &result, NULL, &v), PERP_ERROR_CALLBACK);
    gen_destroy(&problem);
}

static int32_t call_again(const perp_lcp_found *found, void *user)
{
    perp_lcp_enumeration result = fresh();

    assert_int_equal(found->dimension, 0);
    assert_int_equal(enumerate(user, &result, NULL, NULL), PERP_ERROR_BUSY);
    return 0;
}

static void test_reentry(void **state)
{
    perp_lcp_enumeration result = fresh();
    gen_lcp problem;

    (void)state;
    make_signs(&problem);
    assert_int_equal(
        perp_lcp_all(context, &result, NULL, LCP(&problem.view, problem.q), call_again, &problem),
        PERP_OK);
    gen_destroy(&problem);
}

/* ---- refusals and memory ------------------------------------------------------------------- */

static void test_refusals(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    perp_lcp_enumeration result = fresh();
    double M[61 * 61] = {0}, q[61] = {0}, bad[2] = {0, NAN}, low[2] = {0, 2}, high[2] = {1, 1};
    perp_matrix view = fresh_matrix();

    (void)state;
    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, 2, 2, M, 2), PERP_OK);
    assert_int_equal(perp_lcp_all(NULL, &result, NULL, LCP(&view, q), NULL, NULL),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_all(context, NULL, NULL, LCP(&view, q), NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(NULL, q), NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view), NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, bad), NULL, NULL),
                     PERP_ERROR_NOT_FINITE);
    assert_non_null(strstr(perp_context_message(context), "q[1]"));
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, q, low, high), NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "lower[1]"));
    settings.tol = -1.0;
    assert_int_equal(perp_lcp_all(context, &result, &settings, LCP(&view, q), NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, 61, 61, M, 61), PERP_OK);
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, q), NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "61 rows"));
    M[0] = INFINITY;
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, q), NULL, NULL),
                     PERP_ERROR_NOT_FINITE);
    assert_int_equal(result.nodes, 77);
    result.struct_size = 4;
    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, 2, 2, q, 2), PERP_OK);
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, q), NULL, NULL),
                     PERP_ERROR_ABI);
}

/* A family, a degenerate point and isolated solutions, every allocation failing in turn. */
static void test_memory(void **state)
{
    static const int M[] = {1, 1, 0, 0, 1, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 2};
    static const int q[] = {-1, -1, 1, 0};
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    perp_status status = PERP_ERROR_MEMORY;
    perp_context *limited;
    gen_lcp problem;

    (void)state;
    gen_from_integers(&problem, 4, M, q);
    assert_int_equal(perp_context_create(&limited, &settings), PERP_OK);
    for (m.fails_at = 1; status != PERP_OK; m.fails_at++) {
        perp_lcp_enumeration result = fresh();
        visits v = {0};

        m.calls = 0;
        status = perp_lcp_all(limited, &result, NULL, LCP(&problem.view, problem.q), visit, &v);
        assert_int_equal(m.live, 1); /* the context */
        if (status != PERP_OK) {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_int_equal(result.nodes, 77);
        } else {
            assert_int_equal(v.families, 2); /* z3 = 0 or 1 */
        }
    }
    assert_true(m.fails_at > 10);
    gen_destroy(&problem);
    perp_context_destroy(limited);
    assert_int_equal(m.live, 0);
}

/* 1e-300 z = 1e10 has the solution 1e310, which no double is: none is reported, and nobody says
 * that there is none. */
static void test_a_solution_out_of_range(void **state)
{
    const double M = 1e-300, q = -1e10;
    perp_lcp_enumeration result = fresh();
    visits v = {0, 0, 0, 0, 0, 0};
    perp_matrix view = matrix_rows(&M, 1, 1);

    (void)state;
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, &q), visit, &v), PERP_OK);
    assert_int_equal(v.count, 0);
    assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
}

/* Whatever the numbers, what is reported is finite. */
static int32_t visit_finite(const perp_lcp_found *found, void *user)
{
    const int32_t n = *(const int32_t *)user;
    int32_t i;

    assert_true(found->residual < INFINITY);
    for (i = 0; i < n; i++)
        assert_true(isfinite(found->z[i]) && isfinite(found->w[i]));
    for (i = 0; i < n * found->vertex_count; i++)
        assert_true(isfinite(found->vertices[i]));
    for (i = 0; i < n * found->ray_count; i++)
        assert_true(isfinite(found->rays[i]));
    return 0;
}

static void test_reports_are_finite(void **state)
{
    static const double sizes[] = {0.0, 0.0, 0.0, 1e-310, 1e-300, 1e-150, 1e-12,
                                   1.0, 1.0, 3.0, 1e12,   1e150,  1e300,  1.7976931348623157e308};
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 91);
    for (round = 0; round < 4000; round++) {
        int32_t n = 1 + gen_integer(&random, 4), i;
        double M[16], q[4], l[4], u[4];
        perp_lcp_enumeration result = fresh();
        perp_matrix view;

        for (i = 0; i < n * n; i++)
            M[i] = sizes[gen_integer(&random, 14)] * (gen_integer(&random, 2) ? 1.0 : -1.0);
        for (i = 0; i < n; i++) {
            q[i] = sizes[gen_integer(&random, 14)] * (gen_integer(&random, 2) ? 1.0 : -1.0);
            l[i] = gen_integer(&random, 4) ? 0.0 : -sizes[gen_integer(&random, 14)];
            u[i] = gen_integer(&random, 4) ? INFINITY : sizes[gen_integer(&random, 14)];
        }
        view = matrix_rows(M, n, n);
        assert_int_equal(
            perp_lcp_all(context, &result, NULL, LCP(&view, q, l, u), visit_finite, &n), PERP_OK);
    }
}

static int32_t require_vertex(const perp_lcp_found *found, void *user)
{
    int32_t *count = user;

    assert_true(found->z[0] == 1e200 && found->vertex_count == 1 && found->vertices[0] == 1e200);
    ++*count;
    return 0;
}

/* w = 4 z + 1e-308 at z >= 1e200. In units of q both bounds are beyond the doubles; the vertex is
 * the bound that the point is at. */
static void test_bounds_out_of_range(void **state)
{
    static const double M = 4, q = 1e-308, lower = 1e200, upper = DBL_MAX;
    perp_lcp_enumeration result = fresh();
    perp_matrix view;
    int32_t count = 0;

    (void)state;
    view = matrix_rows(&M, 1, 1);
    assert_int_equal(perp_lcp_all(context, &result, NULL, LCP(&view, &q, &lower, &upper),
                                  require_vertex, &count),
                     PERP_OK);
    assert_int_equal(count, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_box),
        cmocka_unit_test(test_families),
        cmocka_unit_test(test_staircase),
        cmocka_unit_test(test_scaling),
        cmocka_unit_test(test_overflow),
        cmocka_unit_test(test_limits),
        cmocka_unit_test(test_visitor),
        cmocka_unit_test(test_reentry),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_a_solution_out_of_range),
        cmocka_unit_test(test_reports_are_finite),
        cmocka_unit_test(test_bounds_out_of_range),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
