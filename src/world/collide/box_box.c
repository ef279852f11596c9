/* Two boxes in three dimensions.
 *
 * Separating axes (Gottschalk, Lin & Manocha 1996): of the face normals of both boxes and the
 * products of their edges, the one along which the boxes are farthest apart, or overlap least. A
 * face normal gives the polygon in which the faces meet, an edge product the point where two edges
 * cross. */
#include "world/collide/box.h"

#include "world/collide/segment.h"
#include "linalg/spatial.h"

/* Sine of the angle between two edges below which their product is no axis of its own: its
 * direction would be rounding, and the face normals stand in for it to 1e-7 of an edge's length. */
#define PARALLEL 1e-7

/* Angle between the axis of two edges and a face normal below which the faces meet rather than the
 * edges. A box that rests on others tilts by less; its support then is a polygon still. */
#define FLAT 1e-3

/* Features: those of face contacts on either reference, those of a pair of edges, and one for the
 * closest points, which come alone. */
enum {
    FEATURES_A_FACE = 36 * 64,
    FEATURE_EDGES = 2 * FEATURES_A_FACE,
    FEATURE_CLOSEST = FEATURE_EDGES + 12 * 12
};

/* A face axis; `second` tells that the reference is the pair's second box. */
typedef struct face_axis {
    int second;
    perp__box_face face; /* in the frame of that reference */
    double separation;
} face_axis;

typedef struct edge_axis {
    int i, j;         /* axes of first and second */
    double normal[3]; /* frame of the first, from first to second */
    double separation;
} edge_axis;

/* The pair seen from either box. */
typedef struct views {
    perp__box_pair from[2];
} views;

static double dot_axis(const perp__box_pair *pair, const double *x, int j)
{
    return x[0] * pair->axes[j] + x[1] * pair->axes[3 + j] + x[2] * pair->axes[6 + j];
}

/* (|c_i| - h_i) - sum_j |axes_ij| h_j over the reference's axes i. */
static void best_face_of(const perp__box_pair *pair, face_axis *best)
{
    best->separation = -INFINITY;
    for (int i = 0; i < 3; i++) {
        const double *row = pair->axes + 3 * i, *half = pair->incident_half;
        double reach = fabs(row[0]) * half[0] + fabs(row[1]) * half[1] + fabs(row[2]) * half[2];
        double separation = (fabs(pair->centre[i]) - pair->half[i]) - reach;
        if (separation > best->separation) {
            best->separation = separation;
            best->face.axis = i;
            best->face.sign = pair->centre[i] < 0.0 ? -1.0 : 1.0;
        }
    }
}

static void best_face(const views *both, face_axis *best)
{
    face_axis other;
    best_face_of(&both->from[0], best);
    best_face_of(&both->from[1], &other);
    best->second = 0;
    other.second = 1;
    if (other.separation > best->separation + PERP__BOX_BIAS * both->from[0].size)
        *best = other;
}

/* The product of edges i and j. Returns 0 if they are parallel. */
static int edge_product(const perp__box_pair *pair, int i, int j, edge_axis *axis)
{
    int k = (i + 1) % 3, l = (i + 2) % 3;
    double length = hypot(pair->axes[3 * k + j], pair->axes[3 * l + j]);
    if (length < PARALLEL)
        return 0;
    double *normal = axis->normal;
    normal[i] = 0.0;
    normal[k] = -pair->axes[3 * l + j] / length;
    normal[l] = pair->axes[3 * k + j] / length;
    double along = perp__dot3(normal, pair->centre);
    if (along < 0.0)
        for (int m = 0; m < 3; m++)
            normal[m] = -normal[m];

    double reach = fabs(normal[k]) * pair->half[k] + fabs(normal[l]) * pair->half[l];
    for (int m = 0; m < 3; m++)
        if (m != j)
            reach += fabs(dot_axis(pair, normal, m)) * pair->incident_half[m];
    axis->i = i;
    axis->j = j;
    axis->separation = fabs(along) - reach;
    return 1;
}

static void best_edges(const perp__box_pair *pair, edge_axis *best)
{
    best->separation = -INFINITY;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            edge_axis axis;
            if (edge_product(pair, i, j, &axis) && axis.separation > best->separation)
                *best = axis;
        }
}

/* The face whose normal is within FLAT of the edges' axis; returns 0 if there is none. */
static int flat_face(const perp__box_pair *pair, const edge_axis *edges, face_axis *flat)
{
    double least = 1.0 - 0.5 * FLAT * FLAT;
    int found = 0;
    for (int m = 0; m < 6; m++) {
        double cosine = m < 3 ? edges->normal[m] : -dot_axis(pair, edges->normal, m - 3);
        if (fabs(cosine) <= least)
            continue;
        least = fabs(cosine);
        found = 1;
        flat->second = m >= 3;
        flat->face.axis = m % 3;
        flat->face.sign = cosine < 0.0 ? -1.0 : 1.0;
    }
    return found;
}

/* Points from the second box's faces have normals from second to first. */
static int32_t face_points(const views *both, const face_axis *axis, double margin,
                           perp__point *points)
{
    int32_t count = perp__box_clip(&both->from[axis->second], &axis->face, margin, points);
    if (!axis->second)
        return count;
    perp__turn_points(count, points);
    for (int32_t q = 0; q < count; q++)
        points[q].feature += FEATURES_A_FACE;
    return count;
}

/* The edge of a box along axis j that lies farthest in `direction`. */
static int32_t edge_towards(int j, const double *direction)
{
    return 4 * j + (direction[(j + 1) % 3] > 0.0) + 2 * (direction[(j + 2) % 3] > 0.0);
}

