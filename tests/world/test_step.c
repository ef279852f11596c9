/* The step as a whole: outcomes, existence, overlap, snapshots, the same bits again, any units. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

static perp_world_stats stats_of(scene *s)
{
    perp_world_stats stats = fresh_world_stats();

    SCENE_OK(s, perp_world_get_stats(s->world, &stats));
    return stats;
}

/* A ball of speed 1 between two walls that it touches, with restitutions of its own. */
static perp_body between_walls(scene *s, double left, double right)
{
    perp_body_settings settings = scene_settings();
    perp_body ball;

    scene_open(s, 0, 0.0, 0.0, 0.0);
    settings.velocity[0] = 1.0;
    ball = scene_add(s, &settings);
    scene_plane(s, s->ground, 1.0, 0.0, 0.0, -1.0, 0.0, left);
    scene_plane(s, s->ground, -1.0, 0.0, 0.0, -1.0, 0.0, right);
    scene_sphere(s, ball, 1.0, 0.0, 0.0);
    return ball;
}

/* Moreau's law asks -e_right u >= e_right here and lets go at most e_left: with e_left < e_right no
 * velocity obeys both. The state stays, and the result says so. */
static void test_ray(void **state)
{
    perp_step_result result = fresh_step_result();
    perp_body_state before, after;
    perp_body ball;
    scene s;

    (void)state;
    ball = between_walls(&s, 0.0, 0.5);
    before = scene_state(&s, ball);
    SCENE_OK(&s, perp_world_step(s.world, &result, 0.1));
    assert_int_equal(result.outcome, PERP_OUTCOME_RAY);
    assert_int_equal(result.advanced, 0);
    after = scene_state(&s, ball);
    assert_memory_equal(&before, &after, sizeof before);
    assert_int_equal(stats_of(&s).steps, 0);
    scene_close(&s);

    /* equal restitution has a step, in which the ball rattles 32 times; and so has none at all */
    ball = between_walls(&s, 0.5, 0.5);
    scene_step(&s, 0.1);
    assert_true(fabs(scene_state(&s, ball).velocity[0]) <= 0x1p-32);
    scene_close(&s);
    ball = between_walls(&s, 0.0, 0.0);
    scene_step(&s, 0.1);
    assert_true(scene_rests(&s, ball));
    scene_close(&s);
}

/* Kinematic walls that close on a ball leave it no velocity. */
static void test_squeezed(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_step_result result = fresh_step_result();
    perp_body ball;
    scene s;
    int i;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, 1.0, 0.0, 0.0);
    for (i = -1; i <= 1; i += 2) {
        settings.kind = PERP_BODY_KINEMATIC;
        settings.velocity[0] = -0.1 * i;
        scene_plane(&s, scene_add(&s, &settings), -i, 0.0, 0.0, -1.0, 0.0, 0.0);
    }
    SCENE_OK(&s, perp_world_step(s.world, &result, 0.1));
    assert_int_equal(result.outcome, PERP_OUTCOME_RAY);
    assert_int_equal(result.advanced, 0);
    scene_close(&s);
}

/* A limit on the work: strict worlds stay where they were, others go on with the best iterate. Five
 * boxes that slide and spin on each other take more than one sweep. */
