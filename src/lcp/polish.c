/* Polish: re-solves the index set that a method ended with, refines it with residuals of the
 * caller's matrix in doubled precision, repairs a few signs, keeps the best point it meets. A
 * singular block gets a proximal term rho I: the refinement then is the proximal point method, and
 * the true residual decides. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/solver.h"
#include "linalg/blas.h"

#define PERP__REFINEMENTS 30
/* Rounds of sign repairs: where solutions fade out (an option far out of the money) the active set
 * grows by a node a round; sparse factorisations are cheap enough to follow it. */
#define PERP__REPAIRS_DENSE 8
#define PERP__REPAIRS_SPARSE 64
/* Of a point that is good as it is: last digits are not worth more. */
#define PERP__REPAIRS_GOOD 4
/* Of sparse blocks: repairs that change more places than this, and for so many rounds no fewer than
 * before, lead nowhere: the index set was that of another problem, or of none. */
#define PERP__MANY_CHANGES 16
#define PERP__PATIENCE 4
/* Below this size a sparse block is factored as a dense one. */
#define PERP__DENSE_BLOCK 64

/* A q this small beside the largest of its part, in common units, is hidden; most rows, one after
 * the other, that are brought to their own terms. */
#define HIDDEN 0x1p-70
#define MOST_SETTLED 64

static const double proximal[] = {0.0, 1e-13, 1e-10, 1e-7};

static int32_t uses_dense(const perp_lcp_solver *solver)
{
    return !solver->M.column_starts || solver->n <= PERP__DENSE_BLOCK;
}

static void layout(perp__arena *arena, void *object)
{
    perp_lcp_solver *solver = object;
    perp__polish *p = &solver->polish;
    size_t n = (size_t)solver->n;
    size_t entries = uses_dense(solver) ? n * n : 0;

    PERP__INTEGERS(arena, n, &p->active, &p->pivots);
    p->places = perp__arena_take(arena, n, sizeof(int8_t));
    PERP__DOUBLES(arena, n, &p->z, &p->w_high, &p->w_low, &p->step);
    p->block = perp__arena_take(arena, entries, sizeof(double));
}

perp_status perp__polish_fit(perp_lcp_solver *solver)
{
    perp__polish *p = &solver->polish;
    perp_status status;

    if (p->fitted == solver->shape)
        return PERP_OK;
    p->fitted = 0;
    status = perp__arena_fit(&p->arena, solver->context, layout, solver);
    if (status != PERP_OK)
        return status;
    p->fitted = solver->shape;
    return PERP_OK;
}

static int32_t factor_dense(perp_lcp_solver *solver, int32_t count, double rho)
{
    perp__polish *p = &solver->polish;
    const perp__matrix *M = &solver->M;
    const double *d = solver->factors;
    int32_t r, k;

    for (int32_t c = 0; c < count; c++) {
        double *column = p->block + (size_t)c * (size_t)count;
        int32_t j = p->active[c];

        if (M->column_starts) {
            memset(column, 0, (size_t)count * sizeof *column);
            for (k = M->column_starts[j], r = 0; k < M->column_starts[j + 1]; k++) {
                while (r < count && p->active[r] < M->row_indices[k])
                    r++;
                if (r < count && p->active[r] == M->row_indices[k])
                    column[r] = M->values[k] * (d[p->active[r]] * d[j]);
            }
        } else {
            const double *from = M->values + (size_t)j * M->column_stride;

            for (r = 0; r < count; r++)
                column[r] = from[(size_t)p->active[r] * M->row_stride] * (d[p->active[r]] * d[j]);
        }
        column[c] += rho;
    }
    return perp__lu_factor(count, p->block, count > 0 ? count : 1, p->pivots) == 0;
}

/* Factors the active block; a singular one is told by *regular = 0. */
static perp_status factor(perp_lcp_solver *solver, int32_t count, double rho, int32_t *regular)
{
    perp_status status = PERP_OK;

    if (uses_dense(solver)) {
        *regular = factor_dense(solver, count, rho);
    } else {
        status = rho > 0.0
                     ? perp__sparse_block_factor(&solver->block, solver->polish.active, count, rho)
                     : perp__sparse_block_approach(&solver->block, solver->polish.active, count);
        *regular = status == PERP_OK;
        if (status == PERP__FACTOR_SINGULAR)
            status = PERP_OK;
    }
    return status;
}