/* The point where two edges cross. Boxes that overlap least along this axis do cross there; apart,
 * the lines may come closest beyond the edges' ends, which is not this point: returns 0. */
static int32_t edge_point(const perp__box_pair *pair, const edge_axis *axis, double margin,
                          perp__point *points)
{
    static const double identity[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    static const double origin[3] = {0.0, 0.0, 0.0};
    double against[3], on_first[3], on_second[3], between[3], position[3];
    for (int m = 0; m < 3; m++)
        against[m] = -dot_axis(pair, axis->normal, m);
    int32_t number_first = edge_towards(axis->i, axis->normal);
    int32_t number_second = edge_towards(axis->j, against);

    perp__segment first, second;
    perp__segment_of_box(&first, pair->half, identity, origin, 0, number_first);
    perp__segment_of_box(&second, pair->incident_half, pair->axes, pair->centre, 0, number_second);
    perp__segment_closest(&first, &second, on_first, on_second);
    double gap = axis->separation;
    if (!(gap <= margin))
        return 0;

    /* between the points lies the gap, along the axis, unless an edge ended before */
    perp__subtract3(between, on_second, on_first);
    perp__along3(between, between, -gap, axis->normal);
    if (gap > 0.0 && perp__largest3(between) > PERP__BOX_ON_FACE * pair->size)
        return 0;
    for (int k = 0; k < 3; k++)
        position[k] = 0.5 * (on_first[k] + on_second[k]);
    perp__emit_point(pair->reference, position, axis->normal, gap,
                     FEATURE_EDGES + 12 * number_first + number_second, points);
    return 1;
}

/* The points of the face that the edges' axis is nearly normal to, noted in *flat; where there is
 * no such face or it has none, the point where the edges cross. */
static int32_t edge_points(const views *both, const edge_axis *axis, face_axis *flat, double margin,
                           perp__point *points)
{
    int32_t count = 0;
    if (flat_face(&both->from[0], axis, flat))
        count = face_points(both, flat, margin, points);
    return count > 0 ? count : edge_point(&both->from[0], axis, margin, points);
}

/* The face's normal in the first box's frame, from first to second. */
static void face_normal(const views *both, const face_axis *axis, double *normal)
{
    for (int k = 0; k < 3; k++)
        normal[k] = k == axis->face.axis ? axis->face.sign : 0.0;
    if (axis->second) {
        perp__column3(normal, both->from[0].axes, axis->face.axis);
        for (int k = 0; k < 3; k++)
            normal[k] *= -axis->face.sign;
    }
}

static int32_t collide_views(const views *both, double margin, perp__point *points)
{
    const perp__box_pair *pair = &both->from[0];
    face_axis face, flat;
    edge_axis edges;
    double normal[3];
    best_face(both, &face);
    best_edges(pair, &edges);
    double separation = fmax(face.separation, edges.separation);
    if (separation > margin)
        return 0;

    int32_t count = edges.separation > face.separation + PERP__BOX_BIAS * pair->size
                        ? edge_points(both, &edges, &flat, margin, points)
                        : face_points(both, &face, margin, points);
    if (count > 0)
        return count;

    /* The axis separates the boxes, but nothing over the face is near: a corner or an edge is
     * closest to an edge. Boxes that overlap do meet on their axis, and get here by no more than
     * BIAS. */
    face_normal(both, &face, normal);
    return perp__box_pair_closest(pair, 0, margin, normal, FEATURE_CLOSEST, points);
}

/* Both views, the larger box first. Returns whether that is B. */
static int32_t set_views(views *both, const perp__placed *a, const perp__placed *b)
{
    const int32_t swapped = perp__box_is_smaller(a, b);
    perp__box_pair_set(&both->from[0], swapped ? b : a, swapped ? a : b);
    perp__box_pair_set(&both->from[1], swapped ? a : b, swapped ? b : a);
    return swapped;
}

int32_t perp__collide_box_box(const perp__placed *a, const perp__placed *b, double margin,
                              perp__point *points)
{
    views both;
    const int32_t swapped = set_views(&both, a, b);
    int32_t count = collide_views(&both, margin, points);
    if (swapped)
        perp__turn_points(count, points);
    return count;
}

/* The pair's face or edge axis of that number; see perp__box_axes. */
static int32_t points_along(const views *both, int32_t axis, perp__point *points)
{
    face_axis face = {0, {0, 1.0}, 0.0};
    edge_axis edges;
    double normal[3];
    int32_t count = 0;
    if (axis < 6) {
        face.second = axis >= 3;
        face.face.axis = axis % 3;
        face.face.sign = both->from[face.second].centre[face.face.axis] < 0.0 ? -1.0 : 1.0;
        count = face_points(both, &face, INFINITY, points);
    } else if (edge_product(&both->from[0], (axis - 6) / 3, (axis - 6) % 3, &edges)) {
        count = edge_points(both, &edges, &face, INFINITY, points);
    }
    if (count > 0)
        return count;
    face_normal(both, &face, normal);
    return perp__box_pair_closest(&both->from[0], 0, INFINITY, normal, FEATURE_CLOSEST, points);
}

int32_t perp__collide_box_box_along(const perp__placed *a, const perp__placed *b, int32_t axis,
                                    perp__point *points)
{
    views both;
    const int32_t swapped = set_views(&both, a, b);
    if (swapped)
        axis = axis < 3 ? axis + 3 : axis < 6 ? axis - 3 : 6 + 3 * (axis % 3) + (axis - 6) / 3;
    int32_t count = points_along(&both, axis, points);
    if (swapped)
        perp__turn_points(count, points);
    return count;
}
