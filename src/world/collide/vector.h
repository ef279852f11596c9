/* The shape pairs' names for what linalg/spatial.h has. */
#ifndef PERP_WORLD_COLLIDE_VECTOR_H
#define PERP_WORLD_COLLIDE_VECTOR_H

#include "linalg/spatial.h"
#include "world/collide/collide.h"

#define perp__vector_dot perp__dot3
#define perp__vector_subtract perp__subtract3
#define perp__vector_add perp__along3
#define perp__vector_largest perp__largest3
#define perp__vector_normalise perp__normalise3
#define perp__vector_rotate perp__apply3
#define perp__vector_rotate_back perp__apply_transposed3
#define perp__vector_axis perp__column3

#endif
