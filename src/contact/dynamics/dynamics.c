#include "contact/dynamics/dynamics.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "contact/dynamics/delassus.h"
#include "contact/dynamics/half.h"
#include "linalg/blas.h"
#include "linalg/signs.h"

/* Columns of W that are solved for at a time, and velocities up to which M's factor is inverted. */
enum { BLOCK = 32, INVERTED_MOST = 72 };

/* ---- checks of what a caller hands over ---- */

static perp_status read_mass(perp_context *context, perp__dynamics *own,
                             const perp_contact_dynamics *dynamics)
{
    const perp__matrix *M = &own->M;
    const double half = sqrt(DBL_EPSILON); /* of the digits: matrices are symmetric but for them */
    perp__cursor c;
    perp_status status;

    if (!dynamics->M == !dynamics->solve)
        return perp__refuse(context, "dynamics.M and dynamics.solve are %s: exactly one is needed",
                            dynamics->M ? "both given" : "both NULL");
    own->has_M = dynamics->M != NULL;
    own->solve = dynamics->solve;
    own->user = dynamics->user;
    if (!own->has_M)
        return PERP_OK;
    status = perp__matrix_read_sized(context, "M", &own->M, dynamics->M, own->n, own->n);
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < M->rows; i++)
        if (!(perp__entry(M, i, i) > 0.0))
            return perp__refuse(context, "M(%d,%d) is %g: M is not positive definite", (int)i,
                                (int)i, perp__entry(M, i, i));
    if (!M->column_starts && M->row_stride * M->column_stride == (size_t)own->n &&
        perp__is_dense_symmetric(M, NULL)) { /* then its rows are columns, which are faster */
        own->M.row_stride = 1, own->M.column_stride = (size_t)own->n;
        return PERP_OK;
    }
    c = perp__first(M);
    while (M->rows > 0 && perp__advance(&c)) {
        const double mirrored = perp__entry(M, c.j, c.i);

        if (c.value != mirrored &&
            !(fabs(c.value - mirrored) <=
              half * sqrt(perp__entry(M, c.i, c.i)) * sqrt(perp__entry(M, c.j, c.j))))
            return perp__refuse(context, "M(%d,%d) is %g but M(%d,%d) is %g: M is not symmetric",
                                (int)c.i, (int)c.j, c.value, (int)c.j, (int)c.i, mirrored);
    }
    return PERP_OK;
}

static perp_status read_rows(perp_context *context, const char *name, perp__matrix *own,
                             const perp_matrix *given, int32_t rows, int32_t n)
{
    perp_status status = perp__matrix_read(context, name, own, given);

    if (status == PERP_OK && own->columns != n)
        status =
            perp__refuse(context, "%s has %d columns, expected one for each of the %d velocities",
                         name, (int)own->columns, (int)n);
    if (status == PERP_OK && rows >= 0 && own->rows != rows)
        status = perp__refuse(context, "%s has %d rows, but the contacts have %d", name,
                              (int)own->rows, (int)rows);
    return status;
}

perp_status perp__dynamics_read(perp_context *context, perp__dynamics *own, int32_t rows,
                                const perp_contact_dynamics *dynamics)
{
    perp_contact_dynamics read = {0};
    perp_status status = perp__check_pointer(context, "dynamics", dynamics);

    PERP__THEN(status, PERP__READ(perp_contact_dynamics, context, &read, dynamics));
    if (status != PERP_OK)
        return status;
    if (read.n < 0 || read.reserved != 0)
        return perp__refuse(context, "dynamics.%s is %d", read.n < 0 ? "n" : "reserved",
                            (int)(read.n < 0 ? read.n : read.reserved));
    own->context = context;
    own->n = read.n;
    status = read_mass(context, own, &read);
    PERP__THEN(status, read_rows(context, "H", &own->H, read.H, rows, read.n));
    memset(&own->G, 0, sizeof own->G);
    own->G.columns = read.n;
    own->G.row_stride = own->G.column_stride = 1;
    if (status == PERP_OK && read.G)
        status = read_rows(context, "G", &own->G, read.G, -1, read.n);
    if (status == PERP_OK && own->G.rows > INT32_MAX - own->H.rows)
        status = perp__refuse(context, "H and G have too many rows");
    own->size = status == PERP_OK ? own->H.rows + own->G.rows : 0;
    return status;
}

