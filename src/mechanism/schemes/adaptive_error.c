/* How wrong a step is, estimated from the full step and the two half steps.
 *
 * What they differ in, in q and h N v, coordinate by coordinate beside the largest q so far; and in
 * v, all together, in the norm of M (the root of twice the kinetic energy) beside the largest. The
 * last is taken in what the rows that hold leave free, because v is tangential to those of the
 * step's start, always a step late; and left out where velocities jump, at impacts and where a
 * contact chatters: it does not get smaller with the step.
 *
 * Hidden: while friction sticks nothing moves, whatever k does, and full and half steps agree. What
 * they would differ in if nothing held is taken from k alone: h/4 M^-1 (k+ - k), or h/12 M^-1 (k -
 * 2 k_half + k+) for a scheme of order 2. */
#include "mechanism/schemes/adaptive.h"

#include <math.h>
#include <string.h>

/* ---- scales -------------------------------------------------------------------------------- */

double perp__adaptive_beside(const perp_mechanism *m, const double *x, const double *scale)
{
    double largest = 0.0;

    for (int32_t i = 0; i < m->coordinates; i++)
        if (x[i] != 0.0)
            largest = fmax(largest, fabs(x[i]) / scale[i]);
    return largest;
}

static void widen(const perp_mechanism *m, double *scale, const double *x, double factor)
{
    for (int32_t i = 0; i < m->coordinates; i++)
        scale[i] = fmax(scale[i], factor * fabs(x[i]));
}

/* What the force would move and drive in the time unit. */
static perp_status scale_by_force(perp_mechanism *m, perp__adaptive *a, const double *force)
{
    double *acceleration = a->difference;
    perp_status status;

    perp__solve_mass(m, &m->begin, acceleration, force);
    a->speed_scale =
        fmax(a->speed_scale, a->unit * perp__energy_norm(m, &m->begin, a->scratch, acceleration));
    status = perp__evaluate_rate(m, a->rate, m->now.q, acceleration);
    widen(m, a->scale, a->rate, a->unit * a->unit);
    return status;
}

perp_status perp__adaptive_scale(perp_mechanism *m, perp__adaptive *a, double t)
{
    const perp__motion *const states[] = {&m->now, &m->trial, &m->half};
    double largest = 0.0;
    perp_status status;

    a->speed_scale = a->fastest;
    memcpy(a->scale, a->largest, (size_t)m->coordinates * sizeof *a->scale);
    status = scale_by_force(m, a, a->force[0]);
    if (status == PERP_OK && a->speed_scale == 0.0) { /* rest, from where a force grows */
        status = perp__evaluate_force(m, a->force[1], t + a->unit, m->now.q, m->now.v);
        status = status == PERP_OK ? scale_by_force(m, a, a->force[1]) : status;
    }
    for (int32_t i = 0; i < 3 && status == PERP_OK; i++) {
        a->speed_scale =
            fmax(a->speed_scale, perp__energy_norm(m, &m->begin, a->scratch, states[i]->v));
        widen(m, a->scale, states[i]->q, 1.0);
        status = perp__evaluate_rate(m, a->rate, states[i]->q, states[i]->v);
        widen(m, a->scale, a->rate, a->unit);
    }
    for (int32_t i = 0; i < m->coordinates; i++)
        largest = fmax(largest, a->scale[i]);
    for (int32_t i = 0; i < m->coordinates; i++)
        a->scale[i] = fmax(a->scale[i], PERP__LITTLE * largest);
    return status;
}

/* ---- differences --------------------------------------------------------------------------- */

/* Whether a contact presses in some of the answers only, or sticks in some of them only while what
 * it slips may come from what closes its gap. */
static bool chatters(const perp_mechanism *m)
{
    const perp__motion *const states[] = {&m->trial, &m->half, &m->next};

    for (int32_t j = 0; j < m->contacts; j++) {
        int32_t open = 0, sticks = 0;
        double closing = 0.0, slip = 0.0;

        for (int32_t k = 0; k < 3; k++) {
            const double *u = states[k]->u + m->starts[j];

            open += states[k]->modes[j] == PERP_MECHANISM_SEPARATE;
            sticks += states[k]->modes[j] == PERP_MECHANISM_STICK;
            closing = fmax(closing, fabs(u[0]));
            for (int32_t i = 1; i < m->dims[j]; i++)
                slip = fmax(slip, fabs(u[i]));
        }
        if (m->two_sided[j] == 0 &&
            (open % 3 != 0 || (sticks % 3 != 0 && closing > PERP__SLOW * slip)))
            return 1;
    }
    return 0;
}

/* a->hidden: also what forces k_0 a + k_1 b + k_2 c for a time w, weighed with h, come to beside
 * the scale. */
static perp_status weigh(perp_mechanism *m, perp__adaptive *a, const double combination[3],
                         double w, double h)
{
    perp_status status;

    for (int32_t i = 0; i < m->n; i++)
        a->difference[i] = w * (combination[0] * a->force[0][i] + combination[1] * a->force[1][i] +
                                combination[2] * a->force[2][i]);
    perp__solve_mass(m, &m->begin, a->difference, a->difference);
    status = perp__evaluate_rate(m, a->rate, m->next.q, a->difference);
    if (status == PERP_OK)
        a->hidden = fmax(a->hidden, h * perp__adaptive_beside(m, a->rate, a->scale));
    return status;
}

