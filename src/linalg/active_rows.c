#include "linalg/active_rows.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/lanes/multiversion.h"
#include "linalg/matrix.h"

void perp__active_rows_layout(perp__active_rows *active, perp__arena *arena, size_t entries,
                              size_t most, size_t n)
{
    active->rows = perp__arena_take(arena, entries, sizeof(double));
    PERP__DOUBLES(arena, most, &active->targets, &active->norms);
    active->taken = perp__arena_take(arena, most, sizeof(int32_t));
    active->basis = perp__arena_take(arena, n, n * sizeof(double));
    PERP__DOUBLES(arena, n, &active->particular, &active->components, &active->unit);
}

void perp__active_rows_begin(perp__active_rows *active, int32_t n)
{
    active->n = n;
    active->count = active->rank = 0;
}

double *perp__active_rows_next(const perp__active_rows *active)
{
    return active->rows + (size_t)active->count * (size_t)active->n;
}

void perp__active_rows_add(perp__active_rows *active, double target)
{
    double *row = perp__active_rows_next(active), length;
    const double largest = perp__largest(row, active->n);

    if (largest == 0.0)
        return;
    for (int32_t i = 0; i < active->n; i++) /* squares must not leave the range of doubles */
        row[i] /= largest;
    length = sqrt(perp__dot(row, row, active->n));
    for (int32_t i = 0; i < active->n; i++)
        row[i] /= length;
    active->targets[active->count++] = target / largest / length;
}

/* ---- the modified Gram-Schmidt process with threshold pivoting ---- */

/* The first row with at least this share of the largest remainder is taken: among rows that serve
 * equally well the order of the caller decides, not rounding. */
#define PIVOT_THRESHOLD 0.5

PERP__KERNEL static void add(double *y, double s, const double *x, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        y[i] += s * x[i];
}

/* What follows is compiled for the coordinates of one body, and for any number. */
enum { BODY = 6 };

/* Where a vector is not 0: rows of large systems mostly are, those of one body need no search. Sums
 * over that are the same bits. */
typedef struct span {
    int32_t first, count;
} span;

PERP__KERNEL static span span_of(const double *x, int32_t n)
{
    span s = {0, n};

    if (n == BODY)
        return s;
    while (s.count > 0 && x[s.first + s.count - 1] == 0.0)
        s.count--;
    while (s.count > 0 && x[s.first] == 0.0) {
        s.first++;
        s.count--;
    }
    return s;
}

PERP__KERNEL static double length_of(const double *row, int32_t n)
{
    const span s = span_of(row, n);

    return sqrt(perp__dot(row + s.first, row + s.first, s.count));
}

/* Takes row `pick` as the next vector q of the basis. Returns the component of y_0 along it. */
PERP__KERNEL static double new_direction(const perp__active_rows *active, double *q, int32_t pick,
                                         int32_t n)
{
    const double *row = active->rows + (size_t)pick * (size_t)n, norm = active->norms[pick];
    double eta = active->targets[pick] / norm;
    double length;

    for (int32_t i = 0; i < n; i++)
        q[i] = row[i] / norm;
    for (int32_t k = 0; k < active->rank;
         k++) { /* a second time: the first leaves rounding / norm */
        const double *b = active->basis + (size_t)k * (size_t)n;
        const span s = span_of(b, n);
        double share = perp__dot(b + s.first, q + s.first, s.count);

        if (share == 0.0)
            continue;
        add(q + s.first, -share, b + s.first, s.count);
        eta -= share * perp__dot(b + s.first, active->particular + s.first, s.count);
    }
    length = length_of(q, n);
    for (int32_t i = 0; i < n; i++)
        q[i] /= length;
    return eta / length;
}

