/* One step, the front door: arguments, scheme, and the state that stays where there is no step. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"

static const char *const scheme_texts[] = {"frozen", "implicit", "theta"};
static const char *const law_texts[] = {"moreau", "newton", "poisson"};
static const char *const select_texts[] = {"any", "nearest", "freest"};

const char *perp_mechanism_scheme_text(int32_t scheme)
{
    return scheme >= 0 && scheme < 3 ? scheme_texts[scheme] : "unknown scheme";
}

const char *perp_mechanism_law_text(int32_t law)
{
    return law >= 0 && law < 3 ? law_texts[law] : "unknown law";
}

const char *perp_mechanism_select_text(int32_t select)
{
    return select >= 0 && select < 3 ? select_texts[select] : "unknown selection";
}

perp_status perp__mechanism_check_state(perp_mechanism *m, double t, const double *q,
                                        const double *v)
{
    perp_status status = perp__check_vector(m->context, "q0", q, (size_t)m->coordinates);

    if (status == PERP_OK)
        status = perp__check_vector(m->context, "v0", v, (size_t)m->n);
    return status == PERP_OK ? perp__check_finite(m->context, "t", &t, 1) : status;
}

perp_status perp__mechanism_check_length(perp_mechanism *m, double h)
{
    if (h > 0.0 && isfinite(h))
        return PERP_OK;
    return perp__fail(m->context, PERP_ERROR_ARGUMENT, "h is %g, expected a length > 0", h);
}

void perp__stay(const perp_mechanism *m, perp__motion *to, const double *q, const double *v)
{
    memcpy(to->q, q, (size_t)m->coordinates * sizeof *to->q);
    memcpy(to->v, v, (size_t)m->n * sizeof *to->v);
    memset(to->u, 0, 2 * (size_t)m->rows * sizeof *to->u); /* and r; a ray stays */
    memset(to->modes, 0, (size_t)(m->contacts + m->dry) * sizeof *to->modes);
}

perp_status perp__advance(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step, double t,
                          double h, const double *q0, const double *v0)
{
    const double began = perp__now();
    const int64_t before = m->evaluations;
    perp_status status;

    perp_mechanism_step_init(step, sizeof *step);
    step->error = (double)NAN;
    switch (m->settings.scheme) {
    case PERP_MECHANISM_IMPLICIT:
        status = perp__advance_implicit(m, to, step, t, h, q0, v0);
        break;
    case PERP_MECHANISM_THETA:
        status = perp__advance_theta(m, to, step, t, h, q0, v0);
        break;
    default:
        status = perp__advance_frozen(m, to, step, t, h, q0, v0);
    }
    if (status == PERP__OUTSIDE) {
        step->outcome = PERP_OUTCOME_EVALUATION_FAILED;
        status = PERP_OK;
    }
    if (status == PERP_OK && !perp__outcome_moves(step->outcome)) {
        step->closed = step->sticking = step->impacts = 0;
        perp__stay(m, to, q0, v0);
    }
    step->evaluations = m->evaluations - before;
    step->seconds = perp__now() - began;
    return status == PERP_OK ? perp__mechanism_check_end(m, to) : status;
}

static void copy_out(double *to, const double *from, int32_t count)
{
    if (to)
        memcpy(to, from, (size_t)count * sizeof *to);
}

static perp_status advance(perp_mechanism *m, double *q, double *v, double *impulse,
                           double *velocity, int32_t *modes, double *ray, perp_mechanism_step *step,
                           double t, double h, const double *q0, const double *v0)
{
    perp__motion *to = &m->next;
    perp_mechanism_step own;
    perp_status status = perp__check_pointer(m->context, "q", q);

    if (status == PERP_OK)
        status = perp__check_pointer(m->context, "v", v);
    if (status == PERP_OK)
        status = PERP__CHECK(perp_mechanism_step, m->context, step);
    if (status == PERP_OK)
        status = perp__mechanism_check_state(m, t, q0, v0);
    if (status == PERP_OK)
        status = perp__mechanism_check_length(m, h);
    m->keeps = 0; /* between calls what the callbacks read may have changed */
    if (status == PERP_OK)
        status = perp__advance(m, to, &own, t, h, q0, v0);
    if (status != PERP_OK)
        return status;
    copy_out(q, to->q, m->coordinates);
    copy_out(v, to->v, m->n);
    copy_out(impulse, to->r, m->rows);
    copy_out(velocity, to->u, m->rows);
    if (modes)
        memcpy(modes, to->modes, (size_t)(m->contacts + m->dry) * sizeof *modes);
    if (own.has_ray)
        copy_out(ray, to->ray, m->rows);
    perp__struct_write(step, &own, sizeof own);
    return PERP_OK;
}

perp_status perp_mechanism_advance(perp_mechanism *mechanism, double *q, double *v, double *impulse,
                                   double *velocity, int32_t *modes, double *ray,
                                   perp_mechanism_step *step, double t, double h, const double *q0,
                                   const double *v0)
{
    return PERP__CALL(perp__mechanism_enter(mechanism), mechanism->context,
                      advance(mechanism, q, v, impulse, velocity, modes, ray, step, t, h, q0, v0));
}
