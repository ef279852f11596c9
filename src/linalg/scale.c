/* Symmetric equilibration: breadth-first from the rows whose diagonal fixes their scale.
 *
 * All arithmetic is on the binary exponents, so that scaling row and column i of M by 2^k moves e_i
 * by exactly -k and no rounding or overflow can interfere. Level by level, each level one pass over
 * the columns: a row's couplings lie in its row and in its column, and CSC has no rows. */
#include "linalg/scale.h"

#include <math.h>
#include <string.h>

enum { LARGEST = 511, UNSET = -1, NO_COUPLING = INT32_MIN };

double perp__power_of_two(int32_t e)
{
    const uint64_t bits = (uint64_t)(e + 1023) << 52;
    double power;

    memcpy(&power, &bits, sizeof power);
    return power;
}

/* floor(log2 |value|), value finite and not zero. */
static int32_t exponent_of(double value)
{
    uint64_t bits;

    memcpy(&bits, &value, sizeof bits);
    bits = bits >> 52 & 0x7ff;
    return bits != 0 ? (int32_t)bits - 1023 : ilogb(value);
}

static int32_t clamp(int32_t e)
{
    return e > LARGEST ? LARGEST : e < -LARGEST ? -LARGEST : e;
}

/* The e with |diagonal| 2^(2e) in [1/2, 2): minus half of floor(log2) + 1, rounded down. */
static int32_t unit_diagonal(double diagonal)
{
    const int32_t p = exponent_of(diagonal) + 1;

    return clamp(-((p - (p & 1)) / 2));
}

/* Column j of M, or row j where that is the contiguous one: couplings count both ways. */
typedef struct line {
    int32_t count;
    const double *values;
    const int32_t *indices; /* NULL: 0, 1, 2, ... */
} line;

static line line_of(const perp__matrix *M, int32_t j)
{
    line l;

    if (M->column_starts) {
        l.count = M->column_starts[j + 1] - M->column_starts[j];
        l.values = l.count > 0 ? M->values + M->column_starts[j] : NULL;
        l.indices = l.count > 0 ? M->row_indices + M->column_starts[j] : NULL;
    } else {
        l.count = M->rows;
        l.values = M->values + (size_t)j * (M->row_stride == 1 ? M->column_stride : M->row_stride);
        l.indices = NULL;
    }
    return l;
}

static double diagonal_of(const perp__matrix *M, int32_t j)
{
    const line l = line_of(M, j);
    int32_t low = 0, high = l.count;

    if (!M->column_starts)
        return l.values[j];
    while (low < high) {
        const int32_t middle = low + (high - low) / 2;

        if (l.indices[middle] < j)
            low = middle + 1;
        else
            high = middle;
    }
    return low < l.count && l.indices[low] == j ? l.values[low] : 0.0;
}

/* The search: level[i] is UNSET or the level row i was reached on, reach[i] the largest exponent of
 * row i's couplings to the level that is being left, with that level's scaling applied. */
typedef struct search {
    const perp__matrix *M;
    int32_t *exponents;
    int32_t *level;
    int32_t *reach;
    int32_t unset; /* rows that are left */
} search;

static void set(search *s, int32_t i, int32_t e, int32_t level)
{
    s->exponents[i] = clamp(e);
    s->level[i] = level;
    s->unset--;
}

/* Every coupling between a row of `level` and an unset one. */
static void couple_line(search *s, int32_t j, int32_t level)
{
    const line l = line_of(s->M, j);
    const int32_t unset = s->level[j] == UNSET;
    int32_t k;

    if (!unset && s->level[j] != level)
        return;
    for (k = 0; k < l.count; k++) {
        const int32_t i = l.indices ? l.indices[k] : k;
        int32_t from = j, to = i, coupling;

        if (unset) {
            from = i;
            to = j;
        }
        if (s->level[from] != level || s->level[to] != UNSET || l.values[k] == 0.0)
            continue;
        coupling = exponent_of(l.values[k]) + s->exponents[from];
        if (coupling > s->reach[to])
            s->reach[to] = coupling;
    }
}

/* From the rows that are on level 0 to all that hang together with them. */
static void spread(search *s)
{
    const int32_t n = s->M->rows;
    int32_t level, i, j, reached = 1;

    for (level = 0; reached > 0 && s->unset > 0; level++) {
        for (i = 0; i < n; i++)
            s->reach[i] = NO_COUPLING;
        for (j = 0; j < n; j++)
            couple_line(s, j, level);
        reached = 0;
        for (i = 0; i < n; i++) {
            if (s->level[i] != UNSET || s->reach[i] == NO_COUPLING)
                continue;
            set(s, i, -s->reach[i], level + 1);
            reached++;
        }
    }
}

/* Starts at every unset row whose diagonal has the sign, and spreads. */
static void start_at_diagonals(search *s, double sign)
{
    int32_t i;

    for (i = 0; i < s->M->rows; i++) {
        const double diagonal = s->level[i] == UNSET ? sign * diagonal_of(s->M, i) : 0.0;

        if (diagonal > 0.0)
            set(s, i, unit_diagonal(diagonal), 0);
    }
    spread(s);
}

/* Lowest index of i's component so far, in a forest of parents with lower indices. */
static int32_t root_of(int32_t *parents, int32_t i)
{
    while (parents[i] != i) {
        parents[i] = parents[parents[i]];
        i = parents[i];
    }
    return i;
}

/* What is left has no diagonal at all: each component starts at its lowest index. */
static void start_at_lowest(search *s)
{
    const int32_t n = s->M->rows;
    int32_t *parents = s->reach;
    int32_t i, j, k;

    for (i = 0; i < n; i++)
        parents[i] = i;
    for (j = 0; j < n; j++) {
        const line l = line_of(s->M, j);

        if (s->level[j] != UNSET)
            continue;
        for (k = 0; k < l.count; k++) {
            if (l.values[k] == 0.0)
                continue;
            i = root_of(parents, l.indices ? l.indices[k] : k);
            if (i < root_of(parents, j))
                parents[root_of(parents, j)] = i;
            else
                parents[i] = root_of(parents, j);
        }
    }
    for (i = 0; i < n; i++)
        if (s->level[i] == UNSET && parents[i] == i)
            set(s, i, 0, 0);
    spread(s);
}

void perp__equilibrate(const perp__matrix *M, int32_t enabled, int32_t *exponents, int32_t *work)
{
    search s;
    int32_t i;

    s.M = M;
    s.exponents = exponents;
    s.level = work;
    s.reach = work + M->rows;
    s.unset = M->rows;
    for (i = 0; i < M->rows; i++) {
        exponents[i] = 0;
        s.level[i] = UNSET;
    }
    if (!enabled)
        return;
    start_at_diagonals(&s, 1.0);
    if (s.unset > 0)
        start_at_diagonals(&s, -1.0);
    if (s.unset > 0)
        start_at_lowest(&s);
}
