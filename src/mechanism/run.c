/* Runs: steps one after the other, with an observer. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"
#include "mechanism/schemes/adaptive.h"

/* Shows m->now; PERP_OK, or PERP_ERROR_CALLBACK. */
static perp_status show(perp__run *run, double h, const perp_mechanism_step *step)
{
    perp_mechanism *m = run->m;
    const perp_mechanism_view view = {.struct_size = sizeof view,
                                      .t = run->t,
                                      .h = h,
                                      .q = m->now.q,
                                      .v = m->now.v,
                                      .impulse = m->now.r,
                                      .velocity = m->now.u,
                                      .modes = m->now.modes,
                                      .step = step};
    int32_t answer;

    if (!run->observer)
        return PERP_OK;
    answer = run->observer(&view, run->user);
    if (answer < 0)
        return perp__fail(m->context, PERP_ERROR_CALLBACK, "the observer returned %d", (int)answer);
    if (answer > 0) {
        run->result.outcome = PERP_OUTCOME_STOPPED;
        run->ended = 1;
    }
    return PERP_OK;
}

/* ---- overlap ------------------------------------------------------------------------------- */

/* The size of gaps and constraints: the largest row of one and the largest coordinate so far. */
static double size_of_gaps(perp__run *run, const double *q)
{
    const perp_mechanism *m = run->m;
    double most = 0.0;

    perp__raise_to(&run->largest, perp__largest(q, m->coordinates));
    for (int32_t row = 0; row < m->contact_rows + m->bilateral; row++) {
        double sum = 0.0;

        for (int32_t i = 0; i < m->n; i++)
            sum += fabs(m->end.J[(size_t)row * (size_t)m->n + (size_t)i]);
        most = fmax(most, sum);
    }
    return most * run->largest;
}

/* What there is at the start is no fault of the run. The first step takes these rows over. */
static perp_status begin_overlap(perp__run *run)
{
    perp_mechanism *m = run->m;
    perp_mechanism_step start = {0};
    perp_status status = PERP_OK;

    if (m->contacts + m->bilateral > 0) {
        status = perp__evaluate_rows(m, &m->end, run->t, m->now.q, m->now.v);
        if (status != PERP_OK) /* the first step says what that means */
            return status == PERP__OUTSIDE ? PERP_OK : status;
        perp__keep_rows(m, run->t, m->now.q, m->now.v);
    }
    perp__measure_overlap(m, &start, m->now.q);
    run->overlaps = fmax(start.penetration, start.drift);
    size_of_gaps(run, m->now.q);
    return status;
}

/* Whether a step ends with more penetration or drift than the run may have. */
static bool overlaps(perp__run *run, const perp_mechanism_step *step, const double *q)
{
    const perp_mechanism_settings *settings = &run->m->settings;
    const double found = fmax(step->penetration, step->drift);
    const double part = fmax(PERP__LITTLE, settings->error); /* gaps close within `error` */

    if (settings->overlap > 0.0)
        return found > settings->overlap;
    return settings->project && found > fmax(part * size_of_gaps(run, q), run->overlaps);
}

perp_status perp__run_take(perp__run *run, const perp__motion *next, double t, double h,
                           const perp_mechanism_step *step)
{
    perp_mechanism *m = run->m;

    perp__raise_to(&run->result.residual, step->residual);
    run->result.iterations += step->iterations;
    if (!perp__outcome_moves(step->outcome)) {
        run->result.outcome = step->outcome;
        run->ended = 1;
        return PERP_OK;
    }
    run->result.penetration = fmax(run->result.penetration, step->penetration);
    run->result.drift = fmax(run->result.drift, step->drift);
    run->result.fallbacks += step->scheme != m->settings.scheme;
    run->result.steps++;
    run->t = t;
    run->result.outcome = perp__worse_outcome(run->result.outcome, step->outcome);
    if (overlaps(run, step, next->q))
        run->result.outcome = perp__worse_outcome(run->result.outcome, PERP_OUTCOME_STALLED);
    memcpy(m->now.q, next->q, (size_t)m->coordinates * sizeof *next->q);
    perp__copy_motion(m, &m->now, next);
    if (t < run->end && perp__mechanism_is_late(m)) {
        run->result.outcome = PERP_OUTCOME_TIME_LIMIT;
        run->ended = 1;
    }
    return show(run, h, step);
}

