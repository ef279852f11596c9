/* Points inside of a shape, and just before its faces. */
#include "world/collide/convex.h"

#include "linalg/spatial.h"

/* A normal is made by the faces with whose normals it has more than this in common. */
#define SUPPORT 1e-6

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

/* A face of a box or hull: whether it makes the normal `out` at `local`, and the point before it;
 * of a box not beside the face either. */
static int32_t box_face(const double *half, int j, double sign, const double *local,
                        const double *out, double rim, double crack, double *probe)
{
    for (int i = 0; i < 3; i++) {
        const double most = fmax(half[i] - crack, 0.0);
        probe[i] = fmin(fmax(local[i], -most), most);
    }
    probe[j] = sign * half[j] + sign * crack;
    return sign * out[j] > SUPPORT && sign * local[j] > half[j] - rim;
}

static int32_t hull_face(const perp__polytope *hull, int32_t face, const double *local,
                         const double *out, double rim, double crack, double *probe)
{
    const double *n = hull->normal + 3 * face, height = perp__dot3(n, local);
    perp__along3(probe, local, hull->offset[face] + crack - height, n);
    return perp__dot3(n, out) > SUPPORT && height > hull->offset[face] - rim;
}

int32_t perp__probe_faces(const perp__placed *shape, int32_t planar, const double *position,
                          const double *normal, double rim, double crack, double probes[][3])
{
    const perp__geometry *geometry = shape->geometry;
    const int32_t boxed = geometry->kind == PERP__BOX;
    double between[3], local[3], out[3], probe[3];
    int32_t count = 0, faces = planar ? 4 : 6;
    if (!boxed && geometry->kind != PERP__HULL)
        return 0;
    perp__subtract3(between, position, shape->position);
    perp__apply_transposed3(local, shape->rotation, between);
    perp__apply_transposed3(out, shape->rotation, normal);
    if (!boxed)
        faces = geometry->hull->polytope.faces;
    for (int32_t f = 0; f < faces && count < PERP__MAX_PROBES; f++) {
        const int32_t supports =
            boxed ? box_face(geometry->half_extents, f / 2, f % 2 ? 1.0 : -1.0, local, out, rim,
                             crack, probe)
                  : hull_face(&geometry->hull->polytope, f, local, out, rim, crack, probe);
        if (!supports)
            continue;
        perp__apply3(between, shape->rotation, probe);
        perp__along3(probes[count++], shape->position, 1.0, between);
    }
    return count;
}
