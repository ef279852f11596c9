/* Lemke's method on sparse matrices: the path of lcp/lemke.c, with the tableau's one column that a
 * pivot needs solved for in a factored basis (Tomlin, "Robust implementation of Lemke's method for
 * the linear complementarity problem", Math. Programming Study 7 (1978) 55). Memory is that of the
 * factors; nothing is n by n. */
#include "lcp/lemke/sparse.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "lcp/lemke/lemke.h"

/* Up to this size, and with a larger part of the entries than 1 / FILLED, the dense tableau is
 * faster (bench/lcp_sparse.c). */
#define SMALL 64
#define FILLED 6
/* One more than the dense method: the first may be lost on a guess. */
#define ATTEMPTS 25
/* Pivots between refactorisations at most. */
#define SPIKES 64
/* Pivots this small in their column are not believed before a refactorisation. */
#define DOUBTFUL 1e-6

static int32_t suits(const perp__lcp_problem *problem)
{
    const int32_t *starts = problem->M->column_starts;
    const int64_t n = problem->n;

    return starts && n > SMALL && FILLED * (int64_t)starts[n] <= n * n;
}

static perp_status check(const perp__lcp_problem *problem)
{
    (void)problem;
    return PERP_OK; /* any M, any bounds */
}

/* Entries of [I, -S] that can be in the basis's kernel, with every free variable split. */
static size_t count_entries(const perp__lcp_problem *p)
{
    const perp__matrix *M = p->M;
    size_t entries = 0;
    int32_t j, k;

    for (j = 0; j < p->n; j++) {
        size_t column = 0;

        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            column += p->lower[i] == -INFINITY && p->upper[i] == INFINITY ? 2 : 1;
        }
        entries += p->lower[j] == -INFINITY && p->upper[j] == INFINITY ? 2 * column : column;
    }
    return entries;
}

static void layout(perp__arena *arena, void *work)
{
    perp__sparse_lemke *l = work;
    const perp__lcp_problem *p = l->head.problem;
    const size_t n = (size_t)p->n;
    int32_t i, most = p->n;
    size_t pairs;

    for (i = 0; i < p->n; i++)
        most += p->lower[i] == -INFINITY && p->upper[i] == INFINITY;
    pairs = (size_t)most;
    perp__basis_layout(arena, &l->basis, most, count_entries(p), SPIKES, SPIKES * pairs);
    perp__tridiagonal_lcp_layout(arena, &l->tridiagonal,
                                 p->block->kind == PERP__SPARSE_TRIDIAGONAL ? n : 0);
    l->pair_of = perp__arena_take(arena, n, sizeof(int32_t));
    l->base = perp__arena_take(arena, n, sizeof(double));
    l->index = perp__arena_take(arena, pairs, sizeof(int32_t));
    l->sign = perp__arena_take(arena, pairs, sizeof(int8_t));
    l->at_upper = perp__arena_take(arena, pairs, sizeof(int8_t));
    l->range = perp__arena_take(arena, pairs, sizeof(double));
    l->twin = perp__arena_take(arena, pairs, sizeof(int32_t));
    l->q = perp__arena_take(arena, pairs, sizeof(double));
    l->h = perp__arena_take(arena, pairs, sizeof(double));
    l->basic = perp__arena_take(arena, pairs, sizeof(int32_t));
    l->position_of = perp__arena_take(arena, 2 * pairs + 1, sizeof(int32_t));
    l->b = perp__arena_take(arena, pairs, sizeof(double));
    l->low = perp__arena_take(arena, pairs, sizeof(double));
    l->high = perp__arena_take(arena, pairs, sizeof(double));
    l->column = perp__arena_take(arena, pairs, sizeof(double));
    l->rows = perp__arena_take(arena, pairs, sizeof(double));
    l->entry_rows = perp__arena_take(arena, pairs, sizeof(int32_t));
    l->entry_values = perp__arena_take(arena, pairs, sizeof(double));
    l->far = perp__arena_take(arena, pairs, sizeof(double));
    l->speed = perp__arena_take(arena, pairs, sizeof(double));
    l->places = perp__arena_take(arena, pairs, sizeof(int8_t));
    l->next = perp__arena_take(arena, pairs, sizeof(int8_t));
    l->best = perp__arena_take(arena, pairs, sizeof(int8_t));
    l->order_a = perp__arena_take(arena, pairs, sizeof(double));
    l->order_b = perp__arena_take(arena, pairs, sizeof(double));
}

