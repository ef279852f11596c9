/* Polish: re-solves the index set that a method ended with, refines it with residuals of the
 * caller's matrix in doubled precision, repairs a few signs, keeps the best point it meets. A
 * singular block gets a proximal term rho I: the refinement then is the proximal point method, and
 * the true residual decides. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "lcp/solver.h"

/* Rounds of sign repairs: where solutions fade out (an option far out of the money) the active set
 * grows by a node a round; sparse factorisations are cheap enough to follow it. */
#define PERP__REPAIRS_DENSE 8
#define PERP__REPAIRS_SPARSE 64

static const double proximal[] = {0.0, 1e-13, 1e-10, 1e-7};

static void layout(perp__arena *arena, void *object)
{
    perp_lcp_solver *solver = object;
    perp__polish *p = &solver->polish;
    size_t n = (size_t)solver->n;

    p->active = perp__arena_take(arena, n, sizeof(int32_t));
    p->places = perp__arena_take(arena, n, sizeof(int8_t));
    PERP__DOUBLES(arena, n, &p->z, &p->w_high, &p->w_low, &p->step);
}

perp_status perp__polish_fit(perp_lcp_solver *solver)
{
    perp__polish *p = &solver->polish;
    perp_status status;

    if (p->fitted == solver->shape)
        return PERP_OK;
    status = perp__arena_fit(&p->arena, solver->context, layout, solver);
    p->fitted = status == PERP_OK ? solver->shape : 0;
    return status;
}

/* Whether the equations hold as well as a double z allows: a look that costs less than a solve. */
static bool is_refined(perp_lcp_solver *solver, int32_t count)
{
    perp__find_reach(solver);
    for (int32_t k = 0; k < count; k++) {
        const int32_t i = solver->polish.active[k];
        const double size =
            solver->row_norms[i] * solver->reach[solver->part[i]] + fabs(solver->q_scaled[i]);

        if (!(fabs(perp__w_scaled(solver, i, solver->w_high[i])) <= DBL_EPSILON * size))
            return 0;
    }
    return 1;
}

/* Iterative refinement of M_AA z_A = -(q_A + M_AN z_N), not projected, from w of solver->z to that
 * of the refined one. PERP_OK or _MEMORY. */
static perp_status refine(perp_lcp_solver *solver, int32_t count)
{
    perp__polish *p = &solver->polish;
    double last = INFINITY;

    for (int32_t round = 0; round < DBL_MANT_DIG && count > 0 && !perp__is_past(solver->deadline);
         round++) {
        double largest = 0.0, rate, z_largest = 0.0;
        perp_status status;

        /* 1. step := block^-1 residual_A, scaled */
        for (int32_t k = 0; k < count; k++) {
            const int32_t i = p->active[k];

            p->step[i] = perp__w_scaled(solver, i, solver->w_high[i] + solver->w_low[i]);
        }
        status = perp__sparse_block_solve_roughly(&solver->block, p->step);
        if (status < 0)
            return status;
        for (int32_t k = 0; k < count; k++) {
            const double size = fabs(p->step[p->active[k]]);

            if (!(size <= largest))
                largest = size;
        }
        if (status != PERP_OK || !(largest < 0.5 * last) || largest == 0.0)
            break; /* no longer converging, or nothing left */
        /* 2. z_A := z_A - step, and its w */
        for (int32_t k = 0; k < count; k++) {
            const int32_t i = p->active[k];
            const double z = perp__z_scaled(solver, i, solver->z[i]) - p->step[i];

            solver->z[i] = perp__z_caller(solver, i, z);
            z_largest = fabs(z) > z_largest ? fabs(z) : z_largest;
        }
        perp__multiply_doubled(&solver->M, solver->z, solver->q, solver->w_high, solver->w_low);
        /* 3. the next step would be shorter at the same rate */
        rate = round > 0 ? fmin(1.0, 8.0 * largest / last) : 1.0;
        if (rate * largest <= DBL_EPSILON * z_largest ||
            (solver->S.column_starts && is_refined(solver, count)))
            break;
        last = largest;
    }
    return PERP_OK;
}

/* Moves what left its bounds onto them and frees the rows whose w has the wrong sign beyond
 * rounding. Returns how many changed. */
static int32_t repair(perp_lcp_solver *solver)
{
    int8_t *places = solver->places;
    int32_t changes = 0, i;

    perp__find_reach(solver);
    for (i = 0; i < solver->n; i++) {
        int8_t before = places[i];
        double noise =
            PERP__ROUNDING_LIMIT *
            (solver->row_norms[i] * solver->reach[solver->part[i]] + fabs(solver->q_scaled[i]));
        double w = perp__w_scaled(solver, i, solver->w_high[i]);

        if (before == PERP__BETWEEN && solver->z[i] < solver->lower[i])
            places[i] = PERP__AT_LOWER;
        else if (before == PERP__BETWEEN && solver->z[i] > solver->upper[i])
            places[i] = PERP__AT_UPPER;
        else if ((before == PERP__AT_LOWER && w < -noise) ||
                 (before == PERP__AT_UPPER && w > noise))
            places[i] = PERP__BETWEEN;
        changes += places[i] != before;
    }
    return changes;
}

