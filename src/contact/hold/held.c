/* Which rows of an answer hold, and the velocities that these leave (hold.h).
 *
 * The modes tell. Besides, a contact that presses by nothing, the fourth leg of a table, holds
 * where its velocity is no more than the rounding of what it is made of; and none holds of which
 * the answer says otherwise: far from a solution the modes are no active set. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/rigid/rigid.h"

/* What a sum that should be 0 may come out as, of its terms. */
#define ROUNDING (256.0 * DBL_EPSILON)

/* Zeros in v may take so much of what acts there: in units of tol what impulses may be wrong by,
 * and what M^-1 rounds to. */
#define KNOWN 10.0
#define SMALL 1e-7

typedef struct point {
    const double *r, *u, *terms; /* size; terms: |W||r| + |q| */
    const int8_t *modes;
} point;

static int32_t is_within(const double *u, const double *most, double factor, int32_t begin,
                         int32_t end)
{
    for (int32_t i = begin; i < end; i++)
        if (!(fabs(u[i]) <= factor * most[i]))
            return 0;
    return 1;
}

/* A velocity that is too large for what the answer is worth. */
static double slack_of(const perp_contact_solver *solver, int32_t k)
{
    return sqrt(solver->settings.tol) * solver->omega[k] * solver->root[k];
}

/* Whether some contact may hold that the modes say nothing of. */
static int32_t asks_for_terms(const perp_contact_solver *solver, const double *u,
                              const int8_t *modes)
{
    for (int32_t k = 0; k < solver->contacts; k++) {
        const int32_t normals = perp__contact_normals(&solver->problem, k);
        const int32_t slips = modes[k] == PERP_CONTACT_SLIP && solver->dims[k] > normals;
        const int32_t row = solver->starts[k] + (slips ? normals : 0);

        if ((slips || modes[k] == PERP_CONTACT_SEPARATE) && fabs(u[row]) <= slack_of(solver, k))
            return 1;
    }
    return 0;
}

/* How many rows of contact k hold. */
static int32_t holds(const perp_contact_solver *solver, const point *x, int32_t k)
{
    const int32_t begin = solver->starts[k], end = solver->starts[k + 1];
    const int32_t normals = perp__contact_normals(&solver->problem, k), first = begin + normals;
    const double slack = slack_of(solver, k);

    for (int32_t i = begin; i < first; i++)
        if (!(fabs(x->u[i]) <= slack))
            return i - begin;
    if (x->modes[k] == PERP_CONTACT_SEPARATE && !(fabs(x->u[begin]) <= ROUNDING * x->terms[begin]))
        return 0;
    if (x->modes[k] == PERP_CONTACT_SLIP && end > first && !(fabs(x->u[first]) <= slack))
        return normals;
    if (x->modes[k] != PERP_CONTACT_STICK && !is_within(x->u, x->terms, ROUNDING, first, end))
        return normals;
    for (int32_t i = first; i < end; i++)
        if (!(fabs(x->u[i]) <= slack))
            return normals;
    return solver->mu[k] > 0.0 ? end - begin : normals;
}

/* u of what stands still: bias, with that of the carriers. */
static void find_bias(perp_contact_solver *solver, double *bias)
{
    const perp__contact_call *call = solver->call;

    if (solver->entrance == PERP__ENTRANCE_RIGID) {
        perp__rigid_bias(solver, bias);
        return;
    }
    for (int32_t i = 0; i < solver->size; i++)
        bias[i] = i < solver->rows ? call->w[i] : call->b ? call->b[i - solver->rows] : 0.0;
}

/* How many of the first `count` rows leave no velocity: where one yields, u + compliance r is 0.
 * Normals that move nothing (the bounds of rows) yield, and hold all the same. */
static int8_t unyielding(const perp_contact_solver *solver, int32_t k, int32_t begin, int32_t count)
{
    int32_t i;

    if (!solver->complies || solver->entrance == PERP__ENTRANCE_RIGID)
        return (int8_t)count;
    for (i = perp__contact_first_row(&solver->problem, k) - begin;
         i < count && solver->compliance[begin + i] == 0.0; i++)
        continue;
    return (int8_t)i;
}

