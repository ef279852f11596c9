/* perp/mechanism.h: a step of every scheme, runs with equal and chosen steps, all accelerations,
 * all answers, on one handle. Linear forces; gaps with a curvature; bilateral and dry rows. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "fuzz.h"
#include "oracle.h"

#define MOST 4     /* velocities */
#define CONTACTS 3 /* and rows of each of the three kinds */
#define ROWS (3 * CONTACTS + 2 + 2)

typedef struct machine {
    int32_t n, rows, contact_rows, dims[CONTACTS], calls, abort_at, answers;
    double M[MOST * MOST], k[MOST], K[MOST * MOST], D[MOST * MOST];
    double H[ROWS * MOST], gap[CONTACTS], curvature[CONTACTS], drift[ROWS], c[2], bound[2];
    double mu[CONTACTS], mu_static[CONTACTS], restitution[CONTACTS];
    double q[MOST], v[MOST];
    perp_mechanism_model model;
} machine;

/* Every callback may fail, in either way, at a call of the bytes' choice. */
static int32_t asked(machine *m)
{
    return m->calls++ == m->abort_at ? m->answers : 0;
}

static int32_t mass(double *M, const double *q, void *user)
{
    machine *m = user;

    (void)q;
    memcpy(M, m->M, (size_t)(m->n * m->n) * sizeof *M);
    return asked(m);
}

static int32_t force(double *k, double t, const double *q, const double *v, void *user)
{
    machine *m = user;
    int32_t i, j;

    (void)t;
    for (i = 0; i < m->n; i++)
        for (k[i] = m->k[i], j = 0; j < m->n; j++)
            k[i] += m->K[i * m->n + j] * q[j] + m->D[i * m->n + j] * v[j];
    return asked(m);
}

/* gap = g + H_n q + curvature |q|^2 / 2 */
static int32_t contact_rows(double *gap, double *H, double *drift, double *mu, double t,
                            const double *q, void *user)
{
    machine *m = user;
    int32_t i, j, row = 0, n = m->n;

    (void)mu;
    memcpy(H, m->H, (size_t)(m->contact_rows * n) * sizeof *H);
    memcpy(drift, m->drift, (size_t)m->contact_rows * sizeof *drift);
    for (i = 0; i < m->model.contacts; row += m->dims[i++])
        for (gap[i] = m->gap[i] + m->drift[row] * t, j = 0; j < n; j++) {
            gap[i] += m->H[row * n + j] * q[j] + m->curvature[i] * q[j] * q[j] / 2;
            H[row * n + j] += m->curvature[i] * q[j];
        }
    return asked(m);
}

static int32_t bilateral_rows(double *c, double *G, double *drift, double t, const double *q,
                              void *user)
{
    machine *m = user;
    int32_t i, j, first = m->contact_rows;

    (void)t;
    (void)drift;
    memcpy(G, &m->H[first * m->n], (size_t)(m->model.bilateral * m->n) * sizeof *G);
    for (i = 0; i < m->model.bilateral; i++)
        for (c[i] = m->c[i], j = 0; j < m->n; j++)
            c[i] += m->H[(first + i) * m->n + j] * q[j];
    return asked(m);
}

static int32_t dry_rows(double *bound, double *B, double *drift, double t, const double *q,
                        const double *v, void *user)
{
    machine *m = user;
    int32_t first = m->contact_rows + m->model.bilateral, rows = m->model.dry * m->model.dry_dim;

    (void)t;
    (void)q;
    (void)v;
    memcpy(bound, m->bound, (size_t)m->model.dry * sizeof *bound);
    memcpy(B, &m->H[first * m->n], (size_t)(rows * m->n) * sizeof *B);
    memcpy(drift, &m->drift[first], (size_t)rows * sizeof *drift);
    return asked(m);
}

