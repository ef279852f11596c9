#include "check.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "exact.h"

#define EPS 0x1p-52

/* ---- matrices as lists of entries ---------------------------------------------------------- */

static double dense_entry(const perp_matrix *M, int32_t i, int32_t j)
{
    int64_t at = M->storage == PERP_STORAGE_ROW_MAJOR ? i * M->leading_dimension + j
                                                      : i + j * M->leading_dimension;

    return M->values[at];
}

double check_entry(const perp_matrix *M, int32_t i, int32_t j)
{
    int32_t p;

    if (M->storage != PERP_STORAGE_CSC)
        return dense_entry(M, i, j);
    for (p = M->column_starts[j]; p < M->column_starts[j + 1]; p++)
        if (M->row_indices[p] == i)
            return M->values[p];
    return 0.0;
}

void *check_allocate(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);

    if (!memory)
        fail_msg("no memory for a check");
    return memory;
}

check_item *check_items(const perp_matrix *M, size_t *count)
{
    int csc = M->storage == PERP_STORAGE_CSC;
    size_t room = csc ? (size_t)M->column_starts[M->columns] : (size_t)M->rows * (size_t)M->columns;
    check_item *list = check_allocate(room, sizeof *list);
    int32_t i, j, p;

    *count = 0;
    for (j = 0; j < M->columns; j++) {
        if (csc) {
            for (p = M->column_starts[j]; p < M->column_starts[j + 1]; p++)
                if (M->values[p] != 0)
                    list[(*count)++] = (check_item){M->row_indices[p], j, M->values[p]};
        } else {
            for (i = 0; i < M->rows; i++)
                if (dense_entry(M, i, j) != 0)
                    list[(*count)++] = (check_item){i, j, dense_entry(M, i, j)};
        }
    }
    return list;
}

void check_multiply(const perp_matrix *M, int transposed, const double *x, const double *add,
                    const int32_t *shift, double *y)
{
    size_t n = (size_t)M->rows, count, p, i;
    check_item *list = check_items(M, &count);
    size_t *start = check_allocate(n + 1, sizeof *start),
           *order = check_allocate(count, sizeof *order);
    check_sum sum;

    /* the entries in the order of the rows of the product */
    for (p = 0; p < count; p++)
        start[transposed ? list[p].column : list[p].row]++;
    for (i = 1; i <= n; i++)
        start[i] += start[i - 1];
    for (p = count; p-- > 0;)
        order[--start[transposed ? list[p].column : list[p].row]] = p;
    for (i = 0; i < n; i++) {
        check_sum_clear(&sum);
        if (add)
            check_sum_add(&sum, add[i], 1.0);
        for (p = start[i]; p < (i + 1 < n ? start[i + 1] : count); p++) {
            const check_item *e = &list[order[p]];

            check_sum_add(&sum, e->value, x[transposed ? e->row : e->column]);
        }
        y[i] = check_sum_value(&sum, shift ? shift[i] : 0);
    }
    free(order);
    free(start);
    free(list);
}

/* ---- the scaling, as src/linalg/scale.h defines it ----------------------------------------- */

#define UNSET INT32_MIN

static int32_t limited(int e)
{
    return e > 511 ? 511 : e < -511 ? -511 : e;
}

/* e with 2^(2e) |x| in [1/2, 2) */
static int32_t unit_diagonal(double x)
{
    int p;

    frexp(x, &p); /* |x| = m 2^p, m in [1/2, 1) */
    return limited(p % 2 == 0 ? -p / 2 : -(p - 1) / 2);
}

/* e of every unset row that couples to a set one: the largest coupling into [1, 2). Returns
 * whether there was one. All rows of a round see the exponents of the rounds before. */
static int reach(const check_item *list, size_t count, int32_t n, int32_t *exponents, int *largest)
{
    int found = 0;
    int32_t i;
    size_t p;

    for (i = 0; i < n; i++)
        largest[i] = INT_MIN;
    for (p = 0; p < count; p++) {
        int32_t r = list[p].row, c = list[p].column, unset, set;
        int power;

        if ((exponents[r] == UNSET) == (exponents[c] == UNSET))
            continue;
        unset = exponents[r] == UNSET ? r : c;
        set = exponents[r] == UNSET ? c : r;
        frexp(list[p].value, &power);
        if (power + exponents[set] > largest[unset])
            largest[unset] = power + exponents[set];
    }
    for (i = 0; i < n; i++)
        if (largest[i] != INT_MIN) {
            exponents[i] = limited(1 - largest[i]);
            found = 1;
        }
    return found;
}

