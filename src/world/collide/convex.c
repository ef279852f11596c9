/* The separating directions of two convex shapes.
 *
 * Cores that are apart are so along the normal of a face or the product of two edges (Gottschalk,
 * Lin & Manocha 1996); edges make a product that matters only where their arcs on the Gauss map
 * cross (Gregorius 2013, The separating axis test). Rounded shapes are apart as far as their cores
 * are, less their radii, along the line between the cores' closest points: that of a face where
 * these lie over it, else that of edges. */
#include "world/collide/polytope.h"

#include "linalg/lanes/vectors.h"
#include "linalg/spatial.h"

/* Faces and edges are looked at by groups. */
enum { GROUP = 8, MAX_EDGES = PERP__MAX_EDGES + GROUP };

/* Of edges: their vectors, and the normals of the faces to the left and to the right, by
 * components; a group that is not full has one edge several times. */
typedef struct edge_group {
    double along[3][GROUP], left[3][GROUP], right[3][GROUP];
} edge_group;

typedef struct convex_kernels {
    void (*find_least)(double normal[3][GROUP], const perp__polytope *other, double *least);
    void (*find_crossing)(const perp__convex_pair *pair, int32_t i, const edge_group *edges,
                          int32_t groups, unsigned *crossing);
} convex_kernels;

static void edge_vector(const perp__polytope *polytope, int32_t e, double *vector)
{
    const int32_t *ends = polytope->edge + 4 * e;
    perp__subtract3(vector, polytope->corner + 3 * ends[1], polytope->corner + 3 * ends[0]);
}

#define TEMPLATE "world/collide/convex_vector.h"
#include "linalg/lanes/each_set.h"

static const convex_kernels *const kernels[] = {PERP__OF_EACH_SET(&kernels)};

void perp__convex_pair_set(perp__convex_pair *pair, const perp__placed *a, const perp__placed *b,
                           int32_t planar)
{
    const double *A = a->rotation, *B = b->rotation;
    double world[3], between[3], R[9];
    perp__polytope_of(a->geometry, planar, &pair->room[0], &pair->side[0]);
    perp__polytope_of(b->geometry, planar, &pair->room[1], &pair->side[1]);
    perp__subtract3(world, b->position, a->position);
    perp__apply_transposed3(between, a->rotation, world);
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++)
            R[3 * k + j] = A[k] * B[j] + A[3 + k] * B[3 + j] + A[6 + k] * B[6 + j];
    perp__polytope_move(&pair->side[1], R, between, &pair->room[1]);
    pair->frame = a;
    pair->planar = planar;
    pair->boxes = perp__are_boxes(a, b, planar);
    pair->radius = a->geometry->radius + b->geometry->radius;
    pair->size = fmin(perp__size_of(a), perp__size_of(b));
}

/* A group of faces of A (side 0) or B, from `face` on, or as many as there are. */
static void set_faces(const perp__convex_pair *pair, int32_t side, int32_t face, perp__axis *axis)
{
    const perp__polytope *self = &pair->side[side];
    const int32_t count = self->faces - face < GROUP ? self->faces - face : GROUP;
    const double sign = side == 0 ? 1.0 : -1.0;
    double normal[3][GROUP], least[GROUP];
    for (int32_t l = 0; l < GROUP; l++)
        for (int k = 0; k < 3; k++)
            normal[k][l] = self->normal[3 * (face + (l < count ? l : 0)) + k];
    kernels[perp__widest_vectors()]->find_least(normal, &pair->side[1 - side], least);
    for (int32_t l = 0; l < count; l++) {
        axis[l].separation = least[l] - self->offset[face + l] - pair->radius;
        axis[l].width = INFINITY;
        for (int k = 0; k < 3; k++)
            axis[l].normal[k] = sign * normal[k][l];
    }
}

void perp__convex_face(const perp__convex_pair *pair, int32_t side, int32_t face, perp__axis *axis)
{
    perp__axis group[GROUP];
    set_faces(pair, side, face, group);
    *axis = group[0];
}

