/* Capsules and convex hulls as shapes of bodies: what they weigh, what is refused, how they roll,
 * slide, tip, rest, and that neither seams nor speed trick them. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

/* Volumes and moments are sums of some dozen products. */
#define BOUND (256.0 * EPSILON)

static perp_body dynamic_body(scene *s, double x, double y, double z)
{
    perp_body_settings settings = scene_defaults();
    settings.position[0] = x;
    settings.position[1] = y;
    settings.position[2] = z;
    return scene_add(s, &settings);
}

static void add_hull(scene *s, perp_body body, const double (*points)[3], int32_t count,
                     const double *offset, double friction)
{
    perp_shape_settings settings = scene_material(friction, 0.0);
    settings.density = 2.0;
    for (int k = 0; offset && k < 3; k++)
        settings.offset[k] = offset[k];
    SCENE_OK(s, perp_world_add_hull(s->world, NULL, body, points[0], count, &settings));
}

static void add_capsule(scene *s, perp_body body, double radius, double half, double turn,
                        double friction)
{
    perp_shape_settings settings = scene_material(friction, 0.0);
    settings.rotation[0] = cos(0.5 * turn);
    settings.rotation[3] = sin(0.5 * turn); /* about z */
    SCENE_OK(s, perp_world_add_capsule(s->world, NULL, body, radius, half, &settings));
}

static void require_weight(scene *s, perp_body body, double mass, const double *inertia)
{
    double m, I[9];
    SCENE_OK(s, perp_world_get_mass(s->world, &m, I, body));
    scene_near(m / mass, 1.0, BOUND, "mass");
    for (int k = 0; k < 9; k++)
        scene_near(I[k] / inertia[8], inertia[k] / inertia[8], BOUND, "inertia");
}

/* The corner of a cube cut off by the plane x + y + z = 1: volume 1/6, centre at 1/4, and
 *   int x^2 = 1/60, int x y = 1/120 about the corner; about the centre less m/16. */
