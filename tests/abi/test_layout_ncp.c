/* The binary interface of perp/ncp.h, pinned: as tests/abi/test_layout.c, which see. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <perp/perp.h>

#define SIZE(type, size) assert_int_equal(sizeof(type), size)
#define FIELD(type, field, offset, size)             \
    assert_int_equal(offsetof(type, field), offset); \
    assert_int_equal(sizeof(((type *)0)->field), size)
#define VALUE(name, value) assert_int_equal(name, value)

static void test_ncp_problem(void **state)
{
    (void)state;
    SIZE(perp_ncp_problem, 72);
    FIELD(perp_ncp_problem, struct_size, 0, 8);
    FIELD(perp_ncp_problem, n, 8, 4);
    FIELD(perp_ncp_problem, storage, 12, 4);
    FIELD(perp_ncp_problem, column_starts, 16, 8);
    FIELD(perp_ncp_problem, row_indices, 24, 8);
    FIELD(perp_ncp_problem, function, 32, 8);
    FIELD(perp_ncp_problem, jacobian, 40, 8);
    FIELD(perp_ncp_problem, lower, 48, 8);
    FIELD(perp_ncp_problem, upper, 56, 8);
    FIELD(perp_ncp_problem, user, 64, 8);
}

static void test_ncp_progress(void **state)
{
    (void)state;
    SIZE(perp_ncp_progress, 40);
    FIELD(perp_ncp_progress, struct_size, 0, 8);
    FIELD(perp_ncp_progress, method, 8, 4);
    FIELD(perp_ncp_progress, restarts, 12, 4);
    FIELD(perp_ncp_progress, iterations, 16, 8);
    FIELD(perp_ncp_progress, evaluations, 24, 8);
    FIELD(perp_ncp_progress, residual, 32, 8);
}

static void test_ncp_settings(void **state)
{
    (void)state;
    SIZE(perp_ncp_settings, 72);
    FIELD(perp_ncp_settings, struct_size, 0, 8);
    FIELD(perp_ncp_settings, method, 8, 4);
    FIELD(perp_ncp_settings, max_iterations, 12, 4);
    FIELD(perp_ncp_settings, tol, 16, 8);
    FIELD(perp_ncp_settings, time_limit, 24, 8);
    FIELD(perp_ncp_settings, penalty, 32, 8);
    FIELD(perp_ncp_settings, restarts, 40, 4);
    FIELD(perp_ncp_settings, scaling, 44, 4);
    FIELD(perp_ncp_settings, polish, 48, 4);
    FIELD(perp_ncp_settings, reserved, 52, 4);
    FIELD(perp_ncp_settings, monitor, 56, 8);
    FIELD(perp_ncp_settings, monitor_user, 64, 8);
}

static void test_ncp_result(void **state)
{
    (void)state;
    SIZE(perp_ncp_result, 80);
    FIELD(perp_ncp_result, struct_size, 0, 8);
    FIELD(perp_ncp_result, outcome, 8, 4);
    FIELD(perp_ncp_result, method, 12, 4);
    FIELD(perp_ncp_result, iterations, 16, 8);
    FIELD(perp_ncp_result, residual, 24, 8);
    FIELD(perp_ncp_result, natural_residual, 32, 8);
    FIELD(perp_ncp_result, backward_error, 40, 8);
    FIELD(perp_ncp_result, seconds, 48, 8);
    FIELD(perp_ncp_result, function_evaluations, 56, 8);
    FIELD(perp_ncp_result, jacobian_evaluations, 64, 8);
    FIELD(perp_ncp_result, restarts, 72, 4);
    FIELD(perp_ncp_result, trapped, 76, 4);
}

static void test_ncp_check(void **state)
{
    (void)state;
    SIZE(perp_ncp_check, 72);
    FIELD(perp_ncp_check, struct_size, 0, 8);
    FIELD(perp_ncp_check, wrong, 8, 4);
    FIELD(perp_ncp_check, missing, 12, 4);
    FIELD(perp_ncp_check, row, 16, 4);
    FIELD(perp_ncp_check, column, 20, 4);
    FIELD(perp_ncp_check, given, 24, 8);
    FIELD(perp_ncp_check, difference, 32, 8);
    FIELD(perp_ncp_check, uncertainty, 40, 8);
    FIELD(perp_ncp_check, missing_row, 48, 4);
    FIELD(perp_ncp_check, missing_column, 52, 4);
    FIELD(perp_ncp_check, missing_difference, 56, 8);
    FIELD(perp_ncp_check, unchecked, 64, 4);
    FIELD(perp_ncp_check, reserved, 68, 4);
}

static void test_values(void **state)
{
    (void)state;
    VALUE(PERP_NCP_AUTO, 0);
    VALUE(PERP_NCP_FISCHER, 1);
    VALUE(PERP_NCP_JOSEPHY, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ncp_problem),  cmocka_unit_test(test_ncp_progress),
        cmocka_unit_test(test_ncp_settings), cmocka_unit_test(test_ncp_result),
        cmocka_unit_test(test_ncp_check),    cmocka_unit_test(test_values),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
