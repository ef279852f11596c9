/* The path of solutions of
 *   z = (A + c t) x + b + t d + s e1,  x o z = t e,  s = sqrt(|z_t|^2 + t^2),  d inside of K,
 * from a large t, where there is one only, to t = 0, by its arc length, so that t may grow on the
 * way (Allgower & Georg, "Introduction to Numerical Continuation Methods", 1990, chapters 2 and 6).
 * d is what the covering vector is in Lemke's method, and as there the problem's constraint
 * qualification bounds x for t > 0. The unknown is v = x - z with x = p(v), z = p(-v) of
 * perp__cone_smooth; then dz = -R dx, R = D^-1 - I, D = p'(v), and
 *   (J (A + c t) + R) dx = -J (E + E_t dt),  E = (A + c t) x + b + t d + s e1 - z. */
#include "contact/newton/newton.h"

#include <math.h>
#include <string.h>

#define FIRST 10.0     /* t where the path begins; b has entries up to 1 */
#define FIRST_STEPS 30 /* of Newton's method there */
#define LAST 1e-9      /* no use beyond */
#define INTERIOR 1e-2  /* t at which the interior point method is tried, then at tenths of it */
#define STEPS 400
#define FACTORISATIONS 2000 /* of one path, for problems of few unknowns */
#define EFFORT 600000       /* factorisations times unknowns, for the others */
#define CORRECTIONS 6
#define CLOSE 0.1 /* E is small enough at this times t */
#define GROW 2.0
#define SHRINK 0.4
#define SHORTEST 1e-10
#define FREE 1e-11 /* as in interior.c */
#define GOOD 1e-10 /* tested residual that ends the search */

/* (x, z) of v, E at (v, t). Returns max|E|. */
static double evaluate(perp__newton *s, const double *v, double t, double *E)
{
    const perp__newton_blocks *b = &s->blocks;
    const double c = t * s->plan->compliance;
    double largest = 0.0;

    for (int32_t i = 0; i < b->n; i++) {
        s->x[i] = v[i];
        s->z[i] = -v[i];
    }
    for (int32_t k = 0; k < b->contacts; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;

        perp__cone_smooth(d, &s->x[at], t, &s->x[at]);
        perp__cone_smooth(d, &s->z[at], t, &s->z[at]);
    }
    perp__newton_multiply(&s->matrix, s->x, E);
    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double norm = d == 1 ? 0.0 : (d == 2 ? s->z[at + 1] : hypot(s->z[at + 1], s->z[at + 2]));
        double smooth = d == 1 ? 0.0 : hypot(norm, t);

        for (int32_t i = 0; i < d; i++) {
            E[at + i] += s->b[at + i];
            if (k < b->contacts)
                E[at + i] += c * s->x[at + i] - s->z[at + i];
            s->slope[at + i] = i == 0 ? 0.0 : s->z[at + i] / smooth;
        }
        if (k < b->contacts)
            E[at] += smooth + t * s->cover[at];
        for (int32_t i = 0; i < d; i++)
            largest = fabs(E[at + i]) <= largest ? largest : fabs(E[at + i]);
    }
    return largest;
}

/* R of block k: eigenvalues z / x along the frame of v, whose spectral values come in pairs. */
static void set_metric(const perp__newton *s, int32_t k, const double *v, double *R)
{
    const perp__newton_blocks *b = &s->blocks;
    int32_t at = b->starts[k], d = b->starts[k + 1] - at;
    double x_low, x_high, z_low, z_high, low, high, across, n, w[3] = {0.0, 0.0, 0.0};

    perp__cone_values(d, &s->x[at], &x_low, &x_high);
    perp__cone_values(d, &s->z[at], &z_high, &z_low); /* the frames are opposite */
    low = z_low / x_low;
    high = z_high / x_high;
    n = d == 1 ? 0.0 : (d == 2 ? fabs(v[at + 1]) : hypot(v[at + 1], v[at + 2]));
    R[0] = 0.5 * (low + high);
    across = x_high > x_low ? (z_low - z_high) / (x_high - x_low) : R[0];
    for (int32_t i = 1; i < d; i++)
        w[i] = n > 0.0 ? v[at + i] / n : 0.0;
    for (int32_t j = 1; j < d; j++) {
        R[j] = R[3 * j] = 0.5 * (high - low) * w[j];
        for (int32_t i = 1; i < d; i++)
            R[3 * j + i] = (i == j ? across : 0.0) + (R[0] - across) * w[i] * w[j];
    }
}

