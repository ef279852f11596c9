/* Which units the second witness starts from: those of the equilibration, and the caller's where a
 * diagonal or a coupling that units were found from may be noise, or where units lose what is as
 * large as any (witness.c). */
#include "linalg/witness.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/outcome.h"
#include "linalg/scale.h"

/* A diagonal below this is noise beside a coupling. */
#define NOISE_DIAGONAL 0x1p-38

/* log2 of an entry that no unit explains. */
#define UNEXPLAINED 20

/* What is this much of the largest entries is one of them; log2 of what is lost beside units. */
#define LARGE_SHARE 0x1p-10
#define LOST 30

/* In the caller's units, and in any. */
static int32_t is_noise(double diagonal, double other, double coupling)
{
    return diagonal != 0.0 && diagonal <= NOISE_DIAGONAL * coupling &&
           diagonal * other <= NOISE_DIAGONAL * coupling * coupling;
}

/* largest[i] := the largest |M_ij| 2^e_j, or |M_ji| 2^e_j, of a dense matrix; e = 0 where units is
 * NULL. */
static void find_largest_dense(perp__witness *t, const perp__matrix *M, const int32_t *units,
                               double *largest)
{
    double *D = t->sizes, *in_rows = D + M->rows, *in_columns = in_rows + M->rows;

    for (int32_t i = 0; i < M->rows; i++)
        D[i] = units ? perp__power_of_two(units[i]) : 1.0;
    perp__largest_entries(M, D, in_rows, in_columns);
    for (int32_t i = 0; i < M->rows; i++)
        largest[i] = in_rows[i] > in_columns[i] ? in_rows[i] : in_columns[i];
}

/* around := the largest entry of every row and column. */
static void find_largest(perp__witness *t, const perp__matrix *M)
{
    if (!M->column_starts) {
        find_largest_dense(t, M, NULL, t->around);
        return;
    }
    memset(t->around, 0, (size_t)M->rows * sizeof *t->around);
    for (perp__cursor c = perp__first(M); perp__advance(&c);) {
        perp__raise_to(&t->around[c.i], fabs(c.value));
        perp__raise_to(&t->around[c.j], fabs(c.value));
    }
}

/* Whether diagonal i of a dense matrix is noise. */
static int32_t is_noise_in_lines(const perp__matrix *M, const double *diagonal, int32_t i)
{
    int32_t found = 0;

    for (int32_t j = 0; j < M->rows && !found; j++) {
        const double above = fabs(perp__entry(M, i, j)), below = fabs(perp__entry(M, j, i));

        found = j != i && is_noise(diagonal[i], diagonal[j], above > below ? above : below);
    }
    return found;
}

/* The same as below. Only a diagonal that is small beside the largest coupling can be noise, and no
 * coupling is unexplained in rows of small norm. */
static int32_t find_noise_dense(perp__witness *t, const perp__witness_point *p, const int32_t *e)
{
    const double *size = t->carried;
    double *largest = t->wrong;
    int32_t found = 0, small = e == p->exponents;

    for (int32_t i = 0; i < p->M->rows; i++) {
        t->is_free[i] = size[i] != 0.0 && size[i] <= NOISE_DIAGONAL * t->around[i] &&
                        is_noise_in_lines(p->M, size, i);
        found |= t->is_free[i];
        small = small && p->row_norms[i] < perp__power_of_two(UNEXPLAINED);
    }
    if (small || found)
        return found;
    find_largest_dense(t, p->M, e, largest);
    for (int32_t i = 0; i < p->M->rows; i++)
        found |= largest[i] > 0.0 && perp__exponent_of(largest[i]) + e[i] >= UNEXPLAINED;
    return found;
}

/* Marks the diagonals that are noise beside a coupling of their row or of their column that is
 * large beside both its diagonals: units that are far apart make none such. Returns whether there
 * are any, or couplings that no unit explains: that which a row's unit was found from was noise. */
static int32_t find_noise(perp__witness *t, const perp__witness_point *p)
{
    int32_t *e = t->units[1].exponents, *noise = t->is_free, found = 0;
    double *size = t->carried;

    for (int32_t i = 0; i < p->M->rows; i++) {
        size[i] = fabs(perp__diagonal_entry(p->M, i));
        noise[i] = 0;
    }
    if (!p->M->column_starts && p->row_norms && !p->balanced)
        return find_noise_dense(t, p, p->exponents);
    perp__equilibrate_but(p->M, NULL, e, t->omegas);
    if (!p->M->column_starts)
        return find_noise_dense(t, p, e);
    for (perp__cursor c = perp__first(p->M); perp__advance(&c);) {
        const double coupling = fabs(c.value);

        if (coupling == 0.0 || c.i == c.j)
            continue;
        noise[c.i] |= is_noise(size[c.i], size[c.j], coupling);
        noise[c.j] |= is_noise(size[c.j], size[c.i], coupling);
        found |= noise[c.i] | noise[c.j] |
                 (perp__exponent_of(coupling) + e[c.i] + e[c.j] >= UNEXPLAINED);
    }
    return found;
}

/* Whether a coupling among the largest of both its rows is lost in the units. */
static int32_t is_lost(const perp__witness_point *p, const double *largest, double coupling,
                       int32_t i, int32_t j)
{
    const double size = fabs(coupling);

    return size > 0.0 && size >= LARGE_SHARE * fmax(largest[i], largest[j]) &&
           perp__exponent_of(size) + p->exponents[i] + p->exponents[j] <= -LOST;
}

/* The squares of both its units take 2^(10 - LOST) off the largest of its rows then, on an average:
 * with left_i the exponent of what they leave, left_i + left_j <= 2 (10 - LOST). */
static int32_t is_any_lost(perp__witness *t, const perp__witness_point *p)
{
    int32_t *left = t->omegas, most = 0, found = 0;

    for (int32_t i = 0; i < p->M->rows; i++) {
        left[i] = t->around[i] > 0.0 ? perp__exponent_of(t->around[i]) + 2 * p->exponents[i] : 0;
        most = left[i] < most ? left[i] : most;
    }
    most = 2 * (perp__exponent_of(1.0 / LARGE_SHARE) - LOST) - most;
    for (int32_t j = 0; j < p->M->rows && !found; j++) {
        const perp__line l = perp__line_of(p->M, j);

        for (int32_t k = 0; left[j] <= most && k < l.count && !found; k++)
            found = is_lost(p, t->around, l.values[k], l.indices ? l.indices[k] : k, j);
    }
    return found;
}

/* The caller's units tell what is noise; nobody chose any that are very far apart. */
void perp__witness_find_starts(perp__witness *t, const perp__witness_point *p)
{
    int32_t farthest = 0, i;

    if (p->scaling)
        find_largest(t, p->M);
    t->count = p->scaling && find_noise(t, p) ? 2 : 1;
    for (i = 0; i < p->M->rows; i++) {
        t->units[0].exponents[i] = p->exponents[i];
        t->units[1].exponents[i] = 0;
        farthest = abs(p->exponents[i]) > farthest ? abs(p->exponents[i]) : farthest;
    }
    if (t->count == 2 && farthest > PERP__MODERATE_UNIT / 2)
        perp__equilibrate_but(p->M, t->is_free, t->units[1].exponents, t->omegas);
    if (p->scaling && t->count == 1 && farthest <= PERP__MODERATE_UNIT / 2 && is_any_lost(t, p))
        t->count = 2;
    t->known = 1;
    t->balanced = 0;
    t->tol = 0.0;
}
