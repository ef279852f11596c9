/* Contact points between two placed shapes. One file a shape pair; no file knows of bodies. */
#ifndef PERP_WORLD_COLLIDE_H
#define PERP_WORLD_COLLIDE_H

#include <stdint.h>

/* Order matters: perp__collide sorts a pair by kind. */
enum perp__shape_kind { PERP__PLANE = 0, PERP__BOX = 1, PERP__SPHERE = 2 };

typedef struct perp__geometry {
    int32_t kind;
    double radius;          /* sphere */
    double half_extents[3]; /* box; planar: [2] is 0 */
    double normal[3];       /* plane, unit, shape frame */
    double offset;          /* plane: solid where normal.x <= offset, shape frame */
} perp__geometry;

/* A geometry in the world: x_world = rotation x_shape + position, rotation row by row. */
typedef struct perp__placed {
    const perp__geometry *geometry;
    double position[3];
    double rotation[9];
} perp__placed;

typedef struct perp__point {
    double position[3]; /* midway between the two surfaces */
    double normal[3];   /* unit, from A to B */
    double gap;         /* > 0 separated */
    int32_t feature;    /* tells the points of one pair apart, stable from step to step */
} perp__point;

/* No pair makes more points. */
#define PERP__MAX_POINTS 16

/* Writes the contact points with gap <= margin between A and B, returns how many. planar: the
 * shapes live in the x-y plane (discs, rectangles, half-planes) and so do all points and normals.
 * Two planes make none. Same input, same points in the same order. */
int32_t perp__collide(const perp__placed *a, const perp__placed *b, int32_t planar, double margin,
                      perp__point *points);

/* The pairs; each may assume the kinds in its name, in that order. */
int32_t perp__collide_plane_sphere(const perp__placed *plane, const perp__placed *sphere,
                                   double margin, perp__point *points);
int32_t perp__collide_plane_box(const perp__placed *plane, const perp__placed *box, int32_t planar,
                                double margin, perp__point *points);
int32_t perp__collide_sphere_sphere(const perp__placed *a, const perp__placed *b, int32_t planar,
                                    double margin, perp__point *points);
int32_t perp__collide_box_sphere(const perp__placed *box, const perp__placed *sphere,
                                 int32_t planar, double margin, perp__point *points);
int32_t perp__collide_box_box(const perp__placed *a, const perp__placed *b, double margin,
                              perp__point *points);
int32_t perp__collide_rectangles(const perp__placed *a, const perp__placed *b, double margin,
                                 perp__point *points);
/* Along an axis of perp__box_axes. */
int32_t perp__collide_box_box_along(const perp__placed *a, const perp__placed *b, int32_t axis,
                                    perp__point *points);
int32_t perp__collide_rectangles_along(const perp__placed *a, const perp__placed *b, int32_t axis,
                                       perp__point *points);

/* An axis-aligned box around a shape for the broad phase; a plane's is infinite. `item` is the
 * caller's number. */
typedef struct perp__extent {
    double low[3];
    double high[3];
    int32_t item;
    int32_t group; /* pairs within one group are left out (the body) */
} perp__extent;

typedef struct perp__meeting {
    double time;      /* share of the step, 0 .. 1 */
    int32_t axis;     /* for perp__collide_along */
    int32_t doubtful; /* the shapes meet near the rim of a face: whether they do may depend on what
                         else stops them before */
} perp__meeting;

typedef struct perp__pair {
    int32_t first; /* item numbers, first < second */
    int32_t second;
    int32_t open;   /* the shapes do not touch plainly at the start of the step */
    int32_t met;    /* the motion at hand makes them meet */
    int32_t joined; /* how often their points have come */
    perp__meeting meeting;
} perp__pair;

void perp__extent_of(const perp__placed *shape, double margin, perp__extent *extent);

/* Overlapping pairs of different groups by sort and sweep along x, sorted by (first, second): the
 * order does not depend on positions. Sorts `extents` in place. Writes at most `capacity` pairs and
 * returns how many there are in all. */
int32_t perp__broad_phase(perp__extent *extents, int32_t count, perp__pair *pairs,
                          int32_t capacity);

#endif
