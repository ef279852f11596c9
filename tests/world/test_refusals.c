/* What a world refuses: the status, a message that names the argument, and nothing changed. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "world/scene.h"

/* The call fails with `status` and a message that contains `words`. */
#define REFUSED(s, call, status, words)                                                           \
    do {                                                                                          \
        perp_status refused = (call);                                                             \
        const char *message = perp_context_message((s)->context);                                 \
        if (refused != (status) || !strstr(message, (words)))                                     \
            fail_msg("%s gave %s: '%s', expected %s with '%s'", #call, perp_status_text(refused), \
                     message, perp_status_text(status), words);                                   \
    } while (0)

static void test_world_settings(void **state)
{
    perp_world_settings settings;
    perp_world *world = NULL;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
#define FRESH(planar) \
    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, planar), 0)
#define WORLD_REFUSED(status, words) \
    REFUSED(&s, perp_world_create(s.context, &world, &settings), status, words)
    FRESH(0);
    settings.gravity[1] = NAN;
    WORLD_REFUSED(PERP_ERROR_NOT_FINITE, "gravity[1]");
    FRESH(0);
    settings.cone = 7;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "cone");
    settings.cone = 2;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "cone");
    settings.cone = 66;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "cone");
    FRESH(0);
    settings.accuracy = 4;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "accuracy");
    settings.accuracy = -1;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "accuracy");
    FRESH(0);
    settings.substeps = -1;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "substeps");
    FRESH(0);
    settings.planar = 2;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "planar");
    FRESH(1);
    settings.gravity[2] = 1.0;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "gravity[2]");
    FRESH(0);
    settings.strict = -1;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "strict");
    FRESH(0);
    settings.method = 99;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "method");
    FRESH(0);
    settings.tol = -1.0;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "tol");
    settings.tol = NAN;
    WORLD_REFUSED(PERP_ERROR_NOT_FINITE, "tol");
    FRESH(0);
    settings.time_limit = -1.0;
    WORLD_REFUSED(PERP_ERROR_ARGUMENT, "time_limit");
    FRESH(0);
    settings.struct_size = 3;
    WORLD_REFUSED(PERP_ERROR_ABI, "settings.struct_size");
    assert_null(world);
    FRESH(0);
    REFUSED(&s, perp_world_create(s.context, NULL, &settings), PERP_ERROR_ARGUMENT, "world");
    scene_close(&s);
}

static void test_body_settings(void **state)
{
    perp_body_settings settings;
    perp_body body = 77;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
#define BODY_REFUSED(status, words) \
    REFUSED(&s, perp_world_add_body(s.world, &body, &settings), status, words)
    settings = scene_settings();
    settings.mass = -1.0;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "settings.mass");
    settings.mass = INFINITY;
    BODY_REFUSED(PERP_ERROR_NOT_FINITE, "settings.mass");
    settings = scene_settings();
    settings.inertia[1] = 0.5;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "symmetric");
    settings.inertia[3] = 0.5;
    settings.inertia[0] = NAN;
    BODY_REFUSED(PERP_ERROR_NOT_FINITE, "settings.inertia[0]");
    settings = scene_settings();
    settings.inertia[4] = -1.0;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "positive definite");
    settings = scene_settings();
    settings.inertia[8] = 0.0;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "positive definite");
    settings = scene_settings();
    settings.inertia[8] = 2.1;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "triangle");
    settings = scene_settings();
    settings.orientation[0] = 1.0 + 2e-6;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "orientation");
    settings.orientation[0] = NAN;
    BODY_REFUSED(PERP_ERROR_NOT_FINITE, "orientation[0]");
    settings = scene_settings();
    settings.position[2] = INFINITY;
    BODY_REFUSED(PERP_ERROR_NOT_FINITE, "settings.position[2]");
    settings = scene_settings();
    settings.velocity[1] = NAN;
    BODY_REFUSED(PERP_ERROR_NOT_FINITE, "settings.velocity[1]");
    settings = scene_settings();
    settings.angular_velocity[0] = NAN;
    BODY_REFUSED(PERP_ERROR_NOT_FINITE, "settings.angular_velocity[0]");
    settings = scene_settings();
    settings.kind = 3;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "settings.kind");
    settings = scene_settings();
    settings.kind = PERP_BODY_STATIC;
    settings.velocity[0] = 1.0;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "static");
    settings = scene_settings();
    REFUSED(&s, perp_world_add_body(s.world, NULL, &settings), PERP_ERROR_ARGUMENT, "body");
    assert_true(body == 77);
    scene_close(&s);
}