static int32_t pair_of(const perp__sparse_lemke *l, int32_t variable)
{
    return variable < l->pairs ? variable : variable - l->pairs;
}

/* Moves along the column by `step` and makes `entering`, which started at `from`, basic in position
 * r. */
static void pivot(perp__sparse_lemke *l, int32_t r, int32_t entering, double step, double from)
{
    const int32_t leaving = l->basic[r];
    int32_t i;

    for (i = 0; i < l->pairs; i++)
        l->b[i] -= l->direction * step * l->column[i];
    l->b[r] = from + l->direction * step;
    perp__basis_replace(&l->basis, r, l->column);
    l->basic[r] = entering;
    l->position_of[entering] = r;
    l->position_of[leaving] = -1;
    l->missing = leaving == perp__sparse_t(l) ? -1 : pair_of(l, leaving);
    perp__sparse_limit(l, r);
}

/* The partner of what just left at `value` enters; sets its direction. */
static int32_t partner_of(perp__sparse_lemke *l, int32_t leaving, int32_t left_at_upper)
{
    if (leaving < l->pairs) {
        l->at_upper[leaving] = (int8_t)left_at_upper;
        l->direction = left_at_upper ? -1.0 : 1.0;
        return leaving + l->pairs;
    }
    l->direction = l->at_upper[leaving - l->pairs] ? -1.0 : 1.0;
    return leaving - l->pairs;
}

static void solve_column(perp__sparse_lemke *l, int32_t entering)
{
    memset(l->rows, 0, (size_t)l->pairs * sizeof *l->rows);
    perp__sparse_add_column(l, entering, 1.0, l->rows);
    perp__basis_solve(&l->basis, l->rows, l->column);
}

static int32_t is_doubtful(const perp__sparse_lemke *l, int32_t r)
{
    double largest = 0.0;
    int32_t k;

    if (r == PERP__SPARSE_NO_ROW)
        return 1;
    for (k = 0; k < l->pairs; k++)
        largest = fmax(largest, fabs(l->column[k]));
    return r >= 0 && !(fabs(l->column[r]) >= DOUBTFUL * largest);
}

/* The position that blocks the entering variable, with its column. What looks like a ray or a tiny
 * pivot is looked at again with new factors. */
static perp_status find_blocking(perp__sparse_lemke *l, int32_t entering, double own_range,
                                 int32_t *r)
{
    perp_status status;

    if (!perp__basis_has_room(&l->basis)) {
        status = perp__sparse_refresh(l);
        if (status != PERP_OK)
            return status;
    }
    solve_column(l, entering);
    *r = perp__sparse_blocking_row(l, own_range);
    if (l->basis.spikes <= 1 || !is_doubtful(l, *r))
        return PERP_OK;
    status = perp__sparse_refresh(l);
    if (status != PERP_OK)
        return status;
    solve_column(l, entering);
    *r = perp__sparse_blocking_row(l, own_range);
    return PERP_OK;
}

/* One step of the path: *entering goes as far as it can. Writes the next entering variable, or -1
 * with the outcome. */
