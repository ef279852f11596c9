/* Defaults and checks of what the caller chooses. */
#ifndef PERP_NCP_SETTINGS_H
#define PERP_NCP_SETTINGS_H

#include <perp/ncp.h>

#include "base/check.h"

/* own := settings, or the defaults for NULL; untouched where that is refused. */
perp_status perp__ncp_settings_read(perp_context *context, perp_ncp_settings *own,
                                    const perp_ncp_settings *settings);

/* Checks struct, callbacks, pattern and bounds. */
perp_status perp__ncp_problem_read(perp_context *context, perp_ncp_problem *own,
                                   const perp_ncp_problem *problem);

#endif
