/* The points in which two convex shapes touch along an axis: the face of one, and what lies over it
 * of the other's face, edge or corner opposite (Sutherland & Hodgman 1974); the point where two
 * edges cross; the closest points of rounded edges and corners. */
#include "base/rounding.h"
#include "world/collide/polytope.h"

#include "linalg/spatial.h"

/* A face's corners, and one more for each line that cuts it. */
enum { MAX_RIM = 2 * PERP__MAX_CORNERS };

/* Features: the corner of A or B, or the edges of A and B, which make the point, whichever face is
 * the reference; and the closest points, which come alone. */
enum {
    FEATURE_A = 0,
    FEATURE_B = PERP__MAX_CORNERS,
    FEATURE_CLOSEST = 2 * PERP__MAX_CORNERS,
    FEATURE_EDGES = FEATURE_CLOSEST + 2
};

typedef struct rim_corner {
    double position[3];
    int32_t feature;
    int32_t edge; /* to the next: of the incident shape, or -1 - p: along the reference's rim */
} rim_corner;

typedef struct rim {
    rim_corner corners[MAX_RIM];
    int32_t count;
    int32_t closed; /* there is an edge from the last to the first */
} rim;

/* A reference face, and a side of it at a time. */
typedef struct cutter {
    const perp__convex_pair *pair;
    int32_t side; /* of the pair, whose face it is */
    int32_t face;
    int32_t p; /* of its rim */
    double out[3], limit, tolerance;
} cutter;

static int32_t corner_feature(int32_t side, int32_t corner)
{
    return (side == 0 ? FEATURE_A : FEATURE_B) + corner;
}

static int32_t edge_feature(const perp__convex_pair *pair, int32_t edge_a, int32_t edge_b)
{
    return FEATURE_EDGES + edge_a * pair->side[1].edges + edge_b;
}

/* ---- over a face ---- */

static double beyond(const cutter *cut, const rim_corner *at)
{
    return perp__dot3(cut->out, at->position) - cut->limit;
}

/* Corners on the side stay as they are and spawn no second corner beside them. */
static void clip(const cutter *cut, const rim *in, rim *out)
{
    const perp__polytope *self = &cut->pair->side[cut->side];
    const int32_t first = self->first[cut->face], corners = self->first[cut->face + 1] - first;
    const int32_t p = cut->p, next_p = (p + 1) % corners, mine = self->side[first + p];
    const double on = cut->tolerance;
    out->count = 0;
    out->closed = in->closed;
    for (int32_t q = 0; q < in->count; q++) {
        const rim_corner *here = &in->corners[q], *next = &in->corners[(q + 1) % in->count];
        const double at = beyond(cut, here);
        const bool ends = q + 1 == in->count && !in->closed;
        const double at_next = ends ? at : beyond(cut, next);
        if (at <= on && out->count < MAX_RIM) {
            out->corners[out->count] = *here;
            if (at >= -on && at_next > on)
                out->corners[out->count].edge = -1 - p;
            out->count++;
        }
        if (!((at < -on && at_next > on) || (at > on && at_next < -on)) || out->count == MAX_RIM)
            continue;
        rim_corner *cross = &out->corners[out->count++];
        const rim_corner *inside = at < at_next ? here : next;
        const rim_corner *outside = at < at_next ? next : here;
        const double from = beyond(cut, inside), part = from / (from - beyond(cut, outside));
        for (int k = 0; k < 3; k++)
            cross->position[k] =
                inside->position[k] + part * (outside->position[k] - inside->position[k]);
        if (here->edge >= 0 && !cut->pair->planar)
            cross->feature = cut->side == 0 ? edge_feature(cut->pair, mine, here->edge)
                                            : edge_feature(cut->pair, here->edge, mine);
        else /* a corner of the side at hand */
            cross->feature = corner_feature(
                cut->side, self->loop[first + (-1 - here->edge == next_p ? next_p : p)]);
        cross->edge = at < at_next ? -1 - p : here->edge;
    }
}

/* What the shape turns towards a face: of the faces of its corner farthest against the normal that
 * which lies most against it; or, where it has none, its segment or point. */
static void incident_rim(const perp__convex_pair *pair, int32_t side, const double *normal,
                         rim *corners)
{
    const perp__polytope *polytope = &pair->side[side];
    int32_t deepest = 0, face = -1, first = 0;
    double least = INFINITY, most = INFINITY;
    for (int32_t c = 0; c < polytope->corners; c++)
        if (perp__dot3(normal, polytope->corner + 3 * c) < least) {
            least = perp__dot3(normal, polytope->corner + 3 * c);
            deepest = c;
        }
    for (int32_t f = 0; f < polytope->faces; f++)
        for (int32_t i = polytope->first[f]; i < polytope->first[f + 1]; i++)
            if (polytope->loop[i] == deepest &&
                perp__dot3(normal, polytope->normal + 3 * f) < most) {
                most = perp__dot3(normal, polytope->normal + 3 * f);
                face = f;
            }
    corners->count = polytope->corners;
    if (face >= 0) {
        first = polytope->first[face];
        corners->count = polytope->first[face + 1] - first;
    }
    corners->closed = corners->count > 2;
    for (int32_t i = 0; i < corners->count; i++) {
        const int32_t c = face < 0 ? i : polytope->loop[first + i];
        perp__copy3(corners->corners[i].position, polytope->corner + 3 * c);
        corners->corners[i].feature = corner_feature(side, c);
        corners->corners[i].edge = face < 0 ? 0 : polytope->side[first + i];
    }
}

