/* Joints: what calls refuse, ids, what goes with what, who collides, snapshots and rest. */
#include <stdio.h>

#include "suite.h"

#include "refused.h"
#include "world/joint_scene.h"

/* The call fails with `status` and a message that contains `words`. */
#define REFUSED(s, call, status, words) refused((s)->context, call, status, words, #call)

/* A world of two bodies. */
static void open_two(scene *s, int32_t planar, perp_body bodies[2])
{
    perp_body_settings settings = scene_settings();
    int k;

    scene_open(s, planar, 0.0, planar ? -GRAVITY : 0.0, planar ? 0.0 : -GRAVITY);
    for (k = 0; k < 2; k++) {
        settings.position[0] = k;
        bodies[k] = scene_add(s, &settings);
    }
}

static void test_settings(void **state)
{
    perp_joint_settings settings;
    perp_joint joint = 7;
    perp_body b[2];
    scene s;

    (void)state;
    open_two(&s, 0, b);
#define JOINT(of, status, words, ...)                                                             \
    do {                                                                                          \
        settings = joint_at(PERP_JOINT_##of, 0.0, 0.0, 0.0);                                      \
        __VA_ARGS__;                                                                              \
        REFUSED(&s, perp_world_add_joint(s.world, &joint, b[0], b[1], &settings), status, words); \
    } while (0)
    JOINT(BALL, ARGUMENT, "settings.kind", settings.kind = 8);
    JOINT(BALL, ARGUMENT, "settings.kind", settings.kind = -1);
    JOINT(BALL, ARGUMENT, "settings.collides", settings.collides = 2);
    JOINT(BALL, NOT_FINITE, "settings.anchor[1]", settings.anchor[1] = NAN);
    JOINT(REVOLUTE, ARGUMENT, "settings.axis is 0", settings.axis[2] = 0.0);
    JOINT(REVOLUTE, NOT_FINITE, "settings.axis[0]", settings.axis[2] = 0.0;
          settings.axis[0] = INFINITY);
    JOINT(REVOLUTE, ARGUMENT, "lower is 1 and upper is 0.5", settings.lower = 1.0;
          settings.upper = 0.5);
    JOINT(REVOLUTE, NOT_FINITE, "lower", settings.lower = NAN; settings.upper = 0.5);
    JOINT(REVOLUTE, ARGUMENT, "lower", settings.lower = settings.upper = INFINITY);
    JOINT(BALL, ARGUMENT, "coordinate", settings.upper = 1.0);
    JOINT(FIXED, ARGUMENT, "motor_force", settings.motor_force = 1.0);
    JOINT(REVOLUTE, ARGUMENT, "motor_force", settings.motor_force = -1.0);
    JOINT(REVOLUTE, NOT_FINITE, "motor_force", settings.motor_force = NAN);
    JOINT(REVOLUTE, NOT_FINITE, "motor_speed", settings.motor_speed = INFINITY);
    JOINT(REVOLUTE, ARGUMENT, "friction", settings.friction = -1.0);
    JOINT(SCREW, NOT_FINITE, "settings.pitch", settings.pitch = NAN);
    JOINT(BALL, ABI, "settings.struct_size", settings.struct_size = 8);
    JOINT(DISTANCE, ARGUMENT, "distance is 0", ); /* both anchors at 0 */
    JOINT(DISTANCE, ARGUMENT, "distance is 0", settings.lower = 0.25;
          settings.upper = 1.0); /* no direction to push them apart in */
    settings.lower = 0.0;
    SCENE_OK(&s, perp_world_add_joint(s.world, &joint, b[0], b[1], &settings));
    REFUSED(&s, perp_world_set_joint_limits(s.world, joint, 0.25, 1.0), ARGUMENT, "distance is 0");
    SCENE_OK(&s, perp_world_remove_joint(s.world, joint));
    joint = 7;
    JOINT(DISTANCE, NOT_FINITE, "settings.anchor_b[0]", settings.anchor_b[0] = NAN);
    settings = joint_at(PERP_JOINT_BALL, 0.0, 0.0, 0.0);
    REFUSED(&s, perp_world_add_joint(s.world, NULL, b[0], b[1], &settings), ARGUMENT, "joint");
    assert_int_equal(joint, 7);
    /* NULL: a ball in the origin */
    SCENE_OK(&s, perp_world_add_joint(s.world, &joint, b[0], b[1], NULL));
    assert_int_equal(perp_joint_settings_init(NULL, sizeof settings), ABI);
    assert_int_equal(perp_joint_settings_init(&settings, 4), ABI);
    scene_close(&s);
}

static void test_planar_settings(void **state)
{
    static const int32_t none[] = {PERP_JOINT_SCREW, PERP_JOINT_CYLINDRICAL, PERP_JOINT_PLANAR};
    perp_joint_settings settings;
    perp_joint joint = 0;
    perp_body b[2];
    scene s;
    size_t k;

    (void)state;
    open_two(&s, 1, b);
    for (k = 0; k < sizeof none / sizeof *none; k++) {
        settings = joint_at(none[k], 0.0, 0.0, 0.0);
        REFUSED(&s, perp_world_add_joint(s.world, &joint, b[0], b[1], &settings), ARGUMENT,
                "planar world");
    }
    JOINT(PRISMATIC, ARGUMENT, "settings.axis[2]", );
    JOINT(REVOLUTE, ARGUMENT, "settings.anchor[2]", settings.anchor[2] = 1.0);
    scene_close(&s);
}

static void test_bodies(void **state)
{
    const perp_joint_settings settings = joint_at(PERP_JOINT_BALL, 0.0, 0.0, 0.0);
    perp_body_settings fixed = scene_settings();
    perp_joint joint = 0;
    perp_body b[2], wall;
    scene s;

    (void)state;
    open_two(&s, 0, b);
    fixed.kind = PERP_BODY_STATIC;
    wall = scene_add(&s, &fixed);
#define PAIR_REFUSED(x, y, status, words) \
    REFUSED(&s, perp_world_add_joint(s.world, &joint, x, y, &settings), status, words)
    PAIR_REFUSED(b[0], b[0], ARGUMENT, "same body");
    PAIR_REFUSED(s.ground, wall, ARGUMENT, "dynamic");
    PAIR_REFUSED(b[0], 0, HANDLE, "null");
    PAIR_REFUSED(12345, b[0], HANDLE, "not a body");
    SCENE_OK(&s, perp_world_remove_body(s.world, b[1]));
    PAIR_REFUSED(b[0], b[1], HANDLE, "removed");
    assert_int_equal(joint, 0);
    scene_close(&s);
}

static void test_changes(void **state)
{
    const perp_joint_settings hinge = joint_at(PERP_JOINT_REVOLUTE, 0.0, 0.0, 0.0);
    const perp_joint_settings ball = joint_at(PERP_JOINT_BALL, 1.0, 0.0, 0.0);
    perp_joint_state found;
    perp_joint joint, other;
    perp_body b[2];
    scene s;

    (void)state;
    open_two(&s, 0, b);
    joint = joint_add(&s, s.ground, b[0], &hinge);
    other = joint_add(&s, b[0], b[1], &ball);
    REFUSED(&s, perp_world_set_joint_limits(s.world, joint, 1.0, 0.0), ARGUMENT, "lower");
    REFUSED(&s, perp_world_set_joint_limits(s.world, other, 0.0, 1.0), ARGUMENT, "coordinate");
    REFUSED(&s, perp_world_set_joint_motor(s.world, joint, NAN, 1.0), NOT_FINITE, "motor_speed");
    REFUSED(&s, perp_world_set_joint_motor(s.world, joint, 0.0, -1.0), ARGUMENT, "motor_force");
    REFUSED(&s, perp_world_set_joint_friction(s.world, joint, -1.0), ARGUMENT, "friction");
    found = joint_state(&s, joint);
    assert_true(found.lower == -INFINITY && found.upper == INFINITY && found.motor_force == 0.0);
    SCENE_OK(&s, perp_world_set_joint_limits(s.world, joint, -1.0, 2.0));
    SCENE_OK(&s, perp_world_set_joint_motor(s.world, joint, 3.0, 4.0));
    SCENE_OK(&s, perp_world_set_joint_friction(s.world, joint, 5.0));
    found = joint_state(&s, joint);
    assert_true(found.lower == -1.0 && found.upper == 2.0 && found.motor_speed == 3.0 &&
                found.motor_force == 4.0 && found.friction == 5.0);
    memset(&found, 0, sizeof found);
    REFUSED(&s, perp_world_get_joint(s.world, &found, joint), ABI, "state.struct_size");
    REFUSED(&s, perp_world_get_joint(s.world, NULL, joint), ARGUMENT, "state");
    REFUSED(&s, perp_world_remove_joint(s.world, 0), HANDLE, "null");
    REFUSED(&s, perp_world_remove_joint(s.world, 99), HANDLE, "not a joint");
    SCENE_OK(&s, perp_world_remove_joint(s.world, joint));
    REFUSED(&s, perp_world_remove_joint(s.world, joint), HANDLE, "removed");
    joint = joint_add(&s, s.ground, b[0], &hinge);       /* the same slot, another id */
    SCENE_OK(&s, perp_world_remove_body(s.world, b[0])); /* and both joints with it */
    REFUSED(&s, perp_world_set_joint_friction(s.world, joint, 1.0), HANDLE, "removed");
    REFUSED(&s, perp_world_set_joint_friction(s.world, other, 1.0), HANDLE, "removed");
    scene_step(&s, 0.1);
    scene_near(scene_state(&s, b[1]).velocity[2], -0.1 * GRAVITY, 1e-15, "free fall");
    scene_close(&s);
}

/* Boxes that overlap and are joined do not touch; unless asked for, or once the joint is gone. */
static void test_collides(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_joint_settings rail = joint_along(PERP_JOINT_PRISMATIC, 1.0, 0.0, 0.0);
    perp_joint joint;
    perp_body b[2];
    scene s;
    int collides, k;

    (void)state;
    for (collides = 0; collides < 2; collides++) {
        scene_open(&s, 0, 0.0, 0.0, 0.0);
        for (k = 0; k < 2; k++) {
            settings.position[0] = 0.9 * k;
            b[k] = scene_add(&s, &settings);
            scene_box(&s, b[k], 0.5, 0.5, 0.5, 0.0, 0.0);
        }
        scene_step(&s, 1e-3); /* pairs exist */
        assert_true(perp_world_contact_count(s.world) > 0);
        rail.collides = collides;
        joint = joint_add(&s, b[0], b[1], &rail);
        scene_step(&s, 1e-3);
        assert_int_equal(perp_world_contact_count(s.world) > 0, collides);
        SCENE_OK(&s, perp_world_remove_joint(s.world, joint));
        joint = 7;
        scene_step(&s, 1e-3);
        assert_true(perp_world_contact_count(s.world) > 0);
        scene_close(&s);
    }
}

/* What does not move may come last, or first: the joint parts both all the same, from the first
 * step on. */
static void test_parts_static(void **state)
{
    int last, planar;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (last = 0; last < 2; last++) {
            perp_body_settings settings = scene_settings();
            perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, 0.0, 1.0);
            perp_body b[2];
            scene s;
            int k;

            scene_open(&s, planar, 0.0, planar ? -GRAVITY : 0.0, planar ? 0.0 : -GRAVITY);
            for (k = 0; k < 2; k++) {
                settings.kind = k == last ? PERP_BODY_STATIC : PERP_BODY_DYNAMIC;
                settings.position[0] = 0.3 * k;
                b[k] = scene_add(&s, &settings);
                scene_box(&s, b[k], 0.5, 0.5, 0.5, 0.0, 0.0);
            }
            joint_add(&s, b[0], b[1], &hinge);
            for (k = 0; k < 3; k++) {
                scene_step(&s, 1e-3);
                assert_int_equal(perp_world_contact_count(s.world), 0);
            }
            scene_close(&s);
        }
}

