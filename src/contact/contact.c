/* The front door: tries the start, runs the methods of the plan, recomputes every residual, keeps
 * the best point, says what it is worth. */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"
#include "contact/law.h"
#include "contact/solver.h"

/* A tested residual from which the active set may be the solution's. */
#define POLISHED 1e-2

/* More rows than this are not polished where another method takes over anyway. */
enum { POLISHED_ROWS = 60 };

/* Of small problems: the residual and the sweeps after which modes may be the solution's. */
#define ROUGH_TOL 1e-3
enum { ROUGH_START = 30 };

/* How often sweeps are sent for more, and the least that they are sent for. */
enum { SHARPER = 3 };
#define LEAST_TOL 1e-15

/* The share of what the next method costs that sweeps may take even where they seem slow. */
#define PATIENCE 0.25

/* Where a step of the plan starts from. */
enum origin { FROM_BEST, FROM_LAST };

typedef struct plan_step {
    int32_t method;
    enum origin origin;
    int64_t limit;   /* of iterations; 0: the method's own */
    int32_t attempt; /* the first one of the method */
    int32_t count;   /* of attempts at most; 0: all that the method has */
} plan_step;

enum { POLYHEDRA = 6, PLAN_MOST = 2 * POLYHEDRA + 3 };

/* Sweeps before proximal takes over: what that costs on piles of boxes, 200 to 2000 of them, but
 * for large ones of balls. Rows of contacts up to which pivoting is a fall-back. */
enum { FIRST_SWEEPS = 400, LEMKE_MOST = 600 };

static perp__contact_slot *slot_of(perp_contact_solver *solver, int32_t method)
{
    for (int32_t k = 0; k < PERP__CONTACT_METHODS; k++)
        if (solver->slots[k].method->id == method)
            return &solver->slots[k];
    return NULL;
}

/* Whether what was laid out for an earlier set-up of rigid bodies serves this one. */
static int32_t fits_still(const perp_contact_solver *solver, const perp__contact_slot *slot)
{
    return slot->space.fitted > 0 && slot->method->lays_out_by_size &&
           solver->entrance == PERP__ENTRANCE_RIGID &&
           memcmp(slot->sizes, solver->sizes, sizeof slot->sizes) == 0;
}

/* Lays out the method's workspace for this set-up, once. */
static perp_status fit(perp_contact_solver *solver, perp__contact_slot *slot)
{
    if (fits_still(solver, slot))
        slot->space.fitted = solver->setups;
    memcpy(slot->sizes, solver->sizes, sizeof slot->sizes);
    return perp__workspace_fit(&slot->space, solver->context, slot->method->work_size,
                               slot->method->layout, &solver->problem, solver->setups);
}

/* Contacts and bilateral rows up to which a proof of infeasibility is looked for early. */
enum { EARLY_RAY = 200 };

static int32_t ends_the_search(const perp_contact_solver *solver)
{
    return perp__is_good(solver->best.outcome) || solver->ended >= 0 ||
           solver->certificate != PERP_CONTACT_CERTIFICATE_NONE;
}

/* What is left of the caller's max_iterations for a method; the method's own limit where there is
 * none: 0. */
static int64_t iterations_left(const perp_contact_solver *solver, const perp__contact_slot *slot)
{
    return solver->settings.max_iterations > 0 ? solver->settings.max_iterations - slot->spent : 0;
}

static int32_t is_spent(const perp_contact_solver *solver, const perp__contact_slot *slot)
{
    return solver->settings.max_iterations > 0 && iterations_left(solver, slot) <= 0;
}

static void begin(perp_contact_solver *solver, const perp__contact_slot *slot,
                  perp__contact_iterate *iterate)
{
    memset(iterate, 0, sizeof *iterate);
    iterate->r = solver->r;
    iterate->u = solver->u;
    iterate->modes = solver->modes;
    iterate->ray = solver->start;
    iterate->warm = solver->call->r0 != NULL || solver->best.method != PERP_CONTACT_METHOD_POLISH;
    iterate->given = solver->call->r0 != NULL;
    iterate->residual = INFINITY;
    if (solver->settings.max_iterations > 0)
        solver->problem.iteration_limit = iterations_left(solver, slot);
}

static int32_t check_clock(perp_contact_solver *solver)
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

/* What proximal, which is next, costs is known from the fill of its factors: a fourth of that is no
 * loss beside it, and sweeps are often slow until the modes are right. */
