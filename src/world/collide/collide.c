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

/* Every corner of a shape's core is a point of its own: it rests on those that touch; of too many
 * those of least gap, in the order of corners. Gaps are sums over the axes of the shape's frame: of
 * a box that lies flat those of two axes are 0, so that its four corners have the same gap to the
 * last bit, which heights of corners in the world would not. */
static int32_t collide_plane(const perp__placed *plane, const perp__placed *convex, int32_t planar,
                             double margin, perp__point *points)
{
    double normal[3], local[3], down[3], between[3];
    perp__polytope_room room;
    perp__polytope polytope;
    int32_t count = 0;
    perp__apply3(normal, plane->rotation, plane->geometry->normal);
    perp__apply_transposed3(local, convex->rotation, normal);
    perp__subtract3(between, convex->position, plane->position);
    const double centre = perp__dot3(normal, between) - plane->geometry->offset;
    for (int k = 0; k < 3; k++)
        down[k] = -local[k];
    if (centre - perp__reach_of(convex->geometry, down) > margin)
        return 0;
    perp__polytope_of(convex->geometry, planar, &room, &polytope);
    for (int32_t c = 0; c < polytope.corners; c++) {
        const double *at = polytope.corner + 3 * c;
        perp__point point;
        point.gap =
            ((centre + at[0] * local[0]) + at[1] * local[1]) + at[2] * local[2] - polytope.radius;
        if (!(point.gap <= margin))
            continue;
        perp__apply3(point.position, convex->rotation, at);
        perp__add3(point.position, -(polytope.radius + 0.5 * point.gap), normal);
        perp__add3(point.position, 1.0, convex->position);
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

/* The point of a ball and a box or a ball along an axis by its number, or where there is none such
 * along that which separates most. */
static bool collide_ball(const perp__placed *a, const perp__placed *b, int32_t planar,
                         int32_t number, double margin, perp__point *points)
{
    const bool turns = b->geometry->kind != PERP__SPHERE;
    const perp__placed *ball = turns ? a : b;
    perp__axes axes;
    perp__ball_axes(a, b, planar, &axes);
    const perp__axis *closest = &axes.axis[axes.count - 1], *best = closest;
    for (int32_t k = axes.count - 1; k-- > 0 && closest->separation == -INFINITY;)
        best = axes.axis[k].separation > best->separation ? &axes.axis[k] : best;
    for (int32_t k = 0; k < axes.count; k++)
        if (axes.axis[k].number == number && axes.axis[k].separation > -INFINITY)
            best = &axes.axis[k];
    if (!(best->separation <= margin))
        return 0;
    points->gap = best->separation;
    points->feature = 0;
    perp__subtract3(points->normal, b->position, a->position);
    if (axes.count > 1 || perp__is_zero3(points->normal)) /* else a frame would but round it */
        perp__apply3(points->normal, a->rotation, best->normal);
    else
        perp__normalise3(points->normal);
    perp__along3(points->position, ball->position,
                 (turns ? 1.0 : -1.0) * (ball->geometry->radius + 0.5 * points->gap),
                 points->normal);
    return 1;
}

int32_t perp__collide(const perp__placed *a, const perp__placed *b, int32_t planar, double margin,
                      perp__point *points)
{
    const bool boxes = a->geometry->kind == PERP__BOX && b->geometry->kind == PERP__BOX;
    const int32_t swapped = boxes ? perp__box_is_smaller(a, b) /* the larger is the reference */
                                  : a->geometry->kind > b->geometry->kind;
    const perp__placed *first = swapped ? b : a, *second = swapped ? a : b;
    const int32_t kind = first->geometry->kind, other = second->geometry->kind;
    int32_t count = 0;
    if (other == PERP__PLANE)
        count = 0;
    else if (kind == PERP__PLANE)
        count = collide_plane(first, second, planar, margin, points);
    else if (perp__is_ball_pair(first, second))
        count = collide_ball(first, second, planar, PERP__NO_AXIS, margin, points);
    else
        count = perp__collide_convex(first, second, planar, margin, points);

    if (swapped) /* positions and features belong to the pair, only the normal knows which is A */
        turn_points(count, points);
    return count;
}

int32_t perp__collide_along(const perp__placed *a, const perp__placed *b, int32_t planar,
                            int32_t axis, perp__point *points)
{
    const bool swapped = perp__are_boxes(a, b, planar) && perp__box_is_smaller(a, b);
    perp__convex_pair pair;
    if (a->geometry->kind == PERP__PLANE || b->geometry->kind == PERP__PLANE)
        return perp__collide(a, b, planar, INFINITY, points);
    if (perp__is_ball_pair(a, b))
        return collide_ball(a, b, planar, axis, INFINITY, points);
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
