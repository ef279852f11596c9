/* Lemke's path (Lemke 1965; Cottle, Pang & Stone 1992, section 4.4; bounds after Sargent 1978).
 *
 * All basic variables are made feasible by v = M z + q + d t with t large; then t is driven to 0.
 * At every vertex of the path exactly one pair has both members nonbasic, and the member that did
 * not just leave enters. A variable that reaches its other bound before any basic variable blocks
 * flips over without a pivot. Where nothing blocks, the path ends in a ray. */
#include <float.h>
#include <math.h>

#include "base/context.h"
#include "lcp/lemke/lemke.h"
#include "linalg/lanes/vectors.h"

#define TEMPLATE "lcp/lemke/rows_vector.h"
#include "linalg/lanes/each_set.h"

static const perp__row_kernels *const kernels[] = {PERP__OF_EACH_SET(&kernels)};

const perp__row_kernels *perp__row_kernels_number(int32_t number)
{
    const int32_t widest = (int32_t)perp__widest_vectors();

    return number >= 0 && number <= widest ? kernels[widest - number] : NULL;
}

bool perp__lemke_is_free(const perp__lemke *l, int32_t k)
{
    const perp__lcp_problem *p = l->head.problem;

    return l->twin[k] < 0 && p->lower[l->index[k]] == -INFINITY &&
           p->upper[l->index[k]] == INFINITY;
}

/* The limits of a basic variable; -inf and +inf where it has none. */
static void write_limits(perp__lemke *l, int32_t r)
{
    const int32_t variable = l->basic[r];

    l->low[r] = 0.0;
    l->high[r] = INFINITY;
    if (variable < l->pairs) {
        l->high[r] = l->range[variable];
        if (perp__lemke_is_free(l, variable))
            l->low[r] = -INFINITY;
    } else if (variable < perp__lemke_t(l) && l->at_upper[variable - l->pairs]) {
        l->low[r] = -INFINITY;
        l->high[r] = 0.0;
    }
}

void perp__lemke_write_limits(perp__lemke *l)
{
    int32_t r;

    for (r = 0; r < l->pairs; r++)
        write_limits(l, r);
    for (; (size_t)r < perp__tableau_length(l->pairs); r++) {
        l->column[r] = l->b[r] = l->low[r] = 0.0;
        l->high[r] = INFINITY;
    }
}

double perp__lemke_violation(const perp__lemke *l, int32_t r)
{
    const double below = l->low[r] - l->b[r], above = l->b[r] - l->high[r];
    const double most = below > above ? below : above;

    return most > 0.0 ? most : 0.0;
}

/* How far the basic variable of row r is from the limit it moves towards, and how fast it moves for
 * a unit of the entering variable. Returns 0 where it does not block: no limit, or slower than
 * `floor`. */
static bool find_distance(const perp__lemke *l, int32_t r, double floor, double *far, double *speed)
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
        l->basis->noise,
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

/* The row of B^-1 over its pivot: what the perturbation (e, e^2, ...) of the first right-hand side
 * adds to the ratio of row r. */
static void write_perturbations(perp__lemke *l, int32_t r, double *row)
{
    const double pivot = l->direction * l->column[r];

    l->basis->inverse_row(l, r, row);
    for (int32_t j = 0; j < l->pairs; j++)
        row[j] /= pivot;
}

static int32_t lexicographic_row(perp__lemke *l, double own_range)
{
    const double floor = l->smallest_pivot * perp__largest(l->column, l->pairs);
    double *best = l->far, *other = l->speed;
    double least = INFINITY, far, speed, tie;
    int32_t found = PERP__NO_ROW, ties = 0, r;

    /* 1. The least ratio, and the first row that has it; t wins a tie. Exact data tie exactly,
     * rounding nearly so. */
    for (r = 0; r < l->pairs; r++)
        if (find_distance(l, r, floor, &far, &speed) && far / speed < least)
            least = far / speed;
    if (own_range < least)
        return PERP__FLIP;
    tie = least * (1.0 + PERP__DEPENDENT);
    for (r = 0; r < l->pairs; r++) {
        if (!find_distance(l, r, floor, &far, &speed) || !(far / speed <= tie))
            continue;
        if (l->basic[r] == perp__lemke_t(l))
            return r;
        /* 2. Of rows that tie, the one whose perturbations come first. */
        if (ties++ == 1)
            write_perturbations(l, found, best);
        if (ties > 1) {
            double *kept = best;
            int32_t j = 0;

            write_perturbations(l, r, other);
            while (j < l->pairs &&
                   !(fabs(other[j] - best[j]) > PERP__DEPENDENT * (fabs(other[j]) + fabs(best[j]))))
                j++;
            if (j == l->pairs || !(other[j] < best[j]))
                continue;
            best = other;
            other = kept;
        }
        found = r;
    }
    return found;
}

static int32_t blocking_row(perp__lemke *l, double own_range)
{
    return l->head.problem->settings->pivot_rule == PERP_PIVOT_LEXICOGRAPHIC
               ? lexicographic_row(l, own_range)
               : harris_row(l, own_range);
}

/* Finds the row whose basic variable stops the entering one, whose column is in l->column;
 * PERP__FLIP if that reaches its own other bound, own_range away, before any row blocks;
 * PERP__NO_ROW if nothing does. What looks like a ray or a tiny pivot is looked at again with new
 * factors. */
