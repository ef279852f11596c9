/* The binary interface of perp/mechanism.h, pinned: as tests/abi/test_layout.c, which see. */
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

static void test_mechanism_model(void **state)
{
    (void)state;
    SIZE(perp_mechanism_model, 160);
    FIELD(perp_mechanism_model, struct_size, 0, 8);
    FIELD(perp_mechanism_model, velocities, 8, 4);
    FIELD(perp_mechanism_model, coordinates, 12, 4);
    FIELD(perp_mechanism_model, contacts, 16, 4);
    FIELD(perp_mechanism_model, dim, 20, 4);
    FIELD(perp_mechanism_model, dims, 24, 8);
    FIELD(perp_mechanism_model, bilateral, 32, 4);
    FIELD(perp_mechanism_model, dry, 36, 4);
    FIELD(perp_mechanism_model, dry_dim, 40, 4);
    FIELD(perp_mechanism_model, reserved, 44, 4);
    FIELD(perp_mechanism_model, mu, 48, 8);
    FIELD(perp_mechanism_model, mu_static, 56, 8);
    FIELD(perp_mechanism_model, stribeck, 64, 8);
    FIELD(perp_mechanism_model, restitution, 72, 8);
    FIELD(perp_mechanism_model, mass, 80, 8);
    FIELD(perp_mechanism_model, force, 88, 8);
    FIELD(perp_mechanism_model, contact_rows, 96, 8);
    FIELD(perp_mechanism_model, bilateral_rows, 104, 8);
    FIELD(perp_mechanism_model, dry_rows, 112, 8);
    FIELD(perp_mechanism_model, kinematics, 120, 8);
    FIELD(perp_mechanism_model, normalise, 128, 8);
    FIELD(perp_mechanism_model, curvature, 136, 8);
    FIELD(perp_mechanism_model, user, 144, 8);
    FIELD(perp_mechanism_model, two_sided, 152, 8);
}

static void test_mechanism_settings(void **state)
{
    (void)state;
    SIZE(perp_mechanism_settings, 120);
    FIELD(perp_mechanism_settings, struct_size, 0, 8);
    FIELD(perp_mechanism_settings, scheme, 8, 4);
    FIELD(perp_mechanism_settings, law, 12, 4);
    FIELD(perp_mechanism_settings, cone, 16, 4);
    FIELD(perp_mechanism_settings, project, 20, 4);
    FIELD(perp_mechanism_settings, theta, 24, 8);
    FIELD(perp_mechanism_settings, tol, 32, 8);
    FIELD(perp_mechanism_settings, error, 40, 8);
    FIELD(perp_mechanism_settings, shortest, 48, 8);
    FIELD(perp_mechanism_settings, longest, 56, 8);
    FIELD(perp_mechanism_settings, time_limit, 64, 8);
    FIELD(perp_mechanism_settings, most_patterns, 72, 8);
    FIELD(perp_mechanism_settings, directions, 80, 4);
    FIELD(perp_mechanism_settings, starts, 84, 4);
    FIELD(perp_mechanism_settings, stiffness, 88, 8);
    FIELD(perp_mechanism_settings, damping, 96, 8);
    FIELD(perp_mechanism_settings, select, 104, 4);
    FIELD(perp_mechanism_settings, reserved, 108, 4);
    FIELD(perp_mechanism_settings, overlap, 112, 8);
}

