/* Which rows of an answer hold, and the velocities that these leave (hold.h).
 *
 * The modes tell. Besides, a contact that presses by nothing, the fourth leg of a table, holds
 * where its velocity is no more than the rounding of what it is made of; and none holds of which
 * the answer says otherwise: far from a solution the modes are no active set. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/solver.h"

/* Zeros in v may take so much of what acts there: in units of tol what impulses may be wrong by,
 * and what M^-1 rounds to. */
#define KNOWN 10.0
#define SMALL sqrt(DBL_EPSILON)

/* A velocity that is too large for what the answer is worth. */
static double slack_of(const perp_contact_solver *solver, int32_t k)
{
    return sqrt(solver->settings.tol) * solver->omega[k] * solver->root[k];
}

/* How many rows of contact k hold. terms: |W||r| + |q|, of what might hold beside the modes. */
static int32_t holds(const perp_contact_solver *solver, int32_t k, const double *u,
                     const double *terms, int32_t mode)
{
    const int32_t begin = solver->starts[k], end = solver->starts[k + 1];
    const int32_t normals = perp__contact_normals(&solver->problem, k), first = begin + normals;
    const double slack = slack_of(solver, k);

    for (int32_t i = begin; i < first; i++)
        if (!(fabs(u[i]) <= slack))
            return i - begin;
    if (mode == PERP_CONTACT_SEPARATE && !(fabs(u[begin]) <= PERP__SUM_ROUNDING * terms[begin]))
        return 0;
    if (mode == PERP_CONTACT_SLIP && end > first && !(fabs(u[first]) <= slack))
        return normals;
    for (int32_t i = first; i < end; i++)
        if (mode != PERP_CONTACT_STICK && !(fabs(u[i]) <= PERP__SUM_ROUNDING * terms[i]))
            return normals;
    for (int32_t i = first; i < end; i++)
        if (!(fabs(u[i]) <= slack))
            return normals;
    return solver->mu[k] > 0.0 ? end - begin : normals;
}

void perp__contact_find_bias(perp_contact_solver *solver, double *bias)
{
    const perp__contact_call *call = solver->call;

    if (solver->entrance == PERP__ENTRANCE_RIGID)
        perp__rigid_bias(solver, bias);
    else if (solver->entrance == PERP__ENTRANCE_DELASSUS)
        perp__copy(bias, call->q, solver->size);
    else
        for (int32_t i = 0; i < solver->size; i++)
            bias[i] = i < solver->rows ? call->w[i] : call->b ? call->b[i - solver->rows] : 0.0;
}

/* How many rows of each constraint hold. */
static perp_status find_held(perp_contact_solver *solver, const double *r, const double *u,
                             const int8_t *modes)
{
    const bool is_rigid = solver->entrance == PERP__ENTRANCE_RIGID;
    const perp__contact_problem *problem = &solver->problem;
    perp__hold *hold = &solver->hold;
    double *bias = solver->high;
    bool asks = 0;
    perp_status status;

    hold->rigid = is_rigid ? solver->rigid : NULL;
    status = perp__hold_fit(hold, &solver->bodies);
    if (status != PERP_OK)
        return status;

    /* 1. The terms, where some contact may hold that the modes say nothing of. */
    for (int32_t k = 0; k < solver->contacts && !asks; k++) {
        const int32_t normals = perp__contact_normals(problem, k);
        const bool slips = modes[k] == PERP_CONTACT_SLIP && solver->dims[k] > normals;

        asks = (slips || modes[k] == PERP_CONTACT_SEPARATE) &&
               fabs(u[solver->starts[k] + (slips ? normals : 0)]) <= slack_of(solver, k);
    }
    if (asks)
        perp__absolute_bodies(&solver->bodies, r, solver->q, solver->bodies.y, solver->scale);

    perp__contact_find_bias(solver, bias);

    /* 2. The rows that hold, up to the first that yields: there u + compliance r is 0. Normals that
     * move nothing (the bounds of rows) yield, and hold all the same. */
    for (int32_t k = 0; k < solver->constraints; k++) {
        const int32_t begin = solver->starts[k];
        const int32_t count =
            k < solver->contacts ? holds(solver, k, u, solver->scale, modes[k]) : 1;
        int32_t end = begin + count;

        if (solver->complies)
            for (end = perp__contact_first_row(problem, k);
                 end < begin + count && solver->compliance[end] == 0.0; end++)
                continue;
        hold->holds[k] = (int8_t)(end - begin);
        hold->beside[k] = PERP__RIGID_AT_REST;
        hold->pushed[k] = 0;
        for (int32_t i = begin; i < end; i++)
            hold->pushed[k] |= bias[i] != 0.0;
    }
    if (is_rigid)
        perp__rigid_beside(solver, hold->holds, hold->beside, hold->pushed);
    hold->bias = bias;
    hold->r = r;
    return PERP_OK;
}

/* v := what the rows that hold leave free; the blocks have an order of their own. */
static void move_freely(perp_contact_solver *solver, double *v)
{
    const perp__bodies *b = &solver->bodies;
    double *blocks = solver->hold.v;

    for (int32_t k = 0; k < b->blocks * b->width; k++) {
        const int32_t i = b->C ? k : b->dofs[k];

        blocks[k] = i >= 0 ? v[i] : 0.0;
    }
    perp__hold_run(&solver->hold);
    for (int32_t k = 0; k < b->blocks * b->width; k++) {
        const int32_t i = b->C ? k : b->dofs[k];

        if (i >= 0)
            v[i] = blocks[k];
    }
}

