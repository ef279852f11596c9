/* Between hold.c, which takes up one body after the other, and clusters.c, which takes what is
 * left.
 */
#ifndef PERP_CONTACT_HOLD_CLUSTERS_H
#define PERP_CONTACT_HOLD_CLUSTERS_H

#include "contact/hold/hold.h"

/* Of `source`: no row yet; rows that lead to different motions. */
enum { UNSET = -3, SEVERAL = -4 };

/* Whether two roots move as one body: the same one, or translations with the same velocity. */
int32_t perp__hold_is_same(const perp__hold *h, int32_t a, int32_t b);

/* v of a block := the rigid motion of `root` where it is. Returns 0 where that is not known. */
int32_t perp__hold_carry(perp__hold *h, int32_t block, int32_t root);

/* A block whose v is that of a root is held. */
void perp__hold_follow(perp__hold *h, int32_t block, int32_t root);

/* How many of the unit's blocks are not held; *piece: the first of these. */
int32_t perp__hold_count_open(const perp__hold *h, int32_t unit, int64_t *piece);

/* What the unit's other blocks, all held, move with: SEVERAL, where it is not one thing. */
int32_t perp__hold_root_beside(const perp__hold *h, int32_t unit, int32_t block);

/* v of these blocks, one cluster: exact zeros, and what the rows leave free. */
void perp__hold_solve_cluster(perp__hold *h, const int32_t *members, int32_t count);

/* The same for all blocks that are not held yet. */
void perp__hold_solve_clusters(perp__hold *h);

#endif
