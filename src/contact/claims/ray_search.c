/* Finds the y of ray.c: y_n >= 0 and s with W y = 0 and y'q < 0.
 *
 * Such a y is the secondary ray of the LCP of the normal impulses alone (bilateral ones free),
 * whose matrix N is a block of W, symmetric and positive semidefinite: infeasible problems, and
 * only those, end in one. Rounding hides this where N is singular only to its last bits. Then the
 * problem with N + eps D, D the diagonal, always has a solution z, and eps z tends to the y of
 * least D-norm with eps; where z is large, its positive part shows which rows take part, and
 * Newton's method with the residual W y in doubled precision, from H and M where those are known,
 * does the rest. */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "contact/law.h"
#include "contact/solver.h"
#include "linalg/blas.h"

/* Most rows of N: it is dense. */
enum { MOST = 3000 };

/* Beside D: what makes N regular, and what makes the block that is refined so. */
#define SOFT 1e-7
#define REGULAR 1e-12

/* Of the largest: what takes part. Impulses on rows that don't are of order eps beside it. */
#define TAKES_PART 1e-4

static void lay_out(perp__arena *arena, void *object)
{
    perp_contact_solver *solver = object;
    perp__contact_ray *own = &solver->feasibility;
    const size_t n = (size_t)own->n, size = (size_t)solver->size;
    const size_t velocities = (size_t)solver->n;

    own->M = perp__arena_take(arena, n, n * sizeof(double));
    own->K = perp__arena_take(arena, n, n * sizeof(double));
    PERP__DOUBLES(arena, n, &own->q, &own->impulse, &own->velocity, &own->lower, &own->z,
                  &own->direction, &own->step);
    PERP__INTEGERS(arena, n, &own->rows, &own->active, &own->pivots);
    own->zeros = perp__arena_take(arena, size > velocities ? size : velocities, sizeof(double));
}

/* Normals of contacts and bilateral rows: how many, and which where there is room for them. */
static int32_t find_rows(const perp_contact_solver *solver, int32_t *rows)
{
    int32_t n = 0;

    for (int32_t i = 0; i < solver->size; i++) {
        const int32_t k = solver->constraint_of[i];

        if (k >= solver->contacts ||
            i < solver->starts[k] + perp__contact_normals(&solver->problem, k)) {
            if (rows)
                rows[n] = i;
            n++;
        }
    }
    return n;
}

static void fill(perp_contact_solver *solver)
{
    perp__contact_ray *own = &solver->feasibility;
    const size_t n = (size_t)own->n;

    find_rows(solver, own->rows);
    for (int32_t j = 0; j < own->n; j++) {
        const int32_t row = own->rows[j], k = solver->constraint_of[row];

        perp__contact_units(&solver->problem, k, &own->impulse[j], &own->velocity[j]);
        own->q[j] = solver->q[row] / own->velocity[j];
        own->lower[j] = k < solver->contacts && solver->two_sided[k] == 0 ? 0.0 : -INFINITY;
    }
    for (int32_t j = 0; j < own->n; j++)
        for (int32_t i = 0; i < own->n; i++)
            own->M[(size_t)i + (size_t)j * n] =
                perp__contact_couples(&solver->problem, solver->constraint_of[own->rows[i]],
                                      solver->constraint_of[own->rows[j]])
                    ? perp__entry(&solver->W, own->rows[i], own->rows[j]) *
                          (own->impulse[j] / own->velocity[i])
                    : 0.0;
}

/* The LCP of M, q and lower, within what is left of the time limit. One whose numbers overflow in
 * the units of fill() is none: it stalls, and nothing is found by it. */
static perp_status solve(perp_contact_solver *solver, perp_lcp_result *result)
{
    perp__contact_ray *own = &solver->feasibility;
    const perp_matrix M = perp__view(PERP_STORAGE_COLUMN_MAJOR, own->n, own->n, own->M);
    perp_lcp_settings settings;
    perp_status status = perp_lcp_settings_init(&settings, sizeof settings);

    if (solver->deadline > 0.0)
        settings.time_limit = perp__time_left(solver->deadline);
    settings.max_iterations = solver->settings.max_iterations;
    PERP__THEN(status, perp__lcp_set(own->lcp, &settings));
    PERP__THEN(status, perp_lcp_result_init(result, sizeof *result));
    result->outcome = PERP_OUTCOME_STALLED;
    if (!perp__all_finite(own->M, (size_t)own->n * (size_t)own->n) ||
        !perp__all_finite(own->q, (size_t)own->n))
        return status;
    PERP__THEN(status, perp__lcp_setup(own->lcp, &M, own->lower, NULL));
    PERP__THEN(status,
               perp__lcp_solve(own->lcp, own->z, NULL, own->direction, result, own->q, NULL));
    solver->iterations += result->iterations;
    return status;
}

/* y := x on the rows of N, 0 elsewhere. */
static void lift(const perp_contact_solver *solver, const double *x, double *y)
{
    const perp__contact_ray *own = &solver->feasibility;

    memset(y, 0, (size_t)solver->size * sizeof *y);
    for (int32_t i = 0; i < own->n; i++)
        y[own->rows[i]] = x[i] * own->impulse[i];
}

/* direction := the part of z that takes part, largest entry 1, and its rows. False if there is
 * none, or z is no larger than what N with a solution would have. */