static perp_status find_patience(void *user, int64_t *patience)
{
    perp_contact_solver *solver = user;
    perp__contact_slot *slot = slot_of(solver, PERP_CONTACT_METHOD_PROXIMAL);
    double sweeps = 0.0;
    perp_status status = PERP_OK;

    if (slot->method->check(&solver->problem) == PERP_OK) {
        status = fit(solver, slot);
        PERP__THEN(status, perp__proximal_worth(slot->space.work, &sweeps));
    }
    *patience = (int64_t)(PATIENCE * sweeps);
    return status;
}

/* One run of a method, from start to candidate. */
static perp_status run_once(perp_contact_solver *solver, perp__contact_slot *slot,
                            enum origin origin, int32_t attempt, perp__contact_worth *worth)
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
                                    iterate.has_modes ? iterate.modes : NULL, worth);
    if (status == PERP_OK && !ends_the_search(solver) && worth->tested <= POLISHED &&
        !(solver->problem.leads && solver->rows > POLISHED_ROWS))
        status = perp__contact_polish_run(solver);
    return status == PERP_OK ? check_abort(solver) : status;
}

/* What iterates ends at the tested residual. Where some contact's own is not there by then, it goes
 * on, to a smaller one: at tol 1e-3 sweeps of one in fifty of `bench/contact_random`'s piles do, at
 * 1e-8 Newton's steps where a caster and a torso are 1e7 apart in mass. */
static perp_status run_on(perp_contact_solver *solver, perp__contact_slot *slot,
                          const perp__contact_worth *worth)
{
    const double tol = solver->settings.tol;
    perp__contact_worth next = *worth;
    perp_status status = PERP_OK;

    for (int32_t round = 0; round < SHARPER && status == PERP_OK && !ends_the_search(solver);
         round++) {
        if (!(next.tested <= tol) || !(next.own < 1.0) || is_spent(solver, slot))
            break;
        solver->problem.tol = fmax(LEAST_TOL, 0.5 * next.tested * tol / next.own);
        status = run_once(solver, slot, FROM_BEST, 0, &next);
    }
    solver->problem.tol = tol;
    return status;
}

/* Whether a step of auto's is worth a try: what needs W needs one that can be numbered. */
static perp_status suits(perp_contact_solver *solver, perp__contact_slot *slot, int32_t *suited)
{
    perp_status status = PERP_OK;

    *suited = slot->method->id != PERP_CONTACT_METHOD_LEMKE || solver->rows <= LEMKE_MOST;
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

    if (slot->method->needs_delassus)
        status = perp__contact_delassus(solver, &made);
    if (status == PERP_OK && !made)
        status = perp__refuse(solver->context,
                              "settings.method %s needs W, which has more than 2^31 entries",
                              perp_contact_method_text(slot->method->id));
    return status == PERP_OK ? slot->method->check(&solver->problem) : status;
}

static perp_status run(perp_contact_solver *solver, const plan_step *step)
{
    perp__contact_slot *slot = slot_of(solver, step->method);
    perp__contact_worth worth;
    perp_status status = PERP_OK;
    int32_t attempt, attempts, suited = 1;

    if (solver->settings.method == step->method || solver->settings.cone > 0)
        status = check_chosen(solver, slot);
    else
        status = suits(solver, slot, &suited);
    if (status != PERP_OK || !suited)
        return status;
    solver->running = step->method;
    solver->problem.iteration_limit = step->limit;
    solver->problem.leads = step->limit > 0;
    solver->problem.chosen = solver->settings.method == step->method;
    status = fit(solver, slot);
    attempts = step->count > 0 ? step->count : slot->method->attempts - step->attempt;
    for (attempt = 0; attempt < attempts && status == PERP_OK; attempt++) {
        if (is_spent(solver, slot))
            solver->said = PERP_OUTCOME_ITERATION_LIMIT;
        if (is_spent(solver, slot) || (solver->iterations > 0 && check_clock(solver)))
            break;
        status = run_once(solver, slot, step->origin, step->attempt + attempt, &worth);
        if (status == PERP_OK && step->method != PERP_CONTACT_METHOD_LEMKE)
            status = run_on(solver, slot, &worth);
        if (ends_the_search(solver))
            break;
    }
    return status;
}

/* Contacts without friction and planar ones: their polyhedra are the cones themselves. */
static int32_t is_polyhedral(const perp_contact_solver *solver)
{
    for (int32_t k = 0; k < solver->contacts; k++)
        if (solver->two_sided[k] > 1 ||
            (solver->dims[k] - perp__contact_normals(&solver->problem, k) == 2 &&
             (solver->mu[k] > 0.0 || solver->has_discs)))
            return 0;
    return 1;
}

