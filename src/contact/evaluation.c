/* What impulses are worth, from the caller's data; and the best point so far: what every method,
 * start and polish has to offer goes through here. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "contact/law.h"
#include "contact/solver.h"

/* load := |q|, or where that is more, 16 eps / tol of the terms that it is made of: they have
 * roundings, and of rows that depend on each other no impulses remove those. omega is no less. */
static void grant_rounding(perp_contact_solver *solver)
{
    const double share = fmin(1.0, PERP__ROUNDING_LIMIT / solver->settings.tol);
    int32_t raised = 0;

    for (int32_t k = 0; k < solver->constraints; k++) {
        double *drive = &solver->drive[solver->part[k]], most = 0.0;

        for (int32_t i = solver->starts[k]; i < solver->starts[k + 1]; i++) {
            const double size = fabs(solver->q[i]), least = share * solver->load[i];
            const int32_t is_granted = least > size && least < INFINITY;

            solver->load[i] = is_granted ? least : size;
            most = is_granted && least > most ? least : most;
        }
        if (most > solver->root[k] * *drive && *drive > 0.0 && most / solver->root[k] < INFINITY) {
            perp__raise_to(drive, most / solver->root[k]);
            raised = 1;
        }
    }
    for (int32_t k = 0; raised && k < solver->constraints; k++)
        if (solver->drive[solver->part[k]] > 0.0)
            solver->omega[k] = solver->drive[solver->part[k]];
}

perp_status perp__contact_load(perp_contact_solver *solver)
{
    const perp__contact_call *call = solver->call;
    perp_status status = PERP_OK;

    if (solver->entrance == PERP__ENTRANCE_DELASSUS) {
        for (int32_t i = 0; i < solver->size; i++) {
            solver->q[i] = call->q[i];
            solver->load[i] = 0.0; /* the caller's word: nothing is granted */
        }
    } else if (solver->entrance == PERP__ENTRANCE_RIGID) {
        perp__rigid_load(solver);
    } else {
        status =
            perp__dynamics_velocities(&solver->dynamics, call->f, NULL, solver->v, solver->v_low);
        if (status == PERP_OK)
            perp__dynamics_relative(&solver->dynamics, solver->v, solver->v_low, call->w, call->b,
                                    solver->q);
        perp__dynamics_sizes(&solver->dynamics, solver->v, call->w, call->b, solver->load);
        solver->free_speed = perp__largest(solver->v, solver->n);
        if (solver->has_bodies)
            perp__bodies_force(&solver->bodies, call->f);
    }
    solver->is_free = 1;
    if (status != PERP_OK)
        return status;
    perp__contact_omegas(&solver->problem, solver->part, solver->parts, solver->drive,
                         solver->omega);
    grant_rounding(solver);
    solver->is_idle = 0;
    for (int32_t p = 0; p < solver->parts; p++)
        solver->is_idle |= solver->drive[p] == 0.0;

    /* finite data may make numbers that no double holds */
    for (int32_t i = 0; i < solver->size; i++)
        if (!isfinite(solver->q[i]))
            return perp__fail(solver->context, PERP_ERROR_NOT_FINITE,
                              "row %d of q = H M^-1 f + w is %g", (int)i, solver->q[i]);
    for (int32_t k = 0; k < solver->constraints; k++)
        if (!(solver->omega[k] < INFINITY))
            return perp__fail(solver->context, PERP_ERROR_NOT_FINITE,
                              "%s %d: omega, the largest |q| / sqrt(t) of its part, is %g",
                              k < solver->contacts ? "contact" : "bilateral row",
                              (int)(k < solver->contacts ? k : k - solver->contacts),
                              solver->omega[k]);
    return PERP_OK;
}

/* u = W r + q, or with dynamics H v + w, v = M^-1 (f + H'r + G's). */
static perp_status compute_velocities(perp_contact_solver *solver)
{
    const perp__contact_call *call = solver->call;
    perp_status status;

    if (solver->is_free && perp__is_zero(solver->r, solver->size)) {
        perp__copy(solver->u, solver->q, solver->size);
        return PERP_OK;
    }
    solver->is_free = 0;
    if (solver->entrance == PERP__ENTRANCE_DELASSUS) {
        perp__multiply_doubled(&solver->W, solver->r, solver->q, solver->high, solver->low);
        perp__copy(solver->u, solver->high, solver->size);
        return PERP_OK;
    }
    if (solver->entrance == PERP__ENTRANCE_RIGID) {
        perp__rigid_velocities(solver);
        return PERP_OK;
    }
    status =
        perp__dynamics_velocities(&solver->dynamics, call->f, solver->r, solver->v, solver->v_low);
    if (status != PERP_OK)
        return status;
    perp__dynamics_relative(&solver->dynamics, solver->v, solver->v_low, call->w, call->b,
                            solver->u);
    for (int32_t i = 0; solver->complies && i < solver->size; i++)
        solver->u[i] += solver->compliance[i] * solver->r[i];
    return PERP_OK;
}

/* Writes what the modes know of r: 0 of the contacts that separate, the bound that a row is at;
 * `moves`: on the side that u tells, be r where it may. Returns whether that changed anything. */
