/* The coordinates in which methods see a problem. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/scale.h"
#include "ncp/model.h"

#define NEGLIGIBLE 0x1p-20 /* of a diagonal entry's row and column */

void perp__ncp_model_set_unit(perp__ncp_model *m, double unit)
{
    m->unit = unit;
    for (int32_t i = 0; i < m->n; i++) {
        double low, high;

        m->z_unit[i] = m->D[i] * unit;
        m->w_unit[i] = unit / m->D[i];
        low = m->lower[i] / m->z_unit[i];
        high = m->upper[i] / m->z_unit[i];
        m->low[i] = isinf(low) && isfinite(m->lower[i]) ? -DBL_MAX : low;
        m->high[i] = isinf(high) && isfinite(m->upper[i]) ? DBL_MAX : high;
    }
}

void perp__ncp_model_unscale(perp__ncp_model *m)
{
    for (int32_t i = 0; i < m->n; i++) {
        m->exponents[i] = 0;
        m->D[i] = 1.0;
    }
    perp__ncp_model_set_unit(m, 1.0);
}

void perp__ncp_scale_matrix(perp__ncp_model *m)
{
    const int32_t n = m->n;

    if (m->sparse) {
        memset(m->S, 0, m->entries * sizeof(double));
        for (int32_t j = 0; j < n; j++)
            for (int32_t k = m->pattern_starts[j]; k < m->pattern_starts[j + 1]; k++)
                m->S[m->place[k]] = m->given[k] * (m->D[m->pattern_rows[k]] * m->D[j]);
        return;
    }
    for (int32_t j = 0; j < n; j++)
        for (int32_t i = 0; i < n; i++) {
            const size_t at = (size_t)j * (size_t)n + (size_t)i;
            const size_t there = m->problem.storage == PERP_STORAGE_ROW_MAJOR
                                     ? (size_t)i * (size_t)n + (size_t)j
                                     : at;

            m->S[at] = m->given[there] * (m->D[i] * m->D[j]);
        }
}

/* largest[i] := max |J_ij|, |J_ji|, j != i; where[i] := the place of J_ii in `given`, or -1. */
static void look_around(const perp__ncp_model *m, double *largest, int32_t *where)
{
    const int32_t n = m->n;

    for (int32_t i = 0; i < n; i++) {
        largest[i] = 0.0;
        where[i] = -1;
    }
    for (int32_t j = 0; j < n; j++) {
        const int32_t from = m->sparse ? m->pattern_starts[j] : 0;
        const int32_t to = m->sparse ? m->pattern_starts[j + 1] : n;

        for (int32_t k = from; k < to; k++) { /* a transposed matrix has the same maxima */
            const int32_t i = m->sparse ? m->pattern_rows[k] : k;
            const double size =
                fabs(m->given[m->sparse ? (size_t)k : (size_t)j * (size_t)n + (size_t)k]);

            if (i == j) {
                where[j] = k;
            } else {
                largest[i] = fmax(largest[i], size);
                largest[j] = fmax(largest[j], size);
            }
        }
    }
}

/* Diagonal entries that are next to nothing beside their row and column say nothing about the size
 * of a variable: at z = 0, z^3 has the slope 0, or by differences h^2. For the scaling they are 0.
 */
static void find_exponents(perp__ncp_model *m)
{
    double *largest = m->w_shifted, *kept = m->w_shifted + m->n;
    int32_t *where = m->exponents;
    perp__matrix J;

    memset(&J, 0, sizeof J);
    J.rows = J.columns = m->n;
    J.values = m->given;
    J.column_starts = m->sparse ? m->pattern_starts : NULL;
    J.row_indices = m->pattern_rows;
    J.row_stride = m->problem.storage == PERP_STORAGE_ROW_MAJOR ? (size_t)m->n : 1;
    J.column_stride = m->problem.storage == PERP_STORAGE_ROW_MAJOR ? 1 : (size_t)m->n;
    look_around(m, largest, where);
    for (int32_t i = 0; i < m->n; i++) {
        double *entry = where[i] < 0 ? NULL
                                     : m->given + (m->sparse ? (size_t)where[i]
                                                             : (size_t)i * ((size_t)m->n + 1));

        kept[i] = entry ? *entry : 0.0;
        if (entry && fabs(*entry) < NEGLIGIBLE * largest[i])
            *entry = 0.0;
    }
    perp__equilibrate(&J, m->scaling, m->exponents, largest, m->exponents_work);
    for (int32_t j = 0; j < m->n; j++) {
        if (!m->sparse)
            m->given[(size_t)j * ((size_t)m->n + 1)] = kept[j];
        for (int32_t k = m->sparse ? m->pattern_starts[j] : 0;
             m->sparse && k < m->pattern_starts[j + 1]; k++)
            if (m->pattern_rows[k] == j)
                m->given[k] = kept[j];
    }
}

void perp__ncp_model_equilibrate(perp__ncp_model *m)
{
    find_exponents(m);
    for (int32_t i = 0; i < m->n; i++)
        m->D[i] = perp__power_of_two(m->exponents[i]);
    perp__ncp_model_set_unit(m, 1.0);
    perp__ncp_scale_matrix(m);
}
