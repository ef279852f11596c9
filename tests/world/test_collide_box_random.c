/* Contact points of boxes and rectangles in random poses, against a view of boxes that knows no
 * separating axes (collide_scene.h). */
#include "suite.h"

#include "collide_scene.h"

/* Sizes and distances below are of order 1. The library and these checks each do some tens of
 * operations on them; the sections behind the distances cost a digit more. */
static const double rounding = 1e-13;

/* How far beside a face a corner still counts as standing on it: 1e-9 of a size of at most 1.5. */
static const double on_face = 2e-9;

/* What the choice of axis may cost in depth, relative: another axis has to be better by 1e-6, and a
 * face axis 1e-3 rad off stands in for one of edges, cos 1e-3 = 1 - 5e-7. */
static const double choice = 2e-6;

enum { SCENES = 600, SPATIAL = 0, PLANAR = 1, NEARLY_FLAT = 2 };

typedef struct scene {
    perp__geometry shapes[2];
    perp__placed a, b;
    double margin;
} scene;

static void random_scene(uint64_t *state, int planar, scene *s)
{
    perp__placed *placed[2] = {&s->a, &s->b};
    for (int side = 0; side < 2; side++) {
        s->shapes[side] = scene_box(scene_uniform(state, 0.3, 1.5), scene_uniform(state, 0.3, 1.5),
                                    planar ? 0.0 : scene_uniform(state, 0.3, 1.5));
        *placed[side] = scene_place(&s->shapes[side], scene_uniform(state, -1.6, 1.6),
                                    scene_uniform(state, -1.6, 1.6),
                                    planar ? 0.0 : scene_uniform(state, -1.6, 1.6));
        if (planar)
            scene_planar_rotation(placed[side]->rotation, scene_uniform(state, -4.0, 4.0));
        else
            scene_random_rotation(state, placed[side]->rotation);
    }
    s->margin = scene_uniform(state, 0.0, 0.5);
}

/* A slightly tilted box that almost touches, or a little enters, a face of another: where edges and
 * faces compete. */
static void nearly_flat_scene(uint64_t *state, scene *s)
{
    random_scene(state, 0, s);
    double tilt = pow(10.0, scene_uniform(state, -9.0, -1.0));
    double turn = scene_uniform(state, 0.0, 1.0) < 0.5 ? 0.0 : scene_uniform(state, -1.0, 1.0);
    memcpy(s->a.rotation, (double[9]){1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0},
           sizeof s->a.rotation);
    scene_rotation(s->b.rotation, 1.0, tilt * scene_uniform(state, -1.0, 1.0),
                   tilt * scene_uniform(state, -1.0, 1.0), turn);
    s->b.position[2] = s->a.position[2] + s->shapes[0].half_extents[2] +
                       s->shapes[1].half_extents[2] + tilt * scene_uniform(state, -1.0, 1.0);
}

static void any_scene(uint64_t *state, int kind, scene *s)
{
    if (kind == NEARLY_FLAT)
        nearly_flat_scene(state, s);
    else
        random_scene(state, kind == PLANAR, s);
}

static double least_gap(const perp__point *points, int32_t count)
{
    double least = INFINITY;
    for (int32_t q = 0; q < count; q++)
        least = fmin(least, points[q].gap);
    return least;
}

/* Each point is midway between a point of A's surface and one of B's, a gap apart along the normal;
 * features differ. */
static void check_points(const scene *s, int planar, const perp__point *points, int32_t count)
{
    assert_true(count <= (planar ? 2 : 8));
    for (int32_t q = 0; q < count; q++) {
        const perp__point *at = &points[q];
        double on_a[3], on_b[3];
        for (int k = 0; k < 3; k++) {
            on_a[k] = at->position[k] - 0.5 * at->gap * at->normal[k];
            on_b[k] = at->position[k] + 0.5 * at->gap * at->normal[k];
        }
        assert_true(at->gap <= s->margin);
        assert_true(fabs(scene_dot(at->normal, at->normal) - 1.0) < rounding);
        assert_true(fabs(scene_point_box(&s->a, planar, on_a)) < on_face);
        assert_true(fabs(scene_point_box(&s->b, planar, on_b)) < on_face);
        assert_false(planar && (at->position[2] != 0.0 || at->normal[2] != 0.0));
        assert_true(at->feature >= 0);
        for (int32_t r = 0; r < q; r++) {
            assert_int_not_equal(at->feature, points[r].feature);
            assert_memory_equal(at->normal, points[r].normal, sizeof at->normal);
        }
    }
}

/* The least way that B can move out of A: for boxes it is along a face normal or an edge product.
 */
