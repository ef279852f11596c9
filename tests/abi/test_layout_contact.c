/* The binary interface of perp/contact.h, pinned: see test_layout.c. */
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

static void test_contact_laws(void **state)
{
    (void)state;
    SIZE(perp_contact_laws, 88);
    FIELD(perp_contact_laws, struct_size, 0, 8);
    FIELD(perp_contact_laws, contacts, 8, 4);
    FIELD(perp_contact_laws, dim, 12, 4);
    FIELD(perp_contact_laws, dims, 16, 8);
    FIELD(perp_contact_laws, mu, 24, 8);
    FIELD(perp_contact_laws, rolling, 32, 8);
    FIELD(perp_contact_laws, spinning, 40, 8);
    FIELD(perp_contact_laws, compliance, 48, 8);
    FIELD(perp_contact_laws, bilateral, 56, 4);
    FIELD(perp_contact_laws, bounded, 60, 4);
    FIELD(perp_contact_laws, lower, 64, 8);
    FIELD(perp_contact_laws, upper, 72, 8);
    FIELD(perp_contact_laws, two_sided, 80, 8);
}

static void test_contact_dynamics(void **state)
{
    (void)state;
    SIZE(perp_contact_dynamics, 56);
    FIELD(perp_contact_dynamics, struct_size, 0, 8);
    FIELD(perp_contact_dynamics, n, 8, 4);
    FIELD(perp_contact_dynamics, reserved, 12, 4);
    FIELD(perp_contact_dynamics, M, 16, 8);
    FIELD(perp_contact_dynamics, solve, 24, 8);
    FIELD(perp_contact_dynamics, user, 32, 8);
    FIELD(perp_contact_dynamics, H, 40, 8);
    FIELD(perp_contact_dynamics, G, 48, 8);
}

static void test_contact_progress(void **state)
{
    (void)state;
    SIZE(perp_contact_progress, 32);
    FIELD(perp_contact_progress, struct_size, 0, 8);
    FIELD(perp_contact_progress, method, 8, 4);
    FIELD(perp_contact_progress, reserved, 12, 4);
    FIELD(perp_contact_progress, iterations, 16, 8);
    FIELD(perp_contact_progress, residual, 24, 8);
}

static void test_contact_settings(void **state)
{
    (void)state;
    SIZE(perp_contact_settings, 56);
    FIELD(perp_contact_settings, struct_size, 0, 8);
    FIELD(perp_contact_settings, method, 8, 4);
    FIELD(perp_contact_settings, cone, 12, 4);
    FIELD(perp_contact_settings, tol, 16, 8);
    FIELD(perp_contact_settings, max_iterations, 24, 4);
    FIELD(perp_contact_settings, raw_velocity, 28, 4);
    FIELD(perp_contact_settings, time_limit, 32, 8);
    FIELD(perp_contact_settings, monitor, 40, 8);
    FIELD(perp_contact_settings, monitor_user, 48, 8);
}

