/* The binary interface, pinned: the size of every public struct, the place of every field and the
 * value of every constant, on machines with 64-bit longs and pointers. The numbers follow from the
 * declarations by the rules of the System V ABI, not from a compiler's output.
 *
 * A release may add fields at the end of a struct, and constants: then lines are added here and the
 * SIZE of that struct changes. No other line may ever change (docs/abi.md). */
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

static void test_context_settings(void **state)
{
    (void)state;
    SIZE(perp_context_settings, 48);
    FIELD(perp_context_settings, struct_size, 0, 8);
    FIELD(perp_context_settings, allocate, 8, 8);
    FIELD(perp_context_settings, release, 16, 8);
    FIELD(perp_context_settings, allocator_user, 24, 8);
    FIELD(perp_context_settings, log, 32, 8);
    FIELD(perp_context_settings, log_user, 40, 8);
}

static void test_matrix(void **state)
{
    (void)state;
    SIZE(perp_matrix, 56);
    FIELD(perp_matrix, struct_size, 0, 8);
    FIELD(perp_matrix, storage, 8, 4);
    FIELD(perp_matrix, rows, 12, 4);
    FIELD(perp_matrix, columns, 16, 4);
    FIELD(perp_matrix, reserved, 20, 4);
    FIELD(perp_matrix, leading_dimension, 24, 8);
    FIELD(perp_matrix, values, 32, 8);
    FIELD(perp_matrix, column_starts, 40, 8);
    FIELD(perp_matrix, row_indices, 48, 8);
}

static void test_lcp_progress(void **state)
{
    (void)state;
    SIZE(perp_lcp_progress, 32);
    FIELD(perp_lcp_progress, struct_size, 0, 8);
    FIELD(perp_lcp_progress, method, 8, 4);
    FIELD(perp_lcp_progress, reserved, 12, 4);
    FIELD(perp_lcp_progress, iterations, 16, 8);
    FIELD(perp_lcp_progress, residual, 24, 8);
}

static void test_lcp_settings(void **state)
{
    (void)state;
    SIZE(perp_lcp_settings, 88);
    FIELD(perp_lcp_settings, struct_size, 0, 8);
    FIELD(perp_lcp_settings, method, 8, 4);
    FIELD(perp_lcp_settings, max_iterations, 12, 4);
    FIELD(perp_lcp_settings, tol, 16, 8);
    FIELD(perp_lcp_settings, time_limit, 24, 8);
    FIELD(perp_lcp_settings, relaxation, 32, 8);
    FIELD(perp_lcp_settings, pivot_rule, 40, 4);
    FIELD(perp_lcp_settings, scaling, 44, 4);
    FIELD(perp_lcp_settings, polish, 48, 4);
    FIELD(perp_lcp_settings, crash, 52, 4);
    FIELD(perp_lcp_settings, monitor, 56, 8);
    FIELD(perp_lcp_settings, monitor_user, 64, 8);
    FIELD(perp_lcp_settings, sweep, 72, 4);
    FIELD(perp_lcp_settings, acceleration, 76, 4);
    FIELD(perp_lcp_settings, penalty, 80, 8);
}

static void test_lcp_result(void **state)
{
    (void)state;
    SIZE(perp_lcp_result, 64);
    FIELD(perp_lcp_result, struct_size, 0, 8);
    FIELD(perp_lcp_result, outcome, 8, 4);
    FIELD(perp_lcp_result, method, 12, 4);
    FIELD(perp_lcp_result, iterations, 16, 8);
    FIELD(perp_lcp_result, residual, 24, 8);
    FIELD(perp_lcp_result, natural_residual, 32, 8);
    FIELD(perp_lcp_result, backward_error, 40, 8);
    FIELD(perp_lcp_result, seconds, 48, 8);
    FIELD(perp_lcp_result, certificate, 56, 4);
    FIELD(perp_lcp_result, has_ray, 60, 4);
}

static void test_lcp_proof(void **state)
{
    (void)state;
    SIZE(perp_lcp_proof, 24);
    FIELD(perp_lcp_proof, struct_size, 0, 8);
    FIELD(perp_lcp_proof, verdict, 8, 4);
    FIELD(perp_lcp_proof, index, 12, 4);
    FIELD(perp_lcp_proof, radius, 16, 8);
}

