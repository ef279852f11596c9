/* Threads of a step: the same bits at any number of them, of the world's own or of a caller's; what
 * fails on one of them fails in order; memory that may run out, and is warm after a few steps. A
 * thread sanitizer sees what these tests can't (make SANITIZE=thread test-threads). */
#include <stdio.h>

#include "suite.h"
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include "world/scene.h"
#include "world/world.h"

enum { BODIES = 180, STEPS = 6, MOST_BYTES = 1 << 21 };

typedef struct ledger {
    long calls, fail_at, alive;
} ledger;

static void *allocate(size_t size, void *user)
{
    ledger *l = user;

    if (++l->calls == l->fail_at)
        return NULL;
    l->alive++;
    return malloc(size);
}

static void release(void *pointer, void *user)
{
    ledger *l = user;

    l->alive--;
    free(pointer);
}

static double draw(uint64_t *seed, double low, double high)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (high - low) * (double)(*seed >> 11) / 9007199254740992.0;
}

/* ---- callers' ways to run tasks ---- */

/* One after the other, last first; some of them twice, which is once too often. */
static void run_backwards(perp_task task, void *data, int32_t count, void *user)
{
    int32_t *calls = user;

    for (int32_t i = count; i-- > 0;) {
        task(i, data);
        if (i % 2 == 0)
            task(i, data);
    }
    ++*calls;
}

/* None at all: the step does it all the same. */
static void run_nothing(perp_task task, void *data, int32_t count, void *user)
{
    (void)task;
    (void)data;
    (void)count;
    ++*(int32_t *)user;
}

typedef struct errand {
    perp_task task;
    void *data;
    int32_t index;
    pthread_t thread;
} errand;

static void *run_errand(void *object)
{
    errand *e = object;

    e->task(e->index, e->data);
    return NULL;
}

/* Each on a thread of its own. */
static void run_on_threads(perp_task task, void *data, int32_t count, void *user)
{
    errand errands[16];

    assert_true(count <= 16);
    for (int32_t i = 0; i < count; i++) {
        errands[i] = (errand){task, data, i, 0};
        assert_int_equal(pthread_create(&errands[i].thread, NULL, run_errand, &errands[i]), 0);
    }
    for (int32_t i = 0; i < count; i++)
        pthread_join(errands[i].thread, NULL);
    ++*(int32_t *)user;
}

/* ---- random worlds ---- */

typedef struct way {
    int32_t threads;
    perp_run_tasks run;
} way;

static const way ways[] = {{0, NULL}, {1, NULL},          {2, NULL},           {3, NULL},
                           {7, NULL}, {4, run_backwards}, {5, run_on_threads}, {3, run_nothing}};
enum { WAYS = sizeof ways / sizeof *ways };

static void hang(scene *s, perp_body from, perp_body to, const double *at, int32_t planar)
{
    perp_joint_settings hinge = fresh_joint_settings();
    perp_joint joint;

    hinge.kind = PERP_JOINT_REVOLUTE;
    hinge.motor_speed = 1.0;
    hinge.motor_force = 5.0;
    memcpy(hinge.anchor, at, sizeof hinge.anchor);
    if (planar)
        hinge.anchor[2] = 0.0;
    SCENE_OK(s, perp_world_add_joint(s->world, &joint, from, to, &hinge));
}

