/* Impacts. What is apart stays so in a step, whatever its gap does, and a step ends where a gap
 * closes. There velocities jump, in a step of no length. So whole and half steps are smooth up to
 * the impact, with the error that they tell, and its law is given the speeds of that instant.
 *
 * A gap counts as closed where it is no more than what may be wrong with q. What would bounce no
 * higher than that does not, and what is thrown off no higher is left to the steps, which close it
 * where they end: infinitely many bounces take a finite number of them. */
#include "mechanism/schemes/adaptive.h"

#include <math.h>
#include <string.h>

double perp__adaptive_uncertainty(const perp_mechanism *m, const perp__adaptive *a, int32_t j)
{
    return fmax(m->settings.error * perp__gap_size(m, &m->begin, m->starts[j], a->scale),
                perp__gap_rounding(m, &m->begin, m->starts[j], m->now.q));
}

void perp__adaptive_look_for_impact(perp_mechanism *m, perp__adaptive *a, double h)
{
    const double weight = a->order == 2 ? 1.0 / 3.0 : 1.0; /* as the answer is extrapolated */
    const double length = 0.5 * h;

    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j],
                      first = a->gap[1][j] < -perp__adaptive_uncertainty(m, a, j);
        const double end = a->gap[2][j] + weight * (a->gap[2][j] - a->gap[0][j]);
        const double deep = first ? -a->gap[1][j] : -end;
        const double open = fmax(first ? a->open[j] : a->gap[1][j], 0.0);
        const double u = first ? m->half.u[row] : m->next.u[row];
        double bend, late;

        if (!m->apart[j] || !(deep > perp__adaptive_uncertainty(m, a, j)))
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

/* Whether contact j, whose gap changes at this speed, counts as closed in m->now. */
static bool touches(const perp_mechanism *m, const perp__adaptive *a, int32_t j, double speed)
{
    return m->begin.gap[j] <= fmax(perp__adaptive_uncertainty(m, a, j), -speed * a->shortest);
}

/* Whether contact j, leaving at this speed, comes back from no higher than what may be wrong with
 * q, by the accelerations of perp__adaptive_look_at_start(). */
static bool stays(const perp_mechanism *m, const perp__adaptive *a, int32_t j, double speed)
{
    return a->known &&
           speed * speed <= -2.0 * m->answer.u[m->starts[j]] * perp__adaptive_uncertainty(m, a, j);
}

/* Takes the impact of what touches. */
static perp_status strike(perp__run *run, perp__adaptive *a)
{
    perp_mechanism *m = run->m;
    double *restitution = a->gap[0];
    perp_mechanism_step step;
    perp_status status = perp__adaptive_look_at_start(m, a, run->t);

    perp__row_velocities(m, &m->begin, m->start_velocity, m->now.v);
    memcpy(restitution, m->restitution, (size_t)m->contacts * sizeof *restitution);
    perp__stay(m, &m->half, m->now.q, m->now.v);
    perp_struct_init(&step, sizeof step);
    step.error = 0.0;
    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t row = m->starts[j];
        const double speed = m->start_velocity[row];

        m->apart[j] = m->two_sided[j] == 0 && !touches(m, a, j, speed);
        if (stays(m, a, j, m->restitution[j] * speed))
            m->restitution[j] = 0.0;
        /* as if it pressed at rest: projection leaves no gap that the next step would close */
        m->half.r[row] = m->two_sided[j] == 0 && !m->apart[j];
        m->start_velocity[row] = 0.0;
    }
    PERP__THEN(status, perp__project(m, &step, &m->half, run->t)); /* first: rows turn with q */
    PERP__THEN(status, perp__impact(m, &m->half, &step, run->t));
    memcpy(m->restitution, restitution, (size_t)m->contacts * sizeof *restitution);
    PERP__THEN(status, perp__run_take(run, &m->half, run->t, 0.0, &step));
    a->started = 0;
    memset(a->expected, 0, (size_t)m->n * sizeof *a->expected);
    return status == PERP_OK && !run->ended ? perp__adaptive_look_at_start(m, a, run->t) : status;
}

perp_status perp__adaptive_meet(perp__run *run, perp__adaptive *a, bool looked)
{
    perp_mechanism *m = run->m;
    double *u = m->start_velocity;
    bool hits = 0;
    perp_status status = perp__evaluate_rows(m, &m->begin, run->t, m->now.q, m->now.v);

    if (status != PERP_OK)
        return status;
    /* 1. an impact where something touches that comes closer */
    perp__row_velocities(m, &m->begin, u, m->now.v);
    for (int32_t j = 0; j < m->contacts; j++)
        hits |=
            m->apart[j] && touches(m, a, j, u[m->starts[j]]) &&
            u[m->starts[j]] < -PERP__NOTHING * perp__row_size(m, &m->begin, m->starts[j], m->now.v);
    if (hits) {
        status = strike(run, a);
        perp__row_velocities(m, &m->begin, u, m->now.v);
    }
    if (status != PERP_OK || run->ended)
        return status;
    /* 2. what is open in the next step: not what overlaps, nor what has left and not got away, or
     * will not by its acceleration */
    looked |= hits;
    memcpy(a->open, m->begin.gap, (size_t)m->contacts * sizeof *a->open);
    for (int32_t j = 0; j < m->contacts; j++) {
        const double gap = a->open[j], wrong = perp__adaptive_uncertainty(m, a, j),
                     speed = u[m->starts[j]];
        const bool remains = looked ? stays(m, a, j, speed) : !m->apart[j];

        m->apart[j] = m->two_sided[j] == 0 && a->does[0][j] == PERP__FREE && gap >= -wrong &&
                      !(gap <= wrong && remains);
    }
    return status;
}
