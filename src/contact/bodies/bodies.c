/* From a caller's M and H to blocks, factors and each constraint's dense pieces of H L^-T. */
#include "contact/bodies/bodies.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/groups.h"
#include "linalg/pivoting.h"

void perp__bodies_release(perp__bodies *bodies)
{
    perp__arena_release(&bodies->constraints_arena);
    perp__arena_release(&bodies->blocks_arena);
    perp__arena_release(&bodies->pieces_arena);
}

void perp__bodies_layout_constraints(perp__arena *arena, void *object)
{
    perp__bodies *b = object;
    const size_t n = (size_t)b->n, constraints = (size_t)b->constraints, size = (size_t)b->size;

    PERP__INTEGERS(arena, n, &b->block_of, &b->place_of);
    b->rows = perp__arena_take(arena, constraints + 1, sizeof *b->rows);
    b->constraint_of = perp__arena_take(arena, size, sizeof *b->constraint_of);
    b->compliance = perp__arena_take(arena, size, sizeof *b->compliance);
    b->piece_starts = perp__arena_take(arena, constraints + 1, sizeof *b->piece_starts);
    b->mark = perp__arena_take(arena, (n > constraints ? n : constraints) + 1, sizeof *b->mark);
}

static void layout_blocks(perp__arena *arena, void *object)
{
    perp__bodies *b = object;
    const size_t padded = (size_t)b->blocks * (size_t)b->width;

    b->sizes = perp__arena_take(arena, (size_t)b->blocks, sizeof *b->sizes);
    b->dofs = perp__arena_take(arena, padded, sizeof *b->dofs);
    b->factors = perp__arena_take(arena, padded, (size_t)b->width * sizeof *b->factors);
    PERP__DOUBLES(arena, padded, &b->y, &b->free);
    b->block_starts = perp__arena_take(arena, (size_t)b->blocks + 1, sizeof *b->block_starts);
}

void perp__bodies_layout_pieces(perp__arena *arena, void *object)
{
    perp__bodies *b = object;
    const size_t pieces = (size_t)b->pieces;

    PERP__INTEGERS(arena, pieces, &b->block_constraints, &b->piece_blocks);
    b->block_pieces = perp__arena_take(arena, pieces, sizeof *b->block_pieces);
    b->piece_values = perp__arena_take(arena, pieces, sizeof *b->piece_values);
    b->cursors = perp__arena_take(arena, (size_t)b->most_pieces, sizeof *b->cursors);
    b->coupling = perp__arena_take(arena, (size_t)(b->most_rows * b->most_rows), sizeof(double));
    b->squares = perp__arena_take(arena, pieces, sizeof *b->squares);
    b->values = perp__arena_take(arena, (size_t)b->entries, sizeof *b->values);
}

/* The entries of a column, of which some may be 0. */
typedef struct column {
    int32_t count;
    size_t step;
    const int32_t *rows; /* NULL: 0, 1, 2, ... */
    const double *values;
} column;

static inline column column_of(const perp__matrix *A, int32_t j)
{
    if (A->column_starts)
        return (column){A->column_starts[j + 1] - A->column_starts[j], 1,
                        A->row_indices + A->column_starts[j], A->values + A->column_starts[j]};
    return (column){A->rows, A->row_stride, NULL, A->values + (size_t)j * A->column_stride};
}

/* ---- blocks ---------------------------------------------------------------------------------- */

