/* Events within a step: what makes full and half steps agree, or disagree, for no good reason.
 *
 * Impacts: a step ends on the contact that it reaches, whenever within the step that was, so that
 * full and half steps agree however late they are. With u the speed without the contact's own
 * impulse, a half step of length l passes the contact by gap + l u < 0; it is late by (gap + l
 * u)/u, for which the jump of velocities carries q the wrong way.
 *
 * Turns: friction acts through the velocity at the end of a step. Where a slip turns round,
 * friction has the wrong sign until then, or holds on to the end what would slip back; both change
 * velocities by the bound times a share of the step. */
#include "mechanism/schemes/adaptive.h"

#include <math.h>
#include <string.h>

double perp__beside_scale(const perp_mechanism *m, const double *x, const double *scale)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < m->coordinates; i++)
        if (x[i] != 0.0)
            largest = fmax(largest, fabs(x[i]) / scale[i]);
    return largest;
}

static void keep(perp__adaptive *a, double late, double error, double after, int32_t impact)
{
    if (!(late > 0.0) || !(error > a->event.error))
        return;
    a->event.late = late;
    a->event.error = error;
    a->event.after = after;
    a->event.impact = impact;
}

/* ---- impacts ------------------------------------------------------------------------------- */

/* a->difference := M^-1 J_j'r_j, of the rows of contact j. */
static void jump_of(perp_mechanism *m, perp__adaptive *a, const double *r, int32_t j)
{
    int32_t i;

    memset(a->difference, 0, (size_t)m->n * sizeof *a->difference);
    for (i = m->starts[j]; i < m->starts[j + 1]; i++)
        perp__add_row(m, &m->begin, i, r[i], a->difference);
    perp__solve_mass(m, &m->begin, a->difference);
}

/* By how much contact j was met late, with its jump in a->difference; 0: it was not hit. */
static double lateness(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                       const perp__motion *to, double length, int32_t j)
{
    const int32_t row = m->starts[j];
    const double gap = fmax(m->begin.gap[j], 0.0);
    double before, free;

    if (to->r[row] == 0.0)
        return 0.0;
    jump_of(m, a, to->r, j);
    before = perp__row_times(m, &m->begin, row, m->begin.drift[row], from->v);
    free = to->u[row] - perp__row_times(m, &m->begin, row, 0.0, a->difference);
    if (!(before < -fabs(free - before))) /* resting contact */
        return 0.0;
    if (gap <= perp__gap_rounding(m, &m->begin, row, from->q))
        return m->restitution[j] > 0.0 ? length : 0.0; /* an inelastic one ends there */
    return fmin(fmax(length + gap / free, 0.0), length);
}

static perp_status look_for_impact(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                                   const perp__motion *to, double start, double length, int32_t j)
{
    const double late = lateness(m, a, from, to, length, j);
    perp_status status;

    if (late == 0.0)
        return PERP_OK;
    status = perp__evaluate_rate(m, a->rate, to->q, a->difference);
    if (status == PERP_OK)
        keep(a, late, late * perp__beside_scale(m, a->rate, a->scale), start + length - late, 1);
    return status;
}

/* ---- turns --------------------------------------------------------------------------------- */

/* The rows of one friction: `count` from `row`, with a bound of its impulse. */
typedef struct friction {
    int32_t row, count, mode; /* mode: its place among the modes */
    double bound;
} friction;

/* Writes the direction of the slip at the start into d; its speed. */
static double slip_at(const perp_mechanism *m, const friction *f, const double *v, double d[2])
{
    double speed;
    int32_t i;

    d[0] = d[1] = 0.0;
    for (i = 0; i < f->count; i++)
        d[i] = perp__row_times(m, &m->begin, f->row + i, m->begin.drift[f->row + i], v);
    speed = hypot(d[0], d[1]);
    for (i = 0; i < 2 && speed > 0.0; i++)
        d[i] /= speed;
    return speed;
}

/* a->difference := M^-1 J'd; d'J M^-1 J'd. */
static double response_to(perp_mechanism *m, perp__adaptive *a, const friction *f,
                          const double d[2])
{
    double sum = 0.0;
    int32_t i;

    memset(a->difference, 0, (size_t)m->n * sizeof *a->difference);
    for (i = 0; i < f->count; i++)
        perp__add_row(m, &m->begin, f->row + i, d[i], a->difference);
    perp__solve_mass(m, &m->begin, a->difference);
    for (i = 0; i < f->count; i++)
        sum += d[i] * perp__row_times(m, &m->begin, f->row + i, 0.0, a->difference);
    return sum;
}

static void look_for_turn(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                          const perp__motion *to, double start, double length, const friction *f)
{
    const int32_t sticks = to->modes[f->mode] == PERP_MECHANISM_STICK;
    double d[2], speed, after = 0.0, own = 0.0, response, lost, when, wrong;
    int32_t i;

    if (from->modes[f->mode] != PERP_MECHANISM_SLIP || !(f->bound > 0.0))
        return;
    speed = slip_at(m, f, from->v, d);
    for (i = 0; i < f->count; i++) {
        after += d[i] * to->u[f->row + i];
        own += d[i] * to->r[f->row + i];
    }
    if (!(speed > 0.0) || (after >= 0.0 && !sticks))
        return;
    response = response_to(m, a, f, d);
    lost = speed - (after - response * own); /* by other forces than this friction */
    when = length * speed / (lost + response * f->bound);
    if (!(response > 0.0) || !(when >= 0.0 && when < length))
        return;
    wrong = sticks ? fmax(lost / response - f->bound, 0.0) * (length - when) / length
                   : 2.0 * f->bound * when / length;
    if (wrong > 0.0)
        keep(a, length - when, wrong * sqrt(response) / a->speed_scale, start + when, 0);
}

perp_status perp__adaptive_events(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                                  const perp__motion *to, double start, double length)
{
    perp_status status = PERP_OK;
    int32_t j;

    for (j = 0; j < m->contacts + m->dry && status == PERP_OK; j++) {
        const friction f = {m->tangent[j], m->tangents[j], j,
                            j < m->contacts ? m->friction[j] * to->r[m->starts[j]]
                                            : m->dry_bound[j - m->contacts]};

        if (j < m->contacts)
            status = look_for_impact(m, a, from, to, start, length, j);
        look_for_turn(m, a, from, to, start, length, &f);
    }
    return status;
}
