/* Bodies on joints that are hit, and that move fast: bounces as closed forms have them, nothing
 * passes a thin plate, joints stay closed, and energy never grows. */
#include "suite.h"

#include "world/joint_scene.h"

static const int32_t levels[] = {PERP_ACCURACY_FAST, PERP_ACCURACY_STANDARD, PERP_ACCURACY_ACCURATE,
                                 PERP_ACCURACY_EXACT};

/* Without gravity, or with it down y. */
static void open_level(scene *s, int32_t planar, int32_t accuracy, double gravity)
{
    perp_world_settings settings;

    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, planar), PERP_OK);
    settings.accuracy = accuracy;
    settings.gravity[0] = settings.gravity[2] = 0.0;
    settings.gravity[1] = -gravity;
    scene_create(s, &settings);
}

/* A static box about (x, y, 0). */
static void put_box(scene *s, double x, double y, double half_x, double half_y, double restitution)
{
    perp_shape_settings settings = scene_material(0.0, restitution);
    const double half_extents[3] = {half_x, half_y, 3.0};

    settings.offset[0] = x;
    settings.offset[1] = y;
    SCENE_OK(s, perp_world_add_box(s->world, NULL, s->ground, half_extents, &settings));
}

/* A bob at the angle from straight below the origin, which turns about it. */
static perp_body add_bob(scene *s, double radius, double angle, double rate, int32_t is_box,
                         double restitution)
{
    const double inertia = 0.4 * radius * radius;
    perp_body_settings settings =
        joint_body(1.0, inertia, inertia, inertia, sin(angle), -cos(angle), 0.0);
    perp_joint_settings hinge = joint_at(PERP_JOINT_REVOLUTE, 0.0, 0.0, 0.0);
    perp_body body;

    settings.velocity[0] = rate * cos(angle);
    settings.velocity[1] = rate * sin(angle);
    settings.angular_velocity[2] = rate;
    body = scene_add(s, &settings);
    if (is_box)
        scene_box(s, body, radius, radius, radius, 0.0, restitution);
    else
        scene_sphere(s, body, radius, 0.0, restitution);
    hinge.collides = 1; /* the plates are on the ground, as the hinge is */
    joint_add(s, s->ground, body, &hinge);
    return body;
}

/* ---- thin plates ---- */

/* A bob swings against a plate of 1 mm: it stays before it, on its circle, and gains nothing. */
static void hit_plate(int32_t planar, int32_t accuracy, double speed, double dt, int32_t is_box,
                      double restitution)
{
    perp_body body;
    double energy;
    scene s;
    int k;

    open_level(&s, planar, accuracy, 0.0);
    put_box(&s, 0.3, -1.0, 0.0005, 3.0, restitution);
    body = add_bob(&s, 0.05, 0.0, speed, is_box, restitution);
    energy = joint_energy(&s);
    for (k = 0; k < 20; k++) {
        perp_body_state at;

        scene_step(&s, dt);
        at = scene_state(&s, body);
        assert_true(at.position[0] < 0.3 - 0.0005 - (is_box ? 0.0 : 0.05 - 1e-9));
        /* third order of a radian, less what passes of the projection take of it */
        scene_near(hypot(at.position[0], at.position[1]), 1.0, 1e-6, "the circle");
        /* third order a step: at a radian a step no more than 1/32 is let pass in one */
        assert_true(joint_energy(&s) <= 1.04 * energy);
    }
    scene_close(&s);
}

static void test_plate(void **state)
{
    static const double speeds[] = {30.0, 300.0, 1000.0};
    int planar, is_box, e;
    size_t level, i;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (level = 0; level < sizeof levels / sizeof *levels; level++)
            for (i = 0; i < sizeof speeds / sizeof *speeds; i++)
                for (is_box = 0; is_box < 2; is_box++)
                    for (e = 0; e < 2; e++) {
                        hit_plate(planar, levels[level], speeds[i], 0.01, is_box, e);
                        hit_plate(planar, levels[level], speeds[i], 0.001, is_box, e);
                    }
}

