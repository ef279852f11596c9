/* Joints in smooth motion, against closed forms and integrations of their own: order two, momentum
 * to rounding, positions on the joint. */
#include "suite.h"

#include "world/joint_scene.h"

static const int32_t levels[] = {PERP_ACCURACY_FAST, PERP_ACCURACY_STANDARD, PERP_ACCURACY_ACCURATE,
                                 PERP_ACCURACY_EXACT};

/* The length of a pendulum's period by the mean of means: T = 2 pi sqrt(l/g) / M(1, cos(a/2)). */
static double period_of(double length, double amplitude)
{
    double a = 1.0, b = cos(0.5 * amplitude);

    while (fabs(a - b) > 2.0 * EPSILON) {
        const double mean = 0.5 * (a + b);

        b = sqrt(a * b);
        a = mean;
    }
    return 2.0 * PI * sqrt(length / GRAVITY) / a;
}

/* A sphere on a rod of length 1 from rest at 1.2 radians, for one period; returns how far it is
 * from its beginning, in radians and radians a second over the frequency. */
static double swing(int32_t accuracy, int32_t steps)
{
    const double amplitude = 1.2, moment = 0.004, length = 1.0 + moment;
    const double period = period_of(length, amplitude);
    perp_body_settings settings =
        joint_body(1.0, moment, moment, moment, sin(amplitude), 0.0, -cos(amplitude));
    perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, -1.0, 0.0);
    perp_joint_state found;
    perp_joint joint;
    double energy;
    scene s;
    int k;

    joint_open(&s, 0, accuracy);
    joint = joint_add(&s, s.ground, scene_add(&s, &settings), &hinge);
    energy = joint_energy(&s);
    for (k = 0; k < steps; k++) {
        scene_step(&s, period / steps);
        /* the mass centre is on its circle: what a projection leaves is second order of a
         * third-order drift */
        found = joint_state(&s, joint);
        scene_near(hypot(found.anchor[0], found.anchor[2]), 0.0, 1e-8, "the hinge's anchor");
    }
    /* of third order a period, and downwards but for rounding */
    scene_near(joint_energy(&s), energy, 4e3 * GRAVITY / pow(steps, 3.0), "energy");
    assert_true(joint_energy(&s) <= energy + steps * 64.0 * EPSILON * GRAVITY);
    scene_close(&s);
    return hypot(found.position, found.speed * period / (2.0 * PI));
}

static void test_pendulum(void **state)
{
    size_t k;

    (void)state;
    for (k = 0; k < sizeof levels / sizeof *levels; k++) {
        const double coarse = swing(levels[k], 100), fine = swing(levels[k], 200);

        /* halving the step divides the error by four, the next orders being a tenth of that */
        scene_near(coarse / fine, 4.0, 0.4, "order two");
        assert_true(fine < 2e-3);
    }
}

/* ---- a double pendulum beside Runge and Kutta's method on Lagrange's equations ---- */

typedef struct rods {
    double m[2], l[2], moment[2]; /* uniform rods: mass centre in the middle */
} rods;

static const rods two_rods = {{1.0, 0.6}, {1.0, 0.7}, {1.0 / 12.0, 0.6 * 0.49 / 12.0}};

static void accelerate(const rods *r, const double *x, double *dx)
{
    const double c = cos(x[0] - x[1]), s = sin(x[0] - x[1]);
    const double a =
        r->moment[0] + r->m[0] * 0.25 * r->l[0] * r->l[0] + r->m[1] * r->l[0] * r->l[0];
    const double b = r->moment[1] + r->m[1] * 0.25 * r->l[1] * r->l[1];
    const double k = 0.5 * r->m[1] * r->l[0] * r->l[1];
    const double f =
        -k * s * x[3] * x[3] - GRAVITY * (0.5 * r->m[0] + r->m[1]) * r->l[0] * sin(x[0]);
    const double g = k * s * x[2] * x[2] - GRAVITY * 0.5 * r->m[1] * r->l[1] * sin(x[1]);
    const double d = a * b - k * k * c * c;

    dx[0] = x[2];
    dx[1] = x[3];
    dx[2] = (b * f - k * c * g) / d;
    dx[3] = (a * g - k * c * f) / d;
}

