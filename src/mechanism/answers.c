/* All answers of a frozen step, and the one that is selected.
 *
 * With v' = (v+ - v) / h and f = r / h the problem of a step is that of a state at rest:
 *
 *   M v' = k + J'f,   0 <= f_n perp u_n' >= 0,   friction of u_t',
 *   u' = J v' + (J v + drift + shift) / h = (u+ + shift) / h,
 *
 * whose patterns accelerations/ enumerates. What slides at the step's end need not slide its way
 * at the start. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/accelerations/accelerations.h"

/* With m->begin evaluated and the step prepared. */
static perp_status find(perp_mechanism *m, perp_mechanism_summary *summary,
                        const perp_mechanism_start *from)
{
    perp__acceleration *a;
    perp_status status = perp__acceleration_open(m);
    bool left_out = 0; /* contacts */

    if (status != PERP_OK)
        return status;
    a = m->accelerations;
    a->elements = a->active = 0;
    for (int32_t j = 0; j < m->contacts; j++) {
        perp__element *element;

        if (m->contacts > PERP__MOST_CONTACTS && !m->included[j]) {
            left_out = 1;
            continue;
        }
        element = perp__element_add(a, j);
        element->mu_stick = m->friction[j]; /* the static one holds until it slips */
        element->mu = m->stribeck[j] > 0.0 ? m->friction[j] : m->begin.mu[j];
        element->friction = element->tangents > 0 && element->mu_stick > 0.0;
    }
    perp__element_add_bilateral(a);
    for (int32_t j = 0; j < m->dry; j++)
        perp__element_add(a, m->contacts + j);
    for (int32_t i = 0; i < m->rows; i++) { /* u' at v' = 0, and the size of its terms */
        const double shift = m->normal_of[i] < 0 ? 0.0 : m->shift[m->normal_of[i]];

        a->bias[i] = (m->start_velocity[i] + shift) / from->h;
        a->size[i] = (perp__row_size(m, &m->begin, i, from->v) + shift) / from->h;
    }
    status = perp__acceleration_reduce(a);
    PERP__THEN(status, perp__acceleration_look(a, summary, -1));
    summary->exhaustive = summary->exhaustive && !left_out;
    return status;
}

perp_status perp__select_answer(perp_mechanism *m, perp_mechanism_step *step,
                                const perp__velocity_problem *problem,
                                const perp_mechanism_start *from)
{
    perp__motion *answer = &m->answer;
    const perp__answer *a, *found = NULL;
    const double *near;
    double least = INFINITY;
    perp_mechanism_summary summary;
    perp_status status;

    perp_struct_init(&summary, sizeof summary);
    status = find(m, &summary, from);
    if (status != PERP_OK)
        return status;
    near = m->settings.select == PERP_MECHANISM_FREEST ? m->accelerations->velocity : NULL;
    step->answers = summary.count;
    step->exhaustive = summary.exhaustive;
    /* 1. the answer nearest to v' = 0, or to that without impulses, in the metric of M */
    for (a = m->accelerations->answers.first; a; a = a->next) {
        double *apart = m->work, length;

        for (int32_t i = 0; i < m->n; i++)
            apart[i] = a->extra[i] - (near ? near[i] : 0.0);
        length = perp__energy_norm(m, &m->begin, apart, apart);
        if ((summary.stable > 0 && !a->stable) || !(length < least))
            continue;
        least = length;
        found = a;
    }
    /* 2. its motion */
    if (found && summary.count > 1) {
        /* impulses, modes, rows that hold, and velocities from these; the laws are judged by the
         * residual of the answer's description */
        const perp__evidence evidence = {found->residual, found->residual, INFINITY, 1};

        perp__acceleration_mark_rows(m->accelerations, found, answer->holds);
        memcpy(answer->modes, found->modes, (size_t)(m->contacts + m->dry) * sizeof *answer->modes);
        for (int32_t i = 0; i < m->rows; i++)
            answer->r[i] = from->h * found->middle[i];
        memcpy(answer->v, problem->momentum, (size_t)m->n * sizeof *answer->v);
        perp__add_impulses(m, problem->terms, answer->v, answer->r);
        perp__solve_mass(m, problem->terms, answer->v, answer->v);
        answer->outcome = perp__gate(&evidence, m->settings.tol, -1);
        answer->residual = found->residual;
        answer->certificate = answer->has_ray = 0;
        perp__hold_velocities(m, answer, problem);
        perp__check_motion(m, answer, problem);
    }
    perp__answers_clear(&m->accelerations->answers);
    return PERP_OK;
}

perp_status perp_mechanism_answers(perp_mechanism *mechanism, perp_mechanism_summary *summary,
                                   double t, double h, const double *q0, const double *v0)
{
    perp_mechanism *m = mechanism;
    const perp_mechanism_start from = {.t = t, .h = h, .q = q0, .v = v0};
    perp_mechanism_summary copy;
    perp_status status = perp__mechanism_enter(m);

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_mechanism_summary, m->context, summary);
    PERP__THEN(status, perp__mechanism_check_start(m, &from));
    PERP__THEN(status, perp__evaluate_all(m, &m->begin, t, q0, v0));
    if (status == PERP__OUTSIDE)
        status = perp__refuse(m->context, "q0 is outside of what the mechanism is defined for");
    if (status == PERP_OK) {
        perp__prepare_step(m, &from);
        perp_struct_init(&copy, sizeof copy);
        status = find(m, &copy, &from);
    }
    if (status == PERP_OK) {
        m->accelerations->asked = 1;
        perp__struct_write(summary, &copy, sizeof copy);
    }
    return perp__leave(m->context, status);
}
