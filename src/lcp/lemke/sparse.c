/* Lemke's method on sparse matrices: the tableau's one column that a pivot needs is solved for in a
 * factored basis (Tomlin, "Robust implementation of Lemke's method for the linear complementarity
 * problem", Math. Programming Study 7 (1978) 55) of
 *
 *   v - S x - h t = q,   S = sign M sign.
 *
 * Memory is that of the factors; nothing here is n by n. A free x_k is basic from the start and its
 * v_k never is, unless the free variables had to be split.
 *
 * A principal pivotal transform of an LCP is an LCP with the same solutions (Cottle, Pang & Stone
 * 1992, section 2.3), so that any complementary basis will serve as a start; near the solution the
 * path is short. P-matrices stay so under the transform, copositive ones need not: what fails from
 * a guess is tried again from the slacks. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/rounding.h"
#include "lcp/lemke/lemke.h"

/* Pivots between refactorisations at most. */
#define SPIKES 64
/* Below this size a crash that fails costs more than the path from the slacks, so only matrices
 * that look like P-matrices get one. */
#define WORTH_IT 400
/* Violations that pivots remove for less than another step of the crash costs; a guess is one if
 * beyond those few at most one pair in so many is violated. */
#define FEW 16
#define CLOSE 32

void perp__factored_layout(perp__arena *arena, perp__lemke *l)
{
    perp__factored *f = &l->factored;
    const perp__lcp_problem *p = l->head.problem;
    const perp__matrix *M = p->M;
    const size_t n = (size_t)p->n, pairs = (size_t)l->capacity;
    size_t entries = 0; /* of [I, -S] that can be in the kernel, with every free variable split */

    for (int32_t j = 0; j < p->n; j++) {
        size_t column = 0;

        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            column += p->lower[i] == -INFINITY && p->upper[i] == INFINITY ? 2 : 1;
        }
        entries += p->lower[j] == -INFINITY && p->upper[j] == INFINITY ? 2 * column : column;
    }
    perp__basis_layout(arena, &f->basis, l->capacity, entries, SPIKES, SPIKES * pairs);
    f->pair_of = perp__arena_take(arena, n, sizeof(int32_t));
    PERP__DOUBLES(arena, pairs, &f->q, &f->h, &f->entry_values);
    f->entry_rows = perp__arena_take(arena, pairs, sizeof(int32_t));
}

/* sign (S base + q) */
static void write_q(perp__lemke *l)
{
    const perp__lcp_problem *p = l->head.problem;
    const perp__matrix *M = p->M;
    const double *z = l->base;

    memcpy(l->work, p->q, (size_t)p->n * sizeof *l->work);
    for (int32_t j = 0; j < p->n; j++)
        for (int32_t k = M->column_starts[j]; z[j] != 0.0 && k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];

            l->work[i] += M->values[k] * z[j];
        }
    for (int32_t k = 0; k < l->pairs; k++)
        l->factored.q[k] = l->sign[k] * l->work[l->index[k]];
}

/* Entries of a column of [I, -S]: the perp__columns of the basis. */
static int32_t read_entries(const void *user, int32_t variable, int32_t *rows, double *values)
{
    const perp__lemke *l = user;
    const perp__matrix *M = l->head.problem->M;
    const int32_t j = l->index[perp__lemke_pair(l, variable)];
    int32_t count = 0, side, k;

    if (variable >= l->pairs) {
        rows[0] = variable - l->pairs;
        values[0] = 1.0;
        return 1;
    }
    for (side = 0; side < 2; side++) /* the rows of twins come after all others */
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            int32_t r = l->factored.pair_of[M->row_indices[k]];

            if (r >= 0 && side)
                r = l->twin[r];
            if (r < 0)
                continue;
            rows[count] = r;
            values[count++] = -(double)(l->sign[r] * l->sign[variable]) * M->values[k];
        }
    return count;
}

