/* Integration of compliant contacts: the L-stable SDIRK method of order 4 with an embedded one of
 * order 3, Hairer & Wanner, "Solving Ordinary Differential Equations II", table IV.6.5. With a =
 * v', a stage V = zv + h g a, X = zx + h g V comes down to its normal forces,
 *
 *   (I + e h g (P + Q D)) N = k normal zx + e normal (zv + h g mass^-1 force),   e = k h g + c,
 *
 * D = diag(share side), F = share |N|: side, the signs of N, is iterated. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "linalg/blas.h"
#include "mechanism/compliant/compliant.h"

static const double diagonal = 0.25;
static const double below[PERP__STAGES][PERP__STAGES - 1] = {
    {0.0, 0.0, 0.0, 0.0},
    {1.0 / 2, 0.0, 0.0, 0.0},
    {17.0 / 50, -1.0 / 25, 0.0, 0.0},
    {371.0 / 1360, -137.0 / 2720, 15.0 / 544, 0.0},
    {25.0 / 24, -49.0 / 48, 125.0 / 16, -85.0 / 12}};
/* weights of the method (its last stage) minus those of order 3 */
static const double defect[PERP__STAGES] = {25.0 / 24 - 59.0 / 48, -49.0 / 48 + 17.0 / 96,
                                            125.0 / 16 - 225.0 / 32, 0.0, 0.25};

/* of an event without time going on: more of them in a row than this, and twice the contacts */
enum { SIGN_ROUNDS = 24, EVENT_ROUNDS = 100, EVENTS_AT_ONCE = 20 };

typedef struct progress {
    perp_compliant_settings settings;
    perp_compliant_result result;
    const double *x0, *v0;
    double t, t_end;
    int32_t at_once; /* events since time went on */
} progress;

/* ---- one step ------------------------------------------------------------------------------ */

/* The signs of the state's normal forces, and these. */
static void find_sides(perp_compliant *c)
{
    perp__compliant_normals(c, c->N, c->x, c->v);
    for (int32_t k = 0; k < c->p; k++) {
        c->side[k] = c->N[k] < 0.0 ? -1.0 : 1.0;
        if (c->modes[k] == PERP_CONTACT_SEPARATE || (c->one_sided[k] && c->N[k] < 0.0))
            c->N[k] = 0.0;
    }
}

/* The normal forces of a stage of length s = h g; 0, or 1 where the signs don't settle. */
static int32_t find_normal_forces(perp_compliant *c, double s)
{
    const size_t p = (size_t)c->p;
    const double e = c->stiffness * s + c->damping;
    int32_t round, changed = 1;
    size_t k;

    for (round = 0; round < SIGN_ROUNDS && changed; round++) {
        for (size_t l = 0; l < p; l++) {
            const double share = c->share[l] * c->side[l];

            for (k = 0; k < p; k++)
                c->matrix[k + p * l] =
                    c->modes[k] == PERP_CONTACT_SEPARATE
                        ? 0.0
                        : e * s * (c->now.P[k + p * l] + c->now.Q[k + p * l] * share);
            c->matrix[l + p * l] += 1.0;
        }
        memcpy(c->N, c->right, p * sizeof *c->N);
        if (perp__lu_factor(c->p, c->matrix, c->p, c->pivots) != 0)
            return 1;
        perp__lu_solve(c->p, c->matrix, c->p, c->pivots, c->N, 0);
        for (changed = 0, k = 0; k < p; k++)
            if (c->N[k] * c->side[k] < 0.0) {
                c->side[k] = -c->side[k];
                changed = 1;
            }
    }
    return changed;
}

