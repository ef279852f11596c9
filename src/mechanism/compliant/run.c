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
#include "linalg/matrix.h"
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

/* Stage `stage` of length s = h g from zx, zv: its normal forces, slopes, and V; 0, or 1 where the
 * signs of the forces don't settle. */
static bool take_stage(perp_compliant *c, double s, int32_t stage)
{
    const size_t p = (size_t)c->p;
    const double e = c->stiffness * s + c->damping;
    bool changed = 1;

    /* 1. the right-hand side */
    for (int32_t i = 0; i < c->n; i++)
        c->V[i] = c->zv[i] + s * c->now.free[i];
    for (int32_t k = 0; k < c->p; k++)
        c->right[k] = c->modes[k] == PERP_CONTACT_SEPARATE
                          ? 0.0
                          : c->stiffness * perp__compliant_row(c, c->normal, k, c->zx) +
                                e * perp__compliant_row(c, c->normal, k, c->V);
    /* 2. the normal forces, and their signs */
    for (int32_t round = 0; round < SIGN_ROUNDS && changed; round++) {
        for (size_t l = 0; l < p; l++) {
            const double share = c->share[l] * c->side[l];

            for (size_t k = 0; k < p; k++)
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
        changed = 0;
        for (size_t k = 0; k < p; k++)
            if (c->N[k] * c->side[k] < 0.0) {
                c->side[k] = -c->side[k];
                changed = 1;
            }
    }
    /* 3. the slopes */
    for (int32_t i = 0; i < c->n && !changed; i++) {
        double a = c->now.free[i];

        for (int32_t k = 0; k < c->p; k++) {
            const size_t at = (size_t)i + (size_t)c->n * (size_t)k;

            a -= c->now.response[at] * c->N[k] + c->now.drag[at] * (c->share[k] * fabs(c->N[k]));
        }
        c->kv[stage][i] = a;
        c->kx[stage][i] = c->zv[i] + s * a;
    }
    return changed;
}

/* From x, v to next_x, next_v with the errors of the embedded method; 0, or 1. */
static bool take_step(perp_compliant *c, double h)
{
    const double e = c->stiffness * (h * diagonal) + c->damping;
    int32_t l;

    /* 1. the stages */
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
    /* 2. what the normal forces of the last stage are sums of, through their system */
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
    /* 3. the end, and its errors */
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

/* The step taken up to its first event, if there is one; its length. Bisection: the step's accuracy
 * is that of its full length. */
static double stop_at_event(perp_compliant *c, double h, perp__event *event)
{
    double low = 0.0, high = h, peak = 0.0;

    *event = perp__compliant_event(c);
    /* 1. a separate contact that came nearer and went away again: when it was nearest */
    for (int32_t k = 0; k < c->p && event->contact < 0 && peak == 0.0; k++)
        if (c->modes[k] == PERP_CONTACT_SEPARATE) {
            const double before = perp__compliant_row(c, c->normal, k, c->v);
            const double after = perp__compliant_row(c, c->normal, k, c->next_v);

            if (before > 0.0 && after < 0.0)
                peak = h * (before / (before - after));
        }
    if (peak > 0.0 && peak < h && take_step(c, peak) == 0) {
        *event = perp__compliant_event(c);
        if (event->contact < 0)
            (void)take_step(c, h);
        else
            high = peak;
    }
    if (event->contact < 0)
        return h;
    /* 2. the event */
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

/* ---- the run ------------------------------------------------------------------------------- */

/* What the contacts do from here. The run goes on where it can be told, and time goes on. */
static perp_status decide(perp_compliant *c, progress *run)
{
    int32_t failed;
    const perp_status status = perp__compliant_decide(c, &run->result, &failed);

    find_sides(c);
    run->result.end = failed || run->at_once > EVENTS_AT_ONCE + 2 * c->p ? PERP_COMPLIANT_FAILED
                                                                         : PERP_COMPLIANT_TIME;
    return status;
}

/* A step of h or up to t_end or an event, with the next one's length in *h. result.end: why the run
 * ends; PERP_COMPLIANT_TIME: it goes on. */
static perp_status advance(perp_compliant *c, progress *run, double *h)
{
    const bool last = *h >= run->t_end - run->t;
    const double step = last ? run->t_end - run->t : *h;
    perp_compliant_result *r = &run->result;
    perp_status status = PERP_OK;
    perp__event event;
    double error, taken;

    /* 1. a step that is right */
    r->end = r->steps >= run->settings.most_steps ? PERP_COMPLIANT_STEPS
             : run->t + step > run->t             ? PERP_COMPLIANT_TIME
                                                  : PERP_COMPLIANT_FAILED;
    if (r->end != PERP_COMPLIANT_TIME)
        return PERP_OK;
    error = take_step(c, step) == 0 ? error_of(c, step) / run->settings.tol : INFINITY;
    if (!(error <= 1.0)) {
        r->rejected++;
        *h = step * (error < 1e30 ? fmax(0.1, 0.85 * pow(error, -0.25)) : 0.1);
        if (!(*h < step)) /* the smallest double is its own half */
            r->end = PERP_COMPLIANT_FAILED;
        return PERP_OK;
    }
    /* 2. what it leads to */
    taken = stop_at_event(c, step, &event);
    run->at_once = run->t + taken > run->t ? 0 : run->at_once + 1;
    memcpy(c->x, c->next_x, (size_t)c->n * sizeof *c->x);
    memcpy(c->v, c->next_v, (size_t)c->n * sizeof *c->v);
    perp__compliant_hold(c, c->v);
    run->t += taken;
    r->steps++;
    read_state(c, run);
    /* 3. what comes next */
    if (event.end != PERP_COMPLIANT_TIME && !run->settings.through) {
        r->contact = event.contact;
        r->end = event.end;
    } else if (event.contact >= 0) {
        status = decide(c, run);
    } else {
        if (last)
            run->t = run->t_end;
        *h = fmax(step, last ? *h : 0.0) * fmin(4.0, error > 0.0 ? 0.85 * pow(error, -0.25) : 4.0);
    }
    if (r->end == PERP_COMPLIANT_TIME)
        r->next_step = *h;
    return status;
}

/* From the state x0, v0. */
static perp_status integrate(perp_compliant *c, progress *run, const double *x0, const double *v0)
{
    const size_t size = (size_t)c->n * sizeof(double);
    perp_status status = PERP_OK;
    double top = 0.0, h;

    memcpy(c->x, x0, size);
    memcpy(c->v, v0, size);
    if (!run->settings.resume || !c->has_run) {
        memset(c->top_x, 0, size);
        memset(c->top_v, 0, size);
        memset(c->top_delta, 0, (size_t)c->p * sizeof *c->top_delta);
    }
    c->has_run = 1;
    c->tol = run->settings.tol;
    for (int32_t k = 0; k < c->p; k++) { /* no contact yet */
        c->modes[k] = PERP_CONTACT_SEPARATE;
        c->gives[k] = 0;
        c->share[k] = c->sense[k] = 0.0;
    }
    c->stuck_count = 0;
    c->now = c->all;
    for (int32_t k = 0; k < c->p && !run->settings.through; k++)
        if (perp__compliant_rests(c, k))
            return perp__refuse(c->context,
                                "contact %d does not slide: settings.through goes on from rest",
                                (int)k);
    run->result.contact = -1;
    run->result.least_normal = INFINITY;
    run->result.largest_normal = -INFINITY;
    status = decide(c, run);
    read_state(c, run);
    /* a first step: a hundredth of the contacts' fastest time, or of the run */
    for (int32_t k = 0; k < c->p; k++)
        top = fmax(top, fabs(c->now.P[k + c->p * k]) + c->mu[k] * fabs(c->now.Q[k + c->p * k]));
    h = run->settings.first_step > 0.0 ? run->settings.first_step
                                       : 0.01 / fmax(sqrt(c->stiffness * top), 1.0 / run->t_end);
    h = run->result.next_step = fmin(run->t_end, h);
    while (status == PERP_OK && run->result.end == PERP_COMPLIANT_TIME && run->t < run->t_end)
        status = advance(c, run, &h);
    return status;
}

static const perp__field fields[] = {
    PERP__REAL(perp_compliant_settings, tol, "(]", 0, 0.1),
    PERP__REAL(perp_compliant_settings, first_step, "[]", 0, INFINITY),
    PERP__INTEGER(perp_compliant_settings, most_steps, 1, INFINITY),
    PERP__INTEGER(perp_compliant_settings, through, 0, 1),
    PERP__INTEGER(perp_compliant_settings, resume, 0, 1),
};

perp_status perp_compliant_run(perp_compliant *compliant, double *x, double *v, double *N,
                               perp_compliant_result *result,
                               const perp_compliant_settings *settings, const double *x0,
                               const double *v0, double t_end)
{
    perp_compliant *c = compliant;
    progress run = {.t_end = t_end};
    perp_status status = perp__compliant_enter(c);

    if (status != PERP_OK)
        return status;
    /* 1. checks */
    perp_compliant_settings_init(&run.settings, sizeof run.settings);
    status = perp__check_pointer(c->context, "x", x);
    PERP__THEN(status, perp__check_pointer(c->context, "v", v));
    PERP__THEN(status, PERP__CHECK(perp_compliant_result, c->context, result));
    PERP__THEN(status, PERP__READ(perp_compliant_settings, c->context, &run.settings, settings));
    PERP__THEN(status, perp__check_vector(c->context, "x0", x0, (size_t)c->n));
    PERP__THEN(status, perp__check_vector(c->context, "v0", v0, (size_t)c->n));
    if (status == PERP_OK && !(t_end > 0.0 && isfinite(t_end)))
        status = perp__refuse(c->context, "t_end is %g, expected a positive number", t_end);
    PERP__THEN(status, PERP__CHECK_FIELDS(c->context, "settings", &run.settings, fields));
    /* 2. the run */
    PERP__THEN(status, integrate(c, &run, x0, v0));
    if (status == PERP_OK && !perp__all_finite(c->N, (size_t)c->p))
        status = perp__fail(c->context, PERP_ERROR_NOT_FINITE,
                            "the normal forces overflow at t = %g", run.t);
    /* 3. the caller's */
    if (status == PERP_OK) {
        perp__compliant_friction(c, c->N);
        run.result.t = run.t;
        run.result.friction = c->friction;
        run.result.modes = c->modes;
        perp__copy(x, c->x, c->n);
        perp__copy(v, c->v, c->n);
        perp__copy(N, c->N, c->p);
        perp__struct_write(result, &run.result, sizeof run.result);
    }
    return perp__leave(c->context, status);
}
