/* perp/friction.h: accelerations of a torque, uniqueness, the inverse, a step, one after the other
 * on one handle. What is found solves the equations; with small integers nothing is left out. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "../rational.h"
#include "fuzz.h"
#include "oracle.h"

#define MOST 5

typedef struct load_problem {
    int32_t n;
    fuzz_mood mood;
    fuzz_matrix A, C, S;
    double b[MOST], d[MOST], mu[MOST], mu_static[MOST], tau[MOST], velocity[MOST];
    perp_load_system system;
} load_problem;

static void make(fuzz_bytes *bytes, load_problem *p)
{
    int32_t i, n = p->n = 1 + fuzz_pick(bytes, MOST);
    uint8_t flags = fuzz_byte(bytes);

    p->mood = fuzz_mood_of(bytes);
    fuzz_fill_definite(bytes, p->mood, &p->A, n, n);
    fuzz_fill(bytes, p->mood, &p->C, n, n);
    fuzz_fill_definite(bytes, p->mood, &p->S, n, 1);
    fuzz_numbers(bytes, p->mood, p->b, n);
    fuzz_numbers(bytes, p->mood, p->d, n);
    fuzz_numbers(bytes, p->mood, p->tau, n);
    for (i = 0; i < n; i++) {
        p->mu[i] = fuzz_pick(bytes, 9) * 0.25;
        p->mu_static[i] = p->mu[i] + (flags & 1 ? fuzz_pick(bytes, 3) * 0.25 : 0);
        p->velocity[i] = fuzz_pick(bytes, 3) - 1;
    }
    if (perp_load_system_init(&p->system, sizeof p->system) != PERP_OK)
        fuzz_fail("perp_load_system_init takes its own size");
    p->system.n = n;
    p->system.A = &p->A.view;
    p->system.C = &p->C.view;
    p->system.b = flags & 2 ? NULL : p->b;
    p->system.d = flags & 4 ? NULL : p->d;
    p->system.mu = p->mu;
    p->system.mu_static = flags & 1 ? p->mu_static : NULL;
    p->system.normal_inertia = flags & 8 ? &p->S.view : NULL;
    if (flags & 2)
        memset(p->b, 0, sizeof p->b);
    if (flags & 4)
        memset(p->d, 0, sizeof p->d);
    fuzz_show("A", p->A.dense, n * n);
    fuzz_show("C", p->C.dense, n * n);
    fuzz_show("b", p->b, n);
    fuzz_show("d", p->d, n);
    fuzz_show("mu", p->mu, n);
    fuzz_show("mu_static", p->mu_static, n);
    fuzz_show("tau", p->tau, n);
    fuzz_show("velocity", p->velocity, n);
}

/* The equation of motion with f as told, and the law of friction at its normal force. 1e-6: an
 * answer is one for data changed by tol = 1e-13 relatively, to which C adds its condition. */
static void check_motion(const char *where, const load_problem *p, const double *x,
                         const double *normal, const double *f, const double *tau)
{
    int32_t n = p->n, i, j;
    wide *N = fuzz_take(n, sizeof *N), *t = fuzz_take(n, sizeof *t);

    fuzz_finite(where, x, n);
    oracle_multiply(n, n, oracle_wide(n * n, p->C.dense), oracle_wide(n, x), oracle_wide(n, p->d),
                    N, t);
    for (i = 0; i < n; i++) {
        wide sum = (wide)p->b[i] + f[i] - tau[i], size = fabs(p->b[i]) + fabs(tau[i]);
        wide bound = p->mu_static[i] * (oracle_abs(N[i]) + (wide)1e-6 * t[i]);

        for (j = 0; j < n; j++) {
            sum += (wide)p->A.dense[i * n + j] * x[j];
            size += oracle_abs((wide)p->A.dense[i * n + j] * x[j]);
        }
        size += oracle_abs(f[i]) + p->mu_static[i] * t[i]; /* what f is computed from */
        if (oracle_abs(sum) > size * (wide)1e-6 + DBL_MIN)
            fuzz_fail("%s: A q'' + b + f = tau: row %d is off by %Lg of %Lg", where, i,
                      (long double)sum, (long double)size);
        if (oracle_abs(normal[i] - N[i]) > t[i] * (wide)1e-6 + DBL_MIN) /* the grid of denormals */
            fuzz_fail("%s: N = C q'' + d: N[%d] = %g is %Lg", where, i, normal[i],
                      (long double)N[i]);
        if (oracle_abs(f[i]) > bound + size * (wide)1e-6 + (wide)0x1p-1074)
            fuzz_fail("%s: |f| <= mu |N|: f[%d] = %g, %Lg", where, i, f[i], (long double)bound);
    }
}

