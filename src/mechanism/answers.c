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

/* Returns whether contacts were left out. */
static int32_t add_elements(perp__acceleration *a)
{
    const perp_mechanism *m = a->m;
    int32_t j, left_out = 0;

    a->elements = a->active = 0;
    for (j = 0; j < m->contacts; j++) {
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
    for (j = 0; j < m->dry; j++)
        perp__element_add(a, m->contacts + j);
    return left_out;
}

/* What a row's u' is at v' = 0, and the size of its terms. */
static void set_bias(perp__acceleration *a, const perp__start *from)
{
    const perp_mechanism *m = a->m;

    for (int32_t i = 0; i < m->rows; i++) {
        const double shift = m->normal_of[i] < 0 ? 0.0 : m->shift[m->normal_of[i]];

        a->bias[i] = (m->start_velocity[i] + shift) / from->h;
        a->size[i] = (perp__row_size(m, &m->begin, i, from->v) + shift) / from->h;
    }
}

/* With m->begin evaluated and the step prepared. */
static perp_status find(perp_mechanism *m, perp_mechanism_summary *summary, const perp__start *from)
{
    perp__acceleration *a;
    perp_status status = perp__acceleration_open(m);
    int32_t left_out;

    if (status != PERP_OK)
        return status;
    a = m->accelerations;
    left_out = add_elements(a);
    set_bias(a, from);
    status = perp__acceleration_reduce(a);
    PERP__THEN(status, perp__acceleration_look(a, summary, -1));
    summary->exhaustive = summary->exhaustive && !left_out;
    return status;
}

/* ---- selection ----------------------------------------------------------------------------- */

/* |v' - other|^2 in the metric of M; other: NULL: 0. */
static double distance(const perp_mechanism *m, const double *acceleration, const double *other)
{
    const size_t n = (size_t)m->n;
    double sum = 0.0;

    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++)
            sum += (acceleration[i] - (other ? other[i] : 0.0)) * m->begin.M[i * n + k] *
                   (acceleration[k] - (other ? other[k] : 0.0));
    return sum;
}

static const perp__answer *best_answer(const perp_mechanism *m, const perp__acceleration *a,
                                       int32_t stable)
{
    const double *from = m->settings.select == PERP_MECHANISM_FREEST ? a->velocity : NULL;
    const perp__answer *answer, *best = NULL;
    double least = INFINITY;

    for (answer = a->answers.first; answer; answer = answer->next) {
        const double length = distance(m, perp__answer_acceleration(answer), from);

        if ((stable && !answer->stable) || !(length < least))
            continue;
        least = length;
        best = answer;
    }
    return best;
}

/* m->answer := the answer: impulses, modes, rows that hold, and velocities from these. The laws are
 * judged by the residual of its description. */
static void take(perp_mechanism *m, const perp__acceleration *a, const perp__answer *found,
                 const perp__velocity_problem *problem, double h)
{
    const perp__evidence evidence = {found->residual, found->residual, INFINITY, 1};
    perp__motion *answer = &m->answer;

    perp__acceleration_mark_rows(a, found, answer->holds);
    memcpy(answer->modes, found->modes, (size_t)(m->contacts + m->dry) * sizeof *answer->modes);
    for (int32_t i = 0; i < m->rows; i++)
        answer->r[i] = h * found->middle[i];
    memcpy(answer->v, problem->momentum, (size_t)m->n * sizeof *answer->v);
    perp__add_impulses(m, problem->terms, answer->v, answer->r);
    perp__solve_mass(m, problem->terms, answer->v, answer->v);
    answer->outcome = perp__gate(&evidence, m->settings.tol, -1);
    answer->residual = found->residual;
    answer->certificate = answer->has_ray = 0;
    perp__hold_velocities(m, answer, problem);
    perp__judge_motion(m, answer, problem);
}

perp_status perp__select_answer(perp_mechanism *m, perp_mechanism_step *step,
                                const perp__velocity_problem *problem, const perp__start *from)
{
    const perp__answer *answer;
    perp_mechanism_summary summary;
    perp_status status;

    perp_mechanism_summary_init(&summary, sizeof summary);
    status = find(m, &summary, from);
    if (status != PERP_OK)
        return status;
    step->answers = summary.count;
    step->exhaustive = summary.exhaustive;
    answer = best_answer(m, m->accelerations, summary.stable > 0);
    if (answer && summary.count > 1)
        take(m, m->accelerations, answer, problem, from->h);
    perp__answers_clear(&m->accelerations->answers);
    return PERP_OK;
}

/* ---- the question -------------------------------------------------------------------------- */

static perp_status answers(perp_mechanism *m, perp_mechanism_summary *summary,
                           const perp__start *from)
{
    perp_mechanism_summary own;
    perp_status status = PERP__CHECK(perp_mechanism_summary, m->context, summary);

    PERP__THEN(status, perp__mechanism_check_start(m, from));
    PERP__THEN(status, perp__evaluate_all(m, &m->begin, from->t, from->q, from->v));
    if (status == PERP__OUTSIDE)
        status = perp__refuse(m->context, "q0 is outside of what the mechanism is defined for");
    if (status != PERP_OK)
        return status;
    perp__prepare_step(m, from);
    perp_mechanism_summary_init(&own, sizeof own);
    status = find(m, &own, from);
    if (status != PERP_OK)
        return status;
    m->accelerations->asked = 1;
    perp__struct_write(summary, &own, sizeof own);
    return PERP_OK;
}

perp_status perp_mechanism_answers(perp_mechanism *mechanism, perp_mechanism_summary *summary,
                                   double t, double h, const double *q0, const double *v0)
{
    const perp__start from = {t, h, q0, v0};

    return PERP__CALL(perp__mechanism_enter(mechanism), mechanism->context,
                      answers(mechanism, summary, &from));
}