/* Adds factor times the column of any variable, t included, to `rows`. */
static void add_column(perp__lemke *l, int32_t variable, double factor, double *rows)
{
    const perp__factored *f = &l->factored;
    int32_t count;

    if (factor == 0.0)
        return;
    if (variable == perp__lemke_t(l)) {
        for (int32_t k = 0; k < l->pairs; k++)
            rows[k] -= factor * f->h[k];
        return;
    }
    count = read_entries(l, variable, f->entry_rows, f->entry_values);
    for (int32_t k = 0; k < count; k++)
        rows[f->entry_rows[k]] += factor * f->entry_values[k];
}

static void solve_column(perp__lemke *l, int32_t variable)
{
    memset(l->work, 0, (size_t)l->pairs * sizeof *l->work);
    add_column(l, variable, 1.0, l->work);
    perp__basis_solve(&l->factored.basis, l->work, l->column);
}

/* b = B^-1 (q + what rests at upper bounds), with a step of refinement. */
static void find_values(perp__lemke *l)
{
    memset(l->b, 0, (size_t)l->pairs * sizeof *l->b);
    for (int32_t round = 0; round < 2; round++) {
        /* work := q - the columns of all variables times their values */
        memcpy(l->work, l->factored.q, (size_t)l->pairs * sizeof *l->work);
        for (int32_t k = 0; k < l->pairs; k++) {
            if (l->row_of[k] < 0 && l->at_upper[k])
                add_column(l, k, -l->range[k], l->work);
            add_column(l, l->basic[k], -l->b[k], l->work);
        }
        perp__basis_solve(&l->factored.basis, l->work, l->column);
        for (int32_t r = 0; r < l->pairs; r++)
            l->b[r] += l->column[r];
    }
}

/* Factors the columns of the variables in `basic`; see perp__basis_load. */
static perp_status load(perp__lemke *l)
{
    const perp__lcp_problem *p = l->head.problem;
    const perp__columns source = {l, read_entries};
    const perp__principal principal = {p->block, l->index, l->sign, 0.0};

    return perp__basis_load(&l->factored.basis, p->context, l->pairs, l->basic, &source,
                            l->factored.split ? NULL : &principal);
}

/* Makes the complementary basis that l->places describe the current one, factored, with its values;
 * free variables are basic, or split. PERP_OK, PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
static perp_status take_places(perp__lemke *l, bool split)
{
    perp__factored *f = &l->factored;
    int32_t first;
    perp_status status;

    /* 1. The problem in standard form. */
    perp__lemke_name_pairs(l);
    first = l->pairs;
    f->split = split;
    for (int32_t i = 0; i < l->head.problem->n; i++)
        f->pair_of[i] = -1;
    for (int32_t k = 0; k < first; k++) {
        f->pair_of[l->index[k]] = k;
        if (!split || !perp__lemke_is_free(l, k))
            continue;
        perp__lemke_write_pair(l, l->pairs, l->index[k], -1, INFINITY);
        l->twin[k] = l->pairs;
        l->twin[l->pairs++] = k;
    }
    memset(f->h, 0, (size_t)l->pairs * sizeof *f->h);
    write_q(l);
    /* 2. The basis. */
    for (int32_t k = 0; k <= 2 * l->pairs; k++)
        l->row_of[k] = -1;
    for (int32_t k = 0; k < l->pairs; k++) {
        const int8_t place = l->places[l->index[k]];

        l->basic[k] = place == PERP__BETWEEN && l->twin[k] < 0 ? k : l->pairs + k;
        l->row_of[l->basic[k]] = k;
        l->at_upper[k] = place == PERP__AT_UPPER && l->sign[k] > 0;
    }
    f->missing = -1;
    status = load(l);
    perp__lemke_write_limits(l);
    if (status == PERP_OK)
        find_values(l);
    return status;
}

