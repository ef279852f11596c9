/* The life of a solver: create, set, setup, destroy, and the public entrances. */
#include "ncp/solver.h"

#include <string.h>

#include "base/check.h"
#include "ncp/settings.h"

static void release(void *object)
{
    perp_ncp_solver *solver = object;

    perp__ncp_walk_release(&solver->walk);
    perp__ncp_linear_release(&solver->linear);
    perp__arena_release(&solver->arena);
}

static const perp__kind kind = {"a solver", sizeof(perp_ncp_solver), release};

perp_status perp__ncp_create(perp_context *context, perp_ncp_solver **solver,
                             const perp_ncp_settings *settings)
{
    perp_ncp_settings own;
    perp_status status = perp__ncp_settings_read(context, &own, settings);
    perp_ncp_solver *made;

    if (status != PERP_OK)
        return status;
    made = perp__handle_create(context, &kind);
    if (!made)
        return PERP_ERROR_MEMORY;
    made->settings = own;
    perp__arena_init(&made->arena, context);
    perp__arena_init(&made->linear.arena, context);
    *solver = made;
    return PERP_OK;
}

perp_status perp__ncp_set(perp_ncp_solver *solver, const perp_ncp_settings *settings)
{
    return perp__ncp_settings_read(solver->context, &solver->settings, settings);
}

void perp__ncp_destroy(perp_ncp_solver *solver)
{
    perp__handle_end(solver);
}

static void layout(perp__arena *arena, void *object)
{
    perp_ncp_solver *s = object;
    const size_t n = (size_t)s->model.n;

    s->walk.model = &s->model;
    s->start = perp__arena_take(arena, n, sizeof(double));
    s->unit = perp__arena_take(arena, n, sizeof(double));
    s->perturbed = perp__arena_take(arena, n, sizeof(double));
    s->candidate = perp__arena_take(arena, n, sizeof(double));
    s->best_z = perp__arena_take(arena, n, sizeof(double));
    s->parts.of = perp__arena_take(arena, n, sizeof(int32_t));
    s->parts.z = perp__arena_take(arena, n, sizeof(double));
    s->parts.lower = perp__arena_take(arena, n, sizeof(double));
    s->parts.upper = perp__arena_take(arena, n, sizeof(double));
    s->parts.start = perp__arena_take(arena, n, sizeof(double));
    s->best_w = perp__arena_take(arena, n, sizeof(double));
    perp__ncp_model_layout(arena, &s->model);
    perp__ncp_walk_layout(arena, &s->walk);
    perp__witness_layout(arena, &s->witness, n);
}

perp_status perp__ncp_setup(perp_ncp_solver *solver, const perp_ncp_problem *problem)
{
    perp_ncp_solver next = *solver;
    perp_ncp_problem own;
    perp_status status = perp__ncp_problem_read(solver->context, &own, problem);

    if (status != PERP_OK)
        return status;
    next.model.context = solver->context;
    next.model.problem = own;
    next.model.n = own.n;
    next.model.sparse = own.storage == PERP_STORAGE_CSC;
    status = perp__arena_fit(&next.arena, layout, &next);
    if (status != PERP_OK)
        return status;
    next.setups = 1;
    *solver = next;
    solver->walk.model = &solver->model;
    perp__ncp_model_read(&solver->model, &own);
    return PERP_OK;
}

static perp_status enter(perp_ncp_solver *solver)
{
    return perp__handle_enter(solver, &kind);
}

perp_status perp_ncp_solver_create(perp_context *context, perp_ncp_solver **solver,
                                   const perp_ncp_settings *settings)
{
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(context, "solver", solver);
    if (status == PERP_OK)
        status = perp__ncp_create(context, solver, settings);
    return perp__leave(context, status);
}

void perp_ncp_solver_destroy(perp_ncp_solver *solver)
{
    perp__handle_destroy(solver, &kind);
}

perp_status perp_ncp_solver_set(perp_ncp_solver *solver, const perp_ncp_settings *settings)
{
    perp_status status = enter(solver);

    return status == PERP_OK ? perp__leave(solver->context, perp__ncp_set(solver, settings))
                             : status;
}

perp_status perp_ncp_solver_setup(perp_ncp_solver *solver, const perp_ncp_problem *problem)
{
    perp_status status = enter(solver);

    return status != PERP_OK ? status
                             : perp__leave(solver->context, perp__ncp_setup(solver, problem));
}

perp_status perp_ncp_solver_solve(perp_ncp_solver *solver, double *z, double *w,
                                  perp_ncp_result *result, const double *z0)
{
    perp_status status = enter(solver);

    return status != PERP_OK
               ? status
               : perp__leave(solver->context, perp__ncp_solve(solver, z, w, result, z0));
}

perp_status perp_ncp_solve(perp_context *context, double *z, double *w, perp_ncp_result *result,
                           const perp_ncp_settings *settings, const perp_ncp_problem *problem,
                           const double *z0)
{
    perp_ncp_solver *solver = NULL;
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    status = perp__ncp_create(context, &solver, settings);
    if (status == PERP_OK)
        status = perp__ncp_setup(solver, problem);
    if (status == PERP_OK)
        status = perp__ncp_solve(solver, z, w, result, z0);
    perp__ncp_destroy(solver);
    return perp__leave(context, status);
}
