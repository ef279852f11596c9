/* Given an index set, solve M_AA z_A = -(q_A + M_AN z_N), and move every index that is infeasible
 * to where it belongs: z_i outside of its bounds onto the nearer one, w_i of the wrong sign into A.
 * Few rounds of that solve most problems with a P-matrix (Kostreva, "Block pivot methods for
 * solving the complementarity problem", Linear Algebra and its Applications 21, 1978), but it can
 * cycle. So where the number of infeasibilities does not fall for some rounds, only the last
 * infeasible index moves until it does, as in Murty's method, which is finite for P-matrices
 * (Judice & Pires, "A block principal pivoting algorithm for large-scale strictly monotone linear
 * complementarity problems", Computers & Operations Research 21, 1994; bounds: the same authors,
 * "Basic-set algorithm for a generalized linear complementarity problem", JOTA 74, 1992). */
#include "base/rounding.h"
#include "lcp/active_set/active_set.h"

#include <float.h>
#include <math.h>
#include <string.h>

void perp__block_pivoting_layout(perp__arena *arena, perp__block_pivoting *b, int32_t n,
                                 int32_t lent)
{
    const size_t size = (size_t)n;

    perp__active_block_layout(arena, &b->active, n, lent);
    b->places = perp__arena_take(arena, size, sizeof(int8_t));
    b->trial_places = perp__arena_take(arena, size, sizeof(int8_t));
    b->next = perp__arena_take(arena, size, sizeof(int8_t));
    PERP__DOUBLES(arena, size, &b->trial_z, &b->z, &b->w);
}

void perp__block_pivoting_start(const perp__lcp_problem *problem, int8_t *places)
{
    const double *lower = problem->lower, *upper = problem->upper;

    for (int32_t i = 0; i < problem->n; i++)
        places[i] = lower[i] == upper[i]    ? PERP__FIXED
                    : lower[i] != -INFINITY ? PERP__AT_LOWER
                    : upper[i] != INFINITY  ? PERP__AT_UPPER
                                            : PERP__BETWEEN;
}

void perp__places_of(const perp__lcp_problem *problem, const double *z, int8_t *places)
{
    const double *lower = problem->lower, *upper = problem->upper;

    for (int32_t i = 0; i < problem->n; i++)
        places[i] = perp__place(lower[i] == upper[i], z[i] - lower[i], z[i] - upper[i], 0.0);
}

/* The z that `trial_places` stands for, and its w. */
static enum perp__block_state solve_places(perp__block_pivoting *b)
{
    const perp__lcp_problem *p = b->problem;
    enum perp__block_state state = perp__active_block_choose(&b->active, b->trial_places);
    int32_t any = 0, i;

    if (state != PERP__BLOCK_READY)
        return state;
    for (i = 0; i < p->n; i++) {
        b->trial_z[i] = b->trial_places[i] == PERP__BETWEEN    ? 0.0
                        : b->trial_places[i] == PERP__AT_UPPER ? p->upper[i]
                                                               : p->lower[i];
        any |= b->trial_z[i] != 0.0;
    }
    if (any)
        perp__lcp_affine(p, b->trial_z, b->w);
    else
        memcpy(b->w, p->q, (size_t)p->n * sizeof *b->w);
    if (b->active.count + b->active.changes == 0) /* nothing is between */
        return state;
    perp__active_block_solve(&b->active, b->trial_places, b->w);
    for (i = 0; i < p->n; i++)
        if (b->trial_places[i] == PERP__BETWEEN)
            b->trial_z[i] = 0.0 - b->w[i]; /* no -0 */
    perp__lcp_affine(p, b->trial_z, b->w);
    return state;
}

/* Finds `next`, where every index belongs. Returns how many are elsewhere; -1: z is not finite. */
static int32_t find_next(perp__block_pivoting *b)
{
    const perp__lcp_problem *p = b->problem;
    const double *z = b->trial_z, *w = b->w;
    double z_largest = 0.0, nothing = 0.0; /* NaN once a NaN or an infinity is met */
    int32_t count = 0;

    for (int32_t i = 0; i < p->n; i++) {
        const double size = fabs(z[i]);

        nothing += 0.0 * z[i] + 0.0 * w[i];
        z_largest = size > z_largest ? size : z_largest;
    }
    for (int32_t i = 0; i < p->n; i++) {
        const int8_t place = b->trial_places[i];
        const double wrong = place == PERP__AT_LOWER ? -w[i] : place == PERP__AT_UPPER ? w[i] : 0.0;
        const double noise = PERP__SUM_ROUNDING * z_largest;
        int8_t to = place;

        if (place == PERP__BETWEEN && z[i] < p->lower[i] - noise)
            to = PERP__AT_LOWER;
        else if (place == PERP__BETWEEN && z[i] > p->upper[i] + noise)
            to = PERP__AT_UPPER;
        else if (wrong > 0.0 &&
                 wrong > PERP__SUM_ROUNDING * (p->row_norms[i] * z_largest + fabs(p->q[i])))
            to = PERP__BETWEEN; /* released */
        b->next[i] = to;
        count += to != place;
    }
    return nothing == 0.0 ? count : -1;
}

