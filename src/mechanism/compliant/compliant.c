/* Compliant contacts, the front door: the system is checked and copied; linearisation. */
#include "mechanism/compliant/compliant.h"

#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "linalg/blas.h"
#include "mechanism/copy.h"
#include "mechanism/eigenvalues.h"

PERP__INIT_WITH(perp_compliant_settings, .tol = 1e-9, .most_steps = 1000000)

/* ---- the system ---------------------------------------------------------------------------- */

static void layout_response(perp__arena *arena, perp__response *r, size_t n, size_t p)
{
    r->free = perp__arena_take(arena, n, sizeof(double));
    PERP__DOUBLES(arena, n * p, &r->response, &r->drag);
    PERP__DOUBLES(arena, p * p, &r->P, &r->Q);
}

static void layout(perp__arena *arena, void *object)
{
    perp_compliant *c = object;
    const size_t n = (size_t)c->n, p = (size_t)c->p;

    c->mass = perp__arena_take(arena, n * n, sizeof(double));
    PERP__DOUBLES(arena, n, &c->force, &c->x, &c->v, &c->V, &c->zx, &c->zv, &c->next_x, &c->next_v,
                  &c->error_x, &c->error_v, &c->size, &c->top_x, &c->top_v);
    PERP__DOUBLES(arena, p, &c->mu, &c->mu_static, &c->side, &c->N, &c->right, &c->top_delta,
                  &c->flank, &c->sense, &c->sense_before, &c->share, &c->friction, &c->lower,
                  &c->upper, &c->q, &c->w);
    PERP__DOUBLES(arena, n * p, &c->normal, &c->tangent);
    PERP__DOUBLES(arena, p * p, &c->slip_response, &c->factor, &c->matrix);
    PERP__INTEGERS(arena, p, &c->one_sided, &c->modes, &c->modes_before, &c->gives, &c->stuck,
                   &c->pivots);
    layout_response(arena, &c->all, n, p);
    layout_response(arena, &c->held, n, p);
    for (size_t k = 0; k < PERP__STAGES; k++)
        PERP__DOUBLES(arena, n, &c->kx[k], &c->kv[k]);
    c->gamma = perp__arena_take(arena, 2 * p, sizeof(double));
    c->roots = perp__arena_take(arena, 4 * p, sizeof(double));
    perp__active_rows_layout(&c->rows, arena, n * p, p, n);
}

/* to := mass^-1 from' (n by p). */
static void respond(const perp_compliant *c, double *to, const double *from)
{
    const size_t n = (size_t)c->n, p = (size_t)c->p;

    for (size_t k = 0; k < p; k++)
        for (size_t i = 0; i < n; i++)
            to[i + n * k] = from[k + p * i];
    perp__cholesky_solve(c->n, c->p, c->mass, c->n, to, c->n);
}

double perp__compliant_row(const perp_compliant *c, const double *A, int32_t row, const double *x)
{
    double sum = 0.0;

    for (int32_t i = 0; i < c->n; i++)
        sum += A[(size_t)row + (size_t)c->p * (size_t)i] * x[i];
    return sum;
}

/* to := rows from (p by p). */
static void multiply(const perp_compliant *c, double *to, const double *rows, const double *from)
{
    for (int32_t l = 0; l < c->p; l++)
        for (int32_t k = 0; k < c->p; k++)
            to[(size_t)k + (size_t)c->p * (size_t)l] =
                perp__compliant_row(c, rows, k, from + (size_t)c->n * (size_t)l);
}

void perp__compliant_couple(const perp_compliant *c, perp__response *r)
{
    multiply(c, r->P, c->normal, r->response);
    multiply(c, r->Q, c->normal, r->drag);
}

void perp__compliant_normals(const perp_compliant *c, double *to, const double *x, const double *v)
{
    for (int32_t k = 0; k < c->p; k++)
        to[k] = c->stiffness * perp__compliant_row(c, c->normal, k, x) +
                c->damping * perp__compliant_row(c, c->normal, k, v);
}

static perp_status take(perp_compliant *c, const perp_compliant_system *s)
{
    const size_t n = (size_t)c->n, p = (size_t)c->p;
    perp_context *context = c->context;
    perp_status status = perp__copy_matrix(context, "mass", c->n, c->n, c->mass, s->mass);

    PERP__THEN(status, perp__copy_matrix(context, "normal", c->p, c->n, c->normal, s->normal));
    PERP__THEN(status, perp__copy_matrix(context, "tangent", c->p, c->n, c->tangent, s->tangent));
    PERP__THEN(status, perp__copy_vector(context, "force", c->n, c->force, s->force));
    PERP__THEN(status,
               perp__copy_coefficients(context, c->p, c->mu, c->mu_static, s->mu, s->mu_static));
    for (int32_t k = 0; k < c->p && status == PERP_OK; k++) {
        c->one_sided[k] = s->one_sided ? s->one_sided[k] : 0;
        if (c->one_sided[k] != 0 && c->one_sided[k] != 1)
            status = perp__refuse(context, "one_sided[%d] is %d, not 0 or 1", (int)k,
                                  (int)c->one_sided[k]);
    }
    PERP__THEN(status, perp__check_inertia(context, "mass", c->n, c->mass, c->mass));
    if (status != PERP_OK)
        return status;
    c->stiffness = s->stiffness;
    c->damping = s->damping;
    memcpy(c->all.free, c->force, (size_t)c->n * sizeof *c->all.free);
    perp__cholesky_solve(c->n, 1, c->mass, c->n, c->all.free, c->n);
    respond(c, c->all.response, c->normal);
    respond(c, c->all.drag, c->tangent);
    perp__compliant_couple(c, &c->all);
    multiply(c, c->slip_response, c->tangent, c->all.drag);
    if (perp__all_finite(c->all.free, n) && perp__all_finite(c->all.response, n * p) &&
        perp__all_finite(c->all.drag, n * p) && perp__all_finite(c->all.P, p * p) &&
        perp__all_finite(c->all.Q, p * p) && perp__all_finite(c->slip_response, p * p))
        return PERP_OK;
    return perp__fail(context,
                      PERP_ERROR_NOT_FINITE, /* numbers that are finite each may together */
                      "mass^-1 force, or (normal, tangent) mass^-1 (normal', tangent'), overflows");
}

