/* The front door: tries the start, runs the methods of the plan, recomputes every residual, keeps
 * the best point, says what it is worth. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"
#include "contact/law.h"
#include "contact/solver.h"

/* A tested residual from which the active set may be the solution's, and of small problems the
 * sweeps after which it may. */
#define POLISHED 1e-2
enum { ROUGH_START = 30 };

/* More rows than this are hardly ever polished. */
enum { POLISHED_ROWS = 60 };

/* How often sweeps are sent for more. */
enum { SHARPER = 3 };

/* Where a step of the plan starts from. */
enum origin { FROM_BEST, FROM_LAST };

typedef struct plan_step {
    int32_t method;
    enum origin origin;
    int64_t limit;   /* of iterations; 0: the method's own */
    int32_t attempt; /* the first one of the method */
    int32_t count;   /* of attempts at most; 0: all that the method has */
} plan_step;

/* BRIEF: steps of a plan before its last resorts. */
enum { POLYHEDRA = 6, PLAN_MOST = 2 * POLYHEDRA + 3, BRIEF = 2 };

/* Sweeps before proximal takes over: what that costs on piles of boxes, 200 to 2000 of them, but
 * for large ones of balls. Rows of contacts up to which pivots are tried, and how many of them
 * where they come first. */
enum { FIRST_SWEEPS = 400, LEMKE_MOST = 600, FIRST_PIVOTS = 2 * LEMKE_MOST };

static perp__contact_slot *slot_of(perp_contact_solver *solver, int32_t method)
{
    for (int32_t k = 0; k < PERP__CONTACT_METHODS; k++)
        if (solver->slots[k].method->id == method)
            return &solver->slots[k];
    return NULL;
}

static perp_status fit(perp_contact_solver *solver, perp__contact_slot *slot)
{
    return perp__workspace_fit(&slot->space, solver->context, slot->method->work_size,
                               slot->method->layout, &solver->problem, solver->setups);
}

/* Of rigid bodies, problems follow each other: whatever start the next one has, there is room. */
static perp_status reserve(perp_contact_solver *solver)
{
    perp__contact_slot *slot = slot_of(solver, PERP_CONTACT_METHOD_PROXIMAL);
    perp_status status;

    if (memcmp(solver->reserved, solver->fitted, sizeof solver->fitted) == 0 || !solver->rigid ||
        solver->settings.method != PERP_CONTACT_METHOD_AUTO)
        return PERP_OK;
    status = fit(solver, slot);
    PERP__THEN(status, slot->method->reserve(slot->space.work));
    if (status == PERP_OK)
        memcpy(solver->reserved, solver->fitted, sizeof solver->fitted);
    return status;
}

/* Contacts and bilateral rows up to which a proof of infeasibility is looked for early. */
enum { EARLY_RAY = 200 };

static bool ends_the_search(const perp_contact_solver *solver)
{
    return perp__is_good(solver->best.outcome) || solver->ended >= 0 ||
           solver->certificate != PERP_CONTACT_CERTIFICATE_NONE;
}

/* Whether the best point is all that was promised: no other method is asked for more. */
static bool is_enough(const perp_contact_solver *solver)
{
    return solver->best.residuals.tested <= solver->enough &&
           solver->best.residuals.own_residual <= solver->enough;
}

/* Whether the method has used up the caller's max_iterations. */
static bool is_spent(const perp_contact_solver *solver, const perp__contact_slot *slot)
{
    return solver->settings.max_iterations > 0 && solver->settings.max_iterations <= slot->spent;
}

static void begin(perp_contact_solver *solver, const perp__contact_slot *slot,
                  perp__contact_iterate *iterate)
{
    const int64_t left = solver->settings.max_iterations - slot->spent; /* 0 or less: no limit */
    const int64_t limit = solver->problem.iteration_limit;

    *iterate = (perp__contact_iterate){.r = solver->r,
                                       .u = solver->u,
                                       .modes = solver->modes,
                                       .ray = solver->start,
                                       .given = solver->call->r0 != NULL,
                                       .residual = INFINITY};
    iterate->warm = iterate->given || solver->best.method != PERP_CONTACT_METHOD_POLISH;
    if (left > 0 && !(limit > 0 && limit < left))
        solver->problem.iteration_limit = left;
}

static bool check_clock(perp_contact_solver *solver)
{
    if (solver->deadline > 0.0 && solver->ended < 0 && perp__now() > solver->deadline)
        solver->ended = PERP_OUTCOME_TIME_LIMIT;
    return solver->ended >= 0;
}

