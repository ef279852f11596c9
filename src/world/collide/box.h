/* What the files of the box pairs share: the frame of the reference box, and its face contacts. */
#ifndef PERP_WORLD_COLLIDE_BOX_H
#define PERP_WORLD_COLLIDE_BOX_H

#include "world/collide/collide.h"

/* Relative tolerances, in terms of the smaller box's largest half extent.
 * BIAS: by how much another axis must separate the boxes better to take over from the one
 * preferred. ON_FACE: a corner this little beside a face still stands on it. Resting boxes drift by
 * less. */
#define PERP__BOX_BIAS 1e-6
#define PERP__BOX_ON_FACE 1e-9

/* Two boxes in the frame of the first, the reference. */
typedef struct perp__box_pair {
    const perp__placed *reference;
    const double *half;          /* of the reference */
    const double *incident_half; /* of the incident box */
    double axes[9];              /* columns: the incident box's axes */
    double centre[3];            /* the incident box's centre */
    double size;                 /* largest half extent of the smaller box */
} perp__box_pair;

void perp__box_pair_set(perp__box_pair *pair, const perp__placed *reference,
                        const perp__placed *incident);

/* The larger box of a pair is preferred as reference: the smaller one's corners then are contact
 * points, and the choice does not depend on which is called A. */
int perp__box_is_smaller(const perp__placed *a, const perp__placed *b);

/* One point at the closest points of two separated boxes' edges, if their distance is at most
 * margin. `normal`, in the reference's frame, stands in where the distance is lost in rounding.
 * Returns how many points it wrote. */
int32_t perp__box_pair_closest(const perp__box_pair *pair, int32_t planar, double margin,
                               const double *normal, int32_t feature, perp__point *points);

/* The side `sign` of axis `axis` of the pair's reference box. */
typedef struct perp__box_face {
    int axis;
    double sign;
} perp__box_face;

/* The points with gap <= margin of the incident box's face that lies opposite `face`, over `face`.
 * Features are below 36 * 64. Writes up to 8 points and returns how many. */
int32_t perp__box_clip(const perp__box_pair *pair, const perp__box_face *face, double margin,
                       perp__point *points);

#endif