static int32_t plan(const perp_contact_solver *solver, plan_step *steps)
{
    const int32_t chosen =
        solver->settings.cone > 0 ? PERP_CONTACT_METHOD_LEMKE : solver->settings.method;
    const int32_t all = chosen == PERP_CONTACT_METHOD_AUTO;
    const int32_t once = all && is_polyhedral(solver);
    const int32_t too_large = all && !once && solver->rows > LEMKE_MOST;
    const int32_t polyhedra = once ? 1 : too_large ? 0 : POLYHEDRA;
    int32_t count = 0;

    if (solver->settings.cone > 0 || (!all && chosen != PERP_CONTACT_METHOD_LEMKE)) {
        steps[0] = (plan_step){chosen, FROM_BEST, 0, 0, 0};
        return 1;
    }
    if (all) {
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_SWEEP, FROM_BEST, FIRST_SWEEPS, 0, 1};
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_PROXIMAL, FROM_BEST, 0, 0, once ? 1 : 2};
    }
    /* The last resort: pivoting on polyhedra that fit ever closer, refined after each. Where there
       are too many rows for that, what refines its answers has none to start from. */
    for (int32_t k = 0; k < polyhedra; k++) {
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_LEMKE, FROM_BEST, 0, k, 1};
        steps[count++] =
            (plan_step){PERP_CONTACT_METHOD_PROXIMAL, once ? FROM_BEST : FROM_LAST, 0, 1, 1};
    }
    if (all)
        steps[count++] = (plan_step){PERP_CONTACT_METHOD_SWEEP, FROM_BEST, 0, 0, 1};
    return count;
}

/* The caller's start, or no impulses at all. */
static void read_start(perp_contact_solver *solver)
{
    for (int32_t i = 0; i < solver->size; i++)
        solver->r[i] = solver->call->r0 ? solver->call->r0[i] : 0.0;
}

/* A few sweeps from the start, as far as the modes of a small problem show. */
static perp_status sweep_roughly(perp_contact_solver *solver)
{
    perp__contact_slot *slot = slot_of(solver, PERP_CONTACT_METHOD_SWEEP);
    perp__contact_iterate iterate;
    perp_status status = fit(solver, slot);

    if (status != PERP_OK)
        return status;
    read_start(solver);
    begin(solver, slot, &iterate);
    iterate.warm = iterate.given;
    solver->running = PERP_CONTACT_METHOD_SWEEP;
    solver->problem.tol = ROUGH_TOL;
    solver->problem.iteration_limit = ROUGH_START;
    status = slot->method->solve(slot->space.work, &iterate);
    solver->problem.tol = solver->settings.tol;
    solver->iterations += iterate.iterations;
    return status;
}

/* Whether auto begins with the sets of small problems. */
static int32_t tries_sets(const perp_contact_solver *solver)
{
    return solver->settings.method == PERP_CONTACT_METHOD_AUTO &&
           (solver->settings.max_iterations == 0 || solver->is_condensed);
}

/* Small problems: straight to the active set that the start, or a few sweeps, show. Where contacts
 * hold both ways a start tells which of several answers is meant, and sweeps leave some of them. */
static perp_status try_set(perp_contact_solver *solver)
{
    perp_status status = PERP_OK;
    int32_t made;

    if (!tries_sets(solver))
        return PERP_OK;
    if (solver->holds_both && solver->call->r0 && solver->size <= PERP__POLISH_START_MOST)
        status = perp__contact_delassus(solver, &made);
    if (status != PERP_OK || !perp__contact_polish_suits(solver) || perp__contact_is_near(solver))
        return status;
    for (int32_t round = solver->call->r0 ? 0 : 1; round < 2 && status == PERP_OK; round++) {
        if (round > 0)
            status = sweep_roughly(solver);
        solver->running = PERP_CONTACT_METHOD_PROXIMAL;
        PERP__THEN(status, perp__contact_polish_start(solver));
        if (perp__is_good(solver->best.outcome) || solver->ended >= 0)
            break;
    }
    return status == PERP_OK ? check_abort(solver) : status;
}

static perp_status try_start(perp_contact_solver *solver)
{
    perp__contact_worth worth;
    perp_status status;

    read_start(solver);
    status = try_set(solver);
    if (status != PERP_OK || perp__is_good(solver->best.outcome))
        return status;
    read_start(solver);
    return perp__contact_consider(solver, PERP_CONTACT_METHOD_POLISH, NULL, &worth);
}

