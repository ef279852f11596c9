/* Stribeck's and LuGre's friction.
 *
 * At constant v, with x = stiffness |v| h / g, z' = v - (x / h) z has the solution
 *
 *   z(h) = z + (v h - z x) phi(x),   mean z = z + (v h - z x) psi(x),
 *   phi(x) = (1 - exp(-x)) / x,  psi(x) = (1 - phi(x)) / x,  chi(x) = (1/2 - psi(x)) / x,
 *
 * and phi' = psi - phi, psi' = 2 chi - psi. For large x, v h - z x = (g sgn(v) / stiffness - z) x
 * is written so that nothing overflows. */
#include <perp/bristle.h>

#include <math.h>

#include "base/check.h"
#include "base/context.h"

typedef struct curve {
    double force; /* g(v) */
    double slope; /* dg / d|v| */
} curve;

/* ---- checks -------------------------------------------------------------------------------- */

/* The last two are those of bristles. */
static const perp__field fields[] = {
    PERP__REAL(perp_bristle, kinetic, "()", 0, INFINITY),
    PERP__REAL(perp_bristle, breakaway, "[)", 0, INFINITY),
    PERP__REAL(perp_bristle, speed, "[)", 0, INFINITY),
    PERP__REAL(perp_bristle, viscosity, "[)", 0, INFINITY),
    PERP__REAL(perp_bristle, stiffness, "()", 0, INFINITY),
    PERP__REAL(perp_bristle, damping, "[)", 0, INFINITY),
};

static perp_status check_number(perp_context *context, const char *name, double value)
{
    if (isfinite(value))
        return PERP_OK;
    return perp__fail(context, PERP_ERROR_NOT_FINITE, "%s is %g", name, value);
}

/* Enters, and reads the law into *copy where all is well. out: an output of that name. */
static perp_status begin(perp_context *context, perp_bristle *copy, const perp_bristle *law,
                         int bristles, const char *name, const void *out)
{
    perp_status status = context ? perp__enter(context) : PERP_OK;

    if (status != PERP_OK)
        return status;
    perp_struct_init(copy, sizeof *copy);
    status = perp__check_pointer(context, name, out);
    PERP__THEN(status, perp__check_pointer(context, "law", law));
    PERP__THEN(status, PERP__READ(perp_bristle, context, copy, law));
    PERP__THEN(status, perp__check_fields(context, "law", copy, fields, bristles ? 6 : 4));
    if (copy->breakaway == 0.0)
        copy->breakaway = copy->kinetic;
    if (status == PERP_OK && copy->breakaway < copy->kinetic)
        status = perp__refuse(context, "law.breakaway is %g, below law.kinetic = %g",
                              copy->breakaway, copy->kinetic);
    if (status == PERP_OK && copy->breakaway > copy->kinetic && copy->speed == 0.0)
        status = perp__refuse(context, "law.speed is 0, and law.breakaway above law.kinetic");
    return status == PERP_OK || !context ? status : perp__leave(context, status);
}

/* Writes what is a number, all of it or nothing, and leaves. */
typedef struct result {
    const char *name;
    double *to; /* NULL: not wanted */
    double value;
    int needed; /* a number in any case */
} result;

static perp_status end(perp_context *context, perp_status status, const result *results, int count)
{
    for (int k = 0; k < count && status == PERP_OK; k++)
        if (results[k].to || results[k].needed)
            status = check_number(context, results[k].name, results[k].value);
    for (int k = 0; k < count && status == PERP_OK; k++)
        if (results[k].to)
            *results[k].to = results[k].value;
    return context ? perp__leave(context, status) : status;
}

/* ---- the laws ------------------------------------------------------------------------------ */

static curve stribeck(const perp_bristle *law, double v)
{
    curve g = {law->kinetic, 0.0};

    if (law->breakaway > law->kinetic) {
        const double ratio = fabs(v) / law->speed, bell = exp(-ratio * ratio);
        const double more = (law->breakaway - law->kinetic) * bell;

        g.force += more;
        if (bell > 0.0) /* else ratio may be infinite */
            g.slope = -2.0 * more * ratio / law->speed;
    }
    return g;
}

/* a b c / d, where only the result may be out of range. */
static double ratio_of(double a, double b, double c, double d)
{
    int i, j, k, l;
    const double mantissa = frexp(a, &i) * frexp(b, &j) * frexp(c, &k) / frexp(d, &l);

    return ldexp(mantissa, i + j + k - l);
}

/* One step: where z ends, how far that is, its mean, and the derivatives by v. */
typedef struct stretch {
    double end, change, mean, end_slope, mean_slope;
} stretch;

