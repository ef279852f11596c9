/* A box and a sphere; in planar worlds a rectangle and a disc. */
#include "world/collide/collide.h"
#include "linalg/spatial.h"

/* The face next to a centre inside of the box: the way out is the shortest there. Replaces the
 * centre's coordinate by the face's, writes the normal, returns the centre's depth >= 0. */
static double nearest_face(double *closest, double *normal, const double *half, int dimension)
{
    int nearest = 0;
    for (int j = 1; j < dimension; j++)
        if (half[j] - fabs(closest[j]) < half[nearest] - fabs(closest[nearest]))
            nearest = j;

    double depth = half[nearest] - fabs(closest[nearest]);
    double side = closest[nearest] < 0.0 ? -1.0 : 1.0;
    closest[nearest] = side * half[nearest];
    for (int j = 0; j < 3; j++)
        normal[j] = j == nearest ? side : 0.0;
    return depth;
}

int32_t perp__collide_box_sphere(const perp__placed *box, const perp__placed *sphere,
                                 int32_t planar, double margin, perp__point *points)
{
    int dimension = planar ? 2 : 3;
    const double *half = box->geometry->half_extents;
    double between[3], centre[3], closest[3] = {0.0, 0.0, 0.0}, outward[3] = {0.0, 0.0, 0.0};
    perp__subtract3(between, sphere->position, box->position);
    perp__apply_transposed3(centre, box->rotation, between);

    /* the point of the box next to the sphere's centre, in the frame of the box */
    for (int j = 0; j < dimension; j++) {
        closest[j] = fmin(fmax(centre[j], -half[j]), half[j]);
        outward[j] = centre[j] - closest[j];
    }
    double distance = perp__normalise3(outward);
    if (distance == 0.0)
        distance = -nearest_face(closest, outward, half, dimension);

    double gap = distance - sphere->geometry->radius;
    if (!(gap <= margin))
        return 0;

    perp__apply3(points->normal, box->rotation, outward);
    perp__along3(closest, closest, 0.5 * gap, outward);
    perp__apply3(between, box->rotation, closest);
    perp__along3(points->position, box->position, 1.0, between);
    points->gap = gap;
    points->feature = 0;
    return 1;
}
