/* The life of a solver: create, set, setup, destroy, and the public entrances. */
#include "contact/solver.h"

#include "base/check.h"
#include "contact/statics/statics.h"

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

perp_status perp__contact_set_up_inner(const perp_contact_solver *outer,
                                       perp_contact_solver **inner, const perp_contact_laws *laws,
                                       int32_t size, const double *W)
{
    const perp_matrix view = perp__view(PERP_STORAGE_COLUMN_MAJOR, size, size, W);
    perp_status status = *inner ? PERP_OK : perp__contact_create(outer->context, inner, NULL);

    if (status != PERP_OK)
        return status;
    (*inner)->settings = outer->settings;
    return perp__contact_setup(*inner, laws, NULL, &view);
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

static perp_status setup_delassus(perp_contact_solver *solver, const perp_contact_laws *laws,
                                  const perp_matrix *W)
{
    perp_status status = perp__check_pointer(solver->context, "W", W);

    return status == PERP_OK ? perp__contact_setup(solver, laws, NULL, W) : status;
}

perp_status perp_contact_solver_setup_delassus(perp_contact_solver *solver,
                                               const perp_contact_laws *laws, const perp_matrix *W)
{
    return PERP__CONTACT_CALL(solver, setup_delassus(solver, laws, W));
}

/* A solve of what was set up in this way, not in the other. */
static perp_status solve(perp_contact_solver *solver, int32_t other, const perp__contact_call *call)
{
    if (solver->entrance != other)
        return perp__contact_solve(solver, call);
    return perp__refuse(solver->context,
                        "the solver was set up with %s: call perp_contact_solver_solve_%s",
                        other == PERP__ENTRANCE_DELASSUS ? "W" : "dynamics",
                        other == PERP__ENTRANCE_DELASSUS ? "delassus" : "dynamics");
}

perp_status perp_contact_solver_solve_dynamics(perp_contact_solver *solver, double *v, double *r,
                                               double *u, int32_t *modes, double *ray,
                                               perp_contact_result *result, const double *f,
                                               const double *w, const double *b, const double *r0)
{
    const perp__contact_call call = {v, r, u, modes, ray, result, f, w, b, NULL, r0};

    return PERP__CONTACT_CALL(solver, solve(solver, PERP__ENTRANCE_DELASSUS, &call));
}

perp_status perp_contact_solver_solve_delassus(perp_contact_solver *solver, double *r, double *u,
                                               int32_t *modes, double *ray,
                                               perp_contact_result *result, const double *q,
                                               const double *r0)
{
    const perp__contact_call call = {NULL, r, u, modes, ray, result, NULL, NULL, NULL, q, r0};

    return PERP__CONTACT_CALL(solver, solve(solver, PERP__ENTRANCE_DYNAMICS, &call));
}

/* With a solver of its own. */
static perp_status solve_once(perp_context *context, const perp_contact_settings *settings,
                              const perp_contact_laws *laws, const perp_contact_dynamics *dynamics,
                              const perp_matrix *W, int32_t by_W, const perp__contact_call *call)
{
    perp_contact_solver *solver = NULL;
    perp_status status = perp__contact_create(context, &solver, settings);

    PERP__THEN(status, by_W ? setup_delassus(solver, laws, W)
                            : perp__contact_setup(solver, laws, dynamics, NULL));
    PERP__THEN(status, perp__contact_solve(solver, call));
    perp__handle_end(solver);
    return status;
}

perp_status perp_contact_solve(perp_context *context, double *v, double *r, double *u,
                               int32_t *modes, double *ray, perp_contact_result *result,
                               const perp_contact_settings *settings, const perp_contact_laws *laws,
                               const perp_contact_dynamics *dynamics, const double *f,
                               const double *w, const double *b, const double *r0)
{
    const perp__contact_call call = {v, r, u, modes, ray, result, f, w, b, NULL, r0};

    return PERP__CALL(perp__enter(context), context,
                      solve_once(context, settings, laws, dynamics, NULL, 0, &call));
}

perp_status perp_contact_solve_delassus(perp_context *context, double *r, double *u, int32_t *modes,
                                        double *ray, perp_contact_result *result,
                                        const perp_contact_settings *settings,
                                        const perp_contact_laws *laws, const perp_matrix *W,
                                        const double *q, const double *r0)
{
    const perp__contact_call call = {NULL, r, u, modes, ray, result, NULL, NULL, NULL, q, r0};

    return PERP__CALL(perp__enter(context), context,
                      solve_once(context, settings, laws, NULL, W, 1, &call));
}