/* On the edge of what is allowed. */
static void test_body_settings_allowed(void **state)
{
    perp_body_settings settings = scene_settings();
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    settings.inertia[8] = 2.0; /* a plate */
    scene_add(&s, &settings);
    settings.inertia[0] = settings.inertia[4] = 1e-200;
    settings.inertia[8] = 2e-200;
    settings.mass = 1e-200;
    scene_add(&s, &settings);
    settings = scene_settings();
    settings.inertia[1] = settings.inertia[3] = 0.25;
    settings.inertia[5] = settings.inertia[7] = -0.25;
    settings.orientation[0] = 1.0 + 5e-7;
    assert_true(scene_state(&s, scene_add(&s, &settings)).orientation[0] == 1.0);
    settings = scene_settings();
    settings.kind = PERP_BODY_KINEMATIC;
    settings.mass = -1.0; /* ignored */
    settings.inertia[0] = NAN;
    scene_add(&s, &settings);
    scene_close(&s);
}

static void test_planar_inputs(void **state)
{
    perp_body_settings settings;
    perp_shape_settings material = scene_material(0.5, 0.0);
    perp_body_state now;
    const double up[3] = {0.0, 1.0, 0.0}, out[3] = {0.0, 0.0, 1.0}, half[2] = {1.0, 1.0};
    perp_body body, good;
    scene s;

    (void)state;
    scene_open(&s, 1, 0.0, -GRAVITY, 0.0);
    settings = scene_settings();
    settings.position[2] = 1.0;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "settings.position[2]");
    settings = scene_settings();
    settings.velocity[2] = 1.0;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "settings.velocity[2]");
    settings = scene_settings();
    settings.angular_velocity[1] = 1.0;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "settings.angular_velocity[1]");
    settings = scene_settings();
    settings.angle = INFINITY;
    BODY_REFUSED(PERP_ERROR_NOT_FINITE, "angle");
    settings = scene_settings();
    settings.inertia[8] = -1.0;
    BODY_REFUSED(PERP_ERROR_ARGUMENT, "settings.inertia[8]");
    settings = scene_settings();
    settings.inertia[0] = -1.0; /* not of the plane: ignored */
    good = scene_add(&s, &settings);
    now = scene_state(&s, good);
    now.force[2] = 1.0;
    REFUSED(&s, perp_world_set_body(s.world, &now, good), PERP_ERROR_ARGUMENT, "state.force[2]");
    now.force[2] = 0.0;
    now.torque[0] = 1.0;
    REFUSED(&s, perp_world_set_body(s.world, &now, good), PERP_ERROR_ARGUMENT, "state.torque[0]");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, s.ground, out, 0.0, NULL), PERP_ERROR_ARGUMENT,
            "normal[2]");
    material.offset[2] = 1.0;
    REFUSED(&s, perp_world_add_sphere(s.world, NULL, good, 1.0, &material), PERP_ERROR_ARGUMENT,
            "settings.offset[2]");
    material.offset[2] = 0.0;
    material.rotation[0] = 0.6;
    material.rotation[1] = 0.8;
    REFUSED(&s, perp_world_add_box(s.world, NULL, good, half, &material), PERP_ERROR_ARGUMENT,
            "rotation");
    material.rotation[1] = 0.0;
    material.rotation[3] = 0.8;
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, good, half, &material));
    SCENE_OK(&s, perp_world_add_plane(s.world, NULL, s.ground, up, -10.0, NULL));
    scene_close(&s);
}

