/* Bounds of motors, dry friction and stops against loads, contacts and each other: what holds does
 * so at 0.0, and what slips is at its bound. */
#include "suite.h"

#include "world/joint_scene.h"

static const int32_t levels[] = {PERP_ACCURACY_FAST, PERP_ACCURACY_STANDARD, PERP_ACCURACY_ACCURATE,
                                 PERP_ACCURACY_EXACT};

static perp_joint add_wheel(scene *s, double inertia, double speed)
{
    perp_body_settings settings = joint_body(1.0, inertia, inertia, inertia, 0.0, 0.0, 0.0);
    const perp_joint_settings hinge = joint_along(PERP_JOINT_REVOLUTE, 0.0, 0.0, 1.0);

    settings.angular_velocity[2] = speed;
    return joint_add(s, s->ground, scene_add(s, &settings), &hinge);
}

/* A level arm of links whose motors can just hold it, to 1e-9 of their loads, rests at 0.0. With
 * one that cannot all from there on falls as one body, and what sticks moves with what it is on:
 * I w = -h (what lacks). */
static void hold_arm(int32_t planar, int32_t accuracy, int32_t weak, double slack)
{
    enum { LINKS = 12 };
    const double length = 0.5, h = 0.01, bar = length * length / 12.0;
    perp_body_settings settings = joint_body(1.0, bar, bar, bar, 0.0, 0.0, 0.0);
    perp_joint joints[LINKS];
    perp_body last;
    scene s;
    int i, k;

    joint_open(&s, planar, accuracy);
    last = s.ground;
    for (i = 0; i < LINKS; i++) {
        perp_joint_settings hinge = joint_at(PERP_JOINT_REVOLUTE, i * length, 0.0, 0.0);
        double load = 0.0;
        perp_body body;

        hinge.axis[1] = planar ? 0.0 : -1.0;
        hinge.axis[2] = planar ? 1.0 : 0.0;
        for (k = i; k < LINKS; k++)
            load += GRAVITY * (k + 0.5 - i) * length;
        hinge.motor_force = load * (i == weak ? 1.0 - slack : 1.0 + slack);
        settings.position[0] = (i + 0.5) * length;
        body = scene_add(&s, &settings);
        joints[i] = joint_add(&s, last, body, &hinge);
        last = body;
    }
    scene_step(&s, h);
    for (i = 0; i < LINKS; i++) {
        const double speed = joint_state(&s, joints[i]).speed;
        const double rounding = 1e3 * EPSILON; /* of differences of rates, beside the one below */

        if (weak < 0)
            assert_true(speed == 0.0);
        else if (i == weak) {
            double inertia = 0.0, load = 0.0;

            for (k = i; k < LINKS; k++) {
                inertia += bar + pow((k + 0.5 - i) * length, 2.0);
                load += GRAVITY * (k + 0.5 - i) * length;
            }
            scene_near(speed, -h * slack * load / inertia, 1e-6 * h * slack * load / inertia,
                       "speed"); /* tol beside the load */
            scene_near(joint_state(&s, joints[i]).motor_impulse, h * load * (1.0 - slack),
                       4.0 * EPSILON * h * load, "a motor that slips is at its bound");
        } else
            scene_near(speed, 0.0, rounding * h * slack * GRAVITY, "a joint that sticks");
    }
    scene_close(&s);
}

static void test_arm(void **state)
{
    size_t level;
    int planar;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (level = 0; level < sizeof levels / sizeof *levels; level++) {
            hold_arm(planar, levels[level], -1, 1e-9);
            hold_arm(planar, levels[level], 0, 1e-3);
            hold_arm(planar, levels[level], 11, 1e-3);
        }
}

