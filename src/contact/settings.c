/* Defaults, texts and checks of what the caller chooses. */
#include "contact/settings.h"

#include <math.h>

#include "base/context.h"

perp_status perp_contact_laws_init(perp_contact_laws *laws, size_t size)
{
    perp_status status = perp__struct_init(laws, size, PERP__CONTACT_LAWS_FIRST);

    if (status == PERP_OK)
        laws->dim = 3;
    return status;
}

perp_status perp_contact_dynamics_init(perp_contact_dynamics *dynamics, size_t size)
{
    return perp__struct_init(dynamics, size, PERP__CONTACT_DYNAMICS_FIRST);
}

perp_status perp_contact_settings_init(perp_contact_settings *settings, size_t size)
{
    perp_status status = perp__struct_init(settings, size, PERP__CONTACT_SETTINGS_FIRST);

    if (status == PERP_OK)
        settings->tol = 1e-8;
    return status;
}

perp_status perp_contact_result_init(perp_contact_result *result, size_t size)
{
    return perp__struct_init(result, size, PERP__CONTACT_RESULT_FIRST);
}

const char *perp_contact_mode_text(int32_t mode)
{
    static const char *const texts[] = {"separate", "stick", "slip"};

    return mode >= PERP_CONTACT_SEPARATE && mode <= PERP_CONTACT_SLIP ? texts[mode]
                                                                      : "unknown mode";
}

const char *perp_contact_method_text(int32_t method)
{
    static const char *const texts[] = {"auto", "sweep", "newton", "lemke", "polish"};

    return method >= 0 && method <= PERP_CONTACT_METHOD_POLISH ? texts[method] : "unknown method";
}

static perp_status check_method(perp_context *context, const perp_contact_settings *own)
{
    if (own->method == PERP_CONTACT_METHOD_POLISH)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.method is %d, which is only ever reported", (int)own->method);
    if (own->method < 0 || own->method > PERP_CONTACT_METHOD_LEMKE)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.method is %d, which is none",
                          (int)own->method);
    if (own->cone < 0 || own->cone == 1 || own->cone == 2 || own->cone > PERP__CONTACT_MOST_EDGES)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.cone is %d, expected 0 (exact) or 3 .. %d edges",
                          (int)own->cone, (int)PERP__CONTACT_MOST_EDGES);
    if (own->cone > 0 && own->method != PERP_CONTACT_METHOD_AUTO &&
        own->method != PERP_CONTACT_METHOD_LEMKE)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.cone is %d, a polyhedron, which the method %s can't take: use "
                          "lemke or auto",
                          (int)own->cone, perp_contact_method_text(own->method));
    return PERP_OK;
}

static perp_status check_numbers(perp_context *context, const perp_contact_settings *own)
{
    if (own->max_iterations < 0)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.max_iterations is %d, expected a count, or 0 for the default",
                          (int)own->max_iterations);
    if (own->reserved != 0)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.reserved is %d, 0 expected",
                          (int)own->reserved);
    if (isnan(own->tol) || isnan(own->time_limit))
        return perp__fail(context, PERP_ERROR_NOT_FINITE, "settings.%s is nan",
                          isnan(own->tol) ? "tol" : "time_limit");
    if (!(own->tol > 0.0) || !isfinite(own->tol))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.tol is %g, expected a number above 0", own->tol);
    if (!(own->time_limit >= 0.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.time_limit is %g, expected seconds, or 0 for none",
                          own->time_limit);
    return PERP_OK;
}

perp_status perp__contact_settings_read(perp_context *context, perp_contact_settings *own,
                                        const perp_contact_settings *settings)
{
    perp_contact_settings read;
    perp_status status = perp_contact_settings_init(&read, sizeof read);

    if (status == PERP_OK)
        status = perp__struct_read(context, "settings", &read, sizeof read, settings,
                                   PERP__CONTACT_SETTINGS_FIRST);
    if (status == PERP_OK)
        status = check_method(context, &read);
    if (status == PERP_OK)
        status = check_numbers(context, &read);
    if (status == PERP_OK)
        *own = read;
    return status;
}
