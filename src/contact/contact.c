/* The front door: tries the start, runs the methods of the plan, recomputes every residual, keeps
 * the best point, says what it is worth. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "contact/settings.h"
#include "contact/solver.h"

/* A backward error that leaves no better double. */
#define ROUNDING (16.0 * DBL_EPSILON)

/* Where a step of the plan starts from. */
enum origin { FROM_BEST, FROM_LAST };

typedef struct plan_step {
    int32_t method;
    enum origin origin;
} plan_step;

enum { PLAN_MOST = 5 };

static int32_t is_good(perp_outcome outcome)
{
    return outcome == PERP_OUTCOME_SOLVED || outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

static perp_outcome outcome_of(const perp_contact_solver *solver, const perp__contact_worth *worth,
                               perp_outcome said)
{
    const double tol = solver->settings.tol;

    if (worth->tested <= tol)
        return PERP_OUTCOME_SOLVED;
    if (worth->backward <= ROUNDING && worth->tested <= sqrt(tol))
        return PERP_OUTCOME_ROUNDING_LIMIT;
    return is_good(said) ? PERP_OUTCOME_STALLED : said;
}

/* Evaluates solver->r and keeps it if it is the best so far. */
static perp_status consider(perp_contact_solver *solver, int32_t method, perp_outcome said,
                            const perp__contact_iterate *iterate)
{
    perp__contact_candidate *best = &solver->best;
    perp__contact_worth worth;
    const size_t size = (size_t)solver->size;
    perp_status status = perp__contact_evaluate(
        solver, iterate && iterate->has_modes ? iterate->modes : NULL, &worth);
    perp_outcome outcome;

    if (status != PERP_OK)
        return status;
    if (isnan(worth.tested))
        worth.tested = INFINITY;
    outcome = outcome_of(solver, &worth, said);
    if (best->method >= 0 && is_good(best->outcome) >= is_good(outcome) &&
        best->worth.tested <= worth.tested) {
        if (!is_good(best->outcome))
            best->outcome = outcome; /* what the last method said */
        return PERP_OK;
    }
    best->worth = worth;
    best->outcome = outcome;
    best->method = method;
    best->iterations = iterate ? iterate->iterations : 0;
    if (size > 0) {
        memcpy(best->r, solver->r, size * sizeof(double));
        memcpy(best->u, solver->u, size * sizeof(double));
    }
    if (solver->contacts > 0)
        memcpy(best->modes, solver->modes, (size_t)solver->contacts);
    return PERP_OK;
}

/* The methods' view of the monitor and the clock. */
static int32_t tick(void *user, int64_t iterations, double residual)
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

static perp__contact_slot *slot_of(perp_contact_solver *solver, int32_t method)
{
    int32_t k;

    for (k = 0; k < PERP__CONTACT_METHODS; k++)
        if (solver->slots[k].method->id == method)
            return &solver->slots[k];
    return NULL;
}

/* Lays out the method's workspace for this set-up, once. */
static perp_status fit(perp_contact_solver *solver, perp__contact_slot *slot)
{
    perp_status status;

    if (!slot->work) {
        slot->work = perp__allocate(solver->context, 1, slot->method->work_size);
        if (!slot->work)
            return perp__fail_memory(solver->context, "a method's workspace");
        memset(slot->work, 0, slot->method->work_size);
        slot->fitted = 0;
    }
    ((perp__contact_work *)slot->work)->problem = &solver->problem;
    if (slot->fitted == solver->setups)
        return PERP_OK;
    slot->fitted = 0;
    status = perp__arena_fit(&slot->arena, slot->method->layout, slot->work);
    if (status == PERP_OK)
        slot->fitted = solver->setups;
    return status;
}

static int32_t is_finite(const double *x, int32_t count)
{
    int32_t i;

    for (i = 0; i < count; i++)
        if (!isfinite(x[i]))
            return 0;
    return 1;
}

/* One run of a method, from start to candidate. */
static perp_status run_once(perp_contact_solver *solver, perp__contact_slot *slot,
                            enum origin origin, int32_t attempt)
{
    const size_t bytes = (size_t)solver->size * sizeof(double);
    perp__contact_iterate iterate;
    perp_status status;

    if (origin == FROM_BEST && bytes > 0)
        memcpy(solver->r, solver->best.r, bytes);
    memset(&iterate, 0, sizeof iterate);
    iterate.r = solver->r;
    iterate.u = solver->u;
    iterate.modes = solver->modes;
    iterate.ray = solver->start;
    iterate.warm = solver->call->r0 != NULL || solver->best.method != PERP_CONTACT_METHOD_POLISH;
    iterate.attempt = attempt;
    iterate.residual = INFINITY;
    status = slot->method->solve(slot->work, &iterate);
    if (status == PERP_OK && solver->aborted)
        status = perp__fail(solver->context, PERP_ERROR_CALLBACK, "the monitor asked to abort");
    if (status != PERP_OK)
        return status;
    if (iterate.outcome == PERP_OUTCOME_RAY)
        perp__contact_keep_ray(solver, iterate.ray);
    if (!is_finite(solver->r, solver->size)) { /* a method that overflowed has no point to offer */
        if (bytes > 0)
            memcpy(solver->r, solver->best.r, bytes);
        iterate.has_modes = 0;
        iterate.outcome = PERP_OUTCOME_STALLED;
    }
    if (solver->deadline > 0.0 && solver->ended < 0 && perp__now() > solver->deadline)
        solver->ended = PERP_OUTCOME_TIME_LIMIT;
    return consider(solver, slot->method->id, iterate.outcome, &iterate);
}

static int32_t ends_the_search(const perp_contact_solver *solver)
{
    return is_good(solver->best.outcome) || solver->ended >= 0 ||
           solver->certificate != PERP_CONTACT_CERTIFICATE_NONE;
}

static perp_status run(perp_contact_solver *solver, const plan_step *step)
{
    perp__contact_slot *slot = slot_of(solver, step->method);
    perp_status status = slot->method->check(&solver->problem);
    int32_t attempt;

    solver->running = step->method;
    if (status == PERP_OK)
        status = fit(solver, slot);
    for (attempt = 0; attempt < slot->method->attempts && status == PERP_OK; attempt++) {
        status = run_once(solver, slot, step->origin, attempt);
        if (ends_the_search(solver))
            break;
    }
    return status;
}

static int32_t plan(perp_contact_solver *solver, plan_step *steps)
{
    static const plan_step automatic[] = {{PERP_CONTACT_METHOD_SWEEP, FROM_BEST},
                                          {PERP_CONTACT_METHOD_NEWTON, FROM_BEST},
                                          {PERP_CONTACT_METHOD_LEMKE, FROM_BEST},
                                          {PERP_CONTACT_METHOD_NEWTON, FROM_LAST},
                                          {PERP_CONTACT_METHOD_SWEEP, FROM_LAST}};
    const int32_t chosen = solver->settings.method;
    int32_t count = 0, k;

    if (solver->settings.cone > 0 ||
        (chosen != PERP_CONTACT_METHOD_AUTO && chosen != PERP_CONTACT_METHOD_LEMKE)) {
        steps[0].method = solver->settings.cone > 0 ? PERP_CONTACT_METHOD_LEMKE : chosen;
        steps[0].origin = FROM_BEST;
        return 1;
    }
    for (k = chosen == PERP_CONTACT_METHOD_LEMKE ? 2 : 0; k < PLAN_MOST; k++) {
        perp__contact_slot *slot = slot_of(solver, automatic[k].method);

        if (!slot || (chosen == PERP_CONTACT_METHOD_AUTO &&
                      slot->method->check(&solver->problem) != PERP_OK))
            continue;
        steps[count++] = automatic[k];
    }
    return count;
}

/* The caller's start, or no impulses at all. */
static perp_status try_start(perp_contact_solver *solver)
{
    int32_t i;

    for (i = 0; i < solver->size; i++)
        solver->r[i] = solver->call->r0 ? solver->call->r0[i] : 0.0;
    return consider(solver, PERP_CONTACT_METHOD_POLISH, PERP_OUTCOME_ITERATION_LIMIT, NULL);
}

static perp_status search(perp_contact_solver *solver)
{
    plan_step steps[PLAN_MOST];
    int32_t count = plan(solver, steps), k;
    perp_status status;

    solver->best.method = -1;
    solver->has_ray = 0;
    solver->certificate = PERP_CONTACT_CERTIFICATE_NONE;
    solver->ended = -1;
    solver->aborted = 0;
    status = perp__contact_load(solver);
    if (status == PERP_OK)
        status = try_start(solver);
    if (status != PERP_OK || ends_the_search(solver))
        return status;
    for (k = 0; k < count && status == PERP_OK; k++) {
        status = run(solver, &steps[k]);
        if (ends_the_search(solver))
            break;
    }
    if (status == PERP_OK && !ends_the_search(solver))
        status = perp__contact_find_ray(solver);
    if (status != PERP_OK || is_good(solver->best.outcome))
        return status;
    if (solver->certificate != PERP_CONTACT_CERTIFICATE_NONE ||
        (solver->has_ray && solver->settings.cone > 0))
        solver->best.outcome = PERP_OUTCOME_RAY;
    else if (solver->ended >= 0)
        solver->best.outcome = solver->ended;
    else if (solver->best.outcome == PERP_OUTCOME_RAY) /* its ray was none */
        solver->best.outcome = PERP_OUTCOME_STALLED;
    return PERP_OK;
}

static perp_status check_vector(perp_context *context, const char *name, const double *x,
                                int32_t count)
{
    perp_status status = PERP_OK;

    if (count > 0)
        status = perp__check_pointer(context, name, x);
    return status == PERP_OK ? perp__check_finite(context, name, x, (size_t)count) : status;
}

static perp_status check_call(const perp_contact_solver *solver, const perp__contact_call *call)
{
    perp_context *context = solver->context;
    const int32_t by_W = solver->entrance == PERP__ENTRANCE_DELASSUS;
    perp_status status;

    if (solver->entrance == PERP__NO_PROBLEM)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "the solver has no problem: call perp_contact_solver_setup_dynamics or "
                          "_setup_delassus first");
    status = perp__struct_check(context, "result", call->result, sizeof *call->result,
                                PERP__CONTACT_RESULT_FIRST);
    if (status == PERP_OK && solver->size > 0)
        status = perp__check_pointer(context, "r", call->r);
    if (status == PERP_OK && by_W)
        status = check_vector(context, "q", call->q, solver->size);
    if (status == PERP_OK && !by_W)
        status = check_vector(context, "f", call->f, solver->dynamics.n);
    if (status == PERP_OK && !by_W)
        status = check_vector(context, "w", call->w, solver->rows);
    if (status == PERP_OK && !by_W && call->b)
        status = check_vector(context, "b", call->b, solver->size - solver->rows);
    if (status == PERP_OK && call->r0)
        status = check_vector(context, "r0", call->r0, solver->size);
    if (status == PERP_OK && slot_of((perp_contact_solver *)solver, PERP_CONTACT_METHOD_LEMKE) &&
        solver->settings.method != PERP_CONTACT_METHOD_AUTO &&
        !slot_of((perp_contact_solver *)solver, solver->settings.method))
        status = perp__fail(context, PERP_ERROR_ARGUMENT, "settings.method %s is not available",
                            perp_contact_method_text(solver->settings.method));
    return status;
}

