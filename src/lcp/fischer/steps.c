/* The two kinds of step.
 *
 * Newton's step for Phi(z) = 0: H d = -Phi, on the rows that are not at their bound already; with S
 * + rho I where that gives no descent; else down the gradient of Psi.
 *
 * The other step: Newton's for min(z, w) = 0, which is an active set's own system and needs one
 * block of S, factored once; Psi judges it. De Luca, Facchinei & Kanzow, "A theoretical and
 * numerical comparison of some semismooth algorithms for complementarity problems", Comput. Optim.
 * Appl. 16 (2000) 173, combine the two as well.
 *
 * Where that block is singular or nearly so, S + rho I replaces S: a step of the proximal point
 * algorithm about the point (Rockafellar 1976), rho falling from step to step, so that monotone
 * problems with singular S are solved to the end. Psi may rise for a few steps (the watchdog of
 * Chamberlain, Powell, Lemarechal & Pedersen 1982), after that the best point is taken up again and
 * Newton's step for Phi is made instead. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/fischer/fischer.h"

/* The active set's. */
#define TRIALS 3 /* values of rho in a step; steps that fail, before a pause of as many */
#define FALL 0.5 /* of Psi, that ends a watch */

/* Newton's: rho and p of the test grad Psi' d <= -rho |d|^p, where Phi is not smoothed. */
#define DESCENT 1e-8
#define POWER 2.1

/* rho, one after the other until a direction serves. */
static const double proximal[] = {0.0, 1e-12, 1e-9, 1e-6, 1e-3};

/* Factors S_AA + W_A, A the rows whose weight is finite; `uniform`: all of these are the same. */
static perp_status factor(perp__fischer_state *f, int32_t uniform)
{
    perp__sparse_block *block = f->common.problem->block;
    int32_t *active = f->active, count = 0;

    for (int32_t i = 0; i < f->common.problem->n; i++)
        if (isfinite(f->weights[i]))
            active[count++] = i;
    return uniform ? perp__sparse_block_factor(block, active, count,
                                               count > 0 ? f->weights[active[0]] : 0.0)
                   : perp__sparse_block_factor_with(block, active, count, f->weights);
}

/* Moves along d; returns 0 if no t gives enough descent from the largest of the last values of
 * Psi. */
static int32_t line_search(perp__fischer_state *f, double slope)
{
    double most = f->psi, t = 1.0;

    for (int64_t k = 0; k < PERP__MEMORY && k < f->steps; k++)
        most = f->recent[k] > most ? f->recent[k] : most;
    for (int32_t halving = 0; halving <= PERP__HALVINGS; halving++, t *= 0.5) {
        for (int32_t i = 0; i < f->common.problem->n; i++) {
            f->trial_z[i] = f->z[i] + t * f->d[i];
            f->trial_w[i] = f->w[i] + t * f->image[i];
        }
        if (perp__fischer_evaluate(f, f->trial_z, f->trial_w, f->trial_phi) <=
            most + PERP__ARMIJO * t * slope) {
            perp__fischer_take_trial(f);
            return 1;
        }
    }
    return 0;
}

perp_status perp__fischer_newton_step(perp__fischer_state *f)
{
    const perp__lcp_problem *p = f->common.problem;
    const perp__fischer_point point = {p->n,     f->z,       f->w,        p->lower,
                                       p->upper, f->penalty, f->smoothing};
    double slope, square, least;

    perp__fischer_slopes(&point, f->S, f->part, f->work, f->slope_z, f->slope_w);
    for (size_t k = 0; k < sizeof proximal / sizeof proximal[0]; k++) {
        perp_status status;

        /* 1. Row i of H d = -Phi divided by its D_w; where D_w = 0 it gives d_i by itself. */
        for (int32_t i = 0; i < p->n; i++) {
            const double weight = f->slope_z[i] / f->slope_w[i] + proximal[k];

            f->weights[i] = isfinite(weight) ? weight : INFINITY;
            f->d[i] = -f->phi[i] / (isfinite(weight) ? f->slope_w[i] : f->slope_z[i]);
        }
        status = factor(f, 0);
        if (status < 0)
            return status;
        if (status != PERP_OK)
            continue;
        perp__fischer_solve_rows(f, f->d, f->image);
        /* 2. Where grad Psi' d = Phi' (D_z + D_w S) d says so, along it. */
        slope = square = 0.0;
        for (int32_t i = 0; i < p->n; i++) {
            slope += f->phi[i] * (f->slope_z[i] * f->d[i] + f->slope_w[i] * f->image[i]);
            square += f->d[i] * f->d[i];
        }
        /* Smoothed, H is regular, and its direction promises -2 Psi however long it is. */
        least = f->smoothing > 0.0 ? f->psi : DESCENT * pow(square, 0.5 * POWER);
        if (slope <= -least && line_search(f, slope))
            return 1;
    }
    /* 3. Else down the gradient; fixed variables do not move. */
    for (int32_t i = 0; i < p->n; i++)
        f->part[i] = f->slope_w[i] * f->phi[i];
    for (int32_t i = 0; i < p->n; i++)
        f->d[i] = p->lower[i] < p->upper[i]
                      ? perp__column_times(f->S, i, f->part) + f->slope_z[i] * f->phi[i]
                      : 0.0;
    slope = perp__fischer_descent(f->S, f->slope_z, f->slope_w, f->d, f->image);
    return slope < 0.0 && line_search(f, slope);
}

