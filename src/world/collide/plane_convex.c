/* A half-space and any convex shape but a box: every corner of its core is a point of its own. */
#include "world/collide/polytope.h"

#include "linalg/spatial.h"

/* Keeps the points of least gap, in the order of corners; returns how many there are. */
static int32_t keep(perp__point *points, int32_t count, const perp__point *point)
{
    int32_t worst = 0;
    if (count < PERP__MAX_POINTS) {
        points[count] = *point;
        return count + 1;
    }
    for (int32_t i = 1; i < count; i++)
        if (points[i].gap >= points[worst].gap)
            worst = i;
    if (!(point->gap < points[worst].gap))
        return count;
    for (int32_t i = worst; i + 1 < count; i++)
        points[i] = points[i + 1];
    points[count - 1] = *point;
    return count;
}

int32_t perp__collide_plane_convex(const perp__placed *plane, const perp__placed *convex,
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
        count = keep(points, count, &point);
    }
    return count;
}
