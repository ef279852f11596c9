/* Velocities of exactly 0 of a contact problem whose answer hardly moves: where the impulses
 * balance the forces it rests, whatever of the velocities a method left to its tol. */
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/solver.h"
#include "contact/statics/statics.h"

/* The share of what forces alone make of the largest relative velocity up to which it is asked. */
#define HARDLY 1e-3

/* Whether velocities of 0 may be an answer: all that is told moves nothing, and what was found
 * hardly does. */
static int32_t may_rest(const perp_contact_solver *s, const perp__contact_call *call)
{
    double driven = 0.0, fastest = 0.0;

    if (s->entrance != PERP__ENTRANCE_DYNAMICS || s->bounded.count > 0 || s->holds_both ||
        s->complies || s->settings.cone > 0 || s->contacts == 0 ||
        s->certificate != PERP_CONTACT_CERTIFICATE_NONE || s->ended >= 0)
        return 0;
    for (int32_t k = 0; k < s->contacts; k++)
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            if (call->w[i] != 0.0 && (i > s->starts[k] || call->w[i] < 0.0))
                return 0;
    for (int32_t i = s->rows; i < s->size && call->b; i++)
        if (call->b[i - s->rows] != 0.0)
            return 0;
    for (int32_t i = 0; i < s->size; i++) {
        const double w = i < s->rows ? call->w[i] : 0.0;

        driven = fmax(driven, fabs(s->q[i] - w));
        fastest = fmax(fastest, fabs(s->best.u[i] - w));
    }
    return fastest <= HARDLY * driven;
}

perp_status perp__contact_rest(perp_contact_solver *s, const perp__contact_call *call,
                               double deadline, int32_t *rests)
{
    const perp_contact_laws laws = {.contacts = s->contacts,
                                    .dims = s->dims,
                                    .mu = s->mu,
                                    .rolling = s->rolls ? s->rolling : NULL,
                                    .spinning = s->spins ? s->spinning : NULL};
    const int64_t iterations = s->iterations;
    perp__contact_call again = *call;
    perp_status status;

    *rests = 0;
    if (!may_rest(s, call))
        return PERP_OK;
    status =
        perp__statics_rests(s->context, &laws, &s->dynamics, call->f, call->w, s->balance, rests);
    if (status != PERP_OK || !*rests)
        return status;

    /* the impulses, as any others that a caller knows; and the velocities that they mean */
    again.r0 = s->balance;
    status = perp__contact_find(s, &again, deadline);
    s->iterations += iterations;
    *rests = status == PERP_OK && perp__is_good(s->best.outcome);
    if (!*rests)
        return status;
    if (s->n > 0)
        memset(s->best_v, 0, (size_t)s->n * sizeof *s->best_v);
    for (int32_t i = 0; i < s->size; i++)
        s->best.u[i] = i < s->rows ? call->w[i] : 0.0;
    for (int32_t k = 0; k < s->contacts; k++)
        s->best.modes[k] =
            s->best.r[s->starts[k]] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
    return PERP_OK;
}