static void test_weight_of_a_tetrahedron(void **unused)
{
    static const double corner[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const double centre[3] = {-0.25, -0.25, -0.25};
    const double m = 2.0 / 6.0, square = 2.0 / 60.0 - m / 16.0, product = 2.0 / 120.0 - m / 16.0;
    double I[9];
    scene s;
    (void)unused;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    perp_body body = dynamic_body(&s, 0.0, 0.0, 0.0);
    add_hull(&s, body, corner, 4, centre, 0.0);
    for (int k = 0; k < 9; k++)
        I[k] = k % 4 == 0 ? 2.0 * square : -product;
    require_weight(&s, body, m, I);
    scene_step(&s, 0.01); /* refuses bodies whose shapes have their centre elsewhere */
    scene_close(&s);
}

/* A regular prism of n sides, along z: area n/2 R^2 sin(2 pi/n), the polar moment of its section
 * area R^2 (2 + cos(2 pi/n)) / 6. */
static int32_t prism(double (*points)[3], int32_t n, double R, double half)
{
    for (int32_t i = 0; i < 2 * n; i++) {
        double angle = 2.0 * PI * (i % n) / n;
        points[i][0] = R * cos(angle);
        points[i][1] = R * sin(angle);
        points[i][2] = i < n ? -half : half;
    }
    return 2 * n;
}

static void test_weight_of_prisms(void **unused)
{
    (void)unused;
    for (int32_t n = 3; n <= 64; n++) {
        double points[128][3];
        const double R = 0.75, half = 1.5, area = 0.5 * n * R * R * sin(2.0 * PI / n);
        const double m = 2.0 * area * 2.0 * half;
        const double polar = m * R * R * (2.0 + cos(2.0 * PI / n)) / 6.0;
        const double across = 0.5 * polar + m * half * half / 3.0;
        const double I[9] = {across, 0.0, 0.0, 0.0, across, 0.0, 0.0, 0.0, polar};
        scene s;
        scene_open(&s, 0, 0.0, 0.0, 0.0);
        perp_body body = dynamic_body(&s, 0.0, 0.0, 0.0);
        add_hull(&s, body, (const double(*)[3])points, prism(points, n, R, half), NULL, 0.0);
        require_weight(&s, body, m, I);
        scene_close(&s);
    }
}

/* In slices of the axis: the midpoint rule is wrong by 1 / slices^1.5 at the ends' circles. */
static void test_weight_of_a_capsule(void **unused)
{
    const double r = 0.5, l = 1.25;
    (void)unused;
    for (int planar = 0; planar < 2; planar++) {
        const int slices = 200000;
        double volume = 0.0, along = 0.0, across = 0.0, m, I[9];
        scene s;
        for (int i = 0; i < slices; i++) {
            const double x = (l + r) * (2.0 * (i + 0.5) / slices - 1.0);
            const double over = fmax(fabs(x) - l, 0.0), y2 = r * r - over * over;
            const double slice = 2.0 * (l + r) / slices * (planar ? 2.0 * sqrt(y2) : PI * y2);
            volume += slice;
            along += slice * x * x;
            across += slice * (planar ? y2 / 3.0 : y2 / 4.0);
        }
        scene_open(&s, planar, 0.0, 0.0, 0.0);
        perp_body body = dynamic_body(&s, 0.0, 0.0, 0.0);
        add_capsule(&s, body, r, l, 0.0, 0.0);
        SCENE_OK(&s, perp_world_get_mass(s.world, &m, I, body));
        scene_near(m / (1000.0 * volume), 1.0, 1e-7, "mass");
        scene_near(I[8] / (1000.0 * (along + across)), 1.0, 1e-7, "across");
        if (!planar)
            scene_near(I[0] / (2000.0 * across), 1.0, 1e-7, "along");
        scene_close(&s);
    }
}

static void require_refusal(scene *s, const double (*points)[3], int32_t count, const char *words)
{
    perp_shape id = 77;
    perp_status status =
        perp_world_add_hull(s->world, &id, s->ground, points ? &points[0][0] : NULL, count, NULL);
    assert_int_not_equal(status, PERP_OK);
    assert_int_equal(id, 77);
    if (!strstr(perp_context_message(s->context), words))
        fail_msg("'%s' without '%s'", perp_context_message(s->context), words);
}

static void test_refusals(void **unused)
{
    static const double flat[5][3] = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}, {.5, .2, 1}};
    static const double line[4][3] = {{0, 0, 0}, {1, 2, 3}, {2, 4, 6}, {-1, -2, -3}};
    static const double same[4][3] = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    double bad[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, many[200][3];
    scene s;
    (void)unused;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    require_refusal(&s, NULL, 4, "points");
    require_refusal(&s, (const double(*)[3])bad, 3, "count is 3");
    require_refusal(&s, flat, 5, "near the plane of points [");
    require_refusal(&s, line, 4, "near the line of points [2] and [3]");
    require_refusal(&s, same, 4, "points[0 .. 3] are all the same");
    bad[2][1] = NAN;
    require_refusal(&s, (const double(*)[3])bad, 4, "points[7]");
    require_refusal(&s, (const double(*)[3])many, prism(many, 65, 1.0, 1.0), "128 corners");
    assert_int_equal(perp_world_add_capsule(s.world, NULL, s.ground, 0.0, 1.0, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_world_add_capsule(s.world, NULL, s.ground, 1.0, -1.0, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_world_add_capsule(s.world, NULL, s.ground, 1.0, NAN, NULL),
                     PERP_ERROR_NOT_FINITE);
    scene_close(&s);
    scene_open(&s, 1, 0.0, 0.0, 0.0);
    require_refusal(&s, flat, 5, "points[2] is 1, 0 expected");
    require_refusal(&s, (const double(*)[3])bad, 2, "count is 2, >= 3");
    scene_close(&s);
}

/* Points inside, on faces, on edges and twice change nothing; nor do size and place, but for
 * rounding: 2000 random sets of the corners of a box, turned. */
static void test_points_that_are_no_corners(void **unused)
{
    uint32_t state = 12345;
    (void)unused;
    for (int trial = 0; trial < 300; trial++) {
        double points[8 + 60][3], R[3][3], q[4], length = 0.0;
        int32_t count = 0;
        for (int k = 0; k < 4; k++) {
            state = state * 1664525u + 1013904223u;
            q[k] = (double)(state >> 8) / (1 << 24) - 0.5;
            length += q[k] * q[k];
        }
        for (int k = 0; k < 4; k++)
            q[k] = trial % 3 == 0 ? (k == 0) : q[k] / sqrt(length);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                double c = q[0] * q[0] - q[1] * q[1] - q[2] * q[2] - q[3] * q[3];
                R[i][j] = 2.0 * q[1 + i] * q[1 + j] + (i == j ? c : 0.0);
                if (i != j)
                    R[i][j] += 2.0 * q[0] * q[1 + 3 - i - j] * ((i + 1) % 3 == j ? -1.0 : 1.0);
            }
        for (int32_t i = 0; i < 68; i++) {
            double x[3];
            for (int k = 0; k < 3; k++) {
                state = state * 1664525u + 1013904223u;
                /* on a grid of quarters: on faces, edges and corners, and twice */
                x[k] = i < 8 ? (i >> k & 1 ? 1.0 : -1.0) : (double)(state >> 29) / 4.0 - 1.0;
                x[k] = fmin(x[k], 1.0) * (k + 1.0);
            }
            for (int k = 0; k < 3; k++)
                points[(i * 37 + trial) % 68][k] =
                    R[k][0] * x[0] + R[k][1] * x[1] + R[k][2] * x[2] + trial;
            count++;
        }
        const double offset[3] = {-trial, -trial, -trial};
        scene s;
        double m, I[9];
        scene_open(&s, 0, 0.0, 0.0, 0.0);
        perp_body body = dynamic_body(&s, 0.0, 0.0, 0.0);
        add_hull(&s, body, (const double(*)[3])points, count, offset, 0.0);
        SCENE_OK(&s, perp_world_get_mass(s.world, &m, I, body));
        /* a point on a face counts as on it to 1e-9 of the size; rounding of places is below */
        scene_near(m, 2.0 * 48.0, 1e-10 * 96.0, "mass");
        scene_near(I[0] + I[4] + I[8], 2.0 * 96.0 * 14.0 / 3.0, 1e-7, "trace");
        scene_close(&s);
    }
}

/* Down a slope without slip: a = g sin(theta) / (1 + I / (m r^2)), the parabola exactly. */
static void test_rolling_capsule(void **unused)
{
    const double theta = 0.3, r = 0.25, h = 0.01;
    (void)unused;
    for (int planar = 0; planar < 2; planar++) {
        scene s;
        double m, I[9];
        const double g = GRAVITY;
        scene_open(&s, planar, g * sin(theta), planar ? -g * cos(theta) : 0.0,
                   planar ? 0.0 : -g * cos(theta));
        scene_plane(&s, s.ground, 0.0, planar, !planar, 0.0, 0.9, 0.0);
        perp_body body = dynamic_body(&s, 0.0, planar ? r : 0.0, planar ? 0.0 : r);
        add_capsule(&s, body, r, planar ? 0.0 : 0.5, planar ? 0.0 : 0.5 * PI, 0.9);
        SCENE_OK(&s, perp_world_get_mass(s.world, &m, I, body));
        const double a = g * sin(theta) / (1.0 + I[planar ? 8 : 4] / (m * r * r));
        scene_steps(&s, 200, h);
        perp_body_state state = scene_state(&s, body);
        /* 200 steps, each with some roundings of the solve */
        scene_near(state.velocity[0] / (2.0 * a), 1.0, 1e-12, "velocity");
        scene_near(state.position[0] / (2.0 * a), 1.0, 1e-12, "way");
        scene_near(state.angular_velocity[planar ? 2 : 1] * r * (planar ? -1.0 : 1.0) /
                       state.velocity[0],
                   1.0, 1e-12, "roll");
        scene_close(&s);
    }
}

/* A pyramid of a square base slides on it: v = v0 - mu g t, then rests with 0.0. */
static void test_sliding_pyramid(void **unused)
{
    static const double points[5][3] = {
        {1, 1, -0.25}, {-1, 1, -0.25}, {-1, -1, -0.25}, {1, -1, -0.25}, {0, 0, 0.75}};
    scene s;
    (void)unused;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0);
    perp_body_settings settings = scene_defaults();
    settings.position[2] = 0.25;
    settings.velocity[0] = 1.2;
    settings.velocity[1] = 1.6;
    perp_body body = scene_add(&s, &settings);
    add_hull(&s, body, points, 5, NULL, 0.25);
    scene_steps(&s, 50, 0.01);
    perp_body_state state = scene_state(&s, body);
    const double speed = 2.0 - 0.25 * GRAVITY * 0.5;
    /* 50 steps, each solved to 1e-12 of what gravity makes in it */
    const double known = 50 * 1e-12 * GRAVITY * 0.01;
    scene_near(state.velocity[0], 0.6 * speed, known, "v_x");
    scene_near(state.velocity[1], 0.8 * speed, known, "v_y");
    scene_near(state.position[2], 0.25, 1e-12, "height");
    scene_steps(&s, 60, 0.01);
    assert_true(scene_rests(&s, body));
    scene_close(&s);
}