perp_status perp__contact_hold(perp_contact_solver *solver, const double *r, const double *u,
                               const int8_t *modes, double *v)
{
    const perp_status status = find_held(solver, r, u, modes);

    if (status == PERP_OK)
        move_freely(solver, v);
    return status;
}

/* push := what zeros in v may take of the momentum in each coordinate: what the impulses there may
 * be wrong by, that is tol of all that their contacts' velocities are made of, and rounding of what
 * acts. A contact that opens has no impulse that could be wrong. */
static void find_slack(perp_contact_solver *solver)
{
    const perp__dynamics *d = &solver->dynamics;
    const perp__contact_candidate *best = &solver->best;
    const int32_t *rows = solver->bodies.rows;
    double *x = solver->high, *scale = solver->scale;

    perp__absolute_bodies(&solver->bodies, best->r, solver->load, solver->bodies.y, scale);
    for (int32_t k = 0; k < solver->constraints; k++) {
        const double size = perp__contact_length(scale, rows[k], rows[k + 1]);
        const bool opens = k < solver->contacts && best->modes[k] == PERP_CONTACT_SEPARATE &&
                           best->u[rows[k]] > PERP__SUM_ROUNDING * scale[rows[k]];

        for (int32_t i = rows[k]; i < rows[k + 1]; i++)
            x[i] = opens ? 0.0 : size / solver->trace[k];
    }
    for (int32_t j = 0; j < solver->n; j++)
        solver->push[j] = 0.0;
    perp__absolute_transposed(&d->H, x, solver->push);
    perp__absolute_transposed(&d->G, x + d->H.rows, solver->push);
    for (int32_t j = 0; j < solver->n; j++)
        solver->push[j] = KNOWN * solver->settings.tol * solver->push[j] +
                          SMALL * (solver->push[j] + fabs(solver->call->f[j]));
}

/* Whether there is a velocity in coordinate k of the blocks, and the momentum of its whole block
 * can do without. */
static bool is_spare(const perp_contact_solver *solver, int32_t k, double velocity)
{
    const perp__bodies *b = &solver->bodies;
    const int32_t width = b->width, block = k / width, j = k % width;
    const double *L = b->factors + (size_t)block * (size_t)(width * width);

    for (int32_t i = 0; i < width; i++) {
        const int32_t dof = b->dofs[block * width + i];
        double mass = 0.0;

        for (int32_t l = 0; l <= i && l <= j; l++)
            mass += L[i * width + l] * L[j * width + l];
        if (dof >= 0 && !(fabs(mass * velocity) <= solver->push[dof]))
            return 0;
    }
    return velocity != 0.0;
}

/* Whether all is so slow, where W was wanted, that blocks of M may find it at rest. */
static bool nearly_rests(const perp_contact_solver *solver)
{
    const double fastest = perp__largest(solver->best_v, solver->n);

    return solver->settings.raw_velocity == 2 && solver->entrance == PERP__ENTRANCE_DYNAMICS &&
           solver->dynamics.has_M && fastest > 0.0 &&
           fastest <= sqrt(solver->settings.tol) * solver->free_speed;
}

/* What moves is made by the impulses, M v = f + H'r to the last bits: only zeros are new. Beside a
 * body of next to no mass W tells little of the impulses on the others, and beside a coordinate of
 * next to no mass of those on the other coordinates: where a zero would take more than what acts
 * there is worth, v keeps what the impulses make of it. */
perp_status perp__contact_hold_best(perp_contact_solver *solver)
{
    perp__contact_candidate *best = &solver->best;
    const perp__bodies *b = &solver->bodies;
    int32_t may_rest = 0, known = solver->has_bodies;
    perp_status status = PERP_OK;

    if (!perp__is_good(best->outcome))
        return PERP_OK;
    if (!known && nearly_rests(solver)) {
        status = perp__contact_find_bodies(solver, &known);
        if (status == PERP_OK && known)
            perp__bodies_force(&solver->bodies, solver->call->f);
    }
    if (status != PERP_OK || !known) {
        perp__contact_write_zeros(solver, best->modes, best->u);
        return status;
    }
    find_slack(solver);
    status = find_held(solver, best->r, best->u, best->modes);
    if (status != PERP_OK)
        return status;

    /* 1. Zeros of v, where something that moves could do without. */
    for (int32_t k = 0; k < b->blocks * b->width && !may_rest; k++)
        may_rest = b->dofs[k] >= 0 && is_spare(solver, k, solver->best_v[b->dofs[k]]);
    if (may_rest) {
        perp__copy(solver->v, solver->best_v, solver->n);
        move_freely(solver, solver->v);
    }
    for (int32_t k = 0; k < b->blocks * b->width && may_rest; k++) {
        const int32_t i = b->dofs[k];

        if (i >= 0 && solver->v[i] == 0.0 && is_spare(solver, k, solver->best_v[i]))
            solver->best_v[i] = 0.0;
    }

    /* 2. u of that v, and 0 of what holds. */
    if (solver->n > 0)
        memset(solver->v_low, 0, (size_t)solver->n * sizeof *solver->v_low);
    perp__dynamics_relative(&solver->dynamics, solver->best_v, solver->v_low, solver->call->w,
                            solver->call->b, best->u);
    for (int32_t i = 0; solver->complies && i < solver->size; i++)
        best->u[i] += solver->compliance[i] * best->r[i];
    for (int32_t k = 0; k < solver->constraints; k++)
        for (int32_t i = 0; i < b->rows[k + 1] - b->rows[k] && i < solver->hold.holds[k]; i++)
            best->u[b->rows[k] + i] = 0.0;
    perp__contact_write_zeros(solver, best->modes, best->u);
    return PERP_OK;
}
