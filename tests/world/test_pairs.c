/* The pairs of a world against the double loop over its shapes, while bodies come, go and move. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"
#include "world/step.h"

enum { BODIES = 40 };

static double uniform(uint64_t *state, double low, double high)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15); /* splitmix64 */

    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return low + (high - low) * ldexp((double)((z ^ z >> 31) >> 11), -53);
}

static perp_body add_random(scene *s, uint64_t *state, int32_t planar)
{
    perp_body_settings settings = scene_settings();
    perp_body body;
    int k, shapes = 1 + (int)uniform(state, 0.0, 2.0);

    settings.kind = (int32_t)uniform(state, 0.0, 3.0);
    for (k = 0; k < (planar ? 2 : 3); k++) {
        settings.position[k] = uniform(state, -2.0, 2.0);
        if (settings.kind != PERP_BODY_STATIC)
            settings.velocity[k] = uniform(state, -3.0, 3.0);
    }
    if (settings.kind != PERP_BODY_STATIC)
        settings.angular_velocity[2] = uniform(state, -5.0, 5.0);
    body = scene_add(s, &settings);
    for (k = 0; k < shapes; k++) {
        const double kind = uniform(state, 0.0, 1.0);

        if (kind < 0.1 && settings.kind != PERP_BODY_DYNAMIC)
            scene_plane(s, body, uniform(state, 0.1, 1.0), uniform(state, -1.0, 1.0), 0.0, -8.0,
                        0.0, 0.0);
        else if (kind < 0.5)
            scene_sphere(s, body, uniform(state, 0.0, 0.7), 0.0, 0.0);
        else
            scene_box(s, body, uniform(state, 0.05, 0.7), uniform(state, 0.05, 0.7),
                      uniform(state, 0.05, 0.7), 0.0, 0.0);
    }
    return body;
}

/* Whether a pair of the two shapes is in the world's list; pairs are in order. */
static int has_pair(const perp_world *world, int32_t a, int32_t b)
{
    int32_t i, found = 0;

    for (i = 0; i < world->pairs.count; i++) {
        const perp__pair *pair = perp__ordered_pair(world, i);

        found += pair->first == a && pair->second == b;
    }
    assert_true(found <= 1);
    return found;
}

/* Every two shapes that collide where the last step left them make a pair; what makes one is of two
 * bodies of which one moves. */
static int check_pairs(perp_world *world)
{
    int32_t a, b, i, collisions = 0;

    if (world->sleep.awake_changed)
        perp__list_awake(world);
    perp__place(world, world->bodies.states);
    assert_int_equal(perp__enclose(world, world->sleep.awake, world->sleep.awake_count, 0.0, 1.0),
                     PERP_OK);
    for (i = 1; i < world->pairs.count; i++) {
        const perp__pair *last = perp__ordered_pair(world, i - 1),
                         *here = perp__ordered_pair(world, i);

        assert_true(last->first < here->first ||
                    (last->first == here->first && last->second < here->second));
    }
    for (a = 0; a < world->shapes.slots; a++)
        for (b = a + 1; b < world->shapes.slots; b++) {
            const perp__shape *x = &world->shapes.all[a], *y = &world->shapes.all[b];
            perp__point points[PERP__MAX_POINTS];

            if (!x->alive || !y->alive) {
                assert_int_equal(has_pair(world, a, b), 0);
                continue;
            }
            if (x->body == y->body || (world->bodies.all[x->body].kind != PERP_BODY_DYNAMIC &&
                                       world->bodies.all[y->body].kind != PERP_BODY_DYNAMIC)) {
                assert_int_equal(has_pair(world, a, b), 0);
                continue;
            }
            if (perp__collide(&world->step.placed[a], &world->step.placed[b],
                              world->settings.planar, 0.0, points) == 0)
                continue;
            collisions++;
            assert_int_equal(has_pair(world, a, b), 1);
        }
    return collisions;
}

