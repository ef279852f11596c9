/* What the rows make of velocities and impulses, and the friction that speeds leave. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "linalg/blas.h"

/* Sliding speed relative to its terms that counts as none: rounding of the sum. */
#define ROUNDING (64.0 * PERP__EPS)

void perp__row_velocities(const perp_mechanism *m, const perp__terms *terms, double *u,
                          const double *v)
{
    const size_t n = (size_t)m->n;
    int32_t i;
    size_t k;

    for (i = 0; i < m->rows; i++) {
        const double *row = terms->J + (size_t)i * n;
        double sum = terms->drift[i];

        for (k = 0; k < n; k++)
            sum += row[k] * v[k];
        u[i] = sum;
    }
}

void perp__add_impulses(const perp_mechanism *m, const perp__terms *terms, double *x,
                        const double *r)
{
    const size_t n = (size_t)m->n;
    int32_t i;
    size_t k;

    for (i = 0; i < m->rows; i++) {
        const double *row = terms->J + (size_t)i * n;

        if (r[i] == 0.0)
            continue;
        for (k = 0; k < n; k++)
            x[k] += row[k] * r[i];
    }
}

void perp__multiply_mass(const perp_mechanism *m, const perp__terms *terms, double *y,
                         const double *x)
{
    const size_t n = (size_t)m->n;
    size_t i, k;

    for (i = 0; i < n; i++) {
        double sum = 0.0;

        for (k = 0; k < n; k++)
            sum += terms->M[i * n + k] * x[k];
        y[i] = sum;
    }
}

void perp__solve_mass(const perp_mechanism *m, const perp__terms *terms, double *x)
{
    perp__cholesky_solve(m->n, 1, terms->factor, m->n, x, m->n);
}

double perp__sliding_speed(const perp_mechanism *m, const perp__terms *terms, int32_t j,
                           const double *u, const double *v)
{
    const size_t n = (size_t)m->n;
    double speed = 0.0, size = 0.0;
    int32_t i;
    size_t k;

    for (i = m->starts[j] + 1; i < m->starts[j + 1]; i++) {
        double terms_of = fabs(terms->drift[i]);

        for (k = 0; k < n; k++)
            terms_of += fabs(terms->J[(size_t)i * n + k] * v[k]);
        speed = hypot(speed, u[i]);
        size = hypot(size, terms_of);
    }
    return speed > ROUNDING * size ? speed : 0.0;
}

void perp__friction_of_speed(const perp_mechanism *m, const perp__terms *terms, double *friction,
                             const double *u, const double *v)
{
    int32_t j;

    for (j = 0; j < m->contacts; j++) {
        const double at_rest = fmax(m->mu_static[j], terms->mu[j]);
        double speed;

        friction[j] = terms->mu[j];
        if (!(at_rest > terms->mu[j]) || m->dims[j] == 1)
            continue;
        speed = perp__sliding_speed(m, terms, j, u, v);
        if (speed == 0.0)
            friction[j] = at_rest;
        else if (m->stribeck[j] > 0.0)
            friction[j] +=
                (at_rest - friction[j]) * exp(-(speed / m->stribeck[j]) * (speed / m->stribeck[j]));
    }
}
