/* Which function answers for which pair of shapes, balls against balls and boxes, and the extents
 * of a shape. */
#include "world/collide/collide.h"

#include <float.h>

#include "linalg/spatial.h"
#include "world/collide/polytope.h"

void perp__emit_point(const perp__placed *frame, const double *position, const double *normal,
                      double gap, int32_t feature, perp__point *point)
{
    double turned[3];
    perp__apply3(turned, frame->rotation, position);
    perp__along3(point->position, frame->position, 1.0, turned);
    perp__apply3(point->normal, frame->rotation, normal);
    point->gap = gap;
    point->feature = feature;
}

/* ---- a half-space and another shape; in planar worlds a half-plane ---- */

/* Every corner of a box is a point of its own: it rests on those that touch. Bit j of a corner's
 * number tells the side of axis j.
 *
 * With the centre's height c and the heights s_j = h_j normal'axis_j, a corner's gap is
 * c +- s_0 +- s_1 +- s_2. A box that lies flat has two s_j = 0, so that its four corners have the
 * same gap to the last bit, and exactly 0 where c = s_j; heights of corner coordinates would not
 * cancel so. */
static inline int32_t collide_plane_box(const perp__placed *plane, const perp__placed *box,
                                        int dimension, double margin, perp__point *points)
{
    double normal[3], between[3];
    perp__apply3(normal, plane->rotation, plane->geometry->normal);
    perp__subtract3(between, box->position, plane->position);
    double centre = perp__dot3(normal, between) - plane->geometry->offset;

    const double *half = box->geometry->half_extents;
    double axis[3][3], height[3];
    for (int j = 0; j < dimension; j++) {
        perp__column3(axis[j], box->rotation, j);
        height[j] = half[j] * perp__dot3(normal, axis[j]);
    }

    /* the least gap: sums of the same terms in the same order, each the smaller one */
    double least = centre;
    for (int j = 0; j < dimension; j++)
        least -= fabs(height[j]);
    if (least > margin)
        return 0;

    int32_t count = 0;
    for (int32_t corner = 0; corner < 1 << dimension; corner++) {
        double gap = centre;
        double position[3] = {0.0, 0.0, 0.0};
        for (int j = 0; j < dimension; j++)
            gap += corner >> j & 1 ? height[j] : -height[j];
        if (!(gap <= margin))
            continue;
        for (int j = 0; j < dimension; j++)
            perp__along3(position, position, corner >> j & 1 ? half[j] : -half[j], axis[j]);
        perp__point *point = &points[count++];
        perp__along3(position, position, -0.5 * gap, normal);
        perp__along3(point->position, box->position, 1.0, position);
        perp__copy3(point->normal, normal);
        point->gap = gap;
        point->feature = corner;
    }
    return count;
}

/* Every corner of the core of any other convex shape is a point of its own; of too many those of
 * least gap, in the order of corners. */
static int32_t collide_plane_convex(const perp__placed *plane, const perp__placed *convex,
                                    int32_t planar, double margin, perp__point *points)
{
    double normal[3], between[3];
    perp__polytope_room room;
    perp__polytope polytope;
    int32_t count = 0;
    perp__apply3(normal, plane->rotation, plane->geometry->normal);
    perp__subtract3(between, convex->position, plane->position);
    perp__polytope_of(convex->geometry, planar, &room, &polytope);
    double centre = perp__dot3(normal, between);
    for (int32_t c = 0; c < polytope.corners; c++) {
        perp__point point;
        double corner[3];
        perp__apply3(corner, convex->rotation, polytope.corner + 3 * c);
        point.gap =
            (centre + perp__dot3(normal, corner)) - plane->geometry->offset - polytope.radius;
        if (!(point.gap <= margin))
            continue;
        perp__add3(corner, -(polytope.radius + 0.5 * point.gap), normal);
        perp__along3(point.position, convex->position, 1.0, corner);
        perp__copy3(point.normal, normal);
        point.feature = c;
        if (count == PERP__MAX_POINTS) {
            int32_t worst = 0;
            for (int32_t i = 1; i < count; i++)
                if (points[i].gap >= points[worst].gap)
                    worst = i;
            if (!(point.gap < points[worst].gap))
                continue;
            for (count--; worst < count; worst++)
                points[worst] = points[worst + 1];
        }
        points[count++] = point;
    }
    return count;
}

/* ---- balls ---- */

/* Turns the normals: from B to A. */
static void turn_points(int32_t count, perp__point *points)
{
    for (int32_t q = 0; q < count; q++)
        for (int k = 0; k < 3; k++)
            points[q].normal[k] = -points[q].normal[k];
}

/* Two spheres; in planar worlds two discs. */
static int32_t collide_balls(const perp__placed *a, const perp__placed *b, int32_t planar,
                             double margin, perp__point *points)
{
    double normal[3];
    perp__subtract3(normal, b->position, a->position);
    if (planar)
        normal[2] = 0.0;
    double distance = perp__normalise3(normal);

    /* concentric spheres part along an axis of the first, which lies in a planar world's plane */
    if (distance == 0.0)
        perp__column3(normal, a->rotation, 0);

    double radius = a->geometry->radius;
    double gap = distance - radius - b->geometry->radius;
    if (!(gap <= margin))
        return 0;

    perp__along3(points->position, a->position, radius + 0.5 * gap, normal);
    perp__copy3(points->normal, normal);
    points->gap = gap;
    points->feature = 0;
    return 1;
}

