/* Symmetric positive semidefinite M that is known by its products alone: modified proportioning
 * with reduced gradient projections (MPRGP; Dostal & Schoberl, Comput. Optim. Appl. 30 (2005) 23;
 * Dostal, "Optimal Quadratic Programming Algorithms" (2009), section 5.8).
 *
 * The problem is min z'Mz/2 + q'z over [l, u]. Its gradient g = w falls into a free part phi, where
 * z is between its bounds, and a chopped part beta, what pushes off a bound. With
 *
 *   |beta|^2 <= phi~'phi   (phi~: what of phi a step of length `reach` can go within the bounds)
 *
 * z is proportional: then a step of conjugate gradients on the free variables, and where that ends
 * at a bound a projected step along phi. Else a step along beta lets variables go. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/clock.h"
#include "base/context.h"
#include "base/outcome.h"
#include "lcp/method.h"
#include "lcp/lcp.h"
#include "linalg/scale.h"

/* Steps along the gradient that cannot climb are shorter than 2 / |M|. */
#define REACH 1.9

/* Products for |M| by powers; Rayleigh quotients of later directions raise it. */
#define POWERS 8

typedef struct projected {
    perp_context *context;
    perp_lcp_settings settings;
    perp__lcp_control control;
    perp_lcp_product product;
    void *user;
    perp__arena arena;
    int32_t n;
    int32_t failed; /* a product was not finite, or its answer positive */
    int32_t fresh;  /* the gradient is a product's, not a sum of images */
    int64_t products, limit;
    double norm;      /* of D M D, from below */
    double curvature; /* of `direction`, with `image`, if the next may be conjugate to it; else 0 */
    int32_t omega;    /* log2: scaled numbers are z / (D omega), D w / omega; */
    int32_t *exponents; /* and of D */
    double *scale, *q, *lower, *upper, *x, *gradient, *best;
    double *free_part, *chopped, *direction, *image;
    double *kept, *kept_gradient; /* before an expansion */
    double *caller_z;
    perp_status status;
} projected;

static void layout(perp__arena *arena, void *object)
{
    projected *p = object;

    PERP__DOUBLES(arena, (size_t)p->n, &p->scale, &p->q, &p->lower, &p->upper, &p->x, &p->gradient,
                  &p->best, &p->kept, &p->kept_gradient, &p->free_part, &p->chopped, &p->direction,
                  &p->image, &p->caller_z);
    p->exponents = perp__arena_take(arena, (size_t)p->n, sizeof *p->exponents);
}

/* y := D M D x; false where there is none. */
static bool multiply(projected *p, double *y, const double *x)
{
    int32_t answer, finite = 1;

    for (int32_t i = 0; i < p->n; i++) {
        p->caller_z[i] = p->scale[i] * x[i];
        y[i] = NAN; /* what the callback leaves out is not what it wrote before */
    }
    answer = p->product(y, p->caller_z, p->user);
    p->products++;
    for (int32_t i = 0; i < p->n; i++) {
        y[i] *= p->scale[i];
        finite &= isfinite(y[i]) != 0;
    }
    if (answer < 0)
        p->status =
            perp__fail(p->context, PERP_ERROR_CALLBACK, "the product returned %d", (int)answer);
    else if (answer > 0 || !finite)
        p->failed = 1;
    return answer == 0 && finite;
}

/* |D M D| by powers, from a start that no symmetry of a grid is orthogonal to. The first two tell
 * whether M is symmetric: with v = M u, v'M u and u'M v agree to half of the digits. */
static bool find_norm(projected *p)
{
    const int32_t n = p->n;
    const size_t bytes = (size_t)n * sizeof(double);
    double *u = p->direction, *first = p->chopped;
    uint64_t state = 1;

    p->norm = DBL_MIN; /* of M = 0 */
    for (int32_t i = 0; i < n; i++) {
        state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        u[i] = 0.5 + ldexp((double)(state >> 11), -53);
    }
    for (int32_t k = 0; k < POWERS; k++) {
        const double size = sqrt(perp__dot(u, u, n));

        if (!(size > 0.0))
            return 1;
        for (int32_t i = 0; i < n; i++)
            u[i] /= size;
        if (!multiply(p, p->image, u))
            return 0;
        perp__raise_to(&p->norm, sqrt(perp__dot(p->image, p->image, n)));
        if (k == 0)
            memcpy(first, u, bytes);
        if (k == 1 &&
            !(fabs(size - perp__dot(first, p->image, n)) <= sqrt(DBL_EPSILON) * p->norm)) {
            p->status = perp__refuse(
                p->context, "the product is not symmetric: v'M u = %g, u'M v = %g for two vectors",
                size, perp__dot(first, p->image, n));
            return 0;
        }
        memcpy(u, p->image, bytes);
    }
    return 1;
}

