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
    a->speed_scale = fmax(a->speed_scale, a->unit * perp__speed(m, &m->begin, acceleration));
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
        a->speed_scale = fmax(a->speed_scale, perp__speed(m, &m->begin, states[i]->v));
        widen(m, a->scale, states[i]->q, 1.0);
        status = perp__evaluate_rate(m, a->rate, states[i]->q, states[i]->v);
        widen(m, a->scale, a->rate, a->unit);
    }
    for (int32_t i = 0; i < m->coordinates; i++)
        largest = fmax(largest, a->scale[i]);
    for (int32_t i = 0; i < m->coordinates; i++)
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

    for (int32_t k = 0; k < 3; k++)
        for (int32_t i = row; i < row + count; i++)
            fastest = fmax(fastest, fabs(states[k]->u[i]));
    return fastest;
}

/* Whether a contact presses in some of the answers only, or sticks in some of them only while what
 * it slips is no faster than what closes its gap. */
static int32_t chatters(const perp_mechanism *m)
{
    for (int32_t j = 0; j < m->contacts; j++) {
        const int32_t open = count_mode(m, j, PERP_MECHANISM_SEPARATE),
                      sticks = count_mode(m, j, PERP_MECHANISM_STICK), row = m->starts[j];

        if (m->two_sided[j] > 0)
            continue;
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
    perp__held_rows_begin(&m->held, m->n);
    for (int32_t i = 0; i < m->rows; i++)
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

    for (int32_t i = 0; i < m->n; i++)
        a->difference[i] = w * (combination[0] * a->force[0][i] + combination[1] * a->force[1][i] +
                                combination[2] * a->force[2][i]);
    perp__solve_mass(m, &m->begin, a->difference, a->difference);
    status = perp__evaluate_rate(m, a->rate, m->next.q, a->difference);
    if (status == PERP_OK)
        *size = fmax(*size, h * perp__adaptive_beside(m, a->rate, a->scale));
    return status;
}

static perp_status estimate_hidden(perp_mechanism *m, perp__adaptive *a, double t, double h)
{
    static const double change[3] = {-1.0, 0.0, 1.0}, bend[3] = {1.0, -2.0, 1.0};
    perp_status status = perp__evaluate_force(m, a->force[1], t + 0.5 * h, m->half.q, m->half.v);

    PERP__THEN(status, perp__evaluate_force(m, a->force[2], t + h, m->next.q, m->next.v));
    PERP__THEN(status, weigh(m, a, bend, a->order == 2 ? h / 12.0 : h / 4.0, h, &a->hidden));
    if (status == PERP_OK && a->order == 1)
        status = weigh(m, a, change, h / 4.0, h, &a->hidden);
    return status;
}

perp_status perp__adaptive_estimate(perp_mechanism *m, perp__adaptive *a, double t, double h)
{
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
        a->speed = chatters(m) ? 0.0 : free_speed(m, a, a->difference);
        a->speed = a->speed > 0.0 ? a->speed / a->speed_scale : 0.0;
    }
    a->error = fmax(a->error, a->event.error);
    a->hidden = 0.0;
    if (status == PERP_OK && (holds(&a->full) || holds(&a->first) || holds(&a->second)))
        status = estimate_hidden(m, a, t, h);
    return status;
}

/* ---- events within a step ----------------------------------------------------------------------
 *
 * What makes full and half steps agree, or disagree, for no good reason.
 *
 * Impacts: a step ends on the contact that it reaches, whenever within the step that was, so that
 * full and half steps agree however late they are. With u the speed without the contact's own
 * impulse, a half step of length l passes the contact by gap + l u < 0; it is late by (gap + l
 * u)/u, for which the jump of velocities carries q the wrong way.
 *
 * Turns: friction acts through the velocity at the end of a step. Where a slip turns round,
 * friction has the wrong sign until then, or holds on to the end what would slip back; both change
 * velocities by the bound times a share of the step. Where it ends, the mean velocity of
 * a step of order 2 goes on behind the end: as wrong as the slip was fast. */

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
    memset(a->difference, 0, (size_t)m->n * sizeof *a->difference);
    for (int32_t i = m->starts[j]; i < m->starts[j + 1]; i++)
        perp__add_row(m, &m->begin, i, r[i], a->difference);
    perp__solve_mass(m, &m->begin, a->difference, a->difference);
}

/* Whether contact j was hit, approached faster than the forces of the step make it; its speed
 * without its own impulses, whose jump is in a->difference. */
