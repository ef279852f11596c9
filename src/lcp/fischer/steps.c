/* The steps of linear problems. Newton's needs H d = -Phi solved on the rows that are not at their
 * bound already.
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

#define TRIALS 3 /* values of rho in a step; steps that fail, before a pause of as many */

/* Solves (W + S) x = b with x given on the rows of infinite weight W, and b on the others.
 * `uniform`: all finite weights are the same. PERP_OK, PERP__FACTOR_SINGULAR or _MEMORY. */
static perp_status solve_rows(perp__fischer_state *s, bool uniform, double *x)
{
    perp__sparse_block *block = s->common.problem->block;
    double *part = s->newton.part, *image = s->newton.image;
    const int32_t n = s->newton.n;
    int32_t *active = s->active, count = 0;
    perp_status status;

    for (int32_t i = 0; i < n; i++) {
        if (isfinite(s->weights[i]))
            active[count++] = i;
        image[i] = 0.0;
        part[i] = isfinite(s->weights[i]) ? 0.0 : x[i];
    }
    status = uniform ? perp__sparse_block_factor(block, active, count,
                                                 count > 0 ? s->weights[active[0]] : 0.0)
                     : perp__sparse_block_factor_with(block, active, count, s->weights);
    if (status != PERP_OK)
        return status;
    perp__multiply_add(&s->newton.S, part, image);
    for (int32_t k = 0; k < count; k++)
        x[active[k]] -= image[active[k]];
    perp__sparse_block_solve(block, x, 0);
    return PERP_OK;
}

/* Row i of H d = -Phi divided by its D_w; where D_w = 0 it gives d_i by itself. */
perp_status perp__fischer_direction(perp__newton *f, double rho)
{
    perp__fischer_state *s = f->owner;

    for (int32_t i = 0; i < f->n; i++) {
        const double weight = f->slope_z[i] / f->slope_w[i] + rho;

        s->weights[i] = isfinite(weight) ? weight : INFINITY;
        f->d[i] = -f->phi[i] / (isfinite(weight) ? f->slope_w[i] : f->slope_z[i]);
    }
    return solve_rows(s, 0, f->d);
}

/* The trial is P(z + d), where d leads to (S + rho I) (z + d) + q - rho z = 0 between the bounds,
 * and onto them elsewhere; the index set after it is read off z + d itself, in the proximal
 * problem. trial_psi := Psi there; INFINITY where the block is singular. PERP_OK or _MEMORY. */
static perp_status try_places(perp__fischer_state *s, double rho)
{
    perp__newton *f = &s->newton;
    const double *lower = f->lower, *upper = f->upper;
    perp_status status;

    for (int32_t i = 0; i < f->n; i++) {
        const bool between = s->places[i] == PERP__BETWEEN;

        s->weights[i] = between ? rho : INFINITY;
        f->d[i] = between                          ? -f->w[i]
                  : s->places[i] == PERP__AT_UPPER ? upper[i] - f->z[i]
                                                   : lower[i] - f->z[i];
    }
    f->trial_psi = INFINITY;
    status = solve_rows(s, 1, f->d);
    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    memset(f->image, 0, (size_t)f->n * sizeof *f->image);
    perp__multiply_add(&f->S, f->d, f->image);
    for (int32_t i = 0; i < f->n; i++) {
        const double z = f->z[i] + f->d[i], w = f->w[i] + f->image[i];

        s->next_places[i] =
            perp__place(lower[i] == upper[i], z - lower[i], z - upper[i], w + rho * f->d[i]);
        f->trial_z[i] = perp__clamp(z, lower[i], upper[i]);
    }
    perp__lcp_affine(s->common.problem, f->trial_z, f->trial_w);
    perp__newton_check_trial(f);
    return PERP_OK;
}

perp_status perp__fischer_active_step(perp__fischer_state *s)
{
    perp__newton *f = &s->newton;
    double rho = s->rho;

    /* 1. Where these steps do not serve, they are tried less often. */
    if (s->failures >= TRIALS) {
        if (++s->failures > 2 * TRIALS)
            s->failures = 0;
        return 0;
    }
    if (s->watched == 0) {
        perp__copy(s->kept_z, f->z, f->n);
        s->kept_psi = f->psi;
    }
    for (int32_t i = 0; i < f->n && !s->has_places; i++)
        s->places[i] = perp__place(f->lower[i] == f->upper[i], f->z[i] - f->lower[i],
                                   f->z[i] - f->upper[i], f->w[i]);
    /* 2. The trials; one that serves is gone to. */
    for (int32_t trial = 0; trial < TRIALS && s->watched < PERP__WATCH && rho <= 1.0; trial++) {
        const perp_status status = try_places(s, rho);
        int8_t *places = s->places;

        if (status != PERP_OK)
            return status;
        if (!(f->trial_psi <= PERP__WATCH_GROWTH * s->kept_psi)) {
            rho = fmax(rho / PERP__FISCHER_SHARE, PERP__FISCHER_SHARE);
            continue;
        }
        s->places = s->next_places;
        s->next_places = places;
        s->has_places = 1;
        s->rho = rho > 0.0 ? fmax(PERP__FISCHER_SHARE * rho, sqrt(DBL_EPSILON)) : 0.0;
        s->watched++;
        if (f->trial_psi <= PERP__PROGRESS * s->kept_psi)
            s->watched = s->failures = 0;
        perp__newton_take_trial(f);
        return 1;
    }
    /* 3. Else back to the point that the watch began with. */
    if (s->watched > 0) {
        perp__copy(f->z, s->kept_z, f->n);
        perp__newton_set_point(f);
    }
    s->watched = 0;
    s->has_places = 0;
    s->rho = PERP__FISCHER_SHARE;
    s->failures++;
    return 0;
}
