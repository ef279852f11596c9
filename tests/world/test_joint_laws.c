/* Limits, motors, friction and rest of joints, and joints beside contacts. */
#include "suite.h"

#include "world/joint_scene.h"

static const int32_t levels[] = {PERP_ACCURACY_FAST, PERP_ACCURACY_STANDARD, PERP_ACCURACY_ACCURATE,
                                 PERP_ACCURACY_EXACT};

/* ---- rest ---- */

/* What hangs at rest has velocity 0.0 and stays where it is, to the last bit, at every level. */
static void hang(int32_t accuracy, int32_t links, double weight)
{
    perp_body bodies[100], last;
    perp_body_state before[100];
    double impulse = 0.0;
    perp_joint top = 0;
    scene s;
    int i;

    joint_open(&s, 0, accuracy);
    last = s.ground;
    for (i = 0; i < links; i++) {
        const double mass = i == links - 1 ? weight : 1.0;
        const perp_body_settings settings =
            joint_body(mass, 0.02, 0.02, 0.01, 0.3, -0.7, -0.1 - 0.2 * i);
        const perp_joint_settings ball = joint_at(PERP_JOINT_BALL, 0.3, -0.7, -0.2 * i);
        perp_joint joint;

        bodies[i] = scene_add(&s, &settings);
        joint = joint_add(&s, last, bodies[i], &ball);
        top = i == 0 ? joint : top;
        last = bodies[i];
        before[i] = scene_state(&s, bodies[i]);
        impulse += mass * GRAVITY * 0.01;
    }
    scene_steps(&s, 200, 0.01);
    for (i = 0; i < links; i++) {
        const perp_body_state after = scene_state(&s, bodies[i]);

        assert_true(scene_rests(&s, bodies[i]));
        assert_memory_equal(after.position, before[i].position, sizeof after.position);
        assert_memory_equal(after.orientation, before[i].orientation, sizeof after.orientation);
    }
    scene_near(joint_state(&s, top).impulse[2], impulse, 1e-9 * impulse, "reaction"); /* tol */
    scene_close(&s);
}

static void test_rest(void **state)
{
    size_t k;

    (void)state;
    for (k = 0; k < sizeof levels / sizeof *levels; k++) {
        hang(levels[k], 1, 1.0);
        hang(levels[k], 10, 1.0);
        hang(levels[k], 100, 1.0);
        hang(levels[k], 10, 1e6);
    }
}

/* What is not at rest moves: 1e-9 radians off the vertical. */
static void test_almost_at_rest(void **state)
{
    const double tilt = 1e-9;
    const perp_body_settings settings = joint_body(1.0, 1e-3, 1e-3, 1e-3, tilt, 0.0, -1.0);
    const perp_joint_settings ball = joint_at(PERP_JOINT_BALL, 0.0, 0.0, 0.0);
    const double frequency = sqrt(GRAVITY / 1.001), t = 0.25 * 2.0 * PI / frequency;
    perp_body body;
    scene s;

    (void)state;
    joint_open(&s, 0, PERP_ACCURACY_STANDARD);
    body = scene_add(&s, &settings);
    joint_add(&s, s.ground, body, &ball);
    scene_steps(&s, 100, t / 100.0);
    /* a quarter of a period: speed frequency * tilt; second order, and rounding of positions */
    scene_near(scene_state(&s, body).velocity[0], -frequency * tilt, 1e-3 * frequency * tilt,
               "speed");
    scene_close(&s);
}

/* A beam on two hinges is held by ten rows on six coordinates. */
static void test_redundant(void **state)
{
    perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, 1.0, 0.0);
    perp_body_settings settings = joint_body(3.0, 0.1, 0.1, 0.1, 0.5, 0.0, 0.0);
    perp_joint joints[2];
    perp_body body;
    scene s;
    int k;

    (void)state;
    joint_open(&s, 0, PERP_ACCURACY_STANDARD);
    body = scene_add(&s, &settings);
    for (k = 0; k < 2; k++) {
        hinge.anchor[0] = k;
        joints[k] = joint_add(&s, s.ground, body, &hinge);
    }
    scene_steps(&s, 100, 0.01);
    assert_true(scene_rests(&s, body));
    assert_true(scene_state(&s, body).position[0] == 0.5);
    for (k = 0; k < 2; k++) /* half of the weight each, tol */
        scene_near(joint_state(&s, joints[k]).impulse[2], 1.5 * GRAVITY * 0.01, 1e-9, "reaction");
    scene_close(&s);
}