static perp_status advance(perp__sparse_lemke *l, int32_t *entering, perp_outcome *outcome)
{
    const int32_t is_x = *entering < l->pairs;
    const double own_range = is_x ? l->range[*entering] : INFINITY;
    const double from = is_x && l->at_upper[*entering] ? own_range : 0.0;
    double far = 0.0, speed = 1.0;
    int32_t r, i, leaving, at_upper;
    perp_status status = find_blocking(l, *entering, own_range, &r);

    if (status != PERP_OK)
        return status;
    if (r == PERP__SPARSE_NO_ROW) {
        *outcome = PERP_OUTCOME_RAY;
        return PERP_OK;
    }
    if (r == PERP__SPARSE_FLIP) {
        for (i = 0; i < l->pairs; i++)
            l->b[i] -= l->direction * own_range * l->column[i];
        *entering = partner_of(l, *entering, l->direction > 0.0);
        return PERP_OK;
    }
    perp__sparse_distance(l, r, 0.0, &far, &speed);
    leaving = l->basic[r];
    at_upper = leaving < l->pairs && -l->direction * l->column[r] > 0.0;
    pivot(l, r, *entering, far / speed, from);
    if (leaving == perp__sparse_t(l))
        *outcome = PERP_OUTCOME_SOLVED;
    else
        *entering = partner_of(l, leaving, at_upper);
    return PERP_OK;
}

/* From the current complementary basis to the end of the path, or to `limit` iterations. */
static perp_status follow_path(perp__sparse_lemke *l, perp__lcp_iterate *iterate, int64_t limit,
                               int32_t *entering)
{
    perp_status status = PERP_OK;
    int32_t r = perp__sparse_first_row(l), leaving;

    iterate->outcome = r < 0 ? PERP_OUTCOME_SOLVED : PERP_OUTCOME_ITERATION_LIMIT;
    if (r < 0 || iterate->iterations >= limit)
        return PERP_OK;
    leaving = l->basic[r];
    l->direction = 1.0;
    pivot(l, r, perp__sparse_t(l), l->b[r] / l->column[r], 0.0);
    *entering = partner_of(l, leaving, leaving < l->pairs && l->column[r] > 0.0);
    for (iterate->iterations++; iterate->iterations < limit; iterate->iterations++) {
        iterate->outcome = perp__lcp_tick(l->head.problem->control, iterate->iterations, INFINITY);
        if (iterate->outcome >= 0)
            return PERP_OK;
        status = advance(l, entering, &iterate->outcome);
        if (status != PERP_OK || iterate->outcome >= 0)
            break;
    }
    if (status == PERP_OK && iterate->outcome < 0)
        iterate->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    return status;
}

static void write_point(const perp__sparse_lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;
    int32_t i, k;

    for (i = 0; i < p->n; i++) {
        iterate->z[i] = l->base[i];
        iterate->places[i] = PERP__FIXED;
    }
    for (k = 0; k < l->pairs; k++) {
        const int32_t upper_side = (l->at_upper[k] != 0) != (l->sign[k] < 0);

        i = l->index[k];
        if (l->position_of[k] >= 0)
            iterate->z[i] += l->sign[k] * l->b[l->position_of[k]];
        else if (l->at_upper[k])
            iterate->z[i] = upper_side ? p->upper[i] : p->lower[i];
        if (l->position_of[k] >= 0 || l->twin[k] >= 0)
            iterate->places[i] = PERP__BETWEEN;
        else
            iterate->places[i] = upper_side ? PERP__AT_UPPER : PERP__AT_LOWER;
    }
    iterate->has_places = 1;
}

/* The last column is the direction in which nothing blocks. */
static void write_ray(const perp__sparse_lemke *l, int32_t entering, perp__lcp_iterate *iterate)
{
    const int32_t at = l->position_of[perp__sparse_t(l)];
    const double dt = at >= 0 ? -l->direction * l->column[at] : 0.0;
    int32_t i, k;

    for (i = 0; i < l->head.problem->n; i++)
        iterate->ray[i] = iterate->cover[i] = 0.0;
    for (k = 0; k < l->pairs; k++) {
        double dx = l->position_of[k] >= 0 ? -l->direction * l->column[l->position_of[k]] : 0.0;

        if (k == entering)
            dx = l->direction;
        i = l->index[k];
        iterate->ray[i] += l->sign[k] * dx;
        if (l->twin[k] < 0 || l->sign[k] > 0)
            iterate->cover[i] = l->sign[k] * l->h[k] * dt;
    }
}