/* x <= 1: by chi's series, sum over k of (-x)^k / (k + 3)!. */
static stretch short_stretch(const perp_bristle *law, curve g, double x, double z, double v,
                             double h)
{
    const double sense = (v > 0.0) - (v < 0.0);
    const double x_slope =
        sense * ratio_of(law->stiffness, h, 1.0 - fabs(v) * g.slope / g.force, g.force);
    const double distance = v * h - z * x, distance_slope = h - z * x_slope;
    double term = 1.0 / 6, chi = 0.0, phi, psi;
    stretch s;

    for (int k = 4; k < 24; k++) { /* 1/23! < 1e-22 */
        chi += term;
        term *= -x / k;
    }
    psi = 0.5 - x * chi;
    phi = 1.0 - x * psi;
    s.change = distance * phi;
    s.end = z + s.change;
    s.mean = z + distance * psi;
    s.end_slope = distance_slope * phi + distance * (psi - phi) * x_slope;
    s.mean_slope = distance_slope * psi + distance * (2.0 * chi - psi) * x_slope;
    return s;
}

/* x > 1, maybe infinite: relative to the bend of steady sliding; x phi' = exp(-x) - phi. */
static stretch long_stretch(const perp_bristle *law, curve g, double x, double z, double v)
{
    const double rest = exp(-x);
    const double phi = -expm1(-x) / x, sense = v > 0.0 ? 1.0 : -1.0;
    const double steady = sense * g.force / law->stiffness, steady_slope = g.slope / law->stiffness;
    const double growth = (1.0 - fabs(v) * g.slope / g.force) / v; /* x' / x */
    stretch s;

    s.change = (steady - z) * -expm1(-x);
    s.end = steady + (z - steady) * rest;
    s.mean = steady + (z - steady) * phi;
    s.end_slope =
        steady_slope * (1.0 - rest) - (rest > 0.0 ? (z - steady) * rest * x * growth : 0.0);
    s.mean_slope = steady_slope * (1.0 - phi) + (z - steady) * (rest - phi) * growth;
    return s;
}

/* ---- the calls ----------------------------------------------------------------------------- */

perp_status perp_stribeck_force(perp_context *context, double *force, double *slope,
                                const perp_bristle *law, double v)
{
    result results[] = {{"force", force, 0.0, 1}, {"slope", slope, 0.0, 0}};
    perp_bristle copy;
    perp_status status = begin(context, &copy, law, 0, "force", force);

    if (status != PERP_OK)
        return status;
    status = check_number(context, "v", v);
    if (status == PERP_OK) {
        const curve g = stribeck(&copy, v);

        results[0].value = (v > 0.0 ? g.force : v < 0.0 ? -g.force : 0.0) + copy.viscosity * v;
        results[1].value = g.slope + copy.viscosity;
    }
    return end(context, status, results, 2);
}

perp_status perp_lugre_force(perp_context *context, double *force, double *rate,
                             const perp_bristle *law, double z, double v)
{
    result results[] = {{"rate", rate, 0.0, 1}, {"force", force, 0.0, 1}};
    perp_bristle copy;
    perp_status status = begin(context, &copy, law, 1, "force", force);

    if (status != PERP_OK)
        return status;
    status = check_number(context, "z", z);
    PERP__THEN(status, check_number(context, "v", v));
    if (status == PERP_OK) {
        const double bend = v - ratio_of(copy.stiffness, fabs(v), z, stribeck(&copy, v).force);

        results[0].value = bend;
        results[1].value = copy.stiffness * z + copy.damping * bend + copy.viscosity * v;
    }
    return end(context, status, results, 2);
}

perp_status perp_lugre_step(perp_context *context, double *next, double *force, double *slope,
                            const perp_bristle *law, double z, double v, double h)
{
    result results[] = {{"next", next, 0.0, 1}, {"force", force, 0.0, 1}, {"slope", slope, 0.0, 0}};
    perp_bristle copy;
    perp_status status = begin(context, &copy, law, 1, "next", next);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(context, "force", force);
    PERP__THEN(status, check_number(context, "z", z));
    PERP__THEN(status, check_number(context, "v", v));
    PERP__THEN(status, check_number(context, "h", h));
    if (status == PERP_OK && !(h > 0.0))
        status = perp__refuse(context, "h is %g, expected a positive number", h);
    if (status == PERP_OK) {
        const curve g = stribeck(&copy, v);
        const double x = ratio_of(copy.stiffness, fabs(v), h, g.force);
        const stretch s =
            x <= 1.0 ? short_stretch(&copy, g, x, z, v, h) : long_stretch(&copy, g, x, z, v);

        results[0].value = s.end;
        results[1].value =
            copy.stiffness * s.mean + copy.damping * (s.change / h) + copy.viscosity * v;
        results[2].value =
            copy.stiffness * s.mean_slope + copy.damping * (s.end_slope / h) + copy.viscosity;
    }
    return end(context, status, results, 3);
}

/* viscosity kinetic >= damping (breakaway - kinetic), both over breakaway: neither overflows. */
perp_status perp_lugre_passive(perp_context *context, int32_t *passive, const perp_bristle *law)
{
    perp_bristle copy;
    const perp_status status = begin(context, &copy, law, 1, "passive", passive);

    if (status != PERP_OK)
        return status;
    *passive = ratio_of(copy.viscosity, copy.kinetic, 1.0, copy.breakaway) >=
               ratio_of(copy.damping, copy.breakaway - copy.kinetic, 1.0, copy.breakaway);
    return end(context, status, NULL, 0);
}