static perp_status check_abort(perp_contact_solver *solver)
{
    return solver->aborted
               ? perp__fail(solver->context, PERP_ERROR_CALLBACK, "the monitor asked to abort")
               : PERP_OK;
}

/* One run of a method, from start to candidate. */
static perp_status run_once(perp_contact_solver *solver, perp__contact_slot *slot,
                            enum origin origin, int32_t attempt, perp__contact_residuals *residuals)
{
    perp__contact_iterate iterate;
    perp_status status;

    if (origin == FROM_BEST)
        perp__copy(solver->r, solver->best.r, solver->size);
    begin(solver, slot, &iterate);
    iterate.attempt = attempt;
    status = slot->method->solve(slot->space.work, &iterate);
    solver->iterations += iterate.iterations;
    slot->spent += iterate.iterations;
    solver->folds |= iterate.folds;
    PERP__THEN(status, check_abort(solver));
    if (status != PERP_OK)
        return status;
    if (iterate.outcome == PERP_OUTCOME_RAY)
        perp__contact_keep_ray(solver, iterate.ray);
    solver->said = iterate.outcome;
    if (!perp__all_finite(solver->r, (size_t)solver->size)) { /* overflowed: no point to offer */
        perp__copy(solver->r, solver->best.r, solver->size);
        iterate.has_modes = 0;
        solver->said = PERP_OUTCOME_STALLED;
    }
    check_clock(solver);
    status = perp__contact_consider(solver, slot->method->id,
                                    iterate.has_modes ? iterate.modes : NULL, residuals);
    /* The polish is dense. With many rows of bodies it is worth its cost only where the tested
     * residual is small enough and some contact's own is not, as that hides beside heavier ones. */
    if (status == PERP_OK && !ends_the_search(solver) && residuals->tested <= POLISHED &&
        (solver->size <= POLISHED_ROWS ||
         (!solver->problem.yields &&
          (!solver->has_bodies || (residuals->tested <= solver->enough && !is_enough(solver))))))
        status = perp__contact_polish_run(solver);
    return status == PERP_OK ? check_abort(solver) : status;
}

/* What comes to rest is slow after a few sweeps, or after four times as many where it is high; then
 * statics knows. */
static perp_status look_at_rest(perp_contact_solver *solver)
{
    const int32_t most = solver->settings.max_iterations;
    perp__contact_slot *slot = slot_of(solver, PERP_CONTACT_METHOD_SWEEP);
    perp__contact_residuals residuals;
    perp_status status = fit(solver, slot);

    solver->running = PERP_CONTACT_METHOD_SWEEP;
    solver->problem.yields = 1;
    solver->problem.chosen = 0;
    for (int32_t sweeps = PERP__FIRST_LOOK; sweeps < FIRST_SWEEPS && status == PERP_OK;
         sweeps *= 4) {
        if (ends_the_search(solver) || !perp__contact_may_rest(solver) ||
            (most > 0 && slot->spent + 4 * sweeps > most))
            break;
        solver->problem.iteration_limit = sweeps;
        status = run_once(solver, slot, FROM_BEST, 0, &residuals);
        PERP__THEN(status, perp__contact_rest(solver));
    }
    return status;
}

/* Whether the method takes the problem, with W where it needs that. One that the caller chose must
 * be able to; of auto's own those that are not are left out. */
static perp_status check_method(perp_contact_solver *solver, perp__contact_slot *slot,
                                bool is_chosen, int32_t *suits)
{
    const int32_t limit = solver->settings.max_iterations;
    int32_t made = 1;
    perp_status status = PERP_OK;

    *suits = is_chosen || slot->method->id != PERP_CONTACT_METHOD_LEMKE ||
             (solver->rows <= LEMKE_MOST && !(limit > 0 && limit < solver->rows)); /* its pivots */
    if (*suits && slot->method->needs_delassus)
        status = perp__contact_delassus(solver, &made);
    if (status == PERP_OK && !made && is_chosen)
        status = perp__refuse(solver->context,
                              "settings.method %s needs W, which has more than 2^31 entries",
                              perp_contact_method_text(slot->method->id));
    *suits = *suits && made && status == PERP_OK;
    if (*suits && slot->method->check) {
        const perp_status found = slot->method->check(&solver->problem);

        *suits = found == PERP_OK;
        status = is_chosen ? found : PERP_OK;
    }
    return status;
}