/* A sagging bridge of planks whose hinges are stiff, with boxes that land on it. */
static void test_bridge(void **state)
{
    enum { PLANKS = 10 };
    perp_body bodies[PLANKS + 3], last;
    perp_body_state before[PLANKS + 3];
    scene s;
    int i, k;

    (void)state;
    joint_open(&s, 0, PERP_ACCURACY_STANDARD);
    last = s.ground;
    for (i = 0; i <= PLANKS; i++) {
        const double z0 = 0.15 * PLANKS * (pow(2.0 * i / PLANKS - 1.0, 2.0) - 1.0);
        const double z1 = 0.15 * PLANKS * (pow(2.0 * (i + 1) / PLANKS - 1.0, 2.0) - 1.0);
        const double angle = -atan2(z1 - z0, 1.0), length = hypot(z1 - z0, 1.0);
        perp_body_settings settings = scene_defaults();
        perp_joint_settings hinge = joint_at(PERP_JOINT_REVOLUTE, i, 0.0, z0);

        hinge.axis[1] = 1.0;
        hinge.axis[2] = 0.0;
        hinge.friction = 1e4;
        settings.position[0] = i + 0.5;
        settings.position[2] = 0.5 * (z0 + z1);
        settings.orientation[0] = cos(0.5 * angle);
        settings.orientation[2] = sin(0.5 * angle);
        if (i < PLANKS) {
            bodies[i] = scene_add(&s, &settings);
            scene_box(&s, bodies[i], 0.5 * length - 0.02, 0.5, 0.05, 0.5, 0.0);
        }
        joint_add(&s, last, i < PLANKS ? bodies[i] : s.ground, &hinge);
        last = bodies[i < PLANKS ? i : 0];
        if (i != 2 && i != 5 && i != 7)
            continue;
        settings.position[2] += 0.4 / cos(angle);
        bodies[PLANKS + i / 3] = scene_add(&s, &settings);
        scene_box(&s, bodies[PLANKS + i / 3], 0.3, 0.3, 0.3, 0.5, 0.0);
    }
    for (k = 0; k < 300; k++)
        SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
    for (i = 0; i < PLANKS + 3; i++)
        before[i] = scene_state(&s, bodies[i]);
    scene_steps(&s, 100, 0.01);
    for (i = 0; i < PLANKS + 3; i++) {
        const perp_body_state after = scene_state(&s, bodies[i]);

        assert_true(scene_rests(&s, bodies[i]));
        assert_memory_equal(after.position, before[i].position, sizeof after.position);
    }
    scene_close(&s);
}

/* ---- limits ---- */

/* A block slides down a slope along a rail to its stop: s = g sin(a) t^2 / 2, then 0.0. */
static void test_stop_on_a_slope(void **state)
{
    const double slope = 0.3, mass = 2.0, pull = GRAVITY * sin(slope);
    perp_body_settings settings = joint_body(mass, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0);
    perp_joint_settings rail = joint_along(PERP_JOINT_PRISMATIC, cos(slope), 0.0, -sin(slope));
    perp_joint_state found;
    perp_body body;
    perp_joint joint;
    scene s;

    (void)state;
    joint_open(&s, 0, PERP_ACCURACY_STANDARD);
    body = scene_add(&s, &settings);
    rail.upper = 1.0;
    joint = joint_add(&s, s.ground, body, &rail);
    scene_steps(&s, 50, 0.01);
    found = joint_state(&s, joint); /* a constant acceleration: exact but for rounding */
    scene_near(found.position, 0.5 * pull * 0.25, 1e-13, "way");
    scene_near(found.speed, 0.5 * pull, 1e-13, "speed");
    assert_int_equal(found.at_limit, 0);
    scene_steps(&s, 100, 0.01);
    found = joint_state(&s, joint);
    scene_near(found.position, 1.0, 1e-12, "the stop"); /* what a projection leaves alone */
    assert_true(scene_rests(&s, body));
    assert_int_equal(found.at_limit, 1);
    scene_near(found.limit_impulse, -mass * pull * 0.01, 1e-10, "force of the stop");
    scene_near(found.impulse[2], mass * GRAVITY * 0.01, 1e-10, "reaction");
    SCENE_OK(&s, perp_world_set_joint_limits(s.world, joint, -INFINITY, 2.0));
    scene_step(&s, 0.01);
    scene_near(joint_state(&s, joint).speed, pull * 0.01, 1e-13, "released");
    scene_close(&s);
}