static void runge_kutta(const rods *r, double *x, double t, int32_t steps)
{
    const double h = t / steps;
    int32_t i, k;

    for (k = 0; k < steps; k++) {
        double d[4][4], y[4];

        accelerate(r, x, d[0]);
        for (i = 0; i < 4; i++)
            y[i] = x[i] + 0.5 * h * d[0][i];
        accelerate(r, y, d[1]);
        for (i = 0; i < 4; i++)
            y[i] = x[i] + 0.5 * h * d[1][i];
        accelerate(r, y, d[2]);
        for (i = 0; i < 4; i++)
            y[i] = x[i] + h * d[2][i];
        accelerate(r, y, d[3]);
        for (i = 0; i < 4; i++)
            x[i] += h / 6.0 * (d[0][i] + 2.0 * d[1][i] + 2.0 * d[2][i] + d[3][i]);
    }
}

/* The angles after 1 s, from (2, 1) at rest. */
static double swing_both(int32_t planar, int32_t steps, const double *expected)
{
    const rods *r = &two_rods;
    const double angles[2] = {2.0, 1.0};
    perp_body body[2];
    double at[2] = {0.0, 0.0};
    double error = 0.0;
    scene s;
    int i;

    joint_open(&s, planar, PERP_ACCURACY_STANDARD);
    for (i = 0; i < 2; i++) {
        const double x = sin(angles[i]) * r->l[i], y = -cos(angles[i]) * r->l[i];
        perp_body_settings settings =
            joint_body(r->m[i], r->moment[i], r->moment[i], r->moment[i], at[0] + 0.5 * x,
                       planar ? at[1] + 0.5 * y : 0.0, planar ? 0.0 : at[1] + 0.5 * y);
        perp_joint_settings hinge =
            joint_at(PERP_JOINT_REVOLUTE, at[0], planar ? at[1] : 0.0, planar ? 0.0 : at[1]);

        hinge.axis[1] = planar ? 0.0 : -1.0;
        hinge.axis[2] = planar ? 1.0 : 0.0;
        body[i] = scene_add(&s, &settings);
        joint_add(&s, i == 0 ? s.ground : body[0], body[i], &hinge);
        at[0] += x;
        at[1] += y;
    }
    scene_steps(&s, steps, 1.0 / steps);
    at[0] = at[1] = 0.0;
    for (i = 0; i < 2; i++) {
        const perp_body_state state = scene_state(&s, body[i]);

        error = fmax(error, fabs(state.position[0] - at[0] - 0.5 * r->l[i] * sin(expected[i])));
        at[0] += r->l[i] * sin(expected[i]);
    }
    scene_close(&s);
    return error;
}

static void test_double_pendulum(void **state)
{
    double x[4] = {2.0, 1.0, 0.0, 0.0};
    int32_t planar;

    (void)state;
    runge_kutta(&two_rods, x, 1.0, 4000); /* to 1e-12 */
    for (planar = 0; planar < 2; planar++) {
        const double coarse = swing_both(planar, 200, x), fine = swing_both(planar, 400, x);

        scene_near(coarse / fine, 4.0, 0.4, "order two");
        assert_true(fine < 1e-3);
    }
}

/* ---- turning bodies ---- */

/* A symmetric top on its tip in steady precession: with I1 about the tip and the spin w3 along its
 * axis, I1 W^2 cos(a) - I3 w3 W + m g l = 0 keeps the tilt a. */
static double precess(int32_t accuracy, int32_t steps)
{
    const double tilt = 0.5, l = 0.3, m = 2.0, i1 = 0.02, i3 = 0.03, precession = 1.5, t = 1.0;
    const double about_tip = i1 + m * l * l;
    const double spin =
        (about_tip * precession * precession * cos(tilt) + m * GRAVITY * l) / (i3 * precession);
    const double axis[3] = {sin(tilt), 0.0, cos(tilt)};
    const double along = spin - precession * cos(tilt); /* w = W z + along axis */
    const perp_joint_settings ball = joint_at(PERP_JOINT_BALL, 0.0, 0.0, 0.0);
    perp_body_settings settings = joint_body(m, i1, i1, i3, l * axis[0], 0.0, l * axis[2]);
    double error;
    perp_body body;
    perp_body_state at;
    scene s;
    int k;

    settings.orientation[0] = cos(0.5 * tilt);
    settings.orientation[2] = sin(0.5 * tilt);
    for (k = 0; k < 3; k++)
        settings.angular_velocity[k] = along * axis[k] + (k == 2 ? precession : 0.0);
    settings.velocity[1] =
        settings.angular_velocity[2] * l * axis[0] - settings.angular_velocity[0] * l * axis[2];
    joint_open(&s, 0, accuracy);
    body = scene_add(&s, &settings);
    joint_add(&s, s.ground, body, &ball);
    scene_steps(&s, steps, t / steps);
    at = scene_state(&s, body);
    error = hypot(hypot(at.position[0] - l * sin(tilt) * cos(precession * t),
                        at.position[1] - l * sin(tilt) * sin(precession * t)),
                  at.position[2] - l * cos(tilt));
    scene_close(&s);
    return error / l;
}

