/* Memory: every allocation may fail, and leaves the world as it was and usable; a step of a size
 * that was seen before allocates nothing. */
#include <stdio.h>

#include "suite.h"

#include "memory.h"
#include "world/scene.h"

#define STEPS 6
#define LATE 3 /* the step before which a crowd comes */
#define CROWD 5

/* Repeats a call once if it reports that memory ran out; it must then succeed. */
#define RETRY(s, call)                                                       \
    do {                                                                     \
        perp_status retry_status = (call);                                   \
        if (retry_status == PERP_ERROR_MEMORY) {                             \
            assert_string_not_equal(perp_context_message((s)->context), ""); \
            retry_status = (call);                                           \
        }                                                                    \
        assert_int_equal(retry_status, PERP_OK);                             \
    } while (0)

static void open_counted(scene *s, memory *m, double error)
{
    const perp_context_settings settings = memory_settings(m);
    perp_world_settings world;

    memset(s, 0, sizeof *s);
    if (perp_context_create(&s->context, &settings) != PERP_OK)
        assert_int_equal(perp_context_create(&s->context, &settings), PERP_OK);
    assert_int_equal(perp_world_settings_init(&world, sizeof world, 0), PERP_OK);
    world.error = error;
    RETRY(s, perp_world_create(s->context, &s->world, &world));
    s->ground = perp_world_ground(s->world);
}

/* Boxes that fall on each other, hit, stick and are pushed apart: every phase of a step has work.
 */
static void populate(scene *s, perp_body *boxes, int count)
{
    const double half[3] = {0.5, 0.5, 0.25}, up[3] = {0.0, 0.0, 1.0};
    perp_shape_settings material = scene_material(0.4, 0.25);
    int i;

    RETRY(s, perp_world_add_plane(s->world, NULL, s->ground, up, 0.0, &material));
    for (i = 0; i < count; i++) {
        perp_body_settings settings = scene_settings();

        settings.position[0] = 0.1 * i;
        settings.position[2] = 0.2 + 0.55 * i; /* the lowest starts in the ground */
        settings.velocity[2] = -1.0;
        RETRY(s, perp_world_add_body(s->world, &boxes[i], &settings));
        RETRY(s, perp_world_add_box(s->world, NULL, boxes[i], half, &material));
    }
}

/* More boxes, in each other and in the ground: every array must grow while there are contacts to
 * keep. */
static void crowd(scene *s)
{
    const double half[3] = {0.5, 0.5, 0.25};
    perp_shape_settings material = scene_material(0.4, 0.25);
    int i;

    for (i = 0; i < CROWD; i++) {
        perp_body_settings settings = scene_settings();
        perp_body box;

        settings.position[0] = 20.0 + 0.9 * i;
        settings.position[2] = 0.2;
        RETRY(s, perp_world_add_body(s->world, &box, &settings));
        RETRY(s, perp_world_add_box(s->world, NULL, box, half, &material));
    }
}

/* A chain, beside it. */
static void hang_chain(scene *s)
{
    perp_joint_settings ball = fresh_joint_settings();
    perp_body last = s->ground;
    int i;

    for (i = 0; i < 2 * CROWD; i++) {
        perp_body_settings settings = scene_settings();
        perp_joint joint;
        perp_body link;

        ball.anchor[0] = settings.position[0] = 40.0 + i;
        RETRY(s, perp_world_add_body(s->world, &link, &settings));
        RETRY(s, perp_world_add_joint(s->world, &joint, last, link, &ball));
        last = link;
    }
}

static void check_same(scene *s, perp_body body, const perp_body_state *expected)
{
    perp_body_state now = scene_state(s, body);

    assert_memory_equal(&now, expected, sizeof now);
}

/* The contact, or zeros if there is none. */
static perp_world_contact contact_or_zero(scene *s, int32_t index)
{
    perp_world_contact contact;

    memset(&contact, 0, sizeof contact);
    if (index >= 0) {
        contact.struct_size = sizeof contact;
        RETRY(s, perp_world_get_contact(s->world, &contact, index));
    }
    return contact;
}

/* The scenario, with failure number k; returns whether any allocation failed. states: of each box
 * after each step; written if k is 0, else compared. error: of the settings. */