static void test_limits(void **state)
{
    enum { boxes = 5 };
    int32_t strict;

    (void)state;
    for (strict = 0; strict < 2; strict++) {
        perp_world_settings world;
        perp_step_result result = fresh_step_result();
        perp_body_state before, after;
        perp_body box[boxes];
        scene s;
        int i;

        assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
        world.strict = strict;
        world.accuracy = PERP_ACCURACY_EXACT; /* nothing but tol counts as solved */
        world.method = PERP_CONTACT_METHOD_SWEEP;
        world.max_iterations = 1;
        scene_create(&s, &world);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
        for (i = 0; i < boxes; i++) {
            perp_body_settings settings = scene_settings();

            settings.position[2] = 0.5 + i;
            settings.velocity[0] = cos(2.0 * i);
            settings.velocity[1] = sin(2.0 * i);
            settings.angular_velocity[2] = 1.0 - i;
            box[i] = scene_add(&s, &settings);
            scene_box(&s, box[i], 0.5, 0.5, 0.5, 0.5, 0.0);
        }
        before = scene_state(&s, box[0]);
        SCENE_OK(&s, perp_world_step(s.world, &result, 0.1));
        assert_int_equal(result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
        assert_int_equal(result.advanced, !strict);
        after = scene_state(&s, box[0]);
        if (strict)
            assert_memory_equal(&before, &after, sizeof before);
        else
            assert_true(after.position[0] != before.position[0]);
        scene_close(&s);
    }
}

/* One body of two in each other along an axis goes by no more than a fifth of the overlap in a
 * step, and gets no velocity. */
static void part(scene *s, perp_body body, int axis, double apart)
{
    for (int k = 0; k < 40; k++) { /* a fifth 30 times is 1e-3, and what is little goes at once */
        const double before = scene_state(s, body).position[axis];
        double after;

        scene_step(s, 0.01);
        after = scene_state(s, body).position[axis];
        assert_true(fabs(after - before) <= fmax(0.2 * fabs(apart - before) + EPSILON, 4e-3));
        assert_true(scene_rests(s, body));
    }
}

/* Overlap goes in steps that are no jumps, and gives no velocity: a box in the ground, two balls in
 * each other (pushed in the ratio of their masses), and what rests meanwhile stays to the last bit.
 */
static void test_overlap_is_removed(void **state)
{
    perp_body_settings settings = scene_settings();
    perp_body_state far_before, far_after;
    perp_body box, light, heavy, resting;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    settings.position[2] = 0.45;
    box = scene_add(&s, &settings);
    scene_box(&s, box, 0.5, 0.5, 0.5, 0.5, 0.0);
    settings.position[0] = 10.0;
    settings.position[2] = 0.5;
    resting = scene_add(&s, &settings);
    scene_box(&s, resting, 0.5, 0.5, 0.5, 0.5, 0.0);
    far_before = scene_state(&s, resting);
    part(&s, box, 2, 0.5);
    scene_near(scene_state(&s, box).position[2], 0.5, 40.0 * EPSILON, "height");
    far_after = scene_state(&s, resting);
    assert_memory_equal(&far_before, &far_after, sizeof far_before);
    scene_close(&s);

    scene_open(&s, 0, 0.0, 0.0, 0.0);
    settings = scene_settings();
    light = scene_add(&s, &settings);
    settings.mass = 3.0;
    settings.position[0] = 1.6;
    heavy = scene_add(&s, &settings);
    scene_sphere(&s, light, 1.0, 0.0, 0.0);
    scene_sphere(&s, heavy, 1.0, 0.0, 0.0);
    part(&s, light, 0, -0.3);
    scene_near(scene_state(&s, light).position[0], -0.3, 40.0 * EPSILON, "light ball");
    scene_near(scene_state(&s, heavy).position[0], 1.7, 40.0 * EPSILON, "heavy ball");
    assert_true(scene_rests(&s, light) && scene_rests(&s, heavy));
    scene_close(&s);
}

/* Walls that overlap the ball from both sides: nothing to be done, and nothing breaks. */
static void test_overlap_that_stays(void **state)
{
    perp_body ball;
    scene s;
    int k;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    ball = scene_add(&s, NULL);
    scene_sphere(&s, ball, 1.0, 0.3, 0.0);
    scene_plane(&s, s.ground, 1.0, 0.0, 0.0, -0.9, 0.3, 0.0);
    scene_plane(&s, s.ground, -1.0, 0.0, 0.0, -0.9, 0.3, 0.0);
    for (k = 0; k < 5; k++) {
        scene_step(&s, 0.01);
        assert_true(scene_state(&s, ball).velocity[0] == 0.0);
        assert_true(fabs(scene_state(&s, ball).position[0]) <= 8.0 * EPSILON);
    }
    scene_close(&s);
}

/* Fast bodies do not pass through: the contact is there before they meet. */
static void test_no_tunnelling(void **state)
{
    static const double speeds[] = {10.0, 1e3, 1e6};
    size_t i;

    (void)state;
    for (i = 0; i < sizeof speeds / sizeof *speeds; i++) {
        perp_body_settings settings = scene_settings();
        perp_body ball, target;
        scene s;

        scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
        settings.position[2] = 2.0;
        settings.velocity[2] = -speeds[i];
        ball = scene_add(&s, &settings);
        scene_sphere(&s, ball, 0.5, 0.0, 0.0);
        scene_step(&s, 0.5);
        scene_near(scene_state(&s, ball).position[2], 0.5, 16.0 * EPSILON * speeds[i], "ground");
        scene_close(&s);

        scene_open(&s, 0, 0.0, 0.0, 0.0);
        settings = scene_settings();
        settings.velocity[0] = speeds[i];
        ball = scene_add(&s, &settings);
        settings.position[0] = 3.0;
        settings.velocity[0] = 0.0;
        target = scene_add(&s, &settings);
        scene_sphere(&s, ball, 0.5, 0.0, 0.0);
        scene_sphere(&s, target, 0.5, 0.0, 0.0);
        scene_step(&s, 0.5);
        assert_true(scene_state(&s, target).position[0] - scene_state(&s, ball).position[0] >=
                    1.0 - 16.0 * EPSILON * speeds[i]);
        scene_close(&s);
    }
}

/* A heap of boxes and balls that falls, hits, slides and rests. */
static void heap(scene *s, perp_body *bodies, int count)
{
    int i;

    scene_open(s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(s, s->ground, 0.0, 0.0, 1.0, 0.0, 0.4, 0.0);
    for (i = 0; i < count; i++) {
        perp_body_settings settings = scene_settings();

        settings.mass = 1.0 + 0.5 * i;
        settings.position[0] = 0.3 * sin(1.0 + i);
        settings.position[1] = 0.3 * sin(2.0 + 2.0 * i);
        settings.position[2] = 0.6 + 1.1 * i;
        settings.angular_velocity[0] = sin(3.0 + i);
        settings.orientation[0] = cos(0.1 * i);
        settings.orientation[1] = sin(0.1 * i);
        bodies[i] = scene_add(s, &settings);
        if (i % 2)
            scene_sphere(s, bodies[i], 0.4, 0.4, 0.3);
        else
            scene_box(s, bodies[i], 0.5, 0.4, 0.3, 0.4, 0.2);
    }
}

/* The same calls give the same bits, and a restored world goes on with the same bits. */
static void test_same_bits(void **state)
{
    enum { count = 6, before = 60, after = 60 };
    perp_body a[count], b[count];
    char blob[8192];
    size_t size;
    scene s, t;
    int i, k;

    (void)state;
    heap(&s, a, count);
    heap(&t, b, count);
    for (k = 0; k < before; k++) {
        scene_step(&s, 0.02);
        scene_step(&t, 0.02);
    }
    SCENE_OK(&s, perp_world_snapshot_size(s.world, &size));
    assert_true(size <= sizeof blob);
    SCENE_OK(&s, perp_world_snapshot_save(s.world, blob, size));
    for (k = 0; k < after; k++) {
        scene_step(&s, 0.02);
        scene_step(&t, 0.02);
    }
    SCENE_OK(&s, perp_world_snapshot_restore(s.world, blob, size));
    scene_steps(&s, after, 0.02);
    for (i = 0; i < count; i++) {
        perp_body_state x = scene_state(&s, a[i]), y = scene_state(&t, b[i]);

        assert_memory_equal(&x, &y, sizeof x);
    }
    scene_close(&s);
    scene_close(&t);
}

/* Nothing in the heap ever overlaps by more than a trace, and its energy falls. */
static void test_heap(void **state)
{
    enum { count = 6 };
    perp_body bodies[count];
    double energy = INFINITY;
    scene s;
    int k;

    (void)state;
    heap(&s, bodies, count);
    for (k = 0; k < 300; k++) {
        double kinetic, potential;
        int32_t i;

        scene_step(&s, 0.01);
        for (i = 0; i < perp_world_contact_count(s.world); i++) {
            perp_world_contact contact = scene_contact(&s, i);

            /* turning h w a step bends a linearised gap by (h w)^2 of the size, 0.01 in a step of
             * 0.1 rad, and sweeps take a share of it back in each; boxes that slide over each other
             * at 6 m/s and turn at 4 rad/s come to 5e-3 */
            assert_true(contact.gap > -1e-2);
            assert_true(contact.impulse[0] >= 0.0);
            assert_true(contact.mode != PERP_CONTACT_SEPARATE ||
                        (contact.impulse[0] == 0.0 && contact.impulse[1] == 0.0 &&
                         contact.impulse[2] == 0.0));
        }
        SCENE_OK(&s, perp_world_energy(s.world, &kinetic, &potential));
        if (k % 100 == 99) { /* between two looks a second apart */
            assert_true(kinetic + potential < energy * (1.0 + 1e-9));
            energy = kinetic + potential;
        }
    }
    scene_close(&s);
}

/* Rows of one step, counted by hand. */
static void test_statistics(void **state)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    perp_body_settings settings = scene_settings();
    perp_step_result result;
    perp_world_stats stats;
    perp_body box, ball;
    scene s;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    settings.position[2] = 0.5;
    box = scene_add(&s, &settings);
    scene_box(&s, box, half[0], half[1], half[2], 0.5, 0.0);
    settings.position[0] = 5.0;
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, 0.5, 0.0, 0.0); /* frictionless: one row */
    settings.position[0] = -5.0;
    settings.position[2] = 50.0;
    ball = scene_add(&s, &settings);
    scene_sphere(&s, ball, 0.5, 0.5, 0.0); /* in the air: none */
    result = scene_step(&s, 0.01);
    stats = stats_of(&s);
    assert_int_equal(result.contacts, 5);
    assert_int_equal(result.islands, 2);
    assert_int_equal(stats.contacts, 5);
    assert_int_equal(stats.islands, 2);
    assert_int_equal(stats.rows_normal, 5);
    assert_int_equal(stats.rows_friction, 2 * 4);
    assert_int_equal(stats.bodies, 4);
    assert_int_equal(stats.shapes, 4);
    assert_int_equal(stats.steps, 1);
    assert_int_equal(stats.impacts, 0);
    assert_true(stats.iterations > 0 && stats.iterations == result.iterations);
    assert_true(stats.seconds_collide >= 0.0 && stats.seconds_solve >= 0.0);
    scene_close(&s);
}