/* A box and a sphere; in planar worlds a rectangle and a disc. */
static int32_t collide_box_ball(const perp__placed *box, const perp__placed *ball, int32_t planar,
                                double margin, perp__point *points)
{
    const int dimension = planar ? 2 : 3;
    const double *half = box->geometry->half_extents;
    double between[3], centre[3], closest[3] = {0.0, 0.0, 0.0}, outward[3] = {0.0, 0.0, 0.0};
    perp__subtract3(between, ball->position, box->position);
    perp__apply_transposed3(centre, box->rotation, between);

    /* 1. the point of the box next to the ball's centre, in the frame of the box */
    for (int j = 0; j < dimension; j++) {
        closest[j] = fmin(fmax(centre[j], -half[j]), half[j]);
        outward[j] = centre[j] - closest[j];
    }
    double distance = perp__normalise3(outward);

    /* 2. of a centre inside of the box that of the nearest face: the way out is the shortest there
     */
    if (distance == 0.0) {
        int nearest = 0;
        for (int j = 1; j < dimension; j++)
            if (half[j] - fabs(closest[j]) < half[nearest] - fabs(closest[nearest]))
                nearest = j;
        const double side = closest[nearest] < 0.0 ? -1.0 : 1.0;
        distance = -(half[nearest] - fabs(closest[nearest]));
        closest[nearest] = side * half[nearest];
        for (int j = 0; j < 3; j++)
            outward[j] = j == nearest ? side : 0.0;
    }

    /* 3. the point, midway */
    const double gap = distance - ball->geometry->radius;
    if (!(gap <= margin))
        return 0;
    perp__along3(closest, closest, 0.5 * gap, outward);
    perp__emit_point(box, closest, outward, gap, 0, points);
    return 1;
}

int32_t perp__collide(const perp__placed *a, const perp__placed *b, int32_t planar, double margin,
                      perp__point *points)
{
    const int32_t boxes = a->geometry->kind == PERP__BOX && b->geometry->kind == PERP__BOX;
    const int32_t swapped = boxes ? perp__box_is_smaller(a, b) /* the larger is the reference */
                                  : a->geometry->kind > b->geometry->kind;
    const perp__placed *first = swapped ? b : a, *second = swapped ? a : b;
    const int32_t kind = first->geometry->kind, other = second->geometry->kind;
    int32_t count = 0;
    if (other == PERP__PLANE)
        count = 0;
    else if (kind == PERP__PLANE && other == PERP__BOX)
        count = planar ? collide_plane_box(first, second, 2, margin, points)
                       : collide_plane_box(first, second, 3, margin, points);
    else if (kind == PERP__PLANE)
        count = collide_plane_convex(first, second, planar, margin, points);
    else if (kind == PERP__BOX && other == PERP__SPHERE)
        count = collide_box_ball(first, second, planar, margin, points);
    else if (kind == PERP__SPHERE && other == PERP__SPHERE)
        count = collide_balls(first, second, planar, margin, points);
    else
        count = perp__collide_convex(first, second, planar, margin, points);

    if (swapped) /* positions and features belong to the pair, only the normal knows which is A */
        turn_points(count, points);
    return count;
}

int32_t perp__collide_along(const perp__placed *a, const perp__placed *b, int32_t planar,
                            int32_t axis, perp__point *points)
{
    const int32_t swapped = perp__are_boxes(a, b, planar) && perp__box_is_smaller(a, b);
    perp__convex_pair pair;
    if (a->geometry->kind == PERP__PLANE || b->geometry->kind == PERP__PLANE ||
        perp__is_ball_pair(a, b))
        return perp__collide(a, b, planar, INFINITY, points);
    if (swapped && axis >= 0)
        axis = axis < 6 ? (axis + 3) % 6 : 6 + 3 * (axis % 3) + (axis - 6) / 3;
    perp__convex_pair_set(&pair, swapped ? b : a, swapped ? a : b, planar);
    const int32_t count = perp__convex_points(&pair, axis, INFINITY, points);
    if (swapped)
        turn_points(count, points);
    return count;
}

/* A few roundings wider, so that shapes that exactly touch are found. */
static double widened(double reach, double position)
{
    return reach + 4.0 * DBL_EPSILON * (fabs(position) + fabs(reach));
}

void perp__extent_of(const perp__placed *shape, double margin, perp__bounds *extent)
{
    const perp__geometry *geometry = shape->geometry;
    for (int k = 0; k < 3; k++) {
        const double x = shape->position[k], *row = shape->rotation + 3 * k;
        double up, down; /* how far the shape goes from its centre along the axis */
        if (geometry->kind == PERP__PLANE)
            up = INFINITY;
        else if (geometry->kind == PERP__SPHERE)
            up = geometry->radius;
        else
            up = perp__reach_of(geometry, row);
        down = up;
        if (geometry->kind == PERP__HULL)
            down = perp__reach_of(geometry, (const double[3]){-row[0], -row[1], -row[2]});
        extent->low[k] = x - widened(down + margin, x);
        extent->high[k] = x + widened(up + margin, x);
    }
}
