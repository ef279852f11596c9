/* Load-dependent friction, the front door: the system is checked and copied, questions are put. */
#include "mechanism/load_friction/load_friction.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "linalg/blas.h"
#include "mechanism/copy.h"

/* ---- checks -------------------------------------------------------------------------------- */

static perp_status check_settings(perp_context *context, const perp_load_settings *s)
{
    if (!(s->tol > 0.0 && s->tol <= 1e-3))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.tol is %g, not in (0, 1e-3]",
                          s->tol);
    if (s->most_patterns < 1)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.most_patterns is %lld, below 1",
                          (long long)s->most_patterns);
    if (s->starts < 1)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.starts is %d, below 1",
                          (int)s->starts);
    return PERP_OK;
}

static perp_status copy_friction(perp_load_friction *f, const perp_load_system *system)
{
    perp_context *context = f->context;
    perp_status status = perp__check_pointer(context, "mu", system->mu);
    int32_t i;

    if (status == PERP_OK)
        status = perp__copy_vector(context, "mu", f->n, f->mu, system->mu);
    if (status == PERP_OK)
        status = perp__copy_vector(context, "mu_static", f->n, f->mu_static,
                                   system->mu_static ? system->mu_static : system->mu);
    for (i = 0; i < f->n && status == PERP_OK; i++) {
        if (f->mu[i] < 0.0)
            return perp__fail(context, PERP_ERROR_ARGUMENT, "mu[%d] is %g, negative", (int)i,
                              f->mu[i]);
        if (f->mu_static[i] < f->mu[i])
            return perp__fail(context, PERP_ERROR_ARGUMENT, "mu_static[%d] = %g < mu[%d] = %g",
                              (int)i, f->mu_static[i], (int)i, f->mu[i]);
    }
    return status;
}

/* ---- the system ---------------------------------------------------------------------------- */

/* Y = S + C A^-1 C' and the units, with A's factor in `work`. */
static void derive(perp_load_friction *f)
{
    const size_t n = (size_t)f->n, square = n * n;
    double *X = f->work + square;
    size_t i, j;
    int exponent;

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            X[j + n * i] = f->C[i + n * j];
    perp__cholesky_solve(f->n, f->n, f->work, f->n, X, f->n);
    for (i = 0; i < square; i++)
        f->Y[i] = -f->S[i];
    perp__gemm_subtract(f->n, f->n, f->n, f->C, f->n, X, f->n, f->Y, f->n);
    for (i = 0; i < square; i++)
        f->Y[i] = -f->Y[i];
    for (i = 0; i < n; i++) {
        frexp(f->A[i + n * i], &exponent);
        f->size[i] = ldexp(1.0, -(exponent / 2));
    }
}

static perp_status take(perp_load_friction *f, const perp_load_system *system)
{
    perp_context *context = f->context;
    perp_status status = perp__copy_matrix(context, "A", f->n, f->n, f->A, system->A);
    int32_t i;

    if (status == PERP_OK)
        status = perp__copy_matrix(context, "C", f->n, f->n, f->C, system->C);
    if (status == PERP_OK && system->normal_inertia)
        status =
            perp__copy_matrix(context, "normal_inertia", f->n, f->n, f->S, system->normal_inertia);
    else
        memset(f->S, 0, (size_t)f->n * (size_t)f->n * sizeof *f->S);
    for (i = 0; i < f->n && !system->normal_inertia; i++)
        f->S[(size_t)i * ((size_t)f->n + 1)] = 1.0;
    if (status == PERP_OK)
        status = perp__copy_vector(context, "b", f->n, f->b, system->b);
    if (status == PERP_OK)
        status = perp__copy_vector(context, "d", f->n, f->d, system->d);
    if (status == PERP_OK)
        status = copy_friction(f, system);
    if (status == PERP_OK)
        status = perp__check_compliance(context, system->stiffness, system->damping);
    if (status == PERP_OK)
        status = perp__check_inertia(context, "normal_inertia", f->n, f->S, f->work);
    if (status == PERP_OK)
        status = perp__check_inertia(context, "A", f->n, f->A, f->work);
    if (status != PERP_OK)
        return status;
    f->stiffness = system->stiffness;
    f->damping = system->damping;
    derive(f);
    return PERP_OK;
}

