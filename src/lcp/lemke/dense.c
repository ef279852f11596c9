/* Lemke's method on a dense tableau: the problem with bounds in standard form, every pair at its
 * finite bound and free variables pivoted into the basis first, so that what is left is an LCP in
 * the other pairs; the start at a given complementary basis; what the path asks of a tableau.
 *
 * Where it starts if not at the caller's problem as it is: exchanges of active sets solve most
 * problems whose matrix is positive definite, and a start that the caller gives names a basis. Only
 * the cold start keeps what makes Lemke's method process copositive matrices, so every other one is
 * a first try, after which the cold one follows. */
#include <math.h>
#include <string.h>

#include "base/outcome.h"
#include "lcp/lemke/lemke.h"

/* A round of a crash is a Cholesky factorisation of the active block where M is symmetric, else LU:
 * from this size on that costs less than the pivots that it saves. */
#define CRASH_LU_FROM 256
/* The basis it ends with is taken if at most this part of the indices is infeasible. */
#define CRASH_PART 8

static void layout(perp__arena *arena, void *object)
{
    perp__lemke *l = object;
    const size_t pairs = (size_t)l->capacity;

    perp__tableau_layout(arena, &l->tableau, l->capacity, l->capacity + 1);
    l->nonbasic = perp__arena_take(arena, pairs + 1, sizeof(int32_t));
    l->column_of = perp__arena_take(arena, 2 * pairs + 1, sizeof(int32_t));
    l->queue = perp__arena_take(arena, pairs, sizeof(int32_t));
}

/* The standard form with all x nonbasic at 0: b = sign (q + M base), T = -sign M sign in the
 * pairs. */
static perp_status fill(perp__lemke *l)
{
    const perp__lcp_problem *p = l->head.problem;
    const perp_status status = perp__arena_fit(&l->tableau_arena, p->context, layout, l);
    const size_t ld = (size_t)l->tableau.leading_dimension;
    const int32_t plain = perp__lemke_name_pairs(l);
    double *T = l->tableau.T;

    if (status != PERP_OK)
        return status;
    for (int32_t j = 0; j < p->n; j++) {
        const perp__line c = perp__line_of(p->M, j);
        double *column = T + (size_t)j * ld;

        if (c.count < p->n)
            memset(column, 0, (size_t)p->n * sizeof *column);
        for (int32_t k = 0; k < c.count; k++)
            column[c.indices ? c.indices[k] : k] = -c.values[k];
    }
    perp__lcp_affine(p, l->base, l->work);
    for (int32_t k = 0; k < l->pairs; k++)
        l->b[k] = l->sign[k] * l->work[l->index[k]];
    for (int32_t j = 0; j < l->pairs && !plain; j++) { /* in place of -M */
        const double *from = T + (size_t)l->index[j] * ld;
        double *into = T + (size_t)j * ld;

        for (int32_t i = 0; i < l->pairs; i++)
            into[i] = (double)(l->sign[i] * l->sign[j]) * from[l->index[i]];
    }
    perp__tableau_reset(&l->tableau, l->pairs, l->pairs);
    for (int32_t k = 0; k < l->pairs; k++) {
        l->basic[k] = l->pairs + k;
        l->nonbasic[k] = k;
    }
    return PERP_OK;
}

void perp__lemke_index(perp__lemke *l)
{
    double largest = 0.0;

    for (int32_t k = 0; k <= 2 * l->pairs; k++)
        l->row_of[k] = l->column_of[k] = -1;
    for (int32_t k = 0; k < l->tableau.columns; k++)
        l->column_of[l->nonbasic[k]] = k;
    for (int32_t k = 0; k < l->pairs; k++) {
        l->row_of[l->basic[k]] = k;
        if (fabs(l->b[k]) > largest &&
            (l->basic[k] >= l->pairs || !perp__lemke_is_free(l, l->basic[k])))
            largest = fabs(l->b[k]);
    }
    l->largest_b = largest;
    perp__lemke_write_limits(l);
}

/* Exchanges row r with column c, which is in l->column, before the path begins. */
static void exchange_at_start(perp__lemke *l, int32_t r, int32_t c)
{
    const double value = l->b[r] / l->column[r];
    const int32_t leaving = l->basic[r];

    for (int32_t i = 0; i < l->pairs; i++)
        l->b[i] -= l->column[i] * value;
    l->b[r] = value;
    l->basic[r] = l->nonbasic[c];
    l->nonbasic[c] = leaving;
    perp__tableau_exchange(&l->tableau, r, c, l->column);
}

/* The equation of a free variable that has left stays at 0 for ever. */
static void drop(perp__lemke *l, int32_t c)
{
    perp__tableau_drop(&l->tableau, c);
    l->nonbasic[c] = l->nonbasic[l->tableau.columns];
}

