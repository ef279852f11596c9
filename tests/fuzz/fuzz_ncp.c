/* perp_ncp_solve, its solver and perp_ncp_check_jacobian, on
 *   F(z) = A z + b + sum of smooth terms, each a product of powers or a bounded fraction,
 * with and without a Jacobian, on domains that end. */
#include <math.h>
#include <string.h>

#include "fuzz.h"
#include "oracle.h"

#define MOST 8
#define TERMS 8

typedef struct term {
    int32_t kind, row, j, k;
    double factor;
} term;

typedef struct nonlinear {
    int32_t n, terms, calls, abort_at;
    double A[MOST * MOST], b[MOST], lower[MOST], upper[MOST], z0[MOST];
    double end; /* F is not defined where z_0 > end */
    term list[TERMS];
    int32_t starts[MOST + 1], rows[MOST * MOST], storage;
} nonlinear;

enum { PRODUCT, CUBE, FRACTION, KINDS };

/* A term's value and its derivatives with respect to z_j and z_k. */
#define TERM_BODY(number)                                          \
    number a = z[t->j], b = z[t->k], c = t->factor, s = 1 + a * a; \
    switch (t->kind) {                                             \
    case PRODUCT:                                                  \
        *dj = c * b, *dk = c * a;                                  \
        return c * a * b;                                          \
    case CUBE:                                                     \
        *dj = 3 * c * a * a, *dk = 0;                              \
        return c * a * a * a;                                      \
    default:                                                       \
        *dj = c * (1 - a * a) / (s * s), *dk = 0;                  \
        return c * a / s;                                          \
    }

static double term_value(const term *t, const double *z, double *dj, double *dk)
{
    TERM_BODY(double)
}

static wide term_wide(const term *t, const double *z, wide *dj, wide *dk)
{
    TERM_BODY(wide)
}

static int32_t outside(nonlinear *f, const double *z)
{
    int32_t i;

    for (i = 0; i < f->n; i++)
        if (!(z[i] >= f->lower[i] && z[i] <= f->upper[i]))
            fuzz_fail("callbacks are called within the bounds: z[%d] = %g", i, z[i]);
    if (f->calls++ == f->abort_at)
        return -1;
    return f->n > 0 && z[0] > f->end;
}

static int32_t function(double *F, const double *z, void *user)
{
    nonlinear *f = user;
    int32_t i, j, status = outside(f, z);
    double dj, dk;

    if (status != 0)
        return status;
    for (i = 0; i < f->n; i++)
        for (F[i] = f->b[i], j = 0; j < f->n; j++)
            F[i] += f->A[i * f->n + j] * z[j];
    for (i = 0; i < f->terms; i++)
        F[f->list[i].row] += term_value(&f->list[i], z, &dj, &dk);
    return 0;
}

static void dense_jacobian(const nonlinear *f, const double *z, double *J)
{
    int32_t i;
    double dj, dk;

    memcpy(J, f->A, (size_t)(f->n * f->n) * sizeof *J);
    for (i = 0; i < f->terms; i++) {
        const term *t = &f->list[i];

        term_value(t, z, &dj, &dk);
        J[t->row * f->n + t->j] += dj;
        J[t->row * f->n + t->k] += dk;
    }
}

static int32_t jacobian(double *values, const double *z, void *user)
{
    nonlinear *f = user;
    double J[MOST * MOST];
    int32_t i, j, status = outside(f, z);

    if (status != 0)
        return status;
    dense_jacobian(f, z, J);
    for (j = 0; j < f->n; j++)
        for (i = 0; i < f->n; i++) /* the pattern is full: by columns too */
            values[f->storage == PERP_STORAGE_ROW_MAJOR ? i * f->n + j : j * f->n + i] =
                J[i * f->n + j];
    return 0;
}

static void make(fuzz_bytes *bytes, nonlinear *f)
{
    fuzz_mood mood = fuzz_mood_of(bytes);
    int32_t i, n = f->n = fuzz_pick(bytes, MOST + 1), bounds = fuzz_pick(bytes, 3);

    fuzz_numbers(bytes, mood, f->A, n * n);
    fuzz_numbers(bytes, mood, f->b, n);
    fuzz_numbers(bytes, mood, f->z0, n);
    for (i = 0; i < n; i++) {
        f->lower[i] = bounds == 1 && fuzz_one_in(bytes, 2) ? -INFINITY : 0.0;
        f->upper[i] = bounds == 2 && fuzz_one_in(bytes, 2) ? fuzz_size(bytes, mood) : INFINITY;
    }
    f->terms = n > 0 ? fuzz_pick(bytes, TERMS + 1) : 0;
    for (i = 0; i < f->terms; i++)
        f->list[i] = (term){fuzz_pick(bytes, KINDS), fuzz_pick(bytes, n), fuzz_pick(bytes, n),
                            fuzz_pick(bytes, n), fuzz_number(bytes, mood)};
    f->end = fuzz_one_in(bytes, 8) ? fuzz_size(bytes, mood) : INFINITY;
    f->abort_at = fuzz_one_in(bytes, 16) ? fuzz_pick(bytes, 64) : -1;
    f->storage = fuzz_pick(bytes, 3);
    for (i = 0; i <= n; i++)
        f->starts[i] = i * n;
    for (i = 0; i < n * n; i++)
        f->rows[i] = i % n;
}