/* ---- M, and W ---- */

/* Whether W is made by half.h. */
static int32_t is_halved(const perp__dynamics *own)
{
    return own->forms_W && own->has_M &&
           own->n <=
               (own->size > own->n || !own->M.column_starts ? PERP__HALF_MOST : PERP__HALF_FEW);
}

static void lay_out(perp__arena *arena, void *object)
{
    perp__dynamics *own = object;
    const size_t n = (size_t)own->n, size = (size_t)own->size;
    const size_t larger = n > size ? n : size;
    const int32_t is_dense = is_halved(own) || !own->M.column_starts;
    const size_t entries = own->has_M && !is_dense ? (size_t)own->M.column_starts[n] : 0;

    own->factor = own->has_M && is_dense ? perp__arena_take(arena, n, n * sizeof(double)) : NULL;
    own->inverse = own->pair = NULL;
    if (own->has_M && is_dense && own->n <= INVERTED_MOST) {
        own->inverse = perp__arena_take(arena, n, perp__half_width(own->n) * sizeof(double));
        own->pair = perp__arena_take(arena, 2, perp__half_width(own->n) * sizeof(double));
    }
    own->starts = perp__arena_take(arena, entries > 0 ? n + 1 : 0, sizeof(int32_t));
    own->rows = perp__arena_take(arena, entries, sizeof(int32_t));
    own->values = perp__arena_take(arena, entries, sizeof(double));
    own->W = own->block = NULL;
    if (own->forms_W) {
        own->W = perp__arena_take(arena, size, size * sizeof(double));
        own->block = perp__arena_take(
            arena, n, (is_halved(own) ? perp__half_width(own->size) : BLOCK) * sizeof(double));
    }
    own->firsts = perp__arena_take(arena, size, sizeof(int32_t));
    PERP__DOUBLES(arena, larger, &own->high, &own->low, &own->more_high, &own->more_low);
}

/* Rows begin .. begin + count - 1, dense, into the columns of block; those of A are number `above`
 * and on. */
static void spread_rows(perp__dynamics *own, const perp__matrix *A, int32_t above, int32_t begin,
                        int32_t count)
{
    perp__cursor c = perp__first(A);

    while (A->rows > 0 && perp__advance(&c))
        if (c.i + above >= begin && c.i + above < begin + count)
            own->block[(size_t)(c.i + above - begin) * (size_t)own->n + (size_t)c.j] = c.value;
}

static perp_status factor_mass(perp__dynamics *own)
{
    const size_t n = (size_t)own->n;
    int32_t pivot = 0, definite = 1;
    perp_status status = PERP_OK;

    if (!own->has_M || n == 0)
        return PERP_OK;
    if (own->factor) {
        memset(own->factor, 0, n * n * sizeof *own->factor);
        perp__matrix_spread(&own->M, own->factor, n);
        pivot = perp__cholesky_factor(own->n, own->factor, own->n);
        definite = pivot == 0;
        if (definite && own->inverse)
            perp__half_invert(own->n, own->factor, own->inverse, own->pair);
    } else {
        /* what has no mirror image is rounding, see read_mass */
        int32_t at = own->starts[0] = 0;

        for (perp__cursor c = perp__first(&own->M); perp__advance(&c);)
            if (c.i == c.j || (c.value != 0.0 && perp__entry(&own->M, c.j, c.i) != 0.0)) {
                own->rows[at] = c.i;
                own->values[at++] = c.value;
                own->starts[c.j + 1] = at;
            }
        own->fronts.is_symmetric = 1;
        status =
            perp__fronts_analyse(&own->fronts, own->context, own->n, 1, own->starts, own->rows);
        if (status == PERP_OK) {
            memcpy(own->fronts.values, own->values, (size_t)at * sizeof *own->values);
            definite = perp__fronts_factor(&own->fronts, 0, own->n);
        }
    }
    if (pivot > 0)
        return perp__refuse(own->context,
                            "M is not positive definite: the leading block of order %d is not",
                            (int)pivot);
    return definite ? status : perp__refuse(own->context, "M is not positive definite");
}

