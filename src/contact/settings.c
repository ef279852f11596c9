/* Defaults, texts and checks of what the caller chooses. */
#include "contact/settings.h"

#include <math.h>

#include "base/context.h"

perp_status perp_contact_laws_init(perp_contact_laws *laws, size_t size)
{
    perp_status status = perp__struct_init(laws, size, PERP__FIRST(perp_contact_laws));

    if (status == PERP_OK)
        laws->dim = 3;
    return status;
}

PERP__INIT(perp_contact_dynamics)

perp_status perp_contact_settings_init(perp_contact_settings *settings, size_t size)
{
    perp_status status = perp__struct_init(settings, size, PERP__FIRST(perp_contact_settings));

    if (status == PERP_OK)
        settings->tol = 1e-8;
    return status;
}

PERP__INIT(perp_contact_result)

const char *perp_contact_mode_text(int32_t mode)
{
    static const char *const texts[] = {"separate", "stick", "slip", "lower", "upper"};

    return mode >= PERP_CONTACT_SEPARATE && mode <= PERP_CONTACT_UPPER ? texts[mode]
                                                                       : "unknown mode";
}

const char *perp_contact_method_text(int32_t method)
{
    static const char *const texts[] = {"auto",   "sweep", "newton",  "lemke",
                                        "polish", "admm",  "proximal"};

    return method >= 0 && method <= PERP_CONTACT_METHOD_PROXIMAL ? texts[method] : "unknown method";
}

int32_t perp__contact_method_named(int32_t method)
{
    return method == PERP_CONTACT_METHOD_NEWTON ? PERP_CONTACT_METHOD_PROXIMAL : method;
}

static perp_status check_method(perp_context *context, const perp_contact_settings *own)
{
    if (own->method == PERP_CONTACT_METHOD_POLISH)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.method is %d, which is only ever reported", (int)own->method);
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

static const perp__field fields[] = {
    PERP__INTEGER(perp_contact_settings, method, 0, PERP_CONTACT_METHOD_PROXIMAL),
    PERP__INTEGER(perp_contact_settings, max_iterations, 0, INFINITY),
    PERP__INTEGER(perp_contact_settings, reserved, 0, 0),
    PERP__REAL(perp_contact_settings, tol, "()", 0, INFINITY),
    PERP__REAL(perp_contact_settings, time_limit, "[]", 0, INFINITY),
};

perp_status perp__contact_settings_read(perp_context *context, perp_contact_settings *own,
                                        const perp_contact_settings *settings)
{
    perp_contact_settings read;
    perp_status status = perp_contact_settings_init(&read, sizeof read);

    if (status == PERP_OK)
        status = PERP__READ(perp_contact_settings, context, &read, settings);
    if (status == PERP_OK)
        status = check_method(context, &read);
    if (status == PERP_OK)
        status = PERP__CHECK_FIELDS(context, "settings", &read, fields);
    if (status == PERP_OK) {
        read.method = perp__contact_method_named(read.method);
        *own = read;
    }
    return status;
}