static void test_lcp_sensitivity_info(void **state)
{
    (void)state;
    SIZE(perp_lcp_sensitivity_info, 40);
    FIELD(perp_lcp_sensitivity_info, struct_size, 0, 8);
    FIELD(perp_lcp_sensitivity_info, verdict, 8, 4);
    FIELD(perp_lcp_sensitivity_info, index, 12, 4);
    FIELD(perp_lcp_sensitivity_info, active, 16, 4);
    FIELD(perp_lcp_sensitivity_info, reserved, 20, 4);
    FIELD(perp_lcp_sensitivity_info, margin, 24, 8);
    FIELD(perp_lcp_sensitivity_info, condition, 32, 8);
}

static void test_lcp_found(void **state)
{
    (void)state;
    SIZE(perp_lcp_found, 72);
    FIELD(perp_lcp_found, struct_size, 0, 8);
    FIELD(perp_lcp_found, dimension, 8, 4);
    FIELD(perp_lcp_found, vertex_count, 12, 4);
    FIELD(perp_lcp_found, ray_count, 16, 4);
    FIELD(perp_lcp_found, reserved, 20, 4);
    FIELD(perp_lcp_found, residual, 24, 8);
    FIELD(perp_lcp_found, z, 32, 8);
    FIELD(perp_lcp_found, w, 40, 8);
    FIELD(perp_lcp_found, places, 48, 8);
    FIELD(perp_lcp_found, vertices, 56, 8);
    FIELD(perp_lcp_found, rays, 64, 8);
}

static void test_lcp_enumeration(void **state)
{
    (void)state;
    SIZE(perp_lcp_enumeration, 56);
    FIELD(perp_lcp_enumeration, struct_size, 0, 8);
    FIELD(perp_lcp_enumeration, outcome, 8, 4);
    FIELD(perp_lcp_enumeration, isolated, 12, 4);
    FIELD(perp_lcp_enumeration, families, 16, 4);
    FIELD(perp_lcp_enumeration, reserved, 20, 4);
    FIELD(perp_lcp_enumeration, nodes, 24, 8);
    FIELD(perp_lcp_enumeration, bases, 32, 8);
    FIELD(perp_lcp_enumeration, singular, 40, 8);
    FIELD(perp_lcp_enumeration, seconds, 48, 8);
}

static void test_world_settings(void **state)
{
    (void)state;
    SIZE(perp_world_settings, 120);
    FIELD(perp_world_settings, struct_size, 0, 8);
    FIELD(perp_world_settings, gravity, 8, 24);
    FIELD(perp_world_settings, planar, 32, 4);
    FIELD(perp_world_settings, accuracy, 36, 4);
    FIELD(perp_world_settings, cone, 40, 4);
    FIELD(perp_world_settings, method, 44, 4);
    FIELD(perp_world_settings, substeps, 48, 4);
    FIELD(perp_world_settings, max_iterations, 52, 4);
    FIELD(perp_world_settings, strict, 56, 4);
    FIELD(perp_world_settings, wakeful, 60, 4);
    FIELD(perp_world_settings, tol, 64, 8);
    FIELD(perp_world_settings, time_limit, 72, 8);
    FIELD(perp_world_settings, friction, 80, 8);
    FIELD(perp_world_settings, error, 88, 8);
    FIELD(perp_world_settings, threads, 96, 4);
    FIELD(perp_world_settings, reserved, 100, 4);
    FIELD(perp_world_settings, run_tasks, 104, 8);
    FIELD(perp_world_settings, tasks_user, 112, 8);
}

static void test_body_settings(void **state)
{
    (void)state;
    SIZE(perp_body_settings, 208);
    FIELD(perp_body_settings, struct_size, 0, 8);
    FIELD(perp_body_settings, kind, 8, 4);
    FIELD(perp_body_settings, reserved, 12, 4);
    FIELD(perp_body_settings, mass, 16, 8);
    FIELD(perp_body_settings, inertia, 24, 72);
    FIELD(perp_body_settings, position, 96, 24);
    FIELD(perp_body_settings, orientation, 120, 32);
    FIELD(perp_body_settings, angle, 152, 8);
    FIELD(perp_body_settings, velocity, 160, 24);
    FIELD(perp_body_settings, angular_velocity, 184, 24);
}

static void test_body_state(void **state)
{
    (void)state;
    SIZE(perp_body_state, 168);
    FIELD(perp_body_state, struct_size, 0, 8);
    FIELD(perp_body_state, position, 8, 24);
    FIELD(perp_body_state, orientation, 32, 32);
    FIELD(perp_body_state, angle, 64, 8);
    FIELD(perp_body_state, velocity, 72, 24);
    FIELD(perp_body_state, angular_velocity, 96, 24);
    FIELD(perp_body_state, force, 120, 24);
    FIELD(perp_body_state, torque, 144, 24);
}

