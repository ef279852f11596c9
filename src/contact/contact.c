/* The front door: tries the start, runs the methods of the plan, recomputes every residual, keeps
 * the best point, says what it is worth. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"
#include "contact/solver.h"

/* A backward error that leaves no better double. */
#define ROUNDING (16.0 * DBL_EPSILON)
/* A tested residual from which the active set may be the solution's. */
#define POLISHED 1e-2

/* Where a step of the plan starts from. */
enum origin { FROM_BEST, FROM_LAST };

typedef struct plan_step {
    int32_t method;
    enum origin origin;
    int64_t limit;   /* of iterations; 0: the method's own */
    int32_t attempt; /* the first one of the method */
    int32_t count;   /* of attempts at most; 0: all that the method has */
} plan_step;

enum { PLAN_MOST = 16 };

/* Sweeps before newton takes over: many where a rough answer is asked for, which they may give, few
 * where they are to lead to newton's way. Rows of contacts up to which pivoting is a fall-back. */
#define ROUGH 1e-5
enum { ROUGH_SWEEPS = 1000, FIRST_SWEEPS = 100, LEMKE_MOST = 600 };

static perp_outcome outcome_of(const perp_contact_solver *solver, const perp__contact_worth *worth,
                               perp_outcome said)
{
    const double tol = solver->settings.tol;

    if (worth->tested <= tol)
        return PERP_OUTCOME_SOLVED;
    if (worth->backward <= ROUNDING && worth->tested <= sqrt(tol))
        return PERP_OUTCOME_ROUNDING_LIMIT;
    return perp__contact_is_good(said) ? PERP_OUTCOME_STALLED : said;
}

/* Evaluates solver->r and keeps it if it is the best so far. */
static perp_status consider(perp_contact_solver *solver, int32_t method, perp_outcome said,
                            const perp__contact_iterate *iterate, perp__contact_worth *found)
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
    if (found)
        *found = worth;
    outcome = outcome_of(solver, &worth, said);
    if (best->method >= 0 &&
        perp__contact_is_good(best->outcome) >= perp__contact_is_good(outcome) &&
        best->worth.tested <= worth.tested) {
        if (!perp__contact_is_good(best->outcome))
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
    if (solver->entrance == PERP__ENTRANCE_DYNAMICS && solver->dynamics.n > 0)
        memcpy(solver->best_v, solver->v, (size_t)solver->dynamics.n * sizeof(double));
    return PERP_OK;
}

