/* Bilateral rows taken out of a problem whose contacts are fewer than its velocities, as those of
 * robots are: with b the bilateral rows and c those of the contacts,
 *
 *   r_b = -W_bb^-1 (q_b + W_bc r_c),
 *   u_c = (W_cc - W_cb W_bb^-1 W_bc) r_c + q_c - W_cb W_bb^-1 q_b
 *
 * (static condensation; the operational-space inertia of Khatib 1987). W_bb is as sparse as the
 * joints' graph: a chain or a tree has factors without fill. What is left is small and dense, and
 * sweeps and active sets, which joints slow down, come to its answer quickly. The answer is judged
 * as any other, on the whole problem. Redundant joints have no such factors. */
#include <math.h>
#include <string.h>

#include "contact/contact.h"
#include "contact/solver.h"

/* Beside its diagonal, from where on a pivot, or what joints leave of a contact's row, may be
 * rounding. */
#define REDUNDANT 1e-9

/* Rows of contacts up to which the rest is worth being dense. */
enum { CONTACT_ROWS_MOST = 300 };

static void lay_out(perp__arena *arena, void *object)
{
    perp__contact_condensed *own = object;
    const size_t rows = (size_t)own->sizes[0], joints = (size_t)own->sizes[1];

    PERP__INTEGERS(arena, joints, &own->rows, &own->all);
    own->position = perp__arena_take(arena, rows + joints, sizeof(int32_t));
    own->starts = perp__arena_take(arena, joints + 1, sizeof(int32_t));
    own->indices = perp__arena_take(arena, (size_t)own->sizes[2], sizeof(int32_t));
    own->values = perp__arena_take(arena, (size_t)own->sizes[2], sizeof(double));
    PERP__DOUBLES(arena, joints, &own->scale, &own->driven);
    PERP__DOUBLES(arena, rows * joints, &own->response);
    PERP__DOUBLES(arena, rows * rows, &own->W);
    PERP__DOUBLES(arena, rows, &own->q);
}

/* x := W_bb^-1 x */
static void solve_joints(perp__contact_condensed *own, double *x)
{
    const int32_t joints = own->block.columns;

    for (int32_t i = 0; i < joints; i++)
        x[i] *= own->scale[i];
    perp__sparse_cholesky_solve(&own->cholesky, x);
    for (int32_t i = 0; i < joints; i++)
        x[i] *= own->scale[i];
}

/* W_bb and its factors, of a unit diagonal. *made is 0 where rows say the same. */
static perp_status factor_joints(perp_contact_solver *solver, perp__contact_condensed *own,
                                 int32_t *made)
{
    const int32_t joints = solver->size - solver->rows;
    const perp__index_set set = {joints, own->rows, own->position};
    perp_status status;

    for (int32_t i = 0; i < solver->size; i++)
        own->position[i] = i - solver->rows;
    for (int32_t i = 0; i < joints; i++) {
        own->rows[i] = solver->rows + i;
        own->all[i] = i;
        own->scale[i] = 1.0 / sqrt(solver->diagonal[solver->rows + i]);
    }
    perp__principal_csc(&solver->W, &set, own->starts, own->indices, own->values);
    own->block = (perp__matrix){.rows = joints,
                                .columns = joints,
                                .row_stride = 1,
                                .column_stride = 1,
                                .column_starts = own->starts,
                                .row_indices = own->indices,
                                .values = own->values};
    status =
        perp__sparse_cholesky_analyse(&own->cholesky, solver->context, &own->block, own->scale);
    *made = status == PERP_OK &&
            perp__sparse_cholesky_factor(&own->cholesky, own->all, joints, 0.0, -1.0);
    return status;
}

/* Adds to the rows of contacts, of column j of W, -W_cb x, where W is as good as symmetric. */
static void take_out(const perp_contact_solver *solver, const double *x, int32_t count, double *to)
{
    const perp__matrix *W = &solver->W;

    for (int32_t i = 0; i < count; i++) {
        int32_t k = W->column_starts[i + 1];

        while (--k >= W->column_starts[i] && W->row_indices[k] >= solver->rows)
            to[i] -= W->values[k] * x[W->row_indices[k] - solver->rows];
    }
}

/* What joints leave of W and q; 0 where that is nothing of some contact. */
static int32_t condense(const perp_contact_solver *solver, perp__contact_condensed *own)
{
    const perp__matrix *W = &solver->W;
    const size_t rows = (size_t)solver->rows, joints = (size_t)own->block.columns;
    int32_t good = 1;

    memset(own->W, 0, rows * rows * sizeof *own->W);
    memset(own->response, 0, rows * joints * sizeof *own->response);
    for (size_t j = 0; j < rows; j++) {
        double *column = own->W + j * rows, *response = own->response + j * joints;

        for (int32_t k = W->column_starts[j]; k < W->column_starts[j + 1]; k++)
            if (W->row_indices[k] < solver->rows)
                column[W->row_indices[k]] = W->values[k];
            else
                response[W->row_indices[k] - solver->rows] = W->values[k];
        solve_joints(own, response);
        take_out(solver, response, (int32_t)j + 1, column);
        for (size_t i = 0; i < j; i++)
            own->W[j + i * rows] = column[i];
        good &= column[j] > REDUNDANT * solver->diagonal[j];
    }
    perp__copy(own->driven, solver->q + rows, (int32_t)joints);
    solve_joints(own, own->driven);
    perp__copy(own->q, solver->q, solver->rows);
    take_out(solver, own->driven, solver->rows, own->q);
    return good;
}

