/* Broad phase against the double loop over all pairs, and the extents that go into it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "collide_scene.h"

enum { MOST = 200, MOST_PAIRS = MOST * (MOST - 1) / 2 };

static int overlap(const perp__extent *a, const perp__extent *b)
{
    int together = a->group != b->group;
    for (int k = 0; k < 3; k++)
        together = together && a->low[k] <= b->high[k] && b->low[k] <= a->high[k];
    return together;
}

/* Pairs in the order of (first, second), for extents in the order of their items. */
static int32_t double_loop(const perp__extent *extents, int32_t count, perp__pair *pairs)
{
    int32_t found = 0;
    for (int32_t i = 0; i < count; i++)
        for (int32_t j = i + 1; j < count; j++)
            if (overlap(&extents[i], &extents[j]))
                pairs[found++] = (perp__pair){extents[i].item, extents[j].item};
    return found;
}

static void shuffle(uint64_t *state, perp__extent *extents, int32_t count)
{
    for (int32_t i = count - 1; i > 0; i--) {
        int32_t j = (int32_t)(scene_bits(state) % (uint64_t)(i + 1));
        perp__extent held = extents[i];
        extents[i] = extents[j];
        extents[j] = held;
    }
}

/* Places on a grid give many ties and many extents that just touch; some are infinite. */
static void random_extents(uint64_t *state, perp__extent *extents, int32_t count, int grid)
{
    for (int32_t i = 0; i < count; i++) {
        perp__extent *at = &extents[i];
        int infinite = scene_bits(state) % 16 == 0;
        for (int k = 0; k < 3; k++) {
            double low = scene_uniform(state, 0.0, 8.0), size = scene_uniform(state, 0.0, 3.0);
            at->low[k] = infinite ? -INFINITY : grid ? floor(low) : low;
            at->high[k] = infinite ? INFINITY : grid ? floor(low) + floor(size) : low + size;
        }
        at->item = 3 * i + 1;
        at->group = (int32_t)(scene_bits(state) % (uint64_t)(count / 3 + 1));
    }
}

static void pairs_are_those_of_the_double_loop(void **context)
{
    (void)context;
    static perp__extent extents[MOST];
    static perp__pair expected[MOST_PAIRS], pairs[MOST_PAIRS];
    uint64_t state = 21;
    for (int round = 0; round < 400; round++) {
        int32_t count = (int32_t)(scene_bits(&state) % (MOST + 1));
        random_extents(&state, extents, count, round % 2);
        int32_t total = double_loop(extents, count, expected);
        for (int again = 0; again < 2; again++) {
            shuffle(&state, extents, count);
            assert_int_equal(perp__broad_phase(extents, count, pairs, MOST_PAIRS), total);
            for (int32_t i = 1; i < count; i++) {
                const perp__extent *last = &extents[i - 1], *here = &extents[i];
                assert_true(last->low[0] < here->low[0] ||
                            (last->low[0] == here->low[0] && last->item < here->item));
            }
            for (int32_t i = 0; i < total; i++) {
                assert_int_equal(pairs[i].first, expected[i].first);
                assert_int_equal(pairs[i].second, expected[i].second);
            }
        }
    }
}

/* Too little room: the number of pairs is right, what is written are pairs, nothing lies beyond. */
static void little_room(void **context)
{
    (void)context;
    static perp__extent extents[MOST];
    static perp__pair pairs[41], all[MOST_PAIRS];
    uint64_t state = 22;
    random_extents(&state, extents, MOST, 1);
    int32_t total = double_loop(extents, MOST, all);
    assert_true(total > 40);
    for (int32_t capacity = 0; capacity <= 40; capacity++) {
        pairs[capacity] = (perp__pair){-7, -7};
        assert_int_equal(perp__broad_phase(extents, MOST, pairs, capacity), total);
        assert_int_equal(pairs[capacity].first, -7);
        for (int32_t i = 0, j = 0; i < capacity; i++) {
            while (j < total &&
                   (all[j].first != pairs[i].first || all[j].second != pairs[i].second))
                j++;
            assert_true(j < total);
        }
    }
    assert_int_equal(perp__broad_phase(extents, 0, NULL, 0), 0);
    assert_int_equal(perp__broad_phase(extents, 1, NULL, 0), 0);
    assert_int_equal(perp__broad_phase(extents, MOST, NULL, 0), total);
}