static void spread(const check_item *list, size_t count, int32_t n, int32_t *exponents,
                   int *largest)
{
    while (reach(list, count, n, exponents, largest))
        ;
}

/* Rows with a negative diagonal: the largest of it and the couplings to positive ones to a unit. */
static void scale_negative(const check_item *list, size_t count, int32_t n, const double *diagonal,
                           int32_t *exponents)
{
    int32_t i;
    size_t p;

    for (i = 0; i < n; i++) {
        int32_t e = unit_diagonal(diagonal[i]);

        if (!(diagonal[i] < 0) || exponents[i] != UNSET)
            continue;
        for (p = 0; p < count; p++) {
            int32_t other = list[p].row == i ? list[p].column : list[p].row;
            int power;

            if ((list[p].row != i && list[p].column != i) || !(diagonal[other] > 0))
                continue;
            frexp(list[p].value, &power);
            if (limited(1 - power - exponents[other]) < e)
                e = limited(1 - power - exponents[other]);
        }
        exponents[i] = e;
    }
}

/* floor(log2) of the largest entry of S in row and column i; INT_MIN if there is none. */
static void look_for_largest(const check_item *list, size_t count, int32_t n,
                             const int32_t *exponents, int *largest)
{
    int32_t i;
    size_t p;

    for (i = 0; i < n; i++)
        largest[i] = INT_MIN;
    for (p = 0; p < count; p++) {
        const int32_t r = list[p].row, c = list[p].column;
        int power;

        frexp(list[p].value, &power);
        power += exponents[r] + exponents[c] - 1;
        largest[r] = power > largest[r] ? power : largest[r];
        largest[c] = power > largest[c] ? power : largest[c];
    }
}

/* Where entries of 2^40 are left: sixteen rounds of halving the exponents of the largest entries,
 * in the rows that show one and in those without a positive diagonal. */
static void balance(const check_item *list, size_t count, int32_t n, const double *diagonal,
                    int32_t *exponents, int *largest)
{
    char *noisy = check_allocate((size_t)n, 1);
    int32_t i;
    int round, any = 0;

    for (round = 0; round < 16; round++) {
        look_for_largest(list, count, n, exponents, largest);
        for (i = 0; i < n; i++)
            if (largest[i] >= 40)
                any = noisy[i] = 1;
        for (i = 0; i < n && any; i++)
            if (largest[i] != INT_MIN && (noisy[i] || !(diagonal[i] > 0)))
                exponents[i] = limited(exponents[i] - largest[i] / 2);
    }
    free(noisy);
}

/* Without the end, where entries of 2^40 are left. */
static void start_exponents(const check_item *list, size_t count, int32_t n, const double *diagonal,
                            int scaling, int32_t *exponents, int *largest)
{
    size_t p;
    int32_t i;

    for (i = 0; i < n; i++)
        exponents[i] = !scaling ? 0 : diagonal[i] > 0 ? unit_diagonal(diagonal[i]) : UNSET;
    if (scaling)
        scale_negative(list, count, n, diagonal, exponents);
    spread(list, count, n, exponents, largest);
    for (i = 0; i < n; i++)
        if (exponents[i] == UNSET) {
            double size = 0.0;

            for (p = 0; p < count; p++)
                if (list[p].row == i || list[p].column == i)
                    size = fmax(size, fabs(list[p].value));
            exponents[i] = size > 0 ? unit_diagonal(size) : 0;
            spread(list, count, n, exponents, largest);
        }
}

static int is_moderate(int32_t n, const int32_t *exponents)
{
    int32_t i;

    for (i = 0; i < n; i++)
        if (abs(exponents[i]) > 100)
            return 0;
    return 1;
}

