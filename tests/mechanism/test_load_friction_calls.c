/* Load-dependent friction: what is refused, and failures of memory. */
#include "friction_run.h"

#include "memory.h"
#include "refused.h"

static const double A2[] = {2, 1, 1, 2}, C2[] = {3, 1, 1, 3}, one[] = {1, 1}, zero[] = {0, 0};

/* The message of a system that must be refused. */
static void refuse(asked *a, perp_status status, const char *text)
{
    perp_load_friction *friction = (perp_load_friction *)(void *)a;

    assert_int_equal(perp_context_create(&a->context, NULL), PERP_OK);
    refused(a->context, perp_load_friction_create(a->context, &friction, NULL, &a->system), status,
            text, "create");
    assert_ptr_equal(friction, a); /* untouched */
    perp_context_destroy(a->context);
}

static void test_systems(void **state)
{
    const double unsymmetric[] = {2, 1, 0, 2}, indefinite[] = {1, 2, 2, 1};
    const double negative[] = {1, -0.5}, weak[] = {1, 0.5}, bad[] = {0, NAN};
    const double infinite[] = {INFINITY, 0};
    asked a;

    (void)state;
    describe(&a, 0, A2, zero, C2, one, one);
    refuse(&a, PERP_ERROR_ARGUMENT, "system.n is 0");
    describe(&a, -1, A2, zero, C2, one, one);
    refuse(&a, PERP_ERROR_ARGUMENT, "system.n is -1");
    describe(&a, 2, unsymmetric, zero, C2, one, one);
    refuse(&a, PERP_ERROR_ARGUMENT, "A is not symmetric");
    describe(&a, 2, indefinite, zero, C2, one, one);
    refuse(&a, PERP_ERROR_ARGUMENT, "A is not positive definite");
    describe(&a, 2, A2, zero, C2, one, negative);
    refuse(&a, PERP_ERROR_ARGUMENT, "mu[1] is -0.5");
    describe(&a, 2, A2, zero, C2, one, NULL);
    refuse(&a, PERP_ERROR_ARGUMENT, "mu is NULL");
    describe(&a, 2, A2, zero, C2, one, one)->mu_static = weak;
    refuse(&a, PERP_ERROR_ARGUMENT, "mu_static[1] = 0.5 < mu[1] = 1");
    describe(&a, 2, A2, bad, C2, one, one);
    refuse(&a, PERP_ERROR_NOT_FINITE, "b[1] is");
    describe(&a, 2, A2, zero, C2, infinite, one);
    refuse(&a, PERP_ERROR_NOT_FINITE, "d[0] is inf");
    describe(&a, 2, A2, zero, C2, one, bad);
    refuse(&a, PERP_ERROR_NOT_FINITE, "mu[1] is");
    describe(&a, 2, A2, zero, C2, one, one)->stiffness = 0.0;
    refuse(&a, PERP_ERROR_ARGUMENT, "stiffness is 0");
    describe(&a, 2, A2, zero, C2, one, one)->damping = -1.0;
    refuse(&a, PERP_ERROR_ARGUMENT, "damping is -1");
    describe(&a, 2, A2, zero, C2, one, one)->C = NULL;
    refuse(&a, PERP_ERROR_ARGUMENT, "C is NULL");
    describe(&a, 2, A2, zero, C2, one, one);
    a.C.columns = 1;
    refuse(&a, PERP_ERROR_ARGUMENT, "C is 2 by 1");
    describe(&a, 2, A2, zero, C2, one, one)->struct_size = 3;
    refuse(&a, PERP_ERROR_ABI, "system.struct_size");
}

static void test_settings(void **state)
{
    perp_load_settings settings;
    perp_load_friction *friction;
    asked a;

    (void)state;
    describe(&a, 2, A2, zero, C2, one, one);
    assert_int_equal(perp_context_create(&a.context, NULL), PERP_OK);
    assert_int_equal(perp_load_settings_init(&settings, 3), PERP_ERROR_ABI);
    assert_int_equal(perp_load_settings_init(&settings, sizeof settings), PERP_OK);
    settings.tol = 0.0;
    assert_int_equal(perp_load_friction_create(a.context, &friction, &settings, &a.system),
                     PERP_ERROR_ARGUMENT);
    settings.tol = 1e-13;
    settings.most_patterns = 0;
    assert_int_equal(perp_load_friction_create(a.context, &friction, &settings, &a.system),
                     PERP_ERROR_ARGUMENT);
    settings.most_patterns = 1;
    settings.starts = 0;
    assert_int_equal(perp_load_friction_create(a.context, &friction, &settings, &a.system),
                     PERP_ERROR_ARGUMENT);
    perp_context_destroy(a.context);
}

