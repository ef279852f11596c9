/* What a world refuses: the status, a message that names the argument, and nothing changed. */
#include <stdio.h>

#include "suite.h"

#include "refused.h"
#include "world/scene.h"

/* The call fails with `status` and a message that contains `words`. */
#define REFUSED(s, call, status, words) refused((s)->context, call, status, words, #call)

static void test_world_settings(void **state)
{
    perp_world_settings settings;
    perp_world *world = NULL;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
#define WORLD(planar, status, words, ...)                                                        \
    do {                                                                                         \
        assert_int_equal(perp_world_settings_init(&settings, sizeof settings, planar), PERP_OK); \
        settings.__VA_ARGS__;                                                                    \
        REFUSED(&s, perp_world_create(s.context, &world, &settings), status, words);             \
    } while (0)
    WORLD(0, NOT_FINITE, "gravity[1]", gravity[1] = NAN);
    WORLD(0, ARGUMENT, "cone", cone = 7);
    WORLD(0, ARGUMENT, "cone", cone = 2);
    WORLD(0, ARGUMENT, "cone", cone = 66);
    WORLD(0, ARGUMENT, "accuracy", accuracy = 4);
    WORLD(0, ARGUMENT, "accuracy", accuracy = -1);
    WORLD(0, ARGUMENT, "substeps", substeps = -1);
    WORLD(0, ARGUMENT, "planar", planar = 2);
    WORLD(1, ARGUMENT, "gravity[2]", gravity[2] = 1.0);
    WORLD(0, ARGUMENT, "strict", strict = -1);
    WORLD(0, ARGUMENT, "method", method = 99);
    WORLD(0, ARGUMENT, "tol", tol = -1.0);
    WORLD(0, NOT_FINITE, "tol", tol = NAN);
    WORLD(0, ARGUMENT, "time_limit", time_limit = -1.0);
    WORLD(0, ABI, "settings.struct_size", struct_size = 3);
    assert_null(world);
    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
    REFUSED(&s, perp_world_create(s.context, NULL, &settings), ARGUMENT, "world");
    scene_close(&s);
}

