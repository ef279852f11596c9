/* Nonsmooth contact dynamics' block Gauss-Seidel (Jean, Comput. Methods Appl. Mech. Eng. 177 (1999)
 * 235): constraint by constraint, with the newest r throughout, the exact solution of the
 * constraint's own problem
 *   u_k = W_kk r_k + b_k,   b_k = q_k + sum_{j != k} W_kj r_j.
 * A sweep's largest change of r, max sqrt(t_k) |dr_k| / omega, is of the size of the tested
 * residual and costs nothing; once it is small the residual itself is computed. No theorem says
 * that the sweeps converge for Coulomb's law, and where they stagnate or diverge that is said. */
#include "contact/sweep/sweep.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include <perp/contact.h>

#include "base/sweeps.h"

/* The rate is looked at first early, and then whenever the sweeps have doubled; what is slow by
 * then may still come to an end before so many, which are cheap beside what follows. */
#define PATIENCE 160

/* Whether what is left is more than the limit leaves room for, at the rate since there were a
 * quarter as many sweeps: over less they often stand still, and go on. */
static int32_t is_too_slow(perp__sweep_work *work, int64_t limit)
{
    const perp__contact_problem *problem = work->common.problem;
    const double before = work->looked[0];
    double sweeps;

    if (!problem->yields || work->sweeps != work->next_look)
        return 0;
    work->next_look *= 2;
    work->looked[0] = work->looked[1];
    work->looked[1] = work->least;
    if (!(before < INFINITY) || work->least <= problem->tol)
        return 0;
    sweeps =
        0.75 * (double)work->sweeps * log(problem->tol / work->least) / log(work->least / before);
    return work->sweeps >= PATIENCE && !(sweeps >= 0.0 && sweeps <= (double)(limit - work->sweeps));
}

/* A sweep that hardly changes r: is r the solution? `share` of tol is what the change has to be
 * for the question to be worth its cost. */
static int32_t is_solved(perp__sweep_work *work, double change)
{
    const double tol = work->common.problem->tol;
    double residual;

    if (!(change <= work->share * tol))
        return 0;
    perp__sweep_export(work, work->r);
    residual = perp__sweep_residual(work, work->x, work->u);
    if (residual <= tol) {
        work->residual = residual;
        return 1;
    }
    work->share = fmax(1e-3, fmin(0.5 * work->share, change / residual));
    return 0;
}

static void start(perp__sweep_work *work, perp__contact_iterate *iterate)
{
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    const size_t bytes = (size_t)work->size * sizeof *work->r;

    perp__sweep_read(work);
    if (!iterate->warm)
        memset(iterate->r, 0, bytes);
    perp__sweep_import(work, iterate->r);
    if (b)
        perp__bodies_gather(b, iterate->r, work->y);
    for (int32_t i = b && work->stride > b->width ? b->blocks : 0; i-- > 0;) {
        /* by width, then by stride */
        double *block = work->y + (size_t)i * (size_t)work->stride;

        memmove(block, work->y + (size_t)i * (size_t)b->width, (size_t)b->width * sizeof *block);
        memset(block + b->width, 0, (size_t)(work->stride - b->width) * sizeof *block);
    }
    memcpy(work->best, work->r, bytes);
    perp__mixing_forget(&work->mixing, work->r);
    memset(work->modes, 0, (size_t)problem->contacts * sizeof *work->modes);
    work->least = work->least_before = work->remembered = work->residual = INFINITY;
    work->looked[0] = work->looked[1] = INFINITY;
    work->next_look = PERP__FIRST_LOOK;
    work->share = 1.0;
    work->sweeps = 0;
}

/* The better of the last r and the remembered one. */
static void finish(perp__sweep_work *work, perp__contact_iterate *iterate, perp_outcome outcome)
{
    const size_t bytes = (size_t)work->size * sizeof *work->r;

    if (outcome != PERP_OUTCOME_SOLVED) {
        double best;

        perp__sweep_export(work, work->best);
        best = perp__sweep_residual(work, work->x, work->u);
        perp__sweep_export(work, work->r);
        work->residual = perp__sweep_residual(work, work->x, work->u);
        if (!(work->residual <= best)) {
            perp__sweep_export(work, work->best);
            work->residual = perp__sweep_residual(work, work->x, work->u);
        }
    }
    memcpy(iterate->r, work->x, bytes);
    memcpy(iterate->u, work->u, bytes);
    memcpy(iterate->modes, work->modes, (size_t)work->common.problem->contacts);
    iterate->has_modes = outcome == PERP_OUTCOME_SOLVED;
    iterate->residual = work->residual;
    iterate->iterations = work->sweeps;
    iterate->outcome = outcome;
}

static perp_status solve(void *object, perp__contact_iterate *iterate)
{
    perp__sweep_work *work = object;
    const perp__contact_problem *problem = work->common.problem;
    const double entries =
        12.0 * (work->constraints + 1.0); /* a normal's, of two bodies, at least */
    const double affordable = fmin(1.0 + PERP__ENTRIES_MOST / entries, PERP__SWEEPS_MOST);
    const int64_t limit =
        problem->iteration_limit > 0 ? problem->iteration_limit : (int64_t)affordable;
    perp_outcome outcome = -1;

    start(work, iterate);
    while (outcome < 0 && work->sweeps < limit) {
        double change;
        int32_t is_hopeless;

        /* 1. One sweep, from where mixing the last ones leads to. */
        if (work->sweeps > 0)
            perp__mixing_after(&work->mixing, work->row_weights, work->r, work->y);
        work->sweeps++;
        change = perp__sweep_pass(work);

        /* 2. The r where the change has halved is kept: copies are few. */
        if (change < work->least)
            work->least = change;
        if (change < 0.5 * work->remembered) {
            work->remembered = change;
            memcpy(work->best, work->r, (size_t)work->size * sizeof *work->best);
        }

        /* 3. Whether to go on; not where sweeps diverge or stagnate. */
        if (is_solved(work, change)) {
            outcome = PERP_OUTCOME_SOLVED;
        } else {
            is_hopeless = !(change <= DBL_MAX) || change > PERP__DIVERGENCE * work->least;
            if (!is_hopeless && work->sweeps % PERP__STAGNATION == 0) {
                is_hopeless = work->least > PERP__STAGNATION_FACTOR * work->least_before;
                work->least_before = work->least;
            }
            if (!is_hopeless && is_too_slow(work, limit))
                break;
            outcome = is_hopeless
                          ? PERP_OUTCOME_STALLED
                          : perp__contact_asks_to_stop(problem->control, work->sweeps, change);
        }
    }
    finish(work, iterate, outcome < 0 ? PERP_OUTCOME_ITERATION_LIMIT : outcome);
    return PERP_OK;
}

const perp__contact_method perp__contact_sweep = {.id = PERP_CONTACT_METHOD_SWEEP,
                                                  .work_size = sizeof(perp__sweep_work),
                                                  .attempts = 1,
                                                  .layout = perp__sweep_layout,
                                                  .solve = solve};
