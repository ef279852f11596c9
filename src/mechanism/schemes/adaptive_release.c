/* What holds and lets go within a step: a contact that opens, a contact or dry group that starts to
 * slip.
 *
 * A step's impulse is a mean: it holds up to twice as long as the forces do, and where they change
 * linearly full and half steps agree on it. So what the forces do is looked at by themselves, at
 * the ends of the half steps. With u = 0 there, or a slip along d,
 *
 *   M a = k + J'f,   u' = J a + d/dt(J) v + d/dt(drift),   0 <= f_n perp u_n' >= 0,
 *   |f_t| <= mu f_n, opposite to u_t' where that is not 0; f_t = -mu f_n d of a slip,
 *
 * a contact problem in accelerations, in which a slip is a drift too fast to be turned round. A
 * contact lets go where u' is not 0 though it was held. When it does so is the zero of the force
 * that is left, f_n or mu f_n - |f_t|, over the length of a step on which it holds. */
#include "mechanism/schemes/adaptive.h"

#include <math.h>
#include <string.h>

/* Differences are of order 4. */
#define BIAS_LEVELS 2

/* ---- what the steps say ---------------------------------------------------------------------- */

/* What a contact that is closed, or a dry group, does with these forces. */
static int8_t held(const perp_mechanism *m, int32_t j, bool sticks, const double *r)
{
    if (!(j < m->contacts ? m->tangents[j] > 0 && fmax(m->mu_static[j], m->begin.mu[j]) > 0.0
                          : m->begin.bound[j - m->contacts] > 0.0))
        return PERP__SLIDES;
    if (sticks)
        return PERP__STICKS;
    return j < m->contacts && m->two_sided[j] == 1 && r[m->starts[j]] < 0.0
               ? PERP__SLIDES | PERP__OTHER_SIDE
               : PERP__SLIDES;
}

/* What a step says: it keeps closed what holds, also a contact that it reaches, with the speed gap
 * / h. */
static void read_state(const perp_mechanism *m, const perp__adaptive *a, const perp__motion *state,
                       int8_t *does)
{
    for (int32_t j = 0; j < m->contacts + m->dry; j++) {
        bool closed = j >= m->contacts || m->two_sided[j] > 0;

        if (!closed && state->holds[m->starts[j]]) {
            const double u = state->u[m->starts[j]];

            closed = u == 0.0 || (u < 0.0 && -u * a->length <= perp__adaptive_uncertainty(m, a, j));
        }
        does[j] = closed ? held(m, j, state->modes[j] == PERP_MECHANISM_STICK, state->r)
                         : (int8_t)PERP__FREE;
    }
}

/* Whether what was held is held less, or on its other side. */
static bool lets_go(int8_t before, int8_t after)
{
    return (after & PERP__HOLD) < (before & PERP__HOLD) ||
           (before != after && (after & PERP__HOLD) == PERP__SLIDES &&
            (before & PERP__HOLD) == PERP__SLIDES);
}

static bool is_lost(const perp_mechanism *m, const int8_t *before, const int8_t *after)
{
    for (int32_t j = 0; j < m->contacts + m->dry; j++)
        if (lets_go(before[j], after[j]))
            return 1;
    return 0;
}

/* Whether something was hit: what lets go then is thrown off. */
static bool is_hit(const perp_mechanism *m, const perp__motion *state,
                   const perp_mechanism_step *step, const int8_t *before)
{
    for (int32_t j = 0; j < m->contacts; j++)
        if (before[j] == PERP__FREE && state->r[m->starts[j]] > 0.0)
            return 1;
    return step->impacts > 0;
}

/* ---- forces at an instant -------------------------------------------------------------------- */

