/* The pattern of the systems of newton/bodies.h. */
#include "contact/newton/bodies.h"

#include <string.h>

#include "contact/newton/matrix.h"

/* The blocks that share a contact with block q: q itself, then the others in no order. Returns how
 * many; writes them unless `found` is NULL. The bodies' marks serve as the set, see clear_marks. */
static int32_t neighbours(const perp__bodies *b, int32_t q, int32_t *found)
{
    int32_t count = 0;

    b->mark[q] = q;
    if (found)
        found[count] = q;
    count++;
    for (int64_t at = b->block_starts[q]; at < b->block_starts[q + 1]; at++) {
        int32_t unit = b->block_units[at];

        if (unit >= b->contacts)
            continue;
        for (int64_t piece = b->piece_starts[unit]; piece < b->piece_starts[unit + 1]; piece++) {
            int32_t p = b->piece_blocks[piece];

            if (b->mark[p] == q)
                continue;
            b->mark[p] = q;
            if (found)
                found[count] = p;
            count++;
        }
    }
    return count;
}

static void clear_marks(const perp__bodies *b)
{
    for (int32_t k = 0; k < b->blocks; k++)
        b->mark[k] = -1;
}

int64_t perp__newton_bodies_entries(const perp__bodies *b)
{
    const int64_t width = b->width;
    int64_t entries = b->units - b->contacts;

    clear_marks(b);
    for (int32_t k = 0; k < b->blocks; k++)
        entries += neighbours(b, k, NULL) * width * width;
    return entries + 2 * (b->piece_starts[b->units] - b->piece_starts[b->contacts]) * width;
}

/* Pairs of pieces of a contact, and pieces of bilateral rows. */
static size_t slot_count(const perp__bodies *b)
{
    size_t count = 0;

    for (int32_t k = 0; k < b->units; k++) {
        size_t pieces = (size_t)(b->piece_starts[k + 1] - b->piece_starts[k]);

        count += k < b->contacts ? pieces * pieces : pieces;
    }
    return count;
}

void perp__newton_bodies_layout(perp__arena *arena, perp__newton_bodies *own,
                                const perp__contact_problem *problem)
{
    const perp__bodies *b = problem->bodies;
    size_t order = (size_t)b->blocks * (size_t)b->width + (size_t)(b->units - b->contacts);
    size_t entries = (size_t)perp__newton_bodies_entries(b);

    own->bodies = b;
    own->order = (int32_t)order;
    own->column_starts = perp__arena_take(arena, order + 1, sizeof(int32_t));
    own->row_indices = perp__arena_take(arena, entries, sizeof(int32_t));
    own->values = perp__arena_take(arena, entries, sizeof(double));
    own->slots = perp__arena_take(arena, slot_count(b), sizeof(int64_t));
    own->inverses = perp__arena_take(arena, 9 * (size_t)b->contacts, sizeof(double));
    own->y = perp__arena_take(arena, order, sizeof(double));
    PERP__DOUBLES(arena, (size_t)b->size, &own->full, &own->image);
}

static void sort(int32_t *x, int32_t count)
{
    int32_t j;

    for (int32_t i = 1; i < count; i++) {
        int32_t moved = x[i];

        for (j = i; j > 0 && x[j - 1] > moved; j--)
            x[j] = x[j - 1];
        x[j] = moved;
    }
}

/* The columns of block q: its neighbours' rows, then the bilateral rows that touch it. */
static int32_t read_columns(perp__newton_bodies *own, int32_t q, int32_t at)
{
    const perp__bodies *b = own->bodies;
    const int32_t width = b->width;
    int32_t *list = own->row_indices + at; /* room for one column at least */
    int32_t count = neighbours(b, q, list), height = count * width, i, c;

    sort(list, count);
    for (i = count - 1; i >= 0; i--) {
        int32_t block = list[i];

        for (c = width - 1; c >= 0; c--)
            list[i * width + c] = block * width + c;
    }
    for (int64_t k = b->block_starts[q]; k < b->block_starts[q + 1]; k++)
        if (b->block_units[k] >= b->contacts)
            list[height++] = b->blocks * width + b->block_units[k] - b->contacts;
    for (c = 0; c < width; c++) {
        own->column_starts[q * width + c] = at + c * height;
        if (c > 0)
            memcpy(list + c * height, list, (size_t)height * sizeof *list);
    }
    return at + width * height;
}

static int32_t read_bilateral(perp__newton_bodies *own, int32_t unit, int32_t at)
{
    const perp__bodies *b = own->bodies;
    const int32_t row = b->blocks * b->width + unit - b->contacts;

    own->column_starts[row] = at;
    for (int64_t piece = b->piece_starts[unit]; piece < b->piece_starts[unit + 1]; piece++)
        for (int32_t c = 0; c < b->width; c++)
            own->row_indices[at++] = b->piece_blocks[piece] * b->width + c;
    own->row_indices[at++] = row;
    return at;
}

int64_t perp__newton_bodies_find(const perp__newton_bodies *own, int32_t column, int32_t row)
{
    int32_t low = own->column_starts[column], high = own->column_starts[column + 1] - 1;

    while (low < high) {
        int32_t middle = low + (high - low) / 2;

        if (own->row_indices[middle] < row)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static void find_slots(perp__newton_bodies *own)
{
    const perp__bodies *b = own->bodies;
    const int32_t width = b->width;
    int64_t p, q, slot = 0;

    for (int32_t k = 0; k < b->units; k++)
        for (q = b->piece_starts[k]; q < b->piece_starts[k + 1]; q++) {
            int32_t column = b->piece_blocks[q] * width;

            if (k >= b->contacts)
                own->slots[slot++] =
                    perp__newton_bodies_find(own, column, b->blocks * width + k - b->contacts);
            for (p = b->piece_starts[k]; p < b->piece_starts[k + 1] && k < b->contacts; p++)
                own->slots[slot++] =
                    perp__newton_bodies_find(own, column, b->piece_blocks[p] * width);
        }
}

perp_status perp__newton_bodies_read(perp__newton_bodies *own, const perp__newton_blocks *blocks,
                                     const perp__contact_problem *problem)
{
    const perp__bodies *b = own->bodies;
    perp__square A = {own->order, own->values, own->column_starts, own->row_indices};
    int32_t at = 0, k;

    own->blocks = blocks;
    clear_marks(b);
    for (k = 0; k < b->blocks; k++)
        at = read_columns(own, k, at);
    for (k = b->contacts; k < b->units; k++)
        at = read_bilateral(own, k, at);
    own->column_starts[own->order] = at;
    find_slots(own);
    return perp__kept_factor_analyse(&own->factor, problem->context, &perp__factor_klu, &A);
}
