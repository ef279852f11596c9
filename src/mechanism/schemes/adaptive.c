/* Runs in steps chosen by their estimated error: each step is taken whole and in two halves.
 *
 * The halves count. Where all three have the same modes and nothing is hit, the leading term of the
 * error is taken out as well (local extrapolation): x := x_halves + (x_halves - x_full)/(2^p - 1),
 * which is of order p + 1 and keeps zeros; q is projected again.
 *
 * The length of the next step: h (0.9 tolerance/estimate)^(1/(p + 1)), as for smooth motions; once
 * a step was refused twice, in proportion. A step that is refused because it comes late to an event
 * is cut to end there, and the length it had is tried again afterwards. */
#include "mechanism/schemes/adaptive.h"

#include <math.h>
#include <string.h>

#include "step/length.h"

/* The share of what may be late that a step is planned to come late to an impact. */
#define BEHIND 0.25

/* Attempts in a row after which what there is counts without a solution, and velocities that still
 * differ by half of what they did are said to jump. */
#define STUBBORN 3

static void layout(perp__arena *arena, void *object)
{
    perp__adaptive *a = object;
    int8_t **const places[] = {&a->does[0], &a->does[1], &a->does[2],
                               &a->planned, &a->tried,   &a->after};

    PERP__DOUBLES(arena, (size_t)a->m->coordinates, &a->largest, &a->scale, &a->rate, &a->moved);
    PERP__DOUBLES(arena, (size_t)a->m->n, &a->difference, &a->scratch, &a->expected, &a->force[0],
                  &a->force[1], &a->force[2]);
    for (size_t k = 0; k < sizeof places / sizeof *places; k++)
        *places[k] = perp__arena_take(arena, (size_t)(a->m->contacts + a->m->dry), 1);
    PERP__DOUBLES(arena, (size_t)a->m->rows, &a->bias, &a->drift);
    PERP__DOUBLES(arena, (size_t)a->m->contacts, &a->inertia[0], &a->inertia[1], &a->inertia[2],
                  &a->gap[0], &a->gap[1], &a->gap[2], &a->open);
}

/* ---- one attempt --------------------------------------------------------------------------- */

static bool moves(const perp__adaptive *a)
{
    return perp__outcome_moves(a->full.outcome) && perp__outcome_moves(a->first.outcome) &&
           perp__outcome_moves(a->second.outcome);
}

static bool is_solved(const perp__adaptive *a)
{
    return perp__is_good(a->full.outcome) &&
           perp__is_good(perp__worse_outcome(a->first.outcome, a->second.outcome));
}

static bool same_modes(const perp_mechanism *m, const perp__motion *one, const perp__motion *other)
{
    return memcmp(one->modes, other->modes, (size_t)(m->contacts + m->dry) * sizeof *one->modes) ==
           0;
}

/* m->acceleration := that between two states; 0 where it is no guide to what comes. */
static void expect(perp_mechanism *m, const perp__motion *from, const perp__motion *to, double h,
                   bool lasts)
{
    for (int32_t i = 0; i < m->n; i++)
        m->acceleration[i] = lasts ? (to->v[i] - from->v[i]) / h : 0.0;
}

/* The step in one (part 0) and in two (parts 1 and 2), what happens in them, and the estimates.
 * Where one of them does not move, it is the last that was tried. */