static void make_numbers(fuzz_bytes *bytes, machine *m, uint8_t flags)
{
    fuzz_mood mood = fuzz_mood_of(bytes);
    fuzz_matrix M;
    int32_t i;

    fuzz_fill_definite(bytes, mood, &M, m->n, m->n);
    memcpy(m->M, M.dense, (size_t)(m->n * m->n) * sizeof *m->M);
    fuzz_numbers(bytes, mood, m->k, m->n);
    if (flags & 1)
        fuzz_numbers(bytes, mood, m->K, m->n * m->n);
    if (flags & 2)
        fuzz_numbers(bytes, mood, m->D, m->n * m->n);
    fuzz_numbers(bytes, mood == FUZZ_WIDE ? FUZZ_MODERATE : mood, m->H, m->rows * m->n);
    if (flags & 4)
        fuzz_numbers(bytes, mood, m->drift, m->rows);
    fuzz_numbers(bytes, mood, m->q, m->n);
    fuzz_numbers(bytes, mood, m->v, m->n);
    fuzz_numbers(bytes, mood, m->c, 2);
    for (i = 0; i < 2; i++)
        m->bound[i] = fuzz_pick(bytes, 5) * 0.5;
    for (i = 0; i < CONTACTS; i++) {
        m->gap[i] = fuzz_one_in(bytes, 2) ? 0.0 : fuzz_number(bytes, mood);
        m->mu[i] = fuzz_pick(bytes, 9) * 0.25;
        m->mu_static[i] = m->mu[i] + (flags & 8 ? fuzz_pick(bytes, 3) * 0.25 : 0);
        m->restitution[i] = flags & 16 ? fuzz_pick(bytes, 5) * 0.25 : 0;
        m->curvature[i] = flags & 32 ? fuzz_number(bytes, mood) : 0;
    }
}

static void make(fuzz_bytes *bytes, machine *m)
{
    uint8_t flags = fuzz_byte(bytes);
    perp_mechanism_model *model = &m->model;
    int32_t i;

    if (perp_mechanism_model_init(model, sizeof *model) != PERP_OK)
        fuzz_fail("perp_mechanism_model_init takes its own size");
    m->n = model->velocities = 1 + fuzz_pick(bytes, MOST);
    model->contacts = fuzz_pick(bytes, CONTACTS + 1);
    for (i = 0; i < model->contacts; i++)
        m->contact_rows += m->dims[i] = 1 + fuzz_pick(bytes, 3);
    model->bilateral = flags & 64 ? fuzz_pick(bytes, 3) : 0;
    model->dry = flags & 128 ? fuzz_pick(bytes, 2) : 0;
    model->dry_dim = 1 + fuzz_pick(bytes, 2);
    m->rows = m->contact_rows + model->bilateral + model->dry * model->dry_dim;
    make_numbers(bytes, m, flags);
    m->abort_at = fuzz_one_in(bytes, 16) ? fuzz_pick(bytes, 64) : -1;
    m->answers = fuzz_pick(bytes, 2) ? 1 : -1;
    model->dims = m->dims;
    model->mu = m->mu;
    model->mu_static = flags & 8 ? m->mu_static : NULL;
    model->restitution = flags & 16 ? m->restitution : NULL;
    model->mass = mass;
    model->force = force;
    model->contact_rows = contact_rows;
    model->bilateral_rows = bilateral_rows;
    model->dry_rows = dry_rows;
    model->user = m;
    fuzz_show("M", m->M, m->n * m->n);
    fuzz_show("k", m->k, m->n);
    fuzz_show("H", m->H, m->rows * m->n);
    fuzz_show("gap", m->gap, model->contacts);
    fuzz_show("mu", m->mu, model->contacts);
    fuzz_show("drift", m->drift, m->rows);
    fuzz_show("bound", m->bound, model->dry);
    fuzz_show("q", m->q, m->n);
    fuzz_show("v", m->v, m->n);
}

static int32_t make_laws(const machine *m, double h, oracle_law *law)
{
    int32_t i, row = 0, count = 0, dry = m->model.dry, rows = m->model.dry_dim;

    for (i = 0; i < m->model.contacts; row += m->dims[i++]) {
        law[count++] = (oracle_law){ORACLE_NORMAL, row, 1, -1, 0, row, m->dims[i], 0, 0, 0, 0};
        if (m->dims[i] > 1)
            law[count++] = (oracle_law){ORACLE_FRICTION,
                                        row + 1,
                                        m->dims[i] - 1,
                                        row,
                                        m->mu[i],
                                        row,
                                        m->dims[i],
                                        0,
                                        0,
                                        0,
                                        0};
    }
    for (i = 0; i < m->model.bilateral; i++, row++)
        law[count++] = (oracle_law){ORACLE_BILATERAL, row, 1, -1, 0, row, 1, 0, 0, 0, 0};
    for (i = 0; i < dry; i++, row += rows)
        law[count++] =
            (oracle_law){ORACLE_FRICTION, row, rows, -1, m->bound[i] * h, row, rows, 0, 0, 0, 0};
    return count;
}

