/* The front door: checks, runs methods from the start and from perturbations of it, judges, and
 * reports. No method grades itself. */
#include "ncp/solver.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/groups.h"
#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"
#include "base/random.h"
#include "linalg/signs.h"
#include "linalg/sparse_block.h"

/* ---- where a method begins: at the caller's start, near it where F is not defined there, and at
 * perturbations of it from a generator with a fixed seed ---- */

/* start := z0, or near it where F is not defined there. PERP_OK, PERP__NCP_OUTSIDE or _CALLBACK. */
static perp_status find_start(perp_ncp_solver *solver, const double *z0)
{
    perp__ncp_model *m = &solver->model;
    const double deadline = m->control.deadline;
    double unit = 0.0;
    perp_status status;

    solver->random = PERP__GOLDEN;
    for (int32_t i = 0; i < m->n; i++) {
        solver->start[i] = perp__clamp(z0 ? z0[i] : 0.0, m->lower[i], m->upper[i]);
        unit = fmax(unit, fabs(solver->start[i]));
        m->largest[i] = m->z_start[i] =
            fabs(solver->start[i]); /* a move away says nothing of them */
    }
    unit = unit > 0.0 ? unit : 1.0;
    m->control.deadline = 0.0; /* one call of F, come what may */
    status = perp__ncp_call(m, solver->start, m->w_caller);
    m->control.deadline = deadline;
    /* of sizes up to the root of what rounding leaves, and its inverse */
    for (int32_t k = 0; k < DBL_MANT_DIG && status == PERP__NCP_OUTSIDE; k++) {
        const double size = ldexp(unit, k % 2 == 0 ? k / 2 : -(k + 1) / 2); /* 1, 1/2, 2, ... */

        /* off its bounds by about that, elsewhere at random */
        for (int32_t i = 0; i < m->n; i++) {
            const double z = solver->start[i], half = 0.5 * (m->upper[i] - m->lower[i]);
            const double random = perp__draw(&solver->random);
            double shift = size * (0.75 + 0.25 * random);

            if (z == m->upper[i] || (z > m->lower[i] && random < 0.0))
                shift = -shift;
            solver->candidate[i] =
                perp__clamp(z + copysign(fmin(fabs(shift), half), shift), m->lower[i], m->upper[i]);
        }
        status = perp__ncp_call(m, solver->candidate, m->w_caller);
        if (status == PERP_OK)
            memcpy(solver->start, solver->candidate, (size_t)m->n * sizeof(double));
    }
    m->start_known = 0;
    perp__ncp_start_groups(m);
    return status;
}

/* ---- a system that falls into independent parts, one part after the other: what one line search
 * could not bring down together is solved part by part, as each would be by itself ---- */

#define MOST_PARTS 64 /* a run for one of them looks at all */

/* Fixes all variables but those of part p (-1: none) at the best that is known of them; forgets the
 * best point. candidate := the best of all parts. */
static void hold_others(perp_ncp_solver *solver, int32_t p)
{
    perp__ncp_model *m = &solver->model;
    const perp__ncp_parts *parts = &solver->parts;

    for (int32_t i = 0; i < m->n; i++) {
        const bool held = p >= 0 && parts->of[i] != p;

        m->lower[i] = held ? parts->z[i] : parts->lower[i];
        m->upper[i] = held ? parts->z[i] : parts->upper[i];
        solver->start[i] = held ? parts->z[i] : parts->start[i];
    }
    memcpy(solver->candidate, parts->z, (size_t)m->n * sizeof(double));
    m->colours.known = 0; /* the columns of what is held are left out */
    solver->best_method = -1;
}

/* ---- runs ---- */

#define ITERATIONS 200 /* the default limit of a run; half of it of the first method under auto */
#define FRUITLESS 20   /* iterations of that one that have to gain a digit, of large problems */
/* What all restarts of a call may take by default: as much as three runs of each method that find
 * nothing. Those that find something take few; of a problem without a solution all take all. */
