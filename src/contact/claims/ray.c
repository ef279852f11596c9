/* Proofs that there are no velocities that keep all contacts apart.
 *
 * Farkas: either some v has H_n v + w_n >= 0 and G v + b = 0, or some y_n >= 0 and s have
 * H_n'y_n + G's = 0 and y_n'w_n + s'b < 0. In terms of W: u_n >= 0 is impossible for u = W r + q if
 * y'W = 0 and y'q < 0.
 *
 * Such a y is the secondary ray of the LCP of the normal impulses alone (bilateral ones free),
 * whose matrix N is a block of W, symmetric and positive semidefinite: infeasible problems, and
 * only those, end in one. Rounding hides this where N is singular only to its last bits. Then the
 * problem with N + eps D, D the diagonal, always has a solution z, and eps z tends to the y of
 * least D-norm with eps; where z is large, its positive part shows which rows take part, and
 * Newton's method with the residual W y in doubled precision, from H and M where those are known,
 * does the rest. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "contact/law.h"
#include "contact/solver.h"
#include "linalg/blas.h"
#include "linalg/doubled.h"

/* Most rows of N: it is dense. */
enum { MOST = 3000 };

/* Beside D: what makes N regular. */
#define SOFT sqrt(DBL_EPSILON)

/* Of the largest: what takes part. Impulses on rows that don't are of order eps beside it. */
#define TAKES_PART sqrt(sqrt(DBL_EPSILON))

/* ---- the proof ---- */

/* W'y = 0, H'y + G's = 0 in the caller's H and G, or P'y = 0, which is H'y in the bodies' own
 * coordinates, to rounding. */
static bool annihilates(perp_contact_solver *solver, const double *y)
{
    perp__dynamics *d = &solver->dynamics;
    const perp__bodies *b = &solver->bodies;
    const double *high = solver->high, *low = solver->low;
    double *absolute = solver->scale;
    int32_t n = solver->size;

    if (solver->entrance == PERP__ENTRANCE_DELASSUS) {
        memset(absolute, 0, (size_t)n * sizeof *absolute);
        perp__transposed_doubled(&solver->W, y, NULL, solver->high, solver->low);
        perp__absolute_transposed(&solver->W, y, absolute);
    } else if (solver->entrance == PERP__ENTRANCE_RIGID) {
        n = solver->n;
        absolute = solver->push;
        memset(solver->low, 0, (size_t)solver->size * sizeof *solver->low);
        perp__absolute_bodies(b, y, solver->low, absolute, solver->high);
        perp__bodies_gather(b, y, b->y);
        high = b->y;
        low = NULL;
    } else {
        n = d->n;
        high = d->high;
        low = d->low;
        absolute = solver->v;
        memset(absolute, 0, (size_t)n * sizeof *absolute);
        perp__dynamics_push(d, NULL, y);
        perp__absolute_transposed(&d->H, y, absolute);
        perp__absolute_transposed(&d->G, y + d->H.rows, absolute);
    }
    for (int32_t j = 0; j < n; j++)
        if (!(fabs(high[j] + (low ? low[j] : 0.0)) <= PERP__SUM_ROUNDING * absolute[j]))
            return 0;
    return 1;
}

/* Whether there can be a proof: some contact is to open, or some joint to move. y is paired with
 * what the caller gave, or H M^-1 f + w: since H'y = 0 the load f is of no account. */
static bool may_be_infeasible(perp_contact_solver *solver)
{
    const double *given = solver->scale;
    bool may = 0;

    perp__contact_find_bias(solver, solver->scale);
    for (int32_t k = 0; k < solver->contacts; k++)
        for (int32_t i =
                 perp__contact_first_row(&solver->problem, k); /* what yields is in no way */
             i < solver->starts[k] + perp__contact_normals(&solver->problem, k); i++)
            may |= given[i] < 0.0 || (solver->two_sided[k] > 0 && given[i] > 0.0);
    for (int32_t i = solver->rows; i < solver->size; i++)
        may |= given[i] != 0.0;
    return may;
}

