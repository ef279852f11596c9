/* The other step: Newton's for min(z, w) = 0, which is an active set's own system and needs one
 * block of S, factored once; Psi judges it. De Luca, Facchinei & Kanzow, "A theoretical and
 * numerical comparison of some semismooth algorithms for complementarity problems", Comput. Optim.
 * Appl. 16 (2000) 173, combine the two as well.
 *
 * Where that block is singular or nearly so, S + rho I replaces S: a step of the proximal point
 * algorithm about the point (Rockafellar 1976), rho falling from step to step, so that monotone
 * problems with singular S are solved to the end. Psi may rise for a few steps (the watchdog of
 * Chamberlain, Powell, Lemarechal & Pedersen 1982), after that the best point is taken up again and
 * Newton's step for Phi is made instead. */
#include <math.h>
#include <string.h>

#include "lcp/fischer/fischer.h"

#define RHO 0.1 /* the first that is not 0, of a unit diagonal */
#define RHO_STEP 0.1
#define RHO_LEAST 1e-9
#define TRIALS 3   /* values of rho in a step */
#define GROWTH 1e3 /* of Psi, that a step is allowed */
#define FALL 0.5   /* of Psi, that ends a watch */
#define WATCH 5    /* steps without it */
#define FAILURES 3 /* in a row, then comes a pause of as many steps */

/* The side of z - w on which a row lies: its place in the next index set. */
static int8_t place_of(double z, double lower, double upper, double w)
{
    if (!(lower < upper))
        return PERP__FIXED;
    if (z - lower <= w)
        return PERP__AT_LOWER;
    return z - upper >= w ? PERP__AT_UPPER : PERP__BETWEEN;
}

/* d leads to (S + rho I) (z + d) + q - rho z = 0 between the bounds, and onto them elsewhere. */
static perp_status find_direction(perp__fischer_state *f, double rho)
{
    const perp__lcp_problem *p = f->common.problem;
    perp_status status = perp__fischer_matrix_factor_block(&f->S, f->places, rho);

    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < p->n; i++) {
        f->weights[i] = f->places[i] == PERP__BETWEEN ? rho : INFINITY;
        if (f->places[i] == PERP__BETWEEN)
            f->d[i] = -f->w[i];
        else
            f->d[i] = (f->places[i] == PERP__AT_UPPER ? p->upper[i] : p->lower[i]) - f->z[i];
    }
    perp__fischer_solve_rows(f, f->d, f->image);
    return PERP_OK;
}

/* The trial is P(z + d); the index set after it is read off z + d itself, in the proximal problem.
 * Returns Psi. */
static double try_projected(perp__fischer_state *f, double rho)
{
    const perp__lcp_problem *p = f->common.problem;

    for (int32_t i = 0; i < p->n; i++) {
        double z = f->z[i] + f->d[i], w = f->w[i] + f->image[i];

        f->next_places[i] = place_of(z, p->lower[i], p->upper[i], w + rho * f->d[i]);
        f->trial_z[i] = perp__clamp(z, p->lower[i], p->upper[i]);
        f->trial_w[i] = w;
        f->part[i] = f->trial_z[i] - z;
    }
    perp__fischer_matrix_add(&f->S, f->part, f->trial_w);
    return perp__fischer_evaluate(f, f->trial_z, f->trial_w, f->trial_phi);
}

/* Goes to the trial, which rho led to. */
static void accept(perp__fischer_state *f, double rho, double psi)
{
    int8_t *places = f->places;

    f->places = f->next_places;
    f->next_places = places;
    f->has_places = 1;
    f->rho = rho > 0.0 ? fmax(RHO_STEP * rho, RHO_LEAST) : 0.0;
    if (psi <= FALL * f->kept_psi) {
        f->watched = 0;
        f->failures = 0;
    } else {
        f->watched++;
    }
    perp__fischer_move(f);
}

/* Back to the point that the watch began with. */
static void give_up(perp__fischer_state *f)
{
    if (f->watched > 0) {
        memcpy(f->z, f->kept_z, (size_t)f->common.problem->n * sizeof(double));
        perp__fischer_stand(f);
    }
    f->watched = 0;
    f->has_places = 0;
    f->rho = RHO;
    f->failures++;
}

/* Where these steps do not serve, they are tried less often. */
static int32_t is_paused(perp__fischer_state *f)
{
    if (f->failures < FAILURES)
        return 0;
    if (++f->failures > 2 * FAILURES)
        f->failures = 0;
    return 1;
}

perp_status perp__fischer_active_step(perp__fischer_state *f)
{
    const perp__lcp_problem *p = f->common.problem;
    double rho = f->rho;

    if (is_paused(f))
        return 0;
    if (f->watched == 0) {
        memcpy(f->kept_z, f->z, (size_t)p->n * sizeof(double));
        f->kept_psi = f->psi;
    }
    for (int32_t i = 0; i < p->n && !f->has_places; i++)
        f->places[i] = place_of(f->z[i], p->lower[i], p->upper[i], f->w[i]);
    for (int32_t trial = 0; trial < TRIALS && f->watched < WATCH && rho <= 1.0; trial++) {
        perp_status found = find_direction(f, rho);
        double psi;

        if (found < 0)
            return found;
        psi = found == PERP_OK ? try_projected(f, rho) : INFINITY;
        if (psi <= GROWTH * f->kept_psi) {
            accept(f, rho, psi);
            return 1;
        }
        rho = fmax(rho / RHO_STEP, RHO);
    }
    give_up(f);
    return 0;
}
