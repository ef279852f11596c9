/* Lemke's method for LCPs with bounds: the attempts that are made, and what becomes of their ends.
 * The path itself is in path.c; what holds the basis is a dense tableau (dense.c), the same in
 * doubled precision (doubled.c) or sparse factors (sparse.c). */
#include "lcp/lemke/lemke.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/random.h"
#include "base/rounding.h"

/* Sparse problems with a larger part of the entries than 1 / FILLED are solved faster by a dense
 * tableau, as small ones are; up to the size below there is room for a dense tableau in doubled
 * precision where all else fails. */
#define FILLED 6
#define ROOM_TO_DOUBLE 1024
/* How the attempts differ. In double, 1e-11 of the largest numbers may be what rounding left of 0;
 * in doubled precision only the rounding of the data is left. The perturbation keeps degenerate
 * problems, as contact problems are, from wandering about at one vertex. Lengths of paths differ
 * tenfold between covering vectors, and no one is the best: where a path is too long (Murty's
 * examples double it with every row for e), not spoilt, others follow in double. Contact problems
 * of mass ratio 1e8 have pivots of every size, and no one pair of tolerances tells them all from
 * noise. */
static const perp__lemke_trial in_double[] = {
    {0, 0, 8, 1e-12, 1e-10, 1e-11},
    {0, 1, 8, 1e-12, 1e-10, 1e-11},
};
static const perp__lemke_trial in_doubled[] = {
    {1, 0, 20, 1e-11, 1e-14, 1e-13},
    {1, 1, 8, 1e-12, 1e-11, 1e-13},
    {1, 1, 8, 0.0, 1e-12, 1e-13},
};
enum {
    IN_DOUBLE = sizeof in_double / sizeof *in_double,
    IN_DOUBLED = sizeof in_doubled / sizeof *in_doubled,
    /* most problems need one; so often the last digits are looked for, too, and the end of a path
     * corrected that can tell what its slack has cost */
    ATTEMPTS = IN_DOUBLE + IN_DOUBLED
};

static void layout(perp__arena *arena, void *work)
{
    perp__lemke *l = work;
    const perp__lcp_problem *p = l->head.problem;
    const int32_t *starts = p->M->column_starts;
    const int64_t n = p->n;
    int32_t most = p->n;
    size_t pairs, rows;

    for (int32_t i = 0; i < p->n; i++)
        most += p->lower[i] == -INFINITY && p->upper[i] == INFINITY;
    l->capacity = most;
    pairs = (size_t)most;
    rows = perp__tableau_length(most);
    l->kernels = perp__row_kernels_number(0);
    l->is_sparse = starts && FILLED * (int64_t)starts[n] <= n * n;
    if (l->is_sparse)
        perp__factored_layout(arena, l);
    l->crash.common.problem = p;
    perp__active_set_layout(arena, &l->crash);
    PERP__DOUBLES(arena, pairs, &l->range, &l->covering, &l->base, &l->work, &l->row_unit,
                  &l->column_unit);
    PERP__DOUBLES(arena, rows + 1, &l->b, &l->low, &l->high, &l->column, &l->far, &l->speed);
    PERP__INTEGERS(arena, pairs, &l->index, &l->twin, &l->basic);
    l->row_of = perp__arena_take(arena, 2 * pairs + 1, sizeof(int32_t));
    l->sign = perp__arena_take(arena, pairs, sizeof(int8_t));
    l->at_upper = perp__arena_take(arena, pairs, sizeof(int8_t));
    l->places = perp__arena_take(arena, pairs, sizeof(int8_t));
}

void perp__lemke_write_pair(perp__lemke *l, int32_t k, int32_t i, int32_t sign, double range)
{
    l->index[k] = i;
    l->sign[k] = (int8_t)sign;
    l->range[k] = range;
    l->at_upper[k] = 0;
    l->twin[k] = -1;
    l->row_unit[k] = l->column_unit[k] = 1.0;
}

int32_t perp__lemke_name_pairs(perp__lemke *l)
{
    const perp__lcp_problem *p = l->head.problem;
    int32_t plain = 1, i;

    l->pairs = 0;
    for (i = 0; i < p->n; i++) {
        const double lower = p->lower[i], upper = p->upper[i];
        const bool from_above = lower == -INFINITY && upper != INFINITY;

        l->base[i] = from_above ? upper : lower == -INFINITY ? 0.0 : lower;
        plain &= lower != upper && !from_above;
        if (lower != upper) /* a fixed variable is data */
            perp__lemke_write_pair(l, l->pairs++, i, from_above ? -1 : 1, upper - lower);
    }
    return plain;
}