static perp_status attempt(perp_mechanism *m, perp__adaptive *a, double t, double h)
{
    perp__motion *const to[] = {&m->trial, &m->half, &m->next};
    perp_mechanism_step *const steps[] = {&a->full, &a->first, &a->second};
    perp_status status = PERP_OK;

    a->jam = -1;
    a->release = 0;
    memset(&a->event, 0, sizeof a->event);
    memcpy(a->does[2], a->does[0], (size_t)(m->contacts + m->dry)); /* if it is not looked at */
    perp_struct_init(&a->first, sizeof a->first);
    perp_struct_init(&a->second, sizeof a->second);
    perp__adaptive_let_go(m, a->does[0], &m->now);
    memcpy(m->acceleration, a->expected, (size_t)m->n * sizeof *a->expected);
    for (int32_t part = 0; part < 3; part++) {
        const perp__motion *const from = part < 2 ? &m->now : &m->half;
        const double length = part > 0 ? 0.5 * h : h, start = part < 2 ? 0.0 : length;

        status = perp__adaptive_step(m, to[part], steps[part], t + start, length, from);
        if (part > 0)
            perp__adaptive_let_go(m, NULL, NULL);
        if (status != PERP_OK || !moves(a))
            return status;
        memcpy(a->gap[part], m->end.gap, (size_t)m->contacts * sizeof *a->gap[part]);
        for (int32_t j = 0; j < m->contacts; j++) { /* p of what slides with friction */
            const double speed = perp__length(m->start_velocity + m->tangent[j], m->tangents[j]);
            const bool slides = m->two_sided[j] == 0 &&
                                (a->does[0][j] & PERP__HOLD) == PERP__SLIDES &&
                                m->friction[j] > 0.0 && speed > 0.0 && m->begin.gap[j] <= 0.0;

            a->inertia[part][j] = slides ? perp__sliding_inertia(m, j, speed) : (double)NAN;
        }
        if (part == 1)
            status = perp__adaptive_scale(m, a, t);
        if (part > 0 && status == PERP_OK)
            perp__adaptive_events(m, a, from, to[part], start, length);
        if (part == 1)
            expect(m, from, &m->half, length,
                   a->started && a->first.impacts == 0 && a->event.late == 0.0 &&
                       same_modes(m, from, &m->half));
        if (status != PERP_OK)
            return status;
    }
    perp__adaptive_look_for_impact(m, a, h);
    status = perp__adaptive_estimate(m, a, t, h);
    PERP__THEN(status, perp__adaptive_look_for_jam(m, a, h));
    if (status == PERP_OK && is_solved(a) && !a->plans && a->jam < 0)
        status = perp__adaptive_releases(m, a, t, h);
    return status;
}

/* What decides. Velocities do not count where they jump: at impacts, and where attempt after
 * attempt they don't get nearer to each other. */
static double verdict(const perp__adaptive *a)
{
    const double worst = fmax(a->error, a->hidden);
    const bool jump =
        a->event.impact || (a->refused >= STUBBORN && a->speed > 0.5 * a->first_speed);

    return jump ? worst : fmax(worst, a->speed);
}

static void extrapolate(double *full, const double *halves, double weight, int32_t count)
{
    for (int32_t i = 0; i < count; i++)
        full[i] = halves[i] + weight * (halves[i] - full[i]);
}

/* ---- what comes of it ---------------------------------------------------------------------- */

/* The report of the step that was taken; improved: the whole step has a part in it. */
static void report(const perp_mechanism *m, const perp__adaptive *a, perp_mechanism_step *step,
                   bool improved)
{
    const perp_mechanism_step *const others[] = {&a->first, &a->full};

    *step = a->second;
    for (int32_t k = 0; k < 2; k++) {
        const perp_mechanism_step *other = others[k];

        step->seconds += other->seconds;
        step->iterations += other->iterations;
        step->evaluations += other->evaluations;
        if (k > 0 && !improved)
            continue;
        step->outcome = perp__worse_outcome(step->outcome, other->outcome);
        perp__raise_to(&step->residual, other->residual);
    }
    if (a->first.scheme != m->settings.scheme)
        step->scheme = a->first.scheme;
    step->impacts += a->first.impacts;
    step->error = a->error;
}