static double least_overlap(const scene *s, int planar)
{
    double axes[2][3][3], least = INFINITY;
    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++) {
            axes[0][j][k] = s->a.rotation[3 * k + j];
            axes[1][j][k] = s->b.rotation[3 * k + j];
        }
    for (int m = 0; m < (planar ? 6 : 15); m++) {
        double n[3];
        const double *u = axes[0][m % 3], *v = axes[1][m / 3 % 3];
        if (planar && m % 3 == 2)
            continue;
        for (int k = 0; k < 3; k++)
            n[k] = m < 6 ? axes[m / 3][m % 3][k]
                         : u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
        double length = sqrt(scene_dot(n, n));
        if (length < 1e-7)
            continue;
        for (int sign = 0; sign < 2; sign++) {
            for (int k = 0; k < 3; k++)
                n[k] /= sign ? -1.0 : length;
            least = fmin(least, scene_overlap(&s->a, &s->b, n));
        }
    }
    return least;
}

/* No direction near the normal, nor any other, leads out of A sooner than `depth`. */
static void check_depth(uint64_t *state, const scene *s, int planar, const double *normal,
                        double depth)
{
    for (int trial = 0; trial < 100; trial++) {
        double n[3], length, spread = pow(10.0, -(double)(trial % 4));
        for (int k = 0; k < 3; k++)
            n[k] = normal[k] + spread * scene_uniform(state, -1.0, 1.0);
        if (planar)
            n[2] = 0.0;
        length = sqrt(scene_dot(n, n));
        for (int k = 0; k < 3; k++)
            n[k] /= length;
        assert_true(scene_overlap(&s->a, &s->b, n) > depth - rounding);
    }
}

static void check_gaps(uint64_t *state, const scene *s, int kind)
{
    int planar = kind == PLANAR;
    perp__point points[PERP__MAX_POINTS];
    int32_t count = perp__collide(&s->a, &s->b, planar, s->margin, points);
    double gap = least_gap(points, count);
    check_points(s, planar, points, count);

    double distance = scene_box_distance(&s->a, &s->b, planar);
    if (distance > s->margin) {
        assert_int_equal(count, 0);
        return;
    }
    assert_true(count > 0);
    if (distance > 0.0) {
        assert_true(gap > distance - rounding);
        /* Gaps are those over a face. What is closest may lie just beside the face and not count:
         * no more than by this factor where an incident face leans at most acos(1 / sqrt(3)),
         * except where faces pass each other with next to no overlap. */
        if (kind != NEARLY_FLAT)
            assert_true(gap < 1.8 * distance + rounding);
        return;
    }
    double depth = least_overlap(s, planar);
    assert_true(-gap > depth - rounding);
    assert_true(-gap < depth + 1.5 * choice);
    check_depth(state, s, planar, points[0].normal, depth);
}

static void gaps_are_distances_and_depths(void **context)
{
    (void)context;
    for (int kind = SPATIAL; kind <= NEARLY_FLAT; kind++) {
        uint64_t state = 1;
        for (int i = 0; i < SCENES; i++) {
            scene s;
            any_scene(&state, kind, &s);
            check_gaps(&state, &s, kind);
        }
    }
}

/* Which box is called A changes the sign of the normal and no other bit. */
static void swapping_flips_the_normal(void **context)
{
    (void)context;
    for (int kind = SPATIAL; kind <= NEARLY_FLAT; kind++) {
        uint64_t state = 2;
        for (int i = 0; i < SCENES; i++) {
            scene s;
            perp__point points[PERP__MAX_POINTS], swapped[PERP__MAX_POINTS];
            any_scene(&state, kind, &s);
            int32_t count = perp__collide(&s.a, &s.b, kind == PLANAR, s.margin, points);
            assert_int_equal(perp__collide(&s.b, &s.a, kind == PLANAR, s.margin, swapped), count);
            for (int32_t q = 0; q < count; q++) {
                for (int k = 0; k < 3; k++) {
                    assert_true(points[q].position[k] == swapped[q].position[k]);
                    assert_true(points[q].normal[k] == -swapped[q].normal[k]);
                }
                assert_true(points[q].gap == swapped[q].gap);
                assert_int_equal(points[q].feature, swapped[q].feature);
            }
        }
    }
}

/* Moving both boxes rigidly moves the points. Gaps at the margin, and corners at the sides of a
 * face, may fall either way; random poses have none so close. */
