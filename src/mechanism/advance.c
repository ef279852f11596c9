/* One step, the front door: arguments, scheme, and the state that stays where there is no step. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"

PERP__WORDS(perp_mechanism_scheme_text, "unknown scheme", "frozen", "implicit", "theta")

PERP__WORDS(perp_mechanism_law_text, "unknown law", "moreau", "newton", "poisson", "stronge")

PERP__WORDS(perp_mechanism_select_text, "unknown selection", "any", "nearest", "freest")

perp_status perp__mechanism_check_state(perp_mechanism *m, double t, const double *q,
                                        const double *v)
{
    perp_status status = perp__check_vector(m->context, "q0", q, (size_t)m->coordinates);

    PERP__THEN(status, perp__check_vector(m->context, "v0", v, (size_t)m->n));
    return status == PERP_OK ? perp__check_finite(m->context, "t", &t, 1) : status;
}

perp_status perp__mechanism_check_start(perp_mechanism *m, const perp_mechanism_start *from)
{
    const perp_status status = perp__mechanism_check_state(m, from->t, from->q, from->v);

    if (status != PERP_OK || (from->h > 0.0 && isfinite(from->h)))
        return status;
    return perp__refuse(m->context, "h is %g, expected a length > 0", from->h);
}

void perp__stay(const perp_mechanism *m, perp__motion *to, const double *q, const double *v)
{
    memcpy(to->q, q, (size_t)m->coordinates * sizeof *to->q);
    memcpy(to->v, v, (size_t)m->n * sizeof *to->v);
    memset(to->u, 0, 2 * (size_t)m->rows * sizeof *to->u); /* and r; a ray stays */
    memset(to->modes, 0, (size_t)(m->contacts + m->dry) * sizeof *to->modes);
}

perp_status perp__take_step(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                            const perp_mechanism_start *from)
{
    static perp__scheme *const schemes[] = {perp__advance_frozen, perp__advance_implicit,
                                            perp__advance_theta};
    const double began = perp__now();
    const int64_t before = m->evaluations;
    perp_status status;

    perp_struct_init(step, sizeof *step);
    step->error = (double)NAN;
    status = schemes[m->settings.scheme](m, to, step, from);
    if (status == PERP__OUTSIDE) {
        step->outcome = PERP_OUTCOME_EVALUATION_FAILED;
        status = PERP_OK;
    }
    if (status == PERP_OK && !perp__outcome_moves(step->outcome)) {
        step->closed = step->sticking = step->impacts = 0;
        perp__stay(m, to, from->q, from->v);
    }
    step->evaluations = m->evaluations - before;
    step->seconds = perp__now() - began;
    return status == PERP_OK ? perp__mechanism_check_end(m, to) : status;
}

/* Lets go what static friction held at the start and not to the end: it slips with the lower
 * coefficient, on which others may follow. Whether there was any. */
static bool let_go(perp_mechanism *m, const perp__motion *to)
{
    bool more = 0;

    for (int32_t j = 0; j < m->contacts; j++)
        if (to->modes[j] == PERP_MECHANISM_SLIP && m->let_go[j] == 0 && m->stribeck[j] == 0.0 &&
            m->friction[j] > m->begin.mu[j]) {
            m->let_go[j] = 1;
            more = 1;
        }
    return more;
}

perp_status perp__advance_from(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                               const perp_mechanism_start *from)
{
    perp_status status;

    do
        status = perp__take_step(m, to, step, from);
    while (status == PERP_OK && perp__outcome_moves(step->outcome) && let_go(m, to));
    memset(m->let_go, 0, (size_t)m->contacts * sizeof *m->let_go);
    return status;
}

perp_status perp_mechanism_advance(perp_mechanism *mechanism, double *q, double *v, double *impulse,
                                   double *velocity, int32_t *modes, double *ray,
                                   perp_mechanism_step *step, const perp_mechanism_start *start)
{
    perp_mechanism *m = mechanism;
    perp_mechanism_start from = {0};
    perp_mechanism_step copy;
    perp_status status = perp__mechanism_enter(m);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(m->context, "q", q);
    PERP__THEN(status, perp__check_pointer(m->context, "v", v));
    PERP__THEN(status, PERP__CHECK(perp_mechanism_step, m->context, step));
    PERP__THEN(status, PERP__READ(perp_mechanism_start, m->context, &from, start));
    PERP__THEN(status, perp__mechanism_check_start(m, &from));
    m->keeps = 0; /* between calls what the callbacks read may have changed */
    PERP__THEN(status, perp__advance_from(m, &m->next, &copy, &from));
    if (status == PERP_OK) {
        perp__copy(q, m->next.q, m->coordinates);
        perp__copy(v, m->next.v, m->n);
        perp__copy(impulse, m->next.r, m->rows);
        perp__copy(velocity, m->next.u, m->rows);
        if (modes)
            memcpy(modes, m->next.modes, (size_t)(m->contacts + m->dry) * sizeof *modes);
        if (copy.has_ray)
            perp__copy(ray, m->next.ray, m->rows);
        perp__struct_write(step, &copy, sizeof copy);
    }
    return perp__leave(m->context, status);
}
