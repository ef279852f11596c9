/* Which file answers for which pair of shapes, and the extents of a shape. */
#include "world/collide/collide.h"

#include <float.h>

#include "linalg/spatial.h"
#include "world/collide/convex.h"

/* kind of a <= kind of b */
static int32_t collide_sorted(const perp__placed *a, const perp__placed *b, int32_t planar,
                              double margin, perp__point *points)
{
    int32_t second = b->geometry->kind;
    switch (a->geometry->kind) {
    case PERP__PLANE:
        if (second == PERP__BOX)
            return perp__collide_plane_box(a, b, planar, margin, points);
        return second == PERP__PLANE ? 0 : perp__collide_plane_convex(a, b, planar, margin, points);
    case PERP__BOX:
        if (second == PERP__SPHERE)
            return perp__collide_box_sphere(a, b, planar, margin, points);
        if (second == PERP__BOX && planar)
            return perp__collide_rectangles(a, b, margin, points);
        if (second == PERP__BOX)
            return perp__collide_box_box(a, b, margin, points);
        break;
    case PERP__SPHERE:
        if (second == PERP__SPHERE)
            return perp__collide_sphere_sphere(a, b, planar, margin, points);
        break;
    default:
        break;
    }
    return perp__collide_convex(a, b, planar, margin, points);
}

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

void perp__turn_points(int32_t count, perp__point *points)
{
    for (int32_t q = 0; q < count; q++)
        for (int k = 0; k < 3; k++)
            points[q].normal[k] = -points[q].normal[k];
}

int32_t perp__collide(const perp__placed *a, const perp__placed *b, int32_t planar, double margin,
                      perp__point *points)
{
    if (a->geometry->kind <= b->geometry->kind)
        return collide_sorted(a, b, planar, margin, points);

    /* positions and features belong to the pair, only the normal knows which one is A */
    int32_t count = collide_sorted(b, a, planar, margin, points);
    perp__turn_points(count, points);
    return count;
}

/* Balls have no axes but that between the closest points. */
static int32_t has_axes(const perp__placed *a, const perp__placed *b)
{
    const int32_t first = a->geometry->kind, second = b->geometry->kind;
    return first != PERP__PLANE && second != PERP__PLANE &&
           (first > PERP__SPHERE || second > PERP__SPHERE);
}

int32_t perp__collide_along(const perp__placed *a, const perp__placed *b, int32_t planar,
                            int32_t axis, perp__point *points)
{
    if (has_axes(a, b)) {
        perp__convex_pair pair;
        perp__convex_pair_set(&pair, a, b, planar);
        return perp__convex_points(&pair, axis, INFINITY, points);
    }
    if (a->geometry->kind != PERP__BOX || b->geometry->kind != PERP__BOX)
        return perp__collide(a, b, planar, INFINITY, points);
    return planar ? perp__collide_rectangles_along(a, b, axis, points)
                  : perp__collide_box_box_along(a, b, axis, points);
}

/* How far the shape goes from its centre along an axis of the world, up and down. */
static void reach_along(const perp__placed *shape, int k, double *up, double *down)
{
    const perp__geometry *geometry = shape->geometry;
    const double *row = shape->rotation + 3 * k;
    if (geometry->kind == PERP__PLANE)
        *up = INFINITY;
    else if (geometry->kind == PERP__SPHERE)
        *up = geometry->radius;
    else
        *up = perp__reach_of(geometry, row);
    *down = *up;
    if (geometry->kind == PERP__HULL)
        *down = perp__reach_of(geometry, (const double[3]){-row[0], -row[1], -row[2]});
}

/* A few roundings wider, so that shapes that exactly touch are found. */
static double widened(double reach, double position)
{
    return reach + 4.0 * DBL_EPSILON * (fabs(position) + fabs(reach));
}

void perp__extent_of(const perp__placed *shape, double margin, perp__bounds *extent)
{
    for (int k = 0; k < 3; k++) {
        const double x = shape->position[k];
        double up, down;
        reach_along(shape, k, &up, &down);
        extent->low[k] = x - widened(down + margin, x);
        extent->high[k] = x + widened(up + margin, x);
    }
}