static void check_answers(perp_context *context, perp_load_friction *handle, const load_problem *p,
                          const double *tau, int32_t count)
{
    perp_load_found found;
    int32_t k, mark;

    for (k = 0; k < count; k++) {
        mark = fuzz_mark();
        if (perp_struct_init(&found, sizeof found) != PERP_OK ||
            !fuzz_status(context, perp_load_friction_get(handle, &found, k), "get"))
            fuzz_fail("load_friction: answer %d of %d can be had", k, count);
        fuzz_show("acceleration", found.acceleration, p->n);
        fuzz_show("friction", found.friction, p->n);
        check_motion("load_friction", p, found.acceleration, found.normal_force, found.friction,
                     tau);
        if (found.dimension == 0 && isnan(found.residual))
            fuzz_fail("load_friction: the residual is a number");
        fuzz_drop_to(mark);
    }
}

/* In motion each pattern of signs of N is a linear system (A + diag(mu s v) C) x = tau - b - ...;
 * with integers and mu in quarters it is one of integers. Answers with N_i != 0 must be found. */
static int64_t pattern(const load_problem *p, unsigned signs, int64_t *x)
{
    int64_t T[MOST * MOST], right[MOST], denominator;
    int32_t n = p->n, i, j;

    for (i = 0; i < n; i++) {
        int64_t s = ((signs >> i & 1u) == (p->velocity[i] > 0) ? 1 : -1) * (int64_t)(4 * p->mu[i]);

        for (j = 0; j < n; j++)
            T[i * n + j] = 4 * (int64_t)p->A.dense[i * n + j] + s * (int64_t)p->C.dense[i * n + j];
        right[i] = 4 * (int64_t)(p->tau[i] - p->b[i]) - s * (int64_t)p->d[i];
    }
    denominator = rational_solve(n, T, right, x);
    for (i = 0; i < n && denominator > 0; i++) {
        int64_t N = (int64_t)p->d[i] * denominator;

        for (j = 0; j < n; j++)
            N += (int64_t)p->C.dense[i * n + j] * x[j];
        if (signs >> i & 1u ? N <= 0 : N >= 0)
            return 0;
    }
    return denominator;
}

static int is_among(perp_load_friction *handle, int32_t n, int32_t count, const int64_t *x,
                    int64_t denominator)
{
    perp_load_found found;
    int32_t k, i, same = 0;

    for (k = 0; k < count && !same; k++) {
        if (perp_struct_init(&found, sizeof found) != PERP_OK ||
            perp_load_friction_get(handle, &found, k) != PERP_OK)
            return 0;
        /* 1e-6: blocks of small integers; a family may stand for its members */
        for (same = 1, i = 0; i < n && found.dimension == 0; i++) {
            double exact = (double)x[i] / (double)denominator;

            same = same && fabs(found.acceleration[i] - exact) <= 1e-6 * (1 + fabs(exact));
        }
    }
    return same;
}

