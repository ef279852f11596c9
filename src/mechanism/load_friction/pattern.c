/* Within a pattern of modes and signs the system is linear: rows of the coordinates that move,
 *
 *   sum_j (A_ij + t_i C_ij) x_j = tau_i - b_i - t_i d_i,   t_i = mu_i sign_i side_i,
 *
 * and x_i = stop_i where they stick. Solved with complete pivoting and corrected by residuals in
 * doubled precision, then compared with what the pattern assumes. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "mechanism/load_friction/load_friction.h"

/* A pivot below this many tol of the largest entry is 0: the effective inertia may be. */
static const double singular = 4.0;
/* Patterns that are wrong by this much, relatively, are not worth a bound of the error ... */
static const double clearly = 1e-3;
/* ... if no pivot is smaller than this. */
static const double regular = 1e-8;
/* With entries up to here elimination with complete pivoting does not overflow. */
static const double largest = 0x1p1000;

static size_t at(const perp_load_friction *f, int32_t i, int32_t j)
{
    return (size_t)i + (size_t)f->n * (size_t)j;
}

static double sign_of(const perp_load_friction *f, int32_t i)
{
    switch (f->pattern.mode[i]) {
    case PERP_LOAD_FORWARD:
        return 1.0;
    case PERP_LOAD_BACKWARD:
        return -1.0;
    case PERP_LOAD_STICK:
        return 0.0;
    default:
        return f->question.sign[i];
    }
}

/* ---- linear equations ---------------------------------------------------------------------- */

/* The scaled block of the coordinates in `list`; returns its largest entry. */
static double load_block(perp_load_friction *f)
{
    const int32_t m = f->system.n;
    double top = 0.0;
    int32_t r, c;

    for (r = 0; r < m; r++) {
        const int32_t i = f->list[r];

        for (c = 0; c < m; c++) {
            const int32_t j = f->list[c];
            const double unit = f->size[i] * f->size[j];
            const double a = f->A[at(f, i, j)], friction = f->slope[i] * f->C[at(f, i, j)];

            f->system.K[(size_t)r * (size_t)m + (size_t)c] = (a + friction) * unit;
            perp__raise_to(&top, (fabs(a) + fabs(friction)) * unit);
        }
    }
    return top;
}

/* Entries of x, or of the rows, in the units of the system. */
static void gather(const perp_load_friction *f, double *to, const double *from)
{
    int32_t r;

    for (r = 0; r < f->system.n; r++)
        to[r] = f->size[f->list[r]] * from[f->list[r]];
}

/* What is unknown, from the units of the system into x's. */
static void scatter(const perp_load_friction *f, double *to, const double *from)
{
    int32_t r;

    memset(to, 0, (size_t)f->n * sizeof *to);
    for (r = 0; r < f->system.n; r++)
        to[f->list[r]] = f->size[f->list[r]] * from[r];
}

/* ---- doubled precision --------------------------------------------------------------------- */

/* sum += x, with what is lost in *low */
static void add(double *sum, double *low, double x)
{
    const double s = *sum + x, back = s - *sum;

    *low += (*sum - (s - back)) + (x - back);
    *sum = s;
}

/* normal = C x + d, and friction's side of the rows: rhs_i = tau_i - b_i - (A x)_i - t_i N_i
 */
static void residuals(perp_load_friction *f)
{
    int32_t i;

    perp__multiply_doubled(&f->A_view, f->x, f->b, f->product, f->product_low);
    perp__multiply_doubled(&f->C_view, f->x, f->d, f->normal, f->normal_low);
    for (i = 0; i < f->n; i++) {
        const double t = f->slope[i], product = t * f->normal[i];
        double sum = f->question.tau[i], low = 0.0;

        add(&sum, &low, -f->product[i]);
        add(&sum, &low, -product);
        low -= f->product_low[i] + fma(t, f->normal[i], -product) + t * f->normal_low[i];
        f->rhs[i] = sum + low;
    }
}

/* The same in working precision, for a first look. */
static void rough_residuals(perp_load_friction *f)
{
    int32_t i;

    perp__multiply(&f->A_view, f->x, f->product);
    perp__multiply(&f->C_view, f->x, f->normal);
    for (i = 0; i < f->n; i++) {
        f->normal[i] += f->d[i];
        f->rhs[i] = f->question.tau[i] - f->b[i] - f->product[i] - f->slope[i] * f->normal[i];
    }
}

/* x := x + K^-1 rhs */
static void correct(perp_load_friction *f)
{
    double *rhs = f->work, *change = rhs + f->n;
    int32_t r;

    gather(f, rhs, f->rhs);
    perp__pivoting_solve(&f->system, change, rhs);
    for (r = 0; r < f->system.n; r++)
        f->x[f->list[r]] += f->size[f->list[r]] * change[r];
}

/* Sizes of what is summed up in each row, in the caller's units. */
static void find_loads(perp_load_friction *f)
{
    int32_t i, j;

    for (i = 0; i < f->n; i++) {
        double inertia = fabs(f->question.tau[i]) + fabs(f->b[i]), normal = fabs(f->d[i]);

        for (j = 0; j < f->n; j++) {
            inertia += fabs(f->A[at(f, i, j)] * f->x[j]);
            normal += fabs(f->C[at(f, i, j)] * f->x[j]);
        }
        f->load[i] = inertia + fabs(f->slope[i]) * normal;
        f->normal_width[i] = f->settings.tol * normal;
    }
}

void perp__friction_evaluate(perp_load_friction *f)
{
    residuals(f);
    find_loads(f);
}

