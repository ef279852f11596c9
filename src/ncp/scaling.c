/* The coordinates in which methods see a problem. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/scale.h"
#include "ncp/model.h"

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
    const int32_t by_rows = m->problem.storage == PERP_STORAGE_ROW_MAJOR;
    perp__matrix J;

    memset(&J, 0, sizeof J);
    J.rows = J.columns = m->n;
    J.values = m->given;
    J.column_starts = m->sparse ? m->pattern_starts : NULL;
    J.row_indices = m->pattern_rows;
    J.row_stride = by_rows ? (size_t)m->n : 1;
    J.column_stride = by_rows ? 1 : (size_t)m->n;
    return J;
}

void perp__ncp_model_equilibrate(perp__ncp_model *m)
{
    const perp__matrix J = perp__ncp_given(m);

    perp__equilibrate(&J, m->scaling, m->exponents, m->most, m->exponents_work);
    set_powers(m);
    perp__ncp_scale_matrix(m);
}
