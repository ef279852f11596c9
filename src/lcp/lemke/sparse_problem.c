/* The bounded problem in standard form, its columns, and the values of a basis. */
#include "lcp/lemke/sparse.h"

#include <math.h>
#include <string.h>

static int32_t is_free(const perp__lcp_problem *p, int32_t i)
{
    return p->lower[i] == -INFINITY && p->upper[i] == INFINITY;
}

static void add_pair(perp__sparse_lemke *l, int32_t i, int8_t sign, double range)
{
    const int32_t k = l->pairs++;

    l->index[k] = i;
    l->sign[k] = sign;
    l->range[k] = range;
    l->at_upper[k] = 0;
    l->twin[k] = -1;
}

/* q of the pairs: sign (q + M base). */
static void write_right_hand_side(perp__sparse_lemke *l)
{
    const perp__lcp_problem *p = l->head.problem;
    const perp__matrix *M = p->M;
    int32_t j, k;

    memcpy(l->rows, p->q, (size_t)p->n * sizeof *l->rows);
    for (j = 0; j < p->n; j++)
        for (k = M->column_starts[j]; l->base[j] != 0.0 && k < M->column_starts[j + 1]; k++) {
            int32_t i = M->row_indices[k];

            l->rows[i] += M->values[k] * (p->factors[i] * p->factors[j]) * l->base[j];
        }
    for (k = 0; k < l->pairs; k++) {
        l->q[k] = l->sign[k] * l->rows[l->index[k]];
        l->h[k] = 0.0;
    }
}

void perp__sparse_write_pairs(perp__sparse_lemke *l, int32_t free_variables)
{
    const perp__lcp_problem *p = l->head.problem;
    int32_t i;

    l->pairs = 0;
    l->split = free_variables == PERP__FREE_SPLIT;
    for (i = 0; i < p->n; i++) {
        const int32_t above = p->lower[i] == -INFINITY && !is_free(p, i);

        l->base[i] = is_free(p, i) ? 0.0 : above ? p->upper[i] : p->lower[i];
        l->pair_of[i] = -1;
        if (p->lower[i] == p->upper[i])
            continue; /* a fixed variable is data */
        l->pair_of[i] = l->pairs;
        add_pair(l, i, above ? -1 : 1, p->upper[i] - p->lower[i]);
    }
    for (i = 0; i < p->n && free_variables == PERP__FREE_SPLIT; i++)
        if (is_free(p, i)) {
            l->twin[l->pair_of[i]] = l->pairs;
            add_pair(l, i, -1, INFINITY);
            l->twin[l->pairs - 1] = l->pair_of[i];
        }
    write_right_hand_side(l);
}

int32_t perp__sparse_is_free(const perp__sparse_lemke *l, int32_t k)
{
    return l->twin[k] < 0 && is_free(l->head.problem, l->index[k]);
}

int32_t perp__sparse_column(const void *user, int32_t variable, int32_t *rows, double *values)
{
    const perp__sparse_lemke *l = user;
    const perp__lcp_problem *p = l->head.problem;
    const perp__matrix *M = p->M;
    const int32_t is_v = variable >= l->pairs;
    const int32_t j = l->index[is_v ? variable - l->pairs : variable];
    int32_t count = 0, side, k;

    if (is_v) {
        rows[0] = variable - l->pairs;
        values[0] = 1.0;
        return 1;
    }
    for (side = 0; side < 2; side++) /* the rows of twins come after all others */
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++) {
            const int32_t i = M->row_indices[k];
            int32_t r = l->pair_of[i];

            if (r >= 0 && side)
                r = l->twin[r];
            if (r < 0)
                continue;
            rows[count] = r;
            values[count++] = -(double)(l->sign[r] * l->sign[variable]) *
                              (M->values[k] * (p->factors[i] * p->factors[j]));
        }
    return count;
}

void perp__sparse_add_column(perp__sparse_lemke *l, int32_t variable, double factor, double *rows)
{
    int32_t count, k;

    if (factor == 0.0)
        return;
    if (variable == perp__sparse_t(l)) {
        for (k = 0; k < l->pairs; k++)
            rows[k] -= factor * l->h[k];
        return;
    }
    count = perp__sparse_column(l, variable, l->entry_rows, l->entry_values);
    for (k = 0; k < count; k++)
        rows[l->entry_rows[k]] += factor * l->entry_values[k];
}

void perp__sparse_limit(perp__sparse_lemke *l, int32_t r)
{
    const int32_t variable = l->basic[r];
    const int32_t k = variable - l->pairs;

    l->low[r] = 0.0;
    l->high[r] = INFINITY;
    if (variable < l->pairs) {
        l->high[r] = l->range[variable];
        if (perp__sparse_is_free(l, variable))
            l->low[r] = -INFINITY;
    } else if (k < l->pairs && l->at_upper[k]) {
        l->low[r] = -INFINITY;
        l->high[r] = 0.0;
    }
}

/* rows := q - the columns of all variables times their values */
static void write_residual(perp__sparse_lemke *l)
{
    int32_t k;

    memcpy(l->rows, l->q, (size_t)l->pairs * sizeof *l->rows);
    for (k = 0; k < l->pairs; k++) {
        if (l->position_of[k] < 0 && l->at_upper[k])
            perp__sparse_add_column(l, k, -l->range[k], l->rows);
        perp__sparse_add_column(l, l->basic[k], -l->b[k], l->rows);
    }
}

void perp__sparse_values(perp__sparse_lemke *l, int32_t rounds)
{
    double last = INFINITY;
    int32_t round, r;

    memset(l->b, 0, (size_t)l->pairs * sizeof *l->b);
    for (round = 0; round < rounds; round++) {
        double largest = 0.0;

        write_residual(l);
        perp__basis_solve(&l->basis, l->rows, l->column);
        for (r = 0; r < l->pairs; r++) {
            l->b[r] += l->column[r];
            largest = fmax(largest, fabs(l->column[r]));
        }
        if (!(largest < 0.5 * last))
            break; /* no longer converging */
        last = largest;
    }
}

perp_status perp__sparse_load(perp__sparse_lemke *l)
{
    const perp__lcp_problem *p = l->head.problem;
    perp__principal principal;
    perp__columns source;

    source.user = l;
    source.read = perp__sparse_column;
    principal.block = p->block;
    principal.index = l->index;
    principal.sign = l->sign;
    principal.rho = l->rho;
    return perp__basis_load(&l->basis, p->context, l->pairs, l->basic, &source,
                            l->split ? NULL : &principal);
}

perp_status perp__sparse_take_places(perp__sparse_lemke *l, const int8_t *places)
{
    perp_status status;
    int32_t k;

    for (k = 0; k <= 2 * l->pairs; k++)
        l->position_of[k] = -1;
    for (k = 0; k < l->pairs; k++) {
        l->basic[k] = places[k] == PERP__BETWEEN ? k : l->pairs + k;
        l->position_of[l->basic[k]] = k;
        l->at_upper[k] = places[k] == PERP__AT_UPPER;
    }
    l->missing = -1;
    for (k = 0; k < l->pairs; k++)
        perp__sparse_limit(l, k);
    status = perp__sparse_load(l);
    if (status == PERP_OK)
        perp__sparse_values(l, l->rho > 0.0 ? 1 : 2);
    return status;
}
