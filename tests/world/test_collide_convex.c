/* Points of random convex shapes against what brute force over all corners says, which knows of no
 * faces: the distance of two hulls is that of some two segments or of a corner and a triangle of
 * any of their corners; what two overlapping hulls overlap by is least along the normal of some
 * three corners or across some two segments. */
#include <stdio.h>

#include "suite.h"

#include "world/collide_scene.h"
#include "world/collide/collision.h"
#include "world/collide/polytope.h"

enum { CORNERS = 8, TRIALS = 400 };

/* Along edges that are nearly parallel a face is preferred to their product until it is worse by
 * 1e-6 of the size (BIAS), and where they are within 1e-3 it is the face; sizes are below 2. */
#define NEAR 4e-6

typedef struct body {
    perp__geometry geometry;
    perp__placed placed;
    int count;
    double corner[CORNERS][3]; /* in the world */
} body;

static perp_context *context;

static void cross(double *c, const double *a, const double *b)
{
    for (int k = 0; k < 3; k++)
        c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void minus(double *c, const double *a, const double *b)
{
    for (int k = 0; k < 3; k++)
        c[k] = a[k] - b[k];
}

/* ---- random shapes ---- */

static void place(body *b, uint64_t *state, int planar, const double (*local)[3])
{
    b->placed.geometry = &b->geometry;
    if (planar)
        scene_planar_rotation(b->placed.rotation, scene_uniform(state, -4.0, 4.0));
    else
        scene_random_rotation(state, b->placed.rotation);
    for (int k = 0; k < 3; k++)
        b->placed.position[k] = planar && k == 2 ? 0.0 : scene_uniform(state, -1.0, 1.0);
    for (int i = 0; i < b->count; i++) {
        scene_rotate(b->corner[i], b->placed.rotation, local[i]);
        for (int k = 0; k < 3; k++)
            b->corner[i][k] += b->placed.position[k];
    }
}

static void make_hull(body *b, const double (*local)[3], int planar)
{
    double centre[3];
    assert_int_equal(
        perp__hull_make(context, &b->geometry.hull, centre, local[0], b->count, planar), PERP_OK);
    memcpy(b->geometry.half_extents, b->geometry.hull->half, sizeof centre);
    /* points of random hulls are taken about their centre from here on */
    for (int i = 0; i < b->count; i++)
        minus(b->corner[i], local[i], centre);
}

static void random_body(body *b, uint64_t *state, int planar, int32_t kind)
{
    double local[CORNERS][3] = {{0.0}};
    const int dimension = planar ? 2 : 3;
    memset(b, 0, sizeof *b);
    b->geometry.kind = kind;
    if (kind == PERP__BOX) {
        b->count = 1 << dimension;
        for (int k = 0; k < dimension; k++)
            b->geometry.half_extents[k] = scene_uniform(state, 0.2, 1.0);
        for (int i = 0; i < b->count; i++)
            for (int k = 0; k < dimension; k++)
                local[i][k] = (i >> k & 1 ? 1.0 : -1.0) * b->geometry.half_extents[k];
    } else if (kind == PERP__HULL) {
        b->count = planar ? 6 : CORNERS;
        for (int i = 0; i < b->count; i++)
            for (int k = 0; k < dimension; k++)
                local[i][k] = scene_uniform(state, -1.0, 1.0);
        make_hull(b, (const double(*)[3])local, planar);
        memcpy(local, b->corner, sizeof local);
    } else {
        b->count = kind == PERP__CAPSULE ? 2 : 1;
        b->geometry.radius = scene_uniform(state, 0.1, 0.5);
        if (kind == PERP__CAPSULE)
            b->geometry.half_extents[0] = scene_uniform(state, 0.2, 1.0);
        for (int i = 0; i < b->count; i++)
            local[i][0] = (i ? 1.0 : -1.0) * b->geometry.half_extents[0];
    }
    place(b, state, planar, (const double(*)[3])local);
}

static void release(body *b)
{
    perp__release(context, b->geometry.hull);
}

static void move(body *b, const double *by)
{
    for (int k = 0; k < 3; k++) {
        b->placed.position[k] += by[k];
        for (int i = 0; i < b->count; i++)
            b->corner[i][k] += by[k];
    }
}

/* ---- brute force ---- */

/* Of the points p + s u and q + r v, 0 <= s, r <= 1: the least of a convex function of s and r lies
 * inside or on one of the four ends. */
static double segments(const double *p, const double *p1, const double *q, const double *q1)
{
    double u[3], v[3], w[3], s = 0.5, r = 0.5, d[3];
    minus(u, p1, p);
    minus(v, q1, q);
    minus(w, q, p);
    const double uu = scene_dot(u, u), vv = scene_dot(v, v), uv = scene_dot(u, v);
    const double uw = scene_dot(u, w), vw = scene_dot(v, w), det = uu * vv - uv * uv;
    double best = INFINITY;
    /* the inner minimum if there is one, and the four ends */
    for (int which = 0; which < 5; which++) {
        if (which == 0 && det > 1e-14 * uu * vv) {
            s = (uw * vv - vw * uv) / det;
            r = (uw * uv - vw * uu) / det;
            if (s < 0.0 || s > 1.0 || r < 0.0 || r > 1.0)
                continue;
        } else if (which == 1 || which == 2) {
            s = which - 1.0;
            r = vv > 0.0 ? fmin(fmax((s * uv - vw) / vv, 0.0), 1.0) : 0.0;
        } else if (which > 2) {
            r = which - 3.0;
            s = uu > 0.0 ? fmin(fmax((r * uv + uw) / uu, 0.0), 1.0) : 0.0;
        } else {
            continue;
        }
        for (int k = 0; k < 3; k++)
            d[k] = w[k] + r * v[k] - s * u[k];
        best = fmin(best, sqrt(scene_dot(d, d)));
    }
    return best;
}

/* From x to the triangle's plane, if the foot lies in the triangle. */
static double to_triangle(const double *x, const double *a, const double *b, const double *c)
{
    double u[3], v[3], n[3], d[3], foot[3][3];
    minus(u, b, a);
    minus(v, c, a);
    cross(n, u, v);
    const double length = sqrt(scene_dot(n, n));
    if (length < 1e-12)
        return INFINITY;
    minus(d, x, a);
    const double *corner[3] = {a, b, c};
    for (int i = 0; i < 3; i++) {
        minus(u, corner[(i + 1) % 3], corner[i]);
        minus(v, x, corner[i]);
        cross(foot[i], u, v);
        if (scene_dot(foot[i], n) < 0.0)
            return INFINITY;
    }
    return fabs(scene_dot(d, n)) / length;
}

static double distance(const body *a, const body *b)
{
    double best = INFINITY;
    for (int i = 0; i < a->count; i++)
        for (int j = i; j < a->count; j++)
            for (int k = 0; k < b->count; k++)
                for (int l = k; l < b->count; l++)
                    best = fmin(best,
                                segments(a->corner[i], a->corner[j], b->corner[k], b->corner[l]));
    for (int turn = 0; turn < 2; turn++) {
        const body *x = turn ? b : a, *y = turn ? a : b;
        for (int i = 0; i < x->count; i++)
            for (int j = 0; j < y->count; j++)
                for (int k = j + 1; k < y->count; k++)
                    for (int l = k + 1; l < y->count; l++)
                        best = fmin(best, to_triangle(x->corner[i], y->corner[j], y->corner[k],
                                                      y->corner[l]));
    }
    return best;
}

static double along(const body *a, const body *b, const double *n)
{
    double high = -INFINITY, low = INFINITY;
    for (int i = 0; i < a->count; i++)
        high = fmax(high, scene_dot(n, a->corner[i]));
    for (int i = 0; i < b->count; i++)
        low = fmin(low, scene_dot(n, b->corner[i]));
    return low - high;
}

/* The larger of the separations in both senses of n, which need not be a unit vector. */
static double either(const body *a, const body *b, const double *n)
{
    const double length = sqrt(scene_dot(n, n)), back[3] = {-n[0], -n[1], -n[2]};
    return length > 1e-9 ? fmax(along(a, b, n), along(a, b, back)) / length : -INFINITY;
}

static int edges_of(const body *b, double (*edge)[3])
{
    int count = 0;
    for (int i = 0; i < b->count; i++)
        for (int j = i + 1; j < b->count; j++)
            minus(edge[count++], b->corner[j], b->corner[i]);
    return count;
}

/* The largest separation of the cores along any direction that can matter. */
static double separation(const body *a, const body *b, int planar)
{
    double edges[2][CORNERS * CORNERS][3], n[3], best = -INFINITY;
    const int counts[2] = {edges_of(a, edges[0]), edges_of(b, edges[1])};
    for (int side = 0; side < 2; side++)
        for (int i = 0; i < counts[side]; i++) {
            const double *u = edges[side][i], flat[3] = {u[1], -u[0], 0.0};
            if (planar)
                best = fmax(best, either(a, b, flat));
            for (int j = i + 1; j < counts[side] && !planar; j++) {
                cross(n, u, edges[side][j]);
                best = fmax(best, either(a, b, n));
            }
        }
    for (int i = 0; i < counts[0] && !planar; i++)
        for (int j = 0; j < counts[1]; j++) {
            cross(n, edges[0][i], edges[1][j]);
            best = fmax(best, either(a, b, n));
        }
    return best;
}

/* ---- tests ---- */

static double least_gap(const perp__point *points, int32_t count)
{
    double least = INFINITY;
    for (int32_t i = 0; i < count; i++)
        least = fmin(least, points[i].gap);
    return least;
}

/* Unit normals, no gap less than what the shapes are apart along them, no feature twice. */
static void require_points(const body *a, const body *b, const perp__point *points, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        const perp__point *p = &points[i];
        assert_true(fabs(scene_dot(p->normal, p->normal) - 1.0) < 1e-12);
        assert_true(along(a, b, p->normal) - a->geometry.radius - b->geometry.radius <=
                    p->gap + 1e-9);
        for (int32_t j = 0; j < i; j++)
            assert_int_not_equal(points[j].feature, p->feature);
    }
}

