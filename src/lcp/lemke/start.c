/* The start of Lemke's method on a problem with bounds: every pair at its finite bound, free
 * variables pivoted into the basis first, so that what is left is an LCP in the other pairs. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "lcp/lemke/lemke.h"

/* Relative size below which a pivot among free variables is what rounding left of 0. */
#define PERP__DEPENDENT 1e-12

static int32_t is_free(const perp__lcp_problem *p, int32_t i)
{
    return p->lower[i] == -INFINITY && p->upper[i] == INFINITY;
}

/* Returns whether the pairs are the variables as they come, unchanged in sign. */
static int32_t choose_base(perp__lemke *l)
{
    const perp__lcp_problem *p = l->head.problem;
    int32_t plain = 1, i;

    l->pairs = 0;
    for (i = 0; i < p->n; i++) {
        const double lower = p->lower[i], upper = p->upper[i];
        const int32_t from_above = lower == -INFINITY && upper != INFINITY, k = l->pairs;

        l->base[i] = from_above ? upper : lower == -INFINITY ? 0.0 : lower;
        plain &= lower != upper && !from_above;
        if (lower == upper)
            continue; /* a fixed variable is data */
        l->index[k] = i;
        l->sign[k] = from_above ? -1 : 1;
        l->range[k] = upper - lower;
        l->at_upper[k] = 0;
        l->twin[k] = -1;
        l->pairs++;
    }
    return plain;
}

/* b = sign (q + M base), T = -sign M sign in the pairs, in place of -M. */
static void fill_tableau(perp__lemke *l, int32_t plain)
{
    const perp__lcp_problem *p = l->head.problem;
    const size_t ld = (size_t)l->tableau.leading_dimension;
    double *T = l->tableau.T;
    int32_t i, j, k;

    perp__lcp_dense_times(p, -1.0, T, ld);
    memcpy(l->row, p->q, (size_t)p->n * sizeof *l->row);
    for (j = 0; j < p->n; j++) {
        const double *column = T + (size_t)j * ld;

        if (l->base[j] != 0.0)
            for (i = 0; i < p->n; i++)
                l->row[i] -= column[i] * l->base[j];
    }
    for (k = 0; k < l->pairs; k++)
        l->b[k] = l->sign[k] * l->row[l->index[k]];
    for (j = 0; j < l->pairs && !plain; j++) {
        const double *from = T + (size_t)l->index[j] * ld;
        double *into = T + (size_t)j * ld;

        for (i = 0; i < l->pairs; i++)
            into[i] = (double)(l->sign[i] * l->sign[j]) * from[l->index[i]];
    }
}

static void name_variables(perp__lemke *l)
{
    int32_t k;

    for (k = 0; k <= 2 * l->pairs; k++)
        l->row_of[k] = l->column_of[k] = -1;
    for (k = 0; k < l->pairs; k++) {
        l->basic[k] = l->pairs + k;
        l->nonbasic[k] = k;
        l->row_of[l->pairs + k] = k;
        l->column_of[k] = k;
    }
}

void perp__lemke_fill(perp__lemke *l)
{
    fill_tableau(l, choose_base(l));
    perp__tableau_reset(&l->tableau, l->pairs, l->pairs);
    name_variables(l);
}

int32_t perp__lemke_is_free(const perp__lemke *l, int32_t pair)
{
    return is_free(l->head.problem, l->index[pair]);
}

static int32_t is_free_equation(const perp__lemke *l, int32_t r)
{
    return l->basic[r] >= l->pairs && is_free(l->head.problem, l->index[l->basic[r] - l->pairs]);
}

static int32_t is_free_variable(const perp__lemke *l, int32_t c)
{
    return l->nonbasic[c] < l->pairs && is_free(l->head.problem, l->index[l->nonbasic[c]]);
}

/* The equation with the largest entry in l->column. */
static int32_t largest_equation(const perp__lemke *l)
{
    int32_t found = -1, r;

    for (r = 0; r < l->pairs; r++)
        if (is_free_equation(l, r) && (found < 0 || fabs(l->column[r]) > fabs(l->column[found])))
            found = r;
    return found;
}

static double largest_free_entry(const perp__lemke *l)
{
    const size_t ld = (size_t)l->tableau.leading_dimension;
    double largest = 0.0;
    int32_t r, c;

    for (c = 0; c < l->tableau.columns; c++)
        for (r = 0; is_free_variable(l, c) && r < l->pairs; r++)
            if (is_free_equation(l, r))
                largest = fmax(largest, fabs(l->tableau.T[(size_t)r + (size_t)c * ld]));
    return largest;
}

