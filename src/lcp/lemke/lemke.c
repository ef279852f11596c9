/* Lemke's method for LCPs with bounds: complementary pivoting along the path that a covering vector
 * d opens (Lemke 1965; Cottle, Pang & Stone 1992, section 4.4; bounds after Sargent 1978).
 *
 * All basic variables are made feasible by v = M z + q + d t with t large; then t is driven to 0.
 * At every vertex of the path exactly one pair has both members nonbasic, and the member that did
 * not just leave enters. A variable that reaches its other bound before any basic variable blocks
 * flips over without a pivot. Where nothing blocks, the path ends in a ray. */
#include "lcp/lemke/lemke.h"

#include <math.h>
#include <string.h>

/* Most problems need one, the hardest contact problems met so far a dozen. */
#define ATTEMPTS 11
/* A t that is larger than this, relative to its start, is no end that a polish could mend. */
#define FAR_OFF 1e-6
/* Paths that correct the end of one in doubled precision. */
#define CORRECTIONS 3

static perp_status check(const perp__lcp_problem *problem)
{
    (void)problem;
    return PERP_OK; /* any M, any bounds */
}

static void layout(perp__arena *arena, void *work)
{
    perp__lemke *l = work;
    const perp__lcp_problem *p = l->head.problem;
    int32_t i, most = p->n;
    size_t pairs, rows;

    for (i = 0; i < p->n; i++)
        most += p->lower[i] == -INFINITY && p->upper[i] == INFINITY;
    l->capacity = most;
    pairs = (size_t)most;
    rows = perp__tableau_length(most);
    l->kernels = perp__row_kernels_choose();
    perp__tableau_layout(arena, &l->tableau, most, most + 1);
    l->index = perp__arena_take(arena, pairs, sizeof(int32_t));
    l->sign = perp__arena_take(arena, pairs, sizeof(int8_t));
    l->at_upper = perp__arena_take(arena, pairs, sizeof(int8_t));
    l->range = perp__arena_take(arena, pairs, sizeof(double));
    l->cover = perp__arena_take(arena, pairs, sizeof(double));
    l->twin = perp__arena_take(arena, pairs, sizeof(int32_t));
    l->basic = perp__arena_take(arena, pairs, sizeof(int32_t));
    l->nonbasic = perp__arena_take(arena, pairs + 1, sizeof(int32_t));
    l->row_of = perp__arena_take(arena, 2 * pairs + 1, sizeof(int32_t));
    l->column_of = perp__arena_take(arena, 2 * pairs + 1, sizeof(int32_t));
    l->base = perp__arena_take(arena, (size_t)p->n, sizeof(double));
    l->b = perp__arena_take(arena, rows, sizeof(double));
    l->low = perp__arena_take(arena, rows, sizeof(double));
    l->high = perp__arena_take(arena, rows, sizeof(double));
    l->column = perp__arena_take(arena, rows, sizeof(double));
    l->far = perp__arena_take(arena, rows + 1, sizeof(double));
    l->speed = perp__arena_take(arena, rows, sizeof(double));
    l->row = perp__arena_take(arena, (size_t)p->n, sizeof(double));
    l->row_unit = perp__arena_take(arena, pairs, sizeof(double));
    l->column_unit = perp__arena_take(arena, pairs, sizeof(double));
    l->queue = perp__arena_take(arena, pairs, sizeof(int32_t));
    l->places = perp__arena_take(arena, (size_t)p->n, sizeof(int8_t));
    if (!p->M->column_starts)
        perp__block_pivoting_layout(arena, &l->crash, p->n, 1);
    l->examined = 0;
}

/* Adds the column of t: d in the rows of basic v, 0 in those of basic free x. */
static void add_cover(perp__lemke *l, const perp__lcp_iterate *iterate)
{
    const int32_t last = l->tableau.columns;
    double *column = l->tableau.T + (size_t)last * (size_t)l->tableau.leading_dimension;
    int32_t r;

    for (r = 0; r < l->pairs; r++) {
        int32_t is_v = l->basic[r] >= l->pairs;

        if (is_v)
            l->cover[l->basic[r] - l->pairs] = perp__lemke_trial_cover(l, iterate, r);
        else
            l->cover[l->basic[r]] = 0.0;
        column[r] = is_v ? -l->cover[l->basic[r] - l->pairs] : 0.0;
    }
    perp__tableau_reset(&l->tableau, l->pairs, last + 1);
    l->nonbasic[last] = perp__lemke_t(l);
    l->column_of[perp__lemke_t(l)] = last;
}

