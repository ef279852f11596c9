/* The convex hull of points, with merged faces, and what it weighs.
 *
 * Quickhull (Barber, Dobkin & Huhdanpaa 1996) without its lists: the point farthest beyond a face
 * is a corner, and takes the place of the faces that it sees. Points that are less than
 * FLT_EPSILON beyond a face lie on it, as those of meshes do; twice as much where noise of that
 * size tears the surface, until it is whole. Hulls have few corners (PERP__MAX_CORNERS), so that
 * looking at everything is fast enough. All in units of a power of two near the points' size. */
#include "world/collide/polytope.h"

#include <float.h>
#include <string.h>

#include "base/rounding.h"
#include "linalg/spatial.h"

enum { NONE = -1 };

typedef struct triangle {
    int32_t corner[3]; /* numbers of corners */
    int32_t face;
    double normal[3], offset;
    double area; /* twice the triangle's */
} triangle;

typedef struct work {
    perp_context *context;
    const double *points; /* the caller's */
    int32_t count, planar;
    double middle[3]; /* of the points' box */
    int exponent;     /* the points lie within 2^exponent of it */
    double flat;      /* what is less far beyond a face lies on it */
    int32_t torn;     /* the triangles are no closed surface */
    int32_t corners;
    int32_t corner[PERP__MAX_CORNERS]; /* numbers of points */
    int32_t triangles;                 /* planar: sides, with two corners each */
    int32_t faces;
    triangle triangle[2 * PERP__MAX_FACES]; /* before those that a corner replaces are gone */
} work;

static void point_of(const work *w, int32_t i, double *x)
{
    for (int k = 0; k < 3; k++)
        x[k] = ldexp(w->points[3 * i + k] - w->middle[k], -w->exponent);
}

static perp_status measure(work *w)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double half = 0.0;
    for (int32_t i = 0; i < w->count; i++)
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], w->points[3 * i + k]);
            high[k] = fmax(high[k], w->points[3 * i + k]);
        }
    for (int k = 0; k < 3; k++) {
        w->middle[k] = 0.5 * low[k] + 0.5 * high[k];
        half = fmax(half, 0.5 * high[k] - 0.5 * low[k]);
    }
    frexp(half, &w->exponent);
    return half > 0.0
               ? PERP_OK
               : perp__refuse(w->context, "points[0 .. %d] are all the same", (int)w->count - 1);
}

/* Through three corners; in the plane through two. */
static void set_plane(const work *w, triangle *t)
{
    double x[3][3], u[3], v[3];
    for (int k = 0; k < (w->planar ? 2 : 3); k++)
        point_of(w, w->corner[t->corner[k]], x[k]);
    perp__subtract3(u, x[1], x[0]);
    if (w->planar) {
        t->normal[0] = u[1];
        t->normal[1] = -u[0];
        t->normal[2] = 0.0;
    } else {
        perp__subtract3(v, x[2], x[0]);
        perp__cross(t->normal, u, v);
    }
    t->area = perp__normalise3(t->normal);
    t->offset = perp__dot3(t->normal, x[0]);
    t->face = NONE;
}

static double beyond(const work *w, const triangle *t, int32_t i)
{
    double x[3];
    point_of(w, i, x);
    return perp__dot3(t->normal, x) - t->offset;
}

/* Two points far apart, the one farthest from their line and, in space, from the three's plane. */
static perp_status start(work *w, int32_t *simplex)
{
    double x0[3] = {0.0, 0.0, 0.0}, along[3] = {0.0, 0.0, 0.0}, most = 0.0;
    for (int found = 0; found < 3; found++) {
        most = 0.0;
        simplex[found] = 0;
        for (int32_t i = 0; i < w->count; i++) {
            double x[3], between[3], off[3];
            point_of(w, i, x);
            perp__subtract3(between, x, x0);
            perp__copy3(off, between);
            if (found == 2)
                perp__cross(off, along, between);
            if (perp__dot3(off, off) > most) {
                most = perp__dot3(off, off);
                simplex[found] = i;
            }
        }
        if (found == 0) {
            point_of(w, simplex[0], x0);
        } else if (found == 1) {
            point_of(w, simplex[1], along);
            perp__add3(along, -1.0, x0);
            perp__normalise3(along);
        }
    }
    if (most > w->flat * w->flat)
        return PERP_OK;
    return perp__refuse(w->context,
                        "points enclose nothing: all are near the line of points [%d] and [%d]",
                        (int)simplex[0], (int)simplex[1]);
}

