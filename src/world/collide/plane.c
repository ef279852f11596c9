/* A half-space and another shape; in planar worlds a half-plane. */
#include "world/collide/polytope.h"

#include "linalg/spatial.h"

/* Every corner of a box is a point of its own: it rests on those that touch. Bit j of a corner's
 * number tells the side of axis j.
 *
 * With the centre's height c and the heights s_j = h_j normal'axis_j, a corner's gap is
 * c +- s_0 +- s_1 +- s_2. A box that lies flat has two s_j = 0, so that its four corners have the
 * same gap to the last bit, and exactly 0 where c = s_j; heights of corner coordinates would not
 * cancel so. */
static inline int32_t collide(const perp__placed *plane, const perp__placed *box, int dimension,
                              double margin, perp__point *points)
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

int32_t perp__collide_plane_box(const perp__placed *plane, const perp__placed *box, int32_t planar,
                                double margin, perp__point *points)
{
    return planar ? collide(plane, box, 2, margin, points) : collide(plane, box, 3, margin, points);
}

/* Every corner of the core of any other convex shape is a point of its own; of too many those of
 * least gap, in the order of corners. */
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
