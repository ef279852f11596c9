/* Candidates: what a point is called, and which of those met so far is the answer. */
#include "lcp/candidate.h"

#include <float.h>
#include <math.h>
#include <string.h>

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

static double own_residual(perp_lcp_solver *solver)
{
    perp__witness_point point;

    point.M = &solver->M;
    point.exponents = solver->exponents;
    point.part = solver->part;
    point.parts = solver->parts;
    point.scaling = solver->settings.scaling;
    point.q = solver->q;
    point.lower = solver->lower;
    point.upper = solver->upper;
    point.z = solver->z;
    point.w = solver->w_high;
    point.least = NULL;
    point.tol = solver->settings.tol;
    return perp__witness_own_residual(&solver->witness, &point);
}

perp__evidence perp__lcp_evidence(perp_lcp_solver *solver, const perp__evaluation *worth,
                                  double unit)
{
    perp__evidence evidence = {worth->tested / unit, INFINITY, worth->backward, 0};

    evidence.sound = worth->finite;
    /* beside its own terms a row has no large numbers of others to excuse it */
    if (perp__may_pass(&evidence, solver->settings.tol))
        evidence.own = worth->small ? 0.0 : own_residual(solver);
    return evidence;
}

perp_outcome perp__lcp_judge(perp_lcp_solver *solver, const perp__evaluation *worth,
                             perp_outcome said)
{
    const perp__evidence evidence = perp__lcp_evidence(solver, worth, 1.0);

    return perp__gate(&evidence, solver->settings.tol, said);
}

void perp__start_from(perp_lcp_solver *solver, const double *z0)
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

    perp__start_from(solver, z0);
    worth = perp__evaluate(solver);
    if (!isfinite(worth.tested)) {
        perp__start_from(solver, NULL);
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

perp_status perp__consider(perp_lcp_solver *solver, const perp__plan_step *step, perp_outcome said,
                           const perp__lcp_iterate *iterate, const double *z0)
{
    perp__evaluation worth = perp__evaluate(solver);
    perp_status status = PERP_OK;
    perp_outcome outcome;

    if (!isfinite(worth.tested)) {
        worth = fall_back(solver, z0);
        said = PERP_OUTCOME_STALLED;
    }
    if (solver->settings.polish && said != PERP_OUTCOME_RAY && isfinite(worth.tested) &&
        !step->rough && !iterate->far_off) {
        if (!iterate->has_places)
            perp__read_places(solver, solver->places);
        status = perp__polish_run(solver, &worth);
        if (status != PERP_OK)
            return status;
    }
    outcome = perp__lcp_judge(solver, &worth, said);
    solver->refused = worth.tested <= solver->settings.tol && !perp__is_good(outcome);
    if (is_better(&solver->best, &worth, outcome))
        keep(solver, &worth, outcome, step->method);
    return PERP_OK;
}

void perp__consider_point(perp_lcp_solver *solver, int32_t method)
{
    const perp__evaluation worth = perp__evaluate(solver);
    const perp_outcome outcome = perp__lcp_judge(solver, &worth, PERP_OUTCOME_STALLED);

    if (is_better(&solver->best, &worth, outcome))
        keep(solver, &worth, outcome, method);
}

/* Keeps a ray that stood the check. The last word on it comes after all attempts. */
void perp__keep_ray(perp_lcp_solver *solver)
{
    double largest = 0.0;

    solver->rays++;
    solver->best_certificate =
        perp__ray_certificate(solver) ? PERP_CERTIFICATE_INFEASIBLE : PERP_CERTIFICATE_NONE;
    for (int32_t i = 0; i < solver->n; i++)
        largest = fmax(largest, fabs(solver->z[i]));
    for (int32_t i = 0; i < solver->n; i++)
        solver->best_ray[i] = solver->z[i] / largest;
}

/* A start that names the right active set solves the problem without any method. */
perp_status perp__try_start(perp_lcp_solver *solver, const double *z0)
{
    perp__evaluation worth;
    perp_outcome outcome;
    perp_status status;

    perp__start_from(solver, z0);
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
void perp__consider_start(perp_lcp_solver *solver, const double *z0)
{
    perp__evaluation worth;

    perp__start_from(solver, z0);
    worth = perp__evaluate(solver);
    if (worth.tested < solver->best.worth.tested &&
        !(solver->best.worth.backward <= 16.0 * DBL_EPSILON))
        keep(solver, &worth, perp__lcp_judge(solver, &worth, solver->best.outcome),
             solver->best.method);
}
