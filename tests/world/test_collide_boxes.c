/* Contact points of boxes with half-spaces and boxes: configurations with closed forms. */
#include "suite.h"

#include "collide_scene.h"

/* some tens of roundings of numbers of order 1 */
static const double rounding = 1e-14;

/* The points are, in any order, one at each position, with this normal and gap. */
static void check_set(const perp__point *points, int32_t count, int32_t expected,
                      double positions[][3], const double *normal, double gap, double tolerance)
{
    assert_int_equal(count, expected);
    for (int32_t e = 0; e < expected; e++) {
        int32_t found = -1;
        for (int32_t q = 0; q < count; q++) {
            double off = 0.0;
            for (int k = 0; k < 3; k++)
                off = fmax(off, fabs(points[q].position[k] - positions[e][k]));
            if (off <= tolerance)
                found = q;
        }
        assert_true(found >= 0);
        assert_true(fabs(points[found].gap - gap) <= tolerance);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(points[found].normal[k] - normal[k]) <= tolerance);
        for (int32_t q = 0; q < found; q++)
            assert_int_not_equal(points[q].feature, points[found].feature);
    }
}

/* Exact data, lying flat on each of the six sides: four gaps, all 0 to the last bit. The second box
 * and its ground have coordinates whose sums are exact. */
static void box_flat_on_a_plane(void **context)
{
    (void)context;
    perp__geometry boxes[2] = {scene_box(0.1, 0.7, 0.3), scene_box(0.125, 0.75, 0.375)};
    for (int side = 0; side < 12; side++) {
        const perp__geometry *box = &boxes[side / 6];
        double offset = side < 6 ? 0.0 : 0.25, height = side < 6 ? 0.0 : -3.0;
        perp__geometry ground = scene_plane(0.0, 0.0, 1.0, offset);
        int up = side / 2 % 3, u = (up + 1) % 3, v = (up + 2) % 3;
        double sign = side % 2 ? -1.0 : 1.0;
        perp__placed a = scene_place(&ground, 0.3, 0.1, height);
        perp__placed b = scene_place(box, 0.0, 0.0, height + offset + box->half_extents[up]);
        perp__point points[PERP__MAX_POINTS];
        memset(b.rotation, 0, sizeof b.rotation);
        b.rotation[u] = sign;
        b.rotation[3 + v] = 1.0;
        b.rotation[6 + up] = sign;

        double x = box->half_extents[u], y = box->half_extents[v], z = height + offset;
        double corners[4][3] = {{x, y, z}, {-x, y, z}, {x, -y, z}, {-x, -y, z}};
        check_set(points, perp__collide(&a, &b, 0, 0.0, points), 4, corners,
                  (double[3]){0.0, 0.0, 1.0}, 0.0, 0.0);
        assert_int_equal(perp__collide(&a, &b, 0, 2.0, points), 8);
    }
}

/* A rectangle on a line, and the same turned on its corner. */
static void rectangle_on_a_line(void **context)
{
    (void)context;
    perp__geometry ground = scene_plane(0.0, 1.0, 0.0, 0.0), box = scene_box(0.3, 0.4, 0.0);
    perp__placed a = scene_place(&ground, 0.0, 0.0, 0.0), b = scene_place(&box, 0.0, 0.4, 0.0);
    perp__point points[PERP__MAX_POINTS];
    double corners[2][3] = {{0.3, 0.0, 0.0}, {-0.3, 0.0, 0.0}};
    check_set(points, perp__collide(&a, &b, 1, 0.0, points), 2, corners, (double[3]){0.0, 1.0, 0.0},
              0.0, 0.0);

    /* the diagonal of a 3-4-5 rectangle upright: corners at heights 0, 0.36, 0.64, 1 */
    memcpy(b.rotation, (double[9]){0.8, 0.6, 0.0, -0.6, 0.8, 0.0, 0.0, 0.0, 1.0},
           sizeof b.rotation);
    b.position[1] = 0.75;
    assert_int_equal(perp__collide(&b, &a, 1, 2.0, points), 4);
    double gaps[4] = {0.75 + 0.18 - 0.32, 0.75 - 0.18 - 0.32, 0.75 + 0.18 + 0.32,
                      0.75 - 0.18 + 0.32};
    for (int32_t q = 0; q < 4; q++) {
        assert_int_equal(points[q].feature, q);
        assert_true(fabs(points[q].gap - gaps[q]) < rounding);
        assert_true(fabs(points[q].position[1] - 0.5 * gaps[q]) < rounding);
        assert_true(points[q].normal[1] == -1.0);
    }
}

