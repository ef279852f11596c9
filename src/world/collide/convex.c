/* The separating directions of two convex shapes.
 *
 * Cores that are apart are so along the normal of a face or the product of two edges (Gottschalk,
 * Lin & Manocha 1996); edges make a product that matters only where their arcs on the Gauss map
 * cross (Gregorius 2013, The separating axis test). Rounded shapes are apart as far as their cores
 * are, less their radii, along the line between the cores' closest points: that of a face where
 * these lie over it, else that of edges. */
#include "world/collide/convex.h"

#include "linalg/spatial.h"
#include "world/collide/segment.h"

/* Sine of the angle between two edges below which their product is no axis of its own: its
 * direction would be rounding, and the face normals stand in for it to 1e-7 of an edge's length. */
#define PARALLEL 1e-7

/* Cosine of the angle from which on two axes count as different directions. */
#define ASIDE 0.9

static double size_of(const perp__geometry *geometry)
{
    return perp__largest3(geometry->half_extents) + geometry->radius;
}

void perp__convex_pair_set(perp__convex_pair *pair, const perp__placed *a, const perp__placed *b,
                           int32_t planar)
{
    double world[3], between[3], R[9];
    perp__polytope_of(a->geometry, planar, &pair->room[0], &pair->side[0]);
    perp__polytope_of(b->geometry, planar, &pair->room[1], &pair->side[1]);
    perp__subtract3(world, b->position, a->position);
    perp__apply_transposed3(between, a->rotation, world);
    for (int j = 0; j < 3; j++) {
        double axis[3], column[3];
        perp__column3(axis, b->rotation, j);
        perp__apply_transposed3(column, a->rotation, axis);
        for (int k = 0; k < 3; k++)
            R[3 * k + j] = column[k];
    }
    perp__polytope_move(&pair->side[1], R, between, &pair->room[1]);
    pair->frame = a;
    pair->planar = planar;
    pair->radius = a->geometry->radius + b->geometry->radius;
    pair->size = fmin(size_of(a->geometry), size_of(b->geometry));
}

void perp__convex_face(const perp__convex_pair *pair, int32_t side, int32_t face, perp__axis *axis)
{
    const perp__polytope *own = &pair->side[side], *other = &pair->side[1 - side];
    const double *normal = own->normal + 3 * face;
    double least = INFINITY;
    for (int32_t c = 0; c < other->corners; c++)
        least = fmin(least, perp__dot3(normal, other->corner + 3 * c));
    axis->separation = least - own->offset[face] - pair->radius;
    axis->width = INFINITY;
    for (int k = 0; k < 3; k++)
        axis->normal[k] = side == 0 ? normal[k] : -normal[k];
}

/* ---- edges ---- */

static void edge_vector(const perp__polytope *polytope, int32_t e, double *vector)
{
    const int32_t *ends = polytope->edge + 4 * e;
    perp__subtract3(vector, polytope->corner + 3 * ends[1], polytope->corner + 3 * ends[0]);
}

/* The normals of the faces to the left and to the right of an edge along `vector` times another
 * edge's: of opposite signs where the other's plane parts them. */
static int32_t parts_faces(const perp__polytope *polytope, int32_t e, const double *other,
                           double *left, double *right)
{
    const int32_t *faces = polytope->edge + 4 * e + 2;
    *left = *right = 0.0;
    if (polytope->faces == 0)
        return 1;
    *left = perp__dot3(polytope->normal + 3 * faces[0], other);
    *right = perp__dot3(polytope->normal + 3 * faces[1], other);
    return *left * *right < 0.0;
}

double perp__convex_product(const perp__convex_pair *pair, int32_t i, int32_t j, double *normal)
{
    const perp__polytope *a = &pair->side[0], *b = &pair->side[1];
    double u[3], v[3], left[2], right[2], between[3], out = 0.0;
    edge_vector(a, i, u);
    edge_vector(b, j, v);
    if (!parts_faces(b, j, u, &left[1], &right[1]) || !parts_faces(a, i, v, &left[0], &right[0]))
        return -INFINITY;
    if (a->faces > 0 && b->faces > 0 && !(left[1] * right[0] < 0.0))
        return -INFINITY; /* the arcs lie on opposite sides of the map */
    perp__cross(normal, u, v);
    double sine = perp__dot3(normal, normal);
    if (!(sine > PARALLEL * PARALLEL * perp__dot3(u, u) * perp__dot3(v, v)))
        return -INFINITY;
    if (a->faces > 0)
        for (int f = 2; f < 4; f++)
            out += perp__dot3(normal, a->normal + 3 * a->edge[4 * i + f]);
    else
        for (int f = 2; f < 4; f++)
            out -= perp__dot3(normal, b->normal + 3 * b->edge[4 * j + f]);
    double scale = (out < 0.0 ? -1.0 : 1.0) / sqrt(sine);
    for (int k = 0; k < 3; k++)
        normal[k] *= scale;
    perp__subtract3(between, b->corner + 3 * b->edge[4 * j], a->corner + 3 * a->edge[4 * i]);
    return perp__dot3(normal, between);
}