/* L = J and R + c t J, for the factorisation. */
static void set_blocks(perp__newton *s, const double *v, double t)
{
    const perp__newton_blocks *b = &s->blocks;
    const double c = t * s->plan->compliance;

    memset(s->L, 0, 9 * (size_t)b->blocks * sizeof *s->L);
    memset(s->R, 0, 9 * (size_t)b->blocks * sizeof *s->R);
    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double *L = &s->L[9 * (size_t)k], *R = &s->R[9 * (size_t)k];

        for (int32_t i = 0; i < d; i++)
            L[4 * i] = 1.0;
        for (int32_t i = 1; i < d; i++)
            L[3 * i] = s->slope[at + i];
        if (k >= b->contacts) {
            R[0] = FREE;
            continue;
        }
        set_metric(s, k, v, R);
        for (int32_t i = 0; i < 9; i++)
            R[i] += c * L[i];
    }
}

/* dv = dx - dz, dx from the system above with right side -J E. */
static void solve(perp__newton *s, double t, const double *E, double *dv)
{
    const perp__newton_blocks *b = &s->blocks;
    const double c = t * s->plan->compliance;

    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;

        for (int32_t i = 0; i < d; i++)
            s->rhs[at + i] = -E[at + i];
        for (int32_t i = 1; i < d; i++)
            s->rhs[at] -= s->slope[at + i] * E[at + i];
    }
    perp__newton_solve(&s->matrix, s->L, s->R, s->rhs, s->dx);
    for (int32_t k = 0; k < b->blocks; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        const double *L = &s->L[9 * (size_t)k], *R = &s->R[9 * (size_t)k];

        for (int32_t i = 0; i < d; i++) {
            dv[at + i] = s->dx[at + i];
            for (int32_t j = 0; j < d && k < b->contacts; j++)
                dv[at + i] += (R[3 * j + i] - c * L[3 * j + i]) * s->dx[at + j];
        }
    }
}

/* E_t: x and z both change by h with spectral values 1 / (x + z) in the frame of v. */
static void differentiate(perp__newton *s, const double *v, double t, double *E_t)
{
    const perp__newton_blocks *b = &s->blocks;
    const double c = s->plan->compliance;
    double *h = s->rhs;

    memset(h, 0, (size_t)b->n * sizeof *h);
    for (int32_t k = 0; k < b->contacts; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double x_low, x_high, z_low, z_high, n;

        perp__cone_values(d, &s->x[at], &x_low, &x_high);
        perp__cone_values(d, &s->z[at], &z_high, &z_low);
        n = d == 1 ? 0.0 : (d == 2 ? fabs(v[at + 1]) : hypot(v[at + 1], v[at + 2]));
        h[at] = 0.5 / (x_low + z_low) + 0.5 / (x_high + z_high);
        for (int32_t i = 1; i < d && n > 0.0; i++)
            h[at + i] = (h[at] - 1.0 / (x_low + z_low)) * v[at + i] / n;
    }
    perp__newton_multiply(&s->matrix, h, E_t);
    for (int32_t k = 0; k < b->contacts; k++) {
        int32_t at = b->starts[k], d = b->starts[k + 1] - at;
        double norm = d == 1 ? 0.0 : (d == 2 ? s->z[at + 1] : hypot(s->z[at + 1], s->z[at + 2]));

        for (int32_t i = 0; i < d; i++)
            E_t[at + i] += c * s->x[at + i] + (c * t - 1.0) * h[at + i];
        E_t[at] += s->cover[at];
        for (int32_t i = 1; i < d; i++)
            E_t[at] += s->slope[at + i] * h[at + i];
        if (d > 1)
            E_t[at] += t / hypot(norm, t);
    }
}

/* The system at (v, t) factored, E there in s->error, dv/dt along the path in s->along. */
static perp_status linearise(perp__newton *s, const double *v, double t, double *size)
{
    perp_status status;

    *size = evaluate(s, v, t, s->error);
    if (!isfinite(*size))
        return PERP__FACTOR_SINGULAR;
    set_blocks(s, v, t);
    status = perp__newton_factor(&s->matrix, s->L, s->R);
    if (status != PERP_OK)
        return status;
    differentiate(s, v, t, s->change);
    solve(s, t, s->change, s->along);
    return PERP_OK;
}