/* A hinge that stops past a whole turn: turns are counted. */
static void test_stop_past_a_turn(void **state)
{
    perp_body_settings settings = joint_body(1.0, 0.1, 0.1, 0.1, 0.0, 0.0, 0.0);
    perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, 0.0, 1.0);
    perp_joint joint;
    scene s;
    int planar;

    (void)state;
    for (planar = 0; planar < 2; planar++) {
        scene_open(&s, planar, 0.0, 0.0, 0.0);
        settings.angular_velocity[2] = -5.0;
        hinge.lower = -15.0;
        hinge.upper = 3.0;
        joint = joint_add(&s, s.ground, scene_add(&s, &settings), &hinge);
        scene_steps(&s, 299, 0.01);
        scene_near(joint_state(&s, joint).position, -14.95, 1e-12, "before");
        scene_steps(&s, 10, 0.01);
        scene_near(joint_state(&s, joint).position, -15.0, 1e-12, "the stop");
        assert_true(joint_state(&s, joint).speed == 0.0);
        scene_close(&s);
    }
}

/* A weight on a rope falls freely, then hangs. */
static void test_rope(void **state)
{
    perp_body_settings settings = joint_body(1.0, 0.1, 0.1, 0.1, 0.0, 0.0, -1.0);
    perp_joint_settings rope = joint_at(PERP_JOINT_DISTANCE, 0.0, 0.0, 0.0);
    perp_joint joint;
    perp_body body;
    scene s;

    (void)state;
    joint_open(&s, 0, PERP_ACCURACY_STANDARD);
    body = scene_add(&s, &settings);
    rope.anchor_b[2] = -1.0;
    rope.lower = 0.0;
    rope.upper = 2.0;
    joint = joint_add(&s, s.ground, body, &rope);
    scene_steps(&s, 40, 0.01);
    scene_near(joint_state(&s, joint).position, 1.0 + 0.5 * GRAVITY * 0.16, 1e-12, "falling");
    scene_steps(&s, 60, 0.01);
    scene_near(joint_state(&s, joint).position, 2.0, 1e-12, "hanging");
    assert_true(scene_rests(&s, body));
    scene_near(joint_state(&s, joint).impulse[2], GRAVITY * 0.01, 1e-12, "reaction");
    scene_close(&s);
}

/* ---- motors and friction ---- */

static perp_joint add_wheel(scene *s, double inertia, double speed)
{
    perp_body_settings settings = joint_body(1.0, inertia, inertia, inertia, 0.0, 0.0, 0.0);
    const perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, 0.0, 1.0);

    settings.angular_velocity[2] = speed;
    return joint_add(s, s->ground, scene_add(s, &settings), &hinge);
}

/* I w' = T until w is the motor's speed, which it keeps without any torque. */
static void test_motor(void **state)
{
    perp_joint_state found;
    perp_joint joint;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    joint = add_wheel(&s, 2.0, 0.0);
    SCENE_OK(&s, perp_world_set_joint_motor(s.world, joint, 3.0, 4.0));
    scene_steps(&s, 100, 0.01);
    found = joint_state(&s, joint);
    scene_near(found.speed, 2.0, 1e-13, "speed");
    scene_near(found.position, 1.0, 1e-13, "angle");
    scene_near(found.motor_impulse, 0.04, 1e-15, "torque");
    scene_near(found.moment[2], 0.04, 1e-15, "moment");
    scene_steps(&s, 100, 0.01);
    found = joint_state(&s, joint);
    scene_near(found.speed, 3.0, 1e-13, "speed");
    scene_near(found.motor_impulse, 0.0, 1e-13, "torque");
    scene_close(&s);
}

