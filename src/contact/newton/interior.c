/* A primal-dual interior point method on z = A x + b + s e1, s = sqrt(|z_t|^2 + eps^2), x o z = 0,
 * with the scaling of Nesterov & Todd and Mehrotra's predictor and corrector (SIAM J. Optim. 2
 * (1992) 575). The problem is no convex program, as s depends on z; the method takes the derivative
 * of s into its matrix, J A + G with J = I + tau e1 (z_t / s)', which is then unsymmetric. */
#include "contact/newton/newton.h"

#include <math.h>
#include <string.h>

#define EPS_PART 0.1 /* eps = this times g; sqrt(g) would stall */
#define EPS_MOST 1e-2
#define EXIT 1e-6   /* residual at which the polish is tried first */
#define STEPS 100   /* most iterations of one attempt */
#define SHORT 0.05  /* three steps in a row under this: stalled */
#define PATIENCE 30 /* steps that do not halve the residual */
#define CENTRE 0.1  /* a step under this is taken again towards the central path */
#define POLISH_STEPS 8
#define ENOUGH 1e-13 /* residual after which nothing more is tried */
#define FREE 1e-11   /* regularises bilateral rows that depend on each other */

/* y, gap and slope of (x, z). */
static void evaluate(perp__newton *s, double eps)
{
    const perp__newton_blocks *b = &s->blocks;

    perp__newton_multiply(&s->matrix, s->x, s->y);
    for (int32_t i = 0; i < b->n; i++)
        s->y[i] += s->b[i];
    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double norm = d == 1 ? 0.0 : (d == 2 ? s->z[at + 1] : hypot(s->z[at + 1], s->z[at + 2]));
        double smooth = d == 1 ? 0.0 : hypot(norm, eps);

        for (int32_t i = 0; i < d; i++) {
            s->slope[at + i] = i == 0 ? 0.0 : s->z[at + i] / smooth;
            s->gap[at + i] = s->y[at + i] - s->z[at + i] + (i == 0 ? smooth : 0.0);
        }
    }
}

/* The average of (x + a dx)'(z + a dz) over the cones. */
static double average(const perp__newton *s, double a)
{
    int32_t last = s->blocks.starts[s->blocks.contacts];
    double sum = 0.0;

    for (int32_t i = 0; i < last; i++)
        sum += a == 0.0 ? s->x[i] * s->z[i] : (s->x[i] + a * s->dx[i]) * (s->z[i] + a * s->dz[i]);
    return s->blocks.contacts ? sum / (double)s->blocks.contacts : 0.0;
}

/* No gap is left where more z_1 closes it: s is convex, so that a step leaves gaps of this kind, of
 * the size of its curvature, where z_t is small. */
static void raise_slack(perp__newton *s)
{
    const perp__newton_blocks *b = &s->blocks;

    for (int32_t k = 0; k < b->contacts; k++) {
        int32_t at = b->starts[k];

        if (s->gap[at] > 0.0) {
            s->z[at] += s->gap[at];
            s->gap[at] = 0.0;
        }
    }
}

/* L = J and R = G. Returns 0 where (x, z) has come too close to the boundary to be scaled. */
static int32_t set_blocks(perp__newton *s, double tau)
{
    const perp__newton_blocks *b = &s->blocks;

    memset(s->L, 0, 9 * (size_t)b->blocks * sizeof *s->L);
    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double *L = &s->L[9 * (size_t)k], *R = &s->R[9 * (size_t)k];

        for (int32_t i = 0; i < d; i++)
            L[4 * i] = 1.0;
        for (int32_t i = 1; i < d; i++)
            L[3 * i] = tau * s->slope[at + i];
        if (k >= b->contacts)
            R[0] = FREE;
        else if (!perp__cone_scale(d, &s->x[at], &s->z[at], &s->scalings[k]))
            return 0;
        else
            perp__cone_metric(d, &s->scalings[k], R);
    }
    return 1;
}

/* out = J in over block k */
static void apply_slope(const perp__newton *s, int32_t k, const double *in, double *out)
{
    int32_t d = s->blocks.starts[k + 1] - s->blocks.starts[k];
    const double *L = &s->L[9 * (size_t)k];

    out[0] = in[0];
    for (int32_t i = 1; i < d; i++) {
        out[0] += L[3 * i] * in[i];
        out[i] = in[i];
    }
}

