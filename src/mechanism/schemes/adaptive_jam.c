/* Where sliding runs out of inertia: p = n'M^-1 (n - mu d), what the load of a sliding contact
 * makes of the acceleration of its gap, passes through 0 while the contact presses.
 *
 * With b the acceleration without a load, N = -b/p. In the time s of p, dt = p ds, the motion is
 * smooth there: dq/ds = p v, dv/ds = p M^-1 k - b M^-1 (n - mu d). With dp/ds = k p and db/ds = a p
 * + l b near p = b = 0, k and l < 0, no motion passes p = 0 with b < 0: what comes near is led into
 * that point, in a finite time T (F. Genot & B. Brogliato, Eur. J. Mech. A/Solids 18 (1999)), and
 *
 *   b ~ (T - t)^(l/k),   N ~ (T - t)^(l/k - 1),
 *
 * beyond all bounds where l/k < 1, but with a finite impulse.
 *
 * What comes then is a jam: the impulse r (n - mu d) changes u_n by p r = 0, and nothing ends it
 * before the slip is 0. Sliding on and release leave p = b = 0 as well; but contacts that give a
 * little, whatever their damping, come to the jam in the limit of stiff ones, as N is large where p
 * changes its sign (A. Nordmark, P. L. Varkonyi & A. R. Champneys, SIAM J. Appl. Dyn. Syst. 17
 * (2018)).
 *
 * A step ends where p is 0, found from p in its parts: q and with it p are smooth in t, whatever N
 * does. An impulse that is missing in b then is a part of the jam's, of the same direction. */
#include "mechanism/schemes/adaptive.h"

#include <math.h>
#include <string.h>

/* a->difference := how the jam changes v, with m->begin; its impulse. */
static double find_jump(perp_mechanism *m, perp__adaptive *a, int32_t j)
{
    const double *u = m->start_velocity + m->tangent[j];
    const double speed = perp__length(u, m->tangents[j]);
    double change = 0.0;

    perp__sliding_inertia(m, j, speed);
    for (int32_t i = 0; i < m->tangents[j]; i++)
        change += perp__row_times(m, &m->begin, m->tangent[j] + i, 0.0, m->work) * u[i];
    change = change < 0.0 ? -speed * speed / change : 0.0;
    for (int32_t i = 0; i < m->n; i++)
        a->difference[i] = change * m->work[i];
    return change;
}

perp_status perp__adaptive_look_for_jam(perp_mechanism *m, perp__adaptive *a, double h)
{
    /* where in a step p is that of its geometry, a share */
    const double ahead = m->settings.scheme == PERP_MECHANISM_THETA ? 1.0 - m->settings.theta : 0.0;
    double first = INFINITY, size, late;
    bool lets_go = 0;
    perp_status status;

    /* 1. the first contact that comes to p = 0 in the step, and whether it lets go before */
    for (int32_t j = 0; j < m->contacts; j++) {
        const double p = a->inertia[0][j], p_1 = a->inertia[1][j], p_2 = a->inertia[2][j];
        const double start = ahead > 0.0 ? p_1 + (p_1 - p) : p_1;
        const double slope = isfinite(p_2) ? p_2 - p_1 : (p - p_1) / ahead;
        const double when = 0.5 * h * (ahead - p_1 / slope);
        const double *r = m->half.r + m->starts[j], *end = m->next.r + m->starts[j];

        if (!(start > 0.0) || !(slope < 0.0) || !(when <= h && when < first))
            continue;
        first = when;
        a->jam = j;
        lets_go = (when > 0.5 * h * ahead && m->half.u[m->starts[j]] > 0.0) ||
                  (when > 0.5 * h * (1.0 + ahead) &&
                   (m->next.u[m->starts[j]] > 0.0 || (*end > 0.0 && *end < *r)));
    }
    if (a->jam >= 0 && a->event.late > 0.0 && a->event.after <= first)
        a->jam = -1; /* something else comes before it */
    if (a->jam < 0)
        return PERP_OK;
    /* 2. what coming late to it makes of q */
    if (perp__length(m->start_velocity + m->tangent[a->jam], m->tangents[a->jam]) > 0.0)
        find_jump(m, a, a->jam);
    else /* it jammed in the first half */
        for (int32_t i = 0; i < m->n; i++)
            a->difference[i] = m->next.v[i] - m->now.v[i];
    status = perp__evaluate_rate(m, a->rate, m->next.q, a->difference);
    size = status == PERP_OK ? perp__adaptive_beside(m, a->rate, a->scale) : 0.0;
    late = lets_go && !(h * size <= m->settings.error) ? h : h - first;
    a->error = fmax(a->error, late * size);
    if (late > h - first) /* whether b or p is 0 first is told by a shorter step */
        return status;
    a->event = (perp__event){.late = late, .error = late * size, .after = first, .impact = 1};
    return status;
}