static perp_status take(perp__run *run, perp__adaptive *a, double t, double h)
{
    perp_mechanism *m = run->m;
    const double weight = a->order == 2 ? 1.0 / 3.0 : 1.0;
    const perp__motion *answer = &m->next;
    perp_mechanism_step step;
    perp_status status = PERP__OUTSIDE;
    bool smooth;

    for (int32_t i = 0; i < m->rows; i++)
        m->next.r[i] += m->half.r[i];
    smooth = a->jam < 0 && a->event.late == 0.0 &&
             a->full.impacts + a->first.impacts + a->second.impacts == 0 && is_solved(a) &&
             same_modes(m, &m->trial, &m->next) && same_modes(m, &m->half, &m->next) &&
             (!a->started || same_modes(m, &m->now, &m->next));
    expect(m, &m->half, &m->next, 0.5 * h, smooth);
    memcpy(a->expected, m->acceleration, (size_t)m->n * sizeof *a->expected);
    if (smooth) { /* the better answer; PERP__OUTSIDE: there is none */
        extrapolate(m->trial.q, m->next.q, weight, m->coordinates);
        extrapolate(m->trial.v, m->next.v, weight, m->n);
        extrapolate(m->trial.r, m->next.r, weight, m->rows);
        extrapolate(m->trial.u, m->next.u, weight, m->rows);
        for (int32_t j = 0; j < m->contacts; j++)
            if (m->two_sided[j] == 0)
                m->trial.r[m->starts[j]] = fmax(m->trial.r[m->starts[j]], 0.0);
        memcpy(a->moved, m->trial.q, (size_t)m->coordinates * sizeof *a->moved);
        memset(a->difference, 0, (size_t)m->n * sizeof *a->difference);
        status = perp__evaluate_move(m, m->trial.q, a->moved, a->moved, 0.0,
                                     a->difference); /* normalised */
        PERP__THEN(status, perp__project(m, &a->second, &m->trial, t));
    }
    if (status == PERP_OK)
        answer = &m->trial;
    if (status == PERP_OK || status == PERP__OUTSIDE)
        status = perp__mechanism_check_end(m, answer);
    report(m, a, &step, answer == &m->trial);
    if (status == PERP_OK && a->jam >= 0)
        status = perp__adaptive_jam(m, a, &step, &m->next, t);
    if (status != PERP_OK)
        return status;
    run->result.error += a->error;
    memcpy(a->largest, a->scale, (size_t)m->coordinates * sizeof *a->largest);
    a->fastest = a->speed_scale;
    memcpy(a->does[0], a->plans ? a->planned : a->does[2], (size_t)(m->contacts + m->dry));
    a->plans = a->cut = a->refused = 0;
    a->started = 1;
    status = perp__run_take(run, answer, t, h, &step);
    if (status == PERP_OK && a->jam >= 0 && !run->ended) {
        a->started = 0;
        status = perp__adaptive_look_at_start(m, a, t);
    }
    return status == PERP_OK && !run->ended ? perp__adaptive_meet(run, a, a->jam >= 0) : status;
}

/* The step is to be tried again; solved: it has estimates. */
static perp_status refuse(perp__run *run, perp__adaptive *a, double h, bool solved)
{
    perp_mechanism *m = run->m;
    const double tolerance = m->settings.error;
    perp_status status = PERP_OK;

    /* 1. the next length */
    a->searched = 0;
    a->cut = 0;
    if (a->release > 0 && !(a->event.error > tolerance)) {
        /* it ends where something lets go; where that is now, without a step */
        double when;

        status = perp__adaptive_locate(m, a, run->t, h, &when);
        if (status != PERP_OK)
            return status;
        a->proper = fmax(a->proper, h);
        a->h = a->plans ? when : h;
    } else {
        const double error = verdict(a), power = a->refused > 0 ? 1.0 : 1.0 / (a->order + 1.0);

        a->plans = 0;
        if (!solved)
            a->h = 0.25 * h;
        else if (a->event.error >= error && a->event.late > a->shortest) {
            a->cut = 1;
            a->proper = fmax(a->proper, h);
            a->h = a->event.after;
            if (!a->event.closes)
                a->h += BEHIND * a->event.late * tolerance / a->event.error;
            else if (a->h < a->shortest) { /* what is back at once did not leave */
                m->apart[a->event.closes - 1] = 0;
                a->h = h;
            }
        } else
            a->h = h * fmin(fmax(PERP__STEP_SAFETY * pow(tolerance / error, power),
                                 PERP__STEP_SHRINKING),
                            PERP__STEP_SAFETY);
        if (a->refused++ == 0)
            a->first_speed = a->speed;
    }
    /* 2. whether there is one */
    run->result.rejected++;
    run->result.iterations +=
        a->full.iterations + a->first.iterations + a->second.iterations + a->searched;
    if (perp__mechanism_is_late(m)) {
        run->result.outcome = PERP_OUTCOME_TIME_LIMIT;
        run->ended = 1;
    } else if (a->h < a->shortest && moves(a)) {
        run->result.outcome = PERP_OUTCOME_STALLED;
        run->ended = 1;
    } else if (a->h < a->shortest) {
        const perp_mechanism_step *last = !perp__outcome_moves(a->full.outcome)    ? &a->full
                                          : !perp__outcome_moves(a->first.outcome) ? &a->first
                                                                                   : &a->second;

        status = perp__run_take(run, &m->next, run->t, 0.0, last);
    }
    return status;
}

