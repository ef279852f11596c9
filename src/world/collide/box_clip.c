/* Contact points of two opposite faces: the incident face's polygon, clipped by the sides of the
 * reference face (Sutherland & Hodgman 1974), all in the frame of the reference box. */
#include "world/collide/box.h"

#include <string.h>

#include "linalg/spatial.h"

/* A convex quadrilateral has at most 8 corners left when four lines have cut it. */
enum { MAX_CORNERS = 8 };

/* A corner is told from the others by the edges before and after it: edges 0 .. 3 are the incident
 * face's, 4 .. 7 the reference face's. */
typedef struct corner {
    double position[3];
    int32_t before;
    int32_t after;
} corner;

typedef struct polygon {
    corner corners[MAX_CORNERS];
    int count;
} polygon;

/* A side plane of the reference face: inside where sign x[axis] <= half. */
typedef struct side {
    int axis;
    double sign;
    double half;
    double tolerance; /* on the plane: this close to it */
    int32_t edge;
} side;

/* The incident box's face whose normal is most against the reference face's. Returns a number for
 * it, 0 .. 5. */
static int32_t incident_face(const perp__box_pair *pair, const perp__box_face *face, polygon *out)
{
    const double *along = pair->axes + 3 * face->axis;
    int j = 0;
    for (int m = 1; m < 3; m++)
        if (fabs(along[m]) > fabs(along[j]))
            j = m;
    double sign = face->sign * along[j] > 0.0 ? -1.0 : 1.0;

    static const double round[4][2] = {{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}};
    int k = (j + 1) % 3, l = (j + 2) % 3;
    double axis_j[3], axis_k[3], axis_l[3];
    perp__column3(axis_j, pair->axes, j);
    perp__column3(axis_k, pair->axes, k);
    perp__column3(axis_l, pair->axes, l);
    const double *half = pair->incident_half;
    out->count = 4;
    for (int q = 0; q < 4; q++) {
        corner *at = &out->corners[q];
        perp__along3(at->position, pair->centre, sign * half[j], axis_j);
        perp__along3(at->position, at->position, round[q][0] * half[k], axis_k);
        perp__along3(at->position, at->position, round[q][1] * half[l], axis_l);
        at->before = (q + 3) % 4;
        at->after = q;
    }
    return 2 * j + (sign > 0.0);
}

static double beyond(const side *cut, const corner *at)
{
    return cut->sign * at->position[cut->axis] - cut->half;
}

/* Where the edge from a corner inside to one outside meets the plane. */
static void intersect(const side *cut, const corner *inside, const corner *outside, corner *at)
{
    double from = beyond(cut, inside), to = beyond(cut, outside);
    double part = from / (from - to);
    for (int k = 0; k < 3; k++)
        at->position[k] = inside->position[k] + part * (outside->position[k] - inside->position[k]);
    at->position[cut->axis] = cut->sign * cut->half;
}

/* Corners on the plane stay as they are and spawn no second corner beside them. */
static void clip(const side *cut, polygon *in)
{
    polygon out;
    out.count = 0;
    for (int q = 0; q < in->count; q++) {
        const corner *last = &in->corners[(q + in->count - 1) % in->count];
        const corner *here = &in->corners[q];
        const corner *next = &in->corners[(q + 1) % in->count];
        double at_last = beyond(cut, last), at = beyond(cut, here), at_next = beyond(cut, next);
        double on = cut->tolerance;

        if (at <= on && out.count < MAX_CORNERS) {
            corner *kept = &out.corners[out.count++];
            *kept = *here;
            if (at >= -on && at_last > on)
                kept->before = cut->edge;
            if (at >= -on && at_next > on)
                kept->after = cut->edge;
        }
        if (((at < -on && at_next > on) || (at > on && at_next < -on)) && out.count < MAX_CORNERS) {
            corner *cross = &out.corners[out.count++];
            cross->before = at < at_next ? here->after : cut->edge;
            cross->after = at < at_next ? cut->edge : here->after;
            intersect(cut, at < at_next ? here : next, at < at_next ? next : here, cross);
        }
    }
    memcpy(in, &out, sizeof out);
}

int32_t perp__box_clip(const perp__box_pair *pair, const perp__box_face *face, double margin,
                       perp__point *points)
{
    polygon outline;
    int32_t incident = incident_face(pair, face, &outline);
    for (int32_t edge = 0; edge < 4; edge++) {
        int axis = (face->axis + 1 + edge / 2) % 3;
        side cut = {axis, edge % 2 ? 1.0 : -1.0, pair->half[axis], PERP__BOX_ON_FACE * pair->size,
                    4 + edge};
        clip(&cut, &outline);
    }

    double normal[3] = {0.0, 0.0, 0.0};
    normal[face->axis] = face->sign;
    int32_t reference = 2 * face->axis + (face->sign > 0.0);
    int32_t count = 0;
    for (int q = 0; q < outline.count; q++) {
        const corner *at = &outline.corners[q];
        double gap = face->sign * at->position[face->axis] - pair->half[face->axis];
        if (!(gap <= margin))
            continue;
        double position[3];
        perp__along3(position, at->position, -0.5 * gap, normal);
        int32_t feature = ((6 * reference + incident) * 8 + at->before) * 8 + at->after;
        perp__emit_point(pair->reference, position, normal, gap, feature, &points[count++]);
    }
    return count;
}
