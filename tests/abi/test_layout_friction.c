/* The binary interface of perp/friction.h, pinned: as tests/abi/test_layout.c, which see. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <perp/mechanism.h>

#define SIZE(type, size) assert_int_equal(sizeof(type), size)
#define FIELD(type, field, offset, size)             \
    assert_int_equal(offsetof(type, field), offset); \
    assert_int_equal(sizeof(((type *)0)->field), size)
#define VALUE(name, value) assert_int_equal(name, value)

static void test_load_system(void **state)
{
    (void)state;
    SIZE(perp_load_system, 88);
    FIELD(perp_load_system, struct_size, 0, 8);
    FIELD(perp_load_system, n, 8, 4);
    FIELD(perp_load_system, reserved, 12, 4);
    FIELD(perp_load_system, A, 16, 8);
    FIELD(perp_load_system, C, 24, 8);
    FIELD(perp_load_system, b, 32, 8);
    FIELD(perp_load_system, d, 40, 8);
    FIELD(perp_load_system, mu, 48, 8);
    FIELD(perp_load_system, mu_static, 56, 8);
    FIELD(perp_load_system, normal_inertia, 64, 8);
    FIELD(perp_load_system, stiffness, 72, 8);
    FIELD(perp_load_system, damping, 80, 8);
}

static void test_load_settings(void **state)
{
    (void)state;
    SIZE(perp_load_settings, 32);
    FIELD(perp_load_settings, struct_size, 0, 8);
    FIELD(perp_load_settings, tol, 8, 8);
    FIELD(perp_load_settings, most_patterns, 16, 8);
    FIELD(perp_load_settings, starts, 24, 4);
    FIELD(perp_load_settings, reserved, 28, 4);
}

static void test_load_found(void **state)
{
    (void)state;
    SIZE(perp_load_found, 104);
    FIELD(perp_load_found, struct_size, 0, 8);
    FIELD(perp_load_found, kind, 8, 4);
    FIELD(perp_load_found, stable, 12, 4);
    FIELD(perp_load_found, flutter, 16, 4);
    FIELD(perp_load_found, at_vertex, 20, 4);
    FIELD(perp_load_found, dimension, 24, 4);
    FIELD(perp_load_found, vertex_count, 28, 4);
    FIELD(perp_load_found, ray_count, 32, 4);
    FIELD(perp_load_found, reserved, 36, 4);
    FIELD(perp_load_found, residual, 40, 8);
    FIELD(perp_load_found, acceleration, 48, 8);
    FIELD(perp_load_found, normal_force, 56, 8);
    FIELD(perp_load_found, friction, 64, 8);
    FIELD(perp_load_found, modes, 72, 8);
    FIELD(perp_load_found, eigenvalues, 80, 8);
    FIELD(perp_load_found, vertices, 88, 8);
    FIELD(perp_load_found, rays, 96, 8);
}

static void test_load_summary(void **state)
{
    (void)state;
    SIZE(perp_load_summary, 32);
    FIELD(perp_load_summary, struct_size, 0, 8);
    FIELD(perp_load_summary, count, 8, 4);
    FIELD(perp_load_summary, families, 12, 4);
    FIELD(perp_load_summary, stable, 16, 4);
    FIELD(perp_load_summary, exhaustive, 20, 4);
    FIELD(perp_load_summary, patterns, 24, 8);
}

static void test_load_uniqueness(void **state)
{
    (void)state;
    SIZE(perp_load_uniqueness, 48);
    FIELD(perp_load_uniqueness, struct_size, 0, 8);
    FIELD(perp_load_uniqueness, verdict, 8, 4);
    FIELD(perp_load_uniqueness, exact, 12, 4);
    FIELD(perp_load_uniqueness, margin, 16, 8);
    FIELD(perp_load_uniqueness, determinant, 24, 8);
    FIELD(perp_load_uniqueness, norm, 32, 8);
    FIELD(perp_load_uniqueness, radius, 40, 8);
}

static void test_load_inverse(void **state)
{
    (void)state;
    SIZE(perp_load_inverse, 40);
    FIELD(perp_load_inverse, struct_size, 0, 8);
    FIELD(perp_load_inverse, well_posed, 8, 4);
    FIELD(perp_load_inverse, accelerations, 12, 4);
    FIELD(perp_load_inverse, exhaustive, 16, 4);
    FIELD(perp_load_inverse, stable, 20, 4);
    FIELD(perp_load_inverse, flutter, 24, 4);
    FIELD(perp_load_inverse, undetermined, 28, 4);
    FIELD(perp_load_inverse, reason, 32, 4);
    FIELD(perp_load_inverse, reserved, 36, 4);
}

static void test_load_step(void **state)
{
    (void)state;
    SIZE(perp_load_step, 40);
    FIELD(perp_load_step, struct_size, 0, 8);
    FIELD(perp_load_step, chosen, 8, 4);
    FIELD(perp_load_step, answers, 12, 4);
    FIELD(perp_load_step, exhaustive, 16, 4);
    FIELD(perp_load_step, stable, 20, 4);
    FIELD(perp_load_step, stopped, 24, 4);
    FIELD(perp_load_step, jam, 28, 4);
    FIELD(perp_load_step, accelerations, 32, 4);
    FIELD(perp_load_step, reserved, 36, 4);
}

static void test_compliant_system(void **state)
{
    (void)state;
    SIZE(perp_compliant_system, 88);
    FIELD(perp_compliant_system, struct_size, 0, 8);
    FIELD(perp_compliant_system, n, 8, 4);
    FIELD(perp_compliant_system, contacts, 12, 4);
    FIELD(perp_compliant_system, mass, 16, 8);
    FIELD(perp_compliant_system, normal, 24, 8);
    FIELD(perp_compliant_system, tangent, 32, 8);
    FIELD(perp_compliant_system, force, 40, 8);
    FIELD(perp_compliant_system, mu, 48, 8);
    FIELD(perp_compliant_system, stiffness, 56, 8);
    FIELD(perp_compliant_system, damping, 64, 8);
    FIELD(perp_compliant_system, mu_static, 72, 8);
    FIELD(perp_compliant_system, one_sided, 80, 8);
}

static void test_compliant_settings(void **state)
{
    (void)state;
    SIZE(perp_compliant_settings, 40);
    FIELD(perp_compliant_settings, struct_size, 0, 8);
    FIELD(perp_compliant_settings, tol, 8, 8);
    FIELD(perp_compliant_settings, first_step, 16, 8);
    FIELD(perp_compliant_settings, most_steps, 24, 8);
    FIELD(perp_compliant_settings, through, 32, 4);
    FIELD(perp_compliant_settings, resume, 36, 4);
}

static void test_compliant_result(void **state)
{
    (void)state;
    SIZE(perp_compliant_result, 96);
    FIELD(perp_compliant_result, struct_size, 0, 8);
    FIELD(perp_compliant_result, end, 8, 4);
    FIELD(perp_compliant_result, contact, 12, 4);
    FIELD(perp_compliant_result, t, 16, 8);
    FIELD(perp_compliant_result, next_step, 24, 8);
    FIELD(perp_compliant_result, least_normal, 32, 8);
    FIELD(perp_compliant_result, largest_normal, 40, 8);
    FIELD(perp_compliant_result, steps, 48, 8);
    FIELD(perp_compliant_result, rejected, 56, 8);
    FIELD(perp_compliant_result, stops, 64, 4);
    FIELD(perp_compliant_result, reversals, 68, 4);
    FIELD(perp_compliant_result, starts, 72, 4);
    FIELD(perp_compliant_result, releases, 76, 4);
    FIELD(perp_compliant_result, friction, 80, 8);
    FIELD(perp_compliant_result, modes, 88, 8);
}

static void test_compliant_stability(void **state)
{
    (void)state;
    SIZE(perp_compliant_stability, 24);
    FIELD(perp_compliant_stability, struct_size, 0, 8);
    FIELD(perp_compliant_stability, stable, 8, 4);
    FIELD(perp_compliant_stability, flutter, 12, 4);
    FIELD(perp_compliant_stability, growth, 16, 8);
}

static void test_values(void **state)
{
    (void)state;
    VALUE(PERP_LOAD_DYNAMIC, 0);
    VALUE(PERP_LOAD_STATIC, 1);
    VALUE(PERP_LOAD_MIXED, 2);
    VALUE(PERP_LOAD_FAMILY, 3);
    VALUE(PERP_LOAD_SLIDE, 0);
    VALUE(PERP_LOAD_STICK, 1);
    VALUE(PERP_LOAD_FORWARD, 2);
    VALUE(PERP_LOAD_BACKWARD, 3);
    VALUE(PERP_LOAD_STOPPED, 4);
    VALUE(PERP_LOAD_UNIQUE, 0);
    VALUE(PERP_LOAD_NOT_UNIQUE, 1);
    VALUE(PERP_LOAD_UNDECIDED, 2);
    VALUE(PERP_LOAD_WELL_POSED, 0);
    VALUE(PERP_LOAD_IN_FAMILY, 1);
    VALUE(PERP_LOAD_UNSTABLE, 2);
    VALUE(PERP_LOAD_FLUTTERS, 3);
    VALUE(PERP_LOAD_SEVERAL, 4);
    VALUE(PERP_LOAD_AT_REST, 5);
    VALUE(PERP_LOAD_NOT_ENUMERATED, 6);
    VALUE(PERP_COMPLIANT_TIME, 0);
    VALUE(PERP_COMPLIANT_STOPPED, 1);
    VALUE(PERP_COMPLIANT_STEPS, 2);
    VALUE(PERP_COMPLIANT_FAILED, 3);
    VALUE(PERP_COMPLIANT_RELEASED, 4);
    VALUE(PERP_COMPLIANT_TOUCHED, 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_load_system),         cmocka_unit_test(test_load_settings),
        cmocka_unit_test(test_load_found),          cmocka_unit_test(test_load_summary),
        cmocka_unit_test(test_load_uniqueness),     cmocka_unit_test(test_load_inverse),
        cmocka_unit_test(test_load_step),           cmocka_unit_test(test_compliant_system),
        cmocka_unit_test(test_compliant_settings),  cmocka_unit_test(test_compliant_result),
        cmocka_unit_test(test_compliant_stability), cmocka_unit_test(test_values),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
