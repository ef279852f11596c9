/* Lemke's path in doubled precision.
 *
 * Contact problems with mass ratios of 1e8 pass through bases of condition 1e12 and more, where the
 * entries of a tableau in double are rounding and nothing else; a pivot on one of them ends in a
 * ray that does not exist. With some 32 digits they are what they should be, and the tolerances of
 * the ratio test tell zeros apart again. The product form of the inverse (Dantzig & Orchard-Hays
 * 1954) needs no more of the tableau than the columns that enter: an exchange E_k costs nothing in
 * a column that is 0 in its pivot's row, as most are in contact problems. */
#include "lcp/lemke/doubled.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/lemke/lemke.h"
#include "linalg/lanes/multiversion.h"

/* Exchanges that fit beyond one a pair. */
#define PERP__SPARE 64

typedef struct pair {
    double high, low;
} pair;

static pair sum_of(double a, double b) /* |a| >= |b| */
{
    pair s;

    s.high = a + b;
    s.low = b - (s.high - a);
    return s;
}

/* a / b (Dekker 1971). */
static pair quotient(pair a, pair b)
{
    const double q = a.high / b.high;
    const double rest = fma(-q, b.high, a.high) + (a.low - q * b.low);

    return isfinite(q) ? sum_of(q, rest / b.high) : sum_of(q, 0.0);
}

/* x -= (factor + factor_low) (a + a_low), every number a pair (Dekker 1971). */
PERP__KERNEL static void subtract_loops(size_t n, double factor, double factor_low,
                                        const double *restrict a, const double *restrict a_low,
                                        double *restrict x, double *restrict x_low)
{
    size_t i;

    for (i = 0; i < n; i++) {
        const double p = factor * a[i];
        const double p_low = fma(factor, a[i], -p) + (factor * a_low[i] + factor_low * a[i]);
        const double s = x[i] - p;
        const double part = s - x[i];
        const double s_low = ((x[i] - (s - part)) - (p + part)) + (x_low[i] - p_low);
        const double high = s + s_low;

        x_low[i] = s_low - (high - s);
        x[i] = high;
    }
}
PERP__MULTIVERSION(subtract,
                   (size_t n, double factor, double factor_low, const double *a,
                    const double *a_low, double *x, double *x_low),
                   (n, factor, factor_low, a, a_low, x, x_low))

static void layout(perp__arena *arena, void *object)
{
    perp__lemke *l = object;
    perp__doubled *d = &l->doubled;
    const size_t n = (size_t)l->capacity, columns = n + PERP__SPARE;

    d->capacity = l->capacity + PERP__SPARE;
    d->rows = perp__arena_take(arena, columns, sizeof(int32_t));
    d->pivot_high = perp__arena_take(arena, columns, sizeof(double));
    d->pivot_low = perp__arena_take(arena, columns, sizeof(double));
    d->high = perp__arena_take(arena, columns * n, sizeof(double));
    d->low = perp__arena_take(arena, columns * n, sizeof(double));
    d->column_low = perp__arena_take(arena, n, sizeof(double));
    d->b_low = perp__arena_take(arena, n, sizeof(double));
    d->start_b = perp__arena_take(arena, n, sizeof(double));
    d->start_row = perp__arena_take(arena, 2 * n + 1, sizeof(int32_t));
    d->start_column = perp__arena_take(arena, 2 * n + 1, sizeof(int32_t));
    d->taken = perp__arena_take(arena, n, sizeof(int32_t));
    d->kept_high = perp__arena_take(arena, n, sizeof(double));
    d->kept_low = perp__arena_take(arena, n, sizeof(double));
}

perp_status perp__doubled_fit(perp__lemke *l)
{
    l->doubled.arena.context = l->head.problem->context;
    return perp__arena_fit(&l->doubled.arena, layout, l);
}

void perp__doubled_release(perp__lemke *l)
{
    perp__arena_release(&l->doubled.arena);
}