/* step := block^-1 (scaled residual on the active rows), and its largest entry. PERP_OK,
 * PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
static perp_status newton_step(perp_lcp_solver *solver, int32_t count, double *largest)
{
    perp__polish *p = &solver->polish;
    perp_status status = PERP_OK;

    for (int32_t k = 0; k < count; k++) {
        int32_t i = p->active[k];
        double r = perp__w_scaled(solver, i, solver->w_high[i] + solver->w_low[i]);

        p->step[uses_dense(solver) ? k : i] = r;
    }
    if (uses_dense(solver))
        perp__lu_solve(count, p->block, count > 0 ? count : 1, p->pivots, p->step, 0);
    else
        status = perp__sparse_block_solve_roughly(&solver->block, p->step);
    *largest = 0.0;
    for (int32_t k = 0; k < count; k++) {
        double size = fabs(p->step[uses_dense(solver) ? k : p->active[k]]);

        if (!(size <= *largest))
            *largest = size;
    }
    return status;
}

/* Whether the equations hold as well as a double z allows: a look that costs less than a solve. */
static int32_t is_refined(perp_lcp_solver *solver, int32_t count)
{
    perp__find_reach(solver);
    for (int32_t k = 0; k < count; k++) {
        const int32_t i = solver->polish.active[k];
        const double size =
            solver->row_norms[i] * perp__reach_of(solver, i) + fabs(solver->q_scaled[i]);

        if (!(fabs(perp__w_scaled(solver, i, solver->w_high[i])) <= DBL_EPSILON * size))
            return 0;
    }
    return 1;
}

/* The rows between the bounds; the others to theirs, *moved if one was elsewhere. */
static int32_t collect(perp_lcp_solver *solver, int32_t *moved)
{
    int32_t count = 0;

    *moved = 0;
    for (int32_t i = 0; i < solver->n; i++) {
        const double bound =
            solver->places[i] == PERP__AT_UPPER ? solver->upper[i] : solver->lower[i];

        if (solver->places[i] == PERP__BETWEEN) {
            solver->polish.active[count++] = i;
        } else {
            *moved |= !(solver->z[i] == bound);
            solver->z[i] = bound;
        }
    }
    return count;
}

/* Iterative refinement of M_AA z_A = -(q_A + M_AN z_N), not projected, from w of solver->z to that
 * of the refined one. PERP_OK or _MEMORY. */