/* One step of the plan: the method's attempts. What iterates ends at the tested residual; where
 * some contact's own is not there by then, it goes on, to a smaller one: at tol 1e-3 sweeps of one
 * in fifty of `bench/contact_random`'s piles do, at 1e-8 Newton's steps where a caster and a torso
 * are 1e7 apart in mass. */
static perp_status run(perp_contact_solver *solver, const plan_step *step)
{
    perp__contact_slot *slot = slot_of(solver, step->method);
    const double tol = solver->settings.tol, enough = fmax(tol, solver->enough);
    const bool is_chosen = solver->settings.method == step->method || solver->settings.cone > 0;
    const int32_t rounds = step->method == PERP_CONTACT_METHOD_LEMKE ? 0 : SHARPER;
    const int32_t attempts = step->count > 0 ? step->count : slot->method->attempts - step->attempt;
    perp__contact_residuals residuals;
    int32_t suits;
    perp_status status = check_method(solver, slot, is_chosen, &suits);

    if (status != PERP_OK || !suits)
        return status;
    solver->running = step->method;
    /* first sweeps are also those that were looked at */
    solver->problem.iteration_limit = step->limit > 0 ? step->limit - slot->spent : 0;
    solver->problem.yields = step->limit > 0;
    solver->problem.chosen = is_chosen;
    status = fit(solver, slot);
    for (int32_t attempt = 0; attempt < attempts && status == PERP_OK; attempt++) {
        if (is_spent(solver, slot))
            solver->said = PERP_OUTCOME_ITERATION_LIMIT;
        if (is_spent(solver, slot) || (solver->iterations > 0 && check_clock(solver)))
            break;
        status = run_once(solver, slot, step->origin, step->attempt + attempt, &residuals);
        for (int32_t round = 0; round < rounds && status == PERP_OK; round++) {
            if (ends_the_search(solver) || is_enough(solver) || !(residuals.tested <= enough) ||
                !(residuals.own_residual < 1.0) || is_spent(solver, slot))
                break;
            solver->problem.tol =
                fmax(DBL_EPSILON, 0.5 * residuals.tested * enough / residuals.own_residual);
            solver->problem.enough = 0.0;
            status = run_once(solver, slot, FROM_BEST, 0, &residuals);
        }
        solver->problem.tol = tol;
        solver->problem.enough = solver->enough;
        if (ends_the_search(solver) || is_enough(solver) || (solver->folds && solver->quick > 1))
            break;
    }
    return status;
}

/* Of how many tangents friction of contacts is, at most. Up to 1 polyhedra are the cones. */
static int32_t most_tangents(const perp_contact_solver *solver)
{
    int32_t most = 0;

    for (int32_t k = 0; k < solver->contacts; k++) {
        const bool rubs = (solver->mu[k] != 0.0 || solver->has_discs) &&
                          !perp__contact_is_bound(&solver->problem, k);
        const int32_t tangents = solver->dims[k] - perp__contact_normals(&solver->problem, k);

        most = solver->two_sided[k] > 1 ? 2 : rubs && tangents > most ? tangents : most;
    }
    return most;
}

/* Whether auto begins with the sets of small problems. */
static bool tries_sets(const perp_contact_solver *solver)
{
    return solver->settings.method == PERP_CONTACT_METHOD_AUTO &&
           solver->settings.max_iterations == 0;
}

