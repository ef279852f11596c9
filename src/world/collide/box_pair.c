/* What the box pairs share: frames, the point for boxes that meet in edges or corners. */
#include "world/collide/box.h"

#include "world/collide/segment.h"
#include "linalg/spatial.h"

void perp__box_pair_set(perp__box_pair *pair, const perp__placed *reference,
                        const perp__placed *incident)
{
    pair->reference = reference;
    pair->half = reference->geometry->half_extents;
    pair->incident_half = incident->geometry->half_extents;
    for (int j = 0; j < 3; j++) {
        double axis[3], column[3];
        perp__column3(axis, incident->rotation, j);
        perp__apply_transposed3(column, reference->rotation, axis);
        for (int k = 0; k < 3; k++)
            pair->axes[3 * k + j] = column[k];
    }
    double between[3];
    perp__subtract3(between, incident->position, reference->position);
    perp__apply_transposed3(pair->centre, reference->rotation, between);
    pair->size = fmin(perp__largest3(pair->half), perp__largest3(pair->incident_half));
}

int perp__box_is_smaller(const perp__placed *a, const perp__placed *b)
{
    const double *x = a->geometry->half_extents, *y = b->geometry->half_extents;
    return x[0] + x[1] + x[2] < y[0] + y[1] + y[2];
}

int32_t perp__box_pair_closest(const perp__box_pair *pair, int32_t planar, double margin,
                               const double *normal, int32_t feature, perp__point *points)
{
    static const double identity[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    static const double origin[3] = {0.0, 0.0, 0.0};
    perp__box_edges reference = {pair->half, identity, origin};
    perp__box_edges incident = {pair->incident_half, pair->axes, pair->centre};
    double on_reference[3], on_incident[3], direction[3], position[3];
    perp__segment_closest_edges(&reference, &incident, planar, on_reference, on_incident);

    perp__subtract3(direction, on_incident, on_reference);
    double gap = perp__normalise3(direction);
    if (!(gap <= margin))
        return 0;
    for (int k = 0; k < 3; k++)
        position[k] = 0.5 * (on_reference[k] + on_incident[k]);
    if (gap <= PERP__BOX_ON_FACE * pair->size)
        perp__copy3(direction, normal);
    perp__emit_point(pair->reference, position, direction, gap, feature, points);
    return 1;
}