static bool find_blocks(perp__bodies *b, const perp__bodies_input *input)
{
    int32_t *parents = b->mark, apart[2] = {0, 0}; /* some entry joins two groups of 3; of 6 */

    /* 1. The components; no block has room for more than so many entries of a column. */
    for (int32_t i = 0; i < b->n; i++)
        parents[i] = i;
    for (int32_t j = 0; j < b->n; j++) {
        const column c = column_of(input->M, j);
        int32_t count = 0;

        for (int32_t k = 0; k < c.count; k++) {
            const int32_t i = c.rows ? c.rows[k] : k;

            if (c.values[(size_t)k * c.step] == 0.0)
                continue;
            count++;
            apart[0] |= i / 3 != j / 3;
            apart[1] |= i / 6 != j / 6;
            perp__join(parents, i, j);
        }
        if (count > PERP__BODY_WIDTH_MOST)
            return 0;
    }

    /* 2. Groups, where they do: planar bodies have 3 unknowns, others 6. */
    for (int32_t k = 0; k < 2; k++) {
        const int32_t sixes = (b->most_rows == 2) == k, g = sixes ? 6 : 3;

        if (b->n % g != 0 || apart[sixes])
            continue;
        for (int32_t i = 0; i < b->n; i++) {
            b->block_of[i] = i / g;
            b->place_of[i] = i % g;
        }
        b->blocks = b->n / g;
        b->width = g;
        return 1;
    }

    /* 3. Else the components, in the order of their first unknowns. */
    b->blocks = perp__number_parts(parents, b->n);
    b->width = 0;
    for (int32_t i = 0; i < b->n; i++)
        b->block_of[i] = parents[i];
    memset(parents, 0, (size_t)b->n * sizeof *parents); /* now: how many there are */
    for (int32_t i = 0; i < b->n; i++) {
        b->place_of[i] = parents[b->block_of[i]]++;
        if (b->place_of[i] + 1 > b->width)
            b->width = b->place_of[i] + 1;
    }
    return b->width <= PERP__BODY_WIDTH_MOST;
}

static perp_status fill_blocks(perp__bodies *b, const perp__bodies_input *input)
{
    const size_t width = (size_t)b->width, padded = (size_t)b->blocks * width;

    memset(b->free, 0, padded * sizeof *b->free);
    memset(b->factors, 0, padded * width * sizeof *b->factors);
    memset(b->sizes, 0, (size_t)b->blocks * sizeof *b->sizes);
    for (size_t k = 0; k < padded; k++)
        b->dofs[k] = -1;
    for (int32_t j = 0; j < b->n; j++) {
        const column c = column_of(input->M, j);
        double *L = b->factors + (size_t)b->block_of[j] * width * width + b->place_of[j];

        b->dofs[(size_t)b->block_of[j] * width + (size_t)b->place_of[j]] = j;
        b->sizes[b->block_of[j]]++;
        for (int32_t k = 0; k < c.count; k++) {
            const int32_t i = c.rows ? c.rows[k] : k;

            if (b->block_of[i] == b->block_of[j] && b->place_of[i] >= b->place_of[j])
                L[(size_t)b->place_of[i] * width] = c.values[(size_t)k * c.step];
        }
    }
    for (size_t k = 0; k < padded; k++)
        if (b->dofs[k] < 0)
            b->factors[k * width + k % width] = 1.0;
    for (int32_t block = 0; block < b->blocks; block++) {
        double *L = b->factors + (size_t)block * width * width;

        for (size_t j = 0; j < width; j++) { /* in place of the lower triangle */
            double pivot = L[j * width + j];

            for (size_t k = 0; k < j; k++)
                pivot -= L[j * width + k] * L[j * width + k];
            if (!(pivot > DBL_EPSILON * L[j * width + j]))
                return perp__refuse(b->context, "M is not positive definite: found at unknown %d",
                                    (int)b->dofs[(size_t)block * width + j]);
            L[j * width + j] = sqrt(pivot);
            for (size_t i = j + 1; i < width; i++) {
                double sum = L[i * width + j];

                for (size_t k = 0; k < j; k++)
                    sum -= L[i * width + k] * L[j * width + k];
                L[i * width + j] = sum / L[j * width + j];
            }
        }
    }
    return PERP_OK;
}

/* ---- pieces ---------------------------------------------------------------------------------- */