static void rigid_motion_moves_the_points(void **context)
{
    (void)context;
    for (int kind = SPATIAL; kind <= PLANAR; kind++) {
        uint64_t state = 3;
        for (int i = 0; i < SCENES; i++) {
            scene s;
            double Q[9], c[3];
            perp__point points[PERP__MAX_POINTS], moved[PERP__MAX_POINTS];
            any_scene(&state, kind, &s);
            scene_random_rotation(&state, Q);
            if (kind == PLANAR)
                scene_planar_rotation(Q, scene_uniform(&state, -4.0, 4.0));
            for (int k = 0; k < 3; k++)
                c[k] = kind == PLANAR && k == 2 ? 0.0 : scene_uniform(&state, -5.0, 5.0);
            perp__placed a = scene_moved(&s.a, Q, c), b = scene_moved(&s.b, Q, c);
            int32_t count = perp__collide(&s.a, &s.b, kind == PLANAR, s.margin, points);
            assert_int_equal(perp__collide(&a, &b, kind == PLANAR, s.margin, moved), count);
            for (int32_t q = 0; q < count; q++) {
                double position[3], normal[3];
                scene_rotate(position, Q, points[q].position);
                scene_rotate(normal, Q, points[q].normal);
                for (int k = 0; k < 3; k++) {
                    /* nearly parallel edges or sides lose some digits where they cross */
                    assert_true(fabs(position[k] + c[k] - moved[q].position[k]) < 1e-10);
                    assert_true(fabs(normal[k] - moved[q].normal[k]) < 1e-11);
                }
                assert_true(fabs(points[q].gap - moved[q].gap) < 1e-10);
                assert_int_equal(points[q].feature, moved[q].feature);
            }
        }
    }
}

/* Units that differ by a power of two change no bit: nothing absolute is hidden anywhere. */
static void units_do_not_matter(void **context)
{
    (void)context;
    static const int exponents[] = {-400, -30, 1, 30, 400};
    for (int kind = SPATIAL; kind <= NEARLY_FLAT; kind++) {
        uint64_t state = 4;
        for (int i = 0; i < SCENES; i++) {
            scene s, t;
            int e = exponents[i % 5];
            perp__point points[PERP__MAX_POINTS], scaled[PERP__MAX_POINTS];
            any_scene(&state, kind, &s);
            t = s;
            t.a.geometry = &t.shapes[0];
            t.b.geometry = &t.shapes[1];
            for (int k = 0; k < 3; k++) {
                t.shapes[0].half_extents[k] = ldexp(s.shapes[0].half_extents[k], e);
                t.shapes[1].half_extents[k] = ldexp(s.shapes[1].half_extents[k], e);
                t.a.position[k] = ldexp(s.a.position[k], e);
                t.b.position[k] = ldexp(s.b.position[k], e);
            }
            int32_t count = perp__collide(&s.a, &s.b, kind == PLANAR, s.margin, points);
            int32_t same = perp__collide(&t.a, &t.b, kind == PLANAR, ldexp(s.margin, e), scaled);
            assert_int_equal(count, same);
            for (int32_t q = 0; q < count; q++) {
                for (int k = 0; k < 3; k++) {
                    assert_true(ldexp(points[q].position[k], e) == scaled[q].position[k]);
                    assert_true(points[q].normal[k] == scaled[q].normal[k]);
                }
                assert_true(ldexp(points[q].gap, e) == scaled[q].gap);
                assert_int_equal(points[q].feature, scaled[q].feature);
            }
        }
    }
}

/* A rectangle's points are those of a box that is as long in z as the rectangles are at most, seen
 * along z. */
static void rectangles_are_boxes_seen_from_above(void **context)
{
    (void)context;
    uint64_t state = 5;
    for (int i = 0; i < SCENES; i++) {
        scene s;
        perp__point points[PERP__MAX_POINTS], tall[PERP__MAX_POINTS];
        random_scene(&state, 1, &s);
        int32_t count = perp__collide(&s.a, &s.b, 1, s.margin, points);
        s.shapes[0].half_extents[2] = s.shapes[1].half_extents[2] = 1.5;
        int32_t others = perp__collide(&s.a, &s.b, 0, s.margin, tall);
        assert_int_equal(count > 0, others > 0);
        for (int32_t r = 0; r < others; r++) {
            double least = INFINITY;
            for (int32_t q = 0; q < count; q++)
                least = fmin(least, fabs(tall[r].position[0] - points[q].position[0]) +
                                        fabs(tall[r].position[1] - points[q].position[1]) +
                                        fabs(tall[r].gap - points[q].gap) +
                                        fabs(tall[r].normal[0] - points[q].normal[0]) +
                                        fabs(tall[r].normal[1] - points[q].normal[1]));
            assert_true(least < 1e-12);
        }
        /* corner against corner stays one point, at half height */
        int single = count == 1 && others == 1;
        assert_true(single || others == 2 * count);
        assert_false(single && fabs(tall[0].position[2]) > rounding);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gaps_are_distances_and_depths),
        cmocka_unit_test(swapping_flips_the_normal),
        cmocka_unit_test(rigid_motion_moves_the_points),
        cmocka_unit_test(units_do_not_matter),
        cmocka_unit_test(rectangles_are_boxes_seen_from_above),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
