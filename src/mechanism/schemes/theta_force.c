/* The theta scheme's implicit forces: k at the end of the step, and the matrix of the iteration.
 *
 * k(t+h, q+, v+) is found by fixed-point iteration. Where k depends on q and v so strongly that
 * this converges slowly, the iteration's matrix is A = M - h theta sym(K), K = dk/dv + h theta
 * dk/dq N: symmetric and positive definite, as the contact problem needs it. One difference of k in
 * each velocity, with the position that goes with it, gives all of K. */
#include "mechanism/schemes/theta.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/blas.h"

/* Differences are taken over this share of a velocity: the root of rounding. */
#define DIFFERENCE 1.5e-8

/* Velocities smaller than this share of the largest are moved as if they had it. */
#define FLOOR 1e-3

static void layout(perp__arena *arena, void *object)
{
    perp__theta *w = object;
    const size_t n = (size_t)w->m->n;
    double **const vectors[] = {&w->force,  &w->p,      &w->last, &w->v,
                                &w->last_v, &w->middle, &w->x,    &w->y};
    double **const positions[] = {&w->q, &w->at, &w->probe};
    size_t k;

    w->A = perp__arena_take(arena, n * n, sizeof(double));
    w->factor = perp__arena_take(arena, n * n, sizeof(double));
    for (k = 0; k < sizeof vectors / sizeof *vectors; k++)
        *vectors[k] = perp__arena_take(arena, n, sizeof(double));
    for (k = 0; k < sizeof positions / sizeof *positions; k++)
        *positions[k] = perp__arena_take(arena, (size_t)w->m->coordinates, sizeof(double));
}

perp__theta *perp__theta_work(perp_mechanism *m)
{
    if (!m->theta)
        m->theta = perp__work_create(m, sizeof *m->theta, layout);
    return m->theta;
}

/* q := where the velocities lead. N is taken between start and end. */
static perp_status move(perp_mechanism *m, perp__theta *w, double *q, double h, const double *q0,
                        const double *v0, const double *v)
{
    const double theta = m->settings.theta;
    perp_status status = PERP_OK;
    int32_t i;

    for (i = 0; i < m->n; i++)
        w->middle[i] = theta * v[i] + (1.0 - theta) * v0[i];
    if (!m->model.kinematics || theta == 1.0)
        return perp__evaluate_move(m, q, q0, h, w->middle);
    status = perp__evaluate_move(m, w->at, q0, (1.0 - theta) * h, w->middle);
    return status == PERP_OK ? perp__evaluate_move_at(m, q, q0, w->at, h, w->middle) : status;
}

perp_status perp__theta_force(perp_mechanism *m, perp__theta *w, double t, double h,
                              const double *q0, const double *v0, const double *v)
{
    perp_status status = move(m, w, w->q, h, q0, v0, v);

    return status == PERP_OK ? perp__evaluate_force(m, w->force, t + h, w->q, v) : status;
}

/* A := M - h theta K, K by columns. */
static perp_status difference(perp_mechanism *m, perp__theta *w, double t, double h,
                              const double *q0, const double *v0)
{
    const size_t n = (size_t)m->n;
    const double weight = h * m->settings.theta;
    double largest = 0.0;
    perp_status status = PERP_OK;
    size_t i, j;

    for (i = 0; i < n; i++)
        largest = fmax(largest, fmax(fabs(w->v[i]), fabs(v0[i])));
    memcpy(w->x, w->v, n * sizeof *w->x);
    for (j = 0; j < n && status == PERP_OK; j++) {
        const double size = fmax(fmax(fabs(w->v[j]), fabs(v0[j])), FLOOR * largest);
        double delta;

        w->x[j] = w->v[j] + DIFFERENCE * size;
        delta = w->x[j] - w->v[j];
        status = move(m, w, w->probe, h, q0, v0, w->x);
        if (status == PERP_OK)
            status = perp__evaluate_force(m, w->y, t + h, w->probe, w->x);
        for (i = 0; i < n && status == PERP_OK; i++)
            w->A[i + n * j] = m->begin.M[i * n + j] -
                              (delta > 0.0 ? weight * (w->y[i] - w->force[i]) / delta : 0.0);
        w->x[j] = w->v[j];
    }
    return status;
}

perp_status perp__theta_matrix(perp_mechanism *m, perp__theta *w, double t, double h,
                               const double *q0, const double *v0)
{
    const size_t n = (size_t)m->n;
    perp_status status = difference(m, w, t, h, q0, v0);
    size_t i, j;

    w->tried_matrix = 1;
    if (status == PERP__OUTSIDE)
        return PERP_OK; /* M serves */
    if (status != PERP_OK)
        return status;
    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++)
            w->A[i + n * j] = w->A[j + n * i] = 0.5 * (w->A[i + n * j] + w->A[j + n * i]);
    memcpy(w->factor, w->A, n * n * sizeof *w->factor);
    w->has_matrix = perp__cholesky_factor(m->n, w->factor, m->n) == 0;
    for (i = 0; i < n * n && w->has_matrix; i++)
        w->has_matrix = isfinite(w->factor[i]);
    if (w->has_matrix) {
        w->terms.M = w->A;
        w->terms.factor = w->factor;
    }
    return PERP_OK;
}