/* Exchanges equations with free variables, column by column with partial pivoting; which equation
 * goes with which variable is of no account. An equation that has left stays at 0 for ever, so its
 * column is dropped. Returns the largest entry there was. */
static double make_free_basic(perp__lemke *l)
{
    const double largest = largest_free_entry(l);
    int32_t c = 0, r, i;

    while (c < l->tableau.columns) {
        double value;

        perp__tableau_column(&l->tableau, c, l->column);
        r = is_free_variable(l, c) ? largest_equation(l) : -1;
        if (r < 0 || !(fabs(l->column[r]) > PERP__DEPENDENT * largest)) {
            c++;
            continue;
        }
        value = l->b[r] / l->column[r];
        for (i = 0; i < l->pairs; i++)
            l->b[i] -= l->column[i] * value;
        l->b[r] = value;
        l->basic[r] = l->nonbasic[c];
        perp__tableau_exchange(&l->tableau, r, c, l->column);
        perp__tableau_drop(&l->tableau, c);
        l->nonbasic[c] = l->nonbasic[l->tableau.columns];
    }
    perp__tableau_flush(&l->tableau);
    return largest;
}

/* A free variable left nonbasic becomes two pairs, x >= 0 and x' >= 0 with x - x' in its place:
 * v + t >= 0 and -v + t >= 0 then close on v = 0 as t goes to 0. */
static int32_t count_left(const perp__lemke *l)
{
    int32_t left = 0, c;

    for (c = 0; c < l->tableau.columns; c++)
        left += is_free_variable(l, c);
    return left;
}

/* What elimination left of dependent equations is rounding: it is taken for the 0 it stands for. */
static void clear_dependent(perp__lemke *l, double largest)
{
    const size_t ld = (size_t)l->tableau.leading_dimension;
    double size = 0.0;
    int32_t r, c;

    for (r = 0; r < l->pairs; r++)
        size = fmax(size, fabs(l->b[r]));
    for (r = 0; r < l->pairs; r++) {
        if (!is_free_equation(l, r))
            continue;
        if (fabs(l->b[r]) <= PERP__DEPENDENT * size)
            l->b[r] = 0.0;
        for (c = 0; c < l->tableau.columns; c++)
            if (fabs(l->tableau.T[(size_t)r + (size_t)c * ld]) <= PERP__DEPENDENT * largest)
                l->tableau.T[(size_t)r + (size_t)c * ld] = 0.0;
    }
}

static void split_left(perp__lemke *l, int32_t left)
{
    const size_t ld = (size_t)l->tableau.leading_dimension;
    const int32_t before = l->pairs, columns = l->tableau.columns;
    double *T = l->tableau.T;
    int32_t made = 0, c, r, i;

    l->pairs += left;
    for (r = 0; r < before; r++) /* v_k = pairs + k */
        if (l->basic[r] >= before)
            l->basic[r] += left;
    for (c = 0, r = 0; c < columns; c++) {
        int32_t x = l->nonbasic[c], twin = before + made;

        if (!is_free_variable(l, c))
            continue;
        while (!is_free_equation(l, r))
            r++;
        l->basic[r] = l->pairs + x; /* any equation left will serve */
        l->index[twin] = l->index[x];
        l->sign[twin] = (int8_t)-l->sign[x];
        l->range[twin] = INFINITY;
        l->at_upper[twin] = 0;
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

void perp__lemke_index(perp__lemke *l)
{
    double largest = 0.0;
    int32_t k;

    for (k = 0; k <= 2 * l->pairs; k++)
        l->row_of[k] = l->column_of[k] = -1;
    for (k = 0; k < l->tableau.columns; k++)
        l->column_of[l->nonbasic[k]] = k;
    for (k = 0; k < l->pairs; k++) {
        l->row_of[l->basic[k]] = k;
        if (fabs(l->b[k]) > largest &&
            (l->basic[k] >= l->pairs || !perp__lemke_is_free(l, l->basic[k])))
            largest = fabs(l->b[k]);
    }
    l->largest_b = largest;
    perp__lemke_write_limits(l);
}

void perp__lemke_start(perp__lemke *l)
{
    int32_t any_free = 0, k;

    perp__lemke_fill(l);
    for (k = 0; k < l->pairs; k++)
        any_free |= perp__lemke_is_free(l, k);
    if (any_free) {
        const double size = make_free_basic(l);
        const int32_t left = count_left(l);

        if (left > 0) {
            clear_dependent(l, size);
            split_left(l, left);
        }
    }
    perp__lemke_index(l);
}