void perp__contact_keep_ray(perp_contact_solver *solver, const double *direction)
{
    const double largest = perp__largest(direction, solver->size);
    double *y = solver->ray, sum = 0.0, error = 0.0, absolute = 0.0;

    if (solver->certificate != PERP_CONTACT_CERTIFICATE_NONE || !(largest > 0.0) ||
        !isfinite(largest))
        return;
    for (int32_t i = 0; i < solver->size; i++)
        y[i] = direction[i] / largest;
    solver->has_ray = 1;

    /* 1. Normals that push, and no friction. */
    for (int32_t k = 0; k < solver->contacts; k++) {
        const int32_t normals = perp__contact_normals(&solver->problem, k);

        if (solver->two_sided[k] == 0 && !(y[solver->starts[k]] >= 0.0))
            return;
        for (int32_t i = solver->starts[k] + normals; i < solver->starts[k + 1]; i++)
            if (y[i] != 0.0)
                return;
    }

    /* 2. y'q < 0 by more than rounding. */
    perp__contact_find_bias(solver, solver->scale);
    for (int32_t i = 0; i < solver->size; i++) {
        perp__accumulate(&sum, &error, y[i], solver->scale[i]);
        absolute += fabs(y[i] * solver->scale[i]);
    }
    if (!(sum + error < -PERP__SUM_ROUNDING * absolute))
        return;

    /* 3. y'W = 0; a soft row gives way, and must have no part. */
    for (int32_t i = 0; solver->complies && i < solver->size; i++)
        if (solver->compliance[i] > 0.0 && y[i] != 0.0)
            return;
    if (annihilates(solver, y))
        solver->certificate = PERP_CONTACT_CERTIFICATE_INFEASIBLE;
}

/* ---- the search ---- */

static void lay_out(perp__arena *arena, void *object)
{
    perp_contact_solver *solver = object;
    perp__contact_ray *space = &solver->feasibility;
    const size_t n = (size_t)space->n;

    space->M = perp__arena_take(arena, n, n * sizeof(double));
    space->K = perp__arena_take(arena, n, n * sizeof(double));
    PERP__DOUBLES(arena, n, &space->q, &space->impulse, &space->velocity, &space->lower, &space->z,
                  &space->direction, &space->step);
    PERP__INTEGERS(arena, n, &space->rows, &space->active, &space->pivots);
}

/* The LCP of M, q and lower, within what is left of the time limit. One whose numbers overflow in
 * the units of fill() is none: it stalls, and nothing is found by it. */
static perp_status solve(perp_contact_solver *solver, perp_lcp_result *result)
{
    perp__contact_ray *space = &solver->feasibility;
    const perp_matrix M = perp__view(PERP_STORAGE_COLUMN_MAJOR, space->n, space->n, space->M);
    perp_lcp_settings settings;
    perp_status status = perp_lcp_settings_init(&settings, sizeof settings);

    if (solver->deadline > 0.0)
        settings.time_limit = perp__time_left(solver->deadline);
    settings.max_iterations = solver->settings.max_iterations;
    PERP__THEN(status, perp__lcp_set(space->lcp, &settings));
    PERP__THEN(status, perp_struct_init(result, sizeof *result));
    result->outcome = PERP_OUTCOME_STALLED;
    if (!perp__all_finite(space->M, (size_t)space->n * (size_t)space->n) ||
        !perp__all_finite(space->q, (size_t)space->n))
        return status;
    PERP__THEN(status, perp__lcp_setup(space->lcp, &M, space->lower, NULL));
    PERP__THEN(status, perp__lcp_solve(space->lcp, space->z, NULL, space->direction, result,
                                       space->q, NULL));
    solver->iterations += result->iterations;
    return status;
}

/* y := x on the rows of N, 0 elsewhere. */
static void lift(const perp_contact_solver *solver, const double *x, double *y)
{
    const perp__contact_ray *space = &solver->feasibility;

    memset(y, 0, (size_t)solver->size * sizeof *y);
    for (int32_t i = 0; i < space->n; i++)
        y[space->rows[i]] = x[i] * space->impulse[i];
}

/* u := W y, from H and M where those are known; of rigid bodies nobody asks. */
static perp_status multiply(perp_contact_solver *solver, const double *y, double *u)
{
    perp__dynamics *d = &solver->dynamics;
    perp_status status;

    if (solver->entrance == PERP__ENTRANCE_DELASSUS) {
        perp__multiply_doubled(&solver->W, y, NULL, u, solver->low);
        return PERP_OK;
    }
    status = perp__dynamics_velocities(d, NULL, y, solver->v, solver->v_low);
    solver->is_free = 0;
    if (status != PERP_OK)
        return status;
    perp__dynamics_relative(d, solver->v, solver->v_low, NULL, NULL, u);
    for (int32_t i = 0; solver->complies && i < solver->size; i++)
        u[i] += solver->compliance[i] * y[i];
    return PERP_OK;
}