/* Scaled gradient at x. */
static bool find_gradient(projected *p)
{
    if (!multiply(p, p->gradient, p->x))
        return 0;
    for (int32_t i = 0; i < p->n; i++)
        p->gradient[i] += p->q[i];
    p->fresh = 1;
    p->curvature = 0.0;
    return 1;
}

/* The parts of the gradient; returns the residual. *proportion: |beta|^2 - phi~'phi. */
static double split(projected *p, double reach, double *proportion)
{
    double residual = 0.0;

    *proportion = 0.0;
    for (int32_t i = 0; i < p->n; i++) {
        const double above = p->x[i] - p->lower[i], below = p->x[i] - p->upper[i];
        const double g = p->gradient[i];
        const bool at_lower = above <= 0.0, at_upper = below >= 0.0;

        p->free_part[i] = at_lower || at_upper ? 0.0 : g;
        p->chopped[i] = at_lower == at_upper ? 0.0 : at_lower ? fmin(g, 0.0) : fmax(g, 0.0);
        *proportion += p->chopped[i] * p->chopped[i];
        if (p->free_part[i] != 0.0)
            *proportion -= g * perp__middle(above / reach, below / reach, g);
        perp__raise_to(&residual, fabs(perp__middle(above, below, g)));
    }
    return residual;
}

/* How far x - step d stays within the bounds. */
static double longest_step(const projected *p, const double *d)
{
    double longest = INFINITY;

    for (int32_t i = 0; i < p->n; i++) {
        const double room = d[i] > 0.0   ? (p->x[i] - p->lower[i]) / d[i]
                            : d[i] < 0.0 ? (p->x[i] - p->upper[i]) / d[i]
                                         : INFINITY;

        longest = room < longest ? room : longest;
    }
    return longest;
}

/* x := x - step d, onto the bound where that ends there; the gradient with it. False where that
 * leaves the range of doubles. */
static bool move(projected *p, double step, const double *d)
{
    bool finite = 1;

    for (int32_t i = 0; i < p->n; i++) {
        if (d[i] > 0.0 && step >= (p->x[i] - p->lower[i]) / d[i])
            p->x[i] = p->lower[i];
        else if (d[i] < 0.0 && step >= (p->x[i] - p->upper[i]) / d[i])
            p->x[i] = p->upper[i];
        else
            p->x[i] -= step * d[i];
        p->gradient[i] -= step * p->image[i];
        finite &= fabs(p->x[i]) <= DBL_MAX;
    }
    return finite;
}

/* 2 (z'Mz/2 + q'z); *rounding: what may be wrong with it. */
static double energy(const projected *p, double *rounding)
{
    double sum = 0.0, size = 0.0;

    for (int32_t i = 0; i < p->n; i++) {
        const double term = p->x[i] * (p->gradient[i] + p->q[i]);

        sum += term;
        size += fabs(term);
    }
    *rounding = p->n * DBL_EPSILON * size;
    return sum;
}

/* A step along d that met a bound: on to its end, projected onto the bounds (Kruzik, Horak, Cermak,
 * Pospisil & Pecha, Adv. Eng. Softw. 145 (2020) 102775). Where that climbs a projected step along
 * the free gradient instead, which falls if |M| is as it is thought to be. */