/* Units of length, mass and time scaled by powers of two scale every number of a run by powers of
 * two, with the same digits: no constant has a dimension. */
static void units_do_not_matter(double length, double mass, double time)
{
    perp_body bodies[2][2];
    scene s[2];
    int i, j, k;

    for (i = 0; i < 2; i++) {
        double L = i ? length : 1.0, M = i ? mass : 1.0, T = i ? time : 1.0;

        scene_open(&s[i], 1, 0.0, -8.0 * L / (T * T), 0.0);
        scene_plane(&s[i], s[i].ground, 0.0, 1.0, 0.0, 0.0, 0.5, 0.0);
        for (j = 0; j < 2; j++) {
            perp_body_settings settings = scene_settings();

            settings.mass = (1.0 + 3.0 * j) * M;
            settings.inertia[8] = 0.5 * M * L * L;
            settings.position[0] = 0.3 * j * L;
            settings.position[1] = (0.5 + 1.25 * j) * L;
            settings.velocity[0] = 2.0 * L / T;
            bodies[i][j] = scene_add(&s[i], &settings);
            scene_box(&s[i], bodies[i][j], 0.5 * L, 0.5 * L, 0.0, 0.5, 0.25);
        }
        scene_steps(&s[i], 100, 0.015625 * T);
    }
    for (j = 0; j < 2; j++) {
        perp_body_state x = scene_state(&s[0], bodies[0][j]);
        perp_body_state y = scene_state(&s[1], bodies[1][j]);

        for (k = 0; k < 3; k++) {
            assert_true(y.position[k] == x.position[k] * length);
            assert_true(y.velocity[k] == x.velocity[k] * length / time);
            assert_true(y.angular_velocity[k] == x.angular_velocity[k] / time);
        }
        assert_true(x.angle == y.angle);
    }
    scene_close(&s[0]);
    scene_close(&s[1]);
}

