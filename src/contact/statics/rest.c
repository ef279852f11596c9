/* Velocities of exactly 0 of a contact problem: where impulses balance the forces it rests,
 * whatever a method found, be it another answer that the laws have there or velocities left to its
 * tol. */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "contact/solver.h"
#include "contact/statics/statics.h"

/* The share of what forces alone make of the largest relative velocity up to which many bodies are
 * asked. After the first sweeps (contact.c) what comes to rest has .02 to .18 of it left in piles
 * of 10 to 250 bodies, what was hit .24 to 1. Few are asked always: where n^3 / 3 products of a
 * dense factor are no more than those sweeps make, each a row's 12 numbers, read and pushed. */
#define SLOW 0.2
#define SWEPT (PERP__FIRST_LOOK * 2.0 * 12.0)

bool perp__contact_may_rest(const perp_contact_solver *s)
{
    const perp__contact_call *call = s->call;

    if (s->settings.max_iterations < 0 || s->entrance != PERP__ENTRANCE_DYNAMICS ||
        s->bounded.count > 0 || s->holds_both || s->complies || s->settings.cone > 0 ||
        s->contacts == 0 || s->asked_rest || s->certificate != PERP_CONTACT_CERTIFICATE_NONE ||
        s->ended >= 0)
        return 0;
    for (int32_t k = 0; k < s->contacts; k++)
        for (int32_t i = s->starts[k]; i < s->starts[k + 1]; i++)
            if (call->w[i] != 0.0 && (i > s->starts[k] || call->w[i] < 0.0))
                return 0;
    for (int32_t i = s->rows; i < s->size && call->b; i++)
        if (call->b[i - s->rows] != 0.0)
            return 0;
    return 1;
}

/* Whether rest is asked for: where something slips, and velocities are small or bodies few. Callers
 * who hold velocities themselves know of what sticks, too. */
static bool is_asked(const perp_contact_solver *s)
{
    const perp__contact_call *call = s->call;
    const double n = s->n;
    double driven = 0.0, fastest = 0.0;
    bool slips = s->settings.raw_velocity != 1;

    for (int32_t k = 0; k < s->contacts; k++)
        slips |= s->best.modes[k] == PERP_CONTACT_SLIP;
    for (int32_t i = 0; i < s->size && slips; i++) {
        const double w = i < s->rows ? call->w[i] : 0.0;

        driven = fmax(driven, fabs(s->q[i] - w));
        fastest = fmax(fastest, fabs(s->best.u[i] - w));
    }
    return slips && (fastest <= SLOW * driven || n * n * n <= 3.0 * SWEPT * s->size);
}

perp_status perp__contact_rest(perp_contact_solver *s)
{
    const perp__contact_call *call = s->call;
    const perp_contact_laws laws = {.contacts = s->contacts,
                                    .dims = s->dims,
                                    .mu = s->mu,
                                    .rolling = s->rolls ? s->rolling : NULL,
                                    .spinning = s->spins ? s->spinning : NULL};
    perp__contact_candidate point = {.evidence = s->evidence, .method = s->best.method};
    const double seconds = s->deadline > 0.0 ? s->deadline - perp__now() : INFINITY;
    int32_t rests;
    perp_status status;

    if (!perp__contact_may_rest(s) || !(seconds > 0.0) || !is_asked(s))
        return PERP_OK;
    s->asked_rest = 1;
    status = perp__statics_rests(s->context, &s->front, &laws, &s->dynamics, call->f, call->w,
                                 seconds, s->r, &rests);
    if (status != PERP_OK || !rests)
        return status;

    /* these impulses are judged as any others are, and the velocities are those that they mean */
    for (int32_t k = 0; k < s->contacts; k++)
        s->rest_modes[k] = s->r[s->starts[k]] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
    status = perp__contact_evaluate(s, s->rest_modes, &point.residuals);
    point.outcome = perp__contact_verdict(s, &point, s->said);
    if (status != PERP_OK || !perp__is_good(point.outcome))
        return status;
    s->rests = 1;
    perp__contact_keep(s, &point);
    if (s->settings.raw_velocity == 1)
        return PERP_OK;
    if (s->n > 0)
        memset(s->best_v, 0, (size_t)s->n * sizeof *s->best_v);
    for (int32_t i = 0; i < s->size; i++)
        s->best.u[i] = i < s->rows ? call->w[i] : 0.0;
    return PERP_OK;
}