static void find_largest_b(perp__lemke *l)
{
    l->largest_b = 0.0;
    for (int32_t r = 0; r < l->pairs; r++)
        if (isfinite(l->low[r]) || isfinite(l->high[r]))
            l->largest_b = fmax(l->largest_b, fabs(l->b[r]));
}

/* Takes l->places for a guess if they are near the solution's: few basic variables are beyond a
 * limit by more than rounding. */
static perp_status take_guess(perp__lemke *l, enum perp__lemke_guess *guess)
{
    const perp__lcp_problem *p = l->head.problem;
    perp_status status = take_places(l, 0);
    double x_largest = 0.0;
    int32_t violated = 0, k;

    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    for (k = 0; k < l->pairs; k++)
        if (l->basic[k] < l->pairs)
            x_largest = fmax(x_largest, fabs(l->b[k]));
    for (k = 0; k < l->pairs; k++) {
        const int32_t i = l->index[k];
        const double size =
            l->basic[k] < l->pairs ? x_largest : p->row_norms[i] * x_largest + fabs(p->q[i]);

        violated += perp__lemke_violation(l, k) > PERP__ROUNDING_LIMIT * size;
    }
    if (violated <= FEW + l->pairs / CLOSE)
        *guess = PERP__GUESS_BASIS;
    find_largest_b(l);
    return PERP_OK;
}

/* Active sets, and the basis where they have come near. */
static perp_status crash(perp__lemke *l, perp__lcp_iterate *iterate, enum perp__lemke_guess *guess)
{
    const perp_status status = perp__lemke_crash(l, iterate, FEW, sqrt(DBL_EPSILON), guess);

    if (status != PERP_OK || *guess != PERP__GUESS_BASIS)
        return status;
    *guess = PERP__GUESS_NONE;
    memcpy(l->places, iterate->places, (size_t)l->head.problem->n);
    return take_guess(l, guess);
}

/* From the caller's z0, by active sets, or both, as the settings allow. */
static perp_status start_near(perp__lemke *l, perp__lcp_iterate *iterate,
                              enum perp__lemke_guess *guess)
{
    const perp__lcp_problem *p = l->head.problem;
    const double *z = iterate->z;
    bool has_diagonal = 1; /* that of a P-matrix: all variables with a bound do */
    perp_status status = PERP_OK;

    if (p->settings->pivot_rule == PERP_PIVOT_LEXICOGRAPHIC)
        return PERP_OK;
    if (iterate->warm) {
        l->crash.common.problem = p;
        perp__active_set_places(&l->crash, z, l->places);
        status = take_guess(l, guess);
        if (status == PERP_OK && *guess == PERP__GUESS_NONE) {
            /* by z alone: a solution of a problem nearby solves no equations here, so that w says
             * nothing of what it has at a bound */
            perp__places_of(p, z, l->places);
            status = take_guess(l, guess);
        }
    }
    if (status != PERP_OK || *guess != PERP__GUESS_NONE || !p->settings->crash)
        return status;
    for (int32_t i = 0; i < p->n; i++) {
        const bool is_free = p->lower[i] == -INFINITY && p->upper[i] == INFINITY;

        if (p->lower[i] < p->upper[i] && !is_free && !(perp__entry(p->M, i, i) > 0.0))
            has_diagonal = 0;
    }
    return iterate->warm || p->n >= WORTH_IT || has_diagonal ? crash(l, iterate, guess) : PERP_OK;
}

/* The basis of the slacks and the free variables, or, where those depend on each other, of the
 * slacks alone. */
static perp_status start(perp__lemke *l, const perp__lcp_iterate *iterate)
{
    int32_t any_free = 0, k;
    perp_status status;

    (void)iterate;
    perp__lemke_name_pairs(l); /* base: the bounds, 0 of what is free */
    perp__places_of(l->head.problem, l->base, l->places);
    status = take_places(l, 0);
    for (k = 0; k < l->pairs; k++)
        any_free |= perp__lemke_is_free(l, k);
    if (any_free &&
        (status == PERP__FACTOR_SINGULAR ||
         (status == PERP_OK && !(perp__basis_condition(&l->factored.basis) > PERP__DEPENDENT))))
        status = take_places(l, 1);
    if (status == PERP_OK)
        find_largest_b(l);
    return status;
}

