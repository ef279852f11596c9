/* Which row blocks: the ratio tests of Lemke's method. */
#include "lcp/lemke.h"

#include <math.h>

/* What counts as a tie in the lexicographic test: exact data tie exactly, rounding nearly so. */
#define PERP__TIE 1e-12

/* A basic variable's limits; -inf and +inf where it has none. */
static void limits_of(const perp__lemke *l, int32_t variable, double *low, double *high)
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

int32_t perp__lemke_distance(const perp__lemke *l, int32_t r, double floor, double *far,
                             double *speed)
{
    double rate = -l->direction * l->column[r];
    double low, high;

    if (!(fabs(rate) > floor))
        return 0;
    limits_of(l, l->basic[r], &low, &high);
    *far = rate < 0.0 ? l->b[r] - low : high - l->b[r];
    *speed = fabs(rate);
    if (!isfinite(*far))
        return 0;
    if (*far < 0.0)
        *far = 0.0;
    return 1;
}

static double pivot_floor(const perp__lemke *l)
{
    double largest = 0.0;
    int32_t r;

    for (r = 0; r < l->pairs; r++)
        largest = fmax(largest, fabs(l->column[r]));
    return l->smallest_pivot * largest;
}

/* Harris' two passes with an absolute slack: how far can the entering variable go if every limit is
 * loosened a little; among the rows that block before that, t first, else the largest pivot. */
static int32_t harris_row(const perp__lemke *l, double own_range)
{
    const double floor = pivot_floor(l);
    const double slack = l->slack * l->largest_b;
    double reach = INFINITY, best = 0.0;
    int32_t found = PERP__NO_ROW, r;

    for (r = 0; r < l->pairs; r++) {
        /* t is no pivot to divide by: the path ends there */
        if (!perp__lemke_distance(l, r, l->basic[r] == perp__lemke_t(l) ? 0.0 : floor, &l->far[r],
                                  &l->speed[r]))
            l->speed[r] = 0.0;
        else if (l->far[r] + slack < reach * l->speed[r])
            reach = (l->far[r] + slack) / l->speed[r];
    }
    if (own_range < reach)
        found = PERP__FLIP;
    for (r = 0; r < l->pairs; r++) {
        if (l->speed[r] == 0.0 || !(l->far[r] <= reach * l->speed[r]))
            continue;
        if (l->basic[r] == perp__lemke_t(l))
            return l->far[r] / l->speed[r] <= own_range ? r : PERP__FLIP;
        if (found != PERP__FLIP && l->speed[r] > best) {
            best = l->speed[r];
            found = r;
        }
    }
    return found;
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
