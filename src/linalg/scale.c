/* Symmetric equilibration: breadth-first from the rows whose diagonal fixes their scale, then
 * balanced where that leaves entries that no unit explains.
 *
 * All arithmetic is on the binary exponents, so that scaling row and column i of M by 2^k moves e_i
 * by exactly -k and no rounding or overflow can interfere.
 *
 * A row's couplings lie in its row and in its column, and CSC has no rows. Where the pattern is
 * symmetric, row j is read off column j and its mirror images: the search costs one look at each
 * entry. Where it is not, every level costs a pass over the columns that are left. */
#include "linalg/scale.h"

#include <math.h>

#include "base/groups.h"
#include "base/sort.h"

enum { LARGEST = 511, UNSET = -1, UNSET_OTHER = -2, DONE = -3, NO_ENTRY = INT32_MIN };

static int32_t clamp(int32_t e)
{
    return e > LARGEST ? LARGEST : e < -LARGEST ? -LARGEST : e;
}

/* The e with |diagonal| 2^(2e) in [1/2, 2): minus half of floor(log2) + 1, rounded down. */
static int32_t unit_diagonal(int32_t log2)
{
    return clamp(-((log2 + 1 - ((log2 + 1) & 1)) / 2));
}

/* Where entry i of column j of a sparse matrix is stored, or NULL. */
static const double *find_entry(const perp__matrix *M, int32_t i, int32_t j)
{
    const perp__line l = perp__line_of(M, j);
    const int32_t k = perp__lower_bound(l.indices, l.count, i);

    return k < l.count && l.indices[k] == i ? l.values + k : NULL;
}

/* The rows of one level follow each other in the queue. Until a level is complete, `exponents`
 * holds for its rows the largest exponent of couplings to the level before, scaled on that side. */
typedef struct search {
    const perp__matrix *M;
    int32_t *exponents;
    int32_t *level; /* or UNSET, UNSET_OTHER: with a diagonal of the other sign, or DONE */
    int32_t *queue, queued;
    int32_t unset; /* rows that are left */
    int32_t symmetric;
    int32_t others; /* rows whose diagonal has the other sign */
    int32_t wanted; /* the kind of unset rows that the search goes to now */
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
    exponent = perp__exponent_of(value) + s->exponents[from];
    if (s->level[to] == s->wanted)
        enqueue(s, to, exponent, level);
    else if (s->level[to] == level && exponent > s->exponents[to])
        s->exponents[to] = exponent;
}

/* One level from the rows queue[begin..end), which are on `level`. */
static void spread_once(search *s, int32_t begin, int32_t end, int32_t level)
{
    const perp__matrix *M = s->M;
    const size_t rows = M->row_stride, columns = M->column_stride;

    /* 1. A dense matrix: the larger of the two couplings to each of them. */
    for (int32_t i = 0; i < M->rows && !M->column_starts; i++) {
        const double *row = M->values + (size_t)i * rows;
        const double *column = M->values + (size_t)i * columns;
        int32_t strongest = NO_ENTRY;

        for (int32_t k = begin; k < end && s->level[i] == s->wanted; k++) {
            const size_t j = (size_t)s->queue[k];
            const double first = fabs(row[j * columns]), second = fabs(column[j * rows]);
            const double larger = first > second ? first : second;
            const int32_t found =
                larger == 0.0 ? NO_ENTRY : perp__exponent_of(larger) + s->exponents[j];

            strongest = found > strongest ? found : strongest;
        }
        if (strongest != NO_ENTRY)
            enqueue(s, i, strongest, level + 1);
    }
    /* 2. A sparse one: the couplings in their columns, and the mirror images of these; */
    for (int32_t q = begin; q < end && M->column_starts; q++) {
        const int32_t j = s->queue[q];
        const perp__line l = perp__line_of(M, j);

        for (int32_t k = 0; k < l.count; k++) {
            const int32_t i = l.indices[k];

            if (s->level[i] >= 0 && s->level[i] <= s->level[j])
                continue;
            couple(s, j, i, l.values[k]);
            if (s->symmetric)
                couple(s, j, i, *find_entry(M, j, i));
        }
    }
    /* 3. without mirror images, those in their rows, which are somewhere in the columns after. */
    for (int32_t j = 0; j < M->columns && !s->symmetric; j++) {
        const perp__line l = perp__line_of(M, j);

        if (s->level[j] >= 0 && s->level[j] <= level)
            continue;
        for (int32_t k = 0; k < l.count; k++)
            if (s->level[l.indices[k]] == level)
                couple(s, l.indices[k], j, l.values[k]);
    }
    for (int32_t k = end; k < s->queued; k++)
        s->exponents[s->queue[k]] = clamp(-s->exponents[s->queue[k]]);
}

