/* Reading the caller's settings and structs. */
#ifndef PERP_CONTACT_SETTINGS_H
#define PERP_CONTACT_SETTINGS_H

#include <perp/contact.h>

#include "base/check.h"

#define PERP__CONTACT_LAWS_FIRST PERP__SIZE_THROUGH(perp_contact_laws, reserved)
#define PERP__CONTACT_DYNAMICS_FIRST PERP__SIZE_THROUGH(perp_contact_dynamics, G)
#define PERP__CONTACT_SETTINGS_FIRST PERP__SIZE_THROUGH(perp_contact_settings, monitor_user)
#define PERP__CONTACT_RESULT_FIRST PERP__SIZE_THROUGH(perp_contact_result, has_ray)

enum { PERP__CONTACT_MOST_EDGES = 1024 };

/* Checks everything and fills `own`; NULL gives the defaults. `own` is untouched on failure. */
perp_status perp__contact_settings_read(perp_context *context, perp_contact_settings *own,
                                        const perp_contact_settings *settings);

#endif