static perp_status add_corner(work *w, int32_t point)
{
    for (int32_t c = 0; c < w->corners; c++)
        w->torn |= w->corner[c] == point;
    if (w->torn)
        return PERP_OK;
    if (w->corners == PERP__MAX_CORNERS)
        return perp__refuse(
            w->context, "points have a hull of more than %d corners, of which points[%d] is one",
            PERP__MAX_CORNERS, (int)point);
    w->corner[w->corners++] = point;
    return PERP_OK;
}

static void add_triangle(work *w, int32_t a, int32_t b, int32_t c)
{
    triangle *t = &w->triangle[w->triangles++];
    t->corner[0] = a;
    t->corner[1] = b;
    t->corner[2] = c;
    set_plane(w, t);
}

static perp_status first_triangles(work *w)
{
    int32_t *s = w->corner;
    triangle base = {{0, 1, 2}, NONE, {0.0, 0.0, 0.0}, 0.0, 0.0};
    double side;
    perp_status status = start(w, s);
    if (status != PERP_OK)
        return status;
    w->corners = w->planar ? 3 : 4;
    set_plane(w, &base);
    if (w->planar) {
        side = -beyond(w, &base, s[2]);
    } else {
        double most = 0.0;
        for (int32_t i = 0; i < w->count; i++)
            if (fabs(beyond(w, &base, i)) > fabs(most)) {
                most = beyond(w, &base, i);
                s[3] = i;
            }
        if (!(fabs(most) > w->flat))
            return perp__refuse(w->context,
                                "points enclose nothing: all are near the plane of points "
                                "[%d], [%d] and [%d]",
                                (int)s[0], (int)s[1], (int)s[2]);
        side = -most;
    }
    if (side < 0.0) { /* the base shall face away from the last */
        int32_t swapped = s[0];
        s[0] = s[1];
        s[1] = swapped;
    }
    if (!w->planar)
        add_triangle(w, 0, 1, 2);
    for (int32_t i = 0; i < 3; i++) {
        const int32_t next = (i + 1) % 3;
        add_triangle(w, w->planar ? i : next, w->planar ? next : i, w->planar ? NONE : 3);
    }
    return status;
}

/* The triangle with the edge from a to b, NONE without one. */
static int32_t with_edge(const work *w, int32_t a, int32_t b)
{
    for (int32_t t = 0; t < w->triangles; t++)
        for (int32_t i = 0; i < 3; i++)
            if (w->triangle[t].corner[i] == a && w->triangle[t].corner[(i + 1) % 3] == b)
                return t;
    return NONE;
}

/* New triangles from the rim of those that see the last corner take their place. */
static void replace_seen(work *w)
{
    int32_t before = w->triangles, sleeping = 0, last = w->corners - 1;
    int8_t seen[2 * PERP__MAX_FACES];
    for (int32_t t = 0; t < before; t++)
        seen[t] = beyond(w, &w->triangle[t], w->corner[last]) > w->flat;
    for (int32_t t = 0; t < before; t++)
        for (int32_t i = 0; i < 3 && seen[t]; i++) {
            int32_t a = w->triangle[t].corner[i], b = w->triangle[t].corner[(i + 1) % 3];
            int32_t other = with_edge(w, b, a);
            if (other != NONE && other < before && !seen[other] &&
                w->triangles < 2 * PERP__MAX_FACES)
                add_triangle(w, a, b, last);
        }
    for (int32_t t = 0; t < w->triangles; t++)
        if (t >= before || !seen[t])
            w->triangle[sleeping++] = w->triangle[t];
    w->triangles = sleeping;
}