#define RESTART_ITERATIONS (6 * ITERATIONS)

static perp_outcome verdict(const perp_ncp_solver *solver, const perp__ncp_residuals *residuals)
{
    return perp__gate(&residuals->evidence, solver->settings.tol, residuals->said);
}

static bool is_good(const perp_ncp_solver *solver)
{
    return solver->best_method >= 0 && perp__is_good(verdict(solver, &solver->best));
}

/* The largest of what speaks against a point. */
static double objection(const perp__ncp_residuals *residuals)
{
    return fmax(fmax(residuals->evidence.tested, residuals->evidence.own_residual),
                residuals->at_start);
}

static void keep(perp_ncp_solver *solver, const perp__ncp_residuals *residuals)
{
    solver->best = *residuals;
    perp__copy(solver->best_z, solver->candidate, solver->model.n);
    perp__copy(solver->best_w, solver->model.w_caller, solver->model.n);
}

/* What the natural map shows at a bound is that bound: the last digits of an answer. Where J is as
 * good as 0 it calls bounds near that are not; so no point is good that is far from one there. */
static perp_status write_bounds(perp_ncp_solver *solver)
{
    const perp__ncp_model *m = &solver->model;
    perp__ncp_residuals residuals;
    perp_status status;
    bool moves = 0;

    for (int32_t i = 0; i < m->n; i++) {
        const double z = solver->best_z[i], w = solver->best_w[i] / m->w_unit[i];
        const double above = (z - m->lower[i]) / m->z_unit[i];
        const double below = (z - m->upper[i]) / m->z_unit[i];

        solver->candidate[i] = above <= w ? m->lower[i] : below >= w ? m->upper[i] : z;
        moves |= solver->candidate[i] != z;
    }
    status = moves ? perp__ncp_outcome_of(solver, &residuals) : PERP_OK;
    if (status != PERP_OK || !moves)
        return status < 0 ? status : PERP_OK;
    residuals.said = solver->best.said;
    if (!(objection(&residuals) <= sqrt(solver->settings.tol)))
        solver->best.evidence.sound = 0;
    else if (solver->settings.polish && perp__is_good(verdict(solver, &residuals)) &&
             objection(&residuals) <= fmax(objection(&solver->best), PERP__ROUNDING_LIMIT))
        keep(solver, &residuals);
    perp__copy(solver->candidate, solver->best_z, m->n);
    return PERP_OK;
}

/* Keeps solver->candidate if it is the best point yet. */
static perp_status consider(perp_ncp_solver *solver, int32_t method, perp_outcome said)
{
    perp__ncp_residuals residuals;
    bool good;
    perp_status status = perp__ncp_outcome_of(solver, &residuals);

    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    residuals.said = said;
    good = perp__is_good(verdict(solver, &residuals));
    if (solver->best_method >= 0 &&
        !(good != is_good(solver) ? good : objection(&residuals) < objection(&solver->best)))
        return PERP_OK;
    solver->best_method = method;
    keep(solver, &residuals);
    return good ? write_bounds(solver) : PERP_OK;
}

