/* The front door: scales, chooses, runs, recomputes every residual, polishes, falls through. */
#include "lcp/lcp.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"
#include "lcp/all/all.h"
#include "lcp/solver.h"

/* ---- the points that a solve meets, and the best of them ---- */

static void keep(perp_lcp_solver *solver, const perp__evaluation *worth, perp_outcome outcome,
                 int32_t method)
{
    size_t bytes = (size_t)solver->n * sizeof(double);

    memcpy(solver->best.z, solver->z, bytes);
    memcpy(solver->best.w, solver->w_high, bytes);
    solver->best.worth = *worth;
    solver->best.outcome = outcome;
    solver->best.method = method;
}

/* Sets solver->z and, scaled, solver->iterate to z0 (NULL: 0), projected onto the bounds. */
static void start_from(perp_lcp_solver *solver, const double *z0)
{
    for (int32_t i = 0; i < solver->n; i++) {
        const double z = perp__clamp(z0 ? z0[i] : 0.0, solver->lower[i], solver->upper[i]);

        solver->z[i] = z;
        solver->iterate[i] = z == solver->lower[i]
                                 ? solver->lower_scaled[i]
                                 : perp__clamp(perp__z_scaled(solver, i, z),
                                               solver->lower_scaled[i], solver->upper_scaled[i]);
    }
}

/* The method's point is beyond the range of doubles: the start is more modest, or else 0. */
static perp__evaluation fall_back(perp_lcp_solver *solver, const double *z0)
{
    perp__evaluation worth;

    start_from(solver, z0);
    worth = perp__evaluate(solver);
    if (!isfinite(worth.tested)) {
        start_from(solver, NULL);
        worth = perp__evaluate(solver);
    }
    return worth;
}

/* Whether a candidate takes the place of the best so far. A verified ray is an answer: only a
 * solution beats it. */
static int32_t is_better(const perp__candidate *best, const perp__evaluation *worth,
                         perp_outcome outcome)
{
    if (best->method < 0)
        return 1;
    if (perp__is_good(best->outcome) && outcome == best->outcome)
        return worth->backward < best->worth.backward;
    if (perp__is_good(best->outcome))
        return outcome == PERP_OUTCOME_SOLVED;
    return perp__is_good(outcome) ||
           (best->outcome != PERP_OUTCOME_RAY &&
            (outcome == PERP_OUTCOME_RAY || worth->tested < best->worth.tested));
}

static int32_t may_go_on(const perp_lcp_solver *solver)
{
    return solver->ended < 0 && solver->problem.tol > 1e-4 * solver->settings.tol;
}

/* Whether a point of a loose tolerance is there, or the method goes on from it, which costs less
 * than to polish what is unsettled. */
static int32_t is_rough_enough(const perp_lcp_solver *solver, const perp__evaluation *worth)
{
    return solver->settings.tol >= PERP__ROUGH_TOLERANCE && worth->tested <= solver->settings.tol &&
           may_go_on(solver);
}

perp_status perp__consider(perp_lcp_solver *solver, const perp__plan_step *step, perp_outcome said,
                           const perp__lcp_iterate *iterate, const double *z0)
{
    const int32_t is_polished =
        solver->settings.polish && said != PERP_OUTCOME_RAY && !step->rough && !iterate->far_off;
    perp__evaluation worth;
    perp_status status = PERP_OK;
    perp_outcome outcome;

    perp__find_product(solver);
    if (!is_polished || !perp__polish_correct(solver, &worth)) {
        worth = perp__evaluate_product(solver);
        if (!isfinite(worth.tested)) {
            worth = fall_back(solver, z0);
            said = PERP_OUTCOME_STALLED;
        }
        if (is_polished && isfinite(worth.tested) && !is_rough_enough(solver, &worth)) {
            if (!iterate->has_places)
                perp__read_places(solver, solver->places);
            status = perp__polish_run(solver, &worth);
            if (status != PERP_OK)
                return status;
        }
    }
    if (is_polished && worth.finite)
        perp__polish_hidden(solver, &worth);
    outcome = perp__lcp_judge(solver, &worth, said);
    solver->refused = worth.tested <= solver->settings.tol && !perp__is_good(outcome);
    if (is_better(&solver->best, &worth, outcome))
        keep(solver, &worth, outcome, step->method);
    return PERP_OK;
}

