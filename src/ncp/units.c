/* The coordinates in which methods see a problem, and the units in which residuals count.
 *
 * w_i hangs together with z_j where J_ij is not 0. What hangs together has one unit omega, and
 * nothing else has a say in it: not another part of the system, and, where rows have no diagonal,
 * not those that w_i shares no variable with (the prices and amounts of a linear program). */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/groups.h"
#include "base/outcome.h"
#include "linalg/scale.h"
#include "ncp/model.h"

/* ---- coordinates ---- */

void perp__ncp_model_set_units(perp__ncp_model *m)
{
    for (int32_t i = 0; i < m->n; i++) {
        double low, high;

        m->z_unit[i] = m->D[i] * m->unit[m->n + i];
        m->w_unit[i] = m->unit[i] / m->D[i];
        low = m->lower[i] / m->z_unit[i];
        high = m->upper[i] / m->z_unit[i];
        m->low[i] = isinf(low) && isfinite(m->lower[i]) ? copysign(DBL_MAX, low) : low;
        m->high[i] = isinf(high) && isfinite(m->upper[i]) ? copysign(DBL_MAX, high) : high;
    }
}

/* D from the exponents, in units of 1. */
static void set_powers(perp__ncp_model *m)
{
    for (int32_t i = 0; i < m->n; i++) {
        m->D[i] = perp__power_of_two(m->exponents[i]);
        m->unit[i] = m->unit[m->n + i] = 1.0;
    }
    perp__ncp_model_set_units(m);
}

void perp__ncp_model_unscale(perp__ncp_model *m)
{
    for (int32_t i = 0; i < m->n; i++)
        m->exponents[i] = 0;
    set_powers(m);
}

/* What a value of J_ij is in scaled coordinates. What did not hang together when it got its units
 * may do so here. */
static double scaled(const perp__ncp_model *m, int32_t i, int32_t j, double value)
{
    value *= m->D[i] * m->D[j];
    return m->unit[i] == m->unit[m->n + j] ? value : value * (m->unit[m->n + j] / m->unit[i]);
}

void perp__ncp_scale_matrix(perp__ncp_model *m)
{
    const int32_t n = m->n;

    if (m->sparse) {
        memset(m->S, 0, m->entries * sizeof(double));
        for (int32_t j = 0; j < n; j++)
            for (int32_t k = m->pattern_starts[j]; k < m->pattern_starts[j + 1]; k++)
                m->S[m->place[k]] = scaled(m, m->pattern_rows[k], j, m->given[k]);
        return;
    }
    for (int32_t j = 0; j < n; j++)
        for (int32_t i = 0; i < n; i++) {
            const size_t at = (size_t)j * (size_t)n + (size_t)i;
            const size_t there = m->problem.storage == PERP_STORAGE_ROW_MAJOR
                                     ? (size_t)i * (size_t)n + (size_t)j
                                     : at;

            m->S[at] = scaled(m, i, j, m->given[there]);
        }
}

perp__matrix perp__ncp_given(const perp__ncp_model *m)
{
    const bool by_rows = m->problem.storage == PERP_STORAGE_ROW_MAJOR;
    const size_t n = (size_t)m->n;
    const int32_t *starts = m->sparse ? m->pattern_starts : NULL;

    return (perp__matrix){m->n,     m->n,   by_rows ? n : 1, by_rows ? 1 : n,
                          m->given, starts, m->pattern_rows};
}

void perp__ncp_model_equilibrate(perp__ncp_model *m)
{
    const perp__matrix J = perp__ncp_given(m);

    perp__equilibrate(&J, m->settings->scaling, m->exponents, m->most, m->exponents_work);
    set_powers(m);
    perp__ncp_scale_matrix(m);
}

/* ---- units ---- */

#define VANISHED 0x1p-20 /* of z at the start */

void perp__ncp_find_parts(perp__ncp_model *m)
{
    const perp__matrix S = perp__ncp_view(m);

    perp__find_parts(&S, m->part, m->w_shifted);
}

void perp__ncp_start_groups(perp__ncp_model *m)
{
    m->groups = m->n;
    for (int32_t i = 0; i < m->n; i++)
        m->group[i] = i;
    for (int32_t j = 0; m->sparse && j < m->n; j++)
        for (int32_t k = m->starts[j]; k < m->starts[j + 1]; k++)
            m->groups -= perp__join(m->group, m->rows[k], j);
}