static void test_contact_step(void **state)
{
    (void)state;
    SIZE(perp_contact_watch, 32);
    FIELD(perp_contact_watch, at, 0, 8);
    FIELD(perp_contact_watch, seen, 8, 8);
    FIELD(perp_contact_watch, count, 16, 4);
    FIELD(perp_contact_watch, offset, 20, 4);
    FIELD(perp_contact_watch, stride, 24, 4);
    FIELD(perp_contact_watch, bytes, 28, 4);
    SIZE(perp_contact_step, 416);
    FIELD(perp_contact_step, struct_size, 0, 8);
    FIELD(perp_contact_step, n, 8, 4);
    FIELD(perp_contact_step, contacts, 12, 4);
    FIELD(perp_contact_step, rows, 16, 4);
    FIELD(perp_contact_step, bilateral, 20, 4);
    FIELD(perp_contact_step, M_entries, 24, 4);
    FIELD(perp_contact_step, H_entries, 28, 4);
    FIELD(perp_contact_step, G_entries, 32, 4);
    FIELD(perp_contact_step, gap_count, 36, 4);
    FIELD(perp_contact_step, J_rows, 40, 4);
    FIELD(perp_contact_step, warm, 44, 4);
    FIELD(perp_contact_step, rests, 48, 4);
    FIELD(perp_contact_step, h, 56, 8);
    FIELD(perp_contact_step, correction, 64, 8);
    FIELD(perp_contact_step, mass, 72, 8);
    FIELD(perp_contact_step, damping, 80, 8);
    FIELD(perp_contact_step, velocity, 88, 8);
    FIELD(perp_contact_step, force, 96, 8);
    FIELD(perp_contact_step, J, 104, 8);
    FIELD(perp_contact_step, gaps, 112, 8);
    FIELD(perp_contact_step, row_force, 120, 8);
    FIELD(perp_contact_step, mass_sources, 128, 8);
    FIELD(perp_contact_step, mass_diagonal, 136, 8);
    FIELD(perp_contact_step, H_sources, 144, 8);
    FIELD(perp_contact_step, G_sources, 152, 8);
    FIELD(perp_contact_step, H_scale, 160, 8);
    FIELD(perp_contact_step, gap_rows, 168, 8);
    FIELD(perp_contact_step, gap_sources, 176, 8);
    FIELD(perp_contact_step, H_rows, 184, 8);
    FIELD(perp_contact_step, G_rows, 192, 8);
    FIELD(perp_contact_step, row_scale, 200, 8);
    FIELD(perp_contact_step, M, 208, 8);
    FIELD(perp_contact_step, H, 216, 8);
    FIELD(perp_contact_step, G, 224, 8);
    FIELD(perp_contact_step, f, 232, 8);
    FIELD(perp_contact_step, w, 240, 8);
    FIELD(perp_contact_step, b, 248, 8);
    FIELD(perp_contact_step, v, 256, 8);
    FIELD(perp_contact_step, r, 264, 8);
    FIELD(perp_contact_step, u, 272, 8);
    FIELD(perp_contact_step, start, 280, 8);
    FIELD(perp_contact_step, modes, 288, 8);
    FIELD(perp_contact_step, watches, 296, 8);
    FIELD(perp_contact_step, watch_count, 304, 4);
    FIELD(perp_contact_step, is_other, 308, 4);
    FIELD(perp_contact_step, acceleration, 312, 8);
    FIELD(perp_contact_step, force_of_rows, 320, 8);
    FIELD(perp_contact_step, least_gap, 328, 8);
    FIELD(perp_contact_step, fastest, 336, 8);
    FIELD(perp_contact_step, slips, 344, 4);
    FIELD(perp_contact_step, was_known, 348, 4);
    FIELD(perp_contact_step, by_rows, 352, 4);
    FIELD(perp_contact_step, shifts, 356, 4);
    FIELD(perp_contact_step, slop, 360, 8);
    FIELD(perp_contact_step, driven, 368, 8);
    FIELD(perp_contact_step, shift, 376, 8);
    FIELD(perp_contact_step, source, 384, 8);
    FIELD(perp_contact_step, first, 392, 8);
    FIELD(perp_contact_step, restitution, 400, 8);
    FIELD(perp_contact_step, speeds, 408, 8);
}

static void test_contact_run(void **state)
{
    (void)state;
    SIZE(perp_contact_source, 72);
    FIELD(perp_contact_source, struct_size, 0, 8);
    FIELD(perp_contact_source, counts, 8, 8);
    FIELD(perp_contact_source, contacts, 16, 8);
    FIELD(perp_contact_source, stride, 24, 4);
    FIELD(perp_contact_source, geoms_at, 28, 4);
    FIELD(perp_contact_source, row_at, 32, 4);
    FIELD(perp_contact_source, dim_at, 36, 4);
    FIELD(perp_contact_source, friction_at, 40, 4);
    FIELD(perp_contact_source, surface_at, 44, 4);
    FIELD(perp_contact_source, kinds, 48, 8);
    FIELD(perp_contact_source, ids, 56, 8);
    FIELD(perp_contact_source, bounds, 64, 8);
    SIZE(perp_contact_copy, 24);
    FIELD(perp_contact_copy, to, 0, 8);
    FIELD(perp_contact_copy, source, 8, 8);
    FIELD(perp_contact_copy, count, 16, 4);
    FIELD(perp_contact_copy, stride, 20, 4);
    SIZE(perp_contact_run, 248);
    FIELD(perp_contact_run, struct_size, 0, 8);
    FIELD(perp_contact_run, model, 8, 8);
    FIELD(perp_contact_run, data, 16, 8);
    FIELD(perp_contact_run, before, 24, 8);
    FIELD(perp_contact_run, after, 32, 8);
    FIELD(perp_contact_run, advance, 40, 8);
    FIELD(perp_contact_run, before_count, 48, 4);
    FIELD(perp_contact_run, after_count, 52, 4);
    FIELD(perp_contact_run, advance_count, 56, 4);
    FIELD(perp_contact_run, places, 60, 4);
    FIELD(perp_contact_run, metric, 64, 8);
    FIELD(perp_contact_run, metric_M, 72, 8);
    FIELD(perp_contact_run, metric_D, 80, 8);
    FIELD(perp_contact_run, metric_mass, 88, 8);
    FIELD(perp_contact_run, metric_places, 96, 8);
    FIELD(perp_contact_run, metric_count, 104, 4);
    FIELD(perp_contact_run, kept_count, 108, 4);
    FIELD(perp_contact_run, kept, 112, 8);
    FIELD(perp_contact_run, place, 120, 8);
    FIELD(perp_contact_run, velocity, 128, 8);
    FIELD(perp_contact_run, time, 136, 8);
    FIELD(perp_contact_run, room, 144, 8);
    FIELD(perp_contact_run, integrate, 152, 8);
    FIELD(perp_contact_run, inputs, 160, 8);
    FIELD(perp_contact_run, outputs, 168, 8);
    FIELD(perp_contact_run, input_count, 176, 4);
    FIELD(perp_contact_run, output_count, 180, 4);
    FIELD(perp_contact_run, steps, 184, 4);
    FIELD(perp_contact_run, done, 188, 4);
    FIELD(perp_contact_run, phase, 192, 4);
    FIELD(perp_contact_run, wait, 196, 4);
    FIELD(perp_contact_run, patience, 200, 4);
    FIELD(perp_contact_run, look_slip, 208, 8);
    FIELD(perp_contact_run, look_rest, 216, 8);
    FIELD(perp_contact_run, drive, 224, 8);
    FIELD(perp_contact_run, unsolved, 232, 8);
    FIELD(perp_contact_run, residual, 240, 8);
}

