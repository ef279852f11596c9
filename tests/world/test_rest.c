/* Rest is a fixed point: a world that skips the steps of what rests, and keeps the points of what
 * did not move, gives bit for bit what one gives that takes them all, and makes all points anew. */
#include <stdio.h>

#include "suite.h"

#include "gen.h"
#include "world/scene.h"
#include "world/step.h"

enum { MOST = 64, STEPS = 300 };

/* Two worlds with the same life: the second one never skips. */
typedef struct twins {
    scene worlds[2];
    perp_body bodies[2][MOST];
    void *blobs[2];
    size_t sizes[2];
    int count;
    uint64_t random;
    int asleep;   /* bodies, summed over steps */
    int compound; /* some of them */
    int kept;     /* pairs whose points were, summed over steps */
} twins;

static double uniform(twins *t, double low, double high)
{
    uint64_t z = t->random += UINT64_C(0x9e3779b97f4a7c15); /* splitmix64 */

    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return low + (high - low) * ldexp((double)((z ^ z >> 31) >> 11), -53);
}

static void open_twins(twins *t, int32_t planar, int32_t accuracy, int32_t wakeful, uint64_t seed)
{
    int k;

    memset(t, 0, sizeof *t);
    t->random = seed;
    for (k = 0; k < 2; k++) {
        perp_world_settings settings;

        assert_int_equal(perp_world_settings_init(&settings, sizeof settings, planar), PERP_OK);
        settings.accuracy = accuracy;
        settings.friction = 0.6;
        settings.wakeful = k || wakeful;
        scene_create(&t->worlds[k], &settings);
        scene_plane(&t->worlds[k], t->worlds[k].ground, 0.0, planar, !planar, 0.0, 0.6, 0.0);
    }
}

static void close_twins(twins *t)
{
    int k;

    for (k = 0; k < 2; k++) {
        free(t->blobs[k]);
        scene_close(&t->worlds[k]);
    }
}

static void half_box(scene *s, perp_body body, double x, double a, double b, double c)
{
    const double half[3] = {a, b, c};
    perp_shape_settings settings = scene_material(0.6, 0.0);

    settings.offset[0] = x;
    SCENE_OK(s, perp_world_add_box(s->world, NULL, body, half, &settings));
}

static void add(twins *t, int place, const perp_body_settings *settings, const double *half)
{
    const int ball = uniform(t, 0.0, 1.0) < 0.2;
    const int two = t->compound && uniform(t, 0.0, 1.0) < 0.3;
    int k;

    for (k = 0; k < 2; k++) {
        scene *s = &t->worlds[k];
        const perp_body body = scene_add(s, settings);

        if (ball)
            scene_sphere(s, body, half[0], 0.6, 0.0);
        else if (!two)
            scene_box(s, body, half[0], half[1], half[2], 0.6, 0.0);
        else /* side by side, with a seam between them */
            for (int side = -1; side <= 1; side += 2)
                half_box(s, body, side * half[0], half[0], half[1], half[2]);
        t->bodies[k][place] = body;
    }
}

static void add_random(twins *t, int place, int32_t planar, double height)
{
    const double kind = uniform(t, 0.0, 1.0);
    const double half[3] = {uniform(t, 0.2, 0.5), uniform(t, 0.2, 0.5), uniform(t, 0.2, 0.5)};
    perp_body_settings settings = scene_defaults();

    settings.kind = kind < 0.05  ? PERP_BODY_STATIC
                    : kind < 0.1 ? PERP_BODY_KINEMATIC
                                 : PERP_BODY_DYNAMIC;
    settings.position[0] = uniform(t, -6.0, 6.0);
    settings.position[1] = planar ? height : uniform(t, -3.0, 3.0);
    settings.position[2] = planar ? 0.0 : height;
    add(t, place, &settings, half);
}

/* Stacks that stand from the beginning, with space between them. */
static void add_stacks(twins *t, int32_t planar, int stacks, int levels)
{
    const double half[3] = {0.5, 0.5, 0.5};
    int i, j;

    for (i = 0; i < stacks; i++)
        for (j = 0; j < levels; j++) {
            perp_body_settings settings = scene_defaults();

            settings.position[0] = 3.0 * i - 6.0;
            settings.position[planar ? 1 : 2] = 0.5 + j;
            add(t, t->count++, &settings, half);
        }
}

