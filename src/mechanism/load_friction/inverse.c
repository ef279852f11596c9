/* Inverse dynamics: tau = A x + b + f is a formula; whether tau in turn gives x is the question. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/load_friction/load_friction.h"

static double sign(double x)
{
    return (double)((x > 0.0) - (x < 0.0));
}

/* The torque to f->tau; returns the number of coordinates that rest with friction in reserve. */
static int32_t find_torque(perp_load_friction *f, const double *velocity, const double *x)
{
    int32_t undetermined = 0, i;

    perp__multiply_doubled(&f->A_view, x, f->b, f->product, f->product_low);
    perp__multiply_doubled(&f->C_view, x, f->d, f->normal, f->normal_low);
    for (i = 0; i < f->n; i++) {
        const double s = velocity[i] != 0.0 ? sign(velocity[i]) : sign(x[i]);
        const double normal = fabs(f->normal[i] + f->normal_low[i]);

        undetermined += s == 0.0 && f->mu_static[i] * normal > 0.0;
        f->tau[i] = f->product[i] + (f->product_low[i] + f->mu[i] * s * normal);
    }
    return undetermined;
}

/* The answer nearest to x. */
static const perp__answer *nearest(const perp_load_friction *f, const double *x)
{
    const perp__answer *a, *best = NULL;
    double least = INFINITY;

    for (a = f->answers.first; a; a = a->next) {
        double distance = 0.0;

        for (int32_t i = 0; i < f->n; i++)
            distance = fmax(distance, fabs(a->middle[i] - x[i]) / f->size[i]);
        if (distance < least) {
            least = distance;
            best = a;
        }
    }
    return best;
}

static int32_t find_reason(const perp_load_inverse *own, int32_t families)
{
    return families > 0             ? PERP_LOAD_IN_FAMILY
           : own->flutter           ? PERP_LOAD_FLUTTERS
           : !own->stable           ? PERP_LOAD_UNSTABLE
           : own->accelerations > 1 ? PERP_LOAD_SEVERAL
           : own->undetermined > 0  ? PERP_LOAD_AT_REST
           : !own->exhaustive       ? PERP_LOAD_NOT_ENUMERATED
                                    : PERP_LOAD_WELL_POSED;
}

static perp_status examine(perp_load_friction *f, perp_load_inverse *own, const double *velocity,
                           const double *x)
{
    const perp__answer *wanted;
    perp_load_uniqueness unique;
    perp_load_summary summary;
    const perp_status status = perp__friction_solve(f, &summary, f->tau, velocity);

    if (status != PERP_OK)
        return status;
    wanted = nearest(f, x);
    own->accelerations = summary.count;
    own->exhaustive = summary.exhaustive;
    own->stable = wanted && wanted->stable;
    own->flutter = wanted && wanted->flutter;
    if (!own->exhaustive) {
        perp__friction_decide(f, &unique, velocity);
        own->exhaustive = unique.verdict == PERP_LOAD_UNIQUE;
    }
    own->reason = find_reason(own, summary.families);
    own->well_posed = own->reason == PERP_LOAD_WELL_POSED;
    return PERP_OK;
}

static perp_status invert(perp_load_friction *f, double *tau, perp_load_inverse *inverse,
                          const double *velocity, const double *acceleration)
{
    perp_load_inverse own = {0};
    perp_status status = perp__check_pointer(f->context, "tau", tau);

    if (status == PERP_OK && inverse)
        status = PERP__CHECK(perp_load_inverse, f->context, inverse);
    PERP__THEN(status, perp__check_vector(f->context, "velocity", velocity, (size_t)f->n));
    PERP__THEN(status, perp__check_vector(f->context, "acceleration", acceleration, (size_t)f->n));
    if (status != PERP_OK)
        return status;
    own.undetermined = find_torque(f, velocity, acceleration);
    status = perp__check_finite(f->context, "tau", f->tau, (size_t)f->n);
    if (status == PERP_OK && inverse)
        status = examine(f, &own, velocity, acceleration);
    if (status != PERP_OK)
        return status;
    if (inverse)
        perp__struct_write(inverse, &own, sizeof own);
    memcpy(tau, f->tau, (size_t)f->n * sizeof *tau);
    return PERP_OK;
}

perp_status perp_load_friction_inverse(perp_load_friction *friction, double *tau,
                                       perp_load_inverse *inverse, const double *velocity,
                                       const double *acceleration)
{
    return PERP__CALL(perp__friction_enter(friction), friction->context,
                      invert(friction, tau, inverse, velocity, acceleration));
}