static perp_status step(perp__run *run, perp__adaptive *a, double t1)
{
    perp_mechanism *m = run->m;
    const double left = t1 - run->t;
    /* a length that an event asked for is kept as it is */
    const bool asked = a->plans || a->cut, last = a->h * (asked ? 1.0 : 1.01) >= left;
    const double h = last ? left : asked ? a->h : fmin(a->h, fmax(0.5 * left, a->h * 0.5));
    perp_status status = attempt(m, a, run->t, h);
    const double error = verdict(a);
    double factor = PERP__STEP_GROWTH;
    bool fine;

    if (status == PERP__OUTSIDE)
        a->full.outcome = PERP_OUTCOME_EVALUATION_FAILED;
    else if (status != PERP_OK)
        return status;
    fine = moves(a) && (is_solved(a) || a->refused >= STUBBORN) && a->release == 0 &&
           error <= m->settings.error;
    if (!fine)
        return refuse(run, a, h, moves(a) && error > m->settings.error);
    if (error > 0.0)
        factor = fmin(PERP__STEP_GROWTH,
                      PERP__STEP_SAFETY * pow(m->settings.error / error, 1.0 / (a->order + 1.0)));
    a->h = h * fmax(factor, PERP__STEP_SHRINKING);
    if (a->event.late > 0.0 || a->cut || a->plans)
        a->h = fmax(a->h, a->proper);
    a->proper = 0.0;
    a->h = fmin(a->h, a->longest);
    status = take(run, a, last ? t1 : run->t + h, h);
    if (status == PERP_OK && !run->ended && run->t < t1)
        status = perp__evaluate_force(m, a->force[0], run->t, m->now.q, m->now.v);
    return status;
}

perp_status perp__run_adaptive(perp__run *run, double t1, double h)
{
    perp_mechanism *m = run->m;
    const perp_mechanism_settings *settings = &m->settings;
    const double span = t1 - run->t;
    perp__adaptive *a;
    perp_status status;

    if (!m->adaptive)
        m->adaptive = perp__work_create(m, sizeof *m->adaptive, layout);
    a = m->adaptive;
    if (!a)
        return PERP_ERROR_MEMORY;
    memset(a->largest, 0, (size_t)m->coordinates * sizeof *a->largest);
    memset(a->scale, 0, (size_t)m->coordinates * sizeof *a->scale);
    memset(a->expected, 0, (size_t)m->n * sizeof *a->expected);
    a->longest = settings->longest > 0.0 ? fmin(settings->longest, span) : span;
    a->shortest = settings->shortest > 0.0 ? settings->shortest : ldexp(span, -40);
    a->shortest = fmax(a->shortest, 4.0 * DBL_EPSILON * fmax(fabs(run->t), fabs(t1)));
    a->h = fmin(h, a->longest);
    a->unit = fmax(fmin(h, span), fmin(ldexp(span, -40) / settings->error, 1e-3 * span));
    a->length = a->fastest = a->proper = 0.0;
    m->span = span;
    a->order = settings->scheme == PERP_MECHANISM_THETA && settings->theta == 0.5 ? 2 : 1;
    a->started = a->refused = a->plans = a->cut = 0;
    run->result.error = 0.0;
    memset(m->apart, 1, (size_t)m->contacts * sizeof *m->apart);
    status = perp__evaluate_force(m, a->force[0], run->t, m->now.q, m->now.v);
    PERP__THEN(status, perp__adaptive_look_at_start(m, a, run->t));
    PERP__THEN(status, perp__adaptive_meet(run, a, 1));
    while (status == PERP_OK && !run->ended && run->t < t1)
        status = step(run, a, t1);
    perp__adaptive_let_go(m, NULL, NULL);
    m->span = 0.0;
    memset(m->acceleration, 0, (size_t)m->n * sizeof *m->acceleration);
    memset(m->apart, 0, (size_t)m->contacts * sizeof *m->apart);
    if (status == PERP__OUTSIDE) { /* k, N or the rows where a step ended: no motion from there */
        run->result.outcome = PERP_OUTCOME_EVALUATION_FAILED;
        run->ended = 1;
        status = PERP_OK;
    }
    return status;
}