static void test_pairs_of_random_motion(void **context)
{
    int32_t planar;

    (void)context;
    for (planar = 0; planar < 2; planar++) {
        uint64_t state = 31 + (uint64_t)planar;
        perp_body bodies[BODIES];
        perp_world_settings settings;
        int round, i, collisions = 0;
        scene s;

        assert_int_equal(perp_world_settings_init(&settings, sizeof settings, planar), PERP_OK);
        settings.max_iterations = 20; /* any motion will do */
        scene_create(&s, &settings);
        for (i = 0; i < BODIES; i++)
            bodies[i] = add_random(&s, &state, planar);
        for (round = 0; round < 60; round++) {
            SCENE_OK(&s, perp_world_step(s.world, NULL, 0.02));
            collisions += check_pairs(s.world);
            i = (int)uniform(&state, 0.0, BODIES);
            if (round % 3 == 0) {
                SCENE_OK(&s, perp_world_remove_body(s.world, bodies[i]));
                bodies[i] = add_random(&s, &state, planar);
            } else if (round % 3 == 1) {
                perp_body_state at = scene_state(&s, bodies[i]);

                at.position[0] = uniform(&state, -2.0, 2.0);
                at.position[1] = uniform(&state, -2.0, 2.0);
                SCENE_OK(&s, perp_world_set_body(s.world, &at, bodies[i]));
            }
            collisions += check_pairs(s.world);
        }
        assert_true(collisions > 50); /* else nothing was looked at */
        scene_close(&s);
    }
}

/* A stack, a row and a plane's worth of boxes: the pairs are those of neighbours, a bounded number
 * for each. */
static void test_pairs_are_few(void **context)
{
    enum { SIDE = 12, ALL = SIDE * SIDE * SIDE };
    int axes;

    (void)context;
    for (axes = 1; axes <= 3; axes++) {
        int i, count = axes == 1 ? ALL : axes == 2 ? 41 * 41 : ALL;
        int side = axes == 1 ? ALL : axes == 2 ? 41 : SIDE;
        scene s;

        scene_open(&s, 0, 0.0, 0.0, 0.0);
        for (i = 0; i < count; i++) {
            perp_body_settings settings = scene_settings();

            settings.position[2] = 1.5 * (i % side);
            settings.position[1] = axes > 1 ? 1.5 * (i / side % side) : 0.0;
            settings.position[0] = axes > 2 ? 1.5 * (i / side / side) : 0.0;
            scene_box(&s, scene_add(&s, &settings), 0.5, 0.5, 0.5, 0.0, 0.0);
        }
        scene_step(&s, 0.01);
        assert_int_equal(s.world->pairs.count, 0);
        scene_close(&s);
    }
}

/* Balls in a grid have pairs with those next to them alone: 3 N^2 (N - 1), not with the 20 others
 * whose boxes meet theirs at edges and corners. */
static void test_balls_across_are_no_pairs(void **context)
{
    enum { SIDE = 8, ALL = SIDE * SIDE * SIDE };
    scene s;

    (void)context;
    scene_open(&s, 0, 0.0, 0.0, 0.0);
    for (int i = 0; i < ALL; i++) {
        perp_body_settings settings = scene_settings();

        settings.position[0] = 1.02 * (i % SIDE);
        settings.position[1] = 1.02 * (i / SIDE % SIDE);
        settings.position[2] = 1.02 * (i / SIDE / SIDE);
        scene_sphere(&s, scene_add(&s, &settings), 0.5, 0.0, 0.0);
    }
    scene_step(&s, 0.01);
    assert_int_equal(s.world->pairs.count, 3 * SIDE * SIDE * (SIDE - 1));
    scene_close(&s);
}

/* Every contact that the step starts with knows what the last step gave it. */
static void check_warm(perp_world *world, const perp__contact_set *last)
{
    int32_t i, j, k, known = 0;

    assert_int_equal(perp__find_contacts(world, 0.01), PERP_OK);
    for (i = 0; i < world->contacts.now.count; i++)
        for (j = 0; j < last->count; j++) {
            const perp__world_contact *now = &world->contacts.now.contacts[i];
            const perp__world_contact *before = &last->contacts[j];

            if (now->shape_a != before->shape_a || now->shape_b != before->shape_b ||
                now->feature != before->feature)
                continue;
            known++;
            for (k = 0; k < 3; k++) /* the frames are the same but for rounding */
                scene_near(world->contacts.now.responses[i].warm[k], last->responses[j].impulse[k],
                           1e-9, "impulse of the last step");
        }
    assert_int_equal(known, world->contacts.now.count);
}

