/* A tree over the places of the variables: level d decides variable d. The tableau carries all
 * quantities as functions of what is not decided; "between" makes w_d = 0 an equation, solved for a
 * variable at once where a good pivot is at hand, else later. Most levels are short, so that a node
 * costs a few hundred operations, and a row that can't get its sign any more ends a branch. */
#include <math.h>
#include <string.h>

#include "lcp/all/all.h"

/* Pivots on the way are at least this large within their row; what is smaller waits for a better
 * one. */
static const double good_pivot = 1e-3;
/* Pivots below this part of the equilibrated row count as 0. */
static const double rank_tolerance = 1e-11;
/* Rounding that a sign may hide behind; what gets through is judged by its true residual. */
static const double slack = 1e-8;

/* The largest entry of the equations' rows in the pending columns that is large enough: on the way
 * beside its row, at the end beside the matrix's. */
static bool find_pivot(const perp__lcp_all *all, const perp__tableau *level, int32_t depth,
                       int32_t *row, int32_t *column)
{
    double best = 0.0;

    for (int32_t i = 0; i < all->n; i++) {
        const double *T = perp__row_of(all, level, i);
        double least = all->row_sizes[i] * rank_tolerance;

        if (level->kind[i] != PERP__ROW_EQUATION)
            continue;
        for (int32_t j = depth; j < all->n; j++)
            least = fmax(least, good_pivot * fabs(T[j]));
        for (int32_t k = 0; k < level->pending && depth < all->n; k++)
            least = fmax(least, good_pivot * fabs(T[level->columns[k]]));
        for (int32_t k = 0; k < level->pending; k++)
            if (fabs(T[level->columns[k]]) > least && fabs(T[level->columns[k]]) > best) {
                best = fabs(T[level->columns[k]]);
                *row = i;
                *column = k;
            }
    }
    return best > 0.0;
}

/* Solves equation `row` for the variable of pending column k. */
static void exchange(const perp__lcp_all *all, perp__tableau *level, int32_t depth, int32_t row,
                     int32_t k)
{
    const int32_t n = all->n, c = level->columns[k];
    double *pivot_row = perp__row_of(all, level, row);
    const double pivot = pivot_row[c];

    level->columns[k] = level->columns[--level->pending];
    level->kind[row] = PERP__ROW_Z;
    level->basic[row] = (int8_t)c;
    for (int32_t j = depth; j <= n; j++)
        pivot_row[j] /= -pivot;
    for (int32_t p = 0; p < level->pending; p++)
        pivot_row[level->columns[p]] /= -pivot;
    for (int32_t i = 0; i < n; i++) {
        double *T = perp__row_of(all, level, i);
        const double factor = T[c];

        if (i == row || factor == 0.0)
            continue;
        for (int32_t j = depth; j <= n; j++)
            T[j] += factor * pivot_row[j];
        for (int32_t p = 0; p < level->pending; p++)
            T[level->columns[p]] += factor * pivot_row[level->columns[p]];
    }
}

/* The largest value of sign * row over the bounds of the free columns. */
static double find_most(const perp__lcp_all *all, const perp__tableau *level, int32_t depth,
                        int32_t i, double sign)
{
    const double *T = perp__row_of(all, level, i);
    const double *lower = all->solver->lower_scaled, *upper = all->solver->upper_scaled;
    const double nothing = rank_tolerance * all->row_sizes[i];
    const int32_t undecided = all->n - depth, count = undecided + level->pending;
    double most = sign * T[all->n];

    for (int32_t k = 0; k < count && most < INFINITY; k++) {
        const int32_t j = k < undecided ? depth + k : level->columns[k - undecided];
        const double entry = sign * T[j];
        const double bound = entry > 0.0 ? upper[j] : lower[j];

        if (fabs(entry) > nothing || (entry != 0.0 && isfinite(bound))) /* not rounding times inf */
            most += entry * bound;
    }
    return most;
}

/* Whether every row can still get what its place asks for. */
static bool is_possible(const perp__lcp_all *all, const perp__tableau *level, int32_t depth)
{
    for (int32_t i = 0; i < all->n; i++) {
        const int32_t kind = level->kind[i], b = level->basic[i];
        const double noise =
            slack * (all->row_sizes[i] + fabs(perp__row_of(all, level, i)[all->n]));
        const double lower = kind == PERP__ROW_Z ? all->solver->lower_scaled[b] : 0.0;
        const double upper = kind == PERP__ROW_Z ? all->solver->upper_scaled[b] : 0.0;

        if (kind == PERP__ROW_W_FREE)
            continue;
        if (kind != PERP__ROW_W_UPPER && find_most(all, level, depth, i, 1.0) < lower - noise)
            return 0;
        if (kind != PERP__ROW_W_LOWER && find_most(all, level, depth, i, -1.0) < -upper - noise)
            return 0;
    }
    return 1;
}