/* A chain of links that turns as one about its hinge whips against a plate. */
static void whip(int32_t planar, int32_t accuracy, double speed, double dt, double restitution)
{
    enum { LINKS = 10 };
    const double length = 0.2, thin = 1e-4, rate = speed / (LINKS * length);
    const double inertia = length * length / 12.0;
    perp_body bodies[LINKS], last;
    double energy;
    scene s;
    int i, k;

    open_level(&s, planar, accuracy, 0.0);
    put_box(&s, 0.5, -1.0, 0.0005, 5.0, restitution);
    last = s.ground;
    for (i = 0; i < LINKS; i++) {
        const double y = -(i + 0.5) * length;
        perp_body_settings settings = joint_body(1.0, inertia, thin, inertia, 0.0, y, 0.0);
        const perp_joint_settings hinge = joint_at(PERP_JOINT_REVOLUTE, 0.0, -i * length, 0.0);

        settings.velocity[0] = -y * rate;
        settings.angular_velocity[2] = rate;
        bodies[i] = scene_add(&s, &settings);
        scene_box(&s, bodies[i], 0.01, 0.5 * length - 0.02, 0.01, 0.0, restitution);
        joint_add(&s, last, bodies[i], &hinge);
        last = bodies[i];
    }
    energy = joint_energy(&s);
    for (k = 0; k < 12; k++) {
        double end[2] = {0.0, 0.0};

        SCENE_OK(&s, perp_world_step(s.world, NULL, dt));
        assert_true(joint_energy(&s) <= 1.04 * energy);
        for (i = 0; i < LINKS; i++) {
            const perp_body_state at = scene_state(&s, bodies[i]);
            const double angle =
                planar ? at.angle : 2.0 * atan2(at.orientation[3], at.orientation[0]);
            const double up[2] = {-0.5 * length * sin(angle), 0.5 * length * cos(angle)};

            assert_true(at.position[0] < 0.5);
            scene_near(at.position[0] + up[0], end[0], 1e-6, "hinge"); /* as for the plate */
            scene_near(at.position[1] + up[1], end[1], 1e-6, "hinge");
            end[0] = at.position[0] - up[0];
            end[1] = at.position[1] - up[1];
        }
    }
    scene_close(&s);
}

static void test_whip(void **state)
{
    int planar, e;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (e = 0; e < 2; e++) {
            whip(planar, PERP_ACCURACY_FAST, 1000.0, 0.001, e);
            whip(planar, PERP_ACCURACY_STANDARD, 100.0, 0.001, e);
            whip(planar, PERP_ACCURACY_STANDARD, 1000.0, 0.01, e);
            whip(planar, PERP_ACCURACY_ACCURATE, 300.0, 0.001, e);
            whip(planar, PERP_ACCURACY_EXACT, 300.0, 0.001, e);
        }
}

/* A step is one where joints turn little, whatever turns in their bearings, and as many as it takes
 * where they turn far: what is one step of two is two of one. */