static void push(twins *t, int body, int32_t planar)
{
    const double size = uniform(t, 0.0, 1.0) < 0.5 ? 0.0 : 4000.0;
    const double force[2] = {uniform(t, -size, size), uniform(t, -0.5, 1.0) * size};
    const double speed = uniform(t, 0.0, 1.0) < 0.2 ? uniform(t, -3.0, 3.0) : 0.0;
    int k;

    for (k = 0; k < 2; k++) {
        perp_body_state state = scene_state(&t->worlds[k], t->bodies[k][body]);
        perp_status status;

        state.force[0] = force[0];
        state.force[planar ? 1 : 2] = force[1];
        if (speed != 0.0)
            state.velocity[0] = speed;
        status = perp_world_set_body(t->worlds[k].world, &state, t->bodies[k][body]);
        assert_true(status == PERP_OK || status == PERP_ERROR_ARGUMENT); /* of static ones */
    }
}

static void replace(twins *t, int body, int32_t planar)
{
    int k;

    for (k = 0; k < 2; k++)
        SCENE_OK(&t->worlds[k], perp_world_remove_body(t->worlds[k].world, t->bodies[k][body]));
    add_random(t, body, planar, uniform(t, 1.0, 4.0));
    for (k = 0; k < 2; k++) { /* of other bodies */
        free(t->blobs[k]);
        t->blobs[k] = NULL;
    }
}

static void save_or_restore(twins *t)
{
    int k;

    for (k = 0; k < 2; k++) {
        perp_world *world = t->worlds[k].world;

        if (t->blobs[k]) {
            SCENE_OK(&t->worlds[k], perp_world_snapshot_restore(world, t->blobs[k], t->sizes[k]));
            free(t->blobs[k]);
            t->blobs[k] = NULL;
        } else {
            SCENE_OK(&t->worlds[k], perp_world_snapshot_size(world, &t->sizes[k]));
            t->blobs[k] = malloc(t->sizes[k]);
            SCENE_OK(&t->worlds[k], perp_world_snapshot_save(world, t->blobs[k], t->sizes[k]));
        }
    }
}

static void check_states(twins *t)
{
    int i;

    for (i = 0; i < t->count; i++) {
        const perp_body_state a = scene_state(&t->worlds[0], t->bodies[0][i]);
        const perp_body_state b = scene_state(&t->worlds[1], t->bodies[1][i]);

        assert_memory_equal(&a, &b, sizeof a);
    }
}

static void check_contacts(twins *t)
{
    int i, count = perp_world_contact_count(t->worlds[1].world);

    assert_int_equal(perp_world_contact_count(t->worlds[0].world), count);
    for (i = 0; i < count; i++) {
        const perp_world_contact a = scene_contact(&t->worlds[0], i);
        const perp_world_contact b = scene_contact(&t->worlds[1], i);

        assert_memory_equal(&a, &b, sizeof a);
    }
}

static void check_results(twins *t, perp_step_result *results)
{
    perp_world_stats stats[2];
    double energy[2][2];
    int k;

    for (k = 0; k < 2; k++) {
        results[k].iterations = 0; /* what is skipped takes none */
        assert_int_equal(perp_struct_init(&stats[k], sizeof stats[k]), PERP_OK);
        SCENE_OK(&t->worlds[k], perp_world_get_stats(t->worlds[k].world, &stats[k]));
        SCENE_OK(&t->worlds[k],
                 perp_world_energy(t->worlds[k].world, &energy[k][0], &energy[k][1]));
    }
    assert_memory_equal(&results[0], &results[1], sizeof results[0]);
    assert_int_equal(stats[0].islands, stats[1].islands);
    assert_int_equal(stats[0].contacts, stats[1].contacts);
    assert_int_equal(stats[0].rows_normal, stats[1].rows_normal);
    assert_int_equal(stats[0].rows_friction, stats[1].rows_friction);
    assert_int_equal(stats[0].steps, stats[1].steps);
    assert_memory_equal(&stats[0].residual, &stats[1].residual, sizeof stats[0].residual);
    assert_memory_equal(energy[0], energy[1], sizeof energy[0]);
}

static void step_twins(twins *t, double h)
{
    perp_step_result results[2];
    int k;

    t->worlds[1].world->sleep.settled = 0; /* all points anew */
    for (k = 0; k < 2; k++) {
        assert_int_equal(perp_struct_init(&results[k], sizeof results[k]), PERP_OK);
        SCENE_OK(&t->worlds[k], perp_world_step(t->worlds[k].world, &results[k], h));
    }
    check_results(t, results);
    check_states(t);
    check_contacts(t);
    for (k = 0; k < t->worlds[0].world->pairs.count; k++)
        t->kept += perp__ordered_pair(t->worlds[0].world, k)->same;
    t->asleep += t->count - t->worlds[0].world->sleep.awake_count;
    assert_true(t->worlds[1].world->sleep.awake_count >= t->count);
}

