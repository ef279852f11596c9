/* Symmetric equilibration: breadth-first from the rows whose diagonal fixes their scale.
 *
 * All arithmetic is on the binary exponents, so that scaling row and column i of M by 2^k moves e_i
 * by exactly -k and no rounding or overflow can interfere.
 *
 * A row's couplings lie in its row and in its column, and CSC has no rows. Where the pattern is
 * symmetric, row j is read off column j and its mirror images: the search costs one look at each
 * entry. Where it is not, every level costs a pass over the columns that are left. */
#include "linalg/scale.h"

#include <math.h>
#include <string.h>

enum { LARGEST = 511, UNSET = -1 };

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

/* Where entry i of column j is stored, or NULL. */
static const double *entry_of(const perp__matrix *M, int32_t i, int32_t j)
{
    const line l = line_of(M, j);
    int32_t low = 0, high = l.count;

    if (!M->column_starts)
        return l.values + i;
    while (low < high) {
        const int32_t middle = low + (high - low) / 2;

        if (l.indices[middle] < i)
            low = middle + 1;
        else
            high = middle;
    }
    return low < l.count && l.indices[low] == i ? l.values + low : NULL;
}

static int has_symmetric_pattern(const perp__matrix *M)
{
    int32_t j, k;

    for (j = 0; M->column_starts && j < M->columns; j++)
        for (k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            if (!entry_of(M, j, M->row_indices[k]))
                return 0;
    return 1;
}

/* The rows of one level follow each other in the queue. Until a level is complete, `exponents`
 * holds for its rows the largest exponent of a coupling to the level before, scaled on that side.
 */
typedef struct search {
    const perp__matrix *M;
    int32_t *exponents;
    int32_t *level; /* or UNSET */
    int32_t *queue;
    int32_t queued;
    int32_t unset; /* rows that are left */
    int32_t symmetric;
} search;

static void enqueue(search *s, int32_t i, int32_t exponent, int32_t level)
{
    s->exponents[i] = exponent;
    s->level[i] = level;
    s->queue[s->queued++] = i;
    s->unset--;
}

static void couple(search *s, int32_t from, int32_t to, double value)
{
    const int32_t level = s->level[from] + 1;
    int32_t exponent;

    if (value == 0.0)
        return;
    exponent = exponent_of(value) + s->exponents[from];
    if (s->level[to] == UNSET)
        enqueue(s, to, exponent, level);
    else if (s->level[to] == level && exponent > s->exponents[to])
        s->exponents[to] = exponent;
}

/* The couplings of row j to rows after its level: those in its column, and their mirror images. */
static void couple_column(search *s, int32_t j)
{
    const line l = line_of(s->M, j);
    int32_t k;

    for (k = 0; k < l.count; k++) {
        const int32_t i = l.indices ? l.indices[k] : k;

        if (s->level[i] != UNSET && s->level[i] <= s->level[j])
            continue;
        couple(s, j, i, l.values[k]);
        if (s->symmetric)
            couple(s, j, i, *entry_of(s->M, j, i));
    }
}

/* The couplings in the rows of `level`: somewhere in the columns after it. */
static void couple_rows(search *s, int32_t level)
{
    int32_t j, k;

    for (j = 0; j < s->M->columns; j++) {
        const line l = line_of(s->M, j);

        if (s->level[j] != UNSET && s->level[j] <= level)
            continue;
        for (k = 0; k < l.count; k++)
            if (s->level[l.indices[k]] == level)
                couple(s, l.indices[k], j, l.values[k]);
    }
}

/* From the rows in the queue, on level 0, to all that hang together with them. */
static void spread(search *s)
{
    int32_t begin = 0, end, level, k;

    for (level = 0; begin < s->queued && s->unset > 0; level++) {
        end = s->queued;
        for (k = begin; k < end; k++)
            couple_column(s, s->queue[k]);
        if (!s->symmetric)
            couple_rows(s, level);
        for (k = end; k < s->queued; k++)
            s->exponents[s->queue[k]] = clamp(-s->exponents[s->queue[k]]);
        begin = end;
    }
    s->queued = 0;
}

/* Puts every unset row whose diagonal has the sign on level 0. */
static void start_at_diagonals(search *s, double sign)
{
    int32_t i;

    for (i = 0; i < s->M->rows; i++) {
        const double *diagonal = entry_of(s->M, i, i);

        if (s->level[i] == UNSET && diagonal && sign * *diagonal > 0.0)
            enqueue(s, i, unit_diagonal(*diagonal), 0);
    }
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

static void join(int32_t *parents, int32_t i, int32_t j)
{
    const int32_t a = root_of(parents, i), b = root_of(parents, j);

    if (a < b)
        parents[b] = a;
    else
        parents[a] = b;
}

/* What is left has no diagonal at all: each component starts at its lowest index. */
static void start_at_lowest(search *s)
{
    const int32_t n = s->M->rows;
    int32_t *parents = s->queue;
    int32_t i, j, k;

    for (i = 0; i < n; i++)
        parents[i] = i;
    for (j = 0; j < n; j++) {
        const line l = line_of(s->M, j);

        for (k = 0; k < l.count && s->level[j] == UNSET; k++)
            if (l.values[k] != 0.0)
                join(parents, l.indices ? l.indices[k] : k, j);
    }
    /* the queue grows into parents that have been read: no more roots than rows up to here */
    for (i = 0; i < n; i++)
        if (s->level[i] == UNSET && parents[i] == i)
            enqueue(s, i, 0, 0);
}

void perp__equilibrate(const perp__matrix *M, int32_t enabled, int32_t *exponents, int32_t *work)
{
    search s;
    int32_t i;

    s.M = M;
    s.exponents = exponents;
    s.level = work;
    s.queue = work + M->rows;
    s.queued = 0;
    s.unset = M->rows;
    for (i = 0; i < M->rows; i++) {
        exponents[i] = 0;
        s.level[i] = UNSET;
    }
    if (!enabled)
        return;
    start_at_diagonals(&s, 1.0);
    if (s.unset == 0)
        return;
    s.symmetric = has_symmetric_pattern(M);
    spread(&s);
    start_at_diagonals(&s, -1.0);
    spread(&s);
    start_at_lowest(&s);
    spread(&s);
}
