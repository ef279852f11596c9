/* Units for Lemke's method where rows of M have been scaled.
 *
 * w_i may be measured in any unit: the problem stays the same if row i of M and q_i are multiplied
 * by R_i > 0, but M loses its symmetry, and with it what makes the path well behaved. Where a
 * diagonal R with |M_ij| R_j = |M_ji| R_i exists, it is found along couplings and taken back. */
#include <math.h>

#include "lcp/lemke/lemke.h"
#include "linalg/scale.h"

/* Couplings with |M_ij M_ji| below this, relative to the row's largest, may be rounding. */
#define SIGNIFICANT 0x1p-60
/* Row norms that differ by more than this make a look at the couplings worth its price. */
#define SPREAD 0x1p14

static double size_of(const perp__lemke *l, int32_t i, int32_t j)
{
    return fabs(l->tableau.T[(size_t)i + (size_t)j * (size_t)l->tableau.leading_dimension]);
}

static bool is_coupled(const perp__lemke *l, int32_t i, int32_t j)
{
    const double product = size_of(l, i, j) * size_of(l, j, i);

    /* products beyond the range of doubles have no logarithm to go by */
    return product > 0.0 && product < INFINITY &&
           (product >= SIGNIFICANT * l->row_unit[i] || product >= SIGNIFICANT * l->row_unit[j]);
}

/* column_unit := log2 sqrt(R), breadth first from one row of every component, with mean 0 there.
 * The rows from `end` on in the queue are not reached yet. */
static void find_units(perp__lemke *l)
{
    const int32_t n = l->pairs;
    int32_t *queue = l->queue, begin = 0, end = 0;

    /* row_unit := the row's largest |M_ij M_ji|, for is_coupled */
    for (int32_t i = 0; i < n; i++)
        l->row_unit[i] = 0.0;
    for (int32_t j = 0; j < n; j++)
        for (int32_t i = 0; i <= j; i++) {
            const double product = size_of(l, i, j) * size_of(l, j, i);

            l->row_unit[i] = product > l->row_unit[i] ? product : l->row_unit[i];
            l->row_unit[j] = product > l->row_unit[j] ? product : l->row_unit[j];
        }
    for (int32_t i = 0; i < n; i++)
        queue[i] = i;
    while (end < n) {
        const int32_t first = end;
        double mean = 0.0;

        l->column_unit[queue[end++]] = 0.0;
        for (; begin < end; begin++)
            for (int32_t k = end; k < n; k++) {
                const int32_t i = queue[k], j = queue[begin];

                if (!is_coupled(l, i, j))
                    continue;
                l->column_unit[i] =
                    l->column_unit[j] + 0.5 * (log2(size_of(l, i, j)) - log2(size_of(l, j, i)));
                queue[k] = queue[end];
                queue[end++] = i;
            }
        for (int32_t k = first; k < end; k++)
            mean += l->column_unit[queue[k]] / (end - first);
        for (int32_t k = first; k < end; k++)
            l->column_unit[queue[k]] -= mean;
    }
}

/* Does R make M symmetric in size, up to a factor of two? column_unit becomes sqrt(R). */
static bool is_symmetric(perp__lemke *l)
{
    double least = INFINITY, most = -INFINITY;

    for (int32_t i = 0; i < l->pairs; i++) {
        least = fmin(least, l->column_unit[i]);
        most = fmax(most, l->column_unit[i]);
        l->column_unit[i] = exp2(l->column_unit[i]);
    }
    if (!(most - least >= 2.0 && most - least <= 400.0))
        return 0; /* it does already; or the range of doubles is too small */
    for (int32_t j = 0; j < l->pairs; j++)
        for (int32_t i = 0; i < j; i++) {
            double factor, above, below;

            if (!is_coupled(l, i, j))
                continue;
            factor = l->column_unit[j] / l->column_unit[i];
            above = size_of(l, i, j) * factor;
            below = size_of(l, j, i) / factor;
            if (!(above <= 2.0 * below && below <= 2.0 * above))
                return 0;
        }
    return 1;
}

/* The power of two in (x / 2, x]. */
static double power_below(double x)
{
    int exponent;

    frexp(x, &exponent);
    return perp__power_of_two(exponent - 1);
}

/* Rows without a diagonal take the unit that brings their largest coupling into [1, 2), as
 * perp__equilibrate does. */
static void fit_without_diagonal(perp__lemke *l)
{
    for (int32_t i = 0; i < l->pairs; i++) {
        double largest = 0.0, unit;

        if (size_of(l, i, i) != 0.0)
            continue;
        for (int32_t j = 0; j < l->pairs; j++)
            if (size_of(l, j, j) != 0.0)
                largest =
                    fmax(largest, fmax(size_of(l, i, j) * l->row_unit[i] * l->column_unit[j],
                                       size_of(l, j, i) * l->row_unit[j] * l->column_unit[i]));
        if (!(largest > 0x1p-400 && largest < 0x1p400))
            continue;
        unit = power_below(largest);
        l->row_unit[i] /= unit;
        l->column_unit[i] /= unit;
    }
}

void perp__lemke_choose_units(perp__lemke *l, bool eager)
{
    const size_t ld = (size_t)l->tableau.leading_dimension;
    const double *norms = l->head.problem->row_norms;
    double least = INFINITY, most = 0.0;
    bool found;

    /* 1. Whether the tableau is the start's, -M, and rows are so unlike that units may matter. */
    for (int32_t k = 0; k < l->pairs; k++) {
        const double norm = norms[l->index[k]];

        if (l->basic[k] != l->pairs + k)
            return;
        least = norm < least ? norm : least;
        most = norm > most ? norm : most;
    }
    if (l->tableau.columns != l->pairs || !(eager || most > SPREAD * least))
        return;
    /* 2. R, if there is one. */
    find_units(l);
    found = is_symmetric(l);
    for (int32_t i = 0; i < l->pairs; i++) {
        l->column_unit[i] = found ? power_below(l->column_unit[i]) : 1.0;
        l->row_unit[i] = 1.0 / l->column_unit[i];
    }
    if (!found)
        return;
    fit_without_diagonal(l);
    /* 3. The problem in these units. */
    for (int32_t j = 0; j < l->pairs; j++) {
        double *column = l->tableau.T + (size_t)j * ld;

        for (int32_t i = 0; i < l->pairs; i++)
            column[i] *= l->row_unit[i] * l->column_unit[j];
        l->b[j] *= l->row_unit[j];
        l->range[j] /= l->column_unit[j];
    }
    perp__lemke_index(l);
}