static void test_shape_settings(void **state)
{
    (void)state;
    SIZE(perp_shape_settings, 88);
    FIELD(perp_shape_settings, struct_size, 0, 8);
    FIELD(perp_shape_settings, friction, 8, 8);
    FIELD(perp_shape_settings, restitution, 16, 8);
    FIELD(perp_shape_settings, offset, 24, 24);
    FIELD(perp_shape_settings, rotation, 48, 32);
    FIELD(perp_shape_settings, density, 80, 8);
}

static void test_contact(void **state)
{
    (void)state;
    SIZE(perp_world_contact, 216);
    FIELD(perp_world_contact, struct_size, 0, 8);
    FIELD(perp_world_contact, body_a, 8, 8);
    FIELD(perp_world_contact, body_b, 16, 8);
    FIELD(perp_world_contact, shape_a, 24, 8);
    FIELD(perp_world_contact, shape_b, 32, 8);
    FIELD(perp_world_contact, position, 40, 24);
    FIELD(perp_world_contact, normal, 64, 24);
    FIELD(perp_world_contact, tangent_1, 88, 24);
    FIELD(perp_world_contact, tangent_2, 112, 24);
    FIELD(perp_world_contact, gap, 136, 8);
    FIELD(perp_world_contact, impulse, 144, 24);
    FIELD(perp_world_contact, velocity, 168, 24);
    FIELD(perp_world_contact, friction, 192, 8);
    FIELD(perp_world_contact, restitution, 200, 8);
    FIELD(perp_world_contact, mode, 208, 4);
    FIELD(perp_world_contact, reserved, 212, 4);
}

static void test_step_result(void **state)
{
    (void)state;
    SIZE(perp_step_result, 56);
    FIELD(perp_step_result, struct_size, 0, 8);
    FIELD(perp_step_result, outcome, 8, 4);
    FIELD(perp_step_result, advanced, 12, 4);
    FIELD(perp_step_result, iterations, 16, 8);
    FIELD(perp_step_result, residual, 24, 8);
    FIELD(perp_step_result, contacts, 32, 4);
    FIELD(perp_step_result, islands, 36, 4);
    FIELD(perp_step_result, steps, 40, 4);
    FIELD(perp_step_result, reserved, 44, 4);
    FIELD(perp_step_result, error, 48, 8);
}

static void test_world_stats(void **state)
{
    (void)state;
    SIZE(perp_world_stats, 104);
    FIELD(perp_world_stats, struct_size, 0, 8);
    FIELD(perp_world_stats, bodies, 8, 4);
    FIELD(perp_world_stats, shapes, 12, 4);
    FIELD(perp_world_stats, islands, 16, 4);
    FIELD(perp_world_stats, contacts, 20, 4);
    FIELD(perp_world_stats, rows_normal, 24, 4);
    FIELD(perp_world_stats, rows_friction, 28, 4);
    FIELD(perp_world_stats, impacts, 32, 4);
    FIELD(perp_world_stats, iterations, 40, 8);
    FIELD(perp_world_stats, steps, 48, 8);
    FIELD(perp_world_stats, residual, 56, 8);
    FIELD(perp_world_stats, seconds_collide, 64, 8);
    FIELD(perp_world_stats, seconds_solve, 72, 8);
    FIELD(perp_world_stats, seconds_integrate, 80, 8);
    FIELD(perp_world_stats, seconds_project, 88, 8);
    FIELD(perp_world_stats, joints, 96, 4);
    FIELD(perp_world_stats, rows_joint, 100, 4);
}

static void test_world_states(void **state)
{
    (void)state;
    SIZE(perp_world_states, 72);
    FIELD(perp_world_states, struct_size, 0, 8);
    FIELD(perp_world_states, slots, 8, 4);
    FIELD(perp_world_states, reserved, 12, 4);
    FIELD(perp_world_states, pose_stride, 16, 8);
    FIELD(perp_world_states, twist_stride, 24, 8);
    FIELD(perp_world_states, position, 32, 8);
    FIELD(perp_world_states, orientation, 40, 8);
    FIELD(perp_world_states, angle, 48, 8);
    FIELD(perp_world_states, velocity, 56, 8);
    FIELD(perp_world_states, angular_velocity, 64, 8);
}

static void test_status_values(void **state)
{
    (void)state;
    VALUE(PERP_OK, 0);
    VALUE(PERP_ERROR_ARGUMENT, -1);
    VALUE(PERP_ERROR_NOT_FINITE, -2);
    VALUE(PERP_ERROR_MEMORY, -3);
    VALUE(PERP_ERROR_ABI, -4);
    VALUE(PERP_ERROR_HANDLE, -5);
    VALUE(PERP_ERROR_BUSY, -6);
    VALUE(PERP_ERROR_CALLBACK, -7);
}