/* rhs = T (lambda \ c) - J gap with c = target e - lambda o lambda - second (T dx) o (T^-1 dz). */
static void set_rhs(perp__newton *s, double target, int32_t second)
{
    const perp__newton_blocks *b = &s->blocks;

    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        const perp__cone_scaling *T = &s->scalings[k];
        double lambda[3], c[3], p[3], a[3], e[3];

        apply_slope(s, k, &s->gap[at], p);
        for (int32_t i = 0; i < d; i++)
            s->rhs[at + i] = -p[i];
        if (k >= b->contacts)
            continue;
        perp__cone_apply(d, T, &s->x[at], lambda);
        perp__cone_product(d, lambda, lambda, c);
        for (int32_t i = 0; i < d; i++)
            c[i] = (i == 0 ? target : 0.0) - c[i];
        if (second) {
            perp__cone_apply(d, T, &s->dx[at], a);
            perp__cone_apply_inverse(d, T, &s->dz[at], e);
            perp__cone_product(d, a, e, p);
            for (int32_t i = 0; i < d; i++)
                c[i] -= p[i];
        }
        perp__cone_divide(d, lambda, c, a);
        perp__cone_apply(d, T, a, p);
        for (int32_t i = 0; i < d; i++)
            s->rhs[at + i] += p[i];
    }
}

/* (J A + G) dx = rhs, dz = J (A dx + gap). Returns the longest step inside of the cones. */
static double solve(perp__newton *s)
{
    const perp__newton_blocks *b = &s->blocks;
    double most = INFINITY;

    perp__newton_solve(&s->matrix, s->L, s->R, s->rhs, s->dx);
    perp__newton_multiply(&s->matrix, s->dx, s->change);
    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double p[3];

        for (int32_t i = 0; i < d; i++)
            s->change[at + i] += s->gap[at + i];
        apply_slope(s, k, &s->change[at], p);
        if (k >= b->contacts)
            p[0] = 0.0;
        memcpy(&s->dz[at], p, (size_t)d * sizeof *p);
        if (k >= b->contacts)
            continue;
        most = fmin(most, perp__cone_step(d, &s->x[at], &s->dx[at]));
        most = fmin(most, perp__cone_step(d, &s->z[at], &s->dz[at]));
    }
    return most;
}

/* One step; its length in *taken. PERP_OK, PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
static perp_status advance(perp__newton *s, double g, double *taken)
{
    double part = s->plan->step;
    double a, sigma, ratio;
    perp_status status = perp__newton_factor(&s->matrix, s->L, s->R);

    if (status != PERP_OK)
        return status;
    set_rhs(s, 0.0, 0);
    a = fmin(1.0, part * solve(s));
    ratio = g > 0.0 ? fmax(average(s, a), 0.0) / g : 0.0;
    sigma = fmin(1.0, fmax(ratio * ratio * ratio, 0.5 * (1.0 - a) * (1.0 - a) * (1.0 - a)));
    set_rhs(s, sigma * g, 1);
    a = fmin(1.0, part * solve(s));
    if (a < CENTRE) {
        set_rhs(s, g, 0);
        a = fmin(1.0, part * solve(s));
    }
    for (int32_t i = 0; i < s->blocks.n; i++) {
        s->x[i] += a * s->dx[i];
        s->z[i] += a * s->dz[i];
    }
    *taken = a;
    return PERP_OK;
}

/* The polish from P(x - z). */
static perp_status polish(perp__newton *s)
{
    perp__natural_start(s);
    return perp__natural_polish(s, POLISH_STEPS);
}

static double tau_of(const perp__newton *s)
{
    double nearness = fmin(1.0, fmax(0.0, -log10(s->residual) / 2.0));

    return s->plan->tau_far + (s->plan->tau_near - s->plan->tau_far) * nearness;
}

perp_status perp__interior_run(perp__newton *s, perp_outcome *outcome)
{
    double leave = EXIT, taken = 1.0, milestone = INFINITY;
    int32_t shorts = 0, waited = 0, step;

    *outcome = PERP_OUTCOME_STALLED;
    for (step = 0; step <= STEPS; step++) {
        double g = average(s, 0.0);
        perp_status status = PERP_OK;
        perp_outcome request;
        int32_t stuck;

        evaluate(s, fmin(EPS_PART * g, EPS_MOST));
        raise_slack(s);
        g = average(s, 0.0);
        s->residual = perp__natural_map(&s->blocks, s->x, s->y, NULL, NULL);
        waited = s->residual < 0.5 * milestone ? 0 : waited + 1;
        milestone = waited ? milestone : s->residual;
        stuck = shorts >= 3 || waited > PATIENCE || step == STEPS || !isfinite(s->residual);
        if (s->residual <= leave || stuck) {
            status = polish(s);
            if (status != PERP_OK || stuck || s->best_residual <= PERP__NEWTON_ENOUGH)
                return status;
            leave = fmin(leave, s->residual) * 0.1;
        }
        request = perp__newton_tick(s, &status);
        if (request >= 0 || status != PERP_OK) {
            *outcome = request;
            return status;
        }
        if (!set_blocks(s, tau_of(s)))
            return polish(s);
        status = advance(s, g, &taken);
        if (status != PERP_OK)
            return status == PERP__FACTOR_SINGULAR ? polish(s) : status;
        shorts = taken < SHORT ? shorts + 1 : 0;
    }
    return PERP_OK;
}