static void test_any_units(void **state)
{
    (void)state;
    units_do_not_matter(1024.0, 1.0, 1.0);
    units_do_not_matter(1.0, 0x1p-20, 1.0);
    units_do_not_matter(0x1p-20, 0x1p20, 0x1p-10);
    units_do_not_matter(0x1p30, 0x1p-40, 0x1p20);
}

/* Far from the origin a gap is known to fewer digits; what rests still rests. */
static void test_far_from_the_origin(void **state)
{
    static const double distances[] = {1e3, 1e6, 1e9};
    size_t i;
    int k;

    (void)state;
    for (i = 0; i < sizeof distances / sizeof *distances; i++) {
        double d = distances[i];
        perp_body_settings settings = scene_settings();
        perp_body boxes[2];
        scene s;
        int j;

        scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
        scene_plane(&s, s.ground, 0.0, 0.0, 1.0, d, 0.5, 0.0);
        for (j = 0; j < 2; j++) {
            settings.position[0] = d / 3.0;
            settings.position[1] = -d / 7.0;
            settings.position[2] = d + 0.1 + 0.2 * j;
            boxes[j] = scene_add(&s, &settings);
            scene_box(&s, boxes[j], 0.1, 0.1, 0.1, 0.5, 0.0);
        }
        for (k = 0; k < 10; k++) {
            scene_step(&s, 0.01);
            assert_true(scene_rests(&s, boxes[0]) && scene_rests(&s, boxes[1]));
        }
        scene_close(&s);
    }
}