void perp__doubled_start(perp__lemke *l)
{
    perp__doubled *d = &l->doubled;
    const size_t pairs = (size_t)l->pairs;

    perp__tableau_flush(&l->tableau);
    d->on = 1;
    d->count = 0;
    memset(d->b_low, 0, pairs * sizeof *d->b_low);
    memcpy(d->start_b, l->b, pairs * sizeof *d->start_b);
    memcpy(d->start_row, l->row_of, (2 * pairs + 1) * sizeof *d->start_row);
    memcpy(d->start_column, l->column_of, (2 * pairs + 1) * sizeof *d->start_column);
}

/* A variable's column in the tableau at the start; NULL: it was basic, with a unit column. */
static double *start_of(const perp__lemke *l, int32_t variable)
{
    const int32_t c = l->doubled.start_column[variable];

    return c >= 0 ? l->tableau.T + (size_t)c * (size_t)l->tableau.leading_dimension : NULL;
}

/* x + x_low := E_count^-1 ... E_1^-1 (x + x_low) */
static void solve(const perp__lemke *l, double *x, double *x_low)
{
    const perp__doubled *d = &l->doubled;
    const size_t n = (size_t)l->pairs;
    int32_t k;

    for (k = 0; k < d->count; k++) {
        const size_t at = (size_t)k * n;
        const int32_t r = d->rows[k];
        pair value;

        value.high = x[r];
        value.low = x_low[r];
        if (value.high == 0.0)
            continue;
        value = quotient(value, (pair){d->pivot_high[k], d->pivot_low[k]});
        subtract(n, value.high, value.low, d->high + at, d->low + at, x, x_low);
        x[r] = value.high;
        x_low[r] = value.low;
    }
}

void perp__doubled_column(perp__lemke *l, int32_t variable)
{
    const size_t bytes = (size_t)l->pairs * sizeof *l->column;
    const double *start = start_of(l, variable);

    memset(l->doubled.column_low, 0, bytes);
    if (start) {
        memcpy(l->column, start, bytes);
    } else {
        memset(l->column, 0, bytes);
        l->column[l->doubled.start_row[variable]] = 1.0;
    }
    solve(l, l->column, l->doubled.column_low);
}

void perp__doubled_values(perp__lemke *l)
{
    perp__doubled *d = &l->doubled;
    const size_t bytes = (size_t)l->pairs * sizeof *l->b;
    int32_t k;

    memcpy(l->b, d->start_b, bytes);
    memset(d->b_low, 0, bytes);
    memset(d->column_low, 0, bytes);
    for (k = 0; k < l->pairs; k++) {
        const double *start = start_of(l, k);

        if (l->row_of[k] < 0 && l->at_upper[k] && start) /* nonbasic at its upper bound */
            subtract((size_t)l->pairs, l->range[k], 0.0, start, d->column_low, l->b, d->b_low);
    }
    solve(l, l->b, d->b_low);
}

/* What a rounding of z and of the row's own data may change. */
static double noise(const perp__lemke *l, int32_t variable, double z_largest)
{
    const perp__lcp_problem *p = l->head.problem;
    const int32_t k = variable < l->pairs ? variable : variable - l->pairs, i = l->index[k];
    const double size = variable < l->pairs
                            ? z_largest / l->column_unit[k]
                            : (p->row_norms[i] * z_largest + fabs(p->q[i])) * l->row_unit[k];

    return 0.5 * DBL_EPSILON * size;
}

double perp__doubled_cover(perp__lemke *l)
{
    const size_t n = (size_t)l->pairs;
    double *column = start_of(l, perp__lemke_t(l));
    double z_largest = 0.0, far = 0.0;
    int32_t r;
    size_t i;

    for (r = 0; r < l->pairs; r++)
        if (l->basic[r] < l->pairs)
            z_largest = fmax(z_largest, fabs(l->b[r]) * l->column_unit[l->basic[r]]);
    memset(column, 0, n * sizeof *column);
    memset(l->cover, 0, n * sizeof *l->cover);
    for (r = 0; r < l->pairs; r++) {
        const int32_t variable = l->basic[r];
        const double off = perp__lemke_violation(l, r), side = l->b[r] < l->low[r] ? -1.0 : 1.0;
        const double *start = start_of(l, variable);

        if (off == 0.0)
            continue;
        if (off > noise(l, variable, z_largest))
            far = fmax(far, off);
        l->cover[variable < l->pairs ? variable : variable - l->pairs] = 1.0;
        if (!start)
            column[l->doubled.start_row[variable]] += side;
        for (i = 0; start && i < n; i++)
            column[i] += side * start[i];
    }
    return far;
}

