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
#include <math.h>
#include <string.h>

#include "lcp/fischer/fischer.h"

/* Newton's. */
#define ARMIJO 1e-4  /* beta */
#define HALVINGS 40  /* t >= 2^-40 */
#define DESCENT 1e-8 /* rho and p of the test grad Psi' d <= -rho |d|^p */
#define POWER 2.1

/* The active set's. */
#define RHO 0.1 /* the first that is not 0, of a unit diagonal */
#define RHO_STEP 0.1
#define RHO_LEAST 1e-9
#define TRIALS 3   /* values of rho in a step */
#define GROWTH 1e3 /* of Psi, that a step is allowed */
#define FALL 0.5   /* of Psi, that ends a watch */
#define WATCH 5    /* steps without it */
#define FAILURES 3 /* in a row, then comes a pause of as many steps */

/* rho, one after the other until a direction serves. */
static const double proximal[] = {0.0, 1e-12, 1e-9, 1e-6, 1e-3};

/* D_z and D_w. At kinks the direction is 1 in every variable at a kink (De Luca, Facchinei & Kanzow
 * 1996, section 7). */
static void find_slopes(perp__fischer_state *f)
{
    const perp__lcp_problem *p = f->common.problem;
    double *kink_z = f->part, *kink_w = f->work;
    int32_t kinks = 0;

    for (int32_t i = 0; i < p->n; i++) {
        kink_z[i] = perp__fischer_at_kink(f->z[i], p->lower[i], p->upper[i], f->w[i]) ? 1.0 : 0.0;
        kink_w[i] = 0.0;
        kinks += kink_z[i] != 0.0;
    }
    if (kinks > 0)
        perp__multiply_add(&f->S.S, kink_z, kink_w);
    for (int32_t i = 0; i < p->n; i++) {
        perp__slopes slopes = perp__fischer_bounded_slopes(
            f->z[i], p->lower[i], p->upper[i], f->w[i], kink_z[i], kink_w[i], f->penalty);

        f->slope_z[i] = slopes.z;
        f->slope_w[i] = slopes.w;
    }
}

/* grad Psi' d = Phi' (D_z + D_w S) d */
static double slope_along(const perp__fischer_state *f)
{
    double sum = 0.0;

    for (int32_t i = 0; i < f->common.problem->n; i++)
        sum += f->phi[i] * (f->slope_z[i] * f->d[i] + f->slope_w[i] * f->image[i]);
    return sum;
}

static int32_t is_descent(const perp__fischer_state *f, double slope)
{
    double square = 0.0;

    for (int32_t i = 0; i < f->common.problem->n; i++)
        square += f->d[i] * f->d[i];
    return slope <= -DESCENT * pow(square, 0.5 * POWER);
}

/* Row i of H d = -Phi divided by its D_w; where D_w = 0 it gives d_i by itself. Returns 1 if d is a
 * direction of sufficient descent, 0 if not, or PERP_ERROR_MEMORY. */
static perp_status newton_direction(perp__fischer_state *f, double rho, double *slope)
{
    perp_status status;

    for (int32_t i = 0; i < f->common.problem->n; i++) {
        double weight = f->slope_z[i] / f->slope_w[i] + rho;

        f->weights[i] = isfinite(weight) ? weight : INFINITY;
        f->d[i] = -f->phi[i] / (isfinite(weight) ? f->slope_w[i] : f->slope_z[i]);
    }
    status = perp__fischer_matrix_factor(&f->S, f->weights);
    if (status != PERP_OK)
        return status < 0 ? status : 0;
    perp__fischer_solve_rows(f, f->d, f->image);
    *slope = slope_along(f);
    return is_descent(f, *slope);
}

/* d = -t grad Psi with the t that minimises |Phi + H d|; fixed variables do not move. */
static double gradient_direction(perp__fischer_state *f)
{
    const perp__lcp_problem *p = f->common.problem;
    double square = 0.0, size = 0.0, t;

    for (int32_t i = 0; i < p->n; i++) {
        f->part[i] = f->slope_w[i] * f->phi[i];
        f->image[i] = 0.0;
    }
    for (int32_t i = 0; i < p->n; i++) {
        f->d[i] = p->lower[i] < p->upper[i]
                      ? perp__column_times(&f->S.S, i, f->part) + f->slope_z[i] * f->phi[i]
                      : 0.0;
        square += f->d[i] * f->d[i];
    }
    perp__multiply_add(&f->S.S, f->d, f->image);
    for (int32_t i = 0; i < p->n; i++) {
        double r = f->slope_z[i] * f->d[i] + f->slope_w[i] * f->image[i];

        size += r * r;
    }
    t = square / size;
    for (int32_t i = 0; i < p->n; i++) {
        f->d[i] *= -t;
        f->image[i] *= -t;
    }
    return -square * t;
}

/* The largest of the last values of Psi. */
static double reference(const perp__fischer_state *f)
{
    double most = f->psi;

    for (int64_t k = 0; k < PERP__FISCHER_MEMORY && k < f->steps; k++)
        most = f->recent[k] > most ? f->recent[k] : most;
    return most;
}

/* Moves along d; returns 0 if no t gives enough descent. */
static int32_t line_search(perp__fischer_state *f, double slope)
{
    const double most = reference(f);
    double t = 1.0;

    for (int32_t halving = 0; halving <= HALVINGS; halving++, t *= 0.5) {
        for (int32_t i = 0; i < f->common.problem->n; i++) {
            f->trial_z[i] = f->z[i] + t * f->d[i];
            f->trial_w[i] = f->w[i] + t * f->image[i];
        }
        if (perp__fischer_evaluate(f, f->trial_z, f->trial_w, f->trial_phi) <=
            most + ARMIJO * t * slope) {
            perp__fischer_take_trial(f);
            return 1;
        }
    }
    return 0;
}

perp_status perp__fischer_newton_step(perp__fischer_state *f)
{
    double slope = 0.0;

    find_slopes(f);
    for (size_t k = 0; k < sizeof proximal / sizeof proximal[0]; k++) {
        perp_status found = newton_direction(f, proximal[k], &slope);

        if (found < 0)
            return found;
        if (found && line_search(f, slope))
            return 1;
    }
    slope = gradient_direction(f);
    return slope < 0.0 && line_search(f, slope);
}

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
    perp__multiply_add(&f->S.S, f->part, f->trial_w);
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
    perp__fischer_take_trial(f);
}

/* Back to the point that the watch began with. */
static void give_up(perp__fischer_state *f)
{
    if (f->watched > 0) {
        memcpy(f->z, f->kept_z, (size_t)f->common.problem->n * sizeof(double));
        perp__fischer_set_point(f);
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