static void try_pair(body *a, body *b, int planar, int *overlaps)
{
    perp__point points[PERP__MAX_POINTS];
    const double radius = a->geometry.radius + b->geometry.radius;
    /* balls and segments in space overlap by all there is between their closest points */
    const int has_width = a->count > 2 || b->count > 2 || (planar && a->count + b->count > 2);
    const double apart = distance(a, b), across = separation(a, b, planar);
    const int32_t count = perp__collide(&a->placed, &b->placed, planar, INFINITY, points);
    const double gap = least_gap(points, count);
    assert_true(count > 0);
    require_points(a, b, points, count);
    if (has_width && across <= 0.0) {
        (*overlaps)++;
        if (fabs(gap - (across - radius)) > NEAR)
            fail_msg("kinds %d and %d%s overlap %.12g, expected %.12g", (int)a->geometry.kind,
                     (int)b->geometry.kind, planar ? " planar" : "", gap, across - radius);
    } else if (radius > 0.0) {
        if (fabs(gap - (apart - radius)) > NEAR)
            fail_msg("kinds %d and %d%s gap %.12g, expected %.12g; %.12g", (int)a->geometry.kind,
                     (int)b->geometry.kind, planar ? " planar" : "", gap, apart - radius, across);
    } else if (!(gap >= across - NEAR)) {
        fail_msg("gap %.12g, expected at least %.12g", gap, across);
    }
}