static bool expand(projected *p, double rest, const double *d)
{
    const size_t bytes = (size_t)p->n * sizeof(double);
    const double reach = REACH / p->norm;
    double rounding, proportion;
    const double before = energy(p, &rounding);

    memcpy(p->kept, p->x, bytes);
    memcpy(p->kept_gradient, p->gradient, bytes);
    for (int32_t i = 0; i < p->n; i++)
        p->x[i] = perp__clamp(perp__clamp(p->x[i] - rest * d[i], -DBL_MAX, DBL_MAX), p->lower[i],
                              p->upper[i]);
    if (!find_gradient(p))
        return 0;
    if (energy(p, &rounding) <= before + rounding)
        return 1;
    memcpy(p->x, p->kept, bytes);
    memcpy(p->gradient, p->kept_gradient, bytes);
    (void)split(p, reach, &proportion);
    for (int32_t i = 0; i < p->n; i++)
        if (p->free_part[i] != 0.0)
            p->x[i] = perp__clamp(p->x[i] - reach * p->free_part[i], p->lower[i], p->upper[i]);
    if (!find_gradient(p))
        return 0;
    if (energy(p, &rounding) > before + rounding)
        p->norm *= 2.0;
    return 1;
}

/* One step from a point that is split. False where none is left, or a product failed. */
static bool advance(projected *p, bool is_proportional)
{
    const int32_t n = p->n;
    double *d = is_proportional ? p->direction : p->chopped;
    double longest, step, square, curvature;

    /* 1. Where to: conjugate to the last direction, if that was one of the same variables. */
    if (is_proportional) {
        const double back =
            p->curvature > 0.0 ? perp__dot(p->free_part, p->image, n) / p->curvature : 0.0;

        for (int32_t i = 0; i < n; i++)
            d[i] = back == 0.0 ? p->free_part[i] : p->free_part[i] - back * d[i];
    }
    p->curvature = 0.0;
    if (!multiply(p, p->image, d))
        return 0;
    /* 2. How far: to the minimum, or to a bound. A curvature that rounding may have made is 0. */
    square = perp__dot(d, d, n);
    curvature = perp__dot(d, p->image, n);
    if (curvature > n * DBL_EPSILON * p->norm * square)
        perp__raise_to(&p->norm, curvature / square);
    else
        curvature = 0.0;
    longest = longest_step(p, d);
    step = curvature > 0.0 ? perp__dot(d, p->gradient, n) / curvature : INFINITY;
    if (!(fmin(step, longest) < INFINITY))
        return 0; /* it falls for ever: M is not definite there, or no z solves this */
    p->fresh = 0;
    if (!move(p, fmin(step, longest), d))
        return 0;
    if (is_proportional && step > longest)
        return expand(p, curvature > 0.0 ? step - longest : 0.0, d);
    if (is_proportional)
        p->curvature = curvature;
    return 1;
}

/* |residual| / (|M| |x| + |q|), each in the 2-norm. */
static double backward_error(const projected *p)
{
    double sum = 0.0;

    for (int32_t i = 0; i < p->n; i++) {
        const double r = perp__middle(p->x[i] - p->lower[i], p->x[i] - p->upper[i], p->gradient[i]);

        sum += r * r;
    }
    return sum == 0.0 ? 0.0
                      : sqrt(sum) / (p->norm * sqrt(perp__dot(p->x, p->x, p->n)) +
                                     sqrt(perp__dot(p->q, p->q, p->n)));
}

static bool is_rounding(const projected *p, double residual)
{
    return residual <= sqrt(p->settings.tol) && backward_error(p) <= PERP__ROUNDING_LIMIT;
}

/* Runs from x; leaves the best point there, with its gradient. A product that fails is told by
 * `status` or by the outcome. */
