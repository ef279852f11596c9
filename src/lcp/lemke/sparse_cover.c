/* The artificial variable t: the covering vector that its column is made of, and its place in a
 * basis that is factored without it. */
#include "lcp/lemke/sparse.h"

#include <math.h>
#include <string.h>

#include "lcp/lemke/lemke.h"

/* How far the variable at position r is beyond a limit; *side: +1 below, -1 above. */
static double violation(const perp__sparse_lemke *l, int32_t r, double *side)
{
    *side = l->b[r] > l->high[r] ? -1.0 : 1.0;
    return fmax(fmax(l->low[r] - l->b[r], l->b[r] - l->high[r]), 0.0);
}

/* Writes to `column` minus d, the speeds at which t moves the basic variables: into their half-line
 * where they have one limit; where they have two, only if they are beyond one, and then at most to
 * the middle. Free ones rest. */
static void choose_cover(perp__sparse_lemke *l, int32_t attempt)
{
    double most = 0.0, side;
    int32_t r;

    for (r = 0; r < l->pairs; r++)
        most = fmax(most, violation(l, r, &side) / perp__lemke_cover_entry(attempt, r));
    for (r = 0; r < l->pairs; r++) {
        const double far = violation(l, r, &side);
        double d = perp__lemke_cover_entry(attempt, r);

        if (isfinite(l->low[r]) && isfinite(l->high[r]))
            d = far > 0.0 ? fmin(d, (far + 0.5 * (l->high[r] - l->low[r])) / most) : 0.0;
        else if (isfinite(l->high[r]))
            side = -1.0;
        else if (!isfinite(l->low[r]))
            d = 0.0;
        l->column[r] = -side * d;
    }
}

void perp__sparse_cover(perp__sparse_lemke *l, int32_t attempt)
{
    int32_t r;

    choose_cover(l, attempt);
    memset(l->h, 0, (size_t)l->pairs * sizeof *l->h);
    for (r = 0; r < l->pairs; r++)
        perp__sparse_add_column(l, l->basic[r], -l->column[r], l->h);
}

int32_t perp__sparse_first_row(const perp__sparse_lemke *l)
{
    double worst = 0.0, side;
    int32_t found = -1, r;

    for (r = 0; r < l->pairs; r++) {
        const double far = violation(l, r, &side);

        if (far > 0.0 && far >= worst * fabs(l->column[r])) {
            worst = far / fabs(l->column[r]);
            found = r;
        }
    }
    return found;
}

/* The slack to be loaded in place of t, which is a full column: that of the missing pair, unless
 * its entry in t's row of B^-1 says that another makes a better basis. With a singular principal
 * block in the basis neither member of the missing pair would do. */
static int32_t stand_in(perp__sparse_lemke *l)
{
    int32_t best = l->missing, k;

    memset(l->rows, 0, (size_t)l->pairs * sizeof *l->rows);
    l->rows[l->position_of[perp__sparse_t(l)]] = 1.0;
    perp__basis_solve_transposed(&l->basis, l->rows, l->column);
    for (k = 0; k < l->pairs; k++)
        if (fabs(l->column[k]) > fabs(l->column[best]))
            best = k;
    return fabs(l->column[l->missing]) >= 0.1 * fabs(l->column[best]) ? l->missing : best;
}

/* Puts the slack of pair k at the position of the missing pair, loads, and puts t there instead. */
static perp_status load_with(perp__sparse_lemke *l, int32_t slack)
{
    const int32_t r = l->missing;
    double largest = 0.0;
    perp_status status;
    int32_t k;

    l->basic[r] = l->pairs + slack;
    status = perp__sparse_load(l);
    if (status != PERP_OK)
        return status;
    memset(l->rows, 0, (size_t)l->pairs * sizeof *l->rows);
    perp__sparse_add_column(l, perp__sparse_t(l), 1.0, l->rows);
    perp__basis_solve(&l->basis, l->rows, l->column);
    for (k = 0; k < l->pairs; k++)
        largest = fmax(largest, fabs(l->column[k]));
    if (!(fabs(l->column[r]) > l->smallest_pivot * largest))
        return PERP__FACTOR_SINGULAR;
    perp__basis_replace(&l->basis, r, l->column); /* the file is empty: there is room */
    l->basic[r] = perp__sparse_t(l);
    return PERP_OK;
}

perp_status perp__sparse_refresh(perp__sparse_lemke *l)
{
    const int32_t slack = l->missing >= 0 ? stand_in(l) : -1;
    perp_status status;
    int32_t k;

    for (k = 0; k < l->pairs; k++)
        l->basic[k] = l->position_of[k] >= 0 ? k : l->pairs + k;
    status = slack >= 0 ? load_with(l, slack) : perp__sparse_load(l);
    for (k = 0; k < l->pairs; k++) {
        l->position_of[l->basic[k]] = k;
        perp__sparse_limit(l, k);
    }
    if (status == PERP_OK)
        perp__sparse_values(l, 2);
    return status;
}
