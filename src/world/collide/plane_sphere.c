/* A half-space and a sphere; in planar worlds a half-plane and a disc. */
#include "world/collide/collide.h"
#include "linalg/spatial.h"

int32_t perp__collide_plane_sphere(const perp__placed *plane, const perp__placed *sphere,
                                   double margin, perp__point *points)
{
    double normal[3], between[3];
    perp__apply3(normal, plane->rotation, plane->geometry->normal);
    perp__subtract3(between, sphere->position, plane->position);

    double radius = sphere->geometry->radius;
    double gap = perp__dot3(normal, between) - plane->geometry->offset - radius;
    if (!(gap <= margin))
        return 0;

    /* the sphere's lowest point is at centre - radius normal, the plane a gap below it */
    perp__along3(points->position, sphere->position, -(radius + 0.5 * gap), normal);
    for (int k = 0; k < 3; k++)
        points->normal[k] = normal[k];
    points->gap = gap;
    points->feature = 0;
    return 1;
}