/* Block by block, column by column: the pieces of each constraint are counted in piece_starts; or
 * filled in, where each start is moved to the next constraint's. Returns how many there are. */
static int64_t visit_pieces(perp__bodies *b, const perp__bodies_input *input, bool fills)
{
    const int32_t width = b->width;
    int64_t found = 0;

    memset(b->mark, 0, (size_t)b->constraints * sizeof *b->mark);
    for (int32_t place = 0; place < b->blocks * width; place++) {
        const int32_t block = place / width, dof = b->dofs[place];

        if (place % width == 0)
            b->block_starts[block] = found;
        for (int32_t of_G = 0; of_G < (input->G ? 2 : 1) && dof >= 0; of_G++) {
            const column c = column_of(of_G ? input->G : input->H, dof);

            for (int32_t e = 0; e < c.count; e++) {
                const double value = c.values[(size_t)e * c.step];
                const int32_t i = (of_G ? input->H->rows : 0) + (c.rows ? c.rows[e] : e);
                const int32_t k = b->constraint_of[i];

                if (value == 0.0)
                    continue;
                if (b->mark[k] != block + 1) { /* its first entry on this block */
                    b->mark[k] = block + 1;
                    found++;
                    if (fills)
                        b->piece_blocks[b->piece_starts[k]] = block;
                    b->piece_starts[fills ? k : k + 1]++;
                }
                if (fills)
                    b->values[b->piece_values[b->piece_starts[k] - 1] +
                              (int64_t)(i - b->rows[k]) * width + place % width] = value;
            }
        }
    }
    b->block_starts[b->blocks] = found;
    return found;
}

void perp__bodies_list_constraints(perp__bodies *b)
{
    for (int32_t k = 0; k < b->constraints; k++)
        for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
            const int64_t at = b->block_starts[b->piece_blocks[piece]]++;

            b->block_constraints[at] = k;
            b->block_pieces[at] = piece;
        }
    memmove(b->block_starts + 1, b->block_starts, (size_t)b->blocks * sizeof *b->block_starts);
    b->block_starts[0] = 0;
}

static perp_status fill_pieces(perp__bodies *b, const perp__bodies_input *input)
{
    const int32_t width = b->width;
    int64_t at = 0;
    perp_status status;

    /* 1. How many. */
    memset(b->piece_starts, 0, ((size_t)b->constraints + 1) * sizeof *b->piece_starts);
    b->pieces = visit_pieces(b, input, 0);
    b->most_pieces = 0;
    b->entries = 0;
    for (int32_t k = 0; k < b->constraints; k++) {
        const int64_t count = b->piece_starts[k + 1];

        if (count > b->most_pieces)
            b->most_pieces = (int32_t)count;
        b->entries += count * (b->rows[k + 1] - b->rows[k]) * width;
        b->piece_starts[k + 1] += b->piece_starts[k];
    }
    status = perp__arena_fit(&b->pieces_arena, b->context, perp__bodies_layout_pieces, b);
    if (status != PERP_OK)
        return status;

    /* 2. Their entries. */
    for (int32_t k = 0; k < b->constraints; k++)
        for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
            b->piece_values[piece] = at;
            at += (int64_t)(b->rows[k + 1] - b->rows[k]) * width;
        }
    memset(b->values, 0, (size_t)b->entries * sizeof *b->values);
    (void)visit_pieces(b, input, 1);
    memmove(b->piece_starts + 1, b->piece_starts, (size_t)b->constraints * sizeof *b->piece_starts);
    b->piece_starts[0] = 0;
    perp__bodies_list_constraints(b);

    /* 3. Each row h of a piece becomes h L^-T: all rows' divisions at once. */
    for (int32_t k = 0; k < b->constraints; k++)
        for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
            const double *L = b->factors + (size_t)b->piece_blocks[piece] * (size_t)(width * width);
            double *P = b->values + b->piece_values[piece];

            for (int32_t j = 0; j < b->sizes[b->piece_blocks[piece]]; j++)
                for (int32_t row = 0; row < b->rows[k + 1] - b->rows[k]; row++) {
                    double *x = P + row * width, sum = x[j];

                    for (int32_t i = 0; i < j; i++)
                        sum -= x[i] * L[j * width + i];
                    x[j] = sum / L[j * width + j];
                }
        }
    return PERP_OK;
}