/* Two equal boxes exactly stacked, along each axis: four points, gaps 0 to the last bit. */
static void equal_boxes_stacked(void **context)
{
    (void)context;
    perp__geometry box = scene_box(0.1, 0.7, 0.3);
    for (int axis = 0; axis < 3; axis++)
        for (int sign = -1; sign <= 1; sign += 2) {
            perp__placed a = scene_place(&box, 0.0, 0.0, 0.0), b = a;
            perp__point points[PERP__MAX_POINTS];
            double normal[3] = {0.0, 0.0, 0.0}, corners[4][3];
            normal[axis] = sign;
            b.position[axis] = sign * 2.0 * box.half_extents[axis];
            for (int c = 0; c < 4; c++) {
                int u = (axis + 1) % 3, v = (axis + 2) % 3;
                corners[c][axis] = 0.5 * b.position[axis];
                corners[c][u] = (c & 1 ? 1.0 : -1.0) * box.half_extents[u];
                corners[c][v] = (c & 2 ? 1.0 : -1.0) * box.half_extents[v];
            }
            check_set(points, perp__collide(&a, &b, 0, 0.0, points), 4, corners, normal, 0.0, 0.0);
        }
}

/* A brick half over another, one beside the next, and a small one on a large one. */
static void bricks(void **context)
{
    (void)context;
    perp__geometry brick = scene_box(1.0, 0.5, 0.25), crumb = scene_box(0.25, 0.125, 0.5);
    perp__placed a = scene_place(&brick, 0.0, 0.0, 0.0), b = scene_place(&brick, 1.25, 0.0, 0.5);
    perp__placed c = scene_place(&crumb, -0.5, 0.25, 0.875);
    perp__point points[PERP__MAX_POINTS];
    double over[4][3] = {
        {0.25, 0.5, 0.25}, {0.25, -0.5, 0.25}, {1.0, 0.5, 0.25}, {1.0, -0.5, 0.25}};
    check_set(points, perp__collide(&a, &b, 0, 0.0, points), 4, over, (double[3]){0.0, 0.0, 1.0},
              0.0, 0.0);

    double on[4][3] = {{-0.25, 0.375, 0.3125},
                       {-0.25, 0.125, 0.3125},
                       {-0.75, 0.375, 0.3125},
                       {-0.75, 0.125, 0.3125}};
    check_set(points, perp__collide(&a, &c, 0, 0.125, points), 4, on, (double[3]){0.0, 0.0, 1.0},
              0.125, 0.0);
    check_set(points, perp__collide(&c, &a, 0, 0.125, points), 4, on, (double[3]){0.0, 0.0, -1.0},
              0.125, 0.0);
    assert_int_equal(perp__collide(&a, &c, 0, 0.1249, points), 0);
}

/* A cube turned by 45 degrees on an equal one: the faces meet in a regular octagon. */
static void octagon(void **context)
{
    (void)context;
    perp__geometry cube = scene_box(1.0, 1.0, 1.0);
    perp__placed a = scene_place(&cube, 0.0, 0.0, 0.0), b = scene_place(&cube, 0.0, 0.0, 2.0);
    perp__point points[PERP__MAX_POINTS];
    double corners[8][3], side = sqrt(2.0) - 1.0;
    scene_planar_rotation(b.rotation, atan(1.0));
    for (int c = 0; c < 8; c++) {
        double x = c & 1 ? 1.0 : -1.0, y = c & 2 ? side : -side;
        corners[c][0] = c & 4 ? x : y;
        corners[c][1] = c & 4 ? y : x;
        corners[c][2] = 1.0;
    }
    check_set(points, perp__collide(&a, &b, 0, rounding, points), 8, corners,
              (double[3]){0.0, 0.0, 1.0}, 0.0, rounding);
}

/* A cube on its corner, and one on its edge, above a larger cube. */
static void corner_and_edge_down(void **context)
{
    (void)context;
    perp__geometry table = scene_box(4.0, 5.0, 1.0), cube = scene_box(0.5, 0.5, 0.5);
    perp__placed a = scene_place(&table, 0.0, 0.0, 0.0), b = scene_place(&cube, 1.0, 2.0, 2.0);
    perp__point points[PERP__MAX_POINTS];
    double r2 = sqrt(2.0), r3 = sqrt(3.0), r6 = sqrt(6.0);
    /* the diagonal (1, 1, 1) of the cube upright */
    memcpy(b.rotation,
           (double[9]){1.0 / r2, -1.0 / r2, 0.0, 1.0 / r6, 1.0 / r6, -2.0 / r6, 1.0 / r3, 1.0 / r3,
                       1.0 / r3},
           sizeof b.rotation);
    double gap = 1.0 - 0.5 * r3;
    double corner[1][3] = {{1.0, 2.0, 1.0 + 0.5 * gap}};
    check_set(points, perp__collide(&a, &b, 0, gap + rounding, points), 1, corner,
              (double[3]){0.0, 0.0, 1.0}, gap, rounding);

    memcpy(b.rotation,
           (double[9]){1.0 / r2, 0.0, 1.0 / r2, 0.0, 1.0, 0.0, -1.0 / r2, 0.0, 1.0 / r2},
           sizeof b.rotation);
    gap = 1.0 - 0.5 * r2;
    double edge[2][3] = {{1.0, 1.5, 1.0 + 0.5 * gap}, {1.0, 2.5, 1.0 + 0.5 * gap}};
    check_set(points, perp__collide(&a, &b, 0, gap + rounding, points), 2, edge,
              (double[3]){0.0, 0.0, 1.0}, gap, rounding);
}

