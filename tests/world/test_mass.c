/* Mass and inertia from the shapes, in closed form: a torque turns a body at rest at I^-1 torque, a
 * force moves it at F / m. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

/* Velocities are sums and products of a dozen roundings. */
#define BOUND (64.0 * EPSILON)

/* Moments about the axes of the body, and mass, as a step with a force and a torque shows them. */
static void require_mass(scene *s, perp_body body, double mass, const double *moments,
                         const char *what)
{
    int axis, first = moments[0] == 0.0 ? 2 : 0; /* a planar body has one */

    for (axis = first; axis < 3; axis++) {
        perp_body_state state = scene_state(s, body), after;

        memset(state.velocity, 0, sizeof state.velocity);
        memset(state.angular_velocity, 0, sizeof state.angular_velocity);
        memset(state.torque, 0, sizeof state.torque);
        state.force[0] = 3.0;
        state.torque[axis] = 2.0;
        SCENE_OK(s, perp_world_set_body(s->world, &state, body));
        scene_step(s, 1.0 / 1024.0);
        after = scene_state(s, body);
        scene_near(after.velocity[0] * 1024.0 * mass, 3.0, 3.0 * BOUND, what);
        scene_near(after.angular_velocity[axis] * 1024.0 * moments[axis], 2.0, 2.0 * BOUND, what);
        state.force[0] = state.torque[axis] = 0.0;
        SCENE_OK(s, perp_world_set_body(s->world, &state, body));
    }
}

static perp_body body_of(scene *s, double mass, double inertia)
{
    perp_body_settings settings = scene_defaults();

    settings.mass = mass;
    settings.inertia[0] = settings.inertia[4] = settings.inertia[8] = inertia;
    return scene_add(s, &settings);
}

/* m (y^2 + z^2) / 3 for half edges, 2 m r^2 / 5. The shapes' mass is density times volume; a given
 * mass scales the inertia, a given inertia stays. */
static void test_one_shape(void **state)
{
    const double half[3] = {0.5, 1.0, 1.5}, pi = PI;
    const double box[3] = {(1.0 + 2.25) / 3.0, (0.25 + 2.25) / 3.0, (0.25 + 1.0) / 3.0};
    const double ball = 0.4 * 0.25, given[3] = {7.0, 7.0, 7.0};
    perp_shape_settings shape = scene_material(0.0, 0.0);
    double moments[3];
    perp_body body;
    scene s;
    int k, round;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    for (round = 0; round < 3; round++) {
        const double mass = round == 0 ? 6000.0 : round == 1 ? 2.0 : 6.0 * 0.5;

        shape.density = round == 2 ? 0.5 : 1000.0;
        body = body_of(&s, round == 1 ? 2.0 : 0.0, 0.0);
        SCENE_OK(&s, perp_world_add_box(s.world, NULL, body, half, &shape));
        for (k = 0; k < 3; k++)
            moments[k] = mass * box[k];
        require_mass(&s, body, mass, moments, "box");
        SCENE_OK(&s, perp_world_remove_body(s.world, body));
    }
    body = body_of(&s, 0.0, 0.0);
    scene_sphere(&s, body, 0.5, 0.0, 0.0);
    for (k = 0; k < 3; k++)
        moments[k] = 1000.0 * pi / 6.0 * ball;
    require_mass(&s, body, 1000.0 * pi / 6.0, moments, "ball");
    SCENE_OK(&s, perp_world_remove_body(s.world, body));
    body = body_of(&s, 0.0, 7.0);
    scene_box(&s, body, 0.5, 0.5, 0.5, 0.0, 0.0);
    require_mass(&s, body, 1000.0, given, "given inertia");
    scene_close(&s);
}

/* A planar box of 1 kg and 1 m has the moment (1 + 1) / 12, a disc m r^2 / 2. */
static void test_planar(void **state)
{
    const double box[3] = {0.0, 0.0, 1.0 / 6.0}, disc[3] = {0.0, 0.0, 1000.0 * PI * 0.25 * 0.125};
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 1, 0.0, 0.0, 0.0);
    body = body_of(&s, 1.0, 0.0);
    scene_box(&s, body, 0.5, 0.5, 0.0, 0.0, 0.0);
    require_mass(&s, body, 1.0, box, "rectangle");
    SCENE_OK(&s, perp_world_remove_body(s.world, body));
    body = body_of(&s, 0.0, 0.0);
    scene_sphere(&s, body, 0.5, 0.0, 0.0);
    require_mass(&s, body, 1000.0 * PI * 0.25, disc, "disc");
    scene_close(&s);
}

/* A dumb-bell of two balls and a turned bar between them: Steiner's terms and the bar's own
 * moments, seen along the body's axes. */
static void test_compound(void **state)
{
    const double r = 0.25, d = 2.0, ball = 4.0 / 3.0 * PI * r * r * r * 1000.0;
    const double bar = 8.0 * 1.5 * 0.1 * 0.1 * 500.0, half[3] = {1.5, 0.1, 0.1};
    const double along = bar * (0.01 + 0.01) / 3.0, across = bar * (2.25 + 0.01) / 3.0;
    const double moments[3] = {2.0 * ball * (0.4 * r * r + d * d) + across,
                               2.0 * ball * 0.4 * r * r + along,
                               2.0 * ball * (0.4 * r * r + d * d) + across};
    perp_shape_settings shape = scene_material(0.0, 0.0);
    perp_body body;
    scene s;
    int side;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    body = body_of(&s, 0.0, 0.0);
    for (side = -1; side <= 1; side += 2) {
        shape.offset[1] = side * d;
        SCENE_OK(&s, perp_world_add_sphere(s.world, NULL, body, r, &shape));
    }
    shape.offset[1] = 0.0;
    shape.density = 500.0;
    shape.rotation[0] = shape.rotation[3] = sqrt(0.5); /* its long axis is y */
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, body, half, &shape));
    require_mass(&s, body, 2.0 * ball + bar, moments, "dumb-bell");
    scene_close(&s);
}

