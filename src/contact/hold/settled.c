/* Bodies that rows to what rests stop in part: a box on ice moves in three coordinates, and is at
 * rest in the others whatever it does in these. A row that lies in what stops its one body pulls at
 * the other alone, as if it led to the ground; so the rest goes up a stack without friction. A body
 * all rows of which are settled so moves by itself,
 *
 *   y = (E - B B') (C^-1 v_free + C'J_l'r_l)
 *
 * with B the rows that stop it (hold.h). */
#include <math.h>
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

/* Whether all that stops a block so far is at rest. */
static int32_t stops_at_rest(const perp__hold *h, int32_t block)
{
    return h->is_held[block]
               ? h->root[block] == PERP__RIGID_AT_REST
               : h->source[block] == PERP__RIGID_AT_REST || h->source[block] == PERP__HOLD_UNSET;
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

        if (!stops_at_rest(h, block))
            return -2;
        if (h->is_held[block] ||
            is_stopped(h, block, b->values + b->piece_values[at] + i * b->width))
            continue;
        if (found >= 0)
            return -2;
        found = at;
    }
    return found;
}

/* Bodies whose rows have become more, a ring. */
typedef struct ring {
    int32_t first, count;
} ring;

static void push(perp__hold *h, ring *r, int32_t block)
{
    if (h->cluster[block])
        return;
    h->cluster[block] = 1;
    h->queue[(r->first + r->count++) % h->bodies->blocks] = block;
}

/* Takes up the rows of a constraint that pull at one body alone. */
static void take_up_rows(perp__hold *h, int32_t constraint, ring *r)
{
    const perp__bodies *b = h->bodies;

    for (int32_t i = 0; i < h->holds[constraint]; i++) {
        const int64_t piece = loose_piece(h, constraint, i);
        const int32_t block = piece < 0 ? -1 : b->piece_blocks[piece];

        if (block < 0 ||
            !perp__hold_take_up(h, block, b->values + b->piece_values[piece] + i * b->width))
            continue;
        h->source[block] = PERP__RIGID_AT_REST;
        if (h->rank[block] == perp__bodies_unknowns(b, block))
            perp__hold_block(h, block);
        h->cluster[block] = 0;
        push(h, r, block);
    }
}

static void spread(perp__hold *h)
{
    const perp__bodies *b = h->bodies;
    ring r = {0, 0};

    memset(h->cluster, 0, (size_t)b->blocks * sizeof *h->cluster);
    for (int32_t k = 0; k < b->blocks; k++)
        if (!h->is_held[k] && h->rank[k] > 0)
            push(h, &r, k);
    while (r.count > 0) {
        const int32_t block = h->queue[r.first];

        r.first = (r.first + 1) % b->blocks;
        r.count--;
        h->cluster[block] = 0;
        for (int64_t at = b->block_starts[block]; at < b->block_starts[block + 1]; at++)
            take_up_rows(h, b->block_constraints[at], &r);
    }
}

static int32_t is_settled(const perp__hold *h, int32_t block)
{
    const perp__bodies *b = h->bodies;

    if (h->is_held[block] || h->rank[block] == 0)
        return 0;
    for (int64_t at = b->block_starts[block]; at < b->block_starts[block + 1]; at++)
        for (int32_t i = 0; i < h->holds[b->block_constraints[at]]; i++)
            if (loose_piece(h, b->block_constraints[at], i) != -1)
                return 0;
    return 1;
}

/* v of a block by itself, with exact zeros where it is stopped. */
static void move(perp__hold *h, int32_t block)
{
    const size_t width = (size_t)h->bodies->width, at = (size_t)block * width;
    const int32_t count = perp__bodies_unknowns(h->bodies, block);
    double unit[PERP__BODY_WIDTH_MOST] = {0.0};

    h->cluster[block] = 0;
    perp__hold_loose(h, &block, 1);
    memset(h->y + at, 0, width * sizeof *h->y);
    memcpy(h->y + at, h->loose, (size_t)count * sizeof *h->y);
    project_out(h, block, h->y + at);
    perp__bodies_from_own(h->bodies, block, h->y + at, h->v + at);
    for (int32_t i = 0; i < count; i++) {
        perp__bodies_own_row(h->bodies, block, i, unit);
        if (h->v[at + (size_t)i] == 0.0 || is_stopped(h, block, unit))
            h->v[at + (size_t)i] = 0.0; /* never -0.0 */
    }
    h->is_held[block] = 1;
}

void perp__hold_settle(perp__hold *h)
{
    const int32_t blocks = h->bodies->blocks;
    int32_t count = 0;

    spread(h);
    for (int32_t k = 0; k < blocks; k++)
        if (is_settled(h, k))
            h->queue[count++] = k;
    for (int32_t k = 0; k < count; k++)
        move(h, h->queue[k]);
}

double perp__hold_along(const perp__hold *h, int32_t block, const double *row)
{
    if (h->source[block] == PERP__RIGID_AT_REST && is_stopped(h, block, row))
        return 0.0;
    return perp__dot(row, h->y + (size_t)block * (size_t)h->bodies->width, h->bodies->width);
}