/* What tol is worth in x, and from there in the normal forces. */
static void find_widths(perp_load_friction *f)
{
    double *load = f->work, *width = load + f->n;
    int32_t r, i, j;

    gather(f, load, f->load);
    perp__pivoting_widths(&f->system, width, load);
    for (r = 0; r < f->system.n; r++)
        width[r] *= f->settings.tol;
    scatter(f, f->width, width);
    for (i = 0; i < f->n; i++)
        for (j = 0; j < f->n; j++)
            f->normal_width[i] += fabs(f->C[at(f, i, j)]) * f->width[j];
}

/* ---- the pattern --------------------------------------------------------------------------- */

/* `noise`: of x in its units, by rounding. */
static int32_t clearly_wrong(const perp_load_friction *f, double noise)
{
    int32_t i, j;

    for (i = 0; i < f->n; i++) {
        double limit = clearly * (f->normal_width[i] / f->settings.tol);

        for (j = 0; j < f->n; j++)
            limit += fabs(f->C[at(f, i, j)]) * f->size[j] * noise;
        if (f->pattern.side[i] * f->normal[i] < -limit)
            return 1;
    }
    return 0;
}

/* A generous bound of what rounding does to a solution with pivots of at least `least`. */
static double noise_of(const perp_load_friction *f, double least)
{
    double load = 0.0;
    int32_t i;

    for (i = 0; i < f->n; i++)
        perp__raise_to(&load, f->size[i] * f->load[i]);
    return 1e3 * f->n * DBL_EPSILON * load / least;
}

static void find_null_space(perp_load_friction *f)
{
    int32_t k;

    for (k = 0; k < f->system.n - f->system.rank; k++) {
        perp__pivoting_null(&f->system, f->work, k);
        scatter(f, f->null + (size_t)k * (size_t)f->n, f->work);
    }
}

/* Whether the rows that elimination left without a pivot have a right-hand side of 0, too. */
static int32_t is_consistent(const perp_load_friction *f)
{
    double *rhs = f->work, *load = rhs + f->n;

    gather(f, rhs, f->rhs);
    gather(f, load, f->load);
    return perp__pivoting_is_consistent(&f->system, rhs, load, 4.0 * f->settings.tol);
}

/* Whether all that an answer is judged by is a number. */
static int32_t is_finite(const perp_load_friction *f)
{
    const double *const vectors[] = {f->x, f->rhs, f->load, f->normal, f->width, f->normal_width};
    size_t k;

    for (k = 0; k < sizeof vectors / sizeof *vectors; k++)
        if (!perp__all_finite(vectors[k], (size_t)f->n))
            return 0;
    return 1;
}

/* Numbers beyond the range of doubles: nothing is known of the pattern. */
static int32_t give_up(perp_load_friction *f)
{
    f->answers.incomplete = 1;
    return -1;
}

int32_t perp__friction_solve_pattern(perp_load_friction *f)
{
    double top;
    int32_t i, round;

    f->system.n = 0;
    for (i = 0; i < f->n; i++) {
        const int32_t sticks = f->pattern.mode[i] == PERP_LOAD_STICK;

        f->slope[i] = f->mu[i] * sign_of(f, i) * f->pattern.side[i];
        f->x[i] = sticks ? f->question.stop[i] : 0.0;
        if (!sticks)
            f->list[f->system.n++] = i;
    }
    top = load_block(f);
    if (!(top <= largest))
        return give_up(f);
    perp__pivoting_eliminate(&f->system, singular * f->settings.tol * top, f->n);
    rough_residuals(f);
    correct(f);
    if (f->system.rank == f->system.n && f->system.least > regular * top && !f->insist) {
        rough_residuals(f);
        find_loads(f);
        if (clearly_wrong(f, noise_of(f, f->system.least)))
            return -1;
    }
    for (round = 0; round < 2; round++) {
        residuals(f);
        correct(f);
    }
    perp__friction_evaluate(f);
    find_widths(f);
    if (!is_finite(f))
        return give_up(f);
    if (f->system.rank == f->system.n)
        return 0;
    if (!is_consistent(f))
        return -1;
    find_null_space(f);
    return f->system.n - f->system.rank;
}

/* Whether the equation of coordinate i, which moves, holds beside the row's own terms. */
static int32_t row_holds(const perp_load_friction *f, int32_t i)
{
    return fabs(f->rhs[i]) <= fmax(f->settings.tol, 16.0 * DBL_EPSILON) * f->load[i];
}

int32_t perp__friction_holds(perp_load_friction *f, int32_t *at_vertex)
{
    int32_t i, j;

    *at_vertex = 0;
    for (i = 0; i < f->n; i++) {
        if (f->pattern.mode[i] != PERP_LOAD_STICK && !row_holds(f, i)) {
            f->answers.incomplete =
                1; /* the pattern's equations have a solution, and this is not it */
            return 0;
        }
    }
    for (i = 0; i < f->n; i++) {
        const int32_t mode = f->pattern.mode[i];
        const double normal = f->normal[i] + f->normal_low[i];

        if (mode == PERP_LOAD_STICK) {
            double width = f->settings.tol * f->load[i];

            for (j = 0; j < f->n; j++)
                width += fabs(f->A[at(f, i, j)]) * f->width[j];
            width += f->question.mu_stick[i] * f->normal_width[i];
            if (!perp__is_met(f->question.mu_stick[i] * fabs(normal) - fabs(f->rhs[i]), width,
                              at_vertex))
                return 0;
        } else if (f->pattern.side[i] != 0 &&
                   !perp__is_met(f->pattern.side[i] * normal, f->normal_width[i], at_vertex)) {
            return 0;
        }
        /* where a slide from rest has no acceleration it sticks as well, and is found so */
        if (mode != PERP_LOAD_STICK && f->question.sign[i] == 0) {
            const double start = sign_of(f, i) * (f->x[i] - f->question.stop[i]);

            if (!(start > f->width[i]))
                return 0;
        }
    }
    return 1;
}