static void test_mechanism_step(void **state)
{
    (void)state;
    SIZE(perp_mechanism_step, 104);
    FIELD(perp_mechanism_step, struct_size, 0, 8);
    FIELD(perp_mechanism_step, outcome, 8, 4);
    FIELD(perp_mechanism_step, scheme, 12, 4);
    FIELD(perp_mechanism_step, closed, 16, 4);
    FIELD(perp_mechanism_step, sticking, 20, 4);
    FIELD(perp_mechanism_step, impacts, 24, 4);
    FIELD(perp_mechanism_step, certificate, 28, 4);
    FIELD(perp_mechanism_step, has_ray, 32, 4);
    FIELD(perp_mechanism_step, method, 36, 4);
    FIELD(perp_mechanism_step, residual, 40, 8);
    FIELD(perp_mechanism_step, penetration, 48, 8);
    FIELD(perp_mechanism_step, drift, 56, 8);
    FIELD(perp_mechanism_step, error, 64, 8);
    FIELD(perp_mechanism_step, seconds, 72, 8);
    FIELD(perp_mechanism_step, iterations, 80, 8);
    FIELD(perp_mechanism_step, evaluations, 88, 8);
    FIELD(perp_mechanism_step, answers, 96, 4);
    FIELD(perp_mechanism_step, exhaustive, 100, 4);
}

static void test_mechanism_view(void **state)
{
    (void)state;
    SIZE(perp_mechanism_view, 72);
    FIELD(perp_mechanism_view, struct_size, 0, 8);
    FIELD(perp_mechanism_view, t, 8, 8);
    FIELD(perp_mechanism_view, h, 16, 8);
    FIELD(perp_mechanism_view, q, 24, 8);
    FIELD(perp_mechanism_view, v, 32, 8);
    FIELD(perp_mechanism_view, impulse, 40, 8);
    FIELD(perp_mechanism_view, velocity, 48, 8);
    FIELD(perp_mechanism_view, modes, 56, 8);
    FIELD(perp_mechanism_view, step, 64, 8);
}

static void test_mechanism_run_result(void **state)
{
    (void)state;
    SIZE(perp_mechanism_run_result, 96);
    FIELD(perp_mechanism_run_result, struct_size, 0, 8);
    FIELD(perp_mechanism_run_result, outcome, 8, 4);
    FIELD(perp_mechanism_run_result, fallbacks, 12, 4);
    FIELD(perp_mechanism_run_result, t, 16, 8);
    FIELD(perp_mechanism_run_result, error, 24, 8);
    FIELD(perp_mechanism_run_result, residual, 32, 8);
    FIELD(perp_mechanism_run_result, penetration, 40, 8);
    FIELD(perp_mechanism_run_result, drift, 48, 8);
    FIELD(perp_mechanism_run_result, seconds, 56, 8);
    FIELD(perp_mechanism_run_result, steps, 64, 8);
    FIELD(perp_mechanism_run_result, rejected, 72, 8);
    FIELD(perp_mechanism_run_result, iterations, 80, 8);
    FIELD(perp_mechanism_run_result, evaluations, 88, 8);
}

static void test_mechanism_found(void **state)
{
    (void)state;
    SIZE(perp_mechanism_found, 112);
    FIELD(perp_mechanism_found, struct_size, 0, 8);
    FIELD(perp_mechanism_found, stable, 8, 4);
    FIELD(perp_mechanism_found, flutter, 12, 4);
    FIELD(perp_mechanism_found, at_vertex, 16, 4);
    FIELD(perp_mechanism_found, dimension, 20, 4);
    FIELD(perp_mechanism_found, free, 24, 4);
    FIELD(perp_mechanism_found, vertex_count, 28, 4);
    FIELD(perp_mechanism_found, ray_count, 32, 4);
    FIELD(perp_mechanism_found, reserved, 36, 4);
    FIELD(perp_mechanism_found, residual, 40, 8);
    FIELD(perp_mechanism_found, acceleration, 48, 8);
    FIELD(perp_mechanism_found, force, 56, 8);
    FIELD(perp_mechanism_found, row_acceleration, 64, 8);
    FIELD(perp_mechanism_found, modes, 72, 8);
    FIELD(perp_mechanism_found, eigenvalues, 80, 8);
    FIELD(perp_mechanism_found, eigenvalue_count, 88, 4);
    FIELD(perp_mechanism_found, reserved_too, 92, 4);
    FIELD(perp_mechanism_found, vertices, 96, 8);
    FIELD(perp_mechanism_found, rays, 104, 8);
}