static perp_status find_blocking(perp__lemke *l, double own_range, int32_t *r)
{
    perp_status status = l->basis->column(l, l->entering);

    if (status != PERP_OK)
        return status;
    *r = blocking_row(l, own_range);
    if (!l->basis->refactor || *r == PERP__FLIP ||
        (*r >= 0 && fabs(l->column[*r]) >= PERP__DOUBTFUL * perp__largest(l->column, l->pairs)))
        return PERP_OK;
    status = l->basis->refactor(l);
    if (status == PERP__LEMKE_AS_NEW)
        return PERP_OK;
    PERP__THEN(status, l->basis->column(l, l->entering));
    if (status == PERP_OK)
        *r = blocking_row(l, own_range);
    return status;
}

double perp__lemke_move(perp__lemke *l, int32_t r, double far)
{
    const double step = r >= 0 ? far / fabs(l->column[r]) : far;

    l->kernels->move(perp__tableau_length(l->pairs), l->direction * step, l->column, l->b);
    return step;
}

/* Moves along the column of the entering variable, which started at `from`, until row r blocks
 * after `far`, and exchanges the two. */
static perp_status pivot(perp__lemke *l, int32_t r, double far, double from)
{
    const int32_t leaving = l->basic[r], entering = l->entering;
    const double step = l->basis->move(l, r, far);

    l->b[r] = from + l->direction * step;
    l->basic[r] = entering;
    l->row_of[entering] = r;
    l->row_of[leaving] = -1;
    write_limits(l, r);
    return l->basis->exchange(l, r, leaving);
}

/* The partner of what just left enters; sets its direction. */
static void enter_partner(perp__lemke *l, int32_t leaving, int32_t left_at_upper)
{
    if (leaving < l->pairs) {
        l->at_upper[leaving] = (int8_t)left_at_upper;
        l->direction = left_at_upper ? -1.0 : 1.0;
        l->entering = leaving + l->pairs;
    } else {
        l->direction = l->at_upper[leaving - l->pairs] ? -1.0 : 1.0;
        l->entering = leaving - l->pairs;
    }
}

/* One step of the path: the entering variable goes as far as it can. Sets *outcome where the path
 * ends, else the next entering variable. */
static perp_status advance(perp__lemke *l, perp_outcome *outcome)
{
    const bool is_x = l->entering < l->pairs;
    const double own_range = is_x ? l->range[l->entering] : INFINITY;
    const double from = is_x && l->at_upper[l->entering] ? own_range : 0.0;
    double far = 0.0, speed = 1.0;
    int32_t r, leaving, at_upper;
    perp_status status = find_blocking(l, own_range, &r);

    if (status != PERP_OK)
        return status;
    if (r == PERP__NO_ROW) {
        *outcome = PERP_OUTCOME_RAY;
        return PERP_OK;
    }
    if (r == PERP__FLIP) {
        l->basis->move(l, r, own_range);
        enter_partner(l, l->entering, l->direction > 0.0);
        return PERP_OK;
    }
    find_distance(l, r, 0.0, &far, &speed);
    leaving = l->basic[r];
    at_upper = leaving < l->pairs && -l->direction * l->column[r] > 0.0;
    status = pivot(l, r, far, from);
    if (leaving == perp__lemke_t(l))
        *outcome = PERP_OUTCOME_SOLVED;
    else
        enter_partner(l, leaving, at_upper);
    return status;
}

perp_status perp__lemke_follow_path(perp__lemke *l, perp__lcp_iterate *iterate, int64_t most)
{
    const perp__lcp_problem *p = l->head.problem;
    const int64_t limit = p->iteration_limit > 0 ? p->iteration_limit - l->spent : most;
    double worst = 0.0;
    int32_t first = -1, leaving, at_upper;
    perp_outcome outcome = -1;
    perp_status status;

    /* 1. The row that t must make feasible last; of rows that tie, the last, as the lexicographic
     * order of the unit matrix has it. Without any the basis solves the problem. */
    for (int32_t r = 0; r < l->pairs; r++) {
        const double d = l->covering[perp__lemke_pair(l, l->basic[r])];
        const double violation = perp__lemke_violation(l, r);

        if (d != 0.0 && violation != 0.0 && violation / fabs(d) >= worst) {
            worst = violation / fabs(d);
            first = r;
        }
    }
    iterate->iterations = 0;
    iterate->outcome = first < 0 ? PERP_OUTCOME_SOLVED : PERP_OUTCOME_ITERATION_LIMIT;
    if (first < 0 || limit <= 0)
        return PERP_OK;
    /* 2. t enters there. */
    leaving = l->basic[first];
    at_upper = leaving < l->pairs && l->b[first] > 0.0;
    l->direction = 1.0;
    l->entering = perp__lemke_t(l);
    status = pivot(l, first, perp__lemke_violation(l, first), 0.0);
    enter_partner(l, leaving, at_upper);
    /* 3. Steps of the path, until it ends. */
    for (iterate->iterations = 1; status == PERP_OK && outcome < 0; iterate->iterations++) {
        const perp__tableau *t = &l->tableau; /* the next one may be what all of it waits for */
        const bool waits = l->basis == &perp__lemke_dense && t->pending + 1 >= t->delay;

        if (iterate->iterations >= limit)
            outcome = PERP_OUTCOME_ITERATION_LIMIT;
        else if (iterate->iterations % 16 == 1)
            outcome = perp__lcp_tick(p->control, l->spent + iterate->iterations, INFINITY);
        else if (!perp__lcp_has_time(p->control, waits ? 0.25 * t->delay : 0.0))
            outcome = PERP_OUTCOME_TIME_LIMIT; /* one product takes .08 to .55 of an entry */
        if (outcome < 0)
            status = advance(l, &outcome);
        if (outcome >= 0 && outcome != PERP_OUTCOME_SOLVED)
            break;
    }
    iterate->outcome = status == PERP__FACTOR_SINGULAR ? PERP_OUTCOME_STALLED : outcome;
    return status < 0 ? status : PERP_OK;
}