/* The product that separates most, of those that have less than the cosine `aside` with the
 * direction; NULL: of all. */
static double best_product(const perp__convex_pair *pair, const double *direction, double *normal,
                           int32_t *number)
{
    const perp__polytope *a = &pair->side[0], *b = &pair->side[1];
    double best = -INFINITY;
    if (pair->planar || (a->faces == 0 && b->faces == 0))
        return best;
    for (int32_t i = 0; i < a->edges; i++)
        for (int32_t j = 0; j < b->edges; j++) {
            double n[3], separation = perp__convex_product(pair, i, j, n) - pair->radius;
            if (!(separation > best) || (direction && fabs(perp__dot3(n, direction)) >= ASIDE))
                continue;
            best = separation;
            perp__copy3(normal, n);
            *number = a->faces + b->faces + i * b->edges + j;
        }
    return best;
}

/* ---- closest points of rounded shapes ---- */

void perp__segment_of_edge(const perp__polytope *polytope, int32_t e, perp__segment *segment)
{
    const int32_t *ends = polytope->edge + 4 * e;
    const double *from = polytope->corner + 3 * ends[0];
    if (polytope->corners == 1) { /* a ball */
        perp__copy3(segment->centre, from);
        segment->half = 0.0;
        segment->direction[0] = 1.0;
        segment->direction[1] = segment->direction[2] = 0.0;
        return;
    }
    perp__subtract3(segment->direction, polytope->corner + 3 * ends[1], from);
    perp__along3(segment->centre, from, 0.5, segment->direction);
    segment->half = 0.5 * perp__normalise3(segment->direction);
}

/* Both ends of the stretch over which nearly parallel segments lie beside each other; returns 0 if
 * there is none. */
static int32_t stretch(const perp__segment *a, const perp__segment *b, perp__closest *closest)
{
    double between[3], cosine = perp__dot3(a->direction, b->direction);
    perp__subtract3(between, b->centre, a->centre);
    double along = perp__dot3(a->direction, between), reach = fabs(cosine) * b->half;
    double low = fmax(along - reach, -a->half), high = fmin(along + reach, a->half);
    if (!(low < high) || fabs(cosine) < 1.0 - 0.5 * PERP__FLAT * PERP__FLAT)
        return 0;
    for (int end = 0; end < 2; end++) {
        double s = end ? high : low;
        perp__along3(closest->on[end][0], a->centre, s, a->direction);
        perp__along3(closest->on[end][1], b->centre, (s - along) / cosine, b->direction);
    }
    closest->count = 2;
    return 1;
}

/* A direction across two segments whose points coincide. */
static void any_across(const perp__convex_pair *pair, double *direction)
{
    double u[3] = {0.0, 0.0, 0.0}, v[3] = {0.0, 0.0, 0.0};
    edge_vector(&pair->side[0], 0, u);
    edge_vector(&pair->side[1], 0, v);
    perp__cross(direction, u, v);
    if (pair->planar || perp__normalise3(direction) == 0.0) {
        direction[0] = 0.0;
        direction[1] = 1.0;
        direction[2] = 0.0;
    }
}

void perp__convex_closest(const perp__convex_pair *pair, perp__closest *closest)
{
    const perp__polytope *a = &pair->side[0], *b = &pair->side[1];
    double least = INFINITY;
    perp__segment best[2] = {{{0.0}, {0.0}, 0.0}, {{0.0}, {0.0}, 0.0}};
    for (int32_t i = 0; i < a->edges; i++) {
        perp__segment edge_a, edge_b;
        perp__segment_of_edge(a, i, &edge_a);
        for (int32_t j = 0; j < b->edges; j++) {
            double on_a[3], on_b[3], between[3];
            perp__segment_of_edge(b, j, &edge_b);
            int parallel = perp__segment_closest(&edge_a, &edge_b, on_a, on_b);
            perp__subtract3(between, on_b, on_a);
            double distance = perp__normalise3(between);

            /* of equal distances that of parallel edges: the others end where these lie beside each
             * other. The factor only beats rounding. */
            if (!(distance * (parallel ? 1.0 - 1e-9 : 1.0) < least))
                continue;
            least = distance * (parallel ? 1.0 - 1e-9 : 1.0);
            closest->distance = distance;
            perp__copy3(closest->on[0][0], on_a);
            perp__copy3(closest->on[0][1], on_b);
            perp__copy3(closest->direction, between);
            best[0] = edge_a;
            best[1] = edge_b;
        }
    }
    if (a->faces == 0 && b->faces == 0 && least <= PERP__ON_FACE * pair->size)
        any_across(pair, closest->direction);
    closest->count = 1;
    if (!pair->planar || pair->radius > 0.0)
        stretch(&best[0], &best[1], closest);
}

