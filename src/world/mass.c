/* Mass properties of a dynamic body, given or of its shapes, with the inverse and its root. */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "linalg/spatial.h"
#include "world/collide/polytope.h"

/* Lower triangular L with A + shift E = L L' (row by row); returns 0 if a pivot is not above
 * `least` times its diagonal entry: not positive definite to rounding. */
static bool cholesky3(double *L, const double *A, double shift, double least)
{
    memset(L, 0, 9 * sizeof *L);
    for (int32_t j = 0; j < 3; j++) {
        double diagonal = A[3 * j + j] + shift;
        double pivot = diagonal;

        for (int32_t k = 0; k < j; k++)
            pivot -= L[3 * j + k] * L[3 * j + k];
        if (!(pivot > least * fabs(diagonal)))
            return 0;
        L[3 * j + j] = sqrt(pivot);
        for (int32_t i = j + 1; i < 3; i++) {
            double entry = A[3 * i + j];

            for (int32_t k = 0; k < j; k++)
                entry -= L[3 * i + k] * L[3 * j + k];
            L[3 * i + j] = entry / L[3 * j + j];
        }
    }
    return 1;
}

static void transpose3(double *B, const double *A)
{
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++)
            B[3 * i + j] = A[3 * j + i];
}

static perp_status check_inertia(perp_context *context, const double *I)
{
    const double symmetry = 1e-12;
    const double slack = 1e-9; /* thin plates and rods lie on the edge; data have rounded digits */
    const double trace = I[0] + I[4] + I[8];
    double scale = fabs(I[0]) + fabs(I[4]) + fabs(I[8]);
    double negative[9], L[9];
    perp_status status = perp__check_finite(context, "settings.inertia", I, 9);

    if (status != PERP_OK)
        return status;
    if (fabs(I[1] - I[3]) > symmetry * scale || fabs(I[2] - I[6]) > symmetry * scale ||
        fabs(I[5] - I[7]) > symmetry * scale)
        return perp__refuse(context, "settings.inertia is not symmetric");
    if (!cholesky3(L, I, 0.0, PERP__ROUNDING_LIMIT))
        return perp__refuse(context, "settings.inertia is not positive definite");
    /* A mass distribution has I = (trace S) E - S with S its second moments, which are positive
     * semidefinite: S = (trace I / 2) E - I. In principal axes this is the triangle inequality. */
    for (int32_t i = 0; i < 9; i++)
        negative[i] = -I[i];
    if (!cholesky3(L, negative, (0.5 + slack) * trace, 0.0))
        return perp__refuse(context,
                            "settings.inertia violates the triangle inequality: no mass "
                            "distribution has a principal moment above the sum of the others");
    return PERP_OK;
}

/* I = L L', so I^-1 = C C' with C = L^-T; exact reciprocals where I is diagonal. */
static void spatial_inertia(perp__body *body, const double *I)
{
    double symmetric[9], L[9], inverse[9];

    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++)
            symmetric[3 * i + j] = 0.5 * (I[3 * i + j] + I[3 * j + i]);
    memcpy(body->inertia, symmetric, sizeof symmetric);
    (void)cholesky3(L, symmetric, 0.0, 0.0);
    memset(inverse, 0, sizeof inverse); /* L^-1 */
    for (int32_t j = 0; j < 3; j++) {
        inverse[3 * j + j] = 1.0 / L[3 * j + j];
        for (int32_t i = j + 1; i < 3; i++) {
            double entry = 0.0;

            for (int32_t k = j; k < i; k++)
                entry -= L[3 * i + k] * inverse[3 * k + j];
            inverse[3 * i + j] = entry / L[3 * i + i];
        }
    }
    transpose3(body->inverse_factor, L);
    transpose3(body->factor, inverse);
    perp__multiply_transposed3(body->inverse_inertia, body->factor, body->factor);
    body->spherical = 0;
    if (symmetric[1] == 0.0 && symmetric[2] == 0.0 && symmetric[5] == 0.0) {
        for (int32_t i = 0; i < 9; i += 4)
            body->inverse_inertia[i] = 1.0 / symmetric[i];
        body->spherical = symmetric[0] == symmetric[4] && symmetric[4] == symmetric[8];
    }
}

/* A capsule: the cylinder along x, and two halves of a ball (of a disc) moved along it. */
static double capsule_volume(double l, double r, int32_t planar, double *moments)
{
    const double shaft = planar ? 4.0 * l * r : 2.0 * PERP__PI * r * r * l;
    const double caps = planar ? PERP__PI * r * r : 4.0 / 3.0 * PERP__PI * r * r * r;
    /* of a half about the whole's centre, its own centre lies c from the flat side */
    const double c = planar ? 4.0 * r / (3.0 * PERP__PI) : 0.375 * r;
    const double round = (planar ? 0.25 : 0.2) * r * r; /* of x^2 over the caps */
    const double along = shaft * l * l / 3.0 + caps * (round + 2.0 * c * l + l * l);
    const double across = shaft * (planar ? r * r / 3.0 : 0.25 * r * r) + caps * round;

    moments[0] = planar ? across : 2.0 * across;
    moments[4] = moments[8] = along + across;
    return shaft + caps;
}

