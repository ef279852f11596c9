/* The tree of boxes against the double loop over all of them, and the boxes that go into it. */
#include <stdlib.h>

#include "suite.h"

#include "collide_scene.h"
#include "world/collide/tree.h"

enum { MOST = 300 };

/* Places on a grid give many ties and many boxes that just touch; some are flat, some huge. */
static perp__bounds random_bounds(uint64_t *state, int grid)
{
    perp__bounds box;
    double most = scene_bits(state) % 16 == 0 ? 100.0 : 3.0;
    for (int k = 0; k < 3; k++) {
        double low = scene_uniform(state, 0.0, 8.0), size = scene_uniform(state, 0.0, most);
        box.low[k] = grid ? floor(low) : low;
        box.high[k] = grid ? floor(low) + floor(size) : low + size;
    }
    return box;
}

/* Heights and boxes of all nodes below; returns the leaves. Balanced as an AVL tree. */
static int32_t check_below(const perp__tree *tree, int32_t node)
{
    const perp__tree_node *at = &tree->nodes[node];
    if (at->height == 0)
        return 1;
    const perp__tree_node *left = &tree->nodes[at->child[0]], *right = &tree->nodes[at->child[1]];
    int higher = left->height > right->height ? left->height : right->height;
    assert_int_equal(at->height, higher + 1);
    assert_true(abs(left->height - right->height) <= 1);
    assert_int_equal(left->parent, node);
    assert_int_equal(right->parent, node);
    for (int k = 0; k < 3; k++) {
        assert_true(at->bounds.low[k] == fmin(left->bounds.low[k], right->bounds.low[k]));
        assert_true(at->bounds.high[k] == fmax(left->bounds.high[k], right->bounds.high[k]));
    }
    return check_below(tree, at->child[0]) + check_below(tree, at->child[1]);
}

static void check_walk(const perp__tree *tree, const perp__bounds *boxes, const int32_t *leaves,
                       const perp__bounds *at)
{
    perp__tree_query walk;
    int found[MOST] = {0};
    int32_t item;
    perp__tree_start(tree, &walk);
    while ((item = perp__tree_next(tree, &walk, at)) >= 0)
        found[item]++;
    for (int32_t i = 0; i < MOST; i++)
        assert_int_equal(found[i], leaves[i] >= 0 && perp__bounds_overlap(&boxes[i], at));
}

/* Leaves come, go and move at random; walks find what the double loop finds. */
static void walks_find_what_overlaps(void **context)
{
    (void)context;
    static perp__tree_node nodes[2 * MOST];
    static perp__bounds boxes[MOST];
    int32_t leaves[MOST];
    uint64_t state = 21;
    for (int grid = 0; grid < 2; grid++) {
        perp__tree tree;
        int32_t alive = 0;
        perp__tree_init(&tree);
        tree.nodes = nodes;
        for (int32_t i = 0; i < MOST; i++)
            leaves[i] = -1;
        for (int round = 0; round < 20000; round++) {
            int32_t i = (int32_t)(scene_bits(&state) % MOST);
            if (leaves[i] >= 0) {
                perp__tree_remove(&tree, leaves[i]);
                leaves[i] = -1;
                alive--;
            }
            if (scene_bits(&state) % 4 != 0 || round < MOST) {
                boxes[i] = random_bounds(&state, grid);
                leaves[i] = perp__tree_insert(&tree, &boxes[i], i);
                alive++;
            }
            assert_true(tree.used <= 2 * MOST - 1);
            if (round % 100 == 0 && alive > 0) {
                perp__bounds at = random_bounds(&state, grid);
                assert_int_equal(check_below(&tree, tree.root), alive);
                check_walk(&tree, boxes, leaves, &at);
            }
        }
    }
}

/* Twenty thousand boxes in a row, in order, and in one column: a tree that leans would not come
 * back. */
static void many_in_a_row(void **context)
{
    (void)context;
    enum { MANY = 20000 };
    static perp__tree_node nodes[2 * MANY];
    for (int axis = 0; axis < 3; axis += 2) {
        perp__tree tree;
        perp__tree_init(&tree);
        tree.nodes = nodes;
        for (int i = 0; i < MANY; i++) {
            perp__bounds box = {{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};
            box.low[axis] = i;
            box.high[axis] = i + 1.0;
            perp__tree_insert(&tree, &box, i);
        }
        assert_int_equal(check_below(&tree, tree.root), MANY);
        assert_true(tree.nodes[tree.root].height <= 21); /* 1.44 log2(20000) */
        for (int i = 0; i < MANY; i++) {
            perp__bounds box = {{0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}};
            perp__tree_query walk;
            box.low[axis] += i;
            box.high[axis] += i;
            perp__tree_start(&tree, &walk);
            assert_int_equal(perp__tree_next(&tree, &walk, &box), i);
            assert_int_equal(perp__tree_next(&tree, &walk, &box), -1);
        }
    }
}

static void extents_of_shapes(void **context)
{
    (void)context;
    perp__geometry box = scene_box(1.0, 2.0, 3.0), ball = scene_sphere(0.5);
    perp__geometry plane = scene_plane(0.0, 0.0, 1.0, 0.0);
    perp__placed at = scene_place(&ball, 10.0, 20.0, 30.0);
    perp__bounds extent;
    perp__extent_of(&at, 0.25, &extent);
    for (int k = 0; k < 3; k++) {
        /* never narrower, wider by roundings only */
        assert_true(extent.low[k] <= at.position[k] - 0.75);
        assert_true(extent.low[k] > at.position[k] - 0.75 - 1e-13);
        assert_true(extent.high[k] >= at.position[k] + 0.75);
        assert_true(extent.high[k] < at.position[k] + 0.75 + 1e-13);
    }

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
        perp__bounds extents[2];
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
            perp__extent_of(&placed[side], 0.5 * margin, &extents[side]);
        }
        if (perp__collide(&placed[0], &placed[1], 0, margin, points) == 0)
            continue;
        touching++;
        assert_true(perp__bounds_overlap(&extents[0], &extents[1]));
    }
    assert_true(touching > 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(walks_find_what_overlaps),
        cmocka_unit_test(many_in_a_row),
        cmocka_unit_test(extents_of_shapes),
        cmocka_unit_test(contacts_lie_within_extents),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