static void remember(perp_lcp_solver *solver, perp__evaluation *best,
                     const perp__evaluation *residuals)
{
    perp__polish *p = &solver->polish;
    size_t bytes = (size_t)solver->n * sizeof(double);

    *best = *residuals;
    memcpy(p->z, solver->z, bytes);
    memcpy(p->w_high, solver->w_high, bytes);
    memcpy(p->w_low, solver->w_low, bytes);
}

static void recall(perp_lcp_solver *solver)
{
    perp__polish *p = &solver->polish;
    size_t bytes = (size_t)solver->n * sizeof(double);

    memcpy(solver->z, p->z, bytes);
    memcpy(solver->w_high, p->w_high, bytes);
    memcpy(solver->w_low, p->w_low, bytes);
}

bool perp__polish_correct(perp_lcp_solver *solver, perp__evaluation *residuals)
{
    perp__polish *p = &solver->polish;
    const size_t bytes = (size_t)solver->n * sizeof *p->z;
    double *residual = p->w_high, largest = 0.0, z_largest = 0.0;

    if (!solver->correct)
        return 0;
    /* 1. The residual on the rows between the bounds, scaled; where z is not at the bound that its
     * place says, w is not that of the index set. */
    for (int32_t i = 0; i < solver->n; i++) {
        const double z = solver->z[i];

        residual[i] = 0.0;
        if (solver->places[i] == PERP__BETWEEN)
            residual[i] = perp__w_scaled(solver, i, solver->w_high[i]);
        else if (z != (solver->places[i] == PERP__AT_UPPER ? solver->upper[i] : solver->lower[i]))
            return 0;
    }
    if (!solver->correct(solver->correct_work, residual, p->step))
        return 0;
    /* 2. z := z - step; the last one if it is small beside z */
    memcpy(p->z, solver->z, bytes);
    for (int32_t i = 0; i < solver->n; i++) {
        const double step = p->step[i], z = perp__z_scaled(solver, i, solver->z[i]) - step;

        if (!(fabs(step) <= largest))
            largest = fabs(step);
        if (fabs(z) > z_largest)
            z_largest = fabs(z);
        if (solver->places[i] == PERP__BETWEEN)
            solver->z[i] = perp__z_caller(solver, i, z);
    }
    if (largest <= PERP__LAST_STEP * z_largest) {
        *residuals = perp__evaluate(solver);
        if (perp__is_exact(solver, residuals))
            return 1;
    }
    /* 3. Else all is as it was. */
    memcpy(solver->z, p->z, bytes);
    perp__find_product(solver);
    return 0;
}

/* One value of rho: solve, repair, solve again. */
static perp_status attempt(perp_lcp_solver *solver, int32_t rounds, double rho,
                           perp__evaluation *best)
{
    const int32_t *active = solver->polish.active;
    int32_t changes = 1;
    perp_status status = PERP_OK;

    for (int32_t round = 0; round < rounds && changes > 0; round++) {
        int32_t count = 0, moved = 0;
        perp__evaluation residuals;

        if (perp__is_past(solver->deadline))
            break;
        /* 1. Rows that are not between the bounds go to theirs. */
        for (int32_t i = 0; i < solver->n; i++) {
            const double bound =
                solver->places[i] == PERP__AT_UPPER ? solver->upper[i] : solver->lower[i];

            if (solver->places[i] == PERP__BETWEEN) {
                solver->polish.active[count++] = i;
            } else {
                moved |= !(solver->z[i] == bound);
                solver->z[i] = bound;
            }
        }
        /* 2. The equations of those that are. */
        status = rho > 0.0 ? perp__sparse_block_factor(&solver->block, active, count, rho)
                           : perp__sparse_block_approach(&solver->block, active, count);
        if (status != PERP_OK)
            break;
        if (moved) /* else w is that of the last evaluation */
            perp__multiply_doubled(&solver->M, solver->z, solver->q, solver->w_high, solver->w_low);
        status = refine(solver, count);
        if (status != PERP_OK)
            break;
        /* 3. The signs; an exact solve of an index set beats a rough point of a slightly smaller
         * residual. */
        changes = repair(solver);
        residuals = changes > 0 ? perp__evaluate(solver) : perp__evaluate_product(solver);
        if (residuals.tested <= best->tested ||
            (perp__is_exact(solver, &residuals) && residuals.tested <= 64.0 * best->tested))
            remember(solver, best, &residuals);
        if (perp__is_exact(solver, best))
            break;
    }
    return status == PERP__FACTOR_SINGULAR ? PERP_OK : status;
}

perp_status perp__polish_run(perp_lcp_solver *solver, perp__evaluation *residuals, bool is_good)
{
    const int32_t rounds = solver->S.column_starts ? PERP__REPAIRS_SPARSE : PERP__REPAIRS_DENSE;
    perp_status status = PERP_OK;
    perp__evaluation best = *residuals;

    if (is_good && solver->settings.tol >= PERP__ROUGH_TOLERANCE)
        return PERP_OK; /* nobody asked for last digits */
    remember(solver, &best, residuals);
    memcpy(solver->polish.places, solver->places, (size_t)solver->n);
    for (size_t k = 0; k < sizeof proximal / sizeof *proximal; k++) {
        memcpy(solver->places, solver->polish.places, (size_t)solver->n);
        status = attempt(solver, rounds, proximal[k], &best);
        if (status != PERP_OK || perp__is_exact(solver, &best) || perp__is_past(solver->deadline))
            break;
        recall(solver);
    }
    recall(solver);
    *residuals = best;
    return status;
}