/* What the normal forces of the stage that was solved last are sums of, through their system. */
static void find_sizes(perp_compliant *c, double s)
{
    const double e = c->stiffness * s + c->damping;

    for (int32_t k = 0; k < c->p; k++) {
        c->right[k] = 0.0;
        for (int32_t i = 0; i < c->n && c->modes[k] != PERP_CONTACT_SEPARATE; i++)
            c->right[k] += fabs(c->normal[(size_t)k + (size_t)c->p * (size_t)i]) *
                           (c->stiffness * fabs(c->zx[i]) + e * fabs(c->V[i]));
    }
    perp__lu_solve(c->p, c->matrix, c->p, c->pivots, c->right, 0);
    for (int32_t i = 0; i < c->n; i++) {
        c->size[i] = fabs(c->now.free[i]);
        for (int32_t k = 0; k < c->p; k++) {
            const size_t at = (size_t)i + (size_t)c->n * (size_t)k;

            c->size[i] += fabs(c->now.response[at] * c->right[k]) +
                          fabs(c->now.drag[at] * (c->share[k] * c->right[k]));
        }
    }
}

/* Stage `stage` of length s from zx, zv: its slopes, and V. */
static int32_t take_stage(perp_compliant *c, double s, int32_t stage)
{
    for (int32_t i = 0; i < c->n; i++)
        c->V[i] = c->zv[i] + s * c->now.free[i];
    for (int32_t k = 0; k < c->p; k++)
        c->right[k] =
            c->modes[k] == PERP_CONTACT_SEPARATE
                ? 0.0
                : c->stiffness * perp__compliant_row(c, c->normal, k, c->zx) +
                      (c->stiffness * s + c->damping) * perp__compliant_row(c, c->normal, k, c->V);
    if (find_normal_forces(c, s) != 0)
        return 1;
    for (int32_t i = 0; i < c->n; i++) {
        double a = c->now.free[i];

        for (int32_t k = 0; k < c->p; k++) {
            const size_t at = (size_t)i + (size_t)c->n * (size_t)k;

            a -= c->now.response[at] * c->N[k] + c->now.drag[at] * (c->share[k] * fabs(c->N[k]));
        }
        c->kv[stage][i] = a;
        c->kx[stage][i] = c->zv[i] + s * a;
    }
    return 0;
}

/* From x, v to next_x, next_v with the errors of the embedded method; 0, or 1. */
static int32_t take_step(perp_compliant *c, double h)
{
    int32_t l;

    find_sides(c);
    for (int32_t stage = 0; stage < PERP__STAGES; stage++) {
        for (int32_t i = 0; i < c->n; i++) {
            double x = 0.0, v = 0.0;

            for (l = 0; l < stage; l++) {
                x += below[stage][l] * c->kx[l][i];
                v += below[stage][l] * c->kv[l][i];
            }
            c->zx[i] = c->x[i] + h * x;
            c->zv[i] = c->v[i] + h * v;
        }
        if (take_stage(c, h * diagonal, stage) != 0)
            return 1;
    }
    find_sizes(c, h * diagonal);
    for (int32_t i = 0; i < c->n; i++) {
        c->next_x[i] = c->zx[i] + h * diagonal * c->kx[PERP__STAGES - 1][i];
        c->next_v[i] = c->zv[i] + h * diagonal * c->kv[PERP__STAGES - 1][i];
        for (c->error_x[i] = c->error_v[i] = 0.0, l = 0; l < PERP__STAGES; l++) {
            c->error_x[i] += h * defect[l] * c->kx[l][i];
            c->error_v[i] += h * defect[l] * c->kv[l][i];
        }
    }
    return 0;
}

/* What is more than rounding of an error, beside `top`. */
static double beside(double error, double rounding, double top)
{
    return fabs(error) <= 8.0 * DBL_EPSILON * rounding ? 0.0 : fabs(error) / top;
}