/* A hexagonal prism on a slope, with its axis level, stands on a side: it tips over the edge below
 * where the centre lies beyond it: at 30 degrees. Below it has velocity 0.0. */
static void test_tipping_prism(void **unused)
{
    (void)unused;
    for (int planar = 0; planar < 2; planar++)
        for (int tips = 0; tips < 2; tips++) {
            const double theta = PI / 6.0 + (tips ? 1e-6 : -1e-6), g = GRAVITY;
            double points[12][3], flat = sqrt(0.75);
            scene s;
            prism(points, 6, 1.0, 0.7); /* corners at 0, 60, ... : a side faces -y */
            if (planar)
                for (int i = 0; i < 12; i++)
                    points[i][2] = 0.0;
            scene_open(&s, planar, g * sin(theta), -g * cos(theta), 0.0);
            scene_plane(&s, s.ground, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0);
            perp_body body = dynamic_body(&s, 0.0, flat, 0.0);
            add_hull(&s, body, (const double(*)[3])points, planar ? 6 : 12, NULL, 2.0);
            scene_steps(&s, 100, 0.01);
            perp_body_state state = scene_state(&s, body);
            if (tips)
                assert_true(state.angular_velocity[2] < -1e-6);
            else
                assert_true(scene_rests(&s, body));
            scene_close(&s);
        }
}