static void make_settings(fuzz_bytes *bytes, perp_ncp_settings *settings)
{
    uint8_t flags = fuzz_byte(bytes);

    if (perp_ncp_settings_init(settings, sizeof *settings) != PERP_OK)
        fuzz_fail("perp_ncp_settings_init takes its own size");
    settings->method = fuzz_pick(bytes, 3);
    settings->tol = fuzz_tol(bytes, settings->tol);
    settings->scaling = !(flags & 1);
    settings->polish = !(flags & 2);
    settings->restarts = flags & 4 ? fuzz_pick(bytes, 20) : 3;
    settings->max_iterations = flags & 8 ? fuzz_pick(bytes, 10) : 0;
    settings->time_limit = (flags & 0x30) == 0x30 ? 1e-3 : 0.0;
    if (flags & 64)
        settings->penalty = fuzz_pick(bytes, 10) * 0.1;
}

/* F and J at z with the sizes of their terms: of the linearisation too. */
static void check(const nonlinear *f, const perp_ncp_settings *settings,
                  const perp_ncp_result *result, const double *z, const double *w_given)
{
    wide w[MOST], t[MOST], dj, dk, value;
    double J[MOST * MOST];
    oracle_point point = {
        "ncp", f->n, result->outcome, settings->tol, J, f->lower, f->upper, z, w, t, f->z0, 0};
    int32_t i;

    for (i = 0; i < f->n; i++)
        if (!isfinite(z[i])) {
            if (fuzz_good(result->outcome))
                fuzz_finite("z", z, f->n);
            return;
        }
    oracle_multiply(f->n, f->n, oracle_wide(f->n * f->n, f->A), oracle_wide(f->n, z),
                    oracle_wide(f->n, f->b), w, t);
    for (i = 0; i < f->terms; i++) {
        const term *of = &f->list[i];

        value = term_wide(of, z, &dj, &dk);
        w[of->row] += value;
        t[of->row] += oracle_abs(value) + oracle_abs(dj * z[of->j]) + oracle_abs(dk * z[of->k]);
    }
    dense_jacobian(f, z, J);
    for (i = 0; i < f->n * f->n; i++)
        if (!isfinite(J[i]))
            return; /* there is no linear problem to judge z by: F alone speaks */
    oracle_check_point(&point);
    if (fuzz_good(result->outcome)) {
        fuzz_finite("w", w_given, f->n);
        for (i = 0; i < f->n; i++) /* 1e-13: F is evaluated in doubles, with at most 20 roundings */
            if (oracle_abs(w_given[i] - w[i]) > t[i] * (wide)1e-13 + (wide)1e-300)
                fuzz_fail("ncp: w = F(z): w[%d] = %g is %Lg", i, w_given[i], (long double)w[i]);
    }
    if (isnan(result->residual) && result->outcome != PERP_OUTCOME_EVALUATION_FAILED)
        fuzz_fail("ncp: the residual is a number with outcome '%s'",
                  perp_outcome_text(result->outcome));
    if (result->outcome == PERP_OUTCOME_SOLVED && !(result->residual <= settings->tol))
        fuzz_fail("ncp: 'solved' with tested residual %g", result->residual);
}

static void compare_jacobian(perp_context *context, nonlinear *f, const perp_ncp_problem *problem)
{
    perp_ncp_check *found = fuzz_take(1, sizeof *found);
    double z[MOST];
    int32_t i;

    for (i = 0; i < f->n; i++)
        z[i] = fmin(fmax(f->z0[i], f->lower[i]), f->upper[i]);
    if (perp_struct_init(found, sizeof *found) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (fuzz_status(context, perp_ncp_check_jacobian(context, found, problem, z),
                    "perp_ncp_check_jacobian") &&
        found->missing != 0)
        fuzz_fail("ncp: %d entries are missing in a full pattern", found->missing);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    perp_ncp_settings settings;
    perp_ncp_problem problem;
    perp_ncp_result *result = fuzz_take(1, sizeof *result), kept;
    nonlinear f = {0};
    double *z, *w;

    make_settings(&bytes, &settings);
    make(&bytes, &f);
    if (perp_struct_init(&problem, sizeof problem) != PERP_OK ||
        perp_struct_init(result, sizeof *result) != PERP_OK)
        fuzz_fail("the structs of perp/ncp.h take their own sizes");
    kept = *result;
    problem.n = f.n;
    problem.storage = f.storage;
    problem.column_starts = f.storage == PERP_STORAGE_CSC ? f.starts : NULL;
    problem.row_indices = f.storage == PERP_STORAGE_CSC ? f.rows : NULL;
    problem.function = function;
    problem.jacobian = fuzz_one_in(&bytes, 3) ? NULL : jacobian;
    problem.lower = f.lower;
    problem.upper = f.upper;
    problem.user = &f;
    z = fuzz_doubles(f.n);
    w = fuzz_doubles(f.n);
    fuzz_show("A", f.A, f.n * f.n);
    fuzz_show("b", f.b, f.n);
    fuzz_show("z0", f.z0, f.n);
    fuzz_show("z", z, f.n);
    if (fuzz_status_of(context,
                       perp_ncp_solve(context, z, w, result, &settings, &problem,
                                      fuzz_one_in(&bytes, 3) ? NULL : f.z0),
                       "perp_ncp_solve", (const void *[]){z, w, NULL}))
        check(&f, &settings, result, z, w);
    else if (memcmp(&kept, result, sizeof kept) != 0)
        fuzz_fail("a refusal leaves the result untouched");
    if (problem.jacobian && fuzz_one_in(&bytes, 4))
        compare_jacobian(context, &f, &problem);
    fuzz_close(context);
    return 0;
}