/* The error beside the largest displacement, velocity and penetration up to this step. */
static double error_of(perp_compliant *c, double h)
{
    double error = 0.0;

    for (int32_t i = 0; i < c->n; i++) {
        const double top_x = fmax(c->top_x[i], fabs(c->next_x[i]));
        const double top_v = fmax(c->top_v[i], fabs(c->next_v[i]));

        perp__raise_to(&error, beside(c->error_x[i], h * (top_v + h * c->size[i]), top_x));
        perp__raise_to(&error, beside(c->error_v[i], h * c->size[i], top_v));
    }
    for (int32_t k = 0; k < c->p; k++) {
        const double delta = perp__compliant_row(c, c->normal, k, c->next_x);
        const double wrong = perp__compliant_row(c, c->normal, k, c->error_x);
        double rounding = 0.0;

        for (int32_t i = 0; i < c->n; i++)
            rounding += fabs(c->normal[(size_t)k + (size_t)c->p * (size_t)i]) * h *
                        (c->top_v[i] + h * c->size[i]);
        if (c->modes[k] != PERP_CONTACT_SEPARATE)
            perp__raise_to(&error, beside(wrong, rounding, fmax(c->top_delta[k], fabs(delta))));
    }
    if (!perp__all_finite(c->next_x, (size_t)c->n) || !perp__all_finite(c->next_v, (size_t)c->n))
        return INFINITY;
    return error;
}

/* The state's largest values and normal forces. */
static void read_state(perp_compliant *c, progress *run)
{
    for (int32_t i = 0; i < c->n; i++) {
        c->top_x[i] = fmax(c->top_x[i], fabs(c->x[i]));
        c->top_v[i] = fmax(c->top_v[i], fabs(c->v[i]));
    }
    find_sides(c);
    for (int32_t k = 0; k < c->p; k++) {
        c->top_delta[k] = fmax(c->top_delta[k], fabs(perp__compliant_row(c, c->normal, k, c->x)));
        run->result.least_normal = fmin(run->result.least_normal, c->N[k]);
        run->result.largest_normal = fmax(run->result.largest_normal, c->N[k]);
    }
}

/* ---- events -------------------------------------------------------------------------------- */

/* Shortens a step after which there is an event to where the first one is. Bisection: the step's
 * accuracy is that of its full length. */
static double find_event_time(perp_compliant *c, double h, perp__event *event)
{
    double low = 0.0, high = h;

    for (int32_t round = 0; round < EVENT_ROUNDS; round++) {
        const double middle = 0.5 * (low + high);
        perp__event found;

        if (!(middle > low && middle < high) || take_step(c, middle) != 0)
            break;
        found = perp__compliant_event(c);
        if (found.contact < 0) {
            low = middle;
        } else {
            high = middle;
            *event = found;
        }
    }
    (void)take_step(c, high);
    (void)perp__compliant_event(c);
    return high;
}

/* When a separate contact that came nearer and went away again was nearest; 0 if none did. */
static double nearest(const perp_compliant *c, double h)
{
    for (int32_t k = 0; k < c->p; k++)
        if (c->modes[k] == PERP_CONTACT_SEPARATE) {
            const double before = perp__compliant_row(c, c->normal, k, c->v);
            const double after = perp__compliant_row(c, c->normal, k, c->next_v);

            if (before > 0.0 && after < 0.0)
                return h * (before / (before - after));
        }
    return 0.0;
}

/* The step taken up to its first event, if there is one; its length. */
static double stop_at_event(perp_compliant *c, double h, perp__event *event)
{
    double peak;

    *event = perp__compliant_event(c);
    peak = event->contact < 0 ? nearest(c, h) : 0.0;
    if (peak > 0.0 && peak < h && take_step(c, peak) == 0) {
        *event = perp__compliant_event(c);
        if (event->contact < 0)
            (void)take_step(c, h);
        else
            h = peak;
    }
    return event->contact < 0 ? h : find_event_time(c, h, event);
}

/* ---- the run ------------------------------------------------------------------------------- */

static void accept(perp_compliant *c, progress *run, double h)
{
    run->at_once = run->t + h > run->t ? 0 : run->at_once + 1;
    memcpy(c->x, c->next_x, (size_t)c->n * sizeof *c->x);
    memcpy(c->v, c->next_v, (size_t)c->n * sizeof *c->v);
    perp__compliant_hold(c, c->v);
    run->t += h;
    run->result.steps++;
    read_state(c, run);
}

