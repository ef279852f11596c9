/* Compliant contacts of perp/friction.h, and the bristles of perp/bristle.h. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "fuzz.h"
#include "oracle.h"

#define MOST 4

/* The eigenvalues of Gamma sum to its trace, up to rounding beside its norm (1e-6: it may be far
 * from normal); those of the contacts are roots of l^2 + gamma (damping l + stiffness). */
static void check_eigenvalues(const perp_compliant_system *s, const wide *Gamma, wide size,
                              const perp_compliant_stability *stability, const double *gamma,
                              const double *eigenvalues)
{
    int32_t p = s->contacts, i, growing = 0;
    wide trace = 0, sum = 0;

    fuzz_finite("gamma", gamma, 2 * p);
    fuzz_finite("eigenvalues", eigenvalues, 4 * p);
    for (i = 0; i < p; i++) {
        trace += Gamma[i * p + i];
        sum += gamma[2 * i];
    }
    if (oracle_abs(sum - trace) > size * (wide)1e-6)
        fuzz_fail("compliant: eigenvalues sum to the trace: %Lg, %Lg", (long double)sum,
                  (long double)trace);
    for (i = 0; i < 2 * p; i++)
        growing |= eigenvalues[2 * i] > 0;
    if (growing && stability->stable)
        fuzz_fail("compliant: 'stable' with an eigenvalue that grows");
}

/* Gamma = normal mass^-1 (normal' + tangent' diag(mu slip load)), and the sum of the sizes of what
 * is added there */
static int make_gamma(const perp_compliant_system *s, const fuzz_matrix *matrices,
                      const int32_t *slip, const int32_t *load, wide *Gamma, wide *size)
{
    int32_t n = s->n, p = s->contacts, i, j, k, l;
    wide *M = oracle_wide(n * n, matrices[0].dense), *inverse = fuzz_take(n * n, sizeof *inverse);

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            inverse[i * n + j] = i == j;
    if (!oracle_solve(n, n, M, inverse))
        return 0;
    for (*size = 0, i = 0; i < p; i++)
        for (k = 0; k < p; k++)
            for (Gamma[i * p + k] = 0, j = 0; j < n; j++)
                for (l = 0; l < n; l++) {
                    const wide response = matrices[1].dense[i * n + j] * inverse[j * n + l];
                    const wide along = matrices[1].dense[k * n + l];
                    const wide across =
                        (wide)matrices[2].dense[k * n + l] * s->mu[k] * (slip[k] * load[k]);

                    Gamma[i * p + k] += response * (along + across);
                    *size += oracle_abs(response) * (oracle_abs(along) + oracle_abs(across));
                }
    return 1;
}

