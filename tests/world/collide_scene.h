/* Random poses and an independent view of boxes, for the tests of contact points. */
#ifndef PERP_TESTS_COLLIDE_SCENE_H
#define PERP_TESTS_COLLIDE_SCENE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "world/collide/collide.h"

/* splitmix64 (Steele, Lea & Flood 2014) */
static inline uint64_t scene_bits(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

static inline double scene_uniform(uint64_t *state, double low, double high)
{
    return low + (high - low) * ldexp((double)(scene_bits(state) >> 11), -53);
}

static inline double scene_dot(const double *x, const double *y)
{
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}

/* R from a quaternion of any length but 0 */
static inline void scene_rotation(double *R, double w, double x, double y, double z)
{
    double s = 2.0 / (w * w + x * x + y * y + z * z);
    const double rows[9] = {
        1.0 - s * (y * y + z * z), s * (x * y - w * z),       s * (x * z + w * y),
        s * (x * y + w * z),       1.0 - s * (x * x + z * z), s * (y * z - w * x),
        s * (x * z - w * y),       s * (y * z + w * x),       1.0 - s * (x * x + y * y)};
    memcpy(R, rows, sizeof rows);
}

static inline void scene_random_rotation(uint64_t *state, double *R)
{
    double q[4], square;
    do {
        square = 0.0;
        for (int k = 0; k < 4; k++) {
            q[k] = scene_uniform(state, -1.0, 1.0);
            square += q[k] * q[k];
        }
    } while (square > 1.0 || square < 0.01);
    scene_rotation(R, q[0], q[1], q[2], q[3]);
}

static inline void scene_planar_rotation(double *R, double angle)
{
    double c = cos(angle), s = sin(angle);
    const double rows[9] = {c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0};
    memcpy(R, rows, sizeof rows);
}

/* At (x, y, z), not turned. */
static inline perp__placed scene_place(const perp__geometry *geometry, double x, double y, double z)
{
    perp__placed placed = {.geometry = geometry,
                           .position = {x, y, z},
                           .rotation = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}};
    return placed;
}

static inline perp__geometry scene_box(double x, double y, double z)
{
    perp__geometry box = {PERP__BOX, 0.0, {x, y, z}, {0.0, 0.0, 0.0}, 0.0, NULL};
    return box;
}

static inline perp__geometry scene_sphere(double radius)
{
    perp__geometry sphere = {PERP__SPHERE, radius, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.0, NULL};
    return sphere;
}

static inline perp__geometry scene_plane(double x, double y, double z, double offset)
{
    double length = sqrt(x * x + y * y + z * z);
    perp__geometry plane = {PERP__PLANE, 0.0, {0.0, 0.0, 0.0}, {x / length, y / length, z / length},
                            offset,      NULL};
    return plane;
}

/* z = R x, and z = R' x */
static inline void scene_rotate(double *z, const double *R, const double *x)
{
    for (int k = 0; k < 3; k++)
        z[k] = scene_dot(R + 3 * k, x);
}

static inline void scene_rotate_back(double *z, const double *R, const double *x)
{
    for (int k = 0; k < 3; k++)
        z[k] = R[k] * x[0] + R[3 + k] * x[1] + R[6 + k] * x[2];
}

/* The whole placed shape moved rigidly: x -> Q x + c. */
static inline perp__placed scene_moved(const perp__placed *shape, const double *Q, const double *c)
{
    perp__placed moved = *shape;
    scene_rotate(moved.position, Q, shape->position);
    for (int i = 0; i < 3; i++) {
        moved.position[i] += c[i];
        for (int j = 0; j < 3; j++) {
            double column[3] = {shape->rotation[j], shape->rotation[3 + j], shape->rotation[6 + j]};
            moved.rotation[3 * i + j] = scene_dot(Q + 3 * i, column);
        }
    }
    return moved;
}

/* Signed distance of a point from a box's surface, negative inside; planar: of a rectangle's. */
static inline double scene_point_box(const perp__placed *box, int planar, const double *point)
{
    double between[3], local[3], outside = 0.0, inside = -INFINITY;
    for (int k = 0; k < 3; k++)
        between[k] = point[k] - box->position[k];
    scene_rotate_back(local, box->rotation, between);
    for (int k = 0; k < (planar ? 2 : 3); k++) {
        double beyond = fabs(local[k]) - box->geometry->half_extents[k];
        outside = hypot(outside, fmax(beyond, 0.0));
        inside = fmax(inside, beyond);
    }
    return outside > 0.0 ? outside : inside;
}

/* Corner `number`: bit j tells the side of axis j. */
static inline void scene_corner(const perp__placed *box, int number, double *corner)
{
    double local[3];
    for (int j = 0; j < 3; j++)
        local[j] = (number >> j & 1 ? 1.0 : -1.0) * box->geometry->half_extents[j];
    scene_rotate(corner, box->rotation, local);
    for (int k = 0; k < 3; k++)
        corner[k] += box->position[k];
}

/* The distance of an edge, given by its ends, from a box: the distance of a point from a convex set
 * is convex along a line, so that sections find its least value; 0 if they meet. The least value
 * comes out to about 1e-15 of the sizes where it is smooth; where the edge enters the box, a point
 * inside is found. */
static inline double scene_edge_box(const perp__placed *box, int planar, const double *from,
                                    const double *to)
{
    double low = 0.0, high = 1.0, least = INFINITY;
    for (int round = 0; round < 90; round++) {
        double value[2];
        for (int side = 0; side < 2; side++) {
            double s = low + (0.4 + 0.2 * side) * (high - low), point[3];
            for (int k = 0; k < 3; k++)
                point[k] = from[k] + s * (to[k] - from[k]);
            value[side] = fmax(scene_point_box(box, planar, point), 0.0);
        }
        least = fmin(least, fmin(value[0], value[1]));
        if (least == 0.0)
            return 0.0;
        if (value[0] <= value[1])
            high = low + 0.6 * (high - low);
        else
            low = low + 0.4 * (high - low);
    }
    return least;
}

/* The distance of two boxes, 0 if they overlap. Two convex polyhedra are closest, or meet, at an
 * edge of one of them: no separating axes and no pairs of edges are needed. */
static inline double scene_box_distance(const perp__placed *a, const perp__placed *b, int planar)
{
    double least = INFINITY;
    for (int swap = 0; swap < 2; swap++) {
        const perp__placed *box = swap ? b : a, *edges = swap ? a : b;
        for (int corner = 0; corner < (planar ? 4 : 8); corner++)
            for (int j = 0; j < (planar ? 2 : 3); j++) {
                double from[3], to[3];
                if (corner >> j & 1)
                    continue;
                scene_corner(edges, corner, from);
                scene_corner(edges, corner | 1 << j, to);
                least = fmin(least, scene_edge_box(box, planar, from, to));
            }
    }
    return least;
}

/* How far B must move along the unit vector n until no point of it is behind A's farthest one. */
static inline double scene_overlap(const perp__placed *a, const perp__placed *b, const double *n)
{
    double between[3], reach = 0.0;
    for (int k = 0; k < 3; k++)
        between[k] = b->position[k] - a->position[k];
    for (int j = 0; j < 3; j++) {
        const double *R = a->rotation, *S = b->rotation;
        reach +=
            fabs(n[0] * R[j] + n[1] * R[3 + j] + n[2] * R[6 + j]) * a->geometry->half_extents[j];
        reach +=
            fabs(n[0] * S[j] + n[1] * S[3 + j] + n[2] * S[6 + j]) * b->geometry->half_extents[j];
    }
    return reach - scene_dot(n, between);
}

#endif