/* ---- edges ---- */

static int32_t group_edges(const perp__polytope *polytope, const int32_t *list, int32_t count,
                           edge_group *groups)
{
    const int32_t whole = (count + GROUP - 1) / GROUP;
    for (int32_t l = 0; l < whole * GROUP; l++) {
        const int32_t e = list[l < count ? l : 0], *faces = polytope->edge + 4 * e + 2;
        edge_group *at = &groups[l / GROUP];
        double along[3];
        edge_vector(polytope, e, along);
        for (int k = 0; k < 3; k++) {
            at->along[k][l % GROUP] = along[k];
            at->left[k][l % GROUP] = polytope->normal[3 * faces[0] + k];
            at->right[k][l % GROUP] = polytope->normal[3 * faces[1] + k];
        }
    }
    return whole;
}

/* The product of two edges whose arcs cross. */
static double product_of(const perp__convex_pair *pair, int32_t i, int32_t j, double *normal)
{
    const perp__polytope *a = &pair->side[0], *b = &pair->side[1];
    double u[3], v[3], between[3], out = 0.0;
    edge_vector(a, i, u);
    edge_vector(b, j, v);
    perp__normalise3(u);
    perp__normalise3(v);
    perp__cross(normal, u, v);
    if (!(perp__normalise3(normal) > PERP__PARALLEL))
        return -INFINITY;
    if (a->faces > 0)
        for (int f = 2; f < 4; f++)
            out += perp__dot3(normal, a->normal + 3 * a->edge[4 * i + f]);
    else
        for (int f = 2; f < 4; f++)
            out -= perp__dot3(normal, b->normal + 3 * b->edge[4 * j + f]);
    for (int k = 0; k < 3 && out < 0.0; k++)
        normal[k] = -normal[k];
    perp__subtract3(between, b->corner + 3 * b->edge[4 * j], a->corner + 3 * a->edge[4 * i]);
    return perp__dot3(normal, between);
}

double perp__convex_product(const perp__convex_pair *pair, int32_t i, int32_t j, double *normal)
{
    unsigned crossing = 1;
    edge_group edges;
    if (!pair->boxes) { /* whose edges are those farthest along their axis */
        group_edges(&pair->side[1], &j, 1, &edges);
        kernels[perp__widest_vectors()]->find_crossing(pair, i, &edges, 1, &crossing);
    }
    return crossing & 1 ? product_of(pair, i, j, normal) : -INFINITY;
}

/* What the products of each edge may separate at most: normals of products are sums of those of the
 * edge's two faces with factors >= 0 that add up to 1 or more, so that they separate no more than
 * the corner of the other core that lies farthest against a direction is beyond the farther of both
 * faces, unless it is above 0. */
static void bound_edges(const perp__polytope *self, const perp__polytope *other,
                        const double *direction, double *bounds)
{
    const double *lowest = other->corner;
    double heights[PERP__MAX_FACES], least = perp__dot3(direction, lowest);
    for (int32_t c = 1; c < other->corners; c++) {
        const double along = perp__dot3(direction, other->corner + 3 * c);
        lowest = along < least ? other->corner + 3 * c : lowest;
        least = along < least ? along : least;
    }
    heights[0] = 0.0; /* of an edge without faces */
    for (int32_t f = 0; f < self->faces; f++)
        heights[f] = perp__dot3(self->normal + 3 * f, lowest) - self->offset[f];
    for (int32_t e = 0; e < self->edges; e++)
        bounds[e] = perp__greater(heights[self->edge[4 * e + 2]], heights[self->edge[4 * e + 3]]);
}

/* The edges of which products may separate more than `most` <= 0. */
static int32_t list_edges(int32_t edges, const double *bounds, double most, int32_t *list)
{
    int32_t count = 0;
    for (int32_t e = 0; e < edges; e++) {
        list[count] = e;
        count += bounds[e] >= most;
    }
    return count;
}