static void take_column(perp__lemke *l, int32_t variable)
{
    if (l->doubled.on)
        perp__doubled_column(l, variable);
    else
        perp__tableau_column(&l->tableau, l->column_of[variable], l->column);
}

/* The entering variable moves by step + low in its direction. */
static void move(perp__lemke *l, double step, double low)
{
    if (l->doubled.on) {
        perp__doubled_move(l, step, low);
        return;
    }
    l->kernels->move(perp__tableau_length(l->pairs), l->direction * step, l->column, l->b);
}

/* Moves along the column of `entering`, which started at `from`, until row r blocks after `far`,
 * and exchanges the two. Returns 0 where the basis turns out singular. */
static int32_t pivot(perp__lemke *l, int32_t r, int32_t entering, double far, double from)
{
    const int32_t leaving = l->basic[r], c = l->column_of[entering];
    double low = 0.0;
    const double step =
        l->doubled.on ? perp__doubled_step(l, r, far, &low) : far / fabs(l->column[r]);

    move(l, step, low);
    l->b[r] = from + l->direction * step;
    l->basic[r] = entering;
    l->nonbasic[c] = leaving;
    l->row_of[entering] = r;
    l->column_of[entering] = -1;
    l->row_of[leaving] = -1;
    l->column_of[leaving] = c;
    perp__lemke_limits(l, entering, &l->low[r], &l->high[r]);
    if (l->doubled.on) {
        l->doubled.b_low[r] = l->direction * low;
        return perp__doubled_exchange(l, r);
    }
    perp__tableau_exchange(&l->tableau, r, c, l->column);
    return 1;
}

/* The partner of what just left at `value` enters; sets its direction. */
static int32_t partner_of(perp__lemke *l, int32_t leaving, int32_t left_at_upper)
{
    if (leaving < l->pairs) {
        l->at_upper[leaving] = (int8_t)left_at_upper;
        l->direction = left_at_upper ? -1.0 : 1.0;
        return leaving + l->pairs;
    }
    l->direction = l->at_upper[leaving - l->pairs] ? -1.0 : 1.0;
    return leaving - l->pairs;
}

/* Steps of length 0 without end, or steps without end where t is as small as what was done to b. */
static int32_t is_idle(perp__lemke *l)
{
    l->idle++;
    if (fabs(l->b[l->row_of[perp__lemke_t(l)]]) > l->near_end)
        l->near = 0;
    else
        l->near++;
    return l->idle > l->most_idle || l->near > l->most_idle;
}

/* One step of the path: the entering variable goes as far as it can. Returns the next entering
 * variable, or -1 with the outcome set. */
static int32_t advance(perp__lemke *l, int32_t entering, perp_outcome *outcome)
{
    const int32_t is_x = entering < l->pairs;
    const double own_range = is_x ? l->range[entering] : INFINITY;
    const double from = is_x && l->at_upper[entering] ? own_range : 0.0;
    double far = 0.0, speed = 1.0;
    int32_t r, leaving, at_upper;

    take_column(l, entering);
    r = perp__lemke_blocking_row(l, own_range);
    if (r == PERP__NO_ROW) {
        *outcome = PERP_OUTCOME_RAY;
        return -1;
    }
    if (r == PERP__FLIP) {
        move(l, own_range, 0.0);
        return partner_of(l, entering, l->direction > 0.0);
    }
    perp__lemke_distance(l, r, 0.0, &far, &speed);
    if (far > 0.0)
        l->idle = 0;
    leaving = l->basic[r];
    at_upper = leaving < l->pairs && -l->direction * l->column[r] > 0.0;
    if (!pivot(l, r, entering, far, from)) {
        *outcome = PERP_OUTCOME_STALLED;
        return -1;
    }
    if (leaving == perp__lemke_t(l)) {
        *outcome = PERP_OUTCOME_SOLVED;
        return -1;
    }
    return partner_of(l, leaving, at_upper);
}