/* ---- snapshots and rest ---- */

/* A crane that swings against a stop, driven, with a box on a plank: all kinds of rows. */
static void build_crane(scene *s, int32_t wakeful, perp_body bodies[4], perp_joint joints[3])
{
    perp_world_settings world;
    perp_body_settings settings = scene_settings();
    perp_joint_settings joint = joint_at(PERP_JOINT_REVOLUTE, 0.0, 0.0, 2.0);
    int i, k;

    assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
    world.wakeful = wakeful;
    world.friction = 0.5;
    scene_create(s, &world);
    scene_plane(s, s->ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    for (k = 0; k < 4; k++) {
        settings.position[0] = k == 3 ? 0.2 : 0.5 + k;
        settings.position[2] = k == 3 ? 2.3 : 2.0;
        for (i = 0; i < 9; i += 4) /* of the box */
            settings.inertia[i] = k == 3 ? 0.02 : 1.0;
        bodies[k] = scene_add(s, &settings);
        scene_box(s, bodies[k], k == 3 ? 0.1 : 0.4, 0.2, k == 3 ? 0.2 : 0.1, 0.5, 0.0);
        if (k == 3)
            continue;
        joint.anchor[0] = k;
        joint.axis[1] = 1.0;
        joint.axis[2] = 0.0;
        joint.lower = -0.2;
        joint.upper = 0.3;
        joint.friction = 0.5 * k;
        joints[k] = joint_add(s, k == 0 ? s->ground : bodies[k - 1], bodies[k], &joint);
    }
    SCENE_OK(s, perp_world_set_joint_motor(s->world, joints[0], -0.3, 10.0));
}

static uint64_t hash_of(scene *s, const perp_body *bodies, int count)
{
    uint64_t hash = UINT64_C(1469598103934665603);
    int i;
    size_t k;

    for (i = 0; i < count; i++) {
        const perp_body_state state = scene_state(s, bodies[i]);
        const unsigned char *bytes = (const unsigned char *)state.position;

        for (k = 0; k < sizeof state - offsetof(perp_body_state, position); k++)
            hash = (hash ^ bytes[k]) * UINT64_C(1099511628211);
    }
    return hash;
}

static void test_snapshot(void **state)
{
    perp_body bodies[4];
    perp_joint joints[3];
    unsigned char *blob;
    uint64_t expected;
    size_t size;
    scene s;
    int k;

    (void)state;
    build_crane(&s, 0, bodies, joints);
    for (k = 0; k < 40; k++)
        SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
    SCENE_OK(&s, perp_world_snapshot_size(s.world, &size));
    blob = malloc(size);
    assert_non_null(blob);
    SCENE_OK(&s, perp_world_snapshot_save(s.world, blob, size));
    for (k = 0; k < 60; k++)
        SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
    expected = hash_of(&s, bodies, 4);
    SCENE_OK(&s, perp_world_set_joint_motor(s.world, joints[0], 2.0, 100.0));
    SCENE_OK(&s, perp_world_set_joint_limits(s.world, joints[1], -2.0, 2.0));
    for (k = 0; k < 10; k++)
        SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
    SCENE_OK(&s, perp_world_snapshot_restore(s.world, blob, size));
    assert_true(joint_state(&s, joints[0]).motor_speed == -0.3);
    assert_true(joint_state(&s, joints[1]).upper == 0.3);
    for (k = 0; k < 60; k++)
        SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
    assert_true(hash_of(&s, bodies, 4) == expected);
    SCENE_OK(&s, perp_world_remove_joint(s.world, joints[2]));
    REFUSED(&s, perp_world_snapshot_restore(s.world, blob, size), ARGUMENT, "blob");
    free(blob);
    scene_close(&s);
}

/* What sleeps gives the bits that it would give awake, and wakes by its motor. */
static void test_sleep(void **state)
{
    uint64_t hashes[2][3];
    int wakeful, k;

    (void)state;
    for (wakeful = 0; wakeful < 2; wakeful++) {
        perp_body bodies[4];
        perp_joint joints[3];
        scene s;

        build_crane(&s, wakeful, bodies, joints);
        for (k = 0; k < 400; k++)
            SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
        assert_true(scene_rests(&s, bodies[0]) && scene_rests(&s, bodies[2]));
        hashes[wakeful][0] = hash_of(&s, bodies, 4);
        scene_near(joint_state(&s, joints[0]).impulse[2], 0.04 * GRAVITY, 1e-8, "the weight");
        SCENE_OK(&s, perp_world_set_joint_motor(s.world, joints[0], -0.3, 200.0));
        for (k = 0; k < 50; k++)
            SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
        assert_true(joint_state(&s, joints[0]).position < 0.2);
        hashes[wakeful][1] = hash_of(&s, bodies, 4);
        SCENE_OK(&s, perp_world_remove_joint(s.world, joints[1]));
        for (k = 0; k < 100; k++)
            SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
        assert_true(scene_state(&s, bodies[2]).position[2] < 0.5); /* on the floor */
        hashes[wakeful][2] = hash_of(&s, bodies, 4);
        scene_close(&s);
    }
    assert_memory_equal(hashes[0], hashes[1], sizeof hashes[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_settings), cmocka_unit_test(test_planar_settings),
        cmocka_unit_test(test_bodies),   cmocka_unit_test(test_changes),
        cmocka_unit_test(test_collides), cmocka_unit_test(test_parts_static),
        cmocka_unit_test(test_snapshot), cmocka_unit_test(test_sleep),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
