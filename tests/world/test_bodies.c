/* Bodies: what goes in comes out, slots, kinds, and single-body motion. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

static void test_defaults(void **state)
{
    perp_world_settings world;
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_world_stats stats = fresh_world_stats();
    scene s;
    int i;

    (void)state;
    assert_int_equal(perp_world_settings_init(&world, sizeof world, 1), PERP_OK);
    assert_true(world.gravity[1] == -9.81 && world.gravity[2] == 0.0 && world.planar == 1);
    assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
    assert_true(world.gravity[2] == -9.81 && world.gravity[1] == 0.0 && world.planar == 0);
    assert_int_equal(world.accuracy, PERP_ACCURACY_STANDARD);
    assert_int_equal(world.cone, 0);
    assert_true(world.tol == 0.0);
    assert_int_equal(perp_world_settings_init(NULL, sizeof world, 0), PERP_ERROR_ABI);
    assert_int_equal(perp_world_settings_init(&world, 5, 0), PERP_ERROR_ABI);
    settings = scene_defaults(); /* mass and inertia: the shapes' */
    assert_true(settings.mass == 0.0 && settings.inertia[8] == 0.0 &&
                settings.kind == PERP_BODY_DYNAMIC);
    assert_true(world.friction == 0.0 && scene_material(0.0, 0.0).density == 1000.0);

    scene_create(&s, NULL);
    now = scene_state(&s, scene_add(&s, NULL));
    for (i = 0; i < 3; i++)
        assert_true(now.position[i] == 0.0 && now.velocity[i] == 0.0 && now.force[i] == 0.0 &&
                    now.angular_velocity[i] == 0.0 && now.torque[i] == 0.0);
    assert_true(now.orientation[0] == 1.0 && now.angle == 0.0);
    SCENE_OK(&s, perp_world_get_stats(s.world, &stats));
    assert_int_equal(stats.bodies, 2); /* and the ground */
    scene_close(&s);
}

/* What is set is what is read, to the last bit, as often as one likes. */
static void test_round_trip(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state now, again;
    perp_body body;
    scene s;
    int i, k;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    body = scene_add(&s, &settings);
    now = scene_state(&s, body);
    for (i = 0; i < 3; i++) {
        now.position[i] = 0.1 * (i + 1);
        now.velocity[i] = -0.7 * (i + 1);
        now.angular_velocity[i] = 1.3 * (i + 1);
        now.force[i] = 11.1 * (i + 1);
        now.torque[i] = -3.3 * (i + 1);
    }
    now.orientation[0] = 0.5000001;
    now.orientation[1] = now.orientation[2] = now.orientation[3] = 0.5;
    SCENE_OK(&s, perp_world_set_body(s.world, &now, body));
    now = scene_state(&s, body);
    for (k = 0; k < 10; k++) {
        SCENE_OK(&s, perp_world_set_body(s.world, &now, body));
        again = scene_state(&s, body);
        assert_memory_equal(&now, &again, sizeof now);
    }
    assert_true(now.position[2] == 0.1 * 3 && now.velocity[1] == -0.7 * 2 &&
                now.angular_velocity[0] == 1.3 && now.force[2] == 11.1 * 3 &&
                now.torque[1] == -3.3 * 2);
    scene_near(now.orientation[0] * now.orientation[0] + now.orientation[1] * now.orientation[1] +
                   now.orientation[2] * now.orientation[2] +
                   now.orientation[3] * now.orientation[3],
               1.0, 4.0 * EPSILON, "unit quaternion");
    scene_close(&s);
}

/* A caller compiled against a longer struct whose tail is zero is served; the tail stays. */
static void test_longer_structs(void **state)
{
    struct {
        perp_body_state state;
        double tail[4];
    } longer;
    perp_body_settings settings = scene_settings();
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    settings.position[0] = 4.0;
    body = scene_add(&s, &settings);
    assert_int_equal(perp_body_state_init(&longer.state, sizeof longer), PERP_OK);
    SCENE_OK(&s, perp_world_get_body(s.world, &longer.state, body));
    assert_true(longer.state.position[0] == 4.0 && longer.state.struct_size == sizeof longer);
    SCENE_OK(&s, perp_world_set_body(s.world, &longer.state, body));
    longer.tail[1] = 1.0;
    assert_int_equal(perp_world_set_body(s.world, &longer.state, body), PERP_ERROR_ABI);
    scene_close(&s);
}

