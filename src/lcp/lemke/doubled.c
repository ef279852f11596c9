/* Lemke's path in doubled precision.
 *
 * Contact problems with mass ratios of 1e8 pass through bases of condition 1e12 and more, where the
 * entries of a tableau in double are rounding and nothing else; a pivot on one of them ends in a
 * ray that does not exist. With some 32 digits they are what they should be, and the tolerances of
 * the ratio test tell zeros apart again. The product form of the inverse (Dantzig & Orchard-Hays
 * 1954) needs no more of the tableau than the columns that enter: an exchange E_k costs nothing in
 * a column that is 0 in its pivot's row, as most are in contact problems. */
#include <math.h>
#include <string.h>

#include "lcp/lemke/lemke.h"
#include "linalg/lanes/multiversion.h"

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
PERP__MULTIVERSION(subtract,
                   (size_t n, double factor, double factor_low, const double *restrict a,
                    const double *restrict a_low, double *restrict x, double *restrict x_low),
                   (n, factor, factor_low, a, a_low, x, x_low))
{
    for (size_t i = 0; i < n; i++) {
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

static void layout(perp__arena *arena, void *object)
{
    perp__lemke *l = object;
    perp__doubled *d = &l->doubled;
    const size_t n = (size_t)l->capacity, columns = 2 * n; /* an inversion takes half at most */

    d->capacity = (int32_t)columns;
    d->rows = perp__arena_take(arena, columns, sizeof(int32_t));
    PERP__DOUBLES(arena, columns, &d->pivot_high, &d->pivot_low);
    PERP__DOUBLES(arena, columns * n, &d->high, &d->low);
    PERP__DOUBLES(arena, n, &d->column_low, &d->b_low, &d->start_b, &d->kept_high, &d->kept_low);
    PERP__INTEGERS(arena, 2 * n + 1, &d->start_row, &d->start_column);
    d->taken = perp__arena_take(arena, n, sizeof(int32_t));
}

/* The tableau as the dense start leaves it, with a column for t, is where the path starts; it is
 * not touched from now on, but for that column. */
static perp_status start(perp__lemke *l, const perp__lcp_iterate *iterate)
{
    perp__doubled *d = &l->doubled;
    size_t pairs;
    perp_status status;

    status = perp__arena_fit(&d->arena, l->head.problem->context, layout, l);
    if (status != PERP_OK)
        return status;
    status = perp__lemke_dense.start(l, iterate);
    if (status != PERP_OK)
        return status;
    pairs = (size_t)l->pairs;
    d->count = 0;
    memset(d->b_low, 0, pairs * sizeof *d->b_low);
    memcpy(d->start_b, l->b, pairs * sizeof *d->start_b);
    memcpy(d->start_row, l->row_of, (2 * pairs + 1) * sizeof *d->start_row);
    memcpy(d->start_column, l->column_of, (2 * pairs + 1) * sizeof *d->start_column);
    d->start_column[perp__lemke_t(l)] = l->tableau.columns;
    return status;
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

    for (int32_t k = 0; k < d->count; k++) {
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

static perp_status read_column(perp__lemke *l, int32_t variable)
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
    return PERP_OK;
}

static perp_status values(perp__lemke *l)
{
    perp__doubled *d = &l->doubled;
    const size_t bytes = (size_t)l->pairs * sizeof *l->b;

    memcpy(l->b, d->start_b, bytes);
    memset(d->b_low, 0, bytes);
    memset(d->column_low, 0, bytes);
    for (int32_t k = 0; k < l->pairs; k++) {
        const double *start = start_of(l, k);

        if (l->row_of[k] < 0 && l->at_upper[k] && start) /* nonbasic at its upper bound */
            subtract((size_t)l->pairs, l->range[k], 0.0, start, d->column_low, l->b, d->b_low);
    }
    solve(l, l->b, d->b_low);
    return PERP_OK;
}

static void set_covering(perp__lemke *l)
{
    const size_t n = (size_t)l->pairs;
    double *column = start_of(l, perp__lemke_t(l));

    memset(column, 0, n * sizeof *column);
    for (int32_t r = 0; r < l->pairs; r++) {
        const double *start = start_of(l, l->basic[r]);

        if (l->column[r] == 0.0)
            continue;
        if (!start)
            column[l->doubled.start_row[l->basic[r]]] += l->column[r];
        for (size_t i = 0; start && i < n; i++)
            column[i] += l->column[r] * start[i];
    }
    read_column(l, perp__lemke_t(l));
}

static double move(perp__lemke *l, int32_t r, double far)
{
    perp__doubled *d = &l->doubled;
    pair step = {far, 0.0};

    if (r >= 0) {
        const double rate = -l->direction * l->column[r];
        const double sign = rate < 0.0 ? 1.0 : -1.0; /* far is b - limit or limit - b */
        const pair distance = {far, far > 0.0 ? sign * d->b_low[r] : 0.0};
        const pair speed = {fabs(rate), sign * l->direction * d->column_low[r]};

        step = quotient(distance, speed);
    }
    subtract((size_t)l->pairs, l->direction * step.high, l->direction * step.low, l->column,
             d->column_low, l->b, d->b_low);
    d->step_low = step.low;
    return step.high;
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

/* Inverts the basis afresh. Variables that are basic as at the start take their old rows and cost
 * nothing; each other one takes the row of its largest entry among those not taken. */
static perp_status invert(perp__lemke *l)
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
        double largest = 0.0;
        int32_t found = -1;

        if (l->row_of[v] < 0 || d->start_row[v] >= 0)
            continue;
        read_column(l, v);
        for (i = 0; i < l->pairs; i++)
            if (d->taken[i] < 0 && fabs(l->column[i]) > largest) {
                largest = fabs(l->column[i]);
                found = i;
            }
        if (found < 0)
            return PERP__FACTOR_SINGULAR;
        append(l, found);
        d->taken[found] = v;
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
    return PERP_OK;
}

/* Where there is no more room the basis is inverted. */
static perp_status exchange(perp__lemke *l, int32_t r, int32_t leaving)
{
    perp__doubled *d = &l->doubled;

    (void)leaving;
    d->b_low[r] = l->direction * d->step_low;
    if (d->count == d->capacity)
        return invert(l);
    append(l, r);
    return PERP_OK;
}

const perp__lemke_basis perp__lemke_doubled = {
    1e-20, start, NULL, set_covering, read_column, move, exchange, NULL, values, NULL, NULL,
};