/* The mean of what those of the others may; -INFINITY where there are none. */
static double mean_below(int32_t edges, const double *bounds, double most)
{
    int32_t count = 0;
    double sum = 0.0;
    for (int32_t e = 0; e < edges; e++) {
        const int32_t below = bounds[e] < most;
        count += below;
        sum += below ? bounds[e] : 0.0;
    }
    return count > 0 ? sum / count : -INFINITY;
}

/* The product that separates cores most, and more than `least`, beside its separation: of all, or
 * of those that are aside of the direction. Edges are tried that may separate more than `most`, as
 * faces do; then, while the best of their products has less than was asked for, those that may
 * more than it, or than the mean of the rest. More than `enough` ends the search. */
static double best_product(const perp__convex_pair *pair, const double *direction, bool aside,
                           double most, double least, double enough, double *normal,
                           int32_t *number)
{
    const convex_kernels *set = kernels[perp__widest_vectors()];
    const perp__polytope *a = &pair->side[0], *b = &pair->side[1];
    const double back[3] = {-direction[0], -direction[1], -direction[2]};
    double bounds[2][PERP__MAX_EDGES], best = least, tried = INFINITY;
    int32_t edges[2][PERP__MAX_EDGES];
    unsigned crossing[MAX_EDGES / GROUP];
    edge_group groups[MAX_EDGES / GROUP];
    if (pair->planar || (a->faces == 0 && b->faces == 0))
        return best;
    bound_edges(a, b, direction, bounds[0]);
    bound_edges(b, a, back, bounds[1]);
    for (most = fmin(most, 0.0); most < tried;) {
        const int32_t of_a = list_edges(a->edges, bounds[0], most, edges[0]);
        const int32_t of_b = list_edges(b->edges, bounds[1], most, edges[1]);
        const int32_t count = group_edges(b, edges[1], of_b, groups);
        const unsigned last = (2u << (of_b + GROUP - 1) % GROUP) - 1;
        for (int32_t k = 0; k < of_a && count > 0 && !(best > enough); k++) {
            set->find_crossing(pair, edges[0][k], groups, count, crossing);
            crossing[count - 1] &= last;
            for (int32_t l = 0; l < count; l++)
                for (unsigned bits = crossing[l]; bits; bits &= bits - 1) {
                    const int32_t i = edges[0][k];
                    const int32_t j = edges[1][GROUP * l + (int32_t)perp__lowest_bit(bits)];
                    double n[3], separation;
                    if (bounds[0][i] >= tried && bounds[1][j] >= tried)
                        continue;
                    separation = product_of(pair, i, j, n);
                    if (!(separation > best) ||
                        (aside && fabs(perp__dot3(n, direction)) >= PERP__ASIDE))
                        continue;
                    best = separation;
                    perp__copy3(normal, n);
                    *number = a->faces + b->faces + i * b->edges + j;
                }
        }
        tried = most;
        if (best < tried)
            most = fmax(best, fmax(mean_below(a->edges, bounds[0], tried),
                                   mean_below(b->edges, bounds[1], tried)));
    }
    return best;
}

/* ---- closest points of rounded shapes ---- */

static double clamp(double s, double half)
{
    return fmin(fmax(s, -half), half);
}

/* The distance between p + s u and q + r v, u and v unit vectors, is stationary in s and r where
 *
 *   s - r u'v = u'(q - p),    s u'v - r = v'(q - p).
 *
 * Of directions that count as parallel that point is lost in rounding, and any other of the stretch
 * is as close to 1e-7 of its length. */