/* Random in [1, 2], the same in every run. */
static double draw(int32_t stream, int32_t k)
{
    uint64_t seed = ((uint64_t)stream * PERP__GOLDEN + (uint64_t)k) * PERP__GOLDEN;

    return 1.5 + 0.5 * perp__draw(&seed);
}

/* What the iterate is to hold of the current basis: z and places. */
static void write_point(const perp__lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;

    for (int32_t i = 0; i < p->n; i++) {
        iterate->z[i] = l->base[i];
        iterate->places[i] = PERP__FIXED;
    }
    for (int32_t k = 0; k < l->pairs; k++) {
        const bool upper_side = (l->at_upper[k] != 0) != (l->sign[k] < 0);
        const int32_t i = l->index[k];

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
    iterate->correct = l->row_of[perp__lemke_t(l)] < 0 ? l->basis->correct : NULL;
}

/* How the variable moves for a unit of the entering one. */
static double speed_of(const perp__lemke *l, int32_t variable, double least)
{
    const int32_t r = l->row_of[variable];

    if (variable == l->entering)
        return l->direction;
    return r >= 0 && fabs(l->column[r]) > least ? -l->direction * l->column[r] : 0.0;
}

/* The last column is the direction in which nothing blocks. */
static void write_ray(const perp__lemke *l, perp__lcp_iterate *iterate)
{
    const double least = l->basis->noise * perp__largest(l->column, l->pairs);
    const double dt = speed_of(l, perp__lemke_t(l), least);

    for (int32_t i = 0; i < l->head.problem->n; i++)
        iterate->ray[i] = iterate->covering[i] = 0.0;
    for (int32_t k = 0; k < l->pairs; k++) {
        const int32_t i = l->index[k];

        iterate->ray[i] += l->sign[k] * l->column_unit[k] * speed_of(l, k, least);
        if (l->twin[k] < 0 || l->sign[k] > 0)
            iterate->covering[i] = l->sign[k] * l->covering[k] / l->row_unit[k] * dt;
    }
}

/* perp__lcp_iterate's, by the factors of the crash. */
static int32_t correct_crash(void *work, const double *residual, double *step)
{
    perp__lemke *l = work;

    return perp__active_set_correct(&l->crash, residual, step);
}

perp_status perp__lemke_crash(perp__lemke *l, perp__lcp_iterate *iterate, int32_t few, double rho,
                              enum perp__lemke_guess *guess)
{
    const perp__lcp_problem *p = l->head.problem;
    perp__active_set_limits limits = {PERP__ITERATIONS, PERP__CRASH_PATIENCE, 0, few, rho};
    perp_status status;

    if (p->iteration_limit > 0 && p->iteration_limit < limits.iterations)
        limits.iterations = p->iteration_limit;
    l->crash.common.problem = p;
    status = perp__active_set_run(&l->crash, iterate, &limits);
    l->spent = iterate->iterations;
    if (status != PERP_OK || iterate->outcome == PERP_OUTCOME_SINGULAR)
        return status;
    *guess = PERP__GUESS_BASIS;
    if (iterate->outcome == PERP_OUTCOME_STALLED ||
        (iterate->outcome == PERP_OUTCOME_ITERATION_LIMIT && limits.iterations == PERP__ITERATIONS))
        return PERP_OK;
    *guess = PERP__GUESS_END;
    iterate->has_places = 1;
    iterate->correct = iterate->outcome == PERP_OUTCOME_SOLVED ? correct_crash : NULL;
    return PERP_OK;
}

/* From another basis than the cold one, near the solution's. A ray from there proves nothing, so
 * that only a solution or a stop counts: *done is 0 where the cold start must follow. */
static perp_status solve_near(perp__lemke *l, perp__lcp_iterate *iterate, int32_t *done)
{
    enum perp__lemke_guess guess = PERP__GUESS_NONE;
    bool covers = iterate->missing >= 0;
    double worst = 0.0;
    perp_status status;

    /* 1. The basis; or an end, or none. */
    l->slack = l->trial->slack;
    l->smallest_pivot = l->trial->smallest_pivot;
    status = l->basis->start_near(l, iterate, &guess);
    *done = status == PERP_OK && guess == PERP__GUESS_END;
    if (status != PERP_OK || guess != PERP__GUESS_BASIS)
        return status < 0 ? status : PERP_OK;
    /* 2. The column of t: what is infeasible moves to where it is feasible for the t that the worst
     * one needs, and what is feasible stays. A basic x with two bounds moves no further than half
     * way between them. Of a start that lacks one pair t is that pair's slack, if it covers all. */
    if (covers)
        status = l->basis->column(l, l->pairs + iterate->missing);
    for (int32_t r = 0; r < l->pairs; r++) {
        worst = fmax(worst, perp__lemke_violation(l, r));
        covers = covers && (l->column[r] < 0.0 || perp__lemke_violation(l, r) == 0.0);
    }
    for (int32_t r = 0; r < l->pairs; r++) {
        const double violation = perp__lemke_violation(l, r);
        const int32_t variable = l->basic[r];
        double d = violation > l->slack * l->largest_b ? 1.0 : 0.0;

        if (covers)
            d = -l->column[r];
        else if (variable < l->pairs && d > 0.0)
            d = fmin(d, (violation + 0.5 * l->range[variable]) / worst);
        if (l->b[r] > l->high[r])
            d = -d;
        l->column[r] = -d;
        l->covering[perp__lemke_pair(l, variable)] = d;
    }
    l->basis->set_covering(l);
    /* 3. The path. */
    if (status == PERP_OK)
        status = perp__lemke_follow_path(l, iterate, (int64_t)l->pairs + 16);
    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    iterate->iterations += l->spent;
    l->spent = iterate->iterations;
    write_point(l, iterate);
    *done =
        iterate->outcome != PERP_OUTCOME_RAY && iterate->outcome != PERP_OUTCOME_STALLED &&
        (iterate->outcome != PERP_OUTCOME_ITERATION_LIMIT || l->head.problem->iteration_limit > 0);
    return PERP_OK;
}

/* Makes t's column -1 in the rows whose variables are below their limits, +1 where they are above,
 * and 0 elsewhere. Returns how far the farthest is off; 0: none is by more than what half a
 * rounding of z may change. */
static double cover_slack(perp__lemke *l, const double *z)
{
    const perp__lcp_problem *p = l->head.problem;
    perp__cursor c = perp__first(p->M);
    double z_largest = 0.0, far = 0.0;

    /* 1. work := |S| |z| + |q|: the sizes of the roundings of z and of the data in a row. Rows at
     * rest among small numbers are known far better than the largest z. */
    for (int32_t i = 0; i < p->n; i++)
        l->work[i] = fabs(p->q[i]);
    while (perp__advance(&c))
        l->work[c.i] += fabs(c.value * z[c.j]);
    for (int32_t r = 0; r < l->pairs; r++)
        if (l->basic[r] < l->pairs)
            z_largest = fmax(z_largest, fabs(l->b[r]) * l->column_unit[l->basic[r]]);
    /* 2. The column; an x is known in doubled precision already, relative to the largest. */
    memset(l->covering, 0, (size_t)l->pairs * sizeof *l->covering);
    for (int32_t r = 0; r < l->pairs; r++) {
        const double off = perp__lemke_violation(l, r);
        const int32_t k = perp__lemke_pair(l, l->basic[r]);
        const double noise =
            l->basic[r] < l->pairs
                ? PERP__SUM_ROUNDING * PERP__SUM_ROUNDING * z_largest / l->column_unit[k]
                : 0.5 * DBL_EPSILON * l->work[l->index[k]] * l->row_unit[k];

        l->column[r] = off == 0.0 ? 0.0 : l->b[r] < l->low[r] ? -1.0 : 1.0;
        if (off == 0.0)
            continue;
        if (off > noise)
            far = fmax(far, off);
        l->covering[k] = 1.0;
    }
    return far;
}

/* The ratio test's slack lets variables go beyond their limits a little. From the basis where the
 * path has ended, with the values it really has, another path leads to one where they do not: its
 * covering vector has entries for these variables only. If it ends elsewhere the point that is
 * written already stays. */
static perp_status tighten(perp__lemke *l, perp__lcp_iterate *iterate)
{
    perp_status status = PERP_OK;

    for (int32_t round = 0; iterate->outcome == PERP_OUTCOME_SOLVED; round++) {
        double far;

        status = l->basis->values(l);
        if (status != PERP_OK)
            break;
        write_point(l, iterate);
        far = cover_slack(l, iterate->z);
        if (far == 0.0 || round == ATTEMPTS)
            break;
        l->basis->set_covering(l);
        l->slack = 1e-3 * far / l->largest_b;
        l->spent = iterate->iterations;
        status = perp__lemke_follow_path(l, iterate, (int64_t)l->pairs + 16);
        iterate->iterations += l->spent;
    }
    iterate->outcome = PERP_OUTCOME_SOLVED;
    return status < 0 ? status : PERP_OK;
}

static perp_status solve_cold(perp__lemke *l, perp__lcp_iterate *iterate)
{
    const perp__lcp_problem *p = l->head.problem;
    const bool random = l->trial->random || iterate->rays > 0;
    perp_status status = l->basis->start(l, iterate);
    double size;
    int32_t t_row;

    if (status != PERP_OK) {
        l->outcome = iterate->outcome = PERP_OUTCOME_STALLED;
        return status < 0 ? status : PERP_OK;
    }
    l->slack = l->trial->slack;
    l->smallest_pivot = l->trial->smallest_pivot;
    /* 1. The column of t: d in the rows of basic v, 0 in those of basic free x. Only this is what
     * makes Lemke's method process copositive matrices, and a ray mean something; and once e has
     * ended in one another vector must have the second word on that. */
    for (int32_t r = 0; r < l->pairs; r++) {
        const int32_t is_v = l->basic[r] >= l->pairs, k = perp__lemke_pair(l, l->basic[r]);

        l->covering[k] = !is_v ? 0.0 : random ? draw(1 + iterate->attempt, k) : 1.0;
        l->column[r] = is_v ? -l->covering[k] : 0.0;
    }
    l->basis->set_covering(l);
    /* 2. Against wandering: the trial's perturbation, which in double it is for the polish to take
     * away again. */
    size = p->settings->pivot_rule == PERP_PIVOT_HARRIS && (l->basis->values || p->settings->polish)
               ? l->trial->perturbation * l->largest_b
               : 0.0;
    for (int32_t r = 0; size > 0.0 && r < l->pairs; r++) {
        const double change = size * draw(101 + iterate->attempt, r);

        if (l->basic[r] < l->pairs)
            continue;
        l->b[r] += change;
        if (l->basis == &perp__lemke_sparse) /* slacks have unit columns */
            l->factored.q[l->basic[r] - l->pairs] += change;
    }
    /* 3. The path, and where it ends: elsewhere than at a solution, but near it, the polish may
     * mend that. */
    status = perp__lemke_follow_path(l, iterate, 200 + l->trial->patience * (int64_t)l->pairs);
    if (status != PERP_OK)
        return status;
    l->outcome = iterate->outcome;
    iterate->iterations += l->spent;
    write_point(l, iterate);
    t_row = l->row_of[perp__lemke_t(l)];
    iterate->far_off = (l->outcome == PERP_OUTCOME_RAY || l->outcome == PERP_OUTCOME_STALLED ||
                        (l->outcome == PERP_OUTCOME_ITERATION_LIMIT && p->iteration_limit <= 0)) &&
                       t_row >= 0 && fabs(l->b[t_row]) > PERP__DOUBTFUL * l->largest_b;
    if (l->outcome == PERP_OUTCOME_RAY)
        write_ray(l, iterate);
    return l->basis->values && l->outcome == PERP_OUTCOME_SOLVED ? tighten(l, iterate) : PERP_OK;
}

static perp_status solve(void *work, perp__lcp_iterate *iterate)
{
    perp__lemke *l = work;
    perp_status status = PERP_OK;

    l->spent = 0;
    if (iterate->attempt == 0)
        l->guessed = 0;
    /* 1. The trial, given how the last one ended, and what holds the basis. */
    if (iterate->attempt == l->guessed)
        l->tried = l->tried_doubled = 0;
    if (iterate->attempt == l->guessed ||
        (!l->trial->doubled && l->outcome == PERP_OUTCOME_ITERATION_LIMIT && l->tried < IN_DOUBLE))
        l->trial = &in_double[l->tried++];
    else
        l->trial = &in_doubled[l->tried_doubled++ % IN_DOUBLED];
    if (l->trial->doubled && (!l->is_sparse || l->capacity <= ROOM_TO_DOUBLE))
        l->basis = &perp__lemke_doubled;
    else
        l->basis = l->is_sparse ? &perp__lemke_sparse : &perp__lemke_dense;
    iterate->improvable = !l->is_sparse && l->tried_doubled < ATTEMPTS;
    /* 2. From a guess, or else from the problem as it is. */
    if (iterate->attempt == 0)
        status = solve_near(l, iterate, &l->guessed);
    return status != PERP_OK || (iterate->attempt == 0 && l->guessed) ? status
                                                                      : solve_cold(l, iterate);
}

static void release(void *work)
{
    perp__lemke *l = work;

    perp__arena_release(&l->tableau_arena);
    perp__arena_release(&l->doubled.arena);
    perp__basis_release(&l->factored.basis);
    perp__active_set_release(&l->crash);
}

const perp__lcp_method perp__lcp_lemke = {
    PERP_LCP_LEMKE, sizeof(perp__lemke), ATTEMPTS, 1, NULL, layout, solve, release,
};
