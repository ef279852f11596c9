/* perp_lcp_sensitivity_...: refusals, memory, the life of a handle. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "memory.h"
#include "refused.h"
#include "run.h"

#include "context.h"

typedef struct call {
    double M[4], q[2], lower[2], upper[2], z[2];
    perp_matrix view;
    perp_lcp_settings settings;
    perp_lcp_sensitivity_info info;
} call;

static void prepare(call *c)
{
    static const double M[] = {2, 1, 1, 2}, ones[] = {1, 1};

    memset(c, 0, sizeof *c);
    memcpy(c->M, M, sizeof M);
    memcpy(c->z, ones, sizeof ones);
    c->q[0] = c->q[1] = -3.0;
    c->upper[0] = c->upper[1] = 9.0;
    c->settings = run_settings(PERP_LCP_AUTO);
    c->view = matrix_rows(c->M, 2, 2);
    assert_int_equal(perp_struct_init(&c->info, sizeof c->info), PERP_OK);
    c->info.margin = 5.0;
}

static perp_status create(call *c, perp_lcp_sensitivity **s)
{
    return perp_lcp_sensitivity_create(context, s, &c->info, &c->settings,
                                       LCP(&c->view, c->q, c->lower, c->upper), c->z);
}

static void refuse(call *c, perp_status expected, const char *words, const char *changes)
{
    perp_lcp_sensitivity *const none = (perp_lcp_sensitivity *)(void *)c, *s = none;

    refused(context, create(c, &s), expected, words, changes);
    assert_ptr_equal(s, none);
    assert_true(c->info.margin == 5.0);
    prepare(c);
}

/* That is what these changes of a good call c make of it. */
#define REFUSED(status, words, ...)              \
    do {                                         \
        __VA_ARGS__;                             \
        refuse(&c, status, words, #__VA_ARGS__); \
    } while (0)

static void test_create(void **state)
{
    perp_lcp_sensitivity *s = NULL;
    call c;

    (void)state;
    prepare(&c);
    assert_int_equal(perp_lcp_sensitivity_create(NULL, &s, &c.info, NULL, LCP(&c.view, c.q), c.z),
                     PERP_ERROR_HANDLE);
    assert_int_equal(
        perp_lcp_sensitivity_create(context, NULL, &c.info, NULL, LCP(&c.view, c.q), c.z),
        PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_sensitivity_create(context, &s, NULL, NULL, LCP(&c.view, c.q), c.z),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_sensitivity_create(context, &s, &c.info, NULL, LCP(NULL, c.q), c.z),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_sensitivity_create(context, &s, &c.info, NULL, LCP(&c.view), c.z),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(
        perp_lcp_sensitivity_create(context, &s, &c.info, NULL, LCP(&c.view, c.q), NULL),
        PERP_ERROR_ARGUMENT);
    assert_null(s);
    REFUSED(NOT_FINITE, "M(1,0)", c.M[2] = NAN);
    REFUSED(NOT_FINITE, "q[0]", c.q[0] = -INFINITY);
    REFUSED(NOT_FINITE, "z[1]", c.z[1] = NAN);
    REFUSED(ARGUMENT, "lower[0]", c.lower[0] = 10.0);
    REFUSED(ARGUMENT, "1 by 2", c.view.rows = 1);
    REFUSED(ARGUMENT, "settings.tol", c.settings.tol = 0.0);
    REFUSED(ABI, "info", c.info.struct_size = 1);
}

static void test_products(void **state)
{
    const double bad[2] = {1.0, NAN}, good[2] = {1.0, 2.0};
    double out[2] = {7, 7};
    int32_t places[2];
    perp_lcp_sensitivity *s = NULL;
    perp_matrix dM;
    call c;

    (void)state;
    prepare(&c);
    assert_int_equal(create(&c, &s), PERP_OK);
    dM = matrix_rows(good, 1, 1);
    assert_int_equal(perp_lcp_sensitivity_forward(NULL, out, good, NULL, NULL, NULL),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_sensitivity_adjoint(NULL, out, NULL, NULL, good), PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_sensitivity_places(NULL, places), PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_sensitivity_places(s, NULL), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_sensitivity_forward(s, NULL, good, NULL, NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    refused(context, perp_lcp_sensitivity_forward(s, out, bad, NULL, NULL, NULL), NOT_FINITE,
            "dq[1]", "the product");
    refused(context, perp_lcp_sensitivity_forward(s, out, good, NULL, bad, NULL), NOT_FINITE,
            "dlower[1]", "the product");
    refused(context, perp_lcp_sensitivity_forward(s, out, good, NULL, NULL, bad), NOT_FINITE,
            "dupper[1]", "the product");
    refused(context, perp_lcp_sensitivity_forward(s, out, good, &dM, NULL, NULL), ARGUMENT,
            "dM is 1 by 1", "the product");
    assert_int_equal(perp_lcp_sensitivity_adjoint(s, out, NULL, NULL, NULL), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_sensitivity_adjoint(s, out, NULL, NULL, bad), PERP_ERROR_NOT_FINITE);
    assert_true(out[0] == 7 && out[1] == 7);
    /* nothing given is no movement; and the handle works as before */
    assert_int_equal(perp_lcp_sensitivity_forward(s, out, NULL, NULL, NULL, NULL), PERP_OK);
    assert_true(out[0] == 0.0 && out[1] == 0.0);
    assert_int_equal(perp_lcp_sensitivity_forward(s, out, good, NULL, NULL, NULL), PERP_OK);
    assert_true(fabs(out[0]) < 1e-15 && fabs(out[1] + 1.0) < 1e-15); /* -[[2,1],[1,2]]^-1 (1,2) */
    perp_lcp_sensitivity_destroy(s);
}

/* A handle outlives its context, as solvers do. */
static void test_outlives_context(void **state)
{
    perp_lcp_sensitivity *s = NULL;
    perp_context *own;
    double out[2];
    call c;

    (void)state;
    prepare(&c);
    assert_int_equal(perp_context_create(&own, NULL), PERP_OK);
    assert_int_equal(perp_lcp_sensitivity_create(own, &s, &c.info, NULL, LCP(&c.view, c.q), c.z),
                     PERP_OK);
    perp_context_destroy(own);
    assert_int_equal(perp_lcp_sensitivity_forward(s, out, c.z, NULL, NULL, NULL), PERP_OK);
    perp_lcp_sensitivity_destroy(s);
}

static void test_memory(void **state)
{
    int sparse;

    (void)state;
    for (sparse = 0; sparse < 2; sparse++) {
        memory m = {0, 0, 0};
        perp_context_settings settings = memory_settings(&m);
        perp_lcp_sensitivity *s = NULL;
        perp_status status = PERP_ERROR_MEMORY;
        perp_lcp_sensitivity_info info;
        perp_context *limited;
        gen_lcp problem;
        gen_random random;
        double *dz;

        gen_seed(&random, 22);
        if (sparse)
            gen_obstacle_2d(&problem, 16);
        else
            gen_problem(&problem, &random, 20, GEN_PD_SYMMETRIC, GEN_MIXED);
        dz = check_allocate((size_t)problem.n, sizeof *dz);
        assert_int_equal(perp_context_create(&limited, &settings), PERP_OK);
        for (m.fails_at = 1; status != PERP_OK; m.fails_at++) {
            m.calls = 0;
            assert_int_equal(perp_struct_init(&info, sizeof info), PERP_OK);
            status = perp_lcp_sensitivity_create(
                limited, &s, &info, NULL,
                LCP(&problem.view, problem.q, problem.lower, problem.upper), problem.z);
            if (status != PERP_OK) {
                assert_int_equal(status, PERP_ERROR_MEMORY);
                assert_null(s);
                assert_int_equal(m.live, 1); /* the context */
            }
        }
        assert_true(m.fails_at > 3);
        m.calls = 0;
        assert_int_equal(perp_lcp_sensitivity_forward(s, dz, problem.q, &problem.view, NULL, NULL),
                         PERP_OK);
        assert_int_equal(perp_lcp_sensitivity_adjoint(s, dz, dz, dz, problem.q), PERP_OK);
        assert_int_equal(m.calls, 0); /* products allocate nothing */
        perp_lcp_sensitivity_destroy(s);
        gen_destroy(&problem);
        free(dz);
        perp_context_destroy(limited);
        assert_int_equal(m.live, 0);
    }
}

/* z = 1e300, dz/dq = -1e300: a change of 1e10 moves z beyond all doubles. That is refused by name,
 * and smaller ones are right: they are products of one number each. */
static void test_products_that_overflow(void **state)
{
    const double large = 1e10, small = 1.0;
    perp_lcp_sensitivity *s = NULL;
    double dz = 42.0, p = 42.0, lower = 42.0;
    call c;

    (void)state;
    prepare(&c);
    perp_matrix_dense(&c.view, PERP_STORAGE_ROW_MAJOR, 1, 1, c.M, 1);
    c.M[0] = 1e-300;
    c.q[0] = -1.0;
    c.upper[0] = INFINITY;
    c.z[0] = 1e300;
    assert_int_equal(create(&c, &s), PERP_OK);
    assert_int_equal(c.info.verdict, PERP_VERDICT_REGULAR);
    refused(context, perp_lcp_sensitivity_forward(s, &dz, &large, NULL, NULL, NULL), NOT_FINITE,
            "dz", "the product");
    assert_int_equal(perp_lcp_sensitivity_adjoint(s, &p, &lower, NULL, &large),
                     PERP_ERROR_NOT_FINITE);
    assert_true(dz == 42.0 && p == 42.0 && lower == 42.0);
    assert_int_equal(perp_lcp_sensitivity_forward(s, &dz, &small, NULL, NULL, NULL), PERP_OK);
    assert_true(fabs(dz + 1e300) <= 4e-16 * 1e300); /* two roundings */
    assert_int_equal(perp_lcp_sensitivity_adjoint(s, &p, &lower, NULL, &small), PERP_OK);
    assert_true(fabs(p + 1e300) <= 4e-16 * 1e300 && lower == 0.0);
    perp_lcp_sensitivity_destroy(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create),
        cmocka_unit_test(test_products),
        cmocka_unit_test(test_outlives_context),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_products_that_overflow),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
