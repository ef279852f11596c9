/* Load-dependent friction, the front door: the system is checked and copied, questions are put. */
#include "mechanism/load_friction/load_friction.h"

#include <math.h>
#include <string.h>

#include "linalg/blas.h"
#include "mechanism/copy.h"

PERP__INIT_WITH(perp_load_system, .stiffness = 1.0, .damping = 2.0)

PERP__INIT_WITH(perp_load_settings, .tol = 1e-13, .most_patterns = 1 << 21, .starts = 64)

PERP__WORDS(perp_load_kind_text, "unknown kind", "dynamic", "static", "mixed", "family")

PERP__WORDS(perp_load_mode_text, "unknown mode", "slide", "stick", "forward", "backward", "stopped")

PERP__WORDS(
    perp_load_reason_text, "unknown reason", "",
    "the torque leaves the acceleration free along a direction: an effective inertia is zero",
    "the wanted motion is on an unstable branch, where an effective inertia is negative",
    "the wanted motion is unstable: compliant contacts oscillate away from it (flutter)",
    "the torque has other accelerations, too",
    "static friction at rest leaves the torque open within its limits",
    "the system is too large to exclude other accelerations of this torque")

static const perp__field settings_fields[] = {
    PERP__REAL(perp_load_settings, tol, "(]", 0, 1e-3),
    PERP__INTEGER(perp_load_settings, most_patterns, 1, INFINITY),
    PERP__INTEGER(perp_load_settings, starts, 1, INFINITY),
};

static PERP__SETTINGS_READER(read_settings, perp_load_settings, settings_fields, PERP_OK)

    static const perp__field numbers[] = {
        PERP__INTEGER(perp_load_system, n, 1, 20000),
        PERP__REAL(perp_load_system, stiffness, "()", 0, INFINITY),
        PERP__REAL(perp_load_system, damping, "[)", 0, INFINITY),
};

/* ---- the system ---------------------------------------------------------------------------- */

static perp_status take(perp_load_friction *f, const perp_load_system *system)
{
    perp_context *context = f->context;
    perp_status status = perp__copy_matrix(context, "A", f->n, f->n, f->A, system->A);
    const size_t n = (size_t)f->n, square = n * n;
    int exponent;

    PERP__THEN(status, perp__copy_matrix(context, "C", f->n, f->n, f->C, system->C));
    if (status == PERP_OK && system->normal_inertia)
        status =
            perp__copy_matrix(context, "normal_inertia", f->n, f->n, f->S, system->normal_inertia);
    else
        memset(f->S, 0, (size_t)f->n * (size_t)f->n * sizeof *f->S);
    for (int32_t i = 0; i < f->n && !system->normal_inertia; i++)
        f->S[(size_t)i * ((size_t)f->n + 1)] = 1.0;
    PERP__THEN(status, perp__copy_vector(context, "b", f->n, f->b, system->b));
    PERP__THEN(status, perp__copy_vector(context, "d", f->n, f->d, system->d));
    PERP__THEN(status, perp__copy_coefficients(context, f->n, f->mu, f->mu_static, system->mu,
                                               system->mu_static));
    PERP__THEN(status, perp__check_inertia(context, "normal_inertia", f->n, f->S, f->work));
    PERP__THEN(status, perp__check_inertia(context, "A", f->n, f->A, f->work));
    if (status != PERP_OK)
        return status;
    f->stiffness = system->stiffness;
    f->damping = system->damping;
    /* X, Y and the units, with A's factor in `work` */
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            f->X[j + n * i] = f->C[i + n * j];
    perp__cholesky_solve(f->n, f->n, f->work, f->n, f->X, f->n);
    for (size_t i = 0; i < square; i++)
        f->Y[i] = -f->S[i];
    perp__gemm_subtract(f->n, f->n, f->n, f->C, f->n, f->X, f->n, f->Y, f->n);
    for (size_t i = 0; i < square; i++)
        f->Y[i] = -f->Y[i];
    for (size_t i = 0; i < n; i++) {
        frexp(f->A[i + n * i], &exponent);
        f->size[i] = ldexp(1.0, -(exponent / 2));
    }
    /* with mu_static = mu, x -> A x + mu |C x + d| Sgn(x - stop) is strictly monotone if <A> -
     * (mu |C| + |C|' mu) / 2 is positive definite, <A> being A with -|A_ij| off the diagonal; by
     * more than rounding */
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const double a = f->A[i + n * j];
            const double friction =
                0.5 * (f->mu[i] * fabs(f->C[i + n * j]) + f->mu[j] * fabs(f->C[j + n * i]));

            f->work[i + n * j] = (i == j ? a * (1.0 - 1e-9) : -fabs(a)) - friction;
        }
    f->monotone = perp__cholesky_factor(f->n, f->work, f->n) == 0;
    return PERP_OK;
}