static perp_status grow(work *w)
{
    perp_status status = first_triangles(w);
    for (int32_t t = 0; t < w->triangles && status == PERP_OK && !w->torn;) {
        double best = w->flat, best_out = 0.0;
        int32_t point = NONE;

        /* 1. the point farthest beyond the face, NONE if all are on it or inside; of points equally
         * far that which is farthest from the middle: the others may lie between corners */
        for (int32_t i = 0; i < w->count; i++) {
            const double far = beyond(w, &w->triangle[t], i);
            double x[3];
            if (far <= w->flat || far < best - w->flat)
                continue;
            point_of(w, i, x);
            const double out = perp__dot3(x, x);
            if (point == NONE || far > best + w->flat || out > best_out) {
                best = fmax(best, far);
                best_out = out;
                point = i;
            }
        }
        if (point == NONE) {
            t++;
            continue;
        }

        /* 2. it is a corner, from which the faces that see it are new; a side is cut in two */
        status = add_corner(w, point);
        if (status == PERP_OK && w->planar) {
            const int32_t end = w->triangle[t].corner[1];
            w->triangle[t].corner[1] = w->corners - 1;
            set_plane(w, &w->triangle[t]);
            add_triangle(w, w->corners - 1, end, NONE);
        } else if (status == PERP_OK) {
            replace_seen(w);
            t = 0;
        }
    }
    return status;
}

/* ---- faces ---- */

/* Triangles that lie in the plane of another, larger one are one face with it. */
static void merge(work *w)
{
    int32_t stack[2 * PERP__MAX_FACES], depth, seed;
    do {
        double largest = -1.0;
        seed = NONE;
        for (int32_t t = 0; t < w->triangles; t++)
            if (w->triangle[t].face == NONE && w->triangle[t].area > largest) {
                largest = w->triangle[t].area;
                seed = t;
            }
        depth = seed != NONE;
        stack[0] = seed;
        if (seed != NONE)
            w->triangle[seed].face = w->faces++;
        while (depth > 0) {
            const triangle *t = &w->triangle[stack[--depth]];
            for (int32_t i = 0; i < 3; i++) {
                const int32_t other = with_edge(w, t->corner[(i + 1) % 3], t->corner[i]);
                bool flat = other != NONE && w->triangle[other].face == NONE;
                for (int32_t k = 0; k < 3 && flat; k++)
                    flat = fabs(beyond(w, &w->triangle[seed],
                                       w->corner[w->triangle[other].corner[k]])) <= 2.0 * w->flat;
                if (!flat)
                    continue;
                w->triangle[other].face = t->face;
                stack[depth++] = other;
            }
        }
    } while (seed != NONE);
}

/* Where the parts of a hull are; all in one block. */
typedef struct parts {
    double *corner, *normal, *offset;
    int32_t *first, *loop, *side, *edge;
} parts;

static perp__hull *allocate(const work *w, parts *p)
{
    size_t corners = (size_t)w->corners, faces = (size_t)w->triangles, sides = 3 * faces;
    size_t numbers = 3 * corners + 4 * faces, whole = faces + 1 + 2 * sides + 2 * sides;
    perp__hull *hull = perp__allocate(
        w->context, 1, sizeof *hull + numbers * sizeof(double) + whole * sizeof(int32_t));
    if (!hull)
        return NULL;
    memset(hull, 0, sizeof *hull);
    p->corner = (double *)(hull + 1);
    p->normal = p->corner + 3 * corners;
    p->offset = p->normal + 3 * faces;
    p->first = (int32_t *)(p->offset + faces);
    p->loop = p->first + faces + 1;
    p->side = p->loop + sides;
    p->edge = p->side + sides;
    return hull;
}

/* The corner after a on the rim of the face, NONE if a is not on it. */
static int32_t next_on_rim(const work *w, int32_t face, int32_t a)
{
    for (int32_t t = 0; t < w->triangles; t++)
        for (int32_t i = 0; i < 3 && w->triangle[t].face == face; i++) {
            int32_t b = w->triangle[t].corner[(i + 1) % 3];
            int32_t other = w->triangle[t].corner[i] == a ? with_edge(w, b, a) : NONE;
            if (other != NONE && w->triangle[other].face != face)
                return b;
        }
    return NONE;
}