/* Steps of equal length. */
static perp_status run_equal(perp__run *run, double t0, double t1, double h)
{
    perp_mechanism *m = run->m;
    const double exact = (t1 - t0) / h, near = nearbyint(exact);
    /* up to the rounding of t0, t1 and h */
    const bool whole =
        fabs(exact - near) <= PERP__SUM_ROUNDING * (fabs(t0) + fabs(t1)) / h && near >= 1.0;
    const double count = whole ? near : ceil(exact), length = whole ? h : (t1 - t0) / count;
    perp_mechanism_step step;
    perp_status status = PERP_OK;
    double k;

    for (k = 1.0; k <= count && status == PERP_OK && !run->ended; k += 1.0) {
        const double t = k == count ? t1 : t0 + k * length;
        const perp_mechanism_start from = {.t = run->t, .h = length, .q = m->now.q, .v = m->now.v};

        status = perp__advance_from(m, &m->next, &step, &from);
        if (m->kept_t != t &&
            fabs(m->kept_t - t) <= PERP__ROUNDING_LIMIT * fmax(fabs(run->t), fabs(t)))
            m->kept_t = t; /* the same instant, summed in another way */
        PERP__THEN(status, perp__run_take(run, &m->next, t, length, &step));
    }
    return status;
}

perp_status perp_mechanism_run(perp_mechanism *mechanism, double *q, double *v,
                               perp_mechanism_run_result *result, const perp_mechanism_start *start,
                               double t1, perp_mechanism_observer observer, void *user)
{
    perp_mechanism *m = mechanism;
    const double began = perp__now();
    perp_mechanism_start from = {0};
    perp__run run = {.m = m, .observer = observer, .user = user, .end = t1};
    perp_mechanism_step step;
    perp_status status = perp__mechanism_enter(m);
    int64_t before;

    if (status != PERP_OK)
        return status;
    /* 1. checks */
    before = m->evaluations;
    status = perp__check_pointer(m->context, "q", q);
    PERP__THEN(status, perp__check_pointer(m->context, "v", v));
    PERP__THEN(status, PERP__CHECK(perp_mechanism_run_result, m->context, result));
    PERP__THEN(status, PERP__READ(perp_mechanism_start, m->context, &from, start));
    PERP__THEN(status, perp__mechanism_check_start(m, &from));
    if (status == PERP_OK && !(t1 > from.t && isfinite(t1)))
        status = perp__refuse(m->context, "t1 is %g, expected more than t0 = %g", t1, from.t);
    if (status == PERP_OK && (t1 - from.t) / from.h > 1e15)
        status = perp__refuse(m->context, "h is %g: too many steps to %g", from.h, t1);
    /* 2. the start */
    perp_struct_init(&step, sizeof step);
    step.error = run.result.error = (double)NAN;
    m->keeps = 0;
    run.t = from.t;
    if (status == PERP_OK) {
        perp__stay(m, &m->now, from.q, from.v);
        status = show(&run, 0.0, &step);
    }
    if (status == PERP_OK && !run.ended)
        status = begin_overlap(&run);
    /* 3. the steps */
    if (status == PERP_OK && !run.ended)
        status = m->settings.error > 0.0 ? perp__run_adaptive(&run, t1, from.h)
                                         : run_equal(&run, from.t, t1, from.h);
    if (status == PERP_OK) {
        memcpy(q, m->now.q, (size_t)m->coordinates * sizeof *q);
        memcpy(v, m->now.v, (size_t)m->n * sizeof *v);
        run.result.t = run.t;
        run.result.evaluations = m->evaluations - before;
        run.result.seconds = perp__now() - began;
        perp__struct_write(result, &run.result, sizeof run.result);
    }
    return perp__leave(m->context, status);
}
