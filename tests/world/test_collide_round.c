/* Contact points of spheres with half-spaces, boxes and each other: closed forms. */
#include "suite.h"

#include "collide_scene.h"

/* some tens of roundings of numbers of order 1 */
static const double rounding = 1e-14;

static void check_point(const perp__point *point, const double *position, const double *normal,
                        double gap, double tolerance)
{
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(point->position[k] - position[k]) <= tolerance);
        assert_true(fabs(point->normal[k] - normal[k]) <= tolerance);
    }
    assert_true(fabs(point->gap - gap) <= tolerance);
}

/* A ball of radius 1 at height 1.5 over z = 0.25. */
static void sphere_over_a_plane(void **context)
{
    (void)context;
    perp__geometry ground = scene_plane(0.0, 0.0, 1.0, 0.25), ball = scene_sphere(1.0);
    perp__placed a = scene_place(&ground, 0.0, 0.0, 0.0), b = scene_place(&ball, 2.0, 3.0, 1.5);
    perp__point points[PERP__MAX_POINTS];
    assert_int_equal(perp__collide(&a, &b, 0, 0.25, points), 1);
    check_point(points, (double[3]){2.0, 3.0, 0.375}, (double[3]){0.0, 0.0, 1.0}, 0.25, 0.0);
    assert_int_equal(perp__collide(&a, &b, 0, 0.2499, points), 0);

    /* the sphere first: the normal goes from it to the ground */
    assert_int_equal(perp__collide(&b, &a, 0, 0.25, points), 1);
    check_point(points, (double[3]){2.0, 3.0, 0.375}, (double[3]){0.0, 0.0, -1.0}, 0.25, 0.0);
}

/* The plane's frame moves its offset along: normal (1, 0, 0) turned about z into (0, 1, 0). */
static void plane_of_a_turned_body(void **context)
{
    (void)context;
    perp__geometry wall = scene_plane(1.0, 0.0, 0.0, 2.0), ball = scene_sphere(0.5);
    perp__placed a = scene_place(&wall, 7.0, 1.0, 0.0), b = scene_place(&ball, -4.0, 3.25, 0.0);
    perp__point points[PERP__MAX_POINTS];
    memcpy(a.rotation, (double[9]){0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0},
           sizeof a.rotation);
    for (int planar = 0; planar < 2; planar++) {
        assert_int_equal(perp__collide(&a, &b, planar, 0.0, points), 1);
        check_point(points, (double[3]){-4.0, 2.875, 0.0}, (double[3]){0.0, 1.0, 0.0}, -0.25, 0.0);
    }
}

static void two_spheres(void **context)
{
    (void)context;
    perp__geometry small = scene_sphere(0.5), large = scene_sphere(2.0);
    perp__placed a = scene_place(&small, 1.0, 1.0, 1.0), b = scene_place(&large, 3.0, 4.0, 7.0);
    perp__point points[PERP__MAX_POINTS];
    double n[3] = {2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0}; /* 2, 3, 6 and the distance 7 */
    double at[3];
    for (int k = 0; k < 3; k++)
        at[k] = 1.0 + (0.5 + 2.25) * n[k];
    assert_int_equal(perp__collide(&a, &b, 0, 4.5, points), 1);
    check_point(points, at, n, 4.5, rounding);
    assert_int_equal(perp__collide(&a, &b, 0, 4.4, points), 0);

    /* deep overlap keeps the direction */
    b = scene_place(&large, 1.0, 1.0, 0.75);
    assert_int_equal(perp__collide(&a, &b, 0, 0.0, points), 1);
    check_point(points, (double[3]){1.0, 1.0, 1.625}, (double[3]){0.0, 0.0, -1.0}, -2.25, 0.0);
}

