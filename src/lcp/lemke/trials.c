/* How the attempts of Lemke's method differ: covering vector, precision, tolerances, patience. */
#include <math.h>
#include <stdint.h>

#include "lcp/lemke/lemke.h"

/* How often the answer may be looked for once more, for its last digits. */
#define PERP__IMPROVEMENTS 5

/* In double, 1e-11 of the largest numbers may be what rounding left of 0; in doubled precision only
 * the rounding of the data is left. The perturbation keeps degenerate problems, as contact problems
 * are, from wandering about at one vertex. Lengths of paths differ tenfold between covering
 * vectors, and no one is the best: where a path is too long, not spoilt, others follow in double.
 */
static const perp__lemke_trial in_double[] = {
    {0, PERP__COVER_ONES, 8, 1e-12, 1e-10, 1e-11},
    {0, PERP__COVER_NORMS, 8, 1e-12, 1e-10, 1e-11},
    {0, PERP__COVER_NEEDS, 8, 1e-12, 1e-10, 1e-11},
    {0, PERP__COVER_ONES, 20, 1e-12, 1e-10, 1e-11},
};
static const perp__lemke_trial in_doubled[] = {
    {1, PERP__COVER_ONES, 20, 1e-11, 1e-14, 1e-13},
    {1, PERP__COVER_RANDOM, 8, 1e-12, 1e-11, 1e-13},
    {1, PERP__COVER_RANDOM, 8, 0.0, 1e-12, 1e-13},
    {1, PERP__COVER_RANDOM, 8, 1e-11, 1e-14, 1e-13},
    {1, PERP__COVER_RANDOM, 8, 1e-12, 1e-10, 1e-11},
    {1, PERP__COVER_RANDOM, 20, 0.0, 1e-11, 1e-11},
    {1, PERP__COVER_RANDOM, 20, 1e-11, 1e-13, 1e-14},
    {1, PERP__COVER_RANDOM, 40, 1e-13, 1e-12, 1e-13},
};
enum {
    IN_DOUBLE = sizeof in_double / sizeof *in_double,
    IN_DOUBLED = sizeof in_doubled / sizeof *in_doubled
};

void perp__lemke_tolerances(int32_t attempt, double *slack, double *smallest_pivot)
{
    static const double slacks[] = {1e-11, 1e-9, 1e-12, 1e-10};
    static const double pivots[] = {1e-11, 1e-9, 1e-11, 1e-10};

    *slack = slacks[attempt % 4];
    *smallest_pivot = pivots[attempt % 4];
}

double perp__lemke_cover_entry(int32_t attempt, int32_t k)
{
    uint64_t x = (uint64_t)attempt * UINT64_C(0x9e3779b97f4a7c15) + (uint64_t)k + 1;

    if (attempt == 0)
        return 1.0;
    x *= UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    x ^= x >> 31;
    return 1.0 + (double)(x >> 11) * 0x1p-53;
}

void perp__lemke_choose_trial(perp__lemke *l, perp__lcp_iterate *iterate, perp_outcome last)
{
    const int32_t first = iterate->attempt == l->guessed;

    if (first)
        l->tried = l->tried_doubled = 0;
    if (first ||
        (!l->trial->doubled && last == PERP_OUTCOME_ITERATION_LIMIT && l->tried < IN_DOUBLE))
        l->trial = &in_double[l->tried++];
    else
        l->trial = &in_doubled[l->tried_doubled++ % IN_DOUBLED];
    iterate->improvable = l->tried_doubled < PERP__IMPROVEMENTS;
}

double perp__lemke_trial_cover(const perp__lemke *l, const perp__lcp_iterate *iterate, int32_t r)
{
    const int32_t k = l->basic[r] - l->pairs;

    switch (l->trial->cover) {
    case PERP__COVER_NORMS:
        return l->row_unit[k] * fmax(l->head.problem->row_norms[l->index[k]], 0x1p-20);
    case PERP__COVER_NEEDS:
        return 0.1 + fmax(-l->b[r], 0.0) / l->largest_b;
    case PERP__COVER_ONES:
        /* once it has ended in a ray another vector must have the second word on that */
        return iterate->rays == 0 ? 1.0 : perp__lemke_cover_entry(1 + iterate->attempt, k);
    default:
        return perp__lemke_cover_entry(1 + iterate->attempt, k);
    }
}

void perp__lemke_begin_path(perp__lemke *l)
{
    l->slack = l->trial->slack;
    l->smallest_pivot = l->trial->smallest_pivot;
    l->idle = l->near = 0;
    l->most_idle = INT32_MAX;
    l->near_end = -INFINITY;
}

void perp__lemke_perturb(perp__lemke *l, int32_t attempt)
{
    const perp_lcp_settings *settings = l->head.problem->settings;
    /* in double it is for the polish to take it away again */
    const double size =
        l->trial->doubled || settings->polish ? l->trial->perturbation * l->largest_b : 0.0;
    int32_t r;

    if (settings->pivot_rule != PERP_PIVOT_HARRIS)
        return;
    l->most_idle = 100 + (size > 0.0 ? 1 : 4) * l->pairs;
    l->near_end = 4.0 * fmax(size, l->slack * l->largest_b);
    for (r = 0; size > 0.0 && r < l->pairs; r++)
        if (l->basic[r] >= l->pairs)
            l->b[r] += size * perp__lemke_cover_entry(101 + attempt, r);
}
