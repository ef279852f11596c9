/* Models and settings as callers hand them over. */
#ifndef PERP_MECHANISM_MECHANISM_READ_H
#define PERP_MECHANISM_MECHANISM_READ_H

#include "mechanism/mechanism.h"

perp_status perp__mechanism_settings_read(perp_context *context, perp_mechanism_settings *own,
                                          const perp_mechanism_settings *settings);

/* Checks sizes, callbacks and every number. */
perp_status perp__mechanism_model_read(perp_context *context, perp_mechanism_model *own,
                                       const perp_mechanism_model *model);

/* Sizes of a model that was read; then, once there is room, its numbers. */
void perp__mechanism_sizes(perp_mechanism *m, const perp_mechanism_model *model);
void perp__mechanism_take(perp_mechanism *m, const perp_mechanism_model *model);

#endif
