/* The enclosure: the equations of the index set are solved to doubled precision, and what is left
 * is bounded with the inverse. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "lcp/claims/verify.h"
#include "linalg/principal.h"

#define PERP__REFINEMENTS 16
/* Below this size a sparse block is taken as a dense one at once. */
#define PERP__SMALL_BLOCK 64
/* Up to this size it is where the sparse bound fails: three arrays of 32 MiB. */
#define PERP__LARGEST_BLOCK 2048

static void layout_dense(perp__arena *arena, void *object)
{
    perp__verify *v = object;

    perp__verified_layout(arena, &v->dense, v->count);
}

static perp__principal block_of(const perp__verify *v)
{
    perp__principal block;

    block.count = v->count;
    block.active = v->active;
    block.position = v->position;
    return block;
}

/* w := M (high + low) + q, in doubled precision but for its last rounding */
static void find_w(perp__verify *v)
{
    perp__multiply_doubled(&v->M, v->high, v->q, v->w_high, v->w_low);
    perp__multiply(&v->M, v->low, v->w);
    for (int32_t i = 0; i < v->n; i++)
        v->w[i] = v->w_high[i] + (v->w_low[i] + v->w[i]);
}

/* step := M_AA^-1 w_A, approximately; returns its largest entry. */
static double find_step(perp__verify *v)
{
    double largest = 0.0;

    for (int32_t k = 0; k < v->count; k++)
        v->middle[k] = v->w[v->active[k]];
    if (v->uses_dense) {
        perp__verified_apply(&v->dense, v->middle, v->step);
    } else {
        memcpy(v->step, v->middle, (size_t)v->count * sizeof *v->step);
        perp__dominance_apply(&v->dominance, v->step);
    }
    for (int32_t k = 0; k < v->count; k++)
        largest = perp__larger(largest, fabs(v->step[k]));
    return largest;
}

/* high + low -= step */
static void take_step(perp__verify *v)
{
    for (int32_t k = 0; k < v->count; k++) {
        const int32_t i = v->active[k];
        const double low = v->low[i] - v->step[k];
        const double sum = v->high[i] + low;
        const double part = sum - v->high[i];

        v->low[i] = (v->high[i] - (sum - part)) + (low - part);
        v->high[i] = sum;
    }
}

/* Any point will do for the proof; the nearer, the narrower the interval. */
static void refine(perp__verify *v)
{
    double last = INFINITY;

    find_w(v);
    for (int32_t round = 0; round < PERP__REFINEMENTS && v->count > 0; round++) {
        const double largest = find_step(v);

        if (!(largest < 0.5 * last) || largest == 0.0)
            break;
        take_step(v);
        find_w(v);
        last = largest;
    }
}

static double sum_of_sizes(const double *x, int32_t n)
{
    double sum = 0.0;

    for (int32_t i = 0; i < n; i++)
        sum += fabs(x[i]);
    return sum;
}

/* width: the error of the product in doubled precision, of the one with `low`, of adding the three,
 * of underflow. */
static void find_width(perp__verify *v)
{
    const double n = v->n;
    const double sizes = sum_of_sizes(v->high, v->n) + sum_of_sizes(v->low, v->n);
    double *products = v->delta, *ones = v->delta;

    for (int32_t i = 0; i < v->n; i++)
        ones[i] = 1.0;
    perp__multiply_absolute(&v->M, ones, v->width);
    for (int32_t i = 0; i < v->n; i++)
        v->width[i] = DBL_MIN * (16.0 * (n + 1.0) + 2.0 * (sizes + v->width[i]));
    perp__multiply_absolute(&v->M, v->high, products);
    for (int32_t i = 0; i < v->n; i++)
        v->width[i] += perp__doubled_error(v->n) * (products[i] + fabs(v->q[i]));
    perp__multiply_absolute(&v->M, v->low, products);
    for (int32_t i = 0; i < v->n; i++) {
        v->width[i] += PERP__GAMMA(n + 8.0) * (products[i] + fabs(v->w_low[i])) +
                       PERP__GAMMA(2.0) * fabs(v->w[i]);
        v->width[i] = perp__raise(v->width[i], 4.0 * n + 8.0);
    }
}

/* delta and spread, from the bounds of |M_AA^-1 w_A|. False if nothing was proved. */
static int32_t find_delta(perp__verify *v)
{
    int32_t i, k, proved = 1;

    find_width(v);
    for (k = 0; k < v->count; k++) {
        v->middle[k] = v->w[v->active[k]];
        v->margin[k] = v->width[v->active[k]];
    }
    if (v->uses_dense)
        perp__verified_bound(&v->dense, v->middle, v->margin, v->enclosure);
    else
        proved = perp__dominance_bound(&v->dominance, v->middle, v->margin, v->enclosure);
    for (i = 0; i < v->n; i++)
        v->delta[i] = 0.0;
    for (k = 0; k < v->count; k++) {
        v->delta[v->active[k]] = v->enclosure[k];
        proved &= isfinite(v->enclosure[k]) != 0;
    }
    perp__multiply_absolute(&v->M, v->delta, v->spread);
    for (i = 0; i < v->n; i++)
        v->spread[i] = perp__raise(v->spread[i], 2.0 * v->n);
    return proved;
}

static perp_status enclose_dense(perp__verify *v, int32_t *verdict)
{
    const perp__principal block = block_of(v);
    perp_status status;

    v->uses_dense = 1;
    status = perp__arena_fit(&v->dense_arena, layout_dense, v);
    if (status != PERP_OK)
        return status;
    perp__principal_dense(&v->M, &block, v->dense.transposed, (size_t)v->count, 1);
    *verdict = PERP_VERDICT_SINGULAR;
    if (perp__verified_factor(&v->dense)) {
        refine(v);
        if (find_delta(v))
            *verdict = PERP_VERDICT_REGULAR;
    }
    return PERP_OK;
}

static perp_status enclose_sparse(perp__verify *v, int32_t *verdict)
{
    const perp__principal block = block_of(v);
    perp_status status;

    v->uses_dense = 0;
    perp__principal_csc(&v->M, &block, v->starts, v->rows, v->block);
    v->dominance.n = v->dominance.A.n = v->count;
    v->dominance.A.values = v->block;
    v->dominance.A.column_starts = v->starts;
    v->dominance.A.row_indices = v->rows;
    status = perp__dominance_factor(&v->dominance, v->context);
    *verdict = PERP_VERDICT_SINGULAR;
    if (status == PERP_OK) {
        refine(v);
        if (find_delta(v))
            *verdict = PERP_VERDICT_REGULAR;
    }
    return status == PERP__FACTOR_SINGULAR ? PERP_OK : status;
}

perp_status perp__verify_enclose(perp__verify *v, int32_t *verdict)
{
    perp_status status = PERP_OK;

    if (!v->M.column_starts || v->count <= PERP__SMALL_BLOCK)
        return enclose_dense(v, verdict);
    status = enclose_sparse(v, verdict);
    if (status != PERP_OK || *verdict == PERP_VERDICT_REGULAR)
        return status;
    if (v->count <= PERP__LARGEST_BLOCK)
        return enclose_dense(v, verdict);
    *verdict = PERP_VERDICT_TOO_LARGE;
    return PERP_OK;
}