/* The edge from a to b, which has face to its left; a new one, or the one from b to a. */
static int32_t edge_of(perp__polytope *polytope, int32_t *edge, int32_t a, int32_t b, int32_t face)
{
    for (int32_t e = 0; e < polytope->edges; e++)
        if (edge[4 * e] == b && edge[4 * e + 1] == a) {
            edge[4 * e + 3] = face;
            return e;
        }
    int32_t *made = edge + 4 * polytope->edges;
    made[0] = a;
    made[1] = b;
    made[2] = made[3] = face;
    return polytope->edges++;
}

/* Area-weighted normal of a face's polygon, and the offset behind which every corner lies. */
static void write_plane(const work *w, const parts *p, int32_t face)
{
    double normal[3] = {0.0, 0.0, 0.0}, u[3], v[3], cross[3];
    const int32_t *loop = p->loop + p->first[face];
    int32_t count = p->first[face + 1] - p->first[face];
    const double *x0 = p->corner + 3 * loop[0];
    if (w->planar) {
        perp__subtract3(u, p->corner + 3 * loop[1], x0);
        normal[0] = u[1];
        normal[1] = -u[0];
    }
    for (int32_t i = 1; i + 1 < count; i++) {
        perp__subtract3(u, p->corner + 3 * loop[i], x0);
        perp__subtract3(v, p->corner + 3 * loop[i + 1], x0);
        perp__cross(cross, u, v);
        perp__add3(normal, 1.0, cross);
    }
    perp__normalise3(normal);
    perp__copy3(p->normal + 3 * face, normal);
    p->offset[face] = -INFINITY;
    for (int32_t c = 0; c < w->corners; c++)
        p->offset[face] = fmax(p->offset[face], perp__dot3(normal, p->corner + 3 * c));
}

/* Loops, from the corner of the lowest number on, and edges; 0 where rounding tore the surface. */
static bool write_topology(const work *w, perp__polytope *polytope, const parts *p)
{
    int32_t sides = 0, whole = 1;
    for (int32_t f = 0; f < polytope->faces && whole; f++) {
        int32_t *loop = p->loop + sides, count = 0, from = NONE, at;
        p->first[f] = sides;

        /* 1. the rim; in the plane a face is a side */
        for (; w->planar && count < 2; count++)
            loop[count] = w->triangle[f].corner[count];
        for (int32_t c = 0; c < w->corners && from == NONE && !w->planar; c++)
            if (next_on_rim(w, f, c) != NONE)
                from = c;
        for (at = from; at != NONE && count < w->corners; at = next_on_rim(w, f, at)) {
            if (count > 0 && at == from)
                break;
            loop[count++] = at;
        }
        whole = w->planar || (at == from && count >= 3);

        /* 2. its edges; that of a side is the side itself */
        for (int32_t i = 0; i < count && whole; i++)
            p->side[sides + i] =
                w->planar && i == 1 ? f
                                    : edge_of(polytope, p->edge, loop[i], loop[(i + 1) % count], f);
        sides += count;
    }
    p->first[polytope->faces] = sides;
    return whole && (w->planar || (2 * polytope->edges == sides &&
                                   polytope->corners - polytope->edges + polytope->faces == 2));
}

/* ---- what it weighs ---- */

/* Volume, mass centre and inertia, in the caller's units. In scaled ones the moments about the
 * middle are sums over the tetrahedra from there over each triangle of D = det[a b c] (planar:
 * triangles, D = a x b):
 *   volume D/6,  first moments D/24 (a + b + c),  int x x' = D/120 (aa' + bb' + cc' + ss')
 * with s = a + b + c; planar D/2, D/6 s, D/24 (aa' + bb' + ss'). */