static double dot(const double *a, const double *b, int32_t n)
{
    double sum = 0.0;

    for (int32_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* The point of the path at t = FIRST. */
static perp_status begin(perp__newton *s)
{
    const perp__newton_blocks *b = &s->blocks;
    double size;

    memset(s->v, 0, (size_t)b->n * sizeof *s->v);
    memset(s->tangent, 0, (size_t)b->n * sizeof *s->tangent);
    for (int32_t k = 0; k < b->contacts; k++)
        s->v[b->starts[k]] = 1.0 - FIRST;
    for (int32_t step = 0;; step++) {
        perp_status status = linearise(s, s->v, FIRST, &size);

        if (status != PERP_OK || size <= 1e-6 * FIRST || step >= FIRST_STEPS ||
            perp__newton_is_spent(s))
            return status;
        solve(s, FIRST, s->error, s->dz);
        for (int32_t i = 0; i < b->n; i++)
            s->v[i] += s->dz[i];
    }
}

/* Newton's method from the predicted (ahead, *t) across the tangent. Returns how often the system
 * was factored, 0 if it does not converge, or PERP_ERROR_MEMORY. On success it is the system at the
 * new point that is factored last. */
static int32_t correct(perp__newton *s, double *t, double tangent_t)
{
    double size, last = INFINITY;
    int32_t n = s->blocks.n, step, i;

    for (step = 0; step < CORRECTIONS && !perp__newton_is_spent(s); step++) {
        perp_status status = linearise(s, s->ahead, *t, &size);
        double dt;

        if (status < 0)
            return status;
        if (status == PERP_OK && size <= (step > 0 ? CLOSE : 1e-2 * CLOSE) * *t)
            return step + 1;
        if (status != PERP_OK || !(size < 0.7 * last))
            return 0;
        last = size;
        solve(s, *t, s->error, s->dz);
        dt = -dot(s->tangent, s->dz, n) / (dot(s->tangent, s->along, n) + tangent_t);
        if (!(dt > -0.95 * *t) || !isfinite(dt))
            return 0;
        for (i = 0; i < n; i++)
            s->ahead[i] += s->dz[i] + dt * s->along[i];
        *t += dt;
    }
    return 0;
}

/* One step along the path from (v, *t), where the system is factored, to the next point. Returns
 * 1, 0 if there is none to be found, or PERP_ERROR_MEMORY. */
static int32_t advance(perp__newton *s, double *t, double *tangent_t, double *length)
{
    int32_t n = s->blocks.n, taken = 0, i;
    double norm = sqrt(dot(s->along, s->along, n) + 1.0);
    double sign = dot(s->along, s->tangent, n) + *tangent_t >= 0.0 ? 1.0 : -1.0;
    double most, next = *t;

    if (!isfinite(norm))
        return 0;
    for (i = 0; i < n; i++)
        s->tangent[i] = sign * s->along[i] / norm;
    *tangent_t = sign / norm;
    most = *tangent_t < 0.0 ? 0.9 * *t / -*tangent_t : INFINITY;
    for (; taken == 0 && *length > SHORTEST; *length *= taken == 0 ? SHRINK : 1.0) {
        double h = fmin(*length, most);

        for (i = 0; i < n; i++)
            s->ahead[i] = s->v[i] + h * s->tangent[i];
        next = *t + h * *tangent_t;
        taken = correct(s, &next, *tangent_t);
    }
    if (taken <= 0)
        return taken;
    memcpy(s->v, s->ahead, (size_t)n * sizeof *s->v);
    *t = next;
    *length *= taken <= 3 ? GROW : 1.0;
    return 1;
}

static void choose_cover(perp__newton *s)
{
    uint64_t state = s->plan->cover;

    for (int32_t i = 0; i < s->blocks.n; i++) {
        state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        s->cover[i] = 1.0 + (s->plan->cover ? (double)(state >> 11) * 0x1p-53 : 0.0);
    }
}

perp_status perp__path_run(perp__newton *s, perp_outcome *outcome)
{
    const int64_t most =
        FACTORISATIONS < EFFORT / (1 + s->blocks.n) ? FACTORISATIONS : EFFORT / (1 + s->blocks.n);
    double t = FIRST, tangent_t = -1.0, length = 1.0, next = INTERIOR, size;
    int32_t moved;
    perp_status status;

    *outcome = PERP_OUTCOME_STALLED;
    choose_cover(s);
    status = begin(s);
    for (int32_t step = 0; status == PERP_OK && step < STEPS && t > LAST && t <= 2.0 * FIRST;
         step++) {
        perp_outcome request = perp__newton_tick(s, &status);

        if (request >= 0 || status != PERP_OK) {
            *outcome = request;
            return status;
        }
        if (s->matrix.factorisations > most)
            break;
        moved = advance(s, &t, &tangent_t, &length);
        if (moved <= 0)
            return moved;
        if (t > next)
            continue;
        next = 0.1 * t;
        evaluate(s, s->v, t, s->error);
        status = perp__interior_run(s, outcome);
        if (status != PERP_OK || *outcome != PERP_OUTCOME_STALLED || s->best_residual <= GOOD)
            return status;
        status = linearise(s, s->v, t, &size);
    }
    return status == PERP__FACTOR_SINGULAR ? PERP_OK : status;
}
