/* Closest points of straight edges. */
#ifndef PERP_WORLD_COLLIDE_SEGMENT_H
#define PERP_WORLD_COLLIDE_SEGMENT_H

#include <stdint.h>

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

/* Edge `number` of a box, 0 .. 11, or of a rectangle in the x-y plane, 0 .. 3, in the frame in
 * which the box's centre is `centre` and its axes are the columns of `axes`. Edges of axis j have
 * the numbers 4j .. 4j + 3 (rectangle: 2j, 2j + 1); the number's lowest bits tell the sides on the
 * axes that follow j cyclically. */
void perp__segment_of_box(perp__segment *edge, const double *half, const double *axes,
                          const double *centre, int32_t planar, int32_t number);

/* A box or rectangle as for perp__segment_of_box. */
typedef struct perp__box_edges {
    const double *half;
    const double *axes;
    const double *centre;
} perp__box_edges;

/* The closest points of two boxes' edges. They are the closest points of the boxes unless a corner
 * is closest to a face. */
void perp__segment_closest_edges(const perp__box_edges *a, const perp__box_edges *b, int32_t planar,
                                 double *on_a, double *on_b);

#endif