static bool is_free(const perp__lemke *l, int32_t pair)
{
    const int32_t i = l->index[pair];

    return l->head.problem->lower[i] == -INFINITY && l->head.problem->upper[i] == INFINITY;
}

static bool is_free_equation(const perp__lemke *l, int32_t r)
{
    return l->basic[r] >= l->pairs && is_free(l, l->basic[r] - l->pairs);
}

static bool is_free_variable(const perp__lemke *l, int32_t c)
{
    return l->nonbasic[c] < l->pairs && is_free(l, l->nonbasic[c]);
}

/* Exchanges equations with free variables, column by column with partial pivoting; which equation
 * goes with which variable is of no account. What elimination leaves of dependent equations is
 * rounding: it is taken for the 0 it stands for. Returns how many variables are left nonbasic. */
static int32_t make_free_basic(perp__lemke *l)
{
    const size_t ld = (size_t)l->tableau.leading_dimension;
    double *T = l->tableau.T, largest = 0.0, size;
    int32_t c, r, i, left = 0;

    /* 1. The largest entry in equations and free variables. */
    for (c = 0; c < l->tableau.columns; c++)
        for (r = 0; is_free_variable(l, c) && r < l->pairs; r++)
            if (is_free_equation(l, r))
                largest = fmax(largest, fabs(T[(size_t)r + (size_t)c * ld]));
    /* 2. The exchanges. */
    for (c = 0; c < l->tableau.columns;) {
        r = -1;
        perp__tableau_column(&l->tableau, c, l->column);
        for (i = 0; is_free_variable(l, c) && i < l->pairs; i++)
            if (is_free_equation(l, i) && (r < 0 || fabs(l->column[i]) > fabs(l->column[r])))
                r = i;
        if (r < 0 || !(fabs(l->column[r]) > PERP__DEPENDENT * largest)) {
            left += is_free_variable(l, c);
            c++;
            continue;
        }
        exchange_at_start(l, r, c);
        drop(l, c);
    }
    perp__tableau_flush(&l->tableau);
    /* 3. What is left. */
    size = perp__largest(l->b, l->pairs);
    for (r = 0; left > 0 && r < l->pairs; r++) {
        if (!is_free_equation(l, r))
            continue;
        if (fabs(l->b[r]) <= PERP__DEPENDENT * size)
            l->b[r] = 0.0;
        for (c = 0; c < l->tableau.columns; c++)
            if (fabs(T[(size_t)r + (size_t)c * ld]) <= PERP__DEPENDENT * largest)
                T[(size_t)r + (size_t)c * ld] = 0.0;
    }
    return left;
}

/* A free variable left nonbasic becomes two pairs, x >= 0 and x' >= 0 with x - x' in its place:
 * v + t >= 0 and -v + t >= 0 then close on v = 0 as t goes to 0. */
static void split_left(perp__lemke *l, int32_t left)
{
    const size_t ld = (size_t)l->tableau.leading_dimension;
    const int32_t before = l->pairs, columns = l->tableau.columns;
    double *T = l->tableau.T;
    int32_t made = 0, c, r, i;

    for (r = 0; r < before; r++) /* v_k = pairs + k */
        if (l->basic[r] >= before)
            l->basic[r] += left;
    l->pairs += left;
    for (c = 0, r = 0; c < columns; c++) {
        const int32_t x = l->nonbasic[c], twin = before + made;

        if (!is_free_variable(l, c))
            continue;
        while (!is_free_equation(l, r))
            r++;
        l->basic[r] = l->pairs + x; /* any equation left will serve */
        perp__lemke_write_pair(l, twin, l->index[x], -l->sign[x], INFINITY);
        l->twin[x] = twin;
        l->twin[twin] = x;
        l->basic[twin] = l->pairs + twin;
        l->nonbasic[columns + made] = twin;
        l->b[twin] = -l->b[r];
        for (i = 0; i < before + made; i++) /* column of x' = - column of x */
            T[(size_t)i + (size_t)(columns + made) * ld] = -T[(size_t)i + (size_t)c * ld];
        for (i = 0; i <= columns + made; i++) /* row of v' = - row of v */
            T[(size_t)twin + (size_t)i * ld] = -T[(size_t)r + (size_t)i * ld];
        made++;
        r++;
    }
    perp__tableau_reset(&l->tableau, l->pairs, columns + made);
}