/* The path from the current complementary basis, `pivots` long at most. */
static perp_status run(perp__sparse_lemke *l, perp__lcp_iterate *iterate, int32_t attempt,
                       int64_t pivots)
{
    const int64_t asked = l->head.problem->iteration_limit;
    int64_t limit = iterate->iterations + pivots;
    int32_t entering = -1, r;
    perp_status status;

    if (asked > 0 && asked < limit)
        limit = asked;
    perp__lemke_tolerances(attempt, &l->slack, &l->smallest_pivot);
    l->largest_b = 0.0;
    for (r = 0; r < l->pairs; r++)
        if (isfinite(l->low[r]) || isfinite(l->high[r]))
            l->largest_b = fmax(l->largest_b, fabs(l->b[r]));
    perp__sparse_cover(l, attempt);
    status = follow_path(l, iterate, limit, &entering);
    if (status < 0)
        return status;
    if (status == PERP__FACTOR_SINGULAR)
        iterate->outcome = PERP_OUTCOME_STALLED;
    write_point(l, iterate);
    if (iterate->outcome == PERP_OUTCOME_RAY)
        write_ray(l, entering, iterate);
    return PERP_OK;
}

/* Whether the path from the guess ended in something that is no failure of the guess. */
static int32_t is_final(const perp__sparse_lemke *l, const perp__lcp_iterate *iterate)
{
    const int64_t asked = l->head.problem->iteration_limit;

    return iterate->outcome == PERP_OUTCOME_SOLVED || iterate->outcome == PERP_OUTCOME_STOPPED ||
           iterate->outcome == PERP_OUTCOME_TIME_LIMIT ||
           (asked > 0 && iterate->iterations >= asked);
}

/* The path from a guess. It is short, or the guess was none. */
static perp_status solve_near(perp__sparse_lemke *l, perp__lcp_iterate *iterate)
{
    int32_t violated;
    perp_status status = perp__sparse_start_near(l, iterate, &violated);

    if (status == PERP_OK && violated == 0)
        iterate->outcome = PERP_OUTCOME_SOLVED;
    if (status == PERP_OK && iterate->outcome < 0) {
        l->guesses = 1;
        status = run(l, iterate, 0, 50 + 10 * (int64_t)violated);
    } else if (status == PERP_OK && violated < INT32_MAX) {
        write_point(l, iterate); /* else there is no basis yet, but a point */
    }
    return status;
}

static perp_status solve(void *work, perp__lcp_iterate *iterate)
{
    perp__sparse_lemke *l = work;
    perp_status status;

    iterate->iterations = 0;
    iterate->outcome = -1;
    if (iterate->attempt == 0) {
        l->guesses = 0;
        status = solve_near(l, iterate);
        if (status < 0 || (status == PERP_OK && is_final(l, iterate)))
            return status;
        l->guesses = 0;
    }
    status = perp__sparse_start_cold(l);
    if (status == PERP__FACTOR_SINGULAR) {
        iterate->outcome = PERP_OUTCOME_STALLED;
        return PERP_OK;
    }
    return status < 0
               ? status
               : run(l, iterate, iterate->attempt - l->guesses, 1000 + 50 * (int64_t)l->pairs);
}

static void release(void *work)
{
    perp__sparse_lemke *l = work;

    perp__basis_release(&l->basis);
    perp__nested_release(&l->nested);
}

const perp__lcp_method perp__lcp_lemke_sparse = {
    PERP_LCP_LEMKE, sizeof(perp__sparse_lemke), ATTEMPTS, suits, check, layout, solve, release,
};