static void fill(perp_contact_solver *solver, const point *x, const double *bias)
{
    perp__hold *hold = &solver->hold;

    for (int32_t k = 0; k < solver->constraints; k++) {
        const int32_t begin =
            k < solver->contacts ? solver->starts[k] : solver->rows + k - solver->contacts;

        hold->holds[k] =
            unyielding(solver, k, begin, k < solver->contacts ? holds(solver, x, k) : 1);
        hold->beside[k] = PERP__RIGID_AT_REST;
        hold->pushed[k] = 0;
        for (int32_t i = begin; i < begin + hold->holds[k]; i++)
            hold->pushed[k] |= bias[i] != 0.0;
    }
    if (solver->entrance == PERP__ENTRANCE_RIGID)
        perp__rigid_beside(solver, hold->holds, hold->beside, hold->pushed);
    hold->bias = bias;
    hold->r = x->r;
}

/* Between the caller's order and that of the blocks. */
static void exchange(const perp_contact_solver *solver, double *v, int32_t back)
{
    const perp__bodies *b = &solver->bodies;
    double *blocks = solver->hold.v;

    for (int32_t k = 0; k < b->blocks * b->width; k++) {
        const int32_t i = b->C ? k : b->dofs[k];

        if (back && i >= 0)
            v[i] = blocks[k];
        else if (!back)
            blocks[k] = i >= 0 ? v[i] : 0.0;
    }
}

/* v := what the rows that hold leave free. */
static void move_freely(perp_contact_solver *solver, double *v)
{
    exchange(solver, v, 0);
    perp__hold_run(&solver->hold);
    exchange(solver, v, 1);
}

/* Which rows hold. */
static perp_status find_held(perp_contact_solver *solver, const double *r, const double *u,
                             const int8_t *modes)
{
    const point x = {r, u, solver->scale, modes};
    double *bias = solver->high;
    perp_status status;

    solver->hold.rigid = solver->entrance == PERP__ENTRANCE_RIGID ? solver->rigid : NULL;
    status = perp__hold_fit(&solver->hold, &solver->bodies);
    if (status != PERP_OK)
        return status;
    if (asks_for_terms(solver, u, modes))
        perp__absolute_bodies(&solver->bodies, r, solver->q, solver->bodies.y, solver->scale);
    find_bias(solver, bias);
    fill(solver, &x, bias);
    return PERP_OK;
}

perp_status perp__contact_hold(perp_contact_solver *solver, const double *r, const double *u,
                               const int8_t *modes, double *v)
{
    const perp_status status = find_held(solver, r, u, modes);

    if (status == PERP_OK)
        move_freely(solver, v);
    return status;
}

static void write_held_zeros(perp_contact_solver *solver, double *u)
{
    int32_t k, i, row = 0;

    for (k = 0; k < solver->constraints; k++) {
        const int32_t rows = solver->bodies.rows[k + 1] - solver->bodies.rows[k];

        for (i = 0; i < rows; i++, row++)
            if (i < solver->hold.holds[k])
                u[row] = 0.0;
    }
}

/* out += |A|'x */
static void add_terms(const perp__matrix *A, const double *x, double *out)
{
    for (int32_t j = 0; A->column_starts && j < A->columns; j++)
        for (int32_t k = A->column_starts[j]; k < A->column_starts[j + 1]; k++)
            out[j] += fabs(A->values[k]) * x[A->row_indices[k]];
    for (int32_t i = 0; !A->column_starts && i < A->rows; i++)
        for (int32_t j = 0; j < A->columns; j++)
            out[j] +=
                fabs(A->values[(size_t)i * A->row_stride + (size_t)j * A->column_stride]) * x[i];
}

/* A contact that opens has no impulse that could be wrong. `scale` is at hand. */
static int32_t opens(const perp_contact_solver *solver, int32_t k)
{
    const int32_t row = solver->bodies.rows[k];

    return k < solver->contacts && solver->best.modes[k] == PERP_CONTACT_SEPARATE &&
           solver->best.u[row] > ROUNDING * solver->scale[row];
}

/* push := what zeros in v may take of the momentum in each coordinate: what the impulses there may
 * be wrong by, that is tol of all that their contacts' velocities are made of, and rounding of what
 * acts. */
