/* When and how two moving shapes meet. */
#ifndef PERP_WORLD_COLLIDE_MEETING_H
#define PERP_WORLD_COLLIDE_MEETING_H

#include "world/collide/collide.h"

/* A shape on its way: the mass centre of its body goes straight, the body turns evenly about it. */
typedef struct perp__moving {
    const perp__placed *start;
    double centre[3]; /* of mass, at the start */
    double way[3];    /* of the mass centre in the whole step */
    double turn[3];   /* rotation vector of the whole step, world frame */
    double reach;     /* largest distance of the shape's points from the mass centre */
} perp__moving;

/* Lengths that tell touching from apart. */
typedef struct perp__nearness {
    double touching; /* shapes no farther apart, nor deeper in each other, touch */
    double grazing;  /* by so much a motion may close touching shapes that it does not press */
    double rounding; /* of separations */
} perp__nearness;

typedef struct perp__meeting {
    double time;      /* share of the step, 0 .. 1 */
    int32_t axis;     /* for perp__collide_along */
    int32_t doubtful; /* the shapes meet near the rim of a face: whether they do may depend on what
                         else stops them before */
    double apart[3];  /* where they don't meet: from A to B, a direction along which no point of */
    double lead;      /* either is nearer to the other than this at the start; 0: not known */
} perp__meeting;

/* Where the shape is after the share t of the step. */
void perp__moved(const perp__moving *shape, double t, perp__placed *placed);

/* Length of the relative way of the two, an upper bound. */
double perp__relative_way(const perp__moving *a, const perp__moving *b);

/* Whether the motion leaves a plane between the shapes, across meeting->apart. */
int32_t perp__stay_apart(const perp__moving *a, const perp__moving *b, const perp__nearness *near,
                         const perp__meeting *meeting);

/* Whether the shapes, none a half-space, touch or overlap at the start in a way that leaves no
 * doubt about the normal: one axis alone keeps them apart. */
int32_t perp__touch_plainly(const perp__moving *a, const perp__moving *b, int32_t planar,
                            const perp__nearness *near, perp__meeting *meeting);

/* Whether the motion makes shapes meet that do not touch plainly. */
int32_t perp__meet(const perp__moving *a, const perp__moving *b, int32_t planar,
                   const perp__nearness *near, perp__meeting *meeting);

/* The points of shapes that meet along an axis of the meeting: as perp__collide, without a margin,
 * whatever separates them more or overlaps less. */
int32_t perp__collide_along(const perp__placed *a, const perp__placed *b, int32_t planar,
                            int32_t axis, perp__point *points);

/* One of the directions of which one separates shapes that are apart (separating axis theorem). */
typedef struct perp__axis {
    double normal[3]; /* unit, in A's frame, from A to B */
    double separation;
    double width; /* half the widths of both: the separation in the other direction is minus this
                     one and twice the width */
} perp__axis;

/* Boxes: 3 faces of A, 3 of B, 9 products of edges, -INFINITY where they are parallel; boxes whose
 * axes are parallel have the 6 faces alone. Rectangles: 2 sides of A, 2 of B. */
#define PERP__MAX_AXES 15
int32_t perp__box_axes(const perp__placed *a, const perp__placed *b, int32_t planar,
                       perp__axis *axes);

/* Separation along a direction of the world that need not be an axis any more. */
double perp__box_separation(const perp__placed *a, const perp__placed *b, const double *normal);

#endif