static void test_outcome_values(void **state)
{
    (void)state;
    VALUE(PERP_OUTCOME_SOLVED, 0);
    VALUE(PERP_OUTCOME_ROUNDING_LIMIT, 1);
    VALUE(PERP_OUTCOME_RAY, 2);
    VALUE(PERP_OUTCOME_ITERATION_LIMIT, 3);
    VALUE(PERP_OUTCOME_TIME_LIMIT, 4);
    VALUE(PERP_OUTCOME_STALLED, 5);
    VALUE(PERP_OUTCOME_SINGULAR, 6);
    VALUE(PERP_OUTCOME_STOPPED, 7);
    VALUE(PERP_OUTCOME_EVALUATION_FAILED, 8);
}

static void test_other_values(void **state)
{
    (void)state;
    VALUE(PERP_STORAGE_COLUMN_MAJOR, 0);
    VALUE(PERP_STORAGE_ROW_MAJOR, 1);
    VALUE(PERP_STORAGE_CSC, 2);
    VALUE(PERP_LCP_AUTO, 0);
    VALUE(PERP_LCP_LEMKE, 1);
    VALUE(PERP_LCP_PGS, 2);
    VALUE(PERP_LCP_FISCHER, 3);
    VALUE(PERP_LCP_POLISH, 4);
    VALUE(PERP_LCP_PATTERNS, 6);
    VALUE(PERP_LCP_MPRGP, 7);
    VALUE(PERP_LCP_ACTIVE_SET, 5);
    VALUE(PERP_SWEEP_FORWARD, 0);
    VALUE(PERP_SWEEP_SYMMETRIC, 1);
    VALUE(PERP_ACCELERATION_NONE, 0);
    VALUE(PERP_ACCELERATION_CONJUGATE_GRADIENT, 1);
    VALUE(PERP_PIVOT_HARRIS, 0);
    VALUE(PERP_PIVOT_LEXICOGRAPHIC, 1);
    VALUE(PERP_CERTIFICATE_NONE, 0);
    VALUE(PERP_CERTIFICATE_INFEASIBLE, 1);
    VALUE(PERP_VERDICT_REGULAR, 0);
    VALUE(PERP_VERDICT_NOT_A_SOLUTION, 1);
    VALUE(PERP_VERDICT_SINGULAR, 2);
    VALUE(PERP_VERDICT_DEGENERATE, 3);
    VALUE(PERP_VERDICT_TOO_LARGE, 4);
    VALUE(PERP_PLACE_LOWER, 0);
    VALUE(PERP_PLACE_UPPER, 1);
    VALUE(PERP_PLACE_BETWEEN, 2);
    VALUE(PERP_PLACE_FIXED, 3);
    VALUE(PERP_BODY_DYNAMIC, 0);
    VALUE(PERP_BODY_STATIC, 1);
    VALUE(PERP_BODY_KINEMATIC, 2);
    VALUE(PERP_ACCURACY_FAST, 0);
    VALUE(PERP_ACCURACY_STANDARD, 1);
    VALUE(PERP_ACCURACY_ACCURATE, 2);
    VALUE(PERP_ACCURACY_EXACT, 3);
    VALUE(PERP_CONTACT_SEPARATE, 0);
    VALUE(PERP_CONTACT_STICK, 1);
    VALUE(PERP_CONTACT_SLIP, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_context_settings),
        cmocka_unit_test(test_matrix),
        cmocka_unit_test(test_lcp_progress),
        cmocka_unit_test(test_lcp_settings),
        cmocka_unit_test(test_lcp_result),
        cmocka_unit_test(test_lcp_proof),
        cmocka_unit_test(test_lcp_found),
        cmocka_unit_test(test_lcp_enumeration),
        cmocka_unit_test(test_lcp_sensitivity_info),
        cmocka_unit_test(test_world_settings),
        cmocka_unit_test(test_body_settings),
        cmocka_unit_test(test_body_state),
        cmocka_unit_test(test_shape_settings),
        cmocka_unit_test(test_contact),
        cmocka_unit_test(test_step_result),
        cmocka_unit_test(test_world_stats),
        cmocka_unit_test(test_world_states),
        cmocka_unit_test(test_status_values),
        cmocka_unit_test(test_outcome_values),
        cmocka_unit_test(test_other_values),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