static void write_result(const perp_contact_solver *solver, double seconds)
{
    const perp__contact_worth *worth = &solver->best.worth;
    perp_contact_result own;

    memset(&own, 0, sizeof own);
    own.outcome = solver->best.outcome;
    own.method = solver->best.method;
    own.iterations = solver->best.iterations;
    own.residual = worth->tested;
    own.natural_residual = worth->natural;
    own.backward_error = worth->backward;
    own.signorini_velocity = worth->signorini_velocity;
    own.signorini_impulse = worth->signorini_impulse;
    own.cone = worth->cone;
    own.dissipation_velocity = worth->dissipation_velocity;
    own.dissipation_impulse = worth->dissipation_impulse;
    own.bilateral = worth->bilateral;
    own.seconds = seconds;
    if (own.outcome == PERP_OUTCOME_RAY) {
        own.has_ray = 1;
        own.certificate = solver->certificate;
    }
    perp__struct_write(solver->call->result, &own, sizeof own);
}

static perp_status write_out(perp_contact_solver *solver, double started)
{
    const perp__contact_call *call = solver->call;
    const size_t bytes = (size_t)solver->size * sizeof(double);
    perp_status status = PERP_OK;
    int32_t k;

    if (is_good(solver->best.outcome))
        perp__contact_write_zeros(solver, solver->best.modes, solver->best.u);
    if (call->v && solver->dynamics.n > 0) {
        status = perp__dynamics_velocities(&solver->dynamics, call->f, solver->best.r, solver->v,
                                           solver->v_low);
        if (status != PERP_OK)
            return status;
        memcpy(call->v, solver->v, (size_t)solver->dynamics.n * sizeof(double));
    }
    if (bytes > 0) {
        memcpy(call->r, solver->best.r, bytes);
        if (call->u)
            memcpy(call->u, solver->best.u, bytes);
        if (call->ray && solver->best.outcome == PERP_OUTCOME_RAY)
            memcpy(call->ray, solver->ray, bytes);
    }
    for (k = 0; call->modes && k < solver->contacts; k++)
        call->modes[k] = solver->best.modes[k];
    write_result(solver, perp__now() - started);
    return PERP_OK;
}

perp_status perp__contact_solve(perp_contact_solver *solver, const perp__contact_call *call)
{
    const double started = perp__now();
    perp_status status = check_call(solver, call);

    if (status != PERP_OK)
        return status;
    solver->call = call;
    solver->deadline =
        solver->settings.time_limit > 0.0 ? started + solver->settings.time_limit : 0.0;
    solver->control.deadline = solver->deadline;
    solver->control.tick = tick;
    solver->control.tick_user = solver;
    solver->problem.tol = solver->settings.tol;
    solver->problem.iteration_limit = solver->settings.max_iterations;
    solver->problem.cone = solver->settings.cone;
    status = search(solver);
    if (status == PERP_OK)
        status = write_out(solver, started);
    solver->call = NULL;
    return status;
}