static void test_parts(void **state)
{
    perp_step_result result = fresh_step_result();
    perp_body_state whole, halves;
    perp_body body;
    scene s;

    (void)state;
    open_level(&s, 1, PERP_ACCURACY_STANDARD, 0.0);
    body = add_bob(&s, 0.05, 0.0, 1.0, 0, 0.0);
    SCENE_OK(&s, perp_world_step(s.world, &result, 0.1));
    assert_int_equal(result.steps, 1);
    SCENE_OK(&s, perp_world_step(s.world, &result, 1.5));
    assert_true(result.steps == 2 || result.steps == 4);
    assert_true(isnan(result.error));
    whole = scene_state(&s, body);
    scene_close(&s);
    open_level(&s, 1, PERP_ACCURACY_STANDARD, 0.0);
    body = add_bob(&s, 0.05, 0.0, 1.0, 0, 0.0);
    scene_step(&s, 0.1);
    scene_steps(&s, result.steps, 1.5 / result.steps);
    halves = scene_state(&s, body);
    assert_memory_equal(&whole, &halves, sizeof whole);
    scene_close(&s);
    open_level(&s, 0, PERP_ACCURACY_STANDARD, 0.0); /* a wheel, which only turns on its axis */
    {
        const perp_body_settings settings = joint_body(1.0, 1.0, 1.0, 2.0, 0.3, 0.1, 0.0);
        perp_joint_settings hinge = joint_at(PERP_JOINT_REVOLUTE, 0.3, 0.1, 0.0);

        hinge.motor_speed = 1e3;
        hinge.motor_force = INFINITY;
        joint_add(&s, s.ground, scene_add(&s, &settings), &hinge);
    }
    SCENE_OK(&s, perp_world_step(s.world, &result, 0.1));
    SCENE_OK(&s, perp_world_step(s.world, &result, 0.1));
    assert_int_equal(result.steps, 1);
    scene_close(&s);
    open_level(&s, 1, PERP_ACCURACY_STANDARD, 0.0); /* and a stop that is reached, at 0.15 a step */
    {
        perp_body_settings settings = joint_body(1.0, 1.0, 1.0, 0.1, 0.0, -0.5, 0.0);
        perp_joint_settings hinge = joint_at(PERP_JOINT_REVOLUTE, 0.0, 0.0, 0.0);

        settings.angular_velocity[2] = 15.0;
        settings.velocity[0] = 7.5;
        hinge.upper = 0.1;
        joint_add(&s, s.ground, scene_add(&s, &settings), &hinge);
    }
    SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
    assert_int_equal(result.steps, 1);
    scene_close(&s);
}

/* ---- bounces ---- */

/* A chain that falls with one end first: the hit turns the last link by more than a quarter of a
 * radian a step, which is no more than that motion itself has, and the step stays whole. The links'
 * ends meet to 1e-6 of a length, as those of whip(), and the hit gives no energy. */
static void test_hit_whole(void **state)
{
    enum { LINKS = 6 };
    const double length = 0.4, thin = 0.02, tilt = 0.8, up[2] = {sin(tilt), cos(tilt)};
    const double inertia = (length * length + thin * thin) / 12.0;
    perp_step_result result = fresh_step_result();
    int level, k, hits = 0;

    (void)state;
    for (level = 0; level < 2; level++) {
        perp_body bodies[LINKS];
        double energy;
        scene s;

        open_level(&s, 0, levels[level], 0.0);
        put_box(&s, 0.0, -1.0, 5.0, 1.0, 0.0);
        for (k = 0; k < LINKS; k++) {
            const double along = (k + 0.5) * length, start = k * length;
            perp_body_settings settings = joint_body(1.0, thin * thin / 6.0, inertia, inertia,
                                                     along * up[1], along * up[0] + 0.1, 0.0);
            const perp_joint_settings hinge =
                joint_at(PERP_JOINT_REVOLUTE, start * up[1], start * up[0] + 0.1, 0.0);

            settings.velocity[1] = -10.0;
            settings.orientation[0] = cos(0.5 * tilt);
            settings.orientation[3] = sin(0.5 * tilt);
            bodies[k] = scene_add(&s, &settings);
            scene_box(&s, bodies[k], 0.5 * length - 0.02, 0.5 * thin, 0.5 * thin, 0.0, 0.0);
            if (k > 0)
                joint_add(&s, bodies[k - 1], bodies[k], &hinge);
        }
        energy = joint_energy(&s);
        for (k = 0; k < 3; k++) {
            const double before = scene_state(&s, bodies[0]).angular_velocity[2];
            SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
            assert_int_equal(result.steps, 1);
            hits += fabs(scene_state(&s, bodies[0]).angular_velocity[2] - before) > 25.0;
            assert_true(joint_energy(&s) <= energy * (1.0 + 1e-9)); /* rounding */
        }
        for (k = 1; k < LINKS; k++) {
            const perp_body_state a = scene_state(&s, bodies[k - 1]),
                                  b = scene_state(&s, bodies[k]);
            const double turn[2] = {2.0 * atan2(a.orientation[3], a.orientation[0]),
                                    2.0 * atan2(b.orientation[3], b.orientation[0])};

            scene_near(a.position[0] + 0.5 * length * cos(turn[0]),
                       b.position[0] - 0.5 * length * cos(turn[1]), 1e-6 * length, "link");
            scene_near(a.position[1] + 0.5 * length * sin(turn[0]),
                       b.position[1] - 0.5 * length * sin(turn[1]), 1e-6 * length, "link");
        }
        scene_close(&s);
    }
    assert_true(hits >= 2); /* else nothing was tried */
}

