/* The front door: scales, chooses, runs, recomputes every residual, polishes, falls through. */
#include "lcp/lcp.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"
#include "lcp/all/all.h"
#include "lcp/solver.h"
#include "linalg/lanes/loops.h"

/* ---- the points that a solve meets, and the best of them ---- */

static void keep(perp_lcp_solver *solver, const perp__evaluation *residuals, perp_outcome outcome,
                 int32_t method)
{
    size_t bytes = (size_t)solver->n * sizeof(double);

    memcpy(solver->best.z, solver->z, bytes);
    memcpy(solver->best.w, solver->w_high, bytes);
    solver->best.residuals = *residuals;
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

/* Whether a point of this worth and outcome takes the place of the best one. A verified ray is an
 * answer, too: only a solution beats it. */
static bool is_better(const perp__candidate *best, const perp__evaluation *residuals,
                      perp_outcome outcome)
{
    if (best->method < 0)
        return 1;
    if (perp__is_good(best->outcome) && outcome == best->outcome)
        return residuals->backward < best->residuals.backward;
    if (perp__is_good(best->outcome))
        return outcome == PERP_OUTCOME_SOLVED;
    return perp__is_good(outcome) ||
           (best->outcome != PERP_OUTCOME_RAY &&
            (outcome == PERP_OUTCOME_RAY || residuals->tested < best->residuals.tested));
}

static bool may_go_on(const perp_lcp_solver *solver)
{
    return solver->ended < 0 && solver->problem.tol > 1e-4 * solver->settings.tol;
}

perp_status perp__consider(perp_lcp_solver *solver, const perp__plan_step *step, perp_outcome said,
                           const perp__lcp_iterate *iterate, const double *z0)
{
    const bool is_polished = solver->settings.polish && said != PERP_OUTCOME_RAY && !step->rough &&
                             !iterate->far_off && !perp__is_past(solver->deadline);
    const double tol = solver->settings.tol;
    perp__evaluation residuals;
    perp_status status = PERP_OK;
    perp_outcome outcome;

    perp__find_product(solver);
    if (!is_polished || !perp__polish_correct(solver, &residuals)) {
        residuals = perp__evaluate_product(solver);
        /* 1. In place of a point whose residual is no double comes the start, or else 0. */
        for (int32_t k = 0; k < 2 && !isfinite(residuals.tested); k++) {
            start_from(solver, k == 0 ? z0 : NULL);
            residuals = perp__evaluate(solver);
            said = PERP_OUTCOME_STALLED;
        }
        /* 2. The polish. It is left out where a loose tolerance is met already and the method may
         * still go on to a smaller residual. */
        if (is_polished && isfinite(residuals.tested) &&
            !(tol >= PERP__ROUGH_TOLERANCE && residuals.tested <= tol && may_go_on(solver))) {
            if (!iterate->has_places)
                perp__read_places(solver, solver->places);
            /* the polish may make a good point worse: that is kept before */
            outcome = perp__lcp_outcome_of(solver, &residuals, said);
            if (perp__is_good(outcome) && is_better(&solver->best, &residuals, outcome))
                keep(solver, &residuals, outcome, step->method);
            status = perp__polish_run(solver, &residuals, perp__is_good(outcome));
            if (status != PERP_OK)
                return status;
        }
    }
    outcome = perp__lcp_outcome_of(solver, &residuals, said);
    solver->refused = residuals.tested <= tol && !perp__is_good(outcome);
    if (is_better(&solver->best, &residuals, outcome))
        keep(solver, &residuals, outcome, step->method);
    return PERP_OK;
}

void perp__consider_point(perp_lcp_solver *solver, int32_t method, perp_outcome said)
{
    const perp__evaluation residuals = perp__evaluate(solver);
    const perp_outcome outcome = perp__lcp_outcome_of(solver, &residuals, said);

    if (is_better(&solver->best, &residuals, outcome))
        keep(solver, &residuals, outcome, method);
}

/* ---- stop requests ---- */

void perp__open_control(perp_lcp_solver *solver, double started)
{
    solver->deadline = solver->settings.time_limit;
    solver->deadline += solver->deadline > 0.0 ? started : 0.0;
    solver->control = (perp__lcp_control){.monitor = solver->settings.monitor,
                                          .monitor_user = solver->settings.monitor_user,
                                          .deadline = solver->deadline};
}

perp_outcome perp__lcp_tick(perp__lcp_control *control, int64_t iterations, double residual)
{
    if (control->monitor) {
        const perp_lcp_progress progress = {.struct_size = sizeof progress,
                                            .method = control->method,
                                            .iterations = iterations,
                                            .residual = residual};
        const int32_t answer = control->monitor(&progress, control->monitor_user);

        if (answer < 0)
            control->aborted = 1;
        if (answer != 0)
            return PERP_OUTCOME_STOPPED;
    }
    return perp__is_past(control->deadline) ? PERP_OUTCOME_TIME_LIMIT : -1;
}

bool perp__lcp_has_time(perp__lcp_control *control, double residuals)
{
    if (!control || control->deadline == 0.0 ||
        perp__now() + control->residual * residuals <= control->deadline)
        return 1;
    control->late = 1;
    return 0;
}

void perp__lcp_sweep(const perp__lcp_problem *p, double *z, double *w)
{
    for (int32_t j = 0; j < p->n; j++) {
        const double before = z[j];
        const perp__line column = perp__line_of(p->M, j);
        double diagonal = perp__entry(p->M, j, j), step;

        if (!(diagonal > 0.0))
            diagonal = p->row_norms[j] > 0.0 ? p->row_norms[j] : 1.0;
        z[j] = perp__clamp(before - w[j] / diagonal, p->lower[j], p->upper[j]);
        step = before - z[j];
        if (step != 0.0 && !p->M->column_starts)
            perp__loops_gemv_subtract(p->n, 1, column.values, p->n, &step, 1, w);
        for (int32_t i = 0; i < column.count && step != 0.0 && p->M->column_starts; i++)
            w[column.indices[i]] -= step * column.values[i];
    }
}

/* ---- the search ---- */

/* The time, in units of what computing one residual takes, of judging the last point and the start
 * at the end of a solve, or of reading M into a method's own form. */
#define RESIDUALS 4.0

/* Keeps solver->ray if it stands the check. */
static bool keep_ray(perp_lcp_solver *solver)
{
    double largest;

    if (!perp__ray_verify(solver))
        return 0;
    solver->rays++;
    solver->best_certificate = !perp__is_past(solver->deadline) && perp__ray_certificate(solver)
                                   ? PERP_CERTIFICATE_INFEASIBLE
                                   : PERP_CERTIFICATE_NONE;
    largest = perp__largest(solver->z, solver->n);
    for (int32_t i = 0; i < solver->n; i++)
        solver->best_ray[i] = solver->z[i] / largest;
    return 1;
}

/* The problem as the step's method sees it, and the method's slot. */
static perp__method_slot *pose(perp_lcp_solver *solver, const perp__plan_step *step)
{
    perp__lcp_problem *p = &solver->problem;
    perp__method_slot *slot = solver->slots;

    p->context = solver->context;
    p->n = solver->n;
    p->setup = solver->setups;
    p->M = &solver->S;
    p->caller = &solver->M;
    p->row_norms = solver->row_norms;
    p->q = solver->q_scaled;
    p->lower = solver->lower_scaled;
    p->upper = solver->upper_scaled;
    p->block = &solver->block;
    p->settings = &solver->settings;
    p->tol = solver->settings.tol;
    p->iteration_limit = step->iteration_limit;
    p->yields = step->yields;
    p->control = &solver->control;
    solver->control.method = step->method;
    solver->control.deadline = solver->deadline;
    if (solver->deadline > 0.0 && step->share < 1.0)
        solver->control.deadline -= (1.0 - step->share) * solver->settings.time_limit;
    while (slot->method->id != step->method)
        slot++;
    return slot;
}

/* Where a step has used up its share of the time, that is a limit of ours and not the caller's. */
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
                                 .missing = z0 == solver->game_start ? solver->missing : -1,
                                 .attempt = attempt,
                                 .rays = solver->rays,
                                 .outcome = PERP_OUTCOME_TIME_LIMIT};
    perp_status status = PERP_OK;

    start_from(solver, z0);
    if (perp__lcp_has_time(&solver->control, RESIDUALS))
        status = slot->method->solve(slot->space.work, &iterate);
    if (status == PERP_OK && solver->control.aborted)
        status = perp__fail(solver->context, PERP_ERROR_CALLBACK, "the monitor asked to abort");
    if (status != PERP_OK)
        return status;
    /* 1. The ray, and the point in the caller's units. */
    if (iterate.outcome == PERP_OUTCOME_RAY && !keep_ray(solver))
        iterate.outcome = PERP_OUTCOME_STALLED;
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
    /* 2. Whether the monitor or the clock ended the solve; not only a step's share of its time. */
    if (iterate.outcome == PERP_OUTCOME_STOPPED)
        solver->ended = PERP_OUTCOME_STOPPED;
    else if (perp__is_past(solver->deadline))
        solver->ended = PERP_OUTCOME_TIME_LIMIT;
    /* 3. The candidate. */
    if ((attempt + 1 == slot->method->attempts && !step->yields) || solver->ended >= 0)
        iterate.far_off = 0;
    solver->improvable = iterate.improvable;
    status = perp__consider(solver, step, own_limit(solver, iterate.outcome), &iterate, z0);
    if (*paused && solver->best.method == step->method && !perp__is_good(solver->best.outcome)) {
        /* A pause is not the method's last word. What it says of itself is no verdict: only the
         * gate calls a point good. */
        solver->best.outcome = perp__is_good(iterate.outcome) ? PERP_OUTCOME_STALLED
                                                              : own_limit(solver, iterate.outcome);
    }
    *paused = iterate.paused;
    *iterations = iterate.iterations;
    if (!iterate.paused)
        solver->spent += iterate.iterations;
    return status;
}

