/* One constraint of a sweep, and the tested residual of one. */
#include <math.h>

#include "contact/law.h"
#include "contact/sweep/local_step.h"
#include "contact/sweep/sweep.h"

/* Contacts that roll or spin go round their parts until they agree to so much of a first step. */
#define ROUNDS_MOST 30
#define ROUNDS_ACCURACY 1e-3

/* u += W[:, from .. from + count) d, within the contact */
static void follow(const double *W, int32_t rows, int32_t from, int32_t count, const double *d,
                   double *u)
{
    for (int32_t i = 0; i < rows; i++)
        for (int32_t j = 0; j < count; j++)
            u[i] += W[i * rows + from + j] * d[j];
}

/* One part's step: r[from ..] was `old` before. Returns the largest change. */
static double settle(const double *W, int32_t rows, int32_t from, int32_t count, const double *old,
                     const double *r, double *u)
{
    double d[3], most = 0.0;

    for (int32_t i = 0; i < count; i++) {
        d[i] = r[from + i] - old[i];
        most = fmax(most, fabs(d[i]));
    }
    follow(W, rows, from, count, d, u);
    return most;
}

static int32_t step_with_discs(perp__sweep_work *work, int32_t k, double *u, double *r)
{
    const perp__contact_problem *problem = work->common.problem;
    perp__sweep_discs *discs = &work->discs[k];
    const int32_t rows = work->rows[k + 1] - work->rows[k], dim = problem->dims[k];
    const double rolling = problem->rolling ? problem->rolling[k] : 0.0;
    const double spinning = problem->spinning ? problem->spinning[k] : 0.0;
    double first = 0.0, old[3];
    int32_t mode = PERP__SEPARATE;

    for (int32_t round = 0; round < ROUNDS_MOST; round++) {
        double change;
        int32_t row = dim;

        for (int32_t i = 0; i < dim; i++)
            old[i] = r[i];
        mode = perp__local_step(&work->local[k], u, r);
        change = settle(discs->W, rows, 0, dim, old, r, u);
        if (rolling > 0.0) {
            for (int32_t i = 0; i < dim - 1; i++)
                old[i] = r[row + i];
            perp__local_step_disc(&discs->rolling, rolling * r[0], u + row, r + row);
            change = fmax(change, settle(discs->W, rows, row, dim - 1, old, r, u));
            row += dim - 1;
        }
        if (spinning > 0.0) {
            old[0] = r[row];
            perp__local_step_disc(&discs->spinning, spinning * r[0], u + row, r + row);
            change = fmax(change, settle(discs->W, rows, row, 1, old, r, u));
        }
        if (round == 0)
            first = change;
        if (!(change > ROUNDS_ACCURACY * first))
            break;
    }
    return mode;
}

int32_t perp__sweep_constraint(perp__sweep_work *work, int32_t constraint, double *u, double *dr)
{
    const int32_t first = work->rows[constraint], rows = work->rows[constraint + 1] - first;
    double *r = work->r + first;
    int32_t mode;

    for (int32_t i = 0; i < rows; i++)
        dr[i] = r[i];
    if (constraint >= work->common.problem->contacts) {
        r[0] -= u[0] * work->local[constraint].inverse_normal;
        mode = PERP__STICK;
    } else if (perp__contact_two_sided(work->common.problem, constraint) > 0) {
        mode = perp__two_sided_step(&work->two_sided[constraint], u, r);
    } else if (rows > work->local[constraint].dim) {
        mode = step_with_discs(work, constraint, u, r);
    } else {
        mode = perp__local_step(&work->local[constraint], u, r);
    }
    for (int32_t i = 0; i < rows; i++)
        dr[i] = r[i] - dr[i];
    return mode;
}

/* |r - P(r - d)|^2 for a disc of that radius. */
static double disc_map(int32_t size, double radius, const double *r, const double *d)
{
    double x[2], length = 0.0, sum = 0.0;

    for (int32_t i = 0; i < size; i++) {
        x[i] = r[i] - d[i];
        length += x[i] * x[i];
    }
    length = sqrt(length);
    for (int32_t i = 0; i < size; i++) {
        const double e = length <= radius ? d[i] : r[i] - x[i] * (radius / length);

        sum += e * e;
    }
    return sum;
}

/* |r - P_K(r - (u + s e_n) / t)|^2, nearest points of the friction cone */
static double cone_map(int32_t dim, double mu, double t, const double *r, const double *u)
{
    double d[3], x[3], length = 0.0, speed = 0.0, sum = 0.0, normal;

    for (int32_t i = 1; i < dim; i++)
        speed += u[i] * u[i];
    d[0] = (u[0] + mu * sqrt(speed)) / t;
    for (int32_t i = 1; i < dim; i++)
        d[i] = u[i] / t;
    for (int32_t i = 0; i < dim; i++)
        x[i] = r[i] - d[i];
    for (int32_t i = 1; i < dim; i++)
        length += x[i] * x[i];
    length = sqrt(length);
    normal = (x[0] + mu * length) / (1.0 + mu * mu);
    for (int32_t i = 0; i < dim; i++) {
        double e = r[i];

        if (x[0] > 0.0 && length <= mu * x[0])
            e = d[i];
        else if (normal > 0.0)
            e = i == 0 ? r[0] - normal : r[i] - mu * normal * (x[i] / length);
        sum += e * e;
    }
    return sum;
}

static double constraint_map(const perp__sweep_work *work, int32_t k, const double *r,
                             const double *u)
{
    const perp__contact_problem *problem = work->common.problem;
    const double t = problem->trace[k];
    const int32_t dim = work->local[k].dim, rows = work->rows[k + 1] - work->rows[k];
    double sum, d[PERP__ROWS_MOST];
    int32_t row = dim;

    if (k >= problem->contacts)
        return fabs(u[0]) / t;
    if (dim == 1)
        return fabs(fmin(r[0], u[0] / t));
    if (rows == dim)
        return sqrt(cone_map(dim, problem->mu[k], t, r, u));
    for (int32_t i = 0; i < rows; i++)
        d[i] = u[i] / t;
    sum = fmin(r[0], d[0]) * fmin(r[0], d[0]);
    sum += disc_map(dim - 1, problem->mu[k] * r[0], r + 1, d + 1);
    if (problem->rolling && problem->rolling[k] > 0.0) {
        sum += disc_map(dim - 1, problem->rolling[k] * r[0], r + row, d + row);
        row += dim - 1;
    }
    if (problem->spinning && problem->spinning[k] > 0.0)
        sum += disc_map(1, problem->spinning[k] * r[0], r + row, d + row);
    return sqrt(sum);
}

double perp__sweep_residual(perp__sweep_work *work, const double *x, double *u)
{
    const perp__contact_problem *problem = work->common.problem;
    double residual = 0.0;
    int32_t mode;

    if (problem->bodies)
        perp__bodies_multiply(problem->bodies, x, problem->q, u);
    else
        for (int32_t i = 0; i < work->size; i++)
            u[i] = perp__sweep_row(work, i, x);
    for (int32_t k = 0; k < work->constraints; k++) {
        const double map = k < problem->contacts && perp__contact_two_sided(problem, k) > 0
                               ? perp__contact_natural(problem, k, x, u, &mode)
                               : constraint_map(work, k, x + work->rows[k], u + work->rows[k]);
        const double part = work->weights[k] * map;

        if (!(part <= residual) && !isnan(residual)) /* NaN stays */
            residual = part;
    }
    return residual;
}