/* One run of a method from solver->candidate, to `share` of tol. */
static perp_status run(perp_ncp_solver *solver, int32_t method, bool path, double penalty,
                       double share)
{
    const perp_ncp_settings *settings = &solver->settings;
    perp__ncp_model *m = &solver->model;
    perp__ncp_run *copy = &solver->run;
    perp__newton *f = &copy->newton;
    const bool shared = settings->method == PERP_NCP_AUTO && method == solver->first_method;
    perp_status status;

    perp__ncp_model_unscale(m);
    m->control.method = method;
    m->central = 0;
    m->apart = solver->apart || share < 1.0;
    f->penalty = penalty;
    f->target = 0.25 * share * settings->tol;
    f->path = path;
    f->limit =
        settings->max_iterations > 0 ? settings->max_iterations - solver->iterations : ITERATIONS;
    f->limit = shared ? (f->limit + 1) / 2 : f->limit;
    copy->finish = settings->polish;
    copy->fruitless = shared && m->n >= PERP__LARGE_MATRIX ? FRUITLESS : 0;
    perp__copy(f->z, solver->candidate, m->n);
    status = perp__ncp_start_run(copy);
    if (status == PERP_OK)
        status = method == PERP_NCP_JOSEPHY ? perp__ncp_josephy(copy, &solver->linear)
                                            : perp__ncp_fischer(copy);
    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    solver->iterations += f->iterations;
    for (int32_t i = 0; i < m->n; i++) { /* what underflows beside the bounds' unit is on them */
        const double z = perp__clamp(f->best[i] * m->z_unit[i], m->lower[i], m->upper[i]);

        solver->candidate[i] = f->best[i] - m->low[i] < DBL_MIN    ? m->lower[i]
                               : m->high[i] - f->best[i] < DBL_MIN ? m->upper[i]
                                                                   : z;
    }
    return consider(solver, method, f->outcome);
}

static bool is_over(perp_ncp_solver *solver)
{
    if (solver->settings.max_iterations > 0 &&
        solver->iterations >= solver->settings.max_iterations && solver->model.control.ended < 0)
        solver->model.control.ended = PERP_OUTCOME_ITERATION_LIMIT;
    return is_good(solver) || solver->model.control.ended >= 0;
}

/* Both methods from `from`, or the one asked for; fischer alone then follows the path, and again
 * from its end. One that is content by its scales, where the gate is not, goes on by new ones. */
static perp_status run_all(perp_ncp_solver *solver, const double *from, double penalty)
{
    const int32_t asked = solver->settings.method;
    perp_status status = PERP_OK;

    for (int32_t k = 0; k < PERP__FISCHER_STARTS && status == PERP_OK; k++) {
        const int32_t first = solver->first_method;
        const bool path = k > 0 && asked == PERP_NCP_FISCHER;
        const int32_t method = k == 0 || path ? first : PERP_NCP_FISCHER + PERP_NCP_JOSEPHY - first;

        if ((k < 2 || path) && (asked == PERP_NCP_AUTO || asked == method) && !is_over(solver)) {
            if (k < 2)
                perp__copy(solver->candidate, from, solver->model.n);
            status = run(solver, method, path, penalty, 1.0);
            for (double share = 1e-2; share > 1e-5 && status == PERP_OK && !is_over(solver) &&
                                      solver->run.newton.outcome == PERP_OUTCOME_SOLVED;
                 share *= 1e-2)
                status = run(solver, method, path, penalty, share);
        }
    }
    return status;
}

/* Both methods from perturbed starts; the attempts differ in size and direction. */
static perp_status restart(perp_ncp_solver *solver)
{
    static const int32_t sizes[] = {0, 2, 4, 6, 8, 10, -2, -4};
    const int32_t most = solver->settings.method == PERP_NCP_AUTO ? solver->settings.restarts : 0;
    perp__ncp_model *m = &solver->model;
    const int64_t before = solver->iterations;
    double *of_part = m->most, largest = 0.0;
    perp_status status = PERP_OK;

    /* 1. unit[i] := the largest of what the start, or its scales, take for the sizes of the
     * variables of i's part; of all where that is 0. */
    memset(of_part, 0, (size_t)m->n * sizeof(double));
    for (int32_t i = 0; i < m->n; i++) {
        double *size = &of_part[solver->parts.of[i]];

        *size = fmax(*size, fabs(solver->start[i]));
        if (m->start_known)
            *size = fmax(*size, m->omega_start[m->n + i] * m->D_start[i]);
        largest = fmax(largest, *size);
    }
    for (int32_t i = 0; i < m->n; i++) {
        const double size = of_part[solver->parts.of[i]];

        solver->unit[i] = size > 0.0 ? size : largest;
    }
    for (int32_t k = 0; k < most && status == PERP_OK && !is_over(solver); k++) {
        const double factor = ldexp(1.0, sizes[k % 8]);

        if (solver->settings.max_iterations == 0 &&
            solver->iterations - before >= RESTART_ITERATIONS)
            break;
        /* 2. The start, perturbed: into the box, not onto its boundary. */
        for (int32_t i = 0; i < m->n; i++) {
            const double size = fmin(factor * solver->unit[i], m->upper[i] - m->lower[i]);
            const double z = solver->start[i];
            double shift = size * perp__draw(&solver->random);

            if (z + shift < m->lower[i] || z + shift > m->upper[i])
                shift = -shift;
            solver->perturbed[i] = perp__clamp(z + shift, m->lower[i], m->upper[i]);
        }
        m->control.restarts++;
        solver->apart = k % 2;
        status = run_all(solver, solver->perturbed, k % 2 == 0 ? solver->settings.penalty : 0.0);
    }
    return status;
}