static void find_slack(perp_contact_solver *solver)
{
    const perp__dynamics *d = &solver->dynamics;
    const perp__bodies *b = &solver->bodies;
    double *x = solver->high;

    perp__absolute_bodies(b, solver->best.r, solver->load, b->y, solver->scale);
    for (int32_t k = 0; k < solver->constraints; k++) {
        const double size = perp__contact_length(solver->scale, b->rows[k], b->rows[k + 1]);

        for (int32_t i = b->rows[k]; i < b->rows[k + 1]; i++)
            x[i] = opens(solver, k) ? 0.0 : size / solver->trace[k];
    }
    for (int32_t j = 0; j < solver->n; j++)
        solver->push[j] = 0.0;
    add_terms(&d->H, x, solver->push);
    add_terms(&d->G, x + d->H.rows, solver->push);
    for (int32_t j = 0; j < solver->n; j++)
        solver->push[j] = KNOWN * solver->settings.tol * solver->push[j] +
                          SMALL * (solver->push[j] + fabs(solver->call->f[j]));
}

/* Whether the momentum of the whole block can do without the velocity of coordinate j. */
static int32_t is_spare(const perp_contact_solver *solver, int32_t block, int32_t j,
                        double velocity)
{
    const perp__bodies *b = &solver->bodies;
    const int32_t width = b->width;
    const double *L = b->factors + (size_t)block * (size_t)(width * width);

    for (int32_t i = 0; i < width; i++) {
        const int32_t dof = b->dofs[block * width + i];
        double mass = 0.0;

        for (int32_t k = 0; k <= i && k <= j; k++)
            mass += L[i * width + k] * L[j * width + k];
        if (dof >= 0 && !(fabs(mass * velocity) <= solver->push[dof]))
            return 0;
    }
    return 1;
}

/* Whether anything that moves could do without: else what the rows leave free is not asked for. */
static int32_t may_rest(const perp_contact_solver *solver)
{
    const perp__bodies *b = &solver->bodies;

    for (int32_t k = 0; k < b->blocks * b->width; k++) {
        const double v = b->dofs[k] >= 0 ? solver->best_v[b->dofs[k]] : 0.0;

        if (v != 0.0 && is_spare(solver, k / b->width, k % b->width, v))
            return 1;
    }
    return 0;
}

/* What moves is made by the impulses, M v = f + H'r to the last bits: only zeros are new. Beside a
 * body of next to no mass W tells little of the impulses on the others, and beside a coordinate of
 * next to no mass of those on the other coordinates: where a zero would take more than what acts
 * there is worth, v keeps what the impulses make of it. */
static void take_zeros(perp_contact_solver *solver)
{
    const perp__bodies *b = &solver->bodies;

    for (int32_t k = 0; k < b->blocks * b->width; k++) {
        double *v = b->dofs[k] >= 0 ? &solver->best_v[b->dofs[k]] : NULL;

        if (!v || *v == 0.0 || solver->v[b->dofs[k]] != 0.0)
            continue;
        if (is_spare(solver, k / b->width, k % b->width, *v))
            *v = 0.0;
    }
}

perp_status perp__contact_hold_best(perp_contact_solver *solver)
{
    perp__contact_candidate *best = &solver->best;
    perp_status status;

    if (!perp__is_good(best->outcome))
        return PERP_OK;
    if (!solver->has_bodies || solver->entrance != PERP__ENTRANCE_DYNAMICS) {
        perp__contact_write_zeros(solver, best->modes, best->u);
        return PERP_OK;
    }
    find_slack(solver);
    status = find_held(solver, best->r, best->u, best->modes);
    if (status != PERP_OK)
        return status;
    if (may_rest(solver)) {
        perp__copy(solver->v, solver->best_v, solver->n);
        move_freely(solver, solver->v);
        take_zeros(solver);
    }
    if (solver->n > 0)
        memset(solver->v_low, 0, (size_t)solver->n * sizeof *solver->v_low);
    perp__dynamics_relative(&solver->dynamics, solver->best_v, solver->v_low, solver->call->w,
                            solver->call->b, best->u);
    for (int32_t i = 0; solver->complies && i < solver->size; i++)
        best->u[i] += solver->compliance[i] * best->r[i];
    write_held_zeros(solver, best->u);
    perp__contact_write_zeros(solver, best->modes, best->u);
    return PERP_OK;
}
