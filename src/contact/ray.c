/* Proofs that there are no velocities that keep all contacts apart.
 *
 * Farkas: either some v has H_n v + w_n >= 0 and G v + b = 0, or some y_n >= 0 and s have
 * H_n'y_n + G's = 0 and y_n'w_n + s'b < 0. In terms of W: u_n >= 0 is impossible for u = W r + q if
 * y'W = 0 and y'q < 0. Here such a y is checked; ray_search.c finds it. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/rigid/rigid.h"

/* Of |W| |y|: what rounding leaves of a sum that is 0. */
#define NOTHING (64.0 * DBL_EPSILON)

static int32_t has_certificate_form(const perp_contact_solver *solver, const double *y)
{
    for (int32_t k = 0; k < solver->contacts; k++) {
        const int32_t normals = perp__contact_normals(&solver->problem, k);

        if (solver->two_sided[k] == 0 && !(y[solver->starts[k]] >= 0.0))
            return 0;
        for (int32_t i = solver->starts[k] + normals; i < solver->starts[k + 1]; i++)
            if (y[i] != 0.0)
                return 0;
    }
    return 1;
}

/* True if A'y is 0 to rounding. high, low, absolute: columns of A. */
static int32_t annihilates(const perp__matrix *A, const double *y, double *high, double *low,
                           double *absolute)
{
    perp__transposed_doubled(A, y, NULL, high, low);
    for (int32_t j = 0; j < A->columns; j++) {
        double sum = 0.0;

        if (A->column_starts)
            for (int32_t k = A->column_starts[j]; k < A->column_starts[j + 1]; k++)
                sum += fabs(A->values[k] * y[A->row_indices[k]]);
        else
            for (int32_t k = 0; k < A->rows; k++)
                sum += fabs(A->values[(size_t)k * A->row_stride + (size_t)j * A->column_stride] *
                            y[k]);
        absolute[j] += sum;
        if (!(fabs(high[j]) <= NOTHING * absolute[j]))
            return 0;
    }
    return 1;
}

/* H'y + G's = 0 in the caller's H and G, through the dynamics' own buffers. */
static int32_t annihilates_dynamics(perp_contact_solver *solver, const double *y)
{
    perp__dynamics *d = &solver->dynamics;
    double *absolute = solver->v;

    perp__transposed_doubled(&d->H, y, NULL, d->high, d->low);
    if (d->G.rows > 0) {
        perp__transposed_doubled(&d->G, y + d->H.rows, d->high, d->more_high, d->more_low);
        for (int32_t j = 0; j < d->n; j++)
            d->high[j] = d->more_high[j] + (d->low[j] + d->more_low[j]);
    }
    for (int32_t j = 0; j < d->n; j++)
        absolute[j] = 0.0;
    for (int32_t i = 0; i < 2; i++) {
        const perp__matrix *A = i ? &d->G : &d->H;
        const double *x = i ? y + d->H.rows : y;

        for (int32_t j = 0; j < A->columns; j++)
            if (A->column_starts)
                for (int32_t k = A->column_starts[j]; k < A->column_starts[j + 1]; k++)
                    absolute[j] += fabs(A->values[k] * x[A->row_indices[k]]);
            else
                for (int32_t k = 0; k < A->rows; k++)
                    absolute[j] += fabs(
                        A->values[(size_t)k * A->row_stride + (size_t)j * A->column_stride] * x[k]);
    }
    for (int32_t j = 0; j < d->n; j++)
        if (!(fabs(d->high[j]) <= NOTHING * absolute[j]))
            return 0;
    return 1;
}

/* P'y = 0: H'y in the bodies' own coordinates. */
static int32_t annihilates_bodies(perp_contact_solver *solver, const double *y)
{
    const perp__bodies *b = &solver->bodies;
    double *absolute = solver->push;

    for (int32_t i = 0; i < solver->size; i++)
        solver->low[i] = 0.0;
    perp__absolute_bodies(b, y, solver->low, absolute, solver->high);
    perp__bodies_gather(b, y, b->y);
    for (int32_t i = 0; i < solver->n; i++)
        if (!(fabs(b->y[i]) <= NOTHING * absolute[i]))
            return 0;
    return 1;
}

/* What row i of y is paired with: what the caller gave, or H M^-1 f + w; since H'y = 0 the load f
 * is of no account. bias: rigid bodies'. */
static double given_of(const perp_contact_solver *solver, const double *bias, int32_t i)
{
    const perp__contact_call *call = solver->call;

    if (solver->entrance == PERP__ENTRANCE_RIGID)
        return bias[i];
    if (solver->entrance == PERP__ENTRANCE_DELASSUS)
        return call->q[i];
    if (i < solver->rows)
        return call->w[i];
    return call->b ? call->b[i - solver->rows] : 0.0;
}

/* y'q < 0 by more than rounding. */
static int32_t is_against(perp_contact_solver *solver, const double *y)
{
    double sum = 0.0, error = 0.0, absolute = 0.0;

    if (solver->entrance == PERP__ENTRANCE_RIGID)
        perp__rigid_bias(solver, solver->scale);
    for (int32_t i = 0; i < solver->size; i++) {
        const double given = given_of(solver, solver->scale, i);
        const double product = y[i] * given, next = sum + product, part = next - sum;

        error += fma(y[i], given, -product) + ((sum - (next - part)) + (product - part));
        absolute += fabs(product);
        sum = next;
    }
    return sum + error < -NOTHING * absolute;
}

int32_t perp__contact_may_be_infeasible(perp_contact_solver *solver)
{
    int32_t may = 0;

    if (solver->entrance == PERP__ENTRANCE_RIGID)
        perp__rigid_bias(solver, solver->scale);
    for (int32_t k = 0; k < solver->contacts; k++)
        for (int32_t i = 0; i < perp__contact_normals(&solver->problem, k); i++) {
            const double given = given_of(solver, solver->scale, solver->starts[k] + i);

            may |= given < 0.0 || (solver->two_sided[k] > 0 && given > 0.0);
        }
    for (int32_t i = solver->rows; i < solver->size; i++)
        may |= given_of(solver, solver->scale, i) != 0.0;
    return may;
}

void perp__contact_keep_ray(perp_contact_solver *solver, const double *direction)
{
    double largest = 0.0;
    int32_t proves;

    if (solver->certificate != PERP_CONTACT_CERTIFICATE_NONE)
        return;
    for (int32_t i = 0; i < solver->size; i++)
        largest = fmax(largest, fabs(direction[i]));
    if (!(largest > 0.0) || !isfinite(largest))
        return;
    for (int32_t i = 0; i < solver->size; i++)
        solver->ray[i] = direction[i] / largest;
    solver->has_ray = 1;
    if (!has_certificate_form(solver, solver->ray) || !is_against(solver, solver->ray))
        return;
    if (solver->complies) /* a soft row gives way: W y = 0 must hold with it */
        for (int32_t i = 0; i < solver->size; i++)
            if (solver->compliance[i] > 0.0 && solver->ray[i] != 0.0)
                return;
    if (solver->entrance == PERP__ENTRANCE_RIGID) {
        proves = annihilates_bodies(solver, solver->ray);
    } else if (solver->entrance == PERP__ENTRANCE_DYNAMICS) {
        proves = annihilates_dynamics(solver, solver->ray);
    } else {
        memset(solver->scale, 0, (size_t)solver->size * sizeof(double));
        proves = annihilates(&solver->W, solver->ray, solver->high, solver->low, solver->scale);
    }
    if (proves)
        solver->certificate = PERP_CONTACT_CERTIFICATE_INFEASIBLE;
}