static int32_t separate(perp_contact_solver *solver, const int8_t *modes, int32_t moves)
{
    const perp__contact_problem *p = &solver->problem;
    int32_t changed = 0, k, i;

    for (k = 0; k < p->contacts; k++) {
        const double most = perp__contact_is_bound(p, k) ? p->mu[k] * p->bound[k] : 0.0;

        i = p->starts[k];
        if (!perp__contact_is_bound(p, k)) {
            for (; modes[k] == PERP_CONTACT_SEPARATE && i < p->starts[k + 1]; i++)
                changed |= perp__put(&solver->r[i], 0.0);
        } else if (modes[k] != PERP_CONTACT_STICK) {
            if (fabs(solver->r[i + 1]) > 0.5 * most)
                changed |= perp__put(&solver->r[i + 1], copysign(most, solver->r[i + 1]));
            else if (moves && solver->u[i + 1] != 0.0)
                changed |= perp__put(&solver->r[i + 1], copysign(most, 0.0 - solver->u[i + 1]));
        }
    }
    return changed;
}

perp_status perp__contact_evaluate(perp_contact_solver *solver, const int8_t *modes,
                                   perp__contact_residuals *residuals)
{
    const perp__contact_problem *p = &solver->problem;
    perp_status status;

    for (int32_t k = 0; k < p->contacts; k++)
        perp__contact_clip(p, k, solver->r);

    /* a part that nothing drives has no impulses: beside which size any could be right, nobody
     * knows; normals that are bounds stay what they are */
    for (int32_t i = 0; solver->is_idle && i < p->size; i++) {
        const int32_t k = solver->constraint_of[i];

        if (solver->drive[solver->part[k]] == 0.0 &&
            (k >= p->contacts || i >= perp__contact_first_row(p, k)))
            solver->r[i] = 0.0;
    }
    if (modes)
        separate(solver, modes, 0);
    status = compute_velocities(solver);
    if (status != PERP_OK)
        return status;
    perp__contact_measure(solver, residuals);
    /* far from a solution the sides on which a point lies are no active set */
    if (residuals->tested <= sqrt(solver->settings.tol) &&
        separate(solver, modes ? modes : solver->modes, 1)) {
        status = compute_velocities(solver);
        if (status == PERP_OK)
            perp__contact_measure(solver, residuals);
    }

    /* a contact without a normal impulse separates, and one with presses, whatever was said */
    for (int32_t k = 0; k < p->contacts; k++) {
        if (modes)
            solver->modes[k] = modes[k];
        if (solver->r[p->starts[k]] == 0.0 && perp__contact_two_sided(p, k) == 0 &&
            !perp__contact_is_bound(p, k))
            solver->modes[k] = PERP_CONTACT_SEPARATE;
        else if (solver->modes[k] == PERP_CONTACT_SEPARATE)
            solver->modes[k] = PERP_CONTACT_SLIP;
    }
    if (status == PERP_OK)
        perp__contact_weigh(solver, residuals);
    return status;
}

void perp__contact_write_zeros(perp_contact_solver *solver, const int8_t *modes, double *u)
{
    const perp__contact_problem *p = &solver->problem;

    for (int32_t k = 0; k < p->contacts; k++) {
        const double rounding = PERP__SUM_ROUNDING * solver->omega[k] * solver->root[k];
        int32_t end = p->starts[k] + perp__contact_normals(p, k), next = p->starts[k + 1];

        if (modes[k] == PERP_CONTACT_STICK ||
            (solver->settings.raw_velocity == 2 && perp__contact_length(u, end, next) <= rounding))
            end = next;
        for (int32_t i = p->starts[k]; modes[k] != PERP_CONTACT_SEPARATE && i < end; i++)
            u[i] = 0.0;
    }
    for (int32_t i = p->rows; i < p->size; i++)
        u[i] = 0.0;
}

/* ---- the best point so far ---- */

void perp__contact_keep(perp_contact_solver *solver, const perp__contact_candidate *point)
{
    perp__contact_candidate *best = &solver->best;

    best->residuals = point->residuals;
    best->outcome = point->outcome;
    best->method = point->method;
    if (solver->parts > 0)
        memcpy(best->evidence, solver->evidence, (size_t)solver->parts * sizeof *best->evidence);
    perp__copy(best->r, solver->r, solver->size);
    perp__copy(best->u, solver->u, solver->size);
    if (solver->contacts > 0)
        memcpy(best->modes, solver->modes, (size_t)solver->contacts);
    perp__copy(solver->best_v, solver->v, solver->n);
}

perp_status perp__contact_consider(perp_contact_solver *solver, int32_t method, const int8_t *modes,
                                   perp__contact_residuals *found)
{
    perp__contact_candidate point = {.evidence = solver->evidence, .method = method};
    const perp__contact_candidate *best = &solver->best;
    perp_status status = perp__contact_evaluate(solver, modes, &point.residuals);
    int32_t good, was_good;

    if (status != PERP_OK)
        return status;
    point.outcome = perp__contact_verdict(solver, &point, solver->said);
    *found = point.residuals;
    /* it takes the place of the best: a good one, then a sound one, then the smaller residual */
    good = perp__is_good(point.outcome);
    was_good = perp__is_good(best->outcome);
    if (best->method < 0 || good > was_good ||
        (good == was_good && point.residuals.sound > best->residuals.sound) ||
        (good == was_good && point.residuals.sound == best->residuals.sound &&
         point.residuals.tested < best->residuals.tested))
        perp__contact_keep(solver, &point);
    return PERP_OK;
}