/* Each part that is not solved where all are best, with the others held; then the whole. */
static perp_status part_by_part(perp_ncp_solver *solver)
{
    const perp__ncp_model *m = &solver->model;
    perp__ncp_parts *parts = &solver->parts;
    perp_outcome said = PERP_OUTCOME_SOLVED;
    int32_t method = solver->best_method;
    perp_status status = PERP_OK;

    perp__copy(parts->z, solver->best_z, m->n);
    perp__copy(parts->lower, m->lower, m->n);
    perp__copy(parts->upper, m->upper, m->n);
    perp__copy(parts->start, solver->start, m->n);
    for (int32_t p = 0; p < parts->count && status == PERP_OK && m->control.ended < 0; p++) {
        hold_others(solver, p);
        solver->apart = 0;
        status = consider(solver, method, PERP_OUTCOME_STALLED);
        if (status == PERP_OK && !is_over(solver))
            status = run_all(solver, solver->start, solver->settings.penalty);
        PERP__THEN(status, restart(solver));
        if (status != PERP_OK || solver->best_method < 0)
            continue;
        for (int32_t i = 0; i < m->n; i++)
            if (parts->of[i] == p)
                parts->z[i] = solver->best_z[i];
        said = perp__worse_outcome(said, verdict(solver, &solver->best));
        method = solver->best_method;
    }
    hold_others(solver, -1);
    return status == PERP_OK ? consider(solver, method, said) : status;
}

static perp_status search(perp_ncp_solver *solver, const double *z0)
{
    perp__ncp_model *m = &solver->model;
    perp__ncp_parts *parts = &solver->parts;
    perp_status status = find_start(solver, z0);

    if (status != PERP_OK)
        return status;
    /* 1. The first method. Linear problems of obstacles cost a few factorisations, and Josephy's
     * method needs two to six of them where Newton's on the merit function takes 8 to 30
     * (bench/ncp_zoo): whether this is a large one the Jacobian at the start tells. */
    solver->apart = 0;
    solver->first_method = PERP_NCP_FISCHER;
    if (solver->settings.method == PERP_NCP_AUTO && m->sparse && m->n >= PERP__LARGE_MATRIX &&
        m->problem.jacobian) {
        const perp__matrix J = perp__ncp_given(m);

        perp__copy(m->z_caller, solver->start, m->n);
        m->jacobian_evaluations++;
        status = perp__ncp_ask(m);
        if (status < 0)
            return status;
        if (status == PERP_OK && perp__has_positive_diagonal(&J) && perp__is_nearly_z(&J) &&
            perp__has_symmetric_entries(&J, m->exponents_work, PERP__ROUNDING_LIMIT))
            solver->first_method = PERP_NCP_JOSEPHY; /* as the matrices of diffusion are */
    }
    /* 2. From the start, then part by part, or from other starts. */
    status = run_all(solver, solver->start, solver->settings.penalty);
    if (status == PERP_OK && !is_over(solver)) {
        memcpy(parts->of, m->group, (size_t)m->n * sizeof *parts->of);
        parts->count = perp__number_parts(parts->of, m->n);
        status = solver->best_method >= 0 && parts->count > 1 && parts->count <= MOST_PARTS
                     ? part_by_part(solver)
                     : restart(solver);
    }
    /* 3. What is left of it. */
    if (status == PERP_OK && solver->best_method < 0) { /* no time for a step, or no J anywhere */
        perp__copy(solver->candidate, solver->start, m->n);
        status = consider(solver, m->control.method, PERP_OUTCOME_SINGULAR);
    }
    if (status == PERP_OK && solver->best_method >= 0 && !is_over(solver)) {
        status = perp__ncp_look_for_trap(solver, &solver->trapped);
        if (solver->trapped)
            solver->best.said = PERP_OUTCOME_STALLED;
    }
    if (m->control.ended >= 0)
        solver->best.said = m->control.ended;
    return status;
}