static perp_outcome search(projected *p)
{
    const size_t bytes = (size_t)p->n * sizeof(double);
    double remembered = INFINITY, lowest = INFINITY, window = INFINITY, level = INFINITY;
    double residual, proportion, rounding;
    int64_t next = PERP__STAGNATION;
    bool claimed = 0; /* images said that this is the end */
    perp_outcome outcome = -1;

    if (!find_gradient(p) || !find_norm(p))
        return PERP_OUTCOME_EVALUATION_FAILED;
    while (outcome < 0) {
        residual = split(p, REACH / p->norm, &proportion);
        /* 1. What counts is a product's gradient, not a sum of images. */
        if (!p->fresh && (residual <= p->settings.tol || p->products >= next)) {
            claimed = residual <= p->settings.tol;
            if (!find_gradient(p))
                return PERP_OUTCOME_EVALUATION_FAILED;
            continue;
        }
        if (residual < 0.5 * remembered) {
            memcpy(p->best, p->x, bytes);
            remembered = residual;
        }
        lowest = fmin(lowest, residual);
        /* 2. Is this the end? */
        if (residual <= p->settings.tol)
            outcome = PERP_OUTCOME_SOLVED;
        else if (claimed && is_rounding(p, residual))
            outcome = PERP_OUTCOME_ROUNDING_LIMIT;
        else if (p->products >= next && lowest > PERP__STAGNATION_FACTOR * window &&
                 energy(p, &rounding) >= level - rounding)
            outcome = is_rounding(p, residual) ? PERP_OUTCOME_ROUNDING_LIMIT : PERP_OUTCOME_STALLED;
        else if (p->products >= p->limit)
            outcome = PERP_OUTCOME_ITERATION_LIMIT;
        else
            outcome = perp__lcp_tick(&p->control, p->products, residual);
        claimed = 0;
        if (p->products >= next) {
            window = lowest;
            level = energy(p, &rounding);
            next = p->products + PERP__STAGNATION;
        }
        /* 3. A step. */
        if (outcome < 0 && !advance(p, proportion <= 0.0))
            outcome = p->failed ? PERP_OUTCOME_EVALUATION_FAILED : PERP_OUTCOME_STALLED;
    }
    if (outcome != PERP_OUTCOME_SOLVED && outcome != PERP_OUTCOME_ROUNDING_LIMIT) {
        memcpy(p->x, p->best, bytes);
        if (!p->failed && !find_gradient(p))
            outcome = PERP_OUTCOME_EVALUATION_FAILED;
    }
    return outcome;
}

/* ---- the front ---- */

/* Everything that the caller gave, but for the settings. */
static perp_status check(perp_context *context, const perp_lcp_result *result, const double *z,
                         const perp_lcp_problem *problem, const double *z0)
{
    const int32_t n = problem->n;
    const double *diagonal = problem->diagonal;
    const size_t count = n > 0 ? (size_t)n : 0;
    perp_status status = PERP__CHECK(perp_lcp_result, context, result);

    if (status == PERP_OK && n < 0)
        status = perp__refuse(context, "n is %d, must not be negative", (int)n);
    if (status == PERP_OK && problem->M)
        status = perp__refuse(context, "problem has M and a product, expected one of them");
    if (status == PERP_OK && n > 0)
        status = perp__check_pointer(context, "z", z);
    PERP__THEN(status, perp__check_vector(context, "q", problem->q, count));
    PERP__THEN(status, perp__check_bounds(context, problem->lower, problem->upper, count));
    PERP__THEN(status, perp__check_finite(context, "diagonal", diagonal, count));
    PERP__THEN(status, perp__check_finite(context, "z0", z0, count));
    for (int32_t i = 0; i < n && diagonal && status == PERP_OK; i++)
        if (!(diagonal[i] > 0.0))
            status =
                perp__refuse(context, "diagonal[%d] = %g, must be positive", (int)i, diagonal[i]);
    return status;
}

/* z in scaled numbers; what is finite stays so. */
static double scale_place(const projected *p, int32_t i, double z)
{
    return isinf(z) ? z
                    : perp__clamp(perp__shift(z, -p->exponents[i] - p->omega), -DBL_MAX, DBL_MAX);
}

/* D of powers of two next to M_ii^-1/2, omega of that next to max |D q|, and the start. */
static void scale_problem(projected *p, const double *diagonal, const double *q,
                          const double *lower, const double *upper, const double *z0)
{
    bool any = 0;

    p->omega = 0;
    for (int32_t i = 0; i < p->n; i++) {
        const int32_t power = diagonal ? perp__exponent_of(diagonal[i]) : 0;

        p->exponents[i] = -(power - (power & 1)) / 2; /* rounded down */
        p->scale[i] = perp__power_of_two(p->exponents[i]);
        if (q[i] != 0.0) {
            const int32_t size = perp__exponent_of(q[i]) + p->exponents[i];

            p->omega = any && p->omega > size ? p->omega : size;
            any = 1;
        }
    }
    for (int32_t i = 0; i < p->n; i++) {
        p->q[i] = perp__shift(q[i], p->exponents[i] - p->omega);
        p->lower[i] = lower ? scale_place(p, i, lower[i]) : 0.0;
        p->upper[i] = upper ? scale_place(p, i, upper[i]) : INFINITY;
        p->x[i] = perp__clamp(z0 ? scale_place(p, i, z0[i]) : 0.0, p->lower[i], p->upper[i]);
    }
}