perp_status perp__bodies_setup(perp__bodies *b, const perp__bodies_input *input, int32_t *suits)
{
    int32_t row = 0;
    perp_status status;

    b->n = input->n;
    b->contacts = input->contacts;
    b->size = input->size;
    b->constraints = input->contacts + input->size - input->starts[input->contacts];
    b->most_rows = 1;
    status = perp__arena_fit(&b->constraints_arena, b->context, perp__bodies_layout_constraints, b);
    if (status != PERP_OK)
        return status;
    for (int32_t k = 0; k < b->constraints; k++) {
        const int32_t rows = k < input->contacts ? input->starts[k + 1] - input->starts[k] : 1;

        b->rows[k] = row;
        if (rows > b->most_rows)
            b->most_rows = rows;
        for (int32_t i = 0; i < rows; i++)
            b->constraint_of[row++] = k;
    }
    b->rows[b->constraints] = row;
    for (int32_t i = 0; i < b->size; i++)
        b->compliance[i] = input->compliance ? input->compliance[i] : 0.0;
    *suits = find_blocks(b, input);
    if (!*suits)
        return PERP_OK;
    status = perp__arena_fit(&b->blocks_arena, b->context, layout_blocks, b);
    PERP__THEN(status, fill_blocks(b, input));
    PERP__THEN(status, fill_pieces(b, input));
    return status;
}

/* ---- the bodies' own coordinates y, in which M is the identity: v = C y with C = L^-T of a block
 * ---- */

void perp__bodies_to_own(const perp__bodies *b, int32_t block, const double *v, double *y)
{
    const int32_t width = b->width;

    memmove(y, v, (size_t)width * sizeof *y);
    perp__solve_small(b->C + (size_t)block * (size_t)(width * width), width, width, y, 1);
}

void perp__bodies_from_own(const perp__bodies *b, int32_t block, const double *y, double *v)
{
    const int32_t width = b->width;
    const size_t at = (size_t)block * (size_t)(width * width);

    for (int32_t i = width - 1; i >= 0; i--) {
        double sum = b->C ? 0.0 : y[i];

        for (int32_t j = 0; b->C && j < width; j++)
            sum += b->C[at + (size_t)(i * width + j)] * y[j];
        for (int32_t j = i + 1; !b->C && j < width; j++)
            sum -= b->factors[at + (size_t)(j * width + i)] * v[j];
        v[i] = b->C ? sum : sum / b->factors[at + (size_t)(i * width + i)];
    }
}

void perp__bodies_own_row(const perp__bodies *b, int32_t block, int32_t i, double *row)
{
    const int32_t width = b->width;
    const size_t at = (size_t)block * (size_t)(width * width);

    if (b->C) {
        memcpy(row, b->C + at + (size_t)(i * width), (size_t)width * sizeof *row);
        return;
    }
    for (int32_t k = 0; k < width; k++) { /* L^-1 e_i, whose transpose is e_i' L^-T */
        double sum = k == i;

        for (int32_t j = i; j < k; j++)
            sum -= b->factors[at + (size_t)(k * width + j)] * row[j];
        row[k] = k < i ? 0.0 : sum / b->factors[at + (size_t)(k * width + k)];
    }
}

void perp__bodies_own_free(const perp__bodies *b, int32_t block, double *y)
{
    const size_t at = (size_t)block * (size_t)b->width;

    if (b->C)
        perp__bodies_to_own(b, block, b->v_free + at, y);
    else
        memcpy(y, b->free + at, (size_t)b->width * sizeof *y);
}