/* From the rows in the queue, on level 0, to all that hang together with them: no search after this
 * one changes theirs. */
static void spread(search *s)
{
    int32_t begin = 0, end, level;

    for (level = 0; begin < s->queued && s->unset > 0; level++) {
        end = s->queued;
        spread_once(s, begin, end, level);
        begin = end;
    }
    while (s->queued > 0)
        s->level[s->queue[--s->queued]] = DONE;
}

/* Rows whose diagonal has the other sign: the largest of it and of the couplings to the first ones
 * to a unit. A coupling that is noise beside the diagonal gives no row its scale. */
static void scale_other_diagonals(search *s)
{
    const int32_t begin = s->queued;

    if (s->others == 0)
        return;
    s->wanted = UNSET_OTHER;
    spread_once(s, 0, begin, 0);
    for (int32_t i = 0; i < s->M->rows; i++)
        if (s->level[i] == UNSET_OTHER)
            enqueue(s, i, LARGEST, 0);
    for (int32_t k = begin; k < s->queued; k++) {
        const int32_t row = s->queue[k];
        const int32_t exponent = unit_diagonal(perp__exponent_of(perp__entry(s->M, row, row)));

        s->level[s->queue[k]] = 0;
        if (exponent < s->exponents[s->queue[k]])
            s->exponents[s->queue[k]] = exponent;
    }
    s->wanted = UNSET;
}

/* largest[i] := log2 of the largest entry in row and column i of the scaled matrix. */
static void find_largest(const perp__matrix *M, const int32_t *exponents, int32_t *largest)
{
    for (int32_t i = 0; i < M->rows; i++)
        largest[i] = NO_ENTRY;
    for (int32_t j = 0; j < M->rows; j++) {
        const perp__line l = perp__line_of(M, j);

        for (int32_t k = 0; k < l.count; k++) {
            const int32_t i = l.indices ? l.indices[k] : k;
            int32_t size;

            if (l.values[k] == 0.0)
                continue;
            size = perp__exponent_of(l.values[k]) + exponents[i] + exponents[j];
            largest[i] = size > largest[i] ? size : largest[i];
            largest[j] = size > largest[j] ? size : largest[j];
        }
    }
}

/* Rounds of Ruiz' equilibration of the rows that are free, and of those that show noise. They end:
 * each halves what is positive of the largest exponents, and then what is negative, without making
 * others positive again. */
static void balance(const perp__matrix *M, int32_t *free, int32_t *exponents, int32_t *largest)
{
    bool changed = 1;

    while (changed) {
        find_largest(M, exponents, largest);
        changed = 0;
        for (int32_t i = 0; i < M->rows; i++) {
            const int32_t before = exponents[i];

            free[i] |= largest[i] >= PERP__NOISE;
            if (!free[i] || largest[i] == NO_ENTRY)
                continue;
            exponents[i] = clamp(before - largest[i] / 2);
            changed |= exponents[i] != before;
        }
    }
}

void perp__balance(const perp__matrix *M, int32_t *exponents, int32_t *work)
{
    for (int32_t i = 0; i < M->rows; i++)
        work[i] = 1;
    balance(M, work, exponents, work + M->rows);
}

/* Where entries of 2^40 and more are left, the scale of a row came from noise: such rows are
 * balanced, with those that have no positive diagonal. */
void perp__balance_noise(const perp__matrix *M, int32_t *exponents, int32_t *work)
{
    int32_t *largest = work + M->rows;
    int32_t noisy = 0, i;

    find_largest(M, exponents, largest);
    for (i = 0; i < M->rows; i++) {
        noisy |= largest[i] >= PERP__NOISE;
        work[i] = !(perp__entry(M, i, i) > 0.0);
    }
    if (noisy)
        balance(M, work, exponents, largest);
}