/* Whether a diagonal is at most 2^-38 of another entry of its row or column, and the product of
 * that entry's two diagonals at most 2^-38 of its square; or an entry beside it 2^20 of S. */
static int has_noise(const check_item *list, size_t count, const double *diagonal,
                     const int32_t *exponents)
{
    int found = 0, power;
    size_t p;

    for (p = 0; p < count; p++) {
        const int32_t r = list[p].row, c = list[p].column;
        const double size = fabs(list[p].value), least = 0x1p-38 * size;
        const double a = fabs(diagonal[r]), b = fabs(diagonal[c]);

        if (r == c)
            continue;
        frexp(size, &power);
        found |= ((a > 0 && a <= least) || (b > 0 && b <= least)) && a * b <= least * size;
        found |= power + exponents[r] + exponents[c] - 1 >= 20;
    }
    return found;
}

static void find_exponents(const perp_matrix *M, int scaling, int of_witness, int32_t *exponents)
{
    int is_noisy;
    size_t count, p;
    check_item *list = check_items(M, &count);
    int *largest = check_allocate((size_t)M->rows, sizeof *largest);
    double *diagonal = check_allocate((size_t)M->rows, sizeof *diagonal);

    for (p = 0; p < count; p++)
        if (list[p].row == list[p].column)
            diagonal[list[p].row] = list[p].value;
    start_exponents(list, count, M->rows, diagonal, scaling, exponents, largest);
    is_noisy = has_noise(list, count, diagonal, exponents);
    if (scaling)
        balance(list, count, M->rows, diagonal, exponents, largest);
    if (of_witness && is_noisy && is_moderate(M->rows, exponents))
        memset(exponents, 0, (size_t)M->rows * sizeof *exponents);
    free(diagonal);
    free(largest);
    free(list);
}

void check_exponents(const perp_matrix *M, int scaling, int32_t *exponents)
{
    find_exponents(M, scaling, 0, exponents);
}

void check_witness_start(const perp_matrix *M, int scaling, int32_t *exponents)
{
    find_exponents(M, scaling, 1, exponents);
}

void check_parts(const perp_matrix *M, int32_t *part)
{
    size_t count, p;
    check_item *list = check_items(M, &count);
    int32_t i;
    int changed = 1;

    for (i = 0; i < 2 * M->rows; i++)
        part[i] = i;
    while (changed)
        for (changed = 0, p = 0; p < count; p++) {
            int32_t *a = &part[list[p].row], *b = &part[M->rows + list[p].column];

            changed |= *a != *b;
            *a = *b = *a < *b ? *a : *b;
        }
    free(list);
}

/* log2 of a row's omega, that of its part. */
static void check_omega(const check_lcp *problem, const int32_t *exponents, const int32_t *part,
                        int32_t *omega)
{
    int32_t i, k, n = problem->M->rows;
    int power;

    for (k = 0; k < 2 * n; k++)
        omega[k] = INT32_MIN;
    for (i = 0; i < n; i++)
        if (problem->q[i] != 0) {
            frexp(problem->q[i], &power);
            if (power - 1 + exponents[i] > omega[part[i]])
                omega[part[i]] = power - 1 + exponents[i];
        }
    for (i = 2 * n - 1; i >= 0;
         i--) /* a part has the number of its first row: that one comes last */
        omega[i] = omega[part[i]] == INT32_MIN ? 0 : omega[part[i]];
}

/* ---- residuals and backward error ---------------------------------------------------------- */

double check_lower(const check_lcp *problem, int32_t i)
{
    return problem->lower ? problem->lower[i] : 0.0;
}

double check_upper(const check_lcp *problem, int32_t i)
{
    return problem->upper ? problem->upper[i] : INFINITY;
}

static double middle(double a, double b, double c)
{
    double low = a < b ? a : b, high = a < b ? b : a;

    return c < low ? low : c > high ? high : c;
}

void check_raise(double *largest, double x)
{
    if (isnan(x) || x > *largest) /* nothing is larger than a NaN: it stays */
        *largest = x;
}