static bool ends_the_search(const perp_lcp_solver *solver)
{
    return perp__is_good(solver->best.outcome) || solver->ended >= 0 ||
           (solver->best.outcome == PERP_OUTCOME_RAY &&
            solver->best_certificate != PERP_CERTIFICATE_NONE);
}

/* All attempts. A ray that proves nothing is believed if another covering vector ends in one. */
static perp_status run(perp_lcp_solver *solver, const perp__plan_step *step, const double *z0)
{
    const perp_lcp_settings *settings = &solver->settings;
    perp__method_slot *slot = pose(solver, step);
    const double *start = z0;
    int32_t attempts, attempt = 0, paused = 0, goes_on = 1;
    int64_t iterations = 0;
    perp_status status;

    attempts = settings->pivot_rule == PERP_PIVOT_LEXICOGRAPHIC ? 1 : slot->method->attempts;
    status = slot->method->check ? slot->method->check(&solver->problem) : PERP_OK;
    PERP__THEN(status,
               perp__workspace_fit(&slot->space, solver->context, slot->method->work_size,
                                   slot->method->layout, &solver->problem,
                                   slot->method->by_shape ? solver->shape : solver->setups));
    while (status == PERP_OK && goes_on) {
        int64_t *limit = &solver->problem.iteration_limit;

        /* 1. What the step and the caller's budget leave. */
        *limit = step->iteration_limit;
        if (settings->max_iterations > 0 &&
            (*limit <= 0 || *limit > settings->max_iterations - solver->spent))
            *limit = settings->max_iterations - solver->spent;
        if (settings->max_iterations > 0 && *limit <= 0) {
            solver->ended = PERP_OUTCOME_ITERATION_LIMIT;
            break;
        }
        status = run_once(solver, slot, step, attempt, &paused, &iterations, start);
        start = z0;
        if (status != PERP_OK)
            break;
        if (!paused && solver->refused && may_go_on(solver)) {
            /* 2. The second witness is not content: on from there, to tol / 100 and / 10,000. */
            solver->problem.tol *= 1e-2;
            start = solver->z;
        } else {
            /* 3. Solved, but not to the last digits, and the method may find them; or failed. */
            const bool is_improvable = solver->improvable && perp__is_good(solver->best.outcome) &&
                                       solver->ended < 0 &&
                                       solver->best.residuals.backward > PERP__EXACT &&
                                       settings->polish && settings->tol < PERP__ROUGH_TOLERANCE;

            goes_on = (!ends_the_search(solver) || is_improvable) &&
                      !(step->method == PERP_LCP_LEMKE && /* two say nothing of other methods */
                        solver->best.outcome == PERP_OUTCOME_RAY && solver->rays > 1) &&
                      (++attempt < attempts || paused);
        }
    }
    if (paused)
        solver->spent += iterations;
    if (solver->best.outcome == PERP_OUTCOME_RAY && attempts > 1 && solver->rays < 2 &&
        solver->best_certificate == PERP_CERTIFICATE_NONE)
        solver->best.outcome = PERP_OUTCOME_STALLED;
    return status;
}