/* Against its stop a motor presses with all it has; against friction with what that leaves. */
static void test_against(void **state)
{
    static const double bounds[][2] = {{2.0, 1.0},        {1.0, 2.0}, {1.0, 1.0 + 1e-9},
                                       {1.0 + 1e-9, 1.0}, {1e6, 1.0}, {1.0, 1e6}};
    size_t level, i;
    int planar;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (level = 0; level < sizeof levels / sizeof *levels; level++)
            for (i = 0; i < sizeof bounds / sizeof *bounds; i++) {
                const double motor = bounds[i][0], friction = bounds[i][1];
                const double net = motor > friction ? motor - friction : 0.0;
                perp_joint_state found;
                perp_joint joint;
                scene s;

                joint_open(&s, planar, levels[level]);
                joint = add_wheel(&s, 2.0, 0.0);
                SCENE_OK(&s, perp_world_set_joint_motor(s.world, joint, 1.0 + net, motor));
                SCENE_OK(&s, perp_world_set_joint_friction(s.world, joint, friction));
                SCENE_OK(&s, perp_world_set_gravity(s.world, (const double[3]){0.0, 0.0, 0.0}));
                scene_steps(&s, 10, 0.01);
                found = joint_state(&s, joint); /* rounding of ten sums of both */
                scene_near(found.speed, 0.05 * net, 10.0 * EPSILON * (motor + friction), "speed");
                assert_true(net > 0.0 || found.speed == 0.0);
                if (net > 0.0 && motor <= 2.0) {
                    SCENE_OK(&s, perp_world_set_joint_friction(s.world, joint, 0.0));
                    SCENE_OK(&s, perp_world_set_joint_limits(s.world, joint, -1.0, found.position));
                    scene_steps(&s, 3, 0.01);
                    found = joint_state(&s, joint);
                    assert_true(found.speed == 0.0);
                    assert_true(found.motor_impulse == motor * 0.01);
                    scene_near(found.limit_impulse, -motor * 0.01, 1e-10 * motor,
                               "the stop"); /* tol */
                }
                scene_close(&s);
            }
}

/* A lever with a ball on it: its stop, or a motor, carries the moments of both, to 1e-9. */
static void test_lever(void **state)
{
    const double moment = GRAVITY * (1.0 * 0.5 + 3.0 * 0.75);
    size_t level;
    int planar, how;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (level = 0; level < sizeof levels / sizeof *levels; level++)
            for (how = 0; how < 3; how++) {
                perp_joint_settings hinge = joint_at(PERP_JOINT_REVOLUTE, 0.0, 0.0, 0.0);
                perp_body_settings settings = joint_body(1.0, 0.1, 0.1, 0.1, 0.5, 0.0, 0.0);
                const double ball = 0.4 * 3.0 * 0.01, thin = 0.02;
                perp_body lever, load;
                perp_joint joint;
                scene s;

                joint_open(&s, planar, levels[level]);
                hinge.axis[1] = planar ? 0.0 : -1.0;
                hinge.axis[2] = planar ? 1.0 : 0.0;
                hinge.lower = how == 0 ? 0.0 : -INFINITY;
                hinge.motor_force = how == 0 ? 0.0 : moment * (how == 1 ? 1.0 + 1e-9 : 1.0 - 1e-9);
                lever = scene_add(&s, &settings);
                scene_box(&s, lever, 0.5, planar ? thin : 0.5, planar ? 0.5 : thin, 0.5, 0.0);
                joint = joint_add(&s, s.ground, lever, &hinge);
                settings = joint_body(3.0, ball, ball, ball, 0.75, planar ? 0.1 + thin : 0.0,
                                      planar ? 0.0 : 0.1 + thin);
                load = scene_add(&s, &settings);
                scene_sphere(&s, load, 0.1, 0.5, 0.0);
                scene_steps(&s, 20, 0.01);
                if (how == 2)
                    assert_true(joint_state(&s, joint).speed < 0.0);
                else
                    assert_true(scene_rests(&s, lever) && scene_rests(&s, load));
                scene_near(joint_state(&s, joint).limit_impulse +
                               joint_state(&s, joint).motor_impulse,
                           0.01 * moment, 2e-9 * 0.01 * moment, "moment"); /* of its bound */
                scene_close(&s);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_arm),
        cmocka_unit_test(test_against),
        cmocka_unit_test(test_lever),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