/* A radius of 0 is a point; two of them at one place touch. */
static void points_and_concentric_spheres(void **context)
{
    (void)context;
    perp__geometry point = scene_sphere(0.0), ball = scene_sphere(1.0);
    perp__placed a = scene_place(&point, 5.0, 6.0, 0.0), b = scene_place(&ball, 5.0, 6.0, 0.0);
    perp__point points[PERP__MAX_POINTS];
    scene_planar_rotation(a.rotation, 0.5);
    for (int planar = 0; planar < 2; planar++) {
        assert_int_equal(perp__collide(&a, &a, planar, 0.0, points), 1);
        assert_true(points->gap == 0.0);
        assert_int_equal(perp__collide(&a, &b, planar, 0.0, points), 1);
        assert_true(points->gap == -1.0);
        assert_true(fabs(scene_dot(points->normal, points->normal) - 1.0) < rounding);
        assert_true(points->normal[2] == 0.0);
    }
}

/* Distances whose squares leave the range of doubles. */
static void extreme_units(void **context)
{
    (void)context;
    for (int e = -900; e <= 900; e += 1800) {
        perp__geometry small = scene_sphere(ldexp(0.5, e)),
                       box = scene_box(ldexp(1.0, e), ldexp(1.0, e), ldexp(1.0, e));
        perp__placed a = scene_place(&small, ldexp(4.0, e), ldexp(5.0, e), 0.0);
        perp__placed b = scene_place(&small, 0.0, ldexp(2.0, e), 0.0);
        perp__placed c = scene_place(&box, 0.0, ldexp(1.0, e), 0.0);
        perp__point points[PERP__MAX_POINTS];
        assert_int_equal(perp__collide(&a, &b, 0, ldexp(4.0, e), points), 1);
        assert_true(points->gap == ldexp(4.0, e));
        assert_int_equal(perp__collide(&c, &a, 0, ldexp(4.0, e), points), 1);
        /* from the corner (1, 2) to (4, 5) */
        assert_true(fabs(ldexp(points->gap, -e) - (sqrt(18.0) - 0.5)) < rounding);
    }
}

/* Regions of a box of half extents 1, 2, 3, a sphere of radius 0.5. */
static void sphere_around_a_box(void **context)
{
    (void)context;
    static const struct {
        double centre[3], position[3], normal[3], gap;
    } cases[] = {
        {{0.5, 0.25, 4.0}, {0.5, 0.25, 3.25}, {0.0, 0.0, 1.0}, 0.5},     /* face */
        {{-1.75, 0.0, 0.0}, {-1.125, 0.0, 0.0}, {-1.0, 0.0, 0.0}, 0.25}, /* face */
        {{1.75, 1.0, 4.0}, {1.225, 1.0, 3.3}, {0.6, 0.0, 0.8}, 0.75},    /* edge */
        {{1.25, 2.5, -3.5},
         {25.0 / 24.0, 25.0 / 12.0, -37.0 / 12.0}, /* corner */
         {1.0 / 3.0, 2.0 / 3.0, -2.0 / 3.0},
         0.25},
        {{1.0, 0.5, 0.5}, {0.75, 0.5, 0.5}, {1.0, 0.0, 0.0}, -0.5},     /* on a face */
        {{0.25, -1.5, 0.0}, {0.25, -1.5, 0.0}, {0.0, -1.0, 0.0}, -1.0}, /* inside */
        {{0.0, 0.0, 0.0}, {0.25, 0.0, 0.0}, {1.0, 0.0, 0.0}, -1.5},     /* in the middle */
    };
    perp__geometry box = scene_box(1.0, 2.0, 3.0), ball = scene_sphere(0.5);
    uint64_t state = 11;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        perp__placed a = scene_place(&box, 0.0, 0.0, 0.0);
        perp__placed b =
            scene_place(&ball, cases[i].centre[0], cases[i].centre[1], cases[i].centre[2]);
        perp__point points[PERP__MAX_POINTS];
        assert_int_equal(perp__collide(&a, &b, 0, 1.0, points), 1);
        check_point(points, cases[i].position, cases[i].normal, cases[i].gap, rounding);
        assert_int_equal(perp__collide(&a, &b, 0, cases[i].gap - 1e-9, points), 0);

        /* the same, moved as a whole */
        double Q[9], c[3] = {3.0, -1.0, 2.0}, position[3], normal[3];
        scene_random_rotation(&state, Q);
        a = scene_moved(&a, Q, c);
        b = scene_moved(&b, Q, c);
        scene_rotate(position, Q, cases[i].position);
        scene_rotate(normal, Q, cases[i].normal);
        for (int k = 0; k < 3; k++)
            position[k] += c[k];
        /* the very middle has no nearest face once it is rounded */
        if (cases[i].gap == -1.5)
            continue;
        assert_int_equal(perp__collide(&a, &b, 0, 1.0, points), 1);
        check_point(points, position, normal, cases[i].gap, rounding);
    }
}

