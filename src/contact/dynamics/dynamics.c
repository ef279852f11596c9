#include "contact/dynamics/dynamics.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "linalg/blas.h"
#include "linalg/signs.h"

/* Columns of W that are solved for at a time, and velocities up to which M's factor is inverted. */
enum { BLOCK = 32, INVERTED_MOST = 72 };

/* ---- checks of what a caller hands over ---- */

static perp_status read_mass(perp_context *context, perp__dynamics *view,
                             const perp_contact_dynamics *dynamics)
{
    const perp__matrix *M = &view->M;
    const double half = sqrt(DBL_EPSILON); /* of the digits: matrices are symmetric but for them */
    perp__cursor c;
    perp_status status;

    if (!dynamics->M == !dynamics->solve)
        return perp__refuse(context, "dynamics.M and dynamics.solve are %s: exactly one is needed",
                            dynamics->M ? "both given" : "both NULL");
    view->has_M = dynamics->M != NULL;
    view->solve = dynamics->solve;
    view->user = dynamics->user;
    if (!view->has_M)
        return PERP_OK;
    status = perp__matrix_read_sized(context, "M", &view->M, dynamics->M, view->n, view->n);
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < M->rows; i++)
        if (!(perp__entry(M, i, i) > 0.0))
            return perp__refuse(context, "M(%d,%d) is %g: M is not positive definite", (int)i,
                                (int)i, perp__entry(M, i, i));
    if (!M->column_starts && M->row_stride * M->column_stride == (size_t)view->n &&
        perp__is_dense_symmetric(M, NULL)) { /* then its rows are columns, which are faster */
        view->M.row_stride = 1, view->M.column_stride = (size_t)view->n;
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

static perp_status read_rows(perp_context *context, const char *name, perp__matrix *view,
                             const perp_matrix *given, int32_t rows, int32_t n)
{
    perp_status status = perp__matrix_read(context, name, view, given);

    if (status == PERP_OK && view->columns != n)
        status =
            perp__refuse(context, "%s has %d columns, expected one for each of the %d velocities",
                         name, (int)view->columns, (int)n);
    if (status == PERP_OK && rows >= 0 && view->rows != rows)
        status = perp__refuse(context, "%s has %d rows, but the contacts have %d", name,
                              (int)view->rows, (int)rows);
    return status;
}

perp_status perp__dynamics_read(perp_context *context, perp__dynamics *view, int32_t rows,
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
    view->context = context;
    view->n = read.n;
    status = read_mass(context, view, &read);
    PERP__THEN(status, read_rows(context, "H", &view->H, read.H, rows, read.n));
    memset(&view->G, 0, sizeof view->G);
    view->G.columns = read.n;
    view->G.row_stride = view->G.column_stride = 1;
    if (status == PERP_OK && read.G)
        status = read_rows(context, "G", &view->G, read.G, -1, read.n);
    if (status == PERP_OK && view->G.rows > INT32_MAX - view->H.rows)
        status = perp__refuse(context, "H and G have too many rows");
    view->size = status == PERP_OK ? view->H.rows + view->G.rows : 0;
    return status;
}

/* ---- M, and W ---- */

/* Whether W is made by half.c. */
static bool is_halved(const perp__dynamics *view)
{
    return view->forms_W && view->has_M &&
           view->n <=
               (view->size > view->n || !view->M.column_starts ? PERP__HALF_MOST : PERP__HALF_FEW);
}

static void lay_out(perp__arena *arena, void *object)
{
    perp__dynamics *view = object;
    const size_t n = (size_t)view->n, size = (size_t)view->size;
    const size_t larger = n > size ? n : size;
    const bool is_dense = is_halved(view) || !view->M.column_starts;
    const size_t entries = view->has_M && !is_dense ? (size_t)view->M.column_starts[n] : 0;

    view->factor = view->has_M && is_dense ? perp__arena_take(arena, n, n * sizeof(double)) : NULL;
    view->inverse = view->pair = NULL;
    if (view->has_M && is_dense && view->n <= INVERTED_MOST) {
        view->inverse = perp__arena_take(arena, n, perp__half_width(view->n) * sizeof(double));
        view->pair = perp__arena_take(arena, 2, perp__half_width(view->n) * sizeof(double));
    }
    view->starts = perp__arena_take(arena, entries > 0 ? n + 1 : 0, sizeof(int32_t));
    view->rows = perp__arena_take(arena, entries, sizeof(int32_t));
    view->values = perp__arena_take(arena, entries, sizeof(double));
    view->W = view->block = NULL;
    if (view->forms_W) {
        view->W = perp__arena_take(arena, size, size * sizeof(double));
        view->block = perp__arena_take(
            arena, n, (is_halved(view) ? perp__half_width(view->size) : BLOCK) * sizeof(double));
    }
    view->firsts = perp__arena_take(arena, size, sizeof(int32_t));
    PERP__DOUBLES(arena, larger, &view->high, &view->low, &view->more_high, &view->more_low);
}

/* Rows begin .. begin + count - 1, dense, into the columns of block; those of A are number `above`
 * and on. */
static void spread_rows(perp__dynamics *view, const perp__matrix *A, int32_t above, int32_t begin,
                        int32_t count)
{
    perp__cursor c = perp__first(A);

    while (A->rows > 0 && perp__advance(&c))
        if (c.i + above >= begin && c.i + above < begin + count)
            view->block[(size_t)(c.i + above - begin) * (size_t)view->n + (size_t)c.j] = c.value;
}

static perp_status factor_mass(perp__dynamics *view)
{
    const size_t n = (size_t)view->n;
    int32_t pivot = 0, definite = 1;
    perp_status status = PERP_OK;

    if (!view->has_M || n == 0)
        return PERP_OK;
    if (view->factor) {
        memset(view->factor, 0, n * n * sizeof *view->factor);
        perp__matrix_spread(&view->M, view->factor, n);
        pivot = perp__cholesky_factor(view->n, view->factor, view->n);
        definite = pivot == 0;
        if (definite && view->inverse)
            perp__half_invert(view->n, view->factor, view->inverse, view->pair);
    } else {
        /* what has no mirror image is rounding, see read_mass */
        int32_t at = view->starts[0] = 0;

        for (perp__cursor c = perp__first(&view->M); perp__advance(&c);)
            if (c.i == c.j || (c.value != 0.0 && perp__entry(&view->M, c.j, c.i) != 0.0)) {
                view->rows[at] = c.i;
                view->values[at++] = c.value;
                view->starts[c.j + 1] = at;
            }
        view->fronts.is_symmetric = 1;
        status = perp__fronts_analyse(&view->fronts, view->context, view->n, 1, view->starts,
                                      view->rows);
        if (status == PERP_OK) {
            memcpy(view->fronts.values, view->values, (size_t)at * sizeof *view->values);
            definite = perp__fronts_factor(&view->fronts, 0, view->n);
        }
    }
    if (pivot > 0)
        return perp__refuse(view->context,
                            "M is not positive definite: the leading block of order %d is not",
                            (int)pivot);
    return definite ? status : perp__refuse(view->context, "M is not positive definite");
}

/* x := M^-1 x for `columns` right-hand sides. */
static perp_status solve_mass(perp__dynamics *view, double *x, int32_t columns)
{
    const size_t n = (size_t)view->n;

    if (n == 0 || columns == 0)
        return PERP_OK;
    if (view->solve) {
        if (view->solve(x, columns, view->user) != 0)
            return perp__fail(view->context, PERP_ERROR_CALLBACK, "dynamics.solve asked to abort");
        for (size_t i = 0; i < n * (size_t)columns; i++)
            if (!isfinite(x[i]))
                return perp__fail(view->context, PERP_ERROR_NOT_FINITE,
                                  "dynamics.solve made entry %zu of right-hand side %zu %g", i % n,
                                  i / n, x[i]);
    } else if (view->inverse) {
        for (int32_t c = 0; c < columns; c++)
            perp__half_apply(view->n, view->inverse, x + (size_t)c * n, view->pair);
    } else if (view->factor) {
        perp__cholesky_solve(view->n, columns, view->factor, view->n, x, view->n);
    } else {
        for (int32_t c = 0; c < columns; c++)
            perp__fronts_solve(&view->fronts, 0, view->n, x + (size_t)c * n);
    }
    return PERP_OK;
}

static perp_status not_finite(const perp__dynamics *view, size_t i, size_t j)
{
    return perp__fail(view->context, PERP_ERROR_NOT_FINITE,
                      "W(%zu,%zu) = (H M^-1 H')(%zu,%zu) is %g", i, j, i, j,
                      view->W[i + j * (size_t)view->size]);
}

/* W = (H, G) M^-1 (H, G)', symmetric by averaging. */
static perp_status form_delassus(perp__dynamics *view)
{
    const size_t n = (size_t)view->n, size = (size_t)view->size;
    perp_status status = PERP_OK;

    for (int32_t begin = 0; begin < view->size && status == PERP_OK; begin += BLOCK) {
        const int32_t columns = view->size - begin < BLOCK ? view->size - begin : BLOCK;

        memset(view->block, 0, (size_t)columns * n * sizeof *view->block);
        spread_rows(view, &view->H, 0, begin, columns);
        spread_rows(view, &view->G, view->H.rows, begin, columns);
        status = solve_mass(view, view->block, columns);
        for (int32_t c = 0; c < columns && status == PERP_OK; c++) {
            double *u = view->W + (size_t)(begin + c) * size;

            perp__multiply(&view->H, view->block + (size_t)c * n, u);
            if (view->G.rows > 0)
                perp__multiply(&view->G, view->block + (size_t)c * n, u + view->H.rows);
        }
    }
    for (size_t j = 0; j < size && status == PERP_OK; j++)
        for (size_t i = 0; i <= j; i++) {
            const double mean = 0.5 * view->W[i + j * size] + 0.5 * view->W[j + i * size];

            view->W[i + j * size] = view->W[j + i * size] = mean;
            if (!isfinite(mean))
                return not_finite(view, i, j);
        }
    return status;
}

/* W = Y'Y, Y = L^-1 (H, G)'. */
static perp_status form_halved(perp__dynamics *view)
{
    const size_t size = (size_t)view->size, width = perp__half_width(view->size);

    memset(view->block, 0, (size_t)view->n * width * sizeof *view->block);
    perp__matrix_spread(&view->H, view->block, width);
    perp__matrix_spread(&view->G, view->block + view->H.rows, width);

    /* firsts[t]: the first row of Y that is not 0 in tile t of its columns */
    for (size_t begin = 0; begin < size; begin += PERP__HALF_TILE) {
        int32_t *first = &view->firsts[begin / PERP__HALF_TILE], found = 0;

        for (*first = 0; *first < view->n && !found; *first += !found)
            for (int32_t k = 0; k < PERP__HALF_TILE; k++)
                found |= view->block[(size_t)*first * width + begin + (size_t)k] != 0.0;
    }
    perp__half_solve(view->n, view->size, view->factor, view->block, view->firsts, view->high);
    perp__half_product(view->n, view->size, view->block, view->firsts, view->W);
    for (size_t k = 0; k < size; k++) /* no entry of Y'Y is larger than the diagonal's */
        if (!isfinite(view->W[k * (size + 1)]))
            return not_finite(view, k, k);
    return PERP_OK;
}

perp_status perp__dynamics_setup(perp__dynamics *view)
{
    perp_status status = perp__arena_fit(&view->arena, view->context, lay_out, view);

    PERP__THEN(status, factor_mass(view));
    if (view->forms_W)
        PERP__THEN(status, is_halved(view) ? form_halved(view) : form_delassus(view));
    return status;
}

const double *perp__dynamics_half(const perp__dynamics *view, size_t *stride)
{
    *stride = perp__half_width(view->size);
    return is_halved(view) ? view->block : NULL;
}

void perp__dynamics_push(perp__dynamics *view, const double *f, const double *r)
{
    perp__transposed_doubled(&view->H, r, f, view->high, view->low);
    if (view->G.rows == 0)
        return;
    perp__transposed_doubled(&view->G, r + view->H.rows, view->high, view->more_high,
                             view->more_low);
    for (size_t i = 0; i < (size_t)view->n; i++) {
        view->high[i] = view->more_high[i];
        view->low[i] += view->more_low[i];
    }
}

perp_status perp__dynamics_velocities(perp__dynamics *view, const double *f, const double *r,
                                      double *v, double *v_low)
{
    const size_t n = (size_t)view->n;
    perp_status status;

    if (r) {
        perp__dynamics_push(view, f, r);
    } else {
        memcpy(view->high, f, n * sizeof *f);
        memset(view->low, 0, n * sizeof *f);
    }
    for (size_t i = 0; i < n; i++) {
        v[i] = view->high[i] + view->low[i];
        v_low[i] = 0.0;
    }
    status = solve_mass(view, v, 1);
    if (status != PERP_OK || !view->has_M)
        return status;
    /* the residual f + H'r + G's - M v, rounded once; its solution is what v lacks */
    for (size_t i = 0; i < n; i++)
        view->high[i] = -view->high[i];
    perp__multiply_doubled(&view->M, v, view->high, view->more_high, view->more_low);
    for (size_t i = 0; i < n; i++)
        v_low[i] = view->low[i] - view->more_high[i] - view->more_low[i];
    status = solve_mass(view, v_low, 1);
    for (size_t i = 0; i < n; i++) {
        const double sum = v[i] + v_low[i];

        v_low[i] = isfinite(sum) ? v_low[i] - (sum - v[i]) : 0.0;
        v[i] = sum;
    }
    return status;
}

static void relative_doubled(perp__dynamics *view, const perp__matrix *A, const double *v,
                             const double *v_low, const double *add, double *u)
{
    perp__multiply_doubled(A, v, add, view->high, view->low);
    perp__multiply(A, v_low, view->more_high);
    for (int32_t i = 0; i < A->rows; i++)
        u[i] = view->high[i] + (view->low[i] + view->more_high[i]);
}

void perp__dynamics_relative(perp__dynamics *view, const double *v, const double *v_low,
                             const double *w, const double *b, double *u)
{
    relative_doubled(view, &view->H, v, v_low, w, u);
    if (view->G.rows > 0)
        relative_doubled(view, &view->G, v, v_low, b, u + view->H.rows);
}

void perp__dynamics_sizes(const perp__dynamics *view, const double *v, const double *w,
                          const double *b, double *out)
{
    perp__absolute_product(&view->H, v, w, out);
    if (view->G.rows > 0)
        perp__absolute_product(&view->G, v, b, out + view->H.rows);
}

void perp__dynamics_release(perp__dynamics *view)
{
    perp__fronts_release(&view->fronts);
    perp__arena_release(&view->arena);
}