/* The steps of a search; returns how many. */
static int32_t plan(const perp_contact_solver *solver, plan_step *steps)
{
    const int32_t chosen =
        solver->settings.cone > 0 ? PERP_CONTACT_METHOD_LEMKE : solver->settings.method;
    const bool all = chosen == PERP_CONTACT_METHOD_AUTO;
    const int32_t tangents = most_tangents(solver), once = all && tangents < 2;
    /* whether sets were in vain: more sweeps than they began with seldom end sooner than others */
    const int32_t followed =
        solver->call->r0 && tries_sets(solver) && perp__contact_polish_suits(solver);
    int32_t polyhedra, count = 0;

    /* 1. The method that the caller chose. */
    if (solver->settings.cone > 0 || (!all && chosen != PERP_CONTACT_METHOD_LEMKE)) {
        steps[0] = (plan_step){chosen, FROM_BEST, 0, 0, 0};
        return 1;
    }
    /* 2. What sweeps do not solve pivoting does soonest in the plane, in steps without friction. */
    if (all && !followed)
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_SWEEP, FROM_BEST, FIRST_SWEEPS, 0, 1};
    if (once && tangents + solver->steps < 2 && solver->problem.W)
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_LEMKE, FROM_BEST, FIRST_PIVOTS, 0, 1};
    if (all)
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_PROXIMAL, FROM_BEST, 0, 0, 2};
    if (followed)
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_SWEEP, FROM_BEST, FIRST_SWEEPS, 0, 1};
    /* 3. The last resort: pivoting on polyhedra that fit ever closer, refined after each. Where
       there are too many rows for that, what refines its answers has none to start from. */
    polyhedra = once ? 1 : all && solver->rows > LEMKE_MOST ? 0 : POLYHEDRA;
    for (int32_t k = 0; k < polyhedra; k++) {
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_LEMKE, FROM_BEST, 0, k, 1};
        steps[count++] =
            (plan_step){PERP_CONTACT_METHOD_PROXIMAL, once ? FROM_BEST : FROM_LAST, 0, 1, 1};
    }
    if (all && (polyhedra > 0 || !solver->steps))
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_SWEEP, FROM_BEST, 0, 0, 1};
    return solver->quick && count > BRIEF - followed ? BRIEF - followed : count;
}

/* The caller's start, or no impulses at all. */
static void read_start(perp_contact_solver *solver)
{
    for (int32_t i = 0; i < solver->size; i++)
        solver->r[i] = solver->call->r0 ? solver->call->r0[i] : 0.0;
}

/* The start. Small problems go straight to the active set that it, or a few sweeps from it, show.
 * Where contacts hold both ways a start tells which of several answers is meant, and sweeps leave
 * some of them. */
static perp_status try_start(perp_contact_solver *solver)
{
    perp__contact_slot *sweep = slot_of(solver, PERP_CONTACT_METHOD_SWEEP);
    perp__contact_residuals residuals;
    perp__contact_iterate iterate;
    perp_status status = PERP_OK;
    int32_t rounds = tries_sets(solver) ? 2 : 0, made;

    read_start(solver);
    if (rounds > 0 && solver->holds_both && solver->call->r0 &&
        solver->size <= PERP__POLISH_START_MOST)
        status = perp__contact_delassus(solver, &made);
    if (rounds > 0 &&
        (status != PERP_OK || !perp__contact_polish_suits(solver) || perp__contact_is_near(solver)))
        rounds = 0;
    if (rounds > 0 && solver->call->r0 && most_tangents(solver) + solver->steps < 2)
        rounds = 1; /* what pivoting solves soonest needs no sweeps before */
    for (int32_t round = solver->call->r0 ? 0 : 1; round < rounds && status == PERP_OK; round++) {
        if (round > 0)
            status = fit(solver, sweep);
        if (round > 0 && status == PERP_OK) {
            read_start(solver);
            begin(solver, sweep, &iterate);
            iterate.warm = iterate.given;
            solver->running = PERP_CONTACT_METHOD_SWEEP;
            solver->problem.tol = POLISHED;
            solver->problem.iteration_limit = ROUGH_START;
            status = sweep->method->solve(sweep->space.work, &iterate);
            solver->problem.tol = solver->settings.tol;
            solver->iterations += iterate.iterations;
        }
        solver->running = PERP_CONTACT_METHOD_PROXIMAL;
        PERP__THEN(status, perp__contact_polish_start(solver, round == 0));
        if (perp__is_good(solver->best.outcome) || solver->ended >= 0)
            break;
    }
    if (rounds > 0)
        PERP__THEN(status, check_abort(solver));
    if (status != PERP_OK || perp__is_good(solver->best.outcome))
        return status;
    read_start(solver);
    return perp__contact_consider(solver, PERP_CONTACT_METHOD_POLISH, NULL, &residuals);
}

/* Whether Newton's method, which doubles the digits, comes from the start to the end in two steps:
 * then that takes less than the sweeps of the plan. */
static bool is_near(const perp_contact_solver *solver, const plan_step *steps, int32_t count)
{
    return solver->rigid && solver->call->r0 && count > 1 && !ends_the_search(solver) &&
           steps[0].method == PERP_CONTACT_METHOD_SWEEP &&
           steps[1].method == PERP_CONTACT_METHOD_PROXIMAL && !perp__contact_polish_suits(solver) &&
           solver->best.residuals.tested <= sqrt(sqrt(solver->settings.tol));
}