PERP__KERNEL static void solve(perp__active_rows *active, int32_t n)
{
    memset(active->taken, 0, (size_t)active->count * sizeof *active->taken);
    memset(active->particular, 0, (size_t)n * sizeof *active->particular);
    for (int32_t i = 0; i < active->count; i++)
        active->norms[i] = length_of(active->rows + (size_t)i * (size_t)n, n);
    for (active->rank = 0; active->rank < n; active->rank++) {
        double *q = active->basis + (size_t)active->rank * (size_t)n, largest = 0.0, eta;
        int32_t pick = 0;
        span s;

        /* 1. The row to take next: none with a norm that is no number, or too large for one. */
        for (int32_t i = 0; i < active->count; i++)
            if (active->norms[i] > largest && active->norms[i] <= DBL_MAX)
                largest = active->norms[i];
        if (!(largest > PERP__RANK_TOLERANCE))
            break;
        while (
            !(active->norms[pick] >= PIVOT_THRESHOLD * largest && active->norms[pick] <= DBL_MAX))
            pick++;
        /* 2. What is left of it is a direction of the basis. */
        eta = new_direction(active, q, pick, n);
        active->taken[pick] = 1;
        active->norms[pick] = 0.0;
        s = span_of(q, n);
        add(active->particular + s.first, eta, q + s.first, s.count);
        /* 3. The other rows lose it. */
        for (int32_t i = 0; i < active->count; i++) {
            double *row = active->rows + (size_t)i * (size_t)n;
            const double share =
                active->taken[i] ? 0.0 : perp__dot(row + s.first, q + s.first, s.count);

            if (share == 0.0)
                continue;
            add(row + s.first, -share, q + s.first, s.count);
            active->targets[i] -= share * eta;
            active->norms[i] = length_of(row, n);
        }
    }
}

void perp__active_rows_solve(perp__active_rows *active)
{
    if (active->n == BODY)
        solve(active, BODY);
    else
        solve(active, active->n);
}

/* y -= q q'y */
PERP__KERNEL static void project_from(const double *q, int32_t n, double *y)
{
    const span s = span_of(q, n);
    const double share = perp__dot(q + s.first, y + s.first, s.count);

    if (share != 0.0)
        add(y + s.first, -share, q + s.first, s.count);
}

/* Twice: the second pass removes what rounding of the first one left. */
void perp__project_out(const double *basis, int32_t rank, int32_t n, double *y)
{
    for (int32_t k = 0; k < 2 * rank; k++)
        project_from(basis + (size_t)(k % rank) * (size_t)n, n, y);
}

/* ---- what the rows leave free ---- */

void perp__active_rows_free(perp__active_rows *active, double *y)
{
    perp__project_out(active->basis, active->rank, active->n, y);
    for (int32_t k = 0; k < active->n; k++)
        y[k] += active->particular[k];
    /* exactly 0 where other bodies' rows alone have targets */
    for (int32_t k = 0; k < active->rank; k++)
        active->components[k] =
            perp__dot(active->basis + (size_t)k * (size_t)active->n, active->particular, active->n);
}

PERP__KERNEL static bool fix(perp__active_rows *active, int32_t first, int32_t count, int32_t n)
{
    double *unit = active->unit, share = 0.0;

    for (int32_t k = 0; k < active->rank; k++) {
        const double *q = active->basis + (size_t)k * (size_t)n;
        const double along = perp__dot(q + first, unit + first, count);

        if (along != 0.0 && active->components[k] != 0.0)
            return 0;
        share += along * along;
    }
    if (!(share > 0.5)) /* far off, as most are: not worth the exact test */
        return 0;
    for (int32_t k = 0; k < active->rank; k++) /* once: what rounding leaves is far below */
        project_from(active->basis + (size_t)k * (size_t)n, n, unit);
    return sqrt(perp__dot(unit, unit, n)) <= PERP__SPAN;
}

bool perp__active_rows_fix(perp__active_rows *active, int32_t first, int32_t count)
{
    return active->n == BODY && count == BODY ? fix(active, 0, BODY, BODY)
                                              : fix(active, first, count, active->n);
}