static int32_t is_hit(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                      const perp__motion *to, int32_t j, double *free)
{
    const int32_t row = m->starts[j];
    double before;

    if (to->r[row] == 0.0 || m->two_sided[j] > 0)
        return 0;
    jump_of(m, a, to->r, j);
    before = perp__row_times(m, &m->begin, row, m->begin.drift[row], from->v);
    *free = to->u[row] - perp__row_times(m, &m->begin, row, 0.0, a->difference);
    return before < -fabs(*free - before); /* else it rests */
}

static perp_status look_for_impact(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                                   const perp__motion *to, double start, double length, int32_t j)
{
    const double gap = fmax(m->begin.gap[j], 0.0);
    double free, late;
    perp_status status;

    if (!is_hit(m, a, from, to, j, &free))
        return PERP_OK;
    if (gap <= perp__gap_rounding(m, &m->begin, m->starts[j], from->q))
        late = m->restitution[j] > 0.0 ? length : 0.0; /* an inelastic one ends there */
    else
        late = fmin(fmax(length + gap / free, 0.0), length);
    status = perp__evaluate_rate(m, a->rate, to->q, a->difference);
    if (status == PERP_OK)
        keep(a, late, late * perp__adaptive_beside(m, a->rate, a->scale), start + length - late, 1);
    return status;
}

/* ---- turns --------------------------------------------------------------------------------- */

/* The rows of one friction: `count` from `row`, with a bound of its impulse. */
typedef struct friction {
    int32_t row, count, mode; /* mode: its place among the modes */
    int32_t ends;             /* a slip may end in it smoothly, so that it is located */
    double bound;
} friction;

/* Writes the direction of the slip at the start into d; its speed. */
static double slip_at(const perp_mechanism *m, const friction *f, const double *v, double d[2])
{
    double speed;

    d[0] = d[1] = 0.0;
    for (int32_t i = 0; i < f->count; i++)
        d[i] = perp__row_times(m, &m->begin, f->row + i, m->begin.drift[f->row + i], v);
    speed = hypot(d[0], d[1]);
    for (int32_t i = 0; i < 2 && speed > 0.0; i++)
        d[i] /= speed;
    return speed;
}

/* d'J M^-1 J'd in what constraints leave free, those of contacts that hold both ways among them. */
static double response_to(perp_mechanism *m, perp__adaptive *a, const friction *f,
                          const double d[2])
{
    double all, free;

    perp__hold_constraints(m);
    memset(a->scratch, 0, (size_t)m->n * sizeof *a->scratch);
    for (int32_t i = 0; i < f->count; i++)
        perp__add_row(m, &m->begin, f->row + i, d[i], a->scratch);
    perp__solve_lower(m, &m->begin, a->scratch);
    all = perp__length(a->scratch, m->n);
    perp__project_out(m->held.basis, m->held.rank, m->n, a->scratch);
    free = perp__length(a->scratch, m->n);
    return free > PERP__AGREEMENT * all ? free * free : 0.0;
}

static void look_for_turn(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                          const perp__motion *to, double start, double length, const friction *f)
{
    const int32_t sticks = to->modes[f->mode] == PERP_MECHANISM_STICK;
    double d[2], speed, after = 0.0, own = 0.0, response, lost, when, wrong;

    if (from->modes[f->mode] != PERP_MECHANISM_SLIP || !(f->bound > 0.0))
        return;
    speed = slip_at(m, f, from->v, d);
    for (int32_t i = 0; i < f->count; i++) {
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
    wrong = sticks ? fmax(lost / response - f->bound, f->ends ? speed / response : 0.0) *
                         (length - when) / length
                   : 2.0 * f->bound * when / length;
    if (wrong > 0.0)
        keep(a, length - when, wrong * sqrt(response) / a->speed_scale, start + when, 0);
}

perp_status perp__adaptive_events(perp_mechanism *m, perp__adaptive *a, const perp__motion *from,
                                  const perp__motion *to, double start, double length)
{
    int32_t hits = 0;
    double free;
    perp_status status = PERP_OK;

    for (int32_t j = 0; j < m->contacts; j++)
        hits |= is_hit(m, a, from, to, j, &free);
    for (int32_t j = 0; j < m->contacts + m->dry && status == PERP_OK; j++) {
        /* impulses end a slip at any length: those of a hit, and those of what jams both ways */
        const int32_t ends = a->order == 2 && !hits && (j >= m->contacts || m->two_sided[j] == 0);
        const friction f = {m->tangent[j], m->tangents[j], j, ends,
                            j < m->contacts ? m->friction[j] * perp__load_of(m, to->r, j)
                                            : m->dry_bound[j - m->contacts]};

        if (j < m->contacts)
            status = look_for_impact(m, a, from, to, start, length, j);
        look_for_turn(m, a, from, to, start, length, &f);
    }
    return status;
}