/* y from the z of N + eps D: the part of it that takes part, refined. */
static perp_status search_softened(perp_contact_solver *solver)
{
    enum { STEPS = 5 };
    perp__contact_ray *space = &solver->feasibility;
    const size_t n = (size_t)space->n;
    perp_lcp_result result;
    double largest;
    perp_status status;

    /* 1. z. */
    for (size_t i = 0; i < n; i++)
        space->M[i + i * n] *= 1.0 + SOFT;
    status = solve(solver, &result);
    for (size_t i = 0; i < n; i++)
        space->M[i + i * n] /= 1.0 + SOFT;
    largest = perp__largest(space->z, space->n);
    if (status != PERP_OK || result.outcome > PERP_OUTCOME_ROUNDING_LIMIT || !(largest > 0.0) ||
        !isfinite(largest))
        return status;

    /* 2. Its rows, and factors of their block. */
    space->count = 0;
    for (int32_t i = 0; i < space->n; i++) {
        space->direction[i] = space->z[i] / largest;
        if (space->lower[i] == 0.0 && space->direction[i] < TAKES_PART)
            space->direction[i] = 0.0;
        else
            space->active[space->count++] = i;
    }
    for (int32_t j = 0; j < space->count; j++)
        for (int32_t i = 0; i < space->count; i++)
            space->K[(size_t)i + (size_t)j * (size_t)space->count] =
                space->M[(size_t)space->active[i] + (size_t)space->active[j] * n] *
                (i == j ? 1.0 + PERP__REGULAR : 1.0);
    if (space->count == 0 ||
        perp__lu_factor(space->count, space->K, space->count, space->pivots) != 0)
        return status;

    /* 3. Newton's method for W y = 0 in these, next to where it starts; a direction that it changes
     * beyond recognition was none. */
    for (int32_t step = 0; step < STEPS && status == PERP_OK; step++) {
        lift(solver, space->direction, solver->start);
        status = multiply(solver, solver->start, solver->u);
        for (int32_t i = 0; i < space->count; i++)
            space->step[i] =
                solver->u[space->rows[space->active[i]]] / space->velocity[space->active[i]];
        perp__lu_solve(space->count, space->K, space->count, space->pivots, space->step, 0);
        for (int32_t i = 0; i < space->count; i++)
            space->direction[space->active[i]] -= space->step[i];
    }
    if (status == PERP_OK && perp__all_finite(space->direction, n) &&
        perp__largest(space->direction, space->n) > 0.1) {
        lift(solver, space->direction, solver->start);
        perp__contact_keep_ray(solver, solver->start);
    }
    return status;
}

perp_status perp__contact_find_ray(perp_contact_solver *solver)
{
    perp__contact_ray *space = &solver->feasibility;
    perp_lcp_result result;
    int32_t made, n = 0;
    perp_status status;

    space->n = solver->size - solver->rows;
    for (int32_t k = 0; k < solver->contacts; k++)
        space->n += perp__contact_normals(&solver->problem, k);
    if (space->n > MOST || !may_be_infeasible(solver))
        return PERP_OK;
    status = perp__contact_delassus(solver, &made);
    if (status != PERP_OK || !made)
        return status;
    if (!space->lcp)
        status = perp__lcp_create(solver->context, &space->lcp, NULL);
    if (status == PERP_OK && space->fitted != solver->setups)
        status = perp__arena_fit(&space->arena, solver->context, lay_out, solver);
    if (status != PERP_OK)
        return status;
    space->fitted = solver->setups;
    for (int32_t i = 0; i < solver->size; i++) {
        const int32_t k = solver->constraint_of[i];

        if (k >= solver->contacts ||
            i < solver->starts[k] + perp__contact_normals(&solver->problem, k))
            space->rows[n++] = i;
    }
    /* the problem of the normals of contacts and bilateral rows, which `rows` lists by now */
    for (int32_t j = 0; j < n; j++) {
        const int32_t row = space->rows[j], k = solver->constraint_of[row];

        perp__contact_units(&solver->problem, k, &space->impulse[j], &space->velocity[j]);
        space->q[j] = solver->q[row] / space->velocity[j];
        space->lower[j] = k < solver->contacts && solver->two_sided[k] == 0 ? 0.0 : -INFINITY;
    }
    for (int32_t j = 0; j < n; j++)
        for (int32_t i = 0; i < n; i++)
            space->M[(size_t)i + (size_t)j * (size_t)n] =
                perp__contact_couples(&solver->problem, solver->constraint_of[space->rows[i]],
                                      solver->constraint_of[space->rows[j]])
                    ? perp__entry(&solver->W, space->rows[i], space->rows[j]) *
                          (space->impulse[j] / space->velocity[i])
                    : 0.0;
    status = solve(solver, &result);
    if (status == PERP_OK && result.has_ray) {
        lift(solver, space->direction, solver->start);
        perp__contact_keep_ray(solver, solver->start);
    }
    if (status == PERP_OK && solver->certificate == PERP_CONTACT_CERTIFICATE_NONE)
        status = search_softened(solver);
    return status;
}
