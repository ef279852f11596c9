#include "lcp/fischer/newton.h"

#include <float.h>
#include <math.h>

#define PATIENCE 30 /* iterations without progress */

/* rho, one after the other until a direction serves. */
static const double proximal[] = {0.0, 1e-10, 1e-6, 1e-3, 1e-1};

void perp__newton_layout(perp__arena *arena, perp__newton *f, size_t n)
{
    PERP__DOUBLES(arena, n, &f->w, &f->phi, &f->trial_z, &f->trial_w, &f->trial_phi, &f->slope_z,
                  &f->slope_w, &f->gradient, &f->d, &f->part, &f->image, &f->best);
}

/* ---- points ---- */

void perp__newton_start(perp__newton *f)
{
    f->smoothing = 0.0;
    f->steps = 0;
    f->best_residual = INFINITY;
    perp__copy(f->best, f->z, f->n);
}

void perp__newton_note(perp__newton *f)
{
    f->residual = 0.0;
    for (int32_t i = 0; i < f->n; i++)
        if (f->lower[i] < f->upper[i])
            perp__raise_to(&f->residual,
                           fabs(perp__mid(f->z[i], f->lower[i], f->upper[i], f->w[i])));
    if (f->residual < f->best_residual) {
        f->best_residual = f->residual;
        perp__copy(f->best, f->z, f->n);
    }
}

/* phi := Phi; returns Psi. */
static double merit(const perp__newton *f, const double *z, const double *w, double *phi)
{
    double sum = 0.0;

    for (int32_t i = 0; i < f->n; i++) {
        phi[i] =
            perp__fischer_bounded(z[i], f->lower[i], f->upper[i], w[i], f->penalty, f->smoothing);
        sum += phi[i] * phi[i];
    }
    return 0.5 * sum;
}

void perp__newton_appraise(perp__newton *f)
{
    f->psi = merit(f, f->z, f->w, f->phi);
    perp__newton_note(f);
}

perp_status perp__newton_set_point(perp__newton *f)
{
    const perp_status status = f->problem->evaluate(f, f->z, f->w);

    if (status == PERP_OK)
        perp__newton_appraise(f);
    return status;
}

void perp__newton_check_trial(perp__newton *f)
{
    f->trial_psi = merit(f, f->trial_z, f->trial_w, f->trial_phi);
}

void perp__newton_take_trial(perp__newton *f)
{
    f->recent[f->steps++ % PERP__MEMORY] = f->psi;
    perp__copy(f->z, f->trial_z, f->n);
    perp__copy(f->w, f->trial_w, f->n);
    perp__copy(f->phi, f->trial_phi, f->n);
    f->psi = f->trial_psi;
    perp__newton_note(f);
}

/* ---- the path ---- */

void perp__newton_smooth(perp__newton *f, double mu)
{
    f->smoothing = mu;
    f->steps = 0;
    perp__newton_appraise(f);
}

void perp__newton_follow_path(perp__newton *f)
{
    if (f->path && isfinite(f->psi)) /* else mu could not fall */
        perp__newton_smooth(f, perp__largest(f->phi, f->n));
    f->path = 0;
    while (f->smoothing > 0.0 && perp__largest(f->phi, f->n) <= PERP__FISCHER_NEAR * f->smoothing)
        perp__newton_smooth(f, f->smoothing > f->least ? PERP__FISCHER_SHARE * f->smoothing : 0.0);
}

/* ---- steps ---- */

/* D_z and D_w in the B-subdifferential: at kinks the limits along the direction that is 1 in every
 * variable at a kink (De Luca, Facchinei & Kanzow 1996, section 7). */
static void find_slopes(perp__newton *f)
{
    const double *z = f->z, *w = f->w, *lower = f->lower, *upper = f->upper;
    double *kink_z = f->part, *kink_w = f->image;
    int32_t kinks = 0;

    for (int32_t i = 0; i < f->n; i++) {
        kink_z[i] = perp__fischer_at_kink(z[i], lower[i], upper[i], w[i]) ? 1.0 : 0.0;
        kink_w[i] = 0.0;
        kinks += kink_z[i] != 0.0;
    }
    if (kinks > 0)
        perp__multiply_add(&f->S, kink_z, kink_w);
    for (int32_t i = 0; i < f->n; i++) {
        const perp__slopes slopes = perp__fischer_bounded_slopes(
            z[i], lower[i], upper[i], w[i], kink_z[i], kink_w[i], f->penalty, f->smoothing);

        f->slope_z[i] = slopes.z;
        f->slope_w[i] = slopes.w;
    }
}