/* Without gravity: to the wall at the rate w, then back at e w. Returns the error of the angle,
 * which is that of a chord for each arc: turn^2 / 12 of the way, and terms of fourth order. */
static double swing_back(int32_t planar, int32_t accuracy, double e, double rate, double dt)
{
    const double radius = 0.05, wall = 0.3, reach = asin(wall - radius);
    const int steps = (int)lround(3.0 * reach / rate / dt);
    const double left = steps * dt - reach / rate;
    const double turn = rate * dt;
    double error;
    perp_body_state at;
    perp_body body;
    scene s;

    open_level(&s, planar, accuracy, 0.0);
    put_box(&s, wall + 0.5, -1.0, 0.5, 3.0, e);
    body = add_bob(&s, radius, 0.0, rate, 0, e);
    scene_steps(&s, steps, dt);
    at = scene_state(&s, body);
    /* a step of a free pendulum loses turn^4 / 12 of its energy or less; the last one before the
     * wall, and the first one after it, turn^3 */
    scene_near(at.angular_velocity[2], -e * rate, 0.2 * pow(turn, 3.0) * rate, "rate");
    scene_close(&s);
    error = fabs(atan2(at.position[0], -at.position[1]) - (reach - e * rate * left));
    assert_true(error <= 1.05 * turn * turn / 12.0 * (reach + e * rate * left));
    return error;
}

static void test_swing_back(void **state)
{
    size_t level;
    int planar, half;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (level = 0; level < sizeof levels / sizeof *levels; level++)
            for (half = 0; half < 2; half++) {
                const double e = half ? 0.5 : 1.0;
                const double coarse = swing_back(planar, levels[level], e, 2.0, 0.005);
                const double fine = swing_back(planar, levels[level], e, 2.0, 0.0025);

                scene_near(coarse / fine, 4.0, 0.4, "order two");
            }
}

/* Let go at an angle, a bob meets a wall straight below, and rises to e^2 of its height. */
static void test_height(void **state)
{
    static const double restitution[] = {1.0, 0.8, 0.5};
    const double angle = 0.6, radius = 0.05, fall = 1.0 - cos(angle);
    size_t i, level;

    (void)state;
    for (level = 0; level < sizeof levels / sizeof *levels; level++)
        for (i = 0; i < sizeof restitution / sizeof *restitution; i++) {
            const double e = restitution[i];
            double before = 0.0, height = 0.0;
            int k, rises = 0;
            perp_body body;
            scene s;

            open_level(&s, 1, levels[level], GRAVITY);
            put_box(&s, radius + 0.5, -1.0, 0.5, 3.0, e);
            body = add_bob(&s, radius, -angle, 0.0, 0, e);
            for (k = 0; k < 150 && !(rises && height < before); k++) {
                before = rises ? height : 0.0;
                scene_step(&s, 0.01);
                rises |= scene_state(&s, body).velocity[0] < 0.0;
                height = 1.0 + scene_state(&s, body).position[1];
            }
            /* of the goals for bounces, 1e-3; and the top is between two steps, g dt^2 / 8 */
            scene_near(before, e * e * fall, 1e-3 * fall + GRAVITY * 1e-4 / 8.0, "height");
            scene_close(&s);
        }
}