/* Adds and removes many bodies with shapes; those that stay keep their states and contacts. */
static void test_many_bodies(void **state)
{
    enum { many = 100 };
    perp_body bodies[many];
    perp_world_stats stats = fresh_world_stats();
    scene s;
    int i;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    for (i = 0; i < many; i++) {
        perp_body_settings settings = scene_settings();

        settings.position[0] = 3.0 * i;
        settings.position[2] = 1.0;
        bodies[i] = scene_add(&s, &settings);
        scene_sphere(&s, bodies[i], 1.0, 0.5, 0.0);
    }
    scene_step(&s, 0.01);
    assert_int_equal(perp_world_contact_count(s.world), many);
    for (i = 0; i < many; i += 2)
        SCENE_OK(&s, perp_world_remove_body(s.world, bodies[i]));
    scene_step(&s, 0.01);
    assert_int_equal(perp_world_contact_count(s.world), many / 2);
    SCENE_OK(&s, perp_world_get_stats(s.world, &stats));
    assert_int_equal(stats.bodies, many / 2 + 1);
    assert_int_equal(stats.shapes, many / 2 + 1);
    assert_int_equal(stats.islands, many / 2);
    assert_int_equal(stats.steps, 2);
    for (i = 1; i < many; i += 2) {
        assert_true(scene_state(&s, bodies[i]).position[0] == 3.0 * i);
        assert_true(scene_rests(&s, bodies[i]));
    }
    for (i = 0; i < many; i += 2) {
        perp_body_settings settings = scene_settings();

        settings.position[0] = 3.0 * i;
        settings.position[2] = 1.0;
        bodies[i] = scene_add(&s, &settings);
        scene_sphere(&s, bodies[i], 1.0, 0.5, 0.0);
    }
    scene_step(&s, 0.01);
    assert_int_equal(perp_world_contact_count(s.world), many);
    scene_close(&s);
}

/* A kinematic body keeps its course through everything, x = v t, and turns by w t. */
static void test_kinematic(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_body pusher, ball;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    settings.kind = PERP_BODY_KINEMATIC;
    settings.velocity[0] = 1.0;
    settings.angular_velocity[0] = 0.5;
    pusher = scene_add(&s, &settings);
    scene_sphere(&s, pusher, 0.5, 0.0, 0.0);
    settings = scene_settings();
    settings.position[0] = 1.25;
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, 0.5, 0.0, 0.0);
    scene_push(&s, ball, 0.0, 0.0, GRAVITY); /* its weight is carried */
    scene_steps(&s, 128, 0.0078125);
    now = scene_state(&s, pusher);
    assert_true(now.position[0] == 1.0 && now.position[2] == 0.0 && now.velocity[0] == 1.0);
    scene_near(2.0 * atan2(now.orientation[1], now.orientation[0]), 0.5, 128.0 * EPSILON, "angle");
    now = scene_state(&s, ball); /* pushed along, touching */
    scene_near(now.velocity[0], 1.0, 8.0 * EPSILON, "ball");
    scene_near(now.position[0], 2.0, 128.0 * EPSILON, "ball");
    scene_close(&s);
}

/* Shapes off centre and turned: a dumb-bell lands on both balls, a box turned by 45 degrees on its
 * edge. */