static void forget(perp_contact_solver *solver)
{
    solver->best.method = -1;
    solver->best.outcome = PERP_OUTCOME_ITERATION_LIMIT;
    solver->has_ray = 0;
    solver->certificate = PERP_CONTACT_CERTIFICATE_NONE;
    solver->ended = -1;
    solver->said = PERP_OUTCOME_ITERATION_LIMIT;
    solver->aborted = 0;
    solver->iterations = solver->polished = 0;
    for (int32_t k = 0; k < PERP__CONTACT_METHODS; k++)
        solver->slots[k].spent = 0;
}

/* No proof is looked for with a budget that is used up, or where there is none. */
static int32_t may_prove(perp_contact_solver *solver)
{
    return solver->proves && !ends_the_search(solver) && perp__contact_may_be_infeasible(solver) &&
           !(solver->settings.max_iterations > 0 && solver->said == PERP_OUTCOME_ITERATION_LIMIT);
}

/* What the methods did not solve together, part by part. */
static perp_status run_apart(perp_contact_solver *solver)
{
    perp__contact_worth worth;
    int32_t some = 0;
    perp_status status = perp__contact_solve_apart(solver, &some);

    check_clock(solver);
    return status == PERP_OK && some
               ? perp__contact_consider(solver, solver->running, solver->modes, &worth)
               : status;
}

/* Auto's last word on small problems with contacts that hold both ways: no path is sure to lead to
 * their answers. */
static perp_status search_sets(perp_contact_solver *solver)
{
    int32_t made = 0;
    perp_status status = PERP_OK;

    if (!solver->holds_both || solver->size > PERP__POLISH_SEARCH_MOST ||
        solver->settings.method != PERP_CONTACT_METHOD_AUTO || solver->settings.max_iterations != 0)
        return PERP_OK;
    status = perp__contact_delassus(solver, &made);
    solver->running = PERP_CONTACT_METHOD_PROXIMAL;
    if (status == PERP_OK && made)
        status = perp__contact_polish_search(solver);
    return status == PERP_OK ? check_abort(solver) : status;
}

/* Steps of a plan before its last resorts. */
enum { BRIEF = 2 };

static perp_status search(perp_contact_solver *solver)
{
    plan_step steps[PLAN_MOST];
    int32_t count = solver->settings.max_iterations < 0 ? 0 : plan(solver, steps), k;
    /* where it is cheap, the question whether there are any velocities at all comes early */
    const int32_t late = solver->constraints > EARLY_RAY;
    /* auto goes on with every part by itself as soon as what needs no more is solved */
    const int32_t apart = solver->settings.method == PERP_CONTACT_METHOD_AUTO ? 1 : count - 1;
    int32_t condensed = 0;
    perp_status status;

    if (solver->brief && count > BRIEF)
        count = BRIEF;
    forget(solver);
    status = perp__contact_load(solver);
    PERP__THEN(status, try_start(solver));
    if (status == PERP_OK && !ends_the_search(solver) && perp__contact_condenses(solver))
        status = perp__contact_solve_condensed(solver, &condensed);
    if (condensed && solver->brief) /* what is missing is not much, and joints hold */
        count = 0;
    for (k = 0; k < count && status == PERP_OK && !ends_the_search(solver); k++) {
        /* where sets were followed in vain from a start and from a few sweeps, more sweeps than
           those seldom come to an end, and take longer than what is next */
        if (k > 0 || !solver->call->r0 || !tries_sets(solver) ||
            !perp__contact_polish_suits(solver))
            status = run(solver, &steps[k]);
        if (status == PERP_OK && k == (late ? count - 1 : 0) && may_prove(solver))
            status = perp__contact_find_ray(solver);
        if (status == PERP_OK && k == apart && !ends_the_search(solver))
            status = run_apart(solver);
    }
    return status == PERP_OK && !ends_the_search(solver) ? search_sets(solver) : status;
}

/* What the search ended with. */
static perp_outcome last_word(const perp_contact_solver *solver)
{
    if (solver->certificate != PERP_CONTACT_CERTIFICATE_NONE ||
        (solver->has_ray && solver->settings.cone > 0))
        return PERP_OUTCOME_RAY;
    if (solver->ended >= 0)
        return solver->ended;
    return solver->said == PERP_OUTCOME_RAY ? PERP_OUTCOME_STALLED : solver->said; /* it was none */
}

/* Beside what the largest free velocity of its part would take to stop, how far an impulse is
 * likely to reach. */
#define REACH 16.0

static void find_reach(const perp_contact_solver *solver, double *reach)
{
    for (int32_t i = 0; i < solver->bounded.count; i++) {
        const int32_t k = solver->bounded.contact_of[i];
        const double drive = k < 0 ? 0.0 : REACH * solver->drive[solver->part[k]];

        reach[i] = drive > 0.0 ? drive / solver->root[k] : 0.0;
    }
}

