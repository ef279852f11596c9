/* The own residual of docs/lcp.md, row by row, from the caller's data; long double throughout, so
 * that its own rounding is far below any tolerance it is compared with. */
#include "check.h"

#include <math.h>
#include <stdlib.h>

/* log2 of the scales that bring the largest entry of every row and column of |M| near 1: from
 * `units` on, sixteen rounds of halving its exponent. */
static void find_units(const check_item *list, size_t count, int32_t n, int32_t *units)
{
    int *largest = check_allocate((size_t)n, sizeof *largest);
    int32_t i;
    int round;
    size_t p;

    for (round = 0; round < 16; round++) {
        for (i = 0; i < n; i++)
            largest[i] = INT32_MIN;
        for (p = 0; p < count; p++) {
            const int32_t r = list[p].row, c = list[p].column;
            int power;

            frexp(list[p].value, &power);
            power += units[r] + units[c] - 1;
            largest[r] = power > largest[r] ? power : largest[r];
            largest[c] = power > largest[c] ? power : largest[c];
        }
        for (i = 0; i < n; i++)
            if (largest[i] != INT32_MIN) {
                units[i] -= largest[i] / 2;
                units[i] = units[i] > 511 ? 511 : units[i] < -511 ? -511 : units[i];
            }
    }
    free(largest);
}

typedef struct rows {
    long double *terms, *reach, *carried, *around, *rounding;
    int32_t *part, *tied;
    const int32_t *units;
    const check_item *list;
    size_t count;
    double least; /* sqrt(tol) */
} rows;

static long double size_of(const rows *r, size_t p)
{
    return ldexpl(fabsl((long double)r->list[p].value),
                  r->units[r->list[p].row] + r->units[r->list[p].column]);
}

/* terms, rounding: t, and t where large terms cancel. reach: how large z_j may be for its rows. */
static void find_terms(rows *r, const check_lcp *problem, const double *z, const double *w)
{
    const int32_t n = problem->M->rows;
    int32_t i;
    size_t p;

    for (i = 0; i < n; i++) {
        r->terms[i] = ldexpl(fabsl((long double)problem->q[i]), r->units[i]);
        r->reach[i] = r->carried[i] = ldexpl(fabsl((long double)z[i]), -r->units[i]);
    }
    for (p = 0; p < r->count; p++)
        r->terms[r->list[p].row] +=
            ldexpl(fabsl((long double)r->list[p].value * (long double)z[r->list[p].column]),
                   r->units[r->list[p].row]);
    for (i = 0; i < n; i++)
        r->rounding[i] = ldexpl(fabsl((long double)w[i]), r->units[i]) <= r->least * r->terms[i]
                             ? r->terms[i]
                             : 0;
    for (p = 0; p < r->count; p++) {
        const long double t = r->terms[r->list[p].row] / size_of(r, p);

        if (size_of(r, p) >= r->least && t > r->reach[r->list[p].column])
            r->reach[r->list[p].column] = t;
    }
}

/* Which bounds z_i is next to: bit 0 the lower, bit 1 the upper. */
static int bounds_near(const check_lcp *problem, const rows *r, int32_t i, double z, double tol)
{
    const long double near = ldexpl(tol * r->reach[i], r->units[i]);

    return ((long double)z - check_lower(problem, i) <= near) +
           2 * (check_upper(problem, i) - (long double)z <= near);
}

/* Parts of rows and, after them, columns: by entries of `least` and more, and where z_i and w_i are
 * tied. */
static void find_parts(rows *r, int32_t n, long double least)
{
    int32_t i;
    size_t p;
    int changed = 1;

    for (i = 0; i < 2 * n; i++)
        r->part[i] = i;
    while (changed) {
        changed = 0;
        for (i = 0; i < n; i++)
            if (r->tied[i] && r->part[i] != r->part[n + i]) {
                changed = 1;
                r->part[i] = r->part[n + i] =
                    r->part[i] < r->part[n + i] ? r->part[i] : r->part[n + i];
            }
        for (p = 0; p < r->count; p++) {
            int32_t *a = &r->part[r->list[p].row], *b = &r->part[n + r->list[p].column];

            if (size_of(r, p) < least)
                continue;
            changed |= *a != *b;
            *a = *b = *a < *b ? *a : *b;
        }
    }
}

static void find_neighbours(rows *r, const check_lcp *problem, const double *z, double tol)
{
    const int32_t n = problem->M->rows;
    int32_t i;
    size_t p;

    for (p = 0; p < r->count; p++) {
        const int32_t j = r->list[p].column;
        const long double t = r->rounding[r->list[p].row] / size_of(r, p);

        if (size_of(r, p) >= r->least && !bounds_near(problem, r, j, z[j], tol) &&
            t > r->carried[j])
            r->carried[j] = t;
    }
    for (i = 0; i < n; i++) {
        r->tied[i] = 0;
        r->around[i] = r->terms[i];
    }
    find_parts(r, n, 0x1p-40L); /* what is smaller is noise and ties nothing */
    for (i = 0; i < n; i++)
        r->tied[i] = r->part[i] == r->part[n + i];
    find_parts(r, n, r->least);
    for (p = 0; p < r->count; p++)
        r->around[r->list[p].row] += size_of(r, p) * r->carried[r->list[p].column];
}