static void test_placed_shapes(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_shape_settings material = scene_material(0.5, 0.0);
    const double half[3] = {1.0, 1.0, 1.0};
    perp_world_contact contact;
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, -3.0, 0.5, 0.0);
    settings.orientation[0] = settings.orientation[3] = sqrt(0.5); /* x of the body is y */
    body = scene_add(&s, &settings);
    material.offset[0] = 2.0;
    material.offset[2] = -2.0;
    SCENE_OK(&s, perp_world_add_sphere(s.world, NULL, body, 1.0, &material));
    material.offset[0] = -2.0;
    SCENE_OK(&s, perp_world_add_sphere(s.world, NULL, body, 1.0, &material));
    scene_step(&s, 0.01);
    assert_int_equal(perp_world_contact_count(s.world), 2);
    contact = scene_contact(&s, 0);
    scene_near(contact.position[0], 0.0, 4.0 * EPSILON, "x");
    scene_near(contact.position[1], 2.0, 8.0 * EPSILON, "y");
    scene_near(contact.position[2], -3.0, 4.0 * EPSILON, "z");
    SCENE_OK(&s, perp_world_remove_body(s.world, body));

    settings = scene_settings();
    settings.position[2] = sqrt(2.0) - 3.0;
    body = scene_add(&s, &settings);
    material = scene_material(0.5, 0.0);
    material.rotation[0] = cos(PI / 8.0);
    material.rotation[1] = sin(PI / 8.0); /* about x */
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, body, half, &material));
    scene_step(&s, 0.01);
    assert_int_equal(perp_world_contact_count(s.world), 2);
    contact = scene_contact(&s, 0);
    scene_near(fabs(contact.position[0]), 1.0, 8.0 * EPSILON, "x");
    scene_near(contact.position[1], 0.0, 8.0 * EPSILON, "y");
    scene_close(&s);
}

/* A pair's friction is the geometric mean, its restitution the larger. */
static void test_materials(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_world_contact contact;
    perp_body ball;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.2, 0.3);
    settings.position[2] = 1.0;
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, 1.0, 0.8, 0.1);
    scene_step(&s, 0.01);
    contact = scene_contact(&s, 0);
    scene_near(contact.friction, 0.4, 2.0 * EPSILON, "friction");
    assert_true(contact.restitution == 0.3);
    scene_close(&s);
}

/* Planar worlds report the quaternion of their angle. */
static void test_planar_angle(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state now;
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 1, 0.0, 0.0, 0.0);
    settings.angle = 0.25;
    settings.angular_velocity[2] = 2.0;
    body = scene_add(&s, &settings);
    scene_steps(&s, 256, 0.0078125);
    now = scene_state(&s, body);
    assert_true(now.angle == 4.25); /* powers of two: no rounding, and no reduction by 2 pi */
    scene_near(now.orientation[0], cos(0.5 * 4.25), EPSILON, "w");
    scene_near(now.orientation[3], sin(0.5 * 4.25), EPSILON, "z");
    assert_true(now.orientation[1] == 0.0 && now.orientation[2] == 0.0);
    scene_close(&s);
}

/* What was given, else what the shapes have: a box of 2 x 4 x 6 m and 3 kg/m^3. */
static void test_mass_is_told(void **state)
{
    const double half[] = {1.0, 2.0, 3.0};
    const double moments[] = {144.0 * 52.0 / 12.0, 144.0 * 40.0 / 12.0, 144.0 * 20.0 / 12.0};
    perp_shape_settings shape = scene_material(0.5, 0.0);
    double mass = 0.0, inertia[9];
    perp_body body;
    scene s;
    int i;

    (void)state;
    shape.density = 3.0;
    scene_create(&s, NULL);
    body = scene_add(&s, NULL);
    SCENE_OK(&s, perp_world_get_mass(s.world, &mass, inertia, body));
    assert_true(mass == 1.0 && inertia[0] == 1.0 && inertia[1] == 0.0);
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, body, half, &shape));
    SCENE_OK(&s, perp_world_get_mass(s.world, &mass, NULL, body));
    SCENE_OK(&s, perp_world_get_mass(s.world, NULL, inertia, body));
    scene_near(mass, 144.0, 144.0 * EPSILON, "mass");
    for (i = 0; i < 9; i++) /* a handful of roundings */
        scene_near(inertia[i], i % 4 == 0 ? moments[i / 4] : 0.0, 1e3 * EPSILON, "inertia");
    SCENE_OK(&s, perp_world_get_mass(s.world, &mass, inertia, s.ground));
    assert_true(mass == INFINITY && inertia[4] == INFINITY && inertia[1] == 0.0);
    assert_int_equal(perp_world_get_mass(s.world, &mass, inertia, 0), PERP_ERROR_HANDLE);
    scene_close(&s);
    scene_open(&s, 1, 0.0, 0.0, 0.0);
    body = scene_add(&s, NULL);
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, body, half, &shape)); /* 2 x 4 m */
    SCENE_OK(&s, perp_world_get_mass(s.world, &mass, inertia, body));
    scene_near(mass, 24.0, 24.0 * EPSILON, "planar mass");
    scene_near(inertia[8], 24.0 * 20.0 / 12.0, 1e2 * EPSILON, "planar inertia");
    assert_true(inertia[0] == 0.0 && inertia[4] == 0.0);
    SCENE_OK(&s, perp_world_get_mass(s.world, NULL, inertia, s.ground));
    assert_true(inertia[8] == INFINITY && inertia[0] == 0.0);
    scene_close(&s);
}