/* Volume and moments of a shape, mass 1 a volume, about its centre, along its axes. */
static double shape_volume(const perp_world *world, const perp__geometry *geometry, double *moments)
{
    const double *half = geometry->half_extents, r = geometry->radius;
    double volume = 0.0;

    memset(moments, 0, 9 * sizeof *moments);
    if (geometry->kind == PERP__SPHERE) {
        volume = world->settings.planar ? PERP__PI * r * r : 4.0 / 3.0 * PERP__PI * r * r * r;
        for (int32_t k = 0; k < 3; k++)
            moments[4 * k] = (world->settings.planar ? 0.5 : 0.4) * volume * r * r;
    } else if (geometry->kind == PERP__BOX) {
        volume = 4.0 * half[0] * half[1] * (world->settings.planar ? 1.0 : 2.0 * half[2]);
        for (int32_t k = 0; k < 3; k++) {
            const double u = half[(k + 1) % 3], v = half[(k + 2) % 3];

            moments[4 * k] = volume * (u * u + v * v) / 3.0;
        }
    } else if (geometry->kind == PERP__CAPSULE) {
        volume = capsule_volume(half[0], r, world->settings.planar, moments);
    } else if (geometry->kind == PERP__HULL) {
        volume = geometry->hull->volume;
        memcpy(moments, geometry->hull->moments, 9 * sizeof *moments);
    }
    return volume;
}

/* Inverse and roots, of the given mass and inertia or the shapes'. */
static void weigh(const perp_world *world, perp__body *body)
{
    double inertia[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

    body->mass = body->given_mass > 0.0   ? body->given_mass
                 : body->shape_mass > 0.0 ? body->shape_mass
                                          : 1.0;
    body->inverse_mass = 1.0 / body->mass;
    if (body->given_inertia[8] > 0.0)
        memcpy(inertia, body->given_inertia, sizeof inertia);
    else if (body->shape_mass > 0.0)
        for (int32_t k = 0; k < 9; k++)
            inertia[k] = body->shape_inertia[k] * (body->mass / body->shape_mass);
    if (!world->settings.planar) {
        spatial_inertia(body, inertia);
        return;
    }
    body->inertia[8] = inertia[8];
    body->inverse_inertia[8] = 1.0 / inertia[8];
    body->inverse_factor[8] = sqrt(inertia[8]);
    body->factor[8] = 1.0 / body->inverse_factor[8];
    body->spherical = 1; /* no gyroscopic term in the plane */
}

/* The parallel axis theorem: I about the origin = R I R' + m (|o|^2 E - o o'). */
perp_status perp__add_shape_mass(const perp_world *world, perp__body *body,
                                 const perp__shape *shape)
{
    const double *R = shape->rotation, *o = shape->offset;
    perp__body sum = *body;
    double moments[9], mass = shape->density * shape_volume(world, &shape->geometry, moments);

    if (body->kind != PERP_BODY_DYNAMIC || mass == 0.0)
        return PERP_OK;
    sum.shape_mass += mass;
    for (int32_t i = 0; i < 3; i++) {
        sum.shape_moment[i] += mass * o[i];
        for (int32_t j = 0; j < 3; j++) {
            double entry = mass * ((i == j ? perp__dot3(o, o) : 0.0) - o[i] * o[j]);

            for (int32_t k = 0; k < 3; k++)
                for (int32_t l = 0; l < 3; l++)
                    entry += shape->density * R[3 * i + k] * moments[3 * k + l] * R[3 * j + l];
            sum.shape_inertia[3 * i + j] += entry;
        }
    }
    weigh(world, &sum);
    if (!(sum.mass < INFINITY && sum.inverse_mass < INFINITY) ||
        !perp__all_finite(sum.inertia, 9) || !perp__all_finite(sum.inverse_inertia, 9))
        return perp__fail(world->context, PERP_ERROR_NOT_FINITE,
                          "settings.density is %g: mass or inertia leave the range of numbers",
                          shape->density);
    *body = sum;
    return PERP_OK;
}

perp_status perp__check_centres(perp_world *world)
{
    const double tolerance = 1e-6; /* of the body's size: offsets may have rounded digits */

    for (int32_t i = 0; i < world->bodies.slots; i++) {
        const perp__body *body = &world->bodies.all[i];
        const double *moment = body->shape_moment;

        if (body->alive && body->kind == PERP_BODY_DYNAMIC && !(body->given_inertia[8] > 0.0) &&
            perp__length3(moment) > tolerance * body->radius * body->shape_mass)
            return perp__refuse(world->context,
                                "body %d has its shapes' mass centre at (%g, %g, %g) from its "
                                "position, 0 expected: offsets are from the mass centre unless the "
                                "inertia is given",
                                (int)i, moment[0] / body->shape_mass, moment[1] / body->shape_mass,
                                moment[2] / body->shape_mass);
    }
    world->bodies.weighed = 1;
    return PERP_OK;
}

perp_status perp__body_mass(const perp_world *world, perp__body *body, double mass,
                            const double *inertia)
{
    perp_context *context = world->context;
    perp_status status = perp__check_finite(context, "settings.mass", &mass, 1);

    if (status != PERP_OK)
        return status;
    if (mass < 0.0)
        return perp__refuse(
            context, "settings.mass is %g, > 0 expected for a dynamic body, or 0: the shapes'",
            mass);
    if (world->settings.planar) {
        status = perp__check_finite(context, "settings.inertia[8]", inertia + 8, 1);
        if (status == PERP_OK && inertia[8] < 0.0)
            status = perp__refuse(
                context, "settings.inertia[8] is %g, > 0 expected, or 0: the shapes'", inertia[8]);
    } else if (!perp__is_zero3(inertia) || !perp__is_zero3(inertia + 3) ||
               !perp__is_zero3(inertia + 6)) {
        status = check_inertia(context, inertia);
    }
    if (status != PERP_OK)
        return status;
    body->given_mass = mass;
    memcpy(body->given_inertia, inertia, sizeof body->given_inertia);
    weigh(world, body);
    return PERP_OK;
}