/* Starts for two players' games. From z = 0 every covering vector leads to a ray there at once:
 * nothing falls where z_i grows and M_ii = 0. Lemke and Howson ("Equilibrium points of bimatrix
 * games", J. SIAM 12 (1964) 413) begin where player one takes strategy j alone, and as much of it
 * as the other's costs need, and player two the one strategy that answers it. */

/* Whether M >= 0 has a zero diagonal, z >= 0 and q < 0: two players' costs, for one LCP. */
static bool is_game(const perp_lcp_solver *solver)
{
    perp__cursor c = perp__first(&solver->M);
    bool game = 1;

    for (int32_t i = 0; i < solver->n && game; i++)
        game = solver->q[i] < 0.0 && solver->lower[i] == 0.0 && solver->upper[i] == INFINITY;
    while (game && perp__advance(&c))
        game = c.i == c.j ? c.value == 0.0 : c.value >= 0.0;
    return game;
}

/* Which s limits z_j from below where all rows that it can lift, w_s = M_sj z_j + q_s >= 0, are to
 * be lifted by it alone: *z is the least such z_j. -1: none is lifted. */
static int32_t last_lifted(const perp_lcp_solver *solver, int32_t j, double *z)
{
    int32_t found = -1;

    *z = 0.0;
    for (int32_t s = 0; s < solver->n; s++) {
        const double entry = perp__entry(&solver->M, s, j);

        if (entry > 0.0 && -solver->q[s] > *z * entry) {
            *z = -solver->q[s] / entry;
            found = s;
        }
    }
    return found;
}