void perp__consider_point(perp_lcp_solver *solver, int32_t method, perp_outcome said)
{
    const perp__evaluation worth = perp__evaluate(solver);
    const perp_outcome outcome = perp__lcp_judge(solver, &worth, said);

    if (is_better(&solver->best, &worth, outcome))
        keep(solver, &worth, outcome, method);
}

/* Keeps a ray that stood the check. The last word on it comes after all attempts. */
static void keep_ray(perp_lcp_solver *solver)
{
    double largest;

    solver->rays++;
    solver->best_certificate =
        perp__ray_certificate(solver) ? PERP_CERTIFICATE_INFEASIBLE : PERP_CERTIFICATE_NONE;
    largest = perp__largest(solver->z, solver->n);
    for (int32_t i = 0; i < solver->n; i++)
        solver->best_ray[i] = solver->z[i] / largest;
}

/* A start that names the right active set solves the problem without any method. */
static perp_status try_start(perp_lcp_solver *solver, const double *z0)
{
    perp__evaluation worth;
    perp_outcome outcome;
    perp_status status;

    start_from(solver, z0);
    worth = perp__evaluate(solver);
    solver->correct = NULL;
    perp__read_places(solver, solver->places);
    status = perp__polish_run(solver, &worth);
    if (status != PERP_OK)
        return status;
    outcome = perp__lcp_judge(solver, &worth, PERP_OUTCOME_STALLED);
    if (perp__is_good(outcome))
        keep(solver, &worth, outcome, PERP_LCP_POLISH);
    return status;
}

/* A solve that failed returns the best point it met; the start is one of them, unless an index set
 * was solved as well as doubles can and the residual only tells how large the numbers are. */
static void consider_start(perp_lcp_solver *solver, const double *z0)
{
    perp__evaluation worth;

    start_from(solver, z0);
    worth = perp__evaluate(solver);
    if (worth.tested < solver->best.worth.tested &&
        !(solver->best.worth.backward <= 16.0 * DBL_EPSILON))
        keep(solver, &worth, perp__lcp_judge(solver, &worth, solver->best.outcome),
             solver->best.method);
}

/* ---- the search ---- */

/* A backward error that leaves nothing to gain; from what tolerance on nobody asks for it. */
#define PERP__EXACT (4.0 * DBL_EPSILON)
#define PERP__LOOSE 1e-8

static void present(perp_lcp_solver *solver, const perp__plan_step *step)
{
    perp__lcp_problem *p = &solver->problem;

    p->context = solver->context;
    p->n = solver->n;
    p->setup = solver->setups;
    p->M = &solver->M;
    p->factors = solver->factors;
    p->row_norms = solver->row_norms;
    p->q = solver->q_scaled;
    p->lower = solver->lower_scaled;
    p->upper = solver->upper_scaled;
    p->block = solver->M.column_starts ? &solver->block : NULL;
    p->settings = &solver->settings;
    p->tol = solver->settings.tol;
    p->iteration_limit = step->iteration_limit;
    p->leads = step->leads;
    p->control = &solver->control;
    solver->control.method = step->method;
    solver->control.deadline = solver->deadline;
    if (solver->deadline > 0.0 && step->share < 1.0)
        solver->control.deadline -= (1.0 - step->share) * solver->settings.time_limit;
}

static perp__method_slot *slot_of(perp_lcp_solver *solver, int32_t method)
{
    for (int32_t k = 0; k < PERP__METHODS; k++) {
        const perp__lcp_method *candidate = solver->slots[k].method;

        if (candidate->id == method && (!candidate->suits || candidate->suits(&solver->problem)))
            return &solver->slots[k];
    }
    return NULL;
}

int32_t perp__is_late(const perp_lcp_solver *solver)
{
    return solver->deadline > 0.0 && perp__now() > solver->deadline;
}

/* Remembers that the monitor or the clock ended the solve; not only a step's share of its time. */
static void note_end(perp_lcp_solver *solver, perp_outcome said)
{
    if (said == PERP_OUTCOME_STOPPED ||
        (said == PERP_OUTCOME_TIME_LIMIT && solver->control.deadline >= solver->deadline))
        solver->ended = said;
    else if (perp__is_late(solver))
        solver->ended = PERP_OUTCOME_TIME_LIMIT;
}

/* A step that has used up its share has reached a limit, but not the caller's. */
static perp_outcome own_limit(const perp_lcp_solver *solver, perp_outcome said)
{
    return said == PERP_OUTCOME_TIME_LIMIT && solver->ended < 0 ? PERP_OUTCOME_ITERATION_LIMIT
                                                                : said;
}

