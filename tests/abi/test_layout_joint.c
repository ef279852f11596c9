/* The binary interface of perp/joint.h, pinned: as tests/abi/test_layout.c, which see. */
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

static void test_joint_settings(void **state)
{
    (void)state;
    SIZE(perp_joint_settings, 136);
    FIELD(perp_joint_settings, struct_size, 0, 8);
    FIELD(perp_joint_settings, kind, 8, 4);
    FIELD(perp_joint_settings, collides, 12, 4);
    FIELD(perp_joint_settings, anchor, 16, 24);
    FIELD(perp_joint_settings, anchor_b, 40, 24);
    FIELD(perp_joint_settings, axis, 64, 24);
    FIELD(perp_joint_settings, pitch, 88, 8);
    FIELD(perp_joint_settings, lower, 96, 8);
    FIELD(perp_joint_settings, upper, 104, 8);
    FIELD(perp_joint_settings, motor_speed, 112, 8);
    FIELD(perp_joint_settings, motor_force, 120, 8);
    FIELD(perp_joint_settings, friction, 128, 8);
}

static void test_joint_state(void **state)
{
    (void)state;
    SIZE(perp_joint_state, 168);
    FIELD(perp_joint_state, struct_size, 0, 8);
    FIELD(perp_joint_state, position, 8, 8);
    FIELD(perp_joint_state, speed, 16, 8);
    FIELD(perp_joint_state, anchor, 24, 24);
    FIELD(perp_joint_state, impulse, 48, 24);
    FIELD(perp_joint_state, moment, 72, 24);
    FIELD(perp_joint_state, motor_impulse, 96, 8);
    FIELD(perp_joint_state, friction_impulse, 104, 8);
    FIELD(perp_joint_state, limit_impulse, 112, 8);
    FIELD(perp_joint_state, at_limit, 120, 4);
    FIELD(perp_joint_state, reserved, 124, 4);
    FIELD(perp_joint_state, lower, 128, 8);
    FIELD(perp_joint_state, upper, 136, 8);
    FIELD(perp_joint_state, motor_speed, 144, 8);
    FIELD(perp_joint_state, motor_force, 152, 8);
    FIELD(perp_joint_state, friction, 160, 8);
}

static void test_values(void **state)
{
    (void)state;
    VALUE(PERP_JOINT_BALL, 0);
    VALUE(PERP_JOINT_REVOLUTE, 1);
    VALUE(PERP_JOINT_PRISMATIC, 2);
    VALUE(PERP_JOINT_FIXED, 3);
    VALUE(PERP_JOINT_SCREW, 4);
    VALUE(PERP_JOINT_CYLINDRICAL, 5);
    VALUE(PERP_JOINT_PLANAR, 6);
    VALUE(PERP_JOINT_DISTANCE, 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_joint_settings),
        cmocka_unit_test(test_joint_state),
        cmocka_unit_test(test_values),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
