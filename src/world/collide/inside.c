/* Points inside of a shape, and just before its faces. */
#include "world/collide/convex.h"

#include "linalg/spatial.h"

int32_t perp__holds(const perp__placed *shape, const double *point, double depth)
{
    const perp__geometry *geometry = shape->geometry;
    double between[3], local[3];
    perp__subtract3(between, point, shape->position);
    if (geometry->kind == PERP__SPHERE)
        return perp__length3(between) < geometry->radius - depth;
    perp__apply_transposed3(local, shape->rotation, between);
    if (geometry->kind == PERP__PLANE)
        return perp__dot3(geometry->normal, local) < geometry->offset - depth;
    if (geometry->kind == PERP__CAPSULE) {
        local[0] -= fmin(fmax(local[0], -geometry->half_extents[0]), geometry->half_extents[0]);
        return perp__length3(local) < geometry->radius - depth;
    }
    if (geometry->kind == PERP__BOX) {
        for (int k = 0; k < 3; k++)
            if (fabs(local[k]) > fmax(geometry->half_extents[k] - depth, 0.0))
                return 0;
        return 1;
    }
    const perp__polytope *hull = &geometry->hull->polytope;
    for (int32_t f = 0; f < hull->faces; f++)
        if (perp__dot3(hull->normal + 3 * f, local) > hull->offset[f] - depth)
            return 0;
    return 1;
}

int32_t perp__probe_faces(const perp__placed *shape, const perp__footing *at, double probes[][3],
                          double normals[][3])
{
    const perp__geometry *geometry = shape->geometry;
    const int32_t boxed = geometry->kind == PERP__BOX;
    const double *half = geometry->half_extents;
    perp__polytope_room room;
    perp__polytope polytope;
    double between[3], local[3], out[3], probe[3];
    int32_t faces[PERP__MAX_PROBES], count = 0;
    if (!boxed && geometry->kind != PERP__HULL)
        return 0;
    perp__subtract3(between, at->position, shape->position);
    perp__apply_transposed3(local, shape->rotation, between);
    perp__apply_transposed3(out, shape->rotation, at->normal);

    /* 1. the faces within the rim of the point that make the normal */
    perp__polytope_of(geometry, at->planar, &room, &polytope);
    for (int32_t f = 0; f < polytope.faces && count < PERP__MAX_PROBES; f++)
        if (perp__dot3(polytope.normal + 3 * f, out) > PERP__PARALLEL &&
            perp__dot3(polytope.normal + 3 * f, local) > polytope.offset[f] - at->rim)
            faces[count++] = f;
    if (count < at->least)
        count = 0;

    /* 2. the point before each; before that of a box, not beside it either */
    for (int32_t i = 0; i < count; i++) {
        const int32_t f = faces[i];
        const double *n = polytope.normal + 3 * f;
        for (int k = 0; k < 3 && boxed; k++) {
            const double most = fmax(half[k] - at->crack, 0.0);
            probe[k] = fmin(fmax(local[k], -most), most);
        }
        if (boxed)
            probe[f / 2] = f % 2 ? half[f / 2] + at->crack : -half[f / 2] - at->crack;
        else
            perp__along3(probe, local, polytope.offset[f] + at->crack - perp__dot3(n, local), n);
        perp__apply3(normals[i], shape->rotation, n);
        perp__apply3(between, shape->rotation, probe);
        perp__along3(probes[i], shape->position, 1.0, between);
    }
    return count;
}
