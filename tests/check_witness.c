/* The own residual of DESIGN, row by row, from the caller's data; long double throughout, so that
 * its own rounding is far below any tolerance it is compared with. */
#include "check.h"

#include <math.h>
#include <stdlib.h>

/* log2 of the scales that bring the largest entry of every row and column of |M| near 1: from the
 * symmetric equilibration on, sixteen rounds of halving its exponent. */
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
    long double *terms, *carried, *around;
    int32_t *part;
} rows;

static void fill(rows *r, const check_lcp *problem, const check_item *list, size_t count,
                 const int32_t *units, const double *z, double tol)
{
    const int32_t n = problem->M->rows;
    int32_t i;
    size_t p;
    int changed = 1;

    for (i = 0; i < n; i++) {
        r->carried[i] = ldexpl(fabsl((long double)z[i]), -units[i]);
        r->terms[i] = ldexpl(fabsl((long double)problem->q[i]), units[i]);
        r->part[i] = i;
    }
    for (p = 0; p < count; p++)
        r->terms[list[p].row] += ldexpl(
            fabsl((long double)list[p].value * (long double)z[list[p].column]), units[list[p].row]);
    for (p = 0; p < count; p++) {
        const int32_t k = list[p].row, j = list[p].column;
        const long double size = ldexpl(fabsl((long double)list[p].value), units[k] + units[j]);

        if (size >= sqrt(tol) && r->terms[k] / size > r->carried[j])
            r->carried[j] = r->terms[k] / size;
    }
    for (i = 0; i < n; i++)
        r->around[i] = r->terms[i];
    for (p = 0; p < count; p++)
        r->around[list[p].row] +=
            ldexpl(fabsl((long double)list[p].value), units[list[p].row] + units[list[p].column]) *
            r->carried[list[p].column];
    while (changed)
        for (changed = 0, p = 0; p < count; p++) {
            int32_t *a = &r->part[list[p].row], *b = &r->part[list[p].column];

            if (ldexpl(fabsl((long double)list[p].value),
                       units[list[p].row] + units[list[p].column]) < sqrt(tol))
                continue;
            changed |= *a != *b;
            *a = *b = *a < *b ? *a : *b;
        }
}

static long double violation(const check_lcp *problem, const rows *r, int32_t i, int32_t unit,
                             double z, double w, double tol)
{
    const long double near = ldexpl(tol * r->carried[i], unit);
    const double l = check_lower(problem, i), u = check_upper(problem, i);

    if (l == u || ((long double)z - l <= near && (long double)u - z <= near))
        return 0.0;
    if ((long double)z - l <= near)
        return w < 0 ? -w : 0.0;
    if ((long double)u - z <= near)
        return w > 0 ? w : 0.0;
    return fabs(w);
}

double check_own(const check_lcp *problem, const double *z, const double *w, double tol)
{
    const int32_t n = problem->M->rows;
    size_t count, bytes = sizeof(long double);
    check_item *list = check_items(problem->M, &count);
    int32_t *units = check_allocate((size_t)n, sizeof *units), i, k;
    rows r = {check_allocate((size_t)n, bytes), check_allocate((size_t)n, bytes),
              check_allocate((size_t)n, bytes), check_allocate((size_t)n, sizeof *r.part)};
    const long double floor = fmax(1e-5, 16 * 0x1p-52 / tol);
    long double largest = 0.0;
    double own = 0.0;

    check_exponents(problem->M, problem->scaling, units);
    find_units(list, count, n, units);
    fill(&r, problem, list, count, units, z, tol);
    for (i = 0; i < n; i++)
        largest = r.terms[i] > largest ? r.terms[i] : largest;
    for (i = 0; i < n; i++) {
        const long double v = violation(problem, &r, i, units[i], z[i], w[i], tol);
        long double most = 0.0;

        for (k = 0; k < n && v > 0; k++)
            if (r.part[k] == r.part[i] && r.terms[k] > most)
                most = r.terms[k];
        if (v > 0 && r.around[i] + floor * most < 1e-250L * largest)
            own = NAN;
        if (v > 0)
            check_raise(&own, (double)(ldexpl(v, units[i]) / (r.around[i] + floor * most)));
    }
    free(r.part);
    free(r.around);
    free(r.carried);
    free(r.terms);
    free(units);
    free(list);
    return own;
}