/* game_start := the point that strategy j gives; false if none. */
static bool find_game_start(perp_lcp_solver *solver, int32_t j)
{
    double first, second;
    const int32_t s = last_lifted(solver, j, &first);

    if (s < 0 || last_lifted(solver, s, &second) < 0)
        return 0;
    memset(solver->game_start, 0, (size_t)solver->n * sizeof *solver->game_start);
    solver->missing = j;
    solver->game_start[j] = first;
    solver->game_start[s] = second;
    return 1;
}

/* Lemke's method from each of Lemke and Howson's starts, and from z = 0 where there are none. */
static perp_status play(perp_lcp_solver *solver, const perp__plan_step *step)
{
    /* a path from such a start is as long as any, not as one from next to the solution */
    const perp__plan_step lemke = {
        .method = PERP_LCP_LEMKE, .share = 1.0, .iteration_limit = 200 + 50 * (int64_t)solver->n};
    perp_status status = PERP_OK;

    for (int32_t j = 0; j < solver->n && status == PERP_OK && !ends_the_search(solver); j++)
        if (find_game_start(solver, j))
            status = run(solver, &lemke, solver->game_start);
    if (status == PERP_OK && solver->best.method < 0)
        status = run(solver, step, NULL);
    return status;
}

/* With a limit: a product with a vector without zeros tells what a residual takes; those of the end
 * are taken off. Returns 0 if there is no time for anything else. */