/* x := M^-1 x for `columns` right-hand sides. */
static perp_status solve_mass(perp__dynamics *own, double *x, int32_t columns)
{
    const size_t n = (size_t)own->n;

    if (n == 0 || columns == 0)
        return PERP_OK;
    if (own->solve) {
        if (own->solve(x, columns, own->user) != 0)
            return perp__fail(own->context, PERP_ERROR_CALLBACK, "dynamics.solve asked to abort");
        for (size_t i = 0; i < n * (size_t)columns; i++)
            if (!isfinite(x[i]))
                return perp__fail(own->context, PERP_ERROR_NOT_FINITE,
                                  "dynamics.solve made entry %zu of right-hand side %zu %g", i % n,
                                  i / n, x[i]);
    } else if (own->inverse) {
        for (int32_t c = 0; c < columns; c++)
            perp__half_apply(own->n, own->inverse, x + (size_t)c * n, own->pair);
    } else if (own->factor) {
        perp__cholesky_solve(own->n, columns, own->factor, own->n, x, own->n);
    } else {
        for (int32_t c = 0; c < columns; c++)
            perp__fronts_solve(&own->fronts, 0, own->n, x + (size_t)c * n);
    }
    return PERP_OK;
}

static perp_status not_finite(const perp__dynamics *own, size_t i, size_t j)
{
    return perp__fail(own->context, PERP_ERROR_NOT_FINITE,
                      "W(%zu,%zu) = (H M^-1 H')(%zu,%zu) is %g", i, j, i, j,
                      own->W[i + j * (size_t)own->size]);
}

/* W = (H, G) M^-1 (H, G)', symmetric by averaging. */
static perp_status form_delassus(perp__dynamics *own)
{
    const size_t n = (size_t)own->n, size = (size_t)own->size;
    perp_status status = PERP_OK;

    for (int32_t begin = 0; begin < own->size && status == PERP_OK; begin += BLOCK) {
        const int32_t columns = own->size - begin < BLOCK ? own->size - begin : BLOCK;

        memset(own->block, 0, (size_t)columns * n * sizeof *own->block);
        spread_rows(own, &own->H, 0, begin, columns);
        spread_rows(own, &own->G, own->H.rows, begin, columns);
        status = solve_mass(own, own->block, columns);
        for (int32_t c = 0; c < columns && status == PERP_OK; c++) {
            double *u = own->W + (size_t)(begin + c) * size;

            perp__multiply(&own->H, own->block + (size_t)c * n, u);
            if (own->G.rows > 0)
                perp__multiply(&own->G, own->block + (size_t)c * n, u + own->H.rows);
        }
    }
    for (size_t j = 0; j < size && status == PERP_OK; j++)
        for (size_t i = 0; i <= j; i++) {
            const double mean = 0.5 * own->W[i + j * size] + 0.5 * own->W[j + i * size];

            own->W[i + j * size] = own->W[j + i * size] = mean;
            if (!isfinite(mean))
                return not_finite(own, i, j);
        }
    return status;
}

/* W = Y'Y, Y = L^-1 (H, G)'. */
static perp_status form_halved(perp__dynamics *own)
{
    const size_t size = (size_t)own->size, width = perp__half_width(own->size);

    memset(own->block, 0, (size_t)own->n * width * sizeof *own->block);
    perp__matrix_spread(&own->H, own->block, width);
    perp__matrix_spread(&own->G, own->block + own->H.rows, width);

    /* firsts[t]: the first row of Y that is not 0 in tile t of its columns */
    for (size_t begin = 0; begin < size; begin += PERP__HALF_TILE) {
        int32_t *first = &own->firsts[begin / PERP__HALF_TILE], found = 0;

        for (*first = 0; *first < own->n && !found; *first += !found)
            for (int32_t k = 0; k < PERP__HALF_TILE; k++)
                found |= own->block[(size_t)*first * width + begin + (size_t)k] != 0.0;
    }
    perp__half_solve(own->n, own->size, own->factor, own->block, own->firsts, own->high);
    perp__half_product(own->n, own->size, own->block, own->firsts, own->W);
    for (size_t k = 0; k < size; k++) /* no entry of Y'Y is larger than the diagonal's */
        if (!isfinite(own->W[k * (size + 1)]))
            return not_finite(own, k, k);
    return PERP_OK;
}

