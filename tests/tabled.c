#include "tabled.h"

/* One array after a callback has written it. */
static void spoil(const tabled *r, int32_t array, double *x)
{
    if (r->array == array)
        x[r->entry] = r->value;
}

static int32_t called(tabled *r, int32_t callback)
{
    r->calls[callback]++;
    if (r->inside)
        r->inside(r, callback);
    return r->callback == callback ? r->answer : 0;
}

static int32_t mass(double *M, const double *q, void *user)
{
    tabled *r = user;
    const size_t n = (size_t)r->model.velocities;

    (void)q;
    memcpy(M, r->M, n * n * sizeof *M);
    spoil(r, TABLED_M, M);
    return called(r, TABLED_MASS);
}

static int32_t force(double *k, double t, const double *q, const double *v, void *user)
{
    tabled *r = user;

    (void)t;
    (void)q;
    (void)v;
    memcpy(k, r->k, (size_t)r->model.velocities * sizeof *k);
    spoil(r, TABLED_K, k);
    return called(r, TABLED_FORCE);
}

static int32_t dim_of(const tabled *r, int32_t j)
{
    return r->model.dims ? r->model.dims[j] : r->model.dim;
}

static double linear(const tabled *r, const double *row, double start, double drift, double t,
                     const double *q)
{
    double sum = start + drift * t;
    int32_t i;

    for (i = 0; i < r->model.velocities; i++)
        sum += row[i] * q[i];
    return sum;
}

static int32_t contacts(double *gap, double *H, double *drift, double *mu, double t,
                        const double *q, void *user)
{
    tabled *r = user;
    const int32_t n = r->model.velocities;
    int32_t j, row = 0;

    for (j = 0; j < r->model.contacts; j++) {
        gap[j] = linear(r, r->H + row * n, r->gap[j], r->drift[row], t, q);
        row += dim_of(r, j);
    }
    memcpy(H, r->H, (size_t)(row * n) * sizeof *H);
    memcpy(drift, r->drift, (size_t)row * sizeof *drift);
    spoil(r, TABLED_GAP, gap);
    spoil(r, TABLED_H, H);
    spoil(r, TABLED_DRIFT, drift);
    spoil(r, TABLED_MU, mu);
    return called(r, TABLED_CONTACTS);
}

static int32_t bilateral(double *c, double *G, double *drift, double t, const double *q, void *user)
{
    tabled *r = user;
    const int32_t n = r->model.velocities;
    int32_t j;

    for (j = 0; j < r->model.bilateral; j++)
        c[j] = linear(r, r->G + j * n, r->c[j], r->c_drift[j], t, q);
    memcpy(G, r->G, (size_t)(r->model.bilateral * n) * sizeof *G);
    memcpy(drift, r->c_drift, (size_t)r->model.bilateral * sizeof *drift);
    spoil(r, TABLED_C, c);
    spoil(r, TABLED_G, G);
    spoil(r, TABLED_C_DRIFT, drift);
    return called(r, TABLED_BILATERAL);
}

static int32_t dry(double *bound, double *B, double *drift, double t, const double *q,
                   const double *v, void *user)
{
    tabled *r = user;
    const size_t rows = (size_t)(r->model.dry * r->model.dry_dim);

    (void)t;
    (void)q;
    (void)v;
    memcpy(bound, r->bound, (size_t)r->model.dry * sizeof *bound);
    memcpy(B, r->B, rows * (size_t)r->model.velocities * sizeof *B);
    memcpy(drift, r->b_drift, rows * sizeof *drift);
    spoil(r, TABLED_BOUND, bound);
    spoil(r, TABLED_B, B);
    spoil(r, TABLED_B_DRIFT, drift);
    return called(r, TABLED_DRY);
}

static int32_t kinematics(double *rate, const double *q, const double *v, void *user)
{
    tabled *r = user;

    (void)q;
    memcpy(rate, v, (size_t)r->model.velocities * sizeof *rate);
    spoil(r, TABLED_RATE, rate);
    return called(r, TABLED_KINEMATICS);
}

static int32_t normalise(double *q, void *user)
{
    tabled *r = user;

    spoil(r, TABLED_Q, q);
    return called(r, TABLED_NORMALISE);
}