static void test_mechanism_summary(void **state)
{
    (void)state;
    SIZE(perp_mechanism_summary, 56);
    FIELD(perp_mechanism_summary, struct_size, 0, 8);
    FIELD(perp_mechanism_summary, count, 8, 4);
    FIELD(perp_mechanism_summary, families, 12, 4);
    FIELD(perp_mechanism_summary, stable, 16, 4);
    FIELD(perp_mechanism_summary, exhaustive, 20, 4);
    FIELD(perp_mechanism_summary, closed, 24, 4);
    FIELD(perp_mechanism_summary, impact, 28, 4);
    FIELD(perp_mechanism_summary, reason, 32, 4);
    FIELD(perp_mechanism_summary, contact, 36, 4);
    FIELD(perp_mechanism_summary, inertia, 40, 8);
    FIELD(perp_mechanism_summary, patterns, 48, 8);
}

static void test_mechanism_check_result(void **state)
{
    (void)state;
    SIZE(perp_mechanism_check_result, 64);
    FIELD(perp_mechanism_check_result, struct_size, 0, 8);
    FIELD(perp_mechanism_check_result, wrong, 8, 4);
    FIELD(perp_mechanism_check_result, constant, 12, 4);
    FIELD(perp_mechanism_check_result, unchecked, 16, 4);
    FIELD(perp_mechanism_check_result, part, 20, 4);
    FIELD(perp_mechanism_check_result, index, 24, 4);
    FIELD(perp_mechanism_check_result, row, 28, 4);
    FIELD(perp_mechanism_check_result, column, 32, 4);
    FIELD(perp_mechanism_check_result, reserved, 36, 4);
    FIELD(perp_mechanism_check_result, given, 40, 8);
    FIELD(perp_mechanism_check_result, difference, 48, 8);
    FIELD(perp_mechanism_check_result, uncertainty, 56, 8);
}

static void test_values(void **state)
{
    (void)state;
    VALUE(PERP_MECHANISM_FROZEN, 0);
    VALUE(PERP_MECHANISM_IMPLICIT, 1);
    VALUE(PERP_MECHANISM_THETA, 2);
    VALUE(PERP_MECHANISM_MOREAU, 0);
    VALUE(PERP_MECHANISM_NEWTON, 1);
    VALUE(PERP_MECHANISM_POISSON, 2);
    VALUE(PERP_MECHANISM_STRONGE, 3);
    VALUE(PERP_MECHANISM_SEPARATE, 0);
    VALUE(PERP_MECHANISM_STICK, 1);
    VALUE(PERP_MECHANISM_SLIP, 2);
    VALUE(PERP_MECHANISM_ANY, 0);
    VALUE(PERP_MECHANISM_NEAREST, 1);
    VALUE(PERP_MECHANISM_FREEST, 2);
    VALUE(PERP_MECHANISM_ALWAYS_ONE, 0);
    VALUE(PERP_MECHANISM_NEGATIVE_INERTIA, 1);
    VALUE(PERP_MECHANISM_ZERO_INERTIA, 2);
    VALUE(PERP_MECHANISM_COUPLED, 3);
    VALUE(PERP_MECHANISM_REDUNDANT, 4);
    VALUE(PERP_MECHANISM_UNDECIDED, 5);
    VALUE(PERP_MECHANISM_STATIC_FRICTION, 6);
    VALUE(PERP_MECHANISM_NORMAL, 0);
    VALUE(PERP_MECHANISM_GRADIENT, 1);
    VALUE(PERP_MECHANISM_DRIFT, 2);
    VALUE(PERP_MECHANISM_TANGENT, 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mechanism_model),
        cmocka_unit_test(test_mechanism_settings),
        cmocka_unit_test(test_mechanism_step),
        cmocka_unit_test(test_mechanism_view),
        cmocka_unit_test(test_mechanism_run_result),
        cmocka_unit_test(test_mechanism_found),
        cmocka_unit_test(test_mechanism_summary),
        cmocka_unit_test(test_mechanism_check_result),
        cmocka_unit_test(test_values),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