static bool keep_time(perp_lcp_solver *solver)
{
    const double begun = perp__now();

    if (solver->deadline == 0.0 || begun > solver->deadline)
        return solver->deadline == 0.0;
    if (begun + RESIDUALS * (begun - solver->deadline + solver->settings.time_limit) >
        solver->deadline)
        return 0; /* a residual takes as long as reading and scaling M did */
    for (int32_t i = 0; i < solver->n; i++)
        solver->z[i] = 1.0;
    perp__multiply_doubled(&solver->wide, solver->z, solver->q, solver->w_high, solver->w_low);
    solver->control.residual = perp__now() - begun;
    solver->deadline -= RESIDUALS * solver->control.residual;
    return !perp__is_past(solver->deadline);
}

/* Small problems, and starts with the right index set. best.method says what solved it. */
static perp_status try_without_method(perp_lcp_solver *solver, const double *z0)
{
    const int32_t method = solver->settings.method;
    perp__evaluation residuals;
    perp_outcome outcome;
    perp_status status = PERP_OK;

    /* 1. The shortest way; a monitor that ends it ends the methods, too. */
    solver->control.method = PERP_LCP_LEMKE;
    if (method == PERP_LCP_AUTO && !perp__is_past(solver->deadline) &&
        perp__lcp_tick(&solver->control, 1, INFINITY) < 0 &&
        perp__small_solve(solver, z0, &residuals)) {
        outcome = perp__lcp_outcome_of(solver, &residuals, PERP_OUTCOME_STALLED);
        if (outcome == PERP_OUTCOME_SOLVED) {
            keep(solver, &residuals, outcome,
                 z0 && solver->spent == 0 ? PERP_LCP_POLISH : PERP_LCP_LEMKE);
            return PERP_OK;
        }
    }
    /* 2. What all others need: the time to tell what a point is worth, the scaled matrix and
     * its structure, once a set-up. */
    solver->spent = 0;
    if (!keep_time(solver)) {
        solver->ended = PERP_OUTCOME_TIME_LIMIT;
        start_from(solver, z0);
        residuals = perp__evaluate(solver);
        keep(solver, &residuals, perp__lcp_outcome_of(solver, &residuals, PERP_OUTCOME_TIME_LIMIT),
             method == PERP_LCP_AUTO ? PERP_LCP_POLISH : method);
        return PERP_OK;
    }
    status = perp__read_block(solver);
    if (status == PERP_OK && solver->settings.polish)
        status = perp__polish_fit(solver);
    /* 3. The index set of the start. */
    if (status == PERP_OK && z0 && solver->settings.polish &&
        (method == PERP_LCP_AUTO || method == PERP_LCP_LEMKE)) {
        start_from(solver, z0);
        residuals = perp__evaluate(solver);
        solver->correct = NULL;
        perp__read_places(solver, solver->places);
        outcome = perp__lcp_outcome_of(solver, &residuals, PERP_OUTCOME_STALLED);
        status = perp__polish_run(solver, &residuals, perp__is_good(outcome));
        outcome = perp__lcp_outcome_of(solver, &residuals, PERP_OUTCOME_STALLED);
        if (status == PERP_OK && perp__is_good(outcome))
            keep(solver, &residuals, outcome, PERP_LCP_POLISH);
    }
    return status;
}