static perp_status start(perp__lemke *l, const perp__lcp_iterate *iterate)
{
    const perp_status status = fill(l);
    int32_t any_free = 0, left;

    if (status != PERP_OK)
        return status;
    for (int32_t k = 0; k < l->pairs; k++)
        any_free |= is_free(l, k);
    left = any_free ? make_free_basic(l) : 0;
    if (left > 0)
        split_left(l, left);
    perp__lemke_index(l);
    perp__lemke_choose_units(l, iterate->attempt > 0);
    return PERP_OK;
}

/* Whether x_k is basic at the start. */
static bool enters(const perp__lemke *l, int32_t k)
{
    return is_free(l, k) || l->places[l->index[k]] == PERP__BETWEEN;
}

/* The block principal transform, one exchange after the other: the tableau applies them together.
 * Which v goes with which x is of no account. Returns 0 if there is no good pivot. */
static bool transform(perp__lemke *l)
{
    for (int32_t c = 0; c < l->pairs; c++) {
        double largest = 0.0;
        int32_t found = -1; /* of the rows whose v leaves, that with the largest entry */

        if (!enters(l, l->nonbasic[c]))
            continue;
        perp__tableau_column(&l->tableau, c, l->column);
        for (int32_t r = 0; r < l->pairs; r++) {
            const double size = fabs(l->column[r]);

            largest = fmax(largest, size);
            if (l->basic[r] >= l->pairs && enters(l, l->basic[r] - l->pairs) && size > 0.0 &&
                (found < 0 || size > fabs(l->column[found])))
                found = r;
        }
        if (found < 0 || !(fabs(l->column[found]) > PERP__POOR_PIVOT * largest))
            return 0;
        exchange_at_start(l, found, c);
    }
    for (int32_t c = l->tableau.columns - 1; c >= 0; c--)
        if (l->nonbasic[c] >= l->pairs && is_free(l, l->nonbasic[c] - l->pairs))
            drop(l, c);
    return 1;
}

/* Two sweeps from a cold start: they cost less than a basis, and may solve the problem. If not,
 * active sets begin where they end; where the residual fell, that is: *fell. */
static bool sweeps_solve(perp__lemke *l, perp__lcp_iterate *iterate, int32_t *fell)
{
    const perp__lcp_problem *p = l->head.problem;
    const int32_t most = p->iteration_limit == 1 ? 1 : 2;
    double *z = iterate->z, residual = INFINITY, first = INFINITY;

    memcpy(l->work, p->q, (size_t)p->n * sizeof *l->work);
    if (perp__largest(z, p->n) > 0.0)
        perp__lcp_affine(p, z, l->work);
    for (int32_t k = 0; k <= most && !(residual <= p->tol); k++) {
        if (k > 0)
            perp__lcp_sweep(p, z, l->work);
        residual = 0.0;
        for (int32_t i = 0; i < p->n; i++)
            perp__raise_to(&residual, fabs(perp__mid(z[i], p->lower[i], p->upper[i], l->work[i])));
        first = k == 0 ? residual : first;
        iterate->iterations = k;
    }
    *fell = residual < first;
    for (int32_t i = 0; i < p->n && !*fell; i++)
        z[i] = perp__clamp(0.0, p->lower[i], p->upper[i]);
    iterate->outcome = PERP_OUTCOME_SOLVED;
    return residual <= p->tol;
}

/* Whether active sets from cold may pay: not where many couplings are larger than a positive
 * definite M + M' can have; one a row is looked at. The more of M is skew, the more rounds they
 * take, each an LU: too many where sweeps come no nearer, either. */
static bool may_crash(const perp__lcp_problem *p, int32_t fell)
{
    const perp__matrix *M = p->M;
    int32_t large = 0;

    for (int32_t i = 0; i < M->rows; i++) {
        const int32_t j = (i + M->rows / 2) % M->rows;
        const double size = 0.5 * perp__entry(M, i, j) + 0.5 * perp__entry(M, j, i);

        large += size * size > perp__entry(M, i, i) * perp__entry(M, j, j) && i != j;
    }
    return large <= M->rows / 16 && (p->block->is_symmetric || (p->n >= CRASH_LU_FROM && fell));
}

/* Active sets where M looks positive definite, and the basis that a start of the caller's names.
 * Its rounds are counted in l->spent. */
static perp_status start_near(perp__lemke *l, perp__lcp_iterate *iterate,
                              enum perp__lemke_guess *guess)
{
    const perp__lcp_problem *p = l->head.problem;
    perp_status status = PERP_OK;

