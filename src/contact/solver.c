/* What the caller chooses, what a solve is called with, asks on the way, and hands back; the life
 * of a solver: create, set, setup, destroy, and the public entrances. */
#include "contact/solver.h"

#include <math.h>

#include "base/check.h"
#include "contact/statics/statics.h"
#include "linalg/spatial.h"

PERP__INIT_WITH(perp_contact_laws, .dim = 3)

PERP__INIT_WITH(perp_contact_settings, .tol = 1e-8)

PERP__WORDS(perp_contact_mode_text, "unknown mode", "separate", "stick", "slip", "lower", "upper")

PERP__WORDS(perp_contact_method_text, "unknown method", "auto", "sweep", "newton", "lemke",
            "polish", "admm", "proximal")

int32_t perp__contact_method_named(int32_t method)
{
    return method == PERP_CONTACT_METHOD_NEWTON ? PERP_CONTACT_METHOD_PROXIMAL : method;
}

static perp_status check_method(perp_context *context, const perp_contact_settings *copy)
{
    if (copy->method == PERP_CONTACT_METHOD_POLISH)
        return perp__refuse(context, "settings.method is %d, which is only ever reported",
                            (int)copy->method);
    if (copy->cone < 0 || copy->cone == 1 || copy->cone == 2 || copy->cone > PERP__MOST_EDGES)
        return perp__refuse(context, "settings.cone is %d, expected 0 (exact) or 3 .. %d edges",
                            (int)copy->cone, (int)PERP__MOST_EDGES);
    if (copy->cone > 0 && copy->method != PERP_CONTACT_METHOD_AUTO &&
        copy->method != PERP_CONTACT_METHOD_LEMKE)
        return perp__refuse(
            context,
            "settings.cone is %d, a polyhedron, which the method %s can't take: use "
            "lemke or auto",
            (int)copy->cone, perp_contact_method_text(copy->method));
    return PERP_OK;
}

static const perp__field fields[] = {
    PERP__INTEGER(perp_contact_settings, method, 0, PERP_CONTACT_METHOD_PROXIMAL),
    PERP__INTEGER(perp_contact_settings, max_iterations, 0, INFINITY),
    PERP__INTEGER(perp_contact_settings, raw_velocity, 0, 2),
    PERP__REAL(perp_contact_settings, tol, "()", 0, INFINITY),
    PERP__REAL(perp_contact_settings, time_limit, "[]", 0, INFINITY),
};

PERP__SETTINGS_READER(perp__contact_settings_read, perp_contact_settings, fields,
                      check_method(context, &read))

perp_status perp__contact_check_call(const perp_contact_solver *solver,
                                     const perp__contact_call *call)
{
    perp_context *context = solver->context;
    const bool by_W = solver->entrance == PERP__ENTRANCE_DELASSUS;
    const bool translated = solver->bounded.count > 0;
    const int32_t size = translated ? solver->bounded.size : solver->size;
    const int32_t rows = translated ? solver->bounded.rows : solver->rows;
    perp_status status;

    if (solver->entrance == PERP__NO_PROBLEM)
        return perp__refuse(context,
                            "the solver has no problem: call perp_contact_solver_setup_dynamics or "
                            "_setup_delassus first");
    status = perp__struct_check(context, "result", call->result, sizeof *call->result,
                                PERP__FIRST(perp_contact_result));
    if (size > 0)
        PERP__THEN(status, perp__check_pointer(context, "r", call->to.r));
    if (by_W)
        PERP__THEN(status, perp__check_vector(context, "q", call->q, (size_t)size));
    if (!by_W) {
        PERP__THEN(status, perp__check_vector(context, "f", call->f, (size_t)solver->dynamics.n));
        PERP__THEN(status, perp__check_vector(context, "w", call->w, (size_t)rows));
    }
    if (!by_W && call->b)
        PERP__THEN(status, perp__check_vector(context, "b", call->b, (size_t)(size - rows)));
    if (call->r0)
        PERP__THEN(status, perp__check_vector(context, "r0", call->r0, (size_t)size));
    return status;
}

int32_t perp__contact_tick(void *user, int64_t iterations, double residual)
{
    perp_contact_solver *solver = user;

    if (solver->ended >= 0)
        return 1;
    if (solver->settings.monitor) {
        const perp_contact_progress progress = {.struct_size = sizeof progress,
                                                .method = solver->running,
                                                .iterations = iterations,
                                                .residual = residual};
        const int32_t answer = solver->settings.monitor(&progress, solver->settings.monitor_user);

        if (answer < 0)
            solver->aborted = 1;
        if (answer != 0) {
            solver->ended = PERP_OUTCOME_STOPPED;
            return 1;
        }
    }
    if (perp__is_past(solver->deadline))
        solver->ended = PERP_OUTCOME_TIME_LIMIT;
    return solver->ended == PERP_OUTCOME_TIME_LIMIT;
}