/* Two ridges across each other, apart and overlapping; and offset along the edges. */
static void crossing_edges(void **context)
{
    (void)context;
    double s = sqrt(0.5);
    perp__geometry beam = scene_box(2.0, 0.5, 0.5), other = scene_box(0.5, 3.0, 0.5);
    perp__placed a = scene_place(&beam, 0.5, 0.25, 0.0), b = scene_place(&other, 0.0, 0.0, 0.0);
    perp__point points[PERP__MAX_POINTS];
    memcpy(a.rotation, (double[9]){1.0, 0.0, 0.0, 0.0, s, -s, 0.0, s, s}, sizeof a.rotation);
    memcpy(b.rotation, (double[9]){s, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, s}, sizeof b.rotation);
    for (int i = -2; i <= 2; i++) {
        double gap = 0.05 * i;
        b.position[2] = sqrt(2.0) + gap;
        double at[1][3] = {{0.0, 0.25, s + 0.5 * gap}};
        check_set(points, perp__collide(&a, &b, 0, gap + rounding, points), 1, at,
                  (double[3]){0.0, 0.0, 1.0}, gap, rounding);
        check_set(points, perp__collide(&b, &a, 0, gap + rounding, points), 1, at,
                  (double[3]){0.0, 0.0, -1.0}, gap, rounding);
    }
}

/* Corner beside corner, corner beside an edge, parallel edges: the closest points. */
static void corners_and_edges_apart(void **context)
{
    (void)context;
    perp__geometry cube = scene_box(1.0, 1.0, 1.0), long_box = scene_box(1.0, 4.0, 1.0);
    perp__placed a = scene_place(&cube, 0.0, 0.0, 0.0), b = scene_place(&cube, 2.25, 2.5, -2.5);
    perp__point points[PERP__MAX_POINTS];
    double corner[1][3] = {{1.125, 1.25, -1.25}};
    check_set(points, perp__collide(&a, &b, 0, 0.75, points), 1, corner,
              (double[3]){1.0 / 3.0, 2.0 / 3.0, -2.0 / 3.0}, 0.75, rounding);
    assert_int_equal(perp__collide(&a, &b, 0, 0.7499, points), 0);

    /* edges along y that overlap in -1 .. 1: their middle */
    b = scene_place(&long_box, 2.375, -1.0, 2.5);
    double middle[1][3] = {{1.1875, 0.0, 1.25}};
    check_set(points, perp__collide(&a, &b, 0, 0.625, points), 1, middle,
              (double[3]){0.6, 0.0, 0.8}, 0.625, rounding);
}

/* Stacked boxes that tilt a little, in any direction and with any overhang, keep the whole support
 * polygon: at least three points, no farther than the tilt lets them be. */
static void tilted_stack_keeps_its_support(void **context)
{
    (void)context;
    perp__geometry box = scene_box(1.0, 0.8, 0.5);
    uint64_t state = 31;
    for (int i = 0; i < 2000; i++) {
        double tilt = pow(10.0, scene_uniform(&state, -16.0, -4.0));
        perp__placed a = scene_place(&box, 0.0, 0.0, 0.0), b = a;
        perp__point points[PERP__MAX_POINTS];
        b.position[0] = scene_uniform(&state, -1.0, 1.0);
        b.position[1] = scene_uniform(&state, -0.8, 0.8);
        b.position[2] = 1.0 + tilt * scene_uniform(&state, -1.0, 1.0);
        scene_rotation(b.rotation, 1.0, tilt * scene_uniform(&state, -1.0, 1.0),
                       tilt * scene_uniform(&state, -1.0, 1.0),
                       tilt * scene_uniform(&state, -1.0, 1.0));
        /* corners are within 2.3 of the centre, turned by at most 2 sqrt(3) tilt */
        double most = 10.0 * tilt + rounding;
        int32_t count = perp__collide(&a, &b, 0, most, points);
        assert_true(count >= 4);
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        for (int32_t q = 0; q < count; q++) {
            assert_true(fabs(points[q].gap) <= most);
            assert_true(points[q].normal[2] > 1.0 - 1e-6);
            for (int k = 0; k < 2; k++) {
                low[k] = fmin(low[k], points[q].position[k]);
                high[k] = fmax(high[k], points[q].position[k]);
            }
        }
        for (int k = 0; k < 2; k++) {
            double width = 2.0 * box.half_extents[k] - fabs(b.position[k]);
            assert_true(fabs(high[k] - low[k] - width) <= most + 1e-8);
        }
    }
}