/* Little piles all over a floor, some on a belt that moves, some hung up, some that fly. */
static void populate(scene *s, uint64_t seed, int32_t planar, int32_t bodies)
{
    const int32_t up = planar ? 1 : 2;
    perp_body last = 0;

    scene_plane(s, s->ground, 0.0, up == 1, up == 2, 0.0, 0.5, 0.0);
    for (int32_t i = 0; i < bodies; i++) {
        perp_body_settings settings = scene_defaults();
        const double size = draw(&seed, 0.3, 0.5), kind = draw(&seed, 0.0, 1.0);
        perp_body body;

        settings.position[0] = 1.5 * (i / 3 % 30) + draw(&seed, -0.1, 0.1);
        if (!planar)
            settings.position[1] = 2.0 * (i / 90) + draw(&seed, -0.1, 0.1);
        settings.position[up] = size + 1.05 * (i % 3) + (kind > 0.95 ? 20.0 : 0.0);
        settings.velocity[0] = draw(&seed, -0.5, 0.5);
        if (kind < 0.02) {
            settings.kind = PERP_BODY_KINEMATIC;
            settings.position[up] = -0.4;
        }
        body = scene_add(s, &settings);
        if (kind < 0.5)
            scene_box(s, body, size, size, planar ? 0.0 : size, 0.4, kind < 0.1 ? 0.5 : 0.0);
        else
            scene_sphere(s, body, size, 0.4, kind > 0.9 ? 0.5 : 0.0);
        if (kind > 0.8 && kind < 0.85)
            hang(s, s->ground, body, settings.position, planar);
        if (kind > 0.4 && kind < 0.43 && last)
            hang(s, last, body, settings.position, planar);
        last = kind < 0.02 ? 0 : body;
    }
}

static void open_way(scene *s, ledger *l, const way *at, int32_t *calls, int32_t planar,
                     int32_t accuracy)
{
    perp_context_settings settings = fresh_context_settings();
    perp_world_settings world;

    memset(s, 0, sizeof *s);
    settings.allocate = allocate;
    settings.release = release;
    settings.allocator_user = l;
    assert_int_equal(perp_context_create(&s->context, &settings), PERP_OK);
    assert_int_equal(perp_world_settings_init(&world, sizeof world, planar), PERP_OK);
    world.accuracy = accuracy;
    world.threads = at->threads;
    world.run_tasks = at->run;
    world.tasks_user = calls;
    SCENE_OK(s, perp_world_create(s->context, &s->world, &world));
    s->ground = perp_world_ground(s->world);
}

/* All that a step leaves: states and memories, results, contacts, counts. */
static size_t write_all(scene *s, const perp_step_result *result, char *to)
{
    perp_world_stats stats = fresh_world_stats();
    size_t size, all;
    int32_t i;

    SCENE_OK(s, perp_world_snapshot_size(s->world, &size));
    assert_true(size < MOST_BYTES / 2);
    SCENE_OK(s, perp_world_snapshot_save(s->world, to, size));
    memset(to, 0, 64); /* the header names the world */
    memcpy(to + size, result, sizeof *result);
    all = size + sizeof *result;
    for (i = 0; i < perp_world_contact_count(s->world); i++, all += sizeof(perp_world_contact)) {
        const perp_world_contact contact = scene_contact(s, i);

        assert_true(all + sizeof contact < MOST_BYTES);
        memcpy(to + all, &contact, sizeof contact);
    }
    SCENE_OK(s, perp_world_get_stats(s->world, &stats));
    assert_true(stats.contacts > 100);
    return all;
}

static void compare_ways(uint64_t seed, int32_t planar, int32_t accuracy)
{
    static char all[WAYS][MOST_BYTES];
    ledger l = {0, 0, 0};
    perp_step_result result;
    size_t size[WAYS];
    scene s[WAYS];
    int32_t calls[WAYS] = {0};

    for (int32_t w = 0; w < WAYS; w++) {
        open_way(&s[w], &l, &ways[w], &calls[w], planar, accuracy);
        populate(&s[w], seed, planar, BODIES);
    }
    for (int32_t k = 0; k < STEPS; k++)
        for (int32_t w = 0; w < WAYS; w++) {
            assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
            SCENE_OK(&s[w], perp_world_step(s[w].world, &result, 0.01));
            size[w] = write_all(&s[w], &result, all[w]);
            assert_int_equal(size[w], size[0]);
            assert_memory_equal(all[w], all[0], size[0]);
        }
    for (int32_t w = 0; w < WAYS; w++) {
        assert_true((ways[w].run != NULL) == (calls[w] > 0));
        scene_close(&s[w]);
    }
    assert_int_equal(l.alive, 0);
}

