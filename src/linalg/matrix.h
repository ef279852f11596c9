/* A checked matrix view, and the products that need more than working precision. */
#ifndef PERP_LINALG_MATRIX_H
#define PERP_LINALG_MATRIX_H

#include <stdbool.h>

#include <perp/matrix.h>

#include <math.h>
#include <string.h>

/* Dense entry (i,j) is values[i * row_stride + j * column_stride], one of the strides being 1; CSC
 * if column_starts is not NULL. */
typedef struct perp__matrix {
    int32_t rows, columns;
    size_t row_stride, column_stride;
    const double *values;
    const int32_t *column_starts, *row_indices;
} perp__matrix;

/* Checks a caller's view completely (struct, storage, sizes, leading dimension, index arrays,
 * finite values) and fills *copy. The message names the argument `name` and the index. */
perp_status perp__matrix_read(perp_context *context, const char *name, perp__matrix *copy,
                              const perp_matrix *caller);

/* The same, of this size and no other. */
perp_status perp__matrix_read_sized(perp_context *context, const char *name, perp__matrix *copy,
                                    const perp_matrix *caller, int32_t rows, int32_t columns);

/* A public view of a dense matrix without gaps, for an inner call. */
perp_matrix perp__view(int32_t storage, int32_t rows, int32_t columns, const double *values);

/* Compressed columns, which are there: starts first, since until they are known to be sound nothing
 * else may be read; then rows, and values unless these are NULL. */
perp_status perp__matrix_check_csc(perp_context *context, const char *name, const perp__matrix *M);

/* high + low = M x + add in double-double: two_product by fma(), two_sum; the rounding error of the
 * result is of order (n eps)^2 |M||x|. `add` may be NULL. Entries x_j = 0 cost nothing. The order
 * of summation is fixed. high and low: `rows` entries each, may not overlap x or add. */
void perp__multiply_doubled(const perp__matrix *M, const double *x, const double *add, double *high,
                            double *low);

/* A := M by columns, `stride` from one to the next; of a sparse M only the entries that it has. */
void perp__matrix_spread(const perp__matrix *M, double *A, size_t stride);

/* y = M x in working precision, fixed order. */
void perp__multiply(const perp__matrix *M, const double *x, double *y);

/* y += M x; M column-major or CSC, and columns with x_j = 0 cost nothing. */
void perp__multiply_add(const perp__matrix *M, const double *x, double *y);

/* The transpose of a CSC matrix, whose columns are the rows of M. starts: rows + 1; columns and
 * values, which may be NULL: an entry each. */
void perp__transpose_csc(const perp__matrix *M, int32_t *starts, int32_t *columns, double *values);

/* M_ij, by bisection where M is sparse; 0 where there is no entry. */
double perp__entry(const perp__matrix *M, int32_t i, int32_t j);

