/* Which row blocks: the ratio tests of Lemke's method. */
#include "lcp/lemke/lemke.h"

#include <float.h>
#include <math.h>

/* What counts as a tie in the lexicographic test: exact data tie exactly, rounding nearly so. */
#define PERP__TIE 1e-12

void perp__lemke_limits(const perp__lemke *l, int32_t variable, double *low, double *high)
{
    const perp__lcp_problem *p = l->head.problem;

    *low = 0.0;
    *high = INFINITY;
    if (variable < l->pairs) {
        *high = l->range[variable];
        if (l->twin[variable] < 0 && p->lower[l->index[variable]] == -INFINITY &&
            p->upper[l->index[variable]] == INFINITY)
            *low = -INFINITY;
    } else if (variable < perp__lemke_t(l) && l->at_upper[variable - l->pairs]) {
        *low = -INFINITY;
        *high = 0.0;
    }
}

void perp__lemke_write_limits(perp__lemke *l)
{
    int32_t r;

    for (r = 0; r < l->pairs; r++)
        perp__lemke_limits(l, l->basic[r], &l->low[r], &l->high[r]);
    for (; (size_t)r < perp__tableau_length(l->pairs); r++) {
        l->column[r] = l->b[r] = l->low[r] = 0.0;
        l->high[r] = INFINITY;
    }
}

int32_t perp__lemke_distance(const perp__lemke *l, int32_t r, double floor, double *far,
                             double *speed)
{
    double rate = -l->direction * l->column[r];

    if (!(fabs(rate) > floor))
        return 0;
    *far = rate < 0.0 ? l->b[r] - l->low[r] : l->high[r] - l->b[r];
    *speed = fabs(rate);
    if (!isfinite(*far))
        return 0;
    if (*far < 0.0)
        *far = 0.0;
    return 1;
}

/* Harris' two passes with an absolute slack: how far can the entering variable go if every limit is
 * loosened a little; among the rows that block before that, t first, else the largest pivot. */
static int32_t harris_row(const perp__lemke *l, double own_range)
{
    const perp__lemke_rows rows = {
        perp__tableau_length(l->pairs),
        l->b,
        l->low,
        l->high,
        l->column,
        l->direction,
        l->slack * l->largest_b,
        l->smallest_pivot,
        l->row_of[perp__lemke_t(l)], /* t is no pivot to divide by: the path ends there */
    };
    const double reach = l->kernels->reach(&rows, l->far, l->speed);
    const int32_t t = rows.always;
    int32_t found;

    if (t >= 0 && l->speed[t] > 0.0 && l->far[t] <= reach * l->speed[t])
        return l->far[t] / l->speed[t] <= own_range ? t : PERP__FLIP;
    if (own_range < reach)
        return PERP__FLIP;
    found = l->kernels->fastest(rows.length, l->far, l->speed, reach);
    if (found < 0 && reach < INFINITY) /* the division was rounded down */
        found = l->kernels->fastest(rows.length, l->far, l->speed, reach * (1.0 + DBL_EPSILON));
    return found >= 0 ? found : PERP__NO_ROW;
}

static double pivot_floor(const perp__lemke *l)
{
    double largest = 0.0;
    int32_t r;

    for (r = 0; r < l->pairs; r++)
        largest = fmax(largest, fabs(l->column[r]));
    return l->smallest_pivot * largest;
}

/* Entry j of the row of B^-1, over the pivot: what the perturbation (e, e^2, ...) of the first
 * right-hand side adds to the ratio of row r. */
static double perturbation(const perp__lemke *l, int32_t r, int32_t j)
{
    const perp__tableau *t = &l->tableau;
    const int32_t v = l->pairs + j;
    double entry = 0.0;

    if (l->row_of[v] == r)
        entry = 1.0;
    else if (l->column_of[v] >= 0)
        entry = t->T[(size_t)r + (size_t)l->column_of[v] * (size_t)t->leading_dimension];
    return entry / (l->direction * l->column[r]);
}

/* Does row a come before row b in the lexicographic order? Their ratios tie. */
static int32_t comes_before(perp__lemke *l, int32_t a, int32_t b)
{
    int32_t j;

    perp__tableau_flush(&l->tableau);
    for (j = 0; j < l->pairs; j++) {
        double difference = perturbation(l, a, j) - perturbation(l, b, j);
        double size = fabs(perturbation(l, a, j)) + fabs(perturbation(l, b, j));

        if (fabs(difference) > PERP__TIE * size)
            return difference < 0.0;
    }
    return 0;
}

static int32_t lexicographic_row(perp__lemke *l, double own_range)
{
    const double floor = pivot_floor(l);
    double least = INFINITY, far, speed, tie;
    int32_t found = PERP__NO_ROW, r;

    for (r = 0; r < l->pairs; r++)
        if (perp__lemke_distance(l, r, floor, &far, &speed) && far / speed < least)
            least = far / speed;
    if (own_range < least)
        return PERP__FLIP;
    tie = least * (1.0 + PERP__TIE);
    for (r = 0; r < l->pairs; r++) {
        if (!perp__lemke_distance(l, r, floor, &far, &speed) || !(far / speed <= tie))
            continue;
        if (l->basic[r] == perp__lemke_t(l))
            return r;
        if (found == PERP__NO_ROW || comes_before(l, r, found))
            found = r;
    }
    return found;
}

int32_t perp__lemke_blocking_row(perp__lemke *l, double own_range)
{
    return l->head.problem->settings->pivot_rule == PERP_PIVOT_LEXICOGRAPHIC
               ? lexicographic_row(l, own_range)
               : harris_row(l, own_range);
}