/* A step that one body takes beyond the range of numbers leaves all as it was, also what flies
 * where nothing is near, before and after that body. */
static void test_refused_step_moves_nothing(void **context)
{
    perp_body_settings settings = scene_defaults();
    perp_step_result result = fresh_step_result();
    perp_body bodies[3];
    perp_body_state before[3];
    scene s;

    (void)context;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    for (int i = 0; i < 3; i++) {
        settings.mass = 1.0;
        settings.position[0] = 10.0 * i;
        settings.velocity[0] = i == 1 ? 1.5e308 : 1.0;
        bodies[i] = scene_add(&s, &settings);
        scene_sphere(&s, bodies[i], 0.5, 0.0, 0.0);
        before[i] = scene_state(&s, bodies[i]);
    }
    assert_int_equal(perp_world_step(s.world, &result, 10.0), PERP_ERROR_NOT_FINITE);
    for (int i = 0; i < 3; i++) {
        const perp_body_state after = scene_state(&s, bodies[i]);

        assert_memory_equal(&before[i], &after, sizeof after);
    }
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_refused_step_moves_nothing),
        cmocka_unit_test(test_ray),
        cmocka_unit_test(test_squeezed),
        cmocka_unit_test(test_limits),
        cmocka_unit_test(test_overlap_is_removed),
        cmocka_unit_test(test_overlap_that_stays),
        cmocka_unit_test(test_no_tunnelling),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_heap),
        cmocka_unit_test(test_statistics),
        cmocka_unit_test(test_any_units),
        cmocka_unit_test(test_far_from_the_origin),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
