/* Two spheres; in planar worlds two discs. */
#include "world/collide/collide.h"
#include "linalg/spatial.h"

int32_t perp__collide_sphere_sphere(const perp__placed *a, const perp__placed *b, int32_t planar,
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