perp_status perp__adaptive_find_forces(perp_mechanism *m, perp__adaptive *a, double t,
                                       const perp__motion *state, const int8_t *does)
{
    perp__terms terms = m->begin;
    perp__velocity_problem problem;
    perp_status status =
        perp__evaluate_bias(m, a->bias, NULL, t, state->q, state->v, a->span, BIAS_LEVELS);
    bool again = 1;

    if (status != PERP_OK)
        return status;
    memset(m->shift, 0, (size_t)m->contacts * sizeof *m->shift);
    perp__friction_of_speed(m, &m->begin, m->friction, state->u, state->v);
    memcpy(m->start_velocity, state->u, (size_t)m->rows * sizeof *m->start_velocity);
    for (int32_t j = 0; j < m->contacts; j++) {
        const bool sticks = does[j] == PERP__STICKS;

        m->included[j] = does[j] != PERP__FREE;
        m->start_speed[j] = sticks ? 0.0 : perp__length(state->u + m->tangent[j], m->tangents[j]);
        if (sticks)
            m->friction[j] = fmax(m->mu_static[j], m->begin.mu[j]);
    }
    terms.drift = a->drift;
    problem = perp__pose(m, &terms);
    problem.momentum = m->begin.k;
    problem.dry = m->begin.bound;
    /* the largest acceleration of a row in free motion, term by term */
    a->free = 0.0;
    perp__solve_mass(m, &m->begin, m->work, m->begin.k);
    for (int32_t i = 0; i < m->rows; i++)
        a->free = fmax(a->free, perp__row_terms(m, &m->begin, i, fabs(a->bias[i]), m->work));
    memcpy(a->drift, a->bias, (size_t)m->rows * sizeof *a->drift);
    for (int32_t pass = 0; pass < PERP__MOST_ITERATES && again && status == PERP_OK; pass++) {
        /* the drift of what slides: its slip, less the accelerations of the last pass; again: slips
         * in three dimensions still turn */
        again = 0;
        for (int32_t j = 0; j < m->contacts + m->dry; j++) {
            const int32_t first = m->tangent[j], count = m->tangents[j];
            const double speed = (does[j] & PERP__HOLD) == PERP__SLIDES
                                     ? perp__length(state->u + first, count)
                                     : 0.0;

            for (int32_t i = first; i < first + count && speed > 0.0; i++) {
                const double before = a->drift[i];

                a->drift[i] = PERP__FAST * a->free * (state->u[i] / speed);
                if (pass > 0)
                    a->drift[i] -= m->answer.u[i] - before;
                again |= count > 1 &&
                         fabs(a->drift[i] - before) > PERP__NOTHING * (PERP__FAST * a->free);
            }
        }
        m->answer.iterations = 0;
        status = perp__solve_velocities(m, &m->answer, &problem);
        a->searched += m->answer.iterations;
    }
    return status;
}

/* Whether the rows have an acceleration. */
static bool starts(const perp_mechanism *m, const perp__adaptive *a, int32_t row, int32_t count)
{
    const double least = fmax(PERP__NOTHING, m->answer.residual) * a->free;

    for (int32_t i = row; i < row + count; i++)
        if (!m->answer.holds[i] && fabs(m->answer.u[i]) > least)
            return 1;
    return 0;
}

/* after: what is held in `before`, and what the state's step says that is held, goes on to do by
 * the forces at (t, state); a state whose forces are not found keeps it. does: what it is in by its
 * step as well. A contact that chatters, as the rows of a step's start let it, has not let go. */
static perp_status look(perp_mechanism *m, perp__adaptive *a, double t, const perp__motion *state,
                        const int8_t *before, int8_t *does, int8_t *after)
{
    const int32_t count = m->contacts + m->dry;
    perp_status status;

    read_state(m, a, state, does);
    for (int32_t j = 0; j < count; j++)
        after[j] = (does[j] & PERP__HOLD) > (before[j] & PERP__HOLD) ? does[j] : before[j];
    status = perp__evaluate_all(m, &m->begin, t, state->q, state->v);
    PERP__THEN(status, perp__adaptive_find_forces(m, a, t, state, after));
    a->known = status == PERP_OK && perp__is_good(m->answer.outcome);
    for (int32_t j = 0; j < count && a->known; j++) {
        const bool one_sided = j < m->contacts && m->two_sided[j] == 0;

        if (one_sided && after[j] != PERP__FREE && starts(m, a, m->starts[j], 1))
            after[j] = PERP__FREE;
        else if (after[j] != PERP__FREE)
            after[j] =
                held(m, j, after[j] == PERP__STICKS && !starts(m, a, m->tangent[j], m->tangents[j]),
                     m->answer.r);
        if ((after[j] & PERP__HOLD) <= (does[j] & PERP__HOLD) ||
            (does[j] == PERP__FREE && m->begin.gap[j] <= perp__adaptive_uncertainty(m, a, j)))
            does[j] = after[j];
    }
    return status == PERP__OUTSIDE ? PERP_OK : status; /* differences reach further than steps */
}

/* The least force that is left of what was held; below 0, that which is missing. */
static double margin(perp_mechanism *m, const int8_t *before, const int8_t *after)
{
    const perp__motion *now = &m->answer;
    double least = INFINITY;

    for (int32_t j = 0; j < m->contacts + m->dry; j++) {
        const int32_t dry = j >= m->contacts, row = dry ? -1 : m->starts[j];
        const int32_t first = m->tangent[j], count = m->tangents[j];
        double bound;

        if (before[j] == PERP__FREE)
            continue;
        if (after[j] == PERP__FREE)
            least = fmin(least, -now->u[row] / perp__row_mobility(m, row));
        else if (!dry)
            least = fmin(least, now->r[row]);
        if (before[j] != PERP__STICKS || after[j] == PERP__FREE)
            continue;
        bound = dry ? m->begin.bound[j - m->contacts] : m->friction[j] * now->r[row];
        least = fmin(least, after[j] == PERP__SLIDES ? -perp__length(now->u + first, count) /
                                                           perp__row_mobility(m, first)
                                                     : bound - perp__length(now->r + first, count));
    }
    return least;
}