static void test_top(void **state)
{
    size_t k;

    (void)state;
    for (k = 0; k < sizeof levels / sizeof *levels; k++) {
        const double coarse = precess(levels[k], 1000), fine = precess(levels[k], 2000);

        scene_near(coarse / fine, 4.0, 0.4, "order two");
        assert_true(fine < 1e-3); /* it turns by 35 radians */
    }
}

/* Without gravity; as many rounds as it takes. */
static void open_empty(scene *s)
{
    perp_world_settings settings;

    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, 0), PERP_OK);
    settings.accuracy = PERP_ACCURACY_EXACT;
    settings.gravity[2] = 0.0;
    scene_create(s, &settings);
}

/* Three bodies on two joints, tumbling where nothing acts: momentum is kept to rounding, angular
 * momentum to second order. */
static void test_momentum(void **state)
{
    static const int32_t kinds[] = {PERP_JOINT_BALL,   PERP_JOINT_REVOLUTE, PERP_JOINT_PRISMATIC,
                                    PERP_JOINT_FIXED,  PERP_JOINT_SCREW,    PERP_JOINT_CYLINDRICAL,
                                    PERP_JOINT_PLANAR, PERP_JOINT_DISTANCE};
    size_t kind;

    (void)state;
    for (kind = 0; kind < sizeof kinds / sizeof *kinds; kind++) {
        double linear[2][3], angular[2][3], energy;
        perp_body last = 0;
        scene s;
        int i;

        open_empty(&s);
        for (i = 0; i < 3; i++) {
            perp_body_settings settings =
                joint_body(1.0 + i, 0.1, 0.2 + 0.05 * i, 0.25, 0.5 * i, 0.1 * i, 0.0);
            perp_joint_settings joint = joint_along(kinds[kind], 1.0, 0.3, -0.2);
            perp_body body;

            settings.velocity[2] = 1.0 - i;
            settings.angular_velocity[0] = 2.0 - 0.5 * i;
            settings.angular_velocity[1] = 0.7;
            body = scene_add(&s, &settings);
            joint.anchor[0] = 0.5 * i - 0.2;
            joint.anchor_b[0] = 0.5 * i;
            joint.anchor_b[1] = 0.3;
            joint.pitch = 0.4;
            if (i > 0)
                joint_add(&s, last, body, &joint);
            last = body;
        }
        scene_step(&s, 0.002); /* velocities that obey the joints */
        SCENE_OK(&s, perp_world_momentum(s.world, linear[0], angular[0]));
        energy = joint_energy(&s);
        scene_steps(&s, 500, 0.002);
        SCENE_OK(&s, perp_world_momentum(s.world, linear[1], angular[1]));
        for (i = 0; i < 3; i++) {
            /* rounding of 500 steps; what the projection moves bodies by, (w h)^3 a step */
            scene_near(linear[1][i], linear[0][i], 1e-13, "momentum");
            scene_near(angular[1][i], angular[0][i], 500.0 * 6.4e-8, "angular momentum");
        }
        /* second order: h^2 times the turns of that second */
        scene_near(joint_energy(&s), energy, 1e-4 * energy, "energy");
        scene_close(&s);
    }
}

