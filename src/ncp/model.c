/* Evaluation in scaled coordinates. */
#include "ncp/model.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"

#define VANISHED 0x1p-20 /* of z at the start */

void perp__ncp_model_layout(perp__arena *arena, perp__ncp_model *m)
{
    const size_t n = (size_t)m->n;
    const size_t given = m->sparse ? (size_t)m->problem.column_starts[n] : n * n;
    const size_t all = m->sparse ? given + n : given;

    m->lower = perp__arena_take(arena, n, sizeof(double));
    m->upper = perp__arena_take(arena, n, sizeof(double));
    m->low = perp__arena_take(arena, n, sizeof(double));
    m->high = perp__arena_take(arena, n, sizeof(double));
    m->D = perp__arena_take(arena, n, sizeof(double));
    m->z_unit = perp__arena_take(arena, n, sizeof(double));
    m->w_unit = perp__arena_take(arena, n, sizeof(double));
    m->exponents = perp__arena_take(arena, n, sizeof(int32_t));
    m->exponents_work = perp__arena_take(arena, 2 * n, sizeof(int32_t));
    m->S = perp__arena_take(arena, all, sizeof(double));
    m->given = perp__arena_take(arena, given, sizeof(double));
    m->z_caller = perp__arena_take(arena, n, sizeof(double));
    m->w_caller = perp__arena_take(arena, n, sizeof(double));
    m->shifted = perp__arena_take(arena, n, sizeof(double));
    m->w_shifted = perp__arena_take(arena, 2 * n, sizeof(double));
    m->step = perp__arena_take(arena, n, sizeof(double));
    m->largest = perp__arena_take(arena, n, sizeof(double));
    m->z_start = perp__arena_take(arena, n, sizeof(double));
    m->D_start = perp__arena_take(arena, n, sizeof(double));
    m->colours.of = perp__arena_take(arena, n, sizeof(int32_t));
    m->colours.starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
    m->colours.order = perp__arena_take(arena, n, sizeof(int32_t));
    m->colours.marks = perp__arena_take(arena, n, sizeof(int32_t));
    m->colours.row_starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
    m->colours.row_columns = perp__arena_take(arena, m->sparse ? given : 0, sizeof(int32_t));
    m->pattern_starts = m->pattern_rows = m->starts = m->rows = m->place = m->diagonal = NULL;
    if (!m->sparse)
        return;
    m->pattern_starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
    m->pattern_rows = perp__arena_take(arena, given, sizeof(int32_t));
    m->starts = perp__arena_take(arena, n + 1, sizeof(int32_t));
    m->rows = perp__arena_take(arena, all, sizeof(int32_t));
    m->place = perp__arena_take(arena, given, sizeof(int32_t));
    m->diagonal = perp__arena_take(arena, n, sizeof(int32_t));
}

/* The caller's pattern with all of the diagonal. */
static void pad(perp__ncp_model *m)
{
    int32_t count = 0;

    for (int32_t j = 0; j < m->n; j++) {
        int32_t k = m->pattern_starts[j], end = m->pattern_starts[j + 1];

        m->starts[j] = count;
        for (; k < end && m->pattern_rows[k] < j; k++) {
            m->place[k] = count;
            m->rows[count++] = m->pattern_rows[k];
        }
        m->diagonal[j] = count;
        m->rows[count++] = j;
        if (k < end && m->pattern_rows[k] == j)
            m->place[k++] = m->diagonal[j];
        for (; k < end; k++) {
            m->place[k] = count;
            m->rows[count++] = m->pattern_rows[k];
        }
    }
    m->starts[m->n] = count;
    m->entries = (size_t)count;
}