/* Whether the library may have met the end of doubles in these units, or nearly so. */
static int is_extreme(const rows *r, int32_t i, long double largest)
{
    return abs(r->units[i]) >= 400 || abs(r->units[i]) + fabsl(log2l(largest)) >= 1300;
}

static long double violation(const check_lcp *problem, int32_t i, double w, int near)
{
    if (check_lower(problem, i) == check_upper(problem, i) || near == 3)
        return 0.0L;
    if (near == 1)
        return w < 0 ? -w : 0.0L;
    if (near == 2)
        return w > 0 ? w : 0.0L;
    return fabs(w);
}

/* ---- rows that are off by what they carry at an ordinary size of z ---- */

/* sides[part[i]] := the largest |q_i| rows_i of what row i, or column part[n + j], hangs together
 * with. */
static void raise_sides(const check_lcp *problem, const int32_t *part, const long double *row,
                        long double *size)
{
    const int32_t n = problem->M->rows;
    long double *of_part = check_allocate(2 * (size_t)n, sizeof *of_part);
    int32_t i;

    for (i = 0; i < n; i++)
        if (problem->q[i] != 0.0)
            of_part[part[i]] = fmaxl(of_part[part[i]], row[i] * fabsl((long double)problem->q[i]));
    for (i = 0; i < 2 * n; i++)
        size[i] = of_part[part[i]];
    free(of_part);
}

/* The same in units, NULL: the caller's, of what hangs together by any couplings. */
static void find_sides(const check_lcp *problem, const int32_t *units, long double *size)
{
    const int32_t n = problem->M->rows;
    int32_t *part = check_allocate(2 * (size_t)n, sizeof *part);
    long double *row = check_allocate((size_t)n, sizeof *row);

    for (int32_t i = 0; i < n; i++)
        row[i] = ldexpl(1.0L, units ? units[i] : 0);
    check_parts(problem->M, part);
    raise_sides(problem, part, row, size);
    free(row);
    free(part);
}

/* cap[j] := the largest right side that z_j hangs together with by significant couplings, in units
 * in which the largest entry of every row, then of every column, is 1. */
static void find_caps(const rows *r, const check_lcp *problem, long double *cap)
{
    const int32_t n = problem->M->rows;
    int32_t *part = check_allocate(2 * (size_t)n, sizeof *part);
    long double *row = check_allocate((size_t)n, sizeof *row);
    long double *column = check_allocate((size_t)n, sizeof *column);
    long double *size = check_allocate(2 * (size_t)n, sizeof *size);
    int32_t i;
    size_t p;
    int changed = 1;

    for (p = 0; p < r->count; p++)
        row[r->list[p].row] = fmaxl(row[r->list[p].row], fabsl((long double)r->list[p].value));
    for (i = 0; i < n; i++)
        row[i] = 1.0L / row[i];
    for (p = 0; p < r->count; p++)
        column[r->list[p].column] = fmaxl(
            column[r->list[p].column], row[r->list[p].row] * fabsl((long double)r->list[p].value));
    for (i = 0; i < 2 * n; i++)
        part[i] = i;
    while (changed)
        for (changed = 0, p = 0; p < r->count; p++) {
            const int32_t k = r->list[p].row, j = r->list[p].column;
            const int32_t first = part[k] < part[n + j] ? part[k] : part[n + j];

            if (row[k] * fabsl((long double)r->list[p].value) < r->least * column[j])
                continue;
            changed |= part[k] != part[n + j];
            part[k] = part[n + j] = first;
        }
    raise_sides(problem, part, row, size);
    for (i = 0; i < n; i++)
        cap[i] = size[n + i] / column[i];
    free(size);
    free(column);
    free(row);
    free(part);
}

/* The power of two at or below x; 1 for 0. */
static long double power_below(long double x)
{
    int exponent;

    if (x == 0.0L)
        return 1.0L;
    frexpl(x, &exponent);
    return ldexpl(1.0L, exponent - 1);
}