/* The answer in the caller's units, of which powers of two change no bit. What doubles cannot hold
 * there is no answer. */
static void write_answer(const projected *p, double *z, double *w, perp_lcp_result *copy,
                         const double *lower, const double *upper)
{
    double residual = 0.0, natural = 0.0;
    bool held = 1;

    for (int32_t i = 0; i < p->n; i++) {
        const int32_t unit = p->exponents[i] + p->omega;
        const double low = lower ? lower[i] : 0.0, up = upper ? upper[i] : INFINITY;
        const double force = perp__shift(p->gradient[i], p->omega - p->exponents[i]);
        const double place = perp__clamp(perp__shift(p->x[i], unit), -DBL_MAX, DBL_MAX);

        z[i] = p->x[i] <= p->lower[i]   ? low
               : p->x[i] >= p->upper[i] ? up
                                        : perp__clamp(place, low, up);
        if (w)
            w[i] = force;
        held &= fabs(force) <= DBL_MAX &&
                fabs(perp__shift(place, -unit) - p->x[i]) <= DBL_EPSILON * fabs(p->x[i]);
        perp__raise_to(&residual,
                       fabs(perp__mid(p->x[i], p->lower[i], p->upper[i], p->gradient[i])));
        perp__raise_to(&natural, fabs(perp__mid(z[i], low, up, force)));
    }
    if (!held && perp__is_good(copy->outcome))
        copy->outcome = PERP_OUTCOME_STALLED;
    copy->residual = held ? perp__told(residual) : INFINITY;
    copy->natural_residual = held ? perp__told(natural) : INFINITY;
    copy->backward_error = perp__told(backward_error(p));
}

static perp_status solve(projected *p, double *z, double *w, perp_lcp_result *result,
                         const perp_lcp_problem *problem, const double *z0)
{
    const double started = perp__now();
    perp_lcp_result copy = {.method = PERP_LCP_MPRGP};
    perp_status status = perp__arena_fit(&p->arena, p->context, layout, p);

    if (status != PERP_OK)
        return status;
    p->limit = p->settings.max_iterations > 0 ? p->settings.max_iterations : PERP__SWEEPS_MOST;
    p->control = (perp__lcp_control){
        .monitor = p->settings.monitor,
        .monitor_user = p->settings.monitor_user,
        .method = PERP_LCP_MPRGP,
        .deadline = p->settings.time_limit > 0.0 ? started + p->settings.time_limit : 0.0};
    scale_problem(p, problem->diagonal, problem->q, problem->lower, problem->upper, z0);
    copy.outcome = search(p);
    if (p->status == PERP_OK && p->control.aborted)
        p->status = perp__fail(p->context, PERP_ERROR_CALLBACK, "the monitor ended the call");
    if (p->status != PERP_OK)
        return p->status;
    write_answer(p, z, w, &copy, problem->lower, problem->upper);
    copy.iterations = p->products;
    copy.seconds = perp__now() - started;
    perp__struct_write(result, &copy, sizeof copy);
    return PERP_OK;
}

perp_status perp__lcp_solve_product(perp_context *context, double *z, double *w,
                                    perp_lcp_result *result, const perp_lcp_settings *settings,
                                    const perp_lcp_problem *problem, const double *z0)
{
    projected p = {
        .context = context, .n = problem->n, .product = problem->product, .user = problem->user};
    perp_status status = perp__lcp_settings_read(context, &p.settings, settings);

    PERP__THEN(status, check(context, result, z, problem, z0));
    PERP__THEN(status, solve(&p, z, w, result, problem, z0));
    perp__arena_release(&p.arena);
    return status;
}