/* An arm that a motor lifts: it stalls below the torque m g l, and holds at 0.0. */
static void test_stall(void **state)
{
    const double torque = 2.0 * GRAVITY * 0.5;
    perp_body_settings settings = joint_body(2.0, 0.1, 0.1, 0.1, 0.5, 0.0, 0.0);
    perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, -1.0, 0.0);
    int weak;

    (void)state;
    for (weak = 0; weak < 2; weak++) {
        perp_joint joint;
        perp_body body;
        scene s;

        joint_open(&s, 0, PERP_ACCURACY_STANDARD);
        body = scene_add(&s, &settings);
        hinge.motor_speed = 0.0;
        hinge.motor_force = torque * (weak ? 1.0 - 1e-9 : 1.0 + 1e-9);
        joint = joint_add(&s, s.ground, body, &hinge);
        scene_steps(&s, 100, 0.01);
        if (weak) /* I w' = -1e-9 m g l */
            scene_near(joint_state(&s, joint).speed, -1e-9 * torque / 0.6, 1e-11, "speed");
        else
            assert_true(scene_rests(&s, body));
        scene_near(joint_state(&s, joint).motor_impulse, 0.01 * torque, 1e-9, "torque");
        scene_close(&s);
    }
}

/* Dry friction stops a wheel after I w / T, and sticks. */
static void test_friction(void **state)
{
    perp_joint_state found;
    perp_joint joint;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    joint = add_wheel(&s, 2.0, 3.0);
    SCENE_OK(&s, perp_world_set_joint_friction(s.world, joint, 4.0));
    scene_steps(&s, 100, 0.01);
    found = joint_state(&s, joint);
    scene_near(found.speed, 1.0, 1e-13, "speed");
    scene_near(found.position, 2.0, 1e-13, "angle");
    scene_near(found.friction_impulse, -0.04, 1e-15, "torque");
    scene_steps(&s, 100, 0.01);
    found = joint_state(&s, joint);
    assert_true(found.speed == 0.0);
    scene_near(found.position, 2.25, 1e-12, "angle"); /* 1.5 s at constant deceleration */
    scene_close(&s);
}

/* A motor between two free wheels turns them against each other. */
static void test_motor_between(void **state)
{
    perp_body_settings settings = joint_body(1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, 0.0, 1.0);
    perp_body bodies[2];
    scene s;
    int k, planar;

    (void)state;
    for (planar = 0; planar < 2; planar++) {
        scene_open(&s, planar, 0.0, 0.0, 0.0);
        for (k = 0; k < 2; k++) {
            settings.inertia[8] = 1.0 + k;
            bodies[k] = scene_add(&s, &settings);
        }
        hinge.motor_speed = 1e3;
        hinge.motor_force = 6.0;
        joint_add(&s, bodies[0], bodies[1], &hinge);
        scene_steps(&s, 100, 0.01);
        scene_near(scene_state(&s, bodies[0]).angular_velocity[2], -6.0, 1e-12, "A");
        scene_near(scene_state(&s, bodies[1]).angular_velocity[2], 3.0, 1e-12, "B");
        scene_close(&s);
    }
}

/* ---- beside contacts and what moves as it is told ---- */

/* Fixed to a moving platform, a body has its velocity to the last bit. */
static void test_carried(void **state)
{
    perp_body_settings settings = scene_settings();
    const perp_joint_settings weld = joint_at(PERP_JOINT_FIXED, 0.0, 0.0, 0.0);
    perp_body platform, body;
    scene s;

    (void)state;
    joint_open(&s, 0, PERP_ACCURACY_STANDARD);
    settings.kind = PERP_BODY_KINEMATIC;
    settings.velocity[0] = 0.3;
    platform = scene_add(&s, &settings);
    settings.kind = PERP_BODY_DYNAMIC;
    settings.velocity[0] = 0.0;
    settings.position[2] = 1.0;
    body = scene_add(&s, &settings);
    joint_add(&s, platform, body, &weld);
    scene_steps(&s, 10, 0.01);
    assert_true(scene_state(&s, body).velocity[0] == 0.3);
    assert_true(scene_state(&s, body).velocity[2] == 0.0);
    scene_close(&s);
}

