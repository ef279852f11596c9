/* Defaults, texts and checks of what the caller chooses. */
#include "contact/settings.h"

#include <math.h>

#include "base/context.h"

PERP__INIT_WITH(perp_contact_laws, .dim = 3)

PERP__INIT(perp_contact_dynamics)

PERP__INIT_WITH(perp_contact_settings, .tol = 1e-8)

PERP__INIT(perp_contact_result)

PERP__WORDS(perp_contact_mode_text, "unknown mode", "separate", "stick", "slip", "lower", "upper")

PERP__WORDS(perp_contact_method_text, "unknown method", "auto", "sweep", "newton", "lemke",
            "polish", "admm", "proximal")

int32_t perp__contact_method_named(int32_t method)
{
    return method == PERP_CONTACT_METHOD_NEWTON ? PERP_CONTACT_METHOD_PROXIMAL : method;
}

static perp_status check_method(perp_context *context, const perp_contact_settings *own)
{
    if (own->method == PERP_CONTACT_METHOD_POLISH)
        return perp__refuse(context, "settings.method is %d, which is only ever reported",
                            (int)own->method);
    if (own->cone < 0 || own->cone == 1 || own->cone == 2 || own->cone > PERP__CONTACT_MOST_EDGES)
        return perp__refuse(context, "settings.cone is %d, expected 0 (exact) or 3 .. %d edges",
                            (int)own->cone, (int)PERP__CONTACT_MOST_EDGES);
    if (own->cone > 0 && own->method != PERP_CONTACT_METHOD_AUTO &&
        own->method != PERP_CONTACT_METHOD_LEMKE)
        return perp__refuse(
            context,
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

PERP__SETTINGS_READER(perp__contact_settings_read, perp_contact_settings, fields,
                      check_method(context, &read))