static void linearise(fuzz_bytes *bytes, perp_context *context, perp_compliant *compliant,
                      const perp_compliant_system *s, const fuzz_matrix *matrices, fuzz_mood mood)
{
    int32_t p = s->contacts, slip[MOST], load[MOST], i;
    double *gamma = fuzz_doubles(2 * p), *eigenvalues = fuzz_doubles(4 * p);
    wide *Gamma = fuzz_take(p * p, sizeof *Gamma), terms;
    perp_compliant_stability stability;

    for (i = 0; i < p; i++) {
        slip[i] = fuzz_pick(bytes, 3) - 1;
        load[i] = 1 - 2 * fuzz_pick(bytes, 2);
    }
    if (perp_struct_init(&stability, sizeof stability) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (fuzz_status_of(
            context,
            perp_compliant_linearise(compliant, &stability, gamma, eigenvalues, slip, load),
            "perp_compliant_linearise", (const void *[]){gamma, eigenvalues, NULL}) &&
        mood != FUZZ_HOSTILE && make_gamma(s, matrices, slip, load, Gamma, &terms))
        check_eigenvalues(s, Gamma, terms, &stability, gamma, eigenvalues);
}

/* 1e-6: events are found to a rounding of time, at which N and F may change fast. */
static void check_law(const perp_compliant_system *s, const perp_compliant_result *result,
                      const double *N)
{
    double largest = 0;

    for (int k = 0; k < s->contacts; k++)
        largest = fmax(largest, fabs(result->friction[k]));
    for (int k = 0; k < s->contacts; k++) {
        const int separate = result->modes[k] == PERP_CONTACT_SEPARATE;

        if (s->one_sided[k] ? N[k] < 0 : separate)
            fuzz_fail("compliant: contact %d pulls, or lets go of what holds it", k);
        if (separate && (N[k] != 0 || result->friction[k] != 0))
            fuzz_fail("compliant: contact %d is separate, and N = %g", k, N[k]);
        if (result->end == PERP_COMPLIANT_TIME &&
            fabs(result->friction[k]) > s->mu_static[k] * fabs(N[k]) + 1e-6 * largest)
            fuzz_fail("compliant: F = %g of contact %d where N = %g", result->friction[k], k, N[k]);
    }
}

static void run(fuzz_bytes *bytes, perp_context *context, perp_compliant *compliant,
                const perp_compliant_system *s, fuzz_mood mood)
{
    double *x = fuzz_doubles(s->n), *v = fuzz_doubles(s->n), *N = fuzz_doubles(s->contacts);
    double *x0 = fuzz_doubles(s->n), *v0 = fuzz_doubles(s->n);
    perp_compliant_settings settings;
    perp_compliant_result result;

    fuzz_numbers(bytes, mood, x0, s->n);
    fuzz_numbers(bytes, mood, v0, s->n);
    if (perp_compliant_settings_init(&settings, sizeof settings) != PERP_OK ||
        perp_struct_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("the structs of compliant contacts take their own sizes");
    settings.tol = fuzz_tol(bytes, settings.tol);
    settings.most_steps = 1 + fuzz_pick(bytes, 200);
    settings.through = fuzz_pick(bytes, 2);
    if (!fuzz_status_of(context,
                        perp_compliant_run(compliant, x, v, N, &result, &settings, x0, v0,
                                           fuzz_size(bytes, mood)),
                        "perp_compliant_run", (const void *[]){x, v, N, NULL}))
        return;
    if (result.end != PERP_COMPLIANT_FAILED) {
        fuzz_finite("x", x, s->n);
        fuzz_finite("v", v, s->n);
        fuzz_finite("N", N, s->contacts);
        check_law(s, &result, N);
    }
    if (isnan(result.t) || result.steps < 0 || result.steps > settings.most_steps)
        fuzz_fail("compliant: t = %g after %lld steps", result.t, (long long)result.steps);
}

static void compliant_contacts(fuzz_bytes *bytes, perp_context *context)
{
    perp_compliant_system s;
    perp_compliant *compliant = NULL;
    fuzz_mood mood = fuzz_mood_of(bytes);
    fuzz_matrix matrices[3];
    double force[MOST], mu[MOST], mu_static[MOST];
    int32_t one_sided[MOST];

    if (perp_struct_init(&s, sizeof s) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    s.n = 1 + fuzz_pick(bytes, MOST);
    s.contacts = 1 + fuzz_pick(bytes, MOST);
    fuzz_fill_definite(bytes, mood, &matrices[0], s.n, s.n);
    fuzz_fill(bytes, mood, &matrices[1], s.contacts, s.n);
    fuzz_fill(bytes, mood, &matrices[2], s.contacts, s.n);
    fuzz_numbers(bytes, mood, force, s.n);
    fuzz_numbers(bytes, FUZZ_MODERATE, mu, s.contacts);
    for (int k = 0; k < s.contacts; k++) {
        mu_static[k] = mu[k] * (1 + fuzz_pick(bytes, 2));
        one_sided[k] = fuzz_pick(bytes, 2);
    }
    s.mu_static = mu_static;
    s.one_sided = one_sided;
    s.mass = &matrices[0].view;
    s.normal = &matrices[1].view;
    s.tangent = &matrices[2].view;
    s.force = force;
    s.mu = mu;
    s.stiffness = fuzz_size(bytes, mood);
    s.damping = fabs(fuzz_number(bytes, mood));
    fuzz_show("mass", matrices[0].dense, s.n * s.n);
    fuzz_show("normal", matrices[1].dense, s.contacts * s.n);
    fuzz_show("tangent", matrices[2].dense, s.contacts * s.n);
    fuzz_show("mu", mu, s.contacts);
    if (fuzz_status(context, perp_compliant_create(context, &compliant, &s),
                    "perp_compliant_create")) {
        linearise(bytes, context, compliant, &s, matrices, mood);
        run(bytes, context, compliant, &s, mood);
    }
    perp_compliant_destroy(compliant);
}

/* Steady friction without viscosity lies between kinetic and breakaway; bristles never leave their
 * bounds. 1e-12: roundings of exp and some products. */
static void check_bristle(perp_context *context, const perp_bristle *law, double z, double v,
                          double h)
{
    double force = 0, slope = 0, next = 0;
    double high = law->breakaway > 0 ? law->breakaway : law->kinetic, most = high / law->stiffness;
    double extra = law->viscosity * fabs(v), size = high + extra;

    if (fuzz_status(context, perp_stribeck_force(context, &force, &slope, law, v), "stribeck") &&
        isfinite(size) &&
        (!isfinite(force) ||
         (v != 0 && (fabs(force) > size * (1 + 1e-12) || fabs(force) < law->kinetic * (1 - 1e-12) ||
                     (force > 0) != (v > 0)))))
        fuzz_fail("stribeck: the force is between kinetic and breakaway: %g, v = %g", force, v);
    if (fuzz_status(context, perp_lugre_step(context, &next, &force, &slope, law, z, v, h),
                    "perp_lugre_step")) {
        if (isnan(next) || isnan(force))
            fuzz_fail("lugre: a step gives numbers: z = %g, force = %g", next, force);
        if (isfinite(most) && fabs(z) <= most && fabs(next) > most * (1 + 1e-12) + DBL_MIN)
            fuzz_fail("lugre: |z| never leaves its bounds: %g, %g", next, most);
    }
}

static void bristles(fuzz_bytes *bytes, perp_context *context)
{
    fuzz_mood mood = fuzz_mood_of(bytes);
    perp_bristle law;
    int32_t passive = 0;

    if (perp_struct_init(&law, sizeof law) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    law.kinetic = fuzz_number(bytes, mood);
    law.breakaway = fuzz_one_in(bytes, 3) ? 0.0 : law.kinetic + fabs(fuzz_number(bytes, mood));
    law.speed = fuzz_number(bytes, mood);
    law.viscosity = fuzz_number(bytes, mood);
    law.stiffness = fuzz_number(bytes, mood);
    law.damping = fuzz_number(bytes, mood);
    check_bristle(context, &law, fuzz_number(bytes, mood), fuzz_number(bytes, mood),
                  fuzz_number(bytes, mood));
    if (fuzz_status(context, perp_lugre_passive(context, &passive, &law), "passive") &&
        passive != 0 && passive != 1)
        fuzz_fail("lugre: passive is %d", passive);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);

    if (fuzz_one_in(&bytes, 3))
        bristles(&bytes, context);
    else
        compliant_contacts(&bytes, context);
    fuzz_close(context);
    return 0;
}
