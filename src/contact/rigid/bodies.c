/* Blocks and pieces straight from rigid bodies: with M^-1 = C C' a body is a block of its own, in
 * which L^-T = C, and its piece of a contact is P = J C. */
#include <string.h>

#include "contact/bodies/bodies.h"
#include "contact/contact.h"
#include "linalg/lanes/multiversion.h"

static void layout(perp__arena *arena, void *object)
{
    perp__bodies *b = object;

    perp__bodies_layout_constraints(arena, b);
    PERP__DOUBLES(arena, (size_t)b->n, &b->y, &b->free);
    b->block_starts = perp__arena_take(arena, (size_t)b->blocks + 1, sizeof *b->block_starts);
    perp__bodies_layout_pieces(arena, b);
}

/* P := J C, one row after the other; the sums in the order of J's columns. */
PERP__KERNEL static void whiten(const double (*J)[6], const double *C, int32_t width, int32_t rows,
                                double *P)
{
    for (int32_t r = 0; r < rows; r++, P += width) {
        for (int32_t j = 0; j < width; j++)
            P[j] = J[r][0] * C[j];
        for (int32_t i = 1; i < width; i++)
            for (int32_t j = 0; j < width; j++)
                P[j] += J[r][i] * C[width * i + j];
    }
}

/* The pieces of a constraint: rows from..from + count - 1 of g, on its bodies, ascending. */
PERP__KERNEL static void add_constraint(perp__bodies *b, const perp__rigid_problem *problem,
                                        const perp__rigid_rows *g, int32_t constraint, int32_t from,
                                        int32_t count)
{
    const int32_t width = b->width, first = g->body[0] > g->body[1];
    int64_t piece = b->piece_starts[constraint], at = b->entries;

    for (int32_t turn = 0; turn < 2; turn++) {
        const int32_t side = turn ^ first, body = g->body[side];
        const double *C;

        if (!perp__rigid_moves(problem, body))
            continue;
        C = problem->factors + (size_t)body * (size_t)(width * width);
        b->piece_blocks[piece] = body;
        b->piece_values[piece++] = at;
        b->block_starts[body + 1]++;
        if (width == 6 && count == 3)
            whiten(g->rows[side], C, 6, 3, b->values + at);
        else if (width == 6)
            whiten(g->rows[side] + from, C, 6, count, b->values + at);
        else
            whiten(g->rows[side] + from, C, width, count, b->values + at);
        at += count * width;
    }
    b->entries = at;
    b->piece_starts[constraint + 1] = piece;
    b->rows[constraint + 1] = b->rows[constraint] + count;
    for (int32_t i = b->rows[constraint]; i < b->rows[constraint + 1]; i++)
        b->constraint_of[i] = constraint;
}

PERP__MULTIVERSION(add, (perp__bodies * b, const perp__rigid_problem *problem), (b, problem))
{
    int32_t constraint = 0;

    for (; constraint < problem->contacts; constraint++)
        add_constraint(b, problem, problem->rows + constraint, constraint, 0,
                       problem->rows[constraint].dim);
    for (int32_t k = 0; k < problem->joints; k++) {
        const perp__rigid_rows *g = problem->rows + problem->contacts + k;

        for (int32_t i = 0; i < g->dim; i++)
            add_constraint(b, problem, g, constraint++, i, 1);
    }
}

perp_status perp__bodies_setup_rigid(perp__bodies *b, const perp__rigid_problem *problem)
{
    perp_status status;

    b->contacts = problem->contacts;
    b->size = b->constraints = 0;
    for (int32_t k = 0; k < problem->contacts + problem->joints; k++)
        b->size += problem->rows[k].dim;
    for (int32_t k = problem->contacts; k < problem->contacts + problem->joints; k++)
        b->constraints += problem->rows[k].dim;
    b->constraints += problem->contacts;
    b->width = problem->width;
    b->blocks = problem->bodies;
    b->n = b->blocks * b->width;
    b->C = problem->factors;
    b->v_free = problem->free;
    b->most_pieces = 2;
    b->most_rows = 3;
    b->pieces = 2 * (int64_t)b->constraints; /* at most */
    b->entries = 2 * (int64_t)b->size * b->width;
    status = perp__arena_fit_sizes(&b->constraints_arena, b->context, layout, b, b->fitted,
                                   (size_t[]){(size_t)b->constraints, (size_t)b->size,
                                              (size_t)b->size * (size_t)b->width, (size_t)b->blocks,
                                              (size_t)b->n},
                                   5);
    if (status != PERP_OK)
        return status;
    for (int32_t k = 0, row = 0; k < problem->contacts + problem->joints; k++)
        for (int32_t i = 0; i < problem->rows[k].dim; i++)
            b->compliance[row++] = problem->rows[k].compliance[i];
    memset(b->block_starts, 0, ((size_t)b->blocks + 1) * sizeof *b->block_starts);
    b->rows[0] = 0;
    b->piece_starts[0] = b->entries = 0;
    add(b, problem);
    b->pieces = b->piece_starts[b->constraints];
    for (int32_t k = 0; k < b->blocks; k++)
        b->block_starts[k + 1] += b->block_starts[k];
    perp__bodies_list_constraints(b);
    return PERP_OK;
}
