/* The step with the geometry frozen at its start (Stewart & Trinkle 1996, Anitescu & Potra 1997):
 *
 *   M (v+ - v) = h k + J'r,   q+ = q + h N(q) v+,
 *   0 <= r_n perp max(gap, 0)/h + u_n+ >= 0,   friction of u_t+.
 *
 * Only contacts that the step can reach are part of its problem; the others are looked at
 * afterwards. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

void perp__prepare_contacts(perp_mechanism *m, const perp_mechanism_start *from)
{
    perp__row_velocities(m, &m->begin, m->start_velocity, from->v);
    for (int32_t j = 0; j < m->contacts; j++) {
        if (fabs(m->begin.gap[j]) <= perp__gap_rounding(m, &m->begin, m->starts[j], from->q))
            m->begin.gap[j] = 0.0;
        if (m->settings.law >= PERP_MECHANISM_POISSON || m->two_sided[j] > 0) /* nobody else asks */
            m->start_speed[j] = perp__sliding_speed(m, &m->begin, j, m->start_velocity, from->v,
                                                    PERP__SUM_ROUNDING);
        m->shift[j] = fmax(m->begin.gap[j], 0.0) / from->h;
        m->included[j] = !m->apart[j] && m->begin.gap[j] <= 0.0;
    }
}

void perp__prepare_impulses(perp_mechanism *m, const perp__terms *terms,
                            const perp_mechanism_start *from)
{
    perp__multiply_mass(m, terms, m->momentum, from->v);
    for (int32_t i = 0; i < m->n; i++)
        m->momentum[i] += from->h * terms->k[i];
    for (int32_t i = 0; i < m->dry; i++)
        m->dry_bound[i] = from->h * terms->bound[i];
}

void perp__prepare_step(perp_mechanism *m, const perp_mechanism_start *from)
{
    perp__prepare_impulses(m, &m->begin, from);
    perp__prepare_contacts(m, from);
    perp__include_reached(m, &m->begin);
    perp__friction_of_speed(m, &m->begin, m->friction, m->start_velocity, from->v);
}

void perp__include_reached(perp_mechanism *m, const perp__terms *terms)
{
    perp__solve_mass(m, terms, m->free, m->momentum);
    perp__row_velocities(m, &m->begin, m->free_velocity, m->free);
    for (int32_t j = 0; j < m->contacts; j++)
        if (!m->apart[j] && m->shift[j] + m->free_velocity[m->starts[j]] <= 0.0)
            m->included[j] = 1;
}

perp__velocity_problem perp__pose(const perp_mechanism *m, const perp__terms *terms)
{
    const perp__velocity_problem problem = {terms, m->momentum, m->shift,    m->friction,
                                            NULL,  m->included, m->dry_bound};

    return problem;
}

bool perp__outcome_moves(int32_t outcome)
{
    return outcome != PERP_OUTCOME_RAY && outcome != PERP_OUTCOME_SINGULAR &&
           outcome != PERP_OUTCOME_EVALUATION_FAILED;
}

perp_status perp__solve_frozen(perp_mechanism *m, const perp__velocity_problem *problem)
{
    /* theory promises a solution: pointed or not, with gaps clipped at 0 and walls at rest */
    bool solvable = m->bilateral == 0;
    int8_t more;
    perp_status status;

    m->answer.iterations = 0;
    do { /* with the contacts that the velocities would pass */
        more = 0;
        status = perp__solve_velocities(m, &m->answer, problem);
        if (status == PERP_OK && perp__outcome_moves(m->answer.outcome))
            for (int32_t j = 0; j < m->contacts; j++)
                if (!m->included[j] && !m->apart[j] &&
                    m->shift[j] + m->answer.u[m->starts[j]] < 0.0)
                    m->included[j] = more = 1;
    } while (more);
    for (int32_t i = 0; i < m->contact_rows; i++)
        solvable = solvable && m->begin.drift[i] == 0.0;
    if (status == PERP_OK && m->answer.outcome == PERP_OUTCOME_RAY && solvable &&
        m->answer.certificate == PERP_CONTACT_CERTIFICATE_NONE)
        m->answer.outcome = PERP_OUTCOME_STALLED;
    return status;
}

perp_status perp__finish_step(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                              double t, const perp__velocity_problem *problem)
{
    perp_status status = PERP_OK;
    const perp__motion *answer = &m->answer;

    for (int32_t j = 0; j < m->contacts && perp__outcome_moves(answer->outcome); j++)
        step->impacts += perp__is_impact(m, answer, j);
    if (step->impacts > 0)
        status = perp__solve_impacts(m, problem);
    if (status != PERP_OK)
        return status;
    step->outcome = answer->outcome;
    step->method = answer->method;
    step->certificate = answer->certificate;
    step->has_ray = answer->has_ray;
    perp__raise_to(&step->residual, answer->residual);
    step->iterations += answer->iterations;
    step->closed = step->sticking = 0;
    for (int32_t j = 0; j < m->contacts; j++)
        step->closed += answer->modes[j] != PERP_CONTACT_SEPARATE;
    for (int32_t j = 0; j < m->contacts + m->dry; j++)
        step->sticking += answer->modes[j] == PERP_CONTACT_STICK;
    perp__copy_motion(m, to, answer);
    return perp__outcome_moves(step->outcome) ? perp__project(m, step, to, t) : status;
}

/* m->answer := the frozen problem's solution, or the answer that is selected. */
static perp_status find_answer(perp_mechanism *m, perp_mechanism_step *step,
                               perp__velocity_problem *problem, const perp_mechanism_start *from)
{
    perp_status status;

    step->scheme = PERP_MECHANISM_FROZEN;
    perp__prepare_step(m, from);
    *problem = perp__pose(m, &m->begin);
    status = perp__solve_frozen(m, problem);
    return status == PERP_OK && m->settings.select != PERP_MECHANISM_ANY
               ? perp__select_answer(m, step, problem, from)
               : status;
}

perp_status perp__advance_frozen(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                                 const perp_mechanism_start *from)
{
    perp__velocity_problem problem;
    perp_status status = perp__evaluate_all(m, &m->begin, from->t, from->q, from->v);

    PERP__THEN(status, find_answer(m, step, &problem, from));
    if (status == PERP_OK && perp__outcome_moves(m->answer.outcome))
        status = perp__evaluate_move(m, to->q, from->q, from->q, from->h, m->answer.v);
    return status == PERP_OK ? perp__finish_step(m, to, step, from->t + from->h, &problem) : status;
}

perp_status perp__impact(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step, double t)
{
    const perp_mechanism_start from = {
        .t = t, .h = 1.0, .q = to->q, .v = to->v}; /* a length that forces and gaps of 0 ignore */
    perp__velocity_problem problem;
    perp_status status = perp__evaluate_all(m, &m->begin, t, to->q, to->v);

    memset(m->begin.k, 0, (size_t)m->n * sizeof *m->begin.k);
    memset(m->begin.bound, 0, (size_t)m->dry * sizeof *m->begin.bound);
    for (int32_t j = 0; j < m->contacts; j++)
        m->begin.gap[j] = m->apart[j] ? m->begin.gap[j] : 0.0;
    PERP__THEN(status, find_answer(m, step, &problem, &from));
    return status == PERP_OK ? perp__finish_step(m, to, step, t, &problem) : status;
}
