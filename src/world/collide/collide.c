/* Which file answers for which pair of shapes, and the extents of a shape. */
#include "world/collide/collide.h"

#include <float.h>

#include "world/collide/meeting.h"
#include "linalg/spatial.h"

/* kind of a <= kind of b */
static int32_t collide_sorted(const perp__placed *a, const perp__placed *b, int32_t planar,
                              double margin, perp__point *points)
{
    int32_t second = b->geometry->kind;
    switch (a->geometry->kind) {
    case PERP__PLANE:
        if (second == PERP__BOX)
            return perp__collide_plane_box(a, b, planar, margin, points);
        if (second == PERP__SPHERE)
            return perp__collide_plane_sphere(a, b, margin, points);
        return 0;
    case PERP__BOX:
        if (second == PERP__SPHERE)
            return perp__collide_box_sphere(a, b, planar, margin, points);
        if (planar)
            return perp__collide_rectangles(a, b, margin, points);
        return perp__collide_box_box(a, b, margin, points);
    default:
        return perp__collide_sphere_sphere(a, b, planar, margin, points);
    }
}

int32_t perp__collide(const perp__placed *a, const perp__placed *b, int32_t planar, double margin,
                      perp__point *points)
{
    if (a->geometry->kind <= b->geometry->kind)
        return collide_sorted(a, b, planar, margin, points);

    /* positions and features belong to the pair, only the normal knows which one is A */
    int32_t count = collide_sorted(b, a, planar, margin, points);
    for (int32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            points[i].normal[k] = -points[i].normal[k];
    return count;
}

int32_t perp__collide_along(const perp__placed *a, const perp__placed *b, int32_t planar,
                            int32_t axis, perp__point *points)
{
    if (a->geometry->kind != PERP__BOX || b->geometry->kind != PERP__BOX)
        return perp__collide(a, b, planar, INFINITY, points);
    return planar ? perp__collide_rectangles_along(a, b, axis, points)
                  : perp__collide_box_box_along(a, b, axis, points);
}

void perp__extent_of(const perp__placed *shape, double margin, perp__bounds *extent)
{
    const perp__geometry *geometry = shape->geometry;
    for (int k = 0; k < 3; k++) {
        double reach = INFINITY;
        if (geometry->kind == PERP__SPHERE) {
            reach = geometry->radius + margin;
        } else if (geometry->kind == PERP__BOX) {
            reach = margin;
            for (int j = 0; j < 3; j++)
                reach += fabs(shape->rotation[3 * k + j]) * geometry->half_extents[j];
        }
        /* a few roundings wider, so that shapes that exactly touch are found */
        if (isfinite(reach))
            reach += 4.0 * DBL_EPSILON * (fabs(shape->position[k]) + reach);
        extent->low[k] = shape->position[k] - reach;
        extent->high[k] = shape->position[k] + reach;
    }
}