/* sum_i x_i y_i, in the order of i. */
static inline double perp__dot(const double *x, const double *y, int32_t n)
{
    double sum = 0.0;

    for (int32_t i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

/* max |x_i|; what is no number does not count. */
static inline double perp__largest(const double *x, int32_t n)
{
    double largest = 0.0;

    for (int32_t i = 0; i < n; i++)
        largest = fabs(x[i]) > largest ? fabs(x[i]) : largest;
    return largest;
}

/* The same, NaN where one of them is. */
double perp__largest_or_nan(const double *x, int32_t n);

/* |x|, without overflow. */
double perp__length(const double *x, int32_t n);

/* mid(above, below, w) for above = z - l >= 0 >= below = z - u. */
static inline double perp__middle(double above, double below, double w)
{
    const double least = above < w ? above : w;

    return below > least ? below : least;
}

/* mid(z - l, z - u, w) without cancellation. */
static inline double perp__mid(double z, double lower, double upper, double w)
{
    return perp__middle(z - lower, z - upper, w);
}

/* Nearest point of [lower, upper]. */
static inline double perp__clamp(double z, double lower, double upper)
{
    return z < lower ? lower : z > upper ? upper : z;
}

/* to := from, where to is not NULL: nobody asked. Of none from may be NULL, unlike memcpy's. */
static inline void perp__copy(double *to, const double *from, int32_t n)
{
    if (to && n > 0)
        memcpy(to, from, (size_t)n * sizeof *to);
}

static inline bool perp__is_zero(const double *x, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        if (x[i] != 0.0)
            return 0;
    return 1;
}

/* sum_i |x_i|, in the order of i. */
double perp__sum_of_sizes(const double *x, int32_t n);

/* sum_i M_ij x_i, in the order of i. */
double perp__column_times(const perp__matrix *M, int32_t j, const double *x);

/* row_sums[i] = sum_j |M_ij| 2^(e_i + e_j) with e = exponents (square M). */
void perp__scaled_row_norms(const perp__matrix *M, const int32_t *exponents, double *row_sums);

/* ---- stored lines of a matrix, columns or rows, and what hangs together through them ---- */

/* Column j of M, or row j where that is the contiguous one. */
typedef struct perp__line {
    int32_t count;
    const double *values;
    const int32_t *indices; /* NULL: 0, 1, 2, ... */
} perp__line;

static inline perp__line perp__line_of(const perp__matrix *M, int32_t j)
{
    perp__line l;

    if (M->column_starts) {
        l.count = M->column_starts[j + 1] - M->column_starts[j];
        l.values = l.count > 0 ? M->values + M->column_starts[j] : NULL;
        l.indices = l.count > 0 ? M->row_indices + M->column_starts[j] : NULL;
    } else {
        l.count = M->row_stride == 1 ? M->rows : M->columns;
        l.values = M->values + (size_t)j * (M->row_stride == 1 ? M->column_stride : M->row_stride);
        l.indices = NULL;
    }
    return l;
}

/* Whether the lines are rows. */
static inline bool perp__lines_are_rows(const perp__matrix *M)
{
    return !M->column_starts && M->row_stride != 1;
}

/* The entries of M other than 0, one by one: perp__first, then perp__advance until it is false. */
typedef struct perp__cursor {
    const perp__matrix *M;
    perp__line line;
    int32_t at, next; /* the line, and the next of its entries */
    int32_t i, j;     /* row and column of `value` */
    double value;
} perp__cursor;

static inline perp__cursor perp__first(const perp__matrix *M)
{
    perp__cursor c = {M, {0, NULL, NULL}, -1, 0, 0, 0, 0.0};

    return c;
}

static inline bool perp__advance(perp__cursor *c)
{
    int32_t k = c->next;

    for (;; k = 0) {
        while (k < c->line.count && c->line.values[k] == 0.0)
            k++;
        if (k < c->line.count)
            break;
        if (++c->at == (perp__lines_are_rows(c->M) ? c->M->rows : c->M->columns))
            return 0;
        c->line = perp__line_of(c->M, c->at);
    }
    c->value = c->line.values[k];
    c->i = c->line.indices ? c->line.indices[k] : k;
    c->j = c->at;
    c->next = k + 1;
    if (perp__lines_are_rows(c->M)) {
        c->j = c->i;
        c->i = c->at;
    }
    return 1;
}

/* part[i] := number of the part of M that row i belongs to, part[n + j] := that of column j: parts
 * share no entry other than 0. Rows and columns apart, because complementarity couples z_i and w_i
 * by signs alone, not by size. Returns how many there are. part: 2 n entries; work: n. */
int32_t perp__find_parts(const perp__matrix *M, int32_t *part, double *work);

/* The same of entries |M_ij| >= least rows_i columns_j; rows with `tied` (NULL: none) belong to the
 * part of their columns. */
int32_t perp__cut_parts(const perp__matrix *M, const double *rows, const double *columns,
                        double least, const int32_t *tied, int32_t *part);

/* ---- principal blocks: the rows and columns of a square matrix that an index list names ---- */

typedef struct perp__index_set {
    int32_t count;
    const int32_t *active;   /* count indices, increasing */
    const int32_t *position; /* rows of M: place in `active`, or -1 */
} perp__index_set;

/* Entry (r,c) of it to to[r * row_step + c * column_step]; one step is 1, the other count. */
void perp__principal_dense(const perp__matrix *M, const perp__index_set *set, double *to,
                           size_t row_step, size_t column_step);

/* The same in CSC, from a CSC matrix, plus rho I, or instead diag(weights), n of them: starts has
 * count + 1 entries, rows and values room for as many as M has, and n more with a shift. */
void perp__principal_csc(const perp__matrix *M, const perp__index_set *set, double rho,
                         const double *weights, int32_t *starts, int32_t *rows, double *values);

#endif