static void release(void *object)
{
    perp_compliant *c = object;

    PERP__TELL(c->context, perp_lcp_solver_destroy(c->choice));
    perp__arena_release(&c->arena);
}

static const perp__kind kind = {"compliant contacts", sizeof(perp_compliant), release};

perp_status perp__compliant_enter(perp_compliant *c)
{
    return perp__handle_enter(c, &kind);
}

static const perp__field numbers[] = {
    PERP__INTEGER(perp_compliant_system, n, 1, 20000),
    PERP__INTEGER(perp_compliant_system, contacts, 1, 20000),
    PERP__REAL(perp_compliant_system, stiffness, "()", 0, INFINITY),
    PERP__REAL(perp_compliant_system, damping, "[)", 0, INFINITY),
};

perp_status perp_compliant_create(perp_context *context, perp_compliant **compliant,
                                  const perp_compliant_system *system)
{
    perp_compliant_system read = {0};
    perp_compliant *c = NULL;
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(context, "compliant", compliant);
    PERP__THEN(status, perp__check_pointer(context, "system", system));
    PERP__THEN(status, PERP__READ(perp_compliant_system, context, &read, system));
    PERP__THEN(status, PERP__CHECK_FIELDS(context, "system", &read, numbers));
    if (status == PERP_OK) {
        c = perp__handle_create(context, &kind);
        status = c ? PERP_OK : PERP_ERROR_MEMORY;
    }
    if (c) {
        c->n = read.n;
        c->p = read.contacts;
        status = perp__arena_fit(&c->arena, context, layout, c);
        PERP__THEN(status, take(c, &read));
        PERP__HAND_OUT(status, c, compliant);
    }
    return perp__leave(context, status);
}

void perp_compliant_destroy(perp_compliant *compliant)
{
    perp__handle_destroy(compliant, &kind);
}

perp_status perp_compliant_linearise(perp_compliant *compliant, perp_compliant_stability *stability,
                                     double *gamma, double *eigenvalues, const int32_t *slip,
                                     const int32_t *load)
{
    perp_compliant *c = compliant;
    perp_compliant_stability copy = {0};
    perp_status status = perp__compliant_enter(c);
    size_t p;

    if (status != PERP_OK)
        return status;
    p = (size_t)c->p;
    status = PERP__CHECK(perp_compliant_stability, c->context, stability);
    PERP__THEN(status, perp__check_pointer(c->context, "slip", slip));
    PERP__THEN(status, perp__check_pointer(c->context, "load", load));
    for (size_t k = 0; k < p && status == PERP_OK; k++)
        if (slip[k] < -1 || slip[k] > 1)
            status = perp__refuse(c->context, "slip[%zu] is %d, not a sign", k, (int)slip[k]);
        else if (load[k] != -1 && load[k] != 1)
            status = perp__refuse(c->context, "load[%zu] is %d, not a sign", k, (int)load[k]);
    if (status == PERP_OK) {
        for (size_t l = 0; l < p; l++)
            for (size_t k = 0; k < p; k++)
                c->matrix[k + p * l] =
                    c->all.P[k + p * l] + c->all.Q[k + p * l] * (c->mu[l] * (slip[l] * load[l]));
        perp__stability_of(c->p, c->matrix, c->stiffness, c->damping, c->gamma, c->roots,
                           &copy.stable, &copy.flutter);
        if (!perp__all_finite(c->gamma, 2 * p) || !perp__all_finite(c->roots, 4 * p))
            status = perp__fail(c->context, PERP_ERROR_NOT_FINITE,
                                "the eigenvalues of the compliant contacts overflow");
    }
    if (status == PERP_OK) {
        copy.growth = c->roots[0];
        for (size_t k = 0; k < p; k++) {
            copy.growth = fmax(copy.growth, fmax(c->roots[4 * k], c->roots[4 * k + 2]));
            if (gamma) {
                gamma[2 * k] = c->gamma[k];
                gamma[2 * k + 1] = c->gamma[p + k];
            }
        }
        if (eigenvalues)
            memcpy(eigenvalues, c->roots, 4 * p * sizeof *eigenvalues);
        perp__struct_write(stability, &copy, sizeof copy);
    }
    return perp__leave(c->context, status);
}