/* Factors the current basis anew, pair k in row k, t in that of the missing pair, and recomputes
 * its values. */
static perp_status refresh(perp__lemke *l)
{
    const int32_t missing = l->factored.missing, t = perp__lemke_t(l);
    int32_t slack = missing, best = missing, k;
    perp_status status;

    /* 1. The slack to be loaded in place of t, which is a full column: that of the missing pair,
     * unless its entry in t's row of B^-1 says that another makes a better basis. With a singular
     * principal block in the basis neither member of the missing pair would do. */
    if (missing >= 0) {
        memset(l->work, 0, (size_t)l->pairs * sizeof *l->work);
        l->work[l->row_of[t]] = 1.0;
        perp__basis_solve_transposed(&l->factored.basis, l->work, l->column);
        for (k = 0; k < l->pairs; k++)
            if (fabs(l->column[k]) > fabs(l->column[best]))
                best = k;
        if (!(fabs(l->column[missing]) >= 0.1 * fabs(l->column[best])))
            slack = best;
    }
    for (k = 0; k < l->pairs; k++)
        l->basic[k] = l->row_of[k] >= 0 ? k : l->pairs + k;
    if (missing >= 0)
        l->basic[missing] = l->pairs + slack;
    /* 2. The factors, and t in its place. */
    status = load(l);
    if (status == PERP_OK && missing >= 0) {
        solve_column(l, t);
        if (fabs(l->column[missing]) > l->smallest_pivot * perp__largest(l->column, l->pairs)) {
            perp__basis_replace(&l->factored.basis, missing, l->column); /* which has room */
            l->basic[missing] = t;
        } else {
            status = PERP__FACTOR_SINGULAR;
        }
    }
    for (k = 0; k < l->pairs; k++)
        l->row_of[l->basic[k]] = k;
    perp__lemke_write_limits(l);
    if (status == PERP_OK)
        find_values(l);
    return status;
}

static perp_status refactor(perp__lemke *l)
{
    return l->factored.basis.spikes <= 1 ? PERP__LEMKE_AS_NEW : refresh(l);
}

static perp_status values(perp__lemke *l)
{
    write_q(l);
    return refresh(l);
}

/* h = B d */
static void set_covering(perp__lemke *l)
{
    double *h = l->factored.h;

    memset(h, 0, (size_t)l->pairs * sizeof *h);
    for (int32_t r = 0; r < l->pairs; r++)
        add_column(l, l->basic[r], -l->column[r], h);
}

static perp_status read_column(perp__lemke *l, int32_t variable)
{
    const perp_status status = perp__basis_has_room(&l->factored.basis) ? PERP_OK : refresh(l);

    if (status == PERP_OK)
        solve_column(l, variable);
    return status;
}

static perp_status exchange(perp__lemke *l, int32_t r, int32_t leaving)
{
    perp__basis_replace(&l->factored.basis, r, l->column);
    l->factored.missing = leaving == perp__lemke_t(l) ? -1 : perp__lemke_pair(l, leaving);
    return PERP_OK;
}

static void read_inverse_row(perp__lemke *l, int32_t r, double *row)
{
    memset(l->work, 0, (size_t)l->pairs * sizeof *l->work);
    l->work[r] = 1.0;
    perp__basis_solve_transposed(&l->factored.basis, l->work, row);
    for (int32_t k = 0; k < l->pairs; k++)
        if (perp__lemke_is_free(l, k))
            row[k] = 0.0;
}

const perp__lemke_basis perp__lemke_sparse = {
    0.0,      start,    start_near, set_covering,     read_column, perp__lemke_move,
    exchange, refactor, values,     read_inverse_row, NULL,
};