static void layout(perp__arena *arena, void *object)
{
    perp_load_friction *f = object;
    const size_t n = (size_t)f->n, square = n * n;
    perp__friction_question *q = &f->question;

    PERP__DOUBLES(arena, square, &f->A, &f->C, &f->S, &f->X, &f->Y);
    PERP__DOUBLES(arena, n, &f->b, &f->d, &f->mu, &f->mu_static, &f->size, &f->origin, &f->product,
                  &f->product_low, &f->normal, &f->normal_low, &f->tau, &q->stop, &q->mu_stick);
    f->work = perp__arena_take(arena, 6 * square + 4 * n, sizeof(double));
    PERP__DOUBLES(arena, 2 * n, &f->c, &f->c_size);
    perp__linear_layout(&f->linear, arena);
    f->tree.next = perp__arena_take(arena, n, sizeof(int32_t));
    q->sign = perp__arena_take(arena, n, 1);
    q->before = perp__arena_take(arena, n, 1);
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

static perp_status read_system(perp_context *context, perp_load_system *read,
                               const perp_load_system *system)
{
    perp_status status = perp__check_pointer(context, "system", system);

    perp_load_system_init(read, sizeof *read);
    PERP__THEN(status, PERP__READ(perp_load_system, context, read, system));
    return status == PERP_OK ? PERP__CHECK_FIELDS(context, "system", read, numbers) : status;
}

/* A handle with a system. */
static perp_status make(perp_context *context, perp_load_friction **made,
                        const perp_load_settings *settings, const perp_load_system *system)
{
    perp_load_friction *f = perp__handle_create(context, &kind);
    perp_status status;

    if (!f)
        return PERP_ERROR_MEMORY;
    f->answers.context = f->polyhedron.cone.context = context;
    f->settings = *settings;
    f->n = f->linear.length = system->n;
    f->linear.rows = 2 * f->n;
    status = perp__arena_fit(&f->arena, context, layout, f);
    if (status == PERP_OK) {
        perp__linear *p = &f->linear;

        f->pattern.side = f->pattern.mode + f->n;
        f->A_view = (perp__matrix){.rows = f->n, .columns = f->n, .row_stride = 1, .values = f->A};
        f->A_view.column_stride = (size_t)f->n;
        f->C_view = f->A_view;
        f->C_view.values = f->C;
        p->block[0] = f->A;
        p->block[1] = f->C;
        p->c = f->c;
        p->c_size = f->c_size;
        p->scale = f->size;
        p->positions = f->n;
        p->conditions = perp__friction_conditions;
        f->answers.length = f->answers.positions = f->polyhedron.length = f->n;
        f->answers.eigenvalues = 4 * f->n;
        f->answers.extra = 2 * f->n;
        f->answers.holds = perp__friction_holds_answer;
        f->polyhedron.origin = p->x;
        f->polyhedron.directions = p->null;
        f->polyhedron.least = PERP__AGREEMENT;
        status = take(f, system);
    }
    PERP__HAND_OUT(status, f, made);
    return status;
}

perp_status perp_load_friction_create(perp_context *context, perp_load_friction **friction,
                                      const perp_load_settings *settings,
                                      const perp_load_system *system)
{
    perp_load_settings copy;
    perp_load_system read;
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(context, "friction", friction);
    PERP__THEN(status, read_settings(context, &copy, settings));
    PERP__THEN(status, read_system(context, &read, system));
    PERP__THEN(status, make(context, friction, &copy, &read));
    return perp__leave(context, status);
}

void perp_load_friction_destroy(perp_load_friction *friction)
{
    perp__handle_destroy(friction, &kind);
}

perp_status perp_load_friction_set(perp_load_friction *friction, const perp_load_system *system)
{
    perp_load_friction *f = friction, *made, kept;
    perp_load_system read;
    perp_status status = perp__friction_enter(f);

    if (status != PERP_OK)
        return status;
    status = read_system(f->context, &read, system);
    if (status == PERP_OK && read.n != f->n)
        status = perp__refuse(f->context, "system.n is %d, it was %d", (int)read.n, (int)f->n);
    PERP__THEN(status, make(f->context, &made, &f->settings, &read));
    if (status == PERP_OK) {
        kept = *f;
        *f = *made;
        *made = kept;
        perp__handle_end(made);
    }
    return perp__leave(f->context, status);
}

/* ---- questions ----------------------------------------------------------------------------- */

perp_status perp__friction_solve(perp_load_friction *f, perp_load_summary *summary,
                                 const double *velocity)
{
    const size_t n = (size_t)f->n;

    memset(f->question.stop, 0, n * sizeof *f->question.stop);
    memset(f->question.before, 0, n);
    memcpy(f->question.mu_stick, f->mu_static, n * sizeof *f->mu_static);
    for (int32_t i = 0; i < f->n; i++)
        f->question.sign[i] = (int8_t)((velocity[i] > 0.0) - (velocity[i] < 0.0));
    return perp__friction_answer_all(f, summary);
}

perp_status perp_load_friction_solve(perp_load_friction *friction, perp_load_summary *summary,
                                     const double *tau, const double *velocity)
{
    perp_load_friction *f = friction;
    perp_load_summary copy;
    perp_status status = perp__friction_enter(f);

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_load_summary, f->context, summary);
    PERP__THEN(status, perp__check_vector(f->context, "tau", tau, (size_t)f->n));
    PERP__THEN(status, perp__check_vector(f->context, "velocity", velocity, (size_t)f->n));
    if (status == PERP_OK) {
        memcpy(f->tau, tau, (size_t)f->n * sizeof *tau);
        status = perp__friction_solve(f, &copy, velocity);
    }
    if (status == PERP_OK)
        perp__struct_write(summary, &copy, sizeof copy);
    return perp__leave(f->context, status);
}

perp_status perp_load_friction_get(perp_load_friction *friction, perp_load_found *found,
                                   int32_t index)
{
    perp_load_friction *f = friction;
    perp_status status = perp__friction_enter(f);

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_load_found, f->context, found);
    if (status == PERP_OK && (index < 0 || index >= f->answers.count))
        status = perp__refuse(f->context, "index is %d, but there are %d answers", (int)index,
                              (int)f->answers.count);
    if (status == PERP_OK) {
        const perp__answer *a = perp__answers_get(&f->answers, index);
        const perp_load_found copy = {.kind = a->kind,
                                      .stable = a->stable,
                                      .flutter = a->flutter,
                                      .at_vertex = a->at_vertex,
                                      .dimension = a->dimension,
                                      .vertex_count = a->vertices,
                                      .ray_count = a->rays,
                                      .residual = a->residual,
                                      .acceleration = a->middle,
                                      .normal_force = a->extra,
                                      .friction = a->extra + f->n,
                                      .modes = a->modes,
                                      .eigenvalues = a->eigenvalues,
                                      .vertices = a->points,
                                      .rays = a->points + (size_t)a->vertices * (size_t)f->n};

        perp__struct_write(found, &copy, sizeof copy);
    }
    return perp__leave(f->context, status);
}