void perp__find_exponents(const perp__matrix *M, int32_t *exponents, int32_t *work)
{
    search s = {.M = M,
                .exponents = exponents,
                .level = work,
                .queue = work + M->rows,
                .unset = M->rows,
                .symmetric = 1,
                .wanted = UNSET};
    int32_t *parents = s.queue, i;

    /* 1. Rows whose diagonal is positive are on level 0; those with a negative one are marked. */
    for (i = 0; i < M->rows; i++) {
        const double diagonal = perp__entry(M, i, i);

        s.level[i] = UNSET;
        exponents[i] = NO_ENTRY;
        if (diagonal > 0.0) {
            enqueue(&s, i, unit_diagonal(perp__exponent_of(diagonal)), 0);
        } else if (diagonal != 0.0) {
            s.level[i] = UNSET_OTHER;
            s.others++;
        }
    }
    if (s.unset == 0) /* most problems: nothing else counts */
        return;
    /* 2. Breadth first from there, over columns alone where the pattern is symmetric. */
    for (int32_t j = 0; M->column_starts && j < M->columns && s.symmetric; j++)
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            s.symmetric &= find_entry(M, j, M->row_indices[k]) != NULL;
    scale_other_diagonals(&s);
    spread(&s);
    /* 3. What is left has no diagonal at all: each component starts at its lowest index, as if its
     * largest coupling were the diagonal, so that the size of M is shared out evenly. The queue
     * grows into parents that have been read: no more roots than rows up to there. */
    for (i = 0; i < M->rows; i++)
        parents[i] = i;
    for (int32_t j = 0; j < M->rows; j++) {
        const perp__line l = perp__line_of(M, j);

        for (int32_t k = 0; k < l.count && s.level[j] == UNSET; k++)
            if (l.values[k] != 0.0) {
                const int32_t e = perp__exponent_of(l.values[k]);

                i = l.indices ? l.indices[k] : k;
                perp__join(parents, i, j);
                exponents[i] = e > exponents[i] ? e : exponents[i];
                exponents[j] = e > exponents[j] ? e : exponents[j];
            }
    }
    for (i = 0; i < M->rows; i++)
        if (s.level[i] == UNSET && parents[i] == i)
            enqueue(&s, i, exponents[i] == NO_ENTRY ? 0 : unit_diagonal(exponents[i]), 0);
    spread(&s);
}

void perp__equilibrate(const perp__matrix *M, int32_t enabled, int32_t *exponents,
                       double *row_norms, int32_t *work)
{
    double largest = 0.0;

    if (enabled)
        perp__find_exponents(M, exponents, work);
    for (int32_t i = 0; i < M->rows && !enabled; i++)
        exponents[i] = 0;
    perp__scaled_row_norms(M, exponents, row_norms);
    for (int32_t i = 0; i < M->rows; i++)
        largest = row_norms[i] <= largest ? largest : row_norms[i];
    if (!enabled || largest < perp__power_of_two(PERP__NOISE))
        return;
    perp__balance_noise(M, exponents, work);
    perp__scaled_row_norms(M, exponents, row_norms);
}

int32_t perp__find_omegas(const perp__parts *parts, const double *q, const int32_t *exponents,
                          int32_t *of_part, int32_t *omegas, bool known)
{
    const int32_t n = parts->n, *part = parts->of;
    int32_t changed = !known, i;

    for (i = 0; i < parts->count; i++)
        of_part[i] = INT32_MIN;
    for (i = 0; i < n; i++) {
        const int32_t exponent = q[i] == 0.0 ? INT32_MIN : perp__exponent_of(q[i]) + exponents[i];

        if (exponent > of_part[part[i]])
            of_part[part[i]] = exponent;
    }
    for (i = 0; i < 2 * n; i++) {
        const int32_t found = of_part[part[i]], omega = found == INT32_MIN ? 0 : found;

        changed |= omegas[i] != omega;
        omegas[i] = omega;
    }
    return changed;
}
