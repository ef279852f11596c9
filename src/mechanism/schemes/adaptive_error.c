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

/* A coordinate counts at least this share of the largest. */
#define FLOOR 1e-3

/* A slip that is slower than this many times what closes a gap may come from that. */
#define CLOSING 10.0

/* ---- scales -------------------------------------------------------------------------------- */

static void widen(const perp_mechanism *m, double *scale, const double *x, double factor)
{
    int32_t i;

    for (i = 0; i < m->coordinates; i++)
        scale[i] = fmax(scale[i], factor * fabs(x[i]));
}

perp_status perp__adaptive_scale(perp_mechanism *m, perp__adaptive *a)
{
    const perp__motion *const states[] = {&m->now, &m->trial, &m->half};
    double *acceleration = a->difference, largest = 0.0;
    perp_status status;
    int32_t i;

    memcpy(acceleration, a->force[0], (size_t)m->n * sizeof *acceleration);
    perp__solve_mass(m, &m->begin, acceleration);
    a->speed_scale = fmax(a->fastest, a->unit * perp__speed(m, &m->begin, acceleration));
    memcpy(a->scale, a->largest, (size_t)m->coordinates * sizeof *a->scale);
    status = perp__evaluate_rate(m, a->rate, m->now.q, acceleration);
    widen(m, a->scale, a->rate, a->unit * a->unit);
    for (i = 0; i < 3 && status == PERP_OK; i++) {
        a->speed_scale = fmax(a->speed_scale, perp__speed(m, &m->begin, states[i]->v));
        widen(m, a->scale, states[i]->q, 1.0);
        status = perp__evaluate_rate(m, a->rate, states[i]->q, states[i]->v);
        widen(m, a->scale, a->rate, a->unit);
    }
    for (i = 0; i < m->coordinates; i++)
        largest = fmax(largest, a->scale[i]);
    for (i = 0; i < m->coordinates; i++)
        a->scale[i] = fmax(a->scale[i], FLOOR * largest);
    return status;
}

void perp__adaptive_learn(const perp_mechanism *m, perp__adaptive *a)
{
    memcpy(a->largest, a->scale, (size_t)m->coordinates * sizeof *a->largest);
    a->fastest = a->speed_scale;
}

/* ---- differences --------------------------------------------------------------------------- */

static int32_t holds(const perp_mechanism_step *step)
{
    return step->closed + step->sticking > 0;
}

/* In how many of the three answers a contact or dry group is in this mode. */
static int32_t count_mode(const perp_mechanism *m, int32_t place, int32_t mode)
{
    return (m->trial.modes[place] == mode) + (m->half.modes[place] == mode) +
           (m->next.modes[place] == mode);
}

/* Largest size of the velocity of `count` rows from `row`, in the three answers. */
static double fastest_row(const perp_mechanism *m, int32_t row, int32_t count)
{
    const perp__motion *const states[] = {&m->trial, &m->half, &m->next};
    double fastest = 0.0;
    int32_t i, k;

    for (k = 0; k < 3; k++)
        for (i = row; i < row + count; i++)
            fastest = fmax(fastest, fabs(states[k]->u[i]));
    return fastest;
}

/* Whether a contact presses in some of the answers only, or sticks in some of them only while what
 * it slips is no faster than what closes its gap. */
static int32_t chatters(const perp_mechanism *m)
{
    int32_t j;

    for (j = 0; j < m->contacts; j++) {
        const int32_t open = count_mode(m, j, PERP_MECHANISM_SEPARATE),
                      sticks = count_mode(m, j, PERP_MECHANISM_STICK), row = m->starts[j];

        if (open > 0 && open < 3)
            return 1;
        if (sticks > 0 && sticks < 3 &&
            CLOSING * fastest_row(m, row, 1) > fastest_row(m, row + 1, m->dims[j] - 1))
            return 1;
    }
    return 0;
}

/* The speed of v in the norm of M, in what the rows that hold leave free. */
static double free_speed(perp_mechanism *m, perp__adaptive *a, const double *v)
{
    int32_t i;

    perp__held_rows_begin(&m->held, m->n);
    for (i = 0; i < m->rows; i++)
        if (m->trial.holds[i] && m->half.holds[i] && m->next.holds[i])
            perp__hold_row(m, &m->begin, i, 0.0);
    perp__held_rows_solve(&m->held);
    perp__energy_norm(m, &m->begin, a->scratch, v);
    perp__project_out(m->held.basis, m->held.rank, m->n, a->scratch);
    return perp__length(a->scratch, m->n);
}

/* What forces k_0 a + k_1 b + k_2 c for a time w, weighed with h, come to beside the scale. */
static perp_status weigh(perp_mechanism *m, perp__adaptive *a, const double combination[3],
                         double w, double h, double *size)
{
    perp_status status;
    int32_t i;

    for (i = 0; i < m->n; i++)
        a->difference[i] = w * (combination[0] * a->force[0][i] + combination[1] * a->force[1][i] +
                                combination[2] * a->force[2][i]);
    perp__solve_mass(m, &m->begin, a->difference);
    status = perp__evaluate_rate(m, a->rate, m->next.q, a->difference);
    if (status == PERP_OK)
        *size = fmax(*size, h * perp__beside_scale(m, a->rate, a->scale));
    return status;
}

static perp_status estimate_hidden(perp_mechanism *m, perp__adaptive *a, double t, double h)
{
    static const double change[3] = {-1.0, 0.0, 1.0}, bend[3] = {1.0, -2.0, 1.0};
    perp_status status = perp__evaluate_force(m, a->force[1], t + 0.5 * h, m->half.q, m->half.v);

    if (status == PERP_OK)
        status = perp__evaluate_force(m, a->force[2], t + h, m->next.q, m->next.v);
    if (status == PERP_OK)
        status = weigh(m, a, bend, a->order == 2 ? h / 12.0 : h / 4.0, h, &a->hidden);
    if (status == PERP_OK && a->order == 1)
        status = weigh(m, a, change, h / 4.0, h, &a->hidden);
    return status;
}

perp_status perp__adaptive_estimate(perp_mechanism *m, perp__adaptive *a, double t, double h)
{
    const double weight = a->order == 2 ? 1.0 / 3.0 : 1.0;
    perp_status status;
    int32_t i;

    for (i = 0; i < m->coordinates; i++)
        a->moved[i] = weight * (m->next.q[i] - m->trial.q[i]);
    a->error = perp__beside_scale(m, a->moved, a->scale);
    for (i = 0; i < m->n; i++)
        a->difference[i] = weight * (m->next.v[i] - m->trial.v[i]);
    status = perp__evaluate_rate(m, a->rate, m->next.q, a->difference);
    if (status == PERP_OK) {
        a->error = fmax(a->error, h * perp__beside_scale(m, a->rate, a->scale));
        a->speed = chatters(m) ? 0.0 : free_speed(m, a, a->difference);
        a->speed = a->speed > 0.0 ? a->speed / a->speed_scale : 0.0;
    }
    a->error = fmax(a->error, a->event.error);
    a->hidden = 0.0;
    if (status == PERP_OK && (holds(&a->full) || holds(&a->first) || holds(&a->second)))
        status = estimate_hidden(m, a, t, h);
    return status;
}