void perp__contact_write_out(perp_contact_solver *solver, const perp__contact_call *call,
                             double started)
{
    const perp__contact_candidate *best = &solver->best;
    const perp__contact_bounded *bounded = &solver->bounded;
    const int32_t has_ray = best->outcome == PERP_OUTCOME_RAY;
    perp_contact_result copy = {0};

    perp__copy(call->to.v, solver->best_v, solver->n);
    if (bounded->count > 0) { /* in the caller's rows */
        perp__contact_bounded_impulses(bounded, best->r, call->to.r);
        if (call->to.u)
            perp__contact_bounded_velocities(bounded, best->u, call->to.u);
        if (call->to.ray && has_ray)
            perp__contact_bounded_velocities(bounded, solver->ray, call->to.ray);
        if (call->to.modes)
            perp__contact_bounded_modes(bounded, best->modes, best->r, best->u, call->to.modes);
    } else {
        perp__copy(call->to.r, best->r, solver->size);
        perp__copy(call->to.u, best->u, solver->size);
        if (has_ray)
            perp__copy(call->to.ray, solver->ray, solver->size);
        for (int32_t k = 0; call->to.modes && k < solver->contacts; k++)
            call->to.modes[k] = best->modes[k];
    }
    copy.outcome = best->outcome;
    copy.method = best->method;
    copy.iterations = solver->iterations;
    copy.residual = perp__told(best->residuals.tested);
    copy.natural_residual = perp__told(best->residuals.natural);
    copy.backward_error = perp__told(best->residuals.backward);
    copy.signorini_velocity = perp__told(best->residuals.signorini_velocity);
    copy.signorini_impulse = perp__told(best->residuals.signorini_impulse);
    copy.cone = perp__told(best->residuals.cone);
    copy.dissipation_velocity = perp__told(best->residuals.dissipation_velocity);
    copy.dissipation_impulse = perp__told(best->residuals.dissipation_impulse);
    copy.bilateral = perp__told(best->residuals.bilateral);
    copy.seconds = perp__now() - started;
    copy.has_ray = has_ray;
    copy.certificate = has_ray ? solver->certificate : 0;
    perp__struct_write(call->result, &copy, sizeof copy);
}

/* ---- life ---- */

static const perp__contact_method *const methods[PERP__CONTACT_METHODS] = {
    &perp__contact_sweep, &perp__contact_lemke, &perp__contact_admm, &perp__contact_proximal};

static void release(void *object)
{
    perp_contact_solver *solver = object;

    for (int32_t k = 0; k < PERP__CONTACT_METHODS; k++)
        perp__workspace_release(&solver->slots[k].space, solver->slots[k].method->release);
    perp__handle_end(solver->feasibility.lcp);
    perp__arena_release(&solver->feasibility.arena);
    perp__arena_release(&solver->polish.arena);
    perp__handle_end(solver->opening.solver);
    perp__arena_release(&solver->opening.arena);
    perp__arena_release(&solver->arranged[0].arena);
    perp__arena_release(&solver->arranged[1].arena);
    perp__arena_release(&solver->hold.arena);
    perp__statics_front_release(solver->context, solver->front);
    perp__bodies_release(&solver->bodies);
    perp__dynamics_release(&solver->dynamics);
    perp__arena_release(&solver->delassus.arena);
    perp__arena_release(&solver->bounded.arena);
    perp__arena_release(&solver->arena);
}

static const perp__kind kind = {"a contact solver", sizeof(perp_contact_solver), release};

perp_status perp__contact_create(perp_context *context, perp_contact_solver **solver,
                                 const perp_contact_settings *settings)
{
    perp_status status = perp__check_pointer(context, "solver", solver);
    perp_contact_solver *made = status == PERP_OK ? perp__handle_create(context, &kind) : NULL;

    if (!made)
        return status == PERP_OK ? PERP_ERROR_MEMORY : status;
    made->proves = 1;
    made->bodies.context = context;
    for (int32_t k = 0; k < PERP__CONTACT_METHODS; k++)
        made->slots[k].method = methods[k];
    status = perp__contact_configure(made, settings);
    PERP__HAND_OUT(status, made, solver);
    return status;
}

