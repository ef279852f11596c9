/* What a solver is given, and its life: create, set, setup, destroy, and the public entrances. */
#include "ncp/solver.h"

#include <math.h>

#include "base/check.h"
#include "base/context.h"

/* ---- settings and problems ---- */

PERP__INIT_WITH(perp_ncp_settings, .tol = 1e-10, .penalty = 0.1, .restarts = 20, .scaling = 1,
                .polish = 1)

PERP__WORDS(perp_ncp_method_text, "unknown method", "auto", "fischer", "josephy")

static const perp__field fields[] = {
    PERP__INTEGER(perp_ncp_settings, method, 0, PERP_NCP_JOSEPHY),
    PERP__INTEGER(perp_ncp_settings, max_iterations, 0, INFINITY),
    PERP__INTEGER(perp_ncp_settings, restarts, 0, INFINITY),
    PERP__INTEGER(perp_ncp_settings, scaling, 0, 1),
    PERP__INTEGER(perp_ncp_settings, polish, 0, 1),
    PERP__INTEGER(perp_ncp_settings, reserved, 0, 0),
    PERP__REAL(perp_ncp_settings, tol, "()", 0, INFINITY),
    PERP__REAL(perp_ncp_settings, time_limit, "[]", 0, INFINITY),
    PERP__REAL(perp_ncp_settings, penalty, "[)", 0, 1),
};

static PERP__SETTINGS_READER(read_settings, perp_ncp_settings, fields, PERP_OK)

    static perp_status check_storage(perp_context *context, const perp_ncp_problem *p)
{
    const perp__matrix pattern = {p->n, p->n, 1, 1, NULL, p->column_starts, p->row_indices};
    const perp_status status =
        p->storage == PERP_STORAGE_CSC
            ? perp__check_pointer(context, "problem.column_starts", p->column_starts)
            : PERP_OK;

    if (p->storage == PERP_STORAGE_CSC)
        return status == PERP_OK ? perp__matrix_check_csc(context, "problem", &pattern) : status;
    if (p->storage != PERP_STORAGE_COLUMN_MAJOR && p->storage != PERP_STORAGE_ROW_MAJOR)
        return perp__refuse(context, "problem.storage is %d, which is none", (int)p->storage);
    if (p->column_starts || p->row_indices)
        return perp__refuse(context, "problem.storage is dense but problem.%s is not NULL",
                            p->column_starts ? "column_starts" : "row_indices");
    return PERP_OK;
}

/* ---- life ---- */

static void release(void *object)
{
    perp_ncp_solver *solver = object;

    perp__cached_factor_release(&solver->run.factor);
    perp__handle_end(solver->linear.lcp);
    perp__arena_release(&solver->arena);
}

static const perp__kind kind = {"a solver", sizeof(perp_ncp_solver), release};

perp_status perp__ncp_create(perp_context *context, perp_ncp_solver **solver,
                             const perp_ncp_settings *settings)
{
    perp_status status = perp__check_pointer(context, "solver", solver);
    perp_ncp_solver *made = status == PERP_OK ? perp__handle_create(context, &kind) : NULL;

    if (!made)
        return status == PERP_OK ? PERP_ERROR_MEMORY : status;
    status = read_settings(context, &made->settings, settings);
    PERP__HAND_OUT(status, made, solver);
    return status;
}

static void layout(perp__arena *arena, void *object)
{
    perp_ncp_solver *s = object;
    const size_t n = (size_t)s->model.n;

    s->run.model = &s->model;
    PERP__DOUBLES(arena, n, &s->start, &s->unit, &s->perturbed, &s->candidate, &s->best_z,
                  &s->parts.z, &s->parts.lower, &s->parts.upper, &s->parts.start, &s->best_w,
                  &s->linear.q, &s->linear.z, &s->linear.kept_z, &s->linear.kept_d);
    s->parts.of = perp__arena_take(arena, n, sizeof(int32_t));
    perp__ncp_model_layout(arena, &s->model);
    perp__ncp_run_layout(arena, &s->run);
    perp__witness_layout(arena, &s->witness, n);
}

perp_status perp__ncp_setup(perp_ncp_solver *solver, const perp_ncp_problem *problem)
{
    perp_context *context = solver->context;
    perp_ncp_solver next = *solver;
    perp_ncp_problem copy = {0};
    perp_status status = PERP__CHECK(perp_ncp_problem, context, problem);

    /* 1. Struct, callbacks, pattern and bounds. */
    PERP__THEN(status, PERP__READ(perp_ncp_problem, context, &copy, problem));
    if (status == PERP_OK && copy.n < 0)
        status = perp__refuse(context, "problem.n is %d, expected a count", (int)copy.n);
    if (status == PERP_OK && !copy.function)
        status = perp__refuse(context, "problem.function is NULL");
    PERP__THEN(status, check_storage(context, &copy));
    PERP__THEN(status, perp__check_bounds(context, copy.lower, copy.upper, (size_t)copy.n));
    if (status != PERP_OK)
        return status;
    /* 2. Room; without it the solver keeps its last problem. */
    next.model.context = context;
    next.model.settings = &solver->settings;
    next.model.problem = copy;
    next.model.n = copy.n;
    next.model.sparse = copy.storage == PERP_STORAGE_CSC;
    status = perp__arena_fit(&next.arena, context, layout, &next);
    if (status != PERP_OK)
        return status;
    next.setups = 1;
    *solver = next;
    solver->run.model = &solver->model;
    perp__ncp_model_read(&solver->model, &copy);
    return PERP_OK;
}

perp_status perp_ncp_solver_create(perp_context *context, perp_ncp_solver **solver,
                                   const perp_ncp_settings *settings)
{
    return PERP__CALL(perp__enter(context), context, perp__ncp_create(context, solver, settings));
}

void perp_ncp_solver_destroy(perp_ncp_solver *solver)
{
    perp__handle_destroy(solver, &kind);
}

perp_status perp_ncp_solver_set(perp_ncp_solver *solver, const perp_ncp_settings *settings)
{
    return PERP__HANDLE_CALL(solver, &kind,
                             read_settings(solver->context, &solver->settings, settings));
}

perp_status perp_ncp_solver_setup(perp_ncp_solver *solver, const perp_ncp_problem *problem)
{
    return PERP__HANDLE_CALL(solver, &kind, perp__ncp_setup(solver, problem));
}

perp_status perp_ncp_solver_solve(perp_ncp_solver *solver, double *z, double *w,
                                  perp_ncp_result *result, const double *z0)
{
    return PERP__HANDLE_CALL(solver, &kind, perp__ncp_solve(solver, z, w, result, z0));
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
    PERP__THEN(status, perp__ncp_setup(solver, problem));
    PERP__THEN(status, perp__ncp_solve(solver, z, w, result, z0));
    perp__handle_end(solver);
    return perp__leave(context, status);
}