void perp__ncp_model_read(perp__ncp_model *m, const perp_ncp_problem *problem)
{
    const size_t n = (size_t)m->n;

    m->problem = *problem;
    m->entries = n * n;
    for (size_t i = 0; i < n; i++) {
        m->lower[i] = problem->lower ? problem->lower[i] : 0.0;
        m->upper[i] = problem->upper ? problem->upper[i] : INFINITY;
    }
    m->problem.lower = m->lower;
    m->problem.upper = m->upper;
    if (m->sparse) {
        const size_t given = (size_t)problem->column_starts[n];

        memcpy(m->pattern_starts, problem->column_starts, (n + 1) * sizeof(int32_t));
        if (given > 0)
            memcpy(m->pattern_rows, problem->row_indices, given * sizeof(int32_t));
        m->problem.column_starts = m->pattern_starts;
        m->problem.row_indices = m->pattern_rows;
        pad(m);
    }
    m->colours.known = 0;
}

perp_status perp__ncp_call(perp__ncp_model *m, const double *z, double *F)
{
    int32_t said;

    m->function_evaluations++;
    for (int32_t i = 0; i < m->n; i++)
        F[i] = NAN; /* what the callback leaves out is not what it wrote before */
    said = m->problem.function(F, z, m->problem.user);
    if (said < 0)
        return perp__fail(m->context, PERP_ERROR_CALLBACK, "problem.function returned %d",
                          (int)said);
    if (said > 0)
        return PERP__NCP_OUTSIDE;
    for (int32_t i = 0; i < m->n; i++)
        if (!isfinite(F[i]))
            return PERP__NCP_OUTSIDE;
    return PERP_OK;
}

perp_status perp__ncp_evaluate(perp__ncp_model *m, const double *z, double *w)
{
    perp_status status;

    for (int32_t i = 0; i < m->n; i++)
        m->z_caller[i] = perp__ncp_clamp(m->z_unit[i] * z[i], m->lower[i], m->upper[i]);
    status = perp__ncp_call(m, m->z_caller, m->w_caller);
    for (int32_t i = 0; i < m->n && status == PERP_OK; i++) {
        w[i] = m->w_caller[i] / m->w_unit[i];
        if (!isfinite(w[i]))
            status = PERP__NCP_OUTSIDE;
    }
    return status;
}

perp_status perp__ncp_ask(perp__ncp_model *m)
{
    const size_t count = m->sparse ? (size_t)m->pattern_starts[m->n] : (size_t)m->n * (size_t)m->n;
    int32_t said;

    for (size_t k = 0; k < count; k++)
        m->given[k] = NAN;
    said = m->problem.jacobian(m->given, m->z_caller, m->problem.user);
    if (said < 0)
        return perp__fail(m->context, PERP_ERROR_CALLBACK, "problem.jacobian returned %d",
                          (int)said);
    if (said > 0)
        return PERP__NCP_OUTSIDE;
    for (size_t k = 0; k < count; k++)
        if (!isfinite(m->given[k]))
            return PERP__NCP_OUTSIDE;
    return PERP_OK;
}

perp_status perp__ncp_linearise(perp__ncp_model *m, const double *z, const double *w)
{
    perp_status status = PERP__NCP_OUTSIDE;

    for (int32_t i = 0; i < m->n; i++) {
        m->z_caller[i] = perp__ncp_clamp(m->z_unit[i] * z[i], m->lower[i], m->upper[i]);
        m->w_caller[i] = w[i] * m->w_unit[i];
    }
    m->jacobian_evaluations++;
    if (m->problem.jacobian)
        status = perp__ncp_ask(m);
    if (status == PERP__NCP_OUTSIDE)
        status = perp__ncp_differences(m);
    if (status == PERP_OK)
        perp__ncp_scale_matrix(m);
    for (size_t k = 0; k < m->entries && status == PERP_OK; k++)
        if (!isfinite(m->S[k]))
            status = PERP__NCP_OUTSIDE;
    return status;
}

