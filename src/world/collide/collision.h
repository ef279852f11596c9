/* When and how two moving shapes meet. */
#ifndef PERP_WORLD_COLLIDE_COLLISION_H
#define PERP_WORLD_COLLIDE_COLLISION_H

#include <perp/world.h>

#include "world/collide/collide.h"

/* A shape on its way: the mass centre of its body goes straight, the body turns evenly about it. */
typedef struct perp__moving {
    const perp__placed *start;
    double centre[3];       /* of mass, at the start */
    double displacement[3]; /* of the mass centre in the whole step */
    double turn[3];         /* rotation vector of the whole step, world frame */
    double reach;           /* largest distance of the shape's points from the mass centre */
} perp__moving;

/* Lengths that tell touching from apart. */
typedef struct perp__touch_tolerance {
    double touching; /* shapes no farther apart, nor deeper in each other, touch */
    double grazing;  /* by so much a motion may close touching shapes that it does not press */
    double rounding; /* of separations */
} perp__touch_tolerance;

typedef struct perp__collision {
    double time;      /* share of the step, 0 .. 1 */
    int32_t axis;     /* its number */
    int32_t doubtful; /* the shapes meet near the rim of a face: whether they do may depend on what
                         else stops them before */
    double begun;     /* of what sinks: its separation at the start, no point's gap is less there */
    double apart[3];  /* from A to B, a direction along which no point of either is nearer to the */
    double clearance; /* other at the start than this and what counts as touching, or, of what has
                    points, as deep; 0: not known */
} perp__collision;

/* Where the shape is after the share t of the step. */
void perp__moved(const perp__moving *shape, double t, perp__placed *placed);

/* Length of the relative way of the two, an upper bound. */
double perp__relative_displacement(const perp__moving *a, const perp__moving *b);

/* Whether the shapes, none a half-space, touch or overlap at the start, where they have these axes,
 * in a way that leaves no doubt about the normal: one axis alone keeps them apart. */
struct perp__axes;
bool perp__touch_plainly(const perp__moving *a, const perp__moving *b, int32_t planar,
                         const perp__touch_tolerance *tolerance, const struct perp__axes *axes,
                         perp__collision *collision);

/* Whether the motion makes shapes meet that do not touch plainly; -1: the looks end before it. */
int32_t perp__find_collision(const perp__moving *a, const perp__moving *b, int32_t planar,
                             const perp__touch_tolerance *tolerance, perp__collision *collision);

/* The points of shapes that meet along an axis of the collision: as perp__collide, without a
 * margin, whatever separates them more or overlaps less. */
int32_t perp__collide_along(const perp__placed *a, const perp__placed *b, int32_t planar,
                            int32_t axis, perp__point *points);

/* Whether the point lies inside the shape, by more than `depth`. */
bool perp__holds(const perp__placed *shape, const double *point, double depth);

/* A position on the surface of a shape that makes the normal there. */
typedef struct perp__footing {
    const double *position, *normal;
    double rim, crack;
    int32_t planar, least;
} perp__footing;

/* Of each face within `rim` of a footing, its normal and the point `crack` before it; none if fewer
 * than `least` such faces. Round shapes have none. Returns how many. */
#define PERP__MAX_PROBES 16
int32_t perp__probe_faces(const perp__placed *shape, const perp__footing *at, double probes[][3],
                          double normals[][3]);

/* One of the directions of which one separates shapes that are apart (separating axis theorem). */
typedef struct perp__axis {
    int32_t number;   /* for perp__collide_along */
    double normal[3]; /* unit, in A's frame, from A to B */
    double separation;
    double width; /* half the widths of both: the separation in the other direction is minus this
                     one and twice the width */
} perp__axis;

/* The faces of A, those of B, then what edges make; separations of -INFINITY are none. */
#define PERP__MAX_AXES (2 * (2 * PERP_MAX_HULL_CORNERS - 4) + 2)
typedef struct perp__axes {
    int32_t count, faces[2];
    perp__axis axis[PERP__MAX_AXES];
} perp__axes;

/* Looks along one way, at most: of a turn of a fast body, and of an arc. */
#define PERP__MAX_LOOKS 160

/* Cosine of the angle from which on two axes count as different directions. */
#define PERP__ASIDE 0.9

/* Sine of the angle below which two directions are one. The product of such edges is no axis of its
 * own: its direction would be rounding, and the face normals stand in for it to 1e-6 of an edge's
 * length. A normal is made by the faces with whose normals it has more than this in common. */
#define PERP__PARALLEL 1e-6
static inline bool perp__is_same_way(double cosine)
{
    return cosine >= 1.0 - PERP__PARALLEL * PERP__PARALLEL;
}

/* Angle between a direction and a face's normal, or two edges, below which faces or stretches of
 * edges meet rather than points: so much of a tilt makes a little gap. What rests on others tilts
 * by less; its support then is a polygon still. */
#define PERP__FLAT PERP__NEAR

/* Boxes in space: 3 faces each and 9 products of edges; boxes whose axes are parallel have the 6
 * faces alone, and so have those that a face keeps farther apart than `far`. A face axis is that of
 * either side. */
#define PERP__BOX_AXES 15
void perp__box_axes(const perp__placed *a, const perp__placed *b, double far, perp__axes *axes);
/* A ball and a box, or another ball: the faces of the box, and the line between the closest points
 * where it is none of these. */
void perp__ball_axes(const perp__placed *a, const perp__placed *b, int32_t planar,
                     perp__axes *axes);
/* Of any shape: its largest coordinate. */
double perp__size_of(const perp__placed *shape);
int perp__box_is_smaller(const perp__placed *a, const perp__placed *b);

/* The axes of any two shapes but half-spaces. Returns 0 where a face keeps them farther apart than
 * `far`: then it is the last one found. */
bool perp__axes_of(const perp__placed *a, const perp__placed *b, int32_t planar, double far,
                   perp__axes *axes);

/* The axis with the largest sum of separation and gate (NULL: none). The faces of the larger shape
 * are preferred, then the other's, then edges, so that rounding does not choose. */
int32_t perp__last_to_close(const perp__placed *a, const perp__placed *b, const perp__axes *axes,
                            const double *gate);

/* Where shapes touch in an edge or a corner of both, several of their faces touch, and each of the
 * normals between theirs separates the shapes: the middle one, which rounding does not choose and
 * which is the same seen from either. `within` (or NULL): the cosine of the widest angle between it
 * and one of them; 0 where faces of both lie in one plane, along which each may slide. Returns 0
 * where no two directions of faces touch. */
#define PERP__MIDDLE_AXIS (-3)
bool perp__middle_of_faces(const perp__axes *axes, double touching, double *normal, double *within);

/* Separation along a direction of the world that need not be an axis any more. */
double perp__separation(const perp__placed *a, const perp__placed *b, const double *normal);

#endif
