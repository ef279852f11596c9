/* Whether every torque has one acceleration. With y = N, G = C A^-1 diag(mu) and D = diag(+-1) the
 * system is y + G|y| = r up to the directions of motion, which only permute the D: a piecewise
 * linear map, one-to-one and onto if and only if det(I + G D) > 0 for all D (Rump 1997,
 * theorem 2.3: the sign-real spectral radius of G, the largest |real eigenvalue| of any G D, is
 * below 1). */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "base/random.h"
#include "linalg/blas.h"
#include "mechanism/eigenvalues.h"
#include "mechanism/load_friction/load_friction.h"

enum { LARGEST_EXACT = 12, TRIES = 16 };

/* Imaginary parts that a double real eigenvalue gets from rounding. */
static const double as_good_as_real = 1e-7;

/* to := G D + unit I, D_jj = -1 where f->pattern.side says so. */
static void load_signed(const perp_load_friction *f, double *to, double unit)
{
    const size_t n = (size_t)f->n;

    for (size_t j = 0; j < n; j++) {
        for (size_t i = 0; i < n; i++)
            to[i + n * j] = copysign(1.0, f->pattern.side[j]) * f->linear.system.K[i + n * j];
        to[j + n * j] += unit;
    }
}

/* The sign is right where the product of the pivots is beyond the range of doubles: +-inf, or the
 * smallest number. */
static double determinant(perp_load_friction *f)
{
    const size_t n = (size_t)f->n;
    double product = 1.0, value;
    int exponent, total = 0;

    load_signed(f, f->work, 1.0);
    perp__lu_factor(f->n, f->work, f->n, f->linear.first);
    for (size_t i = 0; i < n; i++) {
        product *= f->linear.first[i] == (int32_t)i + 1 ? f->work[i + n * i] : -f->work[i + n * i];
        product = frexp(product, &exponent);
        total += isfinite(product) && product != 0.0 ? exponent : 0;
    }
    value = ldexp(product, total);
    return value == 0.0 && product != 0.0 ? nextafter(0.0, product) : value;
}

/* All D: the smallest determinant, and the largest real eigenvalue of any G D; a bound of it by
 * norms where an eigenvalue is not known. */
static void enumerate(perp_load_friction *f, perp_load_uniqueness *u)
{
    const size_t n = (size_t)f->n;
    double *real = f->work + n * n, *imaginary = real + n, largest = 0.0;
    int32_t settled = 1;

    u->determinant = INFINITY;
    for (uint32_t signs = 0; signs < 1u << n; signs++) {
        double value;

        for (size_t i = 0; i < n; i++)
            f->pattern.side[i] = (signs >> i) & 1u ? -1 : 1;
        value = determinant(f);
        settled &= !isnan(value);
        u->determinant = fmin(u->determinant, value);
        if (signs >= 1u << (n - 1))
            continue; /* G (-D) has the eigenvalues of G D with the other sign */
        load_signed(f, f->work, 0.0);
        settled &= perp__eigenvalues(f->n, f->work, real, imaginary) == 0;
        for (size_t i = 0; i < n && settled; i++)
            if (fabs(imaginary[i]) <= as_good_as_real * fabs(real[i]))
                largest = fmax(largest, fabs(real[i]));
    }
    if (!settled)
        largest = fmin(u->norm, u->radius);
    u->exact = settled;
    u->margin = largest > 0.0 ? 1.0 / largest : INFINITY;
    u->verdict = u->determinant <= 0.0 ? PERP_LOAD_NOT_UNIQUE
                 : u->margin > 1.0     ? PERP_LOAD_UNIQUE
                                       : PERP_LOAD_UNDECIDED;
    if (!settled)
        u->determinant = NAN;
}

/* An upper bound of the spectral radius of |G|: the Collatz-Wielandt quotient of a positive vector
 * that power steps of |G| + shift I improve. */
static double find_radius(perp_load_friction *f)
{
    const size_t n = (size_t)f->n;
    double *x = f->linear.x, *y = f->origin, bound = INFINITY;

    for (size_t i = 0; i < n; i++)
        x[i] = 1.0;
    for (int32_t round = 0; round < 200; round++) {
        double quotient = 0.0, top = 0.0;

        memset(y, 0, n * sizeof *y);
        for (size_t j = 0; j < n; j++)
            for (size_t i = 0; i < n; i++)
                y[i] += fabs(f->linear.system.K[i + n * j]) * x[j];
        for (size_t i = 0; i < n; i++)
            quotient = fmax(quotient, y[i] / x[i]);
        bound = fmin(bound, quotient);
        for (size_t i = 0; i < n; i++) {
            y[i] += 0.1 * bound * x[i];
            top = fmax(top, y[i]);
        }
        if (!(top > 0.0))
            return 0.0;
        for (size_t i = 0; i < n; i++)
            x[i] = fmax(y[i] / top, 1e-9);
    }
    return bound;
}