/* One run of a method, from start to candidate. */
static perp_status run_once(perp_lcp_solver *solver, perp__method_slot *slot,
                            const perp__plan_step *step, int32_t attempt, int32_t *paused,
                            int64_t *iterations, const double *z0)
{
    perp__lcp_iterate iterate = {.z = solver->iterate,
                                 .places = solver->places,
                                 .ray = solver->ray,
                                 .covering = solver->covering,
                                 .warm = z0 != NULL,
                                 .attempt = attempt,
                                 .rays = solver->rays};
    perp_status status;

    start_from(solver, z0);
    status = slot->method->solve(slot->space.work, &iterate);
    if (status == PERP_OK && solver->control.aborted)
        status = perp__fail(solver->context, PERP_ERROR_CALLBACK, "the monitor asked to abort");
    if (status != PERP_OK)
        return status;
    if (iterate.outcome == PERP_OUTCOME_RAY) {
        if (perp__ray_verify(solver))
            keep_ray(solver);
        else
            iterate.outcome = PERP_OUTCOME_STALLED;
    }
    for (int32_t i = 0; i < solver->n; i++) {
        solver->z[i] = perp__z_exact(solver, i, solver->iterate[i]);
        if (!isfinite(solver->z[i])) { /* a method that overflowed has no point to offer */
            start_from(solver, z0);
            iterate.outcome = PERP_OUTCOME_STALLED;
            iterate.has_places = 0;
            break;
        }
    }
    solver->correct = iterate.has_places ? iterate.correct : NULL;
    solver->correct_work = slot->space.work;
    note_end(solver, iterate.outcome);
    if (attempt + 1 == slot->method->attempts || solver->ended >= 0)
        iterate.far_off = 0;
    solver->improvable = iterate.improvable;
    status = perp__consider(solver, step, own_limit(solver, iterate.outcome), &iterate, z0);
    if (*paused && solver->best.method == step->method && !perp__is_good(solver->best.outcome)) {
        /* a pause was not the method's last word; only the gate says anything good */
        const perp_outcome last = own_limit(solver, iterate.outcome);

        solver->best.outcome = perp__is_good(last) ? PERP_OUTCOME_STALLED : last;
    }
    *paused = iterate.paused;
    *iterations = iterate.iterations;
    if (!iterate.paused)
        solver->spent += iterate.iterations;
    return status;
}

/* A method that stops where the first witness is content goes on from there where the second is
 * not, up to a hundredth and a ten-thousandth of tol, as far as its iterations reach. */
static int32_t goes_on(perp_lcp_solver *solver)
{
    if (!solver->refused || !may_go_on(solver))
        return 0;
    solver->problem.tol *= 1e-2;
    return 1;
}

/* What the step and the caller's budget leave for the next attempt; false if that is nothing. */
static int32_t has_iterations_left(perp_lcp_solver *solver, const perp__plan_step *step)
{
    const int64_t budget = solver->settings.max_iterations;
    int64_t *limit = &solver->problem.iteration_limit;

    *limit = step->iteration_limit;
    if (budget > 0 && (*limit <= 0 || *limit > budget - solver->spent))
        *limit = budget - solver->spent;
    if (budget <= 0 || *limit > 0)
        return 1;
    solver->ended = PERP_OUTCOME_ITERATION_LIMIT;
    return 0;
}

/* Solved, but not to the last digits, and the method may find them. */
static int32_t is_improvable(const perp_lcp_solver *solver)
{
    return solver->improvable && perp__is_good(solver->best.outcome) && solver->ended < 0 &&
           solver->best.worth.backward > PERP__EXACT && solver->settings.polish &&
           solver->settings.tol < PERP__LOOSE;
}

static int32_t ends_the_search(const perp_lcp_solver *solver)
{
    return perp__is_good(solver->best.outcome) || solver->ended >= 0 ||
           (solver->best.outcome == PERP_OUTCOME_RAY &&
            solver->best_certificate != PERP_CERTIFICATE_NONE);
}

/* A method with all its attempts. A ray that proves infeasibility ends them; any other is believed
 * only if another covering vector ends in a verified ray too. */