/* A cart of a chassis and two wheels rolls down a slope: a = g sin(a) M / (M + 2 I / r^2). */
static void test_cart(void **state)
{
    const double slope = 0.2, r = 0.1, wheel = 0.5, chassis = 2.0, inertia = 0.5 * wheel * r * r;
    const double total = chassis + 2.0 * wheel;
    const double expected = GRAVITY * sin(slope) * total / (total + 2.0 * inertia / (r * r));
    perp_body_settings settings;
    perp_body body, wheels[2];
    scene s;
    int k;

    (void)state;
    joint_open(&s, 1, PERP_ACCURACY_STANDARD);
    scene_plane(&s, s.ground, sin(slope), cos(slope), 0.0, 0.0, 0.8, 0.0);
    settings = joint_body(chassis, 1.0, 1.0, 0.1, r * sin(slope), r * cos(slope), 0.0);
    body = scene_add(&s, &settings);
    for (k = 0; k < 2; k++) {
        const double along = k == 0 ? -0.3 : 0.3;
        const double x = r * sin(slope) + along * cos(slope),
                     y = r * cos(slope) - along * sin(slope);
        const perp_joint_settings axle = joint_at(PERP_JOINT_REVOLUTE, x, y, 0.0);

        settings = joint_body(wheel, 1.0, 1.0, inertia, x, y, 0.0);
        wheels[k] = scene_add(&s, &settings);
        scene_sphere(&s, wheels[k], r, 0.8, 0.0);
        joint_add(&s, body, wheels[k], &axle);
    }
    scene_steps(&s, 100, 0.01);
    scene_near(hypot(scene_state(&s, body).velocity[0], scene_state(&s, body).velocity[1]),
               expected, 1e-8,
               "speed after a second"); /* a constant acceleration; tol of 100 steps */
    scene_near(scene_state(&s, wheels[0]).angular_velocity[2], -expected / r, 1e-7, "rolling");
    scene_close(&s);
}

static void first_axis(const double *q, double *x)
{
    x[0] = 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]);
    x[1] = 2.0 * (q[1] * q[2] + q[0] * q[3]);
    x[2] = 2.0 * (q[1] * q[3] - q[0] * q[2]);
}

/* Chains of capsules fall into a heap, more contacts than are solved to tol below `exact`: effort
 * is bounded, joints hold all the same, and energy does not grow but for terms of second order. */
static void heap_chains(int32_t accuracy)
{
    enum { CHAINS = 3, LINKS = 6 };
    const double half = 0.1, radius = 0.04, reach = half + 1.2 * radius;
    perp_body bodies[CHAINS][LINKS];
    double energy, begun;
    int32_t contacts = 0, k, i, step, c;
    scene s;

    joint_open(&s, 0, accuracy);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    for (k = 0; k < CHAINS; k++)
        for (i = 0; i < LINKS; i++) {
            perp_body_settings settings = scene_settings();
            perp_shape_settings shape = scene_material(0.5, 0.0);
            const double x = 2.0 * reach * i - 0.7, z = 0.2 + 0.15 * k;
            perp_joint_settings ball = joint_at(PERP_JOINT_BALL, x - reach, 0.05 * k, z);
            perp_shape id;

            settings.position[0] = x;
            settings.position[1] = 0.05 * k;
            settings.position[2] = z;
            settings.velocity[1] = 0.5 * (k - 1) * (i % 2 ? 1.0 : -1.0);
            bodies[k][i] = scene_add(&s, &settings);
            SCENE_OK(&s, perp_world_add_capsule(s.world, &id, bodies[k][i], radius, half, &shape));
            if (i > 0)
                joint_add(&s, bodies[k][i - 1], bodies[k][i], &ball);
        }
    begun = energy = joint_energy(&s);
    for (step = 0; step < 150; step++) {
        perp_step_result result = fresh_step_result();
        double now;

        SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
        assert_true(result.outcome == PERP_OUTCOME_SOLVED ||
                    result.outcome == PERP_OUTCOME_ROUNDING_LIMIT ||
                    result.outcome == PERP_OUTCOME_ITERATION_LIMIT);
        now = joint_energy(&s);
        assert_true(now - energy <= 1e-4 * begun); /* joints that swing, docs/joints.md */
        energy = now;
        contacts = result.contacts > contacts ? result.contacts : contacts;
        for (k = 0; k < CHAINS; k++)
            for (i = 1; i < LINKS; i++) { /* the ends that a joint holds together */
                const perp_body_state a = scene_state(&s, bodies[k][i - 1]);
                const perp_body_state b = scene_state(&s, bodies[k][i]);
                double x[3], y[3];

                first_axis(a.orientation, x);
                first_axis(b.orientation, y);
                for (c = 0; c < 3; c++) /* the projection leaves terms of fourth order */
                    assert_true(fabs(a.position[c] + reach * x[c] - b.position[c] + reach * y[c]) <=
                                1e-7 * reach);
            }
    }
    assert_true(contacts > 20);
    scene_close(&s);
}