void perp__ncp_add(const perp__ncp_model *m, const double *x, double *y)
{
    const int32_t n = m->n;

    for (int32_t j = 0; j < n; j++) {
        if (x[j] == 0.0)
            continue;
        if (m->sparse)
            for (int32_t k = m->starts[j]; k < m->starts[j + 1]; k++)
                y[m->rows[k]] += m->S[k] * x[j];
        else
            for (int32_t i = 0; i < n; i++)
                y[i] += m->S[(size_t)j * (size_t)n + (size_t)i] * x[j];
    }
}

void perp__ncp_transposed(const perp__ncp_model *m, const double *x, double *y)
{
    const int32_t n = m->n;

    for (int32_t j = 0; j < n; j++) {
        double sum = 0.0;

        if (m->sparse)
            for (int32_t k = m->starts[j]; k < m->starts[j + 1]; k++)
                sum += m->S[k] * x[m->rows[k]];
        else
            for (int32_t i = 0; i < n; i++)
                sum += m->S[(size_t)j * (size_t)n + (size_t)i] * x[i];
        y[j] = sum;
    }
}

perp_status perp__ncp_tick(perp__ncp_model *m, perp_outcome *outcome, int64_t iterations,
                           double residual)
{
    const perp__ncp_control *control = &m->control;

    *outcome = -1;
    if (control->monitor) {
        perp_ncp_progress progress;
        int32_t said;

        memset(&progress, 0, sizeof progress);
        progress.struct_size = sizeof progress;
        progress.method = control->method;
        progress.restarts = control->restarts;
        progress.iterations = iterations;
        progress.evaluations = m->function_evaluations;
        progress.residual = residual;
        said = control->monitor(&progress, control->monitor_user);
        if (said < 0)
            return perp__fail(m->context, PERP_ERROR_CALLBACK, "the monitor asked to abort");
        if (said > 0)
            *outcome = PERP_OUTCOME_STOPPED;
    }
    if (*outcome < 0 && control->deadline > 0.0 && perp__now() > control->deadline)
        *outcome = PERP_OUTCOME_TIME_LIMIT;
    return PERP_OK;
}

double perp__ncp_omega(const perp__ncp_model *m, const double *z, const double *w, double *minus_z,
                       double *offset)
{
    double most = 0.0;
    int exponent;

    for (int32_t i = 0; i < m->n; i++) {
        minus_z[i] = -z[i];
        offset[i] = w[i];
    }
    perp__ncp_add(m, minus_z, offset);
    for (int32_t i = 0; i < m->n; i++)
        most = fmax(fmax(most, fabs(offset[i])),
                    fmax(fabs(z[i]), VANISHED * m->z_start[i] / m->z_unit[i]));
    if (!(most > 0.0) || isinf(most))
        return 1.0;
    frexp(most, &exponent);
    return ldexp(1.0, exponent - 1);
}

void perp__ncp_mark_start(perp__ncp_model *m, double omega)
{
    if (m->omega_start > 0.0)
        return;
    m->omega_start = omega * m->unit;
    memcpy(m->D_start, m->D, (size_t)m->n * sizeof(double));
}

double perp__ncp_residual_at_start(const perp__ncp_model *m, const double *z, const double *w)
{
    double most = 0.0;

    if (!(m->omega_start > 0.0))
        return 0.0; /* it never came to a linearisation */
    for (int32_t i = 0; i < m->n; i++) {
        const double D = m->D_start[i];
        const double r = perp__ncp_mid(z[i] / D, m->lower[i] / D, m->upper[i] / D, D * w[i]);

        if (m->lower[i] < m->upper[i] && !(fabs(r) <= most) && !isnan(most))
            most = fabs(r);
    }
    return most / m->omega_start;
}

double perp__ncp_residual(const perp__ncp_model *m, const double *z, const double *w)
{
    double most = 0.0;

    for (int32_t i = 0; i < m->n; i++) {
        double r = fabs(perp__ncp_mid(z[i], m->low[i], m->high[i], w[i]));

        if (m->low[i] < m->high[i] && !(r <= most) && !isnan(most))
            most = r;
    }
    return most;
}