/* Boxes that have drifted on each other by what steps round and solvers leave keep four points: a
 * corner that stands out by 1e-10 of a size is not cut off into two. */
static void drift_makes_no_points(void **context)
{
    (void)context;
    perp__geometry box = scene_box(1.0, 0.8, 0.5);
    uint64_t state = 32;
    for (int i = 0; i < 1000; i++) {
        double drift = pow(10.0, scene_uniform(&state, -17.0, -10.0));
        perp__placed a = scene_place(&box, 0.0, 0.0, 0.0), b = scene_place(&box, 0.0, 0.0, 1.0);
        perp__point points[PERP__MAX_POINTS];
        for (int k = 0; k < 3; k++)
            b.position[k] += drift * scene_uniform(&state, -1.0, 1.0);
        scene_rotation(b.rotation, 1.0, drift * scene_uniform(&state, -1.0, 1.0),
                       drift * scene_uniform(&state, -1.0, 1.0),
                       drift * scene_uniform(&state, -1.0, 1.0));
        double corners[4][3] = {
            {1.0, 0.8, 0.5}, {1.0, -0.8, 0.5}, {-1.0, 0.8, 0.5}, {-1.0, -0.8, 0.5}};
        check_set(points, perp__collide(&a, &b, 0, 10.0 * drift + rounding, points), 4, corners,
                  (double[3]){0.0, 0.0, 1.0}, 0.0, 10.0 * drift + rounding);
    }
}

/* Rectangles: stacked, overhanging, corner down, corner beside corner. */
static void rectangles(void **context)
{
    (void)context;
    perp__geometry brick = scene_box(0.7, 0.1, 0.0), square = scene_box(0.5, 0.5, 0.0);
    perp__placed a = scene_place(&brick, 0.0, 0.0, 0.0), b = scene_place(&brick, 0.0, 0.2, 0.0);
    perp__point points[PERP__MAX_POINTS];
    double ends[2][3] = {{-0.7, 0.1, 0.0}, {0.7, 0.1, 0.0}};
    check_set(points, perp__collide(&a, &b, 1, 0.0, points), 2, ends, (double[3]){0.0, 1.0, 0.0},
              0.0, 0.0);

    b.position[0] = 0.5;
    double part[2][3] = {{-0.2, 0.1, 0.0}, {0.7, 0.1, 0.0}};
    check_set(points, perp__collide(&b, &a, 1, 0.0, points), 2, part, (double[3]){0.0, -1.0, 0.0},
              0.0, rounding);

    b = scene_place(&square, 0.25, 1.0, 0.0);
    scene_planar_rotation(b.rotation, atan(1.0));
    double gap = 0.9 - sqrt(0.5), corner[1][3] = {{0.25, 0.1 + 0.5 * gap, 0.0}};
    check_set(points, perp__collide(&a, &b, 1, gap + rounding, points), 1, corner,
              (double[3]){0.0, 1.0, 0.0}, gap, rounding);

    b = scene_place(&square, 1.5, 1.0, 0.0);
    double beside[1][3] = {{0.85, 0.3, 0.0}};
    check_set(points, perp__collide(&a, &b, 1, 0.51, points), 1, beside, (double[3]){0.6, 0.8, 0.0},
              0.5, rounding);
    assert_int_equal(perp__collide(&a, &b, 1, 0.49, points), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(box_flat_on_a_plane),
        cmocka_unit_test(rectangle_on_a_line),
        cmocka_unit_test(equal_boxes_stacked),
        cmocka_unit_test(bricks),
        cmocka_unit_test(octagon),
        cmocka_unit_test(corner_and_edge_down),
        cmocka_unit_test(crossing_edges),
        cmocka_unit_test(corners_and_edges_apart),
        cmocka_unit_test(tilted_stack_keeps_its_support),
        cmocka_unit_test(drift_makes_no_points),
        cmocka_unit_test(rectangles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
