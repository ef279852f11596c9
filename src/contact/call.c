/* What a solve is called with, what it asks on the way, and what it hands back. */
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"
#include "contact/solver.h"

perp_status perp__contact_check_call(const perp_contact_solver *solver,
                                     const perp__contact_call *call)
{
    perp_context *context = solver->context;
    const int32_t by_W = solver->entrance == PERP__ENTRANCE_DELASSUS;
    const int32_t translated = solver->bounded.count > 0;
    const int32_t size = translated ? solver->bounded.size : solver->size;
    const int32_t rows = translated ? solver->bounded.rows : solver->rows;
    perp_status status;

    if (solver->entrance == PERP__NO_PROBLEM)
        return perp__refuse(context,
                            "the solver has no problem: call perp_contact_solver_setup_dynamics or "
                            "_setup_delassus first");
    status = perp__struct_check(context, "result", call->result, sizeof *call->result,
                                PERP__FIRST(perp_contact_result));
    if (status == PERP_OK && size > 0)
        status = perp__check_pointer(context, "r", call->r);
    if (status == PERP_OK && by_W)
        status = perp__check_vector(context, "q", call->q, (size_t)size);
    if (status == PERP_OK && !by_W)
        status = perp__check_vector(context, "f", call->f, (size_t)solver->dynamics.n);
    if (status == PERP_OK && !by_W)
        status = perp__check_vector(context, "w", call->w, (size_t)rows);
    if (status == PERP_OK && !by_W && call->b)
        status = perp__check_vector(context, "b", call->b, (size_t)(size - rows));
    if (status == PERP_OK && call->r0)
        status = perp__check_vector(context, "r0", call->r0, (size_t)size);
    return status;
}

int32_t perp__contact_tick(void *user, int64_t iterations, double residual)
{
    perp_contact_solver *solver = user;
    perp_contact_progress progress;
    int32_t answer;

    if (solver->ended >= 0)
        return 1;
    if (solver->settings.monitor) {
        memset(&progress, 0, sizeof progress);
        progress.struct_size = sizeof progress;
        progress.method = solver->running;
        progress.iterations = iterations;
        progress.residual = residual;
        answer = solver->settings.monitor(&progress, solver->settings.monitor_user);
        if (answer < 0)
            solver->aborted = 1;
        if (answer != 0) {
            solver->ended = PERP_OUTCOME_STOPPED;
            return 1;
        }
    }
    if (solver->deadline > 0.0 && perp__now() > solver->deadline) {
        solver->ended = PERP_OUTCOME_TIME_LIMIT;
        return 1;
    }
    return 0;
}

int32_t perp__contact_polish_step(perp_contact_solver *solver)
{
    const int64_t limit = solver->settings.max_iterations;

    if (limit > 0 && solver->polished >= limit)
        return 0;
    if (perp__contact_tick(solver, solver->polished, solver->best.worth.tested))
        return 0;
    solver->polished++;
    solver->iterations++;
    return 1;
}

static void write_result(const perp_contact_solver *solver, const perp__contact_call *call,
                         double started)
{
    const perp__contact_worth *worth = &solver->best.worth;
    perp_contact_result own = {0};

    own.outcome = solver->best.outcome;
    own.method = solver->best.method;
    own.iterations = solver->iterations;
    own.residual = perp__told(worth->tested);
    own.natural_residual = perp__told(worth->natural);
    own.backward_error = perp__told(worth->backward);
    own.signorini_velocity = perp__told(worth->signorini_velocity);
    own.signorini_impulse = perp__told(worth->signorini_impulse);
    own.cone = perp__told(worth->cone);
    own.dissipation_velocity = perp__told(worth->dissipation_velocity);
    own.dissipation_impulse = perp__told(worth->dissipation_impulse);
    own.bilateral = perp__told(worth->bilateral);
    own.seconds = perp__now() - started;
    if (own.outcome == PERP_OUTCOME_RAY) {
        own.has_ray = 1;
        own.certificate = solver->certificate;
    }
    perp__struct_write(call->result, &own, sizeof own);
}

/* In the caller's rows. */
static void write_translated(const perp_contact_solver *solver, const perp__contact_call *call)
{
    const perp__contact_bounded *bounded = &solver->bounded;

    perp__contact_bounded_impulses(bounded, solver->best.r, call->r);
    if (call->u)
        perp__contact_bounded_velocities(bounded, solver->best.u, call->u);
    if (call->ray && solver->best.outcome == PERP_OUTCOME_RAY)
        perp__contact_bounded_velocities(bounded, solver->ray, call->ray);
    if (call->modes)
        perp__contact_bounded_modes(bounded, solver->best.modes, solver->best.r, solver->best.u,
                                    call->modes);
}

static void write_rows(const perp_contact_solver *solver, const perp__contact_call *call)
{
    perp__copy(call->r, solver->best.r, solver->size);
    perp__copy(call->u, solver->best.u, solver->size);
    if (solver->best.outcome == PERP_OUTCOME_RAY)
        perp__copy(call->ray, solver->ray, solver->size);
    for (int32_t k = 0; call->modes && k < solver->contacts; k++)
        call->modes[k] = solver->best.modes[k];
}

void perp__contact_write_out(perp_contact_solver *solver, const perp__contact_call *call,
                             double started)
{
    perp__copy(call->v, solver->best_v, solver->n);
    if (solver->bounded.count > 0)
        write_translated(solver, call);
    else
        write_rows(solver, call);
    write_result(solver, call, started);
}
