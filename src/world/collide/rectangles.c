/* Two rectangles in a planar world.
 *
 * Separating axes are the normals of both rectangles' sides; the one along which they are farthest
 * apart, or overlap least, is the contact's normal. The opposite side of the other rectangle, cut
 * to the width of the reference side, gives up to two points. */
#include "world/collide/box.h"
#include "linalg/spatial.h"

/* Features: side and incident side of either reference, and which end; and one for the closest
 * points, which come alone. */
enum { FEATURES_A_REFERENCE = 4 * 4 * 2, FEATURE_CLOSEST = 2 * FEATURES_A_REFERENCE };

/* (|c_i| - h_i) - sum_j |axes_ij| h_j, the larger of the reference's two axes. */
static double best_side(const perp__box_pair *pair, perp__box_face *face)
{
    double best = -INFINITY;
    for (int i = 0; i < 2; i++) {
        const double *row = pair->axes + 3 * i, *half = pair->incident_half;
        double separation = (fabs(pair->centre[i]) - pair->half[i]) -
                            (fabs(row[0]) * half[0] + fabs(row[1]) * half[1]);
        if (separation > best) {
            best = separation;
            face->axis = i;
            face->sign = pair->centre[i] < 0.0 ? -1.0 : 1.0;
        }
    }
    return best;
}

/* The ends of the incident side; returns its number, 0 .. 3. */
static int32_t incident_side(const perp__box_pair *pair, const perp__box_face *face,
                             double ends[2][3])
{
    const double *along = pair->axes + 3 * face->axis;
    int j = fabs(along[1]) > fabs(along[0]) ? 1 : 0;
    double sign = face->sign * along[j] > 0.0 ? -1.0 : 1.0;
    double normal[3], tangent[3];
    perp__column3(normal, pair->axes, j);
    perp__column3(tangent, pair->axes, 1 - j);
    for (int e = 0; e < 2; e++) {
        perp__along3(ends[e], pair->centre, sign * pair->incident_half[j], normal);
        perp__along3(ends[e], ends[e], (e ? 1.0 : -1.0) * pair->incident_half[1 - j], tangent);
    }
    return 2 * j + (sign > 0.0);
}

/* Cuts the segment to |x[axis]| <= half. An end on the cut stays as it is. Returns 0 if nothing is
 * left. */
static int cut_to_width(double ends[2][3], int axis, double half, double tolerance)
{
    for (int side = 0; side < 2; side++) {
        double sign = side ? 1.0 : -1.0;
        double beyond[2] = {sign * ends[0][axis] - half, sign * ends[1][axis] - half};
        if (beyond[0] > tolerance && beyond[1] > tolerance)
            return 0;
        for (int e = 0; e < 2; e++) {
            if (beyond[e] <= tolerance)
                continue;
            const double *kept = ends[1 - e];
            double part = fmin(beyond[1 - e], 0.0) / (fmin(beyond[1 - e], 0.0) - beyond[e]);
            for (int k = 0; k < 2; k++)
                ends[e][k] = kept[k] + part * (ends[e][k] - kept[k]);
            if (beyond[1 - e] < 0.0)
                ends[e][axis] = sign * half;
        }
    }
    return 1;
}

/* The points of the incident side over the reference side `face`. */
static int32_t side_points(const perp__box_pair *pair, const perp__box_face *face, double margin,
                           perp__point *points)
{
    double ends[2][3];
    int across = 1 - face->axis;
    double tolerance = PERP__BOX_ON_FACE * pair->size;
    int32_t incident = incident_side(pair, face, ends);
    if (!cut_to_width(ends, across, pair->half[across], tolerance))
        return 0;

    /* an end on the very corner of the reference side is the whole of what is left of the side */
    int whole = fabs(ends[0][across] - ends[1][across]) <= tolerance ? 1 : 2;
    double normal[3] = {0.0, 0.0, 0.0};
    normal[face->axis] = face->sign;
    int32_t reference = 2 * face->axis + (face->sign > 0.0), count = 0;
    for (int e = 0; e < whole; e++) {
        double gap = face->sign * ends[e][face->axis] - pair->half[face->axis];
        if (!(gap <= margin))
            continue;
        double position[3];
        perp__along3(position, ends[e], -0.5 * gap, normal);
        perp__emit_point(pair->reference, position, normal, gap, (4 * reference + incident) * 2 + e,
                         &points[count++]);
    }
    return count;
}

/* The points over one side; `second` tells that the reference is the pair's second rectangle. */
static int32_t points_from(const perp__box_pair *pair, const perp__box_face *face, int second,
                           double margin, perp__point *points)
{
    int32_t count = side_points(pair, face, margin, points);
    if (count == 0) {
        /* corner against corner */
        double normal[3] = {0.0, 0.0, 0.0};
        normal[face->axis] = face->sign;
        count = perp__box_pair_closest(pair, 1, margin, normal, FEATURE_CLOSEST, points);
    }
    if (!second)
        return count;
    perp__turn_points(count, points);
    for (int32_t q = 0; q < count; q++)
        if (points[q].feature < FEATURE_CLOSEST)
            points[q].feature += FEATURES_A_REFERENCE;
    return count;
}

/* first is the preferred reference */
static int32_t collide_sorted(const perp__placed *first, const perp__placed *second, double margin,
                              perp__point *points)
{
    perp__box_pair from[2];
    perp__box_face face[2];
    perp__box_pair_set(&from[0], first, second);
    perp__box_pair_set(&from[1], second, first);
    double separation = best_side(&from[0], &face[0]), other = best_side(&from[1], &face[1]);
    int reference = other > separation + PERP__BOX_BIAS * from[0].size;
    if (fmax(separation, other) > margin)
        return 0;

    return points_from(&from[reference], &face[reference], reference, margin, points);
}

int32_t perp__collide_rectangles(const perp__placed *a, const perp__placed *b, double margin,
                                 perp__point *points)
{
    if (!perp__box_is_smaller(a, b))
        return collide_sorted(a, b, margin, points);
    int32_t count = collide_sorted(b, a, margin, points);
    perp__turn_points(count, points);
    return count;
}

int32_t perp__collide_rectangles_along(const perp__placed *a, const perp__placed *b, int32_t axis,
                                       perp__point *points)
{
    int swapped = perp__box_is_smaller(a, b);
    int second = (axis >= 2) != swapped; /* of the sorted pair */
    const perp__placed *reference = axis >= 2 ? b : a, *incident = axis >= 2 ? a : b;
    perp__box_pair pair;
    perp__box_pair_set(&pair, reference, incident);
    perp__box_face face = {axis % 2, pair.centre[axis % 2] < 0.0 ? -1.0 : 1.0};
    int32_t count = points_from(&pair, &face, second, INFINITY, points);
    if (swapped)
        perp__turn_points(count, points);
    return count;
}
