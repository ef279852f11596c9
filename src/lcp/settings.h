/* Reading the caller's settings. */
#ifndef PERP_LCP_SETTINGS_H
#define PERP_LCP_SETTINGS_H

#include <perp/lcp.h>

#include "base/check.h"

/* Checks everything and fills `own`; NULL gives the defaults. `own` is untouched on failure. */
perp_status perp__lcp_settings_read(perp_context *context, perp_lcp_settings *own,
                                    const perp_lcp_settings *settings);

#endif