void perp__ncp_join_groups(perp__ncp_model *m)
{
    const size_t n = (size_t)m->n;

    for (int32_t j = 0; !m->sparse && m->groups > 1 && j < m->n; j++)
        for (int32_t i = 0; i < m->n; i++)
            if (m->S[(size_t)j * n + (size_t)i] != 0.0)
                m->groups -= perp__join(m->group, i, j);
    memcpy(m->part, m->group, n * sizeof *m->part);
    perp__number_parts(m->part, m->n);
    memcpy(m->part + n, m->part, n * sizeof *m->part);
}

double perp__ncp_size_left(const perp__ncp_model *m, int32_t j, double z)
{
    const double left = VANISHED * m->z_start[j] / m->z_unit[j];

    return fabs(z) > left ? fabs(z) : left;
}

void perp__ncp_find_omega(perp__ncp_model *m, const double *z, const double *w)
{
    const int32_t n = m->n;
    const perp__matrix S = perp__ncp_view(m);
    double *minus_z = m->omega;

    for (int32_t i = 0; i < n; i++) {
        minus_z[i] = -z[i];
        m->offset[i] = w[i];
        m->most[i] = m->most[n + i] = 0.0;
    }
    perp__multiply_add(&S, minus_z, m->offset);
    for (int32_t i = 0; i < n; i++) {
        double *row = &m->most[m->part[i]], *column = &m->most[m->part[n + i]];
        const double size = fabs(m->offset[i]), left = perp__ncp_size_left(m, i, z[i]);

        *row = size > *row ? size : *row; /* what a NaN comes from is refused elsewhere */
        *column = left > *column ? left : *column;
    }
    for (int32_t i = 0; i < 2 * n; i++)
        if (m->most[i] != 0.0)
            m->most[i] = isinf(m->most[i]) ? NAN : perp__shift(1.0, perp__exponent_of(m->most[i]));
    for (int32_t i = 0; i < 2 * n; i++)
        m->omega[i] = m->most[m->part[i]];
}

void perp__ncp_mark_start(perp__ncp_model *m, const double *z, const double *w)
{
    const int32_t n = m->n;

    if (m->start_known)
        return;
    m->start_known = 1;
    perp__ncp_find_parts(m);
    perp__ncp_find_omega(m, z, w);
    for (int32_t i = 0; i < n; i++) {
        m->omega_start[i] = m->omega[i] * m->unit[i];
        m->omega_start[n + i] = m->omega[n + i] * m->unit[n + i];
        m->D_start[i] = m->D[i];
    }
    if (!m->apart) {
        perp__ncp_join_groups(m);
        perp__ncp_find_omega(m, z, w);
    }
}

static double over(double x, double omega)
{
    return x == 0.0 ? 0.0 : x / omega;
}

/* |mid(z - low, z - high, w)|, each over its unit, a power of two */
static double relative(double z, double low, double high, double w, double omega_z, double omega_w)
{
    double above, below;

    if (omega_z == omega_w)
        return over(fabs(perp__mid(z, low, high, w)), omega_z);
    above = over(z - low, omega_z);
    below = over(z - high, omega_z);
    w = over(w, omega_w);
    return fabs(perp__mid(0.0, -above, -below, w));
}

double perp__ncp_residual_at_start(const perp__ncp_model *m, const double *z, const double *w)
{
    const double *omega_w = m->omega_start, *omega_z = m->omega_start + m->n;
    double most = 0.0;

    for (int32_t i = 0; i < m->n && m->start_known; i++) {
        const double D = m->D_start[i];

        if (m->lower[i] < m->upper[i] && omega_z[i] > 0.0 && omega_w[i] > 0.0)
            perp__raise_to(&most, relative(z[i] / D, m->lower[i] / D, m->upper[i] / D, D * w[i],
                                           omega_z[i], omega_w[i]));
    }
    return most;
}

bool perp__ncp_start_tells(const perp__ncp_model *m, const double *z, const double *w)
{
    const double *omega_w = m->omega_start, *omega_z = m->omega_start + m->n;

    for (int32_t i = 0; i < m->n; i++)
        if (!(m->start_known && omega_z[i] > 0.0 && omega_w[i] > 0.0) &&
            perp__mid(z[i], m->lower[i], m->upper[i], w[i]) != 0.0)
            return 0;
    return 1;
}

double perp__ncp_tested(const perp__ncp_model *m, const double *z, const double *w)
{
    double most = 0.0;

    for (int32_t i = 0; i < m->n; i++)
        if (m->low[i] < m->high[i])
            perp__raise_to(&most, relative(z[i], m->low[i], m->high[i], w[i], m->omega[m->n + i],
                                           m->omega[i]));
    return most;
}