/* What row i of the scaled problem still misses, given the place that z_i stands at. */
static double missing(double z, double l, double u, double w)
{
    if (l == u)
        return 0.0;
    if (z == l)
        return w < 0 ? -w : 0.0;
    if (z == u)
        return w > 0 ? w : 0.0;
    return fabs(w);
}

void check_row_norms(const perp_matrix *M, const int32_t *exponents, double *norms)
{
    size_t count, p;
    check_item *list = check_items(M, &count);

    memset(norms, 0, (size_t)M->rows * sizeof *norms);
    for (p = 0; p < count; p++)
        norms[list[p].row] +=
            ldexp(fabs(list[p].value), exponents[list[p].row] + exponents[list[p].column]);
    free(list);
}

static void measure_row(check_measures *m, const check_lcp *problem, const double *z, int32_t i,
                        double w, double w_scaled, int32_t e, int32_t omega)
{
    double l = check_lower(problem, i), u = check_upper(problem, i);
    double to_lower = z[i] - l, to_upper = z[i] - u;

    check_raise(&m->natural_residual, fabs(middle(to_lower, to_upper, w)));
    check_raise(&m->residual,
                fabs(middle(ldexp(to_lower, -e - omega), ldexp(to_upper, -e - omega), w_scaled)));
    check_raise(&m->violation, -to_lower);
    check_raise(&m->violation, to_upper);
    if (w > 0 && isfinite(l))
        check_raise(&m->complementarity, w * to_lower);
    if (w < 0 && isfinite(u))
        check_raise(&m->complementarity, w * to_upper);
}

void check_measure(check_measures *m, const check_lcp *problem, const double *z, const double *w)
{
    int32_t n = problem->M->rows, i;
    int32_t *e = check_allocate((size_t)n, sizeof *e),
            *shift = check_allocate((size_t)n, sizeof *shift),
            *part = check_allocate(2 * (size_t)n, sizeof *part),
            *omega = check_allocate(2 * (size_t)n, sizeof *omega);
    double *exact = check_allocate((size_t)n, sizeof *exact),
           *scaled = check_allocate((size_t)n, sizeof *scaled);
    double *norms = check_allocate((size_t)n, sizeof *norms),
           *z_norms = check_allocate(2 * (size_t)n, sizeof *z_norms);

    memset(m, 0, sizeof *m);
    check_exponents(problem->M, problem->scaling, e);
    check_parts(problem->M, part);
    check_omega(problem, e, part, omega);
    for (i = 0; i < n; i++)
        shift[i] = e[i] - omega[i];
    check_multiply(problem->M, 0, z, problem->q, NULL, exact);
    check_multiply(problem->M, 0, z, problem->q, shift, scaled);
    check_row_norms(problem->M, e, norms);
    for (i = 0; i < n; i++)
        check_raise(&z_norms[part[n + i]], ldexp(fabs(z[i]), -e[i] - omega[n + i]));
    for (i = 0; i < n; i++) {
        double gap = missing(z[i], check_lower(problem, i), check_upper(problem, i), scaled[i]);
        double z_norm = z_norms[part[i]];
        double size = (z_norm > 0 ? norms[i] * z_norm : 0.0) + ldexp(fabs(problem->q[i]), shift[i]);
        /* roundings of n products in double-double, and what each loses to underflow */
        double noise = EPS * EPS * (double)n * (double)n * size + ldexp(n, shift[i] - 1074);

        measure_row(m, problem, z, i, exact[i], scaled[i], e[i], omega[n + i]);
        if (gap > 0)
            check_raise(&m->backward_error, size > 0 ? gap / size : INFINITY);
        check_raise(&m->noise, noise);
        if (size > 0)
            check_raise(&m->backward_noise, noise / size);
        if (isinf(exact[i]) || isinf(norms[i]) || isinf(size))
            m->overflow = 1;
        noise = ldexp(noise, -shift[i]);
        check_raise(&m->natural_noise, noise);
        if (w && w[i] != exact[i])
            check_raise(&m->w_error,
                        fabs(w[i] - exact[i]) / (EPS * fabs(exact[i]) + noise + 0x1p-1073));
    }
    free(z_norms);
    free(norms);
    free(scaled);
    free(exact);
    free(omega);
    free(part);
    free(shift);
    free(e);
}