perp_status perp__contact_configure(perp_contact_solver *solver,
                                    const perp_contact_settings *settings)
{
    perp_status status = perp__contact_settings_read(solver->context, &solver->settings, settings);

    solver->settings.method = perp__contact_method_named(solver->settings.method);
    return status;
}

perp_status perp__contact_enter(perp_contact_solver *solver)
{
    return perp__handle_enter(solver, &kind);
}

perp_status perp_contact_solver_create(perp_context *context, perp_contact_solver **solver,
                                       const perp_contact_settings *settings)
{
    return PERP__CALL(perp__enter(context), context,
                      perp__contact_create(context, solver, settings));
}

void perp_contact_solver_destroy(perp_contact_solver *solver)
{
    perp__handle_destroy(solver, &kind);
}

perp_status perp_contact_solver_set(perp_contact_solver *solver,
                                    const perp_contact_settings *settings)
{
    return PERP__CONTACT_CALL(solver, perp__contact_configure(solver, settings));
}

perp_status perp_contact_solver_setup_dynamics(perp_contact_solver *solver,
                                               const perp_contact_laws *laws,
                                               const perp_contact_dynamics *dynamics)
{
    return PERP__CONTACT_CALL(solver, perp__contact_setup(solver, laws, dynamics, NULL));
}

perp_status perp_contact_solver_setup_delassus(perp_contact_solver *solver,
                                               const perp_contact_laws *laws, const perp_matrix *W)
{
    return PERP__CONTACT_CALL(solver, W ? perp__contact_setup(solver, laws, NULL, W)
                                        : perp__check_pointer(solver->context, "W", W));
}

/* A solve of what was set up in this way, not in the other. */
static perp_status solve(perp_contact_solver *solver, int32_t other,
                         const perp_contact_answer *answer, perp__contact_call call)
{
    const perp_status status = PERP__READ(perp_contact_answer, solver->context, &call.to, answer);

    if (status != PERP_OK || solver->entrance != other)
        return status != PERP_OK ? status : perp__contact_solve(solver, &call);
    return perp__refuse(solver->context,
                        "the solver was set up with %s: call perp_contact_solver_solve_%s",
                        other == PERP__ENTRANCE_DELASSUS ? "W" : "dynamics",
                        other == PERP__ENTRANCE_DELASSUS ? "delassus" : "dynamics");
}

perp_status perp_contact_solver_solve_dynamics(perp_contact_solver *solver,
                                               const perp_contact_answer *answer,
                                               perp_contact_result *result, const double *f,
                                               const double *w, const double *b, const double *r0)
{
    const perp__contact_call call = {.result = result, .f = f, .w = w, .b = b, .r0 = r0};

    return PERP__CONTACT_CALL(solver, solve(solver, PERP__ENTRANCE_DELASSUS, answer, call));
}

perp_status perp_contact_solver_solve_delassus(perp_contact_solver *solver,
                                               const perp_contact_answer *answer,
                                               perp_contact_result *result, const double *q,
                                               const double *r0)
{
    const perp__contact_call call = {.result = result, .q = q, .r0 = r0};

    return PERP__CONTACT_CALL(solver, solve(solver, PERP__ENTRANCE_DYNAMICS, answer, call));
}

static perp_status solve_once(perp_context *context, const perp_contact_answer *answer,
                              const perp_contact_settings *settings,
                              const perp_contact_problem *problem, perp__contact_call *call)
{
    perp_contact_solver *solver = NULL;
    perp_contact_problem p = {0};
    perp_status status = PERP__READ(perp_contact_problem, context, &p, problem);

    call->f = p.f;
    call->w = p.w;
    call->b = p.b;
    call->q = p.q;
    if (status == PERP_OK && p.dynamics && p.W)
        status = perp__refuse(context, "problem has dynamics and W, expected one of them");
    PERP__THEN(status, PERP__READ(perp_contact_answer, context, &call->to, answer));
    PERP__THEN(status, perp__contact_create(context, &solver, settings));
    PERP__THEN(status, perp__contact_setup(solver, p.laws, p.dynamics, p.W));
    PERP__THEN(status, perp__contact_solve(solver, call));
    perp__handle_end(solver);
    return status;
}

perp_status perp_contact_solve(perp_context *context, const perp_contact_answer *answer,
                               perp_contact_result *result, const perp_contact_settings *settings,
                               const perp_contact_problem *problem, const double *r0)
{
    perp__contact_call call = {.result = result, .r0 = r0};

    return PERP__CALL(perp__enter(context), context,
                      solve_once(context, answer, settings, problem, &call));
}
