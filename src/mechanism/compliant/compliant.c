/* Compliant contacts, the front door: the system is checked and copied; linearisation. */
#include "mechanism/compliant/compliant.h"

#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "linalg/blas.h"
#include "mechanism/copy.h"
#include "mechanism/stability.h"

PERP__INIT(perp_compliant_system)

perp_status perp_compliant_settings_init(perp_compliant_settings *settings, size_t size)
{
    perp_status status = perp__struct_init(settings, size, PERP__FIRST(perp_compliant_settings));

    if (status == PERP_OK) {
        settings->tol = 1e-9;
        settings->most_steps = 1000000;
    }
    return status;
}

PERP__INIT(perp_compliant_result)
PERP__INIT(perp_compliant_stability)

/* ---- the system ---------------------------------------------------------------------------- */

static void layout(perp__arena *arena, void *object)
{
    perp_compliant *c = object;
    const size_t n = (size_t)c->n, p = (size_t)c->p;

    c->mass = perp__arena_take(arena, n * n, sizeof(double));
    PERP__DOUBLES(arena, n, &c->force, &c->free, &c->x, &c->v, &c->V, &c->zx, &c->zv, &c->next_x,
                  &c->next_v, &c->error_x, &c->error_v, &c->top_x, &c->top_v);
    PERP__DOUBLES(arena, p, &c->mu, &c->slip, &c->side, &c->N, &c->right, &c->top_delta);
    PERP__DOUBLES(arena, n * p, &c->normal, &c->tangent, &c->response, &c->drag);
    PERP__DOUBLES(arena, p * p, &c->P, &c->Q, &c->matrix);
    for (size_t k = 0; k < PERP__STAGES; k++) {
        PERP__DOUBLES(arena, n, &c->kx[k], &c->kv[k]);
    }
    c->gamma = perp__arena_take(arena, 2 * p, sizeof(double));
    c->roots = perp__arena_take(arena, 4 * p, sizeof(double));
    c->pivots = perp__arena_take(arena, p, sizeof(int32_t));
}

/* to := mass^-1 from' (n by p), columns scaled. */
static void respond(const perp_compliant *c, double *to, const double *from, const double *scale)
{
    const size_t n = (size_t)c->n, p = (size_t)c->p;

    for (size_t k = 0; k < p; k++)
        for (size_t i = 0; i < n; i++)
            to[i + n * k] = from[k + p * i] * (scale ? scale[k] : 1.0);
    perp__cholesky_solve(c->n, c->p, c->mass, c->n, to, c->n);
}

/* to := normal from (p by p). */
static void couple(const perp_compliant *c, double *to, const double *from)
{
    const size_t n = (size_t)c->n, p = (size_t)c->p;

    for (size_t l = 0; l < p; l++)
        for (size_t k = 0; k < p; k++) {
            double sum = 0.0;

            for (size_t i = 0; i < n; i++)
                sum += c->normal[k + p * i] * from[i + n * l];
            to[k + p * l] = sum;
        }
}

/* Numbers that are finite each may overflow together. */
static perp_status check_finite(perp_compliant *c)
{
    const size_t n = (size_t)c->n, p = (size_t)c->p;

    if (perp__all_finite(c->free, n) && perp__all_finite(c->response, n * p) &&
        perp__all_finite(c->drag, n * p) && perp__all_finite(c->P, p * p) &&
        perp__all_finite(c->Q, p * p))
        return PERP_OK;
    return perp__fail(c->context, PERP_ERROR_NOT_FINITE,
                      "mass^-1 force, or normal mass^-1 (normal' + tangent' mu), overflows");
}

static perp_status take(perp_compliant *c, const perp_compliant_system *s)
{
    perp_context *context = c->context;
    perp_status status = perp__copy_matrix(context, "mass", c->n, c->n, c->mass, s->mass);

    if (status == PERP_OK)
        status = perp__copy_matrix(context, "normal", c->p, c->n, c->normal, s->normal);
    if (status == PERP_OK)
        status = perp__copy_matrix(context, "tangent", c->p, c->n, c->tangent, s->tangent);
    if (status == PERP_OK)
        status = perp__copy_vector(context, "force", c->n, c->force, s->force);
    if (status == PERP_OK)
        status = perp__check_pointer(context, "mu", s->mu);
    if (status == PERP_OK)
        status = perp__copy_vector(context, "mu", c->p, c->mu, s->mu);
    for (int32_t k = 0; k < c->p && status == PERP_OK; k++)
        if (c->mu[k] < 0.0)
            status = perp__fail(context, PERP_ERROR_ARGUMENT, "mu[%d] is %g, negative", (int)k,
                                c->mu[k]);
    if (status == PERP_OK)
        status = perp__check_compliance(context, s->stiffness, s->damping);
    if (status == PERP_OK)
        status = perp__check_inertia(context, "mass", c->n, c->mass, c->mass);
    if (status != PERP_OK)
        return status;
    c->stiffness = s->stiffness;
    c->damping = s->damping;
    memcpy(c->free, c->force, (size_t)c->n * sizeof *c->free);
    perp__cholesky_solve(c->n, 1, c->mass, c->n, c->free, c->n);
    respond(c, c->response, c->normal, NULL);
    respond(c, c->drag, c->tangent, c->mu);
    couple(c, c->P, c->response);
    couple(c, c->Q, c->drag);
    return check_finite(c);
}