/* Along flush tiles, without friction: the velocity stays, and nothing lifts. */
static void test_seams(void **unused)
{
    (void)unused;
    for (int kind = 0; kind < 3; kind++)
        for (int fast = 0; fast < 2; fast++) {
            const double speed = fast ? 4.0 : 1.0;
            double points[12][3], tile[8][3];
            scene s;
            scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
            for (int i = 0; i < 8; i++)
                for (int k = 0; k < 3; k++)
                    tile[i][k] = (i >> k & 1 ? 1.0 : -1.0) * (k == 2 ? 0.125 : 0.5);
            for (int i = 0; i < 6; i++) {
                const double offset[3] = {i, 0.0, -0.125};
                add_hull(&s, s.ground, (const double(*)[3])tile, 8, offset, 0.0);
            }
            perp_body_settings settings = scene_defaults();
            settings.position[2] = 0.25;
            settings.velocity[0] = speed;
            perp_body body = scene_add(&s, &settings);
            if (kind == 0)
                add_hull(&s, body, (const double(*)[3])points, prism(points, 6, 0.25, 0.25), NULL,
                         0.0);
            else
                add_capsule(&s, body, 0.25, 0.3, kind == 1 ? 0.0 : 1.0, 0.0);
            for (double way = 0.0; way < 3.0; way += 0.01 * speed) {
                scene_step(&s, 0.01);
                perp_body_state state = scene_state(&s, body);
                scene_near(state.velocity[0] / speed, 1.0, 1e-9, "speed");
                scene_near(state.position[2], 0.25, 1e-12, "height");
            }
            scene_close(&s);
        }
}

