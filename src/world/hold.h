/* Velocities of bodies from the rows that hold them; velocity.c says which rows those are. */
#ifndef PERP_WORLD_HOLD_H
#define PERP_WORLD_HOLD_H

#include "world/world.h"

/* What carries the body: PERP__ROOT_STATIC, a kinematic body's slot, or PERP__ROOT_NONE. Bodies
 * with one root move as one rigid body. */
int32_t perp__root_of(const perp_world *world, int32_t body);

/* Determines the body's velocity from closed contacts with bodies that are held already; returns 0
 * if they leave it some freedom. */
int32_t perp__hold_body(perp_world *world, int32_t body, size_t twist);

/* Velocities of bodies that closed contacts join into one group; motion->group and motion->column
 * (0 .. count - 1) are set. Those that turn out to be determined become held. */
void perp__hold_group(perp_world *world, const int32_t *bodies, int32_t count, int32_t group,
                      size_t twist);

#endif