/* What rounding M v0, an entry of which may cancel, makes of u = H v: 4 eps |H| |M^-1| |M| |v0|. */
static void add_momentum(const machine *m, const double *H, const double *v0, double limit, wide *t)
{
    int32_t n = m->n, i, j, k;
    wide *M = oracle_wide(n * n, m->M), *inverse = fuzz_take(n * n, sizeof *inverse);
    wide *size = fuzz_take(n, sizeof *size);

    for (i = 0; i < n; i++)
        for (size[i] = 0, j = 0; j < n; j++) {
            inverse[i * n + j] = i == j;
            size[i] += oracle_abs((wide)m->M[i * n + j] * v0[j]);
        }
    if (!oracle_solve(n, n, M, inverse))
        return;
    for (i = 0; i < m->rows; i++)
        for (k = 0; k < n; k++)
            for (j = 0; j < n; j++)
                t[i] += 4 * DBL_EPSILON / limit * oracle_abs(H[i * n + k] * inverse[k * n + j]) *
                        size[j];
}

/* W and q of the frozen problem from (0, q0, v0), and the sizes of the terms of u at impulses r. */
static int reduce(machine *m, double h, const double *q0, const double *v0, const double *r,
                  double limit, wide *W, wide *q, wide *t)
{
    int32_t n = m->n, rows = m->rows, i, j, k, row = 0;
    double gap[CONTACTS], H[ROWS * MOST], drift[ROWS], F[MOST];
    wide *M = oracle_wide(n * n, m->M), *X = fuzz_take(n * (rows + 1), sizeof *X);

    m->abort_at = -1;
    memcpy(H, m->H, sizeof H);
    memcpy(drift, m->drift, sizeof drift);
    memset(&drift[m->contact_rows], 0, (size_t)m->model.bilateral * sizeof *drift);
    contact_rows(gap, H, drift, NULL, 0.0, q0, m);
    force(F, 0.0, q0, v0, m);
    for (j = 0; j < n; j++) {
        for (i = 0; i < rows; i++)
            X[j * (rows + 1) + i] = H[i * n + j];
        X[j * (rows + 1) + rows] = h * (wide)F[j];
        if (!isfinite(F[j]))
            return 0;
    }
    if (!oracle_solve(n, rows + 1, M, X))
        return 0;
    for (i = 0; i < rows; i++)
        for (t[i] = oracle_abs(q[i] = drift[i]), j = 0; j <= rows; j++) {
            wide sum = 0, size = 0;

            for (k = 0; k < n; k++) {
                sum += H[i * n + k] * X[k * (rows + 1) + j];
                size += oracle_abs(H[i * n + k] * X[k * (rows + 1) + j]);
            }
            for (k = 0; j == rows && k < n;
                 k++) { /* H (v0 + h M^-1 k): rounded before it cancels */
                sum += (wide)H[i * n + k] * v0[k];
                size += oracle_abs((wide)H[i * n + k] * v0[k]);
            }
            *(j < rows ? &W[i * rows + j] : &q[i]) = j < rows ? sum : q[i] + sum;
            t[i] += j < rows ? size * oracle_abs(r[j]) : size;
        }
    for (i = 0; i < m->model.contacts; row += m->dims[i++]) {
        q[row] += gap[i] > 0 ? gap[i] / (wide)h : 0;
        t[row] += gap[i] > 0 ? gap[i] / (wide)h : 0;
        for (k = 0; k < n; k++) /* a gap that is rounding of q counts as 0 */
            t[row] += 16 * DBL_EPSILON / limit * oracle_abs(H[row * n + k] * (wide)q0[k]) / h;
    }
    add_momentum(m, H, v0, limit, t);
    return 1;
}

/* The laws of a frozen step without restitution and with one coefficient of friction. */
static void check_frozen(machine *m, const perp_mechanism_settings *settings,
                         const perp_mechanism_step *step, double h, const double *q0,
                         const double *v0, const double *r)
{
    wide W[ROWS * ROWS], q[ROWS], t[ROWS];
    oracle_law law[ROWS];
    oracle_contacts contacts = {
        "mechanism", m->rows, make_laws(m, h, law), step->outcome, settings->tol, W, q, t, law,
        r,           NULL};
    int32_t i;

    if (m->model.mu_static || m->model.restitution || step->scheme != PERP_MECHANISM_FROZEN ||
        settings->scheme != PERP_MECHANISM_FROZEN)
        return;
    for (i = 0; settings->cone && i < contacts.laws; i++)
        law[i].polyhedral = law[i].rows == 2;
    for (i = 0; i < m->rows; i++)
        if (!isfinite(r[i]))
            return;
    if (reduce(m, h, q0, v0, r, oracle_limit(step->outcome, settings->tol), W, q, t))
        oracle_check_contacts(&contacts);
}