static perp_outcome follow_path(perp__lemke *l, perp__lcp_iterate *iterate, int64_t most,
                                int32_t *entering)
{
    const perp__lcp_problem *p = l->head.problem;
    const int64_t limit = p->iteration_limit > 0 ? p->iteration_limit - l->spent : most;
    perp_outcome outcome = PERP_OUTCOME_SOLVED, stop;
    int32_t r = perp__lemke_first_row(l), leaving, at_upper;

    iterate->iterations = 0;
    if (r < 0)
        return PERP_OUTCOME_SOLVED;
    l->direction = 1.0;
    take_column(l, perp__lemke_t(l));
    leaving = l->basic[r];
    at_upper = leaving < l->pairs && l->b[r] > 0.0;
    pivot(l, r, perp__lemke_t(l), perp__lemke_violation(l, r), 0.0);
    *entering = partner_of(l, leaving, at_upper);
    for (iterate->iterations = 1; *entering >= 0; iterate->iterations++) {
        int32_t next;

        if (iterate->iterations >= limit)
            return PERP_OUTCOME_ITERATION_LIMIT;
        if (iterate->iterations % 16 == 1) {
            stop = perp__lcp_tick(p->control, l->spent + iterate->iterations, INFINITY);
            if (stop >= 0)
                return stop;
        }
        if (is_idle(l))
            return PERP_OUTCOME_STALLED;
        next = advance(l, *entering, &outcome);
        if (next < 0 && outcome == PERP_OUTCOME_RAY)
            return outcome;
        *entering = next;
    }
    return outcome;
}

static void write_point(const perp__lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;
    int32_t i, k;

    for (i = 0; i < p->n; i++) {
        iterate->z[i] = l->base[i];
        iterate->places[i] = PERP__FIXED;
    }
    for (k = 0; k < l->pairs; k++) {
        int32_t upper_side = (l->at_upper[k] != 0) != (l->sign[k] < 0);

        i = l->index[k];
        if (l->row_of[k] >= 0)
            iterate->z[i] += l->sign[k] * l->column_unit[k] * l->b[l->row_of[k]];
        else if (l->at_upper[k])
            iterate->z[i] = upper_side ? p->upper[i] : p->lower[i];
        if (l->row_of[k] >= 0 || l->twin[k] >= 0)
            iterate->places[i] = PERP__BETWEEN;
        else
            iterate->places[i] = upper_side ? PERP__AT_UPPER : PERP__AT_LOWER;
    }
    iterate->has_places = 1;
    iterate->correct =
        !l->doubled.on && l->row_of[perp__lemke_t(l)] < 0 ? perp__lemke_correct : NULL;
}

/* The last column is the direction in which nothing blocks. */
static void write_ray(const perp__lemke *l, int32_t entering, perp__lcp_iterate *iterate)
{
    const int32_t t_row = l->row_of[perp__lemke_t(l)];
    const double dt = t_row >= 0 ? -l->direction * l->column[t_row] : 0.0;
    int32_t i, k;

    for (i = 0; i < l->head.problem->n; i++)
        iterate->ray[i] = iterate->cover[i] = 0.0;
    for (k = 0; k < l->pairs; k++) {
        double dx = l->row_of[k] >= 0 ? -l->direction * l->column[l->row_of[k]] : 0.0;

        if (k == entering)
            dx = l->direction;
        i = l->index[k];
        iterate->ray[i] += l->sign[k] * l->column_unit[k] * dx;
        if (l->twin[k] < 0 || l->sign[k] > 0)
            iterate->cover[i] = l->sign[k] * l->cover[k] / l->row_unit[k] * dt;
    }
}

/* From another basis than the cold one. A ray from there proves nothing, so that only a solution or
 * a stop counts. Returns 0 where the cold start must follow. */
