/* Two boxes in space.
 *
 * The axis along which they are farthest apart, or overlap least (axes.c), is the normal of their
 * contacts. A face normal gives the polygon in which the faces meet: that of the incident box,
 * clipped by the sides of the reference face (Sutherland & Hodgman 1974). A product of edges gives
 * the point where two edges cross. */
#include "world/collide/convex.h"

#include <string.h>

#include "linalg/spatial.h"

/* Features: those of face contacts on either reference, those of a pair of edges, and one for the
 * closest points, which come alone. */
enum {
    FEATURES_A_FACE = 36 * 64,
    FEATURE_EDGES = 2 * FEATURES_A_FACE,
    FEATURE_CLOSEST = FEATURE_EDGES + 12 * 12
};

static const double identity[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
static const double origin[3] = {0.0, 0.0, 0.0};

/* Two boxes in the frame of the first, the reference. */
typedef struct box_pair {
    const perp__placed *reference;
    const double *half;          /* of the reference */
    const double *incident_half; /* of the incident box */
    double axes[9];              /* columns: the incident box's axes */
    double centre[3];            /* the incident box's centre */
    double size;                 /* largest half extent of the smaller box */
} box_pair;

/* The side `sign` of an axis of the reference box, which is the second of the two where told. */
typedef struct box_face {
    int second;
    int axis;
    double sign;
} box_face;

typedef struct edge_axis {
    int i, j;         /* axes of first and second */
    double normal[3]; /* frame of the first, from first to second */
    double separation;
} edge_axis;

static void set_pair(box_pair *pair, const perp__placed *reference, const perp__placed *incident)
{
    double between[3];
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
    perp__subtract3(between, incident->position, reference->position);
    perp__apply_transposed3(pair->centre, reference->rotation, between);
    pair->size = fmin(perp__largest3(pair->half), perp__largest3(pair->incident_half));
}

static double dot_axis(const box_pair *pair, const double *x, int j)
{
    return x[0] * pair->axes[j] + x[1] * pair->axes[3 + j] + x[2] * pair->axes[6 + j];
}

/* ---- faces ---- */

/* A convex quadrilateral has at most 8 corners left when four lines have cut it. */
enum { MAX_CORNERS = 8 };

/* A corner is told from the others by the edges before and after it: edges 0 .. 3 are the incident
 * face's, 4 .. 7 the reference face's. */
typedef struct corner {
    double position[3];
    int32_t before;
    int32_t after;
} corner;

typedef struct polygon {
    corner corners[MAX_CORNERS];
    int count;
} polygon;

/* A side plane of the reference face: inside where sign x[axis] <= half. */
typedef struct side {
    int axis;
    double sign;
    double half;
    double tolerance; /* on the plane: this close to it */
    int32_t edge;
} side;

/* The incident box's face whose normal is most against the reference face's. Returns a number for
 * it, 0 .. 5. */
static int32_t incident_face(const box_pair *pair, const box_face *face, polygon *out)
{
    static const double round[4][2] = {{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}};
    const double *along = pair->axes + 3 * face->axis, *half = pair->incident_half;
    double axis_j[3], axis_k[3], axis_l[3];
    int j = 0;
    for (int m = 1; m < 3; m++)
        if (fabs(along[m]) > fabs(along[j]))
            j = m;
    const double sign = face->sign * along[j] > 0.0 ? -1.0 : 1.0;
    const int k = (j + 1) % 3, l = (j + 2) % 3;
    perp__column3(axis_j, pair->axes, j);
    perp__column3(axis_k, pair->axes, k);
    perp__column3(axis_l, pair->axes, l);
    out->count = 4;
    for (int q = 0; q < 4; q++) {
        corner *at = &out->corners[q];
        perp__along3(at->position, pair->centre, sign * half[j], axis_j);
        perp__along3(at->position, at->position, round[q][0] * half[k], axis_k);
        perp__along3(at->position, at->position, round[q][1] * half[l], axis_l);
        at->before = (q + 3) % 4;
        at->after = q;
    }
    return 2 * j + (sign > 0.0);
}

static double beyond(const side *cut, const corner *at)
{
    return cut->sign * at->position[cut->axis] - cut->half;
}

/* Corners on the plane stay as they are and spawn no second corner beside them. */
static void clip(const side *cut, polygon *in)
{
    const double on = cut->tolerance;
    polygon out;
    out.count = 0;
    for (int q = 0; q < in->count; q++) {
        const corner *last = &in->corners[(q + in->count - 1) % in->count];
        const corner *here = &in->corners[q];
        const corner *next = &in->corners[(q + 1) % in->count];
        const double at_last = beyond(cut, last), at = beyond(cut, here);
        const double at_next = beyond(cut, next);

        if (at <= on && out.count < MAX_CORNERS) {
            corner *inside = &out.corners[out.count++];
            *inside = *here;
            if (at >= -on && at_last > on)
                inside->before = cut->edge;
            if (at >= -on && at_next > on)
                inside->after = cut->edge;
        }
        if (((at < -on && at_next > on) || (at > on && at_next < -on)) && out.count < MAX_CORNERS) {
            const int leaves = at < at_next;
            const corner *inside = leaves ? here : next, *outside = leaves ? next : here;
            const double from = beyond(cut, inside), part = from / (from - beyond(cut, outside));
            corner *cross = &out.corners[out.count++];
            cross->before = leaves ? here->after : cut->edge;
            cross->after = leaves ? cut->edge : here->after;
            for (int k = 0; k < 3; k++)
                cross->position[k] =
                    inside->position[k] + part * (outside->position[k] - inside->position[k]);
            cross->position[cut->axis] = cut->sign * cut->half;
        }
    }
    memcpy(in, &out, sizeof out);
}

/* The points with gap <= margin of the incident face that lies opposite `face`, over it: up to 8,
 * with features below 72 * 64. Returns how many. */
static int32_t face_points(const box_pair pairs[2], const box_face *face, double margin,
                           perp__point *points)
{
    const box_pair *pair = &pairs[face->second];
    double normal[3] = {0.0, 0.0, 0.0};
    int32_t count = 0, first = face->second ? FEATURES_A_FACE : 0;
    polygon outline;
    const int32_t incident = incident_face(pair, face, &outline);
    for (int32_t edge = 0; edge < 4; edge++) {
        const int axis = (face->axis + 1 + edge / 2) % 3;
        const side cut = {axis, edge % 2 ? 1.0 : -1.0, pair->half[axis], PERP__ON_FACE * pair->size,
                          4 + edge};
        clip(&cut, &outline);
    }
    normal[face->axis] = face->sign;
    first += (6 * (2 * face->axis + (face->sign > 0.0)) + incident) * 64;
    for (int q = 0; q < outline.count; q++) {
        const corner *at = &outline.corners[q];
        const double gap = face->sign * at->position[face->axis] - pair->half[face->axis];
        double position[3];
        if (!(gap <= margin))
            continue;
        perp__along3(position, at->position, -0.5 * gap, normal);
        perp__emit_point(pair->reference, position, normal, gap, first + at->before * 8 + at->after,
                         &points[count++]);
    }
    if (face->second) /* from first to second */
        perp__turn_points(count, points);
    return count;
}

/* ---- edges ---- */

/* The product of edges i and j. Returns 0 if they are parallel. */
static int edge_product(const box_pair *pair, int i, int j, edge_axis *axis)
{
    const int k = (i + 1) % 3, l = (i + 2) % 3;
    const double length = hypot(pair->axes[3 * k + j], pair->axes[3 * l + j]);
    double *normal = axis->normal;
    if (length < PERP__PARALLEL)
        return 0;
    normal[i] = 0.0;
    normal[k] = -pair->axes[3 * l + j] / length;
    normal[l] = pair->axes[3 * k + j] / length;
    const double along = perp__dot3(normal, pair->centre);
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

/* The face whose normal is within PERP__FLAT of the edges' axis; returns 0 if there is none. */
static int flat_face(const box_pair *pair, const edge_axis *edges, box_face *flat)
{
    double least = 1.0 - 0.5 * PERP__FLAT * PERP__FLAT;
    int found = 0;
    for (int m = 0; m < 6; m++) {
        const double cosine = m < 3 ? edges->normal[m] : -dot_axis(pair, edges->normal, m - 3);
        if (fabs(cosine) <= least)
            continue;
        least = fabs(cosine);
        found = 1;
        flat->second = m >= 3;
        flat->axis = m % 3;
        flat->sign = cosine < 0.0 ? -1.0 : 1.0;
    }
    return found;
}

/* Edge `number` of a box, 0 .. 11, in the frame in which its centre is `centre` and its axes are
 * the columns of `axes`. Edges of axis j have the numbers 4j .. 4j + 3; the number's lowest bits
 * tell the sides on the axes that follow j cyclically. */
static void segment_of_box(perp__segment *edge, const double *half, const double *axes,
                           const double *centre, int32_t number)
{
    const int j = (int)(number / 4);
    perp__column3(edge->direction, axes, j);
    edge->half = half[j];
    perp__copy3(edge->centre, centre);
    for (int m = 1; m < 3; m++) {
        const int other = (j + m) % 3;
        double axis[3];
        perp__column3(axis, axes, other);
        const double sign = number % 4 >> (m - 1) & 1 ? 1.0 : -1.0;
        perp__along3(edge->centre, edge->centre, sign * half[other], axis);
    }
}

/* The edge of a box along axis j that lies farthest in `direction`. */
static int32_t edge_towards(int j, const double *direction)
{
    return 4 * j + (direction[(j + 1) % 3] > 0.0) + 2 * (direction[(j + 2) % 3] > 0.0);
}

/* The point where two edges cross. Boxes that overlap least along this axis do cross there; apart,
 * the lines may come closest beyond the edges' ends, which is not this point: returns 0. */
static int32_t edge_point(const box_pair *pair, const edge_axis *axis, double margin,
                          perp__point *points)
{
    const double gap = axis->separation;
    double against[3], on_first[3], on_second[3], between[3], position[3];
    perp__segment first, second;
    for (int m = 0; m < 3; m++)
        against[m] = -dot_axis(pair, axis->normal, m);
    const int32_t number_first = edge_towards(axis->i, axis->normal);
    const int32_t number_second = edge_towards(axis->j, against);
    if (!(gap <= margin))
        return 0;
    segment_of_box(&first, pair->half, identity, origin, number_first);
    segment_of_box(&second, pair->incident_half, pair->axes, pair->centre, number_second);
    perp__segment_closest(&first, &second, on_first, on_second);

    /* between the points lies the gap, along the axis, unless an edge ended before */
    perp__subtract3(between, on_second, on_first);
    perp__along3(between, between, -gap, axis->normal);
    if (gap > 0.0 && perp__largest3(between) > PERP__ON_FACE * pair->size)
        return 0;
    for (int k = 0; k < 3; k++)
        position[k] = 0.5 * (on_first[k] + on_second[k]);
    perp__emit_point(pair->reference, position, axis->normal, gap,
                     FEATURE_EDGES + 12 * number_first + number_second, points);
    return 1;
}

/* One point at the closest points of the edges of two boxes, of which no corner is closest to a
 * face, if their distance is at most margin. The normal of `face` stands in where the distance is
 * lost in rounding. */
static int32_t closest_point(const box_pair *pair, const box_face *face, double margin,
                             perp__point *points)
{
    double least = INFINITY, on_first[3], on_second[3], normal[3], position[3];
    for (int32_t i = 0; i < 12; i++) {
        perp__segment first, second;
        segment_of_box(&first, pair->half, identity, origin, i);
        for (int32_t j = 0; j < 12; j++) {
            double here_first[3], here_second[3], between[3];
            segment_of_box(&second, pair->incident_half, pair->axes, pair->centre, j);
            const int parallel = perp__segment_closest(&first, &second, here_first, here_second);
            perp__subtract3(between, here_second, here_first);
            double distance = perp__normalise3(between);

            /* of equal distances that of parallel edges, whose points are the middle of the stretch
             * in which they meet: the others end there. The factor only beats rounding. */
            if (parallel)
                distance *= 1.0 - 1e-9;
            if (!(distance < least))
                continue;
            least = distance;
            perp__copy3(on_first, here_first);
            perp__copy3(on_second, here_second);
        }
    }
    perp__subtract3(normal, on_second, on_first);
    const double gap = perp__normalise3(normal);
    if (!(gap <= margin))
        return 0;
    for (int k = 0; k < 3; k++)
        position[k] = 0.5 * (on_first[k] + on_second[k]);
    if (gap <= PERP__ON_FACE * pair->size) {
        perp__column3(normal, face->second ? pair->axes : identity, face->axis);
        for (int k = 0; k < 3; k++)
            normal[k] *= face->second ? -face->sign : face->sign;
    }
    perp__emit_point(pair->reference, position, normal, gap, FEATURE_CLOSEST, points);
    return 1;
}

int32_t perp__collide_box_box_along(const perp__placed *a, const perp__placed *b, int32_t axis,
                                    double margin, perp__point *points)
{
    const int32_t swapped = perp__box_is_smaller(a, b);
    box_pair pairs[2];
    box_face face = {0, 0, 1.0};
    edge_axis edges;
    int32_t count = 0, over_face = axis < 6, crossing = 0;

    /* 1. the larger box comes first: the smaller one's corners then are contact points, and the
     * choice does not depend on which is called A */
    set_pair(&pairs[0], swapped ? b : a, swapped ? a : b);
    set_pair(&pairs[1], swapped ? a : b, swapped ? b : a);
    if (swapped)
        axis = axis < 3 ? axis + 3 : axis < 6 ? axis - 3 : 6 + 3 * (axis % 3) + (axis - 6) / 3;

    /* 2. points over the face of the axis, or over one that an axis of edges is nearly normal to */
    if (over_face) {
        face.second = axis >= 3;
        face.axis = axis % 3;
        face.sign = pairs[face.second].centre[face.axis] < 0.0 ? -1.0 : 1.0;
    } else {
        crossing = edge_product(&pairs[0], (axis - 6) / 3, (axis - 6) % 3, &edges);
        over_face = crossing && flat_face(&pairs[0], &edges, &face);
    }
    if (over_face)
        count = face_points(pairs, &face, margin, points);

    /* 3. the point where edges cross */
    if (count == 0 && crossing)
        count = edge_point(&pairs[0], &edges, margin, points);

    /* 4. the axis separates the boxes, but nothing over the face is near: a corner or an edge is
     * closest to an edge */
    if (count == 0)
        count = closest_point(&pairs[0], &face, margin, points);
    if (swapped)
        perp__turn_points(count, points);
    return count;
}

int32_t perp__collide_box_box(const perp__placed *a, const perp__placed *b, double margin,
                              perp__point *points)
{
    perp__axes axes;
    perp__box_axes(a, b, &axes);
    const int32_t best = perp__last_to_close(a, b, &axes, NULL);
    if (axes.axis[best].separation > margin)
        return 0;
    return perp__collide_box_box_along(a, b, best, margin, points);
}