/* The points over a face of shape `side` with gap <= margin: of what the other turns towards it,
 * cut by the sides of its rim. Every so many where there are too many. */
static int32_t face_points(const perp__convex_pair *pair, int32_t side, int32_t face, double margin,
                           perp__point *points)
{
    const perp__polytope *self = &pair->side[side], *other = &pair->side[1 - side];
    const double *out = self->normal + 3 * face;
    const double normal[3] = {side == 0 ? out[0] : -out[0], side == 0 ? out[1] : -out[1],
                              side == 0 ? out[2] : -out[2]};
    cutter cut = {pair, side, face, 0, {0.0, 0.0, 0.0}, 0.0, PERP__NEGLIGIBLE * pair->size};
    rim rims[2], *now = &rims[0], *next = &rims[1];
    int32_t count = 0, wanted;

    /* 1. what lies over the face */
    incident_rim(pair, 1 - side, out, now);
    for (cut.p = 0; cut.p < self->first[face + 1] - self->first[face]; cut.p++) {
        rim *cleared = now;
        cut.limit = perp__convex_rim(pair, self, face, cut.p, cut.out);
        clip(&cut, now, next);
        now = next;
        next = cleared;
    }

    /* 2. the ends of a segment that came together on a corner of the face are one */
    if (!now->closed && now->count == 2) {
        double between[3];
        perp__subtract3(between, now->corners[1].position, now->corners[0].position);
        if (perp__largest3(between) <= PERP__NEGLIGIBLE * pair->size)
            now->count = 1;
    }

    /* 3. its corners as points */
    wanted = now->count < PERP__MAX_POINTS ? now->count : PERP__MAX_POINTS;
    for (int32_t i = 0; i < wanted; i++) {
        const rim_corner *at = &now->corners[i * now->count / wanted];
        double gap = (perp__dot3(out, at->position) - self->offset[face]) - pair->radius;
        double position[3];
        if (!(gap <= margin))
            continue;
        perp__along3(position, at->position, -(other->radius + 0.5 * gap), out);
        perp__emit_point(pair->frame, position, normal, gap, at->feature, &points[count++]);
    }
    return count;
}

/* ---- edges and corners ---- */

/* The point where two edges cross. Shapes that overlap least along this axis do cross there; apart,
 * the lines may come closest beyond the edges' ends, which is not this point: returns 0. */
static bool edge_point(const perp__convex_pair *pair, int32_t edge_a, int32_t edge_b, double margin,
                       perp__point *points)
{
    perp__segment a, b;
    double on_a[3], on_b[3], normal[3], between[3], middle[3];
    perp__segment_of_edge(&pair->side[0], edge_a, &a);
    perp__segment_of_edge(&pair->side[1], edge_b, &b);
    perp__segment_closest(&a, &b, on_a, on_b);
    const double separation = perp__convex_product(pair, edge_a, edge_b, normal);
    const double gap = separation - pair->radius;
    if (separation == -INFINITY || !(gap <= margin))
        return 0;

    /* between the points lies the gap, along the axis, unless an edge ended before */
    perp__subtract3(between, on_b, on_a);
    perp__along3(between, between, -separation, normal);
    if (separation > 0.0 && perp__largest3(between) > PERP__NEGLIGIBLE * pair->size)
        return 0;
    for (int k = 0; k < 3; k++)
        middle[k] = 0.5 * ((on_a[k] + pair->side[0].radius * normal[k]) +
                           (on_b[k] - pair->side[1].radius * normal[k]));
    perp__emit_point(pair->frame, middle, normal, gap, edge_feature(pair, edge_a, edge_b), points);
    return 1;
}

/* The closest points of edges. `normal`, of an axis that separates the cores by `separation`,
 * stands in where their distance is lost in rounding or they overlap. */
static int32_t closest_points(const perp__convex_pair *pair, const double *normal,
                              double separation, double margin, perp__point *points)
{
    perp__closest closest;
    int32_t count = 0;
    perp__convex_closest(pair, &closest);
    const bool lost = separation < 0.0 || closest.distance <= PERP__NEGLIGIBLE * pair->size;
    const double *along = lost ? normal : closest.direction;
    for (int32_t i = 0; i < closest.count; i++) {
        double between[3], middle[3], gap;
        perp__subtract3(between, closest.on[i][1], closest.on[i][0]);
        gap = lost                 ? fmin(separation, closest.distance)
              : closest.count == 1 ? closest.distance
                                   : perp__dot3(between, along);
        gap -= pair->radius;
        if (!(gap <= margin))
            continue;
        for (int k = 0; k < 3; k++)
            middle[k] = 0.5 * ((closest.on[i][0][k] + pair->side[0].radius * along[k]) +
                               (closest.on[i][1][k] - pair->side[1].radius * along[k]));
        perp__emit_point(pair->frame, middle, along, gap, FEATURE_CLOSEST + i, &points[count++]);
    }
    return count;
}