static perp_status search(perp_contact_solver *solver)
{
    const int32_t limit = solver->settings.max_iterations, method = solver->settings.method;
    plan_step steps[PLAN_MOST];
    int32_t count, ray_after, asks, made, pivoted = 1;
    perp_status status;

    /* 1. The start; joints alone are equations. */
    solver->best.method = -1;
    solver->best.outcome = solver->said = PERP_OUTCOME_ITERATION_LIMIT;
    solver->certificate = PERP_CONTACT_CERTIFICATE_NONE;
    solver->ended = -1;
    solver->iterations = solver->polished = 0;
    solver->has_ray = solver->aborted = solver->asked_rest = solver->rests = solver->folds = 0;
    for (int32_t k = 0; k < PERP__CONTACT_METHODS; k++)
        solver->slots[k].spent = 0;
    status = perp__contact_load(solver);
    PERP__THEN(status, reserve(solver));
    PERP__THEN(status, try_start(solver));
    count = limit < 0 ? 0 : plan(solver, steps);
    if (status == PERP_OK && solver->settings.cone == 0 && !solver->call->r0 &&
        (method == PERP_CONTACT_METHOD_AUTO || method == PERP_CONTACT_METHOD_SWEEP))
        status = look_at_rest(solver);
    if (status == PERP_OK && is_near(solver, steps, count)) {
        status = run(solver, &(plan_step){PERP_CONTACT_METHOD_PROXIMAL, FROM_BEST, 0, 0, 1});
        count = is_enough(solver) ? 0 : count;
    }
    /* 2. The plan. Where it is cheap, the question whether there are any velocities at all comes
       early, but in steps before a method has failed; never with a budget that is used up. */
    asks = count > 1 && method == PERP_CONTACT_METHOD_AUTO && !solver->steps &&
           steps[0].method != PERP_CONTACT_METHOD_SWEEP;
    ray_after = solver->constraints > EARLY_RAY ? count - 1 : -asks;
    for (int32_t k = -asks; k < count && status == PERP_OK && !ends_the_search(solver); k++) {
        /* what moves as it is told may leave no answer; in the plane Lemke's path is exact */
        if (k >= BRIEF &&
            (is_enough(solver) || (solver->folds && solver->rigid && solver->rigid->carriers > 0 &&
                                   most_tangents(solver) > 1)))
            break;
        if (!pivoted && k + 1 < count) /* what fits closer to an answer, where there was none */
            continue;
        if (k >= 0)
            status = run(solver, &steps[k]);
        if (k >= 0 && steps[k].method == PERP_CONTACT_METHOD_LEMKE && steps[k].limit == 0)
            pivoted = solver->said == PERP_OUTCOME_SOLVED;
        if (status == PERP_OK && k == ray_after && solver->proves && !ends_the_search(solver) &&
            !(limit > 0 && solver->said == PERP_OUTCOME_ITERATION_LIMIT))
            status = perp__contact_find_ray(solver);
    }
    /* 3. Auto's last word on small problems with contacts that hold both ways: all their sets, as
       no path is sure to lead to their answers. */
    if (status != PERP_OK || ends_the_search(solver) || !solver->holds_both || limit != 0 ||
        solver->size > PERP__POLISH_SEARCH_MOST || method != PERP_CONTACT_METHOD_AUTO)
        return status;
    status = perp__contact_delassus(solver, &made);
    solver->running = PERP_CONTACT_METHOD_PROXIMAL;
    if (status == PERP_OK && made)
        status = perp__contact_polish_search(solver);
    return status == PERP_OK ? check_abort(solver) : status;
}

/* How far an impulse is likely to reach, beside what the largest free velocity of its part would
 * take to stop. */
static void find_reach(const perp_contact_solver *solver, double *reach)
{
    for (int32_t i = 0; i < solver->bounded.count; i++) {
        const int32_t k = solver->bounded.contact_of[i];
        const double drive = k < 0 ? 0.0 : PERP__REACH * solver->drive[solver->part[k]];

        reach[i] = drive > 0.0 ? drive / solver->root[k] : 0.0;
    }
}

/* With rows that have bounds. Those that are far off are drawn in (bounded.h), by the free
 * velocities at the impulses nearest to 0, and are further off where they turn out to be in the
 * way. */