/* Twenty thousand extents in a row, worst order first: a quadratic sort would not come back. */
static void many_extents(void **context)
{
    (void)context;
    enum { MANY = 20000 };
    static perp__extent extents[MANY];
    static perp__pair pairs[MANY];
    for (int32_t i = 0; i < MANY; i++) {
        extents[i] = (perp__extent){{-i, 0.0, 0.0}, {-i + 1.0, 1.0, 1.0}, i, i};
    }
    assert_int_equal(perp__broad_phase(extents, MANY, pairs, MANY), MANY - 1);
    for (int32_t i = 0; i + 1 < MANY; i++) {
        assert_int_equal(pairs[i].first, i);
        assert_int_equal(pairs[i].second, i + 1);
    }
}

static void extents_of_shapes(void **context)
{
    (void)context;
    perp__geometry box = scene_box(1.0, 2.0, 3.0), ball = scene_sphere(0.5);
    perp__geometry plane = scene_plane(0.0, 0.0, 1.0, 0.0);
    perp__placed at = scene_place(&ball, 10.0, 20.0, 30.0);
    perp__extent extent = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 7, 8};
    perp__extent_of(&at, 0.25, &extent);
    for (int k = 0; k < 3; k++) {
        /* never narrower, wider by roundings only */
        assert_true(extent.low[k] <= at.position[k] - 0.75);
        assert_true(extent.low[k] > at.position[k] - 0.75 - 1e-13);
        assert_true(extent.high[k] >= at.position[k] + 0.75);
        assert_true(extent.high[k] < at.position[k] + 0.75 + 1e-13);
    }
    assert_int_equal(extent.item, 7);
    assert_int_equal(extent.group, 8);

    at.geometry = &plane;
    perp__extent_of(&at, 0.25, &extent);
    for (int k = 0; k < 3; k++)
        assert_true(extent.low[k] == -INFINITY && extent.high[k] == INFINITY);

    /* a turned box: the extent is that of its corners */
    uint64_t state = 23;
    for (int i = 0; i < 200; i++) {
        double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
        at.geometry = &box;
        scene_random_rotation(&state, at.rotation);
        perp__extent_of(&at, 0.0, &extent);
        for (int number = 0; number < 8; number++) {
            double corner[3];
            scene_corner(&at, number, corner);
            for (int k = 0; k < 3; k++) {
                low[k] = fmin(low[k], corner[k]);
                high[k] = fmax(high[k], corner[k]);
            }
        }
        for (int k = 0; k < 3; k++) {
            assert_true(extent.low[k] <= low[k] && extent.low[k] > low[k] - 1e-13);
            assert_true(extent.high[k] >= high[k] && extent.high[k] < high[k] + 1e-13);
        }
    }
}

/* Half of the margin on each side is enough: whatever collides, the broad phase finds. */
static void contacts_lie_within_extents(void **context)
{
    (void)context;
    uint64_t state = 24;
    int touching = 0;
    for (int i = 0; i < 4000; i++) {
        perp__geometry shapes[2];
        perp__placed placed[2];
        perp__extent extents[2];
        perp__point points[PERP__MAX_POINTS];
        double margin = scene_uniform(&state, 0.0, 1.0);
        for (int side = 0; side < 2; side++) {
            shapes[side] = scene_bits(&state) % 2 ? scene_sphere(scene_uniform(&state, 0.0, 1.0))
                                                  : scene_box(scene_uniform(&state, 0.1, 1.0),
                                                              scene_uniform(&state, 0.1, 1.0),
                                                              scene_uniform(&state, 0.1, 1.0));
            placed[side] = scene_place(&shapes[side], scene_uniform(&state, -2.0, 2.0),
                                       scene_uniform(&state, -2.0, 2.0), 0.0);
            scene_random_rotation(&state, placed[side].rotation);
            extents[side].item = extents[side].group = side;
            perp__extent_of(&placed[side], 0.5 * margin, &extents[side]);
        }
        if (perp__collide(&placed[0], &placed[1], 0, margin, points) == 0)
            continue;
        touching++;
        assert_int_equal(perp__broad_phase(extents, 2, NULL, 0), 1);
    }
    assert_true(touching > 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pairs_are_those_of_the_double_loop),
        cmocka_unit_test(little_room),
        cmocka_unit_test(many_extents),
        cmocka_unit_test(extents_of_shapes),
        cmocka_unit_test(contacts_lie_within_extents),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
