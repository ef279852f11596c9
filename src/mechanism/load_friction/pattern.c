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

/* The scaled block into K, m by m with leading dimension n, its unit matrix next to it into
 * `inverse`; returns its largest entry. */
static double load_block(perp_load_friction *f, int32_t m)
{
    double top = 0.0;
    int32_t r, c;

    for (r = 0; r < m; r++) {
        const int32_t i = f->list[r];

        for (c = 0; c < m; c++) {
            const int32_t j = f->list[c];
            const double unit = f->size[i] * f->size[j];
            const double a = f->A[at(f, i, j)], friction = f->slope[i] * f->C[at(f, i, j)];

            f->K[at(f, r, c)] = (a + friction) * unit;
            f->inverse[at(f, r, c)] = r == c ? 1.0 : 0.0;
            perp__raise_to(&top, (fabs(a) + fabs(friction)) * unit);
        }
        f->columns[r] = r;
    }
    return top;
}

static void exchange_rows(perp_load_friction *f, double *B, int32_t m, int32_t p, int32_t q)
{
    int32_t j;

    for (j = 0; j < m && p != q; j++) {
        const double kept = B[at(f, p, j)];

        B[at(f, p, j)] = B[at(f, q, j)];
        B[at(f, q, j)] = kept;
    }
}

static void exchange_columns(perp_load_friction *f, int32_t m, int32_t p, int32_t q)
{
    const int32_t name = f->columns[p];
    int32_t i;

    for (i = 0; i < m && p != q; i++) {
        const double kept = f->K[at(f, i, p)];

        f->K[at(f, i, p)] = f->K[at(f, i, q)];
        f->K[at(f, i, q)] = kept;
    }
    f->columns[p] = f->columns[q];
    f->columns[q] = name;
}

static void eliminate(perp_load_friction *f, int32_t m, int32_t k)
{
    const double pivot = f->K[at(f, k, k)];
    int32_t i, j;

    for (j = 0; j < m; j++) {
        f->K[at(f, k, j)] /= pivot;
        f->inverse[at(f, k, j)] /= pivot;
    }
    for (j = 0; j < m; j++) {
        const double right = f->K[at(f, k, j)], unit = f->inverse[at(f, k, j)];

        for (i = 0; i < m; i++)
            if (i != k) {
                f->work[i] = j == 0 ? f->K[at(f, i, k)] : f->work[i];
                if (j > k)
                    f->K[at(f, i, j)] -= f->work[i] * right;
                f->inverse[at(f, i, j)] -= f->work[i] * unit;
            }
    }
    for (i = 0; i < m; i++)
        f->K[at(f, i, k)] = i == k ? 1.0 : 0.0;
}

/* Gauss-Jordan with complete pivoting; returns the rank, *least: the smallest pivot beside `top`.
 */
static int32_t reduce(perp_load_friction *f, int32_t m, double top, double *least)
{
    int32_t k, i, j;

    *least = 1.0;
    for (k = 0; k < m; k++) {
        int32_t row = k, column = k;

        for (j = k; j < m; j++)
            for (i = k; i < m; i++)
                if (fabs(f->K[at(f, i, j)]) > fabs(f->K[at(f, row, column)])) {
                    row = i;
                    column = j;
                }
        if (!(fabs(f->K[at(f, row, column)]) > singular * f->settings.tol * top))
            return k;
        *least = fmin(*least, fabs(f->K[at(f, row, column)]) / top);
        exchange_rows(f, f->K, m, k, row);
        exchange_rows(f, f->inverse, m, k, row);
        exchange_columns(f, m, k, column);
        eliminate(f, m, k);
    }
    return m;
}

/* ---- doubled precision --------------------------------------------------------------------- */

/* sum += x, with what is lost in *low */
static void add(double *sum, double *low, double x)
{
    const double s = *sum + x, back = s - *sum;

    *low += (*sum - (s - back)) + (x - back);
    *sum = s;
}

/* normal = C x + d, and friction's side of the rows: residual_i = tau_i - b_i - (A x)_i - t_i N_i
 */
static void residuals(perp_load_friction *f, double *residual)
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
        residual[i] = sum + low;
    }
}

/* The same in working precision, for a first look. */
static void rough_residuals(perp_load_friction *f, double *residual)
{
    int32_t i;

    perp__multiply(&f->A_view, f->x, f->product);
    perp__multiply(&f->C_view, f->x, f->normal);
    for (i = 0; i < f->n; i++) {
        f->normal[i] += f->d[i];
        residual[i] = f->question.tau[i] - f->b[i] - f->product[i] - f->slope[i] * f->normal[i];
    }
}