/* velocity may be NULL. */
static void decide(perp_load_friction *f, perp_load_uniqueness *u, const double *velocity)
{
    const size_t n = (size_t)f->n;
    bool rests = 0, jump = 0;
    uint64_t seed = 1;
    double *real = f->work + n * n, largest = 0.0, smaller;

    memset(u, 0, sizeof *u);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            f->linear.system.K[i + n * j] = f->X[j + n * i] * f->mu[j]; /* G = X' diag(mu) */
    if (!perp__all_finite(f->linear.system.K, n * n)) {
        u->norm = u->radius = INFINITY;
        u->determinant = NAN;
        u->verdict = PERP_LOAD_UNDECIDED;
        return;
    }
    /* ||G||_2 from above, to 1e-12: the largest eigenvalue of G'G */
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            f->work[j + n * i] = -f->linear.system.K[i + n * j];
    memset(f->linear.null, 0, n * n * sizeof *f->linear.null);
    perp__gemm_subtract(f->n, f->n, f->n, f->work, f->n, f->linear.system.K, f->n, f->linear.null,
                        f->n);
    if (perp__eigenvalues(f->n, f->linear.null, real, real + n) != 0)
        largest = INFINITY;
    for (size_t i = 0; i < n && largest < INFINITY; i++)
        largest = fmax(largest, real[i]);
    u->norm = sqrt(largest) * (1.0 + 1e-12);
    u->radius = find_radius(f);
    smaller = fmin(u->norm, u->radius);
    u->determinant = NAN;
    u->margin = smaller > 0.0 ? 1.0 / smaller : INFINITY;
    u->verdict = smaller < 1.0 ? PERP_LOAD_UNIQUE : PERP_LOAD_UNDECIDED;
    if (f->n <= LARGEST_EXACT)
        enumerate(f, u);
    else /* norms, and a few determinants for a proof of the contrary */
        for (int32_t k = 0; k < TRIES && u->verdict == PERP_LOAD_UNDECIDED; k++) {
            for (int32_t i = 0; i < f->n; i++)
                f->pattern.side[i] = (int8_t)(k < 2                            ? 1 - 2 * k
                                              : perp__next_random(&seed) >> 63 ? 1
                                                                               : -1);
            if (determinant(f) <= 0.0)
                u->verdict = PERP_LOAD_NOT_UNIQUE;
        }
    for (int32_t i = 0; i < f->n && velocity; i++) {
        rests |= velocity[i] == 0.0;
        jump |= velocity[i] == 0.0 && f->mu_static[i] > f->mu[i];
    }
    if (rests && f->n > 1)
        u->verdict = !jump && f->monotone ? PERP_LOAD_UNIQUE : PERP_LOAD_UNDECIDED;
    else if (jump && f->d[0] != 0.0)
        u->verdict = PERP_LOAD_NOT_UNIQUE;
}

perp_status perp_load_friction_uniqueness(perp_load_friction *friction,
                                          perp_load_uniqueness *uniqueness, const double *velocity)
{
    perp_status status = perp__friction_enter(friction);
    perp_load_uniqueness copy;

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_load_uniqueness, friction->context, uniqueness);
    if (status == PERP_OK && velocity)
        status = perp__check_vector(friction->context, "velocity", velocity, (size_t)friction->n);
    if (status == PERP_OK) {
        decide(friction, &copy, velocity);
        perp__struct_write(uniqueness, &copy, sizeof copy);
    }
    return perp__leave(friction->context, status);
}

/* ---- inverse dynamics ----------------------------------------------------------------------
 *
 * tau = A x + b + f is a formula; whether tau in turn gives x is the question. */

/* What the torque may do beside x: the answer nearest to x, and those that there are. */
static perp_status examine(perp_load_friction *f, perp_load_inverse *copy, const double *velocity,
                           const double *x)
{
    const perp__answer *a, *wanted = NULL;
    double least = INFINITY;
    perp_load_uniqueness unique;
    perp_load_summary summary;
    const perp_status status = perp__friction_solve(f, &summary, velocity);

    if (status != PERP_OK)
        return status;
    for (a = f->answers.first; a; a = a->next) {
        double distance = 0.0;

        for (int32_t i = 0; i < f->n; i++)
            distance = fmax(distance, fabs(a->middle[i] - x[i]) / f->size[i]);
        wanted = distance < least ? a : wanted;
        least = fmin(least, distance);
    }
    copy->accelerations = summary.count;
    copy->exhaustive = summary.exhaustive;
    copy->stable = wanted && wanted->stable;
    copy->flutter = wanted && wanted->flutter;
    if (!copy->exhaustive) {
        decide(f, &unique, velocity);
        copy->exhaustive = unique.verdict == PERP_LOAD_UNIQUE;
    }
    copy->reason = summary.families > 0      ? PERP_LOAD_IN_FAMILY
                   : copy->flutter           ? PERP_LOAD_FLUTTERS
                   : !copy->stable           ? PERP_LOAD_UNSTABLE
                   : copy->accelerations > 1 ? PERP_LOAD_SEVERAL
                   : copy->undetermined > 0  ? PERP_LOAD_AT_REST
                   : !copy->exhaustive       ? PERP_LOAD_NOT_ENUMERATED
                                             : PERP_LOAD_WELL_POSED;
    copy->well_posed = copy->reason == PERP_LOAD_WELL_POSED;
    return PERP_OK;
}

perp_status perp_load_friction_inverse(perp_load_friction *friction, double *tau,
                                       perp_load_inverse *inverse, const double *velocity,
                                       const double *acceleration)
{
    perp_load_friction *f = friction;
    perp_load_inverse copy = {0};
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

            copy.undetermined += s == 0.0 && f->mu_static[i] * normal > 0.0; /* at rest */
            f->tau[i] = f->product[i] + (f->product_low[i] + f->mu[i] * s * normal);
        }
    }
    PERP__THEN(status, perp__check_finite(f->context, "tau", f->tau, (size_t)f->n));
    if (inverse)
        PERP__THEN(status, examine(f, &copy, velocity, acceleration));
    if (status == PERP_OK && inverse)
        perp__struct_write(inverse, &copy, sizeof copy);
    if (status == PERP_OK)
        memcpy(tau, f->tau, (size_t)f->n * sizeof *tau);
    return perp__leave(f->context, status);
}