static void test_same_bits(void **state)
{
    (void)state;
    compare_ways(1, 0, PERP_ACCURACY_STANDARD);
    compare_ways(2, 0, PERP_ACCURACY_FAST);
    compare_ways(3, 1, PERP_ACCURACY_STANDARD);
    compare_ways(4, 0, PERP_ACCURACY_ACCURATE);
}

/* ---- one island ---- */

/* A pyramid of 276 boxes, thrown about a little, and a few balls on their own beside it: one island
 * that all threads sweep, and others. */
static void pile_up(scene *s, uint64_t seed, int32_t planar, int32_t bodies)
{
    scene_plane(s, s->ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    for (int32_t row = 0; row < bodies; row++)
        for (int32_t i = 0; i < bodies - row; i++) {
            perp_body_settings settings = scene_defaults();

            settings.position[0] = 1.02 * (i + 0.5 * row);
            settings.position[1] = draw(&seed, -0.05, 0.05);
            settings.position[2] = 0.5 + row;
            settings.velocity[0] = draw(&seed, -1.0, 1.0);
            scene_box(s, scene_add(s, &settings), 0.5, 0.5, planar ? 0.0 : 0.5, 0.4, 0.0);
        }
    for (int32_t i = 0; i < 3; i++) {
        perp_body_settings settings = scene_defaults();

        settings.position[0] = 3.0 * i;
        settings.position[1] = 9.0;
        settings.position[2] = 0.5;
        scene_sphere(s, scene_add(s, &settings), 0.5, 0.4, 0.0);
    }
}

#if defined(__SANITIZE_THREAD__) /* which makes a step ten times as long, and sees more in each */
enum { BASE = 23, PILE_STEPS = 3 };
#else
enum { BASE = 23, PILE_STEPS = 50 };
#endif

/* The callback is called for each colour of each pass: that tells a sweep in pieces from one that
 * is not. */
static void compare_piles(int32_t accuracy)
{
    static const way piles[] = {{1, NULL}, {2, NULL}, {3, NULL}, {8, NULL}, {3, run_backwards}};
    enum { PILES = sizeof piles / sizeof *piles };
    static char all[PILES][MOST_BYTES];
    ledger l = {0, 0, 0};
    int32_t calls[PILES] = {0};
    size_t size[PILES];
    scene s[PILES];

    for (int32_t w = 0; w < PILES; w++) {
        open_way(&s[w], &l, &piles[w], &calls[w], 0, accuracy);
        s[w].world->solve.coloured.shared_from = 0; /* by a caller's tasks too, small as it is */
        pile_up(&s[w], 9, 0, BASE);
    }
    for (int32_t k = 0; k < PILE_STEPS; k++)
        for (int32_t w = 0; w < PILES; w++) {
            perp_step_result result = fresh_step_result();

            SCENE_OK(&s[w], perp_world_step(s[w].world, &result, 0.01));
            size[w] = write_all(&s[w], &result, all[w]);
            assert_int_equal(size[w], size[0]);
            assert_memory_equal(all[w], all[0], size[0]);
        }
    assert_true(calls[PILES - 1] > 10 * PILE_STEPS);
    for (int32_t w = 0; w < PILES; w++)
        scene_close(&s[w]);
    assert_int_equal(l.alive, 0);
}

static void test_same_bits_of_a_pile(void **state)
{
    (void)state;
    compare_piles(PERP_ACCURACY_FAST);
    compare_piles(PERP_ACCURACY_STANDARD);
    compare_piles(PERP_ACCURACY_ACCURATE);
}

/* A step that runs out of memory at any allocation leaves the world as it was, whichever thread
 * asked for it, and the next one goes on as if nothing had been. */
static void run_out(void (*make)(scene *, uint64_t, int32_t, int32_t), int32_t planar,
                    int32_t bodies)
{
    static char first[MOST_BYTES], again[MOST_BYTES];
    const way three = {3, NULL};
    size_t size = 0;
    int32_t failed = 0;

    for (long which = 0; failed || which <= 1; which++) {
        ledger l = {0, 0, 0};
        perp_step_result result = fresh_step_result();
        int32_t calls = 0;
        scene s;

        open_way(&s, &l, &three, &calls, planar, PERP_ACCURACY_STANDARD);
        make(&s, 5, planar, bodies);
        l.fail_at = which > 0 ? l.calls + which : 0;
        failed = 0;
        for (int32_t k = 0; k < 2; k++) {
            const perp_status status = perp_world_step(s.world, &result, 0.01);

            if (status == PERP_OK)
                continue;
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_string_not_equal(perp_context_message(s.context), "");
            failed = 1;
            SCENE_OK(&s, perp_world_step(s.world, &result, 0.01));
        }
        l.fail_at = 0; /* beyond the steps' own: nobody else's */
        if (which == 0)
            size = write_all(&s, &result, first);
        assert_int_equal(write_all(&s, &result, again), size);
        assert_memory_equal(first, again, size);
        scene_close(&s);
        assert_int_equal(l.alive, 0);
    }
}

static void test_memory_may_run_out(void **state)
{
    (void)state;
    run_out(populate, 0, BODIES);
    run_out(populate, 1, BODIES);
    run_out(pile_up, 0, BASE);
}

/* Creation, likewise; and numbers of threads that are none. */
static void test_creation_may_fail(void **state)
{
    perp_status status = PERP_ERROR_MEMORY;

    (void)state;
    for (long which = 1; status == PERP_ERROR_MEMORY; which++) {
        ledger l = {0, 0, 0};
        perp_context_settings settings = fresh_context_settings();
        perp_world_settings world;
        perp_context *context;
        perp_world *made = NULL;

        settings.allocate = allocate;
        settings.release = release;
        settings.allocator_user = &l;
        assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
        assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
        world.threads = which % 2 ? -1 : 257;
        assert_int_equal(perp_world_create(context, &made, &world), PERP_ERROR_ARGUMENT);
        world.threads = 3;
        l.fail_at = l.calls + which;
        status = perp_world_create(context, &made, &world);
        if (status == PERP_OK)
            perp_world_destroy(made);
        perp_context_destroy(context);
        assert_int_equal(l.alive, 0);
    }
    assert_int_equal(status, PERP_OK);
}

/* A world that comes to rest and is taken awake: the same islands, in the same lanes. */
static void test_warm_steps_allocate_nothing(void **state)
{
    const way three = {3, NULL};
    ledger l = {0, 0, 0};
    int32_t calls = 0;
    long before;
    scene s;

    (void)state;
    open_way(&s, &l, &three, &calls, 0, PERP_ACCURACY_STANDARD);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    for (int32_t i = 0; i < 3 * 60; i++) {
        perp_body_settings settings = scene_settings();

        settings.position[0] = 2.0 * (i / 3);
        settings.position[2] = 0.5 + i % 3;
        settings.velocity[0] = 0.5;
        scene_box(&s, scene_add(&s, &settings), 0.5, 0.5, 0.5, 0.01, 0.0);
    }
    /* until friction stops the boxes: then every method has been called */
    scene_steps(&s, 80, 0.01);
    before = l.calls;
    scene_steps(&s, 20, 0.01);
    assert_int_equal(l.calls, before);
    scene_close(&s);
}

/* After a fork the child has none of the threads; it may destroy. */
static void test_child_may_destroy(void **state)
{
    const way three = {3, NULL};
    ledger l = {0, 0, 0};
    int32_t calls = 0, ended = -1;
    pid_t child;
    scene s;

    (void)state;
    open_way(&s, &l, &three, &calls, 0, PERP_ACCURACY_STANDARD);
    child = fork();
    if (child == 0) {
        scene_close(&s);
        _exit(l.alive == 0 ? 0 : 1);
    }
    assert_true(child > 0);
    assert_int_equal(waitpid(child, &ended, 0), child);
    assert_true(WIFEXITED(ended) && WEXITSTATUS(ended) == 0);
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_same_bits_of_a_pile),
        cmocka_unit_test(test_memory_may_run_out),
        cmocka_unit_test(test_creation_may_fail),
        cmocka_unit_test(test_warm_steps_allocate_nothing),
        cmocka_unit_test(test_child_may_destroy),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