/* ---- the tree over places ------------------------------------------------------------------- */

static int32_t choices(void *user, int32_t d)
{
    const perp_lcp_solver *solver = ((const perp__lcp_all *)user)->solver;

    if (solver->lower[d] == solver->upper[d])
        return 1;
    return 1 + !!isfinite(solver->lower[d]) + !!isfinite(solver->upper[d]);
}

/* Gives variable d its place. Between comes first: of nested families the largest tends to. */
static int32_t choose(void *user, int32_t d, int32_t choice)
{
    perp__lcp_all *all = user;
    const perp_lcp_solver *solver = all->solver;
    const perp__tableau *from = &all->levels[d];
    perp__tableau *to = &all->levels[d + 1];
    const size_t n = (size_t)all->n;
    const int8_t place = solver->lower[d] == solver->upper[d]             ? PERP__FIXED
                         : choice == 0                                    ? PERP__BETWEEN
                         : choice == 1 && isfinite(solver->lower[d]) != 0 ? PERP__AT_LOWER
                                                                          : PERP__AT_UPPER;
    const double value =
        place == PERP__AT_UPPER ? solver->upper_scaled[d] : solver->lower_scaled[d];
    perp_outcome asked = -1;
    int32_t row, k;

    /* the monitor, the clock and the limit on nodes */
    all->result.nodes++;
    if (all->limit > 0 && all->result.nodes >= all->limit) {
        all->result.outcome = PERP_OUTCOME_ITERATION_LIMIT;
        all->tree.ended = 1;
    }
    if (all->result.nodes % PERP__A_READING == 1)
        asked = perp__lcp_tick(&all->solver->control, all->result.nodes, INFINITY);
    if (asked >= 0) {
        all->result.outcome = asked;
        all->tree.ended = 1;
        all->aborted = all->solver->control.aborted;
    }
    if (all->tree.ended)
        return 0;
    all->places[d] = place;
    /* 1. The level with z_d at `value`, unless it is between its bounds. Columns that are decided
     * stay behind without a meaning. */
    memcpy(to->T, from->T, n * (n + 1) * sizeof(double));
    memcpy(to->kind, from->kind, n);
    memcpy(to->basic, from->basic, n);
    memcpy(to->columns, from->columns, n);
    to->pending = from->pending;
    for (int32_t i = 0; i < all->n && place != PERP__BETWEEN && value != 0.0; i++)
        perp__row_of(all, to, i)[n] += perp__row_of(all, to, i)[d] * value;
    /* 2. What its row stands for now. */
    to->kind[d] = place == PERP__BETWEEN    ? PERP__ROW_EQUATION
                  : place == PERP__AT_LOWER ? PERP__ROW_W_LOWER
                  : place == PERP__AT_UPPER ? PERP__ROW_W_UPPER
                                            : PERP__ROW_W_FREE;
    if (place == PERP__BETWEEN)
        to->columns[to->pending++] = (int8_t)d;
    while (to->pending > 0 && find_pivot(all, to, d + 1, &row, &k))
        exchange(all, to, d + 1, row, k);
    return is_possible(all, to, d + 1);
}

static perp_status leaf(void *user)
{
    perp__lcp_all *all = user;
    const perp__tableau *level = &all->levels[all->n];

    all->result.bases++;
    if (level->pending > 0) {
        all->result.singular++;
        return perp__lcp_all_family(all, level);
    }
    for (int32_t i = 0; i < all->n; i++)
        all->z[i] = all->places[i] == PERP__AT_UPPER ? all->solver->upper_scaled[i]
                                                     : all->solver->lower_scaled[i];
    for (int32_t i = 0; i < all->n; i++)
        if (level->kind[i] == PERP__ROW_Z)
            all->z[level->basic[i]] = perp__row_of(all, level, i)[all->n];
    return perp__lcp_all_point(all);
}

perp_status perp__lcp_all_search(perp__lcp_all *all)
{
    all->tree.positions = all->n;
    all->tree.ended = 0;
    all->tree.user = all;
    all->tree.choices = choices;
    all->tree.choose = choose;
    all->tree.leaf = leaf;
    return perp__pattern_tree_search(&all->tree);
}