static void try_kinds(int32_t kind_a, int32_t kind_b, int planar)
{
    uint64_t state = 977 + 31 * (uint64_t)kind_a + 7 * (uint64_t)kind_b + (uint64_t)planar;
    int overlaps = 0;
    for (int trial = 0; trial < TRIALS; trial++) {
        body a, b;
        double by[3] = {scene_uniform(&state, -1.0, 1.0), scene_uniform(&state, -1.0, 1.0), 0.0};
        random_body(&a, &state, planar, kind_a);
        random_body(&b, &state, planar, kind_b);
        move(&b, by);
        try_pair(&a, &b, planar, &overlaps);
        release(&a);
        release(&b);
    }
    if (kind_a > PERP__SPHERE && kind_b == PERP__HULL)
        assert_true(overlaps > TRIALS / 20);
}

static void test_pairs_against_brute_force(void **unused)
{
    (void)unused;
    for (int planar = 0; planar < 2; planar++)
        for (int32_t kind_a = PERP__BOX; kind_a <= PERP__HULL; kind_a++)
            for (int32_t kind_b = PERP__CAPSULE; kind_b <= PERP__HULL; kind_b++)
                try_kinds(kind_a, kind_b, planar);
}

/* A boat on its keel: the face that lies most against the floor is that of the stern, and higher
 * than the keel's end. */