static void test_body_settings(void **state)
{
    perp_body_settings settings;
    perp_body body = 77;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
#define BODY(status, words, ...)                                                    \
    do {                                                                            \
        settings = scene_settings();                                                \
        settings.__VA_ARGS__;                                                       \
        REFUSED(&s, perp_world_add_body(s.world, &body, &settings), status, words); \
    } while (0)
    BODY(ARGUMENT, "settings.mass", mass = -1.0);
    BODY(NOT_FINITE, "settings.mass", mass = INFINITY);
    BODY(ARGUMENT, "symmetric", inertia[1] = 0.5);
    BODY(NOT_FINITE, "settings.inertia[0]", inertia[1] = settings.inertia[3] = 0.5;
         settings.inertia[0] = NAN);
    BODY(ARGUMENT, "positive definite", inertia[4] = -1.0);
    BODY(ARGUMENT, "positive definite", inertia[8] = 0.0);
    BODY(ARGUMENT, "triangle", inertia[8] = 2.1);
    BODY(ARGUMENT, "orientation", orientation[0] = 1.0 + 2e-6);
    BODY(NOT_FINITE, "orientation[0]", orientation[0] = NAN);
    BODY(NOT_FINITE, "settings.position[2]", position[2] = INFINITY);
    BODY(NOT_FINITE, "settings.velocity[1]", velocity[1] = NAN);
    BODY(NOT_FINITE, "settings.angular_velocity[0]", angular_velocity[0] = NAN);
    BODY(ARGUMENT, "settings.kind", kind = 3);
    BODY(ARGUMENT, "static", kind = PERP_BODY_STATIC; settings.velocity[0] = 1.0);
    settings = scene_settings();
    REFUSED(&s, perp_world_add_body(s.world, NULL, &settings), ARGUMENT, "body");
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
    BODY(ARGUMENT, "settings.position[2]", position[2] = 1.0);
    BODY(ARGUMENT, "settings.velocity[2]", velocity[2] = 1.0);
    BODY(ARGUMENT, "settings.angular_velocity[1]", angular_velocity[1] = 1.0);
    BODY(NOT_FINITE, "angle", angle = INFINITY);
    BODY(ARGUMENT, "settings.inertia[8]", inertia[8] = -1.0);
    settings = scene_settings();
    settings.inertia[0] = -1.0; /* not of the plane: ignored */
    good = scene_add(&s, &settings);
    now = scene_state(&s, good);
    now.force[2] = 1.0;
    REFUSED(&s, perp_world_set_body(s.world, &now, good), ARGUMENT, "state.force[2]");
    now.force[2] = 0.0;
    now.torque[0] = 1.0;
    REFUSED(&s, perp_world_set_body(s.world, &now, good), ARGUMENT, "state.torque[0]");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, s.ground, out, 0.0, NULL), ARGUMENT,
            "normal[2]");
    material.offset[2] = 1.0;
    REFUSED(&s, perp_world_add_sphere(s.world, NULL, good, 1.0, &material), ARGUMENT,
            "settings.offset[2]");
    material.offset[2] = 0.0;
    material.rotation[0] = 0.6;
    material.rotation[1] = 0.8;
    REFUSED(&s, perp_world_add_box(s.world, NULL, good, half, &material), ARGUMENT, "rotation");
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
#define SPHERE(status, words, ...)                                                              \
    do {                                                                                        \
        material = scene_material(0.0, 0.0);                                                    \
        material.__VA_ARGS__;                                                                   \
        REFUSED(&s, perp_world_add_sphere(s.world, NULL, body, 1.0, &material), status, words); \
    } while (0)
    SPHERE(ARGUMENT, "settings.friction", friction = -0.1);
    SPHERE(NOT_FINITE, "settings.friction", friction = INFINITY);
    SPHERE(ARGUMENT, "settings.restitution", restitution = 1.1);
    SPHERE(ARGUMENT, "settings.restitution", restitution = -0.1);
    SPHERE(NOT_FINITE, "settings.offset[0]", offset[0] = NAN);
    SPHERE(ARGUMENT, "settings.rotation", rotation[2] = 1.0);
    material = scene_material(1e3, 1.0);
    SCENE_OK(&s, perp_world_add_sphere(s.world, NULL, body, 0.0, &material));
    REFUSED(&s, perp_world_add_sphere(s.world, NULL, body, -1.0, NULL), ARGUMENT, "radius");
    REFUSED(&s, perp_world_add_sphere(s.world, NULL, body, NAN, NULL), NOT_FINITE, "radius");
    REFUSED(&s, perp_world_add_box(s.world, NULL, body, half, NULL), ARGUMENT, "half_extents[1]");
    REFUSED(&s, perp_world_add_box(s.world, NULL, body, bad, NULL), NOT_FINITE, "half_extents[1]");
    REFUSED(&s, perp_world_add_box(s.world, NULL, body, NULL, NULL), ARGUMENT, "half_extents");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, s.ground, zero, 0.0, NULL), ARGUMENT, "normal");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, s.ground, bad, 0.0, NULL), NOT_FINITE,
            "normal[1]");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, s.ground, up, INFINITY, NULL), NOT_FINITE,
            "offset");
    REFUSED(&s, perp_world_add_plane(s.world, NULL, body, up, 0.0, NULL), ARGUMENT, "half-space");
    scene_close(&s);
}

static void test_ids(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state now = fresh_body_state();
    perp_body a, b;
    perp_shape shape = 0;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    a = scene_add(&s, &settings);
    SCENE_OK(&s, perp_world_add_sphere(s.world, &shape, a, 1.0, NULL));
    assert_true(shape != 0);
    SCENE_OK(&s, perp_world_remove_body(s.world, a));
    REFUSED(&s, perp_world_get_body(s.world, &now, a), HANDLE, "body");
    REFUSED(&s, perp_world_set_body(s.world, &now, a), HANDLE, "body");
    REFUSED(&s, perp_world_remove_body(s.world, a), HANDLE, "body");
    b = scene_add(&s, &settings); /* in the same slot */
    assert_true(a != b && (a & 0xffffffffu) == (b & 0xffffffffu));
    REFUSED(&s, perp_world_get_body(s.world, &now, a), HANDLE, "removed");
    REFUSED(&s, perp_world_add_sphere(s.world, NULL, a, 1.0, NULL), HANDLE, "body");
    SCENE_OK(&s, perp_world_get_body(s.world, &now, b));
    REFUSED(&s, perp_world_get_body(s.world, &now, 0), HANDLE, "null");
    REFUSED(&s, perp_world_get_body(s.world, &now, b + 5), HANDLE, "not a body");
    REFUSED(&s, perp_world_get_body(s.world, &now, UINT64_MAX), HANDLE, "body");
    REFUSED(&s, perp_world_remove_body(s.world, s.ground), ARGUMENT, "ground");
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
#define STATE(status, words, ...)                                             \
    do {                                                                      \
        now = before;                                                         \
        now.__VA_ARGS__;                                                      \
        REFUSED(&s, perp_world_set_body(s.world, &now, body), status, words); \
    } while (0)
    STATE(NOT_FINITE, "state.position[1]", position[1] = NAN);
    STATE(ARGUMENT, "orientation", orientation[0] = 0.5);
    STATE(NOT_FINITE, "state.velocity[2]", velocity[2] = INFINITY);
    STATE(NOT_FINITE, "state.force[0]", force[0] = NAN);
    STATE(NOT_FINITE, "state.torque[2]", torque[2] = NAN);
    STATE(ABI, "state.struct_size", struct_size = 0);
    REFUSED(&s, perp_world_set_gravity(s.world, NULL), ARGUMENT, "gravity");
    REFUSED(&s, perp_world_set_gravity(s.world, bad), NOT_FINITE, "gravity[1]");
    REFUSED(&s, perp_world_set_body(s.world, NULL, body), ARGUMENT, "state");
    REFUSED(&s, perp_world_get_body(s.world, NULL, body), ARGUMENT, "state");
    now = scene_state(&s, body);
    assert_memory_equal(&now, &before, sizeof now);

    now = scene_state(&s, s.ground);
    now.position[0] = 1.0;
    SCENE_OK(&s, perp_world_set_body(s.world, &now, s.ground));
    now.velocity[0] = 1.0;
    REFUSED(&s, perp_world_set_body(s.world, &now, s.ground), ARGUMENT, "static");
    now.velocity[0] = 0.0;
    now.torque[0] = 1.0;
    REFUSED(&s, perp_world_set_body(s.world, &now, s.ground), ARGUMENT, "static");
    scene_close(&s);
}

