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

/* The faces of a box or a hull within `rim` of the point `local` that make the normal `out`. */
static int32_t faces_of_box(const double *half, int dimension, const double *local,
                            const double *out, double rim, int32_t *faces)
{
    int32_t count = 0;
    for (int j = 0; j < dimension; j++) {
        const int32_t up = !(out[j] < 0.0);
        if (fabs(out[j]) > SUPPORT && (up ? local[j] : -local[j]) > half[j] - rim)
            faces[count++] = 2 * j + up;
    }
    return count;
}

static int32_t faces_of_hull(const perp__polytope *hull, const double *local, const double *out,
                             double rim, int32_t *faces)
{
    int32_t count = 0;
    for (int32_t f = 0; f < hull->faces && count < PERP__MAX_PROBES; f++)
        if (perp__dot3(hull->normal + 3 * f, out) > SUPPORT &&
            perp__dot3(hull->normal + 3 * f, local) > hull->offset[f] - rim)
            faces[count++] = f;
    return count;
}

/* The point before a face; before that of a box, not beside it either. */
static void probe_box(const double *half, int32_t face, const double *local, double crack,
                      double *probe)
{
    for (int i = 0; i < 3; i++) {
        const double most = fmax(half[i] - crack, 0.0);
        probe[i] = fmin(fmax(local[i], -most), most);
    }
    probe[face / 2] = face % 2 ? half[face / 2] + crack : -half[face / 2] - crack;
}

static void probe_hull(const perp__polytope *hull, int32_t face, const double *local, double crack,
                       double *probe)
{
    const double *n = hull->normal + 3 * face;
    perp__along3(probe, local, hull->offset[face] + crack - perp__dot3(n, local), n);
}

int32_t perp__probe_faces(const perp__placed *shape, const perp__footing *at, double probes[][3])
{
    const perp__geometry *geometry = shape->geometry;
    const int32_t boxed = geometry->kind == PERP__BOX;
    double between[3], local[3], out[3], probe[3];
    int32_t faces[PERP__MAX_PROBES], count;
    if (!boxed && geometry->kind != PERP__HULL)
        return 0;
    perp__subtract3(between, at->position, shape->position);
    perp__apply_transposed3(local, shape->rotation, between);
    perp__apply_transposed3(out, shape->rotation, at->normal);
    if (boxed)
        count =
            faces_of_box(geometry->half_extents, at->planar ? 2 : 3, local, out, at->rim, faces);
    else
        count = faces_of_hull(&geometry->hull->polytope, local, out, at->rim, faces);
    if (count < at->least)
        return 0;
    for (int32_t i = 0; i < count; i++) {
        if (boxed)
            probe_box(geometry->half_extents, faces[i], local, at->crack, probe);
        else
            probe_hull(&geometry->hull->polytope, faces[i], local, at->crack, probe);
        perp__apply3(between, shape->rotation, probe);
        perp__along3(probes[i], shape->position, 1.0, between);
    }
    return count;
}
