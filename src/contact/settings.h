/* Reading the caller's settings and structs. */
#ifndef PERP_CONTACT_SETTINGS_H
#define PERP_CONTACT_SETTINGS_H

#include <perp/contact.h>

#include "base/check.h"

/* Checks everything and fills `own`; NULL gives the defaults. `own` is untouched on failure. */
perp_status perp__contact_settings_read(perp_context *context, perp_contact_settings *own,
                                        const perp_contact_settings *settings);

/* One name for methods that have two. */
int32_t perp__contact_method_named(int32_t method);

#endif