static void test_questions(void **state)
{
    const double bad[] = {0, NAN};
    perp_load_found found = fresh_load_found();
    double tau[2] = {7, 8};
    asked a;

    (void)state;
    describe(&a, 2, A2, zero, C2, one, one);
    start(&a, NULL);
    assert_int_equal(ask(&a, zero, one), 4);
    assert_int_equal(perp_load_friction_solve(a.friction, &a.summary, bad, one),
                     PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_load_friction_solve(a.friction, &a.summary, zero, bad),
                     PERP_ERROR_NOT_FINITE);
    assert_int_equal(perp_load_friction_solve(a.friction, &a.summary, NULL, one),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(a.summary.count, 4);
    assert_int_equal(perp_load_friction_solve(NULL, &a.summary, zero, one), PERP_ERROR_HANDLE);
    assert_int_equal(perp_load_friction_get(a.friction, &found, 4), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_load_friction_get(a.friction, &found, -1), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_load_friction_inverse(a.friction, tau, NULL, one, bad),
                     PERP_ERROR_NOT_FINITE);
    assert_true(tau[0] == 7 && tau[1] == 8);
    assert_int_equal(perp_load_friction_inverse(a.friction, tau, NULL, one, zero), PERP_OK);
    assert_close(tau[0], 1, 0);
    perp_load_friction_destroy(NULL);
    finish(&a);
}

static void test_set(void **state)
{
    const double other[] = {0.1, 0.1}, negative[] = {-1, 0};
    asked a;

    (void)state;
    describe(&a, 2, A2, zero, C2, one, one);
    start(&a, NULL);
    a.system.mu = negative;
    assert_int_equal(perp_load_friction_set(a.friction, &a.system), PERP_ERROR_ARGUMENT);
    assert_int_equal(ask(&a, zero, one), 4);
    a.system.mu = other;
    assert_int_equal(perp_load_friction_set(a.friction, &a.system), PERP_OK);
    assert_int_equal(ask(&a, zero, one), 1);
    a.system.n = 1;
    assert_int_equal(perp_load_friction_set(a.friction, &a.system), PERP_ERROR_ARGUMENT);
    finish(&a);
}

/* Points, a family, and beyond the enumeration; every allocation fails once. */
static int32_t everything(const perp_context_settings *from)
{
    const double flat[] = {4, 0, 0, 4}, tau[] = {-2, 5}, half[] = {0.5, 0.5};
    const double unit[] = {2, 0, 0, 2};
    perp_load_settings settings;
    perp_status status;
    int32_t part;

    for (part = 0; part < 3; part++) {
        const int32_t is_family = part == 1;
        asked a;

        if (is_family) /* inertia 2 - 0.5 4 = 0 in both */
            describe(&a, 2, unit, zero, flat, zero, half);
        else
            describe(&a, 2, A2, zero, C2, one, one);
        perp_load_settings_init(&settings, sizeof settings);
        if (part == 2)
            settings.most_patterns = 1;
        status = perp_context_create(&a.context, from);
        if (status != PERP_OK)
            return status;
        status = perp_load_friction_create(a.context, &a.friction, &settings, &a.system);
        if (status == PERP_OK) {
            status = perp_load_friction_solve(a.friction, &a.summary, is_family ? zero : tau, one);
            if (status == PERP_OK)
                status = perp_load_friction_set(a.friction, &a.system);
            if (status == PERP_OK)
                status = perp_load_friction_solve(a.friction, &a.summary, zero, one);
            if (status == PERP_OK)
                assert_true(a.summary.count > 0);
            if (status == PERP_OK && is_family)
                assert_true(a.summary.families > 0);
            if (status == PERP_OK)
                assert_int_equal(a.summary.exhaustive, part != 2);
            perp_load_friction_destroy(a.friction);
        }
        perp_context_destroy(a.context);
        if (status != PERP_OK)
            return status;
    }
    return PERP_OK;
}

static void test_memory(void **state)
{
    (void)state;
    memory_fails_anywhere(everything, 10);
}

/* Once the answers have room, questions and steps ask for no memory. */
static void test_no_memory_later(void **state)
{
    memory m = {0, 0, 0};
    const perp_context_settings settings = memory_settings(&m);
    const double other[] = {-1, 4};
    perp_load_step step = fresh_load_step();
    double v[2] = {1, 1};
    int32_t before, k;
    asked a;

    (void)state;
    describe(&a, 2, A2, zero, C2, one, one);
    assert_int_equal(perp_context_create(&a.context, &settings), PERP_OK);
    assert_int_equal(perp_load_friction_create(a.context, &a.friction, NULL, &a.system), PERP_OK);
    assert_int_equal(perp_load_friction_step(a.friction, v, NULL, &step, zero, one, NULL, 1e-3),
                     PERP_OK);
    before = m.calls;
    for (k = 0; k < 20; k++) {
        assert_int_equal(ask(&a, zero, one), 4);
        assert_int_equal(ask(&a, other, one), 2);
        assert_int_equal(perp_load_friction_step(a.friction, v, NULL, &step, zero, one, NULL, 1e-3),
                         PERP_OK);
    }
    assert_int_equal(m.calls, before);
    finish(&a);
    assert_int_equal(m.live, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_systems),   cmocka_unit_test(test_settings),
        cmocka_unit_test(test_questions), cmocka_unit_test(test_set),
        cmocka_unit_test(test_memory),    cmocka_unit_test(test_no_memory_later),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