/* Impulses stay with their points: from step to step, and through a snapshot that is restored after
 * the bodies went elsewhere. */
static void test_impulses_are_remembered(void **context)
{
    static perp__world_contact contacts[64];
    static perp__response responses[64];
    perp__contact_set last = {.contacts = contacts, .responses = responses};
    perp_body_settings settings = scene_defaults();
    perp_body boxes[3];
    int32_t i;
    char blob[8192];
    size_t size;
    scene s;

    (void)context;
    scene_open(&s, 0, 1.0, 0.0, -GRAVITY);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    for (i = 0; i < 3; i++) {
        settings.mass = 1.0;
        settings.position[0] = 0.1 * i;
        settings.position[2] = 0.5 + i;
        boxes[i] = scene_add(&s, &settings);
        scene_box(&s, boxes[i], 0.5, 0.5, 0.5, 0.5, 0.0);
    }
    scene_step(&s, 0.01);
    scene_step(&s, 0.01);
    last.count = s.world->contacts.last.count;
    assert_int_equal(last.count, 12); /* the upper corners of the lowest box are none */
    memcpy(contacts, s.world->contacts.last.contacts, (size_t)last.count * sizeof *contacts);
    memcpy(responses, s.world->contacts.last.responses, (size_t)last.count * sizeof *responses);
    assert_true(responses[0].impulse[0] > 0.0 || responses[1].impulse[0] > 0.0);
    SCENE_OK(&s, perp_world_snapshot_size(s.world, &size));
    assert_true(size <= sizeof blob);
    SCENE_OK(&s, perp_world_snapshot_save(s.world, blob, size));
    check_warm(s.world, &last);
    for (i = 0; i < 3; i++) {
        perp_body_state state = scene_state(&s, boxes[i]);

        state.position[0] += 50.0 * (i + 1);
        SCENE_OK(&s, perp_world_set_body(s.world, &state, boxes[i]));
    }
    scene_step(&s, 0.01);
    SCENE_OK(&s, perp_world_snapshot_restore(s.world, blob, size));
    perp__place(s.world, s.world->bodies.states);
    check_warm(s.world, &last);
    scene_close(&s);
}

/* A ball throws a box over that stands: corners that were left out of the step come after all. What
 * all points of the box remember is what the step before gave, once; those new ones nothing. */
static void test_late_corners_remember_nothing(void **context)
{
    const double h = 0.05;
    perp_body_settings settings = scene_defaults();
    double given = 0.0, remembered = 0.0;
    int32_t late = 0;
    scene s;

    (void)context;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    s.world->settings.accuracy = PERP_ACCURACY_EXACT;
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.9, 0.0);
    settings.mass = 1.0;
    settings.position[2] = 0.5;
    scene_box(&s, scene_add(&s, &settings), 0.5, 0.5, 0.5, 0.9, 0.0);
    scene_step(&s, h);
    for (int32_t i = 0; i < s.world->contacts.last.count; i++)
        given += s.world->contacts.last.responses[i].next[0];
    settings.mass = 20.0;
    settings.position[0] = -1.1;
    settings.position[2] = 0.9;
    settings.velocity[0] = 60.0;
    scene_sphere(&s, scene_add(&s, &settings), 0.5, 0.5, 0.0);
    scene_step(&s, h);
    for (int32_t i = 0; i < s.world->contacts.last.count; i++) {
        remembered += s.world->contacts.last.responses[i].remembered[0];
        late += s.world->contacts.last.contacts[i].position[2] >
                0.4; /* between an upper corner and 0 */
    }
    assert_true(given > 0.0);
    assert_true(late > 0); /* else it says nothing */
    scene_near(remembered, given, 1e-12 * given, "impulse of the last step");
    scene_close(&s);
}

/* A ball of 20 kg hits a box that stands on an edge, so hard that corners which were 0.7 m above
 * the floor would be below it by the end of the step if they went on as they begin to: on their
 * arcs none is, to the rounding of the solve. */
