/* Convex shapes as cores with a radius. */
#include "world/collide/polytope.h"

#include <string.h>

#include "linalg/spatial.h"

/* A box: bit j of a corner's number tells the side of axis j, faces are 2 j + side, edges along
 * axis j 4 j and on. */
static const int32_t box_first[] = {0, 4, 8, 12, 16, 20, 24};
static const int32_t box_loop[] = {4, 6, 2, 0, 1, 3, 7, 5, 1, 5, 4, 0,
                                   2, 6, 7, 3, 2, 3, 1, 0, 4, 5, 7, 6};
static const int32_t box_side[] = {5,  10, 4,  8, 6, 11, 7, 9, 9, 2, 8, 0,
                                   10, 3,  11, 1, 1, 6,  0, 4, 2, 7, 3, 5};
static const int32_t box_edge[] = {0, 1, 2, 4, 2, 3, 4, 3, 4, 5, 5, 2, 6, 7, 3, 5,
                                   0, 2, 4, 0, 4, 6, 0, 5, 1, 3, 1, 4, 5, 7, 5, 1,
                                   0, 4, 0, 2, 1, 5, 2, 1, 2, 6, 3, 0, 3, 7, 1, 3};

/* A rectangle: the same corners, faces in the order of axes too. */
static const int32_t side_first[] = {0, 2, 4, 6, 8};
static const int32_t rectangle_loop[] = {2, 0, 1, 3, 0, 1, 3, 2};
static const int32_t rectangle_side[] = {0, 0, 1, 1, 2, 2, 3, 3};
static const int32_t rectangle_edge[] = {2, 0, 0, 0, 1, 3, 1, 1, 0, 1, 2, 2, 3, 2, 3, 3};

/* A segment; in the plane it has two sides. */
static const int32_t segment_loop[] = {1, 0, 0, 1};
static const int32_t segment_side[] = {0, 0, 0, 0};
static const int32_t segment_edge[] = {0, 1, 0, 0};

void perp__polytope_of(const perp__geometry *geometry, int32_t planar, perp__polytope_room *room,
                       perp__polytope *polytope)
{
    static const double ends[6] = {-1.0, 0.0, 0.0, 1.0, 0.0, 0.0};
    static const double normals[6] = {0.0, -1.0, 0.0, 0.0, 1.0, 0.0};
    const double *half = geometry->half_extents;
    const int32_t dimension = planar ? 2 : 3;
    if (geometry->kind == PERP__HULL) {
        *polytope = geometry->hull->polytope;
        return;
    }
    polytope->radius = geometry->radius;
    polytope->corner = room->corner;
    polytope->normal = room->normal;
    polytope->offset = room->offset;
    if (geometry->kind == PERP__BOX) {
        polytope->corners = 1 << dimension;
        polytope->faces = 2 * dimension;
        polytope->edges = planar ? 4 : 12;
        polytope->first = planar ? side_first : box_first;
        polytope->loop = planar ? rectangle_loop : box_loop;
        polytope->side = planar ? rectangle_side : box_side;
        polytope->edge = planar ? rectangle_edge : box_edge;
        for (int32_t c = 0; c < polytope->corners; c++)
            for (int j = 0; j < 3; j++)
                room->corner[3 * c + j] = j == dimension ? 0.0 : c >> j & 1 ? half[j] : -half[j];
        for (int32_t f = 0; f < polytope->faces; f++) {
            for (int j = 0; j < 3; j++)
                room->normal[3 * f + j] = j != f / 2 ? 0.0 : f % 2 ? 1.0 : -1.0;
            room->offset[f] = half[f / 2];
        }
    } else {
        polytope->corners = half[0] > 0.0 ? 2 : 1;
        polytope->faces = planar && half[0] > 0.0 ? 2 : 0;
        polytope->edges = 1;
        polytope->first = side_first;
        polytope->loop = segment_loop;
        polytope->side = segment_side;
        polytope->edge = segment_edge;
        for (int k = 0; k < 6; k++)
            room->corner[k] = half[0] * ends[k];
        memcpy(room->normal, normals, sizeof normals);
        room->offset[0] = room->offset[1] = 0.0;
    }
}

