/* Mass properties of a dynamic body: checks, inverse, and a square root of the inverse. */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "linalg/spatial.h"

/* Lower triangular L with A + shift E = L L' (row by row); returns 0 if a pivot is not above
 * `least` times its diagonal entry: not positive definite to rounding. */
static int32_t cholesky3(double *L, const double *A, double shift, double least)
{
    int32_t i, j, k;

    memset(L, 0, 9 * sizeof *L);
    for (j = 0; j < 3; j++) {
        double diagonal = A[3 * j + j] + shift;
        double pivot = diagonal;

        for (k = 0; k < j; k++)
            pivot -= L[3 * j + k] * L[3 * j + k];
        if (!(pivot > least * fabs(diagonal)))
            return 0;
        L[3 * j + j] = sqrt(pivot);
        for (i = j + 1; i < 3; i++) {
            double entry = A[3 * i + j];

            for (k = 0; k < j; k++)
                entry -= L[3 * i + k] * L[3 * j + k];
            L[3 * i + j] = entry / L[3 * j + j];
        }
    }
    return 1;
}

/* X = L^-1 for lower triangular L. */
static void invert_lower3(double *X, const double *L)
{
    int32_t i, j, k;

    memset(X, 0, 9 * sizeof *X);
    for (j = 0; j < 3; j++) {
        X[3 * j + j] = 1.0 / L[3 * j + j];
        for (i = j + 1; i < 3; i++) {
            double entry = 0.0;

            for (k = j; k < i; k++)
                entry -= L[3 * i + k] * X[3 * k + j];
            X[3 * i + j] = entry / L[3 * i + i];
        }
    }
}

static void transpose3(double *B, const double *A)
{
    int32_t i, j;

    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            B[3 * i + j] = A[3 * j + i];
}

/* A mass distribution has I = (trace S) E - S with S its second moments, which are positive
 * semidefinite: S = (trace I / 2) E - I. In principal axes this is the triangle inequality. */
static int32_t triangle_inequality(const double *I)
{
    const double slack = 1e-9; /* thin plates and rods lie on the edge; data have rounded digits */
    double trace = I[0] + I[4] + I[8];
    double negative[9], L[9];
    int32_t i;

    for (i = 0; i < 9; i++)
        negative[i] = -I[i];
    return cholesky3(L, negative, (0.5 + slack) * trace, 0.0);
}

static perp_status check_inertia(perp_context *context, const double *I)
{
    const double symmetry = 1e-12;
    double scale = fabs(I[0]) + fabs(I[4]) + fabs(I[8]);
    double L[9];
    perp_status status = perp__check_finite(context, "settings.inertia", I, 9);

    if (status != PERP_OK)
        return status;
    if (fabs(I[1] - I[3]) > symmetry * scale || fabs(I[2] - I[6]) > symmetry * scale ||
        fabs(I[5] - I[7]) > symmetry * scale)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.inertia is not symmetric");
    if (!cholesky3(L, I, 0.0, 16.0 * PERP__EPSILON))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.inertia is not positive definite");
    if (!triangle_inequality(I))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.inertia violates the triangle inequality: no mass "
                          "distribution has a principal moment above the sum of the others");
    return PERP_OK;
}

static void planar_inertia(perp__body *body, double I)
{
    body->inertia[8] = I;
    body->inverse_inertia[8] = 1.0 / I;
    body->inverse_factor[8] = sqrt(I);
    body->factor[8] = 1.0 / body->inverse_factor[8];
    body->spherical = 1; /* no gyroscopic term in the plane */
}

/* I = L L', so I^-1 = C C' with C = L^-T; exact reciprocals where I is diagonal. */
static void spatial_inertia(perp__body *body, const double *I)
{
    double symmetric[9], L[9], inverse[9];
    int32_t i, j;

    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            symmetric[3 * i + j] = 0.5 * (I[3 * i + j] + I[3 * j + i]);
    memcpy(body->inertia, symmetric, sizeof symmetric);
    (void)cholesky3(L, symmetric, 0.0, 0.0);
    invert_lower3(inverse, L);
    transpose3(body->inverse_factor, L);
    transpose3(body->factor, inverse);
    perp__multiply_transposed3(body->inverse_inertia, body->factor, body->factor);
    if (symmetric[1] == 0.0 && symmetric[2] == 0.0 && symmetric[5] == 0.0) {
        for (i = 0; i < 9; i += 4)
            body->inverse_inertia[i] = 1.0 / symmetric[i];
        body->spherical = symmetric[0] == symmetric[4] && symmetric[4] == symmetric[8];
    }
}

perp_status perp__body_mass(const perp_world *world, perp__body *body, double mass,
                            const double *inertia)
{
    perp_context *context = world->context;
    perp_status status = perp__check_finite(context, "settings.mass", &mass, 1);

    if (status != PERP_OK)
        return status;
    if (mass <= 0.0)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.mass is %g, > 0 expected for a dynamic body", mass);
    if (world->settings.planar) {
        status = perp__check_finite(context, "settings.inertia[8]", inertia + 8, 1);
        if (status == PERP_OK && inertia[8] <= 0.0)
            status = perp__fail(context, PERP_ERROR_ARGUMENT,
                                "settings.inertia[8] is %g, > 0 expected", inertia[8]);
    } else {
        status = check_inertia(context, inertia);
    }
    if (status != PERP_OK)
        return status;
    body->mass = mass;
    body->inverse_mass = 1.0 / mass;
    if (world->settings.planar)
        planar_inertia(body, inertia[8]);
    else
        spatial_inertia(body, inertia);
    return PERP_OK;
}