static void test_keel(void **unused)
{
    static const double boat[CORNERS][3] = {
        {1.0, 0.0, -1.0},  {-1.0, 0.0, -0.8},  {1.0, 0.15, 0.0},  {1.0, -0.15, 0.0},
        {-1.0, 0.15, 0.0}, {-1.0, -0.15, 0.0}, {-1.5, 0.1, -0.5}, {-1.5, -0.1, -0.5}};
    uint64_t state = 3;
    int overlaps = 0;
    (void)unused;
    for (int trial = 0; trial < 20; trial++) {
        body floor, hull;
        random_body(&floor, &state, 0, PERP__BOX);
        floor.geometry.half_extents[0] = floor.geometry.half_extents[1] = 3.0;
        floor.placed = scene_place(&floor.geometry, 0.0, 0.0, -floor.geometry.half_extents[2]);
        for (int i = 0; i < floor.count; i++)
            for (int k = 0; k < 3; k++)
                floor.corner[i][k] = floor.placed.position[k] +
                                     (i >> k & 1 ? 1.0 : -1.0) * floor.geometry.half_extents[k];
        memset(&hull, 0, sizeof hull);
        hull.count = CORNERS;
        hull.geometry.kind = PERP__HULL;
        make_hull(&hull, boat, 0);
        hull.placed = scene_place(&hull.geometry, 0.0, 0.0, 0.0);
        const double by[3] = {scene_uniform(&state, -1.0, 1.0), 0.0, -0.05 - hull.corner[0][2]};
        move(&hull, by);
        try_pair(&floor, &hull, 0, &overlaps);
        release(&hull);
    }
    assert_int_equal(overlaps, 20);
}

/* Every point of one set has its like in the other, whose normals are `sign` times these, seen
 * after R x + t. */
static void require_same(const perp__point *x, int32_t x_count, const perp__point *y,
                         int32_t y_count, double sign, const double *R, const double *t)
{
    assert_int_equal(x_count, y_count);
    for (int32_t i = 0; i < x_count; i++) {
        double position[3], normal[3], nearest = INFINITY;
        scene_rotate(position, R, x[i].position);
        scene_rotate(normal, R, x[i].normal);
        for (int32_t j = 0; j < y_count; j++) {
            double off = fabs(x[i].gap - y[j].gap);
            for (int k = 0; k < 3; k++)
                off = fmax(off, fmax(fabs(position[k] + t[k] - y[j].position[k]),
                                     fabs(normal[k] - sign * y[j].normal[k])));
            nearest = fmin(nearest, off);
        }
        if (nearest > 1e-8) /* rounding over the angle between edges that nearly are parallel */
            fail_msg("point %d has no like within %g", (int)i, nearest);
    }
}

