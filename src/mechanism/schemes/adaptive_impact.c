/* Impacts. What is apart stays so in a step, whatever its gap does, and a step ends where a gap
 * closes. There velocities jump, in a step of no length. So whole and half steps are smooth up to
 * the impact, with the error that they tell, and its law is given the speeds of that instant.
 *
 * A gap counts as closed where it is no more than what may be wrong with q. What would rebound no
 * higher than that comes to rest: infinitely many bounces take a finite number of steps. */
#include "mechanism/schemes/adaptive.h"

#include <math.h>
#include <string.h>

#define MOVES 1e-12 /* of the terms of a speed: a slower one is rounding */

/* What may be wrong with the gap of contact j, with m->begin. */
static double uncertainty(const perp_mechanism *m, const perp__adaptive *a, int32_t j)
{
    return fmax(m->settings.error * perp__gap_size(m, &m->begin, m->starts[j], a->scale),
                perp__gap_rounding(m, &m->begin, m->starts[j], m->now.q));
}

void perp__adaptive_look_for_impact(perp_mechanism *m, perp__adaptive *a, double h)
{
    const double weight = a->order == 2 ? 1.0 / 3.0 : 1.0; /* as the answer is extrapolated */
    const double length = 0.5 * h;

    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j], first = a->gap[1][j] < -uncertainty(m, a, j);
        const double end = a->gap[2][j] + weight * (a->gap[2][j] - a->gap[0][j]);
        const double deep = first ? -a->gap[1][j] : -end;
        const double open = fmax(first ? a->open[j] : a->gap[1][j], 0.0);
        const double u = first ? m->half.u[row] : m->next.u[row];
        double bend, late;

        if (!m->apart[j] || !(deep > uncertainty(m, a, j)))
            continue;
        /* the parabola of the half step's gaps and its last speed */
        bend = 4.0 * deep * (open + deep + u * length) / (length * length);
        late = 2.0 * deep / (sqrt(fmax(u * u + bend, 0.0)) - u);
        perp__adaptive_keep(m, a, late, deep / perp__gap_size(m, &m->begin, row, a->scale),
                            fmax((first ? length : h) - late, 0.0));
        if (a->event.late == late)
            a->event.closes = j + 1;
    }
}

/* m->half := m->now behind the impact of the contacts that are not apart; the last step to it had
 * that length, 0: none. */
static perp_status strike(perp_mechanism *m, perp__adaptive *a, perp_mechanism_step *step, double t,
                          double h)
{
    double *restitution = a->gap[0];
    perp_status status;

    memcpy(restitution, m->restitution, (size_t)m->contacts * sizeof *restitution);
    for (int32_t j = 0; j < m->contacts && h > 0.0; j++) {
        const int32_t row = m->starts[j];
        const double pull = 2.0 * (m->half.u[row] - m->next.u[row]) / h;
        const double rebound = m->restitution[j] * m->start_velocity[row];

        if (rebound * rebound <= 2.0 * pull * uncertainty(m, a, j))
            m->restitution[j] = 0.0;
    }
    memcpy(m->half.q, m->now.q, (size_t)m->coordinates * sizeof *m->now.q);
    memcpy(m->half.v, m->now.v, (size_t)m->n * sizeof *m->now.v);
    perp__clear_motion(m, &m->half);
    perp_mechanism_step_init(step, sizeof *step);
    step->error = 0.0;
    status = perp__project(m, step, &m->half, t); /* first: rows turn with q */
    PERP__THEN(status, perp__impact(m, &m->half, step, t));
    memcpy(m->restitution, restitution, (size_t)m->contacts * sizeof *restitution);
    return status;
}

perp_status perp__adaptive_meet(perp__run *run, perp__adaptive *a, double h)
{
    perp_mechanism *m = run->m;
    int32_t hits = 0;
    perp_mechanism_step step;
    perp_status status = perp__evaluate_rows(m, &m->begin, run->t, m->now.q, m->now.v);

    if (status != PERP_OK)
        return status;
    /* 1. what touches, and comes closer */
    perp__row_velocities(m, &m->begin, m->start_velocity, m->now.v);
    for (int32_t j = 0; j < m->contacts; j++) {
        const double u = m->start_velocity[m->starts[j]];
        const double closed = fmax(uncertainty(m, a, j), -u * a->shortest);

        m->apart[j] = m->two_sided[j] == 0 && m->begin.gap[j] > closed;
        hits |= m->two_sided[j] == 0 && !m->apart[j] && a->does[0][j] == PERP__FREE &&
                u < -MOVES * perp__row_size(m, &m->begin, m->starts[j], m->now.v);
    }
    if (hits) {
        status = strike(m, a, &step, run->t, h);
        PERP__THEN(status, perp__run_take(run, &m->half, run->t, 0.0, &step));
        if (status != PERP_OK || run->ended)
            return status;
        a->started = 0;
        memset(a->expected, 0, (size_t)m->n * sizeof *a->expected);
        status = perp__adaptive_look_at_start(m, a, run->t);
    }
    /* 2. what steps leave open; what overlaps they take apart themselves */
    memcpy(a->open, m->begin.gap, (size_t)m->contacts * sizeof *a->open);
    for (int32_t j = 0; j < m->contacts; j++)
        m->apart[j] = m->two_sided[j] == 0 && a->does[0][j] == PERP__FREE &&
                      a->open[j] >= -uncertainty(m, a, j);
    return status;
}
