/* A Jacobian callback against differences of F that tell their own error: Richardson's
 * extrapolation from the steps h and h/2. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "ncp/solver.h"

/* F at the four points of a column, and its value and error by differences. */
typedef struct column {
    int32_t j;
    double *far_high, *near_high, *far_low, *near_low; /* z +- h, z +- h/2; n entries each */
    double high, low; /* the steps of the two sides, low < 0; 0: F itself stands for that side */
} column;

/* far and near := F at z + step and z + step/2, or F and a step of 0. The point in the run's own
 * vector z, which is left as it was. */
static perp_status look(perp_ncp_solver *solver, int32_t j, double *step, double *far, double *near)
{
    perp__ncp_model *m = &solver->model;
    double *z = solver->run.newton.z;
    const double here = z[j];
    perp_status status = PERP__NCP_OUTSIDE;

    *step = perp__ncp_fit_step(m, j, *step);
    for (int32_t k = 0; k < PERP__NCP_SHRINKS && *step != 0.0 && status == PERP__NCP_OUTSIDE; k++) {
        if (k > 0)
            *step = perp__ncp_fit_step(m, j, PERP__NCP_SHRINK * *step);
        z[j] = here + *step;
        status = perp__ncp_call(m, z, far);
        if (status == PERP_OK) {
            z[j] = here + 0.5 * *step;
            status = perp__ncp_call(m, z, near);
        }
    }
    z[j] = here;
    if (status != PERP__NCP_OUTSIDE)
        return status;
    *step = 0.0;
    memcpy(far, solver->best_w, (size_t)m->n * sizeof(double));
    memcpy(near, solver->best_w, (size_t)m->n * sizeof(double));
    return PERP_OK;
}

/* PERP_OK, PERP__NCP_OUTSIDE if neither side is defined, or an error. */
static perp_status sample(perp_ncp_solver *solver, column *c)
{
    const double h = perp__ncp_size(&solver->model, c->j) * perp__difference_step(5);
    perp_status status;

    c->high = h;
    c->low = -h;
    status = look(solver, c->j, &c->high, c->far_high, c->near_high);
    PERP__THEN(status, look(solver, c->j, &c->low, c->far_low, c->near_low));
    if (status == PERP_OK && c->high == 0.0 && c->low == 0.0)
        return PERP__NCP_OUTSIDE;
    if (status == PERP_OK && c->high > -c->low && c->low != 0.0) { /* to both sides alike */
        c->high = -c->low;
        status = look(solver, c->j, &c->high, c->far_high, c->near_high);
    } else if (status == PERP_OK && c->high < -c->low && c->high != 0.0) {
        c->low = -c->high;
        status = look(solver, c->j, &c->low, c->far_low, c->near_low);
    }
    return status;
}

/* dF_i/dz_j, and how wrong that may be. */
static double difference(const column *c, int32_t i, double *uncertainty)
{
    const double width = c->high - c->low;
    const bool central = c->high != 0.0 && c->low != 0.0;
    const double wide = (c->far_high[i] - c->far_low[i]) / width;
    const double narrow = (c->near_high[i] - c->near_low[i]) / (0.5 * width);
    const double best = central ? narrow + (narrow - wide) / 3.0 : narrow + (narrow - wide);
    const double size = fmax(fabs(c->far_high[i]), fabs(c->far_low[i]));

    *uncertainty = fabs(best - narrow) + PERP__ROUNDING_LIMIT * size / width;
    return best;
}

static void compare(perp_ncp_check *check, const column *c, int32_t i, double given, double *worst)
{
    double uncertainty;
    const double found = difference(c, i, &uncertainty);
    const double allowed =
        PERP__CERTAIN * uncertainty + sqrt(DBL_EPSILON) * fmax(fabs(given), fabs(found));
    const double apart = fabs(given - found);
    const double ratio = apart > 0.0 ? apart / allowed : 0.0;

    check->wrong += ratio > 1.0;
    if (ratio > *worst) {
        *worst = ratio;
        check->row = i;
        check->column = c->j;
        check->given = given;
        check->difference = found;
        check->uncertainty = uncertainty;
    }
}

