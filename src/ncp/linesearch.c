/* Steps along the projected arc P(z + t d). Where F is not defined the step is shortened like one
 * that did not help. Nonmonotone: Grippo, Lampariello & Lucidi, SIAM J. Numer. Anal. 23 (1986). */
#include <math.h>
#include <string.h>

#include "lcp/fischer/function.h"
#include "ncp/walk.h"

#define BETA 1e-4 /* Armijo's */
#define GRADIENT_HALVINGS 40

double perp__ncp_reference(const perp__ncp_walk *f)
{
    double most = f->psi;

    for (int64_t k = 0; k < PERP__NCP_MEMORY && k < f->steps; k++)
        most = f->recent[k] > most ? f->recent[k] : most;
    return most;
}

/* The trial point for t, and its Psi. */
static perp_status attempt(perp__ncp_walk *f, double t)
{
    const perp__ncp_model *m = f->model;
    perp_status status;
    double sum = 0.0;

    for (int32_t i = 0; i < m->n; i++)
        f->trial_z[i] = perp__ncp_clamp(f->z[i] + t * f->d[i], m->low[i], m->high[i]);
    status = perp__ncp_evaluate(f->model, f->trial_z, f->trial_w);
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < m->n; i++) {
        f->trial_phi[i] =
            perp__fischer_bounded(f->trial_z[i], m->low[i], m->high[i], f->trial_w[i], f->penalty);
        sum += f->trial_phi[i] * f->trial_phi[i];
    }
    f->trial_psi = 0.5 * sum;
    return PERP_OK;
}

static void swap(double **a, double **b)
{
    double *kept = *a;

    *a = *b;
    *b = kept;
}

static void move(perp__ncp_walk *f)
{
    f->recent[f->steps++ % PERP__NCP_MEMORY] = f->psi;
    swap(&f->z, &f->trial_z);
    swap(&f->w, &f->trial_w);
    swap(&f->phi, &f->trial_phi);
    f->psi = f->trial_psi;
    perp__ncp_note(f);
}

perp_status perp__ncp_search(perp__ncp_walk *f, double reference, double slope, int32_t halvings)
{
    double t = 1.0;

    for (int32_t k = 0; k <= halvings; k++, t *= 0.5) {
        perp_status status = attempt(f, t);

        if (status < 0)
            return status;
        if (status == PERP_OK && f->trial_psi <= reference + BETA * t * slope) {
            move(f);
            return 1;
        }
    }
    return 0;
}

perp_status perp__ncp_leap(perp__ncp_walk *f)
{
    const perp_status status = attempt(f, 1.0);

    if (status == PERP_OK)
        move(f);
    return status < 0 ? status : status == PERP_OK;
}

perp_status perp__ncp_search_projected(perp__ncp_walk *f)
{
    double t = 1.0;

    for (int32_t k = 0; k <= GRADIENT_HALVINGS; k++, t *= 0.5) {
        perp_status status = attempt(f, t);
        double promised = 0.0;

        if (status < 0)
            return status;
        for (int32_t i = 0; i < f->model->n; i++)
            promised += f->gradient[i] * (f->trial_z[i] - f->z[i]);
        if (status == PERP_OK && promised < 0.0 && f->trial_psi <= f->psi + BETA * promised) {
            move(f);
            return 1;
        }
    }
    return 0;
}