/* A nut that falls along its screw: (m + I / p^2) x'' = m g, p the way a radian. */
static void test_screw(void **state)
{
    const double pitch = 0.5, p = pitch / (2.0 * PI), m = 2.0, i3 = 0.03, t = 1.0;
    perp_body_settings settings = joint_body(m, 0.05, 0.05, i3, 0.0, 0.0, 0.0);
    perp_joint_settings joint = joint_along(PERP_JOINT_SCREW, 0.0, 0.0, 1.0);
    const double way = -0.5 * t * t * GRAVITY / (1.0 + i3 / (m * p * p));
    perp_joint_state found;
    perp_body body;
    perp_joint id;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    joint.pitch = pitch;
    body = scene_add(&s, &settings);
    id = joint_add(&s, s.ground, body, &joint);
    scene_steps(&s, 100, t / 100.0);
    found = joint_state(&s, id);
    /* a constant acceleration: exact but for the rounding of 100 steps; 1.3 turns are counted */
    scene_near(scene_state(&s, body).position[2], way, 1e-12, "way");
    scene_near(found.position, way / p, 1e-11, "turns");
    scene_near(found.speed, 2.0 * way / p / t, 1e-11, "speed");
    assert_true(found.position < -2.0 * PI);
    scene_close(&s);
}

/* ---- a four-bar linkage, driven ---- */

/* Freudenstein: the angle of the follower for that of the crank, bars a (ground), b, c, d. */
static double follower(double crank)
{
    const double a = 2.0, b = 0.8, c = 1.9, d = 1.5;
    const double x = b * cos(crank) - a, y = b * sin(crank);
    const double square = x * x + y * y;
    const double to_coupler = atan2(y, x);

    return to_coupler - acos((square + d * d - c * c) / (2.0 * d * sqrt(square)));
}

static perp_body add_bar(scene *s, double x0, double y0, double x1, double y1)
{
    const double square = (x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0);
    perp_body_settings settings = joint_body(sqrt(square), 1.0, 1.0, pow(square, 1.5) / 12.0,
                                             0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0);

    return scene_add(s, &settings);
}

static perp_joint hinge(scene *s, perp_body a, perp_body b, double x, double y)
{
    const perp_joint_settings settings = joint_at(PERP_JOINT_REVOLUTE, x, y, 0.0);

    return joint_add(s, a, b, &settings);
}

static void test_four_bars(void **state)
{
    const double crank = 1.0, rocker = follower(crank);
    const double x = 0.8 * cos(crank), y = 0.8 * sin(crank);
    const double p = 2.0 + 1.5 * cos(rocker), q = 1.5 * sin(rocker);
    int32_t planar;

    (void)state;
    for (planar = 0; planar < 2; planar++) { /* in space three rows say the same as others */
        perp_joint in, out;
        perp_body bars[3];
        scene s;
        int k;

        scene_open(&s, planar, 0.0, -GRAVITY, 0.0);
        bars[0] = add_bar(&s, 0.0, 0.0, x, y);
        bars[1] = add_bar(&s, x, y, p, q);
        bars[2] = add_bar(&s, 2.0, 0.0, p, q);
        in = hinge(&s, s.ground, bars[0], 0.0, 0.0);
        hinge(&s, bars[0], bars[1], x, y);
        hinge(&s, bars[1], bars[2], p, q);
        out = hinge(&s, s.ground, bars[2], 2.0, 0.0);
        SCENE_OK(&s, perp_world_set_joint_motor(s.world, in, 3.0, INFINITY));
        for (k = 0; k < 300; k++) {
            perp_joint_state at;

            scene_step(&s, 0.01);
            at = joint_state(&s, in);
            scene_near(at.speed, 3.0, 1e-10, "the motor's speed"); /* tol */
            /* what the projection of one step leaves: the square of 1e-5 */
            scene_near(
                remainder(joint_state(&s, out).position - follower(crank + at.position) + rocker,
                          2.0 * PI),
                0.0, 1e-8, "the follower's angle");
        }
        /* from rest to speed in the first step, half of which counts; order (w h)^2 */
        scene_near(joint_state(&s, in).position, 3.0 * (3.0 - 0.005), 9.0 * 9e-4, "turns");
        scene_close(&s);
    }
}

/* Four bars, hinged to each other in a loop (24 velocities, 20 joints' rows of rank 18), fly on as
 * they were thrown: nothing has to push, and what rounding makes of the rows is no contradiction.
 */