int perp__segment_closest(const perp__segment *a, const perp__segment *b, double *on_a,
                          double *on_b)
{
    const double *u = a->direction, *v = b->direction;
    double between[3], cross[3];
    perp__subtract3(between, b->centre, a->centre);
    perp__cross(cross, u, v);
    double cosine = perp__dot3(u, v);
    double sine_squared = perp__dot3(cross, cross);
    double along_a = perp__dot3(u, between);
    double along_b = perp__dot3(v, between);

    int parallel = sine_squared < PERP__PARALLEL * PERP__PARALLEL;
    double s;
    if (parallel) /* the middle of what b covers of a, or a's end next to b */
        s = 0.5 * (fmax(along_a - b->half, -a->half) + fmin(along_a + b->half, a->half));
    else
        s = (along_a - cosine * along_b) / sine_squared;
    s = clamp(s, a->half);

    /* the best r for this s; where r had to be clamped, the best s for that r */
    double r = s * cosine - along_b;
    if (fabs(r) > b->half) {
        r = clamp(r, b->half);
        s = clamp(along_a + r * cosine, a->half);
    }
    perp__along3(on_a, a->centre, s, u);
    perp__along3(on_b, b->centre, r, v);
    return parallel;
}

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

void perp__convex_closest(const perp__convex_pair *pair, perp__closest *closest)
{
    const perp__polytope *a = &pair->side[0], *b = &pair->side[1];
    const double even = PERP__NEGLIGIBLE * pair->size; /* distances that differ by less are equal */
    double least = INFINITY;
    perp__segment best[2] = {{{0.0}, {0.0}, 0.0}, {{0.0}, {0.0}, 0.0}};
    for (int32_t i = 0; i < a->edges; i++) {
        perp__segment edge_a, edge_b;
        perp__segment_of_edge(a, i, &edge_a);
        for (int32_t j = 0; j < b->edges; j++) {
            double on_a[3], on_b[3], between[3];
            perp__segment_of_edge(b, j, &edge_b);
            perp__subtract3(between, edge_b.centre, edge_a.centre);
            if (perp__length3(between) - edge_a.half - edge_b.half > least + 2.0 * even)
                continue; /* no points of theirs are as close */
            int parallel = perp__segment_closest(&edge_a, &edge_b, on_a, on_b);
            perp__subtract3(between, on_b, on_a);
            double distance = perp__normalise3(between);

            /* of equal distances that of parallel edges: others end where these lie side by side */
            const double counts = distance - (parallel ? even : 0.0);
            if (!(counts < least))
                continue;
            least = counts;
            closest->distance = distance;
            perp__copy3(closest->on[0][0], on_a);
            perp__copy3(closest->on[0][1], on_b);
            perp__copy3(closest->direction, between);
            best[0] = edge_a;
            best[1] = edge_b;
        }
    }
    if (a->faces == 0 && b->faces == 0 && closest->distance <= PERP__NEGLIGIBLE * pair->size) {
        /* a direction across two segments whose points coincide */
        static const double upright[3] = {0.0, 1.0, 0.0};
        double u[3], v[3];
        edge_vector(a, 0, u);
        edge_vector(b, 0, v);
        perp__cross(closest->direction, u, v);
        if (pair->planar || perp__normalise3(closest->direction) == 0.0)
            perp__copy3(closest->direction, upright);
    }
    closest->count = 1;
    if (pair->radius == 0.0 && closest->distance > PERP__NEGLIGIBLE * pair->size)
        return;

    /* of edges that are round or touch, both ends of the stretch over which nearly parallel ones
     * lie beside each other */
    double between[3], cosine = perp__dot3(best[0].direction, best[1].direction);
    perp__subtract3(between, best[1].centre, best[0].centre);
    double along = perp__dot3(best[0].direction, between), reach = fabs(cosine) * best[1].half;
    double low = fmax(along - reach, -best[0].half), high = fmin(along + reach, best[0].half);
    if (!(low < high) || fabs(cosine) < 1.0 - 0.5 * PERP__FLAT * PERP__FLAT)
        return;
    closest->count = 2;
    for (int end = 0; end < 2; end++) {
        double s = end ? high : low;
        perp__along3(closest->on[end][0], best[0].centre, s, best[0].direction);
        perp__along3(closest->on[end][1], best[1].centre, (s - along) / cosine, best[1].direction);
    }
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

/* Whether the axis of a face is the direction of the closest points: a corner of the other core
 * that is next to the face lies over it, within its rim as seen along its normal. */
static bool is_closest(const perp__convex_pair *pair, int32_t side, int32_t face, double separation)
{
    const perp__polytope *self = &pair->side[side], *other = &pair->side[1 - side];
    const int32_t count = self->first[face + 1] - self->first[face];
    bool over = 0;
    for (int32_t c = 0; c < other->corners && !over; c++) {
        const double *x = other->corner + 3 * c;
        double height = perp__dot3(self->normal + 3 * face, x) - self->offset[face] - pair->radius;
        over = height <= separation;
        for (int32_t p = 0; p < count && over; p++) {
            double out[3], limit = perp__convex_rim(pair, self, face, p, out);
            over = !(perp__dot3(out, x) > limit);
        }
    }
    return over;
}

/* best: of the other axes, the one that separates most. */
static void closest_axis(const perp__convex_pair *pair, const perp__axis *axes, int32_t best,
                         perp__axis *axis)
{
    const bool bare = pair->side[0].faces == 0 && pair->side[1].faces == 0;
    perp__closest closest;
    axis->separation = -INFINITY;
    axis->normal[0] = axis->normal[1] = axis->normal[2] = 0.0;
    if (!(pair->radius > 0.0))
        return;
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
    if (!bare && closest.distance <= PERP__NEGLIGIBLE * pair->size)
        axis->separation = -INFINITY;
}

bool perp__convex_axes(const perp__convex_pair *pair, double far, perp__axes *axes)
{
    int32_t count = 0, best = 0;
    for (int32_t side = 0; side < 2; side++) {
        axes->faces[side] = pair->side[side].faces;
        for (int32_t f = 0; f < pair->side[side].faces; f++, count++) {
            if (f % GROUP == 0)
                set_faces(pair, side, f, &axes->axis[count]);
            axes->axis[count].number = count;
            best = axes->axis[count].separation > axes->axis[best].separation ? count : best;
            if (axes->axis[count].separation > far) {
                axes->count = count + 1;
                return 0;
            }
        }
    }
    perp__axis *edges = &axes->axis[count], *closest = &axes->axis[count + 1];
    const double *direction = axes->axis[best].normal;
    const double most = axes->axis[best].separation + pair->radius;
    edges->number = PERP__NO_AXIS;
    edges->width = closest->width = INFINITY;
    edges->normal[0] = edges->normal[1] = edges->normal[2] = 0.0;
    edges->separation =
        best_product(pair, direction, 0, most, -INFINITY, INFINITY, edges->normal, &edges->number) -
        pair->radius;
    closest->number = PERP__CLOSEST_AXIS;
    if (edges->separation > axes->axis[best].separation + PERP__NEGLIGIBLE * pair->size)
        best = count; /* else a product that is the face's normal may win by rounding */
    closest_axis(pair, axes->axis, best, closest);
    axes->count = count + 2;
    return 1;
}

double perp__separation_aside(const perp__placed *a, const perp__placed *b, int32_t planar,
                              const perp__axes *axes, int32_t best, double least, double enough)
{
    const bool all = perp__are_boxes(a, b, planar) || perp__is_ball_pair(a, b);
    const int32_t count = all ? axes->count : axes->faces[0] + axes->faces[1];
    const double *direction = axes->axis[best].normal;
    const double radius = a->geometry->radius + b->geometry->radius;
    double normal[3], largest = least;
    perp__convex_pair pair;
    for (int32_t k = 0; k < count; k++)
        if (axes->axis[k].separation + radius > largest &&
            fabs(perp__dot3(axes->axis[k].normal, direction)) < PERP__ASIDE)
            largest = axes->axis[k].separation + radius;
    if (all || largest > enough)
        return largest;
    perp__convex_pair_set(&pair, a, b, planar);
    return best_product(&pair, direction, 1, largest, largest, enough, normal, &(int32_t){0});
}
