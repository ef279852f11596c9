/* The start of Lemke's method at a given complementary basis, and the first row of any start. */
#include <math.h>

#include "lcp/lemke/lemke.h"

/* Pivots that are smaller than this part of their column's largest entry make no good basis. */
#define PERP__SMALLEST_PIVOT 1e-8

/* Whether x_k is basic at the start. */
static int32_t enters(const perp__lemke *l, int32_t k)
{
    return perp__lemke_is_free(l, k) || l->places[l->index[k]] == PERP__BETWEEN;
}

/* Nonbasic x at their upper bounds: v at x = range is b less its column there. */
static void rest_at_upper(perp__lemke *l)
{
    int32_t k, i;

    for (k = 0; k < l->pairs; k++) {
        l->at_upper[k] =
            l->sign[k] > 0 && l->places[l->index[k]] == PERP__AT_UPPER && isfinite(l->range[k]);
        if (!l->at_upper[k])
            continue;
        perp__tableau_column(&l->tableau, k, l->column);
        for (i = 0; i < l->pairs; i++)
            l->b[i] -= l->column[i] * l->range[k];
    }
}

/* The row of l->column with the largest entry, of those whose v leaves; -1 if all are too small. */
static int32_t leaving_row(const perp__lemke *l)
{
    double largest = 0.0;
    int32_t found = -1, r;

    for (r = 0; r < l->pairs; r++) {
        const double size = fabs(l->column[r]);

        largest = fmax(largest, size);
        if (l->basic[r] >= l->pairs && enters(l, l->basic[r] - l->pairs) && size > 0.0 &&
            (found < 0 || size > fabs(l->column[found])))
            found = r;
    }
    return found >= 0 && fabs(l->column[found]) > PERP__SMALLEST_PIVOT * largest ? found : -1;
}

/* The block principal transform, one exchange after the other: the tableau applies them together.
 * Which v goes with which x is of no account. The equation of a free variable stays at 0 for ever,
 * so its column is dropped. Returns 0 if there is no good pivot. */
static int32_t transform(perp__lemke *l)
{
    int32_t c, r, i;

    for (c = 0; c < l->pairs; c++) {
        const int32_t x = l->nonbasic[c];
        double value;

        if (!enters(l, x))
            continue;
        perp__tableau_column(&l->tableau, c, l->column);
        r = leaving_row(l);
        if (r < 0)
            return 0;
        value = l->b[r] / l->column[r];
        for (i = 0; i < l->pairs; i++)
            l->b[i] -= l->column[i] * value;
        l->b[r] = value;
        l->nonbasic[c] = l->basic[r];
        l->basic[r] = x;
        perp__tableau_exchange(&l->tableau, r, c, l->column);
    }
    for (c = l->tableau.columns - 1; c >= 0; c--) {
        if (l->nonbasic[c] < l->pairs || !perp__lemke_is_free(l, l->nonbasic[c] - l->pairs))
            continue;
        perp__tableau_drop(&l->tableau, c);
        l->nonbasic[c] = l->nonbasic[l->tableau.columns];
    }
    return 1;
}

double perp__lemke_violation(const perp__lemke *l, int32_t r)
{
    return fmax(fmax(l->low[r] - l->b[r], l->b[r] - l->high[r]), 0.0);
}

int32_t perp__lemke_first_row(const perp__lemke *l)
{
    double worst = 0.0;
    int32_t found = -1, r;

    for (r = 0; r < l->pairs; r++) {
        const int32_t pair = l->basic[r] < l->pairs ? l->basic[r] : l->basic[r] - l->pairs;
        const double violation = perp__lemke_violation(l, r);
        double ratio;

        if (l->cover[pair] == 0.0 || violation == 0.0)
            continue;
        ratio = violation / fabs(l->cover[pair]);
        if (ratio >= worst) {
            worst = ratio;
            found = r;
        }
    }
    return found;
}

/* The column of t: what is infeasible moves to where it is feasible for the t that the worst one
 * needs, and what is feasible stays. A basic x with two bounds moves no further than half way
 * between them. */
static void add_cover(perp__lemke *l)
{
    const int32_t last = l->tableau.columns;
    double *column = l->tableau.T + (size_t)last * (size_t)l->tableau.leading_dimension;
    double worst = 0.0;
    int32_t r;

    for (r = 0; r < l->pairs; r++)
        worst = fmax(worst, perp__lemke_violation(l, r));
    for (r = 0; r < l->pairs; r++) {
        const double violation = perp__lemke_violation(l, r);
        const int32_t variable = l->basic[r];
        double d = violation > l->slack * l->largest_b ? 1.0 : 0.0;

        if (variable < l->pairs && d > 0.0)
            d = fmin(d, (violation + 0.5 * l->range[variable]) / worst);
        if (l->b[r] > l->high[r])
            d = -d;
        column[r] = -d;
        l->cover[variable < l->pairs ? variable : variable - l->pairs] = d;
    }
    perp__tableau_reset(&l->tableau, l->pairs, last + 1);
    l->nonbasic[last] = perp__lemke_t(l);
    l->column_of[perp__lemke_t(l)] = last;
}

int32_t perp__lemke_start_at(perp__lemke *l)
{
    perp__lemke_fill(l);
    rest_at_upper(l);
    if (!transform(l))
        return 0;
    perp__tableau_flush(&l->tableau);
    perp__lemke_index(l);
    add_cover(l);
    return 1;
}