void perp__polytope_move(perp__polytope *polytope, const double *R, const double *t,
                         perp__polytope_room *room)
{
    double turned[3];
    for (int32_t c = 0; c < polytope->corners; c++) {
        perp__apply3(turned, R, polytope->corner + 3 * c);
        perp__along3(room->corner + 3 * c, t, 1.0, turned);
    }
    for (int32_t f = 0; f < polytope->faces; f++) {
        perp__apply3(turned, R, polytope->normal + 3 * f);
        perp__copy3(room->normal + 3 * f, turned);
        room->offset[f] = polytope->offset[f] + perp__dot3(turned, t);
    }
    polytope->corner = room->corner;
    polytope->normal = room->normal;
    polytope->offset = room->offset;
}

double perp__reach_of_hull(const perp__hull *hull, const double *normal)
{
    double reach = -INFINITY;
    for (int32_t c = 0; c < hull->polytope.corners; c++)
        reach = perp__greater(reach, perp__dot3(normal, hull->polytope.corner + 3 * c));
    return reach;
}

/* ---- points inside of a shape, and just before its faces ---- */

bool perp__holds(const perp__placed *shape, const double *point, double depth)
{
    const perp__geometry *geometry = shape->geometry;
    double between[3], local[3];
    perp__subtract3(between, point, shape->position);
    if (geometry->kind == PERP__SPHERE)
        return perp__length3(between) < geometry->radius - depth;
    perp__apply_transposed3(local, shape->rotation, between);
    if (geometry->kind == PERP__PLANE)
        return perp__dot3(geometry->normal, local) < geometry->offset - depth;
    if (geometry->kind == PERP__CAPSULE) {
        local[0] -= fmin(fmax(local[0], -geometry->half_extents[0]), geometry->half_extents[0]);
        return perp__length3(local) < geometry->radius - depth;
    }
    if (geometry->kind == PERP__BOX) {
        for (int k = 0; k < 3; k++)
            if (fabs(local[k]) > fmax(geometry->half_extents[k] - depth, 0.0))
                return 0;
        return 1;
    }
    const perp__polytope *hull = &geometry->hull->polytope;
    for (int32_t f = 0; f < hull->faces; f++)
        if (perp__dot3(hull->normal + 3 * f, local) > hull->offset[f] - depth)
            return 0;
    return 1;
}

int32_t perp__probe_faces(const perp__placed *shape, const perp__footing *at, double probes[][3],
                          double normals[][3])
{
    const perp__geometry *geometry = shape->geometry;
    const bool boxed = geometry->kind == PERP__BOX;
    const double *half = geometry->half_extents;
    perp__polytope_room room;
    perp__polytope polytope;
    double between[3], local[3], out[3], probe[3];
    int32_t faces[PERP__MAX_PROBES], count = 0;
    if (!boxed && geometry->kind != PERP__HULL)
        return 0;
    perp__subtract3(between, at->position, shape->position);
    perp__apply_transposed3(local, shape->rotation, between);
    perp__apply_transposed3(out, shape->rotation, at->normal);

    /* 1. the faces within the rim of the point that make the normal */
    perp__polytope_of(geometry, at->planar, &room, &polytope);
    for (int32_t f = 0; f < polytope.faces && count < PERP__MAX_PROBES; f++)
        if (perp__dot3(polytope.normal + 3 * f, out) > PERP__PARALLEL &&
            perp__dot3(polytope.normal + 3 * f, local) > polytope.offset[f] - at->rim)
            faces[count++] = f;
    if (count < at->least)
        count = 0;

    /* 2. the point before each; before that of a box, not beside it either */
    for (int32_t i = 0; i < count; i++) {
        const int32_t f = faces[i];
        const double *n = polytope.normal + 3 * f;
        for (int k = 0; k < 3 && boxed; k++) {
            const double most = fmax(half[k] - at->crack, 0.0);
            probe[k] = fmin(fmax(local[k], -most), most);
        }
        if (boxed)
            probe[f / 2] = f % 2 ? half[f / 2] + at->crack : -half[f / 2] - at->crack;
        else
            perp__along3(probe, local, polytope.offset[f] + at->crack - perp__dot3(n, local), n);
        perp__apply3(normals[i], shape->rotation, n);
        perp__apply3(between, shape->rotation, probe);
        perp__along3(probes[i], shape->position, 1.0, between);
    }
    return count;
}