static void test_shapes(void **state)
{
    const double half[3] = {1.0, 0.0, 1.0}, zero[3] = {0.0, 0.0, 0.0}, up[3] = {0.0, 0.0, 1.0};
    const double bad[3] = {1.0, NAN, 1.0};
    perp_body_settings settings = scene_settings();
    perp_shape_settings material;
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    body = scene_add(&s, &settings);
#define SPHERE_REFUSED(status, words) \
    REFUSED(&s, perp_world_add_sphere(s.world, NULL, body, 1.0, &material), status, words)
    material = scene_material(-0.1, 0.0);
    SPHERE_REFUSED(PERP_ERROR_ARGUMENT, "settings.friction");
    material = scene_material(INFINITY, 0.0);
    SPHERE_REFUSED(PERP_ERROR_NOT_FINITE, "settings.friction");
    material = scene_material(0.0, 1.1);
    SPHERE_REFUSED(PERP_ERROR_ARGUMENT, "settings.restitution");
    material = scene_material(0.0, -0.1);
    SPHERE_REFUSED(PERP_ERROR_ARGUMENT, "settings.restitution");
    material = scene_material(0.0, 0.0);
    material.offset[0] = NAN;
    SPHERE_REFUSED(PERP_ERROR_NOT_FINITE, "settings.offset[0]");
    material = scene_material(0.0, 0.0);
    material.rotation[2] = 1.0;
    SPHERE_REFUSED(PERP_ERROR_ARGUMENT, "settings.rotation");
    material = scene_material(1e3, 1.0);
    SCENE_OK(&s, perp_world_add_sphere(s.world, NULL, body, 0.0, &material));
    REFUSED(&s, perp_world_add_sphere(s.world, NULL, body, -1.0, NULL), PERP_ERROR_ARGUMENT,
            "radius");
    REFUSED(&s, perp_world_add_sphere(s.world, NULL, body, NAN, NULL), PERP_ERROR_NOT_FINITE,
            "radius");
    REFUSED(&s, perp_world_add_box(s.world, NULL, body, half, NULL), PERP_ERROR_ARGUMENT,
            "half_extents[1]");
    REFUSED(&s, perp_world_add_box(s.world, NULL, body, bad, NULL), PERP_ERROR_NOT_FINITE,
            "half_extents[1]");
    REFUSED(&s, perp_world_add_box(s.world, NULL, body, NULL, NULL), PERP_ERROR_ARGUMENT,
            "half_extents");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, s.ground, zero, 0.0, NULL), PERP_ERROR_ARGUMENT,
            "normal");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, s.ground, bad, 0.0, NULL),
            PERP_ERROR_NOT_FINITE, "normal[1]");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, s.ground, up, INFINITY, NULL),
            PERP_ERROR_NOT_FINITE, "offset");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, body, up, 0.0, NULL), PERP_ERROR_ARGUMENT,
            "half-space");
    scene_close(&s);
}

static void test_ids(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_body a, b;
    perp_shape shape = 0;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    assert_int_equal(perp_body_state_init(&now, sizeof now), PERP_OK);
    a = scene_add(&s, &settings);
    SCENE_OK(&s, perp_world_add_sphere(s.world, &shape, a, 1.0, NULL));
    assert_true(shape != 0);
    SCENE_OK(&s, perp_world_remove_body(s.world, a));
    REFUSED(&s, perp_world_get_body(s.world, &now, a), PERP_ERROR_HANDLE, "body");
    REFUSED(&s, perp_world_set_body(s.world, &now, a), PERP_ERROR_HANDLE, "body");
    REFUSED(&s, perp_world_remove_body(s.world, a), PERP_ERROR_HANDLE, "body");
    b = scene_add(&s, &settings); /* in the same slot */
    assert_true(a != b && (a & 0xffffffffu) == (b & 0xffffffffu));
    REFUSED(&s, perp_world_get_body(s.world, &now, a), PERP_ERROR_HANDLE, "removed");
    REFUSED(&s, perp_world_add_sphere(s.world, NULL, a, 1.0, NULL), PERP_ERROR_HANDLE, "body");
    SCENE_OK(&s, perp_world_get_body(s.world, &now, b));
    REFUSED(&s, perp_world_get_body(s.world, &now, 0), PERP_ERROR_HANDLE, "null");
    REFUSED(&s, perp_world_get_body(s.world, &now, b + 5), PERP_ERROR_HANDLE, "not a body");
    REFUSED(&s, perp_world_get_body(s.world, &now, UINT64_MAX), PERP_ERROR_HANDLE, "body");
    REFUSED(&s, perp_world_remove_body(s.world, s.ground), PERP_ERROR_ARGUMENT, "ground");
    scene_close(&s);
}

