/* Convex shapes as one thing: a core with corners, edges and faces, and a radius that rounds it. A
 * sphere's core is a point, a capsule's a segment along x, a box or a hull is its own. */
#ifndef PERP_WORLD_COLLIDE_POLYTOPE_H
#define PERP_WORLD_COLLIDE_POLYTOPE_H

#include <math.h>

#include <perp/world.h>

#include "base/context.h"
#include "world/collide/collision.h"

#define PERP__MAX_CORNERS PERP_MAX_HULL_CORNERS
/* Euler: a polyhedron with n corners has at most 2n - 4 faces, and 3n - 6 edges. */
#define PERP__MAX_FACES (2 * PERP__MAX_CORNERS - 4)
#define PERP__MAX_EDGES (3 * PERP__MAX_CORNERS - 6)

/* In the plane a face is a side: two corners, and itself the one edge. */
typedef struct perp__polytope {
    int32_t corners, faces, edges;
    const double *corner; /* 3 numbers each, as normals */
    const double *normal; /* of faces, unit, out */
    const double *offset; /* of faces: inside where normal.x <= offset */
    const int32_t *first; /* where a face's corners start in `loop`; one more at the end */
    const int32_t *loop;  /* anticlockwise as seen from outside */
    const int32_t *side;  /* the edge from a corner of `loop` to the face's next */
    const int32_t *edge;  /* 4 each: from, to, the faces to the left and to the right */
    double radius;
} perp__polytope;

/* Numbers of a polytope that are made for a while. */
typedef struct perp__polytope_room {
    double corner[3 * PERP__MAX_CORNERS], normal[3 * PERP__MAX_FACES], offset[PERP__MAX_FACES];
} perp__polytope_room;

/* Any shape but a half-space, in its own frame. */
void perp__polytope_of(const perp__geometry *geometry, int32_t planar, perp__polytope_room *room,
                       perp__polytope *polytope);

/* x becomes R x + t, in the room's numbers. */
void perp__polytope_move(perp__polytope *polytope, const double *R, const double *t,
                         perp__polytope_room *room);

/* The largest normal.x over the shape, in its own frame. */
double perp__reach_of_hull(const struct perp__hull *hull, const double *normal);
static inline double perp__reach_of(const perp__geometry *geometry, const double *normal)
{
    const double *half = geometry->half_extents;
    if (geometry->kind == PERP__HULL)
        return perp__reach_of_hull(geometry->hull, normal);
    return half[0] * fabs(normal[0]) + half[1] * fabs(normal[1]) + half[2] * fabs(normal[2]) +
           geometry->radius;
}

/* hull.c: the convex hull of points, about the centre of what it encloses. */
typedef struct perp__hull {
    perp__polytope polytope;
    double volume;     /* planar: area */
    double moments[9]; /* inertia at density 1 about the centre */
    double half[3];    /* largest coordinates */
    double reach;      /* largest distance of a corner from the centre */
    double thickness;  /* half of the least width of a face's normal */
} perp__hull;

/* The hull of `count` points, 3 numbers each, in memory of its own, which perp__release frees, and
 * its centre. Fails where the points enclose nothing, with their numbers in the message. */
perp_status perp__hull_make(perp_context *context, perp__hull **hull, double *centre,
                            const double *points, int32_t count, int32_t planar);

/* Two convex shapes of any kind: the directions that may separate them, and the points in which
 * they touch along one. All in the frame of the first shape. */

/* Numbers of axes that are no face's and no edges'. */
enum { PERP__CLOSEST_AXIS = -1, PERP__NO_AXIS = -2 };

typedef struct perp__convex_pair {
    perp__polytope side[2]; /* A and B */
    const perp__placed *frame;
    int32_t planar;
    int32_t boxes; /* both, in space: axes have the numbers of perp__box_axes */
    double radius; /* of both */
    double size;   /* of the smaller shape */
    perp__polytope_room room[2];
} perp__convex_pair;

void perp__convex_pair_set(perp__convex_pair *pair, const perp__placed *a, const perp__placed *b,
                           int32_t planar);

/* The faces of A, those of B, the product of edges that separates most (three dimensions), and for
 * rounded shapes the direction between the points of the cores that are closest, where it is none
 * of a face; -INFINITY where there is none. Widths are INFINITY. Returns 0, and not all of them,
 * where a face keeps them farther apart than `far`. */
bool perp__convex_axes(const perp__convex_pair *pair, double far, perp__axes *axes);

/* How far axis `best` alone decides: the largest separation of the cores along other directions, or
 * one that is more than `enough`; or `least` where none is more. */
double perp__separation_aside(const perp__placed *a, const perp__placed *b, int32_t planar,
                              const perp__axes *axes, int32_t best, double least, double enough);

/* One face of A (side 0) or B. */
void perp__convex_face(const perp__convex_pair *pair, int32_t side, int32_t face, perp__axis *axis);

/* The product of edge i of A with edge j of B, and the separation of the cores along it; -INFINITY
 * where it is no axis. */
double perp__convex_product(const perp__convex_pair *pair, int32_t i, int32_t j, double *normal);

/* The points centre + s direction, |s| <= half. */
typedef struct perp__segment {
    double centre[3];
    double direction[3]; /* unit */
    double half;
} perp__segment;

/* The closest points of two segments. Where a whole stretch is closest (parallel segments) its
 * middle is taken. Returns 1 if the segments are parallel, to 1e-7. */
int perp__segment_closest(const perp__segment *a, const perp__segment *b, double *on_a,
                          double *on_b);

void perp__segment_of_edge(const perp__polytope *polytope, int32_t edge, perp__segment *segment);

/* The closest points of the edges of both cores, or, of rounded shapes, the stretch in which two
 * that are parallel come closest. */
typedef struct perp__closest {
    double on[2][2][3]; /* point; of A, of B */
    int32_t count;      /* of points */
    double distance;
    double direction[3]; /* from A to B; rounding where the distance is, but for two segments */
} perp__closest;

void perp__convex_closest(const perp__convex_pair *pair, perp__closest *closest);

/* The side of a face's rim from its corner p on: inside where out.x <= what is returned. */
double perp__convex_rim(const perp__convex_pair *pair, const perp__polytope *polytope, int32_t face,
                        int32_t p, double *out);

/* convex_points.c: the points along an axis, by its number, with gap <= margin. Writes up to
 * PERP__MAX_POINTS and returns how many. */
int32_t perp__convex_points(const perp__convex_pair *pair, int32_t number, double margin,
                            perp__point *points);

#endif