static void test_flying_loop(void **state)
{
    static const double x[] = {0.0, 1.3, 1.1, -0.2}, y[] = {1.0, 1.1, 2.2, 1.9};
    static const double thrown[] = {0.3, 0.1, 0.7};
    size_t l;

    (void)state;
    for (l = 0; l < sizeof levels / sizeof *levels; l++) {
        perp_body bars[4];
        scene s;
        int k, i;

        joint_open(&s, 0, levels[l]);
        for (k = 0; k < 4; k++) {
            perp_body_settings settings =
                joint_body(1.0 + 0.3 * k, 0.1, 0.1, 0.2, 0.5 * (x[k] + x[(k + 1) % 4]),
                           0.5 * (y[k] + y[(k + 1) % 4]), 0.0);

            memcpy(settings.velocity, thrown, sizeof thrown);
            bars[k] = scene_add(&s, &settings);
        }
        for (k = 0; k < 4; k++)
            hinge(&s, bars[(k + 3) % 4], bars[k], x[k], y[k]);
        for (i = 1; i <= 60; i++) {
            scene_step(&s, 0.01);
            for (k = 0; k < 4; k++) {
                const perp_body_state at = scene_state(&s, bars[k]);

                /* a rounding a step and row */
                scene_near(at.velocity[0], thrown[0], 60 * 20 * EPSILON, "along x");
                scene_near(at.velocity[1], thrown[1], 60 * 20 * EPSILON, "along y");
                scene_near(at.velocity[2], thrown[2] - GRAVITY * 0.01 * i, 60 * 20 * 8 * EPSILON,
                           "along z"); /* of up to 6 m/s */
            }
        }
        scene_close(&s);
    }
}

/* A rod and a lighter one at its end that turn by .6 and by 1 a step: what poses lack is of third
 * order in that, and one pass that takes it away leaves the square, 1e-4. None of it stays. */
static void test_fast_turns(void **state)
{
    const double h = 0.02;
    scene s;
    perp_joint_settings settings[2] = {joint_at(PERP_JOINT_BALL, 0, 0, 0),
                                       joint_at(PERP_JOINT_BALL, 1, 0, 0)};
    perp_body_settings ends[2] = {joint_body(1, 0.1, 0.2, 0.3, 0.5, 0, 0),
                                  joint_body(0.1, 0.01, 0.02, 0.03, 1.5, 0, 0)};
    perp_body bodies[2];
    perp_joint joint;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    ends[0].angular_velocity[1] = 30.0;
    ends[1].angular_velocity[2] = 50.0;
    for (int k = 0; k < 2; k++)
        bodies[k] = scene_add(&s, &ends[k]);
    joint_add(&s, perp_world_ground(s.world), bodies[0], &settings[0]);
    joint = joint_add(&s, bodies[0], bodies[1], &settings[1]);
    for (int k = 0; k < 50; k++) {
        perp_body_state first;
        double end[3], far = 0.0;

        scene_step(&s, h);
        first = scene_state(&s, bodies[0]);
        for (int i = 0; i < 3; i++) { /* at the origin is one end of the first rod */
            end[i] = 2.0 * first.position[i] - joint_state(&s, joint).anchor[i];
            far = fmax(far, fabs(end[i]));
        }
        assert_true(far <= 1e-7); /* 1e-4 of what one pass leaves, 1e-4 */
    }
    scene_close(&s);
}

/* A rotor whose mass centre is off its hinge, and whose axis is none of its own, at up to .8 a
 * step: one degree of freedom without a force that works on it, so that its speed is a constant. */
static void test_rotor(void **state)
{
    const double skew = 0.3, off = 0.2, rate = 50.0, h = 1.0 / 60.0;

    (void)state;
    for (size_t l = 0; l < sizeof levels / sizeof *levels; l++) {
        perp_body_settings settings = joint_body(1.0, 0.01, 0.02, 0.03, off, 0.0, 0.0);
        const perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, 0.0, 1.0);
        perp_world_settings world;
        perp_joint joint;
        scene s;

        assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
        world.accuracy = levels[l];
        world.gravity[2] = 0.0;
        scene_create(&s, &world);
        settings.orientation[0] = cos(0.5 * skew);
        settings.orientation[2] = sin(0.5 * skew);
        settings.angular_velocity[2] = rate;
        settings.velocity[1] = rate * off;
        joint = joint_add(&s, s.ground, scene_add(&s, &settings), &hinge);
        scene_steps(&s, 600, h);
        /* rounding of 600 steps, of a hundred terms each */
        scene_near(joint_state(&s, joint).speed, rate, 600 * 100 * EPSILON * rate, "speed");
        scene_close(&s);
    }
}