void tabled_make(tabled *r, int32_t n, int32_t contact_count, int32_t dim)
{
    int32_t i;

    assert_true(n <= TABLED_N);
    memset(r, 0, sizeof *r);
    assert_int_equal(perp_mechanism_model_init(&r->model, sizeof r->model), PERP_OK);
    assert_int_equal(perp_mechanism_settings_init(&r->settings, sizeof r->settings), PERP_OK);
    assert_int_equal(perp_struct_init(&r->step, sizeof r->step), PERP_OK);
    r->model.velocities = n;
    r->model.contacts = contact_count;
    r->model.dim = dim;
    r->model.mu = r->mu;
    r->model.mu_static = NULL;
    r->model.restitution = r->restitution;
    r->model.mass = mass;
    r->model.force = force;
    r->model.contact_rows = contacts;
    r->model.bilateral_rows = bilateral;
    r->model.dry_rows = dry;
    r->model.user = r;
    for (i = 0; i < n; i++)
        r->M[i * (n + 1)] = 1.0;
}

void tabled_make_everything(tabled *r)
{
    static const double H[] = {0, 0, 1, 0, 0, /**/ 1, 0, 0,      0, 0, /**/ 0, 1, 0,
                               0, 0, 0, 1, 0, 0,      0, /**/ 1, 0, 0, 0,      0};
    int32_t i;

    tabled_make(r, 5, 2, 2);
    r->dims[0] = 3;
    r->dims[1] = 2;
    r->model.dims = r->dims;
    r->model.mu_static = r->mu_static;
    r->model.stribeck = r->stribeck;
    memcpy(r->H, H, sizeof H);
    r->gap[1] = 1.0;
    r->mu[0] = 0.5;
    r->mu_static[0] = 0.6;
    for (i = 0; i < 5; i++)
        r->M[i * 6] = i + 1.0;
    r->M[1] = r->M[5] = 0.25;
    r->k[2] = -9.81;
    r->k[4] = 3.0;
    r->model.bilateral = 1;
    r->G[3] = 1.0;
    r->model.dry = 1;
    r->B[4] = 1.0;
    r->bound[0] = 1.0;
    r->model.kinematics = kinematics;
    r->model.normalise = normalise;
    r->v[0] = 2.0;
}

void tabled_open(tabled *r)
{
    assert_int_equal(perp_context_create(&r->context, NULL), PERP_OK);
    if (perp_mechanism_create(r->context, &r->mechanism, &r->settings, &r->model) != PERP_OK)
        fail_msg("create: %s", perp_context_message(r->context));
}

void tabled_close(tabled *r)
{
    perp_mechanism_destroy(r->mechanism);
    perp_context_destroy(r->context);
}

perp_status tabled_try(tabled *r, double h)
{
    return perp_mechanism_advance(r->mechanism, r->q, r->v, r->impulse, r->velocity, r->modes,
                                  r->ray, &r->step, START(0.0, h, r->q, r->v));
}

int32_t tabled_advance(tabled *r, double h)
{
    if (tabled_try(r, h) != PERP_OK)
        fail_msg("step: %s", perp_context_message(r->context));
    return r->step.outcome;
}

double tabled_energy(const tabled *r, const double *v)
{
    const int32_t n = r->model.velocities;
    double energy = 0.0;
    int32_t i, k;

    for (i = 0; i < n; i++)
        for (k = 0; k < n; k++)
            energy += r->M[i * n + k] * v[i] * v[k] / 2.0;
    return energy;
}

void tabled_near(double value, double expected, double tolerance, const char *what)
{
    if (!(fabs(value - expected) <= tolerance * fmax(1.0, fabs(expected))))
        fail_msg("%s is %.17g, expected %.17g", what, value, expected);
}

void tabled_zero(double value, const char *what)
{
    if (value != 0.0 || signbit(value))
        fail_msg("%s is %.17g, expected 0.0", what, value);
}

void tabled_says(const tabled *r, const char *text)
{
    if (!strstr(perp_context_message(r->context), text))
        fail_msg("'%s' does not say '%s'", perp_context_message(r->context), text);
}