/* With e = 1 it loses less than 1e-3 of its energy, and gains none, in 30 s of bounces. */
static void test_bounces(void **state)
{
    const double angle = 0.6, radius = 0.05;
    int planar, k;

    (void)state;
    for (planar = 0; planar < 2; planar++) {
        double energy;
        scene s;

        open_level(&s, planar, PERP_ACCURACY_STANDARD, GRAVITY);
        put_box(&s, radius + 0.5, -1.0, 0.5, 3.0, 1.0);
        add_bob(&s, radius, -angle, 0.0, 0, 1.0);
        energy = joint_energy(&s) + GRAVITY; /* of what lies below */
        for (k = 0; k < 3000; k++) {
            scene_step(&s, 0.01);
            /* within a swing second order: 0.02 a step, squared */
            assert_true(joint_energy(&s) + GRAVITY <= energy * (1.0 + 4e-4));
        }
        scene_near(joint_energy(&s) + GRAVITY, energy, 1e-3 * energy, "energy");
        scene_close(&s);
    }
}

/* ---- doors ---- */

static const double door_mass = 5.0, door_arm = 0.8;

/* A ball flies at a door that hangs from the origin; returns the ball. The hinge's angle may go
 * from lower to upper. */
static perp_body throw_at_door(scene *s, double speed, double e, double lower, double upper,
                               perp_body *door)
{
    const double bar = door_mass / 12.0, ball = 0.4 * 0.05 * 0.05;
    perp_body_settings settings = joint_body(door_mass, bar, 0.1, bar, 0.0, -0.5, 0.0);
    perp_joint_settings hinge = joint_at(PERP_JOINT_REVOLUTE, 0.0, 0.0, 0.0);
    perp_body thrown;

    *door = scene_add(s, &settings);
    scene_box(s, *door, 0.02, 0.5, 0.5, 0.0, e);
    hinge.lower = lower;
    hinge.upper = upper;
    joint_add(s, s->ground, *door, &hinge);
    settings = joint_body(1.0, ball, ball, ball, -0.0705 - 0.5 * speed * 0.01, -door_arm, 0.0);
    settings.velocity[0] = speed;
    thrown = scene_add(s, &settings);
    scene_sphere(s, thrown, 0.05, 0.0, e);
    return thrown;
}

/* The ball's velocity is that of an impact on the door's inertia, also where a stop is near, which
 * is not reached then; the door's energy is what the ball lost. At its stop it is a wall. */
static void test_door(void **state)
{
    static const double stops[] = {INFINITY, 0.05, 0.0};
    const double inertia = door_mass / 3.0;
    int planar, i, k, half;
    size_t level;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (level = 0; level < sizeof levels / sizeof *levels; level++)
            for (i = 0; i < 3; i++)
                for (half = 0; half < 2; half++) {
                    const double e = half ? 0.5 : 1.0, speed = 30.0;
                    const double impulse =
                        (1.0 + e) * speed /
                        (1.0 + (stops[i] > 0.0 ? door_arm * door_arm / inertia : 0.0));
                    perp_body door, ball;
                    double energy;
                    scene s;

                    open_level(&s, planar, levels[level], 0.0);
                    ball = throw_at_door(&s, speed, e, -INFINITY, stops[i], &door);
                    energy = joint_energy(&s);
                    scene_step(&s, 0.01);
                    /* one step, in which nothing but the impact acts on the ball: tol */
                    scene_near(scene_state(&s, ball).velocity[0], speed - impulse, 1e-8 * speed,
                               "ball");
                    assert_true(joint_energy(&s) <= energy * (1.0 + 1e-3)); /* third order */
                    if (i == 0 && !half) /* it turns by 0.1: its third power */
                        scene_near(joint_energy(&s), energy, 1e-3 * energy, "energy");
                    for (k = 0; k < 4; k++) /* the stop is reached, and velocities know of it */
                        scene_step(&s, 0.01);
                    if (i > 0) /* tol */
                        assert_true(scene_state(&s, door).angular_velocity[2] <= 1e-9 * speed);
                    scene_close(&s);
                }
}

/* Three thin rods on hinges with brakes, motors of the speed 0, fall on a floor: brakes give no
 * energy, and so no step does. */