/* ---- rows that repeat others ---- */

static void add_moment(scene *s, perp_body body, double inertia, double *moment)
{
    const perp_body_state at = scene_state(s, body);

    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;

        moment[k] += at.position[i] * at.velocity[j] - at.position[j] * at.velocity[i] +
                     inertia * at.angular_velocity[k];
    }
}

/* Two round bodies of mass 1 that turn as one, w = (1, 2, 2), about the place between them, and
 * have two hinges; or one, and `tied` to the ground a ball each there. */
static void turn_doors(int32_t accuracy, int tied)
{
    const double h = 0.01, w[3] = {1.0, 2.0, 2.0};
    double begun[3] = {0.0}, ended[3] = {0.0};
    perp_world_settings settings;
    perp_body bodies[2];
    scene s;

    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
    settings.accuracy = accuracy;
    for (int k = 0; k < 3; k++)
        settings.gravity[k] = 0.0;
    scene_create(&s, &settings);
    for (int i = 0; i < 2; i++) {
        perp_body_settings body = joint_body(1.0, 0.1, 0.1, 0.1, i == 0 ? -0.5 : 0.5, 0.0, 0.0);

        body.velocity[1] = w[2] * body.position[0];
        body.velocity[2] = -w[1] * body.position[0];
        memcpy(body.angular_velocity, w, sizeof w);
        bodies[i] = scene_add(&s, &body);
    }
    for (int i = 0; i < 2; i++) {
        perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.36, 0.48, 0.8);
        const perp_joint_settings ball = joint_at(PERP_JOINT_BALL, 0.0, 0.0, 0.0);

        for (int k = 0; k < 3; k++)
            hinge.anchor[k] = (tied + i) * 0.5 * hinge.axis[k];
        if (tied)
            (void)joint_add(&s, s.ground, bodies[i], &ball);
        if (!tied || i == 0)
            (void)joint_add(&s, bodies[0], bodies[1], &hinge);
        add_moment(&s, bodies[i], 0.1, begun);
    }
    for (int step = 0; step < 50; step++)
        assert_int_equal(scene_step(&s, h).outcome, PERP_OUTCOME_SOLVED);
    for (int i = 0; i < 2; i++)
        add_moment(&s, bodies[i], 0.1, ended);
    for (int k = 0; k < 3; k++) /* (|w| h)^3 a step */
        assert_true(fabs(ended[k] - begun[k]) <= 50 * 2.7e-5 * 2.0);
    scene_close(&s);
}

/* Angular momentum stays with hinges that say the same, on both bodies or to the ground. */
static void test_doors_that_turn(void **state)
{
    (void)state;
    for (int i = 0; i < 8; i++)
        turn_doors(levels[i / 2], i % 2);
}

static void test_heap_of_chains(void **state)
{
    (void)state;
    heap_chains(PERP_ACCURACY_FAST);
    heap_chains(PERP_ACCURACY_STANDARD);
    heap_chains(PERP_ACCURACY_ACCURATE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rest),
        cmocka_unit_test(test_almost_at_rest),
        cmocka_unit_test(test_redundant),
        cmocka_unit_test(test_bridge),
        cmocka_unit_test(test_stop_on_a_slope),
        cmocka_unit_test(test_stop_past_a_turn),
        cmocka_unit_test(test_rope),
        cmocka_unit_test(test_motor),
        cmocka_unit_test(test_stall),
        cmocka_unit_test(test_friction),
        cmocka_unit_test(test_motor_between),
        cmocka_unit_test(test_carried),
        cmocka_unit_test(test_cart),
        cmocka_unit_test(test_heap_of_chains),
        cmocka_unit_test(test_doors_that_turn),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
