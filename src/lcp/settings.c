/* Defaults, texts and checks of what the caller chooses. */
#include "lcp/settings.h"

#include <math.h>

#include "base/check.h"
#include "base/context.h"

perp_status perp_lcp_settings_init(perp_lcp_settings *settings, size_t size)
{
    perp_status status = perp__struct_init(settings, size, PERP__FIRST(perp_lcp_settings));

    if (status == PERP_OK) {
        settings->tol = 1e-10;
        settings->relaxation = 1.0;
        settings->scaling = 1;
        settings->polish = 1;
        settings->crash = 1;
    }
    return status;
}

PERP__INIT(perp_lcp_result)

const char *perp_lcp_method_text(int32_t method)
{
    static const char *const texts[] = {"auto",   "lemke",      "pgs",     "fischer",
                                        "polish", "active_set", "patterns"};

    return method >= 0 && method <= PERP_LCP_PATTERNS ? texts[method] : "unknown method";
}

static const perp__field fields[] = {
    PERP__INTEGER(perp_lcp_settings, method, 0, PERP_LCP_ACTIVE_SET),
    PERP__INTEGER(perp_lcp_settings, pivot_rule, 0, PERP_PIVOT_LEXICOGRAPHIC),
    PERP__INTEGER(perp_lcp_settings, sweep, 0, PERP_SWEEP_SYMMETRIC),
    PERP__INTEGER(perp_lcp_settings, acceleration, 0, PERP_ACCELERATION_CONJUGATE_GRADIENT),
    PERP__INTEGER(perp_lcp_settings, max_iterations, 0, INFINITY),
    PERP__REAL(perp_lcp_settings, tol, "()", 0, INFINITY),
    PERP__REAL(perp_lcp_settings, time_limit, "[]", 0, INFINITY),
    PERP__REAL(perp_lcp_settings, relaxation, "()", 0, 2),
    PERP__REAL(perp_lcp_settings, penalty, "[)", 0, 1),
    PERP__INTEGER(perp_lcp_settings, scaling, 0, 1),
    PERP__INTEGER(perp_lcp_settings, polish, 0, 1),
    PERP__INTEGER(perp_lcp_settings, crash, 0, 1),
};

perp_status perp__lcp_settings_read(perp_context *context, perp_lcp_settings *own,
                                    const perp_lcp_settings *settings)
{
    perp_lcp_settings read;
    perp_status status = perp_lcp_settings_init(&read, sizeof read);

    if (status == PERP_OK)
        status = PERP__READ(perp_lcp_settings, context, &read, settings);
    if (status == PERP_OK && (read.method == PERP_LCP_POLISH || read.method == PERP_LCP_PATTERNS))
        status = perp__fail(context, PERP_ERROR_ARGUMENT,
                            "settings.method is %d, which is only ever reported", (int)read.method);
    if (status == PERP_OK)
        status = PERP__CHECK_FIELDS(context, "settings", &read, fields);
    if (status == PERP_OK)
        *own = read;
    return status;
}