static void live(twins *t, int32_t planar, int steps)
{
    double h = 0.01;
    int i;

    for (i = 0; i < steps; i++) {
        const double what = uniform(t, 0.0, 1.0);
        const int body = (int)uniform(t, 0.0, t->count);

        if (what < 0.03)
            push(t, body, planar);
        else if (what < 0.04)
            replace(t, body, planar);
        else if (what < 0.05)
            save_or_restore(t);
        else if (what < 0.055)
            h = uniform(t, 0.005, 0.02);
        if (what < 0.1)
            check_contacts(t); /* those of the last step all the same */
        step_twins(t, h);
    }
}

static void test_random_lives(void **state)
{
    int32_t planar, accuracy;
    int asleep = 0;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (accuracy = PERP_ACCURACY_FAST; accuracy <= PERP_ACCURACY_EXACT; accuracy++) {
            twins t;
            int i;

            open_twins(&t, planar, accuracy, 0, 77 + (uint64_t)(10 * accuracy + planar));
            add_stacks(&t, planar, 4, 3);
            for (i = 0; i < 12; i++)
                add_random(&t, t.count++, planar, uniform(&t, 0.5, 5.0));
            live(&t, planar, STEPS);
            asleep += t.asleep;
            close_twins(&t);
        }
    assert_true(asleep > 8 * 4 * STEPS); /* a body in six at the very least */
}

/* Where nothing sleeps, bodies of two shapes among them. */
static void test_kept_points(void **state)
{
    int32_t planar, accuracy;
    int kept = 0;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (accuracy = PERP_ACCURACY_FAST; accuracy <= PERP_ACCURACY_EXACT; accuracy++) {
            twins t;
            int i;

            open_twins(&t, planar, accuracy, 1, 177 + (uint64_t)(10 * accuracy + planar));
            t.compound = 1;
            add_stacks(&t, planar, 4, 3);
            for (i = 0; i < 12; i++)
                add_random(&t, t.count++, planar, uniform(&t, 0.5, 5.0));
            live(&t, planar, STEPS);
            kept += t.kept;
            close_twins(&t);
        }
    assert_true(kept > 8 * 6 * STEPS); /* half of the pairs of those that stand, at least */
}

/* A step that came to nothing after it had looked for contacts, of which some were gone, leaves
 * nothing behind. */
static void test_vain_step(void **state)
{
    perp_body_state before, away;
    scene *s;
    twins t;

    (void)state;
    open_twins(&t, 0, PERP_ACCURACY_STANDARD, 1, 1);
    add_stacks(&t, 0, 4, 2);
    s = &t.worlds[0];
    for (int i = 0; i < 10; i++)
        step_twins(&t, 0.01);
    before = away = scene_state(s, t.bodies[0][1]); /* the upper one of a stack */
    assert_true(t.kept > 0);
    away.position[2] += 0.05; /* not so far that they are no pair */
    SCENE_OK(s, perp_world_set_body(s->world, &away, t.bodies[0][1]));
    SCENE_OK(s, perp__find_contacts(s->world, 0.01));
    perp__stop_all_coasting(s->world);
    assert_true(s->world->contacts.now.count < s->world->contacts.last.count);
    SCENE_OK(s, perp_world_set_body(s->world, &before, t.bodies[0][1]));
    SCENE_OK(&t.worlds[1], perp_world_set_body(t.worlds[1].world, &before, t.bodies[1][1]));
    for (int i = 0; i < 5; i++)
        step_twins(&t, 0.01);
    close_twins(&t);
}

/* A box on another on a tile: all sleep, and wake when the lower one goes or is pushed, when a ball
 * comes, or when the tile goes. */