perp_status perp__contact_consider_polish(perp_contact_solver *solver, perp__contact_worth *worth)
{
    perp__contact_iterate iterate;

    memset(&iterate, 0, sizeof iterate);
    iterate.modes = solver->modes;
    iterate.has_modes = 1;
    iterate.iterations = solver->best.iterations;
    return consider(solver, solver->running, solver->best.outcome, &iterate, worth);
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

/* Contacts and bilateral rows up to which a proof of infeasibility is looked for before newton. */
enum { EARLY_RAY = 200 };

static int32_t ends_the_search(const perp_contact_solver *solver)
{
    return perp__contact_is_good(solver->best.outcome) || solver->ended >= 0 ||
           solver->certificate != PERP_CONTACT_CERTIFICATE_NONE;
}

/* One run of a method, from start to candidate. */
static perp_status run_once(perp_contact_solver *solver, perp__contact_slot *slot,
                            enum origin origin, int32_t attempt)
{
    const size_t bytes = (size_t)solver->size * sizeof(double);
    perp__contact_iterate iterate;
    perp__contact_worth worth;
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
    status = consider(solver, slot->method->id, iterate.outcome, &iterate, &worth);
    if (status == PERP_OK && !ends_the_search(solver) && worth.tested <= POLISHED)
        status = perp__contact_polish_run(solver);
    return status;
}

/* Whether a step of auto's is worth a try: newton is for Lorentz cones, and what needs W needs one
 * that can be numbered. */
static perp_status suits(perp_contact_solver *solver, perp__contact_slot *slot, int32_t *suited)
{
    perp_status status = PERP_OK;

    *suited = slot->method->id != PERP_CONTACT_METHOD_NEWTON || !solver->has_discs;
    if (!*suited)
        return PERP_OK;
    if (slot->method->id == PERP_CONTACT_METHOD_LEMKE && solver->rows > LEMKE_MOST)
        *suited = 0;
    if (*suited && slot->method->needs_delassus)
        status = perp__contact_delassus(solver, suited);
    if (status == PERP_OK && *suited && slot->method->check(&solver->problem) != PERP_OK)
        *suited = 0;
    return status;
}

/* The method that the caller chose must be able to. */
static perp_status check_chosen(perp_contact_solver *solver, perp__contact_slot *slot)
{
    int32_t made = 1;
    perp_status status = PERP_OK;

    if (slot->method->id == PERP_CONTACT_METHOD_NEWTON && solver->has_discs)
        return perp__fail(solver->context, PERP_ERROR_ARGUMENT,
                          "settings.method newton can't take rolling or spinning friction: use "
                          "sweep, lemke or auto");
    if (slot->method->needs_delassus)
        status = perp__contact_delassus(solver, &made);
    if (status == PERP_OK && !made)
        status = perp__fail(solver->context, PERP_ERROR_ARGUMENT,
                            "settings.method %s needs W, which has more than 2^31 entries",
                            perp_contact_method_text(slot->method->id));
    return status == PERP_OK ? slot->method->check(&solver->problem) : status;
}

static perp_status run(perp_contact_solver *solver, const plan_step *step)
{
    perp__contact_slot *slot = slot_of(solver, step->method);
    perp_status status = PERP_OK;
    int32_t attempt, attempts, suited = 1;

    if (solver->settings.method == step->method || solver->settings.cone > 0)
        status = check_chosen(solver, slot);
    else
        status = suits(solver, slot, &suited);
    if (status != PERP_OK || !suited)
        return status;
    solver->running = step->method;
    solver->problem.iteration_limit =
        solver->settings.max_iterations > 0 ? solver->settings.max_iterations : step->limit;
    status = fit(solver, slot);
    attempts = step->count > 0 ? step->count : slot->method->attempts - step->attempt;
    for (attempt = 0; attempt < attempts && status == PERP_OK; attempt++) {
        status = run_once(solver, slot, step->origin, step->attempt + attempt);
        if (ends_the_search(solver))
            break;
    }
    return status;
}

/* Contacts without friction and planar ones: their polyhedra are the cones themselves. */
static int32_t is_polyhedral(const perp_contact_solver *solver)
{
    int32_t k;

    for (k = 0; k < solver->contacts; k++)
        if (solver->dims[k] == 3 && (solver->mu[k] > 0.0 || solver->has_discs))
            return 0;
    return 1;
}

static int32_t plan(const perp_contact_solver *solver, plan_step *steps)
{
    /* pivoting on polyhedra that fit ever closer, newton's polish after each; its paths are the
     * last resort */
    static const plan_step conic[] = {{PERP_CONTACT_METHOD_SWEEP, FROM_BEST, FIRST_SWEEPS, 0, 1},
                                      {PERP_CONTACT_METHOD_NEWTON, FROM_BEST, 0, 0, 2},
                                      {PERP_CONTACT_METHOD_LEMKE, FROM_BEST, 0, 0, 1},
                                      {PERP_CONTACT_METHOD_NEWTON, FROM_LAST, 0, 0, 1},
                                      {PERP_CONTACT_METHOD_LEMKE, FROM_BEST, 0, 1, 1},
                                      {PERP_CONTACT_METHOD_NEWTON, FROM_LAST, 0, 0, 1},
                                      {PERP_CONTACT_METHOD_LEMKE, FROM_BEST, 0, 2, 1},
                                      {PERP_CONTACT_METHOD_NEWTON, FROM_LAST, 0, 0, 1},
                                      {PERP_CONTACT_METHOD_LEMKE, FROM_BEST, 0, 3, 1},
                                      {PERP_CONTACT_METHOD_NEWTON, FROM_LAST, 0, 0, 1},
                                      {PERP_CONTACT_METHOD_LEMKE, FROM_BEST, 0, 4, 1},
                                      {PERP_CONTACT_METHOD_NEWTON, FROM_LAST, 0, 0, 1},
                                      {PERP_CONTACT_METHOD_LEMKE, FROM_BEST, 0, 5, 1},
                                      {PERP_CONTACT_METHOD_NEWTON, FROM_LAST, 0, 0, 1},
                                      {PERP_CONTACT_METHOD_NEWTON, FROM_BEST, 0, 2, 0},
                                      {PERP_CONTACT_METHOD_SWEEP, FROM_BEST, 0, 0, 1}};
    static const plan_step polyhedral[] = {
        {PERP_CONTACT_METHOD_SWEEP, FROM_BEST, FIRST_SWEEPS, 0, 1},
        {PERP_CONTACT_METHOD_LEMKE, FROM_BEST, 0, 0, 1},
        {PERP_CONTACT_METHOD_NEWTON, FROM_BEST, 0, 0, 0},
        {PERP_CONTACT_METHOD_SWEEP, FROM_BEST, 0, 0, 1}};
    const int32_t chosen = solver->settings.method;

    if (solver->settings.cone > 0 ||
        (chosen != PERP_CONTACT_METHOD_AUTO && chosen != PERP_CONTACT_METHOD_LEMKE)) {
        steps[0].method = solver->settings.cone > 0 ? PERP_CONTACT_METHOD_LEMKE : chosen;
        steps[0].origin = FROM_BEST;
        steps[0].limit = 0;
        steps[0].attempt = steps[0].count = 0;
        return 1;
    }
    if (chosen == PERP_CONTACT_METHOD_LEMKE) { /* and what refines its answer */
        memcpy(steps, conic + 2, 12 * sizeof *steps);
        return 12;
    }
    if (is_polyhedral(solver)) {
        memcpy(steps, polyhedral, sizeof polyhedral);
        return (int32_t)(sizeof polyhedral / sizeof *polyhedral);
    }
    memcpy(steps, conic, sizeof conic);
    if (solver->settings.tol >= ROUGH)
        steps[0].limit = ROUGH_SWEEPS;
    return (int32_t)(sizeof conic / sizeof *conic);
}

/* The caller's start, or no impulses at all. */
static perp_status try_start(perp_contact_solver *solver)
{
    int32_t i;

    for (i = 0; i < solver->size; i++)
        solver->r[i] = solver->call->r0 ? solver->call->r0[i] : 0.0;
    return consider(solver, PERP_CONTACT_METHOD_POLISH, PERP_OUTCOME_ITERATION_LIMIT, NULL, NULL);
}

static perp_status search(perp_contact_solver *solver)
{
    plan_step steps[PLAN_MOST];
    int32_t count = plan(solver, steps), k;
    /* where it is cheap, the question whether there are any velocities at all comes early */
    const int32_t late = solver->contacts + solver->size - solver->rows > EARLY_RAY;
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
        if (status == PERP_OK && !ends_the_search(solver) && k == (late ? count - 1 : 0))
            status = perp__contact_find_ray(solver);
        if (ends_the_search(solver))
            break;
    }
    if (status != PERP_OK || perp__contact_is_good(solver->best.outcome))
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

perp_status perp__contact_solve(perp_contact_solver *solver, const perp__contact_call *call)
{
    const double started = perp__now();
    perp_status status = perp__contact_check_call(solver, call);

    if (status != PERP_OK)
        return status;
    solver->call = call;
    solver->deadline =
        solver->settings.time_limit > 0.0 ? started + solver->settings.time_limit : 0.0;
    solver->control.deadline = solver->deadline;
    solver->control.tick = perp__contact_tick;
    solver->control.tick_user = solver;
    solver->problem.tol = solver->settings.tol;
    solver->problem.iteration_limit = solver->settings.max_iterations;
    solver->problem.cone = solver->settings.cone;
    status = search(solver);
    if (status == PERP_OK)
        perp__contact_write_out(solver, perp__now() - started);
    solver->call = NULL;
    return status;
}
