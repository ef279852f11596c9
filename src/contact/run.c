/* Steps of a simulator one after the other (perp/contact.h): its own stages, called here, around
 * perp_contact_solver_step. Nothing here but their order. */
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/outcome.h"
#include "contact/solver.h"

static void call_stages(const perp_contact_run *run, const perp_contact_stage *stages,
                        int32_t count)
{
    for (int32_t k = 0; k < count; k++)
        stages[k](run->model, run->data);
}

/* Of a record a step: that of step `from` of the sources, as that of step `to`. */
static void copy_all(const perp_contact_copy *copies, int32_t count, int64_t from, int64_t to)
{
    for (int32_t k = 0; k < count; k++) {
        const perp_contact_copy *c = &copies[k];

        memcpy(c->to + (ptrdiff_t)to * c->stride, c->source + (ptrdiff_t)from * c->stride,
               (size_t)c->count * sizeof *c->to);
    }
}

/* Whether the caller wants to look at an answer: where another one might be at rest. */
static bool wants_look(perp_contact_run *run, const perp_contact_step *s, int32_t bounded,
                       int32_t was_warm)
{
    double fastest = 0.0; /* the largest |u| of a row of the contacts that slip; 0: held */

    if (s->first && was_warm && s->slips > 0) {
        run->patience -= run->patience > 0;
        for (int32_t k = 0; k < s->contacts && run->patience == 0; k++) {
            const int32_t end = k + 1 < s->contacts ? s->first[k + 1] : s->rows - bounded;

            for (int32_t i = s->first[k]; s->modes[k] == PERP_CONTACT_SLIP && i < end; i++)
                fastest = fmax(fastest, fabs(s->u[i]));
        }
        if (fastest > 0.0 && fastest <= run->look_slip * s->driven)
            return 1;
    }
    return s->fastest > 0.0 && run->drive &&
           s->fastest < run->look_rest * s->h * perp__largest(run->drive, s->n);
}

/* `after`, with the accelerations of forces. */
static void look_back(const perp_contact_run *run, const perp_contact_step *s)
{
    const int32_t count = run->invert && !perp__is_zero(s->acceleration, s->n) ? s->n : 0;

    for (int32_t i = 0; i < count; i++)
        run->room[i] = s->force[i] + s->force_of_rows[i];
    if (count > 0)
        run->invert(run->model, run->data, s->acceleration, run->room, 1);
    call_stages(run, run->after, run->after_count);
    for (int32_t i = 0; i < count; i++)
        s->acceleration[i] = (s->v[i] - s->velocity[i]) / s->h;
}

/* By Runge and Kutta's classical scheme, `before` its first stage: s->v, and behind the places in
 * room the velocity that moves them. */
static void move_freely(const perp_contact_run *run, const perp_contact_step *s)
{
    static const double ahead[] = {0.5, 0.5, 1.0, 0.0}, weights[] = {1.0, 2.0, 2.0, 1.0};
    double *mean = run->room + run->places, *drive = mean + s->n;
    const double time = *run->time;

    memset(mean, 0, 2 * (size_t)s->n * sizeof *mean);
    memcpy(s->v, run->velocity, (size_t)s->n * sizeof *s->v);
    for (int32_t k = 0; k < 4; k++) {
        const double h = ahead[k] * s->h, share = weights[k] / 6.0;

        memcpy(run->place, run->room, (size_t)run->places * sizeof *run->place);
        if (h > 0.0)
            run->integrate(run->model, run->place, run->velocity, h);
        for (int32_t i = 0; i < s->n; i++) {
            mean[i] += share * run->velocity[i];
            drive[i] += share * run->drive[i];
            run->velocity[i] = s->v[i] + h * run->drive[i];
        }
        *run->time = time + h;
        if (h > 0.0)
            call_stages(run, run->again, run->again_count);
    }
    for (int32_t i = 0; i < s->n; i++)
        s->v[i] += s->h * drive[i];
}

static void move(perp_contact_run *run, const perp_contact_step *s)
{
    double *velocity = run->room + run->places;
    const bool shifts = s->shift && s->shifts, is_free = run->again_count > 0 && s->J_rows == 0;

    for (int32_t i = 0; is_free && i < s->n; i++) {
        s->v[i] = s->velocity[i] + s->h * run->drive[i];
        s->acceleration[i] = run->drive[i];
    }
    look_back(run, s);
    if (s->was_known && !shifts && run->advance_count == 0) {
        *run->time += s->h; /* place and velocity would become what they are */
        return;
    }
    memcpy(run->room, run->place, (size_t)run->places * sizeof *run->place);
    if (is_free)
        move_freely(run, s);
    call_stages(run, run->advance, run->advance_count);
    if (run->advance_count == 0)
        *run->time += s->h;
    memcpy(run->place, run->room, (size_t)run->places * sizeof *run->place);
    memcpy(run->velocity, s->v, (size_t)s->n * sizeof *s->v);
    for (int32_t i = 0; !is_free && i < s->n; i++)
        velocity[i] = shifts ? s->v[i] + s->shift[i] : s->v[i];
    run->integrate(run->model, run->place, velocity, s->h);
}