static void compare_column(const perp__ncp_model *m, perp_ncp_check *check, const column *c,
                           double *worst)
{
    const size_t n = (size_t)m->n, j = (size_t)c->j;
    const int by_rows = m->problem.storage == PERP_STORAGE_ROW_MAJOR;
    int32_t k = m->sparse ? m->pattern_starts[j] : 0;

    for (int32_t i = 0; i < m->n; i++) {
        if (!m->sparse) {
            compare(check, c, i, m->given[by_rows ? (size_t)i * n + j : j * n + (size_t)i], worst);
        } else if (k < m->pattern_starts[j + 1] && m->pattern_rows[k] == i) {
            compare(check, c, i, m->given[k], worst);
            k++;
        } else { /* not in the pattern: is it missing? */
            double uncertainty;
            const double found = difference(c, i, &uncertainty);

            if (!(fabs(found) > PERP__CERTAIN * uncertainty))
                continue;
            check->missing++;
            if (fabs(found) > fabs(check->missing_difference)) {
                check->missing_row = i;
                check->missing_column = c->j;
                check->missing_difference = found;
            }
        }
    }
}

static perp_status check_all(perp_ncp_solver *solver, perp_ncp_check *check, const double *z)
{
    perp_context *context = solver->context;
    perp__ncp_model *m = &solver->model;
    const perp__newton *f = &solver->run.newton;
    column c = {0, f->trial_z, f->trial_w, f->part, f->image, 0.0, 0.0};
    double worst = -1.0;
    perp_status status;

    /* 1. run.z := z, best_w := F(z), given := J(z) */
    perp__ncp_model_unscale(m);
    for (int32_t i = 0; i < m->n; i++) {
        if (!(z[i] >= m->lower[i] && z[i] <= m->upper[i]))
            return perp__refuse(context, "z[%d] = %g is outside of its bounds", (int)i, z[i]);
        f->z[i] = z[i];
        m->largest[i] = fabs(z[i]);
    }
    status = perp__ncp_evaluate(m, f->z, solver->best_w);
    if (status == PERP__NCP_OUTSIDE)
        return perp__refuse(context, "problem.function is not defined at z");
    PERP__THEN(status, perp__ncp_ask(m));
    if (status == PERP__NCP_OUTSIDE)
        return perp__refuse(context, "problem.jacobian is not defined at z");
    /* 2. Column by column. */
    check->row = check->column = check->missing_row = check->missing_column = -1;
    for (c.j = 0; c.j < m->n && status == PERP_OK; c.j++) {
        status = m->lower[c.j] < m->upper[c.j] ? sample(solver, &c) : PERP__NCP_OUTSIDE;
        if (status == PERP_OK)
            compare_column(m, check, &c, &worst);
        check->unchecked += status == PERP__NCP_OUTSIDE;
        status = status < 0 ? status : PERP_OK;
    }
    return status;
}

perp_status perp_ncp_check_jacobian(perp_context *context, perp_ncp_check *check,
                                    const perp_ncp_problem *problem, const double *z)
{
    perp_ncp_check copy = {0};
    perp_ncp_solver *solver = NULL;
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_ncp_check, context, check);
    PERP__THEN(status, perp__ncp_create(context, &solver, NULL));
    PERP__THEN(status, perp__ncp_setup(solver, problem));
    if (status == PERP_OK && !solver->model.problem.jacobian)
        status = perp__refuse(context, "problem.jacobian is NULL");
    PERP__THEN(status, perp__check_vector(context, "z", z, (size_t)solver->model.n));
    PERP__THEN(status, check_all(solver, &copy, z));
    perp__handle_end(solver);
    if (status == PERP_OK)
        perp__struct_write(check, &copy, sizeof copy);
    return perp__leave(context, status);
}