perp_outcome perp__block_pivoting_run(perp__block_pivoting *b)
{
    const size_t bytes = (size_t)b->problem->n;
    int32_t waited = 0, patience = b->patience, count;

    memcpy(b->trial_places, b->places, bytes);
    b->infeasible = INT32_MAX;
    for (b->rounds = 0;; b->rounds++) {
        perp_outcome stop;

        if (solve_places(b) != PERP__BLOCK_READY || (count = find_next(b)) < 0)
            return PERP_OUTCOME_SINGULAR;
        if (count < b->infeasible) {
            b->infeasible = count;
            waited = 0;
            patience = count <= b->few ? b->patience_of_few : b->patience;
            memcpy(b->places, b->trial_places, bytes);
            memcpy(b->z, b->trial_z, bytes * sizeof *b->z);
        } else if (++waited > patience + b->single_patience) {
            return PERP_OUTCOME_STALLED;
        }
        if (count == 0)
            return PERP_OUTCOME_SOLVED;
        if (b->rounds >= b->round_limit)
            return PERP_OUTCOME_ITERATION_LIMIT;
        stop = perp__lcp_tick(b->problem->control, b->rounds, INFINITY);
        if (stop >= 0)
            return stop;
        if (waited > patience) { /* the last infeasible index alone */
            int32_t i = b->problem->n - 1;

            while (b->next[i] == b->trial_places[i])
                i--;
            b->trial_places[i] = b->next[i];
        } else {
            memcpy(b->trial_places, b->next, bytes);
        }
    }
}

/* ---- block pivoting as a method of its own ---- */

typedef struct active_set_work {
    perp__lcp_work head;
    perp__block_pivoting pivoting;
} active_set_work;

static int32_t suits(const perp__lcp_problem *problem)
{
    return !problem->M->column_starts;
}

static void layout(perp__arena *arena, void *work)
{
    active_set_work *a = work;

    perp__block_pivoting_layout(arena, &a->pivoting, a->head.problem->n, 0);
}

static int32_t correct(void *work, const double *residual, double *step)
{
    active_set_work *a = work;
    perp__block_pivoting *b = &a->pivoting;

    memcpy(step, residual, (size_t)a->head.problem->n * sizeof *step);
    perp__active_block_solve(&b->active, b->places, step);
    return 1;
}

static perp_status solve(void *work, perp__lcp_iterate *iterate)
{
    active_set_work *a = work;
    perp__block_pivoting *b = &a->pivoting;
    const perp__lcp_problem *p = a->head.problem;
    const size_t n = (size_t)p->n;

    perp__active_block_begin(&b->active, p, p->block->is_symmetric);
    b->active.definite = 0;
    b->problem = p;
    b->patience = b->patience_of_few = PERP__PATIENCE;
    b->few = 0;
    b->single_patience = 20 + 2 * (int32_t)n;
    b->round_limit = p->iteration_limit > 0 ? p->iteration_limit : PERP__SWEEPS_MOST;
    if (iterate->warm)
        perp__places_of(p, iterate->z, b->places);
    else
        perp__block_pivoting_start(p, b->places);
    memcpy(b->z, iterate->z, n * sizeof *b->z);
    iterate->outcome = perp__block_pivoting_run(b);
    iterate->iterations = b->rounds;
    memcpy(iterate->z, b->z, n * sizeof *b->z);
    memcpy(iterate->places, b->places, n);
    iterate->has_places = 1;
    if (iterate->outcome == PERP_OUTCOME_SOLVED)
        iterate->correct = correct;
    return PERP_OK;
}

const perp__lcp_method perp__lcp_active_set = {
    PERP_LCP_ACTIVE_SET, sizeof(active_set_work), 1, 0, suits, NULL, layout, solve, NULL,
};
