/* Inverse dynamics: tau = A x + b + f is a formula; whether tau in turn gives x is the question. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "mechanism/load_friction/load_friction.h"

/* What the torque may do beside x: the answer nearest to x, and those that there are. */
static perp_status examine(perp_load_friction *f, perp_load_inverse *own, const double *velocity,
                           const double *x)
{
    const perp__answer *a, *wanted = NULL;
    double least = INFINITY;
    perp_load_uniqueness unique;
    perp_load_summary summary;
    const perp_status status = perp__friction_solve(f, &summary, f->tau, velocity);

    if (status != PERP_OK)
        return status;
    for (a = f->answers.first; a; a = a->next) {
        double distance = 0.0;

        for (int32_t i = 0; i < f->n; i++)
            distance = fmax(distance, fabs(a->middle[i] - x[i]) / f->size[i]);
        wanted = distance < least ? a : wanted;
        least = fmin(least, distance);
    }
    own->accelerations = summary.count;
    own->exhaustive = summary.exhaustive;
    own->stable = wanted && wanted->stable;
    own->flutter = wanted && wanted->flutter;
    if (!own->exhaustive) {
        perp__friction_decide(f, &unique, velocity);
        own->exhaustive = unique.verdict == PERP_LOAD_UNIQUE;
    }
    own->reason = summary.families > 0     ? PERP_LOAD_IN_FAMILY
                  : own->flutter           ? PERP_LOAD_FLUTTERS
                  : !own->stable           ? PERP_LOAD_UNSTABLE
                  : own->accelerations > 1 ? PERP_LOAD_SEVERAL
                  : own->undetermined > 0  ? PERP_LOAD_AT_REST
                  : !own->exhaustive       ? PERP_LOAD_NOT_ENUMERATED
                                           : PERP_LOAD_WELL_POSED;
    own->well_posed = own->reason == PERP_LOAD_WELL_POSED;
    return PERP_OK;
}

perp_status perp_load_friction_inverse(perp_load_friction *friction, double *tau,
                                       perp_load_inverse *inverse, const double *velocity,
                                       const double *acceleration)
{
    perp_load_friction *f = friction;
    perp_load_inverse own = {0};
    perp_status status = perp__friction_enter(f);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(f->context, "tau", tau);
    if (inverse)
        PERP__THEN(status, PERP__CHECK(perp_load_inverse, f->context, inverse));
    PERP__THEN(status, perp__check_vector(f->context, "velocity", velocity, (size_t)f->n));
    PERP__THEN(status, perp__check_vector(f->context, "acceleration", acceleration, (size_t)f->n));
    if (status == PERP_OK) {
        perp__multiply_doubled(&f->A_view, acceleration, f->b, f->product, f->product_low);
        perp__multiply_doubled(&f->C_view, acceleration, f->d, f->normal, f->normal_low);
        for (int32_t i = 0; i < f->n; i++) {
            const double moves = velocity[i] != 0.0 ? velocity[i] : acceleration[i];
            const double s = (double)((moves > 0.0) - (moves < 0.0));
            const double normal = fabs(f->normal[i] + f->normal_low[i]);

            own.undetermined += s == 0.0 && f->mu_static[i] * normal > 0.0; /* at rest */
            f->tau[i] = f->product[i] + (f->product_low[i] + f->mu[i] * s * normal);
        }
    }
    PERP__THEN(status, perp__check_finite(f->context, "tau", f->tau, (size_t)f->n));
    if (inverse)
        PERP__THEN(status, examine(f, &own, velocity, acceleration));
    if (status == PERP_OK && inverse)
        perp__struct_write(inverse, &own, sizeof own);
    if (status == PERP_OK)
        memcpy(tau, f->tau, (size_t)f->n * sizeof *tau);
    return perp__leave(f->context, status);
}