static void test_far_corners_come_late(void **context)
{
    const double h = 0.05, c = sqrt(0.5);
    perp_body_settings settings = scene_defaults();
    const double *moving;
    perp_body box;
    int32_t slot, k, fell = 0;
    scene s;

    (void)context;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    s.world->settings.accuracy = PERP_ACCURACY_EXACT;
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    settings.mass = 1.0;
    settings.position[2] = c;
    settings.orientation[0] = cos(PI / 8);
    settings.orientation[2] = sin(PI / 8);
    box = scene_add(&s, &settings);
    scene_box(&s, box, 0.5, 0.5, 0.5, 0.5, 0.0);
    settings.mass = 20.0;
    settings.position[0] = -1.1;
    settings.position[2] = 1.4;
    settings.velocity[0] = 60.0;

    scene_sphere(&s, scene_add(&s, &settings), 0.5, 0.5, 0.0);
    scene_step(&s, h);
    SCENE_OK(&s, perp_world_body_slot(s.world, &slot, box));
    moving = s.world->step.motions[slot].moving;
    for (k = 0; k < 8; k++) {
        const double x = k & 1 ? 0.5 : -0.5, y = k & 2 ? 0.5 : -0.5, z = k & 4 ? 0.5 : -0.5;
        const double start = c + c * (z - x), angle = h * moving[4];
        const double rate = moving[2] + moving[3] * y - moving[4] * c * (x + z);
        const double end =
            c + h * (moving[2] + moving[3] * y) + c * (cos(angle) * (z - x) - sin(angle) * (x + z));

        assert_true(fabs(moving[3]) + fabs(moving[5]) < 1e-6); /* it turns about y alone */
        assert_true(end > -1e-8);
        fell += start > 0.5 && start + h * rate < 1e-8;
    }
    assert_true(fell > 0); /* else it says nothing */
    scene_close(&s);
}

/* After the looks a point that lies deep joins where the velocities break its law by more than
 * passes leave: |u| / sqrt(W) is a share of the drive (contact/coloured), with W = 1 / m of a ball
 * on what rests. Where no passes were made, nothing is left. Its island is not solved for less: the
 * same points joined again and again, and nothing changed. */
static void test_deep_points_join_where_they_press(void **context)
{
    const double h = 0.01, v = 0.5, deep = 1e-2;
    static const struct {
        double mass, factor; /* of the speed that is left */
        int32_t comes;
    } cases[] = {{1.0, 0.9, 0},  {1.0, 1.1, 1},  {9.0, 0.9, 0},     {9.0, 1.1, 1},
                 {0.01, 0.9, 0}, {0.01, 1.1, 1}, {1.0, INFINITY, 1}};

    (void)context;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        perp_body_settings settings = scene_settings();
        perp__solve_summary summary;
        int32_t slot, came = 0;
        perp_body ball;
        perp_world *world;
        scene s;

        scene_open(&s, 0, 0.0, 0.0, 0.0);
        world = s.world;
        world->settings.accuracy = PERP_ACCURACY_FAST;
        scene_box(&s, s.ground, 5.0, 5.0, 1.0, 0.5, 0.0);
        settings.mass = cases[i].mass;
        settings.position[2] = 1.45; /* in it by a tenth of its radius */
        ball = scene_add(&s, &settings);
        scene_sphere(&s, ball, 0.5, 0.5, 0.0);
        SCENE_OK(&s, perp_world_body_slot(world, &slot, ball));
        SCENE_OK(&s, perp__find_step_contacts(world, h, &summary));
        assert_int_equal(world->contacts.now.included, 1);
        world->contacts.now.flags[0].included = 0;
        world->contacts.now.included = world->contacts.now.rubbing = 0;
        world->step.motions[slot].after[2] = world->step.motions[slot].moving[2] = -v;
        world->step.motions[slot].verdict.drive =
            v * sqrt(cases[i].mass) / cases[i].factor / perp__swept_tol(world);
        SCENE_OK(&s, perp__join_contacts(world, h, deep, &came));
        assert_int_equal(came, cases[i].comes);
        scene_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pairs_of_random_motion),
        cmocka_unit_test(test_pairs_are_few),
        cmocka_unit_test(test_balls_across_are_no_pairs),
        cmocka_unit_test(test_impulses_are_remembered),
        cmocka_unit_test(test_late_corners_remember_nothing),
        cmocka_unit_test(test_far_corners_come_late),
        cmocka_unit_test(test_deep_points_join_where_they_press),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