static void check_complete(perp_load_friction *handle, const load_problem *p, int32_t count)
{
    int64_t x[RATIONAL_LARGEST], denominator;
    unsigned signs;
    int32_t i, whole = p->mood == FUZZ_INTEGERS && p->n <= 3;

    for (i = 0; i < p->n; i++)
        whole = whole && p->velocity[i] != 0;
    for (i = 0; i < p->n * p->n; i++)
        whole = whole && p->A.dense[i] == rint(p->A.dense[i]);
    for (signs = 0; whole && signs < 1u << p->n; signs++) {
        denominator = pattern(p, signs, x);
        if (denominator > 0 && !is_among(handle, p->n, count, x, denominator))
            fuzz_fail("load_friction: exhaustive, but the answer of signs %u is not among the %d",
                      signs, count);
    }
}

static void ask(fuzz_bytes *bytes, perp_context *context, perp_load_friction *handle,
                load_problem *p)
{
    double *tau = fuzz_doubles(MOST), *next = fuzz_doubles(MOST), *normal = fuzz_doubles(MOST);
    perp_load_summary summary;
    perp_load_uniqueness uniqueness;
    perp_load_inverse inverse;
    perp_load_step step;
    double h = pow(2, -fuzz_pick(bytes, 20));

    if (perp_struct_init(&summary, sizeof summary) != PERP_OK ||
        perp_struct_init(&uniqueness, sizeof uniqueness) != PERP_OK ||
        perp_struct_init(&inverse, sizeof inverse) != PERP_OK ||
        perp_struct_init(&step, sizeof step) != PERP_OK)
        fuzz_fail("the structs of perp/friction.h take their own sizes");
    switch (fuzz_pick(bytes, 4)) {
    case 0:
        if (!fuzz_status(context, perp_load_friction_solve(handle, &summary, p->tau, p->velocity),
                         "perp_load_friction_solve"))
            return;
        check_answers(context, handle, p, p->tau, summary.count);
        if (summary.exhaustive)
            check_complete(handle, p, summary.count);
        break;
    case 1:
        if (fuzz_status(
                context,
                perp_load_friction_uniqueness(handle, &uniqueness, h < 0.5 ? p->velocity : NULL),
                "perp_load_friction_uniqueness") &&
            isnan(uniqueness.margin))
            fuzz_fail("load_friction: the margin is a number");
        break;
    case 2:
        if (fuzz_status_of(context,
                           perp_load_friction_inverse(handle, tau, &inverse, p->velocity, p->tau),
                           "perp_load_friction_inverse", (const void *[]){tau, NULL}))
            fuzz_finite("tau", tau, p->n);
        break;
    default:
        if (fuzz_status_of(
                context,
                perp_load_friction_step(handle, next, normal, &step, p->tau, p->velocity, NULL, h),
                "perp_load_friction_step", (const void *[]){next, normal, NULL})) {
            fuzz_finite("next", next, p->n);
            check_answers(context, handle, p, p->tau, step.answers);
            memcpy(p->velocity, next, (size_t)p->n * sizeof *next);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    perp_load_friction *handle = NULL;
    perp_load_settings settings;
    load_problem p;
    int32_t times;

    memset(&p, 0, sizeof p);
    make(&bytes, &p);
    if (perp_load_settings_init(&settings, sizeof settings) != PERP_OK)
        fuzz_fail("perp_load_settings_init takes its own size");
    if (fuzz_one_in(&bytes, 4)) {
        settings.most_patterns = 1 + fuzz_pick(&bytes, 64);
        settings.starts = 1 + fuzz_pick(&bytes, 4);
    }
    times = 1 + fuzz_pick(&bytes, 4);
    if (fuzz_status(context, perp_load_friction_create(context, &handle, &settings, &p.system),
                    "perp_load_friction_create"))
        while (times-- > 0) {
            int mark = fuzz_mark();

            ask(&bytes, context, handle, &p);
            fuzz_drop_to(mark);
        }
    perp_load_friction_destroy(handle);
    fuzz_close(context);
    return 0;
}
