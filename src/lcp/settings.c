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

static perp_status check_flag(perp_context *context, const char *name, int32_t flag)
{
    if (flag == 0 || flag == 1)
        return PERP_OK;
    return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.%s is %d, expected 0 or 1", name,
                      (int)flag);
}

static perp_status check_choice(perp_context *context, const char *name, int32_t choice,
                                int32_t last)
{
    if (choice >= 0 && choice <= last)
        return PERP_OK;
    return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.%s is %d, which is none", name,
                      (int)choice);
}

static perp_status check_choices(perp_context *context, const perp_lcp_settings *own)
{
    perp_status status = PERP_OK;

    if (own->method == PERP_LCP_POLISH || own->method == PERP_LCP_PATTERNS)
        status = perp__fail(context, PERP_ERROR_ARGUMENT,
                            "settings.method is %d, which is only ever reported", own->method);
    if (status == PERP_OK)
        status = check_choice(context, "method", own->method, PERP_LCP_ACTIVE_SET);
    if (status == PERP_OK)
        status = check_choice(context, "pivot_rule", own->pivot_rule, PERP_PIVOT_LEXICOGRAPHIC);
    if (status == PERP_OK)
        status = check_choice(context, "sweep", own->sweep, PERP_SWEEP_SYMMETRIC);
    if (status == PERP_OK)
        status = check_choice(context, "acceleration", own->acceleration,
                              PERP_ACCELERATION_CONJUGATE_GRADIENT);
    return status;
}

static perp_status check_numbers(perp_context *context, const perp_lcp_settings *own)
{
    if (isnan(own->tol) || isnan(own->time_limit) || isnan(own->relaxation) || isnan(own->penalty))
        return perp__fail(context, PERP_ERROR_NOT_FINITE, "settings.%s is nan",
                          isnan(own->tol)          ? "tol"
                          : isnan(own->time_limit) ? "time_limit"
                          : isnan(own->relaxation) ? "relaxation"
                                                   : "penalty");
    if (!(own->tol > 0.0) || !isfinite(own->tol))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.tol is %g, expected a number above 0", own->tol);
    if (!(own->time_limit >= 0.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.time_limit is %g, expected seconds, or 0 for none",
                          own->time_limit);
    if (!(own->relaxation > 0.0 && own->relaxation < 2.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.relaxation is %g, expected a number in (0, 2)",
                          own->relaxation);
    if (!(own->penalty >= 0.0 && own->penalty < 1.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.penalty is %g, expected a number in [0, 1)", own->penalty);
    return PERP_OK;
}

perp_status perp__lcp_settings_read(perp_context *context, perp_lcp_settings *own,
                                    const perp_lcp_settings *settings)
{
    perp_lcp_settings read;
    perp_status status = perp_lcp_settings_init(&read, sizeof read);

    if (status == PERP_OK)
        status = PERP__READ(perp_lcp_settings, context, &read, settings);
    if (status == PERP_OK)
        status = check_choices(context, &read);
    if (status == PERP_OK && read.max_iterations < 0)
        status = perp__fail(context, PERP_ERROR_ARGUMENT,
                            "settings.max_iterations is %d, expected a count, or 0 for the default",
                            (int)read.max_iterations);
    if (status == PERP_OK)
        status = check_numbers(context, &read);
    if (status == PERP_OK)
        status = check_flag(context, "scaling", read.scaling);
    if (status == PERP_OK)
        status = check_flag(context, "polish", read.polish);
    if (status == PERP_OK)
        status = check_flag(context, "crash", read.crash);
    if (status == PERP_OK)
        *own = read;
    return status;
}