/* A box that lies askew in its body, and the same where the body does: products of inertia or none,
 * they tumble alike, fall on the ground alike, and no step gives energy. 1e-6: roundings of 300
 * steps and impacts, each of which makes some ten of them of one. */
static void test_askew(void **state)
{
    const double half[3] = {0.1, 0.2, 0.4}, spin[3] = {2.0, -3.0, 4.0};
    const double q[4] = {0.8, 0.36, 0.48, 0.0};
    perp_body bodies[2];
    perp_shape_settings shape = scene_material(0.0, 0.0);
    double energy = INFINITY, kinetic, potential;
    scene s;
    int k, i;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, perp_world_ground(s.world), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    for (k = 0; k < 2; k++) {
        perp_body_settings settings = scene_defaults();

        settings.mass = 0.0;
        settings.position[0] = 4.0 * k;
        settings.position[2] = 1.5;
        memcpy(settings.angular_velocity, spin, sizeof spin);
        memcpy(k == 0 ? settings.orientation : shape.rotation, q, sizeof q);
        bodies[k] = scene_add(&s, &settings);
        SCENE_OK(&s, perp_world_add_box(s.world, NULL, bodies[k], half, &shape));
    }
    for (i = 0; i < 300; i++) {
        const double last = energy;
        perp_body_state a, b;

        scene_step(&s, 0.005);
        a = scene_state(&s, bodies[0]);
        b = scene_state(&s, bodies[1]);
        SCENE_OK(&s, perp_world_energy(s.world, &kinetic, &potential));
        energy = kinetic + potential;
        assert_true(energy <= last + 1e-9 * fabs(energy));
        for (k = 0; k < 3; k++) {
            scene_near(a.angular_velocity[k], b.angular_velocity[k], 1e-6, "spin");
            scene_near(a.velocity[k], b.velocity[k], 1e-6, "velocity");
        }
    }
    scene_close(&s);
}

/* Shapes without mass leave mass and inertia at 1; masses count in ratio only. */
static void test_without_mass(void **state)
{
    const double ones[3] = {1.0, 1.0, 1.0}, half[3] = {0.5, 0.5, 0.5};
    perp_shape_settings shape = scene_material(0.0, 0.0);
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    body = body_of(&s, 0.0, 0.0);
    require_mass(&s, body, 1.0, ones, "no shapes");
    scene_sphere(&s, body, 0.0, 0.0, 0.0);
    shape.density = 0.0;
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, body, half, &shape));
    require_mass(&s, body, 1.0, ones, "shapes without mass");
    scene_close(&s);
}

/* Offsets are from the mass centre: a body whose shapes lie beside it is refused by the step,
 * unless its inertia is given or the shapes' centre comes back. */
static void test_centre(void **state)
{
    const double half[3] = {0.5, 0.5, 0.5};
    perp_shape_settings shape = scene_material(0.0, 0.0);
    perp_body body;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    body = body_of(&s, 1.0, 0.0);
    shape.offset[0] = 0.5;
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, body, half, &shape));
    assert_int_equal(perp_world_step(s.world, NULL, 0.01), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(s.context), "(0.5, 0, 0)"));
    assert_int_equal(perp_world_step(s.world, NULL, 0.01), PERP_ERROR_ARGUMENT);
    shape.offset[0] = -0.5;
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, body, half, &shape));
    scene_step(&s, 0.01);
    body = body_of(&s, 1.0, 1.0);
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, body, half, &shape));
    scene_step(&s, 0.01);
    scene_close(&s);
}

/* A shape without friction of its own has the world's. */
static void test_friction_of_the_world(void **state)
{
    const double half[3] = {0.5, 0.5, 0.5}, up[3] = {0.0, 0.0, 1.0};
    perp_world_settings world;
    perp_shape_settings own = scene_material(0.2, 0.0);
    perp_body_settings settings = scene_defaults();
    scene s;

    (void)state;
    assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
    world.friction = 0.8;
    scene_create(&s, &world);
    settings.position[2] = 0.5;
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, scene_add(&s, &settings), half, NULL));
    settings.position[0] = 2.0;
    SCENE_OK(&s, perp_world_add_box(s.world, NULL, scene_add(&s, &settings), half, &own));
    SCENE_OK(&s, perp_world_add_plane(s.world, NULL, s.ground, up, 0.0, NULL));
    scene_step(&s, 0.01);
    assert_true(scene_contact(&s, 0).friction == 0.8);
    scene_near(scene_contact(&s, 4).friction, 0.4, 4.0 * EPSILON, "mean of 0.2 and 0.8");
    world.friction = -0.5;
    assert_int_equal(perp_world_create(s.context, &s.world, &world), PERP_ERROR_ARGUMENT);
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_shape),
        cmocka_unit_test(test_planar),
        cmocka_unit_test(test_compound),
        cmocka_unit_test(test_askew),
        cmocka_unit_test(test_without_mass),
        cmocka_unit_test(test_centre),
        cmocka_unit_test(test_friction_of_the_world),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