static void test_states(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state now, before;
    const double bad[3] = {0.0, NAN, 0.0};
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    body = scene_add(&s, &settings);
    before = scene_state(&s, body);
#define STATE_REFUSED(status, words) \
    REFUSED(&s, perp_world_set_body(s.world, &now, body), status, words)
    now = before;
    now.position[1] = NAN;
    STATE_REFUSED(PERP_ERROR_NOT_FINITE, "state.position[1]");
    now = before;
    now.orientation[0] = 0.5;
    STATE_REFUSED(PERP_ERROR_ARGUMENT, "orientation");
    now = before;
    now.velocity[2] = INFINITY;
    STATE_REFUSED(PERP_ERROR_NOT_FINITE, "state.velocity[2]");
    now = before;
    now.force[0] = NAN;
    STATE_REFUSED(PERP_ERROR_NOT_FINITE, "state.force[0]");
    now = before;
    now.torque[2] = NAN;
    STATE_REFUSED(PERP_ERROR_NOT_FINITE, "state.torque[2]");
    now = before;
    now.struct_size = 0;
    STATE_REFUSED(PERP_ERROR_ABI, "state.struct_size");
    REFUSED(&s, perp_world_set_gravity(s.world, NULL), PERP_ERROR_ARGUMENT, "gravity");
    REFUSED(&s, perp_world_set_gravity(s.world, bad), PERP_ERROR_NOT_FINITE, "gravity[1]");
    REFUSED(&s, perp_world_set_body(s.world, NULL, body), PERP_ERROR_ARGUMENT, "state");
    REFUSED(&s, perp_world_get_body(s.world, NULL, body), PERP_ERROR_ARGUMENT, "state");
    now = scene_state(&s, body);
    assert_memory_equal(&now, &before, sizeof now);

    now = scene_state(&s, s.ground);
    now.position[0] = 1.0;
    SCENE_OK(&s, perp_world_set_body(s.world, &now, s.ground));
    now.velocity[0] = 1.0;
    REFUSED(&s, perp_world_set_body(s.world, &now, s.ground), PERP_ERROR_ARGUMENT, "static");
    now.velocity[0] = 0.0;
    now.torque[0] = 1.0;
    REFUSED(&s, perp_world_set_body(s.world, &now, s.ground), PERP_ERROR_ARGUMENT, "static");
    scene_close(&s);
}

static void test_steps(void **state)
{
    perp_step_result result;
    perp_world_stats stats;
    perp_world_contact contact;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    REFUSED(&s, perp_world_step(s.world, NULL, 0.0), PERP_ERROR_ARGUMENT, "dt");
    REFUSED(&s, perp_world_step(s.world, NULL, -0.1), PERP_ERROR_ARGUMENT, "dt");
    REFUSED(&s, perp_world_step(s.world, NULL, NAN), PERP_ERROR_NOT_FINITE, "dt");
    REFUSED(&s, perp_world_step(s.world, NULL, INFINITY), PERP_ERROR_NOT_FINITE, "dt");
    memset(&result, 0, sizeof result);
    REFUSED(&s, perp_world_step(s.world, &result, 0.1), PERP_ERROR_ABI, "result.struct_size");
    assert_int_equal(perp_world_contact_init(&contact, sizeof contact), PERP_OK);
    REFUSED(&s, perp_world_get_contact(s.world, &contact, 0), PERP_ERROR_ARGUMENT, "index");
    REFUSED(&s, perp_world_get_contact(s.world, &contact, -1), PERP_ERROR_ARGUMENT, "index");
    memset(&stats, 0, sizeof stats);
    REFUSED(&s, perp_world_get_stats(s.world, &stats), PERP_ERROR_ABI, "stats.struct_size");
    assert_int_equal(perp_world_stats_init(&stats, sizeof stats), PERP_OK);
    SCENE_OK(&s, perp_world_get_stats(s.world, &stats));
    assert_int_equal(stats.steps, 0);
    scene_close(&s);
}