static int32_t read_direction(perp_contact_solver *solver)
{
    perp__contact_ray *own = &solver->feasibility;
    const double largest = perp__largest(own->z, own->n);

    own->count = 0;
    if (!(largest > 0.0) || !isfinite(largest))
        return 0;
    for (int32_t i = 0; i < own->n; i++) {
        own->direction[i] = own->z[i] / largest;
        if (own->lower[i] == 0.0 && own->direction[i] < TAKES_PART)
            own->direction[i] = 0.0;
        else
            own->active[own->count++] = i;
    }
    return own->count > 0;
}

static int32_t factor(perp__contact_ray *own)
{
    for (int32_t j = 0; j < own->count; j++)
        for (int32_t i = 0; i < own->count; i++) {
            const size_t at = (size_t)own->active[i] + (size_t)own->active[j] * (size_t)own->n;

            own->K[(size_t)i + (size_t)j * (size_t)own->count] =
                own->M[at] * (i == j ? 1.0 + REGULAR : 1.0);
        }
    return perp__lu_factor(own->count, own->K, own->count, own->pivots) == 0;
}

/* u := W y, from H and M where those are known. */
static perp_status multiply(perp_contact_solver *solver, const double *y, double *u)
{
    perp__dynamics *d = &solver->dynamics;
    perp_status status;

    if (solver->entrance == PERP__ENTRANCE_DELASSUS) {
        perp__multiply_doubled(&solver->W, y, NULL, u, solver->low);
        return PERP_OK;
    }
    if (solver->entrance == PERP__ENTRANCE_RIGID) {
        perp__bodies_multiply(&solver->bodies, y, NULL, u);
        return PERP_OK;
    }
    status = perp__dynamics_velocities(d, solver->feasibility.zeros, y, solver->v, solver->v_low);
    solver->is_free = 0;
    if (status != PERP_OK)
        return status;
    perp__dynamics_relative(d, solver->v, solver->v_low, solver->feasibility.zeros, NULL, u);
    for (int32_t i = 0; solver->complies && i < solver->size; i++)
        u[i] += solver->compliance[i] * y[i];
    return PERP_OK;
}

/* Newton's method for W y = 0 in the rows that take part, next to where it starts. */
static perp_status refine(perp_contact_solver *solver)
{
    enum { STEPS = 5 };
    perp__contact_ray *own = &solver->feasibility;
    perp_status status = PERP_OK;

    for (int32_t step = 0; step < STEPS && status == PERP_OK; step++) {
        lift(solver, own->direction, solver->start);
        status = multiply(solver, solver->start, solver->u);
        for (int32_t i = 0; i < own->count; i++)
            own->step[i] = solver->u[own->rows[own->active[i]]] / own->velocity[own->active[i]];
        perp__lu_solve(own->count, own->K, own->count, own->pivots, own->step, 0);
        for (int32_t i = 0; i < own->count; i++)
            own->direction[own->active[i]] -= own->step[i];
    }
    return status;
}

/* A direction that Newton's method changed beyond recognition was none. */
static int32_t is_still_one(const perp_contact_solver *solver)
{
    const perp__contact_ray *own = &solver->feasibility;

    return perp__all_finite(own->direction, (size_t)own->n) &&
           perp__largest(own->direction, own->n) > 0.1;
}

static perp_status search_softened(perp_contact_solver *solver)
{
    perp__contact_ray *own = &solver->feasibility;
    const size_t n = (size_t)own->n;
    perp_lcp_result result;
    perp_status status;

    for (size_t i = 0; i < n; i++)
        own->M[i + i * n] *= 1.0 + SOFT;
    status = solve(solver, &result);
    for (size_t i = 0; i < n; i++)
        own->M[i + i * n] /= 1.0 + SOFT;
    if (status != PERP_OK || result.outcome > PERP_OUTCOME_ROUNDING_LIMIT ||
        !read_direction(solver) || !factor(own))
        return status;
    status = refine(solver);
    if (status == PERP_OK && is_still_one(solver)) {
        lift(solver, own->direction, solver->start);
        perp__contact_keep_ray(solver, solver->start);
    }
    return status;
}

perp_status perp__contact_find_ray(perp_contact_solver *solver)
{
    perp__contact_ray *own = &solver->feasibility;
    perp_lcp_result result;
    perp_status status;
    int32_t made;

    own->n = find_rows(solver, NULL);
    if (own->n > MOST)
        return PERP_OK;
    status = perp__contact_delassus(solver, &made);
    if (status != PERP_OK || !made)
        return status;
    if (!own->lcp)
        status = perp__lcp_create(solver->context, &own->lcp, NULL);
    if (status == PERP_OK && own->fitted != solver->setups)
        status = perp__arena_fit(&own->arena, solver->context, lay_out, solver);
    if (status != PERP_OK)
        return status;
    own->fitted = solver->setups;
    memset(own->zeros, 0,
           (size_t)(solver->n > solver->size ? solver->n : solver->size) * sizeof *own->zeros);
    fill(solver);
    status = solve(solver, &result);
    if (status == PERP_OK && result.has_ray) {
        lift(solver, own->direction, solver->start);
        perp__contact_keep_ray(solver, solver->start);
    }
    if (status == PERP_OK && solver->certificate == PERP_CONTACT_CERTIFICATE_NONE)
        status = search_softened(solver);
    return status;
}