/* Whether the impulses of the halves, continued, hold what was held: nothing is to be looked at. */
static bool is_calm(const perp_mechanism *m, perp__adaptive *a, const int8_t *does)
{
    double *r = a->drift;

    for (int32_t i = 0; i < m->rows; i++)
        r[i] = 2.0 * m->next.r[i] - m->half.r[i];
    for (int32_t j = 0; j < m->contacts + m->dry; j++) {
        const bool dry = j >= m->contacts, one_sided = !dry && m->two_sided[j] == 0;

        if (does[j] == PERP__FREE)
            continue;
        if ((one_sided && !(r[m->starts[j]] > 0.0)) ||
            (does[j] != PERP__STICKS && held(m, j, 0, r) != does[j]))
            return 0;
        if (does[j] == PERP__STICKS &&
            !(perp__length(r + m->tangent[j], m->tangents[j]) <
              (dry ? m->dry_bound[j - m->contacts] : m->friction[j] * perp__load_of(m, r, j))))
            return 0;
    }
    return 1;
}

/* ---- the step at hand ---------------------------------------------------------------------- */

perp_status perp__adaptive_releases(perp_mechanism *m, perp__adaptive *a, double t, double h)
{
    const perp__motion *const states[] = {&m->half, &m->next};
    const perp_mechanism_step *const steps[] = {&a->first, &a->second};
    const size_t size = (size_t)(m->contacts + m->dry);
    bool calm = 1;
    perp_status status = PERP_OK;

    a->span = fmax(PERP__LITTLE * h, PERP__LITTLE * a->unit);
    a->length = 0.5 * h;
    for (int32_t k = 0; k < 2; k++) {
        read_state(m, a, states[k], a->does[k + 1]);
        calm = calm && memcmp(a->does[0], a->does[k + 1], size) == 0 &&
               !is_hit(m, states[k], steps[k], a->does[0]);
    }
    if (calm && is_calm(m, a, a->does[0]))
        return PERP_OK;
    for (int32_t k = 0; k < 2 && a->release == 0 && status == PERP_OK; k++) {
        status =
            look(m, a, t + (k + 1) * (0.5 * h), states[k], a->does[k], a->does[k + 1], a->after);
        if (status == PERP_OK && is_lost(m, a->does[k], a->after) &&
            !is_hit(m, states[k], steps[k], a->does[k]))
            a->release = k + 1;
    }
    return status;
}

/* The next length between `low`, which holds, and `high`: the secant's, kept off the ends so that
 * both close in (I. F. D. Oliveira & R. H. C. Takahashi's ITP, ACM TOMS 47 (2020)). */
static double next_length(double low, double high, double left, double missing, double whole,
                          double least, int32_t pass)
{
    const double middle = 0.5 * (low + high);
    double x, shift, radius;

    if (!(missing > -INFINITY) || !(left < INFINITY) || !(left > 0.0))
        return middle;
    x = (low * missing - high * left) / (missing - left);
    shift = fmax(0.2 * (high - low) * (high - low) / whole, least);
    x = fabs(middle - x) > shift ? x + copysign(shift, middle - x) : middle;
    radius = ldexp(whole, -pass) - 0.5 * (high - low);
    return fabs(middle - x) <= radius ? x : middle - copysign(fmax(radius, 0.0), middle - x);
}