static perp_status check_arrays(perp_context *context, const perp_contact_run *run)
{
    const perp__array arrays[] = {{"run.before", run->before, run->before_count, -1},
                                  {"run.after", run->after, run->after_count, -1},
                                  {"run.advance", run->advance, run->advance_count, -1},
                                  {"run.again", run->again, run->again_count, -1},
                                  {"run.kept", run->kept, run->kept_count, -1},
                                  {"run.inputs", run->inputs, run->input_count, -1},
                                  {"run.outputs", run->outputs, run->output_count, -1},
                                  {"run.drive", run->drive, run->again_count, -1},
                                  {"run.place", run->place, 1, -1},
                                  {"run.velocity", run->velocity, 1, -1},
                                  {"run.time", run->time, 1, -1},
                                  {"run.room", run->room, 1, -1},
                                  {"run.metric_M", run->metric_M, run->metric_count, -1},
                                  {"run.metric_D", run->metric_D, run->metric_count, -1},
                                  {"run.metric_mass", run->metric_mass, run->metric_count, -1},
                                  {"run.metric_places", run->metric_places, run->metric_count, -1}};
    const perp_contact_stage *const stages[] = {run->before, run->after, run->advance, run->again};
    const perp_contact_copy *const copies[] = {run->kept, run->inputs, run->outputs};
    perp_status status = perp__check_arrays(context, arrays, sizeof arrays / sizeof *arrays);

    for (int32_t l = 0; l < 7; l++) /* these, in the order of arrays */
        for (int32_t k = 0; status == PERP_OK && k < arrays[l].count; k++)
            if (l < 4 ? !stages[l][k]
                      : copies[l - 4][k].count < 0 || !copies[l - 4][k].to ||
                            !copies[l - 4][k].source)
                status = perp__refuse(context, "%s[%d] is or has a NULL, or a number below 0",
                                      arrays[l].name, (int)k);
    return status;
}

static perp_status check(perp_contact_solver *solver, const perp_contact_run *run,
                         const perp_contact_step *step, const perp_contact_result *result)
{
    perp_status status = PERP__CHECK(perp_contact_run, solver->context, run);

    PERP__THEN(status, PERP__CHECK(perp_contact_step, solver->context, step));
    PERP__THEN(status, PERP__CHECK(perp_contact_result, solver->context, result));
    PERP__THEN(status, check_arrays(solver->context, run));
    if (status == PERP_OK && (!run->integrate || run->places < 0 || run->done < 0 ||
                              run->phase < 0 || run->phase > PERP_CONTACT_PHASE_MOVE))
        return perp__refuse(solver->context, "run.integrate is NULL, or run.places, run.done or "
                                             "run.phase is below 0 or no phase");
    return status;
}

perp_status perp_contact_solver_run(perp_contact_solver *solver, perp_contact_run *run,
                                    perp_contact_step *step, perp_contact_result *result,
                                    perp_contact_laws *laws, perp_contact_dynamics *dynamics)
{
    perp_status status = PERP__CONTACT_CALL(solver, check(solver, run, step, result));

    if (status != PERP_OK)
        return status;
    run->wait = PERP_CONTACT_WAIT_DONE;
    while (run->done < run->steps) {
        if (run->phase == PERP_CONTACT_PHASE_BEGIN) {
            copy_all(run->inputs, run->input_count, run->done, 0);
            call_stages(run, run->before, run->before_count);
            if (run->metric) { /* the mass with what its integrator takes implicitly */
                copy_all(run->kept, run->kept_count, 0, 0);
                run->metric(run->model, run->data);
            }
            for (int32_t k = 0; run->metric && k < run->kept_count; k++) /* the state as it was */
                memcpy(run->kept[k].source, run->kept[k].to,
                       (size_t)run->kept[k].count * sizeof *run->kept[k].to);
            for (int32_t k = 0; run->metric && k < run->metric_count; k++)
                run->metric_mass[k] =
                    run->metric_M[k] - step->h * run->metric_D[run->metric_places[k]];
            run->phase = PERP_CONTACT_PHASE_SOLVE;
        }
        if (run->phase == PERP_CONTACT_PHASE_SOLVE) {
            const int32_t was_warm = step->warm;

            status = perp_contact_solver_step(solver, step, result, laws, dynamics);
            if (status == PERP_OK && step->is_other && step->source) {
                status = perp_contact_solver_arrange(solver, step, laws, dynamics);
                if (status == PERP_OK)
                    continue;
            }
            if (status != PERP_OK)
                return status;
            run->wait = step->is_other ? PERP_CONTACT_WAIT_OTHER : PERP_CONTACT_WAIT_DONE;
            if (step->is_other)
                return PERP_OK;
            run->phase = PERP_CONTACT_PHASE_MOVE;
            step->warm = perp__is_good(result->outcome);
            if (!step->was_known) {
                run->unsolved += !step->warm;
                run->residual = fmax(run->residual, result->residual);
                if (step->warm && wants_look(run, step, laws->bounded, was_warm)) {
                    step->warm = was_warm;
                    run->wait = PERP_CONTACT_WAIT_LOOK;
                    return PERP_OK;
                }
            }
        }
        move(run, step);
        copy_all(run->outputs, run->output_count, 0, run->done);
        run->done++;
        run->phase = PERP_CONTACT_PHASE_BEGIN;
    }
    return PERP_OK;
}