/* What the contacts do from here; *goes_on: it can be told, and time goes on. */
static perp_status decide(perp_compliant *c, progress *run, int32_t *goes_on)
{
    int32_t failed;
    const perp_status status = perp__compliant_decide(c, &run->result, &failed);

    find_sides(c);
    *goes_on = !failed && run->at_once <= EVENTS_AT_ONCE + 2 * c->p;
    return status;
}

/* A first step: a hundredth of the contacts' fastest time, or of the run. */
static double first_step(const perp_compliant *c, const progress *run)
{
    double top = 0.0;

    if (run->settings.first_step > 0.0)
        return fmin(run->settings.first_step, run->t_end);
    for (int32_t k = 0; k < c->p; k++)
        top = fmax(top, fabs(c->now.P[k + c->p * k]) + c->mu[k] * fabs(c->now.Q[k + c->p * k]));
    return fmin(run->t_end, 0.01 / fmax(sqrt(c->stiffness * top), 1.0 / run->t_end));
}

/* Why the step can't be taken, or PERP_COMPLIANT_TIME. */
static int32_t refuse_step(const progress *run, double step)
{
    if (run->result.steps >= run->settings.most_steps)
        return PERP_COMPLIANT_STEPS;
    return run->t + step > run->t ? PERP_COMPLIANT_TIME : PERP_COMPLIANT_FAILED;
}

/* A step of h or up to t_end or an event, with the next one's length in *h. *ended: why the run
 * does; PERP_COMPLIANT_TIME: it does not yet. */
static perp_status advance(perp_compliant *c, progress *run, double *h, int32_t *ended)
{
    const int32_t last = *h >= run->t_end - run->t;
    const double step = last ? run->t_end - run->t : *h;
    perp_status status = PERP_OK;
    perp__event event;
    double error, taken;

    *ended = refuse_step(run, step);
    if (*ended != PERP_COMPLIANT_TIME)
        return PERP_OK;
    error = take_step(c, step) == 0 ? error_of(c, step) / run->settings.tol : INFINITY;
    if (!(error <= 1.0)) {
        run->result.rejected++;
        *h = step * (error < 1e30 ? fmax(0.1, 0.85 * pow(error, -0.25)) : 0.1);
        if (!(*h < step)) /* the smallest double is its own half */
            *ended = PERP_COMPLIANT_FAILED;
        return PERP_OK;
    }
    taken = stop_at_event(c, step, &event);
    accept(c, run, taken);
    if (event.end != PERP_COMPLIANT_TIME && !run->settings.through) {
        run->result.contact = event.contact;
        *ended = event.end;
    } else if (event.contact >= 0) {
        int32_t goes_on;

        status = decide(c, run, &goes_on);
        *ended = goes_on ? PERP_COMPLIANT_TIME : PERP_COMPLIANT_FAILED;
    } else {
        if (last)
            run->t = run->t_end;
        *h = fmax(step, last ? *h : 0.0) * fmin(4.0, error > 0.0 ? 0.85 * pow(error, -0.25) : 4.0);
    }
    return status;
}

static perp_status integrate(perp_compliant *c, progress *run)
{
    perp_compliant_result *r = &run->result;
    perp_status status;
    int32_t goes_on;
    double h;

    status = decide(c, run, &goes_on);
    read_state(c, run);
    h = r->next_step = first_step(c, run);
    r->end = goes_on ? PERP_COMPLIANT_TIME : PERP_COMPLIANT_FAILED;
    while (status == PERP_OK && r->end == PERP_COMPLIANT_TIME && run->t < run->t_end) {
        const int64_t steps = r->steps;

        status = advance(c, run, &h, &r->end);
        if (r->steps > steps && r->end == PERP_COMPLIANT_TIME)
            r->next_step = h;
    }
    return status;
}