static void release(void *object)
{
    perp_compliant *c = object;

    perp__arena_release(&c->arena);
}

static const perp__kind kind = {"compliant contacts", sizeof(perp_compliant), release};

perp_status perp__compliant_enter(perp_compliant *c)
{
    return perp__handle_enter(c, &kind);
}

static const perp__field sizes[] = {
    PERP__INTEGER(perp_compliant_system, n, 1, 20000),
    PERP__INTEGER(perp_compliant_system, contacts, 1, 20000),
};

static perp_status create(perp_context *context, perp_compliant **compliant,
                          const perp_compliant_system *system)
{
    perp_compliant_system read;
    perp_compliant *c;
    perp_status status = perp__check_pointer(context, "compliant", compliant);

    memset(&read, 0, sizeof read);
    if (status == PERP_OK)
        status = perp__check_pointer(context, "system", system);
    if (status == PERP_OK)
        status = PERP__READ(perp_compliant_system, context, &read, system);
    if (status == PERP_OK)
        status = PERP__CHECK_FIELDS(context, "system", &read, sizes);
    if (status != PERP_OK)
        return status;
    c = perp__handle_create(context, &kind);
    if (!c)
        return PERP_ERROR_MEMORY;
    c->n = read.n;
    c->p = read.contacts;
    perp__arena_init(&c->arena, context);
    status = perp__arena_fit(&c->arena, layout, c);
    if (status == PERP_OK)
        status = take(c, &read);
    if (status != PERP_OK) {
        perp__handle_end(c);
        return status;
    }
    *compliant = c;
    return PERP_OK;
}

perp_status perp_compliant_create(perp_context *context, perp_compliant **compliant,
                                  const perp_compliant_system *system)
{
    return PERP__CALL(perp__enter(context), context, create(context, compliant, system));
}

void perp_compliant_destroy(perp_compliant *compliant)
{
    perp__handle_destroy(compliant, &kind);
}

/* ---- linearisation ------------------------------------------------------------------------- */

static perp_status check_signs(perp_compliant *c, const char *name, const int32_t *signs,
                               int32_t least)
{
    perp_status status = perp__check_pointer(c->context, name, signs);

    for (int32_t k = 0; k < c->p && status == PERP_OK; k++)
        if (signs[k] < -1 || signs[k] > 1 || (signs[k] == 0 && least == 1))
            status = perp__fail(c->context, PERP_ERROR_ARGUMENT, "%s[%d] is %d, not a sign", name,
                                (int)k, (int)signs[k]);
    return status;
}

static perp_status linearise(perp_compliant *c, perp_compliant_stability *stability, double *gamma,
                             double *eigenvalues, const int32_t *slip, const int32_t *load)
{
    const size_t p = (size_t)c->p;
    perp_compliant_stability own;
    perp__stability verdict;
    perp_status status = PERP__CHECK(perp_compliant_stability, c->context, stability);

    if (status == PERP_OK)
        status = check_signs(c, "slip", slip, 0);
    if (status == PERP_OK)
        status = check_signs(c, "load", load, 1);
    if (status != PERP_OK)
        return status;
    for (size_t l = 0; l < p; l++)
        for (size_t k = 0; k < p; k++)
            c->matrix[k + p * l] = c->P[k + p * l] + c->Q[k + p * l] * (slip[l] * load[l]);
    verdict = perp__stability_of(c->p, c->matrix, c->stiffness, c->damping, c->gamma, c->roots);
    if (!perp__all_finite(c->gamma, 2 * p) || !perp__all_finite(c->roots, 4 * p))
        return perp__fail(c->context, PERP_ERROR_NOT_FINITE,
                          "the eigenvalues of the compliant contacts overflow");
    memset(&own, 0, sizeof own);
    own.stable = verdict.stable;
    own.flutter = verdict.flutter;
    own.growth = c->roots[0];
    for (size_t k = 0; k < p; k++) {
        own.growth = fmax(own.growth, fmax(c->roots[4 * k], c->roots[4 * k + 2]));
        if (gamma) {
            gamma[2 * k] = c->gamma[k];
            gamma[2 * k + 1] = c->gamma[p + k];
        }
    }
    if (eigenvalues)
        memcpy(eigenvalues, c->roots, 4 * p * sizeof *eigenvalues);
    perp__struct_write(stability, &own, sizeof own);
    return PERP_OK;
}

perp_status perp_compliant_linearise(perp_compliant *compliant, perp_compliant_stability *stability,
                                     double *gamma, double *eigenvalues, const int32_t *slip,
                                     const int32_t *load)
{
    return PERP__CALL(perp__compliant_enter(compliant), compliant->context,
                      linearise(compliant, stability, gamma, eigenvalues, slip, load));
}