/* Bounds that are far off are drawn in (bounded.h), by the free velocities at the impulses nearest
 * to 0. */
static perp_status draw_in(perp_contact_solver *solver, const perp__contact_call *given,
                           perp__contact_call *own)
{
    perp__contact_bounded *bounded = &solver->bounded;
    perp_status status;

    for (int32_t i = 0; i < bounded->count; i++)
        bounded->reach[i] = 0.0;
    perp__contact_bounded_draw_in(bounded);
    perp__contact_bounded_pose(bounded, given, own);
    solver->call = own;
    status = perp__contact_load(solver);
    if (status == PERP_OK) {
        find_reach(solver, bounded->reach);
        perp__copy(bounded->load, solver->load, solver->size);
    }
    return status;
}

/* Whether bounds that were drawn in are in the way; then they are further off. That no velocities
 * are possible is so wherever they are: a row with one bound has u of one sign, with two of any. */
static int32_t widen(perp_contact_solver *solver)
{
    perp__contact_bounded *bounded = &solver->bounded;
    const int32_t is_ray = solver->best.outcome == PERP_OUTCOME_RAY;

    if (is_ray && solver->certificate == PERP_CONTACT_CERTIFICATE_INFEASIBLE)
        return 0;
    find_reach(solver, bounded->likely);
    return perp__contact_bounded_widen(bounded, solver->best.r, solver->best.u, is_ray);
}

/* Whether bounds around its best point may serve better. */
static int32_t goes_on(const perp_contact_solver *solver)
{
    const perp_outcome outcome = solver->best.outcome;

    return outcome != PERP_OUTCOME_RAY && solver->ended != PERP_OUTCOME_STOPPED &&
           (perp__is_good(outcome) || solver->ended != PERP_OUTCOME_TIME_LIMIT);
}

/* With rows that have bounds: within such as are near, while these are those that count. */
static perp_status find_within(perp_contact_solver *solver, const perp__contact_call *given,
                               perp__contact_call *own, double deadline)
{
    perp__contact_bounded *bounded = &solver->bounded;
    const int32_t limit = solver->settings.max_iterations;
    const int32_t is_far = perp__contact_bounded_is_far(bounded);
    int64_t iterations = 0;
    int32_t again, narrowed = 0;
    perp_status status = is_far ? draw_in(solver, given, own) : PERP_OK;

    solver->is_far = is_far;
    do {
        if (status == PERP_OK && is_far) {
            perp__contact_bounded_draw_in(bounded);
            perp__copy(solver->bound, bounded->bound, solver->contacts);
        }
        perp__contact_bounded_pose(bounded, given, own);
        PERP__THEN(status, perp__contact_find(solver, own, deadline));
        iterations += status == PERP_OK ? solver->iterations : 0;
        if (limit > 0) /* what is left of it */
            solver->settings.max_iterations =
                limit > iterations ? (int32_t)(limit - iterations) : 1;
        again = status == PERP_OK && is_far && widen(solver);
        if (status == PERP_OK && is_far && !again && !narrowed && goes_on(solver))
            again = narrowed = perp__contact_bounded_narrow(bounded, solver->best.r);
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
    perp__contact_call given = *call, own;
    perp_status status = perp__contact_check_call(solver, call);
    double deadline;

    if (status != PERP_OK)
        return status;
    if (given.r0 &&
        perp__is_zero(given.r0, solver->bounded.count > 0 ? solver->bounded.size : solver->size))
        given.r0 = NULL; /* a start that knows nothing is none */
    own = given;
    solver->is_far = 0;
    deadline = solver->settings.time_limit > 0.0 ? started + solver->settings.time_limit : 0.0;
    status = solver->bounded.count > 0 ? find_within(solver, &given, &own, deadline)
                                       : perp__contact_find(solver, &own, deadline);
    if (status == PERP_OK && !call->holds_itself && (call->v || call->u)) /* nobody else asks */
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

    solver->call = call;
    solver->control.deadline = solver->deadline = deadline;
    solver->control.tick = perp__contact_tick;
    solver->control.patience = find_patience;
    solver->control.tick_user = solver;
    solver->problem.tol = solver->settings.tol;
    solver->problem.iteration_limit = solver->settings.max_iterations;
    solver->problem.cone = solver->settings.cone;
    status = search(solver);
    if (status == PERP_OK)
        solver->best.outcome = perp__contact_verdict(solver, &solver->best, last_word(solver));
    return status;
}