static void advance(fuzz_bytes *bytes, perp_context *context, perp_mechanism *mechanism, machine *m,
                    const perp_mechanism_settings *settings, double h)
{
    double *q = fuzz_doubles(m->n), *v = fuzz_doubles(m->n), *r = fuzz_doubles(m->rows);
    double *u = fuzz_doubles(m->rows), *ray = fuzz_doubles(m->rows);
    int32_t *modes = fuzz_take(m->model.contacts + m->model.dry, sizeof *modes);
    perp_mechanism_step step;

    (void)bytes;
    if (perp_struct_init(&step, sizeof step) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_status_of(context,
                        perp_mechanism_advance(mechanism, q, v, r, u, modes, ray, &step,
                                               START(0.0, h, m->q, m->v)),
                        "perp_mechanism_advance", (const void *[]){q, v, r, u, modes, ray, NULL}))
        return;
    fuzz_show("step", &h, 1);
    fuzz_show("impulse", r, m->rows);
    if (step.has_ray != !fuzz_untouched(ray))
        fuzz_fail("a ray is written if and only if has_ray is 1");
    if (fuzz_good(step.outcome)) {
        fuzz_finite("q", q, m->n);
        fuzz_finite("v", v, m->n);
        fuzz_finite("impulse", r, m->rows);
        fuzz_finite("velocity", u, m->rows);
        check_frozen(m, settings, &step, h, m->q, m->v, r);
    }
    memcpy(m->q, q, (size_t)m->n * sizeof *q);
    memcpy(m->v, v, (size_t)m->n * sizeof *v);
}

static int32_t observe(const perp_mechanism_view *view, void *user)
{
    machine *m = user;

    if (view->h > 0 && fuzz_good(view->step->outcome)) {
        fuzz_finite("q", view->q, m->n);
        fuzz_finite("v", view->v, m->n);
    }
    return 0;
}

static void run(perp_context *context, perp_mechanism *mechanism, machine *m, double h)
{
    double *q = fuzz_doubles(m->n), *v = fuzz_doubles(m->n);
    perp_mechanism_run_result result;

    if (perp_struct_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_status_of(context,
                        perp_mechanism_run(mechanism, q, v, &result, START(0.0, h, m->q, m->v),
                                           5 * h, observe, m),
                        "perp_mechanism_run", (const void *[]){q, v, NULL}))
        return;
    if (fuzz_good(result.outcome)) {
        fuzz_finite("q", q, m->n);
        fuzz_finite("v", v, m->n);
        if (!(fabs(result.t - 5 * h) <= 1e-12 * 5 * h))
            fuzz_fail("mechanism: '%s' after t = %g of %g", perp_outcome_text(result.outcome),
                      result.t, 5 * h);
    }
}

/* M a = k + H'f (1e-6: an answer of enumeration, of blocks with pivots above 1e-11 of their rows),
 * f_n >= 0, |f_t| <= mu f_n. */
static void check_found(machine *m, const perp_mechanism_found *found)
{
    double F[MOST], gap[CONTACTS], H[ROWS * MOST], drift[ROWS];
    int32_t n = m->n, i, j, row = 0;
    wide most = 0;

    memcpy(H, m->H, sizeof H);
    memcpy(drift, m->drift, sizeof drift);
    m->abort_at = -1;
    contact_rows(gap, H, drift, NULL, 0.0, m->q, m);
    force(F, 0.0, m->q, m->v, m);
    fuzz_finite("acceleration", found->acceleration, n);
    fuzz_finite("force", found->force, m->rows);
    for (i = 0; i < n; i++) {
        wide sum = -(wide)F[i], size = oracle_abs(sum);
        wide grain = n * (wide)0x1p-1074; /* where doubles end, products too */

        for (j = 0; j < n + m->rows; j++) {
            const wide entry = j < n ? (wide)m->M[i * n + j] : (wide)H[(j - n) * n + i];
            wide x = j < n ? entry * found->acceleration[j] : -entry * found->force[j - n];

            sum += x;
            size += oracle_abs(x);
            grain += oracle_abs(entry) * (wide)0x1p-1074;
        }
        most = size > most ? size : most;
        if (oracle_abs(sum) > (size + most) * (wide)1e-6 + grain)
            fuzz_fail("mechanism: M v' = k + H'f: row %d is off by %Lg of %Lg", i, (long double)sum,
                      (long double)size);
    }
    for (i = 0; i < m->model.contacts; row += m->dims[i++])
        if (!(found->force[row] >= 0))
            fuzz_fail("mechanism: f_n >= 0: contact %d has %g", i, found->force[row]);
}