/* A rod 50 times as long as thick swings on a ball joint and on a rod without mass. What turns
 * about its own axis turns at one rate, whatever else it does; energy never grows beyond rounding.
 */
static void test_rod(void **state)
{
    const double m = 4.0, along = 4e-5 * m, across = 0.08 / 4.0 * m, h = 1.0 / 60.0;

    (void)state;
    for (size_t l = 0; l < sizeof levels / sizeof *levels; l++)
        for (int32_t apart = 0; apart < 2; apart++) {
            perp_body_settings settings =
                joint_body(m, along, across, across, apart ? 0.8 : 0.3, 0.0, 0.0);
            perp_joint_settings joint =
                joint_at(apart ? PERP_JOINT_DISTANCE : PERP_JOINT_BALL, 0.0, 0.0, 0.0);
            double energy, scale = m * GRAVITY;
            scene s;

            settings.angular_velocity[0] = 0.5;
            settings.angular_velocity[1] = settings.angular_velocity[2] = 1.0;
            settings.velocity[1] = apart ? 0.0 : 0.3;
            settings.velocity[2] = apart ? 0.0 : -0.3;
            joint.anchor_b[0] = 0.5;
            joint_open(&s, 0, levels[l]);
            joint_add(&s, s.ground, scene_add(&s, &settings), &joint);
            scene_step(&s, 1e-9); /* velocities that joints have */
            energy = joint_energy(&s);
            for (int k = 0; k < 1800; k++) {
                scene_step(&s, h);
                assert_true(joint_energy(&s) <= energy + (k + 1) * 1000.0 * EPSILON * scale);
            }
            scene_close(&s);
        }
}

/* Joints of a body without shapes that contradict each other, as it was moved between them: nothing
 * to be done, and nothing breaks. */