static perp_status run(perp_lcp_solver *solver, const perp__plan_step *step, const double *z0)
{
    perp__method_slot *slot;
    const double *start = z0;
    int32_t attempts, attempt = 0, paused = 0;
    int64_t iterations = 0;
    perp_status status;

    present(solver, step);
    slot = slot_of(solver, step->method);
    if (!slot)
        return perp__refuse(solver->context, "settings.method %s cannot take this problem",
                            perp_lcp_method_text(step->method));
    attempts = slot->method->attempts;
    status = slot->method->check ? slot->method->check(&solver->problem) : PERP_OK;
    PERP__THEN(status,
               perp__workspace_fit(&slot->space, solver->context, slot->method->work_size,
                                   slot->method->layout, &solver->problem,
                                   slot->method->by_shape ? solver->shape : solver->setups));
    if (solver->settings.pivot_rule == PERP_PIVOT_LEXICOGRAPHIC)
        attempts = 1;
    while (status == PERP_OK && has_iterations_left(solver, step)) {
        status = run_once(solver, slot, step, attempt, &paused, &iterations, start);
        start = z0;
        if (status == PERP_OK && !paused && goes_on(solver))
            start = solver->z;
        else if (status != PERP_OK || (ends_the_search(solver) && !is_improvable(solver)) ||
                 (solver->best.outcome == PERP_OUTCOME_RAY && solver->rays > 1) ||
                 (++attempt >= attempts && !paused))
            break;
    }
    if (paused)
        solver->spent += iterations;
    if (solver->best.outcome == PERP_OUTCOME_RAY && attempts > 1 && solver->rays < 2 &&
        solver->best_certificate == PERP_CERTIFICATE_NONE)
        solver->best.outcome = PERP_OUTCOME_STALLED;
    return status;
}

/* Looks at the structure of a sparse matrix, once a set-up. */
static perp_status read_block(perp_lcp_solver *solver)
{
    perp_status status;

    if (!solver->M.column_starts)
        return PERP_OK;
    perp__sparse_block_restart(&solver->block);
    if (solver->block_read == solver->setups)
        return PERP_OK;
    solver->block_read = 0;
    status = perp__sparse_block_read(&solver->block, &solver->M, solver->factors);
    if (status == PERP_OK)
        solver->block_read = solver->setups;
    return status;
}

/* Whether Lemke's method has ended in a ray that proves nothing, as it always does on games. */
static int32_t may_play(const perp_lcp_solver *solver)
{
    return solver->best.outcome == PERP_OUTCOME_RAY && !ends_the_search(solver) &&
           solver->settings.pivot_rule == PERP_PIVOT_HARRIS && perp__is_game(solver);
}

/* Lemke's method from each of Lemke and Howson's starts; any may be the one that does not end in a
 * ray. */
static perp_status play(perp_lcp_solver *solver)
{
    static const perp__plan_step lemke = {.method = PERP_LCP_LEMKE, .share = 1.0};
    perp_status status = PERP_OK;

    for (int32_t j = 0; j < solver->n && status == PERP_OK; j++) {
        if (!perp__game_start(solver, j))
            continue;
        status = run(solver, &lemke, solver->game_start);
        if (perp__is_good(solver->best.outcome) || solver->ended >= 0)
            break;
    }
    return status;
}

/* A point that a shorter way than the methods' has found, if the gate says that it solves. */
static int32_t keep_solved(perp_lcp_solver *solver, const perp__evaluation *worth, int32_t method)
{
    const perp_outcome outcome = perp__lcp_judge(solver, worth, PERP_OUTCOME_STALLED);

    if (outcome == PERP_OUTCOME_SOLVED)
        keep(solver, worth, outcome, method);
    return outcome == PERP_OUTCOME_SOLVED;
}

/* What needs no method, for `auto`: small problems and triangles. */
static int32_t try_shortest(perp_lcp_solver *solver, const double *z0)
{
    perp__evaluation worth;

    solver->control.method = PERP_LCP_LEMKE;
    if (solver->settings.method != PERP_LCP_AUTO || perp__is_late(solver) ||
        perp__lcp_tick(&solver->control, 1, INFINITY) >= 0)
        return 0; /* which the methods will find, too */
    if (perp__small_solve(solver, z0, &worth) &&
        keep_solved(solver, &worth, z0 && solver->spent == 0 ? PERP_LCP_POLISH : PERP_LCP_LEMKE))
        return 1;
    solver->spent = 1;
    return perp__triangle_solve(solver, &worth) && keep_solved(solver, &worth, PERP_LCP_PGS);
}