static perp_status search(perp_lcp_solver *solver, const double *z0)
{
    perp__plan_step steps[PERP__PLAN_MOST];
    int32_t count;
    perp_status status;

    solver->best.method = -1;
    solver->best.outcome = PERP_OUTCOME_STALLED;
    solver->best_certificate = PERP_CERTIFICATE_NONE;
    solver->rays = 0;
    solver->ended = -1;
    /* 1. What needs no method. */
    status = try_without_method(solver, z0);
    if (status != PERP_OK || solver->best.method >= 0)
        return status;
    /* 2. The plan's methods; a ray that proves nothing leaves the next one its chance. */
    count = perp__make_plan(solver, steps);
    for (int32_t k = 0; k < count && status == PERP_OK; k++) {
        const bool plays = steps[k].method == PERP_LCP_LEMKE &&
                           solver->settings.pivot_rule == PERP_PIVOT_HARRIS && is_game(solver);

        if (steps[k].as_lu)
            status = perp__sparse_block_lu_cost(&solver->block, &steps[k].iteration_limit);
        if (!plays || z0)
            PERP__THEN(status, run(solver, &steps[k], z0));
        if (plays && !ends_the_search(solver))
            PERP__THEN(status, play(solver, &steps[k]));
        if (ends_the_search(solver))
            break;
    }
    /* 3. Its parts, or the tree of index sets. */
    if (status == PERP_OK && solver->settings.method == PERP_LCP_AUTO && !ends_the_search(solver))
        status = perp__solve_apart(solver);
    if (status == PERP_OK && perp__has_last_word(solver) && !ends_the_search(solver))
        status = perp__last_word(solver);
    /* 4. A solve that failed returns the best point it met; the start is one of them, unless an
     * index set was solved as well as doubles can. */
    if (status == PERP_OK && !perp__is_good(solver->best.outcome) &&
        solver->best.outcome != PERP_OUTCOME_RAY) {
        perp__evaluation residuals;

        if (solver->ended < 0 && (solver->block.late || solver->control.late))
            solver->ended = PERP_OUTCOME_TIME_LIMIT;
        if (solver->ended >= 0)
            solver->best.outcome = solver->ended;
        start_from(solver, z0);
        residuals = perp__evaluate(solver);
        if (residuals.tested < solver->best.residuals.tested &&
            !(solver->best.residuals.backward <= PERP__ROUNDING_LIMIT))
            keep(solver, &residuals, perp__lcp_outcome_of(solver, &residuals, solver->best.outcome),
                 solver->best.method);
    }
    return status;
}

perp_status perp__lcp_solve(perp_lcp_solver *solver, double *z, double *w, double *ray,
                            perp_lcp_result *result, const double *q, const double *z0)
{
    const double started = perp__now();
    const size_t n = (size_t)solver->n, bytes = n * sizeof(double);
    const perp__candidate *best = &solver->best;
    perp_context *context = solver->context;
    perp_lcp_result copy = {0};
    perp_status status;

    /* 1. What the caller gave. */
    if (!solver->setups)
        return perp__refuse(context,
                            "the solver has no problem yet: call perp_lcp_solver_setup first");
    status = PERP__CHECK(perp_lcp_result, context, result);
    if (status == PERP_OK && n > 0)
        status = perp__check_pointer(context, "z", z);
    PERP__THEN(status, perp__check_vector(context, "q", q, n));
    PERP__THEN(status, perp__check_finite(context, "z0", z0, n));
    if (status != PERP_OK)
        return status;
    /* 2. The solve. */
    perp__scale_problem(solver, q);
    perp__open_control(solver, started);
    status = search(solver, z0);
    if (status != PERP_OK)
        return status;
    /* 3. Its answer. */
    copy.outcome = best->outcome;
    copy.method = best->method;
    copy.iterations = solver->spent;
    copy.residual = perp__told(best->residuals.tested);
    copy.natural_residual = perp__told(best->residuals.natural);
    copy.backward_error = perp__told(best->residuals.backward);
    copy.has_ray = copy.outcome == PERP_OUTCOME_RAY;
    copy.certificate = copy.has_ray ? solver->best_certificate : PERP_CERTIFICATE_NONE;
    if (copy.has_ray && ray && n > 0)
        memcpy(ray, solver->best_ray, bytes);
    if (n > 0)
        memcpy(z, best->z, bytes);
    if (w && n > 0)
        memcpy(w, best->w, bytes);
    for (size_t i = 0; i < n && solver->is_turned; i++) { /* Farkas' vector is one of rows */
        if (solver->signs[i] < 0 && w)
            w[i] = 0.0 - w[i];
        if (solver->signs[i] < 0 && ray && copy.certificate != PERP_CERTIFICATE_NONE)
            ray[i] = 0.0 - ray[i];
    }
    copy.seconds = perp__now() - started;
    perp__struct_write(result, &copy, sizeof copy);
    return PERP_OK;
}