perp_status perp__adaptive_estimate(perp_mechanism *m, perp__adaptive *a, double t, double h)
{
    static const double change[3] = {-1.0, 0.0, 1.0}, bend[3] = {1.0, -2.0, 1.0};
    int32_t held;
    const double weight = a->order == 2 ? 1.0 / 3.0 : 1.0;
    perp_status status;

    for (int32_t i = 0; i < m->coordinates; i++)
        a->moved[i] = weight * (m->next.q[i] - m->trial.q[i]);
    a->error = perp__adaptive_beside(m, a->moved, a->scale);
    for (int32_t i = 0; i < m->n; i++)
        a->difference[i] = weight * (m->next.v[i] - m->trial.v[i]);
    status = perp__evaluate_rate(m, a->rate, m->next.q, a->difference);
    if (status == PERP_OK) {
        a->error = fmax(a->error, h * perp__adaptive_beside(m, a->rate, a->scale));
        a->speed = 0.0;
    }
    if (status == PERP_OK && !chatters(m)) { /* the speed in what the rows that hold leave free */
        perp__active_rows_begin(&m->held, m->n);
        for (int32_t i = 0; i < m->rows; i++)
            if (m->trial.holds[i] && m->half.holds[i] && m->next.holds[i])
                perp__hold_row(m, &m->begin, i, 0.0);
        perp__active_rows_solve(&m->held);
        perp__energy_norm(m, &m->begin, a->scratch, a->difference);
        perp__project_out(m->held.basis, m->held.rank, m->n, a->scratch);
        a->speed = perp__length(a->scratch, m->n);
        a->speed = a->speed > 0.0 ? a->speed / a->speed_scale : 0.0;
    }
    a->error = fmax(a->error, a->event.error);
    a->hidden = 0.0;
    held = a->full.closed + a->full.sticking + a->first.closed + a->first.sticking +
           a->second.closed + a->second.sticking;
    if (status == PERP_OK && held > 0) {
        status = perp__evaluate_force(m, a->force[1], t + 0.5 * h, m->half.q, m->half.v);
        PERP__THEN(status, perp__evaluate_force(m, a->force[2], t + h, m->next.q, m->next.v));
        PERP__THEN(status, weigh(m, a, bend, a->order == 2 ? h / 12.0 : h / 4.0, h));
        if (a->order == 1)
            PERP__THEN(status, weigh(m, a, change, h / 4.0, h));
    }
    return status;
}

/* ---- turns --------------------------------------------------------------------------------------
 *
 * Friction acts through the velocity at the end of a step. Where a slip turns round,
 * friction has the wrong sign until then, or holds on to the end what would slip back; both change
 * velocities by the bound times a share of the step. Where it ends, the mean velocity of
 * a step of order 2 goes on behind the end: as wrong as the slip was fast. */

void perp__adaptive_keep(const perp_mechanism *m, perp__adaptive *a, double late, double error,
                         double after)
{
    const bool both = fmin(error, a->event.error) > m->settings.error;

    if (!(late > 0.0) || !(both ? after < a->event.after : error > a->event.error))
        return;
    memset(&a->event, 0, sizeof a->event);
    a->event.late = late;
    a->event.error = error;
    a->event.after = after;
}

void perp__adaptive_events(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                           const perp__motion *to, double start, double length)
{
    for (int32_t j = 0; j < m->contacts + m->dry; j++) {
        const int32_t row = m->tangent[j], count = m->tangents[j];
        const bool sticks = to->modes[j] == PERP_MECHANISM_STICK;
        /* a slip may end here smoothly, so that it is located */
        const bool ends = a->order == 2 && (j >= m->contacts || m->two_sided[j] == 0);
        const double bound = j < m->contacts ? m->friction[j] * perp__load_of(m, to->r, j)
                                             : m->dry_bound[j - m->contacts];
        double d[2] = {0.0, 0.0}, speed, after = 0.0, copy = 0.0, all, free, response, lost, when,
               wrong;

        /* 1. the slip at the start, along d */
        if (from->modes[j] != PERP_MECHANISM_SLIP || !(bound > 0.0))
            continue;
        for (int32_t i = 0; i < count; i++)
            d[i] = perp__row_times(m, &m->begin, row + i, m->begin.drift[row + i], from->v);
        speed = hypot(d[0], d[1]);
        for (int32_t i = 0; i < 2 && speed > 0.0; i++)
            d[i] /= speed;
        for (int32_t i = 0; i < count; i++) {
            after += d[i] * to->u[row + i];
            copy += d[i] * to->r[row + i];
        }
        if (!(speed > 0.0) || (after >= 0.0 && !sticks))
            continue;
        /* 2. d'J M^-1 J'd in what constraints leave free, those of contacts that hold both ways
         * among them */
        perp__hold_constraints(m, &m->begin);
        memset(a->scratch, 0, (size_t)m->n * sizeof *a->scratch);
        for (int32_t i = 0; i < count; i++)
            perp__add_row(m, &m->begin, row + i, d[i], a->scratch);
        perp__solve_lower(m, &m->begin, a->scratch);
        all = perp__length(a->scratch, m->n);
        perp__project_out(m->held.basis, m->held.rank, m->n, a->scratch);
        free = perp__length(a->scratch, m->n);
        response = free > PERP__AGREEMENT * all ? free * free : 0.0;
        /* 3. when it turns, and what that makes of the step */
        lost = speed - (after - response * copy); /* by other forces than this friction */
        when = length * speed / (lost + response * bound);
        if (!(response > 0.0) || !(when >= 0.0 && when < length))
            continue;
        wrong = sticks ? fmax(lost / response - bound, ends ? speed / response : 0.0) *
                             (length - when) / length
                       : 2.0 * bound * when / length;
        if (wrong > 0.0)
            perp__adaptive_keep(m, a, length - when, wrong * sqrt(response) / a->speed_scale,
                                start + when);
    }
}