/* 1000 m/s at a plate of 1 mm; what comes by with 1 % of room is not touched. */
static void test_bullets(void **unused)
{
    (void)unused;
    for (int kind = 0; kind < 2; kind++)
        for (int spins = 0; spins < 2; spins++)
            for (int passes = 0; passes < 2; passes++) {
                double points[12][3], plate[8][3];
                scene s;
                for (int i = 0; i < 8; i++)
                    for (int k = 0; k < 3; k++)
                        plate[i][k] = (i >> k & 1 ? 1.0 : -1.0) * (k == 2 ? 0.0005 : 1.0);
                scene_open(&s, 0, 0.0, 0.0, 0.0);
                add_hull(&s, s.ground, (const double(*)[3])plate, 8, NULL, 0.0);
                perp_body_settings settings = scene_defaults();
                settings.position[0] = passes ? 1.0 + 1.01 * 0.05 : 0.1;
                settings.position[2] = 3.3;
                settings.velocity[2] = -1000.0;
                settings.angular_velocity[2] = spins ? 50.0 : 0.0;
                perp_body body = scene_add(&s, &settings);
                if (kind == 0)
                    add_hull(&s, body, (const double(*)[3])points, prism(points, 6, 0.05, 0.02),
                             NULL, 0.0);
                else
                    add_capsule(&s, body, 0.02, 0.03, 0.0, 0.0);
                scene_step(&s, 0.01);
                scene_step(&s, 0.01);
                perp_body_state state = scene_state(&s, body);
                if (passes)
                    assert_true(state.velocity[2] == -1000.0);
                else
                    assert_true(state.position[2] > 0.0);
                scene_close(&s);
            }
}

/* A log pile: two capsules side by side between walls, one in the groove; and a hull on hulls.
 * Everything comes to rest with 0.0. (Above tan 30 degrees the groove may jam a log askew.) */
static void test_piles_rest(void **unused)
{
    static const double brick[8][3] = {{-1, -.5, -.25}, {1, -.5, -.25}, {-1, .5, -.25},
                                       {1, .5, -.25},   {-1, -.5, .25}, {1, -.5, .25},
                                       {-1, .5, .25},   {1, .5, .25}};
    perp_body bodies[8];
    int count = 0;
    scene s;
    (void)unused;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.3, 0.0);
    scene_plane(&s, s.ground, 0.0, 1.0, 0.0, -0.5, 0.3, 0.0);
    scene_plane(&s, s.ground, 0.0, -1.0, 0.0, -0.5, 0.3, 0.0);
    for (int i = 0; i < 3; i++, count++) {
        bodies[count] = dynamic_body(&s, 0.0, i == 0 ? -0.25 : 0.25 * (i == 1), i < 2 ? 0.25 : 0.7);
        add_capsule(&s, bodies[count], 0.25, 1.0, 0.0, 0.3);
    }
    for (int i = 0; i < 3; i++, count++) {
        bodies[count] = dynamic_body(&s, 5.0 + 0.3 * i, 0.0, 0.25 + 0.5 * i);
        add_hull(&s, bodies[count], brick, 8, NULL, 0.3);
    }
    scene_steps(&s, 200, 0.01);
    for (int i = 0; i < count; i++)
        assert_true(scene_rests(&s, bodies[i]));
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_weight_of_a_tetrahedron),
        cmocka_unit_test(test_weight_of_prisms),
        cmocka_unit_test(test_weight_of_a_capsule),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_points_that_are_no_corners),
        cmocka_unit_test(test_rolling_capsule),
        cmocka_unit_test(test_sliding_pyramid),
        cmocka_unit_test(test_tipping_prism),
        cmocka_unit_test(test_seams),
        cmocka_unit_test(test_bullets),
        cmocka_unit_test(test_piles_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