static int32_t solve_from_guess(perp__lemke *l, perp__lcp_iterate *iterate)
{
    const enum perp__lemke_guess guess = perp__lemke_guess_basis(l, iterate);
    const perp__lcp_problem *p = l->head.problem;
    int32_t entering = -1;

    if (guess != PERP__GUESS_BASIS)
        return guess == PERP__GUESS_END;
    perp__lemke_begin_path(l);
    if (!perp__lemke_start_at(l))
        return 0;
    perp__lemke_reset_units(l);
    iterate->outcome = follow_path(l, iterate, (int64_t)l->pairs + 16, &entering);
    iterate->iterations += l->spent;
    l->spent = iterate->iterations;
    write_point(l, iterate);
    return iterate->outcome != PERP_OUTCOME_RAY && iterate->outcome != PERP_OUTCOME_STALLED &&
           (iterate->outcome != PERP_OUTCOME_ITERATION_LIMIT || p->iteration_limit > 0);
}

/* The ratio test's slack lets variables go beyond their limits a little. From the basis where the
 * path has ended, with the values it really has, another path leads to one where they do not: its
 * cover has entries for these variables only. If it ends elsewhere the point that is written
 * already stays. */
static void tighten(perp__lemke *l, perp__lcp_iterate *iterate)
{
    int32_t round, entering;

    for (round = 0; round < CORRECTIONS; round++) {
        double far;

        perp__doubled_values(l);
        write_point(l, iterate);
        far = perp__doubled_cover(l);
        if (far == 0.0)
            return;
        l->slack = 1e-3 * far / l->largest_b;
        l->spent = iterate->iterations;
        if (follow_path(l, iterate, (int64_t)l->pairs + 16, &entering) != PERP_OUTCOME_SOLVED)
            round = CORRECTIONS;
        iterate->iterations += l->spent;
    }
    if (round > CORRECTIONS)
        return;
    perp__doubled_values(l);
    write_point(l, iterate);
}

/* Whether a path that ended elsewhere came near its end. */
static int32_t is_far_off(const perp__lemke *l, perp_outcome outcome)
{
    const int32_t t_row = l->row_of[perp__lemke_t(l)];

    return (outcome == PERP_OUTCOME_RAY || outcome == PERP_OUTCOME_STALLED ||
            (outcome == PERP_OUTCOME_ITERATION_LIMIT && l->head.problem->iteration_limit <= 0)) &&
           t_row >= 0 && fabs(l->b[t_row]) > FAR_OFF * l->largest_b;
}

static perp_status solve(void *work, perp__lcp_iterate *iterate)
{
    perp__lemke *l = work;
    const perp_outcome last = l->outcome;
    int32_t entering = -1;

    l->doubled.on = 0;
    l->spent = 0;
    if (iterate->attempt == 0) {
        l->guessed = 0;
        perp__lemke_choose_trial(l, iterate, last);
        l->guessed = solve_from_guess(l, iterate);
        if (l->guessed)
            return PERP_OK;
    } else {
        perp__lemke_choose_trial(l, iterate, last);
    }
    if (l->trial->doubled) {
        const perp_status status = perp__doubled_fit(l);

        if (status != PERP_OK)
            return status;
    }
    perp__lemke_start(l);
    perp__lemke_reset_units(l);
    perp__lemke_choose_units(l, iterate->attempt > 0);
    add_cover(l, iterate);
    perp__lemke_begin_path(l);
    if (l->trial->doubled)
        perp__doubled_start(l);
    perp__lemke_perturb(l, iterate->attempt);
    l->outcome = iterate->outcome =
        follow_path(l, iterate, 200 + l->trial->patience * (int64_t)l->pairs, &entering);
    iterate->iterations += l->spent;
    write_point(l, iterate);
    iterate->far_off = is_far_off(l, iterate->outcome);
    if (l->doubled.on && iterate->outcome == PERP_OUTCOME_SOLVED)
        tighten(l, iterate);
    if (iterate->outcome == PERP_OUTCOME_RAY)
        write_ray(l, entering, iterate);
    return PERP_OK;
}

static void release(void *work)
{
    perp__doubled_release(work);
}

const perp__lcp_method perp__lcp_lemke = {
    PERP_LCP_LEMKE, sizeof(perp__lemke), ATTEMPTS, NULL, check, layout, solve, release,
};