static perp_status search(perp_lcp_solver *solver, const double *z0)
{
    perp__plan_step steps[PERP__PLAN_MOST];
    int32_t count;
    perp_status status;

    solver->best.method = -1;
    solver->best_certificate = PERP_CERTIFICATE_NONE;
    solver->rays = 0;
    solver->ended = -1;
    if (try_shortest(solver, z0))
        return PERP_OK;
    solver->spent = 0;
    status = read_block(solver);
    if (status == PERP_OK && solver->settings.polish)
        status = perp__polish_fit(solver);
    if (status == PERP_OK && z0 && solver->settings.polish &&
        (solver->settings.method == PERP_LCP_AUTO || solver->settings.method == PERP_LCP_LEMKE))
        status = try_start(solver, z0);
    if (status != PERP_OK || solver->best.method >= 0)
        return status;
    count = perp__make_plan(solver, steps);
    for (int32_t k = 0; k < count && status == PERP_OK; k++) {
        status = run(solver, &steps[k], z0);
        if (status == PERP_OK && steps[k].method == PERP_LCP_LEMKE && may_play(solver))
            status = play(solver);
        if (status == PERP_OK && ends_the_search(solver))
            break; /* a ray that proves nothing leaves the next method its chance */
    }
    if (status == PERP_OK && perp__has_last_word(solver) && !ends_the_search(solver))
        status = perp__last_word(solver);
    if (status == PERP_OK && solver->settings.method == PERP_LCP_AUTO && !ends_the_search(solver))
        status = perp__solve_apart(solver, z0);
    if (status == PERP_OK && !perp__is_good(solver->best.outcome) &&
        solver->best.outcome != PERP_OUTCOME_RAY) {
        if (solver->ended >= 0)
            solver->best.outcome = solver->ended;
        consider_start(solver, z0);
    }
    return status;
}

static perp_status check_call(perp_lcp_solver *solver, const double *z,
                              const perp_lcp_result *result, const double *q, const double *z0)
{
    perp_context *context = solver->context;
    perp_status status;

    if (!solver->setups)
        return perp__refuse(context,
                            "the solver has no problem yet: call perp_lcp_solver_setup first");
    status = PERP__CHECK(perp_lcp_result, context, result);
    if (status == PERP_OK && solver->n > 0)
        status = perp__check_pointer(context, "z", z);
    PERP__THEN(status, perp__check_vector(context, "q", q, (size_t)solver->n));
    PERP__THEN(status, perp__check_finite(context, "z0", z0, (size_t)solver->n));
    return status;
}

static void write_out(perp_lcp_solver *solver, double *z, double *w, double *ray,
                      perp_lcp_result *result, double seconds)
{
    size_t bytes = (size_t)solver->n * sizeof(double);
    perp_lcp_result own = {.outcome = solver->best.outcome,
                           .method = solver->best.method,
                           .iterations = solver->spent,
                           .residual = perp__told(solver->best.worth.tested),
                           .natural_residual = perp__told(solver->best.worth.natural),
                           .backward_error = perp__told(solver->best.worth.backward),
                           .seconds = seconds};

    if (own.outcome == PERP_OUTCOME_RAY) {
        own.has_ray = 1;
        own.certificate = solver->best_certificate;
        if (ray && solver->n > 0)
            memcpy(ray, solver->best_ray, bytes);
    }
    if (solver->n > 0) {
        memcpy(z, solver->best.z, bytes);
        if (w)
            memcpy(w, solver->best.w, bytes);
    }
    perp__struct_write(result, &own, sizeof own);
}

perp_status perp__lcp_solve(perp_lcp_solver *solver, double *z, double *w, double *ray,
                            perp_lcp_result *result, const double *q, const double *z0)
{
    double started = perp__now();
    perp_status status = check_call(solver, z, result, q, z0);

    if (status != PERP_OK)
        return status;
    perp__scale_problem(solver, q);
    memset(&solver->control, 0, sizeof solver->control);
    solver->control.monitor = solver->settings.monitor;
    solver->control.monitor_user = solver->settings.monitor_user;
    solver->deadline =
        solver->settings.time_limit > 0.0 ? started + solver->settings.time_limit : 0.0;
    solver->control.deadline = solver->deadline;
    status = search(solver, z0);
    if (status == PERP_OK)
        write_out(solver, z, w, ray, result, perp__now() - started);
    return status;
}
