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