perp_status perp__ncp_solve(perp_ncp_solver *solver, double *z, double *w, perp_ncp_result *result,
                            const double *z0)
{
    const double started = perp__now();
    perp_context *context = solver->context;
    perp__ncp_model *m = &solver->model;
    const perp__ncp_residuals *best = &solver->best;
    perp_ncp_result copy = {0};
    perp_status status;

    /* 1. What the caller gave. */
    if (!solver->setups)
        return perp__refuse(context,
                            "the solver has no problem yet: call perp_ncp_solver_setup first");
    status = PERP__CHECK(perp_ncp_result, context, result);
    if (status == PERP_OK && m->n > 0)
        status = perp__check_pointer(context, "z", z);
    PERP__THEN(status, perp__check_finite(context, "z0", z0, (size_t)m->n));
    if (status != PERP_OK)
        return status;
    /* 2. The search. */
    memset(&m->control, 0, sizeof m->control);
    m->control.ended = -1;
    if (solver->settings.time_limit > 0.0)
        m->control.deadline = started + solver->settings.time_limit;
    m->function_evaluations = m->jacobian_evaluations = 0;
    solver->best_method = -1;
    solver->iterations = 0;
    solver->trapped = 0;
    status = search(solver, z0);
    if (status < 0)
        return status;
    if (status == PERP__NCP_OUTSIDE || solver->best_method < 0) {
        /* F was defined nowhere, as far as time went: the start, and nothing else */
        for (int32_t i = 0; i < m->n; i++) {
            solver->best_z[i] = solver->start[i];
            solver->best_w[i] = NAN;
        }
        solver->best.evidence = (perp__evidence){INFINITY, INFINITY, INFINITY, 0};
        solver->best.natural = INFINITY;
        solver->best.said =
            m->control.ended >= 0 ? m->control.ended : PERP_OUTCOME_EVALUATION_FAILED;
        solver->best_method =
            solver->settings.method == PERP_NCP_AUTO ? PERP_NCP_FISCHER : solver->settings.method;
    }
    /* 3. Its answer. */
    copy.outcome = verdict(solver, best);
    copy.method = solver->best_method;
    copy.iterations = solver->iterations;
    copy.residual = perp__told(best->evidence.tested);
    copy.natural_residual = perp__told(best->natural);
    copy.backward_error = perp__told(best->evidence.backward);
    copy.function_evaluations = m->function_evaluations;
    copy.jacobian_evaluations = m->jacobian_evaluations;
    copy.restarts = m->control.restarts;
    copy.trapped = solver->trapped;
    copy.seconds = perp__now() - started;
    perp__copy(z, solver->best_z, m->n);
    perp__copy(w, solver->best_w, m->n);
    perp__struct_write(result, &copy, sizeof copy);
    return PERP_OK;
}
