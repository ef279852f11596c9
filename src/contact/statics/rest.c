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
    int32_t slips = !call->holds_itself;

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
    for (int32_t k = 0; k < s->contacts; k++)
        slips |= s->best.modes[k] == PERP_CONTACT_SLIP;
    if (!slips)
        return 0;
    for (int32_t i = 0; i < s->size; i++) {
        const double w = i < s->rows ? call->w[i] : 0.0;

        driven = fmax(driven, fabs(s->q[i] - w));
        fastest = fmax(fastest, fabs(s->best.u[i] - w));
    }
    return fastest <= HARDLY * driven;
}

perp_status perp__contact_rest(perp_contact_solver *s, const perp__contact_call *call,
                               int32_t *rests)
{
    const perp_contact_laws laws = {.contacts = s->contacts,
                                    .dims = s->dims,
                                    .mu = s->mu,
                                    .rolling = s->rolls ? s->rolling : NULL,
                                    .spinning = s->spins ? s->spinning : NULL};
    perp__contact_candidate point = {.evidence = s->evidence, .method = s->best.method};
    perp_status status;

    *rests = 0;
    if (!may_rest(s, call))
        return PERP_OK;
    status = perp__statics_rests(s->context, &s->front, &laws, &s->dynamics, call->f, call->w, s->r,
                                 rests);
    if (status != PERP_OK || !*rests)
        return status;

    /* these impulses are judged as any others are, and the velocities are those that they mean */
    for (int32_t k = 0; k < s->contacts; k++)
        s->rest_modes[k] = s->r[s->starts[k]] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
    status = perp__contact_evaluate(s, s->rest_modes, &point.worth);
    point.outcome = perp__contact_verdict(s, &point, s->said);
    *rests = status == PERP_OK && perp__is_good(point.outcome);
    if (!*rests)
        return status;
    perp__contact_keep(s, &point);
    memcpy(s->best.modes, s->rest_modes, (size_t)s->contacts);
    if (s->n > 0)
        memset(s->best_v, 0, (size_t)s->n * sizeof *s->best_v);
    for (int32_t i = 0; i < s->size; i++)
        s->best.u[i] = i < s->rows ? call->w[i] : 0.0;
    return PERP_OK;
}
