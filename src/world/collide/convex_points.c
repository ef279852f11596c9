/* The points in which two convex shapes touch along an axis: the face of one, and what lies over it
 * of the other's face, edge or corner opposite (Sutherland & Hodgman 1974); the point where two
 * edges cross; the closest points of rounded edges and corners. */
#include "world/collide/convex.h"

#include "linalg/spatial.h"
#include "world/collide/segment.h"

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
    double out[3];
    double limit;
    double tolerance;
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

/* The feature where an edge of the rim meets the side at hand. */
static int32_t crossing_feature(const cutter *cut, int32_t edge)
{
    const perp__polytope *own = &cut->pair->side[cut->side];
    const int32_t first = own->first[cut->face], count = own->first[cut->face + 1] - first;
    if (edge >= 0 && !cut->pair->planar) {
        int32_t mine = own->side[first + cut->p];
        return cut->side == 0 ? edge_feature(cut->pair, mine, edge)
                              : edge_feature(cut->pair, edge, mine);
    }
    int32_t after = edge < 0 && (cut->p + 1) % count == -1 - edge;
    return corner_feature(cut->side, own->loop[first + (after ? (cut->p + 1) % count : cut->p)]);
}

/* Corners on the side stay as they are and spawn no second corner beside them. */
static void clip(const cutter *cut, const rim *in, rim *out)
{
    const double on = cut->tolerance;
    out->count = 0;
    out->closed = in->closed;
    for (int32_t q = 0; q < in->count; q++) {
        const rim_corner *here = &in->corners[q], *next = &in->corners[(q + 1) % in->count];
        const double at = beyond(cut, here);
        const int32_t ends = q + 1 == in->count && !in->closed;
        const double at_next = ends ? at : beyond(cut, next);
        if (at <= on && out->count < MAX_RIM) {
            out->corners[out->count] = *here;
            if (at >= -on && at_next > on)
                out->corners[out->count].edge = -1 - cut->p;
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
        cross->feature = crossing_feature(cut, here->edge);
        cross->edge = at < at_next ? -1 - cut->p : here->edge;
    }
}

/* The face of a shape that lies most against `normal`, among those of its corner farthest against
 * it; -1 if it has no faces. */
static int32_t incident_face(const perp__polytope *polytope, const double *normal)
{
    int32_t deepest = 0, best = -1;
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
                best = f;
            }
    return best;
}

/* What the shape turns towards the face: its own face, or its segment or point. */
static void incident_rim(const perp__convex_pair *pair, int32_t side, const double *normal,
                         rim *corners)
{
    const perp__polytope *polytope = &pair->side[side];
    const int32_t face = incident_face(polytope, normal);
    const int32_t first = face < 0 ? 0 : polytope->first[face];
    corners->count = face < 0 ? polytope->corners : polytope->first[face + 1] - first;
    corners->closed = corners->count > 2;
    for (int32_t i = 0; i < corners->count; i++) {
        const int32_t c = face < 0 ? i : polytope->loop[first + i];
        perp__copy3(corners->corners[i].position, polytope->corner + 3 * c);
        corners->corners[i].feature = corner_feature(side, c);
        corners->corners[i].edge = face < 0 ? 0 : polytope->side[first + i];
    }
}

/* Writes the rim's corners over the face as points; every so many where there are too many. */
static int32_t rim_points(const cutter *cut, const rim *corners, double margin, perp__point *points)
{
    const perp__convex_pair *pair = cut->pair;
    const perp__polytope *own = &pair->side[cut->side], *other = &pair->side[1 - cut->side];
    const double *out = own->normal + 3 * cut->face;
    double normal[3];
    int32_t count = 0, wanted = corners->count;
    if (wanted > PERP__MAX_POINTS)
        wanted = PERP__MAX_POINTS;
    for (int k = 0; k < 3; k++)
        normal[k] = cut->side == 0 ? out[k] : -out[k];
    for (int32_t i = 0; i < wanted; i++) {
        const rim_corner *at = &corners->corners[i * corners->count / wanted];
        double gap = (perp__dot3(out, at->position) - own->offset[cut->face]) - pair->radius;
        double position[3];
        if (!(gap <= margin))
            continue;
        perp__along3(position, at->position, -(other->radius + 0.5 * gap), out);
        perp__emit_point(pair->frame, position, normal, gap, at->feature, &points[count++]);
    }
    return count;
}

/* A segment whose ends came together on a corner of the face is one point. */
static int32_t is_one(const perp__convex_pair *pair, const rim *corners)
{
    double between[3];
    if (corners->closed || corners->count != 2)
        return 0;
    perp__subtract3(between, corners->corners[1].position, corners->corners[0].position);
    return perp__largest3(between) <= PERP__ON_FACE * pair->size;
}