perp_status perp__adaptive_locate(perp_mechanism *m, perp__adaptive *a, double t, double h,
                                  double *when)
{
    const perp__motion *from = a->release == 1 ? &m->now : &m->half;
    const int8_t *held_before = a->does[a->release - 1];
    const size_t size = (size_t)(m->contacts + m->dry);
    const double whole = 0.5 * h, start = a->release == 1 ? 0.0 : whole;
    const double least = fmax(4.0 * DBL_EPSILON * (fabs(t) + h), PERP__NOTHING * h);
    double low = 0.0, high = whole, left = INFINITY, missing = -INFINITY;
    perp_mechanism_step step;
    perp_status status = PERP_OK;

    memcpy(a->planned, a->does[a->release], size);
    if (a->release == 1) {
        perp__adaptive_let_go(m, a->does[0], &m->now);
        memcpy(m->acceleration, a->expected, (size_t)m->n * sizeof *a->expected);
    }
    for (int32_t pass = 1; high - low > least && pass < PERP__MOST_HALVES && status == PERP_OK;
         pass++) {
        const double x = next_length(low, high, left, missing, whole, 0.5 * least, pass);
        const perp_mechanism_start now = {.t = t + start, .h = x, .q = from->q, .v = from->v};
        double found = INFINITY;

        /* a single step of that length, and the least force that is left at its end */
        status = perp__take_step(m, &m->trial, &step, &now);
        a->searched += step.iterations;
        a->length = x;
        PERP__THEN(status, look(m, a, t + start + x, &m->trial, held_before, a->tried, a->after));
        if (status == PERP_OK && a->known)
            found = margin(m, held_before, a->after);
        if (!is_lost(m, held_before, a->after)) {
            low = x;
            left = found;
        } else {
            high = x;
            missing = found;
            memcpy(a->planned, a->tried, size);
        }
    }
    perp__adaptive_let_go(m, NULL, NULL);
    *when = start + high;
    a->plans = *when > a->shortest;
    for (int32_t j = 0; j < m->contacts + m->dry && status == PERP_OK && !a->plans; j++)
        if (lets_go(a->does[0][j], a->planned[j]))
            a->does[0][j] = a->planned[j];
    return status;
}

void perp__adaptive_let_go(perp_mechanism *m, const int8_t *does, const perp__motion *state)
{
    for (int32_t j = 0; j < m->contacts; j++)
        m->let_go[j] = does && (does[j] & PERP__HOLD) == PERP__SLIDES &&
                       perp__length(state->u + m->tangent[j], m->tangents[j]) == 0.0;
}

perp_status perp__adaptive_step(perp_mechanism *m, perp__motion *to, perp_mechanism_step *step,
                                double t, double h, const perp__motion *state)
{
    const perp_mechanism_start from = {.t = t, .h = h, .q = state->q, .v = state->v};
    perp_status status = perp__take_step(m, to, step, &from);
    bool caught = 0, slips = 0;

    if (status != PERP_OK || !perp__outcome_moves(step->outcome))
        return status;
    /* 1. what slips back, though it would have stuck on the way, gets static friction */
    for (int32_t j = 0; j < m->contacts; j++) {
        double along = 0.0;

        for (int32_t i = m->tangent[j]; i < m->tangent[j] + m->tangents[j]; i++)
            along += m->start_velocity[i] * to->u[i];
        if (m->mu_static[j] > m->begin.mu[j] && along < 0.0)
            m->let_go[j] = -1;
        caught = caught || m->let_go[j] < 0;
    }
    if (!caught)
        return status;
    /* 2. and loses it where it slips nevertheless */
    status = perp__take_step(m, to, step, &from);
    for (int32_t j = 0; j < m->contacts; j++) {
        slips = slips || (m->let_go[j] < 0 && to->modes[j] == PERP_MECHANISM_SLIP);
        m->let_go[j] = m->let_go[j] > 0;
    }
    return status == PERP_OK && slips ? perp__take_step(m, to, step, &from) : status;
}

perp_status perp__adaptive_look_at_start(perp_mechanism *m, perp__adaptive *a, double t)
{
    perp__motion *now = &m->now;
    perp_status status = perp__evaluate_all(m, &m->begin, t, now->q, now->v);

    if (status != PERP_OK)
        return status;
    perp__clear_motion(m, now);
    perp__row_velocities(m, &m->begin, now->u, now->v);
    for (int32_t j = 0; j < m->contacts + m->dry; j++) {
        const int32_t first = m->tangent[j], end = first + m->tangents[j];
        const bool rests =
            perp__sliding_speed(m, &m->begin, j, now->u, now->v, PERP__NOTHING) == 0.0;
        bool touches;

        for (int32_t i = first; i < end && rests; i++)
            now->u[i] = 0.0;
        touches = j >= m->contacts || m->two_sided[j] > 0;
        if (!touches) { /* closed, and stays so if forces allow it */
            const int32_t row = m->starts[j];
            const double speed = PERP__NOTHING * perp__row_size(m, &m->begin, row, now->v);

            touches = m->begin.gap[j] <= perp__adaptive_uncertainty(m, a, j) &&
                      fabs(now->u[row]) <= speed;
        }
        if (touches)
            now->modes[j] = rests ? PERP_MECHANISM_STICK : PERP_MECHANISM_SLIP;
        a->does[0][j] = touches ? held(m, j, rests, now->r) : (int8_t)PERP__FREE;
    }
    a->span = PERP__LITTLE * a->unit;
    return look(m, a, t, now, a->does[0], a->tried, a->does[0]);
}
