/* Defaults, texts and checks of what the caller chooses. */
#include "ncp/settings.h"

#include <math.h>
#include <string.h>

#include "base/context.h"

PERP__INIT(perp_ncp_problem)

perp_status perp_ncp_settings_init(perp_ncp_settings *settings, size_t size)
{
    perp_status status = perp__struct_init(settings, size, PERP__FIRST(perp_ncp_settings));

    if (status == PERP_OK) {
        settings->tol = 1e-10;
        settings->penalty = 0.1;
        settings->restarts = 20;
        settings->scaling = 1;
        settings->polish = 1;
    }
    return status;
}

PERP__INIT(perp_ncp_result)

const char *perp_ncp_method_text(int32_t method)
{
    static const char *const texts[] = {"auto", "fischer", "josephy"};

    return method >= 0 && method <= PERP_NCP_JOSEPHY ? texts[method] : "unknown method";
}

static perp_status check_counts(perp_context *context, const perp_ncp_settings *own)
{
    if (own->method < 0 || own->method > PERP_NCP_JOSEPHY)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.method is %d, which is none",
                          (int)own->method);
    if (own->max_iterations < 0)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.max_iterations is %d, expected a count, or 0 for the default",
                          (int)own->max_iterations);
    if (own->restarts < 0)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.restarts is %d, expected a count",
                          (int)own->restarts);
    if (own->scaling != 0 && own->scaling != 1)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.scaling is %d, expected 0 or 1",
                          (int)own->scaling);
    if (own->polish != 0 && own->polish != 1)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.polish is %d, expected 0 or 1",
                          (int)own->polish);
    if (own->reserved != 0)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.reserved is %d, expected 0",
                          (int)own->reserved);
    return PERP_OK;
}

static perp_status check_numbers(perp_context *context, const perp_ncp_settings *own)
{
    if (isnan(own->tol) || isnan(own->time_limit) || isnan(own->penalty))
        return perp__fail(context, PERP_ERROR_NOT_FINITE, "settings.%s is nan",
                          isnan(own->tol)          ? "tol"
                          : isnan(own->time_limit) ? "time_limit"
                                                   : "penalty");
    if (!(own->tol > 0.0) || !isfinite(own->tol))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.tol is %g, expected a number above 0", own->tol);
    if (!(own->time_limit >= 0.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.time_limit is %g, expected seconds, or 0 for none",
                          own->time_limit);
    if (!(own->penalty >= 0.0 && own->penalty < 1.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.penalty is %g, expected a number in [0, 1)", own->penalty);
    return PERP_OK;
}

perp_status perp__ncp_settings_read(perp_context *context, perp_ncp_settings *own,
                                    const perp_ncp_settings *settings)
{
    perp_ncp_settings read;
    perp_status status = perp_ncp_settings_init(&read, sizeof read);

    if (status == PERP_OK)
        status = PERP__READ(perp_ncp_settings, context, &read, settings);
    if (status == PERP_OK)
        status = check_counts(context, &read);
    if (status == PERP_OK)
        status = check_numbers(context, &read);
    if (status == PERP_OK)
        *own = read;
    return status;
}

static perp_status check_column(perp_context *context, const perp_ncp_problem *p, int32_t j)
{
    for (int32_t k = p->column_starts[j]; k < p->column_starts[j + 1]; k++) {
        if (p->row_indices[k] < 0 || p->row_indices[k] >= p->n)
            return perp__fail(context, PERP_ERROR_ARGUMENT,
                              "problem.row_indices[%d] = %d in column %d is outside 0 .. %d",
                              (int)k, (int)p->row_indices[k], (int)j, (int)p->n - 1);
        if (k > p->column_starts[j] && p->row_indices[k] <= p->row_indices[k - 1])
            return perp__fail(context, PERP_ERROR_ARGUMENT,
                              "problem.row_indices[%d] = %d in column %d is not above the one "
                              "before it",
                              (int)k, (int)p->row_indices[k], (int)j);
    }
    return PERP_OK;
}

/* Column starts first: until they are known to be sound nothing else may be read. */
static perp_status check_pattern(perp_context *context, const perp_ncp_problem *p)
{
    perp_status status = perp__check_pointer(context, "problem.column_starts", p->column_starts);

    if (status == PERP_OK && p->column_starts[0] != 0)
        status = perp__fail(context, PERP_ERROR_ARGUMENT,
                            "problem.column_starts[0] is %d, 0 expected", (int)p->column_starts[0]);
    for (int32_t j = 0; j < p->n && status == PERP_OK; j++)
        if (p->column_starts[j + 1] < p->column_starts[j])
            status = perp__fail(context, PERP_ERROR_ARGUMENT,
                                "problem.column_starts[%d] = %d is below the %d of %d", (int)j + 1,
                                (int)p->column_starts[j + 1], (int)p->column_starts[j], (int)j);
    if (status == PERP_OK && p->column_starts[p->n] > 0)
        status = perp__check_pointer(context, "problem.row_indices", p->row_indices);
    for (int32_t j = 0; j < p->n && status == PERP_OK; j++)
        status = check_column(context, p, j);
    return status;
}

static perp_status check_storage(perp_context *context, const perp_ncp_problem *p)
{
    if (p->storage == PERP_STORAGE_CSC)
        return check_pattern(context, p);
    if (p->storage != PERP_STORAGE_COLUMN_MAJOR && p->storage != PERP_STORAGE_ROW_MAJOR)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "problem.storage is %d, which is none",
                          (int)p->storage);
    if (p->column_starts || p->row_indices)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "problem.storage is dense but problem.%s is not NULL",
                          p->column_starts ? "column_starts" : "row_indices");
    return PERP_OK;
}

perp_status perp__ncp_problem_read(perp_context *context, perp_ncp_problem *own,
                                   const perp_ncp_problem *problem)
{
    perp_status status = PERP__CHECK(perp_ncp_problem, context, problem);

    if (status != PERP_OK)
        return status;
    memset(own, 0, sizeof *own);
    status = PERP__READ(perp_ncp_problem, context, own, problem);
    if (status == PERP_OK && own->n < 0)
        status = perp__fail(context, PERP_ERROR_ARGUMENT, "problem.n is %d, expected a count",
                            (int)own->n);
    if (status == PERP_OK && !own->function)
        status = perp__fail(context, PERP_ERROR_ARGUMENT, "problem.function is NULL");
    if (status == PERP_OK)
        status = check_storage(context, own);
    if (status == PERP_OK)
        status = perp__check_bounds(context, own->lower, own->upper, (size_t)own->n);
    return status;
}
