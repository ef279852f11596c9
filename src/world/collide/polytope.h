/* Convex shapes as one thing: a core with corners, edges and faces, and a radius that rounds it. A
 * sphere's core is a point, a capsule's a segment along x, a box or a hull is its own. */
#ifndef PERP_WORLD_COLLIDE_POLYTOPE_H
#define PERP_WORLD_COLLIDE_POLYTOPE_H

#include <math.h>

#include <perp/world.h>

#include "base/context.h"
#include "world/collide/collide.h"

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
    double corner[3 * PERP__MAX_CORNERS];
    double normal[3 * PERP__MAX_FACES];
    double offset[PERP__MAX_FACES];
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

#endif