static void test_contact_result(void **state)
{
    (void)state;
    SIZE(perp_contact_result, 112);
    FIELD(perp_contact_result, struct_size, 0, 8);
    FIELD(perp_contact_result, outcome, 8, 4);
    FIELD(perp_contact_result, method, 12, 4);
    FIELD(perp_contact_result, iterations, 16, 8);
    FIELD(perp_contact_result, residual, 24, 8);
    FIELD(perp_contact_result, natural_residual, 32, 8);
    FIELD(perp_contact_result, backward_error, 40, 8);
    FIELD(perp_contact_result, signorini_velocity, 48, 8);
    FIELD(perp_contact_result, signorini_impulse, 56, 8);
    FIELD(perp_contact_result, cone, 64, 8);
    FIELD(perp_contact_result, dissipation_velocity, 72, 8);
    FIELD(perp_contact_result, dissipation_impulse, 80, 8);
    FIELD(perp_contact_result, bilateral, 88, 8);
    FIELD(perp_contact_result, seconds, 96, 8);
    FIELD(perp_contact_result, certificate, 104, 4);
    FIELD(perp_contact_result, has_ray, 108, 4);
}

static void test_contact_sensitivity_info(void **state)
{
    (void)state;
    SIZE(perp_contact_sensitivity_info, 40);
    FIELD(perp_contact_sensitivity_info, struct_size, 0, 8);
    FIELD(perp_contact_sensitivity_info, verdict, 8, 4);
    FIELD(perp_contact_sensitivity_info, index, 12, 4);
    FIELD(perp_contact_sensitivity_info, active, 16, 4);
    FIELD(perp_contact_sensitivity_info, reserved, 20, 4);
    FIELD(perp_contact_sensitivity_info, margin, 24, 8);
    FIELD(perp_contact_sensitivity_info, condition, 32, 8);
}

static void test_values(void **state)
{
    (void)state;
    VALUE(PERP_CONTACT_SEPARATE, 0);
    VALUE(PERP_CONTACT_STICK, 1);
    VALUE(PERP_CONTACT_SLIP, 2);
    VALUE(PERP_CONTACT_LOWER, 3);
    VALUE(PERP_CONTACT_UPPER, 4);
    VALUE(PERP_CONTACT_WAIT_DONE, 0);
    VALUE(PERP_CONTACT_WAIT_OTHER, 1);
    VALUE(PERP_CONTACT_WAIT_LOOK, 2);
    VALUE(PERP_CONTACT_PHASE_BEGIN, 0);
    VALUE(PERP_CONTACT_PHASE_SOLVE, 1);
    VALUE(PERP_CONTACT_PHASE_MOVE, 2);
    VALUE(PERP_CONTACT_METHOD_AUTO, 0);
    VALUE(PERP_CONTACT_METHOD_SWEEP, 1);
    VALUE(PERP_CONTACT_METHOD_NEWTON, 2);
    VALUE(PERP_CONTACT_METHOD_LEMKE, 3);
    VALUE(PERP_CONTACT_METHOD_POLISH, 4);
    VALUE(PERP_CONTACT_METHOD_ADMM, 5);
    VALUE(PERP_CONTACT_METHOD_PROXIMAL, 6);
    VALUE(PERP_CONTACT_CERTIFICATE_NONE, 0);
    VALUE(PERP_CONTACT_CERTIFICATE_INFEASIBLE, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_contact_laws),     cmocka_unit_test(test_contact_dynamics),
        cmocka_unit_test(test_contact_progress), cmocka_unit_test(test_contact_settings),
        cmocka_unit_test(test_contact_result),   cmocka_unit_test(test_contact_step),
        cmocka_unit_test(test_contact_run),      cmocka_unit_test(test_contact_sensitivity_info),
        cmocka_unit_test(test_values),
    };

    if (sizeof(void *) != 8 || sizeof(long) != 8)
        return 0;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