static const perp__field fields[] = {
    PERP__REAL(perp_compliant_settings, tol, "(]", 0, 0.1),
    PERP__REAL(perp_compliant_settings, first_step, "[]", 0, INFINITY),
    PERP__INTEGER(perp_compliant_settings, most_steps, 1, INFINITY),
    PERP__INTEGER(perp_compliant_settings, through, 0, 1),
    PERP__INTEGER(perp_compliant_settings, resume, 0, 1),
};

static perp_status check(perp_compliant *c, const progress *run)
{
    perp_status status = perp__check_vector(c->context, "x0", run->x0, (size_t)c->n);

    PERP__THEN(status, perp__check_vector(c->context, "v0", run->v0, (size_t)c->n));
    if (status == PERP_OK && !(run->t_end > 0.0 && isfinite(run->t_end)))
        status = perp__refuse(c->context, "t_end is %g, expected a positive number", run->t_end);
    PERP__THEN(status, PERP__CHECK_FIELDS(c->context, "settings", &run->settings, fields));
    return status;
}

/* The state into the handle. */
static perp_status begin(perp_compliant *c, progress *run)
{
    const size_t size = (size_t)c->n * sizeof(double);

    memcpy(c->x, run->x0, size);
    memcpy(c->v, run->v0, size);
    if (!run->settings.resume || !c->has_run) {
        memset(c->top_x, 0, size);
        memset(c->top_v, 0, size);
        memset(c->top_delta, 0, (size_t)c->p * sizeof *c->top_delta);
    }
    c->has_run = 1;
    c->tol = run->settings.tol;
    perp__compliant_begin_modes(c);
    for (int32_t k = 0; k < c->p && !run->settings.through; k++)
        if (perp__compliant_rests(c, k))
            return perp__refuse(c->context,
                                "contact %d does not slide: settings.through goes on from rest",
                                (int)k);
    run->result.contact = -1;
    run->result.least_normal = INFINITY;
    run->result.largest_normal = -INFINITY;
    return PERP_OK;
}

/* out: the caller's x, v and, unless NULL, N. */
static perp_status run_to(perp_compliant *c, double *const out[3], progress *run,
                          perp_compliant_result *result, const perp_compliant_settings *settings)
{
    const size_t size = (size_t)c->n * sizeof(double);
    perp_status status = perp__check_pointer(c->context, "x", out[0]);

    perp_compliant_settings_init(&run->settings, sizeof run->settings);
    PERP__THEN(status, perp__check_pointer(c->context, "v", out[1]));
    PERP__THEN(status, PERP__CHECK(perp_compliant_result, c->context, result));
    PERP__THEN(status, PERP__READ(perp_compliant_settings, c->context, &run->settings, settings));
    PERP__THEN(status, check(c, run));
    PERP__THEN(status, begin(c, run));
    PERP__THEN(status, integrate(c, run));
    if (status == PERP_OK && !perp__all_finite(c->N, (size_t)c->p))
        status = perp__fail(c->context, PERP_ERROR_NOT_FINITE,
                            "the normal forces overflow at t = %g", run->t);
    if (status != PERP_OK)
        return status;
    perp__compliant_friction(c, c->N);
    run->result.t = run->t;
    run->result.friction = c->friction;
    run->result.modes = c->modes;
    memcpy(out[0], c->x, size);
    memcpy(out[1], c->v, size);
    if (out[2])
        memcpy(out[2], c->N, (size_t)c->p * sizeof *c->N);
    perp__struct_write(result, &run->result, sizeof run->result);
    return PERP_OK;
}

perp_status perp_compliant_run(perp_compliant *compliant, double *x, double *v, double *N,
                               perp_compliant_result *result,
                               const perp_compliant_settings *settings, const double *x0,
                               const double *v0, double t_end)
{
    double *const out[] = {x, v, N};
    progress run = {.x0 = x0, .v0 = v0, .t_end = t_end};

    return PERP__CALL(perp__compliant_enter(compliant), compliant->context,
                      run_to(compliant, out, &run, result, settings));
}
