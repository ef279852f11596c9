/* Integration of compliant contacts: the L-stable SDIRK method of order 4 with an embedded one of
 * order 3, Hairer & Wanner, "Solving Ordinary Differential Equations II", table IV.6.5. With a =
 * v', a stage V = zv + h g a, X = zx + h g V comes down to its normal forces,
 *
 *   (I + e h g (P + Q D)) N = k normal zx + e normal (zv + h g mass^-1 force),   e = k h g + c,
 *
 * D = diag(slip side): side, the signs of N, is iterated. */
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

enum { SIGN_ROUNDS = 24, EVENT_ROUNDS = 100 };

typedef struct progress {
    perp_compliant_settings settings;
    perp_compliant_result result;
    double t, t_end;
} progress;

/* ---- one step ------------------------------------------------------------------------------ */

static double row_times(const double *A, int32_t rows, int32_t row, const double *x, int32_t n)
{
    double sum = 0.0;

    for (int32_t i = 0; i < n; i++)
        sum += A[(size_t)row + (size_t)rows * (size_t)i] * x[i];
    return sum;
}

/* The signs of the state's normal forces, and these where they are wanted. */
static void find_sides(perp_compliant *c, double *N)
{
    for (int32_t k = 0; k < c->p; k++) {
        const double force = c->stiffness * row_times(c->normal, c->p, k, c->x, c->n) +
                             c->damping * row_times(c->normal, c->p, k, c->v, c->n);

        c->side[k] = force < 0.0 ? -1.0 : 1.0;
        if (N)
            N[k] = force;
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
            for (k = 0; k < p; k++)
                c->matrix[k + p * l] =
                    e * s * (c->P[k + p * l] + c->Q[k + p * l] * (c->slip[l] * c->side[l]));
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

/* Stage `stage` of length s from zx, zv: its slopes, and V. */
static int32_t take_stage(perp_compliant *c, double s, int32_t stage)
{
    for (int32_t i = 0; i < c->n; i++)
        c->V[i] = c->zv[i] + s * c->free[i];
    for (int32_t k = 0; k < c->p; k++)
        c->right[k] = c->stiffness * row_times(c->normal, c->p, k, c->zx, c->n) +
                      (c->stiffness * s + c->damping) * row_times(c->normal, c->p, k, c->V, c->n);
    if (find_normal_forces(c, s) != 0)
        return 1;
    for (int32_t i = 0; i < c->n; i++) {
        double a = c->free[i];

        for (int32_t k = 0; k < c->p; k++) {
            const size_t at = (size_t)i + (size_t)c->n * (size_t)k;

            a -= c->response[at] * c->N[k] + c->drag[at] * (c->slip[k] * fabs(c->N[k]));
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

    find_sides(c, NULL);
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

/* The error beside the largest displacement, velocity and penetration so far, this step included.
 */
static double error_of(perp_compliant *c)
{
    double error = 0.0;

    for (int32_t i = 0; i < c->n; i++) {
        const double top_x = fmax(c->top_x[i], fabs(c->next_x[i]));
        const double top_v = fmax(c->top_v[i], fabs(c->next_v[i]));

        if (c->error_x[i] != 0.0)
            perp__raise_to(&error, fabs(c->error_x[i]) / top_x);
        if (c->error_v[i] != 0.0)
            perp__raise_to(&error, fabs(c->error_v[i]) / top_v);
    }
    for (int32_t k = 0; k < c->p; k++) {
        const double delta = row_times(c->normal, c->p, k, c->next_x, c->n);
        const double wrong = row_times(c->normal, c->p, k, c->error_x, c->n);

        if (wrong != 0.0)
            perp__raise_to(&error, fabs(wrong) / fmax(c->top_delta[k], fabs(delta)));
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
    find_sides(c, c->N);
    for (int32_t k = 0; k < c->p; k++) {
        c->top_delta[k] = fmax(c->top_delta[k], fabs(row_times(c->normal, c->p, k, c->x, c->n)));
        run->result.least_normal = fmin(run->result.least_normal, c->N[k]);
        run->result.largest_normal = fmax(run->result.largest_normal, c->N[k]);
    }
}

/* ---- stops --------------------------------------------------------------------------------- */

/* The contact whose sliding has turned round after the step, and how far: -1 if none. */
static int32_t find_stop(const perp_compliant *c, double *beyond)
{
    int32_t found = -1, k;

    *beyond = 0.0;
    for (k = 0; k < c->p; k++) {
        const double sliding = c->slip[k] * row_times(c->tangent, c->p, k, c->next_v, c->n);

        if (c->mu[k] > 0.0 && sliding <= *beyond) {
            *beyond = sliding;
            found = k;
        }
    }
    return found;
}

/* Shortens a step after which a contact has turned round to where the first one stops. Bisection:
 * the step's accuracy is that of its full length. */
static double find_stop_time(perp_compliant *c, double h, int32_t *contact)
{
    double low = 0.0, high = h, beyond;

    for (int32_t round = 0; round < EVENT_ROUNDS; round++) {
        const double middle = 0.5 * (low + high);
        int32_t found;

        if (!(middle > low && middle < high) || take_step(c, middle) != 0)
            break;
        found = find_stop(c, &beyond);
        if (found < 0) {
            low = middle;
        } else {
            high = middle;
            *contact = found;
        }
    }
    (void)take_step(c, high);
    return high;
}

/* ---- the run ------------------------------------------------------------------------------- */

static void accept(perp_compliant *c, progress *run, double h)
{
    memcpy(c->x, c->next_x, (size_t)c->n * sizeof *c->x);
    memcpy(c->v, c->next_v, (size_t)c->n * sizeof *c->v);
    run->t += h;
    run->result.steps++;
    read_state(c, run);
}

/* A first step: a hundredth of the contacts' fastest time, or of the run. */
static double first_step(const perp_compliant *c, const progress *run)
{
    double top = 0.0;

    if (run->settings.first_step > 0.0)
        return fmin(run->settings.first_step, run->t_end);
    for (int32_t k = 0; k < c->p; k++)
        top = fmax(top, fabs(c->P[k + c->p * k]) + fabs(c->Q[k + c->p * k]));
    return fmin(run->t_end, 0.01 / fmax(sqrt(c->stiffness * top), 1.0 / run->t_end));
}

static void integrate(perp_compliant *c, progress *run)
{
    perp_compliant_result *r = &run->result;
    double h = first_step(c, run), beyond;

    r->end = PERP_COMPLIANT_TIME;
    r->next_step = h;
    while (run->t < run->t_end) {
        const int32_t last = h >= run->t_end - run->t;
        const double step = last ? run->t_end - run->t : h;
        double error;

        if (r->steps >= run->settings.most_steps || !(run->t + step > run->t)) {
            r->end =
                r->steps >= run->settings.most_steps ? PERP_COMPLIANT_STEPS : PERP_COMPLIANT_FAILED;
            return;
        }
        error = take_step(c, step) == 0 ? error_of(c) / run->settings.tol : INFINITY;
        if (!(error <= 1.0)) {
            r->rejected++;
            h = step * (error < 1e30 ? fmax(0.1, 0.85 * pow(error, -0.25)) : 0.1);
            if (!(h < step)) { /* the smallest double is its own half */
                r->end = PERP_COMPLIANT_FAILED;
                return;
            }
            continue;
        }
        if (find_stop(c, &beyond) >= 0) {
            accept(c, run, find_stop_time(c, step, &r->contact));
            r->end = PERP_COMPLIANT_STOPPED;
            return;
        }
        accept(c, run, step);
        if (last)
            run->t = run->t_end;
        h = fmax(step, last ? h : 0.0) * fmin(4.0, error > 0.0 ? 0.85 * pow(error, -0.25) : 4.0);
        r->next_step = h;
    }
}

static const perp__field fields[] = {
    PERP__REAL(perp_compliant_settings, tol, "(]", 0, 0.1),
    PERP__REAL(perp_compliant_settings, first_step, "[]", 0, INFINITY),
    PERP__INTEGER(perp_compliant_settings, most_steps, 1, INFINITY),
};

static perp_status check(perp_compliant *c, progress *run, const double *x0, const double *v0)
{
    perp_status status = perp__check_vector(c->context, "x0", x0, (size_t)c->n);

    if (status == PERP_OK)
        status = perp__check_vector(c->context, "v0", v0, (size_t)c->n);
    if (status == PERP_OK && !(run->t_end > 0.0 && isfinite(run->t_end)))
        status = perp__fail(c->context, PERP_ERROR_ARGUMENT,
                            "t_end is %g, expected a positive number", run->t_end);
    if (status == PERP_OK)
        status = PERP__CHECK_FIELDS(c->context, "settings", &run->settings, fields);
    return status;
}

/* The state into the handle, and the directions of sliding. */
static perp_status begin(perp_compliant *c, progress *run, const double *x0, const double *v0)
{
    const size_t size = (size_t)c->n * sizeof(double);

    memcpy(c->x, x0, size);
    memcpy(c->v, v0, size);
    memset(c->top_x, 0, size);
    memset(c->top_v, 0, size);
    memset(c->top_delta, 0, (size_t)c->p * sizeof *c->top_delta);
    for (int32_t k = 0; k < c->p; k++) {
        const double sliding = row_times(c->tangent, c->p, k, v0, c->n);

        c->slip[k] = (double)((sliding > 0.0) - (sliding < 0.0));
        if (c->slip[k] == 0.0 && c->mu[k] > 0.0)
            return perp__fail(c->context, PERP_ERROR_ARGUMENT, "contact %d does not slide", (int)k);
    }
    run->result.contact = -1;
    run->result.least_normal = INFINITY;
    run->result.largest_normal = -INFINITY;
    read_state(c, run);
    return PERP_OK;
}

static perp_status run_checked(perp_compliant *c, double *x, double *v, double *N,
                               perp_compliant_result *result,
                               const perp_compliant_settings *settings, const double *x0,
                               const double *v0, double t_end)
{
    const size_t size = (size_t)c->n * sizeof(double);
    progress run;
    perp_status status = perp__check_pointer(c->context, "x", x);

    memset(&run, 0, sizeof run);
    run.t_end = t_end;
    perp_compliant_settings_init(&run.settings, sizeof run.settings);
    if (status == PERP_OK)
        status = perp__check_pointer(c->context, "v", v);
    if (status == PERP_OK)
        status = PERP__CHECK(perp_compliant_result, c->context, result);
    if (status == PERP_OK)
        status = PERP__READ(perp_compliant_settings, c->context, &run.settings, settings);
    if (status == PERP_OK)
        status = check(c, &run, x0, v0);
    if (status == PERP_OK)
        status = begin(c, &run, x0, v0);
    if (status != PERP_OK)
        return status;
    integrate(c, &run);
    if (!perp__all_finite(c->N, (size_t)c->p))
        return perp__fail(c->context, PERP_ERROR_NOT_FINITE, "the normal forces overflow at t = %g",
                          run.t);
    run.result.t = run.t;
    memcpy(x, c->x, size);
    memcpy(v, c->v, size);
    if (N)
        memcpy(N, c->N, (size_t)c->p * sizeof *N);
    perp__struct_write(result, &run.result, sizeof run.result);
    return PERP_OK;
}

perp_status perp_compliant_run(perp_compliant *compliant, double *x, double *v, double *N,
                               perp_compliant_result *result,
                               const perp_compliant_settings *settings, const double *x0,
                               const double *v0, double t_end)
{
    return PERP__CALL(perp__compliant_enter(compliant), compliant->context,
                      run_checked(compliant, x, v, N, result, settings, x0, v0, t_end));
}