/* The trial is P(z + d), where d leads to (S + rho I) (z + d) + q - rho z = 0 between the bounds,
 * and onto them elsewhere; the index set after it is read off z + d itself, in the proximal
 * problem. *psi := Psi there; INFINITY where the block is singular. PERP_OK or _MEMORY. */
static perp_status try_places(perp__fischer_state *f, double rho, double *psi)
{
    const perp__lcp_problem *p = f->common.problem;
    perp_status status;

    for (int32_t i = 0; i < p->n; i++)
        f->weights[i] = f->places[i] == PERP__BETWEEN ? rho : INFINITY;
    *psi = INFINITY;
    status = factor(f, 1);
    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    for (int32_t i = 0; i < p->n; i++)
        f->d[i] = f->places[i] == PERP__BETWEEN
                      ? -f->w[i]
                      : (f->places[i] == PERP__AT_UPPER ? p->upper[i] : p->lower[i]) - f->z[i];
    perp__fischer_solve_rows(f, f->d, f->image);
    for (int32_t i = 0; i < p->n; i++) {
        const double z = f->z[i] + f->d[i], w = f->w[i] + f->image[i];

        f->next_places[i] = perp__place(p->lower[i] == p->upper[i], z - p->lower[i],
                                        z - p->upper[i], w + rho * f->d[i]);
        f->trial_z[i] = perp__clamp(z, p->lower[i], p->upper[i]);
        f->trial_w[i] = w;
        f->part[i] = f->trial_z[i] - z;
    }
    perp__multiply_add(f->S, f->part, f->trial_w);
    *psi = perp__fischer_evaluate(f, f->trial_z, f->trial_w, f->trial_phi);
    return PERP_OK;
}

perp_status perp__fischer_active_step(perp__fischer_state *f)
{
    const perp__lcp_problem *p = f->common.problem;
    const size_t bytes = (size_t)p->n * sizeof(double);
    double rho = f->rho, psi;

    /* 1. Where these steps do not serve, they are tried less often. */
    if (f->failures >= TRIALS) {
        if (++f->failures > 2 * TRIALS)
            f->failures = 0;
        return 0;
    }
    if (f->watched == 0) {
        memcpy(f->kept_z, f->z, bytes);
        f->kept_psi = f->psi;
    }
    for (int32_t i = 0; i < p->n && !f->has_places; i++)
        f->places[i] = perp__place(p->lower[i] == p->upper[i], f->z[i] - p->lower[i],
                                   f->z[i] - p->upper[i], f->w[i]);
    /* 2. The trials; one that serves is gone to. */
    for (int32_t trial = 0; trial < TRIALS && f->watched < PERP__WATCH && rho <= 1.0; trial++) {
        const perp_status status = try_places(f, rho, &psi);
        int8_t *places = f->places;

        if (status != PERP_OK)
            return status;
        if (!(psi <= PERP__WATCH_GROWTH * f->kept_psi)) {
            rho = fmax(rho / PERP__FISCHER_SHARE, PERP__FISCHER_SHARE);
            continue;
        }
        f->places = f->next_places;
        f->next_places = places;
        f->has_places = 1;
        f->rho = rho > 0.0 ? fmax(PERP__FISCHER_SHARE * rho, sqrt(DBL_EPSILON)) : 0.0;
        f->watched++;
        if (psi <= FALL * f->kept_psi)
            f->watched = f->failures = 0;
        perp__fischer_take_trial(f);
        return 1;
    }
    /* 3. Else back to the point that the watch began with. */
    if (f->watched > 0) {
        memcpy(f->z, f->kept_z, bytes);
        perp__fischer_set_point(f);
    }
    f->watched = 0;
    f->has_places = 0;
    f->rho = PERP__FISCHER_SHARE;
    f->failures++;
    return 0;
}
