/* Which basic variable blocks: the ratio tests of lcp/lemke_ratio.c on a factored basis. */
#include "lcp/lemke/sparse.h"

#include <math.h>
#include <string.h>

/* What counts as a tie in the lexicographic test: exact data tie exactly, rounding nearly so. */
#define PERP__TIE 1e-12

int32_t perp__sparse_distance(const perp__sparse_lemke *l, int32_t r, double floor, double *far,
                              double *speed)
{
    const double rate = -l->direction * l->column[r];

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

static double pivot_floor(const perp__sparse_lemke *l)
{
    double largest = 0.0;
    int32_t r;

    for (r = 0; r < l->pairs; r++)
        largest = fmax(largest, fabs(l->column[r]));
    return l->smallest_pivot * largest;
}

/* Harris' two passes with an absolute slack: how far can the entering variable go if every limit is
 * loosened a little; among the rows that block before that, t first, else the largest pivot. */
static int32_t harris_row(perp__sparse_lemke *l, double own_range)
{
    const double floor = pivot_floor(l);
    const double slack = l->slack * l->largest_b;
    double reach = INFINITY, best = 0.0;
    int32_t found = PERP__SPARSE_NO_ROW, r;

    for (r = 0; r < l->pairs; r++) {
        if (!perp__sparse_distance(l, r, floor, &l->far[r], &l->speed[r]))
            l->speed[r] = 0.0;
        else if (l->far[r] + slack < reach * l->speed[r])
            reach = (l->far[r] + slack) / l->speed[r];
    }
    if (own_range < reach)
        found = PERP__SPARSE_FLIP;
    for (r = 0; r < l->pairs; r++) {
        if (l->speed[r] == 0.0 || !(l->far[r] <= reach * l->speed[r]))
            continue;
        if (l->basic[r] == perp__sparse_t(l))
            return l->far[r] / l->speed[r] <= own_range ? r : PERP__SPARSE_FLIP;
        if (found != PERP__SPARSE_FLIP && l->speed[r] > best) {
            best = l->speed[r];
            found = r;
        }
    }
    return found;
}

/* Row r of B^-1 over its pivot: what the perturbation (e, e^2, ...) of the right-hand side adds to
 * its ratio. */
static void perturbations(perp__sparse_lemke *l, int32_t r, double *row)
{
    const double pivot = l->direction * l->column[r];
    int32_t k;

    memset(l->rows, 0, (size_t)l->pairs * sizeof *l->rows);
    l->rows[r] = 1.0;
    perp__basis_solve_transposed(&l->basis, l->rows, row);
    for (k = 0; k < l->pairs; k++)
        row[k] = perp__sparse_is_free(l, k) ? 0.0 : row[k] / pivot;
}

/* Does the row of ratio perturbations a come before b in the lexicographic order? */
static int32_t comes_before(const perp__sparse_lemke *l, const double *a, const double *b)
{
    int32_t j;

    for (j = 0; j < l->pairs; j++)
        if (fabs(a[j] - b[j]) > PERP__TIE * (fabs(a[j]) + fabs(b[j])))
            return a[j] < b[j];
    return 0;
}

static int32_t lexicographic_row(perp__sparse_lemke *l, double own_range)
{
    const double floor = pivot_floor(l);
    double *best = l->order_a, *other = l->order_b;
    double least = INFINITY, far, speed, tie;
    int32_t found = PERP__SPARSE_NO_ROW, r;

    for (r = 0; r < l->pairs; r++)
        if (perp__sparse_distance(l, r, floor, &far, &speed) && far / speed < least)
            least = far / speed;
    if (own_range < least)
        return PERP__SPARSE_FLIP;
    tie = least * (1.0 + PERP__TIE);
    for (r = 0; r < l->pairs; r++) {
        double *kept = best;

        if (!perp__sparse_distance(l, r, floor, &far, &speed) || !(far / speed <= tie))
            continue;
        if (l->basic[r] == perp__sparse_t(l))
            return r;
        perturbations(l, r, other);
        if (found != PERP__SPARSE_NO_ROW && !comes_before(l, other, best))
            continue;
        found = r;
        best = other;
        other = kept;
    }
    return found;
}

int32_t perp__sparse_blocking_row(perp__sparse_lemke *l, double own_range)
{
    return l->head.problem->settings->pivot_rule == PERP_PIVOT_LEXICOGRAPHIC
               ? lexicographic_row(l, own_range)
               : harris_row(l, own_range);
}
