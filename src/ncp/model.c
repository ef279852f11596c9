/* Evaluation in scaled coordinates. */
#include "ncp/model.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"

void perp__ncp_model_layout(perp__arena *arena, perp__ncp_model *m)
{
    const size_t n = (size_t)m->n;
    const size_t given = m->sparse ? (size_t)m->problem.column_starts[n] : n * n;
    const size_t all = m->sparse ? given + n : given;

    PERP__DOUBLES(arena, n, &m->lower, &m->upper, &m->low, &m->high, &m->D, &m->offset, &m->z_unit,
                  &m->w_unit, &m->z_caller, &m->w_caller, &m->shifted, &m->step, &m->largest,
                  &m->sizes, &m->moved, &m->z_start, &m->D_start);
    PERP__DOUBLES(arena, 2 * n, &m->unit, &m->omega, &m->most, &m->w_shifted, &m->omega_start);
    PERP__INTEGERS(arena, 2 * n, &m->part, &m->exponents_work);
    PERP__INTEGERS(arena, n, &m->group, &m->exponents, &m->colours.of, &m->colours.order,
                   &m->colours.marks);
    m->S = perp__arena_take(arena, all, sizeof(double));
    m->given = perp__arena_take(arena, given, sizeof(double));
    PERP__INTEGERS(arena, n + 1, &m->colours.starts, &m->colours.row_starts);
    m->colours.row_columns = perp__arena_take(arena, m->sparse ? given : 0, sizeof(int32_t));
    m->pattern_starts = m->pattern_rows = m->starts = m->rows = m->place = m->diagonal = NULL;
    if (!m->sparse)
        return;
    PERP__INTEGERS(arena, n + 1, &m->pattern_starts, &m->starts);
    PERP__INTEGERS(arena, given, &m->pattern_rows, &m->place);
    m->rows = perp__arena_take(arena, all, sizeof(int32_t));
    m->diagonal = perp__arena_take(arena, n, sizeof(int32_t));
}

void perp__ncp_model_read(perp__ncp_model *m, const perp_ncp_problem *problem)
{
    const size_t n = (size_t)m->n;
    int32_t count = 0;

    m->problem = *problem;
    m->entries = n * n;
    m->colours.known = 0;
    for (size_t i = 0; i < n; i++) {
        m->lower[i] = problem->lower ? problem->lower[i] : 0.0;
        m->upper[i] = problem->upper ? problem->upper[i] : INFINITY;
    }
    m->problem.lower = m->lower;
    m->problem.upper = m->upper;
    if (!m->sparse)
        return;
    memcpy(m->pattern_starts, problem->column_starts, (n + 1) * sizeof(int32_t));
    if (m->pattern_starts[n] > 0)
        memcpy(m->pattern_rows, problem->row_indices,
               (size_t)m->pattern_starts[n] * sizeof(int32_t));
    m->problem.column_starts = m->pattern_starts;
    m->problem.row_indices = m->pattern_rows;
    /* The caller's pattern with all of the diagonal. */
    for (int32_t j = 0; j < m->n; j++) {
        const int32_t end = m->pattern_starts[j + 1];
        int32_t k = m->pattern_starts[j];

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

perp_status perp__ncp_call(perp__ncp_model *m, const double *z, double *F)
{
    int32_t said;

    if (perp__ncp_is_late(m) || !perp__all_finite(z, (size_t)m->n))
        return PERP__NCP_OUTSIDE;
    m->function_evaluations++;
    for (int32_t i = 0; i < m->n; i++)
        F[i] = NAN; /* what the callback leaves out is not what it wrote before */
    said = m->problem.function(F, z, m->problem.user);
    if (said < 0)
        return perp__fail(m->context, PERP_ERROR_CALLBACK, "problem.function returned %d",
                          (int)said);
    if (said > 0)
        return PERP__NCP_OUTSIDE;
    return perp__all_finite(F, (size_t)m->n) ? PERP_OK : PERP__NCP_OUTSIDE;
}

perp_status perp__ncp_evaluate(perp__ncp_model *m, const double *z, double *w)
{
    perp_status status;

    for (int32_t i = 0; i < m->n; i++)
        m->z_caller[i] = perp__clamp(m->z_unit[i] * z[i], m->lower[i], m->upper[i]);
    status = perp__ncp_call(m, m->z_caller, m->w_caller);
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < m->n; i++)
        w[i] = m->w_caller[i] / m->w_unit[i];
    return perp__all_finite(w, (size_t)m->n) ? PERP_OK : PERP__NCP_OUTSIDE;
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
    return perp__all_finite(m->given, count) ? PERP_OK : PERP__NCP_OUTSIDE;
}

perp_status perp__ncp_linearise(perp__ncp_model *m, const double *z, const double *w)
{
    perp_status status = PERP__NCP_OUTSIDE;

    m->known = 0;
    for (int32_t i = 0; i < m->n; i++) {
        m->z_caller[i] = perp__clamp(m->z_unit[i] * z[i], m->lower[i], m->upper[i]);
        m->w_caller[i] = w[i] * m->w_unit[i];
    }
    m->jacobian_evaluations++;
    if (m->problem.jacobian)
        status = perp__ncp_ask(m);
    if (status == PERP__NCP_OUTSIDE)
        status = perp__ncp_differences(m);
    if (status != PERP_OK)
        return status;
    perp__ncp_scale_matrix(m);
    if (!perp__all_finite(m->S, m->entries))
        return PERP__NCP_OUTSIDE;
    perp__ncp_join_groups(m);
    if (m->apart)
        perp__ncp_find_parts(m);
    m->known = 1;
    return PERP_OK;
}

perp__matrix perp__ncp_view(const perp__ncp_model *m)
{
    const perp__matrix S = {m->n,   m->n, 1, (size_t)m->n, m->S, m->sparse ? m->starts : NULL,
                            m->rows};

    return S;
}

bool perp__ncp_is_late(perp__ncp_model *m)
{
    perp__ncp_control *control = &m->control;

    if (control->ended < 0 && control->deadline > 0.0 && perp__now() > control->deadline)
        control->ended = PERP_OUTCOME_TIME_LIMIT;
    return control->deadline > 0.0 && control->ended == PERP_OUTCOME_TIME_LIMIT;
}

perp_status perp__ncp_tick(perp__ncp_model *m, perp_outcome *outcome, int64_t iterations,
                           double residual)
{
    perp__ncp_control *control = &m->control;

    *outcome = -1;
    if (m->settings->monitor) {
        const perp_ncp_progress progress = {.struct_size = sizeof progress,
                                            .method = control->method,
                                            .restarts = control->restarts,
                                            .iterations = iterations,
                                            .evaluations = m->function_evaluations,
                                            .residual = residual};
        const int32_t said = m->settings->monitor(&progress, m->settings->monitor_user);

        if (said < 0)
            return perp__fail(m->context, PERP_ERROR_CALLBACK, "the monitor asked to abort");
        if (said > 0)
            control->ended = PERP_OUTCOME_STOPPED;
    }
    perp__ncp_is_late(m);
    *outcome = control->ended;
    return PERP_OK;
}