static void test_order_and_frame(void **unused)
{
    static const double still[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    static const double none[3] = {0.0, 0.0, 0.0};
    uint64_t state = 5;
    (void)unused;
    for (int trial = 0; trial < 2000; trial++) {
        perp__point points[2][PERP__MAX_POINTS];
        body pair[2];
        double R[9], t[3];
        int32_t count, other;
        for (int i = 0; i < 2; i++)
            random_body(&pair[i], &state, 0, PERP__CAPSULE + (trial >> i & 1));
        count = perp__collide(&pair[0].placed, &pair[1].placed, 0, 0.5, points[0]);
        other = perp__collide(&pair[1].placed, &pair[0].placed, 0, 0.5, points[1]);
        require_same(points[0], count, points[1], other, -1.0, still, none);
        scene_random_rotation(&state, R);
        for (int k = 0; k < 3; k++)
            t[k] = scene_uniform(&state, -1.0, 1.0);
        for (int i = 0; i < 2; i++) {
            perp__placed *placed = &pair[i].placed, turned = *placed;
            scene_rotate(turned.position, R, placed->position);
            for (int k = 0; k < 3; k++) {
                turned.position[k] += t[k];
                for (int j = 0; j < 3; j++)
                    turned.rotation[3 * k + j] = R[3 * k] * placed->rotation[j] +
                                                 R[3 * k + 1] * placed->rotation[3 + j] +
                                                 R[3 * k + 2] * placed->rotation[6 + j];
            }
            *placed = turned;
        }
        other = perp__collide(&pair[0].placed, &pair[1].placed, 0, 0.5, points[1]);
        require_same(points[0], count, points[1], other, 1.0, R, t);
        release(&pair[0]);
        release(&pair[1]);
    }
}

/* A hull of a box's corners touches as the box does: boxes have their own code. */
static void test_hull_of_a_box(void **unused)
{
    uint64_t state = 11;
    int compared = 0;
    (void)unused;
    for (int trial = 0; trial < 2000; trial++) {
        perp__point points[2][PERP__MAX_POINTS];
        const int planar = trial & 1, dimension = planar ? 2 : 3;
        body box, other, hull;
        double local[CORNERS][3] = {{0.0}};
        random_body(&box, &state, planar, PERP__BOX);
        random_body(&other, &state, planar, PERP__BOX);
        hull = box;
        hull.geometry.kind = PERP__HULL;
        for (int i = 0; i < box.count; i++)
            for (int k = 0; k < dimension; k++)
                local[i][k] = (i >> k & 1 ? 1.0 : -1.0) * box.geometry.half_extents[k];
        make_hull(&hull, (const double(*)[3])local, planar);
        hull.placed.geometry = &hull.geometry;
        const int32_t count = perp__collide(&box.placed, &other.placed, planar, 0.0, points[0]);
        const int32_t like = perp__collide(&hull.placed, &other.placed, planar, 0.0, points[1]);
        assert_int_equal(count > 0, like > 0);
        if (count > 0) {
            compared++;
            assert_true(fabs(least_gap(points[0], count) - least_gap(points[1], like)) < NEAR);
        }
        release(&hull);
    }
    assert_true(compared > 1000);
}

static perp__moving moving(const body *b, const double *way)
{
    perp__moving m;
    memset(&m, 0, sizeof m);
    m.start = &b->placed;
    memcpy(m.centre, b->placed.position, sizeof m.centre);
    memcpy(m.displacement, way, sizeof m.displacement);
    m.reach = 2.5;
    return m;
}

/* Shapes that are apart and go straight meet when their distance is 0, and not before; where they
 * never meet the distance stays above 0. */
static void try_meeting(body *a, body *b, int planar, uint64_t *state, int *met)
{
    const double radius = a->geometry.radius + b->geometry.radius;
    const double back[3] = {4.0, 0.0, 0.0};
    const perp__touch_tolerance near = {1e-9, 1e-12, 1e-13};
    perp__collision collision;
    double way[3] = {-8.0, scene_uniform(state, -2.0, 2.0), scene_uniform(state, -2.0, 2.0)};
    if (planar)
        way[2] = 0.0;
    move(b, back);
    if (distance(a, b) - radius < 1e-3)
        return;
    const perp__moving from = moving(a, (const double[3]){0.0, 0.0, 0.0}), to = moving(b, way);
    const int32_t meets = perp__find_collision(&from, &to, planar, &near, &collision) > 0;
    const double end = meets ? collision.time : 1.0;
    double last = 0.0;
    *met += meets;
    for (int i = 0; i <= 16; i++) { /* up to the collision, or all the way */
        const double t = end * i / 16.0;
        double by[3];
        for (int k = 0; k < 3; k++)
            by[k] = (t - last) * way[k];
        move(b, by);
        last = t;
        if (i < 16 || !meets)
            assert_true(separation(a, b, planar) > 0.0 || radius > 0.0);
        if (i < 16 || !meets)
            assert_true(distance(a, b) - radius > 0.0);
    }
    if (meets && fabs(distance(a, b) - radius) > NEAR)
        fail_msg("kinds %d and %d: %g apart when they meet", (int)a->geometry.kind,
                 (int)b->geometry.kind, distance(a, b) - radius);
}

static void test_meetings(void **unused)
{
    uint64_t state = 23;
    int met = 0, tried = 0;
    (void)unused;
    for (int planar = 0; planar < 2; planar++)
        for (int32_t kind_a = PERP__BOX; kind_a <= PERP__HULL; kind_a++)
            for (int32_t kind_b = PERP__CAPSULE; kind_b <= PERP__HULL; kind_b++)
                for (int trial = 0; trial < 40; trial++, tried++) {
                    body a, b;
                    random_body(&a, &state, planar, kind_a);
                    random_body(&b, &state, planar, kind_b);
                    try_meeting(&a, &b, planar, &state, &met);
                    release(&a);
                    release(&b);
                }
    assert_true(met > tried / 4 && met < tried);
}

static int open_context(void **unused)
{
    (void)unused;
    return perp_context_create(&context, NULL) != PERP_OK;
}

static int close_context(void **unused)
{
    (void)unused;
    perp_context_destroy(context);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pairs_against_brute_force),
        cmocka_unit_test(test_keel),
        cmocka_unit_test(test_order_and_frame),
        cmocka_unit_test(test_hull_of_a_box),
        cmocka_unit_test(test_meetings),
    };
    return cmocka_run_group_tests(tests, open_context, close_context);
}