static void test_joints_that_contradict(void **state)
{
    (void)state;
    for (int32_t kind = PERP_JOINT_BALL; kind <= PERP_JOINT_PLANAR; kind++) {
        const perp_body_settings settings = joint_body(1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
        const perp_joint_settings joint = joint_along(kind, 0.0, 0.0, 1.0);
        perp_step_result result = fresh_step_result();
        perp_body_state moved;
        perp_body body;
        scene s;

        scene_create(&s, NULL);
        body = scene_add(&s, &settings);
        joint_add(&s, s.ground, body, &joint);
        moved = scene_state(&s, body);
        moved.position[0] = 0.1;
        moved.orientation[0] = cos(0.2);
        moved.orientation[1] = sin(0.2);
        SCENE_OK(&s, perp_world_set_body(s.world, &moved, body));
        joint_add(&s, s.ground, body, &joint);
        for (int k = 0; k < 3; k++)
            SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
        scene_close(&s);
    }
}

/* Three rods, 1e-9 off the vertical, with a bead of a tenth and a weight of 1e4: the bead swings at
 * 26 radians a step, for which rounds of a path do not settle. It stays where it is. */
static void test_a_light_bead(void **state)
{
    (void)state;
    for (int32_t accuracy = 0; accuracy < 4; accuracy++) {
        static const double masses[3] = {1.0, 0.1, 1e4};
        perp_body bodies[4];
        scene s;

        joint_open(&s, 0, accuracy);
        bodies[0] = s.ground;
        for (int k = 0; k < 3; k++) {
            const double I = 0.1 * masses[k] * 0.09;
            const perp_body_settings settings =
                joint_body(masses[k], I, I, I, 3e-10 * (k + 1), 0.0, -0.3 * (k + 1));
            perp_joint_settings joint = joint_at(PERP_JOINT_DISTANCE, 3e-10 * k, 0.0, -0.3 * k);

            memcpy(joint.anchor_b, settings.position, sizeof joint.anchor_b);
            bodies[k + 1] = scene_add(&s, &settings);
            joint_add(&s, bodies[k], bodies[k + 1], &joint);
        }
        for (int step = 0; step < 100; step++)
            (void)scene_step(&s, 0.01);
        for (int k = 1; k < 4; k++)
            for (int i = 0; i < 3; i++)
                scene_near(scene_state(&s, bodies[k]).velocity[i], 0.0, 1e-6, "a chain that hangs");
        scene_close(&s);
    }
}

/* What falls as one keeps its rows, however far it falls: one solution a step. Bodies have what
 * gravity gives them, (k h) g, to rounding. */
static void test_a_fall_is_one_solution(void **state)
{
    const double h = 0.01;

    (void)state;
    for (int32_t planar = 0; planar < 2; planar++)
        for (int32_t accuracy = 0; accuracy < 4; accuracy++) {
            perp_body bodies[4];
            scene s;

            joint_open(&s, planar, accuracy);
            for (int k = 0; k < 4; k++) {
                const perp_body_settings settings =
                    joint_body(1.0 + k, 0.1, 0.2, 0.25, 0.6 * k, 0.1 * k, 0.0);
                const perp_joint_settings joint = joint_at(
                    k % 2 ? PERP_JOINT_REVOLUTE : PERP_JOINT_BALL, 0.6 * k - 0.3, 0.0, 0.0);

                bodies[k] = scene_add(&s, &settings);
                if (k > 0)
                    joint_add(&s, bodies[k - 1], bodies[k], &joint);
            }
            for (int step = 1; step <= 50; step++) {
                assert_int_equal(scene_step(&s, h).iterations, 1);
                for (int k = 0; k < 4; k++)
                    scene_near(scene_state(&s, bodies[k]).velocity[planar ? 1 : 2],
                               -9.81 * step * h, 1e-13, "a body that falls");
            }
            scene_close(&s);
        }
}

/* Two boxes, flush, with a hinge along an edge of their faces, turn freely and press on each other:
 * along the hinge contacts say what it does. What they are known to leaves of the energy all but a
 * few (w h)^2 a step. */
static void test_flush_boxes_on_a_hinge(void **state)
{
    const double h = 0.01, spin[3] = {0.3, 1.5, 4.0}, square = 18.34 * h * h;

    (void)state;
    for (size_t l = 0; l < sizeof levels / sizeof *levels; l++) {
        perp_joint_settings joint = joint_along(PERP_JOINT_REVOLUTE, 0.0, 1.0, 0.0);
        perp_body bodies[2];
        double energy;
        scene s;

        joint_open(&s, 0, levels[l]);
        SCENE_OK(&s, perp_world_set_gravity(s.world, (const double[3]){0.0, 0.0, 0.0}));
        for (int k = 0; k < 2; k++) {
            const double m = 1.0 + k, x = k == 0 ? -0.2 : 0.2;
            perp_body_settings settings =
                joint_body(m, m * 0.1 / 3.0, m * 0.05 / 3.0, m * 0.13 / 3.0, x, 0.0, 0.0);

            memcpy(settings.angular_velocity, spin, sizeof spin);
            settings.velocity[1] = spin[2] * (x - 0.2 / 3.0);
            settings.velocity[2] = -spin[1] * (x - 0.2 / 3.0);
            bodies[k] = scene_add(&s, &settings);
            scene_box(&s, bodies[k], 0.2, 0.3, 0.1, 0.5, 0.0);
        }
        joint.anchor[2] = 0.1;
        joint.collides = 1;
        joint_add(&s, bodies[0], bodies[1], &joint);
        energy = joint_energy(&s);
        scene_steps(&s, 50, h);
        scene_near(joint_energy(&s), energy, 50 * 0.5 * square * energy, "energy");
        scene_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pendulum),
        cmocka_unit_test(test_double_pendulum),
        cmocka_unit_test(test_top),
        cmocka_unit_test(test_momentum),
        cmocka_unit_test(test_screw),
        cmocka_unit_test(test_four_bars),
        cmocka_unit_test(test_flying_loop),
        cmocka_unit_test(test_fast_turns),
        cmocka_unit_test(test_rotor),
        cmocka_unit_test(test_rod),
        cmocka_unit_test(test_joints_that_contradict),
        cmocka_unit_test(test_a_light_bead),
        cmocka_unit_test(test_a_fall_is_one_solution),
        cmocka_unit_test(test_flush_boxes_on_a_hinge),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