double perp__doubled_step(const perp__lemke *l, int32_t r, double far, double *low)
{
    const perp__doubled *d = &l->doubled;
    const double rate = -l->direction * l->column[r];
    const double sign = rate < 0.0 ? 1.0 : -1.0; /* far is b - limit or limit - b */
    const pair distance = {far, far > 0.0 ? sign * d->b_low[r] : 0.0};
    const pair speed = {fabs(rate), sign * l->direction * d->column_low[r]};
    const pair step = quotient(distance, speed);

    *low = step.low;
    return step.high;
}

void perp__doubled_move(perp__lemke *l, double step, double low)
{
    subtract((size_t)l->pairs, l->direction * step, l->direction * low, l->column,
             l->doubled.column_low, l->b, l->doubled.b_low);
}

/* Appends the exchange of row r with the column just computed. */
static void append(perp__lemke *l, int32_t r)
{
    perp__doubled *d = &l->doubled;
    const size_t n = (size_t)l->pairs, at = (size_t)d->count * n;

    d->rows[d->count] = r;
    d->pivot_high[d->count] = l->column[r];
    d->pivot_low[d->count] = d->column_low[r];
    memcpy(d->high + at, l->column, n * sizeof *l->column);
    memcpy(d->low + at, d->column_low, n * sizeof *l->column);
    d->high[at + (size_t)r] = d->low[at + (size_t)r] = 0.0;
    d->count++;
}

/* The row of the largest entry in the column among those not taken; -1: there is none but 0. */
static int32_t free_row(const perp__lemke *l)
{
    double largest = 0.0;
    int32_t found = -1, i;

    for (i = 0; i < l->pairs; i++)
        if (l->doubled.taken[i] < 0 && fabs(l->column[i]) > largest) {
            largest = fabs(l->column[i]);
            found = i;
        }
    return found;
}

/* Variables that are basic as at the start take their old rows and cost nothing; each other one
 * takes the row of its largest entry. */
static int32_t invert(perp__lemke *l)
{
    perp__doubled *d = &l->doubled;
    int32_t v, i;

    memcpy(d->kept_high, l->b, (size_t)l->pairs * sizeof *l->b);
    memcpy(d->kept_low, d->b_low, (size_t)l->pairs * sizeof *l->b);
    for (i = 0; i < l->pairs; i++)
        d->taken[i] = -1;
    d->count = 0;
    for (v = 0; v <= 2 * l->pairs; v++)
        if (l->row_of[v] >= 0 && d->start_row[v] >= 0)
            d->taken[d->start_row[v]] = v;
    for (v = 0; v <= 2 * l->pairs; v++) {
        if (l->row_of[v] < 0 || d->start_row[v] >= 0)
            continue;
        perp__doubled_column(l, v);
        i = free_row(l);
        if (i < 0)
            return 0;
        append(l, i);
        d->taken[i] = v;
    }
    for (i = 0; i < l->pairs; i++) {
        v = d->taken[i];
        l->b[i] = d->kept_high[l->row_of[v]];
        d->b_low[i] = d->kept_low[l->row_of[v]];
        l->basic[i] = v;
    }
    for (i = 0; i < l->pairs; i++)
        l->row_of[l->basic[i]] = i;
    perp__lemke_write_limits(l);
    return 1;
}

int32_t perp__doubled_exchange(perp__lemke *l, int32_t r)
{
    if (l->doubled.count == l->doubled.capacity)
        return invert(l);
    append(l, r);
    return 1;
}
