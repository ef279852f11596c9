/* What impulses are worth, from the caller's data. */
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/solver.h"

perp_status perp__contact_load(perp_contact_solver *solver)
{
    const perp__contact_call *call = solver->call;
    perp_status status = PERP_OK;

    if (solver->entrance == PERP__ENTRANCE_DELASSUS) {
        if (solver->size > 0)
            memcpy(solver->q, call->q, (size_t)solver->size * sizeof(double));
    } else {
        status =
            perp__dynamics_velocities(&solver->dynamics, call->f, NULL, solver->v, solver->v_low);
        if (status == PERP_OK)
            perp__dynamics_relative(&solver->dynamics, solver->v, solver->v_low, call->w, call->b,
                                    solver->q);
        if (solver->has_bodies)
            perp__bodies_force(&solver->bodies, call->f);
    }
    solver->is_free = 1;
    if (status == PERP_OK)
        solver->omega = perp__contact_omega(&solver->problem);
    return status;
}

static int32_t is_zero(const double *x, int32_t count)
{
    int32_t i;

    for (i = 0; i < count; i++)
        if (x[i] != 0.0)
            return 0;
    return 1;
}

/* u = W r + q, or with dynamics H v + w, v = M^-1 (f + H'r + G's). */
static perp_status compute_velocities(perp_contact_solver *solver)
{
    const perp__contact_call *call = solver->call;
    perp_status status;
    int32_t i;

    if (solver->is_free && is_zero(solver->r, solver->size)) {
        if (solver->size > 0)
            memcpy(solver->u, solver->q, (size_t)solver->size * sizeof(double));
        return PERP_OK;
    }
    solver->is_free = 0;
    if (solver->entrance == PERP__ENTRANCE_DELASSUS) {
        perp__multiply_doubled(&solver->W, solver->r, solver->q, solver->high, solver->low);
        for (i = 0; i < solver->size; i++)
            solver->u[i] = solver->high[i];
        return PERP_OK;
    }
    status =
        perp__dynamics_velocities(&solver->dynamics, call->f, solver->r, solver->v, solver->v_low);
    if (status != PERP_OK)
        return status;
    perp__dynamics_relative(&solver->dynamics, solver->v, solver->v_low, call->w, call->b,
                            solver->u);
    for (i = 0; solver->complies && i < solver->size; i++)
        solver->u[i] += solver->compliance[i] * solver->r[i];
    return PERP_OK;
}

static double block_length(const double *x, int32_t begin, int32_t end)
{
    double length = 0.0;
    int32_t i;

    for (i = begin; i < end; i++)
        length = hypot(length, x[i]);
    return length;
}

/* change / scale, both >= 0 */
static double relative_change(double change, double scale)
{
    return change == 0.0 ? 0.0 : scale > 0.0 ? change / scale : INFINITY;
}

static void raise(double *most, double value)
{
    if (!(value <= *most)) /* a NaN stays */
        *most = value;
}

static void judge_contact(perp_contact_solver *solver, int32_t k, perp__contact_worth *worth)
{
    const perp__contact_problem *p = &solver->problem;
    const double t = p->trace[k];
    perp__contact_law law;

    perp__contact_judge(p, k, solver->r, solver->u, &law);
    solver->modes[k] = (int8_t)law.mode;
    raise(&worth->natural, law.natural);
    raise(&worth->tested, sqrt(t) * law.natural / solver->omega);
    raise(&worth->backward,
          relative_change(law.change, block_length(solver->scale, p->starts[k], p->starts[k + 1])));
    raise(&worth->signorini_impulse, law.signorini);
    raise(&worth->signorini_velocity, t * law.signorini);
    raise(&worth->cone, law.cone);
    raise(&worth->dissipation_impulse, law.dissipation);
    raise(&worth->dissipation_velocity, t * law.dissipation);
}

static void judge(perp_contact_solver *solver, perp__contact_worth *worth)
{
    const perp__contact_problem *p = &solver->problem;
    int32_t k, i;

    memset(worth, 0, sizeof *worth);
    if (solver->has_bodies)
        perp__absolute_bodies(&solver->bodies, solver->r, solver->q, solver->bodies.y,
                              solver->scale);
    else
        perp__absolute_product(&solver->W, solver->r, solver->q, solver->scale);
    for (k = 0; k < p->contacts; k++)
        judge_contact(solver, k, worth);
    for (i = p->rows; i < p->size; i++) {
        const double t = p->trace[p->contacts + i - p->rows];
        const double speed = fabs(solver->u[i]);

        raise(&worth->natural, speed / t);
        raise(&worth->tested, speed / sqrt(t) / solver->omega);
        raise(&worth->backward, relative_change(speed, solver->scale[i]));
        raise(&worth->bilateral, speed);
    }
}

/* Writes r = 0 of the contacts that separate; returns whether that changed anything. */
static int32_t separate(perp_contact_solver *solver, const int8_t *modes)
{
    const perp__contact_problem *p = &solver->problem;
    int32_t changed = 0, k, i;

    for (k = 0; k < p->contacts; k++)
        for (i = p->starts[k]; modes[k] == PERP_CONTACT_SEPARATE && i < p->starts[k + 1]; i++) {
            changed |= solver->r[i] != 0.0;
            solver->r[i] = 0.0;
        }
    return changed;
}

/* A contact without a normal impulse separates, and one with presses, whatever was said of it. */
static void reconcile(perp_contact_solver *solver, const int8_t *modes)
{
    const perp__contact_problem *p = &solver->problem;
    int32_t k;

    for (k = 0; k < p->contacts; k++) {
        if (modes)
            solver->modes[k] = modes[k];
        if (solver->r[p->starts[k]] == 0.0)
            solver->modes[k] = PERP_CONTACT_SEPARATE;
        else if (solver->modes[k] == PERP_CONTACT_SEPARATE)
            solver->modes[k] = PERP_CONTACT_SLIP;
    }
}

perp_status perp__contact_evaluate(perp_contact_solver *solver, const int8_t *modes,
                                   perp__contact_worth *worth)
{
    const perp__contact_problem *p = &solver->problem;
    perp_status status;
    int32_t k;

    for (k = 0; k < p->contacts; k++)
        perp__contact_clip(p, k, solver->r);
    if (modes)
        separate(solver, modes);
    status = compute_velocities(solver);
    if (status != PERP_OK)
        return status;
    judge(solver, worth);
    /* far from a solution the sides on which a point lies are no active set */
    if (!modes && worth->tested <= sqrt(solver->settings.tol) && separate(solver, solver->modes)) {
        status = compute_velocities(solver);
        if (status == PERP_OK)
            judge(solver, worth);
    }
    reconcile(solver, modes);
    return status;
}

void perp__contact_write_zeros(perp_contact_solver *solver, const int8_t *modes, double *u)
{
    const perp__contact_problem *p = &solver->problem;
    int32_t k, i;

    for (k = 0; k < p->contacts; k++) {
        if (modes[k] == PERP_CONTACT_SEPARATE)
            continue;
        u[p->starts[k]] = 0.0;
        for (i = p->starts[k]; modes[k] == PERP_CONTACT_STICK && i < p->starts[k + 1]; i++)
            u[i] = 0.0;
    }
    for (i = p->rows; i < p->size; i++)
        u[i] = 0.0;
}