static void find_allowed(const rows *r, const check_lcp *problem, long double *allowed)
{
    const int32_t n = problem->M->rows;
    long double *raw = check_allocate(2 * (size_t)n, sizeof *raw);
    long double *scaled = check_allocate(2 * (size_t)n, sizeof *scaled);
    long double *diagonal = check_allocate((size_t)n, sizeof *diagonal);
    long double *cap = check_allocate((size_t)n, sizeof *cap);
    int32_t i;
    size_t p;

    find_caps(r, problem, cap);
    find_sides(problem, NULL, raw);
    find_sides(problem, r->units, scaled);
    for (i = 0; i < n; i++)
        allowed[i] = ldexpl(fabsl((long double)problem->q[i]), r->units[i]);
    for (p = 0; p < r->count; p++) {
        const int32_t j = r->list[p].column;
        long double z = r->carried[j];

        if (problem->q[r->list[p].row] != 0.0)
            z = fminl(z, fminl(ldexpl(cap[j], -r->units[j]), 2.0L * power_below(scaled[n + j])));
        allowed[r->list[p].row] += size_of(r, p) * z;
        if (r->list[p].row == j)
            diagonal[j] = size_of(r, p);
    }
    for (i = 0; i < n; i++) {
        const long double omega = power_below(scaled[i]);

        if (diagonal[i] >= r->least)
            allowed[i] = fmaxl(allowed[i], omega);
        allowed[i] =
            fmaxl(r->least * allowed[i], 0x1p-52L * fminl(omega, ldexpl(raw[i], r->units[i])));
    }
    free(cap);
    free(diagonal);
    free(scaled);
    free(raw);
}

/* Rows with q_i = 0 of which all variables may be 0 as far as the other rows can tell. */
static void find_homogeneous(const rows *r, const check_lcp *problem, const long double *allowed,
                             int32_t *met)
{
    const int32_t n = problem->M->rows;
    int32_t *missed = check_allocate((size_t)n, sizeof *missed);
    int32_t i;
    size_t p;
    int changed = 1;

    for (i = 0; i < n; i++) {
        met[i] = problem->q[i] == 0.0;
        missed[i] = check_lower(problem, i) > 0 || check_upper(problem, i) < 0;
    }
    while (changed) {
        changed = 0;
        for (p = 0; p < r->count; p++) {
            const int32_t k = r->list[p].row, j = r->list[p].column;

            missed[j] |= !met[k] && size_of(r, p) * r->carried[j] > allowed[k];
            if (met[k] && missed[j]) {
                met[k] = 0;
                changed = 1;
            }
        }
    }
    free(missed);
}

/* The largest violation of such a row beside what is allowed. */
static double unmet(const rows *r, const check_lcp *problem, const double *z, const double *w,
                    double tol)
{
    const int32_t n = problem->M->rows;
    long double *allowed = check_allocate((size_t)n, sizeof *allowed);
    int32_t *met = check_allocate((size_t)n, sizeof *met);
    double most = 0.0;
    int32_t i;

    find_allowed(r, problem, allowed);
    find_homogeneous(r, problem, allowed, met);
    for (i = 0; i < n; i++) {
        const long double v =
            ldexpl(violation(problem, i, w[i], bounds_near(problem, r, i, z[i], tol)), r->units[i]);

        if (!met[i] && v > 0)
            check_raise(&most, (double)(v / allowed[i]));
    }
    free(met);
    free(allowed);
    return most;
}

static double own_residual(rows *r, const check_lcp *problem, const double *z, const double *w,
                           double tol)
{
    const long double floor = fmax(1e-5, 16 * 0x1p-52 / tol);
    const int32_t n = problem->M->rows;
    long double largest = 0.0L;
    double own;
    int32_t i, k;

    find_terms(r, problem, z, w);
    own = tol * unmet(r, problem, z, w, tol);
    find_neighbours(r, problem, z, tol);
    for (i = 0; i < n; i++)
        largest = r->terms[i] > largest ? r->terms[i] : largest;
    for (i = 0; i < n; i++) {
        const long double v =
            ldexpl(violation(problem, i, w[i], bounds_near(problem, r, i, z[i], tol)), r->units[i]);
        long double most = 0.0L;

        if (!(v > 0))
            continue;
        for (k = 0; k < n; k++)
            if (r->part[k] == r->part[i] && r->rounding[k] > most)
                most = r->rounding[k];
        check_raise(&own,
                    is_extreme(r, i, largest) || r->around[i] + floor * most < 1e-250L * largest
                        ? NAN
                        : (double)(v / (r->around[i] + floor * most)));
    }
    return own;
}

double check_own(const check_lcp *problem, const double *z, const double *w, double tol)
{
    const size_t n = (size_t)problem->M->rows, bytes = sizeof(long double);
    size_t count;
    check_item *list = check_items(problem->M, &count);
    int32_t *units = check_allocate(n, sizeof *units);
    rows r = {check_allocate(n, bytes),
              check_allocate(n, bytes),
              check_allocate(n, bytes),
              check_allocate(n, bytes),
              check_allocate(n, bytes),
              check_allocate(2 * n, sizeof *r.part),
              check_allocate(n, sizeof *r.tied),
              units,
              list,
              count,
              sqrt(tol)};
    double own;

    check_witness_start(problem->M, problem->scaling, units);
    find_units(list, count, problem->M->rows, units);
    own = own_residual(&r, problem, z, w, tol);
    free(r.tied);
    free(r.part);
    free(r.rounding);
    free(r.around);
    free(r.carried);
    free(r.reach);
    free(r.terms);
    free(units);
    free(list);
    return own;
}