/* ---- along an axis ---- */

/* The edge of a box along axis j that lies farthest in a direction, which has these components on
 * the axes that follow j. */
static int32_t edge_towards(int32_t j, double first, double second)
{
    return 4 * j + (first > 0.0) + 2 * (second > 0.0);
}

/* The number of an axis of perp__box_axes among faces and products of edges. */
static int32_t number_of(const perp__convex_pair *pair, int32_t axis)
{
    const double *up_a = pair->side[0].normal + 3, *up_b = pair->side[1].normal + 3;
    const double *low = pair->side[1].corner, *high = low + 3 * 7;
    const double to_b[3] = {low[0] + high[0], low[1] + high[1], low[2] + high[2]};
    const int32_t i = axis / 3 - 2, j = axis % 3;
    double normal[3];
    if (axis < 3)
        return 2 * axis + !(perp__dot3(up_a + 6 * j, to_b) < 0.0);
    if (axis < 6)
        return 2 * axis + !(-perp__dot3(up_b + 6 * j, to_b) < 0.0);
    perp__cross(normal, up_a + 6 * i, up_b + 6 * j);
    const double sign = perp__dot3(normal, to_b) < 0.0 ? -1.0 : 1.0;
    const double *next = up_b + 6 * ((j + 1) % 3), *last = up_b + 6 * ((j + 2) % 3);
    const int32_t edge_a = edge_towards(i, sign * normal[(i + 1) % 3], sign * normal[(i + 2) % 3]);
    const int32_t edge_b =
        edge_towards(j, -sign * perp__dot3(normal, next), -sign * perp__dot3(normal, last));
    return 12 + 12 * edge_a + edge_b;
}

int32_t perp__convex_points(const perp__convex_pair *pair, int32_t axis_number, double margin,
                            perp__point *points)
{
    const int32_t number =
        pair->boxes && axis_number >= 0 ? number_of(pair, axis_number) : axis_number;
    const int32_t faces_a = pair->side[0].faces, faces = faces_a + pair->side[1].faces;
    const int32_t edges = pair->side[1].edges, i = (number - faces) / edges;
    const int32_t j = (number - faces) % edges, crossing = number >= faces;
    int32_t side = number >= faces_a, face = side ? number - faces_a : number;
    const bool of_face = number >= 0 && number < faces;
    int32_t count = 0, over_face = of_face;
    double separation = -INFINITY, most = 1.0 - 0.5 * PERP__FLAT * PERP__FLAT;
    perp__axis axis;
    perp__axes axes;

    /* 1. the normal: of a face, of a product of edges, of the middle of several faces that touch,
     * or the line between the closest points */
    if (number == PERP__MIDDLE_AXIS && perp__convex_axes(pair, INFINITY, &axes) &&
        perp__middle_of_faces(&axes,
                              PERP__NEGLIGIBLE * pair->size +
                                  PERP__SUM_ROUNDING * perp__largest3(pair->frame->position),
                              axis.normal, NULL)) {
        separation = 0.0;
    } else if (of_face) {
        perp__convex_face(pair, side, face, &axis);
        separation = axis.separation + pair->radius;
    } else if (crossing) {
        separation = perp__convex_product(pair, i, j, axis.normal);
    }
    if (separation == -INFINITY) {
        perp__closest closest;
        perp__convex_closest(pair, &closest);
        perp__copy3(axis.normal, closest.direction);
        separation = closest.distance;
    }

    /* 2. the points over that face, or one whose normal is within FLAT of this one */
    for (int32_t f = 0; f < faces && !of_face; f++) {
        const int32_t second = f >= faces_a, self = second ? f - faces_a : f;
        const double cosine = perp__dot3(pair->side[second].normal + 3 * self, axis.normal);
        if (!((second ? -cosine : cosine) > most))
            continue;
        most = second ? -cosine : cosine;
        side = second;
        face = self;
        over_face = 1;
    }
    if (over_face)
        count = face_points(pair, side, face, margin, points);

    /* 3. where the edges cross; else those of the edges and corners that are next */
    if (count == 0 && crossing)
        count = edge_point(pair, i, j, margin, points);
    if (count == 0)
        count = closest_points(pair, axis.normal, separation, margin, points);
    return count;
}

int32_t perp__collide_convex(const perp__placed *a, const perp__placed *b, int32_t planar,
                             double margin, perp__point *points)
{
    perp__convex_pair pair;
    perp__axes axes;
    if (!perp__axes_of(a, b, planar, margin, &axes) && !perp__are_boxes(a, b, planar))
        return 0;
    const perp__axis *best = &axes.axis[perp__last_to_close(a, b, &axes, NULL)];
    if (!(best->separation <= margin))
        return 0;
    perp__convex_pair_set(&pair, a, b, planar);
    return perp__convex_points(&pair, best->number, margin, points);
}