static void layout(perp__arena *arena, void *object)
{
    perp_load_friction *f = object;
    const size_t n = (size_t)f->n, square = n * n;
    double **const matrices[] = {&f->A, &f->C, &f->S, &f->Y, &f->K, &f->inverse, &f->null};
    double **const vectors[] = {&f->b,
                                &f->d,
                                &f->mu,
                                &f->mu_static,
                                &f->size,
                                &f->x,
                                &f->x_low,
                                &f->rhs,
                                &f->slope,
                                &f->load,
                                &f->normal,
                                &f->width,
                                &f->normal_width,
                                &f->product,
                                &f->product_low,
                                &f->normal_low,
                                &f->tau,
                                &f->question.stop,
                                &f->question.mu_stick};
    size_t k;

    for (k = 0; k < sizeof matrices / sizeof *matrices; k++)
        *matrices[k] = perp__arena_take(arena, square, sizeof(double));
    for (k = 0; k < sizeof vectors / sizeof *vectors; k++)
        *vectors[k] = perp__arena_take(arena, n, sizeof(double));
    f->work = perp__arena_take(arena, 6 * square + 4 * n, sizeof(double));
    f->list = perp__arena_take(arena, n, sizeof(int32_t));
    f->system.columns = perp__arena_take(arena, n, sizeof(int32_t));
    f->tree.next = perp__arena_take(arena, n, sizeof(int32_t));
    f->question.sign = perp__arena_take(arena, n, 1);
    f->question.before = perp__arena_take(arena, n, 1);
    f->regular = perp__arena_take(arena, n, 1);
    f->pattern.mode = perp__arena_take(arena, 2 * n, 1);
}

static void release(void *object)
{
    perp_load_friction *f = object;

    perp__answers_release(&f->answers);
    perp__cone_release(&f->polyhedron.cone);
    perp__arena_release(&f->arena);
}

static const perp__kind kind = {"load-dependent friction", sizeof(perp_load_friction), release};

perp_status perp__friction_enter(perp_load_friction *f)
{
    return perp__handle_enter(f, &kind);
}

/* The store, the tree and the system. */
static void prepare(perp_load_friction *f)
{
    f->pattern.side = f->pattern.mode + f->n;
    f->system.K = f->K;
    f->system.E = f->inverse;
    f->answers.length = f->answers.positions = f->polyhedron.length = f->n;
    f->answers.eigenvalues = 4 * f->n;
    f->answers.own = 2 * f->n;
    f->answers.holds = perp__friction_holds_answer;
    f->polyhedron.origin = f->x;
    f->polyhedron.directions = f->null;
    f->polyhedron.least = PERP__FRICTION_SAME;
}

/* A handle with room for n coordinates. */
static perp_status make(perp_context *context, perp_load_friction **friction, int32_t n)
{
    perp_load_friction *f = perp__handle_create(context, &kind);
    perp_status status;

    if (!f)
        return PERP_ERROR_MEMORY;
    f->answers.context = f->polyhedron.cone.context = context;
    f->n = n;
    perp__arena_init(&f->arena, context);
    status = perp__arena_fit(&f->arena, layout, f);
    if (status != PERP_OK) {
        perp__handle_end(f);
        return status;
    }
    prepare(f);
    f->A_view.rows = f->A_view.columns = f->C_view.rows = f->C_view.columns = n;
    f->A_view.row_stride = f->C_view.row_stride = 1;
    f->A_view.column_stride = f->C_view.column_stride = (size_t)n;
    f->A_view.values = f->A;
    f->C_view.values = f->C;
    *friction = f;
    return PERP_OK;
}

perp_status perp__friction_create_like(const perp_load_friction *f, perp_load_friction **made,
                                       const perp_load_system *system)
{
    perp_status status = make(f->context, made, f->n);

    if (status != PERP_OK)
        return status;
    (*made)->settings = f->settings;
    status = take(*made, system);
    if (status != PERP_OK)
        perp__handle_end(*made);
    return status;
}

static perp_status create(perp_context *context, perp_load_friction **friction,
                          const perp_load_settings *settings, const perp_load_system *system)
{
    perp_load_friction *f = NULL;
    perp_load_settings own;
    perp_load_system read;
    perp_status status;

    perp_load_settings_init(&own, sizeof own);
    perp_load_system_init(&read, sizeof read);
    status = perp__check_pointer(context, "friction", friction);
    if (status == PERP_OK)
        status = perp__struct_read(context, "settings", &own, sizeof own, settings,
                                   PERP__LOAD_SETTINGS_FIRST);
    if (status == PERP_OK)
        status = check_settings(context, &own);
    if (status == PERP_OK)
        status = perp__check_pointer(context, "system", system);
    if (status == PERP_OK)
        status = perp__struct_read(context, "system", &read, sizeof read, system,
                                   PERP__LOAD_SYSTEM_FIRST);
    if (status == PERP_OK && (read.n < 1 || read.n > 20000))
        status = perp__fail(context, PERP_ERROR_ARGUMENT,
                            "system.n is %d, expected at least 1 (and at most 20000)", (int)read.n);
    if (status == PERP_OK)
        status = make(context, &f, read.n);
    if (status != PERP_OK)
        return status;
    f->settings = own;
    status = take(f, &read);
    if (status != PERP_OK) {
        perp__handle_end(f);
        return status;
    }
    *friction = f;
    return PERP_OK;
}

perp_status perp_load_friction_create(perp_context *context, perp_load_friction **friction,
                                      const perp_load_settings *settings,
                                      const perp_load_system *system)
{
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    return perp__leave(context, create(context, friction, settings, system));
}

void perp_load_friction_destroy(perp_load_friction *friction)
{
    perp__handle_destroy(friction, &kind);
}
