/* Bodies that rows to what rests stop in part: a box on ice moves in three coordinates, and is at
 * rest in the others whatever it does in these. A row that lies in what stops its one body pulls at
 * the other alone, as if it led to the ground; so the rest goes up a stack without friction. A body
 * all rows of which are settled so moves by itself,
 *
 *   y = (E - B B') (C^-1 v_free + C'J_l'r_l)
 *
 * with B the rows that stop it (hold.h). */
#include <string.h>

#include "contact/hold/hold.h"

/* What is left of a row of length 1 that lies in others: rounding. */
#define ROUNDING 1e-12

/* x -= B B'x */
static void project_out(const perp__hold *h, int32_t block, double *x)
{
    const int32_t width = h->bodies->width;
    const double *basis = h->basis + (size_t)block * (size_t)width * (size_t)width;

    for (int32_t k = 0; k < h->rank[block]; k++) {
        const double share = perp__dot(basis + k * width, x, width);

        for (int32_t i = 0; i < width; i++)
            x[i] -= share * basis[k * width + i];
    }
}

static int32_t is_stopped(const perp__hold *h, int32_t block, const double *row)
{
    const int32_t width = h->bodies->width;
    double x[PERP__BODY_WIDTH_MOST], square = perp__dot(row, row, width);

    memcpy(x, row, (size_t)width * sizeof *x);
    project_out(h, block, x);
    return perp__dot(x, x, width) <= ROUNDING * ROUNDING * square;
}

/* Of row i of a constraint: the piece whose body nothing at rest stops along it. -1: there is none;
 * -2: there are several, or what is beside them moves. */
static int64_t loose_piece(const perp__hold *h, int32_t constraint, int32_t i)
{
    const perp__bodies *b = h->bodies;
    int64_t found = -1;

    if (h->pushed[constraint] || h->beside[constraint] != PERP__RIGID_AT_REST)
        return -2;
    for (int64_t at = b->piece_starts[constraint]; at < b->piece_starts[constraint + 1]; at++) {
        const int32_t block = b->piece_blocks[at];
        const int32_t beside = h->is_held[block] ? h->root[block] : h->source[block];

        if (beside != PERP__RIGID_AT_REST && (h->is_held[block] || beside != PERP__HOLD_UNSET))
            return -2; /* what stops it so far is not at rest */
        if (h->is_held[block] ||
            is_stopped(h, block, b->values + b->piece_values[at] + i * b->width))
            continue;
        if (found >= 0)
            return -2;
        found = at;
    }
    return found;
}

/* Takes up the rows that pull at one body alone, until there are no more. The queue is a ring of
 * the bodies whose rows have become more; `cluster` marks those in it. */
static void spread(perp__hold *h)
{
    const perp__bodies *b = h->bodies;
    int32_t first = 0, count = 0;

    for (int32_t k = 0; k < b->blocks; k++) {
        h->cluster[k] = !h->is_held[k] && h->rank[k] > 0;
        if (h->cluster[k])
            h->queue[count++] = k;
    }
    while (count > 0) {
        const int32_t visited = h->queue[first];

        first = (first + 1) % b->blocks;
        count--;
        h->cluster[visited] = 0;
        for (int64_t at = b->block_starts[visited]; at < b->block_starts[visited + 1]; at++)
            for (int32_t i = 0; i < h->holds[b->block_constraints[at]]; i++) {
                const int64_t piece = loose_piece(h, b->block_constraints[at], i);
                const int32_t block = piece < 0 ? -1 : b->piece_blocks[piece];
                const int32_t waits = block >= 0 && h->cluster[block];

                if (block < 0 || !perp__hold_take_up(
                                     h, block, b->values + b->piece_values[piece] + i * b->width))
                    continue;
                h->source[block] = PERP__RIGID_AT_REST;
                if (h->rank[block] == perp__bodies_unknowns(b, block))
                    perp__hold_block(h, block); /* has its own use for `cluster` */
                h->cluster[block] = 1;
                if (!waits)
                    h->queue[(first + count++) % b->blocks] = block;
            }
    }
}

void perp__hold_settle(perp__hold *h)
{
    const perp__bodies *b = h->bodies;
    const size_t width = (size_t)b->width;
    int32_t settled = 0;

    spread(h);
    for (int32_t k = 0; k < b->blocks; k++) { /* those of which no row pulls at another */
        int32_t is_settled = !h->is_held[k] && h->rank[k] > 0;

        for (int64_t at = b->block_starts[k]; is_settled && at < b->block_starts[k + 1]; at++)
            for (int32_t i = 0; is_settled && i < h->holds[b->block_constraints[at]]; i++)
                is_settled = loose_piece(h, b->block_constraints[at], i) == -1;
        if (is_settled)
            h->queue[settled++] = k;
    }
    for (int32_t k = 0; k < settled; k++) {
        const int32_t block = h->queue[k], count = perp__bodies_unknowns(b, block);
        double *y = h->y + (size_t)block * width, *v = h->v + (size_t)block * width;
        double unit[PERP__BODY_WIDTH_MOST] = {0.0};

        h->cluster[block] = 0;
        perp__hold_loose(h, &block, 1);
        memset(y, 0, width * sizeof *y);
        memcpy(y, h->loose, (size_t)count * sizeof *y);
        project_out(h, block, y);
        perp__bodies_from_own(b, block, y, v);
        for (int32_t i = 0; i < count; i++) {
            perp__bodies_own_row(b, block, i, unit);
            if (v[i] == 0.0 || is_stopped(h, block, unit))
                v[i] = 0.0; /* never -0.0 */
        }
        h->is_held[block] = 1;
    }
}

double perp__hold_along(const perp__hold *h, int32_t block, const double *row)
{
    if (h->source[block] == PERP__RIGID_AT_REST && is_stopped(h, block, row))
        return 0.0;
    return perp__dot(row, h->y + (size_t)block * (size_t)h->bodies->width, h->bodies->width);
}
