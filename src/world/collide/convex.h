/* Two convex shapes of any kind: the directions that may separate them, and the points in which
 * they touch along one. All in the frame of the first shape. */
#ifndef PERP_WORLD_COLLIDE_CONVEX_H
#define PERP_WORLD_COLLIDE_CONVEX_H

#include "world/collide/collision.h"
#include "world/collide/polytope.h"

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
int32_t perp__convex_axes(const perp__convex_pair *pair, double far, perp__axes *axes);

/* The largest separation of the cores along a direction other than that of axis `best`; or `least`
 * where none is more. */
double perp__convex_aside(const perp__convex_pair *pair, const perp__axes *axes, int32_t best,
                          double least);

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