void perp__newton_find_gradient(perp__newton *f)
{
    find_slopes(f);
    for (int32_t i = 0; i < f->n; i++)
        f->part[i] = f->slope_w[i] * f->phi[i];
    for (int32_t j = 0; j < f->n; j++)
        f->gradient[j] = perp__column_times(&f->S, j, f->part) + f->slope_z[j] * f->phi[j];
}

double perp__newton_reference(const perp__newton *f)
{
    double most = f->psi;

    for (int64_t k = 0; k < PERP__MEMORY && k < f->steps; k++)
        most = f->recent[k] > most ? f->recent[k] : most;
    return most;
}

perp_status perp__newton_search(perp__newton *f, double reference, double slope,
                                const double *gradient, int32_t halvings)
{
    int32_t is_inside = halvings == 0;
    double t = 1.0;

    for (int32_t k = 0; k <= halvings; k += is_inside, t *= 0.5) {
        int32_t moves = is_inside;
        double promised = t * slope;
        perp_status status;

        for (int32_t i = 0; i < f->n; i++) {
            const double z = f->z[i] + t * f->d[i];

            f->trial_z[i] = f->projects ? perp__clamp(z, f->lower[i], f->upper[i]) : z;
            promised += gradient ? gradient[i] * (f->trial_z[i] - f->z[i]) : 0.0;
            moves |= fabs(f->d[i]) < INFINITY && f->trial_z[i] != f->z[i] &&
                     (f->z[i] != 0.0 || fabs(f->trial_z[i]) > DBL_EPSILON); /* of its unit */
        }
        status = moves ? f->problem->evaluate(f, f->trial_z, f->trial_w) : PERP_OK;
        if (status < 0 || !moves)
            return status;
        is_inside |= status == PERP_OK;
        if (status > 0 || (gradient && !(promised < 0.0)))
            continue;
        perp__newton_check_trial(f);
        if (f->trial_psi <= reference + PERP__ARMIJO * promised) {
            perp__newton_take_trial(f);
            return 1;
        }
    }
    return 0;
}

perp_status perp__newton_by_direction(perp__newton *f)
{
    find_slopes(f);
    for (size_t k = 0; k < sizeof proximal / sizeof proximal[0]; k++) {
        perp_status status = f->problem->direction(f, proximal[k]);

        if (status > 0)
            continue;
        if (status == PERP_OK) /* H d = -Phi promises -2 Psi */
            status = perp__newton_search(f, perp__newton_reference(f), -2.0 * f->psi, NULL,
                                         PERP__HALVINGS);
        if (status != 0)
            return status;
    }
    return 0;
}

/* d := -t times the gradient, or as much of it as may be used, with the t that minimises
 * |Phi + H d|. Psi has to fall at once by beta of what its gradient promises. */
perp_status perp__newton_descend(perp__newton *f)
{
    double square = 0.0, size = 0.0;

    perp__newton_find_gradient(f);
    for (int32_t i = 0; i < f->n; i++) {
        f->d[i] = f->lower[i] < f->upper[i] ? f->gradient[i] : 0.0; /* what is fixed stays */
        square += f->d[i] * f->d[i];
        f->image[i] = 0.0;
    }
    perp__multiply_add(&f->S, f->d, f->image);
    for (int32_t i = 0; i < f->n; i++) {
        const double r = f->slope_z[i] * f->d[i] + f->slope_w[i] * f->image[i];

        size += r * r;
    }
    for (int32_t i = 0; i < f->n; i++)
        f->d[i] *= size > 0.0 ? -square / size : 0.0;
    return perp__newton_search(f, f->psi, 0.0, f->gradient, PERP__GRADIENT_HALVINGS);
}

perp_status perp__newton_iterate(perp__newton *f, perp__newton_step step, void *user)
{
    double residual = INFINITY, psi = INFINITY; /* when one of them had last fallen by a quarter */
    int64_t since = 0;

    for (f->iterations = 0;; f->iterations++) {
        perp_status status;

        f->outcome = -1;
        status = f->problem->begin(f);
        if (status != PERP_OK || f->outcome >= 0)
            return status;
        status = step(f, user);
        if (f->best_residual < 0.75 * residual || f->psi < 0.75 * psi) {
            residual = f->best_residual;
            psi = f->psi;
            since = f->iterations;
        }
        if (status != 1 || f->iterations - since > PATIENCE) {
            f->outcome = PERP_OUTCOME_STALLED;
            return status < 0 ? status : PERP_OK;
        }
    }
}