/* A disc deep in a flat rectangle leaves it in the plane, though z is the nearest way out. */
static void disc_and_rectangle(void **context)
{
    (void)context;
    perp__geometry box = scene_box(1.0, 2.0, 0.0), disc = scene_sphere(0.25);
    perp__placed a = scene_place(&box, 0.0, 0.0, 0.0), b = scene_place(&disc, 0.0, -1.75, 0.0);
    perp__point points[PERP__MAX_POINTS];
    assert_int_equal(perp__collide(&a, &b, 1, 0.0, points), 1);
    check_point(points, (double[3]){0.0, -1.75, 0.0}, (double[3]){0.0, -1.0, 0.0}, -0.5, 0.0);
    b = scene_place(&disc, 1.375, 2.5, 0.0);
    assert_int_equal(perp__collide(&b, &a, 1, 0.375, points), 1);
    check_point(points, (double[3]){1.0 + 0.6 * 0.1875, 2.0 + 0.8 * 0.1875, 0.0},
                (double[3]){-0.6, -0.8, 0.0}, 0.375, rounding);
}

/* Random places: the surfaces of box and sphere are a gap apart along the normal. */
static void random_box_and_sphere(void **context)
{
    (void)context;
    uint64_t state = 12;
    for (int i = 0; i < 4000; i++) {
        perp__geometry box =
            scene_box(scene_uniform(&state, 0.2, 1.0), scene_uniform(&state, 0.2, 1.0),
                      scene_uniform(&state, 0.2, 1.0));
        perp__geometry ball = scene_sphere(scene_uniform(&state, 0.0, 1.0));
        perp__placed a = scene_place(&box, 1.0, 2.0, 3.0), b = a;
        perp__point points[PERP__MAX_POINTS];
        scene_random_rotation(&state, a.rotation);
        b.geometry = &ball;
        for (int k = 0; k < 3; k++)
            b.position[k] += scene_uniform(&state, -1.5, 1.5);
        double gap = scene_point_box(&a, 0, b.position) - ball.radius;
        assert_int_equal(perp__collide(&a, &b, 0, 0.5, points), gap <= 0.5);
        if (gap > 0.5)
            continue;
        double on_box[3], on_ball[3];
        assert_true(fabs(points->gap - gap) < rounding);
        for (int k = 0; k < 3; k++) {
            on_box[k] = points->position[k] - 0.5 * gap * points->normal[k];
            on_ball[k] =
                b.position[k] - ball.radius * points->normal[k] - 0.5 * gap * points->normal[k];
            assert_true(fabs(on_ball[k] - points->position[k]) < rounding);
        }
        assert_true(fabs(scene_point_box(&a, 0, on_box)) < rounding);
    }
}

static void planes_do_not_collide(void **context)
{
    (void)context;
    perp__geometry floor = scene_plane(0.0, 0.0, 1.0, 0.0), wall = scene_plane(1.0, 0.0, 0.0, 0.0);
    perp__placed a = scene_place(&floor, 0.0, 0.0, 0.0), b = scene_place(&wall, 0.0, 0.0, 0.0);
    perp__point points[PERP__MAX_POINTS];
    assert_int_equal(perp__collide(&a, &b, 0, 1.0, points), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere_over_a_plane),   cmocka_unit_test(plane_of_a_turned_body),
        cmocka_unit_test(two_spheres),           cmocka_unit_test(points_and_concentric_spheres),
        cmocka_unit_test(extreme_units),         cmocka_unit_test(sphere_around_a_box),
        cmocka_unit_test(disc_and_rectangle),    cmocka_unit_test(random_box_and_sphere),
        cmocka_unit_test(planes_do_not_collide),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
