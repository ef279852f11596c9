/* Contact points between two placed shapes. No file here knows of bodies. */
#ifndef PERP_WORLD_COLLIDE_H
#define PERP_WORLD_COLLIDE_H

#include <stdbool.h>
#include <stdint.h>

/* Order matters: perp__collide sorts a pair by kind. */
enum perp__shape_kind { PERP__PLANE, PERP__BOX, PERP__SPHERE, PERP__CAPSULE, PERP__HULL };

typedef struct perp__geometry {
    int32_t kind;
    double radius;          /* sphere, capsule */
    double half_extents[3]; /* box; capsule: [0], half of the segment along x; hull: largest
                               coordinates; planar: [2] is 0 */
    double normal[3];       /* plane, unit, shape frame */
    double offset;          /* plane: solid where normal.x <= offset, shape frame */
    struct perp__hull *hull;
} perp__geometry;

/* A geometry in the world: x_world = rotation x_shape + position, rotation row by row. */
typedef struct perp__placed {
    const perp__geometry *geometry;
    double position[3];
    double radius; /* of a sphere about it that holds a body's shape; half-spaces: INFINITY */
    double rotation[9];
} perp__placed;

typedef struct perp__point {
    double position[3]; /* midway between the two surfaces */
    double normal[3];   /* unit, from A to B */
    double gap;         /* > 0 separated */
    int32_t feature;    /* tells the points of one pair apart, stable from step to step */
} perp__point;

/* Beside sizes or terms, a length or a velocity that counts as none: shapes touch, a corner stands
 * on a face, points lie in one plane. Corners of boxes that were turned are coplanar to 1e-15, and
 * resting bodies drift by less. */
#define PERP__NEGLIGIBLE 1e-9

/* Beside the size of what touches: a gap or an overlap that is little. Such points take part from
 * the start, and such overlaps are left as they are. */
#define PERP__NEAR 1e-3

/* No pair makes more points: of faces that have more corners in common some are left out. */
#define PERP__MAX_POINTS 64

/* Writes one point: position and normal in the frame of a placed shape. */
void perp__emit_point(const perp__placed *frame, const double *position, const double *normal,
                      double gap, int32_t feature, perp__point *point);

/* Writes the contact points with gap <= margin between A and B, returns how many. planar: the
 * shapes live in the x-y plane (discs, rectangles, half-planes) and so do all points and normals.
 * Two planes make none. Same input, same points in the same order. */
int32_t perp__collide(const perp__placed *a, const perp__placed *b, int32_t planar, double margin,
                      perp__point *points);

/* Any two shapes but half-spaces. */
int32_t perp__collide_convex(const perp__placed *a, const perp__placed *b, int32_t planar,
                             double margin, perp__point *points);

static inline bool perp__are_boxes(const perp__placed *a, const perp__placed *b, int32_t planar)
{
    return !planar && a->geometry->kind == PERP__BOX && b->geometry->kind == PERP__BOX;
}

/* A ball against a ball or a box. */
static inline bool perp__is_ball_pair(const perp__placed *a, const perp__placed *b)
{
    const int32_t kind = a->geometry->kind, other = b->geometry->kind;
    return kind <= PERP__SPHERE && other <= PERP__SPHERE &&
           (kind == PERP__SPHERE || other == PERP__SPHERE);
}

/* An axis-aligned box around a shape; a plane's is infinite. */
typedef struct perp__bounds {
    double low[3], high[3];
} perp__bounds;

void perp__extent_of(const perp__placed *shape, double margin, perp__bounds *extent);

#endif