double perp__convex_rim(const perp__convex_pair *pair, const perp__polytope *polytope, int32_t face,
                        int32_t p, double *out)
{
    const int32_t *loop = polytope->loop + polytope->first[face];
    int32_t count = polytope->first[face + 1] - polytope->first[face];
    const double *from = polytope->corner + 3 * loop[p];
    double along[3];
    perp__subtract3(along, polytope->corner + 3 * loop[(p + 1) % count], from);
    if (pair->planar)
        for (int k = 0; k < 3; k++)
            out[k] = -along[k];
    else
        perp__cross(out, along, polytope->normal + 3 * face);
    perp__normalise3(out);
    return perp__dot3(out, from);
}

/* Whether x lies within the rim of a face, seen along its normal. */
static int32_t is_over(const perp__convex_pair *pair, int32_t side, int32_t face, const double *x)
{
    const perp__polytope *polytope = &pair->side[side];
    int32_t count = polytope->first[face + 1] - polytope->first[face];
    for (int32_t p = 0; p < count; p++) {
        double out[3], limit = perp__convex_rim(pair, polytope, face, p, out);
        if (perp__dot3(out, x) > limit)
            return 0;
    }
    return 1;
}

/* Whether the axis of a face is the direction of the closest points: a corner of the other core
 * that is next to the face lies over it. */
static int32_t is_closest(const perp__convex_pair *pair, int32_t side, int32_t face,
                          double separation)
{
    const perp__polytope *own = &pair->side[side], *other = &pair->side[1 - side];
    for (int32_t c = 0; c < other->corners; c++) {
        const double *x = other->corner + 3 * c;
        double height = perp__dot3(own->normal + 3 * face, x) - own->offset[face] - pair->radius;
        if (height <= separation && is_over(pair, side, face, x))
            return 1;
    }
    return 0;
}

static void closest_axis(const perp__convex_pair *pair, const perp__axis *axes, int32_t count,
                         perp__axis *axis)
{
    int32_t best = 0, bare = pair->side[0].faces == 0 && pair->side[1].faces == 0;
    perp__closest closest;
    axis->separation = -INFINITY;
    axis->normal[0] = axis->normal[1] = axis->normal[2] = 0.0;
    if (!(pair->radius > 0.0))
        return;
    for (int32_t k = 1; k < count; k++)
        if (axes[k].separation > axes[best].separation)
            best = k;
    if (!bare) {
        const double separation = axes[best].separation;
        const int32_t faces = pair->side[0].faces, side = best >= faces;
        if (separation <= -pair->radius)
            return; /* cores overlap */
        if (best < faces + pair->side[1].faces &&
            is_closest(pair, side, side ? best - faces : best, separation))
            return;
    }
    perp__convex_closest(pair, &closest);
    axis->separation = closest.distance - pair->radius;
    perp__copy3(axis->normal, closest.direction);
    if (!bare && closest.distance <= PERP__ON_FACE * pair->size)
        axis->separation = -INFINITY;
}

void perp__convex_axes(const perp__convex_pair *pair, perp__axes *axes)
{
    int32_t count = 0;
    for (int32_t side = 0; side < 2; side++) {
        axes->faces[side] = pair->side[side].faces;
        for (int32_t f = 0; f < pair->side[side].faces; f++, count++) {
            perp__convex_face(pair, side, f, &axes->axis[count]);
            axes->axis[count].number = count;
        }
    }
    perp__axis *edges = &axes->axis[count++], *closest = &axes->axis[count];
    edges->number = PERP__NO_AXIS;
    edges->width = closest->width = INFINITY;
    edges->normal[0] = edges->normal[1] = edges->normal[2] = 0.0;
    edges->separation = best_product(pair, NULL, edges->normal, &edges->number);
    closest->number = PERP__CLOSEST_AXIS;
    closest_axis(pair, axes->axis, count, closest);
    axes->count = count + 1;
}

double perp__convex_aside(const perp__convex_pair *pair, const perp__axes *axes, int32_t best)
{
    const double *direction = axes->axis[best].normal;
    double normal[3], largest = best_product(pair, direction, normal, &(int32_t){0});
    for (int32_t k = 0; k < axes->faces[0] + axes->faces[1]; k++)
        if (fabs(perp__dot3(axes->axis[k].normal, direction)) < ASIDE)
            largest = fmax(largest, axes->axis[k].separation);
    return largest + pair->radius;
}
