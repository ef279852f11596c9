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
#include "linalg/doubled.h"

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

/* absolute += |A'| |y| */
static void add_absolute(const perp__matrix *A, const double *y, double *absolute)
{
    perp__cursor c = perp__first(A);

    while (A->rows > 0 && perp__advance(&c))
        absolute[c.j] += fabs(c.value * y[c.i]);
}

/* W'y = 0, or H'y + G's = 0 in the caller's H and G, to rounding. */
static int32_t annihilates(perp_contact_solver *solver, const double *y)
{
    perp__dynamics *d = &solver->dynamics;
    const int32_t by_W = solver->entrance == PERP__ENTRANCE_DELASSUS;
    const double *high = by_W ? solver->high : d->high, *low = by_W ? solver->low : d->low;
    const int32_t n = by_W ? solver->size : d->n;
    double *absolute = by_W ? solver->scale : solver->v;

    memset(absolute, 0, (size_t)n * sizeof *absolute);
    if (by_W) {
        perp__transposed_doubled(&solver->W, y, NULL, solver->high, solver->low);
        add_absolute(&solver->W, y, absolute);
    } else {
        perp__dynamics_push(d, NULL, y);
        add_absolute(&d->H, y, absolute);
        add_absolute(&d->G, y + d->H.rows, absolute);
    }
    for (int32_t j = 0; j < n; j++)
        if (!(fabs(high[j] + low[j]) <= NOTHING * absolute[j]))
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

        perp__accumulate(&sum, &error, y[i], given);
        absolute += fabs(y[i] * given);
    }
    return sum + error < -NOTHING * absolute;
}

int32_t perp__contact_may_be_infeasible(perp_contact_solver *solver)
{
    int32_t may = 0;

    if (solver->entrance == PERP__ENTRANCE_RIGID)
        perp__rigid_bias(solver, solver->scale);
    for (int32_t k = 0; k < solver->contacts; k++)
        for (int32_t i = perp__contact_first_row(&solver->problem, k) - solver->starts[k];
             i < perp__contact_normals(&solver->problem, k); i++) { /* what yields is in no way */
            const double given = given_of(solver, solver->scale, solver->starts[k] + i);

            may |= given < 0.0 || (solver->two_sided[k] > 0 && given > 0.0);
        }
    for (int32_t i = solver->rows; i < solver->size; i++)
        may |= given_of(solver, solver->scale, i) != 0.0;
    return may;
}

void perp__contact_keep_ray(perp_contact_solver *solver, const double *direction)
{
    const double largest = perp__largest(direction, solver->size);
    int32_t proves;

    if (solver->certificate != PERP_CONTACT_CERTIFICATE_NONE || !(largest > 0.0) ||
        !isfinite(largest))
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
    proves = solver->entrance == PERP__ENTRANCE_RIGID ? annihilates_bodies(solver, solver->ray)
                                                      : annihilates(solver, solver->ray);
    if (proves)
        solver->certificate = PERP_CONTACT_CERTIFICATE_INFEASIBLE;
}