perp_status perp__dynamics_setup(perp__dynamics *own)
{
    perp_status status = perp__arena_fit(&own->arena, own->context, lay_out, own);

    PERP__THEN(status, factor_mass(own));
    if (own->forms_W)
        PERP__THEN(status, is_halved(own) ? form_halved(own) : form_delassus(own));
    return status;
}

const double *perp__dynamics_half(const perp__dynamics *own, size_t *stride)
{
    *stride = perp__half_width(own->size);
    return is_halved(own) ? own->block : NULL;
}

void perp__dynamics_push(perp__dynamics *own, const double *f, const double *r)
{
    perp__transposed_doubled(&own->H, r, f, own->high, own->low);
    if (own->G.rows == 0)
        return;
    perp__transposed_doubled(&own->G, r + own->H.rows, own->high, own->more_high, own->more_low);
    for (size_t i = 0; i < (size_t)own->n; i++) {
        own->high[i] = own->more_high[i];
        own->low[i] += own->more_low[i];
    }
}

perp_status perp__dynamics_velocities(perp__dynamics *own, const double *f, const double *r,
                                      double *v, double *v_low)
{
    const size_t n = (size_t)own->n;
    perp_status status;

    if (r) {
        perp__dynamics_push(own, f, r);
    } else {
        memcpy(own->high, f, n * sizeof *f);
        memset(own->low, 0, n * sizeof *f);
    }
    for (size_t i = 0; i < n; i++) {
        v[i] = own->high[i] + own->low[i];
        v_low[i] = 0.0;
    }
    status = solve_mass(own, v, 1);
    if (status != PERP_OK || !own->has_M)
        return status;
    /* the residual f + H'r + G's - M v, rounded once; its solution is what v lacks */
    for (size_t i = 0; i < n; i++)
        own->high[i] = -own->high[i];
    perp__multiply_doubled(&own->M, v, own->high, own->more_high, own->more_low);
    for (size_t i = 0; i < n; i++)
        v_low[i] = own->low[i] - own->more_high[i] - own->more_low[i];
    status = solve_mass(own, v_low, 1);
    for (size_t i = 0; i < n; i++) {
        const double sum = v[i] + v_low[i];

        v_low[i] = isfinite(sum) ? v_low[i] - (sum - v[i]) : 0.0;
        v[i] = sum;
    }
    return status;
}

static void relative_doubled(perp__dynamics *own, const perp__matrix *A, const double *v,
                             const double *v_low, const double *add, double *u)
{
    perp__multiply_doubled(A, v, add, own->high, own->low);
    perp__multiply(A, v_low, own->more_high);
    for (int32_t i = 0; i < A->rows; i++)
        u[i] = own->high[i] + (own->low[i] + own->more_high[i]);
}

void perp__dynamics_relative(perp__dynamics *own, const double *v, const double *v_low,
                             const double *w, const double *b, double *u)
{
    relative_doubled(own, &own->H, v, v_low, w, u);
    if (own->G.rows > 0)
        relative_doubled(own, &own->G, v, v_low, b, u + own->H.rows);
}

void perp__dynamics_sizes(const perp__dynamics *own, const double *v, const double *w,
                          const double *b, double *out)
{
    perp__absolute_product(&own->H, v, w, out);
    if (own->G.rows > 0)
        perp__absolute_product(&own->G, v, b, out + own->H.rows);
}

void perp__dynamics_release(perp__dynamics *own)
{
    perp__fronts_release(&own->fronts);
    perp__arena_release(&own->arena);
}