static void weigh(const work *w, perp__hull *hull, double *centre)
{
    const int dimension = w->planar ? 2 : 3;
    double volume = 0.0, first[3] = {0.0}, second[9] = {0.0}, trace = 0.0;

    /* 1. about the middle */
    for (int32_t t = 0; t < w->triangles; t++) {
        double x[3][3], cross[3], s[3], det;
        for (int i = 0; i < dimension; i++)
            point_of(w, w->corner[w->triangle[t].corner[i]], x[i]);
        perp__cross(cross, x[0], x[1]);
        det = w->planar ? cross[2] : perp__dot3(cross, x[2]);
        for (int k = 0; k < 3; k++)
            s[k] = x[0][k] + x[1][k] + (w->planar ? 0.0 : x[2][k]);
        volume += det / (w->planar ? 2.0 : 6.0);
        perp__add3(first, det / (w->planar ? 6.0 : 24.0), s);
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++) {
                double products = s[k] * s[l];
                for (int i = 0; i < dimension; i++)
                    products += x[i][k] * x[i][l];
                second[3 * k + l] += det / (w->planar ? 24.0 : 120.0) * products;
            }
    }

    /* 2. about the centre: I = trace(S) E - S */
    for (int k = 0; k < 3; k++)
        centre[k] = first[k] / volume;
    if (perp__largest3(centre) <= PERP__SUM_ROUNDING) /* it is the middle of the points */
        centre[0] = centre[1] = centre[2] = 0.0;
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++)
            second[3 * k + l] -= volume * centre[k] * centre[l];
    for (int k = 0; k < 3; k++)
        trace += second[4 * k];
    for (int k = 0; k < 9; k++)
        hull->moments[k] =
            ldexp((k % 4 == 0 ? trace : 0.0) - second[k], (dimension + 2) * w->exponent);
    hull->volume = ldexp(volume, dimension * w->exponent);
}

/* The hull that others read: all in the caller's units, about the centre. */
static perp_status finish(work *w, perp__hull **made, double *centre)
{
    parts p;
    perp__hull *hull;
    perp__polytope *polytope;

    /* 1. faces, and what they weigh */
    if (w->planar)
        w->faces = w->triangles;
    else
        merge(w);
    hull = allocate(w, &p);
    if (!hull)
        return perp__fail_memory(w->context, "a hull");
    polytope = &hull->polytope;
    *polytope = (perp__polytope){w->corners, w->faces, 0,      p.corner, p.normal, p.offset,
                                 p.first,    p.loop,   p.side, p.edge,   0.0};
    weigh(w, hull, centre);

    /* 2. corners, loops and planes */
    for (int32_t c = 0; c < w->corners; c++) {
        double x[3];
        point_of(w, w->corner[c], x);
        for (int k = 0; k < 3; k++) {
            x[k] = ldexp(x[k] - centre[k], w->exponent);
            hull->half[k] = fmax(hull->half[k], fabs(x[k]));
        }
        perp__copy3(p.corner + 3 * c, x);
        hull->reach = fmax(hull->reach, perp__length3(x));
    }
    if (!write_topology(w, polytope, &p)) {
        perp__release(w->context, hull);
        w->torn = 1;
        return PERP_OK;
    }
    hull->thickness = INFINITY;
    for (int32_t f = 0; f < polytope->faces; f++) {
        double back = 0.0;
        write_plane(w, &p, f);
        for (int32_t c = 0; c < polytope->corners; c++)
            back = fmin(back, perp__dot3(p.normal + 3 * f, p.corner + 3 * c));
        hull->thickness = fmin(hull->thickness, 0.5 * (p.offset[f] - back));
    }
    for (int k = 0; k < 3; k++)
        centre[k] = w->middle[k] + ldexp(centre[k], w->exponent);
    *made = hull;
    return PERP_OK;
}

perp_status perp__hull_make(perp_context *context, perp__hull **hull, double *centre,
                            const double *points, int32_t count, int32_t planar)
{
    work *w = perp__allocate_zeros(context, 1, sizeof *w, "a hull");
    if (!w)
        return PERP_ERROR_MEMORY;
    w->context = context;
    w->points = points;
    w->count = count;
    w->planar = planar;
    perp_status status = measure(w);
    w->torn = 1;
    for (w->flat = FLT_EPSILON; w->torn && status == PERP_OK; w->flat *= 2.0) {
        w->corners = w->triangles = w->faces = w->torn = 0;
        status = grow(w);
        if (status == PERP_OK && !w->torn)
            status = finish(w, hull, centre);
    }
    perp__release(context, w);
    return status;
}