static perp_status refine(perp_lcp_solver *solver, int32_t count)
{
    perp__polish *p = &solver->polish;
    double last = INFINITY;

    for (int32_t round = 0; round < PERP__REFINEMENTS && count > 0; round++) {
        double largest, rate, z_largest = 0.0;
        perp_status status = newton_step(solver, count, &largest);

        if (status < 0)
            return status;
        if (status != PERP_OK || !(largest < 0.5 * last) || largest == 0.0)
            break; /* no longer converging, or nothing left */
        for (int32_t k = 0; k < count; k++) {
            int32_t i = p->active[k];
            double step = p->step[uses_dense(solver) ? k : i];
            double z = perp__z_scaled(solver, i, solver->z[i]) - step;

            solver->z[i] = perp__z_caller(solver, i, z);
            z_largest = fabs(z) > z_largest ? fabs(z) : z_largest;
        }
        perp__multiply_doubled(&solver->M, solver->z, solver->q, solver->w_high, solver->w_low);
        /* the next step would be shorter at the same rate */
        rate = round > 0 ? fmin(1.0, 8.0 * largest / last) : 1.0;
        if (rate * largest <= DBL_EPSILON * z_largest ||
            (!uses_dense(solver) && is_refined(solver, count)))
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
            16.0 * DBL_EPSILON *
            (solver->row_norms[i] * perp__reach_of(solver, i) + fabs(solver->q_scaled[i]));
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

static void remember(perp_lcp_solver *solver, perp__evaluation *best, const perp__evaluation *worth)
{
    perp__polish *p = &solver->polish;
    size_t bytes = (size_t)solver->n * sizeof(double);

    *best = *worth;
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

/* An exact solve of an index set beats a rough point of a slightly smaller residual. */
static int32_t is_better(const perp_lcp_solver *solver, const perp__evaluation *a,
                         const perp__evaluation *b)
{
    return a->tested <= b->tested || (perp__is_exact(solver, a) && a->tested <= 64.0 * b->tested);
}

/* The residual on the rows between the bounds, in scaled units. 0 where z is not at the bound that
 * its place says: w is not that of the index set then. */
static int32_t take_residual(const perp_lcp_solver *solver, double *residual)
{
    for (int32_t i = 0; i < solver->n; i++) {
        const double z = solver->z[i];

        residual[i] = 0.0;
        if (solver->places[i] == PERP__BETWEEN)
            residual[i] = perp__w_scaled(solver, i, solver->w_high[i]);
        else if (z != (solver->places[i] == PERP__AT_UPPER ? solver->upper[i] : solver->lower[i]))
            return 0;
    }
    return 1;
}

/* z := z - step; true if the step is small beside z. */
static int32_t take_step(perp_lcp_solver *solver, const double *step)
{
    double largest = 0.0, z_largest = 0.0;

    for (int32_t i = 0; i < solver->n; i++) {
        const double z = perp__z_scaled(solver, i, solver->z[i]) - step[i];

        if (!(fabs(step[i]) <= largest))
            largest = fabs(step[i]);
        if (fabs(z) > z_largest)
            z_largest = fabs(z);
        if (solver->places[i] == PERP__BETWEEN)
            solver->z[i] = perp__z_caller(solver, i, z);
    }
    return largest <= PERP__LAST_STEP * z_largest;
}

int32_t perp__polish_correct(perp_lcp_solver *solver, perp__evaluation *worth)
{
    perp__polish *p = &solver->polish;
    double *residual = p->w_high;

    if (!solver->correct || !take_residual(solver, residual) ||
        !solver->correct(solver->correct_work, residual, p->step))
        return 0;
    memcpy(p->z, solver->z, (size_t)solver->n * sizeof *p->z);
    if (take_step(solver, p->step)) {
        *worth = perp__evaluate(solver);
        if (perp__is_exact(solver, worth))
            return 1;
    }
    memcpy(solver->z, p->z, (size_t)solver->n * sizeof *p->z);
    perp__find_product(solver);
    return 0;
}

/* One value of rho: solve, repair, solve again. *wanders: that leads nowhere, by any rho. */
static perp_status attempt(perp_lcp_solver *solver, int32_t rounds, double rho,
                           perp__evaluation *best, int32_t *wanders)
{
    int32_t round, count, moved, regular, changes = 1, least = INT32_MAX, waited = 0;
    perp_status status = PERP_OK;

    for (round = 0; round < rounds && changes > 0; round++) {
        perp__evaluation worth;

        if (round > 0 && perp__is_late(solver))
            break; /* one factorisation is what a time limit may be exceeded by */

        count = collect(solver, &moved);
        status = factor(solver, count, rho, &regular);
        if (status != PERP_OK || !regular)
            break;
        if (moved) /* else w is that of the last evaluation */
            perp__multiply_doubled(&solver->M, solver->z, solver->q, solver->w_high, solver->w_low);
        status = refine(solver, count);
        if (status != PERP_OK)
            break;
        changes = repair(solver);
        worth = changes > 0 ? perp__evaluate(solver) : perp__evaluate_product(solver);
        if (is_better(solver, &worth, best))
            remember(solver, best, &worth);
        waited = changes < least ? 0 : waited + 1;
        least = changes < least ? changes : least;
        *wanders = !uses_dense(solver) && changes > PERP__MANY_CHANGES && waited > PERP__PATIENCE;
        if (perp__is_exact(solver, best) || *wanders)
            break;
    }
    return status;
}

perp_status perp__polish_run(perp_lcp_solver *solver, perp__evaluation *worth)
{
    const int32_t is_good = perp__is_good(perp__lcp_judge(solver, worth, PERP_OUTCOME_STALLED));
    const int32_t rounds = is_good              ? PERP__REPAIRS_GOOD
                           : uses_dense(solver) ? PERP__REPAIRS_DENSE
                                                : PERP__REPAIRS_SPARSE;
    perp_status status = PERP_OK;
    perp__evaluation best = *worth;
    int32_t wanders = 0;

    if (is_good && solver->settings.tol >= PERP__ROUGH_TOLERANCE)
        return PERP_OK; /* nobody asked for last digits */
    remember(solver, &best, worth);
    memcpy(solver->polish.places, solver->places, (size_t)solver->n);
    for (size_t k = 0; k < sizeof proximal / sizeof *proximal; k++) {
        memcpy(solver->places, solver->polish.places, (size_t)solver->n);
        status = attempt(solver, rounds, proximal[k], &best, &wanders);
        if (status != PERP_OK || perp__is_exact(solver, &best) || wanders || perp__is_late(solver))
            break;
        recall(solver);
    }
    recall(solver);
    *worth = best;
    return status;
}

/* ---- rows that others hide ----
 *
 * Where couplings are 1e20 apart and more, a row of the common units can be so small that its
 * neighbours' rounding is as large as all its terms: any z near the answer passes for one, and a
 * step for all rows at once has that much noise. One entry of z for one row has none: the one that
 * the other rows, beside their terms, feel the least. */

/* Whether row i is wrong beside its own terms, which may be q alone, and q_i hidden. */
static int32_t is_hidden(const perp_lcp_solver *solver, int32_t i, const double *terms)
{
    const double violation =
        perp__row_violation(solver->z[i], solver->lower[i], solver->upper[i], solver->w_high[i]);

    return solver->q[i] != 0.0 && perp__w_scaled(solver, i, fabs(solver->q[i])) <= HIDDEN &&
           violation > solver->settings.tol * fmin(fabs(terms[i]), DBL_MAX);
}

int32_t perp__find_hidden(perp_lcp_solver *solver, const perp__evaluation *worth)
{
    double *terms = solver->polish.step;
    int32_t known = 0;

    for (int32_t i = 0; i < solver->n && !worth->small; i++) {
        if (!is_hidden(solver, i, solver->q))
            continue;
        if (!known++)
            perp__find_terms(&solver->M, solver->q, solver->z, NULL, NULL, terms);
        if (is_hidden(solver, i, terms))
            return i;
    }
    return -1;
}

/* What a step of z_j makes of the other rows, at most, beside their terms. */
static double effect_of(const perp_lcp_solver *solver, const double *terms, int32_t i, int32_t j,
                        double step)
{
    double largest = 0.0;

    for (int32_t k = 0; k < solver->n; k++) {
        const double change = fabs(perp__entry(&solver->M, k, j) * step);

        if (k != i && change != 0.0)
            perp__raise_to(&largest, change / terms[k]);
    }
    return largest;
}

/* Takes w_i to 0 by the entry of z, within its bounds, that the other rows feel least, and no more
 * than tol. Returns whether there is one. */
static int32_t settle_row(perp_lcp_solver *solver, const double *terms, int32_t i)
{
    double least = solver->settings.tol, to = 0.0;
    int32_t found = -1;

    for (int32_t j = 0; j < solver->n; j++) {
        const double z = solver->z[j];
        const double step = -solver->w_high[i] / perp__entry(&solver->M, i, j);

        if (z > solver->lower[j] && z < solver->upper[j] && z + step > solver->lower[j] &&
            z + step < solver->upper[j] && isfinite(step) && z + step != z) {
            const double effect = effect_of(solver, terms, i, j, step);

            if (effect < least) {
                least = effect;
                to = z + step;
                found = j;
            }
        }
    }
    if (found >= 0)
        solver->z[found] = to;
    return found >= 0;
}

void perp__polish_hidden(perp_lcp_solver *solver, perp__evaluation *worth)
{
    const perp__evaluation before = *worth;
    int32_t left = MOST_SETTLED, settled = 0, i;

    while (left > 0 && !perp__is_late(solver) && (i = perp__find_hidden(solver, worth)) >= 0) {
        if (!settled++)
            remember(solver, worth, &before);
        left = settle_row(solver, solver->polish.step, i) ? left - 1 : 0;
        *worth = perp__evaluate(solver); /* it may have moved others */
    }
    if (settled > 0 && (left == 0 || !(worth->tested <= solver->settings.tol))) {
        recall(solver);
        *worth = before;
    }
}