static perp_status find_within(perp_contact_solver *solver, const perp__contact_call *given,
                               perp__contact_call *copy, double deadline)
{
    perp__contact_bounded *bounded = &solver->bounded;
    const int32_t limit = solver->settings.max_iterations;
    const bool is_far = perp__contact_bounded_is_far(bounded);
    int64_t iterations = 0;
    bool again, is_ray;
    perp_status status = PERP_OK;

    /* 1. The first bounds. */
    if (is_far) {
        for (int32_t i = 0; i < bounded->count; i++)
            bounded->reach[i] = 0.0;
        perp__contact_bounded_draw_in(bounded);
        perp__contact_bounded_pose(bounded, given, copy);
        solver->call = copy;
        status = perp__contact_load(solver);
    }
    if (is_far && status == PERP_OK) {
        find_reach(solver, bounded->reach);
        perp__copy(bounded->load, solver->load, solver->size);
        solver->is_far = 1;
    }
    do {
        /* 2. A solve within them. */
        if (status == PERP_OK && is_far)
            perp__contact_bounded_draw_in(bounded);
        perp__contact_bounded_pose(bounded, given, copy);
        PERP__THEN(status, perp__contact_find(solver, copy, deadline));
        iterations += status == PERP_OK ? solver->iterations : 0;
        if (limit > 0) /* what is left of it */
            solver->settings.max_iterations =
                limit > iterations ? (int32_t)(limit - iterations) : 1;
        /* 3. Those in the way. That no velocities are possible is so wherever they are: a row with
           one bound has u of one sign, with two of any. */
        is_ray = solver->best.outcome == PERP_OUTCOME_RAY;
        again = status == PERP_OK && is_far &&
                !(is_ray && solver->certificate == PERP_CONTACT_CERTIFICATE_INFEASIBLE);
        if (again) {
            find_reach(solver, bounded->likely);
            again = perp__contact_bounded_widen(bounded, solver->best.r, solver->best.u, is_ray);
        }
    } while (again && solver->ended != PERP_OUTCOME_STOPPED);
    if (again) /* whoever said stop is not asked again: at a bound that is none it is no answer */
        solver->best.outcome = perp__worse_outcome(solver->best.outcome, PERP_OUTCOME_STOPPED);
    solver->settings.max_iterations = limit;
    solver->iterations = iterations;
    return status;
}

perp_status perp__contact_solve(perp_contact_solver *solver, const perp__contact_call *call)
{
    const double started = perp__now();
    const double limit = solver->settings.time_limit,
                 deadline = limit > 0.0 ? started + limit : 0.0;
    const bool has_bounds = solver->bounded.count > 0;
    perp__contact_call given = *call, copy;
    perp_status status = perp__contact_check_call(solver, call);

    if (status != PERP_OK)
        return status;
    if (given.r0 && perp__is_zero(given.r0, has_bounds ? solver->bounded.size : solver->size))
        given.r0 = NULL; /* a start that knows nothing is none */
    solver->is_far = 0;
    status = has_bounds ? find_within(solver, &given, &copy, deadline)
                        : perp__contact_find(solver, &given, deadline);
    if (status == PERP_OK && (call->to.v || call->to.u))
        status = perp__contact_rest(solver);
    if (status == PERP_OK && !solver->rests && solver->settings.raw_velocity != 1 &&
        (call->to.v || call->to.u))
        status = perp__contact_hold_best(solver);
    if (status == PERP_OK)
        perp__contact_write_out(solver, call, started);
    solver->call = NULL;
    return status;
}

perp_status perp__contact_find(perp_contact_solver *solver, const perp__contact_call *call,
                               double deadline)
{
    perp_status status;
    perp_outcome said;

    solver->call = call;
    solver->control.deadline = solver->deadline = deadline;
    solver->control.tick = perp__contact_tick;
    solver->control.tick_user = solver;
    solver->problem.tol = solver->settings.tol;
    solver->problem.enough = solver->enough;
    solver->problem.iteration_limit = solver->settings.max_iterations;
    solver->problem.cone = solver->settings.cone;
    status = search(solver);
    if (status != PERP_OK)
        return status;
    /* what the search ended with, from what counts most down; a ray that was said to be one and is
       not in the certificate was none */
    if (solver->certificate != PERP_CONTACT_CERTIFICATE_NONE ||
        (solver->has_ray && solver->settings.cone > 0))
        said = PERP_OUTCOME_RAY;
    else if (solver->ended >= 0)
        said = solver->ended;
    else
        said = solver->said == PERP_OUTCOME_RAY ? PERP_OUTCOME_STALLED : solver->said;
    solver->best.outcome = perp__contact_verdict(solver, &solver->best, said);
    return PERP_OK;
}