    if (p->settings->pivot_rule != PERP_PIVOT_HARRIS)
        return PERP_OK;
    /* 1. The places. From a good start a round or two are enough, whatever M's symmetry; but the
     * polish, where it is on, has tried these already. */
    perp__places_of(p, iterate->z, l->places);
    if (p->settings->crash && !p->M->column_starts && p->block->has_positive_diagonal) {
        int32_t fell = 0;

        if (!iterate->warm && p->n > PERP__SMALL_LENGTH && sweeps_solve(l, iterate, &fell)) {
            *guess = PERP__GUESS_END;
            return PERP_OK;
        }
        iterate->iterations = 0;
        if (iterate->warm ? !p->settings->polish : may_crash(p, fell))
            status = perp__lemke_crash(l, iterate, 0, 0.0, guess);
        if (*guess == PERP__GUESS_BASIS && l->crash.wrong > p->n / CRASH_PART)
            *guess = PERP__GUESS_NONE;
        if (*guess == PERP__GUESS_BASIS)
            memcpy(l->places, iterate->places, (size_t)p->n);
    }
    if (*guess == PERP__GUESS_NONE && iterate->warm)
        *guess = PERP__GUESS_BASIS;
    if (status == PERP_OK && *guess == PERP__GUESS_BASIS)
        status = fill(l);
    if (status != PERP_OK || *guess != PERP__GUESS_BASIS)
        return status;
    /* 2. Their basis. With x nonbasic at its upper bound v is b less its column there. */
    for (int32_t k = 0; k < l->pairs; k++) {
        l->at_upper[k] =
            l->sign[k] > 0 && l->places[l->index[k]] == PERP__AT_UPPER && isfinite(l->range[k]);
        if (!l->at_upper[k])
            continue;
        perp__tableau_column(&l->tableau, k, l->column);
        for (int32_t i = 0; i < l->pairs; i++)
            l->b[i] -= l->column[i] * l->range[k];
    }
    if (!transform(l))
        return PERP__FACTOR_SINGULAR;
    perp__tableau_flush(&l->tableau);
    perp__lemke_index(l);
    return PERP_OK;
}

static void set_covering(perp__lemke *l)
{
    const int32_t last = l->tableau.columns;

    memcpy(l->tableau.T + (size_t)last * (size_t)l->tableau.leading_dimension, l->column,
           (size_t)l->pairs * sizeof *l->column);
    perp__tableau_reset(&l->tableau, l->pairs, last + 1);
    l->nonbasic[last] = perp__lemke_t(l);
    l->column_of[perp__lemke_t(l)] = last;
}

static perp_status read_column(perp__lemke *l, int32_t variable)
{
    perp__tableau_column(&l->tableau, l->column_of[variable], l->column);
    return PERP_OK;
}

static perp_status exchange(perp__lemke *l, int32_t r, int32_t leaving)
{
    const int32_t entering = l->basic[r], c = l->column_of[entering];

    l->nonbasic[c] = leaving;
    l->column_of[entering] = -1;
    l->column_of[leaving] = c;
    perp__tableau_exchange(&l->tableau, r, c, l->column);
    return PERP_OK;
}

static void read_inverse_row(perp__lemke *l, int32_t r, double *row)
{
    const perp__tableau *t = &l->tableau;

    perp__tableau_flush(&l->tableau);
    for (int32_t j = 0; j < l->pairs; j++) {
        const int32_t v = l->pairs + j, c = l->column_of[v];

        row[j] = c >= 0 ? t->T[(size_t)r + (size_t)c * (size_t)t->leading_dimension]
                        : (double)(l->row_of[v] == r);
    }
}

/* The inverse of the active block is in the tableau: with x_A basic and v_A nonbasic,
 * x_A = ... - T_AA v_A, and where M z + q leaves v_A a residual, x_A is off by -T_AA times it. */
static int32_t correct(void *work, const double *residual, double *step)
{
    perp__lemke *l = work;
    double *v = l->far, *x = l->column;
    int32_t c;

    for (c = 0; c < l->tableau.columns; c++)
        v[c] = 0.0;
    for (int32_t k = 0; k < l->pairs; k++) {
        if (l->twin[k] >= 0)
            return 0; /* x_k is half of a variable */
        if (l->row_of[k] < 0)
            continue;
        c = l->column_of[l->pairs + k];
        if (c < 0)
            return 0; /* a free variable's equation has been dropped, or t is in the way */
        v[c] = -l->sign[k] * l->row_unit[k] * residual[l->index[k]];
    }
    perp__tableau_multiply(&l->tableau, v, x);
    memset(step, 0, (size_t)l->head.problem->n * sizeof *step);
    for (int32_t k = 0; k < l->pairs; k++)
        if (l->row_of[k] >= 0)
            step[l->index[k]] = l->sign[k] * l->column_unit[k] * x[l->row_of[k]];
    return 1;
}

const perp__lemke_basis perp__lemke_dense = {
    0.0,      start, start_near, set_covering,     read_column, perp__lemke_move,
    exchange, NULL,  NULL,       read_inverse_row, correct,
};