/* A solver of the contacts alone, whose numbers need no checks. */
static perp_status set_up(const perp_contact_solver *solver, perp__contact_condensed *own)
{
    const size_t contacts = (size_t)solver->contacts;
    perp_status status =
        own->solver ? PERP_OK : perp__contact_create(solver->context, &own->solver, NULL);
    perp_contact_solver *inner = own->solver;

    if (status != PERP_OK)
        return status;
    inner->settings = solver->settings;
    inner->settings.method = PERP_CONTACT_METHOD_AUTO;
    inner->entrance = PERP__NO_PROBLEM;
    inner->contacts = inner->constraints = solver->contacts;
    inner->rows = inner->size = solver->rows;
    inner->proves = 0;
    inner->brief = inner->is_condensed = 1;
    inner->sizes[0] = inner->sizes[2] = contacts;
    inner->sizes[1] = (size_t)solver->rows;
    inner->setups++;
    status = perp__arena_fit_sizes(&inner->arena, inner->context, perp__contact_lay_out, inner,
                                   inner->fitted, inner->sizes, 5);
    if (status != PERP_OK)
        return status;
    memcpy(inner->starts, solver->starts, (contacts + 1) * sizeof *inner->starts);
    memcpy(inner->dims, solver->dims, contacts * sizeof *inner->dims);
    memcpy(inner->two_sided, solver->two_sided, contacts * sizeof *inner->two_sided);
    perp__copy(inner->mu, solver->mu, solver->contacts);
    perp__copy(inner->rolling, solver->rolling, solver->contacts);
    perp__copy(inner->spinning, solver->spinning, solver->contacts);
    perp__copy(inner->bound, solver->bound, solver->contacts);
    perp__copy(inner->compliance, solver->compliance, solver->rows);
    inner->rolls = solver->rolls;
    inner->spins = solver->spins;
    inner->complies = solver->complies;
    inner->has_discs = solver->has_discs;
    inner->holds_both = solver->holds_both;
    inner->has_bounds = solver->has_bounds;
    inner->W = (perp__matrix){.rows = solver->rows,
                              .columns = solver->rows,
                              .row_stride = 1,
                              .column_stride = (size_t)solver->rows,
                              .values = own->W};
    status = perp__contact_finish_setup(inner);
    if (status == PERP_OK)
        inner->entrance = PERP__ENTRANCE_DELASSUS;
    return status;
}

/* Once for the same rows: what goes on from there is what this did not solve. */
int32_t perp__contact_condenses(const perp_contact_solver *solver)
{
    return solver->entrance == PERP__ENTRANCE_RIGID && solver->size > solver->rows &&
           solver->rows <= CONTACT_ROWS_MOST && solver->settings.cone == 0 &&
           solver->settings.max_iterations >= 0 && !solver->rigid->again;
}

perp_status perp__contact_solve_condensed(perp_contact_solver *solver, int32_t *found)
{
    perp__contact_condensed *own = &solver->condensed;
    const size_t rows = (size_t)solver->rows, joints = (size_t)(solver->size - solver->rows);
    perp__contact_call call = {0};
    int32_t made = 1, method = PERP_CONTACT_METHOD_POLISH;
    double *joint_r = solver->r + rows;
    perp__contact_worth worth;
    perp_status status = perp__contact_delassus(solver, &made);

    /* 1. The contacts alone. */
    if (status != PERP_OK || !made)
        return status;
    own->sizes[0] = rows;
    own->sizes[1] = joints;
    own->sizes[2] = (size_t)solver->W.column_starts[solver->size];
    status = perp__arena_fit_sizes(&own->arena, solver->context, lay_out, own, own->fitted,
                                   own->sizes, 3);
    PERP__THEN(status, factor_joints(solver, own, &made));
    if (status != PERP_OK || !made || !condense(solver, own))
        return status;
    if (rows > 0)
        status = set_up(solver, own);
    if (status == PERP_ERROR_ARGUMENT || status == PERP_ERROR_NOT_FINITE)
        return PERP_OK; /* numbers too far apart */
    if (rows > 0 && status == PERP_OK) {
        call.q = own->q;
        call.r0 = solver->call->r0;
        status = perp__contact_find(own->solver, &call, solver->deadline);
        solver->iterations += status == PERP_OK ? own->solver->iterations : 0;
        own->solver->call = NULL;
    }
    *found = status == PERP_OK;
    if (status != PERP_OK)
        return status;

    /* 2. Their answer, with what joints have to do with it: a candidate. */
    for (size_t i = 0; i < joints; i++)
        joint_r[i] = -own->driven[i];
    for (size_t j = 0; j < rows; j++) {
        solver->r[j] = own->solver->best.r[j];
        for (size_t i = 0; i < joints && solver->r[j] != 0.0; i++)
            joint_r[i] -= own->response[i + j * joints] * solver->r[j];
    }
    if (rows > 0) {
        memcpy(solver->modes, own->solver->best.modes, (size_t)solver->contacts);
        method = own->solver->best.method;
    }
    return perp__contact_consider(solver, method, solver->modes, &worth);
}