static const double *number_of(const double *first, size_t stride, int32_t slot)
{
    return (const double *)((const char *)first + (size_t)slot * stride);
}

/* The arrays show what is read body by body, and go on doing so through steps. */
static void same_states(scene *s, const perp_world_states *states, const perp_body *bodies,
                        int count)
{
    int i;

    for (i = 0; i < count; i++) {
        perp_body_state now = scene_state(s, bodies[i]);
        int32_t slot = -1;

        SCENE_OK(s, perp_world_body_slot(s->world, &slot, bodies[i]));
        assert_in_range(slot, 0, states->slots - 1);
#define SAME(field, kind)                                                                  \
    assert_memory_equal(number_of(states->field, states->kind##_stride, slot), &now.field, \
                        sizeof now.field)
        SAME(position, pose);
        SAME(orientation, pose);
        SAME(angle, pose);
        SAME(velocity, twist);
        SAME(angular_velocity, twist);
    }
}

static void test_states_without_copies(void **state)
{
    perp_body bodies[20];
    perp_body_settings settings = scene_settings();
    perp_world_states states, short_one;
    int32_t planar, slot = 77, i;
    scene s;

    (void)state;
    for (planar = 0; planar < 2; planar++) {
        scene_open(&s, planar, 0.5, -1.0, 0.0);
        bodies[0] = s.ground;
        for (i = 1; i < 20; i++) { /* more than fit the first memory */
            settings.position[0] = i;
            settings.velocity[1] = 2.0 * i;
            settings.angular_velocity[2] = 0.25 * i;
            bodies[i] = scene_add(&s, &settings);
        }
        assert_int_equal(perp_struct_init(&states, sizeof states), PERP_OK);
        SCENE_OK(&s, perp_world_get_states(s.world, &states));
        assert_int_equal(states.slots, 20);
        same_states(&s, &states, bodies, 20);
        for (i = 0; i < 5; i++) {
            scene_step(&s, 0.125);
            same_states(&s, &states, bodies, 20);
        }
        SCENE_OK(&s, perp_world_body_slot(s.world, &slot, s.ground));
        assert_int_equal(slot, 0);
        SCENE_OK(&s, perp_world_remove_body(s.world, bodies[7]));
        slot = 77;
        assert_int_equal(perp_world_body_slot(s.world, &slot, bodies[7]), PERP_ERROR_HANDLE);
        assert_int_equal(slot, 77);
        bodies[7] = scene_add(&s, &settings); /* in the place that is free */
        SCENE_OK(&s, perp_world_get_states(s.world, &states));
        assert_int_equal(states.slots, 20);
        same_states(&s, &states, bodies, 20);
        assert_int_equal(perp_world_get_states(s.world, NULL), PERP_ERROR_ARGUMENT);
        assert_int_equal(perp_world_body_slot(s.world, NULL, bodies[1]), PERP_ERROR_ARGUMENT);
        memset(&short_one, 0, sizeof short_one);
        assert_int_equal(perp_world_get_states(s.world, &short_one), PERP_ERROR_ABI);
        assert_int_equal(perp_world_get_states(NULL, &states), PERP_ERROR_HANDLE);
        scene_close(&s);
    }
}

/* A context may go before its world. */
static void test_context_goes_first(void **state)
{
    perp_context *context;
    perp_world *world;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_world_create(context, &world, NULL), PERP_OK);
    perp_context_destroy(context);
    assert_int_equal(perp_world_step(world, NULL, 0.1), PERP_OK);
    perp_world_destroy(world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),           cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_longer_structs),     cmocka_unit_test(test_many_bodies),
        cmocka_unit_test(test_kinematic),          cmocka_unit_test(test_placed_shapes),
        cmocka_unit_test(test_materials),          cmocka_unit_test(test_planar_angle),
        cmocka_unit_test(test_context_goes_first), cmocka_unit_test(test_states_without_copies),
        cmocka_unit_test(test_mass_is_told),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
