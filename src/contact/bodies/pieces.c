/* Each constraint's dense pieces of H L^-T, block by block. */
#include "contact/bodies/bodies.h"

#include <string.h>

static void layout_pieces(perp__arena *arena, void *object)
{
    perp__bodies *b = object;
    const size_t pieces = (size_t)b->pieces;

    b->block_constraints = perp__arena_take(arena, pieces, sizeof *b->block_constraints);
    b->block_pieces = perp__arena_take(arena, pieces, sizeof *b->block_pieces);
    b->piece_blocks = perp__arena_take(arena, pieces, sizeof *b->piece_blocks);
    b->piece_values = perp__arena_take(arena, pieces, sizeof *b->piece_values);
    b->cursors = perp__arena_take(arena, (size_t)b->most_pieces, sizeof *b->cursors);
    b->coupling = perp__arena_take(arena, (size_t)(b->most_rows * b->most_rows), sizeof(double));
    b->squares = perp__arena_take(arena, pieces, sizeof *b->squares);
    b->values = perp__arena_take(arena, (size_t)b->entries, sizeof *b->values);
}

typedef struct pieces {
    perp__bodies *bodies;
    int32_t first_row; /* of the matrix that is read */
    int32_t block;
    int64_t found;   /* pieces of the blocks so far */
    int32_t filling; /* 0: counting */
} pieces;

static void take_entry(void *user, int32_t row, int32_t column, double value)
{
    pieces *p = user;
    perp__bodies *b = p->bodies;
    const int32_t i = p->first_row + row, constraint = b->constraint_of[i];

    if (b->mark[constraint] != p->block + 1) {
        b->mark[constraint] = p->block + 1;
        if (p->filling) {
            const int64_t piece = b->piece_starts[constraint]++;

            b->piece_blocks[piece] = p->block;
        } else {
            b->piece_starts[constraint + 1]++;
        }
        p->found++;
    }
    if (p->filling) {
        const int64_t piece = b->piece_starts[constraint] - 1;

        b->values[b->piece_values[piece] + (int64_t)(i - b->rows[constraint]) * b->width +
                  b->place_of[column]] = value;
    }
}

static void visit_pieces(pieces *p, const perp__bodies_input *input)
{
    perp__bodies *b = p->bodies;

    memset(b->mark, 0, (size_t)b->constraints * sizeof *b->mark);
    p->found = 0;
    for (p->block = 0; p->block < b->blocks; p->block++) {
        b->block_starts[p->block] = p->found;
        for (int32_t place = 0; place < b->width; place++) {
            const int32_t column = b->dofs[(size_t)p->block * (size_t)b->width + (size_t)place];

            if (column < 0)
                continue;
            p->first_row = 0;
            perp__visit_column(input->H, column, take_entry, p);
            p->first_row = input->H->rows;
            if (input->G)
                perp__visit_column(input->G, column, take_entry, p);
        }
    }
    b->block_starts[b->blocks] = p->found;
}

static void count_pieces(perp__bodies *b, const perp__bodies_input *input)
{
    pieces p = {b, 0, 0, 0, 0};

    memset(b->piece_starts, 0, ((size_t)b->constraints + 1) * sizeof *b->piece_starts);
    visit_pieces(&p, input);
    b->pieces = p.found;
    b->most_pieces = 0;
    b->entries = 0;
    for (int32_t k = 0; k < b->constraints; k++) {
        const int64_t count = b->piece_starts[k + 1];

        if (count > b->most_pieces)
            b->most_pieces = (int32_t)count;
        b->entries += count * (b->rows[k + 1] - b->rows[k]) * b->width;
        b->piece_starts[k + 1] += b->piece_starts[k];
    }
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

/* Each row h of a piece becomes h L^-T. */
static void scale_pieces(perp__bodies *b)
{
    const int32_t width = b->width;

    for (int32_t k = 0; k < b->constraints; k++)
        for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
            const double *L = b->factors + (size_t)b->piece_blocks[piece] * (size_t)(width * width);
            const int32_t unknowns = b->sizes[b->piece_blocks[piece]];
            double *P = b->values + b->piece_values[piece];

            /* all rows' divisions at once */
            for (int32_t j = 0; j < unknowns; j++)
                for (int32_t row = 0; row < b->rows[k + 1] - b->rows[k]; row++) {
                    double *x = P + row * width, sum = x[j];

                    for (int32_t i = 0; i < j; i++)
                        sum -= x[i] * L[j * width + i];
                    x[j] = sum / L[j * width + j];
                }
        }
}

static void fill_pieces(perp__bodies *b, const perp__bodies_input *input)
{
    pieces p = {b, 0, 0, 0, 1};
    int64_t at = 0;

    for (int32_t k = 0; k < b->constraints; k++)
        for (int64_t piece = b->piece_starts[k]; piece < b->piece_starts[k + 1]; piece++) {
            b->piece_values[piece] = at;
            at += (int64_t)(b->rows[k + 1] - b->rows[k]) * b->width;
        }
    memset(b->values, 0, (size_t)b->entries * sizeof *b->values);
    visit_pieces(&p, input); /* moves each start to the next constraint's */
    memmove(b->piece_starts + 1, b->piece_starts, (size_t)b->constraints * sizeof *b->piece_starts);
    b->piece_starts[0] = 0;
    perp__bodies_list_constraints(b);
    scale_pieces(b);
}

perp_status perp__bodies_fill_pieces(perp__bodies *bodies, const perp__bodies_input *input)
{
    perp_status status;

    count_pieces(bodies, input);
    status = perp__arena_fit(&bodies->pieces_arena, bodies->context, layout_pieces, bodies);
    if (status == PERP_OK)
        fill_pieces(bodies, input);
    return status;
}