static void test_brakes(void **state)
{
    static const double steps[] = {1.0 / 60.0, 0.005};

    (void)state;
    for (int run = 0; run < 16; run++) {
        const double h = steps[run % 2], restitution = run / 2 % 2 ? 0.5 : 0.0;
        perp_body_settings settings = scene_defaults();
        perp_body before = 0;
        double start, last;
        scene s;

        joint_open(&s, 0, run / 4);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
        settings.mass = 1.0;
        settings.position[2] = 1.5;
        for (int i = 0; i < 3; i++) {
            perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, 1.0, 0.5 * i);
            perp_body rod;

            settings.position[0] = 1.2 * i;
            settings.angular_velocity[0] = i == 0 ? 8.0 : 0.0;
            settings.angular_velocity[1] = i == 0 ? 5.0 : 0.0;
            settings.angular_velocity[2] = i == 0 ? -3.0 : 0.0;
            rod = scene_add(&s, &settings);
            scene_box(&s, rod, 0.5, 0.01, 0.01, 0.5, restitution);
            hinge.anchor[0] = 1.2 * i - 0.6;
            hinge.anchor[2] = 1.5;
            hinge.motor_force = 0.5;
            if (i > 0)
                joint_add(&s, before, rod, &hinge);
            before = rod;
        }
        start = last = joint_energy(&s);
        for (double t = 0.0; t < 3.0; t += h) {
            SCENE_OK(&s, perp_world_step(s.world, NULL, h));
            assert_true(joint_energy(&s) <= last + 1e-6 * start);
            last = joint_energy(&s);
        }
        scene_close(&s);
    }
}

/* Two cubes, flush, with a joint between them, in one rigid turn without forces. Their contacts and
 * the joint say the same: both turn on as one body does, whose moments of inertia are I about the
 * line of the centres and K across it, by Euler's equations. What is left out is of second order:
 * h^2/2 of their second derivative, for which (w h)^2 |w| (K - I) / K = 4e-6 is plenty. */
static void test_flush_at_a_joint(void **state)
{
    static const int32_t kinds[] = {PERP_JOINT_BALL, PERP_JOINT_REVOLUTE};
    const double w[3] = {0.3, -0.5, 0.6}, h = 0.01;
    const double I = 2.0, K = 2.0 + 0.75 * 0.4 * 0.4; /* 1 x 3 / (1 + 3) of masses, .4 apart */
    const double after[3] = {w[0], w[1] + h * (K - I) / K * w[0] * w[2],
                             w[2] - h * (K - I) / K * w[0] * w[1]};

    (void)state;
    for (int run = 0; run < 8; run++) {
        perp_joint_settings hinge = joint_along(kinds[run / 4], 0.0, 0.0, 1.0);
        perp_body_settings settings = scene_settings();
        perp_body cubes[2];
        scene s;

        open_level(&s, 0, levels[run % 4], 0.0);
        for (int i = 0; i < 2; i++) {
            settings.mass = i == 0 ? 1.0 : 3.0;
            settings.position[0] = 0.4 * i;
            memcpy(settings.angular_velocity, w, sizeof w);
            settings.velocity[1] = 0.4 * i * w[2];
            settings.velocity[2] = -0.4 * i * w[1];
            cubes[i] = scene_add(&s, &settings);
            scene_box(&s, cubes[i], 0.2, 0.2, 0.2, 0.5, 0.0);
        }
        hinge.anchor[0] = 0.2;
        hinge.collides = 1;
        joint_add(&s, cubes[0], cubes[1], &hinge);
        scene_step(&s, h);
        for (int i = 0; i < 6; i++)
            scene_near(scene_state(&s, cubes[i / 3]).angular_velocity[i % 3], after[i % 3], 4e-6,
                       "turn");
        scene_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flush_at_a_joint),
        cmocka_unit_test(test_plate),
        cmocka_unit_test(test_whip),
        cmocka_unit_test(test_parts),
        cmocka_unit_test(test_swing_back),
        cmocka_unit_test(test_height),
        cmocka_unit_test(test_bounces),
        cmocka_unit_test(test_brakes),
        cmocka_unit_test(test_door),
        cmocka_unit_test(test_hit_whole),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
