/* The binary interface of perp/statics.h and of perp_world_statics, pinned: see test_layout.c. */
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

static void test_statics(void **state)
{
    (void)state;
    SIZE(perp_statics_settings, 16);
    FIELD(perp_statics_settings, struct_size, 0, 8);
    FIELD(perp_statics_settings, objective, 8, 4);
    FIELD(perp_statics_settings, max_iterations, 12, 4);
    SIZE(perp_statics_result, 56);
    FIELD(perp_statics_result, struct_size, 0, 8);
    FIELD(perp_statics_result, verdict, 8, 4);
    FIELD(perp_statics_result, iterations, 12, 4);
    FIELD(perp_statics_result, margin, 16, 8);
    FIELD(perp_statics_result, safety, 24, 8);
    FIELD(perp_statics_result, unbalance, 32, 8);
    FIELD(perp_statics_result, work, 40, 8);
    FIELD(perp_statics_result, seconds, 48, 8);
    SIZE(perp_statics_problem, 64);
    FIELD(perp_statics_problem, struct_size, 0, 8);
    FIELD(perp_statics_problem, n, 8, 4);
    FIELD(perp_statics_problem, reserved, 12, 4);
    FIELD(perp_statics_problem, laws, 16, 8);
    FIELD(perp_statics_problem, H, 24, 8);
    FIELD(perp_statics_problem, G, 32, 8);
    FIELD(perp_statics_problem, f, 40, 8);
    FIELD(perp_statics_problem, load, 48, 8);
    FIELD(perp_statics_problem, r0, 56, 8);
    SIZE(perp_world_load, 64);
    FIELD(perp_world_load, struct_size, 0, 8);
    FIELD(perp_world_load, body, 8, 8);
    FIELD(perp_world_load, force, 16, 24);
    FIELD(perp_world_load, torque, 40, 24);
    VALUE(PERP_STATICS_STANDS, 0);
    VALUE(PERP_STATICS_FALLS, 1);
    VALUE(PERP_STATICS_INDETERMINATE, 2);
    VALUE(PERP_STATICS_LEAST, 0);
    VALUE(PERP_STATICS_INTERIOR, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_statics)};

    return cmocka_run_group_tests(tests, NULL, NULL);
}