static void test_what_wakes(void **state)
{
    int how;

    (void)state;
    for (how = 0; how < 4; how++) {
        perp_body tile, boxes[2];
        perp_body_settings settings = scene_defaults();
        scene s;
        int i, moved = 0;

        scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
        settings.kind = PERP_BODY_STATIC;
        settings.position[2] = -0.5;
        tile = scene_add(&s, &settings);
        scene_box(&s, tile, 2.0, 2.0, 0.5, 0.5, 0.0);
        settings.kind = PERP_BODY_DYNAMIC;
        for (i = 0; i < 2; i++) {
            settings.position[2] = 0.5 + i;
            boxes[i] = scene_add(&s, &settings);
            scene_box(&s, boxes[i], 0.5, 0.5, 0.5, 0.5, 0.0);
        }
        scene_steps(&s, 10, 0.01);
        assert_int_equal(s.world->sleep.awake_count, 0);
        assert_int_equal(scene_step(&s, 0.01).contacts, 8);
        if (how == 0) {
            SCENE_OK(&s, perp_world_remove_body(s.world, boxes[0]));
        } else if (how == 1) {
            scene_push(&s, boxes[0], 1e5, 0.0, 0.0);
        } else if (how == 3) {
            SCENE_OK(&s, perp_world_remove_body(s.world, tile));
        } else {
            settings.position[0] = -3.0;
            settings.velocity[0] = 30.0;
            scene_sphere(&s, scene_add(&s, &settings), 0.5, 0.5, 0.0);
        }
        for (i = 0; i < 20; i++) {
            scene_step(&s, 0.01);
            moved += !scene_rests(&s, boxes[1]);
        }
        assert_true(moved > 0);
        scene_close(&s);
    }
}

/* A ball that fell freely for a while is hit by a bullet within one step, off its centre and level
 * with it: both go on to fall as they did, g h a step, for the impulse is level. */
static void test_bullet_hits_what_fell(void **state)
{
    const double h = 0.01;

    (void)state;
    for (int32_t steps = 1; steps < 30; steps++)
        for (int32_t first = 0; first < 2; first++) { /* which of the two was added first */
            perp_body_settings settings = scene_defaults();
            perp_body_state bullet, hit;
            perp_body balls[2];
            scene s;

            scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
            for (int32_t i = 0; i < 2; i++) {
                settings.position[0] = i == first ? 0.0 : -500.0;
                balls[i] = scene_add(&s, &settings);
                scene_sphere(&s, balls[i], 0.5, 0.0, 0.0);
            }
            scene_steps(&s, steps, h);
            bullet = scene_state(&s, balls[1 - first]);
            bullet.position[0] = -8.0;
            bullet.position[1] = 0.3;
            bullet.velocity[0] = 1000.0;
            SCENE_OK(&s, perp_world_set_body(s.world, &bullet, balls[1 - first]));
            assert_int_equal(scene_step(&s, h).contacts, 1);
            bullet = scene_state(&s, balls[1 - first]);
            hit = scene_state(&s, balls[first]);
            /* roundings of 1000 m/s */
            assert_true(fabs(bullet.velocity[2] + GRAVITY * h * (steps + 1)) <= 1e-11);
            assert_true(fabs(hit.velocity[2] + GRAVITY * h * (steps + 1)) <= 1e-11);
            assert_true(hit.velocity[0] > 100.0);
            assert_true(fabs(bullet.velocity[0] + hit.velocity[0] - 1000.0) <= 1e-11);
            scene_close(&s);
        }
}

/* Boxes of some decimetres on a slab, up to 1e12 m from the origin, where places are known to 1e-4
 * m: what looks like a gap or an overlap is rounding, and all is at rest. */
static void test_rest_far_away(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 200; seed++) {
        perp_body_settings settings = scene_defaults();
        gen_random random;
        perp_body boxes[3];
        double top, half;
        int32_t count;
        scene s;

        gen_seed(&random, seed);
        top = pow(10.0, gen_uniform(&random, 7.0, 12.0));
        half = gen_uniform(&random, 0.1, 1.0);
        count = 1 + gen_integer(&random, 3);
        scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
        settings.kind = PERP_BODY_STATIC;
        settings.position[2] = top - 0.3;
        scene_box(&s, scene_add(&s, &settings), 5.0, 5.0, 0.3, 0.5, 0.0);
        settings.kind = PERP_BODY_DYNAMIC;
        for (int32_t i = 0; i < count; i++) {
            settings.position[2] = top + half + 2.0 * half * i;
            boxes[i] = scene_add(&s, &settings);
            scene_box(&s, boxes[i], half, half, half, 0.5, 0.0);
        }
        for (int32_t k = 0; k < 3; k++) {
            scene_step(&s, 0.01);
            for (int32_t i = 0; i < count; i++)
                assert_true(scene_rests(&s, boxes[i]));
        }
        scene_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_lives),
        cmocka_unit_test(test_kept_points),
        cmocka_unit_test(test_vain_step),
        cmocka_unit_test(test_what_wakes),
        cmocka_unit_test(test_bullet_hits_what_fell),
        cmocka_unit_test(test_rest_far_away),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