/* b of contact a->jam, in this state. */
static perp_status find_lift(perp_mechanism *m, perp__adaptive *a, double t,
                             const perp__motion *state, double *b)
{
    perp_status status = perp__evaluate_all(m, &m->begin, t, state->q, state->v);

    memcpy(a->after, a->does[2], (size_t)(m->contacts + m->dry));
    a->after[a->jam] = PERP__FREE;
    PERP__THEN(status, perp__adaptive_find_forces(m, a, t, state, a->after));
    *b = m->answer.u[m->starts[a->jam]];
    return status;
}

/* What the sliding before it still lacks of its impulse, so that b = 0: no compression. Found by
 * secants, as b is quadratic in v. */
static perp_status finish_sliding(perp_mechanism *m, perp__adaptive *a, perp__motion *to, double t)
{
    const double impulse = find_jump(m, a, a->jam);
    const double speed = perp__length(to->u + m->tangent[a->jam], m->tangents[a->jam]);
    double x = 0.0, step = 1e-3, b, last = 0.0;
    perp_status status = find_lift(m, a, t, to, &b);

    for (int32_t pass = 0; pass < PERP__MOST_ITERATES && status == PERP_OK && step != 0.0; pass++) {
        for (int32_t i = 0; i < m->n; i++)
            to->v[i] += step * a->difference[i];
        x += step;
        last = b;
        status = find_lift(m, a, t, to, &b);
        step = b != last ? -b / (b - last) * step : 0.0;
    }
    if (!(fabs(x) < 1.0)) { /* beyond the jam itself: no such impulse */
        for (int32_t i = 0; i < m->n; i++)
            to->v[i] -= x * a->difference[i];
        x = 0.0;
    }
    for (int32_t i = m->tangent[a->jam]; i < m->starts[a->jam + 1]; i++)
        to->r[i] -= x * impulse * m->friction[a->jam] * to->u[i] / speed;
    to->r[m->starts[a->jam]] += x * impulse;
    return status;
}

/* No impulse is an answer as well, as u_n = 0. So the contact is pressed by one along n in
 * addition, which is taken from its answer's again: where it sticks, v does not depend on it. */
perp_status perp__adaptive_jam(perp_mechanism *m, perp__adaptive *a, perp_mechanism_step *step,
                               perp__motion *to, double t)
{
    const int32_t row = m->starts[a->jam];
    const bool poisson = m->settings.law == PERP_MECHANISM_POISSON && m->restitution[a->jam] > 0.0;
    perp__velocity_problem problem;
    perp_status status = perp__evaluate_all(m, &m->begin, t, to->q, to->v);
    double pressed;

    perp__row_velocities(m, &m->begin, m->start_velocity, to->v);
    if (status == PERP_OK && poisson)
        status = finish_sliding(m, a, to, t);
    if (status != PERP_OK)
        return status;
    /* the contacts that touch, at an instant: no forces, no gaps to close */
    perp__row_velocities(m, &m->begin, m->start_velocity, to->v);
    perp__friction_of_speed(m, &m->begin, m->friction, m->start_velocity, to->v);
    memset(m->shift, 0, (size_t)m->contacts * sizeof *m->shift);
    memset(m->dry_bound, 0, (size_t)m->dry * sizeof *m->dry_bound);
    for (int32_t j = 0; j < m->contacts; j++) {
        m->included[j] = m->begin.gap[j] <= perp__gap_rounding(m, &m->begin, m->starts[j], to->q);
        m->start_speed[j] = perp__length(m->start_velocity + m->tangent[j], m->tangents[j]);
    }
    perp__multiply_mass(m, &m->begin, m->momentum, to->v);
    problem = perp__pose(m, &m->begin);
    m->included[a->jam] = 1;
    pressed = m->start_speed[a->jam] / perp__row_mobility(m, row);
    perp__add_row(m, &m->begin, row, -pressed, m->momentum);
    m->answer.iterations = 0;
    status = perp__solve_velocities(m, &m->answer, &problem);
    step->iterations += m->answer.iterations;
    if (status != PERP_OK || !perp__is_good(m->answer.outcome))
        return status;
    m->answer.r[row] = fmax(m->answer.r[row] - pressed, 0.0);
    if (poisson)
        status = perp__expand(m, &problem);
    for (int32_t i = 0; i < m->rows; i++)
        m->answer.r[i] += to->r[i];
    if (status == PERP_OK)
        perp__copy_motion(m, to, &m->answer);
    return status;
}