/* Of a model whose H is that of its gaps nothing may be said; any numbers may be given. */
static void check(perp_context *context, perp_mechanism *mechanism, machine *m)
{
    perp_mechanism_check_result result;

    if (perp_struct_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    fuzz_status(context, perp_mechanism_check(mechanism, &result, 0.0, m->q, m->v),
                "perp_mechanism_check");
}

static void enumerate(perp_context *context, perp_mechanism *mechanism, machine *m, double h)
{
    perp_mechanism_summary summary;
    perp_mechanism_found found;
    int32_t k;
    perp_status status;

    if (perp_struct_init(&summary, sizeof summary) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    status = h > 0 ? perp_mechanism_answers(mechanism, &summary, 0.0, h, m->q, m->v)
                   : perp_mechanism_accelerations(mechanism, &summary, 0.0, m->q, m->v);
    if (!fuzz_status(context, status, "the accelerations of a mechanism"))
        return;
    for (k = 0; k < summary.count; k++) {
        int mark = fuzz_mark();

        if (perp_struct_init(&found, sizeof found) != PERP_OK ||
            perp_mechanism_get_acceleration(mechanism, &found, k) != PERP_OK)
            fuzz_fail("mechanism: answer %d of %d can be had", k, summary.count);
        check_found(m, &found);
        fuzz_drop_to(mark);
    }
}

static void make_settings(fuzz_bytes *bytes, perp_mechanism_settings *settings)
{
    uint8_t flags = fuzz_byte(bytes);

    if (perp_mechanism_settings_init(settings, sizeof *settings) != PERP_OK)
        fuzz_fail("perp_mechanism_settings_init takes its own size");
    settings->scheme = fuzz_pick(bytes, 4) % 3;
    settings->law = fuzz_pick(bytes, 4);
    settings->tol = fuzz_tol(bytes, settings->tol);
    settings->theta = fuzz_pick(bytes, 5) * 0.25;
    settings->cone = flags & 1 && flags & 2 ? 3 + fuzz_pick(bytes, 6) : 0;
    settings->project = !(flags & 4);
    settings->error = (flags & 0x18) == 0x18 ? fuzz_tol(bytes, 1e-4) : 0;
    settings->select = (flags & 0x60) == 0x60 ? fuzz_pick(bytes, 3) : 0;
    settings->time_limit = (flags & 0x90) == 0x90 ? 1e-3 : 0;
    /* theta = 0 is of first order: an error of 1e-15 asks for 1e8 steps */
    if (settings->time_limit == 0 && settings->error > 0)
        settings->time_limit = 1;
    settings->most_patterns = 1 + 16 * fuzz_pick(bytes, 200);
    settings->directions = 3 + fuzz_pick(bytes, 6);
    settings->starts = 1 + fuzz_pick(bytes, 4);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    perp_mechanism *mechanism = NULL;
    perp_mechanism_settings settings;
    machine m;
    double h;
    int32_t times;

    memset(&m, 0, sizeof m);
    make_settings(&bytes, &settings);
    make(&bytes, &m);
    h = pow(2, -fuzz_pick(&bytes, 20));
    times = 1 + fuzz_pick(&bytes, 4);
    if (fuzz_status(context, perp_mechanism_create(context, &mechanism, &settings, &m.model),
                    "perp_mechanism_create"))
        while (times-- > 0) {
            int mark = fuzz_mark(), what = fuzz_pick(&bytes, 6);

            if (what < 3)
                advance(&bytes, context, mechanism, &m, &settings, h);
            else if (what == 3)
                run(context, mechanism, &m, h);
            else
                enumerate(context, mechanism, &m, what == 4 ? h : 0);
            check(context, mechanism, &m);
            fuzz_drop_to(mark);
        }
    perp_mechanism_destroy(mechanism);
    fuzz_close(context);
    return 0;
}