/* x_L += inverse residual_L; the rank first rows of `inverse` belong to columns[0], ... */
static void correct(perp_load_friction *f, int32_t m, int32_t rank, const double *residual)
{
    int32_t r, k;

    for (k = 0; k < rank; k++) {
        const int32_t j = f->list[f->columns[k]];
        double sum = 0.0;

        for (r = 0; r < m; r++)
            sum += f->inverse[at(f, k, r)] * (f->size[f->list[r]] * residual[f->list[r]]);
        f->x[j] += f->size[j] * sum;
    }
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
    residuals(f, f->rhs);
    find_loads(f);
}

/* What tol is worth in x, and from there in the normal forces. */
static void find_widths(perp_load_friction *f, int32_t m, int32_t rank)
{
    int32_t r, k, i, j;

    memset(f->width, 0, (size_t)f->n * sizeof *f->width);
    for (k = 0; k < rank; k++) {
        double sum = 0.0;

        for (r = 0; r < m; r++)
            sum += fabs(f->inverse[at(f, k, r)]) * f->size[f->list[r]] * f->load[f->list[r]];
        f->width[f->list[f->columns[k]]] = f->settings.tol * sum * f->size[f->list[f->columns[k]]];
    }
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

/* A generous bound of what rounding does to a solution with pivots of at least `least` top. */
static double noise_of(const perp_load_friction *f, double top, double least)
{
    double load = 0.0;
    int32_t i;

    for (i = 0; i < f->n; i++)
        perp__raise_to(&load, f->size[i] * f->load[i]);
    return 1e3 * f->n * DBL_EPSILON * load / (top * least);
}

/* The null space in the caller's units: with columns[k] = free, x_columns[l] = -K_lk. */
static void find_null_space(perp_load_friction *f, int32_t m, int32_t rank)
{
    int32_t k, l;

    memset(f->null, 0, (size_t)f->n * (size_t)f->n * sizeof *f->null);
    for (k = rank; k < m; k++) {
        double *direction = f->null + (size_t)(k - rank) * (size_t)f->n;
        const int32_t free_one = f->list[f->columns[k]];

        direction[free_one] = f->size[free_one];
        for (l = 0; l < rank; l++) {
            const int32_t j = f->list[f->columns[l]];

            direction[j] = -f->size[j] * f->K[at(f, l, k)];
        }
    }
}

/* Whether the rows that elimination left without a pivot have a right-hand side of 0, too. */
static int32_t is_consistent(const perp_load_friction *f, int32_t m, int32_t rank,
                             const double *residual)
{
    int32_t k, r;

    for (k = rank; k < m; k++) {
        double sum = 0.0, size = 0.0;

        for (r = 0; r < m; r++) {
            const double factor = f->inverse[at(f, k, r)] * f->size[f->list[r]];

            sum += factor * residual[f->list[r]];
            size += fabs(factor) * f->load[f->list[r]];
        }
        if (!(fabs(sum) <= 4.0 * f->settings.tol * size))
            return 0;
    }
    return 1;
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
    f->unsettled = 1;
    return -1;
}

int32_t perp__friction_solve_pattern(perp_load_friction *f)
{
    double top, least;
    int32_t m = 0, rank, i, round;

    for (i = 0; i < f->n; i++) {
        const int32_t sticks = f->pattern.mode[i] == PERP_LOAD_STICK;

        f->slope[i] = f->mu[i] * sign_of(f, i) * f->pattern.side[i];
        f->x[i] = sticks ? f->question.stop[i] : 0.0;
        if (!sticks)
            f->list[m++] = i;
    }
    top = load_block(f, m);
    if (!(top <= largest))
        return give_up(f);
    rank = reduce(f, m, top, &least);
    rough_residuals(f, f->rhs);
    correct(f, m, rank, f->rhs);
    if (rank == m && least > regular && !f->insist) {
        rough_residuals(f, f->rhs);
        find_loads(f);
        if (clearly_wrong(f, noise_of(f, top, least)))
            return -1;
    }
    for (round = 0; round < 2; round++) {
        residuals(f, f->rhs);
        correct(f, m, rank, f->rhs);
    }
    perp__friction_evaluate(f);
    find_widths(f, m, rank);
    if (!is_finite(f))
        return give_up(f);
    if (rank == m)
        return 0;
    if (!is_consistent(f, m, rank, f->rhs))
        return -1;
    find_null_space(f, m, rank);
    return m - rank;
}

/* value >= 0 up to width? Sets *at_vertex where only the width, or less than it, makes it so. */
static int32_t is_met(double value, double width, int32_t *at_vertex)
{
    if (!(value >= -width))
        return 0;
    if (value <= width)
        *at_vertex = 1;
    return 1;
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
            f->unsettled = 1; /* the pattern's equations have a solution, and this is not it */
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
            if (!is_met(f->question.mu_stick[i] * fabs(normal) - fabs(f->rhs[i]), width, at_vertex))
                return 0;
        } else if (f->pattern.side[i] != 0 &&
                   !is_met(f->pattern.side[i] * normal, f->normal_width[i], at_vertex)) {
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