static void test_snapshots(void **state)
{
    perp_body_settings settings = scene_settings();
    char blob[2048], other[2048];
    size_t size;
    perp_body body;
    scene s, t;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    scene_open(&t, 0, 0.0, 0.0, 0.0);
    body = scene_add(&s, &settings);
    scene_add(&t, &settings);
    SCENE_OK(&s, perp_world_snapshot_size(s.world, &size));
    assert_true(size <= sizeof blob);
    REFUSED(&s, perp_world_snapshot_size(s.world, NULL), PERP_ERROR_ARGUMENT, "size");
    REFUSED(&s, perp_world_snapshot_save(s.world, blob, size - 1), PERP_ERROR_ARGUMENT, "size");
    REFUSED(&s, perp_world_snapshot_save(s.world, NULL, size), PERP_ERROR_ARGUMENT, "blob");
    SCENE_OK(&s, perp_world_snapshot_save(s.world, blob, size));
    SCENE_OK(&t, perp_world_snapshot_save(t.world, other, size));
    REFUSED(&s, perp_world_snapshot_restore(s.world, other, size), PERP_ERROR_ARGUMENT, "blob");
    REFUSED(&s, perp_world_snapshot_restore(s.world, blob, size + 1), PERP_ERROR_ARGUMENT, "size");
    SCENE_OK(&s, perp_world_snapshot_restore(s.world, blob, size));
    blob[0] ^= 1;
    REFUSED(&s, perp_world_snapshot_restore(s.world, blob, size), PERP_ERROR_ARGUMENT, "blob");
    blob[0] ^= 1;
    SCENE_OK(&s, perp_world_remove_body(s.world, body));
    scene_add(&s, &settings); /* as many bodies, but another */
    REFUSED(&s, perp_world_snapshot_restore(s.world, blob, size), PERP_ERROR_ARGUMENT, "blob");
    scene_close(&t);
    scene_close(&s);
}

static void test_null_worlds(void **state)
{
    perp_body body = 0;
    perp_step_result result;

    (void)state;
    assert_int_equal(perp_step_result_init(&result, sizeof result), PERP_OK);
    assert_true(perp_world_ground(NULL) == 0);
    assert_int_equal(perp_world_contact_count(NULL), 0);
    assert_int_equal(perp_world_add_body(NULL, &body, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_world_remove_body(NULL, 1), PERP_ERROR_HANDLE);
    assert_int_equal(perp_world_step(NULL, &result, 0.1), PERP_ERROR_HANDLE);
    assert_int_equal(perp_world_energy(NULL, NULL, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_world_momentum(NULL, NULL, NULL), PERP_ERROR_HANDLE);
    perp_world_destroy(NULL);
    assert_string_equal(perp_contact_mode_text(PERP_CONTACT_SLIP), "slip");
    assert_string_equal(perp_contact_mode_text(17), "unknown mode");
}

/* Forces that leave the range of numbers: refused, and the state is as it was. */
static void test_beyond_the_range(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state before, after;
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    settings.mass = 1e-300;
    body = scene_add(&s, &settings);
    scene_push(&s, body, 1e300, 0.0, 0.0);
    before = scene_state(&s, body);
    assert_int_equal(perp_world_step(s.world, NULL, 1.0), PERP_ERROR_NOT_FINITE);
    assert_string_not_equal(perp_context_message(s.context), "");
    after = scene_state(&s, body);
    assert_memory_equal(&before, &after, sizeof before);
    scene_close(&s);
}

/* A rim that is faster than numbers go, though the ball's own velocities are not: a record with an
 * infinity is no answer. */
static void test_contacts_beyond_the_range(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state before, after;
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 1, 0.0, -GRAVITY, 0.0);
    scene_plane(&s, s.ground, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0);
    settings.position[1] = 2.0;
    settings.angular_velocity[2] = 1.7e308;
    body = scene_add(&s, &settings);
    scene_sphere(&s, body, 2.0, 0.0, 0.0);
    before = scene_state(&s, body);
    assert_int_equal(perp_world_step(s.world, NULL, 0.01), PERP_ERROR_NOT_FINITE);
    assert_string_not_equal(perp_context_message(s.context), "");
    after = scene_state(&s, body);
    assert_memory_equal(&before, &after, sizeof before);
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_world_settings),
        cmocka_unit_test(test_body_settings),
        cmocka_unit_test(test_body_settings_allowed),
        cmocka_unit_test(test_planar_inputs),
        cmocka_unit_test(test_shapes),
        cmocka_unit_test(test_ids),
        cmocka_unit_test(test_states),
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_snapshots),
        cmocka_unit_test(test_null_worlds),
        cmocka_unit_test(test_beyond_the_range),
        cmocka_unit_test(test_contacts_beyond_the_range),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