/* The points over a face of shape `side` with gap <= margin. */
static int32_t face_points(const perp__convex_pair *pair, int32_t side, int32_t face, double margin,
                           perp__point *points)
{
    const perp__polytope *own = &pair->side[side];
    const int32_t count = own->first[face + 1] - own->first[face];
    rim corners[2];
    int now = 0;
    cutter cut = {pair, side, face, 0, {0.0, 0.0, 0.0}, 0.0, PERP__ON_FACE * pair->size};
    incident_rim(pair, 1 - side, own->normal + 3 * face, &corners[0]);
    for (cut.p = 0; cut.p < count; cut.p++, now = 1 - now) {
        cut.limit = perp__convex_rim(pair, own, face, cut.p, cut.out);
        clip(&cut, &corners[now], &corners[1 - now]);
    }
    if (is_one(pair, &corners[now]))
        corners[now].count = 1;
    return rim_points(&cut, &corners[now], margin, points);
}

/* ---- edges and corners ---- */

/* The face whose normal is within FLAT of the direction, and whose it is; returns 0 if there is
 * none. */
static int32_t flat_face(const perp__convex_pair *pair, const double *normal, int32_t *side,
                         int32_t *face)
{
    double most = 1.0 - 0.5 * PERP__FLAT * PERP__FLAT;
    int32_t found = 0;
    for (int32_t s = 0; s < 2; s++)
        for (int32_t f = 0; f < pair->side[s].faces; f++) {
            double cosine = perp__dot3(pair->side[s].normal + 3 * f, normal);
            if (!((s == 0 ? cosine : -cosine) > most))
                continue;
            most = s == 0 ? cosine : -cosine;
            *side = s;
            *face = f;
            found = 1;
        }
    return found;
}

/* The point where two edges cross. Shapes that overlap least along this axis do cross there; apart,
 * the lines may come closest beyond the edges' ends, which is not this point: returns 0. */
static int32_t edge_point(const perp__convex_pair *pair, int32_t edge_a, int32_t edge_b,
                          double margin, perp__point *points)
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
    if (separation > 0.0 && perp__largest3(between) > PERP__ON_FACE * pair->size)
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
    const int32_t lost = separation < 0.0 || closest.distance <= PERP__ON_FACE * pair->size;
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

/* The face's points, or where nothing lies over it those of the edges and corners next to it. */
static int32_t along_face(const perp__convex_pair *pair, int32_t number, double margin,
                          perp__point *points)
{
    const int32_t side = number >= pair->side[0].faces;
    const int32_t face = side ? number - pair->side[0].faces : number;
    int32_t count = face_points(pair, side, face, margin, points);
    if (count > 0)
        return count;
    perp__axis axis;
    perp__convex_face(pair, side, face, &axis);
    return closest_points(pair, axis.normal, axis.separation + pair->radius, margin, points);
}

/* Along a product of edges or the line between closest points: a face's, if one lies across it. */
static int32_t along_edges(const perp__convex_pair *pair, int32_t number, double margin,
                           perp__point *points)
{
    const int32_t edges = pair->side[1].edges, crossing = number >= 0;
    int32_t side, face, count = 0;
    perp__closest closest;
    double normal[3], separation;
    if (crossing) {
        separation = perp__convex_product(pair, number / edges, number % edges, normal);
    } else {
        perp__convex_closest(pair, &closest);
        perp__copy3(normal, closest.direction);
        separation = closest.distance;
    }
    if (flat_face(pair, normal, &side, &face))
        count = face_points(pair, side, face, margin, points);
    if (count == 0 && crossing)
        count = edge_point(pair, number / edges, number % edges, margin, points);
    return count > 0 ? count : closest_points(pair, normal, separation, margin, points);
}

int32_t perp__convex_points(const perp__convex_pair *pair, int32_t axis, double margin,
                            perp__point *points)
{
    const int32_t faces = pair->side[0].faces + pair->side[1].faces;
    if (axis >= 0 && axis < faces)
        return along_face(pair, axis, margin, points);
    return along_edges(pair, axis < 0 ? PERP__CLOSEST_AXIS : axis - faces, margin, points);
}

int32_t perp__collide_convex(const perp__placed *a, const perp__placed *b, int32_t planar,
                             double margin, perp__point *points)
{
    perp__convex_pair pair;
    perp__axes axes;
    perp__convex_pair_set(&pair, a, b, planar);
    perp__convex_axes(&pair, &axes);
    const perp__axis *best = &axes.axis[perp__last_to_close(a, b, &axes, NULL)];
    if (!(best->separation <= margin))
        return 0;
    return perp__convex_points(&pair, best->number, margin, points);
}