static int run(int k, double error, perp_body_state states[STEPS][3])
{
    memory m = {.fails_at = k};
    perp_body boxes[3];
    scene s;
    int i, j;

    open_counted(&s, &m, error);
    populate(&s, boxes, 3);
    for (i = 0; i < STEPS; i++) {
        perp_body_state before = scene_state(&s, boxes[0]);
        int32_t contacts = perp_world_contact_count(s.world);
        perp_world_contact last = contact_or_zero(&s, contacts - 1);
        perp_world_contact now;
        perp_status status;

        if (i == LATE) {
            crowd(&s);
            hang_chain(&s);
        }
        status = perp_world_step(s.world, NULL, 0.05);
        if (status == PERP_ERROR_MEMORY) {
            check_same(&s, boxes[0], &before);
            if (error == 0.0) {
                assert_int_equal(perp_world_contact_count(s.world), contacts);
                now = contact_or_zero(&s, contacts - 1);
                assert_memory_equal(&now, &last, sizeof now);
            }
            status = perp_world_step(s.world, NULL, 0.05);
        }
        assert_int_equal(status, PERP_OK);
        for (j = 0; j < 3; j++) {
            if (k == 0)
                states[i][j] = scene_state(&s, boxes[j]);
            else
                check_same(&s, boxes[j], &states[i][j]);
        }
    }
    scene_close(&s);
    assert_int_equal(m.live, 0);
    return m.calls >= m.fails_at;
}

static void test_every_allocation_may_fail(void **state)
{
    static perp_body_state states[STEPS][3];
    double error;
    int k;

    (void)state;
    for (error = 0.0; error < 1.0; error += 0.5) {
        run(0, error, states);
        for (k = 1; run(k, error, states); k++)
            ;
        assert_true(k > 20); /* there were some to fail */
    }
}

/* Steps at rest see the same sizes again and again: the last of the bounces dies out first, by
 * an eighth a step until squares of velocities are 0, and what falls asleep is noted once. */
static void test_steady_steps_allocate_nothing(void **state)
{
    memory m = {0};
    perp_body boxes[3];
    int calls;
    scene s;
    int i;

    (void)state;
    open_counted(&s, &m, 0.0);
    populate(&s, boxes, 3);
    for (i = 0; i < 400; i++)
        SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
    calls = m.calls;
    for (i = 0; i < 100; i++)
        SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
    assert_int_equal(m.calls, calls);
    scene_close(&s);
}

/* The second of two equal steps from one state allocates nothing, whatever the first did. */
static void test_second_step_of_a_size(void **state)
{
    memory m = {0};
    perp_body boxes[3];
    char blob[8192];
    size_t size;
    int calls;
    scene s;

    (void)state;
    open_counted(&s, &m, 0.0);
    populate(&s, boxes, 3);
    SCENE_OK(&s, perp_world_snapshot_size(s.world, &size));
    assert_true(size <= sizeof blob);
    SCENE_OK(&s, perp_world_snapshot_save(s.world, blob, size));
    SCENE_OK(&s, perp_world_step(s.world, NULL, 0.05));
    SCENE_OK(&s, perp_world_snapshot_restore(s.world, blob, size));
    calls = m.calls;
    SCENE_OK(&s, perp_world_step(s.world, NULL, 0.05));
    assert_int_equal(m.calls, calls);
    scene_close(&s);
}

/* Stacks that slide on a floor, of three boxes and of six: once the small one is lifted away, the
 * large one is the first to be swept. It was there before, so nothing is allocated. */
static void test_islands_change_places(void **state)
{
    const double half[3] = {0.5, 0.5, 0.25}, up[3] = {0.0, 0.0, 1.0};
    perp_shape_settings material = scene_material(0.3, 0.0);
    enum { SMALL = 3, ALL = 9 };
    perp_body boxes[ALL];
    memory m = {0};
    int calls;
    scene s;

    (void)state;
    open_counted(&s, &m, 0.0);
    SCENE_OK(&s, perp_world_add_plane(s.world, NULL, s.ground, up, 0.0, &material));
    for (int i = 0; i < ALL; i++) {
        perp_body_settings settings = scene_settings();

        settings.position[0] = i < SMALL ? 0.0 : 10.0;
        settings.position[2] = 0.25 + 0.5 * (i < SMALL ? i : i - SMALL);
        settings.velocity[0] = 8.0;
        SCENE_OK(&s, perp_world_add_body(s.world, &boxes[i], &settings));
        SCENE_OK(&s, perp_world_add_box(s.world, NULL, boxes[i], half, &material));
    }
    for (int i = 0; i < 20; i++)
        SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
    for (int i = 0; i < SMALL; i++) {
        perp_body_state away = scene_state(&s, boxes[i]);

        away.position[2] += 3.0 + i;
        SCENE_OK(&s, perp_world_set_body(s.world, &away, boxes[i]));
    }
    calls = m.calls;
    for (int i = 0; i < 10; i++)
        SCENE_OK(&s, perp_world_step(s.world, NULL, 0.01));
    assert_int_equal(m.calls, calls);
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_allocation_may_fail),
        cmocka_unit_test(test_steady_steps_allocate_nothing),
        cmocka_unit_test(test_second_step_of_a_size),
        cmocka_unit_test(test_islands_change_places),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