static void test_steps(void **state)
{
    perp_step_result result;
    perp_world_stats stats;
    perp_world_contact contact = fresh_world_contact();
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    REFUSED(&s, perp_world_step(s.world, NULL, 0.0), ARGUMENT, "dt");
    REFUSED(&s, perp_world_step(s.world, NULL, -0.1), ARGUMENT, "dt");
    REFUSED(&s, perp_world_step(s.world, NULL, NAN), NOT_FINITE, "dt");
    REFUSED(&s, perp_world_step(s.world, NULL, INFINITY), NOT_FINITE, "dt");
    memset(&result, 0, sizeof result);
    REFUSED(&s, perp_world_step(s.world, &result, 0.1), ABI, "result.struct_size");
    REFUSED(&s, perp_world_get_contact(s.world, &contact, 0), ARGUMENT, "index");
    REFUSED(&s, perp_world_get_contact(s.world, &contact, -1), ARGUMENT, "index");
    memset(&stats, 0, sizeof stats);
    REFUSED(&s, perp_world_get_stats(s.world, &stats), ABI, "stats.struct_size");
    assert_int_equal(perp_struct_init(&stats, sizeof stats), PERP_OK);
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
    REFUSED(&s, perp_world_snapshot_size(s.world, NULL), ARGUMENT, "size");
    REFUSED(&s, perp_world_snapshot_save(s.world, blob, size - 1), ARGUMENT, "size");
    REFUSED(&s, perp_world_snapshot_save(s.world, NULL, size), ARGUMENT, "blob");
    SCENE_OK(&s, perp_world_snapshot_save(s.world, blob, size));
    SCENE_OK(&t, perp_world_snapshot_save(t.world, other, size));
    REFUSED(&s, perp_world_snapshot_restore(s.world, other, size), ARGUMENT, "blob");
    REFUSED(&s, perp_world_snapshot_restore(s.world, blob, size + 1), ARGUMENT, "size");
    SCENE_OK(&s, perp_world_snapshot_restore(s.world, blob, size));
    blob[0] ^= 1;
    REFUSED(&s, perp_world_snapshot_restore(s.world, blob, size), ARGUMENT, "blob");
    blob[0] ^= 1;
    SCENE_OK(&s, perp_world_remove_body(s.world, body));
    scene_add(&s, &settings); /* as many bodies, but another */
    REFUSED(&s, perp_world_snapshot_restore(s.world, blob, size), ARGUMENT, "blob");
    scene_close(&t);
    scene_close(&s);
}

static void test_null_worlds(void **state)
{
    perp_body body = 0;
    perp_step_result result = fresh_step_result();

    (void)state;
    assert_true(perp_world_ground(NULL) == 0);
    assert_int_equal(perp_world_contact_count(NULL), 0);
    assert_int_equal(perp_world_add_body(NULL, &body, NULL), HANDLE);
    assert_int_equal(perp_world_remove_body(NULL, 1), HANDLE);
    assert_int_equal(perp_world_step(NULL, &result, 0.1), HANDLE);
    assert_int_equal(perp_world_energy(NULL, NULL, NULL), HANDLE);
    assert_int_equal(perp_world_momentum(NULL, NULL, NULL), HANDLE);
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
    assert_int_equal(perp_world_step(s.world, NULL, 1.0), NOT_FINITE);
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
    assert_int_equal(perp_world_step(s.world, NULL, 0.01), NOT_FINITE);
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
