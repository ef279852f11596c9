/* What the rows make of velocities and impulses, and the friction that speeds leave. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "linalg/blas.h"

double perp__row_times(const perp_mechanism *m, const perp__terms *terms, int32_t row, double sum,
                       const double *x)
{
    const double *J = terms->J + (size_t)row * (size_t)m->n;

    for (int32_t k = 0; k < m->n; k++)
        sum += J[k] * x[k];
    return sum;
}

void perp__add_row(const perp_mechanism *m, const perp__terms *terms, int32_t row, double s,
                   double *x)
{
    const double *J = terms->J + (size_t)row * (size_t)m->n;

    for (int32_t k = 0; k < m->n && s != 0.0; k++)
        x[k] += s * J[k];
}

double perp__row_terms(const perp_mechanism *m, const perp__terms *terms, int32_t row, double sum,
                       const double *x)
{
    const double *J = terms->J + (size_t)row * (size_t)m->n;

    for (int32_t k = 0; k < m->n; k++)
        sum += fabs(J[k] * x[k]);
    return sum;
}

double perp__row_size(const perp_mechanism *m, const perp__terms *terms, int32_t row,
                      const double *v)
{
    return perp__row_terms(m, terms, row, fabs(terms->drift[row]), v);
}

void perp__row_velocities(const perp_mechanism *m, const perp__terms *terms, double *u,
                          const double *v)
{
    for (int32_t i = 0; i < m->rows; i++)
        u[i] = perp__row_times(m, terms, i, terms->drift[i], v);
}

void perp__add_impulses(const perp_mechanism *m, const perp__terms *terms, double *x,
                        const double *r)
{
    for (int32_t i = 0; i < m->rows; i++)
        perp__add_row(m, terms, i, r[i], x);
}

double perp__row_mobility(perp_mechanism *m, int32_t row)
{
    perp__solve_mass(m, &m->begin, m->work, m->begin.J + (size_t)row * (size_t)m->n);
    return perp__row_times(m, &m->begin, row, 0.0, m->work);
}

double perp__load_of(const perp_mechanism *m, const double *r, int32_t j)
{
    const int32_t row = m->starts[j];

    return m->two_sided[j] > 0 ? perp__length(r + row, m->two_sided[j]) : r[row];
}

void perp__multiply_mass(const perp_mechanism *m, const perp__terms *terms, double *y,
                         const double *x)
{
    const size_t n = (size_t)m->n;

    for (size_t i = 0; i < n; i++) {
        double sum = 0.0;

        for (size_t k = 0; k < n; k++)
            sum += terms->M[i * n + k] * x[k];
        y[i] = sum;
    }
}

void perp__solve_mass(const perp_mechanism *m, const perp__terms *terms, double *x, const double *b)
{
    if (x != b)
        memcpy(x, b, (size_t)m->n * sizeof *x);
    perp__cholesky_solve(m->n, 1, terms->factor, m->n, x, m->n);
}

void perp__solve_lower(const perp_mechanism *m, const perp__terms *terms, double *x)
{
    perp__cholesky_half_solve(m->n, terms->factor, m->n, x, 0);
}

void perp__solve_upper(const perp_mechanism *m, const perp__terms *terms, double *x)
{
    perp__cholesky_half_solve(m->n, terms->factor, m->n, x, 1);
}

bool perp__factor_symmetric_part(int32_t n, double *A, double *factor)
{
    const size_t size = (size_t)n;

    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < i; j++)
            A[i + size * j] = A[j + size * i] = 0.5 * (A[i + size * j] + A[j + size * i]);
    memcpy(factor, A, size * size * sizeof *A);
    return perp__cholesky_factor(n, factor, n) == 0 && perp__all_finite(factor, size * size);
}

double perp__energy_norm(const perp_mechanism *m, const perp__terms *terms, double *y,
                         const double *x)
{
    const size_t n = (size_t)m->n;

    for (size_t i = 0; i < n; i++) {
        double sum = 0.0;

        for (size_t k = i; k < n; k++)
            sum += terms->factor[k + n * i] * x[k];
        y[i] = sum;
    }
    return perp__length(y, m->n);
}

double perp__sliding_speed(const perp_mechanism *m, const perp__terms *terms, int32_t place,
                           const double *u, const double *v, double rounding)
{
    const int32_t first = m->tangent[place];
    double speed = 0.0, size = 0.0;

    for (int32_t i = first; i < first + m->tangents[place]; i++) {
        speed = hypot(speed, u[i]);
        size = hypot(size, perp__row_size(m, terms, i, v));
    }
    return speed > rounding * size ? speed : 0.0;
}

void perp__friction_of_speed(const perp_mechanism *m, const perp__terms *terms, double *friction,
                             const double *u, const double *v)
{
    for (int32_t j = 0; j < m->contacts; j++) {
        const double at_rest = fmax(m->mu_static[j], terms->mu[j]);
        double speed;

        friction[j] = terms->mu[j];
        if (!(at_rest > terms->mu[j]) || m->dims[j] == 1)
            continue;
        speed = perp__sliding_speed(m, terms, j, u, v, PERP__SUM_ROUNDING);
        if (m->let_go[j] < 0 || (speed == 0.0 && m->let_go[j] == 0))
            friction[j] = at_rest;
        else if (m->stribeck[j] > 0.0)
            friction[j] +=
                (at_rest - friction[j]) * exp(-(speed / m->stribeck[j]) * (speed / m->stribeck[j]));
    }
}
